"""The layer between inner facets and the truth: where it may be, how large, and how thick in the mean."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engines.mesh.skin import _kernels
from vmachining.sweep import Sweep

__all__ = [
    "NO_SKIN",
    "Leeway",
    "Places",
    "Skin",
    "Way",
    "hull_skin",
    "mean_skin",
    "spare",
    "thick",
    "untag",
]


class Leeway(NamedTuple):
    """How a true path may differ from the straight one, see the legend of `_kernels.py`."""

    slack: Floats
    lift: Floats
    inward: Floats


class Skin(NamedTuple):
    """Places that hold a layer of the workpiece that is not really there.

    corners : (n, 8, 3) mm, the convex hull of which holds a place. boxes : (n, 2, 3) mm, around it. volume :
    (n,) mm^3, at most.
    """

    corners: Floats
    boxes: Floats
    volume: Floats

    @classmethod
    def of(cls, rows: Floats) -> Skin:
        """From rows (n, 25)."""
        corners = rows[:, :24].reshape(-1, 8, 3)
        boxes = np.empty((len(rows), 2, 3))
        _kernels.boxes_of(corners, boxes)  # type: ignore[no-untyped-call]
        return cls(corners, boxes, rows[:, 24])

    @classmethod
    def joined(cls, parts: Sequence[Skin]) -> Skin:
        """All places of several skins."""
        if len(parts) < 2:
            return parts[0] if parts else NO_SKIN
        return cls(*(np.concatenate(column) for column in zip(*parts, strict=True)))

    @property
    def total(self) -> float:
        """mm^3, at most."""
        return float(self.volume.sum())

    def where(self, kept: Bools) -> Skin:
        """Those places alone."""
        return Skin(self.corners[kept], self.boxes[kept], self.volume[kept])

    def split(self, axis: int, at: float) -> tuple[Skin, Skin]:
        """What can be above and what below a plane across an axis; places on it are on both sides."""
        return self.where(self.boxes[:, 1, axis] > at), self.where(self.boxes[:, 0, axis] < at)

    def under(self, way: Way) -> tuple[float, Bools]:
        """mm^3 that the sweep can meet at most, and which places (n,) are wholly cut away by it."""
        met, gone = np.zeros((2, len(self.volume)), dtype=np.bool_)
        for sweep in way.sweeps:
            near, deep = sweep.meets(
                self.corners, self.boxes, slack=way.slack, depth=way.depth, within=ROUGH_MM
            )
            met |= near
            gone |= deep
        return float(self.volume[met].sum()), gone


class Places:
    """The skin of a tile, as its blocks change it: rows in front of spare ones, in no order."""

    __slots__ = ("_count", "_rows")

    def __init__(self, skin: Skin) -> None:
        self._rows, self._count = skin, len(skin.volume)

    @property
    def skin(self) -> Skin:
        """A view, until the next change."""
        return Skin(*(column[: self._count] for column in self._rows))

    def __len__(self) -> int:
        return self._count

    def drop(self, gone: Bools) -> None:
        """Forget places."""
        self._count = _kernels.drop(*self._rows, gone)  # type: ignore[no-untyped-call]

    def add(self, skin: Skin) -> None:
        """Remember more of them."""
        begin, end = self._count, self._count + len(skin.volume)
        if end > len(self._rows.volume):
            room = (end + end // 2,)
            rows = Skin(*(np.empty(room + column.shape[1:]) for column in self._rows))
            for old, new in zip(self.skin, rows, strict=True):
                new[:begin] = old
            self._rows = rows
        for column, new in zip(self._rows, skin, strict=True):
            column[begin:end] = new
        self._count = end


class Way(NamedTuple):
    """A sweep as straight ones, for questions of what it meets and what it cuts away.

    slack : mm by which the true sweep may reach beyond them. depth : mm; what is at least that deep in one of
    them is in the inner mesh of the sweep too.
    """

    sweeps: tuple[Sweep, ...]
    slack: float
    depth: float


NO_SKIN = Skin(np.empty((0, 8, 3)), np.empty((0, 2, 3)), np.empty(0))

ROUGH_MM = 1e-4
"""Distances to a sweep need not be better: a hundredth of the facets' usual depth."""

TAGS = 1 << 14
"""Facets of one piece told apart by number; where there are more, neighbours are told apart by thickness."""

LEVELS = 1 << 13
"""Steps of one chord in which a mean thickness travels with a facet, eight chords at most."""

OURS = 1 << 30
"""Set in face ids of sweeps; manifold3d numbers the faces of other solids from 0."""


def thick(triangles: Ints, mean: Floats, kin: Ints, chord: float) -> Ints:
    """(m,) face ids that carry a mean thickness (m,) mm along; triangles with equal `kin` share one.

    manifold3d keeps a face id of 31 bits through every boolean, and takes neighbours with one id for one plane
    facet that it may mesh anew: triangles (m, 3) with a common edge share an id only if they share `kin`.
    """
    ids = np.empty_like(kin)
    if _kernels.tagged(mean, kin, LEVELS / chord, 8 * LEVELS - 1, TAGS, OURS, ids):  # type: ignore[no-untyped-call]
        return ids
    _, number = np.unique(kin, return_inverse=True)  # few of all numbers are here
    level = np.clip(np.rint(mean * (LEVELS / chord)), 0, 8 * LEVELS - 1).astype(np.int64)
    if number.max(initial=0) >= TAGS:
        level = _told_apart(triangles, level, number)
    return OURS + level * TAGS + number % TAGS


def _told_apart(triangles: Ints, level: Ints, number: Ints) -> Ints:
    """Levels (m,), changed by a step or two where neighbours would get one id and are not one facet."""
    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    same = (edges[order[1:]] == edges[order[:-1]]).all(axis=1)
    one, other = order[:-1][same] // 3, order[1:][same] // 3
    while True:
        clash = (
            (number[one] != number[other])
            & (number[one] % TAGS == number[other] % TAGS)
            & (level[one] == level[other])
        )
        if not clash.any():
            return level
        # of two facets the one with the higher number moves, with all its triangles, so this ends
        moved = np.isin(number, np.maximum(number[one], number[other])[clash])
        level = np.where(moved, (level + 1) % (8 * LEVELS), level)


def untag(face_id: Ints, chord: float) -> Floats:
    """(m,) mm, the mean thickness that face ids carry."""
    out = np.empty(len(face_id))
    _kernels.untag(face_id, OURS, TAGS, chord / LEVELS, out)  # type: ignore[no-untyped-call]
    return out


def mean_skin(points: Floats, triangles: Ints, face_id: Ints, chord: float) -> float:
    """mm^3, area times the mean thickness that face ids (m,) carry, summed over triangles."""
    return float(_kernels.area_sums(points, triangles, untag(face_id, chord)))  # type: ignore[no-untyped-call]


hull_skin, spare = _kernels.hull_skin, _kernels.spare
