"""Tool paths of the analytic engagement: CL or CC points with the axis by rotations, interpolated in straight lines."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats
from vmachining.engagement.frames import angles_of, rotation
from vmachining.errors import InputError


class Poses(NamedTuple):
    """tip (n, 3) mm, frame (n, 3, 3), velocity and axis_rate (n, 3), per s; arguments of `engaged`."""

    tip: Floats
    frame: Floats
    velocity: Floats
    axis_rate: Floats


def axis_rate_of(theta_a: ArrayLike, theta_b: ArrayLike, rate_a: ArrayLike, rate_b: ArrayLike) -> Floats:
    """(..., 3) 1/s, dw/dt of `axis_of` for rates in rad/s of both rotations."""
    a, b, da, db = (np.asarray(v, dtype=np.float64) for v in (theta_a, theta_b, rate_a, rate_b))
    sa, ca, sb, cb = np.sin(a), np.cos(a), np.sin(b), np.cos(b)
    columns = np.broadcast_arrays(cb * db, sa * sb * db - ca * cb * da, -sa * cb * da - ca * sb * db)
    return np.stack(columns, axis=-1)


@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """CL points of a path. tip (n, 3) mm; theta_a, theta_b (n,) rad; two or more.

    Between two records tip and rotations are linear in time.

    Raises InputError: Fewer than two records, columns of different lengths, values that are not finite.
    """

    tip: Floats
    theta_a: Floats
    theta_b: Floats

    def __post_init__(self) -> None:
        tip = np.array(self.tip, dtype=np.float64)
        if tip.ndim != 2 or tip.shape[1] != 3 or len(tip) < 2:
            raise InputError(f"a path needs two or more points (x, y, z), got shape {tip.shape}")
        angles = [np.array(v, dtype=np.float64) for v in (self.theta_a, self.theta_b)]
        if any(v.shape not in ((), (len(tip),)) for v in angles):
            raise InputError(f"{len(tip)} points need as many angles, or one for all")
        columns = [tip, *(np.broadcast_to(v, (len(tip),)).copy() for v in angles)]
        if not all(np.isfinite(v).all() for v in columns):
            raise InputError("a path needs finite points and angles")
        for name, value in zip(("tip", "theta_a", "theta_b"), columns, strict=True):
            object.__setattr__(self, name, value)

    @classmethod
    def of_axes(cls, tip: ArrayLike, axis: ArrayLike) -> Records:
        """CL points with unit axes (n, 3), as CL files carry them."""
        tilts = angles_of(np.broadcast_to(np.asarray(axis, dtype=np.float64), np.shape(tip)))
        return cls(np.asarray(tip), tilts.theta_a, tilts.theta_b)

    @property
    def lengths(self) -> Floats:
        """(n - 1,) mm of the path of the tip between records."""
        return np.asarray(np.linalg.norm(np.diff(self.tip, axis=0), axis=1))

    def at(self, where: ArrayLike, *, feed_mm_min: ArrayLike | None = None) -> Poses:
        """The tool at places (k,): i + p is the fraction p of the way from record i to the next.

        At a record the motion is that of the interval that begins there, at the last one that which ends there.

        feed_mm_min : of the tip, one or (n - 1,) for every interval. None: every interval takes 1 s.
        """
        u = np.array(where, dtype=np.float64, ndmin=1)
        n = len(self.tip)
        if not ((u >= 0.0) & (u <= n - 1)).all():
            raise InputError(f"places on a path of {n} records go from 0 to {n - 1}")
        i = np.minimum(u.astype(np.int64), n - 2)
        p = u - i
        rate = np.ones(n - 1)
        if feed_mm_min is not None:
            feed = np.broadcast_to(np.asarray(feed_mm_min, dtype=np.float64), (n - 1,))
            with np.errstate(divide="ignore", invalid="ignore"):
                rate = feed / 60.0 / self.lengths
            if not np.isfinite(rate[i]).all():
                what = "the tip rests between two records, which then have no feed"
                raise InputError(what, remedy="leave out feed_mm_min")
        place = [v[i] + p * (v[i + 1] - v[i]) for v in (self.theta_a, self.theta_b)]
        turn = [(v[i + 1] - v[i]) * rate[i] for v in (self.theta_a, self.theta_b)]
        travel = self.tip[i + 1] - self.tip[i]
        tip, rates = self.tip[i] + p[:, None] * travel, travel * rate[i, None]
        return Poses(tip, rotation(*place), rates, axis_rate_of(*place, *turn))
