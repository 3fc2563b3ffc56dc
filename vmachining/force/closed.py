"""Integrals along the edge of an upright bull or flat end. Symbols: r corner radius, mm."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats


class LayerIntegrals(NamedTuple):
    """Integrals along the edge between two heights, mm: of sin^2 lam, sin lam, sin lam cos lam, cos lam and 1."""

    ss: float
    s: float
    sc: float
    c: float
    one: float


def layer_integrals(low: float, high: float, r: float) -> LayerIntegrals:
    """Between heights `low` < `high` mm: the corner in closed form, its rest a cylinder."""
    if r == 0.0:
        return LayerIntegrals(high - low, high - low, 0.0, 0.0, high - low)
    a, b = (float(np.arccos(1.0 - min(d, r) / r)) for d in (low, high))
    above = max(high, r) - max(low, r)

    def part(at: float) -> Floats:
        sin, cos = np.sin(at), np.cos(at)
        return r * np.array([(at - sin * cos) / 2.0, -cos, sin**2 / 2.0, sin, at])

    ss, s, sc, c, one = (part(b) - part(a)).tolist()
    return LayerIntegrals(ss + above, s + above, sc, c, one + above)
