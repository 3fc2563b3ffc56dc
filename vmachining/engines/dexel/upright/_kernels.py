# Lower surfaces of sweeps of upright tools over points, and what is left above them.
#
# Legend: ways (n, 9): kind, then of a line: start x y z, travel x y z, 0, 0; of an arc: centre x y, radius, angle at its start,
#   angle (at most a quarter of a turn where it rises; a full turn at most), height at its start, rise, 0. tool (n,): number.
#   boxes (n, 5) mm: low x y, high x y, lowest place. tools (k, 5): first segment, how many, radius of the flat bottom, height of
#   the bottom, largest radius; negative: a ball. segments (m, 7): r0 z0 r1 z1, centre r z, radius (0: a line), radii rising.
# Heights: f(x, y) = min over t of z(t) + phi(rho(t)), rho the distance from the axis and phi the lower surface of the tool,
#   convex; endless upwards, so what is above f is gone.

import numpy as np

from vmachining.jit import kernel, leaf
from vmachining.sweep.ball._kernels import ball_below, travel

LINE, ARC = 0.0, 1.0

HALVINGS = 32
"""Of a bracket of t: 2e-10 of a block."""

LOOKS = 9
"""At a quarter of a helix before its best part is divided: half a turn has two minima at most."""

BEYOND = 1e9
"""mm: a height that no tool has."""

TOGETHER = 32
"""Places that are lowered together."""

GOLDEN = 0.3819660112501051


@leaf
def lower(tools, segments, k, rho):
    """phi and its slope at a distance from the axis; inf beyond the tool."""
    first, count, flat = int(tools[k, 0]), int(tools[k, 1]), tools[k, 2]
    if rho <= flat:
        return tools[k, 3], 0.0
    for s in range(first, first + count):
        r0, r1 = segments[s, 0], segments[s, 2]
        if rho <= r1 and r1 > r0:
            if segments[s, 6] > 0.0:
                off, radius = rho - segments[s, 4], segments[s, 6]
                root = np.sqrt(max(radius * radius - off * off, 0.0))
                return segments[s, 5] - root, off / max(root, 1e-300)
            slope = (segments[s, 3] - segments[s, 1]) / (r1 - r0)
            return segments[s, 1] + (rho - r0) * slope, slope
    return np.inf, np.inf


@leaf
def over_line(ways, j, tools, segments, k, x, y):
    """f of a line."""
    px, py, pz = ways[j, 1], ways[j, 2], ways[j, 3]
    dx, dy, dz = ways[j, 4], ways[j, 5], ways[j, 6]
    wide = abs(tools[k, 4])
    qx, qy, run2 = x - px, y - py, dx * dx + dy * dy
    if run2 == 0.0:
        rho = np.sqrt(qx * qx + qy * qy)
        return np.inf if rho > wide else pz + min(0.0, dz) + lower(tools, segments, k, rho)[0]
    u = (qx * dx + qy * dy) / run2  # place along the line, as a share
    v2 = max(qx * qx + qy * qy - u * u * run2, 0.0)
    if v2 >= wide * wide:
        return np.inf
    if dz == 0.0:
        s = min(max(u, 0.0), 1.0)
        rho = np.sqrt(v2 + (u - s) * (u - s) * run2)
        return np.inf if rho > wide else pz + lower(tools, segments, k, rho)[0]
    half = np.sqrt((wide * wide - v2) / run2)
    a, b = max(u - half, 0.0), min(u + half, 1.0)
    if a >= b:
        return np.inf
    for _ in range(HALVINGS):
        s = 0.5 * (a + b)
        rho = np.sqrt(v2 + (u - s) * (u - s) * run2)
        rise = dz + lower(tools, segments, k, rho)[1] * (s - u) * run2 / max(rho, 1e-300)
        if rise > 0.0:
            b = s
        else:
            a = s
    best = np.inf
    for s in (a, b):
        rho = np.sqrt(v2 + (u - s) * (u - s) * run2)
        best = min(best, pz + s * dz + lower(tools, segments, k, min(rho, wide))[0])
    return best


@leaf
def on_arc(ways, j, tools, segments, k, d, ahead, share):
    """Height over a point at distance d from the centre, `ahead` (rad) of the start, with the tool at a share of the arc.

    Where the tool is not over the point, the more the farther it is: a search is led to where it is.
    """
    a, turn = ways[j, 3], ways[j, 5]
    rho = np.sqrt((d - a) * (d - a) + 4.0 * a * d * np.sin(0.5 * (share * turn - ahead)) ** 2)
    if rho > abs(tools[k, 4]):
        return BEYOND + rho
    return ways[j, 6] + share * ways[j, 7] + lower(tools, segments, k, rho)[0]


@leaf
def over_arc(ways, j, tools, segments, k, x, y):
    """f of an arc about z."""
    qx, qy, a, turn, rise = x - ways[j, 1], y - ways[j, 2], ways[j, 3], ways[j, 5], ways[j, 7]
    wide = abs(tools[k, 4])
    d = np.sqrt(qx * qx + qy * qy)
    if abs(d - a) > wide:
        return np.inf
    ahead = np.arctan2(qy, qx) - ways[j, 4]
    full = 2.0 * np.pi
    if rise == 0.0:
        inside = ahead % full if turn > 0.0 else (-ahead) % full
        if inside <= abs(turn):
            return ways[j, 6] + lower(tools, segments, k, abs(d - a))[0]
        best = on_arc(ways, j, tools, segments, k, d, ahead, 0.0)
        best = min(best, on_arc(ways, j, tools, segments, k, d, ahead, 1.0))
        return best if best < BEYOND else np.inf
    best, at = np.inf, 0
    for n in range(LOOKS):
        height = on_arc(ways, j, tools, segments, k, d, ahead, n / (LOOKS - 1.0))
        if height < best:
            best, at = height, n
    lo, hi = max(at - 1, 0) / (LOOKS - 1.0), min(at + 1, LOOKS - 1) / (LOOKS - 1.0)
    p, q = lo + GOLDEN * (hi - lo), hi - GOLDEN * (hi - lo)
    fp = on_arc(ways, j, tools, segments, k, d, ahead, p)
    fq = on_arc(ways, j, tools, segments, k, d, ahead, q)
    for _ in range(HALVINGS):
        if fp < fq:
            hi, q, fq = q, p, fp
            p = lo + GOLDEN * (hi - lo)
            fp = on_arc(ways, j, tools, segments, k, d, ahead, p)
        else:
            lo, p, fp = p, q, fq
            q = hi - GOLDEN * (hi - lo)
            fq = on_arc(ways, j, tools, segments, k, d, ahead, q)
    best = min(best, fp, fq)
    return best if best < BEYOND else np.inf


@leaf
def drop_ball(ways, j, wide, bottom, x, y, a, b, height) -> None:
    """`drop` of a ball on a line, worked on several at a time: nothing is carried from one place to the next."""
    px, py, pz = ways[j, 1], ways[j, 2], ways[j, 3] + bottom + wide
    run, e0, e1, slope, sine, fall = travel(ways[j, 4], ways[j, 5], ways[j, 6])
    pz, square = pz + fall, wide * wide
    for i in range(a, b):
        qx, qy = x[i] - px, y[i] - py
        f, _, room = ball_below(qx * e0 + qy * e1, qy * e0 - qx * e1, run, slope, sine, square)
        f = pz + f if room > 0.0 else np.inf
        height[i] = f if f < height[i] else height[i]


@leaf
def drop(ways, tool, tools, segments, j, x, y, a, b, height) -> None:
    """Lower heights a to b to way j."""
    k = tool[j]
    if ways[j, 0] == LINE and tools[k, 4] < 0.0:
        drop_ball(ways, j, -tools[k, 4], tools[k, 3], x, y, a, b, height)
        return
    for i in range(a, b):
        f = (
            over_line(ways, j, tools, segments, k, x[i], y[i])
            if ways[j, 0] == LINE
            else over_arc(ways, j, tools, segments, k, x[i], y[i])
        )
        height[i] = min(height[i], f)


@kernel
def taken(ways, tool, boxes, tools, segments, own, earlier, x, y, first, enter, leave, out) -> None:
    """mm that the ways `own` take of the stock over places (n,) after the ways `earlier`, the last of them first.

    Places that follow each other lie together. first (n + 1,): intervals of the stock over a place in enter, leave. out (n,).
    """
    low, high = np.full(len(x), np.inf), np.empty(len(x))
    for j in own:
        drop(ways, tool, tools, segments, j, x, y, 0, len(x), low)
    for i in range(len(x)):
        high[i] = leave[first[i + 1] - 1] if first[i] < first[i + 1] else -np.inf
    for a in range(0, len(x), TOGETHER):
        b = min(a + TOGETHER, len(x))
        x0, x1, y0, y1 = np.inf, -np.inf, np.inf, -np.inf
        for i in range(a, b):
            if low[i] < high[i]:
                x0, x1, y0, y1 = min(x0, x[i]), max(x1, x[i]), min(y0, y[i]), max(y1, y[i])
        for n in range(len(earlier) - 1, -1, -1):
            j = earlier[n]
            if x1 < boxes[j, 0] or x0 > boxes[j, 2] or y1 < boxes[j, 1] or y0 > boxes[j, 3]:
                continue
            drop(ways, tool, tools, segments, j, x, y, a, b, high)
            left = False
            for i in range(a, b):
                left |= low[i] < high[i]
            if not left:
                break
    for i in range(len(x)):
        out[i] = 0.0
        for m in range(first[i], first[i + 1]):
            out[i] += max(0.0, min(leave[m], high[i]) - max(enter[m], low[i]))


@kernel
def lowest(ways, tool, boxes, tools, segments, low, side, x, y, height) -> None:
    """Lower heights (n, m) to all ways, over places x, y (n, m) each in its cell of a raster from `low` (2,) with sides (2,)."""
    n, m = height.shape
    for j in range(len(ways)):
        i0 = max(0, int(np.floor((boxes[j, 0] - low[0]) / side[0])))
        i1 = min(n, int(np.floor((boxes[j, 2] - low[0]) / side[0])) + 1)
        k0 = max(0, int(np.floor((boxes[j, 1] - low[1]) / side[1])))
        k1 = min(m, int(np.floor((boxes[j, 3] - low[1]) / side[1])) + 1)
        for i in range(i0, i1):
            drop(ways, tool, tools, segments, j, x[i], y[i], k0, k1, height[i])


@kernel
def lower_all(ways, tool, tools, segments, x, y, height) -> None:
    """Lower heights (n,) over places to all ways."""
    for j in range(len(ways)):
        drop(ways, tool, tools, segments, j, x, y, 0, len(x), height)


@kernel
def left_over(height, first, enter, leave, out) -> None:
    """mm of the stock above heights (n,), see `taken`."""
    for i in range(len(height)):
        out[i] = 0.0
        for m in range(first[i], first[i + 1]):
            out[i] += max(0.0, leave[m] - max(enter[m], height[i]))
