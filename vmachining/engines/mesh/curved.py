"""Arcs: level ones about the tool axis as revolved rings, all others as short straight pieces.

Level arcs: about the arc's centre the cutter reaches from rc - r(z) to rc + r(z) at height z, in the plane
through both axes. Within the swept angle every point of that range is cut, outside of it only the two end
poses reach. This holds with the centre inside the cutter too (the range then starts at 0).

Polygons of a path: corners on radius rc + s/2, s the depth of a chord, keep the true centre within
e = s/2 (1 + s/rc) of the point of the chord at the same time: so far apart they are in the middle, and s/2 at
the ends (the lag along the chord has no part in it). A cutter grown by e on that polygon holds the true sweep
and one narrowed by e is held by it.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.mesh.facets import Side, arc_steps
from vmachining.engines.mesh.straight import Facets, Part, Piece, shifted, straight
from vmachining.engines.mesh.window import Window
from vmachining.geometry import Arc
from vmachining.geometry.path import PLANE_AXES


def level_arc(part: Part, tool: Facets, path: Arc, window: Window | None, chained: bool) -> Iterator[Piece]:
    """The cutter at both ends and the ring between; without the cutter at a `chained` start."""
    begin, end, line = path.start, path.end, part.line
    for at, t in ((begin, 0.0), (end, 1.0))[chained:]:
        yield from straight(part, at, at, window, heading=path.velocity(t))
    lo, hi = sorted((path.start_angle, path.start_angle + path.angle))
    full = hi - lo >= 2 * np.pi - 1e-12
    if full:
        hi = lo + 2 * np.pi
    steps = arc_steps(path.radius + float(line[:, 0].max()), hi - lo, tool.sag)
    angles = np.linspace(lo, hi, steps + 1)
    step = float(angles[1] - angles[0])
    if window is not None:
        height = window.hi[2] - begin[2]
        if height <= line[0, 1] - tool.sag or window.lo[2] - begin[2] >= line[-1, 1]:
            return
        if height < line[-1, 1]:
            k = int(np.searchsorted(line[:, 1], height + 1e-3, side="left"))
            line = line[: max(k, 1) + 1]
        angles, full = _angles_in(angles, path.center, window, full)
        if len(angles) < 2:
            return
    yield from _ring(line, path, angles, step, tool.side, full)


def _angles_in(angles: Floats, center: Floats, window: Window, full: bool) -> tuple[Floats, bool]:
    """The consecutive steps whose sector can meet the window seen from the arc's centre."""
    x = np.array([window.lo[0], window.hi[0], window.hi[0], window.lo[0]]) - center[0]
    y = np.array([window.lo[1], window.lo[1], window.hi[1], window.hi[1]]) - center[1]
    if x[0] <= 0 <= x[1] and y[0] <= 0 <= y[2]:
        return angles, full
    middle = float(np.arctan2(y.mean(), x.mean()))
    off = (np.arctan2(y, x) - middle + np.pi) % (2 * np.pi) - np.pi
    half = float(np.abs(off).max()) + (angles[1] - angles[0])
    seen = np.abs((angles - middle + np.pi) % (2 * np.pi) - np.pi) <= half
    if seen.all() or not seen.any():
        return (angles, full) if seen.all() else (angles[:0], False)
    first, last = int(np.argmax(seen)), len(seen) - 1 - int(np.argmax(seen[::-1]))
    if seen[first : last + 1].all():
        return angles[first : last + 1], False
    return angles, full  # the window straddles the start of the circle: keep it whole


def _ring(line: Floats, path: Arc, angles: Floats, step: float, side: Side, full: bool) -> Iterator[Piece]:
    """The meridian on both sides of the tool axis, revolved about the arc's centre over `angles`."""
    rc = path.radius
    near, far = rc - line[:, 0], rc + line[:, 0]
    grow = 1.0 / np.cos(step / 2)
    if side is Side.INNER:
        near = near * grow
    elif side is Side.OUTER:
        far = far * grow
    else:
        fair = np.sqrt(step / np.sin(step))
        near, far = near * fair, far * fair
    z = line[:, 1]
    if side is Side.INNER:
        near, far, z = _uncrossed(near, far, z)
        if len(z) < 2:
            return
    section = _clipped(np.concatenate([np.stack([far, z], 1), np.stack([near, z], 1)[::-1]]))
    section = section[np.linalg.norm(section - np.roll(section, 1, axis=0), axis=1) > 1e-12]
    k, cols = len(section), len(angles) - 1 if full else len(angles)
    cos, sin = np.cos(angles[:cols]), np.sin(angles[:cols])
    points = np.empty((cols, k, 3))
    points[..., 0] = path.center[0] + cos[:, None] * section[:, 0]
    points[..., 1] = path.center[1] + sin[:, None] * section[:, 0]
    points[..., 2] = path.start[2] + section[:, 1]
    index = np.arange(cols * k).reshape(cols, k)
    on_axis = section[:, 0] == 0.0
    index[:, on_axis] = index[0, on_axis]
    a, p = np.arange(k), np.arange(cols if full else cols - 1)[:, None]
    b, q = np.roll(a, -1), (p + 1) % cols
    quad = np.stack([index[p, a], index[q, a], index[q, b], index[p, b]], axis=-1).reshape(-1, 4)
    triangles = np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])
    if not full:
        cap = np.array([[0, i, i + 1] for i in range(1, k - 1)])
        triangles = np.concatenate([triangles, index[0][cap], index[-1][cap[:, ::-1]]])
    distinct = (triangles != np.roll(triangles, -1, axis=1)).all(axis=1)
    used, inverse = np.unique(triangles[distinct], return_inverse=True)
    yield Piece(points.reshape(-1, 3)[used], inverse.reshape(-1, 3))


def _uncrossed(near: Floats, far: Floats, z: Floats) -> tuple[Floats, Floats, Floats]:
    """Sides of a section without the ends where drawing them in has put the near one beyond the far one."""
    width = far - near
    if (width >= 0.0).all():
        return near, far, z
    rows = np.stack([near, far, z], axis=1)
    out = []
    for k in range(len(rows)):
        if width[k] >= 0.0:
            out.append(rows[k])
        if k + 1 < len(rows) and (width[k] < 0.0) != (width[k + 1] < 0.0):
            t = width[k] / (width[k] - width[k + 1])
            n, f, h = rows[k] + t * (rows[k + 1] - rows[k])
            out.append(np.array([n, n, h]))
    n, f, h = np.array(out).reshape(-1, 3).T
    return n, f, h


def _clipped(section: Floats) -> Floats:
    """Convex polygon (k, 2) without its part at negative first coordinate."""
    if (section[:, 0] >= 0).all():
        return section
    out = []
    for a, b in zip(section, np.roll(section, -1, axis=0), strict=True):
        if a[0] >= 0:
            out.append(a)
        if (a[0] < 0) != (b[0] < 0):
            t = a[0] / (a[0] - b[0])
            out.append(np.array([0.0, a[1] + t * (b[1] - a[1])]))
    return np.array(out)


def polygon(part: Part, tool: Facets, path: Arc, window: Window | None, chained: bool) -> Iterator[Piece]:
    """Straight pieces along a polygon, see the head of this file."""
    rc, turn = path.radius, abs(path.angle)
    steps = max(arc_steps(rc, turn, tool.sag), int(np.ceil(turn / (np.pi / 8))))
    moved: Part | None = part
    while True:
        width = turn / steps
        depth = rc * (1.0 - np.cos(width / 2))
        radius = rc * (1.0 + width * width / 12.0) if tool.side is Side.FAIR else rc + depth / 2
        if tool.side is not Side.FAIR:
            radial = float(depth / 2 * (1.0 + depth / rc))
            moved = shifted(part, tool, radial, 0.0 if path.axis == 2 else radial)
        if moved is not None:
            break
        steps *= 2  # nothing is left of a cutter as thin as that
    corners = path.position(np.linspace(0.0, 1.0, steps + 1))
    for k in PLANE_AXES[path.axis]:
        corners[:, k] = path.center[k] + (corners[:, k] - path.center[k]) * (radius / rc)
    for start, end in pairwise(corners):
        yield from straight(moved, start, end, window, chained=chained, bend=width / 2)
        chained = True
