"""Feeds that keep the removal rate at a reference, with and without inserted blocks.

Symbols: V removed volume (v of a sample), L length (l of a sample), F feed, Q removal rate, U cap.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.arrays import Bools, Floats, Ints
from vmachining.errors import FeedError
from vmachining.feed import _kernels
from vmachining.feed.blocks import FeedBlocks, FeedSamples, Kind
from vmachining.feed.limits import FeedLimits, clamp, written_feed
from vmachining.feed.schedule import Schedule
from vmachining.tolerance import LENGTH_EPS_MM

__all__ = ["AIR_MM3", "schedule_volume", "schedule_volume_inserting"]

AIR_MM3 = 1e-9
"""A block that removes no more than this cuts air: rounding of a difference of two solids."""

Reference = Literal["auto", "max", "mean"] | float
Rule = Literal["safe", "mean"]


class _Pieces(NamedTuple):
    """Equal samples of the blocks: (m,) columns and where each block begins."""

    offset: Ints
    block: Ints
    volume: Floats
    length: Floats


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
        keeps their total time where no limit is hit.
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
    pieces = _Pieces(np.arange(len(blocks) + 1), np.arange(len(blocks)), volume, blocks.length_mm)
    goal = _reference(blocks, pieces, reference, air_mm3)
    first = np.ones(len(blocks), dtype=np.bool_)
    return _finish(blocks, limits, pieces, first, goal, "safe", air_mm3)


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
    if not (math.isfinite(tau) and tau >= 0):
        raise FeedError(f"tau is {tau}, want a finite number that is not negative")
    if not (math.isfinite(min_length_mm) and min_length_mm > 0):
        raise FeedError(f"min_length_mm is {min_length_mm}, want a positive number")
    if rule not in ("safe", "mean"):
        raise FeedError(f"rule {rule!r} is neither 'safe' nor 'mean'")
    pieces = _sampled(blocks, samples, conservative)
    goal = _reference(blocks, pieces, reference, air_mm3)
    request, _ = clamp(_raw(pieces.volume, pieces.length, goal, air_mm3), limits, _caps(blocks)[pieces.block])
    each = pieces.length[pieces.offset[:-1]] if len(blocks) else np.zeros(0)
    # a hair below: 0.5 / 0.05 must give 10 samples, not 11
    fewest = np.divide(min_length_mm, each, out=np.ones(len(blocks)), where=each > LENGTH_EPS_MM)
    n_min = np.maximum(np.ceil(np.minimum(fewest, 2.0**62) * (1 - 1e-12)), 1).astype(np.int64)
    active, repeated = _schedulable(blocks)
    first = np.zeros(len(pieces.volume), dtype=np.bool_)
    _kernels.bisect(request, pieces.offset, active & ~repeated, n_min, float(tau), first)
    return _finish(blocks, limits, pieces, first, goal, rule, air_mm3)


def _sampled(blocks: FeedBlocks, samples: FeedSamples, conservative: bool) -> _Pieces:
    """Samples as columns; a block without samples is one sample of its own volume."""
    counts = np.diff(samples.offset)
    filled = np.maximum(counts, 1)
    offset = np.concatenate([[0], np.cumsum(filled)]).astype(np.int64)
    block = np.repeat(np.arange(len(blocks)), filled)
    volume = np.empty(len(block))
    given = np.repeat(counts > 0, filled)
    volume[given] = samples.volumes(conservative)
    volume[~given] = blocks.volumes(conservative)[counts == 0]
    return _Pieces(offset, block, volume, blocks.length_mm[block] / filled[block])


def _schedulable(blocks: FeedBlocks) -> tuple[Bools, Bools]:
    """Blocks that get a feed, and those of them whose line runs several times.

    A line of which one run is not a cut (a cycle that retracts) is left alone as a whole.
    """
    usable = (blocks.kind == str(Kind.CUT)) & (blocks.length_mm > LENGTH_EPS_MM)
    _, where, counts = np.unique(blocks.line, return_inverse=True, return_counts=True)
    spoiled = np.zeros(len(counts), dtype=np.bool_)
    spoiled[where[~usable]] = True
    return usable & ~spoiled[where], np.asarray(counts[where] > 1)


def _caps(blocks: FeedBlocks) -> Floats:
    """(n,) caps of the blocks that get a feed; inf elsewhere."""
    return np.where(_schedulable(blocks)[0], blocks.caps, np.inf)


def _raw(volume: Floats, length: Floats, goal: float, air_mm3: float) -> Floats:
    """Q_ref L / V, eq. (2); inf for air."""
    raw = np.divide(goal * length, volume, out=np.full(len(volume), np.inf), where=volume > air_mm3)
    return np.asarray(raw)


def _reference(blocks: FeedBlocks, pieces: _Pieces, reference: Reference, air_mm3: float) -> float:
    """mm^3/min; 0 when it was to be found and nothing is cut."""
    if not (math.isfinite(air_mm3) and air_mm3 >= 0):
        raise FeedError(f"air_mm3 is {air_mm3}, want a finite number that is not negative")
    if not isinstance(reference, str):
        if isinstance(reference, bool) or not (math.isfinite(reference) and reference > 0):
            raise FeedError(f"reference is {reference}, want a positive removal rate in mm^3/min")
        return float(reference)
    if reference not in ("auto", "max", "mean"):
        raise FeedError(f"reference {reference!r} is neither a number nor 'auto', 'max' or 'mean'")
    active, _ = _schedulable(blocks)
    cuts = active[pieces.block] & (pieces.volume > air_mm3)
    if not cuts.any():
        return 0.0
    owner = pieces.block[cuts]
    feed, volume, length = blocks.feed_mm_min[owner], pieces.volume[cuts], pieces.length[cuts]
    if (missing := np.isnan(feed)).any():
        raise FeedError(
            "a block that cuts has no feed",
            line=int(blocks.line[owner][missing][0]),
            remedy="give a reference",
        )
    if reference == "mean":
        return float(volume.sum() / (length / feed).sum())
    return float((volume * feed / length).max())


def _finish(
    blocks: FeedBlocks,
    limits: FeedLimits,
    pieces: _Pieces,
    first: Bools,
    goal: float,
    rule: Rule,
    air_mm3: float,
) -> Schedule:
    """Leaves -> feeds, limits and the schedule. `first`: where leaves begin."""
    active, repeated = _schedulable(blocks)
    exact, limit = _leaf_feeds(blocks, limits, pieces, first, goal, rule, air_mm3)
    written = _written(blocks, limits, pieces, first, exact)
    # neighbours that would be written alike become one block
    start = np.flatnonzero(first)
    alike = (np.diff(written, prepend=np.nan) == 0) & (np.diff(pieces.block[start], prepend=-1) == 0)
    if alike.any():
        first = first.copy()
        first[start[alike]] = False
        start = np.flatnonzero(first)
        exact, limit = _leaf_feeds(blocks, limits, pieces, first, goal, rule, air_mm3)
        written = _written(blocks, limits, pieces, first, exact)
    owner = pieces.block[start]
    counts = np.diff(pieces.offset)
    stop = np.append(start[1:], len(pieces.volume)) - pieces.offset[owner]
    end = stop / counts[owner]
    if (again := active & repeated).any():
        written, exact = (_smallest_of_line(blocks, again, owner, column) for column in (written, exact))
    on = active[owner]
    offset = np.searchsorted(owner, np.arange(len(blocks) + 1)).astype(np.int64)
    return Schedule(
        blocks=blocks,
        reference_mm3_min=goal,
        scheduled=active,
        sub_offset=offset,
        sub_end=end,
        sub_feed_mm_min=np.where(on, written, blocks.feed_mm_min[owner]),
        sub_exact_mm_min=np.where(on, exact, blocks.feed_mm_min[owner]),
        sub_limit=np.where(on, limit, 0).astype(np.int8),
    )


def _leaf_feeds(
    blocks: FeedBlocks,
    limits: FeedLimits,
    pieces: _Pieces,
    first: Bools,
    goal: float,
    rule: Rule,
    air_mm3: float,
) -> tuple[Floats, NDArray[np.int8]]:
    """Clamped feed of every leaf and the limit it hit, eq. (6)."""
    start = np.flatnonzero(first)
    if not len(start):
        return np.zeros(0), np.zeros(0, dtype=np.int8)
    if rule == "safe":
        raw = np.minimum.reduceat(_raw(pieces.volume, pieces.length, goal, air_mm3), start)
    else:
        volume, length = (np.add.reduceat(column, start) for column in (pieces.volume, pieces.length))
        raw = _raw(volume, length, goal, air_mm3)
    return clamp(raw, limits, _caps(blocks)[pieces.block[start]])


def _written(blocks: FeedBlocks, limits: FeedLimits, pieces: _Pieces, first: Bools, exact: Floats) -> Floats:
    owner = pieces.block[np.flatnonzero(first)]
    return written_feed(exact, limits, _caps(blocks)[owner], blocks.feed_mm_min[owner], blocks.line[owner])


def _smallest_of_line(blocks: FeedBlocks, again: Bools, owner: Ints, feed: Floats) -> Floats:
    """One feed for all runs of a line: the smallest."""
    names, where = np.unique(blocks.line, return_inverse=True)
    least = np.full(len(names), np.inf)
    np.minimum.at(least, where[owner], feed)
    return np.where(again[owner], least[where[owner]], feed)
