"""The grid of heights over a tile, and what of its triangles is in the way of a sweep.

Legend
    points (n, 3), triangles (m, 3)   the closed mesh of a solid
    lo, hi (3,)   box of the material               heights (nx, ny), corner (3,), cell   grid of heights
"""

import numpy as np

from vmachining.jit import leaf


@leaf
def _raise_along(a, b, lo, cell, out):
    """Raise the cells (nx, ny) around an edge: what stands upright is as high as its edges are."""
    nx, ny = out.shape
    i0 = int(np.floor((min(a[0], b[0]) - lo[0]) / cell))
    i1 = int(np.floor((max(a[0], b[0]) - lo[0]) / cell))
    j0 = int(np.floor((min(a[1], b[1]) - lo[1]) / cell))
    j1 = int(np.floor((max(a[1], b[1]) - lo[1]) / cell))
    i0, i1, j0, j1 = max(i0, 0), min(i1, nx - 1), max(j0, 0), min(j1, ny - 1)
    if i0 == i1 and j0 == j1:
        out[i0, j0] = max(out[i0, j0], a[2], b[2])
        return
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            first, last = 0.0, 1.0  # the part of the edge over the cell
            for axis in range(2):
                length, corner = b[axis] - a[axis], lo[axis] + (i if axis == 0 else j) * cell
                if abs(length) > 1e-9:
                    one, other = (corner - 1e-9 - a[axis]) / length, (corner + cell + 1e-9 - a[axis]) / length
                    first, last = max(first, min(one, other)), min(last, max(one, other))
            if first <= last:
                high = a[2] + max(first * (b[2] - a[2]), last * (b[2] - a[2]))
                out[i, j] = max(out[i, j], min(max(a[2], b[2]), high + 1e-9))


@leaf
def _raise(a, b, c, lo, cell, out):
    """Raise the cells (nx, ny) over a triangle to its height; only if it faces up or stands upright."""
    nx, ny = out.shape
    nz = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    if nz < 0.0:  # what faces down is below something that faces up
        return
    i0 = int(np.floor((min(a[0], b[0], c[0]) - lo[0]) / cell))
    i1 = int(np.floor((max(a[0], b[0], c[0]) - lo[0]) / cell))
    j0 = int(np.floor((min(a[1], b[1], c[1]) - lo[1]) / cell))
    j1 = int(np.floor((max(a[1], b[1], c[1]) - lo[1]) / cell))
    i0, i1, j0, j1 = max(i0, 0), min(i1, nx - 1), max(j0, 0), min(j1, ny - 1)
    top, low = max(a[2], b[2], c[2]), min(a[2], b[2], c[2])
    flat = (i0 == i1 and j0 == j1) or top - low < 1e-9
    if nz < 1e-9 and not flat:
        size = max(abs(b[0] - a[0]), abs(b[1] - a[1]), abs(c[0] - a[0]), abs(c[1] - a[1]))
        if nz <= 1e-9 * size:  # no wider than 1e-9 mm from above: no cell has a corner inside
            _raise_along(a, b, lo, cell, out)
            _raise_along(b, c, lo, cell, out)
            _raise_along(c, a, lo, cell, out)
            return
        flat = True  # its slopes are rounding
    if flat:
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                out[i, j] = max(out[i, j], top)
        return
    # slopes of its plane, dz/dx and dz/dy
    nx_ = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
    ny_ = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])
    sx, sy = -nx_ / nz, -ny_ / nz
    rise = 0.5 * cell * (abs(sx) + abs(sy)) + 1e-9
    for i in range(i0, i1 + 1):
        x = lo[0] + (i + 0.5) * cell - a[0]
        for j in range(j0, j1 + 1):
            y = lo[1] + (j + 0.5) * cell - a[1]
            out[i, j] = max(out[i, j], min(top, a[2] + sx * x + sy * y + rise))


@leaf
def roof(points, triangles, lo, cell, out):
    """Largest height of the solid over every cell of a grid in x and y, into `out` (nx, ny).

    points (n, 3), triangles (m, 3) of a closed mesh, lo (3,) corner of the grid, cell: its step. Where a point
    belongs to the solid there is a triangle above it, so the highest triangle over a cell bounds the solid.
    """
    out[:] = -np.inf
    for t in range(triangles.shape[0]):
        _raise(points[triangles[t, 0]], points[triangles[t, 1]], points[triangles[t, 2]], lo, cell, out)


@leaf
def roof_of(hulls, chosen, lo, cell, out):
    """The same for those of the pieces (n, 4, 3) of triangles, see `above`, that are chosen.

    Returns the ranges i0, i1, j0, j1 of cells outside of which there is none; i0 >= i1 if there is none at all.
    """
    out[:] = -np.inf
    for t in range(hulls.shape[0]):
        if chosen[t]:
            _raise(hulls[t, 0], hulls[t, 1], hulls[t, 2], lo, cell, out)
            _raise(hulls[t, 0], hulls[t, 2], hulls[t, 3], lo, cell, out)
    i0, i1, j0, j1 = out.shape[0], 0, out.shape[1], 0
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            if out[i, j] > -np.inf:
                i0, i1, j0, j1 = min(i0, i), max(i1, i + 1), min(j0, j), max(j1, j + 1)
    return i0, i1, j0, j1


@leaf
def under_roof(x0, x1, y0, y1, z0, lo, hi, corner, heights, cell):
    """Whether a box from z0 up can meet the solid below the grid of heights."""
    if not (z0 <= hi[2] and x0 <= hi[0] and x1 >= lo[0] and y0 <= hi[1] and y1 >= lo[1]):
        return False
    nx, ny = heights.shape
    i0, i1 = max(int((x0 - corner[0]) / cell), 0), min(int((x1 - corner[0]) / cell), nx - 1)
    j0, j1 = max(int((y0 - corner[1]) / cell), 0), min(int((y1 - corner[1]) / cell), ny - 1)
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            if heights[i, j] >= z0:
                return True
    return False


@leaf
def boxes_seen(boxes, lo, hi, corner, heights, cell, out):
    """`under_roof` for boxes (k, 2, 3); the grid must reach as high as the solid inside lo, hi."""
    for k in range(boxes.shape[0]):
        a, b = boxes[k, 0], boxes[k, 1]
        out[k] = b[2] >= lo[2] and under_roof(a[0], b[0], a[1], b[1], a[2], lo, hi, corner, heights, cell)


@leaf
def above(points, triangles, lo, hi, start, heading, low, step, lowest, rear, hulls, boxes, near):
    """What triangles that reach into a column have above its foot: hulls (n, 4, 3) in boxes (n, 2, 3).

    lo, hi (3,): the column, as high as it may be. Those behind the limits `lowest` (k,) at all their heights, see
    `ahead.py`, are left out; near (n,): which are not behind those of `rear` either. No limits hold nothing back.
    Returns how many there are, and the height up to which any triangle, left out or not, reaches.
    """
    count, top = 0, -np.inf
    z, k = lo[2], lowest.shape[0]
    for t in range(triangles.shape[0]):
        u, v, w = points[triangles[t, 0]], points[triangles[t, 1]], points[triangles[t, 2]]
        if max(u[0], v[0], w[0]) < lo[0] or min(u[0], v[0], w[0]) > hi[0]:
            continue
        peak = max(u[2], v[2], w[2])
        if max(u[1], v[1], w[1]) < lo[1] or min(u[1], v[1], w[1]) > hi[1] or peak < z:
            continue
        top = max(top, peak)
        ahead = k == 0
        near[count] = ahead
        if not ahead:
            far = max(
                (u[0] - start[0]) * heading[0] + (u[1] - start[1]) * heading[1],
                (v[0] - start[0]) * heading[0] + (v[1] - start[1]) * heading[1],
                (w[0] - start[0]) * heading[0] + (w[1] - start[1]) * heading[1],
            )
            j0 = int(np.floor((max(min(u[2], v[2], w[2]), z) - start[2] - low) / step))
            j1 = int(np.floor((peak - start[2] - low) / step))
            for j in range(max(j0, 0), min(j1, k - 1) + 1):
                ahead = ahead or far >= lowest[j]
                near[count] = near[count] or far >= rear[j]
            if not ahead:
                continue
        size = 0
        for c in range(3):
            a, b = points[triangles[t, c]], points[triangles[t, (c + 1) % 3]]
            if a[2] >= z:
                for i in range(3):
                    hulls[count, size, i] = a[i]
                size += 1
            if (a[2] >= z) != (b[2] >= z):
                share = (z - a[2]) / (b[2] - a[2])
                for i in range(2):
                    hulls[count, size, i] = a[i] + share * (b[i] - a[i])
                hulls[count, size, 2] = z
                size += 1
        if size == 0:
            continue
        for c in range(size, 4):
            for i in range(3):
                hulls[count, c, i] = hulls[count, size - 1, i]
        for i in range(3):
            first, last = hulls[count, 0, i], hulls[count, 0, i]
            for c in range(1, 4):
                first, last = min(first, hulls[count, c, i]), max(last, hulls[count, c, i])
            boxes[count, 0, i], boxes[count, 1, i] = first, last
        count += 1
    return count, top
