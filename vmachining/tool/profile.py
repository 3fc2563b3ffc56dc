"""The meridian of a cutter: line and arc segments from the tip up, in the half plane (r, z).

Symbols: r, z radius and height, mm; beta angle of the outward normal above the horizontal, so that
n = (cos beta, sin beta); c, R centre and radius of an arc. z never falls along a profile, hence n_r >= 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.errors import ToolError

JOINT_RAD = 1e-9
"""Two directions closer than this are tangent; over 100 mm the chord between them is 1e-7 mm."""

FIT_MM = 1e-9
"""An arc's ends may be this far (relative to its radius, at least 1 mm) from its circle: LENGTH_EPS_MM."""


class Segment(NamedTuple):
    """One piece of a meridian, from bottom to top. `radius` 0 is a line; the centre is then NaN."""

    r0: float
    z0: float
    r1: float
    z1: float
    cr: float
    cz: float
    radius: float

    @property
    def is_arc(self) -> bool:
        return self.radius > 0.0

    @property
    def beta(self) -> tuple[float, float]:
        """rad: normal angle at the lower and at the upper end, in [-pi/2, pi/2]."""
        if self.is_arc:
            low = np.arctan2(self.z0 - self.cz, self.r0 - self.cr)
            return float(low), float(np.arctan2(self.z1 - self.cz, self.r1 - self.cr))
        flat = float(np.arctan2(self.r0 - self.r1, self.z1 - self.z0))
        return flat, flat

    def radius_at(self, z: float) -> float:
        """mm at a height inside the segment; the larger end if it is horizontal."""
        return float(self.radii_at(np.float64(z)))

    def radii_at(self, z: Floats | np.float64) -> Floats:
        """(...,) mm at heights, as if there were no ends."""
        if self.is_arc:
            return np.asarray(self.cr + np.sqrt(np.maximum(self.radius**2 - (z - self.cz) ** 2, 0.0)))
        if self.z1 == self.z0:
            return np.full(np.shape(z), max(self.r0, self.r1))
        share = (z - self.z0) / (self.z1 - self.z0)
        return np.asarray((1.0 - share) * self.r0 + share * self.r1)

    def cut(self, lo: float, hi: float) -> Segment:
        """The part between two heights inside it; the ends are kept bit for bit where they are not cut."""
        r0, z0 = (self.r0, self.z0) if lo <= self.z0 else (self.radius_at(lo), lo)
        r1, z1 = (self.r1, self.z1) if hi >= self.z1 else (self.radius_at(hi), hi)
        return self._replace(r0=r0, z0=z0, r1=r1, z1=z1)


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """Meridian of a body of revolution about z, from the bottom up. Lengths in mm.

    The body is the region between the axis and the profile, turned about the axis and closed by flat discs
    at both ends. Segments of zero length and horizontal steps at the very bottom and top (they are part of
    the discs) are removed, and consecutive horizontal steps become one.

    points : (m + 1, 2) float
        (r, z), r >= 0, z not falling.
    centers : (m, 2) float
        Centres of the arcs, NaN for lines.
    radii : (m,) float
        0 for a line, > 0 for an arc that bulges outward.

    Raises ToolError: Shapes that do not fit, values that are not finite, negative radii, falling heights, an arc that
        misses its ends, that is hollow or that turns back in height, a body without height or volume.
    """

    points: Floats
    centers: Floats
    radii: Floats

    def __init__(
        self, points: ArrayLike, centers: ArrayLike | None = None, radii: ArrayLike | None = None
    ) -> None:
        p = np.array(points, dtype=np.float64)
        if p.ndim != 2 or p.shape[1] != 2 or len(p) < 2:
            raise ToolError(f"profile: give at least two points (r, z), got an array of shape {p.shape}")
        m = len(p) - 1
        c = np.full((m, 2), np.nan) if centers is None else np.array(centers, dtype=np.float64)
        q = np.zeros(m) if radii is None else np.array(radii, dtype=np.float64)
        if c.shape != (m, 2) or q.shape != (m,):
            raise ToolError(f"profile: {m} segments need {m} centres and radii, got {c.shape} and {q.shape}")
        if not (np.isfinite(p).all() and np.isfinite(q).all() and np.isfinite(c[q > 0]).all()):
            raise ToolError("profile: every value must be finite")
        if (p[:, 0] < 0).any():
            raise ToolError(
                f"profile: radius {p[:, 0].min():g} mm is negative", remedy="r is measured from the axis"
            )
        if (q < 0).any():
            raise ToolError(f"profile: arc radius {q.min():g} mm is negative", remedy="arcs bulge outward")
        if (np.diff(p[:, 1]) < 0).any():
            k = int(np.argmax(np.diff(p[:, 1]) < 0))
            raise ToolError(
                f"profile: height falls from {p[k, 1]:g} to {p[k + 1, 1]:g} mm after point {k + 1}",
                remedy="list the points from the tip up; undercuts along the axis cannot be turned",
            )
        segments = _tidy(_segments(p, c, q))
        ends = [segments[0][:2], *(s[2:4] for s in segments)]
        for name, value in (
            ("points", np.array(ends)),
            ("centers", np.array([(s.cr, s.cz) if s.is_arc else (np.nan, np.nan) for s in segments])),
            ("radii", np.array([s.radius for s in segments])),
        ):
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    def __repr__(self) -> str:
        low, high = self.points[[0, -1], 1]
        arcs = int((self.radii > 0).sum())
        with_arcs = f", {arcs} arc{'s' if arcs > 1 else ''}" if arcs else ""
        return f"Profile(r up to {self.points[:, 0].max():.6g}, z {low:.6g} to {high:.6g}{with_arcs})"

    @classmethod
    def of(cls, segments: Sequence[Segment]) -> Profile:
        """Profile through consecutive segments; a step between two of them becomes a horizontal line."""
        points: list[tuple[float, float]] = [(segments[0].r0, segments[0].z0)]
        centers: list[tuple[float, float]] = []
        radii: list[float] = []
        for s in segments:
            if (s.r0, s.z0) != points[-1]:
                points.append((s.r0, s.z0))
                centers.append((np.nan, np.nan))
                radii.append(0.0)
            points.append((s.r1, s.z1))
            centers.append((s.cr, s.cz))
            radii.append(s.radius)
        return cls(points, centers, radii)

    @property
    def segments(self) -> tuple[Segment, ...]:
        """From the bottom up."""
        return tuple(_segments(self.points, self.centers, self.radii))

    @property
    def normals(self) -> Floats:
        """(m, 2, 2): unit outward normals (n_r, n_z) at the lower and at the upper end of every segment."""
        beta = np.array([s.beta for s in self.segments])
        return np.stack([np.cos(beta), np.sin(beta)], axis=-1)

    @property
    def z_min(self) -> float:
        """mm."""
        return float(self.points[0, 1])

    @property
    def z_max(self) -> float:
        """mm."""
        return float(self.points[-1, 1])

    @property
    def max_radius(self) -> float:
        """mm."""
        return self._widest()[0]

    @property
    def widest_z(self) -> float:
        """mm, lowest height at which the radius is largest."""
        return self._widest()[1]

    @property
    def volume(self) -> float:
        """mm^3, exact: pi times the integral of r^2 over the height."""
        total = 0.0
        for s in self.segments:
            h = s.z1 - s.z0
            if not s.is_arc:
                total += h * (s.r0**2 + s.r0 * s.r1 + s.r1**2) / 3.0
                continue
            u0, u1 = s.z0 - s.cz, s.z1 - s.cz  # r^2 = c^2 + 2 c sqrt(R^2 - u^2) + R^2 - u^2
            total += (s.cr**2 + s.radius**2) * h - (u1**3 - u0**3) / 3.0 + 2.0 * s.cr * _bulge(s)
        return np.pi * total

    @property
    def area(self) -> float:
        """mm^2, exact surface with both discs and all steps."""
        total = self.points[0, 0] ** 2 + self.points[-1, 0] ** 2
        for s in self.segments:
            if s.is_arc:
                b0, b1 = s.beta
                total += 2.0 * s.radius * (s.cr * (b1 - b0) + s.radius * (np.sin(b1) - np.sin(b0)))
            else:
                total += (s.r0 + s.r1) * np.hypot(s.r1 - s.r0, s.z1 - s.z0)
        return float(np.pi * total)

    @property
    def meridian_area(self) -> float:
        """mm^2, exact: 2 times the integral of r over the height, the shadow along a horizontal direction."""
        total = 0.0
        for s in self.segments:
            h = s.z1 - s.z0
            total += 2.0 * (s.cr * h + _bulge(s)) if s.is_arc else (s.r0 + s.r1) * h
        return total

    @property
    def is_convex(self) -> bool:
        """Whether the body is convex: the direction of the meridian only turns inward."""
        return not self._reflex()

    def radius_at(self, z: ArrayLike) -> Floats:
        """mm at every height; the larger one at a step, 0 below and above the body."""
        heights = np.asarray(z, dtype=np.float64)
        out = np.zeros(heights.shape)
        for s in self.segments:
            here = (heights >= s.z0) & (heights <= s.z1)
            out = np.where(here, np.maximum(out, s.radii_at(heights)), out)
        return out

    def clip(self, z_lo: float, z_hi: float) -> Profile:
        """The part between two heights.

        Raises ToolError: Nothing of the body lies between them.
        """
        if not max(z_lo, self.z_min) < min(z_hi, self.z_max):
            raise ToolError(
                f"profile: nothing between z {z_lo:g} and {z_hi:g} mm, "
                f"it spans {self.z_min:g} to {self.z_max:g} mm"
            )
        inside = [s for s in self.segments if s.z1 > z_lo and s.z0 < z_hi]
        return Profile.of([s.cut(z_lo, z_hi) for s in inside])

    def shifted(self, dz: float) -> Profile:
        """The same body, dz mm higher."""
        up = np.array([0.0, dz])
        return Profile(self.points + up, self.centers + up, self.radii)

    def scaled(self, factor: float) -> Profile:
        """The body enlarged about the origin."""
        return Profile(self.points * factor, self.centers * factor, self.radii * factor)

    def extruded(self, dz: float) -> Profile:
        """What a body whose radius first grows and then shrinks sweeps along its axis by dz mm (any sign).

        Raises ToolError: The body has a waist.
        """
        if not self.is_unimodal:
            raise ToolError("profile: only a body without a waist can be extruded along its axis")
        z, r = self.widest_z, self.max_radius
        low = [s.cut(self.z_min, z) for s in self.segments if s.z0 < z]
        high = [s.cut(z, self.z_max) for s in self.segments if s.z1 > z]
        down, up = min(dz, 0.0), max(dz, 0.0)
        middle = Segment(r, z + down, r, z + up, np.nan, np.nan, 0.0)
        return Profile.of([*(_lift(s, down) for s in low), middle, *(_lift(s, up) for s in high)])

    @property
    def is_unimodal(self) -> bool:
        """Whether the radius first grows and then shrinks with the height (no waist)."""
        shrunk = False
        for s in self.segments:
            b0, b1 = s.beta
            if shrunk and b0 < -JOINT_RAD:
                return False
            shrunk = shrunk or b1 > JOINT_RAD
        return True

    def convex_pieces(self) -> tuple[Profile, ...]:
        """Maximal convex runs from the bottom up; stacked, they touch along discs and fill the body."""
        bounds = [0, *self._reflex(), len(self.radii)]
        runs = [self.segments[a:b] for a, b in pairwise(bounds)]
        return tuple(Profile.of(run) for run in runs if run[0].z0 < run[-1].z1)

    @lru_cache(maxsize=1024)  # noqa: B019  profiles are few, small and asked for every block
    def _widest(self) -> tuple[float, float]:
        """(radius, lowest height) of the largest circle."""
        k = int(np.argmax(self.points[:, 0]))
        best, height = (float(v) for v in self.points[k])
        for s in self.segments:
            if s.is_arc and s.z0 < s.cz < s.z1 and s.cr + s.radius > best:
                best, height = s.cr + s.radius, s.cz
        return best, height

    @lru_cache(maxsize=1024)  # noqa: B019  see above
    def _reflex(self) -> tuple[int, ...]:
        """Indices of the points (as first segment above them) where the meridian turns outward."""
        beta = [s.beta for s in self.segments]
        pairs = enumerate(pairwise(beta), 1)
        return tuple(k for k, (below, above) in pairs if above[0] < below[1] - JOINT_RAD)


def _bulge(s: Segment) -> float:
    """Integral of sqrt(R^2 - (z - c_z)^2) over the height of an arc, mm^2."""
    b0, b1 = s.beta
    return s.radius**2 / 2.0 * (b1 - b0 + float(np.sin(b1) * np.cos(b1) - np.sin(b0) * np.cos(b0)))


def _segments(points: Floats, centers: Floats, radii: Floats) -> list[Segment]:
    rows = np.column_stack([points[:-1], points[1:], centers, radii]).tolist()
    return [Segment._make(row) for row in rows]


def _lift(s: Segment, dz: float) -> Segment:
    return s._replace(z0=s.z0 + dz, z1=s.z1 + dz, cz=s.cz + dz)


def _tidy(segments: list[Segment]) -> list[Segment]:
    """Drop what has no length, merge horizontal steps, strip them at the ends; check the arcs."""
    out: list[Segment] = []
    for s in segments:
        if (s.r0, s.z0) == (s.r1, s.z1) and not s.is_arc:
            continue
        if s.is_arc:
            if np.hypot(s.r1 - s.r0, s.z1 - s.z0) <= 1e-14 * s.radius:
                continue
            _check_arc(s)
        elif s.z0 == s.z1 and out and out[-1].z0 == out[-1].z1:
            s = out.pop()._replace(r1=s.r1)
        out.append(s)
    while out and out[0].z0 == out[0].z1:
        out.pop(0)
    while out and out[-1].z0 == out[-1].z1:
        out.pop()
    if not out:
        raise ToolError("profile: the body has no height", remedy="give at least two heights")
    if not any(s.is_arc or s.r0 > 0.0 or s.r1 > 0.0 for s in out):
        raise ToolError("profile: the body has no volume", remedy="give at least one radius above zero")
    while (
        out[0].r0 == out[0].r1 == 0.0 and not out[0].is_arc
    ):  # on the axis: corners end there up to rounding
        out.pop(0)
    return out


def _check_arc(s: Segment) -> None:
    where = f"arc from ({s.r0:g}, {s.z0:g}) to ({s.r1:g}, {s.z1:g})"
    slack = FIT_MM * max(s.radius, 1.0)
    for r, z in ((s.r0, s.z0), (s.r1, s.z1)):
        miss = abs(np.hypot(r - s.cr, z - s.cz) - s.radius)
        if miss > slack:
            raise ToolError(f"profile: {where} misses its circle of radius {s.radius:g} mm by {miss:.3g} mm")
    if min(s.r0, s.r1) < s.cr - slack or not s.z1 > s.z0:
        raise ToolError(
            f"profile: {where} is hollow or turns back in height",
            remedy="an arc must bulge outward and rise; split it or use line segments",
        )


@lru_cache(maxsize=256)
def convex_cover(profile: Profile) -> tuple[Profile, ...]:
    """Convex bodies whose union is the body and whose interiors overlap across every split.

    Each run of `profile.convex_pieces()` is prolonged along its end tangents as far as it stays inside its
    neighbours. A union of signed distances then has no false zero on the discs between the runs.


    Where the meridian turns outward, the tangent of either side continues inside the other one; at a step
    only the narrower side continues into the wider one. The neighbour's radius is a concave function of z,
    so radius minus tangent has at most one sign change, and a bisection finds how far the tangent is good.
    """
    pieces = profile.convex_pieces()
    out = []
    for k, piece in enumerate(pieces):
        segments = list(piece.segments)
        if k + 1 < len(pieces):
            top = _prolong(segments[-1], pieces[k + 1], up=True)
            segments += [top] if top else []
        if k > 0:
            bottom = _prolong(segments[0], pieces[k - 1], up=False)
            segments = ([bottom] if bottom else []) + segments
        out.append(Profile.of(segments))
    return tuple(out)


def _prolong(s: Segment, host: Profile, *, up: bool) -> Segment | None:
    """Line that continues a segment's end into `host`, or None where it leaves it at once."""
    r, z = (s.r1, s.z1) if up else (s.r0, s.z0)
    beta = s.beta[1 if up else 0]
    if np.cos(beta) < 1e-6 or r > float(host.radius_at(z)) * (1.0 + 1e-12):
        return None  # a horizontal end has no height to grow; the wider side of a step has no room to
    slope = -float(np.tan(beta))  # dr/dz
    far = host.z_max if up else host.z_min

    def fits(height: float) -> bool:
        line = r + slope * (height - z)
        return 0.0 <= line <= float(host.radius_at(height))

    good, bad = z, far
    if fits(far):
        good = far
    else:
        for _ in range(60):
            middle = 0.5 * (good + bad)
            good, bad = (middle, bad) if fits(middle) else (good, middle)
    if abs(good - z) < 1e-9 * max(1.0, abs(far - z)):
        return None
    end = max(r + slope * (good - z), 0.0)
    nan = float("nan")
    return Segment(r, z, end, good, nan, nan, 0.0) if up else Segment(end, good, r, z, nan, nan, 0.0)
