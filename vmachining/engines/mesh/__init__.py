"""Mesh engine."""

from vmachining.engines.mesh.engine import MeshEngine
from vmachining.engines.mesh.solids import solid
from vmachining.engines.mesh.stock import (
    StockMesh,
    StockSurface,
    box_stock,
    cylinder_stock,
    mesh_stock,
    stl_stock,
)

__all__ = [
    "MeshEngine",
    "StockMesh",
    "StockSurface",
    "box_stock",
    "cylinder_stock",
    "mesh_stock",
    "solid",
    "stl_stock",
]
