"""The columns engine: proven removed volumes of three-axis blocks, looking along the tool axis.

    engine = ColumnsEngine(FlatStock((0, 0, -20), (100, 60, 0)), width=0.01)
    lo, estimate, hi, *_ = engine.cut(Sweep.along(cutter, Line((0, 30, -2), (100, 30, -2))))

Goal: a bracket that holds the truth, rounding included, as narrow as requested, at the price of a simulation.

1. A convex cutter with upright axis that moves in a straight line sweeps, with all that lies above it, a convex body:
   its lower surface f is a convex function on a convex footprint (`surface/`).
2. Block k removes the integral of max(0, min(top, f_1 .. f_{k-1}) - max(f_k, bottom)): no state, only a list of sweeps.
3. On a rectangle of the plan, tangent planes bound f from below, values at corners from above, second derivatives both;
   borders of footprints are cut off along chords and outer tangents (`cells/`).
4. The rectangle whose bracket is widest is divided into four, until the block is as narrow as requested (`_kernels.py`).
5. Tiles keep the sweeps that may still be lowest in them: time and memory do not grow with the program.
6. Arcs and helices are chords that a shrunk and a grown cutter follow, one for each cell.

| file | holds |
|---|---|
| `engine.py`, `goal.py`, `rounding.py` | `ColumnsEngine`: cut, touch, surface, checkpoints; requested width, rounding |
| `flat_stock.py`, `roof/`, `shape/` | stocks that columns know, facets of their top, the workpiece as closed triangles |
| `cutters.py`, `table.py` | lower surfaces of profiles, grown and shrunk cutters, by number |
| `tiles.py` | `Tiling`: lists of sweeps and facets by tiles |
| `paths.py`, `arcs/` | pieces of arcs, and their chord for one cell |
| `surface/`, `sides.py` | f, its tangent planes and second derivatives; what is known of surfaces in a cell, rules in force |
| `patches/`, `moments/`, `smooth/`, `polygons/`, `closed/` | closed integrals over one cell |
| `cells/`, `heap/`, `_kernels.py` | bounds in one cell, cells of a block, lists of tiles |
| `turning/` | columns in any direction, for axes that lean or turn |

Source: derived in `docs/columns.md`, rule by rule. Departure: second derivatives are bounded for any profile of lines and arcs.

Known limits: convex cutters, upright axis, stocks with level bottom on which nothing hangs over; a sweep whose own top dips below
that of the stock is refused. Ramps steeper than 1e4 are bounded by plunges. Over a seam between facets, and over an outline
that turns in a cell, bounds are of first order.
"""

from vmachining.engines.columns.engine import ColumnsEngine
from vmachining.engines.columns.flat_stock import FlatStock

__all__ = ["ColumnsEngine", "FlatStock"]
