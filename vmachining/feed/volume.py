"""Feeds that keep the removal rate at a reference. Symbols: v removed volume and l length of a part, F feed, Q removal rate."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import FeedError
from vmachining.feed.blocks import FeedBlocks, FeedSamples
from vmachining.feed.strategy import Parts

AIR_MM3 = 1e-9
"""A block that removes no more than this cuts air: rounding of a difference of two solids."""


@dataclass(frozen=True, slots=True, eq=False)
class VolumeStrategy:
    """Removal rate Q = v F / l, mm^3/min.

    volume : (m,) mm^3 of every part. air_mm3 : a part that removes no more cuts air. upper : (m,) upper ends of the
    brackets, by which feeds are found, so that the true rate keeps the goal; None: the volumes are taken as exact.
    """

    parts: Parts
    volume: Floats
    group: Ints
    air_mm3: float = AIR_MM3
    upper: Floats | None = None
    name: str = "volume"
    unit: str = "mm³/min"

    def __post_init__(self) -> None:
        if not (math.isfinite(self.air_mm3) and self.air_mm3 >= 0):
            raise FeedError(f"air_mm3 is {self.air_mm3}, expected a finite number that is not negative")

    @property
    def cuts(self) -> Bools:
        return np.asarray(self.volume > self.air_mm3)

    @property
    def highest(self) -> Floats:
        """(m,) mm^3 that a part removes at most."""
        return self.volume if self.upper is None else np.maximum(self.upper, self.volume)

    def loads(self, feed_mm_min: Floats) -> Floats:
        return self._rates(self.volume, feed_mm_min)

    def highest_loads(self, feed_mm_min: Floats) -> Floats:
        return self._rates(self.highest, feed_mm_min)

    def _rates(self, volume: Floats, feed_mm_min: Floats) -> Floats:
        length = self.parts.length
        return np.divide(volume * feed_mm_min, length, out=np.zeros(len(length)), where=length > 0.0)

    def feeds(self, goal: Floats) -> Floats:
        raw = np.divide(
            goal * self.parts.length, self.highest, out=np.full(len(goal), np.inf), where=self.cuts
        )
        return np.asarray(raw)

    def mean(self, feed_mm_min: Floats, chosen: Bools) -> float:
        return float(self.volume[chosen].sum() / (self.parts.length[chosen] / feed_mm_min[chosen]).sum())

    def mean_feeds(self, goal: Floats, start: Ints) -> Floats:
        volume, length = (np.add.reduceat(column, start) for column in (self.volume, self.parts.length))
        air = volume <= self.air_mm3
        return np.asarray(
            np.divide(goal[start] * length, volume, out=np.full(len(start), np.inf), where=~air)
        )


def sampled(
    blocks: FeedBlocks, samples: FeedSamples, conservative: bool = False, air_mm3: float = AIR_MM3
) -> VolumeStrategy:
    """The strategy of equal samples; a block without samples is one sample of its own volume.

    Raises FeedError: Samples of another number of blocks.
    """
    if len(samples.offset) != len(blocks) + 1:
        raise FeedError(f"samples are for {len(samples.offset) - 1} blocks, there are {len(blocks)}")
    counts = np.diff(samples.offset)
    filled = np.maximum(counts, 1)
    parts = Parts.equal(blocks, filled)
    volume = np.empty(len(parts.end))
    given = np.repeat(counts > 0, filled)
    volume[given] = samples.volumes(conservative)
    volume[~given] = blocks.volumes(conservative)[counts == 0]
    return VolumeStrategy(parts, volume, blocks.groups[parts.block], air_mm3)
