"""Tool axis, its rates and the angular velocity of the head models of chapter 3: serial C-A head and hexapod.

Both have the axis A = Rz(c) Rx(a) ez = (sin c sin a, -cos c sin a, cos a), eq. (3-5) with its first component
corrected. They differ by the spin about the tool axis, which no envelope sees.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.geometry.rotation import UNIT, rotation

__all__ = ["ca_acceleration", "ca_axis", "ca_omega", "ca_rate", "hexapod_matrix", "hexapod_omega"]


def ca_axis(a: ArrayLike, c: ArrayLike) -> Floats:
    """Tool axis (..., 3) of both models; angles rad."""
    ca, sa, cc, sc = _functions(a, c)
    return _stack(sc * sa, -cc * sa, ca)


def ca_rate(a: ArrayLike, c: ArrayLike, da: ArrayLike, dc: ArrayLike) -> Floats:
    """dA/dt (..., 3) of both models; da, dc rad per unit of time."""
    ca, sa, cc, sc = _functions(a, c)
    u, v = np.asarray(da, dtype=np.float64), np.asarray(dc, dtype=np.float64)
    return _stack(v * cc * sa + u * sc * ca, v * sc * sa - u * cc * ca, -u * sa)


def ca_acceleration(a: ArrayLike, c: ArrayLike, da: ArrayLike, dc: ArrayLike) -> Floats:
    """d2A/dt2 (..., 3) of both models at constant da, dc."""
    ca, sa, cc, sc = _functions(a, c)
    u, v = np.asarray(da, dtype=np.float64), np.asarray(dc, dtype=np.float64)
    both, pull = 2.0 * u * v * ca, u * u + v * v
    return _stack(both * cc - pull * sc * sa, both * sc + pull * cc * sa, -u * u * ca)


def ca_omega(a: ArrayLike, c: ArrayLike, da: ArrayLike, dc: ArrayLike) -> Floats:
    """Angular velocity of the serial C-A head, eq. (3-9)."""
    _, _, cc, sc = _functions(a, c)
    u, v = np.asarray(da, dtype=np.float64), np.asarray(dc, dtype=np.float64)
    return _stack(cc * u, sc * u, v)


def hexapod_matrix(a: ArrayLike, c: ArrayLike) -> Floats:
    """Orientation of a hexapod without torsion, Rz(c) Rx(a) Rz(-c), eq. (3-10); (..., 3, 3)."""
    return rotation(UNIT["z"], c) @ rotation(UNIT["x"], a) @ rotation(UNIT["z"], -np.asarray(c))


def hexapod_omega(a: ArrayLike, c: ArrayLike, da: ArrayLike, dc: ArrayLike) -> Floats:
    """Angular velocity of the hexapod, eq. (3-11) corrected: the serial one minus dc A."""
    ca, sa, cc, sc = _functions(a, c)
    u, v = np.asarray(da, dtype=np.float64), np.asarray(dc, dtype=np.float64)
    return _stack(cc * u - sc * sa * v, sc * u + cc * sa * v, (1.0 - ca) * v)


def _functions(a: ArrayLike, c: ArrayLike) -> tuple[Floats, Floats, Floats, Floats]:
    p, q = np.asarray(a, dtype=np.float64), np.asarray(c, dtype=np.float64)
    return np.cos(p), np.sin(p), np.cos(q), np.sin(q)


def _stack(*parts: Floats) -> Floats:
    return np.stack(np.broadcast_arrays(*parts), axis=-1)
