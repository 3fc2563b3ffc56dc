"""Where program coordinates lie on the part: datum shifts, mirrors, rotations, scales, tilted planes; PLANE and TRANS.

Cycles 7, 8, 10, 11, 26 and the tilted plane (cycle 19, PLANE) act in the order in which they were defined, each in
the coordinates that those before it left; a shift defined in a tilted plane lies in that plane, beside the one before it.
Where a transformation is defined anew while others that came after it are in force, the manuals leave the order open: that
is refused unless both orders mean the same.

Spatial angles turn about the axes of the untilted part, A first, then B, then C: R = Rz(C) Ry(B) Rx(A).
Source: HEIDENHAIN TNC 640, cycles 7 to 26 and the PLANE function (public user's manuals).
"""

from __future__ import annotations

import re
from collections.abc import Callable
from math import cos, radians, sin
from typing import Any, Final

from vmachining.nc.frames import EYE, IDENTITY, Frame, Rows, axis_turn, columns, cross, dot, matmul, unit
from vmachining.nc.heidenhain.contour import AXES, Contour
from vmachining.nc.heidenhain.flow import Flow
from vmachining.nc.heidenhain.text import TERM, Word, words
from vmachining.nc.model import PenError, Point, misread, put, refused

SAME = 1e-9


def spatial(a: float, b: float, c: float) -> Rows:
    """R = Rz(c) Ry(b) Rx(a); degrees."""
    return matmul(axis_turn(2, c), matmul(axis_turn(1, b), axis_turn(0, a)))


def euler(precession: float, nutation: float, rotation: float) -> Rows:
    """R = Rz Rx Rz: about Z, about the turned X, about the tilted Z; degrees."""
    return matmul(axis_turn(2, precession), matmul(axis_turn(0, nutation), axis_turn(2, rotation)))


def vectors(base: Point, normal: Point) -> Rows:
    """Plane with a normal, and X along the part of the base vector that lies in it.

    Raises PenError: E363 a vector without length, or both along one line.
    """
    z = unit(normal)
    if z is None or unit(base) is None:
        raise PenError("E363", "PLANE VECTOR: a vector has no length")
    along = dot(base, z)
    x = unit((base[0] - along * z[0], base[1] - along * z[1], base[2] - along * z[2]))
    if x is None:
        raise PenError("E363", "PLANE VECTOR: base and normal vector lie along one line")
    return columns(x, cross(z, x), z)


def projected(principal: float, minor: float, rotation: float) -> Rows:
    """Angles of the plane's traces in ZX and YZ, and the turn of its X axis; degrees."""
    a, b = radians(principal), radians(minor)
    x, y = (cos(a), 0.0, sin(a)), (0.0, cos(b), sin(b))
    return matmul(vectors(x, cross(x, y)), axis_turn(2, rotation))


class Planes:
    """Transformations in force, in the order they were defined: (kind, frame)."""

    def __init__(self) -> None:
        self.chain: list[tuple[str, Frame]] = []
        self.shift: dict[str, Point] = {}

    @property
    def tilted(self) -> bool:
        """Whether a tilted plane is in force."""
        return any(kind == "tilt" for kind, _ in self.chain)

    @property
    def rotation(self) -> Rows:
        """Of the tilted plane in force."""
        return next((frame.matrix for kind, frame in self.chain if kind == "tilt"), EYE)

    def frame(self) -> Frame:
        return _joined(self.chain)

    def define(self, kind: str, frame: Frame) -> None:
        """A transformation, or its end (the identity).

        Raises PenError: E367
        """
        place = next((k for k, (name, _) in enumerate(self.chain) if name == kind), None)
        rest = [item for item in self.chain if item[0] != kind]
        if frame == IDENTITY:
            self.chain = rest
            return
        last = [*rest, (kind, frame)]
        if place is not None and place < len(rest):
            kept = [*self.chain]
            kept[place] = (kind, frame)
            if not _same(_joined(kept), _joined(last)):
                raise PenError(
                    "E367", f"{kind} is defined again while a later {self.chain[-1][0]} is in force", "",
                    f"cancel the {self.chain[-1][0]} before, and define it again",
                )  # fmt: skip
        self.chain = last

    def datum(self, values: dict[int, tuple[float, bool]]) -> None:
        """Cycle 7: axis -> value, incremental."""
        kind = "shift in the plane" if self.tilted else "shift"
        old = self.shift.get(kind, (0.0, 0.0, 0.0))
        new = put(old, {axis: value + (old[axis] if step else 0.0) for axis, (value, step) in values.items()})
        self.define(kind, Frame(origin=new))
        self.shift[kind] = new

    def reset(self) -> None:
        """Another preset: what a tilted plane is not ends."""
        self.chain = [item for item in self.chain if item[0] == "tilt"]
        self.shift = {}

    def tilt(self, rows: Rows) -> None:
        """A plane, or none; what was defined in the old one goes with it."""
        if rows == EYE:
            before = [item for item in self.chain if item[0] != "tilt"]
            if self.tilted and any(k == "shift in the plane" for k, _ in self.chain):
                before = [item for item in before if item[0] != "shift in the plane"]
                self.shift.pop("shift in the plane", None)
            self.chain = before
            return
        if self.tilted:
            self.tilt(EYE)
        self.define("tilt", Frame(rows))


def _joined(chain: list[tuple[str, Frame]]) -> Frame:
    out = IDENTITY
    for _, frame in chain:
        out = out.then(frame)
    return out


def _same(a: Frame, b: Frame) -> bool:
    rows = [abs(x - y) for p, q in zip((*a.matrix, a.origin), (*b.matrix, b.origin), strict=True)
            for x, y in zip(p, q, strict=True)]  # fmt: skip
    return max(rows) < SAME


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

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.planes = Planes()

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
                self.pen.note("W374", f"PLANE AXIAL {turned[0]}: the axis is assumed to turn about {'XY'['AB'.index(turned[0])]}",
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
