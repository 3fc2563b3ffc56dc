"""What inner facets leave of the material they should have removed, bounded in advance.

Let S be the true workpiece and A the one cut by inner sweeps V < W so far. A holds S. With a = vol(A and V) the
volume that a block takes from A, the true removal is, exactly,

    vol(S and W) = a + vol(S and (W - V)) - vol((A - S) and V)                                       (1)

since S and W is what A and V has without A - S, and what S has between V and W. Both corrections are layers
under facets, and both are bounded without a boolean:

1. W - V is covered by frustums: V = conv(K, K + d) is star-shaped about an inner point, so a point of W - V lies
   in the cone from there over one facet of V, beyond its plane by at most h_W(n) - h_V(n), the difference of the
   supports in direction of its normal n, in closed form for a body of revolution. A frustum of thickness g over
   an area F whose plane is h away from the point has g F (1 + g/h + g^2/(3 h^2)). The surface is mostly lower: with
   the gap G along the normal (`vmachining.engines.mesh.gap`) below tangents of slope m, it is along the lines from
   the point at most their height divided by 1 - m l/h, l the distance of the facet from the foot of the point,
   along the slope. Hence at most (1 + g/h)^2 / (1 - m l/h) times the integral of the tangents. (Those of K + d
   bound W if all face the way that the facet does; at silhouettes g has to do.)
2. Of these only what the roof of A lets be seen can hold material. Facets behind a start that the tool came to
   in the block before are not counted: what lies beyond them and inside W is in the pose of the start, which is
   no part of S any more. (Let n be the outward normal of the true cutter under such a facet, n . d <= 0. A point
   x beyond it and outside of K that K + t d reaches has x - t d in K, so n . (x - z) <= t n . d <= 0 with z on the
   surface under x: x is not beyond it. Under a sharp edge to a facet that is counted, the surface of the other
   side can be the one: there a strip of the facet stays.)
3. The seen frustums of all blocks hold A - S: what a block adds to A - S is A and (W - V). A frustum wholly
   inside a later V has left A, and leaves the store. The third term of (1) is at most the volume of the stored
   frustums that meet W.

4. Where the cutter starts in a place K(p) that the cut before has left, the rear may be missing from the mesh:
   what V then lacks lies in K(p), no part of S, so (1) holds, and adds nothing to A - S. But places are forgotten
   that lie in V, so A must be free of what is missing. It is if the mesh of the cutter at p is the one that the
   cut before removed there (same heading), and that cut left nothing of its own mesh in A. It is too after a
   level block: a point x in the missing part lies behind the axis. The normal n under which it is next to the
   surface of K(p), at y, then has n . d <= 0, so y is on the surface of W, and x is no deeper in W than in K(p).
   Places are forgotten when they are a chord deep in W: this part of them is a chord deep in K(p), hence in any
   mesh of the cutter there, hence in that of the cut before; and as it lies as deep in the sweep of that cut,
   what was missing there does not hold it either unless the cut before that one had it, and so on.

5. For the same reason mesh and skin need only be right below what is ahead of such a start, see
   `vmachining.engines.mesh.ahead`: the rest of the roof of A is then left out of what a mesh is asked to see.

Hence  a - sum of stored frustums that meet W  <=  removed  <=  a + sum of seen frustums  (`Skin`).

What a frustum meets, and whether it is wholly inside, is asked of straight sweeps: the signed distance to one is
convex, so its tangent bounds it from below over the frustum, its largest value at a corner from above. A curved
path is asked as a polygon (`Way`).

Level arcs: in every plane through the arc's axis the inner ring holds the section of the inner meridian, drawn
in by the depth of the circle's polygon; frustums over its edges are revolved. Paths taken as polygons: the
true path keeps to a straight piece by a slack, which thickens the frustums. Frustums wholly inside another part
of the same V are no part of W - V.

The estimate does with means what the bracket does with bounds: V_est = vol(A) - sum of area times mean thickness
over all triangles of A, and a block removes what V_est loses. The mean is that of the gap. It travels with the
facet as its face id. Sums of such estimates telescope.

| file | holds |
|---|---|
| `layer.py` | `Skin`, `Places`, mean thickness as face ids |
| `_kernels.py` | frustums, what is seen of them, means |

Source: derived here; supports of convex bodies and Steiner's formula are textbook matter.

Known limits: a frustum counts whole wherever it is met, so brackets of single thin chips stay wide; places on
the plane between two tiles are stored in both.
"""

from vmachining.engines.mesh.skin.layer import (
    NO_SKIN,
    Leeway,
    Places,
    Skin,
    Way,
    hull_skin,
    mean_skin,
    spare,
    thick,
    untag,
)

__all__ = [
    "NO_SKIN",
    "Leeway",
    "Places",
    "Skin",
    "Way",
    "hull_skin",
    "mean_skin",
    "spare",
    "thick",
    "untag",
]
