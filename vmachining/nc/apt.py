"""Dialect `apt`: cutter location files, as CAM systems write them for post-processors.

    GOTO/x,y,z[,i,j,k]   GODLTA/dx,dy,dz   FROM/x,y,z[,i,j,k]   TLAXIS/i,j,k   GOHOME[/x,y,z]
    RAPID                (the next motion)           FEDRAT/f[,MMPM|IPM|MMPR|IPR], in either order
    CIRCLE/cx,cy,cz,i,j,k[,r,...]  MOVARC/cx,cy,cz,i,j,k,r[,ANGLE,w]   (the next GOTO is an arc,
                         counter-clockwise about the axis i,j,k, from the tool to the point of the GOTO;
                         w, at most 360 degrees, repeats it)
    INDIRV/dx,dy,dz and TLON,GOFWD/(CIRCLE/cx,cy,cz,r),ON,(LINE/cx,cy,cz,ex,ey,ez)      an arc, as CATIA writes it
    CYCLE/DRILL|DEEP|BRKCHP|TAP|BORE|...,RAPTO,a,FEDTO,b,RTRCTO,c,MMPM,f   CYCLE/OFF   (`apt_motions.py`)
    LOADTL/n  LOAD/TOOL,n  TOOLNO/n      CUTTER/d[,...]   SPINDL/[RPM,]n[,CLW|CCLW]   SPINDL/ON|OFF   DELAY/seconds
    MULTAX[/ON|OFF]      UNITS/MM|INCHES  UNIT/MM   END  FINI  END-OF-PATH
    TOOL PATH/op,TOOL,name   TLDATA/...   MSYS/origin, x axis, y axis   CSYS/3 x 4 matrix   TRNTYP/WORLD

Points of NX files are in the coordinate system that MSYS names; that of the first operation is the one of the job, later
ones are turned into it. Where tools have names and no numbers they are numbered in the order in which they appear.
Points are those of the tool, so CUTCOM changes nothing: its register holds wear, which no file knows.
A circle about an axis other than X, Y and Z becomes lines within half a thousandth of a mm, and that is said (I361).
`NO_MOTION` names the words that say nothing about the path; every other word is refused by name, once.
Source: ISO 4343 and the files of common CAM systems. Limits: no macros, no computed geometry.
"""

from __future__ import annotations

import re
from typing import Final

from vmachining.nc.apt_motions import (
    COMMENTS,
    FEED_UNITS,
    AptMotions,
    Circle,
    Record,
    along,
    cycle_of,
    parse_record,
    records,
)
from vmachining.nc.findings import NO_TOOL
from vmachining.nc.frames import UP, cross, dot
from vmachining.nc.lexer import split_lines
from vmachining.nc.model import Declared, Motion, Point, Reading, RecordError, add, subtract
from vmachining.nc.poses import unit_axis
from vmachining.nc.settings import Settings

NO_MOTION: Final = frozenset(
    {"COOLNT", "CUTTER", "INTOL", "OUTTOL", "TOLER", "OPSTOP", "STOP", "REWIND", "AUTOPS", "CLPRNT", "SETUP", "OP",
     "NOPOST", "DISPLY", "SEQNO", "SELCTL", "SELECT", "TLDATA", "PREFUN", "AUXFUN", "OPSKIP", "LINTOL", "MCHTOL",
     "CLAMP", "CONTACT", "RAPTO", "BREAK", "CHECK", "RANGE", "ARCSLP", "TMARK", "CAMERA", "MODE", "SYN", "CLEARP",
     "MACHINE", "OPERATION", "GEOM", "TOOL", "SET", "CSI_SET_FLUTE_LENGTH", "CSI_SET_EXTENSION_LENGTH", "RETRCT"}
)  # fmt: skip
MAX_ERRORS: Final = 1000
_INCH: Final = re.compile(r"^[^$]*\b(?:IPM|IPR)\b", re.MULTILINE)
_METRIC: Final = re.compile(r"^[^$]*\b(?:MMPM|MMPR)\b", re.MULTILINE)
_INTOF: Final = re.compile(r"\d\s*,\s*INTOF")
_ARC_TO_LINE: Final = re.compile(r"CIRCLE\s*/.*LINE\s*/", re.DOTALL)
_NUMBERS: Final = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[ED][-+]?\d+)?")
_SAID: Final = re.compile(r"^\s*UNITS?\s*/", re.MULTILINE | re.IGNORECASE)


def read_apt(text: str, settings: Settings) -> Reading:
    """Read a file; its end is FINI, END or END-OF-PATH. A wrong record is left out."""
    reader = _Apt(settings)
    lines = split_lines(text)
    reader.choose_unit(text)
    refused: set[str] = set()
    for line, record in records(lines):
        if reader.ended:
            reader.note("W404", line, "text after the end of the program")
            break
        try:
            reader.record(parse_record(line, record))
        except RecordError as exc:
            word = record.split("/")[0].strip()[:40]
            if (exc.code == "E208" or str(exc) == _TURNED) and str(exc) in refused:
                continue  # one cause, one finding
            refused.add(str(exc))
            reader.note(exc.code, line, str(exc), word, exc.hint)
        if len(reader.found) >= MAX_ERRORS:
            reader.note("E408", line, f"{len(reader.found)} findings so far: the rest is not examined")
            return Reading(reader.moves, reader.found, False, (), reader.declared())
    if not (reader.ended or reader.path_ended):
        reader.note("W401", max(1, len(lines)), "the file has no FINI or END")
    if not reader.moves and not reader.found:
        reader.note("W406", 1, "the program contains no motion")
    return Reading(reader.moves, reader.found, reader.ended or reader.path_ended, (), reader.declared())


_TURNED: Final = "places of two numbers: a cutter location file for turning is not read"


def unit_of_feeds(text: str) -> str:
    """What the feeds of a file without UNITS record are in: "inch", "mm", or "" where nothing says it."""
    inch, metric = (pattern.search(text.upper()) is not None for pattern in (_INCH, _METRIC))
    return "mm" if metric else "inch" if inch else ""


def _expect(plain: bool, form: str, more: str = "") -> None:
    if not plain:
        raise RecordError("E109", f"{form} is expected{more}")


class _Apt(AptMotions):
    """What every word of a cutter location file does."""

    def declared(self) -> Declared:
        """The unit: a record says it, or what feeds are in speaks for one."""
        unit = "inch" if self.unit != 1.0 else "mm"
        return Declared(unit if self.unit_known else "", inferred=self.unit_known == "feeds")

    unit_known = ""
    """What the unit rests on: "UNITS", "feeds", "job", or nothing."""

    def choose_unit(self, text: str) -> None:
        """The unit before UNITS: of the job, else that of the feeds, which is said."""
        if self.settings.units:
            self.unit, self.unit_known = 25.4 if self.settings.units == "inch" else 1.0, "job"
        elif not _SAID.search(text) and (spoken := unit_of_feeds(text)):
            self.unit, self.unit_known = 25.4 if spoken == "inch" else 1.0, "feeds"
            full = "inches" if spoken == "inch" else "mm"
            what = f"no UNITS record; feeds are in {full} per minute, so lengths are read as {full}"
            self.note("I213", 1, what)

    def record(self, record: Record) -> None:
        self.path_ended = record.word == "END-OF-PATH" or (
            self.path_ended and record.word in ("PAINT", "PPRINT")
        )
        name = record.word.lower().replace(" ", "_").replace("-", "_")
        handler = getattr(self, "_do_" + name, None)
        if handler is not None:
            handler(record)
        elif record.word in NO_MOTION | COMMENTS or record.word.startswith("CSI_"):
            return
        elif "_" in record.word:  # no word of the language has one: an event that a user gave his post
            self.once("I408", record.line, f"{record.word} is an event of the user's post: accepted")
        else:
            raise RecordError("E208", f"{record.word} is not supported", "post it as GOTO records")

    # ---- what motions use ----

    def _do_units(self, record: Record) -> None:
        if record.names in (["MM"], ["MILLIMETERS"], ["METRIC"]):
            self.unit = 1.0
        elif record.names in (["INCHES"], ["INCH"], ["IN"]):
            self.unit = 25.4
        else:
            raise RecordError("E109", "UNITS/MM or UNITS/INCHES is expected")
        self.unit_known = "UNITS"

    _do_unit = _do_units

    def _do_multax(self, record: Record) -> None:
        plain = record.names in ([], ["ON"], ["OFF"]) and not record.numbers
        _expect(plain, "MULTAX, MULTAX/ON or MULTAX/OFF")
        self.multax = record.names != ["OFF"]

    def _do_rapid(self, record: Record) -> None:
        if record.numbers or record.names:
            raise RecordError("E109", "RAPID takes nothing")
        self.rapid = True

    def _do_fedrat(self, record: Record) -> None:
        plain = len(record.numbers) == 1 and len(record.names) <= 1
        _expect(plain, "FEDRAT/number, or with one of MMPM, IPM, MMPR, IPR,")
        unit, turn = 0.0, False
        if record.names:
            if record.names[0] not in FEED_UNITS:
                raise RecordError("E109", f"feed unit {record.names[0]} is not known")
            unit, turn = FEED_UNITS[record.names[0]]
        if record.numbers[0] <= 0.0:
            raise RecordError("E301", f"the feed {record.numbers[0]:g} is not above zero")
        self.feed, self.per_turn, self.rapid = record.numbers[0] * (unit or self.unit), turn, False

    def _do_spindl(self, record: Record) -> None:
        names = set(record.names) - {"RPM", "NOMORE", "RANGE", "LOW", "MEDIUM", "HIGH", "AUTO"}
        numbers = record.numbers[: 1 if "RANGE" in record.names else None]
        if names & {"SFM", "SMM", "SURF", "MAXRPM"}:
            what = f"SPINDL/{record.text}: a surface speed; the speed is not known"
            self.once("I214", record.line, what, "SPINDL")
            return
        known = names <= {"CLW", "CCLW", "ON", "OFF", "ORIENT", "LOCK"}
        _expect(len(numbers) <= 1 and known, "SPINDL/number,CLW or SPINDL/OFF")
        if numbers:
            if numbers[0] < 0.0:
                raise RecordError("E312", f"the spindle speed {numbers[0]:g} is negative")
            self.speed = numbers[0]
        sign = -1.0 if "CCLW" in names else 1.0
        self.rpm = 0.0 if "OFF" in names else sign * self.speed

    def _do_loadtl(self, record: Record) -> None:
        if not record.numbers or record.numbers[0] < 0 or record.numbers[0] != int(record.numbers[0]):
            raise RecordError("E322", f"{record.word} needs a whole number from zero up")
        number, tools = int(record.numbers[0]), self.settings.tools
        if number > 0 and tools is not None and number not in tools:
            self.note("E321", record.line, NO_TOOL.format(number))
        self.tool = number

    _do_toolno = _do_loadtl

    def _do_load(self, record: Record) -> None:
        if record.names[:1] == ["TOOL"]:
            self._do_loadtl(record)
            if self.called:
                self.names[self.called] = self.tool
        elif record.names[:1] != ["HEAD"]:
            raise RecordError("E208", f"LOAD/{record.text} is not supported")

    def _do_tool_path(self, record: Record) -> None:
        """A new operation of an NX file; its tool has a name, and a number only if LOAD/TOOL follows."""
        self.native, self.cycle, self.axis, self.circle = True, None, UP, None
        self.called = name = record.text.partition(",TOOL,")[2].strip() or record.text
        number, tools = self.names.setdefault(name, len(self.names) + 1), self.settings.tools
        if tools is None or number in tools:
            self.tool = number

    def _do_tlaxis(self, record: Record) -> None:
        _expect(len(record.numbers) == 3, "TLAXIS/i,j,k")
        self.axis = self._unit(record, record.numbers)

    def _do_delay(self, record: Record) -> None:
        if len(record.numbers) != 1 or record.numbers[0] < 0.0:
            raise RecordError("E335", "DELAY/seconds is expected")
        self._emit(record.line, Motion.DWELL, self.tip, self.axis, None, dwell=record.numbers[0])

    def _do_end(self, record: Record) -> None:
        self.ended = True

    _do_fini = _do_end

    def _do_end_of_path(self, record: Record) -> None:
        self.cycle = self.circle = None
        self.rapid = False

    def _do_cutcom(self, record: Record) -> None:
        if "OFF" not in record.names:
            what = "CUTCOM: points are those of the tool's centre, its register (wear) is taken as zero"
            self.once("I214", record.line, what, "CUTCOM")

    # ---- coordinate systems ----

    def _do_msys(self, record: Record) -> None:
        n = record.numbers
        _expect(len(n) == 9 and not record.names, "MSYS/origin, x axis, y axis", ": nine numbers")
        self.local = True
        self._enter(record, (n[0], n[1], n[2]), (n[3], n[4], n[5]), (n[6], n[7], n[8]))

    def _do_csys(self, record: Record) -> None:
        n = record.numbers
        if len(n) != 12 or record.names:
            raise RecordError("E109", "CSYS needs the twelve numbers of a 3 x 4 matrix")
        self._enter(record, (n[3], n[7], n[11]), (n[0], n[4], n[8]), (n[1], n[5], n[9]))

    def _do_trntyp(self, record: Record) -> None:
        """WORLD: points are in one system whatever CSYS says; LOCAL: in that of CSYS."""
        if any(record.numbers) or not set(record.names) <= {"WORLD", "LOCAL"}:
            raise RecordError("E208", f"TRNTYP/{record.text} is not supported")
        self.local = record.names == ["LOCAL"]

    # ---- motions ----

    def _do_from(self, record: Record) -> None:
        self.tip, self.axis = self._target(record)

    def _do_gohome(self, record: Record) -> None:
        self.circle, self.rapid = None, False
        home = self._point(record.numbers) if len(record.numbers) >= 3 else self.settings.home
        self._emit(record.line, Motion.RAPID, home, self.axis, None)

    def _do_godlta(self, record: Record) -> None:
        steps = [0.0, 0.0, *record.numbers] if len(record.numbers) == 1 else record.numbers
        _expect(len(steps) == 3 and not record.names, "GODLTA/dx,dy,dz")
        if len(record.numbers) == 1:
            self._go(record, along(self.tip, self.axis, self.unit * steps[2]), self.axis)
            return
        step = self._vector((steps[0] * self.unit, steps[1] * self.unit, steps[2] * self.unit))
        self._go(record, add(self.tip, step), self.axis)

    def _do_goto(self, record: Record) -> None:
        tip, axis = self._target(record)
        if self.cycle is not None:
            self._hole(record, self.cycle, tip, axis)
        else:
            self._go(record, tip, axis)

    def _do_circle(self, record: Record) -> None:
        numbers = record.numbers
        _expect(len(numbers) >= 6, f"{record.word}/cx,cy,cz,i,j,k,r")
        if record.names and (record.word != "MOVARC" or record.names != ["ANGLE"] or len(numbers) != 8):
            raise RecordError("E109", f"{record.word} does not take {record.names[0]} like this")
        if record.names and not 0.0 < numbers[7] <= 360.0:
            raise RecordError("E309", f"an arc of {numbers[7]:g} degrees")
        axis = unit_axis((numbers[3], numbers[4], numbers[5]))[0]
        if axis == (0.0, 0.0, 0.0):
            raise RecordError("E363", "the axis of the circle has no length")
        radius = abs(numbers[6]) * self.unit if len(numbers) > 6 else None
        self.circle = Circle(self._point(numbers), self._vector(axis), radius)

    _do_movarc = _do_circle

    def _do_indirv(self, record: Record) -> None:
        _expect(len(record.numbers) == 3, "INDIRV/dx,dy,dz")
        x, y, z = record.numbers
        self.heading = self._vector((x, y, z))

    def _do_tlon(self, record: Record) -> None:
        """CATIA: an arc from the tool to where a line from its centre leads, in the plane across the tool."""
        heading, text = self.heading, _INTOF.sub("", record.text.upper())
        numbers = [float(value.replace("D", "E")) for value in _NUMBERS.findall(text)]
        if heading is None or not _ARC_TO_LINE.search(text) or len(numbers) != 10:
            raise RecordError("E208", "TLON,GOFWD that is not a circle up to a line is not supported")
        center, radius, end = self._point(numbers), numbers[3] * self.unit, self._point(numbers[7:])
        side = cross(subtract(self.tip, center), heading)
        axis = self.axis if dot(side, self.axis) > 0.0 else (-self.axis[0], -self.axis[1], -self.axis[2])
        self.circle, self.heading = Circle(center, axis, radius), None
        self._go(record, end, self.axis)

    def _target(self, record: Record) -> tuple[Point, Point]:
        numbers = record.numbers
        if len(numbers) == 2 and not record.names:
            raise RecordError("E109", _TURNED, "post it for a mill, with x, y and z")
        plain = len(numbers) in (3, 6) and not record.names
        _expect(plain, f"{record.word}/x,y,z or {record.word}/x,y,z,i,j,k")
        return self._point(numbers), self._unit(record, numbers[3:]) if len(numbers) == 6 else self.axis

    # ---- cycles ----

    def _do_cycle(self, record: Record) -> None:
        if record.names[:1] in (["OFF"], ["NOMORE"]):
            self.cycle = self.level = None
        elif record.names[:1] == ["ON"] and not record.numbers:
            if self.cycle is None:
                raise RecordError("E340", "CYCLE/ON, but no cycle is known")
        elif record.names[:1] != ["INIT"]:
            self.cycle = None
            self.cycle = cycle_of(record, self.unit, self.native)
            self.level = None
