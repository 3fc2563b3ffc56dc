"""`held`: which points lie in a union of solids, by how often rays cross their faces.

OCCT's own classifier (`BRepClass3d_SolidClassifier`) was seen to call nearly all points of a valid solid with a
sliver face outside; its intersections of lines with faces are right there, and ten times as fast.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vmachining.arrays import Bools, Floats
from vmachining.errors import EngineError

__all__ = ["held"]

ON_MM = 1e-7
"""OCCT's confusion of points."""

SAME_MM = 1e-6
"""Crossings closer than this are one: a ray through an edge meets both faces."""

FAR_MM = 1e6

RAYS = 3
"""Rays of a point; the majority counts, as one may touch a face or an edge."""


def held(shapes: Sequence[Any], points: Floats) -> Bools:
    """(n,) bool: whether points (n, 3) mm lie in one of some TopoDS_Solids.

    Raises
    ------
    EngineError
        OCCT gives up on a line.
    """
    from OCP.gp import gp_Dir, gp_Lin, gp_Pnt
    from OCP.IntCurvesFace import IntCurvesFace_ShapeIntersector

    rng = np.random.default_rng(4)
    out = np.zeros(len(points), dtype=np.bool_)
    for shape in shapes:
        meet = IntCurvesFace_ShapeIntersector()
        meet.Load(shape, ON_MM)
        for k in np.flatnonzero(~out):
            votes = 0
            for way in rng.normal(size=(RAYS, 3)).tolist():
                meet.Perform(gp_Lin(gp_Pnt(*points[k].tolist()), gp_Dir(*way)), 0.0, FAR_MM)
                if not meet.IsDone():
                    raise EngineError("OCCT cannot tell where a line meets a solid", engine="brep")
                found = np.sort([meet.WParameter(i) for i in range(1, meet.NbPnt() + 1)])
                crossings = len(found) - int((np.diff(found) < SAME_MM).sum())
                votes += crossings % 2
            out[k] = 2 * votes > RAYS
    return out
