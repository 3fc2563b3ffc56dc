"""Contact of a tool at several places of one block, and what chips it takes there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engagement.along import _kernels
from vmachining.engagement.along.margin._kernels import Blade, World
from vmachining.engagement.along.sweeps import Sweeps
from vmachining.geometry import Line
from vmachining.sweep import Motion, Stance, Sweep, Turn
from vmachining.tool import Edge

__all__ = ["ANGLES", "Chips", "Cutting", "Sample", "Teeth", "fractions", "samples_along"]

ANGLES = 72
"""Rotation angles of the grid, at least; ends of arcs and jumps come to it."""

MOST_SAMPLES = 16
NEXT_TO_FEED = np.radians([0.03, 0.15, 0.6, 1.5, 3.0])
"""Angles beside those at which a wall along the feed is touched: shallow radial cuts are narrower than the grid."""

REDUCE_ANGLES = 48
BEHIND_MM = 0.02
"""The block's own sweep ends this far behind the tool, which stands on it: sweeps that end at the tool are slow to ask,
and no pose nearer than that covers more than 4e-4 / R mm of what lies ahead."""


SHORT = 1e-6
"""Share of a block that has not swept anything yet."""


class Teeth(NamedTuple):
    """The edge of a cutter, with its bottom, and how many angles its grid has.

    edge : straight. helical : the edge with its helix, None without one. count : teeth, 1 if unknown.
    """

    edge: Edge
    helical: Edge | None
    number: int

    @property
    def grid(self) -> int:
        """Angles of the grid: a multiple of the teeth, so that sums over the teeth are shifts."""
        return self.number * -(-ANGLES // self.number)


class Cutting(NamedTuple):
    """Engaged intervals at rotation angles.

    phi : (n,) rad. The first `grid` are evenly spaced over a turn; those up to `ring` lie beside the feed; those up to
        `own` are ends of arcs and sides of jumps; the rest is where the other teeth stand then, tooth after tooth.
    hits : (k, 4) index of the angle, segment of the edge, s at both ends, mm. arc : engaged rad. round_ : all of it.
    """

    phi: Floats
    grid: int
    own: int
    ring: int
    hits: Floats
    arc: float
    round_: bool


class Chips(NamedTuple):
    """At one place of a block.

    area_rate, thickness_rate : largest over the rotation angles of the integral of N . V along the edge and of N . V, V
        per unit of the block: times the share of the block that one tooth takes they are mm^2 and mm.
    ae, ap : mm, NaN where the feed is along the axis. fraction : engaged arcs over the turn.
    """

    area_rate: float
    thickness_rate: float
    ae: float
    ap: float
    fraction: float


def _air(turn: float | None) -> Chips:
    """Nothing is cut; along the axis there is no width to speak of."""
    return Chips(0.0, 0.0, float("nan") if turn is None else 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """One place of a block. now : (22,) row of the kernels. straight, helical : what the edges cut; None in air."""

    at: float
    now: Floats
    feed_angle: float | None
    straight: Cutting | None
    helical: Cutting | None
    chips: Chips


def fractions(length: float, radius: float) -> Floats:
    """t = j / n, j = 0..n, n = ceil(L / (R / 4)) between 1 and 16."""
    n = int(np.clip(np.ceil(length / (0.25 * radius) - 1e-9), 1, MOST_SAMPLES))
    return np.arange(n + 1) / n


def blade(edge: Edge) -> Blade:
    """An edge as the kernels want it."""
    return Blade(np.ascontiguousarray(edge.rows), np.array(edge.joints), edge.twist, edge.stretch)


def place(path: Motion, t: float, edge: Edge, bounds: Floats) -> tuple[Floats, float | None]:
    """Row of the kernels, and the feed angle (rad, None: along the axis)."""
    stance = Stance.on(path, t)
    speed = stance.speed(edge)
    corner = np.where(stance.axis > 0.0, bounds[1], bounds[0])
    top = float((corner - stance.tip) @ stance.axis) + 1e-6
    turning = float(np.linalg.norm(stance.axis_rate)) * (1.0 + edge.stretch)
    row = np.concatenate([
        stance.tip, stance.axis, stance.velocity, stance.axis_rate, stance.right, stance.ahead,
        [speed, 1e-12 * speed, top, turning],
    ])  # fmt: skip
    return row, stance.feed_angle


def samples_along(sweeps: Sweeps, block: int, path: Motion, teeth: Teeth, at: Floats) -> list[Sample]:
    """What a tool cuts at fractions `at` of a block that comes after `sweeps`; nothing is added to these."""
    edge, profile = teeth.edge, teeth.edge.profile
    places = [place(path, float(t), edge, sweeps.bounds) for t in at]
    lo, hi = Sweep.along(profile, path).bounds
    region = np.stack([np.maximum(lo, sweeps.bounds[0]), np.minimum(hi, sweeps.bounds[1])])
    if (region[0] > region[1]).any() or not np.isfinite([row[18] for row, _ in places]).all():
        return [
            Sample(float(t), row, turn, None, None, _air(turn))
            for t, (row, turn) in zip(at, places, strict=True)
        ]
    near = sweeps.near(region + [[-0.1], [0.1]])
    shape, helix = blade(edge), None if teeth.helical is None else blade(teeth.helical)
    own = isinstance(path, Turn) or not (isinstance(path, Line) and profile.is_convex)
    pitch = max(0.25, profile.max_radius / 12.0)
    slack = 0.0
    kept, count = np.empty(len(near) + 1, dtype=np.int64), -1
    world = sweeps.world
    if len(at) <= 2:  # short: the same sweeps for all places
        middle, _ = place(path, 0.5, edge, sweeps.bounds)
        slack = 0.5 * float(middle[18])
        count = _kernels.reduce(world, near, shape, middle[None], REDUCE_ANGLES, pitch, slack, kept)
    out = []
    for t, (row, turn) in zip(at, places, strict=True):
        if count < 0 or slack == 0.0:
            count = _kernels.reduce(world, near, shape, row[None], REDUCE_ANGLES, pitch, 0.0, kept)
        mine = kept[:count].copy()
        extra = None
        if own and (done := t - BEHIND_MM / max(path.length, BEHIND_MM)) > SHORT:
            extra = sweeps.push(block, Sweep.along(profile, path.split([done])[0]))
            mine = np.concatenate([[extra], mine])
        here = sweeps.world if extra is not None else world
        straight = _contact(here, mine, shape, row, turn, teeth.grid, teeth.number if helix is None else 1)
        wound = None
        if straight is not None and helix is not None:
            wound = _contact(here, mine, helix, row, turn, teeth.grid)
        if extra is not None:
            sweeps.pop(extra)
        chips = _air(turn) if straight is None else _chips(shape, row, turn, straight)
        out.append(Sample(float(t), row, turn, straight, wound, chips))
    return out


def _contact(
    world: World, kept: Ints, shape: Blade, row: Floats, turn: float | None, angles: int, teeth: int = 1
) -> Cutting | None:
    """Engaged intervals, None in air; with `teeth`, too, where the others stand when one is at an end of an arc."""
    ahead = 0.5 * np.pi - (0.0 if turn is None else turn)
    grid = (ahead + 2.0 * np.pi * np.arange(angles) / angles) % (2.0 * np.pi)
    more = np.empty(0)
    if turn is not None:
        sides = np.array([ahead - 0.5 * np.pi, ahead + 0.5 * np.pi])
        more = (np.concatenate([sides[0] + NEXT_TO_FEED, sides[1] - NEXT_TO_FEED])) % (2.0 * np.pi)
    size, room = angles + len(more) + 64, 8 * angles
    while True:
        phi, hits = np.empty(size), np.empty((room, 4))
        top, used, arc, whole = _kernels.contact(world, kept, len(kept), shape, row, grid, more, phi, hits)
        if top < 0:
            size *= 2
        elif used < 0:
            room *= 2
        else:
            break
    if not used:
        return None
    ring = angles + len(more)
    phi, own = phi[:top], top
    if teeth > 1 and own > ring:
        pitch = 2.0 * np.pi / teeth
        phi = np.concatenate([phi, *(phi[ring:own] + j * pitch for j in range(1, teeth))])
        while True:
            more_room = np.concatenate([hits[:used], np.empty((len(hits) + 8 * (len(phi) - own), 4))])
            done = _kernels.contact_at(world, kept, len(kept), shape, row, phi, own, more_room, used)
            if done >= 0:
                hits, used = more_room, done
                break
            hits = more_room
    return Cutting(phi, angles, own, ring, hits[:used], arc, whole)


def _chips(shape: Blade, row: Floats, turn: float | None, cutting: Cutting) -> Chips:
    axis, velocity = row[3:6], row[6:9]
    aside = np.cross(axis, velocity)
    size = float(np.linalg.norm(aside))
    now = np.concatenate([row, aside / size if size > 0.0 else aside, cutting.phi[: cutting.own]])
    out = np.empty((cutting.own, 6))
    hits = cutting.hits[cutting.hits[:, 0] < cutting.own]
    _kernels.chips(shape, now, hits, len(hits), cutting.own, out)
    low, high = float(out[:, 2].min()), float(out[:, 3].max())
    left, right = float(out[:, 4].min()), float(out[:, 5].max())
    return Chips(
        float(out[:, 0].max()),
        float(out[:, 1].max()),
        float("nan") if turn is None else right - left,
        high - low,
        cutting.arc / (2.0 * np.pi),
    )
