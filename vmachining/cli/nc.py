"""nc check, nc moves and nc plot."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from vmachining import nc
from vmachining.cli.main import Code
from vmachining.cli.nc_commands import Check, Checking, Moves, Plot, Reading
from vmachining.cli.options import belong, three
from vmachining.cli.screen import emit, note
from vmachining.errors import InputError

if TYPE_CHECKING:
    from vmachining.job.mill import Mill


def read(name: str, reading: Reading) -> nc.Program:
    """Read a program; "-" is standard input. With a machine, what is beyond its ranges is a finding."""
    pairs = [text.partition("=") for text in reading.control or ()]
    if odd := ["".join(pair) for pair in pairs if not pair[1]]:
        raise InputError(f"--control {odd[0]}: it must be KEY=VALUE", remedy="such as compensation=wear")
    if reading.tools is None:
        belong(reading, ("tools_units",), "is the unit of a table, which --tools names")
    options: dict[str, Any] = {
        "dialect": reading.dialect, "units": reading.units, "rotary": reading.rotary.upper(),
        "home": three(reading.home, "--home", "X,Y,Z in mm"),
        "tools": None if reading.tools is None else nc.read_tool_table(reading.tools, reading.tools_units),
        "crc_entry": reading.crc_entry, "crc_corner": reading.crc_corner, "taps": reading.taps, "dwell": reading.dwell,
        "max_steps": reading.max_steps, "subroutines": tuple(reading.subroutines or ()),
        "control": {key.strip(): value.strip() for key, _, value in pairs}, "block_delete": reading.block_delete,
        "start_line": reading.from_line,
    }  # fmt: skip
    if isinstance(reading, Checking):
        travel = None if reading.travel is None else travel_box(reading.travel)
        options |= {"stock_top_mm": reading.stock_top, "travel_mm": travel, "blu_mm": reading.blu}
    mill = _mill(reading.machine) if isinstance(reading, Checking) and reading.machine is not None else None
    if mill is not None:
        options["rotary"] = rotary_letters(mill)
    if name == "-":
        program = nc.parse_program(sys.stdin.buffer.read(nc.MAX_BYTES + 1), "<stdin>", **options)
    else:
        program = nc.read_program(name, **options)
    if mill is None:
        return program
    from vmachining.job.ranges import range_findings, unchecked

    if words := unchecked(mill):
        note(words)
    found = sorted([*program.findings, *range_findings(program, mill)], key=lambda f: (f.line, f.col, f.code))
    return replace(program, findings=tuple(found))


def _mill(machine: str) -> Mill:
    """A preset or a machine file: only with one the room of jobs and its kernels are loaded."""
    from vmachining.job.mill import Mill

    return Mill.load(machine)


def rotary_letters(mill: Mill) -> str:
    return "" if mill.chain is None else "".join(letter for letter in "ABC" if letter in mill.chain.names)


def travel_box(text: str) -> tuple[nc.Point, nc.Point]:
    """Corners of the travel from "X0,Y0,Z0,X1,Y1,Z1", mm in machine coordinates.

    Raises InputError: Not six numbers, or an axis without any travel.
    """
    remedy = "six numbers, X0,Y0,Z0,X1,Y1,Z1 in mm"
    try:
        x0, y0, z0, x1, y1, z1 = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--travel {text}: is not a box", remedy=remedy) from None
    if not (x0 < x1 and y0 < y1 and z0 < z1):
        raise InputError(f"--travel {text}: an axis has no travel", remedy=remedy)
    return (x0, y0, z0), (x1, y1, z1)


ASSUMED = ("I212", "I213", "I374")
"""Findings that say how a program was understood: its dialect, what its control assumes, where pulses begin."""


def note_findings(program: nc.Program) -> int:
    """Say on stderr what may be wrong with a path, and what was assumed; the exit code."""
    for finding in program.findings:
        if finding.severity != "I" or finding.code in ASSUMED:
            note(_line(program, finding))
    return Code.FINDINGS if program.errors else Code.DONE


def _line(program: nc.Program, finding: nc.Finding) -> str:
    word = f" [{finding.word}]" if finding.word else ""
    hint = f"; {finding.hint}" if finding.hint else ""
    return f"{program.name}:{finding.line}:{finding.col}: {finding.code} {finding.message}{word}{hint}"


def _explained(code: str, *, as_json: bool) -> int:
    """`vmachining nc check --explain CODE`; "all" lists the catalogue."""
    codes = sorted(nc.CATALOGUE) if code.lower() == "all" else [code.upper()]
    for name in codes:
        try:
            entry = nc.explain(name)
        except KeyError:
            raise InputError(f"no finding has the code {code}", remedy="--explain all lists them") from None
        if as_json:
            told = {"title": entry.title, "explanation": entry.explanation, "hint": entry.hint}
            emit({"code": name, "severity": name[0], **told})
        else:
            print(f"{name} {entry.title}\n    {entry.explanation}")
            if entry.hint:
                print(f"    Remedy: {entry.hint}.")
    return Code.DONE


def check(o: Check) -> int:
    if o.explain is not None:
        return _explained(o.explain, as_json=o.as_json)
    if o.program is None:
        raise typer.BadParameter("a program, or --explain CODE, is expected")
    program = read(o.program, o.reading)
    for finding in program.findings:
        if o.as_json:
            emit(nc.finding_record(finding))
        else:
            print(_line(program, finding))
    errors = len(program.errors)
    if not o.as_json:
        others = len(program.findings) - errors
        note(f"{program.name}: {errors} errors, {others} other findings, {len(program.moves)} motions")
    return Code.FINDINGS if errors else Code.DONE


def _on(reading: Reading, machine: str | None) -> Reading:
    """With the rotary axes of a preset or a machine file."""
    if machine is None:
        return reading
    return replace(reading, rotary=rotary_letters(_mill(machine)))


def moves(o: Moves) -> int:
    program = read(o.program, _on(o.reading, o.machine))
    for move in program.moves:
        record = nc.move_record(move, o.coordinates)
        if o.as_json:
            emit(record)
            continue
        end = " ".join(f"{axis}{value:.4f}" for axis, value in zip("XYZ", record["end_mm"], strict=True))
        turned = "".join(f" {axis.upper()}{value:.4f}" for axis, value in record["rotary_deg"].items())
        feed = f" F{move.feed_mm_min:g}" if move.feed_mm_min is not None else ""
        dwell = f" {move.dwell_s:g} s" if move.motion is nc.Motion.DWELL else ""
        print(f"{move.line:>7}  {move.motion.value:<7}  {end}{turned}{feed}{dwell}  T{move.tool}")
    return note_findings(program)


def plot(o: Plot) -> int:
    from vmachining.job.toolpath import Toolpath
    from vmachining.report.live import write_backplot

    name, machine = o.program, o.machine
    program = read(name, _on(o.reading, machine))
    toolpath = Toolpath.of(program, None if machine is None else _mill(machine).chain)
    if not toolpath.blocks:
        found = f": {program.errors[0].message}" if program.errors else ""
        raise InputError(
            f"the program moves nothing{found}", file=name, remedy="nc check names what is wrong"
        )
    page = o.out if o.out is not None else Path(f"{'program' if name == '-' else Path(name).stem}.html")
    write_backplot(toolpath, page)
    print(page)
    return note_findings(program)
