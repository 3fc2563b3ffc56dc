"""How errors of the dexel grid fall with the spacing: three directions against closed forms, root mean squares over places."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import acos, log2, pi, sqrt
from typing import Any

import numpy as np

from vmachining.engines.dexel import DexelEngine
from vmachining.engines.protocol import Options
from vmachining.geometry import Line
from vmachining.stock import BoxStock
from vmachining.sweep import Sweep
from vmachining.tool import BallNose, FlatEnd

__all__ = ["dexel_order"]

SPACINGS = (2.0, 1.0, 0.5, 0.25)
"""mm."""

PLACES = 24
"""Of the stock under the rays: a root mean square is known to a seventh, an order between two of them to 0.3."""

R, DEEP, LONG = 5.0, 4.0, 20.0


def dexel_order() -> Iterator[dict[str, Any]]:
    """A record per shape."""
    low, high = np.array([-20.0, -20.0, -10.0]), np.array([20.0, 20.0, 0.0])
    for name, (sweep, truth) in _shapes().items():
        rng, errors = np.random.default_rng(0), []
        for spacing in SPACINGS:
            off = []
            for _ in range(PLACES):
                shift = np.array([*rng.uniform(0.0, SPACINGS[0], 2), 0.0])
                engine = DexelEngine(BoxStock(low - shift, high), Options(spacing=spacing))
                off.append(engine.touch(sweep).estimate / truth - 1.0)
            errors.append(float(np.sqrt(np.mean(np.square(off)))))
        yield {
            "case": "dexel-order", "shape": name, "spacings_mm": SPACINGS, "rms_off": errors,
            "orders": [log2(a / b) for a, b in pairwise(errors)],
            "order": log2(errors[0] / errors[-1]) / log2(SPACINGS[0] / SPACINGS[-1]),
        }  # fmt: skip


def _shapes() -> dict[str, tuple[Sweep, float]]:
    """Sweeps in a plate, and what they remove, mm^3: a slot along the rays and one at an angle, a ball's groove, its plunge."""
    flat, ball = FlatEnd(diameter=2 * R, length=30), BallNose(diameter=2 * R, length=30)
    way, down = np.array([np.cos(0.3), np.sin(0.3), 0.0]), np.array([0.0, 0.0, DEEP])
    slot = DEEP * (2.0 * R * LONG + pi * R * R)
    segment = R * R * acos(1.0 - DEEP / R) - (R - DEEP) * sqrt(2.0 * R * DEEP - DEEP**2)
    cap = pi * DEEP**2 * (3.0 * R - DEEP) / 3.0
    turned = Line(-0.5 * LONG * way - down, 0.5 * LONG * way - down)
    return {
        "slot": (Sweep.along(flat, turned), slot),
        "slot along the rays": (Sweep.along(flat, Line((-LONG / 2, 0, -DEEP), (LONG / 2, 0, -DEEP))), slot),
        "groove": (Sweep.along(ball, turned), segment * LONG + cap),
        "plunge": (Sweep.along(ball, Line((0.1, 0.2, 5), (0.1, 0.2, -DEEP))), cap),
    }
