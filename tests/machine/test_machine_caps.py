"""Shares of the slides: closed forms, and no point of a path ever asks more of a slide than its peak."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import coordinates

from vmachining.errors import KinematicsError
from vmachining.geometry import Arc, Line
from vmachining.machine import MachineLimits, path_peaks
from vmachining.machine.block_peaks import arc_peaks


@settings(max_examples=200, deadline=None)
@given(
    start=coordinates(50),
    center=coordinates(50),
    axis=st.integers(0, 2),
    angle=st.floats(-15, 15),
    rise=st.floats(-50, 50),
    t=st.floats(0, 1),
)
def test_peaks_of_an_arc_bound_every_point_and_are_reached(start, center, axis, angle, rise, t):
    arc = Arc(start, center, axis, angle=angle, rise=rise)
    if arc.length < 1e-6 or arc.radius < 1e-6:
        return
    peak = path_peaks([arc])[0]
    share = np.abs(arc.velocity(t)) / arc.length
    assert (share <= peak + 1e-9).all()
    many = np.abs(arc.velocity(np.linspace(0, 1, 4001))).max(axis=0) / arc.length
    assert np.abs(many - peak).max() <= 1e-5


def test_quarter_between_the_quadrant_points():
    # from 30 to 60 degrees neither slide ever carries the whole speed
    start = [10 * np.cos(np.pi / 6), 10 * np.sin(np.pi / 6), 0]
    peaks = arc_peaks([start], [[0, 0, 0]], [2], [np.pi / 6], [0.0])[0]
    np.testing.assert_allclose(peaks, [np.sqrt(3) / 2, np.sqrt(3) / 2, 0], atol=1e-15)


def test_mixed_paths_keep_their_order():
    paths = [Line([0, 0, 0], [3, 4, 0]), Arc([1, 0, 0], [0, 0, 0], angle=7.0), Line([0, 0, 0], [0, 0, 2])]
    np.testing.assert_allclose(path_peaks(paths), [[0.6, 0.8, 0], [1, 1, 0], [0, 0, 1]])
    assert path_peaks([]).shape == (0, 3)


@pytest.mark.parametrize(
    "bad",
    [
        {"rapid_mm_min": 0.0},
        {"max_feed_mm_min": -1.0},
        {"max_acceleration_mm_s2": float("nan")},
        {"axis_feed_mm_min": (1.0, 2.0)},
        {"axis_feed_mm_min": (1.0, float("inf"), None)},
    ],
)
def test_impossible_machines_are_refused(bad):
    with pytest.raises(KinematicsError, match=next(iter(bad))):
        MachineLimits(**bad)


def test_bad_columns_are_refused():
    with pytest.raises(KinematicsError, match="axis of an arc"):
        arc_peaks([[1, 0, 0]], [[0, 0, 0]], [3], [1.0], [0.0])
