"""Drilling cycles CYCLE81 to CYCLE89, CYCLE840, point patterns, and milling cycles.

Levels: RTP return plane, RFP reference plane, SDIS safety distance (s = RFP + SDIS towards RTP), DP final depth, or DPR
below RFP. Every cycle: rapid to s, body, rapid to RTP.

| cycle | body |
|---|---|
| 81, 82 | feed to the depth, 82 dwells DTB; rapid back |
| 83 | first to FDEP (FDPR), strokes that shrink by DAM (below zero: by the factor), up by VRT or (VARI 1) to s between them |
| 84, 840 | feed by pitch times speed, both ways |
| 85, 89 | feed to the depth (FFR), dwell, feed back (RFF) to s |
| 86, 87, 88 | feed to the depth, rapid back; the lift off the wall with the spindle still is left out |

Distance ahead: 0.6 mm to a depth of 30 mm, then a fiftieth of the depth, 7 mm at most.

Pockets are rectangles (POCKET1, POCKET3) and circles (POCKET2, POCKET4), SLOT2 has arcs on a circle, studs are rectangles
(CYCLE76) and circles (CYCLE77), CYCLE71 and CYCLE61 mill a face; `_ORDER` names their values.

POCKET3, POCKET4 and CYCLE61 have the values of newer controls: GMODE, whose fourth digit says from where the
place counts, DMODE, whose first is the plane, and AMODE, whose digits say how depths and steps count. With them the fifth
value of POCKET4 is a diameter, which is said.
CDIR: 0 climb, 1 conventional, 2 by G2, 3 by G3. VARI, units: 1 roughing, 2 finishing (POCKET1, POCKET2, SLOT2: 0 both);
tens: 0 and 1 straight down, 2 on a helix, 3 to and fro. Source: SINUMERIK 840D sl/828D, Programming Manual Cycles (public).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from vmachining.nc.frames import PLANES
from vmachining.nc.milled import ArcSlot, Cut, Face, Rounded, face, mill, stud_blank
from vmachining.nc.model import PenError, refused
from vmachining.nc.pen import Pen

CYCLES: Final = frozenset({81, 82, 83, 84, 85, 86, 87, 88, 89, 840})
PATTERNS: Final = ("HOLES1", "HOLES2", "CYCLE801", "CYCLE802")
MOST: Final = 20_000
ROUNDING_MM: Final = 1e-6
METRIC: Final = {1: 0.25, 1.2: 0.25, 1.6: 0.35, 2: 0.4, 2.5: 0.45, 3: 0.5, 4: 0.7, 5: 0.8, 6: 1.0, 8: 1.25, 10: 1.5,
                 12: 1.75, 14: 2.0, 16: 2.0, 18: 2.5, 20: 2.5, 22: 2.5, 24: 3.0, 27: 3.0, 30: 3.5, 33: 3.5, 36: 4.0,
                 42: 4.5, 48: 5.0}  # fmt: skip
"""Pitch of standard threads, ISO 261 coarse: what MPIT means."""

Values = Sequence[float | None]


def _at(values: Values, place: int) -> float | None:
    return values[place] if place < len(values) else None


def one_depth(name: str, reference: float, absolute: float | None, relative: float | None) -> None:
    """Raises PenError: E333 where DP and DPR disagree, of which controls take the second and say so."""
    if absolute is not None and relative and abs(abs(absolute - reference) - abs(relative)) > 1e-3:
        what = f"{name}: DP {absolute:g} and DPR {relative:g} are two depths"
        raise PenError("E333", what, name, "leave one of them out")


def drill(pen: Pen, number: int, values: Values) -> None:
    """The cycle where the tool stands; lengths in program units."""
    if pen.compensation is not None:
        raise PenError("E344", f"CYCLE{number} while cutter compensation is on")
    k = pen.scale
    rtp, rfp, sdis, dp, dpr = (_at(values, i) for i in range(5))
    if rtp is None or (dp is None and dpr is None):
        raise PenError("E331", f"CYCLE{number} needs its return plane and its depth")
    one_depth(f"CYCLE{number}", rfp or 0.0, dp, dpr)
    reference = (rfp or 0.0) * k
    sign = -1.0 if (dp is not None and dp * k > reference) else 1.0  # which way it drills
    bottom = dp * k if dp is not None else reference - abs(dpr or 0.0) * k
    safe, back = reference + sign * abs(sdis or 0.0) * k, rtp * k
    if sign * (back - bottom) < 0.0:
        raise PenError("E333", "a drilling cycle whose planes do not lie above its depth")
    pen.rise(safe)
    if number == 83:
        _deep(pen, values, reference, safe, bottom, sign)
    elif number in (84, 840):
        rpm = (_at(values, 10) if number == 84 else None) or pen.rpm
        feed = pen.tap_feed(_pitch(number, values), rpm, f"CYCLE{number}")
        pen.sink(bottom, feed)
        _dwell(pen, _at(values, 5))
        pen.sink(safe, feed)
    else:
        feed_in, feed_out = ((_at(values, i) or 0.0) * k if number == 85 else 0.0 for i in (6, 7))
        pen.sink(bottom, feed_in or None)
        if number not in (81, 87):
            _dwell(pen, _at(values, 5))
        if number in (85, 89):
            pen.sink(safe, feed_out or None)
        else:
            pen.rise(safe)
    pen.rise(back)


def _dwell(pen: Pen, seconds: float | None) -> None:
    """Below zero: turns of the spindle."""
    if seconds:
        turns = abs(pen.rpm)
        pen.dwell(seconds if seconds > 0.0 else -seconds * 60.0 / turns if turns else 0.0)


def _pitch(number: int, values: Values) -> float:
    size, pitch = (_at(values, i) for i in ((7, 8) if number == 84 else (9, 10)))
    if pitch:
        return abs(pitch)
    if size and abs(size) not in METRIC:
        raise PenError("E339", f"CYCLE{number}: M{abs(size):g} is not a standard thread")
    return METRIC[abs(size)] if size else 0.0


def _strokes(
    reference: float, bottom: float, sign: float, first: float, less: float, least: float
) -> list[float]:
    """Depths: strokes from `first`, shrinking, not below `least`; the last two of a degression by amount share the rest."""
    out = [first]
    stroke = abs(reference - first)
    while (left := sign * (out[-1] - bottom)) > ROUNDING_MM:
        if len(out) > MOST or stroke <= ROUNDING_MM:
            raise PenError("E339", f"over {MOST} strokes in one hole")
        if less < 0.0:
            stroke = max(stroke * -less, least)
        elif less > 0.0:
            stroke = max(stroke - less, less, least)
            if stroke == less and less < left < 2.0 * less:
                stroke = left / 2.0
        out.append(bottom if left - stroke <= ROUNDING_MM else out[-1] - sign * stroke)
    return out


def _deep(pen: Pen, values: Values, reference: float, safe: float, bottom: float, sign: float) -> None:
    k = pen.scale
    fdep, fdpr, dam, dtb, dts, frf, vari = (_at(values, i) for i in range(5, 12))
    least, lift, ahead = (_at(values, i) for i in (13, 14, 16))
    if fdep is None and not fdpr:
        raise PenError("E334", "CYCLE83 needs FDEP or FDPR, its first depth")
    first = fdep * k if fdep is not None else reference - sign * abs(fdpr or 0.0) * k
    if sign * (first - bottom) < 0.0 or sign * (reference - first) < 0.0:
        raise PenError("E333", "CYCLE83: the first depth lies outside the hole")
    if not dam and sign * (reference - first) <= ROUNDING_MM:
        raise PenError("E334", "CYCLE83: the first stroke has no length")
    less = dam * k if dam and dam > 0.0 else dam or 0.0
    depth = abs(reference - bottom)
    near = ahead * k if ahead else min(max(0.6, depth / 50.0), 7.0)
    feed = pen.feed
    for place, level in enumerate(_strokes(reference, bottom, sign, first, less, (least or 0.0) * k)):
        pen.sink(level, feed * frf if place == 0 and frf and feed and pen.feed_mode == "min" else None)
        _dwell(pen, dtb)
        if level == bottom:
            break
        if vari == 1:
            pen.rise(safe)
            _dwell(pen, dts)
            pen.rise(level + sign * min(near, abs(safe - level)))
        else:
            pen.rise(level + sign * (lift * k if lift else 1.0))
    pen.rise(safe)


def points(name: str, values: Values) -> list[tuple[float, float]]:
    """Points of a pattern in program units."""
    v = [0.0 if value is None else value for value in values] + [0.0] * 8
    if name == "HOLES1":
        x, y, angle, first, step, count = v[:6]
        a = math.radians(angle)
        reaches = [first + i * step for i in range(_count(count))]
        return [(x + d * math.cos(a), y + d * math.sin(a)) for d in reaches]
    if name == "HOLES2":
        x, y, radius, start, step, count = v[:6]
        n = _count(count)
        step = step or 360.0 / n
        angles = [math.radians(start + i * step) for i in range(n)]
        return [(x + radius * math.cos(a), y + radius * math.sin(a)) for a in angles]
    if name == "CYCLE801":
        x, y, angle, dx, dy, columns, rows = v[:7]
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        out = []
        for j in range(_count(rows)):
            along = range(_count(columns)) if j % 2 == 0 else range(_count(columns) - 1, -1, -1)
            out += [(x + c * i * dx - s * j * dy, y + s * i * dx + c * j * dy) for i in along]
        return out
    masks = [f"{values[i]:.0f}" if i < len(values) and values[i] is not None else "" for i in (0, 1)]
    if not all(mask and set(mask) == {"1"} for mask in masks):
        raise refused("CYCLE802 with incremental positions", "CYCLE802")
    rest = list(values[2:])
    pairs = [(rest[i], rest[i + 1]) for i in range(0, min(len(rest) - 1, 2 * len(masks[0])), 2)]
    return [(x, y) for x, y in pairs if x is not None and y is not None]


def _count(value: float) -> int:
    if not 1.0 <= value <= MOST or value != int(value):
        raise PenError("E342", f"{value:g} is not a whole number of points")
    return int(value)


_COMMON: Final = "RTP RFP SDIS DP"
_ORDER: Final = {
    "POCKET1": f"{_COMMON} DPR LENG WID CRAD PA PO STA FFD FFP1 MID CDIR FAL VARI MIDF FFP2",
    "POCKET2": f"{_COMMON} DPR PRAD PA PO FFD FFP1 MID CDIR FAL VARI MIDF FFP2",
    "POCKET3": f"{_COMMON} LENG WID CRAD PA PO STA MID FAL FALD FFP1 FFD CDIR VARI MIDA AP1 AP2 AD RAD1 DP1 UMODE FS ZFS "
               "GMODE DMODE AMODE",
    "POCKET4": f"{_COMMON} PRAD PA PO MID FAL FALD FFP1 FFD CDIR VARI MIDA AP1 AD RAD1 DP1 UMODE FS ZFS GMODE DMODE AMODE",
    "SLOT2": f"{_COMMON} DPR NUM AFSL WID PA PO RAD STA1 INDA FFD FFP1 MID CDIR FAL VARI MIDF FFP2",
    "CYCLE76": f"{_COMMON} DPR LENG WID CRAD PA PO STA MID FAL FALD FFP1 FFD CDIR VARI AP1 AP2",
    "CYCLE77": f"{_COMMON} DPR PRAD PA PO MID FAL FALD FFP1 FFD CDIR VARI AP1",
    "CYCLE71": f"{_COMMON} PA PO LENG WID STA MID MIDA FDP FALD FFP1 VARI FDP1",
    "CYCLE61": f"{_COMMON} PA PO LENG WID MID MIDA FALD FFP1 VARI LIM DMODE AMODE",
}  # fmt: skip
BUILT: Final = frozenset(_ORDER)
_NUMBERS: Final = frozenset("STA CDIR VARI MIDA UMODE FS ZFS GMODE DMODE AMODE".split())  # noqa: SIM905
_LENGTHS: Final = frozenset(f"{_ORDER['POCKET1']} {_ORDER['POCKET4']} RAD AP2 FDP FDP1".split()) - _NUMBERS
"""What counts in the unit of the program."""
_OLD: Final = ("POCKET1", "POCKET2", "SLOT2")
SHARE: Final = 0.8
"""Step of the clearing passes, of the diameter of the tool, where the cycle leaves it to the control."""


def _digit(value: float, place: int) -> int:
    return int(abs(value) // 10.0**place) % 10


class _Values:
    """Values of one call by name, mm and mm/min."""

    def __init__(self, pen: Pen, name: str, given: Sequence[float | None]) -> None:
        self.name, self.pen = name, pen
        names = _ORDER[name].split()
        self.given = {key: value for key, value in zip(names, given, strict=False) if value is not None}
        self.new = name in ("POCKET3", "POCKET4", "CYCLE61") and len(given) >= len(names)
        self.mode = self.given.get("AMODE", 0.0) if self.new else 0.0
        plane = _digit(self.given.get("DMODE", 0.0), 0)
        other = plane and PLANES.get(160 + 10 * plane) is not pen.plane
        if other or _digit(self.mode, 0) > 1 or _digit(self.given.get("GMODE", 0.0), 3) > 1:
            digits = "/".join(f"{self.given.get(key, 0.0):g}" for key in ("GMODE", "DMODE", "AMODE"))
            raise PenError("E208", f"{name} from a corner, in another plane or with its own depth (GMODE/DMODE/AMODE {digits})",
                           name, "give it by its centre, in the plane that is on")  # fmt: skip

    def __getitem__(self, key: str) -> float:
        return self.given.get(key, 0.0) * (self.pen.scale if key in _LENGTHS else 1.0)

    def need(self, *keys: str) -> None:
        """Values that the cycle cannot do without."""
        missing = next((key for key in keys if key not in self.given), None)
        if missing is not None:
            raise PenError("E331", f"{self.name} needs {missing}", self.name)

    def bottom(self) -> float:
        """Absolute, by DPR below the reference plane, or with the mode of newer controls incremental."""
        top = self["RFP"]
        one_depth(self.name, self.given.get("RFP", 0.0), self.given.get("DP"), self.given.get("DPR"))
        if "DP" in self.given and not _digit(self.mode, 0):
            return self["DP"]
        deep = self["DP"] if _digit(self.mode, 0) else self["DPR"]
        if deep == 0.0:
            raise PenError("E331", f"{self.name} needs its depth", self.name)
        return top - abs(deep)

    def step(self) -> float:
        """Of the clearing passes."""
        diameter = 2.0 * self.pen.radius() if self.pen.has_radius() else 0.0
        given = self.given.get("MIDA", 0.0)
        if given > 0.0:
            return given / 100.0 * diameter if _digit(self.mode, 1) else given * self.pen.scale
        return SHARE * diameter

    def cut(self) -> Cut:
        self.need("RTP", "MID")
        kind = int(self["VARI"])
        units, tens = _digit(kind, 0), _digit(kind, 1)
        old = self.name in _OLD
        if units > 2 or (units == 0 and not old):
            what = "post the motions of the cycle as blocks"
            raise refused(f"{self.name} with VARI {kind}", self.name, what)
        turn = int(self["CDIR"])
        right = self.pen.rpm >= 0.0
        outside = self.name in ("CYCLE76", "CYCLE77")
        # against the clock inside is climb with M3; outside it is not
        climb = turn == 0 if turn < 2 else ((turn == 3) == right) != outside
        top = self["RFP"]
        return Cut(
            safe=top + abs(self["SDIS"]) * (1.0 if self.bottom() < top else -1.0), top=top, bottom=self.bottom(),
            back=self["RTP"],
            feed=self["FFP1"] or None, down=self["FFD"] or None, most=self["MID"], step=self.step(),
            rough=units != 2, finish=units != 1, side=self["FAL"], floor=self["FALD"], even=True,
            finish_most=self["MIDF"], finish_feed=self["FFP2"] or None,
            plunge="helix" if tens == 2 else "ramp" if tens == 3 else "down", way=(self["RAD1"], self["DP1"]),
            climb=climb, outside=outside,
        )  # fmt: skip


def milled(pen: Pen, name: str, given: Sequence[float | None]) -> None:
    """A milling cycle.

    Raises PenError: E208, E331, E333, E339, E344, E351, E354
    """
    v = _Values(pen, name, given)
    v.need("RTP")
    if name in ("CYCLE61", "CYCLE71"):
        _face(v)
    elif name == "SLOT2":
        _arcs(v)
    elif name in ("POCKET2", "POCKET4", "CYCLE77"):
        v.need("PRAD")
        size = v["PRAD"]
        if v.new:
            pen.note("W384", "POCKET4 with the values of newer controls: its fifth value is taken as a diameter", "POCKET4",
                     once="pocket4")  # fmt: skip
        radius = abs(size) / (2.0 if v.new or name == "CYCLE77" else 1.0)
        cut = v.cut()
        if cut.outside:
            cut = cut._replace(blank=max(0.0, abs(v["AP1"]) / 2.0 - radius))
        mill(pen, Rounded(v["PA"], v["PO"], radius, radius, radius), cut, name)
    else:
        v.need("LENG", "WID")
        along, across = abs(v["LENG"]) / 2.0, abs(v["WID"]) / 2.0
        cut = v.cut()
        if cut.outside:
            if _digit(v["VARI"], 1):
                raise refused(f"CYCLE76 with VARI {v['VARI']:g}", name)
            blank = abs(v["AP1"]) / 2.0, abs(v["AP2"]) / 2.0
            cut = cut._replace(blank=stud_blank((along, across), abs(v["CRAD"]), blank))
        corner = min(abs(v["CRAD"]), along, across)
        mill(pen, Rounded(v["PA"], v["PO"], along, across, corner, v["STA"]), cut, name)


def _arcs(v: _Values) -> None:
    v.need("NUM", "AFSL", "WID", "RAD")
    count = v["NUM"]
    if not 1.0 <= count <= 1000.0 or count != int(count):
        raise PenError("E342", f"SLOT2: {count:g} is not a whole number of slots", v.name)
    step = v["INDA"] or 360.0 / count
    cut = v.cut()
    for k in range(int(count)):
        shape = ArcSlot(v["PA"], v["PO"], abs(v["RAD"]), abs(v["WID"]) / 2.0, v["STA1"] + k * step, v["AFSL"])
        mill(v.pen, shape, cut._replace(back=v["RTP"] if k + 1 == count else cut.safe), v.name)


def _face(v: _Values) -> None:
    v.need("LENG", "WID", "MID")
    kind = int(v["VARI"])
    units, way = _digit(kind, 0), _digit(kind, 1)
    if units not in (1, 2) or way not in (1, 2, 3, 4):
        raise refused(f"{v.name} with VARI {kind}", v.name, "post the motions of the cycle as blocks")
    if v.given.get("LIM"):
        raise refused(f"{v.name} with sides that limit it", v.name)
    x, y, along, across = v["PA"], v["PO"], v["LENG"], v["WID"]
    if v.name == "CYCLE61" and (x or y):
        if not v.new:
            raise PenError("E208", "CYCLE61 from a corner other than zero: only AMODE tells what its second corner means", v.name,
                           "write all sixteen values")  # fmt: skip
        places = _digit(v.mode, 3), _digit(v.mode, 4)
        along, across = along - x * places[0], across - y * places[1]
        what = "CYCLE61 from another corner than zero: the second is a place where AMODE has 1 in its 4th and 5th digit"
        v.pen.note("W384", what, v.name, once="cycle61")
    turn, beside = v["STA"], abs(v["FDP1"]) or abs(v["FDP"])
    if way in (2, 4):  # lines along the second axis: the rectangle turned by 90 degrees, its sides exchanged
        along, across, turn = across, -along, turn + 90.0
    top, down = v["RFP"], v.bottom()
    cut = Cut(
        safe=top + abs(v["SDIS"]) * (1.0 if down < top else -1.0), top=top, bottom=down, back=v["RTP"], feed=v["FFP1"] or None,
        down=None, most=v["MID"], step=v.step(), rough=units == 1, floor=v["FALD"], even=True,
    )  # fmt: skip
    face(v.pen, Face(x, y, along, across, turn, beside, way in (3, 4)), cut, v.name)
