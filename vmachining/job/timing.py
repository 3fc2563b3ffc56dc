"""Moves -> seconds, reachable speeds and feed caps, by the machine of the job."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import NCError
from vmachining.geometry import Arc, Line
from vmachining.job.jobfile import Job
from vmachining.job.mill import limits_of
from vmachining.job.pace import Pace
from vmachining.job.paths import PIECES, CutterPath, joint_demands, joint_directions, joint_feeds
from vmachining.job.toolpath import Toolpath
from vmachining.machine import Machine as Chain
from vmachining.machine import MachineLimits, Way, drive, path_peaks
from vmachining.nc import Motion
from vmachining.sweep import Turn
from vmachining.tolerance import LENGTH_EPS_MM

SLOWER = 0.99
"""Share of the programmed feed below which a move is said not to reach it."""


EVEN = 1.001
"""Slowest over fastest part of a move, in what its joints allow, up to which it is driven as a whole."""

FASTEST = 1e9
"""mm/s: of a rapid of which the machine says no speed."""


class Why(StrEnum):
    """Why a move does not reach its programmed feed."""

    REACHED = ""
    AXIS = "axis limit"
    ARC = "arc"
    CORNER = "corner"


@dataclass(frozen=True, slots=True, eq=False)
class MoveTimes:
    """Columns (n,), one value per move.

    seconds, ideal_s : with and without accelerations, corners and the time of changes. cap_mm_min : of the machine.
    reached_mm_min : largest speed on the way. programmed_mm_min : NaN of rapids. arcs : which are.
    """

    seconds: Floats
    ideal_s: Floats
    cap_mm_min: Floats
    reached_mm_min: Floats
    programmed_mm_min: Floats
    arcs: Bools

    @property
    def late(self) -> Bools:
        """(n,) feed moves that never reach their programmed feed."""
        return np.asarray(
            (self.programmed_mm_min > 0) & (self.reached_mm_min < SLOWER * self.programmed_mm_min)
        )

    @property
    def why(self) -> tuple[Why, ...]:
        """(n,) why a move does not reach its programmed feed."""
        by_axis = self.cap_mm_min < SLOWER * self.programmed_mm_min
        return tuple(
            Why.REACHED if not late else Why.AXIS if axis else Why.ARC if arc else Why.CORNER
            for late, axis, arc in zip(self.late.tolist(), by_axis.tolist(), self.arcs.tolist(), strict=True)
        )

    @property
    def below_share(self) -> float:
        """Share of the time of feed moves in which the programmed feed is never reached."""
        fed = ~np.isnan(self.programmed_mm_min)
        late = self.late
        whole = float(self.seconds[fed].sum())
        return float(self.seconds[fed & late].sum()) / whole if whole > 0.0 else 0.0

    def reasons(self) -> dict[str, int]:
        """How many moves miss their feed, by reason."""
        return dict(Counter(str(why) for why in self.why if why is not Why.REACHED))


def machine_limits(job: Job) -> MachineLimits:
    """Limits of the job's machine."""
    return limits_of(job.keys.machine)


def move_times(
    toolpath: Toolpath, limits: MachineLimits, *, block_delete: bool = False, at_least_mm_min: float = 0.0
) -> MoveTimes:
    """Time of every move of a program; see `Driven`.

    at_least_mm_min : feeds below it are raised to it, which shows what corners and arcs leave of any feed up to there.

    Raises NCError: A feed move without a feed; names file and line.
    """
    return Driven.of(toolpath, block_delete=block_delete).times(limits, at_least_mm_min=at_least_mm_min)


@dataclass(frozen=True, slots=True, eq=False)
class Driven:
    """What the times of a program follow from, as columns (n,) of its moves: made once, timed with any limits.

    length : mm. still : rad that a tip at rest turns. turn : s that such a turn lasts at least. fast : rapids. feed : mm/min,
    NaN for none. allowed : mm/min by the joints of moves with rotary words. peaks : (n, 3) largest |dq/ds| of the slides.
    parts : (n,) pieces that a move is driven in, 1 where its joints go evenly; part_allowed, part_push : (n, PIECES) as allowed
    and push in each. tangent, acceleration : see `joint_directions`. turned, normal : rad and axis of arcs. push : mm/s^2 by
    the joints. leaving, bend : of arcs that lean, see `joint_directions`.
    """

    toolpath: Toolpath
    pace: Pace
    length: Floats
    still: Floats
    turn: Floats
    fast: Bools
    feed: Floats
    dwell: Floats
    allowed: Floats
    peaks: Floats
    tangent: Floats
    acceleration: Floats
    turned: Floats
    normal: Ints
    push: Floats
    parts: Ints
    part_allowed: Floats
    part_push: Floats
    leaving: Floats
    bend: Floats

    @classmethod
    def of(cls, toolpath: Toolpath, *, block_delete: bool = False) -> Driven:
        """Of a program.

        Raises NCError: A feed move without a feed; names file and line.
        """
        program, moves, paths = toolpath.program, toolpath.moves, toolpath.paths
        length = np.where(toolpath.length > LENGTH_EPS_MM, toolpath.length, 0.0)
        fast = np.array([move.motion is Motion.RAPID for move in moves], dtype=np.bool_)
        feed = np.array([np.nan if move.feed_mm_min is None else move.feed_mm_min for move in moves])
        bad = ~fast & (length > 0) & ~(feed > 0)
        if bad.any():
            raise NCError(
                "a feed move without a feed", file=program.name, line=moves[int(np.flatnonzero(bad)[0])].line
            )
        demands = joint_demands(moves, toolpath.machine, length)
        fixed = np.array([move.duration_s or 0.0 for move in moves])
        dwell = np.array([move.dwell_s for move in moves])
        timed = (fixed > 0) & (length > 0)
        feed[timed] = 60.0 * length[timed] / fixed[timed]
        tangent, acceleration, still, leaving, bend = joint_directions(moves, paths, toolpath.machine, length)
        arcs = [(k, p) for k, p in enumerate(paths) if isinstance(p, Arc) and length[k] > 0]
        turned, normal = np.zeros(len(length)), np.full(len(length), 2)
        for k, arc in arcs:
            turned[k], normal[k] = arc.angle, arc.axis
        slow = demands.piece_seconds
        uneven = (length > 0) & (slow.max(axis=1) > EVEN * slow.min(axis=1))
        parts, allowed = np.where(uneven, PIECES, 1), np.broadcast_to(np.inf, slow.shape)
        if uneven.any():
            allowed = 60.0 * np.divide(length[:, None], slow, out=allowed.copy(), where=slow > 0)
        return cls(
            toolpath, Pace.of(program, block_delete=block_delete), length, still,
            # a tool that turns about its tip travels no way: it has the length that its joints turn
            np.where((length == 0) & (dwell == 0), np.maximum(demands.seconds, fixed), 0.0),
            fast, feed, dwell, joint_feeds(length, demands.seconds),
            _peaks(paths, demands.slides, length),
            tangent, acceleration, turned, normal, demands.accelerations, parts,
            allowed, demands.piece_accelerations, leaving, bend,
        )  # fmt: skip

    def times(
        self,
        limits: MachineLimits,
        *,
        at_least_mm_min: float = 0.0,
        feed_share: Floats | float = 1.0,
        rapid_share: Floats | float = 1.0,
    ) -> MoveTimes:
        """Time of every move, dwells and changes included (a change counts to the move after it).

        A block with rotary words lasts as long as its slowest joint, or as long as the program says (inverse time). A machine
        that says nothing of accelerations changes its speed at once. feed_share, rapid_share : (n,) overrides of moves.
        """
        machine, length, pace = self.toolpath.machine, self.length, self.pace
        feed = np.maximum(self.feed, at_least_mm_min)
        whole = np.inf if limits.max_feed_mm_min is None else limits.max_feed_mm_min
        caps = np.minimum(
            np.minimum(_slides(self.peaks, slide_speeds(limits.axes, machine)), whole), self.allowed
        )
        rapids = np.minimum(
            _slides(self.peaks, slide_speeds(limits.axis_rapid_mm_min, machine)), self.allowed
        )
        rapid = np.inf if limits.rapid_mm_min is None else limits.rapid_mm_min
        asked = limits.feed_override * feed_share * feed
        share = np.broadcast_to(limits.rapid_override * rapid_share, feed.shape)
        speed = np.where(self.fast, share * np.minimum(rapids, rapid), np.minimum(asked, caps))
        long = np.where(length > 0, length, self.still)
        with np.errstate(divide="ignore", invalid="ignore"):
            rate = np.where(length > 0, speed / 60.0, np.where(self.turn > 0, self.still / self.turn, np.inf))
            if limits.block_s > 0.0:
                rate = np.minimum(rate, long / limits.block_s)
            ideal = np.where(long > 0, long / rate, np.where(self.turn > 0, self.turn, 0.0))
        seconds, reached = ideal.copy(), np.where(np.isfinite(rate), rate * 60.0, np.inf)
        axes = self.acceleration.copy()
        axes[:3] = np.minimum(axes[:3], _numbers(limits.axis_acceleration_mm_s2))
        path = np.inf if limits.max_acceleration_mm_s2 is None else limits.max_acceleration_mm_s2
        swift = path if limits.rapid_acceleration_mm_s2 is None else limits.rapid_acceleration_mm_s2
        at = np.flatnonzero(long > 0)
        # rounding of ramps by jerk is known for whole moves only
        count = np.ones(len(at), dtype=np.int64) if limits.max_jerk_mm_s3 is not None else self.parts[at]
        own = np.repeat(np.arange(len(at)), count)
        k, piece = at[own], np.arange(len(own)) - np.repeat(np.cumsum(count) - count, count)
        uneven, last = count[own] > 1, piece == count[own] - 1
        pieces = long[k] / count[own]
        rates = np.where(uneven, self._part_speeds(k, piece, limits, asked, share) / 60.0, rate[k])
        if limits.block_s > 0.0:
            rates = np.minimum(rates, long[k] / limits.block_s)
        if uneven.any():
            seconds[at] = ideal[at] = np.bincount(own, pieces / rates)
        if len(at) and (
            np.isfinite(min(path, swift)) or np.isfinite(axes).any() or limits.max_jerk_mm_s3 is not None
        ):
            tolerance = np.where(np.isnan(pace.tolerance), limits.corner_tolerance_mm, pace.tolerance)
            halt = _stops(at, pace.halt | (self.dwell > 0), len(long))
            # a block in which a tip at rest turns has a length of another kind
            halt[:-1] |= np.diff(length[at] > 0)
            push = np.where(uneven, self.part_push[k, piece], self.push[k])
            if limits.axis_acceleration_mm_s2 is not None:  # the chain does not know them
                given = _slides(np.abs(self.tangent[k, :3]), _numbers(limits.axis_acceleration_mm_s2))
                push = np.where(np.isfinite(push), np.minimum(push, given), push)
            most = np.append(axes[:3], path)  # across the way of an arc that leans
            rates = np.minimum(rates, np.sqrt(_slides(self.bend[k], most)))
            way = Way(
                length=pieces, speed=np.minimum(rates, FASTEST), tangent=self.tangent[k], turned=self.turned[k],
                normal=self.normal[k], halt=halt[own] & last, tolerance=np.where(last, tolerance[k], np.inf),
                push=push, span=long[k], leaving=self.leaving[k],
            )  # fmt: skip
            driven = drive(
                way,
                whole=np.where(self.fast[k], swift, path),
                axes=axes,
                jerk=limits.max_jerk_mm_s3 or np.inf,
            )
            seconds[at] = np.bincount(own, driven.seconds)
            reached[at] = 60.0 * np.maximum.reduceat(driven.peak, np.cumsum(count) - count)
        asked = np.where(self.fast | (length == 0), np.nan, asked)
        return MoveTimes(
            seconds + self.dwell + pace.changes(limits), ideal + self.dwell, caps, reached, asked,
            self.turned != 0.0,
        )  # fmt: skip

    def _part_speeds(
        self, k: Ints, piece: Ints, limits: MachineLimits, asked: Floats, share: Floats
    ) -> Floats:
        """(p,) mm/min in pieces of moves k (p,): their own joints, and what the job says of slides and path."""
        fed, rapid = (
            _slides(self.peaks[k], _numbers(v)) for v in (limits.axis_feed_mm_min, limits.axis_rapid_mm_min)
        )
        own = self.part_allowed[k, piece]
        fed = np.minimum(np.minimum(asked[k], fed), np.minimum(own, limits.max_feed_mm_min or np.inf))
        rapid = share[k] * np.minimum(np.minimum(rapid, own), limits.rapid_mm_min or np.inf)
        return np.asarray(np.where(self.fast[k], rapid, fed))


def _numbers(given: Sequence[float | None] | None) -> Floats:
    """(3,) of the slides, inf where nothing is said."""
    return np.array([np.inf if v is None else v for v in given or (None, None, None)], dtype=np.float64)


def _peaks(paths: Sequence[CutterPath], slides: Floats, length: Floats) -> Floats:
    """(n, 3) largest |dq/ds| of the slides: of the tip where nothing turns, else of the slides themselves."""
    own = path_peaks([p if not isinstance(p, Turn) else Line(p.start, p.end) for p in paths])
    return np.asarray(
        np.where(np.isnan(slides) | (length == 0)[:, None], own, slides / np.maximum(length, 1e-9)[:, None])
    )


def slide_speeds(given: Sequence[float | None] | None, machine: Chain | None) -> Floats:
    """(3,) mm/min of x, y, z at most, by the table [machine] and by the chain."""
    own = _numbers(given)
    if machine is not None and len(machine.slides) == 3:
        speeds = {machine.axes[k].name.upper(): 60.0 * machine.axes[k].max_speed for k in machine.slides}
        own = np.minimum(own, [speeds.get(name, np.inf) for name in "XYZ"])
    return own


def _slides(peaks: Floats, own: Floats) -> Floats:
    """(n,) mm/min at which the first slide is at its limit."""
    return np.asarray(
        np.divide(own, peaks, out=np.full(peaks.shape, np.inf), where=peaks > 1e-12).min(axis=1)
    )


def _stops(at: Ints, halt: Bools, n: int) -> Bools:
    """(m,) whether moving blocks `at` end at rest: by themselves, or by what happens before the next one moves."""
    total = np.concatenate([[0], np.cumsum(halt)])
    until = np.append(at[1:], n)
    return np.asarray(total[until] > total[at])


def block_feeds(toolpath: Toolpath, times: MoveTimes) -> tuple[Floats, Floats]:
    """(n,) mm/min and seconds of the blocks; NaN without a feed; of several motions the feed that takes their time."""
    seconds, length = times.seconds.tolist(), toolpath.length.tolist()
    given = [move.feed_mm_min or np.nan for move in toolpath.moves]
    feed = [given[block.moves[0]] for block in toolpath.blocks]
    time = [seconds[block.members.start] for block in toolpath.blocks]
    for k, block in enumerate(toolpath.blocks):
        if len(block.members) == 1:
            continue
        time[k] = sum(seconds[j] for j in block.members)
        fed = [j for j in block.moves if given[j] > 0.0]
        if len({given[j] for j in fed}) != 1:
            minutes = sum(length[j] / given[j] for j in fed)
            feed[k] = sum(length[j] for j in fed) / minutes if minutes > 0.0 else np.nan
        else:
            feed[k] = given[fed[0]]
    return np.array(feed), np.array(time)
