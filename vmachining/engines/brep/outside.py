"""What is not stock on upright lines, for stocks of triangles and STEP: rays treat it like one more earlier sweep.

Triangles of plane faces are the stock itself. Those of curved ones lie within a chord of it, which is more than rays can tell
apart: near such a face nothing is said (`is_exact`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engines.brep.blank import Blank
from vmachining.engines.brep.step import read_step
from vmachining.sweep import RayIntervals

__all__ = ["Outside"]

CHORD_MM = 0.01
"""Of the triangles of curved faces: how far beside them nothing is said."""


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
        self._corners, self._up = corner[twice != 0.0], twice[twice != 0.0] > 0.0
        self._low, self._high = self._corners.min(axis=1), self._corners.max(axis=1)

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
        places = np.asarray(origins, dtype=np.float64)
        order = np.argsort(places[:, 0])
        ray, z = self._crossings(places[order])
        ray = order[ray]
        by_ray = np.lexsort([z, ray])
        ray, z = ray[by_ray], z[by_ray]
        counts = np.bincount(ray, minlength=len(places))
        rank = np.arange(len(ray)) - (np.cumsum(counts) - counts)[ray]
        paired = (
            rank < counts[ray] // 2 * 2
        )  # but where a line meets a corner, or an edge of two upright triangles
        ray, z, rank, counts = ray[paired], z[paired], rank[paired], counts // 2 * 2
        ends = counts + 2  # of what is outside: below everything, and above
        first = np.cumsum(ends) - ends
        stops = np.empty(int(ends.sum()))
        stops[first] = -np.inf
        stops[first + ends - 1] = np.inf
        stops[first[ray] + 1 + rank] = z
        stops -= np.repeat(places[:, 2], ends)
        return RayIntervals(ends // 2, stops[::2].copy(), stops[1::2].copy())

    def _crossings(self, places: Floats) -> tuple[Ints, Floats]:
        """(line, height) wherever a line goes through a triangle; places in rising order of x."""
        x, y = places[:, 0], places[:, 1]
        rays, heights = [np.zeros(0, dtype=np.int64)], [np.zeros(0)]
        if not len(places):
            return rays[0], heights[0]
        near = (self._low[:, 0] <= x[-1]) & (self._high[:, 0] >= x[0])
        near &= (self._low[:, 1] <= y.max()) & (self._high[:, 1] >= y.min())
        for k in np.flatnonzero(near):
            span = slice(*np.searchsorted(x, [self._low[k, 0], self._high[k, 0]]))
            a, b, c = self._corners[k]
            hit = np.ones(span.stop - span.start, dtype=bool)
            for p, q in ((a, b), (b, c), (c, a)):
                hit &= _left_of(p, q, x[span], y[span]) == self._up[k]
            found = np.flatnonzero(hit) + span.start
            u, v = b - a, c - a
            n = np.cross(u, v)
            rays.append(found)
            heights.append(a[2] - (n[0] * (x[found] - a[0]) + n[1] * (y[found] - a[1])) / n[2])
        return np.concatenate(rays), np.concatenate(heights)


def _left_of(p: Floats, q: Floats, x: Floats, y: Floats) -> Bools:
    """On which side of an edge: the same word from both of its triangles, places on the line itself included."""
    swap = (p[0], p[1]) > (q[0], q[1])
    (ax, ay), (bx, by) = (q[:2], p[:2]) if swap else (p[:2], q[:2])
    return np.asarray(((bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0) != swap)
