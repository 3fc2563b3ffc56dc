"""What is not stock on upright lines, for stocks of triangles and STEP: rays treat it like one more earlier sweep.

Triangles of plane faces are the stock itself. Those of curved ones lie within a chord of it, which is more than rays can tell
apart: near such a face nothing is said (`is_exact`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.engines.brep import _kernels
from vmachining.engines.brep.blank import Blank
from vmachining.engines.brep.step import read_step
from vmachining.sweep import RayIntervals

__all__ = ["Outside"]

CHORD_MM = 0.01
"""Of the triangles of curved faces: how far beside them nothing is said."""

MOST = 5_000_000
"""Places of triangles in the cells of a raster, some 60 bytes each while it is made."""


class Outside:
    """Everything but a closed solid, crossed by lines along z.

    Parameters
    ----------
    corners : (m, 3, 3) float
        mm, triangles of a closed surface; neighbours share their corners to the last bit.
    curved : (m,) bool
        Which of them stand for a curved face.
    """

    def __init__(self, corners: ArrayLike, curved: ArrayLike | None = None) -> None:
        corner = np.asarray(corners, dtype=np.float64)
        is_curved = np.zeros(len(corner), dtype=bool) if curved is None else np.asarray(curved, dtype=bool)
        self._curved = corner[is_curved].min(axis=1) - CHORD_MM, corner[is_curved].max(axis=1) + CHORD_MM
        (ax, ay), (bx, by), (cx, cy) = (corner[:, k, :2].T for k in range(3))
        twice = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        self._corners, self._up = np.ascontiguousarray(corner[twice != 0.0]), twice[twice != 0.0] > 0.0
        low, high = self._corners[:, :, :2].min(axis=1), self._corners[:, :, :2].max(axis=1)
        self._origin, size = low.min(axis=0), np.ptp(np.concatenate([low, high]), axis=0)
        wide = int(np.clip(np.sqrt(len(low)), 1, 512))
        while True:
            self._wide = np.full(2, wide)
            self._pitch = size * (1.0 + 1e-9) / wide
            # a cell more on every side: whoever rounds otherwise finds its triangles there, too
            first = np.maximum(np.floor((low - self._origin) / self._pitch).astype(np.int64) - 1, 0)
            last = np.minimum(np.floor((high - self._origin) / self._pitch).astype(np.int64) + 1, wide - 1)
            span = last - first + 1
            held = span.prod(axis=1)
            if wide == 1 or held.sum() <= max(MOST, 16 * len(low)):
                break
            wide //= 2  # long triangles that lie across it
        owner = np.repeat(np.arange(len(low)), held)
        rank = np.arange(len(owner)) - np.repeat(np.cumsum(held) - held, held)
        across, along = np.divmod(rank, span[owner, 1])
        cell = (first[owner, 0] + across) * self._wide[1] + first[owner, 1] + along
        self._member = owner[np.argsort(cell, kind="stable")]
        self._first = np.searchsorted(np.sort(cell), np.arange(self._wide.prod() + 1))

    @classmethod
    def of(cls, stock: Blank) -> Outside | None:
        """Of a stock of triangles or STEP; None for a box and a cylinder."""
        if stock.kind == "triangles":
            return cls(np.reshape(stock.triangles, (-1, 3, 3)))
        if stock.kind == "step":
            found = read_step(stock.file, CHORD_MM)
            return cls(found.vertices[found.triangles], found.curved)
        return None

    @property
    def bounds(self) -> Floats:
        """(2, 3): there are none."""
        return np.array([np.full(3, -np.inf), np.full(3, np.inf)])

    def is_exact(self, box: Floats) -> bool:
        """Whether no curved face comes near a (2, 3) box."""
        low, high = self._curved
        return not ((low <= box[1]) & (high >= box[0])).all(axis=1).any()

    def ray_intervals(self, origins: ArrayLike, directions: ArrayLike) -> RayIntervals:
        """As of a sweep; ends that are endless are infinite.

        directions : (0, 0, 1), the only one there is.
        """
        places = np.ascontiguousarray(origins, dtype=np.float64)
        crossed, z = np.zeros(len(places), dtype=np.int64), np.zeros(0)
        for fill in (False, True):
            _kernels.crossings(
                self._corners, self._up, self._first, self._member, self._origin, self._pitch, self._wide,
                places, crossed, z, fill,
            )  # fmt: skip
            z = z if fill else np.empty(int(crossed.sum()))
        ray = np.repeat(np.arange(len(places)), crossed)
        rank = np.arange(len(ray)) - (np.cumsum(crossed) - crossed)[ray]
        # in pairs, but where a line meets a corner, or an edge of two upright triangles
        paired = rank < crossed[ray] // 2 * 2
        ray, z, rank, crossed = ray[paired], z[paired], rank[paired], crossed // 2 * 2
        ends = crossed + 2  # of what is outside: below everything, and above
        first = np.cumsum(ends) - ends
        stops = np.empty(int(ends.sum()))
        stops[first] = -np.inf
        stops[first + ends - 1] = np.inf
        stops[first[ray] + 1 + rank] = z
        stops -= np.repeat(places[:, 2], ends)
        return RayIntervals(ends // 2, stops[::2].copy(), stops[1::2].copy())
