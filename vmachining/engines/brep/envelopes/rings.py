"""Faces, sharp edges and the circles between them, of a cutter from the bottom up.

A `Ring` is a circle where two faces of the body meet, with the normal of one of them: a sharp edge has two. The
tip of a cone is one too, without radius: a curve on one side of the cone continues from it on the other side.
"""

from __future__ import annotations

from typing import NamedTuple

from vmachining.engines.brep.occt.tolerances import FLAT_MM, SAME_ANGLE_RAD
from vmachining.engines.brep.translations.caps import Tool
from vmachining.errors import SweepError
from vmachining.tool import Segment


class Ring(NamedTuple):
    """Circle of the body with a normal. joint : of the tool. disc : whether it bounds a disc: -1 below, 1 above."""

    joint: int
    r: float
    z: float
    beta: float
    disc: int


class Element(NamedTuple):
    """A face (disc, line, arc) or a sharp edge of the body; rings below and above, None at the axis.

    segment : of a line or an arc, with its number; of an edge and a disc: radius and height in r0, z0.
    """

    kind: str
    segment: Segment
    number: int
    lower: int | None
    upper: int | None


def rings_of(tool: Tool) -> tuple[list[Ring], list[Element]]:
    """Rings and elements from the bottom up; faces and sharp edges take turns."""
    rings: list[Ring] = []
    elements: list[Element] = []
    nan, n = float("nan"), len(tool.segments)
    below: int | None = None
    for k in range(n + 1):
        r, z = tool.joints[k].tolist()
        spot = Segment(r, z, r, z, nan, nan, 0.0)
        first = len(rings)
        if r > FLAT_MM:
            low, high = tool.normal_angles(k)
            if high < low - SAME_ANGLE_RAD:
                raise SweepError("a tool that is not convex is swept in convex pieces")
            rings.append(Ring(k, r, z, low, -1 if k == 0 else 0))
            if high > low + SAME_ANGLE_RAD:
                rings.append(Ring(k, r, z, high, 1 if k == n else 0))
            elif k == n:
                rings[-1] = rings[-1]._replace(disc=1)
        elif k == 0 and not tool.segments[0].is_arc and tool.segments[0].z1 > z:
            rings.append(Ring(k, 0.0, z, tool.normal_angles(k)[1], 0))
        upper = first if len(rings) > first else None
        if k == 0:
            if upper is not None and r > FLAT_MM:
                elements.append(Element("disc", spot, -1, None, upper))
        else:
            s = tool.segments[k - 1]
            elements.append(Element("arc" if s.is_arc else "line", s, k - 1, below, upper))
        if len(rings) == first + 2:
            elements.append(Element("edge", spot, k, first, first + 1))
        below = len(rings) - 1 if upper is not None else None
        if k == n and below is not None:
            elements.append(Element("disc", spot, n, below, None))
    return rings, elements
