"""Cubes of a stock that earlier sweeps have cut for sure: what a block takes lies in the others (L9).

A cube is known to be cut where it lies in one pose of one sweep; it remembers that sweep, and others those that may meet them.
`Air.left` lists the cubes that are left for a sweep, and `Air.around` the earlier sweeps that have a part in what it takes
there: their number depends on the place, not on how many came before.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines.columns.turning.air import _kernels
from vmachining.engines.columns.turning.rows import Rows
from vmachining.engines.columns.turning.stocks import Solid

CUBES, EDGE_MM = 2e6, 0.3
"""Most cubes of a stock, and least edge: finer ones take longer than they save where cutters have some millimetres."""

ROUNDED = 0.01
"""Of an edge: cubes so near to a box meet it."""

MORE = 3
"""Cubes by which the box of what is left is larger: first cells that its faces divide have wide bounds."""

NODES = 1 << 25
"""Entries of lists, 8 bytes each, above which an `Air` begins anew: what is near a block is added again."""

CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)])


class Left(NamedTuple):
    """What is left for one part of a sweep.

    cubes : (n, 3) by number. corners : (8 n, 3) mm. box : (2, 3) mm, all that counts lies in it.
    """

    cubes: Ints
    corners: Floats
    box: Floats


class Air:
    """Of one stock; sweeps are known by numbers >= 0. For the arrays see `_kernels`."""

    def __init__(self, solid: Solid) -> None:
        low, size = solid.corners.min(axis=0), np.ptp(solid.corners, axis=0)
        self.low, self.edge = low, max(float(np.cbrt(size.prod() / CUBES)), EDGE_MM)
        shape = np.maximum(np.ceil(size / self.edge), 1.0).astype(np.int64)
        self.grid, self._head = np.zeros(shape, dtype=np.int32), np.zeros(shape, dtype=np.int32)
        self._nodes, self._at = np.zeros((4096, 2), dtype=np.int32), np.zeros(2, dtype=np.int64)
        self._room = np.empty((1024, 3), dtype=np.int64)
        self._known, self._numbers = set[int](), 0
        if len(solid.top):
            _kernels.above(np.ascontiguousarray(solid.top), self.grid, self.low, self.edge)

    def __contains__(self, number: int) -> bool:
        return number in self._known

    @property
    def full(self) -> bool:
        """Whether its lists take much memory. A new one says the same after the sweeps near a block, in any order."""
        return bool(self._at[1] > NODES)

    def add(self, number: int, rows: Rows) -> None:
        """One more sweep."""
        self._known.add(number)
        self._numbers = max(self._numbers, number + 1)
        seen, waves = rows.seen_from(np.eye(3), np.zeros(3))
        for k in range(len(rows)):
            _kernels.carve(
                seen, waves, 2 * k, number, self.grid, self._head, self._nodes, self._at, self.low, self.edge
            )
        for k in range(len(rows)):
            cubes = self._met(seen, waves, 2 * k)
            if self._at[1] + len(cubes) > len(self._nodes):
                more = np.zeros((len(self._nodes) + len(cubes), 2), dtype=np.int32)
                self._nodes = np.concatenate([self._nodes, more])
            _kernels.enlist(cubes, number, self._head, self._nodes, self._at)

    def left(self, rows: Rows) -> list[Left]:
        """The cubes that each row may meet, and that are not known to be cut."""
        (seen, waves), out = rows.seen_from(np.eye(3), np.zeros(3)), list[Left]()
        for k in range(len(rows)):
            cubes = self._met(seen, waves, 2 * k).copy()
            corners = self.low + (cubes[:, None] + CORNERS).reshape(-1, 3) * self.edge
            ends = (
                [cubes.min(axis=0) - MORE, cubes.max(axis=0) + 1 + MORE] if len(cubes) else np.zeros((2, 3))
            )
            out.append(Left(cubes, corners, self.low + np.asarray(ends) * self.edge))
        return out

    def around(self, left: list[Left], bounds: Floats) -> tuple[Ints, Ints]:
        """Numbers of the sweeps that may meet what is left, and of those that hold all else in its boxes.

        bounds : (2, 3) mm of the sweep: what lies beyond is of no matter.
        """
        out = np.zeros(self._numbers, dtype=np.uint8)
        for part in left:
            low = np.maximum(part.box[0], bounds[0]) - ROUNDED * self.edge
            high = np.minimum(part.box[1], bounds[1]) + ROUNDED * self.edge
            first = np.maximum(np.floor((low - self.low) / self.edge), 0.0).astype(np.int64)
            last = np.minimum(np.ceil((high - self.low) / self.edge), self.grid.shape).astype(np.int64)
            _kernels.who(part.cubes, first, last, self.grid, self._head, self._nodes, out)
        return np.flatnonzero(out), np.flatnonzero(out == 2)

    def _met(self, seen: Floats, waves: Floats, i: int) -> Ints:
        while True:
            count = _kernels.met(seen, waves, i, self.grid, self.low, self.edge, self._room)
            if count <= len(self._room):
                return self._room[:count]
            self._room = np.empty((2 * count, 3), dtype=np.int64)
