"""Dexel grids: blocks a second, error against closed forms, width of the stated intervals; three and five axes.

Processor time, kernels compiled before; wall time beside it, which two threads may halve on a quiet machine. Bandwidth: bytes
that the kernel reads and writes of the map of heights, over those that a copy of 256 MB moves in the same second.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from math import pi
from time import perf_counter, process_time
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.dexel import DexelEngine
from vmachining.engines.protocol import Options, Removal
from vmachining.geometry import Line
from vmachining.stock import BoxStock
from vmachining.sweep import Pose, Sweep
from vmachining.tool import BallNose, BullNose, Cutter, FlatEnd

__all__ = ["dexel_grid", "dexel_grid_long", "dexel_rate"]

R, SIDE = 5.0, 100.0
BYTES = 32
"""Of a ray and block: ends of the interval and block read, end and block written."""

PEERS = {"camotics_s": 6.0, "freecad_s": 0.47, "freecad_error": -5.1e-3}
"""Public simulators on 2,043 blocks, at 0.5 mm and at 0.1 mm."""


def dexel_grid() -> Iterator[dict[str, Any]]:
    """One record per workload."""
    _passes(BallNose(diameter=2 * R, length=60), 1.6, 0.5, blocks=50, directions=3)  # compiled, apart
    copied = _copy_bytes_a_second()
    ball = BallNose(diameter=2 * R, length=60)
    yield _passes(ball, 1.6, 0.1, blocks=2043, copied=copied) | PEERS
    yield _passes(ball, 1.0, 0.1, blocks=4000, copied=copied)
    yield _passes(FlatEnd(diameter=2 * R, length=60), 1.0, 0.1, blocks=4000, copied=copied)
    yield _passes(ball, 1.0, 0.5, blocks=2000, directions=3)
    yield from _turning_blocks()
    yield _random_turns()


def dexel_grid_long(blocks: int = 500_000) -> Iterator[dict[str, Any]]:
    """500,000 blocks over 100 x 60 x 20 mm at 0.5 mm, level and on ramps: whether time a block stays flat."""
    _passes(BallNose(diameter=2 * R, length=60), 1.6, 0.5, blocks=50, directions=3)
    for slope, directions in ((0.0, 1), (0.2, 1), (0.0, 3), (0.2, 3)):
        engine = DexelEngine(BoxStock((0, 0, -20), (100, 60, 0)), Options(spacing=0.5, directions=directions))
        tips = _zigzag(blocks, 100.0, 60.0, 0.25, -1.0, slope, layers=20)
        seconds = []
        begin, wall = process_time(), perf_counter()
        for first in range(0, blocks, 50_000):
            start = process_time()
            engine.cut_path(BallNose(diameter=2 * R, length=60), tips[first : first + 50_001], first)
            seconds.append(process_time() - start)
        yield {
            "case": "dexel-grid-long", "slope": slope, "directions": directions, "blocks": blocks, "spacing_mm": 0.5,
            "seconds": process_time() - begin, "wall_s": perf_counter() - wall,
            "first_tenth_s": seconds[0], "last_tenth_s": seconds[-1], "peer_s": 43.0 if slope == 0.0 else 103.0,
        }  # fmt: skip


def dexel_rate(blocks: int = 10_000, spacing: float = 0.8, first: int = 0) -> Iterator[dict[str, Any]]:
    """How often intervals hold their closed forms: slots at any angle beside earlier ones, balls, plunges, deeper slots."""
    stock = BoxStock((-30, -30, -12), (30, 30, 0))
    for directions in (1, 3):
        misses, off, wide = 0, [], []
        begin = process_time()
        for seed in range(first, first + blocks):
            engine = DexelEngine(stock, Options(spacing=spacing, directions=directions))
            found, truth = _random_block(engine, np.random.default_rng(seed))
            misses += not found.lo <= truth <= found.hi
            off.append(abs(found.estimate / truth - 1.0))
            wide.append(0.5 * (found.hi - found.lo) / truth)
        yield {
            "case": "dexel-rate", "directions": directions, "spacing_mm": spacing, "blocks": blocks, "misses": misses,
            "median_off": float(np.median(off)), "median_half": float(np.median(wide)), "seconds": process_time() - begin,
        }  # fmt: skip


def _passes(
    tool: Cutter,
    step: float,
    spacing: float,
    *,
    blocks: int,
    directions: int = 1,
    copied: float | None = None,
) -> dict[str, Any]:
    """Passes 3.57 mm apart across the part, their links outside of it: each mm of a pass removes the same."""
    engine = DexelEngine(
        BoxStock((0, 0, -10), (SIDE, SIDE, 0)), Options(spacing=spacing, directions=directions)
    )
    per = int(np.ceil((SIDE + 2 * R + 2.0) / step))
    count = max(1, round(blocks / (per + 1)))
    pitch = SIDE / 28.0
    x = np.linspace(-R - 1.0, SIDE + R + 1.0, per + 1)
    tips = np.concatenate([
        np.column_stack([x if k % 2 else x[::-1], np.full(per + 1, k * pitch), np.full(per + 1, -2.0)]) for k in range(count)
    ])  # fmt: skip
    begin, wall = process_time(), perf_counter()
    found = engine.cut_path(tool, tips)
    seconds, wall = process_time() - begin, perf_counter() - wall
    y = np.linspace(0.0, SIDE, 2_000_001)
    away = np.min([np.abs(y - k * pitch) for k in range(count)], axis=0)
    over = np.clip(R * R - away * away, 0.0, None)
    depth = 2.0 - (R - np.sqrt(over)) if isinstance(tool, BallNose) else np.where(away < R, 2.0, 0.0)
    truth = SIDE * float(np.trapezoid(np.where(away < R, np.clip(depth, 0.0, None), 0.0), y))
    total = sum(each.estimate for each in found)
    real = [each for each in found if each.estimate > 0.1]
    rays = len(found) * (2 * R + step + 2 * spacing) * (2 * R + 2 * spacing) / spacing**2
    record = {
        "case": "dexel-grid", "tool": type(tool).__name__, "step_mm": step, "spacing_mm": spacing, "directions": directions,
        "blocks": len(found), "seconds": seconds, "wall_s": wall, "blocks_a_second": len(found) / seconds,
        "error": total / truth - 1.0, "median_half": float(np.median([0.5 * (e.hi - e.lo) / e.estimate for e in real])),
        "ns_a_ray": 1e9 * seconds / rays,
    }  # fmt: skip
    if copied is not None:
        record["bandwidth_share"] = BYTES * rays / seconds / copied
    return record


def _turning_blocks(blocks: int = 30) -> Iterator[dict[str, Any]]:
    """1 mm and 0.6 degrees each: a bull nose D12 that leans by 17 to 35 degrees, 3 mm deep in a plate."""
    tool = BullNose(diameter=12, corner_radius=2, length=40)
    for spacing in (0.2, 0.1):
        for directions in (1, 3):
            engine = DexelEngine(
                BoxStock((0, 0, 0), (60, 40, 18)), Options(spacing=spacing, directions=directions)
            )
            lean = np.radians(17.0 + 0.6 * np.arange(blocks + 2))
            poses = [
                Pose((4.0 + k, 20.0, 15.0), (np.sin(a), 0.0, np.cos(a))) for k, a in enumerate(lean.tolist())
            ]
            sweeps = [Sweep(tool, a, b) for a, b in itertools.pairwise(poses)]
            engine.cut(sweeps[0])
            begin = process_time()
            found = [engine.cut(sweep, k) for k, sweep in enumerate(sweeps[1:])]
            yield {
                "case": "dexel-grid", "tool": "BullNose", "axes": 5, "step_mm": 1.0, "spacing_mm": spacing,
                "directions": directions, "blocks": blocks, "ms_a_block": 1e3 * (process_time() - begin) / blocks,
                "median_half": float(np.median([0.5 * (e.hi - e.lo) / e.estimate for e in found])),
            }  # fmt: skip


def _random_turns(blocks: int = 60, spacing: float = 1.0) -> dict[str, Any]:
    """Blocks of 5 to 40 mm between random axes, inside of the stock, against the flux of their sweeps."""
    rng = np.random.default_rng(1)
    times, off, wide, misses = [], [], [], 0
    for k in range(blocks):
        d = float(rng.uniform(4.0, 16.0))
        tool = (
            BallNose(diameter=d, length=30), FlatEnd(diameter=d, length=30),
            BullNose(diameter=d, corner_radius=d / 4, length=30),
        )[k % 3]  # fmt: skip
        way = rng.normal(size=3) * [1.0, 1.0, 0.3]
        way *= rng.uniform(5.0, 40.0) / np.linalg.norm(way)
        axes = [np.array([*rng.uniform(-0.4, 0.4, 2), 1.0]) for _ in range(2)]
        at = rng.uniform(-5.0, 5.0, 3)
        first, last = (Pose(p, v / np.linalg.norm(v)) for p, v in ((at, axes[0]), (at + way, axes[1])))
        sweep = Sweep(tool, first, last)
        truth = sweep.volume
        if truth is None:  # the flux is not sure to 1e-4
            continue
        engine = DexelEngine(BoxStock((-70, -70, -40), (70, 70, 70)), Options(spacing=spacing))
        begin = process_time()
        found = engine.cut(sweep, 0)
        times.append(process_time() - begin)
        misses += not found.lo <= truth <= found.hi
        off.append(found.estimate / truth - 1.0)
        wide.append(0.5 * (found.hi - found.lo) / truth)
    return {
        "case": "dexel-grid", "axes": 5, "random": True, "spacing_mm": spacing, "directions": 3, "blocks": len(times),
        "misses": misses, "ms_a_block": 1e3 * float(np.median(times)), "ms_most": 1e3 * max(times),
        "rms_off": float(np.sqrt(np.mean(np.square(off)))), "median_half": float(np.median(wide)),
    }  # fmt: skip


def _zigzag(n: int, long: float, wide: float, step: float, z: float, slope: float, layers: int) -> Floats:
    """(n + 1, 3) passes along x over the whole part, layer after layer, up and down by a slope."""
    per = int(long / step)
    rows = -(-(n + 1) // (per + 1) // layers)
    out = []
    for k in range(-(-(n + 1) // (per + 1))):
        x = np.linspace(0.0, long, per + 1)[:: 1 if k % 2 else -1]
        y = np.full(per + 1, wide * (k % rows) / max(rows - 1, 1))
        deep = z * (1 + k // rows)
        out.append(np.column_stack([x, y, deep + slope * np.abs((x % 20.0) - 10.0)]))
    return np.concatenate(out)[: n + 1]


def _random_block(engine: DexelEngine, rng: np.random.Generator) -> tuple[Removal, float]:
    """A block with a closed form, after those before it."""
    r, depth, length = rng.uniform(1.0, 6.0), rng.uniform(0.05, 8.0), rng.uniform(0.5, 20.0)
    angle = rng.uniform(0.0, 2.0 * pi)
    way, left = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([-np.sin(angle), np.cos(angle), 0.0])
    start = np.array([*rng.uniform(-4.0, 4.0, 2), -depth]) - 0.5 * length * way
    kind = int(rng.integers(4))
    flat, ball = FlatEnd(diameter=2 * r, length=30), BallNose(diameter=2 * r, length=30)
    if kind == 0:  # beside a slot
        wide = r * 10.0 ** rng.uniform(-1.5, 0.2)
        engine.cut(Sweep(flat, start, start + length * way))
        found = engine.cut(Sweep(flat, start + wide * left, start + length * way + wide * left))
        lens = 2.0 * r * r * np.arccos(wide / (2.0 * r)) - wide / 2.0 * np.sqrt(4.0 * r * r - wide * wide)
        return found, float(depth * (wide * length + pi * r * r - lens))
    if kind == 1:  # a layer below a slot
        layer = 10.0 ** rng.uniform(-3.0, 0.0)
        engine.cut(Sweep(flat, start, start + length * way))
        down = np.array([0.0, 0.0, layer])
        return engine.cut(Sweep(flat, start - down, start + length * way - down)), float(
            layer * (2 * r * length + pi * r * r)
        )
    depth = min(depth, 0.95 * r)
    start[2] = -depth
    cap = pi * depth**2 * (3.0 * r - depth) / 3.0
    if kind == 2:  # a plunge
        return engine.cut(Sweep.along(ball, Line(start + [0.0, 0.0, 9.0], start))), float(cap)
    area = r * r * np.arccos(1.0 - depth / r) - (r - depth) * np.sqrt(2.0 * r * depth - depth**2)
    return engine.cut(Sweep(ball, start, start + length * way)), float(area * length + cap)


def _copy_bytes_a_second() -> float:
    source = np.ones(2**24)
    target = np.empty_like(source)
    best = np.inf
    for _ in range(5):
        begin = process_time()
        np.copyto(target, source)
        best = min(best, process_time() - begin)
    return 2.0 * source.nbytes / best
