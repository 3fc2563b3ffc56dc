"""Datum shifts, mirrors, rotations, scales and tilted planes: where program coordinates lie on the part.

Cycles 7, 8, 10, 11, 26 and the tilted plane (cycle 19, PLANE) act in the order in which they were defined, each in
the coordinates that those before it left; a shift defined in a tilted plane lies in that plane, beside the one before it.
Where a transformation is defined anew while others that came after it are in force, the manuals leave the order open: that
is refused unless both orders mean the same.

Spatial angles turn about the axes of the untilted part, A first, then B, then C: R = Rz(C) Ry(B) Rx(A).
Source: HEIDENHAIN TNC 640, cycles 7 to 26 and the PLANE function (public user's manuals).
"""

from __future__ import annotations

from math import cos, radians, sin

from vmachining.nc.frames import EYE, IDENTITY, Frame, Rows, axis_turn, columns, cross, dot, matmul, unit
from vmachining.nc.model import PenError, Point, put

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
        """All together."""
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
                    "E367", f"{kind} is defined anew while a later {self.chain[-1][0]} is in force", "",
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
