"""What an edge meets: the workpiece before the tool comes, as stock minus earlier sweeps, nothing built."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engagement.divide import divided
from vmachining.geometry import Arc, Line
from vmachining.stock import Stock
from vmachining.sweep import Stance, Sweep, Turn
from vmachining.tolerance import LENGTH_EPS_MM
from vmachining.tool import Edge, EdgeParts

SLIDING_MM = 2e-7
"""Twice what distances to sweeps promise where a surface of a curved motion slides along itself."""

SLIVER_MM = 0.02
"""Intervals shorter than this may be the place where two round surfaces touch: sqrt(8 r 2e-7 mm), r = 200 mm."""


class By(IntEnum):
    """What ends an interval of the edge; numbers from 0 on are blocks of the program."""

    STOCK = -1
    FACING = -2
    EDGE = -3


@dataclass(frozen=True, slots=True, eq=False, init=False)
class Past:
    """An earlier sweep, and the number of its block.

    touch : mm, depth in it up to which a point counts as on its surface: what rounding can make of a contact.
    """

    block: int
    sweep: Sweep
    touch: float
    _plain: Sweep
    _frame: Floats | None

    def __init__(self, block: int, sweep: Sweep) -> None:
        standing = sweep.upright() if isinstance(sweep.path, Turn) else None
        # a leaning tool that does not turn: as if it stood, where distances are exact and quick
        plain, frame = standing if standing is not None else (sweep, None)
        path = plain.path
        exact = isinstance(path, Line) or (isinstance(path, Arc) and path.axis == 2 and path.rise == 0.0)
        for name, value in (
            ("block", block), ("sweep", sweep), ("_plain", plain), ("_frame", frame),
            ("touch", LENGTH_EPS_MM if exact else SLIDING_MM),
        ):  # fmt: skip
            object.__setattr__(self, name, value)

    @property
    def plain(self) -> tuple[Sweep, Floats | None]:
        """The sweep as its distances are computed, and the rotation (3, 3) to its frame or None."""
        return self._plain, self._frame

    def signed_distance(self, points: Floats) -> Floats:
        """(n,) mm, see `Sweep.signed_distance`."""
        return self._plain.signed_distance(points if self._frame is None else points @ self._frame.T)


class Workpiece(Protocol):
    """Whoever can tell which parts of an edge lie in the workpiece."""

    def holds(self, edge: Edge, stance: Stance, phi: Floats, parts: EdgeParts) -> EdgeParts:
        """The parts inside; row r of `parts` stands at phi[r]. New ends carry `By.STOCK` or a block."""


@dataclass(frozen=True, slots=True, eq=False)
class RayWorkpiece:
    """Stock and earlier sweeps by their exact distances.

    stock : Stock. past : in program order. One sweep after the other, the latest first, takes its part of the
    edge away; what is left continues to the next.
    """

    stock: Stock
    past: Sequence[Past]

    def holds(self, edge: Edge, stance: Stance, phi: Floats, parts: EdgeParts) -> EdgeParts:
        """See `Workpiece`. Ends are good to 1e-11 mm where edge and surface cross at a fair angle."""

        def in_stock(row: Ints, piece: Ints, s: Floats) -> Floats:
            points = stance.points(edge, phi[row], piece, s)
            return self.stock.signed_distance(points) - LENGTH_EPS_MM

        left = divided(in_stock, parts, edge.stretch, By.STOCK, inside=True)
        for one in reversed(self.past):
            left = without(left, one, edge, stance, phi)
        return left.take(self._real(edge, stance, phi, left))

    def _real(self, edge: Edge, stance: Stance, phi: Floats, parts: EdgeParts) -> Bools:
        """False for short intervals that do not go deeper into the material than a contact could."""
        real = np.asarray(parts.upper - parts.lower > SLIVER_MM)
        short = np.flatnonzero(~real)
        if len(short):
            few = parts.take(short)
            points = stance.points(edge, phi[few.row], few.piece, 0.5 * (few.lower + few.upper))
            deep = self.stock.signed_distance(points) < -LENGTH_EPS_MM
            for one in self.past:
                deep &= one.signed_distance(points) > one.touch
            real[short] = deep
        return real


def without(
    parts: EdgeParts, past: Past, edge: Edge, stance: Stance, phi: Floats, *, own: bool = False
) -> EdgeParts:
    """What a sweep leaves of the parts. What only touches its surface stays.

    `own`: the sweep has the tool on its boundary, so only short intervals that it cut off itself can be a mere
    touch elsewhere.
    """

    def in_sweep(row: Ints, piece: Ints, s: Floats) -> Floats:
        return past.signed_distance(stance.points(edge, phi[row], piece, s)) + past.touch

    left = divided(in_sweep, parts, edge.stretch, past.block, inside=False)
    cut = (left.lower_by == past.block) | (left.upper_by == past.block)
    short = np.flatnonzero(cut & (left.upper - left.lower <= SLIVER_MM))
    if not own or not len(short):
        return left
    few = left.take(short)
    points = stance.points(edge, phi[few.row], few.piece, 0.5 * (few.lower + few.upper))
    real = np.ones(len(left.row), dtype=np.bool_)
    real[short] = past.signed_distance(points) > past.touch
    return left.take(real)


def sweeps_near(
    edge: Edge, stance: Stance, phi: Floats, parts: EdgeParts, past: Sequence[Past], *, pitch: float = 0.25
) -> list[Past]:
    """The earlier sweeps that can end or cover some of the parts, by exact distances; none else matters.

    The parts are sampled every `pitch` mm or finer. A sweep whose distance from every sample exceeds the way to
    the next one, along the edge or to the next angle of the grid phi (all round), touches nothing; samples that
    deep inside a later sweep are gone before an earlier one comes.
    """
    size = parts.upper - parts.lower
    counts = np.maximum(np.ceil(size / pitch), 1).astype(np.int64)
    part = np.repeat(np.arange(len(size)), counts)
    number = np.arange(len(part)) - np.repeat(np.cumsum(counts) - counts, counts)
    step = (size / counts)[part]
    s = parts.lower[part] + (number + 0.5) * step
    points = stance.points(edge, phi[parts.row[part]], parts.piece[part], s)
    aside = edge.profile.max_radius * 2.0 * np.pi / len(phi)
    half = (0.5 * step * edge.stretch + aside) * (1.0 + 1e-9) + SLIDING_MM
    kept: list[Past] = []
    for one in reversed(past):
        if not len(points):
            break
        low, high = one.sweep.bounds
        near = np.flatnonzero(
            ((points >= low - half[:, None]) & (points <= high + half[:, None])).all(axis=1)
        )
        if not len(near):
            continue
        distance = one.signed_distance(points[near])
        if (distance > half[near]).all():
            continue
        kept.append(one)
        gone = near[distance < -half[near]]
        points, half = np.delete(points, gone, axis=0), np.delete(half, gone)
    return kept[::-1]
