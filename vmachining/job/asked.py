"""What a program does not say of its tools: words of `--tool`, libraries beside it, drafts that nobody has edited yet; and a
program that is read to be drafted, in its dialect, with the tools that comments, libraries and the user tell."""

from __future__ import annotations

import math
import re
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final
from zlib import crc32

from vmachining.errors import InputError, VMachiningError
from vmachining.job.jobfile import MM_PER_INCH
from vmachining.job.reading import IDLE
from vmachining.nc import Program, ToolEntry, is_g_code, lex_line, parse_program
from vmachining.nc.toolcomments import INCH, NUMBER, ToolNote, cutter_notes, tool_notes, value_of
from vmachining.nc.toollibrary import read_tool_library
from vmachining.textfile import MAX_TEXT

GIVEN: Final = "--tool"
"""Text of a note that the user gave on the command line."""

KINDS: Final = ("flat", "ball", "bull", "drill", "chamfer", "taper")
_FORM: Final = "NUMBER=TYPE:DIAMETER, such as 3=ball:10, 1=flat:1/2in, 2=bull:12:1.5 (corner), 4=drill:8.5:118 (tip angle)"
_WORD: Final = re.compile(
    rf"0*(\d{{1,6}})\s*=\s*(?:({'|'.join(KINDS)})\s*:)?\s*{NUMBER}\s*(mm|inch|in|\")?"
    rf"(?:\s*:\s*{NUMBER}\s*(mm|inch|in|\"|deg)?)?",
    re.IGNORECASE,
)
SECOND: Final = {"bull": "corner", "drill": "angle", "chamfer": "angle", "taper": "angle"}
MOST_MM: Final = 1000.0

_LIBRARY: Final = re.compile(r".*\.(?:tools|fctl|tbl)|tool\.t|.*tool.*\.(?:csv|json)", re.IGNORECASE)
"""Names of files that hold tools and nothing else."""

_SIGNED: Final = re.compile(r"\n# drafted( .*)?; ([0-9a-f]{8})\n?\Z")


def parse_tools(words: Sequence[str]) -> dict[int, ToolNote]:
    """Tools of `--tool` by number; sizes are mm unless a unit follows them.

    Raises InputError: Another form, a size out of range, a tool that is given twice.
    """
    found: dict[int, ToolNote] = {}
    for word in words:
        hit = _WORD.fullmatch(word.strip())
        if hit is None:
            raise InputError(f"--tool {word}: it must be {_FORM}")
        if any(re.search(r"/0+$", text) for text in (hit[3], hit[5]) if text is not None):
            raise InputError(f"--tool {word}: a fraction over 0", remedy=f"it must be {_FORM}")
        number, kind = int(hit[1]), (hit[2] or "").lower() or None
        diameter = _mm(hit[3], hit[4])
        if not 0.0 < diameter <= MOST_MM:
            remedy = f"above 0, at most {MOST_MM:g} mm"
            raise InputError(f"--tool {word}: a diameter of {diameter:g} mm", remedy=remedy)
        corner = angle = None
        if hit[5] is not None:
            role = SECOND.get(kind or "")
            if role is None or (hit[6] and (hit[6].lower() == "deg") != (role == "angle")):
                raise InputError(
                    f"--tool {word}: {kind or 'a tool without a type'} has one size", remedy=_FORM
                )
            if role == "corner":
                corner = _mm(hit[5], hit[6])
            else:
                angle = value_of(hit[5]) / (2.0 if kind == "chamfer" else 1.0)
        if kind == "bull" and not (corner is not None and 0.0 < corner <= diameter / 2.0):
            what = "bull needs its corner radius, at most half of the diameter"
            raise InputError(f"--tool {word}: {what}", remedy=_FORM)
        if kind == "taper" and angle is None:
            raise InputError(
                f"--tool {word}: taper needs its half angle in degrees", remedy="such as 5=taper:1:7"
            )
        if number in found:
            raise InputError(f"--tool {word}: tool {number} is given twice")
        found[number] = ToolNote(0, GIVEN, kind, diameter, 0.0 if kind == "flat" else corner, angle)
    return found


def _mm(text: str, unit: str | None) -> float:
    return round(value_of(text) * (1.0 if (unit or "mm").lower() == "mm" else INCH), 9)


def word_of(number: int, kind: str | None, inch: bool) -> str:
    """The option that gives a tool; what is not known stands there as words to replace."""
    unit = "in" if inch else ""
    more = {"bull": f":CORNER{unit}", "taper": ":HALF_ANGLE"}.get(kind or "", "")
    return f"--tool {number}={kind if kind in KINDS else 'TYPE'}:DIAMETER{unit}{more}"


def libraries_beside(program: Path, scale: float) -> tuple[dict[Path, dict[int, ToolNote]], list[str]]:
    """Tool libraries in the directory of a program, by their names; and of each that cannot be read, why.

    scale : as of `read_tool_library`.
    """
    found: dict[Path, dict[int, ToolNote]] = {}
    refused: list[str] = []
    try:
        entries = sorted(program.absolute().parent.iterdir())
    except OSError:
        return found, refused
    for path in entries:
        if _LIBRARY.fullmatch(path.name) and path.is_file():
            try:
                found[path] = read_tool_library(path, scale)
            except VMachiningError as exc:
                refused.append(f"tool library {path.name} next to the program is left out, {exc.message}")
    return found, refused


def signed(text: str, words: Sequence[str]) -> str:
    """A draft with a last line by which it is known as long as nobody edits it; words : options that it was made with."""
    told = f" with {shlex.join(words)}" if words else ""
    return f"{text}# drafted{told}; {crc32(text.encode()):08x}\n"


def made_with(path: Path) -> list[str] | None:
    """Options of a draft that nobody has edited; None of any other file."""
    try:
        with path.open("rb") as file:
            text = file.read(MAX_TEXT).decode("utf-8")
    except (OSError, UnicodeDecodeError):
        return None
    hit = _SIGNED.search(text)
    if hit is None or f"{crc32(text[: hit.start() + 1].encode()):08x}" != hit[2]:
        return None
    try:
        return shlex.split((hit[1] or "").removeprefix(" with"))
    except ValueError:
        return None


CONTOUR_MM = 1e-3
"""Diameter assumed for a tool whose diameter is not given, where nothing else is known of the path."""

HOME_ABOVE_MM = 50.0
_TOOL_CALL = re.compile(r"TOOL CALL[ \t]+(?=\d)", re.IGNORECASE)
_TOOL_NAME = re.compile(r"(?:TOOL CALL[ \t]+|(?<![A-Z])T[ \t]*=[ \t]*)\"([^\"]*)\"", re.IGNORECASE)
_CALLED = re.compile(r"[ \t]*\d*[ \t]*TOOL CALL[ \t]+(\d{1,6})\b", re.IGNORECASE)


def _wrong(program: Program) -> int:
    """Errors but for what only tools or the end of the file lack."""
    return sum(found.code != "E351" for found in program.errors)


def read_with_tools(
    data: bytes, path: Path, lines: Sequence[str], dialect: str | None, options: dict[str, Any],
    library: Path | None, own: dict[int, ToolNote],
) -> tuple[Program, dict[int, ToolNote], str]:  # fmt: skip
    """The program in its dialect, read with its tools, from the home that the job will name; and its crc_entry."""
    best = parse_program(data, str(path), dialect=dialect or "auto", **options)
    if dialect is None and best.dialect in ("iso", "fanuc") and _wrong(best):
        other = parse_program(data, str(path), dialect="mts", **options)
        best = other if _wrong(other) == 0 else best
    called = _called(lines, best.dialect) | set(best.declared.tools)
    numbers = sorted({move.tool or 1 for move in best.moves} | called)
    scale = MM_PER_INCH if unit_said(best, lines) == "inch" else 1.0
    if not is_g_code(best.dialect) and best.dialect != "apt":
        number_of = {name.upper(): number for number, name in best.declared.names.items()}
        lines = [_TOOL_CALL.sub("T", line) for line in lines]
        lines = [
            _TOOL_NAME.sub(lambda hit: f"T{number_of.get(hit[1].strip().upper(), 0)}", line)
            if '"' in line
            else line
            for line in lines
        ]
    notes = cutter_notes(lines, scale) if best.dialect == "apt" else tool_notes(lines, numbers, scale)
    for number, name in best.declared.names.items():
        if number not in notes:
            notes |= tool_notes([f"(T{number} {name})"], [number], 1.0)
    for number, radius in best.declared.radii.items():
        if number not in notes and radius > 0.0:
            notes[number] = ToolNote(1, "the program gives the radius", None, 2.0 * radius, None, None)
    for number, told in (read_tool_library(library, scale) if library is not None else {}).items():
        _over(notes, number, told)
    silent = [n for n in numbers if n not in own and (n not in notes or notes[n].diameter_mm is None)]
    beside = libraries_beside(path, scale)[0] if silent and library is None else {}
    named = ((file.name, found) for file, found in beside.items())
    knowing = [one for one in named if any(one[1][n].diameter_mm for n in silent if n in one[1])]
    for name, found in knowing if len(knowing) == 1 else ():  # of several nobody knows which is meant
        for number in set(silent) & set(found):
            _over(notes, number, found[number]._replace(place=name))
    for number in set(own) & set(numbers):
        _over(notes, number, own[number])
    table = {
        n: ToolEntry(n, (note and note.diameter_mm) or math.nan, 0.0, flutes=(note and note.flutes) or 0)
        for n in numbers for note in [notes.get(n)]
    }  # fmt: skip
    # a round level above everything, mm: where the tool starts and G28 returns to
    heights = [float(move.start[2]) for move in best.moves[1:]]
    heights += [float(move.end[2]) for move in best.moves if move.motion not in IDLE]
    step = MM_PER_INCH if unit_said(best, lines) == "inch" else 10.0
    level = math.ceil(max(100.0, max(heights, default=0.0) + HOME_ABOVE_MM) / step - 1e-9) * step
    home = 0.0, 0.0, level
    given = {**options, "tools": table, "home": home, "dialect": best.dialect}
    again = parse_program(data, str(path), **given)
    if again.declared.unit == "" and best.declared.unit:
        given["units"] = best.declared.unit
        again = parse_program(data, str(path), **given)
    if _wrong(again) < len(again.errors):
        # the radius is unknown: the draft is made from the contour, whose arcs fit
        given["tools"] = {
            k: tool._replace(diameter_mm=CONTOUR_MM) if math.isnan(tool.diameter_mm) else tool
            for k, tool in table.items()
        }
        again = parse_program(data, str(path), **given)
    if any(found.code in ("E353", "E355") for found in again.errors) and again.dialect in ("iso", "mts"):
        other = parse_program(data, str(path), **given, crc_entry="next")
        if _wrong(other) < _wrong(again):
            return other, notes, "next"
    return again, notes, "prev"


def _over(notes: dict[int, ToolNote], number: int, told: ToolNote) -> None:
    """A later source of a tool stands over an earlier one; a shape that comes with its size stands alone."""
    old = notes.get(number)
    if old is not None and told.kind is not None and told.diameter_mm is not None and told.text == GIVEN:
        old = old._replace(corner_mm=None, angle_deg=None)
    said = {key: value for key, value in told._asdict().items() if value is not None and key != "line"}
    if told.diameter_mm is not None:
        said["guess"] = None
    notes[number] = old._replace(**said) if old is not None else told


def _called(lines: Sequence[str], dialect: str) -> set[int]:
    """Numbers of T words, so that tools of offsets (G43 H, D) are in the table as well."""
    if not is_g_code(dialect):
        return {1} | {int(found[1]) for line in lines if (found := _CALLED.match(line))}
    words = (word for line in lines if "T" in line.upper() for word in lex_line(line).words)
    return {int(word.value) for word in words if word.letter == "T" and word.value and word.value >= 1.0}


def unit_said(program: Program, lines: Sequence[str]) -> str:
    """mm, inch, or "" where the program does not say."""
    if program.declared.unit:
        return program.declared.unit
    if program.dialect == "poses":
        return "mm"
    for line in lines:
        if "2" not in line:
            continue
        for word in lex_line(line).words:
            if word.letter == "G" and word.value in (20.0, 21.0):
                return "inch" if word.value == 20.0 else "mm"
    return ""
