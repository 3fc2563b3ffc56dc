"""CAM on faceted models: from an STL to tool paths that do not gouge it.

| file | holds |
|---|---|
| `stl.py` | `read_stl`: binary and ASCII, strictly |
| `mesh.py` | `FacetMesh`: shared vertices, neighbours, normals at vertices and edges, complaints |
| `drop.py`, `_kernels.py` | `Surface`: heights, drop cutter |
| `contact.py` | `cl_points`: CC point to CL point with lead and tilt; `scallop_step` |

Source: spec D. Contacts are candidates in closed form per triangle (facet, edges with their ends), the highest counts;
only the edge of a bull nose is a root, found by Newton's method in a bracket. A tree of boxes and the bound of each
triangle's plane leave a few triangles to ask.
"""

from vmachining.toolpath.facets.contact import Located, cl_points, scallop_step
from vmachining.toolpath.facets.drop import Contact, Dropped, Surface, radii
from vmachining.toolpath.facets.mesh import FacetMesh, Weights, edge_normal
from vmachining.toolpath.facets.stl import Facets, read_stl

__all__ = [
    "Contact",
    "Dropped",
    "FacetMesh",
    "Facets",
    "Located",
    "Surface",
    "Weights",
    "cl_points",
    "edge_normal",
    "radii",
    "read_stl",
    "scallop_step",
]
