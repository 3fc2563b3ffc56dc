"""Arrays in, arrays out. No units, objects or exceptions."""

import numpy as np
from numpy.typing import NDArray

from vmachining.jit import kernel


@kernel
def bisect(
    request: NDArray[np.float64],
    offset: NDArray[np.int64],
    active: NDArray[np.bool_],
    n_min: NDArray[np.int64],
    tau: float,
    first: NDArray[np.bool_],
) -> None:
    """Mark in `first` (m,) where leaves begin, eq. (5). `first` arrives False.

    request : (m,) clamped feeds of the samples. offset : (n + 1,). active : (n,) blocks that may be divided.
    n_min : (n,) fewest samples of a leaf.
    """
    lo = np.empty(128, np.int64)
    hi = np.empty(128, np.int64)
    for k in range(offset.shape[0] - 1):
        if offset[k] == offset[k + 1]:
            continue
        first[offset[k]] = True
        if not active[k]:
            continue
        lo[0], hi[0] = offset[k], offset[k + 1]
        top = 1
        while top > 0:
            top -= 1
            a, b = lo[top], hi[top]
            if b - a < 2 * n_min[k]:
                continue
            least, most = request[a], request[a]
            for j in range(a + 1, b):
                least = min(least, request[j])
                most = max(most, request[j])
            if most <= least * (1.0 + tau):
                continue
            # halves of the local index range, as if every block began at 0
            middle = offset[k] + (a + b - 2 * offset[k]) // 2
            first[middle] = True
            lo[top], hi[top] = a, middle
            lo[top + 1], hi[top + 1] = middle, b
            top += 2
