"""`Members`: the solids of which a workpiece consists, and which parts of a cutting edge lie in it.

1. A part of an edge becomes a line, a circle or a quintic spline within `EDGE_CURVE_FIT_MM` of the wound edge.
2. Its intersections with the faces of a solid cut it, and so do `PIECES` even cuts. The middle of every piece is
   classified; where neighbours differ without an intersection between them, halving with the classifier finds
   the end. So a missed intersection costs digits (1e-7 mm), and only a feature shorter than a piece is lost.
3. Points within about `ON_FACE_MM` of a surface are on it: the stock's belongs to the stock, that of a sweep does too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vmachining.arrays import Bools, Floats
from vmachining.engines.brep.blank import shape_of
from vmachining.engines.brep.occt.booleans import box_of
from vmachining.engines.brep.occt.parts import solids_of
from vmachining.engines.brep.occt.probe import Probe
from vmachining.engines.brep.occt.shapes import Circle, Curve, Frame, Straight, interpolated
from vmachining.engines.brep.occt.tolerances import EDGE_CURVE_FIT_MM, ON_FACE_MM, SLIVER_MM
from vmachining.engines.brep.workpiece.cut import block_solids
from vmachining.stock import Blank
from vmachining.sweep import Stance, Sweep
from vmachining.tool import Edge, EdgeParts

PIECES = 8
"""Even cuts of a part beside its intersections: a feature longer than an eighth of a part is not lost."""


def edge_curve(edge: Edge, stance: Stance, phi: float, piece: int, lower: float, upper: float) -> Curve:
    """The part of an edge as a curve whose parameter grows in proportion to s."""
    s = edge.segments[piece]
    if edge.twist != 0.0:

        def at(t: Floats) -> Floats:
            return stance.points(edge, np.full(len(t), phi), np.full(len(t), piece), t)

        return interpolated(at, lower, upper, EDGE_CURVE_FIT_MM)
    ends = stance.points(edge, np.full(2, phi), np.full(2, piece), np.array([lower, upper]))
    if not s.is_arc:
        return Straight(ends[0], ends[1])
    m = stance.radial(np.array([phi]))[0]
    start = s.beta[0] + (np.array([lower, upper]) - edge.joints[piece]) / s.radius
    center = stance.tip + s.cr * m + s.cz * stance.axis
    frame = Frame(center, np.cross(m, stance.axis), m)  # its y is the axis
    return Circle(frame, s.radius, float(start[0]), float(start[1]))


class Members:
    """The stock, and what was taken from it, as solids."""

    def __init__(self, stock: Blank, past: Sequence[tuple[int, Sweep]], stock_code: int) -> None:
        shape = shape_of(stock)
        box = box_of(shape)
        self._stock = [Probe(solid) for solid in solids_of(shape)]
        self._stock_code = stock_code
        self._past = [
            (code, [Probe(solid) for solid in block_solids([sweep], box, code)]) for code, sweep in past
        ]

    def holds(self, edge: Edge, stance: Stance, phi: Floats, parts: EdgeParts) -> EdgeParts:
        """See `BrepWorkpiece.holds`."""
        rows: list[tuple[int, int, float, float, int, int]] = []
        for row, piece, lower, upper, low_by, high_by in zip(*(c.tolist() for c in parts), strict=True):
            for a, b, left, right in self._left(edge, stance, float(phi[row]), piece, lower, upper):
                by = low_by if left is None else left, high_by if right is None else right
                rows.append((row, piece, a, b, *by))
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


def _divided(curve: Curve, bodies: Sequence[Probe], inside: bool, length: float) -> list[tuple[float, float]]:
    """Stretches (p, q) of a curve, as shares of it, that lie in some body, or in none."""
    probe = curve.at(np.linspace(curve.t0, curve.t1, 2 * PIECES + 1))
    margin = length / (4 * PIECES) + ON_FACE_MM  # of points between the probes
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
