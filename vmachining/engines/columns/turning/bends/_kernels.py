# The lower surface of a ball's sweep over a cell to fourth order, and what is removed above it (L8).
#
# Legend: see ../_kernels.py. S (9,): of the surface that follows the middle's best pose: height at the middle, slopes (2), second
# derivatives uu, uv, vv; errors of its mean and of any point of it; how far other poses may lie below it.

import numpy as np

from vmachining.engines.columns.turning._kernels import (
    ACC,
    AT,
    BEND,
    HIT,
    NT,
    NU,
    NV,
    OMEGA,
    SIN,
    TIME,
    YU,
    YV,
    A,
    R,
    Z,
    state,
)
from vmachining.engines.columns.turning.triangles._kernels import UPRIGHT, du, dv
from vmachining.jit import inner, leaf

HEIGHT, GU, GV, QUU, QUV, QVV, MEAN, POINT, BELOW = range(9)
FOURTH = 0.6223  # at least the mean of |x|^4 over a square of half edge 1
THIN, WIDE = 0.05, 0.98  # of the radius: least height of the middle over an entry, largest distance in plan


@leaf
def smooth(rows, waves, i, N, lo, hi, h, P, S):
    """Whether entries of poses [lo, hi] over a cell with witnesses N (5, 12) lie on the ball of a tip: then into S.

    The height G(q) = -sqrt(r^2 - q^2) over the distance q in plan from the ball's middle is a series in q^2 with coefficients
    > 0: of its derivatives in any direction those outward at the largest q are the largest.
    """
    B, r, up = N[0], rows[i, R], rows[i, Z]
    if rows[i, A] > 0.0 or r == 0.0 or B[HIT] == 0.0:
        return False
    s = B[TIME]
    state(rows, waves, i, s, P)
    q0, q1 = B[YU] - up * P[3], B[YV] - up * P[4]
    c0, c1, c2 = P[6] + up * P[9], P[7] + up * P[10], P[8] + up * P[11]
    bow = rows[i, ACC] + up * rows[i, BEND]  # acceleration of the middle
    q, speed = np.sqrt(q0 * q0 + q1 * q1), np.sqrt(c0 * c0 + c1 * c1)
    D = np.sqrt(max(r * r - q * q, 0.0))
    if THIN * r > D:
        return False
    fu, fv = q0 / D, q1 / D
    muu, muv, mvv = (1.0 + fu * fu) / D, fu * fv / D, (1.0 + fv * fv) / D
    mus, mvs = -muu * c0 - muv * c1, -muv * c0 - mvv * c1
    mss, fs = -mus * c0 - mvs * c1, c2 - fu * c0 - fv * c1
    gu, gv = 0.0, 0.0  # the pose follows the middle's best one, where poses on both sides exist
    if mss > 0.0:
        gu, gv = -mus / mss, -mvs / mss
        if (abs(gu) + abs(gv)) * h > min(s, 1.0 - s):
            gu, gv = 0.0, 0.0
    more = (abs(gu) + abs(gv)) * h
    first, last = s - more, s + more
    first, last = min(first, lo), max(last, hi)
    for k in range(5):
        first, last = min(first, N[k, TIME]), max(last, N[k, TIME])
    span = max(s - first, last - s)
    cross = np.sqrt(2.0) * h
    stretch = np.sqrt(2.0 - 2.0 * (gu * c0 + gv * c1) + (gu * gu + gv * gv) * speed * speed)
    # of all poses [first, last] over the cell
    away = cross + speed * span + 0.5 * bow * span * span
    far = q + away
    if far >= WIDE * r:
        return False
    low = np.sqrt(r * r - far * far)
    # n.a of entries stays below that of the flank: n moves by away r / low / r
    nz = B[NU] * P[3] + B[NV] * P[4] + B[NT] * P[5]
    if nz + away / low + rows[i, OMEGA] * span >= -rows[i, SIN]:
        return False
    S[HEIGHT], S[GU], S[GV] = B[AT], fu + fs * gu, fv + fs * gv
    S[QUU] = muu + 2.0 * mus * gu + mss * gu * gu
    S[QUV] = muv + mus * gv + mvs * gu + mss * gu * gv
    S[QVV] = mvv + 2.0 * mvs * gv + mss * gv * gv
    shift = 0.5 * bow * more * more  # of the middle off its tangent, for the poses that are followed
    along = q + stretch * cross
    flat = np.sqrt(r * r - along * along) if along < far else low
    along = min(along, far)
    third = 3.0 * along * r * r / flat**5
    fourth = 3.0 * r * r * (r * r + 4.0 * along * along) / flat**7
    S[MEAN] = fourth * (stretch * h) ** 4 * FOURTH / 24.0 + shift * r / low
    S[POINT] = third * (stretch * cross) ** 3 / 6.0 + shift * r / low
    off = (abs(mus + mss * gu) + abs(mvs + mss * gv)) * h + 0.5 * third * speed * (stretch * cross) ** 2
    off += bow * more * r / low + (speed + bow * more) * r * r / low**3 * shift
    least = max(speed - bow * span, 0.0)
    _below(first, s, last, off, fs, least * least / r - bow * r / low, S)
    return True


@inner
def _below(first, s, last, off, here, convex, S):
    """How far another pose may lie below, by first and second derivatives in time."""
    if first >= s:
        fall = off - here
    elif last <= s:
        fall = off + here
    else:
        fall = off + abs(here)
    wide = last - first
    if convex > 0.0:
        S[BELOW] = min(max(fall, 0.0) ** 2 / (2.0 * convex), max(fall, 0.0) * wide)
    else:
        S[BELOW] = max(fall * wide - 0.5 * convex * wide * wide, 0.0)


@inner
def _least(d, gu, gv, h):
    """Of an affine function over the cell."""
    return d - (abs(gu) + abs(gv)) * h


@leaf
def _above(room, q, h, z, gu, gv):
    """Whether an affine function lies above where the cover of slot q begins, all over the cell."""
    for k in range(5):
        C = room.C[q, 0, k]
        if C[0] == 0.0 or z + gu * du(k, h) + gv * dv(k, h) < C[1]:
            return False
    return True


@leaf
def _reaches(room, q, h, z, gu, gv):
    """Whether the cover of slot q reaches an affine function all over the cell."""
    for k in range(5):
        C = room.C[q, 0, k]
        if C[0] == 0.0 or z + gu * du(k, h) + gv * dv(k, h) > C[2]:
            return False
    return True


@leaf
def between(rows, waves, F, roofed, room, ids, rng, dst, q, alone, u, v, h, t1, raised, slack):
    """(lo, hi) of what k takes below sweep q of the list, or below the top of the stock where q is 0 (L8).

    alone: no sweep but q is left. raised: a shared pose hides the lower end of k. (0, inf): nothing is known.
    """
    S, T, area, many = room.T[0], room.T[1], 4.0 * h * h, np.inf
    if not smooth(rows, waves, 0, room.N[0, 0], rng[dst, 0], rng[dst, 1], h, room.P[0], S):
        return 0.0, many
    # the lowest upper face of the stock over the middle
    z, gu, gv, loose = np.inf, 0.0, 0.0, 0.0
    if roofed:
        z, gu, gv, loose = room.H[3, 0], room.H[3, 1], room.H[3, 2], room.H[2, 0]
    for f in range(len(F)):
        c = (F[f, 3] - F[f, 0] * u - F[f, 1] * v) / F[f, 2]
        if F[f, 2] >= UPRIGHT and c < z:
            z, gu, gv, loose = c, -F[f, 0] / F[f, 2], -F[f, 1] / F[f, 2], 0.0
    if q > 0 and _least(room.L[q, 0, 0] - z, room.L[q, 0, 1] - gu, room.L[q, 0, 2] - gv, h) > 0.0:
        q = 0 * q
    if q > 0:
        ceiling = _reaches(room, q, h, t1, 0.0, 0.0) or _reaches(
            room, q, h, -room.L[0, 1, 0], -room.L[0, 1, 1], -room.L[0, 1, 2]
        )
        e = dst + q
        if not ceiling or not smooth(
            rows, waves, 2 * ids[e], room.N[q, 0], rng[e, 0], rng[e, 1], h, room.P[0], T
        ):
            return 0.0, many
    elif z == np.inf:
        return 0.0, many
    else:
        T[:] = 0.0
        T[HEIGHT], T[GU], T[GV] = z, gu, gv
    if q > 0:
        loose = 0.0
    gap = T[HEIGHT] - S[HEIGHT]
    uu, uv, vv = T[QUU] - S[QUU], T[QUV] - S[QUV], T[QVV] - S[QVV]
    middle = gap + (uu + vv) * h * h / 6.0
    error = T[MEAN] + S[MEAN] + slack
    lo, hi = 0.0, many
    low = (
        _least(gap, T[GU] - S[GU], T[GV] - S[GV], h)
        + 0.5 * (min(uu, 0.0) + min(vv, 0.0) - 2.0 * abs(uv)) * h * h
    )
    if low - T[POINT] - S[POINT] - T[BELOW] > 0.0:
        hi = area * (middle + error + S[BELOW])
    if not alone or raised:
        return lo, hi
    # from below: the stock begins below, ends above, and k reaches up to there
    for f in range(len(F)):
        c, p, o = F[f, 3] - F[f, 0] * u - F[f, 1] * v, F[f, 0], F[f, 1]
        if abs(F[f, 2]) < UPRIGHT:
            if _least(c, p, o, h) < 0.0:
                return lo, hi
            continue
        c, p, o = c / F[f, 2], -p / F[f, 2], -o / F[f, 2]
        if F[f, 2] < 0.0:
            if _least(room.L[0, 0, 0] - c, room.L[0, 0, 1] - p, room.L[0, 0, 2] - o, h) < 0.0:
                return lo, hi
        elif (q > 0 and not _above(room, q, h, c, p, o)) or (
            q == 0 and _least(c - z, p - gu, o - gv, h) < 0.0
        ):
            return lo, hi
    if q > 0:
        if roofed and not _above(room, q, h, room.H[3, 0] - room.H[2, 0], room.H[3, 1], room.H[3, 2]):
            return lo, hi
        for k in range(5):
            if min(room.C[0, 0, k, 0], room.C[q, 0, k, 0]) == 0.0 or room.C[0, 0, k, 2] < room.C[q, 0, k, 1]:
                return lo, hi
            loose = max(loose, room.C[q, 0, k, 1] - t1)  # above t1 others may have been dropped
    else:
        if not _reaches(room, 0, h, z, gu, gv) or t1 < z + (abs(gu) + abs(gv)) * h - slack:
            return lo, hi
        if (
            roofed
            and _least(room.H[3, 0] - room.H[2, 0] - z + loose, room.H[3, 1] - gu, room.H[3, 2] - gv, h) < 0.0
        ):
            return lo, hi
    return max(area * (middle - error - loose - T[BELOW] - slack), 0.0), hi
