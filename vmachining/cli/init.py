"""init: a job file from a program."""

from __future__ import annotations

from pathlib import Path

from vmachining.cli.job_commands import Init
from vmachining.cli.main import Code
from vmachining.cli.screen import emit, note
from vmachining.errors import InputError
from vmachining.job.files import write_atomic
from vmachining.job.starter import Draft, draft_job


def init(o: Init) -> int:
    """`vmachining init`. Exit code 0: the job runs as it is, 1: values have to be given first."""
    program = o.program
    target = o.out if o.out is not None else program.with_suffix(".toml")
    printed = str(target) == "-"
    if not printed:
        if target.is_dir():
            raise InputError(f"--out {target}: a directory", remedy="name the file: --out DIR/job.toml")
        if target.exists() and not o.force and not (program.exists() and target.samefile(program)):
            raise InputError(f"{target} exists already", remedy="--out another name, or --force")
        if not target.parent.is_dir():
            raise InputError(f"--out {target}: there is no directory {target.parent}")
    folder = Path() if printed else target.parent
    draft = draft_job(program, folder, o.dialect, units=o.units, library=o.tools, tools=o.tool or ())
    if target.exists() and target.samefile(program):
        raise InputError(f"--out {target}: that is the program itself")
    if not printed:
        write_atomic(target, draft.text)
    if o.as_json:
        emit({
            "job": str(target), "dialect": draft.dialect, "units": draft.units, "tools": list(draft.tools),
            "guesses": list(draft.guesses), "open": list(draft.open), "errors": list(draft.errors), "ask": list(draft.ask),
            "text": draft.text,
        })  # fmt: skip
    elif printed:
        print(draft.text, end="")
    if not o.as_json:
        _print_next_steps(target, program, draft)
    return Code.FINDINGS if draft.open or draft.errors else Code.DONE


def _print_next_steps(target: Path, program: Path, draft: Draft) -> None:
    """What was written, what is guessed, what is missing, what comes next."""
    printed, errors = str(target) == "-", draft.errors
    if not printed:
        note(f"{target}: written")
    for word, texts in (("guess", draft.guesses), ("missing", draft.open), ("program", errors[:3])):
        for text in texts:
            note(f"  {word:<8}  {text}")
    if errors[3:]:
        note(f"  program   and {len(errors) - 3} more: vmachining nc check lists all")
    file = program.with_suffix(".toml").name if printed else str(target)
    begin = f"save the text as {file} in this directory, " if printed else ""
    if draft.open:
        words = f" (or in words: {' '.join(draft.ask)})" if draft.ask else ""
        give = "give what is missing (lines with MUST BE GIVEN)"
        note(f"  next      {begin}{give}, then: vmachining run {file}{words}")
    elif not errors:
        note(f"  next      {begin}look at the guesses, then: vmachining run {file}")
