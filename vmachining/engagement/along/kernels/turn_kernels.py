# Contact over one turn at a station: which angles are asked, where arcs end, where values are largest.
#
# Legend: see edge_kernels.py. Turn: phi (n,) rad as asked; order: rising; values, parts, count of each. A level or rising feed
#   faces only within 90 degrees of its direction: then the angles are a chain whose ends are known, else they close to a ring.
# result (COLUMNS,): area, thickness per unit of the block, ae, ap, fraction of the turn, planned fraction.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.engagement.along.kernels.edge_kernels import (
    AREA,
    DEPTH,
    TAU,
    THICK,
    VALUES,
    at_angle,
    next_share,
)
from vmachining.engagement.along.kernels.margin_kernels import FAR
from vmachining.jit import leaf

DEGREE = np.pi / 180.0
GRID = 36  # angles of a turn, through the feed
STEP = 2.0 * np.pi / GRID
QUARTER = 0.5 * np.pi
ROUNDS, ENDS = 6, 30  # times that intervals are halved for maxima, and that an end is narrowed, at most
NARROW = np.radians(0.1)  # intervals are not halved below this
MORE, MORE_MM = 1e-3, 0.002  # of the largest, and mm: what a maximum between two angles must promise
END_RAD = 1e-5
TOUCH_RAD = 1e-4  # less than this of a turn is a line along which tool and wall touch
PLANNED = 0.01  # of the largest chip
ROOM = 400  # angles of a turn at most
SEEK = 2  # times that all gaps are halved before a turn is called idle
COLUMNS = 6
BESIDE = (0.03 * DEGREE, 0.6 * DEGREE, 3.0 * DEGREE)  # beside the ends of what a feed faces


class Turn(NamedTuple):
    """Angles of a station. phi (ROOM,), order (ROOM,), value (ROOM, VALUES), part (ROOM, n, 3), found (ROOM,) parts, most."""

    phi: NDArray[np.float64]
    order: NDArray[np.int64]
    value: NDArray[np.float64]
    part: NDArray[np.float64]
    found: NDArray[np.int64]
    most: NDArray[np.float64]


@leaf
def ask(scene, turn, now, count, top, aside, phi, n):
    """Look at one more angle; n + 1."""
    turn.phi[n] = phi
    found = at_angle(scene, now, count, top, phi, aside, turn.value[n])
    turn.found[n] = found
    for i in range(found):
        for c in range(3):
            turn.part[n, i, c] = scene.work.part[i, c]
    if found > 0:
        for v in range(VALUES):
            turn.most[v] = max(turn.most[v], turn.value[n, v])
    return n + 1


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


@leaf
def promises(turn, h, i, j, k, wh, wide, wk):
    """Whether a maximum between i and j may exceed what is known: values continue as they do beside the interval."""
    for v in range(6):
        a, b = turn.value[i, v], turn.value[j, v]
        most = turn.most[v]
        least = MORE * most if v <= THICK else MORE_MM
        if h >= 0:
            rise = (a - turn.value[h, v]) * min(wide / wh, 1.0)
            if a + rise > most + least and (a + rise > b or k < 0):
                return True
        if k >= 0:
            rise = (b - turn.value[k, v]) * min(wide / wk, 1.0)
            if b + rise > most + least and b + rise > a:
                return True
    return False


@leaf
def gap_after(turn, at, n):
    """rad from the angle at a position to the next one."""
    return (turn.phi[turn.order[(at + 1) % n]] - turn.phi[turn.order[at]]) % (2.0 * np.pi)


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
def turn_at(scene, turn, now, count, top, result):
    """Contact over one turn of a tool; (angles, whether they close to a ring)."""
    turn.most[:] = -FAR
    result[:] = 0.0
    v_a = now[3] * now[6] + now[4] * now[7] + now[5] * now[8]
    right = now[6] * now[12] + now[7] * now[13] + now[8] * now[14]
    ahead = now[6] * now[15] + now[7] * now[16] + now[8] * now[17]
    across = np.sqrt(right * right + ahead * ahead)
    axial = across <= 1e-9 * max(np.sqrt(across * across + v_a * v_a), 1e-300)
    aside = scene.room.p
    for c in range(3):
        aside[c] = 0.0
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
    if not axial:
        for i in range(len(BESIDE)):
            n = ask(scene, turn, now, count, top, way, middle - QUARTER + BESIDE[i], n)
    for i in range(-8, 9):
        n = ask(scene, turn, now, count, top, way, middle + i * STEP, n)
    if not axial:
        for i in range(len(BESIDE) - 1, -1, -1):
            n = ask(scene, turn, now, count, top, way, middle + QUARTER - BESIDE[i], n)
    if ring:
        for i in range(9, 28):
            n = ask(scene, turn, now, count, top, way, middle + i * STEP, n)
    engaged = 0
    for i in range(n):
        turn.order[i] = i
        engaged += turn.found[i] > 0
    for _ in range(SEEK):  # a rib narrower than the gaps
        at = 0
        while engaged == 0 and at < (n if ring else n - 1) and n < ROOM - 1:
            i, wide = turn.order[at], gap_after(turn, at, n)
            if wide > NARROW:
                n = ask(scene, turn, now, count, top, way, turn.phi[i] + 0.5 * wide, n)
                insert(turn, at + 1, n - 1)
                engaged += turn.found[n - 1] > 0
                at += 1
            at += 1
    if engaged == 0:
        return n, ring
    at = 0
    while at < (n if ring else n - 1):
        i, j = turn.order[at], turn.order[(at + 1) % n]
        if (turn.found[i] > 0) != (turn.found[j] > 0):
            before = n
            n = narrowed(scene, turn, now, count, top, way, at, n, gap_after(turn, at, n))
            at += n - before
        at += 1
    for _ in range(ROUNDS):
        at, asked = 0, n
        while at < (n if ring else n - 1) and n < ROOM - 1:
            i, j = turn.order[at], turn.order[(at + 1) % n]
            wide = gap_after(turn, at, n)
            if turn.found[i] > 0 and turn.found[j] > 0 and wide > NARROW:
                h = turn.order[(at - 1) % n] if ring or at > 0 else -1
                k = turn.order[(at + 2) % n] if ring or at + 2 < n else -1
                h = h if h >= 0 and turn.found[h] > 0 else -1
                k = k if k >= 0 and turn.found[k] > 0 else -1
                wh = gap_after(turn, (at - 1) % n, n) if h >= 0 else 1.0
                wk = gap_after(turn, (at + 1) % n, n) if k >= 0 else 1.0
                if promises(turn, h, i, j, k, max(wh, 1e-9), wide, max(wk, 1e-9)):
                    n = ask(scene, turn, now, count, top, way, turn.phi[i] + 0.5 * wide, n)
                    insert(turn, at + 1, n - 1)
                    at += 1
            at += 1
        if n == asked:
            break
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
