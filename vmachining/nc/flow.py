"""Runs what steers: calls, loops and branches. One step per line with an O word, or with M98 or M99."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from vmachining.nc.block import Block, Problem
from vmachining.nc.control import Item, Structure
from vmachining.nc.expressions import NoValueError, evaluate
from vmachining.nc.lexer import Word
from vmachining.nc.state import Memory

MAX_DEPTH: Final = 64
"""Calls within calls; controls allow 4 to 10, a recursion written by hand ends earlier."""

MAX_COUNT: Final = 1e9


class FlowStop(Exception):  # noqa: N818 (an end, not an error of ours)
    """The program cannot continue: no end in sight."""

    def __init__(self, problem: Problem, index: int) -> None:
        super().__init__(problem.message)
        self.problem, self.index = problem, index


@dataclass(slots=True)
class Frame:
    """One call in progress. back : line to continue at. left : repetitions to come. words : local variables, of G65."""

    number: bool
    start: int
    back: int
    left: int = 1
    counts: dict[int, int] = field(default_factory=dict)
    words: dict[int, float] | None = None


class Flow:
    """Where the program goes next.

    report : takes a problem and its 0-based line.
    load : takes a label and the 0-based line that calls it, reads its file; False where none exists.
    """

    def __init__(
        self,
        structure: Structure,
        memory: Memory,
        report: Callable[[Problem, int], None],
        load: Callable[[str, int], bool],
    ) -> None:
        self.structure, self.memory, self.report, self.load = structure, memory, report, load
        self.frames: list[Frame] = []
        self.main: dict[int, int] = {}
        self.stops = sorted(structure.items)

    def origin(self, own: int, index: int) -> int:
        """0-based line of the program that led to a line; own : how many lines the program itself has."""
        if index < own:
            return index
        return next((frame.back - 1 for frame in self.frames if frame.start >= own), own - 1)

    @property
    def counts(self) -> dict[int, int]:
        """Counters of the repeat loops of the call in progress."""
        return self.frames[-1].counts if self.frames else self.main

    def step(self, item: Item) -> int:
        """Execute a line with an O word; returns the line to continue at.

        Raises FlowStop.
        """
        index, kind = item.index, item.kind
        try:
            if kind == "if":
                return self._branch(item)
            if kind in ("elseif", "else"):
                return item.end + 1
            if kind == "while":
                return index + 1 if self._value(item) else item.end + 1
            if kind == "endwhile":
                return item.start
            if kind == "until":
                return item.start + 1 if self._value(item) else index + 1
            if kind == "repeat":
                return self._repeat(item)
            if kind == "endrepeat":
                self.counts[item.start] = self.counts.get(item.start, 0) - 1
                return item.start + 1 if self.counts[item.start] > 0 else index + 1
            if kind == "call":
                return self._call(item)
        except NoValueError as exc:
            self.report(Problem("E108", item.lexed.label, str(exc)), index)
            return item.end + 1 if kind in ("if", "while", "repeat") else index + 1
        if kind == "sub":
            return item.end + 1
        if kind in ("endsub", "return"):
            return self._return(item)
        if kind == "break":
            return self.structure.items[item.start].end + 1
        if kind == "continue":
            loop = self.structure.items[item.start]
            return loop.start if loop.kind == "while" else loop.end
        return index + 1

    def _value(self, item: Item) -> float:
        return evaluate(item.lexed.arguments[0], self.memory)

    def _branch(self, item: Item) -> int:
        """The first branch whose condition holds."""
        end = item.end
        while True:
            if item.kind in ("else", "endif") or self._value(item):
                return item.index + 1
            if item.following < 0:
                return end + 1
            item = self.structure.items[item.following]

    def _repeat(self, item: Item) -> int:
        count = self._value(item)
        if not abs(count) < MAX_COUNT or abs(count - round(count)) > 1e-4:
            raise NoValueError(f"repeat needs a whole number, not {count:g}")
        self.counts[item.index] = round(count)
        return item.index + 1 if count > 0.5 else item.end + 1

    def _call(self, item: Item) -> int:
        wanted, computed = item.label, item.lexed.label.expression if item.lexed.label else None
        if computed is not None:
            wanted = f"{evaluate(computed, self.memory):.0f}"
        subs = self.structure.subs
        start = subs.get(wanted)
        if start is None and self.load(wanted, item.index):
            start = subs.get(wanted)
        if start is None:
            what = f"no subprogram {wanted} is defined in this file or in one of its own"
            self.report(Problem("E412", item.lexed.label, what), item.index)
            return item.index + 1
        values = [evaluate(argument, self.memory) for argument in item.lexed.arguments]
        self._deeper(item.index)
        self.memory.enter(values)
        self._push(Frame(False, start, item.index + 1))
        return start + 1

    def _deeper(self, index: int) -> None:
        if len(self.frames) >= MAX_DEPTH:
            what = f"calls nested deeper than {MAX_DEPTH}: does the subprogram call itself for ever?"
            raise FlowStop(Problem("E414", None, what), index)

    def _return(self, item: Item) -> int:
        if not self.frames or self.frames[-1].number:
            self.report(Problem("E415", item.lexed.label, f"{item.kind}, but nothing was called"), item.index)
            return item.index + 1
        value = None
        if item.lexed.arguments:
            try:
                value = self._value(item)
            except NoValueError as exc:
                self.report(Problem("E108", item.lexed.label, str(exc)), item.index)
        frame = self._pop(item.lexed.label, item.index)
        self.memory.leave()
        self.memory.result(value)
        return frame.back

    def _push(self, frame: Frame) -> None:
        """A call begins."""
        self.frames.append(frame)
        self.memory.state.levels += (None,)

    def _pop(self, word: Word | None, index: int) -> Frame:
        """A call ends: modes saved by M73 come back."""
        state = self.memory.state
        saved = state.levels[-1]
        if saved is not None and saved.automatic:
            if state.compensation is not None:
                what = "the modes that M73 saved cannot come back while cutter compensation is on"
                self.report(Problem("E359", word, what), index)
            else:
                state.restore()
        state.levels = state.levels[:-1]
        return self.frames.pop()

    # ---- M98, M99 ----

    def check(self, block: Block, index: int) -> Problem | None:
        """What is wrong with M98 or M99 of a block, before it runs; index : its 0-based line."""
        code, word = block.m[10]
        if code == 99:
            if not self.frames:
                return None
            return None if self.frames[-1].number else Problem("E415", word, "M99 inside an O sub")
        number, repeats = block.value("P"), block.value("L")
        label = "" if number is None else str(number).removesuffix(".0")
        if label not in self.structure.numbers and label:
            self.load(label, index)
        if label not in self.structure.numbers:
            what = (
                "M98 without P"
                if number is None
                else f"no program O{number:g} in this file or in one of its own"
            )
            return Problem("E412", block.word("P") or word, what)
        if repeats is not None and (repeats < 0.0 or repeats != int(repeats)):
            return Problem("E336", block.word("L"), f"L{repeats:g} is not a whole number of calls")
        return None

    def jump(self, block: Block, index: int) -> int | None:
        """Where M98 or M99 of a block that ran leads; None: to the start, for ever."""
        if block.m[10][0] == 98:
            given = block.value("L")
            repeats = 1 if given is None else int(given)
            if repeats == 0:
                return index + 1
            self._deeper(index)
            start = self.structure.numbers[str(block.value("P")).removesuffix(".0")]
            self._push(Frame(True, start, index + 1, repeats))
            return start + 1
        if not self.frames:
            return None
        frame = self.frames[-1]
        frame.left -= 1
        if frame.left > 0:
            frame.counts.clear()
            return frame.start + 1
        self._pop(block.m[10][1], index)
        return frame.back
