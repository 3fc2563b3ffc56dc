"""Contact along whole programs, quickly: the same question as `contact`, answered in one compiled walk."""

from vmachining.engagement.along.block import (
    ANGLES,
    Chips,
    Cutting,
    Sample,
    Teeth,
    blade,
    fractions,
    samples_along,
)
from vmachining.engagement.along.sweeps import Sweeps

__all__ = ["ANGLES", "Chips", "Cutting", "Sample", "Sweeps", "Teeth", "blade", "fractions", "samples_along"]
