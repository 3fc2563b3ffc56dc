"""Sweeps that are bodies of revolution: plunges, retracts, a tool at rest, full circles.

The meridian is drawn as one closed run of edges in the half plane of the axis and turned once; its surfaces are
planes, cylinders, cones, balls and tori by construction.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep.occt.primitives import revolved
from vmachining.engines.brep.occt.shapes import Curve, Straight
from vmachining.engines.brep.translations.caps import UP, Tool, meridian_curve
from vmachining.tool import Profile

OUT = np.array([1.0, 0.0, 0.0])


def plunged(profile: Profile, center: Floats) -> Any:
    """TopoDS_Solid of a profile about the upright axis through `center` (z = 0 of the profile there)."""
    return ring(profile, center, 0.0)


def ring(profile: Profile, center: Floats, radius: float) -> Any:
    """What a profile leaves that runs a full circle of this radius; the centre may lie in the tool."""
    tool = Tool.of(profile, radius or None)
    outer: list[Curve] = [meridian_curve(center + radius * OUT, OUT, s) for s in tool.segments]
    inner: list[Curve] = []
    if radius > 0.0:
        for s in tool.segments:
            middle = 0.5 * (s.r0 + s.r1) if not s.is_arc else s.cr + s.radius * np.cos(0.5 * sum(s.beta))
            if s.z0 == s.z1:
                r0, r1 = (max(radius - r, 0.0) for r in (s.r0, s.r1))
                if r0 != r1:
                    inner.append(Straight(center + r0 * OUT + s.z0 * UP, center + r1 * OUT + s.z0 * UP))
            elif middle >= radius:
                inner.append(Straight(center + s.z0 * UP, center + s.z1 * UP))
            else:
                inner.append(meridian_curve(center + radius * OUT, -OUT, s))
    else:
        z = tool.joints[[0, -1], 1]
        inner.append(Straight(center + z[0] * UP, center + z[1] * UP))
    curves = [*outer, *_bridge(outer[-1].ends[1], inner[-1].ends[1])]
    curves += [*inner[::-1], *_bridge(inner[0].ends[0], outer[0].ends[0])]
    return revolved(curves, center)


def _bridge(a: Floats, b: Floats) -> list[Curve]:
    return [Straight(a, b)] if np.abs(a - b).max() > 1e-9 else []
