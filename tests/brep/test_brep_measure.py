"""Volumes along edges: exact where sheets bend fast, against the flux identity."""

from __future__ import annotations

import numpy as np
import pytest

from vmachining import FlatEnd, Sweep, Turn
from vmachining.engines import brep
from vmachining.engines.brep.turns import turn_pieces


@pytest.mark.parametrize("aside", [0.007, 0.01])
def test_sheets_that_turn_round_the_tool_within_a_hundredth_of_their_height(aside: float) -> None:
    """A pivot in the tool moves aside: the grazing curve of the cylinder jumps half around at that height.

    Straight edges of such a sheet once had nodes in four spans, whatever its knots: 2e-4 of the volume were missing.
    """
    end = (float(np.sin(0.011)), 0.0, float(np.cos(0.011)))
    path = Turn.through((0, 0, 0), (0, aside, 0), "axis", (0, 0, 1), end, control_height=4)
    cutter = FlatEnd(diameter=15, length=55)
    (piece,) = turn_pieces(cutter.profile, path, 1e-6)
    exact = Sweep.along(cutter, path).flux()
    assert exact.error < 1e-7 * exact.volume
    assert brep.volume(piece.built.builder.solid()) == pytest.approx(exact.volume, rel=1e-7)
