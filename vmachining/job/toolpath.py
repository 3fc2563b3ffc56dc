"""`Toolpath`: a program as blocks of motions, one row of the table each, every motion with the path of the cutter; made once and
handed down."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import NamedTuple

from vmachining.arrays import Floats
from vmachining.job.contact import ToolParts
from vmachining.job.jobfile import Job
from vmachining.job.paths import CutterPath, Paths, move_paths, moving
from vmachining.job.reading import read_job_program, refuse_unknown_tools
from vmachining.machine import Machine
from vmachining.nc import Motion, Move, Program, decode_program, split_lines
from vmachining.sweep import Sweep


@dataclass(frozen=True, slots=True, eq=False)
class Toolpath:
    """What a program moves.

    paths : one per move of the program, of `length` mm (n,). blocks : those that move, in the order they run; block k has the
    number k.
    machine : of programs with rotary words.
    """

    program: Program
    machine: Machine | None
    paths: Paths
    length: Floats
    blocks: tuple[Block, ...]

    @classmethod
    def of(cls, program: Program, machine: Machine | None = None) -> Toolpath:
        """Paths and blocks of a program.

        Raises NCError: A move that cannot be one, see `paths.move_path`.
        """
        paths = move_paths(program.moves, machine)
        return cls(program, machine, paths, paths.length, tuple(group_blocks(program, paths)))

    @classmethod
    def of_job(cls, job: Job) -> Toolpath:
        """Of its program. Raises as `read_job_program` and `refuse_unknown_tools` do."""
        program = read_job_program(job)
        refuse_unknown_tools(program, job.tools)
        return cls.of(program, job.machine)

    @property
    def moves(self) -> Sequence[Move]:
        """Those of the program, dwells included."""
        return self.program.moves

    def cuts(self, block: Block) -> Iterator[tuple[Move, CutterPath]]:
        """The feed motions of a block."""
        for index in block.moves:
            if (move := self.moves[index]).motion is not Motion.RAPID:
                yield move, self.paths[index]

    def near(self, tools: Mapping[int, ToolParts], bounds: Floats) -> Iterator[Move]:
        """Moves, rapids too, whose sweeps have boxes that meet the box `bounds` (2, 3)."""
        lo, hi = bounds
        for move, path in zip(self.moves, self.paths, strict=True):
            if move.motion is not Motion.DWELL and move.tool in tools:
                a, b = Sweep.along(tools[move.tool].cutter, path).bounds
                if (a < hi).all() and (b > lo).all():
                    yield move

    def sweeps(self, block: Block, tools: Mapping[int, ToolParts]) -> list[Sweep]:
        """What the feed motions of a block sweep with tools by number; those without one sweep nothing."""
        cuts = ((tools.get(move.tool), path) for move, path in self.cuts(block))
        return [Sweep.along(tool.cutter, path) for tool, path in cuts if tool is not None]

    def sweeps_until(self, last: int, tools: Mapping[int, ToolParts]) -> list[list[Sweep]]:
        """The same of all blocks from the first to number `last`."""
        return [self.sweeps(block, tools) for block in self.blocks[: last + 1]]


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
    moves: Sequence[int]
    members: range


def program_lines(program: Program) -> list[str]:
    """Text of the lines, as the reader of the program splits them."""
    return list(split_lines(decode_program(program.data, program.name)))


def group_blocks(program: Program, paths: Paths) -> Iterator[Block]:
    """Blocks in the order they run; paths : of all moves.

    Consecutive motions of one line form one block (a canned cycle, G28 through an intermediate point). A line
    that runs several times with other lines between gives a block each time. Lines that do not move (dwell,
    spindle, modes) give none.
    """
    lines, steps = program_lines(program), program.moves
    goes = moving(paths, paths.length).tolist()
    number = 0
    for line, group in groupby(range(len(steps)), key=lambda i: steps[i].line):
        own = list(group)
        members = range(own[0], own[-1] + 1)
        travel = [i for i in members if goes[i] and steps[i].motion in TRAVEL]
        if not travel:
            continue
        first, text = steps[travel[0]], lines[line - 1] if 0 < line <= len(lines) else ""
        # several kinds of motion on one line are a cycle
        motion = str(first.motion) if all(steps[i].motion is first.motion for i in travel) else "cycle"
        moves = members if len(travel) == len(members) else travel
        yield Block(number, line, text, first.tool, motion, moves, members)
        number += 1
