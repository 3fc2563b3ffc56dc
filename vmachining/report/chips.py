"""Chips of a pass as pictures: their shapes over the rotation angle, and cut length and chip area over time.

Drawn from a `chip_table`, so every engine is drawn alike. The shape of a chip is the cut length over the rotation angle
from the feed, at some positions of the pass; the map shows the chip area at all of them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go
import polars as pl
from numpy.typing import ArrayLike
from plotly.subplots import make_subplots

from vmachining.arrays import Floats
from vmachining.errors import InputError
from vmachining.job.files import atomic_path, make_folder
from vmachining.report.figures import AFTER, BEFORE, FONT, GRID, INK, MODEBAR, MUTED

__all__ = ["chip_figure", "write_chips", "write_chips_png"]

SHAPES = 6
"""Chips that are drawn on their own, at even distances along the pass."""


class Drawn(NamedTuple):
    """angle (m,) degrees, rising, from the feed where it has a direction. length, area (n, m). time (n,). axis, unit: titles."""

    angle: Floats
    length: Floats
    area: Floats
    time: Floats
    axis: str
    unit: str

    def named(self, k: int) -> str:
        """Position k in words: "time 4.2 s"."""
        word, _, unit = self.unit.partition(", ")
        return f"{word} {self.time[k]:.4g} {unit}".rstrip()


def drawn(table: pl.DataFrame, time: ArrayLike | None = None) -> Drawn:
    """The numbers of the pictures.

    Parameters
    ----------
    table : `chip_table` of positions with the same number of angles each.
    time : (n,) s of the positions; None counts them.

    Raises
    ------
    InputError
        An empty table, or another number of times than of positions.
    """
    positions = table["position"].n_unique()
    if not positions or len(table) % positions:
        raise InputError("chips want a table with as many angles at every position", remedy="see chip_table")
    when = np.arange(positions, dtype=np.float64) if time is None else np.asarray(time, dtype=np.float64)
    if when.shape != (positions,):
        raise InputError(f"{positions} positions want as many times, got shape {when.shape}")
    fed = table["phi_feed_deg"].null_count() == 0
    angle = table["phi_feed_deg" if fed else "phi_deg"].to_numpy().reshape(positions, -1)
    order = np.argsort(angle, axis=1, kind="stable")
    length, area = (
        np.take_along_axis(table[name].to_numpy().reshape(positions, -1), order, axis=1)
        for name in ("length_mm", "area_mm2")
    )
    first = np.take_along_axis(angle, order, axis=1)
    # the feed turns against the grid of the tool: all are drawn at the angles of the first position
    grid = first[0]
    for k in range(1, positions):
        length[k] = np.interp(grid, first[k], length[k], period=360.0)
        area[k] = np.interp(grid, first[k], area[k], period=360.0)
    label = "rotation angle from the feed, 90° straight ahead" if fed else "rotation angle"
    return Drawn(grid, length, area, when, label, "position" if time is None else "time, s")


def chosen(d: Drawn) -> list[int]:
    """Positions whose chips are drawn."""
    return sorted({round(k) for k in np.linspace(0, len(d.time) - 1, min(SHAPES, len(d.time)))})


def chip_figure(table: pl.DataFrame, time: ArrayLike | None = None) -> go.Figure:
    """Shapes of chips, map of the chip area, cut length and chip area over time; see `drawn`."""
    d = drawn(table, time)
    figure = make_subplots(
        rows=3,
        cols=1,
        vertical_spacing=0.1,
        row_heights=[0.34, 0.36, 0.3],
        specs=[[{}], [{}], [{"secondary_y": True}]],
    )
    picked = chosen(d)
    for n, k in enumerate(picked):
        share = n / max(len(picked) - 1, 1)
        colour = f"rgb({int(20 + 200 * share)},{int(110 - 60 * share)},{int(190 - 130 * share)})"
        figure.add_trace(
            go.Scatter(
                x=d.angle, y=d.length[k], mode="lines", name=d.named(k),
                line={"color": colour, "width": 2},
                hovertemplate="%{x:.1f}°: %{y:.4f} mm<extra></extra>",
            ),
            row=1, col=1,
        )  # fmt: skip
    figure.add_trace(
        go.Heatmap(
            x=d.time, y=d.angle, z=d.area.T, colorscale="Viridis", zmin=0.0,
            colorbar={"title": {"text": "mm²"}, "len": 0.36, "y": 0.47, "thickness": 12},
            hovertemplate="%{x:.4g}, %{y:.1f}°: %{z:.5f} mm²<extra></extra>",
        ),
        row=2, col=1,
    )  # fmt: skip
    for values, label, colour, second in (
        (d.length.max(axis=1), "largest cut length, mm", BEFORE, False),
        (d.area.max(axis=1), "largest chip area, mm²", AFTER, True),
    ):
        figure.add_trace(
            go.Scatter(x=d.time, y=values, mode="lines", name=label, line={"color": colour, "width": 2}),
            row=3, col=1, secondary_y=second,
        )  # fmt: skip
    look: dict[str, Any] = {"gridcolor": GRID, "zeroline": False, "tickfont": {"size": 11, "color": MUTED}}
    figure.update_xaxes(**look)
    figure.update_yaxes(**look)
    figure.update_xaxes(title={"text": f"{d.axis}, degrees"}, range=[0, 360], dtick=30, row=1, col=1)
    figure.update_yaxes(title={"text": "cut length, mm"}, rangemode="tozero", row=1, col=1)
    figure.update_yaxes(title={"text": "angle, degrees"}, dtick=90, row=2, col=1)
    figure.update_xaxes(title={"text": d.unit}, row=3, col=1)
    figure.update_yaxes(title={"text": "mm"}, rangemode="tozero", row=3, col=1, secondary_y=False)
    figure.update_yaxes(title={"text": "mm²"}, rangemode="tozero", row=3, col=1, secondary_y=True)
    figure.update_layout(
        font=FONT, modebar=MODEBAR, paper_bgcolor="#ffffff", plot_bgcolor="#ffffff", height=900,
        margin={"l": 70, "r": 20, "t": 20, "b": 50}, legend={"orientation": "h", "y": -0.08},
    )  # fmt: skip
    return figure


def write_chips(
    table: pl.DataFrame, folder: Path | str, *, time: ArrayLike | None = None, name: str = "chips"
) -> list[Path]:
    """Write NAME.csv, .html (opens offline) and, where matplotlib is there, .png into a folder; the files written."""
    from importlib.util import find_spec

    folder = Path(folder)
    make_folder(folder)
    paths = [folder / f"{name}.{suffix}" for suffix in ("csv", "html", "png")]
    figure = chip_figure(table, time)
    with atomic_path(paths[0]) as temporary:
        table.write_csv(temporary)
    with atomic_path(paths[1]) as temporary:
        figure.write_html(temporary, include_plotlyjs=True, full_html=True)
    if find_spec("matplotlib") is None:
        return paths[:2]
    write_chips_png(table, paths[2], time=time)
    return paths


def write_chips_png(table: pl.DataFrame, path: Path, *, time: ArrayLike | None = None) -> None:
    """The same as a PNG.

    Raises
    ------
    InputError
        matplotlib is not installed.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as exc:
        raise InputError(
            "a PNG wants matplotlib", remedy="pip install 'vmachining[notebooks]', or take the HTML page"
        ) from exc
    d = drawn(table, time)
    figure = Figure(figsize=(9.0, 8.6), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    shapes, area, along = figure.subplots(3, 1, height_ratios=(1.1, 1.2, 1.0))
    picked = chosen(d)
    for n, k in enumerate(picked):
        share = n / max(len(picked) - 1, 1)
        colour = (0.08 + 0.78 * share, 0.43 - 0.23 * share, 0.75 - 0.5 * share)
        shapes.plot(d.angle, d.length[k], color=colour, label=d.named(k))
    shapes.set(xlabel=f"{d.axis}, degrees", ylabel="cut length, mm", xlim=(0, 360), xticks=range(0, 361, 30))
    shapes.set_ylim(bottom=0.0)
    shapes.legend(loc="best", framealpha=0.85, edgecolor="none", fontsize=8)
    mesh = area.pcolormesh(d.time, d.angle, d.area.T, cmap="viridis", vmin=0.0, shading="nearest")
    area.set(ylabel="angle, degrees", yticks=range(0, 361, 90))
    figure.colorbar(mesh, ax=area, label="chip area, mm²", pad=0.01)
    along.plot(d.time, d.length.max(axis=1), color=BEFORE)
    along.set(xlabel=d.unit, ylabel="largest cut length, mm")
    along.yaxis.label.set_color(BEFORE)
    along.set_ylim(bottom=0.0)
    twin = along.twinx()
    twin.plot(d.time, d.area.max(axis=1), color=AFTER)
    twin.set_ylabel("largest chip area, mm²", color=AFTER)
    twin.set_ylim(bottom=0.0)
    for axes in (shapes, along):
        axes.grid(color=GRID, lw=0.8)
        axes.set_axisbelow(True)
    figure.align_ylabels([shapes, area, along])
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format="png", facecolor="white", edgecolor=INK)
