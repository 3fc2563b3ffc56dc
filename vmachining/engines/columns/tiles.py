"""Tiles over the stock: which sweeps may still be lowest in each, and which facets of the top lie there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from vmachining.arrays import Floats, Ints
from vmachining.engines.columns import _kernels
from vmachining.engines.columns.flat_stock import FlatStock
from vmachining.engines.columns.roof import facets_of, roof_of, seams
from vmachining.engines.protocol import Share

FIELD = 6
"""Edge of the squares that are dealt to parts, in tiles, see docs/measured/columns.md."""

MOST_TILES = 4_000_000
"""Of a stock: 32 MB. Larger ones have larger tiles."""


class Tiling:
    """Tiles of one stock.

    arrays : lists of sweeps, as the kernels know them. roof : facets of the top by tiles.
    seams : (ny, nx) mm, how long the edges of facets are in a tile at most; None without facets.
    """

    def __init__(self, stock: FlatStock, grid: Floats, size: Ints) -> None:
        tiles, none = int(size[0] * size[1]), np.zeros(0, dtype=np.int64)
        self.arrays = arrays = _kernels.Tiles(
            grid, size, np.full(tiles, -1), none, none, np.array([-1, 0]), np.ones(tiles, dtype=np.uint8)
        )
        facets = None if stock.mesh is None else facets_of(stock.mesh)
        self.roof = roof_of(facets, arrays.grid, arrays.size)
        self.seams = None if facets is None else seams(self.roof, facets.length)

    @classmethod
    def over(cls, stock: FlatStock, edge: float) -> Self:
        """Empty tiles with edges of about so many mm."""
        (x0, y0, _), (x1, y1, _) = stock[:2]
        edge = max(edge, float(np.sqrt((x1 - x0) * (y1 - y0) / MOST_TILES)))
        nx, ny = max(1, int(np.ceil((x1 - x0) / edge))), max(1, int(np.ceil((y1 - y0) / edge)))
        return cls(stock, np.array([x0, y0, (x1 - x0) / nx, (y1 - y0) / ny]), np.array([nx, ny]))

    def __len__(self) -> int:
        return len(self.arrays.first)

    def reached(self, shapes: _kernels.Shapes, k: int) -> tuple[int, int, int, int]:
        """Tiles (first, last + 1) along x and y that sweep k may reach."""
        tiles, R = self.arrays, float(shapes.head[int(shapes.rows[k, 8]), 1])
        i0, i1, j0, j1 = _kernels.tile_range(shapes.rows, k, R, tiles.grid, tiles.size)
        return i0, i1, j0, j1

    def make_room(self, shapes: _kernels.Shapes, k: int) -> None:
        """Free entries for everything that sweep k can add: one in each tile that it reaches."""
        i0, i1, j0, j1 = self.reached(shapes, k)
        self._free(max(i1 - i0, 0) * max(j1 - j0, 0))

    def _free(self, wanted: int) -> None:
        """See to free entries; there are at least twice as many as before where they do not suffice."""
        tiles = self.arrays
        if tiles.free[1] >= wanted:
            return
        old = len(tiles.sweep)
        new = max(old, wanted, 1024)
        after = np.concatenate([tiles.after, np.arange(old + 1, old + new + 1)])
        after[-1] = tiles.free[0]
        sweep = np.concatenate([tiles.sweep, np.zeros(new, dtype=np.int64)])
        self.arrays = tiles._replace(sweep=sweep, after=after, free=np.array([old, tiles.free[1] + new]))

    def lists(self, shapes: _kernels.Shapes, first: int, stop: int) -> dict[int, Ints]:
        """Lists of all tiles that sweeps `first` to `stop - 1` may reach."""
        found: dict[int, Ints] = {}
        for k in range(first, stop):
            i0, i1, j0, j1 = self.reached(shapes, k)
            for t in (np.arange(i0, i1) + self.arrays.size[0] * np.arange(j0, j1)[:, None]).ravel().tolist():
                if t not in found:
                    found[t] = _kernels.listed(self.arrays, t)
        return found

    def restore(self, lists: dict[int, Ints]) -> None:
        """Give tiles the lists that they had."""
        for t, ids in lists.items():
            self._free(len(ids))
            _kernels.assign(self.arrays, t, ids)

    def seam_length(self, reach: tuple[int, int, int, int]) -> float:
        """mm, of the edges of facets in tiles (first, last + 1) along x and y."""
        i0, i1, j0, j1 = reach
        return 0.0 if self.seams is None else float(self.seams[j0:j1, i0:i1].sum())

    def on_circle(self, radius: float) -> Ints:
        """Numbers of the tiles that a circle about the middle of all meets."""
        (_, _, w, h), (nx, ny) = self.arrays.grid.tolist(), self.arrays.size.tolist()
        ends = [(np.arange(n + 1) - 0.5 * n) * step for n, step in ((nx, w), (ny, h))]
        near = [np.maximum(np.maximum(e[:-1], -e[1:]), 0.0) for e in ends]
        far = [np.maximum(-e[:-1], e[1:]) for e in ends]
        slack = 1e-6 * radius
        met = (np.hypot(near[0], near[1][:, None]) <= radius + slack) & (
            np.hypot(far[0], far[1][:, None]) >= radius - slack
        )
        return np.flatnonzero(met)

    # -- who cuts where ------------------------------------------------------------------------------------

    def divide(self, share: Share) -> None:
        """From now on only the fields of one of several parts are ours, and what is known of the others is forgotten.

        Fields are squares of at most `FIELD` tiles, dealt to the parts in turn along x; each row of them begins half a field
        beside the one before, so that lines along x, along y and at 45 degrees go through all parts.
        """
        nx, ny = self.arrays.size.tolist()
        edge = max(1, min(FIELD, max(nx, ny) // (2 * share.parts)))
        row = np.arange(ny)[:, None] // edge
        part = (np.arange(nx) + row * (edge // 2)) // edge % share.parts
        self.arrays.own[:] = (part == share.part).ravel()
        tile, sweep = self.entries()
        mine = self.arrays.own[tile] != 0
        self.fill(tile[mine], sweep[mine])

    def look_at(self, box: Floats) -> None:
        """Forget all lists; from now on only the tiles that a box (2, 3), mm, reaches are ours."""
        x, y, w, h = self.arrays.grid.tolist()
        (x0, y0, _), (x1, y1, _) = box.tolist()
        nx, ny = self.arrays.size.tolist()
        i0, i1 = (int(np.clip(np.floor((v - x) / w), -1, nx)) for v in (x0, x1))
        j0, j1 = (int(np.clip(np.floor((v - y) / h), -1, ny)) for v in (y0, y1))
        self._own[:] = 0
        self._own[max(j0 - 1, 0) : j1 + 2, max(i0 - 1, 0) : i1 + 2] = 1  # one more for the rounding of edges
        self.fill(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))

    @property
    def _own(self) -> NDArray[np.uint8]:
        return self.arrays.own.reshape(self.arrays.size[::-1].tolist())

    def share_of(self, shapes: _kernels.Shapes, first: int, stop: int) -> float:
        """Which part of the tiles that sweeps `first` to `stop - 1` may reach is ours; 0 where they reach none."""
        mine = tiles = 0
        for k in range(first, stop):
            i0, i1, j0, j1 = self.reached(shapes, k)
            own = self._own[j0:j1, i0:i1]
            mine, tiles = mine + int(np.count_nonzero(own)), tiles + own.size
        return mine / max(tiles, 1)

    # -- lists as arrays -----------------------------------------------------------------------------------

    def entries(self) -> tuple[Ints, Ints]:
        """(m,) tile and (m,) sweep of all entries; tiles rise, sweeps of one tile in their order."""
        tiles = self.arrays
        at = np.flatnonzero(tiles.first >= 0)
        e = tiles.first[at]
        found = [(at, tiles.sweep[e])]
        while len(at):
            e = tiles.after[e]
            at, e = at[e >= 0], e[e >= 0]
            found.append((at, tiles.sweep[e]))
        tile, sweep = (np.concatenate(column) for column in zip(*found, strict=True))
        order = np.argsort(tile, kind="stable")
        return tile[order], sweep[order]

    def fill(self, tile: Ints, sweep: Ints) -> None:
        """Forget all lists and take these, see `entries`."""
        m, first = len(tile), np.full(len(self), -1)
        begins, ends = np.ones(m, dtype=np.bool_), np.ones(m, dtype=np.bool_)
        begins[1:] = ends[:-1] = tile[1:] != tile[:-1]
        first[tile[begins]] = np.flatnonzero(begins)
        after = np.where(ends, -1, np.arange(1, m + 1))
        self.arrays = self.arrays._replace(first=first, sweep=sweep, after=after, free=np.array([-1, 0]))

    def packed(self) -> dict[str, Any]:
        """Arrays by name, see `unpacked`."""
        tile, sweep = self.entries()
        found = {"grid": self.arrays.grid, "size": self.arrays.size, "tile": tile, "sweep": sweep}
        return {f"tiles_{name}": array for name, array in found.items()}

    @classmethod
    def unpacked(cls, stock: FlatStock, arrays: dict[str, Any], sweeps: int) -> Self:
        """What `packed` wrote; kernels take every number in it for the place of a tile or of one of `sweeps`."""
        self = cls(stock, arrays["tiles_grid"], arrays["tiles_size"])
        tile, sweep = arrays["tiles_tile"], arrays["tiles_sweep"]
        for numbers, most in ((tile, len(self)), (sweep, sweeps)):
            if len(numbers) and not (numbers.min() >= 0 and numbers.max() < most):
                raise ValueError("its tiles list sweeps that are not there")
        self.fill(tile, sweep)
        return self

    @classmethod
    def join(cls, stock: FlatStock, parts: Sequence[Self], numbers: Sequence[Ints]) -> Self:
        """Tiles of a workpiece that several parts cut, each its own; numbers : of their sweeps in the whole."""
        self = cls(stock, parts[0].arrays.grid, parts[0].arrays.size)
        found = [
            (tile, of[sweep]) for (tile, sweep), of in zip((p.entries() for p in parts), numbers, strict=True)
        ]
        tile, sweep = (np.concatenate(column) for column in zip(*found, strict=True))
        order = np.argsort(tile, kind="stable")
        self.fill(tile[order], sweep[order])
        return self
