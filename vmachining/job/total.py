"""The total of a run: two brackets of one number, the estimate inside of what is proven, and blocks that add up to it.

What all blocks remove lies between the sums of their bounds, and between stock before minus stock after. A proof wins: where
one of the two is proven and the other is only stated, the proven one is the bracket; where both are alike, it is what both
allow. The sum of the estimates of the blocks may lie outside of it, because each of them is the middle of what was found of
one block. The estimate of the total is then that of the workpiece, and where that lies outside too, the middle; every block
is brought by the same share of its way to the end of its own bracket.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import polars as pl

from vmachining.interval import Interval

ENDS = ("removed_lo_mm3", "removed_mm3", "removed_hi_mm3")

ROUNDING_REL = 1e-9
"""Of the stock: brackets that miss each other by less do so by the rounding of their sums."""

APART = (
    "the sum over the blocks, {:.8g} to {:.8g} mm3, and stock before minus stock after, {:.8g} to {:.8g} mm3, exclude each "
    "other: at least one of them is wrong, please report it; the total is stated between their outer ends"
)


class Total(NamedTuple):
    """removed, final : mm^3, stated where they are not proven. moved : whether the sum of the estimates of the blocks had to
    be brought into the bracket. note : what is wrong with them; None: nothing."""

    removed: Interval
    final: Interval
    moved: bool
    note: str | None = None


def total_of(rows: pl.DataFrame, before: Interval, final: Interval, slack: float = 0.0) -> Total:
    """What all blocks remove, and what is left.

    rows : the columns of `ENDS` and `proven`. before, final : of the raw and of the finished workpiece, as the engine has it.
    slack : mm^3 by which the stock of the engine may differ from the one of the job, to first order.
    """
    lo, estimate, hi = (float(rows[name].sum()) for name in ENDS)
    added, balance = Interval(lo, estimate, hi, bool(rows["proven"].all())), before - final
    rounding = ROUNDING_REL * before.hi
    removed, note = _both(added, balance, rounding), None
    if removed is None:
        removed = Interval(min(lo, balance.lo), estimate, max(hi, balance.hi), proven=False)
        note = APART.format(lo, hi, balance.lo, balance.hi)
    # of the estimates in the bracket the one that also leaves a workpiece within its own
    lowest = max(0.0, removed.lo, before.estimate - final.hi)
    highest = min(removed.hi, before.estimate - final.lo)
    gone = _inside((estimate, balance.estimate), lowest, highest, rounding)
    gone = _within(gone, max(0.0, removed.lo), removed.hi)
    left = _within(before.estimate - gone, final.lo, final.hi)
    if slack > 0.0:
        removed, final = removed.stated(), final.stated()
    return Total(
        Interval(max(0.0, removed.lo - slack), gone, removed.hi + slack, removed.proven),
        Interval(max(0.0, final.lo - slack), left, final.hi + slack, final.proven),
        gone != estimate,
        note,
    )


def _both(added: Interval, balance: Interval, rounding: float) -> Interval | None:
    """What two brackets of one number prove, or state if neither proves; None: they exclude each other."""
    lo, hi = max(added.lo, balance.lo), min(added.hi, balance.hi)
    if lo > hi + rounding:
        return None
    if added.proven != balance.proven:
        return added if added.proven else balance
    return Interval(min(lo, hi), added.estimate, max(lo, hi), added.proven)


def _inside(values: tuple[float, ...], lo: float, hi: float, rounding: float) -> float:
    """The first of the values that lies in [lo, hi] and at none of its ends, else the middle; of a narrow one the nearest.
    An estimate of nothing is at no end: less than nothing cannot be removed."""
    if hi - lo <= rounding:
        return _within(values[0], min(lo, hi), max(lo, hi))
    return next((value for value in values if lo < value < hi or value == lo == 0.0), 0.5 * (lo + hi))


def _within(value: float, lo: float, hi: float) -> float:
    return min(max(value, lo), hi)


def settled(rows: pl.DataFrame, total: Total) -> pl.DataFrame | None:
    """Estimates of blocks whose sum is the total: the columns block, removed_mm3 and mrr_mm3_min; None: they are so.

    rows : block, time_s and the columns of `ENDS`, of the program or of one that cuts the same.
    """
    if not total.moved:
        return None
    target = total.removed.estimate
    lo, estimate, hi = (rows[name].to_numpy() for name in ENDS)
    off = target - float(estimate.sum())
    room = hi - estimate if off > 0.0 else estimate - lo
    whole, moved = float(room.sum()), estimate
    if off != 0.0 and whole > 0.0:
        moved = estimate + np.copysign(abs(off) / whole if abs(off) < whole else 1.0, off) * room
    seconds = rows["time_s"].fill_null(0.0).to_numpy()
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = np.where(seconds > 0.0, 60.0 * moved / seconds, np.nan)
    out = pl.DataFrame({"block": rows["block"], "removed_mm3": moved, "mrr_mm3_min": rate})
    return out.with_columns(pl.col("mrr_mm3_min").fill_nan(None))
