# Triangles seen from above, over the lines of a grid. Legend: corners (m, 3, 3), counterclockwise seen from outside; a, b, c
#   corners of one; u, v: shares of b - a and c - a.

import numpy as np

from vmachining.jit import kernel


@kernel
def highest(corners, x, y, touch, out) -> None:
    """Raise out (n, m) to the highest point of the triangles that look up, on upright lines at rising x (n,) and y (m,).

    touch : mm aside, and share of a side, within which a line meets a triangle.
    """
    n, m = len(x), len(y)
    for k in range(len(corners)):
        q = corners[k]
        low, high = min(q[0, 0], min(q[1, 0], q[2, 0])), max(q[0, 0], max(q[1, 0], q[2, 0]))
        if low > x[n - 1] + touch or high < x[0] - touch:
            continue
        left, right = min(q[0, 1], min(q[1, 1], q[2, 1])), max(q[0, 1], max(q[1, 1], q[2, 1]))
        if left > y[m - 1] + touch or right < y[0] - touch:
            continue
        bx, by, cx, cy = q[1, 0] - q[0, 0], q[1, 1] - q[0, 1], q[2, 0] - q[0, 0], q[2, 1] - q[0, 1]
        area = bx * cy - by * cx
        if area <= 0.0:  # seen from below, or a wall
            continue
        bz, cz = q[1, 2] - q[0, 2], q[2, 2] - q[0, 2]
        i0, i1 = np.searchsorted(x, low - touch), np.searchsorted(x, high + touch)
        j0, j1 = np.searchsorted(y, left - touch), np.searchsorted(y, right + touch)
        for i in range(i0, i1):
            dx = x[i] - q[0, 0]
            for j in range(j0, j1):
                dy = y[j] - q[0, 1]
                u, v = (dx * cy - dy * cx) / area, (dy * bx - dx * by) / area
                if u >= -touch and v >= -touch and u + v <= 1.0 + touch:
                    out[i, j] = max(out[i, j], q[0, 2] + u * bz + v * cz)
