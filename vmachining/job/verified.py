"""What every feed strategy does to a job, judged on its written program.

1. The schedule of each strategy is written into a program and read back from its bytes: its feeds and times are these.
2. Loads are those of **pieces** of the path that are the same for all. Where no strategy divides a block, feeds change no
   motion, which is checked, and the pieces are the blocks as they were simulated. Else a program divided at every place
   where any of them divides is written, read back, cut in fresh stock, and the contact along it found: one simulation for
   all, and as programmed is judged on the same pieces.
3. The feed of a program on a piece is the one of the block that holds it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import polars as pl

from vmachining.arrays import Floats, Ints
from vmachining.errors import FeedError
from vmachining.feed import Schedule
from vmachining.job.files import PROGRAM_SUFFIX, write_atomic
from vmachining.job.folder import ResultFolder
from vmachining.job.jobfile import Job
from vmachining.job.model import Feed
from vmachining.job.paths import end_axis
from vmachining.job.reading import read_job_program
from vmachining.job.stations import Stations
from vmachining.job.strategies import PROGRAMMED, Planned, loads_of, row_of, strategies
from vmachining.job.timing import MoveTimes, machine_limits, move_times
from vmachining.job.toolpath import Block, Toolpath
from vmachining.nc import Motion, Program

if TYPE_CHECKING:
    from vmachining.nc import BlockEdit, Rewritten

THERE = np.array([0.0, 0.4, 1.0])
"""Shares of a motion at which two are compared."""

OVERLAP = 0.01
"""Share of a piece that another block's feed may reach into: ends of both are rounded alike, but arcs are written anew."""


class _Driven(NamedTuple):
    """Blocks of a program along those of the original.

    end : (m,) number of the original block plus the share of it that is done. length : (m,) mm. feed : (m,) mm/min, NaN
    where none exists.
    """

    end: Floats
    length: Floats
    feed: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Written:
    """A program with new feeds. text : as written; toolpath : as read back; times : of its moves."""

    text: Rewritten
    toolpath: Toolpath
    times: MoveTimes

    def owners(self, blocks: Sequence[Block]) -> Ints:
        return owners(self.text, [block.line for block in self.toolpath.blocks], blocks)


Simulate = Callable[[], tuple[Written, pl.DataFrame, Stations]]
"""The divided program, columns length_mm, removed_mm3, removed_hi_mm3 of its blocks, and its contact."""


def owners(written: Rewritten, lines: Sequence[int], blocks: Sequence[Block]) -> Ints:
    """(m,) block of the original that every block of the rewritten program, by its line, came from.

    Raises FeedError: The written program does not run through the original blocks: a bug, never a user's fault.
    """
    source = [written.source_line[line - 1] for line in lines]
    groups = [(line, len(list(members))) for line, members in groupby(source)]
    if [line for line, _ in groups] != [block.line for block in blocks]:
        raise FeedError("the written program runs through other blocks than the original")
    return np.repeat(np.arange(len(blocks)), [count for _, count in groups])


def divided_edits(plans: Mapping[str, Schedule]) -> dict[int, BlockEdit]:
    """Divide every block wherever any of the plans does, at its original feed."""
    from vmachining.nc import BlockEdit

    some = next(iter(plans.values())).blocks
    edits = {}
    for k in range(len(some)):
        ends = {1.0}
        for plan in plans.values():
            if plan.scheduled[k]:
                ends |= set(plan.sub_end[plan.sub_offset[k] : plan.sub_offset[k + 1]].tolist())
        if len(ends) > 1:
            line = int(some.line[k])
            edits[line] = BlockEdit(line, (float(some.feed_mm_min[k]),) * len(ends), tuple(sorted(ends)))
    return edits


def scheduled_name(program: Program, stem: str = "scheduled") -> str:
    """Name of a program with new feeds, by what it is written in."""
    return stem + PROGRAM_SUFFIX.get(program.dialect, ".nc")


def write_again(
    job: Job, place: ResultFolder, program: Program, edits: Mapping[int, BlockEdit], name: str
) -> Written:
    """A program with other feeds as a file of a result directory, read back."""
    from vmachining.nc import rewrite_feeds

    text = rewrite_feeds(program, edits)
    with place.making(name):
        write_atomic(place.path / name, text.data)
    again = Toolpath.of(read_job_program(job, place.path / name), job.machine)
    times = move_times(again, machine_limits(job), block_delete=job.keys.program.block_delete)
    return Written(text, again, times)


def verified(
    feed: Feed,
    planned: Planned,
    programs: Mapping[str, Written],
    original: Toolpath,
    times: MoveTimes,
    stations: Stations,
    simulate: Simulate,
) -> pl.DataFrame:
    """The comparison of all strategies, of written programs; columns as in `strategies.compared`.

    programs : by strategy. times, stations : of the original program and its simulation. simulate : the program divided
    for all (`divided_edits`); asked for only if some program divides a block.

    Raises FeedError: A written program runs through other motions than the original: a bug, never a user's fault.
    """
    blocks, rows = original.blocks, planned.rows
    pieces = _driven(original, np.arange(len(blocks)))
    if any(len(program.toolpath.blocks) > len(blocks) for program in programs.values()):
        divided, table, stations = simulate()
        owner = divided.owners(blocks)
        pieces = _driven(divided.toolpath, owner)
        rows = planned.divided(owner, table, rows.line[owner], rows.feed_mm_min[owner])
    else:
        for program in programs.values():
            refuse_other_motions(original, program.toolpath)
    known = strategies(feed.model_copy(update={"insert_blocks": False}), rows, None, stations)

    def row(name: str, driven: _Driven, took: MoveTimes) -> dict[str, object]:
        loads = loads_of(rows, known, _on_pieces(driven, pieces))
        seconds = float(np.nansum(60.0 * driven.length / driven.feed))
        return row_of(
            feed, name, planned.plans.get(name), loads, seconds, machine_s=float(took.seconds.sum()), judged="simulated"
        )  # fmt: skip

    out = [row(PROGRAMMED, _driven(original, np.arange(len(blocks))), times)]
    for name, program in programs.items():
        out.append(row(name, _driven(program.toolpath, program.owners(blocks)), program.times))
    return pl.DataFrame(out, infer_schema_length=None)


def _driven(toolpath: Toolpath, owner: Ints) -> _Driven:
    """Length and feed of the blocks of a program; of several motions in one line the feed that takes their time."""
    length, feed = np.zeros(len(owner)), np.full(len(owner), np.nan)
    for block in toolpath.blocks:
        minutes = 0.0
        for index in block.moves:
            move, long = toolpath.moves[index], toolpath.paths[index].length
            length[block.number] += long
            if move.motion is not Motion.RAPID and move.feed_mm_min:
                minutes += long / move.feed_mm_min
                feed[block.number] = move.feed_mm_min
        if len(block.moves) > 1 and minutes > 0.0:
            feed[block.number] = length[block.number] / minutes
    total = np.bincount(owner, length)[owner]
    start = np.flatnonzero(np.diff(owner, prepend=-1))
    along = np.cumsum(length)
    along -= np.repeat(along[start] - length[start], np.diff(np.append(start, len(owner))))
    share = np.divide(along, total, out=np.ones(len(owner)), where=total > 0.0)
    share[np.append(start[1:], len(owner)) - 1] = 1.0
    return _Driven(np.asarray(owner + share), length, feed)


def _on_pieces(driven: _Driven, pieces: _Driven) -> Floats:
    """(m,) feed of a program on every piece; the larger of two that share one."""
    start = np.concatenate([[0.0], pieces.end[:-1]])
    margin = OVERLAP * (pieces.end - start)
    first = np.searchsorted(driven.end, start + margin, side="right")
    last = np.searchsorted(driven.end, pieces.end - margin, side="left")
    top = len(driven.end) - 1
    first, last = np.minimum(first, top), np.minimum(last, top)
    feed = np.append(driven.feed, np.nan)
    return np.asarray(np.fmax.reduceat(feed, np.column_stack([first, last + 1]).ravel())[::2])


def refuse_other_motions(one: Toolpath, other: Toolpath) -> None:
    """Both move alike, to the last bit."""
    pairs = zip(one.paths, other.paths, strict=False)
    if len(one.paths) != len(other.paths) or not all(
        type(a) is type(b)
        and (a.position(THERE) == b.position(THERE)).all()
        and (end_axis(a) == end_axis(b)).all()
        for a, b in pairs
    ):
        raise FeedError("the written program runs through other motions than the original")
