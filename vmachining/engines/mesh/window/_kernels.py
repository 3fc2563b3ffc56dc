"""The grid of heights over a tile.

Legend
    points (n, 3), triangles (m, 3)   the closed mesh of a solid
    lo (3,), cell   corner and step of the grid of heights
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
