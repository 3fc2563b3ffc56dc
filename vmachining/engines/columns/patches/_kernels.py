# Volume between the top of the stock and the sweep of a ball over one cell, in closed form.
#
# Legend. A ball of radius R that moves straight sweeps two half balls (its ends) and a cylinder between them; they meet
# along xi = kappa sqrt(R^2 - eta^2) and the same moved by the length L. S is the height of a patch over the rim: the root
# of R^2 - distance^2 for an end, of R^2 - eta^2 for the cylinder, 0 outside the footprint. Polygons P[q]: corners from the
# middle of the cell, against the clock; xi, eta: along and across the motion.

import numpy as np

from vmachining.engines.columns.surface._kernels import local, stretch
from vmachining.jit import leaf

ULPS = 64.0 * 2.220446049250313e-16  # rounding of one integral by its largest term: some forty operations
FLAT = 1e-3  # an edge that is this nearly along the motion is bounded, see `cylinder`
RECT, HERE, BEYOND, REST = np.int64(0), np.int64(2), np.int64(3), np.int64(4)  # polygons
FOUR, NONE = np.int64(4), np.int64(0)


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
def _turn(x0, y0, x1, y1, way):
    """Angle between two directions, with the sign of `way`."""
    angle = abs(np.arctan2(x0 * y1 - x1 * y0, x0 * x1 + y0 * y1))
    return angle if way > 0.0 else -angle


@leaf
def half_ball(P, q, n, R, px, py):
    """(integral of S, area) over the part of a polygon in the disc of a ball; (px, py) middle of the cell from its own.

    Each edge with the middle of the ball makes a triangle, the difference of two right triangles with legs p and T.
    """
    volume, area = 0.0, 0.0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        ax, ay, bx, by = px + P[q, i, 0], py + P[q, i, 1], px + P[q, j, 0], py + P[q, j, 1]
        ex, ey = bx - ax, by - ay
        size = np.sqrt(ex * ex + ey * ey)
        if size == 0.0:
            continue
        ex, ey = ex / size, ey / size
        p, t, u = ax * ey - ay * ex, ax * ex + ay * ey, bx * ex + by * ey
        sign, p = (1.0, p) if p > 0.0 else (-1.0, -p)
        if p == 0.0:
            continue
        around = _turn(p, t, p, u, 1.0)
        if p >= R:
            volume += sign * R * R * R / 3.0 * around
            area += sign * 0.5 * R * R * around
            continue
        half = np.sqrt(R * R - p * p)
        v, w = np.sqrt(max(half * half - t * t, 0.0)), np.sqrt(max(half * half - u * u, 0.0))
        volume += sign * (
            p * (u * w - t * v) / 6.0
            + p * (3.0 * R * R - p * p) / 6.0 * _turn(v, t, w, u, 1.0)
            - R * R * R / 3.0 * (_turn(p * v, R * t, p * w, R * u, 1.0) - around)
        )
        c, d = min(max(t, -half), half), min(max(u, -half), half)
        area += sign * 0.5 * p * (d - c)
        if c != t:
            area += sign * 0.5 * R * R * _turn(p, t, p, c, c - t)
        if d != u:
            area += sign * 0.5 * R * R * _turn(p, d, p, u, u - d)
    return volume, area


@leaf
def _under_circle(R, x):
    """Integral of sqrt(R^2 - x^2) from 0 to x, |x| <= R."""
    return 0.5 * (x * np.sqrt(max(R * R - x * x, 0.0)) + R * R * np.arcsin(x / R))


@leaf
def cylinder(P, q, n, R, ux, uy, eta):
    """(integral of S, area, integral of xi, what the first may be off) over the part of a polygon in the strip |eta| <= R;
    xi from the middle of the cell, whose own eta is given.

    Green: the integral of xi g(eta) d eta along the edges.
    """
    volume, area, first, off = 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        ax, ay, bx, by = P[q, i, 0], P[q, i, 1], P[q, j, 0], P[q, j, 1]
        xa, ya = ax * ux + ay * uy, eta + ay * ux - ax * uy
        xb, yb = bx * ux + by * uy, eta + by * ux - bx * uy
        if ya == yb or (ya >= R and yb >= R) or (ya <= -R and yb <= -R):
            continue
        slope = (xb - xa) / (yb - ya)
        c, d = min(max(ya, -R), R), min(max(yb, -R), R)
        xc, xd = xa + slope * (c - ya), xb + slope * (d - yb)
        dy = d - c
        area += 0.5 * (xc + xd) * dy
        first += (xc * xc + xc * xd + xd * xd) * dy / 6.0
        g = _under_circle(R, d) - _under_circle(R, c)
        v, w = np.sqrt(max(R * R - c * c, 0.0)), np.sqrt(max(R * R - d * d, 0.0))
        if abs(yb - ya) > FLAT * abs(xb - xa):
            volume += (xc - slope * c) * g + slope * (v * v * v - w * w * w) / 3.0
            off += ULPS * R * R * (abs(xc) + abs(slope) * R)
        else:  # S differs from its mean by no more than its range: the quotient above would lose digits
            volume += 0.5 * (xc + xd) * g
            off += 0.5 * abs((xd - xc) * dy) * (abs(v - w) if c * d > 0.0 else R)
    return volume, area, first, off


@leaf
def room(head, part, c, rows, k, top, x, y, hx, hy, P):
    """(lo, hi) of the integral of top - f over the part of a cell in the footprint of a ball's sweep; infinitely wide
    where that is not known.

    Patches are divided along a chord of the curve where they meet, no farther from it than
    `sag`: on the wrong side of it their difference, which vanishes with its slope at the curve, is as if a second
    derivative of an end along the motion had added up.
    """
    xi, eta = local(rows, k, x, y)
    ux, uy, L, m = rows[k, 3], rows[k, 4], rows[k, 5], rows[k, 6]
    R = head[c, 1]
    dxi, deta = abs(ux) * hx + abs(uy) * hy, abs(uy) * hx + abs(ux) * hy
    first, last = stretch(head, part, c, rows, k, xi, eta, dxi, deta)
    for v in range(4):
        P[RECT, v, 0] = hx if v == 0 or v == 3 else -hx
        P[RECT, v, 1] = hy if v < 2 else -hy
    if L == 0.0 or last <= 0.0 or first >= L:
        s = L if last > 0.0 and L > 0.0 else 0.0
        gap = top - (rows[k, 2] + m * s + head[c, 3])
        volume, area = half_ball(P, RECT, FOUR, R, x - rows[k, 0] - s * ux, y - rows[k, 1] - s * uy)
        total, error = volume + gap * area, ULPS * R * R * (R + abs(gap))
        return total - error, total + error
    near, far = max(eta - deta, -R), min(eta + deta, R)
    if near >= far:
        return 0.0, 0.0
    w = np.sqrt(1.0 + m * m)
    total, error, q, n = 0.0, 0.0, RECT, FOUR
    if first < 0.0 or last > L:
        nx, ny, offset, wrong = ux, uy, -xi, 0.0
        if m != 0.0:
            most = max(-near, far)
            kappa, least = abs(m) / w, np.sqrt(max(R * R - most * most, 0.0))
            a, b = np.sqrt(max(R * R - near * near, 0.0)), np.sqrt(max(R * R - far * far, 0.0))
            g = (b - a) / (far - near)
            alpha = a - g * near
            sag = kappa * max(R * np.sqrt(1.0 + g * g) - alpha, 0.0) + ULPS * R
            if not least * (1.0 - kappa) > 2.0 * sag:
                return -np.inf, np.inf
            bend = least * least / (least * least - (kappa * least + sag) ** 2) ** 1.5
            wrong = 0.5 * bend * sag * sag * min(4.0 * hx * hy, 2.0 * sag * (far - near))
            g, alpha = g * m / w, alpha * m / w
            nx, ny, offset = ux + g * uy, uy - g * ux, alpha - xi + g * eta
        for end in range(2):
            if (first >= 0.0) if end == 0 else (last <= L):
                continue
            way, s, rest = (1.0, 0.0, HERE) if end == 0 else (-1.0, L, REST)
            corners = clip(P, q, n, BEYOND, way * nx, way * ny, way * (s + offset))
            n, q = clip(P, q, n, rest, -way * nx, -way * ny, -way * (s + offset)), rest
            gap = top - (rows[k, 2] + m * s + head[c, 3])
            volume, area = half_ball(P, BEYOND, corners, R, x - rows[k, 0] - s * ux, y - rows[k, 1] - s * uy)
            total += volume + gap * area
            error += wrong + ULPS * R * R * (R + abs(gap))
    volume, area, along, off = cylinder(P, q, n, R, ux, uy, eta)
    gap = top - (rows[k, 2] + m * xi + head[c, 3])
    total += w * volume + gap * area - m * along
    error += w * off + ULPS * R * (R + hx + hy) * (abs(gap) + abs(m) * (hx + hy))
    return total - error, total + error
