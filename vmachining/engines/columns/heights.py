"""Workpiece of columns as a closed surface: heights over a grid, walls where they stand, and a level bottom.

Heights are known exactly anywhere. Where one jumps along an edge of the grid, the place is found by bisection, and the
cell is divided there: an upright wall is upright in the surface, and follows the true one by chords of a cell.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engines.protocol import StockSurface

__all__ = ["solid_of"]

STEEP = 1.0
"""Slope of an edge of the grid from which on a jump is looked for."""

JUMP = 0.02
"""What is left of a step after bisection, by the edge, from which on it is a jump."""

HALVINGS = 30

Heights = Callable[[Floats], Floats]
"""Heights over places (k, 2)."""


class _Jumps:
    """Jumps along edges of the grid between neighbours along one axis.

    number : as the edges, -1 where there is none. place : (k, 2) mm. first, last : (k,) mm, heights on the side of the edge's
    first and of its last point.
    """

    def __init__(self, xs: Floats, ys: Floats, height: Floats, at: Heights, along: int) -> None:
        steps = np.diff(height, axis=1 - along)
        size = (xs[1] - xs[0]) if along == 0 else (ys[1] - ys[0])
        rows, cols = np.nonzero(np.abs(steps) > STEEP * size)
        a = np.column_stack([xs[cols], ys[rows]])
        b = np.column_stack([xs[cols + (along == 0)], ys[rows + (along == 1)]])
        low, high = height[rows, cols], height[rows + (along == 1), cols + (along == 0)]
        for _ in range(HALVINGS if len(a) else 0):
            middle = 0.5 * (a + b)
            z = at(middle)
            left = np.abs(z - low) > np.abs(high - z)  # where most of the step is
            a, low = np.where(left[:, None], a, middle), np.where(left, low, z)
            b, high = np.where(left[:, None], middle, b), np.where(left, z, high)
        real = np.abs(high - low) > JUMP * size
        self.number = np.full(steps.shape, -1, dtype=np.int64)
        self.number[rows[real], cols[real]] = np.arange(int(real.sum()))
        self.place, self.first, self.last = 0.5 * (a + b)[real], low[real], high[real]


def solid_of(
    xs: Floats, ys: Floats, height: Floats, owner: Ints, bottom: float, at: Heights | None = None
) -> StockSurface:
    """The solid between a level bottom and heights over a grid, where it has any.

    Parameters
    ----------
    xs, ys : (n,), (m,) mm, rising. height : (m, n) mm, at or above the bottom. owner : (m, n) block at each place, -1.
    at : heights anywhere, for walls between the places; None: walls lean by a step of the grid.

    Notes
    -----
    Two triangles a cell, above and below. A corner whose height is the bottom is one point of both, so where all four
    are there is nothing, and the surface closes. A jump along an edge is three points: at the bottom, and at both heights.
    """
    m, n = height.shape
    grid = m * n
    low = np.arange(grid).reshape(m, n)
    high = np.where(height > bottom, low + grid, low)
    x, y = (a.ravel() for a in np.meshgrid(xs, ys))
    points = [np.column_stack([x, y, np.full(grid, bottom)]), np.column_stack([x, y, height.ravel()])]
    jumps: list[
        tuple[Ints, Ints]
    ] = []  # number of each edge; (k, 3) points: below, on the first side, on the last side
    count = 2 * grid
    for along in (0, 1):
        if at is None:
            shape = (m, n - 1) if along == 0 else (m - 1, n)
            jumps.append((np.full(shape, -1, dtype=np.int64), np.zeros((0, 3), dtype=np.int64)))
            continue
        found = _Jumps(xs, ys, height, at, along)
        k = len(found.place)
        ids = count + np.arange(k)[:, None] + k * np.arange(3)
        for side, z in ((1, found.first), (2, found.last)):
            ids[:, side] = np.where(z > bottom, ids[:, side], ids[:, 0])
        points += [np.column_stack([found.place, z]) for z in (np.full(k, bottom), found.first, found.last)]
        jumps.append((found.number, ids))
        count += 3 * k
    (flat_h, at_h), (flat_v, at_v) = jumps
    broken = (flat_h[:-1] >= 0) | (flat_h[1:] >= 0) | (flat_v[:, :-1] >= 0) | (flat_v[:, 1:] >= 0)
    full = broken | (
        (high[:-1, :-1] != low[:-1, :-1])
        | (high[:-1, 1:] != low[:-1, 1:])
        | (high[1:, :-1] != low[1:, :-1])
        | (high[1:, 1:] != low[1:, 1:])
    )
    triangles, blocks = [], []
    whole = full & ~broken
    # the diagonal that lies lower, so that no ridge is made of two slopes
    falling = height[:-1, :-1] + height[1:, 1:] <= height[:-1, 1:] + height[1:, :-1]
    for corners_of, up in ((high, True), (low, False)):
        a, b, c, d = corners_of[:-1, :-1], corners_of[:-1, 1:], corners_of[1:, 1:], corners_of[1:, :-1]
        for mask, corners in (
            (whole & falling, ((a, b, c), (a, c, d))),
            (whole & ~falling, ((a, b, d), (b, c, d))),
        ):
            for one in corners:
                t = np.stack([v[mask] for v in one], axis=1)
                triangles.append(t if up else t[:, ::-1])
                blocks.append(owner[:-1, :-1][mask] if up else np.full(len(t), -1))
    pieces: list[tuple[int, int, int]] = []
    owners: list[int] = []
    for j, i in np.argwhere(broken).tolist():
        ring: list[tuple[int, int, tuple[int, int, int] | None]] = []
        for (row, col), edge, ids, forward in (
            ((j, i), flat_h[j, i], at_h, True), ((j, i + 1), flat_v[j, i + 1], at_v, True),
            ((j + 1, i + 1), flat_h[j + 1, i], at_h, False), ((j + 1, i), flat_v[j, i], at_v, False),
        ):  # fmt: skip
            jump = None
            if edge >= 0:
                base, first, last = ids[edge].tolist()
                jump = (base, first, last) if forward else (base, last, first)
            ring.append((int(low[row, col]), int(high[row, col]), jump))
        before = len(pieces)
        _divided(ring, pieces)
        owners += [int(owner[j, i])] * (len(pieces) - before)
    triangles.append(np.array(pieces, dtype=np.int64).reshape(-1, 3))
    blocks.append(np.array(owners, dtype=np.int64))
    sides = (
        (full[0], flat_h[0], at_h, low[0, :-1], low[0, 1:], high[0, :-1], high[0, 1:], True),
        (full[-1], flat_h[-1], at_h, low[-1, 1:], low[-1, :-1], high[-1, 1:], high[-1, :-1], False),
        (full[:, 0], flat_v[:, 0], at_v, low[1:, 0], low[:-1, 0], high[1:, 0], high[:-1, 0], False),
        (full[:, -1], flat_v[:, -1], at_v, low[:-1, -1], low[1:, -1], high[:-1, -1], high[1:, -1], True),
    )
    for mask, number, ids, a, b, c, d, forward in sides:
        plain = mask & (number < 0)
        walls = [np.stack([v[plain] for v in one], axis=1) for one in ((a, b, d), (a, d, c))]
        some = np.flatnonzero(number >= 0)
        below, near, far = (ids[number[some], s] for s in ((0, 1, 2) if forward else (0, 2, 1)))
        ends = [v[some] for v in (b, d)] + [far, near] + [v[some] for v in (c, a)]  # seen from below the jump
        walls += [np.stack([below, u, v], axis=1) for u, v in pairwise(ends)]
        for t in walls:
            triangles.append(t)
            blocks.append(np.full(len(t), -1))
    return _closed(
        np.concatenate(points), np.concatenate(triangles), np.concatenate(blocks), _is_low(grid, count, jumps)
    )


def _is_low(grid: int, count: int, jumps: list[tuple[Ints, Ints]]) -> Bools:
    """(count,) which points lie at the bottom."""
    low = np.zeros(count, dtype=np.bool_)
    low[:grid] = True
    for _, ids in jumps:
        low[ids[:, 0]] = True
    return low


def _divided(
    ring: list[tuple[int, int, tuple[int, int, int] | None]], out: list[tuple[int, int, int]]
) -> None:
    """Triangles of a cell with jumps along edges: two parts and the wall between them, or one part where there are not two.

    ring : for each corner its points below and above, and of a jump on the edge behind it the point below and those above
    on this and on the far side.
    """
    parts: list[tuple[list[int], list[int]]] = [([], [])]
    walls: list[tuple[int, int]] = []
    two = sum(jump is not None for *_, jump in ring) == 2
    for below, above, jump in ring:
        parts[-1][0].append(below)
        parts[-1][1].append(above)
        if jump is not None:
            parts[-1][0].append(jump[0])
            parts[-1][1].append(jump[1])
            walls.append(jump[1:])
            if two:
                parts.append(([], []))
                parts[-1][0].append(jump[0])
            parts[-1][1].append(jump[2])
    if two:  # what comes behind the second jump belongs to what was before the first
        tail, head = parts.pop(), parts[0]
        parts[0] = (tail[0] + head[0], tail[1] + head[1])
        (a, b), (c, d) = walls
        out += [(b, c, d), (b, d, a)]
    for lower, upper in parts:
        out += [(upper[0], upper[k], upper[k + 1]) for k in range(1, len(upper) - 1)]
        out += [(lower[0], lower[k + 1], lower[k]) for k in range(1, len(lower) - 1)]


def _closed(points: Floats, mesh: Ints, block: Ints, is_low: Bools) -> StockSurface:
    """Without triangles of no area, and without pairs that lie on each other at the bottom."""
    real = (mesh[:, 0] != mesh[:, 1]) & (mesh[:, 1] != mesh[:, 2]) & (mesh[:, 2] != mesh[:, 0])
    mesh, block = mesh[real], block[real]
    flat = is_low[mesh].all(axis=1)
    keys = np.sort(mesh[flat], axis=1)
    _, inverse, counts = np.unique(keys, axis=0, return_inverse=True, return_counts=True)
    keep = np.ones(len(mesh), dtype=np.bool_)
    keep[np.flatnonzero(flat)[counts[inverse.ravel()] == 2]] = False
    mesh, block = mesh[keep], block[keep]
    used, compact = np.unique(mesh, return_inverse=True)
    return StockSurface(points[used], compact.reshape(-1, 3).astype(np.int64), block.astype(np.int64))
