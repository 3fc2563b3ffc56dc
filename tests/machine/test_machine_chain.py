"""Forward and inverse kinematics of every preset: round trips, branches, singularities, derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from machines import FIVE_AXIS, joints, machine

from vmachining.errors import KinematicsError
from vmachining.geometry import rotation
from vmachining.geometry.rotation import angle_between
from vmachining.machine import Axis, Machine, preset

ROUND_TRIP = 1e-9  # mm and unit of the axis, the promise of the room


def round_trip(m: Machine, q: np.ndarray) -> np.ndarray:
    """Largest error of each pose over all branches; every pose must have one."""
    pose = m.forward(q)
    found = m.inverse(*pose)
    assert found.reachable.all()
    worst = np.zeros(len(q))
    for branch in (0, 1):
        given = np.isfinite(found.joints[:, branch]).all(axis=1)
        back = m.forward(found.joints[given, branch])
        error = np.maximum(np.abs(back.tip - pose.tip[given]), np.abs(back.axis - pose.axis[given])).max(
            axis=1
        )
        worst[given] = np.maximum(worst[given], error)
    return worst


@pytest.mark.parametrize("name", FIVE_AXIS)
def test_forward_inverse_forward(name):
    m = machine(name)
    assert round_trip(m, joints(m, np.random.default_rng(1), 2000)).max() < ROUND_TRIP


@pytest.mark.parametrize("name", FIVE_AXIS)
def test_round_trip_near_singularities(name):
    """Second rotary from 1e-16 to 0.1 rad away from 0, a quarter, a half and three quarters of a turn."""
    m = machine(name)
    rng = np.random.default_rng(2)
    q = joints(m, rng, 2000)
    near = rng.choice([0.0, 0.5, 1.0, -0.5], 2000) * np.pi
    q[:, m.rotary[1]] = near + rng.choice([-1, 1], 2000) * 10.0 ** rng.uniform(-16, -1, 2000)
    assert round_trip(m, q).max() < ROUND_TRIP


@pytest.mark.parametrize("name", FIVE_AXIS)
def test_the_joints_we_came_from_are_among_the_solutions(name):
    m = machine(name)
    rng = np.random.default_rng(4)
    q = joints(m, rng, 500)
    q[:, m.rotary[1]] = rng.uniform(0.1, 1.4, 500) * rng.choice([-1, 1], 500)
    found = m.inverse(*m.forward(q))
    delta = found.joints - q[:, None, :]
    turning = list(m.rotary)
    delta[:, :, turning] -= 2 * np.pi * np.round(delta[:, :, turning] / (2 * np.pi))
    assert np.nanmin(np.abs(delta).max(axis=2), axis=1).max() < 1e-9
    assert (found.count == 2).all()


SLIDE_OUTBOARD = [
    # lists from the workpiece to the tool, d of slides and rotary axes as in the spec's hardest chains
    "XbYaZ", "XYZab", "aXbYZ", "bXYaZ", "abXYZ", "cXYZb", "XYZca", "cbXYZ", "XcYbZ",
]  # fmt: skip


@pytest.mark.parametrize("order", SLIDE_OUTBOARD)
def test_any_order_of_slides_and_rotary_axes(order):
    rng = np.random.default_rng(5)
    ways = dict(zip("xyzabc", [*np.eye(3), *np.eye(3)], strict=True))
    axes = [
        Axis(letter.upper(), "rotary" if letter in "abc" else "linear", ways[letter.lower()],
             point=rng.uniform(-50, 50, 3), sign=int(rng.choice([-1, 1])))
        for letter in order
    ]  # fmt: skip
    m = Machine(order, axes, tip=rng.uniform(-50, 50, 3))
    q = joints(m, rng, 2000)
    # away from slide singularities, where the error is that of a linear system with determinant det
    q = q[np.nanmin(m.inverse(*m.forward(q)).slide_det, axis=1) > 1e-2]
    assert len(q) > 1000
    assert round_trip(m, q).max() < ROUND_TRIP


def test_rotary_axes_and_tools_in_any_direction():
    """Machines as they are built: nothing square to anything, and slides that are not perpendicular."""
    rng = np.random.default_rng(9)
    for _ in range(150):
        ways = rng.normal(size=(5, 3))
        kinds = rng.permutation(["rotary", "rotary", "linear", "linear", "linear"])
        axes = [
            Axis(name, kind, way, point=rng.uniform(-50, 50, 3), sign=int(rng.choice([-1, 1])))
            for name, kind, way in zip("ABXYZ", kinds, ways, strict=True)
        ]
        m = Machine("skew", axes, tip=rng.uniform(-50, 50, 3), tool=rng.normal(size=3))
        q = joints(m, rng, 40)
        det = m.inverse(*m.forward(q)).slide_det
        q = q[np.nanmin(det, axis=1) > 1e-2]
        if len(q):
            assert round_trip(m, q).max() < ROUND_TRIP


def test_slide_singularity_is_reported():
    x, y, z = (Axis(n, "linear", d) for n, d in zip("XYZ", np.eye(3), strict=True))
    m = Machine("XBYAZ", [x, Axis("B", "rotary", (0, 1, 0)), y, Axis("A", "rotary", (1, 0, 0)), z])
    for a, b in ((0.3, 0.4), (1.2, -0.7), (0.0, 1.5)):
        found = m.inverse(*m.forward(m.joints(a=[a], b=[b], degrees=False)))
        np.testing.assert_allclose(found.slide_det[0, 0], abs(np.cos(a) * np.cos(b)), atol=1e-12)
    found = m.inverse(*m.forward(m.joints(a=[20.0], b=[90.0])))
    assert not found.reachable[0] and np.nanmax(found.slide_det) < 1e-9


@pytest.mark.parametrize("nutation", [45.0, 30.0])
def test_a_nutating_head_reaches_twice_its_nutation(nutation):
    m = preset("nutating-head", nutation_deg=nutation, pivot_mm=120.0)
    rng = np.random.default_rng(6)
    u = rng.normal(size=(4000, 3))
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    tilt = angle_between(u, (0, 0, 1))
    found = m.inverse(np.zeros((4000, 3)), u)
    np.testing.assert_array_equal(found.reachable, tilt <= np.radians(2 * nutation))
    # the share of the sphere is that of a cap; a binomial count of 4000 has a deviation of 0.008 at most
    assert abs(found.reachable.mean() - np.sin(np.radians(nutation)) ** 2) < 4 * 0.008


def test_singular_and_boundary_poses_are_reported():
    m = preset("ac-table")
    upright = m.inverse([(1, 2, 3)], [(0, 0, 1)])
    assert upright.singular[0] and upright.boundary[0] and upright.count[0] == 1
    assert upright.joints[0, 0, 0] == 0.0
    tilted = m.inverse([(1, 2, 3)], [(0, 1e-6, 1)])
    assert not tilted.singular[0] and tilted.count[0] == 2
    n = preset("nutating-head")
    stop = n.inverse([(0, 0, 0)], [(1, 0, 0)])
    assert stop.boundary[0] and not stop.singular[0] and stop.count[0] == 1
    assert not n.inverse([(0, 0, 0)], [(1, 0, -1e-6)]).reachable[0]


def test_fewer_rotary_axes():
    assert preset("xyz").inverse([(1, 2, 3)], [(0, 0, 2)]).joints[0, 0].tolist() == [1, 2, 3]
    assert not preset("xyz").inverse([(1, 2, 3)], [(0, 1e-3, 1)]).reachable[0]
    axes = [Axis(n, "linear", d) for n, d in zip("XYZ", np.eye(3), strict=True)]
    four = Machine("four", [Axis("A", "rotary", (1, 0, 0), point=(0, 0, -20)), *axes])
    q = four.joints(x=[3.0], y=[4.0], z=[5.0], a=[37.0])
    np.testing.assert_allclose(four.inverse(*four.forward(q)).joints[0, 0], q[0], atol=1e-12)
    assert not four.inverse([(0, 0, 0)], [(1e-3, 0, 1)]).reachable[0]


@pytest.mark.parametrize("name", FIVE_AXIS)
def test_derivatives_against_differences(name):
    """Central differences; their error is h^2/6 and h^2/12 times a derivative of some 1e3 mm, plus rounding."""
    m = machine(name)
    rng = np.random.default_rng(7)
    q, speed = joints(m, rng, 50), rng.uniform(-1, 1, (50, len(m.axes)))
    rates = m.rates(q, speed)
    h = 1e-4
    ahead, behind = m.forward(q + h * speed), m.forward(q - h * speed)
    np.testing.assert_allclose((ahead.tip - behind.tip) / (2 * h), rates.velocity, atol=1e-4)
    np.testing.assert_allclose((ahead.axis - behind.axis) / (2 * h), rates.axis_rate, atol=1e-6)
    np.testing.assert_allclose((ahead.tip + behind.tip - 2 * rates.tip) / h**2, rates.acceleration, atol=1e-3)
    np.testing.assert_allclose(
        (ahead.axis + behind.axis - 2 * rates.axis) / h**2, rates.axis_acceleration, atol=1e-5
    )


def test_moving_everything_together_changes_nothing():
    """A machine and its part turned in space give the same pose in the part."""
    m = machine("c-table-b-head")
    turn, shift = rotation((0.6, 0.0, 0.8), 1.1), np.array([5.0, -6.0, 7.0])
    axes = [
        Axis(a.name, a.kind, turn @ a.direction, point=turn @ a.point + shift, sign=a.sign) for a in m.axes
    ]
    frame = np.eye(4)
    frame[:3, :3], frame[:3, 3] = turn, shift
    moved = Machine(
        "moved", axes, tip=turn @ m.tip + shift, tool=turn @ m.tool, work=frame @ m.work, table=m.table
    )
    q = joints(m, np.random.default_rng(8), 100)
    np.testing.assert_allclose(moved.forward(q).tip, m.forward(q).tip, atol=1e-11)
    np.testing.assert_allclose(moved.forward(q).axis, m.forward(q).axis, atol=1e-13)


def test_names_and_units():
    m = preset("ac-table")
    assert m.chain == "C'A'|XYZ" and m.names == ("C", "A", "X", "Y", "Z")
    q = m.joints(x=[1, 2], a=30)
    assert q.shape == (2, 5)
    np.testing.assert_allclose(m.named(q)["A"], 30.0)
    with pytest.raises(KinematicsError, match="no joint B"):
        m.joints(b=1)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Axis("C", "rotary", (0, 0, 0)), "no length"),
        (lambda: Axis("C", "rotary", (0, 0, 1), sign=2), "sign is 2"),
        (lambda: Axis("C", "turning", (0, 0, 1)), "axis C"),
        (lambda: Axis("C", "rotary", (0, 0, 1), lower=1, upper=1), "is empty"),
        (lambda: Axis("C", "rotary", (0, 0, 1), max_speed=0), "max_speed"),
        (lambda: Axis("C", "rotary", (0, np.nan, 1)), "finite"),
        (lambda: Machine("m", []), "no joints"),
        (lambda: Machine("m", [Axis("X", "linear", (1, 0, 0))] * 2), "given twice"),
        (lambda: Machine("m", [Axis("X", "linear", (1, 0, 0))], work=2 * np.eye(4)), "not a rotation"),
        (lambda: Machine("m", [Axis("X", "linear", (1, 0, 0))], tool=(0, 0, 0)), "no direction"),
        (lambda: preset("ac-table").inverse([(0, 0, 0)], [(0, 0, 0)]), "axis 0 has no direction"),
        (lambda: preset("ac-table").inverse([(0, 0, 0)] * 2, [(0, 0, 1)]), "2 tips and 1 axes"),
        (lambda: preset("ac-table").forward([1, 2, 3]), "expected 5 columns"),
        (lambda: Machine("m", [Axis("X", "linear", (1, 0, 0))]).inverse([(0, 0, 0)], [(0, 0, 1)]), "three slides"),
        (lambda: preset("ac-table").with_tool(np.inf), "tool length"),
    ],
)  # fmt: skip
def test_refusals(make, message):
    with pytest.raises(KinematicsError, match=message):
        make()


def test_rotary_axes_that_cannot_orient_the_tool():
    slides = [Axis(n, "linear", d) for n, d in zip("XYZ", np.eye(3), strict=True)]
    spin = Machine("AC", [*slides, Axis("A", "rotary", (1, 0, 0)), Axis("C", "rotary", (0, 0, 1))])
    with pytest.raises(KinematicsError, match="only spins the tool"):
        spin.inverse([(0, 0, 0)], [(0, 0, 1)])
    parallel = Machine("AA", [*slides, Axis("A", "rotary", (1, 0, 0)), Axis("U", "rotary", (1, 0, 0))])
    with pytest.raises(KinematicsError, match="parallel"):
        parallel.inverse([(0, 0, 0)], [(0, 0, 1)])
