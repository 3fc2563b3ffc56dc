"""The result table: one row per NC block that moves, streamed to disk while the simulation runs.

Rows go to `blocks.partial.csv` as they are made and become `blocks.parquet`, and `blocks.csv` of a program that is not
long (`MOST_CSV`), when the last one is there, so memory does not grow with the program and an interrupted run leaves a
readable table. The partial file and the Parquet file have all digits: a row read back is the row that was written, bit
for bit. blocks.csv has `DIGITS` of them, so that what was 0.102 does not read 0.10200000000000001.
"""

from __future__ import annotations

import csv
import hashlib
import os
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.disk import writing
from vmachining.errors import JobError
from vmachining.job.files import atomic_path

BLOCKS: dict[str, tuple[type[pl.DataType], str]] = {
    "block": (pl.Int64, "number of the block, from 0, in program order"),
    "line": (pl.Int64, "line of the program"),
    "text": (pl.String, "that line as it is written"),
    "tool": (pl.Int64, "tool number"),
    "motion": (pl.String, "rapid, linear, arc_cw, arc_ccw or cycle"),
    "x_mm": (pl.Float64, "tool tip at the end of the block, work coordinates"),
    "y_mm": (pl.Float64, "tool tip at the end of the block, work coordinates"),
    "z_mm": (pl.Float64, "tool tip at the end of the block, work coordinates"),
    "i": (pl.Float64, "tool axis at the end of the block, from tip to spindle"),
    "j": (pl.Float64, "tool axis at the end of the block"),
    "k": (pl.Float64, "tool axis at the end of the block"),
    "length_mm": (pl.Float64, "path of the tool tip"),
    "feed_mm_min": (pl.Float64, "programmed feed along the path"),
    "time_s": (pl.Float64, "time of the block within the limits of the machine, dwells included"),
    "removed_mm3": (pl.Float64,
        "estimate of the volume that the cutter removes: with columns the middle of what was found, so the truth is as likely "
        "near an end of the interval; the sum of all blocks lies in the bracket of the total"),
    "removed_lo_mm3": (pl.Float64, "lower end of its interval, a bound where `proven` is true; rapids remove 0 by definition"),
    "removed_hi_mm3": (pl.Float64, "upper end of it"),
    "engine": (pl.String, "engine whose interval this is"),
    "removed_brep_mm3": (pl.Float64, "the same by OCCT booleans of B-rep solids, where asked for and inside the interval"),
    "removed_brep_error_mm3": (pl.Float64, "how far removed_brep_mm3 is from the truth at most"),
    "brep_attempt": (pl.String, "which way of asking OCCT agreed: number and name"),
    "brep_status": (pl.String,
        "agreed (first attempt), retried (later one), refused, disputed (engines exclude each other) or skipped"),
    "removed_dexel_mm3": (pl.Float64, "the same by exact rays, where asked for"),
    "removed_dexel_lo_mm3": (pl.Float64, "lower end of an interval of stated confidence around it, which is not a bound"),
    "removed_dexel_hi_mm3": (pl.Float64, "upper end of that interval"),
    "mrr_mm3_min": (pl.Float64, "material removal rate: removed_mm3 over time_s"),
    "ae_mm": (pl.Float64, "radial depth of what cuts, largest along the block; 0 below 1e-4 mm (a touch), empty in a plunge"),
    "ap_mm": (pl.Float64, "axial depth of what cuts, below what earlier blocks have left, largest along the block"),
    "engaged_fraction": (pl.Float64, "share of a revolution in which an edge is engaged"),
    "chip_area_mm2": (pl.Float64, "largest chip area of one tooth, needs flutes and a spindle speed"),
    "chip_thickness_mm": (pl.Float64, "largest undeformed chip thickness, needs flutes and a spindle speed"),
    "force_n": (pl.Float64, "largest resultant force of all teeth on the tool, needs [force]"),
    "power_w": (pl.Float64, "mean power at the cutter over a revolution, largest along the block, needs [force]"),
    "scheduled_feed_mm_min": (pl.Float64, "feed of the rewritten program, needs [feed]"),
    "scheduled_time_s": (pl.Float64, "time of the block in the rewritten program"),
    "proven": (pl.Boolean,
        "whether both ends of the interval are proven bounds; false: stated, or resting on a step that is not proven"),
    "planned_fraction": (pl.Float64, "share of a revolution with a chip above 1 % of the largest, which plans should rest on"),
    "spindle_rpm": (pl.Float64, "spindle speed at the end of the block: + M3, - M4, 0 stopped"),
    "coolant": (pl.String, "mist, flood, mist and flood, or empty"),
    "warning": (pl.String, "what a machinist should know of this block"),
}  # fmt: skip
"""Every column of `blocks`: its type and what it holds; what this version does not compute stays empty."""

COLUMNS = {name: kind for name, (kind, _) in BLOCKS.items()}
MEANINGS = {name: meaning for name, (_, meaning) in BLOCKS.items()}

OPINION = tuple(name for name in COLUMNS if "brep" in name or "dexel" in name)
"""Columns that other engines than the one that cuts fill in."""

CONTACT = (
    "ae_mm", "ap_mm", "engaged_fraction", "chip_area_mm2", "chip_thickness_mm", "force_n", "power_w",
    "planned_fraction",
)  # fmt: skip
"""Columns of the contact between tool and workpiece."""

MOST_CSV = 100_000
"""Blocks up to which a run writes its table as CSV, too, without being asked."""

NO_CSV = f"tables of more than {MOST_CSV:,} blocks are written as .parquet only; --csv adds the .csv"

ROW_GROUP = 2**17
"""Rows that a reader of Parquet files takes at a time."""

SAMPLES = "samples_mm3"
"""Extra column of the partial file: volumes of the equal parts of a block, for the scheduler."""

SCHEMA: dict[str, Any] = {**COLUMNS, SAMPLES: pl.String}
HEADER = ",".join(SCHEMA) + "\n"

DIGITS = 15
"""Significant digits of a CSV file: every decimal of 15 digits survives the way through a double, and the rest is
some units in the last place, less than the rounding of any sum that made the number."""

EXACT_POWER = 22
"""Ten to this power is the largest one that a double holds exactly."""


def readable(frame: pl.LazyFrame) -> pl.LazyFrame:
    """The table for a CSV file: every float as the decimal number of `DIGITS` digits that is nearest to it."""
    floats = pl.col(pl.Float64)
    return frame.with_columns(floats.map_batches(_rounded, return_dtype=pl.Float64, is_elementwise=True))


def _rounded(column: pl.Series) -> pl.Series:
    values = column.to_numpy().astype(np.float64)
    return pl.Series(column.name, _to_digits(values)).set(column.is_null(), None)


def _to_digits(values: Floats) -> Floats:
    """Nearest doubles to decimals of `DIGITS` digits; what is not finite or smaller than 1e-7 stays as it is.

    v 10^k is an integer below 2^53 once it is rounded, and its quotient by an exact power of ten is rounded once.
    """
    out = values.copy()
    with np.errstate(divide="ignore", invalid="ignore"):
        power = DIGITS - 1 - np.floor(np.log10(np.abs(values)))
        plain = np.isfinite(values) & (np.abs(power) <= EXACT_POWER)
    scale = 10.0 ** np.abs(power[plain])
    up = power[plain] >= 0
    v = values[plain]
    out[plain] = np.where(up, np.rint(v * scale) / scale, np.rint(v / scale) * scale)
    return np.asarray(out + 0.0)  # no negative zeros


class RowFile:
    """Append rows to a partial table. A torn last line (power cut) is dropped when the file is reopened.

    keep, digest : how many rows a checkpoint has, and what `digest` was then: rows after it are made again.

    Raises JobError: The file does not begin with those rows.
    """

    def __init__(self, path: Path, *, keep: int = 0, digest: str | None = None) -> None:
        self.path, self._sum = path, hashlib.sha256()
        if keep:
            self._trim(keep, digest)
        else:
            with writing(path):
                path.write_text(HEADER, encoding="utf-8")
            self._sum.update(HEADER.encode())
        self._file: TextIO = path.open("a", encoding="utf-8", newline="")

    def _trim(self, keep: int, digest: str | None) -> None:
        size = 0
        if self.path.is_file():
            with self.path.open("rb") as file:
                for line in islice(file, keep + 1):
                    self._sum.update(line)
                    size += len(line)
        if self.digest != digest:
            what = f"its first {keep} rows are not as they were when the checkpoint was written"
            raise JobError(what, file=self.path, remedy="run again without --resume")
        os.truncate(self.path, size)

    @property
    def digest(self) -> str:
        """SHA-256 of all that was written."""
        return self._sum.hexdigest()

    def write(self, rows: Mapping[str, Any]) -> None:
        """Some rows, by columns; absent ones stay empty, as NaN does. A row is one line: `_trim` counts them."""
        n = len(rows["block"])
        columns = {name: pl.Series(rows.get(name, [None] * n), dtype=kind) for name, kind in SCHEMA.items()}
        one_line = pl.col(pl.String).str.replace_all(r"[\r\n]+", " ")
        frame = pl.DataFrame(columns).with_columns(pl.col(pl.Float64).fill_nan(None), one_line)
        text = frame.write_csv(include_header=False)
        with writing(self.path):
            self._file.write(text)
        self._sum.update(text.encode())

    def flush(self) -> None:
        with writing(self.path):
            self._file.flush()

    def close(self) -> None:
        with writing(self.path):
            self._file.close()

    def __enter__(self) -> RowFile:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def drop_torn_row(path: Path) -> int:
    """Take off a last row that was not written to its end; how many rows are left."""
    rows, whole = -1, 0  # the first line is the header
    with path.open("rb+") as file:
        for line in file:
            if line.endswith(b"\n"):
                rows, whole = rows + 1, whole + len(line)
        file.truncate(whole)
    return max(rows, 0)


def _lazy(path: Path) -> pl.LazyFrame:
    return pl.scan_csv(path, schema=SCHEMA)


def read_partial(path: Path, columns: Sequence[str] = tuple(COLUMNS)) -> pl.DataFrame:
    return _lazy(path).select(list(columns)).collect()


def refed(path: Path, feed_mm_min: Floats, time_s: Floats) -> pl.DataFrame:
    """Rows of a partial file with other feeds (mm/min, NaN for none) and times of the same motions."""
    feeds = pl.Series("feed_mm_min", feed_mm_min).fill_nan(None)
    rows = read_partial(path).with_columns(feeds, pl.Series("time_s", time_s))
    rate = pl.when(pl.col("time_s") > 0).then(60.0 * pl.col("removed_mm3") / pl.col("time_s"))
    return rows.with_columns(rate.alias("mrr_mm3_min"))


def read_samples(path: Path) -> Iterator[tuple[int, tuple[float, ...]]]:
    """(block, volumes of its equal parts in mm^3) of every block that has some."""
    with path.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            if row[SAMPLES]:
                yield int(row["block"]), tuple(float(v) for v in row[SAMPLES].split())


def _joined(frame: pl.LazyFrame, more: pl.DataFrame, said: str | None) -> pl.LazyFrame:
    """The table with columns of `COLUMNS` in place of its own; said : one that joins the warning, where it is not empty."""
    names = [name for name in more.columns if name in COLUMNS and name != "block"]
    added = more.lazy().select("block", *names, *filter(None, [said]))
    frame = frame.drop(names).join(added, on="block", how="left", maintain_order="left")
    if said is None:
        return frame
    told = pl.when(pl.col(said) != "").then(said)
    both = pl.concat_str("warning", told, separator="; ", ignore_nulls=True)
    return frame.with_columns(pl.when(both != "").then(both).alias("warning")).drop(said)


def finish(
    partial: Path,
    folder: Path,
    stem: str = "blocks",
    scheduled: pl.DataFrame | None = None,
    opinion: pl.DataFrame | None = None,
    contact: pl.DataFrame | None = None,
    estimates: pl.DataFrame | None = None,
    csv: bool = True,
) -> None:
    """Make `stem`.parquet of a partial file, and `stem`.csv where `csv` says so, in streaming fashion.

    scheduled : columns block, scheduled_feed_mm_min, scheduled_time_s to fill in, and note, which joins the
    warning; or None.
    opinion : columns block, those of `OPINION`, and brep_note, which joins the warning; or None.
    contact : columns block, those of `CONTACT`, and contact_note, which joins the warning; or None.
    estimates : columns block, and any of `COLUMNS` that take the place of those in the file; or None.
    """
    frame = _lazy(partial)
    sources = (estimates, None), (contact, "contact_note"), (scheduled, "note"), (opinion, "brep_note")
    for more, said in sources:
        if more is not None:
            frame = _joined(frame, more, said)
    frame = frame.select(list(COLUMNS))
    with atomic_path(folder / f"{stem}.parquet") as temporary:
        frame.sink_parquet(temporary, row_group_size=ROW_GROUP)
    if not csv:
        return
    with atomic_path(folder / f"{stem}.csv") as temporary:
        readable(pl.scan_parquet(folder / f"{stem}.parquet")).sink_csv(temporary)
