"""Stretches of the grazing curve of a tool whose axis turns: on one face or edge, exact at every time.

Symbols: c tip, A axis, V = dc/dt, S = dA/dt; x, y unit vectors with (x, y, A) right-handed that follow the axis
smoothly; u angle from x, m(u) = x cos u + y sin u; beta normal angle of the meridian. On a circle of height z,
radius r and normal (cos b, sin b) the speed along the normal is f(u) = a cos u + b sin u + c with heading
phi = atan2(b, a); it grazes at u = phi -+ acos(-c / hypot(a, b)) and leads in between (`vmachining.sweep.grazing`).
The side +1 is the upper of the two angles.

| segment | on | given by |
|---|---|---|
| `LineSide` | cylinder, cone | u of every height, once per side |
| `LineTurn` | cone from one side of a ring to the other | both angles of every height |
| `ArcSide` | torus between two rings | u of every normal angle, once per side |
| `ArcTurn` | torus from one side of a ring to the other | normal angle of every u, tan beta = -D / N |
| `BallTurn` | ball, below | great circle of normals square to the velocity of the centre |
| `EdgeSpan` | sharp edge | angles between two ends |
| `RimPatch` | sharp edge | angles that stay |
| `Chord` | disc | straight line |

Source: the v-form of the toroidal grazing condition of Weinert, Du, Damm, Stautner (2004) (`vmachining.sweep.weinert`), here
for any arc: f = cos b D(u) + sin b N(u), D = m.(V + z_c S), N = A.V - r_c m.S.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Protocol

import numpy as np
from scipy.interpolate import make_interp_spline

from vmachining.arrays import Floats
from vmachining.engines.brep.translations.caps import Pose
from vmachining.errors import SweepError
from vmachining.sweep import Turn
from vmachining.sweep.grazing import Circles, circles_along, grazing_angles, line_terms, scalars
from vmachining.sweep.weinert import torus_angle, torus_terms
from vmachining.tool import Segment

CORNERS, FINEST = 97, 769
"""Of the polygon that measures a curve, and of one that measures a curve with a sharp bend."""

WITHIN, BACK = 8, 1e-5
"""Looks at every side of it, and by how much of the parameter shares may run back from one to the next."""

LOOKS, LONG = 4, 0.1
"""A polygon one side of which is longer than this share of it is put up this often."""

GAUSS = np.polynomial.legendre.leggauss(16)
"""Exact for polynomials of degree 31 in t."""

DENSE = 65
"""Times at which a block is looked at as a whole."""


class State(NamedTuple):
    """The motion at n times: t (n,), the rest (n, 3); mm and per unit of t."""

    t: Floats
    tip: Floats
    axis: Floats
    velocity: Floats
    rate: Floats
    x: Floats
    y: Floats

    def radial(self, u: Floats) -> Floats:
        """m(u), (n, m, 3) of u (n, m)."""
        return np.asarray(np.cos(u)[..., None] * self.x[:, None] + np.sin(u)[..., None] * self.y[:, None])


class Moving:
    """A turn in its own time w in [0, 1]; slow at an end where `soft`, so that square roots of t are smooth.

    soft : two offsets: how long (in t) before the start and after the end the shape of the grazing curve
        changes; infinite where it does not.
    """

    def __init__(self, path: Turn, soft: tuple[float, float] = (np.inf, np.inf)) -> None:
        self.path, self._soft = path, soft
        dense = path.axis(np.linspace(0.0, 1.0, DENSE))
        normal = np.cross(dense[0], dense[-1])
        size = float(np.linalg.norm(normal))
        candidates = [*np.eye(3), *([normal / size] if size > 1e-6 else [])]
        lean = [float(np.abs(dense @ e).max()) for e in candidates]
        if min(lean) > 0.99:
            raise SweepError("the tool axis turns too far in one block", remedy="split the block")
        self._side = candidates[int(np.argmin(lean))]

    def time(self, w: Floats) -> Floats:
        """t of w."""
        a, b = self._soft
        w = np.asarray(w, dtype=np.float64)
        if np.isinf(a) and np.isinf(b):
            return w
        if np.isinf(b):
            e = np.sqrt(a) / (np.sqrt(1.0 + a) - np.sqrt(a))
            t = ((w + e) ** 2 - e**2) / ((1.0 + e) ** 2 - e**2)
        elif np.isinf(a):
            e = np.sqrt(b) / (np.sqrt(1.0 + b) - np.sqrt(b))
            t = 1.0 - ((1.0 - w + e) ** 2 - e**2) / ((1.0 + e) ** 2 - e**2)
        else:
            whole = 1.0 + a + b
            lo, hi = np.arcsin(np.sqrt(a / whole)), np.arcsin(np.sqrt((1.0 + a) / whole))
            t = whole * np.sin(lo + (hi - lo) * w) ** 2 - a
        return np.asarray(np.where(w == 0.0, 0.0, np.where(w == 1.0, 1.0, np.clip(t, 0.0, 1.0))))

    def state(self, w: Floats) -> State:
        """At times w (n,)."""
        t = self.time(w)
        A = self.path.axis(t)
        x = self._side - (A @ self._side)[:, None] * A
        x /= np.linalg.norm(x, axis=1, keepdims=True)
        p = self.path
        return State(t, p.position(t), A, p.velocity(t), p.axis_rate(t), x, np.cross(A, x))

    def means(self, t0: float, t: Floats) -> tuple[Floats, Floats]:
        """(n, 3): means of the velocity and of the rate of the axis between t0 and t (n,), mm and 1 per unit of t.

        Differences of places over differences of time, but without the digits that those lose far from the origin.
        """
        x, weight = GAUSS
        times = (t0 + 0.5 * (x + 1.0) * (np.asarray(t)[:, None] - t0)).ravel()
        rates = (self.path.velocity(times), self.path.axis_rate(times))
        velocity, rate = (0.5 * weight @ v.reshape(-1, len(x), 3) for v in rates)
        return velocity, rate

    def pose(self, w: float) -> Pose:
        """The tool at one time, its heading x."""
        s = self.state(np.array([w]))
        return Pose(s.tip[0], s.x[0], s.axis[0])


def wave(st: State, r: Floats, z: Floats, beta: Floats) -> Circles:
    """a, b, c of circles (n, m) at n times."""
    return circles_along(st.velocity, st.rate, st.axis, (st.x, st.y), z, r, np.cos(beta), np.sin(beta))


def angle(of: Circles, side: float) -> Floats:
    """phi -+ acos(-c / r), phi in (-pi, pi]; NaN without a root."""
    return np.asarray(grazing_angles(of)[..., 0 if side < 0 else 1])


def near(u: Floats, target: Floats) -> Floats:
    """u plus whole turns, as near to a target as it gets."""
    return np.asarray(u + 2.0 * np.pi * np.round((target - u) / (2.0 * np.pi)))


End = tuple[int, int]
"""(ring, side)."""


class Angles(Protocol):
    """What a segment asks of the curve it is part of."""

    def angle(self, ring: int, side: int, st: State) -> Floats:
        """(n,) where a side of a ring grazes."""

    def span(self, ends: tuple[End, End], st: State, s: Floats) -> Floats:
        """(n, m) angles shared evenly between two ends."""

    def between(self, ends: tuple[End, End], st: State, s: Floats, raw: Floats) -> Floats:
        """(n, m) angles on the branch that joins two ends."""


@dataclass(frozen=True, eq=False)
class CurveSegment(ABC):
    """The grazing curve on one face or edge; s in [0, 1] runs from `ends[0]` to `ends[1]`.

    element : number of the face or edge from the bottom. bend : 1 / radius of the meridian, 1 / mm.
    """

    element: int
    ends: tuple[End, End]
    bend: ClassVar[float] = 0.0
    linear: ClassVar[bool] = False

    @abstractmethod
    def place(self, of: Angles, st: State, s: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """(r, z, beta, u), each (n, m), at n times and m places s."""

    def points(self, of: Angles, st: State, s: Floats) -> Floats:
        """(n, m, 3) mm."""
        r, z, _, u = self.place(of, st, s)
        return np.asarray(st.tip[:, None] + z[..., None] * st.axis[:, None] + r[..., None] * st.radial(u))

    def normals(self, of: Angles, st: State, s: Floats) -> Floats:
        """(n, m, 3) outward."""
        _, _, beta, u = self.place(of, st, s)
        out = np.cos(beta)[..., None] * st.radial(u)
        return np.asarray(out + np.sin(beta)[..., None] * st.axis[:, None])


@dataclass(frozen=True, eq=False)
class LineSide(CurveSegment):
    """One side of a cylinder or a cone.

    bent : whether it all but turns at an end at some time, so that its angle goes by a square root of the height:
        even shares of its length then instead of the height.
    """

    segment: Segment
    bent: bool = False

    def place(self, of: Angles, st: State, s: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        g = self.segment

        def at(x: Floats) -> tuple[Floats, Floats, Floats, Floats]:
            shape = (len(st.t), x.shape[-1])
            r, z = (np.broadcast_to(a + x * (b - a), shape) for a, b in ((g.r0, g.r1), (g.z0, g.z1)))
            beta = np.full(shape, g.beta[0])
            return r, z, beta, of.between(self.ends, st, x, angle(wave(st, r, z, beta), self.ends[0][1]))

        return at(evened(at, len(st.t), s) if self.bent else s)


@dataclass(frozen=True, eq=False)
class LineTurn(CurveSegment):
    """A cone from one side of a ring to the other one, by the square root of the way to where it turns."""

    segment: Segment
    last: bool  # whether the ring is the upper one

    def place(self, of: Angles, st: State, s: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        g, ring = self.segment, self.ends[0][0]
        first, slope, bend = line_terms(g) @ scalars(st.velocity, st.rate, st.axis)
        with np.errstate(divide="ignore", invalid="ignore"):
            root = np.sqrt(np.maximum(slope * slope - 4.0 * first * bend, 0.0))
            q = -0.5 * (slope + np.where(slope < 0.0, -root, root))
            both = np.stack([q / bend, first / q])
        both = np.where((both >= 0.0) & (both <= 1.0), both, np.nan)
        turn = (np.nanmax if self.last else np.nanmin)(both, axis=0)[:, None]
        sigma = 2.0 * s - 1.0
        way = float(self.last) - turn
        x = turn + way * sigma**2
        deep = np.sqrt(np.maximum(way * (slope[:, None] + bend[:, None] * (x + turn)), 0.0)) * np.abs(sigma)
        r, z = g.r0 + x * (g.r1 - g.r0), g.z0 + x * (g.z1 - g.z0)
        beta = np.full(r.shape, g.beta[0])
        a, b, c = wave(st, r, z, beta)
        middle = 0.5 * (of.angle(ring, -1, st) + of.angle(ring, 1, st))[:, None]
        phi, half = near(np.arctan2(b, a), middle), np.arctan2(deep, -c)
        e0, e1 = self.ends[0][1], self.ends[1][1]
        return r, z, beta, phi + np.where(sigma < 0.0, e0 * half, e1 * half + 2.0 * np.pi * (e0 > e1))


@dataclass(frozen=True, eq=False)
class Round(CurveSegment):
    """On an arc of the meridian."""

    segment: Segment

    @property
    def bend(self) -> float:  # type: ignore[override]
        return 1.0 / self.segment.radius


@dataclass(frozen=True, eq=False)
class ArcSide(Round):
    """One side of a torus, from its lower to its upper ring."""

    def place(self, of: Angles, st: State, s: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        g = self.segment
        b0, b1 = g.beta

        def at(x: Floats) -> tuple[Floats, Floats, Floats, Floats]:
            beta = b0 + x * (b1 - b0)
            r, z = g.cr + g.radius * np.cos(beta), g.cz + g.radius * np.sin(beta)
            return r, z, beta, of.between(self.ends, st, x, angle(wave(st, r, z, beta), self.ends[0][1]))

        return at(evened(at, len(st.t), s))


@dataclass(frozen=True, eq=False)
class ArcTurn(Round):
    """A torus from one side of a ring to the other one; `looks` and `corners` of `evened`."""

    looks: int = 1
    corners: int = CORNERS

    def place(self, of: Angles, st: State, s: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        g = self.segment

        def at(x: Floats) -> tuple[Floats, Floats, Floats, Floats]:
            u = of.span(self.ends, st, x)
            beta = graze_beta(st, g.cr, g.cz, u, 0.5 * sum(g.beta))
            return g.cr + g.radius * np.cos(beta), g.cz + g.radius * np.sin(beta), beta, u

        return at(evened(at, len(st.t), s, self.looks, self.corners))


@dataclass(frozen=True, eq=False)
class BallTurn(Round):
    """A ball below its upper ring."""

    def place(self, of: Angles, st: State, s: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        g, A = self.segment, st.axis
        V = st.velocity + g.cz * st.rate
        V = V / np.linalg.norm(V, axis=1, keepdims=True)
        low = (A * V).sum(1)[:, None] * V - A
        steep = np.linalg.norm(low, axis=1)
        left = np.cross(A, V) / steep[:, None]
        last = np.arccos(np.clip(-np.sin(g.beta[1]) / steep, -1.0, 1.0))
        tau = (2.0 * s - 1.0) * last[:, None]
        N = np.cos(tau)[..., None] * (low / steep[:, None])[:, None] + np.sin(tau)[..., None] * left[:, None]
        u = np.arctan2((N * st.y[:, None]).sum(-1), (N * st.x[:, None]).sum(-1))
        beta = np.arctan2((N * A[:, None]).sum(-1), np.linalg.norm(np.cross(N, A[:, None]), axis=-1))
        return g.radius * np.cos(beta), g.cz + g.radius * np.sin(beta), beta, u


@dataclass(frozen=True, eq=False)
class EdgeSpan(CurveSegment):
    """A sharp edge between two angles; beta: the middle of its normals."""

    r: float
    z: float
    beta: float

    def angles(self, of: Angles, st: State, s: Floats) -> Floats:
        """(n, m) at n times and m places s."""
        return of.span(self.ends, st, s)

    def place(self, of: Angles, st: State, s: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        u = self.angles(of, st, s)
        beta = graze_beta(st, self.r, self.z, u, self.beta)
        return np.full(u.shape, self.r), np.full(u.shape, self.z), beta, u


@dataclass(frozen=True, eq=False)
class RimPatch(EdgeSpan):
    """The same between two angles that do not change; its face is trimmed (`vmachining.engines.brep.envelopes.lens`)."""

    lo: float
    hi: float

    def angles(self, of: Angles, st: State, s: Floats) -> Floats:
        return np.broadcast_to(self.lo + s * (self.hi - self.lo), (len(st.t), len(s)))


@dataclass(frozen=True, eq=False)
class Chord(CurveSegment):
    """A disc, from one side of its rim to the other."""

    r: float
    z: float
    beta: float
    linear = True

    def place(self, of: Angles, st: State, s: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        ua, ub = (of.angle(*end, st)[:, None] for end in self.ends)
        p = (1.0 - s) * self.r * np.cos(ua) + s * self.r * np.cos(ub)
        q = (1.0 - s) * self.r * np.sin(ua) + s * self.r * np.sin(ub)
        full = np.full(p.shape, 1.0)
        return np.hypot(p, q), self.z * full, self.beta * full, np.arctan2(q, p)


def evened(
    at: Callable[[Floats], tuple[Floats, Floats, Floats, Floats]],
    count: int,
    s: Floats,
    looks: int = 1,
    corners: int = CORNERS,
) -> Floats:
    """Parameters x (n, m) of a curve at shares s (m,) of its length on the body, at every time.

    The curve runs up a meridian and fast around the bottom of a level cutter: in u or beta alone it has a corner.
    Lengths are those of a polygon with many corners close to both ends; only their smoothness matters. With more
    `looks` the polygon is put up again with corners at equal lengths.

    Raises SweepError: Corners fall into one place, or the shares would run back along the curve by more than `BACK`: a
        sheet through them lies upon itself.
    """
    share = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, corners))
    share[-1] = 1.0
    x = np.broadcast_to(share, (count, corners))
    length = _lengths(at, x)
    for _ in range(looks - 1):
        x = np.stack([np.interp(share, *row) for row in zip(length, x, strict=True)])
        length = _lengths(at, x)
    within = np.arange(WITHIN) / WITHIN
    found, back = np.empty((count, len(s))), 0.0
    try:
        for k in range(count):
            spline = make_interp_spline(length[k], x[k], k=5)
            places = length[k, :-1, None] + within * np.diff(length[k])[:, None]
            looked = spline(np.append(places.ravel(), length[k, -1]))
            found[k], back = spline(s), max(back, -float(np.diff(looked).min()))
    except ValueError as error:  # also of singular matrices: corners of the polygon in one place
        raise SweepError("the grazing curve stands still on the body, or jumps") from error
    if back > BACK:
        raise SweepError("the grazing curve is too uneven for a spline along it")
    return np.asarray(np.where(s == 0.0, 0.0, np.where(s == 1.0, 1.0, found)))


def _lengths(at: Callable[[Floats], tuple[Floats, Floats, Floats, Floats]], x: Floats) -> Floats:
    """(n, m) shares of the length of a polygon on the body at its corners x (n, m)."""
    r, z, _, u = at(x)
    steps = np.diff(np.stack([r * np.cos(u), r * np.sin(u), z]), axis=-1)
    length = np.zeros(x.shape)
    np.cumsum(np.sqrt((steps * steps).sum(axis=0)), axis=1, out=length[:, 1:])
    return np.asarray(length / length[:, -1:])


def graze_beta(st: State, r: float, z: float, u: Floats, middle: float) -> Floats:
    """Normal angle at which a meridian arc with its centre at (r, z) grazes at angle u, within pi/2 of `middle`."""
    axis, rate = st.axis[:, None], st.rate[:, None]
    velocity = (st.velocity + z * st.rate)[:, None]
    terms = torus_terms(st.radial(u), axis=axis, velocity=velocity, rate=rate, R1=r)
    return torus_angle(*terms, middle + 0.5 * np.pi) - 0.5 * np.pi  # v counts from the bottom disc
