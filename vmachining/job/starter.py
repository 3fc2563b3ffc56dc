"""A job file from a program: what the program says is written down, what it does not say is marked.

1. The dialect is the first in which the program reads without errors; G20 and G21 give the unit.
2. Tools are those that cut; their shapes come from comments (`vmachining.nc.toolcomments`). A diameter that nobody
   gives is left open, and the run asks for it: an invented one would make numbers that look like results.
3. The stock is a box around everything that feed motions sweep, with an allowance: a guess, and called one.
4. Where axes turn, the machine is the first preset that has them: a guess as well.

Every line that is a guess says GUESS behind it, every value that is missing MUST BE GIVEN.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vmachining.arrays import Floats
from vmachining.errors import KinematicsError, NCError, SweepError
from vmachining.job.jobfile import MM_PER_INCH
from vmachining.job.paths import move_path, settled
from vmachining.machine import Machine, load, with_axes
from vmachining.nc import (
    DIALECTS,
    Motion,
    Program,
    ToolEntry,
    decode_program,
    lex_line,
    parse_program,
    split_lines,
)
from vmachining.nc.toolcomments import ToolNote, cutter_notes, tool_notes
from vmachining.sweep import Turn

__all__ = ["Draft", "draft_job"]

ALLOWANCE_MM = 2.0
"""Around what the tools sweep, on each side and below."""

HOME_ABOVE_MM = 50.0
SAMPLES = 17
"""Places along a five-axis motion that its extent is taken from."""

DRILL_DEG, CHAMFER_DEG = 118.0, 45.0
"""Tip angle of a standard twist drill, half angle of a standard chamfer mill (ISO 5419, DIN 6518)."""

IDLE = (Motion.RAPID, Motion.DWELL)
GUESS, OPEN = "GUESS", "MUST BE GIVEN"


@dataclass(frozen=True)
class Draft:
    """A job file to be. guesses, open : one line each, for people; `open` values keep it from running.

    errors : what the program itself has wrong, which keeps it from running as well.
    """

    text: str
    tools: tuple[int, ...]
    dialect: str
    units: str
    guesses: tuple[str, ...]
    open: tuple[str, ...]
    errors: tuple[str, ...]


def draft_job(program: Path, folder: Path, dialect: str | None = None) -> Draft:
    """The job file of a program, as it would lie in `folder`.

    Parameters
    ----------
    dialect : None: found out.

    Raises
    ------
    NCError
        The program cannot be read, is written for another control, or has no feed motion.
    """
    try:
        data = program.read_bytes()
    except OSError as exc:
        raise NCError(f"cannot read the program: {exc.strerror or exc}", file=str(program)) from exc
    lines = split_lines(decode_program(data, str(program)))
    read, tables = _read(data, program, lines, dialect)
    foreign = next((found for found in read.errors if found.code == "E211"), None)
    if foreign is not None:
        read.require_clean(allow={found.code for found in read.errors} - {"E211"})
    unit = _unit(read, lines)
    cutting = [move for move in read.moves if move.motion not in IDLE]
    if not cutting:
        first = next((found for found in read.errors if found.code != "E401"), None)
        if first is not None:
            read.require_clean(allow={"E401"})
        raise NCError("no feed motion: nothing is cut", file=str(program), remedy="is it the right file?")
    return _Writer(read, lines, unit, tables, program, folder).draft()


def _read(
    data: bytes, path: Path, lines: Sequence[str], dialect: str | None
) -> tuple[Program, dict[int, ToolNote]]:
    """The program in its dialect, read with the tools of its comments."""
    best: Program | None = None
    for name in (dialect,) if dialect is not None else DIALECTS:
        read = parse_program(data, str(path), dialect=name, rotary="ABC", subroutines=(path.parent,))
        wrong = [found for found in read.errors if found.code not in ("E401", "E351")]
        if best is None or len(wrong) < len([f for f in best.errors if f.code not in ("E401", "E351")]):
            best = read
        if not wrong:
            break
    assert best is not None
    numbers = sorted({move.tool or 1 for move in best.moves} | _called(lines, best.dialect))
    scale = MM_PER_INCH if _unit(best, lines) == "inch" else 1.0
    notes = cutter_notes(lines, scale) if best.dialect == "apt" else tool_notes(lines, numbers, scale)
    table = {
        number: ToolEntry(number, note.diameter_mm if (note := notes.get(number)) and note.diameter_mm else math.nan, 0.0)
        for number in numbers
    }  # fmt: skip
    again = parse_program(
        data, str(path), dialect=best.dialect, rotary="ABC", tools=table, subroutines=(path.parent,)
    )
    return again, notes


def _called(lines: Sequence[str], dialect: str) -> set[int]:
    """Numbers of T words, so that tools of offsets (G43 H, D) are in the table as well."""
    if dialect not in ("iso", "mts"):
        return {1}
    words = (word for line in lines if "T" in line.upper() for word in lex_line(line).words)
    return {int(word.value) for word in words if word.letter == "T" and word.value and word.value >= 1.0}


def _unit(program: Program, lines: Sequence[str]) -> str:
    """mm, inch, or "" where the program does not say."""
    if program.dialect == "poses":
        return "mm"
    if program.dialect == "apt":
        text = "\n".join(lines).upper().replace(" ", "")
        return "inch" if "UNITS/IN" in text else "mm" if "UNITS/MM" in text else ""
    for line in lines:
        if "2" not in line:
            continue
        for word in lex_line(line).words:
            if word.letter == "G" and word.value in (20.0, 21.0):
                return "inch" if word.value == 20.0 else "mm"
    return ""


class _Writer:
    """Lines of the file, and what they leave open."""

    def __init__(
        self, program: Program, lines: Sequence[str], unit: str, notes: dict[int, ToolNote], path: Path, folder: Path
    ) -> None:  # fmt: skip
        self.notes, self.path, self.folder = notes, path, folder
        self.unit, self.scale = unit or "mm", MM_PER_INCH if unit == "inch" else 1.0
        self.guesses: list[str] = []
        self.open: list[str] = []
        self.letters = "".join(
            sorted({k.upper() for m in program.moves if m.rotary_deg for k in m.rotary_deg})
        )
        self.presets = with_axes(self.letters) if self.letters else []
        self.machine: Machine | None = load(self.presets[0]) if self.presets else None
        self.errors = [
            f"line {f.line}: {f.code} {f.message}" for f in program.errors if f.code not in ("E401", "E351")
        ]
        try:
            program = settled(program, self.machine)
        except NCError as exc:
            self.errors.append(str(exc))
        self.program, self.said_unit = program, bool(unit)
        self.cutting = [move for move in program.moves if move.motion not in IDLE]
        self.tools = list(dict.fromkeys(move.tool or 1 for move in self.cutting))
        self.lines = lines

    def guess(self, line: str, why: str) -> str:
        """A line that is a guess."""
        self.guesses.append(f"{line.strip()}: {why}")
        return f"{line}   # {GUESS}: {why}"

    def missing(self, line: str, why: str) -> str:
        """A line that the user has to fill in."""
        self.open.append(why)
        return f"# {line}   # {OPEN}: {why}"

    def draft(self) -> Draft:
        """The whole file."""
        low, high = self.extent()
        parts = [
            f"# Job of {self.path.name}, made by vmachining init. Lines with {GUESS} or {OPEN} want your eye.",
            "",
            f"name = {_text(self.path.stem)}",
            self.units(),
            "",
            *self.program_table(high),
            "",
            *self.machine_table(),
        ]
        for number in self.tools:
            parts += ["", *self.tool_table(number, low, high)]
        parts += ["", *self.stock_table(low, high), "", *self.rest()]
        return Draft(
            "\n".join(parts) + "\n", tuple(self.tools), self.program.dialect, self.unit, tuple(self.guesses),
            tuple(self.open), tuple(self.errors),
        )  # fmt: skip

    def units(self) -> str:
        """Of the lengths below whose keys name no unit."""
        line = f'units = "{self.unit}"'
        if not self.said_unit:
            return self.guess(line, "the program names no unit, so it is read in mm")
        return f"{line}   # of the stock and of home; as in the program"

    def program_table(self, high: Floats) -> list[str]:
        """[program]"""
        out = ["[program]", f"file = {_text(os.path.relpath(self.path, self.folder))}"]
        out.append(f'dialect = "{self.program.dialect}"')
        top = (
            max(float(move.start[2]) for move in self.program.moves[1:])
            if len(self.program.moves) > 1
            else 0.0
        )
        step = 10.0 if self.unit == "mm" else MM_PER_INCH
        level = math.ceil(max(100.0, max(top, float(high[2])) + HOME_ABOVE_MM) / step) * step
        home = [0.0, 0.0, level / self.scale]
        out.append(self.guess(f"home = {_numbers(home)}", "where the tool starts, and G28 goes"))
        if any(found.code == "W335" for found in self.program.findings):
            out.append(self.guess('dwell = "ms"', "dwells would last for minutes in seconds"))
        return [*out, *(f"# a run refuses this program: {error}" for error in self.errors[:3])]

    def machine_table(self) -> list[str]:
        """[machine]"""
        out = ["[machine]"]
        if self.presets:
            others = ", ".join(self.presets[1:5])
            out.append(
                self.guess(f'chain = "{self.presets[0]}"', f"has the axes {self.letters}; so have {others}")
            )
        return [
            *out,
            "# rapid_mm_min = 10000   # limits of your machine: times, and feeds that it cannot reach",
            "# max_feed_mm_min = 5000",
            "# max_acceleration_mm_s2 = 2000",
        ]

    def extent(self) -> tuple[Floats, Floats]:
        """(3,) lowest and highest place of the tool tip in feed motions, mm."""
        points: list[Floats] = []
        plain = [m for m in self.cutting if m.center is None and m.rotary_deg is None and m.axis_end is None]
        if plain:
            ends = np.array([(m.start, m.end) for m in plain], dtype=np.float64).reshape(-1, 3)
            points += [ends.min(axis=0), ends.max(axis=0)]
        for move in self.cutting:
            if move.center is None and move.rotary_deg is None and move.axis_end is None:
                continue
            try:
                path = move_path(move, self.machine)
            except (NCError, KinematicsError, SweepError) as exc:
                self.errors.append(f"line {move.line}: {exc}")
                points.append(np.array(move.end))
                continue
            if isinstance(path, Turn):
                points += [np.asarray(path.position(float(t))) for t in np.linspace(0.0, 1.0, SAMPLES)]
            else:
                points += list(path.bounds)
        places = np.array(points)
        return places.min(axis=0), places.max(axis=0)

    def stock_table(self, low: Floats, high: Floats) -> list[str]:
        """[stock]: around the sweep of all tools; its top is zero where the program cuts below zero."""
        radius = max((note.diameter_mm or 0.0 for note in self.notes.values()), default=0.0) / 2.0
        reach = radius + ALLOWANCE_MM
        lost = [n for n in self.tools if n not in self.notes or self.notes[n].diameter_mm is None]
        step = 1.0 if self.unit == "mm" else MM_PER_INCH / 20.0
        below = low - [reach, reach, ALLOWANCE_MM]
        above = high + [reach, reach, 0.0]
        why = "around what the tools sweep"
        if self.letters or self.program.dialect in ("apt", "poses"):
            above[2] += ALLOWANCE_MM
        elif low[2] < 0.0:
            above[2], why = 0.0, f"{why}, with its top at zero"
        else:
            side = [
                m for m in self.cutting if math.dist(m.start[:2], m.end[:2]) > 0.0 or m.center is not None
            ]
            above[2] = max((max(m.start[2], m.end[2]) for m in side), default=float(high[2]))
            why = f"{why}, with its top at the highest cut"
        if lost:
            why += f", but for the radius of tool {' and '.join(map(str, lost))}"
        corner = [np.floor(below / step + 1e-9) * step, np.ceil(above / step - 1e-9) * step]
        first, second = (_numbers([float(v) / self.scale for v in c]) for c in corner)
        return [
            "[stock]",
            self.guess(f"box = {{ min = {first}, max = {second} }}", why),
            "# cylinder = { center = [0, 0], radius = 40, z = [-25, 0] }",
            '# stl = "stock.stl"   # or step = "stock.step"',
        ]

    def tool_table(self, number: int, low: Floats, high: Floats) -> list[str]:
        """[[tools]]"""
        note = self.notes.get(number)
        out = ["[[tools]]", f"number = {number}"]
        if note is not None:
            out.insert(1, f"# line {note.line}: ({note.text})")
        elif not any(move.tool for move in self.cutting):
            out.insert(1, "# the program calls no tool")
        depth = float(high[2] - low[2])
        length = max(50.0, 10.0 * math.ceil((depth + 20.0) / 10.0))
        diameter = note.diameter_mm if note is not None else None
        if diameter is None:
            out.append(self.guess('type = "flat"', f"no comment tells the shape of tool {number}"))
            out.append(self.missing("diameter_mm = ", f"no comment tells the diameter of tool {number}"))
        else:
            assert note is not None
            length = max(length, 10.0 * math.ceil(0.4 * diameter))
            out += self.shape(note, diameter, length)
        if not any(line.startswith("profile") for line in out):
            out.append(
                self.guess(
                    f"length_mm = {length:g}", f"length of tool {number}, which the program does not tell"
                )
            )
        out += [
            "# flute_length_mm = 20   # without it, shank and holder cannot be checked against the stock",
            "# shank_diameter_mm = 10",
            "# holder = [[20, 60], [25, 100]]   # [r, z] from the tip up",
            "# flutes = 2",
        ]
        return out

    def shape(self, note: ToolNote, diameter: float, length: float) -> list[str]:
        """Keys of a cutter whose diameter is known."""
        corner, size = note.corner_mm, f"diameter_mm = {diameter:.9g}"
        if note.kind in ("drill", "chamfer"):
            half = note.angle_deg
            if half is not None and note.kind == "drill":
                half /= 2.0
            what, usual = ("tip", DRILL_DEG / 2) if note.kind == "drill" else ("cone", CHAMFER_DEG)
            tip = 0.5 * diameter / math.tan(math.radians(half if half and half < 90.0 else usual))
            points = [(0.0, 0.0), (diameter / 2, tip), (diameter / 2, max(length, tip + diameter))]
            rows = ", ".join(_numbers([r / self.scale, z / self.scale]) for r, z in points)
            line = f"profile = [{rows}]"
            kind = f'type = "profile"   # a {note.kind}, D {diameter:.9g} mm'
            if half is None:
                return [kind, self.guess(line, f"{what} of {2 * usual:g} degrees, and the length")]
            return [kind, self.guess(line, "the length")]
        if corner is not None and corner > 0.0 and abs(corner - diameter / 2) <= 1e-3 * diameter:
            return ['type = "ball"', size]
        if corner is not None and 0.0 < corner < diameter / 2 and note.kind != "ball":
            return ['type = "bull"', size, f"corner_radius_mm = {corner:.9g}"]
        if note.kind == "ball":
            return ['type = "ball"', size]
        if note.kind == "bull":
            lost = self.missing(
                "corner_radius_mm = ", f"no comment tells the corner radius of line {note.line}'s tool"
            )
            return ['type = "bull"', size, lost]
        if note.kind == "flat" or corner == 0.0:
            return ['type = "flat"', size]
        said = f"a {note.kind}, taken as a cylinder" if note.kind else "no comment tells the shape"
        return [self.guess('type = "flat"', said), size]

    def rest(self) -> list[str]:
        """What may be added."""
        return [
            "# [feed]                # a schedule: feeds by load, written to scheduled.nc and simulated again",
            '# strategy = "volume"',
            "# min_mm_min = 100",
            "# max_mm_min = 2000",
        ]


def _text(value: str) -> str:
    """A TOML string."""
    return json.dumps(value, ensure_ascii=False)


def _numbers(values: Sequence[float]) -> str:
    return "[" + ", ".join(f"{value + 0.0:.9g}" for value in values) + "]"
