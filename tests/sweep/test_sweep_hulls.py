"""Bounds of the distance over small hulls, against the distance of points in them."""

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


@pytest.mark.parametrize("within", [0.0, 1e-4])
@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(TOOLS), st.sampled_from(PATHS))
def test_no_point_of_a_hull_passes_the_bounds(within, seed, tool, path):
    rng = np.random.default_rng(seed)
    sweep = Sweep.along(tool, path)
    box = np.array(sweep.bounds)
    middle = rng.uniform(box[0] - 2, box[1] + 2, (20, 1, 3))
    hulls = middle + rng.uniform(-1, 1, (20, 8, 3)) * rng.choice([0.01, 0.3, 2.0], (20, 1, 1))
    low, high = sweep.hull_distance(hulls, within=within)
    shares = rng.dirichlet(np.full(8, 0.5), (20, 40))
    points = np.concatenate([hulls, np.einsum("nkj,nji->nki", shares, hulls)], axis=1)
    gaps = sweep.signed_distance(points.reshape(-1, 3)).reshape(20, -1)
    assert (gaps.min(axis=1) >= low - 1e-9).all()
    inside = high < -within
    assert (gaps[inside].max(axis=1, initial=-np.inf) <= high[inside] + within + 1e-9).all()
