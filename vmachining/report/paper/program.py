"""The program before and after its feeds were planned, line by line, with the load beside each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.errors import InputError
from vmachining.report.paper.source import Results
from vmachining.report.paper.style import GREEN, GREY, canvas

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LOAD = (
    ("force_n", "peak force (N)"), ("chip_area_mm2", "chip area (mm²)"), ("mrr_mm3_min", "volume rate (mm³/min)"),
)  # fmt: skip
MOST = 40
"""Lines on a page."""

WORDS = 38
"""Letters of a line that have room."""


def lines_shown(blocks: pl.DataFrame, load: str, count: int = MOST) -> tuple[int, int]:
    """First and last line of the program, end not included: `count` blocks around the largest load."""
    rows = blocks.sort("block")
    at = int(rows[load].fill_null(-1.0).arg_max() or 0)
    low = max(0, min(at - count // 2, len(rows) - count))
    lines = rows["line"].to_list()[low : low + count]
    return min(lines), max(lines) + 1


def program(results: Results, over: str, width_mm: float) -> Figure:
    """Lines of the original and of the scheduled program side by side, around the largest load, with that load as bars."""
    after = results.scheduled
    if after is None:
        raise InputError(
            "no schedule to compare with", file=str(results.folder), remedy="run a job with a [feed] table"
        )
    load, label = next((row for row in LOAD if results.blocks[row[0]].count()), LOAD[-1])
    first, last = lines_shown(results.blocks, load)
    before = results.blocks.filter(pl.col("line").is_between(first, last, closed="left"))
    # the same stretch of the path: blocks that were divided end where the block of the original does
    ends = before.select("x_mm", "y_mm", "z_mm").to_numpy()
    mine = _between(after, ends[0], ends[-1], int(before["block"][0]))
    sides = (("as programmed", before, GREY), ("scheduled", mine.head(MOST), GREEN))
    most = max(float(rows[load].fill_null(0.0).max() or 0.0) for _, rows, _ in sides)  # type: ignore[arg-type]
    count = max(len(rows) for _, rows, _ in sides)
    figure = canvas(width_mm, 3.6 * count + 20.0)
    grid = figure.subplots(1, 4, width_ratios=(1.25, 1.0, 1.25, 1.0))
    for text, axes, (name, rows, colour) in zip(grid[::2], grid[1::2], sides, strict=True):
        _listing(text, rows, count)
        axes.barh(np.arange(len(rows)), rows[load].fill_null(0.0).to_numpy(), color=colour, height=0.75)
        axes.set(ylim=(count - 0.4, -0.6), xlim=(0.0, 1.05 * most or 1.0), yticks=[], xlabel=label)
        axes.grid(visible=False, axis="y")
        spent = float(rows["time_s"].fill_null(0.0).sum())
        text.set_title(f"{name}: {len(rows)} blocks, {spent:.4g} s", loc="left")
    return figure


def _between(rows: pl.DataFrame, start: Floats, end: Floats, block: int) -> pl.DataFrame:
    """Rows from the one that ends at a point to the first after it that ends at another."""
    points = rows.select("x_mm", "y_mm", "z_mm").to_numpy()
    begins = np.flatnonzero(np.abs(points - start).max(axis=1) < SAME_MM)
    first = int(begins[begins >= block][0]) if (begins >= block).any() else block
    stops = np.flatnonzero(np.abs(points - end).max(axis=1) < SAME_MM)
    last = int(stops[stops >= first][0]) if (stops >= first).any() else first + MOST
    return rows[first : last + 1]


SAME_MM = 1e-3
"""Programs are written with three decimals at least."""


def _listing(axes: Axes, rows: pl.DataFrame, count: int) -> None:
    """Numbers and text of the lines."""
    for k, (line, text) in enumerate(rows.select("line", "text").iter_rows()):
        words = " ".join(str(text).split())
        words = words if len(words) <= WORDS else f"{words[: WORDS - 1]}…"
        axes.text(0.0, k, f"{line:>6}  {words}", va="center", family="DejaVu Sans Mono", fontsize=5.0)
    axes.set(ylim=(count - 0.4, -0.6), xlim=(0.0, 1.0))
    axes.set_axis_off()
