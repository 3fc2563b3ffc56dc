"""Other ways of computing, on a case of the reference set: plain booleans are inside, grids are not, and the table says so."""

from __future__ import annotations

import pytest

from benchmarks.methods import METHODS, case_cuts, case_results, methods_table
from tests.models.shipped import MODELS
from vmachining.oracle.results import read_reference

CASE = MODELS / "reference_pack" / "plunges"


@pytest.mark.parametrize(
    ("method", "share"), [("height map", 0.01), ("voxels", 0.02), ("global mesh", 1e-3), ("plain OCCT", 2e-3)]
)
def test_a_method_cuts_a_case(method: str, share: float) -> None:
    volumes = [volume for volume, _ in case_cuts(CASE / "job.toml", method)]
    low, _, high = read_reference(CASE).total
    # a grid of 0.25 mm on discs of radius 5, facets within 0.02 mm; OCCT is exact on cylinders, the bounds are 0.2 % wide
    assert low * (1.0 - share) <= sum(volumes) <= high * (1.0 + share)


def test_a_method_that_is_out_of_time_says_where_and_keeps_what_it_answered() -> None:
    short, full = (case_results(CASE / "job.toml", "voxels", limit=limit) for limit in (0.0, 60.0))
    assert "0 s are over" in short["ended"] and full["ended"] is None
    assert 0 < len(short["block"]) < len(full["block"]) == 105
    assert full["removed_mm3"][: len(short["block"])] == short["removed_mm3"]


def test_a_block_that_takes_too_long_ends_its_case() -> None:
    found = case_results(CASE / "job.toml", "plain OCCT", seconds=0.0)
    assert "no answer within 0 s" in found["ended"]


def test_the_table_tells_what_was_not_run() -> None:
    record = {
        "program": "a",
        "inside": 1,
        "judged": 2,
        "median_error": 1.5,
        "unanswered": 1,
        "ended": None,
        "seconds": 3.0,
    }
    text = methods_table(
        [
            {**record, "method": "voxels"},
            {**record, "method": "height map", "program": "b", "ended": "block 1: 60 s"},
        ]
    )
    assert "| a | 1 of 2, 150 % | not run |" in text
    assert "| b | not run | 1 of 2, 150 % (gave up after 1 blocks) |" in text
    assert all(METHODS[name][1] in text for name in ("voxels", "height map")) and "numpy" in text
