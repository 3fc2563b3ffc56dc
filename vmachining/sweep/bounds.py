"""The box around a body that moves and turns."""

from __future__ import annotations

import numpy as np

from vmachining.arrays import Floats
from vmachining.sweep.turning import Turn
from vmachining.tool import Profile

CELLS = 256
"""Time intervals of the block; the slack falls with the square of this."""


def body_bounds(profile: Profile, path: Turn) -> Floats:
    """(2, 3) mm: a box that surely holds the sweep.

    The support of the body along a direction d is the largest d . p(t) over its points. A point of the body
    stays within |p''| w^2 / 8 of its chord over a time interval w, hence the support is at most the
    larger of the supports at both ends plus that. |p''| <= |c''| + (|A''| + |A'|^2) R without spin, R the
    distance of the farthest point from the tip.
    """
    t = np.linspace(0.0, 1.0, CELLS + 1)
    tips, axes = path.position(t), path.axis(t)
    low = tips - support(profile, -axes)
    high = tips + support(profile, axes)
    bend = path.axis_series.bound(2) + path.axis_series.bound(1) ** 2
    slack = (path.tip_series.bound(2) + bend * reach(profile)) / (8.0 * CELLS**2)
    return np.stack([low.min(axis=0) - slack, high.max(axis=0) + slack])


def support(profile: Profile, along: Floats) -> Floats:
    """Largest d . x over the body for directions d whose component along the tool axis is `along` = d . A.

    Meridian points (r, z) reach r sqrt(1 - along^2) + z along; arcs reach their centre plus the radius where
    the direction is one of their normals.
    """
    up = np.clip(along, -1.0, 1.0)
    out = np.sqrt(1.0 - up * up)
    best = np.full(up.shape, -np.inf)
    for r, z in profile.points:
        best = np.maximum(best, r * out + z * up)
    for s in profile.segments:
        if s.is_arc:
            low, high = s.beta
            here = np.arctan2(up, out)
            bulge = s.cr * out + s.cz * up + s.radius
            best = np.where((here >= low) & (here <= high), np.maximum(best, bulge), best)
    return best


def reach(profile: Profile, height: float = 0.0) -> float:
    """mm: largest distance of a point of the body from the point of the axis at a height."""
    return float(reaches(profile, np.array([height]))[0])


def reaches(profile: Profile, heights: Floats) -> Floats:
    """(n,) mm, the same from points of the axis at heights (n,)."""
    r, z = profile.points.T
    far: Floats = np.hypot(r, z - heights[:, None]).max(axis=1)
    arcs = profile.radii > 0.0
    if arcs.any():  # the farthest point of the whole circle, which holds the arc
        (cr, cz), radius = profile.centers[arcs].T, profile.radii[arcs]
        far = np.maximum(far, (np.hypot(cr, cz - heights[:, None]) + radius).max(axis=1))
    return far
