"""The two paths a three-axis control drives: a straight line, and a circle or helix.

Both run over t in [0, 1] at constant speed. An arc stays an arc: nothing here is linearised.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import sqrt
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, Ints, brief, rows

PLANE_AXES = {0: (1, 2), 1: (2, 0), 2: (0, 1)}
"""First and second in-plane axis of a plane named by its normal axis; right-handed about the normal."""


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """Straight line of the CL point. start, end: (3,) mm."""

    start: Floats
    end: Floats

    def __init__(self, start: ArrayLike, end: ArrayLike) -> None:
        object.__setattr__(self, "start", rows(start, 3, name="start"))
        object.__setattr__(self, "end", rows(end, 3, name="end"))

    @classmethod
    def trusted(cls, start: Floats, end: Floats) -> Line:
        """Between (3,) points that are finite and read-only, as rows of `arrays.rows` are: a tenth of the time."""
        line = object.__new__(cls)
        object.__setattr__(line, "start", start)
        object.__setattr__(line, "end", end)
        return line

    def __repr__(self) -> str:
        return f"Line({brief(self.start)} to {brief(self.end)})"

    @property
    def length(self) -> float:
        """mm."""
        way = self.end - self.start
        return sqrt(way.dot(way))

    @property
    def bounds(self) -> Floats:
        """(2, 3): smallest and largest coordinates, mm."""
        ends = np.array([self.start, self.end])
        ends.sort(axis=0)
        return ends

    def position(self, t: ArrayLike) -> Floats:
        """(..., 3) mm at parameter t. The ends are hit exactly."""
        s = np.asarray(t, dtype=np.float64)[..., None]
        return np.asarray((1.0 - s) * self.start + s * self.end)

    def velocity(self, t: ArrayLike) -> Floats:
        """(..., 3) mm per unit of t."""
        shape = np.shape(t)
        return np.broadcast_to(self.end - self.start, (*shape, 3)).copy()

    def split(self, fractions: Sequence[float]) -> list[Line]:
        """Pieces between consecutive fractions (0 and 1 are added)."""
        points = self.position([0.0, *fractions, 1.0])
        return [Line(a, b) for a, b in pairwise(points)]


@dataclass(frozen=True, slots=True, eq=False)
class Arc:
    """Circle or helix about a coordinate direction.

    start, center : (3,) mm; the coordinate of `center` along `axis` is ignored.
    axis : 0, 1 or 2, the normal of the plane (YZ, ZX, XY).
    angle : rad, positive counter-clockwise seen from the positive end of the axis; may exceed a turn.
    rise : mm along the axis, proportional to the angle.
    """

    start: Floats
    center: Floats
    axis: int
    angle: float
    rise: float

    def __init__(
        self, start: ArrayLike, center: ArrayLike, axis: int = 2, *, angle: float, rise: float = 0.0
    ) -> None:
        if axis not in PLANE_AXES:
            raise ValueError(f"axis {axis} is not 0, 1 or 2")
        if not (np.isfinite(angle) and np.isfinite(rise)):
            raise ValueError("angle and rise must be finite")
        begin, middle = rows(start, 3, name="start"), np.array(rows(center, 3, name="center"))
        middle[axis] = begin[axis]
        middle.setflags(write=False)
        for name, value in (
            ("start", begin), ("center", middle), ("axis", axis), ("angle", float(angle)), ("rise", float(rise))
        ):  # fmt: skip
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        turned = f"{np.degrees(self.angle):.6g} degrees about {'xyz'[self.axis]}"
        return f"Arc({brief(self.start)} to {brief(self.end)}, {turned}, center {brief(self.center)})"

    @property
    def radius(self) -> float:
        """mm."""
        return float(np.linalg.norm(self.start - self.center))

    @property
    def end(self) -> Floats:
        """(3,) mm."""
        return self.position(1.0)

    @property
    def length(self) -> float:
        """mm along the helix."""
        return float(np.hypot(self.radius * self.angle, self.rise))

    @property
    def start_angle(self) -> float:
        """rad of the start point about the centre, from the first in-plane axis."""
        a, b = PLANE_AXES[self.axis]
        d = self.start - self.center
        return float(np.arctan2(d[b], d[a]))

    @property
    def bounds(self) -> Floats:
        """(2, 3): smallest and largest coordinates, mm."""
        quarter = np.pi / 2
        lo, hi = sorted((self.start_angle, self.start_angle + self.angle))
        turns = np.arange(np.ceil(lo / quarter), np.floor(hi / quarter) + 1) * quarter
        t = (turns - self.start_angle) / self.angle if self.angle else np.empty(0)
        points = self.position(np.concatenate([[0.0, 1.0], np.clip(t[:8], 0.0, 1.0)]))
        return np.stack([points.min(axis=0), points.max(axis=0)])

    def position(self, t: ArrayLike) -> Floats:
        """(..., 3) mm at parameter t."""
        s = np.asarray(t, dtype=np.float64)
        a, b = PLANE_AXES[self.axis]
        d = self.start - self.center
        cos, sin = np.cos(s * self.angle), np.sin(s * self.angle)
        out = np.empty((*s.shape, 3))
        out[..., a] = self.center[a] + cos * d[a] - sin * d[b]
        out[..., b] = self.center[b] + sin * d[a] + cos * d[b]
        out[..., self.axis] = self.start[self.axis] + s * self.rise
        return out

    def velocity(self, t: ArrayLike) -> Floats:
        """(..., 3) mm per unit of t."""
        r = self.position(t) - self.center
        a, b = PLANE_AXES[self.axis]
        out = np.empty_like(r)
        out[..., a] = -self.angle * r[..., b]
        out[..., b] = self.angle * r[..., a]
        out[..., self.axis] = self.rise
        return out

    def split(self, fractions: Sequence[float]) -> list[Arc]:
        """Pieces between consecutive fractions (0 and 1 are added)."""
        ts = [0.0, *fractions, 1.0]
        whole = self.angle, self.rise
        parts = [(self.position(a), [(b - a) * v for v in whole]) for a, b in pairwise(ts)]
        return [Arc(p, self.center, self.axis, angle=angle, rise=rise) for p, (angle, rise) in parts]


Path: TypeAlias = Line | Arc


def arc_between(
    start: ArrayLike, end: ArrayLike, center: ArrayLike, axis: int, *, ccw: bool, turns: int = 1
) -> Arc:
    """Arc through both programmed ends; equal in-plane ends mean a full circle.

    A programmed centre is rounded, so its distances to the two ends differ a little. The centre is moved
    onto the bisector of the ends (by at most the difference of the radii), so that the path meets both ends.

    start, end, center : (3,) mm
    axis : normal axis of the plane.
    ccw : counter-clockwise seen from the positive end of the axis.
    turns : 1 for up to a full circle; each further turn adds 2 pi.
    Raises ValueError: Start on the centre.
    """
    p, e, c = (rows(v, 3, name=n) for v, n in ((start, "start"), (end, "end"), (center, "center")))
    a, b = PLANE_AXES[axis]
    chord = np.array([e[a] - p[a], e[b] - p[b]])
    middle = np.array(c)
    distance = float(np.hypot(*chord))
    closed = distance < 1e-9
    if not closed:
        offset = float(np.dot([(p[a] + e[a]) / 2 - c[a], (p[b] + e[b]) / 2 - c[b]], chord)) / distance**2
        middle[a] += offset * chord[0]
        middle[b] += offset * chord[1]
    if np.hypot(p[a] - middle[a], p[b] - middle[b]) == 0.0:
        raise ValueError("the arc starts on its centre")
    angle = 2 * np.pi
    if not closed:
        begin = np.arctan2(p[b] - middle[b], p[a] - middle[a])
        finish = np.arctan2(e[b] - middle[b], e[a] - middle[a])
        angle = float((finish - begin if ccw else begin - finish) % (2 * np.pi))
    angle += 2 * np.pi * (turns - 1)
    return Arc(p, middle, axis, angle=angle if ccw else -angle, rise=float(e[axis] - p[axis]))


class RayIntervals(NamedTuple):
    """Where rays are inside a solid: intervals of ray i follow those of ray i - 1, in rising order.

    counts : (n,) intervals per ray. enter, leave : (sum of counts,) mm along the unit direction, from the
    origin; negative values lie behind it.
    """

    counts: Ints
    enter: Floats
    leave: Floats

    @property
    def lengths(self) -> Floats:
        """(n,) mm of every ray inside the solid."""
        ray = np.repeat(np.arange(len(self.counts)), self.counts)
        total = np.zeros(len(self.counts))
        np.add.at(total, ray, self.leave - self.enter)
        return total
