# All blocks of a ball cutter at once: heights over a grid by tiles, and vectors with directions of their own.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.engines.vectors._kernels import shortened
from vmachining.engines.vectors.grid._kernels import ball_entry_over
from vmachining.jit import kernel, leaf
from vmachining.sweep.ball._kernels import ball_below, ball_entry, in_ball_sweep, travel

PRUNERS = 4  # blocks of a tile that others are compared with


class Blocks(NamedTuple):
    """Blocks of a ball cutter, found by the cells of their middles seen from above.

    c : (n + 1, 3) mm, centres; block k goes from row k to k + 1. r : mm, of ball and shank. shank : mm, its height above the
        centre. half : mm, half of the longest block.
    gx, gy, cell : mm, corner and side of the cells. cells : (2,). Those of cell (a, b) are
        numbers[first[a cells[1] + b] : first[a cells[1] + b + 1]].
    """

    c: NDArray[np.float64]
    r: float
    shank: float
    half: float
    gx: float
    gy: float
    cell: float
    cells: NDArray[np.int64]
    first: NDArray[np.int64]
    numbers: NDArray[np.int64]


@leaf
def lower_tile(c, k, r, x0, y0, pitch, height, i0, i1, j0, j1):
    """Lower the cells [i0, i1) x [j0, j1) of heights to block k; a square root of 0 is a miss."""
    dx, dy, dz = c[k + 1, 0] - c[k, 0], c[k + 1, 1] - c[k, 1], c[k + 1, 2] - c[k, 2]
    run, e0, e1, slope, sine, fall = travel(dx, dy, dz)
    base, rr = c[k, 2] + fall, r * r
    for i in range(i0, i1):
        qx = x0 + i * pitch - c[k, 0]
        for j in range(j0, j1):
            qy = y0 + j * pitch - c[k, 1]
            below, _, room = ball_below(qx * e0 + qy * e1, qy * e0 - qx * e1, run, slope, sine, rr)
            z = base + below
            old = height[i - i0, j - j0]
            height[i - i0, j - j0] = z if (room > 0.0 and z < old) else old


@leaf
def entry_over(c, k, r, x, y):
    """See `ball_entry_over`, of block k."""
    return ball_entry_over(
        c[k, 0], c[k, 1], c[k, 2], c[k + 1, 0] - c[k, 0], c[k + 1, 1] - c[k, 1], c[k + 1, 2] - c[k, 2], r, x, y
    )  # fmt: skip


@kernel
def grid_tile(blocks: Blocks, x0, y0, pitch, i0, i1, j0, j1, height, near, value) -> int:
    """Heights (i1 - i0, j1 - j0) under all blocks; number of blocks that were looked at cell by cell.

    f_b of a block is convex where it is finite, so it lies above its tangent plane at the tile's middle, and below the
    bilinear function of its corners. A block whose plane is above another one's corners is not looked at.
    """
    mx, my = x0 + 0.5 * (i0 + i1 - 1) * pitch, y0 + 0.5 * (j0 + j1 - 1) * pitch
    hx, hy = 0.5 * (i1 - i0 - 1) * pitch, 0.5 * (j1 - j0 - 1) * pitch
    wide = np.sqrt(hx * hx + hy * hy)
    c, r, cell, cells, first, numbers = (
        blocks.c, blocks.r, blocks.cell, blocks.cells, blocks.first, blocks.numbers,
    )  # fmt: skip
    gx, gy, reach = blocks.gx, blocks.gy, r + blocks.half + wide
    a0, a1 = max(0, int((mx - reach - gx) / cell)), min(cells[0] - 1, int((mx + reach - gx) / cell))
    b0, b1 = max(0, int((my - reach - gy) / cell)), min(cells[1] - 1, int((my + reach - gy) / cell))
    n, kept = 0, 0
    best = np.empty(PRUNERS, dtype=np.int64)
    low = np.full(PRUNERS, np.inf)
    for a in range(a0, a1 + 1):
        if b1 < b0:
            break
        for m in range(first[a * cells[1] + b0], first[a * cells[1] + b1 + 1]):
            k = numbers[m]
            f, sx, sy = entry_over(c, k, r, mx, my)
            if f == np.inf:
                # the middle misses: the spheres that reach the tile are not lower than this
                x, y = 0.5 * (c[k, 0] + c[k + 1, 0]), 0.5 * (c[k, 1] + c[k + 1, 1])
                run = np.sqrt((c[k + 1, 0] - c[k, 0]) ** 2 + (c[k + 1, 1] - c[k, 1]) ** 2)
                gap = max(np.sqrt((mx - x) ** 2 + (my - y) ** 2) - 0.5 * run - wide, 0.0)
                if gap >= r:
                    continue
                near[n], value[n, 0], value[n, 1], value[n, 2] = (
                    k,
                    min(c[k, 2], c[k + 1, 2]) - np.sqrt(r * r - gap * gap),
                    0.0,
                    0.0,
                )
                n += 1
                continue
            near[n], value[n, 0], value[n, 1], value[n, 2] = k, f, sx, sy
            n += 1
            at = PRUNERS
            while at > 0 and f < low[at - 1]:
                at -= 1
            if at < PRUNERS:
                for q in range(PRUNERS - 1, at, -1):
                    low[q], best[q] = low[q - 1], best[q - 1]
                low[at], best[at] = f, k
    corner = np.full((PRUNERS, 4), np.inf)
    for q in range(PRUNERS):
        if low[q] < np.inf:
            for s in range(4):
                x, y = mx + (hx if s & 1 else -hx), my + (hy if s & 2 else -hy)
                corner[q, s] = entry_over(c, best[q], r, x, y)[0]
            lower_tile(c, best[q], r, x0, y0, pitch, height, i0, i1, j0, j1)
            kept += 1
    for m in range(n):
        k = near[m]
        seen = True
        for q in range(PRUNERS):
            if low[q] == np.inf:
                break
            if k == best[q]:
                seen = False
                break
            above = True
            for s in range(4):
                plane = (
                    value[m, 0] + value[m, 1] * (hx if s & 1 else -hx) + value[m, 2] * (hy if s & 2 else -hy)
                )
                if not plane >= corner[q, s]:
                    above = False
                    break
            if above:
                seen = False
                break
        if seen:
            lower_tile(c, k, r, x0, y0, pitch, height, i0, i1, j0, j1)
            kept += 1
    return kept


@kernel
def normals_all(blocks: Blocks, point, normal, lam, length, behind) -> int:
    """Shorten vectors by all blocks; number of blocks whose entry was computed in full.

    The ball of block k enters the line of a vector not before w - sqrt(r^2 - q^2), w the least of its centres along N and q
    their least distance to the line; the shank is only above the centres.
    """
    full = 0
    c, r, shank, half = blocks.c, blocks.r, blocks.shank, blocks.half
    gx, gy, cell, cells, first, numbers = (
        blocks.gx, blocks.gy, blocks.cell, blocks.cells, blocks.first, blocks.numbers,
    )  # fmt: skip
    for i in range(len(point)):
        px, py, pz = point[i, 0], point[i, 1], point[i, 2]
        nx, ny, nz = normal[i, 0], normal[i, 1], normal[i, 2]
        low = np.float64(lam[i])
        size = np.float64(length[i])
        reach = r + half
        x0, x1 = min(low * nx, size * nx) + px - reach, max(low * nx, size * nx) + px + reach
        y0, y1 = min(low * ny, size * ny) + py - reach, max(low * ny, size * ny) + py + reach
        a0, a1 = max(0, int((x0 - gx) / cell)), min(cells[0] - 1, int((x1 - gx) / cell))
        b0, b1 = max(0, int((y0 - gy) / cell)), min(cells[1] - 1, int((y1 - gy) / cell))
        for a in range(a0, a1 + 1):
            if b1 < b0:
                break
            for m in range(first[a * cells[1] + b0], first[a * cells[1] + b1 + 1]):
                k = numbers[m]
                wx, wy, wz = c[k, 0] - px, c[k, 1] - py, c[k, 2] - pz
                dx, dy, dz = c[k + 1, 0] - c[k, 0], c[k + 1, 1] - c[k, 1], c[k + 1, 2] - c[k, 2]
                along, travel = wx * nx + wy * ny + wz * nz, dx * nx + dy * ny + dz * nz
                ux, uy, uz = wx + 0.5 * dx, wy + 0.5 * dy, wz + 0.5 * dz
                mid = along + 0.5 * travel
                aside = ux * ux + uy * uy + uz * uz - mid * mid
                over = max(pz + low * nz, pz + size * nz) - pz > min(wz, wz + dz)
                if not over:
                    gap = max(np.sqrt(max(aside, 0.0)) - half, 0.0)
                    if gap >= r or along + min(0.0, travel) - np.sqrt(r * r - gap * gap) >= size:
                        continue
                full += 1
                t, _sure = ball_entry(-wx, -wy, -wz, nx, ny, nz, dx, dy, dz, r, shank)
                if t >= size:
                    continue
                t_out = np.inf
                if t < low and not in_ball_sweep(
                    -wx + size * nx, -wy + size * ny, -wz + size * nz, dx, dy, dz, r, shank
                ):
                    t_out = low
                    if in_ball_sweep(-wx + low * nx, -wy + low * ny, -wz + low * nz, dx, dy, dz, r, shank):
                        t_out = 0.5 * (low + size)
                new, flag = shortened(t, t_out, low, size)
                size = np.float64(np.float32(new))
                behind[i] |= flag
        length[i] = size
    return full


@kernel
def grid(blocks: Blocks, x0, y0, pitch, side, i0, top, height, near, value) -> None:
    """Heights (n, m) of the cells from row i0 on, tile by tile; `top` where no block comes."""
    n, m = height.shape
    tile = np.empty((side, side))
    for i in range(0, n, side):
        for j in range(0, m, side):
            ni, nj = min(side, n - i), min(side, m - j)
            tile[:] = top
            grid_tile(blocks, x0, y0, pitch, i0 + i, i0 + i + ni, j, j + nj, tile, near, value)
            height[i : i + ni, j : j + nj] = tile[:ni, :nj]
