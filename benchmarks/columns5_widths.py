"""What turning blocks cost and how narrow they become: columns in any direction, hulls of the mesh engine, dexels."""

from __future__ import annotations

from collections.abc import Iterator
from time import process_time
from typing import Any

import numpy as np

from benchmarks.columns5_counts import BOX
from benchmarks.turned_blocks import KINDS, TOOLS, case_of
from vmachining.engines.columns.turning import Air, AnyDirection, Rows, rows_of
from vmachining.engines.columns.turning.stocks import solid_of
from vmachining.engines.dexel import DexelEngine
from vmachining.engines.mesh import MeshEngine
from vmachining.engines.protocol import Engine, Options

__all__ = ["columns5_widths"]

WARM = 1
"""Blocks before the first that counts, which compile."""

REQUESTS = (0.03, 0.01, 0.003)


def columns5_widths(blocks: int = 60, first: int = 0) -> Iterator[dict[str, Any]]:
    """Medians over random blocks in full stock, every engine after the other on each block: ms of processor, relative width."""
    found: dict[tuple[str, str], list[dict[str, float]]] = {}
    for seed in range(first - WARM, first + blocks):
        case = case_of(seed if seed >= first else first)
        earlier, air = [rows_of(sweep) for sweep in case.earlier], Air(solid_of(BOX))
        for number, each in enumerate(earlier):
            air.add(number, each)
        row: dict[str, float] = {}
        for width in REQUESTS:
            own, engine = rows_of(case.block), AnyDirection.of(BOX, Options(width=width))
            begin = process_time()
            left = air.left(own)
            near = [earlier[number] for number in air.around(left, case.block.bounds)[0]]
            said = engine.cut(own, Rows.join(near) if near else None, left=left)
            row[f"ms_{width:g}"], row[f"width_{width:g}"] = (
                1e3 * (process_time() - begin),
                _relative(said.width, said.hi),
            )
        others: dict[str, Engine] = {
            "mesh": MeshEngine.of(BOX, Options(chord=0.05)),
            "dexel": DexelEngine(BOX, Options(spacing=0.1)),
        }
        for name, other in others.items():
            for sweep in case.earlier:
                other.cut(sweep)
            begin = process_time()
            said = other.cut(case.block)
            row[f"ms_{name}"], row[f"width_{name}"] = (
                1e3 * (process_time() - begin),
                _relative(said.width, said.hi),
            )
        kind, tool = case.name.split()
        if seed >= first:  # the first one compiles
            found.setdefault((tool, kind), []).append(row)
    for tool in TOOLS:
        for kind in KINDS:
            rows = found.get((tool, kind), [])
            if rows:
                medians = {key: float(np.median([row[key] for row in rows])) for key in rows[0]}
                yield {
                    "case": "columns5-widths",
                    "tool": tool,
                    "family": kind,
                    "blocks": len(rows),
                    **medians,
                }


def _relative(width: float, of: float) -> float:
    return width / of if of > 0.0 else 0.0
