"""The motion of a Sinumerik block: lines, arcs, poles, corners, tool axes."""

from __future__ import annotations

import math
import re
from typing import Final

from vmachining.nc.frames import center_from_radius
from vmachining.nc.model import ArcError, PenError, Point, put, refused
from vmachining.nc.offset_curves import Pair
from vmachining.nc.sinumerik.modes import Modes
from vmachining.nc.sinumerik.text import AXES, ROTARY, Word

_VALUE: Final = re.compile(r"(AC|IC|DC|ACP|ACN|CAC|CIC)[ ]*\((.*)\)$")


class Control(Modes):
    """The machine of a Sinumerik program."""

    def _fixed_point(self, found: list[Word], reference: bool) -> None:
        """G74 X1=0, G75 Z0: axes of the machine go to a point that only its data tell."""
        names = {re.sub(r"\d+$", "", w.name) for w in found if w.kind in ("word", "set")}
        target = {AXES[name]: 0.0 for name in names if name in AXES}
        self.pen.go_machine(target, rapid=True, word="G74" if reference else "G75")
        if rotary := {name.lower(): 0.0 for name in names if name in ROTARY}:
            self.pen.go({}, rapid=True, rotary=rotary)

    def _coordinates(
        self, found: list[Word], *, idle: bool = False
    ) -> tuple[dict[int, float], dict[str, float]]:
        pen = self.pen
        out: dict[int, float] = {}
        rotary: dict[str, float] = {}
        for word in found:
            own = word.name in (*AXES, *ROTARY) and word.name not in self.variables
            if not own or word.kind not in ("word", "set"):
                continue
            text, how = word.value, ""
            if (hit := _VALUE.fullmatch(text)) is not None:
                how, text = hit[1], hit[2]
            try:
                value = self.number(text, word.text)
            except PenError:
                if not idle or word.name not in AXES:
                    raise
                value = 0.0
            step = how in ("IC", "CIC") or (not how and not self.absolute)
            if word.name in AXES:
                axis = AXES[word.name]
                if axis in out:
                    raise PenError("E202", f"{word.name} is given twice", word.text)
                k = pen.scale * (self.half(step=step) if axis == 0 else 1.0)
                out[axis] = value * k + (pen.at[axis] if step else 0.0)
            else:
                letter = word.name.lower()
                here = pen.rotary.get(letter, 0.0)
                if how == "DC":
                    value = here + (value - here + 180.0) % 360.0 - 180.0
                elif how == "ACP":
                    value = here + (value - here) % 360.0
                elif how == "ACN":
                    value = here - (here - value) % 360.0
                rotary[letter] = value + (here if step else 0.0)
        return out, rotary

    def _get(self, found: list[Word], name: str) -> float | None:
        word = next((w for w in found if w.name == name and w.kind in ("word", "set")), None)
        if word is None:
            return None
        hit = _VALUE.fullmatch(word.value)
        return self.number(word.value if hit is None else hit[2], word.text)

    def _move(self, gs: list[float], found: list[Word]) -> None:
        pen = self.pen
        if 4.0 in gs:
            self._dwell(found)
            return
        keys = {w.name for w in found if w.kind == "key"}
        if {74.0, 75.0} & set(gs):
            self._fixed_point(found, 74.0 in gs)
            return
        # without a place of the part on the machine these axes go to home, whatever their value
        idle = ("SUPA" in keys or 53.0 in gs or 153.0 in gs) and 540 not in self.settings.work_offsets
        target, rotary = self._coordinates(found, idle=idle)
        for code, side in ((40.0, 0), (41.0, 1), (42.0, -1)):
            if code in gs:
                pen.compensate(side)
        if {110.0, 111.0, 112.0} & set(gs):
            self._pole(gs, found)
            return
        polar = self._polar(found)
        if polar is not None:
            target.update(polar)
        self._by_angle(found, target)
        vector = self._vector(found)
        if "SUPA" in keys or 53.0 in gs or 153.0 in gs:
            if target or rotary:
                word = "SUPA" if "SUPA" in keys else "G53" if 53.0 in gs else "G153"
                if target:
                    pen.go_machine(target, rapid=self.motion in (None, 0.0), word=word)
                if rotary:
                    pen.go({}, rapid=self.motion in (None, 0.0), rotary=rotary)
            return
        centred = any(w.name in ("I", "J", "K", "CR", "AR", "AP", "RP") for w in found)
        if not (target or rotary or vector is not None or (centred and self.motion in (2.0, 3.0))):
            return
        if self.work == 500.0 and target:
            if self.first_work is not None:
                what = f"motions under G500 after G{self.first_work:g}: the position of its zero is not given"
                raise PenError("E368", what, "G500")
            self.basic_moved = True
        if self.on_face and rotary:
            raise PenError("E208", "a rotary word under TRANSMIT", "TRANSMIT", "end it by TRAFOOF before")
        self.at_radius(target.get(0, pen.at[0]))
        motion = self.motion
        if motion is None:
            motion = 0.0  # after power-on G1 or G0 by machine data: said
            pen.note("W371", "a motion before any of G0 to G3: taken as rapid", once="motion")
        if "CIP" in keys or "CT" in keys:
            self._special(keys, found, target)
        elif motion in (0.0, 1.0):
            self._straight(target, rotary, vector, rapid=motion == 0.0)
        elif motion in (33.0, 331.0, 332.0):
            self._thread(found, target)
        else:
            if rotary:
                raise PenError("E361", "an arc that turns rotary axes", f"G{motion:g}")
            self._arc(found, target, ccw=motion == 3.0)
        self._corner(found)
        if target and self.modal is not None:
            self._modal()

    def _straight(
        self, target: dict[int, float], rotary: dict[str, float], vector: Point | None, *, rapid: bool
    ) -> None:
        pen = self.pen
        turns = rotary != {k: pen.rotary.get(k) for k in rotary}
        if self.great_circle and pen.tcp and turns and not rapid:
            raise PenError("E208", "rotary words with ORIVECT", "ORIVECT", "post it with ORIAXES")
        pen.go(target, rapid=rapid, rotary=rotary or None, vector=vector)

    def _vector(self, found: list[Word]) -> Point | None:
        parts = {name: self._get(found, name) for name in ("A3", "B3", "C3")}
        if any(w.name in ("A2", "B2", "C2", "A4", "B4", "C4", "A5", "LEAD", "TILT", "THETA") for w in found):
            raise refused("orientation by A2, A4, A5, LEAD or TILT", "A2", "post it as A3 B3 C3")
        if all(v is None for v in parts.values()):
            return None
        if not self.pen.tcp:
            raise PenError("E208", "A3 B3 C3 without TRAORI", "A3")
        if self.by_axes:
            self.pen.note("W375", "A3 B3 C3 with ORIAXES or ORIMKS: the path between two tool axes depends on the kinematics, "
                          "the great circle is used", "A3", once="by_axes")  # fmt: skip
        return parts["A3"] or 0.0, parts["B3"] or 0.0, parts["C3"] or 0.0

    def _dwell(self, found: list[Word]) -> None:
        pen = self.pen
        seconds, turns = self._get(found, "F"), self._get(found, "S")
        if seconds is None and turns is None:
            raise PenError("E335", "G4 without F or S", "G4")
        if seconds is None:
            speed = abs(pen.rpm) or self.speed
            seconds = 60.0 * (turns or 0.0) / speed if speed else 0.0
        if seconds < 0.0:
            raise PenError("E335", f"a dwell of {seconds:g} s", "G4")
        pen.dwell(seconds)

    def _pole(self, gs: list[float], found: list[Word]) -> None:
        pen = self.pen
        a, b, k = pen.plane.first, pen.plane.second, pen.scale
        x, y = (self._get(found, "XYZ"[axis]) or 0.0 for axis in (a, b))
        base = (pen.at[a], pen.at[b]) if 110.0 in gs else self.pole if 112.0 in gs else (0.0, 0.0)
        self.pole = base[0] + x * k, base[1] + y * k

    def _polar(self, found: list[Word]) -> dict[int, float] | None:
        angle, radius = self._get(found, "AP"), self._get(found, "RP")
        if angle is None and radius is None:
            return None
        pen = self.pen
        a, b = pen.plane.first, pen.plane.second
        x, y = pen.at[a] - self.pole[0], pen.at[b] - self.pole[1]
        theta = math.atan2(y, x)
        if angle is not None:
            step = any(w.name == "AP" and w.value.startswith("IC") for w in found)
            theta = math.radians(angle) + (theta if step else 0.0)
        distance = math.hypot(x, y) if radius is None else radius * pen.scale
        return {a: self.pole[0] + distance * math.cos(theta), b: self.pole[1] + distance * math.sin(theta)}

    def _by_angle(self, found: list[Word], target: dict[int, float]) -> None:
        """ANG=: the other coordinate of a straight line whose end gives one of the plane."""
        angle, pen = self._get(found, "ANG"), self.pen
        if angle is None:
            return
        a, b = pen.plane.first, pen.plane.second
        given = [axis for axis in (a, b) if axis in target]
        if self.motion not in (0.0, 1.0) or len(given) != 1:
            raise PenError("E208", "ANG= needs exactly one end coordinate of a straight line", "ANG",
                           "give the end of the line")  # fmt: skip
        (one,) = given
        other = b if one == a else a
        way = {a: math.cos(math.radians(angle)), b: math.sin(math.radians(angle))}
        step = target[one] - pen.at[one]
        if abs(way[one]) < 1e-9 or step * way[one] < 0.0:
            raise PenError("E309", f"no line at ANG={angle:g} leads to that end", "ANG")
        target[other] = pen.at[other] + step * way[other] / way[one]

    def _arc(self, found: list[Word], target: dict[int, float], *, ccw: bool) -> None:
        pen = self.pen
        a, b = pen.plane.first, pen.plane.second
        end = put(self.pen.at, target)
        start, finish = (pen.at[a], pen.at[b]), (end[a], end[b])
        radius, opening = self._get(found, "CR"), self._get(found, "AR")
        extra = self._get(found, "TURN") or 0.0
        if not 0.0 <= extra <= 999.0 or extra != int(extra):
            raise PenError("E309", f"TURN={extra:g}", "TURN")
        centre = self._centre(found, start)
        if radius is not None:
            try:
                center = center_from_radius(start, finish, radius * pen.scale, ccw)
            except ArcError as exc:
                exc.word = "CR"
                raise
        elif opening is not None:
            if not 0.0 < opening < 360.0:
                raise PenError("E309", f"AR={opening:g}: between 0 and 360 degrees is expected", "AR")
            half = math.radians(opening) / 2.0
            if centre is None:
                chord = math.dist(start, finish)
                if chord < 1e-9:
                    raise PenError("E306", "AR= with an end where the arc starts", "AR")
                size = chord / 2.0 / math.sin(half)
                center = center_from_radius(start, finish, size if opening <= 180.0 else -size, ccw)
            else:
                center, turn = centre, 2.0 * half * (1.0 if ccw else -1.0)
                dx, dy = start[0] - center[0], start[1] - center[1]
                c, s = math.cos(turn), math.sin(turn)
                end = put(end, {a: center[0] + c * dx - s * dy, b: center[1] + s * dx + c * dy})
        elif centre is not None:
            center = centre
        elif any(w.name in ("AP", "RP") for w in found):
            center = self.pole  # an arc by polar words runs about the pole
        else:
            raise PenError("E302", "an arc without centre, CR= or AR=", f"G{self.motion:g}")
        pen.arc(end, center, ccw=ccw, turns=int(extra) + 1, checked=radius is None, word=f"G{self.motion:g}")

    def _centre(self, found: list[Word], start: Pair) -> Pair | None:
        """I J K: steps from the start, coordinates in AC(...)."""
        pen = self.pen
        letters = pen.plane.words
        given = [self._get(found, letter) for letter in letters]
        if given == [None, None]:
            return None
        absolute = {w.name for w in found if w.kind == "set" and w.value.startswith("AC")}
        out = [
            (value or 0.0) * pen.scale * (self.half(step=False) if letter == "I" else 1.0)
            if letter in absolute
            else origin + (value or 0.0) * pen.scale
            for letter, value, origin in zip(letters, given, start, strict=True)
        ]
        return out[0], out[1]

    def _special(self, keys: set[str], found: list[Word], target: dict[int, float]) -> None:
        pen = self.pen
        a, b = pen.plane.first, pen.plane.second
        end = put(self.pen.at, target)
        start, finish = (pen.at[a], pen.at[b]), (end[a], end[b])
        if "CT" in keys:
            t = pen.heading()
            if t is None:
                raise PenError("E302", "CT has no motion before it that gives a tangent", "CT")
            dx, dy = finish[0] - start[0], finish[1] - start[1]
            aside = t[0] * dy - t[1] * dx
            if abs(aside) < 1e-12:
                pen.go(dict(enumerate(end)), rapid=False)
                return
            r = (dx * dx + dy * dy) / (2.0 * aside)
            pen.arc(end, (start[0] - r * t[1], start[1] + r * t[0]), ccw=r > 0.0, word="CT", checked=False)
            return
        names = {0: "I1", 1: "J1", 2: "K1"}
        middle = []
        for axis in (a, b):
            value = self._get(found, names[axis])
            step = any(w.name == names[axis] and w.value.startswith("IC") for w in found) or not self.absolute
            base = pen.at[axis] if step or value is None else 0.0
            middle.append(base + (value or 0.0) * pen.scale)
        normal = pen.plane.normal
        off = self._get(found, names[normal])
        aside = 0.0 if off is None else abs(off * pen.scale - pen.at[normal])
        if aside > 1e-9 or end[normal] != pen.at[normal]:
            raise PenError("E361", "CIP out of the working plane is not supported", "CIP")
        p, q = (middle[0], middle[1]), finish
        ax, ay, bx, by = p[0] - start[0], p[1] - start[1], q[0] - start[0], q[1] - start[1]
        d = 2.0 * (ax * by - ay * bx)
        if abs(d) < 1e-12:
            raise PenError("E308", "CIP: three points on one line", "CIP")
        ux = (by * (ax * ax + ay * ay) - ay * (bx * bx + by * by)) / d
        uy = (ax * (bx * bx + by * by) - bx * (ax * ax + ay * ay)) / d
        pen.arc(end, (start[0] + ux, start[1] + uy), ccw=d > 0.0, word="CIP", checked=False)

    def _thread(self, found: list[Word], target: dict[int, float]) -> None:
        """G33, G331, G332: by the lead along the axis that goes farthest; the tool does not retract by itself."""
        pen = self.pen
        steps = {axis: abs(value - pen.at[axis]) for axis, value in target.items()}
        longest = max(steps, key=lambda axis: steps[axis], default=2)
        lead = self._get(found, "IJK"[longest]) or 0.0
        if not lead and self.motion != 33.0:
            raise PenError("E301", f"G{self.motion:g} needs a pitch and a speed", f"G{self.motion:g}")
        if lead or self.motion != 33.0:
            self.lead = abs(lead) * pen.scale
        rpm = pen.rpm or self.speed
        if self.motion != 33.0 and not rpm:
            raise PenError("E301", f"G{self.motion:g} needs a pitch and a speed", f"G{self.motion:g}")
        feed = pen.tap_feed(self.lead, rpm, f"G{self.motion:g}")
        reach = math.hypot(*steps.values())
        with pen.feeding(feed * (reach / steps[longest] if reach else 1.0)):
            pen.go(target, rapid=False)

    lead = 0.0
    """mm, of the thread in force."""

    def _corner(self, found: list[Word]) -> None:
        pen = self.pen
        feed = (self._get(found, "FRC") or self.corner_feed) * pen.scale
        if feed < 0.0 or (feed and pen.feed_mode == "inverse"):
            raise PenError("E301", "FRC and FRCM are feeds of G94 and G95 above zero", "FRC")
        own = feed * (abs(pen.rpm) if pen.feed_mode == "rev" else 1.0) or None
        for name, kind in (("RND", "round"), ("CHR", "chamfer")):
            size = self._get(found, name)
            if size:
                pen.set_corner(kind, size * pen.scale, own)
                return
        bevel = self._get(found, "CHF")
        if bevel:
            pen.set_corner("bevel", bevel * pen.scale, own)
        elif self.rounding > 0.0 and self.motion in (1.0, 2.0, 3.0) and pen.held is not None:
            pen.set_corner("round", self.rounding, own, soft=True)
