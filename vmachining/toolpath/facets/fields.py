"""`height_field`: a surface given by heights over a grid as facets, open or as a solid."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, Ints, rows
from vmachining.errors import InputError
from vmachining.toolpath.facets.mesh import FacetMesh


def height_field(x: ArrayLike, y: ArrayLike, z: ArrayLike, *, bottom: float | None = None) -> FacetMesh:
    """Two triangles in each cell of a grid, split from its first corner to its last.

    x : (n,), y : (m,) mm, rising. z : (n, m) mm.
    bottom : mm, below all heights; walls and a flat bottom close the surface to a solid. None: it stays open.
    Raises InputError: A grid that does not rise, or a bottom that is not below the surface.
    """
    xs, ys = (np.asarray(v, dtype=np.float64) for v in (x, y))
    if min(len(xs), len(ys)) < 2 or not ((np.diff(xs) > 0.0).all() and (np.diff(ys) > 0.0).all()):
        raise InputError("a height field needs at least two rising values of x and of y")
    n, m = len(xs), len(ys)
    heights = rows(z, n, m, name="z")
    grid = np.arange(n * m).reshape(n, m)
    xx, yy = np.meshgrid(xs, ys, indexing="ij")
    points = np.stack([xx, yy, heights], axis=-1).reshape(-1, 3)
    top = _cells(grid)
    if bottom is None:
        return FacetMesh(points, top)
    if not bottom < heights.min():
        raise InputError(f"a bottom at {bottom:g} mm is not below the surface, {heights.min():g} mm")
    ring = np.concatenate([grid[:, 0], grid[-1, 1:], grid[-2::-1, -1], grid[0, -2:0:-1]])  # counterclockwise
    below = n * m + np.arange(len(ring))
    low: Floats = np.column_stack([points[ring, :2], np.full(len(ring), float(bottom))])
    follow, under = np.roll(ring, -1), np.roll(below, -1)
    walls = np.concatenate([np.column_stack([ring, below, under]), np.column_stack([ring, under, follow])])
    middle = n * m + len(ring)
    centre = np.array([[0.5 * (xs[0] + xs[-1]), 0.5 * (ys[0] + ys[-1]), bottom]])
    floor = np.column_stack([under, below, np.full(len(ring), middle)])
    return FacetMesh(np.concatenate([points, low, centre]), np.concatenate([top, walls, floor]))


def _cells(grid: Ints) -> Ints:
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    halves = [np.stack(t, axis=2).reshape(-1, 3) for t in ((a, b, c), (a, c, d))]
    return np.asarray(np.concatenate(halves))
