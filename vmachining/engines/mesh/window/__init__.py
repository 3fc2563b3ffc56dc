"""What a tile lets a mesh see: a box, and how high the material in it reaches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines.mesh.window import _kernels

Corner: TypeAlias = tuple[float, float, float]

__all__ = ["Window", "roofed"]


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

    def within(self, low: Corner, high: Corner) -> tuple[Floats, Floats] | None:
        """Corners of what matters inside a box, mm; None if that is nothing."""
        own = self.lo.tolist()
        lo = [max(a, b) for a, b in zip(own, low, strict=True)]
        hi = [min(a, b) for a, b in zip(self.hi.tolist(), high, strict=True)]
        if any(a >= b for a, b in zip(lo, hi, strict=True)):
            return None
        nx, ny = self.heights.shape
        i0, j0, i1, j1 = (int((corner[i] - own[i]) / self.cell) for corner in (lo, hi) for i in range(2))
        top = float(self.heights[min(i0, nx - 1) : i1 + 1, min(j0, ny - 1) : j1 + 1].max())
        if top <= lo[2]:
            return None
        hi[2] = min(hi[2], top)
        return np.array(lo), np.array(hi)


def roofed(points: Floats, triangles: Ints, box: Floats, cell: float) -> Window:
    """What points (n, 3) and triangles (m, 3) of a closed mesh in a box (2, 3) let be seen."""
    lo, hi = box
    heights = np.empty(tuple(int(n) for n in np.ceil((hi - lo)[:2] / cell + 1e-9)))
    _kernels.roof(points, triangles, lo, cell, heights)  # type: ignore[no-untyped-call]
    return Window(lo, hi, heights, cell)
