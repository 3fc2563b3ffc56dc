"""How the grazing curve of a tool whose axis turns runs over the body during a block, and where it must not.

From ring to ring (`rings.py`) the curve is made of segments (`segments.py`, with the symbols). Rings that graze
and segments are the same all along a block; `GrazingCurve` refuses it otherwise.

A flat face that tilts about a line in it leaves the sweep on both sides of its chord: phi_tt < 0, the chord lies
inside. The roof of such a face over a point is the higher one of two planes, where the point was entered and
where it was left: the first pose or the front of the rim, the last pose or the rear of the rim. They meet in a
valley, which is

- on the rear of the rim, where it crosses the first pose of the disc: P(t, u) in that plane, one angle per time;
- the line in which both poses meet;
- on the front of the rim, where it crosses the last pose.

It runs from the chord of one pose to the chord of the other one, and takes the place of the sheet of the chord.
"""

from __future__ import annotations

from contextlib import suppress
from functools import cached_property

import numpy as np
from scipy.optimize import brentq

from vmachining.arrays import Bools, Floats
from vmachining.engines.brep.envelopes import segments as seg
from vmachining.engines.brep.envelopes.lens import Lens, lens_opens, lens_span, risen, side_speed
from vmachining.engines.brep.envelopes.pockets import Pocket
from vmachining.engines.brep.envelopes.rings import Element, rings_of
from vmachining.engines.brep.occt.tolerances import CONFUSION_MM, FLAT_MM, MISS_MM
from vmachining.engines.brep.translations.caps import Tool
from vmachining.errors import SweepError
from vmachining.sweep.grazing import Circles, across, arc_terms, folding, instant, line_terms, scalars
from vmachining.tool import Segment

SHUT = 1e-4
"""sin^2 of half the angle of a chord that is all but a point: on a rim of 10 mm it cuts off 5e-4 mm,
and what it hides there lies that times the turn of the block below the face."""

BENT = 0.1
"""A cone of which a circle has a^2 + b^2 - c^2 below this share of the largest is left by the square root."""

QUICK = 1.0
"""rad between two looks: a heading that turns faster has no branch that could be followed."""


class Divide(SweepError):  # noqa: N818
    """A block that has to be cut in its own time `at`, or in equal parts; `soft` if its shape changes there."""

    def __init__(self, message: str, at: float, *, soft: bool, parts: int = 2) -> None:
        super().__init__(message)
        self.at, self.soft, self.parts = at, soft, parts


class GrazingCurve:
    """How the grazing curve runs over a tool during a block, the same at all its times.

    filled : a loop that is left out. deep_mm : how far below the line in which its poses meet a sheet may lie.

    Raises SweepError: It changes its shape, or is of one that has no sheets here.
    """

    def __init__(
        self, tool: Tool, moving: seg.Moving, filled: Pocket | None = None, deep_mm: float = MISS_MM
    ) -> None:
        self.tool, self.moving, self.deep = tool, moving, deep_mm
        self.rings, self.elements = rings_of(tool)
        self._w = np.linspace(0.0, 1.0, seg.DENSE)
        self._angles: dict[tuple[int, int, bool, bytes], Floats] = {}
        self.dense = moving.state(self._w)
        self._times = self.dense.t
        r, z, beta = (np.array([v]) for v in zip(*[(g.r, g.z, g.beta) for g in self.rings], strict=True))
        of = seg.wave(self.dense, r, z, beta)
        a, b, c = of
        gap = a * a + b * b - c * c
        self.sign = np.sign(c[seg.DENSE // 2])  # of f on a ring without grazing points
        two = gap > 0.0
        self.lenses: list[Lens] = []
        self._shut(two, gap / np.maximum(a * a + b * b, 1e-300))
        if filled is not None:
            two[:, filled.ring], self.sign[filled.ring] = False, filled.sign
        mixed = two.any(axis=0) != two.all(axis=0)
        for k in np.flatnonzero(mixed).tolist():
            mixed[k] = not self._is_lens(k, two[:, k], c[:, k])
        two = two & ~((two.any(axis=0) != two.all(axis=0)) & ~mixed)
        if mixed.any():
            k = int(np.argmax(mixed))
            text = f"the grazing curve reaches the joint at height {self.rings[k].z:.6g} mm on the way"
            for place, inner in ((0, slice(1, None)), (-1, slice(None, -1))):
                if (two[inner].any(axis=0) == two[inner].all(axis=0)).all():
                    raise Divide(text, -float(place), soft=True)
            if (two[1:-1].any(axis=0) == two[1:-1].all(axis=0)).all():
                raise Divide(text, 0.0, soft=True)
            raise SweepError(text)
        self.present: Bools = np.asarray(two.all(axis=0))
        self._heading = self._followed(of.heading)
        self.valley: dict[seg.End, tuple[Floats, float]] = {}
        self.segments = self._segments()
        self._check_widths()
        self._valleys()

    def _shut(self, two: Bools, size: Floats) -> None:
        """Lenses that are all but shut at an end of the block, because another change is there, are."""
        for k, ring in enumerate(self.rings):
            beside = k - ring.disc
            if not (ring.disc and 0 <= beside < len(self.rings) and two[:, k].all()):
                continue
            for end in (0, seg.DENSE - 1):
                if self.rings[beside].joint == ring.joint and size[end, k] < SHUT and lens_opens(
                    self.moving, float(self._times[end]), ring, self.rings[beside]):  # fmt: skip
                    two[end, k] = False

    def _is_lens(self, k: int, two: Bools, c: Floats) -> bool:
        """Whether the chord of a ring opens or closes as a lens, which is noted if it can be seen.

        Raises Divide: The lens is too long for one piece.
        """
        ring = self.rings[k]
        beside = k - ring.disc
        once = np.count_nonzero(two[1:] != two[:-1]) == 1
        if not (ring.disc and once and self.rings[beside].joint == ring.joint):
            return False
        sign = 1 if two[-1] else -1
        shut = 0 if sign > 0 else seg.DENSE - 1
        at = float(self._times[np.flatnonzero(two)[0 if sign > 0 else -1]])
        if c[shut] * sign > 0.0 or not lens_opens(self.moving, at, ring, self.rings[beside]):
            return False
        self.sign[k] = -sign
        foot, axis = self.dense.tip[shut] + ring.z * self.dense.axis[shut], self.dense.axis[shut]
        span = lens_span(self.moving, sign, ring, axis)
        if span is None:
            return True
        lens = Lens(k, sign, *span, axis)
        u = np.linspace(*span, 17)
        w = lens.border(self.moving, ring, u)
        here = self.moving.state(w)
        points = here.tip + ring.z * here.axis + ring.r * here.radial(u[:, None])[:, 0]
        beyond = np.linalg.norm(points - foot, axis=1).max() >= ring.r
        last = self.moving.state(np.array([float(sign > 0)]))
        if beyond or (side_speed(last, self.rings[beside], u) * sign >= 0.0).any():
            raise Divide("a lens of a flat face runs out of it", 0.5, soft=False)
        self.lenses.append(lens)
        return True

    # -- angles --------------------------------------------------------------------------------------------

    def _followed(self, raw: Floats) -> Floats:
        """Headings of the rings over time, unwrapped in time and, at the middle, along the meridian."""
        out = np.unwrap(raw, axis=0)
        grazing = self.present
        if grazing.any() and np.abs(np.diff(out[:, grazing], axis=0)).max() > QUICK:
            raise SweepError("the grazing curve turns round too fast: a point of the axis hardly moves")
        half = seg.DENSE // 2
        middle = seg.State(*(v[half : half + 1] for v in self.dense))
        angles = [float(out[half, 0])]
        for k in range(1, len(self.rings)):
            p, q = self.rings[k - 1], self.rings[k]
            e = next(e for e in self.elements if e.lower == k - 1 and e.upper == k)
            share = np.linspace(0.0, 1.0, 33)[None]
            beta = p.beta + share * (q.beta - p.beta)
            if e.kind == "arc":
                g = e.segment
                r, z = g.cr + g.radius * np.cos(beta), g.cz + g.radius * np.sin(beta)
            else:
                r, z = p.r + share * (q.r - p.r), p.z + share * (q.z - p.z)
            run = np.unwrap(seg.wave(middle, r, z, beta).heading[0])
            angles.append(angles[-1] + float(run[-1] - run[0]))
        turns = np.round((np.array(angles) - out[half]) / (2.0 * np.pi))
        return np.asarray(out + (2.0 * np.pi * turns)[None])

    def angle(self, ring: int, side: int, st: seg.State) -> Floats:
        """(n,) where a side of a ring grazes, or where its valley runs; the latest few hundred remembered."""
        key = ring, side, (ring, side) in self.valley, st.t.tobytes()
        if key not in self._angles:
            if len(self._angles) > 500:
                self._angles.clear()
            self._angles[key] = self._angle(ring, side, st)
        return self._angles[key]

    def _angle(self, ring: int, side: int, st: seg.State) -> Floats:
        if not self.present[ring]:
            return np.full(len(st.t), 0.5 * np.pi * (1 + side))  # an edge that grazes all round
        g = self.rings[ring]
        one = np.ones((len(st.t), 1))
        of = Circles(*(v[:, 0] for v in seg.wave(st, g.r * one, g.z * one, g.beta * one)))
        u = seg.near(of.heading, np.interp(st.t, self._times, self._heading[:, ring])) + side * of.half
        if (ring, side) not in self.valley:
            return np.asarray(u)
        axis, t0 = self.valley[ring, side]
        valley = seg.angle(risen(self.moving, st, t0, axis, g), side)
        return np.asarray(np.where(st.t == t0, u, seg.near(valley, u)))

    def between(self, ends: tuple[seg.End, seg.End], st: seg.State, s: Floats, raw: Floats) -> Floats:
        """Angles (n, m) on the branch that joins two ends, which they meet exactly."""
        u = seg.near(raw, self.span(ends, st, s))
        for end, edge in zip(ends, (0.0, 1.0), strict=True):
            u = np.where(s == edge, self.angle(*end, st)[:, None], u)
        return u

    def span(self, ends: tuple[seg.End, seg.End], st: seg.State, s: Floats) -> Floats:
        """Angles (n, m) shared evenly between two ends; from a ring to itself always upward."""
        ua, ub = (self.angle(*end, st)[:, None] for end in ends)
        if ends[0][0] == ends[1][0] and ends[0][1] > ends[1][1]:
            ub = ub + 2.0 * np.pi
        return np.asarray((1.0 - s) * ua + s * ub)

    def tie(self, end: seg.End, st: seg.State) -> Floats:
        """(n, 3) mm: path of an end of a segment."""
        g = self.rings[end[0]]
        u = self.angle(*end, st)[:, None]
        return np.asarray(st.tip + g.z * st.axis + g.r * st.radial(u)[:, 0])

    # -- shape ---------------------------------------------------------------------------------------------

    def _segments(self) -> list[seg.CurveSegment]:
        out: list[seg.CurveSegment] = []
        for k, e in enumerate(self.elements):
            grazing = [ring for ring in (e.lower, e.upper) if ring is not None and self.present[ring]]
            g = e.segment
            if e.kind == "disc":
                if grazing:
                    ends = ((grazing[0], -1), (grazing[0], 1))
                    out.append(seg.Chord(k, ends, g.r0, g.z0, self.rings[grazing[0]].beta))
                continue
            low, high = self._extremes(e)
            if len(grazing) == 2 and (low > 0.0).all():
                for side in (-1, 1):
                    ends = ((grazing[0], side), (grazing[1], side))
                    if e.kind == "edge":
                        out.append(seg.EdgeSpan(k, ends, g.r0, g.z0, self.fan(e)))
                    elif e.kind == "line":
                        bent = abs(g.r1 - g.r0) > FLAT_MM and bool(low.min() < BENT * high.max())
                        out.append(seg.LineSide(k, ends, g, bent))
                    else:
                        out.append(seg.ArcSide(k, ends, g))
            elif len(grazing) == 1 or (len(grazing) == 2 and (low < 0.0).all()):
                out += self._turning(k, e, grazing)
            elif e.kind == "edge" and not grazing and self.sign[e.lower] != self.sign[e.upper]:
                assert e.lower is not None  # all of the edge grazes: two halves of it
                halves = [((e.lower, t), (e.lower, -t)) for t in (-1, 1)]
                out += [seg.EdgeSpan(k, ends, g.r0, g.z0, self.fan(e)) for ends in halves]
            elif grazing or (high > 0.0).any():
                where = f"between heights {g.z0:.6g} and {g.z1:.6g} mm"
                raise SweepError(f"the grazing curve turns back or closes on the face {where}")
        return out

    def _check_widths(self) -> None:
        """On a sharp edge the shape changes where an end of one of its normals meets one of the other."""
        for e in [e for e in self.elements if e.kind == "edge"]:
            assert e.lower is not None and e.upper is not None
            if not (self.present[e.lower] and self.present[e.upper]):
                continue
            for first, second in ((a, b) for a in (-1, 1) for b in (-1, 1)):
                apart = self.angle(e.lower, first, self.dense) - self.angle(e.upper, second, self.dense)
                width = np.abs(seg.near(apart, np.zeros(seg.DENSE))) * e.segment.r0
                if width.min() < CONFUSION_MM:
                    text = f"the grazing curve narrows to a point at height {e.segment.z0:.6g} mm"
                    k = int(np.argmin(width))
                    raise (
                        Divide(text, float(k > 0), soft=True) if k in (0, seg.DENSE - 1) else SweepError(text)
                    )

    def _turning(self, k: int, e: Element, grazing: list[int]) -> list[seg.CurveSegment]:
        """Stretches on an arc or an edge that come back to the ring they start from."""
        out: list[seg.CurveSegment] = []
        g = e.segment
        for ring in grazing:
            other = e.upper if ring == e.lower else e.lower
            if len(grazing) == 2:
                trails = self.middle_trails(e)
            else:
                trails = self.sign[other] < 0.0 if other is not None else self._tip_trails()
            first = -1 if trails else 1  # of a trailing end the curve is where the ring leads
            turn = ((ring, first), (ring, -first))
            if e.kind == "edge":
                out.append(seg.EdgeSpan(k, turn, g.r0, g.z0, self.fan(e)))
            elif other is None and abs(g.cr) <= FLAT_MM and ring == e.upper:
                out.append(seg.BallTurn(k, ((ring, -1), (ring, 1)), g))
            elif e.kind == "line":
                if other is None:
                    raise SweepError("the grazing curve turns back on a cone with a tip")
                out.append(seg.LineTurn(k, turn, g, ring == e.upper))
            else:
                out.append(self._arc_turn(k, turn, g))
        return out

    def _arc_turn(self, k: int, turn: tuple[seg.End, seg.End], g: Segment) -> seg.ArcTurn:
        """Around a torus, measured as finely as its sharpest bend needs."""
        found, st = seg.ArcTurn(k, turn, g), seg.State(*(v[:: seg.DENSE // 4] for v in self.dense))
        if self._is_sharp(g, turn):
            found, corners = seg.ArcTurn(k, turn, g, seg.LOOKS), seg.CORNERS
            while corners < seg.FINEST:
                with suppress(SweepError):
                    found.place(self, st, np.array([0.5]))
                    break
                corners = 2 * corners - 1
                found = seg.ArcTurn(k, turn, g, seg.LOOKS, corners)
        return found

    def _is_sharp(self, g: Segment, turn: tuple[seg.End, seg.End]) -> bool:
        """Whether a curve around a torus is much faster at some angles than at others."""
        st = seg.State(*(v[:: seg.DENSE // 4] for v in self.dense))
        u = self.span(turn, st, np.linspace(0.0, 1.0, seg.CORNERS))
        beta = seg.graze_beta(st, g.cr, g.cz, u, 0.5 * sum(g.beta))
        run = np.abs(np.diff(beta, axis=1)) * g.radius
        around = np.abs(np.diff(u, axis=1)) * (g.cr + g.radius * np.cos(0.5 * (beta[:, 1:] + beta[:, :-1])))
        step = np.hypot(run, around)
        return bool((step.max(axis=1) > seg.LONG * step.sum(axis=1)).any())

    def middle_trails(self, e: Element) -> bool:
        """Whether circles trail that lie between two turning segments of an element."""
        return bool(np.sin(self.fan(e)) < 0.0) == self._tip_trails()

    def fan(self, e: Element) -> float:
        """The middle (rad) of the normals of an element."""
        return float(np.mean([self.rings[r].beta for r in (e.lower, e.upper) if r is not None]))

    def _tip_trails(self) -> bool:
        """Whether the lowest point of a tool without bottom disc trails, in the middle of the block."""
        half = seg.DENSE // 2
        return bool(self.dense.velocity[half] @ self.dense.axis[half] > 0.0)

    def _extremes(self, e: Element) -> tuple[Floats, Floats]:
        """(n,) least and largest a^2 + b^2 - c^2 of the circles of an element: below 0 one does not graze.

        On an arc it is p cos^2 b + q cos b sin b + s sin^2 b, along a line a parabola.
        """
        g, st = e.segment, self.dense
        form = scalars(st.velocity, st.rate, st.axis)
        if e.kind == "line":
            first, slope, bend = line_terms(g) @ form
            with np.errstate(divide="ignore", invalid="ignore"):
                at = np.clip(np.nan_to_num(-0.5 * slope / bend), 0.0, 1.0)
            values = np.stack([first, first + slope + bend, first + slope * at + bend * at * at])
            return values.min(axis=0), values.max(axis=0)
        edge = e.kind == "edge"
        b0, b1 = (self.rings[r].beta for r in (e.lower, e.upper) if r is not None) if edge else g.beta
        p, cross, last = (arc_terms(g.r0, g.z0) if edge else arc_terms(g.cr, g.cz)) @ form
        far = 0.5 * np.arctan2(cross, p - last)
        inner = [np.clip(far + turn * np.pi, b0, b1) for turn in (-0.5, 0.0, 0.5)]
        spots = [np.full(len(p), b0), np.full(len(p), b1), *inner]
        cos, sin = np.cos(spots), np.sin(spots)
        values = p * cos * cos + cross * cos * sin + last * sin * sin
        return values.min(axis=0), values.max(axis=0)

    # -- folds ---------------------------------------------------------------------------------------------

    def fold(self, segment: seg.CurveSegment, w: Floats, s: Floats) -> Floats:
        """(n, m) second derivative of the distance to the body in time: < 0 where the sheet lies inside."""
        st = self.moving.state(w)
        r, z, beta, u = segment.place(self, st, s)
        out = np.empty(r.shape)
        for k in range(len(w)):
            x, y = across(st.axis[k])
            shift = np.arctan2(st.x[k] @ y, st.x[k] @ x)
            now = instant(self.moving.path, float(st.t[k]))
            bend = np.full(len(s), segment.bend)
            out[k] = folding(now, z[k], r[k], np.cos(beta[k]), np.sin(beta[k]), u[k] + shift, bend)
        return out

    def _valleys(self) -> None:
        """Discs whose chords lie inside the sweep: what is left of them is where their first and last pose meet.

        Between a sheet of the edge and the disc at the other end of the block the solid has a valley, from
        the chord of that end to the line in which both discs meet.
        """
        for chord in [c for c in self.segments if isinstance(c, seg.Chord)]:
            fold = self.fold(chord, np.linspace(0.0, 1.0, 9), np.array([0.0, 1.0]))
            if (fold > 0.0).all():
                continue
            ring = chord.ends[0][0]
            edges = [e for e in self.segments if isinstance(e, seg.EdgeSpan)]
            spans = [e for e in edges if ring in (e.ends[0][0], e.ends[1][0])]
            if spans and (fold > 0.0).any():
                if -0.125 * float(fold.min()) <= self.deep:
                    continue  # a part of it lies inside, but no deeper than a sheet may
                raise self._fold_begins(chord)
            if not spans:
                continue  # a round corner: a fold like any other
            self._open_valley(chord, ring, spans)
            self.segments.remove(chord)

    def _fold_begins(self, chord: seg.Chord) -> SweepError:
        """When the middle of a chord begins or ceases to lie inside; halves, where an end of it does so alone."""
        fold = self.fold(chord, self._w, np.array([0.0, 1.0]))
        k = np.flatnonzero((fold[1:] > 0.0).any(axis=1) != (fold[:-1] > 0.0).any(axis=1))
        text = "a chord of a flat face folds on the way"
        halves = Divide(text, 0.5, soft=False)
        if not len(k):
            return halves

        def least(w: float) -> float:
            return float(self.fold(chord, np.array([w]), np.array([0.5]))[0, 0])

        w = self._w[[k[0], k[0] + 1]]
        at = [least(v) for v in w.tolist()]
        if at[0] * at[1] > 0.0:
            return halves
        root = float(brentq(least, *w.tolist(), xtol=1e-14))
        when = float(self.moving.time(np.array([root]))[0])
        return Divide(text, when, soft=True) if 0.01 < when < 0.99 else halves

    def _open_valley(self, chord: seg.Chord, ring: int, spans: list[seg.EdgeSpan]) -> None:
        g = self.rings[ring]
        for side in (-1, 1):
            span = next(e for e in spans if (ring, side) in e.ends)
            other = span.ends[0] if span.ends[1] == (ring, side) else span.ends[1]
            gap = side * (self.angle(ring, side, self.dense) - self.angle(*other, self.dense))
            if other[0] == ring:
                rear = span.ends[0][1] < 0
            elif (gap > 0.0).any() != (gap > 0.0).all():
                raise SweepError("a chord of a flat face passes the side of the tool")
            else:
                rear = bool((gap > 0.0).all())
            end = 0 if rear else -1
            st = self.dense
            self.valley[ring, side] = st.axis[end], float(st.t[end])
            u = self.angle(ring, side, st)
            gap = (
                side * (u - self.angle(*other, st)) * (1 if rear else -1) if other[0] != ring else np.ones(1)
            )
            far = -1 if rear else 0
            other_center = st.tip[0 if far else -1] + g.z * st.axis[0 if far else -1]
            corner = self.tie((ring, side), st)[far]
            if np.isnan(u).any() or gap.min() <= 0.0 or np.linalg.norm(corner - other_center) > g.r:
                raise Divide("a valley of a flat face runs out of it", 0.5, soft=False)

    @cached_property
    def ends(self) -> list[seg.End]:
        """Every end of a segment once."""
        return sorted({end for segment in self.segments for end in segment.ends})
