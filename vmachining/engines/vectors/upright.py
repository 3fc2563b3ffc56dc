"""`UprightVectors`: one vector of direction +z over every cell of a square grid (DVV), in tiles.

Only lengths are kept, 4 bytes a vector; where a vector starts is computed again from the part when a tile is looked at, and
kept for the tiles that were looked at last.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engines.protocol import NOTHING, Removal
from vmachining.engines.vectors import _kernels
from vmachining.engines.vectors.facets import envelope
from vmachining.engines.vectors.part import DesignPart
from vmachining.stock import Stock
from vmachining.sweep import Sweep
from vmachining.sweep.ball import ball_block
from vmachining.sweep.ball._kernels import ball_upright

__all__ = ["TILE", "Base", "UprightVectors"]

TILE = 64
"""Cells along the side of a tile."""

KEPT = 256
"""Tiles whose bases are kept: 35 MB."""

UP = (0.0, 0.0, 1.0)


class Base(NamedTuple):
    """Where the vectors of a tile (T, T) start and end. mm; NaN where there is neither part nor stock.

    start : height of the part, of the lowest stock where there is no part. low : where a vector ends below. bottom, top : of
    the stock. facet : of the part, -1 where there is none.
    """

    start: Floats
    low: Floats
    bottom: Floats
    top: Floats
    facet: Ints


class Cells(NamedTuple):
    """Half-open rectangle of cells, i along x, j along y."""

    i0: int
    i1: int
    j0: int
    j1: int


class UprightVectors:
    """Lengths of the upright vectors over a part and its stock.

    lengths : (a, b, T, T) float32 mm by tile; NaN where there is no vector. behind : how often vectors were entered from
        behind. low : (2,) mm corner of the grid. shape : cells along x and y.
    """

    def __init__(
        self,
        part: DesignPart,
        stock: Stock,
        pitch: float,
        *,
        casting: float | None = None,
        facets: float | None = None,
    ) -> None:
        self.part, self.stock, self.pitch = part, stock, pitch
        self.casting, self.facets = casting, facets
        both = np.stack([part.bounds, stock.bounds])
        self.low = np.minimum(both[0, 0], both[1, 0])[:2]
        high = np.maximum(both[0, 1], both[1, 1])[:2]
        self.shape = grid_shape(high - self.low, pitch)
        nx, ny = self.shape
        self.low = self.low - 0.5 * (
            np.array(self.shape) * pitch - (high - self.low)
        )  # the rest at both sides
        self.behind = 0
        self.lengths: NDArray[np.float32] = np.empty((-(-nx // TILE), -(-ny // TILE), TILE, TILE), np.float32)
        self.base = lru_cache(maxsize=KEPT)(self._base)
        for a, b in np.ndindex(self.lengths.shape[:2]):
            base = self.base(a, b)
            full = np.full_like(base.start, casting) if casting is not None else base.top - base.start
            if casting is not None:
                full[base.facet < 0] = np.nan
            self.lengths[a, b] = full

    def __getstate__(self) -> dict[str, object]:
        return {name: value for name, value in self.__dict__.items() if name != "base"}

    def __setstate__(self, state: dict[str, object]) -> None:
        self.__dict__.update(state)
        self.base = lru_cache(maxsize=KEPT)(self._base)

    def centres(self, cells: Cells) -> tuple[Floats, Floats]:
        """x (n,) and y (m,) of the middles of cells."""
        x = self.low[0] + (np.arange(cells.i0, cells.i1) + 0.5) * self.pitch
        y = self.low[1] + (np.arange(cells.j0, cells.j1) + 0.5) * self.pitch
        return x, y

    def _base(self, a: int, b: int) -> Base:
        nx, ny = self.shape
        cells = Cells(a * TILE, min(nx, (a + 1) * TILE), b * TILE, min(ny, (b + 1) * TILE))
        x, y = self.centres(cells)
        size = (len(x), len(y))
        which = self.part.near(np.array([x[0], y[0]]), np.array([x[-1], y[-1]]))
        height, exit_ = np.full(size, -np.inf), np.full(size, -np.inf)
        facet, under = np.full(size, -1), np.full(size, -1)
        where = (float(x[0]), float(y[0]), self.pitch)
        corners = self.part.corners
        _kernels.raster(corners, which, *where, np.full(size, np.inf), 1.0, height, facet)
        _kernels.raster(corners, which, *where, height - 1e-9, -1.0, exit_, under)
        places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        rays = self.stock.crossings(places)
        bottom, top = np.full(len(places), np.nan), np.full(len(places), np.nan)
        has = rays.counts > 0
        ends = np.cumsum(rays.counts)
        bottom[has], top[has] = rays.enter[(ends - rays.counts)[has]], rays.leave[ends[has] - 1]
        bottom, top = bottom.reshape(size), top.reshape(size)
        on = facet >= 0
        start = np.where(on, height, bottom)
        low = np.where(on, np.where(under >= 0, exit_, start), bottom)
        if self.casting is not None:
            bottom = np.where(on, low, np.nan)
        whole = [np.full((TILE, TILE), np.nan) for _ in range(4)]
        for target, value in zip(
            whole, (start, low, np.where(np.isnan(bottom), start, bottom), top), strict=True
        ):
            target[: size[0], : size[1]] = value
        faces = np.full((TILE, TILE), -1)
        faces[: size[0], : size[1]] = facet
        return Base(whole[0], whole[1], whole[2], whole[3], faces)

    def cut(self, sweep: Sweep) -> Removal:
        """Shorten the vectors that a sweep enters."""
        return self._met(sweep, write=True)

    def touch(self, sweep: Sweep) -> Removal:
        """What `cut` would answer."""
        return self._met(sweep, write=False)

    def _met(self, sweep: Sweep, *, write: bool) -> Removal:
        box = sweep.bounds
        cells = self._cells(box)
        if cells is None:
            return NOTHING
        depth = np.zeros((cells.i1 - cells.i0, cells.j1 - cells.j0))
        met = False
        heights = None
        for a in range(cells.i0 // TILE, (cells.i1 - 1) // TILE + 1):
            for b in range(cells.j0 // TILE, (cells.j1 - 1) // TILE + 1):
                base = self.base(a, b)
                lengths = self.lengths[a, b] if write else self.lengths[a, b].copy()
                if heights is None:
                    heights = list(self._heights(sweep, cells))
                for enter, leave in heights:
                    flags = _kernels.apply_upright(
                        lengths, base.start, base.low, base.bottom, a * TILE - cells.i0, b * TILE - cells.j0,
                        enter, leave, depth,
                    )  # fmt: skip
                    self.behind += int(flags) if write else 0
                met = True
        if not (met and depth.any()):
            return NOTHING
        sums = np.empty(3)
        _kernels.neighbour_sums(depth, sums)
        lo, middle, hi = (sums * self.pitch**2).tolist()
        return Removal(lo, middle, hi, proven=False)

    def _cells(self, box: Floats) -> Cells | None:
        """Cells whose middles lie below a box, and one more around; None if there are none."""
        first = np.ceil((box[0, :2] - self.low) / self.pitch - 0.5).astype(int)
        last = np.floor((box[1, :2] - self.low) / self.pitch - 0.5).astype(int)
        if (first > last).any() or (last < 0).any() or (first >= self.shape).any():
            return None
        i0, j0 = np.maximum(first - 1, 0).tolist()
        i1, j1 = np.minimum(last + 2, self.shape).tolist()
        return Cells(i0, i1, j0, j1)

    def _heights(self, sweep: Sweep, cells: Cells) -> Iterator[tuple[Floats, Floats]]:
        """Heights (n, m) at which the lines of cells enter and leave a sweep, inf and -inf where they miss; rising."""
        x, y = self.centres(cells)
        enter, leave = np.full((len(x), len(y)), np.inf), np.full((len(x), len(y)), -np.inf)
        if self.facets is not None:
            _kernels.facets_upright(envelope(sweep, self.facets), x[0], y[0], self.pitch, enter)
            yield enter, leave
            return
        ball = ball_block(sweep)
        if ball is not None:
            ball_upright(
                x[0], y[0], self.pitch, ball.center, ball.travel, ball.radius, ball.height, enter, leave
            )
            yield enter, leave
            return
        places = np.stack(np.meshgrid(x, y, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
        rays = sweep.ray_intervals(places, UP)
        first = np.cumsum(rays.counts) - rays.counts
        for k in range(int(rays.counts.max(initial=0))):
            has = rays.counts > k
            low, high = np.full(len(places), np.inf), np.full(len(places), -np.inf)
            low[has], high[has] = rays.enter[first[has] + k], rays.leave[first[has] + k]
            yield low.reshape(len(x), len(y)), high.reshape(len(x), len(y))

    def tiles(self) -> Iterator[tuple[Base, NDArray[np.float32], Floats, Floats, Bools]]:
        """Base, lengths, x, y (T,) and which cells (T, T) have a vector, tile by tile."""
        for a, b in np.ndindex(self.lengths.shape[:2]):
            cells = Cells(a * TILE, (a + 1) * TILE, b * TILE, (b + 1) * TILE)
            yield self.base(a, b), self.lengths[a, b], *self.centres(cells), ~np.isnan(self.lengths[a, b])


def grid_shape(size: Floats, pitch: float) -> tuple[int, int]:
    """Cells along x and y over a rectangle."""
    nx, ny = (max(1, int(np.ceil(s / pitch - 1e-9))) for s in size[:2])
    return nx, ny
