# Blocks in program order against the grid of upright vectors; what each of them takes.
#
# Legend: cell (i, j) stands at (x0 + i pitch, y0 + j pitch), in tile (i // TILE, j // TILE) and in a sub-tile of SUB x SUB
#   cells. Blocks of ball cutters: rows of 8 numbers, centre x y z, travel x y z, radius, height of the shank.
#   depth, span: scratch of zeros, mm taken from the cells of one block, and the columns of every row in which that is so; they
#   are zero again when a block is through.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.engines.vectors._kernels import shortened
from vmachining.jit import kernel, leaf
from vmachining.sweep.ball._kernels import ball_below, in_ball_sweep, travel

TILE, SUB = 64, 16

ROOF_MM = 1e-4
"""Material above a sweep that is thinner is rounding: lengths are float32, half an ulp is 1.5e-5 mm at 340 mm."""


class Grid(NamedTuple):
    """Upright vectors, and where those of the tiles that are looked at start and end.

    length : (a, b, T, T) float32 mm, NaN where there is no vector. slot : (a, b) row of the following, -1 where a tile is not
        there. start : (K, T, T) mm. low, rest : (K, T, T) float32 mm above start: end of the vector, end of material.
    high : (K, T / SUB, T / SUB, 3) a plane above all tips of a sub-tile: mm at its middle, slopes along x and y.
    x0, y0, pitch : mm. nx, ny : cells.
    """

    length: NDArray[np.float32]
    slot: NDArray[np.int64]
    start: NDArray[np.float64]
    low: NDArray[np.float32]
    rest: NDArray[np.float32]
    high: NDArray[np.float64]
    x0: float
    y0: float
    pitch: float
    nx: int
    ny: int


@leaf
def ball_entry_over(cx, cy, cz, dx, dy, dz, r, x, y):
    """Height at which the upright line at x, y enters the sweep of a ball, and its slopes along x and y; inf if it misses."""
    qx, qy = x - cx, y - cy
    run, e0, e1, slope, sine, fall = travel(dx, dy, dz)
    below, s, room = ball_below(qx * e0 + qy * e1, qy * e0 - qx * e1, run, slope, sine, r * r)
    if room <= 0.0:
        return np.inf, 0.0, 0.0
    root = np.sqrt(room)
    return cz + fall + below, (qx - s * e0) / root, (qy - s * e1) / root


@leaf
def ball_above(cx, cy, cz, dx, dy, dz, r, x, y, h, high, p, q):
    """Whether the sweep of a ball is nowhere below the plane high[p, q] over the square x +- h, y +- h.

    The lower surface of the sweep is convex, so it lies above its tangent plane at the middle, and the difference of two planes
    is least at a corner. Where the middle misses, the lowest sphere that reaches the square counts.
    """
    top, gx, gy = high[p, q, 0], high[p, q, 1], high[p, q, 2]
    f, sx, sy = ball_entry_over(cx, cy, cz, dx, dy, dz, r, x, y)
    if f < np.inf:
        return f - (abs(sx - gx) + abs(sy - gy)) * h >= top
    mx, my = x - cx - 0.5 * dx, y - cy - 0.5 * dy
    gap = max(np.sqrt(mx * mx + my * my) - 0.5 * np.sqrt(dx * dx + dy * dy) - np.sqrt(2.0) * h, 0.0)
    if gap >= r:
        return True
    return cz + min(0.0, dz) - np.sqrt(r * r - gap * gap) - (abs(gx) + abs(gy)) * h >= top


@leaf
def ball_exit_over(cx, cy, cz, dx, dy, dz, r, height, x, y):
    """Height at which an upright line that meets the sweep of a ball cutter leaves it, at the top of its shank."""
    run = np.sqrt(dx * dx + dy * dy)
    if run == 0.0:
        return cz + max(0.0, dz) + height
    qx, qy = x - cx, y - cy
    u, v = (qx * dx + qy * dy) / run, (qy * dx - qx * dy) / run
    h = np.sqrt(max(r * r - v * v, 0.0))
    slope = dz / run
    return cz + max(min(max(u - h, 0.0), run) * slope, min(max(u + h, 0.0), run) * slope) + height


@leaf
def cell_range(low, high, origin, pitch, count):
    """First cell and the one behind the last whose middles lie between two places, and one more at either side."""
    first = max(int(np.ceil((low - origin) / pitch)) - 1, 0)
    last = min(int(np.floor((high - origin) / pitch)) + 2, count)
    return first, last


@leaf
def take(length, low, rest, t, leave):
    """New length of a vector that is entered at t and left at `leave` above its start, mm of material taken, 1 from behind."""
    size = np.float64(length)
    new, flag = shortened(t, leave, np.float64(low), size)
    new = np.float64(np.float32(new))
    end = np.float64(rest)
    return np.float32(new), max(size, end) - max(new, end), flag


@leaf
def cover(length, start, i0, j0, pitch, high, p, q):
    """Write the plane above all tips of the sub-tile of a tile (T, T) that begins at i0, j0; -inf where none exists.

    Its slopes are those of least squares, or 0 where a vector is missing: any slopes bound, these do it closely.
    """
    gx, gy, mid = 0.0, 0.0, 0.5 * (SUB - 1)
    for i in range(SUB):
        for j in range(SUB):
            tip = start[i0 + i, j0 + j] + length[i0 + i, j0 + j]
            gx += (i - mid) * tip
            gy += (j - mid) * tip
    if gx == gx and gy == gy:  # no NaN
        square = SUB * SUB * (SUB * SUB - 1.0) / 12.0 * pitch
        gx, gy = gx / square, gy / square
    else:
        gx, gy = 0.0, 0.0
    best = -np.inf
    for i in range(SUB):
        for j in range(SUB):
            tip = start[i0 + i, j0 + j] + length[i0 + i, j0 + j] - ((i - mid) * gx + (j - mid) * gy) * pitch
            if tip > best:
                best = tip
    high[p, q, 0], high[p, q, 1], high[p, q, 2] = best, gx, gy


@kernel
def tops(grid: Grid, a, b) -> None:
    """Write `high` of a tile that has just come."""
    k = grid.slot[a, b]
    length, start, high = grid.length[a, b], grid.start[k], grid.high[k]
    for p in range(TILE // SUB):
        for q in range(TILE // SUB):
            cover(length, start, SUB * p, SUB * q, grid.pitch, high, p, q)


@kernel
def neighbour_sums(depth, span, n, m, out) -> None:
    """Sums over cells of the least depth around, the depth, and the largest around; then depth and span are zero again.

    depth (n, m) of one block, zero outside of the columns span[i, 0] to span[i, 1] of row i; cells outside do not count.
    """
    low, middle, high = 0.0, 0.0, 0.0
    for i in range(n):
        j0, j1 = m, 0
        for a in range(max(0, i - 1), min(n, i + 2)):
            if span[a, 1] > 0:
                j0, j1 = min(j0, span[a, 0]), max(j1, span[a, 1])
        for j in range(max(j0 - 1, 0), min(j1 + 1, m)):
            here = depth[i, j]
            least, most = here, here
            for a in range(max(0, i - 1), min(n, i + 2)):
                for b in range(max(0, j - 1), min(m, j + 2)):
                    least, most = min(least, depth[a, b]), max(most, depth[a, b])
            low += least
            middle += here
            high += most
    out[0] += low
    out[1] += middle
    out[2] += high
    for i in range(n):
        for j in range(span[i, 0], span[i, 1]):
            depth[i, j] = 0.0
        span[i, 0], span[i, 1] = 0, 0


@leaf
def widen(span, i, j):
    """Let column j belong to the span of row i."""
    if span[i, 1] == 0:
        span[i, 0], span[i, 1] = j, j + 1
    else:
        span[i, 0], span[i, 1] = min(span[i, 0], j), max(span[i, 1], j + 1)


@kernel
def ball_ranges(grid: Grid, balls, out) -> None:
    """Cells (i0, i1, j0, j1) that each ball block can reach, empty ones as zeros."""
    for k in range(len(balls)):
        cx, cy, dx, dy, r = balls[k, 0], balls[k, 1], balls[k, 3], balls[k, 4], balls[k, 6]
        i0, i1 = cell_range(min(cx, cx + dx) - r, max(cx, cx + dx) + r, grid.x0, grid.pitch, grid.nx)
        j0, j1 = cell_range(min(cy, cy + dy) - r, max(cy, cy + dy) + r, grid.y0, grid.pitch, grid.ny)
        if i0 < i1 and j0 < j1:
            out[k, 0], out[k, 1], out[k, 2], out[k, 3] = i0, i1, j0, j1
        else:
            out[k] = 0


@kernel
def cut_balls(grid: Grid, balls, ranges, writes, depth, span, out) -> int:
    """Blocks of ball cutters one after the other; how often vectors were entered from behind.

    balls (k, 8). ranges (k, 4) of cells. writes (k,): 0 where a block only asks. out (k, 3): sums of depths, see
    `neighbour_sums`.
    """
    behind = 0
    h = 0.5 * (SUB - 1) * grid.pitch
    for k in range(len(balls)):
        cx, cy, cz, dx, dy, dz = balls[k, 0], balls[k, 1], balls[k, 2], balls[k, 3], balls[k, 4], balls[k, 5]
        r, height = balls[k, 6], balls[k, 7]
        i0, i1, j0, j1 = ranges[k, 0], ranges[k, 1], ranges[k, 2], ranges[k, 3]
        met = False
        run, e0, e1, slope, sine, fall = travel(dx, dy, dz)
        rr, base = r * r, cz + fall
        for p in range(i0 // SUB, (i1 - 1) // SUB + 1):
            for q in range(j0 // SUB, (j1 - 1) // SUB + 1):
                a, b = p * SUB // TILE, q * SUB // TILE
                s = grid.slot[a, b]
                pi, qj = p * SUB - a * TILE, q * SUB - b * TILE
                x, y = grid.x0 + p * SUB * grid.pitch + h, grid.y0 + q * SUB * grid.pitch + h
                high = grid.high[s]
                if ball_above(cx, cy, cz, dx, dy, dz, r, x, y, h, high, pi // SUB, qj // SUB):
                    continue
                length, start, low, rest = grid.length[a, b], grid.start[s], grid.low[s], grid.rest[s]
                changed = False
                for i in range(max(i0, p * SUB), min(i1, (p + 1) * SUB)):
                    qx = grid.x0 + i * grid.pitch - cx
                    ti = i - a * TILE
                    for j in range(max(j0, q * SUB), min(j1, (q + 1) * SUB)):
                        qy = grid.y0 + j * grid.pitch - cy
                        tj = j - b * TILE
                        below, _, room = ball_below(
                            qx * e0 + qy * e1, qy * e0 - qx * e1, run, slope, sine, rr
                        )
                        t = base + below - start[ti, tj]
                        if not (room > 0.0 and t < length[ti, tj]):
                            continue
                        leave = np.inf
                        if t < low[ti, tj]:
                            leave = (
                                ball_exit_over(cx, cy, cz, dx, dy, dz, r, height, qx + cx, qy + cy)
                                - start[ti, tj]
                            )
                        new, taken, flag = take(length[ti, tj], low[ti, tj], rest[ti, tj], t, leave)
                        depth[i - i0, j - j0] = taken
                        widen(span, i - i0, j - j0)
                        met = True
                        if writes[k]:
                            behind += flag
                            length[ti, tj] = new
                            changed = True
                if changed:
                    cover(length, start, pi, qj, grid.pitch, high, pi // SUB, qj // SUB)
        if met:
            neighbour_sums(depth, span, i1 - i0, j1 - j0, out[k])
    return behind


@kernel
def cut_heights(grid: Grid, i0, j0, enter, leave, write, depth, span):
    """Heights at which the lines of cells (n, m) from i0, j0 on enter and leave a sweep: how many were entered from behind, and
    how many have material above the sweep.

    depth (n, m): mm that is taken, added.
    """
    behind, under = 0, 0
    n, m = enter.shape
    for a in range(i0 // TILE, (i0 + n - 1) // TILE + 1):
        for b in range(j0 // TILE, (j0 + m - 1) // TILE + 1):
            s = grid.slot[a, b]
            length, start, low, rest = grid.length[a, b], grid.start[s], grid.low[s], grid.rest[s]
            changed = False
            for i in range(max(i0, a * TILE), min(i0 + n, (a + 1) * TILE)):
                for j in range(max(j0, b * TILE), min(j0 + m, (b + 1) * TILE)):
                    ti, tj = i - a * TILE, j - b * TILE
                    t = enter[i - i0, j - j0] - start[ti, tj]
                    if not t < length[ti, tj]:
                        continue
                    out = leave[i - i0, j - j0] - start[ti, tj]
                    if -np.inf < out < length[ti, tj] - ROOF_MM:  # facets do not know where a line leaves
                        under += 1
                    new, taken, flag = take(length[ti, tj], low[ti, tj], rest[ti, tj], t, out)
                    depth[i - i0, j - j0] += taken
                    widen(span, i - i0, j - j0)
                    if write:
                        behind += flag
                        length[ti, tj] = new
                        changed = True
            if changed:
                for p in range(TILE // SUB):
                    for q in range(TILE // SUB):
                        cover(length, start, SUB * p, SUB * q, grid.pitch, grid.high[s], p, q)
    return behind, under


@kernel
def missing_tiles(slot, ranges, stamp, now, out) -> int:
    """Tiles (a, b) that some ranges of cells need and that are not there, into out (t, 2); their number.

    stamp (a, b): set to `now` for all that are asked for, so that none is found twice: out has a row for each tile.
    """
    found = 0
    for k in range(len(ranges)):
        if ranges[k, 1] == 0:
            continue
        for a in range(ranges[k, 0] // TILE, (ranges[k, 1] - 1) // TILE + 1):
            for b in range(ranges[k, 2] // TILE, (ranges[k, 3] - 1) // TILE + 1):
                if stamp[a, b] == now:
                    continue
                stamp[a, b] = now
                if slot[a, b] < 0:
                    out[found, 0], out[found, 1] = a, b
                    found += 1
    return found


@kernel
def first_balls(balls, order, tips, slack, first, cells, x0, y0, cell, out) -> None:
    """The first block (k, 8) of a ball cutter that reaches a tip within its slack: its place `order` into out (n,).

    tips (n, 3) by cells seen from above, rows along x: those of cell (a, b) from first[a * cells[1] + b] on.
    """
    wide = 0.0
    for i in range(len(slack)):
        wide = max(wide, slack[i])
    for k in range(len(balls)):
        cx, cy, cz, dx, dy, dz = balls[k, 0], balls[k, 1], balls[k, 2], balls[k, 3], balls[k, 4], balls[k, 5]
        r, height = balls[k, 6], balls[k, 7]
        reach = r + wide
        a0 = max(0, int(np.floor((min(cx, cx + dx) - reach - x0) / cell)))
        a1 = min(cells[0] - 1, int(np.floor((max(cx, cx + dx) + reach - x0) / cell)))
        b0 = max(0, int(np.floor((min(cy, cy + dy) - reach - y0) / cell)))
        b1 = min(cells[1] - 1, int(np.floor((max(cy, cy + dy) + reach - y0) / cell)))
        floor = cz + min(0.0, dz) - reach
        for a in range(a0, a1 + 1):
            if b1 < b0:
                break
            for i in range(first[a * cells[1] + b0], first[a * cells[1] + b1 + 1]):
                if out[i] <= order[k] or tips[i, 2] < floor:
                    continue
                s = slack[i]
                x, y, z = tips[i, 0] - cx, tips[i, 1] - cy, tips[i, 2] - cz
                if in_ball_sweep(x, y, z, dx, dy, dz, r + s, height):
                    out[i] = order[k]
