"""The words of one block of the Fanuc family on their way to the core: a list that is edited in place.

Registers of tools, H and D, with what G10 and system variables write into them; and what is said once.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from vmachining.nc.block import Problem
from vmachining.nc.lexer import Word
from vmachining.nc.settings import Settings, ToolEntry
from vmachining.nc.state import State

Words = list[tuple[Word, float]]
Hooks = list[Callable[[State], None]]


class Line:
    """A block as it is written, and what the core gets of it.

    state : before the block. codes : ten times the G numbers that are written. given : words by letter, without G M N;
    axes : letters of places among them; taken : letters that its codes have used up. pairs : for the core. before, after :
    on the state, around the block. ahead : blocks before it.
    vector : direction of the tool that the block gives (G43.5). pivot : direction that the tool turns to first (G53.1).
    """

    def __init__(self, written: Words, state: State) -> None:
        self.written, self.state = written, state
        self.codes = {round(v * 10.0) for w, v in written if w.letter == "G"}
        self.given = {w.letter: (w, v) for w, v in written if w.letter not in "GMN"}
        self.axes = set(self.given) & set("XYZABC")
        self.taken: set[str] = set()
        self.pairs: Words = []
        self.problems: list[Problem] = []
        self.before: Hooks = []
        self.after: Hooks = []
        self.ahead: list[Words] = []
        self.vector: tuple[float, float, float] | None = None
        self.pivot: tuple[float, float, float] | None = None

    # ---- as it is written ----

    def has(self, letters: str) -> bool:
        """Whether a word with one of these letters is written."""
        return any(letter in self.given for letter in letters)

    def get(self, letter: str, default: float = 0.0) -> float:
        """Number of a word that is written."""
        return self.given[letter][1] if letter in self.given else default

    def switches(self, *numbers: float) -> bool:
        """Whether an M code with one of these numbers is written."""
        return any(w.letter == "M" and v in numbers for w, v in self.written)

    @property
    def absolute(self) -> bool:
        """Whether its places are coordinates."""
        return 900 in self.codes or (self.state.absolute and 910 not in self.codes)

    def at(
        self, letters: str = "XYZ", default: tuple[float, ...] = (0.0, 0.0, 0.0)
    ) -> tuple[float, float, float]:
        """Three words that are written as lengths in mm."""
        x, y, z = (
            self.get(c) * self.state.scale if c in self.given else d
            for c, d in zip(letters, default, strict=True)
        )
        return x, y, z

    # ---- for the core ----

    def now(self, kind: str = "G") -> set[int]:
        """Ten times the numbers of the G or M words."""
        return {round(v * 10.0) for w, v in self.pairs if w.letter == kind}

    def letters(self) -> set[str]:
        return {word.letter for word, _ in self.pairs}

    def value(self, letter: str) -> float | None:
        return next((v for w, v in self.pairs if w.letter == letter), None)

    def word(self, letters: str) -> Word:
        return next(w for w, _ in self.pairs if w.letter in letters)

    def only(self, letters: str) -> Words:
        return [(w, v) for w, v in self.pairs if w.letter in letters]

    def keep(self, word: Word, value: float) -> None:
        self.pairs.append((word, value))

    def add(self, letter: str, value: float, like: Word) -> None:
        """Add a word that stands where another one is written."""
        self.keep(Word(letter, value, like.col, like.length, like.text), value)

    def drop(self, letters: str) -> None:
        """Take the words with these letters out."""
        self.pairs = [(w, v) for w, v in self.pairs if w.letter not in letters]

    def replace(self, old: int, new: int) -> None:
        """Another G code for one that is given."""
        for k, (word, value) in enumerate(self.pairs):
            if word.letter == "G" and round(value * 10) == old:
                self.pairs[k] = word, new / 10.0

    def refuse(self, word: Word | None, message: str, hint: str = "") -> None:
        """The block is not executed."""
        self.problems.append(Problem("E208", word, message, hint))

    @staticmethod
    def become(hooks: Hooks, **fields: Any) -> None:
        """Before or after the block these fields of the state have these values."""

        def act(state: State) -> None:
            for name, value in fields.items():
                setattr(state, name, value)

        hooks.append(act)

    @staticmethod
    def choose(hooks: Hooks, work: int) -> None:
        """Before or after the block this work offset is in force; beyond the nine of the core they count from 100000."""

        def act(state: State) -> None:
            state.work = work
            state.place_offsets()

        hooks.append(act)

    def motion(self, hooks: Hooks, motion: int) -> None:
        """Around the block the motion code becomes this one."""
        self.become(hooks, motion=motion, cycle=None)


class Registers:
    """What a program sets in them."""

    def __init__(self, settings: Settings, note: Callable[[Problem], None]) -> None:
        self.variant, self.settings, self.note = settings.dialect, settings, note
        self.said: set[str] = set()
        self.radii: dict[int, float] = {}
        """That the program sets, mm, by their system variable: geometry from #13001, wear from #12001 on."""

    def say(self, key: str, word: Word | None, text: str, code: str = "I214") -> None:
        """A note, once for each key."""
        if key not in self.said:
            self.said.add(key)
            self.note(Problem(code, word, text))

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
        tools = out.only("T")
        if len(tools) != 2 or 60 not in out.now("M"):
            return
        (_, (like, second)) = tools
        out.pairs.remove((like, second))
        what = "two T words with M6: the first tool is loaded, the second is staged"
        self.say("T T", like, what, "I213")
        if second == int(second) >= 0:
            out.become(out.after, selected=int(second))

    def _tool_words(self, out: Line) -> None:
        """H and D are registers: they hold what belongs to the tool in the spindle."""
        self._two_tools(out)
        state = out.state
        tool = state.tool
        if 60 in out.now("M"):
            if "T" not in out.letters() and state.selected is None:
                change = next((w, v) for w, v in out.pairs if w.letter == "M" and v == 6.0)
                self.say("M6", change[0], "M6 before any T: the tool in the spindle stays", "I213")
                out.pairs.remove(change)
            tool = int(out.value("T") or state.selected or 0)
        has = out.letters()
        codes = out.codes | out.now()
        if "H" in has:
            number, like = out.value("H"), out.word("H")
            out.drop("H")
            if number == 0.0 and codes & {430, 440}:
                for code in (430, 440):
                    out.replace(code, 490)
            elif number == 0.0 and any(state.length) and 490 not in codes:
                out.add("G", 49.0, like)  # under G43 register 0 holds no length
            elif number != tool and tool:
                what = f"{like.text}: a register of tool lengths; the one of the tool in the spindle is taken"
                self.say("H", like, what)
        if 440 in codes:
            out.replace(440, 430)
        if not codes & {410, 420}:
            out.drop("D")
            return
        own = int(out.value("D") or 0.0) if "D" in has else None
        like = out.word("D") if own is not None else next(w for w, _ in out.pairs if w.letter == "G")
        wear = self.settings.control.compensation == "wear"
        radius = self.own_radius(own or 0, state.table.get(tool))
        out.drop("D")
        if radius is not None or own == 0 or wear:
            for old, new in ((410, 411), (420, 421)):
                out.replace(old, new)
            out.add("D", 2.0 * (radius or 0.0) / state.scale, like)
        elif own is not None and own != tool and tool:
            what = f"{like.text}: a register of tool radii; the radius of the tool in the spindle is taken"
            self.say("D", like, what)
        elif self.settings.tools is not None and self.settings.control.compensation == "":
            what = (
                f"{like.text}: the radius of the tool in the spindle is taken; where the program is the path of the "
                'tool centre and D holds its wear, say compensation = "wear"'
            )
            self.say("D", like, what, "I213")
