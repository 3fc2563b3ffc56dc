"""Kinematics and pulses: how many per second, and how far off."""

from __future__ import annotations

from collections.abc import Iterator
from time import perf_counter
from typing import Any

import numpy as np

from vmachining.geometry import Line
from vmachining.machine import Interpolator, follow, preset, tip_deviation

__all__ = ["machine"]

OPTIONS: dict[str, dict[str, Any]] = {
    "ac-table": {"second_point": (0.0, 0.0, -50.0)},
    "ca-head": {"pivot_mm": 150.0},
    "c-table-b-head": {"pivot_mm": 150.0},
    "nutating-head": {"pivot_mm": 150.0},
}


def machine(poses: int = 20_000, lines: int = 500) -> Iterator[dict[str, Any]]:
    """Inverse, branch choice and deviation on a spiral of tool axes; pulse trains of short lines."""
    s = np.linspace(0.0, 1.0, poses)
    tilt, azimuth = 0.02 + s, 60.0 * np.pi * s
    axis = np.column_stack([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)])
    tip = 100.0 * np.column_stack([np.cos(azimuth), np.sin(azimuth), 0.2 * s])
    for name, options in OPTIONS.items():
        m = preset(name, **options)
        follow(m, tip[:2], axis[:2])  # compiles
        begin = perf_counter()
        joints = follow(m, tip, axis).joints
        followed = perf_counter() - begin
        back = m.forward(joints)
        begin = perf_counter()
        blocks = min(poses - 1, 2000)
        found = tip_deviation(m, joints[:blocks], joints[1 : blocks + 1], samples=17)
        yield {
            "case": "machine",
            "machine": name,
            "poses": poses,
            "poses_per_second": poses / followed,
            "round_trip_mm": float(np.abs(back.tip - tip).max()),
            "round_trip_axis": float(np.abs(back.axis - axis).max()),
            "deviations_per_second": blocks / (perf_counter() - begin),
            "deviation_mm": float(found.parametric.max()),
            "bound_mm": float(found.bound.max()),
        }
    tool = Interpolator(blu_mm=0.01)
    tool.blocks(Line((0, 0, 0), (1, 1, 1)), 100.0)  # compiles
    rng = np.random.default_rng(0)
    points = np.cumsum(rng.uniform(-2, 2, (lines + 1, 3)), axis=0)
    begin = perf_counter()
    made = [b for k in range(lines) for b in tool.blocks(Line(points[k], points[k + 1]), 600.0)]
    seconds = perf_counter() - begin
    yield {
        "case": "machine",
        "machine": "dda",
        "blocks": len(made),
        "ticks_per_second": sum(b.train.ticks for b in made) / seconds,
        "deviation_blu": max(b.deviation_blu for b in made),
        "limit_blu": max(b.limit_blu for b in made),
    }
