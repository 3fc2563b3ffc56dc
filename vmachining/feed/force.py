"""Feeds that keep a force, torque, power or deflection at a reference; edge forces do not fall with the feed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.feed.strategy import Parts, no_mean
from vmachining.force import Component, feasible_feeds, peak_levels

UNITS: dict[Component, tuple[str, str]] = {
    "resultant": ("peak force", "N"),
    "xy": ("peak force across the axis", "N"),
    "tangential": ("peak tangential force", "N"),
    "torque": ("peak torque", "N mm"),
    "power": ("mean power", "W"),
    "deflection": ("peak deflection", "mm"),
}
"""Name and unit of the load by what is limited."""

SQUARED = ("resultant", "xy", "deflection")


@dataclass(frozen=True, slots=True, eq=False)
class ForceStrategy:
    """The load, or its square for resultant, xy and deflection, is the largest of p F^2 + 2 q F + r.

    rows : (k, 3) p, q, r with F in mm/min. first, last : (m,) rows of every part; none in air.
    """

    parts: Parts
    rows: Floats
    first: Ints
    last: Ints
    group: Ints
    component: Component = "resultant"

    @property
    def name(self) -> str:
        return UNITS[self.component][0]

    @property
    def unit(self) -> str:
        return UNITS[self.component][1]

    @property
    def cuts(self) -> Bools:
        return np.asarray(self.last > self.first)

    def loads(self, feed_mm_min: Floats) -> Floats:
        level = peak_levels(self.rows, self.first, self.last, feed_mm_min)
        return np.sqrt(np.maximum(level, 0.0)) if self.component in SQUARED else level

    def highest_loads(self, feed_mm_min: Floats) -> Floats:
        return self.loads(feed_mm_min)

    def feeds(self, goal: Floats) -> Floats:
        level = goal**2 if self.component in SQUARED else goal
        return feasible_feeds(self.rows, self.first, self.last, level)

    @property
    def least(self) -> Floats:
        """(m,) load that is left at no feed: a goal below it cannot be met."""
        return self.loads(np.zeros(len(self.first)))

    def mean(self, feed_mm_min: Floats, chosen: Bools) -> float:
        raise no_mean(self.name)

    def mean_feeds(self, goal: Floats, start: Ints) -> Floats:
        raise no_mean(self.name)
