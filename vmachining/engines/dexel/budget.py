"""Memory of rays before there are any, and which spacing fits."""

from __future__ import annotations

from collections.abc import Sequence
from math import sqrt

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.dexel.lattice import BYTES
from vmachining.errors import InputError
from vmachining.memory import available_bytes

RAYS = 500_000
"""Rays of all directions if nobody asks for a spacing: seconds for a small job, and 30 MB."""

SHARE = 0.7
"""Of the memory that is free, for rays."""


def shadows(bounds: Floats, axes: Sequence[int]) -> float:
    """mm^2 of the box (2, 3) seen along all directions together."""
    size = bounds[1] - bounds[0]
    return float(sum(size[(k + 1) % 3] * size[(k + 2) % 3] for k in axes))


def count_of_rays(bounds: Floats, axes: Sequence[int], spacing: float) -> float:
    """Rays of all directions."""
    n = np.ceil((bounds[1] - bounds[0]) / spacing - 1e-9)
    return float(sum(n[(k + 1) % 3] * n[(k + 2) % 3] for k in axes))


def default_spacing(bounds: Floats, axes: Sequence[int]) -> float:
    """mm, two digits."""
    return float(f"{sqrt(shadows(bounds, axes) / RAYS):.2g}")


def refuse_too_fine(bounds: Floats, axes: Sequence[int], spacing: float) -> None:
    """Refuse a spacing whose rays do not fit into memory, before any of them is made.

    Raises InputError: No length; or says how many rays there would be, what they take, and which spacing fits.
    """
    if not 0.0 < spacing < float("inf"):
        raise InputError(f"spacing {spacing:g} mm is not a length", remedy="give a length above 0")
    count = count_of_rays(bounds, axes, spacing)
    need, have = BYTES * count, SHARE * available_bytes()
    if need <= have:
        return
    fits = float(f"{1.05 * sqrt(BYTES * shadows(bounds, axes) / have):.2g}")
    raise InputError(
        f"{count:,.0f} rays at a spacing of {spacing:.3g} mm need {need / 1e9:.3g} GB, and {have / 1e9:.3g} GB can be had",
        remedy=f"take --spacing {fits:g}, or more",
    )
