"""Judges of one number: engines of different kinds that give intervals for the removed volume of a block."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from vmachining.engines.protocol import Removal


class Judge(NamedTuple):
    """name : of the engine. removal : what it says."""

    name: str
    removal: Removal


def intersection(judges: Sequence[Judge]) -> Removal | None:
    """What all of them allow, proven where all of it is; None: they exclude each other, and one of them is wrong.

    The estimate is that of the narrowest one, or the end of the intersection that it lies beyond.
    """
    lo = max(judge.removal.lo for judge in judges)
    hi = min(judge.removal.hi for judge in judges)
    if lo > hi:
        return None
    best = min((judge.removal for judge in judges), key=lambda removal: removal.hi - removal.lo)
    ends = [judge.removal.proven for judge in judges if lo == judge.removal.lo or hi == judge.removal.hi]
    return Removal(lo, min(max(best.estimate, lo), hi), hi, all(ends))


def in_words(judges: Sequence[Judge]) -> str:
    """Their intervals in words."""
    return ", ".join(f"{name} {lo:.6g} to {hi:.6g} mm3" for name, (lo, _, hi, *_) in judges)
