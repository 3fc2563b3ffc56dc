# The moving surface of a body of revolution: where it advances, as a closed mesh.
#
# Legend
#   pose (m, 17)   per instant: tip, X, Y, A (3 each, frame carried along with A), tip velocity along X, Y, A,
#                  dA/dt along X and Y
#   row (n, 4)     h, r, n_r, n_z of a circle            resting (n, 2)   h, r of facets at rest
#   group (n,)     rows of one circle share a number     between (n - 1, 6)  see `rows.Rows`
#   cos, sin (q,)  columns
#   j, i, k        instant, row, column; f normal velocity of the surface point; a node is in where f > tol
# The nodes are a grid in (u, x, t), u round the axis, x up the meridian; (u, x, t) is right-handed, and the
# point P(u, x, t) turns that sense round nowhere where f > 0. Corner of a cell: u + 2 x + 4 t.

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.jit import kernel, leaf
from vmachining.sweep.grazing._kernels import normal_speed

FACES = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
# corners of each face, counter-clockwise from outside; the first two are t = 0 and t = 1

SHY = 1e-3  # crossings keep this share of an edge away from its ends: no needles


class Body(NamedTuple):
    """The body and its instants, see the legend. first : instant of j = 0. same : `resting` are the circles themselves."""

    pose: NDArray[np.float64]
    row: NDArray[np.float64]
    resting: NDArray[np.float64]
    group: NDArray[np.int64]
    cos: NDArray[np.float64]
    sin: NDArray[np.float64]
    first: int
    same: bool


class Grid(NamedTuple):
    """Numbers of points, -1 where none exists yet.

    edge (3, m, n, q): crossings along u, x, t. ring (m, rings, q): nodes of circles. rest (2, rings, q): facet corners of
    the body at rest at the first and the last instant. corner (8,): which corners of the cell at hand are in. onward (8, 8):
    see `_edge_number`.
    """

    edge: NDArray[np.int32]
    ring: NDArray[np.int32]
    rest: NDArray[np.int32]
    corner: NDArray[np.bool_]
    onward: NDArray[np.int64]


@kernel
def transported(axes):
    """Frames (m, 3, 3): X, Y, A with X, Y carried along by the smallest turn from axis to axis."""
    out = np.empty((axes.shape[0], 3, 3))
    a = axes[0]
    x = np.zeros(3)
    x[np.argmin(np.abs(a))] = 1.0
    x = x - np.dot(x, a) * a
    x = x / np.sqrt(np.dot(x, x))
    for j in range(axes.shape[0]):
        b = axes[j]
        x = x - (a + b) * (np.dot(b, x) / (1.0 + np.dot(a, b)))
        x = x - np.dot(x, b) * b
        x = x / np.sqrt(np.dot(x, x))
        out[j, 0], out[j, 2] = x, b
        out[j, 1, 0] = b[1] * x[2] - b[2] * x[1]
        out[j, 1, 1] = b[2] * x[0] - b[0] * x[2]
        out[j, 1, 2] = b[0] * x[1] - b[1] * x[0]
        a = b
    return out


@leaf
def _place(out, at, pose, j, h, r, cos, sin):
    """Point of the circle (h, r)."""
    for c in range(3):
        out[at, c] = pose[j, c] + h * pose[j, 9 + c] + r * (cos * pose[j, 3 + c] + sin * pose[j, 6 + c])


@leaf
def _wave(p, circle):
    """a, b, c of f = c + a cos u + b sin u."""
    h, r, n_r, n_z = circle[0], circle[1], circle[2], circle[3]
    a = normal_speed(h, r, n_r, n_z, p[12], 0.0, p[15])
    return a, normal_speed(h, r, n_r, n_z, p[13], 0.0, p[16]), normal_speed(h, r, n_r, n_z, 0.0, p[14], 0.0)


@kernel
def fields(pose, row, cos, sin, first, last):
    """f (last - first + 1, n, q) on the nodes."""
    m, n, q = last - first + 1, row.shape[0], cos.shape[0]
    f = np.empty((m, n, q))
    for j in range(m):
        for i in range(n):
            a, b, c = _wave(pose[first + j], row[i])
            for k in range(q):
                f[j, i, k] = c + a * cos[k] + b * sin[k]
    return f


@leaf
def _root(p, c, width, level, low, high):
    """Where p cos w + c sin w passes `level`, as a share of 0 <= w <= width, from its values at both ends.

    `level` carries what does not turn with w.
    """
    s = low / (low - high)
    for _ in range(3):
        w = s * width
        g = p * np.cos(w) + c * np.sin(w) - level
        slope = (c * np.cos(w) - p * np.sin(w)) * width
        if slope == 0.0:
            break
        new = s - g / slope
        if not 0.0 <= new <= 1.0:
            break
        s = new
    return s


@leaf
def _shy(s):
    return min(max(s, SHY), 1.0 - SHY)


@kernel
def advancing_mesh(pose, row, resting, group, between, cos, sin, tol, first, last, whole):
    """Closed mesh of the volume that the advancing part of the surface sweeps between two instants.

    At its start it is closed by the cone from a point of the axis over the grazing curve, or with `whole` by
    the rest of the body, where it does not advance. Returns (points, triangles, area of the envelope, area of those of its
    facets that face the wrong way: there the envelope is inside the sweep).
    """
    f = fields(pose, row, cos, sin, first, last)
    m, n, q = f.shape
    inside = f > tol
    # --- crossings -------------------------------------------------------------------------------------
    crossings = 0
    for j in range(m):
        for i in range(n):
            for k in range(q):
                here = inside[j, i, k]
                crossings += here != inside[j, i, (k + 1) % q]
                if i + 1 < n:
                    crossings += here != inside[j, i + 1, k]
                if j + 1 < m:
                    crossings += here != inside[j + 1, i, k]
    rings = group[n - 1] + 1
    points = np.empty((crossings + 2 * rings * q + 1, 3))
    apex = 0  # inside the body at the first instant
    _place(points, apex, pose, first, 0.5 * (row[0, 0] + row[n - 1, 0]), 0.0, 1.0, 0.0)
    edge = np.full((3, m, n, q), -1, np.int32)
    ring = np.full((m, rings, q), -1, np.int32)
    rest = np.full((2, rings, q), -1, np.int32)
    corner = np.empty(8, np.bool_)
    onward = np.empty((8, 8), np.int64)
    for x in range(8):
        for y in range(8):
            onward[x, y] = _edge_number(x, y)
    count = 0 if whole else 1
    body = Body(pose, row, resting, group, cos, sin, first, bool((resting == row[:, :2]).all()))
    grid = Grid(edge, ring, rest, corner, onward)
    for j in range(m):
        p = pose[first + j]
        for i in range(n):
            a, b, c = _wave(p, row[i])
            tip = row[i, 1] == 0.0
            for k in range(q):
                here, then = f[j, i, k] - tol, (k + 1) % q
                kk = 0 if tip else k
                if inside[j, i, k] != inside[j, i, then]:
                    if tip:
                        count = _ring(points, count, grid, body, j, i, 0)
                        edge[0, j, i, k] = ring[j, group[i], 0]
                    else:
                        width = 2.0 * np.pi / q
                        s = _root(
                            a * cos[k] + b * sin[k], b * cos[k] - a * sin[k], width, tol - c, here,
                            f[j, i, then] - tol,
                        )  # fmt: skip
                        w = _shy(s) * width
                        cw, sw = np.cos(w), np.sin(w)
                        _place(
                            points, count, pose, first + j, row[i, 0], row[i, 1],
                            cos[k] * cw - sin[k] * sw, sin[k] * cw + cos[k] * sw,
                        )  # fmt: skip
                        edge[0, j, i, k] = count
                        count += 1
                if i + 1 < n and inside[j, i, k] != inside[j, i + 1, k]:
                    if group[i] == group[i + 1]:
                        count = _ring(points, count, grid, body, j, i, kk)
                        edge[1, j, i, k] = ring[j, group[i], kk]
                    else:
                        ahead = f[j, i + 1, k] - tol
                        if between[i, 0] == 1.0:
                            md = p[15] * cos[k] + p[16] * sin[k]
                            mv = p[12] * cos[k] + p[13] * sin[k]
                            u, v = mv + between[i, 2] * md, p[14] - between[i, 1] * md
                            c0, s0 = np.cos(between[i, 4]), np.sin(between[i, 4])
                            wide = between[i, 5] - between[i, 4]
                            s = _root(u * c0 + v * s0, v * c0 - u * s0, wide, tol, here, ahead)
                            beta = between[i, 4] + _shy(s) * wide
                            h = between[i, 2] + between[i, 3] * np.sin(beta)
                            r = between[i, 1] + between[i, 3] * np.cos(beta)
                        else:
                            s = _shy(here / (here - ahead))
                            h = row[i, 0] + s * (row[i + 1, 0] - row[i, 0])
                            r = row[i, 1] + s * (row[i + 1, 1] - row[i, 1])
                        _place(points, count, pose, first + j, h, r, cos[k], sin[k])
                        edge[1, j, i, k] = count
                        count += 1
                if j + 1 < m and inside[j, i, k] != inside[j + 1, i, k]:
                    ahead = f[j + 1, i, k] - tol
                    s = _shy(here / (here - ahead))
                    if tip and row[i, 2] != 0.0:  # a cone's tip: no surface, any point of its path will do
                        near = j if s < 0.5 else j + 1
                        count = _ring(points, count, grid, body, near, i, 0)
                        edge[2, j, i, k] = ring[near, group[i], 0]
                    elif tip and k > 0 and edge[2, j, i, 0] >= 0:
                        edge[2, j, i, k] = edge[2, j, i, 0]
                    else:
                        _place(points, count, pose, first + j, row[i, 0], row[i, 1], cos[k], sin[k])
                        x, y, z = points[count]
                        _place(points, count, pose, first + j + 1, row[i, 0], row[i, 1], cos[k], sin[k])
                        points[count, 0] = x + s * (points[count, 0] - x)
                        points[count, 1] = y + s * (points[count, 1] - y)
                        points[count, 2] = z + s * (points[count, 2] - z)
                        edge[2, j, i, k] = count
                        count += 1
    # --- facets ----------------------------------------------------------------------------------------
    triangles = np.empty((4 * crossings + 8 * n * q, 3), np.int64)
    total = 0
    after = np.empty(12, np.int64)
    loop = np.empty(24, np.int64)
    area, wrong = 0.0, 0.0
    for j in range(m - 1):
        for i in range(n - 1):
            for k in range(q):
                then = (k + 1) % q
                corner[0], corner[1] = inside[j, i, k], inside[j, i, then]
                corner[2], corner[3] = inside[j, i + 1, k], inside[j, i + 1, then]
                corner[4], corner[5] = inside[j + 1, i, k], inside[j + 1, i, then]
                corner[6], corner[7] = inside[j + 1, i + 1, k], inside[j + 1, i + 1, then]
                some, every = False, True
                for x in range(8):
                    some = some or corner[x]
                    every = every and corner[x]
                if some and not every:
                    after[:] = -1
                    for s in range(6):
                        _runs(FACES[s], corner, onward, after)
                    begin = total
                    for e in range(12):
                        if after[e] < 0:
                            continue
                        size, at = 0, e
                        while after[at] >= 0:
                            loop[size] = _crossing(edge, at, j, i, k, then)
                            size += 1
                            ahead_of = after[at]
                            after[at] = -1
                            at = ahead_of
                        total = _fan(triangles, total, loop, size)
                    if group[i] != group[i + 1]:
                        good, bad = _facing(
                            triangles, begin, total, points, pose, row, cos, sin, first + j, i, k
                        )
                        area += good + bad
                        wrong += bad
                if j == 0 and whole:
                    count, total = _cap(
                        points, triangles, count, total, FACES[0], grid, body, 0, 0, i, k, True
                    )
                elif j == 0 and some and not every:
                    total = _cone(triangles, total, FACES[0], corner, onward, edge, i, k, then, apex)
                if j == m - 2:
                    count, total = _cap(
                        points, triangles, count, total, FACES[1], grid, body, j, m - 1, i, k, False
                    )
    return points[:count].copy(), triangles[:total].copy(), area, wrong


@leaf
def _ring(points, count, grid, body, j, i, k):
    """Makes sure that the point of the body at rest in row i, column k has a number."""
    ring = body.group[i]
    if grid.ring[j, ring, k] < 0:
        h, r = body.row[i, 0], body.row[i, 1]
        _place(points, count, body.pose, body.first + j, h, r, body.cos[k], body.sin[k])
        grid.ring[j, ring, k] = count
        count += 1
    return count


@leaf
def _edge_number(x, y):
    """0-3 along u, 4-7 along x, 8-11 along t; -1 if the corners are no neighbours."""
    low, bit = min(x, y), x ^ y
    if bit == 1:
        return low >> 1
    if bit == 2:
        return 4 + (low & 1) + 2 * (low >> 2)
    if bit == 4:
        return 8 + low
    return -1


@leaf
def _crossing(edge, number, j, i, k, then):
    """Vertex on an edge of the cell."""
    along, w = number // 4, number % 4
    if along == 0:
        return edge[0, j + w // 2, i + w % 2, k]
    column = then if w % 2 else k
    if along == 1:
        return edge[1, j + w // 2, i, column]
    return edge[2, j, i + w // 2, column]


@leaf
def _runs(face, corner, onward, after):
    """Every run of corners that are in: from the edge where it starts to the edge where it ends."""
    for s in range(4):
        a, b = face[s], face[(s + 1) % 4]
        if corner[a] or not corner[b]:
            continue
        t = s + 1
        while corner[face[(t + 1) % 4]]:
            t += 1
        after[onward[a, b]] = onward[face[t % 4], face[(t + 1) % 4]]


@leaf
def _fan(triangles, total, loop, size):
    """Triangles of a polygon, without those that have lost a side."""
    for s in range(1, size - 1):
        a, b, c = loop[0], loop[s], loop[s + 1]
        if a != b and b != c and c != a:
            triangles[total, 0], triangles[total, 1], triangles[total, 2] = a, b, c
            total += 1
    return total


@kernel
def _facing(triangles, begin, end, points, pose, row, cos, sin, j, i, k):
    """Area of facets that face along the outward normal of the body, and against it."""
    good, bad = 0.0, 0.0
    n_r, n_z = row[i, 2] + row[i + 1, 2], row[i, 3] + row[i + 1, 3]
    normal = np.empty(3)
    for c in range(3):
        normal[c] = n_z * pose[j, 9 + c] + n_r * (cos[k] * pose[j, 3 + c] + sin[k] * pose[j, 6 + c])
    size = np.sqrt(n_r * n_r + n_z * n_z)
    for t in range(begin, end):
        p, u, v = points[triangles[t, 0]], points[triangles[t, 1]], points[triangles[t, 2]]
        x1, y1, z1 = u[0] - p[0], u[1] - p[1], u[2] - p[2]
        x2, y2, z2 = v[0] - p[0], v[1] - p[1], v[2] - p[2]
        a = (
            (y1 * z2 - z1 * y2) * normal[0]
            + (z1 * x2 - x1 * z2) * normal[1]
            + (x1 * y2 - y1 * x2) * normal[2]
        )
        if a >= 0.0:
            good += 0.5 * a / size
        else:
            bad -= 0.5 * a / size
    return good, bad


@kernel
def _cap(points, triangles, count, total, face, grid, body, cell, level, i, k, outside):
    """Part of one cell's face at the first or the last instant: where it is in, or `outside`, where it is not.

    The rest of the body faces outward there, against the sense of the face at the first instant.
    """
    then = (k + 1) % body.cos.shape[0]
    edge, corner, onward = grid.edge, grid.corner, grid.onward
    loop = np.empty(12, np.int64)
    size = 0
    if outside:  # what is out is in one piece: corners that are out, and all crossings
        for s in range(4):
            a, b = face[s], face[(s + 1) % 4]
            if not corner[a]:
                count, loop[size] = _rest(points, count, grid, body, level, i, k, then, a)
                size += 1
            if corner[a] != corner[b]:
                loop[size] = _crossing(edge, onward[a, b], cell, i, k, then)
                size += 1
        for s in range(size // 2):
            loop[s], loop[size - 1 - s] = loop[size - 1 - s], loop[s]
        return count, _fan(triangles, total, loop, size)
    every = corner[face[0]] and corner[face[1]] and corner[face[2]] and corner[face[3]]
    for s in range(4):
        a, b = face[s], face[(s + 1) % 4]
        if (corner[a] or not corner[b]) and not (every and s == 0):
            continue
        size, t = 0, s + 1
        if not every:
            loop[0], size = _crossing(edge, onward[a, b], cell, i, k, then), 1
        while corner[face[t % 4]] and t <= s + 4:
            count, loop[size] = _rest(points, count, grid, body, level, i, k, then, face[t % 4])
            size += 1
            t += 1
        if not every:
            loop[size] = _crossing(edge, onward[face[(t - 1) % 4], face[t % 4]], cell, i, k, then)
            size += 1
        total = _fan(triangles, total, loop, size)
    return count, total


@leaf
def _cone(triangles, total, face, corner, onward, edge, i, k, then, apex):
    """Triangles from the apex to the grazing curve in one cell's face at the first instant."""
    for s in range(4):
        a, b = face[s], face[(s + 1) % 4]
        if corner[a] or not corner[b]:
            continue
        t = s + 1
        while corner[face[(t + 1) % 4]]:
            t += 1
        start = _crossing(edge, onward[a, b], 0, i, k, then)
        stop = _crossing(edge, onward[face[t % 4], face[(t + 1) % 4]], 0, i, k, then)
        if start != stop:
            triangles[total, 0], triangles[total, 1], triangles[total, 2] = stop, start, apex
            total += 1
    return total


@leaf
def _rest(points, count, grid, body, level, i, k, then, corner):
    """Number of the facet corner of the body at rest, made if it has none."""
    r, c = i + ((corner >> 1) & 1), then if corner & 1 else k
    ring = body.group[r]
    if body.row[r, 1] == 0.0:
        c = 0
    if body.same:
        count = _ring(points, count, grid, body, level, r, c)
        return count, grid.ring[level, ring, c]
    end = 1 if level > 0 else 0
    if grid.rest[end, ring, c] < 0:
        h, radius = body.resting[r, 0], body.resting[r, 1]
        _place(points, count, body.pose, body.first + level, h, radius, body.cos[c], body.sin[c])
        grid.rest[end, ring, c] = count
        count += 1
    return count, grid.rest[end, ring, c]


@kernel
def at_rest(pose, j, resting, group, cos, sin):
    """Closed mesh (points, triangles) of the whole body at one instant."""
    n, q = resting.shape[0], cos.shape[0]
    rings = group[n - 1] + 1
    points = np.empty(((rings - 2) * q + 2, 3))
    for i in range(n):
        g = group[i]
        if g == 0 or g == rings - 1:
            _place(points, 0 if g == 0 else 1, pose, j, resting[i, 0], 0.0, 1.0, 0.0)
            continue
        for k in range(q):
            _place(points, 2 + (g - 1) * q + k, pose, j, resting[i, 0], resting[i, 1], cos[k], sin[k])
    triangles = np.empty((2 * q * (rings - 1), 3), np.int64)
    loop = np.empty(4, np.int64)
    total = 0
    for g in range(rings - 1):
        for k in range(q):
            then = (k + 1) % q
            loop[0], loop[1] = 2 + (g - 1) * q + k, 2 + (g - 1) * q + then
            loop[2], loop[3] = 2 + g * q + then, 2 + g * q + k
            if g == 0:
                loop[:2] = 0
            if g == rings - 2:
                loop[2:] = 1
            total = _fan(triangles, total, loop, 4)
    return points, triangles[:total].copy()
