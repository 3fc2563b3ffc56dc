# Flux of a moving body of revolution through its own surface, and what of it enters a second time.
#
# Legend: faces (k, 8): r0, z0, r1, z1 of a line (discs included) or r0.. ignored on arcs; cr, cz, R (0: line),
#   then n_z of a horizontal line, else 0. beta (k, 2): normal angle at both ends (arcs) or twice the same.
# circle: radius rho, height h above the tip, normal (n_r, n_z), kappa = h n_r - rho n_z;
#   f(u) = a cos u + b sin u + c along m(u) = cos u x + sin u y, see grazing/condition.py.
# waves, limits, ends: see turned/_kernels.py.

import numpy as np

from vmachining.jit import kernel, leaf
from vmachining.sweep.grazing._kernels import normal_speed
from vmachining.sweep.rotating._kernels import span, split_at
from vmachining.sweep.rotating.pose._kernels import bending, near, state


@leaf
def circle(face, beta, x, out) -> None:
    """rho, h, n_r, n_z and d(slant)/dx at the share x in [0, 1] of a face."""
    if face[6] > 0.0:
        b = beta[0] + x * (beta[1] - beta[0])
        out[2], out[3] = np.cos(b), np.sin(b)
        out[0], out[1] = face[4] + face[6] * out[2], face[5] + face[6] * out[3]
        out[4] = face[6] * (beta[1] - beta[0])
    else:
        d_r, d_z = face[2] - face[0], face[3] - face[1]
        length = np.sqrt(d_r * d_r + d_z * d_z)
        out[0], out[1] = face[0] + x * d_r, face[1] + x * d_z
        out[2], out[3] = d_z / length, -d_r / length
        out[4] = length


@leaf
def front(r, c):
    """Integral of max(f, 0) over the circle: 2 (r sin w + c w), w = acos(-c / r) half the egress arc."""
    if r > abs(c):
        return 2.0 * (np.sqrt((r - c) * (r + c)) + c * np.arccos(-c / r))
    return 2.0 * np.pi * max(c, 0.0)


@leaf
def breaks_of(face, beta, terms, p, cuts) -> int:
    """Shares where a face changes from one- to two-sided, or where r has its near-kink; number of cuts.

    terms (3, 4): coefficients of r^2 - c^2 along the face, see `grazing/faces.py`.
    """
    lift = p[6] * p[3] + p[7] * p[4] + p[8] * p[5]
    vv, vs, ss, ll = -lift * lift, 0.0, 0.0, lift * lift
    for k in range(3):
        vv += p[6 + k] * p[6 + k]
        vs += p[6 + k] * p[9 + k]
        ss += p[9 + k] * p[9 + k]
    f0 = terms[0, 0] * vv + terms[0, 1] * vs + terms[0, 2] * ss + terms[0, 3] * ll
    f1 = terms[1, 0] * vv + terms[1, 1] * vs + terms[1, 2] * ss
    f2 = terms[2, 0] * vv + terms[2, 1] * vs + terms[2, 2] * ss + terms[2, 3] * ll
    gap = f1 * f1 - 4.0 * f0 * f2
    n = 0
    if face[6] > 0.0:
        # directions (cos, sin) with f0 cos^2 + f1 cos sin + f2 sin^2 = 0, and where r itself is least
        least = 0.5 * np.arctan2(f1, f0 - f2 - ll) + 0.5 * np.pi
        if least > 0.5 * np.pi:
            least -= np.pi
        found = (least, np.nan, np.nan)
        if gap >= 0.0:
            k1 = -0.5 * (f1 + np.copysign(np.sqrt(gap), f1))
            found = (least, half_turn(f0, k1), half_turn(k1, f2))
        for v in found:
            x = (v - beta[0]) / (beta[1] - beta[0])
            if 0.0 < x < 1.0:
                cuts[n] = x
                n += 1
        return n
    if f2 > 0.0:
        middle = -0.5 * f1 / f2
        if 0.0 < middle < 1.0:
            cuts[n] = middle
            n += 1
        if gap > 0.0:
            k = -0.5 * (f1 + np.copysign(np.sqrt(gap), f1))
            for x in (k / f2, f0 / k if k != 0.0 else -1.0):
                if 0.0 < x < 1.0:
                    cuts[n] = x
                    n += 1
    return n


@leaf
def half_turn(up, out):
    """Angle in [-pi/2, pi/2] of the direction (out, up) or its opposite."""
    if out < 0.0:
        up, out = -up, -out
    return np.arctan2(up, out)


@leaf
def order(cuts, n) -> None:
    """Insertion sort of the first n."""
    for i in range(1, n):
        v, j = cuts[i], i
        while j > 0 and cuts[j - 1] > v:
            cuts[j] = cuts[j - 1]
            j -= 1
        cuts[j] = v


@kernel
def flux(faces, beta, terms, waves, times, nodes, weights, out) -> None:
    """Integral of max(f, 0) over the body's surface, at every time; nodes, weights a rule on [0, 1]."""
    p, cuts, c = np.zeros(12), np.zeros(8), np.zeros(5)
    for i in range(len(times)):
        state(waves, times[i], p)
        lift = p[6] * p[3] + p[7] * p[4] + p[8] * p[5]
        total = 0.0
        for k in range(len(faces)):
            n = breaks_of(faces[k], beta[k], terms[k], p, cuts)
            order(cuts, n)
            low = 0.0
            for j in range(n + 1):
                high = cuts[j] if j < n else 1.0
                if high > low:
                    for m in range(len(nodes)):
                        circle(faces[k], beta[k], low + (high - low) * nodes[m], c)
                        size = 0.0
                        for q in range(3):
                            w = normal_speed(
                                c[1], c[0], c[2], c[3], p[6 + q] - lift * p[3 + q], 0.0, p[9 + q]
                            )
                            size += w * w
                        total += (high - low) * weights[m] * c[4] * c[0] * front(np.sqrt(size), c[3] * lift)
                low = high
        out[i] = total


@leaf
def visited(seg, ends, limits, waves, x, y, z, until, depth, patience, cells, p):
    """Whether the point was deeper than `depth` inside at some time before `until`: (yes?, given up?)."""
    given_up = False
    for piece in range(len(ends) - 1):
        i0, i1, limit = ends[piece, 2], ends[piece + 1, 2], limits[piece]
        top = 0
        cells[0, 0], cells[0, 1], cells[0, 2] = 0.0, until, 0.0
        for k in range(2):
            state(waves, k * until, p)
            d, _x, _y, _z, f = near(seg, i0, i1, p, x, y, z)
            if d <= -depth:
                return True, False
            cells[0, 3 + 2 * k], cells[0, 4 + 2 * k] = d, f
        seen = 0
        while top >= 0:
            ta, tb, last = cells[top, 0], cells[top, 1], cells[top, 2]
            pa, fa, pb, fb = cells[top, 3], cells[top, 4], cells[top, 5], cells[top, 6]
            top -= 1
            seen += 1
            w = tb - ta
            far = max(min(pa, pb), 0.0) + limit[1]
            bend = bending(limit, far, w)
            if w * (limit[2] + limit[4] * far) <= depth:
                continue
            da, db = span(pa + depth, 1.0, fa, 0.0, bend), span(pb + depth, 1.0, -fb, 0.0, bend)
            if da + db >= w:
                continue
            if seen > patience or top + 3 > len(cells):
                given_up = True
                break
            t = split_at(ta, tb, da, db, -fa, -fb, pb - pa, fa > 0.0 > fb, last)
            if not ta < t < tb:
                continue
            state(waves, t, p)
            d, _x, _y, _z, f = near(seg, i0, i1, p, x, y, z)
            if d <= -depth:
                return True, False
            for half in range(2):
                top += 1
                c = cells[top]
                c[0], c[1] = (ta, t) if half else (t, tb)
                c[2] = (c[1] - c[0]) / w
                c[3], c[4] = (pa, fa) if half else (d, f)
                c[5], c[6] = (d, f) if half else (pb, fb)
    return False, given_up


@kernel
def reentry(
    faces, beta, seg, ends, limits, waves, times, shares, which, steps, depth, patience, out, unsettled
) -> None:  # fmt: skip
    """Flux of re-entry per time and share of a face; point i lies on face which[i].

    Around each circle the front arc is cut where a point changes from new to visited: `steps` samples, then
    bisection; f has a closed integral in between. unsettled: flux of the stretches next to a point whose search was
    given up, counted as new.
    """
    p, q, c, cells = np.zeros(12), np.zeros(12), np.zeros(5), np.zeros((160, 7))
    x, y = np.zeros(3), np.zeros(3)
    for i in range(len(times)):
        state(waves, times[i], p)
        A = p[3:6].copy()
        k = 0 if abs(A[0]) < 0.9 else 1
        for j in range(3):
            x[j] = (1.0 if j == k else 0.0) - A[k] * A[j]
        x /= np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
        y[0], y[1], y[2] = A[1] * x[2] - A[2] * x[1], A[2] * x[0] - A[0] * x[2], A[0] * x[1] - A[1] * x[0]
        lift = p[6] * A[0] + p[7] * A[1] + p[8] * A[2]
        k = which[i]
        circle(faces[k], beta[k], shares[i], c)
        a, b, total = 0.0, 0.0, 0.0
        for m in range(3):
            w = normal_speed(c[1], c[0], c[2], c[3], p[6 + m], 0.0, p[9 + m])
            a, b = a + w * x[m], b + w * y[m]
        level = c[3] * lift
        r = np.sqrt(a * a + b * b)
        out[i] = unsettled[i] = 0.0
        if level <= -r or (r == 0.0 and level == 0.0):
            continue
        half = np.pi if level >= r else np.arccos(-level / r)
        heading = np.arctan2(b, a)
        known, on, u_known, start = False, False, heading - half, heading - half
        lost = False
        for m in range(steps + 1):
            # both ends graze and are in contact: step in by a hair
            u = heading - half * np.cos(np.pi * (m + 0.02) / (steps + 0.04))
            now, given_up = seen_at(
                seg, ends, limits, waves, p, c, x, y, u, times[i], depth, patience, cells, q
            )
            open_ = lost or given_up
            lost = given_up
            if m == 0:
                on, known = now, now
            elif now != known:
                lo, hi = u_known, u
                for _ in range(16):
                    mid = 0.5 * (lo + hi)
                    then, given_up = seen_at(
                        seg, ends, limits, waves, p, c, x, y, mid, times[i], depth, patience, cells, q
                    )
                    open_ = open_ or given_up
                    if then == known:
                        lo = mid
                    else:
                        hi = mid
                if on:
                    total += arc(a, b, level, start, hi)
                start, on, known = hi, now, now
            if open_:
                unsettled[i] += arc(a, b, level, u_known, u)
            u_known = u
        if lost:
            unsettled[i] += arc(a, b, level, u_known, heading + half)
        if on:
            total += arc(a, b, level, start, heading + half)
        out[i] = total * c[4] * c[0]
        unsettled[i] *= c[4] * c[0]


@leaf
def arc(a, b, c, lo, hi):
    """Integral of f from lo to hi."""
    return a * (np.sin(hi) - np.sin(lo)) - b * (np.cos(hi) - np.cos(lo)) + c * (hi - lo)


@leaf
def seen_at(seg, ends, limits, waves, p, c, x, y, u, t, depth, patience, cells, q):
    """`visited` for the point at angle u of a circle at the pose p."""
    cos, sin = np.cos(u), np.sin(u)
    v_x = p[0] + c[1] * p[3] + c[0] * (cos * x[0] + sin * y[0])
    v_y = p[1] + c[1] * p[4] + c[0] * (cos * x[1] + sin * y[1])
    v_z = p[2] + c[1] * p[5] + c[0] * (cos * x[2] + sin * y[2])
    return visited(seg, ends, limits, waves, v_x, v_y, v_z, t, depth, patience, cells, q)
