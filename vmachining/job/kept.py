"""Whether the written program keeps the reference of its schedule, and what to lower where it does not.

Judged are the blocks of the program that was written, as it was cut: volumes at the upper end of their brackets,
chips and forces at all stations. Where blocks were divided and volumes are limited, every block is measured once more
in parts down to `FINER` of the shortest block, because the load may change within it. Other feeds move nothing, so what
one simulation says of a block holds for every feed: the second program is kept where its smallest feed allows it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.feed import Schedule, floor_feed
from vmachining.job.model import Feed
from vmachining.job.schedule import Passed, sample_count
from vmachining.job.stations import Stations
from vmachining.job.strategies import Planned, strategies
from vmachining.job.table import read_partial
from vmachining.job.toolpath import Block
from vmachining.job.verified import Written

FINER = 0.25
"""Share of the shortest block in which the blocks of a divided program are measured."""

SLACK = 1e-9
"""Relative: a load that passes its reference by less is rounding of the feed in its unit."""


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """passed : worst first. lowered : a schedule that keeps the reference there; None if none is lower."""

    passed: tuple[Passed, ...]
    lowered: Schedule | None


def finer(feed: Feed, length_mm: float) -> int:
    """Parts in which a block of a divided program is measured."""
    return sample_count(feed.model_copy(update={"min_length_mm": FINER * feed.min_length_mm}), length_mm)


def judged(
    feed: Feed,
    planned: Planned,
    written: Written,
    partial: Path,
    stations: Stations,
    original: Sequence[Block],
) -> Judged:
    """Loads of a written program against the references of its schedule.

    partial : rows of its blocks, with their parts where blocks were divided. stations : of its contact.
    original : blocks of the program it was made of.
    """
    schedule = planned.schedule
    table = read_partial(partial, ["length_mm", "removed_mm3", "removed_hi_mm3"])
    owner, blocks = written.owners(original), written.toolpath.blocks
    feeds = np.array([written.toolpath.moves[block.moves[0]].feed_mm_min or np.nan for block in blocks])
    on = schedule.scheduled[owner] & (feeds > 0.0)
    lines = np.array([block.line for block in blocks])
    rows = planned.divided(owner, table, lines, np.where(on, feeds, np.nan))
    measured = feed.insert_blocks and feed.strategy == "volume" and feed.rule == "safe"
    known = strategies(feed.model_copy(update={"insert_blocks": measured}), rows, partial, stations)
    strategy = known[feed.strategy]
    goal = np.array([schedule.references.get(int(g), 0.0) for g in strategy.group])
    part = strategy.parts.block
    bound = on[part] & strategy.cuts & (goal > 0.0)
    load = np.where(bound, strategy.highest_loads(np.where(on, feeds, 0.0)[part]), 0.0)
    over = bound & (load > goal * (1.0 + SLACK))
    goals = np.array([schedule.references.get(int(tool), 0.0) for tool in rows.groups])
    # loads of blocks as their table says them: stations hold them at the angles that matter at the feed of their pass, the table
    # is of the feed that was written; 0 where it has no column of what the strategy holds
    names = {("force", "resultant"): "force_n", ("chip_area", feed.component): "chip_area_mm2"}
    name = names.get((feed.strategy, feed.component))
    tabled = np.zeros(len(blocks)) if name is None else stations.columns[name].fill_null(0.0).to_numpy()
    told = np.where(on & (goals > 0.0), tabled, 0.0) / np.where(goals > 0.0, goals, 1.0)
    above = told > 1.0 + SLACK
    if not (over.any() or above.any()):
        return Judged((), None)
    share, offset = np.where(over, load / np.where(goal > 0.0, goal, 1.0), 0.0), strategy.parts.offset
    worst = np.maximum.reduceat(share, offset[:-1]) if len(offset) > 1 else np.zeros(0)
    worst = np.maximum(worst, np.where(above, told, 0.0))
    asked = np.full(len(blocks), np.inf)
    np.minimum.at(asked, part[over], strategy.feeds(goal)[over])
    np.minimum.at(asked, np.flatnonzero(above), feeds[above] * _share(feed, stations, told, goals)[above])
    order = np.argsort(-worst, kind="stable")[: int((worst > 0.0).sum())]
    loads = worst * goals
    passed = tuple(Passed(int(owner[k]), blocks[k].line, float(loads[k]), float(goals[k])) for k in order)
    return Judged(passed, _lowered(feed, schedule, asked, owner))


def _share(feed: Feed, stations: Stations, told: Floats, goals: Floats) -> Floats:
    """(n,) part of its feed at which a block keeps its goal.

    A force is the length of a vector that is affine in the feed, so it is convex: below the written feed it lies under the
    straight line to what edges alone need, E = sqrt(r) at the station where that is most. A chip area has no such part.
    """
    edge = np.zeros(len(told))
    if feed.strategy == "force" and len(stations.block):
        first, last = stations.first, stations.last
        owner = np.repeat(stations.block, last - first)
        rows = np.concatenate([np.arange(a, b) for a, b in zip(first, last, strict=True)])
        np.maximum.at(edge, owner, np.sqrt(np.maximum(stations.rows[rows, 2], 0.0)))
    edge = np.where(goals > 0.0, edge / np.where(goals > 0.0, goals, 1.0), 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(told > 1.0, np.clip((1.0 - edge) / (told - edge), 0.0, 1.0), 1.0)


def _lowered(feed: Feed, schedule: Schedule, asked: Floats, owner: Ints) -> Schedule | None:
    """The schedule with smaller feeds where (m,) feeds of written blocks ask for them; None if none changes."""
    old = schedule.sub_feed_mm_min
    new = old.copy()
    least = np.maximum(floor_feed(np.minimum(asked, 1e12)), feed.min_mm_min)
    first = np.searchsorted(owner, np.arange(len(schedule.blocks)))
    count = np.bincount(owner, minlength=len(schedule.blocks))
    for k in np.unique(owner[np.isfinite(asked)]).tolist():
        a, b = int(schedule.sub_offset[k]), int(schedule.sub_offset[k + 1])
        mine = least[first[k] : first[k] + count[k]]
        # a block that could not be divided has one feed
        new[a:b] = np.minimum(old[a:b], mine if len(mine) == b - a else mine.min())
    # every run of a line has one feed, and so have blocks that share it
    for shared in (schedule.blocks.line[schedule.sub_block], schedule.run[schedule.sub_block]):
        for value in np.unique(shared[new < old]).tolist():
            same = shared == value
            if len(np.unique(schedule.sub_block[same])) > 1:
                new[same] = new[same].min()
    return replace(schedule, sub_feed_mm_min=new) if (new < old).any() else None
