"""Times of whole paths against closed forms, and against two outside programs: toppra (axes) and ruckig (jerk)."""

from __future__ import annotations

import time

import numpy as np
import pytest
from slowness import slowness

from vmachining.machine import Way, drive
from vmachining.machine.lookahead import rest_to_rest_s

INF = np.inf


def polyline(points, feed, *, tolerance=0.01, halt=False):
    p = np.asarray(points, dtype=float)
    step = np.diff(p, axis=0)
    length = np.linalg.norm(step, axis=1)
    n = len(length)
    return Way(
        length=length, speed=np.full(n, feed), tangent=step / length[:, None], turned=np.zeros(n),
        normal=np.full(n, 2), halt=np.full(n, halt), tolerance=np.full(n, tolerance), push=np.full(n, INF),
    )  # fmt: skip


def circle(radius, angle, feed):
    return Way(
        length=np.array([radius * abs(angle)]), speed=np.array([feed]), tangent=np.array([[0.0, np.sign(angle), 0.0]]),
        turned=np.array([angle]), normal=np.array([2]), halt=np.array([False]), tolerance=np.array([0.01]),
        push=np.array([INF]),
    )  # fmt: skip


def seconds(way, **limits):
    return drive(way, **limits).seconds.sum()


def test_strokes_stop_at_every_reversal():
    """Ten strokes of 10 mm and back at F6000 and 1000 mm/s^2: 0.1 s of ramps and 0.1 s for 10 mm less them, each."""
    there = [[10.0 * (k % 2), 0.0, 0.0] for k in range(21)]
    assert seconds(polyline(there, 100.0), whole=1000.0) == pytest.approx(4.0, rel=1e-12)


def test_a_zigzag_with_exact_stops():
    """100 blocks of 1 mm from rest to rest: 2 sqrt(L / a) each."""
    p = np.cumsum([[0, 0, 0]] + [[k % 2, (k + 1) % 2, 0] for k in range(100)], axis=0)
    exact = seconds(polyline(p, 100.0, halt=True), whole=1000.0)
    assert exact == pytest.approx(100 * 2 * np.sqrt(1 / 1000), rel=1e-12)
    # a corner of 90 degrees rounded within e: v^2 = a e c / (1 - c), c = cos 45; between two such corners 1 mm
    c = np.sqrt(0.5)
    u = 1000 * 0.01 * c / (1 - c)
    top = np.sqrt(1000 + u)
    inner, outer = 2 * (top - np.sqrt(u)) / 1000, None
    v1 = np.sqrt(0.5 * u + 1000)
    outer = (2 * v1 - np.sqrt(u)) / 1000
    assert seconds(polyline(p, 100.0), whole=1000.0) == pytest.approx(98 * inner + 2 * outer, rel=1e-9)


def test_a_circle_costs_its_centripetal_speed_and_so_do_its_chords():
    """Radius 2 mm: v = sqrt(a r) around, and v / a to get there and to stop, of which the ways are driven at half."""
    v = np.sqrt(1000 * 2)
    want = 4 * np.pi / v + v / 1000
    assert seconds(circle(2.0, 2 * np.pi, 100.0), whole=1000.0) == pytest.approx(want, rel=1e-4)
    t = np.linspace(0, 2 * np.pi, 64)
    chords = np.column_stack([2 * np.cos(t), 2 * np.sin(t), 0 * t])  # of 0.2 mm
    assert seconds(polyline(chords, 100.0), whole=1000.0) == pytest.approx(want, rel=5e-3)


@pytest.mark.parametrize("tolerance", [0.0, 0.001, 0.1, INF])
def test_a_corner_is_faster_the_more_it_may_be_missed(tolerance):
    way = polyline([[0, 0, 0], [10, 0, 0], [10, 10, 0]], 100.0, tolerance=tolerance)
    found = drive(way, whole=1000.0).border[1]
    c = np.sqrt(0.5)
    radius = min(tolerance * c / (1 - c), 5.0 / np.tan(np.pi / 4))
    assert found == pytest.approx(np.sqrt(1000 * radius), rel=1e-9, abs=1e-12)


def test_slides_have_accelerations_of_their_own():
    """Along (3, 4): the slide with the smaller limit over its share decides."""
    way = polyline([[0, 0, 0], [3, 4, 0]], 1e6)
    a = min(300 / 0.6, 1000 / 0.8)
    assert seconds(way, axes=np.array([300.0, 1000.0, INF])) == pytest.approx(2 * np.sqrt(5 / a), rel=1e-9)


def test_the_look_ahead_reaches_over_any_number_of_blocks():
    """100 mm in one block or in 10,000: the same time, and each of them knows of the stop at the end."""
    one = seconds(polyline([[0, 0, 0], [100, 0, 0]], 500.0), whole=200.0)
    many = np.column_stack([np.linspace(0, 100, 10_001), np.zeros(10_001), np.zeros(10_001)])
    assert seconds(polyline(many, 500.0), whole=200.0) == pytest.approx(one, rel=1e-9)


def test_speeds_obey_the_limits_and_a_path_takes_as_long_backwards():
    rng = np.random.default_rng(3)
    points = np.cumsum(rng.normal(size=(60, 3)) * 10.0 ** rng.uniform(-2, 1, (60, 1)), axis=0)
    way = polyline(points, 60.0)
    found, back = drive(way, whole=700.0), drive(polyline(points[::-1], 60.0), whole=700.0)
    assert (found.seconds >= way.length / way.speed * (1 - 1e-12)).all()
    assert (found.border <= 60.0).all() and found.border[0] == found.border[-1] == 0.0
    assert (np.abs(np.diff(found.border**2)) <= 2 * 700.0 * way.length * (1 + 1e-9)).all()
    np.testing.assert_allclose(back.seconds[::-1], found.seconds, rtol=1e-9)


def test_two_hundred_thousand_blocks_a_second():
    rng = np.random.default_rng(1)
    way = polyline(np.cumsum(rng.normal(size=(100_001, 3)), axis=0), 100.0)
    axes = np.array([1e3, 2e3, 3e3])
    drive(way, whole=1e3, axes=axes)
    begin = time.process_time()
    drive(way, whole=1e3, axes=axes)
    assert time.process_time() - begin < 0.5 * slowness()


ARCS = [  # radius, angle, accelerations of x and y
    (2.0, 2 * np.pi, 1000.0, 1000.0),
    (20.0, 2 * np.pi, 1000.0, 500.0),
    (5.0, 1.0, 300.0, 1000.0),
    (30.0, -4.0, 1000.0, 2500.0),
]


@pytest.mark.parametrize(("radius", "angle", "x", "y"), ARCS)
def test_arcs_are_time_optimal_as_by_toppra(radius, angle, x, y):
    """Within 1 %, and never faster by more than both discretisations (0.5 %: 64 steps here, a cubic spline there)."""
    ta = pytest.importorskip("toppra", reason="toppra is not installed (dev extra)")
    from toppra.algorithm import TOPPRA
    from toppra.constraint import JointAccelerationConstraint

    ta.setup_logging("ERROR")
    whole = radius * abs(angle)
    s = np.linspace(0.0, whole, 801)
    turn = s / radius * np.sign(angle)
    path = ta.SplineInterpolator(s, radius * np.column_stack([np.cos(turn), np.sin(turn)]))
    grid = np.linspace(0.0, whole, 2001)
    limit = JointAccelerationConstraint(np.array([[-x, x], [-y, y]]))
    speed = TOPPRA([limit], path, gridpoints=grid).compute_parameterization(0, 0)[1]
    best = (2 * np.diff(grid) / (speed[1:] + speed[:-1])).sum()
    ours = seconds(circle(radius, angle, 1e6), axes=np.array([x, y, INF]))
    assert 0.995 * best <= ours <= 1.01 * best


def test_a_smooth_path_of_chords_is_as_by_toppra():
    """A Lissajous figure in 3,000 chords, path and axes limited alike: within 1 % of the spline through its corners."""
    ta = pytest.importorskip("toppra", reason="toppra is not installed (dev extra)")
    from toppra.algorithm import TOPPRA
    from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint

    ta.setup_logging("ERROR")
    t = np.linspace(0, 2 * np.pi, 3001)
    p = np.column_stack([40 * np.sin(2 * t), 25 * np.sin(3 * t + 0.5), 5 * np.cos(t)])
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(p, axis=0), axis=1))])
    path = ta.SplineInterpolator(s, p)
    speed = [[-40.0, 40.0]] * 3
    grid = np.linspace(0, s[-1], 4001)
    bounds = [
        JointVelocityConstraint(np.array(speed)),
        JointAccelerationConstraint(np.array([[-500.0, 500.0]] * 3)),
    ]
    rate = TOPPRA(bounds, path, gridpoints=grid).compute_parameterization(0, 0)[1]
    best = (2 * np.diff(grid) / (rate[1:] + rate[:-1])).sum()
    way = polyline(p, 1e6, tolerance=INF)
    capped = Way(
        length=way.length, speed=40.0 / np.abs(way.tangent).max(axis=1), tangent=way.tangent, turned=way.turned,
        normal=way.normal, halt=way.halt, tolerance=way.tolerance, push=way.push,
    )  # fmt: skip
    ours = seconds(capped, axes=np.full(3, 500.0))
    assert 0.995 * best <= ours <= 1.01 * best


@pytest.mark.parametrize(
    ("length", "speed", "a", "jerk"),
    [
        (10, 100, 1000, 1e4),
        (1, 100, 1000, 1e4),
        (100, 50, 500, 3e4),
        (5, 20, 2000, 1e5),
        (0.1, 20, 2000, 1e5),
    ],
)
def test_single_moves_with_limited_jerk_are_as_by_ruckig(length, speed, a, jerk):
    ruckig = pytest.importorskip("ruckig", reason="ruckig is not installed (dev extra)")
    asked = ruckig.InputParameter(1)
    asked.current_position, asked.target_position = [0.0], [float(length)]
    asked.max_velocity, asked.max_acceleration, asked.max_jerk = [float(speed)], [float(a)], [float(jerk)]
    found = ruckig.Trajectory(1)
    ruckig.Ruckig(1).calculate(asked, found)
    assert rest_to_rest_s(length, speed, a, jerk) == pytest.approx(found.duration, rel=1e-9)
    way = polyline([[0, 0, 0], [length, 0, 0]], float(speed))
    assert seconds(way, whole=float(a), jerk=float(jerk)) == pytest.approx(found.duration, rel=1e-6)
