"""Motions of a block as straight pieces, and how far the true motion may lie from them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats
from vmachining.geometry import Arc, Line

__all__ = ["Chords", "chords", "is_flat", "pieces", "widest"]

MOST = 100_000
"""Chords of one block; a path that wants more is taken with those, and its bracket is as wide as that makes it."""


SHARE = 0.125
"""Of the radius of the cutter, by which the first pair is shrunk and grown."""

MOST_ANGLE = np.pi / 3
"""Of one piece, rad."""

STEEPEST = 100.0
"""Slope of a helix from which on it is taken by chords of its own, as arcs in other planes are."""


class Chords(NamedTuple):
    """points : (n + 1, 3) mm, corners of the way. off : mm; neither of way and motion is farther from the other."""

    points: Floats
    off: float


def chords(path: Line | Arc, sag: float) -> Chords:
    """A line as it is; an arc or a helix as a polygon no farther from it than `sag` (mm).

    Notes
    -----
    n chords of angle a. Corners lie at radius rho with rho - r = r - rho cos(a / 2), as far outside of the circle as the
    middles of the chords inside: r tan(a / 4)^2, half the sagitta of chords with corners on the circle. Points of chord
    and helix at the same share u of both have the same height; the polar angle of the former differs from u a by
    atan(t tan(a / 2)) - t a / 2, t = 2 u - 1, at most a^3 / (36 sqrt(3)) for small a and below a^3 / 36 up to 2 rad.
    Where nothing rises, points of the same polar angle are compared instead.
    """
    if isinstance(path, Line) or path.angle == 0.0 or path.radius == 0.0:
        return Chords(np.array([path.position(0.0), path.position(1.0)]), 0.0)
    r, angle = path.radius, abs(path.angle)
    n = max(1, int(np.ceil(angle / (4.0 * np.arctan(np.sqrt(min(sag / r, 0.17)))))))
    while True:
        a = angle / n
        aside = r * np.tan(0.25 * a) ** 2
        off = float(aside + (r * a**3 / 36.0 if path.rise else 0.0))
        if off <= max(sag, 1e-9 * r) or n > MOST:
            break
        n = int(np.ceil(1.05 * n))
    points = path.position(np.linspace(0.0, 1.0, n + 1))
    arm = points - path.center
    arm[:, path.axis] = 0.0
    return Chords(points + arm * (aside / r), off)


def is_flat(path: object) -> bool:
    """Whether a path is an arc or a helix about an upright axis that rules for cells are made for."""
    if not isinstance(path, Arc) or path.axis != 2 or path.angle == 0.0 or path.radius < 1e-6:
        return False
    return abs(path.rise) <= STEEPEST * path.radius * abs(path.angle)


def widest(radius: float) -> float:
    """mm by which the first pair of a cutter is shrunk and grown."""
    return SHARE * radius


def pieces(path: Arc, radius: float) -> int:
    """Equal pieces of an arc, each no farther from its chord than the first pair of the cutter allows."""
    most, n = 0.9 * widest(radius), max(1, int(np.ceil(abs(path.angle) / MOST_ANGLE)))
    while True:
        a = abs(path.angle) / n
        if path.radius * (np.tan(0.25 * a) ** 2 + a**3 / 36.0) <= most:
            return n
        n = n + 1 + n // 8
