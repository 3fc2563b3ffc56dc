# Distances and ray intervals of a body of revolution that translates along a line or a helix.
#
# Legend: seg rows (r0, z0, r1, z1, cr, cz, R, n_r, n_z, length), discs included, one closed convex meridian
#   per piece, pieces are seg[first[k]:first[k+1]]; R = 0 is a line. phi signed distance to a piece, n its
#   gradient.
# path (10,): A (start - centre), B (axis x A), D (rise or straight travel), (3,) each, angle;
#   p(t) = A (cos(t angle) - 1) + B sin(t angle) + D t, relative to the start.
# cell (20,): a stretch [ta, tb] of the path: 0 arc? 1:4 P0, 4:7 chord, 7:10 A, 10:13 B, 13 angle, 14:17 D,
#   17 horizontal growth of the body, 18 isotropic growth, 19 sagitta. tau in [0, 1] runs along the cell.
# s ray parameter, mm. tol mm, what rounding allows (a few ulp of the extent of the sweep).

import numpy as np

from vmachining.jit import kernel
from vmachining.numerics._kernels import covered, insert, slab

STOP = 1e-11  # mm: sagitta at which a cell counts as straight enough to be solved on its own
MERGE = 1e-10  # mm: intervals closer than this are one
MAX_CELLS = 20000  # cells of one ray or point; beyond, what is left is polished without proof


@kernel
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


@kernel
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


@kernel
def set_cell(path, ta, tb, flat, cell):
    """Chord of the path between two parameters, with the growth that makes it contain the arc.

    A horizontal sagitta (flat) grows the body horizontally only: discs stay in their plane.
    """
    angle = path[9] * (tb - ta)
    begin = path[9] * ta
    cos, sin = np.cos(begin), np.sin(begin)
    versed = -2.0 * np.sin(0.5 * begin) ** 2
    half, turn_sin = -2.0 * np.sin(0.5 * angle) ** 2, np.sin(angle)
    size = 0.0
    for k in range(3):
        a, b, d = path[k], path[3 + k], path[6 + k]
        cell[1 + k] = a * versed + b * sin + d * ta
        cell[7 + k] = a * cos + b * sin
        cell[10 + k] = b * cos - a * sin
        cell[14 + k] = d * (tb - ta)
        cell[4 + k] = cell[7 + k] * half + cell[10 + k] * turn_sin + cell[14 + k]
        size += a * a
    size = np.sqrt(size)
    sag = min(size * angle * angle / 8.0, 2.0 * size)  # |p''| w^2 / 8 bounds arc minus chord at equal tau
    cell[0], cell[13], cell[19] = 0.0, angle, sag
    cell[17], cell[18] = (sag, 0.0) if flat else (0.0, sag)


@kernel
def exact_cell(cell):
    """Turn the grown chord into the arc itself."""
    cell[0], cell[17], cell[18] = 1.0, 0.0, 0.0


@kernel
def pose(seg, i0, i1, cell, tau, x, y, z):
    """phi of a point to the body at tau, its gradient (3,) and its slope in tau."""
    if cell[0] == 0.0:
        v_x, v_y, v_z = cell[4], cell[5], cell[6]
        q_x, q_y, q_z = x - cell[1] - tau * v_x, y - cell[2] - tau * v_y, z - cell[3] - tau * v_z
    else:
        angle = cell[13]
        sin = np.sin(tau * angle)
        half = -2.0 * np.sin(0.5 * tau * angle) ** 2
        cos = 1.0 + half
        q_x = x - cell[1] - cell[7] * half - cell[10] * sin - cell[14] * tau
        q_y = y - cell[2] - cell[8] * half - cell[11] * sin - cell[15] * tau
        q_z = z - cell[3] - cell[9] * half - cell[12] * sin - cell[16] * tau
        v_x = angle * (cell[10] * cos - cell[7] * sin) + cell[14]
        v_y = angle * (cell[11] * cos - cell[8] * sin) + cell[15]
        v_z = angle * (cell[12] * cos - cell[9] * sin) + cell[16]
    rho = np.sqrt(q_x * q_x + q_y * q_y)
    d, n_r, n_z = meridian(seg, i0, i1, max(rho - cell[17], 0.0), q_z)
    if rho > cell[17]:
        n_x, n_y = n_r * q_x / rho, n_r * q_y / rho
    else:
        n_x, n_y = 0.0, 0.0  # on the axis the mean of all directions
    return d - cell[18], n_x, n_y, n_z, -(n_x * v_x + n_y * v_y + n_z * v_z)


@kernel
def nearest(seg, i0, i1, cell, x, y, z, tol):
    """Smallest phi over the cell, to `tol` where phi is convex in tau: (phi, n_x, n_y, n_z, tau).

    For a chord phi is convex in (point, tau). A cut through the two ends of the bracket, mixed so that its
    slope in tau vanishes, supports min over tau of phi; n is the gradient of that cut, not of one pose.
    """
    speed = cell[4] ** 2 + cell[5] ** 2
    tau = 0.5
    if speed > 0.0:
        tau = ((x - cell[1]) * cell[4] + (y - cell[2]) * cell[5]) / speed
        tau = min(max(tau, 0.0), 1.0)
    d, n_x, n_y, n_z, g = pose(seg, i0, i1, cell, tau, x, y, z)
    if cell[0] == 0.0 and cell[6] == 0.0:  # horizontal: phi grows with the distance to the axis
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
        d, n_x, n_y, n_z, g = pose(seg, i0, i1, cell, tau, x, y, z)
    if not (low_known and high_known):
        return d, n_x, n_y, n_z, tau
    share = g_h / (g_h - g_l)
    rest = 1.0 - share
    n_x, n_y, n_z = share * x_l + rest * x_h, share * y_l + rest * y_h, share * z_l + rest * z_h
    if d_l <= d_h:
        return d_l, n_x, n_y, n_z, t_l
    return d_h, n_x, n_y, n_z, t_h


@kernel
def approach(seg, i0, i1, cell, o, u, s, s_end, way, tol):
    """First s from outside, walking in direction `way`, where the ray meets the cell; NaN if it never does.

    min over tau of phi is convex along the ray for a chord, so Newton's step never passes the first root. For
    an arc that is almost a chord it may pass it by the sagitta: regula falsi (Illinois) goes back.
    """
    out, d_out = np.nan, 0.0
    for _ in range(200):
        x, y, z = o[0] + s * u[0], o[1] + s * u[1], o[2] + s * u[2]
        d, n_x, n_y, n_z, _tau = nearest(seg, i0, i1, cell, x, y, z, 0.25 * tol)
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
        d = nearest(seg, i0, i1, cell, o[0] + s * u[0], o[1] + s * u[1], o[2] + s * u[2], 0.25 * tol)[0]
        if abs(d) <= tol:
            break
        if d > 0.0:
            out, d_out, d_into = s, d, 0.5 * d_into
        else:
            into, d_into, d_out = s, d, 0.5 * d_out
    return s


@kernel
def stretch(seg, size, i0, i1, piece, cell, o, u, from_s, to_s, tol):
    """Interval of the ray in one convex piece along one cell; (NaN, NaN) if it misses.

    size: (r, z0, z1). from_s, to_s: where the parent cell was met, a start that is checked, or infinite.
    """
    margin = 1e-6 + cell[18] + (cell[19] if cell[0] != 0.0 else 0.0)
    r = size[piece, 0] + cell[17] + margin
    a, b = -np.inf, np.inf
    for k in range(2):
        low, high = min(cell[1 + k], cell[1 + k] + cell[4 + k]), max(cell[1 + k], cell[1 + k] + cell[4 + k])
        a, b = slab(o, u, k, low - r, high + r, a, b)
    low, high = min(cell[3], cell[3] + cell[6]), max(cell[3], cell[3] + cell[6])
    a, b = slab(o, u, 2, low + size[piece, 1] - margin, high + size[piece, 2] + margin, a, b)
    if a > b:
        return np.nan, np.nan
    start = from_s - 2.0 * cell[19]
    first = np.nan
    if start > a:
        first = approach(seg, i0, i1, cell, o, u, start, b, 1.0, tol)
    if not start > a or first == start:  # no hint, or the hint was inside
        first = approach(seg, i0, i1, cell, o, u, a, b, 1.0, tol)
    if np.isnan(first):
        return np.nan, np.nan
    start = to_s + 2.0 * cell[19]
    final = np.nan
    if start < b:
        final = approach(seg, i0, i1, cell, o, u, start, a, -1.0, tol)
    if not start < b or final == start:
        final = approach(seg, i0, i1, cell, o, u, b, a, -1.0, tol)
    if np.isnan(final) or final < first:  # a touch: rounding decides on which side
        return first, first
    return first, final


@kernel
def ray_straight(seg, first, size, cell, o, u, tol, lo, hi):
    """Straight motion or no motion: one interval per convex piece, merged."""
    n = 0
    for k in range(len(first) - 1):
        a, b = stretch(seg, size, first[k], first[k + 1], k, cell, o, u, -np.inf, np.inf, tol)
        if a <= b:
            n = insert(lo, hi, n, a, b, MERGE)
            if n < 0:
                return n
    return n


@kernel
def ray_curved(seg, first, size, path, flat, parts, cell, stack, o, u, tol, lo, hi):
    """Arc or helix: poses give intervals that surely belong; cells that could add to them are split."""
    n = 0
    pieces = len(first) - 1
    for k in range(pieces):
        for j in range(parts + 1):
            set_cell(path, j / parts, j / parts, flat, cell)
            a, b = stretch(seg, size, first[k], first[k + 1], k, cell, o, u, -np.inf, np.inf, tol)
            if a <= b:
                n = insert(lo, hi, n, a, b, MERGE)
                if n < 0:
                    return n
    seen = 0
    for k in range(pieces):
        for j in range(parts):
            top = 0
            stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = j / parts, (j + 1) / parts, -np.inf, np.inf
            while top >= 0:
                ta, tb, from_s, to_s = stack[top]
                top -= 1
                seen += 1
                set_cell(path, ta, tb, flat, cell)
                a, b = stretch(seg, size, first[k], first[k + 1], k, cell, o, u, from_s, to_s, tol)
                if not a <= b or covered(lo, hi, n, a, b, tol):
                    continue
                if cell[19] <= STOP or seen > MAX_CELLS or top + 3 > len(stack):
                    exact_cell(cell)
                    from_s, to_s = a, b
                    a, b = stretch(seg, size, first[k], first[k + 1], k, cell, o, u, from_s, to_s, tol)
                    if a <= b:
                        n = insert(lo, hi, n, a, b, MERGE)
                else:
                    middle, from_s, to_s = 0.5 * (ta + tb), a, b
                    set_cell(path, middle, middle, flat, cell)
                    a, b = stretch(seg, size, first[k], first[k + 1], k, cell, o, u, from_s, to_s, tol)
                    if a <= b:
                        n = insert(lo, hi, n, a, b, MERGE)
                    for half in range(2):
                        top += 1
                        stack[top, 0], stack[top, 1] = (ta, middle) if half else (middle, tb)
                        stack[top, 2], stack[top, 3] = from_s, to_s
                if n < 0:
                    return n
    return n


@kernel
def rays(seg, first, size, path, flat, parts, origins, directions, tol, counts, lo, hi) -> None:
    """Intervals of every ray; counts[i] = -1 where lo, hi (n, capacity) are full. Origins from the start."""
    cell, stack = np.zeros(20), np.zeros((128, 4))
    o = np.empty(3)
    for i in range(len(origins)):
        u = directions[i]
        shift = -(origins[i, 0] * u[0] + origins[i, 1] * u[1] + origins[i, 2] * u[2])
        for k in range(3):  # foot of the ray near the start: no long lever
            o[k] = origins[i, k] + shift * u[k]
        level = flat and path[8] == 0.0
        if path[9] == 0.0:
            set_cell(path, 0.0, 1.0, flat, cell)
            n = ray_straight(seg, first, size, cell, o, u, tol, lo[i], hi[i])
        elif level and u[0] == 0.0 and u[1] == 0.0:  # upright ray: only the nearest pose counts
            set_cell(path, 0.0, 0.0, flat, cell)
            o[0], o[1] = planar_gap(path, o[0], o[1]), 0.0
            n = ray_straight(seg, first, size, cell, o, u, tol, lo[i], hi[i])
        else:
            n = ray_curved(seg, first, size, path, flat, parts, cell, stack, o, u, tol, lo[i], hi[i])
        counts[i] = n
        for j in range(max(n, 0)):
            lo[i, j] += shift
            hi[i, j] += shift


@kernel
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


@kernel
def point_curved(seg, first, path, flat, parts, cell, stack, x, y, z, tol):
    """Smallest phi over an arc or helix and all pieces, by branch and bound on chords."""
    best = np.inf
    pieces = len(first) - 1
    for j in range(parts + 1):
        set_cell(path, j / parts, j / parts, flat, cell)
        for k in range(pieces):
            best = min(best, pose(seg, first[k], first[k + 1], cell, 0.0, x, y, z)[0])
    seen = 0
    for k in range(pieces):
        i0, i1 = first[k], first[k + 1]
        for j in range(parts):
            top = 0
            stack[0, 0], stack[0, 1] = j / parts, (j + 1) / parts
            while top >= 0:
                ta, tb = stack[top, 0], stack[top, 1]
                top -= 1
                seen += 1
                set_cell(path, ta, tb, flat, cell)
                d, _x, _y, _z, tau = nearest(seg, i0, i1, cell, x, y, z, tol)
                if d >= best - tol:
                    continue
                sag = cell[19]
                exact_cell(cell)
                if sag <= STOP or seen > MAX_CELLS or top + 3 > len(stack):
                    best = min(best, nearest(seg, i0, i1, cell, x, y, z, tol)[0])
                    continue
                best = min(best, pose(seg, i0, i1, cell, tau, x, y, z)[0])
                middle = 0.5 * (ta + tb)
                stack[top + 1, 0], stack[top + 1, 1] = middle, tb
                stack[top + 2, 0], stack[top + 2, 1] = ta, middle
                top += 2
    return best


@kernel
def distances(seg, first, path, flat, parts, points, tol, out) -> None:
    """Signed distance of every point (from the start) to the sweep."""
    cell, stack = np.zeros(20), np.zeros((128, 2))
    for i in range(len(points)):
        x, y, z = points[i]
        best = np.inf
        if path[9] == 0.0:
            set_cell(path, 0.0, 1.0, flat, cell)
            for k in range(len(first) - 1):
                best = min(best, nearest(seg, first[k], first[k + 1], cell, x, y, z, tol)[0])
        elif flat and path[8] == 0.0:
            gap = planar_gap(path, x, y)
            for k in range(len(first) - 1):
                best = min(best, meridian(seg, first[k], first[k + 1], gap, z)[0])
        else:
            best = point_curved(seg, first, path, flat, parts, cell, stack, x, y, z, tol)
        out[i] = best
