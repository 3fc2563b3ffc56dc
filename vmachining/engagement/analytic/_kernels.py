# Edges of flat, bull and ball cutters against stock of heights over a grid, in closed form.
#
# Legend: a piece of the edge is a curve p + d sin t - e cos t (round, t = lam) or p + d t (straight, t = l or rho), for x,
#   y and z; its s is origin + size t. stairs: breaks x (n + 1,), y (m + 1,), heights top (n, m), floor.
#   A point is in the material if it is not above the top of a cell that it is in or touches, nor below the floor.

from typing import NamedTuple

import numpy as np

from vmachining.jit import kernel, leaf

TOUCH = 1e-9  # mm: tolerance.LENGTH_EPS_MM; two points closer than this are one, so cells are closed
SHORT = 1e-12  # mm or rad: intervals and gaps shorter than this do not count
QUARTER = 0.5 * np.pi


class Curve(NamedTuple):
    """One piece of the edge, see the legend. round: 1 or 0."""

    round: int
    px: float
    dx: float
    ex: float
    py: float
    dy: float
    ey: float
    pz: float
    dz: float
    ez: float
    origin: float
    size: float


class Stairs(NamedTuple):
    """x (n + 1,), y (m + 1,) rising; top (n, m); floor and highest: numbers. mm."""

    x: np.ndarray
    y: np.ndarray
    top: np.ndarray
    floor: float
    highest: float


class Moves(NamedTuple):
    """tip (n, 3) mm; frame (n, 3, 3); velocity (n, 3); axis_rate (n, 3), dw/dt."""

    tip: np.ndarray
    frame: np.ndarray
    velocity: np.ndarray
    axis_rate: np.ndarray


class Found(NamedTuple):
    """lower, upper (rows, k) mm of s, NaN after the last; many (rows,): how many, more than k where k is too small."""

    lower: np.ndarray
    upper: np.ndarray
    many: np.ndarray


@leaf
def cell(breaks, v):
    """k with breaks[k] <= v < breaks[k + 1], the first or last cell outside."""
    lo, hi = 0, len(breaks) - 1
    while hi - lo > 1:
        mid = (lo + hi) >> 1
        if breaks[mid] <= v:
            lo = mid
        else:
            hi = mid
    return lo


@leaf
def top_at(stairs, px, py):
    """Highest top of the cells that hold or touch a point; -inf outside."""
    x, y = stairs.x, stairs.y
    n, m = len(x) - 1, len(y) - 1
    if px < x[0] - TOUCH or px > x[n] + TOUCH or py < y[0] - TOUCH or py > y[m] + TOUCH:
        return -np.inf
    i, j = cell(x, px), cell(y, py)
    i0 = i - 1 if i > 0 and px - x[i] <= TOUCH else i
    i1 = i + 1 if i + 1 < n and x[i + 1] - px <= TOUCH else i
    j0 = j - 1 if j > 0 and py - y[j] <= TOUCH else j
    j1 = j + 1 if j + 1 < m and y[j + 1] - py <= TOUCH else j
    best = -np.inf
    for a in range(i0, i1 + 1):
        for b in range(j0, j1 + 1):
            best = max(best, stairs.top[a, b])
    return best


@leaf
def crossings(curve_round, p, d, e, c, t0, s0, c0, t1, s1, c1, roots, n):
    """Put t, sin t and cos t of up to two crossings with the plane at c, strictly between t0 and t1, behind the n roots.

    d sin t - e cos t = g has the size k = hypot(d, e): (sin t, cos t) = (d h -+ e q, -e h -+ d q) / k with h = g / k and
    q = sqrt(1 - h^2), the closed form tau -+ acos(g / k) without its angles.
    """
    g = c - p
    if not curve_round:
        if d != 0.0:
            t = g / d
            if t0 < t < t1:
                roots[n, 0] = t
                return n + 1
        return n
    size = d * d + e * e
    if g * g >= size:
        return n
    h, q = g / size, np.sqrt(size - g * g) / size
    first = n
    for sign in (-1.0, 1.0):
        s, k = d * h - sign * e * q, -e * h - sign * d * q
        # within the quarter turn between the ends: on the right side of both
        if s * c0 - k * s0 > 0.0 and s1 * k - c1 * s > 0.0:
            t = np.arctan2(s, k)
            if t0 < t < t1:
                roots[n, 0], roots[n, 1], roots[n, 2] = t, s, k
                n += 1
    if n - first == 2 and roots[first, 0] > roots[first + 1, 0]:
        swap(roots, first, first + 1)
    return n


@leaf
def swap(roots, i, j):
    """Two rows."""
    for k in range(3):
        roots[i, k], roots[j, k] = roots[j, k], roots[i, k]


@leaf
def span(curve_round, p, d, e, t0, s0, c0, t1, s1, c1):
    """Lowest and highest value of a coordinate over t0..t1, at most a quarter turn; s, c: sin and cos of the ends."""
    if not curve_round:
        a, b = p + d * t0, p + d * t1
        return min(a, b), max(a, b)
    a, b = p + d * s0 - e * c0, p + d * s1 - e * c1
    low, high = min(a, b), max(a, b)
    da, db = d * c0 + e * s0, d * c1 + e * s1
    if da * db < 0.0:
        k = np.sqrt(d * d + e * e)
        if da > 0.0:
            high = p + k
        else:
            low = p - k
    return low, high


@leaf
def ordered(roots, first, n):
    """Sort those from `first` to below n; they are runs in order or against it."""
    for i in range(first + 1, n):
        j = i
        while j > first and roots[j - 1, 0] > roots[j, 0]:
            swap(roots, j - 1, j)
            j -= 1


@leaf
def keep(curve, t0, t1, found, row, start):
    """Add an interval of t to a row, joined to the one before it in the same piece."""
    a, b = curve.origin + curve.size * t0, curve.origin + curve.size * t1
    n = found.many[row]
    most = found.lower.shape[1]
    if start < n <= most and a - found.upper[row, n - 1] <= SHORT:
        found.upper[row, n - 1] = b
        return
    if n < most:
        found.lower[row, n] = a
        found.upper[row, n] = b
    found.many[row] = n + 1


@leaf
def blank(found, row):
    """NaN after the last interval of a row."""
    for k in range(found.many[row], found.lower.shape[1]):
        found.lower[row, k] = np.nan
        found.upper[row, k] = np.nan


@leaf
def levels(curve, floor, t0, s0, c0, t1, s1, c1, top, roots, n, found, row, start):
    """Keep what lies between floor and top of an interval over one cell; roots from n on are free for use."""
    p, d, e = curve.pz, curve.dz, curve.ez
    if curve.round:
        a, b = p + d * s0 - e * c0, p + d * s1 - e * c1
        bent = (d * c0 + e * s0) * (d * c1 + e * s1) < 0.0
    else:
        a, b = p + d * t0, p + d * t1
        bent = False
    low, high = min(a, b), max(a, b)
    if bent:
        low, high = span(1, p, d, e, t0, s0, c0, t1, s1, c1)
    if low > top + TOUCH or high < floor - TOUCH:
        return
    first, known = n, -1  # known: which interval between crossings is inside, where one is
    if high <= top and low >= floor:
        known = 0
    else:
        for side in range(2):
            n = crossings(curve.round, p, d, e, floor if side else top, t0, s0, c0, t1, s1, c1, roots, n)
            if n == first + 1 and low >= floor and not bent:
                known = 0 if a < b else 1  # the top once, as a rule: the lower end is inside
                break
        ordered(roots, first, n)
    u = t0
    for i in range(first, n + 1):
        v = roots[i, 0] if i < n else t1
        if v - u > SHORT:
            held = i - first == known
            if known < 0:
                m = 0.5 * (u + v)
                z = p + d * np.sin(m) - e * np.cos(m) if curve.round else p + d * m
                held = floor - TOUCH <= z <= top + TOUCH
            if held:
                keep(curve, u, v, found, row, start)
        u = v


@leaf
def inside(curve, stairs, t0, s0, c0, t1, s1, c1, roots, found, row, start):
    """Append to the intervals of a row those of a piece between t0 and t1 that are in the material; s, c: sin and cos of
    the ends of a round piece."""
    if not curve.round and curve.dz > 0.0:  # no need to look at walls above everything
        t1 = min(t1, (stairs.highest + 1.0 - curve.pz) / curve.dz)
    if t1 - t0 <= SHORT:
        return
    low, high = span(curve.round, curve.pz, curve.dz, curve.ez, t0, s0, c0, t1, s1, c1)
    if low > stairs.highest + TOUCH or high < stairs.floor - TOUCH:
        return
    n = 0
    for axis in range(2):
        breaks, p, d, e = stairs.x, curve.px, curve.dx, curve.ex
        if axis == 1:
            breaks, p, d, e = stairs.y, curve.py, curve.dy, curve.ey
        low, high = span(curve.round, p, d, e, t0, s0, c0, t1, s1, c1)
        last = len(breaks) - 1
        if low > breaks[last] or high < breaks[0]:
            continue
        k = cell(breaks, low)
        if breaks[k] < low:
            k += 1
        while k <= last and breaks[k] <= high:
            n = crossings(curve.round, p, d, e, breaks[k], t0, s0, c0, t1, s1, c1, roots, n)
            k += 1
    ordered(roots, 0, n)
    u, su, cu = t0, s0, c0
    for k in range(n + 1):
        v, sv, cv = t1, s1, c1
        if k < n:
            v, sv, cv = roots[k, 0], roots[k, 1], roots[k, 2]
        if v - u > SHORT:
            if curve.round:  # sin and cos of the middle, but for a factor, from those of the ends
                sm, cm = su + sv, cu + cv
                f = 1.0 / np.sqrt(sm * sm + cm * cm)
                x, y = (
                    curve.px + f * (curve.dx * sm - curve.ex * cm),
                    curve.py + f * (curve.dy * sm - curve.ey * cm),
                )
            else:
                m = 0.5 * (u + v)
                x, y = curve.px + curve.dx * m, curve.py + curve.dy * m
            top = top_at(stairs, x, y)
            if top > -np.inf:
                levels(curve, stairs.floor, u, su, cu, v, sv, cv, top, roots, n, found, row, start)
        u, su, cu = v, sv, cv


@leaf
def facing_line(p, d, t0, t1):
    """The part of t0..t1 where p + d t > 0."""
    at0, at1 = p + d * t0, p + d * t1
    if at0 <= 0.0 and at1 <= 0.0:
        return t0, t0
    if at0 > 0.0 and at1 > 0.0:
        return t0, t1
    zero = min(max(-p / d, t0), t1)
    return (zero, t1) if at1 > 0.0 else (t0, zero)


@leaf
def curve_of(piece, tip, e, w, rm, r):
    """A piece of the edge (0 disc, 1 corner, 2 cylinder) of a tip, a radial direction and an axis."""
    tx, ty, tz, ex, ey, ez, wx, wy, wz = tip[0], tip[1], tip[2], e[0], e[1], e[2], w[0], w[1], w[2]
    if piece == 0:
        return Curve(0, tx, ex, 0.0, ty, ey, 0.0, tz, ez, 0.0, -rm, 1.0)
    big = rm if piece == 1 else rm + r
    x, y, z = tx + big * ex + r * wx, ty + big * ey + r * wy, tz + big * ez + r * wz
    if piece == 1:
        return Curve(1, x, r * ex, r * wx, y, r * ey, r * wy, z, r * ez, r * wz, 0.0, r)
    return Curve(0, x, wx, 0.0, y, wy, 0.0, z, wz, 0.0, r * QUARTER, 1.0)


@leaf
def facing_part(piece, along, sink, swing, rm, r, flute, facing, idle):
    """Stretch t0, t1 of a piece where N . V > idle, each with its sin and cos where the piece is round; along, sink, swing:
    V . e_r, V . w, dw/dt . e_r."""
    if piece != 1:
        t0, t1 = 0.0, rm if piece == 0 else flute
        if facing:
            first = -sink - idle if piece == 0 else along + r * swing - idle
            t0, t1 = facing_line(first, swing, t0, t1)
        return t0, 0.0, 1.0, t1, 0.0, 1.0
    if not facing:
        return 0.0, 0.0, 1.0, QUARTER, 1.0, 0.0
    a, b = along + r * swing, sink - rm * swing
    if a > idle:
        if b > 0.0:
            f = 1.0 / np.sqrt(a * a + b * b)
            return np.arctan2(b, a), b * f, a * f, QUARTER, 1.0, 0.0
        return 0.0, 0.0, 1.0, QUARTER, 1.0, 0.0
    if b < -idle:
        a = max(-a, 0.0)
        f = 1.0 / np.sqrt(a * a + b * b)
        return 0.0, 0.0, 1.0, np.arctan2(-b, a), -b * f, a * f
    return 0.0, 0.0, 1.0, 0.0, 0.0, 1.0


@kernel
def engaged(moves, sin, cos, rm, r, flute, facing, bottom, idle, stairs, found) -> None:
    """Engaged intervals at every position and rotation angle; sin, cos (1 or n, m) of phi. Row: i * m + j."""
    tip, frame, velocity, rate = moves.tip, moves.frame, moves.velocity, moves.axis_rate
    roots = np.empty((2 * (len(stairs.x) + len(stairs.y)) + 8, 3))
    m = sin.shape[1]
    for i in range(len(tip)):
        own = i if len(sin) > 1 else 0
        vx, vy, vz = velocity[i, 0], velocity[i, 1], velocity[i, 2]
        gx, gy, gz = rate[i, 0], rate[i, 1], rate[i, 2]
        m00, m10, m20 = frame[i, 0, 0], frame[i, 1, 0], frame[i, 2, 0]
        m01, m11, m21 = frame[i, 0, 1], frame[i, 1, 1], frame[i, 2, 1]
        wx, wy, wz = frame[i, 0, 2], frame[i, 1, 2], frame[i, 2, 2]
        none = idle * np.sqrt(vx * vx + vy * vy + vz * vz)
        sink = vx * wx + vy * wy + vz * wz
        for j in range(m):
            s, c = sin[own, j], cos[own, j]
            ex, ey, ez = s * m00 + c * m01, s * m10 + c * m11, s * m20 + c * m21
            along, swing = vx * ex + vy * ey + vz * ez, gx * ex + gy * ey + gz * ez
            row = i * m + j
            for piece in range(3):
                if (piece == 0 and (rm == 0.0 or not bottom)) or (piece == 1 and r == 0.0):
                    continue
                t0, s0, c0, t1, s1, c1 = facing_part(piece, along, sink, swing, rm, r, flute, facing, none)
                if t1 - t0 > SHORT:
                    curve = curve_of(piece, tip[i], (ex, ey, ez), (wx, wy, wz), rm, r)
                    inside(curve, stairs, t0, s0, c0, t1, s1, c1, roots, found, row, found.many[row])
            blank(found, row)


@kernel
def clipped(tip, e_r, axis, rm, r, piece, lower, upper, stairs, found) -> None:
    """Parts of the edge that are in the material: row k from s lower[k] to upper[k] of piece[k] (see `curve_of`) of the
    edge that points to e_r[k]; tip and axis are those of all."""
    roots = np.empty((2 * (len(stairs.x) + len(stairs.y)) + 8, 3))
    for k in range(len(piece)):
        curve = curve_of(piece[k], tip, e_r[k], axis, rm, r)
        t0, t1 = (lower[k] - curve.origin) / curve.size, (upper[k] - curve.origin) / curve.size
        s0, c0, s1, c1 = 0.0, 1.0, 0.0, 1.0
        if curve.round:
            s0, c0, s1, c1 = np.sin(t0), np.cos(t0), np.sin(t1), np.cos(t1)
        inside(curve, stairs, t0, s0, c0, t1, s1, c1, roots, found, k, 0)
        blank(found, k)
