"""Where the workpiece is off the design: vectors on their feet, and how many there are of each size."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from vmachining.errors import InputError
from vmachining.report.paper.style import BLUE, GREEN, GREY, ORANGE, VIOLET, WIDTH_MM, canvas, look

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BINS = 60
DRAWN = 0.08
"""Length of the largest vector as a share of the picture."""

MOST = 4000
"""Vectors that are drawn, those that deviate most."""


def load_deviation(folder: Path) -> pl.DataFrame:
    """The table of a run with a `[design]`. InputError: it has none, or nothing is outside of the tolerance."""
    path = folder / "deviation.parquet"
    rows = pl.read_parquet(path) if path.is_file() else None
    if rows is None:
        raise InputError(
            "no deviation was measured",
            file=folder,
            remedy="run --engine vectors or dexel with a [design]",
        )
    rows = rows.drop_nulls("deviation_mm")
    if not len(rows):
        raise InputError("nothing is outside of the tolerance", file=folder, remedy="lower tolerance_mm")
    return rows


def draw_deviation(rows: pl.DataFrame, *, width_mm: float = WIDTH_MM) -> Figure:
    """Plan and side view of the places outside of the tolerance, their vectors enlarged, and a histogram by kind of vector."""
    rows = rows.sort(pl.col("deviation_mm").abs(), descending=True)
    value = rows["deviation_mm"].to_numpy()
    reach = float(np.abs(value).max()) or 1.0
    top = rows.head(MOST)
    point, normal = top.select("x_mm", "y_mm", "z_mm").to_numpy(), top.select("nx", "ny", "nz").to_numpy()
    off = top["deviation_mm"].to_numpy()
    size = float(np.ptp(point, axis=0).max()) or 1.0
    times = float(f"{DRAWN * size / reach:.1g}") or 1.0
    tip = point + times * off[:, None] * normal
    with look():
        figure = canvas(width_mm, 0.78 * width_mm)
        halves: Any = figure.subfigures(2, 1, height_ratios=(1.45, 1.0))
        upper, lower = halves
        views = upper.subplots(1, 2)
        order = np.argsort(np.abs(off))
        for axes, (i, j) in zip(views, ((0, 1), (0, 2)), strict=True):
            lines = np.full((3 * len(point), 2), np.nan)
            lines[0::3], lines[1::3] = point[:, (i, j)], tip[:, (i, j)]
            axes.plot(*lines.T, color=GREY, lw=0.4)
            dots = axes.scatter(*point[order][:, (i, j)].T, c=off[order], cmap="PuOr", vmin=-reach, vmax=reach, s=4,
                                ec="black", lw=0.1, zorder=3)  # fmt: skip
            axes.set(xlabel=f"{'xyz'[i]} (mm)", ylabel=f"{'xyz'[j]} (mm)")
            axes.set_aspect("equal", adjustable="datalim")
        upper.colorbar(dots, ax=list(views), label="deviation (mm), below 0: overcut", pad=0.02)
        upper.suptitle(f"{len(rows)} places outside of the tolerance, vectors {times:g} times", fontsize=8.0)
        axes = lower.subplots()
        kinds = rows["kind"].unique(maintain_order=True).sort().to_list()
        parts = [rows.filter(pl.col("kind") == kind)["deviation_mm"].to_numpy() for kind in kinds]
        axes.hist(
            parts, bins=np.linspace(-reach, reach, BINS + 1).tolist(), stacked=True, label=kinds,
            color=(BLUE, ORANGE, GREEN, VIOLET, GREY)[: len(kinds)],
        )  # fmt: skip
        axes.set(xlabel="deviation (mm)", ylabel="number of places", xlim=(-reach, reach))
        lower.legend(loc="outside right upper", title="vectors")
    return figure
