"""Dialect `apt`: cutter location files, as CAM systems write them for post-processors.

    GOTO/x,y,z[,i,j,k]   GODLTA/dx,dy,dz   FROM/x,y,z[,i,j,k]   TLAXIS/i,j,k   GOHOME
    RAPID                (the next motion)           FEDRAT/f[,MMPM|IPM|MMPR|IPR]
    CIRCLE/cx,cy,cz,i,j,k,r[,...]  MOVARC/cx,cy,cz,i,j,k,r[,ANGLE,w]   (the next GOTO is an arc,
                         counter-clockwise about the axis i,j,k, which is one of the main ones,
                         from the tool to the point of the GOTO; w, at most 360 degrees, repeats it)
    LOADTL/n  TOOLNO/n   CUTTER/d[,...]   SPINDL/[RPM,]n[,CLW|CCLW]   SPINDL/ON|OFF   DELAY/seconds
    MULTAX[/ON|OFF]      UNITS/MM|INCHES   END  FINI   $$ comments, and $ continues a line

`COMMENTS` and `NO_MOTION` name the words that say nothing about the path; every other word is refused by name.
Source: ISO 4343 and the files of common CAM systems. Limits: no macros, no computed geometry, no cycles.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final, NamedTuple

from vmachining.nc.arcs import PLANES, ArcError, check_center, is_rounded
from vmachining.nc.checks import finding
from vmachining.nc.lexer import split_lines
from vmachining.nc.model import Finding, Motion, Move, Point
from vmachining.nc.poses import AXIS_TOLERANCE, unit_axis
from vmachining.nc.settings import Settings

__all__ = ["read_apt"]

COMMENTS: Final = frozenset(
    {"PARTNO", "PPRINT", "REMARK", "TOOL PATH", "TLDATA", "MACHIN", "LEADER", "PAINT"}
)
NO_MOTION: Final = frozenset(
    {"COOLNT", "CUTTER", "INTOL", "OUTTOL", "TOLER", "CUTCOM", "OPSTOP", "STOP", "REWIND", "AUTOPS", "CLPRNT",
     "NOPOST", "DISPLY", "END-OF-PATH", "SEQNO", "TPRINT", "SELCTL"}
)  # fmt: skip
"""CUTCOM/ON would move the path and is refused."""

MAX_RECORD: Final = 4096
MAX_ERRORS: Final = 1000
UP: Final[Point] = (0.0, 0.0, 1.0)
_NUMBER: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[EeDd][+-]?\d{1,3})?")
_WORD: Final = re.compile(r"[A-Z][A-Z0-9-]*(?: [A-Z][A-Z0-9-]*)?")
_FEED_UNITS: Final = {
    "MMPM": (1.0, False), "IPM": (25.4, False), "MMPR": (1.0, True), "IPR": (25.4, True),
    "PERMIN": (0.0, False), "PERREV": (0.0, True),
}  # fmt: skip
"""mm per unit (0: the unit of the file), and whether per revolution."""


class _RecordError(Exception):
    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code


class _Circle(NamedTuple):
    center: Point
    plane: int
    ccw: bool
    radius: float


class _Record(NamedTuple):
    line: int
    word: str
    numbers: list[float]
    names: list[str]


def read_apt(text: str, settings: Settings) -> tuple[list[Move], list[Finding], bool]:
    """Moves, findings, and whether FINI or END was reached. A wrong record is left out as a whole."""
    reader = _Apt(settings)
    lines = split_lines(text)
    for line, record in _records(lines):
        if reader.ended:
            reader.note("W404", line, "text behind the end of the program")
            break
        try:
            parsed = _parse(line, record)
            if parsed is not None:
                reader.record(parsed)
        except _RecordError as exc:
            reader.note(exc.code, line, str(exc), record.split("/")[0].strip()[:40])
        if len(reader.found) >= MAX_ERRORS:
            reader.note("E408", line, f"{len(reader.found)} findings so far: the rest is not examined")
            return reader.moves, reader.found, False
    if not reader.ended:
        reader.note("E401", max(1, len(lines)), "the file has no FINI or END")
    if not reader.moves and not reader.found:
        reader.note("W406", 1, "the program contains no motion")
    return reader.moves, reader.found, reader.ended


def _records(lines: list[str]) -> Iterator[tuple[int, str]]:
    """Records with the line they start on: comments gone, continuations joined."""
    begin, held = 0, ""
    for line, raw in enumerate(lines, 1):
        text = raw.split("$$", 1)[0].rstrip()
        more = text.endswith("$")
        held += text.removesuffix("$")
        begin = begin or line
        if more and len(held) <= MAX_RECORD:
            continue
        if held.strip():
            yield begin, held.strip()
        begin, held = 0, ""
    if held.strip():
        yield begin, held.strip()


def _parse(line: int, record: str) -> _Record | None:
    if len(record) > MAX_RECORD:
        raise _RecordError("E105", f"the record has {len(record)} characters, at most {MAX_RECORD} are read")
    head, slash, tail = record.partition("/")
    word = re.sub(r"\s+", " ", head.strip().upper())
    if any(word == name or word.startswith(name + " ") for name in COMMENTS):
        return None
    if not record.isascii():
        raise _RecordError("E106", "only ASCII characters may stand outside a comment")
    if not _WORD.fullmatch(word):
        raise _RecordError("E109", f"'{word[:40]}' is no word of a cutter location file")
    numbers, names = list[float](), list[str]()
    for part in tail.split(",") if slash else []:
        part = part.strip().upper()
        if _NUMBER.fullmatch(part):
            value = float(part.replace("D", "E"))
            if not abs(value) < 1e9:
                raise _RecordError("E102", f"{part} is out of range")
            numbers.append(value)
        elif _WORD.fullmatch(part):
            names.append(part)
        else:
            raise _RecordError("E102", f"'{part[:40]}' is neither a number nor a word")
    return _Record(line, word, numbers, names)


class _Apt:
    """State of a cutter location file."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.moves: list[Move] = []
        self.found: list[Finding] = []
        self.ended = False
        self.tip, self.axis = settings.home, UP
        self.unit, self.multax, self.rapid = 1.0, False, False
        self.feed: float | None = None
        self.per_turn = False
        self.rpm, self.speed, self.tool = 0.0, 0.0, 0
        self.circle: _Circle | None = None
        self.warned = False

    def note(self, code: str, line: int, message: str, word: str = "") -> None:
        """Add a finding."""
        self.found.append(finding(code, line, None, message, word))

    def record(self, record: _Record) -> None:
        """Execute one record."""
        handler = getattr(self, "_do_" + record.word.lower(), None)
        if handler is not None:
            handler(record)
        elif record.word not in NO_MOTION or (record.word == "CUTCOM" and "OFF" not in record.names):
            raise _RecordError("E208", f"{record.word} is not supported")

    # ---- what motions use ----

    def _do_units(self, record: _Record) -> None:
        if record.names == ["MM"]:
            self.unit = 1.0
        elif record.names in (["INCHES"], ["INCH"]):
            self.unit = 25.4
        else:
            raise _RecordError("E109", "UNITS/MM or UNITS/INCHES is wanted")

    def _do_multax(self, record: _Record) -> None:
        if record.names not in ([], ["ON"], ["OFF"]) or record.numbers:
            raise _RecordError("E109", "MULTAX, MULTAX/ON or MULTAX/OFF is wanted")
        self.multax = record.names != ["OFF"]

    def _do_rapid(self, record: _Record) -> None:
        if record.numbers or record.names:
            raise _RecordError("E109", "RAPID takes nothing")
        self.rapid = True

    def _do_fedrat(self, record: _Record) -> None:
        if len(record.numbers) != 1 or len(record.names) > 1:
            raise _RecordError("E109", "FEDRAT/number, or with one of MMPM, IPM, MMPR, IPR, is wanted")
        unit, turn = 0.0, False
        if record.names:
            if record.names[0] not in _FEED_UNITS:
                raise _RecordError("E109", f"feed unit {record.names[0]} is not known")
            unit, turn = _FEED_UNITS[record.names[0]]
        if record.numbers[0] <= 0.0:
            raise _RecordError("E301", f"the feed {record.numbers[0]:g} is not above zero")
        self.feed, self.per_turn, self.rapid = record.numbers[0] * (unit or self.unit), turn, False

    def _do_spindl(self, record: _Record) -> None:
        names = [name for name in record.names if name not in ("RPM", "NOMORE")]
        if len(record.numbers) > 1 or not set(names) <= {"CLW", "CCLW", "ON", "OFF"}:
            raise _RecordError("E109", "SPINDL/number,CLW or SPINDL/OFF is wanted")
        if record.numbers:
            if record.numbers[0] < 0.0:
                raise _RecordError("E312", f"the spindle speed {record.numbers[0]:g} is negative")
            self.speed = record.numbers[0]
        sign = -1.0 if "CCLW" in names else 1.0
        self.rpm = 0.0 if "OFF" in names else sign * self.speed

    def _do_loadtl(self, record: _Record) -> None:
        if not record.numbers or record.numbers[0] < 0 or record.numbers[0] != int(record.numbers[0]):
            raise _RecordError("E322", f"{record.word} wants a whole number from zero up")
        number, tools = int(record.numbers[0]), self.settings.tools
        if number > 0 and tools is not None and number not in tools:
            raise _RecordError("E321", f"tool {number} is not in the tool table")
        self.tool = number

    _do_toolno = _do_loadtl

    def _do_tlaxis(self, record: _Record) -> None:
        if len(record.numbers) != 3:
            raise _RecordError("E109", "TLAXIS/i,j,k is wanted")
        self.axis = self._unit(record, record.numbers)

    def _do_delay(self, record: _Record) -> None:
        if len(record.numbers) != 1 or record.numbers[0] < 0.0:
            raise _RecordError("E335", "DELAY/seconds is wanted")
        self._emit(record.line, Motion.DWELL, self.tip, self.axis, None, dwell=record.numbers[0])

    def _do_end(self, record: _Record) -> None:
        self.ended = True

    _do_fini = _do_end

    # ---- motions ----

    def _do_from(self, record: _Record) -> None:
        self.tip, self.axis = self._target(record)

    def _do_gohome(self, record: _Record) -> None:
        self.circle, self.rapid = None, False
        self._emit(record.line, Motion.RAPID, self.settings.home, self.axis, None)

    def _do_godlta(self, record: _Record) -> None:
        steps = [0.0, 0.0, *record.numbers] if len(record.numbers) == 1 else record.numbers
        if len(steps) != 3 or record.names:
            raise _RecordError("E109", "GODLTA/dx,dy,dz is wanted")
        x, y, z = (p + self.unit * d for p, d in zip(self.tip, steps, strict=True))
        self._go(record, (x, y, z), self.axis)

    def _do_goto(self, record: _Record) -> None:
        self._go(record, *self._target(record))

    def _do_circle(self, record: _Record) -> None:
        if len(record.numbers) < 7:
            raise _RecordError("E109", f"{record.word}/cx,cy,cz,i,j,k,r is wanted")
        if record.names and (
            record.word != "MOVARC" or record.names != ["ANGLE"] or len(record.numbers) != 8
        ):
            raise _RecordError("E109", f"{record.word} does not take {record.names[0]} like this")
        if record.names and not 0.0 < record.numbers[7] <= 360.0:
            raise _RecordError("E309", f"an arc of {record.numbers[7]:g} degrees")
        x, y, z, i, j, k = record.numbers[:6]
        axis = unit_axis((i, j, k))[0]
        normal = next((a for a in range(3) if abs(abs(axis[a]) - 1.0) < AXIS_TOLERANCE), None)
        if normal is None:
            raise _RecordError("E361", "a circle about an axis that is none of X, Y, Z")
        plane = {2: 170, 1: 180, 0: 190}[normal]
        center = x * self.unit, y * self.unit, z * self.unit
        self.circle = _Circle(center, plane, axis[normal] > 0.0, abs(record.numbers[6]) * self.unit)

    _do_movarc = _do_circle

    def _target(self, record: _Record) -> tuple[Point, Point]:
        numbers = record.numbers
        if len(numbers) not in (3, 6) or record.names:
            raise _RecordError("E109", f"{record.word}/x,y,z or {record.word}/x,y,z,i,j,k is wanted")
        tip = numbers[0] * self.unit, numbers[1] * self.unit, numbers[2] * self.unit
        return tip, self._unit(record, numbers[3:]) if len(numbers) == 6 else self.axis

    def _unit(self, record: _Record, numbers: list[float]) -> Point:
        axis, off = unit_axis((numbers[0], numbers[1], numbers[2]))
        if axis == (0.0, 0.0, 0.0):
            raise _RecordError("E363", "the tool axis has no length")
        if off > AXIS_TOLERANCE:
            self.note(
                "W363", record.line, f"the tool axis differs from unit length by {off:.3g}, it is normalised"
            )
        if not self.multax and max(abs(axis[0]), abs(axis[1])) > AXIS_TOLERANCE and not self.warned:
            self.warned = True
            self.note("W364", record.line, "a tilted tool axis without MULTAX")
        return axis

    def _go(self, record: _Record, tip: Point, axis: Point) -> None:
        circle, rapid = self.circle, self.rapid
        self.circle, self.rapid = None, False
        if sum(a * b for a, b in zip(axis, self.axis, strict=True)) < -1.0 + 1e-12:
            raise _RecordError("E364", "the tool axis is reversed: no great circle is the shortest")
        if rapid and circle is not None:
            raise _RecordError("E109", "RAPID and a circle for one motion: rapids go straight")
        if rapid:
            self._emit(record.line, Motion.RAPID, tip, axis, None)
        else:
            feed = self._feed()
            if circle is None:
                self._emit(record.line, Motion.LINEAR, tip, axis, feed)
            else:
                self._arc(record, circle, tip, axis, feed)

    def _feed(self) -> float:
        feed = self.feed
        if feed is not None and self.per_turn:
            feed = feed * abs(self.rpm) or None
        if feed is None:
            raise _RecordError("E301", "a feed move without feed, or per revolution with the spindle stopped")
        return feed

    def _arc(self, record: _Record, circle: _Circle, tip: Point, axis: Point, feed: float) -> None:
        plane = PLANES[circle.plane]
        a, b = plane.first, plane.second
        center = circle.center[a], circle.center[b]
        start, inch = (self.tip[a], self.tip[b]), self.unit != 1.0
        try:
            off = check_center(start, (tip[a], tip[b]), center, inch)
            check_center(start, (center[0] + circle.radius, center[1]), center, inch)  # the r of the record
        except ArcError as exc:
            raise _RecordError(exc.code, str(exc)) from None
        if is_rounded(off):
            self.note("W304", record.line, f"the radii at start and end differ by {off:.3g} mm")
        motion = Motion.ARC_CCW if circle.ccw else Motion.ARC_CW
        self._emit(record.line, motion, tip, axis, feed, plane=plane.name, center=center)

    def _emit(
        self,
        line: int,
        motion: Motion,
        tip: Point,
        axis: Point,
        feed: float | None,
        *,
        plane: str = "xy",
        center: tuple[float, float] | None = None,
        dwell: float = 0.0,
    ) -> None:
        tilted = self.multax or axis != UP or self.axis != UP
        self.moves.append(
            Move(
                line,
                None,
                motion,
                self.tip,
                tip,
                plane,
                center,
                1 if center is not None else 0,
                feed,
                self.tool,
                self.rpm,
                dwell,
                tip,
                tip,
                self.axis if tilted else None,
                axis if tilted else None,
            )
        )
        self.tip, self.axis = tip, axis
