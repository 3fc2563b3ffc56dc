"""Lines that steer: which O words belong together, found before anything runs; then calls, loops and branches.

    o<name> sub ... o<name> endsub [value]     o<name> call [1] [2]     o<name> return [value]
    o1 if [..] / o1 elseif [..] / o1 else / o1 endif
    o1 while [..] ... o1 endwhile     o1 do ... o1 while [..]     o1 repeat [n] ... o1 endrepeat
    o[#1 + 2] call [3]     o1 break     o1 continue          O100 ... M99, called by M98 P100 L3

A label pairs its lines; pairs lie within each other and do not cross. What does not fit is a problem of its
line (E411, E416) and steers nothing.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Final

from vmachining.nc.block import Block, Problem
from vmachining.nc.expressions import NoValueError, evaluate
from vmachining.nc.lexer import LexedLine, LexError, Word, lex_line
from vmachining.nc.state import Memory

MAX_ARGUMENTS: Final = 30
_STEERS: Final = re.compile(r"^[ \t]*/?[ \t]*(?:[Nn][ \t0-9]*)?[oO:]", re.MULTILINE)
_M98: Final = re.compile(r"[Mm][ \t0]*9[ \t]*[89](?![0-9.])")
_ARGUMENTS: Final = {
    "if": (1, 1), "elseif": (1, 1), "while": (1, 1), "repeat": (1, 1), "call": (0, MAX_ARGUMENTS),
    "return": (0, 1), "endsub": (0, 1),
}  # fmt: skip
_LOOPS: Final = frozenset({"while", "do", "repeat"})
_VALUED: Final = frozenset({"if", "elseif", "while", "until", "repeat", "call"})
"""What cannot steer without its values."""

_CLOSES: Final = {"endsub": "sub", "endif": "if", "endwhile": "while", "endrepeat": "repeat"}


@dataclass(slots=True)
class Item:
    """A line with an O word.

    index : 0-based line. kind : its control word, "number" for a program number, "until" for the while that
    closes a do, "broken" for a line that steers nothing. start, end : lines of the pair it belongs to.
    following : next elseif, else or endif of the same if. wrong : its values cannot be read, which is reported; its
    pair is known anyway, and not to blame.
    """

    index: int
    kind: str
    label: str
    lexed: LexedLine
    start: int = -1
    end: int = -1
    following: int = -1
    wrong: bool = False


@dataclass(slots=True)
class Structure:
    """Everything that steers. subs, numbers : label -> line of `sub`, of a program number."""

    items: dict[int, Item] = field(default_factory=dict)
    subs: dict[str, int] = field(default_factory=dict)
    numbers: dict[str, int] = field(default_factory=dict)
    problems: list[tuple[int, Problem]] = field(default_factory=list)

    def add(self, other: Structure) -> None:
        """What steers in another file; labels that are known already stay what they are."""
        self.items.update(other.items)
        self.problems += other.problems
        for table, more in ((self.subs, other.subs), (self.numbers, other.numbers)):
            for label, index in more.items():
                table.setdefault(label, index)

    def refuse(self, item: Item, code: str, message: str) -> None:
        """The line steers nothing, and why."""
        item.kind = "broken"
        self.problems.append((item.index, Problem(code, item.lexed.label, message)))


def label_of(word: Word) -> str:
    """`o 0100` and `O100` are one label, names mind neither blanks nor case."""
    if word.value is not None:
        return str(int(word.value))
    return re.sub(r"[ \t]", "", word.text[1:]).lower()


def find_structure(lines: Sequence[str], first: int, stop: int) -> Structure | None:
    """The structure of lines first..stop-1; None where nothing steers."""
    text = "\n".join(lines[first:stop])
    found, line, at = list[int](), first, 0
    for hit in _STEERS.finditer(text):
        line, at = line + text.count("\n", at, hit.start()), hit.start()
        found.append(line)
    if not found and _M98.search(text) is None:
        return None
    structure = Structure()
    for index in found:
        lexed = lex_line(lines[index])
        if lexed.label is None or (lexed.errors and lexed.flow is None):
            continue  # an ordinary wrong line
        item = Item(index, lexed.flow or "number", label_of(lexed.label), lexed)
        structure.items[index] = item
        if lexed.errors:
            item.wrong = True
            structure.problems += [(index, unread(error)) for error in lexed.errors]
            continue
        few, many = _ARGUMENTS.get(item.kind, (0, 0))
        if lexed.label.expression is not None and item.kind != "call":
            structure.refuse(item, "E416", "only call takes a label that is computed")
        elif item.kind != "number" and not few <= len(lexed.arguments) <= many:
            wanted = f"{few}" if few == many else f"at most {many}"
            what = f"{item.kind} takes {wanted} values in brackets, {len(lexed.arguments)} are given"
            item.wrong = True
            structure.problems.append((index, Problem("E416", lexed.label, what)))
    _pair(structure)
    return structure


def unread(error: LexError) -> Problem:
    """What the lexer found, as a problem of its line."""
    word = Word("O", None, error.col, error.length, error.text[:60])
    return Problem(error.code, word, error.message, error.hint)


def _pair(structure: Structure) -> None:
    opened: list[Item] = []
    branches: dict[int, Item] = {}
    for item in structure.items.values():
        kind = item.kind
        if kind == "number":
            _define(structure, structure.numbers, item)
        elif kind == "sub":
            if any(other.kind == "sub" for other in opened):
                structure.refuse(item, "E411", "a subprogram cannot be defined inside another one")
                continue
            _define(structure, structure.subs, item)
            opened.append(item)
        elif kind == "while" and opened and (opened[-1].kind, opened[-1].label) == ("do", item.label):
            item.kind = "until"
            _close(opened.pop(), item)
        elif kind in ("if", "while", "do", "repeat"):
            opened.append(item)
            branches[item.index] = item
        elif kind in _CLOSES or kind in ("elseif", "else"):
            wanted = _CLOSES.get(kind, "if")
            if not opened or (opened[-1].kind, opened[-1].label) != (wanted, item.label):
                structure.refuse(item, "E411", f"{kind} without its {wanted}")
                continue
            head = opened[-1]
            if kind in ("elseif", "else"):
                last = branches[head.index]
                if last.kind == "else":
                    structure.refuse(item, "E411", f"{kind} behind else")
                    continue
                last.following, item.start = item.index, head.index
                branches[head.index] = item
                continue
            if wanted == "if":
                branches[head.index].following = item.index
            _close(opened.pop(), item)
        elif kind in ("break", "continue"):
            loop = next((o for o in reversed(opened) if o.kind in _LOOPS and o.label == item.label), None)
            if loop is None:
                structure.refuse(item, "E411", f"{kind} outside a loop of its label")
            else:
                item.start = loop.index
        elif kind == "return" and not any(other.kind == "sub" for other in opened):
            structure.refuse(item, "E411", "return outside a subprogram")  # its label means nothing
    for item in opened:
        structure.refuse(item, "E411", f"{item.kind} is never closed")
        structure.subs = {label: at for label, at in structure.subs.items() if at != item.index}
    wrong = {
        item.start if item.start >= 0 else item.index
        for item in structure.items.values()
        if item.wrong and item.kind in _VALUED
    }
    for item in structure.items.values():
        if item.index in wrong or item.start in wrong:
            item.kind = "broken"
    for item in structure.items.values():  # what belongs to a broken line steers nothing either
        if item.start >= 0 and structure.items[item.start].kind == "broken" and item.kind != "broken":
            structure.refuse(item, "E411", f"{item.kind} of a {item.lexed.flow} that is never closed")
        if item.start >= 0 and item.kind in ("elseif", "else"):
            item.end = structure.items[item.start].end


def _define(structure: Structure, table: dict[str, int], item: Item) -> None:
    if item.label in table:
        what = f"O{item.label} is defined in line {table[item.label] + 1} already"
        code = "E411"
        if table is structure.numbers:
            code, what = "W411", f"{what}: M98 goes there"
        structure.problems.append((item.index, Problem(code, item.lexed.label, what)))
    else:
        table[item.label] = item.index


def _close(head: Item, tail: Item) -> None:
    head.start = tail.start = head.index
    head.end = tail.end = tail.index


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
    load : takes a label and the 0-based line that calls it, reads its file, if one exists.
    """

    def __init__(
        self,
        structure: Structure,
        memory: Memory,
        report: Callable[[Problem, int], None],
        load: Callable[[str, int], None],
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
        if wanted not in subs:
            self.load(wanted, item.index)
        if (start := subs.get(wanted)) is None:
            what = f"no subprogram {wanted} is defined in this file or in a separate one"
            self.report(Problem("E412", item.lexed.label, what), item.index)
            return item.index + 1
        values = [evaluate(argument, self.memory) for argument in item.lexed.arguments]
        self._push(Frame(False, start, item.index + 1))
        self.memory.enter(values)
        return start + 1

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
        if len(self.frames) >= MAX_DEPTH:
            what = f"calls nested deeper than {MAX_DEPTH}: does the subprogram call itself for ever?"
            raise FlowStop(Problem("E414", None, what), frame.back - 1)
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
            what = "M98 without P"
            if number is not None:
                what = f"no program O{number:g} in this file or in a separate one"
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
