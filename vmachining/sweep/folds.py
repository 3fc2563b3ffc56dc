"""Where the envelope of a block folds inside the sweep, and what covers it there.

Symbols: V velocity of the tip, A axis, S = dA/dt, lift L = A . V, side velocity W = V - L A. The axis passes the
pivot at height k = -W . S / S^2, d = |W + k S| / |S| from it. The normals of a circle meet the axis at the height
kappa / n_r; the circle whose normals meet it in the pivot is the ring of a face: there the grazing curve runs
from one side of the tool to the other, and the sheet that it draws lies inside (phi_tt < 0) on one half at least.

What is inside has been swept by earlier and later poses. If the pivot hardly moves, the slab of the tool around
the ring is swept by its first and last pose, all of it: a point of the slab is nearer to the pivot than those
where the two poses cross. So the sweep of a tool is the union of

- the sweeps of the tool below and above the slab, whose envelopes do not fold,
- the whole tool in some poses.

`uncovered` measures what is missing, in exact distances.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats
from vmachining.sweep.grazing import Instant, across, circles, folding, grazing_angles, instant
from vmachining.sweep.motion import Sweep
from vmachining.sweep.turning import Turn
from vmachining.tool import Profile, Segment

TIMES = 9
"""Instants at which folds are looked for."""

ALONG = 33
"""Circles of a face; on lines more come close to the ring."""

AROUND = 48
"""Angles of a circle at which the slab is looked at; more come close to the plane of the turn."""

SLIDES = 0.1
"""A ring whose circle leads or trails faster than this share of the speed of the turn around it is not grazed."""

SLIM = 0.002
"""Of the largest radius: what is left below or above the slab is not a body of its own if it is less high, and no face
of it either."""

MARGINS = (0.1, 0.03, 0.3, 0.01, 0.003)
"""Of the largest radius, by which a slab reaches beyond the folds, in the order in which they are tried: where
the slab is high poses do not cover it, where it is low the envelope of the rest is sharp."""


class Slab(NamedTuple):
    """Part of a tool between two heights, and the bodies below and above it (none, one or two)."""

    lo: float
    hi: float
    bodies: tuple[Profile, ...]


def slabs(profile: Profile, path: Turn, depth: float) -> list[Slab]:
    """Slabs outside of which the first and last pose cross at most `depth` mm above a sheet that lies inside.

    None if the tool has no fold; -phi_tt / 8 is the height of that crossing, halfway between the poses.

    Chords of flat faces do not count: no slab without its rim covers them.
    """
    found = np.array([_heights(profile, path, t, depth) for t in np.linspace(0.0, 1.0, TIMES)])
    if not np.isfinite(found).any():
        return []
    lo, hi = np.nanmin(found[:, 0]), np.nanmax(found[:, 1])
    out, joints, least = [], profile.points[:, 1], SLIM * profile.max_radius
    for margin in MARGINS:
        below, above = lo - margin * profile.max_radius, hi + margin * profile.max_radius
        below = float(np.min(joints[(joints < below) & (joints > below - least)], initial=below))
        above = float(np.max(joints[(joints > above) & (joints < above + least)], initial=above))
        bodies = []
        if below > profile.z_min + least:
            bodies.append(profile.clip(profile.z_min, below))
        else:
            below = profile.z_min
        if above < profile.z_max - least:
            bodies.append(profile.clip(above, profile.z_max))
        else:
            above = profile.z_max
        out.append(Slab(below, above, tuple(bodies)))
    return out


def standing(path: Turn, t: float) -> Turn:
    """The motion that stays in one pose of another one."""
    return path.part(t, t)


def uncovered(profile: Profile, path: Turn, slab: Slab, poses: int) -> float:
    """mm by which a tool reaches beyond `poses` + 1 of its poses at equal times and the sweeps of a slab's bodies.

    Measured in exact distances at a few instants between poses, on circles of the slab and its discs.
    """
    stops = np.linspace(0.0, 1.0, poses + 1)
    stood = [Sweep.along(profile, standing(path, float(t))) for t in stops]
    rest = [Sweep.along(body, path) for body in slab.bodies]
    worst = 0.0
    for k in range(poses) if poses <= 4 else (0, poses // 3, poses // 2, poses - 1):
        share = np.array([0.25, 0.5, 0.75]) if poses > 1 else np.linspace(0.0, 1.0, 9)[1:-1]
        times = stops[k] + share * (stops[k + 1] - stops[k])
        points = np.concatenate([_surface(profile, instant(path, float(t)), slab) for t in times])
        gap = np.full(len(points), np.inf)
        for sweep in (stood[k], stood[k + 1], *rest):
            out = gap > 0.0
            if out.any():
                gap[out] = np.minimum(gap[out], sweep.signed_distance(points[out]))
        worst = max(worst, float(gap.max()))
    return worst


def _surface(profile: Profile, now: Instant, slab: Slab) -> Floats:
    """(n, 3) mm: points of the surface of a slab at one time."""
    x, y = across(now.axis)
    plane = np.cross(now.axis, now.axis_rate)
    middle = float(np.arctan2(plane @ y, plane @ x))
    close = np.geomspace(1e-3, 0.2, 8)
    u = np.concatenate([
        np.linspace(0.0, 2.0 * np.pi, AROUND, endpoint=False),
        *(middle + side + np.concatenate([-close, [0.0], close]) for side in (0.0, np.pi)),
    ])  # fmt: skip
    m = np.cos(u)[:, None] * x + np.sin(u)[:, None] * y
    joints = profile.points[:, 1]
    z = np.union1d(np.linspace(slab.lo, slab.hi, 9), joints[(joints >= slab.lo) & (joints <= slab.hi)])
    circles_ = [(h, float(r)) for h, r in zip(z.tolist(), profile.radius_at(z), strict=True)]
    for h, end in ((profile.z_min, 0), (profile.z_max, -1)):
        if slab.lo <= h <= slab.hi:
            circles_ += [(h, share * float(profile.points[end, 0])) for share in (0.0, 0.25, 0.5, 0.75)]
    return np.concatenate([now.tip + h * now.axis + r * m for h, r in circles_])


def _heights(profile: Profile, path: Turn, t: float, depth: float) -> tuple[float, float]:
    """Lowest and highest circle of the sides that folds at one time or is the ring of a face; NaN if none."""
    now = instant(path, t)
    size = float(now.axis_rate @ now.axis_rate)
    if size == 0.0:
        return np.nan, np.nan
    lift = abs(float(now.velocity @ now.axis))
    side = now.velocity - float(now.velocity @ now.axis) * now.axis
    pivot = -float(side @ now.axis_rate) / size
    near = np.linalg.norm(side + pivot * now.axis_rate) < np.sqrt(size) * profile.max_radius
    found: list[float] = []
    for s in profile.segments:
        z, r, beta, ring = _circles(s, pivot, profile.max_radius)
        out, up = np.cos(beta), np.sin(beta)
        for u in grazing_angles(circles(now, z, r, out, up)).T:
            bend = np.full(len(z), 1.0 / s.radius if s.is_arc else 0.0)
            deep = folding(now, z, r, out, up, np.nan_to_num(u), bend) < -8.0 * depth
            found += z[deep & np.isfinite(u) & (r > 0.0) & (np.abs(out) > 1e-9)].tolist()
        slow = lift * abs(np.sin(ring[1])) < SLIDES * np.sqrt(size) * profile.max_radius if ring else False
        if near and ring is not None and slow:
            found.append(ring[0])
    return (min(found), max(found)) if found else (np.nan, np.nan)


def _circles(
    s: Segment, pivot: float, size: float
) -> tuple[Floats, Floats, Floats, tuple[float, float] | None]:
    """Heights, radii, normal angles of circles of a face, and height and normal angle of its ring."""
    b0, b1 = s.beta
    if s.is_arc:
        beta = np.linspace(b0, b1, ALONG)
        at = float(np.arctan2(s.cz - pivot, s.cr)) if s.cr > 1e-9 else np.inf
        ring = (s.cz + s.radius * float(np.sin(at)), at) if b0 <= at <= b1 else None
        return s.cz + s.radius * np.sin(beta), s.cr + s.radius * np.cos(beta), beta, ring
    x, high = np.linspace(0.0, 1.0, ALONG), s.z1 - s.z0
    ring = None
    if high > 0.0:
        first, last = s.z0 - s.r0 * np.tan(b0), s.z1 - s.r1 * np.tan(b0)
        at = float((pivot - first) / (last - first))
        close = np.array([0.0, *np.geomspace(1e-5, 1.0, 21)]) * size / high
        x = np.unique(np.clip(np.concatenate([x, at - close, at + close]), 0.0, 1.0))
        ring = (s.z0 + at * high, b0) if 0.0 <= at <= 1.0 else None
    return s.z0 + x * high, s.r0 + x * (s.r1 - s.r0), np.full(len(x), b0), ring


def least_count(missing: Callable[[int], float], gap: float, most: int) -> int | None:
    """Least number of equal parts of a block between which at most `gap` mm are missing; None above `most`.

    What is missing falls with the square of the number, beside sharp edges with the number: three looks are enough.
    """
    count, left = 1, missing(1)
    for order in (2, 1):
        if left <= gap:
            break
        count = int(np.ceil(1.05 * count * (left / gap) ** (1.0 / order)))
        if count > most:
            return None
        left = missing(count)
    return count if left <= gap else None


def _poses_needed(profile: Profile, path: Turn, slab: Slab, gap: float, most: int) -> int | None:
    """Least number of equal parts of a block whose ends cover a slab to `gap` mm; None above `most`."""
    return least_count(lambda count: uncovered(profile, path, slab, count), gap, most)


def plans(profile: Profile, path: Turn, depth: float, gap: float, most: int) -> Iterator[tuple[Slab, int]]:
    """Slabs with the number of parts whose ends cover them."""
    for slab in slabs(profile, path, depth):
        count = _poses_needed(profile, path, slab, gap, most)
        if count is not None:
            yield slab, count


def poses(profile: Profile, path: Turn, gap: float, most: int) -> int | None:
    """Least number of equal parts of a block whose ends alone cover it to `gap` mm; None above `most`."""
    return _poses_needed(profile, path, Slab(profile.z_min, profile.z_max, ()), gap, most)
