# Signed distances of points to sweeps of upright round cutters that reach above the stock: closed forms, many points at once.
#
# Legend: a cutter is a rounded box in (rho, w), w the height above the tip: corner radius r about (rc, r), wall at R = rc + r, no
#   top. g(rho, w) = |(u+, v+)| + min(max(u, v), 0) - r with u = rho - rc, v = r - w: its distance. Ball: rc = 0, flat: r = 0.
# Kinds of a sweep: BALL ball on a line, LEVEL any rounded box on a level line, CIRCLE on a level arc about z, RAMP on a sloped
#   line, HELIX on at most a quarter of a turn of a helix; EXACT by the general distances of `margin`; POSES see below.
# Columns of num, one row each: 0 start (3), 3 D (3) to the end, 6 centre x y, of a line 1 / |D_xy|^2 (0 for a plunge) and
#   1 / |D|^2, 8 radius of the path, 9 angle of the start, 10 turned angle, 11 direction of the middle (2), 13 cosine of half the
#   angle (-1.1: whole circle), 14 end x y, 16 rc, 17 r, 18 |D_xy|^2, 19 |D|^2, 20 unit velocity at the start (3), 23 at the end
#   (3), 26 end z, 27 lowest and 28 highest z of the tip.
# POSES, a cutter with a wall that may lean by tau and with a top at w = H, whose tip and axis are cubics of t: 0 tip (3), its
#   coefficients of t, t^2, t^3 (3 each), 12 cosine and sine of tau, 14 end x y, 16 rc, 17 r, 18 H, 19 bend (mm, how far minima
#   over t may lie below a convex function), 20 axis (3), 23 coefficient of t (3), 26 end z, 27 of t^2 (3), 30 of t^3 (3), 33
#   depth up to which a point counts as on the surface, 34 way of any point of the cutter to the middle of the motion, at most,
#   35 tip and 38 axis there (3 each).

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.engagement.along.kernels.margin_kernels import sweep_gap
from vmachining.jit import leaf

BALL, LEVEL, CIRCLE, RAMP, HELIX, EXACT, POSES = 0, 1, 2, 3, 4, 5, 6
# mm: how well minima over a motion are known near it, and outside
FINE, FINE_POSE, COARSE = 1e-10, 1e-8, 1e-4
SHARE = 0.01  # of the distance, the same
LANES = 8  # numbers that a processor takes at once; what is left over costs as much again


class Rows(NamedTuple):
    """Sweeps in program order. kind, tool, exact (row of the World, -1) : (n,). num : (n, 41), see the legend. box : (n, 6)."""

    kind: NDArray[np.int64]
    tool: NDArray[np.int64]
    exact: NDArray[np.int64]
    num: NDArray[np.float64]
    box: NDArray[np.float64]


@leaf
def rounded(rho, w, rc, r):
    """g(rho, w)."""
    u, v = rho - rc, r - w
    a, b = max(u, 0.0), max(v, 0.0)
    return np.sqrt(a * a + b * b) + min(max(u, v), 0.0) - r


@leaf
def slopes(rho, w, rc, r):
    """Derivatives of g with rho and with w."""
    u, v = rho - rc, r - w
    if u > 0.0 and v > 0.0:
        size = np.sqrt(u * u + v * v)
        return u / size, -v / size
    if u >= v:
        return 1.0, 0.0
    return 0.0, -1.0


@leaf
def at_ramp(q, x, y, z, t):
    """g and its derivative with t on a line."""
    a, b = x - t * q[3], y - t * q[4]
    rho, w = np.sqrt(a * a + b * b), z - t * q[5]
    g_rho, g_w = slopes(rho, w, q[16], q[17])
    turn = -(a * q[3] + b * q[4]) / rho if rho > 1e-12 else 0.0
    return rounded(rho, w, q[16], q[17]), g_rho * turn - g_w * q[5]


@leaf
def at_helix(q, away, along, lead, z, t):
    """g and its derivative with t on a helix; away l - a, along 2 a l, lead the angle of the point from the start."""
    turn = t * q[10] - lead
    half = np.sin(0.5 * turn)
    rho = np.sqrt(away * away + 2.0 * along * half * half)
    w = z - t * q[5]
    g_rho, g_w = slopes(rho, w, q[16], q[17])
    change = 0.5 * along * q[10] * np.sin(turn) / rho if rho > 1e-12 else 0.0
    return rounded(rho, w, q[16], q[17]), g_rho * change - g_w * q[5]


@leaf
def at_pose(q, x, y, z, t):
    """Distance of a point to the cutter at one pose, and its derivative with t."""
    dx = x - q[0] - t * (q[3] + t * (q[6] + t * q[9]))
    dy = y - q[1] - t * (q[4] + t * (q[7] + t * q[10]))
    dz = z - q[2] - t * (q[5] + t * (q[8] + t * q[11]))
    ax = q[20] + t * (q[23] + t * (q[27] + t * q[30]))
    ay = q[21] + t * (q[24] + t * (q[28] + t * q[31]))
    az = q[22] + t * (q[25] + t * (q[29] + t * q[32]))
    vx = q[3] + t * (2.0 * q[6] + 3.0 * t * q[9])
    vy = q[4] + t * (2.0 * q[7] + 3.0 * t * q[10])
    vz = q[5] + t * (2.0 * q[8] + 3.0 * t * q[11])
    bx = q[23] + t * (2.0 * q[27] + 3.0 * t * q[30])
    by = q[24] + t * (2.0 * q[28] + 3.0 * t * q[31])
    bz = q[25] + t * (2.0 * q[29] + 3.0 * t * q[32])
    w = dx * ax + dy * ay + dz * az
    dw = dx * bx + dy * by + dz * bz - (vx * ax + vy * ay + vz * az)
    rx, ry, rz = dx - w * ax, dy - w * ay, dz - w * az
    rho = np.sqrt(rx * rx + ry * ry + rz * rz)
    # radial direction times the rates: of the tip, and of the axis at height w
    d_rho = -(rx * (vx + w * bx) + ry * (vy + w * by) + rz * (vz + w * bz)) / rho if rho > 1e-12 else 0.0
    u, v = rho - q[16], q[17] - w
    cos, sin = q[12], q[13]
    side = u * cos + v * sin
    if u > 0.0 and v * cos - u * sin > 0.0:
        size = np.sqrt(u * u + v * v)
        d, slope = size, (u * d_rho - v * dw) / size
    elif v > side:
        d, slope = v, -dw
    else:
        d, slope = side, cos * d_rho - sin * dw
    d -= q[17]
    return (d, slope) if d >= w - q[18] else (w - q[18], dw)


@leaf
def midway(q, x, y, z):
    """Distance of a point to the cutter in the middle of its poses; to the others it differs by less than q[34]."""
    dx, dy, dz = x - q[35], y - q[36], z - q[37]
    w = dx * q[38] + dy * q[39] + dz * q[40]
    u, v = np.sqrt(max(dx * dx + dy * dy + dz * dz - w * w, 0.0)) - q[16], q[17] - w
    d = max(u * q[12] + v * q[13], v)
    if u > 0.0 and v * q[12] - u * q[13] > 0.0:
        d = np.sqrt(u * u + v * v)
    return max(d - q[17], w - q[18])


@leaf
def at_time(q, kind, at, t):
    """Distance to the cutter at one time of a motion, and its derivative with t.

    at : the point; from the start for RAMP and HELIX, whose last numbers are those of `at_helix`.
    """
    if kind == POSES:
        return at_pose(q, at[0], at[1], at[2], t)
    if kind == HELIX:
        return at_helix(q, at[3], at[4], at[5], at[2], t)
    return at_ramp(q, at[0], at[1], at[2], t)


@leaf
def valley(q, kind, best, at, low, high, d0, s0, d1, s1):
    """The smaller of `best` and the least distance between two times whose slopes lead down to what lies between.

    Secants in a bracket of the slope, where an end that stays counts half (Illinois), every fourth step halved; given up where
    all that the bracket can hold exceeds `best`.
    """
    found = min(d0, d1)
    best = min(best, found)
    bend, finest = (4.0 * q[19], FINE_POSE) if kind == POSES else (0.0, FINE)
    f, g, side = s0, s1, 0
    for step in range(60):
        width = high - low
        # on a convex function the two tangents bound it from below where they meet; a quarter of a helix is nearly so
        floor = (d0 * s1 - d1 * s0 + s0 * s1 * width) / (s1 - s0)
        if kind == HELIX:
            floor = found - min(-s0, s1) * width
        fine = max(finest, SHARE * -found if found < 0.0 else min(COARSE, SHARE * found))
        if found - floor <= fine or floor - bend * width * width > best or width < 1e-13:
            break
        t = low - f * width / (g - f) if step % 4 != 3 else 0.5 * (low + high)
        if not low < t < high:
            t = 0.5 * (low + high)
        d, s = at_time(q, kind, at, t)
        found = min(found, d)
        if s < 0.0:
            low, d0, s0, f = t, d, s, s
            g = 0.5 * g if side < 0 else s1
            side = -1
        elif s > 0.0:
            high, d1, s1, g = t, d, s, s
            f = 0.5 * f if side > 0 else s0
            side = 1
        else:
            break
    return min(best, found)


@leaf
def moving(q, kind, best, at):
    """The smaller of `best` and the least distance on a line or a helix, whose slope rises from end to end or nearly so."""
    d0, s0 = at_time(q, kind, at, 0.0)
    d1, s1 = at_time(q, kind, at, 1.0)
    if s0 < 0.0 < s1:
        return valley(q, kind, best, at, 0.0, 1.0, d0, s0, d1, s1)
    return min(best, min(d0, d1))


@leaf
def among_poses(q, best, x, y, z):
    """The smaller of `best` and the distance to a cutter on all its poses.

    Slopes fall by 8 `bend` at most, so at the share t from an end where the distance is d and its slope into the motion u, it is
    d + u t - 4 bend t^2 at least: mostly the end that is nearer tells all. Where slopes at both ends do not lead down to what
    lies between, and do not forbid a minimum there, the middle is asked, once. Such a minimum lies at most 4 `bend` deeper than
    the ends (a kink may rise at its end), beside the middle at most `bend`.
    """
    bend, at = q[19], (x, y, z, 0.0, 0.0, 0.0)
    # the end that the chord of the tip leads to, from the point
    x1, y1, z1 = q[14] - q[0], q[15] - q[1], q[26] - q[2]
    late = (x - q[0]) * x1 + (y - q[1]) * y1 + (z - q[2]) * z1 > 0.5 * (x1 * x1 + y1 * y1 + z1 * z1)
    d1, s1 = at_pose(q, x, y, z, 1.0 if late else 0.0)
    best = min(best, d1)
    if d1 + min((-s1 if late else s1) - 4.0 * bend, 0.0) >= best:
        return best
    d0, s0 = at_pose(q, x, y, z, 0.0 if late else 1.0)
    if not late:
        d0, s0, d1, s1 = d1, s1, d0, s0
    if s0 < 0.0 < s1:
        return valley(q, POSES, best, at, 0.0, 1.0, d0, s0, d1, s1)
    best = min(best, min(d0, d1))
    if bend < FINE or min(d0, d1) - 4.0 * bend > best or max(s0, 0.0) - min(s1, 0.0) >= 8.0 * bend:
        return best
    d, s = at_pose(q, x, y, z, 0.5)
    best = min(best, d)
    if s0 < 0.0 < s:
        best = valley(q, POSES, best, at, 0.0, 0.5, d0, s0, d, s)
    if s < 0.0 < s1:
        best = valley(q, POSES, best, at, 0.5, 1.0, d, s, d1, s1)
    return best


@leaf
def path_gap(q, x, y):
    """Distance in plan to a level arc; x, y from the centre."""
    reach = np.sqrt(x * x + y * y)
    if x * q[11] + y * q[12] >= reach * q[13]:
        return abs(reach - q[8])
    ax, ay = x + q[6] - q[0], y + q[7] - q[1]
    bx, by = x + q[6] - q[14], y + q[7] - q[15]
    return np.sqrt(min(ax * ax + ay * ay, bx * bx + by * by))


@leaf
def touch(rows, world, k):
    """Depth up to which a sweep does not cover a point, mm."""
    kind = rows.kind[k]
    return rows.num[k, 33] if kind == POSES else world.tol[rows.exact[k], 1] if kind == EXACT else 0.0


@leaf
def exact(rows, world, k, x, y, z, best, room):
    """The smaller of `best` and the distance of one point to a sweep without a closed form."""
    tol = touch(rows, world, k)
    return min(best, sweep_gap(world, rows.exact[k], x, y, z, best - tol, room) + tol)


@leaf
def gap(num, kind, k, x, y, z, best):
    """The smaller of `best` and the signed distance of one point to sweep k, whose kind has a closed form.

    The world is not handed down here: so many arrays cost more than the distance.
    """
    q = num[k]
    if kind == POSES:
        return min(best, among_poses(q, best - q[33], x, y, z) + q[33])
    if kind == CIRCLE:
        return min(best, rounded(path_gap(q, x - q[6], y - q[7]), z - q[2], q[16], q[17]))
    if kind == HELIX:
        cx, cy = x - q[6], y - q[7]
        reach = np.sqrt(cx * cx + cy * cy)
        away = reach - q[8]
        if rounded(abs(away), z - q[27], q[16], q[17]) >= best:
            return best
        lead = np.arctan2(cy, cx) - q[9]
        middle = 0.5 * q[10]
        lead -= 2.0 * np.pi * np.rint((lead - middle) / (2.0 * np.pi))
        return moving(q, HELIX, best, (0.0, 0.0, z - q[2], away, 2.0 * reach * q[8], lead))
    x, y, z = x - q[0], y - q[1], z - q[2]
    if kind == RAMP:
        t = 0.0
        if q[18] > 0.0:
            t = min(max((x * q[3] + y * q[4]) / q[18], 0.0), 1.0)
        a, b = x - t * q[3], y - t * q[4]
        if rounded(np.sqrt(a * a + b * b), z + q[2] - q[27], q[16], q[17]) >= best:
            return best  # lower than the tool ever comes by more than is known
        return moving(q, RAMP, best, (x, y, z, 0.0, 0.0, 0.0))
    t = 0.0
    if q[18] > 0.0:
        t = min(max((x * q[3] + y * q[4]) / q[18], 0.0), 1.0)
    a, b = x - t * q[3], y - t * q[4]
    if kind == LEVEL:
        return min(best, rounded(np.sqrt(a * a + b * b), z, q[16], q[17]))
    z -= q[17]
    if z >= t * q[5]:
        return min(best, np.sqrt(a * a + b * b) - q[17])
    t = min(max((x * q[3] + y * q[4] + z * q[5]) / q[19], 0.0), 1.0)
    a, b, c = x - t * q[3], y - t * q[4], z - t * q[5]
    return min(best, np.sqrt(a * a + b * b + c * c) - q[17])


@leaf
def lower(num, kind, k, x, y, z, m, who, c, n, out, far):
    """out[i] becomes the signed distance of point i to sweep k, m[i] the smaller of both, and who[i] c where it does.

    far : distances count up to this above m. n : points, best a multiple of `LANES`; see `gap`.
    """
    q = num[k]
    x0, y0, z0, dx, dy, dz = q[0], q[1], q[2], q[3], q[4], q[5]
    rc, r = q[16], q[17]
    if kind == BALL:
        plan, full = q[6], q[7]
        z0 += r
        for i in range(n):
            px, py, pz = x[i] - x0, y[i] - y0, z[i] - z0
            flat = px * dx + py * dy
            t = min(max(flat * plan, 0.0), 1.0)
            ax, ay = px - t * dx, py - t * dy
            s = min(max((flat + pz * dz) * full, 0.0), 1.0)
            bx, by, bz = px - s * dx, py - s * dy, pz - s * dz
            side = ax * ax + ay * ay
            deep = bx * bx + by * by + bz * bz
            out[i] = np.sqrt(side if pz >= t * dz else deep) - r
    elif kind == LEVEL:
        plan = q[6]
        for i in range(n):
            px, py = x[i] - x0, y[i] - y0
            t = min(max((px * dx + py * dy) * plan, 0.0), 1.0)
            ax, ay = px - t * dx, py - t * dy
            u, v = np.sqrt(ax * ax + ay * ay) - rc, r - (z[i] - z0)
            a, b = max(u, 0.0), max(v, 0.0)
            out[i] = np.sqrt(a * a + b * b) + min(max(u, v), 0.0) - r
    elif kind == CIRCLE:
        cx, cy, radius, bx, by, cos = q[6], q[7], q[8], q[11], q[12], q[13]
        ex, ey = q[14] - cx, q[15] - cy
        x0, y0 = x0 - cx, y0 - cy
        for i in range(n):
            px, py = x[i] - cx, y[i] - cy
            reach = np.sqrt(px * px + py * py)
            away = reach - radius
            sx, sy, fx, fy = px - x0, py - y0, px - ex, py - ey
            ends = min(sx * sx + sy * sy, fx * fx + fy * fy)
            rho = np.sqrt(away * away if px * bx + py * by >= reach * cos else ends)
            u, v = rho - rc, r - (z[i] - z0)
            a, b = max(u, 0.0), max(v, 0.0)
            out[i] = np.sqrt(a * a + b * b) + min(max(u, v), 0.0) - r
    else:
        for i in range(n):
            out[i] = gap(num, kind, k, x[i], y[i], z[i], m[i] + far)
    for i in range(n):  # by itself: the loops above stay short enough for all lanes
        d, most, old = out[i], m[i], who[i]
        less = d < most
        m[i], who[i] = d if less else most, c if less else old
