"""How much of each slide a path uses, and the tip feed at which the first slide is at its limit.

Symbols: q_i position of slide i, s length along the path, L path length, U cap of the feed along the path.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, rows
from vmachining.errors import KinematicsError
from vmachining.geometry import Arc, Line
from vmachining.machine.limits import MachineLimits

__all__ = ["arc_peaks", "axis_caps", "line_peaks", "path_peaks", "travel_caps"]

IN_PLANE = np.array([[1, 2], [2, 0], [0, 1]])
"""First and second in-plane slide by normal axis, right-handed about the normal."""


def line_peaks(start: ArrayLike, end: ArrayLike) -> Floats:
    """Peak of |dq_i/ds| of straight blocks.

    Parameters
    ----------
    start, end : (n, 3) mm

    Returns
    -------
    (n, 3), each in [0, 1]; zeros for a block without length.
    """
    travel = np.abs(rows(end, -1, 3, name="end") - rows(start, -1, 3, name="start"))
    length = np.linalg.norm(travel, axis=1, keepdims=True)
    return np.asarray(np.divide(travel, length, out=np.zeros_like(travel), where=length > 0))


def arc_peaks(
    start: ArrayLike, center: ArrayLike, axis: ArrayLike, angle: ArrayLike, rise: ArrayLike
) -> Floats:
    """Peak of |dq_i/ds| of circular and helical blocks.

    The in-plane speeds are |sin| and |cos| of the angle about the centre; a peak of 1 is reached when the
    arc passes a quadrant point, otherwise the larger of the two ends counts.

    Parameters
    ----------
    start, center : (n, 3) mm
    axis : (n,) 0, 1 or 2, the normal of the plane
    angle : (n,) rad, signed
    rise : (n,) mm along the normal

    Returns
    -------
    (n, 3), each in [0, 1].

    Raises
    ------
    KinematicsError
        An axis that is not 0, 1 or 2.
    """
    p, c = rows(start, -1, 3, name="start"), rows(center, -1, 3, name="center")
    n = len(p)
    turn, climb = rows(angle, n, name="angle"), np.abs(rows(rise, n, name="rise"))
    normal = np.asarray(axis, dtype=np.int64)
    if normal.shape != (n,) or ((normal < 0) | (normal > 2)).any():
        raise KinematicsError("axis of an arc is not 0, 1 or 2")
    row = np.arange(n)
    first, second = IN_PLANE[normal].T
    da, db = (p - c)[row, first], (p - c)[row, second]
    begin = np.arctan2(db, da)
    lo, hi = np.minimum(begin, begin + turn), np.maximum(begin, begin + turn)
    around = np.hypot(da, db) * np.abs(turn)
    length = np.hypot(around, climb)
    share = np.divide(around, length, out=np.zeros(n), where=length > 0)
    peaks = np.zeros((n, 3))
    # slide a moves with sin(angle), slide b with cos(angle): largest at quadrant points of b and of a
    for slide, function, phase in ((first, np.sin, 0.5 * np.pi), (second, np.cos, 0.0)):
        passes = np.floor((hi - phase) / np.pi) >= np.ceil((lo - phase) / np.pi)
        ends = np.maximum(np.abs(function(lo)), np.abs(function(hi)))
        peaks[row, slide] = share * np.where(passes, 1.0, ends)
    peaks[row, normal] = np.divide(climb, length, out=np.zeros(n), where=length > 0)
    return peaks


def path_peaks(paths: Sequence[Line | Arc]) -> Floats:
    """Peak of |dq_i/ds| of any mixture of paths, (n, 3)."""
    out = np.zeros((len(paths), 3))
    lines = [k for k, path in enumerate(paths) if isinstance(path, Line)]
    if lines:
        out[lines] = line_peaks([paths[k].start for k in lines], [paths[k].end for k in lines])
    arcs = [(k, path) for k, path in enumerate(paths) if isinstance(path, Arc)]
    if arcs:
        out[[k for k, _ in arcs]] = arc_peaks(
            [a.start for _, a in arcs], [a.center for _, a in arcs], [a.axis for _, a in arcs],
            [a.angle for _, a in arcs], [a.rise for _, a in arcs],
        )  # fmt: skip
    return out


def axis_caps(peaks: ArrayLike, limits: MachineLimits) -> Floats:
    """Largest feed along each path that every slide can follow.

    Parameters
    ----------
    peaks : (n, 3)
        Peak of |dq_i/ds|, from `line_peaks`, `arc_peaks` or `path_peaks`.

    Returns
    -------
    (n,) mm/min; inf where nothing limits.

    Notes
    -----
    U = min_i vmax_i / peak_i, and never above the largest feed of the machine. For a straight block the
    first part is L / max_i(|dq_i| / vmax_i).
    """
    share = rows(peaks, -1, 3, name="peaks")
    slowest = np.array([np.inf if v is None else v for v in limits.axes])
    whole = np.inf if limits.max_feed_mm_min is None else limits.max_feed_mm_min
    if (share < 0).any():
        raise KinematicsError("peaks must not be negative")
    caps = np.divide(slowest, share, out=np.full(share.shape, np.inf), where=share > 0)
    return np.asarray(np.minimum(caps.min(axis=1), whole))


def travel_caps(length_mm: ArrayLike, travel: ArrayLike, axis_feed_per_min: ArrayLike) -> Floats:
    """Largest feed along straight blocks in machine coordinates, any number of linear and rotary axes.

    Parameters
    ----------
    length_mm : (n,) mm
        Tip path.
    travel : (n, m)
        Travel of each axis in the block, mm or degrees.
    axis_feed_per_min : (m,)
        Limit of each axis, mm/min or degrees/min; inf for none.

    Returns
    -------
    (n,) mm/min; inf where nothing limits, and for a block without length (its feed has no meaning).

    Notes
    -----
    U = L / max_i(|dq_i| / vmax_i). Example: L = 1 mm with 10 degrees at 3600 degrees/min gives 360 mm/min.
    """
    length, moved = rows(length_mm, -1, name="length_mm"), rows(travel, -1, -1, name="travel")
    limit = np.asarray(axis_feed_per_min, dtype=np.float64)
    if moved.shape != (len(length), len(limit)):
        raise KinematicsError(f"travel: want shape ({len(length)}, {limit.size}), got {moved.shape}")
    if not (limit > 0).all() or (length < 0).any():
        raise KinematicsError("axis limits must be positive and lengths not negative")
    minutes = (np.abs(moved) / limit).max(axis=1, initial=0.0)
    usable = (minutes > 0) & (length > 0)
    return np.asarray(np.divide(length, minutes, out=np.full(len(length), np.inf), where=usable))
