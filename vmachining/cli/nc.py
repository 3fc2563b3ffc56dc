"""nc check and nc moves."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from vmachining.cli.main import Code
from vmachining.cli.screen import emit, note
from vmachining.errors import InputError
from vmachining.nc import (
    CATALOGUE,
    MAX_BYTES,
    Finding,
    Motion,
    Point,
    Program,
    explain,
    finding_record,
    move_record,
    parse_program,
    read_program,
    read_tool_table,
)

__all__ = ["Reading", "check", "explain_code", "moves", "travel_box"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """How to read the program; home : "X,Y,Z" in mm, stock_top : mm or None."""

    dialect: str = "iso"
    tools: Path | None = None
    tools_units: str = "mm"
    rotary: str = "ABC"
    home: str = "0,0,0"
    crc_entry: str = "prev"
    crc_corner: str = "arc"
    taps: str = "reference"
    dwell: str = "s"
    max_steps: int = 1_000_000
    subroutines: tuple[Path, ...] = ()
    block_delete: bool = False
    from_line: int = 1
    stock_top: float | None = None
    travel: str | None = None
    blu: float | None = None

    def program(self, name: str) -> Program:
        """Read it; "-" is standard input."""
        options: dict[str, Any] = {
            "dialect": self.dialect,
            "tools": read_tool_table(self.tools, self.tools_units) if self.tools is not None else None,
            "rotary": self.rotary.upper(),
            "home": _point(self.home),
            "crc_entry": self.crc_entry,
            "crc_corner": self.crc_corner,
            "taps": self.taps,
            "dwell": self.dwell,
            "max_steps": self.max_steps,
            "subroutines": self.subroutines,
            "block_delete": self.block_delete,
            "start_line": self.from_line,
            "stock_top_mm": self.stock_top,
            "travel_mm": None if self.travel is None else travel_box(self.travel),
            "blu_mm": self.blu,
        }
        if name == "-":
            return parse_program(sys.stdin.buffer.read(MAX_BYTES + 1), "<stdin>", **options)
        return read_program(name, **options)


def _point(text: str) -> Point:
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--home {text}: three numbers are wanted, X,Y,Z in mm") from None
    return x, y, z


def travel_box(text: str) -> tuple[Point, Point]:
    """Corners of the travel from "X0,Y0,Z0,X1,Y1,Z1", mm in machine coordinates.

    Raises
    ------
    InputError
        Not six numbers, or an axis without any travel.
    """
    remedy = "six numbers, X0,Y0,Z0,X1,Y1,Z1 in mm"
    try:
        x0, y0, z0, x1, y1, z1 = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--travel {text}: is not a box", remedy=remedy) from None
    if not (x0 < x1 and y0 < y1 and z0 < z1):
        raise InputError(f"--travel {text}: an axis has no way to go", remedy=remedy)
    return (x0, y0, z0), (x1, y1, z1)


def _line(program: Program, finding: Finding) -> str:
    word = f" [{finding.word}]" if finding.word else ""
    hint = f"; {finding.hint}" if finding.hint else ""
    return f"{program.name}:{finding.line}:{finding.col}: {finding.code} {finding.message}{word}{hint}"


def explain_code(code: str, *, as_json: bool) -> int:
    """`vmachining nc check --explain CODE`; "all" lists the catalogue."""
    codes = sorted(CATALOGUE) if code.lower() == "all" else [code.upper()]
    for name in codes:
        try:
            entry = explain(name)
        except KeyError:
            raise InputError(f"no finding has the code {code}", remedy="--explain all lists them") from None
        if as_json:
            emit(
                {
                    "code": name,
                    "severity": name[0],
                    "title": entry.title,
                    "explanation": entry.explanation,
                    "hint": entry.hint,
                }
            )
        else:
            print(f"{name} {entry.title}\n    {entry.explanation}")
            if entry.hint:
                print(f"    Remedy: {entry.hint}.")
    return Code.DONE


def check(name: str, reading: Reading, *, as_json: bool) -> int:
    """`vmachining nc check`."""
    program = reading.program(name)
    for finding in program.findings:
        if as_json:
            emit(finding_record(finding))
        else:
            print(_line(program, finding))
    errors = len(program.errors)
    if not as_json:
        others = len(program.findings) - errors
        note(f"{program.name}: {errors} errors, {others} other findings, {len(program.moves)} motions")
    return Code.FINDINGS if errors else Code.DONE


def rotary_axes(machine: str) -> str:
    """Letters of the rotary axes of a preset or a machine file."""
    from vmachining.machine import load

    names = load(machine).names
    return "".join(letter for letter in "ABC" if letter in names)


def moves(name: str, reading: Reading, *, coordinates: str, as_json: bool) -> int:
    """`vmachining nc moves`."""
    if coordinates not in ("machine", "program"):
        raise InputError(f"--coordinates {coordinates}: machine or program is wanted")
    program = reading.program(name)
    for move in program.moves:
        record = move_record(move, coordinates)
        if as_json:
            emit(record)
            continue
        end = " ".join(f"{axis}{value:.4f}" for axis, value in zip("XYZ", record["end_mm"], strict=True))
        turned = "".join(f" {axis.upper()}{value:.4f}" for axis, value in record["rotary_deg"].items())
        feed = f" F{move.feed_mm_min:g}" if move.feed_mm_min is not None else ""
        dwell = f" {move.dwell_s:g} s" if move.motion is Motion.DWELL else ""
        print(f"{move.line:>7}  {move.motion.value:<7}  {end}{turned}{feed}{dwell}  T{move.tool}")
    for finding in program.errors:
        note(_line(program, finding))
    return Code.FINDINGS if program.errors else Code.DONE
