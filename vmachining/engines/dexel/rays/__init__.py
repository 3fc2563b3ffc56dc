"""Rays: removed volume of any block by exact upright rays, as an estimate and an interval of stated confidence.

Goal: an answer for any tool and motion that needs no solid and no mesh, and inherits nothing from the blocks before.

1. The stock is never cut. A block removes what lies in its sweep and the raw stock, and in no earlier sweep; which earlier
   ones matter is decided by distances (`sweep.near`).
2. `sweep.candidates` names the upright columns in which the block can take anything, proven by distances. No column: it
   removes nothing, and that is a bound.
3. Along an upright ray the lengths are exact: ends of a line in a sweep (`Sweep.ray_intervals`) and in the stock.
4. Rays stand at random in all columns, one in each cell of a raster (stratified), in `SETS` independent sets; in every second
   set a ray stands where a half turn brings its neighbour's, which cancels what slopes evenly. The spread of the sets tells how
   good their mean is.
5. A pilot of few rays says where they differ. Cells are divided, half of the rays by that, half by height, into as few
   parts as let expect the requested width; the answer is of the rays after the pilot alone, so that the choice does not
   lean on what it chose.
6. Interval: mean +- (t S + u + e). S is the standard error of the mean, t Student's quantile for `SETS` - 1 degrees of
   freedom; u is what may lie where no ray of any set stands; e is rounding. It holds the truth with probability
   `CONFIDENCE` at least, and is never called a bracket.

| file | holds |
|---|---|
| `engine.py` | `RayEngine`: the protocol of all engines |
| `lengths.py` | `material`: lengths along rays; `Cells`, and rays in pairs |
| `estimate.py` | `estimated`: pilot, rays, interval |

Source: stratified sampling with antithetic pairs (Hammersley and Handscomb, Monte Carlo Methods, 1964, 5.3 and 5.6); the
allocation by spread is Neyman's (1934).
Departures: rays are upright only. A wall along them shows as steps between cells, where the second choice of cells is finest.

Known limits: times grow with the number of earlier sweeps in the neighbourhood (about 2 us a ray and sweep). Thin skins on
upright walls have wide intervals. The workpiece as triangles is that of the grid of `DexelEngine`, without features below its
spacing.
"""

from vmachining.engines.dexel.rays.engine import RayEngine
from vmachining.engines.dexel.rays.estimate import CONFIDENCE

__all__ = ["CONFIDENCE", "RayEngine"]
