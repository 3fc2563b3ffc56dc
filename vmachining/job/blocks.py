"""Moves of a program grouped into NC blocks: one row of the table each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

from vmachining.job.paths import CutterPath, lengths, moving
from vmachining.nc import Motion, Program, decode_program, split_lines

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
    lines, steps = program_lines(program), program.moves
    goes = moving(paths, lengths(paths)).tolist()
    number = 0
    for line, group in groupby(range(len(steps)), key=lambda i: steps[i].line):
        members = list(group)
        travel = [i for i in members if goes[i] and steps[i].motion in TRAVEL]
        if not travel:
            continue
        first = steps[travel[0]]
        yield Block(
            number=number,
            line=line,
            text=lines[line - 1] if 0 < line <= len(lines) else "",
            tool=first.tool,
            motion=_kind([steps[i].motion for i in travel]),
            moves=tuple(travel),
            members=range(members[0], members[-1] + 1),
        )
        number += 1
