"""Removed volume from level sections: planar booleans where booleans of solids hang or go wrong.

Sheets of two helices over each other touch along whole curves; OCCT walks along such contacts for minutes. A
level plane meets every face in a curve of its own, and two curves in a plane that touch do so in a point. So

1. at height z every solid has a section, a plane face; the one of the stock minus those of the earlier sweeps has
   an area, and a smaller one after those of the block's own solids are cut from it, too: the difference A(z) is
   what the block removes there (edges of plane faces never meet faces of solids: that was three times as slow).
   The sections of the block less all others must give the same area, else all is cut at once, and if no two of the
   three agree the plane moves by a little;
2. A is integrated by Clenshaw-Curtis rules of 3, 5, 9, 17 and 33 heights between the heights known not to be
   smooth (ends of motions, joints of the tools). Each rule takes over the heights of the one before. Where two
   sections begin to meet A has a kink nobody knows of: the error of a rule then falls by four on the average, and
   by luck two rules may agree. So the error stated is the larger of what the last two rules differ by and a
   quarter of what the two before do.

The faces are those of the solids, exact to their fits; only the integral over z is a quadrature.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep.booleans import apart, common, is_empty, minus
from vmachining.engines.brep.measure import area
from vmachining.errors import EngineError

__all__ = ["integrated", "level_area"]

RULES = (2, 4, 8, 16, 32)
"""Intervals of the nested rules."""

MARGIN = 1.0
"""mm by which the plane is larger than the box of the block."""

ROUNDING = 1e-5
"""Relative, and mm^2: edges of 10 mm that OCCT knows to 1e-7 mm, ten times over."""

NUDGES = (0.0, 1e-5, 1e-4, 1e-3)
"""Parts of the height left in the box by which a section moves where planar booleans go wrong."""

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
    total = error = 0.0
    for a, b in pairwise(kept):
        value, miss = _piece(f, a, b, tol * (b - a) / (high - low))
        total, error = total + value, error + miss
    return total, error


def _piece(f: Callable[[float], float], a: float, b: float, tol: float) -> tuple[float, float]:
    known: dict[float, float] = {}
    last, value, miss, step = np.nan, 0.0, np.inf, np.inf
    for count in RULES:
        x, w = _clenshaw_curtis(count)
        for s in x.tolist():
            if s not in known:
                known[s] = f(a + (b - a) * s)
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


def level_area(z: float, stock: Any, parts: Sequence[Any], others: Sequence[Any], box: Floats) -> float:
    """mm^2 that solids `parts` take at a height from what `others` leave of the stock.

    box : (2, 3) mm, of the block.

    Raises
    ------
    EngineError
        No height close by at which two of three ways of cutting find the same area.
    """
    reason = ""
    for nudge in NUDGES:
        at = z + nudge * (
            float(box[1, 2]) - z if z < 0.5 * float(box[0, 2] + box[1, 2]) else float(box[0, 2]) - z
        )
        known: list[float] = []
        for way in _areas(at, stock, parts, others, box):
            try:
                value = way()
            except EngineError as exc:
                reason = str(exc)
                continue
            if any(abs(value - other) <= ROUNDING * (1.0 + abs(value)) for other in known):
                return value
            known.append(value)
        reason = f"{known} mm2 at height {at:.6g}" if known else reason
    raise EngineError(f"no area of a level section: {reason}", engine="brep")


def _areas(
    z: float, stock: Any, parts: Sequence[Any], others: Sequence[Any], box: Floats
) -> tuple[Callable[[], float], ...]:
    """Three ways to the area: what is left of the stock, piece by piece or all at once, and pieces of the parts."""
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.gp import gp_Dir, gp_Pln, gp_Pnt

    place = gp_Pln(gp_Pnt(float(box[0, 0]) - MARGIN, float(box[0, 1]) - MARGIN, z), gp_Dir(0.0, 0.0, 1.0))
    wide, deep = (box[1, :2] - box[0, :2] + 2.0 * MARGIN).tolist()
    plane = BRepBuilderAPI_MakeFace(place, 0.0, wide, 0.0, deep).Face()

    def sections(solids: Sequence[Any]) -> list[Any]:
        found = [common(plane, solid, 0.0) for solid in solids if not apart(plane, solid)]
        return [face for face in found if not is_empty(face)]

    whole, gone, own = common(plane, stock, 0.0), sections(others), sections(parts)

    def of_stock() -> float:
        rest = _without(whole, gone)
        return area(rest) - area(_without(rest, own))

    def of_parts() -> float:
        return sum(area(_without(common(face, whole, 0.0), [*gone, *own[:k]])) for k, face in enumerate(own))

    def at_once() -> float:
        rest = minus(whole, gone, 0.0) if gone else whole
        return area(rest) - area(minus(rest, own, 0.0)) if own else 0.0

    return of_stock, of_parts, at_once


def _without(face: Any, others: Sequence[Any]) -> Any:
    """What others leave of a face, one after the other."""
    for other in others:
        if is_empty(face):
            break
        if not apart(face, other):
            face = minus(face, [other], 0.0)
    return face
