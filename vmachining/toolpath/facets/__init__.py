"""CAM on faceted models: from an STL to tool paths that do not gouge it.

| file | holds |
|---|---|
| `stl.py` | `read_stl`: binary and ASCII, strictly |
| `mesh.py` | `FacetMesh`: shared vertices, neighbours, normals at vertices and edges, complaints; `height_field` |
| `cloud.py` | `read_cloud`: measured points as a surface |
| `drop.py`, `_kernels.py` | `Surface`: heights, drop cutter |
| `passes.py` | `raster`: parallel passes in three axes, by scallop or step, within a chord tolerance |
| `ridges.py` | `cl_points`: CC point to CL point with lead and tilt; what two passes leave between them, `scallop_step` |
| `fiveaxis.py` | `five_axis_raster`: passes with lead and tilt, free of interference; `normals_at` |
| `levels.py` | `push_cutter`, `waterline`, `waterline_path`: closed loops at a height |

Source: spec D. Contacts are candidates in closed form per triangle (facet, edges with their ends), the highest counts;
only the edge of a bull nose is a root, found by Newton's method in a bracket. A tree of boxes and the bound of each
triangle's plane leave a few triangles to ask.
"""

from vmachining.toolpath.facets.cloud import read_cloud
from vmachining.toolpath.facets.drop import Contact, Surface, radii
from vmachining.toolpath.facets.fiveaxis import five_axis_raster, normals_at
from vmachining.toolpath.facets.levels import push_cutter, waterline, waterline_path
from vmachining.toolpath.facets.mesh import FacetMesh, edge_normal, height_field
from vmachining.toolpath.facets.passes import raster
from vmachining.toolpath.facets.ridges import cl_points, leaning_ridges, scallop_step, upright_ridges
from vmachining.toolpath.facets.stl import read_stl

__all__ = [
    "Contact", "FacetMesh", "Surface", "cl_points", "edge_normal", "five_axis_raster", "height_field",
    "leaning_ridges", "normals_at", "push_cutter", "radii", "raster", "read_cloud", "read_stl", "scallop_step",
    "upright_ridges", "waterline", "waterline_path",
]  # fmt: skip
