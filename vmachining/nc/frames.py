"""Coordinate systems of programs: shifts, rotations, mirrors and scales, nested into one affine map.

A frame maps program coordinates to work coordinates, q = M p + o. Rotations about axes are right-handed.

Programmed circles, from end, centre words or radius word to a centre: their points are pairs (a, b) in the axis
order of the plane, mm. ccw: seen from the positive end of the third axis.
"""

from __future__ import annotations

import math
from typing import Final, NamedTuple, TypeAlias

from vmachining.nc.model import ArcError, Point
from vmachining.tolerance import ARC_RADIUS_MM, LENGTH_EPS_MM

Pair: TypeAlias = tuple[float, float]


class Plane(NamedTuple):
    """Name, first, second and normal axis (0 X, 1 Y, 2 Z), centre words of the two, the wrong centre word."""

    name: str
    first: int
    second: int
    normal: int
    words: tuple[str, str]
    wrong: str


PLANES: Final = {
    170: Plane("xy", 0, 1, 2, ("I", "J"), "K"),
    180: Plane("zx", 2, 0, 1, ("K", "I"), "J"),
    190: Plane("yz", 1, 2, 0, ("J", "K"), "I"),
}
"""By ten times the G code. ZX and not XZ: right-handed about +Y."""

RADIUS_ABSOLUTE_MM: Final = {False: 0.02 * math.sqrt(2.0), True: 0.002 * 25.4 * math.sqrt(2.0)}
"""Difference of the two radii that is always accepted; by whether the program is in inches. From the open
reference control: end point and centre are each rounded to 0.01 mm (0.001 inch), in both coordinates."""

RADIUS_RELATIVE: Final = 0.001
"""Beyond the absolute limit a difference up to this part of the radius is accepted, up to 100 such limits."""

SNAP_MM: Final = 0.002
"""A radius word may be shorter than half the chord by this much: two roundings to 0.001 mm."""


def center_from_radius(start: Pair, end: Pair, radius: float, ccw: bool) -> Pair:
    """Centre of the arc with the radius word: positive up to half a circle, negative beyond.

    h = sqrt(R^2 - d^2/4) from the middle of the chord along its left normal, on the left for a
    counter-clockwise minor arc.

    Raises ArcError: E305 radius shorter than half the chord, E306 start and end are one point.
    """
    da, db = end[0] - start[0], end[1] - start[1]
    chord = math.hypot(da, db)
    if chord < LENGTH_EPS_MM:
        raise ArcError("E306", "a full circle has no unique centre in the R form")
    half = chord / 2.0
    if abs(radius) < half - SNAP_MM:
        raise ArcError("E305", f"radius {abs(radius):.6g} mm is shorter than half the chord, {half:.6g} mm")
    height = math.sqrt(max(0.0, radius * radius - half * half))
    if (radius > 0.0) != ccw:
        height = -height
    middle = (start[0] + end[0]) / 2.0, (start[1] + end[1]) / 2.0
    return middle[0] - height * db / chord, middle[1] + height * da / chord


def check_center(start: Pair, end: Pair, center: Pair, inch: bool) -> float:
    """Difference of start and end radius, mm, if it is within the limits.

    Raises ArcError: E304 the radii differ, E308 the start is the centre.
    """
    begin = math.hypot(start[0] - center[0], start[1] - center[1])
    finish = math.hypot(end[0] - center[0], end[1] - center[1])
    if begin < LENGTH_EPS_MM:
        raise ArcError("E308", "the arc starts on its own centre")
    difference = abs(begin - finish)
    limit = RADIUS_ABSOLUTE_MM[inch]
    if difference > max(limit, min(100.0 * limit, RADIUS_RELATIVE * max(begin, finish))):
        raise ArcError("E304", f"radius {begin:.6g} mm at the start, {finish:.6g} mm at the end")
    return difference


def is_rounded(difference: float) -> bool:
    """Whether a difference of radii that is accepted deserves a warning."""
    return difference > ARC_RADIUS_MM


def swept(start: Pair, end: Pair, center: Pair, ccw: bool) -> float:
    """rad in [0, tau) from one point to another about the centre."""
    angle = math.atan2(end[1] - center[1], end[0] - center[0])
    angle -= math.atan2(start[1] - center[1], start[0] - center[0])
    return (angle if ccw else -angle) % math.tau


def arc_length(start: Pair, end: Pair, center: Pair, ccw: bool, turns: int, rise: float) -> float:
    """Length of the circle or helix, mm."""
    radius = math.hypot(start[0] - center[0], start[1] - center[1])
    whole = math.hypot(end[0] - start[0], end[1] - start[1]) < LENGTH_EPS_MM
    angle = math.tau if whole else swept(start, end, center, ccw)
    return math.hypot(radius * (angle + math.tau * (turns - 1)), rise)


Rows: TypeAlias = tuple[Point, Point, Point]

EYE: Final[Rows] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
UP: Final[Point] = (0.0, 0.0, 1.0)
SNAP: Final = 4e-16
"""cos 90 degrees is 6e-17 in floating point: matrices of right angles stay exact."""


def dot(a: Point, b: Point) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Point, b: Point) -> Point:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def unit(a: Point) -> Point | None:
    """a / |a|; None without length."""
    size = math.sqrt(dot(a, a))
    return (a[0] / size, a[1] / size, a[2] / size) if size > 1e-12 else None


def matmul(a: Rows, b: Rows) -> Rows:
    columns = tuple(zip(*b, strict=True))
    x, y, z = ((dot(r, columns[0]), dot(r, columns[1]), dot(r, columns[2])) for r in a)
    return x, y, z


def axis_turn(axis: int, degrees: float) -> Rows:
    """Rotation about X, Y or Z (0, 1, 2)."""
    angle = math.radians(degrees)
    c, s = (0.0 if abs(v) < SNAP else v for v in (math.cos(angle), math.sin(angle)))
    rows = [[1.0 if i == j else 0.0 for j in range(3)] for i in range(3)]
    a, b = (axis + 1) % 3, (axis + 2) % 3
    rows[a][a] = rows[b][b] = c
    rows[a][b], rows[b][a] = -s, s
    x, y, z = ((r[0], r[1], r[2]) for r in rows)
    return x, y, z


def columns(a: Point, b: Point, c: Point) -> Rows:
    """The matrix whose columns these are."""
    return (a[0], b[0], c[0]), (a[1], b[1], c[1]), (a[2], b[2], c[2])


def about(k: Point, p: Point, c: float, s: float) -> Point:
    """A point turned about a unit direction by an angle of this cosine and sine (Rodrigues)."""
    side, part = cross(k, p), dot(k, p) * (1.0 - c)
    return (
        c * p[0] + s * side[0] + part * k[0],
        c * p[1] + s * side[1] + part * k[1],
        c * p[2] + s * side[2] + part * k[2],
    )


class Frame(NamedTuple):
    """q = matrix p + origin. scale : of lengths, where it is the same in all directions, else 0.

    flip : Z is mirrored, which does not turn the tool round.
    """

    matrix: Rows = EYE
    origin: Point = (0.0, 0.0, 0.0)
    scale: float = 1.0
    flip: bool = False

    @property
    def plain(self) -> bool:
        """Only a shift."""
        return self.matrix == EYE

    @property
    def mirrored(self) -> bool:
        """Whether left and right change places."""
        m = self.matrix
        return dot(m[0], cross(m[1], m[2])) < 0.0

    @property
    def axis(self) -> Point:
        """Unit direction of the tool axis."""
        return self.direction((0.0, 0.0, -1.0) if self.flip else UP)

    def apply(self, p: Point) -> Point:
        """Work coordinates."""
        m, o = self.matrix, self.origin
        if m == EYE:
            return p[0] + o[0], p[1] + o[1], p[2] + o[2]
        return dot(m[0], p) + o[0], dot(m[1], p) + o[1], dot(m[2], p) + o[2]

    def vector(self, p: Point) -> Point:
        """The linear part alone."""
        m = self.matrix
        return dot(m[0], p), dot(m[1], p), dot(m[2], p)

    def into(self, q: Point) -> Point:
        """A vector of work coordinates in this system, where it is a rotation."""
        x, y, z = (dot(q, column) for column in zip(*self.matrix, strict=True))
        return x, y, z

    def direction(self, p: Point) -> Point:
        """Unit vector that a direction becomes."""
        out = unit(self.vector(p))
        assert out is not None  # no frame is singular: scales are above zero
        x, y, z = (0.0 if abs(v) < SNAP else v for v in out)
        return x, y, z

    def invert(self, q: Point) -> Point:
        """Program coordinates."""
        d = q[0] - self.origin[0], q[1] - self.origin[1], q[2] - self.origin[2]
        if self.matrix == EYE:
            return d
        c0, c1, c2 = zip(*self.matrix, strict=True)
        volume = dot(c0, cross(c1, c2))
        return (
            dot(cross(c1, c2), d) / volume,
            dot(cross(c2, c0), d) / volume,
            dot(cross(c0, c1), d) / volume,
        )

    def then(self, inner: Frame) -> Frame:
        """The frame of something programmed in `inner`, which itself lies in this one."""
        rows, origin = matmul(self.matrix, inner.matrix), self.apply(inner.origin)
        return Frame(rows, origin, self.scale * inner.scale, self.flip != inner.flip)

    def shifted(self, by: Point) -> Frame:
        """Shifted along its own axes."""
        return self.then(Frame(origin=by))

    def turned(self, rows: Rows) -> Frame:
        """Turned about its own origin."""
        return self.then(Frame(rows))

    def scaled(self, x: float, y: float, z: float) -> Frame:
        """Scaled about its own origin; negative factors mirror."""
        same = abs(x) == abs(y) == abs(z)
        rows = ((x, 0.0, 0.0), (0.0, y, 0.0), (0.0, 0.0, z))
        return self.then(Frame(rows, scale=abs(x) if same else 0.0, flip=z < 0.0))


IDENTITY: Final = Frame()
