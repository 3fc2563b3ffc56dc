"""Discrete vectors on the mould cover of the sources (spec E.7, B2), re-created: 1000 x 955 x 340 mm, ball D30, 78,524 blocks.

Lips from z = 0 to 20, rim flats 10 wide, walls of 5 degrees draft up to the top at z = 340, and 111 blind slots in it,
15 x 200 x 8 mm, which the ball cannot enter. Passes along x, straight blocks between places found by the drop cutter; blocks
that bridge an edge cut its corner.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, radians, sin, tan
from time import process_time
from typing import Any

import numpy as np

from vmachining.arrays import Floats
from vmachining.bench.vectors import peak_mb
from vmachining.engines.vectors import Points, simulation_spacing
from vmachining.engines.vectors.batch import ball_grid, ball_vectors

__all__ = ["vectors_mould", "vectors_mould_small"]

LENGTH, WIDTH, HEIGHT, RIM, DRAFT = 1000.0, 955.0, 340.0, 20.0, radians(5.0)
BALL, PASSES, NODES = 15.0, 268, 293
SLOT, SLOT_PITCH, SLOT_LENGTH, SLOT_DEPTH = 15.0, 25.0, 200.0, 8.0
COLUMNS, ROWS = 37, (-300.0, 0.0, 300.0)
TOP = np.array([LENGTH, WIDTH]) / 2.0 - 10.0 - (HEIGHT - RIM) * tan(DRAFT)
"""(2,) half lengths of the top: 462.0 and 439.5."""

WINDOW = (8400, 8020)
"""Vectors of the published grid at 0.1 mm: 840 x 802 mm."""

CASTING, DEEPEST, ERROR = 2.0, 10.0, 0.005


def blocks() -> Floats:
    """(78525, 3) mm: centres of the ball."""
    x, y = np.linspace(-LENGTH / 2, LENGTH / 2, NODES), np.linspace(-WIDTH / 2, WIDTH / 2, PASSES)
    at = np.array([(a, b) for k, b in enumerate(y) for a in (x if k % 2 == 0 else x[::-1])])
    path = np.column_stack([at, _centre(at)])
    return np.concatenate([path[:1] + [-1.0, 0.0, 0.0], path])


def _slot(at: Floats) -> Floats:
    """(n,) mm to the nearest wall of the slot that a place is in; negative outside."""
    column = np.clip(np.round(at[:, 0] / SLOT_PITCH), -(COLUMNS // 2), COLUMNS // 2) * SLOT_PITCH
    row = np.array(ROWS)[np.abs(at[:, 1:] - np.array(ROWS)).argmin(axis=1)]
    return np.asarray(
        np.minimum(SLOT / 2 - np.abs(at[:, 0] - column), SLOT_LENGTH / 2 - np.abs(at[:, 1] - row))
    )


def _centre(at: Floats) -> Floats:
    """(n,) mm: lowest height of the ball's centre at which it touches the body: edges, walls, rim."""
    inside = np.maximum(_slot(at), 0.0)
    over = HEIGHT + np.sqrt(BALL**2 - inside**2)
    beyond = (np.abs(at) - TOP).max(axis=1)
    edge = HEIGHT + np.sqrt(np.clip(BALL**2 - beyond**2, 0.0, None))
    wall = HEIGHT + (BALL - beyond * cos(DRAFT)) / sin(DRAFT)
    off = np.where(wall <= HEIGHT + BALL * sin(DRAFT), np.maximum(wall, RIM + BALL), edge)
    return np.asarray(np.where(beyond <= 0.0, over, off))


def _height(x: Floats, y: Floats) -> Floats:
    """(n, m) mm of the top within the window: slots and what is between them."""
    column = np.clip(np.round(x / SLOT_PITCH), -(COLUMNS // 2), COLUMNS // 2) * SLOT_PITCH
    row = np.array(ROWS)[np.abs(y[:, None] - np.array(ROWS)).argmin(axis=1)]
    slotted = (np.abs(x - column) < SLOT / 2)[:, None] & (np.abs(y - row) < SLOT_LENGTH / 2)
    return np.where(slotted, HEIGHT - SLOT_DEPTH, HEIGHT)


def vectors_mould() -> Iterator[dict[str, Any]]:
    """67,368,000 upright vectors at 0.1 mm, and those along the normals of all walls."""
    yield from _mould("vectors-mould", 0.1, simulation_spacing(ERROR, 10.0))


def vectors_mould_small() -> Iterator[dict[str, Any]]:
    """The same body and path at ten times the pitch."""
    yield from _mould("vectors-mould-small", 1.0, 5.0)


def _mould(case: str, gamma: float, delta: float) -> Iterator[dict[str, Any]]:
    path = blocks()
    shape = tuple(round(n * 0.1 / gamma) for n in WINDOW)
    ball_grid(path[:20], BALL, -5.0, -5.0, 1.0, (10, 10), _height)  # compiled, apart
    begin = process_time()
    found = ball_grid(
        path, BALL, -0.5 * shape[0] * gamma, -0.5 * shape[1] * gamma, gamma, (shape[0], shape[1]), _height
    )
    middle: Floats = (np.arange(shape[1], dtype=np.float64) + 0.5 - 0.5 * shape[1]) * gamma
    slot = [np.inf, -np.inf]
    flat = [np.inf, -np.inf]
    for i in range(0, shape[0], 256):
        rows = found[i : i + 256]
        x: Floats = (np.arange(i, i + len(rows), dtype=np.float64) + 0.5 - 0.5 * shape[0]) * gamma
        low = _height(x, middle) < HEIGHT
        for which, ends in ((low, slot), (~low, flat)):
            if which.any():
                ends[:] = min(ends[0], float(rows[which].min())), max(ends[1], float(rows[which].max()))
    upright = process_time() - begin
    yield {
        "case": case, "run": "DVV", "gamma_mm": gamma, "blocks": len(path) - 1, "vectors": found.size,
        "seconds": upright, "published_seconds": 710, "bytes": found.nbytes, "top_overcut_mm": -flat[0],
        "top_undercut_mm": flat[1], "slots_least_mm": slot[0], "slots_most_mm": slot[1], "peak_mb": peak_mb(),
    }  # fmt: skip
    del found
    points = _walls(delta)
    depth = _depth(points)
    ball_vectors(
        path[:5], BALL, Points(points.point[:10], points.normal[:10], points.facet[:10]), CASTING, DEEPEST
    )
    begin = process_time()
    length = ball_vectors(path, BALL, points, CASTING, depth)
    yield {
        "case": case, "run": "DNV", "delta_mm": delta, "blocks": len(path) - 1, "vectors": len(length),
        "seconds": process_time() - begin, "published_seconds": 233, "untouched": int((length == CASTING).sum()),
        "least_mm": float(length.min()), "peak_mb": peak_mb(),
    }  # fmt: skip


def _walls(delta: float) -> Points:
    """Points at spacing delta on lips, drafted walls and walls of the slots."""
    found = []
    low, high = np.array([LENGTH, WIDTH]) / 2.0, TOP
    for axis in (0, 1):
        for sign in (-1.0, 1.0):
            outward = np.zeros(3)
            outward[axis] = sign
            across = np.zeros(3)
            across[1 - axis] = 1.0
            found.append(
                _rectangle(
                    outward * low[axis], across * low[1 - axis], across * low[1 - axis], RIM, outward, delta
                )
            )
            foot = outward * (low[axis] - 10.0) + [0, 0, RIM]
            normal = outward * cos(DRAFT) + [0, 0, sin(DRAFT)]
            rise = -outward * (HEIGHT - RIM) * tan(DRAFT) + [0, 0, HEIGHT - RIM]
            found.append(
                _rectangle(
                    foot, across * (low[1 - axis] - 10.0), across * high[1 - axis], rise, normal, delta
                )
            )
    for column in range(-(COLUMNS // 2), COLUMNS // 2 + 1):
        for row in ROWS:
            middle = np.array([column * SLOT_PITCH, row, HEIGHT - SLOT_DEPTH])
            for axis, half, other in ((0, SLOT / 2, SLOT_LENGTH / 2), (1, SLOT_LENGTH / 2, SLOT / 2)):
                for sign in (-1.0, 1.0):
                    out, across = np.zeros(3), np.zeros(3)
                    out[axis], across[1 - axis] = sign, other
                    found.append(_rectangle(middle + half * out, across, across, SLOT_DEPTH, -out, delta))
    point, normal = (np.concatenate(v) for v in zip(*found, strict=True))
    return Points(point, normal, np.zeros(len(point), dtype=np.int64))


def _depth(points: Points) -> Floats:
    """(n,) mm through the body behind a vector, at most `DEEPEST`: between the outer slots and the walls it is thin."""
    x, y, z = points.point.T
    outer = (COLUMNS // 2) * SLOT_PITCH + SLOT / 2
    level = np.abs(points.normal[:, 0]) > 0.9
    behind = (
        level
        & (np.abs(y[:, None] - np.array(ROWS)).min(axis=1) < SLOT_LENGTH / 2)
        & (z > HEIGHT - SLOT_DEPTH)
    )
    behind &= np.abs(x) > outer - 1e-9
    thin = TOP[0] + (HEIGHT - z) * tan(DRAFT) - outer
    return np.where(behind, np.minimum(thin, DEEPEST), DEEPEST)


def _rectangle(
    foot: Floats, wide: Floats, narrow: Floats, rise: Floats | float, normal: Floats, delta: float
) -> tuple[Floats, Floats]:
    """Points on a trapezium over a foot line from foot - wide to foot + wide, `narrow` at the height of `rise`."""
    rise = np.array([0.0, 0.0, rise]) if np.ndim(rise) == 0 else np.asarray(rise)
    many = max(1, round(float(np.linalg.norm(rise)) / delta))
    rows = []
    for k in range(many):
        share = (k + 0.5) / many
        half = (1.0 - share) * wide + share * narrow
        n = max(1, round(2.0 * float(np.linalg.norm(half)) / delta))
        rows.append(foot + share * rise + (2.0 * (np.arange(n)[:, None] + 0.5) / n - 1.0) * half)
    point = np.concatenate(rows)
    return point, np.broadcast_to(normal, point.shape)
