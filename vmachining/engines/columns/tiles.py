"""Tiles over the stock: which sweeps may still be lowest in each, and which facets of the top lie there."""

from __future__ import annotations

from typing import Any, Self

import numpy as np

from vmachining.arrays import Ints
from vmachining.engines.columns import _kernels
from vmachining.engines.columns.flat_stock import FlatStock
from vmachining.engines.columns.roof import facets_of, roof_of, seams

__all__ = ["Tiling"]

MOST_TILES = 4_000_000
"""Of a stock: 32 MB. Larger ones have larger tiles."""


class Tiling:
    """Tiles of one stock.

    arrays : lists of sweeps, as the kernels know them. roof : facets of the top by tiles.
    seams : (ny, nx) mm, how long the edges of facets are in a tile at most; None without facets.
    """

    def __init__(self, stock: FlatStock, arrays: _kernels.Tiles) -> None:
        self.arrays = arrays
        facets = None if stock.mesh is None else facets_of(stock.mesh)
        self.roof = roof_of(facets, arrays.grid, arrays.size)
        self.seams = None if facets is None else seams(self.roof, facets.length)

    @classmethod
    def over(cls, stock: FlatStock, edge: float) -> Self:
        """Empty tiles with edges of about so many mm."""
        (x0, y0, _), (x1, y1, _) = stock[:2]
        edge = max(edge, float(np.sqrt((x1 - x0) * (y1 - y0) / MOST_TILES)))
        nx, ny = max(1, int(np.ceil((x1 - x0) / edge))), max(1, int(np.ceil((y1 - y0) / edge)))
        grid = np.array([x0, y0, (x1 - x0) / nx, (y1 - y0) / ny])
        none = np.zeros(0, dtype=np.int64)
        return cls(
            stock,
            _kernels.Tiles(grid, np.array([nx, ny]), np.full(nx * ny, -1), none, none, np.array([-1, 0])),
        )

    def __len__(self) -> int:
        return len(self.arrays.first)

    def reached(self, shapes: _kernels.Shapes, k: int) -> tuple[int, int, int, int]:
        """Tiles (first, last + 1) along x and y that sweep k may reach."""
        i0, i1, j0, j1 = _kernels.tile_range(shapes, self.arrays, k)
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

    def packed(self) -> dict[str, Any]:
        """Arrays by name, see `unpacked`."""
        return {f"tiles_{name}": array for name, array in self.arrays._asdict().items()}

    @classmethod
    def unpacked(cls, stock: FlatStock, arrays: dict[str, Any]) -> Self:
        """What `packed` wrote."""
        return cls(stock, _kernels.Tiles(*(arrays[f"tiles_{name}"] for name in _kernels.Tiles._fields)))
