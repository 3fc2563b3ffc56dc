"""The path of a program to look at: without a job, or while its run is in hand."""

from __future__ import annotations

from pathlib import Path

from vmachining.job import Job
from vmachining.job.files import write_atomic
from vmachining.job.reading import read_job_program
from vmachining.job.toolpath import Toolpath
from vmachining.report.numbers import chip, number, plural
from vmachining.report.page import PLOT_NOTE, rendered
from vmachining.report.payload import path_payload

MAX_FINDINGS = 200
"""Rows of the table; `nc check` prints them all."""


def write_backplot(toolpath: Toolpath, path: Path) -> None:
    """Write one page with the path, the program and the feeds to `path`, whole or not at all."""
    write_atomic(path, _page(toolpath, None))


def live_page(job: Job) -> str:
    """The page of a run in hand: path, program, tools and raw stock; it asks its server for rows and cuts along.

    Raises VMachiningError: Program, tools or stock cannot be used.
    """
    return _page(Toolpath.of(read_job_program(job), job.machine), job)


def _page(toolpath: Toolpath, job: Job | None) -> str:
    program, data = toolpath.program, path_payload(toolpath, job)
    found = [(f.line, f.code, f.word, f.message) for f in program.findings[:MAX_FINDINGS]]
    tools = plural(len({block.tool for block in toolpath.blocks}), "tool")
    errors = len(program.errors)
    note = "Drag to turn, wheel to zoom; click the path to mark its block."
    if data.stride > 1:
        note += f" One motion in {data.stride} is drawn."
    if data.field:
        note += f" {data.played}"
    return rendered(
        "backplot.html.j2", data,
        name=Path(program.name).name if job is None else job.name,
        subtitle=f"{program.dialect} · {plural(len(toolpath.blocks), 'block')} that move · {tools} · all lengths in mm",
        chips=[chip("bad", plural(errors, "error")) if errors else chip("ok", "reads clean"),
               chip("", f"path {number(sum(p.length for p in toolpath.paths), 5)} mm")],
        picture=None, view_note=note, schedule=None, live=job is not None,
        plot_note=PLOT_NOTE,
        findings=found if job is None else [],
    )  # fmt: skip
