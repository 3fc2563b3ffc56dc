"""A number that knows how far it can be from the truth."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["ZERO", "Bracket"]


class Bracket(NamedTuple):
    """`lo <= truth <= hi`, and the best estimate between them. Volumes in mm^3."""

    lo: float
    estimate: float
    hi: float

    @property
    def width(self) -> float:
        """hi - lo."""
        return self.hi - self.lo

    @property
    def error(self) -> float:
        """How far the truth can be from the estimate."""
        return max(self.hi - self.estimate, self.estimate - self.lo)

    def holds(self, value: float, slack: float = 0.0) -> bool:
        """Whether `value` lies in the bracket, widened by `slack` on both sides."""
        return self.lo - slack <= value <= self.hi + slack

    def plus(self, other: Bracket) -> Bracket:
        """Bracket of the sum."""
        return Bracket(self.lo + other.lo, self.estimate + other.estimate, self.hi + other.hi)


ZERO = Bracket(0.0, 0.0, 0.0)
