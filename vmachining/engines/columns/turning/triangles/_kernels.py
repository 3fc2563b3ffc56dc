# What sweep k removes over one of the four triangles of a cell, from above and from below (L6, L7).
#
# Legend: see ../_kernels.py and `Room`. Affine functions: value at the middle of the cell, slopes.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.engines.columns.smooth._kernels import above_zero
from vmachining.jit import leaf

UPRIGHT = 1e-9  # |n.t| of a face of the stock along the columns
SLOTS, FACES = 64, 64  # sweeps that are looked at in a cell, and faces of a stock, at most; a box adds six
KEPT = 1 << 14  # witnesses
COVERS = np.int64(1)  # the bit of rules for L1 of earlier sweeps
ZERO, ONE = np.int64(0), np.int64(1)


class Room(NamedTuple):
    """N (64, 2, 5, 12), L (64, 2, 3), C (64, 2, 5, 3): see above. P (8, 12) poses, B (12,) a witness, H (6, 3) planes: the top
    of the stock lies at most H[2, 0] below H[3], H[4] is a border, H[5] scratch, H[1] (u0, v0, half edge) of the first cells.
    K (KEPT,) keys of witnesses W (KEPT, 12) by node, see cells/_kernels.py.
    T (2, 10) smooth surfaces, see bends/_kernels.py.

    Over a triangle: G (256, 6) lower and upper ends as affine functions, Q (2, 74, 2) polygons, S (256,) an order of G or of
    slots, D (64,) slots that are dropped.
    """

    N: NDArray[np.float64]
    L: NDArray[np.float64]
    C: NDArray[np.float64]
    P: NDArray[np.float64]
    B: NDArray[np.float64]
    G: NDArray[np.float64]
    Q: NDArray[np.float64]
    S: NDArray[np.int64]
    D: NDArray[np.int64]
    H: NDArray[np.float64]
    K: NDArray[np.int64]
    W: NDArray[np.float64]
    T: NDArray[np.float64]


def room() -> Room:
    """Room for one thread."""
    return Room(
        np.zeros((SLOTS, 2, 5, 12)), np.zeros((SLOTS, 2, 3)), np.zeros((SLOTS, 2, 5, 3)), np.zeros((8, 12)), np.zeros(12),
        np.zeros((4 * SLOTS, 6)), np.zeros((2, FACES + 10, 2)), np.zeros(4 * SLOTS, dtype=np.int64),
        np.zeros(SLOTS, dtype=np.int64), np.zeros((6, 3)), np.zeros(KEPT, dtype=np.int64), np.zeros((KEPT, 12)),
        np.zeros((2, 10)),
    )  # fmt: skip


@leaf
def du(k, h):
    return 0.0 if k == 0 else (h if k == 2 or k == 3 else -h)


@leaf
def dv(k, h):
    return 0.0 if k == 0 else (h if k > 2 else -h)


@leaf
def _affine(a, b, x0, va, vb, h, G, g, c):
    """Affine function over triangle (0, a, b) of corners by its values there, into G[g, c:c + 3]."""
    mx, my = 0.5 * (du(a, h) + du(b, h)) / h, 0.5 * (dv(a, h) + dv(b, h)) / h
    px, py = 0.5 * (du(b, h) - du(a, h)) / h, 0.5 * (dv(b, h) - dv(a, h)) / h
    r, s = (0.5 * (va + vb) - x0) / h, 0.5 * (vb - va) / h
    G[g, c], G[g, c + 1], G[g, c + 2] = x0, mx * r + px * s, my * r + py * s


@leaf
def _clip(Q, n, a, b, c):
    """Corners of polygon Q[0] with a x + b y <= c, their number."""
    m = ZERO
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        p = a * Q[0, i, 0] + b * Q[0, i, 1] - c
        q = a * Q[0, j, 0] + b * Q[0, j, 1] - c
        if p <= 0.0:
            Q[1, m, 0], Q[1, m, 1] = Q[0, i, 0], Q[0, i, 1]
            m += 1
        if (p < 0.0 < q) or (q < 0.0 < p):
            f = p / (p - q)
            Q[1, m, 0], Q[1, m, 1] = (
                Q[0, i, 0] + f * (Q[0, j, 0] - Q[0, i, 0]),
                Q[0, i, 1] + f * (Q[0, j, 1] - Q[0, i, 1]),
            )
            m += 1
    for i in range(m):
        Q[0, i, 0], Q[0, i, 1] = Q[1, i, 0], Q[1, i, 1]
    return m


@leaf
def _area(Q, i):
    """Of the triangle between corners 0, i and i + 1 of polygon Q[0]."""
    x, y = Q[0, 0, 0], Q[0, 0, 1]
    return 0.5 * abs((Q[0, i, 0] - x) * (Q[0, i + 1, 1] - y) - (Q[0, i + 1, 0] - x) * (Q[0, i, 1] - y))


@leaf
def _on(G, g, c, x, y):
    return G[g, c] + G[g, c + 1] * x + G[g, c + 2] * y


@leaf
def _put(G, g, c, z, p, q):
    G[g, c], G[g, c + 1], G[g, c + 2] = z, p, q


@leaf
def _sides(room, q, a, b, h, G, g, x, y):
    """Covers of slot q over triangle (0, a, b) into G[g:] = (from, to); the number of them: one where both overlap."""
    n = ZERO
    for side in range(2):
        C = room.C[q, side]
        if C[0, 0] == 0.0 or C[a, 0] == 0.0 or C[b, 0] == 0.0:
            continue
        if side == 0:
            _affine(a, b, C[0, 1], C[a, 1], C[b, 1], h, G, g + n, 0)
            _affine(a, b, C[0, 2], C[a, 2], C[b, 2], h, G, g + n, 3)
        else:
            _affine(a, b, -C[0, 2], -C[a, 2], -C[b, 2], h, G, g + n, 0)
            _affine(a, b, -C[0, 1], -C[a, 1], -C[b, 1], h, G, g + n, 3)
        n += 1
    if n == 2:
        one = True
        for k in range(3):
            p = (ZERO, a, b)[k]
            u, w = du(p, h), dv(p, h)
            one = (
                one
                and _on(G, g + 1, 0, u, w) <= _on(G, g, 3, u, w)
                and _on(G, g, 0, u, w) <= _on(G, g + 1, 3, u, w)
            )
        if one:
            G[g, 3], G[g, 4], G[g, 5] = G[g + 1, 3], G[g + 1, 4], G[g + 1, 5]
            return 1
    return n


@leaf
def _gap(room, lows, ups, top, mine, n, m, cut):
    """mm^3 at least, over polygon Q[0], of what the proven part `mine` of k has above sweeps S[:cut] and below sweeps S[cut:m]: a
    minimum of affine functions less a maximum is concave."""
    G, Q, S = room.G, room.Q, room.S
    for i in range(n):
        px, py = Q[0, i, 0], Q[0, i, 1]
        low, high = _on(G, mine, 0, px, py), _on(G, mine, 3, px, py)
        for g in range(1, lows):
            low = max(low, _on(G, g, 0, px, py))
        for g in range(1, ups):
            high = min(high, _on(G, g, 3, px, py) - (room.H[2, 0] if g == top else 0.0))
        for k in range(m):
            q = S[k]
            if k < cut:
                low = max(low, -(room.L[q, 1, 0] + room.L[q, 1, 1] * px + room.L[q, 1, 2] * py))
            else:
                high = min(high, room.L[q, 0, 0] + room.L[q, 0, 1] * px + room.L[q, 0, 2] * py)
        Q[1, i, 0] = high - low
    out = 0.0
    for i in range(1, n - 1):
        out += above_zero(_area(Q, i), Q[1, 0, 0], Q[1, i, 0], Q[1, i + 1, 0])
    return out


@leaf
def _parted(room, n, a, b):
    """Whether the outer ends of one of the sweeps S[a:b] do not cross over polygon Q[0]: gaps a and b have it between them."""
    for k in range(a, b):
        lower, upper, apart = room.L[room.S[k], 0], room.L[room.S[k], 1], True
        for i in range(n):
            x, y = room.Q[0, i, 0], room.Q[0, i, 1]
            apart = apart and lower[0] + lower[1] * x + lower[2] * y <= -(
                upper[0] + upper[1] * x + upper[2] * y
            )
        if apart:
            return True
    return False


@leaf
def triangle(room, F, roofed, tri, count, u, v, h, t0, t1, border, rules):
    """(lo, hi) of what k removes over one of the four triangles of a cell."""
    a, b = tri + 1, (tri + 1) % 4 + 1
    G, Q, S = room.G, room.Q, room.S
    Q[0, 0, 0], Q[0, 0, 1] = 0.0, 0.0
    Q[0, 1, 0], Q[0, 1, 1] = du(a, h), dv(a, h)
    Q[0, 2, 0], Q[0, 2, 1] = du(b, h), dv(b, h)
    n = 3
    # G[0:lows] lower ends (c 0), G[0:ups] upper ends (c 3) of what may be removed
    lows, ups = 2, 2
    _put(G, 0, 0, room.L[0, 0, 0], room.L[0, 0, 1], room.L[0, 0, 2])
    _put(G, 0, 3, -room.L[0, 1, 0], -room.L[0, 1, 1], -room.L[0, 1, 2])
    _put(G, 1, 0, t0, 0.0, 0.0)
    _put(G, 1, 3, t1, 0.0, 0.0)
    for f in range(len(F)):
        c = F[f, 3] - F[f, 0] * u - F[f, 1] * v
        if abs(F[f, 2]) < UPRIGHT:
            n = _clip(Q, n, F[f, 0], F[f, 1], c)
        elif F[f, 2] > 0.0:
            _put(G, ups, 3, c / F[f, 2], -F[f, 0] / F[f, 2], -F[f, 1] / F[f, 2])
            ups += 1
        else:
            _put(G, lows, 0, c / F[f, 2], -F[f, 0] / F[f, 2], -F[f, 1] / F[f, 2])
            lows += 1
    top = -1
    if roofed:
        top = ups
        _put(G, ups, 3, room.H[3, 0], room.H[3, 1], room.H[3, 2])
        ups += 1
    if border:
        n = _clip(Q, n, room.H[4, 0], room.H[4, 1], room.H[4, 2])
    if n < 3:
        return 0.0, 0.0
    x, y = 0.0, 0.0
    for i in range(n):
        x, y = x + Q[0, i, 0] / n, y + Q[0, i, 1] / n
    pos, end = -np.inf, np.inf
    for g in range(lows):
        pos = max(pos, _on(G, g, 0, x, y))
    for g in range(ups):
        end = min(end, _on(G, g, 3, x, y))
    # from above: covers of others, greedily from below at the middle (any order is a proof)
    first = max(lows, ups)
    total, chain = first, ZERO
    if rules & COVERS != 0:
        for q in range(1, count):
            if room.D[q] == 0:
                total += _sides(room, q, a, b, h, G, total, x, y)
        place = pos
        while place < end:
            pick, far, near = -1, place, np.inf
            for g in range(first, total):
                low, high = _on(G, g, 0, x, y), _on(G, g, 3, x, y)
                if high <= place or low >= end:
                    continue
                if low <= place:
                    if high > far:
                        pick, far = g, high
                elif far == place and low < near:
                    pick, near = g, low
            if pick < 0:
                break
            S[chain] = pick
            chain += 1
            place = _on(G, pick, 3, x, y)
    hi = 0.0
    for i in range(1, n - 1):
        x0, y0 = Q[0, 0]
        x1, y1 = Q[0, i]
        x2, y2 = Q[0, i + 1]
        area = _area(Q, i)
        for gap in range(chain + 1):
            least = np.inf
            for p in range(lows + 1):
                if p == lows:
                    if gap == 0:
                        continue
                    g, c = S[gap - 1], 3
                else:
                    g, c = p, 0
                b0, b1, b2 = _on(G, g, c, x0, y0), _on(G, g, c, x1, y1), _on(G, g, c, x2, y2)
                for r in range(ups + 1):
                    if r == ups:
                        if gap == chain:
                            continue
                        g, c = S[gap], 0
                    else:
                        g, c = r, 3
                    d0, d1, d2 = (
                        _on(G, g, c, x0, y0) - b0,
                        _on(G, g, c, x1, y1) - b1,
                        _on(G, g, c, x2, y2) - b2,
                    )
                    if d0 <= 0.0 and d1 <= 0.0 and d2 <= 0.0:
                        least = 0.0
                        break
                    least = min(least, above_zero(area, d0, d1, d2))
                if least == 0.0:
                    break
            hi += least
    # from below: the proven part of k, and all others on either side of each gap
    lo = 0.0
    n_k = _sides(room, 0, a, b, h, G, first, x, y)
    mine, most = -1, 0.0
    for g in range(first, first + n_k):
        p, r = max(pos, _on(G, g, 0, x, y)), min(end, _on(G, g, 3, x, y))
        if r - p > most:
            mine, most = g, r - p
    if mine < 0:
        return 0.0, hi
    bottom, ceiling = max(pos, _on(G, mine, 0, x, y)), min(end, _on(G, mine, 3, x, y))
    # outer intervals of the others by their lower ends; the gaps between them
    m = ZERO
    for q in range(1, count):
        if room.D[q] != 0:
            continue
        f = room.L[q, 0, 0] + room.L[q, 0, 1] * x + room.L[q, 0, 2] * y
        rank = m
        while rank > 0:
            o = S[rank - 1]
            if room.L[o, 0, 0] + room.L[o, 0, 1] * x + room.L[o, 0, 2] * y <= f:
                break
            S[rank] = o
            rank -= 1
        S[rank] = q
        m += 1
    place, last, before = bottom, 0.0, -ONE
    for cut in range(m + 1):
        f = ceiling
        if cut < m:
            q = S[cut]
            f = min(f, room.L[q, 0, 0] + room.L[q, 0, 1] * x + room.L[q, 0, 2] * y)
        if f > place:
            taken = _gap(room, lows, ups, top, mine, n, m, cut)
            if before < 0 or _parted(room, n, before, cut):
                lo, last, before = lo + taken, taken, np.int64(cut)
            elif taken > last:
                lo, last, before = lo + taken - last, taken, np.int64(cut)
        if cut < m:
            place = max(place, -(room.L[q, 1, 0] + room.L[q, 1, 1] * x + room.L[q, 1, 2] * y))
    return lo, hi
