"""What every engine answers: stock minus sweep, one block at a time.

`job`, `contact`, `oracle` and `feed` know an engine by this protocol and by nothing else. Adding an engine is a
room beside this file and one line in the table of `engines/__init__.py`.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple, Protocol

from vmachining.arrays import Floats, Ints
from vmachining.geometry import Bracket
from vmachining.sweep import Sweep

__all__ = ["NOTHING", "Engine", "Removal", "StockSurface"]


class Removal(NamedTuple):
    """Removed volume of one block, mm^3.

    proven : True: `lo` and `hi` are bounds. False: an interval of stated confidence, which is never called a
        bracket; the room of the engine says which confidence.
    """

    lo: float
    estimate: float
    hi: float
    proven: bool = True

    def plus(self, other: Removal) -> Removal:
        """Removal of two blocks together; proven where both are."""
        return Removal(
            self.lo + other.lo,
            self.estimate + other.estimate,
            self.hi + other.hi,
            self.proven and other.proven,
        )


NOTHING = Removal(0.0, 0.0, 0.0)


class StockSurface(NamedTuple):
    """Triangles of a workpiece that know who cut them.

    vertices : (n, 3) mm. triangles : (m, 3) indices, outward. block : (m,) number of the block that cut the
    triangle, -1 of the raw stock.
    """

    vertices: Floats
    triangles: Ints
    block: Ints


class Engine(Protocol):
    """Workpiece of one job, cut block by block.

    name : as in the column `engine` and behind `--engine`.
    stock_volume, volume : of the raw and of the present workpiece, mm^3.
    """

    name: str
    stock_volume: Bracket

    def cut(self, sweep: Sweep, block: int | None = None) -> Removal:
        """Take the sweep out of the workpiece; exactly 0 in air.

        Raises
        ------
        EngineError
            The kernel failed, or the engine does not take this sweep; names the block. The workpiece is as before.
        """
        ...

    def touch(self, sweep: Sweep) -> Removal:
        """What the sweep would take; the workpiece stays as it is."""
        ...

    @property
    def volume(self) -> Bracket: ...

    def surface(self) -> StockSurface:
        """The workpiece as triangles, for STL, 3MF and pictures."""
        ...

    def save(self, path: Path) -> None:
        """Write what is needed to go on with the next block; the class method `load` reads it."""
        ...
