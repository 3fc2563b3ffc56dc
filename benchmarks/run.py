"""A whole run, from the program to the page: time and memory by stage, in one process and in two, next to one manifold3d solid.

A machine's speed differs from day to day by a factor of two, so its absolute times say little: the solid, cut from the same
blocks in the same run, is the measure.
"""

from __future__ import annotations

import json
import resource
import sys
from collections.abc import Iterator
from pathlib import Path
from subprocess import run as command
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

import vmachining as vm
from vmachining.arrays import Floats
from vmachining.engines.columns import FlatStock

from ._solid import solid_blocks

__all__ = ["run"]

LENGTH, ROW, EDGE = 40, 0.5, 8.0
"""mm: of a row in blocks of 1 mm, between rows, of the stock beyond the path."""

SOLID_BLOCKS = 2_000
"""The solid is cut by no more than the first 2,000 blocks: each costs more than the one before."""


def run(blocks: int = 2_000) -> Iterator[dict[str, Any]]:
    """A ball of 10 mm finishes a deep wave, defaults throughout. Processor time is that of all processes together."""
    points = _wave(blocks)
    low, high = (
        (-EDGE, -EDGE, -40.0),
        (float(points[:, 0].max()) + EDGE, float(points[:, 1].max()) + EDGE, 0.0),
    )
    with TemporaryDirectory() as folder:
        job = Path(folder) / "wave.toml"
        job.with_suffix(".nc").write_text(_program(points))
        job.write_text(_JOB.format(low=list(low), high=list(high)))
        for workers in (1, 2):
            yield {"case": "run", "blocks": len(points) - 1, "workers": workers} | _timed(job, workers)
    tool, stock = vm.BallNose(diameter=10.0, length=60.0), FlatStock(low, high)
    seconds = [spent for _, spent in solid_blocks(tool, stock, points[: SOLID_BLOCKS + 1])]
    yield {"case": "run", "solid_blocks": len(seconds), "solid_s": sum(seconds)}


def _wave(blocks: int) -> Floats:
    """Points of rows to and fro, (n, 3), at least `blocks` of them from one to the next."""
    length = LENGTH if blocks < 10_000 else int(blocks**0.5)
    rows = blocks // (length + 1) + 1
    x = np.concatenate([np.arange(length + 1.0)[:: 1 - 2 * (k % 2)] for k in range(rows)])
    y = np.repeat(ROW * np.arange(rows), length + 1)
    return np.column_stack([x, y, -17.5 + 11.5 * np.sin(x / 8 + y / 4)])


def _program(points: Floats) -> str:
    cuts = "\n".join(f"X{x:.4f} Y{y:.4f} Z{z:.4f}" for x, y, z in points)
    return f"%\nG21 G90 G17 G94\nT1 M6\nS8000 M3\nG0 X0 Y0 Z20\nG1 F1200 {cuts}\nG0 Z20\nM30\n%\n"


_JOB = """\
name = "wave"
[program]
file = "wave.nc"
home = [0, 0, 50]
[machine]
chain = "xyz"
max_feed_mm_min = 4000
[[tools]]
number = 1
type = "ball"
diameter_mm = 10
length_mm = 60
flutes = 2
[stock]
box = {{ min = {low}, max = {high} }}
"""


def _timed(job: Path, workers: int) -> dict[str, Any]:
    """One run in a process of its own, which starts its workers."""
    out = job.parent / f"out{workers}"
    options = f"-m vmachining run {job.name} --out {out.name} --workers {workers} --quiet"
    before, begin = _processor(), perf_counter()
    command([sys.executable, *options.split()], cwd=job.parent, check=True)
    wall, spent = perf_counter() - begin, _processor() - before
    said = json.loads((out / "summary.json").read_text())
    return {
        "wall_s": wall, "processor_s": spent, "peak_mb": said["peak_mb"], "stages_s": said["stage_seconds"],
        "removed_mm3": said["removed_mm3"], "page_mb": (out / "report.html").stat().st_size / 1e6,
    }  # fmt: skip


def _processor() -> float:
    """Processor seconds of all child processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
