"""Shaded views of bodies: the surface of a workpiece, the volume that one block sweeps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.report.paper.depth import view_frame, viewed
from vmachining.report.paper.style import RED, WIDTH_MM, canvas, look

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from vmachining.engines.protocol import StockSurface
    from vmachining.sweep import Sweep

__all__ = ["draw_surface", "draw_sweep"]

COARSE_MM = 0.05
"""A picture needs no finer facets."""

PLACES = 65
"""Of the tip path."""


def draw_surface(surface: StockSurface, *, width_mm: float = WIDTH_MM) -> Figure:
    """A workpiece seen from the front left above, to scale; see `vmachining.engines.protocol.StockSurface`."""
    return _view(surface.vertices, surface.triangles, None, width_mm)


def draw_sweep(sweep: Sweep, *, width_mm: float = WIDTH_MM) -> Figure:
    """The swept volume of one block as facets of 0.05 mm, with the path of the tool tip drawn over it."""
    from vmachining.engines.mesh import solid

    mesh = solid(sweep, chord=COARSE_MM, side="fair").to_mesh()
    corners = np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3]
    tip = np.array([sweep.path.position(float(t)) for t in np.linspace(0.0, 1.0, PLACES)])
    return _view(corners, np.asarray(mesh.tri_verts, dtype=np.int64), tip, width_mm)


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
