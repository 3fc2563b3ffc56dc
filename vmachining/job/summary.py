"""`run_summary`: what summary.json says of a run, totals with their brackets first; what a user has to know beside its numbers:
warnings of the program by line, and of the job at once."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from vmachining.errors import JobError
from vmachining.job.brep import JUDGED
from vmachining.job.jobfile import Job
from vmachining.job.result import RunResult
from vmachining.job.schedule import kept_words
from vmachining.job.timing import MoveTimes, machine_limits, times_summary
from vmachining.job.toolpath import Lines, Toolpath
from vmachining.job.total import Total
from vmachining.machine import described
from vmachining.nc import Program
from vmachining.stock import BoxStock, StepStock, Stock
from vmachining.textfile import read_text

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
    total: Total,
    times: MoveTimes,
    after: MoveTimes | None,
    options: Mapping[str, Any],
    *,
    chord_given: bool,
) -> dict[str, Any]:
    """The keys of summary.json.

    result : without a summary. stock : raw. total : of all blocks. times, after : of the program and of the one with
    scheduled feeds.
    options : of the run, as in its manifest. chord_given : for this run, and not by the job alone.
    """
    rows = result.blocks.select(
        "removed_mm3", "removed_lo_mm3", "removed_hi_mm3", "warning", "engine", "proven"
    )
    removed, final = total.removed, total.final
    summary: dict[str, Any] = {
        "blocks": len(rows), "removed_mm3": removed.estimate, "removed_lo_mm3": removed.lo, "removed_hi_mm3": removed.hi,
        "proven": removed.proven, "stated_blocks": int((~rows["proven"]).sum()),
        "stock_mm3": result.stock.stock_volume.estimate, "final_mm3": final.estimate, "final_lo_mm3": final.lo,
        "final_hi_mm3": final.hi, "time_s": float(times.seconds.sum()),
        "scheduled_time_s": None if after is None else float(after.seconds.sum()), "ideal_time_s": float(times.ideal_s.sum()),
        "scheduled_ideal_time_s": None if after is None else float(after.ideal_s.sum()),
        "times": times_summary(result.toolpath, times, machine_limits(result.job), after), "brackets": result.stock.proof,
        "brep": dict(NO_BREP), "warnings": int(rows["warning"].count()) + len(result.findings), "seconds": 0.0,
        "peak_mb": 0.0,
    }  # fmt: skip
    summary["notes"] = job_notes(stock, options["chord_mm"])
    summary["guesses"] = guesses(result.job)
    if total.note is not None:
        summary["notes"].append(total.note)
    if result.stock.name != "dexel" and options.get("spacing_mm") is not None:
        summary["notes"].append(SPACING_UNUSED)
    if result.stock.name == "columns":
        wide, asked, floor = (
            rows["removed_hi_mm3"] - rows["removed_lo_mm3"],
            options["width"],
            options["width_mm3"],
        )
        by_columns = rows["engine"] == "columns"
        missed = by_columns & (wide > floor) & (wide > asked * (1.0 + 1e-9) * rows["removed_mm3"])
        summary |= {
            "width": asked, "width_mm3": floor, "wider_blocks": int(missed.sum()),
            "blocks_by_mesh": int((~by_columns).sum()),
        }  # fmt: skip
        if chord_given and summary["blocks_by_mesh"] == 0 and isinstance(stock, BoxStock):
            summary["notes"].append(CHORD_UNUSED)
    if isinstance(stock, StepStock):
        summary |= {"stock_step_mm3": stock.exact_mm3, "stock_slack_mm3": slack_of(stock)}
    if (report := result.schedule) is not None:
        summary |= {"unsplit_lines": list(report.unsplit), "untouched_lines": list(report.untouched)}
        summary["schedule"] = {
            "strategy": report.strategy, "reference": report.reference, "unit": report.unit,
            "reference_from": report.reference_from, "largest_block_mm3_min": report.largest_block_mm3_min,
            "passed": [{"block": p.block, "line": p.line, "load": p.load, "share": p.share} for p in report.passed],
        }  # fmt: skip
        kept = kept_words(report.passed, report.unit) if report.passed else None
        if told := [text for text in (report.note, kept) if text is not None]:
            summary["schedule"]["note"] = "; ".join(told)
        if report.strategy == "volume":
            summary["schedule"]["reference_mm3_min"] = report.reference
    if result.job.machine is not None:
        summary["machine"] = described(result.job.machine)
    return summary


def slack_of(stock: Stock) -> float:
    """mm^3 between a STEP stock and its triangles; 0 for the others."""
    return stock.slack_mm3 if isinstance(stock, StepStock) else 0.0


def guesses(job: Job) -> list[str]:
    """Lines of a drafted job file that nobody has confirmed, each with its reason."""
    source = job.inputs.get("job")
    if source is None:
        return []
    text = read_text(source, "job file", JobError)
    found = re.findall(r"^(?![ \t]*#)(.*?)[ ]+# GUESS: (.*)$", text, re.MULTILINE)
    return [f"{line.strip()}: {why}" for line, why in found]


def job_notes(stock: Stock, chord: float) -> list[str]:
    """What must be known of all numbers at once."""
    if (slack := slack_of(stock)) <= 0.0:
        return []
    return [
        f"curved faces of the STEP stock are triangulated within {chord:g} mm: any removed volume can be off by up "
        f"to {slack:.3g} mm3; the totals include that, the brackets of single blocks do not"
    ]


def notes_of(program: Program) -> dict[int, str]:
    """Warnings of the program by line."""
    notes: dict[int, str] = {}
    for finding in program.findings:
        if finding.severity == "W":
            text = f"{finding.code} {finding.message}".strip()
            notes[finding.line] = f"{notes[finding.line]}; {text}" if finding.line in notes else text
    return notes


def quiet_findings(toolpath: Toolpath) -> list[tuple[int, str, str]]:
    """Warnings on lines that have no row."""
    moving = set(toolpath.blocks.line.tolist())
    lines = Lines(toolpath.program)
    return [
        (line, lines[line].strip(), text)
        for line, text in sorted(notes_of(toolpath.program).items())
        if line not in moving
    ]
