"""The motions of a program that cut, as arrays, and loads at places along its blocks, as schedulers take them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np
import polars as pl

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engagement.along import Sweeps
from vmachining.job.paths import Paths
from vmachining.job.table import CONTACT, read_partial
from vmachining.job.toolpath import Toolpath
from vmachining.nc import Motion, Move
from vmachining.tolerance import LENGTH_EPS_MM
from vmachining.tool import Tool

LEFT_OUT = "contact columns are empty: they were left out (`vmachining contact` computes them)"

NO_CONTACT = "contact columns are empty: --engine vectors measures the deviation; [force] or [feed] in the job asks for both"

SAMPLE = 200
"""Blocks of `--contact sample`, spread evenly over those that remove something."""


MOST_MAPPED = 200_000
"""Blocks of a program whose contact the page draws: of a longer one 64 pictures are not worth 400 bytes a block."""


@dataclass(slots=True, eq=False)
class Stations:
    """Loads along the blocks, for schedulers.

    block : (s,) of every station, in program order. area_per_feed : mm^2 per mm/min, NaN where nothing is known of the
    spindle or the teeth. rows : p, q, r of the load in F mm/min (see `ForceStrategy`); first, last : of every station.
    step : (n,) mm between stations of block k, NaN where they are at equal fractions. known : (n,) bool, force known.
    columns : block, the seven columns, note. notes : of the job. sweeps : all motions as contact knows them, None where they
    were not laid out.
    """

    columns: pl.DataFrame
    block: Ints
    area_per_feed: Floats
    rows: Floats
    first: Ints
    last: Ints
    step: Floats
    known: Bools
    notes: tuple[str, ...] = ()
    sweeps: Sweeps | None = None

    def parts(self, *, divided: bool) -> tuple[Ints, Ints]:
        """First and last station of every part, both ends included; a part without stations has last < first.

        divided : one part between two stations, else one part per block.
        """
        n = len(self.columns)
        count = np.bincount(self.block, minlength=n)
        start = np.concatenate([[0], np.cumsum(count)])[:-1]
        if not divided:
            return start, start + count - 1
        counts = np.maximum(count - 1, 1)
        owner = np.repeat(np.arange(n), counts)
        number = np.arange(len(owner)) - (np.cumsum(counts) - counts)[owner]
        first = start[owner] + number
        return first, np.where(count[owner] > 1, first + 1, first + count[owner] - 1)


def no_stations(blocks: int, why: str) -> Stations:
    """Of a job whose contact nobody asked for."""
    kinds = dict.fromkeys(CONTACT, pl.Float64) | {"contact_note": pl.String}
    empty = {name: pl.Series([None] * blocks, dtype=kind) for name, kind in kinds.items()}
    columns = pl.DataFrame({"block": pl.Series(range(blocks), dtype=pl.Int64), **empty})
    none = np.zeros(0, dtype=np.int64)
    return Stations(
        columns, none, np.zeros(0), np.empty((0, 3)), none, none, np.full(blocks, np.nan),
        np.ones(blocks, dtype=np.bool_), (why,),
    )  # fmt: skip


def sampled(rows: Path) -> frozenset[int]:
    """Some of the blocks that remove something, the last one among them. rows : of the run, see `table.RowFile`."""
    table = read_partial(rows, ["block", "removed_hi_mm3"])
    numbers = table.filter(table["removed_hi_mm3"] > 0.0)["block"].to_list()
    count = min(SAMPLE, len(numbers))
    return frozenset(numbers[((k + 1) * len(numbers)) // count - 1] for k in range(count))


class CuttingMotions(NamedTuple):
    """Cutting motions of a program.

    first : (n + 1,) of every block. single : (n,) whether that block has no other motion. block, tool : (m,). move, path : m
    of them. rev_min, scale, per_feed : (m,) of the spindle, of chips at the programmed feed and per mm/min, NaN where one is
    missing.
    """

    first: Ints
    single: Bools
    block: Ints
    tool: Ints
    move: list[Move]
    path: Paths
    rev_min: Floats
    scale: Floats
    per_feed: Floats

    @classmethod
    def of(cls, toolpath: Toolpath, tools: Mapping[int, Tool], rev_min: float | None) -> Self:
        """rev_min : where the program gives none."""
        nan = float("nan")
        steps, blocks = toolpath.moves, toolpath.blocks
        cuts = np.array([
            steps[k].motion is not Motion.RAPID and steps[k].tool in tools for k in blocks.motion.tolist()
        ], dtype=np.bool_)  # fmt: skip
        block, at = blocks.owner[cuts], blocks.motion[cuts]
        moves, paths, length = [steps[k] for k in at.tolist()], toolpath.paths.some(at), toolpath.length[at]
        tool = np.array([m.tool for m in moves], dtype=np.int64)
        feed = np.array([move.feed_mm_min or nan for move in moves])
        lasts = np.array([move.duration_s or nan for move in moves])
        speed = np.array([abs(move.spindle_rpm) or rev_min or nan for move in moves])
        count = np.array([tools[move.tool].flutes or nan for move in moves])
        with np.errstate(divide="ignore", invalid="ignore"):
            per_feed = np.where(length > LENGTH_EPS_MM, 1.0 / (length * count * speed), nan)
            by_feed = per_feed * feed
            scale = np.where(np.isnan(by_feed), 60.0 / lasts / (count * speed), by_feed)
        per_feed[np.isnan(by_feed)] = nan
        single = np.diff(blocks.begin) == 1
        first = np.searchsorted(block, np.arange(len(blocks) + 1))
        return cls(first, single, block, tool, moves, paths, speed, scale, per_feed)
