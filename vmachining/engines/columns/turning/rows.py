"""Sweeps of convex cutters in any motion as rows of the kernels of columns in any direction."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from vmachining.arrays import Bools, Floats, Ints
from vmachining.geometry import Arc, Line
from vmachining.numerics.series import Series
from vmachining.sweep import Sweep, Turn
from vmachining.sweep.rotating import arc_series, rate_bound, waves_of
from vmachining.tool import Profile

MOST_TURN = np.radians(1.0)
"""Of one row: longer turns are divided in time (docs/columns_any_direction.md)."""

MOST_BOW = 4.0
"""mm, second derivative of the tip by the time of one row: an arc of 90 degrees with a radius of 1.6 mm is one."""

FITS = 1e-9
"""mm, of an arc that is tangent to the flank above it: FIT_MM of profiles."""

SAME = 1e-12
"""mm and rad, of two poses whose numbers are those of one line of a program: rounding of a great circle at its end."""

ROUNDED = 1.0 + 1e-9
"""Bounds of rates are themselves sums."""


class Rows(NamedTuple):
    """Motions of cutters that turn a degree at most.

    cutter : (n, 7) ring a, z, radius r, sine and cosine of the flank, radius and height of the top, see `_kernels.py`.
    limits : (n, 3) bounds of the turning rate, of the acceleration of the tip, of rate^2 and acceleration of the axis.
    ends : (n, 2, 6) tip and axis of the first and the last pose.
    plain : (n,) 1 where both ends say the whole motion: straight tip, great circle.
    waves : (m, 19) see sweep/rotating/pose/_kernels.py; of : (m,) the row that each belongs to, rising.
    """

    cutter: Floats
    limits: Floats
    ends: Floats
    plain: Ints
    waves: Floats
    of: Ints

    def __len__(self) -> int:
        return len(self.cutter)

    @classmethod
    def join(cls, parts: Sequence[Rows]) -> Rows:
        """All of them, one after the other."""
        first = np.cumsum([0, *(len(part.cutter) for part in parts)])
        of = [part.of + n for part, n in zip(parts, first, strict=False)]
        cutter, limits, ends, plain, waves = (np.concatenate([part[c] for part in parts]) for c in range(5))
        return Rows(cutter, limits, ends, plain, waves, np.concatenate(of))

    def take(self, which: Ints) -> Rows:
        """Some of them, in this order."""
        counts = np.bincount(self.of, minlength=len(self))
        first, many = np.cumsum(counts) - counts, counts[which]
        of = np.repeat(np.arange(len(which)), many)
        inside = np.arange(len(of)) - np.repeat(np.cumsum(many) - many, many)
        chosen = self.waves[first[which][of] + inside]
        return Rows(self.cutter[which], self.limits[which], self.ends[which], self.plain[which], chosen, of)

    def reach(self, directions: Floats) -> Floats:
        """(n, 2 k) mm: no point of a sweep lies farther along unit directions (k, 3), and against them (L3 for whole bodies)."""
        c = self.cutter
        cos = self.ends[:, :, 3:] @ directions.T
        sin = np.sqrt(np.maximum(1.0 - cos**2, 0.0))
        a, z, r, top, height = (c[:, k, None, None] for k in (0, 1, 2, 5, 6))
        ring, rim, low, high = a * sin + r, top * sin, z * cos, height * cos
        body = np.concatenate(
            [np.maximum(ring + low, rim + high), np.maximum(ring - low, rim - high)], axis=2
        )
        far = np.abs(c[:, [1, 2, 5, 6]]).sum(axis=1) + c[:, 0]
        bow = 0.125 * (self.limits[:, 1] + self.limits[:, 2] * far)
        tips = self.ends[:, :, :3] @ directions.T
        out: Floats = (np.concatenate([tips, -tips], axis=2) + body).max(axis=1) + bow[:, None]
        return out

    def with_pose(self, k: int, end: int) -> Bools:
        """(n,) which rows begin or end in the first or last pose of row k of theirs, with the same cutter."""
        near = np.abs(self.ends - self.ends[k, end]).max(axis=2) <= SAME
        same: Bools = near.any(axis=1) & (self.cutter == self.cutter[k]).all(axis=1)
        return same

    def as_one(self, k: int) -> Bools:
        """(n,) which rows are the motion of row k, there or back, by the numbers of their ends."""
        there = np.abs(self.ends - self.ends[k]).max(axis=(1, 2)) <= SAME
        back = np.abs(self.ends[:, ::-1] - self.ends[k]).max(axis=(1, 2)) <= SAME
        plain = (self.plain == 1) & (self.plain[k] == 1)
        same: Bools = plain & (there | back) & (self.cutter == self.cutter[k]).all(axis=1)
        return same

    def seen_from(self, frame: Floats, origin: Floats) -> tuple[Floats, Floats]:
        """Rows (2 n, 12) and waves of the kernels in a frame (3, 3) with rows u, v, t about an origin, each also mirrored."""
        n, m = len(self), len(self.waves)
        counts = np.bincount(self.of, minlength=n)
        rows, waves = np.zeros((n, 2, 12)), np.zeros((2, m + n, 19))
        place = np.arange(m) + self.of  # behind the waves of each row one that takes the origin away
        last = np.cumsum(counts + 1) - 1
        for side, way in enumerate((frame, frame * np.array([[1.0], [1.0], [-1.0]]))):
            waves[side, place, 0] = self.waves[:, 0]
            waves[side, place, 1:] = (self.waves[:, 1:].reshape(m, 6, 3) @ way.T).reshape(m, 18)
            waves[side, last, 1:4] = -way @ origin
            rows[:, side, :7], rows[:, side, 7:10] = self.cutter, self.limits
            rows[:, side, 10], rows[:, side, 11] = last - counts + side * (m + n), counts + 1
        return rows.reshape(2 * n, 12), waves.reshape(-1, 19)


@lru_cache(maxsize=256)
def meridian(profile: Profile) -> tuple[float, ...] | None:
    """(7,) of a convex profile: a flat or round bottom, a flank that widens upward or stands upright, a flat top.

    None for other bodies, blunt cones at the bottom among them; a pointed cone is a flank without a bottom.
    """
    segments = list(profile.segments)
    low = segments[0]
    a, z, r = low.r0, low.z0, 0.0
    if low.is_arc:
        if abs(low.cz - low.z0 - low.radius) > FITS or abs(low.cr - low.r0) > FITS:
            return None
        a, z, r = low.cr, low.cz, low.radius
        segments = segments[1:]
    if len(segments) > 1 or any(s.is_arc for s in segments):
        return None
    if not segments:
        return (a, z, r, 0.0, 1.0, a + r, z) if abs(low.z1 - low.cz) <= FITS else None
    flank = segments[0]
    length = float(np.hypot(flank.r1 - flank.r0, flank.z1 - flank.z0))
    sin, cos = (flank.r1 - flank.r0) / length, (flank.z1 - flank.z0) / length
    if sin < 0.0 or cos <= 0.0 or abs(flank.r0 - a - r * cos) + abs(flank.z0 - z + r * sin) > FITS:
        return None
    return a, z, r, sin, cos, flank.r1, flank.z1


def _motion(path: Line | Arc | Turn) -> tuple[Series, Series]:
    """Tip and axis."""
    if isinstance(path, Turn):
        return path.tip_series, path.axis_series
    up = Series.constant(np.array([0.0, 0.0, 1.0]))
    if isinstance(path, Arc):
        return arc_series(path), up
    return Series.linear(path.start, path.end - path.start), up


def rows_of(sweep: Sweep) -> Rows:
    """Of the convex pieces of a cutter that is known, each divided in time where it turns or bends."""
    known = [c for c in map(meridian, sweep.profile.convex_pieces()) if c is not None]
    tip, axis = _motion(sweep.path)
    turn, bow = rate_bound(axis, 1) / MOST_TURN, np.sqrt(tip.bound(2) / MOST_BOW)
    count = max(1, int(np.ceil(max(turn, bow) - 1e-6)))
    cutter, limits, ends, plain, waves = [], [], [], [], list[Floats]()
    for a, b in pairwise([k / count for k in range(count + 1)]):
        p, x = (tip, axis) if count == 1 else (tip.part(a, b), axis.part(a, b))
        rate, bow = rate_bound(x, 1), p.bound(2)
        whole = [w for w, z in zip(x.frequencies, x.terms, strict=True) if z.any()]
        for one in known:
            cutter.append(one)
            limits.append((rate, bow, rate**2 + x.bound(2)))
            ends.append([[*p.at(s), *x.at(s)] for s in (0.0, 1.0)])
            plain.append(bow == 0.0 and len(whole) == 1)
            waves.append(waves_of(p, x))
    return Rows(
        np.array(cutter), np.array(limits) * ROUNDED, np.array(ends), np.array(plain, dtype=np.int64), np.concatenate(waves),
        np.repeat(np.arange(len(waves)), [len(w) for w in waves]),
    )  # fmt: skip
