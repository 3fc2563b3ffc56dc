"""Where the edge crosses a plane n . Q = c, in closed form, as functions of plain numbers and arrays.

n = e_x, e_y, e_z gives the walls and tops of blocks ("X-, Y-, Z-boundary"), any other n a sloping face. Source: Hendriko,
five-axis milling, 5-16 to 5-27, with 5-19, 5-23, 5-24, 5-26 and 5-27 corrected.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.engagement import chip


class CornerCrossings(NamedTuple):
    """a cos lam + b sin lam = g on the corner, k = hypot(a, b), tau = atan2(b, a). up, down : (...,) rad of lam where
    n . Q rises and falls through c; NaN where that is not on 0 to 90 degrees."""

    a: Floats
    b: Floats
    g: Floats
    k: Floats
    tau: Floats
    up: Floats
    down: Floats


def cylinder_plane(
    normal: ArrayLike, c: ArrayLike, tip: ArrayLike, frame: ArrayLike, phi: ArrayLike, rm: float, r: float
) -> Floats:
    """(...,) mm, l = (c - n . P) / (n . w) above the lower end P of the cylinder (5-16, 5-17); inf where they are parallel.

    normal, tip : (..., 3). frame : (..., 3, 3). phi, c : (...,) rad, mm.
    """
    n, m = np.asarray(normal, dtype=np.float64), np.asarray(frame, dtype=np.float64)
    p = chip.edge_points(tip, m, phi, chip.arc_length(chip.QUARTER, r), rm, r)
    gap, rise = np.asarray(c) - (n * p).sum(axis=-1), (n * m[..., :, 2]).sum(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(rise != 0.0, gap / rise, np.where(gap == 0.0, np.nan, np.inf)))


def corner_plane(
    normal: ArrayLike, c: ArrayLike, tip: ArrayLike, frame: ArrayLike, phi: ArrayLike, rm: float, r: float
) -> CornerCrossings:
    """Crossings of the corner with a plane (5-18 to 5-27).

    normal, tip : (..., 3). frame : (..., 3, 3). phi, c : (...,) rad, mm.
    """
    n, m = np.asarray(normal, dtype=np.float64), np.asarray(frame, dtype=np.float64)
    n_w, n_e = (n * m[..., :, 2]).sum(axis=-1), (n * chip.radial(m, phi)).sum(axis=-1)
    a, b = -r * n_w, r * n_e
    g = np.asarray(c) - (n * np.asarray(tip)).sum(axis=-1) - rm * n_e - r * n_w
    a, b, g = np.broadcast_arrays(a, b, g)
    k, tau = np.hypot(a, b), np.arctan2(b, a)
    with np.errstate(divide="ignore", invalid="ignore"):
        half = np.arccos(np.where(np.abs(g) <= k, g / k, np.nan))
    return CornerCrossings(a, b, g, k, tau, quarter(tau - half), quarter(tau + half))


def quarter(angle: ArrayLike) -> Floats:
    """(...,) rad reduced to 0 to 90 degrees, NaN where it is not there; rounding at the ends is forgiven."""
    lam = np.mod(np.asarray(angle, dtype=np.float64), 2.0 * np.pi)
    lam = np.where(lam > 2.0 * np.pi - ROUNDING, 0.0, lam)
    lam = np.where((lam > chip.QUARTER) & (lam <= chip.QUARTER + ROUNDING), chip.QUARTER, lam)
    return np.asarray(np.where(lam <= chip.QUARTER, lam, np.nan))


ROUNDING = 1e-14
"""rad: some ulp of an angle near a full turn."""
