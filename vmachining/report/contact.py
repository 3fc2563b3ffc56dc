"""Contact, chips and forces on the page, and what all feed strategies would do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import polars as pl

from vmachining.report.numbers import number

__all__ = ["compared", "contact_facts"]

LARGEST = {
    "ap_mm": ("axial depth", "mm"), "ae_mm": ("radial depth", "mm"), "chip_area_mm2": ("chip area of a tooth", "mm²"),
    "chip_thickness_mm": ("chip thickness", "mm"), "force_n": ("force", "N"), "power_w": ("power at the cutter", "W"),
}  # fmt: skip


def contact_facts(blocks: pl.DataFrame, notes: Sequence[str], *, drawn: bool) -> dict[str, Any] | None:
    """The block with the largest value of every column of the contact; None if there is nothing to say."""
    rows = []
    for name, (label, unit) in LARGEST.items():
        if not blocks[name].count():
            continue
        row = blocks.row(int(blocks[name].fill_null(-1.0).arg_max() or 0), named=True)
        rows.append((label, f"{number(row[name], 5)} {unit}", row["block"], row["line"], row["text"].strip()))
    return {"plots": drawn, "rows": rows, "notes": list(notes)} if rows or notes else None


def compared(comparison: pl.DataFrame) -> list[tuple[str, ...]]:
    """Cells of the comparison of all strategies."""

    def cell(value: float | None, digits: int = 5) -> str:
        return "–" if value is None else number(value, digits)

    rows = []
    for row in comparison.iter_rows(named=True):
        goal = "–" if row["reference"] is None else f"{number(row['reference'], 5)} {row['unit']}"
        loads = []
        for name in ("volume", "chip_area", "force"):
            loads += [cell(row[f"{name}_peak"]), cell(row[f"{name}_spread"], 3)]
        title = row["strategy"].replace("_", " ") + (" (asked for)" if row["asked_for"] else "")
        times = (cell(row["time_s"]), cell(row["machine_time_s"]))
        rows.append((title, goal, row["judged"], *times, str(row["inserted"]), *loads))
    return rows
