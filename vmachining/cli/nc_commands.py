"""The `nc` commands of the tree."""

from __future__ import annotations

from typing import Annotated

import typer

from vmachining.cli.options import (
    BlockDelete,
    CrcCorner,
    CrcEntry,
    Dialect,
    Dwell,
    FromLine,
    Home,
    Json,
    MaxSteps,
    ProgramArg,
    Rotary,
    Subroutines,
    Taps,
    Tools,
    ToolUnits,
    Travel,
    examples,
)

__all__ = ["nc"]

nc = typer.Typer(
    help="Read NC programs: test them, list their motions.", epilog=examples("nc check part.nc"),
    no_args_is_help=True, rich_markup_mode=None,
)  # fmt: skip


@nc.command(
    "check",
    epilog=examples(
        "nc check part.nc --tools job.toml", "nc check - --json < part.nc", "nc check --explain E302"
    ),
)
def nc_check(
    program: Annotated[
        str | None, typer.Argument(metavar="[PROGRAM]", help="NC program; - reads standard input.")
    ] = None,
    dialect: Dialect = "iso",
    tools: Tools = None,
    tools_units: ToolUnits = "mm",
    rotary: Rotary = "ABC",
    home: Home = "0,0,0",
    crc_entry: CrcEntry = "prev",
    crc_corner: CrcCorner = "arc",
    taps: Taps = "reference",
    dwell: Dwell = "s",
    max_steps: MaxSteps = 1_000_000,
    subroutines: Subroutines = None,
    block_delete: BlockDelete = False,
    from_line: FromLine = 1,
    stock_top: Annotated[
        float | None, typer.Option("--stock-top", metavar="Z", help="mm; warns if no feed motion goes below.")
    ] = None,
    travel: Travel = None,
    blu: Annotated[
        float | None, typer.Option("--blu", metavar="MM", help="Smallest step; says what lies between steps.")
    ] = None,
    code: Annotated[
        str | None,
        typer.Option("--explain", metavar="CODE", help="What a code such as E302 means; all: every code."),
    ] = None,
    as_json: Json = False,
) -> int:
    """Test a program. Exit code 0: clean, 1: it has findings of severity E."""
    from vmachining.cli import nc as room

    if code is not None:
        return room.explain_code(code, as_json=as_json)
    if program is None:
        raise typer.BadParameter("a program, or --explain CODE, is wanted")
    reading = room.Reading(
        dialect=dialect,
        tools=tools,
        tools_units=tools_units,
        rotary=rotary,
        home=home,
        crc_entry=crc_entry,
        crc_corner=crc_corner,
        taps=taps,
        dwell=dwell,
        max_steps=max_steps,
        subroutines=tuple(subroutines or ()),
        block_delete=block_delete,
        from_line=from_line,
        stock_top=stock_top,
        travel=travel,
        blu=blu,
    )
    return room.check(program, reading, as_json=as_json)


@nc.command("moves", epilog=examples("nc moves part.nc --coordinates program --json"))
def nc_moves(
    program: ProgramArg,
    dialect: Dialect = "iso",
    machine: Annotated[
        str | None,
        typer.Option("--machine", metavar="FILE", help="Its rotary axes are allowed; a preset will do."),
    ] = None,
    tools: Tools = None,
    tools_units: ToolUnits = "mm",
    coordinates: Annotated[
        str, typer.Option("--coordinates", metavar="machine|program", help="Which coordinates end_mm has.")
    ] = "machine",
    rotary: Rotary = "ABC",
    home: Home = "0,0,0",
    crc_entry: CrcEntry = "prev",
    crc_corner: CrcCorner = "arc",
    taps: Taps = "reference",
    dwell: Dwell = "s",
    max_steps: MaxSteps = 1_000_000,
    subroutines: Subroutines = None,
    block_delete: BlockDelete = False,
    from_line: FromLine = 1,
    as_json: Json = False,
) -> int:
    """List the canonical motions of a program, one per line."""
    from vmachining.cli import nc as room

    reading = room.Reading(
        dialect=dialect,
        tools=tools,
        tools_units=tools_units,
        rotary=rotary if machine is None else room.rotary_axes(machine),
        home=home,
        crc_entry=crc_entry,
        crc_corner=crc_corner,
        taps=taps,
        dwell=dwell,
        max_steps=max_steps,
        subroutines=tuple(subroutines or ()),
        block_delete=block_delete,
        from_line=from_line,
    )
    return room.moves(program, reading, coordinates=coordinates, as_json=as_json)
