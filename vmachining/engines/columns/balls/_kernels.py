# Volume between the top of the stock and a sweep of a ball over one cell: closed, whatever its motion.
#
# Legend. S is the height of a patch over the rim, the root of R^2 - distance^2 for an end, of R^2 - eta^2 for the middle, 0
# outside the footprint. An end at s and the middle meet where the plane through the ball's centre across the motion meets
# the ball: xi - s = bulge sqrt(R^2 - eta^2), an ellipse, and the ray xi = s beyond the strip; bulge = m / sqrt(1 + m^2).
# Corners W[v] = (xi from the middle of the cell, eta), against the clock. Integrals over a part of the cell are sums over
# its border, of a term for each straight edge and one for the curve.

import numpy as np

from vmachining.jit import inner, leaf

ULPS = 64.0 * 2.220446049250313e-16  # rounding of one integral by its largest term: some forty operations
FLAT = 1e-3  # an edge that is this nearly along the motion is bounded, see `strip_edge`


@inner
def _turn(x0, y0, x1, y1, way):
    """Angle between two directions, with the sign of `way`."""
    angle = abs(np.arctan2(x0 * y1 - x1 * y0, x0 * x1 + y0 * y1))
    return angle if way > 0.0 else -angle


@leaf
def ball_edge(ax, ay, bx, by, R):
    """(integral of S, area) over the part of a triangle in the disc of a ball: an edge and the middle of the ball.

    It is the difference of two right triangles with legs p and T.
    """
    ex, ey = bx - ax, by - ay
    size = np.sqrt(ex * ex + ey * ey)
    if size == 0.0:
        return 0.0, 0.0
    ex, ey = ex / size, ey / size
    p, t, u = ax * ey - ay * ex, ax * ex + ay * ey, bx * ex + by * ey
    sign, p = (1.0, p) if p > 0.0 else (-1.0, -p)
    if p == 0.0:
        return 0.0, 0.0
    if p >= R:
        around = _turn(p, t, p, u, 1.0)
        return sign * R * R * R / 3.0 * around, sign * 0.5 * R * R * around
    half = np.sqrt(R * R - p * p)
    v, w = np.sqrt(max(half * half - t * t, 0.0)), np.sqrt(max(half * half - u * u, 0.0))
    # angle between (p v, R t) and (p w, R u) less that between (p, t) and (p, u), t < u: between -pi and pi
    x, y = p * p * v * w + R * R * t * u, R * p * (v * u - w * t)
    along, across = p * p + t * u, p * (u - t)
    excess = np.arctan2(y * along - x * across, x * along + y * across)
    volume = (
        p * (u * w - t * v) / 6.0
        + p * (3.0 * R * R - p * p) / 6.0 * _turn(v, t, w, u, 1.0)
        - R * R * R / 3.0 * excess
    )
    c, d = min(max(t, -half), half), min(max(u, -half), half)
    area = 0.5 * p * (d - c)
    if c != t:
        area += 0.5 * R * R * _turn(p, t, p, c, c - t)
    if d != u:
        area += 0.5 * R * R * _turn(p, d, p, u, u - d)
    return sign * volume, sign * area


@leaf
def strip_edge(xa, ya, xb, yb, R):
    """(integral of S, area, integral of xi, what the first may be off) of an edge in the strip |eta| <= R.

    Green: the integral of xi S d eta along the edge. Rounding of the roots v, w cancels in both terms of g, also at the rim.
    """
    if ya == yb or (ya >= R and yb >= R) or (ya <= -R and yb <= -R):
        return 0.0, 0.0, 0.0, 0.0
    slope = (xb - xa) / (yb - ya)
    c, d = min(max(ya, -R), R), min(max(yb, -R), R)
    xc, xd = xa + slope * (c - ya), xb + slope * (d - yb)
    dy = d - c
    area, first = 0.5 * (xc + xd) * dy, (xc * xc + xc * xd + xd * xd) * dy / 6.0
    v, w = np.sqrt(max(R * R - c * c, 0.0)), np.sqrt(max(R * R - d * d, 0.0))
    g = 0.5 * (d * w - c * v + R * R * _turn(v, c, w, d, dy))  # integral of S over eta
    if abs(yb - ya) > FLAT * abs(xb - xa):
        volume = (xc - slope * c) * g + slope * (v * v * v - w * w * w) / 3.0
        return volume, area, first, ULPS * R * R * (abs(xc) + abs(slope) * R)
    # S differs from its mean by no more than its range: the quotient above would lose digits
    volume = 0.5 * (xc + xd) * g
    return volume, area, first, 0.5 * abs((xd - xc) * dy) * (abs(v - w) if c * d > 0.0 else R)


@leaf
def _excess(bulge, w, s0, k0, s1, k1):
    """Area on the unit ball between its lowest point and the great circle, between two angles of sines s and cosines k."""
    return 2.0 * np.arctan2(bulge * (k0 * s1 - k1 * s0), 1.0 + (k0 + k1) / w + k0 * k1 + s0 * s1)


@leaf
def curve(R, bulge, w, o, y0, y1):
    """What the curve adds from one eta to another: (integral of S, area) of the end, (integral of S, area, integral of
    xi) of the middle, where xi of the end is o.

    With eta = R sin a the curve is xi - o = bulge R cos a. The end: a third of what flows through the border of the solid
    if all flows from the ball's centre, R times the area on the ball and S (x dy - y dx) through the curve. Cosines are
    those of the places where edges meet the curve, digit for digit: near the rim their rounding is a length.
    """
    y0, y1 = min(max(y0, -R), R), min(max(y1, -R), R)
    s0, s1 = y0 / R, y1 / R
    k0, k1 = np.sqrt(R * R - y0 * y0) / R, np.sqrt(R * R - y1 * y1) / R
    rise = s1 - s0
    turn = _turn(k0, s0, k1, s1, rise)
    half, cube = 0.5 * (turn + s1 * k1 - s0 * k0), rise - (s1 * s1 * s1 - s0 * s0 * s0) / 3.0
    if s0 * s1 < 0.0:  # not from rim to rim at once
        excess = _excess(bulge, w, s0, k0, 0.0, 1.0) + _excess(bulge, w, 0.0, 1.0, s1, k1)
    else:
        excess = _excess(bulge, w, s0, k0, s1, k1)
    square = R * R
    return (
        square * R / 3.0 * (excess + bulge / w * rise),
        0.5 * bulge * square * turn,
        square * (o * half + bulge * R * cube),
        R * (o * rise + bulge * R * half),
        0.5 * R * (o * (o * rise + 2.0 * bulge * R * half) + square * bulge * bulge * cube),
    )


@leaf
def _crossings(xa, ya, dx, dy, R, bulge):
    """(number, shares of the way, rising) at which an edge may cross the curve or its rays; xa from the end."""
    n, t0, t1, t2, zero = 0, 1.0, 1.0, 1.0, (-xa / dx if dx != 0.0 else 1.0)
    if bulge != 0.0:
        q = bulge * bulge
        A, B = dx * dx + q * dy * dy, xa * dx + q * ya * dy
        D = B * B - A * (xa * xa + q * (ya * ya - R * R))
        if D > 0.0:
            root = np.sqrt(D)
            for k in range(2):
                t = (-B - root if k == 0 else -B + root) / A
                if 0.0 < t < 1.0 and (xa + t * dx) * bulge >= 0.0:
                    n, t0, t1 = n + 1, min(t, t0), (t if n > 0 else 1.0)
    # a ray; or so near to where the curve ends, or a curve so straight, that rounding hid it
    if 0.0 < zero < 1.0 and (n == 0 or abs(ya + zero * dy) >= R):
        n += 1
        if zero < t0:
            t0, t1, t2 = zero, t0, t1
        elif zero < t1:
            t1, t2 = zero, t1
        else:
            t2 = zero
    return n, t0, t1, t2


@leaf
def _closing(x, y, R, bulge, leaves):
    """(integral of S, area) that an edge adds from a place of the border to the curve, or back; its length."""
    on = bulge * np.sqrt(max(R * R - y * y, 0.0))
    if on == x:
        return 0.0, 0.0, 0.0
    a, b = ball_edge(x, y, on, y, R)
    if leaves:
        return a, b, abs(on - x)
    return -a, -b, abs(on - x)


@leaf
def _end(W, n, R, bulge, w, m, o, way, here, there, wide):
    """(room under an end less that under the middle, what it may be off) over the part of a cell where the end is touched:
    beyond the curve, on its side `way`. o: xi of the end; wide: of the cell. here, there: top less height of the ball's
    centre at the end, and of the middle where xi = 0. The second is infinite where the curve enters the cell more than once.

    Borders are closed where an edge meets the curve; what then lies on the wrong side is added to what may be off.
    """
    total, off, leaves, enters, out, back, begun, before = 0.0, 0.0, 0, 0, 0.0, 0.0, False, False
    for v in range(n):
        j = v + 1 if v + 1 < n else 0
        xa, ya, xb, yb = W[v, 0], W[v, 1], W[j, 0], W[j, 1]
        dx, dy = xb - xa, yb - ya
        cuts, t0, t1, t2 = _crossings(xa - o, ya, dx, dy, R, bulge)
        x0, y0 = xa, ya
        for q in range(cuts + 1):
            x1, y1 = xb, yb
            if q < cuts:
                t = t0 if q == 0 else (t1 if q == 1 else t2)
                x1, y1 = xa + t * dx, ya + t * dy
            x, y = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
            inside = way * (x - o - bulge * np.sqrt(max(R * R - y * y, 0.0))) > 0.0
            if v == 0 and q == 0:
                begun = inside
            elif inside != before:
                a, b, d = _closing(x0 - o, y0, R, bulge, before)
                total, off = total + a + here * b, off + d
                if before:
                    leaves, out = leaves + 1, y0
                else:
                    enters, back = enters + 1, y0
            before = inside
            if inside:
                a, b = ball_edge(x0 - o, y0, x1 - o, y1, R)
                c, d, e, wrong = strip_edge(x0, y0, x1, y1, R)
                total += a + here * b - (w * c + there * d - m * e)
                off += w * wrong
            x0, y0 = x1, y1
    if begun != before:
        a, b, d = _closing(W[0, 0] - o, W[0, 1], R, bulge, before)
        total, off = total + a + here * b, off + d
        if before:
            leaves, out = leaves + 1, W[0, 1]
        else:
            enters, back = enters + 1, W[0, 1]
    if leaves > 1 or enters > 1:
        return 0.0, np.inf
    if leaves == 1:
        a, b, c, d, e = curve(R, bulge, w, o, out, back)
        total += a + here * b - (w * c + there * d - m * e)
    return total, off * wide * (R * (1.0 + w) + abs(m) * (R + wide))


@leaf
def ball_room(lines, i, R, gap, first, last, hx, hy, xi, eta, P, at, n, W):
    """(lo, hi) of the integral of top - f over the part of a polygon of a cell in the footprint of a ball's sweep, which lies
    nowhere above the top; infinitely wide where that is not known.

    gap: top less height of the ball's centre at the start; first, last: of the touching poses; xi, eta of the cell.
    """
    ux, uy, L, m = lines[i, 3], lines[i, 4], lines[i, 5], lines[i, 6]
    for v in range(n):
        x, y = P[at, v, 0], P[at, v, 1]
        W[v, 0], W[v, 1] = x * ux + y * uy, eta + y * ux - x * uy
    total, off = 0.0, 0.0
    if L == 0.0 or last <= 0.0 or first >= L:
        s = L if last > 0.0 else 0.0
        for v in range(n):
            j = v + 1 if v + 1 < n else 0
            a, b = ball_edge(W[v, 0] + xi - s, W[v, 1], W[j, 0] + xi - s, W[j, 1], R)
            total += a + (gap - m * s) * b
        off = ULPS * R * R * (R + abs(gap - m * s))
        return total - off, total + off
    w, there = np.sqrt(1.0 + m * m), gap - m * xi
    for v in range(n):
        j = v + 1 if v + 1 < n else 0
        a, b, c, wrong = strip_edge(W[v, 0], W[v, 1], W[j, 0], W[j, 1], R)
        total, off = total + w * a + there * b - m * c, off + w * wrong
    for end in range(2):
        if (first >= 0.0) if end == 0 else (last <= L):
            continue
        s = L if end else 0.0
        way = 1.0 if end else -1.0
        a, b = _end(W, n, R, m / w, w, m, s - xi, way, gap - m * s, there, hx + hy)
        total, off = total + a, off + b
        off += ULPS * (R + hx + hy) * (R + hx + hy) * (R * (1.0 + w + abs(m)) + abs(gap - m * s) + abs(there))
    off += ULPS * R * (R + hx + hy) * (abs(there) + abs(m) * (hx + hy))
    if not off < np.inf:
        return -np.inf, np.inf
    return total - off, total + off
