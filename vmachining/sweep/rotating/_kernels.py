# Rays and distances of a convex body of revolution that moves and turns, by cover of the time interval.
#
# Legend: see pose/_kernels.py. D mm by which an end lies inside what is already known.
# s ray parameter, mm; t time in [0, 1].
#
# In the frame of the body at t0 a fixed point x runs as y(t) = x - (t - t0) V(x) + R, |R| <= bend (t - t0)^2 / 2.
# The body lies below each of its tangent planes, so x in K(t) needs phi0 + N.(x - x0) - (t - t0) N.V(x) <= bend
# (t - t0)^2 / 2. That proves over which stretch of time a ray cannot leave what is covered.

from typing import NamedTuple

import numpy as np

from vmachining.jit import kernel, leaf
from vmachining.numerics._kernels import insert
from vmachining.sweep.rotating.pose._kernels import aim, bending, near, spinning, state

STOP = 1e-11  # mm: what a stretch of time could add when it is given up
MERGE = 1e-10  # mm: intervals closer than this are one
PATIENCE = 1000  # cells after which STOP grows a hundredfold: surfaces that slide along themselves
LOOSE = 1e-7  # mm: where it stops growing
BEYOND = 1e3  # mm past an end of a part of a line that are taken as covered: proofs only ask whether there is enough
STACK = 160  # rows of a stack of stretches of time, at first
SLOW = 0.9  # a bracket that shrinks to more than this is halved
TWICE = 1.9  # a cut that far from an extreme, in proofs of the extreme, proves back to it where the body is convex


@leaf
def span(D, nu, f, g, bend):
    """Largest time step over which D (nu - step |g|) - step f - bend step^2 / 2 stays positive."""
    b = f + D * abs(g)
    c = D * nu
    if c <= 0.0:
        return 0.0
    root = np.sqrt(b * b + 2.0 * bend * c)
    step = np.inf
    if b < 0.0 < bend:
        step = (root - b) / bend
    elif b >= 0.0 and b + root > 0.0:
        step = 2.0 * c / (b + root)
    if step * abs(g) > nu:
        step = nu / abs(g)
    return step


@leaf
def lasts(shot, side, D, way, bend, width):
    """Time over which one end of a hit cannot leave what is covered by D; way -1 is backwards in time.

    Not all of it where that is known to be `width` or more.
    """
    j, k = 1 + 4 * side, 9 + 2 * side
    nu = shot[j + 1] if side else -shot[j + 1]
    f = way * shot[j + 2]
    step = span(D, nu, f, shot[j + 3], bend)
    if step < width and shot[k] >= 0.0:
        step = max(step, min(shot[k + 1], span(D, nu, f, 0.0, shot[k])))
    return step


@leaf
def empty(seg, i0, i1, p, o, u, a, b, half, e):
    """Whether no pose within `half` of this one meets the line between a and b: cuts walk in from both ends.

    A cut at s0 excludes the line up to where phi0 + nu (s - s0) - half |f + g (s - s0)| <= e.
    """
    for side in range(2):
        way = 1.0 if side == 0 else -1.0
        s, far = (a, b) if side == 0 else (b, a)
        for _ in range(12):
            d, n_x, n_y, n_z, f = near(seg, i0, i1, p, o[0] + s * u[0], o[1] + s * u[1], o[2] + s * u[2])
            room = d - half * abs(f) - e
            if room <= 0.0:
                break
            along = u[0] * p[3] + u[1] * p[4] + u[2] * p[5]
            turn = p[9] * u[0] + p[10] * u[1] + p[11] * u[2]
            # g = N . (omega x u), omega x u = A' (A.u) - A (A'.u)
            g = along * (n_x * p[9] + n_y * p[10] + n_z * p[11]) - turn * (
                n_x * p[3] + n_y * p[4] + n_z * p[5]
            )
            fall = half * abs(g) - way * (n_x * u[0] + n_y * u[1] + n_z * u[2])
            if fall <= 0.0 or room >= fall * way * (far - s):
                return True
            s += way * room / fall
        if side == 0:
            a = s
        else:
            b = s
        if a > b:
            return True
    return False


@leaf
def ball(p, limit, o, u, grow):
    """Part (a, b) of a line inside a ball about the middle of the body; empty is a > b."""
    w_x = p[0] + limit[0] * p[3] - o[0]
    w_y = p[1] + limit[0] * p[4] - o[1]
    w_z = p[2] + limit[0] * p[5] - o[2]
    s = w_x * u[0] + w_y * u[1] + w_z * u[2]
    w_x, w_y, w_z = w_x - s * u[0], w_y - s * u[1], w_z - s * u[2]
    room = (limit[1] + grow) ** 2 - (w_x * w_x + w_y * w_y + w_z * w_z)
    if room < 0.0:
        return 1.0, 0.0
    half = np.sqrt(room)
    return s - half, s + half


@leaf
def apart(seg, i0, i1, p, limit, bend, half, o, u, lo, hi, n):
    """Whether no pose within `half` of this one meets the line outside of what is known at its ends: n intervals lo, hi."""
    e = 0.5 * bend * half * half
    sx, sy, sz = p[6] + limit[0] * p[9], p[7] + limit[0] * p[10], p[8] + limit[0] * p[11]
    spin = np.sqrt(p[9] ** 2 + p[10] ** 2 + p[11] ** 2)
    grow = half * (np.sqrt(sx * sx + sy * sy + sz * sz) + spin * limit[1]) + e
    a, b = ball(p, limit, o, u, grow)
    if n > 0 and lo[0] <= a:
        a = max(a, hi[0])
    if n > 0 and hi[n - 1] >= b:
        b = min(b, lo[n - 1])
    return a > b or empty(seg, i0, i1, p, o, u, a, b, half, e)


@leaf
def holder(lo, hi, n, a):
    """Index of the interval that holds a."""
    j = 0
    while j < n - 1 and hi[j] < a:
        j += 1
    return j


@kernel
def grown(cells):
    """A stack of twice the size: no stretch of time is dropped for lack of room."""
    out = np.zeros((2 * len(cells), cells.shape[1]))
    out[: len(cells)] = cells
    return out


@leaf
def stationary(fa, fb, rise, w):
    """Where between 0 and w the cubic with these slopes and rise has its extreme; slopes of either sign, one of each."""
    way = 1.0 if fa < 0.0 else -1.0
    a = 3.0 * way * (fa + fb - 2.0 * rise / w)
    b = 2.0 * way * (3.0 * rise / w - 2.0 * fa - fb)
    root = np.sqrt(b * b - 4.0 * a * way * fa)
    return -2.0 * way * fa * w / (b + root) if b > 0.0 else 0.5 * (root - b) * w / a


@leaf
def split_at(ta, tb, da, db, fa, fb, rise, bracket, last):
    """Where to cut a stretch whose ends prove da and db of it.

    bracket: an extreme lies between, with slopes fa, fb at the ends and `rise` from end to end. Where a smooth
    function would have its tangents meet in the middle they find an edge of the body, else a cubic finds the
    stationary point. Beyond it: the geometric mean of what is open, as proofs grow with the distance; but first as near to an
    extreme as proves back to it, since half of the distance is proven towards it and many times as much away from it.
    """
    w = tb - ta
    if bracket and last > SLOW:
        return 0.5 * (ta + tb)
    if bracket:
        t = (rise - fb * w) / (fa - fb)
        if abs(t - 0.5 * w) < 0.1 * w:
            t = stationary(fa, fb, rise, w)
        if da < t < w - db:
            return ta + min(max(t, 1e-3 * w), 0.999 * w)
    if da + db >= w:
        return 0.5 * (ta + tb)
    near, far = max(min(da, db), 1e-5 * w), max(da, db, 1e-5 * w)
    step = np.sqrt(near * (w - far))
    if last < 0.98:
        step = min(step, TWICE * near)
    return ta + step if da < db else tb - step


@leaf
def closing(shot, way, w):
    """How far from a hit to cut a stretch whose other end the line misses: shortly before its chord closes, by its rates."""
    shrink = way * (shot[3] / shot[2] - shot[7] / shot[6])
    gap = shot[5] - shot[1]
    if not gap < 1.3 * w * shrink:
        return 0.5 * w
    t = gap / shrink
    return max(1e-12 * w, min(0.9 * w, (1.0 - min(0.1, max(1e-6, 2.0 * t))) * t))


@leaf
def chord(shot, way, step, w, bend):
    """Upper bound of the chord at a step of time from a hit, convex in steps up to w: between the planes at its ends.

    With r = bend step^2 / 2 + way step f at each end, the point there moves out by r / (nu +- step g) at most.
    """
    gap = shot[5] - shot[1]
    for j in range(1, 6, 4):
        nu = abs(shot[j + 1])
        lean = w * abs(shot[j + 3]) / nu
        if not lean < 1.0:
            return np.inf
        r = (0.5 * bend * step + way * shot[j + 2]) * step / nu
        gap += max(r / (1.0 - lean), r / (1.0 + lean))
    return gap


@leaf
def ahead(p, height, o, u):
    """Whether a point of the axis moves towards a line: then it is the last pose that may tell all of it."""
    w_x, w_y, w_z = o[0] - p[0] - height * p[3], o[1] - p[1] - height * p[4], o[2] - p[2] - height * p[5]
    v_x, v_y, v_z = p[6] + height * p[9], p[7] + height * p[10], p[8] + height * p[11]
    along = w_x * u[0] + w_y * u[1] + w_z * u[2]
    return w_x * v_x + w_y * v_y + w_z * v_z > along * (v_x * u[0] + v_y * u[1] + v_z * u[2])


class Room(NamedTuple):
    """What the search along a line works in.

    cells (k, 29): stack of stretches of time, each with its ends, its share of the stretch that it was cut from, and the shots
    at both ends. shots (3, 13), and poses (3, 12) at the start, half way and at the end. p (12,) pose. o (3,) mm.
    beside (pieces,): whether the ray before passes by a piece: so may this one, and that is asked first.
    """

    cells: np.ndarray
    shots: np.ndarray
    poses: np.ndarray
    p: np.ndarray
    o: np.ndarray
    beside: np.ndarray


@leaf
def joined(body, room, i0, i1, u, ta, tb, A, B, spin, bend, slack):
    """Whether every pose between two meets the line: a point that runs from chord to chord stays inside.

    With y the point as the body sees it, |y''| <= bend + 2 |omega| |x'|, and phi is convex: it stays below its
    linear interpolation by the depths at both ends plus |y''| w^2 / 8.
    """
    w, o = tb - ta, room.o
    sa, sb = 0.5 * (A[1] + A[5]), 0.5 * (B[1] + B[5])
    need = 0.125 * w * (bend * w + 2.0 * spin * abs(sb - sa)) - slack
    if need <= 0.0:
        return True
    for k in range(2):
        t, s = (ta, sa) if k == 0 else (tb, sb)
        state(body.waves, t, room.p)
        if near(body.seg, i0, i1, room.p, o[0] + s * u[0], o[1] + s * u[1], o[2] + s * u[2])[0] > -need:
            return False
    return True


@leaf
def settled(body, room, piece, u, lo, hi, n):
    """Settle what one piece adds to n known intervals of a line: (n, whether the stack is full). n is -1 when they do not fit."""
    seg, waves, limit = body.seg, body.waves, body.limits[piece]
    i0, i1 = body.ends[piece, 2], body.ends[piece + 1, 2]
    cells, shots, p = room.cells, room.shots, room.p
    bend, first = bending(limit, limit[1], 1.0), int(ahead(room.poses[1], limit[0], room.o, u))
    for turn in range(2):
        k = abs(first - turn)
        aim(body.planes, body.arcs, body.ends, piece, room.poses[2 * k], room.o, u, limit, body.tol, shots[k])
        if shots[k, 0] > 0.0:
            n = insert(lo, hi, n, shots[k, 1], shots[k, 5], MERGE)
            if n < 0:
                return n, False
            way, j = 1.0 - 2.0 * k, holder(lo, hi, n, shots[k, 1])
            if (
                lasts(shots[k], 0, shots[k, 1] - lo[j] + STOP, way, bend, 1.0) >= 1.0
                and lasts(shots[k], 1, hi[j] - shots[k, 5] + STOP, way, bend, 1.0) >= 1.0
            ):
                return n, False
    cells[0, 0], cells[0, 1], cells[0, 2] = 0.0, 1.0, 0.0
    for k in range(13):
        cells[0, 3 + k], cells[0, 16 + k] = shots[0, k], shots[1, k]
    top, seen, slack = 0, 0, STOP
    A, B, M = shots[0], shots[1], shots[2]
    while top >= 0:
        if top + 2 > len(cells):
            return n, True
        ta, tb, last = cells[top, 0], cells[top, 1], cells[top, 2]
        for k in range(13):
            A[k], B[k] = cells[top, 3 + k], cells[top, 16 + k]
        top -= 1
        seen += 1
        if seen % PATIENCE == 0:
            slack = max(slack, min(100.0 * slack, LOOSE))
        w = tb - ta
        bend = bending(limit, limit[1], w)
        # at an edge of the body what a pose adds is of first order
        if w * (limit[2] + limit[4] * limit[1]) <= slack:
            continue
        t = 0.5 * (ta + tb)
        if A[0] == 0.0 and B[0] == 0.0:
            half = 0.5 * w
            if w == 1.0:
                for k in range(12):
                    p[k] = room.poses[1, k]
            else:
                state(waves, t, p)
            if apart(seg, i0, i1, p, limit, bend, half, room.o, u, lo, hi, n):
                continue
            last = 0.0
        else:
            # the same interval for entry and exit: mixed proofs would let the line leave through a gap
            kA, kB = -1, -1
            if A[0] > 0.0:
                kA = holder(lo, hi, n, A[1])
            if B[0] > 0.0:
                kB = holder(lo, hi, n, B[1])
            if 0 <= kA != kB >= 0 and joined(body, room, i0, i1, u, ta, tb, A, B, limit[4], bend, slack):
                n = insert(lo, hi, n, min(A[1], B[1]), max(A[5], B[5]), MERGE)
                kA = holder(lo, hi, n, A[1])
                kB = kA
            bracket, both = False, kA == kB
            da, db, fa, fb, rise, gap = np.inf, np.inf, 0.0, 0.0, 0.0, 0.0
            for side in range(2):
                j = 1 + 4 * side
                way = 1.0 - 2.0 * side
                pa, pb = 0.0, 0.0
                if kA >= 0:
                    D = way * (A[j] - (lo[kA] if side == 0 else hi[kA])) + slack
                    pa = lasts(A, side, D, 1.0, bend, w)
                if both and pa >= w:
                    continue
                if kB >= 0:
                    D = way * (B[j] - (lo[kB] if side == 0 else hi[kB])) + slack
                    pb = lasts(B, side, D, -1.0, bend, w)
                if both:  # each side by itself; cut where the worse one is open
                    if w - pa - pb > gap:
                        gap, da, db = w - pa - pb, pa, pb
                        bracket = A[j + 2] > 0.0 > B[j + 2]
                        fa, fb, rise = A[j + 2] / A[j + 1], B[j + 2] / B[j + 1], B[j] - A[j]
                else:
                    da, db = min(da, pa), min(db, pb)
            if gap == 0.0 and (both or da + db >= w):
                continue
            if both:
                t = split_at(ta, tb, da, db, fa, fb, rise, bracket, last)
            elif kA >= 0 <= kB:
                t = 0.5 * (ta + da + tb - db)
            else:
                hit, way, known = (A, 1.0, da) if kB < 0 else (B, -1.0, db)
                # its ends stay inside of what is covered until the chord is closed, and it stays closed
                if max(chord(hit, way, known, w, bend), chord(hit, way, w, w, bend)) < 0.0:
                    continue
                t = closing(hit, way, w)
                t = ta + t if kB < 0 else tb - t
            if not ta < t < tb:
                continue
            state(waves, t, p)
        aim(body.planes, body.arcs, body.ends, piece, p, room.o, u, limit, body.tol, M)
        if M[0] > 0.0:
            n = insert(lo, hi, n, M[1], M[5], MERGE)
            if n < 0:
                return n, False
        for half_cell in range(2):
            top += 1
            c = cells[top]
            c[0], c[1] = (ta, t) if half_cell else (t, tb)
            c[2] = (c[1] - c[0]) / w
            for k in range(13):
                c[3 + k] = A[k] if half_cell else M[k]
                c[16 + k] = M[k] if half_cell else B[k]
    return n, False


@leaf
def through(body, room, first, origins, directions, given, counts, lo, hi):
    """Intervals of rays from `first` on; the number of the ray at which the stack was full, of all rays if it never was."""
    o, beside = room.o, room.beside
    for i in range(first, len(origins)):
        u = directions[i]
        shift = -(origins[i, 0] * u[0] + origins[i, 1] * u[1] + origins[i, 2] * u[2])
        for k in range(3):  # foot of the ray near the start: no long lever
            o[k] = origins[i, k] + shift * u[k]
        n, full = counts[i], False
        for j in range(n):
            given[0, j], given[1, j] = lo[i, j], hi[i, j]
            lo[i, j] -= shift
            hi[i, j] -= shift
        for piece in range(len(body.limits)):
            limit = body.limits[piece]
            if beside[piece] and apart(
                body.seg, body.ends[piece, 2], body.ends[piece + 1, 2], room.poses[1], limit,
                bending(limit, limit[1], 1.0), 0.5, o, u, lo[i], hi[i], n,
            ):  # fmt: skip
                continue
            known, enter, leave = n, hi[i, 0], lo[i, max(n - 1, 0)]
            n, full = settled(body, room, piece, u, lo[i], hi[i], n)
            if full:
                for j in range(counts[i]):
                    lo[i, j], hi[i, j] = given[0, j], given[1, j]
                return i
            if n < 0:
                break
            beside[piece] = n == known and hi[i, 0] == enter and lo[i, max(n - 1, 0)] == leave
        counts[i] = n
        for j in range(max(n, 0)):
            lo[i, j] += shift
            hi[i, j] += shift
    return len(origins)


@kernel
def rays(body, stack, origins, directions, counts, lo, hi) -> None:
    """Intervals of every ray; counts[i] = -1 where lo, hi (n, capacity) are full. Origins from the start.

    The first counts[i] intervals of a ray are taken as covered: what the sweep adds to them is found.
    stack : rows of it at first. No stretch of time is dropped for lack of room: a ray that needs more is asked once more.
    """
    room = Room(
        np.zeros((stack, 29)), np.zeros((3, 13)), np.zeros((3, 12)), np.zeros(12), np.empty(3),
        np.zeros(len(body.limits), dtype=np.bool_),
    )  # fmt: skip
    for k in range(3):
        state(body.waves, 0.5 * k, room.poses[k])
    given, done = np.empty((2, lo.shape[1])), 0
    while done < len(origins):
        done = through(body, room, done, origins, directions, given, counts, lo, hi)
        if done < len(origins):
            room = Room(grown(room.cells), room.shots, room.poses, room.p, room.o, room.beside)


@kernel
def beyond(who, between, straight, counts, lo, hi) -> None:
    """Start the rays `who` with what lies beyond their parts, between (n, 2) mm, as covered; straight ones with nothing."""
    for i in who:
        p, q = between[i]
        lo[i, 0], hi[i, 0], lo[i, 1], hi[i, 1] = p - BEYOND, p, q, q + BEYOND
        counts[i] = 0 if straight[i] else 2
        if q - p <= 2.0 * MERGE:
            hi[i, 0], counts[i] = q + BEYOND, min(counts[i], 1)


@leaf
def narrowed(seg, i0, i1, limit, waves, x, y, z, best, level, cells, p, top, seen, slack):
    """Settle the stretches on the stack, or as many as there is room for; (best, top, seen, slack) to continue with."""
    spin = spinning(waves, x, y, z)
    while top >= 0:
        if top + 2 > len(cells):
            break
        ta, tb, last = cells[top, 0], cells[top, 1], cells[top, 2]
        pa, fa, pb, fb = cells[top, 3], cells[top, 4], cells[top, 5], cells[top, 6]
        top -= 1
        seen += 1
        if seen % PATIENCE == 0:
            slack = max(slack, min(100.0 * slack, LOOSE))
        if best <= level:
            return best, -1, seen, slack
        w = tb - ta
        goal = max(level, best - slack)
        far = max(min(pa, pb), 0.0) + limit[1]  # the point is that near to the middle of the body
        bend = min(bending(limit, far, w), spin)
        if w * (limit[2] + limit[4] * far) <= slack:
            continue
        da, db = span(pa - goal, 1.0, fa, 0.0, bend), span(pb - goal, 1.0, -fb, 0.0, bend)
        if da + db >= w:
            continue
        t = split_at(ta, tb, da, db, -fa, -fb, pb - pa, fa > 0.0 > fb, last)
        if not ta < t < tb:
            continue
        state(waves, t, p)
        d, _x, _y, _z, f = near(seg, i0, i1, p, x, y, z)
        best = min(best, d)
        for half_cell in range(2):
            top += 1
            c = cells[top]
            c[0], c[1] = (ta, t) if half_cell else (t, tb)
            c[2] = (c[1] - c[0]) / w
            c[3], c[4] = (pa, fa) if half_cell else (d, f)
            c[5], c[6] = (d, f) if half_cell else (pb, fb)
    return best, top, seen, slack


@kernel
def distance_piece(seg, i0, i1, limit, waves, x, y, z, poses, best, tol, level, cells, p):
    """The smaller of `best` and the smallest phi of one piece over time; with a level, only its side is certain."""
    cells[0, 0], cells[0, 1], cells[0, 2] = 0.0, 1.0, 0.0
    for k in range(2):
        d, _x, _y, _z, f = near(seg, i0, i1, poses[k], x, y, z)
        cells[0, 3 + 2 * k], cells[0, 4 + 2 * k] = d, f
    top, seen, slack = 0, 0, tol
    while top >= 0:
        best, top, seen, slack = narrowed(
            seg, i0, i1, limit, waves, x, y, z, best, level, cells, p, top, seen, slack
        )
        if top >= 0:
            cells = grown(cells)
    return best


@kernel
def distances(seg, ends, limits, waves, points, tol, level, out) -> None:
    """Smallest phi over time and pieces. With a finite level only its side of the level is certain."""
    cells, p, poses = np.zeros((STACK, 7)), np.zeros(12), np.zeros((2, 12))
    for k in range(2):
        state(waves, float(k), poses[k])
    for i in range(len(points)):
        x, y, z = points[i]
        best = np.inf
        for piece in range(len(ends) - 1):
            for k in range(2):
                best = min(best, near(seg, ends[piece, 2], ends[piece + 1, 2], poses[k], x, y, z)[0])
        for piece in range(len(ends) - 1):
            i0, i1 = ends[piece, 2], ends[piece + 1, 2]
            best = distance_piece(
                seg, i0, i1, limits[piece], waves, x, y, z, poses, best, tol, level, cells, p
            )
        out[i] = best
