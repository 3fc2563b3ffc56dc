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
from vmachining.engines.mesh._kernels import Cutter, View, Way
from vmachining.engines.mesh.facets import (
    FACET_SHARE,
    Polyhedron,
    Side,
    grown,
    meridian,
    narrowed,
    polyhedron,
)
from vmachining.engines.mesh.window import Window
from vmachining.tool import Profile

_NO_GRID = np.zeros((1, 1))


class Part(NamedTuple):
    """Convex part of a cutter: its meridian (k, 2) and the polyhedron of its circles."""

    line: Floats
    body: Polyhedron


@dataclass(frozen=True, slots=True, eq=False)
class Facets:
    """A cutter ready to be swept. One part per convex run of its meridian, with the run itself."""

    parts: tuple[Part, ...]
    runs: tuple[Profile, ...]
    sag: float
    side: Side


class Piece(NamedTuple):
    """Closed mesh, part of a sweep. points (n, 3); triangles (m, 3)."""

    points: Floats
    triangles: Ints


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
_shifted: dict[tuple[bytes, float, float, float, Side], Part | None] = {}


def _facets(profile: Profile, chord: float, side: Side) -> Facets:
    sag, runs = chord / FACET_SHARE, tuple(profile.convex_pieces())
    lines = [meridian(run, sag, side) for run in runs]
    return Facets(tuple(Part(line, polyhedron(line, sag, side)) for line in lines), runs, sag, side)


def shifted(part: Part, tool: Facets, radial: float, axial: float) -> Part | None:
    """The part grown (outer) or narrowed (inner) by an error of the path; None if nothing is left of it."""
    key = (part.line.tobytes(), radial, axial, tool.sag, tool.side)
    if key not in _shifted:
        if len(_shifted) > 256:
            _shifted.clear()
        change = narrowed if tool.side is Side.INNER else grown
        line = change(part.line, radial, axial)
        _shifted[key] = None if line is None else Part(line, polyhedron(line, tool.sag, tool.side))
    return _shifted[key]


def straight(
    part: Part,
    start: Floats,
    end: Floats,
    window: Window | None,
    *,
    heading: Floats | None = None,
    chained: bool = False,
    bend: float = 0.0,
) -> Iterator[Piece]:
    """conv(K(start), K(end)) with K facetted beside the heading (of the motion, unless given).

    With `chained` the cutter at the start has been removed before, and its rear is left out. bend: angle
    by which the true path may head elsewhere.
    """
    cutter = part.body
    start = np.array(start)  # a path's own ends are read-only, which kernels would be compiled for anew
    d = end - start
    x, y = (d if heading is None else heading)[:2].tolist()
    level = hypot(x, y)
    cos, sin = (x / level, y / level) if level > 0.0 else (1.0, 0.0)
    bottom, top = cutter.height
    apex = start + [0.0, 0.0, bottom + 0.999 * (top - bottom)]  # inside the cutter at its start
    corner, heights, cell, cull = start, _NO_GRID, 1.0, False
    lo, hi = np.full(3, -np.inf), np.full(3, np.inf)
    if window is not None:
        (x0, y0, z0), (x1, y1, z1), reach = start.tolist(), end.tolist(), cutter.reach
        low = (min(x0, x1) - reach, min(y0, y1) - reach, min(z0, z1) + bottom)
        high = (max(x0, x1) + reach, max(y0, y1) + reach, max(z0, z1) + top)
        found = window.within(low, high)
        if found is None:
            return
        lo, hi = found
        corner, heights, cell = window.lo, window.heights, window.cell
        cull = bool(hi[2] < apex[2] - 0.05 * (top - bottom))
    rear = np.inf
    if chained and d.any():
        rear = float(np.sin(min(np.arcsin(cutter.turn) + bend, np.pi / 2)) * np.linalg.norm(d))
    body = Cutter(cutter.points, cutter.triangles, cutter.normals, cutter.edges)
    way, view = Way(cos, sin, start, d), View(lo, hi, apex, corner, heights, cell)
    points, triangles, sound = _kernels.swept_facets(body, way, view, cull, rear)  # type: ignore[no-untyped-call]
    if not sound:
        points, triangles, _ = _kernels.swept_facets(body, way, view, False, np.inf)  # type: ignore[no-untyped-call]
    if len(triangles):
        yield Piece(points, triangles)
