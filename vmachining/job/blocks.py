"""Moves of a program grouped into NC blocks: one row of the table each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Bools
from vmachining.job.paths import CutterPath, moves
from vmachining.nc import Motion, Program, decode_program, lex_line, split_lines

__all__ = ["Block", "group_blocks", "halts", "program_lines"]

BEFORE, AFTER = frozenset((6.0,)), frozenset((0.0, 1.0, 2.0, 30.0, 60.0))
"""M codes that stop the axes: before the motion of their line, and behind it."""
WORD_ADDRESS = ("iso", "mts")
TRAVEL = {Motion.RAPID, Motion.LINEAR, Motion.ARC_CW, Motion.ARC_CCW}


class Block(NamedTuple):
    """One NC block that moves.

    number : 0, 1, ... in program order.
    line : 1-based line of the file; text : that line, without its end.
    moves : positions of its motions in `program.moves`, rapid and feed, those of zero length left out.
    members : positions of everything the line does, dwells included.
    """

    number: int
    line: int
    text: str
    tool: int
    motion: str
    moves: tuple[int, ...]
    members: range


def program_lines(program: Program) -> list[str]:
    """Text of the lines, as the reader of the program splits them."""
    return list(split_lines(decode_program(program.data, program.name)))


def halts(program: Program, *, block_delete: bool = False) -> Bools:
    """(moves,) whether the axes stand still when a move ends, because the program stops or changes the tool.

    M6 acts before the motion of its line; M0, M1, M2, M30 and M60 act behind it. Between two moves every line
    counts that lies between theirs. `block_delete`: lines that open with a slash did not run.
    """
    if program.dialect not in WORD_ADDRESS:
        return np.zeros(len(program.moves), dtype=np.bool_)
    lines = program_lines(program)
    before, after = np.zeros((2, len(lines) + 2), dtype=np.int64)
    for number, text in enumerate(lines, start=1):
        if "M" not in text and "m" not in text:
            continue
        lexed = lex_line(text)
        if block_delete and lexed.block_delete:
            continue
        codes = {word.value for word in lexed.words if word.letter == "M"}
        before[number], after[number] = not codes.isdisjoint(BEFORE), not codes.isdisjoint(AFTER)
    own = np.array([move.line for move in program.moves], dtype=np.int64)
    here, there = own, np.append(own[1:], len(lines) + 1)
    stops = np.cumsum(before + after)
    between = np.where(there > here, stops[np.maximum(there - 1, 0)] - stops[here], 0)
    return np.asarray((there != here) & ((after[here] > 0) | (before[there] > 0) | (between > 0)))


def _kind(motions: Sequence[Motion]) -> str:
    """One word for a block: several kinds of motion on one line are a cycle."""
    kinds = set(motions)
    return str(motions[0]) if len(kinds) == 1 else "cycle"


def group_blocks(program: Program, paths: Sequence[CutterPath]) -> Iterator[Block]:
    """Blocks in the order they run; paths : of all moves.

    Consecutive motions of one line form one block (a canned cycle, G28 through an intermediate point). A line
    that runs several times with other lines between gives a block each time. Lines that do not move (dwell,
    spindle, modes) give none.
    """
    lines = program_lines(program)
    number = 0
    for line, group in groupby(range(len(program.moves)), key=lambda i: program.moves[i].line):
        members = list(group)
        travel = [i for i in members if program.moves[i].motion in TRAVEL and moves(paths[i])]
        if not travel:
            continue
        first = program.moves[travel[0]]
        yield Block(
            number=number,
            line=line,
            text=lines[line - 1] if 0 < line <= len(lines) else "",
            tool=first.tool,
            motion=_kind([program.moves[i].motion for i in travel]),
            moves=tuple(travel),
            members=range(members[0], members[-1] + 1),
        )
        number += 1
