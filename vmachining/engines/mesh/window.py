"""What a tile lets a mesh see: a box, and how high the material in it reaches."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vmachining.arrays import Bools, Floats
from vmachining.engines.mesh.skin import boxes_seen

__all__ = ["Window"]


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """Where a mesh must be right; elsewhere it is free.

    lo, hi : (3,) mm, a box. heights : (nx, ny) mm, nothing of the box above them matters; the cells of that
    grid are `cell` mm wide and begin at lo.
    """

    lo: Floats
    hi: Floats
    heights: Floats
    cell: float

    def within(self, box: Floats) -> tuple[Floats, Floats] | None:
        """Corners of what matters inside a box (2, 3); None if that is nothing."""
        lo, hi = np.maximum(self.lo, box[0]), np.minimum(self.hi, box[1])
        if (lo >= hi).any():
            return None
        nx, ny = self.heights.shape
        (i0, j0), (i1, j1) = (
            ((lo - self.lo) / self.cell).astype(int)[:2].tolist(),
            ((hi - self.lo) / self.cell).astype(int)[:2].tolist(),
        )
        top = float(self.heights[min(i0, nx - 1) : i1 + 1, min(j0, ny - 1) : j1 + 1].max())
        if top <= lo[2]:
            return None
        hi[2] = min(hi[2], top)
        return lo, hi

    def sees(self, boxes: Floats) -> Bools:
        """(k,) whether boxes (k, 2, 3) can meet the material."""
        out = np.empty(len(boxes), dtype=np.bool_)
        boxes_seen(boxes, self.lo, self.hi, self.lo, self.heights, self.cell, out)  # type: ignore[no-untyped-call]
        return out
