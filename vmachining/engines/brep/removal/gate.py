"""The gate: which value of a boolean is called agreed.

    T = intersection of the judges' intervals
    T empty                      -> disputed: one of us is wrong
    value in T +- own error      -> agreed (first attempt) or retried (number and name of the attempt)
    none in T                    -> refused with the reasons; T stands

The error of a value that stands is its distance to the farther end of T, and what the boolean itself may be off. It must be
below the value, or nothing was learnt of it. A block that is known to remove less than any boolean may be off removes nothing.
"""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple

from vmachining.engines.judges import Judge
from vmachining.engines.protocol import Removal

OWN_MM3, OWN_REL = 1e-6, 1e-5
"""Own error of a boolean: edges of 100 mm and faces that move by 1e-8 mm; what spline faces are asked to be good to."""

ATTEMPT_SHARE = 0.25
"""Of the limit of a block: one attempt. What hangs costs no more than that."""

GROWTH_MM = 1e-5
"""By how much the attempt `grown` moves tangent faces apart: a hundred times OCCT's confusion of points."""


class Status(StrEnum):
    """agreed: at the first attempt; retried: at a later one; refused: at none; disputed: the judges exclude each other;
    skipped: nobody asked."""

    AGREED = "agreed"
    RETRIED = "retried"
    REFUSED = "refused"
    DISPUTED = "disputed"
    SKIPPED = "skipped"


class Value(NamedTuple):
    """What an attempt finds, mm^3. own : what it changed by its own doing, beside `OWN_MM3` and `OWN_REL`."""

    volume: float
    own: float = 0.0


class Verdict(NamedTuple):
    """What became of a block.

    removed_mm3, error_mm3 : value of the boolean, and how far it is from the truth at most; None unless agreed or retried.
    attempt, number : name of the one that stands, and its place in the order, from 1; "" and 0 if none does.
    reason : why not. seconds : of a processor, all told. sweeps : earlier ones that were subtracted.
    tried : (attempt, value or None) in order. judges : who judged.
    """

    status: Status
    removed_mm3: float | None = None
    error_mm3: float | None = None
    attempt: str = ""
    number: int = 0
    reason: str = ""
    seconds: float = 0.0
    sweeps: int = 0
    tried: tuple[tuple[str, float | None], ...] = ()
    judges: tuple[Judge, ...] = ()


def error_of(value: Value, truth: Removal) -> float | str:
    """How far a value is from the truth at most, mm^3; or why it does not stand."""
    volume, own = value.volume, value.own + OWN_MM3 + OWN_REL * abs(value.volume)
    if not truth.lo - own <= volume <= truth.hi + own:
        return f"{volume:.6g} mm3 is outside {truth.lo:.6g} to {truth.hi:.6g}"
    if truth.hi <= OWN_MM3:  # nothing is removed: that is known better than any boolean says
        return float(max(truth.hi - max(volume, 0.0), volume - truth.lo))
    error = own + max(truth.hi - volume, volume - truth.lo, 0.0)
    if error >= max(volume, 0.0):
        return f"{volume:.6g} mm3 is within {truth.lo:.6g} to {truth.hi:.6g}, which is too little to tell a value from"
    return error
