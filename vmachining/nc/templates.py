"""Lines with parameters and expressions for the short cut: lines that differ in their numbers only share one compiled function.

A line is lexed and parsed the long way once; what its numbers become is written as a Python function of them. Where a value
does not exist, or a line holds more than `quick.BLOCK`, the long way is taken, which says why.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from typing import Any, Final

from vmachining.nc.expressions import BINARY, FANUC, FUNCTIONS, Expression, Name, NoValueError
from vmachining.nc.fanuc_variables import FAMILY_FREE
from vmachining.nc.lexer import MAX_VALUE, Assignment, Word, lex_line
from vmachining.nc.state import LAST_FREE, Memory

_NUMBER: Final = re.compile(r"([0-9]+\.?[0-9]*|\.[0-9]+)")
_LETTERS: Final = "NGXYZABCIJKF"
_NATIVE: Final = ("+", "-", "*")
MOST: Final = 5000
"""Templates that are kept; a program has some dozen, a damaged one may have as many as lines."""

Compiled = Callable[
    [list[float], Callable[[float], float], dict[str, float]],
    tuple[tuple[float | None, ...], tuple[Any, ...]],
]


def _whole(value: float) -> int:
    number = int(value)
    if number != value:
        raise _LongWayError
    return number


_NAMES: Final[tuple[dict[str, Any], ...]] = tuple(
    {
        "__builtins__": {},
        "binary": {op: function for op, (_, function) in BINARY.items()},
        "call": {**functions, "ATAN": lambda y, x: math.degrees(math.atan2(y, x))},
        "whole": _whole,
    }
    for functions in (FUNCTIONS, FANUC)
)
"""All that the source of a line can name; it is made of parsed nodes, never of text of the program."""


class _LongWayError(Exception):
    """The line is for the long way."""


class Templates:
    """The functions of the lines seen so far, for one memory."""

    def __init__(self, memory: Memory) -> None:
        self.memory = memory
        self.known: dict[tuple[str, ...], tuple[Compiled, int] | None] = {}
        self.limit = limit = FAMILY_FREE if memory.family else LAST_FREE + 1
        numbers = memory.values

        def read(value: float) -> float:
            number = int(value)
            if number != value or not 0 < number < limit:
                raise _LongWayError
            return numbers[number] if memory.family else numbers.get(number, 0.0)

        self.read = read

    def words(self, line: str) -> tuple[tuple[Any, ...], tuple[tuple[str | int, float], ...]] | None:
        """Values of a line in the order of `quick.BLOCK`, its assignments; None for the long way."""
        parts = _NUMBER.split(line)
        key = tuple(parts[::2])
        try:
            known = self.known[key]
        except KeyError:
            known = None
            if len(self.known) < MOST:
                known = self.known[key] = _compiled(line, parts[1::2], self.memory.family)
        if known is None:
            return None
        function, code = known
        try:
            values, writes = function(list(map(float, parts[1::2])), self.read, self.memory.names)
            for value in values:
                if value is not None and not -MAX_VALUE <= value <= MAX_VALUE:
                    return None
            for target, value in writes:
                if not -math.inf < value < math.inf or (
                    target.__class__ is not str and not 0 < target < self.limit
                ):
                    return None
        except (_LongWayError, NoValueError, OverflowError, KeyError, ValueError):
            return None
        number = None
        if values[0] is not None:
            number = parts[1]
            if len(number) > 9 or "." in number:
                return None
        return (number, None if code < 0 else parts[2 * code + 1], *values[2:]), writes


def _compiled(line: str, numbers: list[str], family: bool) -> tuple[Compiled, int] | None:
    """The function of a line, and which of its numbers is the G code (-1: none)."""
    if family and "ROUND" in line.upper():  # in a word it goes to least increments
        return None
    lexed = lex_line(line)
    letters = [word.letter for word in lexed.words]
    if (
        lexed.errors or lexed.comments or lexed.label or lexed.block_delete or lexed.percent
        or len(set(letters)) < len(letters) or not set(letters) <= set(_LETTERS)
    ):  # fmt: skip
        return None
    written, code = iter(range(len(numbers))), -1
    words, writes = dict[str, str](), list[str]()
    try:
        items: list[Word | Assignment] = [*lexed.words, *lexed.assignments]
        for item in sorted(items, key=lambda item: item.col):
            if isinstance(item, Assignment):
                target = repr(item.target.name)
                if item.target.name is None:
                    assert item.target.number is not None
                    target = f"whole({_source(item.target.number, written, numbers)})"
                elif item.target.name.startswith("_"):
                    return None
                writes.append(f"({target}, {_source(item.value, written, numbers)}),")
                continue
            if item.letter == "N" and not item.text[1:].lstrip(" \t")[:1].isdigit():
                return None  # N[1], N-1: no number of a block
            if item.letter == "G":
                code = next(written)
                if (
                    item.expression is not None
                    or "-" in item.text
                    or numbers[code]
                    not in (
                        "0",
                        "1",
                        "2",
                        "3",
                        "00",
                        "01",
                        "02",
                        "03",
                    )
                ):
                    return None
                words["G"] = "None"
            else:
                words[item.letter] = _word(item, written, numbers)
    except (_LongWayError, StopIteration):
        return None
    if next(written, None) is not None or ("N" in words and line.lstrip(" \t")[:1] not in ("N", "n")):
        return None
    values = ", ".join(words.get(letter, "None") for letter in _LETTERS)
    made: Compiled = eval(f"lambda n, read, names: (({values}), ({''.join(writes)}))", _NAMES[family])
    return made, code


def _word(word: Word, written: Iterator[int], numbers: list[str]) -> str:
    """Source of the value of a word."""
    if word.expression is not None:
        return _source(word.expression, written, numbers)
    assert word.value is not None
    sign = "-" if "-" in word.text else ""
    return sign + _source(Expression("number", abs(word.value)), written, numbers)


def _source(node: Expression, written: Iterator[int], numbers: list[str]) -> str:
    """Source of an expression, whose numbers stand in the line in the order in which they are met here."""
    if node.op == "number":
        place = next(written)
        if float(numbers[place]) != node.number:
            raise _LongWayError
        return f"n[{place}]"
    if node.op == "parameter":
        name: Name | None = node.name
        assert name is not None
        if name.number is not None:
            return f"read({_source(name.number, written, numbers)})"
        if name.name is None or name.name.startswith("_"):
            raise _LongWayError
        return f"names[{name.name!r}]"
    if node.op == "exists":
        raise _LongWayError
    args = [_source(arg, written, numbers) for arg in node.args]
    if node.op == "negative":
        return f"(-{args[0]})"
    if node.op in _NATIVE:
        return f"({args[0]} {node.op} {args[1]})"
    if node.op in BINARY:
        return f"binary[{node.op!r}]({args[0]}, {args[1]})"
    if node.op == "ATAN":
        return f"call['ATAN']({args[0]}, {args[1]})"
    return f"call[{node.op!r}]({args[0]})"
