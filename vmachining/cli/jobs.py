"""init, run, measure, merge, check and contact."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vmachining.cli.job_commands import CheckResult, Contact, Init, Measure, Merge, Run, RunOptions
from vmachining.cli.main import Code
from vmachining.cli.options import belong
from vmachining.cli.screen import emit, note
from vmachining.cli.stop import Watch, stoppable
from vmachining.errors import InputError
from vmachining.job import Job, RunResult, check_formats, run
from vmachining.job.batch import safe_name
from vmachining.job.batch.one import ACCURACY, with_accuracy
from vmachining.job.brep import blank, disputes, parse_blocks, parse_brep, refuse_beyond
from vmachining.job.files import read_manifest, write_atomic
from vmachining.job.folder import FolderLock, ResultFolder
from vmachining.job.given import refuse_contact
from vmachining.job.parts import Parts, parse_part, read_parts
from vmachining.job.reading import read_job_program
from vmachining.job.run import run_part
from vmachining.job.store import PARTS, finished, why_anew
from vmachining.job.toolpath import Toolpath
from vmachining.progress import Progress
from vmachining.textfile import parse_toml, read_text
from vmachining.tolerance import BREP_SECONDS

if TYPE_CHECKING:
    from vmachining.job import Draft

TYPES = "TYPE is flat, ball, bull, drill, chamfer or taper; mm, or 1/2in"
"""What stands after an option that asks for the shape of a tool."""

FEW = 10
"""Disputed blocks on the terminal; the table has them all."""

NAMED, NOT_NAMED = {"spacing": "spacing_mm"}, ("width", "chord", "workers", "scheduler", "part")
"""Options that a manifest calls otherwise, and those that a complete result is not asked by."""


def job_of(file: Path, *, tools: Path | None, units: str, quiet: bool, given: Sequence[str] = ()) -> Path:
    """The job file that is meant: itself, or of a program the one next to it, which is drafted where none exists.

    A draft that nobody has edited is written again where it is open, or where options come in addition: those that it was made
    with hold on. given : tools as of `--tool`.

    Raises InputError: Values that the draft leaves open, or options of a draft beside a job file.
    """
    asked = tools is not None or bool(units) or bool(given)
    is_job = file.suffix.lower() == ".toml" or not file.is_file()
    if not is_job:  # a file with another suffix may hold a job anyway
        with file.open("rb") as lines:
            is_job = any(line.lstrip().startswith((b"[program]", b"[[tools]]")) for line in islice(lines, 60))
    if is_job:
        if asked:
            raise InputError(
                "--tools, --tool and --units belong to a program", remedy="write them into the job file"
            )
        return file
    from vmachining.job.asked import made_with

    target = file.with_suffix(".toml")
    words: list[str] | None = []
    if target.exists():
        program = _program_of(target)
        if program is not None and not (program.exists() and program.samefile(file)):
            raise InputError(
                f"{target} is the job of another program, {program}",
                remedy=f"vmachining init {file} --out JOB.toml, then vmachining run JOB.toml",
            )
        words = made_with(target)
        if words is None and asked:
            raise InputError(
                f"{target} exists already, and has been edited: --tools, --tool and --units would change it",
                remedy=f"write them into it, then vmachining run {target}; or remove it",
            )
        if words is None or not (asked or "# MUST BE GIVEN:" in target.read_text(encoding="utf-8")):
            note(f"{target} is the job of {file.name}: it is run", quiet=quiet)
            return target
    draft = draft_again(file, target, words or [], tools=tools, units=units, given=given)
    write_atomic(target, draft.text)
    note("\n".join(f"  guess     {text}" for text in draft.guesses), quiet=quiet or not draft.guesses)
    if draft.open:
        what = "; ".join((*draft.open, *draft.errors[:2]))
        raise InputError(f"{file}: {what}", remedy=remedy_of(draft, file, target))
    return target


def _program_of(target: Path) -> Path | None:
    """The program of a job file, which may have open values; None of another file, which loading refuses."""
    try:
        table = parse_toml(read_text(target, "job file", InputError)).get("program")
    except (InputError, ValueError):
        return None
    name = table.get("file") if isinstance(table, dict) else None
    return target.parent / name if isinstance(name, str) else None


def draft_again(
    file: Path, target: Path, words: Sequence[str], *, tools: Path | None, units: str, given: Sequence[str]
) -> Draft:
    """The draft of a program with options added to those it was made with; a later option replaces an earlier one."""
    from vmachining.job import draft_job

    before: dict[str, list[str]] = {}
    for name, value in zip(words[::2], words[1::2], strict=False):
        before.setdefault(name, []).append(value)
    held = {text.partition("=")[0].strip(): text for text in before.get("--tool", ())}
    for text in given:
        held.pop(text.partition("=")[0].strip(), None)
    first = {name: values[0] for name, values in before.items()}
    if tools is None and "--tools" in first:  # as seen from the job
        tools = target.parent / first["--tools"]
    return draft_job(
        file, target.parent, first.get("--dialect"), library=tools, units=units or first.get("--units", ""),
        tools=(*held.values(), *given),
    )  # fmt: skip


def remedy_of(draft: Draft, program: Path, target: Path) -> str:
    """How what a draft leaves open is given: in the words of a command line, by a library, in the file."""
    library = " or ".join(shlex.quote(name) for name in draft.beside) or "LIBRARY"
    ways = [f"--tools {library}", f"the lines with MUST BE GIVEN in {target}, then vmachining run {target}"]
    if draft.ask:
        kinds = f" ({TYPES})" if any("=TYPE:" in word for word in draft.ask) else ""
        ways.insert(0, f"{shlex.join(['vmachining', 'run', str(program)])} {' '.join(draft.ask)}{kinds}")
    return "; or ".join(ways)


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
    from vmachining.job import draft_job

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


def run_(o: Run) -> int:
    given = o.options
    if given.scheduler is not None and (given.workers, given.part) != (None, None):
        raise InputError(
            "--scheduler has the workers of a cluster do all parts; --workers and --part are of this machine",
            remedy="give one of them",
        )
    if given.part is not None:
        belong(given, ("stock",), "belongs to merge: a part does not have the finished stock")
        belong(given, ("stock_at",), "needs the whole workpiece, which a part does not have")
    job = job_of(o.job, tools=o.tools, units=o.units, given=o.tool or (), quiet=o.quiet or o.as_json)
    return run_job(job, given, out=o.out, resume=o.resume, quiet=o.quiet, as_json=o.as_json, force=o.force)


def run_job(
    file: Path,
    options: RunOptions,
    *,
    out: Path | None = None,
    resume: bool = False,
    quiet: bool = False,
    as_json: bool = False,
    told: Progress | None = None,
    every_strategy: bool = False,
    force: bool = False,
    parts: Parts | None = None,
) -> int:
    """`vmachining run`, or `strategies` with `every_strategy`. told : hears of the progress, too. parts : that are merged."""
    parse_brep(options.brep)
    refuse_contact(options.contact)
    formats = check_formats(options.stock)
    steps = parse_blocks(options.stock_at, "--stock-at") if options.stock_at is not None else ()
    blocks = [block for part in steps for block in part]
    stages = list(PARTS) if options.stages is None else [part.strip() for part in options.stages.split(",")]
    accuracy = {name: getattr(options, name) for name in ACCURACY}
    job = with_accuracy(Job.load(file), **accuracy)
    if steps or "step" in formats:  # said before hours of cutting
        blank(job)
    if steps:
        refuse_beyond(steps, len(Toolpath.of(read_job_program(job), job.machine).blocks) - 1, "--stock-at")
    silent, part = quiet or as_json, None if options.part is None else parse_part(options.part)
    name = safe_name(job.name) + ("" if part is None else f".part-{part.number}-of-{part.of}")
    folder = out if out is not None else Path("out") / name
    if resume:
        asked = options.given() | {"contact": options.contact, "stages": stages}
        asked |= {name: value for name, value in (("stock", formats), ("stock_at", blocks)) if name in asked}
        asked |= {"every_strategy": True} if every_strategy else {}
        wanted = {NAMED.get(name, name): value for name, value in asked.items() if name not in NOT_NAMED}
        if (summary := finished(job, folder, wanted)) is not None:
            note(f"{folder} is already complete", quiet=silent)
            if as_json:
                emit(summary)
            return Code.DONE
        old = ResultFolder(folder).earlier()
        if old is not None and old.get("complete") and (why := why_anew(job, old)):
            note(f"{folder}: {why}; nothing of it is kept, everything is computed again", quiet=silent)
    command = "strategies" if every_strategy else "run"
    again = shlex.join(["vmachining", command, str(file), "--out", str(folder), "--resume", *options.words()])

    def ended(watch: Watch) -> str:
        """What is known of a run that was ended within a block."""
        stage, done, total = watch.place or ("start", 0, 0)
        where = f"block {min(done + 1, total)} of {total} ({stage})" if total else "the start"
        kept = (read_manifest(folder) or {}).get("checkpoints", {})
        points = ", ".join(f"{entry['done']} of {entry['total']} ({name})" for name, entry in kept.items())
        state = (
            f"kept are the blocks up to {points}"
            if points
            else "no checkpoint was due yet, so it starts again"
        )
        return f"ended within {where}, which took too long to finish; {state}: {again}"

    given: dict[str, Any] = {
        "engine": options.engine, "chord": options.chord, "brep": options.brep, "contact": options.contact, "stages": stages,
        "brep_seconds": options.brep_seconds or BREP_SECONDS, "csv": options.csv, "resume": resume, "force": force,
    }  # fmt: skip
    with FolderLock(folder) as lock:
        stopped = f"the rows so far are in {folder}, nothing is lost: {again}"
        with stoppable(ended, lambda: stopped, told, quiet=silent) as progress:
            here: dict[str, Any] = {"progress": progress, "lock": lock}
            if part is not None:
                run_part(job, part, out=folder, workers=options.workers, **given, **here)
                note(f"part {part} is complete in {folder}", quiet=silent)
                if as_json:
                    emit({"part": str(part), "out": str(folder)})
                return Code.DONE
            if options.scheduler is not None:
                from vmachining.job.batch.divided import forget_parts, on_cluster

                spread = {
                    name: value for name, value in given.items() if name not in ("resume", "force")
                } | accuracy
                parts = on_cluster(
                    job, folder, options.scheduler, spread, resume=resume, force=force,
                    note=lambda text: note(text, quiet=silent), **here,
                )  # fmt: skip
            result = run(
                job,
                out=folder,
                workers=options.workers,
                every_strategy=every_strategy,
                parts=parts,
                **given,
                **here,
            )
        shows = "show" in stages
        if told is not None:
            told("files", 0, 1)
        written = formats if shows or options.stock != "stl" else ()
        result.write(folder, stock=written, stock_at=blocks, report=shows)
        if options.scheduler is not None:
            forget_parts(folder)
    if as_json:
        emit(result.summary)
    else:
        note(_closing_lines(result, folder), quiet=quiet)
        note("\n".join(told_disputes(result)), quiet=not quiet or not result.summary["brep"]["disputed"])
    counts = result.summary["brep"]
    refused = counts["disputed"] or counts["refused"] or "stock_step_refused" in result.summary
    return Code.FINDINGS if refused else Code.DONE


def measure(o: Measure) -> int:
    """`vmachining measure`: a run by the vectors engine."""
    options = RunOptions(engine="vectors", stock=o.stock)
    return run_job(
        o.job, options, out=o.out, resume=o.resume, quiet=o.quiet, as_json=o.as_json, force=o.force
    )


def merge_(o: Merge) -> int:
    """`vmachining merge`: the result of a run whose parts are complete."""
    parts = read_parts(o.folders)
    before = parts.manifest["options"]
    asked = {name: before[name] for name in ("brep", "brep_seconds", "csv") if name in before}
    file, options = _as_before(o.folders[0], parts.manifest, asked | {"stock": o.stock})
    return run_job(file, options, out=o.out, quiet=o.quiet, as_json=o.as_json, force=o.force, parts=parts)


def add_to_result(o: CheckResult | Contact) -> int:
    """`vmachining check` and `contact`: one more stage of a complete result, with the options that it has."""
    folder = o.result
    if isinstance(o, Contact):
        refuse_contact(o.blocks, "--blocks")
    manifest = ResultFolder(folder).earlier()
    if manifest is None:
        raise InputError(
            "is not a result of a run", file=folder, remedy="give the directory that `run` wrote"
        )
    if (part := manifest["options"].get("part")) is not None:
        remedy = "join all parts with `vmachining merge` and give its result"
        raise InputError(f"is part {part} of a run, and has no finished table", file=folder, remedy=remedy)
    file, options = _as_before(folder, manifest, o.asked())
    return run_job(file, options, out=folder, resume=True, quiet=o.quiet, as_json=o.as_json)


def _as_before(
    folder: Path, manifest: Mapping[str, Any], asked: Mapping[str, Any]
) -> tuple[Path, RunOptions]:
    """Job file and options of what lies in a directory, with what is asked in addition.

    Raises InputError: The job is not there any more, or it, its inputs or this package changed.
    """
    before = manifest["options"]
    file = Path(manifest.get("inputs", {}).get("job", {}).get("file", "")).absolute()
    if not file.is_file():
        raise InputError(
            f"the job file of this result is no longer at {file}", file=folder,
            remedy="vmachining run JOB.toml --resume --out of this directory, with the same options",
        )  # fmt: skip
    job = Job.load(file)
    if why := why_anew(job, manifest):
        remedy = "run the job again; this result stays valid for what its manifest names"
        raise InputError(why, file=folder, remedy=remedy)
    stages = [name for name in PARTS if name in before.get("stages", PARTS)]
    if "contact" in asked:
        stages = [name for name in PARTS if name in {*stages, "contact"}]
    accuracy, given = job.keys.accuracy, {name: value for name, value in asked.items() if value is not None}
    for option, name in (
        ("chord", "chord_mm"),
        ("width", "width"),
        ("spacing", "spacing_mm"),
        ("directions", "directions"),
    ):
        if before[name] != getattr(accuracy, name):
            given[option] = repr(before[name]) if name == "width" else before[name]
    given["contact"] = asked.get("contact", before.get("contact", "all"))
    return file, RunOptions(engine=before["engine"], stages=",".join(stages), **given)


def told_disputes(result: RunResult) -> list[str]:
    """What is wrong with one of our engines: blocks whose intervals exclude each other, the first few of them."""
    if not result.summary["brep"]["disputed"]:
        return []
    found = disputes(result.blocks)
    lines = [f"  block {block} (line {line}): {one}, {other}" for block, line, _, one, other in found[:FEW]]
    more = [f"  and {len(found) - FEW} more, see blocks.parquet"] if len(found) > FEW else []
    judge = result.summary.get("second_judge") or {}
    if judge.get("total_agrees") is False:
        total = f"{judge['total_lo_mm3']:.9g} to {judge['total_hi_mm3']:.9g} mm3"
        more.append(f"  all blocks together: {total} by a second engine")
    head = "DISPUTED: two of our engines exclude each other, one of them is wrong; please report it"
    return [head, *lines, *more]


def _closing_lines(result: RunResult, folder: Path) -> str:
    s = result.summary
    facts = result.facts
    if (schedule := result.schedule) is not None and schedule.note:
        facts.append(("schedule", schedule.note))
    if left := len(s.get("unsplit_lines", ())) + len(s.get("untouched_lines", ())):
        facts.append(("schedule", f"{left} lines could not get the planned feed, see the warnings"))
    told = (f"  {name:<8}  {words}" for name, words in [*facts, ("files", str(folder))])
    return "\n".join(
        [*told_disputes(result), f"{result.job.name}: {s['blocks']} blocks in {s['seconds']:.1f} s", *told]
    )
