"""Paths as rows of the kernels; arcs and helices as pieces that have one chord in every cell."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import hypot

import numpy as np

from vmachining.engines.columns.arcs._kernels import ABOUT_X, STRAIGHT
from vmachining.engines.columns.surface._kernels import STEEP
from vmachining.geometry import Arc, Line

SHARE = 0.125
"""Of the radius of the cutter, by which the first pair is shrunk and grown."""

MOST_ANGLE = np.pi / 3
"""Of one piece, rad."""


def lowest(path: Line | Arc) -> float:
    """mm, of the tip."""
    return (
        min(float(path.start[2]), float(path.end[2])) if isinstance(path, Line) else float(path.bounds[0, 2])
    )


def widest(radius: float) -> float:
    """mm by which the first pair of a cutter is shrunk and grown."""
    return SHARE * radius


def pieces(path: Arc, radius: float) -> list[Arc]:
    """Equal pieces of an arc, each no farther from its chord than the first pair of the cutter allows.


    The chord of angle a has its ends at radius rho with rho - r = r - rho cos(a / 2), as far outside of the circle as its
    middle inside: r tan(a / 4)^2, half the sagitta of a chord with ends on the circle. Points of chord and helix at the
    same share u of both have the same place along the axis; the polar angle of the former differs from u a by
    atan(t tan(a / 2)) - t a / 2, t = 2 u - 1, at most a^3 / (36 sqrt(3)) for small a and below a^3 / 36 up to 2 rad.
    Where nothing rises, points of the same polar angle are compared instead. A chord steeper than STEEP is a plunge of what
    is wider by its length in plan.
    """
    most, n = 0.9 * widest(radius), max(1, int(np.ceil(abs(path.angle) / MOST_ANGLE)))
    height = abs(path.rise) if path.axis == 2 else path.radius * abs(path.angle)
    while True:
        a = abs(path.angle) / n
        if path.radius * (np.tan(0.25 * a) ** 2 + a**3 / 36.0) + height / (n * STEEP) <= most:
            return path.split([k / n for k in range(1, n)])
        n = n + 1 + n // 8


def straight_row(
    a: Sequence[float], b: Sequence[float], c: int, wider: Callable[[float], int]
) -> list[float]:
    """Row of a line from a to b; wider : number of the cutter c grown by some mm.

    A ramp steeper than STEEP is bounded by two plunges: the lowest pose lies in it, and what is its length in plan wider
    there, rounded up to a power of two so that few cutters occur, holds it.
    """
    (x0, y0, z0), (x1, y1, z1) = a, b
    L = hypot(x1 - x0, y1 - y0)
    if abs(z1 - z0) < STEEP * L:
        way = [x0, y0, z0, (x1 - x0) / L, (y1 - y0) / L, L, (z1 - z0) / L]
        return [*way, c, c, min(z0, z1), STRAIGHT]
    holds = wider(float(2.0 ** np.ceil(np.log2(L)))) if L > 0.0 else c
    return [*(a if z0 <= z1 else b), 1.0, 0.0, 0.0, 0.0, c, holds, min(z0, z1), STRAIGHT]


def arc_row(piece: Arc, c: int) -> list[float]:
    """Row of one of the `pieces` of an arc."""
    h, length = piece.rise / abs(piece.angle), piece.radius * abs(piece.angle) + abs(piece.rise)
    low = float(piece.bounds[0, 2])
    return [
        *piece.center,
        piece.radius,
        piece.start_angle,
        length,
        h,
        c,
        c,
        low,
        ABOUT_X + piece.axis,
        piece.angle,
    ]
