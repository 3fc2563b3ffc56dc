"""Rays and volumes of single sweeps without a kernel: time and error per kind of motion and cutter."""

from __future__ import annotations

from collections.abc import Iterator
from time import perf_counter, process_time
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.geometry import Arc, Line
from vmachining.sweep import Motion, Sweep, Turn
from vmachining.tool import BallNose, BullNose, Cutter, FlatEnd, Profile

__all__ = ["capsule", "rays"]

CUTTERS: dict[str, Cutter] = {
    "flat": FlatEnd(diameter=10, length=40),
    "ball": BallNose(diameter=10, length=40),
    "bull": BullNose(diameter=10, corner_radius=2, length=40),
}

MOTIONS: dict[str, Motion] = {
    "level, 1 mm": Line((0, 0, 0), (1, 0, 0)),
    "ramp, 1 mm": Line((0, 0, 0), (0.9, 0.3, -0.3)),
    "arc, 40 mm": Arc((30, 0, 0), (0, 0, 0), 2, angle=1.3),
    "helix, 40 mm": Arc((30, 0, 0), (0, 0, 0), 2, angle=1.3, rise=-4),
    "five axes, 1 mm and 1 degree": Turn.rotary((0, 0, 0), (1, 0, 0), "ac", (0.3, 0.2), (0.31, 0.215)),
    "five axes, 10 mm and 8 degrees": Turn.rotary((0, 0, 0), (9, 4, 1), "ac", (0.3, 0.2), (0.42, 0.3)),
    "five axes, 100 mm and 60 degrees": Turn.rotary((0, 0, 0), (0, 100, 0), "ac", (0.4, 3.1), (1.0, 4.2)),
}

RAYS = 20000


def capsule() -> tuple[Sweep, float]:
    """Capsule R 10, 60 mm between its balls, moved 80 mm while it tilts by 30 degrees in one plane; mm^3.

    Notes
    -----
    The axis fills a convex plane region, so the sweep is that region grown by the ball: 2 R area + pi R^2
    perimeter / 2 + 4/3 pi R^3.
    """
    R, H, d, turn = 10.0, 60.0, 80.0, np.pi / 6
    a, w = np.polynomial.legendre.leggauss(40)
    a, w = 0.5 * turn * (a + 1), 0.5 * turn * w
    dx = d / turn + H * np.cos(a)
    area = float(w @ (H * np.cos(a) * dx)) - 0.5 * H * H * np.sin(turn) * np.cos(turn)
    perimeter = d + 2 * H + float(w @ np.hypot(dx, H * np.sin(a)))
    nan = float("nan")
    body = Profile([(0, -R), (R, 0), (R, H), (0, H + R)], [(0, 0), (nan, nan), (0, H)], [R, 0, R])
    path = Turn.through((0, 0, 0), (d, 0, 0), "axis", (0, 0, 1), (np.sin(turn), 0, np.cos(turn)))
    return Sweep.along(body, path), float(2 * R * area + np.pi * R**2 / 2 * perimeter + 4 / 3 * np.pi * R**3)


def rays() -> Iterator[dict[str, Any]]:
    """Microseconds of CPU per ray: upright and skew rays through the box of a sweep, hit or missed, after compiling."""
    rng = np.random.default_rng(0)
    for motion, path in MOTIONS.items():
        for tool, cutter in CUTTERS.items():
            sweep = Sweep.along(cutter, path)
            low, high = sweep.bounds
            a, b = (low + (high - low) * rng.random((RAYS, 3)) for _ in range(2))
            record: dict[str, Any] = {"case": "rays", "motion": motion, "tool": tool, "rays": RAYS}
            for name, way in (("upright", np.array([[0.0, 0.0, 1.0]])), ("skew", b - a)):
                record[f"{name}_us"] = _time(sweep, a, np.broadcast_to(way, a.shape))
            yield record
    sweep, exact = capsule()
    sweep.flux()
    begin = perf_counter()
    again = Sweep.along(sweep.profile, sweep.path).flux()
    yield {
        "case": "rays", "motion": "tilting capsule, volume by flux", "seconds": round(perf_counter() - begin, 4),
        "relative_error": abs(again.volume / exact - 1.0),
    }  # fmt: skip


def _time(sweep: Sweep, origins: Floats, directions: Floats) -> float:
    sweep.ray_intervals(origins[:10], directions[:10])
    begin = process_time()
    sweep.ray_intervals(origins, directions)
    return round(1e6 * (process_time() - begin) / len(origins), 3)
