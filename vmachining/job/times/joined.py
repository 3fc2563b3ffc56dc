"""A log beside what a simulation says of the same blocks: removal rate, force and power against the load of the spindle."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.errors import InputError, JobError
from vmachining.job.files import fingerprints, read_manifest
from vmachining.job.jobfile import Job
from vmachining.job.reading import read_job_program
from vmachining.job.times.compared import Comparison
from vmachining.job.timing import Driven
from vmachining.job.toolpath import Toolpath


def of_result(folder: Path) -> tuple[Job, Driven, pl.DataFrame]:
    """Job, moves and table of blocks of a result directory.

    Raises InputError, JobError: It is not a result, its run has not ended, its job is gone, or the program has changed since.
    """
    manifest, table = read_manifest(folder), folder / "blocks.parquet"
    if manifest is None or not table.is_file() or not manifest.get("complete", False):
        raise InputError(
            "no finished result of `vmachining run`", file=str(folder), remedy="give what run had as --out"
        )
    if not manifest.get("job_file"):
        raise InputError(
            "its job was made in Python and is not on disk",
            file=str(folder),
            remedy="save the job and run it",
        )
    job = Job.load(manifest["job_file"])
    now, then = fingerprints({"program": job.program_path})["program"], manifest["inputs"]["program"]
    if now["sha256"] != then["sha256"]:
        raise JobError(
            "the program has changed since the run", file=str(job.program_path), remedy="run the job again"
        )
    return job, Driven.of(Toolpath.of(read_job_program(job), job.machine)), pl.read_parquet(table)


def join(found: Comparison, blocks: pl.DataFrame) -> pl.DataFrame:
    """The intervals of a log with what was simulated in them.

    Adds to `Comparison.blocks`: blocks, removed_mm3 with _lo_ and _hi_, mrr_mm3_min (over logged time), and force_n, power_w,
    chip_thickness_mm (means over the simulated time, NaN where the run has none), force_max_n.
    """
    rows = found.blocks
    first, last = rows["line"].to_numpy(), rows["until"].to_numpy()
    order = np.argsort(np.where(rows["compared"].to_numpy(), first, np.iinfo(np.int64).max), kind="stable")
    order = order[: int(rows["compared"].sum())]
    line = blocks["line"].to_numpy()
    at = order[np.clip(np.searchsorted(first[order], line, side="right") - 1, 0, len(order) - 1)]
    inside = (line >= first[at]) & (line < last[at])
    at, n = at[inside], len(rows)

    def column(name: str) -> Floats:
        return blocks[name].cast(pl.Float64).fill_null(np.nan).to_numpy()[inside]

    def total(values: Floats) -> Floats:
        return np.bincount(at, np.nan_to_num(values), minlength=n).astype(np.float64)

    def mean(name: str) -> Floats:
        weight = np.where(np.isnan(column(name)), 0.0, column("time_s"))
        with np.errstate(invalid="ignore"):
            return total(weight * column(name)) / total(weight)

    removed = {name: total(column(name)) for name in ("removed_mm3", "removed_lo_mm3", "removed_hi_mm3")}
    most = np.full(n, -np.inf)
    np.maximum.at(most, at, np.nan_to_num(column("force_n"), nan=-np.inf))
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = (
            60.0
            * removed["removed_mm3"]
            / np.where(rows["compared"].to_numpy(), rows["logged_s"].to_numpy(), np.nan)
        )
        means = {name: mean(name) for name in ("force_n", "power_w", "chip_thickness_mm")}
    return rows.with_columns(
        blocks=pl.Series(np.bincount(at, minlength=n)), **{k: pl.Series(v) for k, v in removed.items()},
        mrr_mm3_min=pl.Series(rate), **{k: pl.Series(v) for k, v in means.items()},
        force_max_n=pl.Series(np.where(np.isfinite(most), most, np.nan)),
    )  # fmt: skip
