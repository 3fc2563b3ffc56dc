"""New feeds: planned from the first simulation, written into the program, and judged by a second simulation.

The numbers reported are those of the program that was written: it is read again from its bytes and cut again
in fresh stock. Its blocks are then grouped back to the blocks of the original by the line each came from.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.feed import Limit
from vmachining.job.model import Feed
from vmachining.job.strategies import Planned
from vmachining.job.toolpath import Block
from vmachining.job.verified import owners

if TYPE_CHECKING:
    from vmachining.nc import Rewritten

MAX_SAMPLES = 64
"""Parts in which one block is measured at most: a sub-block of 1/64 of a block is fine enough for a feed."""

WORDS = {
    Limit.AIR: "cut air: highest feed allowed",
    Limit.MAX: "at the largest feed",
    Limit.AXIS: "at a limit of the machine",
    Limit.MIN: "at the smallest feed: the load stays above the reference",
    Limit.INFEASIBLE_MIN: "machine limit below the smallest feed: the machine wins",
}
DOES = {
    "volume": "Volume strategy: every cutting block gets the feed at which it removes {goal}",
    "chip_area": "Chip area strategy: every cutting block gets the feed at which the largest chip of a tooth has {goal}",
    "force": "Force strategy: every cutting block gets the feed at which its {name} is {goal}",
}
UNSPLIT = "could not be divided: the smallest feed of its parts"
UNTOUCHED = "left as programmed: its line cannot take another feed"


@dataclass(frozen=True, slots=True, eq=False)
class ScheduleReport:
    """What the written program does.

    text : strategy and reference in words. limits : {block: words} of the blocks that hit one.
    tally : {words: number of blocks}.
    after_rate : (n,) mm^3/min per original block, NaN where it takes no time.
    comparison : all strategies on this job, one row each, see `vmachining.job.strategies.compared`.
    blocks, removed_mm3 : of the written program.
    reference, unit, strategy, reference_from : the load aimed at, and what it is.
    note : what the reference asks too much of, with what can be met; None if nothing.
    largest_block_mm3_min : the largest rate of a whole block as programmed.
    unsplit : lines that wanted inserted blocks and got the smallest feed of them as a whole.
    untouched : lines whose feed could not be changed and is the programmed one.
    passed : blocks that pass the reference anyway, worst first.
    """

    text: str
    limits: dict[int, str]
    tally: dict[str, int]
    after_rate: Floats
    comparison: pl.DataFrame
    blocks: int
    removed_mm3: float
    reference: float
    unit: str
    strategy: str
    reference_from: str
    largest_block_mm3_min: float
    note: str | None = None
    unsplit: tuple[int, ...] = ()
    untouched: tuple[int, ...] = ()
    passed: tuple[Passed, ...] = ()


class Passed(NamedTuple):
    """A block of the written program whose load passes the reference. block : of the original; line : as written."""

    block: int
    line: int
    load: float
    reference: float

    @property
    def share(self) -> float:
        """By how much, relative to the reference."""
        return self.load / self.reference - 1.0


def sample_count(feed: Feed, length_mm: float) -> int:
    """Equal parts a path is measured in: a power of two, parts no shorter than the shortest sub-block."""
    if not feed.insert_blocks or length_mm < 2 * feed.min_length_mm:
        return 1
    return int(min(MAX_SAMPLES, 2 ** int(np.log2(length_mm / feed.min_length_mm))))


def reference_words(feed: Feed) -> str:
    if not isinstance(feed.reference, str):
        return "given in the job"
    piece = f"part of a block (one of up to {MAX_SAMPLES})" if feed.insert_blocks else "block"
    if feed.reference == "mean":
        return "volume over time of all that cuts, as programmed"
    peak = ", which may be above that of every whole block" if feed.insert_blocks else ""
    load = "rate" if feed.strategy == "volume" else "load"
    return f"the largest {load} of a {piece} as programmed{peak}"


def kept_words(passed: Sequence[Passed], unit: str) -> str:
    """Whether the written program keeps its reference; else where it passes it, and by how much."""
    if not passed:
        return "Every block that was scheduled keeps the reference."
    worst = passed[0]
    count = "1 block passes" if len(passed) == 1 else f"{len(passed)} blocks pass"
    return (
        f"{count} the reference, at most by {100.0 * worst.share:.2g} % in block {worst.block} "
        f"(line {worst.line} of the written program): {worst.load:.4g} {unit} instead of {worst.reference:.4g} {unit}; "
        "the smallest feed, a machine limit or a line that cannot be changed keeps it there."
    )


def compare(
    feed: Feed,
    planned: Planned,
    written: Rewritten,
    blocks: Sequence[Block],
    after: pl.DataFrame,
    passed: Sequence[Passed] = (),
) -> tuple[pl.DataFrame, ScheduleReport]:
    """Rows of the rewritten program grouped to the original blocks.

    Returns columns block, scheduled_feed_mm_min, scheduled_time_s, note; and the report.

    Raises FeedError: The written program does not run through the original blocks: a bug, never a user's fault.
    """
    schedule = planned.schedule
    owner = owners(written, after["line"].to_list(), blocks)
    starts = np.flatnonzero(np.diff(owner, prepend=-1))
    groups = np.split(np.arange(len(owner)), starts[1:])
    length, feeds = after["length_mm"].to_numpy(), after["feed_mm_min"].fill_null(float("nan")).to_numpy()
    times, removed = after["time_s"].to_numpy(), after["removed_mm3"].to_numpy()
    seconds = np.add.reduceat(times, starts) if len(starts) else np.zeros(0)
    volume = np.add.reduceat(removed, starts) if len(starts) else np.zeros(0)
    speed = [
        float(feeds[m[0]]) if len(m) == 1 else float(length[m].sum() / (length[m] / feeds[m]).sum())
        for m in groups
    ]
    rates = np.divide(60.0 * volume, seconds, out=np.full(len(seconds), np.nan), where=seconds > 0)
    limits = enumerate(zip(schedule.limit, schedule.scheduled, strict=True))
    hit = {index: WORDS[word] for index, (word, on) in limits if on and word in WORDS}
    left = dict.fromkeys(written.unsplit, UNSPLIT) | dict.fromkeys(written.untouched, UNTOUCHED)
    notes = [left.get(block.line, planned.notes.get(block.number)) for block in blocks]
    columns = pl.DataFrame({
        "block": pl.Series(range(len(blocks)), dtype=pl.Int64),
        "scheduled_feed_mm_min": pl.Series(speed, dtype=pl.Float64).fill_nan(None),
        "scheduled_time_s": pl.Series(seconds, dtype=pl.Float64),
        "note": pl.Series([note and f"schedule: {note}" for note in notes], dtype=pl.String),
    })  # fmt: skip
    hit |= {block.number: left[block.line] for block in blocks if block.line in left}
    inserted = ""
    if feed.insert_blocks:
        inserted = f", {schedule.inserted} blocks inserted (tau {feed.tau:g}, rule {feed.rule})"
    elif feed.every_blocks:
        inserted = f", one feed for {feed.every_blocks} blocks in a row"
    elif feed.every_mm:
        inserted = f", one feed for every {feed.every_mm:g} mm"
    goals = {tool: goal for tool, goal in schedule.references.items() if goal > 0.0}
    told = {tool: f" (tool {tool})" if len(goals) > 1 else "" for tool in goals}
    goal_text = " and ".join(f"{goal:.6g} {schedule.unit}{told[tool]}" for tool, goal in goals.items())
    what = DOES[feed.strategy].format(name=schedule.strategy, goal=goal_text or f"0 {schedule.unit}")
    source = reference_words(feed)
    before, on = schedule.blocks, schedule.scheduled
    rate = before.volume_mm3[on] * before.feed_mm_min[on] / before.length_mm[on]
    largest = float(rate[np.isfinite(rate)].max(initial=0.0))
    aims = (
        f"reference: {feed.reference}, {source}), between {feed.min_mm_min:g} and {feed.max_mm_min:g} mm/min"
    )
    again = "The written program was read back from its file and simulated again; the numbers come from that simulation."
    report = ScheduleReport(
        text=f"{what} ({aims}{inserted}. {again} {kept_words(passed, schedule.unit)}",
        limits=hit, tally=dict(Counter(hit.values())), after_rate=rates, comparison=planned.comparison,
        note=planned.infeasible, blocks=len(after), removed_mm3=float(removed.sum()), reference=schedule.reference,
        unit=schedule.unit, strategy=feed.strategy, reference_from=source, largest_block_mm3_min=largest,
        unsplit=tuple(sorted(set(written.unsplit) - set(written.untouched))),
        untouched=tuple(sorted(set(written.untouched))), passed=tuple(passed),
    )  # fmt: skip
    return columns, report
