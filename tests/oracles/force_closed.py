"""Forces in closed form for an upright bull or flat end, constant coefficients, straight edge.

Symbols: f feed per tooth, mm; N teeth; K = (Ktc, Krc, Kac, Kte, Kre, Kae). Force on the tool, feed along +x, phi from +y to +x.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.force.identify import LayerIntegrals


def tooth_force(phi: ArrayLike, layer: LayerIntegrals, feed: float, k: ArrayLike) -> Floats:
    """(..., 3) N of one tooth at phi rad, 0 where it does not cut (not 0 < phi < 180 degrees); F(phi) of the source."""
    ktc, krc, kac, kte, kre, kae = np.asarray(k, dtype=np.float64)
    p = np.asarray(phi, dtype=np.float64) % (2.0 * np.pi)
    s, c = np.sin(p), np.cos(p)
    t = ktc * feed * s * layer.s + kte * layer.one
    r = krc * feed * s * layer.ss + kre * layer.s
    a = kac * feed * s * layer.sc + kae * layer.c
    up = (krc * feed * s * layer.sc + kre * layer.c) - (kac * feed * s * layer.ss + kae * layer.s)
    out = np.stack([-c * t - s * r - s * a, s * t - c * r - c * a, up], axis=-1)
    return np.where(((p > 0.0) & (p < np.pi) & (s > 1e-12))[..., None], out, 0.0)


def slot_means(layer: LayerIntegrals, feed: float, teeth: int, k: ArrayLike) -> Floats:
    """(3,) N, mean force over a revolution of a full slot."""
    ktc, krc, kac, kte, kre, kae = np.asarray(k, dtype=np.float64)
    x = krc * feed * layer.ss / 4 + kre * layer.s / np.pi + kac * feed * layer.sc / 4 + kae * layer.c / np.pi
    y = ktc * feed * layer.s / 4 + kte * layer.one / np.pi
    z = krc * feed * layer.sc / np.pi + kre * layer.c / 2 - kac * feed * layer.ss / np.pi - kae * layer.s / 2
    return teeth * np.array([-x, y, z])


def shoulder_means(
    entry: float, exit_: float, layer: LayerIntegrals, feed: float, teeth: int, k: ArrayLike
) -> Floats:
    """(3,) N, mean force over a revolution where each tooth cuts from `entry` to `exit_`, rad."""
    ktc, krc, kac, kte, kre, kae = np.asarray(k, dtype=np.float64)
    p = np.array([entry, exit_])
    s1, s2, c1 = (float(np.diff(v)[0]) for v in (np.sin(p), np.sin(p) ** 2, np.cos(p)))
    pp = float(np.diff(p / 2.0 - np.sin(2.0 * p) / 4.0)[0])
    g = krc * feed * layer.ss + kac * feed * layer.sc
    e = kre * layer.s + kae * layer.c
    t, te = ktc * feed * layer.s, kte * layer.one
    up = krc * feed * layer.sc - kac * feed * layer.ss
    x = -t * s2 / 2 - te * s1 - g * pp + e * c1
    y = t * pp - te * c1 - g * s2 / 2 - e * s1
    z = -up * c1 + (kre * layer.c - kae * layer.s) * (exit_ - entry)
    return teeth / (2.0 * np.pi) * np.array([x, y, z])
