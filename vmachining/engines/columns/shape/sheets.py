"""What surfaces are made of: points and triangles that grow, points on lines of the lattice, walls across its edges."""

from __future__ import annotations

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines.columns.shape.lattice import Lattice, places, unique
from vmachining.engines.columns.shape.walls import STEP, Heights, jumps

LEVEL_MM = 1e-9
"""By which heights may differ that are one."""


class Mesh:
    """Points and triangles that grow. Points of the surface that lie at the bottom are those of the bottom."""

    def __init__(self) -> None:
        self.points: list[Floats] = []
        self.count = 0
        self.triangles: list[Ints] = []
        self.blocks: list[Ints] = []

    def add(self, places: Floats, z: Floats | float) -> Ints:
        """Numbers of new points."""
        ids = self.count + np.arange(len(places))
        self.points.append(np.column_stack([places, np.broadcast_to(z, len(places))]))
        self.count += len(places)
        return ids

    def take(self, corners: tuple[Ints, Ints, Ints] | Ints, block: Ints | int) -> None:
        """Triangles, but for those that have lost a side."""
        t = np.stack(corners, axis=-1) if isinstance(corners, tuple) else corners
        real = (t[:, 0] != t[:, 1]) & (t[:, 1] != t[:, 2]) & (t[:, 2] != t[:, 0])
        self.triangles.append(t[real])
        self.blocks.append(np.broadcast_to(block, len(t))[real])


class Border:
    """What lies on the lines of the lattice in one sheet, for squares next to it: nodes and walls, as numbers that rise."""

    def __init__(self, lattice: Lattice, i: Ints, j: Ints, ids: Ints) -> None:
        """i, j : doubled, so that what stands on an edge is odd."""
        self.wide, self.tall = 2 * len(lattice.xs), 2 * len(lattice.ys)
        rows, columns = j * self.wide + i, i * self.tall + j
        order = np.argsort(rows, kind="stable")
        self.rows, self.row_ids = rows[order], ids[order]
        order = np.argsort(columns, kind="stable")
        self.columns, self.column_ids = columns[order], ids[order]

    def of(self, i: Ints, j: Ints) -> Ints:
        """Numbers of the points at nodes."""
        return np.asarray(self.row_ids[np.searchsorted(self.rows, 2 * j * self.wide + 2 * i)])

    def along(self, axis: int, line: Ints, low: Ints, high: Ints) -> tuple[Ints, Ints, Ints]:
        """Of what lies strictly between two nodes of lines along an axis: first place, number, and the points by place."""
        keys, ids, step = (
            (self.rows, self.row_ids, self.wide) if axis == 0 else (self.columns, self.column_ids, self.tall)
        )
        first = np.searchsorted(keys, 2 * line * step + 2 * low, side="right")
        return first, np.searchsorted(keys, 2 * line * step + 2 * high) - first, ids


class Edges:
    """Walls that cross edges of the lattice. key (k,) rising : twice the number of the edge's first node, one more along y."""

    def __init__(self, at: Heights, lattice: Lattice, nodes: Ints, z: Floats, owner: Ints) -> None:
        wide = len(lattice.xs)
        i, j = lattice.cells.T
        first = lattice.node(i, j)
        n = wide * len(lattice.ys)
        keys = unique(
            np.concatenate([2 * first, 2 * first + 1, 2 * (first + wide), 2 * first + 3]), 2 * n + 2
        )
        one, along_y = keys // 2, keys % 2
        other = one + np.where(along_y == 1, wide, 1)
        p, q = places(nodes, one, n), places(nodes, other, n)
        a, b = lattice.place(one), lattice.place(other)
        asked = (owner[p] != owner[q]) & (np.abs(z[p] - z[q]) > STEP * np.maximum(*(b - a).T))
        keys, a, b = keys[asked], a[asked], b[asked]
        found = jumps(at, a, b)
        self.key = keys[found.real]
        share = np.clip(found.share[found.real], 1e-3, 1.0 - 1e-3)
        self.place = a[found.real] + share[:, None] * (b - a)[found.real]
        self.z = np.stack([found.first[found.real], found.last[found.real]])
        self.i, self.j = (
            2 * (self.key // 2 % wide) + (1 - self.key % 2),
            2 * (self.key // 2 // wide) + self.key % 2,
        )

    def of(self, keys: Ints) -> Ints:
        """Which of them cross some edges, -1 none."""
        if not len(self.key):
            return np.full(keys.shape, -1)
        at = np.minimum(np.searchsorted(self.key, keys), len(self.key) - 1)
        return np.where(self.key[at] == keys, at, -1)
