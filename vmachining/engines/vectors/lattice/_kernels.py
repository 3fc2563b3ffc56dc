# Vectors along normals on lattices: where they stand, and what blocks of ball cutters make of them.
#
# Legend: a patch is a facet, an edge or a point, with one direction for all its vectors. Its vectors stand in rows along its
#   longest side, rows and vectors at most `spacing` apart; a patch without width has one row. A group is a piece of at most
#   SIDE rows and, of each, one of `parts` equal shares: up to 64 vectors that lie together.
#   Blocks of ball cutters: rows of centre x y z, travel x y z, radius, height of the shank.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.engines.vectors._kernels import shortened
from vmachining.jit import kernel, leaf
from vmachining.sweep.ball._kernels import ball_entry, capsule_entry, in_ball_sweep

SIDE, MOST_LONG = 8, 4  # a group has SIDE rows, and at most so many times SIDE vectors in one
LEAF, RUN = 8, 16  # groups in a leaf of their tree, blocks that have a box together


class Lattice(NamedTuple):
    """Vectors of m patches in g groups; n lengths.

    corner : (m, 3, 3) mm, the longest side first. normal : (m, 3) unit. spacing : mm.
    patch, band, part, parts : (g,) int32. first : (g + 1,) of the vectors of each group. middle : (g, 3) float32 mm and
        half : (g,) float32 mm: a ball about all feet. reach : (g,) float32 mm, no length is larger.
    low : lambda, float32 mm, one for a whole group or one a vector, from low_first (g + 1,) on.
    length : (n,) float32 mm. behind : (n / 8,) bits, entered from behind.
    boxes : a tree of boxes over groups in their order, LEAF in a leaf, see `geometry.boxtree`: all pieces from lambda to L.
    """

    corner: NDArray[np.float64]
    normal: NDArray[np.float64]
    spacing: float
    patch: NDArray[np.int32]
    band: NDArray[np.int32]
    part: NDArray[np.int32]
    parts: NDArray[np.int32]
    first: NDArray[np.int64]
    middle: NDArray[np.float32]
    half: NDArray[np.float32]
    reach: NDArray[np.float32]
    low_first: NDArray[np.int64]
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


@kernel
def count_groups(corner, spacing, first) -> None:
    """first (m + 1,): groups of patch k into first[k + 1]."""
    for m in range(len(corner)):
        base, tall = patch_size(corner, m)
        rows = rows_of(tall, spacing)
        first[m + 1] = ((rows - 1) // SIDE + 1) * parts_of(base, rows, spacing)


@kernel
def lay_groups(corner, spacing, at, patch, band, part, parts, first, middle, half) -> None:
    """Fill the groups; those of patch k begin at at[k]. first (g + 1,): numbers of vectors into first[g + 1]."""
    for m in range(len(corner)):
        base, tall = patch_size(corner, m)
        rows = rows_of(tall, spacing)
        g = at[m]
        count = parts_of(base, rows, spacing)
        for b in range((rows - 1) // SIDE + 1):
            for p in range(count):
                patch[g], band[g], part[g], parts[g] = m, b, p, count
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
        m, b, p, count = lattice.patch[g], lattice.band[g], lattice.part[g], lattice.parts[g]
        base, tall = patch_size(corner, m)
        rows = rows_of(tall, spacing)
        for i in range(b * SIDE, min((b + 1) * SIDE, rows)):
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


@kernel
def ends(lattice: Lattice, low, high) -> None:
    """Boxes (g, 3) about the pieces of the vectors of every group."""
    for g in range(len(lattice.patch)):
        m, half = lattice.patch[g], np.float64(lattice.half[g])
        down, up = deepest(lattice, g), np.float64(lattice.reach[g])
        for c in range(3):
            n = lattice.normal[m, c]
            p, q = lattice.middle[g, c] + down * n, lattice.middle[g, c] + up * n
            low[g, c], high[g, c] = min(p, q) - half, max(p, q) + half


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
            m, half = lattice.patch[g], np.float64(lattice.half[g])
            low, high = deepest(lattice, g), np.float64(lattice.reach[g])
            apart = False
            for c in range(3):
                n = lattice.normal[m, c]
                p, q = lattice.middle[g, c] + low * n, lattice.middle[g, c] + high * n
                apart = apart or min(p, q) - half > box[1, c] or max(p, q) + half < box[0, c]
            if not apart:
                out[found] = g
                found += 1
    return found


@leaf
def ball_late(wx, wy, wz, nx, ny, nz, dx, dy, dz, r, half):
    """t before which the ball of a block enters no line along n within `half` of the origin; inf if none at all.

    w : centre at the start. In a plane across n the centre comes no nearer than the segment does, so the ball is entered not
    before the least of its centres along n less sqrt(r^2 - gap^2).
    """
    along, travel = wx * nx + wy * ny + wz * nz, dx * nx + dy * ny + dz * nz
    ux, uy, uz = wx - along * nx, wy - along * ny, wz - along * nz
    vx, vy, vz = dx - travel * nx, dy - travel * ny, dz - travel * nz
    vv = vx * vx + vy * vy + vz * vz
    s = 0.0
    if vv > 0.0:
        s = min(max(-(ux * vx + uy * vy + uz * vz) / vv, 0.0), 1.0)
    ux, uy, uz = ux + s * vx, uy + s * vy, uz + s * vz
    gap = max(np.sqrt(ux * ux + uy * uy + uz * uz) - half, 0.0)
    if gap >= r:
        return np.inf
    return along + min(0.0, travel) - np.sqrt(r * r - gap * gap)


@leaf
def shank_late(wx, wy, nx, ny, dx, dy, r):
    """t before which an upright cylinder of radius r about w enters no line along n through the origin, seen from above."""
    if nx != 0.0 or ny != 0.0:
        return capsule_entry(-wx, -wy, 0.0, nx, ny, 0.0, dx, dy, 0.0, r)
    level = dx * dx + dy * dy
    s = 0.0
    if level > 0.0:
        s = min(max(-(wx * dx + wy * dy) / level, 0.0), 1.0)
    ux, uy = wx + s * dx, wy + s * dy
    return np.inf if ux * ux + uy * uy >= r * r else -np.inf


@leaf
def ball_length(low, size, x, y, z, nx, ny, nz, dx, dy, dz, r, height):
    """Length of a vector after one block, 1 where it came from behind, 2 where others have to tell.

    x, y, z : foot of the vector from the first centre. A line that comes down through the top of the shank is entered above
    the vector, unless the vector reaches up to there.
    """
    t, sure = ball_entry(x, y, z, nx, ny, nz, dx, dy, dz, r, height)
    if sure and t >= size:
        return size, 0
    inside = in_ball_sweep(x + low * nx, y + low * ny, z + low * nz, dx, dy, dz, r, height)
    if not sure:
        if not inside:
            return size, 2 if max(low * nz, size * nz) + z >= min(0.0, dz) + height else 0
        t = -np.inf
    t_out = np.inf
    if t < low and not in_ball_sweep(x + size * nx, y + size * ny, z + size * nz, dx, dy, dz, r, height):
        t_out = 0.5 * (low + size) if inside else low
    new, flag = shortened(t, t_out, low, size)
    return np.float64(np.float32(new)), flag


@kernel
def run_boxes(balls, box, of_run) -> None:
    """Boxes (k, 6) about blocks of ball cutters (k, 8), and about every RUN of them."""
    for k in range(len(balls)):
        r = balls[k, 6]
        for c in range(3):
            p, q = balls[k, c], balls[k, c] + balls[k, 3 + c]
            box[k, c], box[k, 3 + c] = min(p, q) - r, max(p, q) + r
        box[k, 5] = max(box[k, 5], max(balls[k, 2], balls[k, 2] + balls[k, 5]) + balls[k, 7])
        for c in range(3):
            if k % RUN == 0:
                of_run[k // RUN, c], of_run[k // RUN, 3 + c] = box[k, c], box[k, 3 + c]
            else:
                of_run[k // RUN, c] = min(of_run[k // RUN, c], box[k, c])
                of_run[k // RUN, 3 + c] = max(of_run[k // RUN, 3 + c], box[k, 3 + c])


@leaf
def block_late(lattice, g, high, deep, balls, k):
    """t before which block k enters no vector of group g. high : mm, no point of the vectors is above it."""
    m, half = lattice.patch[g], np.float64(lattice.half[g])
    nx, ny, nz = lattice.normal[m, 0], lattice.normal[m, 1], lattice.normal[m, 2]
    wx, wy = balls[k, 0] - lattice.middle[g, 0], balls[k, 1] - lattice.middle[g, 1]
    wz = balls[k, 2] - lattice.middle[g, 2]
    dx, dy, dz, r = balls[k, 3], balls[k, 4], balls[k, 5], balls[k, 6]
    late = ball_late(wx, wy, wz, nx, ny, nz, dx, dy, dz, r, half)
    if high > min(balls[k, 2], balls[k, 2] + dz):  # a vector may come beside the shank
        late = min(late, shank_late(wx, wy, nx, ny, dx, dy, r + half))
    return late


@kernel
def candidates(lattice: Lattice, g, balls, box, of_run, bound, number) -> int:
    """Blocks that may shorten a vector of group g, in their order, and when at the earliest; how many."""
    m, half = lattice.patch[g], np.float64(lattice.half[g])
    deep, reach = deepest(lattice, g), np.float64(lattice.reach[g])
    low0, high0 = (
        lattice.middle[g, 0] + deep * lattice.normal[m, 0],
        lattice.middle[g, 0] + reach * lattice.normal[m, 0],
    )
    low1, high1 = (
        lattice.middle[g, 1] + deep * lattice.normal[m, 1],
        lattice.middle[g, 1] + reach * lattice.normal[m, 1],
    )
    low2, high2 = (
        lattice.middle[g, 2] + deep * lattice.normal[m, 2],
        lattice.middle[g, 2] + reach * lattice.normal[m, 2],
    )
    low0, high0 = min(low0, high0) - half, max(low0, high0) + half
    low1, high1 = min(low1, high1) - half, max(low1, high1) + half
    low2, high2 = min(low2, high2) - half, max(low2, high2) + half
    found = 0
    for run in range(len(of_run)):
        if box_apart(of_run, run, low0, high0, low1, high1, low2, high2):
            continue
        for k in range(run * RUN, min((run + 1) * RUN, len(balls))):
            if box_apart(box, k, low0, high0, low1, high1, low2, high2):
                continue
            late = block_late(lattice, g, high2, deep, balls, k)
            if late < reach:
                bound[found], number[found] = late, k
                found += 1
    return found


@leaf
def in_order(lattice, k, low, x, y, z, m, balls, number, found):
    """Shorten vector k by blocks in their order; 1 where others have to tell."""
    size, again = np.float64(lattice.length[k]), 0
    nx, ny, nz = lattice.normal[m, 0], lattice.normal[m, 1], lattice.normal[m, 2]
    for q in range(found):
        b = number[q]
        size, flag = ball_length(
            low, size, x - balls[b, 0], y - balls[b, 1], z - balls[b, 2], nx, ny, nz, balls[b, 3], balls[b, 4],
            balls[b, 5], balls[b, 6], balls[b, 7],
        )  # fmt: skip
        if flag == 2:
            again = 1
        elif flag == 1:
            lattice.behind[k // 8] |= np.uint8(1 << (k % 8))
    lattice.length[k] = size
    return again


@leaf
def shortest(lattice, k, low, x, y, z, m, balls, bound, number, order, found):
    """Length of vector k after all blocks, the earliest first; False where one came from behind, so that the order counts."""
    size = np.float64(lattice.length[k])
    nx, ny, nz = lattice.normal[m, 0], lattice.normal[m, 1], lattice.normal[m, 2]
    for q in range(found):
        if bound[order[q]] >= size:
            break
        b = number[order[q]]
        px, py, pz = x - balls[b, 0], y - balls[b, 1], z - balls[b, 2]
        dx, dy, dz, r = balls[b, 3], balls[b, 4], balls[b, 5], balls[b, 6]
        if ball_late(-px, -py, -pz, nx, ny, nz, dx, dy, dz, r, 0.0) >= size:
            top = pz + max(low * nz, size * nz)
            if top <= min(0.0, dz) or shank_late(-px, -py, nx, ny, dx, dy, r) >= size:
                continue
        t, sure = ball_entry(px, py, pz, nx, ny, nz, dx, dy, dz, r, balls[b, 7])
        if not sure or t <= low:
            return size, False
        if t < size:
            size = np.float64(np.float32(t))
    return size, True


@kernel
def group_balls(lattice: Lattice, g, balls, bound, number, found) -> int:
    """Shorten the vectors of a group by some blocks; 1 where others have to tell, and then nothing is changed."""
    order = np.argsort(bound[:found])
    m = lattice.patch[g]
    corner, spacing = lattice.corner, lattice.spacing
    base, tall = patch_size(corner, m)
    rows = rows_of(tall, spacing)
    count, p = lattice.parts[g], lattice.part[g]
    first = lattice.first[g]
    before = lattice.length[first : lattice.first[g + 1]].copy()
    k, again = first, 0
    for i in range(lattice.band[g] * SIDE, min((lattice.band[g] + 1) * SIDE, rows)):
        share, many = row_of(base, tall, rows, i, spacing)
        for j in range(p * many // count, (p + 1) * many // count):
            t = (1.0 - share) * (j + 0.5) / many
            x, y = coordinate(corner, m, 0, share, t), coordinate(corner, m, 1, share, t)
            z = coordinate(corner, m, 2, share, t)
            low = low_of(lattice, g, k - first)
            size, sure = shortest(lattice, k, low, x, y, z, m, balls, bound, number, order, found)
            if sure:
                lattice.length[k] = size
            else:
                again |= in_order(lattice, k, low, x, y, z, m, balls, number, found)
            k += 1
    if again:
        lattice.length[first : lattice.first[g + 1]] = before
    lattice.reach[g] = longest(lattice, g)
    return again


@kernel
def cut_balls(lattice: Lattice, balls, unsure) -> int:
    """Shorten all vectors by blocks of ball cutters (k, 8); groups that others have to do, into unsure (g,): their number.

    What a block shortens is the least of what blocks do alone, in whatever order, unless one comes from behind.
    """
    n = len(balls)
    box, of_run = np.empty((n, 6)), np.empty(((n - 1) // RUN + 1, 6))
    run_boxes(balls, box, of_run)
    bound, number = np.empty(n), np.empty(n, dtype=np.int64)
    stack = np.empty(128, dtype=np.int64)
    leaves = (len(lattice.boxes) + 1) // 2
    left, top = 0, 1
    stack[0] = 0
    while top > 0:
        top -= 1
        node = stack[top]
        apart = True
        for run in range(len(of_run)):
            if not box_apart(
                lattice.boxes, node, of_run[run, 0], of_run[run, 3], of_run[run, 1], of_run[run, 4], of_run[run, 2],
                of_run[run, 5],
            ):  # fmt: skip
                apart = False
                break
        if apart:
            continue
        if node < leaves - 1:
            stack[top], stack[top + 1] = 2 * node + 2, 2 * node + 1
            top += 2
            continue
        begin = (node - leaves + 1) * LEAF
        for g in range(begin, min(begin + LEAF, len(lattice.patch))):
            found = candidates(lattice, g, balls, box, of_run, bound, number)
            if found and group_balls(lattice, g, balls, bound, number, found):
                unsure[left] = g
                left += 1
    return left


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
