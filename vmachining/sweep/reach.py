"""What of a sweep can meet a stock."""

from __future__ import annotations

import numpy as np

from vmachining.arrays import Floats
from vmachining.geometry import Arc, Line
from vmachining.sweep import Sweep, Turn


def meets(sweep: Sweep, box: Floats) -> bool:
    """Whether the box of a sweep meets another one."""
    lo, hi = sweep.bounds
    return bool((lo < box[1]).all() and (hi > box[0]).all())


def reaching(sweep: Sweep, box: Floats) -> Sweep:
    """The sweep of the lower part of the cutter, as high as it can meet a stock in a box (2, 3).

    What stays above the stock in every pose makes solids larger, tapers wider, and removes nothing.
    """
    profile, path = sweep.profile, sweep.path
    drop = float(box[1, 2] - path.bounds[0, 2])
    reach = drop if isinstance(path, (Line, Arc)) else _reach(path, drop, profile.max_radius)
    height = reach + max(1.0, 0.05 * profile.max_radius)
    if not profile.z_min < height < profile.z_max or reach <= profile.z_min:
        return sweep
    return Sweep.along(profile.clip(profile.z_min, height), sweep.path)


def _reach(path: Turn, drop: float, radius: float) -> float:
    """Height along a turning tool above which all of it is higher than `drop` over the lowest tip.

    A point at height h and radius r is at least h cos(lean) - r sin(lean) above the tip.
    """
    t = np.linspace(0.0, 1.0, 65)
    up = float(path.axis(t)[:, 2].min()) - path.axis_series.bound(2) / (8.0 * 64.0**2)
    return np.inf if up < 0.1 else (drop + radius * float(np.sqrt(1.0 - up * up))) / up
