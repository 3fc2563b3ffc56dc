"""Joint-linear and tool-centre-point motions: derivatives, splitting, bounds, straightening."""

from __future__ import annotations

import numpy as np
import pytest
from machines import FIVE_AXIS, joints, machine
from scipy.integrate import quad

from vmachining.errors import KinematicsError
from vmachining.machine import (
    JointMotion,
    TcpMotion,
    derivative_bounds,
    pieces,
    preset,
    straighten,
    tip_deviation,
    tip_lengths,
)

T = np.linspace(0.0, 1.0, 41)


def block(name, seed=1, turn=0.8, move=60.0):
    """A block whose second rotary axis stays on one side, so that it has no singularity."""
    m, rng = machine(name), np.random.default_rng(seed)
    q0 = joints(m, rng, 1)[0]
    q0[m.rotary[1]] = 0.3
    q1 = q0 + rng.uniform(-1, 1, len(q0)) * np.where([a.is_rotary for a in m.axes], turn, move)
    q1[m.rotary[1]] = 0.3 + abs(q1[m.rotary[1]] - 0.3)
    return m, q0, q1


def motions(name):
    m, q0, q1 = block(name)
    return [JointMotion(m, q0, q1), TcpMotion(m, q0, q1), TcpMotion(m, q0, q1, orientation="vector")]


@pytest.mark.parametrize("name", FIVE_AXIS)
def test_derivatives(name):
    """Central differences with h = 1e-4: errors h^2/6 and h^2/12 times derivatives below 1e3 mm, and rounding."""
    h, t = 1e-4, T[1:-1]
    for motion in motions(name):
        p, u = motion.position, motion.axis
        np.testing.assert_allclose((p(t + h) - p(t - h)) / (2 * h), motion.velocity(t), atol=1e-5)
        np.testing.assert_allclose((u(t + h) - u(t - h)) / (2 * h), motion.axis_rate(t), atol=1e-7)
        np.testing.assert_allclose((p(t + h) + p(t - h) - 2 * p(t)) / h**2, motion.acceleration(t), atol=1e-3)
        np.testing.assert_allclose(
            (u(t + h) + u(t - h) - 2 * u(t)) / h**2, motion.axis_acceleration(t), atol=1e-6
        )
        np.testing.assert_allclose(np.linalg.norm(u(T), axis=1), 1.0, atol=1e-14)
        assert p(0.5).shape == u(0.5).shape == motion.velocity(0.5).shape == (3,)
        assert motion.acceleration(np.zeros((2, 3))).shape == (2, 3, 3)


@pytest.mark.parametrize("name", ["ac-table", "ca-head", "c-table-b-head", "nutating-head", "1/1"])
def test_pieces_are_the_whole(name):
    for motion in motions(name):
        fractions = [0.0, 0.13, 0.5, 0.9, 1.0]
        parts = motion.split(fractions[1:-1])
        assert len(parts) == 4
        for part, a, b in zip(parts, fractions[:-1], fractions[1:], strict=True):
            np.testing.assert_allclose(part.position(T), motion.position(a + T * (b - a)), atol=1e-9)
            np.testing.assert_allclose(part.axis(T), motion.axis(a + T * (b - a)), atol=1e-9)
        assert sum(part.length for part in parts) == pytest.approx(motion.length, rel=1e-9)
        np.testing.assert_array_equal(parts[0].start, motion.start)
        assert motion.rotation == pytest.approx(sum(part.rotation for part in parts), rel=1e-7)


@pytest.mark.parametrize("name", FIVE_AXIS)
def test_extent(name):
    fine = np.linspace(0.0, 1.0, 4001)
    for motion in motions(name):
        points, axes = motion.position(fine), motion.axis(fine)
        low, high = motion.tip_bounds
        assert (low - 1e-9 <= points).all() and (points <= high + 1e-9).all()
        # a polyline is shorter by some h^2; a wide box would be wrong too
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
        assert steps <= motion.length * (1 + 1e-12) and steps == pytest.approx(motion.length, rel=1e-6)
        assert (np.ptp(points, axis=0) > 0.9 * (high - low) - 0.2).all()
        assert np.linalg.norm(np.diff(axes, axis=0), axis=1).sum() <= motion.rotation * (1 + 1e-9)
        assert not motion.is_upright


@pytest.mark.parametrize("name", FIVE_AXIS)
def test_lengths(name):
    """Against adaptive quadrature; the tip is never near rest in these blocks."""
    rng, m = np.random.default_rng(5), machine(name)
    q0, q1 = joints(m, rng, 6), joints(m, rng, 6)
    for length, a, b in zip(tip_lengths(m, q0, q1), q0, q1, strict=True):
        speed = JointMotion(m, a, b).velocity
        want = quad(lambda t, v=speed: np.linalg.norm(v(t)), 0, 1, limit=200, epsabs=1e-9, epsrel=1e-12)[0]
        assert length == pytest.approx(want, rel=1e-9)


@pytest.mark.parametrize("name", FIVE_AXIS)
def test_bounds_of_derivatives_hold(name):
    m, q0, q1 = block(name, turn=2.0)
    second, third, fourth = derivative_bounds(m, q0, q1)
    motion, h = JointMotion(m, q0, q1), 1e-3
    a = motion.acceleration
    assert np.linalg.norm(a(T), axis=1).max() <= second
    assert np.linalg.norm((a(T + h) - a(T - h)) / (2 * h), axis=1).max() <= third * (1 + 1e-6)
    assert np.linalg.norm((a(T + h) + a(T - h) - 2 * a(T)) / h**2, axis=1).max() <= fourth * (1 + 1e-6)


@pytest.mark.parametrize("name", FIVE_AXIS)
def test_the_deviation_is_below_its_bound(name):
    rng, m = np.random.default_rng(3), machine(name)
    q0 = joints(m, rng, 40)
    q1 = q0 + 10.0 ** rng.uniform(-4, 0, (40, 1)) * (joints(m, rng, 40) - q0)
    found = tip_deviation(m, q0, q1)
    assert (found.geometric <= found.parametric * (1 + 1e-9) + 1e-12).all()
    # positions of 1e3 mm are rounded
    assert (found.parametric <= found.bound + 1e-11).all()
    for k in range(40):
        motion = JointMotion(m, q0[k], q1[k])
        straight = (1 - T[:, None]) * motion.start + T[:, None] * motion.end
        seen = np.linalg.norm(motion.position(T) - straight, axis=1).max()
        assert seen <= found.parametric[k] + 1e-9


def test_upright_motions():
    m = preset("ac-table")
    up = m.joints(x=[0.0, 50.0], c=[10.0, 70.0])
    assert JointMotion(m, *up).is_upright and TcpMotion(m, *up).is_upright
    assert not JointMotion(m, *m.joints(x=[0.0, 50.0], a=[0.0, 1e-6])).is_upright
    for turns in range(1, 20):  # upright at all samples of some equal division, never in between
        whole = m.joints(a=[0.0, 360.0 * turns])
        assert not JointMotion(m, *whole).is_upright and not TcpMotion(m, *whole).is_upright


@pytest.mark.parametrize("orientation", ["rotary", "vector"])
@pytest.mark.parametrize("name", ["ac-table", "ca-head", "c-table-b-head", "nutating-head"])
def test_straightening_keeps_the_tip_on_its_line(name, orientation):
    m, q0, q1 = block(name)
    fewest = []
    for tolerance in (1.0, 0.1, 0.01):
        q = straighten(m, q0, q1, tolerance, orientation=orientation)
        np.testing.assert_array_equal(q[[0, -1]], [q0, q1])
        assert tip_deviation(m, q[:-1], q[1:]).parametric.max() <= tolerance
        want = TcpMotion(m, q0, q1, orientation=orientation)
        t = np.linspace(0.0, 1.0, len(q))
        np.testing.assert_allclose(m.forward(q).tip, want.position(t), atol=1e-9)
        np.testing.assert_allclose(m.forward(q).axis, want.axis(t), atol=1e-9)
        fewest.append(len(q) - 1)
    # second order: a tenth of the tolerance takes sqrt(10) times the blocks
    assert fewest[2] / fewest[1] == pytest.approx(np.sqrt(10), rel=0.2)


def test_chords_of_a_bow_stay_within_the_tolerance():
    m, q0, q1 = block("ac-table", turn=1.5)
    tolerance = 0.02
    count = int(pieces(tip_deviation(m, [q0], [q1]).bound, tolerance)[0])
    parts = JointMotion(m, q0, q1).split(np.arange(1, count) / count)
    worst = tip_deviation(m, [p.first for p in parts], [p.last for p in parts])
    assert worst.parametric.max() <= tolerance
    assert worst.bound.max() > 0.5 * tolerance  # not wasteful


def test_passing_a_singularity_takes_many_blocks_or_is_refused():
    m = preset("ac-table", second_point=(0, 0, -50))
    near = m.inverse([(0, 0, 0), (10, 0, 0)], [(0.1, 0, 1), (-0.1, 1e-7, 1)]).joints
    assert np.degrees(abs(near[1, 1, 0] - near[0, 0, 0])) < 1e-3  # through the pole, A changes its sign
    assert len(straighten(m, near[0, 0], near[1, 1], 1e-3, orientation="rotary")) < 100
    with pytest.raises(KinematicsError, match=r"near a singularity|another joint position"):
        straighten(m, near[0, 0], near[1, 0], 1e-3, orientation="vector")


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda m: JointMotion(m, [0, 0], [0, 0]), "want shape"),
        (lambda m: TcpMotion(m, np.zeros(5), np.zeros(5), orientation="slerp"), "want rotary or vector"),
        (lambda m: TcpMotion(m, m.joints(a=0.0), m.joints(a=180.0), orientation="vector"), "180 degrees"),
        (lambda m: tip_deviation(m, np.zeros((2, 5)), np.zeros((1, 5))), "2 starts, 1 ends"),
        (lambda m: tip_deviation(m, np.zeros((2, 4)), np.zeros((2, 4))), "want shape"),
        (lambda m: pieces([1.0], 0.0), "not positive"),
        (lambda m: straighten(m, np.zeros(5), np.ones(5), -1.0), "not positive"),
    ],
)
def test_refusals(make, message):
    with pytest.raises(KinematicsError, match=message):
        make(preset("ac-table"))


def test_pieces_do_not_end_in_other_joints_than_the_whole():
    """The same tool axis by the other branch: the great circle gets to the pose, not to these joints."""
    m = preset("ac-table")
    first, last = m.joints(a=[10.0, 20.0], c=[30.0, 40.0])
    (other,) = m.joints(a=[-20.0], c=[220.0])
    np.testing.assert_allclose(m.forward(last).axis, m.forward(other).axis, atol=1e-14)
    other, _ = m.place(other, m.forward(last).tip)
    assert np.array_equal(TcpMotion(m, first, last, orientation="vector").split([0.4])[-1].last, last)
    with pytest.raises(KinematicsError, match="another joint position"):
        TcpMotion(m, first, other, orientation="vector").split([0.4])
