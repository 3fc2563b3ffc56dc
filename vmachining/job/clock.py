"""When the blocks of a job begin and end, and how far the tool goes per tooth in them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats
from vmachining.job.jobfile import Job
from vmachining.job.timing import machine_limits, move_times
from vmachining.job.toolpath import Toolpath


class Clock(NamedTuple):
    """begin, seconds : (n,) s of every block. feed_per_tooth : (n,) mm, NaN where feed, speed or teeth are unknown."""

    begin: Floats
    seconds: Floats
    feed_per_tooth: Floats

    @classmethod
    def of(cls, job: Job, toolpath: Toolpath) -> Clock:
        """Of a program that has been read.

        Raises NCError: A feed move without a feed.
        """
        times = move_times(toolpath, machine_limits(job), block_delete=job.keys.program.block_delete).seconds
        start = np.concatenate([[0.0], np.cumsum(times)])
        blocks = toolpath.blocks
        begin = np.array([start[min(block.moves)] for block in blocks])
        end = np.array([start[max(block.moves) + 1] for block in blocks])
        default = job.keys.force.spindle_rev_min if job.keys.force is not None else None
        feed = np.full(len(blocks), np.nan)
        for block in blocks:
            for move, _ in toolpath.cuts(block):
                teeth = job.tools[move.tool].flutes if move.tool in job.tools else None
                speed = abs(move.spindle_rpm) or default
                if teeth and speed and move.feed_mm_min:
                    feed[block.number] = move.feed_mm_min / (teeth * speed)
        return cls(begin, end - begin, feed)

    def at(self, block: int, share: float) -> float:
        """s at a fraction of a block."""
        return float(self.begin[block] + share * self.seconds[block])
