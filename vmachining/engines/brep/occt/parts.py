"""What a shape consists of: its solids and faces, whether it is closed, distances to it; shapes as bytes."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from typing import Any

import cadquery as cq
import numpy as np
from OCP.BinTools import BinTools
from OCP.BRep import BRep_Tool
from OCP.BRepExtrema import BRepExtrema_DistShapeShape
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS_Shape

from vmachining.arrays import Floats
from vmachining.engines.brep.occt.measure import volume
from vmachining.engines.brep.occt.tolerances import CRUMB_MM3
from vmachining.errors import EngineError

__all__ = [
    "compound",
    "distance",
    "faces_of",
    "from_bytes",
    "has_loose_faces",
    "has_open_shell",
    "place",
    "point_inside",
    "solids_of",
    "to_bytes",
    "without_crumbs",
]


def solids_of(shape: Any) -> list[Any]:
    """TopoDS_Solids."""
    return [solid.wrapped for solid in cq.Shape.cast(shape).Solids()]


def faces_of(shape: Any) -> list[Any]:
    """TopoDS_Faces."""
    return [face.wrapped for face in cq.Shape.cast(shape).Faces()]


def compound(shapes: Sequence[Any]) -> Any:
    """TopoDS_Compound of some shapes; none gives an empty one."""
    return cq.Compound.makeCompound([cq.Shape.cast(shape) for shape in shapes]).wrapped


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
    shells = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_SHELL)
    while shells.More():
        if not BRep_Tool.IsClosed_s(shells.Current()):
            return True
        shells.Next()
    return False


def place(point: Floats) -> Any:
    """TopoDS_Vertex at a point (3,) mm."""
    return cq.Vertex.makeVertex(*point.tolist()).wrapped


def distance(one: Any, other: Any) -> float:
    """mm between two shapes."""
    return float(BRepExtrema_DistShapeShape(one, other).Value())


def point_inside(face: Any) -> Floats:
    """(3,) mm: a point of a TopoDS_Face, off its edges: the middle of its largest triangle, back on the surface."""
    whole = cq.Face(face)
    vertices, triangles = whole.tessellate(0.1, 0.3)
    points = np.array([v.toTuple() for v in vertices]).reshape(-1, 3)
    if triangles:
        a, b, c = points[np.array(triangles)].transpose(1, 0, 2)
        best = int(np.argmax(np.linalg.norm(np.cross(b - a, c - a), axis=1)))
        middle = (a[best] + b[best] + c[best]) / 3.0
    else:  # a face too thin for OCCT to triangulate
        middle = np.array([v.toTuple() for v in whole.Vertices()]).mean(axis=0)
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
