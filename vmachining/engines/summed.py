"""What engines share that take every sweep and whose interval of the workpiece is the stock less the sum of all removals."""

from __future__ import annotations

from typing import Self

from vmachining.engines.protocol import Options, Removal
from vmachining.geometry import Bracket
from vmachining.stock import Stock
from vmachining.sweep import Sweep

__all__ = ["Summed", "meshed_volume"]


def meshed_volume(stock: Stock, chord: float) -> Bracket:
    """mm^3 of a raw stock between its inner and outer triangles, which lie within `chord` (mm) of its surface.

    The estimate is twice the inscribed and once the circumscribed polygon: Huygens' rule for circles.
    """
    outer, inner = (mesh.volume for mesh in stock.mesh(chord))
    return Bracket(inner, (outer + 2.0 * inner) / 3.0, outer)


class Summed:
    """Part of an `Engine`; `_removed` is the sum over all blocks."""

    stock_volume: Bracket
    _removed: Removal

    def __init__(self, stock: Stock, options: Options) -> None:
        raise NotImplementedError

    @classmethod
    def of(cls, stock: Stock, options: Options) -> Self:
        """See `Engine`."""
        return cls(stock, options)

    @classmethod
    def takes(cls, sweep: Sweep) -> bool:
        """See `Engine`: all of them."""
        return True

    @property
    def volume(self) -> Bracket:
        """mm^3; the sum of intervals of all blocks."""
        whole, gone = self.stock_volume, self._removed
        return Bracket(max(0.0, whole.lo - gone.hi), whole.estimate - gone.estimate, whole.hi - gone.lo)
