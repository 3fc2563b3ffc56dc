# Signed distance of points to a closed triangle mesh, and where upright lines cross it.
#
# Legend: a, b, c (m, 3) corners of triangles, outward. normals (m, 7, 3): pseudonormals of the face, the edges
#   ab, bc, ca and the corners a, b, c; the sign of (point - nearest) . pseudonormal of the feature that holds
#   the nearest point tells inside from outside (Baerentzen and Aanaes, IEEE TVCG 11 (2005) 243-253).
# boxes (2 P - 1, 6): lowest and highest corner of the boxes of a binary tree, node k over 2 k + 1 and 2 k + 2; the last P
#   are leaves, each of LEAF triangles in order.

import numpy as np

from vmachining.jit import kernel, leaf


@leaf
def nearest_on(p, a, b, c):
    """Nearest point x, y, z of a triangle, and its feature: 0 face, 1 ab, 2 bc, 3 ca, 4 a, 5 b, 6 c."""
    abx, aby, abz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    acx, acy, acz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    x, y, z = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    d1, d2 = abx * x + aby * y + abz * z, acx * x + acy * y + acz * z
    if d1 <= 0.0 and d2 <= 0.0:
        return a[0], a[1], a[2], 4
    x, y, z = p[0] - b[0], p[1] - b[1], p[2] - b[2]
    d3, d4 = abx * x + aby * y + abz * z, acx * x + acy * y + acz * z
    if d3 >= 0.0 and d4 <= d3:
        return b[0], b[1], b[2], 5
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        share = d1 / (d1 - d3)
        return a[0] + share * abx, a[1] + share * aby, a[2] + share * abz, 1
    x, y, z = p[0] - c[0], p[1] - c[1], p[2] - c[2]
    d5, d6 = abx * x + aby * y + abz * z, acx * x + acy * y + acz * z
    if d6 >= 0.0 and d5 <= d6:
        return c[0], c[1], c[2], 6
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        share = d2 / (d2 - d6)
        return a[0] + share * acx, a[1] + share * acy, a[2] + share * acz, 3
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        share = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return b[0] + share * (c[0] - b[0]), b[1] + share * (c[1] - b[1]), b[2] + share * (c[2] - b[2]), 2
    v, w = vb / (va + vb + vc), vc / (va + vb + vc)
    return a[0] + v * abx + w * acx, a[1] + v * aby + w * acy, a[2] + v * abz + w * acz, 0


LEAF = 8
LANES = 8  # numbers that a processor takes at once


@leaf
def box_square(p, box):
    """Square of the distance of a point to a box; inf for an empty one."""
    total = 0.0
    for k in range(3):
        away = max(box[k] - p[k], p[k] - box[3 + k], 0.0)
        total += away * away
    return total


@leaf
def distance(p, x, y, z):
    """Of a point to x, y, z."""
    return np.sqrt((p[0] - x) ** 2 + (p[1] - y) ** 2 + (p[2] - z) ** 2)


@leaf
def among(p, a, b, c, normals, place, known):
    """`known` or, where one of the triangles of leaf `place` is nearer: (distance, triangle, nearest x, y, z, feature)."""
    best, triangle, x, y, z, feature = known
    start = place * LEAF
    for j in range(start, min(start + LEAF, len(a))):
        n, q = normals[j, 0], a[j]
        if abs((p[0] - q[0]) * n[0] + (p[1] - q[1]) * n[1] + (p[2] - q[2]) * n[2]) >= best:
            continue  # its plane is no nearer
        u, v, w, what = nearest_on(p, a[j], b[j], c[j])
        d = distance(p, u, v, w)
        if d < best:
            best, triangle, feature = d, j, what
            x, y, z = u, v, w
    return best, triangle, x, y, z, feature


@leaf
def to_first(p, a, b, c, first, reach):
    """`known` of `among`, of one triangle, no farther than `reach`."""
    x, y, z, feature = nearest_on(p, a[first], b[first], c[first])
    return min(distance(p, x, y, z), reach), first, x, y, z, feature


@leaf
def signed(p, normals, known):
    """The distance that `among` found, negative inside."""
    best, triangle, x, y, z, feature = known
    n = normals[triangle, feature]
    side = (p[0] - x) * n[0] + (p[1] - y) * n[1] + (p[2] - z) * n[2]
    return best if side >= 0.0 else -best


@leaf
def mesh_distance(p, a, b, c, normals, boxes, stack, square, first, reach):
    """Signed distance of a point, negative inside, and the triangle that is nearest; `first` is looked at first.

    reach, first : where no triangle is nearer than `reach`. stack, square (128,): work space.
    """
    leaves = (len(boxes) + 1) // 2
    known = to_first(p, a, b, c, first, reach)
    stack[0], square[0] = 0, box_square(p, boxes[0])
    top = 1
    while top > 0:
        top -= 1
        node = stack[top]
        if square[top] > known[0] * known[0]:
            continue
        if node < leaves - 1:
            near, far = 2 * node + 1, 2 * node + 2
            to_near, to_far = box_square(p, boxes[near]), box_square(p, boxes[far])
            if to_far < to_near:
                near, far, to_near, to_far = far, near, to_far, to_near
            stack[top], square[top] = far, to_far
            stack[top + 1], square[top + 1] = near, to_near
            top += 2
            continue
        known = among(p, a, b, c, normals, node - leaves + 1, known)
    if known[0] >= reach:
        return reach, first
    return signed(p, normals, known), known[1]


@leaf
def leaves_near(boxes, region, reach, stack, out, place):
    """Leaves of the tree within `reach` of a box, all of `place` at most; how many, -1 if more.

    out (6, n) : their boxes, a column each, with empty ones up to a multiple of `LANES`; place (n,) : number of the leaf.
    """
    leaves, most = (len(boxes) + 1) // 2, len(place)
    stack[0], top, n = 0, 1, 0
    while top > 0:
        top -= 1
        node, meets = stack[top], True
        for k in range(3):
            meets &= boxes[node, k] <= region[3 + k] + reach and boxes[node, 3 + k] >= region[k] - reach
        if not meets:
            continue
        if node < leaves - 1:
            stack[top], stack[top + 1] = 2 * node + 1, 2 * node + 2
            top += 2
            continue
        if n == most:
            return -1
        place[n] = node - leaves + 1
        for k in range(6):
            out[k, n] = boxes[node, k]
        n += 1
    for i in range(n, min(-(-n // LANES) * LANES, most)):
        for k in range(6):
            out[k, i] = np.inf
    return n


@leaf
def listed_distance(p, a, b, c, normals, near, place, count, square, first, reach):
    """As `mesh_distance`, among the leaves that `leaves_near` found."""
    known = to_first(p, a, b, c, first, reach)
    x, y, z = p[0], p[1], p[2]
    for i in range(-(-count // LANES) * LANES):
        u = max(max(near[0, i] - x, x - near[3, i]), 0.0)
        v = max(max(near[1, i] - y, y - near[4, i]), 0.0)
        w = max(max(near[2, i] - z, z - near[5, i]), 0.0)
        square[i] = u * u + v * v + w * w
    for i in range(count):
        if square[i] <= known[0] * known[0]:
            known = among(p, a, b, c, normals, place[i], known)
    if known[0] >= reach:
        return reach, first
    return signed(p, normals, known), known[1]


@kernel
def mesh_distances(points, a, b, c, normals, boxes, out) -> None:
    """Signed distance of every point, negative inside."""
    stack, square = np.empty(128, dtype=np.int64), np.empty(128)
    triangle = 0
    for i in range(len(points)):  # the nearest triangle of the last point first
        out[i], triangle = mesh_distance(points[i], a, b, c, normals, boxes, stack, square, triangle, np.inf)


@kernel
def upright_hits(places, corners, at, height, sense, fill) -> None:
    """Triangles that upright lines meet.

    places (n, 2), rising in x. corners (m, 3, 3). at (n,): counts the hits of every line; with `fill` the place
    in `height` and `sense` (+1 where the line enters, upwards) of its next hit. A line on an edge (u = 0 below)
    belongs to the side that the direction of the edge decides, alike for both of its triangles.
    """
    edge = np.empty(3)
    for j in range(len(corners)):
        low_x, high_x = min(corners[j, :, 0]), max(corners[j, :, 0])
        low_y, high_y = min(corners[j, :, 1]), max(corners[j, :, 1])
        first = np.searchsorted(places[:, 0], low_x)
        for i in range(first, len(places)):
            x, y = places[i, 0], places[i, 1]
            if x > high_x:
                break
            if y < low_y or y > high_y:
                continue
            positive = 0
            for k in range(3):
                px, py = corners[j, k, 0], corners[j, k, 1]
                qx, qy = corners[j, (k + 1) % 3, 0], corners[j, (k + 1) % 3, 1]
                flip = px > qx or (px == qx and py > qy)
                if flip:  # both triangles of an edge compute the same number
                    px, py, qx, qy = qx, qy, px, py
                u = (px - x) * (qy - y) - (py - y) * (qx - x)
                side = u > 0.0 or (u == 0.0 and (qx > px or qy > py))
                edge[k] = -u if flip else u
                if side != flip:
                    positive += 1
            area = edge[0] + edge[1] + edge[2]
            if positive % 3 == 0 and area != 0.0:
                if fill:
                    z = edge[1] * corners[j, 0, 2] + edge[2] * corners[j, 1, 2] + edge[0] * corners[j, 2, 2]
                    height[at[i]] = z / area
                    sense[at[i]] = -1.0 if area > 0.0 else 1.0
                at[i] += 1


@kernel
def enclosed(points, triangles) -> float:
    """Volume inside closed triangles, about their middle so that far coordinates cost no digits."""
    ox = oy = oz = total = 0.0
    for x, y, z in points:
        ox, oy, oz = ox + x, oy + y, oz + z
    n = max(len(points), 1)
    ox, oy, oz = ox / n, oy / n, oz / n
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ax, ay, az = points[a, 0] - ox, points[a, 1] - oy, points[a, 2] - oz
        bx, by, bz = points[b, 0] - ox, points[b, 1] - oy, points[b, 2] - oz
        cx, cy, cz = points[c, 0] - ox, points[c, 1] - oy, points[c, 2] - oz
        total += ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    return total / 6.0


@kernel
def facets(points, triangles, out) -> None:
    """Rows of a binary STL: out (m, 12) unit normal, zero for a triangle without area, and three corners."""
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        ux, uy, uz = points[b, 0] - points[a, 0], points[b, 1] - points[a, 1], points[b, 2] - points[a, 2]
        vx, vy, vz = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1], points[c, 2] - points[a, 2]
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        size = np.sqrt(x * x + y * y + z * z)
        share = 1.0 / size if size > 0.0 else 0.0
        out[t, 0], out[t, 1], out[t, 2] = x * share, y * share, z * share
        for k in range(3):
            out[t, 3 + k], out[t, 6 + k], out[t, 9 + k] = points[a, k], points[b, k], points[c, k]


@kernel
def different(rows, which, first) -> int:
    """How many rows (n, 3) of whole numbers differ: which (n,) of them each is, first (n,) row of each, as they come.

    A table of at least twice as many places is probed in order; the product is the 64-bit one of Fibonacci hashing.
    """
    size = 1
    while size < 2 * len(rows) + 1:
        size *= 2
    place = np.full(size, -1)
    count = 0
    for i in range(len(rows)):
        key = np.uint64(0)
        for k in range(3):
            key = (key ^ np.uint64(rows[i, k])) * np.uint64(0x9E3779B97F4A7C15)
            key ^= key >> np.uint64(29)
        at = np.int64(key & np.uint64(size - 1))
        while place[at] >= 0:
            j = first[place[at]]
            if rows[j, 0] == rows[i, 0] and rows[j, 1] == rows[i, 1] and rows[j, 2] == rows[i, 2]:
                break
            at = (at + 1) & (size - 1)
        if place[at] < 0:
            place[at], first[count] = count, i
            count += 1
        which[i] = place[at]
    return count
