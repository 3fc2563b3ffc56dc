"""The workpiece of upright vectors as closed prisms, for pictures and rough files."""

from __future__ import annotations

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.protocol import StockSurface
from vmachining.engines.vectors.cuts import Cuts
from vmachining.engines.vectors.grid._kernels import TILE
from vmachining.engines.vectors.upright import UprightVectors
from vmachining.stock import BoxStock

ACROSS = 160
"""Prisms along the longer side at most."""

THIN_MM = 1e-6
"""Prisms lower than this are left out."""


def prisms(upright: UprightVectors, cuts: Cuts) -> StockSurface:
    """One prism for every so many cells, as high as its middle one."""
    step = max(1, -(-max(upright.shape) // ACROSS))
    x, y, low, high = list[Floats](), list[Floats](), list[Floats](), list[Floats]()
    for base, lengths, xs, ys in upright.tiles():
        # every step-th cell of the whole grid, counted from its corner
        i0, j0 = (round((v[0] - c) / upright.pitch - 0.5) for v, c in zip((xs, ys), upright.low, strict=True))
        i = np.arange((step // 2 - i0) % step, TILE, step)
        j = np.arange((step // 2 - j0) % step, TILE, step)
        cells = np.ix_(i, j)
        top = np.maximum(base.start[cells] + lengths[cells], base.bottom[cells])
        full = top > base.bottom[cells] + THIN_MM  # NaN: no vector
        at_x, at_y = np.broadcast_arrays(xs[i][:, None], ys[j])
        x.append(at_x[full])
        y.append(at_y[full])
        low.append(base.bottom[cells][full])
        high.append(top[full])
    place = np.column_stack([np.concatenate(x), np.concatenate(y)])
    bottom, top = np.concatenate(low), np.concatenate(high)
    cube, _ = BoxStock((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0)).mesh(1.0)
    points = np.empty((len(place), 8, 3))
    points[..., :2] = place[:, None] + cube.vertices[:, :2] * (step * upright.pitch)
    points[..., 2] = bottom[:, None] + cube.vertices[:, 2] * (top - bottom)[:, None]
    triangles = cube.triangles + 8 * np.arange(len(place))[:, None, None]
    owner = cuts.owners(np.column_stack([place, top]), top)
    return StockSurface(points.reshape(-1, 3), triangles.reshape(-1, 3), np.repeat(owner, 12))
