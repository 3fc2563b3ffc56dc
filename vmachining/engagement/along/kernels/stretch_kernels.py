# Which stretch of an edge may cut at one rotation angle, and which sweeps lie under it.
#
# Legend: blade, now as in margin_kernels.py, tiles as in tile_kernels.py; s arc length along the meridian, mm; pieces are arcs
#   and lines of it. e_x, e_y : direction in plan that the edge points to. work : see edge_kernels.py.

import numpy as np

from vmachining.engagement.along.kernels.margin_kernels import FAR, edge_point, into
from vmachining.jit import inner, leaf


@leaf
def facing(blade, piece, way, idle):
    """s between which a straight piece moves into what lies before it; empty if it does nowhere.

    N . V is linear along a line, and cos(beta) P + sin(beta) Q along an arc of normals beta: positive on one interval.
    """
    q = blade.rows[piece]
    a, b = blade.joints[piece], blade.joints[piece + 1]
    if q[6] > 0.0:
        side = into(way, q[4], q[5], 1.0, 0.0)  # beta = 0: n_r, lever cz
        over = into(way, q[4], q[5], 0.0, 1.0)  # beta = 90 degrees: n_z, lever -cr
        most = np.sqrt(side * side + over * over)
        if most <= idle:
            return a, a
        middle, half = np.arctan2(over, side), np.arccos(idle / most)
        low, high = max(q[7], middle - half), min(q[8], middle + half)
        if low >= high:
            return a, a
        # ends of the piece stay what they are
        return (a if low == q[7] else a + (low - q[7]) * q[6]), (
            b if high == q[8] else a + (high - q[7]) * q[6]
        )
    n_r, n_z = np.cos(q[7]), np.sin(q[7])
    f = into(way, q[0], q[1], n_r, n_z) - idle
    g = into(way, q[2], q[3], n_r, n_z) - idle
    if f <= 0.0 and g <= 0.0:
        return a, a
    if f > 0.0 and g > 0.0:
        return a, b
    end = a + (b - a) * f / (f - g)
    return (a, end) if f > 0.0 else (end, b)


@leaf
def below(blade, piece, top, b):
    """s up to which a piece lies below a height, at most b."""
    q = blade.rows[piece]
    if q[3] <= top:
        return b
    if q[6] > 0.0:
        beta = np.arcsin(min(max((top - q[5]) / q[6], -1.0), 1.0))
        return min(b, blade.joints[piece] + max(beta - q[7], 0.0) * q[6])
    if q[3] == q[1]:
        return b
    share = max(top - q[1], 0.0) / (q[3] - q[1])
    return min(b, blade.joints[piece] + share * (blade.joints[piece + 1] - blade.joints[piece]))


@leaf
def s_at(blade, piece, r):
    """s of a piece at a radius, which rises along it."""
    q = blade.rows[piece]
    if q[6] > 0.0:
        beta = -np.arccos(min(max((r - q[4]) / q[6], -1.0), 1.0))
        return blade.joints[piece] + (beta - q[7]) * q[6]
    return blade.joints[piece] + (r - q[0]) / (q[2] - q[0]) * (blade.joints[piece + 1] - blade.joints[piece])


@leaf
def height_at(q, r):
    """Height of a piece above the tip at a radius, the lower of two."""
    if q[6] > 0.0:
        t = min(max((r - q[4]) / q[6], 0.0), 1.0)
        return q[5] - q[6] * np.sqrt(1.0 - t * t)
    return q[1] + (r - q[0]) / (q[2] - q[0]) * (q[3] - q[1]) if q[2] > q[0] else q[1]


@inner
def standing(tiles, tile, blade, piece, now, e_x, e_y, a, b):
    """What of a..b may stand in material of the tiles under it, tool upright; (a, b, most of material over the edge, mm, tiles).

    These tiles are left in `tile`; -1 where they are not known. The edge is followed from one to the next. Heights rise with the
    radius, so a tile whose material ends below the edge where it comes in holds none; the stretch begins in the first tile that
    may, and ends in the last, at the top of its material.
    """
    q = blade.rows[piece]
    first_r, last_r = edge_point(blade, piece, a)[0], edge_point(blade, piece, b)[0]
    r = first_r
    if last_r < r or (q[6] > 0.0 and q[8] > 1e-9):
        return a, b, 0.0, -1
    nx, ny = tiles.head.shape
    x, y = (now[0] - tiles.origin[0]) / tiles.size, (now[1] - tiles.origin[1]) / tiles.size
    dx, dy = e_x / tiles.size, e_y / tiles.size
    i, j = int(np.floor(x + r * dx)), int(np.floor(y + r * dy))
    begin, end, begins, top, most, n, used = r, r, False, 0.0, -FAR, 0, 0
    while True:
        over_x = ((i + 1 if dx > 0.0 else i) - x) / dx if dx != 0.0 else FAR
        over_y = ((j + 1 if dy > 0.0 else j) - y) / dy if dy != 0.0 else FAR
        out = min(min(over_x, over_y), last_r)
        tile[n] = min(max(i, 0), nx - 1) * ny + min(max(j, 0), ny - 1)
        here = tiles.top[tile[n] // ny, tile[n] % ny] - now[2]
        over = here - height_at(q, r)
        most = max(most, over)
        if over > 0.0:
            begin = begin if begins else r
            begins, end, top, used = True, out, here, n + 1
        n = n + 1 if begins else 0
        if out >= last_r:
            break
        if over_x <= over_y:
            i += 1 if dx > 0.0 else -1
        else:
            j += 1 if dy > 0.0 else -1
        r = out
    if not begins:
        return a, a, most, 0
    rises = last_r > first_r
    low = max(a, s_at(blade, piece, begin)) if rises else a
    high = min(b, s_at(blade, piece, end)) if rises and end < last_r else b
    return low, below(blade, piece, top, high), most, used


@leaf
def spaced(blade, piece, a, b, n):
    """The first of n + 1 evenly spaced points of a stretch as `edge_point` says, and what leads from one to the next."""
    at, radius = edge_point(blade, piece, a), blade.rows[piece, 6]
    if radius > 0.0:
        turn = (b - a) / (n * radius)
        return at, (np.cos(turn), np.sin(turn))
    r, z, _, _ = edge_point(blade, piece, b)
    return at, ((r - at[0]) / n, (z - at[1]) / n)


@inner
def following(q, at, apart):
    """The next point of `spaced` ones."""
    if q[6] > 0.0:
        n_r, n_z = at[2] * apart[0] - at[3] * apart[1], at[3] * apart[0] + at[2] * apart[1]
        return q[4] + q[6] * n_r, q[5] + q[6] * n_z, n_r, n_z
    return at[0] + apart[0], at[1] + apart[1], at[2], at[3]


@inner
def looked(tiles, work, blade, piece, now, e_x, e_y, a, b):
    """Leaves in `tile` the tiles under a stretch of the edge, by places a quarter of one apart; how many."""
    nx, ny = tiles.head.shape
    r, h, _, _ = edge_point(blade, piece, a)
    r1, h1, _, _ = edge_point(blade, piece, b)
    reach = np.sqrt((r1 - r) ** 2 + (h1 - h) ** 2 * (1.0 - now[5] ** 2))
    looks, n = 1 + int(4.0 * reach / tiles.size), 0
    at_look, apart = spaced(blade, piece, a, b, looks)
    for _ in range(looks + 1):
        r, h, _, _ = at_look
        at_look = following(blade.rows[piece], at_look, apart)
        x, y = now[0] + h * now[3] + r * e_x, now[1] + h * now[4] + r * e_y
        i = min(max(int(np.floor((x - tiles.origin[0]) / tiles.size)), 0), nx - 1)
        j = min(max(int(np.floor((y - tiles.origin[1]) / tiles.size)), 0), ny - 1)
        if n == 0 or work.tile[n - 1] != i * ny + j:
            work.tile[n] = i * ny + j
            n += 1
    return n


@inner
def under(tiles, work, count):
    """Leaves in `keep` the sweeps of the tiles in `tile`; how many."""
    ny, n = tiles.head.shape[1], 0
    for t in range(count):
        at = tiles.head[work.tile[t] // ny, work.tile[t] % ny]
        while at >= 0:
            k = tiles.node[at, 0]
            at = tiles.node[at, 1]
            if tiles.stamp[k] == work.clock[2] and work.seen[k] != work.clock[0]:
                work.seen[k] = work.clock[0]
                work.keep[n] = work.slot[k]
                n += 1
    return n
