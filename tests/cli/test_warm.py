"""`vmachining warm` leaves nothing to compile, and whoever compiles says so."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest


def command(words, cache):
    environment = os.environ | {"NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": os.pathsep.join(sys.path)}
    return subprocess.run(
        [sys.executable, "-m", "vmachining", *words], env=environment, capture_output=True, text=True
    )


@pytest.mark.slow  # compiles every kernel into an empty cache, twice
def test_after_warming_the_demo_does_not_compile(tmp_path):
    cold = command(["demo", "--out", str(tmp_path / "cold")], tmp_path / "cold_cache")
    assert cold.returncode == 0 and "compiling kernels" in cold.stderr
    done = command(["warm"], tmp_path / "cache")
    assert done.returncode == 0 and "kernels are compiled" in done.stderr
    warm = command(["demo", "--out", str(tmp_path / "warm")], tmp_path / "cache")
    assert warm.returncode == 0 and "compiling kernels" not in warm.stderr
