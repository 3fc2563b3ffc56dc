# Straight blocks over level rays, in closed form.
#
# Legend: see dexel/_kernels.py for lattices and lists. start, travel (blocks, 3) origin of the profile and its way. seg rows of
#   the meridian as in sweep/_kernels.py. radius, lift, shank of a ball: its radius (0: no ball), height of its centre above
#   the origin, and of the shank above the centre. windows (blocks, 4): rows i0 to i1, columns j0 to j1.
# work (3, most rays of a window): where a ray enters and leaves the sweep (NaN: not), and what it loses.
#
# At a height z a level sweep of any body of revolution is a stadium of the radius that the body has there. That of a ball on a
#   ramp is a section of a capsule, and of the shank: a stadium over the part of the way on which the centre is below z. Both
#   overlap, and together they are convex.

import numpy as np

from vmachining.engines.dexel._kernels import SAME, overlap, roomy, stands, subtract, through_stadium
from vmachining.jit import kernel, leaf
from vmachining.sweep.ball._kernels import capsule_entry


@leaf
def radius_at(seg, z):
    """Largest radius of the body at a height; 0 above and below."""
    best = 0.0
    for i in range(len(seg)):
        low, high = seg[i, 1], seg[i, 3]
        if high <= low or z < low or z > high:
            continue
        if seg[i, 6] == 0.0:
            share = (z - low) / (high - low)
            r = (1.0 - share) * seg[i, 0] + share * seg[i, 2]
        else:
            r = seg[i, 4] + np.sqrt(max(seg[i, 6] ** 2 - (z - seg[i, 5]) ** 2, 0.0))
        best = max(best, r)
    return best


@leaf
def section(x, y, ux, uy, dx, dy, s0, s1, r):
    """Part of a line in the plane within r of the way from s0 to s1 (0 to 1) along (dx, dy)."""
    length = np.sqrt(dx * dx + dy * dy)
    e0, e1 = 1.0, 0.0
    if length > 0.0:
        e0, e1 = dx / length, dy / length
    x, y = x - s0 * dx, y - s0 * dy
    return through_stadium(
        x * e0 + y * e1, y * e0 - x * e1, ux * e0 + uy * e1, uy * e0 - ux * e1, (s1 - s0) * length, r
    )


@leaf
def inside(seg, radius, lift, shank, dx, dy, dz, x, y, z, ux, uy):
    """Part (p, q) of the level line from (x, y, z), relative to the origin of the profile at the start, in the sweep."""
    if radius == 0.0 or dz == 0.0:
        r = radius_at(seg, z)
        if r <= 0.0:
            return 1.0, 0.0
        return section(x, y, ux, uy, dx, dy, 0.0, 1.0, r)
    z -= lift
    p = capsule_entry(x, y, z, ux, uy, 0.0, dx, dy, dz, radius)
    q = -np.inf
    if p < np.inf:
        q = -capsule_entry(x, y, z, -ux, -uy, 0.0, dx, dy, dz, radius)
    # the shank: centres below z, and not more than its height below
    s0, s1 = (z - shank) / dz, z / dz
    s0, s1 = max(0.0, min(s0, s1)), min(1.0, max(s0, s1))
    if s0 <= s1:
        a, b = section(x, y, ux, uy, dx, dy, s0, s1, radius)
        if a <= b:
            p, q = min(p, a), max(q, b)
    return p, q


@leaf
def has_room(lat, lists, i0, i1, j0, j1):
    """Whether every ray of a window can be given room for one interval more."""
    need = 0
    for i in range(i0, i1):
        for j in range(j0, j1):
            ray = i * lat.nb + j
            if lists.room[ray] <= lists.parts[ray]:
                need += 2 * lists.room[ray] + 1
    return lists.used[0] + need <= len(lists.low)


@leaf
def is_bare(lat, lists, i, j):
    """Whether the four rays beside one have no material."""
    ray = i * lat.nb + j
    return not (
        (i > 0 and lists.parts[ray - lat.nb] > 0)
        or (i + 1 < lat.na and lists.parts[ray + lat.nb] > 0)
        or (j > 0 and lists.parts[ray - 1] > 0)
        or (j + 1 < lat.nb and lists.parts[ray + 1] > 0)
    )


@leaf
def bare(lists, nb, i0, i1, j0, j1):
    """Whether no ray of a rectangle has material."""
    for i in range(i0, i1):
        for j in range(j0, j1):
            if lists.parts[i * nb + j] > 0:
                return False
    return True


@leaf
def alive(lists, nb, i0, i1, j0, j1):
    """The part of a rectangle that holds all its rays with material, and those beside them."""
    a0, a1, b0, b1 = i0, i1, j0, j1
    while a0 < a1 and bare(lists, nb, a0, a0 + 1, b0, b1):
        a0 += 1
    while a0 < a1 and bare(lists, nb, a1 - 1, a1, b0, b1):
        a1 -= 1
    while b0 < b1 and bare(lists, nb, a0, a1, b0, b0 + 1):
        b0 += 1
    while b0 < b1 and bare(lists, nb, a0, a1, b1 - 1, b1):
        b1 -= 1
    return max(i0, a0 - 1), min(i1, a1 + 1), max(j0, b0 - 1), min(j1, b1 + 1)


@kernel
def side_lines(
    lat, lists, windows, start, travel, seg, radius, lift, shank, blocks, low, high, work, out, begin
) -> int:
    """Take blocks from number `begin` on; how far it came: less than their number where the arrays are full.

    low, high (blocks,) : mm, of the sweep along the rays. out (blocks, 6) : see `tell`, and whether material is near (0 or 1).
    """
    o, u = np.zeros(3), np.zeros(3)
    u[lat.axis] = 1.0
    for k in range(begin, len(blocks)):
        i0, i1, j0, j1 = alive(lists, lat.nb, windows[k, 0], windows[k, 1], windows[k, 2], windows[k, 3])
        if not has_room(lat, lists, i0, i1, j0, j1):
            return k
        dx, dy, dz = travel[k, 0], travel[k, 1], travel[k, 2]
        n = j1 - j0
        for i in range(i0, i1):
            for j in range(j0, j1):
                ray, m = i * lat.nb + j, (i - i0) * n + j - j0
                work[0, m], work[1, m], work[2, m] = np.nan, np.nan, 0.0
                if lists.parts[ray] == 0 and is_bare(lat, lists, i, j):
                    continue
                stands(lat, ray, o)
                for c in range(3):
                    o[c] -= start[k, c]
                p, q = inside(seg, radius, lift, shank, dx, dy, dz, o[0], o[1], o[2], u[0], u[1])
                f = lists.first[ray]
                if out[k, 5] == 0.0:
                    for e in range(f, f + lists.parts[ray]):
                        if lists.low[e] < high[k] and lists.high[e] > low[k]:
                            out[k, 5] = 1.0
                if p < q:
                    work[0, m], work[1, m] = p, q
                    if lists.parts[ray] > 0 and roomy(lists, ray, lists.parts[ray] + 1):
                        work[2, m] = subtract(lists, ray, p, q, blocks[k])
        for i in range(i0, i1):
            for j in range(j0, j1):
                ray, m = i * lat.nb + j, (i - i0) * n + j - j0
                gone = work[2, m]
                out[k, 0] += gone
                out[k, 3] = max(out[k, 3], gone)
                out[k, 4] += gone > SAME
                if i + 1 < i1:
                    out[k, 1] += (work[2, m + n] - gone) ** 2
                if j + 1 < j1:
                    out[k, 1] += (work[2, m + 1] - gone) ** 2
                if lists.parts[ray] == 0:
                    continue
                for side in range(4):
                    x, y = i + (side == 0) - (side == 1), j + (side == 2) - (side == 3)
                    if x < i0 or y < j0 or x >= i1 or y >= j1:
                        continue
                    w = (x - i0) * n + y - j0
                    if work[0, w] <= work[1, w]:
                        out[k, 2] = max(out[k, 2], overlap(lists, ray, work[0, w], work[1, w]))
    return len(blocks)
