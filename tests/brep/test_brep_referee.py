"""The points that the bench of chains counts, against closed forms."""

from __future__ import annotations

from math import sqrt

import numpy as np
import pytest

from benchmarks.referee import referee
from vmachining.geometry import Line
from vmachining.sweep import Sweep
from vmachining.tool import FlatEnd

STOCK = np.array([[0.0, 0.0, -5.0], [20.0, 20.0, 0.0]])
RADIUS = 3.0


def over_a_corner(legs: float) -> Sweep:
    """A pass that takes the corner (20, 20) off, 1 mm deep: a triangle with two legs, mm, seen from above."""
    away = (legs / 2.0 - RADIUS / sqrt(2.0)) * np.array([1.0, 1.0])  # of the middle line, from the corner
    ends = [np.array([20.0 - away[0] + way, 20.0 - away[1] - way, -1.0]) for way in (-40.0, 40.0)]
    return Sweep.along(FlatEnd(diameter=2.0 * RADIUS, length=20.0), Line(*ends))


@pytest.mark.parametrize(("legs", "share"), [(0.05, np.inf), (0.4, np.inf), (4.0, 0.06)])
def test_the_truth_lies_in_the_bar_of_counted_points(legs: float, share: float) -> None:
    truth = legs**2 / 2.0
    volume, bar = referee([over_a_corner(legs)], 0, STOCK)
    assert abs(volume - truth) <= bar <= share * truth


def test_earlier_blocks_have_taken_what_they_took() -> None:
    volume, bar = referee([over_a_corner(3.0), over_a_corner(4.0)], 1, STOCK)
    assert abs(volume - (16.0 - 9.0) / 2.0) <= bar <= 0.7
