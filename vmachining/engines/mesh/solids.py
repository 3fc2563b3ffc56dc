"""Sweeps as closed meshes, whole or as much of them as a tile can see.

A sweep is a union of pieces, each its own closed mesh:

| motion | pieces | error in space |
|---|---|---|
| straight | conv(K, K + d) per convex part of the cutter | facets of K only |
| arc about the tool axis, level | K at the start, the revolved meridian between, K at the end | facets of K and of the circle |
| helix, arcs in the other two planes | conv of consecutive poses on a polygon of the path | facets of K, depth of the polygon |

Source: derived here; arcs in `curved.py`, straight motions in `straight.py`, turning tools in `turning/`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from manifold3d import Error, Manifold, Mesh64

from vmachining.arrays import Floats, Ints
from vmachining.engines.mesh.curved import level_arc, polygon
from vmachining.engines.mesh.facets import FACET_SHARE, Side
from vmachining.engines.mesh.straight import Facets, Piece, facets, straight
from vmachining.engines.mesh.turning import turning_pieces
from vmachining.engines.mesh.window import Window
from vmachining.errors import EngineError
from vmachining.geometry import Arc, Line
from vmachining.sweep import Sweep, Turn, shadow

SHORT_ARC = 1e-7
"""rad; an arc below is its chord, from which it departs by 1e-15 of its radius."""

ALIGNED = 1.0 / 3.0
"""Part of the inner facets where they lie along the motion: on an arc of radius R an inner facet of angle D
lacks R^2 D^3/12, an outer one has R^2 D^3/24 too much; weighed so, the error is of fourth order in D."""

CHAINED = 5.0 / 12.0
"""The same for chains of hulls: the slack for the polygon of the path, about sag / 2, is alike on both sides."""


TURNING = 7.0 / 12.0
"""Where the axis turns: unbiased for surfaces curved one way; 3/4 would be on flat walls, 5/12 on round ends."""

HULLS = 1.0 / 2.0
"""The same for hulls of poses: columns put the truth at 0.53 of the bracket (0.39 to 0.67), mean of 14 blocks of five tools."""


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

    sweep : Sweep
    chord : float, mm, about the largest distance between the inner and the outer solid.
    side : "inner", "fair" or "outer"
        Contained in the truth, unbiased, or containing it.
    Raises EngineError: manifold3d reports a status other than NoError.
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
    """A checked manifold3d solid. `block_id` (from `Manifold.reserve_ids`) stays with its faces."""
    more = {}
    if block_id is not None:
        more = {
            "run_index": np.array([0, 3 * len(triangles)], dtype=np.uint64),
            "run_original_id": np.array([block_id], dtype=np.uint32),
        }
    mesh = Mesh64(np.ascontiguousarray(points), np.ascontiguousarray(triangles, dtype=np.uint64), **more)
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
    return [manifold(*piece, block_id) for piece in pieces(sweep, tool, window, chained)]


def checked(result: Manifold) -> Manifold:
    """The solid, once manifold3d has said that it is one: a bad mesh would be silently empty."""
    status = result.status()
    if status != Error.NoError:
        raise EngineError(f"manifold3d reports {status}", engine="mesh")
    return result


def _is_chord(path: Arc) -> bool:
    return path.radius <= 0.0 or abs(path.angle) < SHORT_ARC


def is_ring(path: Arc) -> bool:
    """Whether an arc is cut as a ring, with the cutter as it heads at both ends."""
    return not _is_chord(path) and path.axis == 2 and path.rise == 0.0


def pieces(sweep: Sweep, tool: Facets, window: Window | None, chained: bool = False) -> Iterator[Piece]:
    """Meshes whose union is the sweep, inside the window at least.

    A piece that cannot reach the window is left out. `chained` promises that the cutter at the start of the
    path has been removed before: what only it would cut may be missing.
    """
    path = sweep.path
    if isinstance(path, Turn):
        box = None if window is None else np.stack([window.lo, window.hi])
        for mesh in turning_pieces(sweep, tool.sag * FACET_SHARE, tool.side, box, chained=chained):
            yield Piece(*mesh)
        return
    for part in tool.parts:
        if isinstance(path, Line) or _is_chord(path):
            yield from straight(part, path.start, path.end, window, chained=chained)
        elif is_ring(path):
            yield from level_arc(part, tool, path, window, chained)
        else:
            yield from polygon(part, tool, path, window, chained)
