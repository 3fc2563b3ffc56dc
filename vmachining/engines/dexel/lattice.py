"""Where the rays of one direction stand, and what is left of them, in flat arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.arrays import Floats, Ints
from vmachining.engines.dexel import _kernels
from vmachining.geometry import RayIntervals
from vmachining.stock import BoxStock, CylinderStock, MeshStock, Stock

STRATA = 16
"""Of so many neighbouring rows (or columns) each has its rays in another sixteenth of the cell, in random order: a wall along
the rows meets rays at all distances, and no other direction meets them in a pattern."""

BYTES = 130
"""Memory of a ray: four numbers of it, one interval with both blocks, and what laying it down takes for a moment."""

SPARE = 1.25
"""Rows of the flat arrays for every ray at the beginning."""


class Lattice(NamedTuple):
    """Rays along coordinate `axis`, na by nb of them over the two coordinates that follow it in turn.

    a0, b0 : mm, corner. ha, hb : mm, sides of a cell. sa (nb,), sb (na,) : place within the cell, by column and by row.
    """

    axis: int
    a0: float
    b0: float
    ha: float
    hb: float
    na: int
    nb: int
    sa: Floats
    sb: Floats

    @property
    def cell(self) -> float:
        """mm^2 that a ray represents."""
        return self.ha * self.hb


class Lists(NamedTuple):
    """Intervals of all rays, see the legend of `_kernels.py`. used (1,) : rows that are given away."""

    first: Ints
    parts: NDArray[np.int32]
    room: NDArray[np.int32]
    low: Floats
    high: Floats
    below: NDArray[np.int32]
    above: NDArray[np.int32]
    used: Ints


def lattice(bounds: Floats, axis: int, spacing: float) -> Lattice:
    """Cells that fill the box (2, 3) seen along an axis, no side longer than `spacing` mm."""
    a, b = (axis + 1) % 3, (axis + 2) % 3
    size = bounds[1] - bounds[0]
    na, nb = (max(1, int(np.ceil(size[k] / spacing - 1e-9))) for k in (a, b))
    rng = np.random.default_rng(axis)
    sa, sb = shifts(nb, rng), shifts(na, rng)
    (a0, b0), (ha, hb) = bounds[0, [a, b]].tolist(), (size[[a, b]] / [na, nb]).tolist()
    return Lattice(axis, a0, b0, ha, hb, na, nb, sa, sb)


def shifts(n: int, rng: np.random.Generator) -> Floats:
    """(n,) places in [0, 1), see `STRATA`."""
    order = np.concatenate([rng.permutation(STRATA) for _ in range(-(-n // STRATA))])[:n]
    return np.asarray((order + rng.random(n)) / STRATA)


def places(lat: Lattice) -> Floats:
    """(n, 3) mm of all rays, 0 along them."""
    out = np.empty((lat.na * lat.nb, 3))
    _kernels.origins(lat, np.arange(len(out)), out)
    return out


def filled(lat: Lattice, stock: Stock) -> Lists:
    """What of the rays is raw stock."""
    inside = crossings(stock, lat)
    count = inside.counts.astype(np.int32)
    room = np.maximum(count, 1).astype(np.int32)
    first = np.cumsum(room, dtype=np.int64) - room
    rows = int(room.sum())
    capacity = int(SPARE * rows) + 64
    low, high = np.zeros(capacity), np.zeros(capacity)
    kept = np.repeat(first, count) + np.arange(len(inside.enter)) - np.repeat(np.cumsum(count) - count, count)
    low[kept], high[kept] = inside.enter, inside.leave
    below, above = np.full((2, capacity), -1, dtype=np.int32)
    return Lists(first, count, room, low, high, below.copy(), above.copy(), np.array([rows]))


def crossings(stock: Stock, lat: Lattice) -> RayIntervals:
    """Where the rays are in the stock, mm along them."""
    where, d = places(lat), lat.axis
    a, b = (d + 1) % 3, (d + 2) % 3
    plan = where[:, [a, b]]
    if d == 2:
        return stock.crossings(plan)
    if isinstance(stock, BoxStock):
        turned: Stock = BoxStock(stock.lo[[a, b, d]], stock.hi[[a, b, d]])
    elif isinstance(stock, MeshStock):
        turned = MeshStock(np.ascontiguousarray(stock.vertices[:, [a, b, d]]), stock.triangles)
    elif isinstance(stock, CylinderStock):
        return _through_cylinder(stock, where, d)
    else:
        raise TypeError(f"rays along x and y through {type(stock).__name__}")
    return turned.crossings(plan)


def _through_cylinder(stock: CylinderStock, where: Floats, d: int) -> RayIntervals:
    """Level rays along x or y through an upright cylinder."""
    aside = where[:, 1 - d] - stock.center[1 - d]
    room = stock.radius**2 - aside * aside
    inside = (room > 0.0) & (where[:, 2] > stock.z[0]) & (where[:, 2] < stock.z[1])
    half = np.sqrt(room[inside])
    return RayIntervals(inside.astype(np.int64), stock.center[d] - half, stock.center[d] + half)
