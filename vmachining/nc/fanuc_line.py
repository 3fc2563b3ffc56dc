"""The words of one block of the Fanuc family on their way to the core: a list that is edited in place."""

from __future__ import annotations

from collections.abc import Callable

from vmachining.nc.block import Problem
from vmachining.nc.lexer import Word
from vmachining.nc.state import State


class Line:
    """words, values : for the core. before, after : on the state, around the block. ahead : blocks before it.

    vector : direction of the tool that the block gives (G43.5). pivot : direction that the tool turns to first (G53.1).
    """

    __slots__ = ("after", "ahead", "before", "pivot", "problems", "values", "vector", "words")

    def __init__(self) -> None:
        self.words: list[Word] = []
        self.values: list[float] = []
        self.problems: list[Problem] = []
        self.before: list[Callable[[State], None]] = []
        self.after: list[Callable[[State], None]] = []
        self.ahead: list[list[tuple[Word, float]]] = []
        self.vector: tuple[float, float, float] | None = None
        self.pivot: tuple[float, float, float] | None = None

    def codes(self, kind: str) -> set[int]:
        """Ten times the numbers of the G or M words."""
        return {round(v * 10.0) for w, v in zip(self.words, self.values, strict=True) if w.letter == kind}

    def letters(self) -> set[str]:
        """Letters of the words."""
        return {word.letter for word in self.words}

    def value(self, letter: str) -> float | None:
        """Of the first word with this letter."""
        return next((v for w, v in zip(self.words, self.values, strict=True) if w.letter == letter), None)

    def word(self, letters: str) -> Word:
        """The first word with one of these letters."""
        return next(w for w in self.words if w.letter in letters)

    def keep(self, word: Word, value: float) -> None:
        """Add a word as it is."""
        self.words.append(word)
        self.values.append(value)

    def add(self, letter: str, value: float, like: Word) -> None:
        """Add a word that stands where another one is written."""
        self.keep(Word(letter, value, like.col, like.length, like.text), value)

    def drop(self, letters: str) -> None:
        """Take the words with these letters out."""
        for k in reversed(range(len(self.words))):
            if self.words[k].letter in letters:
                del self.words[k], self.values[k]

    def set(self, letter: str, value: float) -> None:
        """Another value for the words with this letter."""
        for k, word in enumerate(self.words):
            if word.letter == letter:
                self.values[k] = value

    def replace(self, old: int, new: int) -> None:
        """Another G code for one that is given."""
        for k, word in enumerate(self.words):
            if word.letter == "G" and round(self.values[k] * 10) == old:
                self.values[k] = new / 10.0

    def refuse(self, word: Word | None, message: str, hint: str = "") -> None:
        """The block is not executed."""
        self.problems.append(Problem("E208", word, message, hint))

    def motion(self, hooks: list[Callable[[State], None]], motion: int) -> None:
        """Around the block the motion code becomes this one."""

        def become(state: State) -> None:
            state.motion, state.cycle = motion, None

        hooks.append(become)
