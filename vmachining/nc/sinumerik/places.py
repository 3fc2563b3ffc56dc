"""Where program coordinates lie: settable offsets, TRANS ROT SCALE MIRROR, swivelled planes.

Frames, from the machine inward: work offset, swivelled plane (CYCLE800), TRANS ROT SCALE MIRROR in the order they were
programmed. ROT of several angles turns about Z, then the new Y, then the new X: R = Rz Ry Rx. The tool leans with
CYCLE800; under TRAORI with turned axes it is taken to stand along Z of a frame that ROT tilted, and that is said (W369).
Source: SINUMERIK 840D sl/828D, Programming Manuals Fundamentals, Job Planning and Cycles (public).

What programs for lathes say beside the words of mills:

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

from vmachining.nc.fanuc_lines import as_lathe
from vmachining.nc.findings import finding
from vmachining.nc.frames import EYE, IDENTITY, UP, Frame, Rows, axis_turn, matmul
from vmachining.nc.model import Finding, PenError, Point, misread, refused
from vmachining.nc.settings import Settings
from vmachining.nc.sinumerik.control import Flow
from vmachining.nc.sinumerik.text import AXES, ROTARY, words

OF_JOB: Final = {54.0: 540, 55.0: 550, 56.0: 560, 57.0: 570, 505.0: 580, 506.0: 590}
"""Settable offsets that the job can give, as G54 to G59."""


class Places(Flow):
    """Frames of a program."""

    def __init__(self, lines: Sequence[str], settings: Settings) -> None:
        super().__init__(lines, settings)
        self.work: float | None = None
        self.home_zero: Point | None = None
        """Of the first offset, where the program itself gives the offsets: the zero of the job."""
        self.basic_moved = False
        """Motions under G500, which knows no offset."""
        self.first_work: float | None = None
        self.offset = self.swivel = self.program = IDENTITY

    def _place(self) -> None:
        """The frames in force, and the tool axis in them."""
        pen = self.pen
        frame = self.offset.then(self.swivel).then(self.program)
        lean = self.swivel.axis
        if pen.tcp and frame.axis != UP and lean == UP and any(pen.rotary.values()):
            lean = frame.axis
            text = "the tool is assumed to point along Z of the turned frame: whether the axes reach that is not checked"
            pen.note("W369", text, once="frame")
        if pen.compensation is not None and frame != pen.frame:
            raise PenError("E359", "the coordinate system cannot change under cutter compensation")
        pen.set_frame(frame, lean=None if lean == frame.axis else lean)

    def _transform(self, name: str, rest: str) -> None:
        additive, kind = name.startswith("A"), name.removeprefix("A")
        given: dict[int, float] = {}
        pen = self.pen
        found, left = words(rest)
        if left:
            raise misread(left[:30])
        spin = None
        for word in found:
            if word.name in AXES and word.kind in ("word", "set"):
                given[AXES[word.name]] = self.number(word.value, word.text)
            elif word.name == "RPL":
                spin = self.number(word.value, word.text)
            elif word.name in ROTARY and kind == "TRANS" and self.number(word.value, word.text) == 0.0:
                continue
            else:
                raise refused(f"{name} of {word.text[:20]}", word.text)
        if kind == "TRANS":
            k = pen.scale
            step = Frame(origin=(given.get(0, 0.0) * k, given.get(1, 0.0) * k, given.get(2, 0.0) * k))
        elif kind == "ROT":
            rows: Rows = EYE
            if spin is not None:
                rows = axis_turn(pen.plane.normal, spin)
            for axis in (2, 1, 0):
                if given.get(axis):
                    rows = matmul(rows, axis_turn(axis, given[axis]))
            step = Frame(rows)
        elif kind == "SCALE":
            factors = [given.get(axis, 1.0) for axis in range(3)]
            if any(not 1e-6 <= f <= 1e6 for f in factors):
                raise PenError("E109", "SCALE needs factors above zero", rest[:20])
            step = IDENTITY.scaled(*factors)
        else:
            step = IDENTITY.scaled(*(-1.0 if axis in given else 1.0 for axis in range(3)))
        kept = self.program
        self.program = self.program.then(step) if additive else step
        try:
            self._place()
        except PenError:
            self.program = kept
            raise

    def zero_changed(self) -> None:
        """A settable offset has another value from its next G54 on."""
        if self.first_work is not None and self.home_zero is None:
            raise PenError("E208", "$P_UIFR sets an offset after use of an offset whose position is not given", "$P_UIFR",
                           "set it before the first G54")  # fmt: skip
        self.work = None

    def _work_offset(self, code: float) -> None:
        pen = self.pen
        if code == self.work:
            return
        if self.basic_moved:
            what = f"G{code:g} after motions under G500: the distance between them is not given"
            raise PenError("E368", what, f"G{code:g}")
        index = {54.0: 1, 55.0: 2, 56.0: 3, 57.0: 4}.get(code, int(code) - 500)
        own = self.zeros.get(index)
        if own is not None and (self.first_work is None or self.home_zero is not None):
            here = own.get("X", 0.0), own.get("Y", 0.0), own.get("Z", 0.0)
            home = self.home_zero = self.home_zero or here
            self.work, self.first_work = code, self.first_work or code
            self.offset = IDENTITY.shifted((here[0] - home[0], here[1] - home[1], here[2] - home[2]))
            pen.flush()
            self._place()
            return
        known = self.settings.work_offsets
        first = self.first_work if self.first_work is not None else code
        there, base = known.get(OF_JOB.get(code, -1)), known.get(OF_JOB.get(first, -1))
        self.offset = IDENTITY
        if code != first and there is not None and base is not None:
            self.offset = Frame(origin=(there[0] - base[0], there[1] - base[1], there[2] - base[2]))
        elif code != first:
            pen.note("W368", "a second work offset: its distance from the first is not given; both are assumed to be the same",
                     f"G{code:g}", once=f"{code:g}")  # fmt: skip
        self.work, self.first_work = code, first
        pen.flush()
        self._place()

    def _cycle800(self, given: list[str]) -> None:
        v = [self._maybe(text) for text in given] + [None] * 16
        if not given:
            self.swivel = self.program = IDENTITY
            self._place()
            return
        mode, additive = int(v[3] or 0.0), int(v[2] or 0.0) % 10 == 1
        numbers = [0.0 if x is None else x for x in v[4:13]]
        k = self.pen.scale
        if mode // 64 == 3 and any(numbers[3:6]):
            raise refused("CYCLE800 by the angles of the machine's axes", "CYCLE800", "post it axis by axis")
        if mode // 64 == 2:
            raise refused(f"CYCLE800 with mode {mode}", "CYCLE800", "post it axis by axis")
        rows: Rows = EYE
        if mode // 64 == 3:
            pass  # all angles are zero
        elif mode // 64 == 0:
            for place in range(3):
                axis = (mode >> 2 * place & 3) - 1
                if numbers[3 + place]:
                    if axis < 0:
                        what = f"CYCLE800: mode {mode} names no axis for an angle"
                        raise PenError("E109", what, "CYCLE800")
                    rows = matmul(rows, axis_turn(axis, numbers[3 + place]))
        else:  # solid angle: turned about Z by the first, tilted about the new Y by the second
            rows = matmul(axis_turn(2, numbers[3]), axis_turn(1, numbers[4]))
        step = IDENTITY.shifted((numbers[0] * k, numbers[1] * k, numbers[2] * k)).turned(rows)
        step = step.shifted((numbers[6] * k, numbers[7] * k, numbers[8] * k))
        kept = self.swivel, self.program
        self.swivel = self.swivel.then(self.program).then(step) if additive else step
        self.program = IDENTITY
        if step.matrix == EYE and not additive:
            self.pen.rotary = dict.fromkeys(self.pen.rotary, 0.0)
        try:
            self._place()
        except PenError:
            self.swivel, self.program = kept
            raise

    def _maybe(self, text: str) -> float | None:
        return None if not text or text.startswith('"') else self.number(text)


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
            what = f"G96 without a limit by LIMS: the spindle is assumed to turn at {FASTEST_RPM:g} rev/min at most"
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
        pen.turned, pen.last = dict(pen.rotary), pen.frame.apply(pen.at)
        pen.in_joints = any(pen.rotary.values())
        self.on_face = on
