"""Dexels: the workpiece as intervals along rays in one direction or three, and removed volumes with a stated interval.

Goal: every tool, every motion and every stock at the price of a simulation, with an estimate and an honest interval for each
block, and a closed surface in the end.

1. Rays along z, or along z, x and y, one in every cell of a raster over the box of the stock. Within the cells they stand at
   places that rows and columns shift by multiples of irrational numbers, so that a wall along the raster meets rays at all
   distances: the error of a raster of rays at equal places would be the same for all of them.
2. A ray keeps the intervals of its material in flat arrays (`Lists`); each end knows the block that made it.
3. A block asks only rays with material in a prism around its sweep (`around.stadium`), and their neighbours. Where a ray is in
   the sweep is exact (`Sweep.ray_intervals`). What a ray loses is taken off its intervals: sums over a ray are exact.
4. Each direction gives a volume, the sum of lengths times the area of a cell, and half of an interval (`grid.look`):
   1.5 standard errors of random places + 3 cells of what is left beside the sweep. The standard error comes from squared
   differences of neighbouring rays; the second part represents what lies between rays that all of them miss.
5. Directions are three judges of one number with independent errors: the interval of a block is what they share, cut to the
   width of their weighted mean. Where they share nothing the interval is what any of them says.
6. The surface is a dual contour: signs of nodes by the upright rays, vertices on the planes through ends of rays (`contour`).

| file | holds |
|---|---|
| `engine.py` | `DexelEngine`: the protocol of all engines; `agreed` |
| `grid.py` | `RayGrid`: one direction; `look`: volume and interval of a block |
| `lattice.py` | `Lattice`, `Lists`: where rays stand, what is left of them |
| `around.py` | `stadium`: a prism around a sweep |
| `budget.py` | spacings: the default, and what memory allows |
| `batch/` | many straight blocks in one kernel call: upright rays as a map of heights, level ones by sections |
| `surface.py`, `contour/` | closed triangles |
| `_kernels.py` | loops over rays, in numba |
| `rays/` | `RayEngine`: rays without a workpiece, the second judge where tools turn or dip |
| `upright/` | `UprightJudge`: the second judge of a run of upright tools, by heights over random places |

Source: dexels after Van Hook (SIGGRAPH 1986); three directions after Benouamer and Michelucci (1997). Dual contouring after
Ju, Losasso, Schaefer, Warren (SIGGRAPH 2002), here with normals from neighbouring ends.
Departures: shifted rays, exact sweeps in place of poses or facets, an interval in place of a resolution.

Known limits: the interval is stated, not proven. What is thinner than the spacing in all directions can be missed; what is
thinner in one is seen by the others. The surface shows no feature below the spacing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vmachining.later import later

if TYPE_CHECKING:
    from vmachining.engines.dexel.engine import CONFIDENCE, DexelEngine
    from vmachining.engines.dexel.rays import RayEngine
    from vmachining.engines.dexel.upright import UprightJudge, Way

__all__ = ["CONFIDENCE", "DexelEngine", "RayEngine", "UprightJudge", "Way"]

__getattr__ = later(
    __name__, {"engine": "CONFIDENCE DexelEngine", "rays": "RayEngine", "upright": "UprightJudge Way"}
)
