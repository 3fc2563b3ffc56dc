"""The commands that simulate jobs: run, check, contact, init, batch, warm, demo."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any

import typer

from vmachining.cli.options import (
    Json,
    Library,
    OneTool,
    Out,
    Quiet,
    Resume,
    Scheduler,
    StockOut,
    Units,
    arg,
    belong,
    command,
    flag,
    opt,
)
from vmachining.errors import InputError

jobs = typer.Typer()

BREP_SECONDS = "Limit of one B-rep check (default: 120)."
ENGINES = (
    "columns, mesh, dexel, rays or vectors (default: columns where they take stock and motions, else mesh)."
)
CHORD = "Mesh: instead of chord_mm of the job, for finer facets and brackets; a note says where it changes nothing."
PROGRAM_OR_JOB = "Job file, or a program: its job is drafted next to it, as init does."


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOptions:
    """Options of `vmachining run` that change what is computed or written, as they were given."""

    engine: Annotated[str | None, opt("NAME", ENGINES)] = None
    width: Annotated[
        str | None, opt("1%", "Columns: width of each block's bracket, instead of that of the job.")
    ] = None
    chord: Annotated[float | None, opt("MM", CHORD)] = None
    spacing: Annotated[float | None, opt("MM", "Dexel: distance of rays (default: half a million rays).")] = (
        None
    )
    directions: Annotated[int | None, opt("1|3", "Dexel: rays along z, or x, y and z.")] = None
    brep: Annotated[str, opt("WHICH", "B-rep checks: none, sample, all or blocks 3,7-12.")] = "none"
    brep_seconds: Annotated[float | None, opt("S", BREP_SECONDS, min=1.0)] = None
    contact: Annotated[str, opt("WHICH", "Blocks with contact and forces: none, sample or all.")] = "all"
    stages: Annotated[
        str | None, opt("NAMES", "Some of cut, contact, plan, judge, show (default: all), e.g. cut,judge.")
    ] = None
    workers: Annotated[
        int | None, opt(None, "Processes that cut (default: the cores, for long programs).", min=1)
    ] = None
    scheduler: Scheduler = None
    part: Annotated[str | None, opt("K/N", "Only part K of N, for `merge`, such as 3/64.")] = None
    stock: StockOut = "stl"
    stock_at: Annotated[str | None, opt("BLOCKS", "Workpiece after blocks 7,12-14: stock_7.step, ...")] = None

    def given(self) -> dict[str, Any]:
        """Those that are not as by default."""
        values = ((field, getattr(self, field.name)) for field in fields(self))
        return {field.name: value for field, value in values if value != field.default}

    def words(self) -> list[str]:
        """The same on a command line."""
        pairs = ((f"--{name.replace('_', '-')}", value) for name, value in self.given().items())
        return [word for name, v in pairs for word in (name, f"{v:g}" if isinstance(v, float) else str(v))]


@command(
    jobs,
    "run",
    shown=(
        "run part.toml",
        "run part.toml --out out/fine --width 0.1% --stock stl,3mf",
        "run part.toml --brep sample --resume",
        "run part.toml --part 3/64",
        "run part.nc --tool 1=flat:10 --tool 3=ball:6",
    ),
)
def run_(
    job: Annotated[Path, arg("JOB.toml|PROGRAM", PROGRAM_OR_JOB)],
    *,
    out: Out = None,
    tools: Library = None,
    tool: OneTool = None,
    units: Units = "",
    options: RunOptions,
    resume: Resume = False,
    force: Annotated[bool, flag("--force", "Replace the result of another job in the directory.")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """Simulate one job: tables, summary, report, finished stock, and the rewritten program with [feed]."""
    from vmachining.cli import jobs

    if options.scheduler is not None and (options.workers, options.part) != (None, None):
        raise InputError(
            "--scheduler has the workers of a cluster do all parts; --workers and --part are of this machine",
            remedy="give one of them",
        )
    if options.part is not None:
        belong(options, ("stock",), "belongs to merge: a part does not have the finished stock")
        belong(options, ("stock_at",), "needs the whole workpiece, which a part does not have")
    job = jobs.job_of(job, tools=tools, units=units, given=tool or (), quiet=quiet or as_json)
    return jobs.run_job(job, options, out=out, resume=resume, quiet=quiet, as_json=as_json, force=force)


@command(jobs, "merge", shown=("merge out/part.part-*-of-4 --out out/part",))
def merge_(
    folders: Annotated[list[Path], arg("DIR...", "Directories that `run --part K/N` wrote.")],
    *,
    out: Out = None,
    stock: StockOut = "stl",
    force: Annotated[bool, flag("--force", "Replace the result of another job in the directory.")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """Join all parts of a run into the result of a single run, with schedule, second opinions and files."""
    from vmachining.cli import jobs

    return jobs.merge_parts(folders, out=out, force=force, stock=stock, quiet=quiet, as_json=as_json)


Result = Annotated[Path, arg("RESULT", "Directory of a complete result.")]


@command(jobs, "check", shown=("check out/part --brep sample", "check out/part --brep 3,7-12"))
def check_(
    result: Result,
    *,
    brep: Annotated[str, opt("WHICH", "sample, all or blocks 3,7-12.")] = "sample",
    brep_seconds: Annotated[float | None, opt("S", BREP_SECONDS, min=1.0)] = None,
    workers: Annotated[int | None, opt(None, "Processes that check.", min=1)] = None,
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """B-rep checks of a finished result; nothing is cut again."""
    from vmachining.cli import jobs

    asked = {"brep": brep, "brep_seconds": brep_seconds, "workers": workers}
    return jobs.add_to_result(result, asked, quiet=quiet, as_json=as_json)


@command(jobs, "contact", shown=("contact out/part", "contact out/part --blocks sample"))
def contact_(
    result: Result,
    *,
    blocks: Annotated[str, opt("WHICH", "sample or all.")] = "all",
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """Add contact, chips and forces to a finished result; nothing is cut again."""
    from vmachining.cli import jobs

    return jobs.add_to_result(result, {"contact": blocks}, quiet=quiet, as_json=as_json)


@command(jobs, "init", shown=("init part.nc", "init part.nc --out jobs/part.toml --force"))
def init_(
    program: Annotated[Path, arg("PROGRAM", "NC program.")],
    *,
    out: Annotated[
        Path | None, opt("JOB.toml", "The file to write; default: next to the program; - prints it.")
    ] = None,
    dialect: Annotated[str | None, opt(None, "Of the program; default: detected and reported.")] = None,
    tools: Library = None,
    tool: OneTool = None,
    units: Units = "",
    force: Annotated[bool, flag("--force", "Overwrite the file.")] = False,
    as_json: Json = False,
) -> int:
    """Write a commented job file from a program: dialect, units, tools and stock as far as the program gives them."""
    from vmachining.cli import init

    return init.init(
        program, out=out, dialect=dialect, force=force, as_json=as_json, units=units, tools=tools,
        given=tool or (),
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchOptions:
    """Options of `vmachining batch`."""

    out: Annotated[Path, opt("DIR", "One directory per job in it.")] = Path("out")
    workers: Annotated[int | None, opt(None, "Processes of this machine (default: 1).", min=1)] = None
    scheduler: Scheduler = None
    stock: StockOut = "stl"
    resume: Resume = False
    quiet: Quiet = False
    as_json: Json = False


@command(
    jobs,
    shown=(
        "batch jobs/*.toml --out out/night --workers 4 --resume",
        "batch jobs/*.toml --out /shared/night --scheduler tcp://10.0.0.5:8786",
    ),
)
def batch(files: Annotated[list[Path], arg("JOB.toml...", "Job files.")], *, options: BatchOptions) -> int:
    """Simulate many jobs; one that fails does not stop the others. Ends with a table, a data set and a page."""
    from vmachining.cli.batch import run_batch

    return run_batch(files, options)


@command(jobs, shown=("warm",))
def warm(*, quiet: Quiet = False) -> int:
    """Compile all kernels now, in two processes: no later command has to wait for them."""
    from vmachining.cli.warm import warm as compiled

    return compiled(quiet=quiet)


@command(jobs, shown=("demo --out out/demo", "demo --list", "demo mould --out out/mould"))
def demo(
    name: Annotated[str, arg("[NAME]", "Model; --list names them.")] = "slot",
    *,
    listed: Annotated[bool, flag("--list", "Name the models, and what each shows.")] = False,
    out: Out = None,
    stock: StockOut = "stl",
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """Simulate a model that comes with the package."""
    from vmachining.cli import jobs

    if listed:
        return jobs.list_demos(as_json=as_json)
    return jobs.run_demo(name, out=out, stock=stock, quiet=quiet, as_json=as_json)
