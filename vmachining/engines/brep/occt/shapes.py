"""Curves and surfaces that know their OCCT twin, their numpy formula and its inverse.

Every face gets its curves in the plane of its parameters from here, computed and measured, not projected by
the kernel. Symbols: P origin, X, Y, Z frame; u, v parameters of a surface, t of a curve. Lengths in mm.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from OCP import Geom
from OCP.gp import gp_Ax1, gp_Ax2, gp_Ax3, gp_Circ, gp_Dir, gp_Pnt
from OCP.TColgp import TColgp_Array1OfPnt, TColgp_Array2OfPnt
from OCP.TColStd import TColStd_Array1OfInteger, TColStd_Array1OfReal
from scipy.interpolate import BSpline, make_interp_spline

from vmachining.arrays import Floats

TURN = 2.0 * np.pi
DEGREE = 5
"""Of every interpolated curve: the error falls with the sixth power of the spacing, so few knots serve."""


def solved(q: Floats, f: Callable[[Floats], Floats], lo: float, hi: float) -> Floats:
    """x in [lo, hi] with f(x) = q for a rising f, by bisection."""
    a, b = np.full(len(q), lo), np.full(len(q), hi)
    for _ in range(60):
        x = 0.5 * (a + b)
        high = f(x) > q
        a, b = np.where(high, a, x), np.where(high, x, b)
    return np.asarray(0.5 * (a + b))


def pnt(p: Floats) -> gp_Pnt:
    """A point for the kernel."""
    return gp_Pnt(float(p[0]), float(p[1]), float(p[2]))


def _dir(d: Floats) -> gp_Dir:
    return gp_Dir(float(d[0]), float(d[1]), float(d[2]))


@dataclass(frozen=True, slots=True, eq=False)
class Frame:
    """Right-handed frame: origin (3,) mm, unit z and x (3,); x is made orthogonal to z."""

    origin: Floats
    z: Floats
    x: Floats
    y: Floats = field(init=False)

    def __post_init__(self) -> None:
        z = np.asarray(self.z, dtype=np.float64) / np.linalg.norm(self.z)
        x = np.asarray(self.x, dtype=np.float64) - (self.x @ z) * z
        x = x / np.linalg.norm(x)
        object.__setattr__(self, "z", z)
        object.__setattr__(self, "x", x)
        object.__setattr__(self, "y", np.cross(z, x))

    def local(self, points: Floats) -> Floats:
        """(..., 3) coordinates in the frame."""
        d = points - self.origin
        return np.stack([d @ self.x, d @ self.y, d @ self.z], axis=-1)

    def world(self, a: Floats, b: Floats, c: Floats) -> Floats:
        """(..., 3) points from coordinates in the frame."""
        a, b, c = np.broadcast_arrays(a, b, c)
        return np.asarray(self.origin + a[..., None] * self.x + b[..., None] * self.y + c[..., None] * self.z)

    @property
    def ax3(self) -> gp_Ax3:
        return gp_Ax3(pnt(self.origin), _dir(self.z), _dir(self.x))

    @property
    def ax2(self) -> gp_Ax2:
        return gp_Ax2(pnt(self.origin), _dir(self.z), _dir(self.x))


# -- curves --------------------------------------------------------------------------------------------------


class Curve(ABC):
    """Bounded curve: runs from t0 to t1."""

    t0: float
    t1: float

    @property
    @abstractmethod
    def geom(self) -> Any:
        """The OCCT curve with the same parameter."""

    @abstractmethod
    def at(self, t: Floats) -> Floats:
        """(n, 3) mm."""

    @property
    def ends(self) -> Floats:
        """(2, 3) mm."""
        return self.at(np.array([self.t0, self.t1]))


@dataclass(frozen=True, slots=True, eq=False)
class Straight(Curve):
    """Line through two points; t is the length from `start`."""

    start: Floats
    end: Floats

    @property
    def t0(self) -> float:  # type: ignore[override]
        return 0.0

    @property
    def t1(self) -> float:  # type: ignore[override]
        return float(np.linalg.norm(self.end - self.start))

    @property
    def geom(self) -> Any:
        return Geom.Geom_Line(pnt(self.start), _dir(self.end - self.start))

    def at(self, t: Floats) -> Floats:
        direction = (self.end - self.start) / self.t1
        return np.asarray(self.start + np.asarray(t)[..., None] * direction)


@dataclass(frozen=True, slots=True, eq=False)
class Circle(Curve):
    """Arc of a circle in the x-y plane of a frame; t is the angle from x."""

    frame: Frame
    radius: float
    t0: float
    t1: float

    @property
    def geom(self) -> Any:
        return Geom.Geom_Circle(gp_Circ(self.frame.ax2, self.radius))

    def at(self, t: Floats) -> Floats:
        t = np.asarray(t)
        return self.frame.world(self.radius * np.cos(t), self.radius * np.sin(t), np.zeros_like(t))


@dataclass(frozen=True, slots=True, eq=False)
class Spline(Curve):
    """B-spline curve; `error` is its measured distance (mm) from what it represents."""

    spline: BSpline
    error: float

    @property
    def t0(self) -> float:  # type: ignore[override]
        return float(self.spline.t[0])

    @property
    def t1(self) -> float:  # type: ignore[override]
        return float(self.spline.t[-1])

    @property
    def geom(self) -> Any:
        poles = TColgp_Array1OfPnt(1, len(self.spline.c))
        for k, p in enumerate(self.spline.c, start=1):
            poles.SetValue(k, pnt(p))
        return Geom.Geom_BSplineCurve(poles, *knots_of(self.spline), self.spline.k)

    def at(self, t: Floats) -> Floats:
        return np.asarray(self.spline(np.clip(t, self.t0, self.t1)))


@dataclass(frozen=True, slots=True, eq=False)
class Part(Curve):
    """A curve between two of its parameters."""

    whole: Curve
    t0: float
    t1: float

    @property
    def geom(self) -> Any:
        return self.whole.geom

    def at(self, t: Floats) -> Floats:
        return self.whole.at(t)


def knots_of(spline: BSpline) -> tuple[Any, Any]:
    """Distinct knots and multiplicities as OCCT arrays."""
    values, counts = np.unique(spline.t, return_counts=True)
    knots, mults = TColStd_Array1OfReal(1, len(values)), TColStd_Array1OfInteger(1, len(values))
    for k, (value, count) in enumerate(zip(values.tolist(), counts.tolist(), strict=True), start=1):
        knots.SetValue(k, value)
        mults.SetValue(k, count)
    return knots, mults


def interpolated(
    f: Callable[[Floats], Floats], a: float, b: float, tol: float, *, first: int = 9, most: int = 1200
) -> Spline:
    """Quintic spline through exact points of f on [a, b], with more nodes where it misses by more than `tol`.

    `Spline.error` carries what was reached; see `nodes_for`.
    """
    nodes, error = nodes_for(f, a, b, tol, first=first, most=most)
    return Spline(make_interp_spline(nodes, f(nodes), k=DEGREE), error)


def nodes_for(
    f: Callable[[Floats], Floats], a: float, b: float, tol: float, *, first: int = 9, most: int = 1200
) -> tuple[Floats, float]:
    """Where a quintic spline has to meet f on [a, b], and by how much it misses f between.

    f : callable
        (n,) parameters -> (n, k) exact points.
    tol : float, largest distance between spline and f allowed between the nodes, in the unit of f.

    The error is measured at the quarters of every interval; nodes end at `most`.
    """
    nodes = np.linspace(a, b, max(first, DEGREE + 1))
    while True:
        spline = make_interp_spline(nodes, f(nodes), k=DEGREE)
        share = np.array([0.25, 0.5, 0.75])
        probes = nodes[:-1, None] + np.diff(nodes)[:, None] * share
        miss = np.linalg.norm(spline(probes.ravel()) - f(probes.ravel()), axis=-1).reshape(probes.shape)
        worst = miss.max(axis=1)
        bad = worst > tol
        if not bad.any() or len(nodes) >= most:
            return nodes, float(worst.max())
        bad[:-1] |= worst[1:] > tol  # neighbours too: neighbouring intervals of very unequal length oscillate
        bad[1:] |= worst[:-1] > tol
        nodes = np.sort(np.concatenate([nodes, probes[bad, 1]]))


# -- surfaces ------------------------------------------------------------------------------------------------


class Surface(ABC):
    """A surface with parameters (u, v). `middle`: where in the period its face lies; `apex`: None or v."""

    period: tuple[float, float] = (0.0, 0.0)
    middle: tuple[float, float] = (np.pi, 0.0)

    @property
    @abstractmethod
    def geom(self) -> Any:
        """The OCCT surface with the same parameters."""

    @abstractmethod
    def at(self, uv: Floats) -> Floats:
        """(n, 3) points."""

    @abstractmethod
    def invert(self, points: Floats) -> Floats:
        """(n, 2) parameters of points on it; u is NaN where the surface has no single one."""


@dataclass(frozen=True, slots=True, eq=False)
class Plane(Surface):
    """x-y plane of a frame."""

    frame: Frame

    @property
    def geom(self) -> Any:
        return Geom.Geom_Plane(self.frame.ax3)

    def at(self, uv: Floats) -> Floats:
        return self.frame.world(uv[..., 0], uv[..., 1], np.zeros(uv.shape[:-1]))

    def invert(self, points: Floats) -> Floats:
        return np.asarray(self.frame.local(points)[..., :2])


class _Turned(Surface):
    """Surface of revolution about z of its frame; u is the angle from x."""

    frame: Frame

    def meridian(self, v: Floats) -> tuple[Floats, Floats]:
        """(rho, z) at v."""
        raise NotImplementedError

    def along(self, rho: Floats, z: Floats) -> Floats:
        """v of (rho, z)."""
        raise NotImplementedError

    def at(self, uv: Floats) -> Floats:
        rho, z = self.meridian(uv[..., 1])
        return self.frame.world(rho * np.cos(uv[..., 0]), rho * np.sin(uv[..., 0]), z)

    def invert(self, points: Floats) -> Floats:
        q = self.frame.local(points)
        rho = np.hypot(q[..., 0], q[..., 1])
        u = np.where(rho > 1e-9, np.arctan2(q[..., 1], q[..., 0]), np.nan)
        return np.stack([u, self.along(rho, q[..., 2])], axis=-1)


@dataclass(frozen=True, slots=True, eq=False)
class _Round(_Turned):
    """Radius where v is zero."""

    frame: Frame
    radius: float
    period = (TURN, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Cylinder(_Round):
    """v is the height."""

    @property
    def geom(self) -> Any:
        return Geom.Geom_CylindricalSurface(self.frame.ax3, self.radius)

    def meridian(self, v: Floats) -> tuple[Floats, Floats]:
        return np.full(np.shape(v), self.radius), v

    def along(self, rho: Floats, z: Floats) -> Floats:
        return z


@dataclass(frozen=True, slots=True, eq=False)
class Cone(_Round):
    """The radius grows with tan(half angle); v is the length along the generator."""

    half_angle: float

    @property
    def geom(self) -> Any:
        return Geom.Geom_ConicalSurface(self.frame.ax3, self.half_angle, self.radius)

    def meridian(self, v: Floats) -> tuple[Floats, Floats]:
        return self.radius + v * np.sin(self.half_angle), v * np.cos(self.half_angle)

    def along(self, rho: Floats, z: Floats) -> Floats:
        return np.asarray(z / np.cos(self.half_angle))


@dataclass(frozen=True, slots=True, eq=False)
class Torus(_Turned):
    """Circle of radius `minor` at distance `major` from z; v is the angle above the outer equator.

    A major radius that is negative or below the minor one (the circle crosses the axis) is a surface of
    revolution for OCCT, of which only the part with rho >= 0 is used.
    """

    frame: Frame
    major: float
    minor: float
    middle: tuple[float, float] = (np.pi, 1.75 * np.pi)
    period = (TURN, TURN)

    @property
    def geom(self) -> Any:
        f = self.frame
        if self.major > self.minor:
            return Geom.Geom_ToroidalSurface(f.ax3, self.major, self.minor)
        center = Frame(f.origin + self.major * f.x, -f.y, f.x)
        circle = Geom.Geom_Circle(gp_Circ(center.ax2, self.minor))
        return Geom.Geom_SurfaceOfRevolution(circle, gp_Ax1(pnt(f.origin), _dir(f.z)))

    def meridian(self, v: Floats) -> tuple[Floats, Floats]:
        return self.major + self.minor * np.cos(v), self.minor * np.sin(v)

    def along(self, rho: Floats, z: Floats) -> Floats:
        return np.arctan2(z, rho - self.major)


@dataclass(frozen=True, slots=True, eq=False)
class Sphere(_Round):
    """v is the latitude."""

    @property
    def geom(self) -> Any:
        return Geom.Geom_SphericalSurface(self.frame.ax3, self.radius)

    def meridian(self, v: Floats) -> tuple[Floats, Floats]:
        return self.radius * np.cos(v), self.radius * np.sin(v)

    def along(self, rho: Floats, z: Floats) -> Floats:
        return np.arctan2(z, rho)


@dataclass(frozen=True, slots=True, eq=False)
class Extrusion(Surface):
    """A curve moved along a unit direction; u is the parameter of the curve, v the length."""

    curve: Curve
    direction: Floats

    @property
    def geom(self) -> Any:
        return Geom.Geom_SurfaceOfLinearExtrusion(self.curve.geom, _dir(self.direction))

    def at(self, uv: Floats) -> Floats:
        return np.asarray(self.curve.at(uv[..., 0]) + uv[..., 1, None] * self.direction)

    def invert(self, points: Floats) -> Floats:
        raise NotImplementedError("edges of an extrusion are given with their parameters")


@dataclass(frozen=True, slots=True, eq=False)
class SplineSheet(Surface):
    """Tensor product of two knot vectors; poles (n_u, n_v, 3)."""

    u: BSpline
    v: BSpline
    poles: Floats

    @property
    def geom(self) -> Any:
        n, m = self.poles.shape[:2]
        grid = TColgp_Array2OfPnt(1, n, 1, m)
        for i in range(n):
            for j in range(m):
                grid.SetValue(i + 1, j + 1, pnt(self.poles[i, j]))
        (ku, mu), (kv, mv) = knots_of(self.u), knots_of(self.v)
        return Geom.Geom_BSplineSurface(grid, ku, kv, mu, mv, self.u.k, self.v.k)

    def at(self, uv: Floats) -> Floats:
        a, b = (
            BSpline.design_matrix(np.clip(w.ravel(), s.t[0], s.t[-1]), s.t, s.k).toarray()
            for w, s in ((uv[..., 0], self.u), (uv[..., 1], self.v))
        )
        return np.asarray(np.einsum("ni,nj,ijk->nk", a, b, self.poles).reshape(*uv.shape[:-1], 3))

    def invert(self, points: Floats) -> Floats:
        raise NotImplementedError("edges of a sheet are given with their parameters")
