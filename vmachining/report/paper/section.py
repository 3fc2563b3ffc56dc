"""Ends of the engaged edge on a section of the workpiece, from the directory that `engage --section` wrote."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.errors import InputError
from vmachining.report.paper.style import BLUE, GREY, RED, WIDTH_MM, canvas, look, shades

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MATERIAL = "#d5dbe3"


def load_section(folder: Path) -> pl.DataFrame:
    """The table of `engage --section`. InputError: It was not written."""
    path = folder / "section.parquet"
    if not path.is_file():
        raise InputError("no section in this directory", file=folder, remedy="run engage --section 90 --out")
    return pl.read_parquet(path)


def draw_section(table: pl.DataFrame, *, width_mm: float = WIDTH_MM) -> Figure:
    """The workpiece along the pass and across the tool with LE and UE; angle of LE over the rotation angle by lead.

    table : see `vmachining.job.section.SECTION_COLUMNS`.
    """
    parts = {
        str(key[0]): rows.select("u", "v", "w").to_numpy()
        for key, rows in table.group_by("part", maintain_order=True)
    }
    asked, angle, lead = parts["angle"][0]
    leads = [part for part in ("lead_le", "lead_ue") if part in parts]
    with look():
        figure = canvas(width_mm, 0.72 * width_mm)
        rows: Any = figure.subfigures(2, 1, height_ratios=(0.9, 1.0))
        along = rows[0].subplots()
        _material(along, parts["along"])
        for end, colour in (("ue", RED), ("le", BLUE)):
            along.plot(*parts[f"along_{end}"][:, :2].T, "o", ms=2.6, color=colour, label=end.upper())
        off = np.abs(parts["along_ue"][:, 2])
        told = f"UE off the surface: median {np.median(off):.2g} mm, at most {off.max():.2g} mm"
        along.set(xlabel="way over the plan of the UE points (mm)", ylabel="z (mm)")
        along.set_title(f"section through UE at {asked:g}° from the feed; {told}")
        wide = float(parts["along"][:, 0].max())
        along.set_xlim(-0.02 * wide, 1.02 * wide)
        along.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
        across, *more = np.atleast_1d(rows[1].subplots(1, 1 + bool(leads)))
        _material(across, parts["across"])
        r, z, cuts = parts["edge"].T
        across.plot(r, z, color=GREY, label="edge")
        across.plot(np.where(cuts > 0.0, r, np.nan), z, color="black", lw=2.0, label="engaged")
        for end, colour in (("ue", RED), ("le", BLUE)):
            across.plot(*parts[f"across_{end}"][:, :2].T, "o", ms=4, color=colour, zorder=4)
        across.set(
            xlabel="from the tool axis (mm)", ylabel="along the axis (mm)", aspect="equal",
            title=f"through the axis at {angle:.4g}°, lead {lead:.3g}°",
        )  # fmt: skip
        across.legend(loc="upper left", framealpha=0.9, edgecolor="none")
        if leads:
            _leads(more[0], parts)
    return figure


def _material(axes: Any, grid: Floats) -> None:
    """Where the distance is below 0."""
    u, v = (np.unique(grid[:, k]) for k in (0, 1))
    order = np.lexsort((grid[:, 0], grid[:, 1]))
    w = grid[order, 2].reshape(len(v), len(u))
    axes.contourf(u, v, w, levels=[-np.inf, 0.0], colors=[MATERIAL])
    axes.contour(u, v, w, levels=[0.0], colors=[GREY], linewidths=0.8)
    axes.grid(visible=False)


def _leads(axes: Any, parts: dict[str, Floats]) -> None:
    """Angle of LE in front of the tool, and behind it that of the end, by lead; lines are the closed form."""
    found = np.concatenate([parts[part] for part in ("lead_le", "lead_ue") if part in parts])
    leads = np.unique(found[:, 2])
    form = parts["lead_form"]
    for lead, colour in zip(leads, shades(len(leads)), strict=True):
        mine, line = (rows[rows[:, 2] == lead] for rows in (found, form))
        axes.plot(mine[:, 0], mine[:, 1], "o", ms=1.6, color=colour)
        axes.plot(*line[:, :2].T, color=colour, lw=0.8, label=f"{lead:.3g}°")
    top = 90.0 if not len(found) else max(5.0, 1.15 * float(found[:, 1].max()))
    axes.set(
        xlabel="angle from the feed (°)", ylabel="angle of LE from the bottom (°)", xlim=(0, 360), xticks=range(0, 361, 90),
        ylim=(-0.02 * top, min(92.0, top)), title="angle of LE by lead; above 180° of the end behind",
    )  # fmt: skip
    axes.legend(title="lead", fontsize=6.5, loc="center left", bbox_to_anchor=(1.0, 0.5))
