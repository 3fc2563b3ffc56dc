"""Discrete vectors: how far the workpiece is from the part, along vectors that stand on the part (DVV, DNV, hybrid).

Goal: overcut and undercut of a program with position, depth and block, at a density that follows from the error asked for.

1. A vector (C, N, L) starts at C on the part, points along N, and L is its length to the workpiece: L > 0 material is left,
   L < 0 too much is taken. It ends below at lambda < 0, where it leaves the part or at the deepest overcut that is measured.
2. Upright vectors (DVV) stand on a square grid of pitch gamma; only L is kept. Vectors along normals (DNV) stand on features
   at spacing delta: walls steeper than theta_V, overhangs, sharp edges. The hybrid has both, and where a facet carries
   normal vectors the upright ones are not reported; elsewhere the deviation is L cos(theta).
3. gamma, delta and theta_V follow from errors (`accuracy`).
4. Each block shortens the vectors whose lines enter its sweep from the side of their tips. Sweeps are exact: closed forms
   for ball cutters on lines, `Sweep.ray_intervals` for all others.
5. The block that made a length is computed again for the vectors that are reported.

| file | holds |
|---|---|
| `engine.py` | `VectorEngine`: the protocol of all engines |
| `accuracy.py` | spacings and angles, equations (4-1) to (4-5) |
| `part.py` | `DesignPart`, `features`, points on facets and edges |
| `upright.py` | `UprightVectors`: the grid, in tiles |
| `along.py` | `NormalVectors` on lattices over facets and edges, and lambda and L before the first cut |
| `cuts.py` | `Cuts`: the sweeps so far, and which of them made a length |
| `deviation.py` | `Deviation`: what is reported |
| `budget.py` | memory, before there are vectors |
| `surface.py` | the workpiece for pictures |
| `_kernels.py` | heights and rays of the part, in numba |
| `grid/`, `lattice/` | blocks one after the other against upright vectors and against those along normals, many in one call |

Source: discrete vectors after Park et al. (2005), with the corrections of the errata E-1 to E-12.
Departures: exact sweeps of the whole cutter instead of facets of a ball; lambda is measured in the part; a vector that
lies in a sweep from lambda to its tip is *consumed*, one that is entered through lambda is *entered from behind*.

Known limits: upright vectors see the highest surface of part and stock, so volumes per block are intervals of no stated
confidence ("not proven"); where material stays above a cut, and for later cuts there, they are 0 to the most that it can
take (`UprightVectors.is_blind`). Lengths do not depend on the order of blocks but
where vectors are entered from behind. Lengths are rounded to float32: half an ulp, 1.5e-5 mm at 340 mm. Deviations of
upright vectors are of first order in the slope.
"""

from vmachining.engines.settings import VectorSettings
from vmachining.engines.vectors.accuracy import (
    grid_pitch,
    representation_spacing,
    simulation_spacing,
    spacing_for,
    wall_angle,
)
from vmachining.engines.vectors.along import NormalVectors
from vmachining.engines.vectors.engine import VectorEngine
from vmachining.engines.vectors.part import features
from vmachining.engines.vectors.upright import UprightVectors

__all__ = [
    "NormalVectors", "UprightVectors", "VectorEngine", "VectorSettings", "features", "grid_pitch",
    "representation_spacing", "simulation_spacing", "spacing_for", "wall_angle",
]  # fmt: skip
