"""Volume of a block by rays in sets: pilot, choice of cells, mean and interval."""

from __future__ import annotations

from collections.abc import Sequence
from math import log, sqrt
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines.dexel.rays.lengths import Cells, divided, material, places
from vmachining.engines.protocol import Removal
from vmachining.stock import Stock
from vmachining.sweep import Sweep
from vmachining.sweep.candidates import Columns, columns

CONFIDENCE = 0.9999
"""Of an interval. Half of what is left is for the spread, half for what no ray meets."""

SETS = 16
"""Independent sets of rays: their mean is t-distributed with 15 degrees of freedom."""

STUDENT = 5.607
"""Quantile of Student's t with 15 degrees of freedom, 5e-5 on both sides together."""

UNSEEN = -log(0.5 * (1.0 - CONFIDENCE)) / 0.75
"""Rays that a part of the cells would get if all sets together miss it with the probability that is left for it, exp(-9.9).
Where it lies alike in both cells of all pairs along x, half of the sets count half."""

ROUND_MM, ROUND_REL = 1e-7, 1e-9
"""Ends of rays in height, mm; sums."""

PILOT_COLUMNS, PILOT_SETS = 400, 4
"""Columns that a pilot divides the block into at most, and its rays in each."""

MOST = 6000
"""Rays of a set at most, about, if nobody asks for more."""

BESIDE = 0.5
"""Part of what rays differ by that is taken for what their neighbours miss: a wall may just touch their cell."""


class Take(NamedTuple):
    """What a motion could remove: its sweep, and the earlier ones that reach it, those that take most first."""

    sweep: Sweep
    earlier: Sequence[Sweep]


class _Pilot(NamedTuple):
    """Cells of one take, and (n,) mm by which their rays differ.

    paired : part of the variance of a set that is left by rays in pairs. volume : mm^3, by the pilot's own rays.
    """

    cells: Cells
    differ: Floats
    paired: float
    volume: float

    def half(self, across: Ints) -> float:
        """Half width, mm^3, that is expected of `SETS` sets where cells are divided into across^2 (n,) parts.

        The variance of stratified rays falls with n^(-3/2) where walls cross their cells, with n^-2 or faster elsewhere.
        """
        area, parts = self.cells.side.prod(axis=1), across.astype(np.float64) ** 2
        spread = sqrt(self.paired * float(((area * self.differ) ** 2 * parts**-1.5).sum()) / SETS)
        return STUDENT * spread + UNSEEN * float((area * self.cells.tall / parts).max()) / SETS


def estimated(
    takes: Sequence[Take], stock: Stock, *, seed: int = 0, want_rel: float = 0.01, most: int = MOST
) -> Removal:
    """What a block of one or more motions removes, mm^3.

    seed : of the places of rays: blocks that are alike get others.
    want_rel : half width of the interval asked for, relative to the volume.
    most : rays of a set at most, about; the interval is wider where they are not enough.
    Returns Removal: proven only where nothing can be removed: exactly 0 then.
    """
    found = [(number, take, _columns(take, stock)) for number, take in enumerate(takes)]
    found = [each for each in found if len(each[2].low)]
    if not found:
        return Removal(0.0, 0.0, 0.0)
    pilots = [
        _pilot(take, stock, cells, np.random.default_rng([seed, number, 0])) for number, take, cells in found
    ]
    half_asked = want_rel * sum(pilot.volume for pilot in pilots) / len(pilots)
    volume = rounding = unseen = spread = whole = 0.0
    for (number, take, _), pilot in zip(found, pilots, strict=True):
        first = pilot.cells
        cells = divided(first.low, first.side[0], first.tall, _across(pilot, half_asked, most))
        area = cells.side.prod(axis=1)
        sums = _sampled(take, stock, cells, np.random.default_rng([seed, number, 1]), SETS) @ area
        volume += float(sums.mean())
        spread += float(sums.var(ddof=1)) / SETS
        unseen += UNSEEN * float((area * cells.tall).max()) / SETS
        rounding += ROUND_MM * float(area.sum())
        whole += float((area * cells.tall).sum())
    half = STUDENT * sqrt(spread) + unseen + rounding + ROUND_REL * volume
    return Removal(max(0.0, volume - half), volume, min(volume + half, whole + rounding), proven=False)


def _columns(take: Take, stock: Stock) -> Columns:
    box = np.stack([
        np.maximum(take.sweep.bounds[0], stock.bounds[0]), np.minimum(take.sweep.bounds[1], stock.bounds[1])
    ])  # fmt: skip
    if not (box[0] < box[1]).all():
        return Columns(np.zeros((0, 2)), np.zeros(2), np.zeros(0))
    return columns(take.sweep, take.earlier, box, PILOT_COLUMNS)


def _sampled(take: Take, stock: Stock, cells: Cells, rng: np.random.Generator, sets: int) -> Floats:
    """(sets, n) mm: lengths along one ray of every cell."""
    out = np.empty((sets, len(cells.low)))
    for number, lengths in enumerate(out):
        lengths[:] = material(take.sweep, take.earlier, stock, places(cells, number, rng))
    return out


def _pilot(take: Take, stock: Stock, parts: Columns, rng: np.random.Generator) -> _Pilot:
    across = max(1, round(sqrt(PILOT_COLUMNS / len(parts.low))))
    cells = divided(parts.low, parts.side, parts.tall, np.full(len(parts.low), across))
    found = np.array(
        [material(take.sweep, take.earlier, stock, places(cells, 0, rng)) for _ in range(PILOT_SETS)]
    )
    area = cells.side.prod(axis=1)
    alone = float((area**2 * found.var(axis=0)).sum())
    pairs = np.array([np.bincount(cells.pair[:, 0], area * lengths) for lengths in found])
    paired = float(pairs.var(axis=0).sum()) / alone if alone > 0.0 else 0.0
    return _Pilot(cells, _smeared(cells, found.std(axis=0, ddof=1)), paired, float((found @ area).mean()))


def _across(pilot: _Pilot, half: float, most: int) -> Ints:
    """(n,) parts along a side of the pilot's cells: the fewest that let expect a half width, mm^3, and `most` rays about."""
    low, high = len(pilot.cells.low), max(most, len(pilot.cells.low))
    if pilot.half(_shared(pilot, high)) > half:
        return _shared(pilot, high)
    while high - low > 0.02 * high:
        middle = (low + high) // 2
        low, high = (low, middle) if pilot.half(_shared(pilot, middle)) <= half else (middle, high)
    return _shared(pilot, high)


def _shared(pilot: _Pilot, count: int) -> Ints:
    """(n,) parts along a side: half of `count` rays by how much these differ, half by how tall cells are."""
    across = np.ones(len(pilot.differ))
    for share in (pilot.differ, pilot.cells.tall):
        total = max(float(share.sum()), 1e-300)
        across = np.maximum(across, np.ceil(np.sqrt(0.5 * count * share / total) - 0.5))
    return across.astype(np.int64)


def _smeared(cells: Cells, differ: Floats) -> Floats:
    """(n,) mm by which rays of equal cells differ, or `BESIDE` of what those of one of their eight neighbours do."""
    place = np.rint((cells.low - cells.low.min(axis=0)) / cells.side).astype(np.int64) + 1
    wide = int(place[:, 1].max()) + 2
    key = place @ [wide, 1]
    order = np.argsort(key)
    out = differ.copy()
    for step in (x * wide + y for x in (-1, 0, 1) for y in (-1, 0, 1)):
        other = order[np.minimum(np.searchsorted(key, key + step, sorter=order), len(key) - 1)]
        hit = key[other] == key + step
        out[hit] = np.maximum(out[hit], BESIDE * differ[other[hit]])
    return out
