"""The workpiece as closed triangles: signs of nodes from the upright rays, places from the ends of rays of all directions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.dexel.contour import _kernels
from vmachining.engines.dexel.grid import RayGrid
from vmachining.engines.dexel.lattice import Lattice, Lists
from vmachining.engines.protocol import StockSurface

MOST_QUADS = 600_000
"""Pairs of triangles; above that every second, third, ... ray is taken."""


def triangles(grids: Sequence[RayGrid], box: Floats) -> StockSurface:
    """Closed triangles that know their block; edges where solids touch may have four of them.

    grids : along z, or along z, x, y.
    """
    upright, flat, whole, half = grids[0], np.zeros(0), np.zeros(0, np.int64), np.zeros(0, np.int32)
    nothing = Lists(whole, half, half, flat, flat, half, half, np.zeros(1, np.int64))
    nowhere = [Lattice(axis, 0.0, 0.0, 1.0, 1.0, 0, 0, flat, flat) for axis in (0, 1)]
    lats = [grid.lattice for grid in grids] + nowhere[: 3 - len(grids)]
    lists = [grid.lists for grid in grids] + [nothing] * (3 - len(grids))
    lat = upright.lattice
    tall = float(box[1, 2] - box[0, 2])
    layers = grids[1].lattice.nb if len(grids) > 1 else max(1, round(tall / min(lat.ha, lat.hb)))
    step = 1
    while True:
        n = np.array([-(-v // step) for v in (lat.na, lat.nb, layers)])
        size = step * np.array([lat.ha, lat.hb, tall / layers])
        count = int(_kernels.count(lat, upright.lists, step, box, size, n))
        if count <= MOST_QUADS:
            break
        step += 1
    sums, cells = np.empty((4 * count + 8, 13)), np.empty((4 * count + 8, 3), dtype=np.int64)
    quads, blocks = np.empty((count, 4), dtype=np.int64), np.empty(count, dtype=np.int64)
    used = np.zeros(1, dtype=np.int64)
    _kernels.contour(tuple(lats), tuple(lists), step, box, size, n, sums, cells, quads, blocks, used)
    points = np.empty((int(used[0]), 3))
    _kernels.settle(sums, cells, box, size, points)
    a, b, c, d = quads.T
    short = np.linalg.norm(points[a] - points[c], axis=1) <= np.linalg.norm(points[b] - points[d], axis=1)
    one = np.where(short[:, None], np.stack([a, b, c], 1), np.stack([a, b, d], 1))
    other = np.where(short[:, None], np.stack([a, c, d], 1), np.stack([b, c, d], 1))
    return StockSurface(points, np.concatenate([one, other]), np.concatenate([blocks, blocks]))
