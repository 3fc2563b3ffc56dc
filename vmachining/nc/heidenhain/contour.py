"""Path functions: L, C, CR, CT, CC, LP, CP, CTP, RND, CHF, LN, and the approaches APPR and departures DEP.

APPR to P with the first contour tangent t and the free side n (left for RL): LT comes along t from P - LEN t; LN along
-n from P + LEN n, the tool radius more under compensation; CT on an arc of radius R and angle CCA about P + R n; LCT on
a line from where the tool stands that touches that arc. DEP is the same the other way round and ends compensation where
it ends. Source: HEIDENHAIN TNC 640, user's manual conversational programming (public).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from vmachining.nc.frames import PLANES, Plane, center_from_radius
from vmachining.nc.heidenhain.text import Word
from vmachining.nc.model import ArcError, PenError, Point, put, refused
from vmachining.nc.offset_curves import Pair

if TYPE_CHECKING:
    from vmachining.nc.heidenhain.control import Control

AXES: Final = {"X": 0, "Y": 1, "Z": 2}
_SIZES: Final = {"LT": ("LEN",), "LN": ("LEN",), "CT": ("R", "CCA"), "LCT": ("R",)}
"""Words that each approach and departure needs."""


class Contour:
    """Geometry of path functions; modes and M codes are done by the control before."""

    def __init__(self, control: Control) -> None:
        self.control, self.pen = control, control.pen
        self.pole: Pair | None = None
        self.plane: Plane | None = None
        """Of a pole outside the working plane."""

    # ---- where to ----

    def target(self, words: list[Word]) -> tuple[dict[int, float], dict[str, float]]:
        """Program coordinates by axis, mm, and rotary degrees."""
        pen, q = self.pen, self.control.q
        out: dict[int, float] = {}
        rotary: dict[str, float] = {}
        for word in words:
            if word.key in AXES:
                axis = AXES[word.key]
                if axis in out:
                    raise PenError("E202", f"{word.key} is given twice", word.text)
                value = q.number(word.value) * pen.scale
                out[axis] = value + (pen.at[axis] if word.incremental else 0.0)
            elif word.key in "ABC":
                letter = word.key.lower()
                if self.control.reached(word.value):
                    continue
                value = q.number(word.value)
                here = pen.rotary.get(letter, 0.0)
                if self.control.shortest and not word.incremental:
                    value = here + (value - here + 180.0) % 360.0 - 180.0
                rotary[letter] = value + (here if word.incremental else 0.0)
            elif word.key in "UVW":
                raise PenError("E209", f"axis {word.key} is not one of this machine", word.text)
        return out, rotary

    def polar(self, words: list[Word]) -> Point:
        """PR, PA from the pole, and the axis along the tool."""
        pen, q = self.pen, self.control.q
        if self.pole is None:
            raise PenError("E362", "polar coordinates without a pole", "", "program CC before")
        plane = self.plane or pen.plane
        a, b, normal = plane.first, plane.second, plane.normal
        x, y = pen.at[a] - self.pole[0], pen.at[b] - self.pole[1]
        radius, angle = math.hypot(x, y), math.degrees(math.atan2(y, x))
        known = radius > 1e-9
        end = list(pen.at)
        for word in words:
            if word.key == "PR":
                value = q.number(word.value) * pen.scale
                radius = value + (radius if word.incremental else 0.0)
            elif word.key == "PA":
                if word.incremental and not known:
                    raise PenError("E362", "an angle step while the tool is on the pole", word.text)
                angle = q.number(word.value) + (angle if word.incremental else 0.0)
            elif word.key in AXES:
                axis = AXES[word.key]
                if axis != normal:
                    raise PenError("E207", f"{word.key} in a polar block", word.text)
                end[axis] = q.number(word.value) * pen.scale + (end[axis] if word.incremental else 0.0)
        end[a] = self.pole[0] + radius * math.cos(math.radians(angle))
        end[b] = self.pole[1] + radius * math.sin(math.radians(angle))
        return end[0], end[1], end[2]

    def set_pole(self, words: list[Word]) -> None:
        """CC: centre of circles and pole; CC alone is where the tool stands."""
        pen = self.pen
        given, _ = self.target(words)
        plane = self.plane
        if plane is not None and (len(given) != 1 or set(given) - self._axes(plane)):
            plane = None
        if set(given) - self._axes(plane or pen.plane):
            plane = next((p for p in PLANES.values() if set(given) == self._axes(p)), None)
            if plane is None:
                what = "a circle centre outside the working plane"
                raise PenError("E361", what, "CC", "post the arc as short lines")
        now = plane or pen.plane
        old = pen.at[now.first], pen.at[now.second]
        if given and self.pole is not None and plane is self.plane:
            old = self.pole
        self.plane = plane
        self.pole = given.get(now.first, old[0]), given.get(now.second, old[1])

    @staticmethod
    def _axes(plane: Plane) -> set[int]:
        return {plane.first, plane.second}

    def _arc(self, end: Point, *, ccw: bool, turns: int = 1, word: str) -> None:
        """About the pole, in its own plane."""
        pen = self.pen
        assert self.pole is not None
        if self.plane is None:
            pen.arc(end, self.pole, ccw=ccw, turns=turns, word=word)
            return
        if pen.compensation is not None:
            raise PenError("E361", "an arc outside the working plane under cutter compensation", word)
        pen.flush()
        kept, pen.plane = pen.plane, self.plane
        try:
            pen.arc(end, self.pole, ccw=ccw, turns=turns, word=word)
            pen.flush()
        finally:
            pen.plane = kept

    # ---- motions ----

    def vector(self, words: list[Word], *, rapid: bool) -> None:
        """LN: TX TY TZ is the tool axis; NX NY NZ only matters to allowances of the tool."""
        q = self.control.q
        given, rotary = self.target([w for w in words if w.key not in ("NX", "NY", "NZ", "TX", "TY", "TZ")])
        parts = {w.key: q.number(w.value) for w in words if w.key in ("TX", "TY", "TZ", "NX", "NY", "NZ")}
        if self.pen.allowance != (0.0, 0.0):
            raise refused("LN with DL or DR is compensation in space, which", "LN")
        axis = None
        if any(k.startswith("T") for k in parts):
            if not {"TX", "TY", "TZ"} <= set(parts):
                raise PenError("E109", "LN needs all of TX TY TZ", "LN")
            if not self.pen.tcp:
                raise PenError("E208", "LN with a tool axis needs M128", "LN", "program M128 before")
            axis = parts["TX"], parts["TY"], parts["TZ"]
        self.pen.go(given, rapid=rapid, rotary=rotary or None, vector=axis)

    def _ccw(self, words: list[Word]) -> bool:
        sign = next((w.value for w in words if w.key == "DR"), self.control.direction)
        if sign not in ("+", "-"):
            raise PenError("E109", "a circle without DR+ or DR-", "DR")
        self.control.direction = sign
        return sign == "+"

    def circle(self, words: list[Word]) -> None:
        """C: about the pole."""
        if self.pole is None:
            raise PenError("E302", "C without a centre", "C", "program CC before")
        given, rotary = self.target(words)
        if rotary:
            raise PenError("E361", "an arc that turns rotary axes", "C")
        self._arc(put(self.pen.at, given), ccw=self._ccw(words), word="C")

    def circle_radius(self, words: list[Word]) -> None:
        """CR: R above zero is the shorter arc."""
        pen = self.pen
        radius = next((self.control.q.number(w.value) for w in words if w.key == "R"), None)
        if radius is None:
            raise PenError("E302", "CR without a radius", "CR")
        given, _ = self.target(words)
        end, ccw = put(self.pen.at, given), self._ccw(words)
        a, b = pen.plane.first, pen.plane.second
        try:
            center = center_from_radius((pen.at[a], pen.at[b]), (end[a], end[b]), radius * pen.scale, ccw)
        except ArcError as exc:
            exc.word = "CR"
            raise
        pen.arc(end, center, ccw=ccw, word="CR", checked=False)

    def circle_polar(self, words: list[Word]) -> None:
        """CP: about the pole by PA, a helix with IPA and the axis along the tool."""
        end = self.polar([w for w in words if w.key not in ("PR",)])
        assert self.pole is not None
        step = next((self.control.q.number(w.value) for w in words if w.key == "PA" and w.incremental), None)
        ccw = self._ccw(words) if step is None or any(w.key == "DR" for w in words) else step >= 0.0
        self.control.direction = "+" if ccw else "-"
        turns = 1
        if step is not None:
            swept = step if ccw else -step
            if -swept in (180.0, 360.0):  # unlike signs lead to the same place in the sense of DR
                swept = -swept
            if swept <= 0.0:
                raise PenError("E309", f"CP: IPA{step:+g} against DR{self.control.direction}", "CP")
            turns = max(1, math.ceil(swept / 360.0 - 1e-9))
            if turns > 100_000:
                raise PenError("E309", f"CP: {turns} turns", "CP")
        self._arc(end, ccw=ccw, turns=turns, word="CP")

    def tangential(self, words: list[Word], *, polar: bool) -> None:
        """CT, CTP: an arc that continues along the last tangent."""
        pen = self.pen
        t = pen.heading()
        if t is None:
            raise PenError("E302", "CT has no motion before it that gives a tangent", "CT")
        end = self.polar(words) if polar else put(self.pen.at, self.target(words)[0])
        a, b = pen.plane.first, pen.plane.second
        made = _tangent_arc((pen.at[a], pen.at[b]), t, (end[a], end[b]))
        if made is None:
            pen.go(dict(enumerate(end)), rapid=False)
            return
        pen.arc(end, made[0], ccw=made[1], word="CT", checked=False)

    # ---- approach and departure ----

    def approach(self, kind: str, words: list[Word], side: int) -> None:
        """APPR kind: done when the next segment of the plane tells its tangent."""
        pen = self.pen
        polar = kind.startswith("P")
        kind = kind.removeprefix("P")
        end = self.polar(words) if polar else put(self.pen.at, self.target(words)[0])
        length, radius, angle = self._sizes("APPR", kind, words)
        a, b, normal = pen.plane.first, pen.plane.second, pen.plane.normal
        goal, came = (end[a], end[b]), (pen.at[a], pen.at[b])
        free = side if side else (pen.compensation.side if pen.compensation else 1)
        line, text, n = pen.line, pen.text, pen.n
        rho = pen.radius() if side else 0.0
        feed = pen.feed, pen.feed_mode
        before = pen.at
        height = end[normal]

        def place(p: Pair) -> dict[int, float]:
            return {a: p[0], b: p[1], normal: height}

        def draw(t: Pair) -> None:
            kept = pen.line, pen.text, pen.n, pen.feed, pen.feed_mode
            pen.line, pen.text, pen.n, (pen.feed, pen.feed_mode) = line, text, n, feed
            pen.at = before
            out = -free * t[1], free * t[0]
            try:
                if kind == "LT":
                    mid = goal[0] - length * t[0], goal[1] - length * t[1]
                    pen.go(place(mid), rapid=False)
                    pen.go(place(goal), rapid=False)
                elif kind == "LN":
                    reach = length + rho
                    mid = goal[0] + reach * out[0], goal[1] + reach * out[1]
                    if side:  # along -n to the offset start of the contour
                        pen.compensate(0)
                        pen.go(place(mid), rapid=False)
                        pen.compensate(side)
                    else:
                        pen.go(place(mid), rapid=False)
                    pen.go(place(goal), rapid=False)
                else:
                    start, center, ccw = self._beside(kind, goal, t, out, (radius, angle, rho), came, -1)
                    pen.go(place(start), rapid=False)
                    if math.dist(start, goal) > 1e-9:
                        pen.arc(put(pen.at, place(goal)), center, ccw=ccw, word="APPR", checked=False)
            finally:
                pen.line, pen.text, pen.n, pen.feed, pen.feed_mode = kept

        pen.compensate(side)
        pen.at = end
        pen.approach = draw

    def _beside(
        self,
        kind: str,
        here: Pair,
        t: Pair,
        out: Pair,
        sizes: tuple[float, float, float],
        other: Pair,
        way: int,
    ) -> tuple[Pair, Pair, bool]:
        """The arc that touches the contour `here`: its other end, centre and sense.

        CT: over an angle; LCT: where a line to `other` touches it. way : +1 after the contour, -1 before it.
        """
        radius, angle, rho = sizes
        center = here[0] + radius * out[0], here[1] + radius * out[1]
        ccw = (t[0] * out[1] - t[1] * out[0]) * radius > 0.0
        if kind == "CT":
            arm = here[0] - center[0], here[1] - center[1]
            turn = math.radians(angle) * (way if ccw else -way)
            c, s = math.cos(turn), math.sin(turn)
            away = center[0] + c * arm[0] - s * arm[1], center[1] + s * arm[0] + c * arm[1]
            return away, center, ccw
        inner = abs(radius) - math.copysign(rho, radius)
        if inner <= 1e-9 and way < 0:
            raise PenError("E354", f"the approach radius {radius:g} mm is not greater than that of the tool")
        touch = _touch(other, center, inner, ccw == (way < 0)) if inner > 1e-9 else None
        if touch is None and way < 0:
            raise PenError("E305", "the tool is inside the approach arc")
        if touch is None:
            what = "DEP LCT: the end lies inside the arc, or the tool does not fit into it"
            raise PenError("E305", what, "DEP")
        share = abs(radius) / inner
        away = center[0] + share * (touch[0] - center[0]), center[1] + share * (touch[1] - center[1])
        return away, center, ccw

    def depart(self, kind: str, words: list[Word]) -> None:
        """DEP kind: leaves the last contour element; compensation ends behind it."""
        pen = self.pen
        t = pen.heading()
        if t is None:
            raise PenError("E352", "DEP has no contour element before it that gives a tangent", "DEP")
        polar = kind.startswith("P") and kind != "PLT"
        kind = kind.removeprefix("P")
        length, radius, angle = self._sizes("DEP", kind, words)
        a, b = pen.plane.first, pen.plane.second
        side = pen.compensation.side if pen.compensation else 0
        rho = pen.compensation.radius if pen.compensation else 0.0
        free = side or 1
        out = -free * t[1], free * t[0]
        here = pen.at[a], pen.at[b]

        def place(p: Pair) -> dict[int, float]:
            return {a: p[0], b: p[1]}

        if kind == "LT":
            pen.go(place((here[0] + length * t[0], here[1] + length * t[1])), rapid=False)
            pen.compensate(0)
        elif kind == "LN":
            pen.compensate(0)
            reach = length + rho
            pen.go(place((here[0] + reach * out[0], here[1] + reach * out[1])), rapid=False)
        else:
            end = pen.at
            if kind != "CT":
                end = self.polar(words) if polar else put(pen.at, self.target(words)[0])
            away, center, ccw = self._beside(kind, here, t, out, (radius, angle, rho), (end[a], end[b]), 1)
            pen.arc(put(pen.at, place(away)), center, ccw=ccw, word="DEP", checked=False)
            pen.compensate(0)
            if kind != "CT":
                pen.go(dict(enumerate(end)), rapid=False)
        pen.flush()
        if pen.tip is not None:  # compensation has left it beside the programmed point: that is its place now
            pen.at, pen.tip = pen.tip, None

    def _sizes(self, head: str, kind: str, words: list[Word]) -> tuple[float, float, float]:
        """LEN, R, CCA. Raises PenError: One that the kind needs is missing; a radius or an angle is zero."""
        q, k = self.control.q, self.pen.scale
        given = {w.key: q.number(w.value) for w in words if w.key in ("LEN", "R", "CCA")}
        for key in _SIZES[kind]:
            if key not in given or (given[key] == 0.0 and key != "LEN"):
                raise PenError("E109", f"{head} {kind} needs {key}", head, f"write {key}")
        length, radius, angle = (given.get(key, 0.0) for key in ("LEN", "R", "CCA"))
        if length < 0.0 or not 0.0 <= angle <= 360.0:
            raise PenError("E109", "LEN is not negative, CCA lies between 0 and 360 degrees")
        return length * k, radius * k, angle


def _tangent_arc(start: Pair, t: Pair, end: Pair) -> tuple[Pair, bool] | None:
    """Centre and sense of the arc from a point along a tangent to another point; None for a straight line."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    aside = t[0] * dy - t[1] * dx
    square = dx * dx + dy * dy
    if square < 1e-18:
        raise PenError("E306", "CT ends where it starts", "CT")
    if abs(aside) <= 1e-9 * math.sqrt(square):
        if t[0] * dx + t[1] * dy < 0.0:
            raise PenError("E305", "CT ends straight ahead of its start", "CT")
        return None
    radius = square / (2.0 * aside)
    return (start[0] - radius * t[1], start[1] + radius * t[0]), radius > 0.0


def _touch(point: Pair, center: Pair, radius: float, ccw: bool) -> Pair | None:
    """Where a line from outside touches a circle that is then run in that sense."""
    dx, dy = point[0] - center[0], point[1] - center[1]
    distance = math.hypot(dx, dy)
    if distance <= radius:
        return None
    open_angle = math.acos(radius / distance)
    angle = math.atan2(dy, dx) + (open_angle if ccw else -open_angle)
    return center[0] + radius * math.cos(angle), center[1] + radius * math.sin(angle)
