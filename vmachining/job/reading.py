"""The program of a job, read with its tools and its machine."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import replace
from pathlib import Path
from typing import Any

from vmachining.errors import NCError
from vmachining.job.jobfile import Job
from vmachining.job.paths import settled
from vmachining.nc import Motion, Program, ToolEntry, read_program

__all__ = ["read_job_program", "refuse_unknown_tools"]

NO_END = frozenset({"E401"})
"""A program without M2 or M30 still cuts what it cuts: the tester reports it, a simulation does not mind."""

IDLE = (Motion.RAPID, Motion.DWELL)


def read_job_program(job: Job, path: Path | None = None) -> Program:
    """A program without errors (`path` instead of the job's own), read with the tools of the job.

    Raises
    ------
    NCError
        It is empty, or has findings of severity E.
    """
    path = path if path is not None else job.program_path
    table = {
        number: ToolEntry(number, 2.0 * tool.profile.max_radius, tool.length)
        for number, tool in job.tools.items()
    }
    keys = job.keys.program
    names = job.machine.names if job.machine is not None else ()
    options: dict[str, Any] = {
        "dialect": keys.dialect, "tools": table, "home": job.home, "block_delete": keys.block_delete,
        "crc_entry": keys.crc_entry, "crc_corner": keys.crc_corner, "taps": keys.taps,
        "dwell": keys.dwell, "max_steps": keys.max_steps,
        "rotary": "".join(letter for letter in "ABC" if letter in names),
    }  # fmt: skip
    # a rewritten program lies elsewhere than the files of its subprograms
    options["subroutines"] = (job.program_path.parent, *(job.folder / name for name in keys.subroutines))
    program = read_program(path, **options)
    if not program.data.strip():
        raise NCError("the program is empty", file=str(path), line=1, remedy="is it the right file?")
    program.require_clean(allow=NO_END)
    only = next(iter(job.tools))
    cutting = (m for m in program.moves if m.motion not in IDLE)
    if len(job.tools) == 1 and all(m.tool in (0, only) for m in cutting):
        # no other T word and one tool in the job: that one is meant
        moves = tuple(move._replace(tool=only) if move.tool == 0 else move for move in program.moves)
        program = replace(program, moves=moves)
    return settled(program, job.machine)


def refuse_unknown_tools(program: Program, tools: Container[int], known: str) -> None:
    """NCError for the first cut with a tool that the job does not have; `known` lists those it has."""
    for move in program.moves:
        if move.motion not in IDLE and move.tool not in tools:
            raise NCError(
                f"cuts with tool {move.tool}, which is not in the tool table (it has {known})",
                file=program.name,
                line=move.line,
                remedy=f"add a [[tools]] table with number = {move.tool}, or correct the T word",
            )
