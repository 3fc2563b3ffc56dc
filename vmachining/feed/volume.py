"""Feeds that keep the removal rate at a reference. Symbols: v removed volume and l length of a part, F feed, Q removal rate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import FeedError
from vmachining.feed.blocks import FeedBlocks, sure_volumes
from vmachining.feed.strategy import Parts

AIR_MM3 = 1e-9
"""A part that removes no more than this cuts air: rounding of a difference of two solids."""


@dataclass(frozen=True, slots=True, eq=False)
class VolumeStrategy:
    """Removal rate Q = v F / l, mm^3/min.

    volume : (m,) mm^3 of every part. upper : (m,) upper ends of the
    brackets, by which feeds are found, so that the true rate keeps the goal; None: the volumes are taken as exact.
    """

    parts: Parts
    volume: Floats
    group: Ints
    upper: Floats | None = None
    name: str = "volume"
    unit: str = "mm³/min"

    @property
    def cuts(self) -> Bools:
        return np.asarray(self.volume > AIR_MM3)

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
        air = volume <= AIR_MM3
        return np.asarray(
            np.divide(goal[start] * length, volume, out=np.full(len(start), np.inf), where=~air)
        )


def sampled(blocks: FeedBlocks, volume_mm3: ArrayLike, counts: Ints) -> VolumeStrategy:
    """The strategy of equal samples: `counts` (n,) of every block, one after the other; a block without samples is one sample.

    Raises FeedError: Samples of another number of blocks; volumes that are not finite or negative.
    """
    if len(counts) != len(blocks):
        raise FeedError(f"samples are for {len(counts)} blocks, there are {len(blocks)}")
    filled = np.maximum(counts, 1)
    parts = Parts.equal(blocks, filled)
    volume = np.empty(len(parts.end))
    given = np.repeat(counts > 0, filled)
    volume[given] = sure_volumes(volume_mm3, int(counts.sum()), "sample volume_mm3")
    volume[~given] = blocks.volume_mm3[counts == 0]
    return VolumeStrategy(parts, volume, blocks.groups[parts.block])
