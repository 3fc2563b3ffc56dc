# The engaged stretches of a meridian at many rotation angles, against stock and sweeps nearby.
#
# Legend: s arc length along the meridian, mm; m (margin) of a point, mm: negative where it cuts. A point cuts if its
#   surface moves into what lies before it (N.V > 0), if it is in the stock, and if no sweep covers it; the margin is
#   the largest of three functions that change by at most `stretch` per mm of s, so |m| / stretch is a step without a
#   root.
# World: kind 0 box (lo, hi), 1 upright cylinder (x, y, R, z0, z1), 2 triangles (a to boxes, see
#   engagement/_kernels.py). Columns of the sweeps, one row each: box lo and hi; form: first and last + 1 piece, 1 if
#   the axis turns, row of frames or -1; start; path (see sweep/_kernels.py); tol: of the distance, and depth up to
#   which a point counts as on the surface. Rows of pieces: first and last + 1 segment, first and last + 1 wave; limits
#   and waves as in sweep/turned.
# Tool: rows r0 z0 r1 z1 cr cz R beta0 beta1 of the meridian, joints (s of their ends), twist rad/mm of height.
# now (22,): tip, axis, velocity, rate of the axis, right, ahead (3 each), speed, idle speed, highest z, steepness added.
# hit rows: piece, s0, s1.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.jit import kernel, leaf
from vmachining.stock._kernels import mesh_distance
from vmachining.sweep._kernels import meridian, nearest, planar_gap
from vmachining.sweep.turned._kernels import _narrowed
from vmachining.sweep.turned.pose._kernels import near, state

ROOT = 1e-8  # mm: width of the bracket of an end
ZERO = 1e-10  # mm: margin that counts as none
FAR = 1e9
LEVEL = -0.25  # mm: deeper than this in a turning sweep needs no digits
TOUCH_RAD = 1e-4  # arcs narrower than this are a line along which tool and wall touch
HALVINGS = 12  # of a step of the grid, for ends of arcs and jumps: 2e-5 rad of 5 degrees
LEAST, CELLS = 0.02, 16.0  # mm, and of a piece: steps along walls that the edge all but touches
JUMP, JUMP_MM = 1.1, 0.02  # a change of length is a jump if it exceeds those beside it by this


class World(NamedTuple):
    """Stock and earlier sweeps, see the legend."""

    kind: int
    stock: NDArray[np.float64]
    box: NDArray[np.float64]
    form: NDArray[np.int64]
    start: NDArray[np.float64]
    path: NDArray[np.float64]
    tol: NDArray[np.float64]
    frames: NDArray[np.float64]
    pieces: NDArray[np.int64]
    seg: NDArray[np.float64]
    limits: NDArray[np.float64]
    waves: NDArray[np.float64]
    a: NDArray[np.float64]
    b: NDArray[np.float64]
    c: NDArray[np.float64]
    normals: NDArray[np.float64]
    boxes: NDArray[np.float64]


class Blade(NamedTuple):
    """The meridian, see the legend."""

    rows: NDArray[np.float64]
    joints: NDArray[np.float64]
    twist: float
    stretch: float


class Room(NamedTuple):
    """Work space of the kernels."""

    cells: NDArray[np.float64]
    p: NDArray[np.float64]
    poses: NDArray[np.float64]
    hit: NDArray[np.float64]
    stack: NDArray[np.int64]
    square: NDArray[np.float64]


@leaf
def mesh_gap(world, x, y, z, room):
    """Signed distance to the triangles."""
    p = room.p
    p[0], p[1], p[2] = x, y, z
    return mesh_distance(
        p, world.a, world.b, world.c, world.normals, world.boxes, room.stack, room.square, 0
    )[0]


@leaf
def stock_gap(world, x, y, z, room):
    """Signed distance to the stock."""
    q = world.stock
    if world.kind == 2:
        away = box_gap(q, x, y, z)
        return away if away > 1.0 else mesh_gap(world, x, y, z, room)
    if world.kind == 0:
        a = max(q[0] - x, x - q[3])
        b = max(q[1] - y, y - q[4])
        c = max(q[2] - z, z - q[5])
        out = np.sqrt(max(a, 0.0) ** 2 + max(b, 0.0) ** 2 + max(c, 0.0) ** 2)
        return out + min(max(a, max(b, c)), 0.0)
    a = np.sqrt((x - q[0]) ** 2 + (y - q[1]) ** 2) - q[2]
    c = max(q[3] - z, z - q[4])
    return np.sqrt(max(a, 0.0) ** 2 + max(c, 0.0) ** 2) + min(max(a, c), 0.0)


@leaf
def box_gap(box, x, y, z):
    """Distance to a box, 0 inside."""
    a = max(max(box[0] - x, x - box[3]), 0.0)
    b = max(max(box[1] - y, y - box[4]), 0.0)
    c = max(max(box[2] - z, z - box[5]), 0.0)
    return np.sqrt(a * a + b * b + c * c)


@leaf
def sweep_gap(world, k, x, y, z, best, room):
    """The smaller of `best` and the signed distance to sweep k; below LEVEL only that it is."""
    first, last, turns, frame = world.form[k, 0], world.form[k, 1], world.form[k, 2], world.form[k, 3]
    if frame >= 0:
        f = world.frames[frame]
        x, y, z = (
            f[0, 0] * x + f[0, 1] * y + f[0, 2] * z,
            f[1, 0] * x + f[1, 1] * y + f[1, 2] * z,
            f[2, 0] * x + f[2, 1] * y + f[2, 2] * z,
        )
    x, y, z = x - world.start[k, 0], y - world.start[k, 1], z - world.start[k, 2]
    seg, tol = world.seg, world.tol[k, 0]
    if turns == 0:
        path = world.path[k]
        if path[9] == 0.0:
            for j in range(first, last):
                best = min(
                    best, nearest(seg, world.pieces[j, 0], world.pieces[j, 1], path[6:9], x, y, z, tol)[0]
                )
        else:
            gap = planar_gap(path, x, y)
            for j in range(first, last):
                best = min(best, meridian(seg, world.pieces[j, 0], world.pieces[j, 1], gap, z)[0])
        return best
    cells, poses = room.cells, room.poses
    waves = world.waves[world.pieces[first, 2] : world.pieces[first, 3]]
    state(waves, 0.0, poses[0])
    state(waves, 1.0, poses[1])
    for j in range(first, last):
        i0, i1 = world.pieces[j, 0], world.pieces[j, 1]
        cells[0, 0], cells[0, 1], cells[0, 2] = 0.0, 1.0, 0.0
        for e in range(2):
            d, _x, _y, _z, f = near(seg, i0, i1, poses[e], x, y, z)
            cells[0, 3 + 2 * e], cells[0, 4 + 2 * e] = d, f
            best = min(best, d)
        best = _narrowed(
            seg, i0, i1, world.limits[j], waves, x, y, z, best, LEVEL, cells, room.p, 0, 0, max(tol, 1e-8)
        )[0]
    return best


@leaf
def edge_point(blade, piece, s):
    """r, z, n_r, n_z of the meridian."""
    q = blade.rows[piece]
    t = s - blade.joints[piece]
    if q[6] > 0.0:
        beta = min(q[7] + t / q[6], q[8])
        c, n = np.cos(beta), np.sin(beta)
        return max(q[4] + q[6] * c, 0.0), q[5] + q[6] * n, c, n
    size = blade.joints[piece + 1] - blade.joints[piece]
    share = min(max(t / size, 0.0), 1.0)
    return q[0] + share * (q[2] - q[0]), q[1] + share * (q[3] - q[1]), np.cos(q[7]), np.sin(q[7])


@leaf
def into(now, phi, r, z, n_r, n_z):
    """N . V of a point of the edge at phi, per unit of the block."""
    sp, cp = np.sin(phi), np.cos(phi)
    m_v = sp * (now[12] * now[6] + now[13] * now[7] + now[14] * now[8]) + cp * (
        now[15] * now[6] + now[16] * now[7] + now[17] * now[8]
    )
    m_w = sp * (now[12] * now[9] + now[13] * now[10] + now[14] * now[11]) + cp * (
        now[15] * now[9] + now[16] * now[10] + now[17] * now[11]
    )
    a_v = now[3] * now[6] + now[4] * now[7] + now[5] * now[8]
    return n_r * m_v + n_z * a_v + (z * n_r - r * n_z) * m_w


@leaf
def material(world, kept, count, x, y, z, room):
    """Signed distance to the workpiece from outside: positive where there is none, bounded by 5 mm inside."""
    gap = -FAR
    if world.kind != 2:
        gap = stock_gap(world, x, y, z, room)
        if gap > 0.5:
            return gap
    best = 5.0
    for i in range(count):
        k = kept[i]
        touch = world.tol[k, 1]
        if box_gap(world.box[k], x, y, z) < best:
            best = min(best, sweep_gap(world, k, x, y, z, best - touch, room) + touch)
            if best < LEVEL:
                return -best
    if world.kind == 2:  # triangles are asked last, they are slow
        gap = stock_gap(world, x, y, z, room)
    return max(gap - 1e-9, -best)


@leaf
def margin(world, kept, count, blade, now, piece, s, phi, bend, room):
    """Negative where the edge cuts; with a negative bend only the material is asked."""
    r, z, n_r, n_z = edge_point(blade, piece, s)
    turned = phi - z * blade.twist
    back = -FAR
    if bend >= 0.0:
        back = (now[19] - into(now, turned, r, z, n_r, n_z)) / (bend * now[18] + now[21])
        if back > 0.5:
            return back
    sp, cp = np.sin(turned), np.cos(turned)
    x = now[0] + z * now[3] + r * (sp * now[12] + cp * now[15])
    y = now[1] + z * now[4] + r * (sp * now[13] + cp * now[16])
    w = now[2] + z * now[5] + r * (sp * now[14] + cp * now[17])
    return max(back, material(world, kept, count, x, y, w, room))


@leaf
def end_between(world, kept, count, blade, now, piece, phi, bend, room, a, b, f_a, f_b):
    """Where the margin changes its sign: regula falsi (Illinois), every third time the middle."""
    if abs(f_b) <= ZERO:  # steps as long as the margin land on what they measure
        return b
    if abs(f_a) <= ZERO:
        return a
    for step in range(80):
        if b - a <= ROOT:
            break
        s = a + (b - a) * f_a / (f_a - f_b)
        if step % 3 == 2 or not a < s < b:
            s = 0.5 * (a + b)
        if not a < s < b:
            break
        f = margin(world, kept, count, blade, now, piece, s, phi, bend, room)
        if abs(f) <= ZERO:
            return s
        if (f < 0.0) == (f_a < 0.0):
            a, f_a, f_b = s, f, 0.5 * f_b
        else:
            b, f_b, f_a = s, f, 0.5 * f_a
    return 0.5 * (a + b)


@leaf
def facing(blade, now, piece, phi):
    """s between which a straight piece moves into what lies before it; empty if it does nowhere.

    N . V is linear along a line, and cos(beta) P + sin(beta) Q along an arc of normals beta: positive on one stretch.
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
def cut_at(world, kept, count, blade, now, phi, room):
    """Engaged stretches at one angle into room.hit; how many."""
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
            t = min(s + max(abs(f) / blade.stretch, least), b)
            g = margin(world, kept, count, blade, now, piece, t, phi, bend, room)
            if (f < 0.0) != (g < 0.0):
                e = end_between(world, kept, count, blade, now, piece, phi, bend, room, s, t, f, g)
                if f < 0.0:
                    n = kept_stretch(world, kept, count, blade, now, piece, phi, bend, room, n, begin, e)
                begin = e
            s, f = t, g
        if f < 0.0:
            n = kept_stretch(world, kept, count, blade, now, piece, phi, bend, room, n, begin, s)
    return n


@leaf
def kept_stretch(world, kept, count, blade, now, piece, phi, bend, room, n, a, b):
    """Append a stretch, unless it is a mere touch: shorter than 0.02 mm and no deeper than rounding."""
    if b - a <= 1e-7 or n >= len(room.hit):
        return n
    if b - a < 0.02 and margin(world, kept, count, blade, now, piece, 0.5 * (a + b), phi, bend, room) > -1e-8:
        return n
    room.hit[n, 0], room.hit[n, 1], room.hit[n, 2] = piece, a, b
    return n + 1


@leaf
def hit_length(room, n):
    """mm of the stretches in room.hit."""
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
    phi, hits : room for angles, and for stretches (angle, piece, s0, s1).
    Returns (angles, stretches, engaged rad, engaged all round); angles or stretches -1: no room. The grid comes first,
    then `more`, the ends of arcs and both sides of jumps.
    """
    room = Room(
        np.zeros((512, 7)),
        np.zeros(12),
        np.zeros((2, 12)),
        np.zeros((32, 3)),
        np.zeros(128, np.int64),
        np.zeros(128),
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
        hit = cut_at(world, kept, count, blade, now, phi[i], room)
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
            if cut_at(world, kept, count, blade, now, good + share * way, room) > 0:
                low = share
            else:
                high = share
        arcs += low * wide
        if low * wide < 0.01 * TOUCH_RAD:
            continue
        if top >= len(phi):
            return -1, 0, 0.0, False
        phi[top] = good + low * way
        hit = cut_at(world, kept, count, blade, now, phi[top], room)
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
    """Append what the edge cuts at phi[first:]; the stretches used, -1 without room."""
    room = Room(
        np.zeros((512, 7)),
        np.zeros(12),
        np.zeros((2, 12)),
        np.zeros((32, 3)),
        np.zeros(128, np.int64),
        np.zeros(128),
    )
    for i in range(first, len(phi)):
        used = put(hits, used, room, cut_at(world, kept, count, blade, now, phi[i], room), i)
        if used < 0:
            return -1
    return used


@leaf
def put(hits, used, room, hit, angle):
    """Append the stretches found at an angle; -1 without room."""
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
            e = hit_length(room, cut_at(world, kept, count, blade, now, a + share * wide, room))
            if abs(e - f) >= abs(g - e):
                high, g = share, e
            else:
                low, f = share, e
        for share in (low, high):
            phi[top] = a + share * wide
            used = put(hits, used, room, cut_at(world, kept, count, blade, now, phi[top], room), top)
            top += 1
    return used, top


@kernel
def enter(head, nodes, used, origin, cell, box, ends, radius, k) -> int:
    """Put sweep k into every cell of the plan that its box meets; nodes rows: sweep, next. -1: no room.

    ends (4,): x, y of a straight path, whose cells are tested by their distance to it; NaN for others.
    """
    nx, ny = head.shape
    i0 = min(max(int(np.floor((box[0] - origin[0]) / cell)), 0), nx)
    i1 = max(min(int(np.floor((box[3] - origin[0]) / cell)), nx - 1), -1)
    j0 = min(max(int(np.floor((box[1] - origin[1]) / cell)), 0), ny)
    j1 = max(min(int(np.floor((box[4] - origin[1]) / cell)), ny - 1), -1)
    straight = not np.isnan(ends[0])
    dx, dy = ends[2] - ends[0], ends[3] - ends[1]
    size = dx * dx + dy * dy
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            if straight:
                x, y = origin[0] + (i + 0.5) * cell - ends[0], origin[1] + (j + 0.5) * cell - ends[1]
                t = 0.0
                if size > 0.0:
                    t = min(max((x * dx + y * dy) / size, 0.0), 1.0)
                if np.sqrt((x - t * dx) ** 2 + (y - t * dy) ** 2) > radius + 0.70711 * cell:
                    continue
            if used >= len(nodes):
                return -1
            nodes[used, 0], nodes[used, 1] = k, head[i, j]
            head[i, j] = used
            used += 1
    return used


@kernel
def gather(head, nodes, origin, cell, box, region, stamp, mark, out) -> int:
    """Sweeps whose box meets a region (6,), into `out`; how many. stamp (n,) remembers who was seen."""
    nx, ny = head.shape
    i0 = min(max(int(np.floor((region[0] - origin[0]) / cell)), 0), nx)
    i1 = max(min(int(np.floor((region[3] - origin[0]) / cell)), nx - 1), -1)
    j0 = min(max(int(np.floor((region[1] - origin[1]) / cell)), 0), ny)
    j1 = max(min(int(np.floor((region[4] - origin[1]) / cell)), ny - 1), -1)
    n = 0
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            at = head[i, j]
            while at >= 0:
                k = nodes[at, 0]
                at = nodes[at, 1]
                if stamp[k] == mark:
                    continue
                stamp[k] = mark
                b = box[k]
                if (
                    b[0] <= region[3] and b[3] >= region[0] and b[1] <= region[4] and b[4] >= region[1]
                    and b[2] <= region[5] and b[5] >= region[2]
                ):  # fmt: skip
                    out[n] = k
                    n += 1
    return n


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
