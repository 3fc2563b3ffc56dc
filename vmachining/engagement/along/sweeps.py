"""The sweeps of a program as rows of the kernels: closed forms where cutter and motion have them, exact distances elsewhere."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy
from itertools import groupby, islice
from typing import Any, NamedTuple, Self

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engagement.along.kernels.distance_kernels import (
    BALL,
    CIRCLE,
    EXACT,
    HELIX,
    LEVEL,
    POSES,
    RAMP,
    Rows,
)
from vmachining.engagement.along.kernels.margin_kernels import World
from vmachining.engagement.workpiece import SLIDING_MM, Past
from vmachining.errors import StockError
from vmachining.geometry import Arc, Line
from vmachining.stock import BoxStock, CylinderStock, MeshStock, Stock
from vmachining.sweep import Motion, Sweep, Turn
from vmachining.sweep.rotating import rate_bound
from vmachining.tolerance import LENGTH_EPS_MM
from vmachining.tool import Profile

QUARTER = 0.5 * np.pi
WIDTH = 41  # columns of a row, see the kernels
TOGETHER = 65_536  # lines whose rows are made at once
GROUP = 256  # rows whose boxes have one hull
CUBIC_MM = 5e-8  # how far cubics of a pose may be off its motion
BEND_MM = 2e-3  # what a minimum of the distance over poses may hide, see the kernels: more is divided


class Corner(NamedTuple):
    """A flat end, a bull or a ball nose: radius of the corner's centre, of the corner; height of the wall's end. mm.

    lean : rad, of the wall.
    """

    rc: float
    r: float
    top: float
    lean: float


def _corner(profile: Profile) -> Corner | None:
    """The cutter as a rounded box or cone, None of another shape."""
    first, *rest = profile.segments
    r = first.radius if first.is_arc else 0.0
    rc = first.cr if first.is_arc else first.r0
    rc = 0.0 if abs(rc) <= LENGTH_EPS_MM else rc
    lean = -first.beta[1]
    fits = abs(first.z0) <= LENGTH_EPS_MM and abs(first.r0 - rc) <= LENGTH_EPS_MM and rc >= 0.0
    if r > 0.0:
        fits &= abs(first.cz - r) <= LENGTH_EPS_MM
    # one straight wall whose tangent the corner ends in
    fits &= all(not s.is_arc and abs(s.beta[0] + lean) * s.z1 <= LENGTH_EPS_MM for s in rest)
    fits &= profile.is_convex and -LENGTH_EPS_MM <= lean < 1.5
    lean = 0.0 if abs(lean) * profile.z_max <= LENGTH_EPS_MM else lean
    return Corner(rc, r, float(profile.z_max), lean) if fits else None


class _Rows:
    """Rows of one width that grow; `view` is what is there."""

    def __init__(self, *shape: int, kind: type = np.float64) -> None:
        self._data: Any = np.zeros((64, *shape), dtype=kind)
        self.count = 0

    def add(self, rows: Floats | Ints) -> int:
        """Append (n, ...); the index of the first."""
        first, n = self.count, len(rows)
        while first + n > len(self._data):
            self._data = np.concatenate([self._data, np.zeros_like(self._data)])
        self._data[first : first + n] = rows
        self.count += n
        return first

    def copy(self) -> _Rows:
        twin = copy(self)
        twin._data = self._data.copy()
        return twin

    @property
    def view(self) -> Any:
        return self._data[: self.count]

    def spare(self, n: int) -> Any:
        """`view` and n rows more that kernels may write to."""
        while self.count + n > len(self._data):
            self._data = np.concatenate([self._data, np.zeros_like(self._data)])
        return self._data[: self.count + n]


class Sweeps:
    """Stock, and motions of cutters in program order.

    stock : box, upright cylinder or triangles.
    """

    def __init__(self, stock: Stock) -> None:
        one = np.zeros((1, 3))
        self.mesh = (one, one, one, np.zeros((1, 7, 3)), np.zeros((1, 6)))
        if isinstance(stock, BoxStock):
            self.kind, self.stock = 0, np.concatenate([stock.lo, stock.hi])
        elif isinstance(stock, CylinderStock):
            (x, y), r, (low, high) = stock.center, stock.radius, stock.z
            self.kind, self.stock = 1, np.array([x, y, r, low, high, 0.0])
        elif isinstance(stock, MeshStock):
            self.mesh = stock.nearest
            self.kind, self.stock = 2, stock.bounds.reshape(6)
        else:
            raise StockError(f"no kernel for a {type(stock).__name__}")
        self.bounds = stock.bounds
        self._box, self._form = _Rows(6), _Rows(4, kind=np.int64)
        self._start, self._path, self._tol = _Rows(3), _Rows(10), _Rows(2)
        self._frames, self._pieces = _Rows(3, 3), _Rows(4, kind=np.int64)
        self._seg, self._limits, self._waves = _Rows(10), _Rows(7), _Rows(19)
        self._known: dict[int, tuple[Floats, int]] = {}
        self._cutters: dict[int, tuple[Profile, int, Corner | None]] = {}
        self._rows: tuple[_Rows, ...] = (*(_Rows(kind=np.int64) for _ in range(3)), _Rows(WIDTH), _Rows(6))
        self._cuts, self._cutter = _Rows(3, kind=np.int64), _Rows(kind=np.int64)
        self._paths: dict[int, Motion] = {}  # but for lines, whose rows say them
        self._spare, self._hulls = 1, (0, np.zeros((0, 6)))
        self.clock, self._marks = np.zeros(6, dtype=np.int64), np.zeros((3, 0), dtype=np.int64)

    def __len__(self) -> int:
        return self._cuts.count

    def motion(self, k: int) -> tuple[Profile, Motion]:
        """Cutter and path of a motion."""
        row = self._rows[3].view[self._cuts.view[k, 0]]
        path = self._paths.get(k) or Line(row[:3], row[[14, 15, 26]])
        return list(self._cutters.values())[int(self._cutter.view[k])][0], path

    def twins(self, count: int) -> list[Self]:
        """The same motions for as many other threads: questions write to a spare row of their own, and push exact distances."""
        for table in self._rows:
            table.spare(1 + count)
        return [self._twin(2 + k) for k in range(count)]

    def _twin(self, spare: int) -> Self:
        twin = copy(self)
        for name, value in vars(self).items():
            if isinstance(value, _Rows) and value not in (self._cuts, self._cutter):
                setattr(twin, name, value.copy())
        twin._spare, twin._known = spare, dict(self._known)
        twin.clock, twin._marks = self.clock.copy(), self._marks[:, :0]
        return twin

    def add(self, cutter: Profile, path: Motion) -> None:
        """The next motion."""
        self.extend([(cutter, path)])

    def extend(self, motions: Iterable[tuple[Profile, Motion]]) -> None:
        """The next motions."""
        for (_, straight), found in groupby(motions, key=lambda one: (id(one[0]), isinstance(one[1], Line))):
            while group := list(islice(found, TOGETHER)):
                cutter, paths = group[0][0], [path for _, path in group]
                known = cutter, len(self._cutters), _corner(cutter)
                _, tool, corner = self._cutters.setdefault(id(cutter), known)
                self._cutter.add(np.full(len(group), tool))
                rows = _straight(corner, paths, self.bounds[1, 2]) if straight else None
                if rows is not None:
                    first, n = self._rows[0].count, len(group)
                    self._put(rows, tool, np.full(n, -1))
                    own = np.full(n, int(not cutter.is_convex))
                    self._cuts.add(np.column_stack([first + np.arange(n), first + np.arange(1, n + 1), own]))
                    continue
                for path in paths:
                    self._add(cutter, path, tool, corner)

    def _add(self, cutter: Profile, path: Motion, tool: int, corner: Corner | None) -> None:
        first = self._rows[0].count
        kinds, num, box = _closed(corner, path, self.bounds[1, 2])
        exact = np.full(len(kinds), -1)
        own = int(isinstance(path, Turn) or not (isinstance(path, Line) and cutter.is_convex))
        if kinds[0] == EXACT:
            sweep = Sweep.along(cutter, path)
            exact[0], box, own = self.push(sweep), sweep.bounds.reshape(1, 6), 2 * own
            tool = -1 if isinstance(path, Turn) else tool
        self._put((kinds, num, box), tool, exact)
        self._paths[self._cuts.add(np.array([[first, self._rows[0].count, own]]))] = path

    def _put(self, rows: tuple[Ints, Floats, Floats], tool: int, exact: Ints) -> None:
        kinds, num, box = rows
        for table, part in zip(self._rows, (kinds, np.full(len(kinds), tool), exact, num, box), strict=True):
            table.add(part)

    @property
    def _tables(self) -> tuple[_Rows, ...]:
        """Of the world of exact distances, in its order."""
        return (
            self._box, self._form, self._start, self._path, self._tol, self._frames, self._pieces, self._seg,
            self._limits, self._waves,
        )  # fmt: skip

    @property
    def cuts(self) -> Ints:
        """(n, 3) first and last + 1 row of every motion; 1 or 2 if what it swept may cover its front, 2 by exact distances."""
        return np.asarray(self._cuts.view)

    @property
    def is_quick(self) -> bool:
        """Whether every distance has a closed form."""
        return self.kind != 2 and not (self._rows[0].view == EXACT).any()

    def is_posed(self, motion: int) -> bool:
        """Whether a motion turns, in closed form: what it has swept so far ends where the tool stands."""
        return bool(self._rows[0].view[self._cuts.view[motion, 0]] == POSES)

    def tool_of(self, cutter: Profile) -> int:
        """Number of a cutter in the rows."""
        return self._cutters[id(cutter)][1] if id(cutter) in self._cutters else -1

    def rows(self) -> Rows:
        """For the kernels, with a spare row at the end."""
        return Rows(*(table.spare(self._spare) for table in self._rows))

    def marks(self) -> Ints:
        """(3, n) stamp, slot and stretch that saw it last, of every row of `rows`; `clock` (6,) counts stations and stretches
        on, so that nothing is cleared between two questions: of a million rows that takes milliseconds."""
        missing = self._rows[0].count + self._spare - self._marks.shape[1]
        if missing > 0:
            self._marks = np.pad(self._marks, ((0, 0), (0, missing)))
        return self._marks

    def near(self, low: Floats, high: Floats, stop: int) -> Ints:
        """Numbers of the rows before `stop` whose boxes meet a box, rising. Of a million, hulls of some are asked first."""
        box = self._rows[4].view
        if self._hulls[0] != len(box):
            begins = np.arange(0, len(box), GROUP)
            ends = np.minimum.reduceat(box[:, :3], begins), np.maximum.reduceat(box[:, 3:], begins)
            self._hulls = len(box), np.concatenate(ends, axis=1)
        groups = np.flatnonzero(_meet(self._hulls[1], low, high))
        some = (groups[:, None] * GROUP + np.arange(GROUP)).ravel()
        some = some[some < stop]
        return np.asarray(some[_meet(box[some], low, high)])

    def push(self, sweep: Sweep) -> int:
        """Rows of a sweep in the world of exact distances; its index."""
        past = Past(0, sweep)
        plain, frame = past.plain
        near, turned = plain.packed
        rows = near if near is not None else turned
        assert rows is not None
        which = -1 if frame is None else self._frames.add(frame[None])
        first = self._pieces.count
        if near is not None:
            base = self._body(near.seg)
            self._pieces.add(np.column_stack([near.first[:-1] + base, near.first[1:] + base,
                                              np.zeros((len(near.first) - 1, 2), dtype=np.int64)]))  # fmt: skip
            self._limits.add(np.zeros((len(near.first) - 1, 7)))
            path = near.path
        else:
            assert turned is not None
            base, wave = self._body(turned.seg), self._waves.add(turned.waves)
            n = len(turned.ends) - 1
            seg = turned.ends[:, 2] + base
            waves = np.tile([wave, wave + len(turned.waves)], (n, 1))
            self._pieces.add(np.column_stack([seg[:-1], seg[1:], waves]))
            self._limits.add(turned.limits)
            path = np.zeros(10)
        self._path.add(path[None])
        self._form.add(np.array([[first, self._pieces.count, int(near is None), which]]))
        self._start.add(plain.path.start[None])
        self._tol.add(np.array([[rows.tol, past.touch]]))
        self._box.add(sweep.bounds.reshape(1, 6))
        return self._box.count - 1

    def pop_to(self, counts: list[int]) -> None:
        """Forget what was pushed since `counts` were taken."""
        for rows, count in zip(self._tables, counts, strict=True):
            rows.count = count
        self._known = {key: known for key, known in self._known.items() if known[1] < self._seg.count}

    @property
    def counts(self) -> list[int]:
        """Rows of the world of exact distances, table by table."""
        return [rows.count for rows in self._tables]

    def _body(self, seg: Floats) -> int:
        """First row of the segments of a body, which many sweeps share."""
        known = self._known.get(id(seg))
        if known is None:  # the array is kept, so that its id stays its own
            known = self._known[id(seg)] = (seg, self._seg.add(seg))
        return known[1]

    @property
    def world(self) -> World:
        """For the kernels."""
        return World._make((self.kind, self.stock, *(table.view for table in self._tables), *self.mesh))


def _meet(box: Floats, low: Floats, high: Floats) -> Bools:
    """(n,) which boxes (n, 6) meet another one."""
    return np.asarray(((box[:, :3] <= high) & (box[:, 3:] >= low)).all(axis=1))


def _closed(corner: Corner | None, path: Motion, top: float) -> tuple[Ints, Floats, Floats]:
    """Kinds (n,), rows (n, WIDTH) and boxes (n, 6) of a motion; EXACT where there is no closed form.

    top : mm, of the stock: cutters that reach above it all along are endless upwards for all that is asked of them.
    """
    q = np.zeros((1, WIDTH))
    if isinstance(path, Turn) and corner is not None:
        return _posed(path, corner)
    if isinstance(path, Turn) or (isinstance(path, Arc) and path.axis != 2):
        return np.array([EXACT]), q, np.zeros((1, 6))
    if isinstance(path, Line):
        return _straight(corner, [path], top) or (np.array([EXACT]), q, np.zeros((1, 6)))
    if corner is None or corner.lean > 0.0 or min(path.start[2], path.end[2]) + corner.top < top:
        return np.array([EXACT]), q, np.zeros((1, 6))
    return _curved(path, corner.rc, corner.r, top)


def _straight(
    corner: Corner | None, paths: Sequence[Motion], top: float
) -> tuple[Ints, Floats, Floats] | None:
    """The same of lines; None if one of them has no closed form."""
    ends = np.array([(path.start, path.end) for path in paths if isinstance(path, Line)])
    low, high = ends.min(axis=1), ends.max(axis=1)
    if corner is None or corner.lean > 0.0 or (low[:, 2] + corner.top < top).any():
        return None
    start, end = ends[:, 0], ends[:, 1]
    rc, r, _, _ = corner
    d = end - start
    size = np.sqrt((d * d).sum(axis=1))
    q = np.zeros((len(paths), WIDTH))
    q[:, 0:3], q[:, 3:6], q[:, 14:16], q[:, 26] = start, d, end[:, :2], end[:, 2]
    q[:, 16:18], q[:, 18], q[:, 19] = (rc, r), d[:, 0] ** 2 + d[:, 1] ** 2, size**2
    with np.errstate(divide="ignore"):
        q[:, 6], q[:, 7] = np.where(q[:, 18] > 0.0, 1.0 / q[:, 18], 0.0), 1.0 / q[:, 19]
    q[:, 20:23] = q[:, 23:26] = d / np.where(size > 0.0, size, 1.0)[:, None]
    q[:, 27], q[:, 28] = low[:, 2], high[:, 2]
    kinds = np.where(d[:, 2] == 0.0, LEVEL, BALL if rc == 0.0 else RAMP)
    side = np.array([rc + r, rc + r])
    boxes = np.concatenate(
        [low[:, :2] - side, low[:, 2:], high[:, :2] + side, np.full((len(paths), 1), top + 1.0)], axis=1
    )
    return kinds, q, boxes


def _posed(path: Turn, corner: Corner) -> tuple[Ints, Floats, Floats]:
    """The same for a motion that turns: cubics through the poses at both ends of pieces, with their rates."""
    rc, r, high, lean = corner
    tip, axis = path.tip_series, path.axis_series
    wide = rc + (r + (high - r) * np.sin(lean)) / np.cos(lean)
    turn, far = rate_bound(axis, 1), float(np.hypot(high, wide))
    off = (tip.bound(4) + far * axis.bound(4)) / 384.0
    # of the path of a point as the tool sees it: |y''| <= |c''| + 2 |A'| |c'| + (|A''| + |A'|^2) far, and w^2 / 8 of it
    speed = rate_bound(tip, 1)
    bend = (tip.bound(2) + 2.0 * turn * speed + (axis.bound(2) + turn**2) * far) / 8.0
    n = max(1, int(np.ceil(max((off / CUBIC_MM) ** 0.25, (bend / BEND_MM) ** 0.5))))
    share, step = np.arange(n + 1) / n, 1.0 / n
    q, hull = np.zeros((n, WIDTH)), np.zeros((2, n, 4, 3))
    for k, (series, columns) in enumerate(((tip, (0, 3, 6, 9)), (axis, (20, 23, 27, 30)))):
        at, rate = series.at(share), series.at(share, 1) * step
        a, b, c, d = at[:-1], rate[:-1], at[1:], rate[1:]
        for column, part in zip(
            columns, (a, b, 3.0 * (c - a) - 2.0 * b - d, 2.0 * (a - c) + b + d), strict=True
        ):
            q[:, column : column + 3] = part
        hull[k] = np.stack([a, a + b / 3.0, c - d / 3.0, c], axis=1)  # a cubic lies in the hull of these
    q[:, 12], q[:, 13], q[:, 16], q[:, 17], q[:, 18] = np.cos(lean), np.sin(lean), rc, r, high
    ends = path.position(share[1:])
    q[:, 14:16], q[:, 26] = ends[:, :2], ends[:, 2]
    q[:, 19], q[:, 33] = bend * step**2, SLIDING_MM
    q[:, 34] = 0.5 * step * (speed + turn * far)
    q[:, 35:38], q[:, 38:41] = tip.at(share[:-1] + 0.5 * step), axis.at(share[:-1] + 0.5 * step)
    least = np.where(hull[1].min(axis=1) * hull[1].max(axis=1) > 0.0, np.abs(hull[1]).min(axis=1), 0.0)
    side = wide * np.sqrt(np.maximum(1.0 - least**2, 0.0)) + 1e-6
    points = np.concatenate([hull[0], hull[0] + high * hull[1]], axis=1)
    return (
        np.full(n, POSES),
        q,
        np.concatenate([points.min(axis=1) - side, points.max(axis=1) + side], axis=1),
    )


def _curved(path: Arc, rc: float, r: float, top: float) -> tuple[Ints, Floats, Floats]:
    """The same of a level circle or of quarters of a helix."""
    level = path.rise == 0.0
    n = 1 if level else max(1, int(np.ceil(abs(path.angle) / QUARTER - 1e-9)))
    share = np.arange(n + 1) / n
    points, speeds = path.position(share), path.velocity(share)
    speeds = speeds / np.linalg.norm(speeds, axis=1)[:, None]
    angle = path.start_angle + share * path.angle
    half, middle = 0.5 * abs(path.angle) / n, 0.5 * (angle[:-1] + angle[1:])
    q = np.zeros((n, WIDTH))
    q[:, 0:3], q[:, 5] = points[:-1], path.rise / n
    q[:, 6:8], q[:, 8] = path.center[:2], path.radius
    q[:, 9], q[:, 10] = angle[:-1], path.angle / n
    q[:, 11], q[:, 12], q[:, 13] = np.cos(middle), np.sin(middle), np.cos(half) if half < np.pi else -1.1
    q[:, 14:16], q[:, 26] = points[1:, :2], points[1:, 2]
    q[:, 16], q[:, 17] = rc, r
    q[:, 20:23], q[:, 23:26] = speeds[:-1], speeds[1:]
    q[:, 27] = np.minimum(points[:-1, 2], points[1:, 2])
    q[:, 28] = np.maximum(points[:-1, 2], points[1:, 2])
    boxes = np.empty((n, 6))
    for k, piece in enumerate(path.split(share[1:-1].tolist())):
        low, high = piece.bounds
        boxes[k] = low[0] - rc - r, low[1] - rc - r, low[2], high[0] + rc + r, high[1] + rc + r, top + 1.0
    return np.full(n, CIRCLE if level else HELIX), q, boxes
