"""The columns engine: proven removed volumes of three-axis blocks, looking along the tool axis.

    engine = ColumnsEngine(FlatStock((0, 0, -20), (100, 60, 0)), width=0.01)
    lo, estimate, hi, *_ = engine.cut(Sweep.along(cutter, Line((0, 30, -2), (100, 30, -2))))

Goal: a bracket that holds the truth, rounding included, as narrow as requested, at the price of a simulation.

1. A convex cutter with upright axis that moves in a straight line sweeps, with all that lies above it, a convex body:
   its lower surface f is a convex function on a convex footprint (`surface/`).
2. What block k removes is the integral of max(0, min(top, f_1 .. f_{k-1}) - max(f_k, bottom)): no state is needed, only
   the list of sweeps that may be lowest.
3. On a rectangle of the plan, tangent planes bound f from below, values at corners from above, second derivatives both;
   borders of footprints are cut off along chords and outer tangents (`cells/`).
4. The rectangle whose bracket is widest is divided into four, until the block is as narrow as requested (`_kernels.py`).
5. Tiles keep the sweeps that may still be lowest in them (`tiles.py`): time and memory do not grow with the program.
6. Arcs and helices about any coordinate direction are chords that a shrunk and a grown cutter follow, one for each cell
   (`arcs/`, `paths.py`, `cutters.py`).

| file | holds |
|---|---|
| `engine.py` | `ColumnsEngine`: cut, touch, surface, checkpoints |
| `flat_stock.py` | `FlatStock`: stocks that columns know |
| `cutters.py` | lower surfaces of profiles, grown and shrunk cutters, which cutter lies in which |
| `table.py` | `CutterTable`: the cutters of a job by number |
| `tiles.py` | `Tiling`: lists of sweeps and facets by tiles |
| `paths.py` | `pieces` of arcs |
| `goal.py` | how narrow a bracket is requested, of a block and of a share of it |
| `shape/` | the workpiece as closed triangles over a lattice |
| `roof/` | facets of the top and edges of the outline of a stock, by tiles |
| `store.py` | profiles and paths as arrays |
| `surface/` | f, its tangent planes and second derivatives, the cover rule, in numba |
| `patches/`, `moments/` | volume over a sweep in one cell in closed form, in numba |
| `arcs/` | the chord of an arc for one cell, in numba |
| `sides.py` | what is known of surfaces in a cell, rules in force |
| `smooth/`, `polygons/`, `closed/` | bounds of smooth surfaces, of planes and chords, by closed integrals, in numba |
| `cells/` | bounds in one cell, in numba |
| `_kernels.py` | heap of cells, lists of tiles, in numba |

Source: derived in `docs/columns.md`, rule by rule. Departures: second derivatives are bounded for any profile of lines
and arcs, not for balls alone.

Known limits: convex cutters, upright axis, stocks with level bottom on which nothing hangs
over; a sweep whose own top dips below
the top of the stock is refused, even where nothing is left there. Ramps steeper than 1e4 are bounded by plunges and stay
as wide as that makes them. Over a seam between facets, and over an outline that turns
in a cell, bounds are of first order. The surface of a stock of facets is cut off by the mesh engine.
"""

from vmachining.engines.columns.engine import ColumnsEngine
from vmachining.engines.columns.flat_stock import FlatStock

__all__ = ["ColumnsEngine", "FlatStock"]
