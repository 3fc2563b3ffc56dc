"""`Turn`: one block of a five-axis motion, tip and tool axis as functions of t in [0, 1].

Symbols: c tip, A unit tool axis from tip to spindle, E control point at height h on the axis, E = c + h A.
Geometry does not depend on the time the block takes, so t runs from 0 to 1 and rates are per block.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, brief, rows
from vmachining.errors import SweepError
from vmachining.numerics.series import Series, rotation
from vmachining.sweep.pose import Pose, tip, unit_axis

Angles: TypeAlias = Mapping[str, float] | ArrayLike

CHAINS = {"ac": "ca", "bc": "cb", "ab": "ab", "hexa": "ca"}
"""Rotations that carry +z to the tool axis, outermost first: ac Rz(c) Rx(a), bc Rz(c) Ry(b), ab Rx(a) Ry(b).

The hexapod head Rz(c) Rx(a) Rz(-c) differs from ac by a spin about the tool axis, which sweeps nothing.
"""

LETTERS = {"ac": "ac", "bc": "bc", "ab": "ab", "hexa": "ac"}
DIRECTION = {"a": (1.0, 0.0, 0.0), "b": (0.0, 1.0, 0.0), "c": (0.0, 0.0, 1.0)}

REVERSED = 1e-9
"""rad: axes closer than this to opposite have no great circle; the plane would be rounding."""

STILL = 1e-14
"""Amplitude of the axis below which it does not turn: some ulp of a unit vector."""

CELLS = 256
"""Time intervals of the block over which bounds are taken; their slack falls with the square of this."""


@dataclass(frozen=True, slots=True, eq=False)
class Turn:
    """Tip and axis of a tool that may turn while it moves.

    Made by `great_circle`, `rotary`, `through` or `joints`. start, end : (3,) mm, tool tip at t = 0 and 1.
    """

    start: Floats
    end: Floats
    tip_series: Series = field(repr=False)
    axis_series: Series = field(repr=False)

    def __repr__(self) -> str:
        axes = f"axis {brief(self.axis(0.0))} to {brief(self.axis(1.0))}"
        return f"Turn({brief(self.start)} to {brief(self.end)}, {axes})"

    @classmethod
    def great_circle(cls, start: Pose, end: Pose) -> Turn:
        """Interpolation `axis`: the tip moves linearly, the axis turns at constant rate in one plane.

        Raises SweepError: Tips or axes that are not finite, an axis of length zero, opposite axes (no plane is given).
        """
        return cls.through(start.cl, end.cl, "axis", start.axis, end.axis)

    @classmethod
    def rotary(cls, cl0: ArrayLike, cl1: ArrayLike, chain: str, angles0: Angles, angles1: Angles) -> Turn:
        """Interpolation `rotary`: the tip and both rotary angles move linearly.

        cl0, cl1 : (3,) mm, tips.
        chain : "ac", "bc", "ab" or "hexa", see `CHAINS`.
        angles0, angles1 : rad, by letter ({"a": 0.1, "c": 2.0}) or in the order of the letters.
        Raises SweepError: Unknown chain, missing or foreign letters, values that are not finite.
        """
        return cls.through(cl0, cl1, chain, angles0, angles1)

    @classmethod
    def through(
        cls,
        point0: ArrayLike,
        point1: ArrayLike,
        chain: str,
        angles0: Angles,
        angles1: Angles,
        *,
        control_height: float = 0.0,
    ) -> Turn:
        """Motion whose control point, `control_height` mm above the tip, moves linearly.

        `chain` is one of `CHAINS` with angles in rad, or "axis" with two directions (3,) instead.
        """
        if not np.isfinite(control_height):
            raise SweepError(f"control height {control_height} is not finite")
        axis = _great_circle(angles0, angles1) if chain == "axis" else _rotary(chain, angles0, angles1)
        begin, finish = tip(point0, "start"), tip(point1, "end")
        if control_height == 0.0:
            return cls(begin, finish, Series.linear(begin, finish - begin), axis)
        point = Series.linear(begin, finish - begin) + axis.scaled(-control_height)
        return cls(_frozen(point.at(0.0)), _frozen(point.at(1.0)), point, axis)

    @classmethod
    def joints(
        cls,
        chain: Sequence[tuple[str, ArrayLike, ArrayLike, float]],
        q0: ArrayLike,
        q1: ArrayLike,
        *,
        tip_home: ArrayLike = (0.0, 0.0, 0.0),
        axis_home: ArrayLike = (0.0, 0.0, 1.0),
    ) -> Turn:
        """All joints of a serial machine move linearly; the tip follows the bow that results.

        chain : rows (kind, direction, point, sign) from workpiece to tool; kind "L" slides along the
            direction by sign q mm, "R" turns about the line through `point` (mm) by sign q rad.
        q0, q1 : (n,) joint values, mm and rad.
        tip_home, axis_home : tool at q = 0, in the frame of the workpiece.
        Raises SweepError: Wrong kinds or shapes, values that are not finite, a direction of length zero.
        """
        try:
            first, last = rows(q0, len(chain), name="q0"), rows(q1, len(chain), name="q1")
        except (ValueError, TypeError) as exc:
            raise SweepError(f"joints: {exc}") from exc
        point = Series.constant(tip(tip_home, "home"))
        axis = Series.constant(unit_axis(axis_home, "home"))
        for k in reversed(range(len(chain))):
            kind, direction, pivot, sign = chain[k]
            d = unit_axis(direction, f"joint {k + 1}")
            begin, rate = float(sign * first[k]), float(sign * (last[k] - first[k]))
            if kind == "L":
                point += Series.linear(begin * d, rate * d)
            elif kind == "R":
                turn, center = rotation(d, begin, rate), tip(pivot, f"joint {k + 1}")
                point = turn @ (point + Series.constant(-center)) + Series.constant(center)
                axis = turn @ axis
            else:
                raise SweepError(f"joint {k + 1} is of kind {kind!r}", remedy="L slides, R turns")
        return cls(_frozen(point.at(0.0)), _frozen(point.at(1.0)), point, axis)

    def position(self, t: ArrayLike) -> Floats:
        """(..., 3) mm, tool tip. The ends are hit exactly."""
        s = np.asarray(t, dtype=np.float64)
        out = self.tip_series.at(s)
        out[s == 0.0] = self.start
        out[s == 1.0] = self.end
        return out

    def velocity(self, t: ArrayLike) -> Floats:
        """(..., 3) mm per unit of t, of the tip."""
        return self.tip_series.at(t, 1)

    def acceleration(self, t: ArrayLike) -> Floats:
        """(..., 3) mm per unit of t squared, of the tip."""
        return self.tip_series.at(t, 2)

    def axis(self, t: ArrayLike) -> Floats:
        """(..., 3) unit tool axis."""
        return self.axis_series.at(t)

    def axis_rate(self, t: ArrayLike) -> Floats:
        """(..., 3) per unit of t, dA/dt; the angular velocity without spin is A x dA/dt."""
        return self.axis_series.at(t, 1)

    def axis_acceleration(self, t: ArrayLike) -> Floats:
        """(..., 3) per unit of t squared."""
        return self.axis_series.at(t, 2)

    @property
    def length(self) -> float:
        """mm that the tip travels (midpoint rule over 256 cells where it is not straight)."""
        if self.is_straight:
            return float(np.linalg.norm(self.end - self.start))
        middle = (np.arange(CELLS) + 0.5) / CELLS
        return float(np.linalg.norm(self.velocity(middle), axis=1).mean())

    @property
    def rotation(self) -> float:
        """rad that the axis sweeps along its path, an upper bound (exact on a great circle)."""
        series = self.axis_series
        moving = series.frequencies > 0.0
        if not moving.any():
            return 0.0
        if moving.sum() == 1 and not series.terms[~moving].any():
            return float(series.frequencies[moving][0])
        middle = (np.arange(CELLS) + 0.5) / CELLS
        mean = float(np.linalg.norm(self.axis_rate(middle), axis=1).mean())
        return mean + series.bound(2) / (4.0 * CELLS)

    @property
    def is_straight(self) -> bool:
        """Whether the tip moves linearly in t."""
        series = self.tip_series
        return bool(np.abs(series.terms[series.frequencies > 0.0]).sum() == 0.0)

    @property
    def is_steady(self) -> bool:
        """Whether the axis keeps its direction."""
        series = self.axis_series
        return bool(np.abs(series.terms[series.frequencies > 0.0]).sum() <= STILL)

    @property
    def is_upright(self) -> bool:
        """Whether the axis is +z throughout."""
        return self.is_steady and bool(np.abs(self.axis(0.0) - [0.0, 0.0, 1.0]).max() <= 1e-12)

    @property
    def bounds(self) -> Floats:
        """(2, 3) mm: a box around the path of the tip, at most |c''| / (8 256^2) too large."""
        where = self.position(np.linspace(0.0, 1.0, CELLS + 1))
        slack = 0.0 if self.is_straight else self.tip_series.bound(2) / (8.0 * CELLS**2)
        return np.stack([where.min(axis=0) - slack, where.max(axis=0) + slack])

    def split(self, fractions: Sequence[float]) -> list[Turn]:
        """Pieces between consecutive fractions (0 and 1 are added)."""
        return [self.part(a, b) for a, b in pairwise([0.0, *fractions, 1.0])]

    def part(self, a: float, b: float) -> Turn:
        """The motion from t = a to b."""
        start, end = _frozen(self.position(a)), _frozen(self.position(b))
        return Turn(start, end, self.tip_series.part(a, b), self.axis_series.part(a, b))

    def drifting(self, last: ArrayLike, first: ArrayLike = (0.0, 0.0, 0.0)) -> Turn:
        """The motion with a drift: the first and the last pose are moved by (3,) mm, others by what is between."""
        before, after = np.asarray(first, dtype=np.float64), np.asarray(last, dtype=np.float64)
        series = self.tip_series + Series.linear(before, after - before)
        return Turn(_frozen(self.start + before), _frozen(self.end + after), series, self.axis_series)


def _great_circle(start: Angles, end: Angles) -> Series:
    """Unit axis at constant rate in the plane of two directions."""
    if isinstance(start, Mapping) or isinstance(end, Mapping):
        raise SweepError("angles are given where directions are needed", remedy="name the rotary chain")
    a, b = unit_axis(start, "start"), unit_axis(end, "end")
    across = b - float(a @ b) * a
    size = float(np.linalg.norm(np.cross(a, b)))
    angle = float(np.arctan2(size, a @ b))
    if np.pi - angle < REVERSED:
        raise SweepError(
            f"start and end axis are opposite ({np.degrees(angle):.9g} degrees apart): no plane to turn in",
            remedy="give an axis in between, or rotary angles",
        )
    if angle == 0.0 or not across.any():
        return Series.constant(a)
    across /= np.linalg.norm(across)
    across -= float(a @ across) * a  # once more: `across` of nearly equal axes is mostly rounding
    across /= np.linalg.norm(across)
    terms = np.zeros((1, 2, 3), dtype=complex)
    terms[0, 0] = a - 1j * across
    return Series(np.array([angle]), terms)


def _rotary(chain: str, start: Angles, end: Angles) -> Series:
    """Unit axis of a rotary chain whose angles are linear in t."""
    if chain not in CHAINS:
        raise SweepError(f"unknown rotary chain {chain!r}", remedy=f"take one of {', '.join(CHAINS)}")
    a, b = (_angles(LETTERS[chain], v, n) for v, n in ((start, "start"), (end, "end")))
    axis = Series.constant(np.array([0.0, 0.0, 1.0]))
    for letter in reversed(CHAINS[chain]):
        k = LETTERS[chain].index(letter)
        axis = rotation(np.array(DIRECTION[letter]), float(a[k]), float(b[k] - a[k])) @ axis
    return axis


def _angles(letters: str, given: Angles, name: str) -> Floats:
    """(2,) rad in the order of the letters."""
    if isinstance(given, Mapping):
        if set(given) != set(letters):
            raise SweepError(
                f"{name} angles are given for {', '.join(sorted(map(str, given))) or 'no axis'}",
                remedy=f"give {' and '.join(letters)}, in rad",
            )
        given = [given[k] for k in letters]
    try:
        return rows(given, 2, name=f"{name} angles")
    except (ValueError, TypeError) as exc:
        raise SweepError(str(exc), remedy="give two finite numbers, rad") from exc


def _frozen(values: Floats) -> Floats:
    values.setflags(write=False)
    return values
