"""Columns over a long program: whether time a block, memory and checkpoints stay flat."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import vmachining as vm
from vmachining.engines.protocol import NOTHING, Options
from vmachining.engines.relay import ColumnsFirst
from vmachining.geometry import Line
from vmachining.stock import BoxStock
from vmachining.sweep import Sweep

__all__ = ["columns_long"]

LENGTH, WIDTH, ROW, DEPTH, FALL = 60, 30, 0.5, 6.0, 0.05
"""mm: of the part along x and y, between rows, of the first pass, from one pass to the next. Blocks are 1 mm long. The first
pass is deeper than the radius of the ball, so that all later ones meet as many tiles."""


def columns_long(blocks: int = 100_000) -> Iterator[dict[str, Any]]:
    """Passes of a ball over the same 60 x 30 mm, each 0.05 mm deeper: one row at 10,000 blocks and at every tenfold, each
    with the processor time of its last 5,000 blocks; memory is that of this process now, not its peak."""
    tool = vm.BallNose(diameter=10.0, length=400.0).cutter
    passes = blocks // (LENGTH * int(WIDTH / ROW)) + 1
    engine = ColumnsFirst.of(
        BoxStock((0, 0, -DEPTH - FALL * passes - 6.0), (LENGTH, WIDTH, 0)), Options(width=0.01)
    )
    stops = [n for n in (10**k for k in range(4, 10)) if n < blocks] + [blocks]
    gone, wide, begin = NOTHING, 0, process_time()
    for k, path in enumerate(_passes(blocks), 1):
        if k == max(stops[0] - 5_000, 1):
            begin, first = process_time(), k
        found = engine.cut(Sweep.along(tool, path), k)
        gone, wide = gone.plus(found), wide + (found.note is not None)
        if k == stops[0]:
            seconds = process_time() - begin
            stops.pop(0)
            gc.collect()
            with TemporaryDirectory() as folder:
                engine.save(Path(folder) / "state.npz")
                saved = (Path(folder) / "state.npz").stat().st_size
            yield {
                "case": "columns-long", "blocks": k, "ms_per_block": 1e3 * seconds / (k - first + 1), "memory_mb": _memory_mb(),
                "checkpoint_mb": saved / 1e6, "kept": engine.kept, "wider": wide,
                "removed_mm3": gone.estimate, "width_of_the_sum": gone.width / gone.estimate,
            }  # fmt: skip


def _passes(blocks: int) -> Iterator[Line]:
    """Lines of 1 mm, rows to and fro."""
    x, y, z, way, row = 0, 0.0, -DEPTH, 1, 1.0
    for _ in range(blocks):
        if 0 <= x + way <= LENGTH:
            yield Line((x, y, z), (x + way, y, z))
            x += way
            continue
        way = -way
        if 0.0 <= y + row * ROW <= WIDTH:
            yield Line((x, y, z), (x, y + row * ROW, z))
            y += row * ROW
        else:
            yield Line((x, y, z), (x, y, z - FALL))
            z, row = z - FALL, -row


def _memory_mb() -> float:
    """Of this process now; NaN where the system does not say."""
    try:
        return float(Path("/proc/self/status").read_text().split("VmRSS:")[1].split()[0]) / 1024.0
    except (OSError, IndexError, ValueError):
        return float("nan")
