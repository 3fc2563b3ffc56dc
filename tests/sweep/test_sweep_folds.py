"""What a slab of a tool leaves uncovered between poses, against plane geometry; slabs hold the pivot."""

from __future__ import annotations

import numpy as np
import pytest

from vmachining import FlatEnd, ProfileTool, Turn
from vmachining.sweep import Pose
from vmachining.sweep.folds import SLIM, Slab, slabs, uncovered

TOOL = FlatEnd(diameter=10, length=40).profile
WHOLE = Slab(0.0, 40.0, ())


@pytest.mark.parametrize("poses", [1, 2, 5])
def test_two_discs_leave_the_circle_between_them(poses: int) -> None:
    """Level motion by d: on both sides a disc halfway reaches sqrt(r^2 + d^2 / 4) - r beyond the discs at the ends."""
    move = Turn.great_circle(Pose((0, 0, 0), (0, 0, 1)), Pose((2, 0, 0), (0, 0, 1)))
    expected = float(np.hypot(5.0, 1.0 / poses)) - 5.0
    assert uncovered(TOOL, move, WHOLE, poses) == pytest.approx(expected, rel=1e-3)


def test_slabs_hold_the_pivot_and_poses_cover_them() -> None:
    """About a point of the axis all that is missing of a slab around it lies close to the walls of the plane."""
    start, end = (0.0, 0.0, 1.0), (np.sin(0.05), 0.0, np.cos(0.05))
    move = Turn.through((0, 0, 0), (0, 0, 0), "axis", start, end, control_height=22.0)
    found = slabs(TOOL, move, 1e-5)
    assert all(slab.lo < 22.0 < slab.hi and len(slab.bodies) == 2 for slab in found)
    for slab in found:
        half = 0.5 * (slab.hi - slab.lo)
        # strips of the plane narrower than half the way of the slab's rim are not covered: w^2 / 2 r of the circle
        assert uncovered(TOOL, move, slab, 1) <= (half * 0.05) ** 2 / (2.0 * 5.0) * 1.01 + 1e-9


def test_slabs_end_at_joints_rather_than_just_beside_them() -> None:
    """A body never gets a sliver of a face: pivots that pass by, so that slabs end around the joint of a wall."""
    tool = ProfileTool(points=[[0, 0], [5, 0], [5, 15], [5.1, 40]]).profile
    start, end = (0.0, 0.0, 1.0), (np.sin(0.05), 0.0, np.cos(0.05))
    snapped, least = 0, SLIM * tool.max_radius
    for height in np.arange(15.4, 15.9, 0.3 * least):
        move = Turn.through((0, 0, 0), (0, 0, 0), "axis", start, end, control_height=float(height))
        for slab in slabs(tool, move, 1e-5):
            snapped += slab.lo == 15.0
            for body in slab.bodies:
                joints = np.unique(body.points[:, 1])
                assert np.diff(joints).min() >= least * (1.0 - 1e-9), (height, slab)
    assert snapped > 1
