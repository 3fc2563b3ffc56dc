"""Look-ahead along a path: one pass back, one pass forward. Arrays in, arrays out; mm and s.

Symbols: s length along the path, u = (ds/dt)^2, w = d2s/dt2, p = dq/ds and r = d2q/ds2 of the slides, a their limits.
On a line r = 0 and one step u_1 <= u_0 + 2 w L is exact. An arc is taken in steps; at the start of each

    |p_j w + r_j u| <= a_j,   |w| <= A,   |r| u <= A                                  (1)

so that w lies between -a_j / |p_j| - z_j u and a_j / |p_j| - z_j u, with z_j = sign(p_j) r_j / |p_j|: the constraints of
time-optimal parametrisation by reachability (Pham and Pham 2018), whose two passes these are.
"""

import numpy as np
from numpy.typing import NDArray

from vmachining.jit import inner, kernel, leaf

F = NDArray[np.float64]

STEP = 0.01
"""rad of an arc in one step at most."""

STEPS = 4096
"""Of one arc at most."""

FLAT = 1e-9
"""Share of a slide in the path below which it does not move."""


@inner
def steps_of(turned: float) -> int:
    return int(min(max(np.ceil(abs(turned) / STEP), 128.0), float(STEPS)))


@leaf
def constraints(
    first: float, second: float, third: float, angle: float, per_mm: float, a: int, b: int, c: int,
    limit: F, whole: float, cap: float, room: F,
) -> float:  # fmt: skip
    """Largest u at a point of an arc; a_j / |p_j| and z_j are left in room[0:4] and room[4:8], the path's own last."""
    cos, sin = np.cos(angle), np.sin(angle)
    pa, pb = cos * first - sin * second, sin * first + cos * second
    ra, rb = -per_mm * pb, per_mm * pa
    u = cap
    bend = np.hypot(ra, rb)
    if bend * u > whole:
        u = whole / bend
    for j in range(3):
        p, r = (pa, ra) if j == a else ((pb, rb) if j == b else (third, 0.0))
        size = abs(p)
        if size > FLAT:
            room[j] = limit[j] / size
            room[4 + j] = r / size if p > 0.0 else -r / size
        else:
            room[j], room[4 + j] = np.inf, 0.0
            if abs(r) * u > limit[j]:
                u = limit[j] / abs(r)
    room[3], room[7] = whole, 0.0
    for j in range(4):
        for k in range(4):
            slope = room[4 + k] - room[4 + j]
            if slope * u > room[j] + room[k]:
                u = (room[j] + room[k]) / slope
    return u


@leaf
def arc_back(
    length: float, cap: float, turned: float, tangent: F, normal: int, limit: F, whole: float, end: float,
    room: F, back: F,
) -> float:  # fmt: skip
    """Largest u at the start of an arc that can still be brought to `end`; back holds those of all steps."""
    n = steps_of(turned)
    a, b = (normal + 1) % 3, (normal + 2) % 3
    ds, per_mm = length / n, turned / length
    first, second, third = tangent[a], tangent[b], tangent[normal]
    u = constraints(first, second, third, turned, per_mm, a, b, normal, limit, whole, cap, room)
    back[n] = min(u, end)
    half = 0.5 / ds
    for k in range(n - 1, -1, -1):
        u = constraints(first, second, third, turned * k / n, per_mm, a, b, normal, limit, whole, cap, room)
        for j in range(4):
            slope = half - room[4 + j]
            if slope * u > back[k + 1] * half + room[j]:
                u = (back[k + 1] * half + room[j]) / slope
        back[k] = u
    return float(back[0])


@leaf
def arc_forward(
    length: float, cap: float, turned: float, tangent: F, normal: int, limit: F, whole: float, begin: float,
    room: F, back: F,
) -> tuple[float, float, float]:  # fmt: skip
    """Time of an arc entered at u = begin, u at its end, and the largest u on the way, after `arc_back`."""
    n = steps_of(turned)
    a, b = (normal + 1) % 3, (normal + 2) % 3
    ds, per_mm = length / n, turned / length
    first, second, third = tangent[a], tangent[b], tangent[normal]
    u, top, seconds = min(begin, back[0]), 0.0, 0.0
    for k in range(n):
        constraints(first, second, third, turned * k / n, per_mm, a, b, normal, limit, whole, cap, room)
        w = np.inf
        for j in range(4):
            w = min(w, room[j] - room[4 + j] * u)
        after = max(min(u + 2.0 * ds * w, back[k + 1]), 0.0)
        seconds += 2.0 * ds / (np.sqrt(u) + np.sqrt(after))
        u = after
        top = max(top, u)
    return seconds, u, top


@kernel
def look_ahead(
    length: F, speed: F, push: F, turned: F, normal: NDArray[np.int8], tangent: F, limit: F, whole: float,
    border: F, back: F, seconds: F, peak: F,
) -> None:  # fmt: skip
    """Times and peak speeds of n blocks; border (n + 1) holds the largest u allowed there, then what is driven.

    speed (n,) mm/s at most. push (n,) mm/s^2 along a line. turned (n,) rad of an arc about axis normal (n,), else 0.
    tangent (n, 3) at the start. limit (3,) of the slides on arcs, whole along the path.
    """
    n = length.shape[0]
    room = np.empty(8)
    for i in range(n - 1, -1, -1):
        cap = speed[i] * speed[i]
        border[i + 1] = min(border[i + 1], cap)
        if turned[i] == 0.0:
            reached = min(border[i + 1] + 2.0 * push[i] * length[i], cap)
        else:
            reached = arc_back(
                length[i], cap, turned[i], tangent[i], normal[i], limit, whole, border[i + 1], room, back
            )
            border[i + 1] = min(border[i + 1], back[steps_of(turned[i])])
        border[i] = min(border[i], reached)
    for i in range(n):
        cap, u = speed[i] * speed[i], border[i]
        if turned[i] == 0.0:
            end = min(border[i + 1], u + 2.0 * push[i] * length[i])
            border[i + 1] = end
            top = min(cap, push[i] * length[i] + 0.5 * (u + end))
            v, v0, v1 = np.sqrt(top), np.sqrt(u), np.sqrt(end)
            if v > 0.0:
                steady = max(length[i] - (2.0 * top - u - end) / (2.0 * push[i]), 0.0)
                seconds[i] = (2.0 * v - v0 - v1) / push[i] + steady / v
        else:
            arc_back(
                length[i], cap, turned[i], tangent[i], normal[i], limit, whole, border[i + 1], room, back
            )
            seconds[i], border[i + 1], top = arc_forward(
                length[i], cap, turned[i], tangent[i], normal[i], limit, whole, u, room, back
            )
        peak[i] = np.sqrt(max(top, u, border[i + 1]))
