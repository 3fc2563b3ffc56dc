"""Sweeps that no single envelope bounds: parts of the tool and of the block whose union is the sweep.

A pivot in the tool folds the envelope inside the sweep. There the tool is cut: the slab around the pivot is swept
by some poses of the whole tool, the bodies below and above it have envelopes that do not fold
(`vmachining.sweep.folds`). What has no slab, or bodies without a solid, is halved in time, until some poses cover it:
at an instant at which the grazing curve jumps no envelope is smooth, but nothing moves far. Every part is built and
gated like its own block; that nothing is missing between them is measured in exact distances (`MISS_MM`).

Where more than `MISS_MM` may be missing, a block is first cut at the instants at which the grazing curve changes, and
pockets of flat faces are filled (`pockets.py`).

A motion that hardly leaves a plane through the axis is taken for one that stays in it, in as many parts of the block
as keep it within `MISS_MM` of the truth: what is planar has simpler solids than what is nearly so.

A motion that stays in a plane through the axis grazes along whole circles and on edges of no width, at all times.
1e-6 mm of motion along the axis and out of the plane (`NUDGES`) makes a general one of it, off by as much. Where its
speed along the axis begins or ends at zero, sheets are sharp there and round elsewhere: such a block is cut where that
speed has grown by `GRADE`, if all else fails; the part next to the zero may be a turn about a fixed line (`fixed_axis.py`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from vmachining.arrays import Floats
from vmachining.engines.brep.envelopes.pieces import cuts_of
from vmachining.engines.brep.occt.tolerances import CONFUSION_MM, GAP_MM, MISS_MM
from vmachining.errors import EngineError, SweepError
from vmachining.sweep import Sweep, Turn
from vmachining.sweep.folds import Slab, plans, poses, standing, uncovered
from vmachining.sweep.topology import changes
from vmachining.tool import Profile

POSES = 16
"""Most parts of a block between whose ends a slab, or the whole tool, has to be covered."""

DEPTH, MOST = 8, 400
"""Most cuts of a part, in tool or time, and most solids: cones and discs that rock about a point inside need hundreds."""

NARROW = 24
"""Most cuts in time altogether: those of which one half has a solid at once only close in on an instant."""

TRIES = 600
"""Most envelopes that are tried for one block, good or not: the same on every machine. They take 0.1 to 1 s each."""

WAYS = ((1, 0), (-1, 0), (1, 1), (-1, 1))
NUDGES = tuple((1e-6, *way) for way in WAYS[:2]) + tuple((1e-5, *way) for way in WAYS)
"""mm by which the last pose of a planar motion may be moved, in parts of the axis and of the normal of the plane."""

GRADE = 4.0
"""Parts over which the lift of a planar motion grows by more have sheets that are sharp here and round there."""

END = 1e-3
"""Closer to an end of a part than this it is not cut."""

FLAT_PARTS = 8
"""Most parts of a block with their own plane each."""

PLANAR = 1e-9
"""A motion leaves its plane by less than this share of its size, or stays in it."""

T = TypeVar("T")
Soft = tuple[float, float]
"""How long before the start and after the end of a part the grazing curve changes, as of `Moving`; infinite where not."""

Build = Callable[[Profile, Turn, float, Soft], list[T]]
"""Solids of a part; the number is how far (mm) its motion is off."""

Fill = Callable[[Profile, Turn, tuple[float, float], float, Soft], list[T]]
"""Solids of the part of a block between two times if it has a pocket, or none; the numbers as of `Build`."""

Special = Callable[[Profile, Turn, float, float], list[T]]
"""Solids of a motion of its own kind, or one off by less than the third number (mm); none of others. The last
one is how far the motion is off already."""


HARD: Soft = (np.inf, np.inf)


class Budget:
    """How many envelopes may still be tried."""

    left = TRIES

    def take(self) -> None:
        """One more; raises SweepError if none exist left."""
        if self.left <= 0:
            raise SweepError(f"the envelope folds: {TRIES} parts of it were tried", remedy="split the block")
        self.left -= 1

    def renew(self) -> None:
        """As many again, for another way of doing it."""
        self.left = TRIES


class Makers(NamedTuple, Generic[T]):
    """What makes solids of parts. special : one solid of a neighbour is preferred to two of it. budget : taken by `build`
    for every envelope."""

    build: Build[T]
    special: Special[T]
    filled: Fill[T]
    budget: Budget


class _Found(NamedTuple, Generic[T]):
    """profile, t : of a pose, so that it is taken once; t is None for a part that moves. parts : its solids."""

    profile: Profile
    t: float | None
    parts: list[T]


def decomposed(profile: Profile, path: Turn, makers: Makers[T], miss_mm: float = MISS_MM) -> list[T]:
    """What `build` makes of the parts of a block of a convex profile. miss_mm : what may be missing between parts.

    Raises SweepError, EngineError: The first reason for which there is no solid, if there are no parts either.
    """
    found = _flat(profile, path, makers)
    if found is not None:
        return found
    makers.budget.renew()
    try:
        return _Work(path, makers, miss_mm).solids(profile)
    except (SweepError, EngineError):
        lift = _lift(path)
        if lift is None or _grade(lift) is None:
            raise
        makers.budget.renew()
        return _Work(path, makers, miss_mm, is_graded=True).solids(profile)


def _flat(profile: Profile, path: Turn, makers: Makers[T]) -> list[T] | None:
    """Solids of parts that stay in a plane each, for a block that nearly does and has none itself; None of others."""
    planes, off = _flattened(path)
    if not planes:
        return None
    build, special, filled, budget = makers
    with suppress(SweepError, EngineError):
        return build(profile, path, 0.0, HARD)
    near = Makers(
        lambda body, part, more, soft: build(body, part, off + more, soft),
        lambda body, part, limit, more: special(body, part, limit, off + more),
        lambda body, whole, span, more, soft: filled(body, whole, span, off + more, soft),
        budget,
    )
    found: list[T] = []
    try:
        for part in planes:
            found += _Work(part, near, MISS_MM).solids(profile)
    except (SweepError, EngineError):
        return None
    return found if len(found) <= MOST else None


class _Work(Generic[T]):
    """Parts in the making; `is_graded` cuts planar motions by their lift."""

    def __init__(self, path: Turn, makers: Makers[T], miss_mm: float, *, is_graded: bool = False) -> None:
        self.path, (self.build, self.special, self.fill, self.budget) = path, makers
        self.miss, self.is_graded = miss_mm, is_graded
        self.off = 0.0
        self.is_wide = miss_mm > MISS_MM
        self.jumps = [t for t in (0.0, 1.0) if self.is_wide and _lift_at(path, t) <= PLANAR]
        self.cut = {(0.0, 1.0): path}
        self.known: dict[tuple[int, float, float], tuple[Profile, list[T] | SweepError | EngineError]] = {}

    def solids(self, profile: Profile) -> list[T]:
        """Of the whole block; poses that several parts need are there once."""
        found = self.parts(profile, 0.0, 1.0, 0)
        if sum(len(f.parts) for f in found) > MOST:
            what = f"the envelope folds: more than {MOST} solids would cover the sweep"
            raise SweepError(what, remedy="split the block")
        once: dict[tuple[int, float], _Found[T]] = {}
        moving = [f for f in found if f.t is None or once.setdefault((id(f.profile), f.t), f) is f]
        return [part for f in moving for part in f.parts]

    def parts(self, profile: Profile, a: float, b: float, depth: int) -> list[_Found[T]]:
        """From t = a to b."""
        part = self._part(a, b)
        reason = self._built(profile, a, b)
        if isinstance(reason, list):
            return [_Found(profile, None, reason)]
        exact = self.special(profile, part, NUDGES[-1][0] if self.is_graded else CONFUSION_MM, 0.0)
        if exact:
            one = self._nudged(profile, part, hasty=True) if len(exact) == 2 else None
            return one if one and len(one[0].parts) == 1 else [_Found(profile, None, exact)]
        deeper = depth < DEPTH
        if self.is_wide:
            cut = self._changed(profile, part, a, b, depth) or self._filled(profile, a, b)
            if cut:
                return cut
        found = self._slab(profile, part, a, b, depth) if deeper else None
        swap = _swap(profile, part)
        lift = _lift(part) if self.is_graded else None
        if swap is None and (lift is None or lift.min() <= CONFUSION_MM):
            found = found or self._nudged(profile, part, hasty=self.is_graded)
        found = found or self._posed(profile, part, a, b)
        if not found and deeper:
            share = _grade(lift) if swap is None and lift is not None else None
            near = (
                0.125 if a in self.jumps else 0.875 if b in self.jumps else 0.5
            )  # what is at a jump ends in poses
            middle = a + (b - a) * (share or swap or near)
            halves = [(profile, a, middle), (profile, middle, b)]
            closes_in = list in [type(self._built(*half)) for half in halves]
            found = self._all(halves, depth - 1 if closes_in and b - a > 0.5**NARROW else depth)
        if not found:
            raise reason
        return found

    def _part(self, a: float, b: float) -> Turn:
        """The motion from t = a to b, the same every time: what is known of it is kept under its name."""
        if (a, b) not in self.cut:
            self.cut[a, b] = self.path.part(a, b)
        return self.cut[a, b]

    def _built(self, profile: Profile, a: float, b: float) -> list[T] | SweepError | EngineError:
        """One envelope from t = a to b, or why none exists."""
        key = (id(profile), a, b)
        if key not in self.known:
            made: list[T] | SweepError | EngineError
            try:
                made = self.build(profile, self._part(a, b), self.off, self._soft(a, b))
            except (SweepError, EngineError) as error:
                made = error
            self.known[key] = profile, made  # a profile that is let go would leave its number to another one
        return self.known[key][1]

    def _soft(self, a: float, b: float) -> Soft:
        """How long (in t of the part) before its start and after its end the curve is known to change."""
        before = min((a - t for t in self.jumps if 0.0 < a - t <= b - a), default=np.inf)
        after = min((t - b for t in self.jumps if 0.0 < t - b <= b - a), default=np.inf)
        return before / max(b - a, 1e-300), after / max(b - a, 1e-300)

    def _changed(
        self, profile: Profile, part: Turn, a: float, b: float, depth: int
    ) -> list[_Found[T]] | None:
        """Parts between the instants at which the grazing curve changes; `GAP_MM` of motion is left out at each."""
        if depth >= DEPTH:
            return None
        found = cuts_of(profile, part) or sorted({c.t for c in changes(Sweep.along(profile, part))})
        cuts = [a + (b - a) * t for t in found]
        reach = float(np.abs(profile.points[:, 1]).max() + profile.max_radius)
        gap = 0.5 * GAP_MM / (self.path.tip_series.bound(1) + reach * self.path.axis_series.bound(1))
        stops = [a, *(t for t in cuts if a + 2.0 * gap < t < b - 2.0 * gap), b]
        if len(stops) == 2:
            return None
        self.jumps += [t for t in stops[1:-1] if t not in self.jumps]
        whole, wanted = Slab(profile.z_min, profile.z_max, ()), []
        for k in range(len(stops) - 1):
            lo, hi = stops[k] + gap * (k > 0), stops[k + 1] - gap * (k + 2 < len(stops))
            if lo < hi:
                wanted.append((profile, lo, hi))
            if k:
                missing = uncovered(profile, self.path.part(stops[k] - gap, stops[k] + gap), whole, 1)
                self.off = max(self.off, missing)
        return self._all(wanted, depth)

    def _filled(self, profile: Profile, a: float, b: float) -> list[_Found[T]] | None:
        """A pocket filled."""
        with suppress(SweepError, EngineError):
            found = self.fill(profile, self.path, (a, b), self.off, self._soft(a, b))
            return [_Found(profile, None, found)] if found else None
        return None

    def _slab(self, profile: Profile, part: Turn, a: float, b: float, depth: int) -> list[_Found[T]] | None:
        """Bodies below and above a slab, and poses."""
        for slab, count in plans(profile, part, 0.5 * self.miss, self.miss, POSES):
            if not self.budget.left:
                break
            found = self._all([(body, a, b) for body in slab.bodies], depth)
            if found is not None:
                return found + self._standing(profile, a, b, count)
        return None

    def _posed(self, profile: Profile, part: Turn, a: float, b: float) -> list[_Found[T]] | None:
        """Poses alone, for a part that hardly moves."""
        count = poses(profile, part, self.miss, POSES)
        return None if count is None else self._standing(profile, a, b, count)

    def _standing(self, profile: Profile, a: float, b: float, count: int) -> list[_Found[T]]:
        """The ends of equal parts."""
        stops = [a + (b - a) * k / count for k in range(count + 1)]
        made = [self.build(profile, standing(self.path, t), self.off, HARD) for t in stops]
        return [_Found(profile, t, parts) for t, parts in zip(stops, made, strict=True)]

    def _nudged(self, profile: Profile, part: Turn, *, hasty: bool = False) -> list[_Found[T]] | None:
        """The solids of a neighbour of a planar motion; `hasty` until one has a shape without solids."""
        for motion, off in _neighbours(part):
            if not self.budget.left:
                break
            try:
                return [_Found(profile, None, self.build(profile, motion, self.off + off, HARD))]
            except (SweepError, EngineError) as error:
                if hasty and isinstance(error, SweepError):
                    break
        return None

    def _all(self, wanted: list[tuple[Profile, float, float]], depth: int) -> list[_Found[T]] | None:
        """All of some parts, None if one of them has no solid."""
        out: list[_Found[T]] = []
        for body, a, b in wanted:
            if not self.budget.left or sum(len(f.parts) for f in out) > MOST:
                return None
            try:
                out += self.parts(body, a, b, depth + 1)
            except (SweepError, EngineError):
                return None
        return out


def _flattened(path: Turn) -> tuple[list[Turn], float]:
    """Parts of a block moved into planes through the axis, and by how much at most (mm); none where it is too much."""
    across = _plane(path)
    if across is None:
        return [], 0.0
    velocity = path.velocity(np.linspace(0.0, 1.0, 9))
    slip, noise = velocity @ across, PLANAR * np.abs(velocity).max()
    count = int(np.ceil(np.abs(slip).max() / (2.0 * MISS_MM)))
    if np.abs(slip).max() <= noise or np.ptp(slip) > noise or count > FLAT_PARTS:
        return [], 0.0
    half = 0.5 * float(slip[0]) / count * across
    parts = [path.part(k / count, (k + 1) / count) for k in range(count)]
    return [part.drifting(-half, half) for part in parts], float(np.linalg.norm(half))


def _swap(profile: Profile, path: Turn) -> float | None:
    """First instant at which front and rear of flat faces swap: a motion is nudged one way before, the other after."""
    found = [c.t for c in changes(Sweep.along(profile, path)) if c.kind == "swap" and END < c.t < 1.0 - END]
    return found[0] if found else None


def _lift(path: Turn) -> Floats | None:
    """(n,) mm: |A . V| / |S| of a planar motion at equal times, how far the axis passes its pole; None of others."""
    if next(_neighbours(path), None) is None:
        return None
    t = np.linspace(0.0, 1.0, 65)
    axis, rate, velocity = path.axis(t), path.axis_rate(t), path.velocity(t)
    return np.asarray(np.abs((axis * velocity).sum(1)) / np.linalg.norm(rate, axis=1))


def _lift_at(path: Turn, t: float) -> float:
    """|A . V| over the speed, at one end of a motion that stays in a plane; infinite of others."""
    if next(_neighbours(path), None) is None:
        return np.inf
    velocity = path.velocity(np.array([t]))[0]
    return float(abs(velocity @ path.axis(np.array([t]))[0]) / max(np.linalg.norm(velocity), 1e-300))


def _grade(lift: Floats) -> float | None:
    """Where to cut a planar motion whose lift begins or ends all but at zero, so that it grows by `GRADE` in a part.

    The grazing curve follows a circle and two meridians but for corners as sharp as the lift is small.
    """
    steps = np.diff(lift)
    if not ((steps > 0.0).all() or (steps < 0.0).all()) or lift.max() <= GRADE * lift.min():
        return None
    order = np.argsort(lift)
    wanted = max(np.sqrt(lift.min() * lift.max()), lift.max() / GRADE**2)
    return float(np.interp(wanted, lift[order], np.linspace(0.0, 1.0, len(lift))[order]))


def _neighbours(path: Turn) -> Iterator[tuple[Turn, float]]:
    """General motions next to a planar one, with their distance in mm; none of others."""
    across, velocity = _plane(path), path.velocity(np.linspace(0.0, 1.0, 9))
    if across is None or np.abs(velocity @ across).max() > PLANAR * max(np.abs(velocity).max(), PLANAR):
        return
    for distance, along, aside in NUDGES:
        yield path.drifting(distance * (along * path.axis(0.5) + aside * across)), distance


def _plane(path: Turn) -> Floats | None:
    """(3,) normal of the plane in which the axis turns; None of an axis that leaves it or does not turn."""
    t = np.linspace(0.0, 1.0, 9)
    across = np.cross(path.axis(t), path.axis_rate(t))
    size = np.linalg.norm(across, axis=1)
    if not size.all():
        return None
    across /= size[:, None]
    return across[4] if np.abs(across - across[0]).max() <= PLANAR else None
