"""Drop cutter on a wavy part of 100,352 triangles: drops a second in raster and in random order; OpenCAMLib beside it.

Positions of the raster stand 0.25 mm apart on lines 0.5 mm apart, as a finishing path asks them. Processor time of one core,
best of three, compile time excluded. OpenCAMLib is asked some of the random positions, if it is installed.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from time import process_time
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.toolpath.facets import FacetMesh, Surface, height_field

__all__ = ["drop"]

SIDE, CELLS = 100.0, 224
CUTTERS = (("flat R5", 5.0, 0.0), ("ball R5", 5.0, 5.0), ("bull R5 r1", 5.0, 1.0), ("ball R1.5", 1.5, 1.5))
POSITIONS, THEIRS, REPEATS = 40_000, 300, 3


def drop(*, positions: int = POSITIONS, repeats: int = REPEATS) -> Iterator[dict[str, Any]]:
    """One record per cutter and order."""
    x = np.linspace(0.0, SIDE, CELLS + 1)
    mesh = height_field(x, x, 4.0 * np.outer(np.sin(x / 7.0), np.cos(x / 9.0)))
    surface = Surface(mesh)
    rng = np.random.default_rng(5)
    columns = int(SIDE / 0.25) + 1
    lines = max(positions // columns, 1)
    one = np.stack(
        np.meshgrid(20.0 + 0.5 * np.arange(lines), np.linspace(0.0, SIDE, columns), indexing="ij"), axis=-1
    )
    orders = {
        "raster": one[:, :, ::-1].reshape(-1, 2),
        "random": rng.uniform(0.0, SIDE, (lines * columns, 2)),
    }
    for name, radius, corner in CUTTERS:
        for order, points in orders.items():
            surface.drop(points[:10], radius, corner)
            seconds = np.inf
            for _ in range(repeats):
                begin = process_time()
                found = surface.drop(points, radius, corner)
                seconds = min(seconds, process_time() - begin)
            record = {
                "case": "drop", "cutter": name, "order": order, "triangles": len(mesh.triangles), "drops": len(points),
                "seconds": round(seconds, 4), "drops_per_s": round(len(points) / seconds),
            }  # fmt: skip
            if order == "random":
                record |= _opencamlib(mesh, radius, corner, points[:THEIRS], found.z[:THEIRS])
            yield record


def _opencamlib(mesh: FacetMesh, radius: float, corner: float, points: Floats, z: Floats) -> dict[str, Any]:
    """What OpenCAMLib takes for the same drops, and the largest difference; nothing if it is not installed."""
    try:
        ocl = import_module("opencamlib.ocl")
    except ImportError:
        return {}
    solid = ocl.STLSurf()
    for a, b, c in mesh.corners.tolist():
        solid.addTriangle(ocl.Triangle(ocl.Point(*a), ocl.Point(*b), ocl.Point(*c)))
    if corner == 0.0:
        cutter = ocl.CylCutter(2.0 * radius, 100.0)
    elif corner == radius:
        cutter = ocl.BallCutter(2.0 * radius, 100.0)
    else:
        cutter = ocl.BullCutter(2.0 * radius, corner, 100.0)
    batch = ocl.BatchDropCutter()
    batch.setSTL(solid)
    batch.setCutter(cutter)
    batch.setThreads(1)
    for x, y in points.tolist():
        batch.appendPoint(ocl.CLPoint(x, y, -1000.0))
    begin = process_time()
    batch.run()
    seconds = process_time() - begin
    theirs = np.array([p.z for p in batch.getCLPoints()])
    return {
        "opencamlib_drops_per_s": round(len(points) / seconds), "largest_difference_mm": float(np.abs(theirs - z).max())
    }  # fmt: skip
