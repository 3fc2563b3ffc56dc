"""Nodes, cells and squares of cells over the tiles of a stock."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vmachining.arrays import Bools, Floats, Ints

SHIFT = 0.2360679775
"""Of the inner lines, in steps: no simple share of a tile."""


class Lattice(NamedTuple):
    """xs (n + 1,), ys (m + 1,) mm : lines. cells (k, 2) : (i, j) of those in which something may be; cell (i, j) lies between
    lines i and i + 1, j and j + 1. Elsewhere the top is level, or there is nothing."""

    xs: Floats
    ys: Floats
    cells: Ints

    def node(self, i: Ints, j: Ints) -> Ints:
        """Number of a node."""
        return np.asarray(j * len(self.xs) + i)

    def place(self, node: Ints) -> Floats:
        """(k, 2) mm."""
        return np.column_stack([self.xs[node % len(self.xs)], self.ys[node // len(self.xs)]])


class Squares(NamedTuple):
    """Cells that are one: lines (k,) i0 to i1, j0 to j1, and a label."""

    i0: Ints
    j0: Ints
    i1: Ints
    j1: Ints
    label: Ints


def lattice_of(grid: Floats, size: Ints, high: tuple[float, float], busy: Ints, per: int) -> Lattice:
    """Lines `per` to a tile, and the cells that reach a busy tile.

    grid, size : of the tiles, see `_kernels.py`. high : far corner of the stock, mm. busy : numbers of tiles.
    """
    lines: list[Floats] = []
    for axis in range(2):
        n = int(size[axis]) * per
        at = grid[axis] + (np.arange(n + 1) + SHIFT) * grid[2 + axis] / per
        at[0], at[n] = grid[axis], high[axis]
        lines.append(at)
    n, m = len(lines[0]) - 1, len(lines[1]) - 1
    around = np.arange(-1, per)
    i = (busy % size[0] * per)[:, None, None] + around[None, None, :]
    j = (busy // size[0] * per)[:, None, None] + around[None, :, None]
    i, j = (np.asarray(a).ravel() for a in np.broadcast_arrays(i, j))
    inner = (i >= 0) & (i < n) & (j >= 0) & (j < m)
    found = unique(j[inner] * n + i[inner], n * m)
    return Lattice(lines[0], lines[1], np.column_stack([found % n, found // n]))


def unique(numbers: Ints, count: int) -> Ints:
    """Sorted, of numbers below `count`."""
    if count > 64 * len(numbers):
        return np.unique(numbers)
    seen = np.zeros(count, dtype=np.bool_)
    seen[numbers] = True
    return np.flatnonzero(seen)


def places(held: Ints, numbers: Ints, count: int) -> Ints:
    """Of numbers below `count` among sorted ones; of one that is not there any place."""
    if count > 64 * len(held):
        return np.minimum(np.searchsorted(held, numbers), max(len(held) - 1, 0))
    at = np.zeros(count, dtype=np.int64)
    at[held] = np.arange(len(held))
    return np.asarray(at[numbers])


def free(lattice: Lattice, taken: Ints) -> Squares:
    """What cells (k, 2) leave of the lattice, as squares that are as large as their place among powers of two allows."""
    n, m = len(lattice.xs) - 1, len(lattice.ys) - 1
    level = int(max(n, m) - 1).bit_length()
    i, j = np.zeros(1, dtype=np.int64), np.zeros(1, dtype=np.int64)
    found: list[Ints] = []
    while len(i):
        size, wide = 1 << level, (n >> level) + 1
        held = unique((taken[:, 1] >> level) * wide + (taken[:, 0] >> level), wide * ((m >> level) + 1))
        mixed = _among(j * wide + i, held)
        i0, j0 = i[~mixed] * size, j[~mixed] * size
        found.append(
            np.stack([i0, j0, np.minimum(i0 + size, n), np.minimum(j0 + size, m), np.full(len(i0), -1)])
        )
        if level == 0:
            break
        i = (2 * i[mixed][:, None] + np.array([0, 1, 0, 1])).ravel()
        j = (2 * j[mixed][:, None] + np.array([0, 0, 1, 1])).ravel()
        level -= 1
        inside = (i << level < n) & (j << level < m)
        i, j = i[inside], j[inside]
    return Squares(*np.concatenate(found, axis=1))


def _among(numbers: Ints, held: Ints) -> Bools:
    at = np.minimum(np.searchsorted(held, numbers), max(len(held) - 1, 0))
    return np.asarray(held[at] == numbers) if len(held) else np.zeros(len(numbers), dtype=np.bool_)


def joined(cells: Ints, label: Ints) -> Squares:
    """Cells (k, 2) with a label each: four of one square with one label are a square, again and again."""
    i, j, size = cells[:, 0], cells[:, 1], 1
    found: list[tuple[Ints, Ints, int, Ints]] = []
    while len(i):
        order = np.lexsort((j % 2, i % 2, i // 2, j // 2))
        i, j, label = i[order], j[order], label[order]
        four = np.zeros(len(i), dtype=np.bool_)
        if len(i) > 3:
            same = np.ones(len(i) - 3, dtype=np.bool_)
            for k in range(1, 4):
                stop = len(i) - 3 + k
                same &= (
                    (i[k:stop] // 2 == i[:-3] // 2)
                    & (j[k:stop] // 2 == j[:-3] // 2)
                    & (label[k:stop] == label[:-3])
                )
            at = np.flatnonzero(same)
            for k in range(4):
                four[at + k] = True
            up = i[at] // 2, j[at] // 2, label[at]
        else:
            up = i[:0], j[:0], label[:0]
        found.append((i[~four] * size, j[~four] * size, size, label[~four]))
        (i, j, label), size = up, 2 * size
    if not found:
        none = np.zeros(0, dtype=np.int64)
        return Squares(none, none, none, none, none)
    return Squares(
        np.concatenate([a for a, *_ in found]),
        np.concatenate([b for _, b, *_ in found]),
        np.concatenate([a + s for a, _, s, _ in found]),
        np.concatenate([b + s for _, b, s, _ in found]),
        np.concatenate([c for *_, c in found]),
    )
