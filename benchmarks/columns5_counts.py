"""Columns in any direction: every bracket of one number must meet all others, and those of exact rays.

Each random block is asked in six directions with all rules and with some, along the directions that `run` takes, as the sum of
its parts in time, and turned with a box: proofs of one number, whose meeting needs no judge and has no sampling
error. Exact rays (`RayEngine`, confidence 0.9999) judge them from outside.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from benchmarks.journal import journaled
from benchmarks.turned_blocks import HI, LO, Case, case_of, hills, in_parts, stairs, turned
from vmachining.arrays import Floats
from vmachining.engines.columns.turning import Air, AnyDirection, Rows, rows_of
from vmachining.engines.columns.turning.stocks import solid_of
from vmachining.engines.dexel import RayEngine
from vmachining.engines.protocol import NOTHING, Options, Removal
from vmachining.stock import BoxStock, Stock
from vmachining.sweep import Sweep, Turn

__all__ = ["BOX", "RULES", "asked", "brackets", "columns5_counts", "rays", "stock_of", "ways"]

BOX = BoxStock(LO, HI)
ALL = 15
RULES = (ALL, 14, 13, 11, 7, 0)
"""All in force; without covers of earlier sweeps; without shared poses (L5); without ranges of poses (L4); without curved
surfaces of balls (L8); none."""


class Along(AnyDirection):
    """One direction instead of the chosen ones."""

    way: Floats

    def _directions(self, rows: Rows, k: int, begins: bool = False) -> list[Floats]:
        return [self.way]


def asked(
    earlier: Sequence[Sweep],
    block: Sequence[Sweep],
    stock: Stock = BOX,
    way: Floats | None = None,
    rules: int = ALL,
    width: float = 0.01,
    air: bool = True,
) -> Removal:
    """What sweeps remove together after others, by columns in any direction; air: as `run` asks, where cubes are left."""
    engine = (AnyDirection if way is None else Along).of(stock, Options(width=width))
    engine.rules = rules
    if isinstance(engine, Along) and way is not None:
        engine.way = way / np.linalg.norm(way)
    done, total, cut = [rows_of(sweep) for sweep in earlier], NOTHING, Air(engine.solid)
    for sweep in block:
        own, near, left = rows_of(sweep), done, None
        if air and done:
            for number, rows in enumerate(done):
                if number not in cut:
                    cut.add(number, rows)
            left = cut.left(own)
            near = [done[number] for number in cut.around(left, sweep.bounds)[0]]
        total = total.plus(engine.cut(own, Rows.join(near) if near else None, left=left))
        done.append(own)
    return total


def ways(case: Case) -> list[Floats]:
    """Axis, axis less feed, feed, both diagonals, and upright."""
    path = case.block.path
    assert isinstance(path, Turn)
    axis, feed = path.axis(0.5), path.end - path.start
    feed = feed - (feed @ axis) * axis
    if np.linalg.norm(feed) < 1e-6:
        feed = np.cross(axis, [1.0, 0.0, 0.1])
    feed /= np.linalg.norm(feed)
    side = np.cross(axis, feed)
    return [axis, axis - feed, feed, axis + side, axis - side, np.array([0.0, 0.0, 1.0])]


def stock_of(seed: int) -> Stock:
    """Every second one the box, else one with a step or with a top of facets."""
    return (BOX, stairs(), BOX, hills(seed))[(seed + seed // 6) % 4]


def rays(case: Case, stock: Stock = BOX) -> Removal:
    """The interval of exact rays."""
    engine = RayEngine(stock)
    number = [engine.add(sweep) for sweep in (*case.earlier, case.block)][-1]
    return engine.removed([number], seed=number)


def brackets(seed: int) -> dict[str, Removal]:
    """All that is said of one block, by who says it."""
    case, stock = case_of(seed), stock_of(seed)
    solid, rng = solid_of(stock), np.random.default_rng(seed)
    said = {
        "run": asked(case.earlier, [case.block], stock),
        "rays": rays(case, stock),
        "parts": asked(case.earlier, in_parts(case, 3), stock),
    }
    if stock is BOX:
        box, moved = turned(case, seed)
        said["turned"] = asked(moved.earlier, [moved.block], box)
    for n, way in enumerate(ways(case)):
        if solid.stands(way / np.linalg.norm(way)):
            for rules, air in ((ALL, bool(rng.integers(2))), (int(rng.choice(RULES)), bool(rng.integers(2)))):
                said[f"{n}/{rules}/{air}"] = asked(case.earlier, [case.block], stock, way, rules, air=air)
    return said


def columns5_counts(
    blocks: int = 60, first: int = 0, journal: str | Path | None = None
) -> Iterator[dict[str, Any]]:
    """A row per block, and one line of all: `outside` counts blocks whose brackets do not all meet."""
    rows = []
    for row in journaled(range(first, first + blocks), journal, _row):
        rows.append(row)
        yield row
    yield {
        "case": "columns5-counts", "first": first, "blocks": len(rows), "outside": sum(row["outside"] for row in rows),
        "seconds": sum(row["seconds"] for row in rows),
    }  # fmt: skip


def _row(seed: int) -> dict[str, Any]:
    begin = process_time()
    case = case_of(seed)
    asked(case.earlier, [case.block], stock_of(seed))
    alone = process_time() - begin
    said = brackets(seed)
    lo, hi = max(r.lo for r in said.values()), min(r.hi for r in said.values())
    return {
        "case": "columns5-counts", "seed": seed, "block": case.name, "removed_mm3": said["run"].estimate,
        "width_mm3": said["run"].width, "outside": lo > hi, "ms": 1e3 * alone, "seconds": process_time() - begin,
    }  # fmt: skip
