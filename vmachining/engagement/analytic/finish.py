"""Finish passes: the edge against the model of a surface, or against the surface itself.

| function | is |
|---|---|
| `finished` | every rotation angle by the general interval rule on any `Surface`; the default |
| `staged_length`, `staged_lengths` | the published three stages for the cylinder, corrected; over angles, one patch or more |
| `circle_length`, `slope_length`, `section_through` | its parts |

Angles rad, lengths mm; plain numbers and arrays. Source: Hendriko, five-axis milling, 6-8 to 6-42, corrected. The stages
are exact on the model where S_x is flat or the tool leans in one direction only, else off by up to 0.3 %.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, Ints
from vmachining.engagement import chip
from vmachining.engagement.analytic.passes import IDLE, Corner, Pass, moving
from vmachining.engagement.analytic.surface import STRAIGHT, NormalGrid, Patch, Section, Surface
from vmachining.engagement.frames import angles_of, feed_angle
from vmachining.errors import InputError

ROOT = 1e-13
"""Brackets of a root are narrowed to this share of their ends, or until they are neighbours."""

CHUNK = 1_000_000
"""Points of the edge that are asked at once: 100 MB with what is made of them."""

STEPS_PER_RADIUS = 50
"""The edge is sampled every r / 50 (R / 50 on the cylinder): shorter contacts with a surface may be missed."""


def circle_length(cq: ArrayLike, tilt: ArrayLike, radius: ArrayLike, lean: ArrayLike) -> Floats:
    """(...,) mm from a point to a circular profile, along a line that leans from the vertical.

    cq : vertical distance of the profile above the point. tilt : d, of its normal there. radius : signed, R > 0 convex
        (the line leaves the circle), R < 0 concave (it meets it first). lean : toward the positive direction.

    NaN where the line misses the circle.

    p = (R sin d, R cos d - Cq), e = (sin th, cos th), s = -p.e +- sqrt((p.e)^2 - |p|^2 + R^2): the same as the chains of
    triangles 6-8 to 6-19 corrected, without their cancellation.
    """
    q, d, big, th = (np.asarray(v, dtype=np.float64) for v in (cq, tilt, radius, lean))
    px, pz = big * np.sin(d), big * np.cos(d) - q
    along = px * np.sin(th) + pz * np.cos(th)
    # |p|^2 - R^2 without the squares of R
    gap = q * (q - 2.0 * big * np.cos(d))
    under = along**2 - gap
    root = np.sqrt(np.where(under >= 0.0, under, np.nan))
    # the small root by the product of both
    convex = big > 0.0
    with np.errstate(divide="ignore", invalid="ignore"):
        out = np.where(convex, -gap / (along + root), gap / (root - along))
        plain = np.where(convex, -along + root, -along - root)
    stable = np.where(convex, along > 0.0, along < 0.0)
    return np.asarray(np.where(stable, out, plain))


def slope_length(cq: ArrayLike, ascent: ArrayLike, lean: ArrayLike) -> Floats:
    """(...,) mm to a straight profile: Cq cos g / cos(g + th) (6-20 to 6-23); inf where the line runs along it or away."""
    q, g, th = (np.asarray(v, dtype=np.float64) for v in (cq, ascent, lean))
    down = np.cos(g + th)
    with np.errstate(divide="ignore"):
        return np.asarray(np.where(down > 0.0, q * np.cos(g) / down, np.inf))


def section_through(cq: float, cs: float, lean: float, first: Section, second: Section, tilt: float) -> float:
    """mm, signed radius R_i of the second profile in the plane that leans by stage 1 (6-24 to 6-29).

    cq, cs : vertical and leaning distance to the surface. tilt : d of the second profile over the point.
    """
    if first.shape in STRAIGHT:
        return second.radius * cs / cq
    big = abs(second.radius)
    convex = second.radius > 0.0
    qv = big * np.cos(tilt)
    st = (qv - cq) / np.cos(lean) + cs if convex else (qv + cq) / np.cos(lean) - cs
    return float(np.copysign(np.hypot(st, big * np.sin(tilt)), second.radius))


class Stages(NamedTuple):
    """Published stages: cq vertical, cs after the first lean, cn along the edge, mm; radius of the leaning section."""

    cq: float
    cs: float
    radius: float
    cn: float


def staged_length(patch: Patch, point: ArrayLike, theta_a: float, theta_b: float) -> Stages:
    """Length of cut of a flat cutter by the published stages, corrected: from a point C of the rim, below the surface.

    Stage 1 leans by theta_b in the x-z plane, stage 2 finds the radius there, stage 3 leans by -theta_a toward +y.

    Raises InputError: The model has no height over the point, or the point is not below it.
    """
    c = np.asarray(point, dtype=np.float64)
    cq = float(patch.projection(c))
    if not cq > 0.0:
        above = (
            f"the surface is {cq:g} mm above the point"
            if np.isfinite(cq)
            else "the model has no height over the point"
        )
        raise InputError(
            above, remedy="the edge is above the surface there, or another normal v1 fits better"
        )
    sx, sy = patch.along_x, patch.along_y
    cs = leaned(cq, sx, float(c[0]), theta_b)
    dy = float(sy.tilt(c[1]))
    if sy.shape in STRAIGHT:
        return Stages(cq, cs, np.inf, leaned(cs, sy, float(c[1]), -theta_a, cs / cq))
    radius = sy.radius
    if theta_a != 0.0 and theta_b != 0.0:
        radius = section_through(cq, cs, theta_b, sx, sy, dy)
    return Stages(cq, cs, radius, float(circle_length(cs, dy, radius, -theta_a)))


def staged_lengths(
    grid: NormalGrid,
    corner: Corner,
    contact: ArrayLike,
    tip: ArrayLike,
    frame: ArrayLike,
    phi: ArrayLike,
    velocity: ArrayLike,
    *,
    patches: int | None = 1,
) -> Floats:
    """(m,) mm, lengths of cut of a flat cutter at angles phi (m,) by the published stages, corrected.

    grid : normals of the surface. contact : (3,) mm, CC. tip, frame, velocity : (3,), (3, 3), (3,) of one position.
    patches : 1: the model around the normal nearest to the contact. 2: one up to 90 degrees from the feed and one beyond,
        each around the middle of its half of the rim. None: one for every angle.

    0 where the rim is above the model, NaN where the model has no height.

    Raises InputError: A cutter with a corner (see `station_ends`), another number of patches.
    """
    if corner.r > 0.0:
        remedy = "station_ends, or finished for every angle"
        raise InputError("the stages are those of a flat cutter", remedy=remedy)
    if patches not in (1, 2, None):
        raise InputError(f"{patches} patches: expected 1, 2 or None for one per angle")
    angles, m = np.atleast_1d(np.asarray(phi, dtype=np.float64)), np.asarray(frame, dtype=np.float64)
    rim = chip.edge_points(tip, m, angles, 0.0, corner.rm, corner.r)
    late = np.mod(angles + feed_angle(velocity, m), 2.0 * np.pi) > chip.QUARTER + 1e-12
    if patches is None:
        models = [grid.patch(*c[:2]) for c in rim]
    elif patches == 1:
        models = [grid.patch(*np.asarray(contact, dtype=np.float64)[:2])] * len(angles)
    else:
        halves = {half: grid.patch(*rim[late == half].mean(axis=0)[:2]) for half in set(late.tolist())}
        models = [halves[half] for half in late.tolist()]
    theta_a, theta_b = (float(v) for v in angles_of(m[:, 2]))
    out = np.zeros(len(angles))
    for k, (patch, c) in enumerate(zip(models, rim, strict=True)):
        distance = float(patch.projection(c))
        if distance > 0.0:
            out[k] = staged_length(patch, c, theta_a, theta_b).cn
        elif np.isnan(distance):
            out[k] = np.nan
    return out


def leaned(distance: float, along: Section, t: float, lean: float, scale: float | None = None) -> float:
    """One lean in the plane of a profile; `scale` turns the ascent of a slope into that of the leaning plane (6-42)."""
    if along.shape in STRAIGHT:
        ascent = along.ascent if scale is None else np.arctan(np.tan(along.ascent) * scale)
        return float(slope_length(distance, ascent, lean))
    return float(circle_length(distance, along.tilt(t), along.radius, lean))


# -- exact on the model ---------------------------------------------------------------------------------------


def rooted(f: Callable[[Floats], Floats], low: Floats, high: Floats) -> Floats:
    """(n,) roots of f in brackets with a change of sign, all at once: secants, kept inside by halvings (Illinois)."""
    a, b = np.array(low), np.array(high)
    f_a, f_b = f(a), f(b)
    best = np.where(np.abs(f_a) < np.abs(f_b), a, b)
    for step in range(100):
        with np.errstate(divide="ignore", invalid="ignore"):
            x = a + (b - a) * (f_a / (f_a - f_b))
        middle = 0.5 * (a + b)
        x = np.where(np.isfinite(x) & (x > a) & (x < b) & (step % 3 != 2), x, middle)
        f_x = f(x)
        left = (f_x < 0.0) == (f_a < 0.0)
        f_a, f_b = np.where(left, f_x, 0.5 * f_a), np.where(left, 0.5 * f_b, f_x)
        a, b = np.where(left, x, a), np.where(left, b, x)
        best = np.where(f_x == 0.0, x, 0.5 * (a + b))
        a, b = np.where(f_x == 0.0, x, a), np.where(f_x == 0.0, x, b)
        if (b - a <= ROOT * np.maximum(np.abs(a), np.abs(b))).all():
            break
    return np.asarray(best)


# -- every angle by the general rule ---------------------------------------------------------------------------


def finished(
    corner: Corner,
    surface: Surface,
    tip: ArrayLike,
    frame: ArrayLike,
    phi: ArrayLike,
    velocity: ArrayLike = (0.0, 0.0, 0.0),
    *,
    axis_rate: ArrayLike | None = None,
    facing: bool = True,
    bottom: bool = True,
    x: tuple[float, float] = (-np.inf, np.inf),
    y: tuple[float, float] = (-np.inf, np.inf),
    reach: float | None = None,
) -> Pass:
    """Engaged intervals below a surface, at every position and angle: the direct solve.

    z(Q(s)) - S(x, y) is followed from the lower end of the edge in steps of r / 50, each change of sign is a root.

    tip .. bottom : as of `engaged`.
    x, y : walls of the workpiece, mm; start and end of a path.
    reach : mm of the cylinder that is looked at; None: all of the flute, at most three diameters.

    Raises InputError: The surface has no height somewhere over the edge and inside the walls (a circular profile that
        ends), or as of `engaged`.
    """
    moves, angles = moving(tip, frame, phi, velocity, axis_rate)
    where, frames, speed, rate = moves
    n, m = len(where), angles.shape[1]
    angle, row = np.broadcast_to(angles, (n, m)).ravel(), np.repeat(np.arange(n), m)
    c = corner
    top = min(c.flute, 6.0 * c.radius if reach is None else reach)
    bend = c.r * chip.QUARTER
    speeds = chip.edge_speeds(speed[row], frames[row], angle, axis_rate=rate[row])
    idle = IDLE * speeds.tip

    def outside(s: Floats, who: Ints) -> Floats:
        """(k,) > 0 outside of the material, mm."""
        k = row[who]
        q = chip.edge_points(where[k], frames[k], angle[who], s, c.rm, c.r)
        aside = np.max([x[0] - q[:, 0], q[:, 0] - x[1], y[0] - q[:, 1], q[:, 1] - y[1]], axis=0)
        above = q[:, 2] - surface.height(np.clip(q[:, 0], *x), np.clip(q[:, 1], *y))
        if np.isnan(above).any():
            bad = q[int(np.argmax(np.isnan(above)))]
            raise InputError(
                f"the surface has no height at x {bad[0]:.4g}, y {bad[1]:.4g} mm",
                remedy="the model ends there: take a normal nearer to it, walls, or a smaller reach",
            )
        return np.asarray(np.maximum(above, aside))

    def behind(s: Floats, who: Ints) -> Floats:
        at = chip.Speeds(*(v[who] for v in speeds))
        return np.asarray(idle[who] - chip.normal_speed(s, at, c.rm, c.r))

    pieces = [(-c.rm, 0.0, c.rm), (0.0, bend, c.r), (bend, bend + top, c.radius)]
    found: list[tuple[Ints, Floats, Floats]] = []
    for low, high, size in pieces[0 if bottom and c.rm > 0.0 else 1 :]:
        if high <= low:
            continue
        steps = int(np.ceil((high - low) / size * STEPS_PER_RADIUS))
        who = np.arange(len(angle), dtype=np.int64)
        a, b = np.full(len(who), low), np.full(len(who), high)
        if facing:  # one interval per piece: N . V has at most one root there
            who, a, b = _facing(behind, a, b, who, bend)
        step = max(CHUNK // (steps + 1), 1)
        found += [
            _below(outside, a[k : k + step], b[k : k + step], who[k : k + step], steps)
            for k in range(0, max(len(who), 1), step)
        ]
    who = np.concatenate([f[0] for f in found])
    a, b = (np.concatenate([f[k] for f in found]) for k in (1, 2))
    order = np.lexsort((a, who))
    who, a, b = who[order], a[order], b[order]
    count = np.bincount(who, minlength=n * m)
    most = max(int(count.max(initial=0)), 1)
    lower, upper = np.full((2, n * m, most), np.nan)
    place = np.arange(len(who)) - np.repeat(np.cumsum(count) - count, count)
    lower[who, place], upper[who, place] = a, b
    shape = (n, m, most)
    return Pass(corner, where, frames, speed, rate, angles, lower.reshape(shape), upper.reshape(shape))


def _facing(
    behind: Callable[[Floats, Ints], Floats], a: Floats, b: Floats, who: Ints, bend: float
) -> tuple[Ints, Floats, Floats]:
    """The interval of each piece that faces; joints are asked just inside of the piece."""
    inner = [np.nextafter(a, b), np.nextafter(b, a)]
    first, last = behind(inner[0], who) < 0.0, behind(inner[1], who) < 0.0
    mixed = first != last
    if mixed.any():
        k = who[mixed]
        zero = rooted(lambda s: behind(s, k), inner[0][mixed], inner[1][mixed])
        a[mixed] = np.where(first[mixed], a[mixed], zero)
        b[mixed] = np.where(first[mixed], zero, b[mixed])
    kept = first | last
    return who[kept], a[kept], b[kept]


def _below(
    outside: Callable[[Floats, Ints], Floats], a: Floats, b: Floats, who: Ints, steps: int
) -> tuple[Ints, Floats, Floats]:
    """Intervals where outside <= 0, by samples and roots between them; (row, lower, upper)."""
    if not len(who):
        return who, a, b
    share = np.linspace(0.0, 1.0, steps + 1)
    s = a[:, None] + (b - a)[:, None] * share
    f = outside(s.ravel(), np.repeat(who, steps + 1)).reshape(s.shape)
    inside = f <= 0.0
    i, j = np.nonzero(inside[:, 1:] != inside[:, :-1])
    root = np.zeros(0)
    if len(i):
        root = rooted(lambda t: outside(t, who[i]), s[i, j], s[i, j + 1])
    ends = np.full((len(who), 2), np.nan)
    ends[inside[:, 0], 0], ends[inside[:, -1], 1] = a[inside[:, 0]], b[inside[:, -1]]
    enters = ~inside[i, j]
    starts = np.concatenate([np.flatnonzero(inside[:, 0]), i[enters]])
    lower = np.concatenate([a[inside[:, 0]], root[enters]])
    stops = np.concatenate([np.flatnonzero(inside[:, -1]), i[~enters]])
    upper = np.concatenate([b[inside[:, -1]], root[~enters]])
    one, two = np.lexsort((lower, starts)), np.lexsort((upper, stops))
    lower, upper, mine = lower[one], upper[two], starts[one]
    kept = upper > lower
    return who[mine[kept]], lower[kept], upper[kept]
