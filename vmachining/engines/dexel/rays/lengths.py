"""Lengths along upright rays, and where rays stand."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.stock import Stock
from vmachining.sweep import Sweep

UP = (0.0, 0.0, 1.0)


class Cells(NamedTuple):
    """Rectangles of a raster seen from above, one ray in each.

    low, side : (n, 2) mm. tall : (n,) mm, height of what can be removed there at most.
    pair, flip : (n, 4) number that two neighbours share, and which of them it is (0 or 1): along x or y, two ways each.
    """

    low: Floats
    side: Floats
    tall: Floats
    pair: Ints
    flip: Ints


def divided(low: Floats, side: Floats, tall: Floats, across: Ints) -> Cells:
    """Equal rectangles of a raster (low (n, 2), side (2,), tall (n,)), each in across^2 (n,) cells."""
    found, count = [], 0
    for times in np.unique(across).tolist():
        cell = side / times
        step = np.arange(times)
        part = np.stack(np.meshgrid(step, step, indexing="ij"), axis=-1).reshape(-1, 2)
        lows = (low[across == times, None] + part * cell).reshape(-1, 2)
        place = np.rint((lows - low.min(axis=0)) / cell).astype(np.int64)
        wide = int(place[:, 1].max()) + 2
        pairs, flips = list[Ints](), list[Ints]()
        for along in np.array([[1, 0], [1, 0], [0, 1], [0, 1]]):
            mine = place + len(flips) % 2 * along
            flips.append(mine @ along % 2)
            first = mine - flips[-1][:, None] * along
            pairs.append(np.unique(first @ [wide, 1], return_inverse=True)[1])
        pair, flip = np.column_stack(pairs), np.column_stack(flips)
        high = np.repeat(tall[across == times], times * times)
        found.append(Cells(lows, np.tile(cell, (len(lows), 1)), high, count + pair, flip))
        count += int(pair.max()) + 1
    return Cells(*(np.concatenate(column) for column in zip(*found, strict=True)))


def places(cells: Cells, number: int, rng: np.random.Generator) -> Floats:
    """(n, 2) mm, one random place in every cell: set `number` of rays. Where a cell has a neighbour of its pair, that one's
    place is the same turned by half a turn."""
    pair, flip = cells.pair[:, number % 4], cells.flip[:, number % 4, None]
    shift = np.abs(flip - rng.random((int(pair.max()) + 1, 2))[pair])
    return np.asarray(cells.low + shift * cells.side)


def material(sweep: Sweep, earlier: Sequence[Sweep], stock: Stock, where: Floats) -> Floats:
    """(n,) mm of upright rays at (n, 2) mm in the sweep and the stock, and in no earlier sweep.

    earlier : those that take most first; what is left of a ray lies between two heights that come closer with each, and
    once they meet no other one is asked.
    """
    count = len(where)
    parts = [_in_stock(stock, where)]
    lo, hi = _ends(parts[0], count)
    parts.insert(0, _crossed(sweep, where, np.flatnonzero(lo < hi), lo, hi))
    first, last = _ends(parts[0], count)
    lo, hi = np.maximum(lo, first), np.minimum(hi, last)
    for body in earlier:
        box = body.bounds
        asked = (lo < hi) & (lo < box[1, 2]) & (hi > box[0, 2])
        asked &= ((where > box[0, :2]) & (where < box[1, :2])).all(axis=1)
        parts.append(_crossed(body, where, np.flatnonzero(asked), lo, hi))
        ray, enter, leave = parts[-1]
        under, over = enter <= lo[ray], leave >= hi[ray]
        np.maximum.at(lo, ray[under], leave[under])
        np.minimum.at(hi, ray[over], enter[over])
    return _lengths(parts, lo, hi)


class _Parts(NamedTuple):
    """Where rays are inside a body: which ray, and from where to where, mm."""

    ray: Ints
    enter: Floats
    leave: Floats


def _ends(part: _Parts, count: int) -> tuple[Floats, Floats]:
    """(count,) mm, from where to where rays are in a body at most; inf and -inf where they miss it."""
    lo, hi = np.full(count, np.inf), np.full(count, -np.inf)
    np.minimum.at(lo, part.ray, part.enter)
    np.maximum.at(hi, part.ray, part.leave)
    return lo, hi


def _crossed(body: Sweep, where: Floats, which: Ints, lo: Floats, hi: Floats) -> _Parts:
    """What rays (n,) have between lo and hi, and beyond where that costs nothing: it need not be proved of a tool that turns."""
    origins = np.column_stack([where[which], np.zeros(len(which))])
    inside = body.ray_intervals(origins, UP, between=np.column_stack([lo[which], hi[which]]))
    return _Parts(np.repeat(which, inside.counts), inside.enter, inside.leave)


def _in_stock(stock: Stock, where: Floats) -> _Parts:
    inside = stock.crossings(where)
    return _Parts(np.repeat(np.arange(len(where)), inside.counts), inside.enter, inside.leave)


def _lengths(parts: Sequence[_Parts], lo: Floats, hi: Floats) -> Floats:
    """(n,) mm between `lo` and `hi` in both of the first two parts, and in none of the others."""
    within, filled, busy = [], np.zeros((2, len(lo)), dtype=bool), np.zeros(len(lo), dtype=bool)
    for number, (ray, enter, leave) in enumerate(parts):
        low, high = np.maximum(enter, lo[ray]), np.minimum(leave, hi[ray])
        is_open = low < high
        ray, low, high = ray[is_open], low[is_open], high[is_open]
        within.append(_Parts(ray, low, high))
        if number < 2:
            filled[number, ray[(low == lo[ray]) & (high == hi[ray])]] = True
        else:
            busy[ray] = True
    # most rays need no count: one piece of each of the first two fills all that is left, and nothing else lies in it
    busy |= ~filled.all(axis=0)
    rays, stops, steps = [], [], []
    for number, (ray, low, high) in enumerate(within):
        asked = busy[ray]
        rays.append(np.tile(ray[asked], 2))
        stops.append(np.concatenate([low[asked], high[asked]]))
        step = np.zeros((len(rays[-1]), 3), dtype=np.int64)
        step[:, min(number, 2)] = np.repeat([1, -1], len(rays[-1]) // 2)
        steps.append(step)
    ray, stop, step = np.concatenate(rays), np.concatenate(stops), np.concatenate(steps)
    order = np.lexsort([stop, ray])
    ray, stop, depth = ray[order], stop[order], np.cumsum(step[order], axis=0)
    counts = (ray[1:] == ray[:-1]) & (depth[:-1, 0] > 0) & (depth[:-1, 1] > 0) & (depth[:-1, 2] == 0)
    lengths = np.bincount(ray[:-1], np.diff(stop) * counts, minlength=len(lo)).astype(np.float64)
    return np.where(busy, lengths, np.maximum(hi - lo, 0.0))
