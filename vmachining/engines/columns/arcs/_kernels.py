# The straight sweep that stands for a sweep in one cell.
#
# Legend. rows[k] of a straight sweep as in surface/_kernels.py. Of a piece of an arc or helix about a coordinate direction:
# (0, 1, 2) its centre, the coordinate along the axis that of the start, (3) radius r, (4) angle of the start, (5) length in
# plan at most, (6) h rise along the axis for each rad, (7), (8) the cutter itself, (9) lowest z of the tip, (10) ABOUT_X,
# ABOUT_Y or ABOUT_Z, (11) signed angle. t is the angle turned since the start, 0 <= t <= T.
# lines[i] the straight sweep with columns 0-8 of rows, (9) row of the sweep, and of an arc (10), (11) least and greatest
# t that count in the cell.
# ladder[c] = (by how much the first pair is shrunk and grown, its number where nothing changes in height, its number
# elsewhere): rung l has cutters first + 2 l, first + 2 l + 1, moved by ladder[c, 0] / 2^l.
#
# Height over a point x of the plan of the pose t, p(t) its place in plan, d = |x - p|, e = (x - p) / d:
#     F(t) = z(t) + phi(d),    F' = z' - phi'(d) e.p'

import numpy as np

from vmachining.engines.columns.surface._kernels import OF, STEEP, profile
from vmachining.jit import inner, leaf

STRAIGHT, ABOUT_X, ABOUT_Y, ABOUT_Z = 0.0, 1.0, 2.0, 3.0
TWO_PI = 2.0 * np.pi
STRETCH = 0.25  # what the poses of a cell are extended by, so that its own chord has no end in it
RUNGS = 18  # pairs of cutters, each half as far from the true one as the pair before
PARTS = 8  # of the poses of a piece that are compared with each other, again and again
ROUNDS = 8
TIE = 1e-11  # of heights that count as one
FINE = 0.1  # of the size of a cell: poses that lie no farther apart are not compared with each other
WIDE = 4.0  # of the size of a cell: where so many are left, their ends are looked at once more
RISING, FALLING, OPEN, ABSENT = 1.0, 2.0, 3.0, 4.0  # of the height over a cell, as t grows
LAST = RUNGS - 1.0


@inner
def pose(rows, k, r, t, cos, sin):
    """(x, y, z of the tip, and their derivatives by t) at t, where the angle has this cosine and sine, on radius r."""
    h, kind = rows[k, 6], rows[k, 10]
    way = r if rows[k, 11] > 0.0 else -r
    x, y, z = rows[k, 0], rows[k, 1], rows[k, 2]
    if kind == ABOUT_Z:
        return x + r * cos, y + r * sin, z + h * t, -way * sin, way * cos, h
    if kind == ABOUT_Y:
        return x + r * sin, y + h * t, z + r * cos, way * cos, h, -way * sin
    return x + h * t, y + r * cos, z + r * sin, h, -way * sin, way * cos


@leaf
def at(rows, k, r, t):
    """The same from t alone."""
    angle = rows[k, 4] + (t if rows[k, 11] > 0.0 else -t)
    return pose(rows, k, r, t, np.cos(angle), np.sin(angle))


@inner
def _gaps(x, y, hx, hy, ax, ay, bx, by, bulge):
    """(least, greatest) distance in plan of points of the cell from poses no farther than `bulge` from the line a b."""
    ux, uy = bx - ax, by - ay
    L = np.sqrt(ux * ux + uy * uy)
    if L > 0.0:
        ux, uy = ux / L, uy / L
    else:
        ux, uy = 1.0, 0.0
    dx, dy = x - ax, y - ay
    p, q = dx * ux + dy * uy, abs(dy * ux - dx * uy)
    hp, hq = abs(ux) * hx + abs(uy) * hy + bulge, abs(uy) * hx + abs(ux) * hy + bulge
    near, short = max(q - hq, 0.0), max(max(p - L - hp, -p - hp), 0.0)
    far, long = q + hq, max(L - p + hp, p + hp)
    return np.sqrt(short * short + near * near), np.sqrt(long * long + far * far)


@inner
def _trend(head, part, c, least, most, slow, fast, speed, down, up):
    """How the height over all points of a cell changes along a part of the poses.

    d lies between least and most, (x - p).p' between slow and fast, z' between down and up; |p'| <= speed. Where d only
    grows, what a later pose reaches an earlier one does, and the other way round.
    """
    R, ball = head[c, 1], head[c, 2] == 1.0  # of a ball phi'(d) / d grows with d
    if least > R:
        return ABSENT
    if fast <= 0.0 and down >= 0.0:
        return RISING
    if slow >= 0.0 and up <= 0.0:
        return FALLING
    if fast <= 0.0 or slow >= 0.0:
        flat = profile(head, part, c, least)[2]
        d = least if ball and least > 0.0 else most
        if fast <= 0.0 and down * d >= flat * fast:
            return RISING
        if slow >= 0.0 and up * d <= flat * slow:
            return FALLING
    if most < R and (down >= 0.0 or up <= 0.0):
        steep = profile(head, part, c, most)[3]
        d = most if ball else least
        if steep < STEEP and down >= 0.0 and (down * d >= steep * fast or down >= steep * speed):
            return RISING
        if steep < STEEP and up <= 0.0 and (up * d <= steep * slow or -up >= steep * speed):
            return FALLING
    return OPEN


@inner
def _between(head, part, rows, k, x, y, hx, hy, step, px, py, pz, vx, vy, vz, qx, qy, qz, wx, wy, wz):
    """(trend, least height where it is OPEN) over the cell of the poses of arc k from (p, v) to (q, w), `step` rad apart."""
    c, r, level = int(rows[k, 7]), rows[k, 3], rows[k, 10] == ABOUT_Z
    share = 0.125 * step * step  # of a second derivative by t: what lies between is so far from linear
    bulge = share * r
    over = 0.0 if level else bulge
    least, most = _gaps(x, y, hx, hy, px, py, qx, qy, bulge)
    if least > head[c, 1]:
        return ABSENT, np.inf
    a, da = (x - px) * vx + (y - py) * vy, abs(vx) * hx + abs(vy) * hy
    b, db = (x - qx) * wx + (y - qy) * wy, abs(wx) * hx + abs(wy) * hy
    slow, fast = min(a - da, b - db), max(a + da, b + db)
    # the second derivative of u = (x - p).p' is (x - p).p3 - 3 p1.p2 (p1, p2, p3 derivatives of p), of a level circle -u
    bend = share * (1.1 * max(-slow, fast) if level else r * (1.5 * r + most))
    speed = r if level else np.sqrt(r * r + rows[k, 6] * rows[k, 6])
    down, up = min(vz, wz) - over, max(vz, wz) + over
    trend = _trend(head, part, c, least, most, slow - bend, fast + bend, speed, down, up)
    height = np.inf
    if trend == OPEN:
        height = min(pz, qz) - over + profile(head, part, c, least)[1]
    return trend, height


@leaf
def _least(head, part, c, x, y, hx, hy, px, py, pz):
    """Least height over the cell of one pose."""
    gx, gy = max(abs(x - px) - hx, 0.0), max(abs(y - py) - hy, 0.0)
    gap = np.sqrt(gx * gx + gy * gy)
    return pz + profile(head, part, c, gap)[1] if gap <= head[c, 1] else np.inf


@leaf
def _most(head, part, c, x, y, hx, hy, px, py, pz):
    """Greatest height over the cell of one pose, and as much above it that rounding does not make it lower than its least."""
    gx, gy = abs(x - px) + hx, abs(y - py) + hy
    gap = np.sqrt(gx * gx + gy * gy)
    return pz + profile(head, part, c, gap)[0] + TIE * (1.0 + abs(pz)) if gap <= head[c, 1] else np.inf


@leaf
def lowest(head, part, rows, k, x, y, hx, hy):
    """(least, greatest) t of the poses of arc k that can be lowest over a point of the cell.

    Each of `PARTS` equal parts by its trend: where that is known, no pose inside is the lowest one, but one of its ends
    may be. What may be is compared in height, over the cell, with the best; then the same with the part that is left. Where
    two that are lowest, each near one end, leave all between, both ends are moved inward on their own.
    """
    c, r = int(rows[k, 7]), rows[k, 3]
    a, b, best = 0.0, abs(rows[k, 11]), np.inf
    if rows[k, 10] == ABOUT_Z and rows[k, 6] == 0.0:  # level: the pose nearest in angle
        dx, dy, half = x - rows[k, 0], y - rows[k, 1], 0.5 * b
        rho, d = np.sqrt(dx * dx + dy * dy), np.sqrt(hx * hx + hy * hy)
        if rho > d:
            beta = np.arcsin(d / rho)
            t = np.arctan2(dy, dx) - rows[k, 4] - 0.5 * rows[k, 11]
            t -= TWO_PI * np.rint(t / TWO_PI)
            if abs(t) + beta < np.pi:
                t = half + (t if rows[k, 11] > 0.0 else -t)
                return min(max(t - beta, a), b), min(max(t + beta, a), b)
    size = (hx + hy) / (r + abs(rows[k, 6]))
    for _ in range(ROUNDS):
        step = (b - a) / PARTS
        turn = step if rows[k, 11] > 0.0 else -step
        cs, ss = np.cos(turn), np.sin(turn)
        begin = rows[k, 4] + (a if rows[k, 11] > 0.0 else -a)
        c0, s0 = np.cos(begin), np.sin(begin)
        cos, sin = c0, s0
        for j in range(PARTS + 1):
            px, py, pz, _, _, _ = pose(rows, k, r, a + j * step, cos, sin)
            best = min(best, _most(head, part, c, x, y, hx, hy, px, py, pz))
            cos, sin = cos * cs - sin * ss, sin * cs + cos * ss
        low, high, before = np.inf, -np.inf, ABSENT
        cos, sin = c0, s0
        px, py, pz, vx, vy, vz = pose(rows, k, r, a, cos, sin)
        for j in range(PARTS + 1):
            t, after, height = a + j * step, ABSENT, np.inf
            qx, qy, qz, wx, wy, wz = px, py, pz, vx, vy, vz
            if j < PARTS:
                cos, sin = cos * cs - sin * ss, sin * cs + cos * ss
                qx, qy, qz, wx, wy, wz = pose(rows, k, r, t + step, cos, sin)
                after, height = _between(
                    head, part, rows, k, x, y, hx, hy, step, px, py, pz, vx, vy, vz, qx, qy, qz, wx, wy, wz
                )
            met = before in (FALLING, ABSENT) and after in (RISING, ABSENT)
            if met and _least(head, part, c, x, y, hx, hy, px, py, pz) <= best:
                low, high = min(low, t), max(high, t)
            if after == OPEN and height <= best:
                low, high = min(low, t), max(high, t + step)
            before = after
            px, py, pz, vx, vy, vz = qx, qy, qz, wx, wy, wz
        if low > high:
            return a, a  # none reaches the cell
        left = (high - low) / (b - a)
        a, b = low, min(high, b)
        if left > 0.8 or b - a <= FINE * size:
            break
    if b - a > WIDE * size:  # two lowest poses and others between, it may be
        for side in range(3):
            a, b, best = _trimmed(head, part, rows, k, x, y, hx, hy, a, b, best, side % 2 == 0, FINE * size)
    return a, b


@leaf
def _trimmed(head, part, rows, k, x, y, hx, hy, a, b, best, first, enough):
    """(least, greatest) t and height of the best pose, after parts at the first or the last end that are not lowest."""
    c, r = int(rows[k, 7]), rows[k, 3]
    step, falls = (b - a) / PARTS, RISING if first else FALLING  # falls: towards the end
    t = a if first else b
    px, py, pz, vx, vy, vz = at(rows, k, r, t)
    best = min(best, _most(head, part, c, x, y, hx, hy, px, py, pz))
    while step > enough and b - a > enough:
        step = min(step, 0.5 * (b - a))
        qx, qy, qz, wx, wy, wz = at(rows, k, r, t + (step if first else -step))
        trend, height = _between(
            head, part, rows, k, x, y, hx, hy, step, px, py, pz, vx, vy, vz, qx, qy, qz, wx, wy, wz
        )
        if trend == falls:
            if _least(head, part, c, x, y, hx, hy, px, py, pz) <= best:
                break
        elif trend == OPEN and height <= best:
            step *= 0.25
            continue
        t = t + step if first else t - step
        a, b = (t, b) if first else (a, t)
        px, py, pz, vx, vy, vz = qx, qy, qz, wx, wy, wz
        best = min(best, _most(head, part, c, x, y, hx, hy, px, py, pz))
        step *= 2.0
    return a, b, best


@leaf
def place(head, part, ladder, rows, k, x, y, hx, hy, lines, i):
    """Fill lines[i] with the straight sweep that stands for sweep k in the cell."""
    for j in range(9):
        lines[i, j] = rows[k, j]
    lines[i, 9], lines[i, OF] = k, -1.0
    kind = rows[k, 10]
    if kind == STRAIGHT:
        return
    r, h, c = rows[k, 3], rows[k, 6], int(rows[k, 7])
    a, b = lowest(head, part, rows, k, x, y, hx, hy)
    more = STRETCH * (b - a)
    a, b = max(a - more, 0.0), min(b + more, abs(rows[k, 11]))
    turn = b - a
    # chord and curve in the plane of the circle; and, where it rises, at equal places along the axis
    aside = r * np.tan(0.25 * turn) ** 2
    off = aside + (r * turn * turn * turn / 36.0 if h != 0.0 else 0.0)
    x0, y0, z0, _, _, _ = at(rows, k, r + aside, a)
    x1, y1, z1, _, _, _ = at(rows, k, r + aside, b)
    dx, dy = x1 - x0, y1 - y0
    L = np.sqrt(dx * dx + dy * dy)
    lines[i, 0], lines[i, 1], lines[i, 2] = x0, y0, z0
    if abs(z1 - z0) < STEEP * L:
        lines[i, 3], lines[i, 4], lines[i, 5], lines[i, 6] = dx / L, dy / L, L, (z1 - z0) / L
    else:  # as a plunge to its lowest pose: all others lie above what is wider by L
        if z1 < z0:
            lines[i, 0], lines[i, 1], lines[i, 2] = x1, y1, z1
        lines[i, 3], lines[i, 4], lines[i, 5], lines[i, 6] = 1.0, 0.0, 0.0, 0.0
        off += L
    if off > 0.0:
        rung = min(max(np.floor(np.log2(ladder[c, 0] / off)), 0.0), LAST)
        base = (ladder[c, 1] if kind == ABOUT_Z else ladder[c, 2]) + 2.0 * rung
        lines[i, 7], lines[i, 8] = base, base + 1.0
    lines[i, 10], lines[i, 11] = a, b


@leaf
def same_arc(lift, rows, lines, i, k, slack):
    """Whether line k runs along the circle of line i, at the height of it or above, with all poses that count in the cell."""
    f, g = int(lines[i, 9]), int(lines[k, 9])
    if rows[f, 10] == STRAIGHT or rows[f, 10] != rows[g, 10] or abs(rows[f, 3] - rows[g, 3]) > slack:
        return False
    up = lift[int(rows[f, 7]), int(rows[g, 7])]
    if up == np.inf:
        return False
    r, most = rows[f, 3], abs(rows[f, 11])
    way = 1.0 if rows[f, 11] > 0.0 else -1.0
    back = 1.0 if rows[g, 11] > 0.0 else -1.0
    for j in range(2):
        t = lines[k, 10 + j]
        s = way * (rows[g, 4] + back * t - rows[f, 4]) - 0.5 * most  # from the middle of arc i
        s += 0.5 * most - TWO_PI * np.rint(s / TWO_PI)
        if s < -slack / r or s > most + slack / r:
            return False
        x, y, z, _, _, _ = at(rows, f, r, s)
        px, py, pz, _, _, _ = at(rows, g, r, t)
        if abs(px - x) > slack or abs(py - y) > slack or pz - up < z - slack:
            return False
    return True
