"""The program of a job, read with its tools and its machine."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from math import isfinite
from pathlib import Path
from typing import Any

from vmachining.errors import NCError
from vmachining.job.jobfile import Job
from vmachining.job.paths import settled
from vmachining.machine import with_axes
from vmachining.nc import Finding, Motion, Program, ToolEntry, read_program

ASKED = ("dialect", "units", "block_delete", "crc_entry", "crc_corner", "taps", "dwell", "max_steps")
"""Keys of [program] that the reader has under the same names."""

NO_END = frozenset({"W401"})
"""A program without M2 or M30 still cuts what it cuts: the tester reports it, a simulation does not mind."""

IDLE = (Motion.RAPID, Motion.DWELL)

TOOL_CALLS = ("iso", "mts", "apt")
"""Dialects whose programs call their tools; a table of poses may leave its column out."""

PLAUSIBLE_MM_MIN = 60_000.0
"""The fastest axes of milling machines, linear motors, reach 60 to 120 m/min, as rapids."""


def read_job_program(job: Job, path: Path | None = None) -> Program:
    """A program without errors (`path` instead of the job's own), read with the tools of the job.

    Raises NCError: It is empty, or has findings of severity E.
    """
    path = path if path is not None else job.program_path
    table = {
        number: ToolEntry(number, 2.0 * tool.profile.max_radius, tool.length, flutes=tool.flutes or 0)
        for number, tool in job.tools.items()
    }
    keys = job.keys.program
    names = job.machine.names if job.machine is not None else ()
    options: dict[str, Any] = {name: getattr(keys, name) for name in ASKED} | {
        "tools": table, "home": job.home, "work_offsets": job.work_offsets,
        "control": None if keys.control is None else keys.control.model_dump(),
        "rotary": "".join(letter for letter in "ABC" if letter in names),
    }  # fmt: skip
    # a rewritten program lies elsewhere than the files of its subprograms
    options["subroutines"] = (job.program_path.parent, *(job.folder / name for name in keys.subroutines))
    program = read_program(path, **options)
    if not program.data.strip():
        raise NCError("the program is empty", file=path, line=1, remedy="is it the right file?")
    _refuse_axes(program, job)
    program.require_clean(allow=NO_END)
    refuse_unread(program)
    only = next(iter(job.tools))
    cutting = (m for m in program.moves if m.motion not in IDLE)
    if len(job.tools) == 1 and all(m.tool in (0, only) for m in cutting):
        # no other T word and one tool in the job: that one is meant
        moves = tuple(move._replace(tool=only) if move.tool == 0 else move for move in program.moves)
        first = next((m.line for m in program.moves if m.motion not in IDLE and m.tool == 0), None)
        if first is not None and program.dialect in TOOL_CALLS:
            text = f"the program calls no tool before this cut: tool {only} is taken, the only one of the job"
            program = _noted(program, first, text, "call it with a T word and M6")
        program = replace(program, moves=moves)
    program = _feeds_noted(job, program)
    return settled(program, job.machine)


def refuse_turning(program: Program) -> None:
    """NCError for a program of a lathe, whose path is read and whose material nothing here removes."""
    if any(item.code == "W380" for item in program.findings):
        what = "a program for turning: its path can be drawn, by vmachining nc plot; turning removes no material here"
        remedy = 'where it is a program for a mill: lathe = "mill" under [program.control], or --control lathe=mill'
        raise NCError(what, file=program.name, remedy=remedy)


def refuse_unread(program: Program) -> None:
    """NCError for a program of a lathe, and for one that calls a program that is missing or whose passes are left out."""
    refuse_turning(program)
    lost = next((item for item in program.findings if item.code in ("W379", "W383")), None)
    if lost is not None:
        raise NCError(
            lost.message, file=program.name, line=lost.line, col=lost.col, word=lost.word or None, remedy=lost.hint
        )  # fmt: skip


def _noted(program: Program, line: int, message: str, hint: str) -> Program:
    """The program with one more warning, which is the job's and has no code of the reader."""
    finding = Finding(line, 1, 0, None, "", "", "W", message, hint)
    return replace(program, findings=(*program.findings, finding))


def _feeds_noted(job: Job, program: Program) -> Program:
    """A feed that no machine reaches, where no limit is given that would bind it, is a warning."""
    keys = job.keys.machine
    joints = job.machine.axes if job.machine is not None else ()
    if keys.max_feed_mm_min or keys.axis_feed_mm_min or any(isfinite(axis.max_speed) for axis in joints):
        return program
    beyond = [m for m in program.moves if m.motion not in IDLE and (m.feed_mm_min or 0.0) > PLAUSIBLE_MM_MIN]
    if not beyond:
        return program
    feed = beyond[0].feed_mm_min
    more = f", as {len(beyond) - 1} more motions do" if len(beyond) > 1 else ""
    text = (
        f"feeds at {feed:g} mm/min{more}, faster than milling machines drive ({PLAUSIBLE_MM_MIN:g} mm/min), and "
        "nothing in [machine] limits it: times and rates are those of this feed"
    )
    return _noted(program, beyond[0].line, text, "give max_feed_mm_min, or correct the F word")


def _refuse_axes(program: Program, job: Job) -> None:
    """Rotary axes in a program whose job names no machine that has them.

    Raises NCError.
    """
    if job.machine is not None:
        return
    # words of the program, or angles of a table of poses
    odd = [f for f in program.errors if f.code == "E209" and f.word and f.word[0].upper() in "ABC"]
    words = [(f.word[0].upper(), f.line, f.col, f.word) for f in odd]
    if (turned := next((move for move in program.moves if move.rotary_deg is not None), None)) is not None:
        words += [(letter.upper(), turned.line, 1, "") for letter in turned.rotary_deg or ()]
    letters = "".join(sorted({word[0] for word in words}))
    if letters:
        known, (_, line, col, word) = with_axes(letters), min(words, key=lambda word: word[1:])
        what = f"the program turns {' and '.join(letters)}, but the job names no machine that has"
        others = f"another with these axes: {', '.join(known[1:])}; or file, a machine file"
        raise NCError(
            f"{what} {'them' if len(letters) > 1 else 'it'}", file=program.name, line=line, col=col, word=word or None,
            remedy=f'add [machine] with chain = "{known[0]}" or {others}',
        )  # fmt: skip


def refuse_unknown_tools(program: Program, tools: Collection[int]) -> None:
    """NCError for the first cut with a tool that is not among those of the job."""
    known = ", ".join(map(str, sorted(tools)))
    for move in program.moves:
        if move.motion not in IDLE and move.tool not in tools:
            what = f"cuts with tool {move.tool}, which is not in the tool table (it has {known})"
            remedy = f"add a [[tools]] table with number = {move.tool}, or correct the T word"
            if not move.tool:  # the one that the spindle holds when the program starts
                what = f"cuts before any tool is called; the tool table has {known}"
                remedy = "call the tool that is in the spindle before this line, such as T1 M6"
            raise NCError(what, file=program.name, line=move.line, remedy=remedy)
