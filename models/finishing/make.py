"""Writes finishing.nc and stock.stl: a sculptured surface with an allowance, finished by a ball in parallel passes.

See `benchmarks.modelfiles` for how to call it.

The stock is the faceted design, raised by the allowance: the volume between them is the area in plan times the
allowance, exactly. The finished part lies between the design less the chord tolerance and the design with scallops and what
chords leave.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from benchmarks.modelfiles import finishing_bounds, write_model
from vmachining.arrays import Floats
from vmachining.toolpath.clpath import CLPath, iso_program
from vmachining.toolpath.facets import FacetMesh, Surface, height_field, raster

WIDE, LONG, BOTTOM = 18.0, 12.0, -12.0  # mm
CELL = 0.75  # mm, of the facets
BALL, SCALLOP, CHORD, ALLOWANCE = 3.0, 0.02, 0.01, 0.4  # mm; the allowance along z


def height(x: Floats, y: Floats) -> Floats:
    """mm of the design."""
    return np.asarray(2.5 * np.sin(x / 6.0) * np.cos(y / 8.0) + 0.01 * (x - y) ** 2 / 4.0)


def design(raised: float = 0.0, bottom: float | None = None) -> FacetMesh:
    """The surface, or a solid below it."""
    x, y = (np.linspace(0.0, side, round(side / CELL) + 1) for side in (WIDE, LONG))
    return height_field(x, y, height(x[:, None], y) + raised, bottom=bottom)


def stock() -> FacetMesh:
    """The solid that is finished."""
    return design(ALLOWANCE, BOTTOM)


def path() -> CLPath:
    """Passes along x."""
    return raster(Surface(design()), BALL, BALL, chord=CHORD, scallop=SCALLOP).path


def program() -> str:
    """The text of finishing.nc."""
    return iso_program(
        path(), feed_mm_min=1500.0, spindle_rev_min=12000.0, title="FINISHING, BALL D6, SCALLOP 0.02"
    )


def part_volume() -> float:
    """mm^3 of part.step."""
    waves = 2.5 * 6.0 * (1 - cos(WIDE / 6.0)) * 8.0 * sin(LONG / 8.0)
    valley = WIDE**3 * LONG / 3 - WIDE**2 * LONG**2 / 2 + WIDE * LONG**3 / 3
    return waves + 0.0025 * valley - BOTTOM * WIDE * LONG


def volume_bounds() -> tuple[float, float]:
    """mm^3 removed."""
    flattest = float(design().normals[:, 2].min())
    return finishing_bounds(WIDE * LONG, flattest, allowance=ALLOWANCE, scallop=SCALLOP, chord=CHORD)


def table() -> str:
    """The known truths."""
    return "between {:.3f} and {:.3f} mm^3".format(*volume_bounds())


if __name__ == "__main__":
    write_model(__file__, lambda: {"finishing.nc": program(), "stock.stl": stock()}, table)
