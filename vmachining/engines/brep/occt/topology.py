"""Solids put together vertex by vertex: edges are shared by construction, nothing is sewn or fused.

A `Builder` hands out vertices (one per place) and edges, and makes faces of a surface and closed runs of edges.
The curve of an edge in the parameters of a face is computed from the inverse of the surface: a line where it
is one, else a quintic spline measured against the edge. Faces are turned so that their normal points the way
the caller says; OCCT's checker then finds out whether neighbours agree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from OCP.BRep import BRep_Builder
from OCP.Geom2d import Geom2d_BSplineCurve, Geom2d_Line
from OCP.gp import gp_Dir2d, gp_Pnt2d
from OCP.TColgp import TColgp_Array1OfPnt2d
from OCP.TopAbs import TopAbs_Orientation
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS_Edge, TopoDS_Face, TopoDS_Shell, TopoDS_Solid, TopoDS_Vertex, TopoDS_Wire
from scipy.interpolate import BSpline, make_interp_spline

from vmachining.arrays import Floats
from vmachining.engines.brep.occt.inside import inside_out
from vmachining.engines.brep.occt.shapes import Curve, Part, Spline, Surface, interpolated, knots_of, pnt
from vmachining.engines.brep.occt.tolerances import CONFUSION_MM, PARAMETER_FIT_MM, SAME_VERTEX_MM
from vmachining.errors import EngineError

FORWARD, REVERSED = TopAbs_Orientation.TopAbs_FORWARD, TopAbs_Orientation.TopAbs_REVERSED


@dataclass(frozen=True, slots=True, eq=False)
class Edge:
    """Curve between two vertices (numbers of the builder), and the OCCT edge."""

    curve: Curve
    first: int
    last: int
    shape: Any


class Use(NamedTuple):
    """An edge in a loop, inverted unless it is known where it lies in the surface.

    start, end: (u, v) of its ends, between them a line. path: curve (u, v) with the parameter of the edge.
    """

    edge: Edge
    start: tuple[float, float] | None = None
    end: tuple[float, float] | None = None
    path: BSpline | None = None


class Builder:
    """One solid in the making. `miss`: largest distance (mm) of an edge from a surface it lies on."""

    def __init__(self) -> None:
        self._points: list[Floats] = []
        self._vertices: list[Any] = []
        self._faces: list[tuple[float, Any]] = []
        self._make = BRep_Builder()
        self.miss = 0.0

    def vertex(self, point: Floats) -> int:
        """Number of the vertex at a place."""
        for k, known in enumerate(self._points):
            if np.abs(known - point).max() <= SAME_VERTEX_MM:
                return k
        shape = TopoDS_Vertex()
        self._make.MakeVertex(shape, pnt(point), CONFUSION_MM)
        self._points.append(np.asarray(point))
        self._vertices.append(shape)
        return len(self._points) - 1

    def place(self, vertex: int) -> Floats:
        """(3,) mm, where a vertex is."""
        return self._points[vertex]

    def edge(self, curve: Curve) -> Edge:
        """A new edge along a curve."""
        first, last = (self.vertex(p) for p in curve.ends)
        shape = TopoDS_Edge()
        self._make.MakeEdge(shape, curve.geom, CONFUSION_MM)
        self._make.Add(shape, self._vertices[first].Oriented(FORWARD))
        self._make.Add(shape, self._vertices[last].Oriented(REVERSED))
        self._make.Range(shape, curve.t0, curve.t1)
        return Edge(curve, first, last, shape)

    def face(
        self, surface: Surface, loops: Sequence[Sequence[Edge | Use]], probe: Floats, outward: Floats
    ) -> None:
        """Add a face. The first loop is its outside, the others are holes.

        loops : edges in the order they follow each other, in either sense.
        probe : (3,) point of the surface, or (2,) its parameters.
        outward : (3,) a vector that leaves the solid there.
        """
        geom = surface.geom
        shape, size = TopoDS_Face(), 0.0
        self._make.MakeFace(shape, geom, CONFUSION_MM)
        for k, loop in enumerate(loops):
            uses = [item if isinstance(item, Use) else Use(item) for item in loop]
            size = max(size, self._wire(shape, geom, surface, uses, hole=k > 0))
        at = probe if len(probe) == 2 else self._parameters(surface, probe[None, :])[0]
        h = 1e-6
        around = surface.at(np.array([at, at + [h, 0.0], at + [0.0, h]]))
        normal = np.cross(around[1] - around[0], around[2] - around[0])
        self._faces.append((size, shape if normal @ outward > 0.0 else shape.Reversed()))

    def solid(self) -> Any:
        """The TopoDS_Solid of all faces, large ones first.

        Who reads a STEP file with OCCT has it look for the outside of a shell along a line through its first face.
        Where that line meets a sliver, some 1e-5 mm wide, crossings get lost and the solid is turned inside out.
        So a face comes first with which OCCT finds the outside.

        Raises EngineError: No face shows it the outside.
        """
        faces = [face for _, face in sorted(self._faces, key=lambda sized: -sized[0])]
        for k, face in enumerate(faces):
            solid = self._closed([face, *faces[:k], *faces[k + 1 :]])
            if not inside_out(solid):
                return solid
        raise EngineError("OCCT takes the swept solid for all that lies around it", engine="brep")

    def _closed(self, faces: list[Any]) -> Any:
        shell, solid = TopoDS_Shell(), TopoDS_Solid()
        self._make.MakeShell(shell)
        for face in faces:
            self._make.Add(shell, face)
        shell.Closed(True)
        self._make.MakeSolid(solid)
        self._make.Add(solid, shell)
        return solid

    # -- loops ---------------------------------------------------------------------------------------------

    def _wire(self, face: Any, geom: Any, surface: Surface, uses: list[Use], *, hole: bool) -> float:
        """Add a loop; mm^2 of what it encloses, seen from where that is most."""
        forward = _senses(uses)
        runs: list[tuple[Floats, Floats]] = []
        for use, ahead in zip(uses, forward, strict=True):
            t, uv = self._run(surface, use)
            start = uv[0] if ahead else uv[-1]
            if runs:
                before = runs[-1][1][-1] if forward[len(runs) - 1] else runs[-1][1][0]
                for axis, period in enumerate(surface.period):
                    if period:
                        uv[:, axis] += period * np.round((before[axis] - start[axis]) / period)
            runs.append((t, uv))
        polygon = np.concatenate([
            uv if ahead else uv[::-1] for (_, uv), ahead in zip(runs, forward, strict=True)
        ])  # fmt: skip
        for axis, period in enumerate(surface.period):
            if period:
                center = 0.5 * (polygon[:, axis].min() + polygon[:, axis].max())
                shift = period * np.round((surface.middle[axis] - center) / period)
                polygon[:, axis] += shift
                for _, uv in runs:
                    uv[:, axis] += shift
        x, y = polygon.T
        area = 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
        turn = (area < 0.0) != hole
        order = range(len(uses))
        wire = TopoDS_Wire()
        self._make.MakeWire(wire)
        for k in reversed(order) if turn else order:
            edge = uses[k].edge
            self._pcurve(face, geom, surface, uses[k], *runs[k])
            sense = forward[k] != turn
            self._make.Add(wire, edge.shape.Oriented(FORWARD if sense else REVERSED))
            after = (k - 1 if turn else k + 1) % len(uses)
            tail = runs[k][1][-1 if sense else 0]
            head = runs[after][1][0 if forward[after] != turn else -1]
            if abs(tail[0] - head[0]) > 1e-6 and np.abs(surface.at(np.array([tail])) - surface.at(
                np.array([head]))).max() < SAME_VERTEX_MM:  # fmt: skip
                corner = edge.last if sense else edge.first
                self._make.Add(wire, self._apex(geom, corner, tail, head))
        wire.Closed(True)
        self._make.Add(face, wire)
        path = np.concatenate([use.edge.curve.at(t)[:: 1 if ahead else -1]
                               for use, (t, _), ahead in zip(uses, runs, forward, strict=True)])  # fmt: skip
        path -= path[0]
        return 0.5 * float(np.linalg.norm(np.cross(path, np.roll(path, -1, axis=0)).sum(axis=0)))

    def _apex(self, geom: Any, corner: int, tail: Floats, head: Floats) -> Any:
        """The edge without length that OCCT needs where a face touches the tip of its cone."""
        shape = TopoDS_Edge()
        self._make.MakeEdge(shape)
        vertex = self._vertices[corner]
        self._make.Add(shape, vertex.Oriented(FORWARD))
        self._make.Add(shape, vertex.Oriented(REVERSED))
        step = head - tail
        length = float(np.linalg.norm(step))
        line = Geom2d_Line(gp_Pnt2d(*tail.tolist()), gp_Dir2d(*step.tolist()))
        self._make.UpdateEdge(shape, line, geom, TopLoc_Location(), CONFUSION_MM)
        self._make.Range(shape, 0.0, length)
        self._make.Degenerated(shape, True)
        return shape

    def _run(self, surface: Surface, use: Use) -> tuple[Floats, Floats]:
        """Parameters of an edge and where they lie in the surface, unwrapped."""
        curve = use.edge.curve
        t = np.linspace(curve.t0, curve.t1, 17)
        if use.path is not None:
            return t, np.asarray(use.path(t))
        if use.start is not None and use.end is not None:
            share = ((t - t[0]) / (t[-1] - t[0]))[:, None]
            return t, (1.0 - share) * np.array(use.start) + share * np.array(use.end)
        uv = self._unwrapped(surface, curve.at(t))
        # close to a pole u turns fast: look closer before unwrapping
        while surface.period[0] and len(t) < 400:
            jumps = np.flatnonzero(np.abs(np.diff(uv[:, 0])) > 0.7)
            if not len(jumps) or np.diff(t)[jumps].max() < 1e-6 * (t[-1] - t[0]):
                break
            t = np.sort(np.concatenate([t, 0.5 * (t[jumps] + t[jumps + 1])]))
            uv = self._unwrapped(surface, curve.at(t))
        return t, uv

    def _unwrapped(self, surface: Surface, points: Floats) -> Floats:
        uv = self._parameters(surface, points)
        for axis, period in enumerate(surface.period):
            if period:
                uv[:, axis] = np.unwrap(uv[:, axis], period=period)
        return uv

    def _parameters(self, surface: Surface, points: Floats) -> Floats:
        """Inverse with the holes at an apex filled from the neighbour."""
        uv = surface.invert(points)
        bad = np.isnan(uv[:, 0])
        if bad.any() and not bad.all():
            good = np.flatnonzero(~bad)
            for k in np.flatnonzero(bad):
                uv[k, 0] = uv[good[np.argmin(np.abs(good - k))], 0]
        return np.where(np.isnan(uv), 0.0, uv)

    def _pcurve(self, face: Any, geom: Any, surface: Surface, use: Use, t: Floats, uv: Floats) -> None:
        """Give the edge its curve in the parameters of the face."""
        edge = use.edge
        share = ((t - t[0]) / (t[-1] - t[0]))[:, None]
        chord = (1.0 - share) * uv[0] + share * uv[-1]
        curve, step = edge.curve, uv[-1] - uv[0]
        speed = float(np.linalg.norm(step)) / (t[-1] - t[0])
        miss = float(np.linalg.norm(surface.at(chord) - curve.at(t), axis=-1).max())
        if use.path is not None:
            fine = np.linspace(t[0], t[-1], 101)
            miss = float(np.linalg.norm(surface.at(use.path(fine)) - curve.at(fine), axis=-1).max())
            plane_curve: Any = _flat(use.path)
        elif miss <= PARAMETER_FIT_MM and abs(speed - 1.0) < 1e-12:
            origin = uv[0] - t[0] * step / (t[-1] - t[0])
            plane_curve = Geom2d_Line(gp_Pnt2d(*origin.tolist()), gp_Dir2d(*step.tolist()))
        else:
            if miss <= PARAMETER_FIT_MM:
                spline = make_interp_spline(t[[0, -1]], uv[[0, -1]], k=1)
            else:
                spline, miss = self._inverted(surface, curve, t, uv)
            plane_curve = _flat(spline)
        self.miss = max(self.miss, miss)
        if miss > CONFUSION_MM:
            raise EngineError(f"an edge misses its surface by {miss:.2g} mm", engine="brep")
        self._make.UpdateEdge(edge.shape, plane_curve, geom, TopLoc_Location(), CONFUSION_MM)

    def _inverted(self, surface: Surface, curve: Curve, t: Floats, uv: Floats) -> tuple[BSpline, float]:
        """Spline of the inverse, on the branch of the samples."""
        period = np.array(surface.period)

        def exact(s: Floats) -> Floats:
            raw = surface.invert(curve.at(s))
            near = np.column_stack([np.interp(s, t, uv[:, axis]) for axis in (0, 1)])
            turns = np.where(period > 0, np.round((near - raw) / np.where(period > 0, period, 1.0)), 0.0)
            return np.asarray(np.where(np.isnan(raw), near, raw + turns * period))

        size = max(1.0, float(np.ptp(curve.at(t), axis=0).max()))
        breaks = _breaks(curve)
        fine = np.unique(np.concatenate([np.linspace(t[0], t[-1], 101), 0.5 * (breaks[:-1] + breaks[1:])]))

        def missed(path: BSpline) -> float:
            return float(np.linalg.norm(surface.at(path(fine)) - curve.at(fine), axis=-1).max())

        spline = interpolated(exact, t[0], t[-1], PARAMETER_FIT_MM / size, first=13, most=400).spline
        for parts in (1, 2, 4) if len(breaks) > spline.k else ():
            if missed(spline) <= CONFUSION_MM:
                break
            # the curve's own knots are where it bends
            places = np.arange(parts * (len(breaks) - 1) + 1) / parts
            nodes = np.interp(places, np.arange(len(breaks)), breaks)
            spline = make_interp_spline(nodes, exact(nodes), k=spline.k)
        return spline, missed(spline)


def _breaks(curve: Curve) -> Floats:
    """Ends of a curve and the knots between them."""
    whole = curve.whole if isinstance(curve, Part) else curve
    knots = np.unique(whole.spline.t) if isinstance(whole, Spline) else np.zeros(0)
    return np.concatenate([[curve.t0], knots[(knots > curve.t0) & (knots < curve.t1)], [curve.t1]])


def _senses(uses: Sequence[Use]) -> list[bool]:
    """In which direction each edge of a closed run is walked."""
    first = uses[0].edge
    if len(uses) == 1:
        if first.first != first.last:
            raise EngineError("a loop of one edge does not close", engine="brep")
        return [True]
    after = {uses[1].edge.first, uses[1].edge.last}
    ahead = [first.last in after]
    begin, place = (first.first, first.last) if ahead[0] else (first.last, first.first)
    for use in uses[1:]:
        if use.edge.first == place:
            ahead.append(True)
            place = use.edge.last
        elif use.edge.last == place:
            ahead.append(False)
            place = use.edge.first
        else:
            raise EngineError("edges of a face do not follow each other", engine="brep")
    if place != begin:
        raise EngineError("a loop of edges does not close", engine="brep")
    return ahead


def _flat(spline: BSpline) -> Any:
    """A spline in the plane for OCCT."""
    poles = TColgp_Array1OfPnt2d(1, len(spline.c))
    for k, (u, v) in enumerate(spline.c.tolist(), start=1):
        poles.SetValue(k, gp_Pnt2d(u, v))
    return Geom2d_BSplineCurve(poles, *knots_of(spline), spline.k)


def run_of(edges: Sequence[Edge]) -> list[Edge]:
    """Edges in the order in which they follow each other.

    The run of the first edge; others may be left.

    Raises EngineError: It does not close.
    """
    rest = list(edges)
    out = [rest.pop(0)]
    start, place = out[0].first, out[0].last
    while rest and place != start:
        k = next((k for k, e in enumerate(rest) if place in (e.first, e.last)), None)
        if k is None:
            raise EngineError("the edges of a cap do not follow each other", engine="brep")
        edge = rest.pop(k)
        out.append(edge)
        place = edge.last if edge.first == place else edge.first
    if place != start:
        raise EngineError("the edges of a cap do not close", engine="brep")
    return out
