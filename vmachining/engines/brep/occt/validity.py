"""`inspect`: what OCCT says about a solid; `refuse_unsound`: what a workpiece must be."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from vmachining.engines.brep.occt.booleans import is_empty
from vmachining.engines.brep.occt.measure import volume
from vmachining.engines.brep.occt.parts import (
    faces_of,
    has_loose_faces,
    has_open_shell,
    shells_of,
    without_crumbs,
)
from vmachining.errors import EngineError


class Inspection(NamedTuple):
    """valid : by BRepCheck. closed : one shell, every edge on two faces. faces, edges : counts.

    shortest_mm : shortest edge that is not degenerate. degenerate : edges without length (a cone's apex).
    volume : mm^3.
    """

    valid: bool
    closed: bool
    faces: int
    edges: int
    shortest_mm: float
    degenerate: int
    volume: float


def inspect(shape: Any) -> Inspection:
    """What a TopoDS_Solid is made of, asked of OCCT."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.GCPnts import GCPnts_AbscissaPoint
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp
    from OCP.TopoDS import TopoDS
    from OCP.TopTools import TopTools_IndexedDataMapOfShapeListOfShape

    owners = TopTools_IndexedDataMapOfShapeListOfShape()
    TopExp.MapShapesAndAncestors_s(shape, TopAbs_ShapeEnum.TopAbs_EDGE, TopAbs_ShapeEnum.TopAbs_FACE, owners)
    shortest, degenerate, closed = np.inf, 0, len(shells_of(shape)) == 1
    for k in range(1, owners.Extent() + 1):
        edge = TopoDS.Edge_s(owners.FindKey(k))
        if BRep_Tool.Degenerated_s(edge):
            degenerate += 1
            continue
        shortest = min(shortest, GCPnts_AbscissaPoint.Length_s(BRepAdaptor_Curve(edge), 1e-6))
        closed = closed and owners.FindFromIndex(k).Extent() == 2
    return Inspection(
        valid=bool(BRepCheck_Analyzer(shape).IsValid()),
        closed=bool(closed),
        faces=len(faces_of(shape)),
        edges=owners.Extent(),
        shortest_mm=float(shortest),
        degenerate=degenerate,
        volume=volume(shape),
    )


def refuse_unsound(shape: Any) -> None:
    """Whether a workpiece is valid, and every shell closed and the boundary of a solid that holds something.

    There may be several solids, or a hole inside of one.

    Raises EngineError: It is not so.
    """
    if not inspect(shape).valid:
        raise EngineError("OCCT does not call the workpiece a valid shape", engine="brep")
    if has_loose_faces(shape) or has_open_shell(shape):
        raise EngineError("OCCT does not call the workpiece closed", engine="brep")
    if is_empty(without_crumbs(shape)):
        raise EngineError("nothing is left of the stock", engine="brep")
