"""Motions of a cutter location file: straight, on arcs, into holes; coordinate systems, and what is said of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final, NamedTuple

from vmachining.nc.apt_cycles import HoleCycle
from vmachining.nc.apt_records import Record
from vmachining.nc.arcs import PLANES, check_center, is_rounded
from vmachining.nc.checks import finding
from vmachining.nc.frames import UP, cross, dot
from vmachining.nc.model import Finding, Motion, Move, Point
from vmachining.nc.poses import AXIS_TOLERANCE, unit_axis
from vmachining.nc.refusal import ArcError, RecordError
from vmachining.nc.settings import Settings
from vmachining.nc.vectors import add, subtract

CHORD_MM: Final = 5e-4
"""Of a circle that lies in no main plane: an eighth of the finest tolerance that CAM systems cut with."""

FEED_UNITS: Final = {
    "MMPM": (1.0, False), "IPM": (25.4, False), "MMPR": (1.0, True), "IPR": (25.4, True),
    "PERMIN": (0.0, False), "PERREV": (0.0, True),
}  # fmt: skip
"""mm per unit (0: the unit of the file), and whether per revolution."""


class Circle(NamedTuple):
    """Of the next GOTO: counter-clockwise about the axis; radius : as the record says it, or None."""

    center: Point
    axis: Point
    radius: float | None


class Frame(NamedTuple):
    """A coordinate system: origin and axes, in that of the file."""

    origin: Point
    x: Point
    y: Point
    z: Point

    def out(self, vector: Point) -> Point:
        """A vector of this system, in that of the file."""
        return tuple(  # type: ignore[return-value]
            vector[0] * a + vector[1] * b + vector[2] * c
            for a, b, c in zip(self.x, self.y, self.z, strict=True)
        )

    def into(self, vector: Point) -> Point:
        """A vector of the file, in this system."""
        return dot(vector, self.x), dot(vector, self.y), dot(vector, self.z)


def along(point: Point, axis: Point, height: float) -> Point:
    """point + height axis"""
    return point[0] + axis[0] * height, point[1] + axis[1] * height, point[2] + axis[2] * height


class AptMotions:
    """State of a cutter location file, and the motions that change it."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.moves: list[Move] = []
        self.found: list[Finding] = []
        self.ended = self.path_ended = False
        self.tip, self.axis = settings.home, UP
        self.unit, self.multax, self.rapid = 1.0, False, False
        self.feed: float | None = None
        self.per_turn = False
        self.rpm, self.speed, self.tool = 0.0, 0.0, 0
        self.circle: Circle | None = None
        self.heading: Point | None = None
        self.cycle: HoleCycle | None = None
        self.level: float | None = None
        self.said: set[str] = set()
        self.names: dict[str, int] = {}
        self.called = ""
        self.native = False
        self.first: Frame | None = None
        self.frame: Frame | None = None
        self.local = False

    def note(self, code: str, line: int, message: str, word: str = "", hint: str = "") -> None:
        """Add a finding."""
        self.found.append(finding(code, line, None, message, word, hint=hint))

    def once(self, code: str, line: int, message: str, word: str = "") -> None:
        """Add a finding that is said once."""
        if message not in self.said:
            self.said.add(message)
            self.note(code, line, message, word)

    def _enter(self, record: Record, origin: Point, x: Point, y: Point) -> None:
        x, long_x = unit_axis(x)
        y, long_y = unit_axis(y)
        if max(long_x, long_y, abs(dot(x, y))) > 1e-4:
            raise RecordError("E109", f"{record.word}: its axes are not perpendicular unit vectors")
        z = unit_axis(cross(x, y))[0]
        frame = Frame(
            (origin[0] * self.unit, origin[1] * self.unit, origin[2] * self.unit),
            x,
            unit_axis(cross(z, x))[0],
            z,
        )
        if self.local:
            self.first = self.first or frame
            self.frame = None if frame == self.first else frame
            if self.frame is not None:
                what = "another coordinate system: its points are turned into that of the first operation"
                self.once("I213", record.line, what, record.word)
        self.axis = self._vector(UP) if self.local else z

    def _point(self, numbers: Sequence[float]) -> Point:
        """A point of the file in the coordinate system of the job, mm."""
        point = numbers[0] * self.unit, numbers[1] * self.unit, numbers[2] * self.unit
        if self.frame is None or self.first is None:
            return point
        return self.first.into(subtract(add(self.frame.out(point), self.frame.origin), self.first.origin))

    def _vector(self, vector: Point) -> Point:
        if self.frame is None or self.first is None:
            return vector
        return self.first.into(self.frame.out(vector))

    def _unit(self, record: Record, numbers: list[float]) -> Point:
        axis, off = unit_axis((numbers[0], numbers[1], numbers[2]))
        if axis == (0.0, 0.0, 0.0):
            raise RecordError("E363", "the tool axis has no length")
        if off > AXIS_TOLERANCE:
            self.note(
                "W363", record.line, f"the tool axis differs from unit length by {off:.3g}, it is normalised"
            )
        if not (self.multax or self.native) and max(abs(axis[0]), abs(axis[1])) > AXIS_TOLERANCE:
            self.once("W364", record.line, "a tilted tool axis without MULTAX")
        return self._vector(axis)

    def _go(self, record: Record, tip: Point, axis: Point) -> None:
        circle, rapid = self.circle, self.rapid
        self.circle, self.rapid = None, False
        if dot(axis, self.axis) < -1.0 + 1e-12:
            raise RecordError("E364", "the tool axis is reversed: no great circle is the shortest")
        if rapid and circle is not None:
            raise RecordError("E109", "RAPID and a circle for one motion: rapids go straight")
        if rapid:
            self._emit(record.line, Motion.RAPID, tip, axis, None)
        elif circle is None:
            self._emit(record.line, Motion.LINEAR, tip, axis, self._feed())
        else:
            self._arc(record, circle, tip, axis, self._feed())

    def _feed(self) -> float:
        feed = self.feed
        if feed is not None and self.per_turn:
            feed = feed * abs(self.rpm) or None
        if feed is None:
            raise RecordError("E301", "a feed move without feed, or per revolution with the spindle stopped")
        return feed

    def _arc(self, record: Record, circle: Circle, tip: Point, axis: Point, feed: float) -> None:
        normal = next((a for a in range(3) if abs(abs(circle.axis[a]) - 1.0) < AXIS_TOLERANCE), None)
        if normal is None:
            self._chords(record, circle, tip, axis, feed)
            return
        plane = PLANES[{2: 170, 1: 180, 0: 190}[normal]]
        a, b = plane.first, plane.second
        center = circle.center[a], circle.center[b]
        start = self.tip[a], self.tip[b]
        self._check_radii(record, start, (tip[a], tip[b]), center, circle.radius)
        motion = Motion.ARC_CCW if circle.axis[normal] > 0.0 else Motion.ARC_CW
        self._emit(record.line, motion, tip, axis, feed, plane=plane.name, center=center)

    def _check_radii(
        self, record: Record, start: tuple[float, float], end: tuple[float, float], center: tuple[float, float],
        radius: float | None,
    ) -> None:  # fmt: skip
        inch = self.unit != 1.0
        try:
            off = check_center(start, end, center, inch)
            if radius is not None:
                check_center(start, (center[0] + radius, center[1]), center, inch)  # the r of the record
        except ArcError as exc:
            raise RecordError(exc.code, str(exc)) from None
        if is_rounded(off):
            self.note("W304", record.line, f"the radii at start and end differ by {off:.3g} mm")

    def _chords(self, record: Record, circle: Circle, tip: Point, axis: Point, feed: float) -> None:
        """An arc in no main plane, as lines on it."""
        n, start, stop = circle.axis, subtract(self.tip, circle.center), subtract(tip, circle.center)
        rise, top = dot(start, n), dot(stop, n)
        u, v = along(start, n, -rise), along(stop, n, -top)
        r, end_r = math.hypot(*u), math.hypot(*v)
        self._check_radii(record, (r, 0.0), (end_r, 0.0), (0.0, 0.0), circle.radius)
        side = cross(n, u)
        sweep = math.atan2(dot(v, side) / r, dot(v, u) / r) % math.tau
        sweep = math.tau if math.dist(self.tip, tip) < 1e-9 or sweep < 1e-9 else sweep
        count = max(2, math.ceil(sweep / (2.0 * math.acos(max(0.0, 1.0 - CHORD_MM / r)))))
        what = f"an arc about a tilted axis is read as lines on it, within {CHORD_MM:g} mm"
        self.once("I361", record.line, what, record.word)
        begin = self.axis
        for k in range(1, count + 1):
            t = k / count
            c, s = math.cos(sweep * t), math.sin(sweep * t)
            scale = (r + (end_r - r) * t) / r
            place = [
                circle.center[i] + n[i] * (rise + (top - rise) * t) + scale * (c * u[i] + s * side[i])
                for i in range(3)
            ]
            point = tip if k == count else (place[0], place[1], place[2])
            mixed = tuple(p + (q - p) * t for p, q in zip(begin, axis, strict=True))
            now = axis if k == count or begin == axis else unit_axis((mixed[0], mixed[1], mixed[2]))[0]
            self._emit(record.line, Motion.LINEAR, point, now, feed)

    def _hole(self, record: Record, cycle: HoleCycle, top: Point, axis: Point) -> None:
        """One hole whose top is the point of the GOTO."""
        if cycle.feed is not None:
            unit, self.per_turn = FEED_UNITS[cycle.feed[1]]
            self.feed = cycle.feed[0] * (unit or self.unit)
        feed, line = self._feed(), record.line
        self.rapid, self.circle = False, None
        if dot(axis, self.axis) < 1.0 - 1e-9:
            raise RecordError(
                "E208", "the tool axis turns inside a cycle", "end the cycle before the tool tilts"
            )
        here = dot(subtract(self.tip, top), axis)
        began = dot(self.tip, axis)
        if self.level is None:
            self.level = began
        if here < cycle.clear:
            self._emit(line, Motion.RAPID, along(self.tip, axis, cycle.clear - here), axis, None)
            here = cycle.clear
        over = along(top, axis, here)
        if math.dist(over, self.tip) > 0.0:
            self._emit(line, Motion.RAPID, over, axis, None)
        if here > cycle.clear:
            self._emit(line, Motion.RAPID, along(top, axis, cycle.clear), axis, None)
        for step in cycle.steps(self.settings.peck_clearance_mm):
            motion = Motion.LINEAR if step.feeds else Motion.RAPID
            if cycle.kind == "TAP" and step.height == cycle.clear:
                self.rpm = -self.rpm
            self._emit(line, motion, along(top, axis, step.height), axis, feed if step.feeds else None)
            if step.dwell:
                self._emit(line, Motion.DWELL, self.tip, axis, None, dwell=step.dwell)
        if cycle.kind == "TAP":
            self.rpm = -self.rpm
        back = self.level - dot(top, axis) if cycle.back is None else cycle.back
        height = dot(subtract(self.tip, top), axis)
        if max(back, cycle.clear) > height:
            self._emit(line, Motion.RAPID, along(top, axis, max(back, cycle.clear)), axis, None)

    def _emit(
        self,
        line: int,
        motion: Motion,
        tip: Point,
        axis: Point,
        feed: float | None,
        *,
        plane: str = "xy",
        center: tuple[float, float] | None = None,
        dwell: float = 0.0,
    ) -> None:
        tilted = self.multax or axis != UP or self.axis != UP
        turns = 1 if center is not None else 0
        self.moves.append(
            Move(line, None, motion, self.tip, tip, plane, center, turns, feed, self.tool, self.rpm, dwell, tip, tip,
                 self.axis if tilted else None, axis if tilted else None)
        )  # fmt: skip
        self.tip, self.axis = tip, axis
