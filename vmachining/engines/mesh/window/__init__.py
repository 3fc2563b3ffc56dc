"""What a tile lets a mesh see: a box, and how high the material in it reaches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engines.mesh.window import _kernels

Corner: TypeAlias = tuple[float, float, float]

__all__ = ["Limits", "Surface", "Window", "above", "below", "roofed"]


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

    def sees(self, boxes: Floats) -> Bools:
        """(k,) whether boxes (k, 2, 3) can meet the material."""
        out = np.empty(len(boxes), dtype=np.bool_)
        _kernels.boxes_seen(boxes, self.lo, self.hi, self.lo, self.heights, self.cell, out)  # type: ignore[no-untyped-call]
        return out


class Limits(NamedTuple):
    """Ways along a heading, told by height: what is behind them at all of its heights does not matter.

    start : (3,) mm, from where they count. heading : (2,) unit vector. low, step : mm, height of the table above
    the start, and steps. lowest, rear : (k,) mm; nothing matters below or above the table.
    """

    start: Floats
    heading: Floats
    low: float
    step: float
    lowest: Floats
    rear: Floats


NO_LIMITS = Limits(np.zeros(3), np.zeros(2), 0.0, 1.0, np.empty(0), np.empty(0))


class Surface(NamedTuple):
    """What the triangles of a solid that reach into a column have above its foot.

    hulls : (n, 4, 3) mm, in boxes (n, 2, 3), of those that are not behind `Limits.lowest`. near : (n,) which are
    not behind `Limits.rear` either. top : mm, how high any of them reaches.
    """

    hulls: Floats
    boxes: Floats
    near: Bools
    top: float


def above(mesh: tuple[Floats, Ints], box: Floats, limits: Limits = NO_LIMITS) -> Surface:
    """Of points (n, 3) and triangles (m, 3) what is in the column (2, 3) from the foot of a box upwards."""
    points, triangles = mesh
    m = len(triangles)
    hulls, boxes, near = np.empty((m, 4, 3)), np.empty((m, 2, 3)), np.empty(m, dtype=np.bool_)
    n, top = _kernels.above(points, triangles, box[0], box[1], *limits, hulls, boxes, near)  # type: ignore[no-untyped-call]
    return Surface(hulls[:n], boxes[:n], near[:n], top)


def roofed(mesh: tuple[Floats, Ints], box: Floats, cell: float) -> Window:
    """What points (n, 3) and triangles (m, 3) of a closed mesh in a box (2, 3) let be seen."""
    lo, hi = box
    heights = _grid(lo, hi, cell)
    _kernels.roof(*mesh, lo, cell, heights)  # type: ignore[no-untyped-call]
    return Window(lo, hi, heights, cell)


def below(hulls: Floats, chosen: Bools, box: Floats, cell: float) -> Window | None:
    """What is in a box (2, 3) below those of the pieces (n, 4, 3) of a surface that are chosen (n,), if anything."""
    (lo, hi), heights = box.copy(), _grid(box[0], box[1], cell)
    i0, i1, j0, j1 = _kernels.roof_of(hulls, chosen, lo, cell, heights)  # type: ignore[no-untyped-call]
    if i0 >= i1:
        return None
    hi[:2] = np.minimum(hi[:2], lo[:2] + [i1 * cell, j1 * cell])
    lo[:2] += [i0 * cell, j0 * cell]
    return Window(lo, hi, np.ascontiguousarray(heights[i0:i1, j0:j1]), cell)


def _grid(lo: Floats, hi: Floats, cell: float) -> Floats:
    return np.empty(tuple(int(n) for n in np.ceil((hi - lo)[:2] / cell + 1e-9)))
