"""The workpiece as a staircase: one box for every piece of an upright dexel, for pictures and rough files."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines.protocol import StockSurface
from vmachining.stock import Stock
from vmachining.sweep import Sweep

__all__ = ["staircase"]

ACROSS = 160
"""Dexels along the longer side of the stock."""

CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
FACES = np.array([
    [0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4], [1, 2, 6], [1, 6, 5],
    [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7],
])  # fmt: skip


def staircase(stock: Stock, sweeps: Sequence[Sweep], blocks: Sequence[int]) -> StockSurface:
    """Closed boxes side by side; top and walls of a box belong to the block that ends it above, its bottom to that below.

    blocks : number of the block of every sweep.
    """
    lo, hi = np.array(stock.bounds)
    count = np.maximum(np.ceil((hi - lo)[:2] / (hi - lo)[:2].max() * ACROSS), 1).astype(np.int64)
    side = (hi - lo)[:2] / count
    grid = np.stack(np.meshgrid(*(np.arange(n) for n in count), indexing="ij"), axis=-1).reshape(-1, 2)
    where = lo[:2] + (grid + 0.5) * side
    inside = stock.crossings(where)
    ray = np.repeat(np.arange(len(where)), inside.counts)
    ends = [(ray, inside.enter, inside.leave, np.full(len(ray), -1), 0)]
    for sweep, block in zip(sweeps, blocks, strict=True):
        box = sweep.bounds
        near = np.flatnonzero(((where > box[0, :2]) & (where < box[1, :2])).all(axis=1))
        if len(near):
            cut = sweep.ray_intervals(np.column_stack([where[near], np.zeros(len(near))]), (0.0, 0.0, 1.0))
            owner = np.full(int(cut.counts.sum()), block)
            ends.append((np.repeat(near, cut.counts), cut.enter, cut.leave, owner, 1))
    piece, low, high, below, above = _pieces(ends)
    corner = np.column_stack([np.repeat(where[piece] - 0.5 * side, 1, axis=0), low])
    size = np.column_stack([np.broadcast_to(side, (len(piece), 2)), high - low])
    vertices = (corner[:, None] + CORNERS * size[:, None]).reshape(-1, 3)
    triangles = (8 * np.arange(len(piece))[:, None, None] + FACES).reshape(-1, 3)
    owner = np.repeat(above[:, None], len(FACES), axis=1)
    owner[:, :2] = below[:, None]
    return StockSurface(vertices, triangles, owner.reshape(-1))


def _pieces(
    ends: Sequence[tuple[Ints, Floats, Floats, Ints, int]],
) -> tuple[Ints, Floats, Floats, Ints, Ints]:
    """Ray, bottom, top, and who made either, of what is in the stock and in no sweep."""
    ray = np.concatenate([np.tile(rays, 2) for rays, *_ in ends])
    stop = np.concatenate([np.concatenate([enter, leave]) for _, enter, leave, _, _ in ends])
    owner = np.concatenate([np.tile(block, 2) for _, _, _, block, _ in ends])
    step = np.zeros((len(ray), 2), dtype=np.int64)
    first = 0
    for rays, _, _, _, kind in ends:
        step[first : first + 2 * len(rays), kind] = np.repeat([1, -1], len(rays))
        first += 2 * len(rays)
    order = np.lexsort([stop, ray])
    ray, stop, owner, depth = ray[order], stop[order], owner[order], np.cumsum(step[order], axis=0)
    kept = (ray[1:] == ray[:-1]) & (depth[:-1, 0] > 0) & (depth[:-1, 1] == 0) & (np.diff(stop) > 0.0)
    at = np.flatnonzero(kept)
    return ray[at], stop[at], stop[at + 1], owner[at], owner[at + 1]
