"""How long blocks take, ideally and with bounded acceleration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Bools, Floats, rows
from vmachining.errors import FeedError, KinematicsError
from vmachining.machine import _kernels
from vmachining.machine.limits import MachineLimits

__all__ = ["BlockTimes", "block_times", "feed_path_ratio"]

AT_ONCE = 1e12
"""mm/s^2; takes a nanosecond to a metre per second."""


@dataclass(frozen=True, slots=True, eq=False)
class BlockTimes:
    """Seconds per block, dwell included.

    ideal_s, accelerated_s : (n,)
    junction_mm_s : (n + 1,) speed at the block borders; NaN when the acceleration is unlimited.
    """

    ideal_s: Floats
    accelerated_s: Floats
    junction_mm_s: Floats

    @property
    def total_ideal_s(self) -> float:
        """Length over feed, summed."""
        return float(self.ideal_s.sum())

    @property
    def total_accelerated_s(self) -> float:
        """With bounded acceleration, summed."""
        return float(self.accelerated_s.sum())


def block_times(
    length_mm: ArrayLike,
    feed_mm_min: ArrayLike,
    rapid: ArrayLike,
    limits: MachineLimits,
    *,
    cap_mm_min: ArrayLike | None = None,
    dwell_s: ArrayLike | None = None,
    stop: ArrayLike | None = None,
    acceleration_mm_s2: ArrayLike | None = None,
    rapid_cap_mm_min: ArrayLike | None = None,
) -> BlockTimes:
    """Time of every block of a program.

    Parameters
    ----------
    length_mm : (n,) mm
    feed_mm_min : (n,) mm/min
        Ignored for rapids and for blocks without length (NaN allowed there).
    rapid : (n,) bool
        Blocks at the rapid speed of the machine.
    cap_mm_min : (n,), optional
        Cap of each block, see `axis_caps`. The machine is slow where its slides are, so a programmed feed
        above the cap, or above its largest feed, is timed at the cap.
    dwell_s : (n,), optional
        Pause inside the block; the axes stand still before and after.
    stop : (n,) bool, optional
        The axes stop at the end of the block (tool change, program stop, exact stop).
    acceleration_mm_s2 : (n,), optional
        What the joints allow along each block, see `joint_accelerations`; inf for no limit. The smaller of it
        and the limit of the machine counts.
    rapid_cap_mm_min : (n,), optional
        The same as `cap_mm_min`, of rapids: what the joints allow.

    Raises
    ------
    FeedError
        A block with length that has no positive feed.
    """
    length = rows(length_mm, -1, name="length_mm")
    n = len(length)
    if (length < 0).any():
        raise KinematicsError("length_mm must not be negative")
    fast = _flags(rapid, n, "rapid")
    pause = np.zeros(n) if dwell_s is None else rows(dwell_s, n, name="dwell_s")
    if (pause < 0).any():
        raise KinematicsError("dwell_s must not be negative")
    speed = _speeds(length, feed_mm_min, fast, limits, cap_mm_min, rapid_cap_mm_min)
    moving = length > 0
    ideal = np.divide(length, speed, out=np.zeros(n), where=moving)
    acceleration = _accelerations(n, limits, acceleration_mm_s2)
    junction, real = np.full(n + 1, np.nan), ideal.copy()
    if acceleration is not None:
        halt = np.zeros(n, dtype=np.bool_) if stop is None else _flags(stop, n, "stop")
        junction = _junctions(length, speed, acceleration, halt | (pause > 0))
        _kernels.accelerated_times(length, speed, acceleration, junction, real)
    for array in (ideal, real):
        array += pause
    for array in (ideal, real, junction):
        array.setflags(write=False)
    return BlockTimes(ideal, real, junction)


def feed_path_ratio(length_mm: ArrayLike, rapid: ArrayLike) -> float:
    """Share of the path that is driven at feed: 1 without rapids, 0 without any feed (or any path)."""
    length = rows(length_mm, -1, name="length_mm")
    fast = _flags(rapid, len(length), "rapid")
    whole = float(length.sum())
    return float(length[~fast].sum()) / whole if whole > 0 else 0.0


def _junctions(length: Floats, speed: Floats, acceleration: Floats, halt: Bools) -> Floats:
    """(n + 1,) speeds at the borders. Blocks without length are transparent: the speed passes through."""
    index = np.flatnonzero(length > 0)
    before = np.searchsorted(index, np.arange(len(length) + 1), side="left")
    # a stop belongs to the border behind the last moving block so far
    stops = before[1:][halt]
    kept = np.zeros(len(index), dtype=np.bool_)
    kept[stops[stops > 0] - 1] = True
    border = np.zeros(len(index) + 1)
    _kernels.junction_speeds(length[index], speed[index], acceleration[index], kept, border)
    return np.asarray(border[before])


def _accelerations(n: int, limits: MachineLimits, given: ArrayLike | None) -> Floats | None:
    """(n,) mm/s^2, or None if speeds change at once everywhere. No limit in a single block is a very high one."""
    whole = np.inf if limits.max_acceleration_mm_s2 is None else limits.max_acceleration_mm_s2
    out = np.full(n, whole)
    if given is not None:
        own = np.asarray(given, dtype=np.float64)
        if own.shape != (n,) or not (own > 0).all():
            raise KinematicsError("acceleration_mm_s2: want one positive value per block")
        out = np.minimum(out, own)
    return None if np.isinf(out).all() else np.minimum(out, AT_ONCE)


def _speeds(
    length: Floats,
    feed: ArrayLike,
    fast: Bools,
    limits: MachineLimits,
    cap: ArrayLike | None,
    rapid_cap: ArrayLike | None,
) -> Floats:
    """(n,) mm/s each block would run at on a machine with unlimited acceleration."""
    n = len(length)
    asked = np.array(feed, dtype=np.float64)
    if asked.shape != (n,):
        raise FeedError(f"feed_mm_min: want shape ({n},), got {asked.shape}")
    bad = ~fast & (length > 0) & ~(np.isfinite(asked) & (asked > 0))
    if bad.any():
        k = int(np.flatnonzero(bad)[0])
        raise FeedError(f"block {k} has length {length[k]:g} mm and feed {asked[k]:g} mm/min")
    rapid_speed = np.inf if limits.rapid_mm_min is None else limits.rapid_mm_min
    whole = np.inf if limits.max_feed_mm_min is None else limits.max_feed_mm_min
    ceiling = np.minimum(np.full(n, whole), _caps(cap, n, "cap_mm_min"))
    rapids = np.minimum(np.full(n, rapid_speed), _caps(rapid_cap, n, "rapid_cap_mm_min"))
    idle = ~fast & (length == 0)
    return np.where(fast, rapids, np.where(idle, np.inf, np.minimum(asked, ceiling))) / 60.0


def _caps(cap: ArrayLike | None, n: int, name: str) -> Floats:
    """(n,) caps, inf for none."""
    caps = np.full(n, np.inf) if cap is None else np.asarray(cap, dtype=np.float64)
    if caps.shape != (n,) or not (caps > 0).all():
        raise FeedError(f"{name}: want one positive value per block")
    return caps


def _flags(values: ArrayLike, n: int, name: str) -> Bools:
    flags = np.asarray(values, dtype=np.bool_)
    if flags.shape != (n,):
        raise KinematicsError(f"{name}: want shape ({n},), got {flags.shape}")
    return flags
