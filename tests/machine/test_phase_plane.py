"""Times of programs of lines, arcs and five-axis blocks against a dense integration in the phase plane: 0.5 %."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from oracles.phase_plane import Dense, corner, fastest

from vmachining.job.timing import Driven
from vmachining.job.toolpath import Toolpath
from vmachining.machine import MachineLimits, Way, drive, preset
from vmachining.nc import parse_program

PLACES = 400
WHOLE = 800.0
TOLERANCE = 0.02


def words(point):
    return " ".join(f"{letter}{value:.4f}" for letter, value in zip("XYZ", point, strict=False))


def planar(seed):
    """Lines and arcs of 0.5 to 20 mm in the plane, slides of different acceleration; text and blocks."""
    rng = np.random.default_rng(seed)
    slides = rng.uniform(300.0, 1500.0, 3)
    at, text, blocks = np.zeros(2), ["G21 G90 G17 G94 S1000 M3", "G1 X0 Y0 F1"], []
    for _ in range(int(rng.integers(4, 14))):
        feed = float(np.round(10.0 ** rng.uniform(2.5, 4.3)))
        if rng.random() < 0.4:
            radius, start = 10.0 ** rng.uniform(-0.3, 1.2), rng.uniform(-np.pi, np.pi)
            turn = rng.uniform(0.3, 5.5) * rng.choice([-1.0, 1.0])
            center = np.round(at - radius * np.array([np.cos(start), np.sin(start)]), 4)
            radius, start = np.hypot(*(at - center)), np.arctan2(*(at - center)[::-1])
            angle = start + turn * np.linspace(0.0, 1.0, PLACES + 1)
            q = center + radius * np.column_stack([np.cos(angle), np.sin(angle)])
            i, j = center - at
            text.append(f"G{2 if turn < 0 else 3} {words(q[-1])} I{i:.4f} J{j:.4f} F{feed:.0f}")
            s = radius * abs(turn) * np.linspace(0.0, 1.0, PLACES + 1)
            way = np.sign(turn) * np.column_stack([-np.sin(angle), np.cos(angle)])
            kappa = 1.0 / radius
        else:
            end = np.round(at + rng.normal(size=2) * 10.0 ** rng.uniform(-0.3, 1.3), 4)
            q = at + np.linspace(0.0, 1.0, PLACES + 1)[:, None] * (end - at)
            text.append(f"G1 {words(end)} F{feed:.0f}")
            s = np.linalg.norm(end - at) * np.linspace(0.0, 1.0, PLACES + 1)
            way, kappa = np.tile((end - at) / s[-1], (PLACES + 1, 1)), 0.0
        at = np.round(q[-1], 4)
        flat = np.zeros((PLACES + 1, 1))
        tip = np.hstack([way[[0, -1]], np.zeros((2, 1))])
        blocks.append(Dense(s, np.hstack([q, flat]), kappa, feed / 60.0, tip, np.zeros(0)))
    limits = MachineLimits(
        max_acceleration_mm_s2=WHOLE,
        axis_acceleration_mm_s2=tuple(slides.tolist()),
        corner_tolerance_mm=TOLERANCE,
    )
    borders = [corner(a, b, TOLERANCE, WHOLE, slides, np.zeros(0)) for a, b in pairwise(blocks)]
    best = fastest(blocks, borders, speed=np.full(3, np.inf), acceleration=slides, whole=WHOLE)
    return "\n".join([*text, "M30"]), None, limits, best


def turning(seed):
    """Blocks of 1 to 8 mm under tool-centre-point control, on a trunnion with the limits of `xyzac-trt`."""
    rng = np.random.default_rng(seed)
    machine = preset("xyzac-trt")
    part = rng.uniform(-30.0, 30.0, 3)
    at, angle = np.round(part, 4), np.round(np.array([rng.uniform(-40, 20), rng.uniform(-180, 180)]), 4)
    text = [
        "G21 G90 G94 S1000 M3",
        f"G43.4 H0 Z{at[2]:.4f}",
        f"G0 {words(at)} A{angle[0]:.4f} C{angle[1]:.4f}",
        "M0",
    ]
    blocks, t = [], np.linspace(0.0, 1.0, PLACES + 1)
    heading, swing = rng.normal(size=3), rng.normal(size=2)
    for _ in range(int(rng.integers(5, 15))):
        feed = float(np.round(10.0 ** rng.uniform(2.0, 3.5)))
        heading, swing = heading + 0.5 * rng.normal(size=3), swing + 0.5 * rng.normal(size=2)
        size = 10.0 ** rng.uniform(0.0, 0.9)
        end = np.round(at + size * heading / np.linalg.norm(heading), 4)
        turned = np.round(angle + size * 0.8 * swing, 4)
        turned[0] = np.clip(turned[0], -90.0, 40.0)
        text.append(f"G1 {words(end)} A{turned[0]:.4f} C{turned[1]:.4f} F{feed:.0f}")
        joints = machine.joints(
            a=angle[0] + t * (turned[0] - angle[0]), c=angle[1] + t * (turned[1] - angle[1])
        )
        q = machine.place(joints, at + t[:, None] * (end - at))[0]
        length = float(np.linalg.norm(end - at))
        tip = np.tile((end - at) / length, (2, 1))
        rates = np.radians(turned - angle)[::-1] / length  # C, A: the order of the chain
        blocks.append(Dense(length * t, q, 0.0, feed / 60.0, tip, rates))
        at, angle = end, turned
    limits = MachineLimits(max_acceleration_mm_s2=WHOLE, corner_tolerance_mm=TOLERANCE)
    speed = np.array([axis.max_speed for axis in machine.axes])
    push = np.array([axis.max_acceleration for axis in machine.axes])
    borders = [corner(a, b, TOLERANCE, WHOLE, push[2:], push[:2]) for a, b in pairwise(blocks)]
    best = fastest(blocks, borders, speed=speed, acceleration=push, whole=WHOLE)
    return "\n".join([*text, "M30"]), machine, limits, best


def straight(seed):
    """Blocks without tool-centre-point control: all joints of a trunnion go straight, so the tip bends and the slides do not."""
    rng = np.random.default_rng(seed)
    machine = preset("xyzac-trt")
    at = np.round(np.append(rng.uniform(-40.0, 40.0, 3), [rng.uniform(-40, 20), rng.uniform(-180, 180)]), 4)
    text = ["G21 G90 G94 S1000 M3", f"G0 {words(at[:3])} A{at[3]:.4f} C{at[4]:.4f}", "M0"]
    blocks, t = [], np.linspace(0.0, 1.0, PLACES + 1)
    heading, swing = rng.normal(size=3), rng.normal(size=2)
    for _ in range(int(rng.integers(5, 15))):
        feed = float(np.round(10.0 ** rng.uniform(2.0, 3.5)))
        heading, swing = heading + 0.5 * rng.normal(size=3), swing + 0.5 * rng.normal(size=2)
        size = 10.0 ** rng.uniform(0.0, 0.9)
        end = np.round(at + size * np.append(heading / np.linalg.norm(heading), 2.0 * swing), 4)
        end[3] = np.clip(end[3], -90.0, 40.0)
        text.append(f"G1 {words(end[:3])} A{end[3]:.4f} C{end[4]:.4f} F{feed:.0f}")
        x, y, z, a, c = (at + t[:, None] * (end - at)).T
        q = machine.joints(degrees=True, x=x, y=y, z=z, a=a, c=c)
        fine = np.linspace(0.0, 1.0, 10 * PLACES + 1)[:, None]
        tips = machine.forward(q[0] + fine * (q[-1] - q[0])).tip
        length = float(np.linalg.norm(np.diff(tips, axis=0), axis=1).sum())
        rates = (q[-1] - q[0]) / length  # C, A, then the slides: the order of the chain
        order = [[axis.name.upper() for axis in machine.axes].index(name) for name in "XYZ"]
        blocks.append(Dense(length * t, q, 0.0, feed / 60.0, np.tile(rates[order], (2, 1)), rates[:2]))
        at = end
    limits = MachineLimits(max_acceleration_mm_s2=WHOLE, corner_tolerance_mm=TOLERANCE)
    speed = np.array([axis.max_speed for axis in machine.axes])
    push = np.array([axis.max_acceleration for axis in machine.axes])
    borders = [corner(a, b, TOLERANCE, WHOLE, push[order], push[:2]) for a, b in pairwise(blocks)]
    best = fastest(blocks, borders, speed=speed, acceleration=push, whole=WHOLE)
    return "\n".join([*text, "M30"]), machine, limits, best


def timed(case):
    text, machine, limits, best = case
    program = parse_program(
        (text + "\n").encode(),
        "p.nc",
        dialect="fanuc" if machine else "iso",
        rotary="AC" if machine else "",
        home=(0, 0, 0),
    )
    assert not program.errors, program.errors
    driven = Driven.of(Toolpath.of(program, machine))
    seconds = driven.times(limits).seconds
    return float(seconds[~driven.fast].sum()), best


def close(case):
    ours, best = timed(case)
    assert ours == pytest.approx(best, rel=5e-3)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kind", [planar, turning, straight])
def test_times_are_those_of_a_dense_integration(kind, seed):
    close(kind(seed))


@pytest.mark.long  # 20 s: 300 paths, dense
@pytest.mark.parametrize("kind", [planar, turning, straight])
def test_three_hundred_random_paths(kind):
    for seed in range(100):
        close(kind(seed))


def test_a_corner_of_straight_joints_costs_what_its_blend_costs():
    """The slides turn by 11 degrees and get slower while C turns faster: the blend driven densely, no corner rule in it.

    A parabola between the two directions misses the corner by |D| h / 4; it may take half of a block on each side.
    """
    slides, turning = np.array([600.0, 600.0, 600.0]), 4.0
    one, two = np.array([1.0, 0.0, 0.0, 0.02]), np.array([0.78, 0.15, 0.0, 0.05])
    length, tolerance, acceleration = 10.0, 0.02, np.append(slides, turning)
    for miss in (tolerance, 1.0):
        h = min(4.0 * miss / np.linalg.norm((two - one)[:3]), 0.5 * length)
        s = np.linspace(0.0, 2.0 * length, 8001)
        share = np.clip((s - length + h) / (2.0 * h), 0.0, 1.0)[:, None]
        rate = one + share * (two - one)
        q = np.vstack([np.zeros(4), np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(s)[:, None], axis=0)])
        # rotary joints take half of the shorter block, whatever the slides may miss
        wide = np.clip((s - 0.5 * length) / length, 0.0, 1.0)
        turn = one[3] + wide * (two[3] - one[3])
        q[:, 3] = np.append(0.0, np.cumsum(0.5 * (turn[1:] + turn[:-1]) * np.diff(s)))
        dense = Dense(s, q, 0.0, 1e4, np.zeros((2, 3)), np.zeros(0))
        best = fastest([dense], [], speed=np.full(4, np.inf), acceleration=acceleration, whole=1e9)
        way = Way(
            length=np.full(2, length), speed=np.full(2, 1e4), tangent=np.array([one, two]), turned=np.zeros(2),
            normal=np.full(2, 2), halt=np.zeros(2, dtype=bool), tolerance=np.full(2, miss), push=np.full(2, np.inf),
        )  # fmt: skip
        assert drive(way, axes=acceleration).seconds.sum() == pytest.approx(best, rel=5e-3)


def test_the_integration_itself_has_its_closed_forms():
    """From rest to rest over 10 mm at 100 mm/s and 1000 mm/s^2; a circle of 2 mm, the path at 1000 mm/s^2."""
    t = np.linspace(0.0, 1.0, PLACES + 1)
    tip = np.tile([1.0, 0.0, 0.0], (2, 1))
    line = Dense(10.0 * t, 10.0 * t[:, None] * [1.0, 0.0, 0.0], 0.0, 100.0, tip, np.zeros(0))
    free, limit = np.full(3, np.inf), np.full(3, 1000.0)
    assert fastest([line], [], speed=free, acceleration=limit, whole=1000.0) == pytest.approx(0.2, rel=1e-6)
    turn = 2.0 * np.pi * t
    q = 2.0 * np.column_stack([np.cos(turn), np.sin(turn), 0 * t])
    ring = Dense(2.0 * turn, q, 0.5, 1e6, np.tile([0.0, 1.0, 0.0], (2, 1)), np.zeros(0))
    # along and across alike: up to sqrt(a r) at a, once round, and down again
    top, whole = np.sqrt(2000.0), 4.0 * np.pi
    expected = 2.0 * top / 1000.0 + (whole - top**2 / 1000.0) / top
    found = fastest([ring], [], speed=free, acceleration=np.full(3, np.inf), whole=1000.0)
    assert found == pytest.approx(expected, rel=2e-3)
