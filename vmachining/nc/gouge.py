"""Whether a piece of a compensated path comes too near to a neighbouring programmed segment.

Corners are trimmed where two segments meet; a segment that curls back, or an entry from the wrong side, cuts into
its neighbour elsewhere. Between two lines the distance is exact. Where one of them is an arc, distances are exact for
points; the path is looked at in `SAMPLES` points per quarter of a circle or per line, so a cut shallower than the sag
between them can go unnoticed, and nothing else can be reported.
"""

from __future__ import annotations

import math
from typing import Final

from vmachining.nc.model import Motion, Move
from vmachining.nc.offset_curves import Curve, Pair

SAMPLES: Final = 12
SHALLOW_MM: Final = 1e-3
"""Nearer than the tool radius by less than this is rounding of printed coordinates."""

ARCS: Final = frozenset({Motion.ARC_CW, Motion.ARC_CCW})


def cuts_into(curve: Curve, neighbour: Move, axes: tuple[int, int, int], radius: float) -> bool:
    """Whether the tool on `curve` reaches over the programmed path of a neighbour.

    curve : path of the tool centre, final.
    axes : of the plane: first, second, normal.
    radius : mm, of the tool.
    """
    limit = radius - SHALLOW_MM
    a = neighbour.start[axes[0]], neighbour.start[axes[1]]
    b = neighbour.end[axes[0]], neighbour.end[axes[1]]
    if curve.center is None and neighbour.center is None:
        return limit > 0.0 and _within(curve.start, curve.end, a, b, limit * limit)
    return any(_distance(point, a, b, neighbour) < limit for point in _points(curve))


def _within(p: Pair, q: Pair, a: Pair, b: Pair, square: float) -> bool:
    """Whether two straight segments cross, or an end of one lies nearer to the other than the root of `square`."""
    px, py, ax, ay = *p, *a
    ux, uy, vx, vy = q[0] - px, q[1] - py, b[0] - ax, b[1] - ay
    wx, wy = ax - px, ay - py
    turn = ux * vy - uy * vx
    if turn and 0.0 <= (wx * vy - wy * vx) / turn <= 1.0 and 0.0 <= (wx * uy - wy * ux) / turn <= 1.0:
        return True
    uu, vv = ux * ux + uy * uy or 1.0, vx * vx + vy * vy or 1.0
    # ends p and q from the segment a b, then a and b from p q
    for x, y, dx, dy, length in ((-wx, -wy, vx, vy, vv), (ux - wx, uy - wy, vx, vy, vv), (wx, wy, ux, uy, uu),
                                 (wx + vx, wy + vy, ux, uy, uu)):  # fmt: skip
        t = (x * dx + y * dy) / length
        t = 0.0 if t < 0.0 else 1.0 if t > 1.0 else t
        x, y = x - t * dx, y - t * dy
        if x * x + y * y < square:
            return True
    return False


def _points(curve: Curve) -> list[Pair]:
    p, q = curve.start, curve.end
    if curve.center is None:
        steps = [k / SAMPLES for k in range(SAMPLES + 1)]
        return [(p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])) for t in steps]
    c, count = curve.center, max(SAMPLES, math.ceil(min(curve.sweep, math.tau) / (math.pi / 2) * SAMPLES))
    radius, begin = math.dist(p, c), math.atan2(p[1] - c[1], p[0] - c[0])
    step = (curve.sweep if curve.ccw else -curve.sweep) / count
    angles = [begin + k * step for k in range(count + 1)]
    return [(c[0] + radius * math.cos(t), c[1] + radius * math.sin(t)) for t in angles]


def _distance(point: Pair, a: Pair, b: Pair, move: Move) -> float:
    """From a point to a programmed line or arc."""
    if move.motion not in ARCS or move.center is None:
        length = math.dist(a, b) or 1.0
        t = ((point[0] - a[0]) * (b[0] - a[0]) + (point[1] - a[1]) * (b[1] - a[1])) / length**2
        t = min(1.0, max(0.0, t))
        return math.dist(point, (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])))
    c, sense = move.center, 1.0 if move.motion is Motion.ARC_CCW else -1.0
    begin = math.atan2(a[1] - c[1], a[0] - c[0])
    sweep = (sense * (math.atan2(b[1] - c[1], b[0] - c[0]) - begin)) % math.tau
    if move.turns > 1 or math.dist(a, b) < 1e-9:
        sweep = math.tau
    here = (sense * (math.atan2(point[1] - c[1], point[0] - c[0]) - begin)) % math.tau
    if here <= sweep:
        return abs(math.dist(point, c) - math.dist(a, c))
    return min(math.dist(point, a), math.dist(point, b))
