"""The numbers of a machine. None means unlimited."""

from __future__ import annotations

import math
from dataclasses import dataclass

from vmachining.errors import KinematicsError

__all__ = ["MachineLimits"]


@dataclass(frozen=True, slots=True, kw_only=True)
class MachineLimits:
    """Feeds and acceleration a three-axis machine can reach.

    Parameters
    ----------
    rapid_mm_min : float or None
        Speed of a rapid along its path; None: a rapid takes no time.
    max_feed_mm_min : float or None
        Largest feed along the path.
    axis_feed_mm_min : tuple of three, each float or None; or None
        Largest speed of the x, y and z slides while feeding.
    max_acceleration_mm_s2 : float or None
        Along the path; None: speeds change at once.

    Raises
    ------
    KinematicsError
        A limit that is not a positive finite number, or not three axes.
    """

    rapid_mm_min: float | None = None
    max_feed_mm_min: float | None = None
    axis_feed_mm_min: tuple[float | None, float | None, float | None] | None = None
    max_acceleration_mm_s2: float | None = None

    def __post_init__(self) -> None:
        axes = self.axes
        if len(axes) != 3:
            raise KinematicsError(f"axis_feed_mm_min wants three values (x, y, z), got {len(axes)}")
        named = {
            "rapid_mm_min": self.rapid_mm_min,
            "max_feed_mm_min": self.max_feed_mm_min,
            "max_acceleration_mm_s2": self.max_acceleration_mm_s2,
            **{f"axis_feed_mm_min of {name}": value for name, value in zip("xyz", axes, strict=True)},
        }
        for name, value in named.items():
            if value is not None and not (math.isfinite(value) and value > 0):
                raise KinematicsError(
                    f"{name} is {value}, want a positive number", remedy="leave it out for no limit"
                )

    @property
    def axes(self) -> tuple[float | None, ...]:
        """Limit of the x, y and z slide, mm/min."""
        return (None, None, None) if self.axis_feed_mm_min is None else tuple(self.axis_feed_mm_min)

    @property
    def has_axis_limits(self) -> bool:
        """Whether any slide has a limit of its own."""
        return any(value is not None for value in self.axes)
