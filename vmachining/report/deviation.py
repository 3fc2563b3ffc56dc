"""deviation.html: the part, the vectors on it, and how far the workpiece is from it, in three dimensions."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from vmachining.engines.dexel import DexelEngine
from vmachining.engines.vectors import KINDS, VectorEngine
from vmachining.errors import InputError
from vmachining.job import RunResult
from vmachining.job.files import write_atomic
from vmachining.job.gouge import ends_against
from vmachining.job.stock import design_mesh
from vmachining.report.figures import BAR, FONT
from vmachining.report.thin import thin_mesh
from vmachining.stock import MeshStock

__all__ = ["deviation_figure", "write_deviation"]

MOST_POINTS = 40_000
"""Drawn; those outside of the tolerance first."""

SCALE = "RdBu"
"""Red: too much is taken, blue: material is left."""

DRAWN_MM = 0.1
"""Share of the part's size that the largest vector is drawn with."""


def write_deviation(result: RunResult, path: Path) -> None:
    """Write the page of a result of the vectors or the dexel engine.

    Raises
    ------
    InputError
        Another engine made the result.
    """
    engine, keys = result.stock, result.job.keys.design
    if keys is not None and isinstance(engine, DexelEngine):
        figure = ends_figure(result, engine, keys.tolerance_mm)
    elif keys is not None and isinstance(engine, VectorEngine):
        figure = deviation_figure(engine, keys.tolerance_mm)
    else:
        raise InputError("only the engines vectors and dexel measure a deviation")
    figure.update_layout(title={"text": f"Deviation of {result.job.name} from its design", "x": 0.02})
    write_atomic(path, figure.to_html(include_plotlyjs=True, full_html=True))


def ends_figure(result: RunResult, engine: DexelEngine, tolerance: float) -> go.Figure:
    """The part in grey, and the ends of rays outside of the tolerance at their feet, coloured by deviation."""
    part = design_mesh(result.job)
    assert part is not None
    columns, told = ends_against(engine, part, tolerance)
    figure = go.Figure(_part(part))
    deviation = np.asarray(columns["deviation_mm"])[:MOST_POINTS]
    reach = max(3.0 * tolerance, 0.2 * max(told["max_overcut_mm"], told["max_undercut_mm"]))
    block = [np.nan if k is None else k for k in columns["block"][:MOST_POINTS]]
    x, y, z = (columns[name][:MOST_POINTS] for name in ("x_mm", "y_mm", "z_mm"))
    figure.add_trace(
        go.Scatter3d(
            x=x, y=y, z=z, mode="markers", name="outside of the tolerance", text=columns["kind"][:MOST_POINTS],
            customdata=np.column_stack([deviation, block]),
            marker={"size": 2.5, "color": deviation, "cmin": -reach, "cmax": reach, "colorscale": SCALE, "showscale": True,
                    "colorbar": {"title": {"text": "mm"}, **BAR}},
            hovertemplate="%{text}<br>x %{x:.3f} y %{y:.3f} z %{z:.3f}<br>deviation %{customdata[0]:.4g} mm<br>"
            "block %{customdata[1]}<extra></extra>",
        )
    )  # fmt: skip
    return figure.update_layout(
        font=FONT, scene={"aspectmode": "data"}, margin={"l": 0, "r": 0, "b": 0, "t": 40}
    )


def _part(mesh: MeshStock) -> go.Mesh3d:
    thin = thin_mesh(mesh.vertices, mesh.triangles, np.zeros(len(mesh.triangles), dtype=np.int64))
    x, y, z = thin.vertices.T
    i, j, k = thin.triangles.T
    return go.Mesh3d(
        x=x, y=y, z=z, i=i, j=j, k=k, color="#c9d0d9", opacity=0.35, name="design", showlegend=True, hoverinfo="skip"
    )  # fmt: skip


def deviation_figure(engine: VectorEngine, tolerance: float) -> go.Figure:
    """The part in grey; feet of vectors coloured by deviation; vectors outside of the tolerance as lines."""
    part = engine.part
    figure = go.Figure(_part(part.mesh))
    shown = engine.deviation(tolerance, outside_only=False, most=MOST_POINTS // 2)
    outside = engine.deviation(tolerance, most=MOST_POINTS // 2)
    largest = float(np.abs(outside.deviation).max(initial=0.0))
    reach = max(3.0 * tolerance, 0.2 * largest)
    for found, name, size in (
        (shown, "all vectors (thinned)", 2.0),
        (outside, "outside of the tolerance", 3.5),
    ):
        if not len(found.point):
            continue
        data = np.column_stack(
            [found.deviation, found.length, np.where(found.block < 0, np.nan, found.block)]
        )
        figure.add_trace(
            go.Scatter3d(
                x=found.point[:, 0], y=found.point[:, 1], z=found.point[:, 2], mode="markers", name=name,
                customdata=data, text=[KINDS[k] for k in found.kind.tolist()],
                marker={
                    "size": size, "color": found.deviation, "cmin": -reach, "cmax": reach, "colorscale": SCALE,
                    "showscale": found is shown, "colorbar": {"title": {"text": "mm"}, **BAR},
                },
                hovertemplate="%{text}<br>x %{x:.3f} y %{y:.3f} z %{z:.3f}<br>deviation %{customdata[0]:.4g} mm<br>"
                "length %{customdata[1]:.4g} mm<br>block %{customdata[2]}<extra></extra>",
            )
        )  # fmt: skip
    if largest > 0.0:
        stretch = DRAWN_MM * part.size / largest
        ends = outside.point + stretch * outside.deviation[:, None] * outside.normal
        lines = np.full((3 * len(ends), 3), np.nan)
        lines[0::3], lines[1::3] = outside.point, ends
        figure.add_trace(
            go.Scatter3d(
                x=lines[:, 0], y=lines[:, 1], z=lines[:, 2], mode="lines", line={"color": "#1b2733", "width": 1},
                name=f"deviation, {stretch:.3g} times", hoverinfo="skip",
            )
        )  # fmt: skip
    figure.update_layout(
        font=FONT,
        scene={"aspectmode": "data"},
        legend={"x": 0.01, "y": 0.95},
        margin={"l": 0, "r": 0, "b": 0, "t": 40},
    )
    return figure
