"""Brackets of the columns engine against counts, by family and seed: random programs of three-axis blocks.

A block is judged by sets of columns over its box, stratified, each column with the exact length that the block
takes of it: a golden section along the path of this and of every earlier block. The referee shares no code with any
engine; it knows cutters as numbers of APT and paths as points, centres and angles. Standard errors come from the spread
of the sets. A block whose bracket lies more than `BAR` of them beside the mean is counted again, with eight times as
many sets of other columns, twice if need be: a deep sliver that few columns meet has a spread that few columns show. If it
does so each time, it is `outside`. So is a program whose sum of brackets lies beside the
volume that all of its blocks take together.

`journal`, a file of one row per program, makes a run that was cut resume where it was. What was counted:
`docs/measured/columns.md`.

Known limits: arcs are searched from poses closely along them; a lowest pose between two of these that both miss the place is
found only right above, below or beside it.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from benchmarks.columns_counts import _kernels
from benchmarks.columns_counts.programs import CUTTERS, FAMILIES, Program, drawn
from benchmarks.journal import journaled
from vmachining.engines.columns import ColumnsEngine
from vmachining.engines.protocol import Removal

__all__ = ["columns_counts", "counted", "program_row"]

SETS, SIDE = (24, 192, 1536), 32
"""Sets of columns, of a first count and of those that follow a doubt, and columns along each side of one."""

BAR = 4.0
"""Standard errors."""

FEW = 100
"""Columns that are met, below which their spread says nothing: the error is then at least that of columns as deep as the
stock that make up the upper bound."""

SHORT_MM, SEEN = 0.05, 4.0
"""A block as short takes a crescent that may be deep and narrower than columns stand apart: what comes in so many columns as
deep as the stock for each standard error may not have been met."""

SEARCH_MM3 = 1e-8
"""Where the search along the path ends at rounding."""


def columns_counts(
    blocks: int = 200, first: int = 0, journal: str | Path | None = None
) -> Iterator[dict[str, Any]]:
    """A row per program of so many seeds, then tables by family and cutter, and one line of all."""
    rows = []
    for row in journaled(range(first, first + blocks), journal, program_row):
        rows.append(row)
        yield row
    for key, names in (("family", FAMILIES), ("cutter", CUTTERS)):
        for name in names:
            some = [row for row in rows if row[key] == name]
            if some:
                yield {"case": "columns-counts", key: name, **_sums(some)}
    yield {"case": "columns-counts", "first": first, **_sums(rows)}


def _sums(rows: list[dict[str, Any]]) -> dict[str, Any]:
    widths = [row["median_width"] for row in rows if row["median_width"]]
    return {
        "programs": len(rows),
        **{key: sum(row[key] for row in rows) for key in ("blocks", "air", "counted_again", "outside")},
        "worst_errors": max((row["worst_errors"] for row in rows), default=0.0),
        "median_width": float(np.median(widths)) if widths else None,
        "seeds_outside": [row["seed"] for row in rows if row["outside"]],
        "engine_seconds": sum(row["engine_seconds"] for row in rows),
        "seconds": sum(row["seconds"] for row in rows),
    }


def program_row(seed: int) -> dict[str, Any]:
    """What came out of one program; times are processor seconds."""
    begin = process_time()
    rng = np.random.default_rng([seed, 1])
    program = drawn(seed)
    width, floor = rng.choice([0.05, 0.02, 0.01, 0.003]), rng.choice([1e-3, 1e-4])
    engine = ColumnsEngine(program.stock, float(width), float(floor))
    found = [engine.cut(sweep, k) for k, sweep in enumerate(program.sweeps)]
    spent = process_time() - begin
    again, outside, worst = 0, [], 0.0
    total = Removal(*np.sum([r[:3] for r in found], axis=0).tolist())
    for k, removal in enumerate([*found, total]):
        assert removal.lo <= removal.estimate <= removal.hi
        for sets in SETS:
            errors = _beside(program, k, removal, sets, rng)
            if errors <= BAR:
                break
        again += sets > SETS[0]
        if errors > BAR:
            outside.append(k)
        worst = max(worst, errors)
    known = [r.width / r.estimate for r in found if r.estimate > 0.0]
    return {
        "case": "columns-counts", "seed": seed, "family": program.family, "cutter": program.cutter,
        "blocks": len(found), "air": len(found) - len(known), "counted_again": again, "outside": len(outside),
        "which": outside, "worst_errors": worst, "width": width, "median_width": float(np.median(known)) if known else 0.0,
        "engine_seconds": spent, "seconds": process_time() - begin,
    }  # fmt: skip


def _beside(program: Program, k: int, removal: Removal, sets: int, rng: np.random.Generator) -> float:
    """Standard errors by which a bracket lies beside the count; 0: it does not."""
    volume, error = counted(program, k, removal.hi, sets, rng)
    if k < len(program.moves) and np.linalg.norm(program.moves[k, 4:7] - program.moves[k, 1:4]) < SHORT_MM:
        low, high = program.low, program.high
        area = float(
            np.prod(np.minimum(high[:2], program.box[k, 2:]) - np.maximum(low[:2], program.box[k, :2]))
        )
        error += SEEN * max(area, 0.0) * float(high[2] - low[2]) / (sets * SIDE * SIDE)
    return max(removal.lo - volume, volume - removal.hi, 0.0) / error


def counted(
    program: Program, k: int, most: float, sets: int, rng: np.random.Generator
) -> tuple[float, float]:
    """Volume that block k takes, or all together, and its standard error, mm^3, where it may be `most`."""
    low, high = program.low[:2], program.high[:2]
    if k < len(program.moves):
        low, high = np.maximum(low, program.box[k, :2]), np.minimum(high, program.box[k, 2:])
    if (low >= high).any():
        return 0.0, SEARCH_MM3
    i, j = np.meshgrid(np.arange(SIDE), np.arange(SIDE))
    corner = np.column_stack([i.ravel(), j.ravel()])
    bottom, top, area = float(program.low[2]), float(program.high[2]), float(np.prod(high - low))
    depth, means, hits = np.zeros(SIDE * SIDE), np.zeros(sets), 0
    for s in range(sets):
        places = low + (corner + rng.random(corner.shape)) / SIDE * (high - low)
        _kernels.taken(
            program.cutters, program.moves, program.box, k, bottom, places, program.top(places), depth,
        )  # fmt: skip
        means[s] = area * depth.mean()
        hits += int((depth > 0.0).sum())
    error = float(means.std(ddof=1)) / np.sqrt(sets)
    if hits < FEW:
        error = max(error, np.sqrt(area * (top - bottom) * most / (sets * SIDE * SIDE)))
    return float(means.mean()), error + SEARCH_MM3
