"""Arcs: level ones about the tool axis as revolved rings, all others as short straight pieces.

Level arcs: about the arc's centre the cutter reaches from rc - r(z) to rc + r(z) at height z, in the plane
through both axes. Within the swept angle every point of that range is cut, outside of it only the two end
poses reach. This holds with the centre inside the cutter too (the range then starts at 0).

Polygons of a path: corners on radius rc + s/2, s the depth of a chord, keep the true centre within
e = s/2 (1 + s/rc) of the point of the chord at the same time: so far apart they are in the middle, and s/2 at
the ends (the lag along the chord has no part in it). A cutter grown by e on that polygon holds the true sweep
and one narrowed by e is held by it. In the mean the true centre is s/6 outside of the chord.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.mesh.facets import Side, arc_steps
from vmachining.engines.mesh.gap import supports
from vmachining.engines.mesh.skin import Leeway, Way
from vmachining.engines.mesh.straight import (
    NO_ROWS,
    SKIN_CELLS,
    STIFF,
    Facets,
    Part,
    Piece,
    shifted,
    straight,
)
from vmachining.engines.mesh.window import Window
from vmachining.geometry import Arc, Line
from vmachining.geometry.path import PLANE_AXES
from vmachining.sweep import Sweep
from vmachining.tool import Profile

__all__ = ["level_arc", "polygon", "way"]

AROUND = np.array([(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
"""Corners (8, 3) of a cube."""


def level_arc(
    part: Part, tool: Facets, path: Arc, window: Window | None, chained: bool, skinned: bool
) -> Iterator[Piece]:
    """The cutter at both ends and the ring between; of a `chained` start only the mesh, for the skin's sake."""
    begin, end, line = path.start, path.end, part.line
    for at, t in ((begin, 0.0), (end, 1.0))[chained and not skinned :]:
        heading = path.velocity(t)
        inward = heading if t == 0.0 else -heading
        leeway = STIFF._replace(inward=inward / np.linalg.norm(inward))
        for piece in straight(part, at, at, window, heading=heading, skinned=skinned, leeway=leeway):
            yield piece._replace(skin=NO_ROWS) if chained and t == 0.0 else piece
    lo, hi = sorted((path.start_angle, path.start_angle + path.angle))
    full = hi - lo >= 2 * np.pi - 1e-12
    if full:
        hi = lo + 2 * np.pi
    steps = arc_steps(path.radius + float(line[:, 0].max()), hi - lo, tool.sag)
    angles = np.linspace(lo, hi, steps + 1)
    step = float(angles[1] - angles[0])
    skin = NO_ROWS
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
        if skinned and part.gauge is not None:
            skin = _ring_skin(line, part.gauge.meridian, path, angles, step, window)
    yield _ring(line, part, path, angles, step, tool.side, full, skinned)._replace(skin=skin)


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


def _ring(
    line: Floats, part: Part, path: Arc, angles: Floats, step: float, side: Side, full: bool, skinned: bool
) -> Piece:
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
            return Piece(
                np.empty((0, 3)), np.empty((0, 3), dtype=np.int64), np.empty(0), np.empty(0, dtype=int)
            )
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
    a = np.arange(k)
    b = np.roll(a, -1)
    quads = []
    for now, then in [*pairwise(range(cols)), *([(cols - 1, 0)] if full else [])]:
        quads.append(np.stack([index[now, a], index[then, a], index[then, b], index[now, b]], axis=1))
    quad = np.concatenate(quads)
    triangles = np.concatenate([quad[:, [0, 1, 2]], quad[:, [0, 2, 3]]])
    kin = np.tile(np.arange(len(quad)), 2)
    mean = np.zeros(len(triangles))
    if skinned and part.gauge is not None:
        mean = np.tile(_ring_means(section, part.gauge.meridian, rc, step), 2 * len(quads))
    if not full:
        cap = np.array([[0, i, i + 1] for i in range(1, k - 1)])
        triangles = np.concatenate([triangles, index[0][cap], index[-1][cap[:, ::-1]]])
        ends = np.repeat([len(quad), len(quad) + 1], len(cap))
        kin, mean = np.concatenate([kin, ends]), np.concatenate([mean, np.zeros(len(ends))])
    distinct = (
        (triangles[:, 0] != triangles[:, 1])
        & (triangles[:, 1] != triangles[:, 2])
        & (triangles[:, 2] != triangles[:, 0])
    )
    used, inverse = np.unique(triangles[distinct], return_inverse=True)
    vertices = points.reshape(-1, 3)[used]
    faces = inverse.reshape(-1, 3)
    return Piece(vertices, faces, mean[distinct], kin[distinct]) if skinned else Piece(vertices, faces)


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


def _ring_means(section: Floats, meridian: Floats, rc: float, step: float) -> Floats:
    """(k,) mm in the mean between the truth and the revolved edges of an inner section, edge by edge.

    Arcs of the meridian rise 2/3 of their height in the mean; the outer polygon lacks 2/3 of its depth, the
    inner one, around its circle, has 1/3 of it too much.
    """
    a, b = section, np.roll(section, -1, axis=0)
    far = a[:, 0] + b[:, 0] > 2.0 * rc
    true = np.where(section[:, 0] < rc, section[:, 0] * np.cos(step / 2), section[:, 0])
    x, y = true - rc, section[:, 1]
    dx, dy = np.roll(x, -1) - x, np.roll(y, -1) - y
    size = np.hypot(dx, dy)
    n = np.stack([np.abs(dy), -dx], axis=1) / np.where(size > 0.0, size, 1.0)[:, None]
    at = np.maximum(np.abs(x) * n[:, 0] + y * n[:, 1], np.abs(x + dx) * n[:, 0] + (y + dy) * n[:, 1])
    rise = np.maximum(supports(meridian, n) - at, 0.0)
    middle = 0.5 * (a[:, 0] + b[:, 0])
    depth = np.where(far, (1.0 - np.cos(step / 2)) * 2.0 / 3.0, (1.0 / np.cos(step / 2) - 1.0) / 3.0)
    on_axis = (a[:, 0] <= 0.0) & (b[:, 0] <= 0.0)
    level = (dy == 0.0) | (size == 0.0)  # discs at the bottom and at the top, where the window ends
    return np.where(on_axis | level, 0.0, rise * 2.0 / 3.0 + middle * depth * n[:, 0])


def _ring_skin(
    line: Floats, meridian: Floats, path: Arc, angles: Floats, step: float, window: Window
) -> Floats:
    """Rows (n, 25) of the skin around an inner ring: its edges in the section, thickened and revolved."""
    rc, z0 = path.radius, path.start[2]
    size = SKIN_CELLS * window.cell
    line = line[(np.arange(len(line)) <= np.searchsorted(line[:, 1], window.hi[2] - z0) + 1)]
    apex = np.array([0.0, line[0, 1] + 0.999 * (line[-1, 1] - line[0, 1])])  # inside the section
    out = []
    for sign, depth in (
        (1.0, (rc + float(line[:, 0].max())) * (1.0 - np.cos(step / 2))),
        (-1.0, max(rc - float(line[:, 0].min()), 0.0) * (1.0 / np.cos(step / 2) - 1.0)),
    ):
        a, b = line[:-1], line[1:]
        long = np.linalg.norm(b - a, axis=1)
        n = np.stack([b[:, 1] - a[:, 1], a[:, 0] - b[:, 0]], axis=1) / long[:, None]
        gap = np.maximum(supports(meridian, n) - (a * n).sum(axis=1), 0.0) + depth * n[:, 0]
        high = np.maximum(((a - apex) * n).sum(axis=1), 1e-9)
        many = np.maximum(1, np.ceil(long / size)).astype(int)
        which = np.repeat(np.arange(len(a)), many)
        part = np.concatenate([np.arange(k) for k in many]) / many[which]
        low = a[which] + part[:, None] * (b - a)[which]
        top = low + (b - a)[which] / many[which, None]
        grow = 1.0 + gap[which] / high[which]
        lever = np.maximum(np.linalg.norm(low - apex, axis=1), np.linalg.norm(top - apex, axis=1))
        wide = lever * (gap / high)[which] + 1e-9  # how far the corners of a frustum move
        rho = rc + sign * np.stack([low[:, 0], top[:, 0]])
        rho_hi, rho_lo = rho.max(axis=0) + wide, np.maximum(rho.min(axis=0) - wide, 0.0)
        kept = (gap[which] > 1e-13) & (rho_hi > 0.0)
        z_lo, z_hi = np.minimum(low[:, 1], top[:, 1]) - wide, np.maximum(low[:, 1], top[:, 1]) + wide
        volume = np.linalg.norm(top - low, axis=1) * gap[which] * grow * rho_hi * step
        for angle in 0.5 * (angles[1:] + angles[:-1]):
            r = 0.5 * (rho_hi + rho_lo)
            middle = np.stack([path.center[0] + r * np.cos(angle), path.center[1] + r * np.sin(angle),
                               z0 + 0.5 * (z_lo + z_hi)], axis=1)  # fmt: skip
            half = np.stack(
                [0.5 * (rho_hi - rho_lo) + 0.5 * rho_hi * step] * 2 + [0.5 * (z_hi - z_lo)], axis=1
            )
            seen = kept & window.sees(np.stack([middle - half, middle + half], axis=1))
            ball = middle[:, None] + half[:, None] * AROUND
            out.append(np.column_stack([ball.reshape(-1, 24), volume])[seen])
    return np.concatenate(out) if out else NO_ROWS


def way(sweep: Sweep, chord: float, box: Floats | None = None) -> Way:
    """An upright sweep as straight ones, those that can reach a box (2, 3).

    Inner meshes lie within `chord` of the truth: a depth of facets of the cutter, of its circles, of the path.
    """
    path = sweep.path
    if not isinstance(path, Arc):
        return Way((sweep,), 0.0, chord)
    steps = max(arc_steps(path.radius, abs(path.angle), chord), 1)
    width = abs(path.angle) / steps
    depth = path.radius * (1.0 - np.cos(width / 2))
    slack = depth / 2 * (1.0 + depth / path.radius) if path.radius > 0.0 else 0.0
    corners = path.position(np.linspace(0.0, 1.0, steps + 1))
    for k in PLANE_AXES[path.axis]:
        if path.radius > 0.0:
            corners[:, k] = path.center[k] + (corners[:, k] - path.center[k]) * (
                1.0 + depth / 2 / path.radius
            )
    pieces = [Sweep.along(sweep.profile, Line(a, b)) for a, b in pairwise(corners)]
    if box is not None:
        lo, hi = box[0] - slack, box[1] + slack
        pieces = [p for p in pieces for a, b in (p.bounds,) if (a <= hi).all() and (b >= lo).all()]
    return Way(tuple(pieces), slack, chord + slack)


def polygon(
    part: Part, run: Profile, tool: Facets, path: Arc, window: Window | None, chained: bool, skinned: bool
) -> Iterator[Piece]:
    """Straight pieces along a polygon, see the head of this file."""
    rc, turn = path.radius, abs(path.angle)
    steps = max(arc_steps(rc, turn, tool.sag), int(np.ceil(turn / (np.pi / 8))))
    moved: Part | None = part
    while True:
        width = turn / steps
        depth = rc * (1.0 - np.cos(width / 2))
        radius = rc * (1.0 + width * width / 12.0) if tool.side is Side.FAIR else rc + depth / 2
        slack = np.zeros(2)
        if tool.side is not Side.FAIR:
            radial = float(depth / 2 * (1.0 + depth / rc))
            slack = np.array([radial, 0.0 if path.axis == 2 else radial])
            moved = shifted(part, run, tool, *slack.tolist())
        if moved is not None:
            break
        steps *= 2  # nothing is left of a cutter as thin as that
    corners = path.position(np.linspace(0.0, 1.0, steps + 1))
    middles = path.position((np.arange(steps) + 0.5) / steps) - path.center
    a, b = PLANE_AXES[path.axis]
    for k in (a, b):
        corners[:, k] = path.center[k] + (corners[:, k] - path.center[k]) * (radius / rc)
    middles[:, path.axis] = 0.0
    for k, (start, end) in enumerate(pairwise(corners)):
        leeway = Leeway(slack, middles[k] * (depth / 6.0 / rc), np.zeros(3))
        yield from straight(
            moved, start, end, window, chained=chained, skinned=skinned, leeway=leeway, bend=width / 2
        )
        chained = True
