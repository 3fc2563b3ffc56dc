"""Depth buffer of triangles. corners (m, 3, 3): px across, px up, height; depth, face (rows, columns)."""

from __future__ import annotations

import numpy as np

from vmachining.jit import kernel

INSIDE = 1e-9
"""Pixels on the border of two triangles belong to both."""


@kernel
def nearest(corners, depth, face) -> None:
    rows, columns = depth.shape
    for t in range(len(corners)):
        ax, ay, az = corners[t, 0]
        bx, by, bz = corners[t, 1]
        cx, cy, cz = corners[t, 2]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0:
            continue
        ux, uy, vx, vy = (cy - ay) / area, (ax - cx) / area, (ay - by) / area, (bx - ax) / area
        x0 = max(0, int(np.ceil(min(ax, bx, cx))))
        x1 = min(columns - 1, int(np.floor(max(ax, bx, cx))))
        for y in range(
            max(0, int(np.ceil(min(ay, by, cy)))), min(rows - 1, int(np.floor(max(ay, by, cy)))) + 1
        ):
            u0, v0 = uy * (y - ay), vy * (y - ay)
            for x in range(x0, x1 + 1):
                u, v = u0 + ux * (x - ax), v0 + vx * (x - ax)
                if u < -INSIDE or v < -INSIDE or u + v > 1.0 + INSIDE:
                    continue
                z = az + u * (bz - az) + v * (cz - az)
                if z > depth[y, x]:
                    depth[y, x], face[y, x] = z, t
