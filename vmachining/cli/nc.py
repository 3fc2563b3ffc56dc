"""nc check and nc moves."""

from __future__ import annotations

import sys
from pathlib import Path

from vmachining.cli.main import Code
from vmachining.cli.screen import emit, note
from vmachining.errors import InputError
from vmachining.nc import (
    Finding,
    Motion,
    Program,
    finding_record,
    move_record,
    parse_program,
    read_program,
    read_tool_table,
)

__all__ = ["check", "moves"]


def _program(name: str, dialect: str, tools: Path | None, units: str) -> Program:
    table = read_tool_table(tools, units) if tools is not None else None
    if name == "-":
        return parse_program(sys.stdin.buffer.read(), "<stdin>", dialect=dialect, tools=table)
    return read_program(name, dialect=dialect, tools=table)


def _line(program: Program, finding: Finding) -> str:
    word = f" [{finding.word}]" if finding.word else ""
    hint = f"; {finding.hint}" if finding.hint else ""
    return f"{program.name}:{finding.line}:{finding.col}: {finding.code} {finding.message}{word}{hint}"


def check(name: str, *, dialect: str, tools: Path | None, tools_units: str, as_json: bool) -> int:
    """`vmachining nc check`."""
    program = _program(name, dialect, tools, tools_units)
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


def moves(
    name: str,
    *,
    dialect: str,
    machine: Path | None,
    tools: Path | None,
    tools_units: str,
    coordinates: str,
    as_json: bool,
) -> int:
    """`vmachining nc moves`."""
    if machine is not None:
        raise InputError("--machine is not supported yet", remedy="three axes are assumed")
    if coordinates not in ("machine", "program"):
        raise InputError(f"--coordinates {coordinates}: machine or program is wanted")
    program = _program(name, dialect, tools, tools_units)
    for move in program.moves:
        record = move_record(move, coordinates)
        if as_json:
            emit(record)
            continue
        end = " ".join(f"{axis}{value:.4f}" for axis, value in zip("XYZ", record["end_mm"], strict=True))
        feed = f" F{move.feed_mm_min:g}" if move.feed_mm_min is not None else ""
        dwell = f" {move.dwell_s:g} s" if move.motion is Motion.DWELL else ""
        print(f"{move.line:>7}  {move.motion.value:<7}  {end}{feed}{dwell}  T{move.tool}")
    for finding in program.errors:
        note(_line(program, finding))
    return Code.FINDINGS if program.errors else Code.DONE
