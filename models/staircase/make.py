"""Writes staircase.nc: a cylinder roughed in stairs by a flat end mill, semi-finished by a ball that cuts them.

python models/staircase/make.py             writes the program beside this file
python models/staircase/make.py --table     prints the volume of every pass

All passes run along x, straight through the bar. What a pass removes is its length in the bar times the area between the section
of the bar and the outline of the cutter; sections are functions of y, and a pass takes the smaller one.
"""

from __future__ import annotations

from itertools import pairwise
from math import asin, ceil, floor, sqrt

import numpy as np

from benchmarks.modelfiles import write_model
from vmachining.toolpath.clpath import CLPath, iso_program
from vmachining.toolpath.facets import Surface, height_field, raster

CYLINDER, HALF, LONG = 40.0, 15.0, 60.0  # mm, radius of the design, half width and length of the bar
TOP, LOW = 1.0, -15.0  # mm, of the bar above the crest of the design, which is z = 0; its bottom
BEYOND = 8.0  # mm, the passes continue outside the bar
FLAT, BALL = 3.0, 5.0  # mm, radii
ROUGH, SEMI = 0.5, 0.2  # mm, allowance normal to the design behind roughing and semi-finish
STEP, SCALLOP, CHORD = 3.0, 0.05, 0.002  # mm
CUTS = 1000  # samples between two neighbouring breaks of the section


def design(allowance: float) -> Surface:
    """The cylinder, allowance above the design; chords of at most 1e-4 mm sagitta."""
    y = np.linspace(-HALF, HALF, 361)
    z = np.sqrt((CYLINDER + allowance) ** 2 - y**2) - CYLINDER
    return Surface(height_field([-BEYOND, LONG + BEYOND], y, np.stack([z, z])))


def paths() -> list[tuple[int, float, CLPath]]:
    """Tool, its radius if it is a ball, and path."""
    rough = raster(design(ROUGH), FLAT, 0.0, chord=CHORD, step=STEP)
    semi = raster(design(SEMI), BALL, BALL, chord=CHORD, scallop=SCALLOP)
    return [(1, 0.0, rough.path), (2, BALL, semi.path)]


def program() -> str:
    """The text of staircase.nc."""
    texts = [
        iso_program(
            path, feed_mm_min=1200.0, tool=tool, title="STAIRCASE, ROUGHED" if tool == 1 else "SEMI-FINISH"
        )
        for tool, _, path in paths()
    ]
    return texts[0].removesuffix("M2\n") + texts[1]


def passes() -> list[tuple[int, float, float, float]]:
    """(tool, y, z, volume in mm^3) of every pass through the bar, in order; coordinates as they are written."""
    lanes = []
    for tool, ball, path in paths():
        tips = np.round(path.tips, 5)
        through = np.flatnonzero(np.abs(np.diff(tips[:, 0])) > LONG)
        lanes += [(tool, ball, *tips[k, 1:].tolist()) for k in through]
    y, weight = _samples(lanes)
    section = np.full(len(y), TOP)
    out = []
    for tool, ball, at, z in lanes:
        off = np.abs(y - at)
        under = ball - np.sqrt(np.maximum(ball**2 - off**2, 0.0)) if ball else np.zeros(len(y))
        new = np.where(off < (ball or FLAT), np.minimum(section, z + under), section)
        out.append((tool, at, z, LONG * float(((section - new) * weight).sum())))
        section = new
    return out


def _samples(lanes: list[tuple[int, float, float, float]]) -> tuple[np.ndarray, np.ndarray]:
    """Middles and widths of cells of y with breaks at all edges of cutters."""
    edges = [at + side * (ball or FLAT) for _, ball, at, _ in lanes for side in (-1.0, 1.0)]
    breaks = np.unique([-HALF, HALF, *(e for e in edges if -HALF < e < HALF)])
    ends = np.concatenate([np.linspace(a, b, CUTS + 1)[:-1] for a, b in pairwise(breaks)] + [[HALF]])
    return 0.5 * (ends[1:] + ends[:-1]), np.diff(ends)


def part_volume() -> float:
    """mm^3 of part.step: a circle over a chord, above the bottom of the bar."""
    circle = HALF * sqrt(CYLINDER**2 - HALF**2) + CYLINDER**2 * asin(HALF / CYLINDER)
    return LONG * (circle - 2 * HALF * (CYLINDER + LOW))


def volume_bounds() -> tuple[float, float]:
    """mm^3 removed, from the two sections that the finished one lies between: the offset design, and the scallops above it."""
    y = np.linspace(-HALF, HALF, 200_001)
    z = np.sqrt((CYLINDER + SEMI) ** 2 - y**2) - CYLINDER
    full = LONG * float(np.trapezoid(TOP - z, y))
    slack = LONG * 2 * HALF / np.sqrt(1 - (HALF / CYLINDER) ** 2)
    return floor(full - slack * (SCALLOP + 2 * CHORD)), ceil(full + slack * CHORD)


def table() -> str:
    """The known truths."""
    found = passes()
    rows = [f"T{tool}  Y {y:9.4f}  Z {z:9.4f}  {volume:12.4f}" for tool, y, z, volume in found]
    return "\n".join([*rows, f"total {sum(row[3] for row in found):.3f} mm^3, between {volume_bounds()}"])


if __name__ == "__main__":
    write_model(__file__, lambda: {"staircase.nc": program()}, table)
