"""Cutters as the kernels take them: the lower surface of a convex body of revolution, from the axis outward."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.columns.surface._kernels import profile as profile_at
from vmachining.tool import Profile, Segment

LINE, ARC, VERTEX = 0.0, 1.0, 2.0
"""Kinds of parts, see `surface/_kernels.py`."""

STEEPEST = 1e6
"""Slope from which a flank counts as upright: 1e-6 of its height is then left to the border of the footprint."""

FITS = 1e-9
"""Relative difference of slopes that are one: FIT_MM of the profiles."""


class Underside(NamedTuple):
    """Lower surface of a cutter as a convex function of the distance from its axis.

    head : (5,) number of parts, largest radius, 1 for a ball, height of its centre, 1 where cones occur.
    part : (parts, 8) kind, rho_a, rho_b, slope_a, slope_b, a, z, r.
    top : mm, greatest height above the tip at which the radius is still the largest: above it nothing is swept for
        sure.
    """

    head: Floats
    part: Floats
    top: float


def grown(profile: Profile, by: float) -> Profile:
    """A body that holds every point within `by` mm of the cutter or of what lies above it; negative: a body of which
    every point lies that deep inside the same.

    Scaled about the centre of a ball inside the body: (1 + by / reach) K = K + (by / reach) K holds K + ball(by), and K
    holds (1 - by / reach) K + ball(by).
    """
    if by == 0.0:
        return profile
    height, reach = _anchor(profile)
    return profile.shifted(-height).scaled(1.0 + by / reach).shifted(height)


def widened(profile: Profile, by: float) -> Profile:
    """The same for points that are `by` mm aside, at the same height: a cutter with a flat or round of its own moves
    outward, and keeps its height; any other is grown."""
    if profile.points[0, 0] <= abs(by) or not profile.is_convex:
        return grown(profile, by)
    aside = np.array([by, 0.0])
    return Profile(profile.points + aside, profile.centers + aside, profile.radii)


@lru_cache(maxsize=256)
def _anchor(profile: Profile) -> tuple[float, float]:
    """(height, radius) of a ball about the axis inside the body and what lies above it.

    Its distance to the support plane of normal beta in [-90, 0] degrees is sigma(beta) - z sin(beta). Between two
    sampled normals that falls by at most step^2 / 8 times the extent. Of all heights the one counts where the
    farthest plane is the fewest radii away.
    """
    beta = np.linspace(-0.5 * np.pi, 0.0, 361)
    cos, sin = np.cos(beta), np.sin(beta)
    r, z = profile.points.T
    support = (np.multiply.outer(cos, r) + np.multiply.outer(sin, z)).max(axis=1)
    for s in profile.segments:
        if s.is_arc:
            b0, b1 = s.beta
            here = (beta >= b0) & (beta <= b1)
            support[here] = np.maximum(support[here], cos[here] * s.cr + sin[here] * s.cz + s.radius)
    heights = profile.z_min + np.linspace(0.0, profile.widest_z - profile.z_min + profile.max_radius, 129)[1:]
    gap = support[:, None] - np.multiply.outer(sin, heights)
    reach = gap.min(axis=0) - 0.125 * (beta[1] - beta[0]) ** 2 * np.abs(gap).max(axis=0)
    cost = np.where(reach > 0.0, gap.max(axis=0) / np.maximum(reach, 1e-300), np.inf)
    best = int(cost.argmin())
    return float(heights[best]), float(reach[best])


@lru_cache(maxsize=256)
def underside(profile: Profile) -> Underside | None:
    """Parts of the lower surface; None for a body that is not convex."""
    if not profile.is_convex:
        return None
    parts: list[list[float]] = []
    rho, z, slope = 0.0, profile.z_min, 0.0
    if profile.points[0, 0] > 0.0:
        rho = float(profile.points[0, 0])
        parts.append([LINE, 0.0, rho, 0.0, 0.0, 0.0, z, 0.0])
    cones = 0.0
    for s in profile.segments:
        if s.beta[0] >= 0.0:
            break
        if s.is_arc:
            first, last = (_slope(s, e) for e in ((s.r0, s.z0), (s.r1, s.z1)))
            r1, last = (s.r1, last) if s.z1 < s.cz else (s.cr + s.radius, np.inf)
            piece = [ARC, rho, float(r1), first, float(last), s.cr, s.cz, s.radius]
        else:
            if s.r1 <= s.r0:
                break
            first = (s.z1 - s.z0) / (s.r1 - s.r0)
            if first > STEEPEST:
                break
            cones = 1.0
            piece = [LINE, rho, s.r1, first, first, 0.0, s.z0, 0.0]
        if first > slope + FITS * (1.0 + slope):
            parts.append([VERTEX, rho, rho, slope, first, 0.0, z, 0.0])
        parts.append(piece)
        rho, slope = piece[2], piece[4]
        z = s.z1
    if slope < np.inf:
        parts.append([VERTEX, rho, rho, slope, np.inf, 0.0, z, 0.0])
    ball = len(parts) == 1 and parts[0][0] == ARC and parts[0][5] == 0.0
    head = np.array([len(parts), rho, float(ball), parts[0][6] if ball else 0.0, cones])
    return Underside(head, np.array(parts), _top(profile))


def _slope(s: Segment, end: tuple[float, float]) -> float:
    """dz/dr of an arc at one of its ends below the centre."""
    fall = s.cz - end[1]
    return float((end[0] - s.cr) / fall) if fall > 0.0 else np.inf


def _top(profile: Profile) -> float:
    """Height up to which the body is as wide as anywhere."""
    top = profile.widest_z
    for s in profile.segments:
        if s.z0 >= top - 1e-12 and s.r0 == s.r1 == profile.max_radius:
            top = s.z1
    return float(top)


def lift(head: Floats, part: Floats, b: int, c: int) -> float:
    """How much higher cutter c must stand than cutter b at least to lie in b and what is above it; inf: it never does.

    Both surfaces rise with rho, so on a step of the radius b is no higher than at its end and c no lower than at its
    start.
    """
    if head[c, 1] > head[b, 1]:
        return float("inf")
    rho = head[c, 1] * np.sin(np.linspace(0.0, 0.5 * np.pi, 2001))
    rho[-1] = head[c, 1]
    upper = np.array([profile_at(head, part, b, r)[0] for r in rho[1:].tolist()])
    lower = np.array([profile_at(head, part, c, r)[0] for r in rho[:-1].tolist()])
    return float((upper - lower).max())
