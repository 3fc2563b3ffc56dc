"""Path blocks: F, R0 RL RR, M codes, and the motion itself."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from typing import Final

from vmachining.nc.execution import Block
from vmachining.nc.heidenhain.contour import AXES, Contour
from vmachining.nc.heidenhain.definitions import Definitions
from vmachining.nc.heidenhain.text import Word, blocks, spans, words
from vmachining.nc.model import PenError, misread, refused
from vmachining.nc.placing import EdgeFeed
from vmachining.nc.settings import Settings

NOTED_M: Final = spans("7-88 90 94-96 100-108 112 113 116-118 120 121 124 132-150")
"""No path: coolant, clamps, probes, look-ahead, feeds of corners, and what the builder of the machine gave M10 to M88."""
_EDGE_FEEDS: Final[dict[int, EdgeFeed]] = {109: "all", 110: "inner", 111: ""}
"""Which compensated arcs keep the feed of their contour."""
_CLAMPED: Final = re.compile(r"(\bM[ ]*138)(?:[ ]+[ABC](?![A-Z0-9.+-]))+")
_REMARK: Final = re.compile(r"[ ]*\([A-Z][^()=]*\)[ ]*$")
REFUSED_M: Final = {
    97: "M97 changes compensated corners", 98: "M98 ends compensated contours in another place",
    114: "M114 corrects for the machine's geometry", 143: "M143 removes a basic rotation", 93: "M93 is not supported",
    115: "M115 corrects for the machine's geometry", 130: "M130 leaves the tilted plane for one block",
    144: "M144 reckons with the kinematics of the machine", 197: "M197 rounds outer corners",
}  # fmt: skip

OWN: Final = {
    103: ("F",), 112: ("T", "A"), 118: tuple("XYZABCUVW"), 120: ("LA",), 124: ("T",), 128: ("F", "FMAX"), 132: ("P",),
    140: ("F", "FMAX", "FAUTO"),
}  # fmt: skip
"""Words after an M code that are its own: no axis, no feed of the block."""


class Control(Definitions):
    """The machine of a conversational program."""

    def __init__(
        self, lines: Sequence[str], settings: Settings, split: Callable[[Sequence[str]], list[Block]] = blocks
    ) -> None:
        super().__init__(lines, settings, split)
        self.contour = Contour(self)

    def _path(self, found: re.Match[str], rest: str) -> None:
        kind = found[3] or found[1]
        if (aside := _REMARK.search(rest)) is not None:
            what = "text in round brackets after a block is taken as a remark"
            self.pen.note("I408", what, aside[0].strip()[:20], once="aside")
            rest = rest[: aside.start()]
        rest = re.sub(r"^[ ]*(?=[\dQ.+-])", "R", rest) if kind in ("CHF", "RND") else rest.strip()
        given = self._read_words(rest)
        if kind == "CC":
            self.contour.set_pole(given)
            return
        if kind in ("RND", "CHF"):
            self._corner(kind, given)
            return
        after = self._modes(given, moves=True, defer=kind == "APPR")
        pen, contour, rapid = self.pen, self.contour, self.rapid
        machine = next((w for w in given if w.key == "M" and w.value in ("91", "92")), None)
        retract = next((w for w in given if w.key == "M" and w.value == "140"), None)
        if machine is not None:
            if kind != "L":
                raise PenError("E372", f"{machine.text} belongs to L", machine.text)
            target = {AXES[w.key]: self.q.number(w.value) * pen.scale for w in given if w.key in AXES}
            if any(w.incremental for w in given if w.key in AXES):
                raise PenError("E372", f"{machine.text} with incremental words", machine.text)
            pen.go_machine(target, rapid=rapid, word=machine.text)
            _, rotary = contour.target([w for w in given if w.key in "ABC"])
            if rotary:
                pen.go({}, rapid=rapid, rotary=rotary)
        elif kind == "L":
            place, rotary = contour.target(given)
            pen.go(place, rapid=rapid, rotary=rotary or None)
        elif kind == "LP":
            pen.go(dict(enumerate(contour.polar(given))), rapid=rapid)
        elif kind == "LN":
            contour.vector(given, rapid=rapid)
        elif kind == "APPR":
            contour.approach(found[2], given, self.comp)
        elif kind == "DEP":
            contour.depart(found[2], given)
            self.comp = 0
        elif rapid:
            raise PenError("E109", f"{kind} in rapid: circles take a feed", kind)
        elif kind == "C":
            contour.circle(given)
        elif kind == "CR":
            contour.circle_radius(given)
        elif kind == "CP":
            contour.circle_polar(given)
        else:
            contour.tangential(given, polar=kind == "CTP")
        if retract is not None:
            self._retract(given)
        after()

    def _read_words(self, text: str) -> list[Word]:
        """Words of a block, those of M codes under separate keys ("M140 F")."""
        found, left = words(_CLAMPED.sub(r"\1", text))
        if left:
            raise misread(left[:30])
        out, owner = [], 0
        for word in found:
            if word.key == "M":
                owner = int(self.q.number(word.value))
            elif word.key in OWN.get(owner, ()):
                word = word._replace(key=f"M{owner} {word.key}")
            out.append(word)
        return out

    def _corner(self, kind: str, given: list[Word]) -> None:
        size = next((self.q.number(w.value) for w in given if w.key == "R"), None)
        if size is None:
            raise PenError("E109", f"{kind} without a size", kind)
        held = self.pen.held  # without an F of its own the corner is cut as what stands before it
        before = held.feed_mm_min if held is not None else None
        k = self.pen.scale
        feed = next((self.q.number(w.value) * k for w in given if w.key == "F" and w.value), before)
        self.pen.set_corner("round" if kind == "RND" else "chamfer", size * k, feed)

    def _retract(self, given: list[Word]) -> None:
        """M140: along the tool axis by MB, or to the end of travel, which is home."""
        pen = self.pen
        how = next((w.value for w in given if w.key == "MB"), None)
        if how is None:
            raise PenError("E109", "M140 without MB", "M140")
        feed = next((self._feed(w) for w in given if w.key == "M140 F" and w.value), None)
        if how == "MAX":
            pen.go_machine({2: 0.0}, rapid=True, word="M140")
            return
        if pen.tcp and pen.vector is None and any(pen.rotary.values()):
            raise PenError("E208", "M140 MB while rotary axes are turned under M128: where the tool points only the "
                           "machine knows", "M140", "write M140 MB MAX, or M129 before")  # fmt: skip
        with pen.feeding(feed):
            pen.go(pen.ahead(self.q.number(how) * pen.scale), rapid=feed is None)

    def _modes(self, given: list[Word], *, moves: bool, defer: bool = False) -> Callable[[], None]:
        """F, R0 RL RR, M codes that act before the motion; returns what acts after it."""
        pen = self.pen
        self.rapid = False
        later: list[Callable[[], None]] = []
        # a radius that is missing takes no feed along
        for word in sorted(given, key=lambda word: word.key == "COMP"):
            key, value = word.key, word.value
            if key == "FMAX":
                self.rapid = True
            elif key == "F" and value:
                pen.feed, pen.feed_mode = self._feed(word), self.feed_kind
            elif key == "FAUTO":
                pen.feed, pen.feed_mode = self.tool_feed, "min"
            elif key in ("FU", "FZ"):
                feed = self._feed(word)
                pen.feed, pen.feed_mode = feed and feed * (pen.teeth() if key == "FZ" else 1), "rev"
            elif key == "FT":
                raise refused("FT, a feed by time,", word.text, "write F")
            elif key == "COMP" and value != "R":
                self.comp = {"R0": 0, "RL": 1, "RR": -1}[value]
                if moves and not defer:
                    pen.compensate(self.comp)
            elif key == "PAR":
                raise refused(f"{value}, compensation along one axis,", value)
            elif key == "M":
                self._m(int(self.q.number(value)), word, later, given)
            elif key in ("H", "E", "T", "S", "LA", "P") and not any(w.key == "M" for w in given):
                raise PenError("E207", f"{word.text} is not used here", word.text)
        if not moves:
            for act in later:
                act()
            if any(w.key == "M" and w.value == "140" for w in given):
                self._retract(given)
            later = []
        if moves and self.modal and not any(w.key == "M" and w.value in ("99", "89") for w in given):
            later.insert(0, self._run_cycle)

        def after() -> None:
            for act in later:
                act()

        return after

    feed_kind = "min"

    def _feed(self, word: Word) -> float | None:
        value = self.q.number(word.value)
        if value < 0.0:
            raise PenError("E301", f"the feed {value:g} is negative", word.text)
        return value * self.pen.scale or None

    def _m(self, code: int, word: Word, later: list[Callable[[], None]], given: list[Word]) -> None:
        pen = self.pen
        if code in (3, 4, 13, 14):
            sign = 1.0 if code in (3, 13) else -1.0
            pen.spindle(sign * self.speed)
        elif code == 5:
            later.append(lambda: pen.spindle(0.0))
        elif code in (0, 1, 6):
            later.append(pen.flush)
        elif code in (2, 30):
            later.append(self._stop)
        elif code == 99:
            self.modal = False
            later.append(self._run_cycle)
        elif code == 89:
            self.modal = True
            later.append(self._run_cycle)
        elif code in (91, 92, 140, 126, 127):
            if code in (126, 127):
                self.shortest = code == 126
        elif code in (128, 129):
            pen.set_tcp(code == 128)
        elif code in (109, 110, 111):
            pen.flush()
            pen.edge_feed = _EDGE_FEEDS[code]
        elif code in (136, 137):
            self.feed_kind = "rev" if code == 136 else "min"
            pen.feed, pen.feed_mode = None, self.feed_kind
        elif code in REFUSED_M:
            raise PenError("E208", REFUSED_M[code], word.text)
        elif code != 145:
            what = "" if code in NOTED_M else " (taken as a code of the machine builder)"
            if code == 103 and any(w.key == "M103 F" for w in given):
                pen.note("W372", "M103 lowers the feed of plunging moves: they keep the full feed here",
                         word.text, once="M103")  # fmt: skip
            pen.note("I408", f"M{code} does not change the path: accepted{what}", word.text, once=f"M{code}")

    def _stop(self) -> None:
        self.pen.flush()
        self.ended = True
