"""Blocks around an instant at which the grazing curve jumps: parts and poses that cover them."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.gauntlet import gauntlet_block
from vmachining import BallNose
from vmachining.engines.brep import held, solids
from vmachining.engines.brep.envelopes.decomposition import Budget, Makers, _Work
from vmachining.engines.brep.occt.booleans import quiet
from vmachining.sweep.folds import poses, standing


@pytest.mark.slow  # 4 s
def test_an_instant_at_which_the_curve_jumps_is_closed_in_on() -> None:
    """A tool that tilts as it leaves along its axis: parts ever shorter towards the instant, and poses around it.

    The solids against points by exact distances, wherever these are not nearer than poses can tell.
    """
    sweep = gauntlet_block(944)
    quiet()
    parts = [part.shape for part in solids(sweep)]
    lo, hi = sweep.bounds
    points = np.random.default_rng(0).uniform(lo, hi, (400, 3))
    distance = sweep.signed_distance(points)
    clear = np.abs(distance) > 0.02 * sweep.profile.max_radius
    assert (held(parts, points[clear]) == (distance[clear] < 0.0)).all()
    assert clear.sum() > 200 and (distance[clear] < 0.0).any()


def test_poses_alone_cover_what_hardly_moves() -> None:
    """Beside the sharp rim of a flat end what poses miss falls with their distance, not with its square."""
    sweep = gauntlet_block(944)
    whole, short = sweep.path, sweep.path.part(0.5, 0.5 + 1e-6)
    assert poses(sweep.profile, whole, 3e-5, 16) is None  # type: ignore[arg-type]
    assert poses(sweep.profile, standing(whole, 0.5), 3e-5, 16) == 1  # type: ignore[arg-type]
    count = poses(sweep.profile, short, 3e-5, 16)  # type: ignore[arg-type]
    assert count is not None and 1 <= count <= 16


def test_a_body_is_not_taken_for_one_that_is_gone() -> None:
    """Bodies are remembered while the parts of a block are tried; memory that is free again holds other ones."""
    path = gauntlet_block(944).path
    makers = Makers(lambda body, *_: [body.points[:, 0].max()], lambda *_: [], lambda *_: [], Budget())
    work = _Work[float](path, makers, 3e-5)  # type: ignore[arg-type]
    for diameter in range(2, 40):
        assert work._built(BallNose(diameter=diameter, length=60).profile, 0.0, 1.0) == [diameter / 2]
