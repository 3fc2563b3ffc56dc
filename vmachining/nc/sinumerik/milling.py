"""Milling cycles: POCKET1 to POCKET4, SLOT2, CYCLE76, CYCLE77, CYCLE61 and CYCLE71; their values, and what they mean.

| cycle | shape | values in their order |
|---|---|---|
| POCKET1 | rectangle | RTP RFP SDIS DP DPR LENG WID CRAD CPA CPO STA1 FFD FFP1 MID CDIR FAL VARI MIDF FFP2 |
| POCKET2 | circle | RTP RFP SDIS DP DPR PRAD CPA CPO FFD FFP1 MID CDIR FAL VARI MIDF FFP2 |
| POCKET3 | rectangle | RTP RFP SDIS DP LENG WID CRAD PA PO STA MID FAL FALD FFP1 FFD CDIR VARI MIDA AP1 AP2 AD RAD1 DP1 |
| POCKET4 | circle | RTP RFP SDIS DP PRAD PA PO MID FAL FALD FFP1 FFD CDIR VARI MIDA AP1 AD RAD1 DP1 |
| SLOT2 | arcs on a circle | RTP RFP SDIS DP DPR NUM AFSL WID CPA CPO RAD STA1 INDA FFD FFP1 MID CDIR FAL VARI MIDF FFP2 |
| CYCLE76 | rectangular stud | RTP RFP SDIS DP DPR LENG WID CRAD PA PO STA MID FAL FALD FFP1 FFD CDIR VARI AP1 AP2 |
| CYCLE77 | circular stud | RTP RFP SDIS DP DPR PRAD PA PO MID FAL FALD FFP1 FFD CDIR VARI AP1 |
| CYCLE71 | face | RTP RFP SDIS DP PA PO LENG WID STA MID MIDA FDP FALD FFP1 VARI FDP1 |
| CYCLE61 | face | RTP RFP SDIS DP PA PO LENG WID MID MIDA FALD FFP1 VARI LIM DMODE AMODE |

Behind these POCKET3, POCKET4 and CYCLE61 have the values of newer controls: GMODE, whose fourth digit says from where the
place counts, DMODE, whose first is the plane, and AMODE, whose digits say how depths and steps count. With them the fifth
value of POCKET4 is a diameter, which is said.
CDIR: 0 climb, 1 conventional, 2 by G2, 3 by G3. VARI, units: 1 roughing, 2 finishing (POCKET1, POCKET2, SLOT2: 0 both);
tens: 0 and 1 straight down, 2 on a helix, 3 to and fro. Source: SINUMERIK 840D sl/828D, Programming Manual Cycles (public).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from vmachining.nc.arcs import PLANES
from vmachining.nc.milled import ArcSlot, Cut, Face, Rounded, face, mill, stud_blank
from vmachining.nc.pen import Pen
from vmachining.nc.refusal import PenError, refused
from vmachining.nc.sinumerik.cycles import one_depth

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
        if (
            _digit(self.mode, 0) > 1
            or _digit(self.given.get("GMODE", 0.0), 3) > 1
            or (plane and PLANES.get(160 + 10 * plane) is not pen.plane)
        ):
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
        """How it is milled."""
        self.need("RTP", "MID")
        kind = int(self["VARI"])
        units, tens = _digit(kind, 0), _digit(kind, 1)
        old = self.name in _OLD
        if units > 2 or (units == 0 and not old):
            raise refused(
                f"{self.name} with VARI {kind}", self.name, "post the motions of the cycle as blocks"
            )
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
            cut = cut._replace(
                blank=stud_blank((along, across), abs(v["CRAD"]), (abs(v["AP1"]) / 2.0, abs(v["AP2"]) / 2.0))
            )
        mill(
            pen,
            Rounded(v["PA"], v["PO"], along, across, min(abs(v["CRAD"]), along, across), v["STA"]),
            cut,
            name,
        )


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
            raise PenError("E208", "CYCLE61 from another corner than zero: only AMODE says what its second is", v.name,
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
