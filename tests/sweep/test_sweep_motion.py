"""What a sweep accepts, what it refuses, and how it splits."""

from math import pi

import numpy as np
import pytest
from sweep_inventions import BALL, FLAT, PATHS

from vmachining.errors import SweepError
from vmachining.geometry import Arc, Line
from vmachining.sweep import Pose, Sweep


def test_poses_and_points_make_the_same_sweep():
    a = Sweep(FLAT, (0, 0, 0), (10, 0, 5))
    b = Sweep(FLAT, Pose((0, 0, 0)), Pose(cl=(10, 0, 5), axis=(0, 0, 1)))
    assert (a.bounds == b.bounds).all()
    assert a.profile is FLAT.profile
    assert (b.path.end == [10, 0, 5]).all()


def test_a_profile_sweeps_like_its_tool():
    assert Sweep(FLAT.profile, (0, 0, 0), (1, 2, 3)).volume == Sweep(FLAT, (0, 0, 0), (1, 2, 3)).volume


def test_split_keeps_kind_and_ends():
    whole = Sweep.along(BALL, PATHS["helix"])
    parts = whole.split([0.25, 0.5])
    assert [type(p.path) for p in parts] == [Arc] * 3
    assert parts[0].path.start == pytest.approx(whole.path.start)
    assert parts[-1].path.end == pytest.approx(whole.path.end, abs=1e-12)
    assert sum(p.path.length for p in parts) == pytest.approx(whole.path.length, rel=1e-14)
    straight = Sweep(BALL, (0, 0, 0), (8, 0, 0)).split([0.5])
    assert [type(p.path) for p in straight] == [Line] * 2


def test_arrays_are_read_only_and_input_is_copied():
    start = np.zeros(3)
    sweep = Sweep(BALL, start, (1, 0, 0))
    start[0] = 7
    assert sweep.path.start[0] == 0
    with pytest.raises(ValueError, match="read-only"):
        sweep.path.start[0] = 1


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: Sweep(BALL, (0, 0), (1, 0, 0)), "start"),
        (lambda: Sweep(BALL, (0, 0, 0), (1, 0, float("nan"))), "end"),
        (lambda: Sweep(BALL, (0, 0, 0), (float("inf"), 0, 0)), "end"),
        (lambda: Sweep(BALL, "abc", (1, 0, 0)), "start"),
        (lambda: Sweep(BALL, Pose((0, 0, 0), (0, 0, 0)), (1, 0, 0)), "length zero"),
        (lambda: Sweep(BALL, Pose((0, 0, 0), (0, 0, float("nan"))), (1, 0, 0)), "start axis"),
        (lambda: Sweep("ball", (0, 0, 0), (1, 0, 0)), "cutter or a Profile"),
        (lambda: Sweep.along(BALL, [(0, 0, 0), (1, 0, 0)]), "a Line, an Arc or a Turn"),
        (lambda: Sweep(BALL, (0, 0, 0), (1, 0, 0)).split([0.7, 0.3]), "rise"),
        (lambda: Sweep(BALL, (0, 0, 0), (1, 0, 0)).split([1.5]), "rise"),
        (lambda: Sweep(BALL, (0, 0, 0), (1, 0, 0)).signed_distance([(0, 0)]), "points"),
        (lambda: Sweep(BALL, (0, 0, 0), (1, 0, 0)).contains([(0, 0, float("nan"))]), "points"),
    ],
)
def test_refusals_say_what_is_wrong(make, word):
    with pytest.raises(SweepError, match=word):
        make()


def test_contains_with_slack():
    sweep = Sweep(FLAT, (0, 0, 0), (10, 0, 0))
    points = [(0, 10, 5), (0, 10.001, 5), (5, 0, -0.002), (5, 0, 60)]
    assert sweep.contains(points).tolist() == [True, False, False, False]
    assert sweep.contains(points, slack=0.0015).tolist() == [True, True, False, False]


def test_an_arc_on_its_centre_only_rises():
    spin = Sweep.along(FLAT, Arc((1, 1, 0), (1, 1, 0), 2, angle=2 * pi, rise=-5))
    plunge = Sweep(FLAT, (1, 1, 0), (1, 1, -5))
    assert spin.volume == plunge.volume
    assert spin.bounds == pytest.approx(plunge.bounds)
    assert spin.signed_distance([(1, 1, -4), (20, 1, 0)]) == pytest.approx(
        plunge.signed_distance([(1, 1, -4), (20, 1, 0)])
    )
