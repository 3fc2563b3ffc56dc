"""Removed volume from triangles on the faces of B-rep solids, where booleans of solids hang or go wrong.

A sweep that folds is a union of up to a hundred solids that touch and cross each other along whole faces: OCCT
walks along such contacts for minutes, or loses parts. Its triangulation of one valid solid is another matter: edges
are followed once, faces take over their points, and the triangles of all faces close. So

1. every solid is triangulated with two or three of `SAGS`; cracks beside slivers, where a face misses a point of its
   edge, are closed, and the mesh must have the volume of the solid up to the sag times its surface;
2. the union of a sweep's meshes, and what the block's takes from what the earlier ones leave of the stock, are
   booleans of manifold3d, which do not fail;
3. the error of a volume is proportional to the sag (measured on solids of turning tools: a quarter of the sag leaves 0.23
   to 0.30 of the error). So the value is that of the finer mesh and a third of the last step,
   and the step is the error stated: with faces of two sweeps in one place the rest is noise, smaller than it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from manifold3d import Error, Manifold, Mesh64, OpType

from vmachining.arrays import Floats, Ints
from vmachining.engines.brep.measure import volume
from vmachining.errors import EngineError

__all__ = ["SAGS", "faceted", "limit", "taken", "united"]

SAGS = (8e-3, 2e-3, 5e-4)
"""mm between a face and its triangles. Each is a quarter of the one before: chords are half as long."""

BEND = 6.0
"""rad per root of a sag: angles of chords are limited in proportion to them, too."""

FINER = ((1.0, 1.0), (0.9, 1.0), (0.8, 0.5), (0.7, 0.5), (0.5, 0.5), (0.3, 0.3))
"""Parts of a sag and of its angles that are tried: beside edges of 1e-5 mm OCCT's mesh of a face loses a corner with
every fifth of them."""

MARGIN = 0.1
"""mm by which the box to which meshes are trimmed is larger than asked."""


def faceted(shape: Any, sag: float) -> Manifold:
    """A valid and closed TopoDS_Shape as a mesh that leaves its faces by about `sag` mm, or by a little less.

    Raises
    ------
    EngineError
        The triangles do not close but for cracks as wide as the sag, or do not hold the volume.
    """
    reason: EngineError | None = None
    for share, angle in FINER:
        try:
            return _closed(shape, share * sag, angle * BEND)
        except EngineError as exc:
            reason = reason or exc
    assert reason is not None
    raise reason


def _closed(shape: Any, sag: float, bend: float) -> Manifold:
    """The same with one sag and one bend, see `BEND`."""
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.BRepTools import BRepTools

    BRepTools.Clean_s(shape)
    BRepMesh_IncrementalMesh(shape, sag, False, bend * float(np.sqrt(sag)), False)
    points, triangles = _triangles(shape)
    BRepTools.Clean_s(shape)
    whole = _filled(triangles)
    cracks = points[whole[len(triangles) :]]
    area = 0.5 * np.linalg.norm(np.cross(cracks[:, 1] - cracks[:, 0], cracks[:, 2] - cracks[:, 0]), axis=1)
    length = np.linalg.norm(cracks - np.roll(cracks, 1, axis=1), axis=2)
    if area.sum() > sag * length.sum():  # a face is missing, not a point of an edge
        raise EngineError(f"triangles of a solid lack {area.sum():.2g} mm2", engine="brep")
    mesh = Mesh64(points, whole.astype(np.uint64))
    mesh.merge()
    solid = Manifold(mesh)
    if solid.status() != Error.NoError:
        raise EngineError(f"triangles of a solid do not close ({solid.status()})", engine="brep")
    wanted, room = volume(shape), sag * float(solid.surface_area())
    if abs(float(solid.volume()) - wanted) > room:
        raise EngineError(
            f"triangles hold {float(solid.volume()):.9g} mm3 of {wanted:.9g}, more than {room:.2g} apart",
            engine="brep",
        )
    return solid


def united(shapes: Sequence[Any], sag: float, box: Floats) -> Manifold:
    """The union of solids as a mesh, as far as it is in a box (2, 3), mm."""
    lo, hi = box[0] - MARGIN, box[1] + MARGIN
    room = Manifold.cube((hi - lo).tolist()).translate(lo.tolist())
    trimmed = [
        faceted(shape, sag) ^ room for shape in shapes
    ]  # first: what is outside crosses itself all over, too
    return _checked(Manifold.batch_boolean(trimmed, OpType.Add))


def taken(stock: Manifold, sweep: Manifold, earlier: Iterable[Manifold]) -> float:
    """mm^3 that a sweep takes from what earlier ones leave of the stock."""
    left = sweep ^ stock
    for other in earlier:
        a, b = np.reshape(left.bounding_box(), (2, 3)), np.reshape(other.bounding_box(), (2, 3))
        if (a[0] < b[1]).all() and (b[0] < a[1]).all():  # never of an empty one
            left = left - other
    return float(_checked(left).volume())


def _checked(solid: Manifold) -> Manifold:
    if solid.status() != Error.NoError:
        raise EngineError(f"manifold3d reports {solid.status()}", engine="brep")
    return solid


def limit(f: Callable[[float], float], tol: float) -> tuple[float, float]:
    """(value, error) of f(sag) for ever finer meshes, until the error is below `tol`."""
    values = [f(SAGS[0])]
    value, error = np.nan, np.inf
    for coarse, fine in pairwise(SAGS):
        values.append(f(fine))
        step = values[-1] - values[-2]
        value, error = values[-1] + step * fine / (coarse - fine), abs(step)
        if error <= tol:
            break
    return value, error


def _triangles(shape: Any) -> tuple[Floats, Ints]:
    """Points (n, 3), once each, and outward triangles (m, 3) of all faces of a triangulated shape."""
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS

    places: list[tuple[float, float, float]] = []
    corners: list[tuple[int, int, int]] = []
    faces = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    while faces.More():
        face = TopoDS.Face_s(faces.Current())
        faces.Next()
        where = TopLoc_Location()
        mesh = BRep_Tool.Triangulation_s(face, where)
        if mesh is None:
            raise EngineError("OCCT does not triangulate a face", engine="brep")
        first, move = len(places) - 1, where.Transformation()
        for k in range(1, mesh.NbNodes() + 1):
            p = mesh.Node(k).Transformed(move)
            places.append((p.X(), p.Y(), p.Z()))
        back = face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED
        for k in range(1, mesh.NbTriangles() + 1):
            a, b, c = mesh.Triangle(k).Get()
            corners.append((first + a, first + c, first + b) if back else (first + a, first + b, first + c))
    points, number = np.unique(np.array(places), axis=0, return_inverse=True)
    triangles = number.ravel()[np.array(corners)]
    apart = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return points, triangles[apart]


def _filled(triangles: Ints) -> Ints:
    """The triangles (m, 3), with fans in the loops that edges without a neighbour make."""
    ways = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    size = int(triangles.max()) + 1
    open_ = ways[~np.isin(ways @ [size, 1], ways @ [1, size])]
    fans = [(loop[0], b, c) for loop in _loops(open_[:, ::-1].tolist()) for b, c in pairwise(loop[1:])]
    return np.concatenate([triangles, np.array(fans, dtype=triangles.dtype).reshape(-1, 3)])


def _loops(steps: Sequence[tuple[int, int]]) -> Iterator[list[int]]:
    """Closed walks that enter no point twice, of steps from one point to another; what does not close is left."""
    after: dict[int, list[int]] = {}
    for a, b in steps:
        after.setdefault(a, []).append(b)
    for start in list(after):
        walk = [start]
        while after.get(walk[-1]):
            to = after[walk[-1]].pop()
            if to in walk:
                at = walk.index(to)
                yield walk[at:]
                del walk[at + 1 :]
            else:
                walk.append(to)
