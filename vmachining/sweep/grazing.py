"""Where a moving cutter slides along its own envelope, circle by circle.

Symbols: at one time E = c is the point of reference (the tip), A the axis, V velocity of E, Adot = dA/dt.
A circle of the body has height h above E, radius rho and unit outward normal n = (n_r, n_z) in the meridian;
its points are E + h A + rho m(u) with m(u) = cos u x + sin u y, (x, y, A) right-handed. kappa = h n_r - rho n_z.

The speed of the surface along its own normal is

    f(u) = a cos u + b sin u + c,   (a, b) = (n_r V + kappa Adot) . (x, y),   c = n_z V . A

f > 0 egress (leading, new material), f < 0 ingress (trailing), f = 0 grazing. Two angles where
hypot(a, b) > |c|, one where equal, none where smaller, all where both vanish. kappa / n_r is the height at
which the normals of the circle meet the axis, so f depends on the velocity there only.

Source: the toroidal and cylindrical equations of Weinert, Du, Damm, Stautner, Int. J. Mach. Tools Manuf. 44
(2004) 617-628, see `weinert.py`; this form covers any surface of revolution and needs no moving frame.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Bools, Floats
from vmachining.geometry import Arc, Line, Path
from vmachining.sweep.turning import Turn
from vmachining.tool import Profile, Segment

__all__ = [
    "Circles",
    "Instant",
    "across",
    "chord",
    "circles",
    "edge_open",
    "folding",
    "front_flux",
    "grazing_angles",
    "grazing_stretches",
    "instant",
    "normal_speed",
]

ON_AXIS = 1e-9
"""mm: a point this close to the axis is on it."""

IDLE = 1e-13
"""hypot(a, b) and |c| below this share of the largest speed of the body count as zero: the circle slides."""


class Instant(NamedTuple):
    """A motion at one time (or at n times, with one more leading dimension). All (3,), mm and per unit of t."""

    tip: Floats
    axis: Floats
    velocity: Floats
    axis_rate: Floats
    acceleration: Floats
    axis_acceleration: Floats

    def lifted(self, height: float) -> Instant:
        """The same motion referred to the point of the axis at a height above the tip."""
        return Instant(
            self.tip + height * self.axis,
            self.axis,
            self.velocity + height * self.axis_rate,
            self.axis_rate,
            self.acceleration + height * self.axis_acceleration,
            self.axis_acceleration,
        )


class Circles(NamedTuple):
    """f(u) = a cos u + b sin u + c on circles of the body, each (...,), in the directions of `across`."""

    a: Floats
    b: Floats
    c: Floats

    @property
    def reach(self) -> Floats:
        """hypot(a, b)."""
        return np.hypot(self.a, self.b)

    @property
    def heading(self) -> Floats:
        """rad: the angle of the largest f, middle of the egress arc."""
        return np.arctan2(self.b, self.a)


def instant(path: Path | Turn, t: float) -> Instant:
    """State of any motion at t in [0, 1]."""
    if isinstance(path, Turn):
        return Instant(
            path.position(t), path.axis(t), path.velocity(t),
            path.axis_rate(t), path.acceleration(t), path.axis_acceleration(t),
        )  # fmt: skip
    zero, bend = np.zeros(3), np.zeros(3)
    if isinstance(path, Arc):
        bend = -(path.angle**2) * (path.position(t) - path.center)
        bend[path.axis] = 0.0
    assert isinstance(path, Line | Arc)
    return Instant(path.position(t), np.array([0.0, 0.0, 1.0]), path.velocity(t), zero, bend, zero)


def across(axis: ArrayLike) -> tuple[Floats, Floats]:
    """Unit vectors x, y (3,) with (x, y, A) right-handed. They do not depend on the motion."""
    A = np.asarray(axis, dtype=np.float64)
    x = np.eye(3)[0] - A[0] * A if abs(A[0]) < 0.9 else np.eye(3)[1] - A[1] * A
    x /= np.linalg.norm(x)
    return x, np.cross(A, x)


def circles(now: Instant, h: ArrayLike, rho: ArrayLike, n_r: ArrayLike, n_z: ArrayLike) -> Circles:
    """Grazing function of circles (...,) at one instant; lengths in mm, normals of length one."""
    x, y = across(now.axis)
    height, radius, out, up = (np.asarray(v, dtype=np.float64) for v in (h, rho, n_r, n_z))
    kappa = height * out - radius * up
    a = out * (now.velocity @ x) + kappa * (now.axis_rate @ x)
    b = out * (now.velocity @ y) + kappa * (now.axis_rate @ y)
    return Circles(a, b, up * float(now.velocity @ now.axis))


def normal_speed(of: Circles, u: ArrayLike) -> Floats:
    """f at angles u, rad: > 0 egress, < 0 ingress, 0 grazing."""
    angle = np.asarray(u, dtype=np.float64)
    return np.asarray(of.a * np.cos(angle) + of.b * np.sin(angle) + of.c)


def grazing_angles(of: Circles) -> Floats:
    """(..., 2) rad: where f = 0; NaN where the circle is one-sided or slides all round.

    Notes
    -----
    f = c + r cos(u - heading), so u = heading -+ acos(-c / r); the egress arc lies between the two.
    """
    r = of.reach
    with np.errstate(divide="ignore", invalid="ignore"):
        half = np.where((r >= np.abs(of.c)) & (r > 0.0), np.arccos(np.clip(-of.c / r, -1.0, 1.0)), np.nan)
    return np.stack([of.heading - half, of.heading + half], axis=-1)


def front_flux(reach: ArrayLike, c: ArrayLike) -> Floats:
    """Integral of max(f, 0) over u in [0, 2 pi]: 2 (r sin w + c w), w = acos(-c / r) half the egress arc."""
    r, offset = np.asarray(reach, dtype=np.float64), np.asarray(c, dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        half = np.arccos(np.clip(-offset / r, -1.0, 1.0))
    two_sided = 2.0 * (np.sqrt(np.maximum(r * r - offset * offset, 0.0)) + offset * half)
    return np.asarray(np.where(r > np.abs(offset), two_sided, 2.0 * np.pi * np.maximum(offset, 0.0)))


def chord(now: Instant, height: float) -> tuple[float, Floats]:
    """The straight line along which a flat disc at a height grazes, whatever its radius.

    Returns
    -------
    d, along : float, (3,)
        Distance of the line from the axis, mm, measured along `along` = Adot / |Adot|; the line is square to
        it. Infinite where the disc is one-sided. NaN where the disc slides in its own plane, all of it.

    Notes
    -----
    A point E + h A + x of the disc has f = n_z A . (V + dx) with x changing by the rotation: A . V - x . Adot
    = 0, the same line for top and bottom. `height` only says which disc: A . (V + h Adot) = A . V.
    """
    size, speed = float(np.linalg.norm(now.axis_rate)), float(now.velocity @ now.axis)
    scale = float(np.linalg.norm(now.velocity)) + abs(height) * size
    if size <= IDLE * scale:
        return (float("nan") if abs(speed) <= IDLE * scale else float("inf")), np.zeros(3)
    return speed / size, now.axis_rate / size


def edge_open(first: Circles, second: Circles, u: ArrayLike) -> Bools:
    """Whether points of a convex edge belong to the grazing set: some normal of their fan has f = 0.

    first, second : the edge with the normals of its two neighbours. The arc ends where either is zero.
    """
    return np.asarray(normal_speed(first, u) * normal_speed(second, u) <= 0.0)


def grazing_stretches(segment: Segment, now: Instant) -> list[tuple[float, float]]:
    """Stretches of a meridian segment whose circles have two grazing angles, as (lo, hi) parameters.

    The parameter is the height (mm) on a line, the normal angle beta (rad) on an arc; a horizontal line is
    taken by its radius (mm). Ends are inside the segment.

    Notes
    -----
    hypot(a, b)^2 - c^2 is a quadratic. Arcs: with n = (cos beta, sin beta) and centre (q, z), kappa =
    z cos beta - q sin beta, hence |cos beta (W + z Adot) - sin beta q Adot|^2 - sin^2 beta (A . V)^2, a
    quadratic form in (cos beta, sin beta). W is V without its part along A.
    """
    lift, spin = float(now.velocity @ now.axis), now.axis_rate
    side = now.velocity - lift * now.axis
    if segment.is_arc:
        base = side + segment.cz * spin
        form = (
            float(base @ base),
            -2.0 * segment.cr * float(base @ spin),
            segment.cr**2 * float(spin @ spin) - lift**2,
        )
        lo, hi = segment.beta
        cuts = [float(np.arctan2(s if c >= 0.0 else -s, abs(c))) for c, s in _directions(form)]
    else:
        n_r, n_z = np.cos(segment.beta[0]), np.sin(segment.beta[0])
        flat = segment.z0 == segment.z1
        lo, hi = sorted((segment.r0, segment.r1)) if flat else (segment.z0, segment.z1)
        slope = 0.0 if flat else (segment.r1 - segment.r0) / (segment.z1 - segment.z0)
        # kappa = k0 + k1 x along the segment
        k1 = -n_z if flat else n_r - slope * n_z
        k0 = segment.z0 * n_r if flat else -(segment.r0 - slope * segment.z0) * n_z
        base = n_r * side + k0 * spin
        form = (
            k1 * k1 * float(spin @ spin), 2.0 * k1 * float(base @ spin), float(base @ base) - (n_z * lift) ** 2
        )  # fmt: skip
        cuts = [x / w for x, w in _directions(form) if w != 0.0]

    def two_sided(x: float) -> bool:
        first, second = (np.cos(x), np.sin(x)) if segment.is_arc else (x, 1.0)
        return bool(np.dot(form, (first * first, first * second, second * second)) > 0.0)

    ends = [lo, *sorted(c for c in cuts if lo < c < hi), hi]
    out: list[tuple[float, float]] = []
    for p, q in pairwise(ends):
        if two_sided(0.5 * (p + q)):
            if out and out[-1][1] == p:
                p = out.pop()[0]
            out.append((p, q))
    return out


def folding(now: Instant, h: ArrayLike, rho: ArrayLike, n_r: ArrayLike, n_z: ArrayLike, u: ArrayLike,
            bend: ArrayLike) -> Floats:  # fmt: skip
    """Second time derivative of the distance to the body, at grazing points; < 0 is inside the sweep.

    Parameters
    ----------
    h, rho, n_r, n_z, u : (...,) circle, normal and angle, as above.
    bend : curvature 1 / R of the meridian, 1 / mm, 0 on lines.

    Notes
    -----
    phi_tt = k_m (V_P . t_m)^2 + k_p (V_P . t_u)^2 + N . (2 omega x V_P - a_P), k_m = bend, k_p = n_r / rho,
    t_m and t_u tangents along the meridian and around; k_p = k_m on the axis. Positive: the body was outside just before and is
    just after, a true boundary; negative: it leaves on both sides of t, so the sheet lies inside.
    """
    x, y = across(now.axis)
    A = now.axis
    height, radius, out, up, angle = (
        np.asarray(v, dtype=np.float64)[..., None] for v in (h, rho, n_r, n_z, u)
    )
    m = np.cos(angle) * x + np.sin(angle) * y
    around = np.cos(angle) * y - np.sin(angle) * x
    normal, tangent, arm = out * m + up * A, out * A - up * m, height * A + radius * m
    omega, alpha = np.cross(A, now.axis_rate), np.cross(A, now.axis_acceleration)
    speed = now.velocity + np.cross(omega, arm)
    rush = now.acceleration + np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))
    with np.errstate(divide="ignore", invalid="ignore"):
        ring = np.where(radius[..., 0] > ON_AXIS, out[..., 0] / radius[..., 0], bend)
    sideways = (speed * tangent).sum(-1) ** 2 * np.asarray(bend) + (speed * around).sum(-1) ** 2 * ring
    return np.asarray(sideways + (normal * (2.0 * np.cross(omega, speed) - rush)).sum(-1))


def discs(profile: Profile) -> list[tuple[float, float, float]]:
    """(height, radius, n_z) of the flat ends of a body."""
    (r0, z0), (r1, z1) = profile.points[0], profile.points[-1]
    ends = [(float(z0), float(r0), -1.0), (float(z1), float(r1), 1.0)]
    return [d for d in ends if d[1] > 0.0]


def _directions(form: tuple[float, float, float]) -> list[tuple[float, float]]:
    """Directions (x, w), w >= 0, with p x^2 + q x w + s w^2 = 0. None where the form is of one sign or zero."""
    p, q, s = form
    gap = q * q - 4.0 * p * s
    if gap < 0.0 or (p == 0.0 and q == 0.0 and s == 0.0):
        return []
    k = -0.5 * (q + np.copysign(np.sqrt(gap), q))  # no cancellation: x / w = k / p and s / k
    found = [(k, p), (s, k)] if k != 0.0 else [(0.0, 1.0)]
    return [(x, w) if w >= 0.0 else (-x, -w) for x, w in found if (x, w) != (0.0, 0.0)]
