"""Where a block can take something: columns around all cells that its sweep meets and no earlier sweep holds.

Decided as in `near.py`, by distances that change by at most the way between two points: no sampling, so rays that keep to these
columns miss nothing by their choice. Cells that only touch a sweep are divided into eight while there are not too many of them;
a chip much thinner than its cells has columns much wider than itself, but has them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.sweep import Sweep
from vmachining.sweep.near import CELLS, LEVELS

MOST = 2000
"""Cells that are divided: eight times as many are asked next."""

EIGHTHS = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), axis=-1).reshape(-1, 3)


class Columns(NamedTuple):
    """Upright columns that do not overlap. low : (n, 2) mm, corners; side : (2,) mm; tall : (n,) mm, heights of what they can
    hold; bottom, top : mm, between which all of them can hold something."""

    low: Floats
    side: Floats
    tall: Floats
    bottom: float = 0.0
    top: float = 0.0


def columns(sweep: Sweep, earlier: Sequence[Sweep], box: Floats, most: int) -> Columns:
    """Of what a sweep can take in a box (2, 3) mm after earlier ones; at most `most` of them, if that many are enough."""
    size = box[1] - box[0]
    pitch = max(float(np.cbrt(size.prod() / CELLS)), float(size.max()) / 40.0)
    counts = np.maximum(np.ceil(size / pitch), 1).astype(np.int64)
    cell = size / counts
    axes = (np.arange(n) for n in counts)
    place = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    touches = np.ones((len(earlier), len(place)), dtype=bool)
    found: list[Ints] = []  # per level: which cells, counted from the corner of the box
    for level in range(LEVELS + 1):
        sides = cell / 2.0**level
        half = 0.5 * float(np.linalg.norm(sides)) * (1.0 + 1e-9) + 1e-9
        depth = sweep.signed_distance(box[0] + (place + 0.5) * sides)
        place, touches, depth = place[depth <= half], touches[:, depth <= half], depth[depth <= half]
        centers = box[0] + (place + 0.5) * sides
        is_held = np.zeros(len(place), dtype=bool)
        for i, body in enumerate(earlier):
            where = np.flatnonzero(touches[i] & ~is_held)
            distance = body.signed_distance(centers[where])
            touches[i, where] = distance <= half
            is_held[where] = distance < -half
        place, touches, depth = place[~is_held], touches[:, ~is_held], depth[~is_held]
        is_whole = (depth < -half) & ~touches.any(axis=0)  # parts of it would say the same
        found.append(place[is_whole])
        place, touches = place[~is_whole], touches[:, ~is_whole]
        if level == LEVELS or not len(place) or len(place) > MOST:
            found[-1] = np.concatenate([found[-1], place])
            break
        place = (2 * place[:, None] + EIGHTHS).reshape(-1, 3)
        touches = np.repeat(touches, len(EIGHTHS), axis=1)
    best = _raster(found, counts, cell, 0)
    for level in range(1, len(found)):
        if sum(len(cells) * 4 ** max(level - k, 0) for k, cells in enumerate(found)) > 32 * most:
            break
        finer = _raster(found, counts, cell, level)
        if len(finer[0]) > most:
            break
        best = finer
    where, sides, tall = best
    ends = [cells[:, 2, None] + [0, 1] for cells in found]
    heights = np.concatenate([end * cell[2] / 2.0**level for level, end in enumerate(ends)])
    heights = heights if len(heights) else np.zeros((1, 2))
    bottom, top = (float(box[0, 2] + height) for height in (heights.min(), heights.max()))
    return Columns(box[0, :2] + where * sides, sides, tall, bottom, top)


def _raster(found: Sequence[Ints], counts: Ints, cell: Floats, level: int) -> tuple[Ints, Floats, Floats]:
    """(columns by their place in a raster, their sides, heights of what they can hold), in cells of a level."""
    wide = counts[:2] * 2**level
    keys, lows, highs = [], [], []
    for k, cells in enumerate(found):
        step = cell[2] / 2.0**k
        if k >= level:
            place = cells[:, :2] // 2 ** (k - level)
        else:
            part = np.arange(2 ** (level - k))
            inner = np.stack(np.meshgrid(part, part, indexing="ij"), axis=-1).reshape(-1, 2)
            place = (len(part) * cells[:, None, :2] + inner).reshape(-1, 2)
        low = np.repeat(cells[:, 2] * step, len(place) // max(len(cells), 1))
        keys.append(place[:, 0] * wide[1] + place[:, 1])
        lows.append(low)
        highs.append(low + step)
    key, member = np.unique(np.concatenate(keys), return_inverse=True)
    bottom, top = np.full(len(key), np.inf), np.full(len(key), -np.inf)
    np.minimum.at(bottom, member, np.concatenate(lows))
    np.maximum.at(top, member, np.concatenate(highs))
    return np.column_stack(np.divmod(key, wide[1])), cell[:2] / 2.0**level, top - bottom
