# Many straight blocks at once over upright rays of one interval each: heights of the material as a map.
#
# Legend: see the one of dexel/_kernels.py for the lattice. top, low (n, m) mm: ends of the interval of a ray of the window that
#   begins at row i0, column j0; own (n, m) block that made the top. start, travel (blocks, 3) tip of the cutter and its way.
#   r1, rc: radius of the flat bottom and of the corner above it: a ball has r1 = 0, a flat end rc = 0.
#   out (blocks, 6): see `tell`, and how far the highest material under the cutter stood above its lowest tip.
# Loops go along columns, j, and carry nothing from one j to the next, so that they are worked on by several at once: sums over
#   a block are kept by column, in acc (6, m + 2): lost, squares, beside, hits, largest, highest material under the cutter.
# z (2, m + 2) and lost (2, m + 2) mm of this row and the one before, column j at j + 1; inf where the cutter misses.

import numpy as np

from vmachining.engines.dexel._kernels import SAME
from vmachining.jit import kernel, leaf

JOINED = 1e-12  # mm: rounding of the end of a block, as its start and its way


@leaf
def seen(lat, i, j0, px, py, pz, dx, dy, dz):
    """Row i from a block: x, y of its cell j0 from the start, and the length, direction, slope and first height of the block."""
    x0, y0 = lat.a0 + i * lat.ha - px, lat.b0 + (lat.sb[i] + j0) * lat.hb - py
    run = np.sqrt(dx * dx + dy * dy)
    if run > 0.0:
        return x0, y0, run, dx / run, dy / run, dz / run, pz
    return x0, y0, run, 1.0, 0.0, 0.0, pz + min(0.0, dz)


@leaf
def ball_row(lat, i, j0, a, b, px, py, pz, dx, dy, dz, r, z) -> None:
    """Heights at which rays a to b of row i enter the ball of a block; centre from pz up."""
    x0, y0, run, e0, e1, slope, base = seen(lat, i, j0, px, py, pz, dx, dy, dz)
    sin, rr = dz / np.sqrt(run * run + dz * dz) if run > 0.0 else 0.0, r * r
    if sin == 0.0:
        for j in range(a, b):
            x, y = x0 + lat.sa[j0 + j] * lat.ha, y0 + j * lat.hb
            u, v = x * e0 + y * e1, y * e0 - x * e1
            s = u if u > 0.0 else 0.0
            s = s if s < run else run
            room = rr - v * v - (u - s) * (u - s)
            z[j + 1] = base - np.sqrt(room) if room > 0.0 else np.inf
        return
    for j in range(a, b):
        x, y = x0 + lat.sa[j0 + j] * lat.ha, y0 + j * lat.hb
        u, v = x * e0 + y * e1, y * e0 - x * e1
        hh = rr - v * v
        s = u - np.sqrt(hh if hh > 0.0 else 0.0) * sin
        s = s if s > 0.0 else 0.0
        s = s if s < run else run
        room = hh - (u - s) * (u - s)
        z[j + 1] = base + s * slope - np.sqrt(room) if room > 0.0 else np.inf


@leaf
def flat_row(lat, i, j0, a, b, px, py, pz, dx, dy, dz, r1, rc, z) -> None:
    """The same for a flat end on any line, and for a corner radius on a level one; pz of the tip."""
    x0, y0, run, e0, e1, slope, base = seen(lat, i, j0, px, py, pz, dx, dy, dz)
    r = r1 + rc
    if slope == 0.0:
        for j in range(a, b):
            x, y = x0 + lat.sa[j0 + j] * lat.ha, y0 + j * lat.hb
            u, v = x * e0 + y * e1, y * e0 - x * e1
            s = u if u > 0.0 else 0.0
            s = s if s < run else run
            away = np.sqrt(v * v + (u - s) * (u - s))
            over = away - r1 if away > r1 else 0.0
            room = rc * rc - over * over
            z[j + 1] = base + rc - np.sqrt(room if room > 0.0 else 0.0) if away < r else np.inf
        return
    for j in range(a, b):
        x, y = x0 + lat.sa[j0 + j] * lat.ha, y0 + j * lat.hb
        u, v = x * e0 + y * e1, y * e0 - x * e1
        hh = r * r - v * v
        h = np.sqrt(hh if hh > 0.0 else 0.0)
        s = u - h if slope > 0.0 else u + h
        s = s if s > 0.0 else 0.0
        s = s if s < run else run
        away = hh - (u - s) * (u - s)
        z[j + 1] = base + s * slope if away > -1e-12 * r * r and hh > 0.0 else np.inf


@leaf
def lower(top, low, own, i, a, b, z, lost, acc, block) -> None:
    """Lower a row to z."""
    for j in range(a, b):
        old, floor, new = top[i, j], low[i, j], z[j + 1]
        new = new if new > floor else floor
        new = new if old - new > SAME else old
        lost[j + 1] = old - new
        under = old if z[j + 1] < np.inf else -np.inf
        acc[5, j + 1] = under if under > acc[5, j + 1] else acc[5, j + 1]
        top[i, j] = new
        own[i, j] = block if new < old else own[i, j]


@leaf
def noted(a, b, lost, last, acc) -> None:
    """Add a row to the sums by column: a to b of it, and one more."""
    for j in range(a + 1, b + 1):
        acc[0, j] += lost[j]
        acc[3, j] += 1.0 if lost[j] > 0.0 else 0.0
        acc[4, j] = lost[j] if lost[j] > acc[4, j] else acc[4, j]
    for j in range(a + 1, b + 2):
        p, q = lost[j] - lost[j - 1], lost[j] - last[j]
        acc[1, j] += p * p + q * q


@leaf
def beside(top, low, i, a, b, z, before, acc) -> None:
    """Largest material that is left on a ray above where a neighbour of it was entered."""
    for j in range(a, b):
        height, floor = top[i, j], low[i, j]
        near = min(min(z[j], z[j + 2]), before[j + 1])
        gap = height - near
        rest = height - floor
        gap = gap if gap < rest else rest
        acc[2, j + 1] = gap if gap > acc[2, j + 1] else acc[2, j + 1]


@leaf
def above(top, low, i, a, b, z, acc) -> None:
    """The same of the row before, whose neighbour this row is."""
    for j in range(a, b):
        gap, rest = top[i - 1, j] - z[j + 1], top[i - 1, j] - low[i - 1, j]
        gap = gap if gap < rest else rest
        acc[2, j + 1] = gap if gap > acc[2, j + 1] else acc[2, j + 1]


@leaf
def goes_on(start, travel, k):
    """Whether a block begins where the one before it ended, and does not go down.

    Then rays behind its beginning meet it there first and lowest, as they met the end of the one before: they lose nothing.
    """
    if k == 0 or travel[k, 2] < 0.0 or travel[k, 0] ** 2 + travel[k, 1] ** 2 == 0.0:
        return False
    off = 0.0
    for c in range(3):
        off = max(off, abs(start[k - 1, c] + travel[k - 1, c] - start[k, c]))
    return off <= JOINED


@leaf
def reach(p, run, along, across, r, ahead):
    """Least and greatest coordinate of a stadium, or of the part of it that is ahead of its beginning p.

    along, across : of the way, of length 1, in this coordinate and in the other one. The back of the disc at the end is ahead
        of the beginning only where the way is long enough.
    """
    q = p + run * along
    low, high = min(p, q) - r, max(p, q) + r
    if ahead:
        if along >= 0.0:
            low = p - r * abs(across)
            if run >= r * along:
                low = min(low, q - r)
        if along <= 0.0:
            high = p + r * abs(across)
            if run >= -r * along:
                high = max(high, q + r)
    return low, high


@kernel
def lines(lat, i0, j0, first, last, top, low, own, start, travel, blocks, r1, rc, out) -> None:
    """Take straight blocks, one after the other, off the rows `first` to `last` of the window."""
    m = top.shape[1]
    z, lost, acc = np.full((2, m + 2), np.inf), np.zeros((2, m + 2)), np.zeros((6, m + 2))
    z0, z1, lost0, lost1 = z[0], z[1], lost[0], lost[1]
    r = r1 + rc
    for k in range(len(start)):
        px, py, pz = start[k, 0], start[k, 1], start[k, 2]
        dx, dy, dz = travel[k, 0], travel[k, 1], travel[k, 2]
        run = np.sqrt(dx * dx + dy * dy)
        e0, e1 = (dx / run, dy / run) if run > 0.0 else (1.0, 0.0)
        ahead = goes_on(start, travel, k)
        left, right = reach(px, run, e0, e1, r, ahead)
        front, back = reach(py, run, e1, e0, r, ahead)
        n0 = max(first, int(np.floor((left - lat.a0) / lat.ha)) - 1 - i0)
        n1 = min(last, int(np.floor((right - lat.a0) / lat.ha)) + 2 - i0)
        a = max(0, int(np.floor((front - lat.b0) / lat.hb)) - 1 - j0)
        b = min(m, int(np.floor((back - lat.b0) / lat.hb)) + 2 - j0)
        if n0 >= n1 or a >= b:
            continue
        for j in range(a, b + 2):
            z0[j], z1[j], lost0[j], lost1[j] = np.inf, np.inf, 0.0, 0.0
            acc[0, j], acc[1, j], acc[2, j], acc[3, j], acc[4, j] = 0.0, 0.0, 0.0, 0.0, 0.0
            acc[5, j] = -np.inf
        for i in range(n0, n1):
            if r1 == 0.0:
                ball_row(lat, i0 + i, j0, a, b, px, py, pz + rc, dx, dy, dz, rc, z1)
            else:
                flat_row(lat, i0 + i, j0, a, b, px, py, pz, dx, dy, dz, r1, rc, z1)
            lower(top, low, own, i, a, b, z1, lost1, acc, blocks[k])
            if i == first and first > 0:  # the row before is another thread's
                noted(a, b, lost1, lost1, acc)
            else:
                noted(a, b, lost1, lost0, acc)
            beside(top, low, i, a, b, z1, z0, acc)
            if i > n0:
                above(top, low, i, a, b, z1, acc)
            z0, z1, lost0, lost1 = z1, z0, lost1, lost0
        for j in range(a + 1, b + 1):
            out[k, 0] += acc[0, j]
            out[k, 1] += acc[1, j]
            out[k, 2] = max(out[k, 2], acc[2, j])
            out[k, 4] += acc[3, j]
            out[k, 3] = max(out[k, 3], acc[4, j])
            out[k, 5] = max(out[k, 5], acc[5, j] - pz - min(0.0, dz))


@kernel
def gather(lat, lists, i0, j0, top, low, own) -> bool:
    """Fill the map of a window; False where a ray has several intervals."""
    for i in range(top.shape[0]):
        for j in range(top.shape[1]):
            ray = (i0 + i) * lat.nb + j0 + j
            f, n = lists.first[ray], lists.parts[ray]
            if n > 1:
                return False
            own[i, j] = lists.above[f]
            if n == 0:
                top[i, j], low[i, j] = -1e300, -1e300
            else:
                top[i, j], low[i, j] = lists.high[f], lists.low[f]
    return True


@kernel
def scatter(lat, lists, i0, j0, top, low, own) -> None:
    """Write the map back."""
    for i in range(top.shape[0]):
        for j in range(top.shape[1]):
            ray = (i0 + i) * lat.nb + j0 + j
            f = lists.first[ray]
            if lists.parts[ray] == 1:
                lists.high[f], lists.above[f] = top[i, j], own[i, j]
                if top[i, j] <= low[i, j]:
                    lists.parts[ray] = 0
