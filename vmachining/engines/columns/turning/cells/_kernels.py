# A cell of columns in any direction: what is known of each sweep over it, and what the block removes there.
#
# Legend: see ../_kernels.py. Slot 0 is sweep k, slot q of a list has rows 2 ids[q], 2 ids[q] + 1. rng (10,) of an entry: poses
# that matter, of lower and of upper ends, then planes below either in the cell that kept it. reach (n, 26): no point of a sweep
# lies farther along WAYS, and against them. F (faces, 4): a.X <= c of the stock. Affine functions: value at the middle of the
# cell, slopes.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.engines.columns.roof._kernels import OUTSIDE, over_cell
from vmachining.engines.columns.turning._kernels import (
    HIT,
    LESS_RANGE,
    NOWHERE,
    PHI,
    TIME,
    best,
    beyond,
    cover,
    enter,
    plane,
    state,
)
from vmachining.engines.columns.turning.bends._kernels import between
from vmachining.engines.columns.turning.starts._kernels import least_exit, starts_first
from vmachining.engines.columns.turning.triangles._kernels import (
    COVERS,
    KEPT,
    SLOTS,
    UPRIGHT,
    ZERO,
    du,
    dv,
    triangle,
)
from vmachining.jit import leaf

TRIES = 2
SURE = 1e-3  # relative width of what smooth surfaces say up to which triangles are not asked
LEVELS = 1 << 18  # divisions of half a first cell that tell nodes apart
MIX = np.int64(-7046029254386353131)  # 2^64 / golden ratio
FEW = 4.0  # sweeps that are looked at in a first cell; twice as many in its parts, and so on
WAYS = np.array(
    [(1, 0, 0), (0, 1, 0), (1, 1, 0), (1, -1, 0)] + [(x, y, 1) for x in (-1, 0, 1) for y in (-1, 0, 1)],
    dtype=float,
)
WAYS /= np.sqrt((WAYS**2).sum(axis=1))[:, None]
STARTS, RANGES, BENDS = np.int64(2), np.int64(4), np.int64(8)  # bits of rules besides COVERS: L5, L4, L8


@leaf
def _witness(rows, waves, i, u, v, h, lo, hi, room, N):
    """The best witness at a node of a cell, kept for its other cells: what a wider range of poses found is one, too."""
    H, key = room.H[1], np.int64(-1)
    if h * LEVELS > H[2]:
        a, b = np.int64(np.rint((u - H[0]) / H[2] * LEVELS)), np.int64(np.rint((v - H[1]) / H[2] * LEVELS))
        key = (np.int64(i) << 48) + (a << 24) + b
        place = ((key * MIX) >> 40) & (KEPT - 1)
        if room.K[place] == key:
            for c in range(12):
                N[c] = room.W[place, c]
            return
    best(rows, waves, i, u, v, lo, hi, room.P[0], N)
    if key >= 0:
        room.K[place] = key
        for c in range(12):
            room.W[place, c] = N[c]


@leaf
def _outer(rows, waves, i, room, q, side, rng, at, u, v, h, slack):
    N, L, P = room.N[q, side, 0], room.L[q, side], room.P
    if not plane(rows, waves, i, N, rng[at], rng[at + 1], u, v, h, slack, P[0], P[1], L, 0):
        L[0], L[1], L[2] = NOWHERE, 0.0, 0.0


@leaf
def _lowest(L, h):
    """Least value of a plane over the cell."""
    return L[0] - (abs(L[1]) + abs(L[2])) * h


@leaf
def _misses(rows, waves, i, room, q, side, rng, e, u, v, h, t0, t1, slack):
    """Middle witness and plane of one side; True: the sweep has no point over the cell between t0 and t1."""
    N, at = room.N[q, side, 0], 2 * side
    _witness(rows, waves, i, u, v, h, rng[e, at], rng[e, at + 1], room, N)
    if N[HIT] == 0.0:
        a, b = (t0, t1) if side == 0 else (-t1, -t0)
        P, m = room.P, room.H[5]
        known = beyond(rows, waves, i, N, 0.0, 1.0, u, v, h, a, b, slack, P[0], P[1], m, 0)
        if known and m[2] < -(abs(m[0]) + abs(m[1])) * h:
            return True
    _outer(rows, waves, i, room, q, side, rng[e], at, u, v, h, slack)
    return False


@leaf
def _known(room, q, side, way):
    """Nothing but a plane is known of one side of a sweep; its corners count as hit where `way` is 1."""
    for k in range(5):
        room.C[q, side, k, 0], room.N[q, side, k, HIT] = 0.0, way


@leaf
def _look(rows, waves, j, room, q, rng, e, u, v, h, t0, t1, slack, rules):
    """All that is known of an earlier sweep into slot q; False: it has no point over the cell between t0 and t1.

    Where it reaches from its lower end through all that is asked, nobody asks for its upper end.
    """
    if (
        _misses(rows, waves, 2 * j, room, q, 0, rng, e, u, v, h, t0, t1, slack)
        or _lowest(room.L[q, 0], h) >= t1
    ):
        return False
    if room.N[q, 0, 0, HIT] > 0.0 and _covered(
        room, q, 0, rows, waves, j, rng, e, u, v, h, t0, t1, slack, rules
    ):
        _known(room, q, 1, 1.0)
        room.L[q, 1, 0], room.L[q, 1, 1], room.L[q, 1, 2] = NOWHERE, 0.0, 0.0
        return True
    if (
        _misses(rows, waves, 2 * j + 1, room, q, 1, rng, e, u, v, h, t0, t1, slack)
        or -_lowest(room.L[q, 1], h) <= t0
    ):
        return False
    if room.N[q, 0, 0, HIT] == 0.0:
        _known(room, q, 0, 0.0)
    if room.N[q, 1, 0, HIT] == 0.0:
        _known(room, q, 1, 0.0)
    else:
        _covered(room, q, 1, rows, waves, j, rng, e, u, v, h, t0, t1, slack, rules)
    return True


@leaf
def _apart(reach, j, u, v, h, t0, t1):
    """Heights at the middle, and all over the cell, below which a sweep has no point, by tangent planes of 13 pairs; inf: it has
    none over the cell between t0 and t1."""
    least, floor, t, ht = -np.inf, -np.inf, 0.5 * (t0 + t1), 0.5 * (t1 - t0)
    for d in range(len(WAYS)):
        x, y, z = WAYS[d, 0], WAYS[d, 1], WAYS[d, 2]
        at, more = x * u + y * v, (abs(x) + abs(y)) * h + abs(z) * ht
        if at + z * t - more > reach[j, d] or -at - z * t - more > reach[j, d + len(WAYS)]:
            return np.inf, np.inf
        if z > 0.0:
            f = (-at - reach[j, d + len(WAYS)]) / z
            least, floor = max(least, f), max(floor, f - (abs(x) + abs(y)) * h / z)
    return least, floor


@leaf
def _covered(room, q, side, rows, waves, j, rng, e, u, v, h, t0, t1, slack, rules):
    """Corner witnesses, cover and the range of poses that matter (L4) of one side; the plane anew where the range shrank.

    True: all that lies above the cover's lower end and below t1 (or t0, mirrored) is in the cover.
    """
    i, N, C = 2 * j + side, room.N[q, side], room.C[q, side]
    end = t1 if side == 0 else -t0
    cap_t = end + 0.1 * (t1 - t0)
    lo, hi = rng[e, 2 * side], rng[e, 2 * side + 1]
    for k in range(1, 5):
        _witness(rows, waves, i, u + du(k, h), v + dv(k, h), h, lo, hi, room, N[k])
    cover(rows, waves, i, 2 * j + 1 - side, N, u, v, h, cap_t, slack, room.P[2:], room.B, C)
    whole = True
    for k in range(5):
        whole = whole and C[k, 0] > 0.0 and C[k, 2] >= end
    if rules & RANGES == 0:
        return whole
    a, b = np.inf, -np.inf
    for k in range(5):
        if C[k, 0] == 0.0:
            return whole
        a, b = min(a, N[k, TIME]), max(b, N[k, TIME])
    more = max(0.5 * (b - a), LESS_RANGE)
    shrunk = False
    for last in range(2):
        rest = a - lo if last == 0 else hi - b
        if rest <= 2.0 * more:
            continue
        away = more
        for _ in range(TRIES):
            s = a - away if last == 0 else b + away
            state(rows, waves, i, s, room.P[0])
            enter(rows, i, room.P[0], u, v, room.B)
            room.B[TIME] = s
            begin, stop = (lo, s) if last == 0 else (s, hi)
            if plane(rows, waves, i, room.B, begin, stop, u, v, h, slack, room.P[0], room.P[1], room.H[5], 0):
                above = True
                for k in range(5):
                    above = (
                        above and room.H[5, 0] + room.H[5, 1] * du(k, h) + room.H[5, 2] * dv(k, h) > C[k, 1]
                    )
                if above:
                    if last == 0:
                        lo = s
                    else:
                        hi = s
                    shrunk = True
                    break
            away = 0.5 * (away + rest)
    if shrunk:
        rng[e, 2 * side], rng[e, 2 * side + 1] = lo, hi
        _outer(rows, waves, i, room, q, side, rng[e], 2 * side, u, v, h, slack)
    return whole


@leaf
def _begins(room, q, t1):
    """Height above which everything up to t1 is in the cover of slot q, over the whole cell; inf: it has no such cover."""
    top = -np.inf
    for k in range(5):
        c = room.C[q, 0, k]
        if c[0] == 0.0 or c[2] < t1:
            return np.inf
        top = max(top, c[1])
    return top


@leaf
def _hides(room, a, b, h, t0, t1):
    """Whether what sweep b may have over the cell between t0 and t1 lies in sweep a for sure."""
    one = True  # both covers of a overlap, and that of the upper ends reaches higher
    for k in range(5):
        F, S = room.C[a, 0, k], room.C[a, 1, k]
        one = one and F[0] > 0.0 and S[0] > 0.0 and -S[2] <= F[2] <= -S[1]
    for way in range(2):
        here, low_a, high_a, low_b, high_b = True, True, True, True, True
        for k in range(5):
            c = room.C[a, way, k]
            if c[0] == 0.0:
                here = False
                break
            low, high = (c[1], c[2]) if way == 0 else (-c[2], -c[1])
            if one and way == 0:
                high = -room.C[a, 1, k, 1]
            x, y = du(k, h), dv(k, h)
            f = room.L[b, 0, 0] + room.L[b, 0, 1] * x + room.L[b, 0, 2] * y
            g = -(room.L[b, 1, 0] + room.L[b, 1, 1] * x + room.L[b, 1, 2] * y)
            low_a, low_b = low_a and low <= t0, low_b and low <= f
            high_a, high_b = high_a and high >= t1, high_b and high >= g
        if here and (low_a or low_b) and (high_a or high_b):
            return True
    return False


@leaf
def keep(ids, rng, src, dst):
    """One entry of a list in another place."""
    ids[dst] = ids[src]
    for c in range(10):
        rng[dst, c] = rng[src, c]


class Lists(NamedTuple):
    """ids and rng of all lists, reach (n, 26): see above. at (2,): middle of the cell that kept a list. queue, keys: an order;
    floors: heights below which none of an entry lies."""

    ids: NDArray[np.int64]
    rng: NDArray[np.float64]
    reach: NDArray[np.float64]
    at: NDArray[np.float64]
    queue: NDArray[np.int64]
    keys: NDArray[np.float64]
    floors: NDArray[np.float64]


@leaf
def bounds(rows, waves, lists, F, roof, starts, rules, room, u, v, h, heights, src, count, dst, slack, out):
    """(lo, hi, entries left) of one cell. Its list is src:src + count; those left go to dst, where k comes first.

    heights: (3,) between which all of it lies, and whether k may begin below the lower one; narrowed into out (3,).
    starts: (2,) whether the first and the last pose of k are those of another sweep.
    """
    ids, rng, queue, keys, floors = lists.ids, lists.rng, lists.queue, lists.keys, lists.floors
    t0, t1, raised = heights[0], heights[1], heights[2]
    for f in range(len(F)):
        c, more = F[f, 3] - F[f, 0] * u - F[f, 1] * v, (abs(F[f, 0]) + abs(F[f, 1])) * h
        if abs(F[f, 2]) < UPRIGHT:
            if c < -more:
                return 0.0, 0.0, ZERO
        elif F[f, 2] > 0.0:
            t1 = min(t1, (c + more) / F[f, 2])
        else:
            t0 = max(t0, (c + more) / F[f, 2])
    if len(roof.plane) > 0:
        state, up, down, gx, gy, _ = over_cell(roof, u, v, h, h, 0.0)
        if state == OUTSIDE:
            up, down = -NOWHERE, NOWHERE
        room.H[3, 0], room.H[3, 1], room.H[3, 2], room.H[2, 0] = up + slack, gx, gy, up - down + 2.0 * slack
        t1 = min(t1, up + slack + (abs(gx) + abs(gy)) * h)
    if t0 >= t1:
        return 0.0, 0.0, ZERO
    keep(ids, rng, src, dst)
    for side in range(2):
        if _misses(rows, waves, side, room, 0, side, rng, dst, u, v, h, t0, t1, slack):
            return 0.0, 0.0, ZERO
    low = _lowest(room.L[0, 0], h)
    if low >= t0:
        t0, raised = low, 0.0
    t1 = min(t1, -_lowest(room.L[0, 1], h))
    if rules & STARTS != 0:
        for e in range(2):
            if starts[e] == 0 or t0 >= t1:
                continue
            if starts_first(rows, waves, 0, float(e), u, v, h, room.P[0], room.B):
                place = least_exit(rows, waves, 0, float(e), u, v, h, slack, room.P[0], room.B)
                if place > t0:
                    t0, raised = place, 1.0
            if t0 < t1 and starts_first(rows, waves, 1, float(e), u, v, h, room.P[0], room.B):
                t1 = min(t1, -least_exit(rows, waves, 1, float(e), u, v, h, slack, room.P[0], room.B))
    if t0 >= t1:
        return 0.0, 0.0, ZERO
    # those that may have points here, by planes of the cell that this one is a part of
    some, x, y = ZERO, u - lists.at[0], v - lists.at[1]
    for e in range(src + 1, src + count):
        key, floor = _apart(lists.reach, ids[e], u, v, h, t0, t1)
        f = rng[e, 4] + rng[e, 5] * x + rng[e, 6] * y
        g = rng[e, 7] + rng[e, 8] * x + rng[e, 9] * y
        floor = max(floor, f - (abs(rng[e, 5]) + abs(rng[e, 6])) * h)
        if key == np.inf or floor >= t1 or (abs(rng[e, 8]) + abs(rng[e, 9])) * h - g <= t0:
            continue
        queue[some], keys[some], floors[some] = e, max(key, f), floor
        some += 1
    # the lowest first, as it hides the most; few in large cells, of which no bracket is narrow
    m, seen, most = ZERO + 1, ZERO, min(float(SLOTS), FEW * room.H[1, 2] / h)
    while seen < some and m < most:
        pick = seen
        for c in range(seen + 1, some):
            if keys[c] < keys[pick]:
                pick = np.int64(c)
        e = queue[pick]
        queue[pick], keys[pick], floors[pick] = queue[seen], keys[seen], floors[seen]
        queue[seen] = e
        seen += 1
        for side in range(2):
            c = 4 + 3 * side
            room.L[m, side, 0] = rng[e, c] + rng[e, c + 1] * x + rng[e, c + 2] * y
            room.L[m, side, 1], room.L[m, side, 2] = rng[e, c + 1], rng[e, c + 2]
        hidden = False
        for p in range(1, m):
            if rules & COVERS != 0 and _hides(room, p, m, h, t0, t1):
                hidden = True
                break
        if hidden:
            continue
        keep(ids, rng, e, dst + m)
        if not _look(rows, waves, ids[e], room, m, rng, dst + m, u, v, h, t0, t1, slack, rules):
            continue
        if rules & COVERS != 0 and _hides(room, m, 0, h, t0, t1):
            return 0.0, 0.0, ZERO
        room.D[m] = 0
        top = _begins(room, m, t1) if rules & COVERS != 0 else np.inf
        m += 1
        if top < t1:  # it hides all that begin above
            last, some = some, seen
            for c in range(seen, last):
                if floors[c] < top:
                    queue[some], keys[some], floors[some] = queue[c], keys[c], floors[c]
                    some += 1
    if _covered(room, 0, 0, rows, waves, ZERO, rng, dst, u, v, h, t0, t1, slack, rules):
        _known(room, 0, 1, 1.0)
    else:
        _covered(room, 0, 1, rows, waves, ZERO, rng, dst, u, v, h, t0, t1, slack, rules)
    if rules & COVERS != 0:
        for q in range(1, m):
            if _hides(room, q, 0, h, t0, t1):
                return 0.0, 0.0, ZERO
            for p in range(1, m):
                if p != q and room.D[p] == 0 and _hides(room, p, q, h, t0, t1):
                    room.D[q] = 1
                    break
    # a border of k: no points of it beyond one half plane
    border = False
    worst = 0.0
    for side in range(2):
        for k in range(1, 5):
            B = room.N[0, side, k]
            if B[HIT] == 0.0 and B[PHI] > worst:
                a, b = (t0, t1) if side == 0 else (-t1, -t0)
                if beyond(
                    rows, waves, side, B, 0.0, 1.0, u, v, h, a, b, slack, room.P[0], room.P[1], room.H[4], 0
                ):
                    worst, border = B[PHI], True
    lo, hi = 0.0, np.inf
    if rules & BENDS != 0:
        one, others = ZERO, ZERO
        for q in range(1, m):
            if room.D[q] == 0:
                one, others = np.int64(q), others + 1
        if others <= 1:
            lo, hi = between(
                rows, waves, F, len(roof.plane) > 0, room, ids, rng, dst, one, seen == some, u, v, h, t1, raised > 0.0, slack
            )  # fmt: skip
    if hi - lo > SURE * hi or hi == np.inf:
        low, high = 0.0, 0.0
        for tri in range(4):
            a, b = triangle(room, F, len(roof.plane) > 0, tri, m, u, v, h, t0, t1, border, rules)
            low, high = low + a, high + b
        lo, hi = max(lo, low), min(hi, high)
    left = ZERO + 1
    for q in range(1, m):
        if room.D[q] == 0:
            keep(ids, rng, dst + q, dst + left)
            for side in range(2):
                for c in range(3):
                    rng[dst + left, 4 + 3 * side + c] = room.L[q, side, c]
            left += 1
    for c in range(seen, some):
        lo, e = 0.0, queue[c]
        keep(ids, rng, e, dst + left)
        for side in range(2):
            at = 4 + 3 * side
            rng[dst + left, at] += rng[e, at + 1] * x + rng[e, at + 2] * y
        left += 1
    out[0], out[1], out[2] = t0, t1, raised
    return min(lo, hi), hi, left
