"""Options that several commands take, once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

__all__ = [
    "BlockDelete",
    "CrcCorner",
    "CrcEntry",
    "Dialect",
    "Dwell",
    "FromLine",
    "Home",
    "Json",
    "MaxSteps",
    "Out",
    "ProgramArg",
    "Quiet",
    "Resume",
    "Rotary",
    "StockOut",
    "Subroutines",
    "Taps",
    "ToolUnits",
    "Tools",
    "Travel",
    "examples",
]


def examples(*lines: str) -> str:
    """The end of a help text: command lines, each on a line of its own however narrow the terminal."""
    head = "Examples:" if lines[1:] else "Example:"
    return "\b\n" + "\n".join([head, *(f"  vmachining {line}" for line in lines)])


Out = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Result directory; default out/NAME.")]
Resume = Annotated[bool, typer.Option("--resume", help="Go on where an interrupted run stopped.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress, no summary; errors only.")]
Json = Annotated[bool, typer.Option("--json", help="Machine-readable output on stdout, nothing else there.")]
StockOut = Annotated[
    str,
    typer.Option("--stock", metavar="LIST", help="Finished stock as stl, 3mf, step (comma list)."),
]
ProgramArg = Annotated[str, typer.Argument(metavar="PROGRAM", help="NC program; - reads standard input.")]
Dialect = Annotated[str, typer.Option("--dialect", help="Program dialect: iso, mts, apt, poses.")]
Tools = Annotated[
    Path | None,
    typer.Option("--tools", metavar="FILE", help="Tool table: a job file, or a LinuxCNC .tbl."),
]
Rotary = Annotated[str, typer.Option("--rotary", metavar="ABC", help="Rotary axes of the machine.")]
Home = Annotated[
    str, typer.Option("--home", metavar="X,Y,Z", help="mm; where the tool starts, and G28 goes.")
]
CrcEntry = Annotated[
    str, typer.Option("--crc-entry", metavar="prev|next", help="How cutter compensation enters the path.")
]
CrcCorner = Annotated[
    str, typer.Option("--crc-corner", metavar="arc|exact|miter", help="What it does at corners.")
]
Taps = Annotated[
    str,
    typer.Option("--taps", metavar="reference|axis", help="Where taps in G18 and G19 go; axis: into holes."),
]
Dwell = Annotated[str, typer.Option("--dwell", metavar="s|ms", help="Unit of P in G4 and in canned cycles.")]
MaxSteps = Annotated[
    int, typer.Option("--max-steps", metavar="N", min=1, help="Lines that loops and calls may repeat.")
]
Subroutines = Annotated[
    list[Path] | None,
    typer.Option("--subroutines", metavar="DIR", help="More folders with subprograms in files; repeatable."),
]
Travel = Annotated[
    str | None,
    typer.Option(
        "--travel", metavar="X0,Y0,Z0,X1,Y1,Z1", help="mm, machine coordinates; what leaves it is E373."
    ),
]
BlockDelete = Annotated[bool, typer.Option("--block-delete", help="Skip lines that open with a slash.")]
FromLine = Annotated[int, typer.Option("--from-line", metavar="N", min=1, help="Restart at this line.")]
ToolUnits = Annotated[str, typer.Option("--tools-units", metavar="mm|inch", help="Unit of a .tbl table.")]
