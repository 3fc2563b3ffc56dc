"""Analytic engagement against a compiled Z-map on the same part: time and error of the cut length, in one run.

The part is a staircase of ten steps in x as a rough pass leaves it, 60 x 40 mm, walls off the grids. A flat and a bull nose
cutter finish it with lead and tilt; 400 positions and 360 rotation angles. Both give the engaged intervals, know the facing
condition and look at nothing above the stock. The Z-map reads cells and elements of its pitch. What it costs to keep it, which
is to lower every cell under the tool at every position before the next pass can be asked about, is timed beside it
(`kept_times`); the analytic method asks the staircase and keeps nothing.
Vertical vectors, one a cell, are met by the analytic method as a staircase of as many steps.
Processor time of one core, best of three, compile time excluded. The literature states that its analytic method is 25 times
faster than its Z-map, and does not say at which resolution.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from time import process_time
from typing import Any

import numpy as np

from benchmarks import _kernels
from vmachining.arrays import Floats
from vmachining.engagement import chip
from vmachining.engagement.analytic import Corner, HeightStock, Records, engaged
from vmachining.errors import EngineError

__all__ = ["zmap"]

PITCHES = (0.2, 0.1, 0.05, 0.02)
POSITIONS, ANGLES = 400, 360
STEPS = ((1.0, 1.2), (1.0, 4.0), (3.0, 12.0))
"""mm, lowest and highest step: what is left for finishing, and by shallow and deep roughing."""

PUBLISHED = 25.0
ROOM = 6
"""Intervals per edge; the analytic method finds its own."""

REPEATS = 3


def zmap(*, positions: int = POSITIONS, repeats: int = REPEATS) -> Iterator[dict[str, Any]]:
    """One record per staircase, cutter and method."""
    rng = np.random.default_rng(31)
    breaks = np.concatenate([[0.0], np.sort(rng.uniform(1.0, 59.0, 9)), [60.0]])
    share = rng.uniform(0.0, 1.0, 10)
    path = Records(
        np.array([[2.0, 18.0, 0.2], [58.0, 22.0, 0.9]]), np.radians([3.0, 1.0]), np.radians([8.0, 12.0])
    )
    poses = path.at(np.linspace(0.0, 1.0, positions), feed_mm_min=600.0)
    phi = 2.0 * np.pi * (np.arange(ANGLES) + 0.5) / ANGLES
    for low, high in STEPS:
        stock = HeightStock.staircase(breaks, low + (high - low) * share, y=(0.0, 40.0), floor=-20.0)
        for name, corner in (("flat D20", Corner(10.0, 0.0, 40.0)), ("bull D20 r5", Corner(5.0, 5.0, 35.0))):
            record = {"case": "zmap", "tool": name, "steps_mm": [low, high]}
            for row in _compared(corner, stock, poses.tip, poses.frame, poses.velocity, phi, repeats):
                yield record | row


def _compared(
    corner: Corner,
    stock: HeightStock,
    tip: Floats,
    frame: Floats,
    velocity: Floats,
    phi: Floats,
    repeats: int,
) -> Iterator[dict[str, Any]]:
    seconds, found = _timed(lambda: engaged(corner, stock, tip, frame, phi, velocity, bottom=False), repeats)
    exact = found.cut_length
    rows, turns = exact.size, (np.sin(phi), np.cos(phi))
    yield {
        "method": "analytic", "pitch_mm": None, "ms_per_position": 1e3 * seconds / len(tip),
        "million_per_s": rows / seconds / 1e6, "rms_mm": 0.0, "worst_mm": 0.0, "times": 1.0, "published_times": PUBLISHED,
    }  # fmt: skip
    for pitch in PITCHES:
        heights, x0, y0 = _grid(stock, pitch)
        about = x0, y0, pitch, heights, float(heights.max())

        def ask(about: Any = about) -> tuple[Floats, Floats]:
            lower, upper = np.empty((2, rows, ROOM))
            many = np.zeros(rows, dtype=np.int64)
            sizes = corner.rm, corner.r, corner.flute
            given: tuple[Any, ...] = (tip, frame, velocity, *turns, *sizes, *about, lower, upper, many)
            _kernels.zmap_intervals(*given)
            if many.max() > ROOM:
                raise EngineError(f"{many.max()} intervals on one edge", engine="zmap")
            return lower, upper

        cost, ends = _timed(ask, repeats)
        lengths = chip.cut_length(*ends).reshape(exact.shape)
        yield _row(
            "vectors",
            pitch,
            *_vectors(corner, heights, x0, y0, pitch, tip, frame, velocity, phi, repeats),
            exact,
            seconds,
        )
        yield _row("zmap", pitch, cost, lengths, exact, seconds) | {
            "kept_times": (cost + _lowering(corner, tip, frame, x0, y0, pitch, heights)) / seconds
        }


def _row(
    method: str, pitch: float, cost: float, lengths: Floats, exact: Floats, seconds: float
) -> dict[str, Any]:
    error = lengths - exact
    return {
        "method": method, "pitch_mm": pitch, "ms_per_position": 1e3 * cost / len(exact),
        "million_per_s": exact.size / cost / 1e6, "rms_mm": float(np.sqrt((error**2).mean())),
        "worst_mm": float(np.abs(error).max()), "times": cost / seconds, "published_times": PUBLISHED,
    }  # fmt: skip


def _vectors(
    corner: Corner,
    heights: Floats,
    x0: float,
    y0: float,
    pitch: float,
    tip: Floats,
    frame: Floats,
    velocity: Floats,
    phi: Floats,
    repeats: int,
) -> tuple[float, Floats]:
    """The analytic method on vertical vectors, each a cell of its pitch: seconds and cut lengths."""
    x, y = (low + pitch * np.arange(n + 1.0) for low, n in zip((x0, y0), heights.shape, strict=True))
    stock = HeightStock(x, y, heights, floor=-20.0)
    cost, found = _timed(lambda: engaged(corner, stock, tip, frame, phi, velocity, bottom=False), repeats)
    return cost, found.cut_length


def _lowering(
    corner: Corner, tip: Floats, frame: Floats, x0: float, y0: float, pitch: float, heights: Floats
) -> float:
    """s to lower a Z-map along a path, once: the second time there is nothing left to lower."""
    _kernels.zmap_lowered(tip[:1], frame[:1], corner.rm, corner.r, x0, y0, pitch, heights.copy())
    left = heights.copy()
    begin = process_time()
    _kernels.zmap_lowered(tip, frame, corner.rm, corner.r, x0, y0, pitch, left)
    return process_time() - begin


def _grid(stock: HeightStock, pitch: float) -> tuple[Floats, float, float]:
    """Heights at the middles of square cells over the stock, and where they begin."""
    x, y = (np.arange(b[0] + 0.5 * pitch, b[-1], pitch) for b in (stock.x, stock.y))
    i, j = (np.searchsorted(b, v, side="right") - 1 for b, v in ((stock.x, x), (stock.y, y)))
    return np.ascontiguousarray(stock.top[np.ix_(i, j)]), float(stock.x[0]), float(stock.y[0])


def _timed(f: Callable[[], Any], repeats: int) -> tuple[float, Any]:
    """Best processor time of a few runs after one that compiles."""
    result = f()
    best = np.inf
    for _ in range(repeats):
        begin = process_time()
        result = f()
        best = min(best, process_time() - begin)
    return float(best), result
