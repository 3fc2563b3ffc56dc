"""`run_summary`: what summary.json says of a run, totals with their brackets first."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from vmachining.job.brep import JUDGED
from vmachining.job.notes import job_notes, slack_of
from vmachining.job.result import RunResult
from vmachining.job.timing import MoveTimes
from vmachining.machine import described
from vmachining.stock import BoxStock, StepStock, Stock

if TYPE_CHECKING:
    import polars as pl

__all__ = ["NO_BREP", "run_summary"]

NO_BREP = {"asked": 0, **dict.fromkeys(JUDGED, 0)}

CHORD_UNUSED = (
    "--chord changed no volume: columns cut all blocks of this box, and have no facets; --width asks for narrower brackets, "
    "--engine mesh for facets"
)

SPACING_UNUSED = (
    "spacing_mm (--spacing) changed nothing: it is of the dexel engine, which --engine dexel asks for"
)


def run_summary(
    result: RunResult,
    stock: Stock,
    times: MoveTimes,
    after: MoveTimes | None,
    options: Mapping[str, Any],
    *,
    chord_given: bool,
) -> dict[str, Any]:
    """The keys of summary.json.

    Parameters
    ----------
    result : without a summary. stock : raw. times, after : of the program and of the one with scheduled feeds.
    options : of the run, as in its manifest. chord_given : for this run, and not by the job alone.
    """
    rows = result.blocks.select("removed_mm3", "removed_lo_mm3", "removed_hi_mm3", "warning", "engine")
    before, final = result.stock.stock_volume, result.stock.volume
    slack = slack_of(stock)
    removed = float(rows["removed_mm3"].sum())
    left = before.estimate - removed
    # two brackets of one number: the sum over the blocks, and stock before minus stock after; they hold its estimate, too
    lo = max(float(rows["removed_lo_mm3"].sum()), before.lo - final.hi)
    hi = min(float(rows["removed_hi_mm3"].sum()), before.hi - final.lo)
    summary: dict[str, Any] = {
        "blocks": len(rows),
        "removed_mm3": removed,
        "removed_lo_mm3": max(0.0, min(lo, removed) - slack),
        "removed_hi_mm3": max(hi, removed) + slack,
        "stock_mm3": before.estimate,
        "final_mm3": left,
        "final_lo_mm3": max(0.0, min(final.lo, left) - slack),
        "final_hi_mm3": max(final.hi, left) + slack,
        "time_s": float(times.seconds.sum()),
        "scheduled_time_s": None if after is None else float(after.seconds.sum()),
        "ideal_time_s": float(times.ideal_s.sum()),
        "scheduled_ideal_time_s": None if after is None else float(after.ideal_s.sum()),
        "brackets": result.stock.proof,
        "brep": dict(NO_BREP),
        "warnings": int(rows["warning"].count()) + len(result.findings),
        "seconds": 0.0,
        "peak_mb": 0.0,
    }
    summary["notes"] = job_notes(stock, options["chord_mm"])
    if result.stock.name != "dexel" and options.get("spacing_mm") is not None:
        summary["notes"].append(SPACING_UNUSED)
    if result.stock.name == "columns":
        summary |= _widths(rows, options)
        if chord_given and summary["blocks_by_mesh"] == 0 and isinstance(stock, BoxStock):
            summary["notes"].append(CHORD_UNUSED)
    if isinstance(stock, StepStock):
        summary |= {"stock_step_mm3": stock.exact_mm3, "stock_slack_mm3": slack}
    if (report := result.schedule) is not None:
        summary |= {"unsplit_lines": list(report.unsplit), "untouched_lines": list(report.untouched)}
        summary["schedule"] = {
            "strategy": report.strategy, "reference": report.reference, "unit": report.unit,
            "reference_from": report.reference_from, "largest_block_mm3_min": report.largest_block_mm3_min,
        }  # fmt: skip
        if report.note is not None:
            summary["schedule"]["note"] = report.note
        if report.strategy == "volume":
            summary["schedule"]["reference_mm3_min"] = report.reference
    if result.job.machine is not None:
        summary["machine"] = described(result.job.machine)
    return summary


def _widths(rows: pl.DataFrame, options: Mapping[str, Any]) -> dict[str, Any]:
    """What was asked of columns, how many blocks are wider, and how many the mesh engine cut."""
    wide = rows["removed_hi_mm3"] - rows["removed_lo_mm3"]
    asked, floor = options["width"], options["width_mm3"]
    by_columns = rows["engine"] == "columns"
    missed = by_columns & (wide > floor) & (wide > asked * (1.0 + 1e-9) * rows["removed_mm3"])
    return {
        "width": asked, "width_mm3": floor, "wider_blocks": int(missed.sum()),
        "blocks_by_mesh": int((~by_columns).sum()),
    }  # fmt: skip
