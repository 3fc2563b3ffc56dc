"""Paths of all moves of a program are those of its moves one by one."""

import numpy as np
import pytest

from vmachining.geometry import Arc, Line
from vmachining.job.paths import Paths, move_path, move_paths
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
