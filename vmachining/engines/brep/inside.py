"""`held`: which points lie in a union of solids."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vmachining.arrays import Bools, Floats

__all__ = ["held"]

ON_MM = 1e-7
"""OCCT's confusion of points: what is nearer to a face lies on it."""


def held(shapes: Sequence[Any], points: Floats) -> Bools:
    """(n,) bool: points (n, 3) mm in or on one of some TopoDS_Solids, by OCCT's classifier."""
    from OCP.BRepClass3d import BRepClass3d_SolidClassifier
    from OCP.gp import gp_Pnt
    from OCP.TopAbs import TopAbs_State

    out = np.zeros(len(points), dtype=np.bool_)
    for shape in shapes:
        search = BRepClass3d_SolidClassifier(shape)
        for k in np.flatnonzero(~out):
            search.Perform(gp_Pnt(*points[k].tolist()), ON_MM)
            out[k] = search.State() != TopAbs_State.TopAbs_OUT
    return out
