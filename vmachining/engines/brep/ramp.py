"""Ramps and helices of a convex cutter: caps trimmed at the grazing curve, and the sheet it draws.

The motion rises (a falling one is the same set, walked backwards). With the slope gamma, the normals that
graze are n(tau) = (sin g cos tau, +-sin tau, -cos g cos tau) in (heading, left, up): tau runs from 0, the
lowest grazing point, right ahead, to pi, the highest one, right behind. On a circle of the cutter whose
normal has the height angle beta, tau = acos(-sin beta / cos gamma) and u = atan2(sin tau, sin gamma cos tau):
0 where the whole circle trails, pi where the whole circle leads.

The cap at the start is what trails (from u to 2 pi - u), the cap at the end what leads. Between them:

| where it grazes | curve | sheet of a straight ramp |
|---|---|---|
| cylinder, cone | a generator on each side | plane |
| ball | great circle, n(tau) | cylinder |
| torus | quintic spline through exact points | extrusion of it |
| sharp edge, rim of a disc | arc of the circle, as far as its fan of normals grazes | oblique extrusion of it |

A helix turns the same curve about its axis while it rises; its sheets are tensor-product splines, exact in the
rotation of their poles, so that only the fit of sine and cosine adds to the error of the curve.

Known limits: the cutter is convex, a helix enters no point twice (`vmachining.sweep.swept_volume` knows).
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from vmachining.arrays import Floats
from vmachining.engines.brep.caps import FLAT, UP, Pose, Rings, Tool, meridian_curve, normals
from vmachining.engines.brep.shapes import (
    FIT_MM,
    Circle,
    Curve,
    Cylinder,
    Extrusion,
    Frame,
    Plane,
    Spline,
    SplineSheet,
    Straight,
    Surface,
    interpolated,
    solved,
)
from vmachining.engines.brep.topology import Builder, Edge, Use
from vmachining.geometry import Arc, Line
from vmachining.tool import Profile

__all__ = ["HelixGuide", "LineGuide", "ramp"]

WHOLE = np.pi

STEEP = 1.0
"""rad: from here on the trailing part of a ball is nearly half of it, too much for one face without poles."""


class RampGuide(ABC):
    """A rising motion. start, end: poses; gamma: slope, rad; error: of its own splines, mm."""

    start: Pose
    end: Pose
    gamma: float
    error: float = 0.0

    @abstractmethod
    def tie(self, point: Floats) -> Curve:
        """Path of a point of the tool, from its place at the start."""

    @abstractmethod
    def sheet(self, curve: Curve) -> tuple[Surface, float | None]:
        """Surface drawn by a curve of the tool at the start; the last v, None if the surface inverts itself."""


class LineGuide(RampGuide):
    """Straight, rising."""

    def __init__(self, path: Line) -> None:
        a, b = (path.start, path.end) if path.end[2] > path.start[2] else (path.end, path.start)
        self.travel = np.array(b - a)
        level = np.array([self.travel[0], self.travel[1], 0.0])
        heading = level / np.linalg.norm(level)
        self.start, self.end = Pose(np.array(a), heading), Pose(np.array(b), heading)
        self.gamma = float(np.arctan2(self.travel[2], np.linalg.norm(level)))
        self.length = float(np.linalg.norm(self.travel))

    def tie(self, point: Floats) -> Curve:
        return Straight(point, point + self.travel)

    def sheet(self, curve: Curve) -> tuple[Surface, float | None]:
        along = self.travel / self.length
        if isinstance(curve, Straight):
            across = np.cross(curve.end - curve.start, along)
            return Plane(Frame(curve.start, across, along)), None
        if isinstance(curve, Circle) and abs(curve.frame.z @ along) > 1.0 - 1e-14:
            middle = curve.at(np.array(0.5 * (curve.t0 + curve.t1))) - curve.frame.origin
            return Cylinder(Frame(curve.frame.origin, along, -middle), curve.radius), None
        if isinstance(curve, Spline):  # as a spline surface: OCCT integrates those knot by knot
            s, line = curve.spline, make_interp_spline([0.0, self.length], [0.0, self.length], k=1)
            return SplineSheet(s, line, np.stack([s.c, s.c + self.travel], axis=1)), self.length
        return Extrusion(curve, along), self.length


class HelixGuide(RampGuide):
    """Helix about z, rising."""

    def __init__(self, path: Arc) -> None:
        angle, rise, first = path.angle, path.rise, np.array(path.start)
        if rise < 0.0:
            angle, rise, first = -angle, -rise, np.array(path.end)
        self.center = np.array([path.center[0], path.center[1], 0.0])
        sign = np.sign(angle)
        poses = []
        for t in (0.0, 1.0):
            tip = self._turn(first, np.cos(angle * t), np.sin(angle * t)) + t * rise * UP
            out = tip - self.center
            out[2] = 0.0
            poses.append(Pose(tip, sign * np.cross(UP, out / np.linalg.norm(out))))
        self.start, self.end = poses
        self.gamma = float(np.arctan2(rise, path.radius * abs(angle)))
        self.rise = rise
        reach = path.radius + 1.0
        fit = interpolated(
            lambda w: np.column_stack([np.cos(angle * w), np.sin(angle * w)]), 0.0, 1.0, 0.1 * FIT_MM / reach
        )
        self._basis, self._size = fit.spline, fit.error
        # the rise is linear: its coefficients are the Greville abscissae
        t, k = self._basis.t, self._basis.k
        self._linear = np.array([t[i + 1 : i + k + 1].mean() for i in range(len(self._basis.c))])
        self.error = fit.error * reach

    def _turn(self, points: Floats, cos: Floats, sin: Floats) -> Floats:
        d = points - self.center
        out = np.array(np.broadcast_to(points, np.broadcast_shapes(points.shape, np.shape(cos) + (3,))))
        out[..., 0] = self.center[0] + cos * d[..., 0] - sin * d[..., 1]
        out[..., 1] = self.center[1] + sin * d[..., 0] + cos * d[..., 1]
        return out

    def _poles(self, points: Floats) -> Floats:
        """(n, m, 3) coefficients along the motion of n points (n, 3)."""
        cos, sin = self._basis.c.T
        out = self._turn(points[:, None, :], cos[None, :], sin[None, :])
        out[..., 2] += self.rise * self._linear
        return out

    def tie(self, point: Floats) -> Curve:
        return Spline(BSpline(self._basis.t, self._poles(point[None, :])[0], self._basis.k), self.error)

    def sheet(self, curve: Curve) -> tuple[Surface, float | None]:
        if isinstance(curve, Spline):
            spline = curve.spline
        elif isinstance(curve, Straight):
            t = np.array([curve.t0, curve.t1])
            spline = make_interp_spline(t, curve.at(t), k=1)
        else:
            fit = interpolated(curve.at, curve.t0, curve.t1, FIT_MM)
            spline = fit.spline
            self.error = max(self.error, fit.error)
        return SplineSheet(spline, self._basis, self._poles(spline.c)), 1.0


class _Ramp:
    """One ramp in the making."""

    def __init__(self, profile: Profile, guide: RampGuide) -> None:
        self.tool, self.guide, self.build = Tool.of(profile), guide, Builder()
        self.poses = {"start": guide.start, "end": guide.end}
        self.error = 0.0
        self._steep = guide.gamma > STEEP
        n = len(self.tool.segments)
        self.below, self.above = np.zeros(n + 1), np.zeros(n + 1)
        for k in range(n + 1):
            low, high = (self._angle(b) for b in self.tool.normal_angles(k))
            if self.tool.joints[k, 0] > 0.0 and abs(high - low) * self.tool.joints[k, 0] < 1e-8:
                high = low
            self.below[k], self.above[k] = low, high
        self.rings = {name: Rings(self.build, pose, self.tool) for name, pose in self.poses.items()}
        for name in self.poses:
            self._break(self.rings[name])
        self._curves: dict[tuple[str, int, int], Edge] = {}
        self._ties: dict[int, Edge] = {}
        self._meridians: dict[tuple[str, int, int], Edge] = {}

    # -- where it grazes -----------------------------------------------------------------------------------

    def _tau(self, beta: float) -> float:
        return float(np.arccos(np.clip(-np.sin(beta) / np.cos(self.guide.gamma), -1.0, 1.0)))

    def _u(self, tau: Floats) -> Floats:
        return np.asarray(np.arctan2(np.sin(tau), np.sin(self.guide.gamma) * np.cos(tau)))

    def _angle(self, beta: float) -> float:
        """u at which a circle with this normal grazes; 0 it trails all round, pi it leads."""
        tau = self._tau(beta)
        return float(self._u(np.array(tau))) if 0.0 < tau < np.pi else tau

    def _range(self, k: int) -> tuple[float, float]:
        """u at the lower and at the upper end of a segment."""
        return float(self.above[k]), float(self.below[k + 1])

    def _grazes(self, k: int) -> bool:
        low, high = self._range(k)
        s = self.tool.segments[k]
        return low < high if s.is_arc else 0.0 < low < WHOLE

    def _is_tip(self, k: int, joint: int) -> bool:
        """Whether a segment is a ball that closes on the axis at this joint: no edges there."""
        s = self.tool.segments[k]
        return s.is_arc and abs(s.cr) <= FLAT and self.tool.joints[joint, 0] <= FLAT

    def _halved(self, name: str, k: int) -> bool:
        """Whether a cap face would run all round: it is cut in two."""
        low, high = self._range(k)
        if name == "start":
            return low == 0.0 and (self._steep or not self._is_tip(k, k))
        return high == WHOLE and (self._steep or not self._is_tip(k, k + 1))

    def _merged(self, k: int) -> bool:
        """Whether both branches of a ball tip are one edge through the lowest point."""
        return not self._steep and self._is_tip(k, k) and self._grazes(k) and self._range(k)[0] == 0.0

    def _break(self, rings: Rings) -> None:
        for k in range(len(self.tool.joints)):
            inside = [u for u in (self.below[k], self.above[k]) if 0.0 < u < WHOLE]
            rings.break_at(k, [*inside, *(-u for u in inside)])
            if self.below[k] == 0.0 and self.above[k] == WHOLE:
                rings.break_at(k, [0.0, np.pi])
        for k in range(len(self.tool.segments)):
            low, high = self._range(k)
            if self._halved("start", k):
                rings.break_at(k, [0.0, np.pi])
                rings.break_at(k + 1, [0.0, np.pi] if high == 0.0 else [np.pi])
            if self._halved("end", k):
                rings.break_at(k + 1, [0.0, np.pi])
                rings.break_at(k, [0.0, np.pi] if low == WHOLE else [0.0])

    def _normal(self, tau: float, side: int) -> Floats:
        g, pose = self.guide.gamma, self.guide.start
        return np.asarray(
            np.sin(g) * np.cos(tau) * pose.heading
            + side * np.sin(tau) * pose.left
            - np.cos(g) * np.cos(tau) * UP
        )

    # -- curves --------------------------------------------------------------------------------------------

    def _curve(self, name: str, k: int, side: int) -> Edge:
        """Grazing curve on a segment, rising, on one side; a merged one runs from right to left."""
        if self._merged(k):
            side = 1
        key = name, k, side
        if key not in self._curves:
            curve = self._drawn(name, k, side)
            if isinstance(curve, Spline):
                self.error = max(self.error, curve.error)
            self._curves[key] = self.build.edge(curve)
        return self._curves[key]

    def _drawn(self, name: str, k: int, side: int) -> Curve:
        s, pose = self.tool.segments[k], self.poses[name]
        low, high = self._range(k)
        if not s.is_arc:
            return Straight(pose.point(s.r0, s.z0, side * low), pose.point(s.r1, s.z1, side * low))
        t0 = 0.0 if low == 0.0 else self._tau(s.beta[0])
        t1 = np.pi if high == WHOLE else self._tau(s.beta[1])
        g = self.guide.gamma
        if abs(s.cr) <= FLAT:
            ahead = np.sin(g) * pose.heading - np.cos(g) * UP
            frame = Frame(pose.tip + s.cz * UP, np.cross(ahead, side * pose.left), ahead)
            return Circle(frame, s.radius, -t1 if self._merged(k) else t0, t1)

        def point(q: Floats) -> Floats:
            tau = solved(q, lambda x: x + self._u(x), t0, t1)
            u, beta = side * self._u(tau), np.arcsin(np.clip(-np.cos(g) * np.cos(tau), -1.0, 1.0))
            r = (s.cr + s.radius * np.cos(beta))[:, None]
            z = (s.cz + s.radius * np.sin(beta))[:, None]
            radial = np.cos(u)[:, None] * pose.heading + np.sin(u)[:, None] * pose.left
            return np.asarray(pose.tip + r * radial + z * UP)

        ends = [t + float(self._u(np.array(t))) for t in (t0, t1)]
        return interpolated(point, ends[0], ends[1], FIT_MM)

    def _tie(self, edge: Edge, *, last: bool) -> Edge:
        vertex = edge.last if last else edge.first
        if vertex not in self._ties:
            self._ties[vertex] = self.build.edge(self.guide.tie(edge.curve.ends[1 if last else 0]))
        return self._ties[vertex]

    def _rib(self, name: str, k: int, behind: bool) -> Edge:
        """Meridian at u = 0 or pi, from the lower joint, or as far as it belongs to the cap."""
        key = name, k, int(behind)
        if key not in self._meridians:
            s, pose = self.tool.segments[k], self.poses[name]
            low, high = self._range(k)
            curve = meridian_curve(pose.tip, pose.radial(np.pi if behind else 0.0), s)
            if s.is_arc and low < high:
                assert isinstance(curve, Circle)
                graze = np.pi / 2 - self.guide.gamma
                if name == "start" and not behind:
                    curve = Circle(curve.frame, curve.radius, curve.t0, -graze)
                if name == "end" and behind:
                    curve = Circle(curve.frame, curve.radius, graze, curve.t1)
            self._meridians[key] = self.build.edge(curve)
        return self._meridians[key]

    # -- faces ---------------------------------------------------------------------------------------------

    def make(self) -> Builder:
        n = len(self.tool.segments)
        for k in range(n):
            low, high = self._range(k)
            if low < WHOLE:
                self._cap("start", k)
            if high > 0.0:
                self._cap("end", k)
            if self._grazes(k):
                self._drawn_faces(k)
        for k in range(n + 1):
            self._fan(k)
        for name, k, outward in (("start", 0, -UP), ("end", n, UP)):
            r, z = self.tool.joints[k].tolist()
            if r > 0.0:
                pose = self.poses[name]
                point = pose.point(0.0, z, 0.0)
                first = self.rings[name]._breaks[k][0]
                loop = self.rings[name].arcs(k, first, first + 2.0 * np.pi)
                self.build.face(Plane(Frame(point, UP, pose.heading)), [loop], point, outward)
        return self.build

    def _cap(self, name: str, k: int) -> None:
        low, high = self._range(k)
        arcs = self.rings[name].arcs
        graze = self._grazes(k)
        if self._halved(name, k):
            for side in (1, -1):
                curve = [self._curve(name, k, side)] if graze else []
                front, back = [self._rib(name, k, False)], [self._rib(name, k, True)]
                if name == "start":
                    loop = _half(arcs, k, 0.0, np.pi, side) + back
                    loop += _half(arcs, k + 1, high, np.pi, side)[::-1] + curve + front
                else:
                    loop = _half(arcs, k, 0.0, low, side) + curve + back
                    loop += _half(arcs, k + 1, 0.0, np.pi, side)[::-1] + front
                self._cap_face(name, k, loop, (0.0, np.pi) if side > 0 else (-np.pi, 0.0))
            return
        if name == "start":
            lower, upper = arcs(k, low, 2.0 * np.pi - low), arcs(k + 1, high, 2.0 * np.pi - high)
            right, left, span = -1, 1, (min(low, high), 2.0 * np.pi - min(low, high))
        else:
            lower, upper = arcs(k, -low, low), arcs(k + 1, -high, high)
            right, left, span = 1, -1, (-max(low, high), max(low, high))
        if self._merged(k):
            loop = [self._curve(name, k, 1), *upper]
        elif graze:
            loop = lower + [self._curve(name, k, right)] + upper[::-1] + [self._curve(name, k, left)]
        else:
            loop = lower or upper  # a ball tip that trails or leads as a whole
        self._cap_face(name, k, loop, span)

    def _cap_face(self, name: str, k: int, loop: list[Edge], span: tuple[float, float]) -> None:
        s, pose = self.tool.segments[k], self.poses[name]
        middle = 0.5 * (span[0] + span[1])
        leads = 1.0 if name == "end" else -1.0
        along = np.cos(self.guide.gamma) * pose.heading + np.sin(self.guide.gamma) * UP
        region = normals(pose, np.linspace(*s.beta, 9).tolist(), np.linspace(*span, 25).tolist())
        kept = region[leads * (region @ along) >= -1e-9]
        hints = np.array([UP - along, UP + along, pose.left + UP, pose.left - UP])
        surface = pose.surface(s, middle, kept if len(kept) else region, hints)
        probe = loop[0].curve.at(np.array(0.5 * (loop[0].curve.t0 + loop[0].curve.t1)))
        # the outward normal of the cutter at that point of the loop
        offset = probe - pose.tip
        radial = offset * [1.0, 1.0, 0.0]
        size = float(np.linalg.norm(radial))
        if s.is_arc:
            outward = offset - s.cz * UP - s.cr * (radial / size if size > FLAT else 0.0)
        else:
            beta = s.beta[0]
            outward = np.cos(beta) * radial / size + np.sin(beta) * UP
        self.build.face(surface, [loop], probe, outward)

    def _drawn_faces(self, k: int) -> None:
        """Sheets of the grazing curves of a segment."""
        s = self.tool.segments[k]
        for side in (1,) if self._merged(k) else (1, -1):
            first, second = self._curve("start", k, side), self._curve("end", k, side)
            low, high = self._range(k)
            if self._merged(k):
                tau = 0.0
            elif s.is_arc:
                t0 = 0.0 if low == 0.0 else self._tau(s.beta[0])
                t1 = np.pi if high == WHOLE else self._tau(s.beta[1])
                tau = 0.5 * (t0 + t1)
                if isinstance(first.curve, Spline):
                    q = np.array([0.5 * (first.curve.t0 + first.curve.t1)])
                    tau = float(solved(q, lambda x: x + self._u(x), t0, t1)[0])
            else:
                tau = self._tau(s.beta[0])
            self._sheet(first, second, self._normal(tau, side))

    def _fan(self, k: int) -> None:
        """Sheets drawn by a sharp edge where its fan of normals grazes."""
        low, high = float(self.below[k]), float(self.above[k])
        if high - low < 1e-12 or self.tool.joints[k, 0] <= 0.0:
            return
        if low == 0.0 and high == WHOLE:
            spans = [(0.0, 2.0 * np.pi)]
        elif low == 0.0:
            spans = [(-high, high)]
        elif high == WHOLE:
            spans = [(low, 2.0 * np.pi - low)]
        else:
            spans = [(low, high), (-high, -low)]
        g = self.guide.gamma
        for span in spans:
            pairs = zip(self.rings["start"].arcs(k, *span), self.rings["end"].arcs(k, *span), strict=True)
            for first, second in pairs:
                u = 0.5 * (first.curve.t0 + first.curve.t1)
                tau = float(np.arctan2(np.sin(g) * abs(np.sin(u)), np.cos(u)))
                self._sheet(first, second, self._normal(tau, 1 if np.sin(u) >= 0.0 else -1))

    def _sheet(self, first: Edge, second: Edge, outward: Floats) -> None:
        """The face between a curve at the start and the same curve at the end."""
        surface, v = self.guide.sheet(first.curve)
        left, right = self._tie(first, last=False), self._tie(first, last=True)
        t0, t1 = first.curve.t0, first.curve.t1
        if v is None:
            probe = first.curve.at(np.array(0.5 * (t0 + t1)))
            self.build.face(surface, [[first, right, second, left]], probe, outward)
            return
        loop = [
            Use(first, (t0, 0.0), (t1, 0.0)),
            Use(right, (t1, 0.0), (t1, v)),
            Use(second, (t0, v), (t1, v)),
            Use(left, (t0, 0.0), (t0, v)),
        ]
        self.build.face(surface, [loop], np.array([0.5 * (t0 + t1), 1e-7 * v]), outward)


def ramp(profile: Profile, guide: RampGuide) -> tuple[Builder, float]:
    """Sweep of a convex profile along a rising motion, and the largest error of a fitted curve (mm)."""
    work = _Ramp(profile, guide)
    build = work.make()
    return build, max(work.error, guide.error)


def _half(arcs: object, joint: int, ua: float, ub: float, side: int) -> list[Edge]:
    """Edges of one side of a circle, in the order of rising |u|."""
    if side > 0:
        return list(arcs(joint, ua, ub))  # type: ignore[operator]
    return list(arcs(joint, -ub, -ua))[::-1]  # type: ignore[operator]
