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

Known limits: the cutter is convex, a helix enters no point twice (`vmachining.sweep.swept_volume` knows).
"""

from __future__ import annotations

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep.occt import shapes as geo
from vmachining.engines.brep.occt.tolerances import CURVE_FIT_MM, FLAT_MM
from vmachining.engines.brep.occt.topology import Builder, Edge, Use
from vmachining.engines.brep.translations.caps import UP, Rings, Tool, meridian_curve, normals
from vmachining.engines.brep.translations.guides import RampGuide
from vmachining.tool import Profile

WHOLE = np.pi

STEEP = 1.0
"""rad: from here on the trailing part of a ball is nearly half of it, too much for one face without poles."""


class Ramp:
    """One ramp in the making."""

    def __init__(self, profile: Profile, guide: RampGuide) -> None:
        self.tool, self.guide, self.build = Tool.of(profile), guide, Builder()
        self.poses = {"start": guide.start, "end": guide.end}
        self._skin = {"start": 1.0, "end": 1.0}
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
        return s.is_arc and abs(s.cr) <= FLAT_MM and self.tool.joints[joint, 0] <= FLAT_MM

    def _leads(self, name: str) -> bool:
        """Whether the cap of a pose is what leads, not what trails."""
        return name == "end"

    def _halved(self, name: str, k: int) -> bool:
        """Whether a cap face would run all round: it is cut in two."""
        low, high = self._range(k)
        if not self._leads(name):
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
            if not self._leads("start") and self._halved("start", k):
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
            if isinstance(curve, geo.Spline):
                self.error = max(self.error, curve.error)
            self._curves[key] = self.build.edge(curve)
        return self._curves[key]

    def _taus(self, k: int) -> tuple[float, float]:
        """tau at the lower and at the upper end of an arc."""
        s, (low, high) = self.tool.segments[k], self._range(k)
        return (0.0 if low == 0.0 else self._tau(s.beta[0]), np.pi if high == WHOLE else self._tau(s.beta[1]))

    def _strand(self, name: str, k: int, side: int) -> list[Edge]:
        """What bounds a cap on one side of a segment, from bottom to top."""
        return [self._curve(name, k, side)]

    def _drawn(self, name: str, k: int, side: int) -> geo.Curve:
        s, pose = self.tool.segments[k], self.poses[name]
        if not s.is_arc:
            u = side * self._range(k)[0]
            return geo.Straight(pose.point(s.r0, s.z0, u), pose.point(s.r1, s.z1, u))
        t0, t1 = self._taus(k)
        return self._arc(name, k, side, -t1 if self._merged(k) else t0, t1)

    def _arc(self, name: str, k: int, side: int, t0: float, t1: float) -> geo.Curve:
        """Grazing curve of an arc from tau = t0 to t1."""
        s, pose, g = self.tool.segments[k], self.poses[name], self.guide.gamma
        if abs(s.cr) <= FLAT_MM:
            ahead = np.sin(g) * pose.heading - np.cos(g) * UP
            frame = geo.Frame(pose.tip + s.cz * UP, np.cross(ahead, side * pose.left), ahead)
            return geo.Circle(frame, s.radius, t0, t1)

        def point(q: Floats) -> Floats:
            tau = geo.solved(q, lambda x: x + self._u(x), t0, t1)
            u, beta = side * self._u(tau), np.arcsin(np.clip(-np.cos(g) * np.cos(tau), -1.0, 1.0))
            r = (s.cr + s.radius * np.cos(beta))[:, None]
            z = (s.cz + s.radius * np.sin(beta))[:, None]
            radial = np.cos(u)[:, None] * pose.heading + np.sin(u)[:, None] * pose.left
            return np.asarray(pose.tip + r * radial + z * UP)

        ends = [t + float(self._u(np.array(t))) for t in (t0, t1)]
        return geo.interpolated(point, ends[0], ends[1], CURVE_FIT_MM)

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
                assert isinstance(curve, geo.Circle)
                graze = np.pi / 2 - self.guide.gamma
                if not (self._leads(name) or behind):
                    curve = geo.Circle(curve.frame, curve.radius, curve.t0, -graze)
                if self._leads(name) and behind:
                    curve = geo.Circle(curve.frame, curve.radius, graze, curve.t1)
            self._meridians[key] = self.build.edge(curve)
        return self._meridians[key]

    # -- faces ---------------------------------------------------------------------------------------------

    def make(self) -> Builder:
        n = len(self.tool.segments)
        for k in range(n):
            low, high = self._range(k)
            for name in self.poses:
                if high > 0.0 if self._leads(name) else low < WHOLE:
                    self._cap(name, k)
            if self._grazes(k):
                self._drawn_faces(k)
        for k in range(n + 1):
            self._fan(k)
        for name in self.poses:
            k, outward = (n, UP) if self._leads(name) else (0, -UP)
            r, z = self.tool.joints[k].tolist()
            if r > 0.0:
                pose = self.poses[name]
                point = pose.point(0.0, z, 0.0)
                first = self.rings[name]._breaks[k][0]
                loop = self.rings[name].arcs(k, first, first + 2.0 * np.pi)
                outward = outward * self._skin[name]
                self.build.face(geo.Plane(geo.Frame(point, UP, pose.heading)), [loop], point, outward)
        return self.build

    def _cap(self, name: str, k: int) -> None:
        low, high = self._range(k)
        arcs = self.rings[name].arcs
        graze = self._grazes(k)
        if self._halved(name, k):
            for side in (1, -1):
                curve = self._strand(name, k, side) if graze else []
                front, back = [self._rib(name, k, False)], [self._rib(name, k, True)]
                if not self._leads(name):
                    loop = _half(arcs, k, 0.0, np.pi, side) + back
                    loop += _half(arcs, k + 1, high, np.pi, side)[::-1] + curve[::-1] + front
                else:
                    loop = _half(arcs, k, 0.0, low, side) + curve + back
                    loop += _half(arcs, k + 1, 0.0, np.pi, side)[::-1] + front
                self._cap_face(name, k, loop, (0.0, np.pi) if side > 0 else (-np.pi, 0.0))
            return
        if not self._leads(name):
            lower, upper = arcs(k, low, 2.0 * np.pi - low), arcs(k + 1, high, 2.0 * np.pi - high)
            right, left, span = -1, 1, (min(low, high), 2.0 * np.pi - min(low, high))
        else:
            lower, upper = arcs(k, -low, low), arcs(k + 1, -high, high)
            right, left, span = 1, -1, (-max(low, high), max(low, high))
        if self._merged(k):
            loop = [*self._strand(name, k, 1), *upper]
        elif graze:
            rising, falling = self._strand(name, k, right), self._strand(name, k, left)[::-1]
            loop = lower + rising + upper[::-1] + falling
        else:
            loop = lower or upper  # a ball tip that trails or leads as a whole
        self._cap_face(name, k, loop, span)

    def _cap_face(self, name: str, k: int, loop: list[Edge], span: tuple[float, float]) -> None:
        s, pose = self.tool.segments[k], self.poses[name]
        middle = 0.5 * (span[0] + span[1])
        leads = 1.0 if self._leads(name) else -1.0
        along = np.cos(self.guide.gamma) * pose.heading + np.sin(self.guide.gamma) * UP
        region = normals(pose, np.linspace(*s.beta, 9).tolist(), np.linspace(*span, 25).tolist())
        kept = region[leads * (region @ along) >= -1e-9]
        hints = np.array([UP - along, UP + along, pose.left + UP, pose.left - UP])
        surface = pose.surface(s, middle, kept if len(kept) else region, hints)
        probe = loop[0].curve.at(np.array(0.5 * (loop[0].curve.t0 + loop[0].curve.t1)))
        self.build.face(surface, [loop], probe, self._skin[name] * pose.outward(s, probe))

    def _drawn_faces(self, k: int) -> None:
        """Sheets of the grazing curves of a segment."""
        for side in (1,) if self._merged(k) else (1, -1):
            first, second = self._curve("start", k, side), self._curve("end", k, side)
            tau = 0.0 if self._merged(k) else self._tau_at(k, first.curve)
            self._sheet(first, second, self._normal(tau, side))

    def _tau_at(self, k: int, curve: geo.Curve) -> float:
        """tau in the middle of a grazing curve of a segment, or of a part of it."""
        s, middle = self.tool.segments[k], 0.5 * (curve.t0 + curve.t1)
        if not s.is_arc:
            return self._tau(s.beta[0])
        if not isinstance(curve, geo.Spline):
            return middle
        return float(geo.solved(np.array([middle]), lambda x: x + self._u(x), *self._taus(k))[0])

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
    work = Ramp(profile, guide)
    build = work.make()
    return build, max(work.error, guide.error)


def _half(arcs: object, joint: int, ua: float, ub: float, side: int) -> list[Edge]:
    """Edges of one side of a circle, in the order of rising |u|."""
    if side > 0:
        return list(arcs(joint, ua, ub))  # type: ignore[operator]
    return list(arcs(joint, -ub, -ua))[::-1]  # type: ignore[operator]
