"""STEP file -> closed solid -> triangles within a chord, and the exact volume.

Faces are meshed by OCCT so that neighbours share the points of their common edge; points are then merged by
position, which closes the surface across faces. Closedness is checked twice: topologically here (every edge
belongs to two faces), and on the triangles by whoever builds a mesh of them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engines.brep.occt.tolerances import STEP_FACET_RAD, STEP_MESH_REL
from vmachining.errors import StockError
from vmachining.stock.shapes import Triangles

__all__ = ["StepSolid", "read_step"]

MOST_SOLIDS = 1000
"""In one file; each pair is looked at for overlap."""


class StepSolid(NamedTuple):
    """vertices (n, 3) mm, triangles (m, 3), outward; volume: exact, mm^3.

    curved : (m,) which of the triangles lie on faces that are not plane.
    """

    vertices: Floats
    triangles: Ints
    volume: float
    curved: Bools


def read_step(path: Path | str, chord: float = 0.01) -> StepSolid:
    """The solid or solids of a STEP file.

    chord : float, mm, largest distance of the triangles from the surface.
    Raises StockError: Missing or unreadable file; no solid in it, or an open shell beside or instead of it; an invalid
        shape; several solids that overlap. The message names the file.
    """
    path = Path(path)
    name = str(path)
    try:
        head = path.read_bytes()[:64]
    except OSError as exc:
        raise StockError(f"cannot read: {exc.strerror or exc}", file=name) from exc
    if b"ISO-10303-21" not in head:
        raise StockError("not a STEP file (it does not start with ISO-10303-21)", file=name)
    import cadquery as cq
    from OCP.Message import Message

    Message.DefaultMessenger_s().ChangePrinters().Clear()  # OCCT talks on stdout, which is ours
    try:
        shapes = cq.importers.importStep(name).vals()
    except Exception as exc:  # OCCT raises whatever its parser meets
        raise StockError(f"OCCT cannot read it: {exc}", file=name) from exc
    placed = sum(_solids(shape.wrapped, {}) for shape in shapes if isinstance(shape, cq.Shape))
    if placed > MOST_SOLIDS:
        raise StockError(
            f"holds {placed} solids; at most {MOST_SOLIDS} are read",
            file=name,
            remedy="export the workpiece alone, joined into one solid",
        )
    solids = [solid for shape in shapes if isinstance(shape, cq.Shape) for solid in shape.Solids()]
    loose = sum(len(shape.Shells()) for shape in shapes if isinstance(shape, cq.Shape)) - sum(
        len(solid.Shells()) for solid in solids
    )
    if not solids:
        what = f"{loose} shell{'s' if loose != 1 else ''}" if loose > 0 else "no shape with a volume"
        raise StockError(f"holds no solid but {what}", file=name, remedy="export the part as a closed solid")
    if loose > 0:
        raise StockError(
            f"holds {loose} open shell(s) beside its solid(s)", file=name, remedy="export solids only"
        )
    for number, solid in enumerate(solids, start=1):
        _check(solid, f"solid {number} of {len(solids)}" if len(solids) > 1 else "the solid", name)
    solid = _joined(solids, name) if len(solids) > 1 else solids[0]
    vertices, triangles, curved = _triangles(solid, chord, name)
    exact = float(solid.Volume())
    meshed = Triangles(vertices, triangles).volume
    if abs(meshed - exact) > STEP_MESH_REL * exact:
        raise StockError(
            f"its triangles enclose {meshed:.6g} mm3, the solid {exact:.6g} mm3",
            file=name,
            remedy="take a finer chord",
        )
    return StepSolid(vertices, triangles, exact, curved)


def _solids(shape: Any, known: dict[Any, int]) -> int:
    """Solids of a shape with all its copies: an assembly of assemblies of ten each is a small file of 10^n solids."""
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopoDS import TopoDS_Iterator

    if shape.ShapeType() == TopAbs_ShapeEnum.TopAbs_SOLID:
        return 1
    if shape.ShapeType() not in (TopAbs_ShapeEnum.TopAbs_COMPOUND, TopAbs_ShapeEnum.TopAbs_COMPSOLID):
        return 0
    key = shape.TShape()  # kept in `known`, so that it stays one object
    if key not in known:
        known[key], inner = 0, TopoDS_Iterator(shape)
        while inner.More():
            known[key] += _solids(inner.Value(), known)
            inner.Next()
    return known[key]


def _check(solid: Any, what: str, name: str) -> None:
    """Valid, closed, and not inside out."""
    from OCP.BRep import BRep_Tool

    if not solid.isValid():
        raise StockError(f"{what} is not a valid shape", file=name, remedy="repair it in the CAD system")
    if not all(BRep_Tool.IsClosed_s(shell.wrapped) for shell in solid.Shells()):
        raise StockError(f"{what} is not closed", file=name, remedy="export the part as a closed solid")
    if not solid.Volume() > 0.0:
        raise StockError(
            f"{what} has the volume {solid.Volume():.6g} mm3", file=name, remedy="check its orientation"
        )


def _joined(solids: list[Any], name: str) -> Any:
    """A compound of solids that do not share volume."""
    import cadquery as cq

    for i, one in enumerate(solids):
        for other in solids[i + 1 :]:
            a, b = one.BoundingBox(), other.BoundingBox()
            apart = (
                a.xmax <= b.xmin or b.xmax <= a.xmin or a.ymax <= b.ymin or b.ymax <= a.ymin
                or a.zmax <= b.zmin or b.zmax <= a.zmin
            )  # fmt: skip
            if not apart and one.intersect(other).Volume() > 1e-9 * min(one.Volume(), other.Volume()):
                raise StockError("holds solids that overlap", file=name, remedy="join them into one")
    return cq.Compound.makeCompound(solids)


def _triangles(solid: Any, chord: float, name: str) -> tuple[Floats, Ints, Bools]:
    """Outward triangles of every face, points merged by position; and which are of curved faces."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.TopAbs import TopAbs_Orientation
    from OCP.TopLoc import TopLoc_Location

    BRepMesh_IncrementalMesh(solid.wrapped, chord, False, STEP_FACET_RAD, False)
    points: list[Floats] = []
    triangles: list[Ints] = []
    curved: list[Bools] = []
    offset = 0
    for face in solid.Faces():
        location = TopLoc_Location()
        mesh = BRep_Tool.Triangulation_s(face.wrapped, location)
        if mesh is None:
            raise StockError("a face cannot be triangulated", file=name, remedy="repair it in the CAD system")
        move = location.Transformation()
        nodes = [mesh.Node(k).Transformed(move) for k in range(1, mesh.NbNodes() + 1)]
        points.append(np.array([(p.X(), p.Y(), p.Z()) for p in nodes]))
        corners = (
            np.array([mesh.Triangle(k).Get() for k in range(1, mesh.NbTriangles() + 1)], dtype=np.int64) - 1
        )
        if face.wrapped.Orientation() == TopAbs_Orientation.TopAbs_REVERSED:
            corners = corners[:, ::-1]
        curved.append(np.full(len(corners), face.geomType() != "PLANE"))
        triangles.append(corners + offset)
        offset += len(nodes)
    vertices = np.concatenate(points)
    # points of a shared edge agree to rounding; cells of 1e-7 mm, OCCT's own confusion, make them one
    _, first, member = np.unique(np.round(vertices, 7), axis=0, return_index=True, return_inverse=True)
    merged = member.reshape(-1)[np.concatenate(triangles)]
    flat = (merged[:, 0] == merged[:, 1]) | (merged[:, 1] == merged[:, 2]) | (merged[:, 2] == merged[:, 0])
    return vertices[first], merged[~flat], np.concatenate(curved)[~flat]
