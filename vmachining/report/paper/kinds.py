"""The kinds of figures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.errors import InputError
from vmachining.report.numbers import floats
from vmachining.report.paper.body import SEEN_PX, nearest_faces, viewed
from vmachining.report.paper.source import Results, stored
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
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vmachining.job import RunResult

OVER = ("time", "block")
Shown = Sequence[tuple[str, Sequence[tuple[str, str, str]]]]
SHORT_SCALE = 30.0
"""A logarithmic axis that spans less names the steps between its decades."""


class Axis(NamedTuple):
    """What is drawn over. edges : (n + 1,) where steps begin and end. rows : the table. name : as programmed or scheduled."""

    edges: Floats
    rows: pl.DataFrame
    name: str
    colour: str


def _axes_of(results: Results, over: str) -> list[Axis]:
    """As programmed, and scheduled where it can be drawn over the same axis."""
    tables = [("as programmed", GREY, results.blocks)]
    after = results.scheduled
    if after is not None and (over == "time" or len(after) == len(results.blocks)):
        tables.append(("scheduled", GREEN, after))
    found = []
    for name, colour, rows in tables:
        if over == "time":
            edges = np.concatenate([[0.0], np.cumsum(rows["time_s"].fill_null(0.0).to_numpy())])
        else:
            edges = np.append(rows["block"].to_numpy(), len(rows)) - 0.5
        found.append(Axis(edges, rows, name, colour))
    if len(found) == 1:
        found[0] = found[0]._replace(colour=BLUE)
    return found


def _stairs(axes: Axes, axis: Axis, values: Floats, **line: object) -> None:
    axes.stairs(values, axis.edges, baseline=None, **line)  # type: ignore[arg-type]


def _finish(figure: Figure, grid: Sequence[Axes], over: str, edges: Floats) -> Figure:
    grid[-1].set_xlabel("machining time (s)" if over == "time" else "block")
    grid[-1].set_xlim(float(edges[0]), float(edges[-1]) if edges[-1] > edges[0] else float(edges[0]) + 1.0)
    figure.align_ylabels(list(grid))
    return figure


LOADS = (
    ("mrr_mm3_min", "volume rate\n(mm³/min)"), ("chip_area_mm2", "chip area\n(mm²)"),
    ("force_n", "peak force\n(N)"), ("power_w", "mean power\n(W)"),
)  # fmt: skip


def load(results: Results, over: str, width_mm: float) -> Figure:
    """Loads over the program, as programmed and scheduled."""
    shown = [row for row in LOADS if results.blocks[row[0]].count()]
    return _programmed(results, over, width_mm, shown, 28.0)


def feed(results: Results, over: str, width_mm: float) -> Figure:
    """Feed over the program, as programmed and scheduled."""
    return _programmed(results, over, width_mm, [("feed_mm_min", "feed (mm/min)")], 48.0)


def _programmed(
    results: Results, over: str, width_mm: float, shown: Sequence[tuple[str, str]], each_mm: float
) -> Figure:
    """A panel for each column, as programmed and scheduled. shown : columns and their titles."""
    tables = _axes_of(results, over)
    figure, grid = panels(len(shown), width_mm=width_mm, each_mm=each_mm)
    for axes, (name, label) in zip(grid, shown, strict=True):
        for axis in tables:
            _stairs(axes, axis, floats(axis.rows, name), color=axis.colour, label=axis.name)
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0.0)
    _legend(figure, grid[0], len(tables))
    return _finish(figure, grid, over, max((t.edges for t in tables), key=lambda e: e[-1]))


def bracket(results: Results, over: str, width_mm: float) -> Figure:
    """Removed volume per block with its bounds, other judges next to it, and how far the bounds are apart."""
    axis = _axes_of(results, over)[0]
    rows = axis.rows
    value, low, high = (floats(rows, f"removed_{k}mm3") for k in ("", "lo_", "hi_"))
    cut = value > 0
    figure, (top, below) = panels(2, width_mm=width_mm, each_mm=38.0, heights=(1.3, 1.0))
    top.stairs(
        high, axis.edges, baseline=low, fill=True, color=BLUE, alpha=0.3, lw=0, label="lower to upper bound"
    )
    _stairs(top, axis, value, color=BLUE, label="estimate")
    middle = 0.5 * (axis.edges[:-1] + axis.edges[1:])
    for name, label, mark, colour in (
        ("removed_brep_mm3", "B-rep", "x", RED), ("removed_dexel_mm3", "exact rays", "+", VIOLET),
    ):  # fmt: skip
        other = floats(rows, name)
        if np.isfinite(other).any():
            top.plot(middle, other, mark, color=colour, ms=4, label=label)
    top.set_ylabel("removed volume\nof a block (mm³)")
    top.set_ylim(bottom=0.0)
    figure.legend(*top.get_legend_handles_labels(), loc="outside upper right", ncols=4)
    with np.errstate(divide="ignore", invalid="ignore"):
        width = np.where(cut & (high > low), 100.0 * (high - low) / value, np.nan)
    _stairs(below, axis, width, color=BLUE)
    below.set_ylabel("distance of the\nbounds (%)")
    if np.isfinite(width).any():
        below.set_yscale("log")
        from matplotlib.ticker import LogLocator

        short = np.nanmax(width) < SHORT_SCALE * np.nanmin(width)
        below.yaxis.set_minor_locator(LogLocator(subs=(2.0, 5.0)))
        below.yaxis.set_major_formatter(lambda v, _: f"{v:g}")
        below.yaxis.set_minor_formatter(lambda v, _: f"{v:g}" if short else "")
    else:
        below.text(0.5, 0.5, "the bounds coincide", transform=below.transAxes, ha="center", color=GREY)
    return _finish(figure, (top, below), over, axis.edges)


def logged(results: Results, over: str, width_mm: float) -> Figure:
    """A log joined with the run: feed as programmed, reachable and logged, removal rate, power, and the load of the spindle."""
    remedy = "`vmachining times join LOG --results DIR`"
    rows = stored(results.folder, "logged.parquet", "no log was joined", remedy)
    logs = rows["log"].unique(maintain_order=True).to_list()
    rows = rows.filter(pl.col("log") == logs[0])
    spent = rows["logged_s"].to_numpy().clip(min=0.0)
    edges = np.arange(len(rows) + 1.0) if over == "block" else np.concatenate([[0.0], np.cumsum(spent)])
    axis = Axis(edges, rows, "logged", RED)
    others = (
        ("mrr_mm3_min", "removal rate\n(mm³/min)"), ("power_w", "power (W)"), ("load", "spindle load\n(of the log)"),
    )  # fmt: skip
    shown: Shown = [
        ("feed (mm/min)", [("programmed_mm_min", "programmed", GREY), ("reachable_mm_min", "reachable", BLUE),
                           ("logged_mm_min", "logged", RED)]),
        *((label, [(name, "", ORANGE)]) for name, label in others if np.isfinite(floats(rows, name)).any()),
    ]  # fmt: skip
    figure, grid = panels(len(shown), width_mm=width_mm, each_mm=32.0)
    _curves(axis, grid, shown)
    if len(logs) > 1:
        grid[0].set_title(f"{logs[0]}, the first of {len(logs)} logs")
    _legend(figure, grid[0], 3)
    return _finish(figure, grid, over, edges)


def engagement(results: Results, over: str, width_mm: float) -> Figure:
    """Depths of cut, engaged share of a revolution and chip thickness over the program."""
    rows = (
        ("depth of cut\n(mm)", (("ae_mm", "radial $a_e$", ORANGE), ("ap_mm", "axial $a_p$", BLUE))),
        ("engaged share of\na revolution (–)", (("engaged_fraction", "", BLUE),)),
        ("chip thickness\n(mm)", (("chip_thickness_mm", "", BLUE),)),
    )
    shown = [row for row in rows if any(results.blocks[name].count() for name, _, _ in row[1])]
    if not shown:
        raise InputError("the table has no contact columns", file=results.folder, remedy="run the job again")
    axis = _axes_of(results, over)[0]
    figure, grid = panels(len(shown), width_mm=width_mm, each_mm=31.0)
    _curves(axis, grid, shown)
    _legend(figure, grid[0], len(shown[0][1]))
    return _finish(figure, grid, over, axis.edges)


def _curves(axis: Axis, grid: Sequence[Axes], shown: Shown) -> None:
    """Curves of the panels. shown : of each its title, and columns with their words and colours."""
    for axes, (label, curves) in zip(grid, shown, strict=True):
        for name, words, colour in curves:
            _stairs(axes, axis, floats(axis.rows, name), color=colour, label=words or None)
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0.0)


def _legend(figure: Figure, axes: Axes, lines: int) -> None:
    if lines > 1:
        handles, labels = axes.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=lines)


def stock(results: Results, over: str, width_mm: float) -> Figure:
    """The finished stock: height over the plan, and a view of it."""
    points, triangles = results.stock()
    if not len(triangles):
        raise InputError("nothing is left of the stock", remedy="draw another kind")
    low, high = points.min(axis=0), points.max(axis=0)
    extent = high - low
    pixel = float(extent[:2].max()) / SEEN_PX
    shape = tuple(int(v) for v in np.maximum(np.ceil(extent[1::-1] / pixel), 1))
    depth, _ = nearest_faces(points, triangles, low[:2], pixel, shape)  # type: ignore[arg-type]
    seen = np.where(np.isfinite(depth), depth, np.nan)
    tall = 0.5 * width_mm * min(max(float(extent[1] / extent[0]), 0.35), 1.1) + 16.0
    figure = canvas(width_mm, tall)
    plan, view = figure.subplots(1, 2, width_ratios=(1.12, 1.0))
    image = plan.imshow(
        seen, origin="lower", extent=(low[0], low[0] + shape[1] * pixel, low[1], low[1] + shape[0] * pixel), cmap="viridis",
        interpolation="nearest",
    )  # fmt: skip
    plan.set(xlabel="x (mm)", ylabel="y (mm)", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    plan.grid(visible=False)
    figure.colorbar(image, ax=plan, label="z (mm)", shrink=0.85, pad=0.02)
    picture, box = viewed(points, triangles)
    view.imshow(picture, origin="lower", extent=box, interpolation="antialiased")
    view.set_axis_off()
    return figure


def schedule(results: Results, over: str, width_mm: float) -> Figure:
    """All strategies on the same job: time, peak of every load against that as programmed, and spread."""
    table = results.strategies
    if table is None or len(table) < 2:
        raise InputError(
            "no comparison of strategies", file=results.folder, remedy="run a job with a [feed] table"
        )
    names = [
        name.replace("_", " ") + " (written)" * bool(asked)
        for name, asked in table.select("strategy", "asked_for").iter_rows()
    ]
    figure = canvas(width_mm, 62.0)
    time, peak, spread = figure.subplots(1, 3, width_ratios=(1.0, 1.25, 1.25))
    colours = [GREY, BLUE, GREEN, ORANGE][: len(names)]
    place = np.arange(len(names))
    bars = time.bar(place, floats(table, "time_s"), color=colours, width=0.7)
    time.bar_label(bars, fmt="%.1f", fontsize=7, padding=1)
    time.set(ylabel="time at feed (s)", xticks=[])
    units = dict(zip(table["strategy"].to_list(), table["unit"].to_list(), strict=True))
    force = UNIT_LOADS.get(units.get("force") or "N", "force")
    labels = (("volume", "volume\nrate"), ("chip_area", "chip\narea"), ("force", force))
    loads = [row for row in labels if table[f"{row[0]}_peak"].null_count() < len(table)]
    at = np.arange(len(loads))
    wide = 0.8 / len(names)
    for k, (name, colour) in enumerate(zip(names, colours, strict=True)):
        shift = (k - 0.5 * (len(names) - 1)) * wide
        tops = [floats(table, f"{key}_peak") for key, _ in loads]
        peak.bar(at + shift, [top[k] / top[0] if top[0] > 0 else np.nan for top in tops], wide, color=colour)
        spreads = [floats(table, f"{key}_spread")[k] for key, _ in loads]
        spread.bar(at + shift, spreads, wide, color=colour, label=name)
    peak.axhline(1.0, color="#111827", lw=0.6, zorder=0)
    peak.set(ylabel="peak / peak as programmed (–)", xticks=at)
    spread.set(ylabel="standard deviation / mean (–)", xticks=at)
    for axes in (peak, spread):
        axes.set_xticklabels([label for _, label in loads])
    for axes in (time, peak, spread):
        axes.grid(visible=False, axis="x")
    figure.legend(*spread.get_legend_handles_labels(), loc="outside lower center", ncols=len(names))
    return figure


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
            "no schedule to compare with", file=results.folder, remedy="run a job with a [feed] table"
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
        for k, (line, words) in enumerate(rows.select("line", "text").iter_rows()):
            said = " ".join(str(words).split())
            said = said if len(said) <= WORDS else f"{said[: WORDS - 1]}…"
            text.text(0.0, k, f"{line:>6}  {said}", va="center", family="DejaVu Sans Mono", fontsize=5.0)
        text.set(ylim=(count - 0.4, -0.6), xlim=(0.0, 1.0))
        text.set_axis_off()
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


UNIT_LOADS = {
    "mm³/min": "volume rate", "mm²": "chip area", "N mm": "torque", "W": "power", "mm": "deflection",
}  # fmt: skip
"""Loads by their unit; force where it is another one."""


def draw_references(results: Results, over: str, width_mm: float = WIDTH_MM) -> Figure:
    """Feed and load of every reference over blocks or over its own time; below, time at feed and time saved over the reference.

    Raises InputError: The job names no references.
    """
    lacks, remedy = "no schedules by other references", "name `references` under [feed] and run the job"
    table = stored(results.folder, "references.csv", lacks, remedy).with_columns(
        pl.col("reference").cast(pl.Float64)
    )
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
                values = floats(rows, column)
                axes.stairs(values, edges, baseline=None, color=colour, label=name)
        feed.set_ylabel("feed (mm/min)")
        across = "time at feed (s)" if over == "time" else "block"
        load.set(ylabel=f"{UNIT_LOADS.get(unit, 'force')}\n({unit})", xlabel=across)
        after = [rows for rows in runs if rows["reference"][0] is not None]
        goals = np.array([rows["reference"][0] for rows in after])
        seconds = np.array([rows["time_s"].sum() for rows in after])
        order = np.argsort(goals, kind="stable")
        spent.plot(goals[order], seconds[order], "o-", ms=3, color=colours[1], label="time at feed")
        spent.axhline(before, color=GREY, lw=0.8, ls=":")
        spent.set(xlabel=f"reference ({unit})", ylabel="time at feed (s)")
        saved = spent.twinx()
        gain = 100.0 * (1.0 - seconds[order] / before)
        saved.plot(goals[order], gain, "s--", ms=3, color=colours[-1], label="time saved")
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


KINDS: dict[str, Callable[[Results, str, float], Figure]] = {
    "load": load, "bracket": bracket, "feed": feed, "engagement": engagement, "stock": stock, "schedule": schedule,
    "program": program, "logged": logged, "references": draw_references,
}  # fmt: skip


def draw(results: Results, kind: str, *, over: str | None = None, width_mm: float = WIDTH_MM) -> Figure:
    """One figure.

    kind : of `KINDS`. over : "time" or "block", what runs along the x axis; None: block for `bracket` and `references`, else time
        where the program has any. width_mm : of the figure.
    Raises InputError: The directory lacks what the kind shows, or matplotlib is not installed.
    """
    if over is None:
        timed = kind not in ("bracket", "references") and (results.blocks["time_s"].sum() or 0.0) > 0.0
        over = "time" if timed else "block"
    with look():
        return KINDS[kind](results, over, width_mm)


def draw_result(result: RunResult, kind: str, *, over: str | None = None) -> Figure:
    """`draw` for a run in memory."""
    kinds = [name for name in KINDS if name not in ("schedule", "logged", "program", "references")]
    if kind not in kinds or over not in (None, *OVER):
        wrong = f"kind {kind!r}" if kind not in kinds else f"over {over!r}"
        raise InputError(
            f"no figure has {wrong}", remedy=f"kind: {', '.join(kinds)}; over: {' or '.join(OVER)}"
        )
    return draw(Results.of(result), kind, over=over)
