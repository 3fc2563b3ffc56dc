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

from vmachining.engines.columns.surface._kernels import profile
from vmachining.jit import leaf

STRAIGHT, ARC = 0.0, 1.0
WIDTH = 21  # columns of lines
TWO_PI = 2.0 * np.pi
MOST_FAR = 0.9 * np.pi  # angle between a point and a pose up to which slopes are compared
STRETCH = 0.25  # what the poses of a cell are extended by, so that its own chord has no end in it
RUNGS = 18  # pairs of cutters, each half as far from the true one as the pair before
PARTS = 8  # of the poses of a piece that are compared with each other
LAST = RUNGS - 1.0


@leaf
def _speed(rho, r, u):
    """q(u)."""
    d2 = rho * rho + r * r - 2.0 * rho * r * np.cos(u)
    return rho * np.sin(u) / np.sqrt(d2) if d2 > 0.0 else 1.0


@leaf
def _gap(near, wide, r, u):
    """(least, greatest) d(u) for polar radii from near to wide: least at r cos u, greatest at an end."""
    cos = np.cos(u)
    rho = min(max(r * cos, near), wide)
    low = rho * rho + r * r - 2.0 * rho * r * cos
    high = max(near * near - 2.0 * near * r * cos, wide * wide - 2.0 * wide * r * cos) + r * r
    return np.sqrt(max(low, 0.0)), np.sqrt(max(high, 0.0))


@leaf
def _rises(head, part, c, m, r, near, wide, u, far):
    """Whether poses at angles from u to `far` behind a point are all higher over it, the farther the higher.

    slope(d) q >= m: d grows with u, and q(u) rises and then falls, so its least value is at an end; over rho q has one
    greatest value, so that, too, is least at an end.
    """
    d, _ = _gap(near, wide, r, u)
    if d >= head[c, 1]:
        return True
    low = profile(head, part, c, d)[2]
    q = min(_speed(near, r, u), _speed(wide, r, u))
    q = min(q, min(_speed(near, r, far), _speed(wide, r, far)))
    return low * q >= m


@leaf
def _falls(head, part, c, m, r, near, wide, u):
    """Whether of the poses from 0 to u behind a point the last one is the lowest over it: slope(d) q <= m for all."""
    _, d = _gap(near, wide, r, u)
    if d >= head[c, 1]:
        return False
    cos = np.cos(u)
    high = profile(head, part, c, d)[3]
    q = min(1.0, wide / r)
    if near * cos > r or wide < r * cos:
        q = max(_speed(near, r, u), _speed(wide, r, u))
    return high * q <= m


@leaf
def _behind(head, part, c, m, r, rho, most):
    """By how much the lowest pose over a point at rho lies behind it, about; `most` where it is farther."""
    low, high = 0.0, most
    for _ in range(14):
        u = 0.5 * (low + high)
        d, _ = _gap(rho, rho, r, u)
        if d < head[c, 1] and profile(head, part, c, d)[2] * _speed(rho, r, u) < m:
            low = u
        else:
            high = u
    return high


@leaf
def lag(head, part, c, m, r, rho, d, beta, far):
    """(least, greatest) angle that the lowest pose over a point of the cell lies behind it; `far`, at most `MOST_FAR`, is
    the greatest that there is."""
    near, wide = max(rho - d, 0.0), rho + d
    guess = _behind(head, part, c, m, r, rho, far)
    low, high = 0.0, far
    step = 0.25 * beta + 1e-7
    for _ in range(14):
        u = guess + step
        if u >= far:
            break
        if _rises(head, part, c, m, r, near, wide, u, far):
            high = u
            break
        step *= 1.6
    step = 0.25 * beta + 1e-7
    for _ in range(14):
        u = guess - step
        if u <= 0.0:
            break
        if _falls(head, part, c, m, r, near, wide, u):
            low = u
            break
        step *= 1.6
    return low, high


@leaf
def compare(head, part, c, m, r, cx, cy, first, way, x, y, d, a, b):
    """(first, last) angle of the poses between angles a and b from the start that can be lowest within d of (x, y).

    Of each of `PARTS` equal parts the least height over the cell against the greatest of the lowest one: distances to
    its middle pose, less and more what poses and points lie aside.
    """
    R, step = head[c, 1], (b - a) / PARTS
    best = np.inf
    for look in range(2):
        low, high = b, a
        for j in range(PARTS):
            t = a + (j + 0.5) * step
            alpha = first + way * t
            gap = np.sqrt((x - cx - r * np.cos(alpha)) ** 2 + (y - cy - r * np.sin(alpha)) ** 2)
            z = m * r * t
            if look == 0:
                if gap + d <= R:
                    best = min(best, z + profile(head, part, c, gap + d)[0])
                continue
            near = max(gap - d - 0.5 * r * step, 0.0)
            if near > R:
                continue
            if z - 0.5 * abs(m) * r * step + profile(head, part, c, near)[1] <= best:
                low, high = min(low, a + j * step), max(high, a + (j + 1.0) * step)
    if low > high:
        return a, a + step  # none reaches the cell
    return low, min(high, b)


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
    a, b, known, beta = 0.0, 2.0 * half, False, np.pi
    if rho > d:
        beta = np.arcsin(d / rho)
        t = way * (np.arctan2(dy, dx) - first) - half
        t -= TWO_PI * np.round(t / TWO_PI)
        uphill = t if m >= 0.0 else -t
        far = max(uphill + beta + half, 0.0)
        # level: the pose nearest in angle. Uphill it lies behind, by no more and no less than `lag` says
        if abs(t) + beta < np.pi and (m == 0.0 or far < MOST_FAR):
            low, high = 0.0, 0.0
            if m != 0.0:
                low, high = lag(head, part, c, abs(m), r, rho, d, beta, far)
            if m >= 0.0:
                a, b = t - beta - high, t + beta - low
            else:
                a, b = t - beta + low, t + beta + high
            a, b = min(max(a + half, 0.0), 2.0 * half), min(max(b + half, 0.0), 2.0 * half)
            known = m == 0.0 or high < far
    if not known:
        for _ in range(3):
            a, b = compare(head, part, c, m, r, cx, cy, first, way, x, y, d, a, b)
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
