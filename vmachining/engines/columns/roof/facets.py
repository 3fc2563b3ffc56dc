"""A mesh as a height field of facets over a level bottom, and its facets by tiles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines.columns.roof._kernels import Roof, binned
from vmachining.errors import StockError
from vmachining.stock import MeshStock

THIN_ULPS = 64
"""Width in plan of a facet that counts as upright, in units in the last place of the extent: three points of a wall on one
line are so wide, by rounding. Brackets are widened by as much along every edge."""


class Facets(NamedTuple):
    """plane (f, 7), corner (f, 6), wall (e, 4) : see `_kernels.py`. length : (f,) mm in plan around each facet."""

    plane: Floats
    corner: Floats
    wall: Floats
    length: Floats


def facets_of(stock: MeshStock) -> Facets:
    """Facets of the top, and edges of the outline.

    Raises StockError: The bottom is not flat, or there are overhangs.
    """
    corners = stock.corners
    a, b, c = corners.transpose(1, 0, 2)
    u, v = b - a, c - a
    twice = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
    edges = np.roll(corners, -1, axis=1)[:, :, :2] - corners[:, :, :2]
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    thin = THIN_ULPS * np.finfo(float).eps * float(np.abs(stock.bounds).max())
    upright = np.abs(twice) <= thin * longest
    below, top = ~upright & (twice < 0.0), ~upright & (twice > 0.0)
    low = float(stock.bounds[0, 2])
    if not below.any() or (corners[below, :, 2] != low).any():
        raise StockError(
            "columns need a stock with a flat bottom and no overhangs",
            remedy="take --engine mesh",
        )
    p, slope = corners[top], np.zeros((int(top.sum()), 2))
    du, dv, area = u[top], v[top], twice[top]
    slope[:, 0] = (du[:, 2] * dv[:, 1] - dv[:, 2] * du[:, 1]) / area
    slope[:, 1] = (dv[:, 2] * du[:, 0] - du[:, 2] * dv[:, 0]) / area
    z = p[:, :, 2]
    plane = np.column_stack([p[:, 0], slope, z.min(axis=1), z.max(axis=1)])
    length = np.linalg.norm(edges[top], axis=2).sum(axis=1)
    return Facets(plane, np.ascontiguousarray(p[:, :, :2].reshape(-1, 6)), _outline(stock, below), length)


def _outline(stock: MeshStock, below: Ints) -> Floats:
    """Edges of the bottom that one facet of it has alone, the stock to their left seen from above."""
    mesh = stock.triangles[below][:, ::-1]
    ends = np.concatenate([mesh[:, [0, 1]], mesh[:, [1, 2]], mesh[:, [2, 0]]])
    _, which, counts = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True, return_counts=True)
    alone = ends[counts[which.ravel()] == 1]
    return np.ascontiguousarray(stock.vertices[alone][:, :, :2].reshape(-1, 4))


def roof_of(facets: Facets | None, grid: Floats, size: Ints) -> Roof:
    """By tiles; empty for a stock that needs none."""
    count = int(size[0] * size[1]) + 1
    none = np.zeros(0, dtype=np.int64)
    if facets is None:
        return Roof(grid, size, np.zeros((0, 7)), np.zeros((0, 6)), none, none, np.zeros((0, 4)), none, none)
    start, ids = _by_tile(_boxes(facets.corner), grid, size, count)
    first, walls = _by_tile(_boxes(facets.wall), grid, size, count)
    return Roof(grid, size, facets.plane, facets.corner, start, ids, facets.wall, first, walls)


def seams(roof: Roof, length: Floats) -> Floats:
    """(rows, columns) mm: at least the edges of facets and of the outline in each tile; a convex part is no longer around
    than its tile."""
    around = 2.0 * float(roof.grid[2] + roof.grid[3])
    out = np.zeros(len(roof.start) - 1)
    np.add.at(out, np.repeat(np.arange(len(out)), np.diff(roof.start)), np.minimum(length, around)[roof.ids])
    out += around * np.diff(roof.first)
    return out.reshape(int(roof.size[1]), int(roof.size[0]))


def _boxes(points: Floats) -> Floats:
    """(n, 4) around rows of points x, y, x, y, ..."""
    x, y = points[:, ::2], points[:, 1::2]
    return np.column_stack([x.min(axis=1), y.min(axis=1), x.max(axis=1), y.max(axis=1)])


def _by_tile(box: Floats, grid: Floats, size: Ints, count: int) -> tuple[Ints, Ints]:
    start = np.zeros(count, dtype=np.int64)
    binned(box, grid, size, start, np.zeros(0, dtype=np.int64), False)
    start = np.cumsum(start)
    ids = np.zeros(start[-1], dtype=np.int64)
    binned(box, grid, size, start.copy(), ids, True)
    return start, ids
