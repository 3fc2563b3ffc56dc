"""Arrays in, arrays out; mm and s. No units, objects or exceptions."""

import numpy as np
from numpy.typing import NDArray

from vmachining.jit import kernel, leaf


@leaf
def junction_speeds(
    length: NDArray[np.float64],
    speed: NDArray[np.float64],
    acceleration: NDArray[np.float64],
    stop: NDArray[np.bool_],
    out: NDArray[np.float64],
) -> None:
    """Largest feasible speed at each of the n + 1 block borders, eq. (2). out[0] and out[n] are 0."""
    n = length.shape[0]
    out[0] = 0.0
    out[n] = 0.0
    for i in range(1, n):
        out[i] = 0.0 if stop[i - 1] else min(speed[i - 1], speed[i])
    for i in range(n):
        out[i + 1] = min(out[i + 1], np.sqrt(out[i] * out[i] + 2.0 * acceleration[i] * length[i]))
    for i in range(n - 1, -1, -1):
        out[i] = min(out[i], np.sqrt(out[i + 1] * out[i + 1] + 2.0 * acceleration[i] * length[i]))


@leaf
def accelerated_times(
    length: NDArray[np.float64],
    speed: NDArray[np.float64],
    acceleration: NDArray[np.float64],
    junction: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """Seconds per block with trapezoidal or triangular profiles, eqs. (3) and (4)."""
    for i in range(length.shape[0]):
        a, b, force = junction[i], junction[i + 1], acceleration[i]
        peak = min(speed[i], np.sqrt(force * length[i] + 0.5 * (a * a + b * b)))
        if peak <= 0.0:
            out[i] = 0.0
            continue
        ramps = (peak * peak - a * a + (peak * peak - b * b)) / (2.0 * force)
        steady = max(length[i] - ramps, 0.0)
        out[i] = (peak - a) / force + (peak - b) / force + steady / peak


@leaf
def nearest_turn(value: float, previous: float, lower: float, upper: float) -> float:
    """value + 2 pi k inside [lower, upper] that is nearest to `previous`; NaN if there is none."""
    turn = 2.0 * np.pi
    best = value + turn * np.round((previous - value) / turn)
    if best > upper:
        best -= turn * np.ceil((best - upper) / turn)
    elif best < lower:
        best += turn * np.ceil((lower - best) / turn)
    return best if lower <= best <= upper else np.nan


@kernel
def follow_branches(
    angles: NDArray[np.float64],
    allowed: NDArray[np.bool_],
    free: NDArray[np.bool_],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    previous: NDArray[np.float64],
    prefer: int,
    keep: bool,
    weight: float,
    out: NDArray[np.float64],
    branch: NDArray[np.int64],
) -> int:
    """Rotary values pose after pose; returns the first pose without an allowed solution, or -1.

    angles (n, 2, r), allowed (n, 2), free (n,): the first rotary axis is free. prefer: sign of the last rotary
    axis at pose 0, or 0 to start at `previous`. keep: stay on the branch of pose 0. The cost of a solution is
    the largest change of a rotary axis, plus `weight` times the sum of the changes.
    """
    n, _, r = angles.shape
    before = previous.copy()
    trial = np.empty(r)
    for k in range(n):
        best, chosen = np.inf, -1
        for s in range(2):
            if not allowed[k, s] or (keep and k > 0 and not free[k] and allowed[k, 1 - s] and s != branch[0]):
                continue
            largest, total, good = 0.0, 0.0, True
            for a in range(r):
                value = angles[k, s, a]
                if a == 0 and free[k]:
                    trial[a] = min(max(before[a], lower[a]), upper[a])
                else:
                    trial[a] = nearest_turn(value, before[a], lower[a], upper[a])
                if np.isnan(trial[a]):
                    good = False
                    break
                change = abs(trial[a] - before[a])
                largest, total = max(largest, change), total + change
            if not good:
                continue
            cost = largest + weight * total
            if k == 0 and prefer != 0 and r > 0 and trial[r - 1] * prefer < 0.0:
                cost += 1e9
            if cost < best:
                best, chosen = cost, s
                out[k] = trial
        if chosen < 0:
            return k
        branch[k] = chosen
        before[:] = out[k]
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


@leaf
def nearest_steps(corners: NDArray[np.int64], square: float, steps: NDArray[np.int8]) -> int:
    """Steps that each stay nearest to the circle of squared radius `square`; returns their number."""
    n = 0
    for leg in range(corners.shape[0] - 1):
        x, y = corners[leg, 0], corners[leg, 1]
        ex, ey = corners[leg + 1, 0], corners[leg + 1, 1]
        while x != ex or y != ey:
            sx = 0 if x == ex else (1 if ex > x else -1)
            sy = 0 if y == ey else (1 if ey > y else -1)
            bx, by = sx, sy
            if sx != 0 and sy != 0:
                best = abs((x + sx) ** 2 + (y + sy) ** 2 - square)
                one = abs((x + sx) ** 2 + y * y - square)
                other = abs(x * x + (y + sy) ** 2 - square)
                if one < best and one <= other:
                    by = 0
                elif other < best:
                    bx = 0
            x, y = x + bx, y + by
            steps[n, 0], steps[n, 1] = bx, by
            n += 1
    return n
