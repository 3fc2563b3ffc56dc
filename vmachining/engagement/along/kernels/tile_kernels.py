# Which sweeps matter near a place: square tiles of the plan, each with the sweeps that may be lowest somewhere in it.
#
# Legend: f(x, y) lower surface of a sweep that reaches above the stock. up (4,), lo (4,): bounds of f at the corners of a tile;
#   f is convex on lines, so values at corners bound it from above in the tile and a tangent plane bounds it from below. Where up
#   of one sweep lies below lo of another everywhere, the other is never lowest. Kinds EXACT have no bounds: they stay.
# Tiles: head (nx, ny), first entry or -1; node (m, 2) sweep, next entry; bound (m, 8) up, lo; origin (2,), size mm; state (2,):
#   entries used, first free one; top (nx, ny) no material is higher.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.engagement.along.kernels.distance_kernels import BALL, CIRCLE, EXACT, LEVEL, path_gap
from vmachining.jit import leaf

INF = 1e30
SLACK = 1e-9  # mm: rounding of the bounds


class Tiles(NamedTuple):
    """See the legend. stamp (sweeps,): number of the station that saw a sweep last, negative where the tool does not reach it."""

    head: NDArray[np.int64]
    node: NDArray[np.int64]
    bound: NDArray[np.float64]
    top: NDArray[np.float64]
    origin: NDArray[np.float64]
    size: float
    state: NDArray[np.int64]
    stamp: NDArray[np.int64]


@leaf
def bottom(rho, rc, r):
    """Height of the cutter's surface above the tip at a radius; INF beyond it."""
    u = rho - rc
    if u <= 0.0:
        return 0.0
    return r - np.sqrt(r * r - u * u) if u <= r else INF


@leaf
def height(q, kind, x, y):
    """f of a sweep on a line, exact for balls and level lines, else an upper bound; INF outside."""
    x, y = x - q[0], y - q[1]
    t = 0.0
    if q[18] > 0.0:
        t = min(max((x * q[3] + y * q[4]) / q[18], 0.0), 1.0)
    if kind == BALL and q[18] > 0.0:
        # along the path the sphere that is lowest stands ahead of or before the place: xi - q m / sqrt(1 + m^2)
        plan = np.sqrt(q[18])
        xi = (x * q[3] + y * q[4]) / plan
        eta = (x * q[4] - y * q[3]) / plan
        left = q[17] * q[17] - eta * eta
        if left <= 0.0:
            return INF
        slope = q[5] / plan
        t = min(max((xi - np.sqrt(left) * slope / np.sqrt(1.0 + slope * slope)) / plan, 0.0), 1.0)
    elif q[18] == 0.0:
        t = 0.0 if q[5] >= 0.0 else 1.0
    a, b = x - t * q[3], y - t * q[4]
    f = bottom(np.sqrt(a * a + b * b), q[16], q[17])
    return f + q[2] + t * q[5] if f < INF else INF


@leaf
def bounds(rows, k, x, y, half, top, out):
    """up and lo of a sweep at the corners of a tile about x, y; False where it does not come into it, lower than `top`."""
    q, kind = rows.num[k], rows.kind[k]
    for c in range(4):
        out[c], out[4 + c] = INF, -INF
    if kind >= EXACT:
        return True
    away = half * np.sqrt(2.0)
    if kind >= CIRCLE and kind != 3:
        rho = path_gap(q, x - q[6], y - q[7])
    else:
        px, py = x - q[0], y - q[1]
        t = min(max((px * q[3] + py * q[4]) / q[18], 0.0), 1.0) if q[18] > 0.0 else 0.0
        rho = np.sqrt((px - t * q[3]) ** 2 + (py - t * q[4]) ** 2)
    least = bottom(max(rho - away, 0.0), q[16], q[17])
    if least >= INF or q[27] + least - SLACK >= top:
        return False
    for c in range(4):
        out[4 + c] = q[27] + least - SLACK
    if kind >= CIRCLE and kind != 3:
        most = bottom(rho + away, q[16], q[17])
        for c in range(4):
            out[c] = q[28] + most + SLACK if most < INF else INF
        return True
    for c in range(4):
        sx, sy = (half if c & 1 else -half), (half if c & 2 else -half)
        f = height(q, kind, x + sx, y + sy)
        out[c] = f + SLACK if f < INF else INF
    if kind in (BALL, LEVEL):
        f = height(q, kind, x, y)
        if f < INF:
            step = 1e-3 * half
            # the tangent plane at the middle, by its normal: slopes of a convex function from both sides bound it
            fx0, fx1 = height(q, kind, x - step, y), height(q, kind, x + step, y)
            fy0, fy1 = height(q, kind, x, y - step), height(q, kind, x, y + step)
            if max(max(fx0, fx1), max(fy0, fy1)) < INF:
                gx, gy = 0.5 * (fx1 - fx0) / step, 0.5 * (fy1 - fy0) / step
                # a central difference is off the gradient by its second difference at most
                off = half * (abs(fx1 + fx0 - 2.0 * f) + abs(fy1 + fy0 - 2.0 * f)) / step
                for c in range(4):
                    sx, sy = (half if c & 1 else -half), (half if c & 2 else -half)
                    out[4 + c] = max(out[4 + c], f + gx * sx + gy * sy - off - SLACK)
    return True


@leaf
def hides(a, b):
    """Whether the first bounds' up lies below the second bounds' lo at every corner."""
    return a[0] <= b[4] and a[1] <= b[5] and a[2] <= b[6] and a[3] <= b[7]


@leaf
def enter(tiles, rows, k, work):
    """Put sweep k into the tiles that it comes into; False without room, then nothing is lost by entering it again."""
    box = rows.box[k]
    nx, ny = tiles.head.shape
    i0 = max(int(np.floor((box[0] - tiles.origin[0]) / tiles.size)), 0)
    i1 = min(int(np.floor((box[3] - tiles.origin[0]) / tiles.size)), nx - 1)
    j0 = max(int(np.floor((box[1] - tiles.origin[1]) / tiles.size)), 0)
    j1 = min(int(np.floor((box[4] - tiles.origin[1]) / tiles.size)), ny - 1)
    if i1 < i0 or j1 < j0:
        return True
    if len(tiles.node) - tiles.state[0] < (i1 - i0 + 1) * (j1 - j0 + 1):
        return False
    half = 0.5 * tiles.size
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            x, y = tiles.origin[0] + (i + 0.5) * tiles.size, tiles.origin[1] + (j + 0.5) * tiles.size
            if not bounds(rows, k, x, y, half, tiles.top[i, j], work):
                continue
            highest = max(max(work[0], work[1]), max(work[2], work[3]))
            at, last, drop = tiles.head[i, j], -1, False
            while at >= 0:
                after = tiles.node[at, 1]
                known = tiles.bound[at]
                if hides(known, work):
                    drop = True
                    break
                if hides(work, known):
                    if last < 0:
                        tiles.head[i, j] = after
                    else:
                        tiles.node[last, 1] = after
                    tiles.node[at, 1] = tiles.state[1]
                    tiles.state[1] = at
                else:
                    last = at
                at = after
            if drop:
                continue
            at = tiles.state[1]
            if at >= 0:
                tiles.state[1] = tiles.node[at, 1]
            else:
                at = tiles.state[0]
                tiles.state[0] += 1
            tiles.node[at, 0], tiles.node[at, 1] = k, tiles.head[i, j]
            for c in range(8):
                tiles.bound[at, c] = work[c]
            tiles.head[i, j] = at
            tiles.top[i, j] = min(tiles.top[i, j], highest)
    return True


@leaf
def gather(tiles, rows, now, radius, half_turn, tip_box, mark, near):
    """Into `near`: sweeps of the tiles under the tool (before it, if it faces half a turn); how many, and the highest material.

    tip_box (6,) : what the tool can touch; -1 where `near` has no room.
    """
    nx, ny = tiles.head.shape
    i0 = max(int(np.floor((tip_box[0] - tiles.origin[0]) / tiles.size)), 0)
    i1 = min(int(np.floor((tip_box[3] - tiles.origin[0]) / tiles.size)), nx - 1)
    j0 = max(int(np.floor((tip_box[1] - tiles.origin[1]) / tiles.size)), 0)
    j1 = min(int(np.floor((tip_box[4] - tiles.origin[1]) / tiles.size)), ny - 1)
    away = 0.70711 * tiles.size
    size = np.sqrt(now[6] * now[6] + now[7] * now[7])
    n, top = 0, -INF
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            if half_turn:
                x = tiles.origin[0] + (i + 0.5) * tiles.size - now[0]
                y = tiles.origin[1] + (j + 0.5) * tiles.size - now[1]
                if x * x + y * y > (radius + away) ** 2 or x * now[6] + y * now[7] < -away * size:
                    continue
            top = max(top, tiles.top[i, j])
            at = tiles.head[i, j]
            while at >= 0:
                k = tiles.node[at, 0]
                at = tiles.node[at, 1]
                if abs(tiles.stamp[k]) == mark:
                    continue
                tiles.stamp[k] = -mark
                b = rows.box[k]
                if (
                    b[0] <= tip_box[3] and b[3] >= tip_box[0] and b[1] <= tip_box[4] and b[4] >= tip_box[1]
                    and b[2] <= tip_box[5] and b[5] >= tip_box[2]
                ):  # fmt: skip
                    if n >= len(near):
                        return -1, top
                    tiles.stamp[k] = mark
                    near[n] = k
                    n += 1
    return n, top
