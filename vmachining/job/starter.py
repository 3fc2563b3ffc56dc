"""A job file from a program: what the program says is written down, what it does not say is marked.

1. The dialect is recognised; the program gives the unit, or what speaks for one, which is a guess then.
2. Tools are those that cut; their shapes come from comments (`vmachining.nc.toolcomments`), from a library, from the
   user, and where none of these names it from the one library next to the program, as a guess. A diameter that
   nobody gives is left open, and the run asks for it: an invented one would make numbers that look like results.
3. The stock is a box around everything that feed motions sweep, with an allowance: a guess, and called one.
4. Where axes turn, the machine is the first preset that has them: a guess as well.

Every line that is a guess says GUESS after it, every value that is missing MUST BE GIVEN.
"""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from vmachining.arrays import Floats
from vmachining.errors import InputError, KinematicsError, NCError, SweepError
from vmachining.job.asked import (
    GIVEN,
    libraries_beside,
    parse_tools,
    read_with_tools,
    signed,
    unit_said,
    word_of,
)
from vmachining.job.jobfile import MM_PER_INCH
from vmachining.job.paths import move_path, settled
from vmachining.job.reading import IDLE, refuse_turning, refuse_unread
from vmachining.machine import Machine, load, with_axes
from vmachining.nc import MAX_BYTES, Motion, Program, decode_program, split_lines
from vmachining.nc.conventions import unit_of
from vmachining.nc.stockcomments import placed, stock_note
from vmachining.nc.toolcomments import ToolNote
from vmachining.sweep import Turn

ALLOWANCE_MM = 2.0
"""Around what the tools sweep, on each side and below."""


_SIDES = re.compile(r"^[^(;]*G4[12](?![0-9.])", re.IGNORECASE)
SAMPLES = 17
"""Places along a five-axis motion that its extent is taken from."""

DRILL_DEG, CHAMFER_DEG = 118.0, 45.0
"""Tip angle of a standard twist drill, half angle of a standard chamfer mill (ISO 5419, DIN 6518)."""


HOLES, DRILLS = 3, "no comment gives the shape, and the tool only plunges"
GUESS, OPEN = "GUESS", "MUST BE GIVEN"

LIMITS = """\
# rapid_mm_min = 10000   # limits of your machine: times, and feeds that it cannot reach
# max_feed_mm_min = 5000
# max_acceleration_mm_s2 = 2000""".splitlines()
REST = """\
# [feed]                # a schedule: feeds by load, written to scheduled.nc and simulated again
# strategy = "volume"
# min_mm_min = 100
# max_mm_min = 2000""".splitlines()


@dataclass(frozen=True)
class Draft:
    """A job file to be. guesses, open : one line each, for people; `open` values keep it from running.

    errors : what the program itself has wrong, which keeps it from running as well. ask : options that would give what is
    open, such as `--tool 3=ball:DIAMETER`. beside : tool libraries in the directory of the program.
    """

    text: str
    tools: tuple[int, ...]
    dialect: str
    units: str
    guesses: tuple[str, ...]
    open: tuple[str, ...]
    errors: tuple[str, ...]
    ask: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()


def draft_job(
    program: Path,
    folder: Path,
    dialect: str | None = None,
    *,
    units: str = "",
    library: Path | None = None,
    tools: Sequence[str] = (),
) -> Draft:
    """The job file of a program, as it would lie in `folder`.

    dialect : None: recognised. units : "mm" or "inch", where the program names none. library : tools, in a format of
        `vmachining.nc.toollibrary`; comments of the program say what it does not. tools : such as "3=ball:10", which
        are taken before both.

    Raises NCError: The program cannot be read, is written for another control, or has no feed motion.
    Raises InputError: `tools` in another form, or of numbers that the program does not have.
    """
    own = parse_tools(tools)
    try:
        with program.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as exc:
        raise NCError(f"cannot read the program: {exc.strerror or exc}", file=program) from exc
    lines = split_lines(decode_program(data, str(program)))
    options = {"rotary": "ABC", "subroutines": (program.parent,), "units": units}
    read, tables, entry = read_with_tools(data, program, lines, dialect, options, library, own)
    foreign = next((found for found in read.errors if found.code == "E211"), None)
    if foreign is not None:
        read.require_clean(allow={found.code for found in read.errors} - {"E211"})
    refuse_turning(read)
    unit = unit_said(read, lines)
    cutting = [move for move in read.moves if move.motion not in IDLE]
    if not cutting:
        if read.errors:
            read.require_clean()
        refuse_unread(read)
        raise NCError("no feed motion: nothing is cut", file=program, remedy="is it the right file?")
    if strange := sorted(set(own) - set(tables)):
        known = ", ".join(map(str, sorted({move.tool or 1 for move in cutting})))
        raise InputError(
            f"--tool {strange[0]}=...: the program has no tool {strange[0]}", remedy=f"it cuts with {known}"
        )
    words = [
        *(("--dialect", dialect) if dialect else ()), *(("--units", units) if units else ()),
        *(("--tools", os.path.relpath(library, folder)) if library else ()),
        *(word for text in tools for word in ("--tool", text)),
    ]  # fmt: skip
    return _Writer(read, lines, unit, tables, program, folder, entry).draft(words)


class _Writer:
    """Lines of the file, and what they leave open."""

    def __init__(
        self, program: Program, lines: Sequence[str], unit: str, notes: dict[int, ToolNote], path: Path, folder: Path,
        entry: str,
    ) -> None:  # fmt: skip
        self.notes, self.path, self.folder, self.entry = notes, path, folder, entry
        self.unit, self.scale = unit or "mm", MM_PER_INCH if unit == "inch" else 1.0
        self.guesses: list[str] = []
        self.open: list[str] = []
        self.unsized: dict[int, int] = {}
        """First line of feed by tool, of those without a diameter."""
        self.ask: list[str] = []
        self.letters = "".join(sorted({k.upper() for m in program.moves for k in m.rotary_deg or ()}))
        self.presets = with_axes(self.letters) if self.letters else []
        self.machine: Machine | None = load(self.presets[0]) if self.presets else None
        self.errors = [
            f"line {f.line}: {f.code} {f.message}" for f in program.findings
            if (f.severity == "E" and f.code != "E351") or f.code == "W383"
        ]  # fmt: skip
        try:
            program = settled(program, self.machine)
        except NCError as exc:
            self.errors.append(str(exc))
        self.program, self.said_unit = program, bool(unit)
        self.cutting = [move for move in program.moves if move.motion not in IDLE]
        # home is a guess, and so is a start there: of a feed motion from that height only the end counts
        home = program.moves[0].start[2]
        falls = (m._replace(start=m.end) if m.start[2] >= home > m.end[2] else m for m in self.cutting)
        self.below = [m for m in falls if m.end[2] < home] or self.cutting
        self.tools = list(dict.fromkeys(move.tool or 1 for move in self.cutting))
        bare = next((move for move in self.cutting if not move.tool), None)
        if bare is not None and len(self.tools) > 1:
            self.errors.append(f"line {bare.line}: a cut without a tool in the spindle, besides those of tools "
                               f"{', '.join(str(n) for n in dict.fromkeys(m.tool for m in self.cutting) if n)}")  # fmt: skip
        self.lines = lines

    def guess(self, line: str, why: str) -> str:
        self.guesses.append(f"{line.strip()}: {why}")
        return f"{line}   # {GUESS}: {why}"

    def missing(self, line: str, why: str) -> str:
        self.open.append(why)
        return f"# {line}   # {OPEN}: {why}"

    def sizeless(self, number: int) -> str:
        """The line of a diameter that nobody tells; the terminal says it once for all tools."""
        first = next((move.line for move in self.cutting if (move.tool or 1) == number), 1)
        self.unsized[number] = first
        note = self.notes.get(number)
        self.ask.append(word_of(number, note and note.kind, self.unit == "inch"))
        return f"# diameter_mm =    # {OPEN}: no comment gives the diameter of tool {number}, which cuts from line {first}"

    def unsized_tools(self) -> str:
        """All tools whose diameters are left open, and where they cut first."""
        places = [f"{number} (cuts from line {line})" for number, line in self.unsized.items()]
        if len(places) == 1:
            return f"no comment gives the diameter of tool {places[0]}"
        return f"no comment gives the diameters of tools {', '.join(places[:-1])} and {places[-1]}"

    def draft(self, words: Sequence[str]) -> Draft:
        """The whole file. words : options that it is made with."""
        low, high = self.extent()
        parts = [
            f"# Job of {self.path.name}, made by vmachining init. Lines with {GUESS} or {OPEN} need your eye.",
            "", f"name = {_text(self.path.stem)}", self.units(), "", *self.program_table(), "", *self.machine_table(),
        ]  # fmt: skip
        for number in self.tools:
            parts += ["", *self.tool_table(number, low, high)]
        parts += ["", *self.stock_table(low, high), "", *REST]
        if self.unsized:
            self.open.insert(0, self.unsized_tools())
        beside: tuple[str, ...] = ()
        if self.open or any(note.place for note in self.notes.values()):  # libraries were looked at
            found, refused = libraries_beside(self.path, self.scale)
            beside = tuple(path.name for path in found) if self.open else ()
            self.guesses += refused
            parts += [f"# {GUESS}: {why}" for why in refused]
        return Draft(
            signed("\n".join(parts) + "\n", words), tuple(self.tools), self.program.dialect, self.unit,
            tuple(self.guesses), tuple(self.open), tuple(self.errors), tuple(self.ask), beside,
        )  # fmt: skip

    def units(self) -> str:
        """Of the lengths below whose keys name no unit."""
        line = f'units = "{self.unit}"'
        if not self.said_unit or self.program.declared.inferred:
            why = unit_of(self.lines).why if self.unit else ""
            what = "the program does not define it" + (f"; {why}" if why else "")
            return f"{line}   # {what}" if self.program.declared.inferred else self.guess(line, what)
        return f"{line}   # of the stock and of home; as in the program"

    def program_table(self) -> list[str]:
        out = ["[program]", f"file = {_text(os.path.relpath(self.path, self.folder))}"]
        out.append(f'dialect = "{self.program.dialect}"')
        if self.program.declared.inferred:
            out.append(self.guess(f'units = "{self.unit}"', "the program does not define it"))
        level = float(self.program.moves[0].start[2]) if self.program.moves else 100.0
        home = [0.0, 0.0, level / self.scale]
        out.append(self.guess(f"home = {_numbers(home)}", "where the tool starts and G28 returns to"))
        sides = next((k for k, line in enumerate(self.lines, 1) if _SIDES.search(line)), None)
        if sides is not None and self.program.dialect in ("iso", "mts"):  # the others are like their controls
            other = 'if entries gouge (E355): "next"' if self.entry == "prev" else 'with "prev" entries gouge'
            why = f"line {sides} compensates the radius; {other}"
            out.append(self.guess(f'crc_entry = "{self.entry}"', why))
        if any(found.code == "W335" for found in self.program.findings):
            out.append(self.guess('dwell = "ms"', "read as seconds, the dwells would last minutes"))
        return [*out, *(f"# a run refuses this program: {error}" for error in self.errors[:3])]

    def machine_table(self) -> list[str]:
        out = ["[machine]"]
        if self.presets:
            why = f"has the axes {self.letters}; so have {', '.join(self.presets[1:5])}"
            out.append(self.guess(f'chain = "{self.presets[0]}"', why))
        return [*out, *LIMITS]

    def extent(self) -> tuple[Floats, Floats]:
        """(3,) lowest and highest place of the tool tip in feed motions, mm."""
        below = self.below
        plain = [m.center is None and m.rotary_deg is None and m.axis_end is None for m in below]
        points: list[Floats] = []
        if any(plain):
            straight = [(m.start, m.end) for m, on in zip(below, plain, strict=True) if on]
            ends = np.array(straight, dtype=np.float64).reshape(-1, 3)
            points += [ends.min(axis=0), ends.max(axis=0)]
        for move in (m for m, on in zip(below, plain, strict=True) if not on):
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

    def told_stock(self, low: Floats, high: Floats) -> str | None:
        """The stock that words or comments of the program give; low, high : extent of the feed motions, mm."""
        told, where, sure = self.program.declared.stock, "as the program says", True
        if told is None:
            note, first = stock_note(self.lines, self.scale), self.cutting[0]
            if note is None:
                return None
            # comments count from the zero of the program, which G92 and offsets shift
            shift = np.subtract(first.end, first.end_program) * (first.rotation_deg == 0.0)
            *corners, sure = placed(note, *((v - shift).tolist() for v in (low, high)))
            box = {key: np.add(v, shift).tolist() for key, v in zip(("min", "max"), corners, strict=True)}
            told, where = {"box": box}, f"line {note.line}: ({note.text})"
            if not sure:
                where += ", laid at the zero where it holds most of the motion"
        ((shape, keys),) = told.items()
        lengths = {k: np.divide(v, self.scale) for k, v in keys.items()}
        values = (
            f"{k} = {v:.9g}" if v.ndim == 0 else f"{k} = {_numbers(v.tolist())}" for k, v in lengths.items()
        )
        line = f"{shape} = {{ {', '.join(values)} }}"
        if shape == "box" and not ((low < keys["max"]) & (high > keys["min"])).all():
            where, sure = f"{where}, but no feed motion comes near it", False
        return f"{line}   # {where}" if sure else self.guess(line, where)

    def stock_table(self, low: Floats, high: Floats) -> list[str]:
        """[stock]: what the program gives, else around the sweep of all tools, its top at zero if it cuts below."""
        if (said := self.told_stock(low, high)) is not None:
            return ["[stock]", said]
        radius = max((note.diameter_mm or 0.0 for note in self.notes.values()), default=0.0) / 2.0
        reach = radius + ALLOWANCE_MM
        lost = [n for n in self.tools if n not in self.notes or self.notes[n].diameter_mm is None]
        step = 1.0 if self.unit == "mm" else MM_PER_INCH / 20.0
        below = low - [reach, reach, ALLOWANCE_MM]
        above = high + [reach, reach, 0.0]
        why = "around what the tools sweep"
        first_cut = self.cutting[0]
        # G92, G54
        zero = first_cut.end[2] - first_cut.end_program[2] if first_cut.rotation_deg == 0.0 else 0.0
        tilted = any(m.axis_end is not None and m.axis_end != (0.0, 0.0, 1.0) for m in self.cutting)
        turned = any(any(m.rotary_deg.values()) for m in self.cutting if m.rotary_deg)
        if turned or tilted or self.program.dialect == "poses":
            above[2] += ALLOWANCE_MM
        elif low[2] < zero:
            above[2], why = zero, f"{why}, with its top at zero"
        else:
            side = [m for m in self.below if m.start[:2] != m.end[:2] or m.center is not None]
            above[2] = max((max(m.start[2], m.end[2]) for m in side), default=float(high[2]))
            why = f"{why}, with its top at the highest cut"
            if above[2] <= low[2]:  # one level: a face, whose allowance nobody tells
                above[2] += ALLOWANCE_MM
                why = f"{why} and {ALLOWANCE_MM:g} mm to face"
        if lost:
            names = ", ".join(map(str, lost[:-1]))
            why += f", but for the radius of tool{f's {names} and' if names else ''} {lost[-1]}"
        corner = [np.floor(below / step + 1e-9) * step, np.ceil(above / step - 1e-9) * step]
        first, second = (_numbers([float(v) / self.scale for v in c]) for c in corner)
        return [
            "[stock]",
            self.guess(f"box = {{ min = {first}, max = {second} }}", why),
            "# cylinder = { center = [0, 0], radius = 40, z = [-25, 0] }",
            '# stl = "stock.stl"   # or step = "stock.step"',
        ]

    def tool_table(self, number: int, low: Floats, high: Floats) -> list[str]:
        note = self.notes.get(number)
        out = ["[[tools]]", f"number = {number}"]
        if note is not None:
            given = note.text == GIVEN
            out.insert(1, f"# given by {GIVEN}" if given else f"# line {note.line}: ({note.text})")
        elif not any(move.tool for move in self.cutting):
            out.insert(1, "# the program calls no tool")
        if (note is None or (note.kind is None and note.corner_mm is None)) and self.only_drills(number):
            note = (note or ToolNote(0, ""))._replace(kind="drill", guess_kind=DRILLS)
            self.notes[number] = note
        depth = float(high[2] - low[2])
        length = max(50.0, 10.0 * math.ceil((depth + 20.0) / 10.0))
        diameter = note.diameter_mm if note is not None else None
        if note is None or (note.kind is None and diameter is None):
            out.append(self.guess('type = "flat"', f"no comment gives the shape of tool {number}"))
            out.append(self.sizeless(number))
        elif diameter is None:
            out += self.shape(number, note, None)
        else:
            length = max(length, 10.0 * math.ceil(0.4 * diameter))
            if note.kind in ("drill", "chamfer"):  # the cone of a narrow tip
                half = note.angle_deg or CHAMFER_DEG
                half = 0.5 * (note.angle_deg or DRILL_DEG) if note.kind == "drill" else half
                half = min(max(half, 1.0), 90.0)
                length = max(length, 10.0 * math.ceil(0.1 * diameter / math.tan(math.radians(half))))
            out += self.shape(number, note, diameter)
        why = f"length of tool {number}, which the program does not tell"
        told = note.length_mm if note is not None else None
        out.append(self.guess(f"length_mm = {length:g}", why) if told is None else f"length_mm = {told:.9g}")
        out += [
            "# flute_length_mm = 20   # without it, shank and holder cannot be checked against the stock",
            "# shank_diameter_mm = 10",
            "# holder = [[20, 60], [25, 100]]   # [r, z] from the tip up",
            f"flutes = {note.flutes}"
            if note is not None and note.flutes
            else "# flutes =    # how many? chip thickness and force need it",
        ]
        return out

    def only_drills(self, number: int) -> bool:
        """Whether all feed motions of a tool are plunges, at `HOLES` places or more."""
        own = [move for move in self.cutting if (move.tool or 1) == number]
        places = {tuple(round(v, 6) for v in move.end[:2]) for move in own}
        straight = all(m.motion is Motion.LINEAR and m.axis_end is None and not m.tcp for m in own)
        return straight and all(m.start[:2] == m.end[:2] for m in own) and len(places) >= HOLES

    def shape(self, number: int, note: ToolNote, diameter: float | None) -> list[str]:
        """Keys of a cutter of which a comment tells the shape, the diameter or both."""
        corner = note.corner_mm
        if diameter is None:
            size = self.sizeless(number)
            diameter = math.inf  # so that no corner makes it a ball
        else:
            size = f"diameter_mm = {diameter:.9g}"
            if note.guess is not None:
                size = self.guess(size, f"diameter of tool {number}, from its name {_text(note.guess)}")
            elif note.place is not None:
                why = f"diameter of tool {number}, from {note.place}, next to the program"
                size = self.guess(size, why)
        if note.text.endswith(".tbl"):
            size = self.guess(size, f"the table has no unit: that of the program is used, {self.unit}")
        if note.kind in ("drill", "chamfer"):
            angle, usual = note.angle_deg, DRILL_DEG if note.kind == "drill" else 2.0 * CHAMFER_DEG
            if angle is not None and note.kind == "chamfer":
                angle *= 2.0
            kind = 'type = "drill"' + ("" if note.kind == "drill" else f"   # a {note.kind}")
            kind = kind if note.guess_kind is None else self.guess(kind, note.guess_kind)
            if angle is not None and 0.0 < angle <= 180.0:
                return [kind, size, f"tip_deg = {angle:.9g}"]
            return [kind, size, self.guess(f"tip_deg = {usual:g}", "the usual angle of such a tool")]
        if note.kind == "taper" and note.angle_deg is not None and 0.0 < note.angle_deg < 90.0:
            round_tip = [f"corner_radius_mm = {corner:.9g}"] if corner else []
            return ['type = "taper"', size, f"taper_deg = {note.angle_deg:.9g}", *round_tip]
        if corner is not None and corner > 0.0 and abs(corner / diameter - 0.5) <= 1e-3:
            return ['type = "ball"', size]
        if corner is not None and 0.0 < corner < diameter / 2 and note.kind != "ball":
            return ['type = "bull"', size, f"corner_radius_mm = {corner:.9g}"]
        if note.kind == "ball":
            return ['type = "ball"', size]
        if note.kind == "bull":
            if number not in self.unsized:
                self.ask.append(word_of(number, "bull", self.unit == "inch"))
            lost = self.missing("corner_radius_mm = ", f"no comment gives the corner radius of tool {number}")
            return ['type = "bull"', size, lost]
        if note.kind == "flat" or corner == 0.0:
            return ['type = "flat"', size]
        said = f"a {note.kind}, taken as a cylinder" if note.kind else "no comment gives the shape"
        if note.text == GIVEN and not note.kind:
            said = f"{GIVEN} gives the diameter of tool {number} alone: taken as a cylinder"
        elif note.line == 0 and not note.kind:
            said = f"the library has '{note.text}', no shape that is known here: taken as a cylinder"
        return [self.guess('type = "flat"', said), size]


def _text(value: str) -> str:
    """A TOML string."""
    return json.dumps(value, ensure_ascii=False)


def _numbers(values: Sequence[float]) -> str:
    return "[" + ", ".join(f"{value + 0.0:.9g}" for value in values) + "]"
