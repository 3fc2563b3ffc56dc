"""What engines share that take every sweep and whose interval of the workpiece is the stock less the sum of all removals."""

from __future__ import annotations

from typing import Self

import numpy as np

from vmachining.engines.protocol import Options, Removal
from vmachining.interval import Interval
from vmachining.stock import Stock
from vmachining.sweep import Sweep


def meshed_volume(stock: Stock, chord: float) -> Interval:
    """mm^3 of a raw stock between its inner and outer triangles, which lie within `chord` (mm) of its surface.

    The estimate is twice the inscribed and once the circumscribed polygon: Huygens' rule for circles. Stated where the
    triangles represent curved faces of a STEP file: they lie on both sides of these.
    """
    outer, inner = (mesh.volume for mesh in stock.mesh(chord))
    proven = stock.slack_near(np.array(stock.bounds)) == 0.0
    return Interval(inner, (outer + 2.0 * inner) / 3.0, outer, proven)


class Summed:
    """Part of an `Engine`; `_removed` is the sum over all blocks."""

    stock_volume: Interval
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
    def volume(self) -> Interval:
        """mm^3; the sum of intervals of all blocks."""
        return (self.stock_volume - self._removed.bracket).at_least(0.0)
