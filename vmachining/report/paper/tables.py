"""Figures of tables that other commands than a plain run leave: ends of the engaged edge on a section of the workpiece, places
off the design, measured forces over the predicted ones; coefficients over the height, with what the fit leaves of each test."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.errors import InputError
from vmachining.force import NAMES, Identification, LayerFit, SlotTests, smoothed
from vmachining.report.numbers import floats
from vmachining.report.paper.source import stored
from vmachining.report.paper.style import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    VIOLET,
    WIDTH_MM,
    canvas,
    look,
    panels,
    shades,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MATERIAL = "#d5dbe3"

BINS = 60
DRAWN = 0.08
"""Length of the largest vector as a share of the picture."""

MOST = 4000
"""Vectors that are drawn, those that deviate most."""

FORCES = tuple((f"f{k}_n", f"f{k}_measured_n", f"$F_{k}$ (N)") for k in "xyz")


def load_section(folder: Path) -> pl.DataFrame:
    """The table of `engage --section`. InputError: It was not written."""
    return stored(folder, "section.parquet", "no section in this directory", "run engage --section 90 --out")


def load_deviation(folder: Path) -> pl.DataFrame:
    """The table of a run with a `[design]`. InputError: it has none, or nothing is outside of the tolerance."""
    remedy = "run --engine vectors or dexel with a [design]"
    rows = stored(folder, "deviation.parquet", "no deviation was measured", remedy).drop_nulls("deviation_mm")
    if not len(rows):
        raise InputError("nothing is outside of the tolerance", file=folder, remedy="lower tolerance_mm")
    return rows


def load_trace(folder: Path) -> pl.DataFrame:
    """What `force predict --measured` wrote. InputError where it did not."""
    lacks, remedy = "no measured forces in this directory", "run force predict --measured"
    return stored(folder, "forces_measured.csv", lacks, remedy).sort("trace_s")


def draw_section(table: pl.DataFrame, *, width_mm: float = WIDTH_MM) -> Figure:
    """The workpiece along the pass and across the tool with LE and UE; angle of LE over the rotation angle by lead.

    table : see `vmachining.job.section.SECTION_COLUMNS`.
    """
    grouped = table.partition_by("part", as_dict=True, include_key=False)
    parts = {str(key[0]): rows.select("u", "v", "w").to_numpy() for key, rows in grouped.items()}
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


def deviations(trace: pl.DataFrame) -> Floats:
    """(3, n) N, predicted less measured; NaN where either is missing."""
    return np.stack([floats(trace, predicted) - floats(trace, measured) for predicted, measured, _ in FORCES])


def draw_trace(trace: pl.DataFrame, *, width_mm: float = WIDTH_MM) -> Figure:
    """Forces of a trace over the predicted ones, and their deviation below in percent of the largest measured force."""
    time = trace["trace_s"].to_numpy()
    off = deviations(trace)
    measured = np.stack([floats(trace, name) for _, name, _ in FORCES])
    with np.errstate(invalid="ignore"):
        size = np.sqrt((measured**2).sum(axis=0))
    most = float(np.nanmax(size)) if np.isfinite(size).any() else 0.0
    with look():
        figure, grid = panels(4, width_mm=width_mm, each_mm=30.0)
        for k, (predicted, _, label) in enumerate(FORCES):
            rms = float(np.sqrt(np.nanmean(off[k] ** 2))) if np.isfinite(off[k]).any() else float("nan")
            grid[k].plot(time, measured[k], color=RED, lw=0.8, label="measured")
            grid[k].plot(time, trace[predicted].to_numpy(), "--", color=BLUE, lw=1.0, label="predicted")
            grid[k].set_ylabel(label)
            grid[k].set_title(f"root mean square of the deviation {rms:.3g} N", loc="right", fontsize=7)
        for values, letter, colour in zip(off, "xyz", (BLUE, GREEN, RED), strict=True):
            grid[3].plot(time, 100.0 * values / (most or np.nan), color=colour, lw=0.7, label=f"$F_{letter}$")
        grid[3].set_ylabel("predicted less\nmeasured (%)")
        grid[3].set(xlabel="time of the trace (s)", xlim=(time.min(), time.max()))
        grid[3].legend(ncols=3, loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2)
        figure.legend(*grid[0].get_legend_handles_labels(), loc="outside upper left", ncols=2)
        figure.align_ylabels(grid)
    return figure


def draw_coefficients(
    fit: Identification | LayerFit, tests: SlotTests, *, degree: int = 3, width_mm: float = WIDTH_MM
) -> Figure:
    """Six coefficients over the height; the joint fit with its intervals and the residual of every test, layers as steps."""
    joint = isinstance(fit, Identification)
    found = fit.coefficients if isinstance(fit, Identification) else smoothed(fit, degree=degree)
    z = np.linspace(*found.height_mm, 200)
    values = found.at(z)
    with look():
        figure = canvas(width_mm, (0.95 if joint else 0.68) * width_mm)
        grid = figure.subplots(3 if joint else 2, 3)
        for k, name in enumerate(NAMES):
            axes = grid[k // 3, k % 3]
            unit = "N/mm²" if name.endswith("c") else "N/mm"
            axes.plot(z, values[k], color=BLUE, label="polynomial")
            if isinstance(fit, Identification):
                half = fit.half_width(z)[k]
                axes.fill_between(z, values[k] - half, values[k] + half, color=BLUE, alpha=0.2, lw=0,
                                  label=f"interval, {100 * fit.confidence:g} %")  # fmt: skip
            else:
                axes.hlines(fit.values[:, k], fit.low, fit.high, color=GREY, label="layers")
            axes.set(xlabel="height above the tip (mm)", ylabel=f"${name[0]}_{{{name[1:]}}}$ ({unit})")
        if isinstance(fit, Identification):
            feeds = np.unique(tests.feed)
            for axes, component, k in zip(grid[2], "xyz", range(3), strict=True):
                for feed, mark, colour in zip(feeds, "osD^vPX" * 99, shades(len(feeds)), strict=False):
                    mine = tests.feed == feed
                    label = f"{feed:g} mm a tooth"
                    axes.plot(tests.depth[mine], fit.residual[mine, k], mark, ms=3, color=colour, label=label)
                axes.axhline(0.0, color=GREY, lw=0.6)
                axes.set(xlabel="depth of the slot (mm)", ylabel=f"residual of $F_{component}$ (N)")
            figure.legend(*grid[2, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return figure
