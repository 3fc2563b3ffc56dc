"""Sums and differences of points, and points with other coordinates."""

from __future__ import annotations

from collections.abc import Mapping

from vmachining.nc.model import Point


def add(a: Point, b: Point) -> Point:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def subtract(a: Point, b: Point) -> Point:
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def put(a: Point, values: Mapping[int, float]) -> Point:
    """`a` with other coordinates along some axes."""
    return values.get(0, a[0]), values.get(1, a[1]), values.get(2, a[2])
