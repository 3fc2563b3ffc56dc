"""Sweeps of a turning tool as convex hulls of neighbouring poses: proven on both sides, for blocks that turn little.

Symbols: K a convex body of revolution, T_t its motion without spin, 0 = t_0 < t_1 < .. its instants, D their distance; b2
bounds the acceleration of its points, w the rate of its axis.

*Around.* For y in K and t in [t_j, t_j+1] the point T_t y is at most e = D^2 b2 / 8 from the chord between T_j y and T_j+1 y.
So the sweep lies in the union of the hulls of neighbouring poses of K grown by e.

*Inside.* A triangle of such a hull joins points T_i y_i with i = j or j + 1. A point of it, with weights l_i, is at most

    E = e + w D max |y_i - y_k| / 4          (y_i, y_k corners of different poses; covariance of 0 and 1, Popoviciu)

from T_s y with y = sum l_i y_i in K and s = sum l_i t_i. The boundary of the hull can thus be drawn onto the image of a closed
surface in the convex set K x [0, 1], each triangle moving by its own E at most, and that image shrinks to a point within the
sweep. So a point of the hull that no triangle passes is in the sweep or within E of it: hulls of a body narrowed by the
largest E of those triangles that come as near as E to a box lie, in that box, inside the sweep. Nothing folds: hulls are
convex, and what several of them hold is counted once by their union.

*After a block that ended in T_0.* The hull is the union of the cones from a point o of the axis over its triangles. Let X lie
in the cone over a triangle f of T_0 Q, Q the polyhedron around K, and in T_t K, t <= D, but not in T_0 K. The segment from o to
X leaves T_0 K in Y with an outward normal n, and the material point of X was at X_0 in T_0 K, so n.(X - X_0) >= 0. But
n.(X - X_0) <= t n.V_0(X_0) + t^2 b2 / 2. X_0 is at most |V| D + |YZ| from f, where the segment, or its continuation, meets f
in Z, and V_0 changes by w a mm. So if

    max over n, and over corners v of f, of n.V_0(v)  <  -(w (|V| D + |YZ|) + b2 D / 2)

there is no such X, and the cone is left out. The normals: Y and Z have the same azimuth and the same elevation seen from o, so
n has an azimuth of f and the slope of a piece of the meridian between the elevations of f. |YZ| <= g far / rho, where no point
of Q is farther than g from K, none of K farther than `far` from o, and a ball of radius rho about o lies in K.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engines.mesh.facets import Side, grown, hull, meridian, narrowed, rings
from vmachining.engines.mesh.turning import _kernels
from vmachining.engines.mesh.turning.pieces import BEND, SAG, TWIST, apart, reaching
from vmachining.sweep import Sweep, Turn
from vmachining.sweep.bounds import reach, support
from vmachining.tool import Profile, convex_cover

MOST = 32
"""Hulls of one convex body in one tile, above which a block is left unproven: each is a boolean."""

ROUNDED_MM = 1e-9
"""By which outer bodies are grown, and inner ones narrowed, besides: rounding of a hull (1e-12 of its extent)."""

STILL_MM = 1e-6
"""Turning that moves points by less is left out, and added to errors: facets that are all but one plane make slivers."""

BREAKS = 32
"""Parts of an arc of the meridian that have their own normals."""

SLOPES = 360
"""Normals at which the ball within a body is measured."""


class _Motion(NamedTuple):
    """Of one convex body: its path, rate of the axis, acceleration and speed of its points at most.

    still : mm by which turning moves any point, where that is so little that the body is taken not to turn (rate 0).
    """

    turn: Turn
    rate: float
    bow: float
    speed: float
    still: float


def turning_hulls(
    sweep: Sweep, chord: float, side: Side, box: Floats, *, chained: bool
) -> list[tuple[Floats, Ints]] | None:
    """Closed meshes whose union is proven, in a box (2, 3) mm, to lie inside the sweep or to hold it; None: it takes too many.

    chained : the cutter at the start of the path has been removed before: an outer mesh may lack what only it cuts.
    """
    turn = sweep.path
    assert isinstance(turn, Turn)
    rate, out = turn.axis_series.bound(1), list[tuple[Floats, Ints]]()
    for part in convex_cover(sweep.profile):
        piece = reaching(part, turn, box, chord + 0.5 * rate * part.max_radius)
        if piece is None:
            continue
        height, radius = float(np.abs(piece.points[:, 1]).max()), piece.max_radius
        bend, far = turn.axis_series.bound(2), float(np.hypot(radius, height))
        bow = turn.tip_series.bound(2) + height * bend + radius * (bend + rate * rate)
        still = rate * far if rate * far < STILL_MM else 0.0
        motion = _Motion(turn, 0.0 if still else rate, bow, turn.tip_series.bound(1) + rate * far, still)
        inner = side is Side.INNER
        found = _inner(piece, motion, chord, box) if inner else _outer(piece, motion, chord, chained)
        if found is None:
            return None
        out += [mesh for mesh in found if not apart(mesh[0], box)]
    return out


def _longest(part: Profile) -> float:
    """mm, the longest straight line of the meridian, or the disc at its bottom: so far apart are corners of a triangle."""
    lines = [float(np.hypot(s.r1 - s.r0, s.z1 - s.z0)) for s in part.segments if not s.is_arc]
    return max(2.0 * float(part.points[0, 0]), *lines, 0.0)


def _count(part: Profile, motion: _Motion, chord: float) -> int:
    """Hulls that a body needs."""
    turn, bow = motion.rate * _longest(part) / (4.0 * TWIST * chord), motion.bow / (8.0 * BEND * chord)
    return max(1, int(np.ceil(max(turn, np.sqrt(bow)) - 1e-9)))


def _clouds(line: Floats, sag: float, side: Side, motion: _Motion, count: int) -> tuple[Floats, Floats]:
    """Corners (n, 3) of the body in its own frame, and in count + 1 poses (count + 1, n, 3)."""
    own = np.concatenate(rings(line, sag, side))
    t = np.linspace(0.0, 1.0, count + 1)
    axes = motion.turn.axis(0.0 * t if motion.still else t)
    frame = _kernels.transported(axes)  # type: ignore[no-untyped-call]
    return own, motion.turn.position(t)[:, None] + np.einsum("nb,jbc->jnc", own, frame)


def _outer(part: Profile, motion: _Motion, chord: float, chained: bool) -> list[tuple[Floats, Ints]] | None:
    count, sag = _count(part, motion, chord), SAG * chord
    if count > MOST:
        return None
    bow = motion.bow / (8.0 * count**2) + motion.still + ROUNDED_MM
    line = grown(meridian(part, sag, Side.OUTER), bow, bow)
    own, poses = _clouds(line, sag, Side.OUTER, motion, count)
    out = []
    for k, (first, last) in enumerate(pairwise(poses)):
        used, points, triangles, _ = hull(np.concatenate([first, last]))
        if chained and k == 0:
            alone = (used[triangles] < len(own)).all(axis=1)
            rear = np.zeros(len(triangles), dtype=bool)
            beyond = _beyond(line, sag) + 1.1 * sag + 2.0 * bow
            rear[alone] = _receding(part, motion, count, beyond, own[used[triangles[alone]]])
            apex = motion.turn.position(0.0) + _middle(part) * motion.turn.axis(0.0)
            points, triangles = _without(points, triangles, rear, apex)
        out.append((points, triangles))
    return [mesh for mesh in out if len(mesh[1])]


def _inner(part: Profile, motion: _Motion, chord: float, box: Floats) -> list[tuple[Floats, Ints]] | None:
    count, sag, most = _count(part, motion, chord), SAG * chord, (BEND + TWIST) * chord
    line, spread = meridian(part, sag, Side.INNER), 3.0 * float(np.sqrt(2.0 * sag * part.max_radius))
    least, apart_ = 0.0, _longest(part) + spread
    while count <= MOST:
        if least == 0.0:  # what is likely to do
            turned = 0.25 * motion.rate / count * apart_
            least = motion.bow / (8.0 * count**2) + turned + motion.still + 3.0 * ROUNDED_MM
        least = min(least, most)
        shrunk = narrowed(line, least, least)
        if shrunk is None:  # thinner than that: nothing is inside
            return []
        meshes, need = _within(shrunk, sag, part, motion, count, box)
        if need <= least:
            return meshes
        if need > most:
            count = max(count + 1, int(np.ceil(count * min(need / most, 4.0))))
        least = 1.05 * need if need <= most and least < most else 0.0
    return None


def _within(
    line: Floats, sag: float, part: Profile, motion: _Motion, count: int, box: Floats
) -> tuple[list[tuple[Floats, Ints]], float]:
    """Hulls of a narrowed meridian, and the largest E of their triangles that come near the box."""
    own, poses = _clouds(line, sag, Side.INNER, motion, count)
    t = np.linspace(0.0, 1.0, count + 1)
    axes = motion.turn.axis(0.0 * t if motion.still else t)
    arms = poses - (motion.turn.position(t) + _middle(part) * axes)[:, None]
    out, need = [], 0.0
    for first, last, a, b in zip(poses, poses[1:], arms, arms[1:], strict=False):
        used, points, triangles, _ = hull(np.concatenate([first, last]))
        moves = _moves(np.concatenate([a, b])[used], used >= len(own), triangles, motion, count)
        corners = points[triangles]
        near = (corners.min(axis=1) - moves[:, None] < box[1]).all(axis=1)
        near &= (corners.max(axis=1) + moves[:, None] > box[0]).all(axis=1)
        need = max(need, float(moves[near].max(initial=0.0)))
        out.append((points, triangles))
    return out, need


def _middle(part: Profile) -> float:
    """Height of a point well inside."""
    return 0.5 * (part.z_min + part.z_max)


def _beyond(line: Floats, sag: float) -> float:
    """mm by which corners of outer polygons lie beyond their circles."""
    polygons = zip(rings(line, sag, Side.OUTER), line[:, 0], strict=True)
    return max(float(np.hypot(ring[:, 0], ring[:, 1]).max() - r) for ring, r in polygons)


def _receding(part: Profile, motion: _Motion, count: int, beyond: float, corners: Floats) -> Bools:
    """Which triangles (m, 3, 3) of the first pose, in the frame of the body, have nothing but that pose in their cones."""
    middle, step = _middle(part), 1.0 / count
    x, y, z = np.moveaxis(corners, 2, 0)
    r, around = np.hypot(x, y), np.arctan2(y, x)
    on_axis = r == 0.0
    off = (around - around[np.arange(len(r)), np.argmax(r, axis=1)][:, None] + np.pi) % (2.0 * np.pi) - np.pi
    lo, hi = np.where(on_axis, np.inf, off).min(axis=1), np.where(on_axis, -np.inf, off).max(axis=1)
    wide = hi - lo
    turned = around[np.arange(len(r)), np.argmax(r, axis=1)] + 0.5 * (lo + hi)
    near, far = r.min(axis=1) * np.cos(0.5 * np.minimum(wide, np.pi)), r.max(axis=1)
    seen = np.stack([np.arctan2(h - middle, q) for h in (z.min(axis=1), z.max(axis=1)) for q in (near, far)])
    low, high = _slopes(part, seen.min(axis=0), seen.max(axis=0))
    spread = 0.5 * (wide + high - low)
    slope = 0.5 * (low + high)
    n = np.stack([np.cos(slope) * np.cos(turned), np.cos(slope) * np.sin(turned), np.sin(slope)], axis=1)
    turn = motion.turn
    frame = _kernels.transported(turn.axis(np.array([0.0])))[0]  # type: ignore[no-untyped-call]
    velocity, rate = frame @ turn.velocity(0.0), frame @ turn.axis_rate(0.0)
    # omega x x = (a x a') x x = a' (a.x) - a (a'.x), a = e_3 in the frame of the body
    v = velocity + z[..., None] * rate - (corners @ rate)[..., None] * np.array([0.0, 0.0, 1.0])
    along = np.einsum("mcb,mb->mc", v, n) + np.linalg.norm(v, axis=2) * spread[:, None]
    within, all_of_it = _ball(part, middle)
    if within <= 0.0:
        return np.zeros(len(corners), dtype=bool)
    away = motion.speed * step + beyond / within * all_of_it
    drift = turn.axis_series.bound(1) * away + 0.5 * motion.bow * step
    out: Bools = (wide < np.pi) & (along.max(axis=1) + drift < -ROUNDED_MM)
    return out


def _slopes(part: Profile, low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """Least and largest slope of normals of the meridian between elevations seen from the middle of the axis."""
    middle, half = _middle(part), 0.5 * np.pi
    bottom, top = (float(np.arctan2(z - middle, r)) for r, z in part.points[[0, -1]])
    rows = [(-half, -half), (bottom, -half)]
    for s in part.segments:
        for share in np.linspace(0.0, 1.0, BREAKS + 1 if s.is_arc else 2).tolist():
            beta = s.beta[0] + share * (s.beta[1] - s.beta[0])
            r, z = s.r0 + share * (s.r1 - s.r0), s.z0 + share * (s.z1 - s.z0)
            if s.is_arc:
                r, z = s.cr + s.radius * float(np.cos(beta)), s.cz + s.radius * float(np.sin(beta))
            rows.append((float(np.arctan2(z - middle, r)), beta))
    seen, slope = np.maximum.accumulate(np.array([*rows, (top, half), (half, half)])).T
    first = np.maximum(np.searchsorted(seen, low - ROUNDED_MM, "right") - 1, 0)
    last = np.minimum(np.searchsorted(seen, high + ROUNDED_MM, "left"), len(seen) - 1)
    return slope[first], slope[last]


def _ball(part: Profile, middle: float) -> tuple[float, float]:
    """Radius of a ball about a point of the axis within the body, and of one that holds it."""
    along = np.sin(np.linspace(-0.5 * np.pi, 0.5 * np.pi, SLOPES + 1))
    far = reach(part, middle)
    least = float((support(part, along) - middle * along).min())
    return least - far * np.pi / (2.0 * SLOPES), far


def _without(points: Floats, triangles: Ints, rear: Bools, apex: Floats) -> tuple[Floats, Ints]:
    """A hull without the cones over some of its triangles."""
    if not rear.any():
        return points, triangles
    kept = triangles[~rear]
    edges = np.concatenate([kept[:, [0, 1]], kept[:, [1, 2]], kept[:, [2, 0]]])
    there = {(int(a), int(b)) for a, b in edges}
    border = [(b, a, len(points)) for a, b in there if (b, a) not in there]
    rim = np.array(sorted(border), dtype=np.int64).reshape(-1, 3)
    return np.vstack([points, apex]), np.concatenate([kept, rim])


def _moves(y: Floats, late: Bools, triangles: Ints, motion: _Motion, count: int) -> Floats:
    """E of each triangle, mm. y : corners from the middle of the axis in their own pose, turned with it."""
    angle, far = motion.rate / count, float(np.linalg.norm(y, axis=1).max())
    apart = np.zeros(len(triangles))
    for a, b in ((0, 1), (1, 2), (2, 0)):
        i, k = triangles[:, a], triangles[:, b]
        apart = np.maximum(apart, np.where(late[i] != late[k], np.linalg.norm(y[i] - y[k], axis=1), 0.0))
    apart += np.where(apart > 0.0, angle * far, 0.0)  # by which the two frames differ
    moves: Floats = motion.bow / (8.0 * count**2) + 0.25 * angle * apart + motion.still + 2.0 * ROUNDED_MM
    return moves
