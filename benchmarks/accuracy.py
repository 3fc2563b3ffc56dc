"""How bracket and estimate shrink with the chord, where a closed form knows the answer."""

from __future__ import annotations

from collections.abc import Iterator
from time import perf_counter
from typing import Any

import numpy as np

from vmachining.engines.mesh import MeshEngine, box_stock
from vmachining.geometry import Line
from vmachining.sweep import Sweep
from vmachining.tool import BallNose, BullNose, FlatEnd

__all__ = ["accuracy", "ball_slot", "bull_slot"]


def ball_slot(radius: float, depth: float, length: float) -> float:
    """mm^3 of a through slot: circular segment (or half disc and walls) times length."""
    if depth >= radius:
        return (np.pi * radius**2 / 2 + 2 * radius * (depth - radius)) * length
    side = np.sqrt(depth * (2 * radius - depth))
    return float((radius**2 * np.arccos(1 - depth / radius) - (radius - depth) * side) * length)


def bull_slot(radius: float, corner: float, depth: float, length: float) -> float:
    """mm^3 of a through slot deeper than the corner."""
    return (2 * radius * depth - (2 - np.pi / 2) * corner**2) * length


def accuracy() -> Iterator[dict[str, Any]]:
    """Through slots in a block, depth 1 mm (ball), 3 mm (bull) and 2 mm (flat), 10 mm cutters."""
    cases = [
        ("flat", FlatEnd(diameter=10, length=40), 2.0, 10.0 * 2 * 30),
        ("ball", BallNose(diameter=10, length=40), 1.0, ball_slot(5, 1, 30)),
        ("bull", BullNose(diameter=10, corner_radius=2, length=40), 3.0, bull_slot(5, 2, 3, 30)),
    ]
    for name, tool, depth, truth in cases:
        for chord in (0.08, 0.04, 0.02, 0.01, 0.005):
            engine = MeshEngine(box_stock((0, -20, -10), (30, 20, 0)), chord)
            begin = perf_counter()
            through = Sweep.along(tool.cutter, Line((-10, 0, -depth), (40, 0, -depth)))
            lo, estimate, hi = engine.cut(through).bracket
            yield {
                "case": "accuracy",
                "tool": name,
                "chord_mm": chord,
                "exact_mm3": truth,
                "estimate_mm3": estimate,
                "width_rel": (hi - lo) / truth,
                "error_rel": (estimate - truth) / truth,
                "inside": lo <= truth <= hi,
                "seconds": perf_counter() - begin,
            }
