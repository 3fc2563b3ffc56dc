"""The commands that show results: `figure`, `view`, `strategies`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from vmachining.cli.options import Engine, Json, Out, Quiet, arg, command, flag, opt

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
