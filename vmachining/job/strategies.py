"""The feed strategies of a job, made of one simulation, and what each of them would do to all loads."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np
import polars as pl

from vmachining.arrays import Floats, Ints
from vmachining.errors import FeedError
from vmachining.feed import (
    ChipAreaStrategy,
    FeedBlocks,
    FeedLimits,
    ForceStrategy,
    Kind,
    Parts,
    Schedule,
    Strategy,
    VolumeStrategy,
    plan_feeds,
    sampled,
    schedulable,
)
from vmachining.job.model import Feed
from vmachining.job.paths import end_axis
from vmachining.job.stations import Stations
from vmachining.job.table import read_samples
from vmachining.job.toolpath import Block, Toolpath
from vmachining.nc import Motion
from vmachining.tolerance import LENGTH_EPS_MM

LOADS = ("volume", "chip_area", "force")
"""Strategies, and the loads that all of them are judged by."""

PROGRAMMED = "as programmed"
"""Name of the row of the original feeds."""

PLUNGE = math.radians(45.0)
"""Angle to the tool axis within which a straight move down is a plunge; ramps and helices are flatter."""

Loads = dict[str, tuple[float | None, float | None]]
"""Peak and relative spread by load; None where nothing is known."""


@dataclass(frozen=True, slots=True, eq=False)
class Planned:
    """Schedules of all strategies, and what they would do.

    schedule : of the strategy asked for. plans : of every strategy. rows : what was scheduled. comparison : one row per
    strategy, see `compared`. notes : {block: words}.
    infeasible : parts that exceed the reference at any feed, with the smallest reference that they could meet; or None.
    references : the same program by other references, see `by_reference`; or None.
    """

    schedule: Schedule
    plans: dict[str, Schedule]
    rows: FeedBlocks
    comparison: pl.DataFrame
    notes: dict[int, str]
    infeasible: str | None = None
    references: pl.DataFrame | None = None

    def divided(self, owner: Ints, table: pl.DataFrame, line: Ints, feed: Floats) -> FeedBlocks:
        """The rows of a program made of this one. owner : (m,) its blocks here. table : lengths and volumes of them."""
        rows = self.rows
        return FeedBlocks(
            line=line, kind=rows.kind[owner], length_mm=table["length_mm"].to_numpy(), feed_mm_min=feed,
            volume_mm3=table["removed_mm3"].to_numpy(), volume_hi_mm3=table["removed_hi_mm3"].to_numpy(), tool=rows.groups[owner],
        )  # fmt: skip

    def with_schedule(self, name: str, schedule: Schedule) -> Planned:
        """The same with another schedule of the strategy that was requested."""
        return replace(self, schedule=schedule, plans={**self.plans, name: schedule})


def plan(
    feed: Feed,
    toolpath: Toolpath,
    table: pl.DataFrame,
    partial: Path,
    caps: Floats,
    stations: Stations,
    *,
    every: bool = False,
) -> Planned:
    """The schedule of a simulated program, and those of the other strategies.

    table : the rows of the first simulation; partial : their file, which also has the samples.
    caps : (moves,) mm/min, of the machine.
    stations : of the same program. every : whether all strategies may divide blocks, and not only the one asked for:
    volumes and stations are there for each of them.
    Raises FeedError: No schedule exists, e.g. nothing cuts and no reference is given, no part can meet the reference,
        or the strategy needs what the job does not say.
    """
    program, blocks, moves = toolpath.program, toolpath.blocks, toolpath.moves
    rapid = [all(moves[k].motion is Motion.RAPID for k in block.moves) for block in blocks]
    # a line of several motions that are not all rapid keeps its feed: its parts cannot be told apart
    several = [Kind.OTHER if len(block.moves) > 1 else Kind.CUT for block in blocks]
    kinds = np.array([str(Kind.RAPID if on else kind) for on, kind in zip(rapid, several, strict=True)])
    notes: dict[int, str] = {}
    if feed.strategy != "volume":
        kinds, notes = _without_unknown(feed, kinds, stations)
    feeds = table["feed_mm_min"].fill_null(float("nan")).to_numpy()
    largest = np.array([min(float(caps[i]) for i in block.moves) for block in blocks])
    down = np.array([_plunges(toolpath, block) for block in blocks], dtype=np.bool_)
    # the limit of a plunge is the one given, or the feed that its program gives it
    most = feeds if feed.plunge_max_mm_min is None else np.full(len(feeds), feed.plunge_max_mm_min)
    largest = np.where(down & np.isfinite(most), np.minimum(largest, most), largest)
    if feed.strategy == "chip_area" and feed.plunge_max_mm_min is None and isinstance(feed.reference, str):
        # plunges keep their feed and set no reference: their chips are of the bottom, and a pass is not to be fed until its own
        # are as large; a tool that only plunges is held by its plunges
        tools, cuts = np.array([block.tool for block in blocks]), kinds == str(Kind.CUT)
        kinds = np.where(cuts & down & np.isin(tools, tools[cuts & ~down]), str(Kind.OTHER), kinds)
    rows = FeedBlocks(
        line=np.array([block.line for block in blocks]), kind=kinds, length_mm=table["length_mm"].to_numpy(), feed_mm_min=feeds,
        volume_mm3=table["removed_mm3"].to_numpy(), volume_hi_mm3=table["removed_hi_mm3"].to_numpy(),
        cap_mm_min=largest, tool=np.array([block.tool for block in blocks]), plunge=down,
    )  # fmt: skip
    limits = FeedLimits(min_mm_min=feed.min_mm_min, max_mm_min=feed.max_mm_min)
    known = strategies(feed, rows, partial, stations, every=every)
    mine = known[feed.strategy]
    try:
        schedule = plan_feeds(rows, mine, limits, reference=feed.reference, rule=feed.rule, **feed.division)
        told = _infeasible(rows, mine, schedule)
        others = by_reference(feed, rows, mine, limits, schedule)
    except FeedError as exc:
        raise FeedError(exc.message, file=program.name, line=exc.line, remedy=exc.remedy) from exc
    plans = _plans(feed, rows, known, limits, schedule)
    return Planned(schedule, plans, rows, compared(feed, rows, known, plans), notes, told, others)


def _plunges(toolpath: Toolpath, block: Block) -> bool:
    """Whether a block goes into the material along its tool: within `PLUNGE` of the axis, tip ahead."""
    path = toolpath.paths[block.moves[0]]
    if path.length <= LENGTH_EPS_MM:
        return False
    chord = path.position(1.0) - path.position(0.0)
    return bool(-(chord @ end_axis(path)) >= math.cos(PLUNGE) * path.length)


def _without_unknown(feed: Feed, kinds: np.ndarray, stations: Stations) -> tuple[np.ndarray, dict[int, str]]:
    """Blocks whose load is not known are left as programmed, and say so."""
    known = np.ones(len(kinds), dtype=np.bool_)
    if feed.strategy == "force":
        known = stations.known
    else:
        known[stations.block[np.isnan(stations.area_per_feed)]] = False
    lost = np.flatnonzero((kinds == str(Kind.CUT)) & ~known)
    if len(lost) and len(lost) == (kinds == str(Kind.CUT)).sum():
        why = "; ".join(stations.notes) or "see the warnings of the blocks"
        remedy = (
            'give flutes with the tool, and a spindle speed in the program or under [force]; or take "volume"'
        )
        raise FeedError(f"strategy {feed.strategy!r}: no block has a known load ({why})", remedy=remedy)
    kinds = kinds.copy()
    kinds[lost] = str(Kind.OTHER)
    return kinds, {int(k): "feed left as programmed: its load is not known" for k in lost}


def strategies(
    feed: Feed, rows: FeedBlocks, partial: Path | None, stations: Stations, *, every: bool = False
) -> dict[str, Strategy]:
    """Those for which the job says enough; the one asked for always.

    partial : table with the volumes of parts, where blocks may be divided. every : see `plan`.
    """
    divided, low, high = feed.insert_blocks, rows.volumes(False), rows.volumes(True)
    found: dict[str, Strategy] = {}
    if divided and partial is not None and (every or feed.strategy == "volume"):
        volumes: list[float] = []
        counts = np.zeros(len(rows), dtype=np.int64)
        for index, samples in read_samples(partial):
            if rows.kind[index] == str(Kind.CUT):
                volumes.extend(samples)
                counts[index] = len(samples)
        equal = sampled(rows, volumes, counts)
        # parts are measured without brackets: they share that of their block
        wider = np.divide(high, low, out=np.ones(len(rows)), where=low > 0.0)
        found["volume"] = replace(equal, upper=equal.volume * wider[equal.parts.block])
        divided = every
    else:
        found["volume"] = VolumeStrategy(Parts.whole(rows), low, rows.groups, upper=high)
    first, last = stations.parts(divided=divided)
    # a block without stations is one part
    step = np.where(np.isnan(stations.step), np.maximum(rows.length_mm, 1.0), stations.step)
    parts = Parts.stepped(rows, step) if divided else Parts.whole(rows)
    group = rows.groups[parts.block]
    areas = np.append(np.nan_to_num(stations.area_per_feed), 0.0)
    area = np.where(last >= first, _largest(areas, first, last), 0.0)
    if feed.strategy == "chip_area" or np.isfinite(stations.area_per_feed).any():
        found["chip_area"] = ChipAreaStrategy(parts, area, group)
    if feed.strategy == "force" or len(stations.rows):
        begin, end = (
            np.where(last >= first, np.append(of, 0)[np.minimum(at, len(of))], 0)
            for of, at in ((stations.first, first), (stations.last, last))
        )
        found["force"] = ForceStrategy(parts, stations.rows, begin, end, group, feed.component)
    return found


def _largest(values: Floats, first: Ints, last: Ints) -> Floats:
    """(m,) largest of values[first : last + 1]; parts overlap in their ends."""
    if not len(first):
        return np.zeros(0)
    begin, top = np.minimum(first, len(values) - 1), len(values) - 1
    if (last - first <= 1).all():
        return np.asarray(np.maximum(values[begin], values[np.clip(last, 0, top)]))
    pairs = np.column_stack([begin, np.minimum(last + 1, top)]).ravel()
    return np.asarray(np.maximum.reduceat(values, pairs)[::2])


def _infeasible(rows: FeedBlocks, strategy: Strategy, schedule: Schedule) -> str | None:
    """Words for parts whose edge forces alone exceed the reference; FeedError if no part can meet it."""
    if not isinstance(strategy, ForceStrategy):
        return None
    goal = np.array([schedule.references[int(g)] for g in strategy.group])
    cuts = strategy.cuts & schedulable(rows)[0][strategy.parts.block]
    least = strategy.least
    over = cuts & (least >= goal)
    if not over.any():
        return None
    worst = int(np.argmax(np.where(over, least, -np.inf)))
    line = int(rows.line[strategy.parts.block[worst]])
    lowest = float(least[cuts].max())
    text = (
        f"the reference {goal[worst]:.4g} {strategy.unit} is below what edge forces alone need at any feed "
        f"(line {line}); the least that every block can meet is above {lowest:.4g} {strategy.unit}"
    )
    if over[cuts].all():
        raise FeedError(text, line=line, remedy="raise the reference, or reduce the depth of cut")
    return text


def _plans(
    feed: Feed, rows: FeedBlocks, known: dict[str, Strategy], limits: FeedLimits, chosen: Schedule
) -> dict[str, Schedule]:
    """Of every strategy; all but the one asked for with their automatic reference."""
    plans: dict[str, Schedule] = {}
    for name, strategy in known.items():
        with suppress(FeedError):  # a block without a feed: nothing to compare with
            mine = name == feed.strategy
            plans[name] = chosen if mine else plan_feeds(rows, strategy, limits, **feed.division)
    return plans


def compared(
    feed: Feed, rows: FeedBlocks, known: dict[str, Strategy], plans: dict[str, Schedule]
) -> pl.DataFrame:
    """Time, peak and spread of every load, as programmed and by every strategy, as planned.

    Columns strategy, asked_for, reference, unit, judged (planned or simulated), time_s, machine_time_s, inserted, and peak
    and spread of every load. `time_s` is length over feed of all blocks that have a feed; `machine_time_s` counts
    accelerations, limits of the machine, rapids and dwells, and is known of written programs. The spread is the standard
    deviation over the cutting time divided by the mean.
    """
    some = next(iter(plans.values()))
    table = [row_of(feed, PROGRAMMED, None, loads_of(rows, known, rows.feed_mm_min), some.total_old_time_s)]
    for name, schedule in plans.items():
        loads = _loads(rows, known, partial(_at_parts, schedule))
        table.append(row_of(feed, name, schedule, loads, schedule.total_time_s))
    return pl.DataFrame(table, infer_schema_length=None)


def row_of(
    feed: Feed,
    name: str,
    schedule: Schedule | None,
    loads: Loads,
    seconds: float,
    *,
    machine_s: float | None = None,
    judged: str = "planned",
) -> dict[str, object]:
    """One row of the comparison, see `compared`."""
    row: dict[str, object] = {
        "strategy": name, "asked_for": name == feed.strategy, "reference": None if schedule is None else schedule.reference,
        "unit": None if schedule is None else schedule.unit, "judged": judged, "time_s": seconds, "machine_time_s": machine_s,
        "inserted": 0 if schedule is None else schedule.inserted,
    }  # fmt: skip
    for load, (peak, spread) in loads.items():
        row |= {f"{load}_peak": peak, f"{load}_spread": spread}
    return row


def loads_of(rows: FeedBlocks, known: dict[str, Strategy], feed_mm_min: Floats) -> Loads:
    """All loads at (n,) feeds of whole blocks."""
    return _loads(rows, known, lambda parts: feed_mm_min[parts.block])


def _loads(rows: FeedBlocks, known: dict[str, Strategy], feeds: Callable[[Parts], Floats]) -> Loads:
    """All loads; feeds : (m,) mm/min of their parts."""
    there = {load: _load(rows, known[load], feeds(known[load].parts)) for load in LOADS if load in known}
    return dict.fromkeys(LOADS, (None, None)) | there


def _at_parts(schedule: Schedule, parts: Parts) -> Floats:
    """(m,) feed of a schedule at the middle of every part."""
    owner = parts.block
    start = np.where(np.diff(owner, prepend=-1) != 0, 0.0, np.concatenate([[0.0], parts.end[:-1]]))
    middle = owner + np.minimum(0.5 * (start + parts.end), 1.0 - 1e-12)
    borders = schedule.sub_block + np.minimum(schedule.sub_end, 1.0 - 1e-13)
    at = np.minimum(np.searchsorted(borders, middle), len(borders) - 1)
    return np.asarray(schedule.sub_feed_mm_min[at])


def _load(rows: FeedBlocks, strategy: Strategy, feed: Floats) -> tuple[float | None, float | None]:
    """Peak and relative spread of a load at (m,) feeds of its parts, over those that cut."""
    parts = strategy.parts
    use = strategy.cuts & (rows.kind[parts.block] != str(Kind.RAPID)) & (feed > 0) & (parts.length > 0)
    if not use.any():
        return None, None
    load = strategy.loads(np.where(use, feed, 0.0))[use]
    time = parts.length[use] / feed[use]
    mean = float((load * time).sum() / time.sum())
    spread = float(np.sqrt(((load - mean) ** 2 * time).sum() / time.sum()))
    return float(load.max()), spread / mean if mean > 0 else 0.0


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
    n, division = len(rows), {"rule": feed.rule, **feed.division}
    tables = [_table(None, False, chosen, strategy, np.arange(n), np.ones(n), rows.feed_mm_min)]
    plans = [
        plan_feeds(rows, strategy, limits, reference=goal, **division)
        for goal in sorted(set(feed.references))
    ]
    for goal, plan in (*zip(sorted(set(feed.references)), plans, strict=True), (chosen.reference, chosen)):
        sub = plan.sub_block, plan.sub_end, plan.sub_feed_mm_min
        tables.append(_table(goal, plan is chosen, plan, strategy, *sub))
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
