"""The map of engagement as a page that opens offline and as a PNG, and the tables beside it."""

from __future__ import annotations

import html
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go
import polars as pl
from plotly.offline import get_plotlyjs
from plotly.subplots import make_subplots

from vmachining.arrays import Floats
from vmachining.engagement import Engagement, chip_table
from vmachining.errors import InputError
from vmachining.job.files import atomic_path, write_atomic
from vmachining.job.folder import engagement_files
from vmachining.job.table import readable
from vmachining.report.figures import AFTER, BEFORE, FEED, FONT, GRID, INK, MODEBAR, MUTED

__all__ = ["write_engagement", "write_engagement_page", "write_engagement_png"]

CELLS = 240
"""Of the picture along the edge."""

MAP_CELLS = 200
"""Of the map in the CSV file, over the whole edge."""

HEAD = 1.12
"""The picture shows the edge a little beyond its highest engaged point."""

SCALE = "Viridis"


class Drawn(NamedTuple):
    """What both pictures show.

    turn : (n,) degrees, rising. s : (m,) mm, middles of cells along the edge. chip : (m, n) chip thickness per feed
    per tooth where the edge is engaged, NaN elsewhere. ends : (k, 3) turn, LE and UE of every interval. length,
    area : (n,) mm. joints : s of the joints that are seen. top : highest s that is seen. axis : its title.
    """

    turn: Floats
    s: Floats
    chip: Floats
    ends: Floats
    length: Floats
    area: Floats
    joints: Floats
    top: float
    axis: str


def drawn(found: Engagement) -> Drawn:
    """The numbers of the picture, angles counted from the feed where it has a direction."""
    offset = found.feed_angle
    turn = np.degrees(found.phi) + (0.0 if offset is None else float(np.degrees(offset)))
    turn = np.round(turn, 9) % 360.0
    order = np.argsort(turn, kind="stable")
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    parts = found.intervals
    low = float(found.edge.joints[0])
    top = float(found.edge.joints[-1])
    if len(parts.row):
        top = min(top, low + HEAD * (float(parts.upper.max()) - low))
    borders = np.linspace(low, top, CELLS + 1)
    s = 0.5 * (borders[1:] + borders[:-1])
    chip = np.full((CELLS, len(turn)), np.nan)
    tip = float(np.linalg.norm(found.stance.velocity))
    for row, lower, upper in zip(parts.row, parts.lower, parts.upper, strict=True):
        inside = np.flatnonzero((s >= lower) & (s <= upper))
        if len(inside):
            phi = np.full(len(inside), found.phi[row])
            speed = found.stance.normal_speed(found.edge, phi, found.edge.piece_at(s[inside]), s[inside])
            chip[inside, place[row]] = speed / tip if tip > 0.0 else 1.0
    ends = np.column_stack([turn[parts.row], parts.lower, parts.upper])
    joints = found.edge.joints[1:-1]
    label = "rotation angle" if offset is None else "rotation angle from the feed, 90° straight ahead"
    return Drawn(
        turn[order], s, chip, ends, found.lengths[order], found.chip_per_feed[order],
        joints[(joints > low) & (joints < top)], top, label,
    )  # fmt: skip


def write_engagement(found: Engagement, folder: Path | str, *, name: str = "") -> list[Path]:
    """Write engagement.csv, .parquet, .html, engagement_map.csv, engagement_chips.csv (`chip_table` per mm of feed
    per tooth), and engagement.png where matplotlib is there.

    What an earlier call made there is replaced; engagement.json says what that is.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    InputError
        The directory holds a file of somebody else under one of these names, or somebody is writing there.
    """
    folder = Path(folder)
    with engagement_files(folder):
        return _write(found, folder, name)


def _write(found: Engagement, folder: Path, name: str) -> list[Path]:
    table = found.table()
    paths = [folder / f"engagement.{suffix}" for suffix in ("csv", "parquet", "html", "png")]
    with atomic_path(paths[0]) as temporary:
        readable(table.lazy()).collect().write_csv(temporary)
    with atomic_path(paths[1]) as temporary:
        table.write_parquet(temporary)
    write_engagement_page(found, paths[2], name=name)
    if find_spec("matplotlib") is not None:
        write_engagement_png(found, paths[3], name=name)
    else:
        paths.pop()
    chart = found.map(MAP_CELLS)
    middles = 0.5 * (chart.s[1:] + chart.s[:-1])
    columns = {
        "phi_deg": np.degrees(chart.phi),
        **{f"{m:.6g}": c for m, c in zip(middles, chart.share.T, strict=True)},
    }
    paths.append(folder / "engagement_map.csv")
    with atomic_path(paths[-1]) as temporary:
        readable(pl.LazyFrame(columns)).collect().write_csv(temporary)
    paths.append(folder / "engagement_chips.csv")
    with atomic_path(paths[-1]) as temporary:
        readable(chip_table(found).lazy()).collect().write_csv(temporary)
    return paths


def write_engagement_page(found: Engagement, path: Path, *, name: str = "") -> None:
    """One self-contained HTML file: the unrolled map coloured by chip thickness, length of cut and chip area."""
    d = drawn(found)
    figure = make_subplots(rows=2, cols=1, shared_xaxes=True, vertical_spacing=0.07, row_heights=[0.62, 0.38])
    figure.add_trace(
        go.Heatmap(
            x=d.turn, y=d.s, z=d.chip, colorscale=SCALE, zmin=0.0, zmax=1.0, hoverongaps=False,
            colorbar={"title": {"text": "h / f<sub>z</sub>"}, "len": 0.6, "y": 0.7, "thickness": 12},
            hovertemplate="%{x:.2f}°, s %{y:.4f} mm<br>chip thickness %{z:.4f} of the feed per tooth<extra></extra>",
        ),
        row=1, col=1,
    )  # fmt: skip
    for column, label, colour in ((1, "LE, lower end", FEED), (2, "UE, upper end", "#d92d20")):
        figure.add_trace(
            go.Scatter(
                x=d.ends[:, 0], y=d.ends[:, column], mode="markers", name=label, marker={"size": 4, "color": colour},
                hovertemplate="%{x:.2f}°, s %{y:.6f} mm<extra>" + label + "</extra>",
            ),
            row=1, col=1,
        )  # fmt: skip
    for joint in d.joints:
        figure.add_hline(y=float(joint), line={"color": MUTED, "width": 1, "dash": "dot"}, row=1, col=1)
    for values, label, colour in (
        (d.length, "length of cut", BEFORE),
        (d.area, "chip area per feed per tooth", AFTER),
    ):
        figure.add_trace(
            go.Scatter(
                x=d.turn, y=values, name=label, mode="lines", line={"color": colour, "width": 2},
                hovertemplate="%{x:.2f}°: %{y:.6f} mm<extra>" + label + "</extra>",
            ),
            row=2, col=1,
        )  # fmt: skip
    look: dict[str, Any] = {"gridcolor": GRID, "zeroline": False, "tickfont": {"size": 11, "color": MUTED}}
    figure.update_xaxes(range=[0, 360], dtick=30, **look)
    figure.update_xaxes(title={"text": f"{d.axis}, degrees"}, row=2, col=1)
    figure.update_yaxes(title={"text": "along the edge s, mm"}, range=[d.s[0], d.top], row=1, col=1, **look)
    figure.update_yaxes(title={"text": "mm"}, rangemode="tozero", row=2, col=1, **look)
    figure.update_layout(
        font=FONT, modebar=MODEBAR, paper_bgcolor="#ffffff", plot_bgcolor="#ffffff", height=760,
        margin={"l": 70, "r": 20, "t": 20, "b": 50}, legend={"orientation": "h", "y": -0.11},
    )  # fmt: skip
    chart = figure.to_html(full_html=False, include_plotlyjs=False, default_width="100%")
    facts = "".join(f"<tr><th>{html.escape(k)}</th><td>{html.escape(v)}</td></tr>" for k, v in _facts(found))
    notes = "".join(f"<p class=note>{html.escape(text)}</p>" for text in found.notes)
    heading = html.escape(_title(found, name))
    write_atomic(
        path,
        "<!doctype html><html lang=en><meta charset=utf-8>"
        '<meta name=viewport content="width=device-width, initial-scale=1">'
        f"<title>{heading}</title><style>body{{font:15px/1.5 Inter,'Segoe UI',system-ui,sans-serif;color:{INK};"
        "max-width:1100px;margin:24px auto;padding:0 16px}h1{font-size:20px}table{border-collapse:collapse}"
        f"th{{text-align:left;font-weight:500;color:{MUTED};padding:2px 18px 2px 0}}td{{padding:2px 0}}"
        ".note{border-left:3px solid #e08e0b;padding-left:10px}</style>"
        f"<script>{get_plotlyjs()}</script><h1>{heading}</h1><table>{facts}</table>{notes}{chart}</html>",
    )


def write_engagement_png(found: Engagement, path: Path, *, name: str = "") -> None:
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
    d = drawn(found)
    figure = Figure(figsize=(9.0, 6.2), dpi=110, layout="constrained")
    FigureCanvasAgg(figure)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(1.7, 1.0))
    half = 180.0 / len(d.turn)
    x = np.append(d.turn - half, d.turn[-1] + half)
    y = np.linspace(d.s[0] - 0.5 * (d.s[1] - d.s[0]), d.top, CELLS + 1)
    mesh = top.pcolormesh(x, y, np.ma.masked_invalid(d.chip), cmap="viridis", vmin=0.0, vmax=1.0)
    top.plot(d.ends[:, 0], d.ends[:, 1], ".", ms=3, color=FEED, label="LE")
    top.plot(d.ends[:, 0], d.ends[:, 2], ".", ms=3, color="#d92d20", label="UE")
    for joint in d.joints:
        top.axhline(float(joint), color=MUTED, lw=0.8, ls=":")
    top.set(ylabel="along the edge s, mm", ylim=(y[0], d.top), title=_title(found, name))
    top.legend(loc="best", framealpha=0.85, edgecolor="none")
    figure.colorbar(mesh, ax=top, label="chip thickness / feed per tooth", pad=0.01)
    bottom.plot(d.turn, d.length, color=BEFORE, label="length of cut, mm")
    bottom.plot(d.turn, d.area, color=AFTER, label="chip area / feed per tooth, mm")
    bottom.set(xlabel=f"{d.axis}, degrees", xlim=(0, 360), xticks=range(0, 361, 30))
    bottom.set_ylim(bottom=0.0)
    bottom.legend(loc="best", framealpha=0.85, edgecolor="none")
    for axes in (top, bottom):
        axes.grid(color=GRID, lw=0.8)
        axes.set_axisbelow(True)
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format="png")


def _title(found: Engagement, name: str) -> str:
    place = f"block {found.block} at {found.at:g}" if found.block is not None else "engagement"
    return f"{name}: {place}, {found.method}" if name else f"{place}, {found.method}"


def _facts(found: Engagement) -> list[tuple[str, str]]:
    """Key figures in words."""
    s = found.summary
    tip, axis = (", ".join(f"{v:.6g}" for v in s[key]) for key in ("tip_mm", "axis"))
    fed = s["arcs_feed_deg"] is not None
    arcs = s["arcs_feed_deg"] if fed else s["arcs_deg"]
    told = ", ".join(f"{a:.6f}° to {b:.6f}°" for a, b in arcs) + (" from the feed" if fed else "")
    told = "all round" if found.is_round else "nowhere: air" if found.is_air else told
    rows = [
        ("tip, axis", f"({tip}) mm, ({axis})"), ("engaged", told),
        ("axial depth", f"{s['ap_mm']:.6f} mm"),
        ("radial depth", "the feed is axial" if s["ae_mm"] is None else f"{s['ae_mm']:.6f} mm"),
        ("length of cut", f"at most {s['length_max_mm']:.6f} mm"),
        ("engaged surface", f"{s['area_mm2']:.6g} mm², {100 * s['area_fraction']:.4g} % of what cuts"),
    ]  # fmt: skip
    if s["removal_mm3_per_mm"] is not None:
        rows.append(("removed here", f"{s['removal_mm3_per_mm']:.6g} mm³ per mm of path"))
    return rows
