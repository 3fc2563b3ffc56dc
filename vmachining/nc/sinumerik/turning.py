"""What programs for lathes say beside the words of mills: diameters, surface speed, threads, faces milled by C.

| words | reading |
|---|---|
| `DIAMON` | X words are diameters, absolute and incremental; I with AC too, other I K and CR are radii |
| `DIAM90` | absolute X words are diameters, incremental ones radii |
| `DIAMOF` | radii |
| `G96` `G961` `G962` S, `LIMS=` | m/min (ft/min in inch): the speed of the spindle at the end of each motion; `G97` ends it |
| `TRANSMIT` `TRAFOOF` | X Y on the face that C turns: the path on the part is the programmed one, C is no word any more |
| CYCLE92 to CYCLE99, CYCLE930, 940, 951, 952 | many passes: left out, and said (W379); the tool stays where they began |

Such a program is read, and no material is turned (W380). Before the first of DIAMON, DIAM90, DIAMOF the machine decides:
diameters, as lathes are delivered. Source: SINUMERIK 840D sl/828D, Programming Manual Fundamentals, "Dimensions for
turning" and "Constant cutting rate", Job Planning, "TRANSMIT" (public).
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Final, Literal

from vmachining.nc.checks import finding
from vmachining.nc.fanuc_turning import as_lathe
from vmachining.nc.model import Finding
from vmachining.nc.refusal import PenError
from vmachining.nc.settings import Settings
from vmachining.nc.sinumerik.places import Places

PASSES: Final = {
    "CYCLE92": "parting off", "CYCLE93": "grooves", "CYCLE94": "undercuts", "CYCLE95": "roughing",
    "CYCLE96": "thread undercuts", "CYCLE97": "threads", "CYCLE98": "chains of threads", "CYCLE99": "threads",
    "CYCLE930": "grooves", "CYCLE940": "undercuts", "CYCLE951": "roughing", "CYCLE952": "roughing of a contour",
}  # fmt: skip
FASTEST_RPM: Final = 4000.0
"""Where G96 has no limit: what lathes of middle size reach."""

_BARE: Final = re.compile(r'"[^"]*"|;.*')
_SURELY: Final = re.compile(
    r"(?<![A-Z0-9_])(?:DIAMON|DIAM90)A?(?![A-Z0-9_=])|CYCLE(?:9[2-9]|930|940|95[12])[ ]*\(", re.IGNORECASE
)
_LIKELY: Final = re.compile(r"(?<![A-Z0-9_])(?:G96[12]?(?![0-9.])|LIMS[ ]*=)", re.IGNORECASE)
_Y: Final = re.compile(r"(?<![A-Z0-9_])Y[ ]*=?[ ]*[-+]?(?=[0-9.]*[1-9])", re.IGNORECASE)

Diameters = Literal["", "all", "absolute"]


def as_turning(lines: Sequence[str], settings: Settings) -> tuple[Settings, list[Finding]]:
    """Settings for a program of a lathe and what is said of it; those given and nothing for one of a mill."""
    if settings.control.lathe == "mill":
        return settings, []
    bare = [_BARE.sub(" ", line) for line in lines]
    sure = any(map(_SURELY.search, bare)) or settings.control.lathe != ""
    if not sure and not (any(map(_LIKELY.search, bare)) and not any(map(_Y.search, bare))):
        return settings, []
    taken, (said,) = as_lathe(bare, settings, False)
    given = settings.control.lathe or "diameter"
    words = "diameters" if given == "diameter" else "radii"
    what = f"a program for turning, X words before DIAMON or DIAMOF are {words}: its path is read, no material is turned"
    hint = (
        f'confirm it: lathe = "{given}" under [program.control], or --control lathe=mill where it is a mill'
    )
    control = replace(taken.control, lathe=given)
    return replace(taken, control=control), [finding("W380", 1, None, what, hint=said.hint and hint)]


class Turning(Places):
    """Modes of a lathe."""

    def __init__(self, lines: Sequence[str], settings: Settings) -> None:
        super().__init__(lines, settings)
        self.lathe = settings.control.lathe in ("diameter", "radius")
        self.diameters: Diameters = "all" if settings.control.lathe == "diameter" else ""
        self.speed = 0.0
        self.surface: float | None = None
        """Of G96, in the unit of the program."""
        self.constant = False
        self.limit: float | None = None
        self.on_face = False

    def half(self, *, step: bool) -> float:
        """Factor of an X word; step : an incremental one."""
        return 0.5 if self.diameters == "all" or (self.diameters == "absolute" and not step) else 1.0

    def diameter_word(self, name: str) -> bool:
        """DIAMON and kin; False for another word."""
        kind = name.removesuffix("A") if name in ("DIAMONA", "DIAM90A", "DIAMOFA") else name
        if kind not in ("DIAMON", "DIAM90", "DIAMOF") or (kind != "DIAMOF" and not self.lathe):
            return False
        self.diameters = "all" if kind == "DIAMON" else "absolute" if kind == "DIAM90" else ""
        return True

    def set_surface(self, codes: Sequence[float]) -> None:
        """G96 and G97 of a block."""
        for code in codes:
            if code in (96.0, 961.0, 962.0):
                self.constant = True
            elif code in (97.0, 971.0, 973.0):
                self.constant, self.surface = False, None

    def at_radius(self, radius: float) -> None:
        """The speed of G96 at the end of a motion, mm."""
        if not self.constant or self.surface is None:
            return
        per = 12.0 * 25.4 if self.pen.scale != 1.0 else 1000.0
        wanted = self.surface * per / (math.tau * abs(radius)) if radius else math.inf
        if self.limit is None and wanted > FASTEST_RPM:
            what = f"G96 without a limit by LIMS: the spindle is taken to turn at {FASTEST_RPM:g} rev/min at most"
            self.pen.note("I213", what, "G96", once="G96 limit")
        self.speed = min(wanted, FASTEST_RPM if self.limit is None else self.limit)
        if self.pen.rpm:  # no flush: the segment that waits has its speed already
            self.pen.rpm = math.copysign(self.speed, self.pen.rpm)

    def left_out(self, name: str) -> None:
        """A cycle of many passes."""
        what = f"{name} ({PASSES[name]}): its passes are left out, the tool stays where they began"
        self.pen.note("W379", what, name, once=name)

    def transmit(self, on: bool) -> None:
        """The face in X Y in place of radius and C, and back: the tool stays."""
        pen = self.pen
        if on == self.on_face:
            return
        if pen.compensation is not None:
            raise PenError("E359", "TRANSMIT cannot change under cutter compensation", "TRANSMIT")
        pen.flush()
        x, y, z = pen.at
        if on:
            turn = math.radians(pen.rotary.get("c", 0.0))
            c, s = math.cos(turn), math.sin(turn)
            pen.at = c * x - s * y, s * x + c * y, z
            pen.rotary["c"] = 0.0
        else:
            pen.at = math.hypot(x, y), 0.0, z
            pen.rotary["c"] = math.degrees(math.atan2(y, x))
        pen.turned, pen.last, pen.in_joints = (
            dict(pen.rotary),
            pen.frame.apply(pen.at),
            any(pen.rotary.values()),
        )
        self.on_face = on
