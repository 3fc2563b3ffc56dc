# The engaged intervals of a meridian at many rotation angles. Legend: margin/_kernels.py.

import numpy as np

from vmachining.engagement.along.margin._kernels import (
    FAR,
    Room,
    box_gap,
    edge_point,
    into,
    margin,
    stock_gap,
    sweep_gap,
)
from vmachining.jit import kernel, leaf

ROOT = 1e-8  # mm: width of the bracket of an end
ZERO = 1e-10  # mm: margin that counts as none
TOUCH_RAD = 1e-4  # arcs narrower than this are a line along which tool and wall touch
SURE = 1e-6  # mm: where the edge is deeper, the interval around it is long enough to be kept
HALVINGS = 12  # of a step of the grid, for ends of arcs and jumps: 2e-5 rad of 5 degrees
LEAST, CELLS = 0.02, 16.0  # mm, and of a piece: steps along walls that the edge all but touches
JUMP, JUMP_MM = 1.1, 0.02  # a change of length is a jump if it exceeds those beside it by this


@leaf
def end_between(world, kept, count, blade, now, piece, phi, bend, room, a, b, f_a, f_b):
    """Where the margin changes its sign, within ROOT: Brent's method, whose last step crosses the root by ROOT / 2."""
    if abs(f_b) <= ZERO:  # steps as long as the margin land on what they measure
        return b
    if abs(f_a) <= ZERO:
        return a
    # b is the best so far, the root is between b and c, a was best before
    c, f_c = a, f_a
    step = before = b - a
    for _ in range(80):
        if abs(f_c) < abs(f_b):
            a, f_a = b, f_b
            b, f_b = c, f_c
            c, f_c = a, f_a
        half = 0.5 * (c - b)
        if abs(half) <= 0.5 * ROOT or abs(f_b) <= ZERO:
            break
        found = False
        if abs(before) >= 0.5 * ROOT and abs(f_a) > abs(f_b):
            ratio = f_b / f_a
            if a == c:
                p, q = 2.0 * half * ratio, 1.0 - ratio
            else:
                u, v = f_a / f_c, f_b / f_c
                p = ratio * (2.0 * half * u * (u - v) - (b - a) * (v - 1.0))
                q = (u - 1.0) * (v - 1.0) * (ratio - 1.0)
            if p > 0.0:
                q = -q
            p = abs(p)
            if 2.0 * p < min(3.0 * half * q - abs(0.5 * ROOT * q), abs(before * q)):
                before, step = step, p / q
                found = True
        if not found:
            step = before = half
        a, f_a = b, f_b
        b += step if abs(step) > 0.5 * ROOT else (0.5 * ROOT if half > 0.0 else -0.5 * ROOT)
        f_b = margin(world, kept, count, blade, now, piece, b, phi, bend, room)
        if (f_b < 0.0) == (f_c < 0.0):
            c, f_c = a, f_a
            step = before = b - a
    return b


@leaf
def facing(blade, now, piece, phi):
    """s between which a straight piece moves into what lies before it; empty if it does nowhere.

    N . V is linear along a line, and cos(beta) P + sin(beta) Q along an arc of normals beta: positive on one interval.
    """
    q = blade.rows[piece]
    a, b = blade.joints[piece], blade.joints[piece + 1]
    idle = now[19]
    if q[6] > 0.0:
        side = into(now, phi, q[4], q[5], 1.0, 0.0)  # beta = 0: n_r, lever cz
        over = into(now, phi, q[4], q[5], 0.0, 1.0)  # beta = 90 degrees: n_z, lever -cr
        most = np.sqrt(side * side + over * over)
        if most <= idle:
            return a, a
        middle, half = np.arctan2(over, side), np.arccos(idle / most)
        low, high = max(q[7], middle - half), min(q[8], middle + half)
        if low >= high:
            return a, a
        # ends of the piece stay what they are
        return (a if low == q[7] else a + (low - q[7]) * q[6]), (
            b if high == q[8] else a + (high - q[7]) * q[6]
        )
    n_r, n_z = np.cos(q[7]), np.sin(q[7])
    f = into(now, phi, q[0], q[1], n_r, n_z) - idle
    g = into(now, phi, q[2], q[3], n_r, n_z) - idle
    if f <= 0.0 and g <= 0.0:
        return a, a
    if f > 0.0 and g > 0.0:
        return a, b
    root = a + (b - a) * f / (f - g)
    return (a, root) if f > 0.0 else (root, b)


@leaf
def cut_at(world, kept, count, blade, now, phi, room, brief):
    """Engaged intervals at one angle into room.hit; how many. brief : only whether there are any, the rows are not made."""
    n = 0
    for piece in range(len(blade.rows)):
        q = blade.rows[piece]
        if q[1] > now[20]:
            break
        a, b = blade.joints[piece], blade.joints[piece + 1]
        bend = -1.0
        if blade.twist == 0.0 or q[1] == q[3]:
            a, b = facing(blade, now, piece, phi - q[1] * blade.twist)
        else:
            bend = abs(blade.twist) + 1e-6 + (1.0 / q[6] if q[6] > 0.0 else 0.0)
        if q[6] == 0.0 and q[3] > q[1]:  # nothing of the stock is higher
            b = min(
                b,
                blade.joints[piece]
                + (now[20] - q[1]) / (q[3] - q[1]) * (blade.joints[piece + 1] - blade.joints[piece])
                + 1e-6,
            )
        if b <= a:
            continue
        least = max(LEAST, (b - a) / CELLS)
        s, f = a, margin(world, kept, count, blade, now, piece, a, phi, bend, room)
        begin = a
        while s < b:
            if brief and f < -SURE and b - a > SURE:
                return 1
            t = min(s + max(abs(f) / blade.stretch, least), b)
            g = margin(world, kept, count, blade, now, piece, t, phi, bend, room)
            if (f < 0.0) != (g < 0.0):
                e = end_between(world, kept, count, blade, now, piece, phi, bend, room, s, t, f, g)
                if f < 0.0:
                    n = kept_interval(world, kept, count, blade, now, piece, phi, bend, room, n, begin, e)
                begin = e
            s, f = t, g
        if f < 0.0:
            n = kept_interval(world, kept, count, blade, now, piece, phi, bend, room, n, begin, s)
    return n


@leaf
def kept_interval(world, kept, count, blade, now, piece, phi, bend, room, n, a, b):
    """Append an interval, unless it is a mere touch: shorter than 0.02 mm and no deeper than rounding."""
    if b - a <= 1e-7 or n >= len(room.hit):
        return n
    if b - a < 0.02 and margin(world, kept, count, blade, now, piece, 0.5 * (a + b), phi, bend, room) > -1e-8:
        return n
    room.hit[n, 0], room.hit[n, 1], room.hit[n, 2] = piece, a, b
    return n + 1


@leaf
def hit_length(room, n):
    """mm of the intervals in room.hit."""
    out = 0.0
    for i in range(n):
        out += room.hit[i, 2] - room.hit[i, 1]
    return out


@kernel
def reduce(world, near_by, blade, nows, angles, pitch, slack, kept) -> int:
    """Those of the sweeps `near_by` (latest first) that can end or cover some of the edge at these places.

    Samples of the edge at `angles` rotation angles and steps of `pitch` mm stand for all of it within half a step,
    and for other places of the tool within `slack` mm. Returns how many are in `kept`.
    """
    total = blade.joints[-1] - blade.joints[0]
    most = angles * (int(total / pitch) + 2 * len(blade.rows) + 2) * len(nows)
    points, half = np.empty((most, 3)), np.empty(most)
    room = Room(
        np.zeros((512, 7)),
        np.zeros(12),
        np.zeros((2, 12)),
        np.zeros((1, 3)),
        np.zeros(128, np.int64),
        np.zeros(128),
        np.zeros(1, np.int64),
    )
    n = 0
    for place in range(len(nows)):
        now = nows[place]
        for piece in range(len(blade.rows)):
            q = blade.rows[piece]
            if q[1] > now[20]:
                break
            a, b = blade.joints[piece], blade.joints[piece + 1]
            if q[6] == 0.0 and q[3] > q[1]:
                b = min(b, a + (b - a) * min(1.0, (now[20] - q[1]) / (q[3] - q[1])) + pitch)
            cells = int(np.ceil((b - a) / pitch))
            step = (b - a) / cells
            bend = 1e-6 + (1.0 / q[6] if q[6] > 0.0 else 0.0)
            for i in range(cells):
                r, z, n_r, n_z = edge_point(blade, piece, a + (i + 0.5) * step)
                aside = 0.5 * step + r * np.pi / angles + slack
                for j in range(angles):
                    phi = 2.0 * np.pi * j / angles
                    # the facing set, too, is known within half a step only
                    reach = aside * (bend + 1.0 / max(r, 1e-3)) * now[18] + aside * now[21]
                    if slack == 0.0 and into(now, phi, r, z, n_r, n_z) + reach < 0.0:
                        continue
                    sp, cp = np.sin(phi), np.cos(phi)
                    for axis in range(3):
                        points[n, axis] = (
                            now[axis] + z * now[3 + axis] + r * (sp * now[12 + axis] + cp * now[15 + axis])
                        )
                    if stock_gap(world, points[n, 0], points[n, 1], points[n, 2], room) > aside:
                        continue
                    half[n] = aside
                    n += 1
    found = 0
    for i in range(len(near_by)):
        if n == 0:
            break
        k = near_by[i]
        used, left = False, 0
        for j in range(n):
            x, y, z = points[j, 0], points[j, 1], points[j, 2]
            gone = False
            if box_gap(world.box[k], x, y, z) <= half[j]:
                d = sweep_gap(world, k, x, y, z, FAR, room)
                if d <= half[j]:
                    used = True
                    gone = d < -half[j]
            if not gone:
                points[left], half[left] = points[j], half[j]
                left += 1
        if left < n:
            used = True
        n = left
        if used:
            kept[found] = k
            found += 1
    return found


@kernel
def contact(world, kept, count, blade, now, grid, more, phi, hits) -> tuple[int, int, float, bool]:
    """What the edge cuts at one place of the tool.

    grid : (n,) rad rising within one turn, evenly spaced; more : angles of special interest, (j,).
    phi, hits : room for angles, and for intervals (angle, piece, s0, s1).
    Returns (angles, intervals, engaged rad, engaged all round); angles or intervals -1: no room. The grid comes first,
    then `more`, the ends of arcs and both sides of jumps.
    """
    room = Room(
        np.zeros((512, 7)),
        np.zeros(12),
        np.zeros((2, 12)),
        np.zeros((32, 3)),
        np.zeros(128, np.int64),
        np.zeros(128),
        np.zeros(1, np.int64),
    )
    # the ring of angles that is searched: grid and more in order
    ring = np.concatenate((grid, more))
    order = np.argsort(ring, kind="mergesort")
    size = len(ring)
    length = np.zeros(size)
    top, used = size, 0
    if size > len(phi):
        return -1, 0, 0.0, False
    phi[:size] = ring
    for i in range(size):
        hit = cut_at(world, kept, count, blade, now, phi[i], room, False)
        length[i] = hit_length(room, hit)
        used = put(hits, used, room, hit, i)
        if used < 0:
            return 0, -1, 0.0, False
    engaged = 0
    for i in range(size):
        engaged += length[i] > 0.0
    if engaged == 0:
        return top, used, 0.0, False
    if engaged == size:
        used, top = jumps(world, kept, count, blade, now, phi, hits, order, length, room, used, top, size)
        return top, used, 2.0 * np.pi, True
    arcs = 0.0
    for at in range(size):
        i, j = order[at], order[(at + 1) % size]
        if (length[i] > 0.0) == (length[j] > 0.0):
            if length[i] > 0.0:
                arcs += (phi[j] - phi[i]) % (2.0 * np.pi)
            continue
        cutting = i if length[i] > 0.0 else j
        good = phi[cutting]
        wide = (phi[j] - phi[i]) % (2.0 * np.pi)
        way = wide if cutting == i else -wide
        low, high = 0.0, 1.0
        for _ in range(HALVINGS):
            share = 0.5 * (low + high)
            if cut_at(world, kept, count, blade, now, good + share * way, room, True) > 0:
                low = share
            else:
                high = share
        arcs += low * wide
        if low * wide < 0.01 * TOUCH_RAD:
            continue
        if top >= len(phi):
            return -1, 0, 0.0, False
        phi[top] = good + low * way
        hit = cut_at(world, kept, count, blade, now, phi[top], room, False)
        used = put(hits, used, room, hit, top)
        top += 1
        if used < 0:
            return 0, -1, 0.0, False
    if arcs < TOUCH_RAD:
        return top, 0, 0.0, False
    used, top = jumps(world, kept, count, blade, now, phi, hits, order, length, room, used, top, size)
    return top, used, arcs, False


@kernel
def contact_at(world, kept, count, blade, now, phi, first, hits, used) -> int:
    """Append what the edge cuts at phi[first:]; the intervals used, -1 without room."""
    room = Room(
        np.zeros((512, 7)),
        np.zeros(12),
        np.zeros((2, 12)),
        np.zeros((32, 3)),
        np.zeros(128, np.int64),
        np.zeros(128),
        np.zeros(1, np.int64),
    )
    for i in range(first, len(phi)):
        used = put(hits, used, room, cut_at(world, kept, count, blade, now, phi[i], room, False), i)
        if used < 0:
            return -1
    return used


@leaf
def put(hits, used, room, hit, angle):
    """Append the intervals found at an angle; -1 without room."""
    if used + hit > len(hits):
        return -1
    for k in range(hit):
        hits[used, 0] = angle
        hits[used, 1], hits[used, 2], hits[used, 3] = room.hit[k, 0], room.hit[k, 1], room.hit[k, 2]
        used += 1
    return used


@leaf
def jumps(world, kept, count, blade, now, phi, hits, order, length, room, used, top, size):
    """Both sides of the angles at which the engaged length jumps; used, top to go on with."""
    for at in range(size):
        h, i, j, k = order[at - 1], order[at], order[(at + 1) % size], order[(at + 2) % size]
        if length[i] <= 0.0 or length[j] <= 0.0 or top + 2 > len(phi) or used + 2 * len(room.hit) > len(hits):
            continue
        change = abs(length[j] - length[i])
        beside = max(abs(length[i] - length[h]), abs(length[k] - length[j]))
        if change <= JUMP * beside + JUMP_MM:
            continue
        a, wide = phi[i], (phi[j] - phi[i]) % (2.0 * np.pi)
        low, high, f, g = 0.0, 1.0, length[i], length[j]
        for _ in range(HALVINGS):
            share = 0.5 * (low + high)
            e = hit_length(room, cut_at(world, kept, count, blade, now, a + share * wide, room, False))
            if abs(e - f) >= abs(g - e):
                high, g = share, e
            else:
                low, f = share, e
        for share in (low, high):
            phi[top] = a + share * wide
            used = put(hits, used, room, cut_at(world, kept, count, blade, now, phi[top], room, False), top)
            top += 1
    return used, top


@kernel
def chips(blade, now, hits, used, angles, out) -> None:
    """Of every angle: integral of N.V ds, largest N.V, lowest and highest point along the axis and along `aside`.

    out (angles, 6); now[22:25] is the unit direction across axis and feed, the angles follow. Gauss' rule with five nodes:
    exact for lines, 1e-9 of a quarter of a circle.
    """
    out[:angles, 0:2] = 0.0
    for i in range(angles):
        out[i, 2], out[i, 3], out[i, 4], out[i, 5] = FAR, -FAR, FAR, -FAR
    node = np.array([-0.9061798459386640, -0.5384693101056831, 0.0, 0.5384693101056831, 0.9061798459386640])
    weight = np.array(
        [0.2369268850561891, 0.4786286704993665, 0.5688888888888889, 0.4786286704993665, 0.2369268850561891]
    )
    for h in range(used):
        i, piece = int(hits[h, 0]), int(hits[h, 1])
        a, b = hits[h, 2], hits[h, 3]
        phi = now[25 + i]
        half, middle = 0.5 * (b - a), 0.5 * (a + b)
        for k in range(-2, 5):
            if k == -2:
                s = a
            elif k == -1:
                s = b
            else:
                s = middle + half * node[k]
            r, z, n_r, n_z = edge_point(blade, piece, s)
            turned = phi - z * blade.twist
            g = max(into(now, turned, r, z, n_r, n_z), 0.0)
            out[i, 1] = max(out[i, 1], g)
            if k >= 0:
                out[i, 0] += half * weight[k] * g
            sp, cp = np.sin(turned), np.cos(turned)
            w = r * (
                now[22] * (sp * now[12] + cp * now[15])
                + now[23] * (sp * now[13] + cp * now[16])
                + now[24] * (sp * now[14] + cp * now[17])
            )
            out[i, 2], out[i, 3] = min(out[i, 2], z), max(out[i, 3], z)
            out[i, 4], out[i, 5] = min(out[i, 4], w), max(out[i, 5], w)
