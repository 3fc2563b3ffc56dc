"""What columns are judged by: lower surfaces of cutters by hand, sweeps by a search along the path."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import vmachining as vm

Surface = Callable[[np.ndarray], np.ndarray]


def ball(radius: float = 5.0) -> tuple[vm.Tool, float, Surface]:
    """Tool, radius, height of its lower surface over its tip by distance from the axis."""
    return (
        vm.BallNose(diameter=2 * radius, length=60.0),
        radius,
        lambda r: radius - np.sqrt(np.maximum(radius**2 - r * r, 0.0)),
    )


def flat(radius: float = 4.0) -> tuple[vm.Tool, float, Surface]:
    return vm.FlatEnd(diameter=2 * radius, length=60.0), radius, np.zeros_like


def bull(radius: float = 5.0, corner: float = 2.0) -> tuple[vm.Tool, float, Surface]:
    def under(r: np.ndarray) -> np.ndarray:
        return corner - np.sqrt(np.maximum(corner**2 - np.maximum(r - radius + corner, 0.0) ** 2, 0.0))

    return vm.BullNose(diameter=2 * radius, corner_radius=corner, length=60.0), radius, under


def cone() -> tuple[vm.Tool, float, Surface]:
    tan = np.tan(np.radians(30.0))
    tool = vm.Taper(diameter=2.0, taper_deg=30.0, length=14.0)
    return tool, 1.0 + 14.0 * tan, lambda r: np.maximum(r - 1.0, 0.0) / tan


def tapered_ball() -> tuple[vm.Tool, float, Surface]:
    angle, tip = np.radians(20.0), 1.5
    r0, z0 = tip * np.cos(angle), tip * (1.0 - np.sin(angle))
    tool = vm.Taper(diameter=2 * tip, taper_deg=20.0, corner_radius=tip, length=15.0)

    def under(r: np.ndarray) -> np.ndarray:
        low = tip - np.sqrt(tip**2 - np.minimum(r, r0) ** 2)
        return np.where(r <= r0, low, z0 + (r - r0) / np.tan(angle))

    return tool, r0 + (15.0 - z0) * np.tan(angle), under


CUTTERS = {"ball": ball, "flat": flat, "bull": bull, "cone": cone, "tapered ball": tapered_ball}


def lowest(a, b, radius: float, under: Surface, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Lower surface of the sweep from tip a to tip b: golden section along the part of the way that is over a place."""
    d = np.subtract(b, a)
    px, py, q = x - a[0], y - a[1], d[0] ** 2 + d[1] ** 2
    out = np.full(x.shape, np.inf)
    if q == 0.0:
        r = np.hypot(px, py)
        out[r <= radius] = min(a[2], b[2]) + under(r[r <= radius])
        return out
    h, square = (px * d[0] + py * d[1]) / q, (px**2 + py**2 - radius**2) / q
    root = np.sqrt(np.maximum(h * h - square, 0.0))
    lo, hi = np.maximum(h - root, 0.0), np.minimum(h + root, 1.0)
    over = (h * h >= square) & (lo <= hi)
    lo, hi, px, py = lo[over], hi[over], px[over], py[over]

    def height(t: np.ndarray) -> np.ndarray:
        return a[2] + t * d[2] + under(np.minimum(np.hypot(px - t * d[0], py - t * d[1]), radius))

    golden = (np.sqrt(5.0) - 1.0) / 2.0
    for _ in range(44):
        left, right = hi - golden * (hi - lo), lo + golden * (hi - lo)
        lower = height(left) < height(right)
        lo, hi = np.where(lower, lo, left), np.where(lower, right, hi)
    out[over] = np.minimum(np.minimum(height(lo), height(hi)), height(0.5 * (lo + hi)))
    return out


def program(rng: np.random.Generator, blocks: int, box: float = 8.0):
    """Straight blocks: anywhere, plunges, retraces whole and in part, steps of a pass, tiny and half outside."""
    way = []
    low, high = np.array([-box, -box, -9.0]), np.array([box, box, -0.5])
    here = rng.uniform(low, high)
    for _ in range(blocks):
        kind = rng.random()
        if kind < 0.12 and way:
            there = way[-1][0]
        elif kind < 0.25:
            there = here + [0.0, 0.0, rng.uniform(-4.0, 2.0)]
        elif kind < 0.45:
            there = here + [rng.choice([-3.0, -1.0, -0.5, 0.5, 1.0, 3.0]), 0.0, 0.0]
        elif kind < 0.55:
            there = here + rng.normal(size=3) * rng.choice([0.1, 1e-2, 1e-4])
        elif kind < 0.65 and way:
            there = way[-1][0] + (way[-1][1] - way[-1][0]) * rng.choice([0.25, 0.5])
        elif kind < 0.75:
            there = here + [0.0, rng.choice([-0.3, 0.3]), 0.0]
        else:
            there = rng.uniform(low, high)
        there = np.array(there)
        there[2] = np.clip(there[2], -12.0, 1.0)
        way.append((here.copy(), there.copy()))
        here = there
    return way
