"""Tape marks: lines of a single % between which the program stands."""

from __future__ import annotations

from collections.abc import Sequence


def find_tape(lines: Sequence[str]) -> tuple[int, int, bool]:
    """First line, line after the last, and whether a closing mark ends the program (0-based lines).

    A single mark opens the program, unless nothing stands after it: then it closes it, and the first line is 0.
    """
    marks = [index for index, line in enumerate(lines) if "%" in line and line.strip(" \t") == "%"]
    if not marks:
        return 0, len(lines), False
    if len(marks) > 1:
        return marks[0] + 1, marks[1], True
    before = any(line.strip() for line in lines[: marks[0]])
    if before and not any(line.strip() for line in lines[marks[0] + 1 :]):
        return 0, marks[0], True
    return marks[0] + 1, len(lines), False
