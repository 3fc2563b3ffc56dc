"""Picture of one sweep: the swept solid, and the way of the tool tip."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vmachining.engines.mesh import solid
from vmachining.report.figures import write_page
from vmachining.report.scene import Layer, Scene
from vmachining.sweep import Sweep
from vmachining.tolerance import CHORD_MM

PLACES = 33
"""Of the tip path."""

COARSE_MM = 0.05
"""A picture needs no finer facets."""


def plot_sweep(path: Path, sweep: Sweep, chord: float = CHORD_MM) -> None:
    """Write the picture as one HTML file that opens offline.

    chord : mm, of the facets; not finer than a picture shows.
    """
    chord = max(chord, COARSE_MM)
    mesh = solid(sweep, chord=chord, side="fair").to_mesh()
    corners = np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3]
    tip = np.array([sweep.path.position(float(t)) for t in np.linspace(0.0, 1.0, PLACES)])
    layers = [Layer(name="swept solid", points=corners, triangles=np.asarray(mesh.tri_verts), colour="#8fb1d0", opacity=0.75),
              Layer(name="tip of the tool", points=tip, colour="#b3261e")]  # fmt: skip
    write_page(
        path, [], kind="sweep", name=path.stem, subtitle=f"facets within {chord:g} mm · all lengths in mm",
        scene=Scene(title="Swept solid", words="The solid that the tool sweeps, and the path of its tip", layers=layers),
    )  # fmt: skip
