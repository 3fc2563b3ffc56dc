"""`UprightJudge`: what blocks of upright tools remove, by heights over random places: the quick second judge of a run.

1. A sweep of an upright tool whose top stays above the stock takes all above its lower surface f(x, y): in closed form for balls
   on any line and for any tool on level lines and arcs, by a bracket of the slope on ramps (f is a minimum of convex functions
   of the place along the line), by looks and a golden section on helices, a quarter of a turn at a time.
2. A block takes of the line over (x, y) what of the stock lies between f of its own sweeps and the least f of all earlier ones.
   Earlier sweeps are found by their boxes; none is chosen, none is made: a row of numbers each.
3. Places stand at random, one in each cell of a raster along the block, in `SETS` independent sets; their spread gives the
   interval: mean +- (t S + u + e), as in `rays`. Cells in which a few places beforehand met anything, and their neighbours, are
   divided; the others keep one place of each set.
4. All blocks together: the union of all sweeps, over a raster of the whole stock.

What is not taken: tools whose radius falls anywhere, that are not convex, whose top comes below that of the stock, arcs about
x and y, tools that lean or turn. The exact rays of `rays` answer for these.

Source: contact.md 3 (closed distances, here as heights), written apart from the bounds of the columns engine.

Known limits: the interval is stated, not proven; places that no ray meets count by the tallest that any ray has met. A caller
who finds an engine excluded by it asks the exact rays, which look closer, before anybody is accused.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from math import ceil, pi, sqrt
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines.dexel.rays.estimate import ROUND_MM, ROUND_REL, SETS, STUDENT, UNSEEN
from vmachining.engines.dexel.upright import _kernels
from vmachining.engines.protocol import NOTHING, Removal
from vmachining.geometry import Arc, Line
from vmachining.stock import Stock
from vmachining.sweep import Turn
from vmachining.tool import Profile

__all__ = ["UprightJudge", "Way"]

PLACES, PILOT = 512, 4
"""Of a set for one block, about; half as many cells are looked at beforehand, with so many places each."""

MOST_PLACES, MOST_LOOKS = 60_000, 8_000_000
"""Of a set for all blocks together, and heights asked for by all sets: about 5 ns each."""

TOGETHER = 65_536
"""Ways that are taken at once: an object takes four times as much memory as its row."""

QUARTER = 0.5 * pi * (1.0 + 1e-9)
"""rad of a helix that is one row."""


class Way(NamedTuple):
    """A cutter on its way. block : number."""

    block: int
    cutter: Profile
    path: Line | Arc | Turn


class UprightJudge:
    """Sweeps of a program as rows of numbers, see the legend of `_kernels.py`.

    stock : raw.
    ways : of all feed motions, in the order they run, taken some at a time.
    is_whole : whether all of them are taken that can meet the stock.
    """

    def __init__(self, stock: Stock, ways: Iterable[Way]) -> None:
        self._stock, self._box = stock, np.array(stock.bounds)
        shapes: dict[int, Profile] = {}
        coming = iter(ways)
        parts = [self._part([], shapes)]
        while some := list(islice(coming, TOGETHER)):
            parts.append(self._part(some, shapes))
        self._ways, self._boxes, self._tool, self._block, self._foreign = map(
            np.concatenate, zip(*parts, strict=True)
        )
        apart = (self._foreign[:, 3:] <= self._box[0, :2]) | (self._foreign[:, 1:3] >= self._box[1, :2])
        self._foreign = self._foreign[~apart.any(axis=1)]
        self._tools, self._segments = _shapes(list(shapes.values()))

    def _part(
        self, ways: Sequence[Way], shapes: dict[int, Profile]
    ) -> tuple[Floats, Floats, Ints, Ints, Floats]:
        """Rows of some ways, their boxes, tools and blocks, and what is not taken. shapes : cutters, which grow."""
        shapes |= {id(way.cutter): way.cutter for way in ways}
        places, profiles = {key: k for k, key in enumerate(shapes)}, list(shapes.values())
        # whether the radius never falls with the height, of a convex cutter
        rises = np.array(
            [c.is_convex and float(c.points[-1, 0]) == c.max_radius for c in profiles], dtype=np.bool_
        )
        tool = np.array([places[id(way.cutter)] for way in ways], dtype=np.int64)
        block = np.array([way.block for way in ways], dtype=np.int64)
        paths = [way.path for way in ways]
        paths = [Line(p.start, p.end) if isinstance(p, Arc) and p.angle == 0.0 else p for p in paths]
        straight = np.array([type(path) is Line for path in paths], dtype=np.bool_)
        at, rows, boxes = self._lines(paths, np.flatnonzero(straight & rises[tool]), tool, profiles)
        taken, more = at.tolist(), list[tuple[int, tuple[float, ...], tuple[float, ...]]]()
        for k in np.flatnonzero(~straight & rises[tool]).tolist():
            more += [(k, row, box) for row, box in self._rows(ways[k].cutter, paths[k])]
        taken += [k for k, _, _ in more]
        order = np.argsort(taken, kind="stable")
        owner = np.array(taken, dtype=np.int64)[order]
        rows = np.concatenate([rows, np.array([row for _, row, _ in more]).reshape(-1, 9)])[order]
        boxes = np.concatenate([boxes, np.array([box for _, _, box in more]).reshape(-1, 5)])[order]
        foreign = list[tuple[float, ...]]()
        for k in np.setdiff1d(np.arange(len(ways)), owner).tolist():
            number, cutter, path = ways[k]
            reach = cutter.max_radius + (max(-cutter.z_min, cutter.z_max) if isinstance(path, Turn) else 0.0)
            foreign.append((number, *(path.bounds[0, :2] - reach), *(path.bounds[1, :2] + reach)))
        return rows, boxes, tool[owner], block[owner], np.array(foreign, dtype=np.float64).reshape(-1, 5)

    @property
    def is_whole(self) -> bool:
        """See the class."""
        return len(self._foreign) == 0

    def takes(self, block: int) -> bool:
        """Whether it answers for a block: no sweep that it does not take comes near, of this block or before."""
        mine = self._foreign[:, 0] == block
        if mine.any():
            return False
        low, high = self._plan(np.flatnonzero(self._block == block))
        near = (self._foreign[:, 0] < block) & (self._foreign[:, 1:3] < high).all(axis=1)
        return not (near & (self._foreign[:, 3:] > low).all(axis=1)).any()

    def removed(self, block: int, places: int = PLACES) -> Removal:
        """What a block takes, mm^3; places : of a set, about."""
        own = np.flatnonzero(self._block == block)
        low, high = self._plan(own)
        if not len(own) or (low >= high).any() or self._boxes[own, 4].min() >= self._box[1, 2]:
            return NOTHING
        before = self._boxes[: own[0]]
        near = (before[:, :2] < high).all(axis=1) & (before[:, 2:4] > low).all(axis=1)
        earlier = np.flatnonzero(near & (before[:, 4] < self._box[1, 2]))
        frame = self._frame(own, low, high)
        n, m = frame.cells(places / 2)
        corner = _raster(n, m).reshape(-1, 2)
        rng = np.random.default_rng([block, 1])

        def lengths(cells: Ints, parts: int, sets: int) -> Floats:
            """(sets, cells * parts^2) mm over random places, one in each part."""
            step = _raster(parts, parts).reshape(-1, 2)
            inside = (step + rng.random((len(cells), sets, len(step), 2))) / parts
            where = frame.at((corner[cells][:, None, None] + inside) / [n, m]).reshape(-1, 2)
            found = self._taken(own, earlier, where).reshape(-1, sets, len(step))
            return found.swapaxes(0, 1).reshape(sets, -1)

        hit = lengths(np.arange(n * m), 1, PILOT).max(axis=0).reshape(n, m) > 0.0
        near = np.pad(hit, 1)
        hot = np.any([near[a : a + n, b : b + m] for a in range(3) for b in range(3)], axis=0).reshape(-1)
        some, rest = np.flatnonzero(hot), np.flatnonzero(~hot)
        parts = max(1, round(sqrt(places / max(len(some), 1))))
        area = frame.area / (n * m)
        return _interval((lengths(some, parts, SETS), area / parts**2), (lengths(rest, 1, SETS), area))

    def _taken(self, own: Ints, earlier: Ints, where: Floats) -> Floats:
        """(n,) mm over places (n, 2)."""
        inside = self._stock.crossings(where)
        first, out = np.concatenate([[0], np.cumsum(inside.counts)]), np.empty(len(where))
        _kernels.taken(
            self._ways, self._tool, self._boxes, self._tools, self._segments, own, earlier, np.ascontiguousarray(where[:, 0]),
            np.ascontiguousarray(where[:, 1]), first, inside.enter, inside.leave, out,
        )  # fmt: skip
        return out

    def lowest(self, places: Floats) -> Floats:
        """(n,) mm, lower surface of all sweeps over places (n, 2); inf where none exists."""
        out = np.full(len(places), np.inf)
        x, y = (np.ascontiguousarray(places[:, k]) for k in (0, 1))
        _kernels.lower_all(self._ways, self._tool, self._tools, self._segments, x, y, out)
        return out

    def total(self) -> Removal:
        """What all blocks take together, mm^3."""
        low, high = self._box[0, :2], self._box[1, :2]
        size = high - low
        met = np.clip(np.minimum(self._boxes[:, 2:4], high) - np.maximum(self._boxes[:, :2], low), 0.0, None)
        deep = float(met.prod(axis=1).sum() / size.prod())  # sweeps over a place, about
        places = min(MOST_PLACES, max(400, int(MOST_LOOKS / SETS / max(deep, 1.0))))
        n, m = _Frame(low, size * [1.0, 0.0], size * [0.0, 1.0]).cells(places)
        side, sums = size / [n, m], np.empty((SETS, n * m))
        grid = _raster(n, m)
        rng = np.random.default_rng(2)
        for out in sums:
            where, height = low + (grid + rng.random((n, m, 2))) * side, np.full((n, m), np.inf)
            x, y = (np.ascontiguousarray(where[..., k]) for k in (0, 1))
            _kernels.lowest(
                self._ways, self._tool, self._boxes, self._tools, self._segments, low, side, x, y, height
            )
            inside = self._stock.crossings(where.reshape(-1, 2))
            first = np.concatenate([[0], np.cumsum(inside.counts)])
            _kernels.left_over(height.reshape(-1), first, inside.enter, inside.leave, out)
        return _interval((sums, float(side.prod())))

    def _plan(self, own: Ints) -> tuple[Floats, Floats]:
        """Corners of the box of some rows in the stock's, seen from above."""
        if not len(own):
            return np.zeros(2), np.zeros(2)
        low, high = self._boxes[own, :2].min(axis=0), self._boxes[own, 2:4].max(axis=0)
        return np.maximum(low, self._box[0, :2]), np.minimum(high, self._box[1, :2])

    def _frame(self, own: Ints, low: Floats, high: Floats) -> _Frame:
        """Along the line where the block is one and its box, within the stock, is larger."""
        box = _Frame(low, (high - low) * [1.0, 0.0], (high - low) * [0.0, 1.0])
        way = self._ways[own[0]]
        if len(own) != 1 or way[0] != _kernels.LINE:
            return box
        run, r = float(np.hypot(*way[4:6])), abs(float(self._tools[self._tool[own[0]], 4]))
        if run == 0.0:
            return box
        e = way[4:6] / run
        n = np.array([-e[1], e[0]])
        along = _Frame(way[1:3] - r * (e + n), (run + 2.0 * r) * e, 2.0 * r * n)
        return along if along.area < box.area else box

    def _lines(
        self, paths: Sequence[Line | Arc | Turn], at: Ints, tool: Ints, profiles: Sequence[Profile]
    ) -> tuple[Ints, Floats, Floats]:
        """Those of straight ways number `at` that are taken: their numbers, rows of `ways` (k, 9) and of `boxes` (k, 5)."""
        if not len(at):
            return at, np.zeros((0, 9)), np.zeros((0, 5))
        some = [paths[k] for k in at.tolist()]
        start, end = (np.array([getattr(path, name) for path in some]) for name in ("start", "end"))
        wide, low, top = np.array([(p.max_radius, p.z_min, p.z_max) for p in profiles])[tool[at]].T
        low_tip, high_tip, r = np.minimum(start, end), np.maximum(start, end), wide[:, None]
        kept = ~(low_tip[:, 2] + top < self._box[1, 2])
        rows = np.zeros((len(at), 9))
        rows[:, 0], rows[:, 1:4], rows[:, 4:7] = _kernels.LINE, start, end - start
        boxes = np.column_stack([low_tip[:, :2] - r, high_tip[:, :2] + r, low_tip[:, 2] + low])
        return at[kept], rows[kept], boxes[kept]

    def _rows(
        self, cutter: Profile, path: Line | Arc | Turn
    ) -> Iterator[tuple[tuple[float, ...], tuple[float, ...]]]:
        """Rows of `ways` and `boxes` of an arc; none where it is not taken."""
        if not isinstance(path, Arc) or path.bounds[0, 2] + cutter.z_max < self._box[1, 2] or path.axis != 2:
            return
        parts, r = [path], cutter.max_radius
        if path.rise != 0.0:
            count = max(1, ceil(abs(path.angle) / QUARTER))
            parts = path.split([k / count for k in range(1, count)])
        for part in parts:
            turn = min(max(part.angle, -2.0 * pi), 2.0 * pi)
            (x, y), angle, z = part.center[:2].tolist(), float(part.start_angle), float(part.start[2])
            (x0, y0, z0), (x1, y1, _) = part.bounds.tolist()
            row = (_kernels.ARC, x, y, part.radius, angle, turn, z, part.rise, 0.0)
            yield row, (x0 - r, y0 - r, x1 + r, y1 + r, z0 + cutter.z_min)


class _Frame(NamedTuple):
    """A rectangle seen from above: corner, and its two sides as vectors (2,), mm."""

    corner: Floats
    first: Floats
    second: Floats

    @property
    def area(self) -> float:
        """mm^2."""
        return float(np.hypot(*self.first) * np.hypot(*self.second))

    def cells(self, count: float) -> tuple[int, int]:
        """Cells along both sides, nearly squares, about so many together."""
        a, b = float(np.hypot(*self.first)), float(np.hypot(*self.second))
        n = max(1, round(sqrt(count * a / b)))
        return n, max(1, round(count / n))

    def at(self, share: Floats) -> Floats:
        """(..., 2) mm of places (..., 2) as shares of the sides."""
        return np.asarray(self.corner + share[..., :1] * self.first + share[..., 1:] * self.second)


def _interval(*parts: tuple[Floats, float]) -> Removal:
    """parts : lengths (sets, n) mm over the cells of some part, and the area (mm^2) of one of them."""
    sums = sum((lengths.sum(axis=1) * area for lengths, area in parts), np.zeros(SETS))
    volume = float(sums.mean())
    unseen = sum(UNSEEN * area * float(lengths.max(initial=0.0)) for lengths, area in parts) / SETS
    rounding = ROUND_MM * sum(area * lengths.shape[1] for lengths, area in parts) + ROUND_REL * volume
    half = STUDENT * sqrt(float(sums.var(ddof=1)) / SETS) + unseen + rounding
    return Removal(max(0.0, volume - half), volume, volume + half, proven=False)


def _raster(n: int, m: int) -> Ints:
    """(n, m, 2) places of cells."""
    return np.stack(np.meshgrid(np.arange(n), np.arange(m), indexing="ij"), axis=-1)


def _shapes(cutters: Sequence[Profile]) -> tuple[Floats, Floats]:
    """Tools and segments, see the legend of `_kernels.py`."""
    tools, segments = np.zeros((len(cutters), 5)), list[tuple[float, ...]]()
    for k, cutter in enumerate(cutters):
        first = len(segments)
        segments += [
            (*s[:4], *((s.cr, s.cz) if s.is_arc else (0.0, 0.0)), s.radius)
            for s in cutter.segments
            if s.r1 > s.r0
        ]
        rounds = segments[first:]
        wide, bottom = cutter.max_radius, cutter.z_min
        off = (
            [abs(v) for v in (rounds[0][6] - wide, rounds[0][4], rounds[0][5] - bottom - wide)]
            if len(rounds) == 1
            else []
        )
        is_ball = bool(off) and max(off) <= 1e-12 * wide
        tools[k] = first, len(rounds), cutter.points[0, 0], bottom, -wide if is_ball else wide
    return tools, np.array(segments, dtype=np.float64).reshape(-1, 7)
