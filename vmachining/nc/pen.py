"""What moves the tool in dialects with their own words: position, frames, feeds, corners, compensation -> moves.

An interpreter says where to go in program coordinates; the pen keeps what is modal and makes the canonical moves.

1. A segment waits for the next one, because a rounding, a chamfer or an approach may need its tangent (`joined`).
2. Cutter compensation runs in program coordinates (`compensation.py`), so that a mirror changes its side by itself.
3. The frame carries the move into work coordinates. Where the frame tilts the tool, moves have its axis, and arcs
   are `Move.circle`.

Rotary words: in a tilted plane the axis of the plane counts, and the angles do no more than reach it. Elsewhere they
are joints of the machine (`rotary_deg`), under tool centre point control with the tip in work coordinates.
While rotary axes bring the tool into another plane the slides rest: where the tip swings then depends on the machine.
It is taken about the origin of the simulation, on an arc far from the part, and said (W365).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from vmachining.nc.compensation import JOINED_MM, Compensation
from vmachining.nc.findings import NO_TOOL
from vmachining.nc.frames import UP, Frame, arc_length, check_center, is_rounded
from vmachining.nc.model import ASSUMED_RPM, ArcError, Motion, Move, PenError, Point, put
from vmachining.nc.offset_curves import Pair, joined, segment, tangents
from vmachining.nc.placing import Corner, Placing, swung

ASSUMED_TEETH = 2
"""Of a tool that nobody describes."""


class Pen(Placing):
    """The tool of a program that is being executed. Lengths mm, program coordinates unless said otherwise.

    at : programmed position. last, axis : tip and tool axis of the last move, work coordinates. feed : mm/min,
    mm/rev or 1/min by `feed_mode` ("min", "rev", "inverse"). allowance : added to length and radius of the tool.
    """

    def set_frame(self, frame: Frame, *, pivot: bool = False, lean: Point | None = None) -> None:
        """Other program coordinates; the tool stays, or its slides do where the axis of the tool changes.

        pivot : the tip stays on the part although the axis changes (PLANE ... MOVE). lean : tool axis, where it is not
        the Z of the frame.
        """
        if frame == self.frame and lean == self.lean:
            return
        if self.compensation is not None:
            raise PenError("E359", "the coordinate system cannot change under cutter compensation")
        self.flush()
        here = self.frame.apply(self.tip or self.at)
        before, after = self.plane_axis, frame.axis if lean is None else lean
        if before != after:
            self._swing_pivot = pivot
            if not pivot:
                here = swung(before, after, here)
        self.frame, self.lean, self.at, self.tip = frame, lean, frame.invert(here), None

    def compensate(self, side: int) -> None:
        """+1 left, -1 right, 0 off."""
        now = self.compensation.side if self.compensation is not None else 0
        if side == now:
            return
        self.flush()
        if self.compensation is not None:
            if side != 0:
                raise PenError("E357", "compensation changes its side without R0 or G40 between")
            moves, tip = self.compensation.finish()
            self.compensation = None
            for move in moves:
                self._out(move)
            self.tip = tip if tip is not None and math.dist(tip, self.at) > 0.0 else None
            return
        if self.frame.scale == 0.0:
            raise PenError("E361", "cutter compensation where the axes have different scales")
        radius = self.radius() / self.frame.scale
        if radius < 0.0:
            side, radius = -side, -radius
        corner = self.miter, not self.miter
        self.compensation = Compensation(side, radius, self.plane, "next", *corner, short_entry=True)

    def radius(self) -> float:
        """Of the tool in the spindle, with its allowance.

        Raises PenError: E351
        """
        own = self._own_radius()
        if own is None and self.settings.tools is not None:
            raise PenError("E351", f"the tool radius is not known: tool {self.tool} is not in the tool table")
        if own is None:  # as in the Fanuc family
            text = (
                "the tool radius is not known; the programmed contour is taken as the path of the tool centre"
            )
            self.note("W351", text, once=f"radius {self.tool}")
        return (own or 0.0) + self.allowance[1]

    def has_radius(self) -> bool:
        """Whether the radius of the tool in the spindle is known."""
        return self._own_radius() is not None

    def _own_radius(self) -> float | None:
        table = self.settings.tools
        entry = table.get(self.tool) if table is not None else None
        if entry is not None and not math.isnan(entry.diameter_mm):
            return entry.diameter_mm / 2.0
        return self.known_radius.get(self.tool)

    def teeth(self) -> int:
        """Of the tool in the spindle; guessed, and said, where nobody gives tools.

        Raises PenError: E301
        """
        entry = (self.settings.tools or {}).get(self.tool)
        if entry is not None and entry.flutes > 0:
            return entry.flutes
        if self.settings.tools is None:
            what = f"a feed per tooth, and the teeth of tool {self.tool} are not known here: timed with {ASSUMED_TEETH}"
            self.note("W381", what, once="teeth")
            return ASSUMED_TEETH
        raise PenError("E301", f"a feed per tooth: the teeth of tool {self.tool} are not known", "",
                       "give the tool its flutes in the job")  # fmt: skip

    def change_tool(self, number: int) -> None:
        if self.compensation is not None:
            raise PenError("E359", "the tool cannot change while cutter compensation is on")
        table = self.settings.tools
        if number > 0 and table is not None and number not in table:
            self.note("E321", NO_TOOL.format(number))
        self.flush()
        self.tool = number
        self.called.add(number)

    def set_tcp(self, on: bool) -> None:
        if on == self.tcp:
            return
        self.flush()
        if any(self.rotary.values()) and self.vector is None:
            self.unplaced = {0, 1, 2}
        self.tcp = on

    @contextmanager
    def feeding(self, feed: float | None) -> Iterator[None]:
        """Within, another feed in mm/min is in force; None: the same."""
        kept = self.feed, self.feed_mode
        if feed is not None:
            self.feed, self.feed_mode = feed, "min"
        try:
            yield
        finally:
            self.feed, self.feed_mode = kept

    def rise(self, level: float) -> None:
        """In rapid along the axis of the plane, where that is a way."""
        if level != self.at[self.plane.normal]:
            self.go({self.plane.normal: level}, rapid=True)

    def sink(self, level: float, feed: float | None = None) -> None:
        """At a feed along the axis of the plane; feed : mm/min, None: the one in force."""
        with self.feeding(feed):
            self.go({self.plane.normal: level}, rapid=False)

    def go(
        self,
        target: Mapping[int, float],
        *,
        rapid: bool,
        rotary: Mapping[str, float] | None = None,
        vector: Point | None = None,
    ) -> None:
        """Straight to program coordinates; axes that are not named stay. vector : tool axis, program coordinates."""
        self._straight(put(self.at, target), set(target), rapid=rapid, rotary=rotary, vector=vector)

    def go_machine(self, values: Mapping[int, float], *, rapid: bool, word: str) -> None:
        """Straight to machine coordinates: those of the axes named. Where the part lies is what the job says; home else."""
        if self.compensation is not None:
            raise PenError("E359", "machine coordinates under cutter compensation", word)
        axis = self.plane_axis
        shift, home = self.settings.work_offsets.get(540), self.settings.home
        goal = {k: home[k] if shift is None else value - shift[k] for k, value in values.items()}
        slides = put(swung(axis, UP, self.frame.apply(self.tip or self.at)), goal)
        if shift is None and values:
            text = f"{word}: the job does not give the position of the part on the machine: these axes go to home"
            self.note("W366", text, word, once="machine")
        end = self.frame.invert(swung(UP, axis, slides))
        self._straight(end, set(values), rapid=rapid, rotary=None, vector=None)

    def _straight(
        self,
        end: Point,
        named: set[int],
        *,
        rapid: bool,
        rotary: Mapping[str, float] | None,
        vector: Point | None,
    ) -> None:
        moved = dict(rotary or {})
        if moved and not named and rapid and vector is None:
            self.flush()  # reported with the next motion, which knows the plane
            self.rotary.update(moved)
            self._turn_tcp = self.tcp
            return
        if not named and not moved and vector is None:
            return
        if self.unplaced and rapid:
            self.unplaced -= named
            if self.unplaced:
                self.at = end
                self.rotary.update(moved)
                return
        feed = None if rapid else self.feed_for(math.dist(self.at, end) * (self.frame.scale or 1.0))
        move = self._move(Motion.RAPID if rapid else Motion.LINEAR, end, feed)
        if vector is not None:
            move = move._replace(axis_end=vector)
        if moved and vector is None:
            move = move._replace(rotary_deg={**self.rotary, **moved})
        self._segment(move)
        self.at = end
        self.rotary.update(moved)

    def arc(
        self, end: Point, center: Pair, *, ccw: bool, turns: int = 1, word: str = "", checked: bool = True
    ) -> None:
        """Circle or helix in the plane.

        Raises PenError: E304, E308, E301, E352, E361.
        """
        if self.tip is not None:
            what = "the first motion after compensation is an arc"
            raise PenError("E352", what, word, "leave on a straight line")
        if self.frame.scale == 0.0:
            raise PenError("E361", "an arc where the axes have different scales is an ellipse", word)
        a, b, normal = self.plane.first, self.plane.second, self.plane.normal
        start, finish = (self.at[a], self.at[b]), (end[a], end[b])
        try:
            off = check_center(start, finish, center, self.scale != 1.0) if checked else 0.0
        except ArcError as exc:
            exc.word = word
            raise
        if is_rounded(off):
            self.note("W304", f"the radii at start and end differ by {off:.3g} mm", word)
        length = arc_length(start, finish, center, ccw, turns, end[normal] - self.at[normal])
        feed = self.feed_for(length * self.frame.scale)
        move = self._move(Motion.ARC_CCW if ccw else Motion.ARC_CW, end, feed)
        self._segment(move._replace(center=center, turns=turns))
        self.at = end

    def ahead(self, length: float) -> dict[int, float]:
        """Program coordinates of a place that lies this far back along the tool."""
        self.flush()  # it may bring a vector
        if self.vector is None:
            return {2: self.at[2] + length}
        here = self.frame.apply(self.at)
        x, y, z = (p + length * v for p, v in zip(here, self.vector, strict=True))
        return dict(enumerate(self.frame.invert((x, y, z))))

    def tap_feed(self, pitch: float, rpm: float, word: str) -> float:
        """Feed of a tap in mm/min from its pitch in mm; guessed, and said, where the pitch is zero or the spindle stands."""
        if not pitch or not rpm:
            missing = "no pitch" if not pitch else "no spindle speed"
            what = f"tapping with {missing}: timed at {abs(rpm) or ASSUMED_RPM:g} rev/min and a pitch of {abs(pitch) or 1.0:g} mm"
            self.note("W381", what, word, once="tap")
        return (abs(pitch) or 1.0) * (abs(rpm) or ASSUMED_RPM)

    def dwell(self, seconds: float) -> None:
        self.flush()
        move = self._move(Motion.DWELL, self.at, None)._replace(dwell_s=seconds)
        self._compensated(move)

    def end(self) -> None:
        self.flush()
        if self.compensation is not None:
            self.note("W358", "the program ends with cutter compensation on")
            self.compensate(0)

    def feed_for(self, length: float) -> float:
        """mm/min along a path of this length.

        Raises PenError: E301
        """
        if not self.feed:
            raise PenError("E301", "a feed move without feed")
        feed = self.feed
        if self.feed_mode == "rev":
            if self.rpm == 0.0:
                what = f"feed per revolution with the spindle stopped: timed at {ASSUMED_RPM:g} rev/min"
                self.note("W381", what, once="rev")
            feed *= abs(self.rpm) or ASSUMED_RPM
        elif self.feed_mode == "inverse":
            feed = max(feed * length, 0.1)
        if self.rpm == 0.0 and not self._stopped_told:
            self._stopped_told = True
            self.note("W501", "a feed move while the spindle is stopped")
        return feed

    def spindle(self, rpm: float) -> None:
        """Signed speed."""
        if rpm != self.rpm:
            self.flush()
        self.rpm, self._stopped_told = rpm, False

    def set_corner(self, kind: str, size: float, feed: float | None = None, *, soft: bool = False) -> None:
        """A rounding ("round") or chamfer ("chamfer") at the end of the last segment; soft : see `Corner`."""
        if self.held is None or size <= 0.0:
            what = "no corner to round: a rounding lies between two motions of the plane and has a size above zero"
            raise PenError("E109", what)
        self.corner = Corner(kind, size, feed, soft)

    def heading(self) -> Pair | None:
        """Unit tangent in the plane where the last segment ended; None where it went nowhere in the plane."""
        if self.held is None or not self._is_planar(self.held):
            return None
        return tangents(segment(self.held, self.plane))[1]

    def _is_planar(self, move: Move) -> bool:
        """Whether it goes anywhere in the plane."""
        a, b = self.plane.first, self.plane.second
        return (
            move.center is not None
            or math.hypot(move.end[a] - move.start[a], move.end[b] - move.start[b]) > JOINED_MM
        )

    def _segment(self, move: Move) -> None:
        planar = self._is_planar(move)
        if planar and self.approach is not None:
            approach, self.approach = self.approach, None
            approach(tangents(segment(move, self.plane))[0])
            move = move._replace(start=self.at)
        if self.corner is not None and self.corner.soft:
            cuts = planar and move.motion is not Motion.RAPID
            self.corner = self.corner if cuts and self.held and self._is_planar(self.held) else None
        if self.corner is not None:
            if not planar:
                raise PenError("E109", "a rounding or chamfer must lie between two motions of the plane")
            move = self._cornered(move)
        if self.held is not None:
            held, self.held = self.held, None
            self._compensated(held)
        self.held = move

    def _cornered(self, move: Move) -> Move:
        corner, held, self.corner = self.corner, self.held, None
        assert corner is not None and held is not None
        made = joined(held, move, self.plane, corner.kind, corner.size, corner.feed)
        if made is None:
            return move
        first, self.held, rest = made
        self._compensated(first)
        return rest

    def flush(self) -> None:
        """Let the segment that waits go."""
        if self.corner is not None:
            soft, self.corner = self.corner.soft, None
            if not soft:
                raise PenError("E109", "a rounding or chamfer without a motion of the plane after it")
        if self.held is not None:
            held, self.held = self.held, None
            self._compensated(held)

    def _by_edge(self, move: Move) -> Move:
        """A programmed arc under compensation, whose feed holds on the contour where `edge_feed` says so.

        The contour at radius R and the centre of the tool at R' turn together: the centre moves with F R' / R.
        """
        now = self.compensation
        if not self.edge_feed or now is None or move.center is None or move.feed_mm_min is None:
            return move
        radius = math.dist((move.start[now.plane.first], move.start[now.plane.second]), move.center)
        inside = (now.side > 0) == (move.motion is Motion.ARC_CCW)
        centre = radius - now.radius if inside else radius + now.radius
        if self.feed_mode == "inverse" or centre <= JOINED_MM or (self.edge_feed == "inner" and not inside):
            return move
        return move._replace(feed_mm_min=move.feed_mm_min * centre / radius)

    def _compensated(self, move: Move) -> None:
        if self.compensation is None:
            if self.tip is not None and move.motion is not Motion.DWELL:
                move, self.tip = move._replace(start=self.tip), None
            self._out(move)
            return
        if move.axis_end is not None:
            raise PenError("E361", "cutter compensation while the program gives tool axes")
        ours = self._by_edge(move)
        step = self.compensation.accept(ours)
        self.compensation = step.after
        for done in step.moves:
            if ours is not move and done.line == ours.line:  # the arc about its corner has no contour
                done = done._replace(feed_mm_min=move.feed_mm_min)
            self._out(done)
        for code, text in step.warnings:
            self.note(code, text)
