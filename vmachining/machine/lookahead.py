"""How fast a machine drives a whole path: speeds at corners, then one pass back and one forward (`_lookahead.py`).

Joints q(s) change their direction p = dq/ds at a border within h before it and after it, and the path misses the corner of the
slides by e at most, within half of the shorter block l. With D = p2 - p1 of the slides and c = cos(alpha / 2) of their turn

    2 h = min(l, 4 e (1 + c) / |D|),    v^2 <= 2 h c min(A / |D|, a_j / |D_j|)             (1)

which for unit directions, |D| = 2 sin(alpha / 2), is the circle of radius e c / (1 - c) within the corner. So chords that stand
for an arc cost what the arc costs, a reversal is a stop, and rotary joints have v^2 <= l a / |D_j|.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import KinematicsError
from vmachining.machine import _lookahead


def ramp_s(change: float, acceleration: float, jerk: float) -> float:
    """Seconds of a change of speed d under acceleration a with jerk j.

    T(d) = d / a + a / j if d >= a^2 / j, else 2 sqrt(d / j); being symmetric, it covers (v0 + v1) T / 2.
    """
    if change <= 0.0:
        return 0.0
    if change >= acceleration * acceleration / jerk:
        return change / acceleration + acceleration / jerk
    return 2.0 * float(np.sqrt(change / jerk))


def rest_to_rest_s(
    length: float, speed: float, acceleration: float, jerk: float, v0: float = 0.0, v1: float = 0.0
) -> float:
    """Seconds from speed v0 to v1 over a length, both ends without acceleration."""

    def covered(v: float) -> float:
        up, down = ramp_s(v - v0, acceleration, jerk), ramp_s(v - v1, acceleration, jerk)
        return 0.5 * ((v0 + v) * up + (v + v1) * down)

    low = max(v0, v1)
    if covered(speed) <= length:
        v = speed
    elif covered(low) >= length:
        v = low  # too short for the change itself: what the passes left is not reached, its time is the least
    else:
        from scipy.optimize import brentq  # half a second to load, for few feeds

        v = float(brentq(lambda x: covered(x) - length, low, speed, xtol=1e-12 * speed))
    ramps = ramp_s(v - v0, acceleration, jerk) + ramp_s(v - v1, acceleration, jerk)
    return ramps + max(length - covered(v), 0.0) / v


def add_jerk(
    length: Floats, seconds: Floats, border: Floats, peak: Floats, push: Floats, jerk: float
) -> Floats:
    """(n,) seconds with a limited jerk, from those without one.

    Stretches between two lowest speeds are driven as one: up, along, down, with the largest acceleration that their blocks
    have in common and no faster than their time-weighted speed; the extra time is given to their blocks in proportion.
    """
    out = seconds.copy()
    n = len(length)
    low = [0]
    for k in range(1, n):
        rests = border[k] <= min(peak[k - 1], peak[k]) * (1.0 - 1e-9)
        if rests and border[k] <= border[k - 1] and border[k] <= border[k + 1]:
            low.append(k)
    low.append(n)
    for a, b in pairwise(low):
        span, took = float(length[a:b].sum()), float(seconds[a:b].sum())
        if took <= 0.0:
            continue
        accel, top = float(push[a:b].min()), float(peak[a:b].max())
        if accel >= 1e11:
            accel = top / took * 1e3
        v0, v1 = float(border[a]), float(border[b])
        plain = rest_to_rest_s(span, top, accel, 1e15, v0, v1)
        limited = rest_to_rest_s(span, top, accel, jerk, v0, v1)
        out[a:b] *= 1.0 + max(limited - plain, 0.0) / took
    return out


AT_ONCE = 1e12
"""mm/s^2; takes a nanosecond to a metre per second."""

TANGENT = 1e-3
"""Half of the turn, rad, up to which a border is not a corner on exact paths: arcs of programs are rounded."""


SHALLOW = 0.26
"""sin of half a turn of 30 degrees: chords that turn further represent no arc."""

EQUAL = 0.99
"""A neighbour that is shorter by no more than this share leaves no straight part of a chord between two roundings."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Way:
    """n blocks that move, in order.

    length : (n,) mm. speed : (n,) mm/s allowed: feed and what the joints can do. tangent : (n, m) dq/ds of the joints at
    the start, slides X, Y, Z first, or the tip's in their place. turned : (n,) rad of an arc about slide normal (n,), 0 of a
    line. halt : (n,) whether everything stops at the end. tolerance : (n,) mm at the corner at the end; inf: only half of
    the shorter block.
    push : (n,) mm/s^2 along a block by its joints, where the tangent (of the tip) is not that of the slides; else inf.
    span : (n,) mm of the block that a piece belongs to, where blocks are given in pieces; None: length.
    leaving : (n, 3) dq/ds of the slides at the end where it follows from nothing else, NaN elsewhere; None: nowhere.
    """

    length: Floats
    speed: Floats
    tangent: Floats
    turned: Floats
    normal: Ints
    halt: Bools
    tolerance: Floats
    push: Floats
    span: Floats | None = None
    leaving: Floats | None = None

    def __post_init__(self) -> None:
        if not (self.length > 0.0).all() or not (self.speed > 0.0).all():
            raise KinematicsError("blocks of a path need a length and a speed above 0")
        if not (self.tolerance >= 0.0).all():
            raise KinematicsError("corner tolerance below 0")

    def end_tangent(self) -> Floats:
        """(n, m) dq/ds at the end."""
        out = self.tangent.copy()
        k = np.flatnonzero(self.turned != 0.0)
        a, b = (self.normal[k] + 1) % 3, (self.normal[k] + 2) % 3
        cos, sin = np.cos(self.turned[k]), np.sin(self.turned[k])
        out[k, a] = cos * self.tangent[k, a] - sin * self.tangent[k, b]
        out[k, b] = sin * self.tangent[k, a] + cos * self.tangent[k, b]
        if self.leaving is not None:
            out[:, :3] = np.where(np.isnan(self.leaving), out[:, :3], self.leaving)
        return out


@dataclass(frozen=True, slots=True, eq=False)
class Profile:
    """seconds, peak (mm/s) : (n,). border : (n + 1,) mm/s between the blocks. corner : (n + 1,) what corners allow."""

    seconds: Floats
    peak: Floats
    border: Floats
    corner: Floats


def drive(
    way: Way, *, whole: Floats | float = np.inf, axes: Floats | None = None, jerk: float = np.inf
) -> Profile:
    """Fastest way along a path within the limits.

    whole : mm/s^2 along and across the path, of all blocks or (n,); arcs share the least of theirs. axes : (m,) mm/s^2 or
    rad/s^2 of the joints. jerk : mm/s^3 along the path.
    """
    n, m = way.tangent.shape
    limit = np.full(m, np.inf) if axes is None else np.asarray(axes, dtype=np.float64)
    size = np.abs(way.tangent)
    by_axis = np.divide(limit, size, out=np.full((n, m), np.inf), where=size > _lookahead.FLAT)
    by_axis[np.isfinite(way.push), :3] = np.inf
    whole = np.broadcast_to(np.minimum(whole, AT_ONCE), n)
    push = np.minimum(np.minimum(by_axis.min(axis=1), way.push), whole)
    corner, rounded = _corners(way, whole, limit)
    speed = np.minimum(way.speed, np.sqrt(rounded))
    # along and across at most A each: slides of the plane that do sqrt(2) A never bind, and such an arc is driven like a line
    k = np.arange(n)
    first, second = (way.normal + 1) % 3, (way.normal + 2) % 3
    free = (way.turned != 0.0) & (np.minimum(limit[first], limit[second]) >= np.sqrt(2.0) * whole)
    bend = np.abs(way.turned) / way.length * np.hypot(way.tangent[k, first], way.tangent[k, second])
    speed = np.where(free, np.minimum(speed, np.sqrt(whole / np.where(free, bend, 1.0))), speed)
    border, seconds, peak = corner.copy(), np.zeros(n), np.zeros(n)
    length, most, pushes, turned = (
        np.ascontiguousarray(v, dtype=np.float64)
        for v in (way.length, speed, push, np.where(free, 0.0, way.turned))
    )
    _lookahead.look_ahead(
        length, most, pushes, turned, np.ascontiguousarray(way.normal, dtype=np.int8),
        np.ascontiguousarray(way.tangent[:, :3]), np.minimum(limit[:3], AT_ONCE),
        float(whole[way.turned != 0.0].min(initial=AT_ONCE)), border,
        np.empty(_lookahead.STEPS + 1), seconds, peak,
    )  # fmt: skip
    driven = np.sqrt(border)
    if np.isfinite(jerk):
        seconds = add_jerk(way.length, seconds, driven, peak, push, jerk)
    return Profile(seconds, peak, driven, np.sqrt(corner))


def _corners(way: Way, whole: Floats, limit: Floats) -> tuple[Floats, Floats]:
    """(n + 1,) largest u = v^2 at the borders, 0 at both ends; (n,) largest u on blocks that are rounded away as a whole."""
    n, m = way.tangent.shape
    out, inside = np.zeros(n + 1), np.full(n, np.inf)
    if n < 2:
        return out, inside
    before, after = way.end_tangent()[:-1], way.tangent[1:]
    change = after - before
    span = way.length if way.span is None else way.span
    least = np.minimum(span[1:], span[:-1])
    tip = change[:, :3]
    d = np.linalg.norm(tip, axis=1)
    x, c = 0.5 * d, _half_turn_cos(before[:, :3], after[:, :3])
    bent = d > 2e-12
    safe = np.where(bent, d, 1.0)
    tolerance = np.where(x < 0.5 * TANGENT, np.inf, way.tolerance[:-1])
    # e c / (1 - c) = e c (1 + c) / x^2, without cancellation
    rounded = 4.0 * tolerance * (1.0 + c) / safe
    share = np.abs(tip) / safe[:, None]
    along = np.divide(limit[:3], share, out=np.full(share.shape, np.inf), where=share > _lookahead.FLAT)
    most = np.minimum(along.min(axis=1), np.minimum(whole[1:], whole[:-1]))
    u = np.where(bent, np.minimum(least, rounded) * c / safe * most, np.inf)
    if m > 3:
        rate = np.abs(change[:, 3:])
        turning = np.divide(limit[3:], rate, out=np.full(rate.shape, np.inf), where=rate > 1e-12)
        u = np.minimum(u, least * turning.min(axis=1))
    u[way.halt[:-1]] = 0.0
    out[1:-1] = u
    # both halves of a chord belong to the circles about its corners
    whole_chord = bent & (x < SHALLOW) & (rounded >= least) & ~way.halt[:-1]
    own = EQUAL * span[1:-1]
    taken = whole_chord[:-1] & whole_chord[1:] & (np.minimum(least[:-1], least[1:]) >= own)
    inside[1:-1] = np.where(taken, np.maximum(u[:-1], u[1:]), np.inf)
    return out, inside


def _half_turn_cos(before: Floats, after: Floats) -> Floats:
    """(k,) cosine of half the turn between two directions (k, 3); 1 where one has no length."""
    size = np.linalg.norm(before, axis=1), np.linalg.norm(after, axis=1)
    none = np.minimum(*size) < _lookahead.FLAT
    one, two = (v / np.where(none, 1.0, s)[:, None] for v, s in zip((before, after), size, strict=True))
    return np.where(none, 1.0, np.minimum(0.5 * np.linalg.norm(one + two, axis=1), 1.0))
