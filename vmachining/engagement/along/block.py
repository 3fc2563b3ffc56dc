"""Contact of tools at stations along the motions of a program, and what chips they take there.

One call of the kernels looks at the stations of all motions of one tool in a row. Any motions can be asked by themselves: the
earlier sweeps whose boxes meet theirs enter tiles of the plan first, then each motion enters them after its stations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from math import ceil
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engagement.along.kernels.edge_kernels import VALUES
from vmachining.engagement.along.kernels.margin_kernels import Blade, Room
from vmachining.engagement.along.kernels.point_kernels import NODES, Scene, Work
from vmachining.engagement.along.kernels.resample_kernels import resample
from vmachining.engagement.along.kernels.tile_kernels import Tiles
from vmachining.engagement.along.kernels.turn_kernels import COLUMNS, GRID, ROOM, Turn
from vmachining.engagement.along.kernels.walk_kernels import Kept, Stops, replay, walk
from vmachining.engagement.along.sweeps import Sweeps
from vmachining.geometry import Arc, Line
from vmachining.sweep import Motion, Stance, Sweep
from vmachining.tool import Edge

ANGLES = 72  # at which forces are summed, at least; angles where values jump come to it
MOST_SAMPLES = 16
EVEN = [np.arange(n + 1) / n for n in range(1, MOST_SAMPLES + 1)]
BEHIND_MM = 0.02  # a motion's own sweep ends behind the tool: no nearer pose covers more than 4e-4 / R mm of what lies ahead
BEFORE_END_MM = 1e-4  # of a block, its last place: at the end the tool may touch a wall that it never enters
TILES, PER_RADIUS = 256, 4  # tiles along the longer side at most, and to a radius
PARTS, LIST = 16, 4096  # parts of the edge that cut at one angle, sweeps near one station, to begin with


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

    phi : (n,) rad. The first `grid` are evenly spaced over a turn; those up to `own` are where values jump or are largest; the
        rest is where the other teeth stand then, tooth after tooth.
    hits : (k, 4) index of the angle, segment of the edge, s at both ends, mm.
    """

    phi: Floats
    grid: int
    own: int
    hits: Floats


class Chips(NamedTuple):
    """At one place of a block.

    area_rate, thickness_rate : largest over the rotation angles of the integral of N . V along the edge and of N . V, V
        per unit of the block: times the share of the block that one tooth takes they are mm^2 and mm.
    ae, ap : mm, NaN where the feed is along the axis. fraction : engaged arcs over the turn. planned : the part of it with a
        chip area above 1 % of the largest.
    """

    area_rate: float
    thickness_rate: float
    ae: float
    ap: float
    fraction: float
    planned: float


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """One place of a block. now : (22,) row of the kernels. straight, helical : what the edges cut; None in air."""

    at: float
    now: Floats
    straight: Cutting | None
    helical: Cutting | None
    chips: Chips


@dataclass(frozen=True, slots=True, eq=False)
class Seen:
    """Stations in the order they were asked: motion (n,), at (n,) fraction of it, now (n, 22), columns (n, 6) as `Chips`."""

    motion: Ints
    at: Floats
    now: Floats
    columns: Floats
    kept: tuple[Kept, ...]
    kept_of: Ints

    def chips(self, s: int) -> Chips:
        """Of one station."""
        return Chips(*self.columns[s].tolist())

    def sample(self, s: int, teeth: Teeth) -> Sample:
        """One station with what its edges cut; the stations must have been kept."""
        chips, now = self.chips(s), self.now[s]
        kept = self.kept[self.kept_of[s]]
        first, last, ring = kept.station[s].tolist()
        if chips.fraction == 0.0 or last == first:
            return Sample(float(self.at[s]), now, None, None, chips)
        angle = kept.angle[first:last]
        middle = float(np.arctan2(now[6:9] @ now[12:15], now[6:9] @ now[15:18]))
        # rising over a turn, from the first on
        rising = angle[0] + (angle - angle[0]) % (2.0 * np.pi)
        order = np.argsort(rising, kind="stable")
        known = np.ascontiguousarray(rising[order]), np.ascontiguousarray(kept.span[first:last][order])
        even = (middle + 2.0 * np.pi * np.arange(teeth.grid) / teeth.grid) % (2.0 * np.pi)
        step = 2.0 * np.pi / GRID
        beside = np.abs((rising - middle + 0.5 * step) % step - 0.5 * step) > 1e-9
        cuts = np.ptp(kept.span[first:last], axis=1) > 0
        special = rising[beside & cuts]
        if not ring:  # a chain of angles ends 0.03 degrees before facing does
            ends = (middle + np.array([-0.5, 0.5]) * np.pi * (1.0 - 1e-9))[cuts[[0, -1]]]
            special = np.concatenate([special, ends])
        pitch = 2.0 * np.pi / teeth.number
        turned = [special + k * pitch for k in range(1, teeth.number)]
        phi = np.concatenate([even, special, *turned])
        own = len(even) + len(special)
        straight = Cutting(phi, len(even), own, _hits(teeth.edge, known, kept.part, ring, phi))
        wound = None
        if teeth.helical is not None:
            wound = Cutting(even, len(even), len(even), _hits(teeth.helical, known, kept.part, ring, even))
        return Sample(float(self.at[s]), now, straight, wound, chips)


def _hits(edge: Edge, known: tuple[Floats, Ints], part: Floats, ring: int, phi: Floats) -> Floats:
    """Engaged stretches at angles, see `Cutting`."""
    room = 8 * len(phi) + 64
    while True:
        hits = np.empty((room, 4))
        used = resample(blade(edge), *known, part, ring, phi, hits)
        if used < room:
            return hits[:used].copy()
        room *= 2


def fractions(length: float, radius: float) -> Floats:
    """t = j / n, j = 0..n, n = ceil(L / (R / 4)) between 1 and 16."""
    return EVEN[min(max(ceil(length / (0.25 * radius) - 1e-9), 1), MOST_SAMPLES) - 1]


def blade(edge: Edge) -> Blade:
    """An edge as the kernels take it."""
    return Blade(np.ascontiguousarray(edge.rows), np.array(edge.joints), edge.twist, edge.stretch)


def _rows(paths: Sequence[Motion], edges: Sequence[Edge], owner: Ints, at: Floats, bounds: Floats) -> Floats:
    """Rows (n, 22) of the kernels at fractions (n,) of motions.

    owner : (n,) motion of each.
    """
    out = np.zeros((len(at), 22))
    straight = np.array([isinstance(path, Line) for path in paths])
    if straight.any():
        ends = np.array([(path.start, path.end) for path in paths if isinstance(path, Line)])
        here = straight[owner]
        start, end = ends[(np.cumsum(straight) - 1)[owner[here]]].transpose(1, 0, 2)
        share = at[here, None]
        out[here, 0:3], out[here, 6:9] = (1.0 - share) * start + share * end, end - start
    for m in np.flatnonzero(~straight).tolist():
        path, edge, here = paths[m], edges[m], owner == m
        if isinstance(path, Arc) and path.axis == 2:
            out[here, 0:3], out[here, 6:9] = path.position(at[here]), path.velocity(at[here])
            straight[m] = True
            continue
        for k in np.flatnonzero(here).tolist():
            stance = Stance.on(path, float(at[k]))
            speed = stance.speed(edge)
            corner = np.where(stance.axis > 0.0, bounds[1], bounds[0])
            top = float((corner - stance.tip) @ stance.axis) + 1e-6
            turning = float(np.linalg.norm(stance.axis_rate)) * (1.0 + edge.stretch)
            out[k] = np.concatenate([
                stance.tip, stance.axis, stance.velocity, stance.axis_rate, stance.right, stance.ahead,
                [speed, 1e-12 * speed, top, turning],
            ])  # fmt: skip
    upright = straight[owner]
    out[upright, 5] = out[upright, 12] = out[upright, 16] = 1.0
    out[upright, 18] = np.linalg.norm(out[upright, 6:9], axis=1)
    out[upright, 19] = 1e-12 * out[upright, 18]
    return out


def contact_along(
    sweeps: Sweeps, asked: Sequence[tuple[int, Floats]], edges: Sequence[Edge], *, keep: bool = False
) -> Seen:
    """What tools cut at stations of motions, each in the workpiece before it.

    asked : motion and its fractions, motions rising. edges : (of every motion asked) edge of its tool, with the bottom.
    keep : what every angle cuts is kept, for forces.
    """
    counts = [len(at) for _, at in asked]
    total = int(sum(counts))
    owner = np.repeat(np.arange(len(asked)), counts)
    number = np.array([k for k, _ in asked], dtype=np.int64)
    motion, columns = number[owner], np.zeros((total, COLUMNS))
    at = np.concatenate([t for _, t in asked]) if asked else np.empty(0)
    if not total:
        return Seen(motion, at, np.zeros((0, 22)), columns, (), np.zeros(0, dtype=np.int64))
    cutters, paths = zip(*(sweeps.motion(k) for k, _ in asked), strict=True)
    length = np.array([path.length for path in paths])
    before = np.minimum(at, (1.0 - BEFORE_END_MM / np.maximum(length, 1e3 * BEFORE_END_MM))[owner])
    nows = _rows(paths, edges, owner, before, sweeps.bounds)
    sizes = {id(cutter): (cutter.max_radius, cutter.z_min, cutter.z_max) for cutter in cutters}
    boxes = _box(np.array([sizes[id(cutter)] for cutter in cutters])[owner], nows)
    posed = np.array([sweeps.is_posed(k) for k, _ in asked])[owner]
    # what turns ends where the tool stands, the others are as if it stood at `at`
    tips = nows[:, :3] + np.where(~posed & (nows[:, 5] == 1.0), at - before, 0.0)[:, None] * nows[:, 6:9]
    behind = np.where(posed, at - before, (BEHIND_MM / np.maximum(length, BEHIND_MM))[owner])
    station = np.column_stack([motion, at, behind, at == 1.0])
    counted, extra = sweeps.counts, np.full(total, -1, dtype=np.int64)
    for s in np.flatnonzero((sweeps.cuts[motion, 2] == 2) & (before > 1e-6)).tolist():
        # exact distances know what only touches: this ends where the tool stands
        path = paths[owner[s]].split([float(before[s])])[0]
        extra[s] = sweeps.push(Sweep.along(cutters[owner[s]], path))
    low, high = sweeps.bounds + [[-1e-6], [1e-6]]
    boxes = np.concatenate([np.maximum(boxes[:, :3], low), np.minimum(boxes[:, 3:], high)], axis=1)
    radius = min(edge.profile.max_radius for edge in edges)
    walker = _Walk(sweeps, boxes, asked[0][0], radius)
    stops = Stops(sweeps.cuts, station, extra, nows, tips, boxes, columns)
    kept, kept_of = [], np.zeros(total, dtype=np.int64)
    tool = np.repeat([id(edge) for edge in edges], counts)
    for _, group in groupby(range(total), key=lambda j: int(tool[j])):
        mine = list(group)
        edge = edges[int(np.searchsorted(np.cumsum(counts), mine[0], side="right"))]
        run = slice(mine[0], mine[-1] + 1)
        kept.append(walker.run(edge, stops, run, keep))
        kept_of[run] = len(kept) - 1
    sweeps.pop_to(counted)
    return Seen(motion, at, nows, columns, tuple(kept), kept_of)


def _box(size: Floats, nows: Floats) -> Floats:
    """(n, 6) mm: boxes of tools at stations. size : (n, 3) radius, lowest and highest w of the cutter."""
    axis = nows[:, 3:6]
    side = size[:, :1] * np.sqrt(np.maximum(1.0 - axis**2, 0.0)) + 1e-6
    a, b = nows[:, 0:3] + size[:, 1:2] * axis, nows[:, 0:3] + size[:, 2:] * axis
    return np.concatenate([np.minimum(a, b) - side, np.maximum(a, b) + side], axis=1)


def _turn(parts: int) -> Turn:
    """Room for the angles of a station, with so many parts of the edge each."""
    return Turn(
        np.empty(ROOM), np.empty(ROOM, np.int64), np.empty((ROOM, VALUES)), np.empty((ROOM, parts, 3)),
        np.empty(ROOM, np.int64), np.empty(VALUES), np.zeros(3, np.int64), np.empty(1),
    )  # fmt: skip


class _Walk:
    """Tiles and space of one question."""

    def __init__(self, sweeps: Sweeps, boxes: Floats, first: int, radius: float) -> None:
        self.sweeps = sweeps
        meets = (boxes[:, :3] <= boxes[:, 3:]).all(axis=1)
        region = boxes[meets] if meets.any() else np.concatenate([sweeps.bounds[0], sweeps.bounds[0]])[None]
        low, high = region[:, :3].min(axis=0), region[:, 3:].max(axis=0)
        size = float(max(radius / PER_RADIUS, (high - low)[:2].max() / TILES, 1e-6))
        shape = np.maximum(np.ceil((high - low)[:2] / size).astype(np.int64) + 1, 1)
        self.rows = sweeps.rows()
        begin = int(sweeps.cuts[first, 0])
        earlier = sweeps.near(low, high, begin)
        nodes, (stamp, self.slot, self.seen) = 1024 + 4 * int(np.prod(shape)), sweeps.marks()
        self.tiles = Tiles(
            np.full(shape, -1, dtype=np.int64), np.zeros((nodes, 2), dtype=np.int64), np.zeros((nodes, 8)),
            np.full(shape, sweeps.bounds[1, 2]), low[:2].copy(), size, np.array([0, -1]),
            stamp,
        )  # fmt: skip
        self.clock, self.mark = np.split(sweeps.clock, [4])  # views
        self.mark[1] = begin
        self.tile_row = np.empty(8)
        self.room = Room(
            np.zeros((512, 7)), np.zeros(12), np.zeros((2, 12)), np.zeros(5), np.zeros(128, np.int64),
            np.zeros(128), np.zeros(3, np.int64), np.empty(6), np.empty((6, 128)), np.zeros(128, np.int64),
        )  # fmt: skip
        self.turn, self.past = (_turn(PARTS) for _ in range(2))
        self.list = LIST
        done = 0
        while (done := replay(self.tiles, self.rows, earlier, done, self.tile_row)) < len(earlier):
            self._more_nodes()

    def _more_nodes(self) -> None:
        old = self.tiles
        self.tiles = old._replace(
            node=np.concatenate([old.node, np.zeros_like(old.node)]),
            bound=np.concatenate([old.bound, np.zeros_like(old.bound)]),
        )

    def run(self, edge: Edge, stops: Stops, run: slice, keep: bool) -> Kept:
        """Stations of one tool."""
        n, total = run.stop - run.start, len(stops.station)
        size = 80 * n + 2 * ROOM if keep else 0
        kept = Kept(
            np.zeros((total if keep else 0, 3), np.int64), np.empty(size), np.empty((size, 2), np.int64),
            np.empty((4 * size + (ROOM * PARTS if keep else 0), 3)), np.zeros(2, np.int64),
        )  # fmt: skip
        first, cutter = run.start, self.sweeps.motion(int(stops.station[run.start, 0]))[0]
        tool, world = self.sweeps.tool_of(cutter), self.sweeps.world
        shape = blade(edge)
        tile = np.empty(8 + int(4.0 * shape.joints[-1] / self.tiles.size), np.int64)
        while True:
            work = Work._make((
                *np.empty((8, NODES)), np.empty((self.list + 1, NODES)), np.empty(self.list, np.int64), np.empty(self.list + 1),
                *np.empty((3, self.list), np.int64), np.empty(self.turn.part.shape[1:]), self.slot, self.seen, self.clock,
                tile,
            ))  # fmt: skip
            scene = Scene(self.rows, self.tiles, world, shape, work, self.room)
            mine = stops._replace(station=stops.station[: run.stop])
            first = walk(
                scene, self.turn, self.past, mine, kept, first, tool, cutter.max_radius, self.mark, self.tile_row
            )  # fmt: skip
            if first >= run.stop:
                return kept
            # one of the tables is full, none of them small: all of them grow
            self._more_nodes()
            self.list *= 2
            self.turn, self.past = (_turn(2 * self.turn.part.shape[1]) for _ in range(2))
            kept = kept._replace(
                angle=np.concatenate([kept.angle, np.empty(len(kept.angle))]),
                span=np.concatenate([kept.span, np.empty_like(kept.span)]),
                part=np.concatenate([kept.part, np.empty((len(kept.part) + self.turn.part.size // 3, 3))]),
            )
