# One sweep over one cell of columns that stand in any direction: witnesses, planes outside, covers inside (L1 to L5).
#
# Legend. Frame (u, v, t): columns stand along t. rows (n, 12) of sweeps, two each: 2 i as it is, 2 i + 1 mirrored at t = 0, so
# that all is written for lower ends: columns named below. waves (m, 19): motions, see sweep/rotating/pose/_kernels.py.
# P (12,): tip, axis, their rates at a time s in [0, 1]. B (12,) witness: hit?, s, height t of entry, n (3) outward, Y (3) = X -
# tip, n.V, phi, -; where the line misses, n and Y are those of its point nearest to the pose. Cell: middle (u, v), half edge h,
# nodes 0 the middle, 1 to 4 the corners, counterclockwise from the lowest.

import numpy as np

from vmachining.jit import inner, leaf
from vmachining.sweep.rotating.pose._kernels import state as pose

A, Z, R, SIN, COS, TOPR, TOPZ, OMEGA, ACC, BEND, FIRST, COUNT = range(12)
HIT, TIME, AT, NU, NV, NT, YU, YV, YT, SPEED, PHI = range(11)

FLAT = 0.15  # least |n.t| of a plane below a surface: steeper ones are laid down to it
EXACT = 1e-12  # mm, of Newton's entry
ROUNDED = 1e-10  # mm, of one in closed form
GAIN = 1e-6  # mm of height up to which a better pose is looked for: as much of the width of a bracket of 0.1 mm is 1e-5
STEPS = 100
NOWHERE = -1e6  # a height, where none is known
LESS_RANGE = 0.02  # of the time of a block: shorter rests of ranges are not looked at
HALF = np.int64(2)


@leaf
def state(rows, waves, i, s, P):
    """Tip, axis and their rates."""
    first = int(rows[i, FIRST])
    pose(waves[first : first + int(rows[i, COUNT])], s, P)


@inner
def _mirror(P, Q):
    """The same pose in the mirrored frame."""
    for k in range(12):
        Q[k] = -P[k] if k % 3 == 2 else P[k]


@inner
def _phi(rows, i, rho, z):
    """(phi, dphi/drho, dphi/dz): signed distance from below of the cutter in its meridian, convex; minus it is a depth."""
    u, w, sin, cos = rho - rows[i, A], z - rows[i, Z], rows[i, SIN], rows[i, COS]
    far, dr, dz = u * cos - w * sin, cos, -sin
    if u > 0.0 and u * sin + w * cos <= 0.0:
        far = np.sqrt(u * u + w * w)
        dr, dz = u / far, w / far
    elif -w > far:
        far, dr, dz = -w, 0.0, -1.0
    far -= rows[i, R]
    if z - rows[i, TOPZ] > far:
        return z - rows[i, TOPZ], 0.0, 1.0
    return far, dr, dz


@leaf
def depth(rows, i, P, u, v, t):
    """mm at least, by which a point lies inside of the pose; negative outside."""
    x, y, w = u - P[0], v - P[1], t - P[2]
    z = x * P[3] + y * P[4] + w * P[5]
    rho = np.sqrt(max(x * x + y * y + w * w - z * z, 0.0))
    far, _, _ = _phi(rows, i, rho, z)
    return -far


@inner
def support(rows, i, c):
    """Of the cutter in a direction with cosine c to its axis: (of the lower ring, of the rim of its top)."""
    q = np.sqrt(max(1.0 - c * c, 0.0))
    return rows[i, A] * q + rows[i, Z] * c + rows[i, R], rows[i, TOPR] * q + rows[i, TOPZ] * c


@inner
def _look(rows, i, P, x, y, w):
    """(phi, n, rho) at a point from the tip."""
    z = x * P[3] + y * P[4] + w * P[5]
    a, b, c = x - z * P[3], y - z * P[4], w - z * P[5]
    rho = np.sqrt(a * a + b * b + c * c)
    far, dr, dz = _phi(rows, i, rho, z)
    g = dr / rho if rho > 0.0 else 0.0
    return far, g * a + dz * P[3], g * b + dz * P[4], g * c + dz * P[5]


@inner
def _closed(rows, i, P, x, y, low):
    """Height from the tip, above `low`, below which a line is outside for sure but for rounding: where it enters the half space
    above the bottom and the cone of the flank; or where it enters the ball of a tip."""
    sin, cos, r, up = rows[i, SIN], rows[i, COS], rows[i, R], rows[i, Z]
    z, w = x * P[3] + y * P[4], low
    if rows[i, A] == 0.0:
        a, b = x - up * P[3], y - up * P[4]
        q = r * r - a * a - b * b
        if q > 0.0:
            w = up * P[5] - np.sqrt(q)
            if z + w * P[5] - up <= -r * sin:
                return w
    w = low
    if P[5] > 1e-3:
        w = max(w, (up - r - z) / P[5])
    # rho = ring + grow * height
    grow = sin / cos
    ring, wide = rows[i, A] + r / cos - up * grow, 1.0 + grow * grow
    a, b = 1.0 - wide * P[5] * P[5], -P[5] * (wide * z + ring * grow)
    if a > 1e-6:
        c = x * x + y * y - wide * z * z - ring * (2.0 * grow * z + ring)
        gap = b * b - a * c
        if gap > 0.0:
            q = -(b + np.copysign(np.sqrt(gap), b))
            root = min(q / a, c / q) if q != 0.0 else 0.0
            if ring + grow * (z + root * P[5]) > 0.0:
                w = max(w, root)
    return w


@leaf
def enter(rows, i, P, u, v, B):
    """Witness of the line over (u, v) in a pose. Newton on a convex function from outside: it never passes the entry."""
    return _enter(rows, i, P, u, v, NOWHERE, B)


@leaf
def _enter(rows, i, P, u, v, guess, B):
    """The same, from a height near the entry if one is known: where that lies inside, a first step leads outside."""
    x, y = u - P[0], v - P[1]
    low, top = support(rows, i, -P[5])
    low = -max(low, top) - 1e-3
    a, b = support(rows, i, P[5])
    high = max(a, b) + 1e-3
    w, last, hit, known = guess - P[2], low, False, False
    if guess > NOWHERE and rows[i, A] > 0.0 and rows[i, R] > 0.0:  # others are entered in closed form
        far, n0, n1, n2 = _look(rows, i, P, x, y, w)
        if far < 0.0 and n2 < -1e-3:
            w -= far / n2
            far, n0, n1, n2 = _look(rows, i, P, x, y, w)
        known = n2 < 0.0 and far >= -EXACT
    if not known:
        w = _closed(rows, i, P, x, y, low)
        far, n0, n1, n2 = _look(rows, i, P, x, y, w)
        if far < -ROUNDED:
            w = low
            far, n0, n1, n2 = _look(rows, i, P, x, y, w)
    for _ in range(STEPS):
        if far <= EXACT:
            hit = True
            break
        if n2 >= 0.0:
            break
        last, w = w, w - far / n2
        if w >= high:
            w = high
            far, n0, n1, n2 = _look(rows, i, P, x, y, w)
            break
        far, n0, n1, n2 = _look(rows, i, P, x, y, w)
    if not hit:  # the nearest point lies between the last two
        a, b = last, w
        for _ in range(60):
            w = 0.5 * (a + b)
            far, n0, n1, n2 = _look(rows, i, P, x, y, w)
            if far <= EXACT:  # it is hit after all, within rounding: of no use as a witness
                break
            if n2 < 0.0:
                a = w
            else:
                b = w
            if b - a <= 1e-9:
                break
    B[HIT], B[AT], B[PHI] = (1.0 if hit else 0.0), w + P[2], far
    B[NU], B[NV], B[NT], B[YU], B[YV], B[YT] = n0, n1, n2, x, y, w
    B[SPEED] = (
        n0 * P[6] + n1 * P[7] + n2 * P[8]
        + (n0 * P[9] + n1 * P[10] + n2 * P[11]) * (P[3] * x + P[4] * y + P[5] * w)
        - (n0 * P[3] + n1 * P[4] + n2 * P[5]) * (P[9] * x + P[10] * y + P[11] * w)
    )  # fmt: skip
    return hit


@leaf
def _at(rows, waves, i, s, u, v, guess, P, B):
    state(rows, waves, i, s, P)
    _enter(rows, i, P, u, v, guess, B)
    B[TIME] = s


@inner
def _better(a_hit, a_at, a_phi, b_hit, b_at, b_phi):
    if a_hit != b_hit:
        return a_hit > b_hit
    return a_at < b_at if a_hit > 0.0 else a_phi < b_phi


@leaf
def best(rows, waves, i, u, v, lo, hi, P, B):
    """Witness of the pose between lo and hi that a line enters first, as far as it is found: no proof needs the best."""
    if rows[i, OMEGA] == 0.0 and rows[i, ACC] == 0.0 and hi == lo:
        _at(rows, waves, i, lo, u, v, NOWHERE, P, B)
        return
    _at(rows, waves, i, lo, u, v, NOWHERE, P, B)
    wa, hit, at, phi, s = B[SPEED], B[HIT], B[AT], B[PHI], lo
    _at(rows, waves, i, hi, u, v, B[AT] if B[HIT] > 0.0 else NOWHERE, P, B)
    wb = B[SPEED]
    if _better(B[HIT], B[AT], B[PHI], hit, at, phi):
        hit, at, phi, s = B[HIT], B[AT], B[PHI], hi
    a, b = lo, hi
    if wa > 0.0 > wb:
        side = 0
        for _ in range(12):
            m = (a * wb - b * wa) / (wb - wa) if wb != wa else 0.5 * (a + b)
            if not a < m < b:
                m = 0.5 * (a + b)
            _at(rows, waves, i, m, u, v, at if hit > 0.0 else NOWHERE, P, B)
            w = B[SPEED]
            if _better(B[HIT], B[AT], B[PHI], hit, at, phi):
                hit, at, phi, s = B[HIT], B[AT], B[PHI], m
            if abs(w) * (b - a) <= GAIN * max(abs(B[NT]), 0.1):
                break
            if w > 0.0:
                a, wa = m, w
                if side == 1:
                    wb *= 0.5
                side = 1
            else:
                b, wb = m, w
                if side == -1:
                    wa *= 0.5
                side = -1
    if B[TIME] != s:
        _at(rows, waves, i, s, u, v, at if hit > 0.0 else NOWHERE, P, B)


@inner
def _spread(rows, i, P, s, lo, hi, n0, n1, n2, x, y, w, slab, h, ht, gu, gv):
    """L2: mm along n by which poses of [lo, hi] may reach beyond E, over a cell (or in a prism); inf where it fails.

    (x, y, w): X_0 from the tip. gu, gv: slope of E. slab: over the cell times +- ht, with X_0 its middle.
    """
    rate, A0, A1 = rows[i, OMEGA], rows[i, ACC], rows[i, BEND]
    far = max(hi - s, s - lo)
    if far <= 0.0:
        return 0.0
    ox = P[4] * P[11] - P[5] * P[10]
    oy = P[5] * P[9] - P[3] * P[11]
    oz = P[3] * P[10] - P[4] * P[9]
    V0, V1, V2 = P[6] + oy * w - oz * y, P[7] + oz * x - ox * w, P[8] + ox * y - oy * x
    q0, q1, q2 = n1 * oz - n2 * oy, n2 * ox - n0 * oz, n0 * oy - n1 * ox
    q = np.sqrt(q0 * q0 + q1 * q1 + q2 * q2)
    speed, across, along = (
        np.sqrt(V0 * V0 + V1 * V1 + V2 * V2),
        V0 * q0 + V1 * q1 + V2 * q2,
        n0 * V0 + n1 * V1 + n2 * V2,
    )
    rest = 1.0 - rate * far - 0.5 * A1 * far * far
    if rest < 0.2:
        return np.inf
    if slab:
        c1 = (abs(q0) + abs(q1)) * h + abs(q2) * ht
        size = np.sqrt(2.0 * h * h + ht * ht)
    else:
        a, b = q0 + q2 * gu, q1 + q2 * gv
        c1 = (abs(a) + abs(b)) * h
        size = h * np.sqrt(2.0 + (abs(gu) + abs(gv)) ** 2)
    from_tip = np.sqrt(x * x + y * y + w * w)
    xi = (size + far * speed + 0.5 * (A0 + A1 * from_tip) * far * far) / rest
    Ac = A0 + A1 * (from_tip + xi)
    linear = c1 + far * abs(across) + q * rate * far * xi + 0.5 * q * Ac * far * far
    slope = abs(q2) + q * (rate * far + 0.5 * A1 * far * far) / rest
    worst = 0.0
    for D in (lo - s, hi - s):
        d = abs(D)
        Ec = max(along * D + d * linear + 0.5 * Ac * d * d, 0.0)
        if slab:
            worst = max(worst, Ec)
            continue
        Et = d * slope + 0.5 * A1 * d * d / rest
        if d > 0.0 and Et >= 0.7 * abs(
            n2
        ):  # asked of poses that recede, too: it is what bounds how far below they may be
            return np.inf
        worst = max(worst, Ec / (1.0 - Et / abs(n2)))
    return worst


@leaf
def _rise(rows, waves, i, P, s, lo, hi, n0, n1, n2, P2):
    """L3: the same for all poses and points, by the support function; P2 room."""
    rate, A0, A1 = rows[i, OMEGA], rows[i, ACC], rows[i, BEND]
    far = max(hi - s, s - lo)
    if far <= 0.0:
        return 0.0
    c = n0 * P[3] + n1 * P[4] + n2 * P[5]
    low, top = support(rows, i, c)
    if top + rate * far * (abs(rows[i, TOPZ] - rows[i, Z]) + abs(rows[i, TOPR] - rows[i, A])) > low:
        return np.inf
    B = A0 + abs(rows[i, Z]) * A1
    if rows[i, A] > 0.0:
        q = np.sqrt(max(1.0 - c * c, 0.0)) - rate * far
        if q <= 0.0:
            if rate > 0.0 or A1 > 0.0:
                return np.inf
        else:
            B += 2.0 * rows[i, A] * A1 / q
    here = n0 * P[0] + n1 * P[1] + n2 * P[2] + low
    worst = 0.0
    for end in (lo, hi):
        state(rows, waves, i, end, P2)
        a, _ = support(rows, i, n0 * P2[3] + n1 * P2[4] + n2 * P2[5])
        there = n0 * P2[0] + n1 * P2[1] + n2 * P2[2] + a
        worst = max(worst, max(there - here, 0.0) + 0.125 * B * (end - s) ** 2)
    return worst


@leaf
def plane(rows, waves, i, B, lo, hi, u, v, h, slack, P, P2, out, o):
    """A plane below all entries of poses [lo, hi] over the cell (L2, L3), touching the pose of a witness: height at the
    middle and slopes into out[o:o + 3]. False: none is known."""
    s = B[TIME]
    state(rows, waves, i, s, P)
    n0, n1, n2 = B[NU], B[NV], B[NT]
    if n2 > -FLAT:
        m = np.sqrt(n0 * n0 + n1 * n1)
        if m < 1e-9:
            return False
        m = np.sqrt(1.0 - FLAT * FLAT) / m
        n0, n1, n2 = n0 * m, n1 * m, -FLAT
    m = 1.0 / np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    n0, n1, n2 = n0 * m, n1 * m, n2 * m
    low, top = support(rows, i, n0 * P[3] + n1 * P[4] + n2 * P[5])
    reach = max(low, top)
    x, y = u - P[0], v - P[1]
    w = (reach - n0 * x - n1 * y) / n2
    gu, gv = -n0 / n2, -n1 / n2
    more = _rise(rows, waves, i, P, s, lo, hi, n0, n1, n2, P2)
    if more > 1e-7:
        more = min(more, _spread(rows, i, P, s, lo, hi, n0, n1, n2, x, y, w, False, h, 0.0, gu, gv))
    if not more < np.inf:
        return False
    out[o], out[o + 1], out[o + 2] = w + P[2] + (more + slack) / n2, gu, gv
    return True


@leaf
def beyond(rows, waves, i, B, lo, hi, u, v, h, t0, t1, slack, P, P2, out, o):
    """Half plane m.(x - middle) <= c over which alone the sweep can have points between t0 and t1: (m, c) into out.

    By the normal of a witness beside the sweep; L3, or the slab form of L2. False: none is known.
    """
    s = B[TIME]
    state(rows, waves, i, s, P)
    n0, n1, n2 = B[NU], B[NV], B[NT]
    m = np.sqrt(n0 * n0 + n1 * n1 + n2 * n2)
    if m < 0.5 or abs(n2) > 0.9 * m:
        return False
    n0, n1, n2 = n0 / m, n1 / m, n2 / m
    low, top = support(rows, i, n0 * P[3] + n1 * P[4] + n2 * P[5])
    more = _rise(rows, waves, i, P, s, lo, hi, n0, n1, n2, P2)
    x, y, w, ht = u - P[0], v - P[1], 0.5 * (t0 + t1) - P[2], 0.5 * (t1 - t0)
    if more > 1e-7:
        more = min(more, _spread(rows, i, P, s, lo, hi, n0, n1, n2, x, y, w, True, h, ht, 0.0, 0.0))
    if not more < np.inf:
        return False
    out[o], out[o + 1] = n0, n1
    out[o + 2] = max(low, top) + more + slack - n0 * x - n1 * y - n2 * w + abs(n2) * ht
    return True


@leaf
def _lift(rows, i, P, u, v, t, way, least, cap, steep):
    """mm from t along way * t-axis to a point `least` deep in the pose (depth is concave on a line), or -1."""
    tau = 2.0 * least / max(steep, 1e-3)
    for _ in range(6):
        if tau > 4.0 * cap:
            return -1.0
        d = depth(rows, i, P, u, v, t + way * tau)
        if d >= least:
            lift = tau * least / d if d > 1.0001 * least else tau
            if depth(rows, i, P, u, v, t + way * lift) < least:  # rounding
                lift = tau
            return lift if lift <= cap else -1.0
        tau *= 4.0
    return -1.0


@leaf
def cover(rows, waves, i, mirrored, N, u, v, h, cap_t, slack, P, B, out):
    """L1 for the witnesses N (5, 12) of a cell: heights between which all is in the sweep, into out (5, 3) = known?, from, to.

    Affine over each of the four triangles of middle and corners. Above cap_t nobody asks. P (6, 12).
    """
    m = rows[i, OMEGA], rows[i, ACC], rows[i, BEND]
    lo, hi, hits = np.inf, -np.inf, 0
    for k in range(5):
        out[k, 0] = N[k, HIT]
        if N[k, HIT] > 0.0:
            lo, hi, hits = min(lo, N[k, TIME]), max(hi, N[k, TIME]), hits + 1
    if hits < 3 or out[0, 0] == 0.0:
        for k in range(5):
            out[k, 0] = 0.0
        return False
    span = hi - lo
    for k in range(5):
        state(rows, waves, i, N[k, TIME], P[k])
    for upper in range(2):
        b0, b1, b2, e0, e1, e2, far = np.inf, np.inf, np.inf, -np.inf, -np.inf, -np.inf, 0.0
        for k in range(5):
            if out[k, 0] == 0.0:
                continue
            y0, y1, y2 = N[k, YU], N[k, YV], N[k, YT]
            if upper:
                tip = N[k, AT] - N[k, YT]
                cx, cy = (
                    u + (0.0 if k == 0 else (h if k == 2 or k == 3 else -h)),
                    v + (0.0 if k == 0 else (h if k > 2 else -h)),
                )
                t = cap_t
                if t <= N[k, AT] or depth(rows, i, P[k], cx, cy, t) <= 0.0:
                    _mirror(P[k], P[5])  # the exit is the entry of the mirrored pose
                    if not enter(rows, mirrored, P[5], cx, cy, B):
                        out[k, 0] = 0.0
                        continue
                    t = -B[AT]
                    out[k, 2] = max(abs(B[NT]), 1e-3)
                else:
                    out[k, 2] = 1.0
                y2 = t - tip
                # kept until depths are known: the height itself, the slope in out[k, 2] is asked below
                N[k, 11] = t
            b0, b1, b2 = min(b0, y0), min(b1, y1), min(b2, y2)
            e0, e1, e2 = max(e0, y0), max(e1, y1), max(e2, y2)
            far = max(far, y0 * y0 + y1 * y1 + y2 * y2)
        size, far = np.sqrt((e0 - b0) ** 2 + (e1 - b1) ** 2 + (e2 - b2) ** 2), np.sqrt(far)
        cap = 0.25 * size + 1e-6
        least = 2.0 * slack
        if span > 0.0:
            D = size + 2.0 * cap + m[0] * span * (far + cap)
            least += 0.25 * m[0] * span * D + 0.125 * (m[1] + m[2] * (far + cap)) * span * span
        for k in range(5):
            if out[k, 0] == 0.0:
                continue
            cx, cy = (
                u + (0.0 if k == 0 else (h if k == 2 or k == 3 else -h)),
                v + (0.0 if k == 0 else (h if k > 2 else -h)),
            )
            if upper:
                t = N[k, 11]
                lift = 0.0
                if depth(rows, i, P[k], cx, cy, t) < least:
                    lift = _lift(rows, i, P[k], cx, cy, t, -1.0, least, cap, out[k, 2])
                out[k, 2] = t - lift
                if out[k, 2] < out[k, 1]:
                    out[k, 0] = 0.0
            else:
                lift = _lift(rows, i, P[k], cx, cy, N[k, AT], 1.0, least, cap, abs(N[k, NT]))
                out[k, 1] = N[k, AT] + lift
            if lift < 0.0:
                out[k, 0] = 0.0
    return out[0, 0] > 0.0
