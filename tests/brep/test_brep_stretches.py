"""Curves of the grazing points, where rounding or a standstill would tear them."""

from __future__ import annotations

import numpy as np
import pytest

from vmachining.arrays import Floats
from vmachining.engines.brep.stretches import State, evened, graze_beta
from vmachining.errors import SweepError


def level_state(lift: float) -> State:
    """An upright tool that moves along x and rises by next to nothing."""
    row = np.array([[1.0, 0.0, 0.0]])
    up = np.array([[0.0, 0.0, 1.0]])
    return State(
        np.zeros(1), np.zeros((1, 3)), up, row + lift * up, 0.0 * row, row, np.array([[0.0, 1.0, 0.0]])
    )


@pytest.mark.parametrize("lift", [1e-18, 0.0, -1e-18])
@pytest.mark.parametrize("angle", [0.0, np.pi])
def test_the_lower_quarter_of_a_torus_grazes_at_its_lowest_circle(lift: float, angle: float) -> None:
    """The normal straight down is one of a flat bottom that moves level; straight up is no normal of this arc."""
    found = graze_beta(level_state(lift), 3.0, 1.0, np.array([[angle]]), -0.25 * np.pi)
    assert found[0, 0] == pytest.approx(-0.5 * np.pi, abs=1e-12)


def test_grazing_normals_are_square_to_the_velocity() -> None:
    """At any angle, for any middle; and never farther than a quarter turn from it."""
    rng = np.random.default_rng(7)
    for middle in (-1.2, -0.5, 0.0, 0.9):
        axis, x = np.array([[0.0, 0.0, 1.0]]), np.array([[1.0, 0.0, 0.0]])
        velocity, rate = rng.normal(size=(1, 3)), np.append(rng.normal(size=2), 0.0)[None]
        st = State(np.zeros(1), np.zeros((1, 3)), axis, velocity, rate, x, np.array([[0.0, 1.0, 0.0]]))
        u = rng.uniform(-np.pi, np.pi, (1, 20))
        r, z, small = 3.0, 1.0, 0.5
        beta = graze_beta(st, r, z, u, middle)
        m = st.radial(u)[0]
        normal = np.cos(beta[0])[:, None] * m + np.sin(beta[0])[:, None] * axis
        height = z + small * np.sin(beta[0])
        reach = r + small * np.cos(beta[0])
        # the point z A + r m moves by V + z A' + r m', and m' = -(m . A') A for a frame that does not spin
        speed = velocity + height[:, None] * rate - (reach * (m @ rate[0]))[:, None] * axis
        assert np.abs((normal * speed).sum(axis=1)).max() < 1e-12
        assert (np.abs(beta - middle) <= 0.5 * np.pi + 1e-12).all()


def test_a_curve_that_stands_still_is_refused_by_name() -> None:
    """It has no length to share."""

    def at(x: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        return (np.ones_like(x), np.zeros_like(x), np.zeros_like(x), np.minimum(x, 0.5))

    with pytest.raises(SweepError, match="stands still"):
        evened(at, 2, np.array([0.0, 0.5, 1.0]))
