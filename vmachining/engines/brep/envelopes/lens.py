"""Lenses: where a tilting flat face begins to rise (or ceases to fall) during a block, behind its rim.

A chord that lies inside the sweep (`grazing_curve.py`) may be born on the rear of the rim: a lens of the face begins to
rise there. Nothing of this shows at first, because the first pose of the disc is still higher: the rear of the
rim comes out of that plane only where it is higher than the rim was, averaged over time,

    g(t, u) = (P(t, u) - P_0) . A_0 / t > 0,

a region of the sheet of the rim that ends at the last pose. Its border t(u) is smooth, as the birth is not. So

- the sheet of the rim between two fixed angles is trimmed along the border and the last pose;
- the last pose of the disc is kept between the rim and the line in which both poses meet;
- the first pose is a whole disc with a hole: border and line.

Where a lens that falls dies on the front of the rim, the same holds with time turned round. Then nothing has to
be cut in time. Lenses on the other side of the rim have borders that exist at all times (`GrazingCurve.valley`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep.envelopes.rings import Ring
from vmachining.engines.brep.envelopes.segments import Moving, State, angle, wave
from vmachining.sweep.grazing import Circles, across, folding, instant, normal_speed


class Lens(NamedTuple):
    """ring : of the disc. sign : pose at which the lens is open, 1 the last. lo, hi : rad, its ends there.

    axis : (3,) of the other pose, normal of its plane.
    """

    ring: int
    sign: int
    lo: float
    hi: float
    axis: Floats

    def border(self, moving: Moving, ring: Ring, u: Floats) -> Floats:
        """(n,) w at which the rim comes out of the plane of the other pose, by bisection."""
        closed, open_ = np.full(len(u), float(self.sign < 0)), np.full(len(u), float(self.sign > 0))
        for _ in range(50):
            w = 0.5 * (closed + open_)
            inside = self.rise(moving, w, ring, u) * self.sign > 0.0
            open_, closed = np.where(inside, w, open_), np.where(inside, closed, w)
        w = 0.5 * (closed + open_)
        ends = (u <= self.lo) | (u >= self.hi)
        return np.asarray(np.where(ends, float(self.sign > 0), w))

    def rise(self, moving: Moving, w: Floats, ring: Ring, u: Floats) -> Floats:
        """(n,) mm per unit of time by which points of the rim have risen out of the other pose, n times and angles."""
        st = moving.state(w)
        return normal_speed(risen(moving, st, float(self.sign < 0), self.axis, ring), u)


def risen(moving: Moving, st: State, t0: float, axis: Floats, disc: Ring) -> Circles:
    """a, b, c (n,): a cos u + b sin u + c is how fast the rim has left the pose at t0, whose axis is given.

    Height above the plane of that pose over the time since then, mm per unit of t; at t0 itself the speed along the
    normal of the disc. Its zeros are those of the height, but for the one at t0, and keep their digits next to it.
    """
    velocity, rate = moving.means(t0, st.t)
    p, q = (-disc.disc * disc.r * (e * rate).sum(1) for e in (st.x, st.y))
    return Circles(p, q, np.asarray(disc.disc * (velocity + disc.z * rate) @ axis))


def lens_opens(moving: Moving, t: float, disc: Ring, side: Ring) -> bool:
    """Whether the chord that is born or dies on a sharp rim at t is one of a lens."""
    now = instant(moving.path, t)
    lift, size = float(now.velocity @ now.axis) * disc.disc, float(np.linalg.norm(now.axis_rate))
    if size == 0.0:
        return False
    rising = lift < 0.0  # all of the disc falls but for a point
    # f = lift - disc r m.S: its extreme is at m = -+ S / |S|
    m = now.axis_rate / size * (-disc.disc if rising else disc.disc)
    speed = float((now.velocity + side.z * now.axis_rate) @ m) * np.cos(side.beta)
    speed += np.sin(side.beta) * (lift * disc.disc - side.r * float(now.axis_rate @ m))
    x, y = across(now.axis)
    u = np.array([np.arctan2(m @ y, m @ x)])
    one = np.ones(1)
    fold = folding(now, disc.z * one, disc.r * one, 0.0 * one, disc.disc * one, u, 0.0 * one)
    return bool(fold[0] < 0.0 and (speed < 0.0) == rising)


def lens_span(moving: Moving, sign: int, disc: Ring, axis: Floats) -> tuple[float, float] | None:
    """Angles between which the rim of the open pose is above the plane of the other one, None if it is nowhere."""
    t0 = float(sign < 0)
    above = Circles(*(sign * v for v in risen(moving, moving.state(np.array([1.0 - t0])), t0, axis, disc)))
    lo, hi = (float(angle(above, side)[0]) for side in (-1, 1))
    return None if np.isnan(lo) else (lo, hi)


def side_speed(st: State, side: Ring, u: Floats) -> Floats:
    """(m,) speed along the normal of the face beside a rim, at one time and angles (m,)."""
    one = np.ones((1, 1))
    return np.asarray(normal_speed(wave(st, side.r * one, side.z * one, side.beta * one), u)[0])
