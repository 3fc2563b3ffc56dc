"""Reads a program: from a file or from bytes, in any dialect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from vmachining.errors import NCError
from vmachining.nc.conventions import arcs_open, closing, lengths, names_unit, quill, unit_of, worn
from vmachining.nc.dialects import AUTO, TABLE, Reading, is_g_code, is_marked, read_lines, recognise, strange
from vmachining.nc.fanuc_lines import as_lathe, folded, is_lathe, swapped, without_header
from vmachining.nc.files import MAX_BYTES, decode_program
from vmachining.nc.findings import check_moves, finding
from vmachining.nc.lexer import split_lines
from vmachining.nc.model import Finding, Program
from vmachining.nc.settings import Settings, UnitName
from vmachining.nc.state import work_offset_codes

MANY = 3
"""Errors of the default dialect for each of another one, from which that one gives the better account."""


def _unit(lines: Sequence[str], guessed: bool) -> tuple[UnitName, list[Finding]]:
    """The unit of a program that names none; taken if the dialect is detected as well, otherwise only reported."""
    unit = unit_of(lines)
    if not guessed:
        if unit.name != "inch" or not unit.sure:
            return "", []
        what = f"no word names the unit: lengths are read as mm, but {unit.why} speak for inches"
        return "", [finding("W213", 1, None, what)]
    if unit.name:
        full = "inches" if unit.name == "inch" else "mm"
        what = f"no word names the unit: lengths are read as {full}, because of {unit.why}"
        hint = 'if it is otherwise: units = "mm" or "inch" under [program], or --units'
        return unit.name, [finding("I213", 1, None, what, hint=hint)]
    return "", [finding("W213", 1, None, f"no word names the unit and {unit.why}: lengths are read as mm")]


def _reading(lines: Sequence[str], settings: Settings) -> tuple[Reading, list[Finding]]:
    """A program as its control counts, and what was concluded about that."""
    settings, said = lengths(lines, settings)
    for judge in (worn, quill):
        settings, more = judge(lines, settings)
        said += more
    reading = read_lines(lines, settings)
    if any(item.code == "E211" for item in reading.findings):
        return reading, []
    turns = settings.family and not settings.control.lathe and is_lathe(lines, reading.findings)
    if turns or settings.turning:
        return _turning(lines, settings, said)
    other, more = closing(settings, reading.findings, lambda s: read_lines(lines, s).findings)
    return (reading, said) if other is settings else (read_lines(lines, other), said + more)


def _turning(lines: Sequence[str], settings: Settings, said: list[Finding]) -> tuple[Reading, list[Finding]]:
    """A program for a lathe: X words are diameters, unless all arcs fit as radii; its centres as `closing` finds them."""
    best: tuple[Reading, list[Finding]] | None = None
    given = settings.control.lathe
    for diameters in (True, False) if not given else (given == "diameter",):
        taken, more = as_lathe(lines, settings, diameters)
        first = read_lines(lines, taken)
        ours, centres = closing(taken, first.findings, lambda s: read_lines(lines, s).findings)
        reading = first if ours is taken else read_lines(lines, ours)
        if swapped(reading.moves):
            ours = replace(ours, control=replace(ours.control, swapped=True))
            what = "G2 and G3 are counted from below: so no arc of the program goes the long way round"
            hint = "confirm it: swapped = true under [program.control], or --control"
            centres = [*centres, finding("I213", 1, None, what, hint=hint)]
            reading = read_lines(lines, ours)
        if best is None or arcs_open(reading.findings) < arcs_open(best[0].findings):
            best = reading, [*said, *more, *centres]
        if not arcs_open(reading.findings) and not centres:
            break
    assert best is not None
    return best


def read_program(path: Path | str, **options: Any) -> Program:
    """Read a program from a file; options as of `parse_program`.

    Raises
    ------
    NCError
        The file cannot be read, is binary, UTF-16 or larger than `MAX_BYTES`, or the dialect is unknown.
    """
    try:
        with Path(path).open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as exc:
        reason = getattr(exc, "strerror", None) or str(exc)
        raise NCError(f"cannot read the program: {reason}", file=str(path)) from exc
    beside = (Path(path).parent, *options.pop("subroutines", ()))
    return parse_program(data, str(path), subroutines=beside, **options)


def parse_program(data: bytes, name: str, **options: Any) -> Program:
    """Read a program.

    Parameters
    ----------
    data : the bytes of the file; UTF-8 or a one-byte encoding.
    name : used in messages.
    options : fields of `Settings`.

    Returns
    -------
    Program
        Always, however wrong its blocks are: see `findings`.

    Raises
    ------
    NCError
        Binary or UTF-16 data, a program too large, unknown dialect, option or work offset.
    """
    settings = Settings.of(name, work_offset_codes(), options)
    if settings.dialect != AUTO and settings.dialect not in TABLE:
        raise NCError(
            f"dialect '{settings.dialect}' is not supported",
            file=name,
            remedy=f"one of {', '.join((AUTO, *TABLE))}",
        )
    lines = without_header(split_lines(decode_program(data, name)))
    if settings.start_line > max(len(lines), 1):
        raise NCError(
            f"start line {settings.start_line}: there are {len(lines)} lines",
            file=name,
            remedy="name one of them",
        )
    found: list[Finding] = []
    guessed = settings.dialect == AUTO
    dialect = recognise(lines) if guessed else settings.dialect
    units = settings.units
    if not units and (TABLE[dialect].g_code or dialect == "sinumerik") and not names_unit(lines):
        units, more_found = _unit(lines, guessed)
        found += more_found
    settings = replace(settings, dialect=dialect, units=units)
    (moves, more, ended, files, declared), said = _reading(lines, settings)
    unmarked = guessed and dialect == "iso" and not is_marked("iso", lines)
    if unmarked and any(item.severity == "E" for item in more):
        other, further = _reading(lines, replace(settings, dialect="fanuc"))
        wrong, left = (sum(item.severity == "E" for item in items) for items in (more, other.findings))
        # a path that is read only because the tool's radius is taken to be in it already is not better than a question
        assumed = any(item.code == "W351" for item in other.findings)
        assumed = assumed and not any(item.code == "W380" for item in further)
        if (left == 0 and not assumed) or (left > 0 and wrong >= MANY and MANY * left <= wrong):
            dialect = "fanuc"  # nothing speaks for either, and only this one reads it
            (moves, more, ended, files, declared), said = other, further
    found += said
    if guessed and is_g_code(dialect):
        more = folded(more)
        if (cause := strange(more, lines)) is not None:
            moves, more, found = [], [cause], [item for item in found if item.code != "W380"]
    if guessed and dialect != "iso" and not any(item.code == "E211" for item in more):
        what = f"the program looks like {TABLE[dialect].title}, and is read as that: dialect {dialect}"
        found.append(finding("I212", 1, None, what))
    if units and not declared.unit:
        declared = declared._replace(unit=units, inferred=True)
    found += more
    found += check_moves(moves, settings.stock_top_mm, settings.travel_mm, settings.blu_mm)
    findings: tuple[Finding, ...] = tuple(sorted(found, key=lambda f: (f.line, f.col, f.code)))
    return Program(name, data, dialect, tuple(moves), findings, ended, files, declared)
