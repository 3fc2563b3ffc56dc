"""Swept volumes in closed form, or by a quadrature of one smooth variable, or not at all.

Symbols: r, z meridian; n = (n_r, n_z) its normal; rc radius of the path, theta its angle, rho radius of the
circle of the body at a height; s distance from the axis of the path.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, partial
from itertools import pairwise

import numpy as np

from vmachining.arrays import Floats
from vmachining.geometry import Arc, Line, Path
from vmachining.tool import Profile, Segment

NODES = 48
"""Gauss points per smooth piece; 24 already give 1e-13 on the cases of tests/reference."""


def swept_volume(profile: Profile, path: Path) -> float | None:
    """mm^3 of a body translated along a path, None where no closed form is known.

    Known: lines of a convex body in any direction, of any body horizontally, of a body without a waist along
    its axis; arcs about z at any angle and any radius; helices about z that enter no point twice.
    """
    if isinstance(path, Line):
        return line_volume(profile, path.end - path.start)
    if path.angle == 0.0 or path.radius == 0.0:
        return line_volume(profile, path.end - path.start)
    if path.axis != 2:
        return None
    if path.rise == 0.0:
        return arc_volume(profile, path.radius, path.angle)
    return helix_volume(profile, path)


def line_volume(profile: Profile, travel: Floats) -> float | None:
    """V(K) + |d| (area of the shadow of K along d), mm^3.

    Horizontally every slice is a disc, so any profile will do; along the axis a body without a waist leaves
    the cylinder of its largest circle; in between the body must be convex.
    """
    level, rise = float(np.hypot(travel[0], travel[1])), float(travel[2])
    if rise == 0.0:
        return profile.volume + level * profile.meridian_area
    if level == 0.0:
        return profile.volume + abs(rise) * np.pi * profile.max_radius**2 if profile.is_unimodal else None
    if not profile.is_convex:
        return None
    length = float(np.hypot(level, rise))
    return profile.volume + length * shadow(profile, level / length, rise / length)


def shadow(profile: Profile, level: float, rise: float) -> float:
    """mm^2 of the parallel projection of a convex body along the unit direction (level, 0, rise).

    Half the integral of |n . d| over the surface. Around one circle n . d = a cos u + c with a = n_r level,
    c = n_z rise, and the integral of |a cos u + c| over u is 4 (sqrt(a^2 - c^2) + c asin(c / a)) for
    a > |c|, else 2 pi |c|. Lines have one normal; arcs are integrated over its angle, with breaks where
    a = |c|: the integrand behaves like the distance to the power 3/2 there.
    """
    rise = abs(rise)
    rim = profile.points[[0, -1], 0]
    total = np.pi * rise * float(rim @ rim)

    def around(beta: Floats) -> Floats:
        a, c = level * np.cos(beta), rise * np.abs(np.sin(beta))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # c / a counts up to 1
            slant = 4.0 * (np.sqrt(np.maximum(a * a - c * c, 0.0)) + c * np.arcsin(np.minimum(c / a, 1.0)))
        return np.where(a > c, slant, 2.0 * np.pi * c)

    def ring(s: Segment, beta: Floats) -> Floats:
        return s.radius * (s.cr + s.radius * np.cos(beta)) * around(beta)

    tangent = float(np.arctan2(level, rise))
    for s in profile.segments:
        b0, b1 = s.beta
        if s.is_arc:
            total += _gauss(partial(ring, s), [b0, -tangent, 0.0, tangent, b1])
        else:
            total += 0.5 * (s.r0 + s.r1) * np.hypot(s.r1 - s.r0, s.z1 - s.z0) * float(around(np.array(b0)))
    return float(0.5 * total)


def arc_volume(profile: Profile, rc: float, angle: float) -> float:
    """mm^3 of any body carried around a horizontal arc, by any angle; the axis may lie in the body.

    A disc covers rc |theta| 2 rho + pi rho^2 as long as it enters no point twice; `_excess` is what is
    missing, height by height. From a full turn on, the disc covers the ring pi ((rc + rho)^2 - (rc - rho)^2)
    and, if it contains the axis, the disc of radius rho - rc that the ring leaves.
    """
    theta = abs(angle)
    if theta >= 2.0 * np.pi:
        total = 2.0 * np.pi * rc * profile.meridian_area
        for s in profile.segments:
            total += _over_height(s, lambda rho: np.pi * np.maximum(rho - rc, 0.0) ** 2, [rc])
        return total
    total = profile.volume + rc * theta * profile.meridian_area
    breaks = [rc, rc * float(np.sin(theta / 2.0))]
    for s in profile.segments:
        total -= _over_height(s, lambda rho: _excess(rho, rc, theta), breaks)
    return total


def helix_volume(profile: Profile, path: Arc) -> float | None:
    """V(K) + length * shadow, if it can be shown that no point is entered twice; else None.

    A point at distance s from the axis of the helix is in the body while rho^2 = s^2 + rc^2 - 2 s rc cos psi
    is below r(z)^2, which needs |psi| <= asin(R / rc) for rc > R. One visit per turn, and only one turn that
    reaches it if |theta| + 2 asin(R / rc) <= 2 pi. During the visit rho^2 - r(z)^2 is convex in psi, so the
    visit is one interval, if 2 s rc cos psi >= c^2 d2(r^2)/dz2 with c the rise per radian. On arcs r^2 is
    concave for c_r >= 0, on lines its second derivative is 2 slope^2.
    """
    R, rc = profile.max_radius, path.radius
    if not profile.is_convex or rc <= R:
        return None
    if abs(path.angle) + 2.0 * np.arcsin(R / rc) > 2.0 * np.pi:
        return None
    steepest = 0.0
    for s in profile.segments:
        if s.is_arc and s.cr < 0.0:
            return None
        if not s.is_arc:
            steepest = max(steepest, abs((s.r1 - s.r0) / (s.z1 - s.z0)))
    # c = rise / angle overflows where the angle is 1e-305 rad, so the roots of both sides are compared, times |angle|
    if np.sqrt((rc - R) * rc * np.sqrt(1.0 - (R / rc) ** 2)) * abs(path.angle) < steepest * abs(path.rise):
        return None
    length = path.length
    return profile.volume + length * shadow(profile, abs(rc * path.angle) / length, path.rise / length)


def _excess(rho: Floats, rc: float, theta: float) -> Floats:
    """mm^2 by which a disc carried around an arc covers less than rc theta 2 rho + pi rho^2.

    At distance s from the axis the disc spans the angle 2 g(s), cos g = (s^2 + rc^2 - rho^2) / (2 s rc), and
    covers min(2 g + theta, 2 pi). The integral of s (2 g + theta) over |rc - rho| < s < rc + rho, plus the
    disc of radius rho - rc around an axis inside the body, is the formula above. What is missing is the
    integral of s (2 g + theta - 2 pi) where that is positive: between p and q, the roots of
    s^2 - 2 s rc cos G + rc^2 - rho^2 with G = pi - theta / 2 > 0. The integral of 2 g s is the area that two
    discs share.
    """
    inner, outer = np.abs(rc - rho), rc + rho
    cos, sin = -np.cos(theta / 2.0), np.sin(theta / 2.0)
    root = np.sqrt(np.maximum(rho**2 - (rc * sin) ** 2, 0.0))
    hit = rho**2 > (rc * sin) ** 2
    p = np.where(hit, np.clip(rc * cos - root, inner, outer), inner)
    q = np.where(hit, np.clip(rc * cos + root, inner, outer), inner)
    twice = _shared(q, rho, rc) - _shared(p, rho, rc) + (theta / 2.0 - np.pi) * (q**2 - p**2)
    return np.asarray(np.maximum(twice, 0.0))


def _shared(s: Floats, rho: Floats, rc: float) -> Floats:
    """mm^2 shared by discs of radius s and rho whose centres are rc apart."""
    small = np.minimum(s, rho)
    k = np.maximum((s + rho - rc) * (s - rho + rc) * (rho - s + rc) * (s + rho + rc), 0.0)
    # both angles from the same root: what rounding does to a touching pair cancels
    a = np.arctan2(np.sqrt(k), s**2 + rc**2 - rho**2)
    b = np.arctan2(np.sqrt(k), rho**2 + rc**2 - s**2)
    lens = s**2 * a + rho**2 * b - 0.5 * np.sqrt(k)
    return np.where(s + rho <= rc, 0.0, np.where(np.abs(s - rho) >= rc, np.pi * small**2, lens))


def _over_height(s: Segment, f: Callable[[Floats], Floats], radii: Sequence[float]) -> float:
    """Integral of f(r(z)) dz over a segment, with breaks where the radius passes one of `radii`."""
    if s.is_arc:
        b0, b1 = s.beta
        cuts = [(r - s.cr) / s.radius for r in radii]
        angles = [float(np.arccos(c)) for c in cuts if abs(c) <= 1.0]

        def height(beta: Floats) -> Floats:
            return f(s.cr + s.radius * np.cos(beta)) * s.radius * np.cos(beta)

        return _gauss(height, [b0, *(-a for a in angles), 0.0, *angles, b1])
    if s.r0 == s.r1:
        return (s.z1 - s.z0) * float(f(np.array(s.r0)))
    shares = [(r - s.r0) / (s.r1 - s.r0) for r in radii]
    return (s.z1 - s.z0) * _gauss(lambda t: f((1.0 - t) * s.r0 + t * s.r1), [0.0, *shares, 1.0])


@cache
def smooth_rule(n: int) -> tuple[Floats, Floats]:
    """n nodes of Gauss-Legendre on [0, 1] after x = 3 t^2 - 2 t^3, which smooths half-integer powers at both ends."""
    t, w = np.polynomial.legendre.leggauss(n)
    t, w = 0.5 * (t + 1.0), 0.5 * w
    return t * t * (3.0 - 2.0 * t), w * 6.0 * t * (1.0 - t)


def _gauss(f: Callable[[Floats], Floats], breaks: Sequence[float]) -> float:
    """Integral from the first to the last of `breaks`, piece by piece between those that lie inside."""
    lo, hi = breaks[0], breaks[-1]
    inside = sorted({lo, hi, *(b for b in breaks[1:-1] if lo < b < hi)})
    x, w = smooth_rule(NODES)
    return sum(float((b - a) * (w @ f(a + (b - a) * x))) for a, b in pairwise(inside))
