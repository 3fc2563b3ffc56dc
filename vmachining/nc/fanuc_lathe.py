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

from vmachining.nc.block import Problem, spell
from vmachining.nc.fanuc_lathe_cycles import HOLES, MANY, PASSES, Cycles, Find, Turned
from vmachining.nc.fanuc_line import Line, Words
from vmachining.nc.fanuc_lines import has_system_b
from vmachining.nc.frames import PLANES
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

    def translate(self, block: Words, state: State) -> Line:
        self.runs = None
        if self.leaves_out(self.at):
            return Line([], state)
        if self.least:
            block = [(w, v if w.letter == "Q" else self._counted(w, v, state)) for w, v in block]
        least, self.least = self.least, 0.0
        try:
            return self._block(Turned(self._spelt(block), state))
        finally:
            self.least = least

    def _spelt(self, given: Words) -> Words:
        """Words of one meaning by one name: ,A is A; on Okuma G4 F is G4 X, and L of G75 and G76 a chamfer or a rounding."""
        given = [(w._replace(letter="A") if w.letter == ",A" else w, v) for w, v in given]
        # G83.5, G87.6 and the like peck in other ways to the same depth
        given = [
            (w, float(int(v)) if w.letter == "G" and int(v) in (83, 84, 87, 88) else v) for w, v in given
        ]
        codes = {round(v * 10.0) for w, v in given if w.letter == "G"}
        has = {w.letter for w, _ in given}
        if self.variant == "okuma" and "L" in has and codes & {750, 760}:  # of any motion
            mark = ",R" if 760 in codes else ",C"
            given = [(w, v) for w, v in given if not (w.letter == "G" and v in (75.0, 76.0))]
            given = [(w._replace(letter=mark) if w.letter == "L" else w, v) for w, v in given]
        if 40 in codes and "F" in has and not {"P", "X", "U"} & has:
            given = [
                (w._replace(letter="X", text=w.text + ".") if w.letter == "F" else w, v) for w, v in given
            ]
        return given

    def _block(self, b: Turned) -> Line:
        given, has, codes, state = b.written, b.given, b.codes, b.state
        if not has and not codes:
            return super().translate(given, state)
        alone = "A" in has and not b.has("XZUWYI") and not codes - {10} and (codes or self.modal == 10)
        if alone and (meets := self._crossing(b.get("A"), state)) is not None:
            like = has.pop("A")[0]
            ends = [(like._replace(letter=letter), v) for letter, v in zip("XZ", meets, strict=True)]
            has |= {w.letter: (w, v) for w, v in ends}
            given = b.written = [*((w, v) for w, v in given if w.letter != "A"), *ends]
        if (refused := self._unread(b)) is not None:
            b.problems = [refused]
            return b
        kind = b.get("L") if "L" in has else None
        if 100 in codes and "P" in has and kind in (None, 2.0, 20.0):
            if kind is not None or b.get("P") == 0.0:
                what = (
                    "a shift of the work zero is left out: what is cut after it lies where it would without"
                )
                self.note(Problem("W368", given[0][0], what, "write the program from one zero"))
            else:
                self.say("G10", given[0][0], "G10 P: tool offsets are those of the job")
            return Line([], state)
        if 40 in codes:
            return super().translate(given, state)
        if "H" in has and "C" not in has and not codes & MANY.keys():  # a step of C
            c = state.rotary.get("c", 0.0) - state.rotary_shift("c") + b.get("H")
            has["C"] = has["H"][0]._replace(letter="C"), c
        if codes & {960, 970}:  # and the S that belongs to them
            self.constant = 960 in codes
        if "S" in has and self.constant and not codes & {500, 920}:
            self.surface = b.get("S")
        for place, step in (("X", "U"), ("Z", "W")):
            if place in has and step in has and not codes & MANY.keys():
                what = f"{place} and {step} name one axis, by its place and by a step"
                b.refuse(has[step][0], what, "keep one of the words")
                return b
        kept = self._modes(b)
        self._goal(b)
        passes = (c for c in codes if c in PASSES or (c in (900, 940, 920) and self._is_pass(c, b)))
        single = next((PASSES.get(c, c) for c in passes), 0)
        group1 = next((MOVES[c] for c in codes if c in MOVES), None)
        if group1 is not None or codes & ({700, 800} | HOLES.keys() | MANY.keys()):
            self.once, self.hole = None, self.hole if codes & HOLES.keys() else {}
            self.modal = self.modal if group1 is None else group1
        if codes & {170, 180, 190} and group1 is None and b.has("ABP") and not self.polar_face:
            # lines by angles, of other controls
            b.refuse(next(w for w, v in given if w.letter == "G"), "a plane with words of a contour")
            return b
        many = next((c for c in codes if c in MANY and not (c in (850, 860) and "P" not in has)), 0)
        if codes & {700, 710} and not b.has("PQUWDR"):
            many, codes = 0, codes - {700, 710}  # units
            b.codes = codes
        home = bool(codes & {280, 300, 530})
        if 530 in codes and not codes & {280, 300} and (self.modal if group1 is None else group1):
            what = "G53 with a cut: it goes where the words say, as without G53, because lathes do not cut to machine positions"
            self.say("G53 cut", b.of(530), what, "W366")
            home = False
        moves = b.has("XZUW") and not home
        hole = bool(codes & HOLES.keys())
        if single or (self.once is not None and moves and not codes & {500, 920}):
            self._single(single, b)
        elif (many or 700 in codes or (870 in codes and "P" in has and "X" not in has)) and not (
            hole and "Z" in has
        ):
            kept = [(w, v) for w, v in kept if w.letter != "F" or many != 760]  # F of a thread is its lead
            out = super().translate(kept, state)
            self._many(many, b, out)
            out.before[:0] = b.before
            return out
        elif (hole or self.hole) and not home and b.has("XZCUWH"):
            self._hole(b)
        elif self.modal == 320 and moves:
            lead = has.get("F") or has.get("K") or has.get("I") or has.get("E")
            self._threading(lead[1] if lead else None, b)
            b.straight(10, b.x, b.z)
        else:
            kept += self._motion(b, home)
        if self.constant and self.surface and (b.has("XU") or 960 in codes):
            x = b.here[0]
            b.become(b.before, speed=self._rpm(abs(x + (b.x if b.x is not None else x)) / 2.0, b))
        out = super().translate(kept, state)
        out.before[:0] = b.before
        out.ahead += b.ahead
        out.after += b.after
        return out

    def _unread(self, b: Turned) -> Problem | None:
        """What would be read as something else: codes of Okuma, steps of G50, angles and lengths of C and Y."""
        codes, has, okuma = b.codes, b.given, self.variant == "okuma"
        many = codes & (MANY.keys() | {700, 870, 1160})
        first = next((w for w, _ in b.written if w.letter == "G"), b.written[0][0])
        words = {k: word for k, (word, _) in has.items()}

        def refused(what: str, word: Word = first, hint: str = "", *, plain: bool = False) -> Problem:
            return Problem("E208", word, what if plain else f"{what} is not supported", hint)

        lap = codes & {850, 860, 870} and "P" in has
        if okuma:
            code = next((c for c in codes if c in OKUMA or (c in HOLES and not lap)), None)
            if code is not None and not (code in (750, 760) and "L" in has):
                return refused(f"{spell('G', code)} of Okuma ({OKUMA.get(code, 'a cycle')})")
            if 500 in codes and b.has("XZUW"):
                return refused("G50 of Okuma with axis words (a shift of the zero)")
            if not many and b.has("UW"):
                what = f"{words.get('U', words.get('W', first)).text}: U and W of Okuma are axes, which are not supported"
                return refused(what, plain=True)
        hole = next((HOLES[c] for c in codes if c in HOLES and not (c in (850, 860, 870) and "P" in has)), "")
        if hole and b.has("XZUWCH") and not b.has("XU" if hole == "X" else "ZW"):
            return refused(f"{first.text} without the depth of its hole, {hole}", plain=True)
        if (500 in codes or (920 in codes and self.system_b)) and b.has("UW"):
            return refused(f"{first.text} with U or W (a shift of the zero by a step)")
        if codes & {131, 1130} and abs(b.state.program[1]) > 1e-6:
            what = f"{first.text} where C is not zero: the place of X and C after it is not read"
            return refused(what, hint="end polar interpolation at C0", plain=True)
        steps = 910 in codes or (self.steps and 900 not in codes)
        if "V" in has or (steps and b.has("CY")) or ("H" in has and self.polar_face):
            word = next(words[k] for k in "VCYH" if k in words)
            return refused(f"{word.text}: a step of Y, or of C where it is a length or under G91,", word)
        if "H" in has and not many and "C" not in self.settings.rotary:
            what = f"{words['H'].text}: H is a step of C, which this lathe does not have"
            return refused(what, words["H"], plain=True)
        curved = codes & (MANY.keys() | HOLES.keys() | PASSES.keys() | {40, 280, 300, 530, 170, 180, 190})
        if "A" in has and not curved and self.once is None and not self.hole:
            x, z, angle = b.has("XU"), b.has("ZW"), math.radians(b.get("A"))
            across, along = abs(math.cos(angle)) < 1e-9, abs(math.sin(angle)) < 1e-9
            if not (x or z) or (not z and along) or (not x and across):
                what = f"{words['A'].text}: the end of a line by its angle is not determined in its block"
                return refused(what, words["A"], "write X and Z", plain=True)
        return None

    def _is_pass(self, code: int, b: Turned) -> bool:
        """Whether G90, G94 or G92 is a pass of system A, not a mode of system B."""
        if self.system_b or b.codes & MOVES.keys() or not b.has("XUZW"):
            return False
        return not (code == 920 and "S" in b.given)

    def _modes(self, b: Turned) -> Words:
        """Words for the core without those of the lathe."""
        codes, kept = b.codes, Words()
        for word, value in b.written:
            letter = word.letter
            if letter == "G":
                kept += self._mode(word, round(value * 10.0), b)
            elif letter == "T":
                number = int(value) // 100 if value >= 100.0 else int(value)
                if self.variant == "okuma":  # T010203: nose, tool, register
                    number %= 100
                if number:
                    b.become(b.before, tool=number)
            elif letter == "S":
                if not codes & {500, 920} and not self.constant:
                    kept.append((word, value))
            elif (
                letter in "FN" or (letter == "M" and value != 6.0) or (letter == "P" and codes & {541, 1540})
            ):
                kept.append((word, value))
        return kept

    def _mode(self, word: Word, code: int, b: Turned) -> Words:
        system = {980: 94.0, 990: 95.0}
        own = code in OWN or (code == 820 and self.variant == "okuma")
        if code in (940, 950):
            return [] if self._is_pass(code, b) else [(word, code / 10.0)]
        if code in system:
            return [] if self.system_b else [(word._replace(value=system[code]), system[code])]
        if code in (900, 910):
            if not self._is_pass(code, b):
                self.steps = code == 910
        elif code == 920 and self._is_pass(code, b):
            return []
        elif code in (410, 420):
            what = (
                f"{word.text}: the radius of the nose is not known; the path is that of the programmed point"
            )
            self.say("nose", word, what, "W351")
        elif code in (121, 1120, 131, 1130):
            self.polar_face = code in (121, 1120)
        elif code in (500, 920) and (self.system_b or code == 500):
            if "S" in b.given:
                self.limit = b.get("S")
            if b.has("XZ"):
                return [(word._replace(value=92.0), 92.0)]
        elif not own or (code in (700, 710) and not b.has("PQUWDR")):
            return [(word, code / 10.0)]
        return []

    def _rpm(self, radius: float, b: Turned) -> float:
        """Of G96 at a radius in units of the program."""
        assert self.surface is not None
        around = 2.0 * math.pi * radius
        wanted = self.surface * (12.0 if b.scale != 1.0 else 1000.0) / around if around > 0.0 else math.inf
        if self.limit is None and wanted > FASTEST_RPM:
            what = f"G96 without a limit by G50 S: the spindle is assumed to turn at {FASTEST_RPM:g} rev/min at most"
            self.say("G96 limit", b.like, what, "I213")
        return min(wanted, FASTEST_RPM if self.limit is None else self.limit)

    def _goal(self, b: Turned) -> None:
        """Radius and Z that the block names."""

        def along(place: str, step: str, factor: float, here: float) -> float | None:
            if place in b.given:
                return b.get(place) * factor + (here if self.steps else 0.0)
            return here + b.get(step) * factor if step in b.given else None

        b.x, b.z = along("X", "U", self.half, b.here[0]), along("Z", "W", 1.0, b.here[1])

    # ---- motions ----

    def _motion(self, b: Turned, home: bool) -> Words:
        """Words of a plain motion for the core."""
        given, has, (x, z) = b.written, b.given, (b.x, b.z)
        out = [(w, v) for w, v in given if w.letter == "G" and round(v * 10.0) in (0, 10, 20, 30)]
        number = next((MOVES[c] for c in b.codes if c in MOVES), self.modal)
        places = {"X": x, "Z": z}
        if home and 530 in b.codes and (x is not None or z is not None):
            # G53 too goes to the machine's own places, which are not known
            out.append((b.of(530)._replace(value=28.0), 28.0))
            places = {"X": None if x is None else b.here[0], "Z": None if z is None else b.here[1]}
        marks = {w.letter: w for w, _ in given}
        for letter, other in (("X", "U"), ("Z", "W")):
            goal = places[letter]
            if goal is not None:
                like = marks.get(letter) or marks.get(other) or given[0][0]
                out.append((like._replace(letter=letter, value=goal), goal))
        arc = number in (20, 30)
        if not home:
            out += self._beside(b, arc)
        if "L" in has and arc and "R" not in has and not b.has("IK"):
            out.append((has["L"][0]._replace(letter="R"), b.get("L")))  # Okuma
        flat = self.polar_face or (arc and "J" in has)
        at = next((w for w, v in given if w.letter == "G"), given[0][0])
        if flat or self.flat:
            out.append((at._replace(letter="G"), 17.0 if flat else 18.0))
        self.flat = flat
        if arc:
            out += [has[letter] for letter in "IJK" if letter in has]
            if self.settings.control.swapped and not flat:
                out = [(w, v) for w, v in out if not (w.letter == "G" and v in (2.0, 3.0))]
                out.append((at._replace(letter="G"), 3.0 if number == 20 else 2.0))
        return out

    def _beside(self, b: Turned, arc: bool) -> Words:
        """Y, C, and the words of corners and angles of a motion."""
        out = Words()
        if "Y" in b.given:
            out.append((b.given["Y"][0]._replace(letter="Y"), b.get("Y")))
        if "C" in b.given:
            word, value = b.given["C"]
            if self.polar_face:
                out.append((word._replace(letter="Y"), value))
            elif "C" in self.settings.rotary:
                out.append((word, value))
            elif self.modal == 10 and (b.x is not None or b.z is not None):
                out.append((word._replace(letter=",C"), abs(value)))
        for letter in ("R", ",R", ",C"):  # the sign of a rounding only repeats where the next line leads
            if letter in b.given:
                word, value = b.given[letter]
                out.append((word, value if arc or letter != "R" else abs(value)))
        if "A" in b.given and (b.x is None) != (b.z is None):  # a line by its angle from +Z
            word, value = b.given["A"]
            slope = math.tan(math.radians(value))
            if b.x is None and b.z is not None:
                end = b.here[0] + (b.z - b.here[1]) * slope
                out.append((word._replace(letter="X", value=end), end))
            elif b.x is not None and abs(slope) > 1e-9:
                end = b.here[1] + (b.x - b.here[0]) / slope
                out.append((word._replace(letter="Z", value=end), end))
        return out

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
