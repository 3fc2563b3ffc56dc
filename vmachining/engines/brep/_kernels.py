"""Compiled loops of `outside.py`."""

from __future__ import annotations

import numpy as np

from vmachining.jit import kernel, leaf


@leaf
def left_of(ax, ay, bx, by, x, y):
    """On which side of an edge: the same word from both of its triangles, places on the line itself included."""
    if (ax, ay) > (bx, by):
        return not ((ax - bx) * (y - by) - (ay - by) * (x - bx) > 0.0)
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0


@kernel
def crossings(corners, up, first, member, origin, pitch, wide, places, counts, heights, fill) -> None:
    """How often lines along z at (n, 2) places go through triangles (m, 3, 3); where `fill`, heights in rising order.

    first, member : triangles of every cell of a raster of `wide` (2,) cells, row by row. counts (n,); heights, one line's after
    the other's, have room for them.
    """
    at = 0
    for i in range(len(places)):
        x, y = places[i, 0], places[i, 1]
        u, v = int(np.floor((x - origin[0]) / pitch[0])), int(np.floor((y - origin[1]) / pitch[1]))
        n = 0
        if 0 <= u < wide[0] and 0 <= v < wide[1]:
            cell = u * wide[1] + v
            for k in range(first[cell], first[cell + 1]):
                t = corners[member[k]]
                side = up[member[k]]
                if left_of(t[0, 0], t[0, 1], t[1, 0], t[1, 1], x, y) != side:
                    continue
                if left_of(t[1, 0], t[1, 1], t[2, 0], t[2, 1], x, y) != side:
                    continue
                if left_of(t[2, 0], t[2, 1], t[0, 0], t[0, 1], x, y) != side:
                    continue
                if fill:
                    ax, ay, az = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
                    bx, by, bz = t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
                    n_x, n_y, n_z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
                    z = t[0, 2] - (n_x * (x - t[0, 0]) + n_y * (y - t[0, 1])) / n_z
                    j = at + n
                    while j > at and heights[j - 1] > z:
                        heights[j] = heights[j - 1]
                        j -= 1
                    heights[j] = z
                n += 1
        counts[i] = n
        at += n
