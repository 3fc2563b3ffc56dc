"""Stock solids, as the two meshes that a bracket needs.

A box or a mesh file is its own inner and outer solid. A cylinder is not: its facets are placed inside and
outside, so that the bracket holds for the round stock too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from manifold3d import Manifold
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.solids import manifold
from vmachining.errors import StockError
from vmachining.stock import BoxStock, CylinderStock, Stock, Triangles, closed_mesh
from vmachining.tolerance import CHORD_MM


@dataclass(frozen=True, slots=True, eq=False)
class StockMesh:
    """Raw stock. solids: the largest mesh under `Side.INNER` (it will be cut by inner sweeps), the smallest
    under `Side.OUTER`."""

    solids: dict[Side, Manifold]

    @property
    def bounds(self) -> Floats:
        """(2, 3) mm."""
        return np.array(self.solids[Side.INNER].bounding_box()).reshape(2, 3)

    @classmethod
    def of(cls, stock: Stock, chord: float = CHORD_MM) -> StockMesh:
        """The two meshes of a stock; one where it is one."""
        around, inside = stock.mesh(chord)
        largest = _solid(around)
        smallest = largest if inside is around else _solid(inside)
        return cls({Side.INNER: largest, Side.OUTER: smallest})


def _solid(mesh: Triangles) -> Manifold:
    return manifold(
        np.array(mesh.vertices), mesh.triangles
    ).as_original()  # a copy: it takes no read-only arrays


def box_stock(lo: ArrayLike, hi: ArrayLike) -> StockMesh:
    """Axis-parallel box, mm.

    Raises StockError: A side is zero, negative or not finite.
    """
    try:
        return StockMesh.of(BoxStock(lo, hi))
    except ValueError as error:
        raise StockError(str(error)) from error


def cylinder_stock(
    center: Sequence[float], radius: float, z: Sequence[float], *, chord: float = CHORD_MM
) -> StockMesh:
    """Upright cylinder about `center` (x, y) from z[0] to z[1], mm.

    Raises StockError: Not a positive size, or not finite.
    """
    x, y = center
    low, high = z
    return StockMesh.of(CylinderStock((x, y), radius, (low, high)), chord)


def mesh_stock(vertices: ArrayLike, triangles: ArrayLike, *, source: str = "stock") -> StockMesh:
    """Closed triangle mesh, taken as the exact stock, see `vmachining.stock.closed_mesh`."""
    return StockMesh.of(closed_mesh(vertices, triangles, source=source))
