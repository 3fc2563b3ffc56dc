"""A prism around a sweep that lines can be asked about in some nanoseconds."""

from __future__ import annotations

import numpy as np

from vmachining.arrays import Floats
from vmachining.geometry import Line
from vmachining.sweep import Sweep, Turn

SAMPLES = 33
"""Poses of a curved path; between two of them a point of the axis moves by half of their distance at most from the nearer."""

UP = np.array([0.0, 0.0, 1.0])


def stadium(sweep: Sweep, margin: float) -> Floats:
    """(16,) a prism over the points within a radius of a segment, see `_kernels.py`; it holds the sweep and `margin` mm.

    The prism stands along the tool axis in the middle of the path. A disc of the tool, however it leans, lies within its
    radius of its centre as seen along the prism, and within radius times sine of the lean of it in height.
    """
    profile, path = sweep.profile, sweep.path
    heights = np.array([profile.z_min, profile.z_max])
    if isinstance(path, Line):
        tips, axes, up, slack, lean = np.stack([path.start, path.end]), np.stack([UP, UP]), UP, 0.0, 0.0
    else:
        t = np.linspace(0.0, 1.0, SAMPLES)
        tips = path.position(t)
        axes = path.axis(t) if isinstance(path, Turn) else np.broadcast_to(UP, tips.shape)
        up = axes[SAMPLES // 2] / np.linalg.norm(axes[SAMPLES // 2])
        lean = float(np.linalg.norm(np.cross(axes, up), axis=1).max())
    ends = tips[:, None] + heights[:, None] * axes[:, None]
    if not isinstance(path, Line):
        slack = float(np.linalg.norm(np.diff(ends, axis=0), axis=2).max())
    tall = ends @ up
    middle = ends.mean(axis=1)
    flat = middle - np.multiply.outer(middle @ up, up)
    along = flat[-1] - flat[0]
    length = float(np.linalg.norm(along))
    if length < 1e-9:
        along, length = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))]), 0.0
    along = along / np.linalg.norm(along)
    across = np.cross(up, along)
    origin = flat[0] - (flat[0] @ up) * up
    rest = ends - origin
    x, y = rest @ along, rest @ across
    off = np.hypot(x - np.clip(x, 0.0, length), y)
    radius = profile.max_radius + float(off.max()) + slack + margin
    rise = profile.max_radius * lean + slack + margin
    return np.concatenate(
        [origin, along, across, up, [length, radius, float(tall.min()) - rise, float(tall.max()) + rise]]
    )
