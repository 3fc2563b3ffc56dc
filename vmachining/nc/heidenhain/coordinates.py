"""Where program coordinates lie: cycles 7, 8, 10, 11, 19 and 26, PLANE, TRANS; see `planes.py`."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Final

from vmachining.nc.frames import EYE, IDENTITY, Rows, axis_turn, cross, matmul
from vmachining.nc.heidenhain.contour import AXES, Contour
from vmachining.nc.heidenhain.flow import Flow
from vmachining.nc.heidenhain.planes import euler, projected, spatial, vectors
from vmachining.nc.heidenhain.text import TERM, Word, words
from vmachining.nc.model import PenError, misread, refused

_ANGLE: Final = re.compile(rf"\b(I?[A-Z]{{1,6}})\s*{TERM}(?![\w.])")
_POINT: Final = re.compile(rf"\b(P[123][XYZ])\s*{TERM}")
_TILTS: Final = ("q120", "q121", "q122")

_BY_ANGLES: Final[dict[str, tuple[Callable[[float, float, float], Rows], tuple[str, ...]]]] = {
    "SPATIAL": (spatial, ("SPA", "SPB", "SPC")), "EULER": (euler, ("EULPR", "EULNU", "EULROT")),
    "PROJECTED": (projected, ("PROPR", "PROMIN", "ROT")),
}  # fmt: skip
"""Planes by three angles: their rotation, and the words of the angles."""


def _whole(text: str) -> list[Word]:
    """Words of a text that consists of nothing else."""
    found, left = words(text)
    if left:
        raise misread(left[:40])
    return found


class Coordinates(Flow):
    """Coordinate systems of a conversational program."""

    contour: Contour

    def _cycle_7(self, rest: str) -> None:
        if "#" in rest:
            what = "the datum table (cycle 7 with #) is not available"
            raise PenError("E208", what, rest[:20], "write the shift as X Y Z")
        given: dict[int, tuple[float, bool]] = {}
        for word in _whole(rest):
            if word.key in AXES:
                given[AXES[word.key]] = self.q.number(word.value) * self.pen.scale, word.incremental
            elif word.key in "ABCUVW" and self.q.number(word.value) != 0.0:
                raise refused(f"a datum shift of axis {word.key}", word.text)
        if given:
            self._replan(lambda: self.planes.datum(given))

    def _cycle_8(self, rest: str) -> None:
        letters = set(rest.replace(" ", ""))
        if letters - set("XYZABC"):
            raise misread(rest[:40])
        if letters & set("ABC"):
            raise PenError("E208", "mirrored rotary axes are not supported", rest[:20])
        factors = [-1.0 if letter in letters else 1.0 for letter in "XYZ"]
        self._replan(lambda: self.planes.define("mirror", IDENTITY.scaled(*factors)))

    rotation = 0.0

    def _cycle_10(self, rest: str) -> None:
        found = re.fullmatch(rf"\s*(I?)ROT\s*{TERM}\s*", rest)
        if found is None:
            raise PenError("E109", f"'{rest[:40]}' of cycle 10 is not understood", rest[:40])
        angle = self.q.number(found[2]) + (self.rotation if found[1] else 0.0)
        rows = EYE if angle % 360.0 == 0.0 else axis_turn(2, angle)
        self._replan(lambda: self.planes.define("rotation", IDENTITY.turned(rows)))
        self.rotation = angle

    def _cycle_11(self, rest: str) -> None:
        found = re.fullmatch(rf"\s*SCL\s*{TERM}\s*", rest)
        factor = self.q.number(found[1]) if found else 0.0
        if not 1e-6 <= factor <= 1e6:
            raise PenError("E109", "cycle 11 needs SCL with a factor above zero", rest[:20])
        self._replan(lambda: self.planes.define("scale", IDENTITY.scaled(factor, factor, factor)))

    def _cycle_26(self, rest: str) -> None:
        factors, pole = [1.0, 1.0, 1.0], [0.0, 0.0, 0.0]
        for word in _whole(rest.replace("CCX", " U").replace("CCY", " V")):
            if word.key in AXES:
                factors[AXES[word.key]] = self.q.number(word.value)
            elif word.key in "UV":
                pole["UV".index(word.key)] = self.q.number(word.value) * self.pen.scale
        if any(not 1e-6 <= f <= 1e6 for f in factors):
            raise PenError("E109", "cycle 26 needs factors above zero", rest[:20])
        frame = IDENTITY if factors == [1.0, 1.0, 1.0] else (
            IDENTITY.shifted((pole[0], pole[1], pole[2])).scaled(*factors).shifted((-pole[0], -pole[1], -pole[2]))
        )  # fmt: skip
        self._replan(lambda: self.planes.define("scale of axes", frame))

    def _cycle_19(self, rest: str) -> None:
        angles = {w.key: self.q.number(w.value) for w in _whole(rest) if w.key in "ABC"}
        self._tilt(spatial(*(angles.get(k, 0.0) for k in "ABC")), "stay")

    def _tilt(self, rows: Rows, how: str) -> None:
        self._replan(lambda: self.planes.tilt(rows), pivot=how == "move")
        if how != "stay":
            self.pen.rotary = dict.fromkeys(self.pen.rotary, 0.0) if rows == EYE else self.pen.rotary

    def _replan(self, change: Callable[[], None], *, pivot: bool = False) -> None:
        kept = list(self.planes.chain), dict(self.planes.shift)
        try:
            change()
            self.pen.set_frame(self.planes.frame(), pivot=pivot)
        except PenError:
            self.planes.chain, self.planes.shift = kept
            raise

    def reached(self, value: str) -> bool:
        """Whether a rotary word only goes to the angle that a tilted plane asked for (Q120 to Q122)."""
        return self.planes.tilted and value.lower().lstrip("+") in _TILTS

    def _do_plane(self, text: str) -> None:
        found = re.match(r"PLANE\s+([A-Z]+)\s*(.*)", text)
        kind, rest = (found[1], found[2]) if found else ("", "")
        how = "move" if re.search(r"\bMOVE\b", rest) else "turn" if re.search(r"\bTURN\b", rest) else "stay"
        if kind == "RESET":
            self._tilt(EYE, how)
            return
        values = {}
        for key, value in (_POINT if kind == "POINTS" else _ANGLE).findall(rest):
            if key not in ("F", "FMAX", "MB", "DIST", "SEQ"):
                values[key] = self.q.number(value)

        def of(*names: str) -> list[float]:
            missing = next((name for name in names if name not in values), None)
            if missing is not None:
                what = f"write {missing} and its number"
                raise PenError("E109", f"PLANE {kind} needs {missing}", "PLANE", what)
            return [values[name] for name in names]

        if kind in _BY_ANGLES:
            turn, names = _BY_ANGLES[kind]
            rows = turn(*of(*names))
        elif kind == "VECTOR":
            b, n = of("BX", "BY", "BZ"), of("NX", "NY", "NZ")
            rows = vectors((b[0], b[1], b[2]), (n[0], n[1], n[2]))
        elif kind == "POINTS":
            p, q, r = (tuple(of(*(f"P{k}{axis}" for axis in "XYZ"))) for k in "123")
            x, y = ((b[0] - p[0], b[1] - p[1], b[2] - p[2]) for b in (q, r))
            rows = vectors(x, cross(x, y))
        elif kind == "AXIAL":
            turned = [k for k in "ABC" if values.get(k)]
            if len(turned) > 1 or turned == ["C"]:
                raise PenError("E208", "PLANE AXIAL of more than A or B alone depends on the kinematics", "PLANE AXIAL",
                               "post it as PLANE SPATIAL")  # fmt: skip
            rows = axis_turn("AB".index(turned[0]), values[turned[0]]) if turned else EYE
            if turned:
                self.pen.note("W374", f"PLANE AXIAL {turned[0]}: the axis is taken to turn about {'XY'['AB'.index(turned[0])]}",
                              "PLANE AXIAL", once="axial")  # fmt: skip
        elif kind in ("RELATIV", "RELATIVE"):
            given = [k for k in ("SPA", "SPB", "SPC") if k in values]
            if len(given) != 1:
                raise PenError("E109", "PLANE RELATIV takes one angle", "PLANE")
            rows = matmul(self.planes.rotation, axis_turn("ABC".index(given[0][2]), values[given[0]]))
        else:
            raise refused(f"PLANE {kind}", f"PLANE {kind}", "post it as PLANE SPATIAL")
        self._tilt(rows, how)

    def _do_trans(self, text: str) -> None:
        found = re.match(r"TRANS\s+(DATUM|MIRROR|ROTATION|SCALE)\s+(AXIS|RESET|I?ROT|SCL)\b\s*(.*)", text)
        found = found or re.match(r"TRANS\s+(ROTATION|SCALE)\s+(I?ROT|SCL)()", text)
        if found is None:
            raise refused(f"{text[:40]}", text[:30])
        reset = found[2] == "RESET"
        if found[1] == "DATUM" and reset:
            self._replan(lambda: self.planes.datum(dict.fromkeys(range(3), (0.0, False))))
        elif found[1] == "DATUM":
            self._cycle_7(found[3])
        elif found[1] == "MIRROR":
            self._cycle_8("" if reset else found[3])
        elif found[1] == "ROTATION":
            self._cycle_10("ROT+0" if reset else text.split("ROTATION")[1])
        else:
            self._cycle_11("SCL1" if reset else text.split("SCALE")[1])
