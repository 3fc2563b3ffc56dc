"""From a tool at one instant and a workpiece to the engaged intervals of its edge, angle by angle."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engagement.divide import divided
from vmachining.engagement.workpiece import By, Past, Workpiece, without
from vmachining.sweep import Stance
from vmachining.tool import Edge, EdgeParts

IDLE = 1e-12
"""N . V below this share of the speed of the edge counts as zero: an edge that slides along a wall cuts nothing."""

PHI_RAD = 1e-9
"""Ends of engaged arcs are narrowed to this."""

TOUCH_RAD = 1e-4
"""Arcs narrower than this are a line along which tool and wall touch: sqrt(2 x 1e-9 mm / R) for R = 0.2 mm."""

JUMP, JUMP_MM = 1.1, 0.02
"""A change of length from angle to angle may be a jump if it is this many times those next to it, and this much
more. Steep ends of a smooth curve are taken for one too: two angles more, which are as true as the others."""

GAUSS = 8
"""Nodes per interval of integrals along the edge; exact to rounding for arcs up to a quarter turn."""

GRAZING = 2e-3
"""Parts of the edge that enter the material slower than this share of what their normals could are touches of a finished wall,
0.11 degrees and 2e-6 R from it: distances know a wall to 2e-7 mm, which is less than that from R = 0.1 mm on."""

BESIDE_TOUCH = 1.5 * GRAZING * np.array([-3.0, -2.0, -1.0, 1.0, 2.0, 3.0])
"""rad: angles asked beside one whose edge slides along a wall; the first of them enters it already."""

FAN = 16
"""Angles tried at once between an angle that cuts and a neighbour that does not."""


class Contact(NamedTuple):
    """What an edge touches, turned through a grid of angles.

    phi : (n,) rad, the grid first, then the ends of the arcs, inside of each, both sides of every jump of the engaged length
    within an arc, and some beside each of these where the edge slides along a wall. grid : how many are grid.
    parts : engaged intervals; `row` counts in phi. arcs : (k, 2) rad, rising, engaged without a gap; an arc over
    the end of the grid ends beyond 2 pi.
    """

    phi: Floats
    grid: int
    parts: EdgeParts
    arcs: Floats


def facing_parts(edge: Edge, stance: Stance, phi: Floats) -> EdgeParts:
    """The parts of the edge whose surface moves into what lies before it, N . V > 0."""
    whole = edge.whole(len(phi), By.EDGE)
    speed = stance.speed(edge)
    if speed == 0.0:
        return whole.take(np.zeros(0, dtype=np.int64))
    radii = [s.radius for s in edge.segments if s.is_arc]
    turning = float(np.linalg.norm(stance.axis_rate))
    # N turns with the arc and with the lag, V changes with the place: a bound of d(N . V)/ds, never 0
    bend = max((1.0 / r for r in radii), default=0.0) + abs(edge.twist) + 1e-3
    steep = speed * bend + turning * (1.0 + edge.stretch)

    def behind(row: Ints, piece: Ints, s: Floats) -> Floats:
        return (IDLE * speed - stance.normal_speed(edge, phi[row], piece, s)) / steep

    return divided(behind, whole, 1.0, By.FACING, inside=True)


def engaged_parts(
    edge: Edge,
    stance: Stance,
    phi: Floats,
    workpiece: Workpiece,
    own: Sequence[Past] = (),
    *,
    facing: bool = True,
) -> EdgeParts:
    """Engaged intervals of the edge at phi (n,), see `contact`."""
    parts = facing_parts(edge, stance, phi) if facing else edge.whole(len(phi), By.EDGE)
    parts = workpiece.holds(edge, stance, phi, parts)
    for one in own:
        parts = without(parts, one, edge, stance, phi, own=True)
    return parts


def contact(
    edge: Edge,
    stance: Stance,
    workpiece: Workpiece,
    own: Sequence[Past] = (),
    *,
    angles: int = 360,
    phase: float = 0.0,
    facing: bool = True,
) -> Contact:
    """What the edge of a tool touches at one instant of a block, at every rotation angle.

    workpiece : before this block.
    own : what this block has swept already, left out where it cannot cover the front of the tool.
    angles, phase : of the grid, 2 pi (k + phase) / angles; a phase of 0.5 keeps it off the directions in which
        edges slide along walls.
    facing : False takes all of the edge, as the geometry tests of the literature do.
    """
    phi = 2.0 * np.pi * (np.arange(angles) + phase) / angles

    def engaged(at: Floats) -> EdgeParts:
        return engaged_parts(edge, stance, at, workpiece, own, facing=facing)

    parts = engaged(phi)
    cutting = np.bincount(parts.row, minlength=angles) > 0
    arcs = _arcs(cutting, phi, engaged)
    if not cutting.all():
        for first, last in arcs[np.ptp(arcs, axis=1) < TOUCH_RAD]:
            turn = 2.0 * np.pi * np.ceil((first - phi - PHI_RAD) / (2.0 * np.pi))
            parts = parts.take(phi[parts.row] + turn[parts.row] > last + PHI_RAD)
        arcs = arcs[np.ptp(arcs, axis=1) >= TOUCH_RAD]
    ends = np.empty(0) if cutting.all() else arcs.ravel()
    found = Contact(phi, angles, parts, arcs)
    found = _more(found, np.concatenate([ends, _jumps(parts, phi, engaged)]), engaged)
    sliding = np.unique(found.phi[found.parts.row[~entering(edge, stance, found.phi, found.parts, GRAZING)]])
    sliding = sliding[np.diff(sliding, prepend=-np.inf) > TOUCH_RAD]  # of two angles that are one the first
    return _more(found, (sliding[:, None] + BESIDE_TOUCH).ravel(), engaged)


def _more(found: Contact, phi: Floats, engaged: Callable[[Floats], EdgeParts]) -> Contact:
    """What was found, and the edge at angles beyond the grid."""
    if not len(phi):
        return found
    parts = engaged(phi)
    parts = parts._replace(row=parts.row + len(found.phi))
    joined = EdgeParts._make(np.concatenate(pair) for pair in zip(found.parts, parts, strict=True))
    return found._replace(phi=np.concatenate([found.phi, phi]), parts=joined)


def nodes(parts: EdgeParts) -> tuple[Ints, Ints, Floats, Floats]:
    """row, piece, s and weight of Gauss nodes of intervals, (n * GAUSS,)."""
    x, w = _gauss()
    half = 0.5 * (parts.upper - parts.lower)
    s = (parts.lower + half)[:, None] + half[:, None] * x
    row, piece = (np.repeat(column, GAUSS) for column in (parts.row, parts.piece))
    return row, piece, s.ravel(), (half[:, None] * w).ravel()


@lru_cache(maxsize=1)
def _gauss() -> tuple[Floats, Floats]:
    x, w = np.polynomial.legendre.leggauss(GAUSS)
    return x, w


def entering(edge: Edge, stance: Stance, phi: Floats, parts: EdgeParts, least: float) -> Bools:
    """Whether intervals enter the material somewhere at `least` as a share of the speed that their normals allow."""
    row, piece, s, _ = nodes(parts)
    p = edge.at(piece, s)
    across = np.hypot(stance.velocity @ stance.right, stance.velocity @ stance.ahead)
    most = p.n_r * across + np.abs(p.n_z * (stance.velocity @ stance.axis))
    most += np.abs(p.z * p.n_r - p.r * p.n_z) * np.linalg.norm(stance.axis_rate)
    moved = np.abs(stance.normal_speed(edge, phi[row], piece, s))
    return np.asarray((moved >= least * most).reshape(-1, GAUSS).any(axis=1))


def _arcs(cutting: Bools, phi: Floats, engaged: Callable[[Floats], EdgeParts]) -> Floats:
    """Engaged arcs; the change between two grid angles is narrowed until `PHI_RAD`, its cutting side is kept."""
    n = len(phi)
    if cutting.all():
        return np.array([[phi[0], phi[0] + 2.0 * np.pi]])
    if not cutting.any():
        return np.empty((0, 2))
    step = 2.0 * np.pi / n
    enters = np.flatnonzero(cutting & ~np.roll(cutting, 1))
    leaves = np.flatnonzero(cutting & ~np.roll(cutting, -1))
    good = np.concatenate([phi[enters], phi[leaves]])
    bad = np.concatenate([phi[enters] - step, phi[leaves] + step])
    good, _ = _narrowed(good, bad, lambda at: _lengths(engaged(at.ravel()), at.size).reshape(at.shape) > 0.0)
    first, final = good[: len(enters)], good[len(enters) :]
    if leaves[0] < enters[0]:  # the arc over the end of the grid
        final = np.roll(final, -1)
        final[-1] += 2.0 * np.pi
    out = np.column_stack([first, final])
    early = out[:, 0] < 0.0  # begins before the first angle of the grid
    out[early] += 2.0 * np.pi
    return np.asarray(out[np.argsort(out[:, 0])])


def _jumps(parts: EdgeParts, phi: Floats, engaged: Callable[[Floats], EdgeParts]) -> Floats:
    """(2 k,) rad: both sides of the angles where the engaged length jumps, because edges lie along edges there.

    A jump stands out from the changes next to it; the largest change within is followed until `PHI_RAD`.
    """
    length = _lengths(parts, len(phi))
    after = np.roll(length, -1)
    change = np.abs(after - length)
    beside = np.maximum(np.roll(change, 1), np.roll(change, -1))
    jump = np.flatnonzero((length > 0.0) & (after > 0.0) & (change > JUMP * beside + JUMP_MM))
    if not len(jump):
        return np.empty(0)
    left, right = phi[jump], phi[jump] + 2.0 * np.pi / len(phi)
    low, high = length[jump], after[jump]
    share, every = np.arange(1, FAN) / FAN, np.arange(len(jump))
    while (right - left).max() > PHI_RAD:
        tried = left[:, None] + (right - left)[:, None] * share
        angle = np.column_stack([left, tried, right])
        found = _lengths(engaged(tried.ravel()), tried.size).reshape(tried.shape)
        value = np.column_stack([low, found, high])
        most = np.argmax(np.abs(np.diff(value, axis=1)), axis=1)
        left, right = angle[every, most], angle[every, most + 1]
        low, high = value[every, most], value[every, most + 1]
    return np.stack([left, right], axis=1).ravel()


def _narrowed(good: Floats, bad: Floats, same: Callable[[Floats], Bools]) -> tuple[Floats, Floats]:
    """Angles (n,) on both sides of a change, closer than `PHI_RAD`; `same` (n, m) is true as at `good`."""
    share = np.arange(1, FAN) / FAN
    every = np.arange(len(good))
    while np.abs(bad - good).max() > PHI_RAD:
        tried = good[:, None] + (bad - good)[:, None] * share
        hit = same(tried)
        last = np.where(hit.all(axis=1), FAN - 1, np.argmin(hit, axis=1))  # tries as the good side
        ladder = np.column_stack([good, tried, bad])
        good, bad = ladder[every, last], ladder[every, last + 1]
    return good, bad


def _lengths(parts: EdgeParts, rows: int) -> Floats:
    """(rows,) engaged mm of the meridian."""
    out = np.zeros(rows)
    np.add.at(out, parts.row, parts.upper - parts.lower)
    return out
