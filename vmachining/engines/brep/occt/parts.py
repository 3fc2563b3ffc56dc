"""What a shape consists of: its solids and faces, whether it is closed, distances to it; shapes as bytes."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from typing import Any

import numpy as np
from OCP.BinTools import BinTools
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeVertex
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.BRepTopAdaptor import BRepTopAdaptor_FClass2d
from OCP.gp import gp_Pnt, gp_Pnt2d
from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum, TopAbs_State
from OCP.TopExp import TopExp, TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Compound, TopoDS_Shape
from OCP.TopTools import TopTools_IndexedMapOfShape

from vmachining.arrays import Floats, Ints
from vmachining.engines.brep.occt.measure import volume
from vmachining.engines.brep.occt.tolerances import CONFUSION_MM, CRUMB_MM3
from vmachining.errors import EngineError


def solids_of(shape: Any) -> list[Any]:
    """TopoDS_Solids, each once."""
    return [TopoDS.Solid_s(part) for part in _each(shape, TopAbs_ShapeEnum.TopAbs_SOLID)]


def shells_of(shape: Any) -> list[Any]:
    """TopoDS_Shells, each once."""
    return [TopoDS.Shell_s(part) for part in _each(shape, TopAbs_ShapeEnum.TopAbs_SHELL)]


def faces_of(shape: Any) -> list[Any]:
    """TopoDS_Faces, each once."""
    return [TopoDS.Face_s(part) for part in _each(shape, TopAbs_ShapeEnum.TopAbs_FACE)]


def _each(shape: Any, kind: Any) -> list[Any]:
    found = TopTools_IndexedMapOfShape()
    TopExp.MapShapes_s(shape, kind, found)
    return [found.FindKey(k) for k in range(1, found.Extent() + 1)]


def compound(shapes: Sequence[Any]) -> Any:
    """TopoDS_Compound of some shapes; an empty list gives an empty one."""
    builder, whole = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(whole)
    for shape in shapes:
        builder.Add(whole, shape)
    return whole


def triangles_of(face: Any) -> tuple[Floats, Ints] | None:
    """Points (n, 3) mm and outward corners (m, 3) of a face that is meshed; None where OCCT could not mesh it."""
    location = TopLoc_Location()
    mesh = BRep_Tool.Triangulation_s(face, location)
    if mesh is None:
        return None
    move = location.Transformation()
    nodes = [mesh.Node(k).Transformed(move) for k in range(1, mesh.NbNodes() + 1)]
    corners = [mesh.Triangle(k).Get() for k in range(1, mesh.NbTriangles() + 1)]
    points = np.array([(p.X(), p.Y(), p.Z()) for p in nodes]).reshape(-1, 3)
    turned = face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED
    return points, np.array(corners, dtype=np.int64).reshape(-1, 3)[:, :: -1 if turned else 1] - 1


def points_on(face: Any, count: int, rng: np.random.Generator) -> Floats:
    """(n, 3) mm: random points of a face, up to so many in its inside and on its edges each."""
    surface, inside = BRepAdaptor_Surface(face), BRepTopAdaptor_FClass2d(face, CONFUSION_MM)
    u0, u1, v0, v1 = BRepTools.UVBounds_s(face)
    places = rng.uniform((u0, v0), (u1, v1), (4 * count, 2)).tolist()
    held = [p for p in places if inside.Perform(gp_Pnt2d(*p)) == TopAbs_State.TopAbs_IN][:count]
    points = [surface.Value(u, v) for u, v in held]
    edges = [TopoDS.Edge_s(edge) for edge in _each(face, TopAbs_ShapeEnum.TopAbs_EDGE)]
    edges = [edge for edge in edges if not BRep_Tool.Degenerated_s(edge)]
    for edge in edges:
        curve = BRepAdaptor_Curve(edge)
        ends = curve.FirstParameter(), curve.LastParameter()
        points += [curve.Value(t) for t in rng.uniform(*ends, -(-count // len(edges))).tolist()]
    return np.array([(p.X(), p.Y(), p.Z()) for p in points]).reshape(-1, 3)


def has_loose_faces(shape: Any) -> bool:
    """Whether it has faces that belong to no solid."""
    kinds = TopAbs_ShapeEnum
    return bool(TopExp_Explorer(shape, kinds.TopAbs_FACE, kinds.TopAbs_SOLID).More())


def without_crumbs(shape: Any) -> Any:
    """The shape without those of its solids that hold nothing; as it is where it has faces that belong to none.

    Raises EngineError: A solid is inside out.
    """
    pieces = solids_of(shape)
    held = [volume(piece) for piece in pieces]
    if min(held, default=0.0) < -CRUMB_MM3:
        raise EngineError("a piece is inside out", engine="brep")
    kept = [piece for piece, value in zip(pieces, held, strict=True) if value > CRUMB_MM3]
    if len(kept) == len(pieces) or has_loose_faces(shape):
        return shape
    return compound(kept)


def has_open_shell(shape: Any) -> bool:
    """Whether some shell does not close."""
    return not all(BRep_Tool.IsClosed_s(shell) for shell in shells_of(shape))


def place(point: Floats) -> Any:
    """TopoDS_Vertex at a point (3,) mm."""
    return BRepBuilderAPI_MakeVertex(gp_Pnt(*point.tolist())).Vertex()


def distance(one: Any, other: Any) -> float:
    """mm between two shapes."""
    return float(BRepExtrema_DistShapeShape(one, other).Value())


def point_inside(face: Any) -> Floats:
    """(3,) mm: a point of a TopoDS_Face, off its edges: the middle of its largest triangle, back on the surface."""
    BRepMesh_IncrementalMesh(face, 0.1, True, 0.3, True)
    points, triangles = triangles_of(face) or (np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))
    if len(triangles):
        a, b, c = points[triangles].transpose(1, 0, 2)
        best = int(np.argmax(np.linalg.norm(np.cross(b - a, c - a), axis=1)))
        middle = (a[best] + b[best] + c[best]) / 3.0
    else:  # a face too thin for OCCT to triangulate
        corners = [BRep_Tool.Pnt_s(TopoDS.Vertex_s(v)) for v in _each(face, TopAbs_ShapeEnum.TopAbs_VERTEX)]
        middle = np.array([(p.X(), p.Y(), p.Z()) for p in corners]).mean(axis=0)
    p = BRepExtrema_DistShapeShape(place(middle), face).PointOnShape2(1)
    return np.array([p.X(), p.Y(), p.Z()])


def to_bytes(shape: Any) -> bytes:
    """A shape in OCCT's own format, every bit kept."""
    data = BytesIO()
    BinTools.Write_s(shape, data)
    return data.getvalue()


def from_bytes(content: bytes) -> Any:
    """The shape again. Raises EngineError if nothing comes back."""
    shape = TopoDS_Shape()
    BinTools.Read_s(shape, BytesIO(content))
    if shape.IsNull():
        raise EngineError("OCCT reads nothing back", engine="brep")
    return shape
