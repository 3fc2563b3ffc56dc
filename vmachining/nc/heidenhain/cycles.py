"""Drilling cycles of conversational programs, on the hole where the tool stands.

s = Q203 + Q200 is the set-up clearance above the surface, t = Q203 + max(Q204, Q200) the second one; every cycle begins
with a rapid to s and ends with a rapid to t.

| cycle | between |
|---|---|
| 200 | steps of Q202 at Q206; between them rapid to s, dwell Q210, rapid to Q200 above the last depth; dwell Q211 |
| 201, 202 | feed to the depth, dwell Q211, back to s at Q208 (202: the step off the wall with the spindle still is left out) |
| 203 | as 200 with steps that shrink by Q212 down to Q205; Q213 times the tool only lifts by Q256 |
| 205 | steps as 203, back to Q258 (to Q259, evenly) above the last depth; chips broken each Q257 by lifting Q256; Q379 |
| 204 | beside the hole by Q251 down to Q200 below the underside (Q250, edge Q252), to its middle, up by Q249, and back |
| 206, 207, 209 | tapping at Q206, or pitch Q239 times speed; 209 breaks chips each Q257 |
| 208 | helix of pitch Q334 on the diameter Q335 less that of the tool, a full circle at the bottom, back to the middle |
| 262 | half a circle onto the thread, helix of pitch Q239 (Q355: one turn, all of it, or several), half a circle back |
| 240, 241 | feed to the depth, dwell Q211; 241 starts at Q379 |
| 1, 2, 17 | the old ones: from where the tool stands, which is the set-up clearance |

Source: HEIDENHAIN TNC 640, user's manual cycle programming (public). In 208 the control rounds the way to the wall in
the air; here it is straight.

Points where a cycle is called, cycles 220 and 221, and PATTERN DEF with CYCL CALL PAT.

    POS1 (X Y Z)                                     one point
    ROW1 (X Y D NUM ROT Z)                           NUM points D apart
    PAT1, FRAME1 (X Y DX DY NUMX NUMY ROT ROTX ROTY Z)  rows, or only the points along their border
    CIRC1 (X Y D START NUM Z)                        a full circle
    PITCHCIRC1 (X Y D START STEP NUM Z)              a part of one

ROT turns the whole figure about X Y, ROTX and ROTY turn only its rows or only its columns; Z adds to the surface of the
cycle. Rows are taken to and fro, as cycle 221 does; the manual draws no order.
Source: HEIDENHAIN TNC 640, user's manual cycle programming, "Pattern definition PATTERN DEF" (public).
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Final, NamedTuple

from vmachining.nc.model import PenError
from vmachining.nc.pen import Pen

MOST: Final = 20_000
"""Holes of a pattern, or steps in a hole: more is a slip of the pen."""

_ITEM: Final = re.compile(r"(POS|ROW|PAT|FRAME|CIRC|PITCHCIRC)[ ]*\d*[ ]*\(([^()]*)\)")
_VALUE: Final = re.compile(
    r"(NUMX|NUMY|NUM|ROTX|ROTY|ROT|START|STEP|DX|DY|D|X|Y|Z)[ ]*([+-]?[ ]*(?:Q[LR]?\d+|\d+\.?\d*|\.\d+))"
)

Values = Mapping[str, float]


class Spot(NamedTuple):
    """Program units; z adds to the surface."""

    x: float
    y: float
    z: float = 0.0


def need(what: str, values: Values, *names: str) -> list[float]:
    """Values that a cycle cannot do without.

    Raises PenError: E331
    """
    missing = next((name for name in names if name not in values), None)
    if missing is not None:
        raise PenError("E331", f"{what} needs {missing}", missing)
    return [values[name] for name in names]


def _count(value: float, name: str) -> int:
    if not 1.0 <= value <= MOST or value != int(value):
        raise PenError("E342", f"{name} is not a whole number of points", name)
    return int(value)


def _on_circle(x: float, y: float, diameter: float, start: float, step: float, n: int) -> list[Spot]:
    angles = [math.radians(start + k * step) for k in range(n)]
    return [Spot(x + diameter / 2.0 * math.cos(a), y + diameter / 2.0 * math.sin(a)) for a in angles]


def _rows(x: float, y: float, steps: tuple[float, float], counts: tuple[int, int], turns: tuple[float, float],
          *, border: bool = False) -> list[Spot]:  # fmt: skip
    """Columns along the direction turns[0], rows along turns[1] + 90 degrees, to and fro."""
    (dx, dy), (m, n), (a, b) = steps, counts, (math.radians(v) for v in turns)
    if m * n > MOST:
        raise PenError("E342", f"over {MOST} points")
    grid = [(i if j % 2 == 0 else m - 1 - i, j) for j in range(n) for i in range(m)]
    if border:
        ring = [(i, 0) for i in range(m)] + [(m - 1, j) for j in range(1, n)]
        if n > 1:
            ring += [(i, n - 1) for i in range(m - 2, -1, -1)]
        if m > 1:
            ring += [(0, j) for j in range(n - 2, 0, -1)]
        grid = ring
    ca, sa, cb, sb = math.cos(a), math.sin(a), math.cos(b), math.sin(b)
    return [Spot(x + i * dx * ca - j * dy * sb, y + i * dx * sa + j * dy * cb) for i, j in grid]


def points(number: int, values: Values) -> list[Spot]:
    """Points of cycle 220 (circle) or 221 (rows)."""
    if number == 220:
        names = ("Q216", "Q217", "Q244", "Q245", "Q246", "Q247", "Q241")
        x, y, diameter, start, stop, step, count = need("cycle 220", values, *names)
        n = _count(count, "Q241")
        if step == 0.0:
            whole = abs(abs(stop - start) - 360.0) < 1e-9
            step = (stop - start) / (n if whole else max(1, n - 1))
        return _on_circle(x, y, diameter, start, step, n)
    x, y, dx, dy, columns, rows = need("cycle 221", values, "Q225", "Q226", "Q237", "Q238", "Q242", "Q243")
    turn = values.get("Q224", 0.0)
    return _rows(x, y, (dx, dy), (_count(columns, "Q242"), _count(rows, "Q243")), (turn, turn))


def defined(text: str, number: Callable[[str], float]) -> list[Spot]:
    """Points of a PATTERN DEF; number : value of a numeral or parameter.

    Raises PenError: E109, E331, E342
    """
    out: list[Spot] = []
    if _ITEM.sub("", text).strip():
        what = f"'{_ITEM.sub('', text).strip()[:40]}' of PATTERN DEF is not understood"
        raise PenError("E109", what, "PATTERN DEF")
    for kind, body in _ITEM.findall(text):
        left = _VALUE.sub("", body).strip()
        if left:
            raise PenError("E109", f"'{left[:30]}' of {kind} is not understood", left[:30])
        v = {key: number(value) for key, value in _VALUE.findall(body)}
        x, y = need(kind, v, "X", "Y")
        turn = v.get("ROT", 0.0)
        if kind == "POS":
            found = [Spot(x, y)]
        elif kind == "ROW":
            step, count = need(kind, v, "D", "NUM")
            found = _rows(x, y, (step, 0.0), (_count(count, "NUM"), 1), (turn, turn))
        elif kind in ("PAT", "FRAME"):
            dx, dy, m, n = need(kind, v, "DX", "DY", "NUMX", "NUMY")
            turns = turn + v.get("ROTX", 0.0), turn + v.get("ROTY", 0.0)
            counts = _count(m, "NUMX"), _count(n, "NUMY")
            found = _rows(x, y, (dx, dy), counts, turns, border=kind == "FRAME")
        else:
            size, start, count = need(kind, v, "D", "START", "NUM")
            n = _count(count, "NUM")
            step = need(kind, v, "STEP")[0] if kind == "PITCHCIRC" else 360.0 / n
            found = _on_circle(x, y, size, start, step, n)
        out += [spot._replace(z=v.get("Z", 0.0)) for spot in found]
    return out


HOLES: Final = frozenset({200, 201, 202, 203, 204, 205, 206, 207, 208, 209, 240, 241, 262})
OLD: Final = frozenset({1, 2, 17})
ROUNDING_MM: Final = 1e-6


class _Hole:
    """One hole: levels in program coordinates, mm."""

    def __init__(self, pen: Pen, number: int, values: Values, surface: float) -> None:
        self.pen, self.number, self.values, self.rapid = pen, number, values, pen.rise
        k = pen.scale
        names = ("Q200", "Q249" if number == 204 else "Q201")
        clearance, depth = (v * k for v in need(f"cycle {number}", values, *names))
        depth = -abs(depth) if number == 204 else depth
        self.surface = values.get("Q203", 0.0) * k + surface
        self.clearance = abs(clearance)
        self.safe = self.surface + self.clearance
        self.top = self.surface + max(values.get("Q204", 0.0) * k, self.clearance)
        self.depth = depth
        self.bottom = self.surface + depth
        self.feed = values.get("Q206", 0.0) * k

    def length(self, name: str) -> float:
        return self.values.get(name, 0.0) * self.pen.scale

    def cut(self, z: float, feed: float = 0.0) -> None:
        self.pen.sink(z, feed or self.feed)

    def back(self, z: float) -> None:
        """At the feed Q208, or in rapid without one."""
        feed = self.length("Q208")
        if feed > 0.0:
            self.cut(z, feed)
        else:
            self.rapid(z)

    def out(self) -> None:
        """At the bottom: the dwell Q211, then back to the set-up clearance."""
        self.dwell("Q211")
        self.back(self.safe)

    def dwell(self, name: str) -> None:
        if self.values.get(name, 0.0) > 0.0:
            self.pen.dwell(self.values[name])

    def levels(self, start: float, first: float, less: float = 0.0, least: float = 0.0) -> Iterator[float]:
        """Depths of the steps below `start`."""
        step, z, count = first if first > 0.0 else start - self.bottom, start, 0
        while z - self.bottom > ROUNDING_MM:
            count += 1
            if count > MOST:
                raise PenError("E339", f"over {MOST} steps in one hole", "Q202")
            z = self.bottom if z - step - self.bottom <= ROUNDING_MM else z - step
            yield z
            step = max(step - less, least) if less > 0.0 else step
            if step <= ROUNDING_MM:
                raise PenError("E339", "the steps of the hole shrink to zero", "Q212")


def drill(pen: Pen, number: int, values: Values, *, surface: float = 0.0) -> None:
    """The cycle where the tool stands; surface : mm, added to Q203."""
    if pen.compensation is not None:
        raise PenError("E344", f"cycle {number} while cutter compensation is on")
    if number in OLD:
        _old(pen, number, values)
        return
    hole = _Hole(pen, number, values, surface)
    if hole.depth >= 0.0:
        if hole.depth == 0.0:
            return  # depth zero: the control does not execute the cycle
        raise PenError("E337", f"cycle {number} drills upwards: Q201 is above zero", "Q201")
    if number not in (204, 207, 209, 262):
        need(f"cycle {number}", values, "Q206")
    hole.rapid(hole.safe)
    _BODIES[number](hole)
    hole.rapid(hole.top)


def _peck(hole: _Hole) -> None:
    (step,) = (v * hole.pen.scale for v in need("cycle 200", hole.values, "Q202"))
    for z in hole.levels(hole.surface, step):
        hole.cut(z)
        if z == hole.bottom:
            break
        hole.rapid(hole.safe)
        hole.dwell("Q210")
        hole.rapid(min(z + hole.clearance, hole.safe))
    hole.dwell("Q211")
    hole.rapid(hole.safe)


def _ream(hole: _Hole) -> None:
    hole.cut(hole.bottom)
    hole.dwell("Q211")
    hole.cut(hole.safe, hole.length("Q208") or hole.feed)


def _universal(hole: _Hole) -> None:
    (step,) = (v * hole.pen.scale for v in need("cycle 203", hole.values, "Q202"))
    lift, breaks = hole.length("Q256") or 0.2, int(hole.values.get("Q213", 0.0))
    broken = 0
    for z in hole.levels(hole.surface, step, hole.length("Q212"), hole.length("Q205")):
        hole.cut(z)
        if z == hole.bottom:
            break
        if broken < breaks:
            broken += 1
            hole.back(z + lift)
            continue
        broken = 0
        hole.back(hole.safe)
        hole.dwell("Q210")
        hole.rapid(min(z + hole.clearance, hole.safe))
    hole.out()


def _deep(hole: _Hole) -> None:
    (step,) = (v * hole.pen.scale for v in need("cycle 205", hole.values, "Q202"))
    start = hole.surface - hole.length("Q379")
    if start < hole.surface:
        hole.cut(start + hole.clearance, hole.length("Q253") or hole.feed)
    levels = list(hole.levels(start, step, hole.length("Q212"), hole.length("Q205")))
    each, lift, above = hole.length("Q257"), hole.length("Q256") or 0.2, start
    for k, z in enumerate(levels):
        if each > 0.0:
            if (above - z) / each > MOST:
                raise PenError("E339", f"over {MOST} steps in one hole", "Q257")
            while above - each - z > ROUNDING_MM:
                above -= each
                hole.cut(above)
                hole.back(above + lift)
        hole.cut(z)
        above = z
        if k + 1 == len(levels):
            break
        hole.back(hole.safe)
        first, last = hole.length("Q258"), hole.length("Q259") or hole.length("Q258")
        ahead = first + (last - first) * (k / max(1, len(levels) - 2))
        hole.rapid(min(z + ahead, hole.safe))
    hole.out()


def _tap(hole: _Hole) -> None:
    feed = hole.feed
    if hole.number != 206:
        (pitch,) = need(f"cycle {hole.number}", hole.values, "Q239")
        feed = hole.pen.tap_feed(pitch * hole.pen.scale, hole.pen.rpm, "Q239")
    each, lift = hole.length("Q257") if hole.number == 209 else 0.0, hole.length("Q256")
    for z in hole.levels(hole.surface, each):
        hole.cut(z, feed)
        if z != hole.bottom:
            hole.cut(z + lift if lift > 0.0 else hole.safe, feed)
    hole.dwell("Q211")
    hole.cut(hole.safe, feed)


def _mill(hole: _Hole) -> None:
    pen = hole.pen
    pitch, diameter = (v * pen.scale for v in need("cycle 208", hole.values, "Q334", "Q335"))
    radius = diameter / 2.0 - pen.radius()
    if pitch <= 0.0:
        raise PenError("E339", "cycle 208 needs Q334 above zero", "Q334")
    if radius <= ROUNDING_MM:
        if radius < -ROUNDING_MM:
            raise PenError("E354", f"the tool does not fit into a hole of {diameter:g} mm", "Q335")
        hole.cut(hole.bottom)
        hole.rapid(hole.safe)
        return
    x, y = pen.at[0], pen.at[1]
    ccw = (hole.values.get("Q351", 1.0) >= 0.0) == (pen.rpm >= 0.0)
    turns = (hole.safe - hole.bottom) / pitch
    if turns > MOST:
        raise PenError("E339", f"over {MOST} turns", "Q334")
    with pen.feeding(hole.feed):
        pen.go({0: x + radius}, rapid=False)
        whole, z = math.floor(turns + 1e-9), hole.safe
        if whole:
            z = hole.safe - whole * pitch if turns - whole > 1e-9 else hole.bottom
            pen.arc((x + radius, y, z), (x, y), ccw=ccw, turns=whole)
        if z > hole.bottom + ROUNDING_MM:
            angle = (math.tau if ccw else -math.tau) * (turns - whole)
            end = x + radius * math.cos(angle), y + radius * math.sin(angle), hole.bottom
            pen.arc(end, (x, y), ccw=ccw)
        pen.arc((pen.at[0], pen.at[1], hole.bottom), (x, y), ccw=ccw)
        pen.go({0: x, 1: y}, rapid=False)
    hole.rapid(hole.safe)


def _thread(hole: _Hole) -> None:
    """Up or down by the signs of pitch and Q351 (manual, "Fundamentals of thread milling", internal threads)."""
    pen = hole.pen
    diameter, pitch, passes = need("cycle 262", hole.values, "Q335", "Q239", "Q355")
    radius, pitch, x, y = diameter * pen.scale / 2.0 - pen.radius(), pitch * pen.scale, pen.at[0], pen.at[1]
    feed, near = hole.length("Q207"), hole.length("Q253")
    if pitch == 0.0 or passes < 0.0 or passes != int(passes):
        raise PenError("E339", "cycle 262 needs a pitch, and a whole Q355 from zero", "Q239")
    if radius <= ROUNDING_MM:
        raise PenError("E354", f"the tool does not fit into a thread of {diameter:g}", "Q335")
    ccw = (hole.values.get("Q351", 1.0) >= 0.0) == (pen.rpm >= 0.0)
    up = (pitch > 0.0) == ccw
    pitch = abs(pitch)
    turns = abs(hole.depth) / pitch
    starts = [0.0] if passes <= 1.0 else [k * passes * pitch for k in range(math.ceil(turns / passes - 1e-9))]
    if turns > MOST or len(starts) > MOST:
        raise PenError("E339", f"over {MOST} turns", "Q239")
    sign, first = (1.0, hole.bottom) if up else (-1.0, hole.surface)
    whole = turns if passes == 1.0 else 1.0
    pen.note("W373", "cycle 262: the tool goes onto the thread and off it on half circles that rise by half a pitch, which "
             "the manual does not measure", "Q239", once="262")  # fmt: skip
    for start in starts:
        z = first + sign * start
        hole.cut(z - sign * pitch / 2.0, near or feed)
        with pen.feeding(feed):
            pen.arc((x + radius, y, z), (x + radius / 2.0, y), ccw=ccw)
            full = math.floor(whole + 1e-9)
            if full:
                pen.arc((x + radius, y, z + sign * full * pitch), (x, y), ccw=ccw, turns=full)
            angle, z = (math.tau if ccw else -math.tau) * (whole - full), z + sign * whole * pitch
            if whole - full > 1e-9:
                pen.arc((x + radius * math.cos(angle), y + radius * math.sin(angle), z), (x, y), ccw=ccw)
            middle = x + (pen.at[0] - x) / 2.0, y + (pen.at[1] - y) / 2.0
            pen.arc((x, y, z + sign * pitch / 2.0), middle, ccw=ccw)
    hole.rapid(hole.safe)


def _back(hole: _Hole) -> None:
    """Back boring: beside the hole through it, and up from below."""
    aside, edge, plate = (hole.length(name) for name in ("Q251", "Q252", "Q250"))
    side = hole.values.get("Q214", 0.0)
    if side not in (1.0, 2.0, 3.0, 4.0):
        raise PenError("E339", "cycle 204 needs Q214, the way off the wall, from 1 to 4", "Q214")
    pen, (dx, dy) = hole.pen, ((-1, 0), (0, -1), (1, 0), (0, 1))[int(side) - 1]
    x, y = pen.at[0], pen.at[1]
    under, near, feed = hole.surface - plate - edge, hole.length("Q253"), hole.length("Q254")
    out = {0: x + dx * aside, 1: y + dy * aside}
    pen.note("W373", "cycle 204: the bar passes next to the hole with the spindle stopped, simulated as if it turned", "Q251",
             once="204")  # fmt: skip
    for level, place in ((under - hole.clearance, {0: x, 1: y}), (hole.safe, {0: x, 1: y})):
        pen.go(out, rapid=True)
        hole.cut(level, near)
        pen.go(place, rapid=True)
        if level != hole.safe:
            hole.cut(under - hole.depth, feed)
            hole.dwell("Q255")
            hole.cut(level, near)


def _center(hole: _Hole) -> None:
    if hole.values.get("Q343", 0.0) != 0.0:
        what = "cycle 240 by diameter (Q343=1) needs the tip angle of the tool"
        raise PenError("E208", what, "Q343", "use the depth")
    hole.cut(hole.bottom)
    hole.dwell("Q211")
    hole.rapid(hole.safe)


def _gun(hole: _Hole) -> None:
    start = hole.length("Q379")
    if start > 0.0:
        hole.cut(hole.surface - start + hole.clearance, hole.length("Q253") or hole.feed)
    hole.cut(hole.bottom)
    hole.out()


_BODIES: Final[Mapping[int, Callable[[_Hole], None]]] = {
    200: _peck, 201: _ream, 202: _ream, 203: _universal, 205: _deep, 206: _tap, 207: _tap, 209: _tap,
    204: _back, 208: _mill, 240: _center, 241: _gun, 262: _thread,
}  # fmt: skip


def _old(pen: Pen, number: int, values: Values) -> None:
    """Cycles 1, 2, 17: depths are steps from where the tool stands."""
    k, start = pen.scale, pen.at[2]
    setup, depth = (abs(v) * k for v in need(f"cycle {number}", values, "1", "2"))
    own = {"Q200": setup / k, "Q201": -depth / k, "Q203": (start - setup) / k, "Q206": 0.0}
    if number == 1:
        step, _, feed = need("cycle 1", values, "3", "4", "5")
        own |= {"Q206": feed, "Q211": values["4"]}
        hole = _Hole(pen, 1, own, 0.0)
        ahead = min(max(0.6, depth / 50.0), 7.0)
        for z in hole.levels(hole.surface, abs(step) * k):
            hole.cut(z)
            if z != hole.bottom:
                hole.rapid(hole.safe)
                hole.rapid(z + ahead)
        hole.dwell("Q211")
        hole.rapid(hole.safe)
        return
    (last,) = need(f"cycle {number}", values, "3" if number == 17 else "4")
    hole = _Hole(pen, 207 if number == 17 else 206, own | {"Q239": last, "Q206": last}, 0.0)
    _tap(hole)
