"""`Toolpath`: a program as blocks of motions, every motion with the path of the cutter; made once and handed down."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from vmachining.arrays import Floats
from vmachining.job.blocks import Block, group_blocks
from vmachining.job.contact import ToolParts
from vmachining.job.paths import CutterPath, lengths, move_paths
from vmachining.machine import Machine
from vmachining.nc import Motion, Move, Program
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
    paths: tuple[CutterPath, ...]
    length: Floats
    blocks: tuple[Block, ...]

    @classmethod
    def of(cls, program: Program, machine: Machine | None = None) -> Toolpath:
        """Paths and blocks of a program.

        Raises NCError: A move that cannot be one, see `paths.move_path`.
        """
        paths = move_paths(program.moves, machine)
        return cls(program, machine, paths, lengths(paths), tuple(group_blocks(program, paths)))

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
        return [
            Sweep.along(tools[move.tool].cutter, path)
            for move, path in self.cuts(block)
            if move.tool in tools
        ]

    def sweeps_until(self, last: int, tools: Mapping[int, ToolParts]) -> list[list[Sweep]]:
        """The same of all blocks from the first to number `last`."""
        return [self.sweeps(block, tools) for block in self.blocks[: last + 1]]
