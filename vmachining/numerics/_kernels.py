# Intervals on a line. No units, no objects.

from vmachining.jit import leaf


@leaf
def slab(o, u, k, lo, hi, a, b):
    """Clip [a, b] to lo <= o_k + s u_k <= hi; empty is a > b."""
    if u[k] == 0.0:
        if lo <= o[k] <= hi:
            return a, b
        return 1.0, 0.0
    p, q = (lo - o[k]) / u[k], (hi - o[k]) / u[k]
    return max(a, min(p, q)), min(b, max(p, q))


@leaf
def insert(lo, hi, n, a, b, merge):
    """Add [a, b] to n sorted intervals more than `merge` apart; new n, or -1 when the arrays are full."""
    i = 0
    while i < n and hi[i] < a - merge:
        i += 1
    j = i
    while j < n and lo[j] <= b + merge:
        a, b = min(a, lo[j]), max(b, hi[j])
        j += 1
    if i == j:
        if n == len(lo):
            return -1
        for k in range(n, i, -1):
            lo[k], hi[k] = lo[k - 1], hi[k - 1]
        lo[i], hi[i] = a, b
        return n + 1
    lo[i], hi[i] = a, b
    for k in range(j, n):
        lo[i + 1 + k - j], hi[i + 1 + k - j] = lo[k], hi[k]
    return n - (j - i) + 1
