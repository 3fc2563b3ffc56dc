"""From a strategy to a schedule: references, dividing blocks, clamping, rounding. The same for every strategy."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import FeedError
from vmachining.feed import _kernels
from vmachining.feed.blocks import FeedBlocks, Kind
from vmachining.feed.limits import FeedLimits, clamp, written_feed
from vmachining.feed.schedule import Schedule
from vmachining.feed.strategy import Parts, Reference, Rule, Strategy
from vmachining.tolerance import LENGTH_EPS_MM


def plan_feeds(
    blocks: FeedBlocks,
    strategy: Strategy,
    limits: FeedLimits,
    *,
    reference: Reference = "auto",
    insert: bool = False,
    tau: float = 0.25,
    min_length_mm: float = 0.5,
    rule: Rule = "safe",
    every_blocks: int | None = None,
    every_mm: float | None = None,
) -> Schedule:
    """Feeds of the blocks by any strategy.

    reference : a load in the unit of the strategy, for all tools; or "auto", "max", "mean", found per tool.
    insert : divide blocks at ends of parts where wanted feeds differ by more than the factor 1 + tau; else every block
        gets the smallest feed of its parts.
    min_length_mm : shortest inserted block.
    rule : "safe" gives a leaf the smallest feed of its parts, "mean" the one of its mean load.
    every_blocks, every_mm : one feed for so many blocks in a row, or for so much path: the smallest that one of them asks for.
    Raises FeedError: Options out of range; an automatic reference with a block that cuts and has no feed.
    """
    if not (math.isfinite(tau) and tau >= 0):
        raise FeedError(f"tau is {tau}, expected a finite number that is not negative")
    if not (math.isfinite(min_length_mm) and min_length_mm > 0):
        raise FeedError(f"min_length_mm is {min_length_mm}, expected a positive number")
    if rule not in ("safe", "mean"):
        raise FeedError(f"rule {rule!r} is neither 'safe' nor 'mean'")
    if insert and (every_blocks or every_mm):
        raise FeedError("blocks are divided or share a feed, not both")
    parts = strategy.parts
    goals = references(blocks, strategy, reference)
    goal = np.zeros(len(parts.end))
    for group, value in goals.items():
        goal[strategy.group == group] = value
    raw = strategy.feeds(goal)
    first = np.zeros(len(parts.end), dtype=np.bool_)
    first[parts.offset[:-1]] = True
    if insert:
        request, _ = clamp(raw, limits, _caps(blocks)[parts.block])
        each = parts.length[parts.offset[:-1]] if len(blocks) else np.zeros(0)
        # a hair below: 0.5 / 0.05 must give 10 samples, not 11
        fewest = np.divide(min_length_mm, each, out=np.ones(len(blocks)), where=each > LENGTH_EPS_MM)
        n_min = np.maximum(np.ceil(np.minimum(fewest, 2.0**62) * (1 - 1e-12)), 1).astype(np.int64)
        active, repeated = schedulable(blocks)
        _kernels.bisect(request, parts.offset, active & ~repeated, n_min, float(tau), first)
    leaves = _Leaves(blocks, strategy, limits, parts, goal, raw, rule, _runs(blocks, every_blocks, every_mm))
    return leaves.schedule(first, goals)


def schedulable(blocks: FeedBlocks) -> tuple[Bools, Bools]:
    """Blocks that get a feed, and those of them whose line runs several times.

    A line of which one run is not a cut (a cycle that retracts) is left alone as a whole.
    """
    usable = (blocks.kind == str(Kind.CUT)) & (blocks.length_mm > LENGTH_EPS_MM)
    _, where, counts = np.unique(blocks.line, return_inverse=True, return_counts=True)
    spoiled = np.zeros(len(counts), dtype=np.bool_)
    spoiled[where[~usable]] = True
    return usable & ~spoiled[where], np.asarray(counts[where] > 1)


def references(blocks: FeedBlocks, strategy: Strategy, reference: Reference) -> dict[int, float]:
    """Load aimed at for every group; 0 where it was to be found and nothing is cut."""
    groups = np.unique(strategy.group).tolist()
    if not isinstance(reference, str):
        if isinstance(reference, bool) or not (math.isfinite(reference) and reference > 0):
            raise FeedError(
                f"reference is {reference}, expected a positive {strategy.name} in {strategy.unit}"
            )
        return dict.fromkeys(groups, float(reference))
    if reference not in ("auto", "max", "mean"):
        raise FeedError(f"reference {reference!r} is neither a number nor 'auto', 'max' or 'mean'")
    owner = strategy.parts.block
    cuts = schedulable(blocks)[0][owner] & strategy.cuts
    feed = blocks.feed_mm_min[owner]
    if (missing := cuts & np.isnan(feed)).any():
        raise FeedError(
            "a block that cuts has no feed",
            line=int(blocks.line[owner][missing][0]),
            remedy="give a reference",
        )
    known = np.where(np.isnan(feed), 0.0, feed)
    loads = strategy.highest_loads(known) if reference != "mean" else None
    out = {}
    for group in groups:
        mine = cuts & (strategy.group == group)
        if not mine.any():
            out[group] = 0.0
        elif loads is None:
            out[group] = strategy.mean(known, mine)
        else:
            out[group] = float(loads[mine].max())
    return out


def _caps(blocks: FeedBlocks) -> Floats:
    """(n,) caps of the blocks that get a feed; inf elsewhere."""
    return np.where(schedulable(blocks)[0], blocks.caps, np.inf)


class _Leaves:
    """Leaves, runs of parts, to feeds."""

    def __init__(
        self,
        blocks: FeedBlocks,
        strategy: Strategy,
        limits: FeedLimits,
        parts: Parts,
        goal: Floats,
        raw: Floats,
        rule: Rule,
        run: Ints,
    ) -> None:
        self.blocks, self.strategy, self.limits, self.parts = blocks, strategy, limits, parts
        self.goal, self.raw, self.rule, self.run = goal, raw, rule, run
        self.owner, self.caps = parts.block, _caps(blocks)

    def schedule(self, first: Bools, goals: dict[int, float]) -> Schedule:
        """`first`: where leaves begin."""
        blocks, parts = self.blocks, self.parts
        active, repeated = schedulable(blocks)
        exact, limit = self._feeds(first)
        written = self._written(first, exact)
        # neighbours that would be written alike become one block
        start = np.flatnonzero(first)
        alike = (np.diff(written, prepend=np.nan) == 0) & (np.diff(self.owner[start], prepend=-1) == 0)
        if alike.any():
            first = first.copy()
            first[start[alike]] = False
            start = np.flatnonzero(first)
            exact, limit = self._feeds(first)
            written = self._written(first, exact)
        owner = self.owner[start]
        end = parts.end[np.append(start[1:], len(parts.end))[: len(start)] - 1]
        if (again := active & repeated).any():
            line = blocks.line[owner]
            written, exact = (np.where(again[owner], _least(line, v), v) for v in (written, exact))
        on = active[owner]
        return Schedule(
            blocks=blocks,
            strategy=self.strategy.name,
            unit=self.strategy.unit,
            references=goals,
            scheduled=active,
            run=self.run,
            sub_offset=np.searchsorted(owner, np.arange(len(blocks) + 1)).astype(np.int64),
            sub_end=end,
            sub_feed_mm_min=np.where(on, written, blocks.feed_mm_min[owner]),
            sub_exact_mm_min=np.where(on, exact, blocks.feed_mm_min[owner]),
            sub_limit=np.where(on, limit, 0).astype(np.int8),
        )

    def _feeds(self, first: Bools) -> tuple[Floats, NDArray[np.int8]]:
        """Clamped feed of every leaf and the limit it hit, eq. (6)."""
        start = np.flatnonzero(first)
        if not len(start):
            return np.zeros(0), np.zeros(0, dtype=np.int8)
        safe = self.rule == "safe"
        raw = np.minimum.reduceat(self.raw, start) if safe else self.strategy.mean_feeds(self.goal, start)
        caps = self.caps[self.owner[start]]
        if len(start) == len(self.run):  # whole blocks
            raw, caps = _least(self.run, raw), _least(self.run, caps)
        return clamp(raw, self.limits, caps)

    def _written(self, first: Bools, exact: Floats) -> Floats:
        owner = self.owner[np.flatnonzero(first)]
        blocks = self.blocks
        return written_feed(
            exact, self.limits, self.caps[owner], blocks.feed_mm_min[owner], blocks.line[owner]
        )


def _least(key: Ints, values: Floats) -> Floats:
    """The smallest of the values with the same key, for each of them."""
    names, where = np.unique(key, return_inverse=True)
    least = np.full(len(names), np.inf)
    np.minimum.at(least, where, values)
    return np.asarray(least[where])


def _runs(blocks: FeedBlocks, every_blocks: int | None, every_mm: float | None) -> Ints:
    """(n,) number of the run of blocks that share a feed; a plunge, and a line that is repeated or keeps its feed, is alone."""
    n = len(blocks)
    if every_blocks is None and every_mm is None:
        return np.arange(n)
    active, repeated = schedulable(blocks)
    alone = ~active | repeated
    if blocks.plunge is not None:
        alone |= blocks.plunge  # its limit is not one for the pass that follows
    begins = alone | np.append(True, alone[:-1] | (np.diff(blocks.groups) != 0))[:n]
    stretch = np.cumsum(begins) - 1
    before = np.arange(n) if every_blocks is not None else np.cumsum(blocks.length_mm) - blocks.length_mm
    # a hair above: six blocks of 0.1 mm end at 0.6
    step = np.floor((before - before[begins][stretch]) / float(every_blocks or every_mm or 1.0) + 1e-9)
    return np.asarray(np.cumsum(begins | (np.diff(step, prepend=-1.0) != 0.0)) - 1)
