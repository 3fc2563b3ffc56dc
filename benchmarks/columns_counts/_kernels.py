# Lower surfaces of sweeps by a search along the path, and what a block takes from columns of the stock. Shares no code
# with any engine.
#
# Legend. cutters[c] = (tan of the bottom, radius where it ends, centre r, z and radius of the corner, radius and height where
# the corner ends, slope of the flank, largest radius): the tip is at the origin.
# moves[k] = (kind, start x, y, z, end or centre x, y, z, angle, rise, cutter), box[k] = (x0, y0, x1, y1) of its footprint.
# kind LINE, or 0, 1, 2: an arc about x, y, z.

import numpy as np

from vmachining.jit import kernel, leaf

LINE = -1.0
GOLDEN = 0.5 * (np.sqrt(5.0) - 1.0)
HALVINGS = 46  # of the golden section: 2e-10 of what is searched
STEP = 1.0 / 40.0  # rad between poses of an arc, or a quarter of the cutter's radius if that is less


@leaf
def under(cutters, c, r):
    """Height of the lower surface of a cutter above its tip."""
    if r <= cutters[c, 1]:
        return r * cutters[c, 0]
    if r <= cutters[c, 5]:
        return cutters[c, 3] - np.sqrt(max(cutters[c, 4] ** 2 - (r - cutters[c, 2]) ** 2, 0.0))
    return cutters[c, 6] + (r - cutters[c, 5]) * cutters[c, 7]


@leaf
def height(cutters, moves, k, x, y, t):
    """Height over a place of the cutter at the share t of its way; infinite beside it."""
    kind, c = moves[k, 0], int(moves[k, 9])
    if kind == LINE:
        px = moves[k, 1] + t * (moves[k, 4] - moves[k, 1])
        py = moves[k, 2] + t * (moves[k, 5] - moves[k, 2])
        pz = moves[k, 3] + t * (moves[k, 6] - moves[k, 3])
    else:
        cos, sin = np.cos(t * moves[k, 7]), np.sin(t * moves[k, 7])
        ax, ay, az = moves[k, 1] - moves[k, 4], moves[k, 2] - moves[k, 5], moves[k, 3] - moves[k, 6]
        px, py, pz, up = moves[k, 1], moves[k, 2], moves[k, 3], t * moves[k, 8]
        if kind == 2.0:
            px, py, pz = moves[k, 4] + cos * ax - sin * ay, moves[k, 5] + sin * ax + cos * ay, pz + up
        elif kind == 1.0:
            pz, px, py = moves[k, 6] + cos * az - sin * ax, moves[k, 4] + sin * az + cos * ax, py + up
        else:
            py, pz, px = moves[k, 5] + cos * ay - sin * az, moves[k, 6] + sin * ay + cos * az, px + up
    r = np.sqrt((x - px) ** 2 + (y - py) ** 2)
    return pz + under(cutters, c, r) if r <= cutters[c, 8] else np.inf


@leaf
def least(cutters, moves, k, x, y, lo, hi):
    """Least height between two shares of the way, by golden section."""
    left, right = hi - GOLDEN * (hi - lo), lo + GOLDEN * (hi - lo)
    low, high = height(cutters, moves, k, x, y, left), height(cutters, moves, k, x, y, right)
    for _ in range(HALVINGS):
        if low < high:
            hi, right, high = right, left, low
            left = hi - GOLDEN * (hi - lo)
            low = height(cutters, moves, k, x, y, left)
        else:
            lo, left, low = left, right, high
            right = lo + GOLDEN * (hi - lo)
            high = height(cutters, moves, k, x, y, right)
    return min(min(low, high), height(cutters, moves, k, x, y, 0.5 * (lo + hi)))


@leaf
def _rim(cutters, moves, k, x, y, over, beside):
    """Where between two shares of the way, at one of which the cutter is over a place, it is so no more."""
    for _ in range(HALVINGS):
        t = 0.5 * (over + beside)
        if height(cutters, moves, k, x, y, t) < np.inf:
            over = t
        else:
            beside = t
    return over


@leaf
def _around(cutters, moves, k, x, y, t, lo, hi):
    """Least height near a share t of the way at which the cutter is over the place."""
    if height(cutters, moves, k, x, y, lo) == np.inf:
        lo = _rim(cutters, moves, k, x, y, t, lo)
    if height(cutters, moves, k, x, y, hi) == np.inf:
        hi = _rim(cutters, moves, k, x, y, t, hi)
    ends = min(height(cutters, moves, k, x, y, lo), height(cutters, moves, k, x, y, hi))
    return min(ends, least(cutters, moves, k, x, y, lo, hi))


@leaf
def lowest(cutters, moves, k, x, y):
    """Lower surface of a sweep over a place."""
    R = cutters[int(moves[k, 9]), 8]
    if moves[k, 0] == LINE:
        dx, dy = moves[k, 4] - moves[k, 1], moves[k, 5] - moves[k, 2]
        px, py, q = x - moves[k, 1], y - moves[k, 2], dx * dx + dy * dy
        if q == 0.0:
            return min(height(cutters, moves, k, x, y, 0.0), height(cutters, moves, k, x, y, 1.0))
        h, square = (px * dx + py * dy) / q, (px * px + py * py - R * R) / q
        if h * h < square:
            return np.inf
        root = np.sqrt(h * h - square)
        lo, hi = max(h - root, 0.0), min(h + root, 1.0)
        if lo > hi:
            return np.inf
        f = least(cutters, moves, k, x, y, lo, hi)
        return min(f, min(height(cutters, moves, k, x, y, lo), height(cutters, moves, k, x, y, hi)))
    kind, angle = moves[k, 0], abs(moves[k, 7])
    ax, ay, az = moves[k, 1] - moves[k, 4], moves[k, 2] - moves[k, 5], moves[k, 3] - moves[k, 6]
    if kind == 2.0:
        r = np.sqrt(ax * ax + ay * ay)
    elif kind == 1.0:
        r = np.sqrt(ax * ax + az * az)
    else:
        r = np.sqrt(ay * ay + az * az)
    n = 2 + int(angle / min(STEP, 0.25 * R / np.sqrt(r * r + (moves[k, 8] / angle) ** 2)))
    best, before, here = np.inf, np.inf, height(cutters, moves, k, x, y, 0.0)
    for i in range(n + 1):  # every pose that is no higher than its neighbours
        after = height(cutters, moves, k, x, y, (i + 1.0) / n) if i < n else np.inf
        best = min(best, here)
        if here < before and here <= after:
            lo, hi = max(i - 1.0, 0.0) / n, min(i + 1.0, n) / n
            best = min(best, _around(cutters, moves, k, x, y, i / n, lo, hi))
        before, here = here, after
    # poses right above and below the place, or nearest to it: the only ones where the tool is narrow
    way = 1.0 if moves[k, 7] > 0.0 else -1.0
    for side in range(2):
        if kind == 2.0:
            a = np.arctan2(y - moves[k, 5], x - moves[k, 4]) - np.arctan2(ay, ax)
        elif kind == 1.0:
            a = np.arcsin(min(max((x - moves[k, 4]) / r, -1.0), 1.0))
            a = (a if side == 0 else np.pi - a) - np.arctan2(ax, az)
        else:
            a = np.arccos(min(max((y - moves[k, 5]) / r, -1.0), 1.0))
            a = (a if side == 0 else -a) - np.arctan2(az, ay)
        t = (way * a) % (2.0 * np.pi) / angle
        if t <= 1.0 and height(cutters, moves, k, x, y, t) < np.inf:
            lo, hi = max(t - 1.0 / n, 0.0), min(t + 1.0 / n, 1.0)
            best = min(best, _around(cutters, moves, k, x, y, t, lo, hi))
    return best


@kernel
def taken(
    cutters: np.ndarray, moves: np.ndarray, box: np.ndarray, k: int, bottom: float, places: np.ndarray,
    top: np.ndarray, depth: np.ndarray,
) -> None:  # fmt: skip
    """Length that move k takes of the column over each place (n, 2), where the stock is as high as `top`; k = the number of
    moves: what all take together."""
    everything = k == len(moves)
    for i in range(len(places)):
        x, y = places[i, 0], places[i, 1]
        depth[i] = 0.0
        f = bottom if everything else max(lowest(cutters, moves, k, x, y), bottom)
        if f >= top[i]:
            continue
        left = top[i]
        for j in range(k):
            if x < box[j, 0] or y < box[j, 1] or x > box[j, 2] or y > box[j, 3]:
                continue
            left = min(left, lowest(cutters, moves, j, x, y))
            if left <= f:
                break
        depth[i] = top[i] - max(left, bottom) if everything else max(left - f, 0.0)
