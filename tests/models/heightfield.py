"""A referee that shares nothing with the engines but the list of moves: heights over a grid of plan points.

A three-axis cutter leaves over every point of the plan the lowest height that its underside reached there.
The path is sampled finer than the grid, the heights are kept per cell centre, and the volume of a move is the
sum of the drops times the area of a cell. Sampling the path can only miss material; the grid errs both ways.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from vmachining.nc import Motion, Move


class Grid(NamedTuple):
    """Cell centres x (n,), y (m,), heights (n, m), all mm, and the area of a cell in mm^2."""

    x: NDArray[np.float64]
    y: NDArray[np.float64]
    height: NDArray[np.float64]
    cell: float


class Round(NamedTuple):
    """Flat, bull or ball end: radius and corner radius, mm."""

    radius: float
    corner: float


def grid(
    low: tuple[float, float],
    high: tuple[float, float],
    cell: float,
    top: Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]],
) -> Grid:
    """Cells over a rectangle; `top` gives the height of the stock."""
    nx, ny = (round((b - a) / cell) for a, b in zip(low, high, strict=True))
    x = low[0] + (np.arange(nx) + 0.5) * (high[0] - low[0]) / nx
    y = low[1] + (np.arange(ny) + 0.5) * (high[1] - low[1]) / ny
    xx, yy = np.meshgrid(x, y, indexing="ij")
    return Grid(x, y, np.ascontiguousarray(top(xx, yy), dtype=float), float((x[1] - x[0]) * (y[1] - y[0])))


def positions(move: Move, step: float) -> NDArray[np.float64]:
    """Tips along a move at most `step` apart, (n, 3) mm; arcs in the XY plane only."""
    start, end = np.array(move.start), np.array(move.end)
    if move.center is None:
        count = int(np.linalg.norm(end - start) / step) + 2
        return np.asarray(start + np.linspace(0, 1, count)[:, None] * (end - start))
    assert move.plane == "xy" and move.turns == 1
    middle = np.array(move.center)
    radius = float(np.linalg.norm(start[:2] - middle))
    first, last = (np.arctan2(*(p[:2] - middle)[::-1]) for p in (start, end))
    sense = 1.0 if move.motion is Motion.ARC_CCW else -1.0
    angle = (sense * (last - first)) % (2 * np.pi)
    angle = 2 * np.pi if angle < 1e-9 else angle
    t = np.linspace(0, 1, int(angle * radius / step) + 2)
    theta = first + sense * angle * t
    return np.column_stack(
        [
            middle[0] + radius * np.cos(theta),
            middle[1] + radius * np.sin(theta),
            start[2] + t * (end[2] - start[2]),
        ]
    )


@numba.njit(cache=False)
def _lower(points, radius, corner, x, y, height):  # type: ignore[no-untyped-def]  # numba
    dx, dy = x[1] - x[0], y[1] - y[0]
    dropped = 0.0
    for p in range(points.shape[0]):
        px, py, pz = points[p]
        i0, i1 = max(0, int((px - radius - x[0]) / dx)), min(x.size, int((px + radius - x[0]) / dx) + 2)
        j0, j1 = max(0, int((py - radius - y[0]) / dy)), min(y.size, int((py + radius - y[0]) / dy) + 2)
        for i in range(i0, i1):
            for j in range(j0, j1):
                r2 = (x[i] - px) ** 2 + (y[j] - py) ** 2
                if r2 > radius * radius:
                    continue
                rise = 0.0
                flat = radius - corner
                if corner > 0 and r2 > flat * flat:
                    rise = corner - np.sqrt(max(0.0, corner * corner - (np.sqrt(r2) - flat) ** 2))
                z = pz + rise
                if z < height[i, j]:
                    dropped += height[i, j] - z
                    height[i, j] = z
    return dropped


def removed(
    moves: Iterable[Move], tools: dict[int, Round], stock: Grid, step: float = 0.05
) -> NDArray[np.float64]:
    """Volume removed by every move, mm^3, in order; the heights of `stock` change."""
    out = []
    for move in moves:
        tool = tools[move.tool] if move.tool in tools else Round(0.0, 0.0)
        points = positions(move, step)
        out.append(_lower(points, tool.radius, tool.corner, stock.x, stock.y, stock.height) * stock.cell)
    return np.array(out)
