# Volume between the top of the stock and a sweep over one cell: ends, middle, and the curves where they meet.
#
# Legend. A straight sweep has two ends, of revolution, and a middle that depends on eta but for m xi; see
# moments/_kernels.py for the integrals of both. Of a ball they are closed: S is the height of a patch over the rim, the
# root of R^2 - distance^2 for an end, of R^2 - eta^2 for the middle, 0 outside the footprint. Polygons P[q]: corners from
# the middle of the cell, against the clock; xi, eta: along and across the motion. W: scratch, a row for each edge.

import numpy as np

from vmachining.engines.columns.balls._kernels import ULPS, ball_room
from vmachining.engines.columns.moments._kernels import around, beside, chi, edges
from vmachining.engines.columns.surface._kernels import (
    ENDS,
    FROM,
    LINE,
    RIM,
    STEEP,
    TO,
    VERTEX,
    lean,
    local,
    poses,
    profile,
    spread,
)
from vmachining.jit import inner, leaf

RECT, HERE, BEYOND, REST = np.int64(0), np.int64(2), np.int64(3), np.int64(4)  # polygons
FOUR, NONE = np.int64(4), np.int64(0)
STEPS = 4  # parts of a seam whose slopes are bounded each


@leaf
def clip(P, src, n, dst, nx, ny, c):
    """Corners of polygon src with n.p <= c into dst; their number."""
    m = NONE
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        ax, ay, bx, by = P[src, i, 0], P[src, i, 1], P[src, j, 0], P[src, j, 1]
        u, v = nx * ax + ny * ay - c, nx * bx + ny * by - c
        if u <= 0.0:
            P[dst, m, 0], P[dst, m, 1] = ax, ay
            m += 1
        if (u < 0.0 < v) or (v < 0.0 < u):
            t = u / (u - v)
            P[dst, m, 0], P[dst, m, 1] = ax + t * (bx - ax), ay + t * (by - ay)
            m += 1
    return m


@leaf
def rectangle(P, hx, hy):
    """The cell itself as a polygon."""
    for v in range(4):
        P[RECT, v, 0] = hx if v == 0 or v == 3 else -hx
        P[RECT, v, 1] = hy if v < 2 else -hy


@leaf
def _facing(head, part, c, m, eta):
    """Part of the profile on which the middle of a sweep that rises by m touches, see `lean`."""
    n = int(head[c, 0])
    for i in range(n):
        p = part[c, i, 4]
        if p > m and (i == n - 1 or eta <= part[c, i, 2] * np.sqrt(1.0 - (m / p) ** 2)):
            return i
    return n - 1


@leaf
def _bend(a, r, m, q):
    """T of `seam`."""
    u, v = m * m + q * q, 1.0 + m * m + q * q
    A, B = a / (u * np.sqrt(u)), r / (v * np.sqrt(v))
    return (A + B) / (m * m * A + (1.0 + m * m) * B)


@leaf
def seam(head, part, c, m, near, far):
    """(alpha, g, wrong): a line xi = alpha + g eta for the curve xi = lean(eta), where an end and the middle of a sweep
    that rises by m > 0 meet, and the integral of what the one may lie over the other on the wrong side; near < far.

    On arcs the slope of the curve is -m q T, q = chi' and T = (A + B) / (m^2 A + w^2 B), A = a / (m^2 + q^2)^1.5,
    B = r / (w^2 + q^2)^1.5; T falls with q. A curve with slopes between two, and the chord through both of its ends, are no
    farther from each other than a quarter of their difference times the width.
    """
    R = head[c, 1]
    wide = far - near
    low, high = (0.0 if near < 0.0 < far else min(abs(near), abs(far))), max(abs(near), abs(far))
    i = _facing(head, part, c, m, high)
    if i != _facing(head, part, c, m, low):
        return 0.0, 0.0, np.inf
    _, q, u, rho = chi(head, part, c, m, low)
    _, p, v, reach = chi(head, part, c, m, high)
    kind = part[c, i, 0]
    if kind == LINE:
        steep = m / np.sqrt(part[c, i, 4] ** 2 - m * m)
        flat = -steep if low == 0.0 and near < 0.0 else steep
    else:
        a, r = part[c, i, 5], part[c, i, 7]
        if kind == VERTEX:
            a, r = part[c, i, 2], 0.0
        if a < 0.0 or not p < STEEP:
            return 0.0, 0.0, np.inf
        steep, flat = 0.0, (0.0 if low == 0.0 and near < 0.0 else np.inf)
        q0, T = q, _bend(a, r, m, q)
        for j in range(STEPS):
            share = (j + 1.0) / STEPS
            q1 = q + (p - q) * share * share
            T1 = _bend(a, r, m, q1)
            steep, flat = max(steep, m * q1 * T), min(flat, m * q0 * T1)
            q0, T = q1, T1
        if low == 0.0 and near < 0.0:
            flat = -steep
    sag = 0.25 * (steep - flat) * wide + ULPS * R
    if low == 0.0 and near < 0.0:
        other = lean(head, part, c, m, -near if far == high else far)
        x0, x1 = (other, v) if far == high else (v, other)
    else:
        x0, x1 = (u, v) if far == high else (v, u)
    g = (x1 - x0) / wide
    alpha = x0 - g * near
    best, shift = np.inf, 0.0
    if reach + sag < R * (1.0 - RIM):
        p0, p1 = profile(head, part, c, max(rho - sag, 0.0))[2], profile(head, part, c, reach + sag)[3]
        _, bend, _, turn = spread(
            part, c, int(head[c, 0]), 0.0, max(rho - sag, 0.0), reach + sag, p0, p1, ENDS
        )
        best = max(bend, turn) * sag * sag * sag / 6.0
    if (
        min(x0, x1) > 2.0 * sag and 2.0 * m * sag * sag < best
    ):  # all on the side of the end, whose slope is below m
        best, shift = 2.0 * m * sag * sag, sag
    return alpha - shift, g, wide * best


@inner
def room(head, part, c, lines, i, top, x, y, hx, hy, below, P, at, corners, W):
    """(lo, hi) of the integral of max(0, top - f) over the part of a polygon of a cell in the footprint of a sweep;
    infinitely wide where that is not known. below: f is known to lie nowhere above the top.

    Patches are divided along a chord of the curve where they meet, no farther from it than
    `sag`: on the wrong side of it their difference, which vanishes with its slope at the curve, is as if a second
    derivative of an end along the motion had added up.
    """
    xi, eta = local(lines, i, x, y)
    ux, uy, L, m = lines[i, 3], lines[i, 4], lines[i, 5], lines[i, 6]
    R = head[c, 1]
    deta = abs(uy) * hx + abs(ux) * hy
    poses(head, part, c, lines, i, x, y, hx, hy)
    first, last = lines[i, FROM], lines[i, TO]
    if head[c, 2] == 1.0 and below:
        gap = top - (lines[i, 2] + head[c, 3])
        return ball_room(lines, i, R, gap, first, last, hx, hy, xi, eta, P, at, corners, W)
    if L == 0.0 or last <= 0.0 or first >= L:
        s = L if last > 0.0 and L > 0.0 else 0.0
        return _end_room(head, part, c, lines, i, s, top, x, y, P, at, corners, W)
    near, far = max(eta - deta, -R), min(eta + deta, R)
    if near >= far:
        return 0.0, 0.0
    mixed = first < 0.0 or last > L
    if m != 0.0 and not below:
        return -np.inf, np.inf
    low, high, q, n = 0.0, 0.0, at, corners
    if mixed:
        nx, ny, offset, wrong = ux, uy, -xi, 0.0
        if m != 0.0:
            alpha, g, wrong = seam(head, part, c, abs(m), near, far)
            if not wrong < np.inf:
                return -np.inf, np.inf
            if m < 0.0:
                alpha, g = -alpha, -g
            nx, ny, offset = ux + g * uy, uy - g * ux, alpha - xi + g * eta
        for end in range(2):
            if (first >= 0.0) if end == 0 else (last <= L):
                continue
            way, s, rest = (1.0, 0.0, HERE) if end == 0 else (-1.0, L, REST)
            beyond = clip(P, q, n, BEYOND, way * nx, way * ny, way * (s + offset))
            n, q = clip(P, q, n, rest, -way * nx, -way * ny, -way * (s + offset)), rest
            a, b = _end_room(head, part, c, lines, i, s, top, x, y, P, BEYOND, beyond, W)
            low, high = low + a - wrong, high + b + wrong
    gap = top - (lines[i, 2] + m * xi)
    side = max(abs(eta) - deta, 0.0)
    a, b = beside(head, part, c, m, P, q, n, ux, uy, eta, side, abs(eta) + deta, hx + hy, gap)
    return low + a, high + b


@leaf
def _end_room(head, part, c, lines, i, s, top, x, y, P, q, n, W):
    """The same of the end at s of the path, over a polygon."""
    px, py = x - lines[i, 0] - s * lines[i, 3], y - lines[i, 1] - s * lines[i, 4]
    gap = top - (lines[i, 2] + lines[i, 6] * s)
    m, near, far = edges(P, q, n, px, py, W)
    return around(head, part, c, W, m, near, far, gap)
