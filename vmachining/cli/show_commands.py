"""The commands that show results: `figure`, `view`, `strategies`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from vmachining.cli.options import Json, Out, Quiet, examples

__all__ = ["add_to"]


def figure(
    results: Annotated[Path, typer.Argument(metavar="DIR", help="Result directory of run.")],
    kind: Annotated[
        str,
        typer.Option(
            "--kind",
            metavar="LIST",
            help="load, bracket, feed, engagement, stock, schedule (comma list); all: what the directory has.",
        ),
    ] = "all",
    formats: Annotated[
        str, typer.Option("--format", metavar="LIST", help="svg, pdf, png (comma list).")
    ] = "pdf",
    over: Annotated[
        str | None,
        typer.Option(
            "--over", metavar="time|block", help="Along the x axis; default: time, and block for bracket."
        ),
    ] = None,
    width: Annotated[
        float, typer.Option("--width", metavar="MM", min=50.0, max=1000.0, help="Of the figure.")
    ] = 174.0,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIR", help="Where files go; default: beside the results.")
    ] = None,
    as_json: Json = False,
) -> int:
    """Figures for papers from a result directory: vector graphics, fonts embedded, axes with units."""
    from vmachining.cli import show

    return show.figure(results, kind=kind, formats=formats, over=over, width=width, out=out, as_json=as_json)


def view(
    target: Annotated[Path, typer.Argument(metavar="JOB.toml|DIR", help="Job file, or result directory.")],
    out: Out = None,
    engine: Annotated[
        str | None, typer.Option("--engine", metavar="NAME", help="Of a job; default as in run.")
    ] = None,
    port: Annotated[
        int, typer.Option("--port", min=0, max=65535, help="On this machine; 0: any that is free.")
    ] = 0,
    once: Annotated[
        bool, typer.Option("--once", help="Do not run the job again when its files change.")
    ] = False,
) -> int:
    """The report in a browser, on loopback only: of a job while it runs and whenever its files change. Ends with Ctrl-C."""
    from vmachining.cli import view as room

    return room.view(target, out=out, engine=engine, port=port, once=once)


def strategies(
    target: Annotated[
        Path, typer.Argument(metavar="JOB.toml|DIR", help="Job with [feed], or result directory of one.")
    ],
    out: Out = None,
    engine: Annotated[
        str | None, typer.Option("--engine", metavar="NAME", help="Of a job; default as in run.")
    ] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Go on with an interrupted run.")] = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> int:
    """All feed strategies on the same job: time, peak and spread of volume rate, chip area and force.

    Each strategy's program is written (scheduled_NAME.nc) and judged by simulation; inserted blocks cost one more.
    """
    from vmachining.cli import show

    return show.strategies(target, out=out, engine=engine, resume=resume, quiet=quiet, as_json=as_json)


def add_to(app: typer.Typer) -> None:
    """Hang the commands into the tree."""
    app.command(epilog=examples("figure out/slot --kind load,stock --format svg,pdf"))(figure)
    app.command(epilog=examples("view out/slot", "view models/slot/job.toml --port 8000"))(view)
    app.command(epilog=examples("strategies models/slot/job.toml", "strategies out/slot --json"))(strategies)
