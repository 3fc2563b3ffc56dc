"""A triangular pocket with rounded corners, and the triangle on which the centre of the cutter may be."""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, cos, degrees, isfinite, pi, radians, sin, tan

import numpy as np

from vmachining.arrays import Floats
from vmachining.errors import InputError

CONSISTENT = 1e-6
"""Largest misfit of given angles: of their sum in rad, and of the sine rule, relative."""


@dataclass(frozen=True, slots=True)
class Triangle:
    """Pocket with sides a, b, c (mm), whose corners are round with the radius r of the cutter.

    a is the longest side and lies along +x from the corner of beta, which is the origin, to that of gamma. alpha, beta,
    gamma : rad, opposite a, between a and c, between a and b. Source: spec C.1.
    """

    a: float
    b: float
    c: float
    r: float
    alpha: float
    beta: float
    gamma: float

    @classmethod
    def of(
        cls, a: float, b: float, c: float, r: float, *, angles: tuple[float, float, float] | None = None
    ) -> Triangle:
        """Triangle of three sides; `angles` (alpha, beta, gamma in degrees) are taken at their word, see `misfit`.

        Raises InputError: Sides that make no triangle, a side longer than a, a cutter that does not fit.
        """
        if not all(isfinite(v) and v > 0.0 for v in (a, b, c, r)):
            raise InputError(f"sides {a:g}, {b:g}, {c:g} and radius {r:g} mm: all must be positive")
        if max(b, c) > a * (1.0 + CONSISTENT):
            raise InputError(
                f"side a of {a:g} mm is not the longest of {a:g}, {b:g}, {c:g}",
                remedy="name the longest one a",
            )
        if a >= (b + c) * (1.0 - 1e-12):
            raise InputError(
                f"sides {a:g}, {b:g}, {c:g} mm make no triangle: a reaches the sum of the others"
            )
        if angles is None:
            beta = acos(min(1.0, (a * a + c * c - b * b) / (2.0 * a * c)))
            gamma = acos(min(1.0, (a * a + b * b - c * c) / (2.0 * a * b)))
            alpha = pi - beta - gamma
        else:
            alpha, beta, gamma = (radians(v) for v in angles)
            if not all(0.0 < v < pi for v in (alpha, beta, gamma)):
                raise InputError(
                    f"angles {', '.join(f'{v:g}' for v in angles)} degrees: each must lie between 0 and 180"
                )
        found = cls(a, b, c, r, alpha, beta, gamma)
        if not (found.inset > 0.0 and min(found.sides) > 0.0):
            raise InputError(
                f"a cutter of radius {r:g} mm is too large for the pocket: side AB of its path would be "
                f"{found.sides[0]:.3f} mm",
                remedy=f"take a radius below {found.inradius:.4g} mm",
            )
        return found

    @property
    def misfit(self) -> str | None:
        """What is inconsistent between sides and angles, in words; None where nothing is."""
        total = abs(self.alpha + self.beta + self.gamma - pi)
        ratios = np.array([self.a, self.b, self.c]) / np.sin([self.alpha, self.beta, self.gamma])
        sines = float(np.ptp(ratios) / ratios.mean())
        if max(total, sines) <= CONSISTENT:
            return None
        true = Triangle.of(self.a, self.b, self.c, self.r)
        exact = ", ".join(f"{degrees(v):.4f}" for v in (true.alpha, true.beta, true.gamma))
        return f"inconsistent triangle: its sides have the angles {exact} degrees"

    @property
    def inradius(self) -> float:
        """mm, of the pocket with sharp corners."""
        half = 0.5 * (self.a + self.b + self.c)
        return float(np.sqrt((half - self.a) * (half - self.b) * (half - self.c) / half))

    @property
    def sides(self) -> tuple[float, float, float]:
        """AB, BC, AC: sides of the triangle of cutter centres, mm."""
        cot_a, cot_b, cot_c = (1.0 / tan(v / 2.0) for v in (self.alpha, self.beta, self.gamma))
        return (
            self.a - self.r * (cot_b + cot_c),
            self.b - self.r * (cot_a + cot_c),
            self.c - self.r * (cot_a + cot_b),
        )

    @property
    def perimeter(self) -> float:
        """mm, of the triangle of cutter centres."""
        return sum(self.sides)

    @property
    def height(self) -> float:
        """H: of the triangle of cutter centres over AB, mm."""
        return self.sides[2] * sin(self.beta)

    @property
    def inset(self) -> float:
        """h: inradius of the triangle of cutter centres, mm."""
        return self.sides[0] * sin(self.beta / 2.0) * sin(self.gamma / 2.0) / cos(self.alpha / 2.0)

    @property
    def area(self) -> float:
        """mm^2, of the pocket with its round corners."""
        return 0.5 * self.sides[0] * self.height + self.perimeter * self.r + pi * self.r**2

    @property
    def corners(self) -> Floats:
        """(3, 2) mm: A, B and C, the corners of the triangle of cutter centres at beta, gamma and alpha."""
        x, y = self.r / tan(self.beta / 2.0), self.r
        ab, _, ac = self.sides
        return np.array(
            [(x, y), (x + ab, y), (x + ac * cos(self.beta), y + ac * sin(self.beta))], dtype=np.float64
        )

    @property
    def half_angles(self) -> Floats:
        """(3,) rad: half of the angles at A, B and C."""
        return np.array([self.beta, self.gamma, self.alpha]) / 2.0

    @property
    def incentre(self) -> Floats:
        """(2,) mm."""
        a, b, c = self.corners
        ab, bc, ac = self.sides
        return np.asarray((bc * a + ac * b + ab * c) / (ab + bc + ac))

    def wall(self, places: int = 24) -> Floats:
        """(n, 2) mm: the wall of the pocket, counter-clockwise and closed; so many places on each round corner."""
        starts = (self.beta + pi / 2.0, -pi / 2.0, pi / 2.0 - self.gamma)
        points = []
        for corner, start, angle in zip(
            self.corners, starts, (self.beta, self.gamma, self.alpha), strict=True
        ):
            turn = start + np.linspace(0.0, pi - angle, places)
            points.append(corner + self.r * np.column_stack([np.cos(turn), np.sin(turn)]))
        return np.concatenate([*points, points[0][:1]])
