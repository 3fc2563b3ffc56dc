"""One manifold3d solid that is cut block by block: no bracket, and every block costs what the solid has become."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from time import process_time

import numpy as np
from manifold3d import Manifold

import vmachining as vm
from vmachining.arrays import Floats
from vmachining.engines.columns import FlatStock
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.solids import manifold
from vmachining.engines.mesh.straight import facets
from vmachining.geometry import Line
from vmachining.sweep import Sweep
from vmachining.tolerance import CHORD_MM

__all__ = ["solid_blocks"]


def solid_blocks(tool: vm.Tool, stock: FlatStock, points: Floats) -> Iterator[tuple[float, float]]:
    """Removed volume, mm³, and seconds of processor of each block between two points: the hull of two poses is taken away."""
    body = facets(Sweep.along(tool, Line(points[0], points[1])).profile, CHORD_MM, Side.FAIR).parts[0].body
    cutter = manifold(body.points, body.triangles)
    low, high = np.array(stock.low), np.array(stock.high)
    solid = Manifold.cube((high - low).tolist()).translate(low.tolist())
    volume = float(solid.volume())
    for a, b in pairwise(points):
        begin = process_time()
        solid = solid - Manifold.batch_hull([cutter.translate(a), cutter.translate(b)])
        after = float(solid.volume())
        yield volume - after, process_time() - begin
        volume = after
