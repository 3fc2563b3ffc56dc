"""How much of each slide a path uses.

Symbols: q_i position of slide i, s length along the path, L path length.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, rows
from vmachining.errors import KinematicsError
from vmachining.geometry import Arc, Line

IN_PLANE = np.array([[1, 2], [2, 0], [0, 1]])
"""First and second in-plane slide by normal axis, right-handed about the normal."""


def line_peaks(start: ArrayLike, end: ArrayLike) -> Floats:
    """Peak of |dq_i/ds| of straight blocks.

    start, end : (n, 3) mm
    Returns (n, 3), each in [0, 1]; zeros for a block without length.
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

    start, center : (n, 3) mm
    axis : (n,) 0, 1 or 2, the normal of the plane
    angle : (n,) rad, signed
    rise : (n,) mm along the normal
    Returns (n, 3), each in [0, 1].
    Raises KinematicsError: An axis that is not 0, 1 or 2.
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
