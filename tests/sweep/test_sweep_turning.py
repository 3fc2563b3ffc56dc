"""Five-axis motions against the formulas of their interpolation, and the boxes of what they sweep."""

from __future__ import annotations

import warnings
from math import cos, pi, radians, sin

import numpy as np
import pytest
from sweep_inventions import BALL, BULL, TOOLS, holds

from vmachining.errors import AccuracyWarning, SweepError
from vmachining.geometry import Line
from vmachining.sweep import Pose, Sweep, Turn

T = np.linspace(0, 1, 41)
UP = (0.0, 0.0, 1.0)
CLOSE = 1e-13
"""Some hundred ulp of unit vectors and of angles of a few rad."""


def tilted(tilt: float, azimuth: float) -> np.ndarray:
    """Direction by two angles in degrees."""
    t, a = radians(tilt), radians(azimuth)
    return np.array([sin(t) * cos(a), sin(t) * sin(a), cos(t)])


TURNS = {
    "lean": Turn.great_circle(Pose((0, 0, 0), UP), Pose((40, 0, 0), tilted(15, 0))),
    "wide": Turn.great_circle(Pose((1, 2, 3), tilted(70, 30)), Pose((40, -20, 9), tilted(80, 200))),
    "tip": Turn.great_circle(Pose((0, 0, 0), UP), Pose((0, 0, 0), tilted(30, 90))),
    "ac": Turn.rotary((0, 0, 0), (0, 100, 0), "ac", {"a": 0.4, "c": pi}, {"a": 1.0, "c": 4 * pi / 3}),
    "bc": Turn.rotary((5, 0, 0), (0, 10, 20), "bc", (0.1, -1.0), (-0.7, 2.0)),
    "ab": Turn.rotary((5, 0, 0), (0, 10, 20), "ab", (0.1, -1.0), (1.7, 0.5)),
    "middle": Turn.through((0, 0, 0), (0, 0, 0), "ac", (0, 0), (radians(40), 0), control_height=25),
}

FORMULA = {
    "ac": lambda a, c: (np.sin(c) * np.sin(a), -np.cos(c) * np.sin(a), np.cos(a)),
    "hexa": lambda a, c: (np.sin(c) * np.sin(a), -np.cos(c) * np.sin(a), np.cos(a)),
    "bc": lambda b, c: (np.cos(c) * np.sin(b), np.sin(c) * np.sin(b), np.cos(b)),
    "ab": lambda a, b: (np.sin(b), -np.sin(a) * np.cos(b), np.cos(a) * np.cos(b)),
}


@pytest.mark.parametrize("chain", FORMULA)
def test_rotary_chains_follow_their_formula(chain):
    first, last = np.array([0.3, -1.2]), np.array([-0.9, 2.6])
    turn = Turn.rotary((0, 0, 0), (1, 2, 3), chain, first, last)
    angles = first + T[:, None] * (last - first)
    assert turn.axis(T) == pytest.approx(np.stack(FORMULA[chain](*angles.T), axis=1), abs=CLOSE)
    assert turn.position(T) == pytest.approx(np.outer(T, [1, 2, 3]), abs=CLOSE)
    named = dict(zip(chain if chain != "hexa" else "ac", first, strict=True))
    assert Turn.rotary((0, 0, 0), (1, 2, 3), chain, named, last).axis(0.3) == pytest.approx(turn.axis(0.3))


def test_a_great_circle_has_constant_rate_and_stays_in_its_plane():
    a, b = tilted(70, 30), tilted(80, 200)
    turn = TURNS["wide"]
    angle = float(np.arccos(a @ b))
    expected = (np.sin((1 - T) * angle)[:, None] * a + np.sin(T * angle)[:, None] * b) / sin(angle)
    assert turn.axis(T) == pytest.approx(expected, abs=CLOSE)
    assert np.linalg.norm(turn.axis_rate(T), axis=1) == pytest.approx(angle, abs=CLOSE)
    assert turn.rotation == pytest.approx(angle, abs=CLOSE)


@pytest.mark.parametrize("angle", [1e-12, 1e-9, 1e-5, 3.1, pi - 1e-6])
def test_tiny_and_huge_great_circles_meet_their_ends(angle):
    a = tilted(50, 10)
    side = np.cross(a, UP) / np.linalg.norm(np.cross(a, UP))
    b = cos(angle) * a + sin(angle) * side
    turn = Turn.great_circle(Pose((0, 0, 0), a), Pose((1, 0, 0), b))
    assert turn.axis([0.0, 1.0]) == pytest.approx(np.stack([a, b]), abs=1e-15)
    assert turn.rotation == pytest.approx(angle, rel=1e-3, abs=1e-15)  # the ends are only good to an ulp


@pytest.mark.parametrize("name", TURNS)
def test_derivatives(name):
    """Central differences: error h^2 |f'''| / 6, rounding ulp / h^k."""
    turn, h = TURNS[name], 1e-4
    t = T[1:-1]
    for f, d, dd in (
        (turn.position, turn.velocity, turn.acceleration),
        (turn.axis, turn.axis_rate, turn.axis_acceleration),
    ):
        assert d(t) == pytest.approx((f(t + h) - f(t - h)) / (2 * h), abs=2e-5)
        assert dd(t) == pytest.approx((f(t + h) - 2 * f(t) + f(t - h)) / h**2, abs=2e-4)
    assert np.linalg.norm(turn.axis(T), axis=1) == pytest.approx(1, abs=CLOSE)
    assert (turn.axis(T) * turn.axis_rate(T)).sum(1) == pytest.approx(0, abs=CLOSE)


@pytest.mark.parametrize("name", TURNS)
def test_parts_continue_each_other(name):
    turn = TURNS[name]
    cuts = [0.0, 0.2, 0.2, 0.65, 1.0]
    for part, a, b in zip(turn.split(cuts[1:-1]), cuts[:-1], cuts[1:], strict=True):
        t = a + (b - a) * T
        assert part.position(T) == pytest.approx(turn.position(t), abs=1e-12)
        assert part.axis(T) == pytest.approx(turn.axis(t), abs=CLOSE)
        assert part.velocity(T) == pytest.approx((b - a) * turn.velocity(t), abs=1e-12)
        assert part.axis_acceleration(T) == pytest.approx((b - a) ** 2 * turn.axis_acceleration(t), abs=1e-12)
    assert (turn.split([0.5])[0].end == turn.split([0.5])[1].start).all()


@pytest.mark.parametrize("name", TURNS)
def test_turned_bounds_are_bounds(name):
    turn = TURNS[name]
    fine = np.linspace(0, 1, 20001)
    arc = float(np.linalg.norm(np.diff(turn.axis(fine), axis=0), axis=1).sum())
    assert arc <= turn.rotation + 1e-12
    assert turn.rotation <= 1.01 * arc + 1e-12
    where = turn.position(fine)
    assert (turn.bounds[0] <= where.min(0) + 1e-12).all()
    assert (turn.bounds[1] >= where.max(0) - 1e-12).all()
    assert turn.bounds == pytest.approx(np.stack([where.min(0), where.max(0)]), abs=1e-3)
    assert turn.length == pytest.approx(
        np.linalg.norm(np.diff(where, axis=0), axis=1).sum(), rel=1e-4, abs=1e-9
    )


def test_the_control_point_moves_linearly():
    turn = Turn.through((1, 2, 3), (4, 8, -1), "ac", (0.2, 0.1), (0.9, -2.0), control_height=7)
    line = np.array([1, 2, 3]) + np.outer(T, [3, 6, -4])
    assert turn.position(T) + 7 * turn.axis(T) == pytest.approx(line, abs=1e-12)


def test_joint_linear_motion_on_a_trunnion():
    """A published forward kinematics: C and A table, A through (y 0, z -50), half way of a block."""
    chain = [("R", (0, 0, 1), (0, 0, 0), -1), ("R", (1, 0, 0), (0, 0, -50), -1)]
    chain += [("L", d, (0, 0, 0), 1) for d in np.eye(3)]
    q0 = [radians(70), radians(10), 4.283879525, 30.834254253, 11.285374608]
    q1 = [radians(65), radians(12), 8.264270861, 29.045301677, 12.402502175]
    turn = Turn.joints(chain, q0, q1)
    printed = 2e-9  # mm: ten digits
    assert turn.position([0.0, 0.5, 1.0]) == pytest.approx(
        np.array([[40, 10, 5], [40.455656180, 9.966271412, 4.994912101], [41, 10, 5]]), abs=printed
    )
    assert turn.axis(0.5) == pytest.approx([0.176284525, 0.073019441, 0.981627183], abs=1e-9)
    assert not turn.is_straight


def test_a_turn_without_turning_is_a_line():
    a = tilted(30, 20)
    steady = Turn.great_circle(Pose((0, 0, 0), a), Pose((10, 5, 3), a))
    assert steady.is_steady
    assert not steady.is_upright
    assert steady.rotation == 0
    whole = Sweep.along(BULL, steady)
    plain, frame = whole.upright() or pytest.fail("a steady axis has an upright twin")
    assert isinstance(plain.path, Line)
    assert frame @ a == pytest.approx(UP, abs=1e-15)
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-15)
    assert np.linalg.det(frame) == pytest.approx(1)
    assert plain.path.end == pytest.approx(frame @ [10, 5, 3])
    upright = Sweep.along(BULL, Turn.rotary((0, 0, 0), (3, 0, 0), "ac", (0, 0), (0, 2)))
    assert isinstance(upright.path, Line)  # c turns about the tool axis
    assert Sweep.along(BULL, TURNS["lean"]).upright() is None


@pytest.mark.parametrize("tool", TOOLS)
@pytest.mark.parametrize("name", TURNS)
def test_the_box_holds_every_pose_and_is_tight(tool, name):
    profile, turn = TOOLS[tool].profile, TURNS[name]
    sweep = Sweep.along(TOOLS[tool], turn)
    u = np.linspace(0, 2 * pi, 73)
    r, z = [np.array([0.0])], [np.array([profile.z_min])]
    for s in profile.segments:
        low, high = s.beta
        beta = np.linspace(low, high, 33)
        share = np.linspace(0, 1, 2)
        r.append(s.cr + s.radius * np.cos(beta) if s.is_arc else s.r0 + (s.r1 - s.r0) * share)
        z.append(s.cz + s.radius * np.sin(beta) if s.is_arc else s.z0 + (s.z1 - s.z0) * share)
    rho, height = np.concatenate(r)[:, None], np.concatenate(z)[:, None]
    points = []
    for t in np.linspace(0, 1, 61):
        a = turn.axis(t)
        e = np.cross(a, np.eye(3)[int(np.argmin(np.abs(a)))])
        e /= np.linalg.norm(e)
        m = np.cos(u)[:, None] * e + np.sin(u)[:, None] * np.cross(a, e)
        points.append((turn.position(t) + height[..., None] * a + rho[..., None] * m).reshape(-1, 3))
    cloud = np.concatenate(points)
    assert (sweep.bounds[0] <= cloud.min(0) + 1e-9).all()
    assert (sweep.bounds[1] >= cloud.max(0) - 1e-9).all()
    assert sweep.bounds == pytest.approx(np.stack([cloud.min(0), cloud.max(0)]), abs=0.08)  # samples' sagitta


def test_a_tilted_pose_sweeps_like_the_upright_one():
    a = tilted(40, 70)
    whole = Sweep(BALL, Pose((0, 0, 0), a), Pose((20, 3, 4), a))
    plain, frame = whole.upright() or pytest.fail("steady")
    assert whole.volume == plain.volume
    points = np.random.default_rng(0).uniform(-20, 40, (300, 3))
    assert (whole.contains(points) == plain.contains(points @ frame.T)).all()
    local = points @ frame.T - frame @ np.array([0, 0, 0])
    assert whole.contains(points)[holds(BALL.profile, local)].all()
    rays = whole.ray_intervals(points, (0, 0, 1))
    assert rays.lengths == pytest.approx(plain.ray_intervals(points @ frame.T, frame @ UP).lengths)


def test_other_lengths_of_an_axis_are_corrected_with_a_warning():
    with pytest.warns(AccuracyWarning, match="length 2"):
        turn = Turn.great_circle(Pose((0, 0, 0), (0, 0, 2)), Pose((1, 0, 0), (0, 1, 0)))
    assert turn.axis(0.0) == pytest.approx(UP)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Turn.great_circle(Pose((0, 0, 0), (0, 0, 1 + 5e-7)), Pose((1, 0, 0), (0, 1, 0)))


NAN, INF = float("nan"), float("inf")


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (
            lambda: Turn.great_circle(Pose((0, 0, 0), (0, 0, 0)), Pose((1, 0, 0))),
            "start axis has length zero",
        ),
        (lambda: Turn.great_circle(Pose((0, 0, 0)), Pose((1, 0, 0), (0, NAN, 1))), "end axis"),
        (lambda: Turn.great_circle(Pose((0, 0, INF)), Pose((1, 0, 0), (0, 1, 0))), "start"),
        (lambda: Turn.great_circle(Pose((0, 0, 0)), Pose((1, 0, 0), (0, 0, -1))), "opposite"),
        (lambda: Sweep(BALL, Pose((0, 0, 0)), Pose((1, 0, 0), (0, 0, -1))), "opposite"),
        (lambda: Turn.rotary((0, 0, 0), (1, 0, 0), "ca", (0, 0), (1, 1)), "chain 'ca'"),
        (lambda: Turn.rotary((0, 0, 0), (1, 0, 0), "ac", {"a": 0, "b": 0}, (1, 1)), "give a and c"),
        (lambda: Turn.rotary((0, 0, 0), (1, 0, 0), "ac", (0, 0, 0), (1, 1)), "start angles"),
        (lambda: Turn.rotary((0, 0, 0), (1, 0, 0), "ac", (0, 0), (1, INF)), "end angles"),
        (lambda: Turn.through((0, 0, 0), (1, 0, 0), "ac", (0, 0), (1, 1), control_height=NAN), "control"),
        (lambda: Turn.joints([("X", (0, 0, 1), (0, 0, 0), 1)], [0], [1]), "kind 'X'"),
        (lambda: Turn.joints([("R", (0, 0, 0), (0, 0, 0), 1)], [0], [1]), "joint 1 axis"),
        (lambda: Turn.joints([("R", (0, 0, 1), (0, 0, 0), 1)], [0, 1], [1]), "q0"),
    ],
)
def test_refusals_name_what_is_wrong(make, word):
    with pytest.raises(SweepError, match=word):
        make()
