"""Cutter radius compensation: programmed moves go in, moves of the tool centre come out, one segment late.

A segment (any motion in the plane) is held back until its successor says where it ends; dwells and moves along
the normal axis wait with it at its end.

    corner between tangents t1, t2     sigma (t1 x t2) > 0   both curves are trimmed to where they meet
                                       else                  an arc of the tool radius about the corner, or
                                                             with corner "miter" one point, if within 2 rho;
                                                             with "line" along the tangents, see `_in_lines`;
                                                             before a rapid a straight rapid, as in LinuxCNC
    entry "prev"   the entry move is a segment like any other whose start is not offset
    entry "next"   the entry move goes straight to the start of the next offset curve
    exit           the last segment ends beside its programmed end; the next move leaves from there

Nothing is trimmed away altogether: a piece that would run backwards is a gouge (E355). A piece that reaches over
the segment before or after it is a warning (W355, `cuts_into`), because controls cut it. Only neighbours are
looked at: a contour that crosses itself later is cut as programmed.
Sources: RS274/NGC; observed behaviour of LinuxCNC 2.9, which passes over corners that turn by less than 0.05 rad.
That is copied unless the corners are "exact", "miter" or "line".
In inverse time the feed is the one of the programmed path. Rotary axes turn in the first move of their block,
which is the corner arc if there is one.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple

from vmachining.nc.frames import Plane, swept
from vmachining.nc.model import CompensationError, Motion, Move, Point, add, put, subtract
from vmachining.nc.offset_curves import ARCS, Curve, Pair, cuts_into, meet, offset_arc, offset_line, trimmed

_make = tuple.__new__  # of named tuples: their own constructors take twice as long

JOINED_MM: Final = 1e-6
"""Offset curves whose ends are this near need no corner: a thousandth of the finest programmed digit."""

REVERSAL: Final = 1e-9
"""|t1 x t2| below which a corner is straight on or straight back."""

AROUND: Final = 0.05
"""rad: an inner corner this near to a reversal that cannot be trimmed is taken as an outer one, as in LinuxCNC."""

SMOOTH: Final = 0.05
"""rad: a corner that turns by no more is passed over, as in LinuxCNC: the tool leaves the offset curve by at most
rho (1 - cos 0.05), an eight hundredth of its radius. `exact` looks at every corner."""


class Pending(NamedTuple):
    """A segment whose end is not known yet.

    entry : it goes straight, whatever follows (entry "next"). before : the programmed segment before it, but for
    the entry move.
    """

    curve: Curve
    move: Move
    followers: tuple[Move, ...] = ()
    entry: bool = False
    before: Move | None = None


class Step(NamedTuple):
    """What became of a move: the compensation behind it, the moves that are final now, (code, text) warnings."""

    after: Compensation
    moves: list[Move]
    warnings: list[tuple[str, str]]


class Compensation(NamedTuple):
    """Cutter compensation in force. side : +1 left, -1 right. turn : cosine and sine of the work offset.

    short_entry : controls that go straight to the first offset point take entry moves of any length. lines : corner "line".
    """

    side: int
    radius: float
    plane: Plane
    entry: str = "prev"
    miter: bool = False
    exact: bool = False
    turn: tuple[float, float] = (1.0, 0.0)
    short_entry: bool = False
    lines: bool = False
    pending: Pending | None = None

    def is_like(self, side: int, diameter: float) -> bool:
        """Whether the same compensation is called for again."""
        return (side if diameter >= 0.0 else -side) == self.side and abs(diameter) / 2.0 == self.radius

    @property
    def shift(self) -> float:
        """sigma rho."""
        return self.side * self.radius

    def accept(self, move: Move) -> Step:
        """Take the next programmed move.

        Raises CompensationError: E352, E353, E354, E355; nothing has changed then.
        """
        if self.radius == 0.0:
            return Step(self, [move], [])
        start, end = self._pair(move.start), self._pair(move.end)
        if move.motion not in ARCS and math.dist(start, end) <= JOINED_MM:
            if self.pending is None:
                return Step(self, [move], [])
            held = self.pending._replace(followers=(*self.pending.followers, move))
            return Step(self._holding(held), [], [])
        if self.pending is None:
            return Step(self._holding(self._enter(move, start, end)), [], [])
        return self._follow(self.pending, move, start, end)

    def finish(self) -> tuple[list[Move], Point | None]:
        """Compensation off: the moves held back, and where the tip is (None: on the programmed point)."""
        if self.pending is None:
            return [], None
        moves = self._release(self.pending, self.pending.curve.end)
        return moves, moves[-1].end

    # ---- segments ----

    def _pair(self, point: Point) -> Pair:
        return point[self.plane.first], point[self.plane.second]

    def _curve(self, move: Move, start: Pair, end: Pair) -> Curve:
        if move.motion not in ARCS or move.center is None:
            return offset_line(start, end, self.shift)
        return offset_arc(start, end, move.center, move.motion is Motion.ARC_CCW, move.turns, self.shift)

    def _enter(self, move: Move, start: Pair, end: Pair) -> Pending:
        if math.dist(start, end) < self.radius - JOINED_MM and not self.short_entry:
            what = f"the entry move, {math.dist(start, end):.6g} mm, is shorter than the tool radius"
            raise CompensationError("E353", f"{what}, {self.radius:.6g} mm")
        if self.entry == "next" and move.motion in ARCS:
            raise CompensationError("E352", "compensation starts on an arc")
        curve = self._curve(move, start, end)
        curve = _entry_arc(curve, start) if curve.center is not None else curve._replace(start=start)
        return Pending(curve, move, entry=self.entry == "next")

    def _follow(self, held: Pending, move: Move, start: Pair, end: Pair) -> Step:
        curve, before = self._curve(move, start, end), held.curve
        turn = before.last[0] * curve.first[1] - before.last[1] * curve.first[0]
        ahead = before.last[0] * curve.first[0] + before.last[1] * curve.first[1]
        warnings = list[tuple[str, str]]()
        if held.entry:
            return Step(self._with(held, curve, move), self._release(held, curve.start), [])
        if self._starts(held) and ahead < 0.0:
            warnings.append(("W353", "the entry move opposes the first cut, so the tool goes round its end"))
        moves: list[Move] = []
        smooth = not (self.exact or self.miter or self.lines) and abs(math.atan2(turn, ahead)) <= SMOOTH
        if smooth or math.dist(before.end, curve.start) <= JOINED_MM:
            moves = self._release(held, before.end)
            curve = curve._replace(start=before.end)
            warnings += self._neighbours(held, before, move)
            return Step(self._with(held, curve, move), moves, warnings)
        inner = self.side * turn > REVERSAL or (abs(turn) <= REVERSAL and ahead > 0.0)
        back = ahead <= -math.cos(AROUND)
        # straight back along an arc that the tool is outside of: the arc crosses the path it came by
        across = back and any(c.center is not None and (self.side > 0) != c.ccw for c in (before, curve))
        if inner or across:
            try:
                before, curve = self._trim(held, move, before, curve)
                inner = True
            except CompensationError:
                if not back:
                    raise
                if inner:
                    text = "the path turns back by nearly 180 degrees, so the tool goes round its end"
                    warnings.append(("W355", text))
                inner = False
        if inner:
            moves = self._release(held._replace(curve=before), before.end)
        elif self.miter and (point := self._miter(before, curve)) is not None:
            moves = self._release(held, point)
            curve = curve._replace(start=point)
        elif self.lines and not back:
            moves, curve = self._in_lines(held, move, curve, ahead)
            if len(moves) > 1 and move.rotary_deg is not None:
                move = move._replace(rotary_start=move.rotary_deg, duration_s=None)
        else:
            moves = self._release(held, before.end)
            center = None if move.motion is Motion.RAPID else before.corner
            moves.append(self._corner(moves[-1], move, curve.start, center, before.corner))
            if move.rotary_deg is not None:  # the corner arc has turned the axes already
                move = move._replace(rotary_start=move.rotary_deg, duration_s=None)
        if not warnings:
            final = before if inner else before._replace(end=self._pair(moves[0].end))
            warnings += self._neighbours(held, final, move)
        return Step(self._with(held, curve, move), moves, warnings)

    def _with(self, held: Pending, curve: Curve, move: Move) -> Compensation:
        """The same with the next segment held back."""
        return self._holding(Pending(curve, move, before=None if self._starts(held) else held.move))

    def _holding(self, pending: Pending) -> Compensation:
        return _make(Compensation, (*self[:-1], pending))

    def _neighbours(self, held: Pending, curve: Curve, following: Move) -> list[tuple[str, str]]:
        """W355 if the final path of a segment reaches over the segment before or after it.

        Not of the entry move: it comes from outside and crosses to its side of the path as it comes.
        """
        if self._starts(held):
            return []
        axes = self.plane.first, self.plane.second, self.plane.normal
        for other in (held.before, following):
            if other is None or other.feed_mm_min is None or held.move.feed_mm_min is None:
                continue  # rapids are above the part
            (a, b), (c, d) = ((m.start[axes[2]], m.end[axes[2]]) for m in (held.move, other))
            if min(a, b) > max(c, d) or min(c, d) > max(a, b):
                continue
            if cuts_into(curve, other, axes, self.radius):
                text = f"on the path of line {held.move.line} the tool reaches over that of line {other.line}"
                return [("W355", text)]
        return []

    def _starts(self, held: Pending) -> bool:
        """Whether the held segment is the entry move: its start is not offset."""
        return math.dist(held.curve.start, self._pair(held.move.start)) <= JOINED_MM

    def _trim(self, held: Pending, move: Move, before: Curve, curve: Curve) -> tuple[Curve, Curve]:
        point = meet(before, curve)
        first = trimmed(before, end=point) if point is not None else None
        second = trimmed(curve, start=point) if point is not None else None
        if first is None or second is None:
            what = "cannot be reached without gouging: the tool does not fit between the blocks of lines"
            raise CompensationError("E355", f"this corner {what} {held.move.line} and {move.line}")
        return first, second

    def _in_lines(self, held: Pending, move: Move, curve: Curve, ahead: float) -> tuple[list[Move], Curve]:
        """About an outer corner along the tangents: to where they meet, or the radius on and straight across.

        A corner of the work from 90 degrees on has one point, a sharper one two (Fanuc 0i, cutter compensation details).
        """
        before, r = held.curve, self.radius
        (ex, ey), (sx, sy) = before.end, curve.start
        (tx, ty), (ux, uy) = before.last, curve.first
        far = r * math.sqrt((1.0 - ahead) / (1.0 + ahead)) if ahead >= 0.0 else r  # r tan(turn / 2)
        points = [(ex + far * tx, ey + far * ty)]
        if ahead < 0.0:
            points.append((sx - r * ux, sy - r * uy))
        moves = self._release(held, before.end if before.center is not None else points[0])
        if curve.center is not None:
            points.append(curve.start)
        else:
            curve = curve._replace(start=points[-1])
        for point in points if before.center is not None else points[1:]:
            moves.append(self._corner(moves[-1], move, point, None, before.corner))
            if move.rotary_deg is not None:
                move = move._replace(rotary_start=move.rotary_deg, duration_s=None)
        return moves, curve

    def _miter(self, before: Curve, curve: Curve) -> Pair | None:
        if before.center is not None or curve.center is not None:
            return None
        point = meet(before, curve)
        return point if point is not None and math.dist(point, before.corner) <= 2.0 * self.radius else None

    # ---- moves of the tool centre ----

    def _lift(self, pair: Pair, level: float) -> Point:
        if self.plane.normal == 2:
            return pair[0], pair[1], level
        plane = self.plane
        return put((0.0, 0.0, 0.0), {plane.first: pair[0], plane.second: pair[1], plane.normal: level})

    def _shifted(self, move: Move, start: Pair, end: Pair, center: Pair | None, turns: int) -> Move:
        normal = self.plane.normal
        there = self._lift(end, move.end[normal])
        aside = subtract(there, move.end)
        c, s = self.turn
        seen = (c * aside[0] + s * aside[1], c * aside[1] - s * aside[0], aside[2])
        shifted: Move = _make(Move, (
            *move[:3], self._lift(start, move.start[normal]), there, move.plane, center, turns, *move[8:12],
            add(move.end_machine, aside), add(move.end_program, seen), *move[14:],
        ))  # fmt: skip
        return shifted

    def _release(self, held: Pending, end: Pair) -> list[Move]:
        curve = held.curve
        turns = max(1, math.ceil(curve.sweep / math.tau - 1e-9)) if curve.center is not None else 0
        first = self._shifted(held.move, curve.start, end, curve.center, turns)
        return [first, *(self._shifted(move, end, end, None, 0) for move in held.followers)]

    def _corner(self, last: Move, following: Move, end: Pair, center: Pair | None, corner: Pair) -> Move:
        """A piece of the way about a convex corner, part of the block behind it: an arc, straight without a centre."""
        straight = Motion.RAPID if following.motion is Motion.RAPID else Motion.LINEAR
        arc = Motion.ARC_CCW if self.side < 0 else Motion.ARC_CW
        level = self._lift(corner, following.start[self.plane.normal])
        here = following._replace(
            motion=straight if center is None else arc,
            start=level,
            end=level,
            duration_s=None,
            end_machine=add(following.end_machine, subtract(level, following.end)),
            end_program=self._program_of(following, level),
        )
        return self._shifted(here, self._pair(last.end), end, center, 0 if center is None else 1)

    def _program_of(self, move: Move, point: Point) -> Point:
        """Program coordinates of a point of the simulation frame, by the end of a move that has both."""
        aside = subtract(point, move.end)
        c, s = self.turn
        e = move.end_program
        return (e[0] + c * aside[0] + s * aside[1], e[1] + c * aside[1] - s * aside[0], e[2] + aside[2])


def _entry_arc(curve: Curve, start: Pair) -> Curve:
    """An arc from the start as it is to the offset end, tangent there to the programmed arc.

    Its centre lies on the line through the offset end E and the programmed centre, as far from E as from the
    start S: with u from E to the centre, s = |E - S|^2 / (2 u . (S - E)).
    """
    assert curve.center is not None
    e, reach = curve.end, math.dist(curve.end, curve.center)
    u = (curve.center[0] - e[0]) / reach, (curve.center[1] - e[1]) / reach
    facing = 2.0 * (u[0] * (start[0] - e[0]) + u[1] * (start[1] - e[1]))
    square = (start[0] - e[0]) ** 2 + (start[1] - e[1]) ** 2
    if facing <= 1e-12 * square:
        raise CompensationError("E352", "compensation starts on an arc that no entry arc can replace")
    s = square / facing
    center = e[0] + s * u[0], e[1] + s * u[1]
    sweep = swept(start, e, center, curve.ccw)
    radius = math.dist(start, center)
    out = (start[0] - center[0]) / radius, (start[1] - center[1]) / radius
    first = (-out[1], out[0]) if curve.ccw else (out[1], -out[0])
    return curve._replace(start=start, first=first, center=center, sweep=sweep)
