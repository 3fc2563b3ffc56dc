"""The commands under `vmachining toolpath`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from vmachining.cli.options import Json, examples

__all__ = ["toolpath"]

toolpath = typer.Typer(
    help="Generate tool paths: triangular pockets.",
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
