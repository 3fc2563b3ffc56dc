"""What a feed strategy answers, the parts of blocks that it answers for, and the strategies: volume, chip area, force.

A strategy is one class: what load a part of the path puts on the tool at a feed, and the largest feed at which the load stays
at a goal. Clamping, dividing blocks, rounding and writing are the same for all (`plan.py`). Symbols: v removed volume and l
length of a part, F feed, Q removal rate.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import FeedError
from vmachining.feed.blocks import FeedBlocks, sure_volumes
from vmachining.force import Component, feasible_feeds, peak_levels

Reference = Literal["auto", "max", "mean"] | float
"""A load, "auto" or "max" (the largest at the original feeds), or "mean" (where the strategy has one)."""

Rule = Literal["safe", "mean"]


@dataclass(frozen=True, slots=True, eq=False)
class Parts:
    """Consecutive parts of the blocks, at least one each.

    offset : (n + 1,) first part of every block. end : (m,) fraction of the block's path at which a part ends; the last of
    a block is 1. length : (m,) mm.
    """

    offset: Ints
    end: Floats
    length: Floats

    @classmethod
    def whole(cls, blocks: FeedBlocks) -> Parts:
        """One part per block."""
        n = len(blocks)
        return cls(np.arange(n + 1), np.ones(n), np.array(blocks.length_mm))

    @classmethod
    def equal(cls, blocks: FeedBlocks, counts: Ints) -> Parts:
        """`counts` equal parts of every block."""
        offset, block, number = _counted(counts)
        return cls(offset, number / counts[block], blocks.length_mm[block] / counts[block])

    @classmethod
    def stepped(cls, blocks: FeedBlocks, step_mm: Floats) -> Parts:
        """Parts of `step_mm` (n,) from the start of every block on; its last one is the shorter rest."""
        with np.errstate(divide="ignore", invalid="ignore"):
            asked = np.ceil(blocks.length_mm / step_mm - 1e-6)
        counts = np.maximum(np.nan_to_num(asked, posinf=1.0), 1).astype(np.int64)
        offset, block, number = _counted(counts)
        length = blocks.length_mm[block]
        share = np.divide(number * step_mm[block], length, out=np.ones(len(block)), where=length > 0.0)
        end = np.where(number == counts[block], 1.0, np.minimum(share, 1.0))
        start = np.where(number == 1, 0.0, np.concatenate([[0.0], end[:-1]]))
        return cls(offset, end, length * (end - start))

    @property
    def block(self) -> Ints:
        """(m,) block of every part."""
        return np.repeat(np.arange(len(self.offset) - 1), np.diff(self.offset))


def _counted(counts: Ints) -> tuple[Ints, Ints, Ints]:
    """(n + 1,) first part of every block that has so many; (m,) block of a part, and its number there, from 1."""
    offset = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    block = np.repeat(np.arange(len(counts)), counts)
    return offset, block, np.arange(len(block)) - offset[block] + 1


class Strategy(Protocol):
    """The question of a scheduler: how much may a part be fed?

    name, unit : of the load, for reports. parts : what it answers for. group : (m,) parts of one number share a
    reference (one per tool). cuts : (m,) False in air.
    """

    @property
    def name(self) -> str: ...

    @property
    def unit(self) -> str: ...

    @property
    def parts(self) -> Parts: ...

    @property
    def group(self) -> Ints: ...

    @property
    def cuts(self) -> Bools: ...

    def loads(self, feed_mm_min: Floats) -> Floats:
        """(m,) load of every part at its feed."""

    def highest_loads(self, feed_mm_min: Floats) -> Floats:
        """(m,) the same at the upper end of its bracket, where the load has one."""

    def feeds(self, goal: Floats) -> Floats:
        """(m,) mm/min, largest feed at which the load of a part is its goal; inf in air, 0 where no feed is small enough.

        A bigger load at the same feed never gives a bigger feed.
        """

    def mean(self, feed_mm_min: Floats, chosen: Bools) -> float:
        """Mean load over the time of chosen parts, for reference "mean". FeedError if it means nothing."""

    def mean_feeds(self, goal: Floats, start: Ints) -> Floats:
        """(leaves,) feeds at which whole leaves, beginning at parts `start`, meet the goal on average; see `mean`."""


class _Peak:
    """A load whose peak is limited: it has no bracket and no mean."""

    __slots__ = ()

    def highest_loads(self: Strategy, feed_mm_min: Floats) -> Floats:
        return self.loads(feed_mm_min)

    def mean(self: Strategy, feed_mm_min: Floats, chosen: Bools) -> float:
        what = f"strategy {self.name!r} limits a peak and has no mean"
        raise FeedError(what, remedy='reference "auto" or a number, rule "safe"')

    def mean_feeds(self: Strategy, goal: Floats, start: Ints) -> Floats:
        return np.full(len(start), self.mean(goal, self.cuts))


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


AIR_MM2_MIN_MM = 1e-15
"""Chip area per feed that counts as none: 1e-9 mm^2 at the largest feeds of machines."""


@dataclass(frozen=True, slots=True, eq=False)
class ChipAreaStrategy(_Peak):
    """Largest chip area of a tooth, A = g F, mm^2.

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

    def feeds(self, goal: Floats) -> Floats:
        g = self.area_per_feed
        return np.asarray(np.divide(goal, g, out=np.full(len(g), np.inf), where=self.cuts))


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
class ForceStrategy(_Peak):
    """A force, torque, power or deflection; edge forces do not fall with the feed.

    The load, or its square for resultant, xy and deflection, is the largest of p F^2 + 2 q F + r.

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

    def feeds(self, goal: Floats) -> Floats:
        level = goal**2 if self.component in SQUARED else goal
        return feasible_feeds(self.rows, self.first, self.last, level)

    @property
    def least(self) -> Floats:
        """(m,) load that is left at no feed: a goal below it cannot be met."""
        return self.loads(np.zeros(len(self.first)))
