"""How far joint-linear blocks leave the straight line; the motions that tests compare with, differentiated."""

from __future__ import annotations

import numpy as np
import pytest
from machines import FIVE_AXIS, joints, machine
from oracles.machine_motions import JointMotion, TcpMotion, tcp_peaks, tip_lengths
from scipy.integrate import quad

from vmachining.errors import KinematicsError
from vmachining.machine import preset, tip_deviation
from vmachining.machine.deviation import derivative_bounds

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


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda m: JointMotion(m, [0, 0], [0, 0]), "expected shape"),
        (lambda m: TcpMotion(m, np.zeros(5), np.zeros(5), orientation="slerp"), "expected rotary or vector"),
        (lambda m: TcpMotion(m, m.joints(a=0.0), m.joints(a=180.0), orientation="vector"), "180 degrees"),
        (lambda m: tip_deviation(m, np.zeros((2, 5)), np.zeros((1, 5))), "2 starts, 1 ends"),
        (lambda m: tip_deviation(m, np.zeros((2, 4)), np.zeros((2, 4))), "expected shape"),
    ],
)
def test_refusals(make, message):
    with pytest.raises(KinematicsError, match=message):
        make(preset("ac-table"))


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
