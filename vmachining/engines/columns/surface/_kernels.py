# Lower surface f of a straight sweep of a convex cutter with upright axis.
#
# Legend. A cutter is the convex function phi(rho), height of its lower surface above its tip at distance rho from the
# axis, rho <= R; slope is phi'. head[c] = (number of parts, R, 1 if ball, height of the ball's centre, 1 if cones).
# part[c, i] = (kind, rho_a, rho_b, slope_a, slope_b, a, z, r), from the axis outward, slopes rising:
#   LINE    z + slope (rho - rho_a); ARC    z - sqrt(r^2 - (rho - a)^2); VERTEX a point whose slopes span [slope_a, slope_b]
# rows[k] = (x, y, z of the tip at the start, ux, uy unit motion in plan, L length in plan, m = dz/ds, cutter that the
# sweep holds, cutter that holds the sweep, lowest z of the tip, kind, 0); of arcs: arcs/_kernels.py. xi, eta: along and
# across the motion, from the start.
#
#     f(xi, eta) = min over s in [0, L] of  z + m s + phi(sqrt((xi - s)^2 + eta^2))
#
# lines[i, FROM:]: what `poses` finds out about the touching poses in the cell at hand.
#
# The minimum is taken at s = xi - lean, lean(eta) >= 0 uphill, cut off at 0 and L: in between f = z + m xi + chi(eta).

import numpy as np
from numpy.typing import NDArray

from vmachining.jit import inner, leaf

LINE, ARC, VERTEX = 0.0, 1.0, 2.0
ENDS, MIDDLE = (
    np.int64(1),
    np.int64(0),
)  # typed: a literal would have a version of every function compiled for it
STEEP = 1e4  # steepest tangent plane that is used; a steeper place takes the plane of this slope below it
FROM, TO = np.int64(12), np.int64(13)  # least and greatest s of the touching poses of the cell, not cut off
ASIDE, LEAN, GAIN = (
    np.int64(14),
    np.int64(15),
    np.int64(16),
)  # least |eta|, lean there, slope of its chord to the greatest
OF, COLUMNS = np.int64(17), 18  # cutter that they hold for, -1: none
NEAR = 1e-12  # of R: a point so near to a joint of two parts counts to both
RIM = 1e-6  # of R: nearer to the border the curvature is not asked for


@leaf
def profile(
    head: NDArray[np.float64], part: NDArray[np.float64], c: int, rho: float
) -> tuple[float, float, float, float]:
    """(phi, value at rho of the tangent of slope `low`, lowest and highest slope) at rho <= R."""
    if head[c, 2] == 1.0:
        R = head[c, 1]
        S = np.sqrt(max(R * R - rho * rho, 0.0))
        z = head[c, 3]
        if rho > STEEP * S:
            return z - S, z + STEEP * rho - R * np.sqrt(1.0 + STEEP * STEEP), STEEP, STEEP
        slope = rho / S
        return z - S, z - S, slope, slope
    n = int(head[c, 0])
    near = NEAR * head[c, 1]
    i = 0
    while i < n - 1 and rho > part[c, i, 2] + near:
        i += 1
    kind, z = part[c, i, 0], part[c, i, 6]
    if kind == ARC:
        t, r = rho - part[c, i, 5], part[c, i, 7]
        S = np.sqrt(max(r * r - t * t, 0.0))
        if t > STEEP * S:
            return z - S, z + STEEP * t - r * np.sqrt(1.0 + STEEP * STEEP), STEEP, STEEP
        phi, low = z - S, max(t, 0.0) / S
    elif kind == LINE:
        low = part[c, i, 3]
        phi = z + low * (rho - part[c, i, 1])
    else:
        low, phi = part[c, i, 3], z
    high = low
    while i < n - 1 and rho >= part[c, i, 2] - near and part[c, i + 1, 0] == VERTEX:
        i += 1
    if part[c, i, 0] == VERTEX and rho >= part[c, i, 1] - near:
        high = max(high, part[c, i, 4])
    return phi, phi, min(low, STEEP), min(high, STEEP)


@leaf
def lean(head, part, c, m, eta):
    """How far the touching pose lies behind, for a slope m >= 0 of the motion and 0 <= eta <= R."""
    R = head[c, 1]
    if m == 0.0:
        return 0.0
    if head[c, 2] == 1.0:
        return m * np.sqrt(max(R * R - eta * eta, 0.0)) / np.sqrt(1.0 + m * m)
    n = int(head[c, 0])
    for i in range(n):
        p, rho = part[c, i, 4], part[c, i, 2]
        if p <= m or (i < n - 1 and eta > rho * np.sqrt(1.0 - (m / p) ** 2)):
            continue
        if part[c, i, 0] == VERTEX:
            return np.sqrt(max(rho * rho - eta * eta, 0.0))
        if part[c, i, 0] == LINE:
            return eta * m / np.sqrt(p * p - m * m)
        # sigma = q / sqrt(1 + p^2), p^2 = q^2 + m^2: eta = sigma (r + a w / sqrt(m^2 + sigma^2)) grows and is concave on
        # [0, 1]: Halley from the left; near 1 by tau = 1 - sigma, of which eta(1) - eta is known to all digits
        a, r = part[c, i, 5], part[c, i, 7]
        w2 = 1.0 + m * m
        w = np.sqrt(w2)
        sigma = min(max(eta / (r + a * w / m), (eta - a) / r), 1.0)
        for _ in range(40):
            square = m * m + sigma * sigma
            S = np.sqrt(square)
            bend = a * w * m * m / (square * S)
            step = (eta - sigma * (r + a * w / S)) / (r + bend)
            step /= max(1.0 - 1.5 * step * sigma * bend / (square * (r + bend)), 0.5)
            sigma = min(max(sigma + step, 0.0), 1.0)
            if abs(step) <= 1e-3 * sigma:  # its cube is left, and the step below is another one
                break
        square = m * m + sigma * sigma
        S, tau = np.sqrt(square), 1.0 - sigma
        short = tau * (r + a * m * m * (2.0 - tau) / (S * (S + sigma * w))) - (a + r - eta)
        tau = min(max(tau - short / (r + a * w * m * m / (square * S)), 0.0), 1.0)
        sigma = 1.0 - tau
        return m * np.sqrt(tau * (2.0 - tau)) * (r / w + a / np.sqrt(m * m + sigma * sigma))
    return 0.0


@leaf
def local(rows, k, x, y):
    """(xi, eta) of a point."""
    dx, dy = x - rows[k, 0], y - rows[k, 1]
    return dx * rows[k, 3] + dy * rows[k, 4], dy * rows[k, 3] - dx * rows[k, 4]


@leaf
def distance(rows, k, x, y):
    """Distance in plan to the path."""
    xi, eta = local(rows, k, x, y)
    t = xi - min(max(xi, 0.0), rows[k, 5])
    return np.sqrt(t * t + eta * eta)


@leaf
def surface(head, part, c, rows, k, x, y, u):
    """(f, value of a tangent plane at the point, its gradient x, y), u its lean; f infinite outside the footprint.

    The plane touches the cutter in the pose s that was found, whatever its rounding; along the path the other poses
    rise over it at the rate m - g_xi, and where that is negative the plane is lowered by as much.
    """
    xi, eta = local(rows, k, x, y)
    L, m, R = rows[k, 5], rows[k, 6], head[c, 1]
    t = xi - min(max(xi, 0.0), L)
    if t * t + eta * eta > R * R:
        return np.inf, -np.inf, 0.0, 0.0
    s = min(max(xi - u if m >= 0.0 else xi + u, 0.0), L)
    t = xi - s
    rho = min(np.sqrt(t * t + eta * eta), R)
    phi, tangent, low, high = profile(head, part, c, rho)
    slope = low
    if high > low and t * m > 0.0:
        slope = min(max(m * rho / t, low), high)
        tangent = phi
    ratio = slope / rho if rho > 0.0 else 0.0
    g, h = ratio * t, ratio * eta
    drop = max(max((m - g) * s, (g - m) * (L - s)), 0.0)
    base = rows[k, 2] + m * s
    return (
        base + phi,
        base + tangent - drop,
        g * rows[k, 3] - h * rows[k, 4],
        g * rows[k, 4] + h * rows[k, 3],
    )


@leaf
def value(head, part, c, rows, k, x, y):
    """f alone; a point that rounding put outside the footprint counts as on its border."""
    xi, eta = local(rows, k, x, y)
    L, m, R = rows[k, 5], rows[k, 6], head[c, 1]
    t = xi - min(max(xi, 0.0), L)
    if t * t + eta * eta > R * R * (1.0 + 1e-9):
        return 1e30
    u = lean(head, part, c, abs(m), min(abs(eta), R))
    s = min(max(xi - u if m >= 0.0 else xi + u, 0.0), L)
    t = xi - s
    return rows[k, 2] + m * s + profile(head, part, c, min(np.sqrt(t * t + eta * eta), R))[0]


@leaf
def poses(head, part, c, lines, i, x, y, hx, hy):
    """Fill lines[i, FROM:] for cutter c and a cell."""
    if lines[i, OF] == c:
        return
    lines[i, OF] = c
    xi, eta = local(lines, i, x, y)
    ux, uy, m, R = lines[i, 3], lines[i, 4], lines[i, 6], head[c, 1]
    dxi, deta = abs(ux) * hx + abs(uy) * hy, abs(uy) * hx + abs(ux) * hy
    near, far = min(max(abs(eta) - deta, 0.0), R), min(abs(eta) + deta, R)
    lines[i, FROM], lines[i, TO], lines[i, ASIDE] = xi - dxi, xi + dxi, near
    lines[i, LEAN], lines[i, GAIN] = 0.0, 0.0
    behind, L = xi + dxi <= 0.0, lines[i, 5]
    if m == 0.0 or (behind if m > 0.0 else xi - dxi >= L):
        return  # level, or the same end whatever the lean is
    if behind if m < 0.0 else xi - dxi >= L:  # perhaps an end: by the greatest lean
        most = R if head[c, 4] == 1.0 else lean(head, part, c, abs(m), 0.0)
        if xi + dxi + most <= 0.0 if m < 0.0 else xi - dxi - most >= L:
            return
    u, v = lean(head, part, c, abs(m), near), lean(head, part, c, abs(m), far)
    lines[i, LEAN], lines[i, GAIN] = u, ((v - u) / (far - near) if far > near else 0.0)
    low, high = min(u, v), max(u, v)
    if head[c, 4] == 1.0:  # on cones lean grows with eta, elsewhere it falls
        for j in range(int(head[c, 0])):
            p = part[c, j, 4]
            if part[c, j, 0] == LINE and p > abs(m):
                for end in range(1, 3):
                    rho = part[c, j, end]
                    e = rho * np.sqrt(1.0 - (m / p) ** 2)
                    if near < e < far:
                        low, high = min(low, rho * abs(m) / p), max(high, rho * abs(m) / p)
    if m > 0.0:
        low, high = -high, -low
    lines[i, FROM] += low
    lines[i, TO] += high


@inner
def lean_at(head, part, c, lines, i, xi, eta):
    """Lean at a place of the cell; where an end of the path is the touching pose, no more than that."""
    if lines[i, TO] <= 0.0 or lines[i, FROM] >= lines[i, 5]:
        return lines[i, LEAN] + lines[i, GAIN] * (min(abs(eta), head[c, 1]) - lines[i, ASIDE])
    return lean(head, part, c, abs(lines[i, 6]), abs(eta))


@leaf
def height(head, part, c, lines, i, x, y):
    """f from above at a place of the cell: the height of a pose near the touching one, whose lean the chord says."""
    xi, eta = local(lines, i, x, y)
    L, m, R = lines[i, 5], lines[i, 6], head[c, 1]
    t = xi - min(max(xi, 0.0), L)
    if t * t + eta * eta > R * R * (1.0 + 1e-9):
        return 1e30
    u = lines[i, LEAN] + lines[i, GAIN] * (min(abs(eta), R) - lines[i, ASIDE])
    s = min(max(xi - u if m >= 0.0 else xi + u, 0.0), L)
    d = (xi - s) * (xi - s) + eta * eta
    if d > R * R and m != 0.0:
        u = lean(head, part, c, abs(m), min(abs(eta), R))
        s = min(max(xi - u if m >= 0.0 else xi + u, 0.0), L)
        d = (xi - s) * (xi - s) + eta * eta
    return lines[i, 2] + m * s + profile(head, part, c, min(np.sqrt(d), R))[0]


@leaf
def _slope(head, part, c, m, eta, u):
    """(rho, slope) of the touching point of the middle part of a sweep, u its lean; the least slope if there are several."""
    rho = min(np.sqrt(u * u + eta * eta), head[c, 1])
    _, _, low, high = profile(head, part, c, rho)
    if high > low:
        if u > 0.0:
            return rho, min(max(m * rho / u, low), high)
        return rho, high if eta > 0.0 else max(m, low)  # the tip of a cone touches with all slopes from m on
    return rho, low


@leaf
def spread(part, c, n, m, rho0, rho1, p0, p1, cap):
    """Range of second derivatives between two touching points: radial (cap) or across the middle part, and p / rho."""
    lo, hi, lo_t, hi_t = np.inf, 0.0, np.inf, 0.0
    near = NEAR * part[c, n - 1, 2]  # a touching point on an edge lies there up to rounding
    for i in range(n):
        kind = part[c, i, 0]
        if part[c, i, 2] < rho0 - near or part[c, i, 1] > rho1 + near:
            continue
        if kind == ARC:
            a, r = part[c, i, 5], part[c, i, 7]
            pa, pb = max(part[c, i, 3], p0), min(part[c, i, 4], p1)
            if pa > pb:
                continue
            for j in range(2):
                p = pa if j == 0 else pb
                v = np.sqrt(1.0 + p * p)
                across = r * (1.0 + m * m) / v**3
                if m > 0.0:
                    across += a * m * m / p**3
                lo, hi = min(lo, 1.0 / across), max(hi, 1.0 / across)
                if cap == ENDS:
                    t = p / (a + r * p / v) if p > 0.0 else (1.0 / r if a == 0.0 else 0.0)
                    lo_t, hi_t = min(lo_t, t), max(hi_t, t)
        elif kind == LINE:
            p = part[c, i, 4]
            if p < p0 or p > p1:
                continue
            lo = 0.0
            if cap == ENDS:
                a, b = max(part[c, i, 1], rho0), min(part[c, i, 2], rho1)
                lo_t = min(lo_t, p / b if b > 0.0 else 0.0)
                hi_t = max(hi_t, p / a if a > 0.0 else (np.inf if p > 0.0 else 0.0))
        else:
            pa, pb = max(part[c, i, 3], p0), min(part[c, i, 4], p1)
            if pa >= pb:
                continue
            if m == 0.0 or cap == ENDS:
                return 0.0, np.inf, 0.0, np.inf
            rho = part[c, i, 1]
            lo, hi = min(lo, pa**3 / (rho * m * m)), max(hi, pb**3 / (rho * m * m))
    if lo == np.inf:
        return 0.0, np.inf, 0.0, np.inf
    return lo, hi, lo_t, hi_t


@inner
def _end(head, part, c, ux, uy, t, eta, d):
    """(Mxx, Mxy, Myy, radius) of the second derivative around an end pose, within d of the point (t, eta)."""
    R = head[c, 1]
    rho = np.sqrt(t * t + eta * eta)
    near, far = max(rho - d, 0.0), rho + d
    if far >= R * (1.0 - RIM):
        return 0.0, 0.0, 0.0, np.inf
    if head[c, 2] == 1.0:
        s0, s1 = np.sqrt(R * R - near * near), np.sqrt(R * R - far * far)
        lo, hi, lo_t, hi_t = R * R / s0**3, R * R / s1**3, 1.0 / s0, 1.0 / s1
    else:
        p0, p1 = profile(head, part, c, near)[2], profile(head, part, c, far)[3]
        lo, hi, lo_t, hi_t = spread(part, c, int(head[c, 0]), 0.0, near, far, p0, p1, ENDS)
        if not hi < np.inf or not hi_t < np.inf:
            return 0.0, 0.0, 0.0, np.inf
    across, radial = 0.5 * (lo_t + hi_t), 0.5 * (lo + hi)
    turn = min(d / rho, 1.0) if rho > 0.0 else 1.0
    radius = 0.5 * max(hi - lo, hi_t - lo_t) + turn * max(abs(hi - lo_t), abs(hi_t - lo))
    ex, ey = (t * ux - eta * uy, t * uy + eta * ux) if rho > 0.0 else (0.0, 0.0)
    share = (radial - across) / (rho * rho) if rho > 0.0 else 0.0
    return across + share * ex * ex, share * ex * ey, across + share * ey * ey, radius


@inner
def _middle(head, part, c, m, ux, uy, eta, deta, u, gain):
    """The same of the middle part, across the motion; lean where |eta| is least and slope of its chord."""
    R = head[c, 1]
    near, far = max(abs(eta) - deta, 0.0), abs(eta) + deta
    if far >= R * (1.0 - RIM):
        return 0.0, 0.0, 0.0, np.inf
    if head[c, 2] == 1.0:
        w, u, v = np.sqrt(1.0 + m * m) * R * R, R * R - near * near, R * R - far * far
        lo, hi = w / (u * np.sqrt(u)), w / (v * np.sqrt(v))
    else:
        m = abs(m)
        rho0, p0 = _slope(head, part, c, m, near, u)
        rho1, p1 = _slope(head, part, c, m, far, max(u + gain * (far - near), 0.0))
        lo, hi, _, _ = spread(part, c, int(head[c, 0]), m, rho0, rho1, p0, p1, MIDDLE)
        if not hi < np.inf:
            return 0.0, 0.0, 0.0, np.inf
    mean = 0.5 * (lo + hi)
    return mean * uy * uy, -mean * ux * uy, mean * ux * ux, 0.5 * (hi - lo)


@leaf
def _norm(xx, xy, yy):
    """Spectral norm of a symmetric matrix."""
    return 0.5 * (abs(xx + yy) + np.sqrt((xx - yy) ** 2 + 4.0 * xy * xy))


@inner
def bending(head, part, c, lines, i, xi, eta, hx, hy):
    """(Mxx, Mxy, Myy, radius): everywhere in the cell |f'' - M| <= radius; infinite where nothing is known. Asks for
    `poses`."""
    ux, uy, L, m = lines[i, 3], lines[i, 4], lines[i, 5], lines[i, 6]
    deta = abs(uy) * hx + abs(ux) * hy
    d = np.sqrt(hx * hx + hy * hy)
    first, last = lines[i, FROM], lines[i, TO]
    xx, xy, yy, radius, some = 0.0, 0.0, 0.0, 0.0, False
    for place in range(3):
        if place == 0:
            if not (L > 0.0 and first < L and last > 0.0):
                continue
            a, b, e, r = _middle(head, part, c, m, ux, uy, eta, deta, lines[i, LEAN], lines[i, GAIN])
        elif place == 1:
            if first >= 0.0 and L > 0.0:
                continue
            a, b, e, r = _end(head, part, c, ux, uy, xi, eta, d)
        else:
            if last <= L or L == 0.0:
                continue
            a, b, e, r = _end(head, part, c, ux, uy, xi - L, eta, d)
        if not some:
            xx, xy, yy, radius, some = a, b, e, r, True
        else:
            radius = max(radius, r) + 0.5 * _norm(a - xx, b - xy, e - yy)
            xx, xy, yy = 0.5 * (a + xx), 0.5 * (b + xy), 0.5 * (e + yy)
        if radius == np.inf:
            break
    return xx, xy, yy, radius


@inner
def covers(head, part, lift, lines, i, k, x, y, hx, hy, slack):
    """Whether f_i <= f_k and the footprint of i holds that of k in the cell: the cover rule.

    lift[b, c]: by how much higher cutter c must stand than cutter b so that it lies in b and what is above b. The poses
    of k that touch in the cell lie between two points; where these lie so much above the path of i, all do.
    """
    b, c = int(lines[i, 7]), int(lines[k, 8])
    above = lift[b, c]
    if above == np.inf:
        return False
    ux, uy, L = lines[k, 3], lines[k, 4], lines[k, 5]
    begin = local(lines, i, lines[k, 0], lines[k, 1])[1]
    end = begin + L * (uy * lines[i, 3] - ux * lines[i, 4])
    if min(begin, end) > 2.0 * slack or max(begin, end) < -2.0 * slack:  # path k lies on one side of line i
        return False
    poses(head, part, c, lines, k, x, y, hx, hy)
    for j in range(2):
        s = min(max(lines[k, FROM] if j == 0 else lines[k, TO], 0.0), L)
        px, py, pz = lines[k, 0] + s * ux, lines[k, 1] + s * uy, lines[k, 2] + s * lines[k, 6]
        along, aside = local(lines, i, px, py)
        if abs(aside) > slack or along < -slack or along > lines[i, 5] + slack:
            return False
        if pz - above < lines[i, 2] + lines[i, 6] * min(max(along, 0.0), lines[i, 5]) - slack:
            return False
    return True
