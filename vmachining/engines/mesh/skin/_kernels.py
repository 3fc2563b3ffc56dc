"""Bounds and means of the layer between the facets of an inner sweep and the surface it stands for.

Legend
    points (n, 3), triangles (m, 3), normals (m, 3), edges (k, 4), patches (l, 6)   the inner cutter, see
                  `facets.Polyhedron`
    first (h + 1, 3), boxes (h, 2, 3), spare (h,)   its clusters, see `clusters/` and `spare`
    most, bulk, slope, plumb   of its facets, see `vmachining.engines.mesh.gap`
    seg           meridian of the true cutter, rows (r0, z0, r1, z1, cr, cz, R, ...); R = 0 is a line
    cos, sin, p, d, lo, hi, apex, heights, corner, cell, rear   as in the kernels of straight sweeps
    slack (2,)    mm by which the true path may leave the straight one: sideways, along the tool axis
    inward (3,)   where a level arc goes on, zero elsewhere: facets wholly on that side of p lie in its ring
"""

import numpy as np

from vmachining.engines.mesh.clusters._kernels import extent, put, toward
from vmachining.engines.mesh.gap._kernels import ALONG, across, along_shadow, shadow_gap, strip
from vmachining.engines.mesh.window._kernels import under_roof
from vmachining.jit import kernel, leaf

COS_SHARP = float(np.cos(np.pi / 4))  # as in `facets.py`

ROUND = 1.1  # sum of the factors of two unit vectors less than 45 degrees apart in one between, 1 / cos(22.5 degrees)

ROWS = 512  # room for the skin of nearly every block

GROWS = 0.02  # gap in heights of the apex over a facet, of nearly all frustums; the others are looked at one by one


@leaf
def boxes_of(hulls, out):
    """Boxes (n, 2, 3) of hulls (n, m, 3)."""
    for i in range(hulls.shape[0]):
        for axis in range(3):
            a, b = hulls[i, 0, axis], hulls[i, 0, axis]
            for j in range(1, hulls.shape[1]):
                a, b = min(a, hulls[i, j, axis]), max(b, hulls[i, j, axis])
            out[i, 0, axis], out[i, 1, axis] = a, b


@kernel
def drop(corners, boxes, volume, gone):
    """Put the last rows where others, the first len(gone) of which are asked, are gone; how many are left."""
    count = len(gone)
    i = 0
    while i < count:
        if not gone[i]:
            i += 1
            continue
        count -= 1
        while count > i and gone[count]:
            count -= 1
        corners[i], boxes[i], volume[i] = corners[count], boxes[count], volume[count]
        i += 1
    return count


@leaf
def _beside(x, y, z, lo, hi, apex):
    """Sides of the box that a point is beyond, as bits, and stays when it moves away from the apex, see GROWS."""
    ends = (x, y, z), (x + GROWS * (x - apex[0]), y + GROWS * (y - apex[1]), z + GROWS * (z - apex[2]))
    out = 63
    for q in ends:
        here = 0
        for i in range(3):
            if q[i] < lo[i]:
                here |= 1 << 2 * i
            if q[i] > hi[i]:
                here |= 2 << 2 * i
        out &= here
    return out


@leaf
def _frustum(corners, gap, bulk, lean, way, high, apex, lo, hi, corner, heights, cell, out):
    """Whether the frustum over a facet (4, 3) is seen; then its eight corners and a volume are put into `out`.

    The frustum holds what the cone from the apex over the facet has between its plane and `gap` above; high:
    distance of the apex from the plane. The volume is at most that of the frustum, or of what is below the
    tangents of the bulk, see `skin`. lean (2, 3): directions times slopes. way (3,): if not zero, the bulk is
    that of all of a facet that is alike from 0 to 1 in this direction.
    """
    grow = gap / high
    x0, y0, z0, x1, y1, z1 = np.inf, np.inf, np.inf, -np.inf, -np.inf, -np.inf
    for k in range(4):
        x, y, z = corners[k, 0], corners[k, 1], corners[k, 2]
        x0, y0, z0 = min(x0, x), min(y0, y), min(z0, z)
        x1, y1, z1 = max(x1, x), max(y1, y), max(z1, z)
    # all of it moves away from the apex
    x0, x1 = min(x0, x0 + grow * (x0 - apex[0])), max(x1, x1 + grow * (x1 - apex[0]))
    y0, y1 = min(y0, y0 + grow * (y0 - apex[1])), max(y1, y1 + grow * (y1 - apex[1]))
    z0, z1 = min(z0, z0 + grow * (z0 - apex[2])), max(z1, z1 + grow * (z1 - apex[2]))
    if z1 < lo[2] or not under_roof(x0, x1, y0, y1, z0, lo, hi, corner, heights, cell):
        return False
    for k in range(4):
        for i in range(3):
            out[3 * k + i] = corners[k, i]
            out[12 + 3 * k + i] = corners[k, i] + grow * (corners[k, i] - apex[i])
    area = 0.0
    for k in range(1, 3):
        a, b, c = corners[0], corners[k], corners[k + 1]
        u_x, u_y, u_z = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        v_x, v_y, v_z = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        w_x, w_y, w_z = u_y * v_z - u_z * v_y, u_z * v_x - u_x * v_z, u_x * v_y - u_y * v_x
        area += 0.5 * np.sqrt(w_x * w_x + w_y * w_y + w_z * w_z)
    out[24] = area * gap * (1.0 + grow + grow * grow / 3.0)
    one, two, first, last = 0.0, 0.0, np.inf, -np.inf
    for k in range(4):
        x, y, z = corners[k, 0] - apex[0], corners[k, 1] - apex[1], corners[k, 2] - apex[2]
        one = max(one, abs(x * lean[0, 0] + y * lean[0, 1] + z * lean[0, 2]))
        two = max(two, abs(x * lean[1, 0] + y * lean[1, 1] + z * lean[1, 2]))
        along = x * way[0] + y * way[1] + z * way[2]
        first, last = min(first, along), max(last, along)
    lost = (one + two) / high
    if lost < 1.0:
        share = min(last - first + 1e-12, 1.0) if last > first else 1.0
        out[24] = min(out[24], bulk * share * (1.0 + grow) ** 2 / (1.0 - lost))
    return True


@leaf
def _cover(facet, gap, bulk, lean, way, high, apex, lo, hi, corner, heights, cell, size, work, rows, count):
    """Add the seen parts of a facet (4, 3) to `rows`, halved to edges of at most `size`; their new number.

    A triangle has its last corner twice; a quadrangle stays one. `len(rows)` if they do not fit.
    """
    stack, now, edge = work
    for k in range(4):
        for i in range(3):
            stack[0, k, i] = facet[k, i]
    left = 1
    while left > 0:
        left -= 1
        if count == len(rows):
            return count
        for k in range(4):
            for i in range(3):
                now[k, i] = stack[left, k, i]
        if not _frustum(now, gap, bulk, lean, way, high, apex, lo, hi, corner, heights, cell, rows[count]):
            continue
        for k in range(4):
            a, b = now[k], now[(k + 1) % 4]
            edge[k] = (b[0] - a[0]) ** 2 + (b[1] - a[1]) ** 2 + (b[2] - a[2]) ** 2
        at = 0
        for k in range(1, 4):
            if edge[k] > edge[at]:
                at = k
        if edge[at] <= size * size or left + 2 > stack.shape[0]:
            count += 1
            continue
        b, c, d = (at + 1) % 4, (at + 2) % 4, (at + 3) % 4
        if edge[2] == 0.0:  # a triangle: from the middle of the longest edge to the corner across
            c = 2 if at == 0 else (0 if at == 1 else 1)
            b = 1 if at == 0 else (2 if at == 1 else 0)
            for i in range(3):
                middle = 0.5 * (now[at, i] + now[b, i])
                stack[left, 0, i], stack[left, 1, i] = now[at, i], middle
                stack[left, 2, i], stack[left, 3, i] = now[c, i], now[c, i]
                stack[left + 1, 0, i], stack[left + 1, 1, i] = middle, now[b, i]
                stack[left + 1, 2, i], stack[left + 1, 3, i] = now[c, i], now[c, i]
        else:
            for i in range(3):
                near, far = 0.5 * (now[at, i] + now[b, i]), 0.5 * (now[c, i] + now[d, i])
                stack[left, 0, i], stack[left, 1, i] = now[at, i], near
                stack[left, 2, i], stack[left, 3, i] = far, now[d, i]
                stack[left + 1, 0, i], stack[left + 1, 1, i] = near, now[b, i]
                stack[left + 1, 2, i], stack[left + 1, 3, i] = now[c, i], far
        left += 2
    return count


@leaf
def _brink(u, v, n_x, n_y, n_z, grow, apex, out):
    """Strip (4, 3) of a facet at its sharp edge u v, as far as cones from the apex leave the body beyond the edge.

    grow: thickness of the frustum over the facet, in distances of the apex from its plane.
    """
    e_x, e_y, e_z = v[0] - u[0], v[1] - u[1], v[2] - u[2]
    length = np.sqrt(e_x * e_x + e_y * e_y + e_z * e_z)
    e_x, e_y, e_z = e_x / length, e_y / length, e_z / length
    s_x, s_y, s_z = (
        n_y * e_z - n_z * e_y,
        n_z * e_x - n_x * e_z,
        n_x * e_y - n_y * e_x,
    )  # across, in the plane
    if s_x * (apex[0] - u[0]) + s_y * (apex[1] - u[1]) + s_z * (apex[2] - u[2]) < 0.0:
        s_x, s_y, s_z = -s_x, -s_y, -s_z
    far = 0.0
    for i in range(3):
        far += max((u[i] - apex[i]) ** 2, (v[i] - apex[i]) ** 2)
    width = grow * (1.0 + grow) * np.sqrt(far)
    for i in range(3):
        e, s = (e_x, s_x) if i == 0 else ((e_y, s_y) if i == 1 else (e_z, s_z))
        out[0, i], out[1, i] = u[i] - width * e, v[i] + width * e
        out[2, i], out[3, i] = v[i] + width * (e + s), u[i] - width * (e - s)


@leaf
def _out_of_sight(box, cos, sin, p, d, lo, hi, apex):
    """Whether all that facets in a box (2, 3) of the cutter sweep is beside the box of a tile, see `_beside`."""
    for i in range(3):
        first, last = extent(box, i, cos, sin, p, d)
        if last < lo[i] and last + GROWS * (last - apex[i]) < lo[i]:
            return True
        if first > hi[i] and first + GROWS * (first - apex[i]) > hi[i]:
            return True
    return False


@kernel
def spare(points, triangles, normals, edges, first, most, apex, out):
    """How much thicker (h,) mm the layer over the facets of every cluster may be before a frustum grows by GROWS.

    The strip that an edge sweeps has a normal between those of its facets, of which it is a sum with factors that
    add up to less than ROUND, and a layer as much thicker at most; where an edge is sharp nothing is spared.
    apex: height of the apex on the axis.
    """
    room = np.empty(triangles.shape[0])
    for t in range(triangles.shape[0]):
        q = points[triangles[t, 0]]
        high = normals[t, 0] * q[0] + normals[t, 1] * q[1] + normals[t, 2] * (q[2] - apex)
        room[t] = GROWS * high / ROUND - most[t]
    for c in range(out.shape[0]):
        out[c] = np.inf
        for t in range(first[c, 0], first[c + 1, 0]):
            out[c] = min(out[c], room[t])
        for e in range(first[c, 1], first[c + 1, 1]):
            out[c] = min(out[c], room[edges[e, 2]], room[edges[e, 3]])
            one, two = normals[edges[e, 2]], normals[edges[e, 3]]
            if one[0] * two[0] + one[1] * two[1] + one[2] * two[2] < COS_SHARP:
                out[c] = -np.inf


@leaf
def _cosine(normals, t, other):
    """Of the angle between two unit normals."""
    return (
        normals[t, 0] * normals[other, 0]
        + normals[t, 1] * normals[other, 1]
        + normals[t, 2] * normals[other, 2]
    )


@leaf
def _layered(
    points, triangles, normals, edges, first, boxes, spare, patches, most, bulk, slope, plumb, seg, cos, sin, p,
    d, lo, hi, apex, corner, heights, cell, rear, slack, inward, size, at, beside, placed, work, facet, vectors, rows,
):  # fmt: skip
    """How many rows `hull_skin` has; they are put into `rows`. `len(rows)` if they do not fit.

    The rest is room to work in.
    """
    many, count = points.shape[0], 0
    sided = inward[0] != 0.0 or inward[1] != 0.0 or inward[2] != 0.0
    length = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
    along = ALONG * length
    still, up, lean, n, c, one_end, other_end, way = (
        vectors[0], vectors[1], vectors[2:4], vectors[4], vectors[5], vectors[6], vectors[7], vectors[8]
    )  # fmt: skip
    stiff = slack[0] == 0.0 and slack[1] == 0.0
    tiny = 1e-13 * (1.0 + abs(apex[0]) + abs(apex[1]) + abs(apex[2]))

    for g in range(boxes.shape[0]):
        if slack[0] + slack[1] < spare[g] and _out_of_sight(boxes[g], cos, sin, p, d, lo, hi, apex):
            continue
        for t in range(first[g, 0], first[g + 1, 0]):
            for v in triangles[t]:
                if placed[v]:
                    continue
                placed[v] = True
                put(points[v], cos, sin, p, at[v])
                beside[v] = _beside(at[v, 0], at[v, 1], at[v, 2], lo, hi, apex)
                beside[v + many] = _beside(at[v, 0] + d[0], at[v, 1] + d[1], at[v, 2] + d[2], lo, hi, apex)
        for k in range(first[g, 2], first[g + 1, 2]):
            one, two = patches[k, 0], patches[k, 1]
            ahead, second = toward(normals[one], cos, sin, d), 0.0
            whole = two < 0
            if not whole:
                second = toward(normals[two], cos, sin, d)
                whole = (ahead > along) == (second > along) and (ahead < -rear) == (second < -rear)
            for t in (one, two):
                if t == two:
                    ahead = second
                if ahead < -rear or (whole and t != one):
                    continue
                corners = patches[k, 2:] if whole else triangles[t]
                shift = many if ahead > along else 0
                common, low = 63, np.inf
                for v in corners:
                    common &= beside[v + shift]
                    low = min(low, at[v, 2])
                if shift > 0:
                    low += d[2]
                n_x = cos * normals[t, 0] - sin * normals[t, 1]
                n_y = sin * normals[t, 0] + cos * normals[t, 1]
                n_z = normals[t, 2]
                gap = max(most[t], most[two]) if whole and two >= 0 else most[t]
                gap += slack[0] * np.sqrt(n_x * n_x + n_y * n_y) + slack[1] * abs(n_z)
                if gap <= tiny or (low > hi[2] and low > apex[2]):
                    continue
                q = at[corners[0]]
                high = n_x * (q[0] - apex[0]) + n_y * (q[1] - apex[1]) + n_z * (q[2] - apex[2])
                if shift > 0:
                    high += ahead
                if high > tiny:
                    if common != 0 and gap <= GROWS * high:
                        continue
                    if low - gap / high * max(apex[2] - low, 0.0) > hi[2]:
                        continue  # above the box, however far the frustum reaches down
                # tangents of the cutter bound the sweep if they face the same way as the facet
                level, steep = slope[t, 0], slope[t, 1]
                if whole and two >= 0:
                    level, steep = max(level, slope[two, 0]), max(steep, slope[two, 1])
                lean[0, 0], lean[0, 1], lean[0, 2], lean[1, 0], lean[1, 1], lean[1, 2] = across(n_x, n_y, n_z)
                aside = 0.0
                for i in range(3):
                    lean[0, i], lean[1, i] = lean[0, i] * level, lean[1, i] * steep
                for i in range(2):
                    aside += abs(lean[i, 0] * d[0] + lean[i, 1] * d[1] + lean[i, 2] * d[2])
                volume = np.inf
                if stiff and abs(ahead) >= aside:
                    volume = bulk[t] + bulk[two] if whole and two >= 0 else bulk[t]
                up[2] = 1.0 / plumb[t] if whole and two >= 0 and plumb[t] > 0.0 else 0.0
                outside = not sided
                for i in range(4):
                    q = at[corners[min(i, len(corners) - 1)]]
                    for j in range(3):
                        facet[i, j] = q[j] + (d[j] if shift > 0 else 0.0)
                    if sided:
                        side = inward[0] * (q[0] - p[0]) + inward[1] * (q[1] - p[1])
                        outside = outside or side < 2.0 * gap
                if not outside:
                    continue
                count = _cover(
                    facet, gap, volume, lean, up, max(high, tiny), apex, lo, hi, corner, heights, cell, size,
                    work, rows, count,
                )  # fmt: skip
        if length == 0.0:
            continue
        for e in range(first[g, 1], first[g + 1, 1]):
            t, other = edges[e, 2], edges[e, 3]
            left, right = toward(normals[t], cos, sin, d), toward(normals[other], cos, sin, d)
            if min(left, right) < -rear <= max(left, right) and _cosine(normals, t, other) < COS_SHARP:
                if right < -rear:
                    t, other = other, t
                # beyond a disc that moves in its plane nothing is
                gap = (
                    most[t]
                    + slack[0] * np.hypot(normals[t, 0], normals[t, 1])
                    + slack[1] * abs(normals[t, 2])
                )
                if gap > tiny and (max(left, right) > along or most[other] + slack[1] > tiny):
                    n_x, n_y = (
                        cos * normals[t, 0] - sin * normals[t, 1],
                        sin * normals[t, 0] + cos * normals[t, 1],
                    )
                    q = at[edges[e, 0]]
                    high = n_x * (q[0] - apex[0]) + n_y * (q[1] - apex[1]) + normals[t, 2] * (q[2] - apex[2])
                    high = max(high, tiny)
                    _brink(q, at[edges[e, 1]], n_x, n_y, normals[t, 2], gap / high, apex, facet)
                    count = _cover(
                        facet, gap, np.inf, lean, still, high, apex, lo, hi, corner, heights, cell, size,
                        work, rows, count,
                    )  # fmt: skip
            if (left > along) == (right > along):
                continue
            u, v = (edges[e, 0], edges[e, 1]) if right > along else (edges[e, 1], edges[e, 0])
            for i in range(3):
                one_end[i], other_end[i] = at[u, i] - p[i], at[v, i] - p[i]
            area, reach, gap = strip(seg, one_end, other_end, d, n)
            gap = gap + slack[0] * np.sqrt(n[0] * n[0] + n[1] * n[1]) + slack[1] * abs(n[2])
            if gap <= tiny:
                continue
            high = n[0] * (at[u, 0] - apex[0]) + n[1] * (at[u, 1] - apex[1]) + n[2] * (at[u, 2] - apex[2])
            low = min(at[u, 2], at[v, 2]) + min(d[2], 0.0)
            if high > tiny:
                i, j = u + many, v + many
                if gap <= GROWS * high and beside[u] & beside[v] & beside[i] & beside[j]:
                    continue
                if low - gap / high * max(apex[2] - low, 0.0) > hi[2]:
                    continue
            along_shadow(n, d, length, c)
            _, bound, steep = shadow_gap(seg, reach, other_end, one_end, n, c)
            for i in range(3):
                lean[0, i], lean[1, i], way[i] = steep * c[i], 0.0, d[i] / (length * length)
                facet[0, i], facet[1, i] = at[v, i], at[u, i]
                facet[2, i], facet[3, i] = at[u, i] + d[i], at[v, i] + d[i]
            count = _cover(
                facet, gap, bound * area if stiff else np.inf, lean, way, max(high, tiny), apex,
                lo, hi, corner, heights, cell, size, work, rows, count,
            )  # fmt: skip
    return count


@kernel
def hull_skin(
    points, triangles, normals, edges, first, boxes, spare, patches, most, bulk, slope, plumb, seg, cos, sin, p, d,
    lo, hi, apex, corner, heights, cell, rear, slack, inward, size,
):  # fmt: skip
    """Skin of conv(K + p, K + p + d), K the inner cutter, as far as a tile can see it.

    Returns rows (k, 25): eight corners and the volume of the frustums.
    """
    many, size_of = points.shape[0], ROWS
    marks = np.empty(2 * many, np.uint8), np.zeros(many, np.bool_)
    work, corners = (np.empty((64, 4, 3)), np.empty((4, 3)), np.empty(4)), np.empty((4, 3))
    at, vectors = np.empty(points.shape), np.zeros((9, 3))
    while True:
        rows = np.empty((size_of, 25))
        count = _layered(
            points, triangles, normals, edges, first, boxes, spare, patches, most, bulk, slope, plumb, seg, cos, sin, p,
            d, lo, hi, apex, corner, heights, cell, rear, slack, inward, size, at, *marks, work, corners, vectors, rows,
        )  # fmt: skip
        if count < size_of:
            return rows[:count]
        size_of *= 2
        marks[1][:] = False


@leaf
def tagged(mean, kin, steps, most, tags, ours, out):
    """Face ids (m,) of thickness and number, see `layer.thick`; False if there are more numbers than tags."""
    low, high = 0, 0
    for t in range(kin.shape[0]):
        low, high = min(low, kin[t]), max(high, kin[t])
    if high - low >= tags:
        return False
    for t in range(kin.shape[0]):
        level = min(max(int(np.rint(mean[t] * steps)), 0), most)
        out[t] = ours + level * tags + kin[t] - low
    return True


@leaf
def untag(face_id, ours, tags, step, out):
    """Thickness (m,) from face ids, see `layer.thick`; those below `ours` carry none."""
    for t in range(face_id.shape[0]):
        out[t] = (face_id[t] - ours) // tags * step if face_id[t] >= ours else 0.0


@leaf
def area_sums(points, triangles, weight):
    """Sum of area times weight (m,) over triangles."""
    total = 0.0
    for t in range(triangles.shape[0]):
        if weight[t] == 0.0:
            continue
        a, b, c = points[triangles[t, 0]], points[triangles[t, 1]], points[triangles[t, 2]]
        x = (b[1] - a[1]) * (c[2] - a[2]) - (b[2] - a[2]) * (c[1] - a[1])
        y = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2])
        z = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        total += 0.5 * np.sqrt(x * x + y * y + z * z) * weight[t]
    return total
