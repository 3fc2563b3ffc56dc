"""What start and end caps, rails and side faces of all sweeps have in common.

Symbols: a pose is a tip, a tool axis (mostly +z) and a heading e (unit, square to it); u is the angle about the
axis from e, counterclockwise seen from above; beta the angle of the meridian's normal above the disc of the
tool. Segment k of the meridian runs from joint k to joint k + 1; arcs are cut where beta = 0, so that no face
reaches across the outer equator of a torus, where OCCT has its seam.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep.occt import shapes as geo
from vmachining.engines.brep.occt.tolerances import FLAT_MM
from vmachining.engines.brep.occt.topology import Builder, Edge
from vmachining.tool import Profile, Segment

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class Tool:
    """Meridian ready for faces: segments (arcs cut at the equator), joints (r, z)."""

    segments: tuple[Segment, ...]
    joints: Floats

    @classmethod
    def of(cls, profile: Profile, radius: float | None = None) -> Tool:
        """`radius`: segments are cut where they pass it, too."""
        out: list[Segment] = []
        for s in profile.segments:
            cuts = [s.cz] if s.is_arc else []
            if radius is not None and (s.r0 - radius) * (s.r1 - radius) < 0.0 and s.z0 < s.z1:
                if s.is_arc:
                    h = float(np.sqrt(max(s.radius**2 - (radius - s.cr) ** 2, 0.0)))
                    cuts += [s.cz - h, s.cz + h]
                else:
                    cuts.append(s.z0 + (s.z1 - s.z0) * (radius - s.r0) / (s.r1 - s.r0))
            inside = sorted(z for z in cuts if s.z0 + FLAT_MM < z < s.z1 - FLAT_MM)
            stops = [s.z0, *inside, s.z1]
            out += [s.cut(a, b) for a, b in pairwise(stops)] if inside else [s]
        joints = np.array([out[0][:2], *(s[2:4] for s in out)])
        return cls(tuple(out), joints)

    def normal_angles(self, k: int) -> tuple[float, float]:
        """beta below and above joint k; the discs close the profile."""
        below = -np.pi / 2 if k == 0 else self.segments[k - 1].beta[1]
        above = np.pi / 2 if k == len(self.segments) else self.segments[k].beta[0]
        return float(below), float(above)


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Where the tool stands: tip (3,) mm, heading (3,) unit and square to the axis (3,) unit."""

    tip: Floats
    heading: Floats
    axis: Floats = field(default_factory=lambda: UP)
    left: Floats = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "left", np.cross(self.axis, self.heading))

    def radial(self, u: float) -> Floats:
        """(3,) unit outward at angle u."""
        return np.asarray(np.cos(u) * self.heading + np.sin(u) * self.left)

    def point(self, r: float, z: float, u: float) -> Floats:
        """(3,) mm."""
        return np.asarray(self.tip + r * self.radial(u) + z * self.axis)

    def normal(self, beta: float, u: float) -> Floats:
        """(3,) outward normal of the tool."""
        return np.asarray(np.cos(beta) * self.radial(u) + np.sin(beta) * self.axis)

    def outward(self, s: Segment, point: Floats) -> Floats:
        """(3,) outward normal of a segment at a point of it, of any length."""
        offset = point - self.tip
        radial = offset - (offset @ self.axis) * self.axis
        size = float(np.linalg.norm(radial))
        if s.is_arc:
            return np.asarray(offset - s.cz * self.axis - s.cr * (radial / size if size > FLAT_MM else 0.0))
        return np.asarray(np.cos(s.beta[0]) * radial / size + np.sin(s.beta[0]) * self.axis)

    def ring(self, r: float, z: float, ua: float, ub: float) -> geo.Circle:
        """Arc of a circle of the tool from ua to ub > ua; the parameter is the angle."""
        return geo.Circle(geo.Frame(self.tip + z * self.axis, self.axis, self.heading), r, ua, ub)

    def surface(
        self, s: Segment, middle: float, region: Floats | None = None, hints: Floats | None = None
    ) -> geo.Surface:
        """Surface of a segment with the seam opposite to angle `middle`.

        region : (n, 3) unit normals of the face, wanted for a ball to put its poles elsewhere.
        hints : (m, 3) directions that could be such a pole.
        """
        return around(self.tip, -self.radial(middle), s, s.cr, region, hints, self.axis)


def around(
    center: Floats, seam: Floats, s: Segment, major: float, region: Floats | None = None, hints: Floats | None = None,
    axis: Floats = UP,
) -> geo.Surface:  # fmt: skip
    """Surface of a meridian segment turned about an axis through `center`.

    s : segment with radii about this axis; major : radius of the circle of centres of an arc; seam : where
    u = 0.
    """
    if s.is_arc:
        place = center + s.cz * axis
        if abs(major) <= FLAT_MM:
            assert region is not None
            return geo.Sphere(sphere_frame(place, region, hints), s.radius)
        middle = 1.75 * np.pi if s.z0 + s.z1 < 2.0 * s.cz else 0.25 * np.pi
        return geo.Torus(geo.Frame(place, axis, seam), major, s.radius, (np.pi, middle))
    frame = geo.Frame(center + s.z0 * axis, axis, seam)
    if s.z0 == s.z1:
        return geo.Plane(frame)
    if abs(s.r0 - s.r1) <= FLAT_MM:
        return geo.Cylinder(frame, 0.5 * (s.r0 + s.r1))
    return geo.Cone(frame, s.r0, float(np.arctan2(s.r1 - s.r0, s.z1 - s.z0)))


def meridian_curve(center: Floats, radial: Floats, s: Segment, axis: Floats = UP) -> geo.Curve:
    """The segment in the half plane through the axis and `radial`; of an arc the parameter is beta."""
    if s.is_arc:
        place = center + s.cr * radial + s.cz * axis
        b0, b1 = s.beta
        return geo.Circle(geo.Frame(place, np.cross(radial, axis), radial), s.radius, b0, b1)
    return geo.Straight(center + s.r0 * radial + s.z0 * axis, center + s.r1 * radial + s.z1 * axis)


def sphere_frame(center: Floats, region: Floats, hints: Floats | None = None) -> geo.Frame:
    """Frame of a ball whose poles and seam lie as far as they can from a face.

    region : (n, 3) unit normals spread over the face, its boundary included.
    hints : (m, 3) further candidates: between two half spaces the best pole is known.
    """
    k = np.arange(400)
    z = 1.0 - (2.0 * k + 1.0) / 800.0  # half a sphere of candidates: a pole brings its opposite
    turn = np.pi * (1.0 + 5.0**0.5) * k
    rho = np.sqrt(1.0 - z * z)
    candidates = np.column_stack([rho * np.cos(turn), rho * np.sin(turn), z])
    if hints is not None:
        size = np.linalg.norm(hints, axis=1, keepdims=True)
        candidates = np.concatenate([candidates, (hints / np.maximum(size, 1e-300))[size[:, 0] > 1e-9]])
    pole = candidates[np.argmin(np.abs(candidates @ region.T).max(axis=1))]
    middle = region.mean(axis=0)
    return geo.Frame(center, pole, -(middle - (middle @ pole) * pole))


def normals(pose: Pose, betas: Sequence[float], angles: Sequence[float]) -> Floats:
    """(n, 3) normals of the tool on a grid."""
    return np.array([pose.normal(b, u) for b in betas for u in angles])


class Rings:
    """The circles of a tool in one pose as edges, broken at given angles, each made once."""

    def __init__(self, builder: Builder, pose: Pose, tool: Tool) -> None:
        self._builder, self._pose, self._tool = builder, pose, tool
        self._breaks: dict[int, list[float]] = {}
        self._made: dict[tuple[int, float, float], Edge] = {}

    def break_at(self, joint: int, angles: Sequence[float]) -> None:
        """Angles in [0, 2 pi) at which the circle of a joint has vertices."""
        known = self._breaks.setdefault(joint, [])
        for u in angles:
            u = u % (2.0 * np.pi)
            if all(min(abs(u - v), 2.0 * np.pi - abs(u - v)) > 1e-12 for v in known):
                known.append(u)
        known.sort()

    def put(self, joint: int, ua: float, ub: float, edge: Edge) -> None:
        """An edge made elsewhere, to be taken from angle ua up to ub."""
        self._made[_key(joint, ua, ub)] = edge

    def arcs(self, joint: int, ua: float, ub: float) -> list[Edge]:
        """Edges from angle ua up to ub; both must be breaks. None of no length or radius."""
        r, z = self._tool.joints[joint].tolist()
        if r <= 0.0 or ub - ua < 1e-12:
            return []
        turns = _turns(ua) + 2.0 * np.pi * np.arange(3)
        inner = sorted(
            v + s for v in self._breaks.get(joint, []) for s in turns if ua + 1e-12 < v + s < ub - 1e-12
        )
        stops = [ua, *inner, ub]
        out = []
        for a, b in pairwise(stops):
            key = _key(joint, a, b)
            if key not in self._made:
                turn = _turns(a)
                self._made[key] = self._builder.edge(self._pose.ring(r, z, a - turn, b - turn))
            out.append(self._made[key])
        return out


def _turns(u: float) -> float:
    return 2.0 * np.pi * float(np.floor((u + 1e-12) / (2.0 * np.pi)))


def _key(joint: int, ua: float, ub: float) -> tuple[int, float, float]:
    return joint, round(ua - _turns(ua), 10), round(ub - _turns(ua), 10)
