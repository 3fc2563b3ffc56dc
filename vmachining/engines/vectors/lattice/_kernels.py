# Vectors along normals on lattices: where they stand, which of them are near, and how intervals of their lines shorten them.
#
# Legend: a patch is a facet, an edge or a point, with one direction for all its vectors. Its vectors stand in rows along its
#   longest side, rows and vectors at most `spacing` apart; a patch without width has one row. A group is a piece of at most
#   SIDE rows and, of each, one of `parts_of` equal shares: up to 64 vectors that lie together.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.engines.vectors._kernels import shortened
from vmachining.jit import kernel, leaf

SIDE, MOST_LONG = 8, 4  # a group has SIDE rows, and at most so many times SIDE vectors in one
LEAF = 16  # groups in a leaf of their tree


class Lattice(NamedTuple):
    """Vectors of m patches in g groups; n lengths.

    corner : (m, 3, 3) mm, the longest side first. normal : (m, 3) unit. spacing : mm.
    patch, place : (g,) int32, the patch of a group and which of its groups it is, see `rows_and_part`. first : (g + 1,) int32
        of the vectors of each group. middle : (g, 3) float32 mm and half : (g,) float32 mm: a ball about all feet. reach : (g,)
        float32 mm, no length is larger.
    low : lambda, float32 mm, one for a whole group or one a vector, from low_first (g + 1,) int32 on.
    length : (n,) float32 mm. behind : (n / 8,) bits, entered from behind.
    boxes : a tree of boxes over groups in their order, LEAF in a leaf, see `geometry.boxtree`: all pieces from lambda to L.
    """

    corner: NDArray[np.float64]
    normal: NDArray[np.float64]
    spacing: float
    patch: NDArray[np.int32]
    place: NDArray[np.int32]
    first: NDArray[np.int32]
    middle: NDArray[np.float32]
    half: NDArray[np.float32]
    reach: NDArray[np.float32]
    low_first: NDArray[np.int32]
    low: NDArray[np.float32]
    length: NDArray[np.float32]
    behind: NDArray[np.uint8]
    boxes: NDArray[np.float64]


@leaf
def patch_size(corner, m):
    """Length of the longest side of a patch, mm, and its width across."""
    best, tall = 0.0, 0.0
    for c in range(3):
        best += (corner[m, 1, c] - corner[m, 0, c]) ** 2
    if best == 0.0:
        return 0.0, 0.0
    foot = 0.0
    for c in range(3):
        foot += (corner[m, 2, c] - corner[m, 0, c]) * (corner[m, 1, c] - corner[m, 0, c]) / best
    for c in range(3):
        tall += (corner[m, 2, c] - corner[m, 0, c] - foot * (corner[m, 1, c] - corner[m, 0, c])) ** 2
    return np.sqrt(best), np.sqrt(tall)


@leaf
def rows_of(tall, spacing):
    """Number of rows of a patch."""
    if tall == 0.0:
        return 1
    return max(1, int(np.ceil(tall / spacing - 1e-9)))


@leaf
def row_of(base, tall, rows, i, spacing):
    """Share of the way from the longest side to the opposite corner at which row i lies, and the vectors in it."""
    share = 0.0 if tall == 0.0 else (i + 0.5) / rows
    return share, max(1, int(np.ceil((1.0 - share) * base / spacing - 1e-9)))


@leaf
def coordinate(corner, m, c, share, t):
    """Coordinate c of the point at t along the longest side and `share` towards the opposite corner."""
    a = corner[m, 0, c]
    return a + t * (corner[m, 1, c] - a) + share * (corner[m, 2, c] - a)


@leaf
def parts_of(base, rows, spacing):
    """Groups along the longest side: SIDE vectors each, more where there are few rows."""
    long = SIDE * min(max(SIDE // rows, 1), MOST_LONG)
    return max(1, int(np.ceil(base / (long * spacing) - 1e-9)))


@leaf
def rows_and_part(lattice, g, base, rows):
    """First row of a group, the one behind its last, its share of each row and how many shares there are."""
    count = parts_of(base, rows, lattice.spacing)
    band, part = lattice.place[g] // count, lattice.place[g] % count
    return band * SIDE, min((band + 1) * SIDE, rows), part, count


@kernel
def count_groups(corner, spacing, first) -> None:
    """first (m + 1,): groups of patch k into first[k + 1]."""
    for m in range(len(corner)):
        base, tall = patch_size(corner, m)
        rows = rows_of(tall, spacing)
        first[m + 1] = ((rows - 1) // SIDE + 1) * parts_of(base, rows, spacing)


@kernel
def lay_groups(corner, spacing, at, patch, place, first, middle, half) -> None:
    """Fill the groups; those of patch k begin at at[k]. first (g + 1,): numbers of vectors into first[g + 1]."""
    for m in range(len(corner)):
        base, tall = patch_size(corner, m)
        rows = rows_of(tall, spacing)
        g = at[m]
        count = parts_of(base, rows, spacing)
        for b in range((rows - 1) // SIDE + 1):
            for p in range(count):
                patch[g], place[g] = m, b * count + p
                n = 0
                low0, low1, low2 = np.inf, np.inf, np.inf
                high0, high1, high2 = -np.inf, -np.inf, -np.inf
                for i in range(b * SIDE, min((b + 1) * SIDE, rows)):
                    share, many = row_of(base, tall, rows, i, spacing)
                    j0, j1 = p * many // count, (p + 1) * many // count
                    n += j1 - j0
                    for j in (j0, j1 - 1):
                        if j1 == j0:
                            continue
                        t = (1.0 - share) * (j + 0.5) / many
                        x, y = coordinate(corner, m, 0, share, t), coordinate(corner, m, 1, share, t)
                        z = coordinate(corner, m, 2, share, t)
                        low0, high0 = min(low0, x), max(high0, x)
                        low1, high1 = min(low1, y), max(high1, y)
                        low2, high2 = min(low2, z), max(high2, z)
                first[g + 1] = n
                if n > 0:
                    middle[g, 0], middle[g, 1], middle[g, 2] = (
                        0.5 * (low0 + high0),
                        0.5 * (low1 + high1),
                        0.5 * (low2 + high2),
                    )
                    far = 0.5 * np.sqrt((high0 - low0) ** 2 + (high1 - low1) ** 2 + (high2 - low2) ** 2)
                    size = max(abs(low0), abs(high0), abs(low1), abs(high1), abs(low2), abs(high2))
                    half[g] = far * (1.0 + 1e-6) + 1e-6 * size  # float32 above
                g += 1


@kernel
def feet(lattice: Lattice, groups, out) -> None:
    """Feet (k, 3) of all vectors of some groups, one group after the other."""
    n = 0
    corner, spacing = lattice.corner, lattice.spacing
    for g in groups:
        m = lattice.patch[g]
        base, tall = patch_size(corner, m)
        rows = rows_of(tall, spacing)
        i0, i1, p, count = rows_and_part(lattice, g, base, rows)
        for i in range(i0, i1):
            share, many = row_of(base, tall, rows, i, spacing)
            for j in range(p * many // count, (p + 1) * many // count):
                t = (1.0 - share) * (j + 0.5) / many
                for c in range(3):
                    out[n, c] = coordinate(corner, m, c, share, t)
                n += 1


@leaf
def low_of(lattice, g, k):
    """lambda of vector k of group g, counted from its first."""
    at = lattice.low_first[g]
    if lattice.low_first[g + 1] - at > 1:
        at += k
    return np.float64(lattice.low[at])


@kernel
def lows(lattice: Lattice, groups, out) -> None:
    """lambda of all vectors of some groups."""
    n = 0
    for g in groups:
        for k in range(lattice.first[g + 1] - lattice.first[g]):
            out[n] = low_of(lattice, g, k)
            n += 1


@leaf
def deepest(lattice, g):
    """The lowest lambda of a group."""
    best = np.float64(lattice.low[lattice.low_first[g]])
    for k in range(lattice.low_first[g] + 1, lattice.low_first[g + 1]):
        best = min(best, np.float64(lattice.low[k]))
    return best


@leaf
def longest(lattice, g):
    """The largest length of a group."""
    best = lattice.length[lattice.first[g]]
    for k in range(lattice.first[g] + 1, lattice.first[g + 1]):
        best = max(best, lattice.length[k])
    return best


@leaf
def box_apart(boxes, k, x0, x1, y0, y1, z0, z1):
    """Whether box k lies apart from another one; an empty one does."""
    return (
        boxes[k, 0] > x1 or boxes[k, 3] < x0 or boxes[k, 1] > y1 or boxes[k, 4] < y0 or boxes[k, 2] > z1 or boxes[k, 5] < z0
    )  # fmt: skip


@leaf
def extent(lattice, g, c, down, up):
    """Coordinate c of a box about the vectors of a group from `down` to `up`."""
    n, half = lattice.normal[lattice.patch[g], c], np.float64(lattice.half[g])
    p, q = lattice.middle[g, c] + down * n, lattice.middle[g, c] + up * n
    return min(p, q) - half, max(p, q) + half


@kernel
def ends(lattice: Lattice, low, high) -> None:
    """Boxes (g, 3) about the pieces of the vectors of every group."""
    for g in range(len(lattice.patch)):
        down, up = deepest(lattice, g), np.float64(lattice.reach[g])
        for c in range(3):
            low[g, c], high[g, c] = extent(lattice, g, c, down, up)


@kernel
def near_groups(lattice: Lattice, box, out) -> int:
    """Groups of which a vector may come into a box (2, 3), into out (g,), rising; their number."""
    stack = np.empty(128, dtype=np.int64)
    leaves = (len(lattice.boxes) + 1) // 2
    found, top = 0, 1
    stack[0] = 0
    while top > 0:
        top -= 1
        node = stack[top]
        if box_apart(lattice.boxes, node, box[0, 0], box[1, 0], box[0, 1], box[1, 1], box[0, 2], box[1, 2]):
            continue
        if node < leaves - 1:
            stack[top], stack[top + 1] = 2 * node + 2, 2 * node + 1
            top += 2
            continue
        begin = (node - leaves + 1) * LEAF
        for g in range(begin, min(begin + LEAF, len(lattice.patch))):
            down, up = deepest(lattice, g), np.float64(lattice.reach[g])
            apart = False
            for c in range(3):
                low, high = extent(lattice, g, c, down, up)
                apart = apart or low > box[1, c] or high < box[0, c]
            if not apart:
                out[found] = g
                found += 1
    return found


@kernel
def shorten(lattice: Lattice, groups, at, first, enter, leave) -> None:
    """Shorten vectors by the intervals of their lines: first[i] to first[i + 1] of enter and leave, rising, for at (n,).

    at : numbers among all vectors of `groups`, one group after the other, rising.
    """
    behind_them, i = 0, 0
    for g in groups:
        count = lattice.first[g + 1] - lattice.first[g]
        changed = False
        while i < len(at) and at[i] < behind_them + count:
            k = lattice.first[g] + at[i] - behind_them
            low = low_of(lattice, g, at[i] - behind_them)
            for j in range(first[i], first[i + 1]):
                new, flag = shortened(enter[j], leave[j], low, np.float64(lattice.length[k]))
                lattice.length[k] = new
                if flag:
                    lattice.behind[k // 8] |= np.uint8(1 << (k % 8))
                changed = True
            i += 1
        if changed:
            lattice.reach[g] = longest(lattice, g)
        behind_them += count


@kernel
def count_vectors(corner, spacing) -> int:
    """Vectors of all patches."""
    n = 0
    for m in range(len(corner)):
        base, tall = patch_size(corner, m)
        rows = rows_of(tall, spacing)
        for i in range(rows):
            n += row_of(base, tall, rows, i, spacing)[1]
    return n
