"""Columns over plates and cutters of any size: a matrix of both, then random ones; none may crash or miss a count.

Run it with NUMBA_BOUNDSCHECK=1 to see every write outside an array (`./run bounds`). The referee is that of
`columns-counts`.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

import vmachining as vm
from benchmarks.columns_counts import BAR, SETS, counted
from benchmarks.columns_counts.programs import Program
from benchmarks.journal import journaled
from vmachining.arrays import Floats
from vmachining.engines.columns import ColumnsEngine, FlatStock
from vmachining.engines.protocol import Removal
from vmachining.geometry import Line
from vmachining.sweep import Sweep

__all__ = ["CUTTERS_MM", "PLATES_MM", "columns_plates", "plate_row"]

CUTTERS_MM = (0.5, 1.0, 3.0, 6.0, 10.0, 30.0, 50.0)
PLATES_MM = (1.0, 10.0, 50.0, 150.0, 400.0, 1000.0, 2000.0)
"""Diameters, and edges of square plates, of the matrix: seeds 0 to 48, plate by plate."""

MATRIX = len(CUTTERS_MM) * len(PLATES_MM)
HEIGHT_MM = 20.0


def columns_plates(
    blocks: int = 2 * MATRIX, first: int = 0, journal: str | Path | None = None
) -> Iterator[dict[str, Any]]:
    """A row per plate, the matrix first, and one line of all."""
    rows = []
    for row in journaled(range(first, first + blocks), journal, plate_row):
        rows.append(row)
        yield row
    yield {
        "case": "columns-plates", "first": first, "plates": len(rows), "outside": sum(row["outside"] for row in rows),
        "seconds": sum(row["seconds"] for row in rows),
    }  # fmt: skip


def plate_row(seed: int) -> dict[str, Any]:
    """Two cuts of one cutter, all that is left; times are processor seconds."""
    rng = np.random.default_rng([seed, 40])
    if seed < MATRIX:
        diameter, kind = CUTTERS_MM[seed % len(CUTTERS_MM)], ("ball", "flat", "bull")[seed % 3]
        edges = np.full(2, PLATES_MM[seed // len(CUTTERS_MM)])
    else:
        diameter, kind = (
            float(np.exp(rng.uniform(np.log(0.5), np.log(50.0)))),
            str(rng.choice(["ball", "flat", "bull"])),
        )
        edges = np.exp(rng.uniform(0.0, np.log(2000.0), 2))
    program = _plate(rng, diameter, kind, edges)
    begin = process_time()
    engine = ColumnsEngine(program.stock)
    found = [engine.cut(sweep, k) for k, sweep in enumerate(program.sweeps)]
    cut = process_time() - begin
    left = engine.volume
    looked = process_time() - begin - cut
    outside = 0
    for k, removal in enumerate(found):
        for sets in SETS:
            volume, error = counted(program, k, removal.hi, sets, rng)
            if max(removal.lo - volume, volume - removal.hi) <= BAR * error:
                break
        else:
            outside += 1
    gone = Removal(*np.sum([r[:3] for r in found], axis=0).tolist())
    slack = 1e-9 * program.stock.volume
    outside += (
        not program.stock.volume - gone.hi - slack
        <= left.lo
        <= left.hi
        <= program.stock.volume - gone.lo + slack
    )
    return {
        "case": "columns-plates", "seed": seed, "cutter_mm": diameter, "kind": kind, "plate_mm": edges.tolist(),
        "removed_mm3": gone.estimate, "outside": outside,
        "cut_seconds": cut, "look_seconds": looked, "seconds": process_time() - begin,
    }  # fmt: skip


def _plate(rng: np.random.Generator, diameter: float, kind: str, edges: Floats) -> Program:
    R = 0.5 * diameter
    corner = {"ball": R, "flat": 0.0, "bull": 0.3 * R}[kind]
    tool = (
        vm.FlatEnd(diameter=diameter, length=60.0) if kind == "flat"
        else vm.BallNose(diameter=diameter, length=60.0) if kind == "ball"
        else vm.BullNose(diameter=diameter, corner_radius=corner, length=60.0)
    )  # fmt: skip
    numbers = [0.0, R - corner, R - corner, corner, corner, R, corner, 0.0, R]
    low, high = np.array([0.0, 0.0, -HEIGHT_MM]), np.array([*edges, 0.0])
    places = np.concatenate([rng.uniform(0.0, edges, (1, 2)), rng.uniform(-0.2 * edges, 1.2 * edges, (2, 2))])
    places[1:] = places[0] + np.clip(places[1:] - places[0], -8.0 * diameter, 8.0 * diameter)
    tips = np.column_stack([places, -rng.uniform(0.05, 0.9, 3) * min(HEIGHT_MM, diameter)])
    moves = np.array([[-1.0, *a, *b, 0.0, 0.0, 0.0] for a, b in pairwise(tips)])
    ends = np.stack([moves[:, 1:3], moves[:, 4:6]])
    box = np.column_stack([ends.min(axis=0) - R, ends.max(axis=0) + R])
    sweeps = [Sweep.along(tool, Line(row[1:4], row[4:7])) for row in moves]
    stock = FlatStock((0.0, 0.0, -HEIGHT_MM), (float(edges[0]), float(edges[1]), 0.0))
    return Program(
        "plates",
        kind,
        np.array([numbers]),
        moves,
        box,
        low,
        high,
        lambda at: np.zeros(len(at)),
        sweeps,
        stock,
    )
