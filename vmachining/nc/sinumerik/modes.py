"""What a block of a Sinumerik program does: modes, words, cycles; frames are in `places.py`, motions in `blocks.py`."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

from vmachining.nc.execution import MILLS
from vmachining.nc.frames import PLANES
from vmachining.nc.model import PenError, misread, refused
from vmachining.nc.offset_curves import Pair
from vmachining.nc.settings import Settings
from vmachining.nc.sinumerik import cycles
from vmachining.nc.sinumerik import text as known
from vmachining.nc.sinumerik.cycles import BUILT, milled
from vmachining.nc.sinumerik.places import PASSES, Turning
from vmachining.nc.sinumerik.text import Word, arguments, words

_TRANSFORM: Final = re.compile(r"\b(A?(?:TRANS|ROT|SCALE|MIRROR))\b(?![ ]*[=(\[])[ ]*(.*)")

_LIMIT: Final = re.compile(r"LIMS(?:\[\w+\])?")
_OF_MACHINE: Final = re.compile(r"(?!\$)[A-Z_]*[A-Z_]{3}[A-Z0-9_]*")
_FEED_MODES: Final[dict[float, str]] = {
    93.0: "inverse", 94.0: "min", 95.0: "rev", 96.0: "rev", 97.0: "rev", 961.0: "min", 971.0: "min",
}  # fmt: skip
"""G961 and G971 leave the feed in mm/min; G962 and G973 change nothing about it."""
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


class Modes(Turning):
    """Everything of a block but its motion."""

    def __init__(self, lines: Sequence[str], settings: Settings) -> None:
        super().__init__(lines, settings)
        self.motion: float | None = None
        self.absolute = True
        self.side = 0
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

    def block(self, text: str) -> None:
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
            raise misread(rest[:40])
        name, self.modal = found[0].name, ("", "")
        if name in BUILT:
            raise PenError("E208", f"MCALL {name}: what its own position means at each point is not known", name,
                           "call it alone, with its position")  # fmt: skip
        number = re.fullmatch(r"CYCLE(\d+)", name)
        if _MILLS.fullmatch(name) or (number is not None and int(number[1]) not in cycles.CYCLES):
            raise _refused(name)
        self.modal = name, found[0].value
        if len(found) > 1:
            self._words(" ".join(w.text for w in found[1:]))

    def _words(self, text: str) -> None:
        found, left = words(text)
        if left:
            raise misread(left[:30])
        gs = [self.number(w.value, w.text) for w in found if w.kind == "word" and w.name == "G"]
        self._g_modes(gs)
        after = self._settings(found)
        own = next((self.number(w.value, w.text) for w in found if w.name == "FB" and w.kind == "set"), None)
        kept = self.pen.feed
        if own is not None:  # the feed of this block alone
            if own <= 0.0 or self.pen.feed_mode == "inverse":
                raise PenError("E301", "FB is a feed of G94 and G95 above zero", "FB")
            self.pen.feed = own * self.pen.scale
        try:
            self._move(gs, found)
        finally:
            self.pen.feed = kept
        for act in after:
            act()

    def _g_modes(self, gs: list[float]) -> None:
        pen = self.pen
        self.set_surface(gs)
        for code in gs:
            if code in (0.0, 1.0, 2.0, 3.0, 33.0, 331.0, 332.0):
                self.motion = code
            elif code in (17.0, 18.0, 19.0):
                plane = PLANES[int(code * 10)]
                if plane is not pen.plane:
                    if pen.compensation is not None:
                        what = "the plane cannot change while cutter compensation is on"
                        raise PenError("E356", what, f"G{code:g}")
                    pen.flush()
                    pen.plane = plane
            elif code in (70.0, 71.0, 700.0, 710.0):
                pen.scale = 25.4 if code in (70.0, 700.0) else 1.0
                self.feed_inch = pen.scale != 1.0
                if code == 70.0:
                    text = "G70 leaves feeds in the unit of the machine, which is assumed to be inch"
                    pen.note("W370", text, "G70", once="G70")
            elif code in (90.0, 91.0):
                self.absolute = code == 90.0
            elif code in _FEED_MODES:
                mode = _FEED_MODES[code]
                if mode != pen.feed_mode:
                    pen.feed, pen.feed_mode = None, mode
            elif code in (450.0, 451.0):
                pen.miter = code == 451.0
            elif code in (54.0, 55.0, 56.0, 57.0) or (505.0 <= code <= 599.0 and code == int(code)):
                self._work_offset(code)
            elif code == 500.0:
                self.work = 500.0
            elif code in known.GNOTED:
                pen.accept(f"G{code:g}", f"G{code:g}", f"G{code:g}")
            elif code == 291.0:
                raise self.lost(PenError("E208", "G291: from here on the program is in the language of Fanuc's controls", "G291",
                                         'give that part as a separate program: dialect = "fanuc"'))  # fmt: skip
            elif code not in known.KNOWN:
                hint = "settable offsets are G54 to G57 and G505 to G599" if 501.0 <= code <= 504.0 else ""
                raise refused(f"G{code:g}", f"G{code:g}", hint)

    def _settings(self, found: list[Word]) -> list[Callable[[], None]]:
        """F S T D M, variables, keywords; returns what acts after the motion."""
        pen = self.pen
        after: list[Callable[[], None]] = []
        codes = {self.number(w.value) for w in found if w.name == "G" and w.kind == "word"}
        dwells, placed = 4.0 in codes, any(w.name in (*known.AXES, *known.ROTARY, "G") for w in found)
        for place, word in enumerate(found):
            name, value = word.name, word.value
            if word.kind == "key":
                self._keyword(word)
            elif word.kind == "call":
                self._calls(word, after)
            elif (word.kind == "set" and self.assign(name, value)) or (
                (name in ("F", "S") or re.fullmatch(r"S\d", name)) and dwells
            ):
                continue
            elif name in ("F", "FZ") and word.kind in ("word", "set"):
                feed = self.number(value, word.text)
                if feed < 0.0:
                    raise PenError("E301", f"the feed {feed:g} is negative", word.text)
                if name == "FZ" and pen.feed_mode != "rev":
                    raise PenError("E301", "FZ is a feed per tooth of G95", word.text)
                feed *= pen.teeth() if name == "FZ" else 1
                pen.feed = (feed if pen.feed_mode == "inverse" else feed * pen.scale) or None
            elif name == "S" or (word.kind == "set" and re.fullmatch(r"S\d", name)):
                speed = self.number(value, word.text)
                if speed < 0.0:
                    raise PenError("E312", f"the spindle speed {speed:g} is negative", word.text)
                if self.constant:
                    self.surface = speed
                    if not any(_LIMIT.fullmatch(w.name) for w in found[place + 1 :]):  # which sees to it
                        self.at_radius(pen.at[0])
                    continue
                self.speed = speed
                if pen.rpm:
                    pen.spindle(math.copysign(speed, pen.rpm))
            elif name == "RNDM":
                self.rounding = self.number(value, word.text) * pen.scale
            elif name == "FRCM":
                self.corner_feed = self.number(value, word.text)
            elif _LIMIT.fullmatch(name):
                self.limit = self.number(value, word.text) or None
                self.at_radius(pen.at[0])
            elif name == "T" or (word.kind == "set" and re.fullmatch(r"T\d", name)):
                self.selected = self._tool(value)
                if self.direct:
                    text = "T changes the tool: the program has no M6"
                    pen.note("I213", text, word.text, once="direct")
                    pen.change_tool(self.selected)
            elif name == "D" and word.kind in ("word", "set"):
                if self.number(value, word.text) not in (0.0, 1.0):
                    what = "D: length and radius of the tool are those of the job"
                    pen.note("I408", what, word.text, once="D")
            elif name == "M" or (word.kind == "set" and re.fullmatch(r"M\d", name)):
                self._m(int(self.number(value, word.text)), word, after)
            elif name == "L" and word.kind == "word":
                times = next((self.number(w.value) for w in found if w.kind == "word" and w.name == "P"), 1.0)
                pen.flush()
                after.append(partial(self.call, word.text.replace(" ", ""), (), int(times)))
            elif self._is_known(word):
                if name in ("X1", "Y1", "Z1") and not codes & {74.0, 75.0}:
                    raise PenError("E207", f"{word.text[:30]} is not used here", word.text)
            elif (
                word.kind == "set"
                and name not in known.NOT_A_VARIABLE
                and _OF_MACHINE.fullmatch(name)
                and not placed
            ):
                what = f"{name} is not defined here: taken as a variable of the machine, which moves nothing"
                pen.note("I408", what, word.text, once=name)
                self.variables[name] = 0.0
                self.assign(name, value)
            else:  # with a place it would be an address
                raise PenError("E207", f"{word.text[:30]} is not used here", word.text)
        return after

    def _is_known(self, word: Word) -> bool:
        name = word.name
        if name in known.USED or (word.kind == "word" and name in "GMPHE"):
            if name in "HE":
                self.pen.accept(f"{name}", word.text, name)
            return True
        base = name.split("[", 1)[0]
        if base in known.FEED_SET:
            what = f"{base}= changes or limits feeds: the feeds here ignore it"
            self.pen.note("W376", what, word.text, once=base)
            return True
        if base in known.NOTED_SET:
            self.pen.accept(f"{base}=", word.text, base)
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
            pen.accept(f"M{code}", word.text, f"M{code}")

    def _stop(self) -> None:
        self.pen.flush()
        self.ended = True

    def _keyword(self, word: Word) -> None:
        pen, name = self.pen, word.name
        if name in ("SUPA", "CIP", "CT", "RNDM") or self.diameter_word(name):
            return
        if name == "TRAORI":
            self._tcp(True)
        elif name in ("TRAFOOF", "TRAOOF"):
            self.transmit(False)
            self._tcp(False)
        elif name == "TRANSMIT" and self.lathe:
            self.transmit(True)
        elif name in known.ORIENTED:
            self.great_circle = name == "ORIVECT" or (self.great_circle and name != "ORIAXES")
            self.by_axes = name in ("ORIAXES", "ORIMKS") or (self.by_axes and name != "ORIVECT")
            pen.note("I408", f"{name}: accepted", name, once=name)
        elif name == "CYCLE800":
            self._cycle800([])
        elif name in known.EDGE_FEEDS:
            pen.flush()
            pen.edge_feed = known.EDGE_FEEDS[name]
        elif name in known.NOTED or name in known.NOTED_CALLS:
            pen.accept(f"{name}", name, name)
        elif name in known.REFUSED:
            raise refused(f"{known.REFUSED[name]}: {name}", name)
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
        elif name == "TRANSMIT" and self.lathe:
            self.transmit(True)
        elif name in PASSES:
            self.left_out(name)
        elif name in BUILT:
            after.append(lambda: self._cycle(name, word.value))
        elif name in cycles.PATTERNS:
            after.append(lambda: self._pattern(name, given))
        elif number is not None and int(number[1]) in cycles.CYCLES:
            after.append(lambda: self._cycle(name, word.value))
        elif name in known.NOTED_CALLS or re.fullmatch(r"M\d+", name):
            if name == "WORKPIECE":
                self._workpiece(given)
            pen.accept(f"{name}", name, name)
        elif name in known.REFUSED or number is not None or _MILLS.fullmatch(name):
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
            round_ = {"center": [0.0, 0.0], "radius": abs(sizes[0]) / 2.0, "z": z} if sizes else None
            self.stock = None if round_ is None else {"cylinder": round_}
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
        if name in BUILT:
            milled(self.pen, name, [self._maybe(text) for text in arguments(value)])
            return
        if found is None:
            self.pen.flush()
            self.call(name, arguments(value))
            return
        cycles.drill(self.pen, int(found[1]), [self._maybe(text) for text in arguments(value)])

    def _move(self, gs: list[float], found: list[Word]) -> None:
        """The motion of a block."""
        raise NotImplementedError
