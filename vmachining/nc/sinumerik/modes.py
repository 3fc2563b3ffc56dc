"""What a block of a Sinumerik program does: modes, frames, motions, cycles.

Frames, from the machine inward: work offset, swivelled plane (CYCLE800), TRANS ROT SCALE MIRROR in the order they were
programmed. ROT of several angles turns about Z, then the new Y, then the new X: R = Rz Ry Rx. The tool leans with
CYCLE800; under TRAORI with turned axes it is taken to stand along Z of a frame that ROT tilted, and that is said (W369).
Source: SINUMERIK 840D sl/828D, Programming Manuals Fundamentals, Job Planning and Cycles (public).
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

from vmachining.nc.arcs import PLANES
from vmachining.nc.execution import MILLS, Decode
from vmachining.nc.frames import EYE, IDENTITY, UP, Frame, Rows, axis_turn, matmul
from vmachining.nc.model import Point
from vmachining.nc.offset_curves import Pair
from vmachining.nc.pen import PenError
from vmachining.nc.placing import EdgeFeed
from vmachining.nc.settings import Settings
from vmachining.nc.sinumerik import cycles
from vmachining.nc.sinumerik.control import Flow
from vmachining.nc.sinumerik.text import Word, arguments, words

__all__ = ["Modes"]

AXES: Final = {"X": 0, "Y": 1, "Z": 2}
ROTARY: Final = "ABC"
OF_JOB: Final = {54.0: 540, 55.0: 550, 56.0: 560, 57.0: 570, 505.0: 580, 506.0: 590}
"""Settable offsets that the job can give, as G54 to G59."""
_NOTED = """
    SOFT BRISK DRIVE FFWON FFWOF COMPCAD COMPON COMPCURV COMPSURF COMPOF KONT KONTC KONTT NORM
    STOPRE FNORM FLIN DIAMOF DIAM90 CUT2D CUT2DF CUT3DC FIFOCTRL STARTFIFO STOPFIFO PREPRO BLSYNC DYNNORM DYNPOS
    DYNROUGH DYNSEMIFIN DYNFINISH SUPD SBLOF SBLON ASPLINEOF DISPLOF DISPLON ADISPOSA CPRECON CPRECOF PTP CP UPATH
    SPATH WALIMON WALIMOF BRISKA SOFTA SAVE ACTBLOCNO DELAYFSTON DELAYFSTOF ORISON ORISOF ORICONTO PAROTOF TOROTOF
    TOFRAMEOF PRECON LEADOF RTLION RTLIOF EXTERNAL
"""
NOTED: Final = frozenset(_NOTED.split())
_NOTED_CALLS = """
    MSG WORKPIECE CYCLE832 SETMS SETAL GROUP_BEGIN GROUP_END GROUP_ADDEND TRAORI TRAFOOF CLEARM WAITM INIT START
    DELT CYCLE_HSC STOPRE GETT SPOS FXS CTRANS PRIO WAITP M
"""
NOTED_CALLS: Final = frozenset(_NOTED_CALLS.split())
NOTED_SET: Final = frozenset({"SPOS", "SPOSA", "ACC", "ADIS", "ADISPOS",
                              "FGREF", "DISC", "SF", "OTOL", "CTOL", "ORISON", "STOLF", "ATOL",
                              "SCC", "LIMS", "G", "H"})  # fmt: skip
EDGE_FEEDS: Final[dict[str, EdgeFeed]] = {"CFC": "all", "CFIN": "inner", "CFTCP": ""}
"""Feed on arcs under compensation: of the contour (as the control starts), of inner arcs only, of the tool centre."""
FEED_SET: Final = frozenset({"FL", "FA", "OVR", "OVRA", "VELOLIM"})
REFUSED: Final = {
    "ASPLINE": "splines",
    "BSPLINE": "splines",
    "CSPLINE": "splines",
    "POLY": "polynomials",
    "TRANSMIT": "TRANSMIT",
    "TRACYL": "TRACYL",
    "INVCW": "involutes",
    "INVCCW": "involutes",
    "ROTS": "ROTS",
    "AROTS": "AROTS",
    "CRPL": "CRPL",
    "TOFRAME": "TOFRAME",
    "TOROT": "TOROT",
    "TOROTX": "TOROTX",
    "TOROTY": "TOROTY",
    "PAROT": "PAROT",
    "CUT3DF": "compensation in space",
    "CUT3DFS": "compensation in space",
    "MEAS": "probing",
    "MEAW": "probing",
    "OEMIPO1": "OEM interpolation",
    "TRAANG": "TRAANG",
    "GEOAX": "GEOAX",
    "WRITE": "files",
    "CONTPRON": "contour tables",
    "CYCLE72": "CYCLE72",
    "DIAMON": "diameters (a lathe)",
    "ORICURVE": "ORICURVE",
    "ORIPLANE": "ORIPLANE",
}
GNOTED: Final = frozenset({9.0, 25.0, 26.0, 60.0, 62.0, 64.0, 290.0, 450.0, 460.0, 461.0, 462.0, 601.0, 602.0, 603.0,
                           621.0, 641.0, 642.0, 643.0, 644.0, 645.0, 810.0, 961.0, 971.0})  # fmt: skip
KNOWN: Final = frozenset(map(float, (
    *range(5), 17, 18, 19, 40, 41, 42, 53, 54, 55, 56, 57, 70, 71, 74, 75, 90, 91, 93, 94, 95, 97, 110, 111, 112, 153, 331, 332,
    451, 700, 710,
)))  # fmt: skip
USED: Final = frozenset({
    *AXES, *ROTARY, "I", "J", "K", "I1", "J1", "K1", "X1", "Y1", "Z1", "CR", "AR", "TURN", "CHF", "CHR", "RND", "RNDM", "FP",
    "FRC", "FRCM", "A3", "B3", "C3", "AP", "RP", "ANG", "F", "S", "T", "D",
})  # fmt: skip
_TRANSFORM: Final = re.compile(r"\b(A?(?:TRANS|ROT|SCALE|MIRROR))\b(?![ ]*[=(\[])[ ]*(.*)")


_QUOTED: Final = re.compile(r'"[^"]*"')
_CHANGES: Final = re.compile(
    r"(?<![A-Z0-9_])M[ ]*=?[ ]*0*6(?![0-9.])|(?<![A-Z])L[ ]*0*6(?![0-9])|TOOL|CHANGE", re.IGNORECASE
)
"""A tool change, by M6 or by a subprogram that may hold it."""

_MILLS: Final = re.compile(r"POCKET\d|SLOT\d|LONGHOLE|CYCLE(?:6[0-4]|7[0-9]|899)")
"""Cycles for pockets, slots, faces, studs, threads and contours."""


def _refused(name: str) -> PenError:
    what = MILLS if _MILLS.fullmatch(name) else f"{name} is not supported"
    return PenError("E208", what, name, "post the motions of the cycle as blocks")


class Modes(Flow):
    """Everything of a block but its motion."""

    def __init__(self, lines: Sequence[str], settings: Settings, decode: Decode | None) -> None:
        super().__init__(lines, settings, decode)
        self.motion: float | None = None
        self.absolute = True
        self.speed = 0.0
        self.side = 0
        self.work: float | None = None
        self.home_zero: Point | None = None
        """Of the first offset, where the program itself gives the offsets: the zero of the job."""
        self.basic_moved = False
        """Motions under G500, which knows no offset."""
        self.first_work: float | None = None
        self.offset = self.swivel = self.program = IDENTITY
        self.modal: tuple[str, str] | None = None
        self.feed_inch: bool | None = None
        self.pen.scale = 25.4 if settings.units == "inch" else 1.0
        self.pen.edge_feed = "all"
        self.direct = not any(_CHANGES.search(_QUOTED.sub("", line).split(";", 1)[0]) for line in lines)
        """Whether T changes the tool: no block holds M6."""
        self.pole: Pair = (0.0, 0.0)
        self.selected: int | None = None
        self.rounding = self.corner_feed = 0.0
        self.great_circle = self.by_axes = False
        self.vector = [0.0, 0.0, 1.0]

    def _place(self) -> None:
        """The frames in force, and the tool axis in them."""
        pen = self.pen
        frame = self.offset.then(self.swivel).then(self.program)
        lean = self.swivel.axis
        if pen.tcp and frame.axis != UP and lean == UP and any(pen.rotary.values()):
            lean = frame.axis
            text = "the tool is taken to stand along Z of the turned frame: whether the axes bring it there is not looked at"
            pen.note("W369", text, once="frame")
        if pen.compensation is not None and frame != pen.frame:
            raise PenError("E359", "the coordinate system cannot change under cutter compensation")
        pen.set_frame(frame, lean=None if lean == frame.axis else lean)

    def _transform(self, name: str, rest: str) -> None:
        additive, kind = name.startswith("A"), name.removeprefix("A")
        given: dict[int, float] = {}
        pen = self.pen
        found, left = words(rest)
        if left:
            raise PenError("E109", f"'{left[:30]}' is not understood", left[:30])
        spin = None
        for word in found:
            if word.name in AXES and word.kind in ("word", "set"):
                given[AXES[word.name]] = self.number(word.value, word.text)
            elif word.name == "RPL":
                spin = self.number(word.value, word.text)
            elif word.name in ROTARY and kind == "TRANS" and self.number(word.value, word.text) == 0.0:
                continue
            else:
                raise PenError("E208", f"{name} of {word.text[:20]} is not supported", word.text)
        if kind == "TRANS":
            k = pen.scale
            step = Frame(origin=(given.get(0, 0.0) * k, given.get(1, 0.0) * k, given.get(2, 0.0) * k))
        elif kind == "ROT":
            rows: Rows = EYE
            if spin is not None:
                rows = axis_turn(pen.plane.normal, spin)
            for axis in (2, 1, 0):
                if given.get(axis):
                    rows = matmul(rows, axis_turn(axis, given[axis]))
            step = Frame(rows)
        elif kind == "SCALE":
            factors = [given.get(axis, 1.0) for axis in range(3)]
            if any(not 1e-6 <= f <= 1e6 for f in factors):
                raise PenError("E109", "SCALE needs factors above zero", rest[:20])
            step = IDENTITY.scaled(*factors)
        else:
            step = IDENTITY.scaled(*(-1.0 if axis in given else 1.0 for axis in range(3)))
        kept = self.program
        self.program = self.program.then(step) if additive else step
        try:
            self._place()
        except PenError:
            self.program = kept
            raise

    def zero_changed(self) -> None:
        """A settable offset has another value from its next G54 on."""
        if self.first_work is not None and self.home_zero is None:
            raise PenError("E208", "$P_UIFR sets an offset after use of an offset whose position is not given", "$P_UIFR",
                           "set it before the first G54")  # fmt: skip
        self.work = None

    def _work_offset(self, code: float) -> None:
        pen = self.pen
        if code == self.work:
            return
        if self.basic_moved:
            raise PenError(
                "E368",
                f"G{code:g} after motions under G500: the distance between them is not given",
                f"G{code:g}",
            )
        index = {54.0: 1, 55.0: 2, 56.0: 3, 57.0: 4}.get(code, int(code) - 500)
        own = self.zeros.get(index)
        if own is not None and (self.first_work is None or self.home_zero is not None):
            here = own.get("X", 0.0), own.get("Y", 0.0), own.get("Z", 0.0)
            home = self.home_zero = self.home_zero or here
            self.work, self.first_work = code, self.first_work or code
            self.offset = IDENTITY.shifted((here[0] - home[0], here[1] - home[1], here[2] - home[2]))
            pen.flush()
            self._place()
            return
        known = self.settings.work_offsets
        first = self.first_work if self.first_work is not None else code
        there, base = known.get(OF_JOB.get(code, -1)), known.get(OF_JOB.get(first, -1))
        self.offset = IDENTITY
        if code != first and there is not None and base is not None:
            self.offset = Frame(origin=(there[0] - base[0], there[1] - base[1], there[2] - base[2]))
        elif code != first:
            pen.note("W368", "a second work offset: its distance from the first is not given; both are assumed to be the same",
                     f"G{code:g}", once=f"{code:g}")  # fmt: skip
        self.work, self.first_work = code, first
        pen.flush()
        self._place()

    def _cycle800(self, given: list[str]) -> None:
        v = [self._maybe(text) for text in given] + [None] * 16
        if not given:
            self.swivel = self.program = IDENTITY
            self._place()
            return
        mode, additive = int(v[3] or 0.0), int(v[2] or 0.0) % 10 == 1
        numbers = [0.0 if x is None else x for x in v[4:13]]
        k = self.pen.scale
        if mode // 64 == 3 and any(numbers[3:6]):
            raise PenError(
                "E208",
                "CYCLE800 by the angles of the machine's axes is not supported",
                "CYCLE800",
                "post it axis by axis",
            )
        if mode // 64 == 2:
            raise PenError(
                "E208", f"CYCLE800 with mode {mode} is not supported", "CYCLE800", "post it axis by axis"
            )
        rows: Rows = EYE
        if mode // 64 == 3:
            pass  # all angles are zero
        elif mode // 64 == 0:
            for place in range(3):
                axis = (mode >> 2 * place & 3) - 1
                if numbers[3 + place]:
                    if axis < 0:
                        raise PenError(
                            "E109", f"CYCLE800: mode {mode} names no axis for an angle", "CYCLE800"
                        )
                    rows = matmul(rows, axis_turn(axis, numbers[3 + place]))
        else:  # solid angle: turned about Z by the first, tilted about the new Y by the second
            rows = matmul(axis_turn(2, numbers[3]), axis_turn(1, numbers[4]))
        step = IDENTITY.shifted((numbers[0] * k, numbers[1] * k, numbers[2] * k)).turned(rows)
        step = step.shifted((numbers[6] * k, numbers[7] * k, numbers[8] * k))
        kept = self.swivel, self.program
        self.swivel = self.swivel.then(self.program).then(step) if additive else step
        self.program = IDENTITY
        if step.matrix == EYE and not additive:
            self.pen.rotary = dict.fromkeys(self.pen.rotary, 0.0)
        try:
            self._place()
        except PenError:
            self.swivel, self.program = kept
            raise

    def _maybe(self, text: str) -> float | None:
        return None if not text or text.startswith('"') else self.number(text)

    def block(self, text: str) -> None:
        """Everything but steering."""
        if text.startswith("MCALL"):
            self._mcall(text[5:].strip())
            return
        found = _TRANSFORM.search(text)
        if found is not None:
            front = text[: found.start()].strip()
            if front:
                self._words(front)
            self._transform(found[1], found[2])
            return
        self._words(text)

    def _mcall(self, rest: str) -> None:
        if not rest:
            self.modal = None
            return
        found, left = words(rest)
        if left or not found or found[0].kind not in ("call", "key"):
            raise PenError("E109", f"'{rest[:40]}' is not understood", rest[:40])
        self.modal = (found[0].name, found[0].value)
        self._check_cycle(found[0].name)
        self._words(" ".join(w.text for w in found[1:])) if len(found) > 1 else None

    def _check_cycle(self, name: str) -> None:
        number = re.fullmatch(r"CYCLE(\d+)", name)
        if _MILLS.fullmatch(name) or (number is not None and int(number[1]) not in cycles.CYCLES):
            self.modal = ("", "")
            raise _refused(name)

    def _words(self, text: str) -> None:
        found, left = words(text)
        if left:
            raise PenError("E109", f"'{left[:30]}' is not understood", left[:30])
        gs = [self.number(w.value, w.text) for w in found if w.kind == "word" and w.name == "G"]
        self._g_modes(gs, found)
        after = self._settings(found)
        self._move(gs, found)
        for act in after:
            act()

    def _g_modes(self, gs: list[float], found: list[Word]) -> None:
        pen = self.pen
        for code in gs:
            if code in (0.0, 1.0, 2.0, 3.0, 331.0, 332.0):
                self.motion = code
            elif code in (17.0, 18.0, 19.0):
                plane = PLANES[int(code * 10)]
                if plane is not pen.plane:
                    if pen.compensation is not None:
                        raise PenError(
                            "E356", "the plane cannot change while cutter compensation is on", f"G{code:g}"
                        )
                    pen.flush()
                    pen.plane = plane
            elif code in (70.0, 71.0, 700.0, 710.0):
                pen.scale = 25.4 if code in (70.0, 700.0) else 1.0
                self.feed_inch = pen.scale != 1.0
                if code == 70.0:
                    text = "G70 leaves feeds in the unit of the machine, which is taken to be inch"
                    pen.note("W370", text, "G70", once="G70")
            elif code in (90.0, 91.0):
                self.absolute = code == 90.0
            elif code in (93.0, 94.0, 95.0, 97.0):
                mode = {93.0: "inverse", 94.0: "min"}.get(code, "rev")
                if mode != pen.feed_mode:
                    pen.feed, pen.feed_mode = None, mode
            elif code in (450.0, 451.0):
                pen.miter = code == 451.0
            elif code in (54.0, 55.0, 56.0, 57.0) or (505.0 <= code <= 599.0 and code == int(code)):
                self._work_offset(code)
            elif code == 500.0:
                self.work = 500.0
            elif code in GNOTED:
                pen.note(
                    "I408", f"G{code:g} does not change the path: accepted", f"G{code:g}", once=f"G{code:g}"
                )
            elif code == 291.0:
                raise self.lost(PenError("E208", "G291: from here on the program is in the language of Fanuc's controls", "G291",
                                         'give that part as a separate program: dialect = "fanuc"'))  # fmt: skip
            elif code not in KNOWN:
                hint = "settable offsets are G54 to G57 and G505 to G599" if 501.0 <= code <= 504.0 else ""
                raise PenError("E208", f"G{code:g} is not supported", f"G{code:g}", hint)

    def _settings(self, found: list[Word]) -> list[Callable[[], None]]:
        """F S T D M, variables, keywords; returns what acts after the motion."""
        pen = self.pen
        after: list[Callable[[], None]] = []
        for word in found:
            name, value = word.name, word.value
            if word.kind == "key":
                self._keyword(word)
            elif word.kind == "call":
                self._calls(word, after)
            elif word.kind == "set" and self.assign(name, value):
                continue
            elif name == "F" and word.kind in ("word", "set"):
                if any(w.kind == "word" and w.name == "G" and self.number(w.value) == 4.0 for w in found):
                    continue
                feed = self.number(value, word.text)
                if feed < 0.0:
                    raise PenError("E301", f"the feed {feed:g} is negative", word.text)
                pen.feed = (feed if pen.feed_mode == "inverse" else feed * pen.scale) or None
            elif name == "S" or (word.kind == "set" and re.fullmatch(r"S\d", name)):
                if any(w.kind == "word" and w.name == "G" and self.number(w.value) == 4.0 for w in found):
                    continue
                speed = self.number(value, word.text)
                if speed < 0.0:
                    raise PenError("E312", f"the spindle speed {speed:g} is negative", word.text)
                self.speed = speed
                if pen.rpm:
                    pen.spindle(math.copysign(speed, pen.rpm))
            elif name == "RNDM":
                self.rounding = self.number(value, word.text) * pen.scale
            elif name == "FRCM":
                self.corner_feed = self.number(value, word.text)
            elif name == "T":
                self.selected = self._tool(value)
                if self.direct:
                    text = "T changes the tool: the program has no M6"
                    pen.note("I213", text, word.text, once="direct")
                    pen.change_tool(self.selected)
            elif name == "D" and word.kind in ("word", "set"):
                if self.number(value, word.text) not in (0.0, 1.0):
                    pen.note(
                        "I408", "D: length and radius of the tool are those of the job", word.text, once="D"
                    )
            elif name == "M" or (word.kind == "set" and re.fullmatch(r"M\d", name)):
                self._m(int(self.number(value, word.text)), word, after)
            elif name == "L" and word.kind == "word":
                times = next((self.number(w.value) for w in found if w.kind == "word" and w.name == "P"), 1.0)
                pen.flush()
                after.append(partial(self.call, word.text.replace(" ", ""), (), int(times)))
            elif not self._is_known(word):
                raise PenError("E207", f"{word.text[:30]} is not used here", word.text)
        return after

    def _is_known(self, word: Word) -> bool:
        name = word.name
        if name in USED or (word.kind == "word" and name in "GMPHE"):
            if name in "HE":
                self.pen.note("I408", f"{name} does not change the path: accepted", word.text, once=name)
            return True
        base = name.split("[", 1)[0]
        if base in FEED_SET:
            self.pen.note(
                "W376", f"{base}= changes or limits feeds: the feeds here ignore it", word.text, once=base
            )
            return True
        if base in NOTED_SET:
            self.pen.note("I408", f"{base}= does not change the path: accepted", word.text, once=base)
            return True
        return False

    def _tool(self, value: str) -> int:
        if not value.startswith('"'):
            number = self.number(value)
            if number < 0.0:
                raise PenError("E322", f"tool {number:g}", "T")
            return int(number)
        return self.tool_of_name(value.strip('"').strip().upper(), value)

    def _m(self, code: int, word: Word, after: list[Callable[[], None]]) -> None:
        pen = self.pen
        if code in (3, 4):
            pen.spindle(self.speed if code == 3 else -self.speed)
        elif code == 5:
            after.append(lambda: pen.spindle(0.0))
        elif code == 6:
            if self.selected is None:
                raise PenError("E323", "M6, but no tool was selected", word.text)
            pen.change_tool(self.selected)
            pen.spindle(0.0)
        elif code in (2, 30):
            after.append(self._stop)
        elif code == 17:
            after.append(lambda: self._on_m17("", ""))
        elif code in (0, 1):
            after.append(pen.flush)
        else:
            pen.note("I408", f"M{code} does not change the path: accepted", word.text, once=f"M{code}")

    def _stop(self) -> None:
        self.pen.flush()
        self.ended = True

    def _keyword(self, word: Word) -> None:
        pen, name = self.pen, word.name
        if name in ("SUPA", "CIP", "CT", "RNDM"):
            return
        if name == "TRAORI":
            self._tcp(True)
        elif name in ("TRAFOOF", "TRAOOF"):
            self._tcp(False)
        elif name in (
            "ORIWKS",
            "ORIAXES",
            "ORIVECT",
            "ORIROTA",
            "ORIEULER",
            "ORIRPY",
            "ORIRPY2",
            "ORIVIRT1",
            "ORIMKS",
        ):
            self.great_circle = name == "ORIVECT" or (self.great_circle and name != "ORIAXES")
            self.by_axes = name in ("ORIAXES", "ORIMKS") or (self.by_axes and name != "ORIVECT")
            pen.note("I408", f"{name}: accepted", name, once=name)
        elif name == "CYCLE800":
            self._cycle800([])
        elif name in EDGE_FEEDS:
            pen.flush()
            pen.edge_feed = EDGE_FEEDS[name]
        elif name in NOTED or name in NOTED_CALLS:
            pen.note("I408", f"{name} does not change the path: accepted", name, once=name)
        elif name in REFUSED:
            raise PenError("E208", f"{REFUSED[name]}: {name} is not supported", name)
        elif name in cycles.PATTERNS or re.fullmatch(r"CYCLE\d+|POCKET\d|SLOT\d|LONGHOLE", name):
            raise PenError("E208", f"{name} without its values", name)
        else:
            pen.flush()
            self.call(name)

    def _tcp(self, on: bool) -> None:
        self.pen.set_tcp(on)
        if not on:
            self.pen.vector = None
        self._place()

    def _calls(self, word: Word, after: list[Callable[[], None]]) -> None:
        pen, name = self.pen, word.name
        given = arguments(word.value)
        number = re.fullmatch(r"CYCLE(\d+)", name)
        if name == "CYCLE800":
            self._cycle800(given)
        elif name == "TRAORI":
            self._tcp(True)
        elif name in cycles.PATTERNS:
            after.append(lambda: self._pattern(name, given))
        elif number is not None and int(number[1]) in cycles.CYCLES:
            after.append(lambda: self._cycle(name, word.value))
        elif name in NOTED_CALLS or re.fullmatch(r"M\d+", name):
            if name == "WORKPIECE":
                self._workpiece(given)
            pen.note("I408", f"{name} does not change the path: accepted", name, once=name)
        elif name in REFUSED or number is not None or _MILLS.fullmatch(name):
            raise _refused(name)
        else:
            pen.flush()
            after.append(lambda: self.call(name, given))

    def _workpiece(self, given: list[str]) -> None:
        """WORKPIECE(,,,"BOX",mode,Z0,Z1,ZB,X0,Y0,X1,Y1), "CYLINDER" with a diameter: bits of the mode say what is absolute."""
        v = [self._maybe(text) for text in given]
        if given[3:4] not in (['"BOX"'], ['"CYLINDER"']) or None in v[4:7] or len(v) < 9:
            return
        mode, top, end, *_ = (0.0 if x is None else x for x in v[4:])
        bits = int(mode)
        z = sorted((top, end if bits & 64 else top + end))
        sizes = [x * self.pen.scale for x in v[8:12] if x is not None]
        z = [level * self.pen.scale for level in z]
        if given[3] == '"CYLINDER"':
            self.stock = (
                {"cylinder": {"center": [0.0, 0.0], "radius": abs(sizes[0]) / 2.0, "z": z}} if sizes else None
            )
        elif len(sizes) == 4:
            x0, y0, x1, y1 = sizes
            x = sorted((x0, x1 if bits & 16 else x0 + x1))
            y = sorted((y0, y1 if bits & 32 else y0 + y1))
            self.stock = {"box": {"min": [x[0], y[0], z[0]], "max": [x[1], y[1], z[1]]}}

    stock: dict[str, dict[str, Any]] | None = None
    """Of WORKPIECE, as under [stock] of a job, mm."""

    def _pattern(self, name: str, given: list[str]) -> None:
        pen = self.pen
        spots = cycles.points(name, [self._maybe(text) for text in given])
        a, b = pen.plane.first, pen.plane.second
        for x, y in spots:
            pen.go({a: x * pen.scale, b: y * pen.scale}, rapid=True)
            self._modal()

    def _modal(self) -> None:
        if self.modal is not None and self.modal[0]:
            self._cycle(*self.modal)

    def _cycle(self, name: str, value: str) -> None:
        found = re.fullmatch(r"CYCLE(\d+)", name)
        if found is None:
            self.pen.flush()
            self.call(name, arguments(value))
            return
        cycles.drill(self.pen, int(found[1]), [self._maybe(text) for text in arguments(value)])

    def _move(self, gs: list[float], found: list[Word]) -> None:
        """The motion of a block."""
        raise NotImplementedError
