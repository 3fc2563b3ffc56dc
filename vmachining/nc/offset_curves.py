"""Curves beside programmed lines and arcs, and where two of them meet. Everything in one plane, mm.

Legend: sigma +1 tool left of the path (G41), -1 right; rho tool radius; t unit tangent; n = (-t_y, t_x) left
normal. A line moves by sigma rho n, an arc of radius R gets R - sigma rho if counter-clockwise, else
R + sigma rho.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple, TypeAlias

from vmachining.nc.refusal import CompensationError

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
    return Curve(
        (start[0] + aside[0], start[1] + aside[1]), (end[0] + aside[0], end[1] + aside[1]), t, t, end
    )


def offset_arc(start: Pair, end: Pair, center: Pair, ccw: bool, turns: int, shift: float) -> Curve:
    """Concentric arc.

    Raises CompensationError: E354 the tool does not fit into the arc.
    """
    radius = math.dist(start, center)
    toward = shift if ccw else -shift
    if radius - toward <= FORWARD_MM:
        raise CompensationError(
            "E354", f"the arc radius {radius:.6g} mm is not greater than the tool radius {abs(shift):.6g} mm"
        )
    ends = []
    tangents = []
    for point in (start, end):
        reach = math.dist(point, center) or radius
        out = (point[0] - center[0]) / reach, (point[1] - center[1]) / reach
        ends.append((point[0] - toward * out[0], point[1] - toward * out[1]))
        tangents.append((-out[1], out[0]) if ccw else (out[1], -out[0]))
    return Curve(
        ends[0], ends[1], tangents[0], tangents[1], end, center, ccw, _sweep(start, end, center, ccw, turns)
    )


def _angle(point: Pair, center: Pair) -> float:
    return math.atan2(point[1] - center[1], point[0] - center[0])


def _sweep(start: Pair, end: Pair, center: Pair, ccw: bool, turns: int) -> float:
    angle = _angle(end, center) - _angle(start, center)
    angle = (angle if ccw else -angle) % math.tau
    if math.dist(start, end) < FORWARD_MM:
        angle = math.tau
    return angle + math.tau * (turns - 1)


def _advance(curve: Curve, start: Pair, end: Pair) -> float:
    """Angle from one point to another in the direction of travel, in (-pi, pi]."""
    assert curve.center is not None
    angle = _angle(end, curve.center) - _angle(start, curve.center)
    angle = math.remainder(angle if curve.ccw else -angle, math.tau)
    return angle


def trim_end(curve: Curve, point: Pair) -> Curve | None:
    """The curve with another end on it; None where nothing would be left, or it would run backwards."""
    if curve.center is None:
        t = curve.last
        left = (point[0] - curve.start[0]) * t[0] + (point[1] - curve.start[1]) * t[1]
        return curve._replace(end=point) if left > FORWARD_MM else None
    sweep = curve.sweep + _advance(curve, curve.end, point)
    if sweep * math.dist(curve.start, curve.center) <= FORWARD_MM:
        return None
    return curve._replace(end=point, sweep=sweep)


def trim_start(curve: Curve, point: Pair) -> Curve | None:
    """The curve with another start on it."""
    if curve.center is None:
        t = curve.first
        left = (curve.end[0] - point[0]) * t[0] + (curve.end[1] - point[1]) * t[1]
        return curve._replace(start=point) if left > FORWARD_MM else None
    sweep = curve.sweep - _advance(curve, curve.start, point)
    if sweep * math.dist(curve.start, curve.center) <= FORWARD_MM:
        return None
    return curve._replace(start=point, sweep=sweep)


def meet(before: Curve, after: Curve) -> Pair | None:
    """Where the end of one curve crosses the start of the next: nearest to the programmed corner.

    A crossing that makes both curves shorter comes before one that makes one of them longer. Where the radii at
    the ends of an arc differ, because its words are rounded, the one at its end counts, as in LinuxCNC.
    """
    near = before.corner
    if before.center is None and after.center is None:
        found = _lines(before.end, before.last, after.start, after.first)
    elif before.center is None:
        assert after.center is not None
        found = _line_circle(before.end, before.last, after.center, math.dist(after.end, after.center))
    elif after.center is None:
        found = _line_circle(after.start, after.first, before.center, math.dist(before.end, before.center))
    else:
        found = _circles(
            before.center,
            math.dist(before.end, before.center),
            after.center,
            math.dist(after.end, after.center),
        )
    return min(
        found, key=lambda point: (not _shortens(before, after, point), math.dist(point, near)), default=None
    )


def _shortens(before: Curve, after: Curve, point: Pair) -> bool:
    """Whether a common point lies before the end of one curve and after the start of the other."""
    past = _ahead(before, before.end, before.last, point)
    return past <= FORWARD_MM and _ahead(after, after.start, after.first, point) >= -FORWARD_MM


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
