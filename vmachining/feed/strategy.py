"""What a feed strategy answers, and the parts of blocks that it answers for.

A strategy is one class in one file: what load a part of the path puts on the tool at a feed, and the largest feed at which
the load stays at a goal. Clamping, dividing blocks, rounding and writing are the same for all (`plan.py`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import FeedError
from vmachining.feed.blocks import FeedBlocks

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


def no_mean(name: str) -> FeedError:
    """Refusal of averages by a strategy that limits a peak."""
    return FeedError(
        f"strategy {name!r} limits a peak and has no mean", remedy='reference "auto" or a number, rule "safe"'
    )
