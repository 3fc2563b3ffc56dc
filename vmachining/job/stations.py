"""Loads at places along the blocks of a program, as schedulers take them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engagement.along import Sweeps
from vmachining.job.table import CONTACT, read_partial

LEFT_OUT = "contact columns are empty: they were left out (`vmachining contact` computes them)"

NO_CONTACT = "contact columns are empty: --engine vectors measures the deviation; [force] or [feed] in the job asks for both"

SAMPLE = 200
"""Blocks of `--contact sample`, spread evenly over those that remove something."""


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
    empty = {name: pl.Series([None] * blocks, dtype=pl.Float64) for name in CONTACT}
    columns = pl.DataFrame(
        {"block": pl.Series(range(blocks), dtype=pl.Int64), **empty, "contact_note": pl.Series([None] * blocks, dtype=pl.String)}
    )  # fmt: skip
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
