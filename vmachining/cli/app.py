"""The command tree. Bodies import what they need, so that `--help` loads no kernel."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from vmachining.cli.force_commands import force
from vmachining.cli.nc_commands import nc
from vmachining.cli.options import (
    Dialect,
    Home,
    Json,
    Out,
    ProgramArg,
    Quiet,
    Resume,
    StockOut,
    Tools,
    ToolUnits,
    Travel,
    examples,
)
from vmachining.cli.show_commands import add_to
from vmachining.cli.toolpath_commands import toolpath

__all__ = ["app", "command"]

SETTINGS = {"help_option_names": ["-h", "--help"], "max_content_width": 110}


app = typer.Typer(
    name="vmachining",
    help="Milling simulation: removed volume of every NC block with its error, and the feed it deserves.",
    epilog=examples("demo --out out/demo", "init part.nc --out part.toml", "run part.toml"),
    no_args_is_help=True, add_completion=True, rich_markup_mode=None, pretty_exceptions_enable=False,
    context_settings=SETTINGS,
)  # fmt: skip
app.add_typer(nc, name="nc")
app.add_typer(force, name="force")
app.add_typer(toolpath, name="toolpath")


def _version(show: bool) -> None:
    if show:
        from importlib.metadata import version

        typer.echo(version("vmachining"))
        raise typer.Exit


@app.callback()
def root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print it.")
    ] = False,
) -> None:
    """Milling simulation: removed volume of every NC block with its error, and the feed it deserves."""


@app.command(
    "run",
    epilog=examples(
        "run part.toml",
        "run part.toml --out out/fine --width 0.1% --stock stl,3mf",
        "run part.toml --brep sample --resume",
    ),
)
def run_(
    job: Annotated[Path, typer.Argument(metavar="JOB.toml", help="Job file.")],
    out: Out = None,
    engine: Annotated[
        str | None,
        typer.Option(
            "--engine",
            metavar="NAME",
            help="columns, mesh, dexel, rays or vectors (default: columns where they take stock and motions, else mesh).",
        ),
    ] = None,
    width: Annotated[
        str | None,
        typer.Option(
            "--width",
            metavar="1%",
            help="Columns: width of each block's bracket, instead of that of the job.",
        ),
    ] = None,
    chord: Annotated[
        float | None,
        typer.Option(
            "--chord",
            metavar="MM",
            help="Mesh: instead of chord_mm of the job, for finer facets and brackets; a note says where it changes nothing.",
        ),
    ] = None,
    spacing: Annotated[
        float | None,
        typer.Option(
            "--spacing", metavar="MM", help="Dexel: distance of rays (default: half a million rays)."
        ),
    ] = None,
    directions: Annotated[
        int | None, typer.Option("--directions", metavar="1|3", help="Dexel: rays along z, or x, y and z.")
    ] = None,
    certify: Annotated[
        bool,
        typer.Option(
            "--certify", help="Accepted from earlier versions: brackets need no option to be proved."
        ),
    ] = False,
    brep: Annotated[
        str, typer.Option("--brep", metavar="WHICH", help="B-rep checks: none, sample, all or blocks 3,7-12.")
    ] = "none",
    brep_seconds: Annotated[
        float | None,
        typer.Option("--brep-seconds", metavar="S", min=1.0, help="Limit of one B-rep check (default: 120)."),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option("--workers", min=1, help="Processes that cut (default: the cores, for long programs)."),
    ] = None,
    stock: StockOut = "stl",
    stock_at: Annotated[
        str | None,
        typer.Option(
            "--stock-at", metavar="BLOCKS", help="Workpiece after blocks 7,12-14: stock_7.step, ..."
        ),
    ] = None,
    resume: Resume = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """Simulate one job: tables, summary, report, finished stock, and the rewritten program with [feed]."""
    from vmachining.cli import jobs

    options = jobs.RunOptions(
        engine=engine, width=width, chord=chord, spacing=spacing, directions=directions, brep=brep,
        brep_seconds=brep_seconds, workers=workers, stock=stock, stock_at=stock_at,
    )  # fmt: skip
    return jobs.run_job(job, options, out=out, resume=resume, quiet=quiet, as_json=as_json)


@app.command("init", epilog=examples("init part.nc", "init part.nc --out jobs/part.toml --force"))
def init_(
    program: Annotated[Path, typer.Argument(metavar="PROGRAM", help="NC program.")],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="JOB.toml", help="The file to write; default beside the program; - prints it."
        ),
    ] = None,
    dialect: Annotated[
        str | None, typer.Option("--dialect", help="iso, mts, apt, poses; default: the one that reads it.")
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite the file.")] = False,
    as_json: Json = False,
) -> int:
    """Write a commented job file from a program: dialect, units, tools and stock as far as it tells them."""
    from vmachining.cli import init

    return init.init(program, out=out, dialect=dialect, force=force, as_json=as_json)


@app.command(
    epilog=examples(
        "batch jobs/*.toml --out out/night --workers 4 --resume",
        "batch jobs/*.toml --out /shared/night --scheduler tcp://10.0.0.5:8786",
    )
)
def batch(
    files: Annotated[list[Path], typer.Argument(metavar="JOB.toml...", help="Job files.")],
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="One directory per job in it.")] = Path(
        "out"
    ),
    workers: Annotated[
        int | None, typer.Option("--workers", min=1, help="Processes of this machine (default: 1).")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option("--scheduler", metavar="ADDRESS", help="Workers of this Dask scheduler instead."),
    ] = None,
    stock: StockOut = "stl",
    resume: Resume = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """Simulate many jobs side by side; one that fails does not stop the others. Ends with a table, a data set and a page."""
    from vmachining.cli import batch as command

    return command.run_batch(
        files, out=out, workers=workers, scheduler=scheduler, stock=stock, resume=resume, quiet=quiet,
        as_json=as_json,
    )  # fmt: skip


@app.command(epilog=examples("warm"))
def warm(quiet: Quiet = False) -> int:
    """Compile all kernels now, in two processes: no later command has to wait for them."""
    from vmachining.cli.warm import warm as compiled

    return compiled(quiet=quiet)


@app.command(epilog=examples("demo --out out/demo", "demo --list", "demo mould --out out/mould"))
def demo(
    name: Annotated[
        str, typer.Argument(metavar="[NAME]", help="Model; --list names them.", show_default=True)
    ] = "slot",
    listed: Annotated[bool, typer.Option("--list", help="Name the models, and what each shows.")] = False,
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


@app.command(
    epilog=examples(
        "sweep sweep.json --json",
        "sweep sweep.json --no-brep --chord 0.001",
        "sweep sweep.json --step sweep.step",
    )
)
def sweep(
    file: Annotated[
        str, typer.Argument(metavar="SWEEP.json", help="Tool and two poses; - reads standard input.")
    ],
    chord: Annotated[
        float, typer.Option("--chord", metavar="MM", help="Between inner and outer solid.")
    ] = 0.01,
    step: Annotated[
        Path | None, typer.Option("--step", metavar="FILE", help="Write the swept solid as STEP.")
    ] = None,
    no_brep: Annotated[
        bool,
        typer.Option("--no-brep", help="The bracket only: OCCT, which takes most of the time, is not asked."),
    ] = False,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="FILE", help="Picture of the swept solid as .html.")
    ] = None,
    as_json: Json = False,
) -> int:
    """Volume of one sweep, with its bracket, and its B-rep solid."""
    from vmachining.cli import single

    return single.sweep(file, chord=chord, step=step, brep=not no_brep, plot=plot, as_json=as_json)


@app.command(
    epilog=examples(
        "engage models/slot/job.toml --block 20 --at 0.5 --out out/block20",
        "engage models/slot/job.toml --block 18-40 --every 1 --method analytic --chips --out out/chips",
    )
)
def engage(
    job: Annotated[Path, typer.Argument(metavar="JOB.toml", help="Job file.")],
    block: Annotated[
        str, typer.Option("--block", metavar="K|all|7,10-20", help="Blocks as numbered by run, from 0.")
    ],
    at: Annotated[float, typer.Option("--at", metavar="P", help="Fraction of the block, 0 to 1.")] = 0.5,
    every: Annotated[
        float | None, typer.Option("--every", metavar="MM", help="Positions along each block instead of one.")
    ] = None,
    method: Annotated[
        str, typer.Option("--method", help="dexel: exact distances; brep: OCCT; analytic.")
    ] = "dexel",
    angles: Annotated[int, typer.Option("--angles", metavar="N", help="Rotation angles of a turn.")] = 360,
    phase: Annotated[
        float,
        typer.Option("--phase", metavar="X", help="Angles are 360 (k + X) / N degrees; 0.5 avoids walls."),
    ] = 0.0,
    edge: Annotated[
        str, typer.Option("--edge", help="straight, or helix: wound as the tool says.")
    ] = "straight",
    bottom: Annotated[bool, typer.Option("--bottom", help="The edge goes on over the bottom disc.")] = False,
    seconds: Annotated[
        float, typer.Option("--seconds", metavar="S", help="Limit of one OCCT question.")
    ] = 120.0,
    pitch: Annotated[
        float, typer.Option("--pitch", metavar="MM", help="Cells of heights, of method analytic.")
    ] = 0.1,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Write table, map and picture there.")
    ] = None,
    workers: Annotated[int, typer.Option("--workers", min=1, help="Processes, of many positions.")] = 1,
    chips: Annotated[
        bool, typer.Option("--chips", help="Shapes of chips, cut length and chip area over the time.")
    ] = False,
    as_json: Json = False,
) -> int:
    """What the cutting edge touches at one instant of a block, or at many, for every rotation angle."""
    from vmachining.cli import engage as room

    return room.engage(
        job, block=block, at=at, every=every, method=method, angles=angles, phase=phase, edge=edge, bottom=bottom,
        seconds=seconds, pitch=pitch, out=out, workers=workers, chips=chips, as_json=as_json,
    )  # fmt: skip


@app.command(
    epilog=examples(
        "block models/slot/job.toml 12",
        "block models/mould/job.toml 700,20-24 3 --width 0.01% --json",
    )
)
def block(
    job: Annotated[Path, typer.Argument(metavar="JOB.toml", help="Job file.")],
    blocks: Annotated[
        list[str],
        typer.Argument(metavar="BLOCKS...", help="Numbers as in blocks.csv, in any order: 7,10-12 3."),
    ],
    width: Annotated[
        str | None,
        typer.Option("--width", metavar="W", help="Of a bracket: 0.01% or 1e-4; default: the job's."),
    ] = None,
    as_json: Json = False,
) -> int:
    """What single blocks remove, to any width, without a run: bracket, engine, seconds."""
    from vmachining.cli import block as room

    return room.block(job, blocks, width=width, as_json=as_json)


@app.command(
    epilog=examples(
        "compare results.csv models/reference_pack/slot",
        "compare results/ models/reference_pack --json",
        "compare models/slot/job.toml --engines columns,mesh,dexel --out out/slot-engines",
        "compare models/mould/job.toml --engines columns,dexel --blocks 100",
    )
)
def compare(
    results: Annotated[
        Path,
        typer.Argument(
            metavar="RESULTS.csv|JOB.toml",
            help="block or line, removed_mm3; or engaged intervals; or a job. With a set: directory of CASE.csv, or column case.",
        ),
    ],
    reference: Annotated[
        Path | None,
        typer.Argument(metavar="REFERENCE_DIR", help="Result directory of run, of pack, or of a set."),
    ] = None,
    engines: Annotated[
        str | None,
        typer.Option(
            "--engines", metavar="A,B,...", help="Our engines on a job: columns,mesh,dexel,rays,vectors,brep."
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="DIR", help="With --engines: table and page; default out/NAME-engines."
        ),
    ] = None,
    blocks: Annotated[
        int | None,
        typer.Option(
            "--blocks", metavar="N", min=1, help="With --engines: only the first N blocks that cut."
        ),
    ] = None,
    tolerance_rel: Annotated[
        float, typer.Option("--tolerance-rel", metavar="X", help="Widen brackets by X times the volume.")
    ] = 0.0,
    tolerance_mm3: Annotated[
        float, typer.Option("--tolerance-mm3", metavar="V", help="Widen every block's bracket by V mm3.")
    ] = 0.0,
    tolerance_mm: Annotated[
        float | None,
        typer.Option(
            "--tolerance-mm", metavar="L", help="Tables of engagement: along the edge (default 1e-4)."
        ),
    ] = None,
    as_json: Json = False,
) -> int:
    """Somebody's per-block volumes or engaged intervals, or our own engines, against ours. Exit code 0: all inside, 1: not."""
    from vmachining.cli import oracle

    if engines is not None:
        return oracle.compare_engines(
            results, engines, reference=reference, out=out, blocks=blocks, as_json=as_json
        )
    return oracle.compare(
        results, reference, tolerance_rel=tolerance_rel, tolerance_mm3=tolerance_mm3, tolerance_mm=tolerance_mm,
        as_json=as_json,
    )  # fmt: skip


@app.command(
    epilog=examples(
        "pack models/slot/job.toml --out out/slot-pack --stock stl,step",
        "pack models/reference_pack --out out/set",
    )
)
def pack(
    job: Annotated[
        Path, typer.Argument(metavar="JOB.toml|DIR", help="Job file; or a directory with set.toml, of many.")
    ],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="New directory; default out/NAME-pack.")
    ] = None,
    stock: StockOut = "stl",
    brep: Annotated[
        str, typer.Option("--brep", metavar="WHICH", help="B-rep checks: none, sample, all or blocks 3,7-12.")
    ] = "none",
    licence: Annotated[
        str, typer.Option("--licence", metavar="none|cc0|FILE", help="Terms that go into the pack.")
    ] = "none",
    engagement: Annotated[
        int, typer.Option("--engagement", metavar="N", help="Blocks with a table of engaged intervals.")
    ] = 10,
    engine: Annotated[
        str, typer.Option("--engine", metavar="NAME", help="Who computes the volumes: mesh or columns.")
    ] = "mesh",
    workers: Annotated[
        int, typer.Option("--workers", min=1, help="Processes; more than one changes last digits.")
    ] = 1,
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """A folder to test engines with: program, tools, stock, volumes with brackets, finished stock, hashes."""
    from vmachining.cli import oracle

    return oracle.pack(
        job, out=out, stock=stock, brep=brep, licence=licence, engagement=engagement, engine=engine,
        workers=workers, quiet=quiet, as_json=as_json,
    )  # fmt: skip


@app.command(
    epilog=examples(
        "dda part.nc --blu 0.01 --out pulses.csv", "dda part.nc --tools job.toml --plot pulses.html"
    )
)
def dda(
    program: ProgramArg,
    blu: Annotated[float, typer.Option("--blu", metavar="MM", help="Length of one pulse.")] = 0.02,
    register: Annotated[int, typer.Option("--register", metavar="N", help="Register capacity.")] = 20_000,
    mode: Annotated[
        str, typer.Option("--mode", metavar="dda|s1", help="s1: the historical engraver, errors included.")
    ] = "dda",
    split: Annotated[
        bool, typer.Option("--split", help="Cut lines that overflow the register instead of refusing them.")
    ] = False,
    max_rate: Annotated[
        float | None, typer.Option("--max-rate", metavar="HZ", help="Pulse rate the drives can follow.")
    ] = None,
    tools: Tools = None,
    tools_units: ToolUnits = "mm",
    dialect: Dialect = "iso",
    travel: Travel = None,
    home: Home = "0,0,100",
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Pulse trains as .csv or .npz.")
    ] = None,
    plot: Annotated[
        Path | None, typer.Option("--plot", metavar="FILE", help="Pulses and programmed path as .html.")
    ] = None,
    as_json: Json = False,
) -> int:
    """Pulse trains for stepping motors, feed rate numbers, clocks and deviations of every motion."""
    from vmachining.cli import dda as room

    return room.dda(
        program, blu=blu, register=register, mode=mode, split=split, max_rate=max_rate, dialect=dialect, tools=tools,
        tools_units=tools_units,
        travel=travel, home=home, out=out, plot=plot, as_json=as_json,
    )  # fmt: skip


add_to(app)


@app.command(epilog=examples("bench --list", "bench accuracy nc"))
def bench(
    cases: Annotated[
        list[str] | None, typer.Argument(metavar="[CASE...]", help="Names; default: all.")
    ] = None,
    listed: Annotated[bool, typer.Option("--list", help="Name the cases, and how long each takes.")] = False,
    seeds: Annotated[
        str | None,
        typer.Option(metavar="FIRST:LAST", help="Of a case that goes by seeds: those before LAST."),
    ] = None,
    blocks: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Of a case that has a length: so many blocks.")
    ] = None,
    journal: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Keeps what is done; the next run goes on from there.")
    ] = None,
    as_json: Json = False,
) -> int:
    """Run benchmarks; one JSON object per line."""
    from vmachining.cli import single

    return single.bench(
        cases or [], listed=listed, blocks=blocks, seeds=seeds, journal=journal, as_json=as_json
    )


def command() -> Any:
    """The command that `main` runs."""
    return typer.main.get_command(app)
