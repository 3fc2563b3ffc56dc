"""Mesh engine."""

from vmachining.engines.mesh.crew import Crew, MeshCrew, Solo, crew
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
    "Crew",
    "MeshCrew",
    "MeshEngine",
    "Solo",
    "StockMesh",
    "StockSurface",
    "box_stock",
    "crew",
    "cylinder_stock",
    "mesh_stock",
    "solid",
    "stl_stock",
]
