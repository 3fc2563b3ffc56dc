# Contact over one turn at a station: which angles are asked, where arcs end, where values are largest.
#
# Legend: see edge_kernels.py. Turn: phi (n,) rad as asked; order: rising; values, parts, count of each. A level or rising feed
#   faces only within 90 degrees of its direction: then the angles are a chain whose ends are known, else they close to a ring.
# result (COLUMNS,): area, thickness per unit of the block, ae, ap, fraction of the turn, planned fraction.
# past: the Turn at the end of the motion before, at whose tip this one begins. It took all but what faced it there, which are its
#   parts: a new direction cuts what faces it of these.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.engagement.along.kernels.edge_kernels import (
    AREA,
    DEPTH,
    THICK,
    VALUES,
    at_angle,
    cleared,
    next_share,
    put,
)
from vmachining.engagement.along.kernels.margin_kernels import FAR, turned
from vmachining.engagement.along.kernels.point_kernels import TAU
from vmachining.engagement.along.kernels.stretch_kernels import facing
from vmachining.jit import leaf, within

DEGREE = np.pi / 180.0
GRID = 36  # angles of a turn, through the feed
STEP = 2.0 * np.pi / GRID
QUARTER_GRID = GRID // 4
QUARTER = 0.5 * np.pi
SEEN, LARGEST, PLAN = 0, 1, 2  # what gaps are divided for, see `share_of`
SEEK, ROUNDS, PLANS, ENDS = 2, 8, 3, 30  # times at most; ends of arcs are narrowed
NARROW = np.radians(0.1)  # intervals are not halved below this
MORE, MORE_MM = 1e-3, 0.004  # of the largest, and mm: what a maximum between two angles must promise
BENT = 4.0  # times as much at one end of a gap as at the other is smooth
END_RAD = 2e-5
SAME_RAD = 1e-9
TOUCH_RAD = 1e-4  # less than this of a turn is a line along which tool and wall touch
PLANNED = 0.01  # of the largest chip
CLOSE = np.radians(0.5)  # angles where the chip passes it are not asked in gaps below this
ROOM = 400  # angles of a turn at most
COLUMNS = 6
BESIDE = (0.03 * DEGREE, 0.6 * DEGREE, 3.0 * DEGREE)  # beside the ends of what a feed faces
END, NEAR_END = QUARTER - 0.5 * BESIDE[0], 1.001 * BESIDE[2]  # angles beyond the first do not count


class Turn(NamedTuple):
    """Angles of a station. phi (ROOM,), order (ROOM,), value (ROOM, VALUES), part (ROOM, n, 3), found (ROOM,) parts, most.

    Set where another motion may begin: known (3,): angles, 1 if they close to a ring, motion; ahead (1,): rad, its direction.
    """

    phi: NDArray[np.float64]
    order: NDArray[np.int64]
    value: NDArray[np.float64]
    part: NDArray[np.float64]
    found: NDArray[np.int64]
    most: NDArray[np.float64]
    known: NDArray[np.int64]
    ahead: NDArray[np.float64]


@leaf
def ask(scene, turn, now, count, top, aside, phi, n):
    """Look at one more angle; n + 1."""
    turn.phi[n] = phi
    found = at_angle(scene, now, count, top, phi, aside, turn.value[n])
    for i in range(found):
        for c in range(3):
            turn.part[n, i, c] = scene.work.part[i, c]
    return noted(turn, n, found)


@leaf
def noted(turn, n, found):
    """Count of the parts of angle n; n + 1."""
    turn.found[n] = found
    if found > 0:
        for v in range(VALUES):
            turn.most[v] = max(turn.most[v], turn.value[n, v])
    return n + 1


@leaf
def again(scene, turn, past, now, aside, tol, phi, i, n):
    """Angle i of `past`, which is phi, becomes angle n; n + 1."""
    out, parts, known = turn.value[n], 0, -1
    way = turned(now, phi, aside)
    cleared(out)
    turn.phi[n], out[DEPTH] = phi, past.value[i, DEPTH]
    a = b = 0.0
    for k in range(past.found[i]):
        piece = int(past.part[i, k, 0])
        if piece != known:
            a, b = facing(scene.blade, piece, way, now[19])
            known = piece
        low, high = max(a, past.part[i, k, 1]), min(b, past.part[i, k, 2])
        parts = put(scene.blade, turn.part[n], now, piece, way, low, high, tol, parts, out)
    return noted(turn, n, parts)


@leaf
def around(phi):
    """The same angle within half a turn of 0."""
    return phi - 2.0 * np.pi * np.rint(phi / (2.0 * np.pi))


@leaf
def carried(scene, turn, past, now, aside, tol, middle, ring):
    """Angles of `past` that may face, and those beside the ends of what faces, to be asked, where the former do not end before;
    (angles, ring)."""
    n, before, closed = 0, past.known[0], past.known[1] > 0
    first, least, last, phi = 0, FAR, -1, 0.0
    for at in range(before if closed or not ring else 0):
        lead = around(past.phi[past.order[at]] - middle)
        if (ring or lead > -END) and lead < least:
            first, least = at, lead
    for step in range(before):
        at = (first + step) % before
        i = past.order[at]
        phi += (past.phi[i] - past.phi[past.order[at - 1 if at > 0 else before - 1]]) % (2.0 * np.pi)
        if step == 0:
            phi = middle + around(past.phi[i] - middle)
        lead, off = around(phi - middle), abs(abs(around(phi - past.ahead[0])) - QUARTER)
        if not ring and abs(lead) >= END:
            continue
        # what was asked beside the ends of the direction before stands too near to others to see a maximum between them
        if closed and SAME_RAD < off < NEAR_END and abs(abs(lead) - QUARTER) > NEAR_END:
            continue
        turn.order[n], last = n, at
        n = again(scene, turn, past, now, aside, tol, phi, i, n)
    for side in range(2 if n > 0 else 0):
        for beside in BESIDE:
            phi, at, begin = (
                middle + (beside - QUARTER if side == 0 else QUARTER - beside),
                n,
                turn.phi[turn.order[0]],
            )
            if ring and not closed:
                phi = begin + (phi - begin) % (2.0 * np.pi)
            while at > 0 and turn.phi[turn.order[at - 1]] > phi + SAME_RAD:
                at -= 1
            asked = closed or (at < n if ring else first > 0 if side == 0 else last < before - 1)
            if asked and (at == 0 or phi - turn.phi[turn.order[at - 1]] > SAME_RAD):
                turn.phi[n], turn.found[n] = phi, -1
                insert(turn, at, n)
                n += 1
    return n, ring and closed


@leaf
def insert(turn, at, n):
    """Angle n comes at position `at` of the order, of n before."""
    for i in range(n, at, -1):
        turn.order[i] = turn.order[i - 1]
    turn.order[at] = n


@leaf
def deep(turn, i):
    """Margin of an angle: positive where it cuts, negative where it does not."""
    d = turn.value[i, DEPTH] + TAU
    return max(d, 1e-12) if turn.found[i] > 0 else min(d, -1e-12)


@leaf
def gap_after(turn, at, n):
    """rad from the angle at a position to the next one."""
    wide = turn.phi[turn.order[at + 1 if at + 1 < n else 0]] - turn.phi[turn.order[at]]
    return wide if wide >= 0.0 else wide + 2.0 * np.pi


@within
def narrowed(scene, turn, now, count, top, aside, at, n, wide):
    """Asks angles until the end of an arc between positions at and at + 1 is known; how many angles there are."""
    i, j = turn.order[at], turn.order[(at + 1) % n]
    base, cuts = turn.phi[i], turn.found[i] > 0
    a, b, f, g = 0.0, wide, deep(turn, i), deep(turn, j)
    low, high = a, b
    t = min(max(f / (f - g), 0.1), 0.9)
    for _ in range(ENDS):
        if high - low < END_RAD or n >= ROOM - 1:
            break
        x = a + t * (b - a)
        n = ask(scene, turn, now, count, top, aside, base + x, n)
        v = deep(turn, n - 1)
        insert(turn, at + 1, n - 1)
        if (turn.found[n - 1] > 0) == cuts:
            low = x
            at += 1
        else:
            high = x
        if (v > 0.0) == (f > 0.0):
            c, e = a, f
        else:
            c, e, b, g = b, g, a, f
        a, f = x, v
        t = next_share(a, b, c, f, g, e, 0.25 * END_RAD / max(high - low, 1e-300))
    return n


@within
def with_ends(scene, turn, now, count, top, aside, n, ring):
    """Narrows the ends of all arcs; how many angles there are."""
    at = 0
    while at < (n if ring else n - 1):
        i, j = turn.order[at], turn.order[(at + 1) % n]
        before, wide = n, gap_after(turn, at, n)
        if (turn.found[i] > 0) != (turn.found[j] > 0) and wide > END_RAD:
            n = narrowed(scene, turn, now, count, top, aside, at, n, wide)
        at += 1 + n - before
    return n


@leaf
def promised(turn, h, i, j, k, wh, wide, wk):
    """Share of the way from i to j where a maximum may exceed what is known, 0 if none may: values continue as they do beside the
    interval, by its width there at most. Where they bend as much at i as at j they do so until both sides meet, elsewhere a jump
    may be anywhere."""
    for v in range(6):
        a, b = turn.value[i, v], turn.value[j, v]
        before, after = turn.value[h, v] if h >= 0 else -FAR, turn.value[k, v] if k >= 0 else -FAR
        enough = turn.most[v] + (MORE * turn.most[v] if v <= THICK else MORE_MM)
        up, on, down = (a - before) / wh, (b - a) / wide, (b - after) / wk
        first, last = (up - on) / (wh + wide), (on + down) / (wide + wk)  # how far values bend at i and j
        if (
            min(before, after) > -FAR
            and min(first, last) > 0.0
            and max(first, last) < BENT * min(first, last)
        ):
            x = (on + down) * wide / (up + down)
            if a + up * x > enough:
                return min(max(x / wide, 0.1), 0.9)
            continue
        end = a + up * min(wide, wh)
        if before > -FAR and end > enough and (end > b or k < 0):
            return 0.5
        end = b + down * min(wide, wk)
        if after > -FAR and end > max(enough, a):
            return 0.5
    return 0.0


@leaf
def rises(turn, at, n, ring, wide):
    """Whether margins of angles that cut nothing rise from both sides into the gap after a position, and meet above zero."""
    if not ring and (at == 0 or at + 2 >= n):
        return False
    h, i = turn.order[(at - 1) % n], turn.order[at]
    j, k = turn.order[(at + 1) % n], turn.order[(at + 2) % n]
    if turn.found[i] > 0 or turn.found[j] > 0:
        return False
    a, b = turn.value[i, DEPTH], turn.value[j, DEPTH]
    left = (a - turn.value[h, DEPTH]) / max(gap_after(turn, (at - 1) % n, n), 1e-9)
    right = (b - turn.value[k, DEPTH]) / max(gap_after(turn, (at + 1) % n, n), 1e-9)
    if left <= 0.0 or right <= 0.0:
        return False
    x = (b - a + right * wide) / (left + right)
    return 0.0 < x < wide and a + left * x > 0.0


@leaf
def share_of(turn, at, n, ring, wide, what):
    """Share of the gap after a position where an angle is worth asking, 0 if none: what hides there, largest values, or where the
    chip passes what is `PLANNED`."""
    i, j = turn.order[at], turn.order[at + 1 if at + 1 < n else 0]
    if what == SEEN:
        idle = turn.most[DEPTH] == -FAR
        return 0.5 if wide > NARROW and (idle or rises(turn, at, n, ring, wide)) else 0.0
    if what == PLAN:
        least, a, b = PLANNED * turn.most[AREA], turn.value[i, AREA], turn.value[j, AREA]
        if wide <= CLOSE or (a > least) == (b > least):
            return 0.0
        return min(max((np.sqrt(least) - np.sqrt(a)) / (np.sqrt(b) - np.sqrt(a)), 0.1), 0.9)
    if turn.found[i] == 0 or turn.found[j] == 0 or wide <= NARROW:
        return 0.0
    before, after = at - 1 if at > 0 else n - 1, at + 1 if at + 1 < n else 0
    h = turn.order[before] if ring or at > 0 else -1
    k = turn.order[after + 1 if after + 1 < n else 0] if ring or at + 2 < n else -1
    h = h if h >= 0 and turn.found[h] > 0 else -1
    k = k if k >= 0 and turn.found[k] > 0 else -1
    wh, wk = gap_after(turn, before, n), gap_after(turn, after, n)
    return promised(turn, h, i, j, k, max(wh, 1e-9), wide, max(wk, 1e-9))


@within
def divide(scene, turn, now, count, top, aside, n, ring, what, rounds):
    """Asks an angle in every gap where `share_of` finds one worth asking, a number of times; how many angles there are."""
    asked = 0
    for _ in range(rounds):
        at, known, asked = 0, asked, n
        while at < (n if ring else n - 1) and n < ROOM - 1:
            h, i = turn.order[at - 1 if at > 0 else n - 1], turn.order[at]
            j, k = (
                turn.order[at + 1 if at + 1 < n else at + 1 - n],
                turn.order[at + 2 if at + 2 < n else at + 2 - n],
            )
            wide, share = gap_after(turn, at, n), 0.0
            if max(max(h, i), max(j, k)) >= known:  # since it was looked at
                share = share_of(turn, at, n, ring, wide, what)
            if share > 0.0:
                n = ask(scene, turn, now, count, top, aside, turn.phi[turn.order[at]] + share * wide, n)
                insert(turn, at + 1, n - 1)
                at += 1
            at += 1
        if n == asked:
            break
    return n


@leaf
def over_turn(turn, n, ring, least):
    """rad of a turn where the chip area exceeds `least`; with least below 0 where anything is cut."""
    total = 0.0
    for at in range(n if ring else n - 1):
        i, j = turn.order[at], turn.order[(at + 1) % n]
        wide = gap_after(turn, at, n)
        ci, cj = turn.found[i] > 0, turn.found[j] > 0
        if not ci and not cj:
            continue
        if ci and cj:
            a, b = turn.value[i, AREA], turn.value[j, AREA]
        else:
            f, g = deep(turn, i), deep(turn, j)
            wide *= f / (f - g) if ci else g / (g - f)
            a, b = (turn.value[i, AREA], 0.0) if ci else (0.0, turn.value[j, AREA])
        if least < 0.0 or (a > least and b > least):
            total += wide
        elif a > least or b > least:
            total += wide * (max(a, b) - least) / abs(a - b)
    if not ring:  # from the last angles to where facing ends
        for i in (turn.order[0], turn.order[n - 1]):
            if turn.found[i] > 0 and (least < 0.0 or turn.value[i, AREA] > least):
                total += BESIDE[0]
    return 2.0 * np.pi if total > 2.0 * np.pi * (1.0 - 1e-12) else total


@leaf
def turn_at(scene, turn, past, now, count, top, tol, result):
    """Contact over one turn of a tool; (angles, whether they close to a ring). tol : see `put`, of all sweeps."""
    turn.most[:] = -FAR
    result[:] = 0.0
    v_a = now[3] * now[6] + now[4] * now[7] + now[5] * now[8]
    right = now[6] * now[12] + now[7] * now[13] + now[8] * now[14]
    ahead = now[6] * now[15] + now[7] * now[16] + now[8] * now[17]
    across = np.sqrt(right * right + ahead * ahead)
    axial = across <= 1e-9 * max(np.sqrt(across * across + v_a * v_a), 1e-300)
    aside = scene.room.p
    aside[:] = 0.0
    if axial:
        result[2] = np.nan
        middle = 0.0
    else:
        middle = np.arctan2(right, ahead)
        aside[0] = now[4] * now[8] - now[5] * now[7]
        aside[1] = now[5] * now[6] - now[3] * now[8]
        aside[2] = now[3] * now[7] - now[4] * now[6]
        size = np.sqrt(aside[0] ** 2 + aside[1] ** 2 + aside[2] ** 2)
        for c in range(3):
            aside[c] /= size
    a_x, a_y, a_z = aside[0], aside[1], aside[2]
    way = (a_x, a_y, a_z)
    ring = axial or now[21] > 0.0 or v_a < 0.0 or not scene_convex(scene)
    n = 0
    if axial or past.known[0] > ROOM - 2 * len(BESIDE):
        past.known[0] = 0
    turn.ahead[0] = middle
    if past.known[0] > 0:
        n, ring = carried(scene, turn, past, now, way, tol, middle, ring)
    else:
        for i in range(-QUARTER_GRID, 3 * QUARTER_GRID + 1 if ring else QUARTER_GRID + 1):
            for c in range(len(BESIDE) if abs(i) == QUARTER_GRID and not axial else 0):
                beside = BESIDE[c] if i < 0 else -BESIDE[len(BESIDE) - 1 - c]
                turn.phi[n], n = middle + i * STEP + beside, n + 1
            if i > -QUARTER_GRID and (ring or i < QUARTER_GRID):
                turn.phi[n], n = middle + i * STEP, n + 1
        for i in range(n):
            turn.order[i], turn.found[i] = i, -1
    for i in range(n):
        if turn.found[i] < 0:
            ask(scene, turn, now, count, top, way, turn.phi[i], i)
    if past.known[0] == 0:
        n = divide(scene, turn, now, count, top, way, n, ring, SEEN, SEEK)
    if turn.most[DEPTH] == -FAR:
        return n, ring
    n = with_ends(scene, turn, now, count, top, way, n, ring)
    n = divide(scene, turn, now, count, top, way, n, ring, LARGEST, ROUNDS)
    n = divide(scene, turn, now, count, top, way, n, ring, PLAN, PLANS)
    n = with_ends(scene, turn, now, count, top, way, n, ring)  # of gaps found between
    arcs = over_turn(turn, n, ring, -1.0)
    if arcs < TOUCH_RAD:
        for i in range(n):
            turn.found[i] = 0
        return n, ring
    most = turn.most
    result[0], result[1] = max(most[AREA], 0.0), max(most[THICK], 0.0)
    if not axial:
        result[2] = max(most[4] + most[5], 0.0)
    result[3] = max(most[2] + most[3], 0.0)
    result[4] = min(arcs / (2.0 * np.pi), 1.0)
    result[5] = min(over_turn(turn, n, ring, PLANNED * result[0]) / (2.0 * np.pi), result[4])
    return n, ring


@leaf
def scene_convex(scene):
    """Whether no normal of the edge points up: then a level or rising feed faces within 90 degrees of its direction only."""
    for piece in range(len(scene.blade.rows)):
        if scene.blade.rows[piece, 8] > 1e-9 and scene.blade.rows[piece, 0] > 0.0:
            return False
    return True
