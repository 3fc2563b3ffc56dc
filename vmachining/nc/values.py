"""The numbers of one line when it runs: its words, and the assignments it makes."""

from __future__ import annotations

from vmachining.nc.block import Problem
from vmachining.nc.expressions import Expression, NoValueError, evaluate, to_least
from vmachining.nc.lexer import MAX_VALUE, LexedLine, Word
from vmachining.nc.state import Memory


def line_values(
    lexed: LexedLine, memory: Memory, problems: list[Problem]
) -> tuple[list[float], list[tuple[str | int, float]]]:
    """Numbers of the words, and the assignments to make when the block is done; E108 is added to `problems`."""
    values, writes = list[float](), list[tuple[str | int, float]]()
    for word in lexed.words:
        value = word.value
        try:
            if word.expression is not None:
                value = evaluate(_in_word(word, word.expression, memory), memory)
                if abs(value) > MAX_VALUE:
                    raise NoValueError(f"{value:g} is out of range")
        except NoValueError as exc:
            problems.append(Problem("E108", word, str(exc)))
        values.append(0.0 if value is None else value)
    for item in lexed.assignments:
        try:
            writes.append(memory.resolve(item.target, item.value))
        except NoValueError as exc:
            place = Word("#", None, item.col, item.length, item.text)
            problems.append(Problem("E108", place, str(exc)))
    return values, writes


def _in_word(word: Word, node: Expression, memory: Memory) -> Expression:
    """ROUND in an address of the Fanuc family goes to 0.001 mm or degrees, 0.0001 inch."""
    if not memory.family or word.letter not in "XYZABCUVWIJKRQ" or "ROUND" not in word.text.upper():
        return node
    return to_least(node, 1e3 if memory.state.scale == 1.0 or word.letter in "ABC" else 1e4)
