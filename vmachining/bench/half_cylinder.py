"""Ball R5 finishing a half cylinder of radius 50 in 1 mm blocks: cost per block as the program grows."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from resource import RUSAGE_SELF, getrusage
from time import perf_counter
from typing import Any

import numpy as np
from manifold3d import Manifold

from vmachining.arrays import Floats
from vmachining.engines.mesh import MeshEngine, mesh_stock
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.solids import cutters, facets
from vmachining.engines.mesh.stock import StockMesh
from vmachining.geometry import Line
from vmachining.sweep import Sweep
from vmachining.tool import BallNose

__all__ = ["half_cylinder", "path"]

RADIUS, BALL, ALLOWANCE, CHORD = 50.0, 5.0, 1.0, 0.01
PER_PASS = 173


def path(blocks: int) -> Floats:
    """CL points (blocks + 1, 3), mm: passes along y over the half cylinder, 1 mm apart in x."""
    points = []
    for k in range(blocks // PER_PASS + 1):
        angle = np.linspace(0.0, np.pi, PER_PASS)[:: -1 if k % 2 else 1]
        reach = RADIUS + BALL
        along = np.full(PER_PASS, 0.5 + k)
        points.append(np.column_stack([along, reach * np.cos(angle), reach * np.sin(angle) - BALL]))
    return np.concatenate(points)[: blocks + 1]


def stock(length: float) -> StockMesh:
    """Half cylinder with 1 mm allowance, 240 flats, from x = 0 to `length`."""
    angle = np.linspace(0.0, np.pi, 241)
    ring = (RADIUS + ALLOWANCE) * np.column_stack([np.cos(angle), np.sin(angle)])
    n = len(ring)
    points = np.concatenate([np.column_stack([np.full(n, x), ring]) for x in (0.0, length)])
    i, j = np.arange(n), (np.arange(n) + 1) % n
    cap = np.stack([np.zeros(n - 2, int), np.arange(1, n - 1), np.arange(2, n)], axis=1)
    sides = [np.stack([i, i + n, j + n], 1), np.stack([i, j + n, j], 1)]
    return mesh_stock(points, np.concatenate([*(s[:, ::-1] for s in sides), cap[:, ::-1], cap + n]))


def half_cylinder(blocks: int = 2000) -> Iterator[dict[str, Any]]:
    """The tiled engine with its bracket, then one global solid without one, on the same blocks."""
    cutter = BallNose(diameter=2 * BALL, length=80.0).cutter
    points = path(blocks)
    blank = stock(float(points[:, 0].max()) + 1.0)
    engine = MeshEngine(blank, CHORD)
    seconds, removed = [], 0.0
    for k, (a, b) in enumerate(pairwise(points)):
        begin = perf_counter()
        removed += engine.cut(Sweep.along(cutter, Line(a, b)), block=k).estimate
        seconds.append(perf_counter() - begin)
    yield _record("mesh", seconds, removed, blocks)
    solid: Manifold = blank.solids[Side.INNER]
    tool, before = facets(cutter, CHORD, Side.FAIR), blank.solids[Side.INNER].volume()
    baseline, total = [], 0.0
    for a, b in pairwise(points):
        begin = perf_counter()
        solid = solid - cutters(Sweep.along(cutter, Line(a, b)), tool)[0]
        after = solid.volume()
        total, before = total + before - after, after
        baseline.append(perf_counter() - begin)
    yield _record("global solid, no bracket", baseline, total, blocks)
    yield {
        "case": "half_cylinder",
        "ratio_global_to_mesh": sum(baseline) / sum(seconds),
        "volume_difference_rel": abs(total - removed) / total,
    }


def _record(engine: str, seconds: list[float], removed: float, blocks: int) -> dict[str, Any]:
    part = max(1, min(1000, blocks // 2))
    return {
        "case": "half_cylinder",
        "engine": engine,
        "blocks": blocks,
        "seconds": sum(seconds),
        "ms_per_block": 1e3 * sum(seconds) / len(seconds),
        "last_to_first": sum(seconds[-part:]) / sum(seconds[:part]),
        "removed_mm3": removed,
        "peak_mb": getrusage(RUSAGE_SELF).ru_maxrss / 1024,
    }
