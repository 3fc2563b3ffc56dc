"""Ball R5 finishing a half cylinder of radius 50 in 1 mm blocks: cost per block as the program grows."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Iterator
from itertools import pairwise
from resource import RUSAGE_SELF, getrusage
from time import perf_counter
from typing import Any

import numpy as np
from manifold3d import Manifold

from vmachining.arrays import Floats
from vmachining.engines.mesh import MeshEngine
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.solids import manifold
from vmachining.engines.mesh.stock import StockMesh
from vmachining.engines.mesh.straight import facets
from vmachining.engines.protocol import Removal
from vmachining.geometry import Line
from vmachining.job.executor import Executor, Later, executor
from vmachining.stock import closed_mesh
from vmachining.sweep import Sweep
from vmachining.tool import BallNose, Profile

__all__ = ["half_cylinder", "half_cylinder_long", "path", "thin_chips"]

RADIUS, BALL, ALLOWANCE, CHORD = 50.0, 5.0, 1.0, 0.01
PER_PASS = 173

TURN = 500
"""Blocks that an engine cuts before the next one has its turn."""

GLOBAL = "one global solid, no bracket"


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
    triangles = np.concatenate([*(s[:, ::-1] for s in sides), cap[:, ::-1], cap + n])
    return StockMesh.of(closed_mesh(points, triangles))


def half_cylinder(blocks: int = 2000) -> Iterator[dict[str, Any]]:
    """The tiled engine with its bracket, in one and in all cores, and one global solid cut block by block.

    They take turns: a machine that is busy for a minute is so for all of them. The global solid grows, so two
    comparisons are made: of all blocks, and of those of the second half.
    """
    cutter = BallNose(diameter=2 * BALL, length=80.0).cutter
    points = path(blocks)
    blank = stock(float(points[:, 0].max()) + 1.0)
    racers: dict[str, _Tiled | _Global] = {}
    try:
        for workers in dict.fromkeys((os.cpu_count() or 1, 1)):
            name = f"mesh with bracket, {workers} process{'es' if workers > 1 else ''}"
            racers[name] = _Tiled(executor(MeshEngine(blank, CHORD), workers), cutter, points)
        racers[GLOBAL] = whole = _Global(blank.solids[Side.INNER], cutter)
        for first in range(0, blocks, TURN):
            for racer in racers.values():
                racer.cut(points[first : first + TURN + 1], first)
        for name, racer in racers.items():
            yield _record(name, racer)
    finally:
        for racer in racers.values():
            racer.close()
    half = blocks // 2
    for name, racer in racers.items():
        if racer is not whole:
            yield {
                "case": "half_cylinder",
                "engine": name,
                "times_faster_than_one_global_solid": sum(whole.seconds) / sum(racer.seconds),
                "times_faster_in_the_second_half": sum(whole.seconds[half:]) / sum(racer.seconds[half:]),
                "volume_difference_rel": abs(racer.removed - whole.removed) / whole.removed,
            }


def half_cylinder_long(blocks: int = 20_000) -> Iterator[dict[str, Any]]:
    """Whether time per block and memory stay flat over a long program."""
    cutter = BallNose(diameter=2 * BALL, length=80.0).cutter
    points = path(blocks)
    hands = executor(MeshEngine(stock(float(points[:, 0].max()) + 1.0), CHORD), os.cpu_count() or 1)
    racer = _Tiled(hands, cutter, points)
    try:
        racer.cut(points, 0)
        yield _record("mesh with bracket, all cores", racer)
    finally:
        racer.close()


def thin_chips(blocks: int = 600) -> Iterator[dict[str, Any]]:
    """How wide the brackets of 1 mm finishing blocks are, one by one and of their sum."""
    cutter = BallNose(diameter=2 * BALL, length=80.0).cutter
    points = path(blocks)
    for chord in (2 * CHORD, CHORD):
        engine = MeshEngine(stock(float(points[:, 0].max()) + 1.0), chord)
        widths = []
        for k, (a, b) in enumerate(pairwise(points)):
            removed = engine.cut(Sweep.along(cutter, Line(a, b)), k)
            if removed.estimate > 0.1:  # mm^3; those that merely touch are left out
                widths.append(removed.width / removed.estimate)
        left, raw = engine.volume, engine.stock_volume
        yield {
            "case": "thin_chips",
            "chord_mm": chord,
            "blocks": len(widths),
            "width_rel_median": float(np.median(widths)),
            "width_rel_of_the_sum": (left.hi - left.lo) / (raw.estimate - left.estimate),
        }


class _Tiled:
    """An executor with its bracket. seconds : of every block. removed, width : mm^3, sums of estimates and of brackets."""

    def __init__(self, hands: Executor, cutter: Profile, points: Floats) -> None:
        self.seconds: list[float] = []
        self.removed = self.width = 0.0
        self._hands, self._cutter = hands, cutter
        for k in range(0, min(PER_PASS, len(points) - 1), PER_PASS // 8):
            # workers are up and all kernels loaded, also those of blocks that continue: not in the time
            for a, b in pairwise(np.linspace(points[k], points[k + 1], 4)):
                self._add(hands.cut(cutter, Line(a, b), k)())

    def cut(self, points: Floats, first: int) -> None:
        """Blocks between points (n, 3) mm, numbered from the first."""
        waiting: deque[Later] = deque()
        last = perf_counter()
        for k, (a, b) in enumerate(pairwise(points), first):
            waiting.append(self._hands.cut(self._cutter, Line(a, b), k))
            last = self._answered(waiting, self._hands.ahead, last)
        self._answered(waiting, 0, last)

    def _answered(self, waiting: deque[Later], left: int, last: float) -> float:
        """Answers until so many are left; when that was."""
        while len(waiting) > left:
            self._add(waiting.popleft()())
            now = perf_counter()
            self.seconds.append(now - last)
            last = now
        return last

    def _add(self, found: Removal) -> None:
        self.removed += found.estimate
        self.width += found.hi - found.lo

    def peak_mb(self) -> float:
        return self._hands.peak_mb() + _peak_mb()

    def close(self) -> None:
        self._hands.close()


class _Global:
    """One solid, as one would do it at first: hulls and a boolean per block, no bracket.

    The cutter has the facets of the tiled engine (unbiased), so both see the same chord.
    """

    def __init__(self, solid: Manifold, cutter: Profile) -> None:
        self.seconds: list[float] = []
        self.removed, self.width = 0.0, None
        self._solid, self._volume = solid, float(solid.volume())
        body = facets(cutter, CHORD, Side.FAIR).parts[0].body
        self._tool = manifold(body.points, body.triangles)

    def cut(self, points: Floats, first: int) -> None:
        """See `_Tiled`."""
        for a, b in pairwise(points):
            begin = perf_counter()
            self._solid = self._solid - Manifold.batch_hull(
                [self._tool.translate(a), self._tool.translate(b)]
            )
            after = float(self._solid.volume())
            self.removed, self._volume = self.removed + self._volume - after, after
            self.seconds.append(perf_counter() - begin)

    def peak_mb(self) -> float:
        return _peak_mb()

    def close(self) -> None:
        """Nothing to close."""


def _peak_mb() -> float:
    return float(getrusage(RUSAGE_SELF).ru_maxrss) / 1024.0


def _record(engine: str, racer: _Tiled | _Global) -> dict[str, Any]:
    seconds = racer.seconds
    part = max(1, min(1000, len(seconds) // 2))
    record = {
        "case": "half_cylinder",
        "engine": engine,
        "blocks": len(seconds),
        "seconds": sum(seconds),
        "ms_per_block": 1e3 * sum(seconds) / len(seconds),
        "last_to_first": sum(seconds[-part:]) / sum(seconds[:part]),
        "removed_mm3": racer.removed,
        "peak_mb": racer.peak_mb(),
    }
    return record if racer.width is None else record | {"bracket_width_rel": racer.width / racer.removed}
