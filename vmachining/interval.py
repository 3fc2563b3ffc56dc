"""A number that knows how far it can be from the truth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class Interval:
    """`lo <= truth <= hi`, with the best estimate between them. Volumes are in mm^3.

        removed = sum(blocks)               # intervals add end by end
        720.0 in removed, removed.width, f"{removed:.6g}"
        lo, estimate, hi = removed

    proven : True: both ends are bounds. False: the interval is stated with some confidence, or rests on a step
        that is not proven.
    """

    lo: float
    estimate: float
    hi: float
    proven: bool = True

    @property
    def width(self) -> float:
        """hi - lo."""
        return self.hi - self.lo

    @property
    def error(self) -> float:
        """How far the truth can be from the estimate."""
        return max(self.hi - self.estimate, self.estimate - self.lo)

    def __len__(self) -> int:
        return 3

    def __getitem__(self, index: int) -> float:
        """As a sequence it is the three numbers, also for numpy."""
        return (self.lo, self.estimate, self.hi)[index]

    def __iter__(self) -> Iterator[float]:
        return iter((self.lo, self.estimate, self.hi))

    def __add__(self, other: Interval) -> Interval:
        """The sum of two numbers; proven where both are."""
        if not isinstance(other, Interval):
            return NotImplemented
        lo, estimate, hi = (a + b for a, b in zip(self, other, strict=True))
        return Interval(lo, estimate, hi, self.proven and other.proven)

    def __radd__(self, other: object) -> Interval:
        """`sum()` starts at 0."""
        return self if other == 0 else NotImplemented

    def __sub__(self, other: Interval) -> Interval:
        """The difference of two numbers; proven where both are."""
        if not isinstance(other, Interval):
            return NotImplemented
        return Interval(
            self.lo - other.hi,
            self.estimate - other.estimate,
            self.hi - other.lo,
            self.proven and other.proven,
        )

    def __contains__(self, value: float) -> bool:
        return self.holds(value)

    def holds(self, value: float, slack: float = 0.0) -> bool:
        """Whether `value` lies in the interval, widened by `slack` on both sides."""
        return self.lo - slack <= value <= self.hi + slack

    def within(self, lo: float, hi: float) -> Interval:
        """What this interval and [lo, hi], which meet, allow together. An estimate that the other one excludes says nothing of
        where the truth lies in what is left: it becomes the middle, which is wrong by half of it at most."""
        lo, hi = max(lo, self.lo), min(hi, self.hi)
        known = lo < self.estimate < hi or self.estimate == lo == 0.0  # an estimate of nothing is at no end
        estimate = self.estimate if known else 0.5 * (lo + hi)
        return replace(self, lo=lo, estimate=estimate, hi=hi)

    def at_least(self, floor: float) -> Interval:
        """The same interval, cut off at a number that the truth cannot be below."""
        lo, estimate, hi = (max(floor, value) for value in self)
        return Interval(lo, estimate, hi, self.proven)

    def stated(self) -> Interval:
        """The same three numbers, no longer called proven."""
        return replace(self, proven=False)

    def __format__(self, spec: str) -> str:
        spec = spec or ".8g"
        word = "" if self.proven else ", stated"
        return f"{self.estimate:{spec}} [{self.lo:{spec}}, {self.hi:{spec}}{word}]"

    def __str__(self) -> str:
        return format(self)


Bracket = Interval
"""The name that scripts of earlier versions use."""
