"""What a limited jerk adds to times that have none.

A change of speed d under acceleration a takes d / a, with jerk j

    T(d) = d / a + a / j if d >= a^2 / j, else 2 sqrt(d / j)                                      (1)

and, being symmetric, covers (v0 + v1) T / 2. Ramps are the runs of blocks in which the speed of `drive` only rises or only
falls: a run that was driven in t takes T, and what it covers more than before is no longer driven at its highest speed.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from vmachining.arrays import Floats


def ramp_s(change: float, acceleration: float, jerk: float) -> float:
    """Seconds of a change of speed, eq. (1)."""
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
    """(n,) seconds with a limited jerk.

    Stretches between two lowest speeds are driven as one: up, along, down, with the largest acceleration that their blocks
    have in common and no faster than their time-weighted speed; the extra time is given to their blocks in proportion.
    """
    out = seconds.copy()
    n = len(length)
    low = [0]
    low += [
        k for k in range(1, n) if border[k] <= min(peak[k - 1], peak[k]) * (1.0 - 1e-9) and _is_low(border, k)
    ]
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


def _is_low(border: Floats, k: int) -> bool:
    return bool(border[k] <= border[k - 1] and border[k] <= border[k + 1])
