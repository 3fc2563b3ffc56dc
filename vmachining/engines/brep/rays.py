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
from typing import NamedTuple, Protocol

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

    @property
    def bounds(self) -> Floats:
        """(2, 3) mm: a box around it."""

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
    """(n,) mm of upright rays at (n, 2) places in the sweep and the stock, and in no earlier sweep.

    What is left of a ray is known to lie between two heights that come closer with every earlier sweep, the latest first:
    it mostly takes all of it, and no other one is asked.
    """
    own = _crossed(sweep, places, np.arange(len(places)))
    lo, hi = np.full(len(places), top), np.full(len(places), bottom)
    np.minimum.at(lo, own.ray, own.enter)
    np.maximum.at(hi, own.ray, own.leave)
    lo, hi = np.maximum(lo, bottom), np.minimum(hi, top)
    others = []
    for body in reversed(earlier):
        low, high = body.bounds
        asked = (lo < hi) & (lo < high[2]) & (hi > low[2])
        asked &= ((places > low[:2]) & (places < high[:2])).all(axis=1)
        others.append(_crossed(body, places, np.flatnonzero(asked)))
        ray, enter, leave = others[-1]
        under, over = enter <= lo[ray], leave >= hi[ray]
        np.maximum.at(lo, ray[under], leave[under])
        np.minimum.at(hi, ray[over], enter[over])
    rays, stops, inner, outer = [], [], [], []
    for number, (ray, enter, leave) in enumerate((own, *others)):
        open_ = (lo < hi)[ray]
        ray = ray[open_]
        low, high = lo[ray], hi[ray]
        rays.append(np.tile(ray, 2))
        stops.append(np.concatenate([np.clip(enter[open_], low, high), np.clip(leave[open_], low, high)]))
        step = np.repeat([1, -1], len(ray))
        inner.append(step if number == 0 else 0 * step)
        outer.append(0 * step if number == 0 else step)
    ray, stop, a, b = (np.concatenate(column) for column in (rays, stops, inner, outer))
    order = np.lexsort([stop, ray])
    ray, stop, a, b = ray[order], stop[order], np.cumsum(a[order]), np.cumsum(b[order])
    same = ray[1:] == ray[:-1]
    length = np.diff(stop) * (same & (a[:-1] > 0) & (b[:-1] == 0))
    return np.bincount(ray[:-1], length, minlength=len(places)).astype(np.float64)


class _Parts(NamedTuple):
    """Where rays are inside a body: which ray, and from where to where, mm."""

    ray: Ints
    enter: Floats
    leave: Floats


def _crossed(body: Crossed, places: Floats, which: Ints) -> _Parts:
    origins = np.column_stack([places[which], np.zeros(len(which))])
    inside = body.ray_intervals(origins, (0.0, 0.0, 1.0))
    return _Parts(np.repeat(which, inside.counts), inside.enter, inside.leave)
