"""What a user has to know of a run beside its numbers: warnings of the program by line, and of the job at once."""

from __future__ import annotations

import re

from vmachining.errors import JobError
from vmachining.job.blocks import program_lines
from vmachining.job.jobfile import Job
from vmachining.job.toolpath import Toolpath
from vmachining.nc import Program
from vmachining.stock import StepStock, Stock
from vmachining.textfile import read_text


def slack_of(stock: Stock) -> float:
    """mm^3 between a STEP stock and its triangles; 0 for the others."""
    return stock.slack_mm3 if isinstance(stock, StepStock) else 0.0


def guesses(job: Job) -> list[str]:
    """Lines of a drafted job file that nobody has confirmed, each with its reason."""
    source = job.inputs.get("job")
    if source is None:
        return []
    found = re.findall(
        r"^(?![ \t]*#)(.*?)[ ]+# GUESS: (.*)$", read_text(source, "job file", JobError), re.MULTILINE
    )
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
    moving = {block.line for block in toolpath.blocks}
    lines = program_lines(toolpath.program)
    return [
        (line, lines[line - 1].strip() if line <= len(lines) else "", text)
        for line, text in sorted(notes_of(toolpath.program).items())
        if line not in moving
    ]
