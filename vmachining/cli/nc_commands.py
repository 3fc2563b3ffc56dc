"""The commands that read programs and write them: post, dda, and those under `nc` and `toolpath`."""

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
    within,
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


toolpath = typer.Typer(
    help="Generate tool paths: triangular pockets, surfaces of facets, ruled faces.",
    epilog=examples("toolpath pocket 100 80 60 --radius 5 --out pocket.nc"),
    no_args_is_help=True, rich_markup_mode=None,
)  # fmt: skip


@command(
    toolpath,
    "toolpath:pocket",
    shown=("toolpath pocket 100 80 60 --radius 5 --out pocket.nc --plot pocket.pdf",),
)
class Pocket:
    """Triangular pocket: four strategies, their true and published lengths, the shortest as a program."""

    sides: Annotated[tuple[float, float, float], arg("A B C", "mm, sides; the longest first.")]
    radius: Annotated[float, opt("MM", "Of cutter and corners.", above_zero)]
    strategy: Annotated[str | None, opt(None, "dp, dpi, cp or cpi; default: the shortest.")] = None
    angles: Annotated[str | None, opt("A,B,C", "Degrees, for the published formulas.")] = None
    depth: Annotated[float, opt("MM", "Of the pocket.", above_zero)] = 5.0
    step: Annotated[float | None, opt("MM", "Largest depth of a pass.", above_zero)] = None
    feed: Annotated[float, opt("MM/MIN", "Along the path.", above_zero)] = 600.0
    plunge: Annotated[float | None, opt("MM/MIN", "Feed of plunges; default: a third.", above_zero)] = None
    out: Annotated[Path | None, opt("FILE.nc", "Write the program, and a job next to it.")] = None
    plot: Annotated[
        Path | None,
        opt(
            "FILE", "Paths and areas, as .html, .svg, .pdf, .png; the page has the shortest over all shapes."
        ),
    ] = None
    as_json: Json = False


Part = Annotated[Path, arg("PART.stl|.step|.csv", "Facets, a solid that is triangulated, or points x, y, z.")]
Scale = Annotated[float, opt("MM", "mm per unit of an STL or of points; 25.4 for inches.", above_zero)]


@command(
    toolpath, "surface:drop", shown=("toolpath drop part.stl --points '0,0;5,2.5' --tool ball:10 --json",)
)
class Drop:
    """Heights of a part, or of a tool dropped onto it: a table of x, y, z and what is touched."""

    part: Part
    points: Annotated[str, opt("WHERE", "x,y;x,y or grid:MM or a file of lines x,y.")]
    tool: Annotated[
        str | None, opt("KIND:D[:R]", "flat:10, ball:10, bull:10:1; none (default): heights of the part.")
    ] = None
    chord: Annotated[float, opt("MM", "Of the facets of a STEP file.", above_zero)] = 0.01
    floor: Annotated[float | None, opt("Z", "The tip goes no lower.", finite)] = None
    scale: Scale = 1.0
    as_json: Json = False


@command(toolpath, "surface:distance", shown=("toolpath distance part.stl part.step --chord 0.001 --json",))
class Distance:
    """How far an STL is from its STEP: corners, middles of edges and of facets, outside and inside."""

    facets: Annotated[Path, arg("PART.stl", "The exported facets.")]
    solid: Annotated[Path, arg("PART.step", "The solid that they were exported from.")]
    chord: Annotated[float, opt("MM", "Accuracy of the solid.", above_zero)] = 0.001
    scale: Scale = 1.0
    as_json: Json = False


WEIGHTS = "Five axes: normals of facets, or of corners, weighted like this."
FACETS = "Facets that meet at a larger angle keep their own normals."
LOOPS = "Loops at this height; repeatable."


@command(
    toolpath,
    "surface:surface",
    shown=(
        "toolpath surface part.stl --tool ball:8 --scallop 0.01 --out part.nc",
        "toolpath surface part.step --tool bull:10:1 --step 1 --lead 5 --out part.csv",
        "toolpath surface part.step --tool bull:10:1 --step 1 --lead 5 --machine ac-table --out part.nc",
        "toolpath surface part.stl --tool flat:6 --levels 2 --out part.nc",
        "toolpath surface part.stl --turn 90,0,0 --to-origin --tool ball:8 --step 1 --out part.nc",
    ),
)
class Passes:
    """Passes over a surface in three or five axes, or waterlines, that do not cut into the part."""

    part: Part
    tool: Annotated[str, opt("KIND:D[:R]", "flat:10, ball:10 or bull:10:1, mm.")]
    scallop: Annotated[float | None, opt("MM", "Scallop height left between passes.", above_zero)] = None
    step: Annotated[float | None, opt("MM", "Distance of passes in plan.", above_zero)] = None
    chord: Annotated[float, opt("MM", "Largest distance of the path from the exact one.", above_zero)] = 0.01
    lead: Annotated[
        float | None, opt("DEG", "Five axes: the tool leans along the feed.", within(-89, 89))
    ] = None
    tilt: Annotated[float | None, opt("DEG", "Five axes: it leans across the feed.", within(-89, 89))] = None
    tilt_limit: Annotated[
        float, opt("DEG", "Largest deviation from the tilt that was given.", within(0, 180))
    ] = 30.0
    normals: Annotated[
        Literal["facet", "resultant", "area", "angle"], opt("facet|resultant|area|angle", WEIGHTS)
    ] = "angle"
    sharp: Annotated[float, opt("DEG", FACETS, within(0, 180))] = 30.0
    direction: Annotated[float, opt("DEG", "Direction of the passes, from +x.", within(-360, 360))] = 0.0
    waterline: Annotated[list[float] | None, opt("Z", LOOPS, finite)] = None
    levels: Annotated[float | None, opt("MM", "Loops at levels this far apart.", above_zero)] = None
    floor: Annotated[float | None, opt("Z", "The tip goes no lower; default: the bottom.", finite)] = None
    feed: Annotated[float, opt("MM/MIN", "Along the path.", above_zero)] = 1000.0
    spindle: Annotated[float, opt("REV/MIN", "Speed to write.", above_zero)] = 6000.0
    scale: Scale = 1.0
    turn: Annotated[str, opt("A,B,C", "Degrees about x, then y, then z, of the part.")] = "0,0,0"
    to_origin: Annotated[bool, flag("--to-origin", "Lowest corner of its box at 0, after --turn.")] = False
    move: Annotated[str, opt("X,Y,Z", "mm, after both.")] = "0,0,0"
    one_way: Annotated[bool, flag("--one-way", "All passes in one direction.")] = False
    machine: Annotated[str | None, opt("NAME|FILE", "Five axes as .nc: rotary words of this machine.")] = None
    joint_linear: Annotated[
        bool, flag("--joint-linear", "With --machine: no tool centre point control (M128).")
    ] = False
    out: Annotated[Path | None, opt("FILE", ".nc (iso), .csv (poses) or .cls (apt); a job next to it.")] = (
        None
    )
    as_json: Json = False


@command(
    toolpath,
    "surface:flank",
    shown=("toolpath flank rulings.csv --tool flat:12 --side right --out swarf.csv",),
)
class Flank:
    """A ruled face with the side of the tool (swarf): path, and how far the tool cuts into the face."""

    rulings: Annotated[Path, arg("RULINGS.csv", "Lines x1,y1,z1,x2,y2,z2: ends of rulings, the lower first.")]
    tool: Annotated[str, opt("flat:D", "Diameter of the end mill, mm.")]
    side: Annotated[
        Literal["left", "right"], opt("left|right", "Where the tool stands, seen along the feed.")
    ] = "left"
    below: Annotated[float, opt("MM", "The tip goes so far below the lower rail.", within(0, 1e3))] = 0.0
    feed: Annotated[float, opt("MM/MIN", "Along the path.", above_zero)] = 1000.0
    spindle: Annotated[float, opt("REV/MIN", "Speed to write.", above_zero)] = 6000.0
    out: Annotated[Path | None, opt("FILE", ".csv (poses), .cls (apt) or .nc (iso, upright tool).")] = None
    as_json: Json = False
