"""Removed volume from level sections: planar booleans where booleans of solids hang or go wrong.

Sheets of two helices over each other touch along whole curves; OCCT walks along such contacts for minutes. A
level plane meets every face in a curve of its own, and two curves in a plane that touch do so in a point. So

1. at height z every solid has a section, a plane face, whose outline is followed with `SAG` mm; what the outlines
   of the block, of the earlier sweeps and of the stock leave of each other is a matter of polygons (Clipper2), which
   never fails: the area A(z) is what the block removes there. An outline has to have the area of its face (edges of
   plane faces never meet faces of solids: that was three times as slow);
2. A is integrated by Clenshaw-Curtis rules of 3, 5, 9, 17 and 33 heights between the heights known not to be
   smooth (ends of motions, joints of the tools). Each rule takes over the heights of the one before. Where two
   sections begin to meet A has a kink nobody knows of: the error of a rule then falls by four on the average, and
   by luck two rules may agree. So the error stated is the larger of what the last two rules differ by and a
   quarter of what the two before do.

The faces are those of the solids, exact to their fits; only the integral over z is a quadrature.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from manifold3d import CrossSection, FillRule, OpType

from vmachining.arrays import Floats
from vmachining.engines.brep.booleans import apart, box_of, common, is_empty
from vmachining.engines.brep.measure import area
from vmachining.errors import EngineError

__all__ = ["integrated", "level_area"]

RULES = (2, 4, 8, 16, 32)
"""Intervals of the nested rules."""

MARGIN = 1.0
"""mm by which the plane is larger than the box of the block."""

SAG = 1e-5
"""mm between an edge and the chords that stand for it. Their ends are moved outward until a chord and its arc have
the same area, so that only the ends of an edge err, by about sag times chord: 1e-7 mm^2."""

LOOKS, MOST = 33, 8192
"""Points at which an edge is looked at first, and most points of one."""

ROUNDING = 1e-5
"""Relative, and mm^2, by which the area of an outline may differ from that of its face: edges of 10 mm that OCCT
knows to 1e-7 mm, ten times over."""

NUDGES = (0.0, 1e-5, 1e-4, 1e-3)
"""Parts of the height left in the box by which a section moves where it goes wrong."""

CLOSE = 0.02
"""Of the range of heights: ends of pieces closer than this are one."""


def integrated(f: Callable[[float], float], stops: Sequence[float], tol: float) -> tuple[float, float]:
    """(integral, error) of f between the first and the last stop, smooth between neighbouring ones.

    tol : error at which a piece is good enough, shared out by length.
    """
    low, high = min(stops), max(stops)
    kept = [low]
    for z in sorted(stops):
        if z - kept[-1] > CLOSE * (high - low) and high - z > CLOSE * (high - low):
            kept.append(z)
    kept.append(high)
    total, error, once = 0.0, 0.0, cache(f)  # neighbouring pieces share a height
    for a, b in pairwise(kept):
        value, miss = _piece(once, a, b, tol * (b - a) / (high - low))
        total, error = total + value, error + miss
    return total, error


def _piece(f: Callable[[float], float], a: float, b: float, tol: float) -> tuple[float, float]:
    known: dict[float, float] = {}
    last, value, miss, step = np.inf, 0.0, np.inf, np.inf
    for count in RULES:
        x, w = _clenshaw_curtis(count)
        for s in x.tolist():
            if s not in known:
                known[s] = f(b if s == 1.0 else a + (b - a) * s)
        value = (b - a) * float(w @ [known[s] for s in x.tolist()])
        miss, step = max(abs(value - last), 0.25 * step), abs(value - last)
        if miss <= tol:
            break
        last = value
    return value, miss


@cache
def _clenshaw_curtis(count: int) -> tuple[Floats, Floats]:
    """Nodes on [0, 1] and weights; the nodes of `count` are among those of 2 `count`, to the bit."""
    k = np.arange(count + 1)
    x = np.sin(0.5 * np.pi * (k * (RULES[-1] // count)) / RULES[-1]) ** 2
    w = np.zeros(count + 1)
    for j in range(count + 1):
        terms = [
            (0.5 if m == count // 2 else 1.0)
            * 2.0
            * np.cos(2.0 * np.pi * m * j / count)
            / (1.0 - 4.0 * m * m)
            for m in range(1, count // 2 + 1)
        ]
        w[j] = (1.0 + sum(terms)) / count * (0.5 if j in (0, count) else 1.0)
    return x, w


def level_area(
    z: float, stock: Any, parts: Sequence[Any], others: Sequence[Any], box: Floats
) -> tuple[float, float]:
    """mm^2 that solids `parts` take at a height from what `others` leave of the stock, and by how much it may be off.

    box : (2, 3) mm, of the block.

    Raises
    ------
    EngineError
        No height close by at which every section has an outline of its own area.
    """
    reason = ""
    for nudge in NUDGES:
        at = z + nudge * (
            float(box[1, 2]) - z if z < 0.5 * float(box[0, 2] + box[1, 2]) else float(box[0, 2]) - z
        )
        try:
            return _area(at, stock, parts, others, box)
        except EngineError as exc:
            reason = str(exc)
    raise EngineError(f"no area of a level section: {reason}", engine="brep")


def _area(
    z: float, stock: Any, parts: Sequence[Any], others: Sequence[Any], box: Floats
) -> tuple[float, float]:
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.gp import gp_Dir, gp_Pln, gp_Pnt

    place = gp_Pln(gp_Pnt(float(box[0, 0]) - MARGIN, float(box[0, 1]) - MARGIN, z), gp_Dir(0.0, 0.0, 1.0))
    wide, deep = (box[1, :2] - box[0, :2] + 2.0 * MARGIN).tolist()
    plane = BRepBuilderAPI_MakeFace(place, 0.0, wide, 0.0, deep).Face()

    doubt = 0.0

    def union(solids: Sequence[Any]) -> CrossSection:
        nonlocal doubt
        outlines = []
        for solid in solids:
            if not apart(plane, solid):
                outline, miss = _outline(common(plane, solid, 0.0))
                outlines.append(outline)
                doubt += miss
        return CrossSection.batch_boolean(outlines, OpType.Add) if outlines else CrossSection()

    left = union(parts) ^ union([stock])
    if left.is_empty():
        return 0.0, doubt
    x0, y0, x1, y1 = left.bounds()
    near = [b for b in others if _overlap(box_of(b), x0, y0, x1, y1)]
    return float((left - union(near)).area()), doubt


def _overlap(box: Floats, x0: float, y0: float, x1: float, y1: float) -> bool:
    """Whether a box reaches over a rectangle."""
    return bool(box[0, 0] < x1 and box[1, 0] > x0 and box[0, 1] < y1 and box[1, 1] > y0)


def _outline(section: Any) -> tuple[CrossSection, float]:
    """Plane faces as polygons, and by how much (mm^2) their areas differ."""
    if is_empty(section):
        return CrossSection(), 0.0
    found = CrossSection(list(_loops(section)), FillRule.EvenOdd)
    wanted = area(section)
    miss = abs(float(found.area()) - wanted)
    if not miss <= ROUNDING * (1.0 + wanted):
        raise EngineError(f"an outline misses the {wanted:.9g} mm2 of its face by {miss:.3g}", engine="brep")
    return found, miss


def _loops(section: Any) -> Iterator[Floats]:
    """Wires of faces as closed polygons (n, 2)."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.BRepTools import BRepTools_WireExplorer
    from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS

    wires = TopExp_Explorer(section, TopAbs_ShapeEnum.TopAbs_WIRE)
    while wires.More():
        walk, loop = BRepTools_WireExplorer(TopoDS.Wire_s(wires.Current())), []
        while walk.More():
            edge = walk.Current()
            points = _followed(BRepAdaptor_Curve(edge))
            loop.append(
                points[:0:-1] if edge.Orientation() == TopAbs_Orientation.TopAbs_REVERSED else points[:-1]
            )
            walk.Next()
        wires.Next()
        if loop:
            yield np.ascontiguousarray(np.concatenate(loop))


def _followed(curve: Any) -> Floats:
    """Points (n, 2) of an edge in a level plane, with its ends; see `SAG`."""
    from OCP.GeomAbs import GeomAbs_CurveType

    def at(count: int) -> Floats:
        where = np.linspace(curve.FirstParameter(), curve.LastParameter(), count)
        found = [curve.Value(float(t)) for t in where]
        return np.array([(p.X(), p.Y()) for p in found])

    if curve.GetType() == GeomAbs_CurveType.GeomAbs_Line:
        return at(2)
    coarse = at(LOOKS)
    sag = 0.125 * float(np.linalg.norm(np.diff(coarse, 2, axis=0), axis=1).max())
    points = at(min(MOST, int(np.ceil((LOOKS - 1) * np.sqrt(max(sag, SAG) / SAG))) + 1))
    points[1:-1] -= np.diff(points, 2, axis=0) / 12.0  # two thirds of the sag
    return points
