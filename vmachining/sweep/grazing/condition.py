"""The grazing condition, circle by circle.

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

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.geometry import Arc, Line, Path
from vmachining.sweep.grazing._kernels import speed
from vmachining.sweep.turning import Turn

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
        return self._replace(
            tip=self.tip + height * self.axis,
            velocity=self.velocity + height * self.axis_rate,
            acceleration=self.acceleration + height * self.axis_acceleration,
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

    @property
    def half(self) -> Floats:
        """rad: half of the egress arc, acos(-c / reach) from 0 (all trails) to pi; NaN on a circle that slides."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.arccos(np.clip(-self.c / self.reach, -1.0, 1.0)))


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
    place = (np.asarray(v, dtype=np.float64) for v in (h, rho, n_r, n_z))
    return circles_along(now.velocity, now.axis_rate, now.axis, across(now.axis), *place)


def circles_along(velocity: Floats, rate: Floats, axis: Floats, directions: tuple[Floats, Floats],
                  h: Floats, rho: Floats, n_r: Floats, n_z: Floats) -> Circles:  # fmt: skip
    """The same in given directions x, y across the axis.

    velocity, rate (dA/dt), axis, x, y : (3,) and circles (...,); or (n, 3) at n times and circles that broadcast to (n, m).
    """

    def part(vector: Floats, along: Floats) -> Floats:
        found: Floats = (vector * along).sum(axis=-1)
        return found[..., None] if vector.ndim > 1 else found

    lift = part(velocity, axis)
    a, b = (speed(h, rho, n_r, n_z, part(velocity, e), 0.0, part(rate, e)) for e in directions)
    return Circles(a, b, speed(h, rho, n_r, n_z, 0.0, lift, 0.0))


def normal_speed(of: Circles, u: ArrayLike) -> Floats:
    """f at angles u, rad: > 0 egress, < 0 ingress, 0 grazing."""
    angle = np.asarray(u, dtype=np.float64)
    return np.asarray(of.a * np.cos(angle) + of.b * np.sin(angle) + of.c)


def grazing_angles(of: Circles) -> Floats:
    """(..., 2) rad: where f = 0; NaN where the circle is one-sided or slides all round.

    f = c + r cos(u - heading), so u = heading -+ acos(-c / r); the egress arc lies between the two.
    """
    half = np.where(of.reach >= np.abs(of.c), of.half, np.nan)
    return np.stack([of.heading - half, of.heading + half], axis=-1)


def chord(now: Instant, height: float) -> tuple[float, Floats]:
    """The straight line along which a flat disc at a height grazes, whatever its radius.

    Returns d, along : float, (3,): Distance of the line from the axis, mm, measured along `along` = Adot / |Adot|; the
        line is square to it. Infinite where the disc is one-sided. NaN where the disc slides in its own plane, all of
        it.

    A point E + h A + x of the disc has f = n_z A . (V + dx) with x changing by the rotation: A . V - x . Adot
    = 0, the same line for top and bottom. `height` only says which disc: A . (V + h Adot) = A . V.
    """
    size, speed = float(np.linalg.norm(now.axis_rate)), float(now.velocity @ now.axis)
    scale = float(np.linalg.norm(now.velocity)) + abs(height) * size
    if size <= IDLE * scale:
        return (float("nan") if abs(speed) <= IDLE * scale else float("inf")), np.zeros(3)
    return speed / size, now.axis_rate / size


def folding(now: Instant, h: ArrayLike, rho: ArrayLike, n_r: ArrayLike, n_z: ArrayLike, u: ArrayLike,
            bend: ArrayLike) -> Floats:  # fmt: skip
    """Second time derivative of the distance to the body, at grazing points; < 0 is inside the sweep.

    h, rho, n_r, n_z, u : (...,) circle, normal and angle, as above.
    bend : curvature 1 / R of the meridian, 1 / mm, 0 on lines.

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
