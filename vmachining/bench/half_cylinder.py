"""Ball R5 finishing a half cylinder of radius 50 in 1 mm blocks: cost per block as the program grows."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterator
from itertools import pairwise
from resource import RUSAGE_SELF, getrusage
from time import perf_counter
from typing import Any

import numpy as np
from manifold3d import Manifold

from vmachining.arrays import Floats
from vmachining.engines.mesh import Crew, MeshEngine, crew, mesh_stock
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.solids import facets, manifold
from vmachining.engines.mesh.stock import StockMesh
from vmachining.geometry import Bracket, Line
from vmachining.sweep import Sweep
from vmachining.tool import BallNose, Profile

__all__ = ["half_cylinder", "half_cylinder_long", "path", "thin_chips"]

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
    """The tiled engine with its bracket, in one and in all cores, then one global solid cut block by block.

    The global solid grows, so two comparisons are made: of all blocks, and of those of the second half.
    """
    cutter = BallNose(diameter=2 * BALL, length=80.0).cutter
    points = path(blocks)
    blank = stock(float(points[:, 0].max()) + 1.0)
    totals, times = {}, {}
    for workers in dict.fromkeys((1, os.cpu_count() or 1)):
        name = f"mesh with bracket, {workers} process{'es' if workers > 1 else ''}"
        removed, seconds, width, peak = _cut(crew(MeshEngine(blank, CHORD), workers), cutter, points)
        totals[name], times[name] = removed, seconds
        yield _record(name, seconds, removed, peak) | {"bracket_width_rel": width / removed}
    seconds, removed = _global(blank.solids[Side.INNER], cutter, points)
    yield _record("one global solid, no bracket", seconds, removed, _peak_mb())
    half = blocks // 2
    for name, own in times.items():
        yield {
            "case": "half_cylinder",
            "engine": name,
            "times_faster_than_one_global_solid": sum(seconds) / sum(own),
            "times_faster_in_the_second_half": sum(seconds[half:]) / sum(own[half:]),
            "volume_difference_rel": abs(totals[name] - removed) / removed,
        }


def half_cylinder_long(blocks: int = 20_000) -> Iterator[dict[str, Any]]:
    """Whether time per block and memory stay flat over a long program."""
    cutter = BallNose(diameter=2 * BALL, length=80.0).cutter
    points = path(blocks)
    hands = crew(MeshEngine(stock(float(points[:, 0].max()) + 1.0), CHORD), os.cpu_count() or 1)
    removed, seconds, width, peak = _cut(hands, cutter, points)
    yield _record("mesh with bracket, all cores", seconds, removed, peak) | {
        "bracket_width_rel": width / removed
    }


def thin_chips(blocks: int = 600) -> Iterator[dict[str, Any]]:
    """How wide the brackets of 1 mm finishing blocks are, one by one and of their sum, both ways to bound them."""
    cutter = BallNose(diameter=2 * BALL, length=80.0).cutter
    points = path(blocks)
    for certify in (False, True):
        engine = MeshEngine(stock(float(points[:, 0].max()) + 1.0), CHORD, certify=certify)
        widths = []
        for k, (a, b) in enumerate(pairwise(points)):
            lo, estimate, hi = engine.cut(Sweep.along(cutter, Line(a, b)), k)
            if estimate > 0.1:  # mm^3; those that merely touch are left out
                widths.append((hi - lo) / estimate)
        left, raw = engine.volume, engine.stock_volume
        yield {
            "case": "thin_chips",
            "certify": certify,
            "blocks": len(widths),
            "width_rel_median": float(np.median(widths)),
            "width_rel_of_the_sum": (left.hi - left.lo) / (raw.estimate - left.estimate),
        }


def _cut(hands: Crew, cutter: Profile, points: Floats) -> tuple[float, list[float], float, float]:
    """Removed volume, seconds of every block, sum of the bracket widths, peak MB. The crew goes home."""
    removed = width = 0.0
    for k in range(0, min(PER_PASS, len(points) - 1), PER_PASS // 8):
        # workers are up and all kernels loaded, also those of blocks that go on: not in the time
        ends = np.linspace(points[k], points[k + 1], 4)
        for a, b in pairwise(ends):
            lo, estimate, hi = hands.cut(cutter, Line(a, b), k)()
            removed, width = removed + estimate, width + hi - lo
    seconds: list[float] = []
    waiting: deque[Callable[[], Bracket]] = deque()
    last = perf_counter()

    def answered(left: int) -> None:
        nonlocal removed, width, last
        while len(waiting) > left:
            lo, estimate, hi = waiting.popleft()()
            removed, width = removed + estimate, width + hi - lo
            now = perf_counter()
            seconds.append(now - last)
            last = now

    try:
        for k, (a, b) in enumerate(pairwise(points)):
            waiting.append(hands.cut(cutter, Line(a, b), k))
            answered(hands.ahead)
        answered(0)
        return removed, seconds, width, hands.peak_mb() + _peak_mb()
    finally:
        hands.close()


def _global(solid: Manifold, cutter: Profile, points: Floats) -> tuple[list[float], float]:
    """Seconds of every block and removed volume, as one would do it at first: hulls, one solid, its volume.

    The cutter has the facets of the tiled engine (unbiased), so both see the same chord.
    """
    body = facets(cutter, CHORD, Side.FAIR).parts[0].body
    tool = manifold(body.points, body.triangles)
    seconds, before, total = [], float(solid.volume()), 0.0
    for a, b in pairwise(points):
        begin = perf_counter()
        solid = solid - Manifold.batch_hull([tool.translate(a), tool.translate(b)])
        after = float(solid.volume())
        total, before = total + before - after, after
        seconds.append(perf_counter() - begin)
    return seconds, total


def _peak_mb() -> float:
    return float(getrusage(RUSAGE_SELF).ru_maxrss) / 1024.0


def _record(engine: str, seconds: list[float], removed: float, peak_mb: float) -> dict[str, Any]:
    part = max(1, min(1000, len(seconds) // 2))
    return {
        "case": "half_cylinder",
        "engine": engine,
        "blocks": len(seconds),
        "seconds": sum(seconds),
        "ms_per_block": 1e3 * sum(seconds) / len(seconds),
        "last_to_first": sum(seconds[-part:]) / sum(seconds[:part]),
        "removed_mm3": removed,
        "peak_mb": peak_mb,
    }
