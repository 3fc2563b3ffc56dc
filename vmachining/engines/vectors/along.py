"""`NormalVectors`: vectors along the normals of features (DNV), found by an index of rows and columns seen from above."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vmachining.arrays import Floats, Ints
from vmachining.engines.vectors import _kernels
from vmachining.engines.vectors.facets import envelope
from vmachining.engines.vectors.part import DesignPart, Points, first_hits
from vmachining.errors import InputError
from vmachining.stock import MeshStock, Stock
from vmachining.sweep import Sweep
from vmachining.sweep.ball import ball_block

__all__ = ["NormalVectors", "normal_lengths"]

PER_CELL = 16
"""Vectors in a cell of the index, about."""

MOST_CELLS = 1 << 22


class NormalVectors:
    """Vectors with a direction of their own.

    point, normal : (n, 3). low, length : (n,) float32 mm, lambda and L. facet : (n,), -1 on an edge. behind : (n,) 1 where a
    sweep came from behind. The order is that of the index, not of what came in.

    Raises
    ------
    InputError
        A normal without length, or lambda not below 0 and L.
    """

    def __init__(self, points: Points, low: Floats, length: Floats, *, facets: float | None = None) -> None:
        size = np.linalg.norm(points.normal, axis=1)
        if not (size > 0.0).all() or not np.isfinite(points.normal).all():
            raise InputError(f"vector {int(np.argmin(size > 0.0))} has no direction")
        bad = ~((low < 0.0) & (low < length))
        if bad.any():
            k = int(np.argmax(bad))
            raise InputError(
                f"vector {k}: lambda {low[k]:g} mm must lie below 0 and below its length {length[k]:g} mm"
            )
        self.facets = facets
        count = len(points.point)
        if count:
            lo, hi = points.point[:, :2].min(axis=0), points.point[:, :2].max(axis=0)
        else:
            lo, hi = np.zeros((2, 2))
        wide = float(np.ptp([lo, hi], axis=0).max()) + 1e-9
        cells = min(max(count // PER_CELL, 1), MOST_CELLS)
        self._cell = max(wide / max(1.0, np.sqrt(cells)), 1e-9)
        self._low = lo
        self._shape = np.floor((hi - lo) / self._cell).astype(np.int64) + 1
        at = np.minimum(np.floor((points.point[:, :2] - lo) / self._cell).astype(np.int64), self._shape - 1)
        key = at[:, 0] * self._shape[1] + at[:, 1]
        order = np.argsort(key, kind="stable")
        self._first = np.searchsorted(key[order], np.arange(int(self._shape.prod()) + 1)).astype(np.int64)
        self.point: Floats = np.ascontiguousarray(points.point[order])
        self.normal: Floats = np.ascontiguousarray((points.normal / size[:, None])[order])
        self.facet: Ints = np.asarray(points.facet)[order]
        self.low: NDArray[np.float32] = low[order].astype(np.float32)
        self.length: NDArray[np.float32] = length[order].astype(np.float32)
        self.order: Ints = order
        self.behind: NDArray[np.uint8] = np.zeros(count, np.uint8)
        across = np.hypot(self.normal[:, 0], self.normal[:, 1])
        self._margin = float((across * np.maximum(np.abs(self.low), self.length)).max(initial=0.0))
        self._found = np.empty(count, dtype=np.int64)

    def __len__(self) -> int:
        return len(self.point)

    def near(self, sweep: Sweep) -> Ints:
        """Vectors whose pieces from lambda to L come into the box of a sweep (bucket, spec E.5)."""
        if not len(self):
            return self._found
        n = _kernels.near_box(
            self._shape, self._first, self._low[0], self._low[1], self._cell, self.point, self.normal, self.low,
            self.length, sweep.bounds, self._margin, self._found,
        )  # fmt: skip
        return self._found[:n].copy()

    def cut(self, sweep: Sweep) -> None:
        """Shorten the vectors that a sweep enters."""
        at = self.near(sweep)
        if not len(at):
            return
        if self.facets is not None:
            corners = envelope(sweep, self.facets)
            _kernels.facets_normals(at, self.point, self.normal, self.low, self.length, corners)
            return
        ball = ball_block(sweep)
        if ball is not None:
            rest = np.empty(len(at), dtype=np.int64)
            n = _kernels.ball_normals(
                at, self.point, self.normal, self.low, self.length, self.behind, ball.center, ball.travel, ball.radius,
                ball.height, rest,
            )  # fmt: skip
            at = rest[:n]
            if not n:
                return
        rays = sweep.ray_intervals(self.point[at], self.normal[at])
        first = np.concatenate([[0], np.cumsum(rays.counts)])
        _kernels.interval_normals(at, first, rays.enter, rays.leave, self.low, self.length, self.behind)


def normal_lengths(
    part: DesignPart, stock: Stock, points: Points, *, allowance: float, depth: float, chord: float
) -> tuple[Floats, Floats]:
    """lambda and L before the first cut.

    lambda is minus the way out of the part along -N, at most `depth`. L ends at the stock's surface, where the part comes
    again (so no vector crosses a narrow slot), or at `allowance`. A point outside of the stock has L = 0.
    """
    inward = np.ascontiguousarray(-points.normal)
    low = -np.minimum(part.leave(points.point, inward, depth), depth)
    again = part.meet(points.point, points.normal, allowance)
    outside, _ = stock.mesh(chord)
    body = MeshStock(outside.vertices, outside.triangles)
    leave = first_hits(body, points.point, points.normal, 1.0, 0.0, allowance)
    inside = stock.signed_distance(points.point) < 0.0
    return low, np.where(inside, np.minimum(np.minimum(again, leave), allowance), 0.0)
