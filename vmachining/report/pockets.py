"""Triangular pockets as a page: the path of each strategy, and which is shortest over the shape of the triangle."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians, sin
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from vmachining.arrays import Floats
from vmachining.errors import InputError
from vmachining.job.files import atomic_path
from vmachining.report.figures import AFTER, BEFORE, FEED, FONT, GRID, HIT, INK
from vmachining.toolpath import STRATEGIES, Pocket, Triangle, needs_centre, path_length, pocket_path

__all__ = ["shortest_over_shapes", "write_pocket_page"]

COLOURS = dict(zip(STRATEGIES, (BEFORE, FEED, HIT, AFTER), strict=True))
LABELS = {
    "dp": "direction parallel", "dpi": "direction parallel, improved",
    "cp": "contour parallel", "cpi": "contour parallel, improved",
}  # fmt: skip
STEP_DEG = 2.0


def shortest_over_shapes(share: float, step_deg: float = STEP_DEG) -> tuple[Floats, list[list[str]]]:
    """Which strategy is shortest, by the angles at the base.

    Parameters
    ----------
    share : radius of the cutter over the inradius of the pocket, 0 to 1.

    Returns
    -------
    angles : (n,) degrees. names : n x n, [gamma][beta]; "" where the base would not be the longest side.
    """
    angles = np.arange(step_deg, 90.0, step_deg)
    names = []
    for gamma in angles:
        row = []
        for beta in angles:
            alpha = 180.0 - beta - gamma
            if alpha < max(beta, gamma):
                row.append("")
                continue
            a, b, c = (100.0 * sin(radians(v)) for v in (alpha, beta, gamma))
            r = share * Triangle.of(a, b, c, 1e-9).inradius
            t = Triangle.of(a, b, c, r)
            lengths = {s: path_length(pocket_path(t, s, centre=needs_centre(t))) for s in STRATEGIES}
            row.append(min(lengths, key=lambda name: lengths[name]))
        names.append(row)
    return angles, names


def write_pocket_page(triangle: Triangle, pockets: Sequence[Pocket], path: Path) -> None:
    """One self-contained HTML page.

    Raises
    ------
    InputError
        The name does not end in .html.
    """
    if path.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"--plot {path}: want a name that ends in .html")
    share = triangle.r / triangle.inradius
    titles = [f"{p.strategy}, {LABELS[p.strategy]}: {p.length:.3f} mm" for p in pockets]
    figure = make_subplots(
        rows=3, cols=2, subplot_titles=[*titles, f"shortest strategy, r = {share:.2f} of the inradius"],
        specs=[[{}, {}], [{}, {}], [{"colspan": 2}, None]], vertical_spacing=0.07, row_heights=[0.3, 0.3, 0.4],
    )  # fmt: skip
    wall = triangle.wall()
    for k, pocket in enumerate(pockets):
        place = {"row": k // 2 + 1, "col": k % 2 + 1}
        figure.add_trace(
            go.Scatter(
                x=wall[:, 0], y=wall[:, 1], mode="lines", line={"color": INK, "width": 1.5}, hoverinfo="skip", showlegend=False,
            ),
            **place,
        )  # fmt: skip
        figure.add_trace(
            go.Scatter(
                x=pocket.path[:, 0], y=pocket.path[:, 1], mode="lines+markers", name=pocket.strategy,
                line={"color": COLOURS[pocket.strategy], "width": 2}, marker={"size": 4}, showlegend=False,
            ),
            **place,
        )  # fmt: skip
        axis = "" if k == 0 else str(k + 1)
        figure.update_yaxes(title={"text": "y, mm"}, scaleanchor=f"x{axis}", scaleratio=1, **place)
        figure.update_xaxes(title={"text": "x, mm"}, **place)
    angles, names = shortest_over_shapes(share)
    order = list(STRATEGIES)
    z = [[order.index(name) if name else None for name in row] for row in names]
    scale = [(edge, COLOURS[name]) for k, name in enumerate(order) for edge in (k / 4, (k + 1) / 4)]
    figure.add_trace(
        go.Heatmap(
            x=angles, y=angles, z=z, zmin=-0.5, zmax=3.5, colorscale=scale, text=names, hoverongaps=False,
            colorbar={"tickvals": [0, 1, 2, 3], "ticktext": order, "len": 0.35, "y": 0.17, "thickness": 12},
            hovertemplate="beta %{x}°, gamma %{y}°: %{text}<extra></extra>",
        ),
        row=3, col=1,
    )  # fmt: skip
    figure.update_xaxes(title={"text": "beta, degrees"}, constrain="domain", row=3, col=1)
    figure.update_yaxes(title={"text": "gamma, degrees"}, scaleanchor="x5", scaleratio=1, row=3, col=1)
    figure.update_xaxes(gridcolor=GRID, zeroline=False)
    figure.update_yaxes(gridcolor=GRID, zeroline=False)
    figure.update_layout(
        font=FONT, paper_bgcolor="#ffffff", plot_bgcolor="#ffffff", height=1250, width=1050,
        margin={"l": 60, "r": 20, "t": 50, "b": 50},
    )  # fmt: skip
    with atomic_path(path) as temporary:
        figure.write_html(temporary, include_plotlyjs=True)
