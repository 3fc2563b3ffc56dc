# What an edge cuts at one rotation angle: parts of its meridian, their chip and their extent.
#
# Legend: see point_kernels.py. values (VALUES,) of an angle: chip area and thickness per unit of the block, highest z, -lowest
#   z, most to one side of the feed and to the other, largest margin met.

import numpy as np

from vmachining.engagement.along.kernels.distance_kernels import (
    CIRCLE,
    EXACT,
    LANES,
    POSES,
    gap,
    lower,
    midway,
    touch,
)
from vmachining.engagement.along.kernels.margin_kernels import FAR, edge_point, into, mesh_depth, turned
from vmachining.engagement.along.kernels.point_kernels import (
    DEEP,
    FLAT,
    NODES,
    TAU,
    around,
    depth,
    gap_of,
    margin_at,
    margin_on,
    may_end,
    place,
    sided,
)
from vmachining.engagement.along.kernels.stretch_kernels import (
    below,
    facing,
    following,
    looked,
    spaced,
    standing,
    under,
)
from vmachining.jit import inner, leaf

TOUCH_MM = 1e-4  # parts shorter than this are touches
GRAZING = 4e-4  # of what normals could enter: slower parts slide along a finished wall (0.023 degrees beside the feed)
VALUES = 7
AREA, THICK, DEPTH = 0, 1, 6
# cells: quarter of a circle, of lines, of lines on a tool that leans
ARC, DISC, WALL, LEANING = 24, 12, 6, 16
# what is thinner than both, mm and of a piece, may stand unseen beside what is as near
THIN_MM, SHARE = 0.1, 95
SECANTS = 40
END_MM = 1e-6  # of a part
STRAIGHT_MM = 1e-4  # this near to the end of a part margins are straight
ON_MM = 1e-6  # from a surface that a node lies on
SURE = 0.1  # of how far distances bend in a cell, how well a parabola knows where they turn
CURVED = 0.02  # of a cell, how far distances to sweeps are from linear there
AWAY_MM = 0.02  # of material from an edge that is not looked at


@leaf
def few_of_cell(work, count, i, most):
    """`few` becomes those of `keep` whose distances at the nodes i and i + 1 are `most` together; how many."""
    few = 0
    for k in range(count):
        if work.gaps[k, i] + work.gaps[k, i + 1] <= most:
            work.few[few] = work.keep[k]
            few += 1
    return few


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
def root(scene, now, count, piece, way, a, b, f, g):
    """s where m crosses -TAU between a and b, among the first `count` of `few`; f, g : m at both.

    Where one end all but lies on a surface, a quarter of the cell from it comes first: a thin chip on a floor has its end there.
    """
    f, g = f + TAU, g + TAU
    t = min(max(f / (f - g), 0.05), 0.95)
    if min(abs(f), abs(g)) < ON_MM:
        t = 0.25 if abs(f) < abs(g) else 0.75
    for _ in range(SECANTS):
        s = a + t * (b - a)
        v, count = margin_at(scene, now, count, abs(b - a) + FLAT, piece, s, way)
        v += TAU
        straight = min(abs(f), abs(g)) > ON_MM and abs(v) * abs(b - a) < STRAIGHT_MM * abs(g - f)
        if (v > 0.0) == (f > 0.0):
            c, e = a, f
        else:
            c, e, b, g = b, g, a, f
        a, f = s, v
        if straight or abs(b - a) < END_MM or abs(v) < TAU:
            break
        t = next_share(a, b, c, f, g, e, 0.5 * END_MM / abs(b - a))
    return a + (b - a) * f / (f - g)


@leaf
def cleared(out):
    """Values of an angle that cuts nothing."""
    out[AREA], out[THICK], out[DEPTH] = 0.0, 0.0, -DEEP
    out[2], out[3], out[4], out[5] = -FAR, -FAR, -FAR, -FAR


@leaf
def put(blade, part, now, piece, way, a, b, tol, parts, out):
    """Add a part to those of the angle, unless it is a touch; how many there are.

    tol : depth up to which sweeps do not cover. Of an arc that slides along a floor 2 sqrt(2 r tol) lie in it, where N.V / |V| is
    below sqrt(2 tol / r); what is twice as long and twice as steep is cut.
    """
    q, c = blade.rows[piece], way[5]
    if b - a <= TOUCH_MM or parts >= len(part):
        return parts
    r0, z0, n0_r, n0_z = edge_point(blade, piece, a)
    r1, z1, n1_r, n1_z = edge_point(blade, piece, b)
    wide = max(r0, r1)
    if q[6] > 0.0:
        side, over = into(way, q[4], q[5], 1.0, 0.0), into(way, q[4], q[5], 0.0, 1.0)
        area = q[6] * (side * (n1_z - n0_z) - over * (n1_r - n0_r))
        thick = max(side * n0_r + over * n0_z, side * n1_r + over * n1_z)
        if (
            over * n0_r > side * n0_z and over * n1_r < side * n1_z
        ):  # rises at its beginning, falls at its end
            thick = np.sqrt(side * side + over * over)
        if b - a <= 6.0 * np.sqrt(q[6] * tol) and thick <= 3.0 * np.sqrt(tol / q[6]) * now[18]:
            return parts
        if n0_z < 0.0 < n1_z:
            wide = q[4] + q[6]
    else:
        f, g = into(way, r0, z0, n0_r, n0_z), into(way, r1, z1, n1_r, n1_z)
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
def keep_near(scene, now, count, piece, a, b, way):
    """Leaves in `keep` what may end or cover the stretch; how many; -1 where one covers all of it, and how deep in m[0].

    work.low : what `margin_on` may know of them before; the one that is nearest to the middle of the stretch comes first.
    room.last[1] : whether triangles of the stock may end it.
    """
    rows, world, work, room = scene.rows, scene.world, scene.work, scene.room
    at = place(scene, now, piece, 0.5 * (a + b), way)
    x, y, w = at[0], at[1], at[2]
    half, n, nearest = 0.5 * (b - a) + TAU, 0, FAR
    for i in range(count):
        c = work.keep[i]
        k, low = work.near[c], -FAR
        if work.mode[c] == 0:
            q = rows.box[k]
            if (
                q[0] - x > half or x - q[3] > half or q[1] - y > half or y - q[4] > half
                or q[2] - w > half or w - q[5] > half
            ):  # fmt: skip
                continue
            if rows.kind[k] == POSES:
                low = midway(rows.num[k], x, y, w) - rows.num[k, 34]
            if low < -half and rows.kind[k] > CIRCLE:
                low = gap_of(scene, c, at, half + TAU, half + TAU)
            if low > half:
                continue
            if -FAR < low < -half:
                work.m[0] = low
                return -1
        work.keep[n], work.low[n] = c, low - half + a  # at a; from there on it falls by no more than the way
        if -FAR < low < nearest:
            nearest = low
            work.keep[n], work.keep[0] = work.keep[0], work.keep[n]
            work.low[n], work.low[0] = work.low[0], work.low[n]
        n += 1
    room.last[1] = 0
    if world.kind == 2:
        free = room.free  # no triangle comes into this sphere
        d = free[3]
        d -= np.copysign(np.sqrt((x - free[0]) ** 2 + (y - free[1]) ** 2 + (w - free[2]) ** 2), d)
        if abs(d) <= half or d * free[3] <= 0.0:
            d = -mesh_depth(world, x, y, w, FAR, -FAR, room)
            free[0], free[1], free[2], free[3] = x, y, w, d
        if d > half:
            work.m[0] = -d
            return -1
        room.last[1] = d > -half
        work.low[n] = a - half - d
    return n


@leaf
def crossing(scene, now, count, piece, way, ends, parts, out):
    """Adds the part that ends between s and t, if m is positive at s; the s where m crosses, and how many parts there are.

    ends : where the part begins, s, t, m at both; the s that `margin_on` was asked last; tol see `put`.
    """
    begin, s, t, f, g, asked, tol = ends
    few, mesh = may_end(scene.work, scene.room, count, s, asked)
    e = root(scene, now, few, piece, way, s, t, f, g)
    scene.room.last[1] = mesh
    if f > -TAU:
        parts = put(scene.blade, scene.work.part, now, piece, way, begin, e, tol, parts, out)
    return e, parts


@leaf
def march(scene, now, count, piece, way, span, parts, out):
    """Adds the parts between a and b among triangles and sweeps of any kind, which may stand in any number between.

    No step is longer than the margin at its beginning, which changes by 1 mm per mm at most, or what is taken to be thin.
    span : a, b, what is thin where triangles are nearer than that, elsewhere, the longest step; tol see `put`.
    """
    a, b, thin, rough, longest, tol = span
    work, last = scene.work, scene.room.last
    f = margin_on(scene, now, count, piece, a, way, longest, rough)
    begin, s, before = a, a, f
    while s < b:
        least = min(rough, max(thin, work.low[count] - s)) if last[1] > 0 else rough
        t = min(s + min(max(abs(f), least), longest), b)
        g = margin_on(scene, now, count, piece, t, way, longest, rough)
        if t < b:  # ends of a piece may lie on a floor at every angle
            out[DEPTH] = max(out[DEPTH], g)
        u, v = t, g
        hidden = t - s > max(abs(f) + abs(g), THIN_MM)  # a rib or a slot may stand between
        if hidden and (f > -TAU) == (g > -TAU) and max(abs(f), abs(g), abs(before)) > AWAY_MM:
            u = s + 0.5 * (t - s + abs(f) - abs(g))  # where steep sides of it meet
            few, mesh = may_end(work, scene.room, count, s, t)
            v, _ = margin_at(scene, now, few, DEEP, piece, u, way)
            last[1] = mesh
            out[DEPTH] = max(out[DEPTH], min(v, t - s))
            if (v > -TAU) == (f > -TAU):
                u, v = t, g
        if (f > -TAU) != (v > -TAU):
            begin, parts = crossing(scene, now, count, piece, way, (begin, s, u, f, v, t, tol), parts, out)
            if u < t:
                ends = (begin, u, t, v, g, t, tol)
                begin, parts = crossing(scene, now, count, piece, way, ends, parts, out)
        before, s, f = f, t, g
    if f > -TAU:
        parts = put(scene.blade, scene.work.part, now, piece, way, begin, b, tol, parts, out)
    return parts


@leaf
def deepest(kind, q, x, y, z, n, m, out):
    """m and `out` of the first n nodes become how deep they lie in the stock; triangles are farther than the stretch is long."""
    for i in range(n):
        out[i] = min(DEEP, depth(kind, q, x[i], y[i], z[i])) if kind != 2 else DEEP
        m[i] = out[i]


@leaf
def lower_tip(scene, c, i, way, now, n):
    """`lower` for a sweep at the tip, at place i of `keep`."""
    rows, work = scene.rows, scene.work
    k, mode, m, gaps = work.near[c], work.mode[c], work.m, work.gaps
    q, kind = rows.num[k], rows.kind[k]
    side, over = sided(q, mode, way[0], way[1], way[2]), sided(q, mode, now[3], now[4], now[5])
    for j in range(n):
        d = side * work.n_r[j] + over * work.n_z[j]
        if kind >= CIRCLE:
            d = around(kind, gap(rows.num, kind, k, work.x[j], work.y[j], work.z[j], FAR), d)
        gaps[i, j] = d
        if d < m[j]:
            m[j], work.who[j] = d, i


@leaf
def turning(row, i, cells, step, sharp):
    """Share of a cell where the distance to a sweep turns, and the distance there; 0 if nowhere.

    By the parabola through the nodes or, with a corner, where the lines through those on either side meet.
    """
    a, b, bend, n = row[i], row[i + 1], 0.0, 0
    left = a - row[i - 1] if i > 0 else -step
    right = row[i + 2] - b if i + 2 <= cells else step
    if sharp:
        u = (b - right - a) / (left - right)
        return (u, a + left * u) if 0.0 < u < 1.0 else (0.0, a)
    if i > 0:
        bend, n = b - a - left, 1
    if i + 2 <= cells:
        bend, n = bend + right - b + a, n + 1
    bend /= n
    u = 0.5 - (b - a) / bend
    return (u, a + (b - a) * u - 0.5 * bend * u * (1.0 - u)) if 0.0 < u < 1.0 else (0.0, a)


@leaf
def hidden(work, i, cells, step, kept, bulge, sharp):
    """Where in a cell something may hide that both ends do not show, 0 if nothing may, and the largest margin there, or -DEEP.

    Where neither end cuts, and each for another sweep: where the distances to both are the same. Where both ends cut, but a sweep
    is so near that it may cover what lies between (or both lie in one that may leave it): where its distance turns. Elsewhere
    where margins meet that continue as they do in the cells beside. bulge : how far a smooth distance may lie from its chord in
    a cell. sharp : whether some are not smooth.
    """
    m, s, who, gaps = work.m, work.s[i], work.who, work.gaps
    f, g = m[i], m[i + 1]
    if f <= -TAU and who[i] != who[i + 1]:
        if f + g < -step:  # margins rise by no more than the way
            return 0.0, -DEEP
        a, b = gaps[int(who[i]), i + 1], gaps[int(who[i + 1]), i]
        if a > f and b > g:
            u = (b - f) / (a - f + b - g)
            most = f + (a - f) * u
            return (s + u * step, -DEEP) if most > -CURVED * step else (0.0, most)
    elif f <= -TAU and max(f, g) > -bulge:
        u, d = turning(gaps[int(who[i])], i, cells, step, False)
        if u > 0.0 and d > -SURE * bulge:
            return s + u * step, -DEEP
    elif f > -TAU and (f + g < step if sharp else min(f, g) < bulge):
        share, least = 0.0, SURE * bulge
        for k in range(kept):
            a, b = gaps[k, i], gaps[k, i + 1]
            for corner in range(2):
                if (min(a, b) < bulge) if corner == 0 else (sharp and a + b < step):
                    u, d = turning(gaps[k], i, cells, step, corner == 1)
                    if u > 0.0 and d < least:
                        share, least = u, d
        if share > 0.0:
            return s + share * step, -DEEP
    if 0 < i < cells - 1:
        left, right = f - m[i - 1], m[i + 2] - g
        u = (g - right - f) / (left - right)
        if 0.0 < u < 1.0 and (f + left * u > -TAU) != (f > -TAU):
            return s + u * step, -DEEP
    return 0.0, -DEEP


@inner
def at_angle(scene, now, count, top, phi, aside, out):
    """Parts that cut at an angle, in work.part, and their values; how many parts.

    top : mm above the tip, no material is higher. aside (3,) : unit direction across axis and feed.
    """
    rows, world, blade, work, room = scene.rows, scene.world, scene.blade, scene.work, scene.room
    way = turned(now, phi, aside)
    e_x, e_y, e_z = way[0], way[1], way[2]
    cleared(out)
    x, y, z, m, who = work.x, work.y, work.z, work.m, work.who
    parts, upright = 0, now[5] == 1.0 and now[21] == 0.0
    for piece in range(len(blade.rows)):
        q = blade.rows[piece]
        if q[1] > top:
            break
        a, b = facing(blade, piece, way, now[19])
        b = below(blade, piece, top, b)
        if b - a <= TOUCH_MM:
            continue
        work.clock[0] += 1
        looks = -1
        if upright:
            low, high, lack, looks = standing(scene.tiles, work.tile, blade, piece, now, e_x, e_y, a, b)
            if high - low > TOUCH_MM:
                a, b = low, high
            elif lack < -AWAY_MM:  # nearer than that ends of arcs are interpolated, and need true margins
                out[DEPTH] = max(out[DEPTH], lack)
                continue
            else:
                looks = -1
        if looks < 0:
            looks = looked(scene.tiles, work, blade, piece, now, e_x, e_y, a, b)
        kept = under(scene.tiles, work, looks)
        for c in range(work.clock[1], count):
            work.keep[kept] = c
            kept += 1
        kept = keep_near(scene, now, kept, piece, a, b, way)
        if kept < 0:
            out[DEPTH] = max(out[DEPTH], m[0])
            continue
        unknown, guided, tol = False, room.last[1] > 0, TAU
        for i in range(0 if work.clock[3] > 0 else kept):
            k = work.near[work.keep[i]]
            unknown |= rows.kind[k] == EXACT
            guided |= rows.kind[k] == POSES
            tol = max(tol, TAU + touch(rows, world, k))
        if q[6] > 0.0:
            cells = int(np.ceil(ARC * (b - a) / (0.5 * np.pi * q[6]) - 1e-9))
        elif q[3] == q[1]:
            cells = DISC
        else:
            cells = WALL
        cells = min(max(cells, 4), NODES - 1)
        step = (b - a) / cells
        if unknown or guided:
            rough, thin = step if upright else min(step, (b - a) / LEANING), min(THIN_MM, (b - a) / SHARE)
            if unknown:
                rough = thin
            longest = step if upright else 0.25 * (b - a)
            parts = march(scene, now, kept, piece, way, (a, b, thin, rough, longest, tol), parts, out)
            continue
        at, apart = spaced(blade, piece, a, b, cells)
        for i in range(cells + 1):
            work.s[i] = a + i * step if i < cells else b
            x[i] = now[0] + at[1] * now[3] + at[0] * e_x
            y[i] = now[1] + at[1] * now[4] + at[0] * e_y
            z[i] = now[2] + at[1] * now[5] + at[0] * e_z
            work.n_r[i], work.n_z[i] = at[2], at[3]
            at = following(q, at, apart)
        full = -(-(cells + 1) // LANES) * LANES
        for i in range(full):
            who[i], j = kept, min(i, cells)
            x[i], y[i], z[i], work.n_r[i], work.n_z[i] = x[j], y[j], z[j], work.n_r[j], work.n_z[j]
        deepest(world.kind, world.stock, x, y, z, full, m, work.gaps[kept])
        round_, sharp = FAR, False
        for i in range(kept):
            c = work.keep[i]
            k = work.near[c]
            r = rows.num[k, 17]
            sharp |= r < step
            round_ = min(round_, r if r > 0.0 else rows.num[k, 16])
            if work.mode[c] == 0:
                lower(rows.num, rows.kind[k], k, x, y, z, m, who, float(i), full, work.gaps[i], step)
            else:
                lower_tip(scene, c, i, way, now, full)
        bulge = 0.125 * step * step * (1.0 / round_ + (1.0 / q[6] if q[6] > 0.0 else 0.0))
        begin = work.s[0]
        for i in range(cells):
            f, g = m[i], m[i + 1]
            s, t = work.s[i], work.s[i + 1]
            if i > 0:  # ends of a piece may lie on a floor at every angle
                out[DEPTH] = max(out[DEPTH], f)
            if (f > -TAU) != (g > -TAU):
                few = few_of_cell(work, kept, i, step + FLAT)
                e = root(scene, now, few, piece, way, s, t, f, g)
                if f > -TAU:
                    parts = put(blade, work.part, now, piece, way, begin, e, tol, parts, out)
                begin = e
            else:
                middle, most = hidden(work, i, cells, step, kept, bulge, sharp)
                out[DEPTH] = max(out[DEPTH], most)
                if middle > s:
                    few = few_of_cell(work, kept, i, FAR)
                    v, few = margin_at(scene, now, few, DEEP, piece, middle, way)
                    out[DEPTH] = max(out[DEPTH], v)
                    if (v > -TAU) != (f > -TAU):
                        e0 = root(scene, now, few, piece, way, s, middle, f, v)
                        few = few_of_cell(work, kept, i, step + FLAT)
                        e1 = root(scene, now, few, piece, way, middle, t, v, g)
                        if f > -TAU:
                            parts = put(blade, work.part, now, piece, way, begin, e0, tol, parts, out)
                            begin = e1
                        else:
                            parts = put(blade, work.part, now, piece, way, e0, e1, tol, parts, out)
        if m[cells] > -TAU:
            parts = put(blade, work.part, now, piece, way, begin, work.s[cells], tol, parts, out)
    return parts
