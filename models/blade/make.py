"""Writes blade.csv and stock.stl: one side of a twisted blade, finished in five axes by a bull nose that leans forward.

See `benchmarks.modelfiles` for how to call it.

The stock is the faceted blade, raised by the allowance: the volume between them is the area in plan times the
allowance, exactly. The finished part lies between the design less the chord tolerance and the design with scallops and what
chords leave.
"""

from __future__ import annotations

import numpy as np

from benchmarks.modelfiles import finishing_bounds, write_model
from vmachining.arrays import Floats
from vmachining.toolpath.clpath import CLPath, pose_table
from vmachining.toolpath.facets import FacetMesh, Surface, five_axis_raster, height_field

LONG, HALF, BOTTOM = 16.0, 5.0, -8.0  # mm
CELL = 1.0  # mm, of the facets
CAMBER, TWIST = 1.0 / 25.0, 0.008  # 1/mm: curvature across, turn of the section along the blade
RADIUS, CORNER, LEAD = 4.0, 1.0, 8.0  # mm, degrees
SCALLOP, CHORD, ALLOWANCE = 0.02, 0.01, 0.4  # mm; the allowance along z


def height(x: Floats, y: Floats) -> Floats:
    """mm of the blade."""
    return np.asarray(-0.5 * CAMBER * y**2 + TWIST * (x - LONG / 2.0) * y)


def design(raised: float = 0.0, bottom: float | None = None) -> FacetMesh:
    """The side of the blade that is up, or a solid below it."""
    x, y = (
        np.linspace(0.0, LONG, round(LONG / CELL) + 1),
        np.linspace(-HALF, HALF, round(2 * HALF / CELL) + 1),
    )
    return height_field(x, y, height(x[:, None], y) + raised, bottom=bottom)


def stock() -> FacetMesh:
    """The solid that is finished."""
    return design(ALLOWANCE, BOTTOM)


def path() -> CLPath:
    """Passes along the blade."""
    return five_axis_raster(
        Surface(design()), RADIUS, CORNER, chord=CHORD, scallop=SCALLOP, lead_deg=LEAD, tilt_limit_deg=20.0
    )


def program() -> str:
    """The text of blade.csv, dialect poses."""
    return pose_table(path(), feed_mm_min=1000.0)


def part_volume() -> float:
    """mm^3 of part.step: twist adds nothing."""
    return LONG * (2 * HALF * -BOTTOM - CAMBER * HALF**3 / 3)


def volume_bounds() -> tuple[float, float]:
    """mm^3 removed."""
    flattest = float(design().normals[:, 2].min())
    return finishing_bounds(LONG * 2 * HALF, flattest, allowance=ALLOWANCE, scallop=SCALLOP, chord=CHORD)


def table() -> str:
    """The known truths."""
    return "between {:.3f} and {:.3f} mm^3".format(*volume_bounds())


if __name__ == "__main__":
    write_model(__file__, lambda: {"blade.csv": program(), "stock.stl": stock()}, table)
