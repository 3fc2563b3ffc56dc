"""What the vectors say when the last block is cut: too little or too much was taken, where, and by which block."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engines.vectors import _kernels
from vmachining.engines.vectors.along import NormalVectors, Piece
from vmachining.engines.vectors.cuts import Cuts
from vmachining.engines.vectors.grid._kernels import TILE
from vmachining.engines.vectors.part import DesignPart
from vmachining.engines.vectors.upright import Base, UprightVectors

KINDS = ("upright", "wall", "overhang", "edge", "normal")
"""What a vector represents; `normal` are facets of pure DNV that are not features."""

COLUMNS = (
    "kind", "state", "x_mm", "y_mm", "z_mm", "nx", "ny", "nz", "length_mm", "deviation_mm", "block", "facet",
)  # fmt: skip

MOST_ROWS = 100_000
"""Rows of the table; those that deviate most."""


@dataclass(frozen=True, slots=True, eq=False)
class Deviation:
    """Vectors that are reported, those that deviate most first.

    kind : (n,) index into `KINDS`. point, normal : (n, 3). length : (n,) mm along the vector. deviation : (n,) mm along the
    normal of the part, > 0 left, < 0 taken too much. consumed, behind : (n,). block : (n,) that cut last, -1 the raw stock.
    facet : (n,), -1 on edges. summary : totals over all vectors, not only these.
    """

    kind: Ints
    point: Floats
    normal: Floats
    length: Floats
    deviation: Floats
    consumed: Bools
    behind: Bools
    block: Ints
    facet: Ints
    summary: dict[str, Any]

    def columns(self, tolerance: float) -> dict[str, Any]:
        """{name: values} of `deviation.csv`. state: over, under, within, consumed (more is gone than vectors measure), or
        behind (entered from behind, or cut beneath the surface only: no overcut of its own)."""
        state = np.where(
            self.deviation < -tolerance, "over", np.where(self.deviation > tolerance, "under", "within")
        )
        state = np.where(self.consumed, "consumed", np.where(self.behind, "behind", state))
        block = [None if k < 0 else k for k in self.block.tolist()]
        values = (
            [KINDS[k] for k in self.kind.tolist()], state.tolist(), *self.point.T, *self.normal.T, self.length,
            self.deviation, block, [None if k < 0 else k for k in self.facet.tolist()],
        )  # fmt: skip
        return dict(zip(COLUMNS, values, strict=True))


class _Rows(NamedTuple):
    """Vectors: kind, point, normal, length, deviation, consumed, behind, facet, and which have no overcut of their own."""

    kind: Any
    point: Any
    normal: Any
    length: Any
    deviation: Any
    consumed: Any
    behind: Any
    facet: Any
    beneath: Any

    def at(self, which: Ints) -> _Rows:
        """Some of them."""
        return _Rows(*(column[which] for column in self))

    def worst(self, most: int) -> _Rows:
        """Those that deviate most, the worst first; at most so many."""
        return self.at(np.argsort(-np.abs(self.deviation), kind="stable")[:most])


class _Found:
    """Counts over all vectors, and the rows that are kept: the worst ones, or every so many; memory for `most`, not for all."""

    def __init__(self, tolerance: float, most: int, step: int | None) -> None:
        self.tolerance, self.most, self.step = tolerance, most, step
        names = ("vectors", "upright", "over", "under", "consumed", "behind", "beneath", "bare")
        self.counts = dict.fromkeys(names, 0)
        self.over = self.under = 0.0
        self._parts = [_nothing()]
        self._waiting, self._least = 0, 0.0

    def add(
        self, deviation: Floats, consumed: Bools, beneath: Bools | None, rows: Callable[[Ints], _Rows]
    ) -> None:
        """Count vectors, keep those that are reported. beneath : None where no vector is; rows : of some of them."""
        over, under = deviation < -self.tolerance, deviation > self.tolerance
        own = deviation
        if beneath is not None:
            over, own = over & ~beneath, deviation[~beneath]
            self.counts["beneath"] += int(beneath.sum())
        begin = self.counts["vectors"]
        self.counts["vectors"] += len(deviation)
        for name, which in (("over", over), ("under", under), ("consumed", consumed)):
            self.counts[name] += int(np.count_nonzero(which))
        self.over = max(self.over, -float(own.min(initial=0.0)))
        self.under = max(self.under, float(deviation.max(initial=0.0)))
        if self.step is None:
            told = over | under | consumed
            kept = np.flatnonzero(told if beneath is None else told | beneath)
            if self._least > 0.0:  # `most` of those before deviate as much
                kept = kept[np.abs(deviation[kept]) > self._least]
        else:
            kept = np.arange(-begin % self.step, len(deviation), self.step)
        if len(kept):
            self._parts.append(rows(kept))
            self._waiting += len(kept)
        if self.step is None and self._waiting > 2 * self.most:
            self._parts = [self._joined().worst(self.most)]
            self._waiting = self.most
            self._least = float(np.abs(self._parts[0].deviation[-1:]).max(initial=0.0))

    def _joined(self) -> _Rows:
        return _Rows(*(np.concatenate(column) for column in zip(*self._parts, strict=True)))

    def rows(self) -> _Rows:
        """What is kept."""
        found = self._joined()
        return found.worst(self.most) if self.step is None else found


def measured(
    part: DesignPart,
    upright: UprightVectors | None,
    along: NormalVectors,
    covered: Bools,
    cuts: Cuts,
    tolerance: float,
    *,
    outside_only: bool = True,
    most: int = MOST_ROWS,
) -> Deviation:
    """Deviations of all vectors.

    upright : None: these are not reported (pure DNV).
    covered : (m,) facets that normal vectors stand on.
    outside_only : rows only of what lies outside of the tolerance (mm); else of all, thinned where there are more than `most`.
    """
    total = len(along) + (0 if upright is None else upright.lengths.size)
    found = _Found(tolerance, most, None if outside_only else max(1, -(-total // most)))
    counts = found.counts
    if upright is not None:
        counts["bare"] = _add_upright(found, part, upright, covered, cuts if upright.behind else None)
        counts["behind"] += upright.behind
        counts["upright"] = counts["vectors"]
    for laid in along.pieces():
        gone = _gone(laid.point, laid.normal, laid.length, laid.behind, tolerance, cuts)
        laid = laid._replace(length=np.where(gone, laid.low, laid.length))
        beneath = _beneath(laid, tolerance, cuts)
        counts["behind"] += int(laid.behind.sum())
        ended = (laid.length <= laid.low) & ~beneath
        behind = beneath | (laid.behind & (laid.length >= -tolerance))
        rows = _Rows(
            laid.kind, laid.point, laid.normal, laid.length, laid.length, ended, behind, laid.facet, beneath
        )
        found.add(laid.length, ended, beneath, rows.at)
    total = counts["vectors"]
    kept = found.rows()
    block = cuts.owners(kept.point + kept.length[:, None] * kept.normal, kept.length)
    summary = {
        "vectors": total, "upright_vectors": counts["upright"], "normal_vectors": total - counts["upright"],
        "tolerance_mm": tolerance, "max_overcut_mm": found.over, "max_undercut_mm": found.under,
        "within_tolerance": 1.0 - (counts["over"] + counts["under"]) / total if total else None,
        "over": counts["over"], "under": counts["under"], "consumed": counts["consumed"],
        "entered_from_behind": counts["behind"], "cut_beneath": counts["beneath"], "part_outside_stock": counts["bare"],
        "rows": len(kept.kind),
    }  # fmt: skip
    return Deviation(*kept[:7], block, kept.facet, summary)


def _add_upright(
    found: _Found, part: DesignPart, upright: UprightVectors, covered: Bools, cuts: Cuts | None
) -> int:
    """Add the upright vectors that are reported, tile by tile; cells over the part without a vector.

    cuts : None where no vector was entered from behind.
    """
    cosine, bare = np.cos(part.slopes), 0
    cells, deviation, ended = np.empty(TILE**2, np.int64), np.empty(TILE**2), np.empty(TILE**2, np.bool_)

    def rows(base: Base, lengths: NDArray[np.float32], x: Floats, y: Floats, kept: Ints) -> _Rows:
        i, j = np.divmod(cells[kept], TILE)
        none = np.zeros(len(kept), dtype=np.bool_)
        place, up = np.column_stack([x[i], y[j], base.start[i, j]]), np.zeros((len(kept), 3))
        up[:, 2] = 1.0
        size, kind = lengths[i, j].astype(np.float64), np.zeros(len(kept), int)
        return _Rows(kind, place, up, size, deviation[kept], ended[kept], none, base.facet[i, j], none)

    for base, lengths, x, y in upright.tiles():
        if cuts is not None:
            lengths = _upright_left(base, lengths, x, y, found.tolerance, cuts)
        count, without = _kernels.deviations(
            base.start, base.low, base.facet, lengths, cosine, covered, cells, deviation, ended
        )
        bare += without
        found.add(deviation[:count], ended[:count], None, partial(rows, base, lengths, x, y))
    return bare


def _upright_left(
    base: Base, lengths: NDArray[np.float32], x: Floats, y: Floats, tolerance: float, cuts: Cuts
) -> NDArray[np.float32]:
    """Lengths (T, T) of a tile, lambda where nothing is left, see `_gone`."""
    i, j = np.nonzero((base.facet >= 0) & ~np.isnan(lengths))
    point, up = np.column_stack([x[i], y[j], base.start[i, j]]), np.tile([0.0, 0.0, 1.0], (len(i), 1))
    gone = _gone(
        point, up, lengths[i, j].astype(np.float64), np.ones(len(i), dtype=np.bool_), tolerance, cuts
    )
    i, j, out = i[gone], j[gone], lengths.copy()
    out[i, j] = np.minimum(out[i, j], (base.low - base.start)[i, j])
    return out


def _gone(point: Floats, normal: Floats, length: Floats, asked: Bools, tolerance: float, cuts: Cuts) -> Bools:
    """(n,) vectors among the asked of which nothing is left: a sweep covers what lies a tolerance below both C and their tip.

    It came from behind, or the vector would have ended there, so it covers all from lambda on. A length alone does not tell:
    it is that of what stands beyond, on nothing.
    """
    out = np.zeros(len(length), dtype=np.bool_)
    at = np.flatnonzero(asked)
    below = point[at] + (np.minimum(length[at], 0.0) - tolerance)[:, None] * normal[at]
    out[at[cuts.first(below, np.zeros(len(at))) >= 0]] = True
    return out


def _nothing() -> _Rows:
    flat, none = np.empty(0), np.empty(0, dtype=np.int64)
    return _Rows(
        none, np.empty((0, 3)), np.empty((0, 3)), flat, flat, flat > 0.0, flat > 0.0, none, flat > 0.0
    )


def _beneath(laid: Piece, tolerance: float, cuts: Cuts) -> Bools:
    """(n,) vectors shortened by more than the tolerance although no sweep reaches that far below C: what is taken lies deeper.

    A groove in the top of a plate crosses the vectors of its outer walls. How deep it is, the vectors over it tell.
    """
    out = np.zeros(len(laid.length), dtype=np.bool_)
    at = np.flatnonzero(laid.length < -tolerance)
    just_below = laid.point[at] - tolerance * laid.normal[at]  # a cutter that ends at C is not overcut
    out[at[cuts.first(just_below, np.zeros(len(at))) < 0]] = len(cuts) > 0
    return out
