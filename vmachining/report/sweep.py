"""Picture of one sweep: the swept solid, and the way of the tool tip."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from vmachining.engines.mesh import solid
from vmachining.job.files import write_atomic
from vmachining.sweep import Sweep
from vmachining.tolerance import CHORD_MM

__all__ = ["plot_sweep"]

PLACES = 33
"""Of the tip path."""

COARSE_MM = 0.05
"""A picture needs no finer facets."""


def plot_sweep(path: Path, sweep: Sweep, chord: float = CHORD_MM) -> None:
    """Write the picture as one HTML file that opens offline.

    chord : mm, of the facets; not finer than a picture shows.
    """
    mesh = solid(sweep, chord=max(chord, COARSE_MM), side="fair").to_mesh()
    corners = np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3]
    triangles = np.asarray(mesh.tri_verts)
    tip = np.array([sweep.path.position(float(t)) for t in np.linspace(0.0, 1.0, PLACES)])
    figure = go.Figure([
        go.Mesh3d(
            x=corners[:, 0], y=corners[:, 1], z=corners[:, 2], i=triangles[:, 0], j=triangles[:, 1],
            k=triangles[:, 2], color="#8fb1d0", opacity=0.75, flatshading=True, hoverinfo="skip", name="swept solid",
        ),
        go.Scatter3d(
            x=tip[:, 0], y=tip[:, 1], z=tip[:, 2], mode="lines+markers", name="tip of the tool",
            line={"color": "#b3261e", "width": 5}, marker={"size": 2, "color": "#b3261e"},
        ),
    ])  # fmt: skip
    figure.update_layout(
        title="Swept solid", margin={"l": 0, "r": 0, "b": 0, "t": 40},
        scene={"aspectmode": "data", "xaxis_title": "x, mm", "yaxis_title": "y, mm", "zaxis_title": "z, mm"},
    )  # fmt: skip
    page = figure.to_html(include_plotlyjs=True)
    page = page.replace("<head>", '<head><meta name="generator" content="vmachining sweep">', 1)
    write_atomic(path, page)
