"""What makes a value doubtful that lies in its bracket (`ladder.py`), and what is said of it in the end."""

from __future__ import annotations

from typing import NamedTuple

from vmachining.engines.brep.rays import Heard
from vmachining.engines.brep.rungs import Found
from vmachining.geometry import Bracket

__all__ = [
    "SLACK_MM3",
    "SURE_REL",
    "TIGHT_REL",
    "VAGUE_REL",
    "Judged",
    "clear_at",
    "far_at_most",
    "is_far",
    "refuted_by",
]

SLACK_MM3 = 1e-6
"""Rounding of volumes that are nothing: edges of 100 mm and faces that move by 1e-8 mm; own error of a boolean."""

DOUBT_REL, SURE_REL = 0.03, 0.02
"""Of the width of the bracket: a value farther from the estimate is doubtful; error asked of what it is held against."""

TIGHT_REL = 5e-4
"""Of the value: in a bracket that leaves no more room it does not matter where it lies, in a wider one rays are asked until they
tell an error of that much apart."""

VAGUE_REL = 0.25
"""Of the width of the bracket: with a larger error nothing can be told from it."""


class Judged(NamedTuple):
    """right : what stands, None if nothing does; sure : see `Verdict`. Else why it does not, and is_refuted : whether rays
    contradict it, so that another rung may find the truth; if not, nobody can tell it."""

    right: Found | None
    sure: float | None = None
    why: str = ""
    is_refuted: bool = False


def refuted_by(found: Found, seen: Heard) -> str:
    """Why a value does not stand, for the reason of a refusal."""
    return f"{found.rung}: {found.value:.6g} mm3 is not true, rays find {seen.volume:.6g} +- {seen.far:.2g}"


def clear_at(value: float, own: float) -> float:
    """mm^3 that rays have to tell apart: as much as matters of a value that is off by its own error anyway."""
    return max(TIGHT_REL * value, SLACK_MM3, own)


def far_at_most(value: float, seen: Heard) -> float:
    """mm^3, how far a value is from the truth at most if rays are right; infinite where they tell nothing."""
    return abs(value - seen.volume) + seen.far


def is_far(value: float, own: float, bracket: Bracket) -> bool:
    """Whether a value is farther from the estimate than estimates mostly are."""
    return abs(value - bracket.estimate) > own + DOUBT_REL * (bracket.hi - bracket.lo)
