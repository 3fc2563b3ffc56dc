# The straight sweep that stands for a sweep in one cell.
#
# Legend. rows[k] as in surface/_kernels.py, and (10) ARC or STRAIGHT; of an arc: start, L length in plan, m = dz/ds, the
# cutter itself twice, and (11) x, (12) y of the centre, (13) radius r, (14) angle of the start, (15) signed angle.
# lines[i] the straight sweep with the columns of rows, and of an arc (11) x, (12) y, (13) r, (14), (15) as above, (16) cutter,
# (17) z at the start, (18) m, (19), (20) first and last angle from the start that count in the cell.
# ladder[c] = (number of the first shrunk cutter, by how much): rung l has cutters first + 2 l, first + 2 l + 1, moved by
# ladder[c, 1] / 2^l.
# A point of the cell has polar radius rho; u is by how much a pose lies behind the point's own angle, so
# d(u)^2 = rho^2 + r^2 - 2 rho r cos u and d' / r = q(u) = rho sin u / d.

import numpy as np

from vmachining.engines.columns.surface._kernels import STEEP, profile
from vmachining.jit import leaf

STRAIGHT, ARC = 0.0, 1.0
WIDTH = 21  # columns of lines
TWO_PI = 2.0 * np.pi
STRETCH = 0.25  # what the poses of a cell are extended by, so that its own chord has no end in it
RUNGS = 18  # pairs of cutters, each half as far from the true one as the pair before
PARTS = 8  # of the poses of a piece that are compared with each other, again and again
ROUNDS = 8
RISING, FALLING, OPEN, ABSENT = 1.0, 2.0, 3.0, 4.0  # of the height over a cell, as poses lie farther behind
LAST = RUNGS - 1.0


@leaf
def _speed(rho, r, cos, sin):
    """q(u) from cosine and sine of u."""
    d2 = rho * rho + r * r - 2.0 * rho * r * cos
    return rho * sin / np.sqrt(d2) if d2 > 0.0 else 1.0


@leaf
def _cosines(u, v, cu, cv):
    """(least, greatest) cosine between two angles, from those of both."""
    low, high = min(cu, cv), max(cu, cv)
    if np.floor(v / TWO_PI) > np.floor(u / TWO_PI) or v - u >= TWO_PI:
        high = 1.0
    if np.floor((v - np.pi) / TWO_PI) > np.floor((u - np.pi) / TWO_PI):
        low = -1.0
    return low, high


@leaf
def _gaps(near, wide, r, u, v, cu, cv):
    """(least, greatest) d for polar radii from near to wide and angles from u to v, with their cosines."""
    low, high = _cosines(u, v, cu, cv)
    rho = min(max(r * high, near), wide)
    a = rho * rho + r * r - 2.0 * rho * r * high
    b = max(near * near - 2.0 * near * r * low, wide * wide - 2.0 * wide * r * low) + r * r
    return np.sqrt(max(a, 0.0)), np.sqrt(max(b, 0.0))


@leaf
def _trend(head, part, c, m, r, near, wide, u, v, cu, su, cv, sv):
    """How the height over all points of a cell changes with the angle that the pose lies behind, from u to v, with their
    cosines and sines.

    slope(d) q - m: slope grows with d. Over u in [0, pi], and over rho, q has one greatest value, so its least is at a
    corner; its greatest as well where the ridge cos u = min(rho / r, r / rho), on which it is min(1, rho / r), passes by.
    Elsewhere q < 0 and d falls: the farther the lower, and what an earlier pose reaches a later one does.
    """
    if (u >= np.pi and v <= TWO_PI) or (v <= 0.0 and u >= -np.pi):
        return FALLING
    least, most = _gaps(near, wide, r, u, v, cu, cv)
    R = head[c, 1]
    if least > R:
        return ABSENT
    fast = min(1.0, wide / r)
    if u > -np.pi and v < TWO_PI and v - u < np.pi:
        inside = u >= 0.0 and v <= np.pi  # beyond these q < 0
        if u < 0.0:
            cu, su = 1.0, 0.0
        if v > np.pi:
            cv, sv = -1.0, 0.0
        a, b = _speed(near, r, cu, su), _speed(wide, r, cu, su)
        e, f = _speed(near, r, cv, sv), _speed(wide, r, cv, sv)
        x, y = near / r if near < r else r / near, wide / r if wide < r else r / wide
        top = 1.0 if near <= r <= wide else max(x, y)
        if cu < min(x, y) or cv > top:
            fast = min(fast, max(max(a, b), max(e, f)))
        slow = min(min(a, b), min(e, f))
        if inside and slow >= 0.0 and profile(head, part, c, least)[2] * slow >= m:
            return RISING
    if most < R:
        steep = profile(head, part, c, most)[3]
        if steep < STEEP and steep * fast <= m:
            return FALLING
    return OPEN


@leaf
def lowest(head, part, c, m, r, rho, d, t, beta, a, b):
    """(first, last) of the poses between angles a and b that can be lowest over a point within d of a place at polar
    radius rho and angle t, known to beta; poses rise by m >= 0 with their angle.

    Each of `PARTS` equal parts by its trend: where that is known, no pose inside is the lowest one, but one of its ends
    may be. What may be is compared in height, over the cell, with the best; then the same with the part that is left.
    """
    R, near, wide = head[c, 1], max(rho - d, 0.0), rho + d
    u, v = t - b - beta, t - a + beta
    trend = _trend(head, part, c, m, r, near, wide, u, v, np.cos(u), np.sin(u), np.cos(v), np.sin(v))
    if trend != OPEN:
        return (b, b) if trend == RISING else (a, a)
    for _ in range(ROUNDS):
        step = (b - a) / PARTS
        best = np.inf
        for j in range(PARTS + 1):
            s = a + j * step
            gap = np.sqrt(max(rho * rho + r * r - 2.0 * rho * r * np.cos(t - s), 0.0)) + d
            if gap <= R:
                best = min(best, m * r * s + profile(head, part, c, gap)[0])
        low, high, before = np.inf, -np.inf, ABSENT
        w = (
            t - a - beta
        )  # points of the cell lie behind pose s by w to v, and behind the next one by u at least
        cw = np.cos(w)
        for j in range(PARTS + 1):
            s = a + j * step
            u, v = t - s - step - beta, t - s + beta
            cu, cv, after = np.cos(u), np.cos(v), ABSENT
            if j < PARTS:
                after = _trend(head, part, c, m, r, near, wide, u, v, cu, np.sin(u), cv, np.sin(v))
            met = before in (RISING, ABSENT) and after in (FALLING, ABSENT)
            for look in range(2):  # the pose s, and the part that follows
                far = step if look == 1 else 0.0
                if not (met if look == 0 else after == OPEN):
                    continue
                back, cos = (w, cw) if look == 0 else (u, cu)
                least = _gaps(near, wide, r, back, v, cos, cv)[0]
                if least > R or m * r * s + profile(head, part, c, least)[1] > best:
                    continue
                low, high = min(low, s), max(high, s + far)
            before, w, cw = after, u, cu
        if low > high:
            return a, a  # none reaches the cell
        done = high - low > 0.8 * (b - a) or high - low <= 0.1 * beta
        a, b = low, min(high, b)
        if done:
            break
    return a, b


@leaf
def place(head, part, ladder, rows, k, x, y, d, lines, i):
    """Fill lines[i] with the straight sweep that stands for sweep k within d of (x, y)."""
    for j in range(11):
        lines[i, j] = rows[k, j]
    if rows[k, 10] == STRAIGHT:
        return
    cx, cy, r, first, sweep = rows[k, 11], rows[k, 12], rows[k, 13], rows[k, 14], rows[k, 15]
    m, c = rows[k, 6], int(rows[k, 7])
    way = 1.0 if sweep > 0.0 else -1.0
    half = 0.5 * abs(sweep)
    dx, dy = x - cx, y - cy
    rho = np.sqrt(dx * dx + dy * dy)
    beta, t = np.pi, 0.0
    if rho > d:
        beta = np.arcsin(d / rho)
        t = way * (np.arctan2(dy, dx) - first) - half
        t -= TWO_PI * np.round(t / TWO_PI)
    if m == 0.0 and abs(t) + beta < np.pi:  # level: the pose nearest in angle
        a, b = min(max(t - beta + half, 0.0), 2.0 * half), min(max(t + beta + half, 0.0), 2.0 * half)
    else:
        up = 1.0 if m >= 0.0 else -1.0
        t *= up
        if t - half - beta < -np.pi:
            t += TWO_PI
        a, b = lowest(head, part, c, abs(m), r, rho, d, t, beta, -half, half)
        a, b = (half + a, half + b) if up > 0.0 else (half - b, half - a)
    more = STRETCH * (b - a)
    a, b = max(a - more, 0.0), min(b + more, 2.0 * half)
    turn = b - a
    aside = r * np.tan(0.25 * turn) ** 2
    off = aside + (r * turn * turn * turn / 36.0 if m != 0.0 else 0.0)
    out = r + aside
    alpha, omega = first + way * a, first + way * b
    x0, y0 = cx + out * np.cos(alpha), cy + out * np.sin(alpha)
    ex, ey = cx + out * np.cos(omega) - x0, cy + out * np.sin(omega) - y0
    L = np.sqrt(ex * ex + ey * ey)
    rise = m * r * turn
    lines[i, 0], lines[i, 1], lines[i, 2] = x0, y0, rows[k, 2] + m * r * a
    if 1e-9 * r < L:
        lines[i, 3], lines[i, 4], lines[i, 5], lines[i, 6] = ex / L, ey / L, L, rise / L
    else:
        lines[i, 2] += min(rise, 0.0)
        lines[i, 3], lines[i, 4], lines[i, 5], lines[i, 6] = 1.0, 0.0, 0.0, 0.0
        off += L + abs(rise)
    if off > 0.0:
        rung = np.floor(np.log2(ladder[c, 1] / off))
        base = ladder[c, 0] + 2.0 * min(max(rung, 0.0), LAST)
        lines[i, 7], lines[i, 8] = base, base + 1.0
    for j in range(11, 16):
        lines[i, j] = rows[k, j]
    lines[i, 16], lines[i, 17], lines[i, 18], lines[i, 19], lines[i, 20] = c, rows[k, 2], m, a, b


@leaf
def same_arc(lift, lines, i, k, slack):
    """Whether arc k runs along arc i, at the height of it or above, with all poses that count in the cell."""
    b, c = int(lines[i, 16]), int(lines[k, 16])
    r = lines[i, 13]
    if lift[b, c] == np.inf or abs(lines[k, 13] - r) > slack:
        return False
    if abs(lines[i, 11] - lines[k, 11]) > slack or abs(lines[i, 12] - lines[k, 12]) > slack:
        return False
    ahead = 1.0 if lines[i, 15] > 0.0 else -1.0
    way = 1.0 if lines[k, 15] > 0.0 else -1.0
    middle, half = lines[i, 14] + 0.5 * lines[i, 15], 0.5 * abs(lines[i, 15])
    for j in range(2):
        t = lines[k, 19 + j]
        angle = ahead * (lines[k, 14] + way * t - middle)
        angle -= TWO_PI * np.round(angle / TWO_PI)
        if abs(angle) > half + slack / r:
            return False
        z = lines[k, 17] + lines[k, 18] * r * t - lift[b, c]
        if z < lines[i, 17] + lines[i, 18] * r * (angle + half) - slack:
            return False
    return True
