"""Workpiece of columns as a closed surface: heights over a grid, walls at its border, and a level bottom."""

from __future__ import annotations

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines.protocol import StockSurface

__all__ = ["solid_of"]


def solid_of(xs: Floats, ys: Floats, height: Floats, owner: Ints, bottom: float) -> StockSurface:
    """The solid between a level bottom and heights over a grid, where it has any.

    Parameters
    ----------
    xs, ys : (n,), (m,) mm, rising. height : (m, n) mm, at or above the bottom. owner : (m, n) block at each place, -1.

    Notes
    -----
    Two triangles a cell, above and below. A corner whose height is the bottom is one point of both, so where all four
    are there is nothing, and the surface closes.
    """
    m, n = height.shape
    low = np.arange(m * n).reshape(m, n)
    high = np.where(height > bottom, low + m * n, low)
    x, y = (a.ravel() for a in np.meshgrid(xs, ys))
    points = np.concatenate(
        [np.column_stack([x, y, np.full(m * n, bottom)]), np.column_stack([x, y, height.ravel()])]
    )
    full = (
        (high[:-1, :-1] != low[:-1, :-1])
        | (high[:-1, 1:] != low[:-1, 1:])
        | (high[1:, :-1] != low[1:, :-1])
        | (high[1:, 1:] != low[1:, 1:])
    )
    triangles, blocks = [], []
    # the diagonal that lies lower, so that no ridge is made of two slopes
    falling = height[:-1, :-1] + height[1:, 1:] <= height[:-1, 1:] + height[1:, :-1]
    for grid, up in ((high, True), (low, False)):
        a, b, c, d = grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]
        for mask, corners in (
            (full & falling, ((a, b, c), (a, c, d))),
            (full & ~falling, ((a, b, d), (b, c, d))),
        ):
            for one in corners:
                t = np.stack([v[mask] for v in one], axis=1)
                triangles.append(t if up else t[:, ::-1])
                blocks.append(owner[:-1, :-1][mask] if up else np.full(len(t), -1))
    sides = (
        (full[0], low[0, :-1], low[0, 1:], high[0, :-1], high[0, 1:]),
        (full[-1], low[-1, 1:], low[-1, :-1], high[-1, 1:], high[-1, :-1]),
        (full[:, 0], low[1:, 0], low[:-1, 0], high[1:, 0], high[:-1, 0]),
        (full[:, -1], low[:-1, -1], low[1:, -1], high[:-1, -1], high[1:, -1]),
    )
    for mask, a, b, c, d in sides:
        for one in ((a, b, d), (a, d, c)):
            t = np.stack([v[mask] for v in one], axis=1)
            triangles.append(t)
            blocks.append(np.full(len(t), -1))
    mesh = np.concatenate(triangles)
    real = (mesh[:, 0] != mesh[:, 1]) & (mesh[:, 1] != mesh[:, 2]) & (mesh[:, 2] != mesh[:, 0])
    mesh, block = mesh[real], np.concatenate(blocks)[real]
    # a cell with corners at the bottom only on its triangle has both triangles in one: drop the pair
    flat = (mesh < m * n).all(axis=1)
    keys = np.sort(mesh[flat], axis=1)
    _, inverse, counts = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    keep = np.ones(len(mesh), dtype=np.bool_)
    keep[np.flatnonzero(flat)[counts[inverse.ravel()] == 2]] = False
    mesh, block = mesh[keep], block[keep]
    used, compact = np.unique(mesh, return_inverse=True)
    return StockSurface(points[used], compact.reshape(-1, 3).astype(np.int64), block.astype(np.int64))
