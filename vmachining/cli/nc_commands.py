"""The commands that read programs and write them: post, dda, and those under `nc` and `toolpath`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import typer

from vmachining.cli import options as each
from vmachining.cli.options import (
    above_zero,
    arg,
    argument,
    command,
    examples,
    finite,
    flag,
    opt,
    option,
    within,
)

programs = typer.Typer()
nc = typer.Typer(
    help="Read NC programs: check them, list their motions.", epilog=examples("nc check part.nc"),
    no_args_is_help=True, rich_markup_mode=None,
)  # fmt: skip


@command(
    programs,
    "machine:post",
    "post part.cls --machine ac-table --dialect fanuc --out part.nc",
    "post poses.csv --dialect sinumerik --out part.mpf",
)
class Post:
    """Write a path as a program for a control: iso, fanuc, sinumerik or heidenhain."""

    source: Path = arg("POSES|CL", "Table of poses, CL file or NC program.")
    out: Path = opt(..., "PROGRAM", "File to write; - prints it.")
    dialect: str = opt("iso", None, "iso, fanuc, sinumerik or heidenhain.")
    machine: str | None = opt(None, "NAME|FILE", "Machine whose rotary angles lean the tool (iso, fanuc).")
    source_dialect: str = opt("auto", None, "Dialect of the source; default: detected.")
    decimals: int = opt(9, None, "Decimals of mm, degrees and tool axes.", min=0, max=15)
    angle: float = opt(0.05, "DEG", "Largest deviation of the axis from its great circle.", above_zero)
    start: str | None = opt(None, "A0,C90", "Rotary angles before the program; default: fewest rewinds.")
    plot: Path | None = opt(None, "HTML", "Draw the rotary angles and their rewinds on a page.")
    force: bool = flag("--force", "Overwrite the file.")
    as_json: each.Json = False


@command(
    programs,
    "dda:dda",
    "dda part.nc --blu 0.01 --out pulses.csv",
    "dda part.nc --tools job.toml --plot pulses.html",
)
class Dda:
    """Compute pulse trains for stepping motors, feed rate numbers, clocks and deviations of every motion."""

    program: each.ProgramArg
    blu: float = opt(0.02, "MM", "Length of one pulse.")
    register: int = opt(20_000, "N", "Register capacity.")
    mode: str = opt("dda", "dda|s1", "s1: the historical engraver, errors included.")
    split: bool = flag("--split", "Divide lines that overflow the register instead of refusing them.")
    max_rate: float | None = opt(None, "HZ", "Pulse rate the drives can follow.")
    tools: each.Tools = None
    tools_units: each.ToolUnits = "mm"
    dialect: each.Dialect = "auto"
    travel: each.Travel = None
    machine: each.OfMachine = None
    home: each.Home = "0,0,100"
    out: Path | None = opt(None, "FILE", "Pulse trains as .csv or .npz.")
    plot: Path | None = opt(None, "FILE", "Pulses and programmed path as .html.")
    as_json: each.Json = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """How to read a program, in the words of a command line."""

    dialect: each.Dialect = "auto"
    units: each.Units = ""
    tools: each.Tools = None
    tools_units: each.ToolUnits = "mm"
    rotary: str = opt("ABC", "ABC", "Rotary axes of the machine.")
    home: each.Home = "0,0,0"
    crc_entry: str = opt("", "prev|next", "How cutter compensation enters the path.")
    crc_corner: str = opt("", "arc|exact|miter|line", "How compensation treats corners.")
    taps: str = opt("reference", "reference|axis", "Direction of taps in G18 and G19; axis: along the hole.")
    dwell: str = opt("s", "s|ms", "Unit of P in G4 and in canned cycles.")
    max_steps: int = opt(1_000_000, "N", "Largest number of lines that loops and calls may execute.", min=1)
    subroutines: list[Path] | None = opt(None, "DIR", "Another folder with subprogram files; repeatable.")
    control: list[str] | None = opt(
        None, "KEY=VALUE", "A parameter of the control, such as compensation=wear; repeatable."
    )
    block_delete: bool = flag("--block-delete", "Skip lines that begin with a slash.")
    from_line: int = opt(1, "N", "Restart at this line.", min=1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Checking(Reading):
    """The same, and limits that its path is held against."""

    stock_top: float | None = opt(None, "Z", "mm; warns if no feed motion goes below it.", finite)
    travel: each.Travel = None
    machine: each.OfMachine = None
    blu: float | None = opt(None, "MM", "Smallest step; reports coordinates between steps.", above_zero)


@command(
    nc,
    "nc:check",
    "nc check part.nc --tools job.toml",
    "nc check part.nc --machine mill.toml",
    "nc check --explain E302",
)
class Check:
    """Check a program. Exit code 0: no errors, 1: findings of severity E."""

    program: str | None = arg("[PROGRAM]", "NC program; - reads standard input.", None)
    reading: Checking
    explain: str | None = opt(None, "CODE", "What a code such as E302 means; all: every code.")
    as_json: each.Json = False


@command(nc, "nc:moves", "nc moves part.nc --coordinates program --json")
class Moves:
    """List the motions of a program, one per line."""

    program: each.ProgramArg
    machine: str | None = opt(None, "FILE", "File or preset whose rotary axes are allowed.")
    coordinates: Literal["machine", "program"] = opt("machine", None, "Coordinate system of end_mm.")
    reading: Reading
    as_json: each.Json = False


@command(nc, "nc:plot", "nc plot part.nc", "nc plot part.h --out part.html")
class Plot:
    """Backplot a program without a job: one page with path, program and feeds."""

    program: each.ProgramArg
    out: Path | None = opt(None, "FILE", "Page to write; default: PROGRAM.html in this directory.")
    machine: str | None = opt(None, "FILE", "Machine for a program with rotary words.")
    reading: Reading


toolpath = typer.Typer(
    help="Generate tool paths: triangular pockets, surfaces of facets, ruled faces.",
    epilog=examples("toolpath pocket 100 80 60 --radius 5 --out pocket.nc"),
    no_args_is_help=True, rich_markup_mode=None,
)  # fmt: skip


@command(
    toolpath, "toolpath:pocket", "toolpath pocket 100 80 60 --radius 5 --out pocket.nc --plot pocket.pdf"
)
class Pocket:
    """Compare four strategies in a triangular pocket by true and published length; write the shortest as a program."""

    sides: tuple[float, float, float] = arg("A B C", "mm, sides; the longest first.")
    radius: float = opt(..., "MM", "Radius of cutter and corners.", above_zero)
    strategy: str | None = opt(None, None, "dp, dpi, cp or cpi; default: the shortest.")
    angles: str | None = opt(None, "A,B,C", "Angles for the published formulas, degrees.")
    depth: float = opt(5.0, "MM", "Depth of the pocket.", above_zero)
    step: float | None = opt(None, "MM", "Largest depth of a pass.", above_zero)
    feed: float = opt(600.0, "MM/MIN", "Feed along the path.", above_zero)
    plunge: float | None = opt(None, "MM/MIN", "Feed of plunges; default: a third of --feed.", above_zero)
    out: Path | None = opt(None, "FILE.nc", "Write the program, and a job next to it.")
    plot: Path | None = opt(
        None,
        "FILE",
        "Draw paths and areas as .html, .svg, .pdf or .png; the page maps the shortest over all shapes.",
    )
    as_json: each.Json = False


Part = Annotated[
    Path, argument("PART.stl|.step|.csv", "Facets, a solid that is triangulated, or points x, y, z.")
]
Scale = Annotated[float, option("MM", "mm per unit of an STL or of points; 25.4 for inches.", above_zero)]


@command(toolpath, "toolpath:drop", "toolpath drop part.stl --points '0,0;5,2.5' --tool ball:10 --json")
class Drop:
    """Print heights of a part, or of a tool dropped onto it, as a table of x, y, z and the feature touched."""

    part: Part
    points: str = opt(..., "WHERE", "x,y;x,y or grid:MM or a file of lines x,y.")
    tool: str | None = opt(
        None, "KIND:D[:R]", "flat:10, ball:10, bull:10:1; none (default): heights of the part."
    )
    chord: float = opt(0.01, "MM", "Chord of the facets of a STEP file.", above_zero)
    floor: float | None = opt(None, "Z", "The tip goes no lower.", finite)
    scale: Scale = 1.0
    as_json: each.Json = False


@command(toolpath, "toolpath:distance", "toolpath distance part.stl part.step --chord 0.001 --json")
class Distance:
    """Measure how far an STL is from its STEP, outside and inside: corners, middles of edges and of facets."""

    facets: Path = arg("PART.stl", "The exported facets.")
    solid: Path = arg("PART.step", "The solid that they were exported from.")
    chord: float = opt(0.001, "MM", "Accuracy of the solid.", above_zero)
    scale: Scale = 1.0
    as_json: each.Json = False


WEIGHTS = "Five axes: normals of facets, or of corners, weighted like this."
FACETS = "Facets that meet at a larger angle keep their own normals."
LOOPS = "Loops at this height; repeatable."


@command(
    toolpath,
    "toolpath:surface",
    "toolpath surface part.stl --tool ball:8 --scallop 0.01 --out part.nc",
    "toolpath surface part.step --tool bull:10:1 --step 1 --lead 5 --out part.csv",
    "toolpath surface part.step --tool bull:10:1 --step 1 --lead 5 --machine ac-table --out part.nc",
    "toolpath surface part.stl --tool flat:6 --levels 2 --out part.nc",
    "toolpath surface part.stl --turn 90,0,0 --to-origin --tool ball:8 --step 1 --out part.nc",
)
class Passes:
    """Generate passes over a surface in three or five axes, or waterlines, that do not cut into the part."""

    part: Part
    tool: str = opt(..., "KIND:D[:R]", "flat:10, ball:10 or bull:10:1, mm.")
    scallop: float | None = opt(None, "MM", "Scallop height left between passes.", above_zero)
    step: float | None = opt(None, "MM", "Distance between passes in plan.", above_zero)
    chord: float = opt(0.01, "MM", "Largest distance of the path from the exact one.", above_zero)
    lead: float | None = opt(None, "DEG", "Five axes: lean of the tool along the feed.", within(-89, 89))
    tilt: float | None = opt(None, "DEG", "Five axes: lean of the tool across the feed.", within(-89, 89))
    tilt_limit: float = opt(30.0, "DEG", "Largest deviation from --tilt.", within(0, 180))
    normals: Literal["facet", "resultant", "area", "angle"] = opt("angle", None, WEIGHTS)
    sharp: float = opt(30.0, "DEG", FACETS, within(0, 180))
    direction: float = opt(0.0, "DEG", "Direction of the passes, from +x.", within(-360, 360))
    waterline: list[float] | None = opt(None, "Z", LOOPS, finite)
    levels: float | None = opt(None, "MM", "Loops at levels this far apart.", above_zero)
    floor: float | None = opt(None, "Z", "The tip goes no lower; default: the bottom.", finite)
    feed: float = opt(1000.0, "MM/MIN", "Feed along the path.", above_zero)
    spindle: float = opt(6000.0, "REV/MIN", "Spindle speed to write.", above_zero)
    scale: Scale = 1.0
    turn: str = opt("0,0,0", "A,B,C", "Turn the part about x, then y, then z, degrees.")
    to_origin: bool = flag("--to-origin", "Put the lowest corner of its box at 0, after --turn.")
    move: str = opt("0,0,0", "X,Y,Z", "Move the part last, mm.")
    one_way: bool = flag("--one-way", "All passes in one direction.")
    machine: str | None = opt(None, "NAME|FILE", "Five axes as .nc: write rotary words of this machine.")
    joint_linear: bool = flag("--joint-linear", "With --machine: no tool centre point control (M128).")
    out: Path | None = opt(None, "FILE", ".nc (iso), .csv (poses) or .cls (apt); a job next to it.")
    as_json: each.Json = False


@command(toolpath, "toolpath:flank", "toolpath flank rulings.csv --tool flat:12 --side right --out swarf.csv")
class Flank:
    """Cut a ruled face with the side of the tool (swarf); reports how far the tool cuts into the face."""

    rulings: Path = arg("RULINGS.csv", "Lines x1,y1,z1,x2,y2,z2: ends of a ruling, the lower first.")
    tool: str = opt(..., "flat:D", "Diameter of the end mill, mm.")
    side: Literal["left", "right"] = opt("left", None, "Side on which the tool runs, seen along the feed.")
    below: float = opt(0.0, "MM", "Distance of the tip below the lower rail.", within(0, 1e3))
    feed: float = opt(1000.0, "MM/MIN", "Feed along the path.", above_zero)
    spindle: float = opt(6000.0, "REV/MIN", "Spindle speed to write.", above_zero)
    out: Path | None = opt(None, "FILE", ".csv (poses), .cls (apt) or .nc (iso, upright tool).")
    as_json: each.Json = False
