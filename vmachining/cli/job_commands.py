"""The commands that simulate jobs: run, measure, merge, check, contact, init, batch, warm,
demo; and those that show results: figure, machine, view, strategies."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any

import typer

from vmachining.cli.options import (
    Engine,
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
    command,
    flag,
    opt,
)

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
    csv: Annotated[bool, flag("--csv", "blocks.csv also above 100,000 blocks; blocks.parquet always.")] = (
        False
    )

    def given(self) -> dict[str, Any]:
        """Those that are not as by default."""
        values = ((field, getattr(self, field.name)) for field in fields(self))
        return {field.name: value for field, value in values if value != field.default}

    def words(self) -> list[str]:
        """The same on a command line."""
        pairs = ((f"--{name.replace('_', '-')}", value) for name, value in self.given().items())
        told = ((name, v) if v is not True else (name,) for name, v in pairs)
        return [f"{word:g}" if isinstance(word, float) else str(word) for words in told for word in words]


Force = Annotated[bool, flag("--force", "Replace the result of another job in the directory.")]


@command(
    jobs,
    "jobs:run_",
    shown=(
        "run part.toml",
        "run part.toml --out out/fine --width 0.1% --stock stl,3mf",
        "run part.toml --brep sample --resume",
        "run part.toml --part 3/64",
        "run part.nc --tool 1=flat:10 --tool 3=ball:6",
    ),
)
class Run:
    """Simulate one job: tables, summary, report, finished stock, and the rewritten program with [feed]."""

    job: Annotated[Path, arg("JOB.toml|PROGRAM", PROGRAM_OR_JOB)]
    out: Out = None
    tools: Library = None
    tool: OneTool = None
    units: Units = ""
    options: RunOptions
    resume: Resume = False
    force: Force = False
    quiet: Quiet = False
    as_json: Json = False


@command(jobs, "jobs:measure", shown=("measure job.toml --out out/measured",))
class Measure:
    """Measure the finished workpiece against [design] by discrete vectors: overcut, undercut, where it is."""

    job: Annotated[Path, arg("JOB.toml", "Job file with [design].")]
    out: Out = None
    stock: StockOut = "stl"
    resume: Resume = False
    force: Force = False
    quiet: Quiet = False
    as_json: Json = False


@command(jobs, "jobs:merge_", shown=("merge out/part.part-*-of-4 --out out/part",))
class Merge:
    """Join all parts of a run into the result of a single run, with schedule, second opinions and files."""

    folders: Annotated[list[Path], arg("DIR...", "Directories that `run --part K/N` wrote.")]
    out: Out = None
    stock: StockOut = "stl"
    force: Force = False
    quiet: Quiet = False
    as_json: Json = False


Result = Annotated[Path, arg("RESULT", "Directory of a complete result.")]


@command(
    jobs,
    "jobs:add_to_result",
    "check",
    shown=("check out/part --brep sample", "check out/part --brep 3,7-12"),
)
class CheckResult:
    """B-rep checks of a finished result; nothing is cut again."""

    result: Result
    brep: Annotated[str, opt("WHICH", "sample, all or blocks 3,7-12.")] = "sample"
    brep_seconds: Annotated[float | None, opt("S", BREP_SECONDS, min=1.0)] = None
    workers: Annotated[int | None, opt(None, "Processes that check.", min=1)] = None
    quiet: Quiet = False
    as_json: Json = False

    def asked(self) -> dict[str, Any]:
        """Options of the run that change."""
        return {"brep": self.brep, "brep_seconds": self.brep_seconds, "workers": self.workers}


@command(
    jobs, "jobs:add_to_result", "contact", shown=("contact out/part", "contact out/part --blocks sample")
)
class Contact:
    """Add contact, chips and forces to a finished result; nothing is cut again."""

    result: Result
    blocks: Annotated[str, opt("WHICH", "sample or all.")] = "all"
    quiet: Quiet = False
    as_json: Json = False

    def asked(self) -> dict[str, Any]:
        """Options of the run that change."""
        return {"contact": self.blocks}


@command(jobs, "init:init", shown=("init part.nc", "init part.nc --out jobs/part.toml --force"))
class Init:
    """Write a commented job file from a program: dialect, units, tools and stock as far as the program gives them."""

    program: Annotated[Path, arg("PROGRAM", "NC program.")]
    out: Annotated[
        Path | None, opt("JOB.toml", "The file to write; default: next to the program; - prints it.")
    ] = None
    dialect: Annotated[str | None, opt(None, "Of the program; default: detected and reported.")] = None
    tools: Library = None
    tool: OneTool = None
    units: Units = ""
    force: Annotated[bool, flag("--force", "Overwrite the file.")] = False
    as_json: Json = False


@command(
    jobs,
    "batch:batch",
    shown=(
        "batch jobs/*.toml --out out/night --workers 4 --resume",
        "batch jobs/*.toml --out /shared/night --scheduler tcp://10.0.0.5:8786",
    ),
)
class Batch:
    """Simulate many jobs; one that fails does not stop the others. Ends with a table, a data set and a page."""

    files: Annotated[list[Path], arg("JOB.toml...", "Job files.")]
    out: Annotated[Path, opt("DIR", "One directory per job in it.")] = Path("out")
    workers: Annotated[int | None, opt(None, "Processes of this machine (default: 1).", min=1)] = None
    scheduler: Scheduler = None
    stock: StockOut = "stl"
    resume: Resume = False
    quiet: Quiet = False
    as_json: Json = False


@command(jobs, "warm:warm", shown=("warm",))
class Warm:
    """Compile all kernels now, in two processes: no later command has to wait for them."""

    quiet: Quiet = False


@command(jobs, "demo:demo", shown=("demo --out out/demo", "demo --list", "demo mould --out out/mould"))
class Demo:
    """Simulate a model that comes with the package."""

    name: Annotated[str, arg("[NAME]", "Model; --list names them.")] = "slot"
    listed: Annotated[bool, flag("--list", "Name the models, and what each shows.")] = False
    out: Out = None
    stock: StockOut = "stl"
    quiet: Quiet = False
    as_json: Json = False


shows = typer.Typer()

KINDS = (
    "load, bracket, feed, engagement, stock, schedule, program, logged, references, chips, section, trace, "
    "deviation, or all."
)


@command(shows, "show:figure", shown=("figure out/slot --kind load,stock --format svg,pdf",))
class Figure:
    """Figures for papers from a result directory: vector graphics, fonts embedded, axes with units."""

    results: Annotated[
        Path,
        arg(
            "DIR|FILE",
            "Result directory of run, engage --chips or force predict --measured; or lines of bench.",
        ),
    ]
    kind: Annotated[str, opt("LIST", KINDS)] = "all"
    formats: Annotated[str, typer.Option("--format", metavar="LIST", help="svg, pdf, png (comma list).")] = (
        "pdf"
    )
    over: Annotated[
        str | None, opt("time|block", "What the x axis shows; default: time; block for bracket, references.")
    ] = None
    width: Annotated[float, opt("MM", "Width of the figure.", min=50.0, max=1000.0)] = 174.0
    out: Annotated[Path | None, opt("DIR", "Where files go; default: next to the results.")] = None
    as_json: Json = False


@command(
    shows,
    "machine:machine",
    shown=("machine", "machine xyzac-trt --out trunnion.html", "machine mill.toml --json"),
)
class Describe:
    """Describe a machine: chain, class, axes, limits, options, legs; as text and as a page with pictures."""

    name: Annotated[
        str | None, arg("[NAME|FILE]", "Preset, machine file or job; without it: all presets.")
    ] = None
    out: Annotated[Path | None, opt("HTML", "The page; default: NAME.html here.")] = None
    as_json: Json = False


@command(shows, "view:view", shown=("view out/slot", "view models/slot/job.toml --port 8000"))
class View:
    """The report in a browser, on loopback only: of a job while it runs and whenever its files change. Ends with Ctrl-C."""

    target: Annotated[Path, arg("JOB.toml|DIR", "Job file, or result directory.")]
    out: Out = None
    engine: Engine = None
    port: Annotated[int, opt(None, "On this machine; 0: any that is free.", min=0, max=65535)] = 0
    once: Annotated[bool, flag("--once", "Do not run the job again when its files change.")] = False


@command(shows, "show:strategies", shown=("strategies models/slot/job.toml", "strategies out/slot --json"))
class Strategies:
    """All feed strategies on the same job: time, peak and spread of volume rate, chip area and force.

    Each strategy's program is written (scheduled_NAME.nc) and judged by simulation; inserted blocks cost one more.
    """

    target: Annotated[Path, arg("JOB.toml|DIR", "Job with [feed], or result directory of one.")]
    out: Out = None
    engine: Engine = None
    resume: Annotated[bool, flag("--resume", "Continue an interrupted run.")] = False
    quiet: Quiet = False
    as_json: Json = False
