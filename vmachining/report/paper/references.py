"""Feed and load of one program by several references, and the time that each saves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import polars as pl

from vmachining.errors import InputError
from vmachining.report.paper.source import Results
from vmachining.report.paper.style import GREY, WIDTH_MM, canvas, look, shades

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WORDS = {"mm³/min": "volume rate", "mm²": "chip area", "N mm": "torque", "W": "power", "mm": "deflection"}
"""Loads by their unit; force where it is another one."""


def draw_references(results: Results, over: str, width_mm: float = WIDTH_MM) -> Figure:
    """Feed and load of every reference over blocks or over its own time; below, time at feed and time saved over the reference.

    Raises InputError: The job names no references.
    """
    file = results.folder / "references.csv"
    if not file.is_file():
        raise InputError(
            "no schedules by other references", file=str(results.folder),
            remedy="name `references` under [feed] and run the job",
        )  # fmt: skip
    table = pl.read_csv(file, schema_overrides={"reference": pl.Float64}, infer_schema_length=None)
    unit = str(table["unit"][0])
    runs = table.partition_by("reference", "written", maintain_order=True)
    before = float(runs[0]["time_s"].sum())
    with look():
        figure = canvas(width_mm, 132.0)
        feed, load, spent = figure.subplots(3, 1, height_ratios=(1.2, 1.2, 1.0))
        feed.sharex(load)
        colours = [GREY, *shades(len(runs) - 1)]
        for rows, colour in zip(runs, colours, strict=True):
            goal = rows["reference"][0]
            name = "as programmed" if goal is None else f"{goal:.4g}{' (written)' * rows['written'][0]}"
            if over == "time":
                edges = np.concatenate([[0.0], np.cumsum(rows["time_s"].fill_null(0.0).to_numpy())])
            else:
                ends = (rows["block"] + rows["end"]).to_numpy()
                edges = np.concatenate([[float(rows["block"][0])], ends]) - 0.5
            for axes, column in ((feed, "feed_mm_min"), (load, "load")):
                values = rows[column].cast(pl.Float64).fill_null(float("nan")).to_numpy()
                axes.stairs(values, edges, baseline=None, color=colour, label=name)
        feed.set_ylabel("feed (mm/min)")
        load.set(
            ylabel=f"{WORDS.get(unit, 'force')}\n({unit})",
            xlabel="time at feed (s)" if over == "time" else "block",
        )
        after = [rows for rows in runs if rows["reference"][0] is not None]
        goals = np.array([rows["reference"][0] for rows in after])
        seconds = np.array([rows["time_s"].sum() for rows in after])
        order = np.argsort(goals, kind="stable")
        spent.plot(goals[order], seconds[order], "o-", ms=3, color=colours[1], label="time at feed")
        spent.axhline(before, color=GREY, lw=0.8, ls=":")
        spent.set(xlabel=f"reference ({unit})", ylabel="time at feed (s)")
        saved = spent.twinx()
        saved.plot(
            goals[order],
            100.0 * (1.0 - seconds[order] / before),
            "s--",
            ms=3,
            color=colours[-1],
            label="time saved",
        )
        saved.set_ylabel("time saved (%)")
        saved.spines["right"].set_visible(True)
        saved.grid(visible=False)
        both = [h for axes in (spent, saved) for h in axes.get_legend_handles_labels()[0]]
        spent.legend(both, [str(h.get_label()) for h in both], loc="center right")
        for axes in (feed, load, spent):
            axes.set_ylim(bottom=0.0)
        figure.legend(
            *feed.get_legend_handles_labels(), loc="outside upper right", ncols=6, title=f"reference ({unit})"
        )
        return figure
