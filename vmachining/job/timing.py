"""Moves -> seconds, reachable speeds and feed caps, by the machine of the job; and what a summary says of them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import NCError
from vmachining.geometry import Arc, Line
from vmachining.job.jobfile import MM_PER_INCH, Job
from vmachining.job.mill import limits_of
from vmachining.job.pace import Pace
from vmachining.job.paths import PIECES, joint_demands, joint_directions, joint_feeds
from vmachining.job.toolpath import Toolpath
from vmachining.machine import Machine, MachineLimits, Way, drive, line_peaks, path_peaks
from vmachining.nc import Motion, Program, decode_program
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
        wanted = self.programmed_mm_min
        return np.asarray((wanted > 0) & (self.reached_mm_min < SLOWER * wanted))

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

    @property
    def lines(self) -> Ints:
        """(n,) of the moves."""
        return np.array([move.line for move in self.toolpath.moves], dtype=np.int64)

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
            line = moves[int(np.flatnonzero(bad)[0])].line
            raise NCError("a feed move without a feed", file=program.name, line=line)
        demands = joint_demands(moves, toolpath.machine, length)
        fixed = np.array([move.duration_s or 0.0 for move in moves])
        dwell = np.array([move.dwell_s for move in moves])
        timed = (fixed > 0) & (length > 0)
        feed[timed] = 60.0 * length[timed] / fixed[timed]
        tangent, acceleration, still, leaving, bend = joint_directions(moves, paths, toolpath.machine, length)
        arcs = [(k, p) for k, p in paths.others.items() if isinstance(p, Arc) and length[k] > 0]
        turned, normal = np.zeros(len(length)), np.full(len(length), 2)
        for k, arc in arcs:
            turned[k], normal[k] = arc.angle, arc.axis
        slow = demands.piece_seconds
        uneven = (length > 0) & (slow.max(axis=1) > EVEN * slow.min(axis=1))
        parts, allowed = np.where(uneven, PIECES, 1), np.broadcast_to(np.inf, slow.shape)
        if uneven.any():
            allowed = 60.0 * np.divide(length[:, None], slow, out=allowed.copy(), where=slow > 0)
        # of the tip where nothing turns, else of the slides themselves
        own = line_peaks(paths.start, paths.end)
        others = paths.others.values()
        own[[*paths.others]] = path_peaks(
            [p if not isinstance(p, Turn) else Line(p.start, p.end) for p in others]
        )
        slides = demands.slides / np.maximum(length, 1e-9)[:, None]
        peaks = np.where(np.isnan(demands.slides) | (length == 0)[:, None], own, slides)
        return cls(
            toolpath, Pace.of(program, block_delete=block_delete), length, still,
            # a tool that turns about its tip travels no way: it has the length that its joints turn
            np.where((length == 0) & (dwell == 0), np.maximum(demands.seconds, fixed), 0.0),
            fast, feed, dwell, joint_feeds(length, demands.seconds), peaks, tangent, acceleration, turned, normal,
            demands.accelerations, parts, allowed, demands.piece_accelerations, leaving, bend,
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
        fed, rapids = (
            np.minimum(_slides(self.peaks, slide_speeds(given, machine)), self.allowed)
            for given in (limits.axes, limits.axis_rapid_mm_min)
        )
        caps = np.minimum(fed, whole)
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
        bound = np.isfinite(min(path, swift)) or np.isfinite(axes).any() or limits.max_jerk_mm_s3 is not None
        if len(at) and bound:
            tolerance = np.where(np.isnan(pace.tolerance), limits.corner_tolerance_mm, pace.tolerance)
            # at rest by themselves, or by what happens before the next one moves
            stops = np.concatenate([[0], np.cumsum(pace.halt | (self.dwell > 0))])
            halt = stops[np.append(at[1:], len(long))] > stops[at]
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
            most = np.where(self.fast[k], swift, path)
            driven = drive(way, whole=most, axes=axes, jerk=limits.max_jerk_mm_s3 or np.inf)
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


def slide_speeds(given: Sequence[float | None] | None, machine: Machine | None) -> Floats:
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


def block_feeds(toolpath: Toolpath, times: MoveTimes) -> tuple[Floats, Floats]:
    """(n,) mm/min and seconds of the blocks; NaN without a feed; of several motions the feed that takes their time."""
    blocks, length, seconds = toolpath.blocks, toolpath.length, times.seconds
    given = np.array([move.feed_mm_min or np.nan for move in toolpath.moves])
    feed, time = given[blocks.motion[blocks.begin[:-1]]], seconds[blocks.first]
    for k in np.flatnonzero(blocks.stop - blocks.first > 1).tolist():
        block = blocks[k]
        time[k] = sum(seconds[block.members.start : block.members.stop].tolist())
        fed = [j for j in block.moves if given[j] > 0.0]
        if len({given[j] for j in fed}) != 1:
            minutes = sum(length[j] / given[j] for j in fed)
            feed[k] = sum(length[j] for j in fed) / minutes if minutes > 0.0 else np.nan
        else:
            feed[k] = given[fed[0]]
    return feed, time


WORST = 10
"""Blocks that are named, by the time that they lose."""


def times_summary(
    toolpath: Toolpath, times: MoveTimes, limits: MachineLimits, after: MoveTimes | None = None
) -> dict[str, Any]:
    """Key `times` of summary.json.

    tools : seconds by tool, in program order. below_feed_share : of the time at feed, in which the programmed feed is never
    reached; reasons : moves by why; worst : the blocks that lose most, against their length over their feed.
    """
    tools: dict[int, float] = {}
    for move, seconds in zip(toolpath.moves, times.seconds.tolist(), strict=True):
        tools[move.tool] = tools.get(move.tool, 0.0) + seconds
    lost = np.where(times.late, times.seconds - times.ideal_s, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        plain = 60.0 * toolpath.length / times.programmed_mm_min
    lost = np.where(np.isfinite(plain) & (lost != 0.0), times.seconds - plain, lost)
    blocks, why = toolpath.blocks, times.why
    # of every block the motion that loses most, the first one of several
    most = blocks.motion[np.lexsort((-lost[blocks.motion], blocks.owner))[blocks.begin[:-1]]]
    late = np.flatnonzero(times.late[most])
    worst = [
        (blocks[b], int(most[b])) for b in late[np.argsort(-lost[most[late]], kind="stable")][:WORST].tolist()
    ]
    return {
        "tools": [{"tool": tool, "seconds": seconds} for tool, seconds in tools.items()],
        "below_feed_share": times.below_share,
        "scheduled_below_feed_share": None if after is None else after.below_share,
        "reasons": times.reasons(),
        "worst": [
            {
                "block": block.number, "line": block.line, "feed_mm_min": float(times.programmed_mm_min[k]),
                "reached_mm_min": float(times.reached_mm_min[k]), "why": str(why[k]), "lost_s": float(lost[k]),
            }
            for block, k in worst
        ],
        "assumed": assumed(limits, toolpath.machine, toolpath.program),
    }  # fmt: skip


def assumed(
    limits: MachineLimits, machine: Machine | None = None, program: Program | None = None
) -> list[str]:
    """What nobody said of the machine, and what was taken instead."""
    own = machine is not None and any(np.isfinite(axis.max_acceleration) for axis in machine.axes)
    out = []
    if limits.max_acceleration_mm_s2 is None and not limits.axis_acceleration_mm_s2 and not own:
        out.append("no acceleration is given: speeds change at once, and corners take no extra time")
    else:
        missed = f"corners may be missed by {limits.corner_tolerance_mm:g} mm"
        out.append(f"{missed} where the program does not say (G64 P, G61, CYCLE832)")
    if limits.rapid_mm_min is None and not limits.axis_rapid_mm_min and machine is None:
        out.append("no rapid speed is given: rapids take no time")
    if limits.tool_change_s == 0.0:
        out.append("no time of a tool change is given: it takes none")
    decimals = [] if program is None else re.findall(rb"[XYZ]\s*[-+]?\d*\.(\d+)", program.data, re.IGNORECASE)
    if program is not None and decimals:
        step = _unit(program) * 10.0 ** -max(map(len, decimals))  # mm, the last decimal of its coordinates
        told = [float(a or b) for a, b in SMOOTHING.findall(decode_program(program.data, program.name))]
        unit = _unit(program)
        given = (limits.corner_tolerance_mm, *(unit * t for t in told))
        least = min((v for v in given if v > 0.0), default=step)
        if least < 0.999 * step:
            what = (
                f"a corner tolerance of {least:.3g} mm is below the resolution of the program ({step:.3g} mm)"
            )
            out.append(f"{what}: corners that come from rounding slow the path down as well")
    return out


INCH_WORD = re.compile(rb"^[^(;\n]*G0*(?:20|70)(?![\d.])", re.IGNORECASE | re.MULTILINE)
SMOOTHING = re.compile(r"G64\s*P\s*(\d*\.?\d+)|CYCLE832\s*\(\s*(\d*\.?\d+)", re.IGNORECASE)


def _unit(program: Program) -> float:
    """mm in its unit of length, by G20 or G70 where only a word says it."""
    said = program.declared.unit or ("inch" if INCH_WORD.search(program.data) else "mm")
    return MM_PER_INCH if said == "inch" else 1.0
