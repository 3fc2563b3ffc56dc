"""Facets of a convex cutter moved along a straight line, as many as one tile can see.

A facet faces forward if its normal . d > 0 (`ALONG`): it goes with the end copy (vertex v + n), else it stays (v)
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.jit import kernel, leaf

ALONG = 1e-12
"""A facet whose normal is that square to the motion lies along it: it stays, with all others in its plane. Did rounding
decide, neighbours would part, and the mesh would fold over itself."""


class Cutter(NamedTuple):
    """points (n, 3), triangles (m, 3), normals (m, 3), edges (k, 4): see `facets.Polyhedron`."""

    points: NDArray[np.float64]
    triangles: NDArray[np.int64]
    normals: NDArray[np.float64]
    edges: NDArray[np.int64]


class Way(NamedTuple):
    """cos, sin : turn of the cutter about its axis, to the heading. p, d (3,) : start of the tip, and displacement, zero for
    a cutter at rest."""

    cos: float
    sin: float
    p: NDArray[np.float64]
    d: NDArray[np.float64]


class View(NamedTuple):
    """What a tile sees.

    lo, hi (3,) : box of the material. apex (3,) : a point inside the swept solid, above the box. heights : of the material over
    cells of a grid, with its corner (3,) and cell, see `roof`.
    """

    lo: NDArray[np.float64]
    hi: NDArray[np.float64]
    apex: NDArray[np.float64]
    corner: NDArray[np.float64]
    heights: NDArray[np.float64]
    cell: float


@leaf
def _beside(q, view):
    """Sides of the box that a point is beyond, as bits, with all of the way from there to the apex below its top."""
    lo, hi, apex = view.lo, view.hi, view.apex
    if q[2] > hi[2]:
        return 16
    t = (hi[2] - q[2]) / (apex[2] - q[2])
    x, y = q[0] + t * (apex[0] - q[0]), q[1] + t * (apex[1] - q[1])
    out = 0
    if q[0] < lo[0] and x < lo[0]:
        out += 1
    if q[0] > hi[0] and x > hi[0]:
        out += 2
    if q[1] < lo[1] and y < lo[1]:
        out += 4
    if q[1] > hi[1] and y > hi[1]:
        out += 8
    return out


@leaf
def _seen(quad, points, view):
    """Whether the cone from the apex over the facet can meet the solid below the grid of heights."""
    lo, hi, apex, corner, heights, cell = view.lo, view.hi, view.apex, view.corner, view.heights, view.cell
    z_min = np.inf
    x0, x1, y0, y1 = np.inf, -np.inf, np.inf, -np.inf
    for k in range(4):
        z_min = min(z_min, points[quad[k], 2])
    if z_min > hi[2]:
        return False
    for k in range(4):
        q = points[quad[k]]
        t = 0.0
        if q[2] < hi[2]:
            t = (hi[2] - q[2]) / (apex[2] - q[2])
        for s in (0.0, t):
            x = q[0] + s * (apex[0] - q[0])
            y = q[1] + s * (apex[1] - q[1])
            x0, x1 = min(x0, x), max(x1, x)
            y0, y1 = min(y0, y), max(y1, y)
    if not (x0 <= hi[0] and x1 >= lo[0] and y0 <= hi[1] and y1 >= lo[1]):
        return False
    # the cone is above the plane of a facet that faces down
    a, b, c = points[quad[0]], points[quad[1]], points[quad[2]]
    nx = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
    ny = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])
    nz = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    sx, sy, z_a = 0.0, 0.0, z_min
    if -nz > 0.01 * (abs(nx) + abs(ny)):
        sx, sy = -nx / nz, -ny / nz
        z_a = (
            a[2] - sx * a[0] - sy * a[1] - 0.5 * cell * (abs(sx) + abs(sy)) - 1e-9 * (1.0 + abs(sx) + abs(sy))
        )
    i0, i1 = max(int((x0 - corner[0]) / cell), 0), min(int((x1 - corner[0]) / cell), heights.shape[0] - 1)
    j0, j1 = max(int((y0 - corner[1]) / cell), 0), min(int((y1 - corner[1]) / cell), heights.shape[1] - 1)
    for i in range(i0, i1 + 1):
        x = corner[0] + (i + 0.5) * cell
        for j in range(j0, j1 + 1):
            if heights[i, j] >= max(z_min, z_a + sx * x + sy * (corner[1] + (j + 0.5) * cell)):
                return True
    return False


@leaf
def _placed(cutter, way, view, cull, at, beside):
    """Corners of the cutter at its start, and n further on at its end, into `at` (2 n + 1, 3); with `cull`, `_beside` of each."""
    points, cos, sin, p, d = cutter.points, way.cos, way.sin, way.p, way.d
    n = points.shape[0]
    for v in range(n):
        at[v, 0] = p[0] + cos * points[v, 0] - sin * points[v, 1]
        at[v, 1] = p[1] + sin * points[v, 0] + cos * points[v, 1]
        at[v, 2] = p[2] + points[v, 2]
        for i in range(3):
            at[n + v, i] = at[v, i] + d[i]
        if cull:
            beside[v] = _beside(at[v], view)
            beside[n + v] = _beside(at[n + v], view)


@leaf
def _gathered(cutter, way, view, cull, rear, at, beside, ahead, out, quad):
    """How many triangles of `swept_facets` are seen; they are in `out`. `ahead` (m,): whether a facet goes with the end copy.

    0 if the plane of a facet that is seen separates the box from the solid.
    """
    triangles, normals, edges = cutter.triangles, cutter.normals, cutter.edges
    cos, sin, p, d, lo, hi = way.cos, way.sin, way.p, way.d, view.lo, view.hi
    n = cutter.points.shape[0]
    along = ALONG * np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    count = 0
    for t in range(triangles.shape[0]):
        nx = cos * normals[t, 0] - sin * normals[t, 1]
        ny = sin * normals[t, 0] + cos * normals[t, 1]
        nz = normals[t, 2]
        speed = nx * d[0] + ny * d[1] + nz * d[2]
        ahead[t] = speed > along
        if speed < -rear:
            behind = True
            for k in range(3):
                q = at[triangles[t, k]]
                behind = behind and (q[0] - p[0]) * d[0] + (q[1] - p[1]) * d[1] < 0.0
            if behind:
                continue
        shift = n if ahead[t] else 0
        for k in range(3):
            quad[k] = triangles[t, k] + shift
        quad[3] = quad[2]
        q = at[quad[0]]
        near = nx * (lo[0] if nx > 0 else hi[0]) + ny * (lo[1] if ny > 0 else hi[1])
        near += nz * (lo[2] if nz > 0 else hi[2])
        if near >= nx * q[0] + ny * q[1] + nz * q[2]:
            return 0
        if cull and (beside[quad[0]] & beside[quad[1]] & beside[quad[2]] or not _seen(quad, at, view)):
            continue
        out[count, 0], out[count, 1], out[count, 2] = quad[0], quad[1], quad[2]
        count += 1
    for e in range(edges.shape[0]):
        right = ahead[edges[e, 3]]
        if ahead[edges[e, 2]] == right:
            continue
        # the facet that stays behind runs u -> v along this edge; the silhouette runs v, u, u + d, v + d
        u, v = (edges[e, 0], edges[e, 1]) if right else (edges[e, 1], edges[e, 0])
        quad[0], quad[1], quad[2], quad[3] = v, u, u + n, v + n
        if cull and (beside[v] & beside[u] & beside[u + n] & beside[v + n] or not _seen(quad, at, view)):
            continue
        out[count, 0], out[count, 1], out[count, 2] = v, u, u + n
        out[count + 1, 0], out[count + 1, 1], out[count + 1, 2] = v, u + n, v + n
        count += 2
    return count


@kernel
def swept_facets(cutter, way, view, cull, rear):
    """Triangles of conv(K + p, K + p + d), K the cutter.

    Left out are, with `cull`, facets whose cone from `apex` passes above everything that the box and the grid of
    heights hold, and facets of the start copy with
    normal . d < -rear (rear = inf: none) that lie wholly behind the tool axis. Holes are closed by the cone from
    the apex over their rim. The solid is star-shaped about the apex, so what is lost are the cones over the
    facets left out.

    Returns (points, triangles, sound); empty if the plane of a facet that is seen separates the box from the solid.
    `sound` is False where an edge does not have two triangles, one each way: then the whole solid has to be taken.
    """
    n, m = cutter.points.shape[0], cutter.triangles.shape[0]
    at = np.empty((2 * n + 1, 3))
    for i in range(3):
        at[2 * n, i] = view.apex[i]
    out = np.empty((m + 2 * cutter.edges.shape[0], 3), np.int64)
    beside, ahead = np.zeros(2 * n, np.uint8), np.empty(m, np.bool_)
    _placed(cutter, way, view, cull, at, beside)
    count = _gathered(cutter, way, view, cull, rear, at, beside, ahead, out, np.empty(4, np.int64))
    if count == 0:
        return np.empty((0, 3)), out[:0], True
    kept = out[:count].copy()
    sound = True
    if cull or rear < np.inf:
        at, kept, sound = _closed(kept, at)
    at, kept = _compact(at, kept)
    return at, kept, sound


@kernel
def _rim(triangles, points):
    """Edges (k, 2) that one triangle has and no other runs back along; and whether no edge is run along twice one way.

    Edges are found among those of their first point, which are few.
    """
    size = 3 * triangles.shape[0]
    latest = np.full(points, -1, np.int64)
    before, low, high = np.empty(size, np.int64), np.empty(size, np.int64), np.empty(size, np.int64)
    ways = np.zeros(size, np.uint8)  # 1 from low to high, 2 back
    count, sound = 0, True
    for t in range(triangles.shape[0]):
        for k in range(3):
            u, v = triangles[t, k], triangles[t, (k + 1) % 3]
            a, b = min(u, v), max(u, v)
            e = latest[a]
            while e >= 0 and high[e] != b:
                e = before[e]
            if e < 0:
                e = count
                low[e], high[e], before[e], latest[a] = a, b, latest[a], e
                count += 1
            way = np.uint8(1 if u < v else 2)
            sound = sound and not ways[e] & way
            ways[e] |= way
    out = np.empty((count, 2), np.int64)
    found = 0
    for e in range(count):
        if ways[e] != 3:
            out[found, 0], out[found, 1] = (low[e], high[e]) if ways[e] == 1 else (high[e], low[e])
            found += 1
    return out[:found], sound


@leaf
def _runs(triangles, u, v):
    """Whether a triangle runs along an edge from u to v."""
    for t in range(triangles.shape[0]):
        for k in range(3):
            if triangles[t, k] == u and triangles[t, (k + 1) % 3] == v:
                return True
    return False


@leaf
def _copy(rows, out):
    """Rows (n, 3) into the first ones of `out`; slices would compile texts of errors, three seconds of them."""
    for t in range(rows.shape[0]):
        for k in range(3):
            out[t, k] = rows[t, k]


@kernel
def _unpinched(triangles, points, rim):
    """Points and triangles in which no vertex is the corner of two separate groups of triangles.

    The cone over the rim would have an edge with four triangles there, which no solid can have.
    """
    leaving = np.zeros(points.shape[0], np.int64)
    for e in range(rim.shape[0]):
        leaving[rim[e, 0]] += 1
    extra = 0
    for v in range(points.shape[0]):
        if leaving[v] > 1:
            extra += leaving[v] - 1
    if extra == 0:
        return points, False
    grown = np.empty((points.shape[0] + extra, 3))
    _copy(points, grown)
    new = points.shape[0]
    for v in range(points.shape[0]):
        for _ in range(leaving[v] - 1):
            # one group around v: start at a triangle with nothing behind its edge from v, and turn
            t, last = -1, -1
            for s in range(triangles.shape[0]):
                for k in range(3):
                    if triangles[s, k] == v and not _runs(triangles, triangles[s, (k + 1) % 3], v):
                        t, last = s, triangles[s, (k + 1) % 3]
            if t < 0:
                break
            while t >= 0:
                for k in range(3):
                    if triangles[t, k] == v:
                        triangles[t, k] = new
                        last = triangles[t, (k + 2) % 3]
                t = -1
                for s in range(triangles.shape[0]):
                    for k in range(3):
                        if triangles[s, k] == v and triangles[s, (k + 1) % 3] == last:
                            t = s
            for i in range(3):
                grown[new, i] = points[v, i]
            new += 1
    return grown[:new].copy(), True


@kernel
def _closed(triangles, points):
    """Points and triangles with the cone from the last point over the open edges, and whether every edge has two of them.

    It has if none is run along twice one way and no two open edges leave one point: as many come to a point as leave it.
    """
    rim, sound = _rim(triangles, points.shape[0])
    if not sound:
        return points, triangles, False
    apex = points.shape[0] - 1
    points, changed = _unpinched(triangles, points, rim)
    if changed:
        rim, sound = _rim(triangles, points.shape[0])
    left = np.zeros(points.shape[0], np.bool_)
    out = np.empty((triangles.shape[0] + rim.shape[0], 3), np.int64)
    _copy(triangles, out)
    for e in range(rim.shape[0]):
        row = triangles.shape[0] + e
        out[row, 0], out[row, 1], out[row, 2] = rim[e, 1], rim[e, 0], apex
        sound = sound and not left[rim[e, 0]]
        left[rim[e, 0]] = True
    return points, out, sound


@kernel
def _compact(points, triangles):
    """Without vertices that no triangle uses."""
    index = np.full(points.shape[0], -1, np.int64)
    out = np.empty_like(points)
    count = 0
    for t in range(triangles.shape[0]):
        for k in range(3):
            v = triangles[t, k]
            if index[v] < 0:
                index[v] = count
                for i in range(3):
                    out[count, i] = points[v, i]
                count += 1
            triangles[t, k] = index[v]
    return out[:count].copy(), triangles
