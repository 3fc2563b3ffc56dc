"""Removed volume by upright rays through the exact sweeps: what tells a wrong value that lies in its bracket.

A bracket is some percent wide, and a boolean of spheres and cylinders that nearly touch may lose a sliver: in a program of
1 mm blocks of a ball (models/mould) 0.05 to 0.8 % of the chip were missing or too much in one block of thirty, and there
plain cuts and turned ones agreed on that to six digits. Rays know neither solids nor triangles: intervals of a line in a sweep
are exact (`Sweep.ray_intervals`). They stand in all columns in which the block can take something (`live.py`), one at a random
place of every part of a column, in independent sets, whose spread tells how good their mean is. In every second part they stand
where a half turn brings its neighbour's: what slopes evenly adds nothing to the spread (a third to a fifth is left for ball
noses).

A value is asked of few rays first: their standard error is 3e-5 to 3e-4 of the chips of a ball, 3e-4 to 3e-3 of a flat end's,
whose walls are steps. Where that is too much for the caller (`sharp`), or a skin of 5 % of the value might hide between them,
three times as many are asked, most of them where the first ones or their neighbours differ, along those steps, and where columns
are tall: a fifth to a tenth of it is left. A value that is `SUSPECT` standard errors off is asked of about nine times as many as
the first, three times as many as before along steps. It does not stand if it is `BEYOND` of these off, and farther than `HIDDEN`
and rounding allow; if it is still suspect, that is told. By chance a right value does not stand in one block of 1.7 million (t
with 15 degrees of freedom: 2.4e-2 times 2.4e-5), or of 41,000 where one set of rays decides alone: the many where a value was in
doubt from the beginning or others were not sharp enough, the few where many would take more time than the block has (tools that
turn, with many turning ones before them). How far a right value can be from what they find (`Told.far`) grows with the thinness
of a chip: of a skin on a wall they may find nothing at all, and say so. Where bracket and rays contradict each other neither
judges the value any more, and `Heard.alarm` says it.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from math import sqrt
from time import process_time
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, Ints
from vmachining.engines.brep.blank import Blank
from vmachining.engines.brep.outside import Outside
from vmachining.engines.protocol import Removal
from vmachining.geometry import Bracket
from vmachining.sweep import RayIntervals, Sweep
from vmachining.sweep.candidates import Columns, columns

__all__ = ["SETS", "Crossed", "Heard", "Rays", "Told", "left"]

SETS = 16
"""Sets of rays: their mean is t-distributed with 15 degrees of freedom."""

COUNT = 6000
"""Rays of a set, about; more if there are more columns."""

FIRST, SHARP, FINER = 1, 2, 3
"""How many: `COUNT`; three times, mostly where the first ones differ; nine times, and six times more where they differ."""

ACROSS, EXTRA, TALL = (
    {SHARP: 1, FINER: 3},
    {SHARP: 2 * COUNT, FINER: 6 * COUNT},
    {SHARP: COUNT, FINER: 3 * COUNT},
)
"""Rays along a side of the place of one of the first ones, at least; how many more a set has along steps, about; and how many
where columns are tall, so that what may hide is alike in all of them."""

BESIDE = 0.5
"""Part of what the first ones differ by that is taken for what their neighbours miss: a wall may just touch their place."""

SUSPECT, BEYOND = 2.5, 6.0
"""Standard errors."""

HIDDEN = 14.0
"""Rays that a part of the columns would get, if all sets together miss it once in a million blocks: exp(-14) = 8e-7; once in
36,000 where it lies alike in both places of all pairs along x, or y: half of the sets count half then, exp(-10.5)."""

ROUND_REL, ROUND_MM = 1e-5, 1e-7
"""Of the volume, what B-spline faces are asked to be good to; of the columns, in height: joints of faces and rays."""

HOPE = 0.25
"""What is left of `Told.far` with the finer sets, about; 9 ** -0.75 = 0.19 where surfaces are smooth."""

HOPE_SHARP = 0.5
"""What is left of `Told.blur` and `Told.unseen` of sharp sets with the finer ones, about; 3 ** -0.75 = 0.44 along steps."""

THIN_REL, THIN_MM3 = 0.05, 1e-4
"""Of a value, and mm^3: how much may hide between rays that the caller wants sharp, or a value's own error if that is more. In
most blocks it is a tenth of a percent, and a skin of 5e-4 is missed once in 1000 of them then, exp(-14 / 2); but cells around
chips of 0.05 mm in long blocks are so much larger than these that 1 to 10 % may hide with the first rays."""


class Crossed(Protocol):
    """A sweep, or what is not stock."""

    @property
    def bounds(self) -> Floats:
        """(2, 3) mm: a box around it."""

    def ray_intervals(self, origins: Floats, directions: ArrayLike) -> RayIntervals:
        """Where lines are inside."""


class Told(NamedTuple):
    """What rays find. mm^3: volume, standard error, error of rounding, and how much may lie where no ray is."""

    volume: float
    spread: float
    rounding: float
    unseen: float

    @property
    def blur(self) -> float:
        """mm^3: a value that is less off than this is not suspect."""
        return SUSPECT * self.spread

    def is_sharp(self, sharp: float, thin: float) -> bool:
        """Whether they tell errors of `sharp` mm^3 apart, and no more than `thin` may hide between them."""
        return self.blur <= sharp and self.unseen <= thin

    @property
    def far(self) -> float:
        """mm^3: a right value is farther off once in 40,000 times."""
        return BEYOND * self.spread + self.rounding + self.unseen


class Heard(NamedTuple):
    """stands : whether rays allow a value. volume, far : mm^3, what they find and how far off a right one can be; inf: they
    tell nothing. is_clear : whether they are as sharp as the caller wants, and suspect nothing. alarm : that they contradict
    the bracket. interval : what they find, with how far off the truth can be; not proven."""

    stands: bool
    volume: float
    far: float
    is_clear: bool = False
    alarm: str = ""
    interval: Removal | None = None


NOTHING = Heard(True, 0.0, np.inf)


class _Places(NamedTuple):
    """Where a set has one ray each. low, side : (n, 2) mm. pair : (n, 4) number that neighbours share, flip : (n, 4) 0 or 1,
    which of them it is: along x or y, two ways each, in turns, as what lies alike in both of a pair is met by both or by none.
    tall : (n,) mm, height of what is there at most."""

    low: Floats
    side: Floats
    tall: Floats
    pair: Ints
    flip: Ints


class Rays:
    """Of one block.

    Parameters
    ----------
    takes : Sequence of (sweep, earlier ones that reach it, those that take most first)
    stock : Blank
    around : (2, 3) mm
        Box of the stock, used where the stock itself does not know its own.
    outside : Outside, optional
        Of a stock that is neither box nor cylinder.
    block : int
        Its number: rays of blocks that are alike stand elsewhere, so that what one of them misses the others find.
    """

    def __init__(
        self,
        takes: Sequence[tuple[Sweep, Sequence[Sweep]]],
        stock: Blank,
        around: Floats,
        outside: Outside | None = None,
        block: int = 0,
    ) -> None:
        self._takes, self._stock, self._outside = takes, stock, outside
        self._block = block
        self._box = around if stock.bounds is None else stock.bounds
        self._told: dict[int, Told] = {}
        self._differ: dict[int, tuple[_Places, Floats]] = {}
        self._took = 0.0

    def heard(
        self,
        value: float,
        error: float,
        bracket: Bracket,
        want: float = np.inf,
        sharp: float = np.inf,
        seconds: float = np.inf,
    ) -> Heard:
        """What rays say of a value with an own error, mm^3.

        want : mm^3, `far` that the caller could use; more rays are asked if these can be expected to tell as much.
        sharp : mm^3, an error that matters to the caller; more rays are asked until these tell it.
        seconds : of a processor, that more rays may take.
        """
        if not self._can_tell:
            return NOTHING
        begin, rank = process_time(), max(self._told, default=FIRST)
        told = self.told(rank)
        thin = max(THIN_REL * value, error, THIN_MM3) if sharp < np.inf else np.inf

        def is_short(rank: int) -> bool:
            return self._expected(rank) <= seconds - (process_time() - begin)

        def is_suspect(told: Told) -> bool:
            return bool(abs(value - told.volume) > error + told.blur + told.rounding)

        if rank == FIRST and not told.is_sharp(sharp, thin) and is_short(SHARP):
            rank, told = SHARP, self.told(SHARP)
        is_hoped = want < told.far <= want / HOPE
        is_hoped |= not told.is_sharp(sharp, thin) and told.is_sharp(sharp / HOPE_SHARP, thin / HOPE_SHARP)
        if rank < FINER and (is_suspect(told) or is_hoped) and is_short(FINER):
            told = self.told(FINER)
        interval = Removal(
            max(0.0, told.volume - told.far), told.volume, told.volume + told.far, proven=False
        )
        if told.volume + told.far < bracket.lo or told.volume - told.far > bracket.hi:
            alarm = (
                f"rays find {told.volume:.6g} +- {told.far:.2g} mm3, "
                f"outside of [{bracket.lo:.6g}, {bracket.hi:.6g}]: one of both is wrong"
            )
            return NOTHING._replace(alarm=alarm, interval=interval)
        stands = bool(abs(value - told.volume) <= error + told.far)
        is_clear = told.is_sharp(sharp, thin) and not is_suspect(told)
        return Heard(stands, told.volume, told.far, is_clear, interval=interval)

    def told(self, rank: int) -> Told:
        """By that many rays."""
        if rank not in self._told:
            found = self._columns
            if rank != FIRST:
                self.told(FIRST)
            begin = process_time()
            each = [self._shot(number, parts, rank) for number, parts in enumerate(found) if len(parts.low)]
            volume, spread, rounding, unseen = np.array(each, dtype=np.float64).reshape(-1, 4).T
            self._told[rank] = Told(
                float(volume.sum()), float(np.linalg.norm(spread)), float(rounding.sum()), float(unseen.sum())
            )
            if rank == FIRST:
                self._took = process_time() - begin
        return self._told[rank]

    @cached_property
    def _boxes(self) -> list[Floats]:
        """Of what every sweep can meet of the stock."""
        lo, hi = self._box
        bounds = (sweep.bounds for sweep, _ in self._takes)
        return [np.stack([np.maximum(low, lo), np.minimum(high, hi)]) for low, high in bounds]

    @cached_property
    def _can_tell(self) -> bool:
        if self._outside is None:
            return self._stock.bounds is not None
        return all(self._outside.is_exact(box) for box in self._boxes if (box[0] < box[1]).all())

    @cached_property
    def _columns(self) -> list[Columns]:
        nothing = Columns(np.zeros((0, 2)), np.zeros(2), np.zeros(0))
        return [
            columns(sweep, earlier, box, COUNT) if (box[0] < box[1]).all() else nothing
            for (sweep, earlier), box in zip(self._takes, self._boxes, strict=True)
        ]

    def _expected(self, rank: int) -> float:
        """s of a processor that rays will take."""
        few = sum(len(places.low) for places, _ in self._differ.values())
        many = sum(int((_across(*first, rank) ** 2).sum()) for first in self._differ.values())
        return self._took * many / max(few, 1)

    def _places(self, number: int, parts: Columns, rank: int) -> _Places:
        if rank == FIRST:
            across = max(1, round(sqrt(COUNT / len(parts.low))))
            return _divided(parts.low, parts.side, parts.tall, np.full(len(parts.low), across))
        first, differ = self._differ[number]
        return _divided(first.low, first.side[0], first.tall, _across(first, differ, rank))

    def _shot(self, number: int, parts: Columns, rank: int) -> Told:
        sweep, before = self._takes[number]
        earlier: list[Crossed] = [*before] if self._outside is None else [*before, self._outside]
        rng = np.random.default_rng([self._block, number, rank])
        cells = self._places(number, parts, rank)
        area = cells.side.prod(axis=1)
        bottom, top = self._box[:, 2].tolist()
        found = np.zeros((SETS, len(area)))
        for turn, mine in enumerate(found):
            pair, flip = cells.pair[:, turn % 4], cells.flip[:, turn % 4, None]
            shift = np.abs(flip - rng.random((int(pair.max()) + 1, 2))[pair])
            places, stands = cells.low + shift * cells.side, np.ones(len(area), dtype=bool)
            if self._stock.kind == "cylinder":
                stands = np.linalg.norm(places - self._stock.center, axis=1) < self._stock.radius
            mine[stands] = left(sweep, earlier, places[stands], bottom, top)
        if rank == FIRST:
            self._differ[number] = cells, _spread_out(cells, found.std(axis=0))
        sums = found @ area
        volume = float(sums.mean())
        return Told(
            volume,
            float(sums.std(ddof=1)) / np.sqrt(SETS),
            ROUND_REL * volume + ROUND_MM * float(area.sum()),
            HIDDEN * float((area * cells.tall).max()) / SETS,
        )


def _spread_out(cells: _Places, differ: Floats) -> Floats:
    """(n,) mm by which places of equal size differ, or `BESIDE` of what one of their eight neighbours does."""
    place = np.rint((cells.low - cells.low.min(axis=0)) / cells.side).astype(np.int64) + 1
    wide = int(place[:, 1].max()) + 2
    key = place @ [wide, 1]
    order = np.argsort(key)
    out = differ.copy()
    for step in (x * wide + y for x in (-1, 0, 1) for y in (-1, 0, 1)):
        other = order[np.minimum(np.searchsorted(key, key + step, sorter=order), len(key) - 1)]
        hit = key[other] == key + step
        out[hit] = np.maximum(out[hit], BESIDE * differ[other[hit]])
    return out


def _across(first: _Places, differ: Floats, rank: int) -> Ints:
    """(n,) rays along a side of the places of the first ones, by how much these differ there, and how tall their columns are."""
    across = np.full(len(differ), float(ACROSS[rank]))
    for count, share in ((EXTRA[rank], differ), (TALL[rank], first.tall)):
        across = np.maximum(across, np.rint(np.sqrt(count * share / max(float(share.sum()), 1e-300))))
    return across.astype(np.int64)


def _divided(low: Floats, side: Floats, tall: Floats, across: Ints) -> _Places:
    """Equal cells at (n, 2) corners of a raster, each in across^2 parts."""
    found, count = [], 0
    for times in np.unique(across).tolist():
        cell = side / times
        part = np.stack(np.meshgrid(np.arange(times), np.arange(times), indexing="ij"), axis=-1).reshape(
            -1, 2
        )
        lows = (low[across == times, None] + part * cell).reshape(-1, 2)
        place = np.rint((lows - low.min(axis=0)) / cell).astype(np.int64)
        wide = int(place[:, 1].max()) + 2
        pairs, flips = list[Ints](), list[Ints]()
        for along in np.array([[1, 0], [1, 0], [0, 1], [0, 1]]):
            mine = place + len(flips) % 2 * along
            flips.append(mine @ along % 2)
            first = mine - flips[-1][:, None] * along
            pairs.append(np.unique(first @ [wide, 1], return_inverse=True)[1])
        pair, flip = np.column_stack(pairs), np.column_stack(flips)
        high = np.repeat(tall[across == times], times * times)
        found.append(_Places(lows, np.tile(cell, (len(lows), 1)), high, count + pair, flip))
        count += int(pair.max()) + 1
    return _Places(*(np.concatenate(column) for column in zip(*found, strict=True)))


def left(sweep: Sweep, earlier: Sequence[Crossed], places: Floats, bottom: float, top: float) -> Floats:
    """(n,) mm of upright rays at (n, 2) places in the sweep and the stock, and in no earlier sweep.

    earlier : those that take most first; what is left of a ray lies between two heights that come closer with each, and once they
    meet no other one is asked.
    """
    own = _crossed(sweep, places, np.arange(len(places)))
    lo, hi = np.full(len(places), top), np.full(len(places), bottom)
    np.minimum.at(lo, own.ray, own.enter)
    np.maximum.at(hi, own.ray, own.leave)
    lo, hi = np.maximum(lo, bottom), np.minimum(hi, top)
    others = []
    for body in earlier:
        low, high = body.bounds
        asked = (lo < hi) & (lo < high[2]) & (hi > low[2])
        asked &= ((places > low[:2]) & (places < high[:2])).all(axis=1)
        others.append(_crossed(body, places, np.flatnonzero(asked)))
        ray, enter, leave = others[-1]
        under, over = enter <= lo[ray], leave >= hi[ray]
        np.maximum.at(lo, ray[under], leave[under])
        np.minimum.at(hi, ray[over], enter[over])
    rays, stops, inner, outer = [], [], [], []
    for number, (ray, enter, leave) in enumerate((own, *others)):
        open_ = (lo < hi)[ray]
        ray = ray[open_]
        low, high = lo[ray], hi[ray]
        rays.append(np.tile(ray, 2))
        stops.append(np.concatenate([np.clip(enter[open_], low, high), np.clip(leave[open_], low, high)]))
        step = np.repeat([1, -1], len(ray))
        inner.append(step if number == 0 else 0 * step)
        outer.append(0 * step if number == 0 else step)
    ray, stop, a, b = (np.concatenate(column) for column in (rays, stops, inner, outer))
    order = np.lexsort([stop, ray])
    ray, stop, a, b = ray[order], stop[order], np.cumsum(a[order]), np.cumsum(b[order])
    same = ray[1:] == ray[:-1]
    length = np.diff(stop) * (same & (a[:-1] > 0) & (b[:-1] == 0))
    return np.bincount(ray[:-1], length, minlength=len(places)).astype(np.float64)


class _Parts(NamedTuple):
    """Where rays are inside a body: which ray, and from where to where, mm."""

    ray: Ints
    enter: Floats
    leave: Floats


def _crossed(body: Crossed, places: Floats, which: Ints) -> _Parts:
    origins = np.column_stack([places[which], np.zeros(len(which))])
    inside = body.ray_intervals(origins, (0.0, 0.0, 1.0))
    return _Parts(np.repeat(which, inside.counts), inside.enter, inside.leave)
