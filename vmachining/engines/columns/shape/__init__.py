"""The workpiece of columns as a closed surface.

1. Heights are known exactly anywhere. Where tiles keep sweeps, or the rim of a round stock crosses them, they are asked at the
   nodes of a lattice (`lattice.py`); elsewhere the top is level.
2. Where two sweeps meet along an edge of the lattice, a jump is looked for by bisection: a wall stands there (`walls.py`).
3. A cell without a wall is two triangles. Walls divide a cell along chords, over a point of the wall where it is curved or has a
   corner, over the junction where three meet.
4. Level cells that one block left are joined to squares, twice as large again and again; so is what no tool met, and the bottom.
   A square with finer neighbours takes their nodes and is a fan over its middle: the surface closes (`solid.py`).
5. Where a wall passes beside a node, triangles are slivers. The node slides in its plane away from the wall, or the short edge is
   closed up, where no face is left by more than a wall bulges between two nodes (`_kernels.py`).

The lattice does not begin at the corner of the stock, so that walls at round numbers do not run along its lines. Where a border
of a cut and one of the stock are the same to nine digits, nothing is left between them.

Known limits: what is thinner than a cell may be passed over, or end in it; the tip of a corner that ends between two nodes is
cut off. Between the nodes the surface is straight.
"""

from vmachining.engines.columns.shape.lattice import lattice_of
from vmachining.engines.columns.shape.solid import solid_of

__all__ = ["lattice_of", "solid_of"]
