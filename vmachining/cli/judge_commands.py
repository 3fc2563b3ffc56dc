"""The commands that ask about single sweeps and blocks, and compare: sweep, engage, block, compare, pack, bench;
and those under `times` and `force`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from vmachining.cli import options as each
from vmachining.cli.options import above_zero, arg, argument, command, examples, flag, opt, option, within

judges = typer.Typer()


@command(
    judges,
    "single:sweep",
    "sweep sweep.json --json",
    "sweep sweep.json --no-brep --chord 0.001",
    "sweep sweep.json --step sweep.step",
    "sweep sweep.json --no-brep --plot regions.pdf --at 0.1,0.5,0.9",
)
class Sweep:
    """Compute the volume of one sweep, its bracket and its B-rep solid."""

    file: str = arg("SWEEP.json", "Tool and two poses; - reads standard input.")
    chord: float = opt(0.01, "MM", "Distance between inner and outer facets.", within(1e-5, 1e3))
    step: Path | None = opt(None, "FILE", "Write the solid as STEP, with faces named by their region.")
    no_brep: bool = flag("--no-brep", "Only the bracket, without OCCT, which takes most of the time.")
    seconds: float = opt(
        120.0, "S", "Processor time of OCCT for the solid; the bracket comes first.", above_zero
    )
    plot: Path | None = opt(None, "FILE", "Draw the solid as .html, or its regions as .svg, .pdf or .png.")
    at: str | None = opt(None, "P,P,...", "Fractions of the motion whose grazing curves the picture shows.")
    as_json: each.Json = False


@command(
    judges,
    "engage:engage",
    "engage models/slot/job.toml --block 20 --at 0.5 --out out/block20",
    "engage models/slot/job.toml --block 18-40 --every 1 --method analytic --chips --out out/chips",
    "engage models/semi_finish/job.toml --block 1-46 --method analytic --section 90 --out out/section",
)
class Engage:
    """Show what the cutting edge touches at one or many positions of a block, for every rotation angle."""

    job: each.JobArg
    block: str = opt(..., "K|all|7,10-20", "Blocks as numbered by run, from 0.")
    at: float = opt(0.5, "P", "Fraction of the block, 0 to 1.")
    every: float | None = opt(None, "MM", "Distance between positions along each block.", above_zero)
    method: str = opt("dexel", None, "dexel: exact distances; brep: OCCT; analytic.")
    angles: int = opt(360, "N", "Rotation angles per revolution.")
    phase: float = opt(0.0, "X", "Angles are 360 (k + X) / N degrees; 0.5 avoids walls.")
    edge: str = opt("straight", None, "straight, or helix: with the helix angle of the tool.")
    bottom: bool = flag("--bottom", "Continue the edge over the bottom disc.")
    seconds: float = opt(120.0, "S", "Time limit of one OCCT call.", above_zero)
    pitch: float = opt(0.1, "MM", "Method analytic: size of the height cells.")
    out: Path | None = opt(None, "DIR", "Directory for table, map and picture.")
    workers: int = opt(1, None, "Number of processes, for many positions.", min=1)
    chips: bool = flag("--chips", "Add shapes of chips, cut length and chip area over time.")
    section: float | None = opt(
        None, "DEG", "Draw workpiece, UE and LE at this angle from the feed; 90 is ahead.", within(0.0, 360.0)
    )
    as_json: each.Json = False


@command(
    judges,
    "single:block",
    "block models/slot/job.toml 12",
    "block models/mould/job.toml 700,20-24 3 --width 0.01% --json",
)
class Block:
    """Compute what single blocks remove, to any width, without a run: bracket, engine, seconds."""

    job: each.JobArg
    blocks: list[str] = arg("BLOCKS...", "Block numbers as in the table of a run, in any order: 7,10-12 3.")
    width: str | None = opt(None, "W", "Relative width of a bracket: 0.01% or 1e-4; default: the job's.")
    as_json: each.Json = False


RESULTS = "block or line, removed_mm3; or engaged intervals; or a job. With a set: directory of CASE.csv, or column case."
PAGE = "Show two results (DIR, blocks.parquet or blocks.csv) on one page; a single one next to its schedule."


@command(
    judges,
    "oracle:compare",
    "compare results.csv models/reference_pack/slot",
    "compare results/ models/reference_pack --json",
    "compare models/slot/job.toml --engines columns,mesh,dexel --out out/slot-engines",
    "compare models/mould/job.toml --engines columns,dexel --blocks 100",
    "compare out/slot --html schedule.html",
    "compare out/before out/after --html both.html",
)
class Compare:
    """Compare volumes or engagement from other software with a reference, or our engines. Exit code 1: not all inside."""

    results: Path = arg("RESULTS.csv|JOB.toml|DIR", RESULTS)
    reference: Path | None = arg("REFERENCE_DIR", "Directory of a run, a pack or a set.", None)
    engines: str | None = opt(None, "A,B,...", "Our engines on a job: columns,mesh,dexel,rays,vectors,brep.")
    out: Path | None = opt(None, "DIR", "With --engines: directory; default out/NAME-engines.")
    blocks: int | None = opt(None, "N", "With --engines: only the first N blocks that cut.", min=1)
    html: Path | None = opt(None, "PAGE.html", PAGE)
    tolerance_rel: float = opt(0.0, "X", "Widen brackets by X times the volume.")
    tolerance_mm3: float = opt(0.0, "V", "Widen every block's bracket by V mm3.")
    tolerance_mm: float | None = opt(None, "L", "Tolerance of tables of engagement (default 1e-4).")
    as_json: each.Json = False


@command(
    judges,
    "oracle:pack",
    "pack models/slot/job.toml --out out/slot-pack --stock stl,step",
    "pack models/reference_pack --out out/set",
)
class Pack:
    """Make a folder for testing engines: program, tools, stock, volumes with brackets, finished stock, digests."""

    job: Path = arg("JOB.toml|DIR", "Job file, or a directory whose set.toml lists many.")
    out: Path | None = opt(None, "DIR", "New directory; default out/NAME-pack.")
    stock: each.StockOut = "stl"
    brep: str = opt("none", "WHICH", "Blocks with a B-rep check: none, sample, all or 3,7-12.")
    licence: str = opt("none", "none|cc0|FILE", "Licence to state in the pack.")
    engagement: int = opt(10, "N", "Number of blocks with a table of engaged intervals.")
    engine: str = opt("mesh", "NAME", "Engine that computes the volumes: mesh or columns.")
    workers: int = opt(1, None, "Number of processes; with more than one, last digits may differ.", min=1)
    quiet: each.Quiet = False
    as_json: each.Json = False


@command(judges, "single:bench", "bench --list", "bench accuracy nc")
class Bench:
    """Run benchmarks; one JSON object per line."""

    cases: list[str] | None = arg("[CASE...]", "Cases to run; default: all.", None)
    listed: bool = flag("--list", "List the cases and how long each takes.")
    seeds: str | None = opt(None, "FIRST:LAST", "For cases that take seeds: run the seeds below LAST.")
    blocks: int | None = opt(None, "N", "For cases with a length: number of blocks.", min=1)
    journal: Path | None = opt(None, "FILE", "Record finished cases here; the next run continues from them.")
    as_json: each.Json = False


times = typer.Typer(
    help="Machine times: fit a machine to its logs, compare predicted with logged times.",
    epilog=examples("times compare run.log --program part.nc --machine mill.toml"),
    no_args_is_help=True, rich_markup_mode=None,
)  # fmt: skip

Logs = Annotated[
    list[Path], argument("LOG...", "time|item|value, MTConnect XML, or CSV with time and line; also .gz.")
]
Programs = Annotated[
    list[Path], option("P", "Program that the machine ran: one for all logs, or one per log, in order.")
]


@command(times, "times:fit_", "times fit a.log b.log --program a.nc --program b.nc --out mill.toml")
class Fit:
    """Fit the parameters of a machine to its logs: accelerations, corner tolerance, rapid, tool changes.

    The file has a table [machine] with keys of a job file.
    """

    logs: Logs
    program: Programs
    out: Path = opt(..., "FILE", "Machine file to write.")
    as_json: each.Json = False


@command(times, "times:compare_", "times compare run.log --program part.nc --machine mill.toml --json")
class CompareTimes:
    """Compare predicted with logged times: whole, per tool, per block, at the overrides of the log."""

    logs: Logs
    program: Programs
    machine: Path | None = opt(None, "FILE", "Machine file from `times fit`; default: feeds alone.")
    table: Path | None = opt(None, "CSV", "Write every interval of the log, with its load.")
    figure: Path | None = opt(None, "HTML", "Draw feeds as programmed, reachable and logged; tools; loads.")
    as_json: each.Json = False


@command(
    times,
    "times:join_",
    "times join run.log --results out/part",
    "times join a.log b.log --results out/part --json",
)
class Join:
    """Join logs with the table of a run: removal rate, force and power beside feed and load of the log, per interval.

    Writes logged.csv and logged.parquet beside the results; `figure DIR --kind logged` draws them.
    """

    logs: Logs
    results: Path = opt(..., "DIR", "Result directory of a run of the same program.")
    machine: Path | None = opt(None, "FILE", "Machine file from `times fit`; default: [machine] of the job.")
    as_json: each.Json = False


EXAMPLE = "force identify slots.csv --corner-radius 4 --teeth 2 --out coefficients.toml"

force = typer.Typer(
    help="Cutting forces: coefficients from slot tests, forces of a job over time.", epilog=examples(EXAMPLE),
    no_args_is_help=True, rich_markup_mode=None,
)  # fmt: skip

On = Annotated[
    Literal["tool", "workpiece"], option("tool|workpiece", "Body on which the measured forces act.")
]


@command(force, "force:identify_", EXAMPLE)
class Identify:
    """Fit cutting and edge coefficients over the height, with residuals and intervals, and write them as a file."""

    data: Path = arg("DATA.csv", "Slot tests: depth_mm, feed_mm_per_tooth, fx_n, fy_n, fz_n (means).")
    corner_radius: float = opt(..., "MM", "Corner radius of the tool; 0: flat end.")
    teeth: int = opt(..., None, "Number of teeth of the tool.", min=1)
    degree: int = opt(3, None, "Degree of the polynomials in height.", min=0)
    method: Literal["joint", "layers"] = opt("joint", None, "One fit with intervals, or layer by layer.")
    weights: Literal["relative", "resultant", "equal"] = opt(
        "relative", None, "Noise: relative to each force, to the resultant, or equal."
    )
    layer_ref: Literal["mid", "top"] = opt("mid", None, "Height that a layer's values are assigned to.")
    on: On = "tool"
    confidence: float = opt(0.95, None, "Confidence level of the intervals.")
    validate: Path | None = opt(
        None, "DATA.csv", "Slots not used for the fit, at another feed; reports how far off their means are."
    )
    name: str | None = opt(None, None, "Name of the set; default: the file name.")
    out: Path | None = opt(None, "FILE.toml", "Coefficient file; default: stdout.")
    plot: Path | None = opt(None, "FILE", "Coefficients and residuals as .svg, .pdf, .png.")
    as_json: each.Json = False


@command(
    force,
    "force:predict_",
    "force predict models/slot/job.toml --block 20-30 --out out/forces",
    "force predict part.toml --measured trace.csv --on workpiece",
)
class Predict:
    """Predict the force over time, one revolution at every station of the blocks, as CSV and Parquet, with a picture."""

    job: Path = arg("JOB.toml", "Job file with a [force] table.")
    block: str = opt("all", "all|3,7-12", "Blocks as numbered in the table of a run.")
    measured: Path | None = opt(
        None, "TRACE.csv", "Measured forces to compare: time_s or phi_deg, fx_n, fy_n, fz_n."
    )
    on: On = "tool"
    out: Path | None = opt(None, "DIR", "Directory for the results; default out/NAME.")
    quiet: each.Quiet = False
    as_json: each.Json = False
