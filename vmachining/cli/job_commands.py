"""The commands that simulate jobs: run, measure, merge, check, contact, init, batch, warm,
demo; and those that show results: figure, machine, view, strategies."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any

import typer

from vmachining.cli import options as each
from vmachining.cli.options import arg, argument, command, flag, opt, switch

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

    engine: str | None = opt(None, "NAME", ENGINES)
    width: str | None = opt(None, "1%", "Columns: width of each block's bracket; default: that of the job.")
    chord: float | None = opt(None, "MM", CHORD)
    spacing: float | None = opt(None, "MM", "Dexel: distance between rays (default: half a million rays).")
    directions: int | None = opt(None, "1|3", "Dexel: rays along z only, or along x, y and z.")
    brep: str = opt("none", "WHICH", "Blocks with a B-rep check: none, sample, all or 3,7-12.")
    brep_seconds: float | None = opt(None, "S", BREP_SECONDS, min=1.0)
    contact: str = opt("all", "WHICH", "Blocks with contact and forces: none, sample or all.")
    stages: str | None = opt(
        None, "NAMES", "Only these of cut, contact, plan, judge, show (default: all), e.g. cut,judge."
    )
    workers: int | None = opt(
        None, None, "Number of processes that cut (default for long programs: one per core).", min=1
    )
    scheduler: each.Scheduler = None
    part: str | None = opt(None, "K/N", "Run only part K of N, such as 3/64; `merge` joins the parts.")
    stock: each.StockOut = "stl"
    stock_at: str | None = opt(None, "BLOCKS", "Write the workpiece after blocks 7,12-14: stock_7.step, ...")
    csv: each.Csv = False

    def given(self) -> dict[str, Any]:
        """Those that are not as by default."""
        values = ((field, getattr(self, field.name)) for field in fields(self))
        return {field.name: value for field, value in values if value != field.default}

    def words(self) -> list[str]:
        """The same on a command line."""
        pairs = ((f"--{name.replace('_', '-')}", value) for name, value in self.given().items())
        told = ((name, v) if v is not True else (name,) for name, v in pairs)
        return [f"{word:g}" if isinstance(word, float) else str(word) for words in told for word in words]


Force = Annotated[bool, switch("--force", "Replace the result of another job in the directory.")]


@command(
    jobs,
    "jobs:run_",
    "run part.toml",
    "run part.toml --out out/fine --width 0.1% --stock stl,3mf",
    "run part.toml --brep sample --resume",
    "run part.toml --part 3/64",
    "run part.nc --tool 1=flat:10 --tool 3=ball:6",
)
class Run:
    """Simulate one job: tables, summary, report, finished stock, and the rewritten program with [feed]."""

    job: Path = arg("JOB.toml|PROGRAM", PROGRAM_OR_JOB)
    out: each.Out = None
    tools: each.Library = None
    tool: each.OneTool = None
    units: each.Units = ""
    options: RunOptions
    resume: each.Resume = False
    force: Force = False
    quiet: each.Quiet = False
    as_json: each.Json = False


@command(jobs, "jobs:measure", "measure job.toml --out out/measured")
class Measure:
    """Measure the finished workpiece against [design] by discrete vectors: overcut and undercut with their positions."""

    job: Path = arg("JOB.toml", "Job file with [design].")
    out: each.Out = None
    stock: each.StockOut = "stl"
    resume: each.Resume = False
    force: Force = False
    quiet: each.Quiet = False
    as_json: each.Json = False


@command(jobs, "jobs:merge_", "merge out/part.part-*-of-4 --out out/part")
class Merge:
    """Join all parts of a run into the result of a single run, with schedule, second opinions and files."""

    folders: list[Path] = arg("DIR...", "Directories that `run --part K/N` wrote.")
    out: each.Out = None
    stock: each.StockOut = "stl"
    force: Force = False
    quiet: each.Quiet = False
    as_json: each.Json = False


Result = Annotated[Path, argument("RESULT", "Directory of a complete result.")]


@command(
    jobs, "jobs:add_to_result", "check out/part --brep sample", "check out/part --brep 3,7-12", name="check"
)
class CheckResult:
    """Add B-rep checks to a finished result; nothing is cut again."""

    result: Result
    brep: str = opt("sample", "WHICH", "sample, all or blocks 3,7-12.")
    brep_seconds: float | None = opt(None, "S", BREP_SECONDS, min=1.0)
    workers: int | None = opt(None, None, "Number of processes that check.", min=1)
    quiet: each.Quiet = False
    as_json: each.Json = False

    def asked(self) -> dict[str, Any]:
        """Options of the run that change."""
        return {"brep": self.brep, "brep_seconds": self.brep_seconds, "workers": self.workers}


@command(jobs, "jobs:add_to_result", "contact out/part", "contact out/part --blocks sample", name="contact")
class Contact:
    """Add contact, chips and forces to a finished result; nothing is cut again."""

    result: Result
    blocks: str = opt("all", "WHICH", "sample or all.")
    quiet: each.Quiet = False
    as_json: each.Json = False

    def asked(self) -> dict[str, Any]:
        """Options of the run that change."""
        return {"contact": self.blocks}


@command(jobs, "jobs:init", "init part.nc", "init part.nc --out jobs/part.toml --force")
class Init:
    """Write a commented job file from a program: dialect, units, tools and stock as far as the program gives them."""

    program: Path = arg("PROGRAM", "NC program.")
    out: Path | None = opt(None, "JOB.toml", "File to write; default: next to the program; - prints it.")
    dialect: str | None = opt(None, None, "Dialect of the program; default: detected and reported.")
    tools: each.Library = None
    tool: each.OneTool = None
    units: each.Units = ""
    force: bool = flag("--force", "Overwrite the file.")
    as_json: each.Json = False


@command(
    jobs,
    "batch:batch",
    "batch jobs/*.toml --out out/night --workers 4 --resume",
    "batch jobs/*.toml --out /shared/night --scheduler tcp://10.0.0.5:8786",
)
class Batch:
    """Simulate many jobs; one that fails does not stop the others. Ends with a table, a data set and a page."""

    files: list[Path] = arg("JOB.toml...", "Job files.")
    out: Path = opt(Path("out"), "DIR", "Directory for the results, with one directory per job.")
    workers: int | None = opt(None, None, "Number of processes on this machine (default: 1).", min=1)
    scheduler: each.Scheduler = None
    stock: each.StockOut = "stl"
    csv: each.Csv = False
    resume: each.Resume = False
    quiet: each.Quiet = False
    as_json: each.Json = False


@command(jobs, "warm:warm", "warm")
class Warm:
    """Compile all kernels now, in two processes, so that no later command has to wait."""

    quiet: each.Quiet = False


@command(jobs, "demo:demo", "demo --out out/demo", "demo --list", "demo mould --out out/mould")
class Demo:
    """Simulate a model that comes with the package."""

    name: str = arg("[NAME]", "Model; --list names them.", "slot")
    listed: bool = flag("--list", "List the models and what each shows.")
    out: each.Out = None
    stock: each.StockOut = "stl"
    quiet: each.Quiet = False
    as_json: each.Json = False


shows = typer.Typer()

KINDS = (
    "load, bracket, feed, engagement, stock, schedule, program, logged, references, chips, section, trace, "
    "deviation, or all."
)


@command(shows, "show:figure", "figure out/slot --kind load,stock --format svg,pdf")
class Figure:
    """Figures for papers from a result directory: vector graphics, fonts embedded, axes with units."""

    results: Path = arg(
        "DIR|FILE", "Result directory of run, engage --chips or force predict --measured; or lines of bench."
    )
    kind: str = opt("all", "LIST", KINDS)
    formats: Annotated[str, typer.Option("--format", metavar="LIST", help="svg, pdf, png (comma list).")] = (
        "pdf"
    )
    over: str | None = opt(
        None, "time|block", "Quantity on the x axis; default: time (block for bracket, references)."
    )
    width: float = opt(174.0, "MM", "Width of the figure.", min=50.0, max=1000.0)
    out: Path | None = opt(None, "DIR", "Directory for the figures; default: that of the results.")
    as_json: each.Json = False


@command(
    shows, "machine:machine", "machine", "machine xyzac-trt --out trunnion.html", "machine mill.toml --json"
)
class Describe:
    """Describe a machine: chain, class, axes, limits, options, legs; as text and as a page with pictures."""

    name: str | None = arg("[NAME|FILE]", "Preset, machine file or job; without it: all presets.", None)
    out: Path | None = opt(None, "HTML", "Page to write; default: NAME.html in this directory.")
    as_json: each.Json = False


@command(shows, "show:view", "view out/slot", "view models/slot/job.toml --port 8000")
class View:
    """Show the report in a browser, on loopback only. A job runs again whenever its files change. Ctrl-C stops it."""

    target: Path = arg("JOB.toml|DIR", "Job file, or result directory.")
    out: each.Out = None
    engine: each.Engine = None
    port: int = opt(0, None, "Port on this machine; 0: any free one.", min=0, max=65535)
    once: bool = flag("--once", "Do not run the job again when its files change.")


@command(shows, "show:strategies", "strategies models/slot/job.toml", "strategies out/slot --json")
class Strategies:
    """Compare all feed strategies on one job: time, peak and spread of volume rate, chip area and force.

    Each strategy's program is written (scheduled_NAME.nc) and judged by simulation; inserted blocks cost one more.
    """

    target: Path = arg("JOB.toml|DIR", "Job with [feed], or its result directory.")
    out: each.Out = None
    engine: each.Engine = None
    resume: bool = flag("--resume", "Continue an interrupted run.")
    quiet: each.Quiet = False
    as_json: each.Json = False
