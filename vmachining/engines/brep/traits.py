"""What the ladder has to know of a sweep: whether it winds, where its sections change, and the same one a little larger."""

from __future__ import annotations

import numpy as np

from vmachining.geometry import Arc, Line
from vmachining.sweep import Sweep

__all__ = ["GROWTH_MM", "grown", "is_helix", "is_wound", "levels", "moved_area"]

GROWTH_MM = 1e-5
"""A hundred times OCCT's confusion of points: tangent faces are apart then."""


def is_helix(sweep: Sweep) -> bool:
    """Whether the tip winds about an upright axis and rises."""
    path = sweep.path
    return isinstance(path, Arc) and path.axis == 2 and path.angle * path.rise != 0.0


def is_wound(sweep: Sweep) -> bool:
    """Whether a helix has several solids (`swept.py`), with spline sheets that reach its axis."""
    path = sweep.path
    return isinstance(path, Arc) and is_helix(sweep) and path.radius <= sweep.profile.max_radius


def levels(sweep: Sweep) -> list[float]:
    """Heights at which the section of an upright sweep changes its shape: joints of the tool at both ends."""
    if not isinstance(sweep.path, (Line, Arc)):
        return []
    tips = (float(sweep.path.start[2]), float(sweep.path.end[2]))
    return [tip + z for tip in tips for z in sweep.profile.points[:, 1].tolist()]


def grown(sweep: Sweep) -> Sweep:
    """The sweep of a cutter that is larger by about `GROWTH_MM`, its tip that much lower."""
    profile = sweep.profile
    factor = 1.0 + GROWTH_MM / profile.max_radius
    lifted = profile.scaled(factor).shifted(-GROWTH_MM)
    return Sweep.along(lifted, sweep.path)


def moved_area(sweep: Sweep) -> float:
    """mm^2, more than the surface that a growth of the cutter moves, times how far at most (in growths).

    Of a tool that turns about its tip it may be less: its gate is that much stricter.
    """
    profile = sweep.profile
    stretch = 1.0 + float(np.abs(profile.points[:, 1]).max()) / profile.max_radius
    return stretch * (
        profile.area + 2.0 * sweep.path.length * (2.0 * profile.max_radius + np.ptp(profile.points[:, 1]))
    )
