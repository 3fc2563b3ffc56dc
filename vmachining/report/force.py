"""Forces over time: tables, and a picture that opens offline."""

from __future__ import annotations

import html
from pathlib import Path

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs
from plotly.subplots import make_subplots

from vmachining.job.files import atomic_path, make_folder, write_atomic
from vmachining.job.predict import Prediction
from vmachining.report.figures import FONT, GRID, MODEBAR

__all__ = ["force_figure", "write_forces"]

MOST = 20_000
"""Rows of the revolutions that are drawn; the tables have them all."""


def force_figure(found: Prediction) -> go.Figure:
    """Largest force and mean power at the stations over time, and the force of their revolutions over the angle."""
    s = found.stations
    figure = make_subplots(
        rows=3, cols=1, vertical_spacing=0.09,
        subplot_titles=("Largest force of a revolution", "Mean power at the cutter", "Force on the tool over a revolution"),
    )  # fmt: skip
    time = s["time_s"].to_list()
    told = [f"block {b}, line {n}, at {a:.3g}" for b, n, a in s.select("block", "line", "at").iter_rows()]
    figure.add_scatter(x=time, y=s["peak_n"].to_list(), text=told, name="force", mode="lines", row=1, col=1)
    figure.add_scatter(x=time, y=s["power_w"].to_list(), text=told, name="power", mode="lines", row=2, col=1)
    worst = s.sort("peak_n", descending=True).row(0, named=True)
    turn = found.series.filter(
        (found.series["block"] == worst["block"]) & (found.series["at"] == worst["at"])
    ).sort("phi_deg")
    for name in ("fx_n", "fy_n", "fz_n", "resultant_n"):
        figure.add_scatter(
            x=turn["phi_deg"].to_list()[:MOST], y=turn[name].to_list()[:MOST], name=name.removesuffix("_n"),
            mode="lines", row=3, col=1,
        )  # fmt: skip
    figure.update_xaxes(title_text="time, s", gridcolor=GRID, row=1, col=1)
    figure.update_xaxes(title_text="time, s", gridcolor=GRID, row=2, col=1)
    where = f"rotation angle of the first tooth, degrees, at the largest force (block {worst['block']})"
    figure.update_xaxes(title_text=where, gridcolor=GRID, row=3, col=1)
    for row, unit in ((1, "N"), (2, "W"), (3, "N")):
        figure.update_yaxes(title_text=unit, gridcolor=GRID, row=row, col=1)
    figure.update_layout(
        font=FONT, height=860, plot_bgcolor="white", margin={"t": 40, "b": 40}, modebar=MODEBAR
    )
    return figure


def write_forces(found: Prediction, folder: Path | str, *, name: str = "") -> list[Path]:
    """Write forces.csv, forces.parquet (revolutions), force_stations.csv and forces.html; the files written."""
    folder = Path(folder)
    make_folder(folder)
    paths = [folder / n for n in ("forces.csv", "forces.parquet", "force_stations.csv", "forces.html")]
    for path in paths[:3]:
        table = found.stations if path.stem == "force_stations" else found.series
        with atomic_path(path) as temporary:
            (table.write_parquet if path.suffix == ".parquet" else table.write_csv)(temporary)
    title = html.escape(f"Forces of {name}" if name else "Forces")
    drawn = force_figure(found).to_html(full_html=False, include_plotlyjs=False)
    notes = "".join(f"<li>{html.escape(note)}</li>" for note in found.notes)
    page = (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title>'
        f"<script>{get_plotlyjs()}</script><body><h1>{title}</h1>"
        "<p>Forces on the tool in workpiece axes, all teeth, at stations along the blocks.</p>"
        f"{f'<ul>{notes}</ul>' if notes else ''}{drawn}</body></html>"
    )
    write_atomic(paths[3], page)
    return paths
