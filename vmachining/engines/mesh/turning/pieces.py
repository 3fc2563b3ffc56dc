"""Steps, offsets and parts of a sweep with a turning axis; see the room's docstring for the proof."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple
from zlib import crc32

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines.mesh.facets import MAX_STEP, MIN_STEPS, Side, arc_steps
from vmachining.engines.mesh.turning import _kernels
from vmachining.engines.mesh.turning.rows import Rows, rows_of
from vmachining.errors import EngineError
from vmachining.sweep import Sweep, Turn
from vmachining.tool import Profile, convex_cover

SAG, BEND, TWIST = 1 / 4, 1 / 24, 5 / 24
"""Shares of the chord: facets of a circle (and of an arc), bow of a path, turn of a cell between instants.

Inner and outer surface are 2 (BEND + TWIST) + 2 SAG = 1 chord apart at most.
"""

APART = 2e-3
"""Share of the chord by which parts differ in size: walls of neighbours that would be one plane but for
rounding shatter into slivers, each boolean more of them."""

WRONG = 1e-6
"""Share of the envelope that may face the wrong way: needles do, by rounding (1e-7 seen)."""

STILL = 1e-9
"""Share of the largest speed below which a surface slides in itself."""

INSTANTS = 8
"""At which the reach of a slice is looked at."""

LARGEST_TURN = np.pi / 2
"""rad of turn of axis and path, together, up to which a block can be one mesh: it cannot come back."""


class _Plan(NamedTuple):
    """Grid of one body: instants, columns, distance of rows on lines (mm), depth of a facet (mm)."""

    steps: int
    columns: int
    spacing: float
    sag: float


def turning_pieces(
    sweep: Sweep, chord: float, side: str, box: Floats | None = None, *, chained: bool = False
) -> Iterator[tuple[Floats, Ints]]:
    """Closed meshes (points (n, 3), triangles (m, 3)) whose union is a sweep along a `Turn`.

    sweep : Sweep, its path is a `Turn`; a steady axis is welcome.
    chord : float, mm, the largest distance between the inner and the outer solid.
    side : "inner", "fair" or "outer"
        Contained in the truth, unbiased, or containing it.
    box : (2, 3) mm, optional
        Where the union must be right; elsewhere it may lack what it likes. Only the slice of the cutter that
        can reach the box is swept.
    chained : bool, the cutter at the start of the path has been removed before: what only it cuts may be missing.
    Raises EngineError: The path is no `Turn`.
    """
    turn = sweep.path
    if not isinstance(turn, Turn):
        raise EngineError(f"expected a Turn, got a {type(turn).__name__}", engine="mesh")
    for part in convex_cover(sweep.profile):
        piece = part if box is None else reaching(part, turn, box, chord)
        if piece is not None:
            yield from _part(piece, turn, chord, Side(side), box, chained)


def reaching(part: Profile, turn: Turn, box: Floats, chord: float) -> Profile | None:
    """The slice of a body that can reach a box, twice `chord` (mm) wider; None if nothing can.

    The circle at height h lies in the plane A . (x - tip) = h, so it meets the box only if h is between the
    extremes of A . (corner - tip). They are taken at instants and widened by what they change in between.
    """
    t = np.linspace(0.0, 1.0, INSTANTS + 1)
    corners = np.stack(np.meshgrid(*box.T, indexing="ij"), axis=-1).reshape(-1, 3)
    off = corners - turn.position(t)[:, None]
    heights = np.einsum("jca,ja->jc", off, turn.axis(t))
    speed = turn.tip_series.bound(1)
    far = float(np.linalg.norm(off, axis=2).max()) + speed / (2 * INSTANTS)
    drift = speed + turn.axis_series.bound(1) * far
    slack = drift / (2 * INSTANTS) + 2.0 * chord
    lo, hi = float(heights.min()) - slack, float(heights.max()) + slack
    if hi <= part.z_min or lo >= part.z_max:
        return None
    if lo <= part.z_min and hi >= part.z_max:
        return part
    return part.clip(max(lo, part.z_min), min(hi, part.z_max))


def apart(points: Floats, box: Floats | None) -> bool:
    """Whether a mesh cannot reach the box."""
    if box is None:
        return False
    return bool((points.min(axis=0) >= box[1]).any() or (points.max(axis=0) <= box[0]).any())


def _part(
    part: Profile, turn: Turn, chord: float, side: Side, box: Floats | None, chained: bool
) -> Iterator[tuple[Floats, Ints]]:
    """Pieces of one convex body."""
    plan = _plan(part, turn, chord)
    slack = (BEND + TWIST) * chord
    offset = {Side.INNER: -slack, Side.FAIR: 0.0, Side.OUTER: slack + 2.0 * plan.sag}[side]
    pose = _poses(turn, plan.steps)
    angles = 2.0 * np.pi / plan.columns * np.arange(plan.columns)
    cos, sin = np.cos(angles), np.sin(angles)
    height = float(np.abs(part.points[:, 1]).max())
    speed = np.linalg.norm(pose[:, 12:15], axis=1) + height * np.linalg.norm(pose[:, 15:], axis=1)
    still = STILL * float(speed.max())
    mark = crc32(turn.start.tobytes() + turn.end.tobytes() + pose[0].tobytes()) / 2.0**32

    def body(number: int) -> Rows | None:
        """Rows of the body for part `number`, a little smaller (inner) or larger (outer) than requested."""
        share = (mark + 0.6180339887498949 * number) % 1.0
        apart = APART * chord * {Side.INNER: -share, Side.FAIR: share - 0.5, Side.OUTER: share}[side]
        return rows_of(part, plan.sag, offset + apart, plan.spacing, plan.columns, side)

    def advancing(rows: Rows, first: int, last: int, whole: bool) -> tuple[Floats, Ints, float, float]:
        result: tuple[Floats, Ints, float, float] = _kernels.advancing_mesh(  # type: ignore[no-untyped-call]
            pose, rows.circles, rows.resting, rows.group, rows.between, cos, sin, still, first, last, whole
        )
        return result

    known = body(0)
    if known is None:
        return
    if _winding(turn, pose) <= LARGEST_TURN:
        points, triangles, area, wrong = advancing(known, 0, plan.steps, not chained)
        if wrong <= WRONG * area:
            if len(triangles) and not apart(points, box):
                yield points, triangles
            return
    parts = max(1, int(np.ceil(float(speed.max()) / (part.max_radius / 2.0))))
    ends = np.unique(np.round(np.linspace(0, plan.steps, parts + 1)).astype(int)).tolist()
    if not chained:
        points, triangles = _kernels.at_rest(pose, 0, known.resting, known.group, cos, sin)  # type: ignore[no-untyped-call]
        if not apart(points, box):
            yield points, triangles
    for number, (first, last) in enumerate(pairwise(ends), start=1):
        rows = body(number)
        if rows is None:
            continue
        points, triangles, _area, _wrong = advancing(rows, first, last, False)
        if len(triangles) and not apart(points, box):
            yield points, triangles


def _plan(part: Profile, turn: Turn, chord: float) -> _Plan:
    """Fewest triangles that keep the shares of the chord.

    Twist: rate / steps * cell / 4 <= TWIST chord asks for a number of (rows on lines) x (instants); rows cost
    a facet per column at the end, instants cost facets on both sides of every row.
    """
    sag = SAG * chord
    radius, height = part.max_radius, float(np.abs(part.points[:, 1]).max())
    half = np.arccos(max(1.0 - sag / radius, np.cos(MAX_STEP / 2.0)))
    columns = max(int(np.ceil(np.pi / half)), 4 * MIN_STEPS)
    across = radius * 2.0 * np.pi / columns
    rate, bend = turn.axis_series.bound(1), turn.axis_series.bound(2)
    bow = turn.tip_series.bound(2) + height * bend + radius * (bend + rate * rate)
    steps = max(1, int(np.ceil(np.sqrt(bow / (8.0 * BEND * chord)))))
    length = float(np.hypot(*np.diff(part.points, axis=0).T).sum() + part.points[[0, -1], 0].sum())
    need = rate * length / (4.0 * TWIST * chord)
    arcs = 8 + 16 * int((part.radii > 0.0).sum())
    spacing = max(length / max(1.0, np.ceil(np.sqrt(2.0 * arcs * need / columns))), across)
    arcs_ = [(s.radius, s.beta[1] - s.beta[0]) for s in part.segments if s.is_arc]
    rounds = [radius * angle / arc_steps(radius, angle, sag) for radius, angle in arcs_]
    cell = float(np.hypot(max(spacing, *rounds, 0.0), across))
    steps = max(steps, int(np.ceil(rate * cell / (4.0 * TWIST * chord))))
    return _Plan(steps, columns, float(spacing), sag)


def _poses(turn: Turn, steps: int) -> Floats:
    """(steps + 1, 17) instants, see the legend of `_kernels.py`."""
    t = np.linspace(0.0, 1.0, steps + 1)
    frame = _kernels.transported(turn.axis(t))  # type: ignore[no-untyped-call]
    out = np.empty((steps + 1, 17))
    out[:, :3] = turn.position(t)
    out[:, 3:12] = frame.reshape(-1, 9)
    out[:, 12:15] = np.einsum("jab,jb->ja", frame, turn.velocity(t))
    out[:, 15:] = np.einsum("jab,jb->ja", frame[:, :2], turn.axis_rate(t))
    return out


def _winding(turn: Turn, pose: Floats) -> float:
    """rad by which the axis and the way of the tip turn, together."""
    if turn.is_straight:
        return turn.rotation
    way = np.einsum("ja,jab->jb", pose[:, 12:15], pose[:, 3:12].reshape(-1, 3, 3))
    size = np.linalg.norm(way, axis=1)
    if size.min() <= STILL * size.max():
        return np.inf if size.max() > 0.0 else turn.rotation
    way /= size[:, None]
    return turn.rotation + float(np.arccos(np.clip((way[1:] * way[:-1]).sum(axis=1), -1.0, 1.0)).sum())
