"""Contact, chips and forces on the page, and what all feed strategies would do."""

from __future__ import annotations

from typing import Any

import polars as pl

from vmachining.report.numbers import duration, number, plural
from vmachining.report.payload import LOADS, load_column

MOST_MM3_MIN = 2e7
"""Removal rates beyond it are questioned: large machines for aluminium reach about half of it."""

MOST = 10
"""Blocks in the table of the most loaded ones."""


def peaks(blocks: pl.DataFrame) -> list[tuple[Any, ...]]:
    """Largest value of every load: name, value with unit, block, line, s into the program, program text."""
    begin = blocks["time_s"].fill_null(0.0).cum_sum() - blocks["time_s"].fill_null(0.0)
    rows = []
    for name, label, unit in LOADS:
        if name.endswith("feed_mm_min") or name == "engaged_fraction" or not blocks[name].count():
            continue
        at = int(blocks[name].fill_null(-1.0).arg_max() or 0)
        row = blocks.row(at, named=True)
        value, second = f"{number(row[name], 5)} {unit}", "{} {}".format(*duration(float(begin[at])))
        rows.append((label, value, row["block"], row["line"], second, row["text"].strip()))
    return rows


def doubtful(blocks: pl.DataFrame) -> str:
    """A question where a block removes more than machines do; empty where none does."""
    odd = blocks.filter(pl.col("mrr_mm3_min") > MOST_MM3_MIN).sort("mrr_mm3_min", descending=True)
    if not len(odd):
        return ""
    block, line, rate = odd.select("block", "line", "mrr_mm3_min").row(0)
    return (
        f"{plural(len(odd), 'block')} would remove more than {number(MOST_MM3_MIN)} mm³/min, which no milling machine does: "
        f"block {block} (line {line}) {number(rate, 3)} mm³/min. Check the feed and its unit."
    )


def loaded(blocks: pl.DataFrame) -> list[tuple[Any, ...]]:
    """The blocks with the largest load: block, line, program text, load, removal rate (once), ap, ae."""
    name, _, _ = load_column(blocks)
    top = blocks.filter(pl.col(name) > 0).top_k(MOST, by=name).sort([name, "block"], descending=[True, False])
    loads = dict.fromkeys((name, "mrr_mm3_min", "ap_mm", "ae_mm"))
    return [
        (row["block"], row["line"], row["text"].strip(), *(number(row[load], 4) for load in loads))
        for row in top.iter_rows(named=True)
    ]


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
