# Bounds of the volume that a sweep k removes in a rectangle of the plan,
#
#     V = integral of max(0, min(top, f_1, ..., f_{k-1}) - max(f_k, bottom)).
#
# Legend. (x, y) centre, hx, hy half sizes of the cell; points of planes are relative to the centre. E, C, lines, P, rules:
# see sides.py.

import numpy as np

from vmachining.engines.columns.arcs._kernels import place
from vmachining.engines.columns.closed._kernels import hides, less
from vmachining.engines.columns.creases._kernels import crossed
from vmachining.engines.columns.patches._kernels import rectangle
from vmachining.engines.columns.polygons._kernels import COARSE, cut_up
from vmachining.engines.columns.roof._kernels import OUTSIDE, WHOLE, over_cell
from vmachining.engines.columns.sides import (
    CLOSED,
    CROSS,
    CURVATURE,
    DOWN,
    FIRST,
    FORGET,
    PART,
    ROUGH,
    SELF,
    SMOOTH,
    TOP,
    UP,
)
from vmachining.engines.columns.smooth._kernels import above, smooth
from vmachining.engines.columns.surface._kernels import (
    COLUMNS,
    bending,
    distance,
    lean,
    lean_at,
    local,
    poses,
    surface,
)
from vmachining.jit import leaf

MANY = np.int64(
    5
)  # rows of a cell up to which balls are asked where surfaces cross, if it is not wider than COARSE


@leaf
def _leaves(rows, k, R, ax, ay, bx, by):
    """Where the way from a point a of the footprint to a point b leaves it, as a share of the way."""
    L = rows[k, 5]
    xa, ya = local(rows, k, ax, ay)
    xb, yb = local(rows, k, bx, by)
    dx, dy = xb - xa, yb - ya
    best = 0.0
    for e in range(2):  # the discs at both ends
        x = xa - e * L
        q, h, w = dx * dx + dy * dy, x * dx + ya * dy, x * x + ya * ya - R * R
        root = h * h - q * w
        if root > 0.0 and q > 0.0:
            best = max(best, (np.sqrt(root) - h) / q)
    t0, t1 = 0.0, 1.0
    for side in range(2):  # the strip between them
        p, d, low, high = (xa, dx, 0.0, L) if side == 0 else (ya, dy, -R, R)
        if d == 0.0:
            if p < low or p > high:
                t1 = -1.0
            continue
        u, v = (low - p) / d, (high - p) / d
        t0, t1 = max(t0, min(u, v)), min(t1, max(u, v))
    if t1 >= t0:
        best = max(best, t1)
    return min(best, 1.0)


@leaf
def _misses(rows, k, R, x, y, hx, hy):
    """Whether a cell smaller than the cutter is nowhere nearer than R to the path: neither its corners nor, from both ends
    of the path, its nearest points."""
    L = rows[k, 5]
    for e in range(2):
        dx = max(abs(rows[k, 0] + e * L * rows[k, 3] - x) - hx, 0.0)
        dy = max(abs(rows[k, 1] + e * L * rows[k, 4] - y) - hy, 0.0)
        if dx * dx + dy * dy < R * R:
            return False
    return hx + hy < R and (
        distance(rows, k, x - hx, y - hy) >= R
        and distance(rows, k, x + hx, y - hy) >= R
        and distance(rows, k, x - hx, y + hy) >= R
        and distance(rows, k, x + hx, y + hy) >= R
    )


@leaf
def border(head, rows, k, cin, cout, x, y, hx, hy, C, i):
    """Chord and outer tangent of the footprint in the cell: n.p <= c_in inside (for corners of the cell only), n.p >
    c_out outside. False if the footprint misses the cell."""
    R = head[cin, 1]
    if _misses(rows, k, head[cout, 1], x, y, hx, hy):
        return False
    inside, crossings = 0, 0
    px, py, qx, qy = 0.0, 0.0, 0.0, 0.0
    ax, ay = x + hx, y - hy
    a_in = distance(rows, k, ax, ay) <= R
    for j in range(4):
        bx, by = (x + hx if j == 0 or j == 3 else x - hx), (y + hy if j < 2 else y - hy)
        b_in = distance(rows, k, bx, by) <= R
        inside += 1 if b_in else 0
        if a_in != b_in:
            if a_in:
                t = _leaves(rows, k, R, ax, ay, bx, by)
                cx, cy = ax + t * (bx - ax) - x, ay + t * (by - ay) - y
            else:
                t = _leaves(rows, k, R, bx, by, ax, ay)
                cx, cy = bx + t * (ax - bx) - x, by + t * (ay - by) - y
            if crossings == 0:
                px, py = cx, cy
            else:
                qx, qy = cx, cy
            crossings += 1
        ax, ay, a_in = bx, by, b_in
    xi, eta = local(rows, k, x, y)
    s = min(max(xi, 0.0), rows[k, 5])
    ux, uy = rows[k, 3], rows[k, 4]
    t = xi - s
    nx, ny = t * ux - eta * uy, t * uy + eta * ux  # from the path to the centre
    size = np.sqrt(nx * nx + ny * ny)
    nx, ny = (nx / size, ny / size) if size > 0.0 else (1.0, 0.0)
    c_in = -np.inf
    if crossings == 2:
        ex, ey = qy - py, px - qx
        size = np.sqrt(ex * ex + ey * ey)
        if size > 1e-3 * min(hx, hy):
            way = 1.0 if ex * nx + ey * ny > 0.0 else -1.0
            nx, ny = way * ex / size, way * ey / size
            c_in = min(nx * px + ny * py, nx * qx + ny * qy)
    x0, y0, L = rows[k, 0] - x, rows[k, 1] - y, rows[k, 5]
    reach = nx * x0 + ny * y0 + max(0.0, L * (nx * ux + ny * uy)) + head[cout, 1]
    C[i, 0], C[i, 1], C[i, 2], C[i, 3] = nx, ny, c_in, reach
    return reach > -(abs(nx) * hx + abs(ny) * hy)


@leaf
def _inside(rows, k, R, x, y, hx, hy):
    """Whether the corners of the cell, hence the cell, lie in the footprint."""
    return (
        distance(rows, k, x - hx, y - hy) <= R
        and distance(rows, k, x + hx, y - hy) <= R
        and distance(rows, k, x - hx, y + hy) <= R
        and distance(rows, k, x + hx, y + hy) <= R
    )


@leaf
def _side(head, part, rows, k, c, rules, x, y, hx, hy, xi, eta, far, d, E, i, e):
    """Fill one side of E[i]: sweep k with cutter c in the cell."""
    R = head[c, 1]
    for j in range(3, 8):
        E[i, e + j] = 0.0
    if far + d <= R or _inside(rows, k, R, x, y, hx, hy):
        poses(head, part, c, rows, k, x, y, hx, hy)
        z, tangent, gx, gy = surface(head, part, c, rows, k, x, y, lean_at(head, part, c, rows, k, xi, eta))
        E[i, e + 1], E[i, e + 2] = gx, gy
        xx, xy, yy, radius = 0.0, 0.0, 0.0, np.inf
        if rules & CURVATURE:
            xx, xy, yy, radius = bending(head, part, c, rows, k, xi, eta, hx, hy)
        if radius <= xx + yy or radius * d <= 1e-9:
            E[i, e + 3], E[i, e + 4], E[i, e + 5], E[i, e + 6] = xx, xy, yy, radius
            E[i, e], E[i, e + 7] = z, SMOOTH
        else:
            E[i, e], E[i, e + 7] = tangent, ROUGH
        return
    # a plane that touches inside the footprint, half way between its border and the far side of the cell
    qx, qy = x, y
    if far > 0.0:
        s = min(max(xi, 0.0), rows[k, 5])
        t = xi - s
        want = min(far, 0.5 * (R + max(far - d, 0.0)), R * (1.0 - 1e-9)) / far
        qx = rows[k, 0] + (s + want * t) * rows[k, 3] - want * eta * rows[k, 4]
        qy = rows[k, 1] + (s + want * t) * rows[k, 4] + want * eta * rows[k, 3]
    u = lean(head, part, c, abs(rows[k, 6]), min(abs(local(rows, k, qx, qy)[1]), R))
    _, tangent, gx, gy = surface(head, part, c, rows, k, qx, qy, u)
    E[i, e] = tangent + gx * (x - qx) + gy * (y - qy)
    E[i, e + 1], E[i, e + 2], E[i, e + 7] = gx, gy, PART


@leaf
def look(head, part, rows, k, cin, cout, rules, x, y, hx, hy, E, C, i):
    """Fill E[i], C[i] for line k: upper side with cutter cin, lower side with cout. False if it misses the cell."""
    d = np.sqrt(hx * hx + hy * hy)
    far = distance(rows, k, x, y)
    if far - d >= max(head[cin, 1], head[cout, 1]):
        return False
    xi, eta = local(rows, k, x, y)
    C[i, 2], C[i, 3] = np.inf, np.inf
    _side(head, part, rows, k, cin, rules, x, y, hx, hy, xi, eta, far, d, E, i, UP)
    if cin == cout:
        for j in range(8):
            E[i, DOWN + j] = E[i, UP + j]
    else:
        _side(head, part, rows, k, cout, rules, x, y, hx, hy, xi, eta, far, d, E, i, DOWN)
    if E[i, UP + 7] == PART or E[i, DOWN + 7] == PART:
        return border(head, rows, k, cin, cout, x, y, hx, hy, C, i)
    return True


@leaf
def floor_of(E, i, bottom, hx, hy):
    """Turn surface i into max(f, bottom)."""
    for side in range(2):
        e = UP if side == 0 else DOWN
        swing = abs(E[i, e + 1]) * hx + abs(E[i, e + 2]) * hy
        v = E[i, e]
        if E[i, e + 7] == SMOOTH:
            xx, xy, yy, r = E[i, e + 3], E[i, e + 4], E[i, e + 5], E[i, e + 6]
            high = 0.5 * (max(xx + r, 0.0) * hx * hx + max(yy + r, 0.0) * hy * hy) + abs(xy) * hx * hy
            if v - swing >= bottom:
                continue
            if v + swing + high <= bottom:
                E[i, e] = bottom
                for j in range(1, 7):
                    E[i, e + j] = 0.0
                continue
            E[i, e + 7] = ROUGH
            for j in range(3, 7):
                E[i, e + j] = 0.0
        if side == 1 and v < bottom:
            E[i, e], E[i, e + 1], E[i, e + 2] = bottom, 0.0, 0.0


@leaf
def bounds(
    head, part, lift, ladder, rows, rules, roof, k, rim, top, bottom, x, y, hx, hy, ids, src, count, dst, slack,
    enough, lines, E, C, P, W,
):  # fmt: skip
    """(lo, hi, number of earlier sweeps that still count, written to ids from dst) of a cell.

    rim : row of a plunge whose footprint is that of a round stock, -1 where the walls of the stock are those of the tiles.
    roof : top and outline of a stock of facets; empty: the top is level. enough : a width of no consequence, mm^3.
    """
    place(head, part, ladder, rows, k, x, y, hx, hy, lines, SELF)
    if not look(head, part, lines, SELF, int(lines[1, 7]), int(lines[1, 8]), rules, x, y, hx, hy, E, C, SELF):
        return 0.0, 0.0, TOP
    edge = TOP
    if rim >= 0:
        c = int(rows[rim, 7])
        d, far = np.sqrt(hx * hx + hy * hy), distance(rows, rim, x, y)
        if far - d >= head[c, 1]:
            return 0.0, 0.0, TOP
        if far + d > head[c, 1]:
            edge = np.int64(len(C) - 1)
            if not border(head, rows, rim, c, c, x, y, hx, hy, C, edge):
                return 0.0, 0.0, TOP
            if C[edge, 2] == -np.inf and _inside(rows, rim, head[c, 1], x, y, hx, hy):
                edge = TOP
    for j in range(16):
        E[0, j] = 0.0
    level = True
    if len(roof.start) > 0:
        state, up, down, gx, gy, wall = over_cell(roof, x, y, hx, hy, slack)
        if state == OUTSIDE:
            return 0.0, 0.0, TOP
        level = state == WHOLE and gx == 0.0 and gy == 0.0 and up == down
        top = up
        E[0, UP], E[0, UP + 1], E[0, UP + 2] = up, gx, gy
        E[0, DOWN], E[0, DOWN + 1], E[0, DOWN + 2] = down, gx, gy
        if wall >= 0:
            edge = np.int64(len(C) - 1)
            ux, uy = roof.wall[wall, 2] - roof.wall[wall, 0], roof.wall[wall, 3] - roof.wall[wall, 1]
            size = np.sqrt(ux * ux + uy * uy)
            nx, ny = uy / size, -ux / size
            c = nx * (roof.wall[wall, 0] - x) + ny * (roof.wall[wall, 1] - y)
            C[edge, 0], C[edge, 1], C[edge, 2], C[edge, 3] = nx, ny, c - slack, c + slack
        elif state != WHOLE:  # nothing is there for sure
            E[0, DOWN], E[0, DOWN + 1], E[0, DOWN + 2] = bottom, 0.0, 0.0
    else:
        E[0, UP], E[0, DOWN] = top, top
    E[0, UP + 7], E[0, DOWN + 7] = SMOOTH, SMOOTH
    if above(E, SELF, DOWN, hx, hy, TOP, UP):
        return 0.0, 0.0, TOP
    floor_of(E, SELF, bottom, hx, hy)
    n, best = FIRST, TOP
    for q in range(count):
        j = ids[src + q]
        place(head, part, ladder, rows, j, x, y, hx, hy, lines, n)
        if hides(head, part, lift, rows, lines, rules, n, SELF, x, y, hx, hy, slack):
            return 0.0, 0.0, TOP
        if not look(
            head, part, lines, n, int(lines[n, 7]), int(lines[n, 8]), rules, x, y, hx, hy, E, C, n
        ) or above(E, n, DOWN, hx, hy, 0, UP):
            continue
        ids[dst + n - 2] = j
        if E[n, UP + 7] == SMOOTH and E[n, UP] < E[best, UP]:
            if above(E, SELF, DOWN, hx, hy, n, UP):
                return 0.0, 0.0, TOP
            best = n
        n += 1
    kept = FIRST
    for i in range(2, n):
        if rules & FORGET != 0 and i != best and above(E, i, DOWN, hx, hy, best, UP):
            continue
        if i == best:
            best = kept
        if i != kept:
            for j in range(16):
                E[kept, j] = E[i, j]
            for j in range(4):
                C[kept, j] = C[i, j]
            for j in range(COLUMNS):
                lines[kept, j] = lines[i, j]
            ids[dst + kept - 2] = ids[dst + i - 2]
        kept += 1
    n, known, plain = kept, E[1, UP + 7] == SMOOTH and E[1, DOWN + 7] == SMOOTH, True
    for i in range(1, n):
        plain = plain and E[i, UP + 7] == SMOOTH and E[i, DOWN + 7] == SMOOTH
    known = known and E[best, DOWN + 7] == SMOOTH and edge == 0
    rectangle(P, hx, hy)
    lo, hi = 0.0, np.inf
    share, least, most = -np.inf, -np.inf, np.inf
    firm = (
        rules & CLOSED != 0
        and level
        and edge == 0
        and E[1, DOWN] - abs(E[1, DOWN + 1]) * hx - abs(E[1, DOWN + 2]) * hy > bottom
    )
    if firm:
        lo, hi, share, least, most, exact = less(
            head, part, lift, rows, lines, rules, E, n, best, known, top, x, y, hx, hy, slack, enough, P, W
        )
        if exact:
            return lo, max(hi, lo), n - 2
    below, over = -np.inf, np.inf
    if known and hi - lo > enough:
        a, b, below, over = smooth(E, n, best, rules, hx, hy, share, least, most)
        lo, hi = max(lo, a), min(hi, b)
    if (
        firm
        and rules & CROSS != 0
        and hi - lo > enough
        and n <= MANY
        and hx + hy <= COARSE * head[int(lines[SELF, 7]), 1]
        and head[int(lines[SELF, 7]), 2] == 1.0
        and not (known and plain)
        and E[best, UP + 7] == SMOOTH
        and (best == TOP or above(E, TOP, DOWN, hx, hy, best, UP))
    ):
        a, b = crossed(head, part, lines, E, n, best, below, over, top, x, y, hx, hy, slack, P, W)
        lo, hi = max(lo, a), min(hi, b)
    if not (known and plain) and hi - lo > enough:
        a, b = cut_up(head, part, lines, rules, bottom, x, y, hx, hy, E, n, C, P, W, edge)
        lo, hi = max(lo, a), min(hi, b)
    return lo, max(hi, lo), n - 2
