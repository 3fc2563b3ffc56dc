"""The numbers of one line when it runs: its words, and the assignments it makes."""

from __future__ import annotations

from vmachining.nc.block import Problem
from vmachining.nc.expressions import NoValueError, evaluate
from vmachining.nc.lexer import MAX_VALUE, LexedLine, Word
from vmachining.nc.state import Memory

__all__ = ["line_values"]


def line_values(
    lexed: LexedLine, memory: Memory, problems: list[Problem]
) -> tuple[list[float], list[tuple[str | int, float]]]:
    """Numbers of the words, and the assignments to make when the block is done; E108 is added to `problems`."""
    values, writes = list[float](), list[tuple[str | int, float]]()
    for word in lexed.words:
        value = word.value
        try:
            if word.expression is not None:
                value = evaluate(word.expression, memory)
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
