# Bounds by planes and chords on polygons: the cell clipped at borders of footprints. E, C, lines, P: see sides.py.

import numpy as np

from vmachining.engines.columns.patches._kernels import clip
from vmachining.engines.columns.sides import ABOVE, BELOW, DOWN, PART, ROUGH, SELF, UP
from vmachining.engines.columns.smooth._kernels import above_zero
from vmachining.engines.columns.surface._kernels import height, poses
from vmachining.jit import leaf

MANY = np.int64(6)  # rows of a coarse cell above which it is not cut up
COARSE = 0.15  # radii: half sizes of a cell together, above which it is a whole tile and will be divided most often

RECT, CUT, HERE, BEYOND, ROUND = np.int64(0), np.int64(1), np.int64(2), np.int64(3), np.int64(4)  # polygons
FOUR, NONE = np.int64(4), np.int64(-1)


@leaf
def _area(P, q, u, v):
    """Of the triangle of corners 0, u, v of polygon q."""
    ax, ay = P[q, u, 0] - P[q, 0, 0], P[q, u, 1] - P[q, 0, 1]
    bx, by = P[q, v, 0] - P[q, 0, 0], P[q, v, 1] - P[q, 0, 1]
    return 0.5 * abs(ax * by - ay * bx)


@leaf
def over(head, part, lines, rules, x, y, hx, hy, E, n, P, q, corners, extra, W):
    """Bound from above on a polygon: one surface and one plane below sweep k per triangle, the best of them."""
    if corners < 3:
        return 0.0
    if rules & ABOVE == 0:
        n, extra = SELF, NONE  # the top alone
    for i in range(n):
        if i == 1 or (E[i, UP + 7] < ROUGH and i != extra):
            continue
        c = NONE
        if i > 0:
            c = np.int64(lines[i, 7])
            poses(head, part, c, lines, i, x, y, hx, hy)
        for v in range(corners):
            px, py = P[q, v, 0], P[q, v, 1]
            f = E[0, UP] + E[0, UP + 1] * px + E[0, UP + 2] * py
            if i > 0:
                f = height(head, part, c, lines, i, x + px, y + py)
            W[i, v] = f - E[1, DOWN] - E[1, DOWN + 1] * px - E[1, DOWN + 2] * py
    total = 0.0
    for v in range(1, corners - 1):
        area, best = _area(P, q, v, v + 1), np.inf
        for i in range(n):
            if i != 1 and (E[i, UP + 7] >= ROUGH or i == extra):
                best = min(best, above_zero(area, W[i, 0], W[i, v], W[i, v + 1]))
        total += best
    return total


@leaf
def under(head, part, lines, rules, bottom, x, y, hx, hy, E, n, C, P, q, corners, W):
    """Bound from below on a polygon inside the footprint of k: least plane minus f_k at the corners is a concave
    function's, and surfaces that lie beyond their outer tangent are absent."""
    if corners < 3 or rules & BELOW == 0:
        return 0.0
    for v in range(corners):
        W[1, v] = np.inf
    for i in range(n):
        if i == 1:
            continue
        beyond = E[i, DOWN + 7] == PART
        for v in range(corners):
            beyond = beyond and C[i, 0] * P[q, v, 0] + C[i, 1] * P[q, v, 1] >= C[i, 3] - 1e-12
        if not beyond:
            for v in range(corners):
                W[1, v] = min(W[1, v], E[i, DOWN] + E[i, DOWN + 1] * P[q, v, 0] + E[i, DOWN + 2] * P[q, v, 1])
    c = int(lines[SELF, 7])
    poses(head, part, c, lines, SELF, x, y, hx, hy)
    for v in range(corners):
        f = height(head, part, c, lines, SELF, x + P[q, v, 0], y + P[q, v, 1])
        W[1, v] -= max(f, bottom)
    total = 0.0
    for v in range(1, corners - 1):
        total += above_zero(_area(P, q, v, v + 1), W[1, 0], W[1, v], W[1, v + 1])
    return total


@leaf
def cut_up(head, part, lines, rules, bottom, x, y, hx, hy, E, n, C, P, W, rim):
    """(lo, hi) by polygons: the cell clipped at borders of footprints, and of a round stock whose row of C is rim."""
    q, corners = RECT, FOUR
    if E[1, DOWN + 7] == PART and C[1, 3] < np.inf:
        q, corners = CUT, clip(P, RECT, FOUR, CUT, C[1, 0], C[1, 1], C[1, 3])
    if rim > 0:
        corners = clip(P, q, corners, ROUND, C[rim, 0], C[rim, 1], C[rim, 3])
        q = ROUND
    hi = over(head, part, lines, rules, x, y, hx, hy, E, n, P, q, corners, NONE, W)
    if n > MANY and hx + hy > COARSE * head[int(lines[SELF, 7]), 1]:
        return 0.0, hi
    for j in range(2, n):
        if E[j, UP + 7] == PART and -np.inf < C[j, 2] < np.inf:
            a = clip(P, q, corners, HERE, C[j, 0], C[j, 1], C[j, 2])
            b = clip(P, q, corners, BEYOND, -C[j, 0], -C[j, 1], -C[j, 2])
            found = over(head, part, lines, rules, x, y, hx, hy, E, n, P, HERE, a, j, W)
            if found < hi:
                found += over(head, part, lines, rules, x, y, hx, hy, E, n, P, BEYOND, b, NONE, W)
                hi = min(hi, found)
    q, corners = RECT, FOUR
    if E[1, UP + 7] == PART:
        if not -np.inf < C[1, 2] < np.inf:
            return 0.0, hi
        q, corners = CUT, clip(P, RECT, FOUR, CUT, C[1, 0], C[1, 1], C[1, 2])
    if rim > 0:
        if C[rim, 2] == -np.inf:
            return 0.0, hi
        corners = clip(P, q, corners, ROUND, C[rim, 0], C[rim, 1], C[rim, 2])
        q = ROUND
    lo = under(head, part, lines, rules, bottom, x, y, hx, hy, E, n, C, P, q, corners, W)
    for j in range(2, n):
        if E[j, DOWN + 7] == PART and abs(C[j, 3]) < abs(C[j, 0]) * hx + abs(C[j, 1]) * hy:
            a = clip(P, q, corners, HERE, C[j, 0], C[j, 1], C[j, 3])
            b = clip(P, q, corners, BEYOND, -C[j, 0], -C[j, 1], -C[j, 3])
            found = under(head, part, lines, rules, bottom, x, y, hx, hy, E, n, C, P, HERE, a, W)
            lo = max(
                lo, found + under(head, part, lines, rules, bottom, x, y, hx, hy, E, n, C, P, BEYOND, b, W)
            )
    return lo, hi
