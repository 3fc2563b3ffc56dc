"""Raw stock of a job: one value that answers every engine.

Goal: nobody outside knows where a stock comes from, and no engine reads files.

1. A box, an upright cylinder, a closed triangle mesh, or the triangles of a STEP file with how far they are from it
   (`shapes.py`).
2. Each tells its box, signed distance, the crossings of upright lines, closed meshes around and inside of it, and the
   numbers that a solid is built of; the B-rep engine reads the faces of a STEP file itself.
3. Triangle files are read and refused in `files.py`.

| file | holds |
|---|---|
| `shapes.py` | `Blank`, `Stock`, `BoxStock`, `CylinderStock`, `MeshStock`, `StepStock`, `Triangles` |
| `files.py` | `read_mesh`, `closed_mesh`: triangles that enclose a solid, or what keeps them from it |
| `threemf.py` | `read_3mf`: triangles of a 3MF package, within limits |
| `_kernels.py` | distances to triangles and their crossings, in numba |

Source: signs of distances by angle-weighted pseudonormals (Baerentzen and Aanaes, IEEE TVCG 11 (2005) 243-253).

Known limits: distances and crossings of meshes look at every triangle near, without a tree.
"""

from vmachining.stock.files import closed_mesh, read_mesh
from vmachining.stock.shapes import Blank, BoxStock, CylinderStock, MeshStock, StepStock, Stock, Triangles

__all__ = [
    "Blank", "BoxStock", "CylinderStock", "MeshStock", "StepStock", "Stock", "Triangles", "closed_mesh", "read_mesh",
]  # fmt: skip
