"""Where along a face of the meridian circles have grazing angles: a quadratic, linear in four scalars of the motion.

Symbols: V velocity of the tip, A axis, S = dA/dt; vv = |V - (A.V) A|^2, vs = V.S, ss = |S|^2, ll = (A.V)^2. On a circle with
normal (n_r, n_z) and kappa = h n_r - rho n_z

    a^2 + b^2 - c^2 = n_r^2 vv + 2 n_r kappa vs + kappa^2 ss - n_z^2 ll.

On a straight face kappa is linear in the share x of it; on an arc with centre (q, z) and normal (cos beta, sin beta) kappa is
z cos beta - q sin beta. So the difference is q0 + q1 x + q2 x^2, or q0 cos^2 + q1 cos sin + q2 sin^2 of beta, and each of the
three is a row of coefficients times (vv, vs, ss, ll): numbers, arrays over time, or values with bounds.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from vmachining.arrays import Floats
from vmachining.sweep.grazing.condition import Instant
from vmachining.tool import Profile, Segment


def whole_meridian(profile: Profile) -> list[Segment]:
    """Segments with the discs at both ends, from the axis at the bottom to the axis at the top."""
    nan = float("nan")
    (r0, z0), (r1, z1) = profile.points[0].tolist(), profile.points[-1].tolist()
    bottom = [Segment(0.0, z0, r0, z0, nan, nan, 0.0)] if r0 > 0.0 else []
    top = [Segment(r1, z1, 0.0, z1, nan, nan, 0.0)] if r1 > 0.0 else []
    return [*bottom, *profile.segments, *top]


def scalars(velocity: Floats, rate: Floats, axis: Floats) -> Floats:
    """vv, vs, ss, ll: (4,) of one instant (3,), or (4, n) of n of them (n, 3)."""
    lift = (velocity * axis).sum(axis=-1)
    across = velocity - lift[..., None] * axis
    return np.stack([
        (across * across).sum(axis=-1), (velocity * rate).sum(axis=-1), (rate * rate).sum(axis=-1), lift * lift
    ])  # fmt: skip


def circle_terms(n_r: float, n_z: float, kappa: float) -> Floats:
    """(4,) of one circle."""
    return np.array([n_r * n_r, 2.0 * n_r * kappa, kappa * kappa, -n_z * n_z])


def line_terms(s: Segment) -> Floats:
    """(3, 4) of a straight face, by the share x of it from its lower end."""
    d_r, d_z = s.r1 - s.r0, s.z1 - s.z0
    length = float(np.hypot(d_r, d_z))
    n_r, n_z = d_z / length, -d_r / length
    k0, k1 = s.z0 * n_r - s.r0 * n_z, length  # kappa along a line grows by its length
    return np.array([
        circle_terms(n_r, n_z, k0), [0.0, 2.0 * n_r * k1, 2.0 * k0 * k1, 0.0], [0.0, 0.0, k1 * k1, 0.0]
    ])  # fmt: skip


def arc_terms(q: float, z: float) -> Floats:
    """(3, 4) of an arc about (q, z), or of a sharp edge there."""
    return np.array([[1.0, 2.0 * z, z * z, 0.0], [0.0, -2.0 * q, -2.0 * q * z, 0.0], [0.0, 0.0, q * q, -1.0]])


def terms_of(s: Segment) -> Floats:
    """(3, 4) of a face."""
    return arc_terms(s.cr, s.cz) if s.is_arc else line_terms(s)


def grazing_stretches(segment: Segment, now: Instant) -> list[tuple[float, float]]:
    """Intervals of a meridian segment whose circles have two grazing angles, as (lo, hi) parameters.

    The parameter is the height (mm) on a line, the normal angle beta (rad) on an arc; a horizontal line is
    taken by its radius (mm). Ends are inside the segment.

    Ends are the roots of the quadratic of the face.
    """
    q0, q1, q2 = (terms_of(segment) @ scalars(now.velocity, now.axis_rate, now.axis)).tolist()
    if segment.is_arc:
        lo, hi = segment.beta
        cuts = [float(np.arctan2(s if c >= 0.0 else -s, abs(c))) for c, s in _directions((q0, q1, q2))]
    else:
        lo, hi = 0.0, 1.0
        cuts = [x / w for x, w in _directions((q2, q1, q0)) if w != 0.0]

    def two_sided(x: float) -> bool:
        first, second = (np.cos(x), np.sin(x)) if segment.is_arc else (1.0, x)
        return bool(q0 * first * first + q1 * first * second + q2 * second * second > 0.0)

    ends = [lo, *sorted(c for c in cuts if lo < c < hi), hi]
    found: list[tuple[float, float]] = []
    for p, q in pairwise(ends):
        if two_sided(0.5 * (p + q)):
            if found and found[-1][1] == p:
                p = found.pop()[0]
            found.append((p, q))
    if segment.is_arc:
        return found
    flat = segment.z0 == segment.z1
    start, end = (segment.r0, segment.r1) if flat else (segment.z0, segment.z1)
    places = [((1.0 - p) * start + p * end, (1.0 - q) * start + q * end) for p, q in found]
    return sorted((min(pair), max(pair)) for pair in places)


def _directions(form: tuple[float, float, float]) -> list[tuple[float, float]]:
    """Directions (x, w), w >= 0, with p x^2 + q x w + s w^2 = 0. None where the form is of one sign or zero."""
    p, q, s = form
    gap = q * q - 4.0 * p * s
    if gap < 0.0 or (p == 0.0 and q == 0.0 and s == 0.0):
        return []
    k = -0.5 * (q + np.copysign(np.sqrt(gap), q))  # no cancellation: x / w = k / p and s / k
    found = [(k, p), (s, k)] if k != 0.0 else [(0.0, 1.0)]
    return [(x, w) if w >= 0.0 else (-x, -w) for x, w in found if (x, w) != (0.0, 0.0)]
