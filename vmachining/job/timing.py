"""Moves -> seconds and feed caps, by the machine of the job."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vmachining.arrays import Floats
from vmachining.errors import NCError
from vmachining.geometry import Line
from vmachining.job.blocks import halts
from vmachining.job.jobfile import Job
from vmachining.job.paths import joint_demands, joint_feeds
from vmachining.job.toolpath import Toolpath
from vmachining.machine import MachineLimits, axis_caps, block_times, path_peaks
from vmachining.nc import Motion
from vmachining.sweep import Turn
from vmachining.tolerance import LENGTH_EPS_MM

__all__ = ["MoveTimes", "machine_limits", "move_times"]


@dataclass(frozen=True, slots=True, eq=False)
class MoveTimes:
    """Columns (n,), one value per move.

    seconds, ideal_s : with and without the acceleration limit. cap_mm_min : of the machine.
    """

    seconds: Floats
    ideal_s: Floats
    cap_mm_min: Floats


def machine_limits(job: Job) -> MachineLimits:
    """Limits of the job's machine."""
    keys = job.keys.machine
    return MachineLimits(
        rapid_mm_min=keys.rapid_mm_min,
        max_feed_mm_min=keys.max_feed_mm_min,
        axis_feed_mm_min=keys.axis_feed_mm_min or (None, None, None),
        max_acceleration_mm_s2=keys.max_acceleration_mm_s2,
    )


def move_times(toolpath: Toolpath, limits: MachineLimits, *, block_delete: bool = False) -> MoveTimes:
    """Time of every move of a program, dwells included. The axes stand still at a stop and at a tool change.

    A block with rotary words lasts as long as its slowest joint, or as long as the program says (inverse time).
    A tool that turns about its tip travels no way, so its time stands apart, like a dwell.

    Raises
    ------
    NCError
        A feed move without a feed; names file and line.
    """
    program, moves, paths = toolpath.program, toolpath.moves, toolpath.paths
    if not moves:
        empty = np.zeros(0)
        return MoveTimes(empty, empty, empty)
    length = np.array([path.length if path.length > LENGTH_EPS_MM else 0.0 for path in paths])
    fast = np.array([move.motion is Motion.RAPID for move in moves])
    feed = np.array([np.nan if move.feed_mm_min is None else move.feed_mm_min for move in moves])
    bad = ~fast & (length > 0) & ~(feed > 0)
    if bad.any():
        raise NCError(
            "a feed move without a feed", file=program.name, line=moves[int(np.flatnonzero(bad)[0])].line
        )
    demands = joint_demands(moves, toolpath.machine, length)
    slowest = demands.seconds
    fixed = np.array([move.duration_s or 0.0 for move in moves])
    pause = np.array([move.dwell_s for move in moves])
    pause = np.where((length == 0) & (pause == 0), np.maximum(slowest, fixed), pause)
    timed = (fixed > 0) & (length > 0)
    feed[timed] = 60.0 * length[timed] / fixed[timed]
    allowed = joint_feeds(length, slowest)
    caps = np.minimum(
        axis_caps(
            path_peaks([p if not isinstance(p, Turn) else Line(p.start, p.end) for p in paths]), limits
        ),
        allowed,
    )
    times = block_times(
        length, feed, fast, limits, cap_mm_min=caps, dwell_s=pause, rapid_cap_mm_min=allowed,
        stop=halts(program, block_delete=block_delete), acceleration_mm_s2=demands.accelerations,
    )  # fmt: skip
    return MoveTimes(times.accelerated_s, times.ideal_s, caps)
