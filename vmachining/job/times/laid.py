"""A log laid over its program: intervals between two block numbers, the lines that ran in them, and what is not compared.

A control writes the number of the block that it runs a few times a second, so an interval may hold many lines. Left out, with
their seconds by reason: pauses (any state but active), overrides at 0, stops at which a person was waited for, steps back,
clocks that jump, what says nothing of a machine (lines without motion or event), and lines that run more than once, whose
pass an entry of the log does not tell (loops, subprograms that are called twice). A log may hold several runs, also of
other programs; the run that goes through most of this one is taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import InputError
from vmachining.job.pace import event_seconds
from vmachining.job.times.logs import Log
from vmachining.job.timing import Driven, MoveTimes
from vmachining.machine import MachineLimits

PERSON_S = 15.0
"""A stop by the program that lasts longer waits for a person: on five logs without anybody they last 2 to 8 s."""

CHANGE_S = 60.0
"""So does a tool change that lasts longer than this."""

OTHER_FEEDS = 0.1
"""Median speeds of long blocks that differ more from the programmed ones are those of another program."""

JUMP_S = 600.0
"""A single interval that lasts longer is a gap in the log."""

FASTER, SLOWER = 0.5, 50.0
"""Logged over the time of feeds alone: outside of these, the unit of the clock is another one."""

LEAST_COVER = 0.5
"""Share of the lines with motion that a run of this program goes through at least."""


@dataclass(frozen=True, slots=True, eq=False)
class Laid:
    """Intervals (k,) of the run. first, last : lines [first, last) that ran. logged : s. kept : whether it is compared.

    feed, rapid : overrides of the moves (n,). left_out : seconds by reason. events : (k, 5), see `Pace`. driven : the program.
    load, speed : means of the log in the intervals, NaN without.
    """

    name: str
    driven: Driven
    first: Ints
    last: Ints
    logged: Floats
    kept: Bools
    events: Floats
    feed: Floats
    rapid: Floats
    left_out: dict[str, float]
    load: Floats
    speed: Floats

    def feed_ratio(self) -> float:
        """Speed of the log over the programmed feed at its override, median over long intervals of one feed; NaN without.

        The unit of the log is the one of mm/s, mm/min, inch/s and inch/min that brings it nearest to 1.
        """
        fed = self.driven.feed * np.where(self.driven.fast, np.nan, self.feed)
        long = self.kept & (self.logged > 1.0) & (self.last == self.first + 1) & (self.speed > 0)
        own = [(float(self.speed[k]), fed[self.driven.lines == self.first[k]]) for k in np.flatnonzero(long)]
        ratio = [speed / float(mine[0]) for speed, mine in own if len(mine) == 1 and mine[0] > 0]
        if len(ratio) < 5:
            return float("nan")
        middle = float(np.median(ratio)) * np.array([60.0, 1.0, 25.4 * 60.0, 25.4])
        return float(middle[np.argmin(np.abs(np.log(middle)))])

    @property
    def another(self) -> str | None:
        """Words for a log whose feeds are not those of the program; None if they are."""
        ratio = self.feed_ratio()
        if np.isnan(ratio) or abs(ratio - 1.0) <= OTHER_FEEDS:
            return None
        return (
            f"{self.name}: the machine fed at {100 * ratio:.0f} % of the feeds of this program (median of long blocks, overrides "
            "counted): it ran another version of it, or an override that the log does not have"
        )

    def clock(self) -> str | None:
        """Words for a log whose seconds cannot be seconds: faster than its feeds, or slower beyond belief."""
        alone = self.driven.times(MachineLimits(), feed_share=self.feed).ideal_s
        ideal = float(self.by_line(alone)[self.kept].sum())
        logged = float(self.logged[self.kept].sum())
        if ideal <= 0.0 or FASTER < logged / ideal < SLOWER:
            return None
        return (
            f"{self.name}: the log lasts {logged:.4g} s where the feeds alone take {ideal:.4g} s. Its times are taken as "
            "seconds: are they milliseconds, minutes or hours?"
        )

    def by_line(self, values: Floats) -> Floats:
        """(k,) sums of values (n,) of the moves over the intervals."""
        lines = self.driven.lines
        n = int(max(lines.max(initial=0), self.last.max(initial=0))) + 2
        total = np.concatenate([[0.0], np.cumsum(np.bincount(lines, values, minlength=n))])
        return np.asarray(total[np.maximum(self.last, self.first)] - total[self.first])

    def paths(self, limits: MachineLimits) -> tuple[Floats, MoveTimes]:
        """(k,) s of motion and dwells in the intervals, without events; and the times of all moves."""
        times = self.driven.times(limits, feed_share=self.feed, rapid_share=self.rapid)
        return self.by_line(times.seconds - self.driven.pace.changes(limits)), times

    def predicted(self, limits: MachineLimits) -> Floats:
        """(k,) s."""
        return np.asarray(self.paths(limits)[0] + self.events @ event_seconds(limits))


def lay(log: Log, driven: Driven) -> Laid:
    """Lay a log over a program.

    Raises InputError: No run in the log goes through half of the program: the log of another one.
    """
    lines = driven.lines
    if not len(lines):
        raise InputError("the program moves nothing")
    begin, end = _run(log, lines)
    time, number = log.time[begin:end], log.line[begin:end]
    new = np.flatnonzero(np.diff(number, prepend=-1))
    time, number = time[new], number[new]
    first, last, logged = number[:-1], number[1:], np.diff(time)
    top = int(lines.max()) + 2
    held = np.zeros((len(first), 5))
    if (events := driven.pace.lines) is not None:
        total = np.concatenate([np.zeros((1, 5)), np.cumsum(events, axis=0)])
        held = (
            total[np.clip(last, first, len(events)).clip(max=len(events))]
            - total[first.clip(max=len(events))]
        )
    # a log that names tools, and names none during a change: the tool was in the spindle
    if len(log.tool.time):
        ended = np.searchsorted(log.tool.time, np.append(time[2:], time[-1:]), side="right")
        held[ended <= np.searchsorted(log.tool.time, time[:-1]), 0] = 0.0
    moving, stop = driven.length > 0, np.minimum(last, top)
    counts = (np.bincount(lines[kind & moving], minlength=top + 1) for kind in (driven.fast, ~driven.fast))
    cumulated = [np.concatenate([[0], np.cumsum(v)]) for v in counts]
    rapids, feeds = (c[np.maximum(stop, first.clip(max=top))] - c[first.clip(max=top)] for c in cumulated)
    ends = list(zip(time[:-1].tolist(), time[1:].tolist(), strict=True))
    feed, rapid = (np.array([of.mean(a, b, 1.0) for a, b in ends]) for of in (log.feed, log.rapid))
    running, least_feed, least_rapid = (
        np.array([of.least(a, b, 1.0) for a, b in ends]) for of in (log.running, log.feed, log.rapid)
    )
    reasons = [
        ("steps back in the program", last < first),
        ("gaps and jumps of the clock", (logged <= 0.0) | (logged > JUMP_S)),
        ("pauses", running < 1.0),
        ("overrides at 0", ((least_feed < 0.01) & (feeds > 0)) | ((least_rapid < 0.01) & (rapids > 0))),
        ("lines that run more than once", _repeated(lines, first, stop, top)),
        ("stops that wait for a person", (held[:, 2] > 0) & (logged > PERSON_S) | (held[:, 0] > 0) & (logged > CHANGE_S)),
        ("lines without motion or event", (rapids + feeds == 0) & (held.sum(axis=1) == 0)),
    ]  # fmt: skip
    kept, left = np.ones(len(first), dtype=np.bool_), {}
    for name, hit in reasons:
        if (out := hit & kept).any():
            left[name] = float(np.abs(logged[out]).sum())
            kept &= ~hit
    of_feed, of_rapid = np.ones(top + 1), np.ones(top + 1)
    for a, b, f, r in zip(first.tolist(), stop.tolist(), feed.tolist(), rapid.tolist(), strict=True):
        of_feed[a:b], of_rapid[a:b] = max(f, 0.01), max(r, 0.01)
    speed = np.array([log.speed.median(a, b) for a, b in ends])
    load = np.array([log.load.mean(a, b, np.nan) for a, b in ends])
    return Laid(
        log.name, driven, first, last, logged, kept, held, of_feed[lines], of_rapid[lines], left, load, speed
    )


def _repeated(lines: Ints, first: Ints, stop: Ints, top: int) -> Bools:
    """(k,) intervals [first, stop) whose moves do not follow each other in the program, or whose lines another interval holds."""
    order = np.argsort(lines, kind="stable")
    # counts how often the program has stepped back
    turn = np.cumsum(np.diff(lines, prepend=lines[0]) < 0)[order]
    other = np.concatenate([[0], np.cumsum(np.diff(turn) != 0), [0]])
    begin, end = (np.searchsorted(lines[order], v) for v in (first, stop))
    apart = (end > begin) & (other[np.maximum(end - 1, 0)] != other[np.minimum(begin, len(lines) - 1)])
    ahead = (stop > first) & ~apart
    begun, ended = (np.bincount(v[ahead], minlength=top + 1) for v in (first.clip(max=top), stop))
    covers = begun - ended
    twice = (np.cumsum(covers) > 1) & (np.bincount(lines, minlength=top + 1) > 0)
    held = np.concatenate([[0], np.cumsum(twice)])
    return np.asarray(apart | (held[np.maximum(stop, first.clip(max=top))] > held[first.clip(max=top)]))


def _run(log: Log, lines: Ints) -> tuple[int, int]:
    """Entries [begin, end) of the run that goes through most of the program."""
    head, tail = int(lines.min()), int(lines.max())
    # a run begins where the number falls to or below the first line that moves
    back = np.flatnonzero((np.diff(log.line) < 0) & (log.line[1:] <= head)) + 1
    borders = [0, *back.tolist(), len(log.line)]
    best, cover = (0, 0), -1.0
    for a, b in pairwise(borders):
        number = log.line[a:b]
        if not len(number) or number.max() > tail + 20:
            continue  # of a longer program
        reached = np.clip([number.min(), number.max()], head, tail)
        share = float(reached[1] - reached[0]) / max(tail - head, 1)
        if share >= cover:
            best, cover = (a, b), share
    if cover < LEAST_COVER:
        told = f"its lines reach {int(log.line.max())}, the program moves in lines {head} to {tail}"
        raise InputError(
            f"no run in this log covers half of the program: {told}", file=log.name,
            remedy="is it the log of another program, or of another version?",
        )  # fmt: skip
    return best
