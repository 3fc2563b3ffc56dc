"""Where straight lines are inside a solid."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from vmachining.arrays import Floats, Ints


class RayIntervals(NamedTuple):
    """Where rays are inside a solid: intervals of ray i follow those of ray i - 1, in rising order.

    counts : (n,) intervals per ray. enter, leave : (sum of counts,) mm along the unit direction, from the
    origin; negative values lie behind it.
    """

    counts: Ints
    enter: Floats
    leave: Floats

    @property
    def lengths(self) -> Floats:
        """(n,) mm of every ray inside the solid."""
        ray = np.repeat(np.arange(len(self.counts)), self.counts)
        total = np.zeros(len(self.counts))
        np.add.at(total, ray, self.leave - self.enter)
        return total
