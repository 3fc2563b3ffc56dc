# Drop cutter: the highest position of a tool of revolution, axis +z, at which it touches a set of triangles.
#
# Legend: tool R largest radius, r corner radius, a = R - r. f(rho) height of its surface above the tip at radius rho.
# corners (m, 9): p, q, s of every triangle. planes (m, 11): z = g x + h y + k of its plane and 1, or 0 where it is upright; slope
# |(g, h)|, sqrt(1 + slope^2) and the direction in which it rises; then for its three edges 1 where a valley lies, which no tool
# from above touches before it touches one of the sides, or where the neighbour asks.
# boxes: tree over the triangles (see vmachining.geometry.boxtree), LEAF in a leaf. Source: spec D.4.

import numpy as np

from vmachining.jit import kernel, leaf

LEAF = 2
NONE, VERTEX, EDGE, FACET = 0, 1, 2, 3
PLACES = 64


@leaf
def height(rho, r, a):
    """f."""
    if rho <= a or r == 0.0:
        return 0.0
    over = min(rho - a, r)
    return r - np.sqrt(max(r * r - over * over, 0.0))


@leaf
def best_along(m, d, low, high, r, a):
    """s in [low, high] where m s - f(sqrt(d^2 + s^2)) is largest; d: distance of the axis from the line."""
    if r == 0.0:
        return high if m > 0.0 else low
    w2 = (a + r) ** 2 - d * d
    if m == 0.0:
        return min(max(0.0, low), high)
    if a == 0.0:
        s = m * np.sqrt(max(w2, 0.0) / (1.0 + m * m))
    else:  # rho = a + r sin t with tan t s / rho = |m|, by Newton's method kept in its bracket
        slope = abs(m)
        t0 = np.arcsin(min(max(d - a, 0.0) / r, 1.0))
        t1 = 0.5 * np.pi
        t = min(max(np.arctan(slope), t0 + 1e-3 * (t1 - t0)), t1 - 1e-3 * (t1 - t0))
        for _ in range(60):
            sine, cosine = np.sin(t), np.cos(t)
            rho = a + r * sine
            share = np.sqrt(max(1.0 - (d / rho) ** 2, 0.0))
            value = sine / cosine * share - slope
            if value > 0.0:
                t1 = t
            else:
                t0 = t
            rate = share / (cosine * cosine)
            if share > 0.0:
                rate += sine * r * d * d / (rho * rho * rho * share)
            new = t - value / rate if rate > 0.0 else 0.5 * (t0 + t1)
            if not t0 < new < t1:
                new = 0.5 * (t0 + t1)
            done = abs(new - t) <= 1e-9
            t = new
            if done:
                break
        rho = a + r * np.sin(t)
        s = np.sqrt(max(rho * rho - d * d, 0.0))
        if m < 0.0:
            s = -s
    return min(max(s, low), high)


@leaf
def most_along(m, d, low, high, r, a):
    """Upper bound of m s - f(sqrt(d^2 + s^2)) in [low, high], which is concave: its tangent where a plane would touch."""
    sine = abs(m) / np.sqrt(1.0 + m * m)
    guess = np.sqrt(max((a + r * sine) ** 2 - d * d, 0.0))
    s = min(max(guess if m > 0.0 else -guess, low), high)
    rho = np.sqrt(d * d + s * s)
    over = rho - a
    if over <= 0.0:
        value, rate = m * s, m
    elif over >= r:
        return np.inf
    else:
        root = np.sqrt(r * r - over * over)
        value, rate = m * s - r + root, m - over / root * s / rho
    return value + (rate * (high - s) if rate > 0.0 else rate * (low - s))


@leaf
def over_vertex(x, y, px, py, pz, R, r, a):
    """Tip height at which the tool touches a point; -inf if it cannot."""
    square = (px - x) ** 2 + (py - y) ** 2
    if square > R * R:
        return -np.inf
    return pz - height(np.sqrt(square), r, a)


@leaf
def over_edge(x, y, px, py, pz, qx, qy, qz, best, R, r, a):
    """Tip height at which the tool touches a segment; -inf if that is not above `best`."""
    ex, ey = qx - px, qy - py
    square = ex * ex + ey * ey
    if square <= 0.0:
        return max(over_vertex(x, y, px, py, pz, R, r, a), over_vertex(x, y, qx, qy, qz, R, r, a))
    beside = (x - px) * ey - (y - py) * ex
    if beside * beside > R * R * square:
        return -np.inf
    length = np.sqrt(square)
    s0 = ((x - px) * ex + (y - py) * ey) / length
    d = min(abs(beside) / length, R)
    w = np.sqrt(R * R - d * d)
    low, high = max(-w, -s0), min(w, length - s0)
    if low > high:
        return -np.inf
    m = (qz - pz) / length
    if pz + m * (s0 + (high if m > 0.0 else low)) - height(d, r, a) <= best:
        return -np.inf
    # straight under the axis an edge lifts the tool most
    if pz + m * s0 + a * abs(m) + r * (np.sqrt(1.0 + m * m) - 1.0) <= best:
        return -np.inf
    if a > 0.0 and r > 0.0 and pz + m * s0 + most_along(m, d, low, high, r, a) <= best:
        return -np.inf
    s = best_along(m, d, low, high, r, a)
    return pz + m * (s0 + s) - height(np.sqrt(d * d + s * s), r, a)


@leaf
def in_triangle(x, y, c):
    """Whether a point lies in the triangle seen from above, its border included."""
    one = (c[3] - c[0]) * (y - c[1]) - (c[4] - c[1]) * (x - c[0])
    two = (c[6] - c[3]) * (y - c[4]) - (c[7] - c[4]) * (x - c[3])
    three = (c[0] - c[6]) * (y - c[7]) - (c[1] - c[7]) * (x - c[6])
    return (one >= 0.0 and two >= 0.0 and three >= 0.0) or (one <= 0.0 and two <= 0.0 and three <= 0.0)


@leaf
def incline(plane) -> None:
    """Slope, stretch and direction of a plane from its g and h."""
    slope = np.sqrt(plane[0] * plane[0] + plane[1] * plane[1])
    plane[4], plane[5] = slope, np.sqrt(1.0 + slope * slope)
    plane[6], plane[7] = (plane[0] / slope, plane[1] / slope) if slope > 0.0 else (0.0, 0.0)


@leaf
def over_triangle(x, y, c, plane, best, R, r, a):
    """(tip height, kind of contact) over one triangle; (-inf, NONE) where it is not above `best`."""
    if plane[3] > 0.0:
        slope, stretch = plane[4], plane[5]
        z = plane[0] * x + plane[1] * y + plane[2] + a * slope + r * (stretch - 1.0)
        if z <= best:  # no point of the plane lifts the tool higher
            return -np.inf, NONE
        # the normal is (-g, -h, 1) / stretch: the contact lies on the rising side
        aside = a + r * slope / stretch
        if in_triangle(x + aside * plane[6], y + aside * plane[7], c):
            return z, FACET
    found, kind = best, NONE
    for k in range(3):
        i, j = 3 * k, 3 * ((k + 1) % 3)
        if plane[8 + k] > 0.0 or max(c[i + 2], c[j + 2]) <= found:
            continue
        z = over_edge(x, y, c[i], c[i + 1], c[i + 2], c[j], c[j + 1], c[j + 2], found, R, r, a)
        if z > found:
            found, kind = z, EDGE
    if kind == NONE:
        return -np.inf, NONE
    return found, kind


@leaf
def node_bound(x, y, box, R, r, a):
    """No triangle of a node lifts the tip above this; -inf where all are out of reach."""
    dx = max(box[0] - x, x - box[3], 0.0)
    dy = max(box[1] - y, y - box[4], 0.0)
    square = dx * dx + dy * dy
    if not square <= R * R:
        return -np.inf
    return box[5] - height(np.sqrt(square), r, a)


@kernel
def drop(points, corners, planes, boxes, R, r, floor, z, which, kind) -> None:
    """Tip height at every point (n, 2), its triangle and kind of contact; `floor` and -1 where nothing is touched above it."""
    stack, bound = np.empty(96, dtype=np.int64), np.empty(96)
    leaves = (len(boxes) + 1) // 2
    a = R - r
    last = 0
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        best, triangle, what = floor, -1, NONE
        value, how = over_triangle(x, y, corners[last], planes[last], best, R, r, a)
        if how != NONE:
            best, triangle, what = value, last, how
        stack[0], bound[0] = 0, node_bound(x, y, boxes[0], R, r, a)
        top = 1
        while top > 0:
            top -= 1
            node = stack[top]
            if bound[top] <= best:
                continue
            if node < leaves - 1:
                one, two = 2 * node + 1, 2 * node + 2
                b1 = node_bound(x, y, boxes[one], R, r, a)
                b2 = node_bound(x, y, boxes[two], R, r, a)
                if b1 > b2:
                    one, two, b1, b2 = two, one, b2, b1
                if b1 > best:
                    stack[top], bound[top] = one, b1
                    top += 1
                if b2 > best:
                    stack[top], bound[top] = two, b2
                    top += 1
                continue
            first = (node - leaves + 1) * LEAF
            for j in range(first, min(first + LEAF, len(corners))):
                value, how = over_triangle(x, y, corners[j], planes[j], best, R, r, a)
                if how != NONE:
                    best, triangle, what = value, j, how
        z[i], which[i], kind[i] = best, triangle, what
        if triangle >= 0:
            last = triangle


@leaf
def outline(y, m, R, r, a):
    """Height over a pass of what it leaves at the distance y across: the lowest m s + f over the line y; inf beside it."""
    y = abs(y)
    if y > R:
        return np.inf
    s = best_along(abs(m), y, 0.0, np.sqrt(R * R - y * y), r, a)
    return height(np.sqrt(y * y + s * s), r, a) - abs(m) * s


@leaf
def over_passes(y, i, first, last, z, slopes, offsets, R, r, a):
    """Lowest of some passes over a place."""
    lowest = np.inf
    for k in range(first, last):
        lowest = min(lowest, z[k, i] + outline(y - offsets[k], slopes[k, i], R, r, a))
    return lowest


@kernel
def between_passes(z, slopes, offsets, R, r, left) -> None:
    """How far, at each station, the first and the last pass stay above those between them; see `upright_ridges`.

    z, slopes (k, n); offsets (k,). Looked at are places spread over all that a pass reaches, the one where both outlines cross,
    and the end of each pass that lies towards the other, without itself: there the other stands over a step.
    """
    a, last = R - r, len(offsets) - 1
    low, step = offsets[0] - R, (offsets[last] - offsets[0] + 2.0 * R) / PLACES
    for i in range(z.shape[1]):
        most, before = 0.0, np.nan
        for j in range(PLACES + 1):
            y = low + j * step
            one = over_passes(y, i, 0, 1, z, slopes, offsets, R, r, a)
            two = over_passes(y, i, last, last + 1, z, slopes, offsets, R, r, a)
            lowest = over_passes(y, i, 1, last, z, slopes, offsets, R, r, a)
            if lowest < min(one, two):
                most = max(most, min(one, two) - lowest)
            if not (one < np.inf and two < np.inf):
                continue
            gap = one - two
            if before * gap < 0.0:
                p, q = y - step, y
                for _ in range(30):
                    y = 0.5 * (p + q)
                    one = over_passes(y, i, 0, 1, z, slopes, offsets, R, r, a)
                    if before * (one - over_passes(y, i, last, last + 1, z, slopes, offsets, R, r, a)) > 0.0:
                        p = y
                    else:
                        q = y
                most = max(most, one - over_passes(y, i, 1, last, z, slopes, offsets, R, r, a))
            before = gap
        for k, other, y in ((0, last, offsets[0] + R), (last, 0, offsets[last] - R)):
            lowest = min(
                over_passes(y, i, 1, last, z, slopes, offsets, R, r, a),
                z[k, i] + outline(R, slopes[k, i], R, r, a),
            )
            most = max(most, over_passes(y, i, other, other + 1, z, slopes, offsets, R, r, a) - lowest)
        left[i] = most


@kernel
def heights(points, corners, planes, boxes, z, which) -> None:
    """Highest point of the triangles over every point (n, 2), and its triangle; -inf and -1 off the part."""
    stack = np.empty(96, dtype=np.int64)
    leaves = (len(boxes) + 1) // 2
    for i in range(len(points)):
        x, y = points[i, 0], points[i, 1]
        best, triangle = -np.inf, -1
        stack[0] = 0
        top = 1
        while top > 0:
            top -= 1
            node = stack[top]
            box = boxes[node]
            if not (box[0] <= x <= box[3] and box[1] <= y <= box[4] and box[5] > best):
                continue
            if node < leaves - 1:
                stack[top], stack[top + 1] = 2 * node + 1, 2 * node + 2
                top += 2
                continue
            first = (node - leaves + 1) * LEAF
            for j in range(first, min(first + LEAF, len(corners))):
                if planes[j, 3] > 0.0 and in_triangle(x, y, corners[j]):
                    value = planes[j, 0] * x + planes[j, 1] * y + planes[j, 2]
                    if value > best:
                        best, triangle = value, j
        z[i], which[i] = best, triangle


@leaf
def top_on_fibre(y, c, R, r, a):
    """(z, x): where a tool on the line Y = y is lifted highest by one triangle; (-inf, 0) where it passes beside."""
    # a point is touched best from straight beside it, and no point of the inside beats those of the edges
    best, where = -np.inf, 0.0
    for k in range(3):
        i, j = 3 * k, 3 * ((k + 1) % 3)
        if c[i + 1] > c[j + 1]:
            i, j = j, i
        length = c[j + 1] - c[i + 1]
        s0 = y - c[i + 1]
        low, high = max(-R, -s0), min(R, length - s0)
        if low > high:
            continue
        if length <= 0.0:
            k_top = i if c[i + 2] > c[j + 2] else j
            z, x = c[k_top + 2] - height(abs(s0), r, a), c[k_top]
        else:
            m = (c[j + 2] - c[i + 2]) / length
            s = best_along(m, 0.0, low, high, r, a)
            share = min(max((s0 + s) / length, 0.0), 1.0)
            z = c[i + 2] + share * (c[j + 2] - c[i + 2]) - height(abs(s), r, a)
            x = c[i] + share * (c[j] - c[i])
        if z > best:
            best, where = z, x
    return best, where


@leaf
def end_on_fibre(y, z, inside, outside, c, plane, R, r, a):
    """Where a triangle ceases to lift the tool above z, between two places on the line Y = y; a place where it does not."""
    for _ in range(100):
        middle = 0.5 * (inside + outside)
        if not min(inside, outside) < middle < max(inside, outside):
            break
        if over_triangle(middle, y, c, plane, z, R, r, a)[1] != NONE:
            inside = middle
        else:
            outside = middle
        if abs(inside - outside) <= 1e-13 * (1.0 + abs(outside)):
            break
    return outside


@kernel
def push(places, z, corners, planes, boxes, R, r, out) -> int:
    """Intervals along the lines Y = places where a tool at height z cuts into single triangles: rows (line, low, high).

    Returns how many there are; only those that fit are written.
    """
    stack = np.empty(96, dtype=np.int64)
    leaves = (len(boxes) + 1) // 2
    a = R - r
    count = 0
    for i in range(len(places)):
        y = places[i]
        stack[0] = 0
        top = 1
        while top > 0:
            top -= 1
            node = stack[top]
            box = boxes[node]
            if not (box[1] - R <= y <= box[4] + R and box[5] > z):
                continue
            if node < leaves - 1:
                stack[top], stack[top + 1] = 2 * node + 1, 2 * node + 2
                top += 2
                continue
            first = (node - leaves + 1) * LEAF
            for j in range(first, min(first + LEAF, len(corners))):
                c = corners[j]
                high, x = top_on_fibre(y, c, R, r, a)
                if high <= z:
                    continue
                if count < len(out):
                    before = min(c[0], c[3], c[6]) - R - 1e-9
                    behind = max(c[0], c[3], c[6]) + R + 1e-9
                    out[count, 0] = i
                    out[count, 1] = end_on_fibre(y, z, x, before, c, planes[j], R, r, a)
                    out[count, 2] = end_on_fibre(y, z, x, behind, c, planes[j], R, r, a)
                count += 1
    return count


@kernel
def lift_along(tips, axes, corners, boxes, R, r, lift, which) -> None:
    """How far a tool with an endless shank has to move along its own axis (n, 3) to leave every triangle; 0 where it is free."""
    stack = np.empty(96, dtype=np.int64)
    leaves = (len(boxes) + 1) // 2
    a = R - r
    e = np.empty((3, 3))
    c, plane = np.empty(9), np.zeros(11)
    for i in range(len(tips)):
        e[2] = axes[i]
        least = 0
        for k in range(3):
            if abs(axes[i, k]) < abs(axes[i, least]):
                least = k
        e[0] = 0.0
        e[0, least] = 1.0
        e[0] -= axes[i, least] * e[2]
        e[0] /= np.sqrt(e[0, 0] ** 2 + e[0, 1] ** 2 + e[0, 2] ** 2)
        e[1, 0] = e[2, 1] * e[0, 2] - e[2, 2] * e[0, 1]
        e[1, 1] = e[2, 2] * e[0, 0] - e[2, 0] * e[0, 2]
        e[1, 2] = e[2, 0] * e[0, 1] - e[2, 1] * e[0, 0]
        best, triangle = 0.0, -1
        stack[0] = 0
        top = 1
        while top > 0:
            top -= 1
            node = stack[top]
            box = boxes[node]
            if not box[3] >= box[0]:
                continue
            # the box in the frame of the tool: middle and half sizes of the box around it
            x, y, z, hx, hy, hz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for k in range(3):
                middle = 0.5 * (box[k] + box[k + 3]) - tips[i, k]
                half = 0.5 * (box[k + 3] - box[k])
                x, y, z = x + e[0, k] * middle, y + e[1, k] * middle, z + e[2, k] * middle
                hx, hy, hz = hx + abs(e[0, k]) * half, hy + abs(e[1, k]) * half, hz + abs(e[2, k]) * half
            dx, dy = max(abs(x) - hx, 0.0), max(abs(y) - hy, 0.0)
            square = dx * dx + dy * dy
            if square > R * R or z + hz - height(np.sqrt(square), r, a) <= best:
                continue
            if node < leaves - 1:
                stack[top], stack[top + 1] = 2 * node + 1, 2 * node + 2
                top += 2
                continue
            first = (node - leaves + 1) * LEAF
            for j in range(first, min(first + LEAF, len(corners))):
                for m in range(3):
                    for n in range(3):
                        c[3 * m + n] = 0.0
                        for k in range(3):
                            c[3 * m + n] += e[n, k] * (corners[j, 3 * m + k] - tips[i, k])
                ux, uy, uz = c[3] - c[0], c[4] - c[1], c[5] - c[2]
                vx, vy, vz = c[6] - c[0], c[7] - c[1], c[8] - c[2]
                nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
                plane[3] = 0.0
                if abs(nz) > 1e-9 * np.sqrt(nx * nx + ny * ny + nz * nz):
                    plane[0], plane[1], plane[3] = -nx / nz, -ny / nz, 1.0
                    plane[2] = c[2] - plane[0] * c[0] - plane[1] * c[1]
                    incline(plane)
                value, how = over_triangle(0.0, 0.0, c, plane, best, R, r, a)
                if how != NONE:
                    best, triangle = value, j
        lift[i], which[i] = best, triangle
