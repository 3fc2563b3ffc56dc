"""`HeightStock`: material below heights over a grid of cells, staircases among them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.engagement.analytic._kernels import Stairs
from vmachining.errors import StockError
from vmachining.tolerance import LENGTH_EPS_MM


@dataclass(frozen=True, slots=True, eq=False, init=False)
class HeightStock:
    """Material below the tops of cells: x (n + 1,) and y (m + 1,) mm rising breaks, top (n, m) mm, floor mm.

    A cell of top -inf is empty. Cells are closed: a point on a wall belongs to the cells on both sides. The outer
    breaks may be infinite. `floor` is the height of the bottom.

    Raises StockError: Breaks that do not rise, heights of another shape, NaN.
    """

    x: Floats
    y: Floats
    top: Floats
    floor: float

    def __init__(self, x: ArrayLike, y: ArrayLike, top: ArrayLike, floor: float = -np.inf) -> None:
        breaks = [np.array(v, dtype=np.float64, ndmin=1) for v in (x, y)]
        tops = np.array(top, dtype=np.float64)
        for name, v in zip("xy", breaks, strict=True):
            if v.ndim != 1 or len(v) < 2 or not (np.diff(v) > 0.0).all():
                raise StockError(f"{name} breaks of blocks must rise: {v.tolist()}")
        want = (len(breaks[0]) - 1, len(breaks[1]) - 1)
        if tops.shape != want:
            raise StockError(f"heights of shape {tops.shape} between {want} breaks: one height for each cell")
        if np.isnan(tops).any() or np.isposinf(tops).any() or np.isnan(floor):
            raise StockError("a height is not a number; an empty cell has the height -inf")
        tops[tops <= floor] = -np.inf
        for name, value in (("x", breaks[0]), ("y", breaks[1]), ("top", tops)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)
        object.__setattr__(self, "floor", float(floor))

    @classmethod
    def staircase(
        cls,
        breaks: ArrayLike,
        tops: ArrayLike,
        *,
        y: tuple[float, float] = (-np.inf, np.inf),
        floor: float = -np.inf,
    ) -> HeightStock:
        """Blocks side by side in x: breaks (n + 1,) and their heights (n,) mm."""
        heights = np.array(tops, dtype=np.float64, ndmin=1)
        if heights.ndim != 1:
            raise StockError(f"heights of a staircase: expected one row, got shape {heights.shape}")
        return cls(breaks, y, heights[:, None], floor)

    @classmethod
    def vectors(cls, points: ArrayLike, *, floor: float = -np.inf) -> HeightStock:
        """Vertical vectors (n, 3) mm on a grid: each is the height of the cell around it.

        Cells reach half way to the neighbours, and as far on the outside. Places of the grid without a vector are
        empty.

        Raises StockError: Two vectors at one place, fewer than two in a direction.
        """
        p = np.array(points, dtype=np.float64)
        if p.ndim != 2 or p.shape[1] != 3 or not len(p) or not np.isfinite(p).all():
            raise StockError(f"vertical vectors: expected finite rows (x, y, z), got shape {p.shape}")
        breaks, index = [], []
        for k in range(2):
            v = np.unique(p[:, k])
            keep = np.concatenate([[True], np.diff(v) > LENGTH_EPS_MM])  # digits of a file
            v = v[keep]
            if len(v) < 2:
                raise StockError(
                    f"vertical vectors at one {'xy'[k]} only: the width of their cells is unknown"
                )
            middle = 0.5 * (v[1:] + v[:-1])
            breaks.append(np.concatenate([[2 * v[0] - middle[0]], middle, [2 * v[-1] - middle[-1]]]))
            index.append(np.clip(np.searchsorted(breaks[k], p[:, k], side="right") - 1, 0, len(v) - 1))
        top = np.full((len(breaks[0]) - 1, len(breaks[1]) - 1), -np.inf)
        flat = index[0] * top.shape[1] + index[1]
        if len(np.unique(flat)) < len(flat):
            raise StockError("two vertical vectors at one position")
        top.ravel()[flat] = p[:, 2]
        return cls(breaks[0], breaks[1], top, floor)

    def signed_height(self, points: ArrayLike) -> Floats:
        """(n,) mm above the top of the cell around each point (n, 3); inf outside."""
        p = np.asarray(points, dtype=np.float64)
        i, j = (np.searchsorted(b, p[:, k], side="right") - 1 for k, b in enumerate((self.x, self.y)))
        here = (i >= 0) & (i < len(self.x) - 1) & (j >= 0) & (j < len(self.y) - 1)
        out = np.full(len(p), np.inf)
        out[here] = p[here, 2] - self.top[i[here], j[here]]
        return out

    def rows(self) -> Stairs:
        """As the kernels need it."""
        return Stairs(self.x, self.y, np.ascontiguousarray(self.top), self.floor, float(self.top.max()))
