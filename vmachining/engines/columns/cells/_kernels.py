# Bounds of the volume that a sweep k removes in a rectangle of the plan,
#
#     V = integral of max(0, min(top, f_1, ..., f_{k-1}) - max(f_k, bottom)).
#
# Legend. (x, y) centre, hx, hy half sizes of the cell; points of planes are relative to the centre.
# E[i] what is known of surface i in the cell, i = 0 the top of the stock, 1 ... n earlier sweeps, n + 1 sweep k. Columns
# 0-7 the upper side (of the cutter that the sweep holds), 8-15 the lower side (of the cutter that holds it):
#   value, gx, gy, Mxx, Mxy, Myy, radius, flag; radius bounds |f'' - M|. Of the top of a stock of facets: planes above
#   and below it.
# flag: SMOOTH value, gradient and M hold; ROUGH whole in the footprint, of the lower side value and gradient of a plane
# below f; PART the border of the footprint crosses the cell (lower side as ROUGH); OUT absent.
# lines[i] the straight sweep that stands for surface i in the cell, see arcs/_kernels.py.
# rules: bits of those in force. Each alone may be switched off, which widens brackets: tests do it.
# P[q] polygons, corners (x, y); C[i] = (nx, ny, c_in, c_out) of surfaces whose border crosses the cell.

import numpy as np

from vmachining.engines.columns.arcs._kernels import place, same_arc
from vmachining.engines.columns.patches._kernels import clip, room
from vmachining.engines.columns.roof._kernels import OUTSIDE, WHOLE, over_cell
from vmachining.engines.columns.surface._kernels import (
    COLUMNS,
    FROM,
    OF,
    TO,
    bending,
    covers,
    distance,
    height,
    lean,
    lean_at,
    local,
    poses,
    profile,
    surface,
)
from vmachining.jit import leaf

SMOOTH, ROUGH, PART, OUT = 3.0, 2.0, 1.0, 0.0
UP, DOWN = np.int64(0), np.int64(8)  # first column of a side; typed, see surface/_kernels.py
TOP, SELF, FIRST = (
    np.int64(0),
    np.int64(1),
    np.int64(2),
)  # rows: top of the stock, sweep k, first earlier sweep
RECT, CUT, HERE, BEYOND, ROUND = np.int64(0), np.int64(1), np.int64(2), np.int64(3), np.int64(4)  # polygons
FOUR, NONE = np.int64(4), np.int64(-1)
CURVATURE, ABOVE, BELOW = np.int64(1), np.int64(2), np.int64(4)  # R3; R4 and R5 by planes and chords
COVER, FORGET, CLOSED = np.int64(8), np.int64(16), np.int64(32)  # R7, R8, closed integrals
ALL = np.int64(63)
THIN = 1e-4  # a gradient this much flatter along one side of the cell is taken as level there


@leaf
def positive(c, a, b, hx, hy, way):
    """Integral of max(0, c + gx x + gy y) over the cell, a = |gx| hx, b = |gy| hy; way +1 from above, -1 from below."""
    area = 4.0 * hx * hy
    if a < b:
        a, b = b, a
    if c >= a + b:
        return area * c
    if c <= -(a + b):
        return 0.0
    if b <= THIN * a:
        c += way * b
        if c >= a:
            return area * c
        return area * (c + a) ** 2 / (4.0 * a) if c > -a else 0.0
    total = (c + a + b) ** 3
    if c + a - b > 0.0:
        total -= (c + a - b) ** 3
    if c - a + b > 0.0:
        total -= (c - a + b) ** 3
    if c - a - b > 0.0:
        total += (c - a - b) ** 3
    return area * total / (24.0 * a * b)


@leaf
def above_zero(area, u, v, w):
    """Integral of the positive part of a linear function over a triangle from its values at the corners."""
    if u > v:
        u, v = v, u
    if v > w:
        v, w = w, v
    if u > v:
        u, v = v, u
    if u >= 0.0:
        return area * (u + v + w) / 3.0
    if w <= 0.0:
        return 0.0
    if v <= 0.0:
        return area * w * w * w / (3.0 * (w - u) * (w - v))
    return area * ((u + v + w) / 3.0 - u * u * u / (3.0 * (v - u) * (w - u)))


@leaf
def _leaves(rows, k, R, ax, ay, bx, by):
    """Where the way from a point a of the footprint to a point b leaves it, as a share of the way."""
    L = rows[k, 5]
    xa, ya = local(rows, k, ax, ay)
    xb, yb = local(rows, k, bx, by)
    dx, dy = xb - xa, yb - ya
    best = 0.0
    for e in range(2):  # the discs at both ends
        x = xa - e * L
        q, h, w = dx * dx + dy * dy, x * dx + ya * dy, x * x + ya * ya - R * R
        root = h * h - q * w
        if root > 0.0 and q > 0.0:
            best = max(best, (np.sqrt(root) - h) / q)
    t0, t1 = 0.0, 1.0
    for side in range(2):  # the strip between them
        p, d, low, high = (xa, dx, 0.0, L) if side == 0 else (ya, dy, -R, R)
        if d == 0.0:
            if p < low or p > high:
                t1 = -1.0
            continue
        u, v = (low - p) / d, (high - p) / d
        t0, t1 = max(t0, min(u, v)), min(t1, max(u, v))
    if t1 >= t0:
        best = max(best, t1)
    return min(best, 1.0)


@leaf
def border(head, rows, k, cin, cout, x, y, hx, hy, C, i):
    """Chord and outer tangent of the footprint in the cell: n.p <= c_in inside (for corners of the cell only), n.p >
    c_out outside. False if the footprint misses the cell."""
    R = head[cin, 1]
    inside, crossings = 0, 0
    px, py, qx, qy = 0.0, 0.0, 0.0, 0.0
    ax, ay = x + hx, y - hy
    a_in = distance(rows, k, ax, ay) <= R
    for j in range(4):
        bx, by = (x + hx if j == 0 or j == 3 else x - hx), (y + hy if j < 2 else y - hy)
        b_in = distance(rows, k, bx, by) <= R
        inside += 1 if b_in else 0
        if a_in != b_in:
            if a_in:
                t = _leaves(rows, k, R, ax, ay, bx, by)
                cx, cy = ax + t * (bx - ax) - x, ay + t * (by - ay) - y
            else:
                t = _leaves(rows, k, R, bx, by, ax, ay)
                cx, cy = bx + t * (ax - bx) - x, by + t * (ay - by) - y
            if crossings == 0:
                px, py = cx, cy
            else:
                qx, qy = cx, cy
            crossings += 1
        ax, ay, a_in = bx, by, b_in
    xi, eta = local(rows, k, x, y)
    s = min(max(xi, 0.0), rows[k, 5])
    ux, uy = rows[k, 3], rows[k, 4]
    t = xi - s
    nx, ny = t * ux - eta * uy, t * uy + eta * ux  # from the path to the centre
    size = np.sqrt(nx * nx + ny * ny)
    nx, ny = (nx / size, ny / size) if size > 0.0 else (1.0, 0.0)
    c_in = -np.inf
    if crossings == 2:
        ex, ey = qy - py, px - qx
        size = np.sqrt(ex * ex + ey * ey)
        if size > 1e-3 * min(hx, hy):
            way = 1.0 if ex * nx + ey * ny > 0.0 else -1.0
            nx, ny = way * ex / size, way * ey / size
            c_in = min(nx * px + ny * py, nx * qx + ny * qy)
    x0, y0, L = rows[k, 0] - x, rows[k, 1] - y, rows[k, 5]
    reach = nx * x0 + ny * y0 + max(0.0, L * (nx * ux + ny * uy)) + head[cout, 1]
    C[i, 0], C[i, 1], C[i, 2], C[i, 3] = nx, ny, c_in, reach
    return reach > -(abs(nx) * hx + abs(ny) * hy)


@leaf
def _inside(rows, k, R, x, y, hx, hy):
    """Whether the corners of the cell, hence the cell, lie in the footprint."""
    return (
        distance(rows, k, x - hx, y - hy) <= R
        and distance(rows, k, x + hx, y - hy) <= R
        and distance(rows, k, x - hx, y + hy) <= R
        and distance(rows, k, x + hx, y + hy) <= R
    )


@leaf
def _side(head, part, rows, k, c, rules, x, y, hx, hy, xi, eta, far, d, E, i, e):
    """Fill one side of E[i]: sweep k with cutter c in the cell."""
    R = head[c, 1]
    for j in range(3, 8):
        E[i, e + j] = 0.0
    if far + d <= R or _inside(rows, k, R, x, y, hx, hy):
        poses(head, part, c, rows, k, x, y, hx, hy)
        z, tangent, gx, gy = surface(head, part, c, rows, k, x, y, lean_at(head, part, c, rows, k, xi, eta))
        E[i, e + 1], E[i, e + 2] = gx, gy
        xx, xy, yy, radius = 0.0, 0.0, 0.0, np.inf
        if rules & CURVATURE:
            xx, xy, yy, radius = bending(head, part, c, rows, k, xi, eta, hx, hy)
        if radius <= xx + yy or radius * d <= 1e-9:
            E[i, e + 3], E[i, e + 4], E[i, e + 5], E[i, e + 6] = xx, xy, yy, radius
            E[i, e], E[i, e + 7] = z, SMOOTH
        else:
            E[i, e], E[i, e + 7] = tangent, ROUGH
        return
    # a plane that touches inside the footprint, half way between its border and the far side of the cell
    qx, qy = x, y
    if far > 0.0:
        s = min(max(xi, 0.0), rows[k, 5])
        t = xi - s
        want = min(far, 0.5 * (R + max(far - d, 0.0)), R * (1.0 - 1e-9)) / far
        qx = rows[k, 0] + (s + want * t) * rows[k, 3] - want * eta * rows[k, 4]
        qy = rows[k, 1] + (s + want * t) * rows[k, 4] + want * eta * rows[k, 3]
    u = lean(head, part, c, abs(rows[k, 6]), min(abs(local(rows, k, qx, qy)[1]), R))
    _, tangent, gx, gy = surface(head, part, c, rows, k, qx, qy, u)
    E[i, e] = tangent + gx * (x - qx) + gy * (y - qy)
    E[i, e + 1], E[i, e + 2], E[i, e + 7] = gx, gy, PART


@leaf
def look(head, part, rows, k, cin, cout, rules, x, y, hx, hy, E, C, i):
    """Fill E[i], C[i] for line k: upper side with cutter cin, lower side with cout. False if it misses the cell."""
    d = np.sqrt(hx * hx + hy * hy)
    far = distance(rows, k, x, y)
    if far - d >= max(head[cin, 1], head[cout, 1]):
        return False
    xi, eta = local(rows, k, x, y)
    C[i, 2], C[i, 3] = np.inf, np.inf
    _side(head, part, rows, k, cin, rules, x, y, hx, hy, xi, eta, far, d, E, i, UP)
    if cin == cout:
        for j in range(8):
            E[i, DOWN + j] = E[i, UP + j]
    else:
        _side(head, part, rows, k, cout, rules, x, y, hx, hy, xi, eta, far, d, E, i, DOWN)
    if E[i, UP + 7] == PART or E[i, DOWN + 7] == PART:
        return border(head, rows, k, cin, cout, x, y, hx, hy, C, i)
    return True


@leaf
def bends(E, i, a, j, b, hx, hy, way):
    """Bound of the part of second order of surface (i, a) minus surface (j, b): from above way +1, from below -1."""
    xx, xy, yy = E[i, a + 3] - E[j, b + 3], E[i, a + 4] - E[j, b + 4], E[i, a + 5] - E[j, b + 5]
    r = E[i, a + 6] + E[j, b + 6]
    return way * (
        0.5 * (max(way * xx + r, 0.0) * hx * hx + max(way * yy + r, 0.0) * hy * hy) + abs(xy) * hx * hy
    )


@leaf
def mean_bend(E, i, a, j, b, hx, hy, way):
    """The same in the mean over the cell."""
    r = E[i, a + 6] + E[j, b + 6]
    xx, yy = E[i, a + 3] - E[j, b + 3], E[i, a + 5] - E[j, b + 5]
    return ((xx + way * r) * hx * hx + (yy + way * r) * hy * hy) / 6.0


@leaf
def floor_of(E, i, bottom, hx, hy):
    """Turn surface i into max(f, bottom)."""
    for side in range(2):
        e = UP if side == 0 else DOWN
        swing = abs(E[i, e + 1]) * hx + abs(E[i, e + 2]) * hy
        v = E[i, e]
        if E[i, e + 7] == SMOOTH:
            xx, xy, yy, r = E[i, e + 3], E[i, e + 4], E[i, e + 5], E[i, e + 6]
            high = 0.5 * (max(xx + r, 0.0) * hx * hx + max(yy + r, 0.0) * hy * hy) + abs(xy) * hx * hy
            if v - swing >= bottom:
                continue
            if v + swing + high <= bottom:
                E[i, e] = bottom
                for j in range(1, 7):
                    E[i, e + j] = 0.0
                continue
            E[i, e + 7] = ROUGH
            for j in range(3, 7):
                E[i, e + j] = 0.0
        if side == 1 and v < bottom:
            E[i, e], E[i, e + 1], E[i, e + 2] = bottom, 0.0, 0.0


@leaf
def above(E, j, b, hx, hy, i, a):
    """Whether surface j (its lower side b) lies nowhere in the cell below surface i (smooth on its side a)."""
    c = E[j, b] - E[i, a] - abs(E[j, b + 1] - E[i, a + 1]) * hx - abs(E[j, b + 2] - E[i, a + 2]) * hy
    if c < 0.0:
        return False
    return c + bends(E, j, b, i, a, hx, hy, -1.0) >= 0.0


@leaf
def smooth(E, n, best, rules, hx, hy, least, most):
    """(lo, hi) where sweep k (row 1) and surface `best` are smooth on both sides; the integral of their difference is
    known to lie between `least` and `most`."""
    area = 4.0 * hx * hy
    # from above: one surface alone, its mean exactly, plus what lies below sweep k
    v, gx, gy = E[best, UP] - E[1, DOWN], E[best, UP + 1] - E[1, DOWN + 1], E[best, UP + 2] - E[1, DOWN + 2]
    a, b = abs(gx) * hx, abs(gy) * hy
    hi = area * (v + mean_bend(E, best, UP, SELF, DOWN, hx, hy, 1.0))
    beyond = positive(-v - bends(E, best, UP, SELF, DOWN, hx, hy, -1.0), a, b, hx, hy, 1.0)
    if beyond > 0.0:
        hi = min(
            min(hi, most) + beyond,
            positive(v + bends(E, best, UP, SELF, DOWN, hx, hy, 1.0), a, b, hx, hy, 1.0),
        )
    else:  # k lies below it: what another one that k lies below takes of it is not there to be removed
        gain, over_top = 0.0, 0.0
        for j in range(n):
            if j != 1 and j != best and E[j, UP + 7] == SMOOTH and above(E, j, UP, hx, hy, SELF, DOWN):
                w = E[best, UP] - E[j, UP] + bends(E, best, UP, j, UP, hx, hy, -1.0)
                a = abs(E[best, UP + 1] - E[j, UP + 1]) * hx
                b = abs(E[best, UP + 2] - E[j, UP + 2]) * hy
                w = positive(w, a, b, hx, hy, -1.0)
                if j == TOP:
                    over_top = w
                else:
                    gain = max(gain, w)
        hi -= max(gain, over_top)
        if most < np.inf:  # the top is seen to in the closed integral, and is taken once
            hi = min(hi, most - gain if above(E, TOP, DOWN, hx, hy, best, UP) else most)
    # from below: its mean, less what the others take
    v = E[best, DOWN] - E[1, UP]
    lo = max(area * (v + mean_bend(E, best, DOWN, SELF, UP, hx, hy, -1.0)), least)
    for j in range(n):
        if j == 1 or j == best:
            continue
        v, gx, gy = (
            E[best, DOWN] - E[j, DOWN],
            E[best, DOWN + 1] - E[j, DOWN + 1],
            E[best, DOWN + 2] - E[j, DOWN + 2],
        )
        lo -= positive(
            v + bends(E, best, DOWN, j, DOWN, hx, hy, 1.0), abs(gx) * hx, abs(gy) * hy, hx, hy, 1.0
        )
    # or the least of linear functions, which is concave, at the corners
    if rules & BELOW == 0:
        return max(lo, 0.0), hi
    w00, w10, w01, w11 = np.inf, np.inf, np.inf, np.inf
    for j in range(n):
        if j == 1:
            continue
        v = E[j, DOWN] - E[1, UP] + bends(E, j, DOWN, SELF, UP, hx, hy, -1.0)
        gx, gy = hx * (E[j, DOWN + 1] - E[1, UP + 1]), hy * (E[j, DOWN + 2] - E[1, UP + 2])
        w00, w10 = min(w00, v - gx - gy), min(w10, v + gx - gy)
        w01, w11 = min(w01, v - gx + gy), min(w11, v + gx + gy)
    half = 0.5 * area
    lo = max(lo, above_zero(half, w00, w10, w11) + above_zero(half, w00, w01, w11))
    lo = max(lo, above_zero(half, w00, w10, w01) + above_zero(half, w10, w01, w11), 0.0)
    return lo, hi


@leaf
def _area(P, q, u, v):
    """Of the triangle of corners 0, u, v of polygon q."""
    ax, ay = P[q, u, 0] - P[q, 0, 0], P[q, u, 1] - P[q, 0, 1]
    bx, by = P[q, v, 0] - P[q, 0, 0], P[q, v, 1] - P[q, 0, 1]
    return 0.5 * abs(ax * by - ay * bx)


@leaf
def over(head, part, lines, rules, x, y, hx, hy, E, n, P, q, corners, extra, W):
    """Bound from above on a polygon: one surface and one plane below sweep k per triangle, the best of them."""
    if corners < 3:
        return 0.0
    if rules & ABOVE == 0:
        n, extra = SELF, NONE  # the top alone
    for i in range(n):
        if i == 1 or (E[i, UP + 7] < ROUGH and i != extra):
            continue
        for v in range(corners):
            px, py = P[q, v, 0], P[q, v, 1]
            f = E[0, UP] + E[0, UP + 1] * px + E[0, UP + 2] * py
            if i > 0:
                c = int(lines[i, 7])
                poses(head, part, c, lines, i, x, y, hx, hy)
                f = height(head, part, c, lines, i, x + px, y + py)
            W[i, v] = f - E[1, DOWN] - E[1, DOWN + 1] * px - E[1, DOWN + 2] * py
    total = 0.0
    for v in range(1, corners - 1):
        area, best = _area(P, q, v, v + 1), np.inf
        for i in range(n):
            if i != 1 and (E[i, UP + 7] >= ROUGH or i == extra):
                best = min(best, above_zero(area, W[i, 0], W[i, v], W[i, v + 1]))
        total += best
    return total


@leaf
def under(head, part, lines, rules, bottom, x, y, hx, hy, E, n, C, P, q, corners, W):
    """Bound from below on a polygon inside the footprint of k: least plane minus f_k at the corners is a concave
    function's, and surfaces that lie beyond their outer tangent are absent."""
    if corners < 3 or rules & BELOW == 0:
        return 0.0
    for v in range(corners):
        W[1, v] = np.inf
    for i in range(n):
        if i == 1:
            continue
        beyond = E[i, DOWN + 7] == PART
        for v in range(corners):
            beyond = beyond and C[i, 0] * P[q, v, 0] + C[i, 1] * P[q, v, 1] >= C[i, 3] - 1e-12
        if not beyond:
            for v in range(corners):
                W[1, v] = min(W[1, v], E[i, DOWN] + E[i, DOWN + 1] * P[q, v, 0] + E[i, DOWN + 2] * P[q, v, 1])
    c = int(lines[SELF, 7])
    poses(head, part, c, lines, SELF, x, y, hx, hy)
    for v in range(corners):
        f = height(head, part, c, lines, SELF, x + P[q, v, 0], y + P[q, v, 1])
        W[1, v] -= max(f, bottom)
    total = 0.0
    for v in range(1, corners - 1):
        total += above_zero(_area(P, q, v, v + 1), W[1, 0], W[1, v], W[1, v + 1])
    return total


@leaf
def cut_up(head, part, lines, rules, bottom, x, y, hx, hy, E, n, C, P, W, rim):
    """(lo, hi) by polygons: the cell clipped at borders of footprints, and of a round stock whose row of C is rim."""
    for v in range(4):
        P[0, v, 0] = hx if v == 0 or v == 3 else -hx
        P[0, v, 1] = hy if v < 2 else -hy
    q, corners = RECT, FOUR
    if E[1, DOWN + 7] == PART and C[1, 3] < np.inf:
        q, corners = CUT, clip(P, RECT, FOUR, CUT, C[1, 0], C[1, 1], C[1, 3])
    if rim > 0:
        corners = clip(P, q, corners, ROUND, C[rim, 0], C[rim, 1], C[rim, 3])
        q = ROUND
    hi = over(head, part, lines, rules, x, y, hx, hy, E, n, P, q, corners, NONE, W)
    for j in range(2, n):
        if E[j, UP + 7] == PART and -np.inf < C[j, 2] < np.inf:
            a = clip(P, q, corners, HERE, C[j, 0], C[j, 1], C[j, 2])
            b = clip(P, q, corners, BEYOND, -C[j, 0], -C[j, 1], -C[j, 2])
            found = over(head, part, lines, rules, x, y, hx, hy, E, n, P, HERE, a, j, W)
            if found < hi:
                found += over(head, part, lines, rules, x, y, hx, hy, E, n, P, BEYOND, b, NONE, W)
                hi = min(hi, found)
    q, corners = RECT, FOUR
    if E[1, UP + 7] == PART:
        if not -np.inf < C[1, 2] < np.inf:
            return 0.0, hi
        q, corners = CUT, clip(P, RECT, FOUR, CUT, C[1, 0], C[1, 1], C[1, 2])
    if rim > 0:
        if C[rim, 2] == -np.inf:
            return 0.0, hi
        corners = clip(P, q, corners, ROUND, C[rim, 0], C[rim, 1], C[rim, 2])
        q = ROUND
    lo = under(head, part, lines, rules, bottom, x, y, hx, hy, E, n, C, P, q, corners, W)
    for j in range(2, n):
        if E[j, DOWN + 7] == PART and abs(C[j, 3]) < abs(C[j, 0]) * hx + abs(C[j, 1]) * hy:
            a = clip(P, q, corners, HERE, C[j, 0], C[j, 1], C[j, 3])
            b = clip(P, q, corners, BEYOND, -C[j, 0], -C[j, 1], -C[j, 3])
            found = under(head, part, lines, rules, bottom, x, y, hx, hy, E, n, C, P, HERE, a, W)
            lo = max(
                lo, found + under(head, part, lines, rules, bottom, x, y, hx, hy, E, n, C, P, BEYOND, b, W)
            )
    return lo, hi


@leaf
def hides(head, part, lift, rows, lines, rules, i, k, x, y, hx, hy, slack):
    """Whether line i covers line k in the cell, see `covers` and `same_arc`."""
    if rules & COVER == 0:
        return False
    if same_arc(lift, rows, lines, i, k, slack):
        return True
    return covers(head, part, lift, lines, i, k, x, y, hx, hy, slack)


@leaf
def known_room(head, part, lines, E, i, top, x, y, hx, hy, P, W):
    """(lo, hi) of the integral of what surface i lies below the top over its footprint, see `room`."""
    c = int(lines[i, 7])
    if lines[i, 8] != lines[i, 7]:
        return -np.inf, np.inf
    rim = lines[i, 2] + max(lines[i, 6] * lines[i, 5], 0.0) + profile(head, part, c, head[c, 1])[0]
    below = rim <= top or (E[i, UP + 7] == SMOOTH and above(E, TOP, DOWN, hx, hy, i, UP))
    return room(head, part, c, lines, i, top, x, y, hx, hy, below, P, W)


@leaf
def starts_on(lines, i, k, slack):
    """Whether sweep k begins on the path of sweep i, or above it, of one cutter."""
    c = lines[k, 7]
    if lines[k, 8] != c or lines[i, 7] != c or lines[i, 8] != c:
        return False
    along, aside = local(lines, i, lines[k, 0], lines[k, 1])
    if abs(aside) > slack or along < -slack or along > lines[i, 5] + slack:
        return False
    return lines[k, 2] >= lines[i, 2] + lines[i, 6] * min(max(along, 0.0), lines[i, 5]) - slack


@leaf
def both_lower(head, part, lines, i, k, x, y, hx, hy, slack):
    """Bound of the integral of what sweeps i and k both lie below the pose where i ends and k begins; infinite if unknown.

    With the gradient g of that pose, k is lower where g u_k > m_k only, by (g u_k - m_k) times the way to its touching
    pose at most, and i where g u_i < m_i only.
    """
    c = int(lines[k, 7])
    ex, ey = (
        lines[i, 0] + lines[i, 5] * lines[i, 3] - lines[k, 0],
        lines[i, 1] + lines[i, 5] * lines[i, 4] - lines[k, 1],
    )
    if (
        abs(ex) > slack
        or abs(ey) > slack
        or abs(lines[i, 2] + lines[i, 6] * lines[i, 5] - lines[k, 2]) > slack
    ):
        return np.inf
    drop = lines[i, 6] - lines[k, 6]
    along, aside = local(lines, k, lines[i, 0], lines[i, 1])
    if abs(aside) > slack or along > slack:
        dx, dy = x - lines[k, 0], y - lines[k, 1]
        far = np.sqrt(dx * dx + dy * dy) + np.sqrt(hx * hx + hy * hy)
        if far >= head[c, 1]:
            return np.inf
        dx, dy = lines[k, 3] - lines[i, 3], lines[k, 4] - lines[i, 4]
        drop += profile(head, part, c, far)[3] * np.sqrt(dx * dx + dy * dy)
    if drop <= 0.0:
        return 0.0
    poses(head, part, c, lines, i, x, y, hx, hy)
    poses(head, part, c, lines, k, x, y, hx, hy)
    way = min(min(lines[k, TO], lines[k, 5]), min(lines[i, 5] - lines[i, FROM], lines[i, 5]))
    return 4.0 * hx * hy * drop * max(way, 0.0)


@leaf
def less(head, part, lift, rows, lines, rules, E, n, best, known, top, x, y, hx, hy, slack, enough, P, W):
    """(lo, hi, least, most, exact): what sweep k removes by its closed integral less that of one other; what is known of
    it less that of `best`; whether nothing else need be asked.

    Nothing is left above a pose of k that lies in an earlier sweep: k removes no more than what it lies below that pose.
    """
    alone, begun = n <= 3, NONE
    if rules & COVER != 0 and lines[SELF, 5] > 0.0:
        for i in range(2, n):
            if lines[i, 5] > 0.0 and starts_on(lines, i, SELF, slack):
                begun = np.int64(i)
                break
    other = FIRST if alone else best
    if not (alone or (known and best > 0) or begun > 0):
        return 0.0, np.inf, -np.inf, np.inf, False
    gap, room_k = known_room(head, part, lines, E, SELF, top, x, y, hx, hy, P, W)
    if n == 2 or not room_k < np.inf:
        return max(gap, 0.0), max(room_k, 0.0), -np.inf, np.inf, n == 2 and room_k < np.inf
    lo, hi, least, most = 0.0, max(room_k, 0.0), -np.inf, np.inf
    hidden = (
        other > 0
        and (alone or known)
        and hides(head, part, lift, rows, lines, rules, SELF, other, x, y, hx, hy, slack)
    )
    if begun > 0 and not hidden:
        pose = np.int64(len(lines) - 1)
        for j in range(9):
            lines[pose, j] = lines[SELF, j]
        lines[pose, 5], lines[pose, 6], lines[pose, OF] = 0.0, 0.0, -1.0
        E[pose, UP + 7] = OUT
        a, b = known_room(head, part, lines, E, pose, top, x, y, hx, hy, P, W)
        hi = min(hi, max(room_k - a, 0.0))
        if alone or begun == best:
            least = gap - b - both_lower(head, part, lines, begun, SELF, x, y, hx, hy, slack)
            if alone:
                lo = max(least, 0.0)
                if hi - lo <= enough:
                    return lo, hi, least, most, True
    if other > 0 and (alone or known):
        a, b = known_room(head, part, lines, E, other, top, x, y, hx, hy, P, W)
        if b < np.inf:
            a, b = gap - b, room_k - a
            if alone:
                lo = max(lo, a)
            if hidden:
                hi = min(hi, max(b, 0.0))
                if alone:
                    return lo, hi, a, b, True
            if other == best:
                least, most = max(least, a), b
    return lo, hi, least, most, False


@leaf
def bounds(
    head, part, lift, ladder, rows, rules, roof, k, rim, top, bottom, x, y, hx, hy, ids, src, count, dst, slack,
    enough, lines, E, C, P, W,
):  # fmt: skip
    """(lo, hi, number of earlier sweeps that still count, written to ids from dst) of a cell.

    rim : row of a plunge whose footprint is that of a round stock, -1 where the walls of the stock are those of the tiles.
    roof : top and outline of a stock of facets; empty: the top is level. enough : a width of no consequence, mm^3.
    """
    place(head, part, ladder, rows, k, x, y, hx, hy, lines, SELF)
    if not look(head, part, lines, SELF, int(lines[1, 7]), int(lines[1, 8]), rules, x, y, hx, hy, E, C, SELF):
        return 0.0, 0.0, TOP
    edge = TOP
    if rim >= 0:
        c = int(rows[rim, 7])
        d, far = np.sqrt(hx * hx + hy * hy), distance(rows, rim, x, y)
        if far - d >= head[c, 1]:
            return 0.0, 0.0, TOP
        if far + d > head[c, 1]:
            edge = np.int64(len(C) - 1)
            if not border(head, rows, rim, c, c, x, y, hx, hy, C, edge):
                return 0.0, 0.0, TOP
            if C[edge, 2] == -np.inf and _inside(rows, rim, head[c, 1], x, y, hx, hy):
                edge = TOP
    for j in range(16):
        E[0, j] = 0.0
    level = True
    if len(roof.start) > 0:
        state, up, down, gx, gy, wall = over_cell(roof, x, y, hx, hy, slack)
        if state == OUTSIDE:
            return 0.0, 0.0, TOP
        level = state == WHOLE and gx == 0.0 and gy == 0.0 and up == down
        top = up
        E[0, UP], E[0, UP + 1], E[0, UP + 2] = up, gx, gy
        E[0, DOWN], E[0, DOWN + 1], E[0, DOWN + 2] = down, gx, gy
        if wall >= 0:
            edge = np.int64(len(C) - 1)
            ux, uy = roof.wall[wall, 2] - roof.wall[wall, 0], roof.wall[wall, 3] - roof.wall[wall, 1]
            size = np.sqrt(ux * ux + uy * uy)
            nx, ny = uy / size, -ux / size
            c = nx * (roof.wall[wall, 0] - x) + ny * (roof.wall[wall, 1] - y)
            C[edge, 0], C[edge, 1], C[edge, 2], C[edge, 3] = nx, ny, c - slack, c + slack
        elif state != WHOLE:  # nothing is there for sure
            E[0, DOWN], E[0, DOWN + 1], E[0, DOWN + 2] = bottom, 0.0, 0.0
    else:
        E[0, UP], E[0, DOWN] = top, top
    E[0, UP + 7], E[0, DOWN + 7] = SMOOTH, SMOOTH
    if above(E, SELF, DOWN, hx, hy, TOP, UP):
        return 0.0, 0.0, TOP
    floor_of(E, SELF, bottom, hx, hy)
    n, best = FIRST, TOP
    for q in range(count):
        j = ids[src + q]
        place(head, part, ladder, rows, j, x, y, hx, hy, lines, n)
        if hides(head, part, lift, rows, lines, rules, n, SELF, x, y, hx, hy, slack):
            return 0.0, 0.0, TOP
        if not look(
            head, part, lines, n, int(lines[n, 7]), int(lines[n, 8]), rules, x, y, hx, hy, E, C, n
        ) or above(E, n, DOWN, hx, hy, 0, UP):
            continue
        ids[dst + n - 2] = j
        if E[n, UP + 7] == SMOOTH and E[n, UP] < E[best, UP]:
            best = n
        n += 1
    if above(E, SELF, DOWN, hx, hy, best, UP):
        return 0.0, 0.0, TOP
    kept = FIRST
    for i in range(2, n):
        if rules & FORGET != 0 and i != best and above(E, i, DOWN, hx, hy, best, UP):
            continue
        if i == best:
            best = kept
        if i != kept:
            for j in range(16):
                E[kept, j] = E[i, j]
            for j in range(4):
                C[kept, j] = C[i, j]
            for j in range(COLUMNS):
                lines[kept, j] = lines[i, j]
            ids[dst + kept - 2] = ids[dst + i - 2]
        kept += 1
    n, known, plain = kept, E[1, UP + 7] == SMOOTH and E[1, DOWN + 7] == SMOOTH, True
    for i in range(1, n):
        plain = plain and E[i, UP + 7] == SMOOTH and E[i, DOWN + 7] == SMOOTH
    known = known and E[best, DOWN + 7] == SMOOTH and edge == 0
    lo, hi = 0.0, np.inf
    least, most = -np.inf, np.inf
    firm = (
        rules & CLOSED != 0
        and level
        and edge == 0
        and E[1, DOWN] - abs(E[1, DOWN + 1]) * hx - abs(E[1, DOWN + 2]) * hy > bottom
    )
    if firm:
        lo, hi, least, most, exact = less(
            head, part, lift, rows, lines, rules, E, n, best, known, top, x, y, hx, hy, slack, enough, P, W
        )
        if exact:
            return lo, max(hi, lo), n - 2
    if known and hi - lo > enough:
        a, b = smooth(E, n, best, rules, hx, hy, least, most)
        lo, hi = max(lo, a), min(hi, b)
    if not (known and plain) and hi - lo > enough:
        a, b = cut_up(head, part, lines, rules, bottom, x, y, hx, hy, E, n, C, P, W, edge)
        lo, hi = max(lo, a), min(hi, b)
    return lo, max(hi, lo), n - 2
