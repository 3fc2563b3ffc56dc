"""The numbers of a machine that its times depend on. None means unlimited."""

from __future__ import annotations

import math
from dataclasses import dataclass

from vmachining.errors import KinematicsError

CORNER_TOLERANCE_MM = 0.01
"""What controls are commonly set to for semi-finishing (G64 P0.01), where neither job nor program says it."""


Axes = tuple[float | None, float | None, float | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class MachineLimits:
    """Feeds, accelerations and pauses of a machine.

    rapid_mm_min : float or None
        Speed of a rapid along its path; None: a rapid takes no time, unless slides limit it.
    max_feed_mm_min : float or None
        Largest feed along the path.
    axis_feed_mm_min, axis_rapid_mm_min : three, each float or None; or None
        Largest speed of the x, y and z slides while feeding, and in rapids.
    max_acceleration_mm_s2 : float or None
        Along and across the path; None: speeds change at once.
    rapid_acceleration_mm_s2 : float or None
        The same in rapids; None: as at feed.
    axis_acceleration_mm_s2 : three, each float or None; or None
        Of the x, y and z slides.
    max_jerk_mm_s3 : float or None
        Along the path.
    corner_tolerance_mm : float, how far the path may miss a corner, where the program does not say.
    tool_change_s, table_change_s, program_stop_s, block_s : float, what a tool change, a pallet change (M60), a stop by
        the program (M0, M1), and every block last at least.
    spindle_start_s, spindle_s_per_1000_rev_min : float, a start or stop of the spindle lasts the first, and the second
        for each 1000 rev/min.
    feed_override, rapid_override : float, share of the programmed feed and of the rapid speed; 1 is 100 %.
    min_feed_mm_min, spindle_rev_min, travel_mm : float, pair, three pairs; or None
        Smallest feed, slowest and fastest spindle, travel of x, y, z in machine coordinates. Times do not need them.
    Raises KinematicsError: A limit that is not a positive finite number, or not three axes.
    """

    rapid_mm_min: float | None = None
    max_feed_mm_min: float | None = None
    axis_feed_mm_min: Axes | None = None
    max_acceleration_mm_s2: float | None = None
    rapid_acceleration_mm_s2: float | None = None
    axis_rapid_mm_min: Axes | None = None
    axis_acceleration_mm_s2: Axes | None = None
    max_jerk_mm_s3: float | None = None
    corner_tolerance_mm: float = CORNER_TOLERANCE_MM
    tool_change_s: float = 0.0
    table_change_s: float = 0.0
    spindle_start_s: float = 0.0
    spindle_s_per_1000_rev_min: float = 0.0
    program_stop_s: float = 0.0
    block_s: float = 0.0
    feed_override: float = 1.0
    rapid_override: float = 1.0
    min_feed_mm_min: float | None = None
    spindle_rev_min: tuple[float, float] | None = None
    travel_mm: tuple[tuple[float, float], tuple[float, float], tuple[float, float]] | None = None

    def __post_init__(self) -> None:
        named: dict[str, float | None] = {}
        for key in ("axis_feed_mm_min", "axis_rapid_mm_min", "axis_acceleration_mm_s2"):
            axes = getattr(self, key) or (None, None, None)
            if len(axes) != 3:
                raise KinematicsError(f"{key} needs three values (x, y, z), got {len(axes)}")
            named |= {f"{key} of {name}": value for name, value in zip("xyz", axes, strict=True)}
        for key in (
            "rapid_mm_min", "max_feed_mm_min", "max_acceleration_mm_s2", "rapid_acceleration_mm_s2", "max_jerk_mm_s3",
            "feed_override", "rapid_override",
        ):  # fmt: skip
            named[key] = getattr(self, key)
        for name, value in named.items():
            if value is not None and not (math.isfinite(value) and value > 0):
                raise KinematicsError(
                    f"{name} is {value}, expected a positive number", remedy="leave it out for no limit"
                )
        for name in (
            "corner_tolerance_mm", "tool_change_s", "table_change_s", "spindle_start_s", "spindle_s_per_1000_rev_min",
            "program_stop_s", "block_s",
        ):  # fmt: skip
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise KinematicsError(f"{name} is {getattr(self, name)}, expected 0 or more")

    @property
    def axes(self) -> tuple[float | None, ...]:
        """Limit of the x, y and z slide, mm/min."""
        return (None, None, None) if self.axis_feed_mm_min is None else tuple(self.axis_feed_mm_min)
