"""Writes impeller.csv and stock.stl: the channel between two blades of an impeller, finished in five axes by a ball.

See `benchmarks.modelfiles` for how to call it. The channel bends, rises and has walls of 61 degrees.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import dblquad

from benchmarks.modelfiles import write_model
from vmachining.arrays import Floats
from vmachining.toolpath.clpath import CLPath, pose_table
from vmachining.toolpath.facets import FacetMesh, Surface, five_axis_raster, height_field

LONG, HALF, BOTTOM = 8.0, 5.0, -10.0  # mm
CELL = 0.5  # mm, of the facets
DEEP, HUB, BEND = 4.0, 3.6, 0.015  # mm depth of the channel, mm half its width, 1/mm
RADIUS, LEAD, SCALLOP, CHORD, ALLOWANCE = 2.0, 5.0, 0.2, 0.08, 0.8  # mm, degrees; the allowance along z


def height(x: Floats, y: Floats) -> Floats:
    """mm of the design."""
    across = (y - BEND * (x - LONG / 2.0) ** 2 + 0.4) / HUB
    return np.asarray(0.12 * x - DEEP * np.exp(-(across**4)))


def design(raised: float = 0.0, bottom: float | None = None) -> FacetMesh:
    """Floor and walls, or a solid below them."""
    x, y = (np.linspace(a, b, round((b - a) / CELL) + 1) for a, b in ((0.0, LONG), (-HALF, HALF)))
    return height_field(x, y, height(x[:, None], y) + raised, bottom=bottom)


def path() -> CLPath:
    """Passes along the channel; the tool leans sideways where a wall is in its way."""
    return five_axis_raster(
        Surface(design()), RADIUS, RADIUS, chord=CHORD, scallop=SCALLOP, lead_deg=LEAD, tilt_limit_deg=30.0
    )


def program() -> str:
    """The text of impeller.csv, dialect poses."""
    return pose_table(path(), feed_mm_min=1200.0)


def part_volume() -> float:
    """mm^3 of the part, by quadrature."""
    above, _ = dblquad(
        lambda y, x: float(height(np.float64(x), np.float64(y))), 0.0, LONG, -HALF, HALF, epsabs=1e-7
    )
    return float(above) - BOTTOM * LONG * 2 * HALF


def volume_bounds() -> tuple[float, float]:
    """mm^3 removed: the layer of the allowance, less what may stay, more what may be cut too deep."""
    plan, surface = LONG * 2 * HALF, float(design().areas.sum())
    return plan * ALLOWANCE - (SCALLOP + 2 * CHORD) * surface, plan * ALLOWANCE + CHORD * surface


def table() -> str:
    """The known truths."""
    return "between {:.3f} and {:.3f} mm^3".format(*volume_bounds())


if __name__ == "__main__":
    write_model(__file__, lambda: {"impeller.csv": program(), "stock.stl": design(ALLOWANCE, BOTTOM)}, table)
