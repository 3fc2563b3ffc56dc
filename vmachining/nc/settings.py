"""How a program is to be read: everything that the program itself does not say.

And tool tables: LinuxCNC `.tbl` files, and the `[[tools]]` part of a job file.
"""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from functools import lru_cache
from math import isfinite
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple, get_args, get_origin, get_type_hints

from vmachining.errors import NCError, ToolError
from vmachining.nc.model import Point
from vmachining.textfile import parse_toml, read_bytes

UNITS: Final = {"mm": 1.0, "inch": 25.4}
_WORD: Final = re.compile(r"([A-Za-z])[ \t]*([+-]?(?:\d+\.?\d*|\.\d+))")


class ToolEntry(NamedTuple):
    """One line of a tool table: number, diameter and length in mm (0 where the table is silent).

    x_mm, y_mm : offsets of the tip beside the spindle. turning : the line gives an orientation (Q), which only
    tools of a lathe have. flutes : teeth, 0 where nothing tells them.
    """

    number: int
    diameter_mm: float
    length_mm: float
    x_mm: float = 0.0
    y_mm: float = 0.0
    turning: bool = False
    flutes: int = 0


def read_tool_table(path: Path | str, units: str = "mm") -> dict[int, ToolEntry]:
    """Read a tool table.

    path : a `.toml` job file, else a `.tbl` table (`T3 P3 X0 Y0 Z0.5 D0.25 ;comment`, D diameter, Z length).
    units : "mm" or "inch", of the `.tbl` numbers; a job file says mm in its keys.
    Returns dict: Tool number to entry.
    Raises ToolError: Unreadable file, a line that is not a tool, a number given twice.
    """
    if units not in UNITS:
        raise ToolError(f"tool table units '{units}'", remedy="mm or inch")
    path = Path(path)
    text = read_bytes(path, "tool table", ToolError).decode("utf-8", errors="replace")
    if "\0" in text:
        raise ToolError("the tool table is a binary file", file=str(path))
    toml = path.suffix.lower() == ".toml"
    entries = _from_toml(text, str(path)) if toml else _from_tbl(text, str(path), units)
    table: dict[int, ToolEntry] = {}
    for line, entry in entries:
        if entry.number in table:
            raise ToolError(f"tool {entry.number} is given twice", file=str(path), line=line)
        table[entry.number] = entry
    return table


def _from_tbl(text: str, name: str, units: str) -> list[tuple[int | None, ToolEntry]]:
    scale, out = UNITS[units], list[tuple[int | None, ToolEntry]]()
    for line, raw in enumerate(text.splitlines(), 1):
        content = raw.partition(";")[0].strip()
        if not content:
            continue
        if _WORD.sub("", content).strip():
            what = "not a tool: words like T3 P3 Z0.5 D0.25 are expected"
            raise ToolError(what, file=name, line=line, word=content[:40])
        words = {letter.upper(): float(value) for letter, value in _WORD.findall(content)}
        number = words.get("T")
        if number is None or number < 0 or number != math.floor(number):
            raise ToolError("a tool needs a whole number T", file=name, line=line, word=content[:40])
        diameter, length, x, y = (scale * words.get(letter, 0.0) for letter in "DZXY")
        turning = words.get("Q", 0.0) != 0.0
        out.append((line, ToolEntry(int(number), abs(diameter), length, x, y, turning)))
    return out


def _from_toml(text: str, name: str) -> list[tuple[int | None, ToolEntry]]:
    try:
        rows: Any = parse_toml(text).get("tools", [])
    except tomllib.TOMLDecodeError as exc:
        raise ToolError(f"not a TOML file: {exc}", file=name) from exc
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise ToolError("tools must be written as [[tools]] tables", file=name)
    out = list[tuple[int | None, ToolEntry]]()
    for row in rows:
        number = row.get("number")
        if not isinstance(number, int) or isinstance(number, bool) or number < 0:
            raise ToolError("every tool needs a whole 'number'", file=name, word=str(number))
        sizes = []
        for key in ("diameter_mm", "length_mm"):
            value = row.get(key, 0.0)
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                raise ToolError(f"tool {number}: {key} must be a number", file=name, word=str(value))
            sizes.append(float(value))
        teeth = row.get("flutes", 0)
        teeth = teeth if isinstance(teeth, int) else 0
        out.append((None, ToolEntry(number, sizes[0], sizes[1], flutes=teeth)))
    return out


UnitName = Literal["", "mm", "inch"]
CrcEntry = Literal["", "prev", "next"]
CrcCorner = Literal["", "arc", "exact", "miter", "line"]
Taps = Literal["reference", "axis"]
Dwell = Literal["s", "ms"]
Compensation = Literal["", "radius", "wear"]
ArcCentres = Literal["", "start", "absolute", "reversed"]
Increments = Literal["", "points", "IS-A", "IS-B", "IS-C"]
AlongZ = Literal["", "z"]
Lathe = Literal["", "diameter", "radius", "mill"]


@lru_cache
def _choices(kind: type) -> dict[str, tuple[str, ...]]:
    """Words that the fields of a class may have, by field."""
    hints = get_type_hints(kind)
    return {name: get_args(hint) for name, hint in hints.items() if get_origin(hint) is Literal}


@dataclass(frozen=True, slots=True, kw_only=True)
class Control:
    """What the parameters of a Fanuc-like control say and the program does not; "" is inferred where that is safe, and said.

    compensation : what D registers hold, the "radius" of the tool, or its "wear" beside a programmed path of the centre
    (then zero). arc_centres : I J K count from the "start" of an arc, are "absolute", or lead from the centre to the
    start ("reversed"). modal_centres : I J K or R that a block leaves out stay as they were. increments : what a length
    without a point counts, the unit itself ("points") or least increments, 0.01 mm and 0.001 inch (IS-A), a tenth
    (IS-B) or a hundredth (IS-C) of these. w : "z", W moves the tool along Z. lathe : a lathe whose X words are diameters
    or radii, or a "mill". swapped : G2 and G3 of that lathe are counted from below.
    """

    compensation: Compensation = ""
    arc_centres: ArcCentres = ""
    modal_centres: bool = False
    increments: Increments = ""
    w: AlongZ = ""
    lathe: Lathe = ""
    swapped: bool = False

    def __post_init__(self) -> None:
        for key, choices in _choices(Control).items():
            if getattr(self, key) not in choices:
                wanted = ", ".join(repr(choice) for choice in choices if choice)
                raise NCError(f"control {key} '{getattr(self, key)}'", remedy=wanted)

    @classmethod
    def of(cls, given: Mapping[str, Any] | Control | None) -> Control:
        """From the keys of a job or a command line.

        Raises NCError: Unknown key or value.
        """
        if isinstance(given, Control):
            return given
        names = [item.name for item in fields(cls)]
        for key in given or {}:
            if key not in names:
                raise NCError(f"a control has no '{key}'", remedy=", ".join(names))
        values: dict[str, Any] = dict(given or {})
        for key in ("modal_centres", "swapped"):
            if key in values:
                values[key] = values[key] in (True, "true", "yes")
        return cls(**values)


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """How a program is read; options from `rotary` to `max_steps` are those of G-code.

    dialect : one of `DIALECTS`, that of an installed package, or "auto": detected and reported (I212).
    units : "mm" or "inch" where the program does not say it; "": inferred where that is safe, and said (I213).
    tools : tool table; None: unknown, tool numbers are not checked and lengths are zero.
    home : mm, simulation frame: where the tool tip starts, and where G28 and G30 go.
    block_delete : skip lines that open with a slash.
    work_offsets : mm, by "G54" to "G59.3"; those not named are zero. Kept by the number of the code, times ten.
    rotary : letters of the rotary axes of the machine, of "ABC".
    crc_entry : "prev": the entry move of cutter compensation is a segment like any other; "next": it goes straight to the
        offset start of the next one; "": "next" in the Fanuc family (start-up type A), else "prev".
    crc_corner : "arc" about outer corners, corners that turn by less than 0.05 rad passed over as the reference control
        does; "exact": those are trimmed or rounded too; "miter": points instead of arcs; "line": as Fanuc controls, one
        point to a right angle, else two, each the radius beyond its segment; "": "line" in that family, else "arc".
    peck_clearance_mm : how far G73 lifts, and G83 stays away, from the last depth.
    taps : in G18 and G19, "reference": beside their holes, as the reference control feeds them; "axis": along it.
    dwell : unit of the P of G4 and of canned cycles (B in mts), "s" or "ms".
    subroutines : folders with subprograms in separate files, NAME.ngc; `read_program` looks next to the program first.
    start_line : restart there: everything before is executed for its modes, offsets and position, but makes no moves.
    max_steps : lines that loops and subprograms may repeat.
    control : what the parameters of a Fanuc-like control say; or its keys.
    stock_top_mm : z of the stock in the simulation frame, for W520. travel_mm : machine coordinates (low, high), for E373.
    blu_mm : smallest step of the machine, for I374.
    """

    dialect: str = "iso"
    units: UnitName = ""
    tools: Mapping[int, ToolEntry] | None = None
    home: Point = (0.0, 0.0, 100.0)
    block_delete: bool = False
    work_offsets: Mapping[int, Point] = field(default_factory=dict)
    rotary: str = ""
    crc_entry: CrcEntry = ""
    crc_corner: CrcCorner = ""
    peck_clearance_mm: float = 0.254
    taps: Taps = "reference"
    dwell: Dwell = "s"
    subroutines: tuple[Path, ...] = ()
    start_line: int = 1
    max_steps: int = 1_000_000
    control: Control = Control()
    stock_top_mm: float | None = None
    travel_mm: tuple[Point, Point] | None = None
    blu_mm: float | None = None

    def __post_init__(self) -> None:
        for key, choices in _choices(Settings).items():
            if getattr(self, key) not in choices:
                wanted = " or ".join(choice for choice in choices if choice)
                raise NCError(f"{key} '{getattr(self, key)}'", remedy=wanted)
        if not set(self.rotary) <= set("ABC"):
            raise NCError(f"rotary axes '{self.rotary}'", remedy="letters of ABC")
        if not all(map(isfinite, self.home)):
            raise NCError(f"home {self.home}", remedy="three finite numbers, mm")
        for folder in self.subroutines:
            if not folder.is_dir():
                what = f"subroutines {folder}: no such folder"
                raise NCError(what, remedy="name the folder that has the subprograms")

    @classmethod
    def of(cls, name: str, codes: Mapping[str, int], options: Mapping[str, Any]) -> Settings:
        """From what a caller of `parse_program` gives; `codes` are the numbers of work offsets.

        Raises NCError: Unknown option value, key of a control or work offset; names the file `name`.
        """
        given = dict(options)
        for key in given.get("work_offsets") or {}:
            if key not in codes:
                what = f"no work offset is called '{key}'"
                raise NCError(what, file=name, remedy="G54 to G59, G59.1 to G59.3")
        given["work_offsets"] = {codes[k]: at for k, at in (given.get("work_offsets") or {}).items()}
        given["control"] = Control.of(given.get("control"))
        if "home" in given:
            given["home"] = tuple(float(value) for value in given["home"])
        given["subroutines"] = tuple(Path(folder) for folder in given.get("subroutines", ()))
        try:
            return cls(**given)
        except NCError as exc:
            exc.file = name
            raise

    @property
    def family(self) -> bool:
        """Whether the dialect is of the Fanuc family, whose controls take what others refuse."""
        return self.dialect in ("fanuc", "haas", "mazak", "okuma")

    @property
    def turning(self) -> bool:
        """Whether the program is one for turning."""
        return self.family and self.control.lathe in ("diameter", "radius")

    @property
    def entry(self) -> CrcEntry:
        """`crc_entry`, or that of the dialect."""
        return self.crc_entry or ("next" if self.family else "prev")

    @property
    def corner(self) -> CrcCorner:
        """`crc_corner`, or that of the dialect."""
        return self.crc_corner or ("line" if self.family else "arc")
