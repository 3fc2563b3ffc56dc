"""Columns: processor time of 1 mm blocks by cutter and width, of a finishing pass and of deep slots on a wave."""

from __future__ import annotations

import time
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

import vmachining as vm
from vmachining.arrays import Floats
from vmachining.engines.columns import ColumnsEngine, FlatStock
from vmachining.geometry import Line
from vmachining.sweep import Sweep

__all__ = ["columns"]

TOOLS: dict[str, vm.Tool] = {
    "ball": vm.BallNose(diameter=10.0, length=60.0),
    "bull": vm.BullNose(diameter=10.0, corner_radius=2.0, length=60.0),
    "flat": vm.FlatEnd(diameter=10.0, length=60.0),
}


def _serpentine(blocks: int, xs: Floats, step: float) -> Floats:
    rows = [
        np.column_stack([xs if k % 2 == 0 else xs[::-1], np.full(len(xs), k * step)])
        for k in range(blocks // len(xs) + 2)
    ]
    return np.concatenate(rows)[: blocks + 1]


def _finishing(blocks: int) -> tuple[Floats, FlatStock]:
    """Rows 0.5 mm apart, about 1 mm deep."""
    plan = _serpentine(blocks, np.arange(-6.0, 35.1), 0.5)
    z = -1.0 + 0.25 * np.sin(plan[:, 0] / 8.0) + 0.2 * np.cos(plan[:, 1] / 5.0)
    return np.column_stack([plan, z]), FlatStock((0.0, 0.0, -10.0), (30.0, 40.0, 0.0))


def _deep(blocks: int) -> tuple[Floats, FlatStock]:
    """Rows 4 mm apart, 6 to 29 mm deep, ramps up to 55 degrees."""
    plan = _serpentine(blocks, np.arange(0.0, 40.1, 0.7), 4.0)
    z = -17.5 + 11.5 * np.sin(plan[:, 0] / 8.0 + plan[:, 1] / 4.0)
    return np.column_stack([plan, z]), FlatStock((-8.0, -8.0, -40.0), (48.0, 90.0, 0.0))


def columns(blocks: int = 400) -> Iterator[dict[str, Any]]:
    """One row for each cutter, program and width; the first quarter of the blocks is not counted."""
    for name, tool in TOOLS.items():
        for program, make in (("finishing", _finishing), ("deep", _deep)):
            points, stock = make(blocks)
            for width in (0.03, 0.01, 0.003):
                engine = ColumnsEngine(stock, width, 1e-3)
                engine.cut(Sweep.along(tool, Line(points[0], points[0])))
                seconds, found = [], []
                for a, b in pairwise(points):
                    begin = time.process_time()
                    found.append(engine.cut(Sweep.along(tool, Line(a, b))))
                    seconds.append(time.process_time() - begin)
                wide = [r.width / r.estimate for r in found if r.width > 1e-3]
                yield {
                    "case": "columns", "tool": name, "program": program, "blocks": blocks, "width": width,
                    "ms_per_block": 1e3 * float(np.mean(seconds[blocks // 4 :])),
                    "median_width": float(np.median(wide)) if wide else 0.0,
                    "cells_per_block": engine.cells / blocks,
                    "removed_mm3": sum(r.estimate for r in found),
                }  # fmt: skip
