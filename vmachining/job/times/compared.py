"""Predicted beside logged seconds: whole, per tool, per interval; and a log beside what a simulation says of the same blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.errors import InputError, JobError
from vmachining.job.files import fingerprints, read_manifest
from vmachining.job.jobfile import Job
from vmachining.job.reading import read_job_program
from vmachining.job.times.laid import Laid
from vmachining.job.timing import Driven
from vmachining.job.toolpath import Toolpath
from vmachining.machine import MachineLimits

LONG_S = 1.0
"""Intervals from here on are compared one by one: shorter ones are not resolved by a log of a few entries a second."""


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """blocks : columns line, until, tool, logged_s, predicted_s, moving_s, programmed_mm_min, reachable_mm_min,
    logged_mm_min (mean speeds of intervals without rapids), compared, change, load. left_out : seconds by reason."""

    name: str
    predicted_s: float
    logged_s: float
    ideal_s: float
    tools: list[dict[str, float]]
    blocks: pl.DataFrame
    left_out: dict[str, float]

    @property
    def error(self) -> float:
        """Predicted over logged, less 1."""
        return self.predicted_s / self.logged_s - 1.0 if self.logged_s > 0.0 else float("nan")

    def long_blocks(self) -> Floats:
        """(k,) relative errors of intervals over a second in which nothing is changed."""
        rows = self.blocks.filter(pl.col("compared") & ~pl.col("change") & (pl.col("logged_s") > LONG_S))
        return (rows["predicted_s"] / rows["logged_s"] - 1.0).to_numpy()

    def record(self) -> dict[str, Any]:
        errors = np.abs(self.long_blocks())
        return {
            "log": self.name, "predicted_s": self.predicted_s, "logged_s": self.logged_s, "error": self.error,
            "ideal_s": self.ideal_s, "tools": self.tools, "left_out_s": self.left_out,
            "blocks_over_1_s": {
                "count": len(errors),
                "median_error": float(np.median(errors)) if len(errors) else None,
                "within_10_percent": float((errors <= 0.1).mean()) if len(errors) else None,
            },
        }  # fmt: skip


def compare(laid: Laid, limits: MachineLimits) -> Comparison:
    """Lay predicted times beside logged ones, at the overrides of the log."""
    if not laid.kept.any():
        why = ", ".join(f"{seconds:.0f} s of {name}" for name, seconds in laid.left_out.items())
        raise InputError(f"nothing of this log can be compared: {why or 'no interval'}", file=laid.name)
    moving, times = laid.paths(limits)
    predicted = laid.predicted(limits)
    ideal = laid.by_line(times.ideal_s)
    # of an interval that of the first move from its first line on; before a change already the next one
    lines, moves, kept = laid.driven.lines, laid.driven.toolpath.moves, laid.kept
    order = np.argsort(lines, kind="stable")
    at = order[np.minimum(np.searchsorted(lines[order], laid.first), len(order) - 1)]
    tool = np.array([moves[k].tool for k in at.tolist()], dtype=np.int64)
    tools = []
    for number in dict.fromkeys(tool[kept].tolist()):
        on = kept & (tool == number)
        p, y = float(predicted[on].sum()), float(laid.logged[on].sum())
        tools.append(
            {"tool": number, "predicted_s": p, "logged_s": y, "error": p / y - 1.0 if y > 0.0 else 0.0}
        )
    length, fed = laid.driven.length, ~laid.driven.fast & (laid.driven.length > 0)
    way, change = laid.by_line(np.where(fed, length, 0.0)), laid.events.sum(axis=1) > 0
    way[(laid.by_line(np.where(laid.driven.fast & (length > 0), 1.0, 0.0)) > 0) | change] = np.nan
    at_feed = laid.by_line(np.where(fed, length / np.where(fed, laid.driven.feed * laid.feed, 1.0), 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        speeds = {
            "programmed_mm_min": way / at_feed, "reachable_mm_min": 60.0 * way / moving,
            "logged_mm_min": 60.0 * way / laid.logged,
        }  # fmt: skip
    speeds = {name: np.where(kept & (way > 0.0), v, np.nan) for name, v in speeds.items()}
    blocks = pl.DataFrame(
        {
            "line": laid.first, "until": laid.last, "tool": tool, "logged_s": laid.logged, "predicted_s": predicted,
            "moving_s": moving, **speeds, "compared": kept, "change": change, "load": laid.load,
        }
    )  # fmt: skip
    return Comparison(
        laid.name, float(predicted[kept].sum()), float(laid.logged[kept].sum()), float(ideal[kept].sum()), tools, blocks,
        laid.left_out,
    )  # fmt: skip


def together(found: Sequence[Comparison]) -> dict[str, Any]:
    """For --json: one record, or of several logs their sums, by tool too, and the record of each."""
    records = [one.record() for one in found]
    if len(records) == 1:
        return records[0]
    tools: dict[int, dict[str, float]] = {}
    for tool in (tool for one in found for tool in one.tools):
        total = tools.setdefault(
            int(tool["tool"]), {"tool": tool["tool"], "predicted_s": 0.0, "logged_s": 0.0}
        )
        for key in ("predicted_s", "logged_s"):
            total[key] += tool[key]
    for total in tools.values():
        total["error"] = total["predicted_s"] / total["logged_s"] - 1.0 if total["logged_s"] > 0.0 else 0.0
    predicted, logged = (sum(r[key] for r in records) for key in ("predicted_s", "logged_s"))
    return {
        "predicted_s": predicted, "logged_s": logged, "error": predicted / logged - 1.0, "tools": list(tools.values()),
        "logs": records,
    }  # fmt: skip


def of_result(folder: Path) -> tuple[Job, Driven, pl.DataFrame]:
    """Job, moves and table of blocks of a result directory.

    Raises InputError, JobError: It is not a result, its run has not ended, its job is gone, or the program has changed since.
    """
    manifest, table = read_manifest(folder), folder / "blocks.parquet"
    if manifest is None or not table.is_file() or not manifest.get("complete", False):
        raise InputError(
            "no finished result of `vmachining run`", file=folder, remedy="give what run had as --out"
        )
    if not manifest.get("job_file"):
        what = "its job was made in Python and is not on disk"
        raise InputError(what, file=folder, remedy="save the job and run it")
    job = Job.load(manifest["job_file"])
    now, then = fingerprints({"program": job.program_path})["program"], manifest["inputs"]["program"]
    if now["sha256"] != then["sha256"]:
        what = "the program has changed since the run"
        raise JobError(what, file=job.program_path, remedy="run the job again")
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
        logged = np.where(rows["compared"].to_numpy(), rows["logged_s"].to_numpy(), np.nan)
        rate = 60.0 * removed["removed_mm3"] / logged
        means = {name: mean(name) for name in ("force_n", "power_w", "chip_thickness_mm")}
    return rows.with_columns(
        blocks=pl.Series(np.bincount(at, minlength=n)), **{k: pl.Series(v) for k, v in removed.items()},
        mrr_mm3_min=pl.Series(rate), **{k: pl.Series(v) for k, v in means.items()},
        force_max_n=pl.Series(np.where(np.isfinite(most), most, np.nan)),
    )  # fmt: skip
