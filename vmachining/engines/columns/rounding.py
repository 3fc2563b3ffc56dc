"""What rounding adds to the brackets of the kernels (R10 of docs/columns.md)."""

from __future__ import annotations

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.columns import _kernels
from vmachining.engines.protocol import NOTHING, Removal

DIGITS = 64 * float(np.finfo(float).eps)
"""Rounding of a coordinate that a kernel works with, relative to the extent: 64 units in the last place."""

ROUNDING = 1e-11
"""Rounding of closed integrals, relative to plan area times height: a quotient by THIN^2 of the kernels' 1e-4 at most."""

CELLS = 60_000
"""Of a line, or of a piece of an arc."""


def slacks(rows: Floats, extent: float) -> Floats:
    """(n,) mm by which computed surfaces of rows may lie beside the true ones; extent : largest coordinate of the stock."""
    reach = np.maximum(np.abs(rows[:, :3]).max(axis=1), extent)
    return np.asarray(DIGITS * (reach + np.maximum(rows[:, 3], 0.0) + rows[:, 5]))


def removals(
    rows: Floats, out: Floats, slack: Floats, R: Floats, height: Floats, seams: Floats | None
) -> list[Removal]:
    """Of rows (n, 13) from what `remove_all` found, out (n, 5), each with its rounding.

    slack, R, height : (n,) mm, see `slacks`, radius of the cutter, of the part that it can take. seams : (n,) mm, of
    edges of facets in the tiles that it reaches; None without facets.
    """
    lo, hi, _, longest, state = out.T
    plan, rim = 2.0 * R * (2.0 * R + rows[:, 5]), 2.0 * (4.0 * R + rows[:, 5])
    # each sweep, the top and the bottom moved by the rounding of coordinates; and that of the closed integrals
    error = slack * (longest + 3.0) * (2.0 * plan + rim * height) + ROUNDING * plan * (height + R)
    if seams is not None:  # strips as narrow along edges of facets are passed over
        error += 2.0 * slack * seams * height
    notes = [f"{CELLS} cells were not enough" if full else None for full in state == _kernels.FULL]
    for i in np.flatnonzero(rows[:, 7] != rows[:, 8]).tolist():
        notes[i] = "so steep a ramp is held between two plunges"
    ends = np.maximum(lo - error, 0.0).tolist(), (0.5 * (lo + hi)).tolist(), (hi + error).tolist()
    return [
        NOTHING if empty else Removal(low, middle, high, note=note)
        for low, middle, high, note, empty in zip(*ends, notes, (hi <= 0.0).tolist(), strict=True)
    ]
