# Bounds of the volume between smooth surfaces in a cell; E: see sides.py. way +1: from above, -1: from below.

import numpy as np

from vmachining.engines.columns.sides import BELOW, DOWN, SELF, SMOOTH, TOP, UP
from vmachining.jit import inner, leaf

THIN = 1e-4  # a gradient this much flatter along one side of the cell is taken as level there


@leaf
def positive(c, a, b, hx, hy, way):
    """Integral of max(0, c + gx x + gy y) over the cell, a = |gx| hx, b = |gy| hy; way +1 from above, -1 from below."""
    area = 4.0 * hx * hy
    if a < b:
        a, b = b, a
    if c >= a + b:
        return area * c
    if c <= -(a + b):
        return 0.0
    if b <= THIN * a:
        c += way * b
        if c >= a:
            return area * c
        return area * (c + a) ** 2 / (4.0 * a) if c > -a else 0.0
    total = (c + a + b) ** 3
    if c + a - b > 0.0:
        total -= (c + a - b) ** 3
    if c - a + b > 0.0:
        total -= (c - a + b) ** 3
    if c - a - b > 0.0:
        total += (c - a - b) ** 3
    return area * total / (24.0 * a * b)


@leaf
def above_zero(area, u, v, w):
    """Integral of the positive part of a linear function over a triangle from its values at the corners."""
    if u > v:
        u, v = v, u
    if v > w:
        v, w = w, v
    if u > v:
        u, v = v, u
    if u >= 0.0:
        return area * (u + v + w) / 3.0
    if w <= 0.0:
        return 0.0
    if v <= 0.0:
        return area * w * w * w / (3.0 * (w - u) * (w - v))
    return area * ((u + v + w) / 3.0 - u * u * u / (3.0 * (v - u) * (w - u)))


@leaf
def bends(E, i, a, j, b, hx, hy, way):
    """Bound of the part of second order of surface (i, a) minus surface (j, b): from above way +1, from below -1."""
    xx, xy, yy = E[i, a + 3] - E[j, b + 3], E[i, a + 4] - E[j, b + 4], E[i, a + 5] - E[j, b + 5]
    r = E[i, a + 6] + E[j, b + 6]
    return way * (
        0.5 * (max(way * xx + r, 0.0) * hx * hx + max(way * yy + r, 0.0) * hy * hy) + abs(xy) * hx * hy
    )


@leaf
def mean_bend(E, i, a, j, b, hx, hy, way):
    """The same in the mean over the cell."""
    r = E[i, a + 6] + E[j, b + 6]
    xx, yy = E[i, a + 3] - E[j, b + 3], E[i, a + 5] - E[j, b + 5]
    return ((xx + way * r) * hx * hx + (yy + way * r) * hy * hy) / 6.0


@leaf
def above(E, j, b, hx, hy, i, a):
    """Whether surface j (its lower side b) lies nowhere in the cell below surface i (smooth on its side a)."""
    c = E[j, b] - E[i, a] - abs(E[j, b + 1] - E[i, a + 1]) * hx - abs(E[j, b + 2] - E[i, a + 2]) * hy
    if c < 0.0:
        return False
    return c + bends(E, j, b, i, a, hx, hy, -1.0) >= 0.0


@inner
def smooth(E, n, best, rules, hx, hy, share, least, most):
    """(lo, hi, least, most) where sweep k (row 1) and surface `best` are smooth on both sides; the integral of their
    difference is known to lie between `least` and `most`; returned is what is then known of its positive part."""
    area = 4.0 * hx * hy
    # from above: one surface alone, its mean exactly, plus what lies below sweep k
    v, gx, gy = E[best, UP] - E[1, DOWN], E[best, UP + 1] - E[1, DOWN + 1], E[best, UP + 2] - E[1, DOWN + 2]
    a, b = abs(gx) * hx, abs(gy) * hy
    hi = area * (v + mean_bend(E, best, UP, SELF, DOWN, hx, hy, 1.0))
    beyond = positive(-v - bends(E, best, UP, SELF, DOWN, hx, hy, -1.0), a, b, hx, hy, 1.0)
    if beyond > 0.0:
        hi = min(
            min(hi, most) + beyond,
            positive(v + bends(E, best, UP, SELF, DOWN, hx, hy, 1.0), a, b, hx, hy, 1.0),
        )
        below = hi
    else:  # k lies below it: what another one that k lies below takes of it is not there to be removed
        gain, over_top = 0.0, 0.0
        for j in range(n):
            if j != 1 and j != best and E[j, UP + 7] == SMOOTH and above(E, j, UP, hx, hy, SELF, DOWN):
                w = E[best, UP] - E[j, UP] + bends(E, best, UP, j, UP, hx, hy, -1.0)
                a = abs(E[best, UP + 1] - E[j, UP + 1]) * hx
                b = abs(E[best, UP + 2] - E[j, UP + 2]) * hy
                w = positive(w, a, b, hx, hy, -1.0)
                if j == TOP:
                    over_top = w
                else:
                    gain = max(gain, w)
        below = min(hi, most)
        hi -= max(gain, over_top)
        if most < np.inf:  # the top is seen to in the closed integral, and is taken once
            hi = min(hi, most - gain if above(E, TOP, DOWN, hx, hy, best, UP) else most)
    # from below: its mean, less what the others take
    v = E[best, DOWN] - E[1, UP]
    lo = max(area * (v + mean_bend(E, best, DOWN, SELF, UP, hx, hy, -1.0)), least)
    if beyond > 0.0 and above(E, TOP, DOWN, hx, hy, best, UP) and above(E, TOP, DOWN, hx, hy, SELF, UP):
        a, b = abs(E[best, UP + 1] - E[1, DOWN + 1]) * hx, abs(E[best, UP + 2] - E[1, DOWN + 2]) * hy
        w = E[1, DOWN] - E[best, UP] + bends(E, SELF, DOWN, best, UP, hx, hy, -1.0)
        lo += positive(w, a, b, hx, hy, -1.0)
    alone, lo = lo, max(lo, share)
    for j in range(n):
        if j == 1 or j == best:
            continue
        v, gx, gy = (
            E[best, DOWN] - E[j, DOWN],
            E[best, DOWN + 1] - E[j, DOWN + 1],
            E[best, DOWN + 2] - E[j, DOWN + 2],
        )
        lo -= positive(
            v + bends(E, best, DOWN, j, DOWN, hx, hy, 1.0), abs(gx) * hx, abs(gy) * hy, hx, hy, 1.0
        )
    # or the least of linear functions, which is concave, at the corners
    if rules & BELOW == 0:
        return max(lo, 0.0), hi, alone, below
    w00, w10, w01, w11 = np.inf, np.inf, np.inf, np.inf
    for j in range(n):
        if j == 1:
            continue
        v = E[j, DOWN] - E[1, UP] + bends(E, j, DOWN, SELF, UP, hx, hy, -1.0)
        gx, gy = hx * (E[j, DOWN + 1] - E[1, UP + 1]), hy * (E[j, DOWN + 2] - E[1, UP + 2])
        w00, w10 = min(w00, v - gx - gy), min(w10, v + gx - gy)
        w01, w11 = min(w01, v - gx + gy), min(w11, v + gx + gy)
    half = 0.5 * area
    lo = max(lo, above_zero(half, w00, w10, w11) + above_zero(half, w00, w01, w11))
    lo = max(lo, above_zero(half, w00, w10, w01) + above_zero(half, w10, w01, w11), 0.0)
    return lo, hi, alone, below
