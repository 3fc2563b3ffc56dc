"""The commands under `vmachining toolpath`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from vmachining.cli.options import Json, examples

__all__ = ["toolpath"]

toolpath = typer.Typer(
    help="Generate tool paths: triangular pockets, surfaces of facets.",
    epilog=examples("toolpath pocket 100 80 60 --radius 5 --out pocket.nc"),
    no_args_is_help=True, rich_markup_mode=None,
)  # fmt: skip


@toolpath.command(
    "pocket",
    epilog=examples("toolpath pocket 100 80 60 --radius 5 --out pocket.nc --plot pocket.html"),
)
def toolpath_pocket(
    sides: Annotated[
        tuple[float, float, float], typer.Argument(metavar="A B C", help="mm, sides; the longest first.")
    ],
    radius: Annotated[float, typer.Option("--radius", metavar="MM", help="Of cutter and corners.")],
    strategy: Annotated[
        str | None, typer.Option("--strategy", help="dp, dpi, cp or cpi; default: the shortest.")
    ] = None,
    angles: Annotated[
        str | None, typer.Option("--angles", metavar="A,B,C", help="Degrees, for the published formulas.")
    ] = None,
    depth: Annotated[float, typer.Option("--depth", metavar="MM", help="Of the pocket.")] = 5.0,
    step: Annotated[
        float | None, typer.Option("--step", metavar="MM", help="Largest depth of a pass.")
    ] = None,
    feed: Annotated[float, typer.Option("--feed", metavar="MM/MIN", help="Along the path.")] = 600.0,
    plunge: Annotated[
        float | None, typer.Option("--plunge", metavar="MM/MIN", help="Feed of plunges; default: a third.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE.nc", help="Write the program, and a job beside it.")
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option("--plot", metavar="FILE.html", help="Paths, and the shortest over all shapes."),
    ] = None,
    as_json: Json = False,
) -> int:
    """Triangular pocket: four strategies, their true and published lengths, the shortest as a program."""
    from vmachining.cli import toolpath as room

    return room.pocket(
        sides, radius, strategy=strategy, angles=angles, depth=depth, step=step, feed=feed, plunge=plunge, out=out,
        plot=plot, as_json=as_json,
    )  # fmt: skip


Part = Annotated[
    Path, typer.Argument(metavar="PART.stl|.step", help="Facets, or a solid that is triangulated.")
]
Scale = Annotated[
    float, typer.Option("--scale", metavar="MM", help="mm per unit of an STL; 25.4 for inches.")
]


@toolpath.command(
    "drop", epilog=examples("toolpath drop part.stl --points '0,0;5,2.5' --tool ball:10 --json")
)
def toolpath_drop(
    part: Part,
    points: Annotated[
        str, typer.Option("--points", metavar="WHERE", help="x,y;x,y or grid:MM or a file of lines x,y.")
    ],
    tool: Annotated[
        str | None,
        typer.Option("--tool", metavar="KIND:D[:R]", help="flat:10, ball:10, bull:10:1; none: heights."),
    ] = None,
    chord: Annotated[
        float, typer.Option("--chord", metavar="MM", help="Of the facets of a STEP file.")
    ] = 0.01,
    floor: Annotated[
        float | None, typer.Option("--floor", metavar="Z", help="The tip goes no lower.")
    ] = None,
    scale: Scale = 1.0,
    as_json: Json = False,
) -> int:
    """Heights of a part, or of a tool that comes down on it: a table of x, y, z and what is touched."""
    from vmachining.cli import surface as room

    return room.drop(part, points=points, tool=tool, chord=chord, floor=floor, scale=scale, as_json=as_json)


@toolpath.command(
    "surface",
    epilog=examples(
        "toolpath surface part.stl --tool ball:8 --scallop 0.01 --out part.nc",
        "toolpath surface part.step --tool bull:10:1 --step 1 --lead 5 --out part.csv",
        "toolpath surface part.step --tool bull:10:1 --step 1 --lead 5 --machine ac-table --out part.nc",
        "toolpath surface part.stl --tool flat:6 --levels 2 --out part.nc",
    ),
)
def toolpath_surface(
    part: Part,
    tool: Annotated[
        str, typer.Option("--tool", metavar="KIND:D[:R]", help="flat:10, ball:10 or bull:10:1, mm.")
    ],
    scallop: Annotated[
        float | None, typer.Option("--scallop", metavar="MM", help="Height of the ridges that stay.")
    ] = None,
    step: Annotated[
        float | None, typer.Option("--step", metavar="MM", help="Distance of passes in plan.")
    ] = None,
    chord: Annotated[
        float, typer.Option("--chord", metavar="MM", help="Largest distance of the path from the exact one.")
    ] = 0.01,
    lead: Annotated[
        float | None, typer.Option("--lead", metavar="DEG", help="Five axes: the tool leans along the feed.")
    ] = None,
    tilt: Annotated[
        float | None, typer.Option("--tilt", metavar="DEG", help="Five axes: it leans across the feed.")
    ] = None,
    tilt_limit: Annotated[
        float, typer.Option("--tilt-limit", metavar="DEG", help="How far the tilt may leave the asked one.")
    ] = 30.0,
    normals: Annotated[
        str, typer.Option("--normals", help="Five axes: facet, resultant, area or angle weighted.")
    ] = "angle",
    direction: Annotated[
        float, typer.Option("--direction", metavar="DEG", help="Of the passes, from +x.")
    ] = 0.0,
    waterline: Annotated[
        list[float] | None,
        typer.Option("--waterline", metavar="Z", help="Loops at this height; may stand several times."),
    ] = None,
    levels: Annotated[
        float | None, typer.Option("--levels", metavar="MM", help="Loops at heights so far apart.")
    ] = None,
    floor: Annotated[
        float | None, typer.Option("--floor", metavar="Z", help="The tip goes no lower; default: the bottom.")
    ] = None,
    feed: Annotated[float, typer.Option("--feed", metavar="MM/MIN", help="Along the path.")] = 1000.0,
    spindle: Annotated[float, typer.Option("--spindle", metavar="REV/MIN", help="Written to it.")] = 6000.0,
    scale: Scale = 1.0,
    one_way: Annotated[bool, typer.Option("--one-way", help="All passes in one direction.")] = False,
    machine: Annotated[
        str | None,
        typer.Option(
            "--machine", metavar="NAME|FILE", help="Five axes as .nc: rotary words of this machine."
        ),
    ] = None,
    joint_linear: Annotated[
        bool, typer.Option("--joint-linear", help="With --machine: no tool centre point control (M128).")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="FILE", help=".nc (iso), .csv (poses) or .cls (apt); a job beside it."),
    ] = None,
    as_json: Json = False,
) -> int:
    """Passes over a surface in three or five axes, or waterlines, that do not cut into the part."""
    from vmachining.cli import surface as room

    return room.surface(
        part, tool=tool, scallop=scallop, step=step, chord=chord, lead=lead, tilt=tilt, tilt_limit=tilt_limit, normals=normals,
        direction=direction, waterline=waterline, levels=levels, floor=floor, feed=feed, spindle=spindle, scale=scale,
        one_way=one_way, machine=machine, joint_linear=joint_linear, out=out, as_json=as_json,
    )  # fmt: skip
