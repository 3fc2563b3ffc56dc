# Discrete vectors against sweeps and facets, heights and rays of triangle meshes.
#
# Legend: a vector is P(t) = C + t N, lam <= t <= L; L its length (stored in float32), lam < 0 its fixed lower end.
#   t_in, t_out: where its line is in a sweep. ball cutter: radius R about c, upright shank of the same radius from c
#   up to c + H. c1 first centre, d travel. Upright vectors stand at the middles of square cells, [i, j] along x and y.
#   boxes: binary tree over triangles, see the legend of `vmachining.stock._kernels`.

import numpy as np

from vmachining.jit import kernel, leaf
from vmachining.stock._kernels import LEAF
from vmachining.sweep.ball._kernels import ball_entry, in_ball_sweep

GRAZE = 1e-12  # |N . N_T| below which a facet is taken as parallel to the vector (spec E.6)
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


@kernel
def ball_normals(at, point, normal, lam, length, behind, c1, d, r, height, unsure) -> int:
    """Shorten vectors `at` (n,) by a straight block of a ball cutter; how many are left in `unsure` (n,) for others."""
    left = 0
    for i in range(len(at)):
        k = at[i]
        x, y, z = point[k, 0] - c1[0], point[k, 1] - c1[1], point[k, 2] - c1[2]
        u, v, w = normal[k, 0], normal[k, 1], normal[k, 2]
        t, sure = ball_entry(x, y, z, u, v, w, d[0], d[1], d[2], r, height)
        if not sure:
            unsure[left] = k
            left += 1
            continue
        size = np.float64(length[k])
        low = np.float64(lam[k])
        if t >= size:
            continue
        t_out = np.inf
        if t < low and not in_ball_sweep(
            x + size * u, y + size * v, z + size * w, d[0], d[1], d[2], r, height
        ):
            behind_it = in_ball_sweep(x + low * u, y + low * v, z + low * w, d[0], d[1], d[2], r, height)
            t_out = 0.5 * (low + size) if behind_it else low
        new, flag = shortened(t, t_out, low, size)
        length[k] = new
        behind[k] |= flag
    return left


@kernel
def interval_normals(at, first, enter, leave, lam, length, behind) -> None:
    """Shorten vectors `at` (n,) by the intervals of their lines, first[i] to first[i + 1] of enter and leave, rising."""
    for i in range(len(at)):
        k = at[i]
        for j in range(first[i], first[i + 1]):
            new, flag = shortened(enter[j], leave[j], np.float64(lam[k]), np.float64(length[k]))
            length[k] = new
            behind[k] |= flag


@kernel
def near_box(cells, first, x0, y0, cell, point, normal, lam, length, box, margin, out) -> int:
    """Vectors whose piece from lam to L comes into a box; their number. cells (a, b), first: rows by cell along x, y."""
    a0 = max(0, int(np.floor((box[0, 0] - margin - x0) / cell)))
    a1 = min(cells[0] - 1, int(np.floor((box[1, 0] + margin - x0) / cell)))
    b0 = max(0, int(np.floor((box[0, 1] - margin - y0) / cell)))
    b1 = min(cells[1] - 1, int(np.floor((box[1, 1] + margin - y0) / cell)))
    found = 0
    for a in range(a0, a1 + 1):
        for k in range(first[a * cells[1] + b0], first[a * cells[1] + b1 + 1]) if b1 >= b0 else range(0):
            apart = False
            for c in range(3):
                p, q = point[k, c] + lam[k] * normal[k, c], point[k, c] + length[k] * normal[k, c]
                apart = apart or min(p, q) > box[1, c] or max(p, q) < box[0, c]
            if not apart:
                out[found] = k
                found += 1
    return found


@kernel
def apply_upright(length, base, low, bottom, ia, jb, enter, leave, depth) -> int:
    """Shorten the upright vectors of one tile by heights of a rectangle of cells; how many were entered from behind.

    length (T, T) float32, NaN where there is none. base, low, bottom (T, T) mm: C, end of the vectors, end of material.
    Cell (i, j) of the tile is (i + ia, j + jb) of enter, leave, depth (n, m); depth grows by what is taken.
    """
    count = 0
    n, m = enter.shape
    for i in range(max(0, -ia), min(length.shape[0], n - ia)):
        for j in range(max(0, -jb), min(length.shape[1], m - jb)):
            t = enter[i + ia, j + jb]
            size = np.float64(length[i, j])
            if not t - base[i, j] < size:
                continue
            new, flag = shortened(
                t - base[i, j], leave[i + ia, j + jb] - base[i, j], low[i, j] - base[i, j], size
            )
            count += flag
            length[i, j] = new
            rest = bottom[i, j] - base[i, j]
            depth[i + ia, j + jb] += max(size, rest) - max(np.float64(length[i, j]), rest)
    return count


@kernel
def neighbour_sums(depth, out) -> None:
    """Sums over cells of the least depth around, the depth, and the largest around; those outside do not count."""
    n, m = depth.shape
    out[:] = 0.0
    for i in range(n):
        for j in range(m):
            least, most = depth[i, j], depth[i, j]
            for a in range(max(0, i - 1), min(n, i + 2)):
                for b in range(max(0, j - 1), min(m, j + 2)):
                    least, most = min(least, depth[a, b]), max(most, depth[a, b])
            out[0] += least
            out[1] += depth[i, j]
            out[2] += most


@kernel
def raster(corners, which, x0, y0, pitch, below, sense, height, facet) -> None:
    """Highest triangle over every cell's middle among those that face up (sense 1) or down (-1) and lie under `below`.

    corners (k, 3, 3). which (n,) triangles to look at. height, facet (n, m), -inf and -1 where there is none; cell (i, j)
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
        j0 = max(0, int(np.ceil((ay + front - slack - y0) / pitch)))
        j1 = min(m - 1, int(np.floor((ay + back + slack - y0) / pitch)))
        for i in range(i0, i1 + 1):
            x = x0 + i * pitch - ax
            for j in range(j0, j1 + 1):
                y = y0 + j * pitch - ay
                s, t = (x * vy - vx * y) / area, (ux * y - x * uy) / area
                if s < -EDGE or t < -EDGE or s + t > 1.0 + EDGE:
                    continue
                z = az + s * uz + t * vz
                if z > height[i, j] and z < below[i, j]:
                    height[i, j] = z
                    facet[i, j] = k


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


@kernel
def facet_rows(corners, spacing, first, point) -> None:
    """Points on triangles (n, 3, 3) in rows along their longest side, rows and points at most `spacing` apart.

    first (n + 1,) where the points of each begin; with point (0, 3) only their numbers are written, to first[k + 1].
    """
    fill = len(point) > 0
    for k in range(len(corners)):
        best, side = -1.0, 0
        for s in range(3):
            size = 0.0
            for c in range(3):
                size += (corners[k, (s + 1) % 3, c] - corners[k, s, c]) ** 2
            if size > best:
                best, side = size, s
        base = np.sqrt(best)
        a, b, top = corners[k, side], corners[k, (side + 1) % 3], corners[k, (side + 2) % 3]
        foot = 0.0
        for c in range(3):
            foot += (top[c] - a[c]) * (b[c] - a[c]) / best
        tall = 0.0
        for c in range(3):
            tall += (top[c] - a[c] - foot * (b[c] - a[c])) ** 2
        many = max(1, int(np.ceil(np.sqrt(tall) / spacing - 1e-9)))
        count = 0
        for i in range(many):
            share = (i + 0.5) / many  # of the way from the longest side to the corner
            n = max(1, int(np.ceil((1.0 - share) * base / spacing - 1e-9)))
            if fill:
                for j in range(n):
                    t = (1.0 - share) * (j + 0.5) / n
                    for c in range(3):
                        point[first[k] + count + j, c] = a[c] + t * (b[c] - a[c]) + share * (top[c] - a[c])
            count += n
        if not fill:
            first[k + 1] = count


@kernel
def facets_upright(corners, x0, y0, pitch, enter) -> None:
    """Lowest facet that faces down over every cell of a rectangle (n, m): the published test, all N = (0, 0, 1)."""
    n, m = enter.shape
    for k in range(len(corners)):
        ax, ay, az = corners[k, 0, 0], corners[k, 0, 1], corners[k, 0, 2]
        ux, uy, uz = corners[k, 1, 0] - ax, corners[k, 1, 1] - ay, corners[k, 1, 2] - az
        vx, vy, vz = corners[k, 2, 0] - ax, corners[k, 2, 1] - ay, corners[k, 2, 2] - az
        area = ux * vy - vx * uy
        nx, ny = uy * vz - uz * vy, uz * vx - ux * vz
        if not area < -GRAZE * np.sqrt(nx * nx + ny * ny + area * area):
            continue
        i0 = max(0, int(np.ceil((ax + min(0.0, ux, vx) - x0) / pitch - 1e-9)))
        i1 = min(n - 1, int(np.floor((ax + max(0.0, ux, vx) - x0) / pitch + 1e-9)))
        j0 = max(0, int(np.ceil((ay + min(0.0, uy, vy) - y0) / pitch - 1e-9)))
        j1 = min(m - 1, int(np.floor((ay + max(0.0, uy, vy) - y0) / pitch + 1e-9)))
        for i in range(i0, i1 + 1):
            x = x0 + i * pitch - ax
            for j in range(j0, j1 + 1):
                y = y0 + j * pitch - ay
                s, t = (x * vy - vx * y) / area, (ux * y - x * uy) / area
                if s >= -EDGE and t >= -EDGE and s + t <= 1.0 + EDGE:
                    enter[i, j] = min(enter[i, j], az + s * uz + t * vz)


@kernel
def facets_normals(at, point, normal, lam, length, corners) -> None:
    """The published test of vectors `at` against facets (k, 3, 3): lam < w < L and N . N_T < 0 make w the length."""
    for i in range(len(at)):
        k = at[i]
        for j in range(len(corners)):
            t, side = triangle_hit(point[k], normal[k], corners[j, 0], corners[j, 1], corners[j, 2])
            if side < 0.0 and lam[k] < t < length[k]:
                length[k] = t
