"""Triangular pockets as a page: the path of each strategy, and which is shortest over the shape of the triangle."""

from __future__ import annotations

from collections.abc import Sequence
from math import radians, sin
from pathlib import Path

import numpy as np

from vmachining.arrays import Floats
from vmachining.report.figures import Panel, html_name, picture, write_page
from vmachining.report.paper.style import BLUE, GREEN, GREY, RED, canvas, look
from vmachining.toolpath import STRATEGIES, Pocket, Triangle, needs_centre, path_length, pocket_path

__all__ = ["shortest_over_shapes", "write_pocket_page"]

COLOURS = dict(zip(STRATEGIES, (GREY, BLUE, RED, GREEN), strict=True))
LABELS = {
    "dp": "direction parallel", "dpi": "direction parallel, improved",
    "cp": "contour parallel", "cpi": "contour parallel, improved",
}  # fmt: skip
STEP_DEG = 2.0


def shortest_over_shapes(share: float, step_deg: float = STEP_DEG) -> tuple[Floats, list[list[str]]]:
    """Which strategy is shortest, by the angles at the base.

    share : radius of the cutter over the inradius of the pocket, 0 to 1.
    Returns angles : (n,) degrees. names : n x n, [gamma][beta]; "" where the base would not be the longest side.
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

    Raises InputError: The name does not end in .html.
    """
    from matplotlib.colors import ListedColormap

    share = triangle.r / triangle.inradius
    wall = triangle.wall()
    angles, names = shortest_over_shapes(share)
    order = list(STRATEGIES)
    index = np.array([[order.index(name) if name else np.nan for name in row] for row in names])
    with look():
        figure = canvas(174.0, 84.0 * -(-len(pockets) // 2))
        for axes, pocket in zip(
            figure.subplots(-(-len(pockets) // 2), 2, squeeze=False).flat, pockets, strict=False
        ):
            axes.plot(*wall[:, :2].T, color="black", lw=1.2)
            axes.plot(*pocket.path[:, :2].T, ".-", ms=3, color=COLOURS[pocket.strategy])
            axes.set(
                title=f"{pocket.strategy}, {LABELS[pocket.strategy]}: {pocket.length:.3f} mm",
                xlabel="x, mm",
                ylabel="y, mm",
            )
            axes.set_aspect("equal")
        paths = picture(figure, "The path of each strategy in the triangle")
        figure = canvas(120.0, 100.0)
        axes = figure.subplots()
        mesh = axes.pcolormesh(
            angles, angles, index, cmap=ListedColormap(list(COLOURS.values())), vmin=-0.5, vmax=3.5
        )
        figure.colorbar(mesh, ax=axes, ticks=range(4)).ax.set_yticklabels(order)
        axes.set(xlabel="beta, degrees", ylabel="gamma, degrees", aspect="equal")
        shapes = picture(figure, "Which strategy is shortest over the angles of the triangle", kind="png")
    best = min(pockets, key=lambda pocket: pocket.length)
    write_page(
        html_name(path, "--plot"),
        [Panel(title="Paths", svg=paths),
         Panel(title=f"Shortest strategy over the shape of the triangle, radius {share:.2f} of the inradius", svg=shapes)],
        kind="triangular pocket", name=path.stem,
        subtitle=f"inradius {triangle.inradius:.4g} mm, corner radius {triangle.r:g} mm",
        chips=[("ok", f"shortest: {LABELS[best.strategy]}, {best.length:.3f} mm")],
    )  # fmt: skip
