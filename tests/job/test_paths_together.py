"""Paths of all moves of a program are those of its moves one by one."""

import numpy as np
import pytest

from vmachining.geometry import Arc, Line
from vmachining.job.paths import Paths, move_path, move_paths
from vmachining.job.toolpath import Block, Lines, Toolpath
from vmachining.nc import parse_program

PROGRAM = b"""G21 G90 G17
T1 M6
S1000 M3
G0 X1 Y2 Z5
G1 Z-1 F200
G2 X3 Y4 I1 J1
G1 X7.25
G3 X3 Y4 Z-2 I-2 J0
G4 P1
G1 X3 Y4
M30
"""


def test_paths_of_a_program():
    moves = parse_program(PROGRAM, "paths.nc", dialect="iso").moves
    paths = move_paths(moves)
    assert [type(path) for path in paths] == [type(move_path(move)) for move in moves]
    assert {type(path) for path in paths} == {Line, Arc}
    for path, move in zip(paths, moves, strict=True):
        one = move_path(move)
        assert np.array_equal(path.start, one.start) and np.array_equal(path.end, one.end)
        assert not path.start.flags.writeable
        assert path.start == pytest.approx(move.start) and path.end == pytest.approx(move.end)
    assert not [*move_paths([])]


def test_lines_that_are_not_lines():
    with pytest.raises(ValueError, match="finite"):
        Paths([(0, 0, np.nan)], [(1, 0, 0)], {})
    with pytest.raises(ValueError, match="shape"):
        Paths([(0, 0)], [(1, 0)], {})


CYCLE = "G21 G90 G17\nT1 M6\nS1000 M3\nG0 X1 Y2 Z5 (Vorschub für später)\n\nG4 P1\nG81 X2 Z-1 R2 F100\nG80\nG1 Z5\nZ4\nM30"


def test_blocks_are_lines_that_move_with_their_text():
    program = parse_program(CYCLE.encode(), "blocks.nc", dialect="iso")
    blocks, text, moves = Toolpath.of(program).blocks, CYCLE.split("\n"), program.moves
    assert [block.line for block in blocks] == [4, 7, 10] and list(blocks.line) == [4, 7, 10]
    assert [block.text for block in blocks] == [text[line - 1] for line in (4, 7, 10)]
    assert [block.motion for block in blocks] == ["rapid", "cycle", "linear"]
    for number, block in enumerate(blocks):
        own = [k for k, move in enumerate(moves) if move.line == block.line]
        travel = [k for k in own if moves[k].start != moves[k].end]
        assert block == Block(
            number, own and block.line, block.text, 1, block.motion, block.moves, range(own[0], own[-1] + 1)
        )
        assert [*block.moves] == travel and (blocks.owner[blocks.begin[number]] == number)
    assert blocks[-1] == blocks[2] and blocks[1:] == (blocks[1], blocks[2]) and len(blocks) == 3
    with pytest.raises(IndexError):
        blocks[3]


def test_lines_of_a_program_by_their_numbers():
    lines = Lines(parse_program(CYCLE.encode(), "lines.nc", dialect="iso"))
    assert [lines[k] for k in range(1, 12)] == CYCLE.split("\n")
    assert lines[0] == lines[12] == ""
