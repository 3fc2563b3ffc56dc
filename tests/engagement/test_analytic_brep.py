"""Analytic engagement against B-rep solids of parts of our own, asked through OCCT."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks import abs as verification
from benchmarks.abs import SURFACES, finish_errors, semi_finish_errors

ENOUGH = 1e-6
"""Percent of the cut length: OCCT is good to 1e-9 mm where edge and face cross at a fair angle."""


def test_a_staircase_of_boxes():
    rows = list(semi_finish_errors())
    assert [row["tool"] for row in rows] == ["flat", "bull"]
    assert all(row["angles"] >= 15 and row["max_percent"] < ENOUGH for row in rows)


# largest percent of: direct solve, model at the end, and of the published stages (flat) or stations (bull)
PARTS = {
    "slope across 8": (ENOUGH, ENOUGH, 0.1),
    "cylinder R100": (ENOUGH, ENOUGH, 0.05),
    "bowl R100": (ENOUGH, 0.2, 5.0),
    # a spline within 1e-7 mm; before lines began far behind, points 0.008 mm below it counted as outside
    "saddle 100/120": (1e-4, 1e-4, 0.1),
}


@pytest.mark.parametrize("part", PARTS)
def test_finish(part):
    direct, model, stages = PARTS[part]
    rows = list(finish_errors(part, ((12.0, 8.0),), tilts=(0.0,)))
    by = {(row["tool"], row["method"]): row for row in rows}
    for tool in ("flat", "bull"):
        assert by[tool, "direct"]["angles"] >= 9
        assert by[tool, "direct"]["max_percent"] < direct
        assert by[tool, "model"]["max_percent"] < model
    for method in ("stages 1", "stages 2", "stages n"):
        assert by["flat", method]["max_percent"] < stages
    printed = by["bull", "stations"]
    assert printed["mean_percent"] > 1.0  # the interpolation: the dominating error of the published procedure
    assert np.nanmax(np.array(printed["per_angle_percent"], dtype=float)) == pytest.approx(
        printed["max_percent"]
    )


def test_published_numbers_stand_beside():
    assert verification.PUBLISHED == {"flat": (0.13, 3.4, 0.38), "bull": (0.23, 1.7, 0.14, 0.21)}
    assert len(SURFACES) == 9
