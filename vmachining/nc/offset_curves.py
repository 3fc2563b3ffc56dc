"""Curves beside programmed lines and arcs, and where two of them meet. Everything in one plane, mm.

Legend: sigma +1 tool left of the path (G41), -1 right; rho tool radius; t unit tangent; n = (-t_y, t_x) left
normal. A line moves by sigma rho n, an arc of radius R gets R - sigma rho if counter-clockwise, else
R + sigma rho.

Corners that controls put in between two programmed segments:

rounding r : an arc tangent to both; its centre is where the curves next to them at distance r meet, on the side to
             which the path turns, and touches each at the foot of that centre
chamfer c  : both are shortened by c, measured along them from the corner, and joined by a line (lines only)

Gouges: corners of a compensated path are trimmed where two segments meet; a segment that curls back, or an entry from the
wrong side, cuts into its neighbour elsewhere. Between two lines the distance is exact. Where one of them is an arc, distances
are exact for points; the path is looked at in `SAMPLES` points per quarter of a circle or per line, so a cut shallower than
the sag between them can go unnoticed, and nothing else can be reported.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple, TypeAlias

from vmachining.nc.frames import Plane, swept
from vmachining.nc.model import CompensationError, CornerError, Motion, Move, add, put, subtract

Pair: TypeAlias = tuple[float, float]

FORWARD_MM: Final = 1e-9
"""What is left of a trimmed piece must be longer than this, in the programmed direction."""


class Curve(NamedTuple):
    """Path of the tool centre beside one programmed segment.

    start, end : of the centre. first, last : unit tangents there (of the programmed segment).
    corner : programmed end. center : arcs only. sweep : rad, positive, turns included; 0 for lines.
    """

    start: Pair
    end: Pair
    first: Pair
    last: Pair
    corner: Pair
    center: Pair | None = None
    ccw: bool = False
    sweep: float = 0.0


def offset_line(start: Pair, end: Pair, shift: float) -> Curve:
    """shift : sigma rho."""
    length = math.dist(start, end)
    t = (end[0] - start[0]) / length, (end[1] - start[1]) / length
    aside = -shift * t[1], shift * t[0]
    first, last = ((p[0] + aside[0], p[1] + aside[1]) for p in (start, end))
    return Curve(first, last, t, t, end)


def offset_arc(start: Pair, end: Pair, center: Pair, ccw: bool, turns: int, shift: float) -> Curve:
    """Concentric arc.

    Raises CompensationError: E354 the tool does not fit into the arc.
    """
    radius = math.dist(start, center)
    toward = shift if ccw else -shift
    if radius - toward <= FORWARD_MM:
        what = f"the arc radius {radius:.6g} mm is not greater than the tool radius {abs(shift):.6g} mm"
        raise CompensationError("E354", what)
    ends, tangents = [], []
    for point in (start, end):
        reach = math.dist(point, center) or radius
        out = (point[0] - center[0]) / reach, (point[1] - center[1]) / reach
        ends.append((point[0] - toward * out[0], point[1] - toward * out[1]))
        tangents.append((-out[1], out[0]) if ccw else (out[1], -out[0]))
    sweep = math.tau if math.dist(start, end) < FORWARD_MM else swept(start, end, center, ccw)
    sweep += math.tau * (turns - 1)
    return Curve(ends[0], ends[1], tangents[0], tangents[1], end, center, ccw, sweep)


def _angle(point: Pair, center: Pair) -> float:
    return math.atan2(point[1] - center[1], point[0] - center[0])


def _advance(curve: Curve, start: Pair, end: Pair) -> float:
    """Angle from one point to another in the direction of travel, in (-pi, pi]."""
    assert curve.center is not None
    angle = _angle(end, curve.center) - _angle(start, curve.center)
    return math.remainder(angle if curve.ccw else -angle, math.tau)


def trimmed(curve: Curve, *, start: Pair | None = None, end: Pair | None = None) -> Curve | None:
    """The curve with another start or end on it; None where nothing would be left, or it would run backwards."""
    p, q, sweep, t = start or curve.start, end or curve.end, curve.sweep, curve.first
    if curve.center is None:
        left = (q[0] - p[0]) * t[0] + (q[1] - p[1]) * t[1]
    else:
        sweep -= _advance(curve, curve.start, start) if start else -_advance(curve, curve.end, q)
        left = sweep * math.dist(curve.start, curve.center)
    return curve._replace(start=p, end=q, sweep=sweep) if left > FORWARD_MM else None


def meet(before: Curve, after: Curve) -> Pair | None:
    """Where the end of one curve crosses the start of the next: nearest to the programmed corner.

    A crossing that makes both curves shorter comes before one that makes one of them longer. Where the radii at
    the ends of an arc differ, because its words are rounded, the one at its end counts, as in LinuxCNC.
    """
    one, two = before.center, after.center
    r1, r2 = (math.dist(curve.end, curve.center or curve.end) for curve in (before, after))
    if one is not None and two is not None:
        found = _circles(one, r1, two, r2)
    elif two is not None:
        found = _line_circle(before.end, before.last, two, r2)
    elif one is not None:
        found = _line_circle(after.start, after.first, one, r1)
    else:
        found = _lines(before.end, before.last, after.start, after.first)

    def rank(point: Pair) -> tuple[bool, float]:
        past = _ahead(before, before.end, before.last, point)
        shortens = past <= FORWARD_MM and _ahead(after, after.start, after.first, point) >= -FORWARD_MM
        return not shortens, math.dist(point, before.corner)

    return min(found, key=rank, default=None)


def _ahead(curve: Curve, origin: Pair, t: Pair, point: Pair) -> float:
    if curve.center is not None:
        return _advance(curve, origin, point)
    return (point[0] - origin[0]) * t[0] + (point[1] - origin[1]) * t[1]


def _lines(p: Pair, t: Pair, q: Pair, u: Pair) -> list[Pair]:
    cross = t[0] * u[1] - t[1] * u[0]
    if abs(cross) < 1e-15:
        return []
    s = ((q[0] - p[0]) * u[1] - (q[1] - p[1]) * u[0]) / cross
    return [(p[0] + s * t[0], p[1] + s * t[1])]


def _line_circle(q: Pair, t: Pair, center: Pair, radius: float) -> list[Pair]:
    """q + s t with s = -b +- sqrt(b^2 - |q - c|^2 + r^2), b = (q - c) . t; the root from the distance of the line."""
    dx, dy = q[0] - center[0], q[1] - center[1]
    b = dx * t[0] + dy * t[1]
    aside = dx * t[1] - dy * t[0]
    square = (radius - aside) * (radius + aside)
    if square < 0.0:
        if abs(aside) - radius > FORWARD_MM:
            return []
        square = 0.0
    root = math.sqrt(square)
    return [(q[0] + s * t[0], q[1] + s * t[1]) for s in (-b - root, -b + root)]


def _circles(c1: Pair, r1: float, c2: Pair, r2: float) -> list[Pair]:
    d = math.dist(c1, c2)
    if d < FORWARD_MM:
        return []
    e = (c2[0] - c1[0]) / d, (c2[1] - c1[1]) / d
    x = (d * d + (r1 - r2) * (r1 + r2)) / (2.0 * d)
    square = (r1 - x) * (r1 + x)
    if square < 0.0:
        if abs(x) - r1 > FORWARD_MM:
            return []
        square = 0.0
    y = math.sqrt(square)
    foot = c1[0] + x * e[0], c1[1] + x * e[1]
    return [(foot[0] - s * e[1], foot[1] + s * e[0]) for s in (-y, y)]


class Segment(NamedTuple):
    """A line, or an arc with its centre; ends in the axis order of the plane, mm."""

    start: Pair
    end: Pair
    center: Pair | None = None
    ccw: bool = False
    turns: int = 0


def segment(move: Move, plane: Plane) -> Segment:
    """What a move is in its plane."""
    a, b = plane.first, plane.second
    return Segment(
        (move.start[a], move.start[b]), (move.end[a], move.end[b]), move.center, move.motion is Motion.ARC_CCW, move.turns
    )  # fmt: skip


def joined(
    held: Move, move: Move, plane: Plane, kind: str, size: float, feed: float | None = None
) -> tuple[Move, Move, Move] | None:
    """Two moves shortened, and the "round"ing, "chamfer" or "bevel" (its own length given) between; None: they are tangent.

    Raises CornerError: It does not fit.
    """
    one, two = segment(held, plane), segment(move, plane)
    if kind == "bevel":
        size, kind = bevel_sides(one, two, size), "chamfer"
    made = rounding(one, two, size) if kind == "round" else chamfer(one, two, size)
    if made is None:
        return None
    first, joint, rest = made
    motion = Motion.LINEAR if joint.center is None else Motion.ARC_CCW if joint.ccw else Motion.ARC_CW
    between = held._replace(
        motion=motion, center=joint.center, turns=joint.turns, rotary_deg=None,
        feed_mm_min=feed or move.feed_mm_min or held.feed_mm_min,
    )  # fmt: skip
    level = held.end[plane.normal]
    middle = _put(between, plane, joint.start, joint.end, level)
    return _put(held, plane, end=first.end), middle, _put(move, plane, rest.start)


def _put(
    move: Move, plane: Plane, start: Pair | None = None, end: Pair | None = None, level: float | None = None
) -> Move:
    """The move with other ends in the plane; level : of both along the normal."""
    high = {} if level is None else {plane.normal: level}
    out = [
        put(point, high if pair is None else {plane.first: pair[0], plane.second: pair[1], **high})
        for pair, point in ((start, move.start), (end, move.end))
    ]
    aside = subtract(out[1], move.end)
    return move._replace(
        start=out[0], end=out[1],
        end_machine=add(move.end_machine, aside), end_program=add(move.end_program, aside),
    )  # fmt: skip


def tangents(item: Segment) -> tuple[Pair, Pair]:
    """Unit tangents at start and end."""
    if item.center is None:
        length = math.dist(item.start, item.end) or 1.0
        t = (item.end[0] - item.start[0]) / length, (item.end[1] - item.start[1]) / length
        return t, t
    out = []
    for point in (item.start, item.end):
        reach = math.dist(point, item.center) or 1.0
        u = (point[0] - item.center[0]) / reach, (point[1] - item.center[1]) / reach
        out.append((-u[1], u[0]) if item.ccw else (u[1], -u[0]))
    return out[0], out[1]


def rounding(before: Segment, after: Segment, radius: float) -> tuple[Segment, Segment, Segment] | None:
    """The two segments shortened, and the arc between them; None where they are tangent.

    Raises CornerError: The arc does not fit.
    """
    t1, t2 = tangents(before)[1], tangents(after)[0]
    turn = t1[0] * t2[1] - t1[1] * t2[0]
    if abs(turn) < 1e-9:
        if t1[0] * t2[0] + t1[1] * t2[1] > 0.0:
            return None
        raise CornerError("the path turns back: no rounding fits there")
    side = math.copysign(radius, turn)
    try:
        first, second = _beside(before, side), _beside(after, side)
    except CompensationError as exc:  # the arc is smaller than the rounding
        raise CornerError(f"a rounding of {radius:g} mm does not fit: {exc}") from None
    center = meet(first, second)
    if center is None:
        raise CornerError(f"a rounding of {radius:g} mm does not fit between the two")
    one, two = _foot(before, center), _foot(after, center)
    cut, rest = before._replace(end=one), after._replace(start=two)
    if not (_lies_on(before, one) and _lies_on(after, two)):
        raise CornerError(f"a rounding of {radius:g} mm is longer than what it joins")
    return cut, Segment(one, two, center, turn > 0.0, 1), rest


def chamfer(before: Segment, after: Segment, length: float) -> tuple[Segment, Segment, Segment]:
    """The two lines shortened by `length`, and the line between them.

    Raises CornerError: An arc, or a line that is shorter.
    """
    if before.center is not None or after.center is not None:
        raise CornerError("a chamfer lies between two lines")
    t1, t2 = tangents(before)[1], tangents(after)[0]
    if length >= math.dist(before.start, before.end) or length >= math.dist(after.start, after.end):
        raise CornerError(f"a chamfer of {length:g} mm is longer than what it joins")
    one = before.end[0] - length * t1[0], before.end[1] - length * t1[1]
    two = after.start[0] + length * t2[0], after.start[1] + length * t2[1]
    return before._replace(end=one), Segment(one, two), after._replace(start=two)


def bevel_sides(before: Segment, after: Segment, length: float) -> float:
    """How much both lines are shortened by a chamfer that is itself `length` long: c = l / (2 cos(turn / 2))."""
    t1, t2 = tangents(before)[1], tangents(after)[0]
    turn = math.atan2(t1[0] * t2[1] - t1[1] * t2[0], t1[0] * t2[0] + t1[1] * t2[1])
    half = math.cos(turn / 2.0)
    if half < 1e-9:
        raise CornerError("the path turns back: no chamfer fits there")
    return length / (2.0 * half)


def _beside(item: Segment, shift: float):  # type: ignore[no-untyped-def]
    if item.center is None:
        return offset_line(item.start, item.end, shift)
    return offset_arc(item.start, item.end, item.center, item.ccw, item.turns or 1, shift)


def _along(item: Segment, point: Pair) -> tuple[Pair, float]:
    """Tangent of a line, and how far along it a point lies from its start."""
    t = tangents(item)[0]
    return t, (point[0] - item.start[0]) * t[0] + (point[1] - item.start[1]) * t[1]


def _foot(item: Segment, point: Pair) -> Pair:
    if item.center is None:
        t, s = _along(item, point)
        return item.start[0] + s * t[0], item.start[1] + s * t[1]
    r = math.dist(item.end, item.center)
    away = math.dist(point, item.center) or 1.0
    u = (point[0] - item.center[0]) / away, (point[1] - item.center[1]) / away
    return item.center[0] + r * u[0], item.center[1] + r * u[1]


def _lies_on(item: Segment, point: Pair) -> bool:
    if item.center is None:
        return 0.0 <= _along(item, point)[1] <= math.dist(item.start, item.end)
    passed, whole = (swept(item.start, place, item.center, item.ccw) for place in (point, item.end))
    return passed <= (whole or math.tau) + 1e-9


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
    c, ccw = move.center, move.motion is Motion.ARC_CCW
    sweep = math.tau if move.turns > 1 or math.dist(a, b) < 1e-9 else swept(a, b, c, ccw)
    if swept(a, point, c, ccw) <= sweep:
        return abs(math.dist(point, c) - math.dist(a, c))
    return min(math.dist(point, a), math.dist(point, b))
