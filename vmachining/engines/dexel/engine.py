"""`DexelEngine`: what every engine answers, by rays."""

from __future__ import annotations

import io
import pickle
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vmachining.engines.dexel.estimate import MOST, Take, estimated
from vmachining.engines.dexel.rays import RawSolid
from vmachining.engines.protocol import NOTHING, Removal, StockSurface
from vmachining.errors import EngineError
from vmachining.geometry import Bracket
from vmachining.sweep import Sweep
from vmachining.sweep.near import SweepIndex
from vmachining.sweep.reach import meets, reaching

__all__ = ["DexelEngine"]

PICKLED = ("vmachining.", "numpy")
"""Modules whose classes a checkpoint may hold."""


class DexelEngine:
    """Workpiece of one job: raw stock and the sweeps that left it.

    Parameters
    ----------
    stock : RawSolid
    volume : Bracket
        Of the raw stock, mm^3.
    want_rel : half width of intervals asked for, relative to the volume; at most `most` rays of a set are spent on it.
    """

    name = "dexel"

    def __init__(self, stock: RawSolid, volume: Bracket, *, want_rel: float = 0.01, most: int = MOST) -> None:
        self._stock, self._want, self._most = stock, want_rel, most
        self._box = np.array(stock.bounds)
        self._index = SweepIndex((), pitch=float(np.ptp(self._box, axis=0).max()) / 64.0, clip=self._box)
        self._removed = NOTHING
        self.stock_volume = volume

    def cut(self, sweep: Sweep, block: int | None = None) -> Removal:
        """See `Engine`."""
        number = self.add(sweep)
        found = self.removed([number], seed=number if block is None else block)
        self._removed = self._removed.plus(found)
        return found

    def touch(self, sweep: Sweep, within: float | None = None) -> Removal:
        """See `Engine`."""
        short = reaching(sweep, self._box)
        if not meets(short, self._box):
            return NOTHING
        earlier = self._index.needed_by(short, len(self._index.sweeps), self._box)
        take = Take(short, [self._index.sweeps[j] for j in earlier])
        return estimated([take], self._stock, want_rel=self._want, most=self._most)

    def add(self, sweep: Sweep) -> int:
        """Take a sweep out without asking how much that is; its number."""
        return self._index.add(reaching(sweep, self._box))

    def removed(
        self, members: Sequence[int], *, seed: int, want_rel: float | None = None, most: int | None = None
    ) -> Removal:
        """What some sweeps, by number, took together, each after all before it. Answers may be asked for in any order."""
        takes = []
        for k in members:
            sweep = self._index.sweeps[k]
            if meets(sweep, self._box):
                takes.append(Take(sweep, [self._index.sweeps[j] for j in self._index.needed(k, self._box)]))
        return estimated(
            takes, self._stock, seed=seed, want_rel=want_rel or self._want, most=most or self._most
        )

    @property
    def volume(self) -> Bracket:
        """mm^3; an interval of stated confidence."""
        whole, gone = self.stock_volume, self._removed
        return Bracket(max(0.0, whole.lo - gone.hi), whole.estimate - gone.estimate, whole.hi - gone.lo)

    def surface(self) -> StockSurface:
        """There is none.

        Raises
        ------
        EngineError
            Always.
        """
        raise EngineError("rays know volumes and no surface; take the mesh engine for that", engine=self.name)

    def save(self, path: Path) -> None:
        """See `Engine`."""
        state = (self._stock, self.stock_volume, self._want, self._most, self._index.sweeps, self._removed)
        path.write_bytes(pickle.dumps(state))

    @classmethod
    def load(cls, path: Path) -> DexelEngine:
        """The engine that `save` wrote.

        Raises
        ------
        EngineError
            The file cannot be read, is damaged, or holds anything but geometry.
        """
        try:
            stock, volume, want, most, sweeps, removed = _Geometry(io.BytesIO(path.read_bytes())).load()
            engine = cls(stock, volume, want_rel=want, most=most)
            for sweep in sweeps:
                engine._index.add(sweep)
            engine._removed = removed
        except EngineError:
            raise
        except Exception as exc:  # bytes that are no checkpoint can raise anything
            raise EngineError(f"cannot read the checkpoint {path} ({exc})", engine=cls.name) from exc
        return engine


class _Geometry(pickle.Unpickler):
    """Reads pickles of our own classes and arrays, and nothing that could run."""

    def find_class(self, module: str, name: str) -> Any:
        if not module.startswith(PICKLED) or (module.startswith("numpy") and name not in SAFE):
            raise EngineError(f"the checkpoint holds {module}.{name}", engine="dexel")
        return super().find_class(module, name)


SAFE = ("_reconstruct", "ndarray", "dtype", "scalar", "_frombuffer")
"""Names of numpy in pickles of arrays."""
