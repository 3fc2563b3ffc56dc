"""Programs for turning, of the Fanuc family: their path, radius over Z, in the plane Y = 0. No material is turned.

    X U      diameters, or radii where the control is set so      U W V   steps of X, Z, Y
    G96 S    surface speed, limited by G50 S (system B: G92 S)     T0203   tool 2, register 3
    G98 G99  feed per minute, per turn (system B: G94 G95)         G32 G33 G34  a thread, F or K its lead
    G12.1 G112   polar interpolation: C is a length, Y of the face; G13.1 G113 its end

System B is one with G95 or G91. The radius of the nose is not known: the path is that of its programmed point (W351).
Source: operator's manual of the Fanuc series 0i-T and 30i (lathe), Okuma OSP-P200L programming manual.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final

from vmachining.nc.arcs import PLANES
from vmachining.nc.block import Problem
from vmachining.nc.codes import spell
from vmachining.nc.fanuc_lathe_cycles import HOLES, MANY, PASSES, Cycles, Find, Words
from vmachining.nc.fanuc_line import Line
from vmachining.nc.fanuc_turning import has_system_b
from vmachining.nc.lexer import Word, lex_line
from vmachining.nc.settings import Settings
from vmachining.nc.state import State

MOVES: Final = {0: 0, 10: 10, 20: 20, 30: 30, 320: 320, 330: 320, 340: 320}
OKUMA: Final = {
    **dict.fromkeys((310, 320, 330, 340, 350), "a thread cycle"), 710: "a thread cycle", 720: "a thread cycle",
    **dict.fromkeys((730, 740), "a grooving cycle"), 750: "a chamfer without L", 760: "a rounding without L",
    770: "tapping", 780: "tapping", 790: "a cycle", 200: "the way home",
    **dict.fromkeys((280, 290, 300), "limits of torque, skips"), 920: "not a code of its lathes",
}  # fmt: skip
"""Codes that mean something else there, or differ in words."""
IGNORED: Final = frozenset({170, 180, 190, 400, 410, 420, 401, 411, 680, 690, 1400, 1410, 250, 260})
OWN: Final = (
    IGNORED | MOVES.keys() | PASSES.keys() | MANY.keys() | HOLES.keys() | {90, 530, 700, 800, 810, 960, 970}
)
"""G codes that never reach the core as they are."""
FASTEST_RPM: Final = 3000.0
"""Where G96 has no limit: what lathes of middle size reach."""


def _plain_hole(value: float) -> float:
    """G83.5, G87.6 and the like peck in other ways to the same depth."""
    return float(int(value)) if int(value) in (83, 84, 87, 88) else value


class Lathe(Cycles):
    """What a lathe remembers beside the state of the core."""

    def __init__(self, settings: Settings, note: Callable[[Problem], None]) -> None:
        super().__init__(settings, note)
        self.half = 0.5 if settings.control.lathe == "diameter" else 1.0
        self.lines: Sequence[str] = ()
        self.surface: float | None = None
        self.limit: float | None = None
        self.constant = self.steps = self.polar_face = self.flat = self.system_b = False
        self.modal = 0

    def start(self, lines: Sequence[str], state: State, contour: Find) -> None:
        """As lathes are switched on: feed per turn; system B where a code of it stands somewhere."""
        self.system_b = self.variant == "okuma" or has_system_b(lines)
        self.lines = lines
        self.contour, state.feed_mode, state.plane = contour, 950, PLANES[180]

    @property
    def quick(self) -> bool:
        """No block means what it means to a mill."""
        return False

    # ---- one block ----

    def translate(self, words: tuple[Word, ...], values: list[float], state: State) -> Line:
        """The block for the core."""
        self.runs = None
        if self.leaves_out(self.at):
            return Line()
        if self.least:
            values = [
                v if w.letter == "Q" else self._counted(w, v, state)
                for w, v in zip(words, values, strict=True)
            ]
        least, self.least = self.least, 0.0
        try:
            return self._block(list(zip(words, values, strict=True)), state)
        finally:
            self.least = least

    def _block(self, given: Words, state: State) -> Line:
        given = [(w._replace(letter="A") if w.letter == ",A" else w, v) for w, v in given]
        given = [(w, _plain_hole(v)) if w.letter == "G" else (w, v) for w, v in given]
        codes = {round(v * 10.0) for w, v in given if w.letter == "G"}
        has = {w.letter: (w, v) for w, v in given if w.letter not in "GMN"}
        if not has and not codes:
            return super().translate(tuple(w for w, _ in given), [v for _, v in given], state)
        if (
            self.variant == "okuma" and "L" in has and codes & {750, 760}
        ):  # a chamfer or a rounding of any motion
            mark = ",R" if 760 in codes else ",C"
            has[mark] = (has["L"][0]._replace(letter=mark), has.pop("L")[1])
            given = [(w, v) for w, v in given if not (w.letter == "G" and v in (75.0, 76.0))]
            codes -= {750, 760}
        if 40 in codes and "F" in has and not {"P", "X", "U"} & set(has):  # Okuma
            given = [
                (w._replace(letter="X", text=w.text + "."), v) if w.letter == "F" else (w, v)
                for w, v in given
            ]
        alone = (
            "A" in has and not set(has) & set("XZUWYI") and not codes - {10} and (codes or self.modal == 10)
        )
        if alone and (meets := self._crossing(has["A"][1], state)) is not None:
            like = has.pop("A")[0]
            for letter, value in zip("XZ", meets, strict=True):
                has[letter] = like._replace(letter=letter), value
            given = [*((w, v) for w, v in given if w.letter != "A"), has["X"], has["Z"]]
        if (refused := self._unread(given, codes, has, state)) is not None:
            out = Line()
            out.problems = [refused]
            return out
        kind = has["L"][1] if "L" in has else None
        if 100 in codes and "P" in has and kind in (None, 2.0, 20.0):
            if kind is not None or has["P"][1] == 0.0:
                what = (
                    "a shift of the work zero is left out: what is cut after it lies where it would without"
                )
                self.note(Problem("W368", given[0][0], what, "write the program from one zero"))
            else:
                self.say("G10", given[0][0], "G10 P: tool offsets are those of the job")
            return Line()
        if 40 in codes:
            return super().translate(tuple(w for w, _ in given), [v for _, v in given], state)
        scale = 25.4 if 200 in codes else 1.0 if 210 in codes else state.scale
        here = state.program[0] / scale, state.program[2] / scale
        if "H" in has and "C" not in has and not codes & MANY.keys():  # a step of C
            c = state.rotary.get("c", 0.0) - state.rotary_shift("c") + has["H"][1]
            has["C"] = has["H"][0]._replace(letter="C"), c
        before = list[Callable[[State], None]]()
        after = list[Callable[[State], None]]()
        ahead = list[Words]()
        self._surface(codes, has)
        for place, step in (("X", "U"), ("Z", "W")):
            if place in has and step in has and not codes & MANY.keys():
                out = Line()
                what = f"{place} and {step} name one axis, by its place and by a step"
                out.refuse(has[step][0], what, "keep one of the words")
                return out
        kept = self._modes(given, codes, has, before)
        x, z = self._goal(has, here)
        single = next(
            (
                PASSES.get(c, c)
                for c in codes
                if c in PASSES or (c in (900, 940, 920) and self._is_pass(c, codes, has))
            ),
            0,
        )
        like = given[0][0] if given else Word("G", 0.0, 1, 0, "")
        group1 = next((MOVES[c] for c in codes if c in MOVES), None)
        if group1 is not None or codes & ({700, 800} | HOLES.keys() | MANY.keys()):
            self.once, self.hole = None, self.hole if codes & HOLES.keys() else {}
            self.modal = self.modal if group1 is None else group1
        if codes & {170, 180, 190} and group1 is None and {"A", "B", "P"} & set(has) and not self.polar_face:
            out = Line()  # lines by angles, of other controls
            out.refuse(next(w for w, v in given if w.letter == "G"), "a plane with words of a contour")
            return out
        many = next((c for c in codes if c in MANY and not (c in (850, 860) and "P" not in has)), 0)
        if codes & {700, 710} and not set(has) & set("PQUWDR"):
            many, codes = 0, codes - {700, 710}  # units
        home = codes & {280, 300, 530}
        if 530 in codes and not codes & {280, 300} and (self.modal if group1 is None else group1):
            what = (
                "G53 with a cut: no lathe cuts to its own places; it goes where the words say, as without G53"
            )
            self.say("G53 cut", next(w for w, v in given if w.letter == "G" and v == 53.0), what, "W366")
            home = set()
        if single or (
            self.once is not None and {"X", "Z", "U", "W"} & set(has) and not codes & {500, 920} and not home
        ):
            ahead += self._single(single, has, here, x, z, like, before, after, scale, state)
        elif (many or 700 in codes or (870 in codes and "P" in has and "X" not in has)) and not (
            codes & HOLES.keys() and "Z" in has
        ):
            kept = [(w, v) for w, v in kept if w.letter != "F" or many != 760]  # F of a thread is its lead
            out = super().translate(tuple(w for w, _ in kept), [v for _, v in kept], state)
            self._many(many, codes, has, like, out)
            out.before[:0] = before
            return out
        elif (codes & HOLES.keys() or self.hole) and not home and {"X", "Z", "C", "U", "W", "H"} & set(has):
            ahead += self._hole(codes, has, here, x, z, like)
        elif self.modal == 320 and {"X", "Z", "U", "W"} & set(has) and not home:
            lead = has.get("F") or has.get("K") or has.get("I") or has.get("E")
            self._threading(lead[1] if lead else None, scale, before, after, state, modal="F" in has)
            ahead.append(self._straight(10, x, z, like))
        else:
            kept += self._motion(given, codes, has, x, z, group1, here, bool(home))
        if self.constant and self.surface and ({"X", "U"} & set(has) or 960 in codes):
            rpm = self._rpm(abs(here[0] + (x if x is not None else here[0])) / 2.0, scale, like)
            before.append(lambda s: setattr(s, "speed", rpm))
        out = super().translate(tuple(w for w, _ in kept), [v for _, v in kept], state)
        out.before[:0] = before
        out.ahead += ahead
        out.after += after
        return out

    def _unread(
        self, given: Words, codes: set[int], has: dict[str, tuple[Word, float]], state: State
    ) -> Problem | None:
        """What would be read as something else: codes of Okuma, steps of G50, angles and lengths of C and Y."""
        many = codes & (MANY.keys() | {700, 870, 1160})
        words = {k: has[k][0] for k in has}
        first = next((w for w, _ in given if w.letter == "G"), given[0][0])
        if self.variant == "okuma":
            moves = set(has) & set("XZUW")
            lap = codes & {850, 860, 870} and "P" in has
            code = next((c for c in codes if c in OKUMA or (c in HOLES and not lap)), None)
            if code is not None and not (code in (750, 760) and "L" in has):
                what = OKUMA.get(code, "a cycle")
                return Problem("E208", first, f"{spell('G', code)} of Okuma ({what}) is not supported")
            if 500 in codes and moves:
                return Problem(
                    "E208", first, "G50 of Okuma with axis words (a shift of the zero) is not supported"
                )
            if not many and set(has) & set("UW"):
                what = f"{words.get('U', words.get('W', first)).text}: U and W of Okuma are axes, which are not supported"
                return Problem("E208", first, what)
        hole = next((c for c in codes if c in HOLES and not (c in (850, 860, 870) and "P" in has)), None)
        if (
            hole is not None
            and set(has) & set("XZUWCH")
            and not set(has) & set("XU" if HOLES[hole] == "X" else "ZW")
        ):
            return Problem("E208", first, f"{first.text} without the depth of its hole, {HOLES[hole]}")
        shifts = 500 in codes or (920 in codes and self.system_b)
        if shifts and set(has) & set("UW"):
            return Problem(
                "E208", first, f"{first.text} with U or W (a shift of the zero by a step) is not supported"
            )
        if codes & {131, 1130} and abs(state.program[1]) > 1e-6:
            what = f"{first.text} where C is not zero: the place of X and C after it is not read"
            return Problem("E208", first, what, "end polar interpolation at C0")
        steps = 910 in codes or (self.steps and 900 not in codes)
        if "V" in has or (steps and set(has) & set("CY")) or ("H" in has and self.polar_face):
            word = next(words[k] for k in "VCYH" if k in words)
            return Problem(
                "E208",
                word,
                f"{word.text}: a step of Y, or of C where it is a length or under G91, is not supported",
            )
        if "H" in has and not many and "C" not in self.settings.rotary:
            return Problem(
                "E208", words["H"], f"{words['H'].text}: H is a step of C, which this lathe does not have"
            )
        straight = not codes & (
            MANY.keys() | HOLES.keys() | PASSES.keys() | {40, 280, 300, 530, 170, 180, 190}
        )
        if "A" in has and straight and self.once is None and not self.hole:
            x, z = bool(set(has) & set("XU")), bool(set(has) & set("ZW"))
            across = abs(math.cos(math.radians(has["A"][1]))) < 1e-9
            along = abs(math.sin(math.radians(has["A"][1]))) < 1e-9
            if not (x or z) or (not z and along) or (not x and across):
                what = f"{words['A'].text}: the end of a line by its angle is not determined in its block"
                return Problem("E208", words["A"], what, "write X and Z")
        return None

    def _is_pass(self, code: int, codes: set[int], has: dict[str, tuple[Word, float]]) -> bool:
        """Whether G90, G94 or G92 is a pass of system A, not a mode of system B."""
        if self.system_b or codes & MOVES.keys() or not {"X", "U", "Z", "W"} & set(has):
            return False
        return not (code == 920 and "S" in has)

    def _modes(
        self,
        given: Words,
        codes: set[int],
        has: dict[str, tuple[Word, float]],
        before: list[Callable[[State], None]],
    ) -> Words:
        """Words for the core without those of the lathe."""
        kept: Words = []
        for word, value in given:
            code = round(value * 10.0)
            if word.letter == "G":
                if code in (940, 950, 980, 990):
                    system = {980: 94.0, 990: 95.0}
                    if code < 960 and not self._is_pass(code, codes, has):
                        kept.append((word, value))
                    elif code in system and not self.system_b:
                        kept.append((word._replace(value=system[code]), system[code]))
                elif code in (900, 910):
                    if not self._is_pass(code, codes, has):
                        self.steps = code == 910
                elif code == 920 and self._is_pass(code, codes, has):
                    continue
                elif code in (410, 420):
                    self.say(
                        "nose",
                        word,
                        f"{word.text}: the radius of the nose is not known; the path is that of the programmed point",
                        "W351",
                    )
                elif code in (121, 1120):
                    self.polar_face = True
                elif code in (131, 1130):
                    self.polar_face = False
                elif code in (500, 920) and (self.system_b or code == 500):
                    if "S" in has:
                        self.limit = has["S"][1]
                    if {"X", "Z"} & set(has):
                        kept.append((word._replace(value=92.0), 92.0))
                elif (code not in OWN and (code != 820 or self.variant != "okuma")) or (
                    code in (700, 710) and not set(has) & set("PQUWDR")
                ):
                    kept.append((word, value))
            elif word.letter == "T":
                number = int(value) // 100 if value >= 100.0 else int(value)
                if self.variant == "okuma":  # T010203: nose, tool, register
                    number %= 100
                if number:
                    before.append(lambda s, n=number: setattr(s, "tool", n))  # type: ignore[misc]
            elif word.letter == "M":
                if value != 6.0:
                    kept.append((word, value))
            elif (
                word.letter in "FN"
                or (word.letter == "P" and codes & {541, 1540})
                or (word.letter == "S" and not codes & {500, 920} and not self.constant)
            ):
                kept.append((word, value))
        return kept

    def _surface(self, codes: set[int], has: dict[str, tuple[Word, float]]) -> None:
        """G96, G97 and the S that belongs to them."""
        if codes & {960, 970}:
            self.constant = 960 in codes
        if "S" in has and self.constant and not codes & {500, 920}:
            self.surface = has["S"][1]

    def _rpm(self, radius: float, scale: float, like: Word) -> float:
        """Of G96 at a radius in units of the program."""
        assert self.surface is not None
        around = 2.0 * math.pi * radius
        wanted = self.surface * (12.0 if scale != 1.0 else 1000.0) / around if around > 0.0 else math.inf
        if self.limit is None and wanted > FASTEST_RPM:
            what = f"G96 without a limit by G50 S: the spindle is taken to turn at {FASTEST_RPM:g} rev/min at most"
            self.say("G96 limit", like, what, "I213")
        return min(wanted, FASTEST_RPM if self.limit is None else self.limit)

    def _goal(
        self, has: dict[str, tuple[Word, float]], here: tuple[float, float]
    ) -> tuple[float | None, float | None]:
        """Radius and Z that the block names, absolute, in units of the program."""
        x = z = None
        if "X" in has:
            x = has["X"][1] * self.half + (here[0] if self.steps else 0.0)
        elif "U" in has:
            x = here[0] + has["U"][1] * self.half
        if "Z" in has:
            z = has["Z"][1] + (here[1] if self.steps else 0.0)
        elif "W" in has:
            z = here[1] + has["W"][1]
        return x, z

    # ---- motions ----

    def _motion(
        self, given: Words, codes: set[int], has: dict[str, tuple[Word, float]], x: float | None, z: float | None,
        group1: int | None, here: tuple[float, float], home: bool,
    ) -> Words:  # fmt: skip
        """Words of a plain motion for the core."""
        out: Words = []
        marks = {w.letter: w for w, _ in given}
        for word, value in given:
            code = round(value * 10.0)
            if word.letter == "G" and code in (0, 10, 20, 30):
                out.append((word, value))
        places = {"X": x, "Z": z}
        y = has.get("Y")
        if home:  # G53 too goes to the machine's own places, which are not known
            if 530 in codes and (x is not None or z is not None):
                at = next(w for w, v in given if w.letter == "G" and round(v * 10.0) == 530)
                out.append((at._replace(value=28.0), 28.0))
                places = {"X": None if x is None else here[0], "Z": None if z is None else here[1]}
            y = None
        for letter, other in (("X", "U"), ("Z", "W")):
            goal = places[letter]
            if goal is not None:
                like = marks.get(letter) or marks.get(other) or given[0][0]
                out.append((like._replace(letter=letter, value=goal), goal))
        if y is not None:
            out.append((y[0]._replace(letter="Y"), y[1]))
        arc = (group1 if group1 is not None else self.modal) in (20, 30)
        turn = has.get("C")
        if turn is not None and not home:
            if self.polar_face:
                out.append((turn[0]._replace(letter="Y"), turn[1]))
            elif "C" in self.settings.rotary:
                out.append(turn)
            elif self.modal == 10 and (x is not None or z is not None):
                out.append((turn[0]._replace(letter=",C"), abs(turn[1])))
        for letter in ("R", ",R", ",C", "A"):
            if letter in has and not home:
                word, value = has[letter]
                if letter == "A":
                    self._angle(word, value, x, z, here, out)
                else:  # the sign of a rounding only repeats where the next line leads
                    out.append((word, value if arc or letter != "R" else abs(value)))
        if "L" in has and arc and "R" not in has and not {"I", "K"} & set(has):
            out.append((has["L"][0]._replace(letter="R"), has["L"][1]))  # Okuma
        flat = self.polar_face or (arc and "J" in has)
        at = next((w for w, v in given if w.letter == "G"), given[0][0])
        if flat or self.flat:
            out.append((at._replace(letter="G"), 17.0 if flat else 18.0))
        self.flat = flat
        if arc:
            out += [has[letter] for letter in "IJK" if letter in has]
            if self.settings.control.swapped and not flat:
                number = group1 if group1 is not None else self.modal
                out = [(w, v) for w, v in out if not (w.letter == "G" and v in (2.0, 3.0))]
                out.append((at._replace(letter="G"), 3.0 if number == 20 else 2.0))
        return out

    def _angle(
        self,
        word: Word,
        value: float,
        x: float | None,
        z: float | None,
        here: tuple[float, float],
        out: Words,
    ) -> None:
        """A: a line by its angle from +Z and one of its coordinates."""
        slope = math.tan(math.radians(value))
        if (x is None) == (z is None):
            return
        if z is None and x is not None and abs(slope) > 1e-9:
            end = here[1] + (x - here[0]) / slope
            out.append((word._replace(letter="Z", value=end), end))
        elif x is None and z is not None:
            end = here[0] + (z - here[1]) * slope
            out.append((word._replace(letter="X", value=end), end))

    def _crossing(self, angle: float, state: State) -> tuple[float, float] | None:
        """X and Z, as they are written, where a line by its angle meets the line of the next block, which has X Z A."""
        text = self.lines[self.at + 1] if self.at + 1 < len(self.lines) else ""
        words = lex_line(text).words
        has = {w.letter.removeprefix(","): w.value for w in words}
        x, z, other = (has.get(letter) for letter in "XZA")
        if x is None or z is None or other is None or self.steps or "U" in has or "W" in has:
            return None
        (s, c), (t, d) = ((math.sin(a), math.cos(a)) for a in (math.radians(angle), math.radians(other)))
        det = c * t - s * d
        if abs(det) < 1e-9:
            return None
        up0, z0 = state.program[0] / state.scale, state.program[2] / state.scale
        up, along = x * self.half - up0, z - z0
        reach = (along * t - up * d) / det
        return (up0 + reach * s) / self.half, z0 + reach * c
