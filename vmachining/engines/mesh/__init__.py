"""The mesh engine: stock minus sweeps with manifold3d, removed volume of every block with a proven bracket.

    engine = MeshEngine(box_stock((0, 0, -20), (100, 60, 0)), chord=0.01)
    removed = engine.cut(Sweep.along(cutter, Line((0, 30, -2), (100, 30, -2))), block=0)

1. A cutter becomes convex polyhedra, once inside and once around the truth; facets lie beside the heading, so
   walls along the motion are exact (`facets.py`).
2. A sweep is a few closed meshes: the hull of both ends of a straight motion in closed form, a revolved ring for
   level arcs, short hulls for helices and upright arcs (`solids.py`), marching cells in the parameters of the
   motion for a tool that turns (`turning/`).
3. The stock is halved into tiles where the cutter comes, so a block costs what its neighbourhood costs. A grid of
   heights over each tile leaves out the facets that pass above the material (`tiles.py`).
4. Two workpieces, cut by the inner and by the outer sweeps, hold the true one between them: four booleans per tile,
   and a bracket for any tool and motion by five lines of induction (`removal.py`).
5. Tiles are independent: several processes can cut one workpiece, each its own share of them. A half-cut workpiece can be saved
   (`checkpoint.py`).

| file | holds |
|---|---|
| `engine.py` | `MeshEngine`: cut, touch, volume, surface |
| `removal.py` | one sweep against one tile, and the proof |
| `tiles.py` | `Tile`, `reached`, `joined` |
| `window/` | what a tile lets a mesh see |
| `solids.py` | `solid`, `pieces`, `cutters`, `balance`: meshes of sweeps |
| `straight.py`, `curved.py` | cutters as facets on a straight way; arcs and helices |
| `facets.py` | meridians and polyhedra of cutters |
| `turning/` | meshes of five-axis sweeps |
| `stock.py` | `StockMesh`, `box_stock` |
| `checkpoint.py` | tiles on disk |
| `_kernels.py` | facets of straight sweeps |

Source: hulls of translated convex bodies as Minkowski sums; everything else is derived in the docstrings.

Measured (`docs/measured/cost.md`), 1 mm finishing blocks of a 10 mm ball at chord 0.01: some 11 ms a block in
one process, two thirds of it booleans: 0.2 ms each, 0.5 microseconds per triangle of the tile and 5 per triangle of
the cutter. A bracket is 9 % wide there.

Known limits: brackets of thin chips are wide; sums of blocks are far narrower, for what one block leaves to the next
one cancels. Chains of hulls make helices and upright arcs dear, and turning tools cost 0.2 to 0.5 s per block. The
joined surface can keep a slit of no width where two tiles met; its volume is right.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from vmachining.later import later

if TYPE_CHECKING:
    from vmachining.engines.mesh.engine import MeshEngine
    from vmachining.engines.mesh.solids import solid
    from vmachining.engines.mesh.stock import StockMesh, box_stock

__all__ = ["MeshEngine", "StockMesh", "box_stock", "solid"]

__getattr__ = later(__name__, {"engine": "MeshEngine", "solids": "solid", "stock": "StockMesh box_stock"})
