"""Feeds that keep the removal rate at a reference, with and without inserted blocks.

Symbols: V removed volume (v of a sample), L length (l of a sample), F feed, Q removal rate, U cap.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import FeedError
from vmachining.feed.blocks import FeedBlocks, FeedSamples
from vmachining.feed.limits import FeedLimits
from vmachining.feed.plan import plan_feeds
from vmachining.feed.schedule import Schedule
from vmachining.feed.strategy import Parts, Reference, Rule

__all__ = ["AIR_MM3", "VolumeStrategy", "schedule_volume", "schedule_volume_inserting"]

AIR_MM3 = 1e-9
"""A block that removes no more than this cuts air: rounding of a difference of two solids."""


@dataclass(frozen=True, slots=True, eq=False)
class VolumeStrategy:
    """Removal rate Q = v F / l, mm^3/min.

    volume : (m,) mm^3 of every part. air_mm3 : a part that removes no more cuts air.
    """

    parts: Parts
    volume: Floats
    group: Ints
    air_mm3: float = AIR_MM3
    name: str = "volume"
    unit: str = "mm³/min"

    def __post_init__(self) -> None:
        if not (math.isfinite(self.air_mm3) and self.air_mm3 >= 0):
            raise FeedError(f"air_mm3 is {self.air_mm3}, want a finite number that is not negative")

    @property
    def cuts(self) -> Bools:
        return np.asarray(self.volume > self.air_mm3)

    def loads(self, feed_mm_min: Floats) -> Floats:
        length = self.parts.length
        return np.divide(self.volume * feed_mm_min, length, out=np.zeros(len(length)), where=length > 0.0)

    def feeds(self, goal: Floats) -> Floats:
        return self._raw(self.volume, self.parts.length, goal)

    def mean(self, feed_mm_min: Floats, chosen: Bools) -> float:
        return float(self.volume[chosen].sum() / (self.parts.length[chosen] / feed_mm_min[chosen]).sum())

    def mean_feeds(self, goal: Floats, start: Ints) -> Floats:
        volume, length = (np.add.reduceat(column, start) for column in (self.volume, self.parts.length))
        return self._raw(volume, length, goal[start])

    def _raw(self, volume: Floats, length: Floats, goal: Floats) -> Floats:
        """Q_ref L / V, eq. (2); inf for air."""
        raw = np.divide(goal * length, volume, out=np.full(len(volume), np.inf), where=volume > self.air_mm3)
        return np.asarray(raw)


def schedule_volume(
    blocks: FeedBlocks,
    limits: FeedLimits,
    *,
    reference: Reference = "auto",
    conservative: bool = False,
    air_mm3: float = AIR_MM3,
) -> Schedule:
    """One feed per block: F = Q_ref L / V, clamped.

    Parameters
    ----------
    reference : float, "auto", "max" or "mean"
        mm^3/min. "auto" and "max": the largest removal rate at the original feeds, so that no block becomes
        slower and the peak load stays. "mean": total volume over original time of the blocks that cut, which
        keeps their total time where no limit is hit. Found per tool, where the blocks say which tool cuts.
    conservative : bool
        Schedule with the upper ends of the volume brackets instead of the estimates.
    air_mm3 : float
        A block that removes no more cuts air and gets the upper limit.

    Raises
    ------
    FeedError
        Reference not positive; an automatic reference with a block that has no original feed.
    """
    volume = blocks.volumes(conservative)
    strategy = VolumeStrategy(Parts.whole(blocks), volume, blocks.groups, air_mm3)
    return plan_feeds(blocks, strategy, limits, reference=reference)


def schedule_volume_inserting(
    blocks: FeedBlocks,
    samples: FeedSamples,
    limits: FeedLimits,
    *,
    reference: Reference = "auto",
    tau: float = 0.25,
    min_length_mm: float = 0.5,
    rule: Rule = "safe",
    conservative: bool = False,
    air_mm3: float = AIR_MM3,
) -> Schedule:
    """Several feeds in a block whose removed volume changes sharply along its path.

    Parameters
    ----------
    samples : FeedSamples
        Removed volume along each block.
    reference : float, "auto", "max" or "mean"
        As in `schedule_volume`; "auto" and "max" take the largest rate of any *sample*, so that again no part
        of the path becomes slower.
    tau : float
        Requests in one sub-block differ by at most the factor 1 + tau, unless it is as short as allowed.
    min_length_mm : float
        Shortest sub-block; at least the largest feed times the time a control needs for a block.
    rule : "safe" or "mean"
        "safe": the smallest request of the sub-block, so that no sample exceeds the reference (unless F_min
        binds). "mean": the reference on average over the sub-block.

    Raises
    ------
    FeedError
        As in `schedule_volume`; samples that belong to other blocks; tau or min_length_mm out of range.
    """
    if len(samples.offset) != len(blocks) + 1:
        raise FeedError(f"samples are for {len(samples.offset) - 1} blocks, there are {len(blocks)}")
    strategy = sampled(blocks, samples, conservative, air_mm3)
    return plan_feeds(
        blocks,
        strategy,
        limits,
        reference=reference,
        insert=True,
        tau=tau,
        min_length_mm=min_length_mm,
        rule=rule,
    )


def sampled(
    blocks: FeedBlocks, samples: FeedSamples, conservative: bool = False, air_mm3: float = AIR_MM3
) -> VolumeStrategy:
    """The strategy of equal samples; a block without samples is one sample of its own volume."""
    counts = np.diff(samples.offset)
    filled = np.maximum(counts, 1)
    parts = Parts.equal(blocks, filled)
    volume = np.empty(len(parts.end))
    given = np.repeat(counts > 0, filled)
    volume[given] = samples.volumes(conservative)
    volume[~given] = blocks.volumes(conservative)[counts == 0]
    return VolumeStrategy(parts, volume, blocks.groups[parts.block], air_mm3)
