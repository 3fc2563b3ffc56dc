"""Cutters of 0.5 to 50 mm on plates of 1 to 2,000 mm.

`vmachining bench columns-plates --seeds FIRST:LAST` continues with others.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.columns_plates import plate_row

CRASHED = (15, 23, 24, 32, 40, 48)
"""Of the matrix: plates with so many tiles that the look at all that is left wrote over the end of its cells."""

PROGRAM = """
from benchmarks.columns_plates import plate_row
for seed in {seeds}:
    print(plate_row(seed)["outside"])
"""


@pytest.mark.parametrize("seed", [*range(0, 49, 5), *range(49, 69)])
def test_a_plate_of_any_size(seed):
    row = plate_row(seed)
    assert row["outside"] == 0, row


@pytest.mark.long  # 40 s to minutes: kernels are compiled with their bounds checked; `./run bounds` does the same
def test_no_kernel_writes_outside_its_arrays(request):
    """In a process of its own: a kernel that does may take the process with it."""
    cache = request.config.cache.mkdir("bounds")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(seeds=(*CRASHED, 3, 10, 60))],
        cwd=Path(__file__).parents[2], env={**os.environ, "NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(cache)},
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["0"] * (len(CRASHED) + 3)
