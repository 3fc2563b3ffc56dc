"""The page over all jobs of a batch: failures first, totals, and a row per job with the way to its report."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import polars as pl

from vmachining.interval import Interval
from vmachining.job.files import write_atomic
from vmachining.report.numbers import card, chip, duration, number, percent, plural
from vmachining.report.page import rendered

GOOD = ("done", "skipped")
HEADS = (
    ("count", "blocks"), ("volume", "removed mm³"), ("bracket", "between"), ("", "±"), ("seconds", "time"),
    ("seconds", "scheduled"), ("", "change"), ("", "feed mm/min"), ("", "scheduled"), ("warnings", "warnings"),
)  # fmt: skip
"""Of the table of complete jobs: what its column sums up to, and its head."""

SCHEDULE = (5, 6, 8)
"""Columns that only jobs with a schedule have."""

BINS, SPARK = 48, (96.0, 22.0)
"""Of the small curve of a job, and its size."""


def write_index(rows: Sequence[Mapping[str, Any]], path: Path, ledger: Mapping[str, Any]) -> None:
    """Write the page of a batch, whole or not at all.

    rows : of batch.csv. path : of the page, in the directory of the batch. ledger : batch.json.
    """
    good = [row for row in rows if row["status"] in GOOD]
    bad = sorted(
        (row for row in rows if row["status"] not in GOOD or row["exit_code"]),
        key=lambda row: row["status"] == "interrupted",
    )
    largest = max((row["removed_mm3"] for row in good), default=0.0)
    scheduled = any(row["scheduled_time_s"] is not None for row in good)
    shown = [k for k in range(len(HEADS)) if scheduled or k not in SCHEDULE]
    problems = [{
        "name": row["name"] or Path(row["job"]).stem, "job": row["job"], "status": row["status"],
        "kind": "warn" if row["status"] == "interrupted" else "bad", "message": row["message"],
        "report": _link(row, "report.html"), "rows": _link(row, "blocks.partial.csv"),
    } for row in bad]  # fmt: skip
    page = rendered(
        "batch.html.j2", None, script="batch.js", name=path.absolute().parent.name,
        subtitle=f"{plural(len(rows), 'job')} · all volumes in mm³", chips=_chips(rows, ledger),
        cards=_cards(good, len(rows)), bad=problems, jobs=[_job(row, largest, shown) for row in good],
        heads=[HEADS[k] for k in shown], command=shlex.join(ledger["command"]), started=ledger["started"],
        ended=ledger["ended"], versions=", ".join(f"{name} {version}" for name, version in ledger["versions"].items()),
    )  # fmt: skip
    write_atomic(path, page)


def _chips(rows: Sequence[Mapping[str, Any]], ledger: Mapping[str, Any]) -> list[dict[str, str]]:
    """How the jobs ended, in words; what needs somebody comes first."""
    count = {word: sum(row["status"] == word for row in rows) for word in ("failed", "interrupted", *GOOD)}
    disputed = sum(row["exit_code"] == 1 for row in rows)
    chips = [
        chip("bad", f"{count['failed']} failed"),
        chip("bad", f"{plural(disputed, 'job')} with disputed blocks"),
        chip("warn", f"{count['interrupted']} interrupted or not started"),
        chip("ok", f"{count['done']} done"),
        chip("", f"{count['skipped']} complete before"),
    ]
    shown = [chip for chip in chips if chip["text"][:2] != "0 "]
    if ledger["ended"] is None:
        shown.append(chip("warn", "this batch is still running, or was killed"))
    return shown


def _cards(good: Sequence[Mapping[str, Any]], total: int) -> list[dict[str, str]]:
    def summed(name: str, rows: Sequence[Mapping[str, Any]] = good) -> float:
        return float(sum(row[name] for row in rows))

    cards = [card("Jobs complete", f"{len(good)}", f"of {total}", f"{number(summed('blocks'))} blocks")]
    if not good:
        return cards
    lo, removed, hi = (summed(name) for name in ("removed_lo_mm3", "removed_mm3", "removed_hi_mm3"))
    error = Interval(lo, removed, hi).error
    share = f" (±{100 * error / removed:.2g}\u00a0%)" if removed > 0 else ""
    cards.append(card("Removed volume", number(removed), "mm³", f"{number(lo, 7)} … {number(hi, 7)}{share}"))
    scheduled = [row for row in good if row["scheduled_time_s"] is not None]
    before, after = summed("time_s", scheduled), summed("scheduled_time_s", scheduled)
    cards.append(card("Machining time", *duration(summed("time_s")), "of all complete jobs"))
    if scheduled:
        jobs = f"{plural(len(scheduled), 'job')} with a schedule"
        less = f"{percent(before, after)} from {' '.join(duration(before, after))}, {jobs}"
        cards.append(card("Scheduled time", *duration(after, before), less))
    warned = plural(sum(row["warnings"] > 0 for row in good), "job")
    cards.append(card("Warnings", number(summed("warnings")), "", f"in {warned}"))
    peak = f"sum of all; peak of a job {max(row['peak_mb'] for row in good):.0f} MB"
    return [*cards, card("Computed in", *duration(summed("seconds")), peak)]


def _link(row: Mapping[str, Any], file: str) -> str:
    """Where a file of a job is, seen from the page; empty if it is not there."""
    if row["out"] is None or not (Path(row["out"]) / file).is_file():
        return ""
    return quote(f"{Path(row['out']).name}/{file}")


@lru_cache(maxsize=4096)
def _spark(table: Path, _changed: int) -> tuple[str, str]:
    """Removal rate of a job over its time as the path of a small curve, and its largest value."""
    rows = pl.read_parquet(table, columns=["time_s", "mrr_mm3_min"]).fill_null(0.0).fill_nan(0.0)
    time, rate = (rows[name].to_numpy() for name in rows.columns)
    ends = np.cumsum(time)
    if not len(rows) or not ends[-1] > 0.0 or not rate.max() > 0.0:
        return "", ""
    # of every share of the time the largest rate: of blocks that begin in it, and of the one that runs in its middle
    middle = (np.arange(BINS) + 0.5) * ends[-1] / BINS
    high = rate[np.searchsorted(ends, middle).clip(max=len(rate) - 1)]
    np.maximum.at(high, (BINS * (ends - time) / ends[-1]).astype(np.int64).clip(max=BINS - 1), rate)
    wide, tall = SPARK
    x = np.repeat(np.arange(BINS + 1) * wide / BINS, 2)[1:-1]
    y = tall - (tall - 1.0) * np.repeat(high, 2) / rate.max()
    way = "L".join(f"{a:.0f} {b:.1f}" for a, b in zip(x.tolist(), y.tolist(), strict=True))
    return f"M0 {tall:g}L{way}L{wide:g} {tall:g}", number(float(rate.max()), 4)


def _job(row: Mapping[str, Any], largest: float, shown: Sequence[int]) -> dict[str, Any]:
    """A line of the table: (text, value to sort by, upper end) per cell that is shown."""
    removed, lo, hi = row["removed_mm3"], row["removed_lo_mm3"], row["removed_hi_mm3"]
    half = (hi - lo) / 2
    before, after = row["time_s"], row["scheduled_time_s"]
    feed, feed_after = row["mean_feed_mm_min"], row["scheduled_mean_feed_mm_min"]
    cells = [
        (number(row["blocks"]), row["blocks"]), (number(removed, 7), removed), (f"{number(lo, 7)} … {number(hi, 7)}", lo),
        (f"{100 * half / removed:.2g}\u00a0%" if removed > 0 else "–", half / removed if removed > 0 else 0),
        (" ".join(duration(before, after)), before), (" ".join(duration(after, before)), -1 if after is None else after),
        (percent(before, after) if after is not None else "–", 0 if after is None else after - before),
        (number(feed, 4), feed or 0), (number(feed_after, 4), feed_after or 0), (number(row["warnings"]), row["warnings"]),
    ]  # fmt: skip
    spark, peak, table = "", "", Path(row["out"]) / "blocks.parquet"
    with suppress(OSError, pl.exceptions.PolarsError):
        spark, peak = _spark(table, table.stat().st_mtime_ns)
    return {
        "name": row["name"], "job": row["job"], "report": _link(row, "report.html"), "spark": spark, "peak": peak,
        "folder": Path(row["out"]).name, "table": _link(row, "blocks.csv") or _link(row, "blocks.parquet"),
        "cells": [(*cells[k], hi if HEADS[k][0] == "bracket" else None) for k in shown],
        "bar": 100 * removed / largest if largest > 0 else 0.0,
    }  # fmt: skip
