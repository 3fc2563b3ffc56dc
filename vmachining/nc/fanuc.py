"""Dialect `fanuc` and its kin (`haas`, `mazak`, `okuma`): what differs from the core, as data and a few functions.

Lines are made plain first (`fanuc_lines.py`), then the words of a block are brought into the form that the core executes
(`Translator`): what changes no path is taken out and said once (I214), what changes it is honoured or left for the core
to refuse. Sources: operator manuals of the Fanuc series 0i/30i, and of Haas, Mazak and Okuma mills.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from vmachining.nc import fanuc_okuma as okuma
from vmachining.nc.block import CYCLES, Block, Problem
from vmachining.nc.fanuc_cycles import BORING, CYCLE_WORDS, dwell, expand, haas_code, holes, taps
from vmachining.nc.fanuc_line import Line, Registers, Words
from vmachining.nc.fanuc_places import TAKEN, Places, polar
from vmachining.nc.frames import UP, unit
from vmachining.nc.lexer import Word
from vmachining.nc.model import add, put
from vmachining.nc.settings import Settings
from vmachining.nc.state import ORIGIN, State

LOOK_AHEAD: Final = "look-ahead, smoothing or accuracy"
NOTED: Final[dict[int, tuple[str, str]]] = {
    **dict.fromkeys((50, 51, 54, 80, 611, 640, 1300, 1310), (LOOK_AHEAD, "PQRLFJEK")),
    90: ("exact stop", ""), 610: ("exact stop mode", ""), 620: ("corner override", "PQ"), 630: ("tapping mode", ""),
    1130: ("polar interpolation off", ""), 131: ("polar interpolation off", ""), 110: ("end of data input", ""),
    150: ("polar coordinates off", ""), 502: ("polygon turning off", ""), 401: ("normal direction control off", ""),
    220: ("stored stroke limits", "XYZIJK"), 230: ("stored stroke limits off", ""), 270: ("reference check", "XYZ"),
    53: (LOOK_AHEAD, "PQ"),
    1030: (LOOK_AHEAD, "P"), 3320: (LOOK_AHEAD, "R"),
    250: ("spindle speed detection", "PQR"), 260: ("spindle speed detection", "PQR"), 670: ("modal macro off", ""),
    970: ("spindle in rev/min", ""), 1600: ("load control", "PQR"), 1870: ("accuracy of the contour", "PE"),
    2550: ("dynamic work offset off", ""),
    **dict.fromkeys((19000, 19010, 19020, 19030), ("the stock, for a drawing on the screen", "ABCDEFHIJKLPQRSTUVWXYZ")),
    2540: ("dynamic work offset: the zero of the part turns with the rotary axes, as here", ""),
}  # fmt: skip
"""G codes (ten times their number) that change no path: what they do, and the letters that belong to them."""

ENDS: Final = {690: "turn tilt", 691: "tilt", 500: "scale", 501: "mirror"}
MOVES: Final = frozenset({0, 10, 20, 30})
CLAIMS: Final = frozenset({40, 100, 280, 290, 300, 431, 510, 511, 520, 530, 680, 682, 920})
CYCLIC: Final = frozenset(CYCLE_WORDS)
CLAIMING: Final = MOVES | CLAIMS | CYCLIC
MODAL: Final = MOVES | CYCLIC | {800}
"""What takes the axis words; what takes the place of a motion code."""
SWITCHES: Final = frozenset({3, 4, 5, 6, 0, 1, 2, 30, 7, 8, 9, 97, 98, 99})
"""M codes that the core executes, and M97."""

ALSO: Final = (("M", 6.0), ("G", 0.0), ("G", 90.0), ("G", 91.0))
LEAST: Final = {"IS-A": 1e-2, "IS-B": 1e-3, "IS-C": 1e-4}


class Translator(Registers):
    """What a control of the family remembers beside the state of the core."""

    def __init__(self, settings: Settings, note: Callable[[Problem], None]) -> None:
        super().__init__(settings, note)
        self.group1 = 0
        self.cycle: dict[str, float] = {}
        self.polar: tuple[float, float] | None = None
        self.places = Places()
        self.skipping = self.vectors = False
        self.dead: Problem | None = None
        self.quill = self.depth = 0.0
        self.level: float | None = None
        self.changer = self.k_sizes = self.orients = False
        self.alias: dict[int, int] = {}
        """Work offsets of Okuma that are others, turned with the rotary axes."""
        self.changes_by = 0
        """M code that changes tools in a program without M6."""
        self.at = 0
        """Line in work, 0-based."""
        self.repeated: tuple[Word, int] | None = None
        self.least = LEAST.get(settings.control.increments, 0.0)

    @property
    def quick(self) -> bool:
        """Whether plain blocks mean what they mean to the core."""
        bent = self.skipping or self.vectors or self.least or self.settings.control.w or self.places.given
        return self.polar is None and self.dead is None and not bent

    # ---- one block ----

    def translate(self, block: Words, state: State) -> Line:
        if state.motion in MOVES:
            self.group1 = state.motion or 0
            self.cycle.clear()
        block, pitch = taps(block, state, self.variant)
        out = Line([(w, self._counted(w, v, state)) for w, v in block] if self.least else block, state)
        codes, axes = out.codes, out.axes
        self.orients = out.switches(19.0)  # the spindle stops at an angle, R
        if state.tap != pitch and codes & MODAL:
            out.become(out.before, tap=pitch)
        if self.skipping or (100 in codes and out.get("L") in (50.0, 51.0, 52.0)):
            if not self.skipping:
                self.say("G10 L50", block[0][0], "G10 L50: parameters of the control are not set here")
            self.skipping = 110 not in codes
            return out
        if self.dead is not None:
            if not codes & MODAL:
                out.problems = [self.dead] if axes else []
                return out
            self.dead = None
        if self.places.given and axes and 682 not in codes:
            self.places.given = {}
            out.refuse(block[0][0], "G68.2: points or directions of its plane are missing before this motion")
            return out
        for word, value in out.written:
            if word.letter == "G":
                self._g(word, round(value * 10.0), out)
            elif word.letter == "M":
                self._m(word, value, out)
            elif word.letter != "N" or not out.pairs:
                out.keep(word, value)
        if self.repeated is not None:
            out.drop("IJKLDQ" if self.repeated[1] in (120, 130) else "IJKL")
        self._no_motion(out)
        holes(self, out, bool(out.now() & (MOVES | CLAIMS | {331})))
        dwell(self, out)
        self._tool_words(out)
        self._corner(out)
        if self.polar is not None or 160 in codes:
            polar(self, out)
        out.drop("".join(out.taken))
        if out.letters() & set("ABC") and (self.places.tilted or state.axis != UP) and 690 not in codes:
            self.places.rotary(self, out)
        elif axes and out.pivot is None and not codes & (CLAIMS - {530}):
            self.places.leaning(out)
        if self.repeated is not None:
            expand(self, out)
        if self.changer and {"X", "Y"} & out.letters():  # with a new tool the control goes down last
            out.ahead.append([(w, v) for w, v in out.pairs if w.letter in "TXY" or (w.letter, v) in ALSO])
            out.drop("TXY")
            out.pairs = [(w, v) for w, v in out.pairs if (w.letter, v) != ("M", 6.0)]
        self.changer = False
        if self.settings.control.w and {"Z", "W"} & out.letters():
            self._w(out)
        arc = bool(codes & {20, 30}) or (state.motion in (20, 30) and not codes & MOVES)
        if arc and state.plane.name == "xy" and not codes & {180, 190} and out.value("K") == 0.0:
            out.drop("K")  # of a helix without pitch
        alone = axes and axes <= set("ABC") and not codes & (MOVES | CLAIMS) and not out.has("IJKR")
        if arc and alone:
            out.motion(out.before, 10)  # a rotary axis alone goes straight, and the mode stays
            out.motion(out.after, state.motion or 0)
        if self.vectors and out.has("IJK") and not arc and not codes & CLAIMS:
            out.vector = unit((out.value("I") or 0.0, out.value("J") or 0.0, out.value("K") or 0.0))
            out.drop("IJK")
        return out

    def forgive(self, block: Block) -> list[Problem]:
        """Problems that these controls do not have: words that no code of the block uses."""
        left = list[Problem]()
        idle = "EHDPQTS" if (block.motion or self.group1) in (20, 30) else "EHDLPQTS"
        for problem in block.problems:
            word = problem.word
            letter = word.letter if word is not None else ""
            none = letter in "IJKR" and block.value(letter) == 0.0
            free = letter in idle or none or (letter == "R" and self.orients)
            if problem.code == "E207" and word is not None and free:
                self.say(f"word {letter}", word, f"{word.text}: no code of its block uses it")
                del block.words[letter]
                block.centre = block.centre.replace(letter, "")
            elif problem.code != "E204" or "coolant" not in problem.message:
                left.append(problem)
        return left

    def _counted(self, word: Word, value: float, state: State) -> float:
        """A length or angle without a point in least increments."""
        if word.letter not in "XYZABCIJKRQUVW" or "." in word.text or word.expression is not None:
            return value
        return value * (self.least if state.scale == 1.0 or word.letter in "ABC" else self.least / 10.0)

    def _w(self, out: Line) -> None:
        """W and Z move the tool along one line: the core sees their sum."""
        like, codes, state = out.word("ZW"), out.codes, out.state
        z, w = out.value("Z"), out.value("W")
        out.drop("ZW")
        if codes & {280, 300}:
            self.quill = 0.0 if w is not None else self.quill
            if z is not None:
                out.add("Z", z, like)
            return
        if codes & {530, 920, 520, 100} and w is not None:
            what = f"{like.text}: W together with a code that uses the axis words"
            out.refuse(like, what, "write Z and W in a separate block")
            return
        step = not state.absolute if not codes & {900, 910} else 910 in codes
        if step:
            self.quill += w or 0.0
            out.add("Z", (z or 0.0) + (w or 0.0), like)
            return
        self.depth = state.program[2] / state.scale - self.quill if z is None else z
        self.quill = self.quill if w is None else w
        out.add("Z", self.depth + self.quill, like)

    # ---- G ----

    def _g(self, word: Word, code: int, out: Line) -> None:
        codes, state = out.codes, out.state
        if code in (50, 51) and out.has("PQR"):  # G5.1 Q2 X0 Y0 Z0 names the axes that are smoothed
            out.taken |= set("XYZABC")
        splines = code in (50, 51, 52, 53) and out.has("XYZ") and not out.taken
        others = codes & (CLAIMING - {code})
        own = {"okuma": okuma.code, "haas": haas_code}.get(self.variant)
        if own is not None and own(self, word, code, out):
            return
        if code in (71, 1070):
            if any(out.get(letter) for letter in "ABC"):
                what = f"{word.text}: cylindrical interpolation is not supported"
                out.refuse(word, what, "post the moves of the rotary axis")
            else:
                what = f"{word.text}: cylindrical interpolation off, which does not change the path here"
                self.say(f"G{code}", word, what)
            out.taken |= set("ABC")
        elif code == 1000 and "T" in out.given:  # of Brother, or a macro of the builder
            text = out.given["T"][0].text
            what = f"{word.text} {text}: a tool change, then a rapid to the place that is named"
            self.say("G100", word, what, "I213")
            if 60 not in out.now("M") and not out.switches(6.0):
                out.add("M", 6.0, word)
            if out.axes and not codes & MOVES:
                out.add("G", 0.0, word)
            self.changer = True
        elif code in (542, 544) and out.get("P") == 0.0:
            what = f"{word.text} P0: dynamic work offset off, which does not change the path here"
            self.say("G54.2", word, what)
            out.taken.add("P")
        elif code in ENDS and not (code == 500 and out.has("S")):
            if not self.places.end(ENDS[code], out):
                self.say(f"G{code}", word, f"{word.text}: nothing is turned, scaled or mirrored")
            if code == 501 and not others:
                out.taken |= set("XYZIJKP")
        elif code in NOTED and not splines:
            what, letters = NOTED[code]
            self.say(f"G{code}", word, f"{word.text}: {what}, which does not change the path here")
            out.taken |= set() if others else set(letters) & out.given.keys()
        elif code == 800:
            if not codes & MOVES and (state.motion in CYCLES or state.motion is None):
                out.motion(out.before, self.group1)
        elif code in (700, 710) and not out.has("PQUWDRIJKL"):
            what = f"{word.text}: lengths are in {'inches' if code == 700 else 'mm'}"
            self.say(f"G{code}", word, what, "I213")
            out.keep(*_code(word, 20.0 if code == 700 else 21.0))
        elif code in (530, 600) and codes & {280, 300}:
            return
        elif code in MOVES and codes & {280, 300}:  # the reference move is a rapid anyway
            out.motion(out.after, code)
        elif code == 530 and not out.axes:
            self.say("G53", word, f"{word.text} without axis words does nothing")
        elif code == 530 and not codes & {0, 10}:
            motion = self.group1 if state.motion in CYCLES or state.motion is None else state.motion
            out.motion(out.after, motion or 0)
            out.add("G", 0.0, word)
            out.keep(word, 53.0)
        elif code == 600:
            what = "G60: the overshoot past the target, a parameter of the control, is left out"
            self.say("G60", word, what, "I213")
            if not codes & MOVES and out.axes:
                out.motion(out.after, self.group1)
                out.add("G", 0.0, word)
        elif code in (280, 300):
            if out.get("P", 1.0) not in (1.0, 2.0):
                like = out.given["P"][0]
                what = f"{like.text}: that reference point is taken as the second one"
                self.say("G30P", like, what, "I213")
            out.taken.add("P")
            out.keep(word, code / 10.0)
        elif (code in (541, 1540) or self._also_extended(code, out)) and "P" in out.given:
            out.choose(out.before, 100000 + int(out.get("P")))
            out.taken.add("P")
        elif code == 160 and self.variant != "okuma":
            return
        elif code in TAKEN:
            self._place(word, code, out)
        elif code == 531:
            if self.places.tilted:
                out.pivot = self.places.parts["tilt"].axis
                out.taken |= set("PRQ")
            else:
                out.refuse(word, "G53.1 without a tilted plane (G68.2)")
        else:
            self._more(word, code, out)

    def _more(self, word: Word, code: int, out: Line) -> None:
        kind = out.get("L") if code == 100 else 0.0
        if code == 431:
            what = f"{word.text}: a tool length along the tool axis is not supported"
            out.refuse(word, what, "post G43.4, or G68.2 and G43")
            return
        if code in BORING:
            self.say(f"G{code}", word, BORING[code], "I213")
        if code in (2340, 435):
            self.vectors = self.vectors or code == 435
            out.keep(*_code(word, 43.4))
        elif kind in (10.0, 11.0, 12.0, 13.0):
            if kind >= 12.0 and {"P", "R"} <= out.given.keys():
                self._write_radius(out, int(out.get("P")), kind == 13.0)
            else:
                self.say("G10 L10", word, "G10 L10, L11: tool lengths are those of the tool table")
            out.taken |= set("LPR")
        elif kind == 20.0 and "P" in out.given:
            self._extended_offset(out)
            out.taken |= set("LPXYZR")
        else:
            if code in (430, 440, 490):
                self.vectors = False
            out.keep(word, code / 10.0)

    def _write_radius(self, out: Line, place: int, wear: bool) -> None:
        """G10 L12 and L13 Pn R: a radius, or its wear; in G91 a step."""
        number, steps = place + 13000, not out.absolute
        if wear or (steps and number not in self.radii):  # a step from the radius of the table
            number -= 1000
        before = self.radii.get(number, 0.0) if steps else 0.0
        self.radii[number] = before + out.get("R") * out.state.scale

    @staticmethod
    def _also_extended(code: int, out: Line) -> bool:
        """G54 P1 is G54.1 P1, where no other code of the block takes P."""
        takers = CYCLIC | {40, 50, 80, 100, 300, 510, 682}
        return code == 540 and not out.switches(97.0, 98.0, 99.0, 198.0) and not out.codes & takers

    def _corner(self, out: Line) -> None:
        """G1 X R: a rounding before the next move, on controls that are set so."""
        straight = 10 in out.codes or (out.state.motion == 10 and not out.codes & (MOVES | {800}))
        radius = out.value("R")
        claimed = out.codes & (CLAIMS | CYCLIC) or self.orients
        if not straight or not radius or radius < 0.0 or not out.axes & set("XYZ") or claimed:
            return
        like = out.word("R")
        self.say("R corner", like, f"{like.text} with G1: a rounding to the next move, as ,R", "I213")
        out.drop("R")
        out.add(",R", radius, like)

    @staticmethod
    def _extended_offset(out: Line) -> None:
        """G10 L20 Pn: the work offset of G54.1 Pn."""
        code, absolute = 100000 + int(out.get("P")), out.state.absolute
        values = {k: out.get(c) * out.state.scale for k, c in enumerate("XYZ") if c in out.given}

        def write(st: State) -> None:
            old = st.offsets.get(code, ORIGIN)
            new = put(old, values) if absolute else add(put(ORIGIN, values), old)
            st.offsets = {**st.offsets, code: new}
            st.place_offsets()

        out.before.append(write)

    def _place(self, word: Word, code: int, out: Line) -> None:
        """Turned, tilted, scaled, mirrored: not beside a motion, and not under cutter compensation."""
        if out.codes & MOVES or out.state.compensation is not None:
            why = (
                "in the same block as a motion code"
                if out.codes & MOVES
                else "while cutter compensation is on"
            )
            out.refuse(word, f"{word.text} {why}", "write it in a separate block")
            return
        out.taken |= set(TAKEN[code])
        if code == 680:
            self.places.turn(word, out)
        elif code == 682:
            self.places.tilt(word, out)
        elif code == 510:
            self.places.scale(word, out)
        else:
            self.places.mirror({c: out.get(c) * out.state.scale for c in "XYZ" if c in out.given}, out)

    # ---- axis words without a motion code ----

    def _no_motion(self, out: Line) -> None:
        """Axis words before any motion code, or after G80: what the control was in before."""
        taken = out.now() & CLAIMING or out.codes & {290, 800, *TAKEN}
        if out.state.motion is not None or not out.axes or taken:
            return
        word = next((w for w, _ in out.pairs if w.letter in out.axes), None)
        if word is not None:
            self.say("start", word, "no motion code yet: a rapid, as the control starts", "I213")
            out.motion(out.before, self.group1)

    # ---- M ----

    def _m(self, word: Word, value: float, out: Line) -> None:
        code = int(value) if value == int(value) and 0 <= value < 10000 else -1
        if self.variant == "okuma" and code in okuma.RETURN:
            okuma.back(self, word, code, out)
        elif code in SWITCHES:
            out.keep(word, value)
        elif code in (13, 14):
            out.add("M", 3.0 if code == 13 else 4.0, word)
            out.add("M", 8.0, word)
        elif code == 29:
            self.say("M29", word, "M29: rigid tapping, as G84 is read")
        elif code > 30 and self.changes_by == code and "T" in out.given:
            what = f"{word.text} with T, in a program without M6, is read as the tool change"
            self.say("M6 by", word, what, "I213")
            out.add("M", 6.0, word)
        else:
            what = f"{word.text}: a code of the machine, assumed not to change the path"
            self.say(f"M{value:g}", word, what)


def _code(word: Word, value: float) -> tuple[Word, float]:
    """Another G code in the place of one that is written."""
    return word._replace(value=value), value
