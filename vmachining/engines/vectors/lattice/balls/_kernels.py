# Blocks of ball cutters against vectors along normals: those of a group are shortened by the blocks that may reach it.
#
# Legend: patches and groups as in `lattice/_kernels.py`. Blocks are rows of centre x y z, travel x y z, radius, height of the
#   shank; RUN blocks that follow each other have a box together.

import numpy as np

from vmachining.engines.vectors._kernels import shortened
from vmachining.engines.vectors.lattice._kernels import (
    LEAF,
    Lattice,
    box_apart,
    coordinate,
    deepest,
    extent,
    longest,
    low_of,
    patch_size,
    row_of,
    rows_and_part,
    rows_of,
)
from vmachining.jit import kernel, leaf
from vmachining.sweep.ball._kernels import ball_entry, capsule_entry, in_ball_sweep

RUN = 16


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
def block_late(lattice, g, high, balls, k):
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
    deep, reach = deepest(lattice, g), np.float64(lattice.reach[g])
    low0, high0 = extent(lattice, g, 0, deep, reach)
    low1, high1 = extent(lattice, g, 1, deep, reach)
    low2, high2 = extent(lattice, g, 2, deep, reach)
    found = 0
    for run in range(len(of_run)):
        if box_apart(of_run, run, low0, high0, low1, high1, low2, high2):
            continue
        for k in range(run * RUN, min((run + 1) * RUN, len(balls))):
            if box_apart(box, k, low0, high0, low1, high1, low2, high2):
                continue
            late = block_late(lattice, g, high2, balls, k)
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
    i0, i1, p, count = rows_and_part(lattice, g, base, rows)
    first = lattice.first[g]
    before = lattice.length[first : lattice.first[g + 1]].copy()
    k, again = first, 0
    for i in range(i0, i1):
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
