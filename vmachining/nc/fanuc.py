"""Dialect `fanuc` and its kin (`haas`, `mazak`, `okuma`): what differs from the core, as data and a few functions.

Lines are made plain first (`fanuc_lines.py`), then the words of a block are brought into the form that the core executes
(`Translator`): what changes no path is taken out and said once (I214), what changes it is honoured or left for the core
to refuse. Sources: operator manuals of the Fanuc series 0i/30i, and of Haas, Mazak and Okuma mills.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

from vmachining.nc import fanuc_haas as haas
from vmachining.nc import fanuc_okuma as okuma
from vmachining.nc.block import Block, Problem
from vmachining.nc.codes import CYCLES
from vmachining.nc.fanuc_cycles import BORING, CYCLE_WORDS, TAPS, dwell, holes, taps
from vmachining.nc.fanuc_line import Line
from vmachining.nc.fanuc_places import Given, Places, extended, polar
from vmachining.nc.frames import UP, unit
from vmachining.nc.lexer import Word
from vmachining.nc.settings import Settings
from vmachining.nc.state import State
from vmachining.nc.tooltable import ToolEntry

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
SWITCHES: Final = frozenset({3, 4, 5, 6, 0, 1, 2, 30, 7, 8, 9, 97, 98, 99})
"""M codes that the core executes, and M97."""

ALSO: Final = (("M", 6.0), ("G", 0.0), ("G", 90.0), ("G", 91.0))
LEAST: Final = {"IS-A": 1e-2, "IS-B": 1e-3, "IS-C": 1e-4}


class Translator:
    """What a control of the family remembers beside the state of the core."""

    def __init__(self, settings: Settings, note: Callable[[Problem], None]) -> None:
        self.variant, self.settings, self.note = settings.dialect, settings, note
        self.said: set[str] = set()
        self.group1 = 0
        self.cycle: dict[str, float] = {}
        self.polar: tuple[float, float] | None = None
        self.places = Places()
        self.radii: dict[int, float] = {}
        """That the program sets, mm, by their system variable: geometry from #13001, wear from #12001 on."""
        self.skipping = self.vectors = False
        self.dead: Problem | None = None
        self.quill = self.depth = 0.0
        self.level: float | None = None
        self.changer = self.k_sizes = False
        self.alias: dict[int, int] = {}
        """Work offsets of Okuma that are others, turned with the rotary axes."""
        self.changes_by = 0
        """M code that changes tools in a program without M6."""
        self.block: list[tuple[Word, float]] = []
        self.at = 0
        """Line in work, 0-based."""
        self.repeated: tuple[Word, int, dict[str, float]] | None = None
        self.least = LEAST.get(settings.control.increments, 0.0)

    @property
    def quick(self) -> bool:
        """Whether plain blocks mean what they mean to the core."""
        bent = self.skipping or self.vectors or self.least or self.settings.control.w or self.places.given
        return self.polar is None and self.dead is None and not bent

    def say(self, key: str, word: Word | None, text: str, code: str = "I214") -> None:
        """A note, once for each key."""
        if key not in self.said:
            self.said.add(key)
            self.note(Problem(code, word, text))

    # ---- one block ----

    def translate(self, words: tuple[Word, ...], values: list[float], state: State) -> Line:
        """The block for the core."""
        if any(w.letter == "G" and v in TAPS for w, v in zip(words, values, strict=True)):
            words, values = taps(list(zip(words, values, strict=True)), state, self.variant)
        if state.motion in MOVES:
            self.group1 = state.motion or 0
            self.cycle.clear()
        out, self.block = Line(), list(zip(words, values, strict=True))
        codes = {round(v * 10.0) for w, v in zip(words, values, strict=True) if w.letter == "G"}
        given = {w.letter: (w, v) for w, v in zip(words, values, strict=True) if w.letter not in "GMN"}
        if self.skipping or (100 in codes and "L" in given and given["L"][1] in (50.0, 51.0, 52.0)):
            if not self.skipping:
                self.say("G10 L50", words[0], "G10 L50: parameters of the control are not set here")
            self.skipping = 110 not in codes
            return out
        if self.least:
            values = [self._counted(w, v, state) for w, v in zip(words, values, strict=True)]
            given = {k: (w, self._counted(w, v, state)) for k, (w, v) in given.items()}
        drop: set[str] = set()
        axes = set(given) & set("XYZABC")
        if self.dead is not None:
            if not codes & (MOVES | set(CYCLE_WORDS) | {800}):
                out.problems = [self.dead] if axes else []
                return out
            self.dead = None
        if self.places.given and axes and 682 not in codes:
            self.places.given = {}
            out.refuse(words[0], "G68.2: points or directions of its plane are missing before this motion")
            return out
        for word, value in zip(words, values, strict=True):
            letter = word.letter
            if letter == "G":
                self._g(word, round(value * 10.0), out, given, drop, codes, axes, state)
            elif letter == "M":
                self._m(word, value, out)
            elif letter != "N" or not out.words:
                out.keep(word, value)
        if self.repeated is not None:
            out.drop("IJKLDQ" if self.repeated[1] in (120, 130) else "IJKL")
        self._no_motion(out, codes, axes, state)
        holes(self, out, state, bool(out.codes("G") & (MOVES | CLAIMS | {331})))
        dwell(self, out, codes)
        self._tool_words(out, codes, state)
        self._corner(out, codes, axes, state)
        if self.polar is not None or 160 in codes:
            polar(self, out, codes, state)
        for letter in drop:
            out.drop(letter)
        if out.letters() & set("ABC") and (self.places.tilted or state.axis != UP) and 690 not in codes:
            self.places.rotary(self, out, given, state)
        elif axes and out.pivot is None and not codes & (CLAIMS - {530}):
            self.places.leaning(out, codes, state)
        if self.repeated is not None:
            haas.expand(self, out, state)
        if self.changer and {"X", "Y"} & out.letters():  # with a new tool the control goes down last
            pairs = list(zip(out.words, out.values, strict=True))
            out.ahead.append([(w, v) for w, v in pairs if w.letter in "TXY" or (w.letter, v) in ALSO])
            kept = [(w, v) for w, v in pairs if w.letter not in "TXY" and (w.letter, v) != ("M", 6.0)]
            out.words, out.values = [w for w, _ in kept], [v for _, v in kept]
        self.changer = False
        if self.settings.control.w and {"Z", "W"} & out.letters():
            self._w(out, codes, state)
        arc = bool(codes & {20, 30}) or (state.motion in (20, 30) and not codes & MOVES)
        if arc and state.plane.name == "xy" and not codes & {180, 190} and out.value("K") == 0.0:
            out.drop("K")  # of a helix without pitch
        if (
            arc
            and axes <= set("ABC")
            and axes
            and not codes & (MOVES | CLAIMS)
            and not set(given) & set("IJKR")
        ):
            out.motion(out.before, 10)  # a rotary axis alone goes straight, and the mode stays
            out.motion(out.after, state.motion or 0)
        if self.vectors and set(given) & set("IJK") and not arc and not codes & CLAIMS:
            out.vector = unit((out.value("I") or 0.0, out.value("J") or 0.0, out.value("K") or 0.0))
            out.drop("IJK")
        return out

    def forgive(self, block: Block) -> list[Problem]:
        """Problems that these controls do not have: words that no code of the block uses."""
        left = list[Problem]()
        for problem in block.problems:
            word = problem.word
            letter = word.letter if word is not None else ""
            arc = (block.motion or self.group1) in (20, 30)
            value = block.value(letter) if letter else None
            if (
                problem.code == "E207"
                and word is not None
                and (
                    letter in ("EHDPQTS" if arc else "EHDLPQTS")
                    or (letter in "IJKR" and value == 0.0)
                    or (letter == "R" and self.orients)
                )
            ):
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

    def _w(self, out: Line, codes: set[int], state: State) -> None:
        """W and Z move the tool along one line: the core sees their sum."""
        like = out.word("ZW")
        z, w = out.value("Z"), out.value("W")
        out.drop("ZW")
        if codes & {280, 300}:
            self.quill = 0.0 if w is not None else self.quill
            if z is not None:
                out.add("Z", z, like)
            return
        if codes & {530, 920, 520, 100} and w is not None:
            out.refuse(
                like,
                f"{like.text}: W together with a code that uses the axis words",
                "write Z and W in a separate block",
            )
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

    def _g(
        self, word: Word, code: int, out: Line, given: Given, drop: set[str], codes: set[int], axes: set[str],
        state: State,
    ) -> None:  # fmt: skip
        if code in (50, 51) and set(given) & set("PQR"):  # G5.1 Q2 X0 Y0 Z0 names the axes that are smoothed
            drop.update("XYZABC")
        splines = code in (50, 51, 52, 53) and set(given) & set("XYZ") and not drop
        if self.variant == "okuma" and okuma.code(self, word, code, out, given, drop, state):
            return
        if self.variant == "haas" and haas.code(self, word, code, out, given, drop):
            return
        if code in (71, 1070):
            if any(given[letter][1] for letter in "ABC" if letter in given):
                out.refuse(
                    word,
                    f"{word.text}: cylindrical interpolation is not supported",
                    "post the moves of the rotary axis",
                )
            else:
                self.say(
                    f"G{code}",
                    word,
                    f"{word.text}: cylindrical interpolation off, which does not change the path here",
                )
            drop.update("ABC")
        elif code == 1000 and "T" in given:  # of Brother, or a macro of the builder
            what = f"{word.text} {given['T'][0].text}: a tool change, then a rapid to the place that is named"
            self.say("G100", word, what, "I213")
            if 60 not in out.codes("M") and not any(w.letter == "M" and v == 6.0 for w, v in self.block):
                out.add("M", 6.0, word)
            if axes and not codes & MOVES:
                out.add("G", 0.0, word)
            self.changer = True
        elif code in (542, 544) and given.get("P", (word, 0.0))[1] == 0.0:
            self.say(
                "G54.2", word, f"{word.text} P0: dynamic work offset off, which does not change the path here"
            )
            drop.add("P")
        elif code in ENDS and not (code == 500 and set(given) & set("S")):
            if not self.places.end(ENDS[code], out, given):
                self.say(f"G{code}", word, f"{word.text}: nothing is turned, scaled or mirrored")
            others = codes & (MOVES | CLAIMS | set(CYCLE_WORDS))
            drop.update(letter for letter in "XYZIJKP" if code == 501 and not others)
        elif code in NOTED and not splines:
            what, letters = NOTED[code]
            self.say(f"G{code}", word, f"{word.text}: {what}, which does not change the path here")
            others = codes & (MOVES | CLAIMS | set(CYCLE_WORDS)) - {code}
            drop.update(letter for letter in letters if letter in given and not others)
        elif code == 800:
            if not codes & MOVES and (state.motion in CYCLES or state.motion is None):
                out.motion(out.before, self.group1)
        elif code in (700, 710) and not set(given) & set("PQUWDRIJKL"):
            what = f"{word.text}: lengths are in {'inches' if code == 700 else 'mm'}"
            self.say(f"G{code}", word, what, "I213")
            value = 20.0 if code == 700 else 21.0
            out.keep(word._replace(value=value), value)
        elif code in (530, 600) and codes & {280, 300}:
            return
        elif code in MOVES and codes & {280, 300}:  # the reference move is a rapid anyway
            out.motion(out.after, code)
        elif code == 530 and not axes:
            self.say("G53", word, f"{word.text} without axis words does nothing")
        elif code == 530 and not codes & {0, 10}:
            motion = self.group1 if state.motion in CYCLES or state.motion is None else state.motion
            out.motion(out.after, motion or 0)
            out.add("G", 0.0, word)
            out.keep(word, 53.0)
        elif code == 600:
            what = "G60: the way past the target, a parameter of the control, is left out"
            self.say("G60", word, what, "I213")
            if not codes & MOVES and axes:
                out.motion(out.after, self.group1)
                out.add("G", 0.0, word)
        elif code in (280, 300):
            if "P" in given and given["P"][1] not in (1.0, 2.0):
                what = f"{given['P'][0].text}: that reference point is taken as the second one"
                self.say("G30P", given["P"][0], what, "I213")
            drop.add("P")
            out.keep(word, code / 10.0)
        elif (code in (541, 1540) or self._also_extended(code, codes, out)) and "P" in given:
            number = int(given["P"][1])
            drop.add("P")
            out.before.append(lambda s: extended(s, number))
        elif code == 160 and self.variant != "okuma":
            return
        elif code in (680, 682, 510, 511):
            self._place(word, code, out, given, drop, codes, state)
        elif code == 531:
            if self.places.tilted:
                out.pivot = self.places.parts["tilt"].axis
                drop.update("PRQ")
            else:
                out.refuse(word, "G53.1 without a tilted plane (G68.2)")
        else:
            self._more(word, code, out, given, drop, state)

    def _more(self, word: Word, code: int, out: Line, given: Given, drop: set[str], state: State) -> None:
        if code == 431:
            out.refuse(
                word,
                f"{word.text}: a tool length along the tool axis is not supported",
                "post G43.4, or G68.2 and G43",
            )
            return
        if code in BORING:
            self.say(f"G{code}", word, BORING[code], "I213")
        if code == 2340:
            self._add_length(out, word, 43.4)
        elif code == 435:
            self.vectors = True
            self._add_length(out, word, 43.4)
        elif code == 100 and "L" in given and given["L"][1] in (10.0, 11.0, 12.0, 13.0):
            kind, place, r = given["L"][1], given.get("P"), given.get("R")
            if kind >= 12.0 and place and r:
                codes = {round(v * 10.0) for w, v in self.block if w.letter == "G"}
                steps = 910 in codes or not (state.absolute or 900 in codes)
                number = int(place[1]) + 13000
                if kind == 13.0 or (
                    steps and number not in self.radii
                ):  # a step from the radius of the table
                    number -= 1000
                before = self.radii.get(number, 0.0) if steps else 0.0
                self.radii[number] = before + r[1] * state.scale
            else:
                self.say("G10 L10", word, "G10 L10, L11: tool lengths are those of the tool table")
            drop.update("LPR")
        elif code == 100 and "L" in given and given["L"][1] == 20.0 and "P" in given:
            self._extended_offset(word, given, out, state)
            drop.update("LPXYZR")
        else:
            if code in (430, 440, 490):
                self.vectors = False
            out.keep(word, code / 10.0)

    def _also_extended(self, code: int, codes: set[int], out: Line) -> bool:
        """G54 P1 is G54.1 P1, where no other code of the block takes P."""
        calls = any(w.letter == "M" and v in (97.0, 98.0, 99.0, 198.0) for w, v in self.block)
        return code == 540 and not calls and not codes & ({40, 50, 80, 100, 300, 510, 682} | set(CYCLE_WORDS))

    @property
    def orients(self) -> bool:
        """Whether the spindle is stopped at an angle, R."""
        return any(w.letter == "M" and v == 19.0 for w, v in self.block)

    def _corner(self, out: Line, codes: set[int], axes: set[str], state: State) -> None:
        """G1 X R: a rounding before the next move, on controls that are set so."""
        straight = 10 in codes or (state.motion == 10 and not codes & (MOVES | {800}))
        radius = out.value("R")
        if (
            not straight
            or not radius
            or radius < 0.0
            or not axes & set("XYZ")
            or codes & (CLAIMS | set(CYCLE_WORDS))
            or self.orients
        ):
            return
        like = out.word("R")
        self.say("R corner", like, f"{like.text} with G1: a rounding to the next move, as ,R", "I213")
        out.drop("R")
        out.add(",R", radius, like)

    def _add_length(self, out: Line, word: Word, value: float) -> None:
        out.keep(word._replace(value=value), value)

    def _extended_offset(self, word: Word, given: Given, out: Line, state: State) -> None:
        """G10 L20 Pn: the work offset of G54.1 Pn."""
        code = 100000 + int(given["P"][1])
        values = {k: given[c][1] * state.scale for k, c in enumerate("XYZ") if c in given}
        absolute = state.absolute

        def write(st: State) -> None:
            old = st.offsets.get(code, (0.0, 0.0, 0.0))
            x, y, z = (
                values.get(k, 0.0 if not absolute else v) + (0.0 if absolute else v)
                for k, v in enumerate(old)
            )
            st.offsets = {**st.offsets, code: (x, y, z)}
            st.place_offsets()

        out.before.append(write)

    def _place(
        self, word: Word, code: int, out: Line, given: Given, drop: set[str], codes: set[int], state: State
    ) -> None:
        """Turned, tilted, scaled, mirrored: not beside a motion, and not under cutter compensation."""
        if codes & MOVES or state.compensation is not None:
            why = "beside a motion code" if codes & MOVES else "while cutter compensation is on"
            out.refuse(word, f"{word.text} {why}", "write it in a separate block")
            return
        if code == 680:
            drop.update(self.places.turn(word, given, out, state))
        elif code == 682:
            drop.update(self.places.tilt(word, given, out, state))
        elif code == 510:
            drop.update(self.places.scale(word, given, out, state))
        else:
            self.places.mirror({k: (w, v * state.scale) for k, (w, v) in given.items()}, out)
            drop.update("XYZ")

    # ---- axis words without a motion code ----

    def _no_motion(self, out: Line, codes: set[int], axes: set[str], state: State) -> None:
        """Axis words before any motion code, or after G80: what the control was in before."""
        taken = out.codes("G") & (CLAIMS | MOVES | set(CYCLE_WORDS)) or codes & {290, 510, 511, 680, 682}
        if state.motion is not None or not axes or taken or 800 in codes:
            return
        word = next((w for w in out.words if w.letter in axes), None)
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
        elif code > 30 and self.changes_by == code and any(w.letter == "T" for w, _ in self.block):
            what = f"{word.text} beside T, in a program without M6: taken as its tool change"
            self.say("M6 by", word, what, "I213")
            out.add("M", 6.0, word)
        else:
            self.say(
                f"M{value:g}", word, f"{word.text}: a code of the machine, assumed not to change the path"
            )

    # ---- registers ----

    def register(self, number: int, value: float) -> None:
        """A variable of a tool register is set, value in mm: geometry and wear of radii count, lengths are of the job."""
        if 12000 < number <= 12400 or 13000 < number <= 13400:
            self.radii[number] = value
        if 10000 < number <= 10400 or 11000 < number <= 11400:
            self.say("#11001", None, f"#{number}: tool lengths are those of the tool table")

    def own_radius(self, register: int, entry: ToolEntry | None) -> float | None:
        """Of a register that the program sets, mm: geometry and wear; None where nothing but a wear of who knows what is set.

        entry : of the tool in the spindle, whose radius is the geometry where the program sets the wear alone.
        """
        wear, radius = self.radii.get(12000 + register), self.radii.get(13000 + register)
        if radius is None and wear is not None:
            if self.settings.control.compensation == "wear":
                radius = 0.0
            elif entry is not None and not math.isnan(entry.diameter_mm):
                radius = entry.diameter_mm / 2.0
        return None if radius is None else radius + (wear or 0.0)

    def _two_tools(self, out: Line) -> None:
        """T1 T2 M6: the first is loaded, the second is made ready."""
        tools = [k for k, word in enumerate(out.words) if word.letter == "T"]
        if len(tools) != 2 or 60 not in out.codes("M"):
            return
        next_one, like = out.values[tools[1]], out.words[tools[1]]
        del out.words[tools[1]], out.values[tools[1]]
        what = "two T words beside M6: the first tool is loaded, the second is made ready"
        self.say("T T", like, what, "I213")
        if next_one == int(next_one) >= 0:
            out.after.append(lambda state: setattr(state, "selected", int(next_one)))

    def _tool_words(self, out: Line, codes: set[int], state: State) -> None:
        """H and D are registers: they hold what belongs to the tool in the spindle."""
        self._two_tools(out)
        tool = state.tool
        if 60 in out.codes("M"):
            if "T" not in out.letters() and state.selected is None:
                like = next(
                    w for w, v in zip(out.words, out.values, strict=True) if w.letter == "M" and v == 6.0
                )
                self.say("M6", like, "M6 before any T: the tool in the spindle stays", "I213")
                at = out.words.index(like)
                del out.words[at], out.values[at]
            tool = int(out.value("T") or state.selected or 0)
        has = out.letters()
        codes = codes | out.codes("G")
        if "H" in has:
            number, like = out.value("H"), out.word("H")
            out.drop("H")
            if number == 0.0 and codes & {430, 440}:
                for code in (430, 440):
                    out.replace(code, 490)
            elif number != tool and tool:
                what = f"{like.text}: a register of tool lengths; the one of the tool in the spindle is taken"
                self.say("H", like, what)
        if 440 in codes:
            out.replace(440, 430)
        side = codes & {410, 420}
        if not side:
            out.drop("D")
            return
        own = int(out.value("D") or 0.0) if "D" in has else None
        like = out.word("D") if own is not None else next(w for w in out.words if w.letter == "G")
        wear = self.settings.control.compensation == "wear"
        radius = self.own_radius(own or 0, state.table.get(tool))
        if radius is not None or own == 0 or wear:
            for old, new in ((410, 411), (420, 421)):
                out.replace(old, new)
            out.drop("D")
            out.add("D", 2.0 * (radius or 0.0) / state.scale, like)
            return
        if own is not None and own != tool and tool:
            what = f"{like.text}: a register of tool radii; the radius of the tool in the spindle is taken"
            self.say("D", like, what)
        elif self.settings.tools is not None and self.settings.control.compensation == "":
            what = (
                f"{like.text}: the radius of the tool in the spindle is taken; where the program is the path of the "
                'tool centre and D holds its wear, say compensation = "wear"'
            )
            self.say("D", like, what, "I213")
        out.drop("D")
