# Dual contouring of interval lists: one vertex in every cell of eight nodes that differ, one quad for every pair of
# neighbouring nodes that differ.
#
# Legend: nodes (i, j, k) stand in the middles of the coarse cells of a grid, `step` rays apart, and whether one is material
#   is what the upright ray of its cell says at its height; nodes -1 and n[.] outside of the stock are not. Cell (i, j, k) has
#   the nodes i - 1, i and so on, its vertex is the mean of the ends of rays that separate its nodes.
#   box (2, 3) mm; size (3,) mm of coarse cells.
# grids: upright rays, and those along x and y (a grid without rays where there are none).

import numpy as np

from vmachining.engines.dexel._kernels import stands
from vmachining.jit import kernel, leaf


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
    here, before = (
        np.zeros((n[1] + 2, n[2] + 2), dtype=np.uint8),
        np.zeros((n[1] + 2, n[2] + 2), dtype=np.uint8),
    )
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
def crossing(lats, lists, step, box, size, n, axis, i, j, k, inside, at) -> int:
    """Where the surface lies between node (i, j, k) and the next lower one along an axis: fills `at`, returns the block.

    inside : whether (i, j, k) is the node in the material. lats, lists: along z, x, y.
    """
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
            return block
    for c in range(3):
        at[c] = height(box, size, c, place[c])
    at[axis] = border
    one = (i - (axis == 0), j - (axis == 1)) if inside else (i, j)  # the column that is empty here
    if not (0 <= one[0] < n[0] and 0 <= one[1] < n[1]):
        return -1
    return owner(lists[0], number(lats[0], step, one[0], one[1]), at[2])


@leaf
def vertex(ids, slab, j, k, total, weight, used):
    """Number of the vertex of a cell; a new one where it has none."""
    if ids[slab, j, k] < 0:
        ids[slab, j, k] = used[0]
        total[used[0], 0], total[used[0], 1], total[used[0], 2] = 0.0, 0.0, 0.0
        weight[used[0]] = 0.0
        used[0] += 1
    return ids[slab, j, k]


@kernel
def contour(lats, lists, step, box, size, n, total, weight, quads, blocks, used) -> int:
    """Quads (m, 4) of vertices, counterclockwise from outside, and their blocks (m,); vertex = total / weight; their number."""
    here, before = (
        np.zeros((n[1] + 2, n[2] + 2), dtype=np.uint8),
        np.zeros((n[1] + 2, n[2] + 2), dtype=np.uint8),
    )
    ids = np.full((2, n[1] + 1, n[2] + 1), -1)
    at, corner = np.zeros(3), np.zeros(4, dtype=np.int64)
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
                    block = crossing(lats, lists, step, box, size, n, axis, i, j, k, inside == 1, at)
                    for c in range(4):
                        # cells about the pair of nodes, counterclockwise seen from its upper end
                        p, q = (1 if c in (1, 2) else 0), (1 if c in (2, 3) else 0)
                        if axis == 0:
                            v = vertex(ids, 0, j + p, k + q, total, weight, used)
                        elif axis == 1:
                            v = vertex(ids, q, j, k + p, total, weight, used)
                        else:
                            v = vertex(ids, p, j + q, k, total, weight, used)
                        corner[c] = v
                        for m in range(3):
                            total[v, m] += at[m]
                        weight[v] += 1.0
                    for c in range(4):
                        quads[found, c] = corner[3 - c] if inside == 1 else corner[c]
                    blocks[found] = block
                    found += 1
        before, here = here, before
        ids[0] = ids[1]
    return found
