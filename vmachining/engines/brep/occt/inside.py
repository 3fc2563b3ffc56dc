"""`Union`, `held`: which points lie in a union of solids, by how often rays cross their faces; `inside_out`.

OCCT's own classifier (`BRepClass3d_SolidClassifier`) was seen to call nearly all points of a valid solid with a
sliver face outside; its intersections of lines with faces are right there, and ten times as fast. They were seen
to fail for every line on a sliver of a torus 4e-3 x 7e-5 mm wide, so faces are asked one by one: a line
counts where each face that OCCT has no answer for is passed at a distance, which a look at its box tells.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vmachining.arrays import Bools, Floats
from vmachining.engines.brep.occt.tolerances import CONFUSION_MM, SAME_CROSSING_MM
from vmachining.errors import EngineError

FAR_MM = 1e6

RAYS = 3
"""Rays of a point; the majority counts, as one may touch a face or an edge: two that agree are one."""

TRIES = 12
"""Directions tried until a majority of `RAYS` agree."""


class Union:
    """Some TopoDS_Solids, to be asked which points they hold."""

    def __init__(self, shapes: Sequence[Any]) -> None:
        self._rng = np.random.default_rng(4)
        self._solids = sorted(map(_Faces, shapes), key=lambda faces: -faces.whole.SquareExtent())

    def holds(self, points: Floats) -> Bools:
        """(n,) bool: whether points (n, 3) mm lie in one of the solids.

        Raises EngineError: Too many lines through a point meet a face that OCCT cannot intersect.
        """
        by = np.full(len(points), -1)
        for k, point in enumerate(points):
            before = by[:k] >= 0
            gap = np.full(len(self._solids), np.inf)  # what holds a point is likely to hold the next one
            np.minimum.at(gap, by[:k][before], ((points[:k][before] - point) ** 2).sum(axis=1))
            order = np.argsort(gap, kind="stable").tolist()  # else large ones first, which hold most
            for hasty in (True, False):
                ways = self._rng.normal(size=(TRIES, 3))
                by[k] = next((i for i in order if self._solids[i].hold(point, ways, hasty=hasty)), -1)
                if by[k] >= 0:
                    break
        return by >= 0


def held(shapes: Sequence[Any], points: Floats) -> Bools:
    """As `Union.holds`."""
    return Union(shapes).holds(points)


def inside_out(shape: Any) -> bool:
    """Whether OCCT takes a TopoDS_Solid for all that lies around it, as it then does when it reads it from STEP."""
    from OCP.BRepClass3d import BRepClass3d_SolidClassifier
    from OCP.TopAbs import TopAbs_State

    far = BRepClass3d_SolidClassifier(shape)
    far.PerformInfinitePoint(CONFUSION_MM)
    return bool(far.State() != TopAbs_State.TopAbs_OUT)


class _Faces:
    """Faces of a solid, to be met by lines."""

    def __init__(self, shape: Any) -> None:
        from OCP.Bnd import Bnd_Box
        from OCP.BRepBndLib import BRepBndLib
        from OCP.IntCurvesFace import IntCurvesFace_Intersector
        from OCP.TopAbs import TopAbs_ShapeEnum
        from OCP.TopExp import TopExp_Explorer
        from OCP.TopoDS import TopoDS

        self.faces: list[tuple[Any, Any]] = []
        self.whole = Bnd_Box()
        found = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
        while found.More():
            face, box = TopoDS.Face_s(found.Current()), Bnd_Box()
            BRepBndLib.Add_s(face, box)
            self.whole.Add(box)
            self.faces.append((IntCurvesFace_Intersector(face, CONFUSION_MM), box))
            found.Next()

    def hold(self, point: Floats, ways: Floats, *, hasty: bool) -> bool:
        """Whether a point lies inside, by rays along some of the ways (n, 3); `hasty` believes one that says no."""
        from OCP.gp import gp_Pnt

        if self.whole.IsOut(gp_Pnt(*point.tolist())):
            return False
        votes = [0, 0]
        for way in ways:
            odd = self.odd(point, way)
            if odd is not None:
                votes[odd] += 1
            if 2 * max(votes) > RAYS or (hasty and votes[0]):
                return votes[1] > votes[0]
        place = np.array2string(point, precision=6)
        raise EngineError(f"OCCT cannot tell where lines through {place} mm meet a solid", engine="brep")

    def odd(self, point: Floats, way: Floats) -> bool | None:
        """Whether a ray leaves through the faces an odd number of times; None where OCCT cannot tell.

        The whole line is requested: a spline face is looked for near facets of it, and of a line that begins between
        these and the face the first crossing was lost.
        """
        from OCP.gp import gp_Dir, gp_Lin, gp_Pnt

        line, crossings = gp_Lin(gp_Pnt(*point.tolist()), gp_Dir(*way.tolist())), []
        for face, box in self.faces:
            if box.IsOut(line):
                continue
            face.Perform(line, -FAR_MM, FAR_MM)
            if not face.IsDone():
                return None
            found = [face.WParameter(i) for i in range(1, face.NbPnt() + 1)]
            crossings += [s for s in found if s > 0.0]
        apart = np.diff(np.sort(crossings)) >= SAME_CROSSING_MM
        return bool(crossings) and int(apart.sum()) % 2 == 0
