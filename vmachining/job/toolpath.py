"""`Toolpath`: a program as blocks of motions, one row of the table each, every motion with the path of the cutter; made once and
handed down."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, overload

import numpy as np

from vmachining.arrays import Floats, Ints
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
    blocks: Blocks

    @classmethod
    def of(cls, program: Program, machine: Machine | None = None) -> Toolpath:
        """Paths and blocks of a program.

        Raises NCError: A move that cannot be one, see `paths.move_path`.
        """
        paths = move_paths(program.moves, machine)
        return cls(program, machine, paths, paths.length, Blocks(program, paths))

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


class Lines:
    """Text of the lines of a program, as its reader splits them. Bytes, which take a third of the memory of strings."""

    def __init__(self, program: Program) -> None:
        lines = split_lines(decode_program(program.data, program.name))
        self._text = "\n".join(lines).encode()
        ends = np.flatnonzero(np.frombuffer(self._text + b"\n", dtype=np.uint8) == ord("\n"))
        self._ends = np.concatenate([[-1], ends[: len(lines)]])

    def __getitem__(self, number: int) -> str:
        """Text of a line, counted from 1; empty where the program has no such line."""
        if not 0 < number < len(self._ends):
            return ""
        begin, end = self._ends[number - 1 : number + 1].tolist()
        return self._text[begin + 1 : end].decode()


class Blocks(Sequence[Block]):
    """Blocks in the order they run, made when they are asked for.

    Consecutive motions of one line form one block (a canned cycle, G28 through an intermediate point). A line
    that runs several times with other lines between gives a block each time. Lines that do not move (dwell,
    spindle, modes) give none.

    first, stop : (n,) its members are the moves from `first` to before `stop`. line : (n,). motion : (m,) all motions, those of
    block k from begin[k] to before begin[k + 1].
    """

    def __init__(self, program: Program, paths: Paths) -> None:
        """paths : of all moves."""
        self._steps, self._lines = program.moves, Lines(program)
        line = np.array([move.line for move in self._steps], dtype=np.int64)
        travels = np.array([move.motion in TRAVEL for move in self._steps], dtype=np.bool_)
        self.motion = np.flatnonzero(travels & moving(paths, paths.length))
        begins = np.flatnonzero(np.diff(line, prepend=-1))
        count = np.diff(np.searchsorted(self.motion, np.append(begins, len(line))))
        some = count > 0
        self.first, self.line = begins[some], line[begins[some]]
        self.stop = np.append(begins[1:], len(line))[some]
        self.begin = np.concatenate([[0], np.cumsum(count[some])])

    def __len__(self) -> int:
        return len(self.first)

    @overload
    def __getitem__(self, k: int) -> Block: ...
    @overload
    def __getitem__(self, k: slice) -> tuple[Block, ...]: ...
    def __getitem__(self, k: int | slice) -> Block | tuple[Block, ...]:
        if isinstance(k, slice):
            return tuple(map(self.__getitem__, range(*k.indices(len(self)))))
        k = range(len(self))[k]
        members = range(int(self.first[k]), int(self.stop[k]))
        begin, end = self.begin[k : k + 2].tolist()
        moves = members if end - begin == len(members) else self.motion[begin:end].tolist()
        kinds = {self._steps[i].motion for i in moves}
        line = int(self.line[k])
        # several kinds of motion on one line are a cycle
        motion = str(*kinds) if len(kinds) == 1 else "cycle"
        return Block(k, line, self._lines[line], self._steps[moves[0]].tool, motion, moves, members)

    def __iter__(self) -> Iterator[Block]:
        return map(self.__getitem__, range(len(self)))

    @property
    def owner(self) -> Ints:
        """(m,) block of every motion."""
        return np.repeat(np.arange(len(self)), np.diff(self.begin))


def group_blocks(program: Program, paths: Paths) -> Blocks:
    """Blocks in the order they run; paths : of all moves."""
    return Blocks(program, paths)


def program_lines(program: Program) -> list[str]:
    """Text of the lines, as the reader of the program splits them."""
    return list(split_lines(decode_program(program.data, program.name)))
