"""All blocks at once, for ball cutters on lines: the same lengths without the removal of each block.

1. A grid of upright vectors is worked on by tiles. Blocks that can be lowest somewhere in a tile are told by convexity: the
   tangent plane of one against the corners of another; a handful of some hundreds is left.
2. A vector along a normal looks at the blocks near it, nearly all of which a bound of two square roots excludes.
3. Lengths are shortest ones, so nothing depends on the order; which block it was is computed again where it is asked.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from benchmarks.vector_batch import _kernels
from vmachining.arrays import Floats, Ints, rows
from vmachining.errors import InputError

__all__ = ["Points", "ball_grid", "ball_vectors"]

TILE, LEAST, MOST = 0.16, 2, 64
"""Side of a tile, in radii of the ball and in cells: small enough for planes to stand for blocks, large enough for its own
cost. Of 0.06, 0.1, 0.16 and 0.24 the fastest on both published parts."""

SHANK_MM = 1e4
"""Height of the shank where nobody says."""


class Points(NamedTuple):
    """point, normal : (n, 3). facet : (n,) index, -1 on an edge."""

    point: Floats
    normal: Floats
    facet: Ints


def ball_grid(
    centers: ArrayLike,
    radius: float,
    x0: float,
    y0: float,
    pitch: float,
    shape: tuple[int, int],
    start: Callable[[Floats, Floats], Floats],
    top: float = np.inf,
) -> NDArray[np.float32]:
    """Lengths (n, m) of upright vectors after all blocks of a ball cutter.

    Parameters
    ----------
    centers : (k + 1, 3) mm, of the ball; block i goes from row i to row i + 1.
    x0, y0 : corner of the grid; vectors stand at the middles of its cells.
    start : heights (n, m) at which the vectors over x (n,), y (m,) begin.
    top : height of the stock; the length where no block comes.
    """
    c = _centers(centers, radius)
    blocks = _indexed(c, radius, SHANK_MM)
    out = np.empty(shape, dtype=np.float32)
    side = int(np.clip(round(TILE * radius / pitch), LEAST, MOST))
    near, value = np.empty(len(c), dtype=np.int64), np.empty((len(c), 3))
    x: Floats = x0 + (np.arange(shape[0], dtype=np.float64) + 0.5) * pitch
    y: Floats = y0 + (np.arange(shape[1], dtype=np.float64) + 0.5) * pitch
    strip = side * max(1, 2**20 // (side * shape[1]))
    for i in range(0, shape[0], strip):
        rows_ = slice(i, min(i + strip, shape[0]))
        heights = np.empty((rows_.stop - i, shape[1]))
        _kernels.grid(blocks, x[0], y[0], pitch, side, i, top, heights, near, value)
        out[rows_] = heights - start(x[rows_], y)
    return out


def ball_vectors(
    centers: ArrayLike,
    radius: float,
    points: Points,
    length: float,
    depth: ArrayLike,
    *,
    shank: float = SHANK_MM,
) -> NDArray[np.float32]:
    """Lengths (n,) of vectors along unit normals, from `length` and down to -`depth` (mm; of all, or of each)."""
    c = _centers(centers, radius)
    size = np.full(len(points.point), length, dtype=np.float32)
    low = np.broadcast_to(-np.asarray(depth, dtype=np.float32), size.shape).copy()
    if not (low < 0.0).all():
        raise InputError("lambda must lie below 0", remedy="give a depth above 0")
    behind = np.zeros(len(size), dtype=np.uint8)
    point, normal = (np.ascontiguousarray(v) for v in (points.point, points.normal))
    _kernels.normals_all(_indexed(c, radius, shank), point, normal, low, size, behind)
    return size


def _centers(centers: ArrayLike, radius: float) -> Floats:
    c = rows(centers, -1, 3, name="centers")
    if len(c) < 2 or not radius > 0.0:
        raise InputError("at least one block, and a radius above 0, make a sweep")
    return np.array(c)


def _indexed(c: Floats, radius: float, shank: float) -> _kernels.Blocks:
    middle = 0.5 * (c[1:, :2] + c[:-1, :2])
    half = 0.5 * float(np.linalg.norm(np.diff(c, axis=0), axis=1).max())
    cell = max(0.25 * radius, half)
    low = middle.min(axis=0)
    cells = np.floor((middle.max(axis=0) - low) / cell).astype(np.int64) + 1
    at = np.floor((middle - low) / cell).astype(np.int64)
    key = at[:, 0] * cells[1] + at[:, 1]
    numbers = np.argsort(key, kind="stable")
    first = np.searchsorted(key[numbers], np.arange(int(cells.prod()) + 1))
    return _kernels.Blocks(
        c, float(radius), float(shank), half, float(low[0]), float(low[1]), cell, cells, first, numbers
    )
