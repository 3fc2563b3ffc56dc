# Interval lists of parallel rays: what of them is material, and what a sweep takes.
#
# Legend: a `Lattice` says where rays stand, `Lists` what is left of them; both are named tuples of `lattice.py`.
#   Ray (i, j) is number i nb + j and stands at a = a0 + (i + sa[j]) ha, b = b0 + (j + sb[i]) hb: one in every cell, and the
#   places within the cells of a row or a column are spread evenly (frac of multiples of an irrational number).
#   s coordinate along the ray, mm. Intervals of a ray rise; below, above: block that made the lower, the upper end.
#   A ray owns the rows first to first + room of the flat arrays, parts of them in use.
# stadium (16,): origin (3,), directions along (3,), across (3,) and up (3,), length of the segment, radius, lowest and
#   highest: a prism over all points within the radius of the segment, which holds the sweep and a margin.

import numpy as np

from vmachining.jit import kernel, leaf

SAME = 1e-9  # mm, LENGTH_EPS_MM: a ray that loses less loses nothing that means anything


@leaf
def through_stadium(x, y, ux, uy, length, r):
    """Part (p, q) of a line in the plane within r of the segment from 0 to (length, 0); empty is p > q.

    The stadium is convex, and the union of a rectangle and two discs.
    """
    uu = ux * ux + uy * uy
    if uu < 1e-24:
        s = min(max(x, 0.0), length)
        if (x - s) ** 2 + y * y > r * r:
            return 1.0, 0.0
        return -np.inf, np.inf
    p, q = np.inf, -np.inf
    for k in range(2):
        w = x - k * length
        h = w * ux + y * uy
        gap = h * h - uu * (w * w + y * y - r * r)
        if gap > 0.0:
            root = np.sqrt(gap)
            p, q = min(p, (-h - root) / uu), max(q, (-h + root) / uu)
    a, b = -np.inf, np.inf
    if uy != 0.0:
        a, b = (-r - y) / uy, (r - y) / uy
        a, b = min(a, b), max(a, b)
    elif abs(y) > r:
        a, b = 1.0, 0.0
    if ux != 0.0:
        c, d = -x / ux, (length - x) / ux
        a, b = max(a, min(c, d)), min(b, max(c, d))
    elif x < 0.0 or x > length:
        a, b = 1.0, 0.0
    if a <= b:
        p, q = min(p, a), max(q, b)
    if p > q:
        return 1.0, 0.0
    return p, q


@leaf
def cross_stadium(st, o, u):
    """Part (p, q) of a line inside the prism; empty is p > q."""
    x, y, z, ux, uy, uz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        w = o[k] - st[k]
        x, y, z = x + w * st[3 + k], y + w * st[6 + k], z + w * st[9 + k]
        ux, uy, uz = ux + u[k] * st[3 + k], uy + u[k] * st[6 + k], uz + u[k] * st[9 + k]
    p, q = through_stadium(x, y, ux, uy, st[12], st[13])
    if p > q:
        return 1.0, 0.0
    if uz != 0.0:
        c, d = (st[14] - z) / uz, (st[15] - z) / uz
        return max(p, min(c, d)), min(q, max(c, d))
    if z < st[14] or z > st[15]:
        return 1.0, 0.0
    return p, q


@leaf
def stands(lat, ray, o):
    """Write the place of a ray to o, 0 along it."""
    i, j = ray // lat.nb, ray % lat.nb
    o[lat.axis] = 0.0
    o[(lat.axis + 1) % 3] = lat.a0 + (i + lat.sa[j]) * lat.ha
    o[(lat.axis + 2) % 3] = lat.b0 + (j + lat.sb[i]) * lat.hb


@kernel
def asked(lat, lists, i0, i1, j0, j1, st, low, high, out) -> int:
    """Rays of a rectangle that can lose something, and their neighbours in the prism: numbers in `out`, how many.

    low, high : ends of the sweep's box along the rays.
    """
    ni, nj = i1 - i0, j1 - j0
    state = np.zeros((ni, nj), dtype=np.uint8)  # 1 in the prism, 2 with material there
    o, u = np.zeros(3), np.zeros(3)
    u[lat.axis] = 1.0
    for i in range(ni):
        for j in range(nj):
            ray = (i0 + i) * lat.nb + j0 + j
            f, n = lists.first[ray], lists.parts[ray]
            stands(lat, ray, o)
            p, q = cross_stadium(st, o, u)
            p, q = max(p, low), min(q, high)
            if p > q:
                continue
            state[i, j] = 1
            for k in range(f, f + n):
                if lists.low[k] < q and lists.high[k] > p:
                    state[i, j] = 2
                    break
    found = 0
    for i in range(ni):
        for j in range(nj):
            near = state[i, j] == 2
            if state[i, j] == 1:
                near = (
                    (i > 0 and state[i - 1, j] == 2)
                    or (i + 1 < ni and state[i + 1, j] == 2)
                    or (j > 0 and state[i, j - 1] == 2)
                    or (j + 1 < nj and state[i, j + 1] == 2)
                )
            if near:
                out[found] = (i0 + i) * lat.nb + j0 + j
                found += 1
    return found


@kernel
def worth(lat, lists, rays, low, high, out) -> None:
    """(n, 2) parts of rays, low to high at most, outside of which neither they nor the four beside them have material."""
    for m in range(len(rays)):
        i, j = rays[m] // lat.nb, rays[m] % lat.nb
        p, q = high, low
        for x, y in ((i, j), (i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)):
            if x < 0 or y < 0 or x >= lat.na or y >= lat.nb:
                continue
            f, n = lists.first[x * lat.nb + y], lists.parts[x * lat.nb + y]
            if n > 0:
                p, q = min(p, lists.low[f]), max(q, lists.high[f + n - 1])
        p, q = max(p, low), min(q, high)
        out[m, 0], out[m, 1] = min(p, q), q


@kernel
def origins(lat, rays, out) -> None:
    """(n, 3) places of rays."""
    for k in range(len(rays)):
        stands(lat, rays[k], out[k])


@leaf
def overlap(lists, ray, p, q):
    """mm of material of a ray between p and q."""
    total = 0.0
    f = lists.first[ray]
    for k in range(f, f + lists.parts[ray]):
        total += max(0.0, min(q, lists.high[k]) - max(p, lists.low[k]))
    return total


@leaf
def roomy(lists, ray, want):
    """Give a ray room for `want` intervals; False where the arrays are full."""
    if lists.room[ray] >= want:
        return True
    room = max(want, 2 * lists.room[ray])
    if lists.used[0] + room > len(lists.low):
        return False
    f, g, n = lists.first[ray], lists.used[0], lists.parts[ray]
    for k in range(n):
        lists.low[g + k], lists.high[g + k] = lists.low[f + k], lists.high[f + k]
        lists.below[g + k], lists.above[g + k] = lists.below[f + k], lists.above[f + k]
    lists.first[ray], lists.room[ray] = g, room
    lists.used[0] += room
    return True


@leaf
def subtract(lists, ray, p, q, block):
    """Take [p, q] off a ray, which has room for one interval more; mm that were material."""
    f, n = lists.first[ray], lists.parts[ray]
    k, gone = f, 0.0
    while k < f + n:
        low, high = lists.low[k], lists.high[k]
        if high <= p or low >= q:
            k += 1
        elif p <= low and high <= q:
            gone += high - low
            for m in range(k, f + n - 1):
                lists.low[m], lists.high[m] = lists.low[m + 1], lists.high[m + 1]
                lists.below[m], lists.above[m] = lists.below[m + 1], lists.above[m + 1]
            n -= 1
        elif p <= low:
            gone += q - low
            lists.low[k], lists.below[k] = q, block
            k += 1
        elif high <= q:
            gone += high - p
            lists.high[k], lists.above[k] = p, block
            k += 1
        else:
            gone += q - p
            for m in range(f + n, k + 1, -1):
                lists.low[m], lists.high[m] = lists.low[m - 1], lists.high[m - 1]
                lists.below[m], lists.above[m] = lists.below[m - 1], lists.above[m - 1]
            lists.low[k + 1], lists.high[k + 1] = q, high
            lists.below[k + 1], lists.above[k + 1] = block, lists.above[k]
            lists.high[k], lists.above[k] = p, block
            n += 1
            break
    lists.parts[ray] = n
    return gone


@kernel
def take(lists, rays, ends, enter, leave, block, begin, length) -> int:
    """Take intervals off rays from number `begin` on: those of rays[i] are ends[i] to ends[i + 1] of enter, leave.

    length (n,) mm that each ray loses. Returns how far it came: less than n where the arrays are full.
    """
    for i in range(begin, len(rays)):
        ray = rays[i]
        if not roomy(lists, ray, lists.parts[ray] + ends[i + 1] - ends[i]):
            return i
        gone = 0.0
        for k in range(ends[i], ends[i + 1]):
            gone += subtract(lists, ray, enter[k], leave[k], block)
        length[i] = gone
    return len(rays)


@kernel
def touched(lists, rays, ends, enter, leave, length) -> None:
    """mm that each ray would lose."""
    for i in range(len(rays)):
        length[i] = 0.0
        for k in range(ends[i], ends[i + 1]):
            length[i] += overlap(lists, rays[i], enter[k], leave[k])


@kernel
def tell(lat, lists, i0, i1, j0, j1, rays, ends, enter, leave, length, cut, out) -> None:
    """Sums over the rectangle of what rays lose: out (5,) sum, squared differences of neighbours, beside,
    largest, number of rays that lose something.

    beside : mm, largest material that is left on a ray between ends of the sweep on a neighbour (after the cut, or without
        what the ray itself loses).
    """
    ni, nj = i1 - i0, j1 - j0
    gone, number = np.zeros((ni, nj)), np.full((ni, nj), -1)
    for m in range(len(rays)):
        i, j = rays[m] // lat.nb - i0, rays[m] % lat.nb - j0
        gone[i, j], number[i, j] = length[m], m
        out[0] += length[m]
        out[3] = max(out[3], length[m])
        out[4] += length[m] > SAME
    for i in range(ni):
        for j in range(nj):
            if i + 1 < ni:
                out[1] += (gone[i + 1, j] - gone[i, j]) ** 2
            if j + 1 < nj:
                out[1] += (gone[i, j + 1] - gone[i, j]) ** 2
    for m in range(len(rays)):
        i, j = rays[m] // lat.nb - i0, rays[m] % lat.nb - j0
        for side in range(4):
            x, y = i + (side == 0) - (side == 1), j + (side == 2) - (side == 3)
            if x < 0 or y < 0 or x >= ni or y >= nj:
                continue
            k = number[x, y]
            if k < 0:
                continue
            left = 0.0
            for e in range(ends[k], ends[k + 1]):
                left += overlap(lists, rays[m], enter[e], leave[e])
            if not cut:
                left -= length[m]
            out[2] = max(out[2], left)


@kernel
def lengths(lists, out) -> None:
    """mm of material of every ray."""
    for ray in range(len(lists.first)):
        f = lists.first[ray]
        out[ray] = 0.0
        for k in range(f, f + lists.parts[ray]):
            out[ray] += lists.high[k] - lists.low[k]
