"""The page over all jobs of a batch: failures first, totals, and a row per job with the way to its report."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path
from typing import Any
from urllib.parse import quote

import jinja2

from vmachining.geometry import Bracket
from vmachining.job.files import write_atomic
from vmachining.report.numbers import duration, number, percent, plural, trusted

__all__ = ["write_index"]

GOOD = ("done", "skipped")


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
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    room = files("vmachining.report")
    page = environment.from_string((room / "batch.html.j2").read_text(encoding="utf-8")).render(
        name=path.absolute().parent.name,
        subtitle=f"{plural(len(rows), 'job')} · all volumes in mm³",
        css=trusted((room / "page.css").read_text(encoding="utf-8")),
        chips=_chips(rows, ledger),
        cards=_cards(good, len(rows)),
        bad=[_problem(row) for row in bad],
        jobs=[_job(row, largest) for row in good],
        scheduled=any(row["scheduled_time_s"] is not None for row in good),
        command=shlex.join(ledger["command"]),
        started=ledger["started"],
        ended=ledger["ended"],
        versions=", ".join(f"{name} {version}" for name, version in ledger["versions"].items()),
    )
    write_atomic(path, page)


def _chips(rows: Sequence[Mapping[str, Any]], ledger: Mapping[str, Any]) -> list[dict[str, str]]:
    """How the jobs ended, in words; what needs somebody comes first."""
    count = {word: sum(row["status"] == word for row in rows) for word in ("failed", "interrupted", *GOOD)}
    disputed = sum(row["exit_code"] == 1 for row in rows)
    chips = [
        {"kind": "bad", "text": f"{count['failed']} failed"},
        {"kind": "bad", "text": f"{plural(disputed, 'job')} with disputed blocks"},
        {"kind": "warn", "text": f"{count['interrupted']} interrupted or not started"},
        {"kind": "ok", "text": f"{count['done']} done"},
        {"kind": "", "text": f"{count['skipped']} complete before"},
    ]
    shown = [chip for chip in chips if chip["text"][:2] != "0 "]
    if ledger["ended"] is None:
        shown.append({"kind": "warn", "text": "this batch goes on, or was killed"})
    return shown


def _cards(good: Sequence[Mapping[str, Any]], total: int) -> list[dict[str, str]]:
    """Sums over the jobs that are complete."""

    def summed(name: str, rows: Sequence[Mapping[str, Any]] = good) -> float:
        return float(sum(row[name] for row in rows))

    cards = [
        {"title": "Jobs complete", "value": f"{len(good)}", "unit": f"of {total}",
         "note": f"{number(summed('blocks'))} blocks"},
    ]  # fmt: skip
    if not good:
        return cards
    lo, removed, hi = (summed(name) for name in ("removed_lo_mm3", "removed_mm3", "removed_hi_mm3"))
    error = Bracket(lo, removed, hi).error
    share = f" (±{100 * error / removed:.2g}\u00a0%)" if removed > 0 else ""
    cards.append(
        {"title": "Removed volume", "value": number(removed), "unit": "mm³",
         "note": f"{number(lo, 7)} … {number(hi, 7)}{share}"}
    )  # fmt: skip
    scheduled = [row for row in good if row["scheduled_time_s"] is not None]
    before, after = summed("time_s", scheduled), summed("scheduled_time_s", scheduled)
    value, unit = duration(summed("time_s"))
    cards.append({"title": "Machining time", "value": value, "unit": unit, "note": "of all complete jobs"})
    if scheduled:
        value, unit = duration(after, before)
        cards.append(
            {"title": "Scheduled time", "value": value, "unit": unit,
             "note": f"{percent(before, after)} from {' '.join(duration(before, after))}, "
             f"{plural(len(scheduled), 'job')} with a schedule"}
        )  # fmt: skip
    cards.append(
        {"title": "Warnings", "value": number(summed("warnings")), "unit": "",
         "note": f"in {plural(sum(row['warnings'] > 0 for row in good), 'job')}"}
    )  # fmt: skip
    value, unit = duration(summed("seconds"))
    peak = max(row["peak_mb"] for row in good)
    cards.append(
        {
            "title": "Computed in",
            "value": value,
            "unit": unit,
            "note": f"sum of all; peak of a job {peak:.0f} MB",
        }
    )
    return cards


def _link(row: Mapping[str, Any], file: str) -> str:
    """Where a file of a job is, seen from the page; empty if it is not there."""
    if row["out"] is None or not (Path(row["out"]) / file).is_file():
        return ""
    return quote(f"{Path(row['out']).name}/{file}")


def _problem(row: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "name": row["name"] or Path(row["job"]).stem, "job": row["job"], "status": row["status"],
        "kind": "warn" if row["status"] == "interrupted" else "bad", "message": row["message"],
        "report": _link(row, "report.html"), "rows": _link(row, "blocks.partial.csv"),
    }  # fmt: skip


def _job(row: Mapping[str, Any], largest: float) -> dict[str, Any]:
    """A line of the table: (text, value to sort by) per cell."""
    removed, lo, hi = row["removed_mm3"], row["removed_lo_mm3"], row["removed_hi_mm3"]
    half = (hi - lo) / 2
    before, after = row["time_s"], row["scheduled_time_s"]
    feed, feed_after = row["mean_feed_mm_min"], row["scheduled_mean_feed_mm_min"]
    cells = [
        (number(row["blocks"]), row["blocks"]),
        (number(removed, 7), removed),
        (f"{number(lo, 7)} … {number(hi, 7)}", lo),
        (f"{100 * half / removed:.2g}\u00a0%" if removed > 0 else "–", half / removed if removed > 0 else 0),
        (" ".join(duration(before, after)), before),
        (" ".join(duration(after, before)), -1 if after is None else after),
        (percent(before, after) if after is not None else "–", 0 if after is None else after - before),
        (number(feed, 4), feed or 0),
        (number(feed_after, 4), feed_after or 0),
        (number(row["warnings"]), row["warnings"]),
    ]
    return {
        "name": row["name"], "job": row["job"], "report": _link(row, "report.html"),
        "folder": Path(row["out"]).name, "status": row["status"], "table": _link(row, "blocks.csv"), "cells": cells,
        "bar": 100 * removed / largest if largest > 0 else 0.0,
    }  # fmt: skip
