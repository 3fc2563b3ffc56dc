"""Stock solids, as the two meshes that a bracket needs.

A box or a mesh file is its own inner and outer solid. A cylinder is not: its facets are placed inside and
outside, so that the bracket holds for the round stock too.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from manifold3d import Manifold
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.solids import manifold
from vmachining.engines.protocol import StockSurface
from vmachining.errors import StockError
from vmachining.stock import BoxStock, Stock, Triangles
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
    return manifold(np.array(mesh.vertices), mesh.triangles).as_original()  # it takes no read-only arrays


def box_stock(lo: ArrayLike, hi: ArrayLike) -> StockMesh:
    """Axis-parallel box, mm.

    Raises StockError: A side is zero, negative or not finite.
    """
    try:
        return StockMesh.of(BoxStock(lo, hi))
    except ValueError as error:
        raise StockError(str(error)) from error


def surface_of(solid: Manifold, blocks: Mapping[int, int]) -> StockSurface:
    """Triangles of a workpiece with the block that cut each, by run id; -1: raw stock."""
    mesh = solid.to_mesh64()
    ends = np.array(mesh.run_index, dtype=np.uint64).astype(np.int64) // 3
    owner = [blocks.get(int(run), -1) for run in mesh.run_original_id]
    # a vertex stands once for every run that meets there: one each for the file formats
    to = np.arange(len(mesh.vert_properties))
    to[np.array(mesh.merge_from_vert, dtype=np.int64)] = np.array(mesh.merge_to_vert, dtype=np.int64)
    kept, triangles = np.unique(to[np.array(mesh.tri_verts, dtype=np.int64)], return_inverse=True)
    return StockSurface(
        np.array(mesh.vert_properties)[kept, :3],
        triangles.reshape(-1, 3).astype(np.int64),
        np.repeat(np.array(owner, dtype=np.int64), ends[1:] - ends[:-1]),
    )
