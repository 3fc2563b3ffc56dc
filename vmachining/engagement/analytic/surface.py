"""The shape of a finished surface from its normals, as a sum of circular or straight profiles in x and y.

mu is the tilt of the upward normal from z, signed: positive toward +x (or +y), mu = atan(-dz/dx). A profile through two
normals is a circle of radius R > 0 where it is convex, R < 0 where it is concave, and straight where both tilts agree.
Source: Hendriko, five-axis milling, 6-1 to 6-7; the sign of the chord and of 6-7 is corrected, and straight is a shape of
its own instead of R = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.errors import InputError

STRAIGHT_RAD = 1e-9
"""Tilts that differ by less are one: a radius of 1e9 chords."""


class Surface(Protocol):
    """What an edge comes out of."""

    def height(self, x: ArrayLike, y: ArrayLike) -> Floats:
        """(...,) mm; NaN where the surface has no height."""


class Shape(IntEnum):
    """Of a profile."""

    FLAT = 0
    SLOPE = 1
    CONVEX = 2
    CONCAVE = 3


STRAIGHT = (Shape.FLAT, Shape.SLOPE)


def section_radius(
    t1: ArrayLike, z1: ArrayLike, mu1: ArrayLike, t2: ArrayLike, z2: ArrayLike, mu2: ArrayLike
) -> Floats:
    """(...,) mm, signed radius of a profile through two normals, inf where it is straight (6-1, 6-2).

    Exact for a circle. t, z mm: place and height; mu rad.
    """
    turn = np.asarray(mu2, dtype=np.float64) - np.asarray(mu1, dtype=np.float64)
    run, rise = np.subtract(t2, t1), np.subtract(z2, z1)
    straight = np.abs(turn) < STRAIGHT_RAD
    chord = np.sign(run) * np.hypot(run, rise)
    return np.asarray(np.where(straight, np.inf, chord / (2.0 * np.sin(0.5 * np.where(straight, 1.0, turn)))))


class Section(NamedTuple):
    """A profile: shape; radius mm, signed, inf where straight; mu rad and at mm, tilt and place of the normal."""

    shape: Shape
    radius: float
    mu: float
    at: float

    @property
    def ascent(self) -> float:
        """rad, gamma: angle of ascent at the normal, -mu."""
        return -self.mu

    def sine(self, t: ArrayLike) -> Floats:
        """(...,) sin d at t: of the tilt of the normal there; beyond 1 the profile has no height (6-3)."""
        run = np.asarray(t, dtype=np.float64) - self.at
        return np.asarray(np.sin(self.mu) + run / self.radius)

    def tilt(self, t: ArrayLike) -> Floats:
        """(...,) rad, d: tilt of the normal at t; NaN where none exists."""
        s = self.sine(t)
        return np.asarray(np.arcsin(np.where(np.abs(s) <= 1.0, s, np.nan)))

    def rise(self, t: ArrayLike) -> Floats:
        """(...,) mm, g: height at t over that at the normal (6-4 to 6-7)."""
        run = np.asarray(t, dtype=np.float64) - self.at
        if self.shape in STRAIGHT:
            return np.asarray(-run * np.tan(self.mu))
        s = self.sine(t)
        cos = np.sqrt(np.where(np.abs(s) <= 1.0, (1.0 - s) * (1.0 + s), np.nan))
        return np.asarray(self.radius * (cos - np.cos(self.mu)))


def section(t1: float, z1: float, mu1: float, t2: float, z2: float, mu2: float) -> Section:
    """The profile through two normals (6-1, classification of 6.1)."""
    radius = float(section_radius(t1, z1, mu1, t2, z2, mu2))
    if np.isinf(radius):
        flat = abs(mu1) < STRAIGHT_RAD
        return Section(Shape.FLAT if flat else Shape.SLOPE, np.inf, 0.0 if flat else mu1, t1)
    return Section(Shape.CONVEX if radius > 0.0 else Shape.CONCAVE, radius, mu1, t1)


@dataclass(frozen=True, slots=True)
class Patch:
    """Model of a surface near a normal: z = z1 + g_x(x) + g_y(y), mm."""

    z1: float
    along_x: Section
    along_y: Section

    @classmethod
    def of_normals(cls, v1: ArrayLike, v2: ArrayLike, v3: ArrayLike) -> Patch:
        """From rows (x, y, z, mu_x, mu_y): v1, its neighbour v2 in x, its neighbour v3 in y.

        Raises InputError: A neighbour in the same place.
        """
        a, b, c = (np.asarray(v, dtype=np.float64) for v in (v1, v2, v3))
        if a[0] == b[0] or a[1] == c[1]:
            raise InputError("a neighbour of a normal must lie beside it: v2 in x, v3 in y")
        return cls(
            float(a[2]),
            section(a[0], a[2], a[3], b[0], b[2], b[3]),
            section(a[1], a[2], a[4], c[1], c[2], c[4]),
        )

    @property
    def kind(self) -> str:
        """ "flat", "slope", "convex", "concave", "saddle" (one of each), or both words, x first."""
        shapes = self.along_x.shape, self.along_y.shape
        if shapes[0] == shapes[1]:
            return shapes[0].name.lower()
        if set(shapes) == {Shape.CONVEX, Shape.CONCAVE}:
            return "saddle"
        return f"{shapes[0].name.lower()} {shapes[1].name.lower()}"

    def height(self, x: ArrayLike, y: ArrayLike) -> Floats:
        """See `Surface`."""
        return np.asarray(self.z1 + self.along_x.rise(x) + self.along_y.rise(y))

    def projection(self, points: ArrayLike) -> Floats:
        """(...,) mm, Cq: how far the surface is above points (..., 3)."""
        c = np.asarray(points, dtype=np.float64)
        return np.asarray(self.height(c[..., 0], c[..., 1]) - c[..., 2])


@dataclass(frozen=True, slots=True, eq=False, init=False)
class NormalGrid:
    """Normals of a surface over a grid: x (n,), y (m,) rising; z, mu_x, mu_y (n, m). mm, rad."""

    x: Floats
    y: Floats
    z: Floats
    mu_x: Floats
    mu_y: Floats

    def __init__(self, x: ArrayLike, y: ArrayLike, z: ArrayLike, mu_x: ArrayLike, mu_y: ArrayLike) -> None:
        lines = [np.array(v, dtype=np.float64) for v in (x, y)]
        if any(v.ndim != 1 or len(v) < 2 or not (np.diff(v) > 0.0).all() for v in lines):
            raise InputError("a grid of normals needs two or more rising places in x and in y")
        fields = [np.array(v, dtype=np.float64) for v in (z, mu_x, mu_y)]
        want = (len(lines[0]), len(lines[1]))
        if any(v.shape != want or not np.isfinite(v).all() for v in fields):
            raise InputError(
                f"a grid of {want[0]} x {want[1]} normals needs as many finite heights and tilts"
            )
        for name, value in zip(("x", "y", "z", "mu_x", "mu_y"), (*lines, *fields), strict=True):
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @classmethod
    def sampled(cls, surface: Surface, x: ArrayLike, y: ArrayLike, step: float = 1e-4) -> NormalGrid:
        """Of a surface, its slopes by central differences over `step` mm (fourth order)."""
        gx, gy = np.meshgrid(np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64), indexing="ij")

        def slope(dx: float, dy: float) -> Floats:
            up, down = ([surface.height(gx + k * dx, gy + k * dy) for k in (s, 2 * s)] for s in (1, -1))
            one, two = (a - b for a, b in zip(up, down, strict=True))
            return np.asarray((8.0 * one - two) / (12.0 * step))

        mu = [np.arctan(-slope(*d)) for d in ((step, 0.0), (0.0, step))]
        return cls(x, y, surface.height(gx, gy), *mu)

    def patch(self, x: float, y: float) -> Patch:
        """The model around the normal nearest to (x, y); neighbours on the side of the point, at a border the other."""
        at = []
        for line, t in ((self.x, x), (self.y, y)):
            i = int(np.argmin(np.abs(line - t)))
            step = 1 if t >= line[i] else -1
            at.append((i, i + step if 0 <= i + step < len(line) else i - step))
        (i, k), (j, m) = at
        rows = [
            (self.x[a], self.y[b], self.z[a, b], self.mu_x[a, b], self.mu_y[a, b])
            for a, b in ((i, j), (k, j), (i, m))
        ]
        return Patch.of_normals(*rows)
