# What one sweep takes below another, where their surfaces cross in a cell.
#
# Legend. b a smooth surface below the top, or the top; j any sweep. f_b lies between its tangent plane and that plane raised
# by `over`. Where f_j is no higher than the plane it is below f_b; f_j is convex, so these places are a convex set, and the
# polygon D of corners of the cell and points of its edges that are in it lies within. Beyond D, j lies below b no more than
# the raised plane lies over a plane of R1 that touches j at the middle of the border of D. E, lines, P, W: see sides.py.

import numpy as np

from vmachining.engines.columns.closed._kernels import both_lower, posed
from vmachining.engines.columns.patches._kernels import FOUR, RECT, clip, room
from vmachining.engines.columns.sides import DOWN, FIRST, PART, SELF, SMOOTH, TOP, UP
from vmachining.engines.columns.smooth._kernels import above, bends, positive
from vmachining.engines.columns.surface._kernels import height, lean_at, local, poses, surface
from vmachining.jit import leaf

INSIDE, HERE, BEYOND = np.int64(1), np.int64(2), np.int64(3)  # polygons
NONE = np.int64(-1)
NEAR = 1e-2  # of an edge of the cell: the crossing is found so well
OVER = np.int64(15)  # column of W: how far j lies over the plane at a corner


@leaf
def _reach(head, part, c, lines, j, v, gx, gy, x, y, ax, ay, bx, by, fa, fb):
    """A share of the way from a to b up to which f_j is no higher than a plane: there at a, not at b."""
    low, high = 0.0, 1.0
    for k in range(16):
        t = 0.5 * (low + high)
        if k % 2 == 0 and fb < 1e29:
            t = low + max(-fa / (fb - fa), 0.5 * NEAR) * (high - low)
        px, py = ax + t * (bx - ax), ay + t * (by - ay)
        f = height(head, part, c, lines, j, x + px, y + py) - v - gx * px - gy * py
        if f <= 0.0:
            low, fa = t, f
        else:
            high, fb = t, f
        if high - low < NEAR:
            break
    return low


@leaf
def _over(P, q, n, d, gx, gy):
    """Integral of d + gx x + gy y over a polygon."""
    total = 0.0
    for v in range(1, n - 1):
        ax, ay = P[q, v, 0] - P[q, 0, 0], P[q, v, 1] - P[q, 0, 1]
        bx, by = P[q, v + 1, 0] - P[q, 0, 0], P[q, v + 1, 1] - P[q, 0, 1]
        mx, my = P[q, 0, 0] + (ax + bx) / 3.0, P[q, 0, 1] + (ay + by) / 3.0
        total += 0.5 * abs(ax * by - ay * bx) * (d + gx * mx + gy * my)
    return total


@leaf
def _highest(head, part, lines, P, q, n, x, y, d, gx, gy):
    """The most that sweep k lies over a plane on a polygon: at a corner, for it is convex."""
    c = np.int64(lines[SELF, 7])
    most = -np.inf
    for v in range(n):
        px, py = P[q, v, 0], P[q, v, 1]
        most = max(most, height(head, part, c, lines, SELF, x + px, y + py) - d - gx * px - gy * py)
    return most


@leaf
def crease(head, part, lines, E, b, j, top, x, y, hx, hy, P, W):
    """(lo, hi, free): the integral of max(0, f_b - f_j) over the cell; whether sweep k lies below j where lo counts."""
    c = np.int64(lines[j, 7])
    if lines[j, 8] != lines[j, 7] or (b != TOP and lines[b, 8] != lines[b, 7]):
        return 0.0, np.inf, False
    v, gx, gy, hi = E[b, UP], E[b, UP + 1], E[b, UP + 2], np.inf
    if E[j, DOWN + 7] >= PART:
        u, w = abs(gx - E[j, DOWN + 1]) * hx, abs(gy - E[j, DOWN + 2]) * hy
        hi = positive(v - E[j, DOWN] + bends(E, b, UP, j, DOWN, hx, hy, 1.0), u, w, hx, hy, 1.0)
        if hi == 0.0:
            return 0.0, 0.0, True
    poses(head, part, c, lines, j, x, y, hx, hy)
    inside = 0
    for q in range(4):
        px, py = P[RECT, q, 0], P[RECT, q, 1]
        W[q, OVER] = height(head, part, c, lines, j, x + px, y + py) - v - gx * px - gy * py
        inside += 1 if W[q, OVER] <= 0.0 else 0
    if inside == 0:
        return 0.0, hi, True
    at, n, more = RECT, FOUR, 0.0
    d, dx, dy = -np.inf, 0.0, 0.0
    if inside < 4:
        at, n, m, crossings, mx, my = INSIDE, np.int64(0), np.int64(0), 0, 0.0, 0.0
        for q in range(4):
            r = q + 1 if q < 3 else 0
            ax, ay, bx, by = P[RECT, q, 0], P[RECT, q, 1], P[RECT, r, 0], P[RECT, r, 1]
            fa, fb = W[q, OVER], W[r, OVER]
            if fa <= 0.0:
                P[INSIDE, n, 0], P[INSIDE, n, 1] = ax, ay
                n += 1
            else:
                P[BEYOND, m, 0], P[BEYOND, m, 1] = ax, ay
                m += 1
            if (fa <= 0.0) == (fb <= 0.0):
                continue
            if fa <= 0.0:
                t = _reach(head, part, c, lines, j, v, gx, gy, x, y, ax, ay, bx, by, fa, fb)
            else:
                t = 1.0 - _reach(head, part, c, lines, j, v, gx, gy, x, y, bx, by, ax, ay, fb, fa)
            px, py = ax + t * (bx - ax), ay + t * (by - ay)
            P[INSIDE, n, 0], P[INSIDE, n, 1], P[BEYOND, m, 0], P[BEYOND, m, 1] = px, py, px, py
            n, m, crossings, mx, my = n + 1, m + 1, crossings + 1, mx + 0.5 * px, my + 0.5 * py
        if crossings != 2:
            return 0.0, hi, False
        xi, eta = local(lines, j, x + mx, y + my)
        u = lean_at(head, part, c, lines, j, xi, eta)
        _, d, dx, dy = surface(head, part, c, lines, j, x + mx, y + my, u)
        d -= dx * mx + dy * my
        over = bends(E, b, UP, TOP, UP, hx, hy, 1.0)
        if d > -np.inf:
            m = clip(P, BEYOND, m, HERE, dx - gx, dy - gy, v + over - d)
            more = _over(P, HERE, m, v + over - d, gx - dx, gy - dy)
        else:
            more = np.inf
    free = d > -np.inf and _highest(head, part, lines, P, at, n, x, y, d, dx, dy) <= 0.0
    if not free and E[j, DOWN + 7] >= PART:
        d, dx, dy = E[j, DOWN], E[j, DOWN + 1], E[j, DOWN + 2]
        free = _highest(head, part, lines, P, at, n, x, y, d, dx, dy) <= 0.0
    low, high = room(head, part, c, lines, j, top, x, y, hx, hy, True, P, at, n, W)
    if b != TOP:
        s, t = room(head, part, np.int64(lines[b, 7]), lines, b, top, x, y, hx, hy, True, P, at, n, W)
        low, high = low - t, high - s
    return max(low, 0.0), max(min(hi, high + more), 0.0), free


@leaf
def crossed(head, part, lines, E, n, best, lo, hi, top, x, y, hx, hy, slack, P, W):
    """(lo, hi) of what sweep k removes: what it lies below the smooth surface `best`, between lo and hi if that is known,
    less what other sweeps lie below `best`; these are counted once where they follow each other, see `pair`."""
    if not hi < np.inf:
        lo, hi, _ = crease(head, part, lines, E, best, SELF, top, x, y, hx, hy, P, W)
    most, least, before, a, free, back = 0.0, 0.0, NONE, 0.0, False, 0.0
    known = E[SELF, UP + 7] == SMOOTH and above(E, TOP, DOWN, hx, hy, SELF, UP)
    whole = known and above(E, best, DOWN, hx, hy, SELF, UP)
    for j in range(FIRST, n):
        if j == best:
            before = NONE
            continue
        last, fine = a, free
        own = both_lower(head, part, lines, j, SELF, x, y, hx, hy, slack)
        if own < np.inf:  # k begins where j ends: both lie below that pose nowhere by more than `own`
            a, b, _ = crease(head, part, lines, E, best, posed(lines, E, SELF), top, x, y, hx, hy, P, W)
            most, least, before = most + b + own, max(least, a), NONE
            continue
        a, b, free = crease(head, part, lines, E, best, np.int64(j), top, x, y, hx, hy, P, W)
        most += b
        if not free and known:  # where j lies below k as well
            c, d, _ = crease(head, part, lines, E, SELF, np.int64(j), top, x, y, hx, hy, P, W)
            a, free = a - d, True
            if whole:
                back = max(back, c)
        if free:
            least = max(least, a)
        if before > 0:
            both = both_lower(head, part, lines, j, before, x, y, hx, hy, slack)
            if both < np.inf:
                c, d, _ = crease(head, part, lines, E, best, posed(lines, E, before), top, x, y, hx, hy, P, W)
                most -= c
                if free and fine:
                    least = max(least, last + a - d - both)
        before = np.int64(j)
        if not most < np.inf:
            return 0.0, hi - least
    return max(lo - most + back, 0.0), hi - least
