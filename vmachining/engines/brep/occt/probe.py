"""`Probe`: where curves meet a solid, and on which side of it points lie."""

from __future__ import annotations

from typing import Any

import numpy as np
from OCP.BRepClass3d import BRepClass3d_SolidClassifier
from OCP.GeomAdaptor import GeomAdaptor_Curve
from OCP.gp import gp_Dir, gp_Lin
from OCP.IntCurvesFace import IntCurvesFace_ShapeIntersector
from OCP.TopAbs import TopAbs_State

from vmachining.arrays import Floats
from vmachining.engines.brep.occt.booleans import box_of
from vmachining.engines.brep.occt.shapes import Curve, pnt
from vmachining.engines.brep.occt.tolerances import ON_FACE_MM, ON_FACE_SLANTED_MM

ODD = (
    (0.5347, 0.3126, 0.7851),
    (-0.6218, 0.5803, 0.5257),
    (0.2391, -0.8714, 0.4283),
    (0.1873, 0.4457, -0.8754),
)
"""Directions that no face of a job lies in."""


class Probe:
    """One TopoDS_Solid that curves and points can be asked against. box : (2, 3) mm."""

    def __init__(self, shape: Any) -> None:
        self._shape = shape
        self._hits = IntCurvesFace_ShapeIntersector()
        self._hits.Load(shape, 1e-8)
        self._sides = BRepClass3d_SolidClassifier(shape)
        self.box = box_of(shape)
        self._far = float(np.linalg.norm(self.box[1] - self.box[0])) + 1.0

    def parameters(self, curve: Curve) -> Floats:
        """Rising parameters where the curve meets a face."""
        self._hits.Perform(GeomAdaptor_Curve(curve.geom, curve.t0, curve.t1), curve.t0, curve.t1)
        if not self._hits.IsDone():
            return np.empty(0)
        found = [self._hits.WParameter(k) for k in range(1, self._hits.NbPnt() + 1)]
        return np.sort([t for t in found if curve.t0 < t < curve.t1])

    def side(self, point: Floats) -> int:
        """1 in the solid, 0 on its surface, -1 outside.

        Lines in odd directions count the faces they meet beyond the point: two that agree and cross no edge
        decide. OCCT's classifier is asked where none do; it takes 50 times as long on faces of many knots.
        """
        if (point < self.box[0] - ON_FACE_MM).any() or (point > self.box[1] + ON_FACE_MM).any():
            return -1
        origin = pnt(point)
        seen: list[int] = []
        for direction in ODD:
            # from far behind: OCCT starts from facets, and a line that begins between facet and face meets neither
            self._hits.Perform(gp_Lin(origin, gp_Dir(*direction)), -self._far, self._far)
            hits = [(k, self._hits.WParameter(k)) for k in range(1, self._hits.NbPnt() + 1)]
            ahead = [(k, w) for k, w in hits if w >= -ON_FACE_SLANTED_MM]
            if any(w <= ON_FACE_SLANTED_MM for _, w in ahead):
                return 0
            if any(self._hits.State(k) != TopAbs_State.TopAbs_IN for k, _ in ahead):
                continue  # through an edge: two faces, or one
            seen.append(1 if len(ahead) % 2 else -1)
            if seen.count(seen[-1]) == 2:
                return seen[-1]
        self._sides.Perform(origin, ON_FACE_MM)
        state = self._sides.State()
        return 1 if state == TopAbs_State.TopAbs_IN else 0 if state == TopAbs_State.TopAbs_ON else -1
