# One pose of a convex body of revolution: its motion, the lines that cross it, distances to it.
#
# Legend: waves (m, 19) rows of the motion: w, tip Re Z0, Im Z0, Re Z1, Im Z1 (3 each), axis Re Z0, Im Z0;
#   value = Re[(Z0 + t Z1) exp(iwt)]. state p (12,): tip c, axis A, velocity c', rate A'.
# planes (k, 3): n_r, n_z, d, the body obeys n_r rho + n_z z <= d. arcs (j, 7): centre (r, z), R, lowest and
#   highest normal. seg: rows of the meridian as in sweep/_kernels.py. ends (pieces + 1, 3): first plane, arc
#   and segment of each piece.
# limits (pieces, 7): height of a middle point of the axis, radius of the ball about it that holds the piece,
#   and bounds of |c_m'|, |c_m''| of that point, |A'|, |A''|, and of |A.c''| if the axis is steady, else -1.
# shot (13,): hit?, then s, nu = N.u, f = N.V, g = N.(omega x u) at the entry and at the exit of a ray, then for
#   both a bend and the time it holds for a plane that keeps its direction, or -1: on a sphere, and on a disc
#   whose axis is steady, such a plane moves with the centre only.
# s ray parameter, mm; t time in [0, 1].

import numpy as np

from vmachining.jit import leaf
from vmachining.sweep._kernels import meridian
from vmachining.sweep.grazing._kernels import normal_speed


@leaf
def state(waves, t, p) -> None:
    """Tip, axis and their rates at t."""
    for k in range(12):
        p[k] = 0.0
    for j in range(len(waves)):
        w = waves[j, 0]
        if w == 0.0:
            for k in range(3):
                p[k] += waves[j, 1 + k] + t * waves[j, 7 + k]
                p[3 + k] += waves[j, 13 + k]
                p[6 + k] += waves[j, 7 + k]
            continue
        cos, sin = np.cos(w * t), np.sin(w * t)
        for k in range(3):
            re = waves[j, 1 + k] + t * waves[j, 7 + k]
            im = waves[j, 4 + k] + t * waves[j, 10 + k]
            value, turned = re * cos - im * sin, -re * sin - im * cos
            p[k] += value
            p[6 + k] += w * turned + waves[j, 7 + k] * cos - waves[j, 10 + k] * sin
            p[3 + k] += waves[j, 13 + k] * cos - waves[j, 16 + k] * sin
            p[9 + k] -= w * (waves[j, 13 + k] * sin + waves[j, 16 + k] * cos)


@leaf
def bending(limit, far, width):
    """Bound of |y''| of a point at most `far` mm from the middle of the body at some time of the stretch."""
    reach = far + width * limit[2]
    return limit[3] + 2.0 * limit[4] * limit[2] + (limit[5] + limit[4] ** 2) * reach


@leaf
def spinning(waves, x, y, z):
    """Bound of |y''| of a point in a frame that spins about the tool's axis; inf but on helices about it.

    A body of revolution may spin. At the rate w of a tip that goes round an axis parallel to its own the point runs on a circle
    about that axis: l w^2, l its distance from it. On the axis itself, where all poses are equally near, nothing bends.
    """
    w, a0, a1, a2 = 0.0, 0.0, 0.0, 0.0
    for j in range(len(waves)):
        if waves[j, 0] == 0.0:
            a0, a1, a2 = a0 + waves[j, 13], a1 + waves[j, 14], a2 + waves[j, 15]
            x, y, z = x - waves[j, 1], y - waves[j, 2], z - waves[j, 3]
    for j in range(len(waves)):
        q = waves[j]
        if q[0] == 0.0:
            u, v = q[7], q[8]
            b = a0 * u + a1 * v + a2 * q[9]
            off = (u - b * a0) ** 2 + (v - b * a1) ** 2 + (q[9] - b * a2) ** 2
            if off > 1e-24 * (1.0 + b * b):
                return np.inf
            continue
        if w != 0.0:
            return np.inf
        w = q[0]
        for k in range(7, 19):
            if q[k] != 0.0:
                return np.inf
        lean = abs(a0 * q[1] + a1 * q[2] + a2 * q[3]) + abs(a0 * q[4] + a1 * q[5] + a2 * q[6])
        if lean > 1e-12 * np.sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]):
            return np.inf
    if w == 0.0:
        return np.inf
    b = a0 * x + a1 * y + a2 * z
    return w * w * np.sqrt((x - b * a0) ** 2 + (y - b * a1) ** 2 + (z - b * a2) ** 2)


@leaf
def clip_planes(planes, k0, k1, z0, uz, q0, q1, q2):
    """Part of a line inside all cones and discs: (lo, hi, plane at lo, plane at hi); empty is lo > hi.

    Along the line z = z0 + s uz, rho^2 = q0 + 2 q1 s + q2 s^2. Each plane is n_r rho <= e(s), e linear: a convex
    set, an interval between roots of n_r^2 rho^2 = e^2 on the side e >= 0.
    """
    lo, hi, i_lo, i_hi = -np.inf, np.inf, -1, -1
    for k in range(k0, k1):
        n_r, n_z = planes[k, 0], planes[k, 1]
        e0, e1 = planes[k, 2] - n_z * z0, -n_z * uz
        if n_r == 0.0:
            if e1 == 0.0:
                if e0 < 0.0:
                    return 1.0, 0.0, -1, -1
                continue
            root = -e0 / e1
            if e1 > 0.0:
                low, high = root, np.inf
            else:
                low, high = -np.inf, root
        else:
            n2 = n_r * n_r
            a, b, c = n2 * q2 - e1 * e1, n2 * q1 - e0 * e1, n2 * q0 - e0 * e0
            gap = b * b - a * c
            if a >= 0.0:
                if gap < 0.0:
                    return 1.0, 0.0, -1, -1
                q = -(b + np.copysign(np.sqrt(gap), b))
                if q == 0.0:
                    if c > 0.0:
                        return 1.0, 0.0, -1, -1
                    if a == 0.0:
                        continue
                    low, high = 0.0, 0.0
                else:
                    x, y = q / a, c / q
                    low, high = min(x, y), max(x, y)
                if e0 + e1 * (low if abs(low) < abs(high) else high) < 0.0:  # both roots on the other cone
                    return 1.0, 0.0, -1, -1
            else:
                q = -(b + np.copysign(np.sqrt(max(gap, 0.0)), b))
                x = q / a
                y = c / q if q != 0.0 else x
                if e1 > 0.0:
                    low, high = max(x, y), np.inf
                else:
                    low, high = -np.inf, min(x, y)
        if low > lo:
            lo, i_lo = low, k
        if high < hi:
            hi, i_hi = high, k
        if lo > hi:
            return 1.0, 0.0, -1, -1
    return lo, hi, i_lo, i_hi


@leaf
def clip_arc(arc, z0, uz, q0, q1, q2, s, stop, way, tol):
    """Newton from outside along the line to the arc: (s, met?, alive?). Convex, so the root is never passed."""
    met = False
    for _ in range(80):
        rho = np.sqrt(max(q0 + s * (2.0 * q1 + s * q2), 0.0))
        w_r, w_z = rho - arc[0], z0 + s * uz - arc[1]
        if arc[3] * w_z - arc[4] * w_r < 0.0 or w_r * arc[6] - w_z * arc[5] < 0.0:
            return s, met, True
        far = np.sqrt(w_r * w_r + w_z * w_z)
        if far - arc[2] <= tol:
            return s, met, True
        slope_r = (q1 + q2 * s) / rho if rho > 0.0 else np.sqrt(q2) * way
        slope = way * (w_r * slope_r + w_z * uz) / far
        met = True
        if slope >= 0.0:
            return s, met, False
        new = s - way * (far - arc[2]) / slope
        if way * (stop - new) < 0.0:
            return s, met, False
        if new == s:
            return s, met, True
        s = new
    return s, met, True


@leaf
def aim(planes, arcs, ends, piece, p, o, u, limit, tol, shot):
    """Entry and exit of a line in one piece at one pose, with normals and speeds; fills `shot`."""
    w_x, w_y, w_z = o[0] - p[0], o[1] - p[1], o[2] - p[2]
    up = u[0] * p[3] + u[1] * p[4] + u[2] * p[5]
    base = w_x * u[0] + w_y * u[1] + w_z * u[2] - limit[0] * up
    w_x, w_y, w_z = w_x - base * u[0], w_y - base * u[1], w_z - base * u[2]  # foot of the middle of the body
    z0 = w_x * p[3] + w_y * p[4] + w_z * p[5]
    a_x, a_y, a_z = w_x - z0 * p[3], w_y - z0 * p[4], w_z - z0 * p[5]
    b_x, b_y, b_z = u[0] - up * p[3], u[1] - up * p[4], u[2] - up * p[5]
    q0 = a_x * a_x + a_y * a_y + a_z * a_z
    q1 = a_x * b_x + a_y * b_y + a_z * b_z
    q2 = b_x * b_x + b_y * b_y + b_z * b_z
    shot[0] = 0.0
    lo, hi, i_lo, i_hi = clip_planes(planes, ends[piece, 0], ends[piece + 1, 0], z0, up, q0, q1, q2)
    if lo > hi:
        return
    for k in range(ends[piece, 1], ends[piece + 1, 1]):
        lo, met, alive = clip_arc(arcs[k], z0, up, q0, q1, q2, lo, hi, 1.0, tol)
        if not alive:
            return
        if met:
            i_lo = -2 - k
        hi, met, alive = clip_arc(arcs[k], z0, up, q0, q1, q2, hi, lo, -1.0, tol)
        if not alive:
            return
        if met:
            i_hi = -2 - k
    if lo > hi:
        return
    shot[0] = 1.0
    for side in range(2):
        s, i = (lo, i_lo) if side == 0 else (hi, i_hi)
        rho, z = np.sqrt(max(q0 + s * (2.0 * q1 + s * q2), 0.0)), z0 + s * up
        m_x, m_y, m_z = 0.0, 0.0, 0.0
        if rho > 0.0:
            m_x, m_y, m_z = (a_x + s * b_x) / rho, (a_y + s * b_y) / rho, (a_z + s * b_z) / rho
        steady, holds = -1.0, np.inf
        if i >= 0:
            n_r, n_z = planes[i, 0], planes[i, 1]
            if n_r == 0.0:
                steady = limit[6]
        else:
            k = -2 - i
            n_r, n_z = (rho - arcs[k, 0]) / arcs[k, 2], (z - arcs[k, 1]) / arcs[k, 2]
            if arcs[k, 0] == 0.0:
                steady = limit[3] + abs(arcs[k, 1] - limit[0]) * limit[5]
                margin = min(arcs[k, 6], 2.0) - n_z if arcs[k, 6] < 1.0 else np.inf
                if arcs[k, 4] > -1.0:
                    margin = min(margin, n_z - arcs[k, 4])
                if limit[4] > 0.0:
                    holds = max(margin, 0.0) / limit[4]
        shot[9 + 2 * side], shot[10 + 2 * side] = steady, holds
        turn = m_x * p[9] + m_y * p[10] + m_z * p[11]
        j = 1 + 4 * side
        shot[j] = s - base
        shot[j + 1] = n_r * (m_x * u[0] + m_y * u[1] + m_z * u[2]) + n_z * up
        lift = p[6] * p[3] + p[7] * p[4] + p[8] * p[5]
        shot[j + 2] = normal_speed(z, rho, n_r, n_z, m_x * p[6] + m_y * p[7] + m_z * p[8], lift, turn)
        shot[j + 3] = n_r * turn * up - n_z * (p[9] * u[0] + p[10] * u[1] + p[11] * u[2])


@leaf
def near(seg, i0, i1, p, x, y, z):
    """phi of a point at one pose, its gradient N and f = N.V."""
    w_x, w_y, w_z = x - p[0], y - p[1], z - p[2]
    h = w_x * p[3] + w_y * p[4] + w_z * p[5]
    w_x, w_y, w_z = w_x - h * p[3], w_y - h * p[4], w_z - h * p[5]
    rho = np.sqrt(w_x * w_x + w_y * w_y + w_z * w_z)
    d, n_r, n_z = meridian(seg, i0, i1, rho, h)
    if rho > 0.0:
        w_x, w_y, w_z = w_x / rho, w_y / rho, w_z / rho
    else:
        w_x, w_y, w_z = 0.0, 0.0, 0.0
    n_x, n_y, n_h = n_r * w_x + n_z * p[3], n_r * w_y + n_z * p[4], n_r * w_z + n_z * p[5]
    f = normal_speed(
        h, rho, n_r, n_z,
        w_x * p[6] + w_y * p[7] + w_z * p[8],
        p[3] * p[6] + p[4] * p[7] + p[5] * p[8],
        w_x * p[9] + w_y * p[10] + w_z * p[11],
    )  # fmt: skip
    return d, n_x, n_y, n_h, f
