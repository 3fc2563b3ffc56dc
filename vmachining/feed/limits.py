"""Smallest and largest feed, the clamp rule, and what is written of a feed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vmachining.arrays import Floats
from vmachining.errors import FeedError

STEP_MM_MIN = 0.1
"""Written feeds are multiples of this."""

ROUNDING = 1e-13
"""Relative slack of the rounding down: a few ulp of the handful of operations behind a feed, so that a feed
that is a multiple of the step does not fall to the next one."""


class Limit(StrEnum):
    """Which limit decided the feed of a block; from harmless to serious."""

    NONE = "none"
    AIR = "air"
    MAX = "max"
    AXIS = "axis"
    MIN = "min"
    INFEASIBLE_MIN = "infeasible_min"
    """The cap of the machine lies below the smallest feed; the cap wins."""


WORDS = tuple(Limit)


@dataclass(frozen=True, slots=True, kw_only=True)
class FeedLimits:
    """Feeds between which a scheduler may choose, mm/min.

    Raises FeedError: Not finite, below 0.1 mm/min, or min above max.
    """

    min_mm_min: float = 1.0
    max_mm_min: float

    def __post_init__(self) -> None:
        for name, value in (("min_mm_min", self.min_mm_min), ("max_mm_min", self.max_mm_min)):
            if not (math.isfinite(value) and value >= STEP_MM_MIN):
                raise FeedError(f"{name} is {value}, expected a finite feed of at least {STEP_MM_MIN} mm/min")
        if self.min_mm_min > self.max_mm_min:
            raise FeedError(f"min_mm_min {self.min_mm_min:g} is above max_mm_min {self.max_mm_min:g}")


def clamp(raw: ArrayLike, limits: FeedLimits, cap_mm_min: ArrayLike) -> tuple[Floats, NDArray[np.int8]]:
    """F = min(max(F_raw, F_min), min(F_max, U)), eq. (3).

    raw : (n,) mm/min, inf for air. cap_mm_min : (n,) or float, U, inf where nothing limits.
    Returns the feed (n,) mm/min, and the limit (n,) int8: the position of its word in `Limit`.
    """
    asked, cap = np.asarray(raw, dtype=np.float64), np.asarray(cap_mm_min, dtype=np.float64)
    top = np.minimum(limits.max_mm_min, cap)
    feed = np.minimum(np.maximum(asked, limits.min_mm_min), top)
    words = np.select(
        [
            np.broadcast_to(cap < limits.min_mm_min, feed.shape),
            np.isinf(asked),
            asked < limits.min_mm_min,
            (asked > top) & (cap < limits.max_mm_min),
            asked > top,
        ],
        [WORDS.index(w) for w in (Limit.INFEASIBLE_MIN, Limit.AIR, Limit.MIN, Limit.AXIS, Limit.MAX)],
        WORDS.index(Limit.NONE),
    )
    return np.asarray(feed), words.astype(np.int8)


def floor_feed(feed_mm_min: ArrayLike) -> Floats:
    """Feeds rounded down to 0.1 mm/min, so that what is written never exceeds what was computed."""
    steps = np.asarray(feed_mm_min, dtype=np.float64) / STEP_MM_MIN
    return np.asarray(np.floor(steps * (1 + ROUNDING)) / 10.0)


def written_feed(
    feed: Floats, limits: FeedLimits, cap: Floats, original: Floats, line: NDArray[np.int64]
) -> Floats:
    """What goes into the program for a clamped feed.

    Rounded down; only where that would fall below F_min, and the upper limit allows, the next step above
    F_min. A feed that equals the original one stays the original one, whatever its decimals.
    """
    top = floor_feed(np.minimum(limits.max_mm_min, cap))
    if (low := top < STEP_MM_MIN).any():
        raise FeedError(f"the cap leaves less than {STEP_MM_MIN} mm/min", line=int(line[low][0]))
    lowest = math.ceil(limits.min_mm_min / STEP_MM_MIN * (1 - ROUNDING)) / 10.0
    rounded = np.maximum(floor_feed(feed), np.minimum(lowest, top))
    same = np.abs(feed - original) <= 10 * ROUNDING * feed
    return np.asarray(np.where(same, original, rounded))
