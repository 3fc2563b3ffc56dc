"""Records of a cutter location file, and its motions: straight, on arcs, into holes; coordinate systems.

WORD/value, value, ... ; `$$` opens a comment, a single `$` continues a record. Cycles are
CYCLE/DRILL,RAPTO,3,FEDTO,-20,RTRCTO,AUTO,MMPM,100, then one GOTO for each hole, which names the top of the hole. Along the
tool axis the clearance plane lies RAPTO (or CLEAR) above it, the bottom FEDTO below it (a negative number in NX files, a
positive one in others), and the tool goes back to RTRCTO above it: AUTO is the level where the cycle began, and without the
word it stays on the clearance plane. Between holes it travels at the level it has; where the next clearance plane lies higher
it rises first.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

from vmachining.nc.findings import finding
from vmachining.nc.frames import PLANES, UP, Frame, check_center, columns, cross, dot, is_rounded
from vmachining.nc.model import ArcError, Finding, Motion, Move, Point, RecordError, subtract
from vmachining.nc.poses import AXIS_TOLERANCE, unit_axis
from vmachining.nc.settings import Settings

MAX_RECORD: Final = 4096

COMMENTS: Final = frozenset(
    {"PARTNO", "PPRINT", "REMARK", "TOOL PATH", "MACHIN", "LEADER", "PAINT", "INSERT", "TPRINT", "TDATA", "PRINT", "LETTER",
     "NOTE", "OP NAME", "OPNAME", "$$", "LOAD TOOL NAME"}
)  # fmt: skip
"""Words whose rest is text; `TOOL PATH` and `INSERT` are looked at for what they say of tools."""

_NUMBER: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[EeDd][+-]?\d{1,3})?")
_WORD: Final = re.compile(r"[A-Z][A-Z0-9_.-]*(?: [A-Z0-9][A-Z0-9_.-]*)*")
_NAME: Final = re.compile(r"(?:[A-Z_]|[0-9]+[A-Z]{2})[A-Z0-9_.+-]*")


class Record(NamedTuple):
    """line : 1-based. word : upper case. numbers, names : what follows the slash, each in order; values : both.

    text : what follows the slash, as it stands there.
    """

    line: int
    word: str
    numbers: list[float]
    names: list[str]
    values: list[float | str]
    text: str = ""

    def after(self, *names: str) -> float | None:
        """The number behind one of these names, None where none exists."""
        for name, value in zip(self.values, self.values[1:], strict=False):
            if name in names and isinstance(value, float):
                return value
        return None


def records(lines: list[str]) -> Iterator[tuple[int, str]]:
    """Records with the line they start on: continuations joined, comments gone, `$$->` of Creo with its continuations."""
    begin, held = 0, list[str]()
    size, remark, gone = 0, False, False
    for line, raw in enumerate(lines, 1):
        remark = (remark or raw.lstrip().startswith("$$->")) and raw.rstrip().endswith("$")
        text = "" if remark or gone else raw.split("$$", 1)[0].rstrip()
        gone = remark
        more = text.endswith("$")
        held.append(text.removesuffix("$"))
        size += len(text)
        begin = begin or line
        if more and size <= MAX_RECORD:
            continue
        if joined := "".join(held).strip():
            yield begin, joined
        begin, held, size = 0, [], 0
    if joined := "".join(held).strip():
        yield begin, joined


def parse_record(line: int, record: str) -> Record:
    """Word and values of a record.

    Raises RecordError: E102, E105, E106, E109.
    """
    if len(record) > MAX_RECORD:
        raise RecordError("E105", f"the record has {len(record)} characters, at most {MAX_RECORD} are read")
    head, slash, tail = record.partition("/")
    word = " ".join(head.upper().split())
    if word.startswith("TLON,"):  # the only word with a modifier before its slash
        word = "TLON"
    for name in COMMENTS:
        if word == name or (word.startswith(name + " ") and name != "TOOL PATH"):
            return Record(line, name, [], [], [], tail.strip() if slash else word.removeprefix(name).strip())
    if not record.isascii():
        raise RecordError("E106", "only ASCII characters are allowed outside a comment")
    if not _WORD.fullmatch(word):
        raise RecordError("E109", f"'{word[:40]}' is not a word of a cutter location file")
    numbers, names, values = list[float](), list[str](), list[float | str]()
    for part in tail.replace("(", ",(,").replace(")", ",),").split(",") if tail.strip() else []:
        part = part.strip().upper()
        if _NUMBER.fullmatch(part):
            value = float(part.replace("D", "E"))
            if not abs(value) < 1e9:
                raise RecordError("E102", f"{part} is out of range")
            numbers.append(value)
            values.append(value)
        elif _NAME.fullmatch(part) or part in ("(", ")") or _WORD.fullmatch(part) or "/" in part:
            names.append(part)
            values.append(part)
        elif part or ("(" not in tail and word != "TOOLNO"):  # CATIA leaves fields of a tool empty
            raise RecordError("E102", f"'{part[:40]}' is neither a number nor a word")
    return Record(line, word, numbers, names, values, tail.strip())


UNITS: Final = {"MMPM", "IPM", "MMPR", "IPR", "PERMIN", "PERREV"}
_PLAIN: Final = frozenset(
    {"DRILL", "FACE", "SPOT", "CDRILL", "REAM", "THRU", "BORE", "BOREOS", "BORE5", "STAND", "STD"}
)
_PECK: Final = frozenset({"DEEP", "DEEP2", "PECK"})
_BREAK: Final = frozenset({"BRKCHP", "BREAK", "CHIP"})
_TAP: Final = frozenset({"TAP", "RTAP", "RIGTAP"})
_FEED_OUT: Final = frozenset({"REAM", "BORE", "BORE5"})
_LENGTHS: Final = frozenset(
    {"RAPTO", "CLEAR", "FEDTO", "DEPTH", "RTRCTO", "STEP", "STEP1", "STEP2", "INCR", "1STPECK", "SUBPECK"}
)
_HARMLESS: Final = frozenset({"AUTO", "CAM", "NULL", "SPIRAL", "ON", "NODRAG", "ORIENT"})
MAX_STEPS: Final = 100_000


class CycleStep(NamedTuple):
    """One motion along the axis: height above the top of the hole, whether it feeds, dwell before it continues, s."""

    height: float
    feeds: bool
    dwell: float = 0.0


class HoleCycle(NamedTuple):
    """A cycle in force; lengths mm along the tool axis. back : None: where the cycle began. feed : (value, unit)."""

    kind: str
    clear: float
    depth: float
    back: float | None
    first: float = 0.0
    step: float = 0.0
    dwell: float = 0.0
    feed: tuple[float, str] | None = None
    out: bool = False

    def steps(self, gap: float) -> list[CycleStep]:
        """From the clearance plane to the bottom and back to it; gap : between a retract and the last depth."""
        bottom = -self.depth
        if not self.step:
            down = [CycleStep(bottom, True, self.dwell)]
            return [*down, CycleStep(self.clear, True)] if self.out else down
        out, at, stroke = list[CycleStep](), 0.0, self.first or self.step
        while True:
            at, stroke = at - stroke, self.step
            if at <= bottom + 1e-9:
                return [*out, CycleStep(bottom, True, self.dwell)]
            if len(out) > MAX_STEPS:
                raise RecordError("E334", f"over {MAX_STEPS} steps in one hole")
            out.append(CycleStep(at, True, self.dwell))
            if self.kind != "BRKCHP":
                out.append(CycleStep(self.clear, False))
            out.append(CycleStep(min(at + gap, self.clear), False))


def cycle_of(record: Record, unit: float, signed: bool) -> HoleCycle:
    """The cycle that a record starts.

    unit : mm per unit of the file. signed : depths are negative below the top of the hole, as in NX files.
    Raises RecordError: A cycle or a word that is not known, or a depth that is missing.
    """
    kinds = [name for name in record.names if name in _PLAIN | _PECK | _BREAK | _TAP]
    known = {*_LENGTHS, *UNITS, *_HARMLESS, *kinds, "DWELL", "REV", "SEC"}
    if not kinds or (other := next((name for name in record.names if name not in known), None)):
        what = record.names[0] if not kinds and record.names else other if kinds else "without a name"
        text = f"CYCLE/{record.text[:40]}: {what} is not supported"
        raise RecordError("E208", text, "post the holes as single moves")
    depth, clear = record.after("FEDTO", "DEPTH"), record.after("RAPTO", "CLEAR")
    if depth is None and (kinds[0] in record.values) and not any(n in _LENGTHS for n in record.names):
        depth = record.after(kinds[0])
    if depth is None or depth == 0.0:
        raise RecordError("E331", "a cycle without FEDTO, the depth of its holes")
    if signed and depth > 0.0:
        raise RecordError("E333", f"FEDTO {depth:g} lies above the top of the hole")
    if clear is not None and clear < 0.0:
        raise RecordError("E333", f"RAPTO {clear:g} lies below the top of the hole")
    feed = next(((v, name) for name in UNITS if (v := record.after(name)) is not None), None)
    first, step = record.after("1STPECK", "STEP1"), record.after("STEP", "STEP2", "INCR", "SUBPECK")
    pecks = bool(set(kinds) & (_PECK | _BREAK)) or step is not None
    if pecks and not (step or first):
        raise RecordError("E334", f"CYCLE/{kinds[0]} without STEP", "program STEP")
    if (step or 0.0) < 0.0 or (first or 0.0) < 0.0:
        raise RecordError("E334", "a step of a cycle is negative")
    back = record.after("RTRCTO")
    dwell = 0.0 if "REV" in record.names else record.after("DWELL") or 0.0
    tap = bool(set(kinds) & _TAP)
    kind = "BRKCHP" if set(kinds) & _BREAK else "TAP" if tap else kinds[0]
    level = (clear or 0.0) * unit
    end = back * unit if back is not None else None if "RTRCTO" in record.names else level
    strokes = ((first or 0.0) * unit, (step or first or 0.0) * unit) if pecks else (0.0, 0.0)
    out = tap or bool(set(kinds) & _FEED_OUT)
    return HoleCycle(kind, level, abs(depth) * unit, end, *strokes, dwell, feed, out)


CHORD_MM: Final = 5e-4
"""Of a circle that lies in no main plane: an eighth of the finest tolerance that CAM systems cut with."""

FEED_UNITS: Final = {
    "MMPM": (1.0, False), "IPM": (25.4, False), "MMPR": (1.0, True), "IPR": (25.4, True),
    "PERMIN": (0.0, False), "PERREV": (0.0, True),
}  # fmt: skip
"""mm per unit (0: the unit of the file), and whether per revolution."""


class Circle(NamedTuple):
    """Of the next GOTO: counter-clockwise about the axis; radius : as the record says it, or None."""

    center: Point
    axis: Point
    radius: float | None


def along(point: Point, axis: Point, height: float) -> Point:
    """point + height axis"""
    return point[0] + axis[0] * height, point[1] + axis[1] * height, point[2] + axis[2] * height


class AptMotions:
    """State of a cutter location file, and the motions that change it."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.moves: list[Move] = []
        self.found: list[Finding] = []
        self.ended = self.path_ended = False
        self.tip, self.axis = settings.home, UP
        self.unit, self.multax, self.rapid = 1.0, False, False
        self.feed: float | None = None
        self.per_turn = False
        self.rpm, self.speed, self.tool = 0.0, 0.0, 0
        self.circle: Circle | None = None
        self.heading: Point | None = None
        self.cycle: HoleCycle | None = None
        self.level: float | None = None
        self.said: set[str] = set()
        self.names: dict[str, int] = {}
        self.called = ""
        self.native = False
        self.first: Frame | None = None
        self.frame: Frame | None = None
        self.local = False

    def note(self, code: str, line: int, message: str, word: str = "", hint: str = "") -> None:
        self.found.append(finding(code, line, None, message, word, hint=hint))

    def once(self, code: str, line: int, message: str, word: str = "") -> None:
        if message not in self.said:
            self.said.add(message)
            self.note(code, line, message, word)

    def _enter(self, record: Record, origin: Point, x: Point, y: Point) -> None:
        x, long_x = unit_axis(x)
        y, long_y = unit_axis(y)
        if max(long_x, long_y, abs(dot(x, y))) > 1e-4:
            raise RecordError("E109", f"{record.word}: its axes are not perpendicular unit vectors")
        z = unit_axis(cross(x, y))[0]
        zero = origin[0] * self.unit, origin[1] * self.unit, origin[2] * self.unit
        frame = Frame(columns(x, unit_axis(cross(z, x))[0], z), zero)
        if self.local:
            self.first = self.first or frame
            self.frame = None if frame == self.first else frame
            if self.frame is not None:
                what = "another coordinate system: its points are turned into that of the first operation"
                self.once("I213", record.line, what, record.word)
        self.axis = self._vector(UP) if self.local else z

    def _point(self, numbers: Sequence[float]) -> Point:
        """A point of the file in the coordinate system of the job, mm."""
        point = numbers[0] * self.unit, numbers[1] * self.unit, numbers[2] * self.unit
        if self.frame is None or self.first is None:
            return point
        return self.first.into(subtract(self.frame.apply(point), self.first.origin))

    def _vector(self, vector: Point) -> Point:
        if self.frame is None or self.first is None:
            return vector
        return self.first.into(self.frame.vector(vector))

    def _unit(self, record: Record, numbers: list[float]) -> Point:
        axis, off = unit_axis((numbers[0], numbers[1], numbers[2]))
        if axis == (0.0, 0.0, 0.0):
            raise RecordError("E363", "the tool axis has no length")
        if off > AXIS_TOLERANCE:
            what = f"the tool axis differs from unit length by {off:.3g}, it is normalised"
            self.note("W363", record.line, what)
        if not (self.multax or self.native) and max(abs(axis[0]), abs(axis[1])) > AXIS_TOLERANCE:
            self.once("W364", record.line, "a tilted tool axis without MULTAX")
        return self._vector(axis)

    def _go(self, record: Record, tip: Point, axis: Point) -> None:
        circle, rapid = self.circle, self.rapid
        self.circle, self.rapid = None, False
        if dot(axis, self.axis) < -1.0 + 1e-12:
            raise RecordError("E364", "the tool axis is reversed: no great circle is the shortest")
        if rapid and circle is not None:
            raise RecordError("E109", "RAPID and a circle for one motion: rapids go straight")
        if rapid:
            self._emit(record.line, Motion.RAPID, tip, axis, None)
        elif circle is None:
            self._emit(record.line, Motion.LINEAR, tip, axis, self._feed())
        else:
            self._arc(record, circle, tip, axis, self._feed())

    def _feed(self) -> float:
        feed = self.feed
        if feed is not None and self.per_turn:
            feed = feed * abs(self.rpm) or None
        if feed is None:
            raise RecordError("E301", "a feed move without feed, or per revolution with the spindle stopped")
        return feed

    def _arc(self, record: Record, circle: Circle, tip: Point, axis: Point, feed: float) -> None:
        normal = next((a for a in range(3) if abs(abs(circle.axis[a]) - 1.0) < AXIS_TOLERANCE), None)
        if normal is None:
            self._chords(record, circle, tip, axis, feed)
            return
        plane = PLANES[{2: 170, 1: 180, 0: 190}[normal]]
        a, b = plane.first, plane.second
        center = circle.center[a], circle.center[b]
        start = self.tip[a], self.tip[b]
        self._check_radii(record, start, (tip[a], tip[b]), center, circle.radius)
        motion = Motion.ARC_CCW if circle.axis[normal] > 0.0 else Motion.ARC_CW
        self._emit(record.line, motion, tip, axis, feed, plane=plane.name, center=center)

    def _check_radii(
        self, record: Record, start: tuple[float, float], end: tuple[float, float], center: tuple[float, float],
        radius: float | None,
    ) -> None:  # fmt: skip
        inch = self.unit != 1.0
        try:
            off = check_center(start, end, center, inch)
            if radius is not None:
                check_center(start, (center[0] + radius, center[1]), center, inch)  # the r of the record
        except ArcError as exc:
            raise RecordError(exc.code, str(exc)) from None
        if is_rounded(off):
            self.note("W304", record.line, f"the radii at start and end differ by {off:.3g} mm")

    def _chords(self, record: Record, circle: Circle, tip: Point, axis: Point, feed: float) -> None:
        """An arc in no main plane, as lines on it."""
        n, start, stop = circle.axis, subtract(self.tip, circle.center), subtract(tip, circle.center)
        rise, top = dot(start, n), dot(stop, n)
        u, v = along(start, n, -rise), along(stop, n, -top)
        r, end_r = math.hypot(*u), math.hypot(*v)
        self._check_radii(record, (r, 0.0), (end_r, 0.0), (0.0, 0.0), circle.radius)
        side = cross(n, u)
        sweep = math.atan2(dot(v, side) / r, dot(v, u) / r) % math.tau
        sweep = math.tau if math.dist(self.tip, tip) < 1e-9 or sweep < 1e-9 else sweep
        count = max(2, math.ceil(sweep / (2.0 * math.acos(max(0.0, 1.0 - CHORD_MM / r)))))
        what = f"an arc about a tilted axis is read as lines on it, within {CHORD_MM:g} mm"
        self.once("I361", record.line, what, record.word)
        begin = self.axis
        for k in range(1, count + 1):
            t = k / count
            c, s = math.cos(sweep * t), math.sin(sweep * t)
            scale = (r + (end_r - r) * t) / r
            place = [
                circle.center[i] + n[i] * (rise + (top - rise) * t) + scale * (c * u[i] + s * side[i])
                for i in range(3)
            ]
            point = tip if k == count else (place[0], place[1], place[2])
            mixed = tuple(p + (q - p) * t for p, q in zip(begin, axis, strict=True))
            now = axis if k == count or begin == axis else unit_axis((mixed[0], mixed[1], mixed[2]))[0]
            self._emit(record.line, Motion.LINEAR, point, now, feed)

    def _hole(self, record: Record, cycle: HoleCycle, top: Point, axis: Point) -> None:
        """One hole whose top is the point of the GOTO."""
        if cycle.feed is not None:
            unit, self.per_turn = FEED_UNITS[cycle.feed[1]]
            self.feed = cycle.feed[0] * (unit or self.unit)
        feed, line = self._feed(), record.line
        self.rapid, self.circle = False, None
        if dot(axis, self.axis) < 1.0 - 1e-9:
            what = "end the cycle before the tool tilts"
            raise RecordError("E208", "the tool axis turns inside a cycle", what)
        here = dot(subtract(self.tip, top), axis)
        began = dot(self.tip, axis)
        if self.level is None:
            self.level = began
        if here < cycle.clear:
            self._emit(line, Motion.RAPID, along(self.tip, axis, cycle.clear - here), axis, None)
            here = cycle.clear
        over = along(top, axis, here)
        if math.dist(over, self.tip) > 0.0:
            self._emit(line, Motion.RAPID, over, axis, None)
        if here > cycle.clear:
            self._emit(line, Motion.RAPID, along(top, axis, cycle.clear), axis, None)
        for step in cycle.steps(self.settings.peck_clearance_mm):
            motion = Motion.LINEAR if step.feeds else Motion.RAPID
            if cycle.kind == "TAP" and step.height == cycle.clear:
                self.rpm = -self.rpm
            self._emit(line, motion, along(top, axis, step.height), axis, feed if step.feeds else None)
            if step.dwell:
                self._emit(line, Motion.DWELL, self.tip, axis, None, dwell=step.dwell)
        if cycle.kind == "TAP":
            self.rpm = -self.rpm
        back = self.level - dot(top, axis) if cycle.back is None else cycle.back
        height = dot(subtract(self.tip, top), axis)
        if max(back, cycle.clear) > height:
            self._emit(line, Motion.RAPID, along(top, axis, max(back, cycle.clear)), axis, None)

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
        turns = 1 if center is not None else 0
        self.moves.append(
            Move(line, None, motion, self.tip, tip, plane, center, turns, feed, self.tool, self.rpm, dwell, tip, tip,
                 self.axis if tilted else None, axis if tilted else None)
        )  # fmt: skip
        self.tip, self.axis = tip, axis
