# What an edge cuts at one rotation angle: parts of its meridian, their chip and their extent.
#
# Legend: blade, now as in margin_kernels.py. Margin m of a point, mm: the least of its depth in the stock and of its signed
#   distances to the sweeps; a point that faces, N.V > 0, cuts where m > -TAU. Every distance changes by at most 1 mm per mm, so
#   zeros are interpolated between nodes. near, mode (count,): sweeps that may matter here; mode 1: the sweep ends at the tip,
#   2: it begins there. Such a sweep touches the tool all over; R N.V of its end, or -R N.V of its beginning, has its sign.
# values (VALUES,) of an angle: chip area and thickness per unit of the block, highest z, -lowest z, most to one side of the
#   feed and to the other, largest margin met.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.engagement.along.kernels.distance_kernels import (
    CIRCLE,
    EXACT,
    HELIX,
    POSES,
    Rows,
    at_pose,
    exact,
    gap,
    lower,
)
from vmachining.engagement.along.kernels.margin_kernels import (
    FAR,
    Blade,
    Room,
    World,
    box_gap,
    edge_point,
    into,
    mesh_gap,
)
from vmachining.engagement.along.kernels.stretch_kernels import below, facing, standing, under
from vmachining.engagement.along.kernels.tile_kernels import Tiles
from vmachining.jit import inner, leaf

TAU = 1e-9  # mm: a sweep that covers a point by less than this touches it
TOUCH_MM = 1e-4  # parts shorter than this are touches
GRAZING = 4e-4  # of what normals could enter: slower parts slide along a finished wall (0.023 degrees beside the feed)
VALUES = 7
AREA, THICK, DEPTH = 0, 1, 6
NODES = 96  # of a piece, at most
ARC, DISC, WALL, LEANING = (
    24,
    12,
    6,
    16,
)  # cells of a quarter of a circle, of lines, of lines on a tool that leans
THIN_MM, SHARE = (
    0.1,
    95,
)  # what is thinner than both, in mm and of a piece, may stand unseen beside something as near
SECANTS = 40
END_MM = 1e-6  # of a part
ON_MM = 1e-6  # from a surface that a node lies on
FLAT = 1e-3  # mm: sweeps that are farther than the bracket of an end by this do not end it
AWAY_MM = 0.02  # of material from an edge that is not looked at
DEEP = 5.0  # mm: margins are known up to this


class Work(NamedTuple):
    """Space of the kernels.

    x .. m : (NODES,). near, mode : see the legend. keep : of a piece, as places in `near`; low : (sweeps + 1,) see `margin_on`;
    few : of those what may end it in a bracket. part : (n, 3) piece, s0, s1; a full one may have left parts out, and is made
    larger.
    slot, seen : (sweeps,) place in `near`, and the stretch that saw a sweep last. clock : (3,) stretches so far, places in `near`
    that tiles know, stamp of the station.
    """

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    z: NDArray[np.float64]
    a: NDArray[np.float64]
    b: NDArray[np.float64]
    s: NDArray[np.float64]
    m: NDArray[np.float64]
    keep: NDArray[np.int64]
    low: NDArray[np.float64]
    few: NDArray[np.int64]
    near: NDArray[np.int64]
    mode: NDArray[np.int64]
    part: NDArray[np.float64]
    slot: NDArray[np.int64]
    seen: NDArray[np.int64]
    clock: NDArray[np.int64]


class Scene(NamedTuple):
    """Sweeps, their tiles, stock and edge of one station."""

    rows: Rows
    tiles: Tiles
    world: World
    blade: Blade
    work: Work
    room: Room


@leaf
def sided(q, mode, n_x, n_y, n_z):
    """Sign of the distance to a sweep that ends or begins at the tip, in mm."""
    size = q[16] + q[17]
    if mode == 1:
        return size * (n_x * q[23] + n_y * q[24] + n_z * q[25])
    return -size * (n_x * q[20] + n_y * q[21] + n_z * q[22])


@leaf
def around(kind, d, side):
    """Distance to a sweep at the tip: the sign of its end, unless the rest of a curved one comes back to the point."""
    return side if kind < CIRCLE or d > -1e-6 else min(side, d)


@leaf
def depth(kind, q, x, y, z):
    """How deep a point lies in a box or an upright cylinder, mm; negative outside."""
    if kind == 0:
        a, b = max(q[0] - x, x - q[3]), max(q[1] - y, y - q[4])
        c = max(q[2] - z, z - q[5])
        side = np.sqrt(max(a, 0.0) ** 2 + max(b, 0.0) ** 2)
        a = max(a, b)
    else:
        a, c = np.sqrt((x - q[0]) ** 2 + (y - q[1]) ** 2) - q[2], max(q[3] - z, z - q[4])
        side = max(a, 0.0)
    c0 = max(c, 0.0)
    return -np.sqrt(side * side + c0 * c0) - min(max(a, c), 0.0)


@inner
def place(scene, now, piece, s, sp, cp):
    """A point of the edge and its normal, (x, y, z, N)."""
    r, h, n_r, n_z = edge_point(scene.blade, piece, s)
    e_x, e_y, e_z = sp * now[12] + cp * now[15], sp * now[13] + cp * now[16], sp * now[14] + cp * now[17]
    return (
        now[0] + h * now[3] + r * e_x, now[1] + h * now[4] + r * e_y, now[2] + h * now[5] + r * e_z,
        n_r * e_x + n_z * now[3], n_r * e_y + n_z * now[4], n_r * e_z + n_z * now[5],
    )  # fmt: skip


@inner
def gap_of(scene, c, at, near, most):
    """Signed distance of a `place` to the sweep in `near` at c, or a number up to it: one that is above `near`, or `most`."""
    rows, x, y, z = scene.rows, at[0], at[1], at[2]
    k, mode = scene.work.near[c], scene.work.mode[c]
    kind = rows.kind[k]
    if mode != 0:
        side = sided(rows.num[k], mode, at[3], at[4], at[5])
        return around(kind, 0.0 if kind < CIRCLE else gap(rows.num, kind, k, x, y, z, FAR), side)
    if kind != EXACT:
        return gap(rows.num, kind, k, x, y, z, most)
    d = box_gap(rows.box[k], x, y, z)
    return d if d > near else exact(rows, scene.world, k, x, y, z, most, scene.room)


@inner
def margin_at(scene, now, count, most, piece, s, sp, cp):
    """m of one point of the edge against the first `count` sweeps of `few`, at most `most`; (m, sweeps nearer than that).

    These are the first of `few` afterwards: no other one comes to the surface within `most`.
    """
    world, work = scene.world, scene.work
    at = place(scene, now, piece, s, sp, cp)
    m, n = most, 0
    for i in range(count):
        c = work.few[i]
        d = gap_of(scene, c, at, most, most)
        if d < most or work.mode[c] != 0:
            work.few[n] = c
            n += 1
        m = min(m, d)
    if world.kind != 2:
        return min(m, depth(world.kind, world.stock, at[0], at[1], at[2])), n
    if m > -TAU and scene.room.last[1] > 0:
        m = min(m, -mesh_gap(world, at[0], at[1], at[2], scene.room))
    return m, n


@inner
def margin_on(scene, now, count, piece, s, sp, cp):
    """m of one point of the edge against `keep`, after points of smaller s; the nearest sweep comes first afterwards.

    work.low : distance + s where a sweep was asked last, at `count` that of the triangles: it falls by 1 mm per mm at most, and
    who cannot be nearest is not asked.
    """
    world, work = scene.world, scene.work
    at = place(scene, now, piece, s, sp, cp)
    m, first = DEEP, 0
    if world.kind != 2:
        m = min(m, depth(world.kind, world.stock, at[0], at[1], at[2]))
    for i in range(count):
        if work.low[i] - s > m:
            continue
        c = work.keep[i]
        d = gap_of(scene, c, at, m, DEEP)
        if work.mode[c] == 0:
            work.low[i] = d + s
        if d < m:
            m, first = d, i
    if count > 0:
        work.keep[0], work.keep[first] = work.keep[first], work.keep[0]
        work.low[0], work.low[first] = work.low[first], work.low[0]
    if world.kind == 2 and scene.room.last[1] > 0 and m > -TAU and work.low[count] - s <= m:
        d = -mesh_gap(world, at[0], at[1], at[2], scene.room)
        work.low[count] = d + s
        m = min(m, d)
    return m


@leaf
def all_few(work, count):
    """`few` becomes `keep`."""
    for i in range(count):
        work.few[i] = work.keep[i]


@leaf
def next_share(a, b, c, f, g, e, least):
    """Share of the way from a to b at which a function is asked next, whose sign changes between them (Chandrupatla 1997).

    f, g, e : values at a (asked last), b and c (asked before). The inverse parabola through the three where it is safe, else the
    middle. least : share of the bracket that is asked at least, from either end.
    """
    t = 0.5
    if c != b and e != g and f != e:
        xi, phi = (a - b) / (c - b), (f - g) / (e - g)
        if phi * phi < xi and (1.0 - phi) * (1.0 - phi) < 1.0 - xi:
            t = f / (g - f) * e / (g - e) + (c - a) / (b - a) * f / (e - f) * g / (e - g)
    return min(max(t, least), 1.0 - least)


@leaf
def root(scene, now, count, piece, sp, cp, a, b, f, g):
    """s where m crosses -TAU between a and b, among the first `count` of `few`; f, g : m at both.

    Where one end all but lies on a surface, a quarter of the cell from it comes first: a thin chip on a floor has its end there.
    """
    f, g = f + TAU, g + TAU
    t = min(max(f / (f - g), 0.05), 0.95)
    if min(abs(f), abs(g)) < ON_MM:
        t = 0.25 if abs(f) < abs(g) else 0.75
    for _ in range(SECANTS):
        s = a + t * (b - a)
        v, count = margin_at(scene, now, count, abs(b - a) + FLAT, piece, s, sp, cp)
        v += TAU
        if (v > 0.0) == (f > 0.0):
            c, e = a, f
        else:
            c, e, b, g = b, g, a, f
        a, f = s, v
        if abs(b - a) < END_MM or abs(v) < TAU:
            break
        t = next_share(a, b, c, f, g, e, 0.5 * END_MM / abs(b - a))
    return a if abs(f) < abs(g) else b


@leaf
def put(blade, part, now, piece, phi, c, a, b, parts, out):
    """Add a part to those of the angle, unless it is a touch; how many there are. c : m . (across the feed)."""
    if b - a <= TOUCH_MM or parts >= len(part):
        return parts
    q = blade.rows[piece]
    r0, z0, n0_r, n0_z = edge_point(blade, piece, a)
    r1, z1, n1_r, n1_z = edge_point(blade, piece, b)
    wide = max(r0, r1)
    if q[6] > 0.0:
        low, high = q[7] + (a - blade.joints[piece]) / q[6], q[7] + (b - blade.joints[piece]) / q[6]
        side = into(now, phi, q[4], q[5], 1.0, 0.0)
        over = into(now, phi, q[4], q[5], 0.0, 1.0)
        area = q[6] * (side * (np.sin(high) - np.sin(low)) - over * (np.cos(high) - np.cos(low)))
        best = min(max(np.arctan2(over, side), low), high)
        thick = side * np.cos(best) + over * np.sin(best)
        if low < 0.0 < high:
            wide = q[4] + q[6]
    else:
        f, g = into(now, phi, r0, z0, n0_r, n0_z), into(now, phi, r1, z1, n1_r, n1_z)
        area, thick = 0.5 * (f + g) * (b - a), max(f, g)
    part[parts, 0], part[parts, 1], part[parts, 2] = piece, a, b
    out[AREA] += max(area, 0.0)
    out[THICK] = max(out[THICK], thick)
    along = abs(now[3] * now[6] + now[4] * now[7] + now[5] * now[8])
    across = np.sqrt(max(now[6] ** 2 + now[7] ** 2 + now[8] ** 2 - along * along, 0.0))
    most = max(n0_r, n1_r) * across + max(abs(n0_z), abs(n1_z)) * along + wide * now[21]
    if thick >= GRAZING * most:
        out[2], out[3] = max(out[2], z1), max(out[3], -z0)
        near = min(r0, r1) if c < 0.0 else wide
        out[4] = max(out[4], near * c)
        near = wide if c < 0.0 else min(r0, r1)
        out[5] = max(out[5], -near * c)
    return parts + 1


@inner
def keep_near(scene, now, count, piece, a, b, sp, cp):
    """Leaves in `keep` what may end or cover the stretch; how many; -1 where one covers all of it, and how deep in m[0].

    room.last[1] : whether triangles of the stock may end it.
    """
    rows, world, work, room = scene.rows, scene.world, scene.work, scene.room
    at = place(scene, now, piece, 0.5 * (a + b), sp, cp)
    x, y, w = at[0], at[1], at[2]
    half, n = 0.5 * (b - a) + TAU, 0
    for i in range(count):
        c = work.keep[i]
        k = work.near[c]
        if work.mode[c] == 0:
            q = rows.box[k]
            if (
                q[0] - x > half or x - q[3] > half or q[1] - y > half or y - q[4] > half
                or q[2] - w > half or w - q[5] > half
            ):  # fmt: skip
                continue
            if rows.kind[k] == POSES and at_pose(rows.num[k], x, y, w, 0.5)[0] - rows.num[k, 34] > half:
                continue
            d = gap_of(scene, c, at, half + TAU, half + TAU)
            if d > half:
                continue
            if d < -half:
                work.m[0] = d
                return -1
        work.keep[n] = c
        n += 1
    if world.kind == 2:
        free = room.free  # no triangle comes into this sphere
        d = free[3]
        d -= np.copysign(np.sqrt((x - free[0]) ** 2 + (y - free[1]) ** 2 + (w - free[2]) ** 2), d)
        if abs(d) <= half or d * free[3] <= 0.0:
            d = mesh_gap(world, x, y, w, room)
            free[0], free[1], free[2], free[3] = x, y, w, d
        if d > half:
            work.m[0] = -d
            return -1
        room.last[1] = d > -half
    return n


@inner
def may_end(work, last, count, s, t):
    """Leaves in `few` who can come to the surface between s and t, both asked by `margin_on`; how many, and the old last[1]."""
    few, mesh = 0, last[1]
    for i in range(count):
        if work.low[i] <= 2.0 * t - s + FLAT:
            work.few[few] = work.keep[i]
            few += 1
    last[1] = mesh > 0 and work.low[count] <= 2.0 * t - s + FLAT
    return few, mesh


@leaf
def march(scene, now, count, piece, phi, across, span, parts, out):
    """Adds the parts between a and b among triangles and sweeps of any kind, which may stand in any number between.

    No step is longer than the margin at its beginning, which changes by 1 mm per mm at most, or what is taken to be thin.
    span : a, b, the shortest and the longest step. across : see `put`.
    """
    a, b, thin, longest = span
    sp, cp, work, last = np.sin(phi), np.cos(phi), scene.work, scene.room.last
    for i in range(count + 1):
        work.low[i] = -FAR
    f = margin_on(scene, now, count, piece, a, sp, cp)
    begin, s, before = a, a, f
    while s < b:
        t = min(s + min(max(abs(f), thin), longest), b)
        g = margin_on(scene, now, count, piece, t, sp, cp)
        if t < b:  # ends of a piece may lie on a floor at every angle
            out[DEPTH] = max(out[DEPTH], g)
        u, v = t, g
        hidden = t - s > max(abs(f) + abs(g), THIN_MM)  # a rib or a slot may stand between
        if hidden and (f > -TAU) == (g > -TAU) and max(abs(f), abs(g), abs(before)) > AWAY_MM:
            u = s + 0.5 * (t - s + abs(f) - abs(g))  # where steep sides of it meet
            few, mesh = may_end(work, last, count, s, t)
            v, _ = margin_at(scene, now, few, DEEP, piece, u, sp, cp)
            last[1] = mesh
            out[DEPTH] = max(out[DEPTH], min(v, t - s))
            if (v > -TAU) == (f > -TAU):
                u, v = t, g
        if (f > -TAU) != (v > -TAU):
            few, mesh = may_end(work, last, count, s, t)
            e = root(scene, now, few, piece, sp, cp, s, u, f, v)
            last[1] = mesh
            if f > -TAU:
                parts = put(scene.blade, scene.work.part, now, piece, phi, across, begin, e, parts, out)
            begin = e
            if u < t:
                few, mesh = may_end(work, last, count, s, t)
                e = root(scene, now, few, piece, sp, cp, u, t, v, g)
                last[1] = mesh
                if v > -TAU:
                    parts = put(scene.blade, scene.work.part, now, piece, phi, across, begin, e, parts, out)
                begin = e
        before, s, f = f, t, g
    if f > -TAU:
        parts = put(scene.blade, scene.work.part, now, piece, phi, across, begin, b, parts, out)
    return parts


@inner
def at_angle(scene, now, count, top, phi, aside, out):
    """Parts that cut at an angle, in work.part, and their values; how many parts.

    top : mm above the tip, no material is higher. aside (3,) : unit direction across axis and feed.
    """
    rows, world, blade, work, room = scene.rows, scene.world, scene.blade, scene.work, scene.room
    sp, cp = np.sin(phi), np.cos(phi)
    e_x, e_y, e_z = (
        sp * now[12] + cp * now[15],
        sp * now[13] + cp * now[16],
        sp * now[14] + cp * now[17],
    )
    across = e_x * aside[0] + e_y * aside[1] + e_z * aside[2]
    out[AREA], out[THICK], out[DEPTH] = 0.0, 0.0, -DEEP
    out[2], out[3], out[4], out[5] = -FAR, -FAR, -FAR, -FAR
    x, y, z, m = work.x, work.y, work.z, work.m
    parts, upright = 0, now[5] == 1.0 and now[21] == 0.0
    for piece in range(len(blade.rows)):
        q = blade.rows[piece]
        if q[1] > top:
            break
        a, b = facing(blade, now, piece, phi)
        b = below(blade, piece, top, b)
        if b - a <= TOUCH_MM:
            continue
        work.clock[0] += 1
        if upright:
            low, high, lack = standing(scene.tiles, blade, piece, now, e_x, e_y, a, b)
            if high - low > TOUCH_MM:
                a, b = low, high
            elif lack < -AWAY_MM:  # nearer than that ends of arcs are interpolated, and need true margins
                out[DEPTH] = max(out[DEPTH], lack)
                continue
        kept = under(scene.tiles, work, blade, piece, now, e_x, e_y, a, b)
        for c in range(work.clock[1], count):
            work.keep[kept] = c
            kept += 1
        kept = keep_near(scene, now, kept, piece, a, b, sp, cp)
        if kept < 0:
            out[DEPTH] = max(out[DEPTH], m[0])
            continue
        unknown, guided = world.kind == 2 and room.last[1] > 0, False
        for i in range(kept):
            kind = rows.kind[work.near[work.keep[i]]]
            unknown |= kind == EXACT
            guided |= kind == POSES
        if q[6] > 0.0:
            cells = int(np.ceil(ARC * (b - a) / (0.5 * np.pi * q[6]) - 1e-9))
        elif q[3] == q[1]:
            cells = DISC
        else:
            cells = WALL
        cells = min(max(cells, 4), NODES - 1)
        step = (b - a) / cells
        if unknown or guided:
            thin = min(THIN_MM, (b - a) / SHARE) if unknown else min(step, (b - a) / LEANING)
            longest = step if upright else 0.25 * (b - a)
            parts = march(scene, now, kept, piece, phi, across, (a, b, thin, longest), parts, out)
            continue
        flat = q[6] == 0.0
        n_r, n_z = (np.cos(q[7]), np.sin(q[7])) if flat else (0.0, 0.0)
        for i in range(cells + 1):
            s = a + i * step if i < cells else b
            if flat:
                share = (s - blade.joints[piece]) / (blade.joints[piece + 1] - blade.joints[piece])
                r, h = q[0] + share * (q[2] - q[0]), q[1] + share * (q[3] - q[1])
            else:
                beta = q[7] + (s - blade.joints[piece]) / q[6]
                n_r, n_z = np.cos(beta), np.sin(beta)
                r, h = q[4] + q[6] * n_r, q[5] + q[6] * n_z
            work.a[i], work.b[i], work.s[i] = n_r, n_z, s
            x[i] = now[0] + h * now[3] + r * e_x
            y[i] = now[1] + h * now[4] + r * e_y
            z[i] = now[2] + h * now[5] + r * e_z
            m[i] = DEEP  # triangles are farther than the stretch is long
            if world.kind != 2:
                m[i] = min(DEEP, depth(world.kind, world.stock, x[i], y[i], z[i]))
        for i in range(kept):
            k, mode = work.near[work.keep[i]], work.mode[work.keep[i]]
            kind = rows.kind[k]
            if mode == 0:
                lower(rows.num, kind, k, x, y, z, m, cells + 1)
                continue
            for j in range(cells + 1):
                n_r, n_z = work.a[j], work.b[j]
                side = sided(
                    rows.num[k], mode, n_r * e_x + n_z * now[3], n_r * e_y + n_z * now[4],
                    n_r * e_z + n_z * now[5],
                )  # fmt: skip
                d = 0.0
                if kind in (CIRCLE, HELIX):
                    d = gap(rows.num, kind, k, x[j], y[j], z[j], FAR)
                m[j] = min(m[j], around(kind, d, side))
        begin = work.s[0]
        for i in range(cells):
            f, g = m[i], m[i + 1]
            s, t = work.s[i], work.s[i + 1]
            if i > 0:  # ends of a piece may lie on a floor at every angle
                out[DEPTH] = max(out[DEPTH], f)
            if (f > -TAU) != (g > -TAU):
                all_few(work, kept)
                e = root(scene, now, kept, piece, sp, cp, s, t, f, g)
                if f > -TAU:
                    parts = put(blade, work.part, now, piece, phi, across, begin, e, parts, out)
                begin = e
            elif 0 < i < cells - 1:
                left, right = f - m[i - 1], m[i + 2] - g
                u = (g - right - f) / (left - right)  # of the cell, where both sides meet
                if 0.0 < u < 1.0 and (f + left * u > -TAU) != (f > -TAU):
                    middle = s + u * step
                    all_few(work, kept)
                    v, _ = margin_at(scene, now, kept, DEEP, piece, middle, sp, cp)
                    out[DEPTH] = max(out[DEPTH], v)
                    if (v > -TAU) != (f > -TAU):
                        all_few(work, kept)
                        e0 = root(scene, now, kept, piece, sp, cp, s, middle, f, v)
                        all_few(work, kept)
                        e1 = root(scene, now, kept, piece, sp, cp, middle, t, v, g)
                        if f > -TAU:
                            parts = put(blade, work.part, now, piece, phi, across, begin, e0, parts, out)
                            begin = e1
                        else:
                            parts = put(blade, work.part, now, piece, phi, across, e0, e1, parts, out)
        if m[cells] > -TAU:
            parts = put(blade, work.part, now, piece, phi, across, begin, work.s[cells], parts, out)
    return parts
