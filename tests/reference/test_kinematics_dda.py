"""Pulse trains against published ones, and the error bounds of the digital differential analyser.

Source: tables of section B of the project's interpolator specification, recomputed there by an independent
program from the register equations. Groups are ticks with pulses: + - 0 per axis, or compass letters.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vmachining.errors import KinematicsError
from vmachining.machine.dda import (
    arc_corners,
    arc_limit,
    arc_train,
    helix_train,
    line_limit,
    line_train,
    pulse_counts,
    radius_error,
    s1_quadrant_train,
)

LINES = [
    ((5, 3), 8, "+0 0+ +0 +0 0+ +0 ++", "+0 0+ +0 ++ +0 0+ +0"),
    ((5, 3), 5, "+0 ++ +0 ++ ++", "++ +0 ++ +0 ++"),
    ((7, 2), 7, "+0 +0 +0 ++ +0 +0 ++", "+0 ++ +0 +0 +0 ++ +0"),
    ((10, 4), 10, "+0 +0 ++ +0 ++ +0 +0 ++ +0 ++", "+0 ++ +0 ++ +0 +0 ++ +0 ++ +0"),
    ((8, 8), 8, " ".join(["++"] * 8), " ".join(["++"] * 8)),
    ((0, 4), 4, "0+ 0+ 0+ 0+", "0+ 0+ 0+ 0+"),
    ((-3, 5), 8, "0+ -0 0+ 0+ -0 0+ -+", "0+ -0 0+ -+ 0+ -0 0+"),
    ((7, 5, 3), 8, "++0 +0+ ++0 ++0 +0+ ++0 +++", "++0 +0+ ++0 +++ ++0 +0+ ++0"),
]
ARCS = [
    # start, end, ccw, N, pulsing ticks, radius error
    ((3, 0), (0, 3), True, 3, "N N NW W W", 0.606),
    ((0, 3), (3, 0), False, 3, "E SE SE S", None),
    ((5, 0), (0, 5), True, 5, "N N NW N W NW W W", 0.657),
    ((0, 5), (5, 0), False, 5, "E SE E SE S SE S", 0.528),
    ((5, 0), (0, 5), True, 8, "N N W N NW W N W W", None),
    ((0, 5), (5, 0), False, 8, "E SE E S E S SE S", None),
    ((8, 0), (0, 8), True, 8, "N N N NW N NW W N W NW W W W", 0.602),
    ((0, 8), (8, 0), False, 8, "E E SE E SE SE SE S SE S S", 0.384),
    ((10, 0), (0, 10), True, 10, "N N N NW N NW NW N W NW W NW W W W", 0.630),
    ((0, 10), (10, 0), False, 10, "E E SE E SE E S E SE S SE S SE S S", 0.780),
    ((5, 0), (5, 0), True, 5,
     "N N NW N W NW W W W W SW SW S SW S S S S E SE S E E E E NE E NE NE N N", 0.831),
    ((5, 0), (5, 0), True, 8,
     "N N W N NW W N W W W W S W SW SW S S S S E S SE E S E E E E NE NE N E N N", 0.528),
    ((3, 4), (-4, 3), True, 5, "W NW W W W SW SW", 0.528),
    ((3, 4), (-4, 3), True, 8, "W N W W W W S W SW", None),
    ((3, 4), (-4, 3), False, 8,
     "SE S E S S S S W S SW W S W W W W N W NW NW N N N N E N", None),
    ((0, 10), (0, -10), False, 10,
     "E E SE E SE E S E SE S SE S SE S S S S S SW S S W SW S W SW W SW W W W", 0.817),
    ((6, 8), (10, 0), False, 10, "SE SE SE S SE S S S", 0.440),
]  # fmt: skip
TICKS = [5, 4, 8, 7, 13, 12, 13, 12, 16, 15, 31, 50, 8, 12, 37, 31, 9]
"""Ticks of ARCS, idle ones included."""

S1_SUMS = {50: (49, 50), 200: (199, 201), 1000: (999, 1001), 7500: (7494, 7501), 15000: (14988, 15001)}


def compass(train):
    return " ".join(
        {1: "N", -1: "S", 0: ""}[y] + {1: "E", -1: "W", 0: ""}[x] for x, y in train.steps.tolist()
    )


@pytest.mark.parametrize(("counts", "capacity", "empty", "half"), LINES)
def test_line_trains(counts, capacity, empty, half):
    assert line_train(counts, capacity, preset=0).text() == empty
    assert line_train(counts, capacity).text() == half


def registers(counts, capacity, preset):
    """The adding registers themselves, one tick after the other."""
    q, out = [preset] * len(counts), []
    for _ in range(capacity):
        row = []
        for a, p in enumerate(counts):
            q[a] += abs(p)
            row.append((1 if p > 0 else -1) if q[a] >= capacity else 0)
            q[a] -= capacity if q[a] >= capacity else 0
        out.append(row)
    return out


@given(st.lists(st.integers(-60, 60), min_size=1, max_size=3), st.integers(60, 90), st.floats(0, 0.999))
@settings(deadline=None, max_examples=200)
def test_trains_are_those_of_the_registers(counts, capacity, fill):
    preset = int(fill * capacity)
    train = line_train(counts, capacity, preset=preset)
    assert train.dense().tolist() == registers(counts, capacity, preset)


def circle_registers(start, end, capacity, ccw):
    """Mode `dda` of an arc inside one quadrant, tick by tick."""
    (x, y), n = start, capacity
    qx = qy = n // 2
    rx, ry = abs(end[0] - x), abs(end[1] - y)
    sx, sy = (1 if end[0] > x else -1), (1 if end[1] > y else -1)
    out = []
    while rx or ry:
        px = py = 0
        qx += abs(y)
        if qx >= n:
            qx -= n
            if rx:
                x, rx, px = x + sx, rx - 1, sx
        qy += abs(x)
        if qy >= n:
            qy -= n
            if ry:
                y, ry, py = y + sy, ry - 1, sy
        out.append([px, py])
    return out


@pytest.mark.parametrize("capacity", [40, 57, 1000])
@pytest.mark.parametrize("radius", [3, 10, 40])
def test_idle_ticks_are_only_skipped(radius, capacity):
    for start, end, ccw in (((radius, 0), (0, radius), True), ((0, radius), (radius, 0), False)):
        train = arc_train(start, end, capacity, ccw=ccw)
        assert train.dense().tolist() == circle_registers(start, end, capacity, ccw)


def test_huge_registers_cost_no_more():
    """2^31 ticks, a handful of pulses: the moments are those of the exact line and circle."""
    train = line_train([3, -2], 2**31)
    np.testing.assert_allclose((train.tick + 1) / 2**31, [1 / 6, 1 / 4, 1 / 2, 3 / 4, 5 / 6], atol=1e-9)
    assert arc_train((1000, 0), (0, 1000), 2**31, ccw=True).ticks == pytest.approx(
        2**31 * np.pi / 2, rel=2e-3
    )


@pytest.mark.parametrize("capacity", [8, 10, 16, 20])
def test_lines_end_exactly_from_any_preset(capacity):
    for preset in range(capacity):
        for p in range(-capacity, capacity + 1):
            train = line_train([p, capacity - abs(p)], capacity, preset=preset)
            assert train.counts.tolist() == [p, capacity - abs(p)] and train.ticks == capacity


@pytest.mark.parametrize(("preset", "low", "high"), [(0, -1.0, 0.0), (None, -0.5, 0.5)])
@pytest.mark.parametrize("capacity", [16, 17, 64])
def test_errors_of_lines(capacity, preset, low, high):
    """Error of each axis per tick, and distance to the line, over every pair of counts."""
    worst = 0.0
    j = np.arange(1, capacity + 1)[:, None]
    for px in range(capacity + 1):
        for py in range(0, capacity + 1, 1 if capacity < 20 else 7):
            counts = np.array([px, py])
            error = (
                np.cumsum(line_train(counts, capacity, preset=preset).dense(), axis=0) - j * counts / capacity
            )
            assert error.min() >= low - (low == -0.5) / (2 * capacity) and error.max() <= high
            if px or py:
                distance = np.abs(error @ [py, -px]) / math.hypot(px, py)
                slack = math.sqrt(2) / (2 * capacity) if capacity % 2 else 0.0  # N // 2 is not half of N
                assert (
                    distance.max() <= line_limit(counts, capacity, half_load=preset is None) + slack + 1e-12
                )
                worst = max(worst, distance.max())
    assert worst < (0.7072 if preset is None else 1.0) + 0.05 * (capacity % 2)


def test_worst_distances_published():
    """N = 64: 0.9843 BLU from empty registers at (1, 64), 0.6961 with half load at (32, 33)."""
    for counts, preset, worst in (((1, 64), 0, 0.9843), ((32, 33), None, 0.6961)):
        path = line_train(counts, 64, preset=preset).dense().cumsum(axis=0)
        ideal = np.arange(1, 65)[:, None] * np.array(counts) / 64
        distance = np.abs((path - ideal) @ [counts[1], -counts[0]]) / math.hypot(*counts)
        assert distance.max() == pytest.approx(worst, abs=6e-5)


@given(st.lists(st.integers(-200, 200), min_size=1, max_size=4), st.integers(200, 5000))
@settings(deadline=None, max_examples=100)
def test_every_axis_stays_within_half_a_unit(counts, capacity):
    train = line_train(counts, capacity)
    assert train.counts.tolist() == counts
    j = np.arange(1, capacity + 1)[:, None]
    error = train.dense().cumsum(axis=0) - j * np.array(counts) / capacity
    assert np.abs(error).max() <= 0.5 + 0.5 / capacity


@pytest.mark.parametrize(("arc", "ticks"), list(zip(ARCS, TICKS, strict=True)))
def test_arc_trains(arc, ticks):
    start, end, ccw, capacity, want, error = arc
    train = arc_train(start, end, capacity, ccw=ccw)
    assert compass(train) == want and train.ticks == ticks
    assert train.positions(start)[-1].tolist() == list(end)
    if error is not None:
        got = radius_error(train.positions(start), math.hypot(*start)).max()
        assert got == pytest.approx(error, abs=6e-4)


def worst(radii, capacity, *, whole):
    """Largest radius error (BLU) and its radius over both directions and both kinds of start."""
    out = (0.0, 0)
    for radius in radii:
        for start, end in (((radius, 0), (0, radius)), ((0, radius), (-radius, 0)),
                           ((0, radius), (radius, 0)), ((radius, 0), (0, -radius))):  # fmt: skip
            ccw = start[0] * end[1] - start[1] * end[0] > 0
            train = arc_train(start, start if whole else end, capacity(radius), ccw=ccw)
            out = max(out, (radius_error(train.positions(start), radius).max(), radius))
    return out


def test_radius_errors():
    """Published: quadrants up to 0.963 (R = 214), circles up to 1.156 (R = 205) with N = R; 0.90 with N = 2 R."""
    radii = range(1, 500)
    quadrant, circle = (worst(radii, int, whole=whole) for whole in (False, True))
    assert quadrant[1] == 214 and 0.962 < quadrant[0] <= 0.963
    assert circle[1] == 205 and 1.155 < circle[0] <= 1.156
    assert worst(range(1, 300), lambda r: 2 * r, whole=True)[0] <= 0.90
    assert worst(range(1, 41), lambda r: 20000, whole=True)[0] <= 0.83
    assert worst([1000, 2000], int, whole=False)[0] <= 1.0


def test_circles_in_a_row_stay_within_the_limit_of_arcs():
    """Three turns about a bad radius: more than one circle errs, less than the limit."""
    start, radius = (198, 0), 198
    worst_of = 0.0
    for begin in (start, start[::-1]):
        for ccw in (True, False):
            train = arc_train(begin, begin, radius, ccw=ccw, turns=3)
            assert train.counts.tolist() == [0, 0]
            worst_of = max(worst_of, radius_error(train.positions(begin), radius).max())
    assert 1.2 < worst_of < arc_limit(arc_corners(start, start, ccw=True), 3)


def test_arcs_between_any_lattice_points():
    rng = np.random.default_rng(1)
    for _ in range(1500):
        radius = rng.uniform(2, 400)
        a, b = rng.uniform(0, 2 * np.pi, 2)
        s, e = (np.round(radius * np.array([np.cos(v), np.sin(v)])).astype(int) for v in (a, b))
        ccw = bool(rng.integers(2))
        if abs(math.hypot(*s) - math.hypot(*e)) > 1:
            continue
        train = arc_train(s, e, math.ceil(radius) + 1, ccw=ccw)
        path = train.positions(s)
        assert path[-1].tolist() == e.tolist()
        assert radius_error(path, radius).max() <= 2.5
        # it turns the right way: the area swept has the sign of the direction
        swept = (path[:-1, 0] * path[1:, 1] - path[1:, 0] * path[:-1, 1]).sum()
        assert (swept > 0) == ccw or (s == e).all() or abs(swept) <= 4 * radius


@pytest.mark.parametrize("radius", S1_SUMS)
def test_quadrants_of_the_engraver(radius):
    slow, fast = S1_SUMS[radius]
    signs = {1: (1, 1), 2: (1, -1), 3: (-1, -1), 4: (-1, 1)}
    for quadrant, (sx, sy) in signs.items():
        x, y = (slow, fast) if quadrant in (1, 3) else (fast, slow)
        assert s1_quadrant_train(quadrant, radius, 20000).counts.tolist() == [sx * x, sy * y]
        # counter-clockwise the same quadrant is drawn backwards, its fast axis is the other one
        back = s1_quadrant_train(quadrant, radius, 20000, ccw=True).counts
        assert np.abs(back).tolist() == [y, x] and (np.sign(back) == [-sx, -sy]).all()


def test_helix():
    train = helix_train((5, 0), (0, 5), 3, 8, ccw=True)
    assert train.text(idle=True) == "0+0 000 0++ -00 0+0 000 -++ 000 -00 0+0 -0+ 000 -00"
    assert train.ticks == 13 and train.counts.tolist() == [-5, 5, 3]


@given(st.integers(2, 80), st.integers(-90, 90), st.integers(1, 3), st.booleans())
@settings(deadline=None, max_examples=50)
def test_helices_rise_evenly(radius, rise, turns, ccw):
    train = helix_train((radius, 0), (radius, 0), rise, 100, ccw=ccw, turns=turns)
    assert train.counts.tolist() == [0, 0, rise]
    z = train.dense()[:, 2].cumsum()
    even = rise * np.arange(1, train.ticks + 1) / train.ticks
    assert np.abs(z - even).max() <= 0.5 + 0.5 / train.ticks


def test_absolute_rounding():
    assert np.diff(pulse_counts([0, 0.03, 0.06, 0.09], 0.02)).tolist() == [2, 1, 2]
    assert pulse_counts([-25.4, 44.45], 0.02).tolist() == [-1270, 2223]
    assert pulse_counts([0.01, -0.01, 0.009], 0.02).tolist() == [1, -1, 0]
    assert pulse_counts(np.arange(-999, 1000) * 0.005, 0.01).tolist() == [
        int(math.copysign((abs(k) + 1) // 2, k)) for k in range(-999, 1000)
    ]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: line_train([20001, 0], 20000), "register overflow: 20001"),
        (lambda: line_train([2**30], 2**31), "pulses in one block"),
        (lambda: line_train([1], 2**31 + 1), "1 to 2\\^31"),
        (lambda: line_train([], 20000), "one number per axis"),
        (lambda: line_train([1, 2], 0), "register capacity 0"),
        (lambda: line_train([1, 2], 8, preset=8), "preset 8"),
        (lambda: arc_train((10, 0), (0, 12), 20, ccw=True), "off-circle end"),
        (lambda: arc_train((0, 0), (0, 0), 20, ccw=True), "the centre"),
        (lambda: arc_train((10, 0), (0, 10), 9, ccw=True), "register overflow"),
        (lambda: arc_train((10, 0), (0, 10), 20, ccw=True, turns=0), "0 turns"),
        (lambda: arc_train((10, 0), (10, 0), 20, ccw=True, turns=10**9), "pulses in one block"),
        (lambda: arc_train((10, 0, 0), (0, 10, 0), 20, ccw=True), "two coordinates"),
        (lambda: helix_train((2, 0), (0, 2), 500, 8, ccw=True), "500 pulses along the axis"),
        (lambda: s1_quadrant_train(5, 10, 100), "quadrant 5"),
        (lambda: s1_quadrant_train(1, 0, 100), "not positive"),
        (lambda: s1_quadrant_train(1, 101, 100), "register overflow"),
        (lambda: pulse_counts([1.0], 0.0), "BLU is 0"),
        (lambda: pulse_counts([1e300], 0.01), "2\\^52"),
    ],
)  # fmt: skip
def test_refusals(make, message):
    with pytest.raises(KinematicsError, match=message):
        make()


def test_an_end_one_unit_off_the_circle_is_reached():
    train = arc_train((10, 0), (0, 11), 20, ccw=True)
    assert train.positions((10, 0))[-1].tolist() == [0, 11]


def test_driver_codes():
    assert line_train([2, -2], 2, preset=0).codes().tolist() == [[1, 2], [1, 2]]
