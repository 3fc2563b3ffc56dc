"""Heights of a workpiece over a grid of cells: stock minus sweeps, seen from above, by exact vertical rays."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engagement.analytic.stairs import HeightStock
from vmachining.engagement.workpiece import Past
from vmachining.errors import StockError
from vmachining.stock import Stock
from vmachining.tolerance import LENGTH_EPS_MM

MOST_CELLS = 4_000_000
"""Of one grid of heights: 32 MB, and some seconds for every sweep that covers all of it."""


def grid(low: Floats, high: Floats, pitch: float) -> tuple[Floats, Floats]:
    """Breaks in x and y between two corners (2,) mm, in equal steps of at most `pitch`."""
    steps = [max(int(np.ceil((b - a) / pitch - 1e-9)), 1) for a, b in zip(low[:2], high[:2], strict=True)]
    if steps[0] * steps[1] > MOST_CELLS:
        what = f"a grid of heights of {steps[0]} x {steps[1]} cells"
        raise StockError(what, remedy="take a wider pitch, or a smaller region")
    x, y = (np.linspace(low[k], high[k], steps[k] + 1) for k in range(2))
    return x, y


def heights_of(
    stock: Stock, past: Sequence[Past], pitch: float, region: Floats | None = None
) -> HeightStock | None:
    """Stock minus sweeps as heights over cells of a pitch, each that of the vertical line through its middle.

    region : (2, 3) mm, box that matters; material above its top is taken as gone. None: all of the stock.
    Returns HeightStock or None: None where region and stock do not meet.
    Raises StockError: More than `MOST_CELLS` cells.
    """
    low, high = np.array(stock.bounds)
    if region is not None:
        low[:2], high = np.maximum(low[:2], region[0, :2]), np.minimum(high, region[1])
    if not (low < high).all():
        return None
    x, y = grid(low, high, pitch)
    at = 0.5 * (x[1:] + x[:-1]), 0.5 * (y[1:] + y[:-1])
    rays = stock.crossings(np.stack(np.meshgrid(*at, indexing="ij"), axis=-1).reshape(-1, 2))
    met, top = rays.counts > 0, np.full(len(rays.counts), -np.inf)
    top[met] = np.minimum(rays.leave[np.cumsum(rays.counts)[met] - 1], high[2])
    return HeightStock(x, y, lowered(top.reshape(len(at[0]), -1), *at, past), float(low[2]))


def lowered(top: Floats, x: Floats, y: Floats, past: Sequence[Past]) -> Floats:
    """(n, m) mm, tops over x (n,) and y (m,) after sweeps: what a sweep undercuts keeps what is above it."""
    out = np.array(top)
    flat = out.ravel()
    known: list[tuple[Ints, Floats, Floats]] = []
    for one in reversed(past):  # the deepest come last as a rule, and leave nothing to ask the others
        box = one.sweep.bounds
        i, k = np.searchsorted(x, box[:, 0], side="left")
        j, m = np.searchsorted(y, box[:, 1], side="left")
        cells = (np.arange(i, k)[:, None] * len(y) + np.arange(j, m)).ravel()
        cells = cells[flat[cells] > box[0, 2] + LENGTH_EPS_MM]
        if not len(cells):
            continue
        origin = np.column_stack([x[cells // len(y)], y[cells % len(y)], np.zeros(len(cells))])
        hit = one.sweep.ray_intervals(origin, (0.0, 0.0, 1.0))
        known.append((np.repeat(cells, hit.counts), hit.enter, hit.leave))
        _lower(flat, *known[-1])
    changed = len(known) > 1
    while changed:  # a sweep may open the way for an earlier one
        changed = bool(sum(_lower(flat, *one) for one in known))
    return out


def _lower(flat: Floats, cells: Ints, enter: Floats, leave: Floats) -> bool:
    """Lower the tops that lie in intervals; whether any was."""
    here = flat[cells]
    cut = (enter < here - LENGTH_EPS_MM) & (leave >= here - LENGTH_EPS_MM)
    np.minimum.at(flat, cells[cut], enter[cut])
    return bool(cut.any())
