"""Removed volume from triangles on the faces of B-rep solids, where booleans of solids hang or go wrong.

A sweep that folds is a union of up to a hundred solids that touch and cross each other along whole faces: OCCT
walks along such contacts for minutes, or loses parts. Its triangulation of one valid solid is another matter: edges
are followed once, faces take over their points, and the triangles of all faces close. So

1. every solid is triangulated with two or more of `SAGS`; cracks beside slivers, where a face misses a point of its
   edge, are closed, plane faces of which OCCT loses a part are filled from what their neighbours have as border, and the
   mesh must have the volume of the solid up to the sag times its surface;
2. the union of a sweep's meshes, and what the block's takes from what the earlier ones leave of the stock, are
   booleans of manifold3d, which do not fail;
3. the error of a volume is proportional to the sag (measured on solids of turning tools: a quarter of the sag leaves 0.23
   to 0.30 of the error; half of it 0.44 to 0.68 where faces are small). So the value is that of the finer mesh and a third
   of the step from a sag four times as large. What is stated as error is that step, and a quarter of the step of all that
   the sweep shares with the stock, as far as the surface of what it removes goes: the errors of its mesh and of the
   earlier ones cancel, and the step of what it removes alone was seen to be a fifth of what was still to come.
   Layers not much thicker than a sag are wrong by up to a sag all over (`THIN`);
4. OCCT's mesh of a valid solid may be bad, and lack more with half the sag. The volume of every solid is known exactly, so
   is what its extrapolated mesh misses of it. The root of the sum of squares of that is added to the error stated
   (0.14 mm3 on a block where the rest of it was 0.014 and the value 0.14 off): all of a mesh that misses much (`BAD`),
   wherever it does; of others the share that their surface has in what is removed. An estimate: misses of many solids that
   are alike may add up to more.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from manifold3d import Error, Manifold, Mesh64, triangulate

from vmachining.arrays import Floats, Ints
from vmachining.errors import EngineError

__all__ = ["SAGS", "Lack", "Meshed", "Taken", "faceted", "limit", "taken", "united"]

SAGS = (8e-3, 4e-3, 2e-3, 1e-3, 5e-4)
"""mm between a face and its triangles. The next but one is a quarter: chords are half as long."""

THIN = 4.0
"""Times a sag: layers that are thinner than that in the mean are missed in part, and follow no law. They may be wrong by a
sag all over."""

BEND = 6.0
"""rad per root of a sag: angles of chords are limited in proportion to them, too."""

FINER = ((1.0, 1.0), (0.9, 1.0), (0.8, 0.5), (0.7, 0.5), (0.5, 0.5), (0.3, 0.3))
"""Parts of a sag and of its angles that are tried: beside edges of 1e-5 mm OCCT's mesh of a face loses a corner with
every fifth of them."""

LEVEL = 1e-4
"""mm from a plane: borders of its faces, which neighbours carry, are nearer."""

BAD = 0.1
"""Of the step of the volume of a whole mesh: one whose limit misses its solid by more is bad somewhere. Others were seen to
miss 0.01 to 0.08 of it, the bad ones 0.4."""

MARGIN = 0.1
"""mm by which the box to which meshes are trimmed is larger than asked."""


class Lack(NamedTuple):
    """Of the mesh of a whole solid: mm^3 that it has less than the solid, mm^2 of its surface."""

    volume: float
    area: float


class Meshed(NamedTuple):
    """Mesh of a union of solids, and what the meshes of each of them lack."""

    solid: Manifold
    lacks: tuple[Lack, ...]


def faceted(shape: Any, sag: float, held: float) -> Meshed:
    """A valid and closed TopoDS_Shape of `held` mm^3 as a mesh that leaves its faces by about `sag` mm, or by a little less.

    Raises
    ------
    EngineError
        The triangles do not close but for cracks as wide as the sag, or do not hold the volume.
    """
    reason: EngineError | None = None
    for share, angle in FINER:
        try:
            return _closed(shape, share * sag, held, angle * BEND)
        except EngineError as exc:
            reason = reason or exc
    assert reason is not None
    raise reason


def _closed(shape: Any, sag: float, held: float, bend: float) -> Meshed:
    """The same with one sag and one bend, see `BEND`."""
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.BRepTools import BRepTools

    BRepTools.Clean_s(shape)
    BRepMesh_IncrementalMesh(shape, sag, False, bend * float(np.sqrt(sag)), False)
    points, triangles, planes = _triangles(shape, sag)
    BRepTools.Clean_s(shape)
    whole, first = _filled(points, triangles, planes)
    cracks = points[whole[first:]]
    area = 0.5 * np.linalg.norm(np.cross(cracks[:, 1] - cracks[:, 0], cracks[:, 2] - cracks[:, 0]), axis=1)
    length = np.linalg.norm(cracks - np.roll(cracks, 1, axis=1), axis=2)
    if area.sum() > sag * length.sum():  # a face is missing, not a point of an edge
        raise EngineError(f"triangles of a solid lack {area.sum():.2g} mm2", engine="brep")
    mesh = Mesh64(points, whole.astype(np.uint64))
    mesh.merge()
    solid = Manifold(mesh)
    if solid.status() != Error.NoError:
        raise EngineError(f"triangles of a solid do not close ({solid.status()})", engine="brep")
    area = float(solid.surface_area())
    lack = held - float(solid.volume())
    if not abs(lack) <= sag * area:
        raise EngineError(
            f"triangles hold {float(solid.volume()):.9g} mm3 of {held:.9g}, more than {sag * area:.2g} apart",
            engine="brep",
        )
    return Meshed(solid, (Lack(lack, area),))


def united(shapes: Sequence[Any], volumes: Sequence[float], sag: float, box: Floats) -> Meshed:
    """The union of solids of known volumes, mm^3, as a mesh, as far as it is in a box (2, 3), mm.

    Neighbours first, then pairs of them: they are parts of one motion, one after the other. manifold3d's own order, by
    number of triangles, was measured to take a third longer.
    """
    lo, hi = box[0] - MARGIN, box[1] + MARGIN
    room = Manifold.cube((hi - lo).tolist()).translate(lo.tolist())
    # trimmed first: what is outside crosses itself all over, too
    parts, lacks = [], list[Lack]()
    for shape, held in zip(shapes, volumes, strict=True):
        mesh = faceted(shape, sag, held)
        parts.append(_checked(mesh.solid ^ room))
        lacks += mesh.lacks
    while len(parts) > 1:
        pairs = [_checked(one + other) for one, other in zip(parts[::2], parts[1::2], strict=False)]
        parts = pairs + parts[2 * len(pairs) :]
    return Meshed(parts[0] if parts else Manifold(), tuple(lacks))


class Taken(NamedTuple):
    """What a sweep takes from what earlier ones leave of the stock, mm^3 and mm^2 around it; what it shares with the stock.

    lacks : of all solids that have a part in it, see `Meshed`.
    """

    removed: float
    area: float
    shared: float
    around: float
    lacks: tuple[Lack, ...] = ()


def taken(stock: Meshed, sweep: Meshed, earlier: Iterable[Meshed]) -> Taken:
    """By meshes of a sweep and of the earlier ones that reach it.

    If the meshes leave nothing, what they do not see may be all around: where a sweep only just reaches the stock, in the
    box of both.
    """
    left, lacks = _checked(sweep.solid ^ stock.solid), [*stock.lacks, *sweep.lacks]
    shared, around = float(left.volume()), float(left.surface_area())
    if shared == 0.0:
        around = _common_area(sweep.solid, stock.solid)
    for other, missing in earlier:
        lacks += missing
        a, b = _box(left), _box(other)
        if (a[0] < b[1]).all() and (b[0] < a[1]).all():  # never of an empty one
            left = left - other
    left = _checked(left)
    return Taken(float(left.volume()), float(left.surface_area()), shared, around, tuple(lacks))


def _box(solid: Manifold) -> Floats:
    return np.reshape(solid.bounding_box(), (2, 3))


def _common_area(one: Manifold, other: Manifold) -> float:
    """mm^2 of the box that two solids share; 0 if they are farther apart than the largest sag."""
    if one.is_empty() or other.is_empty():
        return 0.0
    a, b = _box(one), _box(other)
    sides = np.minimum(a[1], b[1]) - np.maximum(a[0], b[0])
    if sides.min() < -SAGS[0]:
        return 0.0
    x, y, z = np.maximum(sides, 0.0)
    return float(2.0 * (x * y + y * z + z * x))


def _checked(solid: Manifold) -> Manifold:
    if solid.status() != Error.NoError:
        raise EngineError(f"manifold3d reports {solid.status()}", engine="brep")
    return solid


def limit(f: Callable[[float], Sequence[Taken]], tol: float) -> tuple[float, float]:
    """(value, error) of what sweeps remove, f(sag), with ever finer meshes until the error is below `tol`."""
    found: dict[float, Sequence[Taken]] = {}
    value, error = np.nan, np.inf
    for sags in zip(SAGS, SAGS[2:], strict=False):
        for sag in sags:
            found[sag] = found[sag] if sag in found else f(sag)
        coarse, fine = sags
        ends = zip(found[coarse], found[fine], strict=True)
        parts = [_extrapolated(before, after, coarse, fine) for before, after in ends]
        total, miss = sum(one for one, _ in parts), sum(miss for _, miss in parts)
        if miss < error:
            value, error = total, miss
        else:  # a bad mesh may come after a good one, and contradict it
            error = max(error, abs(total - value) - miss)
        if error <= tol:
            break
    return max(value, 0.0), error


def _extrapolated(before: Taken, after: Taken, coarse: float, fine: float) -> tuple[float, float]:
    """(value, error) of one sweep from two meshes."""
    more = fine / (coarse - fine)
    step, gross = after.removed - before.removed, after.shared - before.shared
    if after.around > 0.0:
        gross *= after.area / after.around
    error = abs(step) + 0.25 * abs(gross)
    seen = after.removed > 0.0
    if not seen or 2.0 * after.removed < THIN * coarse * after.area:
        error = max(error, fine * (after.area if seen else after.around))
    return after.removed + step * more, error + _missed(before.lacks, after.lacks, more, after.area)


def _missed(before: Sequence[Lack], after: Sequence[Lack], more: float, area: float) -> float:
    """What extrapolated meshes miss of their solids, as far as it may be on an area of what is removed."""
    soon, late = (np.array(lacks, dtype=np.float64).reshape(-1, 2) for lacks in (before, after))
    step = late[:, 0] - soon[:, 0]
    missed = np.abs(late[:, 0] + step * more)
    shares = np.where(missed > BAD * np.abs(step), 1.0, np.minimum(area / late[:, 1], 1.0))
    return float(np.linalg.norm(shares * missed))


def _triangles(shape: Any, sag: float) -> tuple[Floats, Ints, list[Plane]]:
    """Points (n, 3), once each, and outward triangles (m, 3) of the faces of a triangulated shape.

    Also the planes of faces that are left out: those that are plane and not triangulated as a whole.
    """
    from OCP.BRep import BRep_Tool
    from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS

    places: list[Floats] = []
    corners: list[Ints] = []
    planes: list[Plane] = []
    count = 0
    faces = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    while faces.More():
        face = TopoDS.Face_s(faces.Current())
        faces.Next()
        where = TopLoc_Location()
        mesh, plane = BRep_Tool.Triangulation_s(face, where), _plane(face, sag)
        if mesh is None and plane is None:
            raise EngineError("OCCT does not triangulate a face", engine="brep")
        own, found = np.empty((0, 3)), np.empty((0, 3), dtype=np.int64)
        if mesh is not None:
            move = where.Transformation()
            own = np.array([mesh.Node(k).Transformed(move).Coord() for k in range(1, mesh.NbNodes() + 1)])
            found = np.array([mesh.Triangle(k).Get() for k in range(1, mesh.NbTriangles() + 1)]) - 1
        if plane is not None and not plane.is_covered(own[found]):
            planes.append(plane)
            continue
        back = face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED
        corners.append(count + (found[:, ::-1] if back else found))
        places.append(own)
        count += len(own)
    points, number = np.unique(np.concatenate(places), axis=0, return_inverse=True)
    triangles = number.ravel()[np.concatenate(corners)]
    apart = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
    return points, triangles[apart], planes


class Plane(NamedTuple):
    """A plane face. axes : (3, 3) right-handed unit vectors, the last one out of the solid. at : mm, height along it.

    area : mm^2, and what triangles may lack of it, the sag along the border.
    """

    axes: Floats
    at: float
    area: float
    room: float

    def is_covered(self, corners: Floats) -> bool:
        """Whether triangles (m, 3, 3) have the area of the face."""
        sides = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        return abs(0.5 * float(np.linalg.norm(np.cross(*sides), axis=1).sum()) - self.area) <= self.room


def _plane(face: Any, sag: float) -> Plane | None:
    """Of a face; None if it is bent."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepGProp import BRepGProp
    from OCP.GeomAbs import GeomAbs_SurfaceType
    from OCP.GProp import GProp_GProps
    from OCP.TopAbs import TopAbs_Orientation

    surface = BRepAdaptor_Surface(face)
    if surface.GetType() != GeomAbs_SurfaceType.GeomAbs_Plane:
        return None
    frame = surface.Plane().Position()
    u, v = (np.array([d.X(), d.Y(), d.Z()]) for d in (frame.XDirection(), frame.YDirection()))
    if face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED:
        u, v = v, u
    normal, foot = np.cross(u, v), frame.Location()
    area, border = GProp_GProps(), GProp_GProps()
    BRepGProp.SurfaceProperties_s(face, area)
    BRepGProp.LinearProperties_s(face, border)
    at = float(normal @ [foot.X(), foot.Y(), foot.Z()])
    return Plane(np.stack([u, v, normal]), at, area.Mass(), sag * border.Mass())


def _filled(points: Floats, triangles: Ints, planes: Sequence[Plane]) -> tuple[Ints, int]:
    """The triangles (m, 3) with what lacks of them: of plane faces, and fans in other loops of edges without a neighbour.

    Also the number of the first triangle of a fan.

    Raises
    ------
    EngineError
        What is open in the plane of such a face does not have its area.
    """
    ways = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    size = int(triangles.max()) + 1
    open_ = ways[~np.isin(ways @ [size, 1], ways @ [1, size])]
    loops, parts = list(_loops(open_[:, ::-1].tolist())), [triangles]
    for plane in planes:
        levels = [np.abs(points[loop] @ plane.axes[2] - plane.at).max() for loop in loops]
        own = [loop for loop, level in zip(loops, levels, strict=True) if level <= LEVEL]
        loops = [loop for loop, level in zip(loops, levels, strict=True) if level > LEVEL]
        found = np.empty((0, 3), dtype=triangles.dtype)
        if own:
            found = np.concatenate(own)[triangulate([points[loop] @ plane.axes[:2].T for loop in own])]
        if not plane.is_covered(points[found]):
            raise EngineError(f"a plane face of {plane.area:.2g} mm2 has another border", engine="brep")
        parts.append(found)
    whole = np.concatenate(parts)
    fans = [(loop[0], b, c) for loop in loops for b, c in pairwise(loop[1:])]
    return np.concatenate([whole, np.array(fans, dtype=whole.dtype).reshape(-1, 3)]), len(whole)


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
