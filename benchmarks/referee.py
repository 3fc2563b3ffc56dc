"""Removed volume of a block of a chain by counting random points: shares no code with any engine.

A point is in a sweep where it is in the cutter at some instant: its height and its distance from the axis in the frame of
the tool, against the radius of the meridian there. Instants are few at first; where a point comes close they are refined
around its best one. No exact distance, no ray, no mesh, no solid.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.sweep import Sweep, Turn

__all__ = ["referee"]

SETS = 16
"""Of points, whose spread tells how good their mean is."""

BAR = 7.0
"""Standard errors of a mean of `SETS`: one false alarm in 200,000 blocks that are right."""

CELLS, LOOKS = 8000, 4
"""Of the box of a block, about, and points in each at first."""

UNSEEN = 12.0 / LOOKS
"""Cells that may be filled by what no point of the first look meets: chance hides more in one of 160,000 blocks, exp(-12)."""

INSTANTS, ROUNDS = 33, 3
"""Of a motion, and times that the best of them is refined to an eighth of its neighbourhood."""


def referee(sweeps: Sequence[Sweep], block: int, stock: Floats, finer: int = 2) -> tuple[float, float]:
    """Removed volume of a block by points, and its error bar, mm^3.

    stock : (2, 3) corners of the box. finer : parts of a cell along each axis, where the first look sees that it is not all
    the same in the cell or in one beside it.
    """
    low, high = (pick(stock[i], sweeps[block].bounds[i]) for i, pick in ((0, np.maximum), (1, np.minimum)))
    if (low >= high).any():
        return 0.0, 0.0
    rng = np.random.default_rng([block, finer])
    across = _across(high - low)
    cells, side = _grid(across), (high - low) / across
    first = np.stack(
        [_left(sweeps, block, low + (cells + rng.random(cells.shape)) * side) for _ in range(LOOKS)]
    )
    some, every = (
        _spread_to_neighbours(np.asarray(seen).reshape(across))
        for seen in (first.any(axis=0), (~first).any(axis=0))
    )
    mixed = cells[some & every]
    whole = int((some & ~every).sum())
    parts = (finer * mixed[:, None] + _grid(np.full(3, finer))).reshape(-1, 3)
    counts = np.array([
        _left(sweeps, block, low + (parts + rng.random(parts.shape)) * side / finer).sum() for _ in range(SETS)
    ])  # fmt: skip
    cell = float(side.prod())
    error = float(counts.std(ddof=1)) / np.sqrt(SETS) * cell / finer**3
    # what is thinner than a part may be met by none, and what is small by no point of the first look
    bar = BAR * error + BAR * cell / finer**3 / SETS + UNSEEN * cell
    return whole * cell + float(counts.mean()) * cell / finer**3, bar


def _across(size: Floats) -> Ints:
    """(3,) cells along each axis of a box, as near to cubes as whole numbers allow: a chip may be thin along any axis."""
    counts, left = np.ones(3, dtype=np.int64), float(CELLS)
    order = np.argsort(size)
    for k, axis in enumerate(order):
        edge = (size[order[k:]].prod() / left) ** (1.0 / (3 - k))
        counts[axis] = max(1, round(size[axis] / edge))
        left /= counts[axis]
    return counts


def _grid(across: Ints) -> Ints:
    """(n, 3) places of cells in a box of so many along each axis."""
    return np.stack(np.meshgrid(*map(np.arange, across), indexing="ij"), axis=-1).reshape(-1, 3)


def _spread_to_neighbours(seen: Bools) -> Bools:
    """(n,) whether something was seen in a cell or one of those around it."""
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(seen, 1), (3, 3, 3))
    return np.asarray(windows.any(axis=(3, 4, 5)).reshape(-1))


def _left(sweeps: Sequence[Sweep], block: int, points: Floats) -> Bools:
    """(n,) whether a point is in the sweep of the block and in none before."""
    left = np.flatnonzero(_inside(sweeps[block], points))
    for body in sweeps[:block][::-1]:
        box = body.bounds
        near = ((points[left] > box[0]) & (points[left] < box[1])).all(axis=1)
        gone = np.zeros(len(left), dtype=bool)
        gone[near] = _inside(body, points[left[near]])
        left = left[~gone]
    out = np.zeros(len(points), dtype=bool)
    out[left] = True
    return out


def _inside(sweep: Sweep, points: Floats) -> Bools:
    """(n,) whether the cutter holds a point at some instant."""
    steps = np.linspace(0.0, 1.0, INSTANTS)
    best, when = np.full(len(points), -np.inf), np.zeros(len(points))
    for t in steps.tolist():
        depth = _depth(sweep, points, np.full(len(points), t))
        better = depth > best
        best[better], when[better] = depth[better], t
    speed = sweep.path.length + _lever(sweep)
    reach = 1.0 / (INSTANTS - 1)
    for _ in range(ROUNDS):
        open_ = np.flatnonzero((best <= 0.0) & (best > -3.0 * speed * reach))
        start = when[open_]
        for shift in np.linspace(-1.0, 1.0, 17).tolist():
            t = np.clip(start + shift * reach, 0.0, 1.0)
            depth = _depth(sweep, points[open_], t)
            better = depth > best[open_]
            best[open_[better]], when[open_[better]] = depth[better], t[better]
        reach /= 8.0
    return best > 0.0


def _depth(sweep: Sweep, points: Floats, t: Floats) -> Floats:
    """(n,) mm, positive inside of the cutter at its instant; how far out is told about."""
    path, profile = sweep.path, sweep.profile
    # one instant for all is asked for once
    at = t[:1] if len(t) and (t == t[0]).all() else t
    axis = path.axis(at) if isinstance(path, Turn) else np.array([[0.0, 0.0, 1.0]])
    offset = points - path.position(at)
    height = (offset * axis).sum(axis=1)
    aside = np.sqrt(np.maximum((offset**2).sum(axis=1) - height**2, 0.0))
    radius = profile.radius_at(np.clip(height, profile.z_min, profile.z_max))
    return np.asarray(np.minimum(radius - aside, np.minimum(height - profile.z_min, profile.z_max - height)))


def _lever(sweep: Sweep) -> float:
    """mm, way of the far end of the tool about its tip."""
    if not isinstance(sweep.path, Turn):
        return 0.0
    ends = sweep.path.axis(np.array([0.0, 1.0]))
    return float(np.linalg.norm(ends[1] - ends[0])) * (sweep.profile.z_max - sweep.profile.z_min)
