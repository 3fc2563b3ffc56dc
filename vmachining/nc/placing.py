"""From program coordinates into work coordinates: frames, tool axes, joints, and the moves that come of them.

Moves of word address programs whose coordinates are turned, scaled, mirrored or tilted come here when they are made.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Final, Literal, NamedTuple

from vmachining.nc.compensation import Compensation
from vmachining.nc.findings import finding
from vmachining.nc.frames import IDENTITY, PLANES, UP, Frame, about, cross, dot, unit
from vmachining.nc.model import Finding, Motion, Move, PenError, Point, add, put, subtract
from vmachining.nc.offset_curves import Pair
from vmachining.nc.settings import Settings
from vmachining.nc.state import State

EdgeFeed = Literal["", "inner", "all"]
"""Which arcs under compensation keep the feed of their contour; the rest keeps that of the centre."""

SWING_DEG: Final = 5.0
PIECE_RAD: Final = math.pi / 2.0
"""Arcs under a leaning tool come in pieces of a quarter."""

STILL: Final = 1e-9
_BARE: Final[dict[str, object]] = dict.fromkeys(
    ("center", "rotary_start", "rotary_deg", "rotary_program", "axis_end")
)
MAX_MOVES: Final = 5_000_000
"""Motions of a program: more is a loop without end."""


class Corner(NamedTuple):
    """Waiting between two segments; feed : mm/min or None. soft : where two cutting moves of the plane meet, else none."""

    kind: str
    size: float
    feed: float | None
    soft: bool = False


class Placing:
    """State of the tool, and how a finished move of program coordinates is written down; see `pen.py`."""

    def __init__(self, settings: Settings, *, miter: bool = False) -> None:
        self.settings, self.miter = settings, miter
        self.moves: list[Move] = []
        self.findings: list[Finding] = []
        self._once: set[tuple[str, str]] = set()
        self.frame, self.at, self.last = IDENTITY, settings.home, settings.home
        self.axis: Point = UP
        self.vector: Point | None = None
        self.plane = PLANES[170]
        self.scale = 1.0
        self.line, self.text = 1, ""
        self.n: int | None = None
        self.tool, self.rpm = 0, 0.0
        self.called: set[int] = set()
        self.known_radius: dict[int, float] = {}
        self.allowance = (0.0, 0.0)
        self.edge_feed: EdgeFeed = ""
        self.feed: float | None = None
        self.feed_mode = "min"
        self.compensation: Compensation | None = None
        self.tip: Point | None = None
        self.held: Move | None = None
        self.corner: Corner | None = None
        self.approach: Callable[[Pair], None] | None = None
        self.rotary: dict[str, float] = {}
        self.turned: dict[str, float] = {}
        self.tcp, self.unplaced, self.in_joints = False, set[int](), False
        self._stopped_told = False
        self._swing_pivot = False
        self.lean: Point | None = None
        self._turn_tcp = False

    @property
    def plane_axis(self) -> Point:
        """Tool axis that belongs to the frame: its own Z, or what the dialect says."""
        return self.frame.axis if self.lean is None else self.lean

    def note(
        self, code: str, message: str, word: str = "", *, once: str | None = None, hint: str = ""
    ) -> None:
        """Add a finding of this line; once : only the first with this key."""
        if once is not None:
            if (code, once) in self._once:
                return
            self._once.add((code, once))
        col = max(self.text.upper().find(word.upper()), 0) + 1 if word else 1
        self.findings.append(finding(code, self.line, self.n, message, word[:40], col, hint))

    def accept(self, what: str, word: str, once: str) -> None:
        """Note that it changes no path, once for this key."""
        self.note("I408", f"{what} does not change the path: accepted", word, once=once)

    def _move(self, motion: Motion, end: Point, feed: float | None) -> Move:
        if len(self.moves) > MAX_MOVES:
            raise PenError("E413", f"over {MAX_MOVES} motions")
        return Move(
            self.line, self.n, motion, self.at, end, self.plane.name, None, 0, feed, self.tool, self.rpm, 0.0, end, end
        )  # fmt: skip

    def _out(self, move: Move) -> None:
        frame = self.frame
        if move.motion is Motion.DWELL:
            self._add(move, self.last, self.last, None)
            return
        axis = self.plane_axis
        if move.axis_end is not None or self.vector is not None:
            self._out_vector(move)
            return
        angles = move.rotary_deg
        if axis != UP or (angles is None and not any(self.rotary.values())):
            if self.in_joints:  # the slides keep their places where the table turns about the datum
                self.in_joints, self.last, self.axis = False, self._tip(move.start, axis), axis
            self._swing(axis, move)
            self.turned = dict(self.rotary)
            self._out_plane(move, axis)
            return
        if self.allowance[0] != 0.0:
            raise PenError("E208", "an allowance of the tool length (DL) while rotary axes are turned", "DL")
        if angles is None and self.rotary != self.turned:
            self._turn_rapid()
        angles = angles or dict(self.rotary)
        start = {letter: self.turned.get(letter, 0.0) for letter in angles}
        self.turned = dict(angles)
        if not self.in_joints:
            self.in_joints, self.axis = True, UP
            self.last = self._tip(move.start, UP)
        turn = max((abs(angles[k] - start[k]) for k in angles), default=0.0)
        duration = None
        if turn > 0.0 and move.feed_mm_min:
            if self.feed_mode == "inverse" and self.feed:
                duration = 60.0 / self.feed
            elif math.dist(move.start, move.end) <= STILL:
                duration = 60.0 * turn / (move.feed_mm_min / self.scale)
        end = self._tip(move.end, UP)
        if move.center is not None and frame.plain:
            center = self._center(move)
            begin = self._tip(move.start, UP)
        elif move.center is not None:
            raise PenError("E361", "an arc in a turned coordinate system while rotary axes are turned")
        else:
            center, begin = None, self.last
        self._add(
            move, begin, end, None, center=center, rotary_start=start, rotary_deg=angles, rotary_program=dict(angles),
            tcp=self.tcp, duration_s=duration,
        )  # fmt: skip
        self.last = end

    def _center(self, move: Move) -> Pair:
        assert move.center is not None
        origin = self.frame.origin
        return move.center[0] + origin[self.plane.first], move.center[1] + origin[self.plane.second]

    def _turn_rapid(self) -> None:
        """The rotary axes alone, as joints, in rapid."""
        start = {letter: self.turned.get(letter, 0.0) for letter in self.rotary}
        place = self.last if self.in_joints else self._tip(self.at, UP)
        move = self._move(Motion.RAPID, self.at, None)
        self.in_joints, self.axis, self.last = True, UP, place
        angles = dict(self.rotary)
        turn = {"rotary_start": start, "rotary_deg": angles, "rotary_program": angles}
        self._add(move, place, place, None, **turn, tcp=self.tcp)
        self.turned = angles

    def _tip(self, point: Point, axis: Point) -> Point:
        q, more = self.frame.apply(point), self.allowance[0]
        return q if more == 0.0 else (q[0] + more * axis[0], q[1] + more * axis[1], q[2] + more * axis[2])

    def _out_plane(self, move: Move, axis: Point) -> None:
        frame = self.frame
        end = self._tip(move.end, axis)
        if move.center is None:
            self._add(move, self.last, end, axis)
        elif frame.plain and axis == UP:
            self._add(move, self._tip(move.start, axis), end, axis, center=self._center(move))
        else:
            self._out_arc(move, axis, end)
            return
        self.last = end

    def _out_arc(self, move: Move, axis: Point, end: Point) -> None:
        """An arc carried by the frame: in a main plane with the tool upright, else as circles about its normal."""
        frame, plane = self.frame, self.plane
        assert move.center is not None
        middle = put(move.start, {plane.first: move.center[0], plane.second: move.center[1]})
        center = self._tip(middle, axis)
        n = frame.direction(put((0.0, 0.0, 0.0), {plane.normal: 1.0}))
        ccw = (move.motion is Motion.ARC_CCW) != frame.mirrored
        start = self._tip(move.start, axis)
        main = next((k for k in range(3) if abs(abs(n[k]) - 1.0) < 1e-12), None)
        if main is not None and axis == UP:
            code = {2: 170, 1: 180, 0: 190}[main]
            out = PLANES[code]
            motion = Motion.ARC_CCW if ccw == (n[main] > 0.0) else Motion.ARC_CW
            self._add(
                move._replace(motion=motion, plane=out.name), start, end, axis,
                center=(center[out.first], center[out.second]),
            )  # fmt: skip
            self.last = end
            return
        self._pieces(move, start, end, center, n if ccw else (-n[0], -n[1], -n[2]), axis)

    def _pieces(self, move: Move, start: Point, end: Point, center: Point, n: Point, axis: Point) -> None:
        arm, finish = subtract(start, center), subtract(end, center)
        rise = dot(subtract(end, start), n)
        side = cross(n, arm)
        flat = subtract(finish, (rise * n[0], rise * n[1], rise * n[2]))
        sweep = math.atan2(dot(flat, side), dot(flat, arm)) % math.tau
        if sweep < 1e-9:
            sweep = math.tau
        sweep += math.tau * (move.turns - 1)
        count = max(1, math.ceil(sweep / PIECE_RAD - 1e-9))
        for k in range(1, count + 1):
            angle, up = sweep * k / count, rise * k / count
            c, s = math.cos(angle), math.sin(angle)
            place = end if k == count else add(
                center, (c * arm[0] + s * side[0] + up * n[0], c * arm[1] + s * side[1] + up * n[1],
                         c * arm[2] + s * side[2] + up * n[2]),
            )  # fmt: skip
            here = self.last if k > 1 else start
            ahead = rise * (k - 1) / count
            middle = add(center, (ahead * n[0], ahead * n[1], ahead * n[2]))
            self._add(move._replace(motion=Motion.ARC_CCW, turns=1), here, place, axis, circle=(middle, n))
            self.last = place

    def _out_vector(self, move: Move) -> None:
        given = move.axis_end
        if given is not None:
            axis = unit(self.frame.vector(given))
            if axis is None:
                raise PenError("E363", "the tool axis has no length")
            if dot(axis, self.axis) < -1.0 + 1e-12:
                raise PenError("E364", "the tool axis is reversed: no great circle is the shortest")
            self.vector = axis
        assert self.vector is not None
        if move.center is not None:
            raise PenError("E361", "an arc while the program gives tool axes")
        end = self._tip(move.end, self.vector)
        self._add(move._replace(axis_end=None), self.last, end, self.vector)
        self.last = end

    def _swing(self, axis: Point, cause: Move) -> None:
        """Bring the tool axis to the plane that the next motion needs."""
        if axis == self.axis:
            return
        goal = self.last if self._swing_pivot else swung(self.axis, axis, self.last)
        angle = math.degrees(math.acos(max(-1.0, min(1.0, dot(axis, self.axis)))))
        count = 1 if self._swing_pivot else max(1, math.ceil(angle / SWING_DEG))
        first, home = self.axis, self.last
        move = cause._replace(motion=Motion.RAPID, feed_mm_min=None, turns=0)
        for k in range(1, count + 1):
            toward = axis if k == count else _between(first, axis, k / count)
            place = goal if k == count else swung(first, toward, home)
            self._add(move, self.last, place, toward)
            self.last = place
        if not self._swing_pivot:
            self.note("W365", "how the tip swings while the rotary axes turn depends on the machine: assumed about zero",
                      once="swing")  # fmt: skip
        self._swing_pivot = False

    def _add(self, move: Move, start: Point, end: Point, axis: Point | None, **more: object) -> None:
        shift = self.settings.work_offsets.get(540)
        machine = end if shift is None else add(end, shift)
        if axis is not None and (axis != UP or self.axis != UP):
            more = {**more, "axis_start": self.axis, "axis_end": axis}
        if axis is not None:
            self.axis = axis
        move = move._replace(start=start, end=end, end_machine=machine)
        self.moves.append(move._replace(**(_BARE | more)))  # type: ignore[arg-type]


def swung(before: Point, after: Point, point: Point) -> Point:
    """The point turned about the origin by the shortest rotation from one axis to the other (Rodrigues)."""
    if before == after:
        return point
    k = unit(cross(before, after))
    if k is None:
        if dot(before, after) > 0.0:
            return point
        k = (1.0, 0.0, 0.0) if abs(before[0]) < 0.9 else (0.0, 1.0, 0.0)
    c = max(-1.0, min(1.0, dot(before, after)))
    s = math.sqrt(max(0.0, 1.0 - c * c))
    return about(k, point, c, s)


def _between(before: Point, after: Point, share: float) -> Point:
    angle = math.acos(max(-1.0, min(1.0, dot(before, after))))
    k = unit(cross(before, after)) or ((1.0, 0.0, 0.0) if abs(before[0]) < 0.9 else (0.0, 1.0, 0.0))
    side = cross(k, before)
    c, s = math.cos(share * angle), math.sin(share * angle)
    x, y, z = (c * p + s * q for p, q in zip(before, side, strict=True))
    return x, y, z


_BY_NAME: Final = {plane.name: plane for plane in PLANES.values()}


class _Carrier(Placing):
    """Writes moves through a frame, from a tool axis on."""

    def __init__(self, settings: Settings, frame: Frame | None, axis: Point) -> None:
        super().__init__(settings)
        self.frame, self.axis = frame or IDENTITY, axis

    def carry(self, move: Move, axis: Point) -> None:
        """The move, at whose end the tool has this axis; rotary axes stay what they are."""
        self.plane, self.last = _BY_NAME[move.plane], self.frame.apply(move.start)
        if move.motion is Motion.DWELL:
            self._add(move, self.last, self.last, None)
            return
        first = len(self.moves)
        self._out_plane(move, axis)
        if move.rotary_deg is not None and axis == UP:
            start = move.rotary_start
            for k in range(first, len(self.moves)):
                self.moves[k] = self.moves[k]._replace(rotary_deg=move.rotary_deg, rotary_start=start)
                start = move.rotary_deg

    def swing(self, cause: Move, axis: Point) -> None:
        """The slides stand, the rotary axes turn the tool to its axis."""
        self.line, self.n, self.plane = cause.line, cause.n, _BY_NAME[cause.plane]
        self._swing(axis, cause)


def carried(moves: Sequence[Move], state: State, settings: Settings, vector: Point | None) -> list[Move]:
    """The moves of a block, whose ends are coordinates before the frame; vector : tool axis at their end, where it changes."""
    out = _Carrier(settings, state.carried, state.axis)
    for move in moves:
        out.carry(move, vector or state.axis)
    state.axis = out.axis
    return [move._replace(end_machine=add(move.end, state.lag)) for move in out.moves]


def pivoted(cause: Move, state: State, settings: Settings, axis: Point) -> tuple[list[Move], list[Finding]]:
    """The tool axis turns while the slides stand; where the tip goes is taken as if the table turned about zero.

    Where words of the rotary axes have turned it before, it does not move again.
    """
    out = _Carrier(settings, state.carried, state.axis)
    out.last = out.frame.apply(state.sim)
    out.swing(cause, axis)
    if state.axis == UP != axis and any(state.rotary.values()):
        out.moves.clear()
    state.axis = out.axis
    state.sim = out.frame.invert(out.last)
    state.machine = add(state.sim, state.lag)
    state.check_sync()
    return [move._replace(end_machine=add(move.end, state.lag)) for move in out.moves], out.findings


def turned_arc(move: Move, state: State, settings: Settings, start: Point, end: Point) -> list[Move]:
    """An arc of G18 or G19 under a work offset that is turned about Z: circles that lean. start, end : program coordinates."""
    c, s = state.turn
    out = _Carrier(settings, Frame(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)), state.to_sim), UP)
    out.carry(move._replace(start=start, end=end, rotation_deg=0.0), UP)
    return [
        item._replace(
            end_machine=add(item.end, state.lag),
            end_program=state.seen(subtract(item.end, state.to_sim)),
            rotation_deg=state.rotation,
        )
        for item in out.moves
    ]
