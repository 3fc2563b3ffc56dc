"""Solids that OCCT makes by itself: boxes, cylinders, bodies of revolution; and shapes turned."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakeWire,
    BRepBuilderAPI_Transform,
)
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakeRevol
from OCP.gp import gp_Ax1, gp_Ax2, gp_Dir, gp_Pnt, gp_Trsf
from OCP.TopoDS import TopoDS

from vmachining.arrays import Floats
from vmachining.engines.brep.occt.shapes import Curve, pnt
from vmachining.engines.brep.occt.tolerances import ODD_RAD
from vmachining.errors import EngineError


def box(lo: Sequence[float], hi: Sequence[float]) -> Any:
    """Axis-parallel, (3,) mm each."""
    return BRepPrimAPI_MakeBox(gp_Pnt(*lo), gp_Pnt(*hi)).Shape()


def cylinder(center: Sequence[float], radius: float, z: Sequence[float]) -> Any:
    """Upright about (x, y), from z[0] to z[1]; mm."""
    foot = gp_Ax2(gp_Pnt(*center, z[0]), gp_Dir(0.0, 0.0, 1.0))
    return BRepPrimAPI_MakeCylinder(foot, radius, z[1] - z[0]).Shape()


def revolved(outline: Sequence[Curve], center: Floats) -> Any:
    """TopoDS_Solid of a closed outline in a half plane of the upright axis through `center`, turned once.

    Raises EngineError: The outline does not close.
    """
    wire = BRepBuilderAPI_MakeWire()
    for curve in outline:
        wire.Add(BRepBuilderAPI_MakeEdge(curve.geom, curve.t0, curve.t1).Edge())
    if not wire.IsDone():
        raise EngineError("the meridian of a turned sweep does not close", engine="brep")
    face = BRepBuilderAPI_MakeFace(wire.Wire(), True)
    axis = gp_Ax1(pnt(center), gp_Dir(0.0, 0.0, 1.0))
    return TopoDS.Solid_s(BRepPrimAPI_MakeRevol(face.Face(), axis).Shape())


def rotated(shape: Any, matrix: ArrayLike) -> Any:
    """The shape turned about the origin by a rotation (3, 3): its x is where the first column says."""
    motion = gp_Trsf()
    motion.SetValues(*np.column_stack([matrix, np.zeros(3)]).ravel().tolist())
    return BRepBuilderAPI_Transform(shape, motion, True).Shape()


def oddly_turned(shape: Any) -> Any:
    """The shape turned by `ODD_RAD` about a slanting axis through the origin; volumes stay."""
    motion = gp_Trsf()
    motion.SetRotation(gp_Ax1(gp_Pnt(0.0, 0.0, 0.0), gp_Dir(1.0, 2.0, 3.0)), ODD_RAD)
    return BRepBuilderAPI_Transform(shape, motion, True).Shape()
