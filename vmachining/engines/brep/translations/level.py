"""Level motions, straight or around a circle: every horizontal slice is a stadium, straight or bent.

Faces of every segment of the meridian: the trailing half of the tool at the start, the leading half at the
end, and between them the segment carried along on the left and on the right of the path. Steps and the two
discs are stadiums. Nothing here needs a convex cutter.

Around a circle of radius rc the left side (an arc runs counter-clockwise) is the inner one. Where the tool is
wider than rc there is no inner side: the trailing and the leading half meet in the plane that halves the arc,
at s = rc cos(theta/2) - sqrt(rho^2 - rc^2 sin^2(theta/2)) from the centre, measured towards the middle of the
arc. At the height where rho = rc the inner side ends in a point on the axis.

Known limits: a bent stadium needs its two ends apart, and where it has a point on the axis at most half a turn;
`swept.py` halves other arcs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep.occt import shapes as geo
from vmachining.engines.brep.occt.tolerances import CURVE_FIT_MM, FLAT_MM, SAME_VERTEX_MM
from vmachining.engines.brep.occt.topology import Builder, Edge
from vmachining.engines.brep.translations.caps import UP, Pose, Tool, around, meridian_curve, normals
from vmachining.geometry import Arc, Line
from vmachining.tool import Profile, Segment

LEFT, RIGHT = np.pi / 2, -np.pi / 2


@dataclass(frozen=True, slots=True, eq=False)
class Guide:
    """How a level motion carries the tool.

    start, end : poses. rail : (side, r, z) -> curve of that point of the tool; side +1 left, -1 right.
    sheet : (side, segment) -> (surface, (3,) point of it, (3,) outward).
    """

    start: Pose
    end: Pose
    rail: Callable[[int, float, float], geo.Curve]
    sheet: Callable[[int, Segment], tuple[geo.Surface, Floats, Floats]]
    radius: float = np.inf
    meet: Callable[[float], float] = lambda r: LEFT
    pinch: Callable[[Segment], geo.Curve] | None = None

    def wide(self, r: float) -> bool:
        """Whether a circle of the tool reaches the axis of the path."""
        return r >= self.radius - SAME_VERTEX_MM


def straight_guide(path: Line, height: float | None = None) -> Guide:
    """Horizontal straight motion; `height` replaces the z of both ends."""
    a, b = np.array(path.start), np.array(path.end)
    if height is not None:
        a[2] = b[2] = height
    along = (b - a) / np.linalg.norm(b - a)
    start, end = Pose(a, along), Pose(b, along)

    def rail(side: int, r: float, z: float) -> geo.Curve:
        u = side * LEFT
        return geo.Straight(start.point(r, z, u), end.point(r, z, u))

    def sheet(side: int, s: Segment) -> tuple[geo.Surface, Floats, Floats]:
        radial = start.radial(side * LEFT)
        beta = 0.5 * sum(s.beta)
        normal = start.normal(beta, side * LEFT)
        if s.is_arc:
            # v is the length along the motion, u the angle: its zero opposite to the face
            frame = geo.Frame(a + s.cr * radial + s.cz * UP, along, -normal)
            return geo.Cylinder(frame, s.radius), frame.origin + s.radius * normal, normal
        point = a + s.r0 * radial + s.z0 * UP
        return geo.Plane(geo.Frame(point, normal, along)), point, normal

    return Guide(start, end, rail, sheet)


def bent_guide(path: Arc) -> Guide:
    """Level arc counter-clockwise about the upright axis."""
    assert path.angle > 0.0
    center, rc = np.array(path.center), path.radius
    first = (np.array(path.start) - center) / rc

    def turned(angle: float) -> Floats:
        return np.asarray(np.cos(angle) * first + np.sin(angle) * np.cross(UP, first))

    poses = [Pose(center + rc * turned(t), np.cross(UP, turned(t))) for t in (0.0, path.angle)]
    seam = -turned(path.angle / 2)
    shift = 2.0 * np.pi - 0.5 * path.angle - np.pi  # angle from the seam at which the arc begins

    def rail(side: int, r: float, z: float) -> geo.Curve:
        frame = geo.Frame(center + z * UP, UP, seam)
        return geo.Circle(frame, rc - side * r, shift, shift + path.angle)

    def sheet(side: int, s: Segment) -> tuple[geo.Surface, Floats, Floats]:
        out = turned(path.angle / 2)
        beta = 0.5 * sum(s.beta)
        normal = -side * np.cos(beta) * out + np.sin(beta) * UP
        if side < 0:
            here = s._replace(r0=rc + s.r0, r1=rc + s.r1)
            surface = around(center, seam, here, rc + s.cr)
        elif s.is_arc:
            # the inner side of a torus: v turns about the centre circle from the outside in
            middle = 1.25 * np.pi if s.z0 + s.z1 < 2.0 * s.cz else 0.75 * np.pi
            surface = geo.Torus(geo.Frame(center + s.cz * UP, UP, seam), rc - s.cr, s.radius, (np.pi, middle))
        else:
            surface = around(center, seam, s._replace(r0=rc - s.r0, r1=rc - s.r1), 0.0)
        r, z = _middle(s)
        return surface, center + (rc - side * r) * out + z * UP, normal

    middle, across = turned(path.angle / 2), np.cross(UP, turned(path.angle / 2))
    cos, sin = float(np.cos(path.angle / 2)), float(np.sin(path.angle / 2))

    def far(r: Floats) -> Floats:
        return np.asarray(rc * cos - np.sqrt(np.maximum(np.square(r) - (rc * sin) ** 2, 0.0)))

    def meet(r: float) -> float:
        if r <= rc + SAME_VERTEX_MM:
            return LEFT
        d = float(far(np.array(r))) * middle - rc * (cos * middle - sin * across)
        return float(np.arctan2(d @ poses[0].left, d @ poses[0].heading)) % (2.0 * np.pi)

    def pinch(s: Segment) -> geo.Curve:
        def place(radius: Floats, z: Floats) -> Floats:
            return np.asarray(center + far(radius)[..., None] * middle + z[..., None] * UP)

        if not s.is_arc and abs(s.r0 - s.r1) <= FLAT_MM:
            a, b = place(np.array([s.r0, s.r1]), np.array([s.z0, s.z1]))
            return geo.Straight(a, b)
        b0, b1 = s.beta if s.is_arc else (0.0, 1.0)

        def rz(x: Floats) -> tuple[Floats, Floats]:
            if s.is_arc:
                return s.cr + s.radius * np.cos(x), s.cz + s.radius * np.sin(x)
            return (1.0 - x) * s.r0 + x * s.r1, (1.0 - x) * s.z0 + x * s.z1

        begin, size = far(rz(np.array(b0))[0]), s.radius or s.z1 - s.z0

        def gauge(x: Floats) -> Floats:  # rises, and keeps its slope where the curve stands upright or lies
            return np.asarray(x + np.abs(far(rz(x)[0]) - begin) / size)

        ends = gauge(np.array([b0, b1]))
        return geo.interpolated(
            lambda q: place(*rz(geo.solved(q, gauge, b0, b1))), ends[0], ends[1], CURVE_FIT_MM
        )

    return Guide(poses[0], poses[1], rail, sheet, rc, meet, pinch)


def level(profile: Profile, guide: Guide) -> Builder:
    """The stadium-shaped sweep of any profile."""
    tool, build = Tool.of(profile, guide.radius if np.isfinite(guide.radius) else None), Builder()
    rails: dict[tuple[int, int], Edge] = {}
    halves: dict[tuple[str, int], Edge] = {}
    for k, (r, z) in enumerate(tool.joints.tolist()):
        rails[k, -1] = build.edge(guide.rail(-1, r, z))
        if not guide.wide(r):
            rails[k, 1] = rails[k, -1] if r == 0.0 else build.edge(guide.rail(1, r, z))
        if r > 0.0:
            u = guide.meet(r)
            halves["start", k] = build.edge(guide.start.ring(r, z, u, LEFT + np.pi))
            halves["end", k] = build.edge(guide.end.ring(r, z, RIGHT, np.pi - u))

    def stadium(k: int) -> list[Edge]:
        return [halves["start", k], rails[k, -1], halves["end", k], *_there(rails, k, 1)]

    for k, s in enumerate(tool.segments):
        if s.z0 == s.z1:
            wide, narrow = (k, k + 1) if s.r0 > s.r1 else (k + 1, k)
            loops = [stadium(wide)] + ([stadium(narrow)] if min(s.r0, s.r1) > 0.0 else [])
            point = guide.start.point(max(s.r0, s.r1), s.z0, np.pi)
            plane = geo.Plane(geo.Frame(point, UP, guide.start.heading))
            build.face(plane, loops, point, UP if s.r0 > s.r1 else -UP)
            continue
        r, z = _middle(s)
        beta = 0.5 * sum(s.beta)
        sides = (-1,) if guide.wide(r) else (1, -1)
        ribs: dict[tuple[str, int], Edge] = {}
        shared = None
        if guide.wide(r):
            assert guide.pinch is not None
            shared = build.edge(guide.pinch(s))
        for name, pose in (("start", guide.start), ("end", guide.end)):
            for side in (1, -1):
                if side in sides:
                    ribs[name, side] = build.edge(meridian_curve(pose.tip, pose.radial(side * LEFT), s))
                else:
                    assert shared is not None
                    ribs[name, side] = shared
            middle = np.pi if name == "start" else 0.0
            loop = [ribs[name, -1], *_there(halves, name, k + 1), ribs[name, 1], *_there(halves, name, k)]
            betas = np.linspace(*s.beta, 5).tolist()
            region = normals(pose, betas, np.linspace(middle - LEFT, middle + LEFT, 7).tolist())
            at = 1.25 * np.pi if name == "start" else -0.25 * np.pi
            build.face(pose.surface(s, middle, region), [loop], pose.point(r, z, at), pose.normal(beta, at))
        for side in sides:
            surface, point, outward = guide.sheet(side, s)
            after, before = (_there(rails, joint, side) for joint in (k + 1, k))
            loop = [ribs["start", side], *after, ribs["end", side], *before]
            build.face(surface, [loop], point, outward)
    for k, outward in ((0, -UP), (len(tool.segments), UP)):
        r, z = tool.joints[k].tolist()
        if r > 0.0:
            point = guide.start.point(0.0, z, 0.0)
            build.face(geo.Plane(geo.Frame(point, UP, guide.start.heading)), [stadium(k)], point, outward)
    return build


def _there(known: dict[Any, Edge], *key: Any) -> list[Edge]:
    return [known[key]] if key in known else []


def _middle(s: Segment) -> tuple[float, float]:
    """(r, z) inside a segment."""
    if s.is_arc:
        beta = 0.5 * sum(s.beta)
        return float(s.cr + s.radius * np.cos(beta)), float(s.cz + s.radius * np.sin(beta))
    return 0.5 * (s.r0 + s.r1), 0.5 * (s.z0 + s.z1)
