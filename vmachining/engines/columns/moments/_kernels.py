# Integrals over a polygon of what depends on one distance: phi(rho) around an end of a path, chi(eta) beside it.
#
# Legend. phi and chi as in surface/_kernels.py, from the tip; rho distance from the end, eta distance from the line of the path.
# The measure of a polygon over a distance v has moments M_j, integrals of v^j over the part of it between two distances.
# Between these, on one part of the profile, phi is a polynomial or has no negative derivative, so its polynomials through
# two double nodes lie below it, and those through both ends and one double node above. chi on a ramp: of its first three
# derivatives none is negative; polynomials through one end and one double node.
# Of an edge, edges W[i] = (side, p, t, u, rho_t, rho_u, angle_t, angle_u, asinh_t, asinh_u): distance p of its line from
# the end, its corners from the foot t < u, their distances, angles, and asinh(t / p); side the sign of its triangle.
# edges of a strip: (side, y0, y1, xi at y0, slope of xi).

import numpy as np

from vmachining.engines.columns.surface._kernels import ARC, LINE, STEEP, VERTEX, lean, profile
from vmachining.jit import leaf

ULPS = 64.0 * 2.220446049250313e-16  # rounding of one integral by its largest term: some forty operations
STEPS = 4.0  # pieces of an arc from its middle height to where it is upright
GAUSS = 0.5773502691896258  # nodes of two double points for which the error of a constant measure is least
UPRIGHT = (
    1e-6  # of R: nearer to where an arc is upright its height is taken as that of the centre, which is above
)
TINY = 1e-9  # of R: a narrower piece has the heights of its ends
VALUES = 1e4 * 2.220446049250313e-16  # rounding of a height on an arc, R / S < 1e3 beyond UPRIGHT
NONE = np.int64(0)


@leaf
def edges(P, q, n, px, py, W):
    """Edges of a polygon around an end that lies at -(px, py); (number, least, greatest distance of the polygon)."""
    m, around, near, far = NONE, 0.0, np.inf, 0.0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        ax, ay, bx, by = px + P[q, i, 0], py + P[q, i, 1], px + P[q, j, 0], py + P[q, j, 1]
        ex, ey = bx - ax, by - ay
        size = np.sqrt(ex * ex + ey * ey)
        if size == 0.0:
            continue
        ex, ey = ex / size, ey / size
        p, t, u = ax * ey - ay * ex, ax * ex + ay * ey, bx * ex + by * ey
        side, p = (1.0, p) if p > 0.0 else (-1.0, -p)
        rho_t, rho_u = np.sqrt(p * p + t * t), np.sqrt(p * p + u * u)
        near = min(near, p if t < 0.0 < u else min(rho_t, rho_u))
        far = max(far, max(rho_t, rho_u))
        if p == 0.0:
            continue
        W[m, 0], W[m, 1], W[m, 2], W[m, 3], W[m, 4], W[m, 5] = side, p, t, u, rho_t, rho_u
        W[m, 6], W[m, 7] = np.arctan2(t, p), np.arctan2(u, p)
        W[m, 8], W[m, 9] = np.arcsinh(t / p), np.arcsinh(u / p)
        around += side * (W[m, 7] - W[m, 6])
        m += 1
    return m, 0.0 if around > 1.0 else near, far


@leaf
def disc(W, n, c):
    """Moments (M_0, ..., M_3) of the part of a polygon within the distance c of the end."""
    a0, a1, a2, a3 = 0.0, 0.0, 0.0, 0.0
    b0 = 0.5 * c * c
    b1, b2, b3 = c * b0 / 1.5, 0.5 * c * c * b0, c * c * c * b0 / 2.5
    for i in range(n):
        side, p, t, u = W[i, 0], W[i, 1], W[i, 2], W[i, 3]
        half = np.sqrt(max(c * c - p * p, 0.0))
        if c <= p or t >= half or u <= -half:
            angle = W[i, 7] - W[i, 6]
        else:
            angle, r, s, f, g = 0.0, W[i, 4], W[i, 5], W[i, 8], W[i, 9]
            if u > half or t < -half:
                wide, corner = np.log((half + c) / p), np.arctan2(half, p)
                if u > half:
                    angle += W[i, 7] - corner
                    u, s, g = half, c, wide
                if t < -half:
                    angle -= corner + W[i, 6]
                    t, r, f = -half, c, -wide
            square = p * p
            both = s * u - r * t + square * (g - f)
            a0 += side * 0.5 * p * (u - t)
            a1 += side * p / 6.0 * both
            a2 += side * 0.25 * p * (square * (u - t) + (u * u * u - t * t * t) / 3.0)
            a3 += side * 0.05 * p * (u * s * s * s - t * r * r * r + 1.5 * square * both)
        if angle != 0.0:
            angle *= side
            a0, a1, a2, a3 = a0 + b0 * angle, a1 + b1 * angle, a2 + b2 * angle, a3 + b3 * angle
    return a0, a1, a2, a3


@leaf
def strip(P, q, n, ux, uy, eta, near, far, v):
    """Moments of (|eta| - v) of the part of a polygon with near <= |eta| <= far; eta of the middle of the cell."""
    m0, m1, m2, m3 = 0.0, 0.0, 0.0, 0.0
    for flip in range(2):
        way = 1.0 if flip == 0 else -1.0
        for i in range(n):
            j = i + 1 if i + 1 < n else 0
            ax, ay, bx, by = P[q, i, 0], P[q, i, 1], P[q, j, 0], P[q, j, 1]
            ya, yb = way * (eta + ay * ux - ax * uy), way * (eta + by * ux - bx * uy)
            c, d = min(max(ya, near), far), min(max(yb, near), far)
            if c == d:
                continue
            xa, xb = ax * ux + ay * uy, bx * ux + by * uy
            slope = (xb - xa) / (yb - ya)
            x, dy = xa + slope * (0.5 * (c + d) - ya), way * (d - c)
            swing, y, half = slope * 0.5 * (d - c), 0.5 * (c + d) - v, 0.5 * (d - c)
            # of (x + swing s) (y + half s)^j over s in [-1, 1], halved
            k = half * half / 3.0
            f = half * swing / 3.0
            m0 += dy * x
            m1 += dy * (x * y + f)
            m2 += dy * (x * (y * y + k) + 2.0 * y * f)
            m3 += dy * (x * y * (y * y + 3.0 * k) + f * (3.0 * y * y + 1.8 * k))
    return m0, m1, m2, m3


@leaf
def first(P, q, n, ux, uy, eta, near, far):
    """Integral of xi over the same part of a polygon."""
    total = 0.0
    for flip in range(2):
        way = 1.0 if flip == 0 else -1.0
        for i in range(n):
            j = i + 1 if i + 1 < n else 0
            ax, ay, bx, by = P[q, i, 0], P[q, i, 1], P[q, j, 0], P[q, j, 1]
            ya, yb = way * (eta + ay * ux - ax * uy), way * (eta + by * ux - bx * uy)
            c, d = min(max(ya, near), far), min(max(yb, near), far)
            if c == d:
                continue
            xa, xb = ax * ux + ay * uy, bx * ux + by * uy
            slope = (xb - xa) / (yb - ya)
            xc, xd = xa + slope * (c - ya), xa + slope * (d - ya)
            total += way * (d - c) * (xc * xc + xc * xd + xd * xd) / 6.0
    return total


@leaf
def _centred(m, most, error):
    """A centred moment and its rounding: it is no larger than `most`, that of the whole measure at the half width."""
    return min(max(m, -most), most), min(error, 2.0 * most)


@leaf
def fourth(fa, fl, fm, fr, fb, dl, dm, dr, h, m0, m1, m2, m3, e0, scale):
    """(lo, hi) of the integral of f whose fourth derivative is nowhere negative, by its centred moments; values at
    -h, -g, 0, g, h and slopes at the inner three, g = GAUSS h. e0 scale^j: rounding of moments."""
    g = GAUSS * h
    D = (fr - fl) / (2.0 * g)
    c3 = (0.5 * (dl + dr) - D) / (2.0 * g * g)
    c1 = D - c3 * g * g
    c2 = (dr - dl) / (4.0 * g)
    c0 = 0.5 * (fl + fr) - c2 * g * g
    k2 = (0.5 * (fa + fb) - fm) / (h * h)
    k3 = (0.5 * (fb - fa) - dm * h) / (h * h * h)
    room = m0 + e0
    m1, e1 = _centred(m1, h * room, e0 * scale)
    m2, e2 = _centred(m2, h * h * room, e0 * scale * scale)
    m3, e3 = _centred(m3, h * h * h * room, e0 * scale * scale * scale)
    lo = c0 * m0 + c1 * m1 + c2 * m2 + c3 * m3 - (abs(c0) * e0 + abs(c1) * e1 + abs(c2) * e2 + abs(c3) * e3)
    hi = fm * m0 + dm * m1 + k2 * m2 + k3 * m3 + (abs(fm) * e0 + abs(dm) * e1 + abs(k2) * e2 + abs(k3) * e3)
    return lo, hi


@leaf
def third(fa, fl, fr, fb, dl, dr, h, m0, m1, m2, e0, scale):
    """The same of f whose third derivative is nowhere negative; values at -h, -h / 3, h / 3, h, slopes at the inner two."""
    w = 4.0 * h / 3.0
    k = (fa - fr + dr * w) / (w * w)  # through -h and twice h / 3
    s = h / 3.0
    c0, c1 = fr - dr * s + k * s * s, dr - 2.0 * k * s
    j = (fb - fl - dl * w) / (w * w)
    b0, b1 = fl + dl * s + j * s * s, dl + 2.0 * j * s
    room = m0 + e0
    m1, e1 = _centred(m1, h * room, e0 * scale)
    m2, e2 = _centred(m2, h * h * room, e0 * scale * scale)
    lo = c0 * m0 + c1 * m1 + k * m2 - (abs(c0) * e0 + abs(c1) * e1 + abs(k) * e2)
    hi = b0 * m0 + b1 * m1 + j * m2 + (abs(b0) * e0 + abs(b1) * e1 + abs(j) * e2)
    return lo, hi


@leaf
def reaches(part, c, n, depth):
    """Distance up to which a profile is no higher than `depth` over the tip."""
    found = 0.0
    for i in range(n):
        kind, z = part[c, i, 0], part[c, i, 6]
        if kind == VERTEX:
            continue
        if kind == LINE:
            slope = part[c, i, 3]
            if z > depth:
                return found
            found = part[c, i, 2]
            if z + slope * (found - part[c, i, 1]) > depth:
                return min(part[c, i, 1] + (depth - z) / slope, found)
        else:
            a, r = part[c, i, 5], part[c, i, 7]
            t = part[c, i, 2] - a
            found = part[c, i, 2]
            if z - np.sqrt(max(r * r - t * t, 0.0)) > depth:
                drop = max(z - depth, 0.0)
                if drop >= r:
                    return part[c, i, 1]
                return min(max(a + np.sqrt(r * r - drop * drop), part[c, i, 1]), found)
    return found


@leaf
def _bounded(lo, hi, fa, fb, m0, e0, off):
    """A bracket with its rounding `off` of values, no wider than what a rising f has from fa at one end to fb at the other."""
    lo, hi = lo - off * (m0 + e0), hi + off * (m0 + e0)
    return max(lo, fa * m0 - abs(fa) * e0), min(hi, fb * m0 + abs(fb) * e0)


@leaf
def over_arc(part, c, i, R, x0, x1, m0, m1, m2, m3, e0, scale):
    """(lo, hi) of the integral of phi over what lies between x0 and x1 on an arc; moments about their middle."""
    a, z, r = part[c, i, 5], part[c, i, 6], part[c, i, 7]
    v, h = 0.5 * (x0 + x1) - a, 0.5 * (x1 - x0)
    t = x0 - a
    fa = z - np.sqrt(max((r - t) * (r + t), 0.0))
    t = x1 - a
    fb = z - np.sqrt(max((r - t) * (r + t), 0.0)) if r - t > UPRIGHT * R else z
    if h <= TINY * R:
        return _bounded(-np.inf, np.inf, fa, fb, m0, e0, 0.0)
    t = v - GAUSS * h
    S = np.sqrt((r - t) * (r + t))
    fl, dl = z - S, t / S
    S = np.sqrt((r - v) * (r + v))
    fm, dm = z - S, v / S
    t = v + GAUSS * h
    S = np.sqrt((r - t) * (r + t))
    fr, dr = z - S, t / S
    lo, hi = fourth(fa, fl, fm, fr, fb, dl, dm, dr, h, m0, m1, m2, m3, e0, scale)
    return _bounded(lo, hi, fa, fb, m0, e0, VALUES * R * (1.0 + R / h))


@leaf
def chi(head, part, c, m, eta):
    """(chi, its slope, lean, rho of the touching point) at 0 <= eta <= R of the middle of a sweep that rises by m >= 0."""
    R = head[c, 1]
    u = lean(head, part, c, m, eta)
    rho = min(np.sqrt(u * u + eta * eta), R)
    phi, _, low, high = profile(head, part, c, rho)
    slope = low
    if high > low:
        slope = min(max(m * rho / u, low), high) if u > 0.0 else high
    return phi - m * u, (slope * eta / rho if rho > 0.0 else 0.0), u, rho


@leaf
def over_ramp(head, part, c, m, x0, x1, m0, m1, m2, e0, scale):
    """(lo, hi) of the integral of chi, slope m > 0 of the motion, between two eta on one part of the profile."""
    R, h = head[c, 1], 0.5 * (x1 - x0)
    fa, fb = chi(head, part, c, m, x0)[0], chi(head, part, c, m, x1)[0]
    if h <= TINY * R:
        return _bounded(-np.inf, np.inf, fa, fb, m0, e0, 0.0)
    v = 0.5 * (x0 + x1)
    fl, dl, _, _ = chi(head, part, c, m, v - h / 3.0)
    fr, dr, _, _ = chi(head, part, c, m, v + h / 3.0)
    if not dr < STEEP:
        return _bounded(-np.inf, np.inf, fa, fb, m0, e0, 0.0)
    lo, hi = third(fa, fl, fr, fb, dl, dr, h, m0, m1, m2, e0, scale)
    return _bounded(lo, hi, fa, fb, m0, e0, VALUES * R * (1.0 + m) * (1.0 + R / h))


@leaf
def pieces(upright, x0, x1):
    """(number, cube root of what is left to where the arc is upright at x0, its step): pieces finer towards that."""
    k0, k1 = np.cbrt(max(upright - x0, 0.0)), np.cbrt(max(upright - x1, 0.0))
    if not k0 > 0.0:
        return 1, k0, 0.0
    n = max(int(np.ceil(STEPS * (1.0 - k1 / k0))), 1)
    return n, k0, (k1 - k0) / n


@leaf
def around(head, part, c, W, n, near, far, depth):
    """(lo, hi) of the integral of max(0, depth - phi) over a polygon around an end, within the cutter; edges in W."""
    parts, R = int(head[c, 0]), head[c, 1]
    far = min(far, reaches(part, c, parts, depth))
    e0, scale = ULPS * R * R, 2.0 * R
    lo, hi, area = 0.0, 0.0, 0.0
    b0, b1, b2, b3 = 0.0, 0.0, 0.0, 0.0
    for i in range(parts):
        x0, x1 = max(part[c, i, 1], near), min(part[c, i, 2], far)
        kind = part[c, i, 0]
        if kind == VERTEX or not x0 < x1:
            continue
        upright = part[c, i, 5] + part[c, i, 7]
        count, root, step = 1, 0.0, 0.0
        if kind == ARC:
            count, root, step = pieces(upright, x0, x1)
        u = x0
        for j in range(count):
            w = x1 if j == count - 1 else min(max(upright - (root + (j + 1) * step) ** 3, u), x1)
            a0, a1, a2, a3 = b0, b1, b2, b3
            b0, b1, b2, b3 = disc(W, n, w)
            m0, m1, m2, m3 = b0 - a0, b1 - a1, b2 - a2, b3 - a3
            area += m0
            if kind == LINE:
                slope = part[c, i, 3]
                z = part[c, i, 6] - slope * part[c, i, 1]
                found = z * m0 + slope * m1
                off = abs(z) * e0 + slope * e0 * R
                lo, hi = lo + found - off, hi + found + off
            else:
                v = 0.5 * (u + w)
                m3 = m3 - v * (3.0 * m2 - v * (3.0 * m1 - v * m0))
                m2 = m2 - v * (2.0 * m1 - v * m0)
                m1 = m1 - v * m0
                a, b = over_arc(part, c, i, R, u, w, m0, m1, m2, m3, e0, scale)
                lo, hi = lo + a, hi + b
            u = w
    off = ULPS * R * R * (abs(depth) + R)
    return depth * area - hi - off, depth * area - lo + off


@leaf
def beside(head, part, c, m, P, q, n, ux, uy, eta, near, far, wide, depth):
    """(lo, hi) of the integral of depth - m xi - chi over a polygon in the middle of a sweep, near <= |eta| <= far; of
    its positive part where m = 0. xi from the middle of the cell, wide: what it may be; depth from the start's tip there."""
    parts, R, rise = int(head[c, 0]), head[c, 1], abs(m)
    far = min(far, reaches(part, c, parts, depth) if m == 0.0 else R)
    lo, hi, area, begin = 0.0, 0.0, 0.0, 0.0
    e0 = ULPS * R * wide
    for i in range(parts):
        kind = part[c, i, 0]
        p, end = part[c, i, 4], part[c, i, 2]
        if m != 0.0:
            if p <= rise:
                continue
            if i < parts - 1:
                end *= np.sqrt(1.0 - (rise / p) ** 2)
        x0, x1 = max(begin, near), min(end, far)
        begin = end
        if not x0 < x1:
            continue
        if (
            m != 0.0 and part[c, i, 5] < 0.0
        ):  # an arc about a point beyond the axis: the third derivative may be negative
            return -np.inf, np.inf
        upright, count, root, step = part[c, i, 5] + part[c, i, 7], 1, 0.0, 0.0
        if kind == VERTEX:
            upright = part[c, i, 2]
        if kind != LINE:
            count, root, step = pieces(upright, x0, x1)
        u = x0
        for j in range(count):
            w = x1 if j == count - 1 else min(max(upright - (root + (j + 1) * step) ** 3, u), x1)
            v = 0.5 * (u + w)
            m0, m1, m2, m3 = strip(P, q, n, ux, uy, eta, u, w, v)
            area += m0
            if m != 0.0:
                a, b = over_ramp(head, part, c, rise, u, w, m0, m1, m2, e0, 0.5 * (w - u))
            elif kind == LINE:
                slope = part[c, i, 3]
                a = (part[c, i, 6] + slope * (v - part[c, i, 1])) * m0 + slope * m1
                off = abs(part[c, i, 6]) * e0 + slope * R * e0
                a, b = a - off, a + off
            else:
                a, b = over_arc(part, c, i, R, u, w, m0, m1, m2, m3, e0, 0.5 * (w - u))
            lo, hi = lo + a, hi + b
            u = w
    along = 0.0
    if m != 0.0:
        along = first(P, q, n, ux, uy, eta, near, far)
    total, off = depth * area - m * along, ULPS * R * wide * (abs(depth) + R + rise * wide)
    return total - hi - off, total - lo + off
