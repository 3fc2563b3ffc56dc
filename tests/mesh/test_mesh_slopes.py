"""Slots on inclined blocks: the facets of the cutter do not lie along the motion, estimate and bracket must hold."""

from itertools import pairwise

import numpy as np
import pytest
from manifold3d import Manifold

from vmachining.engines.mesh import MeshEngine, StockMesh
from vmachining.geometry import Line
from vmachining.stock import closed_mesh
from vmachining.sweep import Sweep
from vmachining.tool import BallNose

RADIUS, DEPTH, LENGTH = 5.0, 1.0, 20.0
SEGMENT = RADIUS**2 * np.arccos(1 - DEPTH / RADIUS) - (RADIUS - DEPTH) * np.sqrt(DEPTH * (2 * RADIUS - DEPTH))


@pytest.mark.parametrize("degrees", [1, 5, 15, 30, 45, 60])
def test_ball_slot_along_a_slope_has_the_area_of_a_segment_times_its_length(degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    corners = [(x, y, z) for x in (0, LENGTH) for y in (-10, 10) for z in (-10, 0)]
    block = Manifold.hull_points(np.array(corners, dtype=float) @ turn.T).to_mesh64()
    engine = MeshEngine(StockMesh.of(closed_mesh(block.vert_properties, block.tri_verts)), 0.01)
    cutter = BallNose(diameter=2 * RADIUS, length=60).cutter
    tips = [turn @ [x, 0, RADIUS - DEPTH] - [0, 0, RADIUS] for x in np.linspace(-7, LENGTH + 7, 4)]
    lo, estimate, hi = np.sum(
        [engine.cut(Sweep.along(cutter, Line(a, b))).bracket for a, b in pairwise(tips)], axis=0
    )
    truth = SEGMENT * LENGTH
    assert lo <= truth <= hi
    # blocks before and behind the whole slot hand on their end caps: twice the width of one block
    assert hi - lo <= 0.02 * truth
    # the estimate is promised to be much better than the bracket
    assert abs(estimate - truth) <= 0.1 * (hi - lo)
    left = engine.volume
    assert engine.stock_volume.estimate - left.estimate == pytest.approx(estimate, rel=1e-12)
    assert left.lo <= left.estimate <= left.hi
