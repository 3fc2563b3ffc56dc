"""Arrays in, arrays out; mm and s. No units, objects or exceptions."""

import numpy as np
from numpy.typing import NDArray

from vmachining.jit import kernel


@kernel
def junction_speeds(
    length: NDArray[np.float64],
    speed: NDArray[np.float64],
    acceleration: float,
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
        out[i + 1] = min(out[i + 1], np.sqrt(out[i] * out[i] + 2.0 * acceleration * length[i]))
    for i in range(n - 1, -1, -1):
        out[i] = min(out[i], np.sqrt(out[i + 1] * out[i + 1] + 2.0 * acceleration * length[i]))


@kernel
def accelerated_times(
    length: NDArray[np.float64],
    speed: NDArray[np.float64],
    acceleration: float,
    junction: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:
    """Seconds per block with trapezoidal or triangular profiles, eqs. (3) and (4)."""
    for i in range(length.shape[0]):
        a, b = junction[i], junction[i + 1]
        peak = min(speed[i], np.sqrt(acceleration * length[i] + 0.5 * (a * a + b * b)))
        if peak <= 0.0:
            out[i] = 0.0
            continue
        ramps = (peak * peak - a * a + (peak * peak - b * b)) / (2.0 * acceleration)
        steady = max(length[i] - ramps, 0.0)
        out[i] = (peak - a) / acceleration + (peak - b) / acceleration + steady / peak


@kernel
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
