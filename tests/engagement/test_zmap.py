"""The Z-map that the analytic engagement is timed against finds the same lengths, but for its resolution."""

from __future__ import annotations

import pytest

from vmachining.bench.zmap import PITCHES, zmap


@pytest.mark.slow  # compiles a kernel of its own, and walks fine grids
def test_the_zmap_is_an_honest_one():
    rows = list(zmap(positions=60, repeats=1))
    assert len(rows) == 2 * 2 * (1 + len(PITCHES))
    for k in range(0, len(rows), 1 + len(PITCHES)):
        exact, *maps = rows[k : k + 1 + len(PITCHES)]
        assert exact["method"] == "analytic" and exact["million_per_s"] > 0
        errors = [row["rms_mm"] for row in maps]
        assert errors == sorted(errors, reverse=True)  # finer is better, and never exact
        # a length ends within an element at either side; walls and tops of cells are off by half a cell
        assert all(0 < row["rms_mm"] < 0.4 * row["pitch_mm"] for row in maps)
