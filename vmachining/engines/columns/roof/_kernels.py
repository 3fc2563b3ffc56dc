# The top of a stock of facets over one cell: two parallel planes that hold it, and the edge of the outline that crosses it.
#
# Legend. plane[f] = (x, y, z of a corner, slopes along x and y, least and greatest z), corner[f] = (x, y) of three corners,
# counterclockwise. wall[e] = (x, y) of both ends of an edge of the outline, the stock to its left.
# grid as of the tiles; facets of tile t: ids[start[t]:start[t + 1]], walls likewise.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.jit import kernel, leaf

OUTSIDE, PARTLY, WHOLE = np.int64(0), np.int64(1), np.int64(2)
NO_WALL = np.int64(-1)


class Roof(NamedTuple):
    """See the legend. grid (4,), size (2,), plane (f, 7), corner (f, 6), start (t + 1,), ids, wall (e, 4), first (t + 1,),
    walls. All empty for a stock with level top whose outline is that of the tiles."""

    grid: NDArray[np.float64]
    size: NDArray[np.int64]
    plane: NDArray[np.float64]
    corner: NDArray[np.float64]
    start: NDArray[np.int64]
    ids: NDArray[np.int64]
    wall: NDArray[np.float64]
    first: NDArray[np.int64]
    walls: NDArray[np.int64]


@leaf
def _meets(corner, f, x, y, hx, hy, slack):
    """Whether a facet and a rectangle overlap by more than `slack` in every direction of their edges."""
    a, b, c, d, e, g = corner[f, 0], corner[f, 1], corner[f, 2], corner[f, 3], corner[f, 4], corner[f, 5]
    if max(max(a, c), e) <= x - hx + slack or min(min(a, c), e) >= x + hx - slack:
        return False
    if max(max(b, d), g) <= y - hy + slack or min(min(b, d), g) >= y + hy - slack:
        return False
    for _ in range(3):
        ux, uy = c - a, d - b
        size = np.sqrt(ux * ux + uy * uy)
        deepest = ux * (y - b) - uy * (x - a) + abs(ux) * hy + abs(uy) * hx
        if deepest <= slack * size:
            return False
        a, b, c, d, e, g = c, d, e, g, a, b
    return True


@leaf
def _crosses(wall, e, x, y, hx, hy, slack):
    """Whether an edge of the outline crosses a rectangle by more than `slack`."""
    a, b, c, d = wall[e, 0], wall[e, 1], wall[e, 2], wall[e, 3]
    if max(a, c) <= x - hx + slack or min(a, c) >= x + hx - slack:
        return False
    if max(b, d) <= y - hy + slack or min(b, d) >= y + hy - slack:
        return False
    ux, uy = c - a, d - b
    reach = abs(ux) * hy + abs(uy) * hx - slack * np.sqrt(ux * ux + uy * uy)
    return abs(ux * (y - b) - uy * (x - a)) < reach


@leaf
def over_cell(roof, x, y, hx, hy, slack):
    """(state, upper and lower height at the centre of two planes of slopes gx, gy, wall): the top lies between them.

    wall : the only edge of the outline that crosses the cell, if it crosses all of it; else `NO_WALL`.
    """
    i = min(max(int((x - roof.grid[0]) / roof.grid[2]), 0), roof.size[0] - 1)
    j = min(max(int((y - roof.grid[1]) / roof.grid[3]), 0), roof.size[1] - 1)
    t = j * roof.size[0] + i
    count, gx, gy = 0, 0.0, 0.0
    for q in range(roof.start[t], roof.start[t + 1]):
        f = roof.ids[q]
        if _meets(roof.corner, f, x, y, hx, hy, slack):
            count += 1
            gx, gy = gx + roof.plane[f, 3], gy + roof.plane[f, 4]
    if count == 0:
        return OUTSIDE, 0.0, 0.0, 0.0, 0.0, NO_WALL
    gx, gy = gx / count, gy / count
    up, down = -np.inf, np.inf
    swing = abs(gx) * hx + abs(gy) * hy
    for q in range(roof.start[t], roof.start[t + 1]):
        f = roof.ids[q]
        if _meets(roof.corner, f, x, y, hx, hy, slack):
            sx, sy = roof.plane[f, 3], roof.plane[f, 4]
            z = roof.plane[f, 2] + sx * (x - roof.plane[f, 0]) + sy * (y - roof.plane[f, 1])
            off = abs(sx - gx) * hx + abs(sy - gy) * hy + slack * (abs(sx) + abs(sy))
            up = max(up, min(z + off, roof.plane[f, 6] + swing))
            down = min(down, max(z - off, roof.plane[f, 5] - swing))
    state, crossed, whole = WHOLE, NO_WALL, True
    for q in range(roof.first[t], roof.first[t + 1]):
        e = roof.walls[q]
        if _crosses(roof.wall, e, x, y, hx, hy, slack):
            whole = whole and state == WHOLE
            state, crossed = PARTLY, e
            for end in range(2):
                px, py = roof.wall[e, 2 * end], roof.wall[e, 2 * end + 1]
                whole = whole and (abs(px - x) >= hx or abs(py - y) >= hy)
    return state, up, down, gx, gy, crossed if whole else NO_WALL


@kernel
def binned(
    box: NDArray[np.float64], grid: NDArray[np.float64], size: NDArray[np.int64], start: NDArray[np.int64],
    ids: NDArray[np.int64], fill: bool,
) -> None:  # fmt: skip
    """Numbers of the boxes (n, 4) that each tile meets: counted into start[t + 1], then, from sums of these, into ids."""
    for f in range(len(box)):
        i0 = min(max(int(np.floor((box[f, 0] - grid[0]) / grid[2] - 1e-9)), 0), size[0] - 1)
        i1 = min(max(int(np.floor((box[f, 2] - grid[0]) / grid[2] + 1e-9)), 0), size[0] - 1)
        j0 = min(max(int(np.floor((box[f, 1] - grid[1]) / grid[3] - 1e-9)), 0), size[1] - 1)
        j1 = min(max(int(np.floor((box[f, 3] - grid[1]) / grid[3] + 1e-9)), 0), size[1] - 1)
        for j in range(j0, j1 + 1):
            for i in range(i0, i1 + 1):
                t = j * size[0] + i
                if fill:
                    ids[start[t]] = f
                    start[t] += 1
                else:
                    start[t + 1] += 1
