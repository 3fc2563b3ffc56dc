"""The drawings of the report, as plotly figures."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go
import polars as pl
from numpy.typing import ArrayLike
from plotly.subplots import make_subplots

from vmachining.arrays import Floats, Ints
from vmachining.report.thin import ThinMesh, thin_rows

__all__ = ["INK", "PathPiece", "along_program", "contact_along", "stock_view"]

INK, MUTED, GRID = "#1b2733", "#66758a", "#e6eaf0"
BEFORE, AFTER, RAPID, HIT, FEED = "#5b6b7f", "#0d9488", "#e08e0b", "#d92d20", "#2563eb"
RAW = "#c9d0d9"
FONT = {
    "family": "Inter, 'Segoe UI', system-ui, -apple-system, 'Helvetica Neue', Arial, sans-serif",
    "color": INK,
}
LEAST_WIDTH = 1e-6
"""%, the narrowest bracket drawn: below it there is only rounding, and the axis is logarithmic."""

BAR = {"thickness": 12, "len": 0.72, "outlinewidth": 0, "tickfont": {"size": 11, "color": MUTED}}

MODEBAR = {"bgcolor": "rgba(0,0,0,0)", "color": "#a3afbd", "activecolor": INK}

EYE = np.array([-0.75, -1.3, 1.05])
"""Where the camera stands; it is orthographic, so its distance means nothing and the scene's size is the zoom."""

FRAME = 3.1, 1.9
"""Width and height in scene units that a view of the page's shape shows, legend and colour bar left free."""

PathPiece = tuple[str, Floats]
""""rapid", "feed" or "hit" (a rapid through material), and its points (n, 3) in mm."""


def _joined(pieces: Iterable[Floats]) -> Floats:
    """Polylines in one array, NaN rows between."""
    gap = np.full((1, 3), np.nan)
    rows = [part for piece in pieces for part in (piece, gap)]
    return np.concatenate(rows[:-1]) if rows else np.empty((0, 3))


def stock_view(mesh: ThinMesh, pieces: Sequence[PathPiece]) -> go.Figure:
    """The final stock, raw faces grey and cut faces coloured per block, with the tool path over it.

    Trace 0 is the raw surface, trace 1 the cut one: the page colours it by face.
    """
    figure = go.Figure()
    light = {"ambient": 0.62, "diffuse": 0.55, "specular": 0.12, "roughness": 0.7, "fresnel": 0.05,
        "facenormalsepsilon": 0, "vertexnormalsepsilon": 0,  # slivers have normals too
    }  # fmt: skip
    for name, chosen in (("uncut stock", mesh.block < 0), ("cut surface", mesh.block >= 0)):
        triangles = mesh.triangles[chosen]
        used, local = np.unique(triangles, return_inverse=True)
        local = local.reshape(-1, 3).astype(np.int32)
        points = mesh.vertices[used].astype(np.float32)
        own: dict[str, Any] = (
            {"color": RAW}
            if name.startswith("uncut")
            else {
                "intensitymode": "cell",  # the page fills in the intensity: block or rate of each face
                "colorscale": "Viridis",
                "colorbar": {"title": {"text": "block", "font": {"size": 12}}, **BAR},
            }
        )
        figure.add_trace(
            go.Mesh3d(
                x=points[:, 0], y=points[:, 1], z=points[:, 2], i=local[:, 0], j=local[:, 1], k=local[:, 2],
                name=name, showlegend=True, flatshading=True, lighting=light, hoverinfo="skip", **own,
            )
        )  # fmt: skip
    styles = (
        ("feed", "feed", {"color": FEED, "width": 3}),
        ("rapid", "rapid", {"color": RAPID, "width": 2, "dash": "dash"}),
        ("hit", "rapid through material", {"color": HIT, "width": 7}),
    )
    for kind, label, line in styles:
        way = _joined(points for what, points in pieces if what == kind)
        if len(way):
            figure.add_trace(
                go.Scatter3d(
                    x=way[:, 0], y=way[:, 1], z=way[:, 2], mode="lines", name=label, line=line,
                    hovertemplate="x %{x:.3f}<br>y %{y:.3f}<br>z %{z:.3f} mm<extra>" + label + "</extra>",
                )
            )  # fmt: skip
    axis = {
        "showbackground": False, "gridcolor": GRID, "zerolinecolor": GRID, "linecolor": GRID,
        "tickfont": {"size": 10, "color": MUTED}, "nticks": 6,
    }  # fmt: skip
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    reach = 0.3 * float((high - low).max())  # a home position far away must not make the part tiny
    shown = np.stack([low, high])
    for _, way in pieces:
        shown = np.stack([np.minimum(shown[0], way.min(axis=0)), np.maximum(shown[1], way.max(axis=0))])
    shown = np.stack([np.maximum(shown[0], low - reach), np.minimum(shown[1], high + reach)])
    extent = shown[1] - shown[0]
    shown += [[-1.0], [1.0]] * (
        0.002 * extent
    )  # a face on the border of the scene would be clipped in shreds
    figure.update_layout(
        font=FONT,
        modebar=MODEBAR,
        margin={"l": 0, "r": 0, "t": 0, "b": 0},
        paper_bgcolor="rgba(0,0,0,0)",
        legend={"x": 0.01, "y": 0.99, "bgcolor": "rgba(255,255,255,0.75)", "font": {"size": 12}},
        scene={
            "aspectmode": "manual",
            "aspectratio": dict(zip("xyz", (_zoom(extent) * extent).tolist(), strict=True)),
            "camera": {
                "eye": dict(zip("xyz", EYE.tolist(), strict=True)),
                "center": {"x": 0, "y": 0, "z": -0.08},
                "projection": {"type": "orthographic"},
            },
            **{
                f"{n}axis": {
                    **axis,
                    "range": shown[:, k].tolist(),
                    "title": {"text": f"{n} mm", "font": {"size": 11, "color": MUTED}},
                }
                for k, n in enumerate("xyz")
            },
        },
        uirevision="keep",
    )
    return figure


def _zoom(extent: Floats) -> float:
    """Scene units per mm at which a box of this extent (3,) fills the frame."""
    eye = EYE / np.linalg.norm(EYE)
    right = np.cross([0.0, 0.0, 1.0], eye)
    right /= np.linalg.norm(right)
    up = np.cross(eye, right)
    return float(min(FRAME[0] / (abs(right) @ extent), FRAME[1] / (abs(up) @ extent)))


def _hover(rows: pl.DataFrame) -> list[str]:
    """Program text is foreign text: escaped before it reaches a hover label."""
    return [
        f"block {block} · line {line}<br><b>{html.escape(text or '')}</b>"
        for block, line, text in rows.select("block", "line", "text").iter_rows()
    ]


def _filled(column: pl.Series) -> Floats:
    """A column as floats, NaN where it is empty."""
    return np.asarray(column.fill_null(float("nan")).to_numpy(), dtype=np.float64)


def _steps(x: Ints, y: ArrayLike, wide: bool) -> tuple[Floats, Floats]:
    """Both edges of every block, so that a block between two empty ones is a bar of its own."""
    height = np.asarray(y, dtype=np.float64)
    if not wide:
        return x.astype(np.float64), height
    return np.stack([x - 0.5, x + 0.5], axis=1).ravel(), np.repeat(height, 2)


def _seconds(blocks: pl.DataFrame, chosen: Ints, wide: bool) -> list[float]:
    """Begin and end of every chosen block, or its end where rows are thinned; to a microsecond."""
    took = np.nan_to_num(_filled(blocks["time_s"]))
    end = np.cumsum(took)
    ends = np.stack([(end - took)[chosen], end[chosen]], axis=1).ravel() if wide else end[chosen]
    return [float(v) for v in np.round(ends, 6)]


CONTACT_ROWS = (
    (
        "Depth of cut: <span style='color:#2563eb'>axial ap</span>, <span style='color:#7c3aed'>radial ae</span>",
        "mm",
        (("ap_mm", "axial ap", FEED), ("ae_mm", "radial ae", "#7c3aed")),
    ),
    ("Engaged share of a revolution", "1", (("engaged_fraction", "engaged", BEFORE),)),
    ("Largest chip area of a tooth", "mm²", (("chip_area_mm2", "chip area", AFTER),)),
    ("Largest chip thickness", "mm", (("chip_thickness_mm", "chip thickness", "#0891b2"),)),
    ("Peak of the resultant force", "N", (("force_n", "force", HIT),)),
    ("Mean power at the cutter", "W", (("power_w", "power", RAPID),)),
)
"""Rows of `contact_along`: title, unit, and column, name and colour of each line."""


def contact_along(blocks: pl.DataFrame) -> go.Figure | None:
    """Contact, chips, force and power over the block number; what is empty is left out, None if all is.

    The page changes the x axis between the block number and `meta["time"]`, s as programmed.
    """
    shown = [row for row in CONTACT_ROWS if any(blocks[name].count() for name, _, _ in row[2])]
    if not shown:
        return None
    chosen = thin_rows(len(blocks), blocks["removed_mm3"].to_numpy())
    rows, wide = blocks[chosen], len(chosen) == len(blocks)
    x = rows["block"].to_numpy()
    at = _steps(x, x, wide)[0]
    figure = make_subplots(
        rows=len(shown),
        cols=1,
        shared_xaxes=True,
        vertical_spacing=0.3 / len(shown),
        subplot_titles=[row[0] for row in shown],
    )
    for k, (_, unit, lines) in enumerate(shown, start=1):
        for name, label, colour in lines:
            figure.add_trace(
                go.Scatter(
                    x=at, y=_steps(x, _filled(rows[name]), wide)[1], name=label, mode="lines",
                    line={"color": colour, "width": 1.6},
                    hovertemplate="%{text}<br>%{y:.5g} " + unit + "<extra>" + label + "</extra>",
                ),
                row=k, col=1,
            )  # fmt: skip
        figure.update_yaxes(
            title={"text": unit, "font": {"size": 12, "color": MUTED}}, gridcolor=GRID, zeroline=False,
            rangemode="tozero", tickfont={"size": 11, "color": MUTED}, row=k, col=1,
        )  # fmt: skip
    figure.update_xaxes(gridcolor=GRID, zeroline=False, tickfont={"size": 11, "color": MUTED})
    figure.update_xaxes(title={"text": "block", "font": {"size": 12, "color": MUTED}}, row=len(shown), col=1)
    figure.update_layout(
        meta={"labels": _hover(rows), "each": 2 if wide else 1, "time": _seconds(blocks, chosen, wide)},
        font=FONT, modebar=MODEBAR, height=170 * len(shown) + 84,
        paper_bgcolor="rgba(0,0,0,0)", plot_bgcolor="rgba(0,0,0,0)", hovermode="closest", showlegend=False,
        margin={"l": 76, "r": 20, "t": 40, "b": 44},
    )  # fmt: skip
    for note in figure.layout.annotations:
        note.update(x=0, xanchor="left", font={"size": 13, "color": INK})
    return figure


def along_program(blocks: pl.DataFrame, after_rate: Floats | None) -> go.Figure:
    """Removed volume with its bracket, its relative width, volume rate and feed, over the block number.

    after_rate : (n,) mm^3/min of each original block in the rewritten program, or None without a schedule.
    """
    removed = blocks["removed_mm3"].to_numpy()
    chosen = thin_rows(len(blocks), removed)
    rows = blocks[chosen]
    x = rows["block"].to_numpy()
    hover = _hover(rows)
    lo, hi = rows["removed_lo_mm3"].to_numpy(), rows["removed_hi_mm3"].to_numpy()
    value = rows["removed_mm3"].to_numpy()
    figure = make_subplots(
        rows=4, cols=1, shared_xaxes=True, vertical_spacing=0.055, row_heights=[0.3, 0.16, 0.27, 0.27],
        subplot_titles=("Removed volume per block", "Width of its bracket (cut off at 100 %)", "Volume rate", "Feed"),
    )  # fmt: skip
    wide = len(chosen) == len(blocks)  # thinned rows are drawn as points of a line, whole ones as steps
    at = _steps(x, x, wide)[0]

    def line(row: int, y: Floats, name: str, colour: str, template: str, legend: bool) -> None:
        figure.add_trace(
            go.Scatter(
                x=at, y=_steps(x, y, wide)[1], name=name, mode="lines", line={"color": colour, "width": 1.8},
                hovertemplate="%{text}<br>" + template + "<extra>" + name + "</extra>",
                showlegend=legend, legendgroup=name,
            ),
            row=row, col=1,
        )  # fmt: skip

    band: dict[str, Any] = {"mode": "lines", "hoverinfo": "skip", "x": at, "line": {"width": 0}}
    fill = {"fill": "tonexty", "fillcolor": "rgba(37,99,235,0.22)"}
    figure.add_trace(go.Scatter(y=_steps(x, lo, wide)[1], showlegend=False, **band), row=1, col=1)
    figure.add_trace(go.Scatter(y=_steps(x, hi, wide)[1], name="bracket", **fill, **band), row=1, col=1)
    line(1, value, "removed volume", FEED, "%{y:.6g} mm³", True)
    with np.errstate(divide="ignore", invalid="ignore"):
        width = np.where(value > 0, 100 * (hi - lo) / value, np.nan)
    width = np.where(width > 0, np.clip(width, LEAST_WIDTH, 100.0), np.nan)
    line(2, width, "bracket width", "#7c3aed", "%{y:.3g} % of the block's volume", False)
    line(3, _filled(rows["mrr_mm3_min"]), "as programmed", BEFORE, "%{y:.5g} mm³/min", True)
    line(4, _filled(rows["feed_mm_min"]), "as programmed", BEFORE, "%{y:.5g} mm/min", False)
    if after_rate is not None:
        line(3, after_rate[chosen], "scheduled", AFTER, "%{y:.5g} mm³/min", True)
        line(4, _filled(rows["scheduled_feed_mm_min"]), "scheduled", AFTER, "%{y:.5g} mm/min", False)
    figure.update_layout(
        meta={"labels": hover, "each": 2 if wide else 1},  # once for all lines; the page hands them out
        font=FONT,
        modebar=MODEBAR,
        paper_bgcolor="rgba(0,0,0,0)",
        plot_bgcolor="rgba(0,0,0,0)",
        hovermode="closest",
        margin={"l": 76, "r": 20, "t": 62, "b": 44},
        legend={
            "orientation": "h",
            "y": 1.008,
            "x": 1,
            "xanchor": "right",
            "yanchor": "bottom",
            "font": {"size": 12},
        },
    )
    figure.update_xaxes(gridcolor=GRID, zeroline=False, tickfont={"size": 11, "color": MUTED})
    figure.update_xaxes(title={"text": "block", "font": {"size": 12, "color": MUTED}}, row=4, col=1)
    for row, unit in enumerate(("mm³", "%", "mm³/min", "mm/min"), start=1):
        figure.update_yaxes(
            title={"text": unit, "font": {"size": 12, "color": MUTED}},
            gridcolor=GRID,
            zeroline=False,
            rangemode="tozero",
            tickfont={"size": 11, "color": MUTED},
            row=row,
            col=1,
        )
    drawn = width[~np.isnan(width)]
    decades = [np.floor(np.log10(drawn.min())), np.ceil(np.log10(drawn.max()))] if len(drawn) else [-1, 1]
    if decades[0] == decades[1]:
        decades[1] += 1
    figure.update_yaxes(
        type="log", rangemode="normal", range=[float(d) for d in decades], tickformat="~g",
        dtick=max(1, int(decades[1] - decades[0]) // 3), row=2, col=1,
    )  # fmt: skip
    for note in figure.layout.annotations:
        note.update(x=0, xanchor="left", font={"size": 13, "color": INK})
    return figure
