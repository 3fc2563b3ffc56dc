"""`vmachining warm` leaves nothing to compile, and whoever compiles says so."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

ASKED = """
import atexit, json, sys
from numba.core.caching import Cache
asked, load = set(), Cache._load_overload
def noted(self, signature, context):
    asked.add(f"{self._impl.locator.get_cache_path()} {self._impl.filename_base} {signature}")
    return load(self, signature, context)
Cache._load_overload = noted
atexit.register(lambda: json.dump(sorted(asked), open(sys.argv[1], "w")))
"""
"""Every kernel and signature that a process asks the cache for, whether it was there or not, written as JSON."""


def started(argv, cache=None):
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    environment |= {} if cache is None else {"NUMBA_CACHE_DIR": str(cache)}
    return subprocess.Popen(
        [sys.executable, *argv], env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def command(words, cache):
    process = started(["-m", "vmachining", *words], cache)
    err = process.communicate()[1]
    assert process.returncode == 0, err
    return err


def test_the_command_that_compiles_says_so_once(tmp_path):
    program = tmp_path / "arc.nc"
    program.write_text("G21 G17 G90 G94 T1 M6\nG1 X10 F600\nG2 X20 Y10 I0 J10\nG3 X10 Y0 I-10 J0\nM30\n")
    assert command(["dda", str(program)], tmp_path / "cache").count("compiling kernels") == 1
    assert "compiling kernels" not in command(["dda", str(program)], tmp_path / "cache")


@pytest.mark.slow  # 15 s: the demo, twice
def test_the_demo_asks_for_no_kernel_that_warming_does_not(tmp_path):
    """One after the other: what is missing in the cache is compiled, and asks for what it calls, in the first alone."""
    asked = []
    for name, code in (
        ("warm", "from vmachining.cli.warm import demonstrated; demonstrated()"),
        ("demo", "from vmachining.cli.main import run; run(['demo', '--out', sys.argv[1] + '.out'])"),
    ):
        process = started(["-c", ASKED + code, str(tmp_path / name)])
        err = process.communicate()[1]
        assert process.returncode == 0, err
        asked.append(set(json.loads((tmp_path / name).read_text())))
    rooms = {room for room in ("columns", "engagement") if any(f"/{room}/" in kernel for kernel in asked[1])}
    assert rooms == {"columns", "engagement"} and asked[1] <= asked[0]
    assert "compiling kernels" not in err


@pytest.mark.long  # compiles every kernel into an empty cache
def test_after_warming_the_demo_does_not_compile(tmp_path):
    assert "kernels are compiled" in command(["warm"], tmp_path / "cache")
    assert "compiling kernels" not in command(["demo", "--out", str(tmp_path / "warm")], tmp_path / "cache")
