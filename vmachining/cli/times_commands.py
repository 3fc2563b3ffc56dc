"""The `times` commands of the tree."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from vmachining.cli.options import Json, arg, command, examples, opt

times = typer.Typer(
    help="Machine times: fit a machine to its logs, compare predicted with logged times.",
    epilog=examples("times compare run.log --program part.nc --machine mill.toml"),
    no_args_is_help=True, rich_markup_mode=None,
)  # fmt: skip

Logs = Annotated[
    list[Path], arg("LOG...", "time|item|value, MTConnect XML, or CSV with time and line; also .gz.")
]
Programs = Annotated[list[Path], opt("P", "Program that ran: one for all logs, or one per log, in order.")]


@command(times, "times:fit_", shown=("times fit a.log b.log --program a.nc --program b.nc --out mill.toml",))
class Fit:
    """Fit the parameters of a machine to its logs: accelerations, corner tolerance, rapid, tool changes.

    The file has a table [machine] with keys of a job file.
    """

    logs: Logs
    program: Programs
    out: Annotated[Path, opt("FILE", "The machine file that is written.")]
    as_json: Json = False


@command(
    times, "times:compare_", shown=("times compare run.log --program part.nc --machine mill.toml --json",)
)
class CompareTimes:
    """Compare predicted with logged times: whole, per tool, per block, at the overrides of the log."""

    logs: Logs
    program: Programs
    machine: Annotated[Path | None, opt("FILE", "From `times fit`; without it: feeds alone.")] = None
    table: Annotated[Path | None, opt("CSV", "Every interval of the log, with its load.")] = None
    figure: Annotated[
        Path | None, opt("HTML", "Page: feed as programmed, reachable and logged; tools; loads.")
    ] = None
    as_json: Json = False


@command(
    times,
    "times:join_",
    shown=("times join run.log --results out/part", "times join a.log b.log --results out/part --json"),
)
class Join:
    """Join logs with the table of a run: removal rate, force and power beside feed and load of the log, per interval.

    Writes logged.csv and logged.parquet beside the results; `figure DIR --kind logged` draws them.
    """

    logs: Logs
    results: Annotated[Path, opt("DIR", "Result directory of run, of the same program.")]
    machine: Annotated[Path | None, opt("FILE", "From `times fit`; default: [machine] of the job.")] = None
    as_json: Json = False
