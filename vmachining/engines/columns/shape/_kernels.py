# Slivers of a closed surface: their points slide within their faces, or one end of a short edge goes to the other.
#
# Legend: points (n, 3). triangles (m, 3); a dropped one has its three corners alike. box (2, 3): around all points. Corner
#   c = 3 t + k; head (n,) a corner of each point, after (3 m,) the next one of the same point, -1 the last. mark (n,): whose
#   neighbour a point was last.

import numpy as np

from vmachining.jit import kernel, leaf

LEVEL = 0.9  # cosine by which a face may turn
WITHIN = (
    0.02  # share of what is allowed that a point may leave its faces by as it slides: corners and crests stay
)
TURNS = 4  # times that all triangles are looked at, at most
SLIDES = 5  # shares of the way to the middle that are tried, each half of the one before


@leaf
def fan(triangles, head, after):
    """Fill the lists of corners."""
    head[:] = -1
    for c in range(3 * len(triangles)):
        v = triangles[c // 3, c % 3]
        after[c] = head[v]
        head[v] = c


@leaf
def area(points, u, p, q):
    """(x, y, z, length) of the normal of a triangle, twice its area long, and its longest side."""
    ox, oy, oz = points[u, 0], points[u, 1], points[u, 2]
    ax, ay, az = points[p, 0] - ox, points[p, 1] - oy, points[p, 2] - oz
    bx, by, bz = points[q, 0] - ox, points[q, 1] - oy, points[q, 2] - oz
    x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    cx, cy, cz = bx - ax, by - ay, bz - az
    side = max(ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz, cx * cx + cy * cy + cz * cz)
    return x, y, z, np.sqrt(x * x + y * y + z * z), np.sqrt(side)


@leaf
def stays(points, u, v, p, q):
    """(height of the triangle v, p, q, mm by which v lies off the triangle u, p, q); infinite where it would turn."""
    x, y, z, size, _ = area(points, u, p, q)
    xx, yy, zz, new, side = area(points, v, p, q)
    if size == 0.0 or new == 0.0 or x * xx + y * yy + z * zz < LEVEL * size * new:
        return 0.0, np.inf
    off = (
        x * (points[v, 0] - points[u, 0])
        + y * (points[v, 1] - points[u, 1])
        + z * (points[v, 2] - points[u, 2])
    )
    return new / side, abs(off) / size


@leaf
def low(points, triangles, t, least):
    """Whether a triangle that was not dropped is less high than that."""
    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    if a == b or b == c or c == a:
        return False
    _, _, _, size, side = area(points, a, b, c)
    return size < least * side


@leaf
def leaves(points, triangles, box, head, after, mark, clock, u, v, allowed):
    """mm by which v lies off the faces around u, for u to go to v; infinite where it may not."""
    for k in range(3):  # what lies on a face of the box stays there
        if points[u, k] != points[v, k] and (points[u, k] == box[0, k] or points[u, k] == box[1, k]):
            return np.inf
    lost, shared, worst, lost_height, least = 0, 0, 0.0, np.inf, np.inf
    c = head[v]
    while c >= 0:  # neighbours of v
        for k in range(3):
            mark[triangles[c // 3, k]] = clock
        c = after[c]
    c = head[u]
    while c >= 0:
        t, k = c // 3, c % 3
        p, q = triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
        _, _, _, size, side = area(points, u, p, q)
        if mark[p] == clock and p != v:
            shared += 1  # each neighbour of u is once the next one
        if p == v or q == v:
            lost += 1
            lost_height = min(lost_height, size / side)
        else:
            height, off = stays(points, u, v, p, q)
            worst, least = max(worst, off), min(least, height)
        c = after[c]
    if lost != 2 or shared != 2 or worst > allowed or least <= lost_height:
        return np.inf
    return worst


@leaf
def go(triangles, head, after, u, v):
    """u becomes v."""
    c = head[u]
    while c >= 0:
        then, t = after[c], c // 3
        triangles[t, c % 3] = v
        after[c] = head[v]
        head[v] = c
        c = then
    head[u] = -1
    c = head[v]  # triangles that have lost a side leave the lists of v and of their third point
    before = -1
    while c >= 0:
        then, t = after[c], c // 3
        a, b, w = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if a == b or b == w or w == a:
            third = w if a == b else (a if b == w else b)
            if third != v:
                last, d = -1, head[third]
                while d >= 0 and d // 3 != t:
                    last, d = d, after[d]
                if d >= 0:
                    if last < 0:
                        head[third] = after[d]
                    else:
                        after[last] = after[d]
            if before < 0:
                head[v] = then
            else:
                after[before] = then
        else:
            before = c
        c = then


@leaf
def lowest(points, triangles, head, after, u):
    """Least height of a triangle around u."""
    least, c = np.inf, head[u]
    while c >= 0:
        t, k = c // 3, c % 3
        _, _, _, size, side = area(points, u, triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3])
        least = min(least, size / max(side, 1e-300))
        c = after[c]
    return least


@leaf
def toward(points, box, u, v, share, way):
    """Puts v a share of the way from u; within the box, and on those of its faces on which u lies."""
    for k in range(3):
        x = points[u, k]
        if x != box[0, k] and x != box[1, k]:
            x = min(max(x + share * way[k], box[0, k]), box[1, k])
        points[v, k] = x


@leaf
def slides(points, triangles, box, head, after, u, spare, allowed):
    """u goes towards the middle of its neighbours, as far as is best, where no face around it is left by more than `allowed`.
    spare : a point without triangles."""
    least = lowest(points, triangles, head, after, u)
    mx, my, mz, nx, ny, nz, count = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0
    c = head[u]
    while c >= 0:
        t, k = c // 3, c % 3
        p = triangles[t, (k + 1) % 3]
        x, y, z, _, _ = area(points, u, p, triangles[t, (k + 2) % 3])
        mx, my, mz = mx + points[p, 0], my + points[p, 1], mz + points[p, 2]
        nx, ny, nz, count = nx + x, ny + y, nz + z, count + 1
        c = after[c]
    mx, my, mz = mx / count - points[u, 0], my / count - points[u, 1], mz / count - points[u, 2]
    size = np.sqrt(nx * nx + ny * ny + nz * nz)
    if size == 0.0:
        return False
    nx, ny, nz = nx / size, ny / size, nz / size
    off = mx * nx + my * ny + mz * nz
    mx, my, mz = mx - off * nx, my - off * ny, mz - off * nz
    best, most = 0.0, least
    for step in range(SLIDES):
        share = 0.5**step
        toward(points, box, u, spare, share, (mx, my, mz))
        new = np.inf
        c = head[u]
        while c >= 0:
            t, k = c // 3, c % 3
            p, q = triangles[t, (k + 1) % 3], triangles[t, (k + 2) % 3]
            height, away = stays(points, u, spare, p, q)
            new = min(new, height if away <= allowed else -1.0)
            c = after[c]
        if new > most:
            best, most = share, new
    if best == 0.0:
        return False
    toward(points, box, u, u, best, (mx, my, mz))
    return True


@leaf
def closes(points, triangles, box, head, after, mark, clock, a, b, least, allowed):
    """Whether an edge shorter than `least` was closed up."""
    size = 0.0
    for k in range(3):
        size += (points[a, k] - points[b, k]) ** 2
    if size >= least * least:
        return False
    one = leaves(points, triangles, box, head, after, mark, clock, a, b, allowed)
    other = leaves(points, triangles, box, head, after, mark, clock + 1, b, a, allowed)
    if one == np.inf and other == np.inf:
        return False
    if one <= other:
        go(triangles, head, after, a, b)
    else:
        go(triangles, head, after, b, a)
    return True


@kernel
def tidy(points, triangles, box, head, after, mark, least, allowed) -> int:
    """Triangles less high than `least` mm: their points go where they are higher, or their short edges are closed up, where no
    face is left by more than `allowed` mm at a time. Changes points and triangles; the last point is a spare one. Returns how
    often."""
    fan(triangles, head, after)
    mark[:] = -1
    done, clock, spare = 0, 0, len(points) - 1
    for _ in range(TURNS):
        before = done
        for t in range(len(triangles)):
            if not low(points, triangles, t, least):
                continue
            for k in range(3):
                done += slides(points, triangles, box, head, after, triangles[t, k], spare, WITHIN * allowed)
            if not low(points, triangles, t, least):
                continue
            for k in range(3):
                a, b = triangles[t, k], triangles[t, (k + 1) % 3]
                if closes(points, triangles, box, head, after, mark, clock, a, b, least, allowed):
                    done += 1
                    clock += 2
                    break
                clock += 2
        if done == before:
            break
    return done
