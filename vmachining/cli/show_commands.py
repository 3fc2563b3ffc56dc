"""The commands that show results: `figure`, `view`, `strategies`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from vmachining.cli.options import Engine, Json, Out, Quiet, arg, command, flag, opt

shows = typer.Typer()

KINDS = (
    "load, bracket, feed, engagement, stock, schedule, program, logged, references, chips, section, trace, "
    "deviation, or all."
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FigureOptions:
    """Options of `vmachining figure`."""

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


@command(shows, shown=("figure out/slot --kind load,stock --format svg,pdf",))
def figure(
    results: Annotated[
        Path,
        arg(
            "DIR|FILE",
            "Result directory of run, engage --chips or force predict --measured; or lines of bench.",
        ),
    ],
    *,
    options: FigureOptions,
) -> int:
    """Figures for papers from a result directory: vector graphics, fonts embedded, axes with units."""
    from vmachining.cli import show

    return show.figure(results, options)


@command(shows, shown=("machine", "machine xyzac-trt --out trunnion.html", "machine mill.toml --json"))
def machine(
    name: Annotated[
        str | None, arg("[NAME|FILE]", "Preset, machine file or job; without it: all presets.")
    ] = None,
    *,
    out: Annotated[Path | None, opt("HTML", "The page; default: NAME.html here.")] = None,
    as_json: Json = False,
) -> int:
    """Describe a machine: chain, class, axes, limits, options, legs; as text and as a page with pictures."""
    from vmachining.cli import machine as room

    return room.machine(name, out=out, as_json=as_json)


@command(shows, shown=("view out/slot", "view models/slot/job.toml --port 8000"))
def view(
    target: Annotated[Path, arg("JOB.toml|DIR", "Job file, or result directory.")],
    *,
    out: Out = None,
    engine: Engine = None,
    port: Annotated[int, opt(None, "On this machine; 0: any that is free.", min=0, max=65535)] = 0,
    once: Annotated[bool, flag("--once", "Do not run the job again when its files change.")] = False,
) -> int:
    """The report in a browser, on loopback only: of a job while it runs and whenever its files change. Ends with Ctrl-C."""
    from vmachining.cli import view as room

    return room.view(target, out=out, engine=engine, port=port, once=once)


@command(shows, shown=("strategies models/slot/job.toml", "strategies out/slot --json"))
def strategies(
    target: Annotated[Path, arg("JOB.toml|DIR", "Job with [feed], or result directory of one.")],
    *,
    out: Out = None,
    engine: Engine = None,
    resume: Annotated[bool, flag("--resume", "Continue an interrupted run.")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """All feed strategies on the same job: time, peak and spread of volume rate, chip area and force.

    Each strategy's program is written (scheduled_NAME.nc) and judged by simulation; inserted blocks cost one more.
    """
    from vmachining.cli import show

    return show.strategies(target, out=out, engine=engine, resume=resume, quiet=quiet, as_json=as_json)
