# Signed distance of points to a closed triangle mesh, and the pseudonormals that carry its sign.
#
# Legend: a, b, c (m, 3) corners of triangles, outward. normals (m, 7, 3): pseudonormals of the face, the edges
#   ab, bc, ca and the corners a, b, c; the sign of (point - nearest) . pseudonormal of the feature that holds
#   the nearest point tells inside from outside (Baerentzen and Aanaes, IEEE TVCG 11 (2005) 243-253).
# ball (m, 4): centre and radius of a ball around each triangle.

import numpy as np

from vmachining.jit import kernel


@kernel
def nearest_on(p, a, b, c, out):
    """Nearest point of a triangle, into `out`; returns the feature 0 face, 1 ab, 2 bc, 3 ca, 4 a, 5 b, 6 c."""
    ab, ac, ap = b - a, c - a, p - a
    d1, d2 = ab @ ap, ac @ ap
    if d1 <= 0.0 and d2 <= 0.0:
        out[:] = a
        return 4
    bp = p - b
    d3, d4 = ab @ bp, ac @ bp
    if d3 >= 0.0 and d4 <= d3:
        out[:] = b
        return 5
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        out[:] = a + (d1 / (d1 - d3)) * ab
        return 1
    cp = p - c
    d5, d6 = ab @ cp, ac @ cp
    if d6 >= 0.0 and d5 <= d6:
        out[:] = c
        return 6
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        out[:] = a + (d2 / (d2 - d6)) * ac
        return 3
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        out[:] = b + ((d4 - d3) / ((d4 - d3) + (d5 - d6))) * (c - b)
        return 2
    share = 1.0 / (va + vb + vc)
    out[:] = a + ab * (vb * share) + ac * (vc * share)
    return 0


@kernel
def mesh_distances(points, a, b, c, normals, ball, out) -> None:
    """Signed distance of every point, negative inside."""
    foot, best_foot = np.empty(3), np.empty(3)
    start = 0
    for i in range(len(points)):
        p = points[i]
        best, triangle, feature = np.inf, -1, 0
        for k in range(len(a)):
            j = (start + k) % len(a)  # the nearest triangle of the last point first
            dx, dy, dz = p[0] - ball[j, 0], p[1] - ball[j, 1], p[2] - ball[j, 2]
            reach = best + ball[j, 3]
            if dx * dx + dy * dy + dz * dz > reach * reach:
                continue
            what = nearest_on(p, a[j], b[j], c[j], foot)
            d = np.sqrt((p[0] - foot[0]) ** 2 + (p[1] - foot[1]) ** 2 + (p[2] - foot[2]) ** 2)
            if d < best:
                best, triangle, feature = d, j, what
                best_foot[:] = foot
        n = normals[triangle, feature]
        side = (p[0] - best_foot[0]) * n[0] + (p[1] - best_foot[1]) * n[1] + (p[2] - best_foot[2]) * n[2]
        out[i] = best if side >= 0.0 else -best
        start = triangle
