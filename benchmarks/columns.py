"""Columns: processor time of 1 mm blocks by cutter and width, of a finishing pass and of deep slots on a wave, and of arcs;
beside them the mesh engine on the same blocks, and one global solid that is cut block by block."""

from __future__ import annotations

import time
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

import vmachining as vm
from vmachining.arrays import Floats
from vmachining.engines.columns import ColumnsEngine, FlatStock
from vmachining.engines.mesh import MeshEngine
from vmachining.engines.protocol import Options, Removal
from vmachining.geometry import Arc, Line
from vmachining.sweep import Sweep
from vmachining.tolerance import CHORD_MM

from ._solid import solid_blocks

__all__ = ["columns", "columns_solid"]

TOOLS: dict[str, vm.Tool] = {
    "ball": vm.BallNose(diameter=10.0, length=60.0),
    "bull": vm.BullNose(diameter=10.0, corner_radius=2.0, length=60.0),
    "flat": vm.FlatEnd(diameter=10.0, length=60.0),
    "cone": vm.Taper(diameter=2.0, taper_deg=20.0, corner_radius=1.0, length=40.0),
}

WIDTHS = (0.01, 0.001)

FLOOR_MM3 = 1e-3
"""Width at which a block is done whatever its own volume: that of `--width-mm3`."""

BESIDE = 24
"""Blocks that the mesh engine cuts as well."""


def _serpentine(blocks: int, xs: Floats, step: float) -> Floats:
    rows = [
        np.column_stack([xs if k % 2 == 0 else xs[::-1], np.full(len(xs), k * step)])
        for k in range(blocks // len(xs) + 2)
    ]
    return np.concatenate(rows)[: blocks + 1]


def _finishing(blocks: int) -> tuple[Floats, FlatStock]:
    """Rows 0.5 mm apart, about 1 mm deep."""
    plan = _serpentine(blocks, np.arange(-6.0, 35.1), 0.5)
    z = -1.0 + 0.25 * np.sin(plan[:, 0] / 8.0) + 0.2 * np.cos(plan[:, 1] / 5.0)
    return np.column_stack([plan, z]), FlatStock((0.0, 0.0, -10.0), (30.0, 40.0, 0.0))


def _deep(blocks: int) -> tuple[Floats, FlatStock]:
    """Rows 4 mm apart, 6 to 29 mm deep, ramps up to 55 degrees."""
    plan = _serpentine(blocks, np.arange(0.0, 40.1, 0.7), 4.0)
    z = -17.5 + 11.5 * np.sin(plan[:, 0] / 8.0 + plan[:, 1] / 4.0)
    return np.column_stack([plan, z]), FlatStock((-8.0, -8.0, -40.0), (48.0, 90.0, 0.0))


def _timed(engine: ColumnsEngine | MeshEngine, sweeps: list[Sweep]) -> tuple[list[float], list[Removal]]:
    """Processor seconds and answer of each."""
    seconds, found = [], []
    for sweep in sweeps:
        begin = time.process_time()
        found.append(engine.cut(sweep))
        seconds.append(time.process_time() - begin)
    return seconds, found


def _width(found: list[Removal]) -> float:
    """Median of the relative widths above the floor, 0 where all stop there."""
    wide = [r.width / r.estimate for r in found if r.width > 1.01 * FLOOR_MM3]
    return float(np.median(wide)) if wide else 0.0


def _rows(
    case: dict[str, Any], stock: FlatStock, sweeps: list[Sweep], skip: int, *, meshed: bool = True
) -> Iterator[dict[str, Any]]:
    """One row for each width, beside the mesh engine if `meshed`; what columns take is compiled before."""
    first = ColumnsEngine(stock, 0.5)
    for sweep in sweeps[:2]:
        first.cut(sweep)
    beside: list[float] = []
    if meshed:
        mesh = MeshEngine.of(stock.shape, Options(chord=CHORD_MM))
        mesh.cut(sweeps[0])
        beside, coarse = _timed(mesh, sweeps[1 : 1 + BESIDE])
    for width in WIDTHS:
        engine = ColumnsEngine(stock, width, FLOOR_MM3)
        seconds, found = _timed(engine, sweeps)
        row = {
            "case": "columns", **case, "blocks": len(sweeps), "width": width,
            "ms_per_block": 1e3 * float(np.mean(seconds[skip:])), "median_width": _width(found[skip:]),
            "cells_per_block": engine.cells / len(sweeps), "removed_mm3": sum(r.estimate for r in found),
        }  # fmt: skip
        if meshed:
            row["mesh_ms_per_block"], row["mesh_median_width"] = 1e3 * float(np.mean(beside)), _width(coarse)
            row["times_faster_than_mesh"] = sum(beside) / sum(seconds[1 : 1 + BESIDE])
        yield row


def columns(blocks: int = 240) -> Iterator[dict[str, Any]]:
    """One row for each cutter, program and width, and for turns of a circle; the first quarter of the blocks is not counted.

    Turns are not given to the mesh engine, which takes 1 to 18 s for one.
    """
    for name, tool in TOOLS.items():
        for program, make in (("finishing", _finishing), ("deep", _deep)):
            points, stock = make(blocks)
            sweeps = [Sweep.along(tool, Line(a, b)) for a, b in pairwise(points)]
            yield from _rows({"tool": name, "program": program}, stock, sweeps, blocks // 4)
    stock = FlatStock((-22.0, -22.0, -15.0), (22.0, 22.0, 0.0))
    for name, tool in TOOLS.items():
        for radius, rise in ((14.0, 0.0), (14.0, -2.0), (3.0, -1.0)):
            turns = [
                Sweep.along(tool, Arc((radius, 0.0, z), (0.0, 0.0, z), angle=2.0 * np.pi, rise=rise))
                for z in (-2.0, -3.0)
            ]
            yield from _rows(
                {"tool": name, "program": f"turn, radius {radius:g}, rise {rise:g}"}, stock, turns, 0
            )


def columns_solid(blocks: int = 2000) -> Iterator[dict[str, Any]]:
    """Deep blocks of a ball by columns at 1 %, and by one manifold3d solid from which hulls of two poses are taken.

    The solid knows no bracket: of its blocks the difference to that of columns is stated, beyond the bracket.
    """
    tool = TOOLS["ball"]
    points, stock = _deep(blocks)
    sweeps = [Sweep.along(tool, Line(a, b)) for a, b in pairwise(points)]
    first = ColumnsEngine(stock, 0.5)
    for sweep in sweeps[:2]:
        first.cut(sweep)
    seconds, found = _timed(ColumnsEngine(stock, 0.01, FLOOR_MM3), sweeps)
    beside, beyond = [], []
    for (taken, spent), r in zip(solid_blocks(tool, stock, points), found, strict=True):
        beside.append(spent)
        if r.estimate > FLOOR_MM3:
            beyond.append(max(r.lo - taken, taken - r.hi, 0.0) / r.estimate)
    yield {
        "case": "columns-solid", "blocks": blocks, "ms_per_block": 1e3 * float(np.mean(seconds)),
        "median_width": _width(found), "solid_ms_per_block": 1e3 * float(np.mean(beside)),
        "times_faster_than_one_global_solid": sum(beside) / sum(seconds),
        "solid_outside_the_bracket": float(np.mean(np.array(beyond) > 0.0)),
        "solid_beyond_by_median": float(np.median(beyond)), "solid_beyond_by_most": float(np.max(beyond)),
    }  # fmt: skip
