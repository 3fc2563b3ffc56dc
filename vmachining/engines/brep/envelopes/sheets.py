"""Swept solid of a convex cutter whose axis turns: caps trimmed at the grazing curve, splines between them.

1. `GrazingCurve` says over which faces the grazing curve runs; every segment of it draws one tensor-product spline
   sheet S(s, w), quintic in both directions, through exact points at known parameters.
2. All sheets share their nodes in time w. A tie, the path of a point where two segments meet, is a quintic
   through the same nodes, so it is the border of both sheets to rounding; the same holds at both ends of the
   block for the grazing curve and its cap.
3. The caps are what trails of the first pose and what leads of the last one: planes, cylinders, cones, balls and
   tori with the curve of every edge in their parameters (`Builder`). A cap that would run all round the axis is
   cut in two along meridians.
4. A flat face whose chord lies inside the sweep has no sheet. Both its poses are trimmed at the valley in which
   they meet each other and the sheets of the rim, in closed form (`GrazingCurve.valley`).

`fit_mm` is the largest distance between a sheet and the exact envelope point of the same parameters, measured
in the middle of all cells: an upper bound of the normal distance there.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from vmachining.arrays import Floats
from vmachining.engines.brep.envelopes.grazing_curve import GrazingCurve
from vmachining.engines.brep.envelopes.lens import Lens
from vmachining.engines.brep.envelopes.segments import Chord, CurveSegment, EdgeSpan, End, RimPatch, State
from vmachining.engines.brep.occt import shapes as geo
from vmachining.engines.brep.occt.tolerances import CURVE_FIT_MM, FLAT_MM, SAME_VERTEX_MM, SHORT_EDGE_MM
from vmachining.engines.brep.occt.topology import Builder, Edge, Use, run_of
from vmachining.engines.brep.translations.caps import Rings, meridian_curve, normals
from vmachining.errors import SweepError

NODES, TIMES = 640, 160
"""Most nodes of a segment and of the time; a block that needs more is refused."""

FAR = 10.0
"""Nodes are chosen on a few curves; a sheet that misses the rest by this many times what was asked is refused."""

STEEP = 0.85
"""Part of a ball that a cap may cover as one face, as a share of the way from a point to half the ball."""


class Built(NamedTuple):
    """builder : all faces. fit_mm : measured error of the sheets. grazing : the curve they were drawn by."""

    builder: Builder
    fit_mm: float
    grazing: GrazingCurve


class _Envelope:
    """One solid in the making."""

    def __init__(self, grazing: GrazingCurve, fit_mm: float, loose_mm: float) -> None:
        moving = grazing.moving
        self.tool, self.grazing = grazing.tool, grazing
        self.moving, self.fit, self.loose = moving, fit_mm, loose_mm
        self.build = Builder()
        self.error = 0.0
        self.poses = {-1: moving.pose(0.0), 1: moving.pose(1.0)}
        self.states = {-1: moving.state(np.array([0.0])), 1: moving.state(np.array([1.0]))}
        self.rims = {sign: Rings(self.build, pose, self.tool) for sign, pose in self.poses.items()}
        self.curves: dict[tuple[int, int], list[Edge]] = {}
        self.ties: dict[End, Edge] = {}
        self.cuts: dict[tuple[int, int], list[tuple[float, CurveSegment | None]]] = {}
        self.lenses: dict[int, tuple[Edge, Edge]] = {}
        self.w = np.zeros(0)

    # -- sheets --------------------------------------------------------------------------------------------

    def sheets(self) -> None:
        """Ties, ends and faces of all segments."""
        g, wanted = self.grazing, FAR * max(self.fit, CURVE_FIT_MM)
        self.w = self._times()
        patches = [self._patch(lens) for lens in g.lenses]
        while True:
            self.error = 0.0
            fitted = [self._fitted(segment) for segment in [*g.segments, *patches]]
            if self.error <= wanted:
                break
            if 2 * len(self.w) > TIMES:
                if self.error <= self.loose:
                    break
                raise SweepError(f"splines miss the envelope by {self.error:.2g} mm")
            self.w = np.sort(np.concatenate([self.w, 0.5 * (self.w[:-1] + self.w[1:])]))
        st = g.moving.state(self.w)
        for end in g.ends:
            other = end[0], -end[1]
            if g.rings[end[0]].r == 0.0 and other in self.ties:
                self.ties[end] = self.ties[other]  # both sides of a cone meet in the path of its tip
                continue
            spline = make_interp_spline(self.w, g.tie(end, st), k=geo.DEGREE)
            self.ties[end] = self.build.edge(geo.Spline(spline, 0.0))
        for number, segment in enumerate(g.segments):
            self._sheet(number, segment, fitted[number])
        for lens, patch, sheet in zip(g.lenses, patches, fitted[len(g.segments) :], strict=True):
            self._lens(lens, patch, sheet)

    def _fitted(self, segment: CurveSegment) -> geo.SplineSheet:
        """Sheet of a segment through its points at the nodes of time; its error is noted."""
        middle_w = 0.5 * (self.w[:-1] + self.w[1:])
        st, middle = (self.moving.state(w) for w in (self.w, middle_w))
        s = np.array([0.0, 1.0]) if segment.linear else self._places(segment)
        along = make_interp_spline(s, np.zeros(len(s)), k=1 if segment.linear else geo.DEGREE)
        poles = make_interp_spline(s, self._points(segment, st, s).transpose(1, 0, 2), k=along.k).c
        inner = make_interp_spline(self.w, poles.transpose(1, 0, 2), k=geo.DEGREE)
        over = BSpline(inner.t, np.zeros(len(self.w)), geo.DEGREE)
        sheet = geo.SplineSheet(along, over, inner.c.transpose(1, 0, 2))
        middle_s = np.array([0.5]) if segment.linear else 0.5 * (s[:-1] + s[1:])
        exact = self._points(segment, middle, middle_s)
        along_s = BSpline(along.t, sheet.poles, along.k)(middle_s).transpose(1, 0, 2)
        found = BSpline(over.t, along_s, geo.DEGREE)(middle_w)
        self.error = max(self.error, float(np.linalg.norm(found - exact, axis=-1).max()))
        return sheet

    def _points(self, segment: CurveSegment, st: State, s: Floats) -> Floats:
        """(n, m, 3) mm; refused where none exist."""
        found = segment.points(self.grazing, st, s)
        if not np.isfinite(found).all():
            raise SweepError("the grazing curve ends on its way over a face")
        return found

    def _patch(self, lens: Lens) -> RimPatch:
        ring = self.grazing.rings[lens.ring]
        number, edge = next((k, e) for k, e in enumerate(self.grazing.elements) if e.kind == "edge" and lens.ring in (
            e.lower, e.upper))  # fmt: skip
        ends = (lens.ring, -1), (lens.ring, 1)
        return RimPatch(number, ends, ring.r, ring.z, self.grazing.fan(edge), lens.lo, lens.hi)

    def _lens(self, lens: Lens, patch: RimPatch, sheet: geo.SplineSheet) -> None:
        """Face of a lens of the rim: its border, and the last (or first) pose of the rim."""
        ring, size = self.grazing.rings[lens.ring], lens.hi - lens.lo

        def path(s: Floats) -> Floats:
            return np.column_stack([s, lens.border(self.moving, ring, lens.lo + s * size)])

        def points(s: Floats) -> Floats:
            w = path(s)[:, 1]
            st, u = self.moving.state(w), lens.lo + s[:, None] * size
            return np.asarray(st.tip + ring.z * st.axis + ring.r * st.radial(u)[:, 0])

        border = self.build.edge(geo.interpolated(points, 0.0, 1.0, CURVE_FIT_MM, first=9, most=NODES))
        trace = geo.interpolated(path, 0.0, 1.0, 0.01 * CURVE_FIT_MM, first=9, most=NODES).spline
        w = float(lens.sign > 0)
        rim = self.build.edge(geo.Spline(BSpline(sheet.u.t, sheet.poles[:, -1 if w else 0], sheet.u.k), 0.0))
        self.rims[lens.sign].put(ring.joint, lens.lo, lens.hi, rim)
        loop = [Use(rim, (0.0, w), (1.0, w)), Use(border, path=trace)]
        at = 0.5 * (w + float(trace(0.5)[1]))
        normal = patch.normals(self.grazing, self.moving.state(np.array([at])), np.array([0.5]))[0, 0]
        self.build.face(sheet, [loop], np.array([0.5, at]), normal)
        line = self.build.edge(geo.Straight(*(self.build.place(v) for v in (border.first, border.last))))
        self.lenses[lens.ring] = border, line

    def _times(self) -> Floats:
        """Nodes in time that serve all ties and, sampled, all sheets."""
        g, s = self.grazing, np.array([0.03, 0.15, 0.35, 0.5, 0.65, 0.85, 0.97])

        wanted = min(self.fit, CURVE_FIT_MM) if g.valley or g.lenses else self.fit
        share = wanted / self.fit  # only what lies in a plane of the tool has to be as good as that plane

        def paths(w: Floats) -> Floats:
            st = g.moving.state(w)
            ties = [g.tie(end, st) * (1.0 if end in g.valley else share) for end in g.ends]
            curved = [share * self._points(e, st, s).reshape(len(w), -1) for e in g.segments if not e.linear]
            lenses = [self._points(self._patch(lens), st, s).reshape(len(w), -1) for lens in g.lenses]
            return np.concatenate([*ties, *curved, *lenses], axis=1)

        nodes, error = geo.nodes_for(paths, 0.0, 1.0, wanted, first=7, most=TIMES)
        if error > max(10.0 * wanted, self.loose):
            raise SweepError("the grazing curve moves too unevenly for a spline in time")
        return nodes

    def _places(self, segment: CurveSegment) -> Floats:
        """Nodes along a segment that serve both ends of the block, where its border lies on a cap, and between."""
        st = self.moving.state(np.array([0.0, 0.25, 0.5, 0.75, 1.0]))

        def curves(s: Floats) -> Floats:
            return self._points(segment, st, s).transpose(1, 0, 2).reshape(len(s), -1)

        nodes, error = geo.nodes_for(curves, 0.0, 1.0, CURVE_FIT_MM, first=7, most=NODES)
        if error > 3.0 * CURVE_FIT_MM:
            raise SweepError("the grazing curve bends too sharply for a spline")
        return nodes

    def _sheet(self, number: int, segment: CurveSegment, sheet: geo.SplineSheet) -> None:
        loop: list[Use] = []
        last, first = (self.ties[segment.ends[k]] for k in (1, 0))
        for sign, w in ((-1, 0.0), (1, 1.0)):
            edges = self._border(segment, sheet.u, sheet.poles[:, -1 if sign > 0 else 0], sign)
            self.curves[number, sign] = edges
            stops = [0.0, 1.0] if segment.linear else [edges[0].curve.t0, *(e.curve.t1 for e in edges)]
            uses = [Use(e, (a, w), (b, w)) for e, (a, b) in zip(edges, pairwise(stops), strict=True)]
            loop += uses if sign < 0 else uses[::-1]
            if sign < 0:
                loop.append(Use(last, (1.0, 0.0), (1.0, 1.0)))
        loop.append(Use(first, (0.0, 0.0), (0.0, 1.0)))
        half = np.array([0.5])
        normal = segment.normals(self.grazing, self.moving.state(half), half)[0, 0]
        if not isinstance(segment, EdgeSpan) and self.grazing.fold(segment, half, half)[0, 0] < 0.0:
            normal = -normal  # a sheet that lies inside is passed the other way
        self.build.face(sheet, [loop], np.array([0.5, 0.5]), normal)

    def _border(self, segment: CurveSegment, along: BSpline, poles: Floats, sign: int) -> list[Edge]:
        """Edges of the grazing curve in a pose, cut where a cap is cut."""
        if segment.linear:
            return [self.build.edge(geo.Straight(poles[0], poles[-1]))]
        whole = geo.Spline(BSpline(along.t, poles, along.k), 0.0)
        inside = [0.5] if (segment.element, sign) in self.cuts and _turns(segment) else []
        if isinstance(segment, EdgeSpan):  # a cap next to it may be cut there
            joint = self.grazing.rings[segment.ends[0][0]].joint
            ua, ub = self.grazing.span(segment.ends, self.states[sign], np.array([0.0, 1.0]))[0].tolist()
            turns = 2.0 * np.pi * np.arange(-3, 4)
            lo, hi = sorted((ua, ub))
            marks = (u + t for u in self.rims[sign]._breaks[joint] for t in turns)
            inside = sorted((u - ua) / (ub - ua) for u in marks if lo + 1e-9 < u < hi - 1e-9)
        stops = [0.0, *inside, 1.0]
        edges = [self.build.edge(geo.Part(whole, a, b)) for a, b in pairwise(stops)]
        if isinstance(segment, EdgeSpan):
            for edge, share in zip(edges, pairwise(stops), strict=True):
                lo, hi = sorted(ua + s * (ub - ua) for s in share)
                self.rims[sign].put(joint, lo, hi, edge)
        return edges

    # -- caps ----------------------------------------------------------------------------------------------

    def kept(self, ring: int | None, sign: int) -> tuple[float, float] | None:
        """Angles of a ring between which its face belongs to the cap; a whole turn or None."""
        if ring is None:
            return None
        g = self.grazing
        for lens in g.lenses:
            if (lens.ring, lens.sign) == (ring, sign):
                return lens.lo, lens.hi
        if not g.present[ring]:
            return (0.0, 2.0 * np.pi) if g.sign[ring] == sign else None
        lo, hi = (float(g.angle(ring, side, self.states[sign])[0]) for side in (-1, 1))
        return (lo, hi) if sign > 0 else (hi, lo + 2.0 * np.pi)

    def prepare(self) -> None:
        """Vertices of all circles, and the meridians at which caps are cut."""
        g = self.grazing
        for sign in (-1, 1):
            rim = self.rims[sign]
            for k, circle in enumerate(g.rings):
                if g.present[k] or any((lens.ring, lens.sign) == (k, sign) for lens in g.lenses):
                    rim.break_at(circle.joint, list(self.kept(k, sign) or ()))
            for number, e in enumerate(g.elements):
                if e.kind in ("line", "arc") and self._wraps(number, sign):
                    self.cuts[number, sign] = self._meridians(number, sign)
                    for u, turn in self.cuts[number, sign]:
                        for ring in (e.lower, e.upper):
                            if ring is not None and (turn is None or turn.ends[0][0] != ring):
                                rim.break_at(g.rings[ring].joint, [u])
            for span in g.segments:
                if isinstance(span, EdgeSpan) and not g.present[span.ends[0][0]]:
                    rim.break_at(g.rings[span.ends[0][0]].joint, [0.0, np.pi])
            for circle in g.rings:
                if not rim._breaks.get(circle.joint):
                    rim.break_at(circle.joint, [0.0])

    def _turning(self, number: int) -> list[CurveSegment]:
        return [s for s in self.grazing.segments if s.element == number and _turns(s)]

    def _wraps(self, number: int, sign: int) -> bool:
        """Whether the cap on an element runs round the axis, or over too much of a ball."""
        g, e = self.grazing, self.grazing.elements[number]
        for ring in (e.lower, e.upper):
            if ring is not None and not g.present[ring] and g.sign[ring] == sign:
                return not (e.kind == "arc" and abs(e.segment.cr) <= FLAT_MM and e.lower is None)
        if e.lower is not None:
            band = -1 if g.middle_trails(e) else 1
            return len(self._turning(number)) == 2 and band == sign
        tip = -1 if g._tip_trails() else 1
        if tip != sign:
            return False
        if e.kind == "arc" and abs(e.segment.cr) <= FLAT_MM:
            V = self.states[sign].velocity[0] + e.segment.cz * self.states[sign].rate[0]
            return bool(abs(V @ self.states[sign].axis[0]) > STEEP * np.linalg.norm(V))
        return True

    def _meridians(self, number: int, sign: int) -> list[tuple[float, CurveSegment | None]]:
        """Two angles, the lower one first, at which a cap is cut, each with the curve that turns there."""
        st, half = self.states[sign], np.array([0.5])
        found: list[tuple[float, CurveSegment | None]] = [
            (float(turn.place(self.grazing, st, half)[3][0, 0]) % (2.0 * np.pi), turn)
            for turn in self._turning(number)
        ]
        if not found:
            found.append((0.0, None))
        if len(found) == 1:
            found.append(((found[0][0] + np.pi) % (2.0 * np.pi), None))
        return sorted(found, key=lambda cut: cut[0])

    def caps(self) -> None:
        """Faces of both poses."""
        for sign in (-1, 1):
            for number, e in enumerate(self.grazing.elements):
                if e.kind == "disc":
                    self._disc(number, sign)
                elif e.kind in ("line", "arc"):
                    self._cap(number, sign)

    def _disc(self, number: int, sign: int) -> None:
        g, e, pose = self.grazing, self.grazing.elements[number], self.poses[sign]
        ring = e.lower if e.lower is not None else e.upper
        assert ring is not None
        arc = self.kept(ring, sign)
        if arc is None:
            return
        joint, up = g.rings[ring].joint, float(np.sign(np.sin(g.rings[ring].beta)))
        holes = []
        whole = arc[1] - arc[0] >= 2.0 * np.pi
        first = self.rims[sign]._breaks[joint][0]
        edges = self.rims[sign].arcs(joint, *((first, first + 2.0 * np.pi) if whole else arc))
        if ring in self.lenses:
            border, line = self.lenses[ring]
            holes = [[border, line]] if whole else []
            edges += [] if whole else [line]
        if g.present[ring]:
            edges += self._drawn(number, sign)
            edges += self._valley(ring, sign)
        point = pose.point(0.0, g.rings[ring].z, 0.0)
        plane = geo.Plane(geo.Frame(point, pose.axis, pose.heading))
        self.build.face(plane, [run_of(edges), *holes], np.zeros(2), up * pose.axis)

    def _drawn(self, number: int, sign: int) -> list[Edge]:
        """What the grazing curve leaves on an element in a pose."""
        owned = [k for k, s in enumerate(self.grazing.segments) if s.element == number]
        return [edge for k in owned for edge in self.curves[k, sign]]

    def _valley(self, ring: int, sign: int) -> list[Edge]:
        """Where a pose of a disc meets its other pose and the sheets of the rim."""
        g = self.grazing
        if (ring, 1) not in g.valley:
            return []
        corners, ties = [], []
        for side in (1, -1):
            rear = g.valley[ring, side][1] == 0.0
            tie = self.ties[ring, side]
            corners.append(tie.last if rear else tie.first)
            if rear == (sign < 0):
                ties.append(tie)
        key = -1 - ring, 0
        if key not in self.curves:
            a, b = (self.build.place(corner) for corner in corners)
            if np.linalg.norm(b - a) < SHORT_EDGE_MM:
                raise SweepError("both poses of a flat face meet in a point")
            self.curves[key] = [self.build.edge(geo.Straight(a, b))]
        return ties + self.curves[key]

    def _cap(self, number: int, sign: int) -> None:
        g, e = self.grazing, self.grazing.elements[number]
        if (number, sign) in self.cuts:
            self._halves(number, sign)
            return
        edges = self._drawn(number, sign)
        for ring in (e.lower, e.upper):
            arc = self.kept(ring, sign)
            if arc is not None and ring is not None:
                edges += self.rims[sign].arcs(g.rings[ring].joint, *arc)
        while edges:
            loop = run_of(edges)
            edges = [edge for edge in edges if edge not in loop]
            self._face(number, sign, loop, self._spread(loop, sign))

    def _spread(self, loop: Sequence[Edge], sign: int) -> tuple[float, float]:
        """A half turn around the middle of a loop."""
        pose = self.poses[sign]
        points = np.concatenate([e.curve.at(np.linspace(e.curve.t0, e.curve.t1, 9)) for e in loop]) - pose.tip
        u = np.sort(np.arctan2(points @ pose.left, points @ pose.heading))
        gaps = np.diff(np.append(u, u[0] + 2.0 * np.pi))
        k = int(np.argmax(gaps))  # the middle lies opposite to the widest gap
        middle = u[k] + 0.5 * gaps[k] + np.pi
        return middle - np.pi / 2, middle + np.pi / 2

    def _halves(self, number: int, sign: int) -> None:
        """A cap that runs all round, cut along two meridians."""
        g, e, pose = self.grazing, self.grazing.elements[number], self.poses[sign]
        cuts, s, st = self.cuts[number, sign], e.segment, self.states[sign]
        ribs, halves = [], [[], []]  # type: tuple[list[Edge], list[list[Edge]]]
        for k, (u, turn) in enumerate(cuts):
            curve = meridian_curve(pose.tip, pose.radial(u), s, pose.axis)
            if turn is not None:
                _, z, beta, _ = (float(v[0, 0]) for v in turn.place(g, st, np.array([0.5])))
                at = beta if isinstance(curve, geo.Circle) else curve.t1 * (z - s.z0) / (s.z1 - s.z0)
                up = turn.ends[0][0] == e.upper
                curve = geo.Part(curve, curve.t0, at) if up else geo.Part(curve, at, curve.t1)
                parts = self.curves[g.segments.index(turn), sign]
                later = float(turn.place(g, st, np.array([0.75]))[3][0, 0])
                ahead = 1 if np.sin(later - u) > 0.0 else 0
                halves[k].append(parts[ahead])
                halves[1 - k].append(parts[1 - ahead])
            ribs.append(self.build.edge(curve))
        stops = [cuts[0][0], cuts[1][0], cuts[0][0] + 2.0 * np.pi]
        for ring in (e.lower, e.upper):
            arc = self.kept(ring, sign)
            if arc is None or ring is None:
                continue
            inside = [u + turn for u in stops[:2] for turn in 2.0 * np.pi * np.arange(-2, 3)]
            ends = [arc[0], *sorted(u for u in inside if arc[0] < u < arc[1]), arc[1]]
            if not g.present[ring]:
                ends = stops
            for a, b in pairwise(ends):
                middle = stops[0] + (0.5 * (a + b) - stops[0]) % (2.0 * np.pi)
                halves[int(middle > stops[1])] += self.rims[sign].arcs(g.rings[ring].joint, a, b)
        for k in (0, 1):
            self._face(number, sign, run_of([*ribs, *halves[k]]), (stops[k], stops[k + 1]), 0.0)

    def _face(
        self, number: int, sign: int, edges: list[Edge], span: tuple[float, float], beyond: float = 1.6
    ) -> None:
        """beyond : rad by which a ball's cap may reach farther around than its span."""
        pose, s = self.poses[sign], self.grazing.elements[number].segment
        st = self.states[sign]
        region = hints = None
        if s.is_arc and abs(s.cr) <= FLAT_MM:
            V = st.velocity[0] + s.cz * st.rate[0]
            around = np.linspace(span[0] - beyond, span[1] + beyond, 33).tolist()
            region = normals(pose, np.linspace(*s.beta, 9).tolist(), around)
            kept = region[sign * (region @ V) >= -1e-9]
            region = kept if len(kept) else region
            hints = np.array([pose.axis, pose.heading, pose.left])
        surface = pose.surface(s, 0.5 * (span[0] + span[1]), region, hints)
        curve = edges[0].curve
        probe = curve.at(np.array(0.5 * (curve.t0 + curve.t1)))
        self.build.face(surface, [edges], probe, pose.outward(s, probe))


def _turns(segment: CurveSegment) -> bool:
    return segment.ends[0][0] == segment.ends[1][0] and not isinstance(segment, Chord | EdgeSpan)


def enveloped(grazing: GrazingCurve, fit_mm: float, loose_mm: float = 0.0) -> Built:
    """Faces of the sweep of the convex profile that grazes; loose_mm is what a sheet may miss that does not fit.

    Raises SweepError: The grazing curve changes its shape during the block or is of one that has no solid here.
    Raises EngineError: Edges do not fit.
    """
    work = _Envelope(grazing, fit_mm, loose_mm)
    work.prepare()
    work.sheets()
    work.caps()
    return Built(work.build, max(work.error, SAME_VERTEX_MM), work.grazing)
