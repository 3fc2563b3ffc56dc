"""Cutters made of convex facets, and the closed mesh of one of them that moves in a straight line."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from math import hypot
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines.mesh import _kernels
from vmachining.engines.mesh.facets import (
    FACET_SHARE,
    Polyhedron,
    Side,
    grown,
    meridian,
    narrowed,
    polyhedron,
)
from vmachining.engines.mesh.gap import Gauge, facet_means, gauge
from vmachining.engines.mesh.skin import Leeway, hull_skin, spare
from vmachining.engines.mesh.window import Window
from vmachining.sweep.turned import meridian_rows
from vmachining.tool import Profile

__all__ = ["Facets", "Part", "Piece", "facets", "shape_key", "shifted", "straight"]

_NO_GRID = np.zeros((1, 1))

NO_ROWS = np.empty((0, 25))

STIFF = Leeway(np.zeros(2), np.zeros(3), np.zeros(3))

SKIN_CELLS = 4.0
"""Largest place of a skin, in cells of the grid of heights: smaller ones are not better seen."""


class Part(NamedTuple):
    """Convex part of a cutter: its meridian (k, 2), the polyhedron of its circles, and what that lacks, mm at most.

    eye : mm, height on its axis from which its skin is seen: about the middle of its round part, so that frustums
    are slim. spare : (h,) mm, by how much every cluster of facets may lack more and keep them slim.
    """

    line: Floats
    body: Polyhedron
    gauge: Gauge | None
    most: float
    eye: float
    spare: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Facets:
    """A cutter ready to be swept. One part per convex run of its meridian, with the run itself."""

    parts: tuple[Part, ...]
    runs: tuple[Profile, ...]
    sag: float
    side: Side


class Piece(NamedTuple):
    """Closed mesh, part of a sweep. points (n, 3); triangles (m, 3).

    mean (m,): mm between a facet and the truth in the mean, None where nobody asked. kin (m,): equal for
    triangles of one plane facet. skin (k, 25): rows of `Skin` between this piece and the truth.
    """

    points: Floats
    triangles: Ints
    mean: Floats | None = None
    kin: Ints | None = None
    skin: Floats = NO_ROWS


def facets(profile: Profile, chord: float, side: Side) -> Facets:
    """Facets of a cutter whose inner and outer solids differ by at most about `chord`; remembered by shape."""
    key = (profile.points.tobytes(), profile.centers.tobytes(), profile.radii.tobytes(), chord, side)
    known = _known.get(key)
    if known is None:
        if len(_known) > 256:
            _known.clear()
        known = _known[key] = _facets(profile, chord, side)
    return known


@lru_cache(maxsize=256)
def shape_key(profile: Profile) -> str:
    """Equal for equal shapes, also in another session."""
    parts = profile.points.tobytes(), profile.centers.tobytes(), profile.radii.tobytes()
    return hashlib.sha256(b"|".join(parts)).hexdigest()


_known: dict[tuple[bytes, bytes, bytes, float, Side], Facets] = {}
_shifted: dict[tuple[bytes, str, float, float, float, Side], Part | None] = {}


def _facets(profile: Profile, chord: float, side: Side) -> Facets:
    sag = chord / FACET_SHARE
    runs = tuple(profile.convex_pieces())
    parts = tuple(_part(meridian(run, sag, side), run, sag, side) for run in runs)
    return Facets(parts, runs, sag, side)


def _part(line: Floats, run: Profile, sag: float, side: Side) -> Part:
    body = polyhedron(line, sag, side)
    bottom, top = body.height
    eye, room = bottom + min(0.5 * (top - bottom), body.reach), np.zeros(len(body.clusters.boxes))
    if side is not Side.INNER:
        return Part(line, body, None, 0.0, eye, room)
    lacks = gauge(body.points, body.triangles, body.normals, body.planes, meridian_rows(run))
    spare(  # type: ignore[no-untyped-call]
        body.points, body.triangles, body.normals, body.edges, body.clusters.first, lacks.most, eye, room
    )
    return Part(line, body, lacks, float(lacks.most.max()), eye, room)


def shifted(part: Part, run: Profile, tool: Facets, radial: float, axial: float) -> Part | None:
    """The part grown (outer) or narrowed (inner) by an error of the path; None if nothing is left of it."""
    key = (part.line.tobytes(), shape_key(run), radial, axial, tool.sag, tool.side)
    if key not in _shifted:
        if len(_shifted) > 256:
            _shifted.clear()
        change = narrowed if tool.side is Side.INNER else grown
        line = change(part.line, radial, axial)
        _shifted[key] = None if line is None else _part(line, run, tool.sag, tool.side)
    return _shifted[key]


def straight(
    part: Part,
    start: Floats,
    end: Floats,
    window: Window | None,
    *,
    heading: Floats | None = None,
    chained: bool = False,
    skinned: bool = False,
    shed: bool = False,
    leeway: Leeway = STIFF,
    bend: float = 0.0,
) -> Iterator[Piece]:
    """conv(K(start), K(end)) with K facetted beside the heading (of the motion, unless given).

    With `chained` the cutter at the start has been removed before, and its rear is left out. `skinned` asks for
    means and skin, in a window: the rear is then left out of the skin alone, unless it may be `shed`, for places
    of the skin are forgotten once the mesh holds them; and there may be a piece without triangles. bend: angle
    by which the true path may head elsewhere.
    """
    cutter = part.body
    d = end - start
    x, y = (d if heading is None else heading)[:2].tolist()
    level = hypot(x, y)
    cos, sin = (x / level, y / level) if level > 0.0 else (1.0, 0.0)
    bottom, top = cutter.height
    apex = start + [0.0, 0.0, bottom + 0.999 * (top - bottom)]  # inside the cutter at its start
    corner, heights, cell, cull = start, _NO_GRID, 1.0, False
    lo, hi = np.full(3, -np.inf), np.full(3, np.inf)
    if window is not None:
        slack = 0.0
        if skinned and part.gauge is not None:  # the true sweep reaches a little farther
            slack = part.most + float(leeway.slack.sum())
        (x0, y0, z0), (x1, y1, z1), reach = start.tolist(), end.tolist(), cutter.reach + slack
        low = (min(x0, x1) - reach, min(y0, y1) - reach, min(z0, z1) + bottom - slack)
        high = (max(x0, x1) + reach, max(y0, y1) + reach, max(z0, z1) + top + slack)
        found = window.within(low, high)
        if found is None:
            return
        lo, hi = found
        corner, heights, cell = window.lo, window.heights, window.cell
        cull = bool(hi[2] < apex[2] - 0.05 * (top - bottom))
    rear = np.inf
    if chained and d.any():
        rear = float(np.sin(min(np.arcsin(cutter.turn) + bend, np.pi / 2)) * np.linalg.norm(d))
    body = cutter.points, cutter.triangles, cutter.normals, cutter.edges
    view = lo, hi, apex, corner, heights, cell
    points, triangles, source, sound = _kernels.swept_facets(
        *body, *cutter.clusters, cos, sin, start, d, *view, cull, np.inf if skinned and not shed else rear
    )  # type: ignore[no-untyped-call]
    if not sound:
        points, triangles, source, _ = _kernels.swept_facets(  # type: ignore[no-untyped-call]
            *body, *cutter.clusters, cos, sin, start, d, *view, False, np.inf
        )
    if not skinned or window is None or part.gauge is None:
        if len(triangles):
            yield Piece(points, triangles)
        return
    view = lo, hi, start + [0.0, 0.0, part.eye], corner, heights, cell
    lacks = part.gauge
    rows = hull_skin(  # type: ignore[no-untyped-call]
        *body, *cutter.clusters, part.spare, cutter.patches, lacks.most, lacks.bulk, lacks.slope, lacks.plumb,
        lacks.meridian, cos, sin, start, d, *view, rear, leeway.slack, leeway.inward, SKIN_CELLS * cell,
    )  # fmt: skip
    mean = facet_means(  # type: ignore[no-untyped-call]
        cutter.points, cutter.normals, cutter.edges, lacks.mean, lacks.meridian, cos, sin, d, leeway.lift, source
    )  # fmt: skip
    kin = np.empty_like(source)
    _kernels.kin_of(source, cutter.planes, kin)  # type: ignore[no-untyped-call]
    yield Piece(points, triangles, mean, kin, rows)
