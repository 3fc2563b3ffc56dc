# Discrete vectors against sweeps and facets, heights and rays of triangle meshes.
#
# Legend: a vector is P(t) = C + t N, lam <= t <= L; L its length (stored in float32), lam < 0 its fixed lower end.
#   t_in, t_out: where its line is in a sweep. Upright vectors stand at the middles of square cells, [i, j] along x and y.
#   boxes: binary tree over triangles, see the legend of `vmachining.stock._kernels`.

import numpy as np

from vmachining.jit import kernel, leaf
from vmachining.stock._kernels import LEAF

EDGE = 1e-12  # relative area by which a point may lie beyond an edge and still belong to the triangle


@leaf
def shortened(t_in, t_out, lam, length):
    """New length of a vector, and 1 where it was entered from behind (spec E.6, exact sweeps)."""
    if t_in >= length or t_in == lam:
        return length, 0
    if t_in > lam:
        return t_in, 0
    if t_out >= length:
        return lam, 0
    if t_out > lam:
        return length, 1
    return length, 0


@leaf
def across(x, px, py, qx, qy, slack, low, high):
    """Range of y widened by where an edge from p to q is at x; by all of it where it is upright."""
    if x < min(px, qx) - slack or x > max(px, qx) + slack:
        return low, high
    if abs(qx - px) <= 2.0 * slack:
        return min(low, py, qy), max(high, py, qy)
    y = py + min(max((x - px) / (qx - px), 0.0), 1.0) * (qy - py)
    return min(low, y), max(high, y)


@kernel
def raster(corners, which, x0, y0, pitch, below, sense, height, facet) -> None:
    """Highest triangle over every cell's middle among those that face up (sense 1) or down (-1) and lie under `below`.

    corners (k, 3, 3). which (n,) triangles to look at. height, facet (n, m), -inf and -1 where none exists; cell (i, j)
    stands at (x0 + i pitch, y0 + j pitch). Points on an edge belong to both sides.
    """
    n, m = height.shape
    for k in which:
        ax, ay, az = corners[k, 0, 0], corners[k, 0, 1], corners[k, 0, 2]
        ux, uy, uz = corners[k, 1, 0] - ax, corners[k, 1, 1] - ay, corners[k, 1, 2] - az
        vx, vy, vz = corners[k, 2, 0] - ax, corners[k, 2, 1] - ay, corners[k, 2, 2] - az
        area = ux * vy - vx * uy
        if not area * sense > 0.0:
            continue
        left, right = min(0.0, ux, vx), max(0.0, ux, vx)
        front, back = min(0.0, uy, vy), max(0.0, uy, vy)
        slack = 1e-9 * (right - left + back - front)
        i0 = max(0, int(np.ceil((ax + left - slack - x0) / pitch)))
        i1 = min(n - 1, int(np.floor((ax + right + slack - x0) / pitch)))
        for i in range(i0, i1 + 1):
            x = x0 + i * pitch - ax
            low, high = across(x, 0.0, 0.0, ux, uy, slack, np.inf, -np.inf)
            low, high = across(x, ux, uy, vx, vy, slack, low, high)
            low, high = across(x, vx, vy, 0.0, 0.0, slack, low, high)
            j0 = max(0, int(np.ceil((ay + max(low, front) - slack - y0) / pitch)))
            j1 = min(m - 1, int(np.floor((ay + min(high, back) + slack - y0) / pitch)))
            for j in range(j0, j1 + 1):
                y = y0 + j * pitch - ay
                s, t = (x * vy - vx * y) / area, (ux * y - x * uy) / area
                if s < -EDGE or t < -EDGE or s + t > 1.0 + EDGE:
                    continue
                z = az + s * uz + t * vz
                if z > height[i, j] and z < below[i, j]:
                    height[i, j] = z
                    facet[i, j] = k


@kernel
def vector_ends(corners, which, x0, y0, pitch, n, m, casting, bottom, start, low, facet) -> None:
    """Where the upright vectors of n x m cells of a tile (T, T) start and end below, see `upright.Base`.

    bottom (T, T): of the stock, NaN where none exists; with `casting` that of the part. start, low: written, NaN without
    part and stock. facet: -1 in, the facet of the part at `start` out.
    """
    shape = bottom.shape
    height, exit_ = np.full(shape, -np.inf), np.full(shape, -np.inf)
    below, under = np.full(shape, np.inf), np.full(shape, -1)
    raster(corners, which, x0, y0, pitch, below, 1.0, height, facet)
    raster(corners, which, x0, y0, pitch, height - 1e-9, -1.0, exit_, under)
    for i in range(shape[0]):
        for j in range(shape[1]):
            if i >= n or j >= m:
                facet[i, j] = -1
                start[i, j], low[i, j], bottom[i, j] = np.nan, np.nan, np.nan
            elif facet[i, j] < 0:
                start[i, j], low[i, j] = bottom[i, j], bottom[i, j]
            else:
                start[i, j] = height[i, j]
                low[i, j] = exit_[i, j] if under[i, j] >= 0 else height[i, j]
                if casting:
                    bottom[i, j] = low[i, j]
                elif np.isnan(bottom[i, j]):
                    bottom[i, j] = start[i, j]


@kernel
def deviations(start, low, facet, length, cosine, hidden, at, deviation, ended) -> tuple[int, int]:
    """Upright vectors of a tile (T, T) that are reported, and cells over the part without a vector: how many of each.

    cosine, hidden (f,): of the slope of a facet, and whether it is left to vectors along normals. at (T * T,): their cells;
    deviation (mm) and whether a vector ended at lambda, both in the order of `at`.
    """
    count, bare = 0, 0
    for i in range(start.shape[0]):
        for j in range(start.shape[1]):
            k = facet[i, j]
            if k < 0 or hidden[k]:
                continue
            size = length[i, j]
            if np.isnan(size):
                bare += 1
                continue
            at[count] = i * start.shape[1] + j
            deviation[count] = np.float64(size) * cosine[k]
            ended[count] = size <= np.float32(low[i, j] - start[i, j])
            count += 1
    return count, bare


@leaf
def box_entry(o, u, box, most):
    """First t >= 0 of a ray in a box; inf where it misses or comes later than `most`."""
    a, b = 0.0, most
    for k in range(3):
        if u[k] == 0.0:
            if o[k] < box[k] or o[k] > box[3 + k]:
                return np.inf
            continue
        p, q = (box[k] - o[k]) / u[k], (box[3 + k] - o[k]) / u[k]
        a, b = max(a, min(p, q)), min(b, max(p, q))
    if a > b:
        return np.inf
    return a


@leaf
def triangle_hit(o, u, a, b, c):
    """t at which a line meets a triangle and the sign of u . n there; inf, 0 if it misses (Moller and Trumbore 1997)."""
    e0, e1, e2 = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    f0, f1, f2 = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    p0, p1, p2 = u[1] * f2 - u[2] * f1, u[2] * f0 - u[0] * f2, u[0] * f1 - u[1] * f0
    det = e0 * p0 + e1 * p1 + e2 * p2
    if det == 0.0:
        return np.inf, 0.0
    s0, s1, s2 = o[0] - a[0], o[1] - a[1], o[2] - a[2]
    x = (s0 * p0 + s1 * p1 + s2 * p2) / det
    if x < -EDGE or x > 1.0 + EDGE:
        return np.inf, 0.0
    q0, q1, q2 = s1 * e2 - s2 * e1, s2 * e0 - s0 * e2, s0 * e1 - s1 * e0
    y = (u[0] * q0 + u[1] * q1 + u[2] * q2) / det
    if y < -EDGE or x + y > 1.0 + EDGE:
        return np.inf, 0.0
    return (f0 * q0 + f1 * q1 + f2 * q2) / det, -np.sign(det)


@kernel
def first_hits(origins, directions, sense, least, most, a, b, c, boxes, out) -> None:
    """First t in (least, most] of every ray at a triangle whose outward normal has the sign `sense` along it; else inf.

    sense +1: the ray leaves the solid there, -1: it enters.
    """
    stack = np.empty(128, dtype=np.int64)
    leaves = (len(boxes) + 1) // 2
    for i in range(len(origins)):
        o, u = origins[i], directions[i]
        best = np.inf
        top = 1
        stack[0] = 0
        while top > 0:
            top -= 1
            node = stack[top]
            if box_entry(o, u, boxes[node], min(best, most)) == np.inf:
                continue
            if node < leaves - 1:
                stack[top], stack[top + 1] = 2 * node + 1, 2 * node + 2
                top += 2
                continue
            begin = (node - leaves + 1) * LEAF
            for j in range(begin, min(begin + LEAF, len(a))):
                t, side = triangle_hit(o, u, a[j], b[j], c[j])
                if side == sense and least < t < best and t <= most:
                    best = t
        out[i] = best
