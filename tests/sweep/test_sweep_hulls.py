"""What a sweep meets of small hulls, against the distance of points in them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vmachining.geometry import Arc, Line
from vmachining.sweep import Sweep
from vmachining.tool import BullNose, ProfileTool, Taper

WAIST = ProfileTool(points=[[0, 0], [5, 0], [8, 5], [6, 10], [6, 20]])
TOOLS = [BullNose(diameter=10, corner_radius=2, length=20), Taper(diameter=4, taper_deg=12, length=20), WAIST]
PATHS = [
    Line((0, 0, 0), (9, 4, 0)),
    Line((0, 0, 0), (6, -3, 5)),
    Line((0, 0, 0), (0, 0, -4)),
    Arc((0, 0, 0), (6, 0, 0), angle=1.5),
    Arc((0, 0, 0), (6, 0, 0), angle=-1.0, rise=3.0),
]


def boxes(hulls):
    return np.stack([hulls.min(axis=1), hulls.max(axis=1)], axis=1)


@pytest.mark.parametrize("within", [0.0, 1e-4])
@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(TOOLS), st.sampled_from(PATHS))
def test_points_of_hulls_are_where_they_are_said_to_be(within, seed, tool, path):
    rng = np.random.default_rng(seed)
    sweep = Sweep.along(tool, path)
    box = np.array(sweep.bounds)
    slack, depth = rng.choice([0.0, 0.01, 0.3], 2)
    middle = rng.uniform(box[0] - 2, box[1] + 2, (30, 1, 3))
    hulls = middle + rng.uniform(-1, 1, (30, 8, 3)) * rng.choice([0.01, 0.3, 2.0], (30, 1, 1))
    met, deep = sweep.meets(hulls, boxes(hulls), slack=slack, depth=depth, within=within)
    shares = rng.dirichlet(np.full(8, 0.5), (30, 40))
    points = np.concatenate([hulls, np.einsum("nkj,nji->nki", shares, hulls)], axis=1)
    gaps = sweep.signed_distance(points.reshape(-1, 3)).reshape(30, -1)
    assert (gaps[~met] > slack - 1e-9).all()
    assert (gaps[deep] <= -depth + 1e-9).all()
    assert not (deep & ~met).any()


def test_small_hulls_are_told_apart_sharply():
    """Specks: beside the surface by more than their size they are on the side of their middle."""
    rng = np.random.default_rng(7)
    sweep = Sweep.along(TOOLS[0], PATHS[1])
    box = np.array(sweep.bounds)
    middle = rng.uniform(box[0] - 1, box[1] + 1, (500, 1, 3))
    hulls = middle + rng.uniform(-1e-3, 1e-3, (500, 8, 3))
    gap = sweep.signed_distance(middle[:, 0])
    met, deep = sweep.meets(hulls, boxes(hulls), slack=0.1, depth=0.2)
    clear = 2e-3
    assert (met[gap < 0.1] == 1).all() and not met[gap > 0.1 + clear].any()
    assert deep[gap < -0.2 - clear].all() and not deep[gap > -0.2 + clear].any()
    assert met.any() and deep.any() and not met.all()
