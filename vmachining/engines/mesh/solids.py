"""Sweeps as closed meshes, whole or as much of them as a tile can see.

A sweep is a union of pieces, each a closed mesh of its own:

| motion | pieces | error in space |
|---|---|---|
| straight | conv(K, K + d) per convex part of the cutter | facets of K only |
| arc about the tool axis, level | K at the start, the revolved meridian between, K at the end | facets of K and of the circle |
| helix, arcs in the other two planes | conv of consecutive poses on a polygon of the path | facets of K, depth of the polygon |

Level arcs: about the arc's centre the cutter reaches from rc - r(z) to rc + r(z) at height z, in the plane
through both axes. Within the swept angle every point of that range is cut, outside of it only the two end
poses reach. This holds with the centre inside the cutter too (the range then starts at 0).

Polygons of a path: corners on radius rc + s/2, s the depth of a chord, keep the true centre within
e = hypot(s/2, rc D^3 / 50) of the chord (the second term is the lag along the chord, at most
rc D^3 / (36 sqrt 3) = rc D^3 / 62). A cutter grown by e on that polygon holds the true sweep and one
narrowed by e is held by it.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from manifold3d import Error, Manifold, Mesh64

from vmachining.arrays import Floats, Ints
from vmachining.engines.mesh import _kernels
from vmachining.engines.mesh.facets import (
    FACET_SHARE,
    Polyhedron,
    Side,
    arc_steps,
    grown,
    meridian,
    narrowed,
    polyhedron,
)
from vmachining.engines.mesh.turning import turning_pieces
from vmachining.errors import EngineError
from vmachining.geometry import Arc, Line
from vmachining.geometry.path import PLANE_AXES
from vmachining.sweep import Sweep, Turn, shadow
from vmachining.tool import Profile

__all__ = [
    "Facets",
    "Window",
    "balance",
    "checked",
    "cutters",
    "facets",
    "manifold",
    "pieces",
    "shape_key",
    "solid",
    "united",
]


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """Where a mesh must be right; elsewhere it is free.

    lo, hi : (3,) mm, a box. heights : (nx, ny) mm, nothing of the box above them matters; the cells of that
    grid are `cell` mm wide and begin at lo.
    """

    lo: Floats
    hi: Floats
    heights: Floats
    cell: float

    def within(self, box: Floats) -> tuple[Floats, Floats] | None:
        """Corners of what matters inside a box (2, 3); None if that is nothing."""
        lo, hi = np.maximum(self.lo, box[0]), np.minimum(self.hi, box[1])
        if (lo >= hi).any():
            return None
        nx, ny = self.heights.shape
        (i0, j0), (i1, j1) = (
            ((lo - self.lo) / self.cell).astype(int)[:2].tolist(),
            ((hi - self.lo) / self.cell).astype(int)[:2].tolist(),
        )
        top = float(self.heights[min(i0, nx - 1) : i1 + 1, min(j0, ny - 1) : j1 + 1].max())
        if top <= lo[2]:
            return None
        hi[2] = min(hi[2], top)
        return lo, hi


_NO_GRID = np.zeros((1, 1))


class Part(NamedTuple):
    """Convex part of a cutter: its meridian (k, 2), and the polyhedron of its circles."""

    line: Floats
    body: Polyhedron


def _shifted(part: Part, tool: Facets, radial: float, axial: float) -> Polyhedron | None:
    """The part grown (outer) or narrowed (inner) by an error of the path; None if nothing is left of it."""
    line = narrowed(part.line, radial, axial) if tool.side is Side.INNER else grown(part.line, radial, axial)
    return None if line is None else polyhedron(line, tool.sag, tool.side)


@dataclass(frozen=True, slots=True, eq=False)
class Facets:
    """A cutter ready to be swept. One part per convex run of its meridian, with the run itself."""

    parts: tuple[Part, ...]
    runs: tuple[Profile, ...]
    sag: float
    side: Side


def facets(profile: Profile, chord: float, side: Side) -> Facets:
    """Facets of a cutter whose inner and outer solids differ by at most about `chord`; remembered by shape."""
    key = (profile.points.tobytes(), profile.centers.tobytes(), profile.radii.tobytes(), chord, side)
    known = _known.get(key)
    if known is None:
        if len(_known) > 256:
            _known.clear()
        known = _known[key] = _facets(profile, chord, side)
    return known


def shape_key(profile: Profile) -> str:
    """Equal for equal shapes, also in another session."""
    parts = profile.points.tobytes(), profile.centers.tobytes(), profile.radii.tobytes()
    return hashlib.sha256(b"|".join(parts)).hexdigest()


_known: dict[tuple[bytes, bytes, bytes, float, Side], Facets] = {}


def _facets(profile: Profile, chord: float, side: Side) -> Facets:
    sag = chord / FACET_SHARE
    runs = tuple(profile.convex_pieces())
    lines = [meridian(run, sag, side) for run in runs]
    return Facets(tuple(Part(line, polyhedron(line, sag, side)) for line in lines), runs, sag, side)


ALIGNED = 1.0 / 3.0
"""Part of the inner facets where they lie along the motion: on an arc of radius R an inner facet of angle D
lacks R^2 D^3/12, an outer one has R^2 D^3/24 too much; weighed so, the error is of fourth order in D."""

CHAINED = 5.0 / 12.0
"""The same for chains of hulls: the slack for the polygon of the path, about sag / 2, is alike on both sides."""


TURNING = 7.0 / 12.0
"""Where the axis turns: unbiased for surfaces curved one way; 3/4 would be on flat walls, 5/12 on round ends."""


def balance(sweep: Sweep, inner: Facets, outer: Facets) -> float:
    """Weight w in [0, 1] that makes w inner + (1 - w) outer unbiased; w = 1/3 beside level motions.

    What a straight motion leaves is drawn by the silhouette of the cutter, so the weight is the one that gives
    the area of its shadow, known in closed form, without the upper rim that cuts nothing. On slopes the
    silhouette of facets runs from corner to corner, and outer facets have too much by twice what they have on
    the level.
    """
    path = sweep.path
    if isinstance(path, Turn):
        return TURNING
    if not isinstance(path, Line):
        return ALIGNED if isinstance(path, Arc) and path.axis == 2 and path.rise == 0.0 else CHAINED
    d = path.end - path.start
    length = float(np.linalg.norm(d))
    if length == 0.0 or d[2] == 0.0:
        return ALIGNED
    level, rise = float(np.hypot(d[0], d[1])) / length, float(d[2]) / length
    least = most = truth = 0.0
    for small, large, run in zip(inner.parts, outer.parts, inner.runs, strict=True):
        least += small.body.shadow(level, rise)
        most += large.body.shadow(level, rise)
        truth += shadow(run, level, rise) - 0.5 * abs(rise) * np.pi * float(run.points[-1, 0]) ** 2
    gap = most - least
    return ALIGNED if gap <= 1e-12 * truth else float(np.clip((most - truth) / gap, 0.0, 1.0))


def solid(sweep: Sweep, chord: float = 0.01, side: str = "fair") -> Manifold:
    """Closed mesh of one swept volume.

    Parameters
    ----------
    sweep : Sweep
    chord : float
        mm, about the largest distance between the inner and the outer solid.
    side : "inner", "fair" or "outer"
        Contained in the truth, unbiased, or containing it.

    Raises
    ------
    EngineError
        manifold3d reports a status other than NoError.
    """
    return united(cutters(sweep, facets(sweep.profile, chord, Side(side))))


def united(parts: Sequence[Manifold]) -> Manifold:
    """Union of pieces that follow each other; none at all give an empty solid.

    One after another: all at once is built as a tree, and far pieces of a turning sweep have met at their common
    axis with millions of slivers.
    """
    whole = Manifold()
    for part in parts:
        whole = part if whole.is_empty() else checked(whole + part)
    return whole


def manifold(points: Floats, triangles: Ints, block_id: int | None = None) -> Manifold:
    """A checked manifold3d solid; `block_id` (from `Manifold.reserve_ids`) stays with its faces."""
    runs = {}
    if block_id is not None:
        runs = {
            "run_index": np.array([0, 3 * len(triangles)], dtype=np.uint64),
            "run_original_id": np.array([block_id], dtype=np.uint32),
        }
    mesh = Mesh64(np.ascontiguousarray(points), np.ascontiguousarray(triangles, dtype=np.uint64), **runs)
    return checked(Manifold(mesh))


def cutters(
    sweep: Sweep,
    tool: Facets,
    window: Window | None = None,
    *,
    chained: bool = False,
    block_id: int | None = None,
) -> list[Manifold]:
    """Solids whose union is the sweep inside the window; empty if it cannot reach the window."""
    return [
        manifold(points, triangles, block_id) for points, triangles in pieces(sweep, tool, window, chained)
    ]


def checked(result: Manifold) -> Manifold:
    """The solid, once manifold3d has said that it is one: a bad mesh would be silently empty."""
    status = result.status()
    if status != Error.NoError:
        raise EngineError(f"manifold3d reports {status}", engine="mesh")
    return result


def pieces(
    sweep: Sweep, tool: Facets, window: Window | None, chained: bool = False
) -> Iterator[tuple[Floats, Ints]]:
    """Meshes (points (n, 3), triangles (m, 3)) whose union is the sweep, inside the window at least.

    A piece that cannot reach the window is left out. `chained` promises that the cutter at the start of the
    path has been removed before: what only it would cut may be missing.
    """
    path = sweep.path
    if isinstance(path, Turn):
        box = None if window is None else np.stack([window.lo, window.hi])
        yield from turning_pieces(sweep, tool.sag * FACET_SHARE, tool.side, box, chained=chained)
        return
    for part in tool.parts:
        if isinstance(path, Line) or path.radius <= 0.0 or path.angle == 0.0:
            yield from _straight(part.body, path.start, path.end, window, chained=chained)
        elif path.axis == 2 and path.rise == 0.0:
            yield from _level_arc(part, tool, path, window, chained)
        else:
            yield from _polygon(part, tool, path, window, chained)


def _straight(
    cutter: Polyhedron,
    start: Floats,
    end: Floats,
    window: Window | None,
    *,
    heading: Floats | None = None,
    chained: bool = False,
) -> Iterator[tuple[Floats, Ints]]:
    """conv(K(start), K(end)) with K facetted beside the heading (of the motion, unless given).

    With `chained` the cutter at the start has been removed before, and its rear is left out.
    """
    d = end - start
    along = d if heading is None else heading
    level = float(np.hypot(along[0], along[1]))
    cos, sin = (along[0] / level, along[1] / level) if level > 0.0 else (1.0, 0.0)
    bottom, top = cutter.height
    apex = start + [0.0, 0.0, bottom + 0.999 * (top - bottom)]  # inside the cutter at its start
    corner, heights, cell, cull = start, _NO_GRID, 1.0, False
    lo, hi = np.full(3, -np.inf), np.full(3, np.inf)
    if window is not None:
        reach = [cutter.reach, cutter.reach, 0.0]
        low, high = np.minimum(start, end) - reach, np.maximum(start, end) + reach
        found = window.within(np.stack([low + [0.0, 0.0, bottom], high + [0.0, 0.0, top]]))
        if found is None:
            return
        lo, hi = found
        corner, heights, cell = window.lo, window.heights, window.cell
        cull = bool(hi[2] < apex[2] - 0.05 * (top - bottom))
    rear = cutter.turn * float(np.linalg.norm(d)) if chained and d.any() else np.inf
    body = cutter.points, cutter.triangles, cutter.normals, cutter.edges
    place = cos, sin, start, d, lo, hi, apex, corner, heights, cell
    points, triangles, sound = _kernels.swept_facets(*body, *place, cull, rear)  # type: ignore[no-untyped-call]
    if not sound:
        points, triangles, _ = _kernels.swept_facets(*body, *place, False, np.inf)  # type: ignore[no-untyped-call]
    if len(triangles):
        yield points, triangles


def _level_arc(
    part: Part, tool: Facets, path: Arc, window: Window | None, chained: bool
) -> Iterator[tuple[Floats, Ints]]:
    begin, end, line = path.start, path.end, part.line
    for at, t in ((begin, 0.0), (end, 1.0))[chained:]:
        yield from _straight(part.body, at, at, window, heading=path.velocity(t))
    lo, hi = sorted((path.start_angle, path.start_angle + path.angle))
    full = hi - lo >= 2 * np.pi - 1e-12
    if full:
        hi = lo + 2 * np.pi
    steps = arc_steps(path.radius + float(line[:, 0].max()), hi - lo, tool.sag)
    angles = np.linspace(lo, hi, steps + 1)
    step = angles[1] - angles[0]
    if window is not None:
        height = window.hi[2] - begin[2]
        if height <= line[0, 1] or window.lo[2] - begin[2] >= line[-1, 1]:
            return
        if height < line[-1, 1]:
            k = int(np.searchsorted(line[:, 1], height + 1e-3, side="left"))
            line = line[: k + 1]
        angles, full = _angles_in(angles, path.center, window, full)
        if len(angles) < 2:
            return
    yield _ring(line, path, angles, step, tool.side, full)


def _angles_in(angles: Floats, center: Floats, window: Window, full: bool) -> tuple[Floats, bool]:
    """The consecutive steps whose sector can meet the window seen from the arc's centre."""
    x = np.array([window.lo[0], window.hi[0], window.hi[0], window.lo[0]]) - center[0]
    y = np.array([window.lo[1], window.lo[1], window.hi[1], window.hi[1]]) - center[1]
    if x[0] <= 0 <= x[1] and y[0] <= 0 <= y[2]:
        return angles, full
    middle = float(np.arctan2(y.mean(), x.mean()))
    off = (np.arctan2(y, x) - middle + np.pi) % (2 * np.pi) - np.pi
    half = float(np.abs(off).max()) + (angles[1] - angles[0])
    seen = np.abs((angles - middle + np.pi) % (2 * np.pi) - np.pi) <= half
    if seen.all() or not seen.any():
        return (angles, full) if seen.all() else (angles[:0], False)
    first, last = int(np.argmax(seen)), len(seen) - 1 - int(np.argmax(seen[::-1]))
    if seen[first : last + 1].all():
        return angles[first : last + 1], False
    return angles, full  # the window straddles the start of the circle: keep it whole


def _ring(
    line: Floats, path: Arc, angles: Floats, step: float, side: Side, full: bool
) -> tuple[Floats, Ints]:
    """The meridian on both sides of the tool axis, revolved about the arc's centre over `angles`."""
    rc = path.radius
    near, far = rc - line[:, 0], rc + line[:, 0]
    grow = 1.0 / np.cos(step / 2)
    if side is Side.INNER:
        near = near * grow
    elif side is Side.OUTER:
        far = far * grow
    else:
        fair = np.sqrt(step / np.sin(step))
        near, far = near * fair, far * fair
    section = _clipped(
        np.concatenate([np.stack([far, line[:, 1]], 1), np.stack([near, line[:, 1]], 1)[::-1]])
    )
    section = section[np.linalg.norm(section - np.roll(section, 1, axis=0), axis=1) > 1e-12]
    k, cols = len(section), len(angles) - 1 if full else len(angles)
    cos, sin = np.cos(angles[:cols]), np.sin(angles[:cols])
    points = np.empty((cols, k, 3))
    points[..., 0] = path.center[0] + cos[:, None] * section[:, 0]
    points[..., 1] = path.center[1] + sin[:, None] * section[:, 0]
    points[..., 2] = path.start[2] + section[:, 1]
    index = np.arange(cols * k).reshape(cols, k)
    on_axis = section[:, 0] == 0.0
    index[:, on_axis] = index[0, on_axis]
    a = np.arange(k)
    b = np.roll(a, -1)
    quads = []
    for now, then in [*pairwise(range(cols)), *([(cols - 1, 0)] if full else [])]:
        quads.append(np.stack([index[now, a], index[then, a], index[then, b], index[now, b]], axis=1))
    quad = np.concatenate(quads)
    triangles = np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])
    if not full:
        cap = np.array([[0, i, i + 1] for i in range(1, k - 1)])
        triangles = np.concatenate([triangles, index[0][cap], index[-1][cap[:, ::-1]]])
    distinct = (
        (triangles[:, 0] != triangles[:, 1])
        & (triangles[:, 1] != triangles[:, 2])
        & (triangles[:, 2] != triangles[:, 0])
    )
    return _used(points.reshape(-1, 3), triangles[distinct])


def _clipped(section: Floats) -> Floats:
    """Convex polygon (k, 2) without its part at negative first coordinate."""
    if (section[:, 0] >= 0).all():
        return section
    out = []
    for a, b in zip(section, np.roll(section, -1, axis=0), strict=True):
        if a[0] >= 0:
            out.append(a)
        if (a[0] < 0) != (b[0] < 0):
            t = a[0] / (a[0] - b[0])
            out.append(np.array([0.0, a[1] + t * (b[1] - a[1])]))
    return np.array(out)


def _used(points: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    vertices, inverse = np.unique(triangles, return_inverse=True)
    return points[vertices], inverse.reshape(triangles.shape)


def _polygon(
    part: Part, tool: Facets, path: Arc, window: Window | None, chained: bool
) -> Iterator[tuple[Floats, Ints]]:
    rc, turn = path.radius, abs(path.angle)
    steps = max(arc_steps(rc, turn, tool.sag), int(np.ceil(turn / (np.pi / 8))))
    width = turn / steps
    depth = rc * (1.0 - np.cos(width / 2))
    body = part.body
    radius = rc * (1.0 + width * width / 12.0) if tool.side is Side.FAIR else rc + depth / 2
    if tool.side is not Side.FAIR:
        slack = float(np.hypot(depth / 2, rc * width**3 / 50.0))
        axial = 0.0 if path.axis == 2 else slack
        shifted = _shifted(part, tool, slack, axial)
        if shifted is None:
            return
        body = shifted
    corners = path.position(np.linspace(0.0, 1.0, steps + 1))
    a, b = PLANE_AXES[path.axis]
    for k in (a, b):
        corners[:, k] = path.center[k] + (corners[:, k] - path.center[k]) * (radius / rc)
    for start, end in pairwise(corners):
        yield from _straight(body, start, end, window, chained=chained)
        chained = True
