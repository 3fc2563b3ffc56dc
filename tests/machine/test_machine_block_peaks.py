"""The fastest moment of the joints inside blocks: circles in closed form, and single motions differentiated."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from machines import machine
from oracles.machine_motions import TcpMotion, tcp_peaks

from vmachining.errors import KinematicsError
from vmachining.job.timing import move_times
from vmachining.job.toolpath import Toolpath
from vmachining.machine import (
    Axis,
    Machine,
    MachineLimits,
    linear_peaks,
    peak_accelerations,
    peak_times,
    tcp_block_peaks,
)
from vmachining.nc import parse_program


def c_table(**slide: float) -> Machine:
    """A round table under three slides."""
    axes = [Axis("C", "rotary", (0, 0, 1), sign=-1)]
    axes += [Axis(n, "linear", d, **slide) for n, d in zip("XYZ", np.eye(3), strict=True)]
    return Machine("c", axes, table=1)


def held(m: Machine, reach: float, angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Joints that hold the tip over one point of the table while it turns by the angle, rad."""
    q = m.joints(c=[0.0, angle], degrees=False)
    q = m.place(q, np.array([reach, 0.0, 0.0]))[0]
    return q[:1], q[1:]


@pytest.mark.parametrize("turns", [0.25, 1.0, 3.5])
def test_slides_that_follow_a_turning_table_run_on_a_circle(turns):
    """x = r cos(2 pi n t): at most 2 pi n r and (2 pi n)^2 r, where whole turns end where they began."""
    m, w = c_table(), 2 * pi * turns
    peaks = tcp_block_peaks(m, *held(m, 50.0, w))
    assert peaks.first[0, 0] == pytest.approx(w)
    top = np.array([50 * w, 50 * w**2])
    for found, want in zip((peaks.first[0, 1:3], peaks.second[0, 1:3]), top, strict=True):
        assert (found >= want * (1 - 1e-12)).all() and (found <= want * 1.005).all()
    assert not peaks.first[0, 3] and not peaks.second[0, 3]


def test_times_by_speed_and_by_acceleration():
    fast = c_table(max_speed=100.0)
    assert peak_times(fast, tcp_block_peaks(fast, *held(fast, 50.0, 2 * pi)))[0] == pytest.approx(
        pi, rel=5e-3
    )
    weak = c_table(max_acceleration=50.0)
    bent = tcp_block_peaks(weak, *held(weak, 50.0, 2 * pi))
    assert peak_times(weak, bent)[0] == pytest.approx(2 * pi, rel=5e-3)
    assert peak_times(c_table(), bent)[0] == 0.0
    # along a straight block of 20 mm whose slowest joint goes 50 times 2 pi: a = 20 * 50 / (100 pi)
    assert peak_accelerations(weak, bent, [20.0])[0] == pytest.approx(10 / pi, rel=5e-3)
    still = linear_peaks(weak.joints(x=[1.0]), weak.joints(x=[1.0]))
    assert np.isinf(peak_accelerations(weak, still, [0.0])).all() and not peak_times(weak, still).any()


@pytest.mark.parametrize("name", ["ac-table", "ca-head", "c-table-b-head", "nutating-head", "0/2"])
def test_many_blocks_like_one_by_one(name):
    m = machine(name)
    rng = np.random.default_rng(5)
    q0 = rng.uniform(-1, 1, (6, len(m.axes)))
    q1 = q0 + rng.uniform(-0.8, 0.8, q0.shape)
    peaks = tcp_block_peaks(m, q0, q1)
    for k in range(len(q0)):
        first, second = tcp_peaks(TcpMotion(m, q0[k], q1[k]), samples=1001)
        for found, want in ((peaks.first[k], first), (peaks.second[k], second)):
            assert (found >= want * (1 - 1e-9) - 1e-12).all()
            assert (found <= want * 1.03 + 0.03 * want.max()).all()


def test_slides_that_become_parallel_say_so():
    axes = [Axis("X", "linear", (1, 0, 0)), Axis("B", "rotary", (0, 1, 0)), Axis("Z", "linear", (0, 0, 1)),
            Axis("Y", "linear", (0, 1, 0))]  # fmt: skip
    m = Machine("folding", axes, table=1)
    peaks = tcp_block_peaks(m, m.joints(b=[60.0]), m.joints(b=[120.0]))
    assert np.isinf(peaks.first).any()
    with pytest.raises(KinematicsError):
        tcp_block_peaks(m, m.joints(b=[60.0, 0.0]), m.joints(b=[120.0]))


def test_a_block_takes_as_long_as_its_fastest_moment():
    """One turn of the table under a tip that stays 50 mm off its axis ends where it began, and takes pi seconds."""
    m = c_table(max_speed=100.0)
    text = (
        b"M428\nG0 X50 Y0 C0\nG1 F1e5 C360\n".replace(b"1e5", b"100000") + b"G0 C0\nG1 X60 C360 F100000\nM2\n"
    )
    program = parse_program(text, "p", home=(50, 0, 0), rotary="C")
    program.require_clean()
    times = move_times(Toolpath.of(program, m), MachineLimits(rapid_mm_min=1e6))
    assert times.seconds[1] == pytest.approx(pi, rel=5e-3)  # stands apart, like a dwell
    assert times.seconds[2] == pytest.approx(pi, rel=5e-3)  # a rapid turns no faster
    # the last one winds outwards: at its end the slides go by hypot(10, 2 pi 60) mm, nearly along Y. It is driven in 16 pieces
    # of 22.5 degrees, in which the faster slide has 1 and cos 22.5 degrees of the speed about the axis in turn
    assert times.cap_mm_min[3] == pytest.approx(60 * 10 / (2 * pi * 60 / 100), rel=1e-2)
    assert times.seconds[3] == pytest.approx(2 * pi * 55 / 100 * (1 + np.cos(pi / 8)) / 2, rel=1e-2)
    best = 2 * pi * 55 / 100 * (4 / pi) * np.sin(pi / 4)  # the mean of max(|sin|, |cos|)
    assert best <= times.seconds[3] <= 2 * pi * 60 / 100
