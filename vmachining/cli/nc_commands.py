"""The commands that read programs and write them: post, dda, and those under `nc`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from vmachining.cli.options import (
    Dialect,
    Home,
    Json,
    OfMachine,
    ProgramArg,
    Tools,
    ToolUnits,
    Travel,
    Units,
    above_zero,
    arg,
    command,
    examples,
    finite,
    flag,
    opt,
)

programs = typer.Typer()
nc = typer.Typer(
    help="Read NC programs: check them, list their motions.", epilog=examples("nc check part.nc"),
    no_args_is_help=True, rich_markup_mode=None,
)  # fmt: skip


@command(
    programs,
    "post:post",
    shown=(
        "post part.cls --machine ac-table --dialect fanuc --out part.nc",
        "post poses.csv --dialect sinumerik --out part.mpf",
    ),
)
class Post:
    """Write a path as a program for a control: iso, fanuc, sinumerik or heidenhain."""

    source: Annotated[Path, arg("POSES|CL", "Table of poses, CL file or NC program.")]
    out: Annotated[Path, opt("PROGRAM", "The file to write; - prints it.")]
    dialect: Annotated[str, opt(None, "iso, fanuc, sinumerik or heidenhain.")] = "iso"
    machine: Annotated[str | None, opt("NAME|FILE", "Its angles for a leaning tool (iso, fanuc).")] = None
    source_dialect: Annotated[str, opt(None, "Dialect of the source; default: detected.")] = "auto"
    decimals: Annotated[int, opt(None, "Decimals of mm, degrees and tool axes.", min=0, max=15)] = 9
    angle: Annotated[
        float, opt("DEG", "Largest deviation of the axis from its great circle.", above_zero)
    ] = 0.05
    start: Annotated[str | None, opt("A0,C90", "Angles before the program; default: fewest rewinds.")] = None
    plot: Annotated[Path | None, opt("HTML", "Page of the rotary angles and their rewinds.")] = None
    force: Annotated[bool, flag("--force", "Overwrite the file.")] = False
    as_json: Json = False


@command(
    programs,
    "dda:dda",
    shown=("dda part.nc --blu 0.01 --out pulses.csv", "dda part.nc --tools job.toml --plot pulses.html"),
)
class Dda:
    """Pulse trains for stepping motors, feed rate numbers, clocks and deviations of every motion."""

    program: ProgramArg
    blu: Annotated[float, opt("MM", "Length of one pulse.")] = 0.02
    register: Annotated[int, opt("N", "Register capacity.")] = 20_000
    mode: Annotated[str, opt("dda|s1", "s1: the historical engraver, errors included.")] = "dda"
    split: Annotated[
        bool, flag("--split", "Cut lines that overflow the register instead of refusing them.")
    ] = False
    max_rate: Annotated[float | None, opt("HZ", "Pulse rate the drives can follow.")] = None
    tools: Tools = None
    tools_units: ToolUnits = "mm"
    dialect: Dialect = "auto"
    travel: Travel = None
    machine: OfMachine = None
    home: Home = "0,0,100"
    out: Annotated[Path | None, opt("FILE", "Pulse trains as .csv or .npz.")] = None
    plot: Annotated[Path | None, opt("FILE", "Pulses and programmed path as .html.")] = None
    as_json: Json = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """How to read a program, in the words of a command line."""

    dialect: Dialect = "auto"
    units: Units = ""
    tools: Tools = None
    tools_units: ToolUnits = "mm"
    rotary: Annotated[str, opt("ABC", "Rotary axes of the machine.")] = "ABC"
    home: Home = "0,0,0"
    crc_entry: Annotated[str, opt("prev|next", "How cutter compensation enters the path.")] = ""
    crc_corner: Annotated[str, opt("arc|exact|miter|line", "How compensation treats corners.")] = ""
    taps: Annotated[str, opt("reference|axis", "Where taps in G18 and G19 go; axis: into holes.")] = (
        "reference"
    )
    dwell: Annotated[str, opt("s|ms", "Unit of P in G4 and in canned cycles.")] = "s"
    max_steps: Annotated[int, opt("N", "Most lines that loops and calls may execute.", min=1)] = 1_000_000
    subroutines: Annotated[
        list[Path] | None, opt("DIR", "Another folder of subprogram files; repeatable.")
    ] = None
    control: Annotated[
        list[str] | None,
        opt("KEY=VALUE", "A parameter of the control, such as compensation=wear; repeatable."),
    ] = None
    block_delete: Annotated[bool, flag("--block-delete", "Skip lines that open with a slash.")] = False
    from_line: Annotated[int, opt("N", "Restart at this line.", min=1)] = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Checking(Reading):
    """The same, and limits that its path is held against."""

    stock_top: Annotated[float | None, opt("Z", "mm; warns if no feed motion goes below it.", finite)] = None
    travel: Travel = None
    machine: OfMachine = None
    blu: Annotated[
        float | None, opt("MM", "Smallest step; reports coordinates between steps.", above_zero)
    ] = None


@command(
    nc,
    "nc:check",
    shown=(
        "nc check part.nc --tools job.toml",
        "nc check part.nc --machine mill.toml",
        "nc check --explain E302",
    ),
)
class Check:
    """Test a program. Exit code 0: clean, 1: it has findings of severity E."""

    program: Annotated[str | None, arg("[PROGRAM]", "NC program; - reads standard input.")] = None
    reading: Checking
    explain: Annotated[str | None, opt("CODE", "What a code such as E302 means; all: every code.")] = None
    as_json: Json = False


@command(nc, "nc:moves", shown=("nc moves part.nc --coordinates program --json",))
class Moves:
    """List the canonical motions of a program, one per line."""

    program: ProgramArg
    machine: Annotated[str | None, opt("FILE", "File or preset whose rotary axes are allowed.")] = None
    coordinates: Annotated[
        Literal["machine", "program"], opt("machine|program", "Coordinate system of end_mm.")
    ] = "machine"
    reading: Reading
    as_json: Json = False


@command(nc, "nc:plot", shown=("nc plot part.nc", "nc plot part.h --out part.html"))
class Plot:
    """Backplot a program without a job: one page with path, program and feeds."""

    program: ProgramArg
    out: Annotated[Path | None, opt("FILE", "Page to write; default: PROGRAM.html here.")] = None
    machine: Annotated[str | None, opt("FILE", "Machine of a program with rotary words.")] = None
    reading: Reading
