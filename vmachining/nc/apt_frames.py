"""Circles and coordinate systems of cutter location files."""

from __future__ import annotations

from typing import Final, NamedTuple

from vmachining.nc.model import Point

UP: Final[Point] = (0.0, 0.0, 1.0)


class Circle(NamedTuple):
    """Of the next GOTO: counter-clockwise about the axis; radius : as the record says it, or None."""

    center: Point
    axis: Point
    radius: float | None


class Frame(NamedTuple):
    """A coordinate system: origin and axes, in that of the file."""

    origin: Point
    x: Point
    y: Point
    z: Point

    def out(self, vector: Point) -> Point:
        """A vector of this system, in that of the file."""
        return tuple(  # type: ignore[return-value]
            vector[0] * a + vector[1] * b + vector[2] * c
            for a, b, c in zip(self.x, self.y, self.z, strict=True)
        )

    def into(self, vector: Point) -> Point:
        """A vector of the file, in this system."""
        return dot(vector, self.x), dot(vector, self.y), dot(vector, self.z)


def dot(a: Point, b: Point) -> float:
    """a . b"""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a: Point, b: Point) -> Point:
    """a x b"""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def along(point: Point, axis: Point, height: float) -> Point:
    """point + height axis"""
    return point[0] + axis[0] * height, point[1] + axis[1] * height, point[2] + axis[2] * height
