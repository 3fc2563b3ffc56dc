# Where the first or last pose of a sweep is entered before all others of it (L5).
#
# Legend: see ../_kernels.py.

import numpy as np

from vmachining.engines.columns.turning._kernels import (
    ACC,
    AT,
    BEND,
    HALF,
    NT,
    NU,
    NV,
    OMEGA,
    depth,
    enter,
    state,
    support,
)
from vmachining.jit import leaf


@leaf
def _inside(rows, i, P, u, v, least, B):
    """A height at which the line over (u, v) is `least` deep in the pose; inf where none is found."""
    if not enter(rows, i, P, u, v, B):
        return np.inf
    up = 1e-10
    for _ in range(16):
        if depth(rows, i, P, u, v, B[AT] + up) >= least:
            return B[AT] + up
        up *= 4.0
    return np.inf


@leaf
def starts_first(rows, waves, i, s0, u, v, h, P, B):
    """L5: whether no pose is entered earlier than that of s0 (0 or 1), over the whole cell."""
    rate, A0, A1 = rows[i, OMEGA], rows[i, ACC], rows[i, BEND]
    state(rows, waves, i, s0, P)
    if s0 > 0.5:
        for k in range(6, 12):
            P[k] = -P[k]
    if not enter(rows, i, P, u, v, B) or B[NT] > -0.02:
        return False
    n0, n1, n2 = B[NU], B[NV], B[NT]
    low, top = support(rows, i, n0 * P[3] + n1 * P[4] + n2 * P[5])
    x, y = u - P[0], v - P[1]
    w = (max(low, top) - n0 * x - n1 * y) / n2 - 1e-9
    gu, gv, tc = -n0 / n2, -n1 / n2, w + P[2]
    ox, oy, oz = P[4] * P[11] - P[5] * P[10], P[5] * P[9] - P[3] * P[11], P[3] * P[10] - P[4] * P[9]
    V0, V1, V2 = P[6] + oy * w - oz * y, P[7] + oz * x - ox * w, P[8] + ox * y - oy * x
    if n0 * V0 + n1 * V1 + n2 * V2 >= 0.0:
        return False
    plan, speed = np.sqrt(V0 * V0 + V1 * V1), np.sqrt(V0 * V0 + V1 * V1 + V2 * V2)
    least, most, b = tc - (abs(gu) + abs(gv)) * h, -np.inf, -np.inf
    for k in range(4):
        dx, dy = (h if k % 2 else -h), (h if k > 1 else -h)
        f = _inside(rows, i, P, u + 2.0 * dx, v + 2.0 * dy, 0.0, B)
        if f == np.inf:
            return False
        most = max(most, f)
        if plan > 1e-9:
            step = 1.4 * h / plan
            f = _inside(rows, i, P, u + dx + step * V0, v + dy + step * V1, 0.0, B)
            if f == np.inf:
                return False
            b = max(b, (f - tc - gu * dx - gv * dy) / step)
    slope = np.sqrt(2.0) * (most - least) / h
    b = (b if plan > 1e-9 else 1e-9 * slope) - V2
    sigma = np.sqrt(1.0 + slope * slope)
    if b >= 0.0 or 1.0 / sigma < 3.0 * rate + A1 or rate >= 0.5:
        return False
    reach = np.sqrt(2.0 * h * h + max(most - tc, tc - least) ** 2)
    zeta = 2.0 * speed + 1.0
    acc = A0 + A1 * (np.sqrt(x * x + y * y + w * w) + reach + zeta)
    if (speed + rate * reach + 0.5 * acc) / (1.0 - rate) > zeta:
        return False
    zeta = (speed + rate * reach + 0.5 * acc) / (1.0 - rate)
    return -b / sigma >= rate * reach + rate * zeta + 0.5 * acc


@leaf
def least_exit(rows, waves, i, s0, u, v, h, slack, P, B):
    """Least height at which lines over the cell leave the pose of s0 (concave: at a corner); -inf where one misses.

    `slack` inside: the sweep that shares the pose knows it by numbers that are rounded.
    """
    j, out = i + 1 if i % HALF == 0 else i - 1, np.inf
    state(rows, waves, j, s0, P)
    for k in range(4):
        f = _inside(rows, j, P, u + (h if k % 2 else -h), v + (h if k > 1 else -h), slack, B)
        out = min(out, -f)
    return out
