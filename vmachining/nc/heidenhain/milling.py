"""Cycles 251 to 254, 256, 257 and 232: pockets, slots, studs and faces; how they are milled is in `nc/milled.py`.

| cycle | shape | where the tool stands when it is called |
|---|---|---|
| 251, 256 | rectangle Q218 by Q219, corners Q220, turned by Q224 | Q367: middle, or a corner from the lower left on |
| 252, 257 | circle Q223 | middle |
| 253 | slot Q218 by Q219, turned by Q374 | Q367: middle, left end, left arc, right arc, right end |
| 254 | Q377 arcs of width Q219 on the circle Q375 about Q216 Q217 from Q376 over Q248, Q378 apart | Q367=0: anywhere |
| 232 | face from Q225 Q226 over Q218 Q219, from Q227 down to Q386, by Q389 | anywhere |

Q215: 0 roughing and finishing, 1 or 2 alone. Q368 and Q369 are allowances, Q202 and Q338 cuts, Q207 Q206 Q385 feeds, Q351
the sense, Q370 times the tool radius the step, Q366 the way in: straight, on a helix, to and fro. Blanks of studs: Q424 Q425,
Q222. Source: HEIDENHAIN TNC 640, user's manual cycle programming (public).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Final

from vmachining.nc.heidenhain.cycles import need
from vmachining.nc.milled import ArcSlot, Cut, Face, Rounded, face, mill, stud_blank
from vmachining.nc.model import PenError, refused
from vmachining.nc.offset_curves import Pair
from vmachining.nc.pen import Pen

BUILT: Final = frozenset({232, 251, 252, 253, 254, 256, 257})

Values = Mapping[str, float]


class _Cycle:
    """One call: lengths in mm."""

    def __init__(self, pen: Pen, number: int, values: Values, surface: float) -> None:
        self.pen, self.number, self.values = pen, number, values
        self.top = self.length("Q203") + surface
        self.at: Pair = (pen.at[0], pen.at[1])

    def length(self, name: str) -> float:
        return self.values.get(name, 0.0) * self.pen.scale

    def need(self, *names: str) -> None:
        need(f"cycle {self.number}", self.values, *names)

    def from_tool(self, u: float, v: float, turn: float) -> Pair:
        """A place beside the tool in the turned directions of the shape."""
        c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        return self.at[0] + c * u - s * v, self.at[1] + s * u + c * v

    def place(self, most: int) -> int:
        """Q367."""
        at = self.values.get("Q367", 0.0)
        if at != int(at) or not 0 <= at <= most:
            raise refused(f"cycle {self.number} with Q367={at:g}", "Q367", "call it in the middle")
        return int(at)

    def cut(self, plunge: str) -> Cut:
        self.need("Q201", "Q202", "Q200")
        depth, kind = self.length("Q201"), self.values.get("Q215", 1.0 if self.number in (256, 257) else 0.0)
        if depth > 0.0:
            raise PenError("E337", f"cycle {self.number} mills upwards: Q201 is above zero", "Q201")
        if kind not in (0.0, 1.0, 2.0):
            raise refused(f"cycle {self.number} with Q215={kind:g}", "Q215")
        clearance = abs(self.length("Q200"))
        radius = self.pen.radius() if self.pen.has_radius() else 0.0
        return Cut(
            safe=self.top + clearance, top=self.top, bottom=self.top + depth,
            back=self.top + max(self.length("Q204"), clearance), feed=self.length("Q207") or None,
            down=self.length("Q206") or None,
            most=abs(self.length("Q202")), step=self.values.get("Q370", 1.0) * radius, rough=kind != 2.0, finish=kind != 1.0,
            side=self.length("Q368"), floor=self.length("Q369"), finish_most=abs(self.length("Q338")),
            finish_feed=self.length("Q385") or None, plunge=plunge, climb=self.values.get("Q351", 1.0) >= 0.0,
            outside=self.number in (256, 257),
        )  # fmt: skip


def milled(pen: Pen, number: int, values: Values, surface: float = 0.0) -> None:
    """A milling cycle where the tool stands; surface : mm, added to Q203.

    Raises PenError: E208, E331, E333, E337, E339, E344, E351, E354
    """
    job = _Cycle(pen, number, values, surface)
    if number != 232 and values.get("Q201", -1.0) == 0.0:
        return  # depth zero: the control does not execute the cycle
    if number == 232:
        _face(job)
    elif number == 254:
        _arcs(job)
    else:
        shape, cut = _shape(job)
        mill(pen, shape, cut, f"cycle {number}")


def _shape(job: _Cycle) -> tuple[Rounded, Cut]:
    way = ("down", "helix", "ramp")[min(2, int(job.values.get("Q366", 0.0)))]
    if job.number in (252, 257):
        job.need("Q223")
        radius, cut = job.length("Q223") / 2.0, job.cut(way)
        if cut.outside:
            cut = cut._replace(blank=max(0.0, job.length("Q222") / 2.0 - radius))
        return Rounded(*job.at, radius, radius, radius), cut
    job.need("Q218", "Q219")
    along, across = abs(job.length("Q218")) / 2.0, abs(job.length("Q219")) / 2.0
    if job.number == 253:
        turn, reach = job.values.get("Q374", 0.0), along - across
        if reach < 0.0:
            raise PenError("E339", "cycle 253: a slot is not wider than long", "Q219")
        middle = job.from_tool((0.0, along, reach, -reach, -along)[job.place(4)], 0.0, turn)
        return Rounded(*middle, along, across, across, turn), job.cut("down" if way == "down" else "ramp")
    turn, corner = job.values.get("Q224", 0.0), job.length("Q220")
    if corner < 0.0:
        raise refused("cycle 256 with chamfers (Q220 below zero)", "Q220")
    u, v = ((0.0, 0.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))[job.place(4)]
    cut = job.cut(way)
    if cut.outside:
        blank = job.length("Q424") / 2.0, job.length("Q425") / 2.0
        cut = cut._replace(blank=stud_blank((along, across), corner, blank))
    middle, corner = job.from_tool(u * along, v * across, turn), min(corner, along, across)
    return Rounded(*middle, along, across, corner, turn), cut


def _arcs(job: _Cycle) -> None:
    job.need("Q219", "Q375", "Q216", "Q217", "Q376", "Q248")
    job.place(0)
    count = job.values.get("Q377", 1.0)
    if not 1.0 <= count <= 1000.0 or count != int(count):
        raise PenError("E342", "Q377 is not a whole number of slots", "Q377")
    cut, v = job.cut("down"), job.values
    for k in range(int(count)):
        first = v["Q376"] + k * v.get("Q378", 0.0)
        x, y, across, width = map(job.length, ("Q216", "Q217", "Q375", "Q219"))
        slot = ArcSlot(x, y, across / 2.0, width / 2.0, first, v["Q248"])
        mill(job.pen, slot, cut._replace(back=cut.back if k + 1 == count else cut.safe), "cycle 254")


def _face(job: _Cycle) -> None:
    job.need("Q225", "Q226", "Q227", "Q386", "Q218", "Q219", "Q202", "Q200")
    way = job.values.get("Q389", 0.0)
    if way not in (0.0, 1.0, 2.0):
        raise refused(f"cycle 232 with Q389={way:g}", "Q389")
    top, bottom, floor = job.length("Q227"), job.length("Q386"), job.length("Q369")
    radius = job.pen.radius() if job.pen.has_radius() else 0.0
    # the step of the manual: the factor times the tool radius, so that passes overlap evenly
    cut = Cut(
        safe=top + job.length("Q200"), top=top, bottom=bottom, back=max(job.length("Q204"), top + job.length("Q200")),
        feed=job.length("Q207") or None, down=job.length("Q253") or None, most=abs(job.length("Q202")),
        step=job.values.get("Q370", 1.0) * radius, floor=floor, even=True,
    )  # fmt: skip
    area = Face(
        job.length("Q225"), job.length("Q226"), job.length("Q218"), job.length("Q219"), 0.0,
        job.length("Q357") if way != 1.0 else -2.0 * radius, way != 2.0,
    )  # fmt: skip
    face(job.pen, area, cut, "cycle 232")
    if floor > 0.0:
        last = cut._replace(rough=False, floor=0.0, top=bottom + floor, feed=job.length("Q385") or cut.feed)
        face(job.pen, area, last, "cycle 232")
