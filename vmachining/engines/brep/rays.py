"""Removed volume by upright rays through the exact sweeps: what tells a wrong value that lies in its bracket.

A bracket is some percent wide, and a boolean of spheres and cylinders that nearly touch may lose a sliver: in a program of
1 mm blocks of a ball (models/mould) 0.05 to 0.2 % of the chip were missing or too much in one block of thirty, and there
plain cuts and turned ones agreed on that to six digits. Rays know neither solids nor triangles: intervals of a line in a sweep
are exact (`Sweep.ray_intervals`), and what they miss between them is told by the spread of independent sets.

A value is asked of few rays first: their standard error is 2e-4 of such a chip. One that is `SUSPECT` of them off is asked of
nine times as many, a few seconds, and does not stand if it is `BEYOND` of these off: chance does that once in a million blocks
that are right. Values that are wrong by less than 5e-4 may pass.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import maximum_filter

from vmachining.arrays import Floats, Ints
from vmachining.engines.brep.blank import Blank
from vmachining.engines.brep.outside import Outside
from vmachining.sweep import RayIntervals, Sweep

__all__ = ["SETS", "Crossed", "contradicted", "left", "shot"]

SETS = 16
"""Sets of rays: their mean is t-distributed with 15 degrees of freedom."""

FIRST, FINER = 128, 384
"""Cells along a side of a set: a ray at a random place in each."""

TILE = 4
"""Cells along a side of a tile: one set looks at all of them, the others at tiles where it finds something, and beside these."""

SUSPECT, BEYOND = 2.5, 6.0
"""Standard errors."""

DEEP = 0.5
"""mm, of what may lie between the rays, a cell wide."""


class Crossed(Protocol):
    """A sweep, or what is not stock."""

    def ray_intervals(self, origins: Floats, directions: ArrayLike) -> RayIntervals:
        """Where lines are inside."""


def contradicted(
    value: float, error: float, shoot: Callable[[int], tuple[float, float]]
) -> tuple[float, float] | None:
    """(volume, error) that rays say, if they contradict a value with its own error, mm^3; else None.

    shoot : rays along a side of a set -> (volume, standard error).
    """
    found, spread = shoot(FIRST)
    if abs(value - found) <= error + SUSPECT * spread:
        return None
    found, spread = shoot(FINER)
    far = error + BEYOND * spread
    return (found, BEYOND * spread) if abs(value - found) > far else None


def shot(
    sweep: Sweep,
    earlier: Sequence[Crossed],
    stock: Blank,
    box: Floats,
    count: int,
    outside: Outside | None = None,
) -> tuple[float, float] | None:
    """(mm^3, standard error) that a sweep takes from what earlier ones leave of the stock; None near its curved faces.

    box : (2, 3) mm, around the stock. outside : of a stock that is neither box nor cylinder.
    """
    if stock.kind not in ("box", "cylinder") and outside is None:
        return None
    low, high = np.maximum(sweep.bounds[0], box[0]), np.minimum(sweep.bounds[1], box[1])
    if (low >= high).any():
        return 0.0, 0.0
    if outside is not None:
        if not outside.is_exact(np.stack([low, high])):
            return None
        earlier = [*earlier, outside]
    rng = np.random.default_rng([count, SETS])
    corner = np.stack(np.meshgrid(np.arange(count), np.arange(count), indexing="ij"), axis=-1).reshape(-1, 2)
    cell = (high - low)[:2] / count

    def lengths(cells: Ints) -> Floats:
        places = low[:2] + (cells + rng.random(cells.shape)) * cell
        out = np.zeros(len(places))
        inside = np.ones(len(places), dtype=bool)
        if stock.kind == "cylinder":
            inside = np.linalg.norm(places - stock.center, axis=1) < stock.radius
        out[inside] = left(sweep, earlier, places[inside], float(box[0, 2]), float(box[1, 2]))
        return out

    tiles = (lengths(corner) > 0.0).reshape(count // TILE, TILE, count // TILE, TILE).any(axis=(1, 3))
    near = maximum_filter(tiles, size=3, mode="constant")
    corner = corner[near.repeat(TILE, axis=0).repeat(TILE, axis=1).ravel()]
    found = np.array([lengths(corner).sum() for _ in range(SETS)]) * cell.prod()
    return float(found.mean()), float(found.std(ddof=1)) / np.sqrt(SETS) + DEEP * float(cell.prod()) / SETS


def left(sweep: Sweep, earlier: Sequence[Crossed], places: Floats, bottom: float, top: float) -> Floats:
    """(n,) mm of upright rays at (n, 2) places in the sweep and the stock, and in no earlier sweep."""
    rays, stops, own, others = [], [], [], []
    who = np.arange(len(places))
    bodies: tuple[Crossed, ...] = (sweep, *earlier)
    for number, body in enumerate(bodies):
        if not len(who):
            return np.zeros(len(places))
        origins = np.column_stack([places[who], np.zeros(len(who))])
        inside = body.ray_intervals(origins, (0.0, 0.0, 1.0))
        ray = np.repeat(who, inside.counts)
        lo, hi = np.clip(inside.enter, bottom, top), np.clip(inside.leave, bottom, top)
        step = np.repeat([1, -1], len(ray))
        rays.append(np.tile(ray, 2))
        stops.append(np.concatenate([lo, hi]))
        own.append(step if number == 0 else 0 * step)
        others.append(0 * step if number == 0 else step)
        if number == 0:
            who = np.unique(ray[hi > lo])
    ray, stop, a, b = (np.concatenate(column) for column in (rays, stops, own, others))
    order = np.lexsort([stop, ray])
    ray, stop, a, b = ray[order], stop[order], np.cumsum(a[order]), np.cumsum(b[order])
    same = ray[1:] == ray[:-1]
    length = np.diff(stop) * (same & (a[:-1] > 0) & (b[:-1] == 0))
    return np.bincount(ray[:-1], length, minlength=len(places)).astype(np.float64)
