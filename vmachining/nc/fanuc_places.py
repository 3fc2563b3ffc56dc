"""Coordinates of the Fanuc family that are turned, scaled, mirrored or tilted, and registers that G10 writes.

    work = tilt (G68.2) o shift (Okuma G11) o turn (G68) o scale (G51) o mirror (G51.1) of what is programmed

The order of mirror, scaling and rotation is that of the operator's manual (0i/30i, "Coordinate system rotation"); G68.2
takes Euler angles ZXZ, with P1 roll, pitch and yaw in the order that Q names, with P2 three points in blocks of Q1 to Q3
(zero, a point of +X, one on the side of +Y), with P3 the directions of +X and +Z in blocks of Q1 and Q2; G68 with I J K
turns by R about that direction, and its X Y Z is the new zero.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

from vmachining.nc.fanuc_line import Line
from vmachining.nc.frames import (
    EYE,
    IDENTITY,
    UP,
    Frame,
    Rows,
    about,
    axis_turn,
    columns,
    cross,
    dot,
    matmul,
    unit,
)
from vmachining.nc.lexer import Word
from vmachining.nc.model import Point, add, subtract
from vmachining.nc.placing import swung
from vmachining.nc.state import ORIGIN, State

if TYPE_CHECKING:
    from vmachining.nc.fanuc import Translator

ORDER: Final = ("tilt", "shift", "turn", "scale", "mirror")
TAKEN: Final = {680: "XYZRIJK", 682: "XYZIJKPQR", 510: "XYZIJKP", 511: "XYZ"}
"""Letters of the codes that set a turn, a tilt, a scale, a mirror."""

TURNED: Final = 1e-4
"""Degrees: beyond it two angles differ."""


class Places:
    """The transformations in force."""

    def __init__(self) -> None:
        self.parts: dict[str, Frame] = {}
        self.mirrors: dict[int, float] = {}
        self.given: dict[int, tuple[Point, Point]] = {}
        """Points and directions of a plane that is not complete yet."""

    @property
    def tilted(self) -> bool:
        """Whether a tilted plane is in force."""
        return "tilt" in self.parts

    def end(self, kinds: str, line: Line) -> bool:
        """They are in force no more (of a mirror only the axes named, if any is); whether one was."""
        was = set(kinds.split()) & set(self.parts)
        if "tilt" in kinds:
            self.given = {}
        for kind in was:
            del self.parts[kind]
        if "mirror" in was:
            named = {axis for axis, letter in enumerate("XYZ") if letter in line.given}
            self.mirrors = {axis: at for axis, at in self.mirrors.items() if named and axis not in named}
            self._mirror()
        self._tell(line)
        if "tilt" in was:
            line.before.append(_angled)
        return bool(was)

    def rotary(self, translator: Translator, line: Line) -> None:
        """Words of rotary axes where a plane is, or was, in force: they reach its axis, or name what G53.1 has done.

        They would turn the tool away from it where they name other angles than those that it has.
        """
        if not self.tilted:
            line.pivot = UP
            return
        angles = {c.lower(): line.get(c) for c in "ABC" if c in line.given}
        axis, now = self.parts["tilt"].axis, line.state.rotary
        word = next(line.given[c][0] for c in "ABC" if c in line.given)
        stands = line.state.axis == axis
        if stands and any(abs(angles[c] - now[c]) > TURNED for c in angles.keys() & now.keys()):
            what = f"{word.text} turns the tool away from its tilted plane"
            line.refuse(word, what, "end the plane by G69")
        else:
            line.pivot = None if stands else axis
            what = f"{word.text}: the angles are assumed to reach the axis of the tilted plane"
            translator.say("rotary in tilt", word, what, "I213")
            line.after.append(lambda s: setattr(s, "rotary", {**s.rotary, **angles}))
        line.drop("ABC")

    def leaning(self, line: Line) -> None:
        """Motions in a plane that the turned table has not reached, and cuts after its end while the table still stands."""
        state, first = line.state, line.pairs[0][0] if line.pairs else None
        cuts = 0 not in line.codes and (line.codes & {0, 10, 20, 30} or state.motion)
        if self.tilted and any(state.rotary.values()) and state.axis == UP:
            what = "a tilted plane (G68.2) without G53.1 while rotary axes are turned"
            line.refuse(first, what, "write G53.1, or the rotary axes, after G68.2")
        elif state.axis != UP and not self.tilted and cuts:
            what = "a cut after the end of its tilted plane (G69), while the rotary axes stand as G53.1 has left them"
            line.refuse(first, what, "name the rotary axes, or cut before G69")

    def _tell(self, line: Line) -> None:
        plan = IDENTITY
        for kind in ORDER:
            plan = plan.then(self.parts.get(kind, IDENTITY))
        line.before.append(lambda state: state.replan(None if plan == IDENTITY else plan))

    def turn(self, word: Word, line: Line) -> None:
        """G68 with a centre in the plane and R, or about a direction I J K; in G91 R adds."""
        plane, here = line.state.plane, line.state.program
        if next((p for code, p in _PLANES.items() if code in line.now()), plane.normal) != plane.normal:
            what = "G68 together with the code of another plane"
            line.refuse(word, what, "choose the plane in an earlier block")
        elif "R" not in line.given:
            what = "G68 that is not a rotation by R is not supported"
            line.refuse(word, what, "G68.2 names a tilted plane")
        elif line.has("IJK"):
            axis_of = unit(_vector(line))
            if axis_of is None:
                line.refuse(word, "G68 about a direction I J K without length")
                return
            before = self.parts.get("turn", IDENTITY)  # a second one turns what the first has turned
            c, s = (f(math.radians(line.get("R"))) for f in (math.cos, math.sin))
            rows = columns(*(about(axis_of, e, c, s) for e in EYE))
            self.parts["turn"] = before.then(Frame(rows, line.at(default=here)))
            self._tell(line)
        else:
            center = [c if k != plane.normal else 0.0 for k, c in enumerate(line.at(default=here))]
            self._put("turn", axis_turn(plane.normal, line.get("R")), center, line)

    def tilt(self, word: Word, line: Line) -> None:
        """G68.2 X Y Z I J K, P2 and P3 in several blocks."""
        kind, zero, angles = line.get("P"), line.at(), _vector(line)
        what, hint = "", ""
        rows = EYE
        if kind == 0.0:
            i, j, k = angles
            rows = matmul(axis_turn(2, i), matmul(axis_turn(0, j), axis_turn(2, k)))
        elif kind == 1.0:
            order = f"{line.get('Q', 123.0):.0f}"
            if sorted(order) != ["1", "2", "3"]:
                line.refuse(line.given["Q"][0], f"G68.2 P1 Q{order}: Q orders the axes, 123 to 321")
                return
            for digit in order:
                axis = int(digit) - 1
                rows = matmul(axis_turn(axis, angles[axis]), rows)
        elif kind in (2.0, 3.0):
            number = int(line.get("Q", 1.0))
            self.given = {**(self.given if number > 1 else {}), number: (zero, angles)}
            if number == 0 and (any(zero) or line.get("R")):
                what, hint = "G68.2 P2 Q0 with a shift or a turn is not supported", "post Euler angles"
            elif number < 5 - kind or number == 0:
                return
            else:
                found = self._by_points() if kind == 2.0 else self._by_vectors()
                self.given = {}
                what = f"G68.2 P{kind:g}: its points or directions do not span a plane, or some are missing"
                if found is not None:
                    (rows, zero), what = found, ""
        else:
            what, hint = f"G68.2 P{kind:g}: planes by projected angles are not supported", "post Euler angles"
        if line.state.rotation and not what:
            what, hint = "G68.2 while the work offset is turned", "turn it back first"
        if what:
            line.refuse(word, what, hint)
            return
        self.parts["tilt"] = Frame(rows, zero)
        self._tell(line)

    def _by_points(self) -> tuple[Rows, Point] | None:
        """Axes and zero of the plane through the points of P2."""
        one, two, three = (self.given.get(k, (ORIGIN, ORIGIN))[0] for k in (1, 2, 3))
        along = unit(subtract(two, one))
        normal = unit(cross(along, subtract(three, one))) if along is not None else None
        if along is None or normal is None or len(set(self.given) & {1, 2, 3}) < 3:
            return None
        return columns(along, cross(normal, along), normal), one

    def _by_vectors(self) -> tuple[Rows, Point] | None:
        """The same of the directions of P3, which stand upright on each other to 5 degrees; +Z is kept."""
        if not {1, 2} <= set(self.given):
            return None
        along, normal = unit(self.given[1][1]), unit(self.given[2][1])
        side = unit(cross(normal, along)) if along is not None and normal is not None else None
        if along is None or normal is None or side is None:
            return None
        if abs(dot(along, normal)) > math.sin(math.radians(5.0)):
            return None
        return columns(cross(side, normal), side, normal), self.given[1][0]

    def shift(self, line: Line) -> None:
        """Okuma G11 X Y Z P: a shift, and a turn by P."""
        self.parts["shift"] = Frame(axis_turn(2, line.get("P")), line.at())
        self._tell(line)

    def scale(self, word: Word, line: Line) -> None:
        """G51 X Y Z P, or I J K for each axis; without a point they count thousandths."""
        by = [1.0, 1.0, 1.0]
        for axis, letter in enumerate("IJK" if line.has("IJK") else "PPP"):
            if letter in line.given:
                text, value = line.given[letter][0].text, line.get(letter)
                by[axis] = value if "." in text else value / 1000.0
        if 0.0 in by:
            line.refuse(word, "G51 with a factor of zero")
            return
        m = ((by[0], 0.0, 0.0), (0.0, by[1], 0.0), (0.0, 0.0, by[2]))
        self._put("scale", m, line.at(default=line.state.program), line, IDENTITY.scaled(*by))

    def mirror(self, given: Mapping[str, float], line: Line) -> None:
        """G51.1 X2: mirrored at x = 2 (given in mm); axes add up."""
        self.mirrors |= {"XYZ".index(letter): at for letter, at in given.items()}
        self._mirror()
        self._tell(line)

    def _mirror(self) -> None:
        self.parts.pop("mirror", None)
        if self.mirrors:
            by = [-1.0 if axis in self.mirrors else 1.0 for axis in range(3)]
            origin = [2.0 * self.mirrors.get(axis, 0.0) for axis in range(3)]
            made = IDENTITY.scaled(by[0], by[1], by[2])
            self.parts["mirror"] = made._replace(origin=(origin[0], origin[1], origin[2]))

    def _put(
        self, kind: str, rows: Rows, center: Sequence[float], line: Line, like: Frame = IDENTITY
    ) -> None:
        """A linear map about a centre."""
        turned = [sum(r * c for r, c in zip(row, center, strict=True)) for row in rows]
        x, y, z = (c - t for c, t in zip(center, turned, strict=True))
        self.parts[kind] = like._replace(matrix=rows, origin=(x, y, z))
        self._tell(line)


def _angled(state: State) -> None:
    """The tool leans by angles that the program has named: from here on they say how, no more the plane that ends."""
    if state.axis != UP and any(state.rotary.values()):
        state.sim = swung(state.axis, UP, state.sim)
        state.axis, state.machine = UP, add(state.sim, state.lag)
        state.check_sync()


def _vector(line: Line) -> Point:
    """I J K as they are written."""
    return line.get("I"), line.get("J"), line.get("K")


_PLANES: Final = {170: 2, 180: 1, 190: 0}


def polar(translator: Translator, line: Line) -> None:
    """G16: the first axis of the plane is a radius about the work zero, the second an angle; in G91 both are steps."""
    state, absolute = line.state, line.absolute
    if 150 in line.codes:
        translator.polar = None
        return
    a, b = state.plane.first, state.plane.second
    first, second = "XYZ"[a], "XYZ"[b]
    here = state.program
    if translator.polar is None:
        r = math.hypot(here[a], here[b]) / state.scale
        translator.polar = r, math.degrees(math.atan2(here[b], here[a]))
    if not {first, second} & line.letters():
        return
    radius, angle = line.value(first), line.value(second)
    old = translator.polar
    if not absolute:
        if radius is not None:
            what = "a radius in polar coordinates (G16) in G91 counts from where the tool is: not supported"
            line.refuse(line.word(first), what, "program the radius in G90")
            return
        angle = old[1] + (angle or 0.0)
    translator.polar = old[0] if radius is None else radius, old[1] if angle is None else angle
    like = line.word(first + second)
    line.drop(first + second)
    u, v = (translator.polar[0] * f(math.radians(translator.polar[1])) for f in (math.cos, math.sin))
    if not absolute:
        u, v = u - here[a] / state.scale, v - here[b] / state.scale
    line.add(first, u, like)
    line.add(second, v, like)
