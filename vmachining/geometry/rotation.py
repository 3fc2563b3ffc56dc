"""Rotations and directions, accurate for small angles. Angles rad, right-handed, active, column vectors."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats

UNIT = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
"""Coordinate directions by letter."""


def unit(vector: ArrayLike) -> Floats:
    """(..., 3) directions of length one. ValueError for a zero vector."""
    v = np.asarray(vector, dtype=np.float64)
    size = np.linalg.norm(v, axis=-1, keepdims=True)
    if not (size > 0).all():
        raise ValueError("a direction has no length")
    return np.asarray(v / size)


def rotation(axis: ArrayLike, angle: ArrayLike) -> Floats:
    """Matrices that turn by `angle` about the unit vector `axis` (Rodrigues).

    axis : (3,) unit
    angle : (...,) rad
    Returns (..., 3, 3)
    """
    x, y, z = np.asarray(axis, dtype=np.float64)
    a = np.asarray(angle, dtype=np.float64)[..., None, None]
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    # 1 - cos by the half angle keeps its digits near zero
    versine = 2.0 * np.sin(0.5 * a) ** 2
    return np.asarray(np.eye(3) + np.sin(a) * cross + versine * (cross @ cross))


def angle_between(a: ArrayLike, b: ArrayLike) -> Floats:
    """(...,) rad in [0, pi] between (..., 3) vectors; as accurate near 0 and pi as anywhere."""
    p, q = np.asarray(a, dtype=np.float64), np.asarray(b, dtype=np.float64)
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(p, q), axis=-1), (p * q).sum(axis=-1)))


def great_circle(start: ArrayLike, end: ArrayLike, t: ArrayLike) -> Floats:
    """Directions on the shorter great circle between two unit vectors at constant rate.

    start, end : (..., 3) unit
    t : (...,) in [0, 1], broadcast against the leading shape of the ends
    Returns (..., 3) unit
    Raises ValueError: Opposite directions: every great circle through one passes the other.
    """
    u, v = np.asarray(start, dtype=np.float64), np.asarray(end, dtype=np.float64)
    s = np.asarray(t, dtype=np.float64)[..., None]
    whole = angle_between(u, v)[..., None]
    if (np.pi - whole < 1e-9).any():
        raise ValueError("opposite directions: the great circle between them is not unique")
    # across: unit vector of the plane, perpendicular to u; any for equal directions, where it has no weight
    across = v - (u * v).sum(axis=-1, keepdims=True) * u
    size = np.linalg.norm(across, axis=-1, keepdims=True)
    across = np.divide(across, size, out=np.zeros_like(across), where=size > 0)
    out = np.cos(s * whole) * u + np.sin(s * whole) * across
    return np.asarray(out / np.linalg.norm(out, axis=-1, keepdims=True))
