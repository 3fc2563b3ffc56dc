"""Stocks that columns know."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vmachining.engines.columns.roof import facets_of
from vmachining.errors import StockError
from vmachining.stock import BoxStock, CylinderStock, MeshStock, StepStock, Stock


class FlatStock(NamedTuple):
    """Stock with level bottom and upright walls.

    low, high : corners of its box, mm. radius : 0 for a box, else that of a round bar in the middle of it. mesh : a height
    field of facets over any outline; None: the top is level.
    """

    low: tuple[float, float, float]
    high: tuple[float, float, float]
    radius: float = 0.0
    mesh: MeshStock | None = None

    @classmethod
    def of(cls, stock: Stock) -> FlatStock:
        """That of a job.

        Raises StockError: Its bottom is not flat, there are overhangs, or its faces are curved.
        """
        low, high = (tuple(corner) for corner in stock.bounds.tolist())
        if isinstance(stock, StepStock) and len(stock.curved):
            raise StockError("columns need a stock with plane faces", remedy="take --engine mesh")
        if isinstance(stock, MeshStock):
            facets_of(stock)
            return cls(low, high, 0.0, MeshStock(stock.vertices, stock.triangles))
        if not isinstance(stock, (BoxStock, CylinderStock)):
            raise StockError("columns do not know this stock", remedy="take --engine mesh")
        return cls(low, high, stock.radius if isinstance(stock, CylinderStock) else 0.0)

    @property
    def shape(self) -> Stock:
        """The same as the stock of a job."""
        if self.mesh is not None:
            return self.mesh
        if self.radius:
            x, y = (0.5 * (a + b) for a, b in zip(self.low[:2], self.high[:2], strict=True))
            return CylinderStock((x, y), self.radius, (self.low[2], self.high[2]))
        return BoxStock(self.low, self.high)

    @property
    def volume(self) -> float:
        """mm^3."""
        if self.mesh is not None:
            return self.mesh.mesh(0.0)[0].volume
        dx, dy, dz = np.subtract(self.high, self.low).tolist()
        return float((np.pi * self.radius**2 if self.radius else dx * dy) * dz)
