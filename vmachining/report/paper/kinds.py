"""The kinds of figures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import polars as pl

from vmachining.arrays import Floats
from vmachining.errors import InputError
from vmachining.report.paper.depth import nearest_faces
from vmachining.report.paper.source import Results
from vmachining.report.paper.style import (
    BLUE,
    GREEN,
    GREY,
    MM_PER_INCH,
    ORANGE,
    RED,
    VIOLET,
    WIDTH_MM,
    look,
    panels,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["KINDS", "OVER", "draw"]

OVER = ("time", "block")
SHORT_SCALE = 30.0
"""A logarithmic axis that spans less names the steps between its decades."""

SEEN_PX = 700
"""Pixels along the longer side of a view of the stock."""


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


def _column(rows: pl.DataFrame, name: str) -> Floats:
    return np.asarray(rows[name].cast(pl.Float64).fill_null(float("nan")).to_numpy(), dtype=np.float64)


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
    tables = _axes_of(results, over)
    figure, grid = panels(len(shown), width_mm=width_mm, each_mm=28.0)
    for axes, (name, label) in zip(grid, shown, strict=True):
        for axis in tables:
            _stairs(axes, axis, _column(axis.rows, name), color=axis.colour, label=axis.name)
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0.0)
    _legend(figure, grid[0], len(tables))
    return _finish(figure, grid, over, max((t.edges for t in tables), key=lambda e: e[-1]))


def bracket(results: Results, over: str, width_mm: float) -> Figure:
    """Removed volume per block with its bounds, other judges beside it, and how far the bounds are apart."""
    axis = _axes_of(results, over)[0]
    rows = axis.rows
    value, low, high = (_column(rows, f"removed_{k}mm3") for k in ("", "lo_", "hi_"))
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
        other = _column(rows, name)
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


def feed(results: Results, over: str, width_mm: float) -> Figure:
    """Feed over the program, as programmed and scheduled."""
    tables = _axes_of(results, over)
    figure, grid = panels(1, width_mm=width_mm, each_mm=48.0)
    for axis in tables:
        _stairs(grid[0], axis, _column(axis.rows, "feed_mm_min"), color=axis.colour, label=axis.name)
    grid[0].set_ylabel("feed (mm/min)")
    grid[0].set_ylim(bottom=0.0)
    _legend(figure, grid[0], len(tables))
    return _finish(figure, grid, over, max((t.edges for t in tables), key=lambda e: e[-1]))


def engagement(results: Results, over: str, width_mm: float) -> Figure:
    """Depths of cut, engaged share of a revolution and chip thickness over the program."""
    rows = (
        ("depth of cut\n(mm)", (("ae_mm", "radial $a_e$", ORANGE), ("ap_mm", "axial $a_p$", BLUE))),
        ("engaged share of\na revolution (–)", (("engaged_fraction", "", BLUE),)),
        ("chip thickness\n(mm)", (("chip_thickness_mm", "", BLUE),)),
    )
    shown = [row for row in rows if any(results.blocks[name].count() for name, _, _ in row[1])]
    if not shown:
        raise InputError(
            "the table has no contact columns", file=str(results.folder), remedy="run the job again"
        )
    axis = _axes_of(results, over)[0]
    figure, grid = panels(len(shown), width_mm=width_mm, each_mm=31.0)
    for axes, (label, lines) in zip(grid, shown, strict=True):
        for name, told, colour in lines:
            _stairs(axes, axis, _column(axis.rows, name), color=colour, label=told or None)
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0.0)
    _legend(figure, grid[0], len(shown[0][1]))
    return _finish(figure, grid, over, axis.edges)


def _legend(figure: Figure, axes: Axes, lines: int) -> None:
    if lines > 1:
        handles, labels = axes.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside upper right", ncols=lines)


LIGHT = np.array([-0.45, -0.55, 0.70])
VIEW = np.array([-0.62, -1.0, 0.85])


def stock(results: Results, over: str, width_mm: float) -> Figure:
    """The finished stock: height over the plan, and a view of it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    points, triangles = results.stock()
    low, high = points.min(axis=0), points.max(axis=0)
    extent = high - low
    pixel = float(extent[:2].max()) / SEEN_PX
    shape = tuple(int(v) for v in np.maximum(np.ceil(extent[1::-1] / pixel), 1))
    depth, _ = nearest_faces(points, triangles, low[:2], pixel, shape)  # type: ignore[arg-type]
    seen = np.where(np.isfinite(depth), depth, np.nan)
    tall = 0.5 * width_mm * min(max(float(extent[1] / extent[0]), 0.35), 1.1) + 16.0
    figure = Figure(figsize=(width_mm / MM_PER_INCH, tall / MM_PER_INCH), layout="constrained")
    FigureCanvasAgg(figure)
    plan, view = figure.subplots(1, 2, width_ratios=(1.12, 1.0))
    image = plan.imshow(
        seen, origin="lower", extent=(low[0], low[0] + shape[1] * pixel, low[1], low[1] + shape[0] * pixel), cmap="viridis",
        interpolation="nearest",
    )  # fmt: skip
    plan.set(xlabel="x (mm)", ylabel="y (mm)", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    plan.grid(visible=False)
    figure.colorbar(image, ax=plan, label="z (mm)", shrink=0.85, pad=0.02)
    picture, box = _viewed(points, triangles)
    view.imshow(picture, origin="lower", extent=box, interpolation="antialiased")
    view.set_axis_off()
    return figure


def _viewed(points: Floats, triangles: np.ndarray) -> tuple[Floats, tuple[float, float, float, float]]:
    """Shaded picture (rows, columns, RGBA) of triangles seen from the front left above, and its extent in mm."""
    toward = VIEW / np.linalg.norm(VIEW)
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    frame = np.stack([right, np.cross(toward, right), toward])
    turned = points @ frame.T
    low, high = turned[:, :2].min(axis=0), turned[:, :2].max(axis=0)
    pixel = float((high - low).max()) / (2 * SEEN_PX)  # twice as fine, then averaged: smooth borders
    shape = tuple(int(2 * np.ceil(v / 2)) for v in np.maximum(np.ceil((high - low)[::-1] / pixel), 1))
    depth, face = nearest_faces(turned, triangles, low, pixel, shape)  # type: ignore[arg-type]
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    lit = 0.42 + 0.58 * np.maximum(normal @ (LIGHT / np.linalg.norm(LIGHT)), 0.0)
    there = face >= 0
    shade = np.where(there, lit[face], 0.0)
    edge = np.zeros(shape, dtype=bool)  # a step in depth is an outline
    for axis in (0, 1):
        with np.errstate(invalid="ignore"):
            jump = np.abs(np.diff(np.where(there, depth, depth[there].min() - 1e3), axis=axis)) > 12.0 * pixel
        edge |= np.concatenate([jump, np.zeros_like(edge.take([0], axis=axis))], axis=axis)
    shade = np.where(edge & there, 0.35 * shade, shade)
    colour = shade[..., None] * np.array([0.80, 0.85, 0.92])
    pixels = np.concatenate([colour * there[..., None], there[..., None]], axis=2)
    fine = pixels.reshape(shape[0] // 2, 2, shape[1] // 2, 2, 4).mean(axis=(1, 3))
    alpha = np.maximum(fine[..., 3:], 1e-9)
    fine[..., :3] = np.clip(fine[..., :3] / alpha, 0.0, 1.0)
    return fine, (low[0], low[0] + shape[1] * pixel, low[1], low[1] + shape[0] * pixel)


def schedule(results: Results, over: str, width_mm: float) -> Figure:
    """All strategies on the same job: time, peak of every load against that as programmed, and spread."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    table = results.strategies
    if table is None or len(table) < 2:
        raise InputError(
            "no comparison of strategies", file=str(results.folder), remedy="run a job with a [feed] table"
        )
    names = [
        name.replace("_", " ") + " (written)" * bool(asked)
        for name, asked in table.select("strategy", "asked_for").iter_rows()
    ]
    figure = Figure(figsize=(width_mm / MM_PER_INCH, 62.0 / MM_PER_INCH), layout="constrained")
    FigureCanvasAgg(figure)
    time, peak, spread = figure.subplots(1, 3, width_ratios=(1.0, 1.25, 1.25))
    colours = [GREY, BLUE, GREEN, ORANGE][: len(names)]
    place = np.arange(len(names))
    bars = time.bar(place, _column(table, "time_s"), color=colours, width=0.7)
    time.bar_label(bars, fmt="%.1f", fontsize=7, padding=1)
    time.set(ylabel="time at feed (s)", xticks=[])
    loads = [
        (key, label)
        for key, label in (
            ("volume", "volume\nrate"),
            ("chip_area", "chip\narea"),
            ("force", _force_label(table)),
        )
        if table[f"{key}_peak"].null_count() < len(table)
    ]
    at = np.arange(len(loads))
    wide = 0.8 / len(names)
    for k, (name, colour) in enumerate(zip(names, colours, strict=True)):
        shift = (k - 0.5 * (len(names) - 1)) * wide
        tops = [_column(table, f"{key}_peak") for key, _ in loads]
        peak.bar(at + shift, [top[k] / top[0] if top[0] > 0 else np.nan for top in tops], wide, color=colour)
        spread.bar(
            at + shift,
            [_column(table, f"{key}_spread")[k] for key, _ in loads],
            wide,
            color=colour,
            label=name,
        )
    peak.axhline(1.0, color="#111827", lw=0.6, zorder=0)
    peak.set(ylabel="peak / peak as programmed (–)", xticks=at)
    spread.set(ylabel="standard deviation / mean (–)", xticks=at)
    for axes in (peak, spread):
        axes.set_xticklabels([label for _, label in loads])
    for axes in (time, peak, spread):
        axes.grid(visible=False, axis="x")
    figure.legend(*spread.get_legend_handles_labels(), loc="outside lower center", ncols=len(names))
    return figure


def _force_label(table: pl.DataFrame) -> str:
    """The load of the force strategy by its unit."""
    units = dict(zip(table["strategy"].to_list(), table["unit"].to_list(), strict=True))
    return {"N mm": "torque", "W": "power", "mm": "deflection"}.get(units.get("force") or "N", "force")


KINDS: dict[str, Callable[[Results, str, float], Figure]] = {
    "load": load, "bracket": bracket, "feed": feed, "engagement": engagement, "stock": stock, "schedule": schedule,
}  # fmt: skip


def draw(results: Results, kind: str, *, over: str | None = None, width_mm: float = WIDTH_MM) -> Figure:
    """One figure.

    Parameters
    ----------
    kind : of `KINDS`. over : "time" or "block", what runs along the x axis; None: block for `bracket`, else time where the
        program has any. width_mm : of the figure.

    Raises
    ------
    InputError
        The directory lacks what the kind shows, or matplotlib is not installed.
    """
    if over is None:
        over = "block" if kind == "bracket" or not (results.blocks["time_s"].sum() or 0.0) > 0.0 else "time"
    with look():
        return KINDS[kind](results, over, width_mm)
