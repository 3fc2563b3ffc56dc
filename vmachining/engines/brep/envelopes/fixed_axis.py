"""Swept solids of a tool that turns about a fixed line through a point of its axis: in halves.

The grazing curve of such a block is never in general position. Every point of the two meridians in the plane of
axis and line grazes, and so do all circles whose normals pass the pivot, at all times; the flat faces leave the
sweep all over. But half of the tool, up to that plane, sweeps a solid of planes, cylinders, cones, spheres and tori.
The sweep is the union of those of both halves.

Symbols: P pivot, k its height in the tool, A axis, s direction in which the tool leans above P, square to the line.
The half lies on the side of x = -s below P. A circle of radius r, height z and normal (cos b, sin b) moves along its
normal by

    f = B cos v,    B = cos b (k - z) + r sin b,

v the angle from x, per angle of the axis: the half of it either trails all round (B < 0) or leads. A half circle of
B = 0 draws a sphere about P. Going up a convex meridian B passes zero from below on arcs and edges, where the distance
from P is largest, and from above on straight lines, where it is least: there the tool is cut, since between two
largest distances the solid would meet itself. What is left is entered and left once by every point: on a circle about
the line the angle from the axis only grows, and between a least and a largest one lies the tool.

The plane turns about a line in it. Where that is square to the axis, it trails below P and leads above; where it is
oblique it must not pass the tool, and the plane does one or the other. The meridians draw what lies between a pose of
the plane and the other pose of a face. The other half is the same with time turned round.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import BSpline

from vmachining.arrays import Floats
from vmachining.engines.brep.occt.shapes import (
    Circle,
    Curve,
    Frame,
    Plane,
    Sphere,
    Straight,
    Surface,
    interpolated,
)
from vmachining.engines.brep.occt.tolerances import (
    CONFUSION_MM,
    CURVE_FIT_MM,
    FLAT_MM,
    SAME_ANGLE_RAD,
    SHORT_EDGE_MM,
    SNAP_MM,
)
from vmachining.engines.brep.occt.topology import Builder, Edge, Use, run_of
from vmachining.engines.brep.translations.caps import (
    Pose,
    around,
    meridian_curve,
    normals,
    sphere_frame,
)
from vmachining.errors import SweepError
from vmachining.sweep import Turn
from vmachining.tool import Profile, Segment

TIMES = 17
"""Instants at which a motion is looked at."""

WIDEST = 0.99 * np.pi
"""rad: most that a block may turn."""

MARGIN = 1e-2
"""Share of its largest distance from the line that no point of the plane of a half may be nearer."""

GAUSS = 12
"""Nodes along a segment for the flux; r and B are smooth there."""


class FixedAxis(NamedTuple):
    """A turn about a fixed line.

    pivot (3,) mm, where the line meets the axis, height (mm) of it in the tool; line (3,) unit; axis and side (s)
    at both ends. angle : rad about the line. off_mm : how far the pivot moves anyway.
    """

    pivot: Floats
    height: float
    line: Floats
    axes: tuple[Floats, Floats]
    sides: tuple[Floats, Floats]
    angle: float
    off_mm: float

    @classmethod
    def of(cls, path: Turn, off_mm: float = CONFUSION_MM) -> FixedAxis | None:
        """The fixed axis of a motion, if its pivot moves by less than `off_mm`."""
        t = np.linspace(0.0, 1.0, TIMES)
        A, V, S = path.axis(t), path.velocity(t), path.axis_rate(t)
        rate = np.linalg.norm(S, axis=1)
        if rate.min() <= 1e-9 * rate.max():
            return None
        k = -float((V * S).sum() / (S * S).sum())
        pivots = path.position(t) + k * A
        pivot = pivots.mean(axis=0)
        off = float(np.linalg.norm(pivots - pivot, axis=1).max())
        lines = np.cross(S, path.axis_acceleration(t))
        lines /= np.linalg.norm(lines, axis=1, keepdims=True)
        if off > off_mm or np.abs(lines - lines[0]).max() > SAME_ANGLE_RAD:
            return None
        line, sides = lines[0], S / rate[:, None]
        across = [v - (v @ line) * line for v in (A[0], A[-1])]
        angle = float(np.arctan2(np.cross(*across) @ line, across[0] @ across[1]))
        if path.rotation >= WIDEST * float(np.linalg.norm(across[0])):
            return None
        return cls(pivot, k, line, (A[0], A[-1]), (sides[0], sides[-1]), angle, off)


def halves(profile: Profile, about: FixedAxis) -> list[tuple[Builder, float]]:
    """Faces of solids whose union is the sweep of a convex profile, each with its volume in mm^3.

    Raises SweepError: The pivot is the centre of a ball of the tool, or all but in a joint of its meridian; a line
        oblique to the axis passes through the tool.
    """
    ends = list(zip(about.axes, about.sides, strict=True))
    out = []
    for body in _bodies(profile, about.height):
        for way, order in ((1.0, ends), (-1.0, ends[::-1])):
            poses = [Pose(about.pivot - about.height * A, -way * s, A) for A, s in order]
            half = _Half(body, about._replace(line=way * about.line), (poses[0], poses[1]))
            out.append((half.faces(), half.volume()))
    return out


def _bodies(profile: Profile, k: float) -> Iterator[Profile]:
    """The tool cut where straight lines are nearest to the pivot."""
    cuts = []
    for g in profile.segments:
        if g.is_arc or g.z1 - g.z0 <= FLAT_MM:
            continue
        slope = (g.r1 - g.r0) / (g.z1 - g.z0)
        z = g.z0 + (k - g.z0 - g.r0 * slope) / (1.0 + slope * slope)
        if g.z0 + SNAP_MM < z < g.z1 - SNAP_MM:
            cuts.append(k if abs(z - k) <= FLAT_MM else z)
    for lo, hi in pairwise([profile.z_min, *cuts, profile.z_max]):
        yield profile.clip(lo, hi)


class _Half:
    """One half of a body from its trailing pose 0 to its leading pose 1, which turn about +line."""

    def __init__(self, body: Profile, about: FixedAxis, poses: tuple[Pose, Pose]) -> None:
        self.pivot, self.k, self.line, self.angle = about.pivot, about.height, about.line, about.angle
        self.poses, self.build = poses, Builder()
        self.along, self.aside = (float(self.line @ v) for v in (poses[0].axis, poses[0].left))
        self.is_square = abs(self.along) <= SAME_ANGLE_RAD
        self.segments = list(_cut(body, self.k))
        self.nodes = [(g.r0, g.z0) for g in self.segments]
        self.nodes.append((self.segments[-1].r1, self.segments[-1].z1))
        self.oblique = 0 if self.is_square else self._beside()
        near = min(abs(z - self.k) for _, z in self.nodes)
        if FLAT_MM < near < SHORT_EDGE_MM:
            raise SweepError(f"the pivot is {near:.2g} mm from a joint of the tool")
        self.signs = [self._leads(g) for g in self.segments]
        self._edges: dict[tuple[Any, ...], Edge] = {}

    def _plane(self, z: float) -> int:
        """1 where the plane of the half leads, 0 where it trails."""
        return int(z > self.k) if self.is_square else self.oblique

    def _beside(self) -> int:
        """The same all over the plane, of which the line must not pass the half."""
        rows = [np.array(self.nodes).T, *(np.array(_samples(g)[:2]) for g in self.segments)]
        r, z = np.concatenate(rows, axis=1)
        speed = np.stack([self.along * q - self.aside * (z - self.k) for q in (-r, r)])
        if np.abs(speed).min() <= MARGIN * np.abs(speed).max() or speed.min() < 0.0 < speed.max():
            raise SweepError("the tool turns about a line that is oblique to its axis and passes through it")
        return int(speed.max() > 0.0)

    def _leads(self, g: Segment) -> int:
        """1 for a segment that leads, 0 for one that trails: its pose, too."""
        r, z, beta, _ = _samples(g)
        speed = _speed(r, z, beta, self.k)
        if np.abs(speed).max() <= FLAT_MM:
            raise SweepError("the pivot is the centre of a ball of the tool")
        return int(speed.sum() > 0.0)

    # -- edges: made once, by what they are ----------------------------------------------------------------

    def _made(self, key: tuple[Any, ...], curve: Curve) -> Edge:
        if key not in self._edges:
            self._edges[key] = self.build.edge(curve)
        return self._edges[key]

    def _rib(self, pose: int, k: int, side: int) -> Edge:
        """Segment k on one meridian."""
        p = self.poses[pose]
        curve = meridian_curve(p.tip, side * p.left, self.segments[k], p.axis)
        return self._made(("rib", pose, k, side), curve)

    def _half_ring(self, pose: int, node: int) -> list[Edge]:
        r, z = self.nodes[node]
        if r <= FLAT_MM:
            return []
        curve = self.poses[pose].ring(r, z, -0.5 * np.pi, 0.5 * np.pi)
        return [self._made(("ring", pose, node), curve)]

    def _across(self, pose: int, node: int) -> list[Edge]:
        """Diameter; the one in the line is common to both poses."""
        r, z = self.nodes[node]
        if r <= FLAT_MM:
            return []
        p = self.poses[pose]
        ends = p.point(r, z, -0.5 * np.pi), p.point(r, z, 0.5 * np.pi)
        if abs(z - self.k) <= FLAT_MM:
            ends, pose = (self.pivot - r * p.left, self.pivot + r * p.left), 0
        return [self._made(("across", pose, node), Straight(*ends))]

    def _trace(self, node: int, side: int) -> list[Edge]:
        """Path of an end of a half ring."""
        offset, foot = self._offset(*self.nodes[node], side)
        radius = float(np.linalg.norm(foot))
        if radius <= FLAT_MM:
            return []
        key = ("trace", node, side if self.nodes[node][0] > FLAT_MM else 0)
        frame = Frame(self.pivot + offset * self.line, self.line, foot)
        return [self._made(key, Circle(frame, radius, 0.0, self.angle))]

    def _offset(self, r: float, z: float, side: int) -> tuple[float, Floats]:
        """Of a point of a meridian in the first pose: place on the line, (3,) mm from there."""
        first = self.poses[0]
        d = side * r * first.left + (z - self.k) * first.axis
        return float(d @ self.line), d - (d @ self.line) * self.line

    def _spun(self, v: Floats, share: float) -> Floats:
        """(..., 3) turned about the line by a share of the angle."""
        turn, w = share * self.angle, self.line
        along = (v @ w)[..., None] * w
        return np.asarray(along + np.cos(turn) * (v - along) + np.sin(turn) * np.cross(w, v))

    # -- faces ---------------------------------------------------------------------------------------------

    def faces(self) -> Builder:
        """All of them."""
        last = len(self.nodes) - 1
        for k, g in enumerate(self.segments):
            self._band(k, g)
        for node, pose in ((0, 0), (last, 1)):  # the bottom disc trails, the top disc leads
            self._disc(node, pose)
        self._middle()
        steps = [0, *self.signs, 1] if self.nodes[0][0] > FLAT_MM else [self.signs[0], *self.signs, 1]
        if self.nodes[last][0] <= FLAT_MM:
            steps[-1] = steps[-2]
        for node, (low, high) in enumerate(pairwise(steps)):
            if high > low:
                self._zone(node)
            elif high < low:
                raise SweepError("the tool is nearest to the pivot in a joint")
        return self.build

    def _face(self, surface: Surface, edges: list[Edge], probe: Floats, outward: Floats) -> None:
        self.build.face(surface, [run_of(edges)], probe, outward)

    def _band(self, k: int, g: Segment) -> None:
        """Half of a segment in its pose, and what its meridians draw where the plane has the other one."""
        at = self.signs[k]
        pose = self.poses[at]
        loop = [
            *self._half_ring(at, k),
            self._rib(at, k, 1),
            *self._half_ring(at, k + 1),
            self._rib(at, k, -1),
        ]
        curve = meridian_curve(pose.tip, pose.heading, g, pose.axis)
        t = np.array([0.5 * (curve.t0 + curve.t1)])
        beta = float(t[0]) if g.is_arc else g.beta[0]
        region = None
        if g.is_arc and abs(g.cr) <= FLAT_MM:
            quarter = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 17).tolist()
            region = normals(pose, np.linspace(*g.beta, 9).tolist(), quarter)
        surface = pose.surface(g, 0.0, region, np.array([pose.axis, pose.left]))
        self._face(surface, loop, curve.at(t)[0], pose.normal(beta, 0.0))
        if at == self._plane(0.5 * (g.z0 + g.z1)):
            return
        for side in (-1, 1):
            rib = self._rib(0, k, side)
            loop = [rib, *self._trace(k + 1, side), self._rib(1, k, side), *self._trace(k, side)]
            probe = rib.curve.at(np.array([0.5 * (rib.curve.t0 + rib.curve.t1)]))[0]
            first = self.poses[0]
            outward = np.cos(beta) * side * first.left + np.sin(beta) * first.axis
            self._face(self._turned(g, side), loop, probe, outward)

    def _turned(self, g: Segment, side: int) -> Surface:
        """A meridian segment turned about the line."""
        spots = [self._offset(r, z, side) for r, z in ((g.r0, g.z0), (g.r1, g.z1))]
        middle = self._offset(0.5 * (g.r0 + g.r1), 0.5 * (g.z0 + g.z1), side)[1]
        out = middle / np.linalg.norm(middle)
        (h0, r0), (h1, r1) = ((h, max(float(foot @ out), 0.0)) for h, foot in spots)
        axis, seam = self.line, -self._spun(out, 0.5)
        if h1 < h0:
            axis, h0, h1 = -axis, -h0, -h1
        if g.is_arc:
            h, foot = self._offset(g.cr, g.cz, side)
            c = float(foot @ out)
            turned = Segment(r0, h0, r1, h1, c, h if axis is self.line else -h, g.radius)
            return around(self.pivot, seam, turned, c, axis=axis)
        if h1 - h0 <= FLAT_MM:
            return Plane(Frame(self.pivot + h0 * axis, axis, seam))
        return around(self.pivot, seam, Segment(r0, h0, r1, h1, np.nan, np.nan, 0.0), 0.0, axis=axis)

    def _disc(self, node: int, at: int) -> None:
        """Half of a flat face in its pose, and the cylinder that its diameter draws where the plane has the other."""
        r, z = self.nodes[node]
        if r <= FLAT_MM:
            return
        pose, up = self.poses[at], 1.0 if at else -1.0
        center = pose.point(0.0, z, 0.0)
        loop = [*self._half_ring(at, node), *self._across(at, node)]
        self._face(Plane(Frame(center, pose.axis, pose.heading)), loop, center, up * pose.axis)
        if abs(z - self.k) <= FLAT_MM or at == self._plane(z):
            return
        loop = [*self._across(0, node), *self._trace(node, 1), *self._across(1, node), *self._trace(node, -1)]
        first = self.poses[0]
        surface = self._turned(Segment(-r, z, r, z, np.nan, np.nan, 0.0), 1)
        self._face(surface, loop, first.point(0.0, z, 0.0), up * first.axis)

    def _middle(self) -> None:
        """The plane of axis and line, where it trails in the first pose, where it leads in the last one."""
        for at in (0, 1):
            inside = [k for k, g in enumerate(self.segments) if self._plane(0.5 * (g.z0 + g.z1)) == at]
            if not inside:
                continue
            low, high = inside[0], inside[-1] + 1
            loop = [*(self._rib(at, k, -1) for k in inside), *self._across(at, high)]
            loop += [*(self._rib(at, k, 1) for k in reversed(inside)), *self._across(at, low)]
            pose = self.poses[at]
            self._face(Plane(Frame(self.pivot, pose.heading, pose.axis)), loop, self.pivot, -pose.heading)

    def _zone(self, node: int) -> None:
        """The sphere that a half ring draws."""
        r, z = self.nodes[node]
        radius = float(np.hypot(r, z - self.k))
        loop = [
            *self._half_ring(0, node), *self._trace(node, 1), *self._half_ring(1, node), *self._trace(node, -1)
        ]  # fmt: skip
        first = self.poses[0]
        u = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 17).tolist()
        ring = np.array([first.point(r, z, v) for v in u]) - self.pivot
        region = np.concatenate([self._spun(ring, share) for share in np.linspace(0.0, 1.0, 9).tolist()])
        hints = np.array([self.line, self._spun(first.axis, 0.5), self._spun(first.heading, 0.5)])
        sphere = Sphere(sphere_frame(self.pivot, region / radius, hints), radius)
        probe = first.point(r, z, 0.0)
        uses = [Use(edge, path=_traced(sphere, edge.curve)) for edge in run_of(loop)]
        self.build.face(sphere, [uses], probe, probe - self.pivot)

    # -- size ----------------------------------------------------------------------------------------------

    def volume(self) -> float:
        """mm^3: half the body, and the flux through what leads, which is the same at all times.

        int 2 r B ds along the meridian where B > 0 (the integral of cos v is 2), 2 r^3 / 3 of the top disc, and
        int 2 r (z - k) dz of the plane above the pivot.
        """
        flux, body = 2.0 / 3.0 * self.nodes[-1][0] ** 3, 0.0
        for k, g in enumerate(self.segments):
            r, z, beta, weight = _samples(g)
            if self.signs[k]:
                flux += float((weight * 2.0 * r * _speed(r, z, beta, self.k)).sum())
            dz = weight * np.cos(beta)
            body += float((dz * 0.5 * np.pi * r * r).sum())
            if self._plane(0.5 * (g.z0 + g.z1)):
                flux += float((dz * 2.0 * r * (z - self.k)).sum())
        return body + self.angle * abs(self.aside) * flux


def _traced(sphere: Sphere, curve: Curve) -> BSpline:
    """A curve in the parameters of a sphere whose seam and poles are far: as good on one that is much larger."""

    def exact(t: Floats) -> Floats:
        uv = sphere.invert(curve.at(t))
        uv[:, 0] %= 2.0 * np.pi
        return uv

    return interpolated(exact, curve.t0, curve.t1, CURVE_FIT_MM / sphere.radius, first=13, most=400).spline


def _speed(r: Floats, z: Floats, beta: Floats, k: float) -> Floats:
    """B."""
    return np.asarray(np.cos(beta) * (k - z) + np.sin(beta) * r)


def _samples(g: Segment) -> tuple[Floats, Floats, Floats, Floats]:
    """r, z, beta and weights of length at Gauss nodes of a segment."""
    x, weight = np.polynomial.legendre.leggauss(GAUSS)
    x, weight = 0.5 * (x + 1.0), 0.5 * weight
    b0, b1 = g.beta
    if g.is_arc:
        beta = b0 + x * (b1 - b0)
        r, z = g.cr + g.radius * np.cos(beta), g.cz + g.radius * np.sin(beta)
        return r, z, beta, weight * g.radius * (b1 - b0)
    r, z = g.r0 + x * (g.r1 - g.r0), g.z0 + x * (g.z1 - g.z0)
    return r, z, np.full(len(x), b0), weight * float(np.hypot(g.r1 - g.r0, g.z1 - g.z0))


def _cut(body: Profile, k: float) -> Iterator[Segment]:
    """Segments cut at the equator of arcs, where B = 0 on arcs, and at the height of the pivot."""
    for g in body.segments:
        heights = [k]
        if g.is_arc:
            heights.append(g.cz)
            if g.cr > FLAT_MM:
                at = float(np.arctan2(g.cz - k, g.cr))
                if g.beta[0] < at < g.beta[1]:
                    heights.append(g.cz + g.radius * float(np.sin(at)))
        stops = [g.z0, g.z1]
        stops += [z for j, z in enumerate(heights) if min(abs(z - q) for q in stops + heights[:j]) > SNAP_MM]
        for lo, hi in pairwise(sorted(z for z in stops if g.z0 <= z <= g.z1)):
            yield g.cut(lo, hi)
