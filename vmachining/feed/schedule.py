"""A schedule: old and new feeds of every block, and the edits that put them into the program."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vmachining.arrays import Bools, Floats, Ints
from vmachining.feed.blocks import FeedBlocks
from vmachining.feed.limits import WORDS, Limit

if TYPE_CHECKING:
    from vmachining.nc import BlockEdit


@dataclass(frozen=True, slots=True, eq=False)
class Schedule:
    """New feeds of n blocks; block k consists of the sub-blocks sub_offset[k]:sub_offset[k+1] (at least one).

    blocks : what was scheduled.
    strategy, unit : name of the load that is kept, and its unit. references : load aimed at, by tool (0 for blocks that
        do not say which tool cuts); 0 when nothing is cut.
    scheduled : (n,) bool, whether the block got a feed; the others keep theirs.
    run : (n,) int, blocks of one number share a feed.
    sub_offset : (n + 1,) int
    sub_end : (m,) fraction of the block's path at which the sub-block ends, the last is exactly 1.
    sub_feed_mm_min : (m,) as written, rounded down.
    sub_exact_mm_min : (m,) before rounding.
    sub_limit : (m,) int8, position in `Limit`.
    """

    blocks: FeedBlocks
    strategy: str
    unit: str
    references: dict[int, float]
    scheduled: Bools
    run: Ints
    sub_offset: Ints
    sub_end: Floats
    sub_feed_mm_min: Floats
    sub_exact_mm_min: Floats
    sub_limit: NDArray[np.int8]

    def __post_init__(self) -> None:
        for name in self.__slots__:
            if isinstance(value := getattr(self, name), np.ndarray):
                value.setflags(write=False)

    @property
    def reference(self) -> float:
        """Load aimed at; the largest where tools have their own."""
        return max(self.references.values(), default=0.0)

    @property
    def sub_block(self) -> Ints:
        """(m,) index of the block each sub-block belongs to."""
        return np.repeat(np.arange(len(self.blocks)), np.diff(self.sub_offset))

    @property
    def sub_share(self) -> Floats:
        """(m,) share of the block's length."""
        share = np.diff(self.sub_end, prepend=0.0)
        share[self.sub_offset[:-1]] = self.sub_end[self.sub_offset[:-1]]
        return np.asarray(share)

    @property
    def sub_length_mm(self) -> Floats:
        """(m,) mm."""
        return np.asarray(self.sub_share * self.blocks.length_mm[self.sub_block])

    @property
    def inserted(self) -> int:
        """How many blocks the program gains."""
        return len(self.sub_end) - len(self.blocks)

    @property
    def time_s(self) -> Floats:
        """(n,) s per block at the written feeds; NaN for a block that moves without a feed (a rapid)."""
        return self._per_block(self.sub_feed_mm_min)

    @property
    def exact_time_s(self) -> Floats:
        """(n,) s per block before rounding."""
        return self._per_block(self.sub_exact_mm_min)

    @property
    def old_time_s(self) -> Floats:
        """(n,) s per block at the original feeds."""
        return _seconds(self.blocks.length_mm, self.blocks.feed_mm_min)

    @property
    def total_time_s(self) -> float:
        """Length over written feed, summed over the blocks that have a feed."""
        return float(np.nansum(self.time_s))

    @property
    def total_exact_time_s(self) -> float:
        """The same before rounding."""
        return float(np.nansum(self.exact_time_s))

    @property
    def total_old_time_s(self) -> float:
        """The same at the original feeds."""
        return float(np.nansum(self.old_time_s))

    @property
    def feed_mm_min(self) -> Floats:
        """(n,) mm/min as written; for a block with inserted ones, its length over its time."""
        return self._whole(self.sub_feed_mm_min)

    @property
    def exact_mm_min(self) -> Floats:
        """(n,) the same before rounding."""
        return self._whole(self.sub_exact_mm_min)

    @property
    def limit(self) -> tuple[Limit, ...]:
        """The limit each block hit; of several sub-blocks the most serious one."""
        if not len(self.blocks):
            return ()
        return tuple(WORDS[code] for code in np.maximum.reduceat(self.sub_limit, self.sub_offset[:-1]))

    def edits(self) -> dict[int, BlockEdit]:
        """What to change in the program, by line. Blocks that were not scheduled do not appear."""
        from vmachining.nc import BlockEdit

        starts, stops = self.sub_offset[:-1].tolist(), self.sub_offset[1:].tolist()
        feeds, ends = self.sub_feed_mm_min.tolist(), self.sub_end.tolist()
        lines = self.blocks.line.tolist()
        return {
            lines[k]: BlockEdit(
                lines[k], tuple(feeds[starts[k] : stops[k]]), tuple(ends[starts[k] : stops[k]])
            )
            for k in np.flatnonzero(self.scheduled).tolist()
        }

    def _whole(self, feed: Floats) -> Floats:
        """(n,) feeds of blocks from those of sub-blocks; of several the length over the time."""
        first, several = feed[self.sub_offset[:-1]], np.diff(self.sub_offset) > 1
        return np.divide(60.0 * self.blocks.length_mm, self._per_block(feed), out=first, where=several)

    def _per_block(self, feed: Floats) -> Floats:
        if not len(self.blocks):
            return np.zeros(0)
        return np.asarray(np.add.reduceat(_seconds(self.sub_length_mm, feed), self.sub_offset[:-1]))


def _seconds(length: Floats, feed: Floats) -> Floats:
    """60 L / F; 0 without length, NaN without feed."""
    return np.divide(60.0 * length, feed, out=np.zeros(len(length)), where=length > 0)
