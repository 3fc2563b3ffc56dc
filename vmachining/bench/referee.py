"""Removed volume of a block of a chain by random rays: independent of meshes and of B-rep solids."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep.reach import reaching
from vmachining.sweep import Sweep

__all__ = ["referee"]

SETS = 16
"""Sets of rays: their mean is t-distributed with 15 degrees of freedom."""

BAR = 7.0
"""Standard errors of that mean: one false alarm in 200,000 blocks that are right."""


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
    near = [s for s in sweeps[:block] if (s.bounds[0] < high).all() and (s.bounds[1] > low).all()]
    bottom, top = float(box[0, 2]), float(box[1, 2])
    wide = np.array(sweeps[block].bounds)[:, :2]
    places = wide[0] + (corner + rng.random(corner.shape)) / count * (wide[1] - wide[0])
    beside = places[((places < low[:2]) | (places > high[:2])).any(axis=1)]
    beside = beside[((beside > box[0, :2]) & (beside < box[1, :2])).all(axis=1)]
    if len(beside) and _left(sweeps[block], near, beside, bottom, top) > 0.0:  # nobody's word is taken for it
        low[:2], high[:2] = np.maximum(wide[0], box[0, :2]), np.minimum(wide[1], box[1, :2])
    cell = (high - low)[:2] / count
    found = np.empty(SETS)
    for k in range(SETS):
        places = low[:2] + (corner + rng.random(corner.shape)) * cell
        found[k] = _left(sweeps[block], near, places, bottom, top) * cell.prod()
    error = float(found.std(ddof=1)) / np.sqrt(SETS)
    return float(found.mean()), BAR * error + 0.5 * float(cell.prod()) / SETS + 1e-6 * float(found.mean())


def _left(sweep: Sweep, earlier: Sequence[Sweep], places: Floats, bottom: float, top: float) -> float:
    """mm of upright rays at (n, 2) places in the sweep and the stock, and in no earlier sweep."""
    rays, stops, own, others = [], [], [], []
    who = np.arange(len(places))
    for number, body in enumerate((sweep, *earlier)):
        origins = np.column_stack([places[who], np.zeros(len(who))])
        inside = body.ray_intervals(origins, (0.0, 0.0, 1.0))
        ray = np.repeat(who, inside.counts)
        lo, hi = np.clip(inside.enter, bottom, top), np.clip(inside.leave, bottom, top)
        step = np.repeat([1, -1], len(ray))
        rays.append(np.tile(ray, 2))
        stops.append(np.concatenate([lo, hi]))
        own.append(step if number == 0 else 0 * step)
        others.append(0 * step if number == 0 else step)
        if number == 0:
            who = np.unique(ray[hi > lo])
    ray, stop, a, b = (np.concatenate(column) for column in (rays, stops, own, others))
    order = np.lexsort([stop, ray])
    ray, stop, a, b = ray[order], stop[order], np.cumsum(a[order]), np.cumsum(b[order])
    same = ray[1:] == ray[:-1]
    return float((np.diff(stop) * (same & (a[:-1] > 0) & (b[:-1] == 0))).sum())
