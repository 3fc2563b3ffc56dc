"""Branch choice along a path: shortest, ties, turns, limits, singular poses, jumps."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest

from vmachining.errors import KinematicsError
from vmachining.machine import Axis, Machine, follow, preset
from vmachining.machine.branches import jumps


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
    one_side = limited("ac-table", A=np.radians([0, 90]))
    naive = follow(one_side, np.array([[0, 0, 0], [10, 0, 0]]), u)
    np.testing.assert_allclose(np.diff(degrees(naive, one_side, "C")), -170, atol=1e-9)
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


def costs(q, tool):
    """Jumps and turning of rotary angles (n, r); tool (n - 1,) rad."""
    step = np.abs(np.diff(q, axis=0))
    most = step.max(axis=1)
    return int(((most > np.radians(30.0)) & (most > 5.0 * tool)).sum()), most.sum()


@pytest.mark.parametrize("begin", ["given", "free"])
@pytest.mark.parametrize("travel", [None, 200.0, 400.0])
def test_no_choice_has_fewer_jumps_or_turns_less(begin, travel):
    """Against every choice of branches and turns, by brute force, on paths near the pole."""
    m = preset("ac-table") if travel is None else limited("ac-table", C=np.radians([-travel, travel]))
    rng = np.random.default_rng(7)
    reach = np.pi if travel is None else np.radians(travel)
    for _ in range(6):
        n = 4
        u = tilted(rng.uniform(0.5, 25.0, n), rng.uniform(-180, 180, n))
        start = m.joints(c=0.0, a=0.0) if begin == "given" else None
        path = follow(m, np.zeros((n, 3)), u, start=start, prefer=0)
        axis = u if start is None else np.concatenate([[[0.0, 0.0, 1.0]], u])
        tool = np.arccos(np.clip((axis[1:] * axis[:-1]).sum(axis=1), -1.0, 1.0))
        mine = path.joints[:, :2] if start is None else np.concatenate([start[None, :2], path.joints[:, :2]])
        found = m.inverse(np.zeros((n, 3)), u).joints[..., :2]
        most = 4 if travel is None else 2
        options = [
            [(c + 2 * np.pi * k, a) for c, a in found[i] for k in range(-most, most + 1)
             if travel is None or abs(c + 2 * np.pi * k) <= reach + 1e-9]
            for i in range(n)
        ]  # fmt: skip
        best = (99, np.inf)
        for choice in itertools.product(*options):
            q = np.array(choice if start is None else [start[:2], *choice])
            jumped, turned = costs(q, tool)
            if (jumped, turned) < (best[0], best[1] - 1e-9):
                best = (jumped, turned)
        assert costs(mine, tool)[0] == best[0]
        assert costs(mine, tool)[1] == pytest.approx(
            best[1], abs=1e-4
        )  # ties by the sum weigh 1e-6 of a turn


@pytest.mark.parametrize(("end", "turns"), [(720.0, 27), (630.0, 24), (360.0, 9), (540.0, 3)])
def test_a_spiral_rewinds_as_rarely_as_the_travel_permits(end, turns):
    """A rewind goes back by whole turns, at most as many as fit into the travel, and the path may begin at its lowest turn.

    Turning back only as far as the end of the travel demands takes a rewind for every further turn instead: 25, 23, 8, 2.
    """
    m = limited("cb-head", C=np.radians([-end, end]), B=np.radians([0, 120]))
    azimuth = np.arange(0.0, 360.0 * turns + 1.0, 10.0)
    path = follow(m, np.zeros((len(azimuth), 3)), tilted(30.0, azimuth))
    begin = -360.0 * (end // 360.0)
    whole = 360.0 * (2.0 * end // 360.0)
    assert len(path.jumps) == max(math.ceil((360.0 * turns - (end - begin)) / whole), 0)
    assert {jump.kind for jump in path.jumps} <= {"rewind"}
    np.testing.assert_allclose(m.forward(path.joints).axis, tilted(30.0, azimuth), atol=1e-12)


def test_rewinds_wait_for_a_rapid():
    """Three and a half turns on an axis of four, from its middle on: the tool rewinds where it is in the air."""
    m = limited("cb-head", C=np.radians([-720, 720]), B=np.radians([0, 120]))
    azimuth = np.arange(0.0, 360.0 * 3.5 + 1.0, 10.0)
    easy = np.zeros(len(azimuth), dtype=bool)
    easy[40] = True
    start = m.joints(c=0.0, b=30.0)
    (jump,) = follow(m, np.zeros((len(azimuth), 3)), tilted(30.0, azimuth), start=start, easy=easy).jumps
    assert (jump.pose, jump.kind) == (40, "rewind")
    (jump,) = follow(m, np.zeros((len(azimuth), 3)), tilted(30.0, azimuth), start=start).jumps
    assert jump.pose != 40


def test_a_path_that_begins_at_the_pole_begins_with_the_angle_that_it_needs():
    u = np.concatenate([[[0, 0, 1], [0, 0, 1]], tilted([5, 20], 50.0)])
    path = follow(AC, np.zeros((4, 3)), u)
    np.testing.assert_allclose(degrees(path, AC, "C"), 40.0, atol=1e-9)
    np.testing.assert_allclose(degrees(path, AC, "A"), [0, 0, 5, 20], atol=1e-9)
    assert path.singular.tolist() == [True, True, False, False]
    upright = follow(AC, np.zeros((2, 3)), u[:2], start=AC.joints(c=77.0))
    np.testing.assert_allclose(degrees(upright, AC, "C"), 77.0, atol=1e-12)


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
