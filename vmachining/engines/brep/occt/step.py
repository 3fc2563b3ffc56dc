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
from vmachining.errors import EngineError, StockError
from vmachining.stock.shapes import Triangles

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
    from vmachining.engines.brep.occt import parts
    from vmachining.engines.brep.occt.booleans import quiet

    quiet()  # OCCT talks on stdout, which is ours
    try:
        shapes = shapes_in(name)
    except Exception as exc:  # OCCT raises whatever its parser meets
        raise StockError(f"OCCT cannot read it: {exc}", file=name) from exc
    placed = sum(_solids(shape, {}) for shape in shapes)
    if placed > MOST_SOLIDS:
        what, remedy = (
            f"holds {placed} solids; at most {MOST_SOLIDS} are read",
            "export the workpiece alone, joined into one solid",
        )
        raise StockError(what, file=name, remedy=remedy)
    solids = [solid for shape in shapes for solid in parts.solids_of(shape)]
    loose = sum(len(parts.shells_of(shape)) for shape in shapes) - sum(
        len(parts.shells_of(s)) for s in solids
    )
    if not solids:
        what = f"{loose} shell{'s' if loose != 1 else ''}" if loose > 0 else "no shape with a volume"
        raise StockError(
            f"contains no solid, only {what}", file=name, remedy="export the part as a closed solid"
        )
    if loose > 0:
        what = f"holds {loose} open shell(s) in addition to its solid(s)"
        raise StockError(what, file=name, remedy="export solids only")
    for number, solid in enumerate(solids, start=1):
        _check(solid, f"solid {number} of {len(solids)}" if len(solids) > 1 else "the solid", name)
    solid = _joined(solids, name) if len(solids) > 1 else solids[0]
    vertices, triangles, curved = _triangles(solid, chord, name)
    exact = _volume(solid)
    meshed = Triangles(vertices, triangles).volume
    if abs(meshed - exact) > STEP_MESH_REL * exact:
        what = f"its triangles enclose {meshed:.6g} mm3, the solid {exact:.6g} mm3"
        raise StockError(what, file=name, remedy="take a finer chord")
    return StepSolid(vertices, triangles, exact, curved)


def shapes_in(name: str) -> list[Any]:
    """TopoDS_Shapes of a STEP file, in mm. Raises EngineError if OCCT cannot read it."""
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_Reader

    reader = STEPControl_Reader()  # the parameter below is known once a reader exists
    Interface_Static.SetCVal_s("xstep.cascade.unit", "MM")
    if reader.ReadFile(name) != IFSelect_ReturnStatus.IFSelect_RetDone:
        raise EngineError("the STEP file cannot be loaded", engine="brep")
    for k in range(1, reader.NbRootsForTransfer() + 1):
        reader.TransferRoot(k)
    found = [reader.Shape(k) for k in range(1, reader.NbShapes() + 1)]
    return [shape for shape in found if shape is not None and not shape.IsNull()]


def _volume(solid: Any) -> float:
    """mm^3, by OCCT's own integrals: a file may hold faces that `measure.volume` has no formula for."""
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(solid, found)
    return float(found.Mass())


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
    from OCP.BRepCheck import BRepCheck_Analyzer

    from vmachining.engines.brep.occt.parts import has_open_shell

    if not BRepCheck_Analyzer(solid).IsValid():
        raise StockError(f"{what} is not a valid shape", file=name, remedy="repair it in the CAD system")
    if has_open_shell(solid):
        raise StockError(f"{what} is not closed", file=name, remedy="export the part as a closed solid")
    held = _volume(solid)
    if not held > 0.0:
        raise StockError(f"{what} has the volume {held:.6g} mm3", file=name, remedy="check its orientation")


def _joined(solids: list[Any], name: str) -> Any:
    """A compound of solids that do not share volume."""
    from vmachining.engines.brep.occt.booleans import apart, common
    from vmachining.engines.brep.occt.parts import compound

    for i, one in enumerate(solids):
        for other in solids[i + 1 :]:
            if apart(one, other):
                continue
            try:
                shared = _volume(common(one, other, 0.0))
            except EngineError as exc:
                what = f"OCCT cannot tell whether its solids overlap: {exc.reason}"
                raise StockError(what, file=name) from exc
            if shared > 1e-9 * min(_volume(one), _volume(other)):
                raise StockError("contains solids that overlap", file=name, remedy="join them into one")
    return compound(solids)


def _triangles(solid: Any, chord: float, name: str) -> tuple[Floats, Ints, Bools]:
    """Outward triangles of every face, points merged by position; and which are of curved faces."""
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.GeomAbs import GeomAbs_SurfaceType

    from vmachining.engines.brep.occt.parts import faces_of, triangles_of

    BRepMesh_IncrementalMesh(solid, chord, False, STEP_FACET_RAD, False)
    points: list[Floats] = []
    triangles: list[Ints] = []
    curved: list[Bools] = []
    offset = 0
    for face in faces_of(solid):
        mesh = triangles_of(face)
        if mesh is None:
            raise StockError("a face cannot be triangulated", file=name, remedy="repair it in the CAD system")
        nodes, corners = mesh
        flat_face = BRepAdaptor_Surface(face).GetType() == GeomAbs_SurfaceType.GeomAbs_Plane
        points.append(nodes)
        curved.append(np.full(len(corners), not flat_face))
        triangles.append(corners + offset)
        offset += len(nodes)
    vertices = np.concatenate(points)
    # points of a shared edge agree to rounding; cells of 1e-7 mm, OCCT's own confusion, make them one
    _, first, member = np.unique(np.round(vertices, 7), axis=0, return_index=True, return_inverse=True)
    merged = member.reshape(-1)[np.concatenate(triangles)]
    flat = (merged[:, 0] == merged[:, 1]) | (merged[:, 1] == merged[:, 2]) | (merged[:, 2] == merged[:, 0])
    return vertices[first], merged[~flat], np.concatenate(curved)[~flat]
