"""Branch choice along a path: shortest, ties, turns, limits, singular poses, jumps."""

from __future__ import annotations

import numpy as np
import pytest

from vmachining.errors import KinematicsError
from vmachining.machine import Axis, Machine, follow, jumps, preset


def tilted(tilt, azimuth):
    t, z = np.radians(tilt), np.radians(azimuth)
    return np.stack(np.broadcast_arrays(np.sin(t) * np.cos(z), np.sin(t) * np.sin(z), np.cos(t)), axis=-1)


def limited(name, **limits):
    m = preset(name)
    axes = [
        Axis(a.name, a.kind, a.direction, point=a.point, sign=a.sign,
             lower=limits.get(a.name, (-np.inf, 0))[0], upper=limits.get(a.name, (0, np.inf))[1])
        for a in m.axes
    ]  # fmt: skip
    return Machine(m.name, axes, tip=m.tip, tool=m.tool, work=m.work, table=m.table)


def degrees(path, machine, name):
    return np.degrees(path.joints[:, machine.names.index(name)])


AC = preset("ac-table", second_point=(0, 0, -50))


def test_the_short_way_through_the_singularity():
    """Tilt 1 degree from azimuth 0 to 170: C turns by 10 degrees and A changes its sign."""
    u = tilted(1.0, [0.0, 170.0])
    path = follow(AC, np.array([[0, 0, 0], [10, 0, 0]]), u)
    np.testing.assert_allclose(degrees(path, AC, "C"), [90, 100], atol=1e-9)
    np.testing.assert_allclose(degrees(path, AC, "A"), [1, -1], atol=1e-9)
    assert path.jumps == () and path.branch[0] != path.branch[1]
    naive = follow(AC, np.array([[0, 0, 0], [10, 0, 0]]), u, switch=False)
    np.testing.assert_allclose(np.diff(degrees(naive, AC, "C")), -170, atol=1e-9)
    (jump,) = naive.jumps
    assert (jump.pose, jump.name, jump.kind) == (1, "C", "singular")
    assert np.degrees(jump.tool) == pytest.approx(
        2 * np.degrees(np.arcsin(np.sin(np.radians(1)) * np.sin(np.radians(85))))
    )


def test_ties_go_to_the_smaller_sum():
    """A quarter turn either way; the other branch also tilts through zero."""
    path = follow(AC, np.zeros((2, 3)), tilted([5, 15], [10, 100]))
    np.testing.assert_allclose(degrees(path, AC, "C"), [80, -10], atol=1e-9)
    np.testing.assert_allclose(degrees(path, AC, "A"), [5, 15], atol=1e-9)


@pytest.mark.parametrize("name", ["ac-table", "cb-head", "c-table-b-head", "nutating-head", "bc-table"])
def test_turns_add_up_along_a_spiral(name):
    m = preset(name)
    azimuth = np.arange(0.0, 3000.0, 7.0)
    path = follow(m, np.zeros((len(azimuth), 3)), tilted(20.0, azimuth))
    c = degrees(path, m, "C")
    np.testing.assert_allclose(np.abs(np.diff(c)), 7.0, atol=1e-9)
    assert abs(c[-1] - c[0]) == pytest.approx(azimuth[-1])
    np.testing.assert_allclose(m.forward(path.joints).axis, tilted(20.0, azimuth), atol=1e-12)
    assert path.jumps == ()


def test_a_limited_axis_rewinds():
    m = limited("cb-head", C=np.radians([-360, 360]), B=np.radians([0, 120]))
    azimuth = np.arange(0.0, 800.0, 10.0)
    path = follow(m, np.zeros((len(azimuth), 3)), tilted(30.0, azimuth))
    c = degrees(path, m, "C")
    assert np.abs(c).max() <= 360.0 + 1e-9
    assert {j.kind for j in path.jumps} == {"rewind"} and len(path.jumps) >= 1
    np.testing.assert_allclose(m.forward(path.joints).axis, tilted(30.0, azimuth), atol=1e-12)


def test_limits_choose_the_branch():
    u = tilted(20.0, [33.0])
    for sign, travel in ((1, (0, 100)), (-1, (-100, 0))):
        m = limited("ac-table", A=np.radians(travel))
        path = follow(m, np.zeros((1, 3)), u)
        assert np.sign(path.joints[0, 1]) == sign
    assert np.sign(follow(AC, np.zeros((1, 3)), u, prefer=-1).joints[0, 1]) == -1
    start = AC.joints(c=237.0, a=-20.0)
    np.testing.assert_allclose(
        follow(AC, np.zeros((1, 3)), u, start=start).joints[0, :2], start[:2], atol=1e-12
    )


def test_the_end_of_a_travel_is_inside():
    """90 degrees of tilt, computed from direction cosines, on an axis that ends there."""
    m = limited("ac-table", A=(0.0, np.pi / 2), Y=(-np.inf, 0.0))
    path = follow(m, np.zeros((8, 3)), tilted(90.0, np.arange(0.0, 360.0, 45.0)))
    np.testing.assert_allclose(degrees(path, m, "A"), 90.0, atol=1e-9)


def test_travels_of_slides_choose_the_branch_too():
    m = limited("ca-head", X=(-1000, 20))
    free, bound = preset("ca-head"), m
    u, p = tilted(20.0, [33.0]), np.array([[10.0, 0, 0]])
    assert follow(bound, p, u).joints[0, 0] <= 20 and follow(free, p, u).joints[0, 0] == pytest.approx(10)
    with pytest.raises(KinematicsError, match="X 30 mm outside -1000 to 20"):
        follow(bound, p + 20, u)


def test_a_singular_pose_keeps_the_free_axis():
    u = np.concatenate([tilted([10, 5, 1], 50.0), [[0, 0, 1], [0, 0, 1]], tilted([1, 5], 50.0)])
    p = np.column_stack([np.linspace(0, 60, 7), np.ones(7), np.zeros(7)])
    path = follow(AC, p, u)
    assert path.singular.tolist() == [False] * 3 + [True] * 2 + [False] * 2
    np.testing.assert_allclose(degrees(path, AC, "C"), 40.0, atol=1e-9)
    pose = AC.forward(path.joints)
    np.testing.assert_allclose(pose.tip, p, atol=1e-9)
    np.testing.assert_allclose(pose.axis, u, atol=1e-9)


def test_every_choice_is_no_longer_than_the_other():
    """Against a plain search over both branches and seven turns."""
    m = preset("bc-table")
    rng = np.random.default_rng(11)
    u = tilted(rng.uniform(1, 100, 300), rng.uniform(-180, 180, 300))
    path = follow(m, np.zeros((300, 3)), u)
    found = m.inverse(np.zeros((300, 3)), u).joints[..., :2]
    turns = 2 * np.pi * np.arange(-4, 5)
    for k in range(1, 300):
        before = path.joints[k - 1, :2]
        base = before + np.mod(found[k] - before + np.pi, 2 * np.pi) - np.pi
        options = (base[:, :, None] + turns)[..., None]
        cost = np.abs(options - before[None, :, None, None]).min(axis=2).max(axis=1)
        assert np.abs(path.joints[k, :2] - before).max() == pytest.approx(float(cost.min()), abs=1e-12)


def test_refusals():
    with pytest.raises(KinematicsError, match="pose 1: the rotary axes C, B cannot turn"):
        follow(preset("nutating-head"), np.zeros((2, 3)), [(0, 0, 1), (0, 0.1, -1)])
    with pytest.raises(KinematicsError, match="pose 0: machine xyz has no rotary axis"):
        follow(preset("xyz"), np.zeros((1, 3)), [(0, 1, 1)])
    m = limited("ac-table", A=np.radians((-10, 10)))
    with pytest.raises(KinematicsError, match="A 20 deg outside -10 to 10"):
        follow(m, np.zeros((1, 3)), tilted(20.0, [0.0]))
    with pytest.raises(KinematicsError, match="prefer"):
        follow(AC, np.zeros((1, 3)), [(0, 0, 1)], prefer=2)
    assert jumps(AC, np.zeros((1, 5))) == ()
