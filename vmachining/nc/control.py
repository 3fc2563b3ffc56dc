"""Lines that steer: which O words belong together, found before anything runs.

    o<name> sub ... o<name> endsub [value]     o<name> call [1] [2]     o<name> return [value]
    o1 if [..] / o1 elseif [..] / o1 else / o1 endif
    o1 while [..] ... o1 endwhile     o1 do ... o1 while [..]     o1 repeat [n] ... o1 endrepeat
    o[#1 + 2] call [3]     o1 break     o1 continue          O100 ... M99, called by M98 P100 L3

A label pairs its lines; pairs lie within each other and do not cross. What does not fit is a problem of its
line (E411, E416) and steers nothing.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

from vmachining.nc.block import Problem
from vmachining.nc.lexer import LexedLine, LexError, Word, lex_line

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
    found = list(_steering_lines(text, first))
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
            structure.problems += [(index, _unread(error)) for error in lexed.errors]
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


def _unread(error: LexError) -> Problem:
    """What the lexer found, as a problem of its line."""
    return Problem(
        error.code, Word("O", None, error.col, error.length, error.text[:60]), error.message, error.hint
    )


def _steering_lines(text: str, first: int) -> Iterator[int]:
    line, at = first, 0
    for found in _STEERS.finditer(text):
        line += text.count("\n", at, found.start())
        at = found.start()
        yield line


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
