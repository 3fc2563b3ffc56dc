"""The words of one block of the Fanuc family on their way to the core: a list that is edited in place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from vmachining.nc.block import Problem
from vmachining.nc.lexer import Word
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
        """Letters of the words."""
        return {word.letter for word, _ in self.pairs}

    def value(self, letter: str) -> float | None:
        """Of the first word with this letter."""
        return next((v for w, v in self.pairs if w.letter == letter), None)

    def word(self, letters: str) -> Word:
        """The first word with one of these letters."""
        return next(w for w, _ in self.pairs if w.letter in letters)

    def only(self, letters: str) -> Words:
        """The words with these letters."""
        return [(w, v) for w, v in self.pairs if w.letter in letters]

    def keep(self, word: Word, value: float) -> None:
        """Add a word with this value."""
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
