"""Published and closed-form kinematics: classes 2/0, 1/1, 0/2, common machines, LinuxCNC, the hexapod."""

from __future__ import annotations

import numpy as np
import pytest
from oracles.frame_machines import FrameMachine
from oracles.head_models import ca_acceleration, ca_axis, ca_omega, ca_rate, hexapod_matrix, hexapod_omega

from vmachining.geometry import rotation
from vmachining.machine import preset
from vmachining.machine.presets import class_chain

sin, cos = np.sin, np.cos
EX, EY, EZ = np.eye(3)
OFFSETS = {"t12": (10, 20, 30), "t23": (0, 5, -40), "t34": (0, 0, -100)}
POINT, A, B = (25.0, -15.0, 40.0), np.radians(30), np.radians(20)
PRINTED = 6e-10  # nine decimals

# worked example of the kinematics chapter, recomputed from its stepwise equations; nine decimals
EXAMPLE = {
    "2/0": ((-39.412763627, -8.169872981, -79.428453901), (-39.412763627, -8.169872981, -79.428453901),
            (0.813797681, 0.469846310, -0.342020143)),
    "1/1": ((11.488528471, 26.830127019, -212.878072574), (-62.012903465, 26.830127019, -203.969262079),
            (-0.296198133, 0.171010072, -0.939692621)),
    "0/2": ((-8.349364905, 77.243186761, -109.132001256), (10.398992834, 34.710313746, -128.969262079),
            (-0.939692621, -0.171010072, 0.296198133)),
}  # fmt: skip


@pytest.mark.parametrize("kind", EXAMPLE)
@pytest.mark.erratum("book", "2-7, 2-9, 2-11", "B A (W + T12) + T23", "B (A (W + T12) + T23)")
@pytest.mark.erratum(
    "book",
    "2-21, 2-32",
    "components in the frame of the tool as coordinates of the machine",
    "M = B^T P4 and (B A)^T P4, if the slides do not turn",
)
def test_the_worked_example(kind):
    m = FrameMachine(kind, **OFFSETS)
    components, slides, axis = EXAMPLE[kind]
    np.testing.assert_allclose(m.components(POINT, A, B), components, atol=PRINTED)
    np.testing.assert_allclose(m.slides(POINT, A, B), slides, atol=PRINTED)
    np.testing.assert_allclose(m.axis(A, B), axis, atol=PRINTED)


@pytest.mark.erratum(
    "book", "2-23, 2-24", "G W + T12 and G (W + T12)", "one of both: T12 in turned axes, or G T12"
)
def test_class_02_with_its_first_offset_in_workpiece_axes():
    g = np.array([[0, -1, 0], [0, 0, 1], [-1, 0, 0]])
    m = FrameMachine("0/2", **{**OFFSETS, "t12": g @ OFFSETS["t12"]})
    want = (-39.330127019, 84.966579996, -148.888026910)
    np.testing.assert_allclose(m.components(POINT, A, B), want, atol=PRINTED)


@pytest.mark.parametrize("kind", EXAMPLE)
def test_the_chain_of_a_class_is_its_closed_form(kind):
    rng = np.random.default_rng(1)
    offsets = dict(zip(("t12", "t23", "t34"), rng.normal(0, [[30], [30], [80]], (3, 3)), strict=True))
    m = FrameMachine(kind, **offsets)
    w, a, b = rng.normal(0, 50, (1000, 3)), rng.uniform(-3, 3, 1000), rng.uniform(-3, 3, 1000)
    chain, s = class_chain(kind, **offsets), m.slides(w, a, b)
    pose = chain.forward(chain.joints(a=a, b=b, x=s[:, 0], y=s[:, 1], z=s[:, 2], degrees=False))
    np.testing.assert_allclose(pose.tip, w, atol=1e-12)
    np.testing.assert_allclose(pose.axis, m.axis(a, b), atol=1e-14)
    np.testing.assert_allclose(m.point(m.components(w, a, b), a, b), w, atol=1e-12)
    both = m.angles(m.axis(a, b))
    for branch in (0, 1):
        np.testing.assert_allclose(m.axis(*np.moveaxis(both[:, branch], -1, 0)), m.axis(a, b), atol=1e-13)
    turns = (both - np.stack([a, b], axis=1)[:, None, :]) / (2 * np.pi)
    assert (np.abs(turns - np.round(turns)).max(axis=2).min(axis=1) < 1e-9).all()


@pytest.mark.parametrize("kind", EXAMPLE)
def test_angles_at_the_pole_are_finite(kind):
    m = FrameMachine(kind)
    pole = EX if kind == "0/2" else EZ
    for u in (pole, -pole):
        for a, b in m.angles(u):
            np.testing.assert_allclose(m.axis(a, b), u, atol=1e-15)


AXES = {
    # tool axis of common machines, home along +z; a, b, c are the coordinates of the program
    "ac-table": lambda a, b, c: (sin(c) * sin(a), cos(c) * sin(a), cos(a)),
    "bc-table": lambda a, b, c: (-cos(c) * sin(b), sin(c) * sin(b), cos(b)),
    "ca-head": lambda a, b, c: (sin(c) * sin(a), -cos(c) * sin(a), cos(a)),
    "cb-head": lambda a, b, c: (cos(c) * sin(b), sin(c) * sin(b), cos(b)),
    "c-table-b-head": lambda a, b, c: (cos(c) * sin(b), -sin(c) * sin(b), cos(b)),
    "ba-table": lambda a, b, c: (-sin(b) * cos(a), sin(a), cos(b) * cos(a)),
    "ab-head": lambda a, b, c: (sin(b), -sin(a) * cos(b), cos(a) * cos(b)),
    # formulas of sweep files and pose tables
    "ac": lambda a, b, c: rotation(EZ, c) @ rotation(EX, a) @ EZ,
    "hexa": lambda a, b, c: rotation(EZ, c) @ rotation(EX, a) @ rotation(EZ, -c) @ EZ,
    "bc": lambda a, b, c: rotation(EZ, c) @ rotation(EY, b) @ EZ,
    "ab": lambda a, b, c: rotation(EX, a) @ rotation(EY, b) @ EZ,
    # impeller and boat programs
    "xyzac-trt": lambda a, b, c: (sin(c) * sin(a), cos(c) * sin(a), cos(a)),
}


@pytest.mark.parametrize("name", AXES)
def test_tool_axes_of_common_machines(name):
    m = preset(name)
    for a, b, c in np.random.default_rng(2).uniform(-3, 3, (20, 3)):
        words = {n: v for n, v in {"a": a, "b": b, "c": c}.items() if n.upper() in m.names}
        got = m.forward(m.joints(degrees=False, **words)).axis
        np.testing.assert_allclose(got, AXES[name](a, b, c), atol=1e-15)


@pytest.mark.parametrize(("name", "tilt"), [("xyzac-trt", "a"), ("xyzbc-trt", "b")])
def test_linuxcnc_tables(name, tilt):
    """Part point under the tool, written as two rotations of a point fixed in space about axes fixed in space.

    The tilting axis lies (20, 10) mm beside and above the rotating one; both turn against the right-hand rule
    as seen by the part (LinuxCNC's remark on its `trt` machines).
    """
    rng = np.random.default_rng(3)
    rot = np.array([7.0, -8.0, 9.0])
    m = preset(name, rot_point=rot)
    x, y, z = rng.uniform(-100, 100, (3, 200))
    first, c = rng.uniform(-1.7, 0.8, 200), rng.uniform(-9, 9, 200)
    # tilt about a line parallel to x (or y)
    across = y - rot[1] - 20.0 if tilt == "a" else x - rot[0] - 20.0
    up, s = z - rot[2] - 10.0, (1.0 if tilt == "a" else -1.0)
    level = across * cos(first) + s * up * sin(first) + 20.0
    height = -s * across * sin(first) + up * cos(first) + 10.0
    px, py = (x - rot[0], level) if tilt == "a" else (level, y - rot[1])
    want = [px * cos(c) + py * sin(c) + rot[0], -px * sin(c) + py * cos(c) + rot[1], height + rot[2]]
    got = m.forward(m.joints(x=x, y=y, z=z, c=c, degrees=False, **{tilt: first}))
    np.testing.assert_allclose(got.tip, np.transpose(want), atol=1e-12)


def skew(omega):
    return np.cross(np.eye(3), omega)


@pytest.mark.erratum(
    "book", "3-11", "first components with the wrong functions", "derivative of the rotation, by differences"
)
def test_angular_velocities_of_head_and_hexapod():
    """omega x from R' R^T by central differences: error h^2/6 times third derivatives of order 10."""
    rng, h = np.random.default_rng(4), 1e-5
    for a, c, da, dc in rng.uniform(-2, 2, (50, 4)):
        serial = lambda t: rotation(EZ, c + t * dc) @ rotation(EX, a + t * da)  # noqa: B023, E731
        hexa = lambda t: hexapod_matrix(a + t * da, c + t * dc)  # noqa: B023, E731
        for turn, omega in ((serial, ca_omega(a, c, da, dc)), (hexa, hexapod_omega(a, c, da, dc))):
            rate = (turn(h) - turn(-h)) / (2 * h)
            np.testing.assert_allclose(rate @ turn(0.0).T, skew(omega), atol=1e-8)
            np.testing.assert_allclose(rate @ EZ, ca_rate(a, c, da, dc), atol=1e-8)
            np.testing.assert_allclose(turn(0.0) @ EZ, ca_axis(a, c), atol=1e-15)
            np.testing.assert_allclose(np.cross(omega, ca_axis(a, c)), ca_rate(a, c, da, dc), atol=1e-14)
        # the two differ by the spin -dc A
        np.testing.assert_allclose(
            hexapod_omega(a, c, da, dc) - ca_omega(a, c, da, dc), -dc * ca_axis(a, c), atol=1e-14
        )
        second = (ca_rate(a + h * da, c + h * dc, da, dc) - ca_rate(a - h * da, c - h * dc, da, dc)) / (2 * h)
        np.testing.assert_allclose(ca_acceleration(a, c, da, dc), second, atol=1e-7)


def test_rates_of_the_chain_are_those_of_the_head():
    m = preset("ca-head", pivot_mm=150.0)
    rng = np.random.default_rng(5)
    q, dq = rng.uniform(-2, 2, (2, 100, 5))
    rates = m.rates(q, dq)
    a, c, da, dc = q[:, 4], q[:, 3], dq[:, 4], dq[:, 3]
    np.testing.assert_allclose(rates.axis_rate, ca_rate(a, c, da, dc), atol=1e-14)
    np.testing.assert_allclose(rates.axis_acceleration, ca_acceleration(a, c, da, dc), atol=1e-13)
    # tip = slides + pivot - 150 A
    np.testing.assert_allclose(rates.velocity, dq[:, :3] - 150 * rates.axis_rate, atol=1e-11)
    np.testing.assert_allclose(rates.acceleration, -150 * rates.axis_acceleration, atol=1e-11)
