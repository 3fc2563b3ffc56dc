"""`Sweep`: a cutter and the path of one block, and what can be asked of the space it sweeps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Bools, Floats, Ints, rows
from vmachining.errors import SweepError
from vmachining.geometry import Arc, Line, Path, RayIntervals
from vmachining.htmltable import box_words, facts_html
from vmachining.numerics.series import Series
from vmachining.sweep import _kernels
from vmachining.sweep.bounds import body_bounds
from vmachining.sweep.flux import FluxVolume, flux_volume
from vmachining.sweep.pose import Pose, tip, tool_frame, unit_axis
from vmachining.sweep.rotating import Packed, arc_series, meridian_rows, pack
from vmachining.sweep.rotating import _kernels as rotating
from vmachining.sweep.turning import Turn
from vmachining.sweep.volume import swept_volume
from vmachining.tolerance import ANGLE_EPS
from vmachining.tool import Cutter, Profile, convex_cover

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ULPS = 16
"""Rounding of a distance in ulp of the extent of the sweep: a dozen operations on its coordinates."""

CHUNK = 16384
"""Rays worked on at once; bounds the memory of the interval buffers."""

CAPACITY = 8
"""Intervals of a ray that there is room for at first."""

Body: TypeAlias = Cutter | Profile
Place: TypeAlias = ArrayLike | Pose
Motion: TypeAlias = Path | Turn

GOOD = 1e-4
"""Relative error estimate up to which a volume by the flux is given out; the estimates are cautious."""

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Sweep:
    """All points that a cutter touches during one block.

    Sweep(tool, start, end) moves between two tips (3,) mm or two `Pose`: in a straight line, and where an
    axis is not +z, with the axis on the great circle between the two. `Sweep.along` takes a `Line`, an `Arc`
    (circle or helix about x, y or z; both with the axis along +z) or a `Turn`. `tool` is a cutter, of which
    the whole body up to its length sweeps, or a `Profile`.

    Raises SweepError: A tip or axis that is not finite or has the wrong shape, an axis of length zero, opposite axes.
    """

    profile: Profile
    path: Motion
    _rows: _Packed | None = field(repr=False)
    _turned: Packed | None = field(repr=False)
    _known: dict[float, FluxVolume] = field(repr=False)
    _box: Floats | None = field(repr=False)

    def __init__(self, tool: Body, start: Place, end: Place) -> None:
        self._fill(tool, _between(start, end))

    @classmethod
    def along(cls, tool: Body, path: Motion) -> Sweep:
        """Sweep of a cutter along a line, an arc, a helix or a five-axis block.

        A `Turn` that keeps the axis on +z and the tip on a straight line is the `Line` it looks like.
        """
        if not isinstance(path, (Line, Arc, Turn)):
            raise SweepError(f"path must be a Line, an Arc or a Turn, got {type(path).__name__}")
        if isinstance(path, Turn) and path.is_upright and path.is_straight:
            path = Line(path.start, path.end)
        self = object.__new__(cls)
        self._fill(tool, path)
        return self

    def _fill(self, tool: Body, path: Motion) -> None:
        profile = tool.profile if isinstance(tool, Cutter) else tool
        if not isinstance(profile, Profile):
            raise SweepError(f"tool must be a cutter or a Profile, got {type(tool).__name__}")
        given: dict[str, Any] = {
            "profile": profile,
            "path": path,
            "_known": {},
            "_box": None,
            "_rows": None,
            "_turned": None,
        }
        for name, value in given.items():
            object.__setattr__(self, name, value)

    def _moved(self) -> Packed | None:
        """Rows of `rotating/`, made when they are first asked for: milliseconds, and most sweeps of a run never are."""
        path = self.path
        if self._turned is None and (isinstance(path, Turn) or not _is_straight(path)):
            cover = convex_cover(self.profile)
            if isinstance(path, Turn):
                made = pack(cover, path.tip_series, path.axis_series, path.start)
            else:
                assert isinstance(path, Arc)
                made = pack(cover, arc_series(path), Series.constant(UP), path.start)
            object.__setattr__(self, "_turned", made)
        return self._turned

    def upright(self) -> tuple[Sweep, Floats] | None:
        """The same sweep seen from a tool whose axis keeps its direction, None if the axis turns.

        Returns (Sweep, (3, 3) float): A sweep with the axis along +z, and the rotation Q to its frame: x in this sweep
        where Q x in that one. None also where the axis is steady but the tip does not move in a straight line.
        """
        if not isinstance(self.path, Turn):
            return self, np.eye(3)
        if not (self.path.is_steady and self.path.is_straight):
            return None
        frame = tool_frame(self.path.axis(0.0))
        return Sweep.along(self.profile, Line(frame @ self.path.start, frame @ self.path.end)), frame

    def __repr__(self) -> str:
        return f"Sweep({self.profile!r}, {self.path!r})"

    def _repr_html_(self) -> str:
        """What a notebook shows: cutter, motion and box."""
        p = self.profile
        facts = [("cutter", f"radius {p.max_radius:g} mm, height {p.z_max - p.z_min:g} mm")]
        facts += [("motion", repr(self.path)), ("box, mm", box_words(*self.bounds))]
        return facts_html("Sweep", facts)

    def plot(self) -> Figure:
        """A shaded view of the swept volume with the path of the tip, as a matplotlib figure; a notebook shows it."""
        return resolve_name("vmachining.report.paper:draw_sweep")(self)  # type: ignore[no-any-return]

    @property
    def _near(self) -> _Packed | None:
        """Made when somebody asks for distances: most sweeps of a run are only cut."""
        path = self.path
        if (
            self._rows is None
            and not isinstance(path, Turn)
            and (_is_straight(path) or (isinstance(path, Arc) and path.axis == 2 and path.rise == 0.0))
        ):
            object.__setattr__(self, "_rows", _pack(convex_cover(self.profile), path))
        return self._rows

    @property
    def packed(self) -> tuple[_Packed | None, Packed | None]:
        """Rows of the kernels, of `_kernels.py` where distances are those to the nearest pose, and of `rotating/`."""
        return self._near, self._moved()

    @property
    def bounds(self) -> Floats:
        """(2, 3) mm: the tight box; for a `Turn` at most about 1e-5 of the motion too large."""
        if self._box is None:
            object.__setattr__(self, "_box", self._tight_box())
        assert self._box is not None
        return self._box.copy()

    def _tight_box(self) -> Floats:
        if isinstance(self.path, Turn):
            return np.array(body_bounds(self.profile, self.path))
        r, bottom, top = self.profile.max_radius, self.profile.z_min, self.profile.z_max
        (x0, y0, z0), (x1, y1, z1) = self.path.bounds.tolist()
        return np.array([[x0 - r, y0 - r, z0 + bottom], [x1 + r, y1 + r, z1 + top]])

    @property
    def volume(self) -> float | None:
        """mm^3; None where no formula is known.

        Lines and arcs: in closed form or by one smooth quadrature, see `swept_volume`. A `Turn`: by the flux
        identity, kept after the first call; None if its error estimate is above 1e-4 of the volume.
        """
        if isinstance(self.path, Turn):
            plain = self.upright()
            if plain:
                return plain[0].volume
            found = self.flux()
            return found.volume if found.error <= GOOD * found.volume else None
        return swept_volume(self.profile, self.path)

    def flux(self, wanted: float = 5e-6) -> FluxVolume:
        """Volume with its parts and error estimate, of a `Turn` or an arc of any axis; see `flux_volume`.

        Raises SweepError: The path is straight: `volume` knows a formula.
        """
        moved = self._moved()
        if moved is None:
            raise SweepError("the flux is computed for curved paths only", remedy="take `volume`")
        if wanted not in self._known:
            self._known[wanted] = flux_volume(self.profile, moved, wanted=wanted)
        return self._known[wanted]

    def split(self, fractions: Sequence[float]) -> list[Sweep]:
        """Sweeps of the pieces between consecutive fractions of the path, rising in (0, 1).

        Raises SweepError: Fractions that do not rise between 0 and 1.
        """
        ends = [0.0, *fractions, 1.0]
        if not np.isfinite(ends).all() or (np.diff(ends) < 0).any():
            raise SweepError(f"fractions must rise from 0 to 1, got {list(fractions)}")
        return [Sweep.along(self.profile, piece) for piece in self.path.split(fractions)]

    def signed_distance(self, points: ArrayLike) -> Floats:
        """(n,) mm, distance of points (n, 3) mm to the sweep, negative inside.

        Outside it is the distance. Inside, its absolute value is the largest depth below the surface of the body (or of a
        convex piece of it) over all poses, which never exceeds the depth below the surface of the sweep. It is 1-Lipschitz and
        zero exactly on the boundary, both to 1e-11 mm; to 1e-7 mm where a surface of a curved motion slides nearly along
        itself (shallow helices).

        Raises SweepError: Points of a wrong shape or not finite.
        """
        return self._distances(points, -np.inf)

    def contains(self, points: ArrayLike, *, slack: float = 0.0) -> Bools:
        """(n,) bool: whether points lie in the sweep, or within `slack` mm of it."""
        return np.asarray(self._distances(points, slack) <= slack)

    def _distances(self, points: ArrayLike, level: float) -> Floats:
        """`signed_distance`; with a finite level only on which side of it a point lies, if the axis turns."""
        where = _points(points, "points") - self.path.start
        out = np.empty(len(where))
        if self._near is not None:
            p = self._near
            _kernels.distances(p.seg, p.first, p.path, where, p.tol, out)
        else:
            q = self._moved()
            assert q is not None
            rotating.distances(q.seg, q.ends, q.limits, q.waves, where, q.tol, level, out)
        return out

    def ray_intervals(
        self, origins: ArrayLike, directions: ArrayLike, *, between: ArrayLike | None = None
    ) -> RayIntervals:
        """Where whole lines are inside the sweep, or parts of them.

        origins, directions : (n, 3) mm; one direction (3,) serves all origins. Directions are normalised.
        between : (n, 2) mm along each line: only this part of it is asked about. Where the tool turns that is faster, as it
            need not be proved what lies beyond.
        Returns disjoint intervals, rising; both ends to about 1e-11 mm where the ray crosses the surface, less where it grazes
            it (the square root of that in the worst case).
        Raises SweepError: Wrong shapes, values that are not finite, a direction of length zero.

        Straight motions: one interval per convex piece, by Newton's method on a convex function, nothing can be missed. Others:
        planes that move with the tool prove what is covered, see `vmachining.sweep.rotating`; a chord or a gap that is less
        than 1e-11 mm deep at a tangent point, that is shorter than sqrt(8e-11 r) (0.03 micrometre for r = 12 mm), may be
        bridged or missed.
        """
        where = _points(origins, "origins")
        heading = _points(directions, "directions", single=True)
        if len(heading) not in (1, len(where)):
            raise SweepError(f"directions: expected one or {len(where)} rows, got {len(heading)}")
        size = np.linalg.norm(heading, axis=1)
        if not (size > 0).all():
            raise SweepError(f"directions: row {int(np.argmin(size))} has length zero")
        unit = heading / size[:, None]
        unit = np.where(np.abs(unit) < 1e-300, 0.0, unit)
        if len(unit) < len(where):
            unit = np.repeat(unit, len(where), axis=0)
        part = np.tile([-np.inf, np.inf], (len(where), 1)) if between is None else _parts(between, len(where))
        found = [
            self._rays(where[k : k + CHUNK] - self.path.start, unit[k : k + CHUNK], part[k : k + CHUNK])
            for k in range(0, len(where), CHUNK)
        ] or [RayIntervals(np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0))]
        return RayIntervals(*(np.concatenate(column) for column in zip(*found, strict=True)))

    def _rays(self, origins: Floats, directions: Floats, between: Floats) -> RayIntervals:
        p, q = self._near, self._moved()
        easy = np.full(len(origins), q is None)
        if p is not None and q is not None:  # level circle
            easy = (directions[:, 0] == 0.0) & (directions[:, 1] == 0.0)
        bounded = q is not None and bool(np.isfinite(between).all())
        lo, hi = np.empty((2, len(origins), CAPACITY))
        counts, who = np.zeros(len(origins), dtype=np.int64), np.arange(len(origins))
        while len(who):
            if bounded:
                rotating.beyond(who, between, easy, counts, lo, hi)
            for near in (True, False):
                some = who[easy[who] == near]
                if len(some) == len(origins):  # of one kind, as mostly: nothing is copied
                    self._intervals(near, origins, directions, counts, lo, hi)
                elif len(some):
                    count, low, high = counts[some], lo[some], hi[some]
                    self._intervals(near, origins[some], directions[some], count, low, high)
                    counts[some], lo[some], hi[some] = count, low, high
            who = np.flatnonzero(counts < 0)
            if len(who):  # once more, with room for four times as many
                counts[who] = 0
                lo, hi = (np.concatenate([x, x, x, x], axis=1) for x in (lo, hi))
        enter, leave = np.empty((2, int(counts.sum())))
        found = _kernels.left(lo, hi, counts, between, bounded, enter, leave)
        return RayIntervals(counts, enter[:found], leave[:found])

    def _intervals(
        self, near: bool, origins: Floats, directions: Floats, counts: Ints, lo: Floats, hi: Floats
    ) -> None:
        """Ends of the intervals of lines into rows of `lo` and `hi`, their numbers (-1: no room) into `counts`."""
        p, q = self._near, self._moved()
        if near:
            assert p is not None
            _kernels.rays(p.seg, p.first, p.size, p.path, origins, directions, p.tol, counts, lo, hi)
        else:
            assert q is not None
            rotating.rays(q, rotating.STACK, origins, directions, counts, lo, hi)


def _parts(between: ArrayLike, n: int) -> Floats:
    """(n, 2) mm, checked parts of lines."""
    part = rows(between, -1, 2, name="between")
    if len(part) != n or (part[:, 0] > part[:, 1]).any():
        raise SweepError(f"between: expected {n} rows of two that rise")
    return part


class _Packed(NamedTuple):
    """A straight or level circular sweep as the kernels take it, see the legend of `_kernels.py`."""

    seg: Floats
    first: Ints
    size: Floats
    path: Floats
    tol: float


def _is_straight(path: Path) -> bool:
    """A line, or an arc that is a line."""
    return isinstance(path, Line) or path.angle == 0.0 or path.radius == 0.0


def _pack(pieces: Sequence[Profile], path: Path) -> _Packed:
    """Rows of the kernels. A straight motion along the axis becomes a body at rest."""
    travel = path.end - path.start
    still = _is_straight(path)
    if still and not travel[:2].any():
        pieces, travel = tuple(piece.extruded(float(travel[2])) for piece in pieces), np.zeros(3)
    seg, first, size = _bodies(tuple(pieces))
    row = np.zeros(10)
    if still:
        row[6:9] = travel
    else:
        assert isinstance(path, Arc)
        arm = path.start - path.center
        axis = np.eye(3)[path.axis]
        row[0:3], row[3:6], row[6:9], row[9] = arm, np.cross(axis, arm), path.rise * axis, path.angle
    extent = max(float(np.abs(path.bounds - path.start).max()), float(np.abs(size).max()))
    tol = max(ULPS * float(np.finfo(float).eps) * extent, 1e-14)
    return _Packed(seg, first, size, row, tol)


@lru_cache(maxsize=256)
def _bodies(pieces: tuple[Profile, ...]) -> tuple[Floats, Ints, Floats]:
    """Rows of convex bodies, where each begins, and (radius, lowest, highest z) of each."""
    rows = [meridian_rows(piece) for piece in pieces]
    size = np.array([(p.max_radius, p.z_min, p.z_max) for p in pieces])
    return np.concatenate(rows), np.cumsum([0, *(len(r) for r in rows)]), size


def _between(start: Place, end: Place) -> Line | Turn:
    """A line where the axis is +z at both ends, else the great circle."""
    first, last = (p if isinstance(p, Pose) else Pose(p) for p in (start, end))
    axes = unit_axis(first.axis, "start"), unit_axis(last.axis, "end")
    if all(np.abs(axis - UP).max() <= ANGLE_EPS for axis in axes):
        return Line(tip(first.cl, "start"), tip(last.cl, "end"))
    return Turn.great_circle(Pose(first.cl, axes[0]), Pose(last.cl, axes[1]))


def _points(values: ArrayLike, name: str, *, single: bool = False) -> Floats:
    """Checked (n, 3) array; one row (3,) is welcome where `single`."""
    try:
        values = np.atleast_2d(np.asarray(values, dtype=np.float64)) if single else values
        return rows(values, -1, 3, name=name)
    except (ValueError, TypeError) as exc:
        raise SweepError(f"{name}: {str(exc).removeprefix(f'{name}: ')}") from exc
