"""The Z-map that the analytic engagement is timed against finds the same lengths, but for its resolution."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks._kernels import zmap_lowered
from benchmarks.zmap import PITCHES, STEPS, zmap
from vmachining.engagement import frames


@pytest.mark.slow  # compiles a kernel of its own, and walks fine grids
def test_the_zmap_is_an_honest_one():
    each = 1 + 2 * len(PITCHES)
    rows = list(zmap(positions=40, repeats=1))
    assert len(rows) == len(STEPS) * 2 * each
    for k in range(0, len(rows), each):
        exact, *others = rows[k : k + each]
        assert exact["method"] == "analytic" and exact["million_per_s"] > 0
        for method in ("zmap", "vectors"):
            maps = [row for row in others if row["method"] == method]
            errors = [row["rms_mm"] for row in maps]
            assert len(errors) == len(PITCHES)
            assert errors == sorted(errors, reverse=True)  # finer is better, and never exact
            # a length ends within an element at either side; walls and tops of cells are off by half a cell
            assert all(0 < row["rms_mm"] < 0.4 * row["pitch_mm"] for row in maps)


@pytest.mark.parametrize(("rm", "r"), [(5.0, 5.0), (10.0, 0.0), (0.0, 8.0)])
@pytest.mark.parametrize("lean", [(0.0, 0.0), (3.0, 10.0)])
def test_a_kept_zmap_is_the_underside_of_the_tool(rm, r, lean):
    """Every height that is left lies on the tool: at distance 0 from the rod with a round bottom, and below its axis' side."""
    frame = frames.rotation(*np.radians(lean))[None]
    tip, pitch = np.array([[0.3, -0.2, 0.4]]), 0.25
    left = np.full((120, 120), 3.0)
    zmap_lowered(tip, frame, rm, r, -15.0, -15.0, pitch, left)
    at = -15.0 + pitch * (np.arange(120) + 0.5)
    cut = left < 3.0
    x, y = np.meshgrid(at, at, indexing="ij")
    q = (np.stack([x, y, left], axis=-1) - tip[0]) @ frame[0]
    rho, h = np.hypot(q[..., 0], q[..., 1]), q[..., 2]
    aside, below = np.maximum(rho - rm, 0.0), np.maximum(r - h, 0.0)
    gap = np.where(h >= r, rho - rm - r, np.hypot(aside, below) - r)
    gap = np.where(rho <= rm, np.maximum(gap, -h), gap)  # above the bottom disc
    assert cut.sum() > 300
    np.testing.assert_allclose(gap[cut], 0.0, atol=1e-8)
    assert (gap[~cut] >= -1e-9).all()  # what is left alone is not inside
