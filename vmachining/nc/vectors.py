"""Sums and differences of points."""

from __future__ import annotations

from vmachining.nc.model import Point


def add(a: Point, b: Point) -> Point:
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def subtract(a: Point, b: Point) -> Point:
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]
