"""Arrays in, arrays out; mm and s. No units, objects or exceptions."""

import numpy as np
from numpy.typing import NDArray

from vmachining.jit import kernel, leaf

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]

TURN = 2.0 * np.pi

SAME = 1e-6
"""rad; angles of one pose that differ by less are one."""

FAR = 2**62

MOST_TURNS = 9
"""Turns of one axis at which a path may begin or continue after a jump; of longer travels every so many are tried."""


@leaf
def nearest_turn(value: float, previous: float, lower: float, upper: float) -> float:
    """value + 2 pi k inside [lower, upper] that is nearest to `previous`; NaN if none exists."""
    turn = 2.0 * np.pi
    best = value + turn * np.round((previous - value) / turn)
    if best > upper:
        best -= turn * np.ceil((best - upper) / turn)
    elif best < lower:
        best += turn * np.ceil((lower - best) / turn)
    return best if lower <= best <= upper else np.nan


@leaf
def offer(
    i: int, many: int, side: int, first: float, second: float, count: int, turned: float, origin: int,
    endless: Bools, place: Floats, sides: NDArray[np.int8], back: NDArray[np.int32], counts: Ints, length: Floats,
) -> int:  # fmt: skip
    """Note a way to a state of pose i if it is the first or the best; returns how many states there are.

    Whole turns of an axis without ends make no other state. Where there is no room the worst state gives way.
    """
    at, worst = -1, 0
    for k in range(many):
        a, b = first - place[i, k, 0], second - place[i, k, 1]
        if endless[0]:
            a -= TURN * np.round(a / TURN)
        if endless[1]:
            b -= TURN * np.round(b / TURN)
        if sides[i, k] == side and abs(a) < SAME and abs(b) < SAME:
            at = k
            break
        if counts[k] > counts[worst] or (counts[k] == counts[worst] and length[k] > length[worst]):
            worst = k
    if at < 0:
        at = worst
        if many < place.shape[1]:
            at, many = many, many + 1
            counts[at] = FAR
    if count < counts[at] or (count == counts[at] and turned < length[at]):
        place[i, at, 0], place[i, at, 1], sides[i, at] = first, second, side
        counts[at], length[at], back[i, at] = count, turned, origin
    return many


@leaf
def turns(value: float, lower: float, upper: float, near: float) -> tuple[float, float, int]:
    """First value, step and number of the turns of an angle that are tried: all inside its travel, of many every so many."""
    if not (np.isfinite(lower) and np.isfinite(upper)):
        return nearest_turn(value, near, lower, upper), TURN, 1
    least = np.ceil((lower - value) / TURN)
    count = int(np.floor((upper - value) / TURN) - least) + 1
    step = max((count + MOST_TURNS - 1) // MOST_TURNS, 1)
    return value + TURN * least, step * TURN, (count + step - 1) // step


@kernel
def least_jumps(
    angles: Floats, allowed: Bools, free: Bools, lower: Floats, upper: Floats, tool: Floats, price: Ints, start: Floats,
    given: bool, prefer: int, jump: float, ratio: float, weight: float, room: int, out: Floats, branch: Ints,
) -> int:  # fmt: skip
    """Angles (n, 2) with the cheapest jumps, of those with the least turning; returns the first pose without any, or -1.

    angles (n, 2, 2), allowed (n, 2) of both branches. free (n,): the first axis keeps its value. tool (n,) rad that the tool
    turns on the way to a pose. price (n,) of a jump there. start (2,): angles before the first pose, if given; else the
    sign of the second angle at the first pose is `prefer`, if not 0 and possible.
    """
    n = angles.shape[0]
    place, sides = np.empty((n, room, 2)), np.empty((n, room), np.int8)
    back = np.empty((n, room), np.int32)
    counts, length = np.empty(room, np.int64), np.empty(room)
    old_counts, old_length, old = np.zeros(room, np.int64), np.zeros(room), np.zeros((room, 2))
    endless = ~(np.isfinite(lower) & np.isfinite(upper))
    before, cheapest = 1, 0
    old[0] = start
    for i in range(n):
        many = 0
        entered = i == 0 and not given
        for wanted in range(2):  # a first pose without the wanted sign takes any
            if many > 0 or (wanted == 1 and not entered):
                break
            for j in range(before):
                for s in range(2):
                    if not allowed[i, s]:
                        continue
                    a, b = angles[i, s, 0], angles[i, s, 1]
                    near_a = old[j, 0] if free[i] else nearest_turn(a, old[j, 0], lower[0], upper[0])
                    near_b = nearest_turn(b, old[j, 1], lower[1], upper[1])
                    if not (np.isnan(near_a) or np.isnan(near_b) or entered):
                        da, db = abs(near_a - old[j, 0]), abs(near_b - old[j, 1])
                        most = max(da, db)
                        cost = price[i] if most > jump and most > ratio * tool[i] else 0
                        turned = old_length[j] + most + weight * (da + db)
                        many = offer(i, many, s, near_a, near_b, old_counts[j] + cost, turned, j,
                                     endless, place, sides, back, counts, length)  # fmt: skip
                    if old_counts[j] > cheapest and not entered:
                        continue  # a jump from the cheapest state is cheaper
                    first, step_a, count_a = turns(a, lower[0], upper[0], old[j, 0])
                    if free[i]:
                        first, count_a = old[j, 0], 1
                    second, step_b, count_b = turns(b, lower[1], upper[1], old[j, 1])
                    if np.isnan(first) or np.isnan(second):
                        continue
                    for ka in range(count_a):
                        for kb in range(count_b):
                            va, vb = first + ka * step_a, second + kb * step_b
                            if entered and wanted == 0 and vb * prefer < 0.0:
                                continue
                            da, db = abs(va - old[j, 0]), abs(vb - old[j, 1])
                            # a free start costs nothing; what is nearest to zero breaks ties
                            turned = old_length[j] + weight * (da + db) + (0.0 if entered else max(da, db))
                            cost = 0 if entered else price[i]
                            many = offer(i, many, s, va, vb, old_counts[j] + cost, turned, j,
                                         endless, place, sides, back, counts, length)  # fmt: skip
        if many == 0:
            return i
        before, cheapest = many, counts[:many].min()
        old_counts[:many], old_length[:many], old[:many] = counts[:many], length[:many], place[i, :many]
    k = 0
    for j in range(1, before):
        if old_counts[j] < old_counts[k] or (
            old_counts[j] == old_counts[k] and old_length[j] < old_length[k]
        ):
            k = j
    for i in range(n - 1, -1, -1):
        out[i], branch[i], k = place[i, k], sides[i, k], back[i, k]
    return -1


@leaf
def adds(missing: int, integrand: int) -> int:
    """How often an integrand must be added to fill what is missing in a register."""
    return (missing + integrand - 1) // integrand if integrand > 0 else 2**62


@leaf
def circular_dda(
    corners: NDArray[np.int64],
    capacity: int,
    tick: NDArray[np.int64],
    steps: NDArray[np.int8],
) -> tuple[int, int, int]:
    """Ticks with pulses of a circular DDA; returns (pulsing ticks, ticks, flushed pulses).

    corners (l + 1, 2): start, axis points passed, end, about the centre. Both registers start half full; Y adds
    the coordinate X that the same tick has already moved. Ticks without an overflow are taken at once.
    """
    qx = qy = capacity // 2
    n = j = flushed = 0
    for leg in range(corners.shape[0] - 1):
        x, y = corners[leg, 0], corners[leg, 1]
        dx, dy = corners[leg + 1, 0] - x, corners[leg + 1, 1] - y
        rx, ry = abs(dx), abs(dy)
        sx, sy = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
        while rx > 0 or ry > 0:
            px = py = 0
            if (rx == 0 and x == 0) or (ry == 0 and y == 0):
                # the axis that is left has no rate: send what is missing
                if ry > 0:
                    y, ry, py = y + sy, ry - 1, sy
                else:
                    x, rx, px = x + sx, rx - 1, sx
                flushed += 1
            else:
                idle = min(adds(capacity - qx, abs(y)), adds(capacity - qy, abs(x))) - 1
                qx, qy, j = qx + idle * abs(y), qy + idle * abs(x), j + idle
                qx += abs(y)
                if qx >= capacity:
                    qx -= capacity
                    if rx > 0:
                        x, rx, px = x + sx, rx - 1, sx
                qy += abs(x)
                if qy >= capacity:
                    qy -= capacity
                    if ry > 0:
                        y, ry, py = y + sy, ry - 1, sy
            if px != 0 or py != 0:
                tick[n], steps[n, 0], steps[n, 1] = j, px, py
                n += 1
            j += 1
    return n, j, flushed


@leaf
def quadrant_s1(
    radius: int,
    along_x: bool,
    out_x: int,
    out_y: int,
    capacity: int,
    ticks: int,
    tick: NDArray[np.int64],
    steps: NDArray[np.int8],
) -> int:
    """One quadrant as the engraver's listing draws it; returns the pulsing ticks.

    along_x: the quadrant starts moving along x, with its x integrand at the radius. Integrands follow the
    pulses of the pass before.
    """
    pkx, pky = (radius, 0) if along_x else (0, radius)
    sx, sy = (-1, 1) if along_x else (1, -1)
    qx = qy = dx = dy = n = 0
    j = -1
    while True:
        pkx += sx * dy
        pky += sy * dx
        idle = min(adds(capacity - qx, abs(pkx)), adds(capacity - qy, abs(pky))) - 1
        if j + idle + 1 >= ticks:
            return n
        qx, qy, j = qx + idle * abs(pkx), qy + idle * abs(pky), j + idle + 1
        qy += abs(pky)
        qx += abs(pkx)
        dx = dy = 0
        if qx >= capacity:
            qx -= capacity
            dx = 1
        if qy >= capacity:
            qy -= capacity
            dy = 1
        if dx or dy:
            tick[n], steps[n, 0], steps[n, 1] = j, dx * out_x, dy * out_y
            n += 1
