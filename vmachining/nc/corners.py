"""Roundings and chamfers between two programmed segments of one plane, as controls put them in.

rounding r : an arc tangent to both; its centre is where the curves next to them at distance r meet, on the side to
             which the path turns, and touches each at the foot of that centre
chamfer c  : both are shortened by c, measured along them from the corner, and joined by a line (lines only)
"""

from __future__ import annotations

import math
from typing import NamedTuple

from vmachining.nc.arcs import Plane
from vmachining.nc.model import Motion, Move
from vmachining.nc.offset_curves import Pair, meet, offset_arc, offset_line
from vmachining.nc.refusal import CompensationError, CornerError
from vmachining.nc.vectors import add, put, subtract


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
    return (
        _put(held, plane, end=first.end),
        _put(between, plane, joint.start, joint.end, level),
        _put(move, plane, rest.start),
    )


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
    if not (_within(before, one) and _within(after, two)):
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


def _foot(item: Segment, point: Pair) -> Pair:
    if item.center is None:
        t = tangents(item)[0]
        s = (point[0] - item.start[0]) * t[0] + (point[1] - item.start[1]) * t[1]
        return item.start[0] + s * t[0], item.start[1] + s * t[1]
    r = math.dist(item.end, item.center)
    away = math.dist(point, item.center) or 1.0
    sign = 1.0
    u = sign * (point[0] - item.center[0]) / away, sign * (point[1] - item.center[1]) / away
    return item.center[0] + r * u[0], item.center[1] + r * u[1]


def _within(item: Segment, point: Pair) -> bool:
    if item.center is None:
        t = tangents(item)[0]
        s = (point[0] - item.start[0]) * t[0] + (point[1] - item.start[1]) * t[1]
        return 0.0 <= s <= math.dist(item.start, item.end)
    whole = _sweep(item, item.end) or math.tau
    return _sweep(item, point) <= whole + 1e-9


def _sweep(item: Segment, point: Pair) -> float:
    assert item.center is not None
    a = math.atan2(point[1] - item.center[1], point[0] - item.center[0])
    b = math.atan2(item.start[1] - item.center[1], item.start[0] - item.center[0])
    return (a - b if item.ccw else b - a) % math.tau
