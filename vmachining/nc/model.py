"""What a program becomes: rows of motion, and findings; arithmetic of points, and what cannot be executed."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Final, NamedTuple, TypeAlias

from vmachining.errors import NCError
from vmachining.htmltable import facts_html, table_html

Point: TypeAlias = tuple[float, float, float]
"""X, Y, Z in mm."""

ASSUMED_RPM: Final = 1000.0
"""For feeds per turn of a program that gives no speed: the path does not depend on it, times and chips do."""


class Motion(StrEnum):
    """How the tool gets from `start` to `end`."""

    RAPID = "rapid"
    LINEAR = "linear"
    ARC_CW = "arc_cw"
    ARC_CCW = "arc_ccw"
    DWELL = "dwell"


class Move(NamedTuple):
    """One canonical motion. Lengths mm.

    line : 1-based line of the program. n : its N word.
    start, end : tool tip in the simulation frame. The path is continuous from move to move, except before an
    arc in a plane whose tool length was switched just before. A move may have no length (`G0` alone).
    plane : "xy", "zx" or "yz". center : arcs only, simulation frame, in the axis order of the plane.
    turns : arcs only (else 0); 1 is up to one full circle, each further turn adds one.
    feed_mm_min : along the path, inverse time and per-revolution feeds already converted; None: rapid, dwell.
    tool : number of the tool in the spindle. spindle_rpm : + M3, - M4, 0 stopped.
    dwell_s : dwells only, else 0.
    end_machine : machine coordinates, all offsets and the tool length included.
    end_program : what the active work offset sees (before G5x, G92, rotation and tool length).

    More than three axes; all None (and `tcp` False) in three-axis programs:
    axis_start, axis_end : unit tool axis, work coordinates, where the program says it (apt, poses).
    rotary_start, rotary_deg : machine degrees at start and end, by "a", "b", "c", of the rotary axes that the
        program has named so far.
    rotary_program : as rotary_deg, before the offsets.
    tcp : tool centre point control was on: start and end are the tip in work coordinates and go straight.
        Without it, axes move together, and where the tip goes is for the chain of the machine to say.
    duration_s : time of the block where the program fixes it and the path length does not (inverse time or
        degrees per minute with a rotary axis).
    rotation_deg : of the work offset in force, about Z: program coordinates are turned by it.
    coolant : "mist", "flood", "mist and flood" or "", at the move.
    circle : centre, and the unit normal that the arc goes round counter-clockwise, where the plane leans or the
        tool does: at most half a turn, `center` is None then. The tool axis stays.
    """

    line: int
    n: int | None
    motion: Motion
    start: Point
    end: Point
    plane: str
    center: tuple[float, float] | None
    turns: int
    feed_mm_min: float | None
    tool: int
    spindle_rpm: float
    dwell_s: float
    end_machine: Point
    end_program: Point
    axis_start: Point | None = None
    axis_end: Point | None = None
    rotary_start: Mapping[str, float] | None = None
    rotary_deg: Mapping[str, float] | None = None
    rotary_program: Mapping[str, float] | None = None
    tcp: bool = False
    duration_s: float | None = None
    rotation_deg: float = 0.0
    circle: tuple[Point, Point] | None = None
    coolant: str = ""


class Finding(NamedTuple):
    """Something the reader of the program must know.

    line, col : 1-based; col is the first character of `word` in the raw line, 1 for a whole block.
    length : characters. n : N word of the line. severity : "E" block skipped, "W" warning, "I" information.
    """

    line: int
    col: int
    length: int
    n: int | None
    word: str
    code: str
    severity: str
    message: str
    hint: str


class Declared(NamedTuple):
    """What a program says of its job. unit : "mm", "inch" or "". radii : mm, by tool.

    stock : as under [stock] of a job, mm: {"box": {"min": ..., "max": ...}} or {"cylinder": {"center", "radius", "z"}}.

    tools : numbers of those that it calls. names : of tools that it calls by name.
    inferred : the unit was concluded, the program does not define it.
    """

    unit: str = ""
    stock: Mapping[str, Mapping[str, Any]] | None = None
    radii: Mapping[int, float] = {}
    tools: tuple[int, ...] = ()
    names: Mapping[int, str] = {}
    inferred: bool = False


NOTHING_DECLARED = Declared()


class Reading(NamedTuple):
    """moves, findings, whether the end of the program was reached, subprogram files that were read, what else it says."""

    moves: list[Move]
    findings: list[Finding]
    ended: bool
    files: tuple[str, ...] = ()
    declared: Declared = NOTHING_DECLARED


SHOWN = 8
"""Findings of a program that a notebook lists."""


@dataclass(frozen=True, slots=True)
class Program:
    """A program that was read: its bytes, what it does, and what is wrong with it.

    findings are sorted by line, column and code. ended : M2, M30 or a closing tape mark was reached. files : paths
    of the subprograms that were read from separate files. declared : unit, stock and tools that it names.
    """

    name: str
    data: bytes
    dialect: str
    moves: tuple[Move, ...]
    findings: tuple[Finding, ...]
    ended: bool
    files: tuple[str, ...] = ()
    declared: Declared = NOTHING_DECLARED

    def __repr__(self) -> str:
        found = f", {len(self.errors)} errors" if self.errors else ""
        return f"Program({self.name!r}, {self.dialect}, {len(self.moves)} moves{found})"

    def _repr_html_(self) -> str:
        """What a notebook shows: the size of the program, and its first findings."""
        counts = str(len(self.moves)), str(len(self.findings))
        facts = [("dialect", self.dialect), ("motions", counts[0]), ("findings", counts[1])]
        rows = [(f.code, f.line, f.message) for f in self.findings[:SHOWN]]
        found = table_html(("code", "line", "message"), rows) if rows else ""
        return facts_html(f"Program {self.name}", facts) + found

    @property
    def errors(self) -> tuple[Finding, ...]:
        """The findings of severity E."""
        return tuple(finding for finding in self.findings if finding.severity == "E")

    def require_clean(self, *, allow: Collection[str] = ()) -> None:
        """Refuse a program with errors.

        allow : codes that do not count, e.g. {"W401"} for a program without M2 or M30.
        Raises NCError: The first finding of severity E, with file, line and column.
        """
        f = next((f for f in self.errors if f.code not in allow), None)
        if f is not None:
            what, word, remedy = f"{f.code} {f.message}", f.word or None, f.hint or None
            raise NCError(what, file=self.name, line=f.line, col=f.col, word=word, remedy=remedy)


def add(a: Point, b: Point) -> Point:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def subtract(a: Point, b: Point) -> Point:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def put(a: Point, values: Mapping[int, float]) -> Point:
    """`a` with other coordinates along some axes."""
    return values.get(0, a[0]), values.get(1, a[1]), values.get(2, a[2])


class PenError(Exception):
    """The block cannot be executed. code : of the catalogue. word : to blame, where it is known."""

    def __init__(self, code: str, message: str, word: str = "", hint: str = "") -> None:
        super().__init__(message)
        self.code, self.word, self.hint = code, word, hint


def refused(what: str, word: str = "", hint: str = "") -> PenError:
    """What is not read."""
    return PenError("E208", f"{what} is not supported", word, hint)


def misread(text: str) -> PenError:
    """A part of a block that follows no form that is known."""
    return PenError("E109", f"'{text}' is not understood", text)


class ArcError(PenError):
    """The arc does not exist."""


class CompensationError(PenError):
    """The tool cannot go there."""


class CornerError(PenError):
    """The corner cannot be made."""

    def __init__(self, message: str) -> None:
        super().__init__("E355", message)


class RecordError(PenError):
    """A record of a cutter location file that cannot be executed."""

    def __init__(self, code: str, message: str, hint: str = "") -> None:
        super().__init__(code, message, "", hint)
