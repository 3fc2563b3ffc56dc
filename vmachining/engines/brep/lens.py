"""Lenses: where a tilting flat face begins to rise (or ceases to fall) during a block, behind its rim.

A chord that lies inside the sweep (`grazes.py`) may be born on the rear of the rim: a lens of the face begins to
rise there. Nothing of this shows at first, because the first pose of the disc is still higher: the rear of the
rim comes out of that plane only where it is higher than the rim was, averaged over time,

    g(t, u) = (P(t, u) - P_0) . A_0 / t > 0,

a region of the sheet of the rim that ends at the last pose. Its border t(u) is smooth, as the birth is not. So

- the sheet of the rim between two fixed angles is trimmed along the border and the last pose;
- the last pose of the disc is kept between the rim and the line in which both poses meet;
- the first pose is a whole disc with a hole: border and line.

Where a lens that falls dies on the front of the rim, the same holds with time turned round. Then nothing has to
be cut in time. Lenses on the other side of the rim have borders that exist at all times (`Grazes.valley`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep.rings import Ring
from vmachining.engines.brep.stretches import Moving, State, angle, wave
from vmachining.sweep.grazing import across, folding, instant

__all__ = ["Lens", "lens_opens", "lens_span", "side_speed"]


class Lens(NamedTuple):
    """ring : of the disc. sign : pose at which the lens is open, 1 the last. lo, hi : rad, its ends there.

    foot, axis : (3,) plane of the other pose.
    """

    ring: int
    sign: int
    lo: float
    hi: float
    foot: Floats
    axis: Floats

    def border(self, moving: Moving, ring: Ring, u: Floats) -> Floats:
        """(n,) w at which the rim comes out of the plane of the other pose, by bisection."""
        closed, open_ = np.full(len(u), float(self.sign < 0)), np.full(len(u), float(self.sign > 0))
        for _ in range(50):
            w = 0.5 * (closed + open_)
            inside = self.height(moving.state(w), ring, u) > 0.0
            open_, closed = np.where(inside, w, open_), np.where(inside, closed, w)
        w = 0.5 * (closed + open_)
        ends = (u <= self.lo) | (u >= self.hi)
        return np.asarray(np.where(ends, float(self.sign > 0), w))

    def height(self, st: State, ring: Ring, u: Floats) -> Floats:
        """(n,) mm of points of the rim above the other pose of the disc, at n times and angles."""
        m = st.radial(u[:, None])[:, 0]
        return np.asarray((st.tip + ring.z * st.axis + ring.r * m - self.foot) @ self.axis * ring.disc)


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


def lens_span(st: State, disc: Ring, foot: Floats, axis: Floats) -> tuple[float, float] | None:
    """Angles between which the rim at one time is above the plane of another pose, None if it is nowhere."""
    p, q = (np.array(disc.r * float(e[0] @ axis) * disc.disc) for e in (st.x, st.y))
    o = np.array(float((st.tip[0] + disc.z * st.axis[0] - foot) @ axis) * disc.disc)
    lo, hi = (float(angle(p, q, o, side)) for side in (-1, 1))
    return None if np.isnan(lo) else (lo, hi)


def side_speed(st: State, side: Ring, u: Floats) -> Floats:
    """(m,) speed along the normal of the face beside a rim, at one time and angles (m,)."""
    one = np.ones((1, 1))
    a, b, c = (float(v[0, 0]) for v in wave(st, side.r * one, side.z * one, side.beta * one))
    return np.asarray(a * np.cos(u) + b * np.sin(u) + c)
