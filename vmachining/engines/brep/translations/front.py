"""What the front of a cutter passes on a helix, wherever the axis of the helix lies.

A sweep is its first pose and what the leading surface F of the cutter passes afterwards. A helix carries F like
a screw, so what it passes is bounded by F at the start (seen from behind), F at the end, and the sheet that the
edge of F draws: the grazing curve gamma. As long as no point is passed twice this is a solid, also where the
sheet lies inside the sweep, as it does on the far side of an axis that lies in the cutter: on the side of the
axis the curve gamma comes closest to the axis where its sheet turns back,

    f = v_u^2 cos(beta) / rho + v_m^2 / R - n . a = 0        (v_u, v_m: speed along and across the circle rho,
                                                              R: radius of the meridian, a: acceleration)

with a cusp there that no kernel likes. Below (f > 0) the sheet is the boundary, above it lies inside. The cusp
is cut off by a cylinder about the axis, a little wider than the circle of the cusp. What is missing then lies
inside the first pose but for a sliver at the very start, estimated to some 1e-6 of the cube of that
radius.

Symbols: rc radius of the helix, s distance from its axis, b rise per radian; tau, beta, u as in `ramp.py`.
Known limits: a cusp and its cylinder must lie on one segment of the meridian.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from vmachining.arrays import Floats
from vmachining.engines.brep.occt.shapes import Curve, Cylinder, Frame, Straight, interpolated
from vmachining.engines.brep.occt.tolerances import APART_MM, CURVE_FIT_MM
from vmachining.engines.brep.occt.topology import Builder, Edge
from vmachining.engines.brep.translations.caps import UP
from vmachining.engines.brep.translations.guides import HelixGuide
from vmachining.engines.brep.translations.ramp import Ramp
from vmachining.geometry import Arc
from vmachining.tool import Profile, Segment

WIDER = 0.02
"""Of the radius of the cusp: by how much its cylinder is wider, if the ends of the segment leave room for that."""


class _Front(Ramp):
    """The leading surface, screwed along."""

    def __init__(self, profile: Profile, path: Arc) -> None:
        guide = HelixGuide(path)
        self._helix = guide
        self._rc, self._b = path.radius, abs(path.rise / path.angle)
        self._inner = 1 if path.angle * path.rise > 0.0 else -1  # of the motion as it rises
        self._cuts: dict[int, tuple[float, float, float]] = {}
        super().__init__(profile, guide)
        self._skin["start"] = -1.0
        for k in range(len(self.tool.segments)):
            if self._grazes(k):
                self._find(k)
        self._strands: dict[tuple[str, int], list[Edge]] = {}

    def _leads(self, name: str) -> bool:
        return True

    # -- the cusp ------------------------------------------------------------------------------------------

    def _place(self, s: Segment, x: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """(rho, z, beta, u) of gamma on the inner side; x is tau on an arc, else the share of the height."""
        x = np.asarray(x)
        if s.is_arc:
            beta = np.arcsin(np.clip(-np.cos(self.guide.gamma) * np.cos(x), -1.0, 1.0))
            return s.cr + s.radius * np.cos(beta), s.cz + s.radius * np.sin(beta), beta, self._u(x)
        beta = np.full(x.shape, s.beta[0])
        u = np.full(x.shape, self._angle(s.beta[0]))
        return (1.0 - x) * s.r0 + x * s.r1, (1.0 - x) * s.z0 + x * s.z1, beta, u

    def _turns(self, s: Segment, x: Floats) -> Floats:
        """f of the docstring: positive where the sheet is the boundary."""
        rho, _, beta, u = self._place(s, x)
        around = self._rc * np.sin(u)
        across = -self._rc * np.sin(beta) * np.cos(u) + self._b * np.cos(beta)
        bend = across**2 / s.radius if s.is_arc else 0.0
        return np.asarray(
            around**2 * np.cos(beta) / np.maximum(rho, 1e-300) + bend - self._rc * np.cos(beta) * np.sin(u)
        )

    def _from_axis(self, s: Segment, x: float) -> float:
        rho, _, _, u = self._place(s, np.array(x))
        return float(np.sqrt(max(float(self._rc**2 + rho**2 - 2.0 * self._rc * rho * np.sin(u)), 0.0)))

    def _span(self, k: int) -> tuple[float, float]:
        return self._taus(k) if self.tool.segments[k].is_arc else (0.0, 1.0)

    def _find(self, k: int) -> None:
        """Where the cylinder about the cusp meets gamma, and its radius."""
        s, (x0, x1) = self.tool.segments[k], self._span(k)
        x = x0 + (x1 - x0) * (0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 401)))[1:-1]
        f = self._turns(s, x)
        change = np.flatnonzero((f[:-1] > 0.0) & (f[1:] <= 0.0))
        if not len(change):
            return
        j = int(change[0])
        cusp = brentq(lambda t: float(self._turns(s, np.array(t))), x[j], x[j + 1], xtol=1e-15)
        here, low, high = (self._from_axis(s, t) for t in (cusp, x0, x1))
        size = here + min(WIDER * here, 0.5 * (low - here), 0.5 * (high - here))
        if size < here + APART_MM:
            return
        first, last = (
            float(brentq(lambda t: self._from_axis(s, t) - size, a, b, xtol=1e-15))
            for a, b in ((x0, cusp), (cusp, x1))
        )
        self._cuts[k] = first, last, size

    # -- curves --------------------------------------------------------------------------------------------

    def _strand(self, name: str, k: int, side: int) -> list[Edge]:
        if k not in self._cuts or (side != self._inner and not self._merged(k)):
            return super()._strand(name, k, side)
        if (name, k) not in self._strands:
            made = [self.build.edge(curve) for curve in self._parts(name, k)]
            self.error = max([self.error, *(getattr(e.curve, "error", 0.0) for e in made)])
            self._strands[name, k] = made
        return self._strands[name, k]

    def _parts(self, name: str, k: int) -> list[Curve]:
        """gamma up to the cylinder, along it, and on; of a merged one all of it."""
        s, pose, side = self.tool.segments[k], self.poses[name], self._inner
        first, last, size = self._cuts[k]
        x0, x1 = self._span(k)

        def part(a: float, b: float) -> Curve:
            if s.is_arc:
                return self._arc(name, k, side, a, b)
            (r0, r1), (z0, z1), _, (u, _) = self._place(s, np.array([a, b]))
            return Straight(pose.point(r0, z0, side * u), pose.point(r1, z1, side * u))

        def along(q: Floats) -> Floats:
            """Points of the cutter on the cylinder, in front; q runs from 0 to 1."""
            rho, z, _, _ = self._place(s, np.array([first, last]))
            if s.is_arc:
                b = np.arctan2(z - s.cz, rho - s.cr)
                beta = b[0] + (b[1] - b[0]) * q
                rho, z = s.cr + s.radius * np.cos(beta), s.cz + s.radius * np.sin(beta)
            else:
                rho, z = rho[0] + (rho[1] - rho[0]) * q, z[0] + (z[1] - z[0]) * q
            sin = (self._rc**2 + rho**2 - size**2) / (2.0 * self._rc * rho)
            cos = np.sqrt(np.maximum(1.0 - sin**2, 0.0))
            radial = cos[:, None] * pose.heading + side * sin[:, None] * pose.left
            return np.asarray(pose.tip + rho[:, None] * radial + z[:, None] * UP)

        begin = -x1 if self._merged(k) else x0  # then the long part runs through the tip to the other side
        return [part(begin, first), interpolated(along, 0.0, 1.0, CURVE_FIT_MM), part(last, x1)]

    # -- faces ---------------------------------------------------------------------------------------------

    def _drawn_faces(self, k: int) -> None:
        s = self.tool.segments[k]
        for side in (1,) if self._merged(k) else (1, -1):
            pairs = zip(self._strand("start", k, side), self._strand("end", k, side), strict=True)
            inner = side == self._inner or self._merged(k)
            for number, (first, second) in enumerate(pairs):
                if k in self._cuts and inner and number == 1:
                    self._tube(k, first, second)
                    continue
                if self._merged(k):
                    which, tau = self._inner, 0.5 * (first.curve.t0 + first.curve.t1)
                    if k not in self._cuts:
                        which = 1
                else:
                    which, tau = side, self._tau_at(k, first.curve)
                turned = False
                if inner and which == self._inner:
                    share = 0.5 * sum(self._span(k))
                    if k in self._cuts:
                        cut = self._cuts[k]
                        share = 0.5 * (
                            self._span(k)[0] + cut[0] if number == 0 else cut[1] + self._span(k)[1]
                        )
                    turned = tau >= 0.0 and float(self._turns(s, np.array(tau if s.is_arc else share))) <= 0.0
                outward = self._normal(tau, which)
                self._sheet(first, second, -outward if turned else outward)

    def _tube(self, k: int, first: Edge, second: Edge) -> None:
        """The part of the cylinder about the axis between the curves on it."""
        left, right = self._tie(first, last=False), self._tie(first, last=True)
        center = np.array([*self._helix.center[:2], 0.0])
        middle = self._helix.tie(first.curve.at(np.array([0.5 * (first.curve.t0 + first.curve.t1)]))[0])
        probe = middle.at(np.array([0.5 * (middle.t0 + middle.t1)]))[0]
        out = (probe - center) * [1.0, 1.0, 0.0]
        surface = Cylinder(Frame(center, UP, -out), self._cuts[k][2])
        self.build.face(surface, [[first, right, second, left]], probe, -out)


def front(profile: Profile, path: Arc) -> tuple[Builder, float]:
    """What the front of a convex profile passes on a helix, and the largest error of a fitted curve (mm)."""
    work = _Front(profile, path)
    build = work.make()
    return build, max(work.error, work.guide.error)
