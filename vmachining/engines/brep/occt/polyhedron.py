"""A stock of triangles as a solid: plane faces, coplanar neighbours made one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vmachining.engines.brep.occt.tolerances import CONFUSION_MM, POLYHEDRON_REL
from vmachining.engines.brep.occt.validity import inspect
from vmachining.errors import EngineError


def polyhedron(triangles: Sequence[Sequence[float]]) -> Any:
    """TopoDS_Solid inside triangles (n, 9), mm, whose corners turn counterclockwise seen from outside.

    Raises EngineError: OCCT does not call it valid and closed, or finds another volume than the triangles have.
    """
    from OCP.BRepBuilderAPI import (
        BRepBuilderAPI_MakeFace,
        BRepBuilderAPI_MakePolygon,
        BRepBuilderAPI_MakeSolid,
        BRepBuilderAPI_Sewing,
    )
    from OCP.gp import gp_Pnt
    from OCP.ShapeUpgrade import ShapeUpgrade_UnifySameDomain
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopoDS import TopoDS

    corners = np.asarray(triangles, dtype=np.float64).reshape(-1, 3, 3)
    sewing = BRepBuilderAPI_Sewing(CONFUSION_MM)
    for corner in corners.tolist():
        outline = BRepBuilderAPI_MakePolygon(*(gp_Pnt(*p) for p in corner), True)
        sewing.Add(BRepBuilderAPI_MakeFace(outline.Wire(), True).Face())
    sewing.Perform()
    skin = sewing.SewedShape()
    if skin.ShapeType() != TopAbs_ShapeEnum.TopAbs_SHELL:
        raise EngineError("the triangles of the stock are not one closed shell", engine="brep")
    bare = BRepBuilderAPI_MakeSolid(TopoDS.Shell_s(skin)).Solid()
    merged = ShapeUpgrade_UnifySameDomain(bare, True, True, False)
    merged.SetLinearTolerance(CONFUSION_MM)
    merged.SetAngularTolerance(CONFUSION_MM)
    merged.Build()
    a, b, c = (corners - corners.mean(axis=(0, 1))).transpose(1, 0, 2)
    exact = float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6.0)
    why = ""
    # corners rounded to 32 bits spoil planes that neighbours share: then every triangle is its own face
    for solid in (merged.Shape(), bare):
        found = inspect(solid)
        if not (found.valid and found.closed):
            why = "OCCT makes no valid solid of the triangles of the stock"
        elif abs(found.volume - exact) > POLYHEDRON_REL * len(corners) * abs(exact):
            why = f"the triangles of the stock hold {exact:.9g} mm3, OCCT finds {found.volume:.9g}"
        else:
            return solid
    raise EngineError(why, engine="brep")
