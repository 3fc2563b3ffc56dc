"""Programmed circles: from end, centre words or radius word to a centre.

Points here are pairs (a, b) in the axis order of the plane, mm. ccw: seen from the positive end of the third
axis.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple, TypeAlias

from vmachining.nc.model import ArcError
from vmachining.tolerance import ARC_RADIUS_MM, LENGTH_EPS_MM

Pair: TypeAlias = tuple[float, float]


class Plane(NamedTuple):
    """Name, first, second and normal axis (0 X, 1 Y, 2 Z), centre words of the two, the wrong centre word."""

    name: str
    first: int
    second: int
    normal: int
    words: tuple[str, str]
    wrong: str


PLANES: Final = {
    170: Plane("xy", 0, 1, 2, ("I", "J"), "K"),
    180: Plane("zx", 2, 0, 1, ("K", "I"), "J"),
    190: Plane("yz", 1, 2, 0, ("J", "K"), "I"),
}
"""By ten times the G code. ZX and not XZ: right-handed about +Y."""

RADIUS_ABSOLUTE_MM: Final = {False: 0.02 * math.sqrt(2.0), True: 0.002 * 25.4 * math.sqrt(2.0)}
"""Difference of the two radii that is always accepted; by whether the program is in inches. From the open
reference control: end point and centre are each rounded to 0.01 mm (0.001 inch), in both coordinates."""

RADIUS_RELATIVE: Final = 0.001
"""Beyond the absolute limit a difference up to this part of the radius is accepted, up to 100 such limits."""

SNAP_MM: Final = 0.002
"""A radius word may be shorter than half the chord by this much: two roundings to 0.001 mm."""


def center_from_radius(start: Pair, end: Pair, radius: float, ccw: bool) -> Pair:
    """Centre of the arc with the radius word: positive up to half a circle, negative beyond.

    h = sqrt(R^2 - d^2/4) from the middle of the chord along its left normal, on the left for a
    counter-clockwise minor arc.

    Raises ArcError: E305 radius shorter than half the chord, E306 start and end are one point.
    """
    da, db = end[0] - start[0], end[1] - start[1]
    chord = math.hypot(da, db)
    if chord < LENGTH_EPS_MM:
        raise ArcError("E306", "a full circle has no unique centre in the R form")
    half = chord / 2.0
    if abs(radius) < half - SNAP_MM:
        raise ArcError("E305", f"radius {abs(radius):.6g} mm is shorter than half the chord, {half:.6g} mm")
    height = math.sqrt(max(0.0, radius * radius - half * half))
    if (radius > 0.0) != ccw:
        height = -height
    middle = (start[0] + end[0]) / 2.0, (start[1] + end[1]) / 2.0
    return middle[0] - height * db / chord, middle[1] + height * da / chord


def check_center(start: Pair, end: Pair, center: Pair, inch: bool) -> float:
    """Difference of start and end radius, mm, if it is within the limits.

    Raises ArcError: E304 the radii differ, E308 the start is the centre.
    """
    begin = math.hypot(start[0] - center[0], start[1] - center[1])
    finish = math.hypot(end[0] - center[0], end[1] - center[1])
    if begin < LENGTH_EPS_MM:
        raise ArcError("E308", "the arc starts on its own centre")
    difference = abs(begin - finish)
    limit = RADIUS_ABSOLUTE_MM[inch]
    if difference > max(limit, min(100.0 * limit, RADIUS_RELATIVE * max(begin, finish))):
        raise ArcError("E304", f"radius {begin:.6g} mm at the start, {finish:.6g} mm at the end")
    return difference


def is_rounded(difference: float) -> bool:
    """Whether a difference of radii that is accepted deserves a warning."""
    return difference > ARC_RADIUS_MM


def arc_length(start: Pair, end: Pair, center: Pair, ccw: bool, turns: int, rise: float) -> float:
    """Length of the circle or helix, mm."""
    radius = math.hypot(start[0] - center[0], start[1] - center[1])
    angle = math.tau
    if math.hypot(end[0] - start[0], end[1] - start[1]) >= LENGTH_EPS_MM:
        begin = math.atan2(start[1] - center[1], start[0] - center[0])
        finish = math.atan2(end[1] - center[1], end[0] - center[0])
        angle = (finish - begin if ccw else begin - finish) % math.tau
    return math.hypot(radius * (angle + math.tau * (turns - 1)), rise)
