"""Triangular pockets as a page: the path of each strategy, and which is shortest over the shape of the triangle."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import radians, sin
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from vmachining.arrays import Floats
from vmachining.report.figures import Panel, html_name, picture, write_page
from vmachining.report.paper.style import BLUE, GREEN, GREY, ORANGE, RED, VIOLET, WIDTH_MM, canvas, look
from vmachining.toolpath import (
    STRATEGIES,
    Pocket,
    Triangle,
    bare_path,
    coverage_shapes,
    needs_centre,
    path_length,
    pocket_path,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS = dict(zip(STRATEGIES, (GREY, BLUE, RED, GREEN), strict=True))
LABELS = {
    "dp": "direction parallel", "dpi": "direction parallel, improved",
    "cp": "contour parallel", "cpi": "contour parallel, improved",
    "lines": "lines alone", "loops": "loops 2r apart alone",
}  # fmt: skip
SHADED = ((ORANGE, "///", "uncut"), (VIOLET, "xxx", "gouged"))
BARE = ("lines", "loops")
PLACES = ("lines", "dp", "dpi", "loops", "cp", "cpi")
SEEN_MM2 = 0.01
"""Areas below come from polygons in place of discs."""

STEP_DEG = 2.0


def rings(shape: BaseGeometry) -> list[Floats]:
    """Outlines (n, 2) mm of the parts of an area, holes after their part."""
    parts = [
        part for part in getattr(shape, "geoms", [shape]) if isinstance(part, Polygon) and not part.is_empty
    ]
    return [np.asarray(ring.coords) for part in parts for ring in (part.exterior, *part.interiors)]


def draw_pockets(triangle: Triangle, pockets: Sequence[Pocket], *, width_mm: float = WIDTH_MM) -> Figure:
    """The path of each strategy, what it leaves of the pocket and what it cuts beyond it shaded; first lines and loops alone."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    wall = triangle.wall()
    length = {pocket.strategy: pocket.length for pocket in pockets}
    path = {pocket.strategy: pocket.path for pocket in pockets} | {
        bare: bare_path(triangle, bare) for bare in BARE
    }
    length |= {bare: path_length(path[bare]) for bare in BARE}
    with look():
        wide, tall = np.ptp(wall[:, :2], axis=0)
        figure = canvas(width_mm, 2.0 * (0.3 * width_mm * tall / wide + 13.0) + 6.0)
        for axes, name in zip(figure.subplots(2, 3, sharex=True, sharey=True).flat, PLACES, strict=True):
            axes.fill(*wall[:, :2].T, color="#f3f4f6", zorder=0)
            axes.plot(*wall[:, :2].T, color="black", lw=1.0)
            axes.plot(*path[name].T, ".-", ms=2.5, lw=0.8, color=COLOURS.get(name, "black"))
            words = []
            shapes = coverage_shapes(triangle, path[name])
            for shape, (colour, hatch, what) in zip(shapes, SHADED, strict=True):
                seen = shape.area > SEEN_MM2
                words.append(f"{what} {shape.area if seen else 0.0:.3g} mm²")
                if seen:
                    outline = Outline.make_compound_path(
                        *(Outline(ring, closed=True) for ring in rings(shape))
                    )
                    axes.add_patch(PathPatch(outline, fc=colour, ec="black", lw=0.3, hatch=hatch, zorder=3))
            axes.set_title(f"{LABELS[name]}\n{length[name]:.1f} mm, {', '.join(words)}", fontsize=6.5)
            axes.set_aspect("equal")
            axes.label_outer()
        figure.supxlabel("x (mm)", fontsize=8.0)
        figure.supylabel("y (mm)", fontsize=8.0)
    return figure


def draw_shortest(share: float) -> Figure:
    """Which strategy is shortest over the angles at the base. share : radius of the cutter over the inradius of the pocket."""
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    order, angles = list(STRATEGIES), np.arange(STEP_DEG, 90.0, STEP_DEG)
    index = np.full((len(angles), len(angles)), np.nan)  # where the base would not be the longest side, too
    for (row, gamma), (column, beta) in product(enumerate(angles), enumerate(angles)):
        alpha = 180.0 - beta - gamma
        if alpha >= max(beta, gamma):
            a, b, c = (100.0 * sin(radians(v)) for v in (alpha, beta, gamma))
            t = Triangle.of(a, b, c, share * Triangle.of(a, b, c, 1e-9).inradius)
            lengths = [path_length(pocket_path(t, s, centre=needs_centre(t))) for s in order]
            index[row, column] = int(np.argmin(lengths))
    with look():
        figure = canvas(120.0, 108.0)
        axes = figure.subplots()
        colours = ListedColormap(list(COLOURS.values()))
        axes.pcolormesh(angles, angles, index, cmap=colours, vmin=-0.5, vmax=3.5)
        axes.set(xlabel="angle at the left end of the base, β (°)", ylabel="angle at the right end, γ (°)")
        axes.set_aspect("equal")
        met = [name for k, name in enumerate(order) if (index == k).any()]
        figure.legend(handles=[Patch(color=COLOURS[name], label=LABELS[name]) for name in met],
                      loc="outside upper center", ncols=2)  # fmt: skip
    return figure


def write_pocket_page(triangle: Triangle, pockets: Sequence[Pocket], path: Path) -> None:
    """One self-contained HTML page.

    Raises InputError: The name does not end in .html.
    """
    share = triangle.r / triangle.inradius
    with look():
        paths = picture(draw_pockets(triangle, pockets), "The path of each strategy in the triangle")
        words = "Which strategy is shortest over the angles of the triangle"
        shapes = picture(draw_shortest(share), words, kind="png")
    best = min(pockets, key=lambda pocket: pocket.length)
    write_page(
        html_name(path, "--plot"),
        [Panel(title="Paths", svg=paths),
         Panel(title=f"Shortest strategy over the shape of the triangle, radius {share:.2f} of the inradius", svg=shapes)],
        kind="triangular pocket", name=path.stem,
        subtitle=f"inradius {triangle.inradius:.4g} mm, corner radius {triangle.r:g} mm",
        chips=[("ok", f"shortest: {LABELS[best.strategy]}, {best.length:.3f} mm")],
    )  # fmt: skip
