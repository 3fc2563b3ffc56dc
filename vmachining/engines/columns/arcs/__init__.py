"""Arcs and helices with upright axis, cell by cell: the chord of those poses that can be lowest in a cell.

1. A piece of an arc is one row, no longer than `pieces` says.
2. In a cell only poses between two angles touch; where these lie follows from how distance and slope grow along the
   circle (`_kernels.lag`).
3. The chord of these poses, of a cutter shrunk and of one grown by how far chord and arc lie apart, is an ordinary straight
   sweep: every rule for straight sweeps holds. The smaller the cell, the shorter the chord, and what lies between the two
   cutters falls with its square.

Source: derived in `docs/columns.md`, rule R9.
"""

from __future__ import annotations

import numpy as np

from vmachining.geometry import Arc

__all__ = ["RUNGS", "is_flat", "pieces", "widest"]

RUNGS = 18
"""Pairs of cutters, each half as far from the true one as the pair before."""

SHARE = 0.125
"""Of the radius of the cutter, by which the first pair is shrunk and grown."""

MOST_ANGLE = np.pi / 3
"""Of one piece, rad."""

STEEPEST = 100.0
"""Slope of a helix from which on it is taken by chords of its own, as arcs in other planes are."""


def is_flat(path: object) -> bool:
    """Whether a path is an arc or a helix about an upright axis that rules for cells are made for."""
    if not isinstance(path, Arc) or path.axis != 2 or path.angle == 0.0 or path.radius < 1e-6:
        return False
    return abs(path.rise) <= STEEPEST * path.radius * abs(path.angle)


def widest(radius: float) -> float:
    """mm by which the first pair of a cutter is shrunk and grown."""
    return SHARE * radius


def pieces(path: Arc, radius: float) -> int:
    """Equal pieces of an arc, each no farther from its chord than the first pair of the cutter allows."""
    most, n = 0.9 * widest(radius), max(1, int(np.ceil(abs(path.angle) / MOST_ANGLE)))
    while True:
        a = abs(path.angle) / n
        if path.radius * (np.tan(0.25 * a) ** 2 + a**3 / 36.0) <= most:
            return n
        n = n + 1 + n // 8
