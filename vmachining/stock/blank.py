"""`Blank`: a raw stock in numbers, for a kernel that builds solids."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vmachining.arrays import Floats


@dataclass(frozen=True, slots=True)
class Blank:
    """Raw stock: box (lo, hi), cylinder (center, radius, z), a STEP file, or triangles. Lengths in mm.

    kind : "box", "cylinder", "step" or "triangles". triangles : rows of three corners, outward.
    """

    kind: str
    lo: tuple[float, float, float] = (0.0, 0.0, 0.0)
    hi: tuple[float, float, float] = (0.0, 0.0, 0.0)
    center: tuple[float, float] = (0.0, 0.0)
    radius: float = 0.0
    file: str = ""
    triangles: tuple[tuple[float, ...], ...] = ()

    @property
    def bounds(self) -> Floats | None:
        """(2, 3) mm of a box or a cylinder, to the last bit."""
        if self.kind == "box":
            return np.array([self.lo, self.hi], dtype=np.float64)
        if self.kind == "cylinder":
            (x, y), r = self.center, self.radius
            return np.array([(x - r, y - r, self.lo[2]), (x + r, y + r, self.hi[2])], dtype=np.float64)
        return None
