"""Travels, and feeds capped by the joints: hand-computed moves, and joints differentiated numerically."""

from __future__ import annotations

import numpy as np
import pytest
from machines import machine

from vmachining.machine import (
    Axis,
    JointMotion,
    Machine,
    MachineLimits,
    TcpMotion,
    block_times,
    joint_accelerations,
    joint_caps,
    joint_peaks,
    least_times,
    load,
    tcp_caps,
    tcp_peaks,
    tip_lengths,
    travel_caps,
    travel_overruns,
)


def ac(**limits):
    """AC table, both axes through the origin; limits of all slides, of both rotary axes."""
    slide = {"max_speed": limits.get("slide", np.inf), "max_acceleration": limits.get("slide_a", np.inf)}
    turn = {"max_speed": limits.get("rotary", np.inf), "max_acceleration": limits.get("rotary_a", np.inf)}
    return Machine(
        "ac",
        [Axis("C", "rotary", (0, 0, 1), sign=-1, **turn), Axis("A", "rotary", (1, 0, 0), sign=-1, **turn),
         *(Axis(n, "linear", d, **slide) for n, d in zip("XYZ", np.eye(3), strict=True))],
        table=2,
    )  # fmt: skip


def test_joint_linear_feed_is_that_of_the_slowest_joint():
    """1 mm with 10 degrees at 3600 degrees/min takes 1/360 min."""
    m = ac(rotary=np.radians(60))
    q0, q1 = m.joints(x=[0.0], c=[0.0]), m.joints(x=[1.0], c=[10.0])
    np.testing.assert_allclose(joint_caps(m, q0, q1, [1.0]), 360.0)
    np.testing.assert_allclose(travel_caps([1.0], [[10.0]], [3600.0]), 360.0)
    np.testing.assert_allclose(least_times(m, q0, q1), 1 / 6)
    # without a given length it is the true tip path: here within an Archimedean spiral arc of radius <= 1
    assert joint_caps(m, q0, q1)[0] == pytest.approx(360 * JointMotion(m, q0[0], q1[0]).length)
    assert np.isinf(joint_caps(m, q0, q0)).all() and np.isinf(joint_caps(ac(), q0, q1)).all()


def test_time_of_a_turn_with_limited_joints():
    """C turns by 1 rad at 0.5 rad/s and 1 rad/s^2 under a tip 20 mm away: 2 s steady and 0.5 s of ramps."""
    m = ac(rotary=0.5, rotary_a=1.0)
    q0, q1 = m.joints(x=[20.0], c=[0.0]), m.joints(x=[20.0], c=[1.0], degrees=False)
    length = tip_lengths(m, q0, q1)
    np.testing.assert_allclose(length, 20.0)
    np.testing.assert_allclose(joint_accelerations(m, q0, q1), 20.0)
    found = block_times(
        length, [1e6], [False], MachineLimits(), cap_mm_min=joint_caps(m, q0, q1),
        acceleration_mm_s2=joint_accelerations(m, q0, q1),
    )  # fmt: skip
    np.testing.assert_allclose(found.ideal_s, 2.0)
    np.testing.assert_allclose(found.accelerated_s, 2.5)
    assert (
        np.isinf(joint_accelerations(m, q0, q0)).all() and np.isinf(joint_accelerations(ac(), q0, q1)).all()
    )


def test_tip_on_a_chord_while_the_table_turns():
    """The table turns by 2 b about the tip's circle of radius r; tip straight from -b to b, C linear.

    In machine axes the tip is at r cos(b) / cos-free form: M = Rz(c) W with W on the chord, so
    |M'| is found from M' = W' + c' x M; both have closed forms at the ends.
    """
    r, b = 50.0, np.radians(20.0)
    m = ac(slide=100.0)
    q0 = m.inverse([(r * np.cos(b), -r * np.sin(b), 0.0)], [(0, 0, 1)]).joints[0, 0]
    q1 = m.inverse([(r * np.cos(b), r * np.sin(b), 0.0)], [(0, 0, 1)]).joints[0, 0]
    q0, q1 = q0.copy(), q1.copy()
    for q, c in ((q0, b), (q1, -b)):  # the table brings the tip to y = 0 at both ends
        q[:] = m.place(np.where(np.arange(5) == 0, c, q), m.forward(q).tip)[0]
    np.testing.assert_allclose([q0[2:], q1[2:]], [[r, 0, 0]] * 2, atol=1e-12)
    first, second = tcp_peaks(TcpMotion(m, q0, q1), samples=2001)
    # W = (r cos b, r sin b s), c = -b s for s = 2t - 1; M = Rz(c) W; derivatives by s at s = -1..1
    s = np.linspace(-1, 1, 20001)
    x = r * np.cos(b) * np.cos(b * s) + r * np.sin(b) * s * np.sin(b * s)
    y = -r * np.cos(b) * np.sin(b * s) + r * np.sin(b) * s * np.cos(b * s)
    for column, value in ((2, x), (3, y)):
        rate = np.gradient(value, s, edge_order=2)
        assert first[column] == pytest.approx(2 * np.abs(rate).max(), rel=1e-6)
        assert second[column] == pytest.approx(
            4 * np.abs(np.gradient(rate, s, edge_order=2)[2:-2]).max(), rel=1e-3
        )
    length = 2 * r * np.sin(b)
    want = 60 * length * 100.0 / first[[2, 3]].max()
    assert tcp_caps(m, [q0], [q1], samples=2001)[0] == pytest.approx(want, rel=1e-9)


@pytest.mark.parametrize("orientation", ["rotary", "vector"])
@pytest.mark.parametrize("name", ["ac-table", "ca-head", "c-table-b-head", "nutating-head", "0/2"])
def test_peaks_against_differences_of_joints(name, orientation):
    m = machine(name)
    rng = np.random.default_rng(2)
    q0 = rng.uniform(-1, 1, len(m.axes))
    q0[m.rotary[1]] = 0.5
    q1 = q0 + rng.uniform(0.2, 0.5, len(m.axes))
    motion = TcpMotion(m, q0, q1, orientation=orientation)
    first, second = tcp_peaks(motion, samples=201)
    t = np.linspace(0, 1, 201)
    h = 1e-4
    inner = t[1:-1]
    moved = [motion.joints(inner + d) for d in (-h, 0.0, h)]
    rate, bend = (moved[2] - moved[0]) / (2 * h), (moved[2] - 2 * moved[1] + moved[0]) / h**2
    # the maximum over the inner samples differs from that over all by at most one step of the next derivative
    assert (first <= np.abs(rate).max(axis=0) + second / 200 * 1.01 + 1e-6).all()
    np.testing.assert_allclose(second, np.abs(bend).max(axis=0), rtol=0.05, atol=1e-3)
    assert (first >= np.abs(rate).max(axis=0) - 1e-6).all()


def test_accelerations_limit_too():
    """Twice the acceleration allows sqrt(2) times the feed, twice the speed twice the feed."""

    def cap(**limits):
        m = ac(**limits)
        q = m.inverse([(30, 0, 5), (30, 20, 5)], [(0.3, 0.1, 1), (0.1, 0.3, 1)]).joints[:, 0]
        return tcp_caps(m, q[:1], q[1:])[0]

    assert cap(slide_a=1000.0) == pytest.approx(np.sqrt(2) * cap(slide_a=500.0))
    assert cap(slide=40.0) == pytest.approx(2 * cap(slide=20.0))
    assert cap(slide=40.0, slide_a=1.0) == cap(slide_a=1.0) < cap(slide=40.0)
    assert np.isinf(cap()) and cap(rotary=0.5) < np.inf


def test_past_the_pole():
    """Through the pole A swings through zero and C rests; beside it at 1e-3 rad C turns by 180 degrees at 1e3."""
    m = ac(rotary=1.0)
    q = m.inverse([(0, 0, 0), (10, 0, 0)], [(0.1, 0, 1), (-0.1, 0, 1)]).joints
    through = tcp_caps(m, q[:1, 0], q[1:, 1], orientation="vector")[0]
    assert through == pytest.approx(60 * np.hypot(10, 0) / (2 * np.arctan(0.1)), rel=1e-9)
    q = m.inverse([(0, 0, 0), (10, 0, 0)], [(0.1, 1e-3, 1), (-0.1, 1e-3, 1)]).joints
    beside = tcp_caps(m, q[:1, 0], q[1:, 0], orientation="vector")[0]
    # rate of the azimuth at the nearest point: rate of the axis over the sine of its distance
    ends = np.array([[0.1, 1e-3, 1], [-0.1, 1e-3, 1]]) / np.sqrt(0.01 + 1e-6 + 1)
    rate = 2 * np.arcsin(0.5 * np.linalg.norm(ends[0] - ends[1])) / np.sin(np.arctan(1e-3))
    assert beside == pytest.approx(60 * 10 / rate, rel=1e-9)


def test_a_corner_at_the_pole_cannot_be_driven():
    """From upright the tool must tilt across the plane in which the free axis was left."""
    m = ac(rotary=1.0)
    q0 = m.joints(c=0.0)
    q1 = m.inverse([(10, 0, 0)], [(0.1, 0, 1)]).joints[0, 0]
    assert tcp_caps(m, [q0], [q1], orientation="vector")[0] == 0.0
    q0 = m.joints(c=q1[0], degrees=False)
    assert tcp_caps(m, [q0], [q1], orientation="vector")[0] > 0.0


def test_travels():
    m = load("xyzac-trt")
    q = m.joints(x=[0, 150, 201, 230], y=[0, 0, -101, 0], a=[0, 50, 51, -100])
    over = travel_overruns(m, q)
    assert [(o.name, o.pose, o.limit, o.poses) for o in over] == [
        ("A", 2, pytest.approx(50), 1), ("X", 2, 200, 2), ("Y", 2, -100, 1)
    ]  # fmt: skip
    assert [o.worst for o in over] == [pytest.approx(51), 230, -101]
    assert travel_overruns(m, q[:2]) == ()


def test_peaks_of_joint_linear_blocks():
    m = ac()
    first, second = joint_peaks(JointMotion(m, m.joints(x=1.0), m.joints(x=-2.0, c=90.0)))
    np.testing.assert_allclose(first, [np.pi / 2, 0, 3, 0, 0])
    assert not second.any()
