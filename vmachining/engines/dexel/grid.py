"""`RayGrid`: the rays of one direction as a workpiece, and what they say of the volume of a block."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines.dexel import _kernels
from vmachining.engines.dexel.lattice import Lattice, Lists, filled, lattice, places
from vmachining.geometry import Line, RayIntervals
from vmachining.stock import Stock
from vmachining.sweep import Sweep

SIGMAS = 1.5
"""Half width of an interval in standard errors of rays at random places of their cells: 2.6, of 99 %, times 0.59, the most
that the places of a `Lattice` leave of it on long walls at any angle (docs/measured/dexel_grid.md)."""

CHANCES = 3.0
"""Cells of material beside the sweep that all rays may have missed: one in twenty areas of that size, which is more than all of
the rare blocks that have one."""

ROUND_MM = 1e-9
"""Ends of rays: what the cells of a block may be off by together, in mm of height."""

THREADED = 8000
"""Rays of a curved motion for each thread that shares them, 3 to 6 us each: a thread costs milliseconds, too."""

Window = tuple[int, int, int, int]


class Look(NamedTuple):
    """Volume of a block as one direction sees it, mm^3, half of its interval, and the weight of its estimate among others."""

    volume: float
    half: float
    weight: float = 0.0


def look(cell: float, total: float, squares: float, beside: float, largest: float, hits: float) -> Look:
    """From sums over rays: mm that is gone, mm^2 of differences between neighbours, mm beside the sweep, largest mm that is
    gone from one, and how many rays lose something; see `tell`.

    A length that changes evenly by g over a cell has the variance g^2 / 12 in it; a wall of height J that crosses a cell at
    random J^2 / 6 on the average; a strip of height J that few rays meet J^2 for each of them. Squared differences to the next
    ray on both axes, over 4, are at least all of these (a lone ray has four neighbours).
    The weight is the inverse variance with one ray more or less, times the rays that know anything: a layer thinner than the
    spacing is seen by all rays across it and by few or none along it.
    """
    spread = squares / 4.0
    half = cell * (SIGMAS * sqrt(spread) + CHANCES * beside + ROUND_MM)
    weight = hits / (cell * cell * (spread + largest * largest)) if hits else 0.0
    return Look(cell * total, half, weight)


@dataclass(slots=True, eq=False)
class RayGrid:
    """Rays of one direction through a box (2, 3) mm. Only `lists` changes. raw (n,) mm of every ray in the raw stock."""

    lattice: Lattice
    lists: Lists
    box: Floats
    raw: Floats

    @classmethod
    def of(cls, stock: Stock, axis: int, spacing: float) -> RayGrid:
        """The raw stock."""
        lat = lattice(stock.bounds, axis, spacing)
        lists = filled(lat, stock)
        raw = np.empty(len(lists.first))
        _kernels.lengths(lists, raw)
        return cls(lat, lists, np.array(stock.bounds), raw)

    @property
    def lengths(self) -> Floats:
        """(n,) mm of material of every ray."""
        out = np.empty_like(self.raw)
        _kernels.lengths(self.lists, out)
        return out

    def gone(self) -> Look:
        """All blocks together, as if they were one."""
        gone = (self.raw - self.lengths).reshape(self.lattice.na, self.lattice.nb)
        squares = sum(float((np.diff(gone, axis=k) ** 2).sum()) for k in (0, 1))
        most = float(gone.max())
        return look(self.lattice.cell, float(gone.sum()), squares, most, most, float((gone > 0.0).sum()))

    def ends(self) -> tuple[Floats, Ints]:
        """(n, 3) mm, ends of all intervals, and (n,) the blocks that made them."""
        lists, count = self.lists, self.lists.parts.astype(np.int64)
        ray = np.repeat(np.arange(len(count)), count)
        rows = np.repeat(lists.first - np.cumsum(count) + count, count) + np.arange(len(ray))
        points = np.repeat(places(self.lattice)[ray], 2, axis=0)
        points[0::2, self.lattice.axis], points[1::2, self.lattice.axis] = lists.low[rows], lists.high[rows]
        return points, np.column_stack([lists.below[rows], lists.above[rows]]).reshape(-1).astype(np.int64)

    def windows(self, low: Floats, high: Floats) -> Ints:
        """(n, 4) rows i0 to i1 and columns j0 to j1 of the rays that meet boxes low, high (n, 3), and one more on every side."""
        lat, out = self.lattice, np.empty((len(low), 4), dtype=np.int64)
        for k, (c, corner, size, count) in enumerate(
            (((lat.axis + 1) % 3, lat.a0, lat.ha, lat.na), ((lat.axis + 2) % 3, lat.b0, lat.hb, lat.nb))
        ):
            first = np.clip(np.floor((low[:, c] - corner) / size) - 1, 0, count)
            last = np.clip(np.floor((high[:, c] - corner) / size) + 2, 0, count)
            out[:, 2 * k], out[:, 2 * k + 1] = first, np.maximum(first, last)
        return out

    def window(self, box: Floats) -> Window:
        """The same of one box (2, 3)."""
        i0, i1, j0, j1 = self.windows(box[:1], box[1:])[0].tolist()
        return i0, i1, j0, j1

    def removed(self, sweep: Sweep, around: Floats, block: int, *, cut: bool) -> Look:
        """What a sweep takes off; off the workpiece too if `cut`. around: see `stadium`."""
        box, lat = sweep.bounds, self.lattice
        window = self.window(box)
        rays = np.empty((window[1] - window[0]) * (window[3] - window[2]), dtype=np.int64)
        low, high = float(box[0, lat.axis]) - lat.ha, float(box[1, lat.axis]) + lat.ha
        rays = rays[: _kernels.asked(lat, self.lists, *window, around, low, high, rays)]
        if not len(rays):
            return Look(0.0, 0.0)
        inside = self.crossed(sweep, rays, low, high)
        ends = np.concatenate([[0], np.cumsum(inside.counts)])
        if not ends[-1]:
            return self.unseen(box)
        length = np.empty(len(rays))
        if cut:
            self.take(rays, ends, inside, block, length)
        else:
            _kernels.touched(self.lists, rays, ends, inside.enter, inside.leave, length)
        out = np.zeros(5)
        _kernels.tell(lat, self.lists, *window, rays, ends, inside.enter, inside.leave, length, cut, out)
        if not out[4]:
            return self.unseen(box, float(out[2]))
        return look(lat.cell, *out.tolist())

    def unseen(self, box: Floats, beside: float = 0.0) -> Look:
        """Where no ray loses anything: what is lost passes between them, as long as the sweep's box in that of the stock."""
        low, high = np.maximum(box[0], self.box[0]), np.minimum(box[1], self.box[1])
        most = float((high - low)[self.lattice.axis])
        return look(self.lattice.cell, 0.0, 0.0, max(beside, most), 0.0, 0.0)

    def crossed(self, sweep: Sweep, rays: Ints, low: float, high: float) -> RayIntervals:
        """Where rays are in a sweep, between low and high; of a curved motion only where they or rays beside have material."""
        where, way = np.empty((len(rays), 3)), np.zeros(3)
        _kernels.origins(self.lattice, rays, where)
        way[self.lattice.axis] = 1.0
        if isinstance(sweep.path, Line):
            return sweep.ray_intervals(where, way)
        part = np.empty((len(rays), 2))
        _kernels.worth(self.lattice, self.lists, rays, low, high, part)
        threads = min(len(rays) // THREADED, os.cpu_count() or 1) if len(rays) >= 2 * THREADED else 1
        if threads < 2:
            return sweep.ray_intervals(where, way, between=part)

        def some(which: Ints) -> RayIntervals:
            return sweep.ray_intervals(where[which], way, between=part[which])

        with ThreadPoolExecutor(threads) as pool:
            parts = list(pool.map(some, np.array_split(np.arange(len(rays)), threads)))
        return RayIntervals(*(np.concatenate(column) for column in zip(*parts, strict=True)))

    def take(self, rays: Ints, ends: Ints, inside: RayIntervals, block: int, length: Floats) -> None:
        """Take intervals off rays."""
        done = 0
        while True:
            done = _kernels.take(self.lists, rays, ends, inside.enter, inside.leave, block, done, length)
            if done == len(rays):
                return
            self.grow()

    def grow(self) -> None:
        """Twice as many rows of the flat arrays."""
        flat = {name: getattr(self.lists, name) for name in ("low", "high", "below", "above")}
        twice = {name: np.concatenate([values, np.zeros_like(values)]) for name, values in flat.items()}
        self.lists = self.lists._replace(**twice)
