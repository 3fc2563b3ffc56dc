"""Feeds that keep the largest chip area of a tooth at a reference, in proportion to the feed per tooth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.feed.strategy import Parts, no_mean

AIR_MM2_MIN_MM = 1e-15
"""Chip area per feed that counts as none: 1e-9 mm^2 at the largest feeds of machines."""


@dataclass(frozen=True, slots=True, eq=False)
class ChipAreaStrategy:
    """A = g F, mm^2.

    area_per_feed : (m,) g, mm^2 per mm/min: largest chip area over the rotation angles and over the stations of a part,
    both of its ends included.
    """

    parts: Parts
    area_per_feed: Floats
    group: Ints
    name: str = "chip area"
    unit: str = "mm²"

    @property
    def cuts(self) -> Bools:
        return np.asarray(self.area_per_feed > AIR_MM2_MIN_MM)

    def loads(self, feed_mm_min: Floats) -> Floats:
        return np.asarray(self.area_per_feed * feed_mm_min)

    def highest_loads(self, feed_mm_min: Floats) -> Floats:
        return self.loads(feed_mm_min)

    def feeds(self, goal: Floats) -> Floats:
        g = self.area_per_feed
        return np.asarray(np.divide(goal, g, out=np.full(len(g), np.inf), where=self.cuts))

    def mean(self, feed_mm_min: Floats, chosen: Bools) -> float:
        raise no_mean(self.name)

    def mean_feeds(self, goal: Floats, start: Ints) -> Floats:
        raise no_mean(self.name)
