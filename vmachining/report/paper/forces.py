"""Measured forces over the predicted ones, and coefficients over the height with what the fit leaves of every test."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.errors import InputError
from vmachining.force import NAMES, Identification, LayerFit, SlotTests, smoothed
from vmachining.report.numbers import floats
from vmachining.report.paper.style import BLUE, GREEN, GREY, RED, WIDTH_MM, canvas, look, panels, shades

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TRACE_FILE = "forces_measured.csv"
FORCES = tuple((f"f{k}_n", f"f{k}_measured_n", f"$F_{k}$ (N)") for k in "xyz")


def load_trace(folder: Path) -> pl.DataFrame:
    """What `force predict --measured` wrote. InputError where it did not."""
    path = folder / TRACE_FILE
    if not path.is_file():
        raise InputError(
            "no measured forces in this directory", file=folder, remedy="run force predict --measured"
        )
    return pl.read_csv(path, infer_schema_length=None).sort("trace_s")


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
        for k, colour in enumerate((BLUE, GREEN, RED)):
            grid[3].plot(
                time, 100.0 * off[k] / (most or np.nan), color=colour, lw=0.7, label=f"$F_{'xyz'[k]}$"
            )
        grid[3].set(
            ylabel="predicted less\nmeasured (%)",
            xlabel="time of the trace (s)",
            xlim=(time.min(), time.max()),
        )
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
                    axes.plot(
                        tests.depth[mine],
                        fit.residual[mine, k],
                        mark,
                        ms=3,
                        color=colour,
                        label=f"{feed:g} mm a tooth",
                    )
                axes.axhline(0.0, color=GREY, lw=0.6)
                axes.set(xlabel="depth of the slot (mm)", ylabel=f"residual of $F_{component}$ (N)")
            figure.legend(*grid[2, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4)
        figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return figure
