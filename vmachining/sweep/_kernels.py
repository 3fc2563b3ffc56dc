# Distances and ray intervals of a body of revolution that translates in a straight line, and where only the
# nearest pose counts: points and upright rays of a level circle. Other motions: rotating/_kernels.py.
#
# Legend: seg rows (r0, z0, r1, z1, cr, cz, R, n_r, n_z, length), discs included, one closed convex meridian
#   per piece, pieces are seg[first[k]:first[k+1]]; R = 0 is a line. phi signed distance to a piece, n its
#   gradient.
# path (10,): A (start - centre), B (axis x A), D (rise or straight travel), (3,) each, angle;
#   p(t) = A (cos(t angle) - 1) + B sin(t angle) + D t, relative to the start. angle 0 is a straight line.
# travel (3,): D of a straight line, or 0; tau in [0, 1] runs along it.
# s ray parameter, mm. tol mm, what rounding allows (a few ulp of the extent of the sweep).

import numpy as np

from vmachining.jit import kernel, leaf
from vmachining.numerics._kernels import insert, slab

MERGE = 1e-10  # mm: intervals closer than this are one


@leaf
def meridian(seg, i0, i1, rho, z):
    """Signed distance to one convex meridian and its gradient (n_r, n_z)."""
    best, d, n_r, n_z = np.inf, np.inf, 0.0, 1.0
    corner = False
    for i in range(i0, i1):
        a_r, a_z = rho - seg[i, 0], z - seg[i, 1]
        b_r, b_z = rho - seg[i, 2], z - seg[i, 3]
        radius = seg[i, 6]
        if radius == 0.0:
            s_r, s_z, length = seg[i, 7], seg[i, 8], seg[i, 9]
            along = a_z * s_r - a_r * s_z
            foot = 0.0 <= along <= length
            side = a_r * s_r + a_z * s_z
            near_start = along < 0.0
        else:
            w_r, w_z = rho - seg[i, 4], z - seg[i, 5]
            p_r, p_z = seg[i, 0] - seg[i, 4], seg[i, 1] - seg[i, 5]
            q_r, q_z = seg[i, 2] - seg[i, 4], seg[i, 3] - seg[i, 5]
            foot = p_r * w_z - p_z * w_r >= 0.0 and w_r * q_z - w_z * q_r >= 0.0
            reach = np.sqrt(w_r * w_r + w_z * w_z)
            side = reach - radius
            if reach > 0.0:
                s_r, s_z = w_r / reach, w_z / reach
            else:
                s_r, s_z = seg[i, 7], seg[i, 8]
            near_start = a_r * a_r + a_z * a_z < b_r * b_r + b_z * b_z
        if foot:
            if abs(side) <= best:
                best, d, n_r, n_z, corner = abs(side), side, s_r, s_z, False
        else:
            if near_start:
                c_r, c_z = a_r, a_z
            else:
                c_r, c_z = b_r, b_z
            away = np.sqrt(c_r * c_r + c_z * c_z)
            if away < best:
                best, d, corner = away, away, True
                if away > 0.0:
                    n_r, n_z = c_r / away, c_z / away
                else:
                    n_r, n_z = seg[i, 7], seg[i, 8]
    if corner and best > 0.0 and inside(seg, i0, i1, rho, z):  # between two tangent segments
        d, n_r, n_z = -best, -n_r, -n_z
    return d, n_r, n_z


@leaf
def inside(seg, i0, i1, rho, z):
    """Whether (rho, z) lies in the meridian, by its radius at z."""
    for i in range(i0, i1):
        if seg[i, 1] <= z <= seg[i, 3] and seg[i, 3] > seg[i, 1]:
            if seg[i, 6] == 0.0:
                share = (z - seg[i, 1]) / (seg[i, 3] - seg[i, 1])
                r = (1.0 - share) * seg[i, 0] + share * seg[i, 2]
            else:
                r = seg[i, 4] + np.sqrt(max(seg[i, 6] ** 2 - (z - seg[i, 5]) ** 2, 0.0))
            if rho <= r:
                return True
    return False


@leaf
def pose(seg, i0, i1, travel, tau, x, y, z):
    """phi of a point to the body at tau, its gradient (3,) and its slope in tau."""
    q_x, q_y, q_z = x - tau * travel[0], y - tau * travel[1], z - tau * travel[2]
    rho = np.sqrt(q_x * q_x + q_y * q_y)
    d, n_r, n_z = meridian(seg, i0, i1, rho, q_z)
    if rho > 0.0:
        n_x, n_y = n_r * q_x / rho, n_r * q_y / rho
    else:
        n_x, n_y = 0.0, 0.0  # on the axis the mean of all directions
    return d, n_x, n_y, n_z, -(n_x * travel[0] + n_y * travel[1] + n_z * travel[2])


@leaf
def likely(seg, i0, travel, x, y, z):
    """Where on the motion a point probably has its smallest phi: nearest to the axis, or to the centre of a ball."""
    level = travel[0] ** 2 + travel[1] ** 2
    if level == 0.0:
        return 0.5
    tau = min(max((x * travel[0] + y * travel[1]) / level, 0.0), 1.0)
    if travel[2] == 0.0 or seg[i0, 6] == 0.0 or seg[i0, 4] != 0.0 or z - tau * travel[2] >= seg[i0, 5]:
        return tau
    along = x * travel[0] + y * travel[1] + (z - seg[i0, 5]) * travel[2]
    return min(max(along / (level + travel[2] ** 2), 0.0), 1.0)


@leaf
def nearest(seg, i0, i1, travel, x, y, z, tol):
    """Smallest phi over the motion, to `tol`: (phi, n_x, n_y, n_z, tau).

    phi is convex in (point, tau). A cut through the two ends of the bracket, mixed so that its
    slope in tau vanishes, supports min over tau of phi; n is the gradient of that cut, not of one pose.
    """
    tau = likely(seg, i0, travel, x, y, z)
    d, n_x, n_y, n_z, g = pose(seg, i0, i1, travel, tau, x, y, z)
    if travel[2] == 0.0:  # horizontal: phi grows with the distance to the axis
        return d, n_x, n_y, n_z, tau
    low_known, high_known = False, False
    t_l, d_l, x_l, y_l, z_l, g_l = 0.0, d, n_x, n_y, n_z, g
    t_h, d_h, x_h, y_h, z_h, g_h = 1.0, d, n_x, n_y, n_z, g
    last = 1.0
    for _ in range(150):
        if g == 0.0 or (g < 0.0 and tau == 1.0) or (g > 0.0 and tau == 0.0):
            return d, n_x, n_y, n_z, tau
        if g < 0.0:
            t_l, d_l, x_l, y_l, z_l, g_l, low_known = tau, d, n_x, n_y, n_z, g, True
        else:
            t_h, d_h, x_h, y_h, z_h, g_h, high_known = tau, d, n_x, n_y, n_z, g, True
        if not high_known:
            new = 1.0
        elif not low_known:
            new = 0.0
        else:
            width = t_h - t_l
            share = g_h / (g_h - g_l)  # of the lower end: share g_l + (1 - share) g_h = 0
            floor = share * d_l + (1.0 - share) * d_h + share * g_l * width
            if min(d_l, d_h) - floor <= tol:
                break
            new = t_l - g_l * width / (g_h - g_l)
            if width > 0.5 * last or not t_l < new < t_h:  # the secant creeps: halve
                new = 0.5 * (t_l + t_h)
            last = width
            if not t_l < new < t_h:
                break
        tau = new
        d, n_x, n_y, n_z, g = pose(seg, i0, i1, travel, tau, x, y, z)
    if not (low_known and high_known):
        return d, n_x, n_y, n_z, tau
    share = g_h / (g_h - g_l)
    rest = 1.0 - share
    n_x, n_y, n_z = share * x_l + rest * x_h, share * y_l + rest * y_h, share * z_l + rest * z_h
    if d_l <= d_h:
        return d_l, n_x, n_y, n_z, t_l
    return d_h, n_x, n_y, n_z, t_h


@leaf
def approach(seg, i0, i1, travel, o, u, s, s_end, way, tol):
    """First s from outside, walking in direction `way`, where the ray meets the sweep; NaN if it never does.

    min over tau of phi is convex along the ray, so Newton's step never passes the first root. Should rounding
    let it pass, regula falsi (Illinois) goes back.
    """
    out, d_out = np.nan, 0.0
    for _ in range(200):
        x, y, z = o[0] + s * u[0], o[1] + s * u[1], o[2] + s * u[2]
        d, n_x, n_y, n_z, _tau = nearest(seg, i0, i1, travel, x, y, z, 0.25 * tol)
        if d <= tol:
            if d >= -4.0 * tol or np.isnan(out):
                return s
            break
        slope = way * (n_x * u[0] + n_y * u[1] + n_z * u[2])
        if not slope < 0.0:
            return np.nan
        new = s - way * d / slope
        if new == s:
            return s
        out, d_out, s = s, d, new
        if way * (s_end - s) < 0.0:
            return np.nan
    else:
        return np.nan
    into, d_into = s, d
    for _ in range(60):
        s = out + (into - out) * d_out / (d_out - d_into)
        if s in (out, into):
            break
        d = nearest(seg, i0, i1, travel, o[0] + s * u[0], o[1] + s * u[1], o[2] + s * u[2], 0.25 * tol)[0]
        if abs(d) <= tol:
            break
        if d > 0.0:
            out, d_out, d_into = s, d, 0.5 * d_into
        else:
            into, d_into, d_out = s, d, 0.5 * d_out
    return s


@leaf
def stretch(seg, size, i0, i1, piece, travel, o, u, tol):
    """Interval of the ray in the sweep of one convex piece; (NaN, NaN) if it misses. size: (r, z0, z1)."""
    margin = 1e-6
    r = size[piece, 0] + margin
    a, b = -np.inf, np.inf
    for k in range(2):
        a, b = slab(o, u, k, min(0.0, travel[k]) - r, max(0.0, travel[k]) + r, a, b)
    low, high = min(0.0, travel[2]), max(0.0, travel[2])
    a, b = slab(o, u, 2, low + size[piece, 1] - margin, high + size[piece, 2] + margin, a, b)
    if a > b:
        return np.nan, np.nan
    first = approach(seg, i0, i1, travel, o, u, a, b, 1.0, tol)
    if np.isnan(first):
        return np.nan, np.nan
    final = approach(seg, i0, i1, travel, o, u, b, a, -1.0, tol)
    if np.isnan(final) or final < first:  # a touch: rounding decides on which side
        return first, first
    return first, final


@kernel
def rays(seg, first, size, path, origins, directions, tol, counts, lo, hi) -> None:
    """Intervals of every ray; counts[i] = -1 where lo, hi (n, capacity) are full. Origins from the start.

    Straight motions; on a level circle only upright rays.
    """
    o, travel = np.empty(3), np.zeros(3)
    if path[9] == 0.0:
        travel[:] = path[6:9]
    for i in range(len(origins)):
        u = directions[i]
        shift = -(origins[i, 0] * u[0] + origins[i, 1] * u[1] + origins[i, 2] * u[2])
        for k in range(3):  # foot of the ray near the start: no long lever
            o[k] = origins[i, k] + shift * u[k]
        if path[9] != 0.0:  # only the nearest pose counts
            o[0], o[1] = planar_gap(path, o[0], o[1]), 0.0
        n = 0
        for k in range(len(first) - 1):
            a, b = stretch(seg, size, first[k], first[k + 1], k, travel, o, u, tol)
            if a <= b:
                n = insert(lo[i], hi[i], n, a, b, MERGE)
                if n < 0:
                    break
        counts[i] = n
        for j in range(max(n, 0)):
            lo[i, j] += shift
            hi[i, j] += shift


@leaf
def planar_gap(path, x, y):
    """Horizontal distance to a horizontal arc about z."""
    c_x, c_y = x + path[0], y + path[1]  # from the centre, which lies at -A
    radius = np.sqrt(path[0] ** 2 + path[1] ** 2)
    reach = np.sqrt(c_x * c_x + c_y * c_y)
    off = abs(x * (c_x + path[0]) + y * (c_y + path[1])) / (
        reach + radius
    )  # |reach - radius|, large radii too
    angle = path[9]
    if abs(angle) >= 2.0 * np.pi:
        return off
    ahead = np.arctan2(path[0] * c_y - path[1] * c_x, path[0] * c_x + path[1] * c_y)
    if angle < 0.0:
        ahead = -ahead
    if ahead < 0.0:
        ahead += 2.0 * np.pi
    if ahead <= abs(angle):
        return off
    versed, sin = -2.0 * np.sin(0.5 * angle) ** 2, np.sin(angle)
    e_x, e_y = path[0] * versed + path[3] * sin, path[1] * versed + path[4] * sin
    return min(np.hypot(x, y), np.hypot(x - e_x, y - e_y))


@leaf
def distances(seg, first, path, points, tol, out) -> None:
    """Signed distance of every point (from the start) to a straight or a level circular sweep."""
    for i in range(len(points)):
        x, y, z = points[i]
        best = np.inf
        if path[9] == 0.0:
            for k in range(len(first) - 1):
                best = min(best, nearest(seg, first[k], first[k + 1], path[6:9], x, y, z, tol)[0])
        else:
            gap = planar_gap(path, x, y)
            for k in range(len(first) - 1):
                best = min(best, meridian(seg, first[k], first[k + 1], gap, z)[0])
        out[i] = best


@kernel
def left(lo, hi, counts, between, cut, enter, leave) -> int:
    """Write the intervals of all rays one after the other, without what is shorter than MERGE; how many, and `counts` anew.

    between : (n, 2) parts of rays, to which intervals are cut where `cut`.
    """
    found = 0
    for i in range(len(counts)):
        before = found
        for k in range(counts[i]):
            a, b = lo[i, k], hi[i, k]
            if cut:
                a, b = max(a, between[i, 0]), min(b, between[i, 1])
            if b - a > MERGE:
                enter[found], leave[found] = a, b
                found += 1
        counts[i] = found - before
    return found
