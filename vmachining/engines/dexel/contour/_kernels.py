# Dual contouring of interval lists: one vertex in every cell of eight nodes that differ, one quad for every pair of
# neighbouring nodes that differ.
#
# Legend: nodes (i, j, k) stand in the middles of the coarse cells of a grid, `step` rays apart, and whether one is material
#   is what the upright ray of its cell says at its height; nodes -1 and n[.] outside of the stock are not. Cell (i, j, k) has
#   the nodes i - 1, i and so on. Its vertex is the point x that is nearest to the planes through the ends of rays that separate
#   its nodes, and a little to their mean: sum (n . (x - p))^2 + PULL |x - m|^2 is least.
#   box (2, 3) mm; size (3,) mm of coarse cells.
# sums (vertices, 13) of a cell: points p (3), how many; n n' (6: xx, xy, xz, yy, yz, zz), n (n . p) (3).
# grids: upright rays, and those along x and y (a grid without rays where none exist).

import numpy as np

from vmachining.engines.dexel._kernels import stands
from vmachining.jit import kernel, leaf

PULL = 0.01  # weight of the mean of a cell's ends beside their planes, per end


@leaf
def number(lat, step, i, j):
    """Number of the ray that stands for coarse cell (i, j) of its lattice."""
    return min(i * step + step // 2, lat.na - 1) * lat.nb + min(j * step + step // 2, lat.nb - 1)


@leaf
def height(box, size, axis, k):
    """mm of the middle of coarse cell k."""
    return box[0, axis] + (k + 0.5) * size[axis]


@leaf
def plane(lat, lists, step, box, size, n, i, sign) -> None:
    """Signs (n_y + 2, n_z + 2) of the nodes with x number i; one more on every side that is outside."""
    sign[:] = 0
    if i < 0 or i >= n[0]:
        return
    for j in range(n[1]):
        ray = number(lat, step, i, j)
        f = lists.first[ray]
        for m in range(f, f + lists.parts[ray]):
            k0 = int(np.ceil((lists.low[m] - box[0, 2]) / size[2] - 0.5))
            k1 = int(np.floor((lists.high[m] - box[0, 2]) / size[2] - 0.5))
            for k in range(max(k0, 0), min(k1, n[2] - 1) + 1):
                sign[j + 1, k + 1] = 1


@kernel
def count(lat, lists, step, box, size, n) -> int:
    """Pairs of nodes that differ."""
    shape = (n[1] + 2, n[2] + 2)
    here, before = np.zeros(shape, dtype=np.uint8), np.zeros(shape, dtype=np.uint8)
    found = 0
    for i in range(n[0] + 1):
        plane(lat, lists, step, box, size, n, i, here)
        for j in range(n[1] + 1):
            for k in range(n[2] + 1):
                found += here[j, k] != here[j + 1, k]
                found += here[j, k] != here[j, k + 1]
                found += before[j, k] != here[j, k]
        before, here = here, before
    return found


@leaf
def end_near(lat, lists, ray, at, reach, rising):
    """End of an interval of a ray nearest to `at`: (s, block, found). rising: material lies above the end."""
    best, block, gap = 0.0, -1, reach
    f = lists.first[ray]
    for m in range(f, f + lists.parts[ray]):
        s = lists.low[m] if rising else lists.high[m]
        if abs(s - at) <= gap:
            best, block, gap = s, lists.below[m] if rising else lists.above[m], abs(s - at)
    return best, block, gap < reach


@leaf
def beside(lat, lists, step, p, q, s, reach, rising, at, here, slope) -> int:
    """Slope of the surface along one of the two ways across the rays, from the nearer of both neighbours.

    slope (3,): way a, way b, rise from here to there; 1 if a neighbour ends near by, else 0. here: place of the ray (a, b).
    """
    best, found = np.inf, 0
    for side in range(2):
        d = 2 * side - 1
        i, j = p + (d if at == 0 else 0), q + (d if at == 1 else 0)
        if i < 0 or j < 0 or i * step >= lat.na or j * step >= lat.nb:
            continue
        ray = number(lat, step, i, j)
        if ray == number(lat, step, p, q):
            continue
        t, _block, near = end_near(lat, lists, ray, s, reach, rising)
        if near and abs(t - s) < best:
            k, m = ray // lat.nb, ray % lat.nb
            best, found = abs(t - s), 1
            slope[0] = (k + lat.sa[m]) * lat.ha - here[0]
            slope[1] = (m + lat.sb[k]) * lat.hb - here[1]
            slope[2] = t - s
    return found


@leaf
def normal(lat, lists, step, p, q, s, reach, rising, here, one, other, n) -> int:
    """Unit normal (3,) at an end of a ray, from ends of rays beside it; 0 where none exist."""
    ray = number(lat, step, p, q)
    k, m = ray // lat.nb, ray % lat.nb
    here[0], here[1] = (k + lat.sa[m]) * lat.ha, (m + lat.sb[k]) * lat.hb
    has_a = beside(lat, lists, step, p, q, s, reach, rising, 0, here, one)
    has_b = beside(lat, lists, step, p, q, s, reach, rising, 1, here, other)
    g_a, g_b = 0.0, 0.0
    if has_a and has_b:
        det = one[0] * other[1] - one[1] * other[0]
        if abs(det) < 1e-3 * abs(one[0] * other[1]) or det == 0.0:
            return 0
        g_a = (one[2] * other[1] - one[1] * other[2]) / det
        g_b = (one[0] * other[2] - one[2] * other[0]) / det
    elif has_a and one[0] != 0.0:
        g_a = one[2] / one[0]
    elif has_b and other[1] != 0.0:
        g_b = other[2] / other[1]
    else:
        return 0
    size = np.sqrt(1.0 + g_a * g_a + g_b * g_b)
    n[lat.axis] = 1.0 / size
    n[(lat.axis + 1) % 3], n[(lat.axis + 2) % 3] = -g_a / size, -g_b / size
    return 1


@leaf
def owner(lists, ray, z):
    """Block whose end lies nearest to height z on a ray, -1 where it has none."""
    block, gap = -1, np.inf
    f = lists.first[ray]
    for m in range(f, f + lists.parts[ray]):
        if abs(lists.low[m] - z) < gap:
            block, gap = lists.below[m], abs(lists.low[m] - z)
        if abs(lists.high[m] - z) < gap:
            block, gap = lists.above[m], abs(lists.high[m] - z)
    return block


@leaf
def crossing(lats, lists, step, box, size, n, axis, i, j, k, inside, at, work) -> int:
    """Where the surface lies between node (i, j, k) and the next lower one along an axis: fills `at`, returns the block.

    inside : whether (i, j, k) is the node in the material. lats, lists: along z, x, y. work (4, 3): row 0 is the normal
    there, 0 where it is not known.
    """
    work[0, :] = 0.0
    which = 0 if axis == 2 else axis + 1
    lat, own = lats[which], lists[which]
    place = (i, j, k)
    border = box[0, axis] + place[axis] * size[axis]
    p, q = place[(axis + 1) % 3], place[(axis + 2) % 3]
    if lat.na > 0:
        ray = number(lat, step, p, q)
        s, block, found = end_near(lat, own, ray, border, 1.5 * size[axis], inside)
        if found:
            stands(lat, ray, at)
            at[axis] = s
            normal(lat, own, step, p, q, s, 1.5 * size[axis], inside, work[1], work[2], work[3], work[0])
            return block
    for c in range(3):
        at[c] = height(box, size, c, place[c])
    at[axis] = border
    one = (i - (axis == 0), j - (axis == 1)) if inside else (i, j)  # the column that is empty here
    if not (0 <= one[0] < n[0] and 0 <= one[1] < n[1]):
        return -1
    return owner(lists[0], number(lats[0], step, one[0], one[1]), at[2])


@leaf
def vertex(ids, slab, j, k, sums, used):
    """Number of the vertex of a cell; a new one where it has none."""
    if ids[slab, j, k] < 0:
        ids[slab, j, k] = used[0]
        sums[used[0], :] = 0.0
        used[0] += 1
    return ids[slab, j, k]


@kernel
def contour(lats, lists, step, box, size, n, sums, cells, quads, blocks, used) -> int:
    """Quads (m, 4) of vertices, counterclockwise from outside, and their blocks (m,); their number.

    sums : of each vertex, see `settle`. cells (vertices, 3) whose they are.
    """
    shape = (n[1] + 2, n[2] + 2)
    here, before = np.zeros(shape, dtype=np.uint8), np.zeros(shape, dtype=np.uint8)
    ids = np.full((2, n[1] + 1, n[2] + 1), -1)
    at, corner, work = np.zeros(3), np.zeros(4, dtype=np.int64), np.zeros((4, 3))
    found = 0
    for i in range(n[0] + 1):
        plane(lats[0], lists[0], step, box, size, n, i, here)
        ids[1] = -1
        for axis in range(3):
            for j in range(n[1] + (axis == 1)):
                for k in range(n[2] + (axis == 2)):
                    inside = here[j + 1, k + 1]
                    if axis == 0:
                        other = before[j + 1, k + 1]
                    elif axis == 1:
                        other = here[j, k + 1]
                    else:
                        other = here[j + 1, k]
                    if inside == other:
                        continue
                    block = crossing(lats, lists, step, box, size, n, axis, i, j, k, inside == 1, at, work)
                    for c in range(4):
                        # cells about the pair of nodes, counterclockwise seen from its upper end
                        p, q = (1 if c in (1, 2) else 0), (1 if c in (2, 3) else 0)
                        if axis == 0:
                            slab, y, z = 0, j + p, k + q
                        elif axis == 1:
                            slab, y, z = q, j, k + p
                        else:
                            slab, y, z = p, j + q, k
                        v = vertex(ids, slab, y, z, sums, used)
                        corner[c] = v
                        cells[v, 0], cells[v, 1], cells[v, 2] = i + slab, y, z
                        row = 4
                        along = work[0, 0] * at[0] + work[0, 1] * at[1] + work[0, 2] * at[2]
                        for m in range(3):
                            sums[v, m] += at[m]
                            sums[v, 10 + m] += work[0, m] * along
                            for o in range(m, 3):
                                sums[v, row] += work[0, m] * work[0, o]
                                row += 1
                        sums[v, 3] += 1.0
                    for c in range(4):
                        quads[found, c] = corner[3 - c] if inside == 1 else corner[c]
                    blocks[found] = block
                    found += 1
        before, here = here, before
        ids[0] = ids[1]
    return found


@kernel
def settle(sums, cells, box, size, out) -> None:
    """Vertices (n, 3) mm: least squares of planes and mean, within the cell."""
    for v in range(len(out)):
        count = sums[v, 3]
        x, y, z = sums[v, 0] / count, sums[v, 1] / count, sums[v, 2] / count
        pull = PULL * count
        a, b, c = sums[v, 4] + pull, sums[v, 5], sums[v, 6]
        d, e, f = sums[v, 7] + pull, sums[v, 8], sums[v, 9] + pull
        # right side about the mean: sum n (n . p) - (sum n n') m
        r = sums[v, 10] - (sums[v, 4] * x + b * y + c * z)
        s = sums[v, 11] - (b * x + sums[v, 7] * y + e * z)
        t = sums[v, 12] - (c * x + e * y + sums[v, 9] * z)
        m0, m1, m2 = d * f - e * e, c * e - b * f, b * e - c * d
        det = a * m0 + b * m1 + c * m2
        out[v, 0] = x + (m0 * r + m1 * s + m2 * t) / det
        out[v, 1] = y + (m1 * r + (a * f - c * c) * s + (b * c - a * e) * t) / det
        out[v, 2] = z + (m2 * r + (b * c - a * e) * s + (a * d - b * b) * t) / det
        for k in range(3):
            low, high = box[0, k] + (cells[v, k] - 1.0) * size[k], box[0, k] + (cells[v, k] + 1.0) * size[k]
            out[v, k] = min(max(out[v, k], max(low, box[0, k])), min(high, box[1, k]))
