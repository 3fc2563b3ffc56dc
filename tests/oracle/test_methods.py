"""Other ways of computing, on a case of the reference set: plain booleans are inside, grids are not, and the table says so."""

from __future__ import annotations

import pytest

from tests.models.shipped import MODELS
from vmachining.bench.methods import METHODS, case_results, methods_table
from vmachining.oracle import read_reference

CASE = MODELS / "reference_pack" / "plunges"


@pytest.mark.parametrize(
    ("method", "share"), [("height map", 0.01), ("voxels", 0.02), ("global mesh", 1e-3), ("plain OCCT", 2e-3)]
)
def test_a_method_cuts_a_case(method: str, share: float) -> None:
    found = case_results(CASE / "job.toml", method)
    low, _, high = read_reference(CASE).total
    assert found["ended"] is None and len(found["block"]) == 105
    # a grid of 0.25 mm on discs of radius 5, facets within 0.02 mm; OCCT is exact on cylinders, the bounds are 0.2 % wide
    assert low * (1.0 - share) <= sum(found["removed_mm3"]) <= high * (1.0 + share)


def test_a_method_that_is_out_of_time_says_where() -> None:
    found = case_results(CASE / "job.toml", "voxels", limit=0.0)
    assert "0 s are over" in found["ended"] and len(found["block"]) < 105


def test_the_table_tells_what_was_not_run() -> None:
    record = {"program": "a", "inside": 1, "judged": 2, "median_error": 1.5, "ended": None, "seconds": 3.0}
    text = methods_table([{**record, "method": "voxels"}, {**record, "method": "height map", "program": "b"}])
    assert "| a | 1 of 2, 150 % | not run |" in text and "| b | not run | 1 of 2, 150 % |" in text
    assert all(METHODS[name][1] in text for name in ("voxels", "height map")) and "numpy" in text
