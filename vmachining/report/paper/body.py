"""Shaded views of bodies: the surface of a workpiece, the volume that one block sweeps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.report.paper.depth import SEEN_PX, VIEW, nearest_faces, view_frame, viewed
from vmachining.report.paper.style import BLUE, ORANGE, RED, WIDTH_MM, canvas, look, shades
from vmachining.sweep.regions import REGIONS, grazing_points, regions

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vmachining.engines.protocol import StockSurface
    from vmachining.sweep import Sweep

COARSE_MM = 0.05
"""A picture needs no finer facets."""

PLACES = 65
"""Of the tip path."""

TIMES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Fractions of a motion whose grazing curves are drawn unless others are requested."""

SHOWN = (BLUE, "#d9d9d9", ORANGE)
"""Colours of `REGIONS`."""

HIDDEN_PX = 4.0
"""A curve that lies this much deeper than what is seen is hidden: it lies on facets."""


def draw_surface(surface: StockSurface, *, width_mm: float = WIDTH_MM) -> Figure:
    """A workpiece seen from the front left above, to scale; see `vmachining.engines.protocol.StockSurface`."""
    return _view(surface.vertices, surface.triangles, None, width_mm)


def draw_sweep(sweep: Sweep, *, width_mm: float = WIDTH_MM) -> Figure:
    """The swept volume of one block as facets of 0.05 mm, with the path of the tool tip drawn over it."""
    corners, triangles = _facets(sweep)
    tip = np.array([sweep.path.position(float(t)) for t in np.linspace(0.0, 1.0, PLACES)])
    return _view(corners, triangles, tip, width_mm)


def draw_regions(sweep: Sweep, *, times: Sequence[float] = TIMES, width_mm: float = WIDTH_MM) -> Figure:
    """The swept volume from two sides: what the tool left behind at the start, its envelope, what leads at the end.

    times : in [0, 1] of the block, at which the grazing curve is drawn; dotted where the body hides it.
    """
    from matplotlib.colors import to_rgb
    from matplotlib.patches import Patch

    corners, triangles = _facets(sweep)
    facets = corners[triangles]
    of = regions(sweep, facets.mean(axis=1))
    area = 0.5 * np.linalg.norm(np.cross(facets[:, 1] - facets[:, 0], facets[:, 2] - facets[:, 0]), axis=1)
    paint = np.array([to_rgb(colour) for colour in SHOWN])
    curves = [(t, grazing_points(sweep, t)) for t in times]
    with look():
        figure = canvas(width_mm, 0.52 * width_mm)
        sides = figure.subplots(1, 2)
        for axes, toward, name in zip(
            sides, (VIEW, VIEW * [-1.0, -1.0, 1.0]), ("from the front", "from behind"), strict=True
        ):
            picture, box = viewed(corners, triangles, paint[of], toward)
            axes.imshow(picture, origin="lower", extent=box, interpolation="antialiased")
            _curves(axes, corners @ view_frame(toward).T, triangles, box, curves, view_frame(toward))
            axes.set(title=name)
            axes.set_axis_off()
        keys = [
            Patch(color=colour, label=f"{name}, {area[of == k].sum():.0f} mm²")
            for k, (name, colour) in enumerate(zip(REGIONS, SHOWN, strict=True))
        ]
        keys += sides[0].get_legend_handles_labels()[0]
        figure.legend(handles=keys, loc="outside lower center", ncols=4)
    return figure


def _curves(
    axes: Any, seen: Floats, triangles: Ints, box: tuple[float, ...], curves: Any, frame: Floats
) -> None:
    """Grazing curves, those in front of the body as lines."""
    pixel = max(box[1] - box[0], box[3] - box[2]) / SEEN_PX
    shape = int((box[3] - box[2]) / pixel) + 1, int((box[1] - box[0]) / pixel) + 1
    depth, _ = nearest_faces(seen, triangles, np.array([box[0], box[2]]), pixel, shape)
    for (t, branches), colour in zip(curves, shades(len(curves)), strict=True):
        for k, branch in enumerate(branches):
            x, y, z = (branch @ frame.T).T
            i = np.clip(((y - box[2]) / pixel).astype(int), 0, shape[0] - 1)
            j = np.clip(((x - box[0]) / pixel).astype(int), 0, shape[1] - 1)
            front = z > depth[i, j] - HIDDEN_PX * pixel
            label = f"curve at t = {t:.3g}" if k == 0 else None
            axes.plot(np.where(front, x, np.nan), y, color=colour, lw=1.3, label=label)
            axes.plot(np.where(front, np.nan, x), y, ":", color=colour, lw=0.7)


def _facets(sweep: Sweep) -> tuple[Floats, Ints]:
    from vmachining.engines.mesh import solid

    mesh = solid(sweep, chord=COARSE_MM, side="fair").to_mesh()
    corners = np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3]
    return corners, np.asarray(mesh.tri_verts, dtype=np.int64)


def _view(points: Floats, triangles: Ints, tip: Floats | None, width_mm: float) -> Figure:
    with look():
        picture, box = viewed(points, triangles)
        high = (box[3] - box[2]) / (box[1] - box[0])
        figure = canvas(width_mm, width_mm * min(high, 1.5))
        axes = figure.subplots()
        axes.imshow(picture, origin="lower", extent=box, interpolation="antialiased")
        if tip is not None:
            seen = tip @ view_frame().T
            axes.plot(seen[:, 0], seen[:, 1], color=RED, label="path of the tool tip")
            axes.legend(loc="lower right")
        axes.set_axis_off()
    return figure
