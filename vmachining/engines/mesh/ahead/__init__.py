"""What a block can still remove where the one before has left its cutter, and which solids that cannot touch.

A straight block starts in a pose K(p) that is cut free. Only N = W - K(p) can hold material, W the sweep. A point of
N lies on a line along d that has left K at a point y where the outward normal n has n . d >= 0: x = y + s d. On a
body of revolution, in the direction e of the way seen from above,

    y . e >= r(z) cos(psi),   cos(psi) >= -(n_z / n_r) (d_z / |d_xy|)

so that N has a rear limit at every height, x . e >= limit(z). It is tabulated in steps of height, each with the least
value in it: r and n_z / n_r are monotone, or concave, between the points of the meridian.

If no triangle of a solid A reaches into N, because it is behind the limit or outside W, then A and N have nothing
in common: N of a convex cutter is connected, and its foremost point, p + d + r_max e at the height of the largest
radius r_max, farther ahead than any point of K(p), is outside the box of A.

Where A and N do meet, a mesh V of the cutter in W need be right only below those triangles, if A is free of the
mesh K' of the cutter at p, and the cutter opens upwards, with its top above A. From a point of A and V go up to where
A ends: all the way is in A, hence in V and not in K', so it ends in a triangle of A that reaches into V - K'. Limits
of V - K' are those of facets that look ahead, as above. From a point of A in W, but not in V nor in K(p), the way up
may come into K(p), which is no harm if a limit holds from its height upwards. `lowest` is below both.

Source: derived here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vmachining.arrays import Bools, Floats
from vmachining.engines.mesh.ahead import _kernels
from vmachining.engines.mesh.straight import Facets
from vmachining.engines.mesh.window import Limits, Surface
from vmachining.geometry import Line
from vmachining.sweep import Sweep

__all__ = ["Ahead", "ahead"]

STEPS = 96
"""Heights of the table."""

CLEAR_MM = 1e-9
"""A triangle nearer to the limit than this is not behind it."""


@dataclass(frozen=True, slots=True, eq=False)
class Ahead:
    """Rear limits of what a straight block can still remove.

    sweep : the block. limits : of what is removed, and for the mesh and what is above. front : (3,) mm, a point of
    what the block can still remove. top : mm, below which the sweep opens upwards; -inf where it does not.
    box : (2, 3) mm, of the sweep without what is behind all limits.
    """

    sweep: Sweep
    limits: Limits
    front: Floats
    top: float
    box: Floats

    def meets(self, surface: Surface, box: Floats) -> tuple[bool, Bools]:
        """Whether a solid may be touched, and which parts (n,) of its surface can be above a place that is.

        surface : of the solid, see `above`, in the box and before the limits. box (2, 3) of the whole solid.
        """
        over, _ = self.sweep.meets(surface.hulls, surface.boxes, depth=np.inf, within=CLEAR_MM)
        inside = (self.front >= box[0]).all() and (self.front <= box[1]).all()
        return bool(inside or (over & surface.near).any()), over


def ahead(sweep: Sweep, tool: Facets) -> Ahead | None:
    """Limits of a straight block that starts in a pose that is cut free; None where there are none to tell.

    tool : inner facets of the cutter.
    """
    path = sweep.path
    if not isinstance(path, Line) or len(tool.parts) != 1 or tool.parts[0].gauge is None:
        return None
    d = path.end - path.start
    level = float(np.hypot(d[0], d[1]))
    if level == 0.0:
        return None
    profile, rows = sweep.profile, tool.parts[0].gauge.meridian
    low = profile.z_min + min(0.0, float(d[2]))
    step = (profile.z_max + max(0.0, float(d[2])) - low) / STEPS
    limits = np.empty(STEPS)
    _kernels.rear_limits(rows, level, float(d[2]), profile.z_min, profile.z_max, low, step, limits)  # type: ignore[no-untyped-call]
    heading = d[:2] / level
    # the larger height leaves the boxes of tiles sooner; arcs may bulge between the points of a profile
    high = profile.z_max if profile.points[-1, 0] >= profile.max_radius else profile.widest_z
    front = path.end + np.array([*(profile.max_radius * heading), high])
    lowest = np.minimum.accumulate(limits)
    body = tool.parts[0].body
    _kernels.front_limits(  # type: ignore[no-untyped-call]
        body.points, body.triangles, body.normals, *body.clusters, d, low, step, lowest
    )
    limits, lowest = limits - CLEAR_MM, lowest - CLEAR_MM
    opens_up = body.opens_up and profile.points[-1, 0] >= profile.max_radius
    top = profile.z_max + float(min(path.start[2], path.end[2])) if opens_up else -np.inf
    box = _before(sweep.bounds, path.start, heading, float(lowest.min()))
    return Ahead(sweep, Limits(path.start, heading, low, step, lowest, limits), front, top, box)


def _before(box: Floats, start: Floats, heading: Floats, limit: float) -> Floats:
    """The box (2, 3) around what a box has on from a limit along the heading."""
    (x0, y0, z0), (x1, y1, z1) = box.tolist()
    x, y = heading.tolist()
    p, q, _ = start.tolist()
    if abs(x) > 1e-9:
        at = p + (limit - max(y * (y0 - q), y * (y1 - q))) / x
        x0, x1 = (max(x0, at), x1) if x > 0.0 else (x0, min(x1, at))
    if abs(y) > 1e-9:
        at = q + (limit - max(x * (x0 - p), x * (x1 - p))) / y
        y0, y1 = (max(y0, at), y1) if y > 0.0 else (y0, min(y1, at))
    return np.array([[x0, y0, z0], [x1, y1, z1]])
