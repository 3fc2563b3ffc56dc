"""Rotations and directions: laws they keep, and digits next to 0 and 180 degrees."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import angles, directions

from vmachining.geometry import rotation, unit
from vmachining.geometry.rotation import angle_between, great_circle

ROUNDING = 1e-14


@given(directions(), angles(), angles())
@settings(deadline=None, max_examples=100)
def test_rotations_about_one_axis_add_up(w, a, b):
    turn = rotation(w, a)
    np.testing.assert_allclose(turn @ turn.T, np.eye(3), atol=ROUNDING)
    np.testing.assert_allclose(turn @ w, w, atol=ROUNDING)
    np.testing.assert_allclose(turn @ rotation(w, b), rotation(w, a + b), atol=1e-13)
    assert np.linalg.det(turn) == pytest.approx(1.0)


def test_rotations_are_right_handed():
    ex, ey, ez = np.eye(3)
    for w, start, end in ((ez, ex, ey), (ex, ey, ez), (ey, ez, ex)):
        np.testing.assert_allclose(rotation(w, np.pi / 2) @ start, end, atol=1e-15)
    assert rotation(ez, np.zeros((4, 2))).shape == (4, 2, 3, 3)


@pytest.mark.parametrize(
    "angle", [0.0, 1e-300, 1e-12, 1e-6, 0.3, np.pi / 2, np.pi - 1e-6, np.pi - 1e-12, np.pi]
)
def test_angles_keep_their_digits(angle):
    """The arc cosine would return 0 below 1e-8."""
    u = (np.cos(angle), np.sin(angle), 0.0)
    assert angle_between((1, 0, 0), u) == pytest.approx(angle, rel=1e-12, abs=1e-300)
    assert angle_between((5, 0, 0), np.multiply(u, 7.0)) == pytest.approx(angle, rel=1e-12, abs=1e-300)


@given(directions(), directions(), st.floats(0, 1))
@settings(deadline=None, max_examples=200)
def test_great_circles_turn_evenly(u, v, t):
    whole = float(angle_between(u, v))
    if np.pi - whole < 1e-6:
        return
    w = great_circle(u, v, t)
    assert np.linalg.norm(w) == pytest.approx(1.0)
    assert angle_between(u, w) == pytest.approx(t * whole, abs=1e-9)
    assert angle_between(w, v) == pytest.approx((1 - t) * whole, abs=1e-9)


def test_great_circles_of_equal_and_opposite_directions():
    np.testing.assert_array_equal(great_circle((0, 0, 1), (0, 0, 1), [0.0, 0.3, 1.0]), [[0, 0, 1]] * 3)
    with pytest.raises(ValueError, match="opposite"):
        great_circle((0, 0, 1), (0, 0, -1), 0.5)
    with pytest.raises(ValueError, match="no length"):
        unit([(1, 0, 0), (0, 0, 0)])
