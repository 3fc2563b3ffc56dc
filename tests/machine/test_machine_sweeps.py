"""The motions of a machine against `Turn`, which expands the same motions in harmonics and knows no machine."""

from __future__ import annotations

import numpy as np
import pytest
from machines import FIVE_AXIS, joints, machine
from oracles.machine_motions import JointMotion, TcpMotion

from vmachining.machine import preset
from vmachining.sweep.turning import Turn

T = np.linspace(0.0, 1.0, 33)
DERIVATIVES = ("position", "axis", "velocity", "axis_rate", "acceleration", "axis_acceleration")


def same(motion, turn):
    """Lengths of some 1e3 mm and turns of some radians, rounded a few dozen times."""
    for name in DERIVATIVES:
        np.testing.assert_allclose(getattr(motion, name)(T), getattr(turn, name)(T), atol=1e-9, err_msg=name)
    np.testing.assert_allclose([motion.start, motion.end], [turn.start, turn.end], atol=1e-10)


@pytest.mark.parametrize("name", FIVE_AXIS)
def test_joint_motions(name):
    m = machine(name)
    q0, q1 = joints(m, np.random.default_rng(1), 2)
    screws = m.screws()
    turn = Turn.joints(screws.chain, q0, q1, tip_home=screws.tip_home, axis_home=screws.axis_home)
    same(JointMotion(m, q0, q1), turn)
    # the midpoint rule of the other has 256 cells: (length of p''') / (24 * 256^2) of some radians squared
    assert JointMotion(m, q0, q1).length == pytest.approx(turn.length, rel=2e-5)


@pytest.mark.parametrize("name", FIVE_AXIS)
def test_tcp_motions_are_joint_motions_of_the_tip_centred_machine(name):
    m = machine(name)
    q0, q1 = joints(m, np.random.default_rng(2), 2)
    centred = m.tip_centred()
    ends = [np.concatenate([m.forward(q).tip, q[list(m.rotary)]]) for q in (q0, q1)]
    screws = centred.screws()
    turn = Turn.joints(screws.chain, *ends, tip_home=screws.tip_home, axis_home=screws.axis_home)
    same(TcpMotion(m, q0, q1), turn)
    same(JointMotion(centred, *ends), turn)


@pytest.mark.parametrize("chain", ["ac", "bc", "ab", "hexa"])
def test_chains_of_sweep_files(chain):
    m = preset(chain)
    first, second = m.names[-2:]
    a0, a1 = {first: -20.0, second: 35.0}, {first: 65.0, second: -10.0}
    motion = JointMotion(
        m, m.joints(x=1, y=2, z=3, **{k.lower(): v for k, v in a0.items()}),
        m.joints(x=20, y=-5, z=8, **{k.lower(): v for k, v in a1.items()}),
    )  # fmt: skip
    degrees = [{k.lower(): np.radians(v) for k, v in a.items()} for a in (a0, a1)]
    same(motion, Turn.rotary((1, 2, 3), (20, -5, 8), chain, *degrees))
