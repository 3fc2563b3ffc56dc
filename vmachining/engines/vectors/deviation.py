"""What the vectors say when the last block is cut: too little or too much was taken, where, and by which block."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.engines.vectors.along import NormalVectors
from vmachining.engines.vectors.part import DesignPart
from vmachining.engines.vectors.upright import UprightVectors
from vmachining.sweep import Sweep

__all__ = ["COLUMNS", "KINDS", "Deviation", "measured"]

KINDS = ("upright", "wall", "overhang", "edge", "normal")
"""What a vector stands for; `normal` are facets of pure DNV that are no feature."""

COLUMNS = (
    "kind",
    "state",
    "x_mm",
    "y_mm",
    "z_mm",
    "nx",
    "ny",
    "nz",
    "length_mm",
    "deviation_mm",
    "block",
    "facet",
)

MOST_ROWS = 100_000
"""Rows of the table; those that deviate most."""

TOLD = 1e-6
"""mm by which a tip may lie off the sweep that made it, beside the rounding of its float32 length."""


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


@dataclass(slots=True, eq=False)
class _Found:
    """Parts of what is found, and counts."""

    parts: list[tuple[Any, ...]]
    counts: dict[str, int]


def measured(
    part: DesignPart,
    upright: UprightVectors | None,
    along: NormalVectors,
    kinds: Ints,
    covered: Bools,
    sweeps: Sequence[Sweep],
    blocks: Sequence[int],
    tolerance: float,
    *,
    outside_only: bool = True,
    most: int = MOST_ROWS,
) -> Deviation:
    """Deviations of all vectors.

    Parameters
    ----------
    upright : None: these are not reported (pure DNV).
    kinds : (n,) of the normal vectors. covered : (m,) facets that normal vectors stand on.
    outside_only : rows only of what lies outside of the tolerance (mm); else of all, thinned where there are more than `most`.
    """
    found = _Found(
        [], dict.fromkeys(("vectors", "upright", "over", "under", "consumed", "behind", "beneath", "bare"), 0)
    )
    largest = {"over": 0.0, "under": 0.0}
    if upright is not None:
        cosine = np.append(np.cos(part.slopes), 1.0)
        hidden = np.append(covered, True)  # no part below: only for volumes
        for base, lengths, x, y, has in upright.tiles():
            on = (base.facet >= 0) & ~hidden[base.facet]
            found.counts["bare"] += int((on & ~has).sum())
            on &= has
            if not on.any():
                continue
            i, j = np.nonzero(on)
            size = lengths[on].astype(np.float64)
            start, facet = base.start[on], base.facet[on]
            ended = size <= (base.low[on] - start).astype(np.float32)
            place = np.column_stack([x[i], y[j], start])
            up = np.broadcast_to([0.0, 0.0, 1.0], place.shape)
            rows: tuple[Any, ...] = (
                0,
                place,
                up,
                size,
                size * cosine[facet],
                ended,
                np.zeros(len(i), np.bool_),
                facet,
            )
            _add(found, largest, rows, tolerance, outside_only, most)
        found.counts["behind"] += upright.behind
        found.counts["upright"] = found.counts["vectors"]
    counts = found.counts
    size = along.length.astype(np.float64)
    if len(along):
        beneath = cut_beneath(along, tolerance, sweeps)
        counts["beneath"] = int(beneath.sum())
        ended = (along.length <= along.low) & ~beneath
        rows = (
            kinds,
            along.point,
            along.normal,
            size,
            size,
            ended,
            (along.behind > 0) | beneath,
            along.facet,
        )
        _add(found, largest, rows, tolerance, outside_only, 4 * most, beneath)
        found.counts["behind"] += int(along.behind.sum())
    columns = [np.concatenate(c) for c in zip(*found.parts, strict=True)] if found.parts else _nothing()
    order = np.argsort(-np.abs(columns[4]), kind="stable")
    if len(order) > most:
        order = order[:most] if outside_only else np.sort(order[:: -(-len(order) // most)])
    kind, point, normal, length, deviation, consumed, behind, facet = (c[order] for c in columns)
    block = owners(point + length[:, None] * normal, length, sweeps, blocks)
    total = counts["vectors"]
    summary = {
        "vectors": total,
        "upright_vectors": counts["upright"],
        "normal_vectors": total - counts["upright"],
        "tolerance_mm": tolerance,
        "max_overcut_mm": largest["over"],
        "max_undercut_mm": largest["under"],
        "within_tolerance": 1.0 - (counts["over"] + counts["under"]) / total if total else None,
        "over": counts["over"],
        "under": counts["under"],
        "consumed": counts["consumed"],
        "entered_from_behind": counts["behind"],
        "cut_beneath": counts["beneath"],
        "part_outside_stock": counts["bare"],
        "rows": len(order),
    }
    return Deviation(kind, point, normal, length, deviation, consumed, behind, block, facet, summary)


def _add(
    found: _Found,
    largest: dict[str, float],
    rows: tuple[Any, ...],
    tolerance: float,
    outside_only: bool,
    most: int,
    aside: Bools | None = None,
) -> None:
    """Count vectors, keep those that are reported. rows: kind, point, normal, length, deviation, consumed, behind, facet.

    aside : reported, but no overcut of their own.
    """
    deviation, consumed = rows[4], rows[5]
    own = np.ones(len(deviation), dtype=np.bool_) if aside is None else ~aside
    over, under = (deviation < -tolerance) & own, deviation > tolerance
    counts = found.counts
    counts["vectors"] += len(deviation)
    counts["over"] += int(over.sum())
    counts["under"] += int(under.sum())
    counts["consumed"] += int(consumed.sum())
    largest["over"] = max(largest["over"], float((-deviation[own]).max(initial=0.0)))
    largest["under"] = max(largest["under"], float(deviation.max()), 0.0)
    kept = np.flatnonzero(over | under | consumed | ~own) if outside_only else np.arange(len(deviation))
    if len(kept) > most:
        kept = kept[np.argsort(-np.abs(deviation[kept]), kind="stable")[:most]] if outside_only else kept
    kinds = np.broadcast_to(rows[0], deviation.shape)
    found.parts.append(tuple(np.asarray(v)[kept] for v in (kinds, *rows[1:])))


def _nothing() -> list[Any]:
    flat, none = np.empty(0), np.empty(0, dtype=np.int64)
    return [none, np.empty((0, 3)), np.empty((0, 3)), flat, flat, flat > 0.0, flat > 0.0, none]


def cut_beneath(along: NormalVectors, tolerance: float, sweeps: Sequence[Sweep]) -> Bools:
    """(n,) vectors shortened by more than the tolerance although no sweep reaches that far below C: what is taken lies deeper.

    A groove in the top of a plate crosses the vectors of its outer walls. How deep it is, the vectors over it tell.
    """
    out = np.zeros(len(along), dtype=np.bool_)
    at = np.flatnonzero(along.length < -tolerance)
    just_below = along.point[at] - tolerance * along.normal[at]  # a cutter that ends at C is no overcut
    reached = owners(just_below, np.zeros(len(at)), sweeps, range(len(sweeps)))
    out[at[reached < 0]] = bool(sweeps)
    return out


def owners(tips: Floats, length: Floats, sweeps: Sequence[Sweep], blocks: Sequence[int]) -> Ints:
    """(n,) number of the first block whose sweep reaches a tip (n, 3), -1 where none does.

    Lengths are the shortest over all blocks, so no sweep reaches beyond a tip (but from behind), and the first that touches
    it made it. It is computed again for the vectors that are reported, instead of being kept for all.
    """
    out = np.full(len(tips), -1)
    if not len(tips) or not sweeps:
        return out
    slack = TOLD + np.spacing(np.abs(length).astype(np.float32)).astype(np.float64)
    order = np.argsort(tips[:, 0], kind="stable")
    x = tips[order, 0]
    for sweep, block in zip(sweeps, blocks, strict=True):
        box = sweep.bounds + [[-1e-3], [1e-3]]
        near = order[np.searchsorted(x, box[0, 0]) : np.searchsorted(x, box[1, 0])]
        near = near[out[near] < 0]
        near = near[((tips[near] >= box[0]) & (tips[near] <= box[1])).all(axis=1)]
        if len(near):
            out[near[sweep.signed_distance(tips[near]) <= slack[near]]] = block
    return out
