"""Schedules of one program by several references: what each of them gives in feed, load and time."""

from __future__ import annotations

import numpy as np
import polars as pl

from vmachining.arrays import Floats, Ints
from vmachining.feed import FeedBlocks, FeedLimits, Schedule, Strategy, plan_feeds
from vmachining.job.model import Feed


def by_reference(
    feed: Feed, rows: FeedBlocks, strategy: Strategy, limits: FeedLimits, chosen: Schedule
) -> pl.DataFrame | None:
    """Feeds by every reference of `feed.references`, as programmed and as written beside them; None without such.

    Columns reference (null: as programmed), written, unit, block, end (share of the block's path), length_mm, feed_mm_min, time_s
    and load, the largest within; one row per block, and per inserted block of a schedule that divides.
    Raises FeedError: As `plan_feeds`.
    """
    if not feed.references:
        return None
    division = dict(rule=feed.rule, **feed.division)
    plans = {
        value: plan_feeds(rows, strategy, limits, reference=value, **division)
        for value in sorted(set(feed.references))
    }
    n = len(rows)
    tables = [_table(None, False, chosen, strategy, np.arange(n), np.ones(n), rows.feed_mm_min)]
    for value, plan, written in (
        *((v, p, False) for v, p in plans.items()),
        (chosen.reference, chosen, True),
    ):
        tables.append(
            _table(value, written, plan, strategy, plan.sub_block, plan.sub_end, plan.sub_feed_mm_min)
        )
    return pl.concat(tables)


def _table(
    reference: float | None,
    written: bool,
    plan: Schedule,
    strategy: Strategy,
    block: Ints,
    end: Floats,
    feed: Floats,
) -> pl.DataFrame:
    """Rows of pieces that end at `end` (m,) of `block` (m,)."""
    parts = strategy.parts
    start = np.where(np.diff(block, prepend=-1) != 0, 0.0, np.concatenate([[0.0], end[:-1]])[: len(end)])
    first = np.searchsorted(parts.block + parts.end, block + start, side="right")
    owner = np.repeat(np.arange(len(block)), np.diff(np.append(first, len(parts.end))))
    known = np.where(feed > 0.0, feed, 0.0)
    load = np.zeros(len(block))
    np.maximum.at(load, owner, strategy.loads(known[owner]))
    length = (end - start) * plan.blocks.length_mm[block]
    with np.errstate(divide="ignore", invalid="ignore"):
        seconds = np.where(length > 0.0, 60.0 * length / feed, 0.0)
    return pl.DataFrame(
        {
            "reference": pl.Series([reference] * len(block), dtype=pl.Float64), "written": written, "unit": plan.unit,
            "block": block, "end": end, "length_mm": length, "feed_mm_min": feed, "time_s": seconds, "load": load,
        }
    ).with_columns(pl.col("feed_mm_min", "time_s").fill_nan(None))  # fmt: skip
