"""Many straight blocks in one kernel call: here of ball, flat and bull nose cutters for upright rays of one interval each.

1. Rays of a window around all blocks become a map of heights; a ray with several intervals, or a cutter whose top comes below
   the stock, sends the blocks the general way (`RayGrid.removed`).
2. Blocks are taken off row by row of the map, in order, in loops that several rays share (SIMD); two threads take half of the
   rows each.
3. A block that continues where the one before it ended, and not down, asks no rays behind its beginning.
4. Sums for volume and interval are those of the general way.

`level.py` and `side/` do so for rays along x and y, any cutter on level lines and balls on any line, with any intervals.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.engines.dexel.batch import _kernels
from vmachining.engines.dexel.grid import Look, RayGrid, look
from vmachining.geometry import Line
from vmachining.sweep import Sweep
from vmachining.tool import Profile

__all__ = ["RoundEnd", "cut_lines", "looks_of", "round_end", "takes_line"]

THREADED = 64
"""Rows of a window above which several threads share them."""


class RoundEnd(NamedTuple):
    """A cutter with a flat bottom of radius r1, a quarter circle of radius rc, and a straight flank; mm.

    tip, top : heights of both ends above the origin of the profile.
    """

    r1: float
    rc: float
    tip: float
    top: float


def round_end(profile: Profile) -> RoundEnd | None:
    """A profile as one of these; None if it is another."""
    points, radii = profile.points, profile.radii
    (r, z), (end_r, top) = points[0].tolist(), points[-1].tolist()
    if len(radii) == 1 and radii[0] == 0.0 and r == end_r:
        return RoundEnd(r, 0.0, z, top)
    if len(radii) == 2 and radii[0] > 0.0 and radii[1] == 0.0 and points[1, 0] == end_r:
        rc = float(radii[0])
        if np.allclose(
            [end_r - r, points[1, 1] - z, *(profile.centers[0] - [r, z + rc])], [rc, rc, 0.0, 0.0], atol=1e-12
        ):
            return RoundEnd(r, rc, z, top)
    return None


def takes_line(sweep: Sweep, highest: float) -> RoundEnd | None:
    """The cutter, where this way takes the block: on a line, the top above the stock; a corner radius only on a level line."""
    path = sweep.path
    if not isinstance(path, Line):
        return None
    shape = round_end(sweep.profile)
    if shape is None or min(path.start[2], path.end[2]) + shape.top < highest:
        return None
    ramps = path.start[2] != path.end[2] and (path.start[:2] != path.end[:2]).any()
    return None if shape.r1 > 0.0 and shape.rc > 0.0 and ramps else shape


def cut_lines(grid: RayGrid, shape: RoundEnd, start: Floats, end: Floats, blocks: Ints) -> Floats | None:
    """(n, 6) sums over rays of every block, see the legend of `_kernels.py`.

    None where a ray has several intervals: nothing is cut then.

    start, end : (n, 3) mm, origins of the profile. blocks : (n,) their numbers.
    """
    lat, r = grid.lattice, shape.r1 + shape.rc
    low, high = np.minimum(start, end).min(axis=0) - r, np.maximum(start, end).max(axis=0) + r
    i0, i1, j0, j1 = grid.window(np.stack([low, high]))
    n, m = i1 - i0, j1 - j0
    out = np.zeros((len(start), 6))
    out[:, 5] = -np.inf
    if n <= 0 or m <= 0:
        return out
    tops = np.empty((n, m)), np.empty((n, m)), np.empty((n, m), dtype=np.int32)
    if not _kernels.gather(lat, grid.lists, i0, j0, *tops):
        return None
    begin, travel = start + [0.0, 0.0, shape.tip], np.ascontiguousarray(end - start)
    numbers = blocks.astype(np.int32)
    threads = min(os.cpu_count() or 1, max(1, n // THREADED))
    cuts = np.linspace(0, n, threads + 1).astype(np.int64).tolist()
    parts = [out.copy() for _ in range(threads)]

    def work(k: int) -> None:
        _kernels.lines(lat, i0, j0, cuts[k], cuts[k + 1], *tops, begin, travel, numbers, *shape[:2], parts[k])

    if threads == 1:
        work(0)
    else:
        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(work, range(threads)))
    for part in parts:
        out[:, [0, 1, 4]] += part[:, [0, 1, 4]]
        out[:, [2, 3, 5]] = np.maximum(out[:, [2, 3, 5]], part[:, [2, 3, 5]])
    _kernels.scatter(lat, grid.lists, i0, j0, *tops)
    return out


def looks_of(grid: RayGrid, shape: RoundEnd, start: Floats, end: Floats, sums: Floats) -> list[Look]:
    """Volumes and intervals from the sums of `cut_lines`; where no ray loses anything see `RayGrid.unseen`."""
    lat, box = grid.lattice, grid.box
    lowest = np.minimum(start[:, 2], end[:, 2]) + shape.tip
    tall = np.clip(box[1, 2] - np.maximum(lowest, box[0, 2]), 0.0, None)
    out = []
    for row, most in zip(sums.tolist(), tall.tolist(), strict=True):
        if row[4]:
            out.append(look(lat.cell, *row[:5]))
        elif row[5] <= -lat.ha:
            out.append(Look(0.0, 0.0))
        else:
            out.append(look(lat.cell, 0.0, 0.0, max(row[2], most), 0.0, 0.0))
    return out
