"""`RayEngine`: what every engine answers, by rays."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Self

import numpy as np

from vmachining.arrays import Floats
from vmachining.checkpoint import Saved, opened
from vmachining.engines.dexel.engine import DexelEngine
from vmachining.engines.dexel.rays.estimate import CONFIDENCE, MOST, Take, estimated
from vmachining.engines.packed import packed_stock, packed_sweeps, stock_of, sweeps_of
from vmachining.engines.protocol import NOTHING, Options, Removal, StockSurface
from vmachining.engines.summed import Summed, meshed_volume
from vmachining.stock import Stock
from vmachining.sweep import Sweep
from vmachining.sweep.near import SweepIndex
from vmachining.sweep.reach import meets, reaching

WANT_REL = 0.01
"""Half width of intervals asked for, relative to the volume, if nobody says otherwise."""

GRID = 64
"""Cells of the grid of sweeps along the stock."""


class RayEngine(Summed):
    """Workpiece of one job: raw stock and the sweeps that left it.

    stock : Stock
    options : Options
    want_rel : half width of intervals asked for, relative to the volume; at most `most` rays of a set are spent on it.
    """

    name = "rays"
    proof = f"exact rays: intervals of confidence {CONFIDENCE:g} per block, not proven"

    def __init__(
        self, stock: Stock, options: Options | None = None, *, want_rel: float = WANT_REL, most: int = MOST
    ) -> None:
        self.chord = (options or Options()).chord
        self._stock, self._want, self._most = stock, want_rel, most
        self._box: Floats = np.array(stock.bounds)
        self._index = SweepIndex((), pitch=float(np.ptp(self._box, axis=0).max()) / GRID, clip=self._box)
        self._blocks = list[int]()
        self._removed = NOTHING
        self.stock_volume = meshed_volume(stock, self.chord)

    def cut(self, sweep: Sweep, block: int | None = None) -> Removal:
        """See `Engine`."""
        number = self.add(sweep, -1 if block is None else block)
        found = self.removed([number], seed=number)
        self._removed = self._removed.plus(found)
        return found

    def touch(self, sweep: Sweep, within: float | None = None) -> Removal:
        """See `Engine`."""
        short = reaching(sweep, self._box)
        if not meets(short, self._box):
            return NOTHING
        known = self._index.sweeps
        earlier = self._index.needed_by(short, len(known), self._box)
        take = Take(short, [known[j] for j in earlier])
        return estimated([take], self._stock, want_rel=self._want, most=self._most)

    def add(self, sweep: Sweep, block: int = -1) -> int:
        """Take a sweep out without asking how much that is; its number."""
        self._blocks.append(block)
        return self._index.add(reaching(sweep, self._box))

    def removed(
        self, members: Sequence[int], *, seed: int, want_rel: float | None = None, most: int | None = None
    ) -> Removal:
        """What some sweeps, by number, took together, each after all before it.

        Stateless: answers may be asked for in any order, and again with another seed or other rays.
        """
        known = self._index.sweeps
        takes = [
            Take(known[k], [known[j] for j in self._index.needed(k, self._box)])
            for k in members
            if meets(known[k], self._box)
        ]
        return estimated(
            takes, self._stock, seed=seed, want_rel=want_rel or self._want, most=most or self._most
        )

    def surface(self) -> StockSurface:
        """See `Engine`: that of a grid of rays, for pictures; its volume is that of no interval."""
        grid = DexelEngine(self._stock, Options(chord=self.chord))
        for sweep, block in zip(self._index.sweeps, self._blocks, strict=True):
            grid.cut(sweep, block)
        return grid.surface()

    def save(self, path: Path) -> None:
        """See `Engine`."""
        stock, arrays = packed_stock(self._stock)
        state = {
            "stock": stock, "chord": self.chord, "want": self._want, "most": self._most, "blocks": self._blocks,
            "removed": list(self._removed),
        }  # fmt: skip
        Saved(self.name, state, arrays | packed_sweeps(self._index.sweeps)).write(path)

    @classmethod
    def load(cls, path: Path) -> Self:
        """See `Engine`.

        Raises EngineError: The file cannot be read or is damaged.
        """
        with opened(path, cls.name) as saved:
            state = saved.state
            stock, options = stock_of(state["stock"], saved.arrays), Options(chord=state["chord"])
            engine = cls(stock, options, want_rel=state["want"], most=state["most"])
            for sweep in sweeps_of(saved.arrays):
                engine._index.add(sweep)
            engine._blocks, engine._removed = list(state["blocks"]), Removal(*state["removed"])
        return engine
