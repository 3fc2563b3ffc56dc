"""Removed volume of a block of a chain by random rays: independent of meshes and of B-rep solids."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep.rays import SETS, left
from vmachining.sweep import Sweep
from vmachining.sweep.reach import reaching

__all__ = ["referee"]

BAR = 7.0
"""Standard errors of a mean of `SETS`: one false alarm in 200,000 blocks that are right."""


def referee(
    sweeps: Sequence[Sweep], block: int, stock: tuple[Floats, Floats], count: int
) -> tuple[float, float]:
    """Removed volume of a block by vertical rays, and its error bar, mm^3.

    stock : corners of the box. count : rays along a side of one of `SETS` sets, one at a random place per cell.

    Notes
    -----
    The bar is `BAR` standard errors, and what lies between the rays: a cell 0.5 mm deep.
    """
    rng = np.random.default_rng([block, count])
    box = np.array(stock)
    bounds = reaching(sweeps[block], box).bounds  # a tool that leans is wide above the stock
    low, high = np.maximum(bounds[0], box[0]), np.minimum(bounds[1], box[1])
    if (low >= high).any():
        return 0.0, 0.0
    corner = np.stack(np.meshgrid(np.arange(count), np.arange(count), indexing="ij"), axis=-1).reshape(-1, 2)
    wide = np.array(sweeps[block].bounds)
    # before anybody's word on what is needed of it
    room = np.maximum(wide[0], box[0]), np.minimum(wide[1], box[1])
    near = [s for s in sweeps[:block] if (s.bounds[0] < room[1]).all() and (s.bounds[1] > room[0]).all()]
    near.reverse()
    bottom, top = float(box[0, 2]), float(box[1, 2])
    wide = wide[:, :2]
    places = wide[0] + (corner + rng.random(corner.shape)) / count * (wide[1] - wide[0])
    beside = places[((places < low[:2]) | (places > high[:2])).any(axis=1)]
    beside = beside[((beside > box[0, :2]) & (beside < box[1, :2])).all(axis=1)]
    if len(beside) and left(sweeps[block], near, beside, bottom, top).any():  # nobody's word is taken for it
        low[:2], high[:2] = np.maximum(wide[0], box[0, :2]), np.minimum(wide[1], box[1, :2])
    cell = (high - low)[:2] / count
    found = np.empty(SETS)
    for k in range(SETS):
        places = low[:2] + (corner + rng.random(corner.shape)) * cell
        found[k] = left(sweeps[block], near, places, bottom, top).sum() * cell.prod()
    error = float(found.std(ddof=1)) / np.sqrt(SETS)
    return float(found.mean()), BAR * error + 0.5 * float(cell.prod()) / SETS + 1e-6 * float(found.mean())
