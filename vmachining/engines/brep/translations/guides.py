"""Where a rising motion carries a point and a curve of the cutter: along a straight ramp, or around a helix.

A helix turns the same curve about its axis while it rises; an upright generator draws a cylinder, other sheets
are tensor-product splines, exact in the rotation of their poles, so that only the fit of sine and cosine adds
to the error of the curve.
"""

from __future__ import annotations

from abc import ABC, abstractmethod

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from vmachining.arrays import Floats
from vmachining.engines.brep.occt import shapes as geo
from vmachining.engines.brep.occt.tolerances import CURVE_FIT_MM, NARROW_WALL_MM
from vmachining.engines.brep.translations.caps import UP, Pose
from vmachining.geometry import Arc, Line


class RampGuide(ABC):
    """A rising motion. start, end: poses; gamma: slope, rad; error: of its own splines, mm."""

    start: Pose
    end: Pose
    gamma: float
    error: float = 0.0

    @abstractmethod
    def tie(self, point: Floats) -> geo.Curve:
        """Path of a point of the tool, from its place at the start."""

    @abstractmethod
    def sheet(self, curve: geo.Curve) -> tuple[geo.Surface, float | None]:
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

    def tie(self, point: Floats) -> geo.Curve:
        return geo.Straight(point, point + self.travel)

    def sheet(self, curve: geo.Curve) -> tuple[geo.Surface, float | None]:
        along = self.travel / self.length
        if isinstance(curve, geo.Straight):
            across = np.cross(curve.end - curve.start, along)
            return geo.Plane(geo.Frame(curve.start, across, along)), None
        if isinstance(curve, geo.Circle) and abs(curve.frame.z @ along) > 1.0 - 1e-14:
            middle = curve.at(np.array(0.5 * (curve.t0 + curve.t1))) - curve.frame.origin
            return geo.Cylinder(geo.Frame(curve.frame.origin, along, -middle), curve.radius), None
        if isinstance(curve, geo.Spline):  # as a spline surface: OCCT integrates those knot by knot
            s, line = curve.spline, make_interp_spline([0.0, self.length], [0.0, self.length], k=1)
            return geo.SplineSheet(s, line, np.stack([s.c, s.c + self.travel], axis=1)), self.length
        return geo.Extrusion(curve, along), self.length


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
        self.rise, self.angle = rise, angle
        reach = path.radius + 1.0

        def wave(w: Floats) -> Floats:
            return np.column_stack([np.cos(angle * w), np.sin(angle * w)])

        fit = geo.interpolated(wave, 0.0, 1.0, 0.1 * CURVE_FIT_MM / reach)
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

    def tie(self, point: Floats) -> geo.Curve:
        return geo.Spline(BSpline(self._basis.t, self._poles(point[None, :])[0], self._basis.k), self.error)

    def sheet(self, curve: geo.Curve) -> tuple[geo.Surface, float | None]:
        if isinstance(curve, geo.Spline):
            spline = curve.spline
        elif isinstance(curve, geo.Straight):
            out = (curve.start - self.center) * [1.0, 1.0, 0.0]
            if np.abs((curve.end - curve.start)[:2]).max() < 1e-12 and np.hypot(*out[:2]) > NARROW_WALL_MM:
                half = self._turn(out + self.center, np.cos(0.5 * self.angle), np.sin(0.5 * self.angle))
                frame = geo.Frame(self.center, UP, self.center - half)
                return geo.Cylinder(frame, float(np.linalg.norm(out))), None
            t = np.array([curve.t0, curve.t1])
            spline = make_interp_spline(t, curve.at(t), k=1)
        else:
            fit = geo.interpolated(curve.at, curve.t0, curve.t1, 0.2 * CURVE_FIT_MM)  # its edge stays exact
            spline = fit.spline
            self.error = max(self.error, fit.error)
        return geo.SplineSheet(spline, self._basis, self._poles(spline.c)), 1.0
