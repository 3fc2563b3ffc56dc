"""`UprightVectors`: one vector of direction +z over every cell of a square grid (DVV), in tiles.

Only lengths are kept, 4 bytes a vector; where a vector starts is computed again from the part when a tile is cut, and kept
for the tiles that were cut last.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engines.protocol import NOTHING, Removal
from vmachining.engines.vectors import _kernels
from vmachining.engines.vectors.grid import _kernels as kernels
from vmachining.engines.vectors.grid._kernels import SUB, TILE, Grid
from vmachining.engines.vectors.part import DesignPart
from vmachining.stock import Stock
from vmachining.sweep import Sweep
from vmachining.sweep.ball import ball_block

KEPT = 1024
"""Tiles whose bases are kept: 67 MB. One block that is over more has them all."""

UP = (0.0, 0.0, 1.0)

ROOFED = "material stands above this cut or above an earlier one here: upright vectors only know the most that it can take"


class Base(NamedTuple):
    """Where the vectors of a tile (T, T) start and end. mm; NaN where there is neither part nor stock.

    start : height of the part, of the lowest stock where there is no part. low : where a vector ends below. bottom, top : of
    the stock. facet : of the part, -1 where none exists.
    """

    start: Floats
    low: Floats
    bottom: Floats
    top: Floats
    facet: Ints


class UprightVectors:
    """Lengths of the upright vectors over a part and its stock.

    lengths : (a, b, T, T) float32 mm by tile; NaN where there is no vector. behind : how often vectors were entered from
        behind. low : (2,) mm corner of the grid. shape : cells along x and y. material : mm^3 under them before the first cut.
    roofed : (n, 2, 2) mm, boxes seen from above of sweeps that left material above them: from then on tips there are not the
        highest material.
    """

    def __init__(self, part: DesignPart, stock: Stock, pitch: float, *, casting: float | None = None) -> None:
        self.part, self.stock, self.pitch = part, stock, pitch
        self.casting = casting
        both = np.stack([part.bounds, stock.bounds])
        self.low = np.minimum(both[0, 0], both[1, 0])[:2]
        high = np.maximum(both[0, 1], both[1, 1])[:2]
        self.shape = grid_shape(high - self.low, pitch)
        nx, ny = self.shape
        # the rest at both sides
        self.low = self.low - 0.5 * (np.array(self.shape) * pitch - (high - self.low))
        self.behind, self.material = 0, 0.0
        self.roofed: Floats = np.zeros((0, 2, 2))
        self.lengths: NDArray[np.float32] = np.empty((-(-nx // TILE), -(-ny // TILE), TILE, TILE), np.float32)
        tiles = self.lengths.shape[:2]
        self._slot, self._stamp = np.full(tiles, -1, dtype=np.int64), np.zeros(tiles, dtype=np.int64)
        self._now, self._owner = 0, np.full((0, 2), -1, dtype=np.int64)  # no tile has a base
        self._start = np.empty((0, TILE, TILE))
        self._low, self._rest = (np.empty((0, TILE, TILE), dtype=np.float32) for _ in range(2))
        self._high = np.empty((0, TILE // SUB, TILE // SUB, 3))
        self._depth, self._span = np.zeros((0, 0)), np.zeros((0, 2), dtype=np.int64)
        for a, b in np.ndindex(self.lengths.shape[:2]):
            base = self.base(a, b)
            if casting is None:
                self.lengths[a, b] = base.top - base.start
            else:
                self.lengths[a, b] = np.where(base.facet < 0, np.nan, casting)
            self.material += float(np.nansum(base.start + self.lengths[a, b] - base.bottom)) * pitch**2

    def centres(self, i0: int, i1: int, j0: int, j1: int) -> tuple[Floats, Floats]:
        """x (n,) and y (m,) of the middles of cells."""
        x = self.low[0] + (np.arange(i0, i1) + 0.5) * self.pitch
        y = self.low[1] + (np.arange(j0, j1) + 0.5) * self.pitch
        return x, y

    def base(self, a: int, b: int) -> Base:
        """Where the vectors of a tile start and end, computed from part and stock."""
        nx, ny = self.shape
        x, y = self.centres(a * TILE, min(nx, (a + 1) * TILE), b * TILE, min(ny, (b + 1) * TILE))
        bottom, top, start, low = np.full((4, TILE, TILE), np.nan)
        if self.casting is None:
            self._stock_ends(x, y, bottom, top)
        facets, first = self._facets
        tile = a * self.lengths.shape[1] + b
        facet = np.full((TILE, TILE), -1)
        _kernels.vector_ends(
            self.part.corners, facets[first[tile] : first[tile + 1]], float(x[0]), float(y[0]), self.pitch, len(x), len(y),
            self.casting is not None, bottom, start, low, facet,
        )  # fmt: skip
        return Base(start, low, bottom, top, facet)

    def _stock_ends(self, x: Floats, y: Floats, bottom: Floats, top: Floats) -> None:
        """Write the lowest and the highest place of the stock over x (n,), y (m,) into the first n, m cells of a tile."""
        places = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
        rays = self.stock.crossings(places)
        has = (rays.counts > 0).reshape(len(x), len(y))
        ends = np.cumsum(rays.counts)
        bottom[: len(x), : len(y)][has] = rays.enter[(ends - rays.counts)[has.reshape(-1)]]
        top[: len(x), : len(y)][has] = rays.leave[ends[has.reshape(-1)] - 1]

    @cached_property
    def _facets(self) -> tuple[Ints, Ints]:
        """Facets of the part by tile, see `DesignPart.by_tile`."""
        a, b = self.lengths.shape[:2]
        return self.part.by_tile(self.low, TILE * self.pitch, (a, b))

    # -- tiles ---------------------------------------------------------------------------------------------

    def _load(self, ranges: Ints) -> int:
        """Load the tiles of ranges of cells (k, 4) and answer how many they are; none is loaded if they are too many."""
        self._now += 1
        missing = np.empty((self._slot.size, 2), dtype=np.int64)
        count = kernels.missing_tiles(self._slot, ranges, self._stamp, self._now, missing)
        wanted = int((self._stamp == self._now).sum())
        if wanted > KEPT and len(ranges) > 1:
            return wanted
        self._room(count, wanted)
        free = np.flatnonzero(self._owner[:, 0] < 0)
        grid = self._grid()
        for k, (a, b) in zip(free.tolist(), missing[:count].tolist(), strict=False):
            base = self.base(a, b)
            self._start[k] = base.start
            self._low[k], self._rest[k] = base.low - base.start, base.bottom - base.start
            self._slot[a, b], self._owner[k] = k, (a, b)
            kernels.tops(grid, a, b)
        return wanted

    def _room(self, count: int, wanted: int) -> None:
        """Slots for so many more tiles: new ones, or those of the tiles that were not wanted for longest."""
        have = len(self._owner)
        used = int((self._owner[:, 0] >= 0).sum())
        size = max(have, min(max(2 * have, used + count, 64), KEPT), wanted)
        if size > have and used + count > have:
            more = size - have
            self._owner = np.concatenate([self._owner, np.full((more, 2), -1, dtype=np.int64)])
            for name in ("_start", "_low", "_rest", "_high"):
                known = getattr(self, name)
                setattr(self, name, np.concatenate([known, np.empty((more, *known.shape[1:]), known.dtype)]))
        over = used + count - len(self._owner)
        if over > 0:
            held = np.flatnonzero(self._owner[:, 0] >= 0)
            age = self._stamp[self._owner[held, 0], self._owner[held, 1]]
            out = held[np.argsort(age, kind="stable")[:over]]
            self._slot[self._owner[out, 0], self._owner[out, 1]] = -1
            self._owner[out] = -1

    def _grid(self) -> Grid:
        """What the kernels work on."""
        x0, y0 = (self.low + 0.5 * self.pitch).tolist()
        return Grid(
            self.lengths, self._slot, self._start, self._low, self._rest, self._high, x0, y0, float(self.pitch), *self.shape
        )  # fmt: skip

    def _scratch(self, n: int, m: int) -> tuple[Floats, Ints]:
        """Zeros (at least n, m) and (n, 2), to be left as zeros."""
        if self._depth.shape[0] < n or self._depth.shape[1] < m:
            self._depth = np.zeros((max(self._depth.shape[0], n), max(self._depth.shape[1], m)))
            self._span = np.zeros((len(self._depth), 2), dtype=np.int64)
        return self._depth, self._span

    # -- blocks --------------------------------------------------------------------------------------------

    def cut(self, sweep: Sweep) -> Removal:
        """Shorten the vectors that a sweep enters."""
        return self._met(sweep, write=True)

    def touch(self, sweep: Sweep) -> Removal:
        """What `cut` would answer."""
        return self._met(sweep, write=False)

    def cut_balls(self, balls: Floats, writes: Bools) -> list[Removal]:
        """Blocks (k, 8) of ball cutters one after the other, see `BallBlock.row`; not `writes`: what they would take."""
        ranges = np.zeros((len(balls), 4), dtype=np.int64)
        kernels.ball_ranges(self._grid(), balls, ranges)
        sums = np.zeros((len(balls), 3))
        todo = [(0, len(balls))]
        while todo:
            first, stop = todo.pop()
            if self._load(ranges[first:stop]) > KEPT and stop - first > 1:
                middle = (first + stop) // 2
                todo += [(middle, stop), (first, middle)]
                continue
            most = (ranges[first:stop, [1, 3]] - ranges[first:stop, [0, 2]]).max(axis=0).tolist()
            self.behind += kernels.cut_balls(
                self._grid(), balls[first:stop], ranges[first:stop], writes[first:stop], *self._scratch(*most), sums[first:stop]
            )  # fmt: skip
        return [self._removal(*row) for row in sums.tolist()]

    def is_blind(self, sweep: Sweep) -> bool:
        """Whether material may stand above some of a sweep, or does already where it comes: see `_beneath`."""
        box, path = sweep.bounds[:, :2], sweep.path
        top = min(float(path.start[2]), float(path.end[2])) + sweep.profile.z_max
        return top < self._highest - kernels.ROOF_MM or self._is_roofed(box)

    def _is_roofed(self, box: Floats) -> bool:
        return bool(((box[0] <= self.roofed[:, 1]) & (box[1] >= self.roofed[:, 0])).all(axis=1).any())

    @property
    def _highest(self) -> float:
        """mm, no material is above it."""
        if self.casting is not None:
            return float(self.part.bounds[1, 2]) + self.casting
        return float(self.stock.bounds[1, 2])

    def _beneath(self, raw: Floats, middle: float) -> Removal:
        """What a sweep can take at most where tips are not the highest material; at least nothing.

        raw : (n, m) mm that it has in common with the raw stock. middle : mm, by the tips.
        """
        wide = np.pad(raw, 1)
        n, m = raw.shape
        most = np.max([wide[a : a + n, b : b + m] for a in range(3) for b in range(3)], axis=0)
        hi = float(most.sum()) * self.pitch**2
        return Removal(0.0, min(middle * self.pitch**2, hi), hi, proven=False, note=ROOFED)

    def _raw(self, cells: tuple[int, int, int, int], enter: Floats, leave: Floats) -> Floats:
        """(n, m) mm of lines from `enter` to `leave` (n, m) that lie in the raw stock, between its lowest and highest place."""
        i0, i1, j0, j1 = cells
        bottom, top = np.full((2, *enter.shape), np.nan)
        for a in range(i0 // TILE, (i1 - 1) // TILE + 1):
            for b in range(j0 // TILE, (j1 - 1) // TILE + 1):
                base = self.base(a, b)
                high = base.top if self.casting is None else base.start + self.casting
                ends = [
                    (max(first, TILE * k), min(stop, TILE * (k + 1)))
                    for first, stop, k in ((i0, i1, a), (j0, j1, b))
                ]
                here, there = (
                    tuple(slice(low - at, high - at) for (low, high), at in zip(ends, corner, strict=True))
                    for corner in ((i0, j0), (TILE * a, TILE * b))
                )
                bottom[here], top[here] = base.bottom[there], high[there]
        common = np.minimum(leave, top) - np.maximum(enter, bottom)
        return np.where(common > 0.0, common, 0.0)

    def _removal(self, lo: float, middle: float, hi: float) -> Removal:
        if hi == 0.0:
            return NOTHING
        area = self.pitch**2
        return Removal(lo * area, middle * area, hi * area, proven=False)

    def _met(self, sweep: Sweep, *, write: bool) -> Removal:
        ball = None if self.is_blind(sweep) else ball_block(sweep)
        if ball is not None:
            return self.cut_balls(np.array([ball.row]), np.array([write]))[0]
        cells = self._cells(sweep.bounds)
        if cells is None:
            return NOTHING
        i0, i1, j0, j1 = cells
        self._load(np.array([cells]))
        depth, span = self._scratch(i1 - i0, j1 - j0)
        x, y = self.centres(*cells)
        box, under = sweep.bounds[:, :2], 0
        pieces = list(self._heights(sweep, x, y))
        for enter, leave in pieces:
            behind, roofs = kernels.cut_heights(self._grid(), i0, j0, enter, leave, write, depth, span)
            self.behind, under = self.behind + behind, under + roofs
        sums = np.zeros(3)
        kernels.neighbour_sums(depth, span, i1 - i0, j1 - j0, sums)
        if not (under or self._is_roofed(box)):
            return self._removal(*sums.tolist())
        if under and write:
            self.roofed = np.concatenate([self.roofed, box[None]])
        raw = np.sum([self._raw(cells, *piece) for piece in pieces], axis=0)
        return self._beneath(raw, float(sums[1])) if raw.any() else NOTHING

    def _cells(self, box: Floats) -> tuple[int, int, int, int] | None:
        """Half-open ranges of cells whose middles lie below a box, and one more around; None if none exist."""
        first = np.ceil((box[0, :2] - self.low) / self.pitch - 0.5).astype(int)
        last = np.floor((box[1, :2] - self.low) / self.pitch - 0.5).astype(int)
        if (first > last).any() or (last < 0).any() or (first >= self.shape).any():
            return None
        i0, j0 = np.maximum(first - 1, 0).tolist()
        i1, j1 = np.minimum(last + 2, self.shape).tolist()
        return i0, i1, j0, j1

    def _heights(self, sweep: Sweep, x: Floats, y: Floats) -> Iterator[tuple[Floats, Floats]]:
        """Heights (n, m) at which lines over x, y enter and leave a sweep, inf and -inf where they miss; rising."""
        places = np.stack(np.meshgrid(x, y, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
        rays = sweep.ray_intervals(places, UP)
        first = np.cumsum(rays.counts) - rays.counts
        for k in range(int(rays.counts.max(initial=0))):
            has = rays.counts > k
            low, high = np.full(len(places), np.inf), np.full(len(places), -np.inf)
            low[has], high[has] = rays.enter[first[has] + k], rays.leave[first[has] + k]
            yield low.reshape(len(x), len(y)), high.reshape(len(x), len(y))

    def tiles(self) -> Iterator[tuple[Base, NDArray[np.float32], Floats, Floats]]:
        """Base, lengths (NaN: no vector), x, y (T,), tile by tile."""
        for a, b in np.ndindex(self.lengths.shape[:2]):
            x, y = self.centres(a * TILE, (a + 1) * TILE, b * TILE, (b + 1) * TILE)
            yield self.base(a, b), self.lengths[a, b], x, y


def grid_shape(size: Floats, pitch: float) -> tuple[int, int]:
    """Cells along x and y over a rectangle."""
    nx, ny = (max(1, int(np.ceil(s / pitch - 1e-9))) for s in size[:2])
    return nx, ny
