"""How often stated intervals of the dexel grid hold the truth in the programs that come with vmachining.

The truth is a proven bracket: of the reference set as published, of other jobs by columns to `WIDTH`, which hand on to the mesh
engine what they do not take. Three answers per block: the bracket lies in the interval (it holds), overlaps it (nobody knows; how
many of their estimates lie in the interval is told too), or lies outside of it (it misses). Errors are against the estimate that
comes with the bracket.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import inf
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.job import Job, run
from vmachining.oracle import compare_engines

__all__ = ["dexel_shipped"]

BLOCKS = {
    "slot": 109, "staircase": 189, "triangular_pocket": 20, "half_cylinder": 120, "finishing": 120, "pocket": 50, "mill_turn": 92,
    "mould": 150, "mould_cover": 150, "blade": 24, "impeller": 24,
}  # fmt: skip
"""Of each job: so many of the blocks that cut. A five-axis block takes the mesh engine a second or two."""

WIDTH = 1e-3
"""Of brackets by columns, relative."""

COUNTED = ("blocks", "holds", "unknown", "unknown_estimate_in", "misses")

ROUND = 1e-9
"""mm^3 and relative, of sums."""


def dexel_shipped() -> Iterator[dict[str, Any]]:
    """A record per job, and one of all."""
    from vmachining.cli.demo import demo_job

    models, counts = demo_job().parent.parent, np.zeros(len(COUNTED))
    for name, blocks in BLOCKS.items():
        job = Job.load(models / name / "job.toml")
        job = job.with_width(str(WIDTH))
        found = compare_engines(job, ("columns", "dexel"), blocks=blocks)
        proven, stated = found.answers
        bound = proven.proven.astype(bool) & proven.has & stated.has
        columns = np.array([proven.lo, proven.estimate, proven.hi, stated.lo, stated.estimate, stated.hi])[
            :, bound
        ]
        row = _told(name, *columns)
        yield row | {"seconds": float(stated.seconds.sum()), "seconds_proven": float(proven.seconds.sum())}
        counts += [row[name] for name in COUNTED]
    for folder in sorted(path.parent for path in (models / "reference_pack").glob("*/manifest.json")):
        begin = process_time()
        row = _told(f"reference_pack/{folder.name}", *_published(folder))
        yield row | {"seconds": process_time() - begin}
        counts += [row[name] for name in COUNTED]
    yield {"case": "dexel-shipped", "job": "all"} | dict(
        zip(COUNTED, counts.astype(int).tolist(), strict=True)
    )


def _published(folder: Path) -> Floats:
    """(6, n) lo, estimate, hi of a published pack, and of the grid."""
    seen = run(Job.load(folder / "job.toml"), engine="dexel").blocks
    rows = pl.read_parquet(folder / "blocks.parquet").join(seen, on="block", suffix="_grid")
    rows = rows.filter(pl.col("engine").is_in(["columns", "mesh"]))
    names = ("removed_lo_mm3", "removed_mm3", "removed_hi_mm3")
    return rows.select(*names, *(f"{name}_grid" for name in names)).to_numpy().T.astype(np.float64)


def _told(
    name: str, lo: Floats, truth: Floats, hi: Floats, low: Floats, estimate: Floats, high: Floats
) -> dict[str, Any]:
    """One record; only blocks for which somebody says that they may remove something."""
    some = np.maximum(hi, high) > ROUND
    lo, truth, hi, low, estimate, high = (column[some] for column in (lo, truth, hi, low, estimate, high))
    near = ROUND * (1.0 + hi)
    misses = (lo > high + near) | (hi < low - near)
    holds = (low <= lo + near) & (hi <= high + near)
    unknown = ~holds & ~misses
    real = truth > 1e-3
    off, half, proven = (
        part[real] / truth[real] for part in (np.abs(estimate - truth), 0.5 * (high - low), 0.5 * (hi - lo))
    )
    return {
        "case": "dexel-shipped", "job": name, "blocks": len(lo), "holds": int(holds.sum()), "unknown": int(unknown.sum()),
        "unknown_estimate_in": int((unknown & (low <= truth + near) & (truth <= high + near)).sum()), "misses": int(misses.sum()),
        "median_off": _median(off), "median_half": _median(half), "median_half_proven": _median(proven),
        "total_off": _ratio(estimate.sum(), truth.sum()),
    }  # fmt: skip


def _median(values: Floats) -> float | None:
    return float(np.median(values)) if len(values) else None


def _ratio(a: float, b: float) -> float:
    return a / b - 1.0 if b else inf
