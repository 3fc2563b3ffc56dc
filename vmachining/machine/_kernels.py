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
