"""Instants at which the grazing curve of a cutter changes its shape, not only its place.

Symbols as in `grazing/faces.py`: V velocity of the tip, A axis, S = dA/dt; along a face the difference r^2 - c^2 of the
grazing condition is a quadratic whose coefficients are linear in vv, vs, ss and ll.

A change happens where that form is zero at an end of a face (the curve reaches a joint, a chord of a disc is born
or dies), where its discriminant is zero (a loop appears, two arcs merge), where A.V is zero (front and rear of
the poles and discs swap), or where both normals of an edge graze at one point. Between two such instants every
face keeps the number of its grazing intervals.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple, TypeAlias

import numpy as np

from vmachining.arrays import Floats
from vmachining.geometry import Arc, Line
from vmachining.sweep.grazing import circle_terms, terms_of, whole_meridian
from vmachining.sweep.motion import Sweep
from vmachining.sweep.turning import Turn
from vmachining.tool import Profile, Segment

GRID, LEVELS = 128, 7
"""First division of the block and halvings after it: what is left, 1e-4 of it, has a root, a touch or neither."""

NEAR = 1e-4
"""A function that stays above this share of its size over an interval of 1e-4 is not looked at for a touch."""

TOUCH = 1e-10
"""A function that comes this near to zero, relative to its size, touches it."""

APART = 1e-6
"""Instants closer than this are one: a root of a square is only found to the root of its rounding."""

JOINT = 1e-9
"""rad: directions closer than this are tangent."""


class Change(NamedTuple):
    """One instant t in (0, 1): what happens (`end`, `merge`, `swap`, `pinch`) at which height z (mm, NaN: all)."""

    t: float
    kind: str
    z: float


@dataclass(frozen=True, slots=True)
class Bounded:
    """Values of a function of t with bounds of its size and of its slope over the whole block."""

    value: Floats
    size: float
    slope: float

    def __add__(self, other: Bounded) -> Bounded:
        return Bounded(self.value + other.value, self.size + other.size, self.slope + other.slope)

    def __mul__(self, other: Bounded) -> Bounded:
        slope = self.size * other.slope + self.slope * other.size
        return Bounded(self.value * other.value, self.size * other.size, slope)

    def times(self, factor: float) -> Bounded:
        """A number times the function."""
        return Bounded(factor * self.value, abs(factor) * self.size, abs(factor) * self.slope)


class Forms(NamedTuple):
    """The scalars of the module docstring; cross = (A x V).S, lift = A.V."""

    vv: Bounded
    vs: Bounded
    ss: Bounded
    lift: Bounded
    cross: Bounded


Function: TypeAlias = Callable[[Forms], Bounded]


def breaks(sweep: Sweep) -> Floats:
    """(n,) rising times inside (0, 1) at which the topology of the grazing curve changes; empty for lines."""
    return np.array(sorted({c.t for c in changes(sweep)}))


def changes(sweep: Sweep) -> list[Change]:
    """All changes in order of time; those closer than 1e-6 share one time.

    Every function of time is made of scalar products whose sizes and slopes are bounded over the block. A
    interval where |g(a)| + |g(b)| exceeds the slope times its length has no root; the others are halved. A
    sign change is then solved, a touch is kept if it is a zero to 1e-10 of the function's size. Two roots less
    than 1e-4 of the block apart may be taken for a touch.
    """
    path = sweep.path
    if isinstance(path, Line) or (isinstance(path, Turn) and path.is_steady and path.is_straight):
        return []
    return list(_changes(sweep.profile, path))


@lru_cache(maxsize=256)  # whoever builds solids asks several times
def _changes(profile: Profile, path: Arc | Turn) -> list[Change]:
    found: list[Change] = []
    grid, forms = np.linspace(0.0, 1.0, GRID + 1), _forms(path)
    known = forms(grid)
    for kind, z, g, accept in _functions(profile):
        found += [Change(t, kind, z) for t in _roots(g, forms, grid, known) if accept(forms(np.array([t])))]
    found.sort()
    out: list[Change] = []
    for c in found:
        if out and c.t - out[-1].t < APART:
            c = c._replace(t=out[-1].t)
            if c in out:
                continue
        out.append(c)
    return out


def _functions(profile: Profile) -> list[tuple[str, float, Function, Callable[[Forms], bool]]]:
    """(kind, height, function, check) of everything that may change."""
    out: list[tuple[str, float, Function, Callable[[Forms], bool]]] = []
    nan = float("nan")
    out.append(("swap", nan, lambda f: f.lift, lambda f: True))
    faces = whole_meridian(profile)
    for s in faces:
        for r, z, beta in ((s.r0, s.z0, s.beta[0]), (s.r1, s.z1, s.beta[1])):
            n_r, n_z = float(np.cos(beta)), float(np.sin(beta))
            out.append(("end", z, _combined(circle_terms(n_r, n_z, z * n_r - r * n_z)), lambda f: True))
        middle = 0.5 * (s.z0 + s.z1)
        out.append(("merge", middle, _gap(s), _inside(s)))
    for below, above in pairwise(faces):
        if above.beta[0] > below.beta[1] + JOINT and above.r0 > 0.0:
            out.append(("pinch", above.z0, _pinch(above.r0, above.z0), lambda f: True))
    return out


def _combined(row: Floats) -> Function:
    """A row of coefficients of (vv, vs, ss, ll) as a function of time."""
    c = [float(v) for v in row]

    def g(f: Forms) -> Bounded:
        flat = f.vv.times(c[0]) + f.vs.times(c[1]) + f.ss.times(c[2])
        return flat + (f.lift * f.lift).times(c[3]) if c[3] != 0.0 else flat

    return g


def _quadratic(s: Segment) -> Callable[[Forms], tuple[Bounded, Bounded, Bounded]]:
    """r^2 - c^2 along a face, see `grazing.faces`."""
    first, second, third = (_combined(row) for row in terms_of(s))
    return lambda f: (first(f), second(f), third(f))


def _gap(s: Segment) -> Function:
    """Discriminant of the quadratic of a face."""
    form = _quadratic(s)

    def g(f: Forms) -> Bounded:
        q0, q1, q2 = form(f)
        return q1 * q1 + (q0 * q2).times(-4.0)

    return g


def _inside(s: Segment) -> Callable[[Forms], bool]:
    """Whether the double root of the quadratic lies on the face."""
    form = _quadratic(s)

    def check(f: Forms) -> bool:
        _q0, q1, q2 = (float(q.value[0]) for q in form(f))
        if s.is_arc:
            x, lo, hi = float(np.arctan2(-q1, 2.0 * q2) if q2 >= 0 else np.arctan2(q1, -2.0 * q2)), *s.beta
            return lo - JOINT <= x <= hi + JOINT
        return q2 != 0.0 and -JOINT <= -0.5 * q1 / q2 <= 1.0 + JOINT

    return check


def _pinch(r: float, z: float) -> Function:
    """Zero where both normals of an edge graze at one point: m square to V at the height, A.V = r m.S there.

    With v = V + z S without its part along A the condition is ll |v|^2 = r^2 ((A x v).S)^2, and (A x S).S = 0.
    """

    def g(f: Forms) -> Bounded:
        speed = f.vv + f.vs.times(2.0 * z) + f.ss.times(z * z)
        return f.lift * f.lift * speed + (f.cross * f.cross).times(-r * r)

    return g


def _forms(path: Arc | Turn) -> Callable[[Floats], Forms]:
    """Scalars at times (n,), with bounds over the block."""
    if isinstance(path, Turn):
        v1, v2, s1, s2 = (series.bound(k) for series in (path.tip_series, path.axis_series) for k in (1, 2))
    else:
        v1, v2, s1, s2 = path.length, path.angle**2 * path.radius, 0.0, 0.0

    def forms(t: Floats) -> Forms:
        V = path.velocity(t)
        if isinstance(path, Turn):
            A, S = path.axis(t), path.axis_rate(t)
        else:
            A, S = np.broadcast_to([0.0, 0.0, 1.0], V.shape), np.zeros_like(V)
        lift = Bounded((A * V).sum(1), v1, v2 + v1 * s1)
        vv = Bounded((V * V).sum(1), v1 * v1, 2.0 * v1 * v2) + (lift * lift).times(-1.0)
        vs = Bounded((V * S).sum(1), v1 * s1, v2 * s1 + v1 * s2)
        ss = Bounded((S * S).sum(1), s1 * s1, 2.0 * s1 * s2)
        cross = Bounded((np.cross(A, V) * S).sum(1), v1 * s1, v2 * s1 + v1 * s2 + v1 * s1 * s1)
        return Forms(vv, vs, ss, lift, cross)

    return forms


def _roots(g: Function, forms: Callable[[Floats], Forms], grid: Floats, known: Forms) -> list[float]:
    """Zeros of g in (0, 1), sign changes and touches; `known` are the forms on an equal grid."""
    first = g(known)
    size = float(np.abs(first.value).max())
    if size <= TOUCH * first.size or size == 0.0:
        return []  # zero throughout: no change
    lo, hi, at_lo, at_hi = grid[:-1], grid[1:], first.value[:-1], first.value[1:]
    for level in range(LEVELS):
        open_ = (np.abs(at_lo) + np.abs(at_hi) <= first.slope * (hi - lo)) | (at_lo * at_hi <= 0.0)
        lo, hi, at_lo, at_hi = lo[open_], hi[open_], at_lo[open_], at_hi[open_]
        if not len(lo):
            return []
        if level == LEVELS - 1:
            break
        middle = 0.5 * (lo + hi)
        between = g(forms(middle)).value
        lo, hi = np.concatenate([lo, middle]), np.concatenate([middle, hi])
        at_lo, at_hi = np.concatenate([at_lo, between]), np.concatenate([between, at_hi])

    # half of what a command takes to start, for turning tools only
    from scipy.optimize import brentq, minimize_scalar

    def value(t: float) -> float:
        return float(g(forms(np.array([t]))).value[0])

    order = np.argsort(lo)
    found = [
        float(brentq(value, lo[k], hi[k], xtol=1e-15)) if at_lo[k] else float(lo[k])
        for k in order
        if at_lo[k] * at_hi[k] < 0.0 or at_lo[k] == 0.0
    ]
    for p, q in _runs(lo[order], hi[order]):
        here = (lo >= p) & (hi <= q)
        if (at_lo[here] * at_hi[here] > 0.0).all() and np.abs(at_lo[here]).min() <= NEAR * size:
            low = minimize_scalar(
                lambda t: abs(value(t)), bounds=(p, q), method="bounded", options={"xatol": 1e-12}
            )
            if low.fun <= TOUCH * size:
                found.append(float(low.x))
    return [t for t in found if APART < t < 1.0 - APART]


def _runs(lo: Floats, hi: Floats) -> list[tuple[float, float]]:
    """Adjacent intervals joined."""
    out: list[tuple[float, float]] = []
    for a, b in zip(lo.tolist(), hi.tolist(), strict=True):
        if out and a <= out[-1][1]:
            out[-1] = (out[-1][0], b)
        else:
            out.append((a, b))
    return out
