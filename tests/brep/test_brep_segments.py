"""Curves of the grazing points, where rounding or a standstill would tear them."""

from __future__ import annotations

import numpy as np
import pytest

from vmachining import FlatEnd, Turn
from vmachining.arrays import Floats
from vmachining.engines.brep.envelopes.grazing_curve import GrazingCurve
from vmachining.engines.brep.envelopes.segments import BACK, Moving, State, evened, graze_beta
from vmachining.engines.brep.translations.caps import Tool
from vmachining.errors import SweepError
from vmachining.sweep import Pose


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
    """The normal straight down is one of a flat bottom that moves level; straight up is not a normal of this arc."""
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


@pytest.mark.parametrize("looks", [1, 2, 3])
@pytest.mark.parametrize("width", np.geomspace(1e-5, 0.2, 20))
def test_shares_of_a_curve_do_not_run_back(width: float, looks: int) -> None:
    """Half a turn of a circle, most of it within a part of the parameter: in order, or refused."""

    def at(x: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        u = np.arctan((x - 0.37) / width)
        return np.full(x.shape, 3.0), np.zeros(x.shape), np.zeros(x.shape), u

    shares = np.linspace(0.0, 1.0, 20_001)
    try:
        found = evened(at, 1, shares, looks)
    except SweepError:
        assert width < 0.05
        return
    assert width > 1e-4 and (np.maximum.accumulate(found[0]) - found[0]).max() < 3.0 * BACK
    if width > 0.1:
        steps = np.diff(at(found)[3])
        assert steps.max() < 1.02 * steps.min()


def test_a_valley_keeps_its_digits_far_from_the_origin_and_next_to_its_pose() -> None:
    """A disc that tilts about a line near its rim: the rim crosses a pose of it where the closed form says.

    Points of the rim at time t are as high above the pose at t0 as (v . A0) (t - t0) - R cos u sin(w (t - t0)).
    """
    radius, w, far = 5.0, 1e-3, np.array([4096.0, 1234.5, 2345.6])
    tip = (far + [-0.02, 0.01, 0.99 * radius * np.sin(w)]) - far  # what is left of it in numbers that large
    first, last = (0.0, 0.0, 1.0), (np.sin(w), 0.0, np.cos(w))
    path = Turn.great_circle(Pose(tuple(far), first), Pose(tuple(tip + far), last))
    grazing = GrazingCurve(Tool.of(FlatEnd(diameter=2 * radius, length=4).profile), Moving(path))
    assert set(grazing.valley) == {(0, -1), (0, 1)}
    axis, t0 = grazing.valley[0, 1]
    t = t0 + (0.5 - t0) * np.array([1e-4, 1e-3, 1e-2, 0.1, 1.0])
    cos = (t - t0) * (tip @ axis) / (radius * np.sin(w * (t - t0)))
    x = np.column_stack([np.cos(w * t), 0 * t, -np.sin(w * t)])
    sides = [grazing.tie((0, side), grazing.moving.state(t)) for side in (-1, 1)]
    for place, way in zip(sorted(sides, key=lambda place: place[-1, 1]), (-1.0, 1.0), strict=True):
        rim = radius * (cos[:, None] * x + way * np.sqrt(1.0 - cos**2)[:, None] * [0.0, 1.0, 0.0])
        truth = far + t[:, None] * tip + rim
        # rounding of 1e-16 in the rates, over the sine of the angle, times the radius; and digits of places
        assert np.abs(place - truth).max() < 1e-11
