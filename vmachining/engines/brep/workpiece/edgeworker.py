"""The process behind `edges.py`: `python -m vmachining.engines.brep.workpiece.edgeworker`.

Pickled messages over stdin and stdout: first (stock, past, code of the stock), answered by "ready"; then "build",
and questions (edge, stance, phi, parts), answered by parts, or by what was refused.

1. A part of an edge becomes a line, a circle or a quintic spline within `FIT_MM` of the wound edge.
2. Its intersections with the faces of a solid cut it, and so do `PIECES` even cuts. The middle of every piece is
   classified; where neighbours differ without an intersection between them, halving with the classifier finds
   the end. So a missed intersection costs digits (1e-7 mm), and only a feature shorter than a piece is lost.
3. Points within about `ON_MM` of a surface are on it: the stock's belongs to the stock, that of a sweep does too.
"""

from __future__ import annotations

import os
import pickle
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np

from vmachining.arrays import Bools, Floats
from vmachining.engines.brep.blank import Blank
from vmachining.engines.brep.occt.booleans import box_of, quiet
from vmachining.engines.brep.occt.shapes import Circle, Curve, Frame, Straight, interpolated, pnt
from vmachining.engines.brep.process import obey_driver
from vmachining.engines.brep.swept import solids
from vmachining.errors import SweepError, VMachiningError
from vmachining.sweep import Stance, Sweep
from vmachining.sweep.reach import meets, reaching
from vmachining.tool import Edge, EdgeParts

__all__ = ["Members", "edge_curve", "main"]

ON_MM = 1e-6
"""Ten times OCCT's confusion: what is nearer to a surface than this is on it."""

CLOSE_MM = 5e-6
"""A face that an odd line meets nearer than this holds the point: `ON_MM` seen at an angle of 12 degrees."""

ODD = (
    (0.5347, 0.3126, 0.7851),
    (-0.6218, 0.5803, 0.5257),
    (0.2391, -0.8714, 0.4283),
    (0.1873, 0.4457, -0.8754),
)
"""Directions that no face of a job lies in."""

FIT_MM = 1e-9
"""Of splines that stand for wound edges."""

PIECES = 8
"""Even cuts of a part beside its intersections: a feature longer than an eighth of a part is not lost."""

SLIVER_MM = 0.01
"""Shorter pieces whose middle is on a surface are where two round surfaces touch."""


def edge_curve(edge: Edge, stance: Stance, phi: float, piece: int, lower: float, upper: float) -> Curve:
    """The part of an edge as a curve whose parameter grows in proportion to s."""
    s = edge.segments[piece]
    if edge.twist != 0.0:

        def at(t: Floats) -> Floats:
            return stance.points(edge, np.full(len(t), phi), np.full(len(t), piece), t)

        return interpolated(at, lower, upper, FIT_MM)
    ends = stance.points(edge, np.full(2, phi), np.full(2, piece), np.array([lower, upper]))
    if not s.is_arc:
        return Straight(ends[0], ends[1])
    m = stance.radial(np.array([phi]))[0]
    start = s.beta[0] + (np.array([lower, upper]) - edge.joints[piece]) / s.radius
    center = stance.tip + s.cr * m + s.cz * stance.axis
    frame = Frame(center, np.cross(m, stance.axis), m)  # its y is the axis
    return Circle(frame, s.radius, float(start[0]), float(start[1]))


class Solid:
    """One solid that curves can be asked against."""

    def __init__(self, shape: Any) -> None:
        from OCP.BRepClass3d import BRepClass3d_SolidClassifier
        from OCP.IntCurvesFace import IntCurvesFace_ShapeIntersector

        self._shape = shape
        self._hits = IntCurvesFace_ShapeIntersector()
        self._hits.Load(shape, 1e-8)
        self._sides = BRepClass3d_SolidClassifier(shape)
        self.box = box_of(shape)
        self._far = float(np.linalg.norm(self.box[1] - self.box[0])) + 1.0

    def parameters(self, curve: Curve) -> Floats:
        """Rising parameters where the curve meets a face."""
        from OCP.GeomAdaptor import GeomAdaptor_Curve

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
        from OCP.gp import gp_Dir, gp_Lin
        from OCP.TopAbs import TopAbs_State

        if (point < self.box[0] - ON_MM).any() or (point > self.box[1] + ON_MM).any():
            return -1
        origin = pnt(point)
        seen: list[int] = []
        for direction in ODD:
            # from far behind: OCCT starts from facets, and a line that begins between facet and face meets neither
            self._hits.Perform(gp_Lin(origin, gp_Dir(*direction)), -self._far, self._far)
            hits = [(k, self._hits.WParameter(k)) for k in range(1, self._hits.NbPnt() + 1)]
            ahead = [(k, w) for k, w in hits if w >= -CLOSE_MM]
            if any(w <= CLOSE_MM for _, w in ahead):
                return 0
            if any(self._hits.State(k) != TopAbs_State.TopAbs_IN for k, _ in ahead):
                continue  # through an edge: two faces, or one
            seen.append(1 if len(ahead) % 2 else -1)
            if seen.count(seen[-1]) == 2:
                return seen[-1]
        self._sides.Perform(origin, ON_MM)
        state = self._sides.State()
        return 1 if state == TopAbs_State.TopAbs_IN else 0 if state == TopAbs_State.TopAbs_ON else -1


class Members:
    """The stock, and what was taken from it, as solids."""

    def __init__(self, stock: Blank, past: Sequence[tuple[int, Sweep]], stock_code: int) -> None:
        import cadquery as cq

        shape = stock.shape()
        box = box_of(shape)
        self._stock = [Solid(s.wrapped) for s in cq.Shape.cast(shape).Solids()]
        self._stock_code = stock_code
        self._past: list[tuple[int, list[Solid]]] = []
        for code, sweep in past:
            if not meets(sweep, box):
                continue
            try:
                parts = solids(reaching(sweep, box))
            except SweepError as exc:
                raise SweepError(f"block {code}: {exc.message}") from exc
            self._past.append((code, [Solid(part.shape) for part in parts]))

    def holds(self, edge: Edge, stance: Stance, phi: Floats, parts: EdgeParts) -> EdgeParts:
        """See `BrepWorkpiece.holds`."""
        rows: list[tuple[int, int, float, float, int, int]] = []
        for row, piece, lower, upper, low_by, high_by in zip(*(c.tolist() for c in parts), strict=True):
            for a, b, left, right in self._left(edge, stance, float(phi[row]), piece, lower, upper):
                rows.append(
                    (row, piece, a, b, low_by if left is None else left, high_by if right is None else right)
                )
        whole, real = np.int64, np.float64
        kinds = (whole, whole, real, real, whole, whole)
        columns = zip(*rows, strict=True) if rows else ([],) * 6
        return EdgeParts._make(np.array(c, dtype=kind) for c, kind in zip(columns, kinds, strict=True))

    def _left(
        self, edge: Edge, stance: Stance, phi: float, piece: int, lower: float, upper: float
    ) -> list[tuple[float, float, int | None, int | None]]:
        """Stretches (lower, upper, code of either end; None: as it was) in the workpiece."""
        left: list[tuple[float, float, int | None, int | None]] = [(lower, upper, None, None)]
        members = [(self._stock_code, self._stock, True), *((c, s, False) for c, s in reversed(self._past))]
        for code, bodies, inside in members:
            rest: list[tuple[float, float, int | None, int | None]] = []
            for a, b, low_by, high_by in left:
                if b - a <= 0.0:
                    continue
                curve = edge_curve(edge, stance, phi, piece, a, b)
                for p, q in _divided(curve, bodies, inside, b - a):
                    rest.append((
                        a + p * (b - a), a + q * (b - a), low_by if p == 0.0 else code, high_by if q == 1.0 else code,
                    ))  # fmt: skip
            left = rest
            if not left:
                break
        return left


def _divided(curve: Curve, bodies: Sequence[Solid], inside: bool, length: float) -> list[tuple[float, float]]:
    """Stretches (p, q) of a curve, as shares of it, that lie in some body, or in none."""
    probe = curve.at(np.linspace(curve.t0, curve.t1, 2 * PIECES + 1))
    margin = length / (4 * PIECES) + ON_MM  # of points between the probes
    near = [
        body for body in bodies
        if ((probe >= body.box[0] - margin) & (probe <= body.box[1] + margin)).all(axis=1).any()
    ]  # fmt: skip
    if not near:
        return [] if inside else [(0.0, 1.0)]
    span = curve.t1 - curve.t0
    exact = np.sort(np.concatenate([(body.parameters(curve) - curve.t0) / span for body in near]))
    cuts = np.unique(np.concatenate([np.linspace(0.0, 1.0, PIECES + 1), exact]))
    middles = 0.5 * (cuts[1:] + cuts[:-1])

    def sides(shares: Floats) -> list[int]:
        points = curve.at(curve.t0 + span * shares)
        return [max(body.side(point) for body in near) for point in points]

    found = np.array(sides(middles))
    keep: Bools = found >= 0 if inside else found <= 0
    touching = (found == 0) & (np.diff(cuts) * length < SLIVER_MM)
    keep &= ~touching
    out: list[list[float]] = []
    for k in np.flatnonzero(keep):
        p, q = float(cuts[k]), float(cuts[k + 1])
        if out and k > 0 and keep[k - 1]:
            out[-1][1] = q
            continue
        if k > 0 and p not in exact:
            p = _end(sides, middles[k], middles[k - 1], inside)
        out.append([p, q])
    for pair in out:
        index = int(np.searchsorted(cuts, pair[1]))
        if pair[1] < 1.0 and pair[1] not in exact:
            pair[1] = _end(sides, middles[index - 1], middles[index], inside)
    return [(p, q) for p, q in out if q > p]


def _end(sides: Any, good: float, bad: float, inside: bool) -> float:
    """Where the side changes between two shares, by halving with the classifier."""
    for _ in range(40):
        middle = 0.5 * (good + bad)
        side = sides(np.array([middle]))[0]
        if (side >= 0) if inside else (side <= 0):
            good = middle
        else:
            bad = middle
    return good


def main() -> None:
    """Answer until stdin ends."""
    obey_driver()
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # OCCT talks on stdout
    questions = sys.stdin.buffer
    quiet()
    stock, past, code = pickle.load(questions)
    pickle.dump("ready", answers)
    answers.flush()
    members: Members | None = None
    while True:
        try:
            question = pickle.load(questions)
        except EOFError:
            return
        answer: object
        try:
            if members is None:
                members = Members(stock, past, code)
            answer = None if question == "build" else members.holds(*question)
        except SweepError as exc:
            answer = exc
        except VMachiningError as exc:
            answer = str(exc)
        except Exception as exc:  # OCCT raises whatever it meets
            answer = f"OCCT failed: {type(exc).__name__} {exc}"
        pickle.dump(answer, answers)
        answers.flush()


if __name__ == "__main__":
    main()
