"""`DexelEngine`: what every engine answers, by a grid of rays that are cut."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise, takewhile
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from vmachining.arrays import Floats, Ints, rows
from vmachining.checkpoint import Saved, opened
from vmachining.engines.dexel.around import stadium
from vmachining.engines.dexel.batch import cut_lines, looks_of, round_end, takes_line
from vmachining.engines.dexel.batch.level import cut_sides, takes_side
from vmachining.engines.dexel.budget import default_spacing, refuse_too_fine
from vmachining.engines.dexel.grid import Look, RayGrid
from vmachining.engines.dexel.lattice import Lattice, Lists
from vmachining.engines.dexel.surface import triangles
from vmachining.engines.packed import bracket_of, packed_bracket
from vmachining.engines.protocol import NOTHING, Options, Removal, Request, StockSurface
from vmachining.engines.summed import Summed, meshed_volume
from vmachining.errors import InputError
from vmachining.interval import Interval
from vmachining.stock import Stock
from vmachining.sweep import Sweep
from vmachining.sweep.ball import ball_block
from vmachining.sweep.reach import meets, reaching
from vmachining.tool import Cutter, Profile

CONFIDENCE = 0.99
"""Of the interval of a block, as tested: at least so many of random blocks hold their closed forms."""

AXES = {1: (2,), 3: (2, 0, 1)}
"""Directions of rays by their number."""


class DexelEngine(Summed):
    """Workpiece of one job as rays in one direction (along z) or three.

    stock : Stock
    options : `spacing` of rays, mm (None: about half a million of them), and `directions`.
    """

    name = "dexel"

    def __init__(self, stock: Stock, options: Options | None = None) -> None:
        options = options or Options()
        if options.directions not in AXES:
            raise InputError(f"directions = {options.directions}", remedy="1 (along z) or 3")
        axes = AXES[options.directions]
        self._box: Floats = np.array(stock.bounds)
        self.spacing = default_spacing(self._box, axes) if options.spacing is None else options.spacing
        refuse_too_fine(self._box, axes, self.spacing)
        self.chord = options.chord
        self.grids = [RayGrid.of(stock, axis, self.spacing) for axis in axes]
        self._removed = NOTHING
        self.stock_volume = meshed_volume(stock, self.chord)

    @property
    def proof(self) -> str:
        """See `Engine`."""
        return (
            f"rays in {len(self.grids)} direction{'s' * (len(self.grids) > 1)} at {self.spacing:.3g} mm: intervals of "
            f"confidence {CONFIDENCE:g} per block, not proven"
        )

    def cut(self, sweep: Sweep, block: int | None = None) -> Removal:
        """See `Engine`."""
        found = self._removal(sweep, -1 if block is None else block, cut=True)
        self._removed = self._removed.plus(found)
        return found

    def touch(self, sweep: Sweep, within: float | None = None) -> Removal:
        """See `Engine`."""
        return self._removal(sweep, -1, cut=False)

    def _removal(self, sweep: Sweep, block: int, *, cut: bool) -> Removal:
        short = reaching(sweep, self._box)
        if not meets(short, self._box):
            return NOTHING
        around = stadium(short, 1.5 * self.spacing)
        return agreed([grid.removed(short, around, block, cut=cut) for grid in self.grids])

    def answer(self, requests: Sequence[Request]) -> list[Removal]:
        """See `Batched`: directions one after the other, in each as many blocks at once as one kernel call takes."""
        live = [k for k, request in enumerate(requests) if meets(request.sweep, self._box)]
        looks: dict[int, list[Look]] = {k: [] for k in live}
        known: dict[int, tuple[Sweep, Floats]] = {}

        def alone(grid: RayGrid, k: int) -> Look:
            if k not in known:
                short = reaching(requests[k].sweep, self._box)
                known[k] = short, stadium(short, 1.5 * self.spacing)
            block = requests[k].block
            return grid.removed(*known[k], -1 if block is None else block, cut=requests[k].cuts)

        for grid in self.grids:
            at = 0
            while at < len(live):
                group = self._alike(grid, requests, live, at)
                found = self._together(grid, [requests[k] for k in group])
                if found is None:
                    group = group or live[at : at + 1]
                    found = [alone(grid, k) for k in group]
                for k, each in zip(group, found, strict=True):
                    looks[k].append(each)
                at += len(group)
        out = [agreed(looks[k]) if k in looks else NOTHING for k in range(len(requests))]
        for request, removal in zip(requests, out, strict=True):
            if request.cuts:
                self._removed = self._removed.plus(removal)
        return out

    def _alike(self, grid: RayGrid, requests: Sequence[Request], live: Sequence[int], at: int) -> list[int]:
        """Numbers of the requests from `live[at]` on that one kernel call takes: cuts of one cutter along lines."""
        top, upright = float(self._box[1, 2]), grid.lattice.axis == 2

        def fits(k: int) -> bool:
            sweep = requests[k].sweep
            if not requests[k].cuts or sweep.profile is not requests[live[at]].sweep.profile:
                return False
            return takes_line(sweep, top) is not None if upright else takes_side(sweep)

        return list(takewhile(fits, live[at:]))

    def _together(self, grid: RayGrid, requests: Sequence[Request]) -> list[Look] | None:
        """What some requests that are alike take; None where none exist, or where rays have several intervals."""
        if not requests:
            return None
        ends = np.array([[r.sweep.path.start, r.sweep.path.end] for r in requests])
        blocks = np.array([-1 if r.block is None else r.block for r in requests])
        start, end = np.ascontiguousarray(ends[:, 0]), np.ascontiguousarray(ends[:, 1])
        first = requests[0].sweep
        shape = round_end(first.profile) if grid.lattice.axis == 2 else None
        if shape is None:
            return cut_sides(grid, first, start, end, blocks)
        sums = cut_lines(grid, shape, start, end, blocks)
        return None if sums is None else looks_of(grid, shape, start, end, sums)

    def cut_path(self, tool: Cutter | Profile, points: ArrayLike, first: int = 0) -> list[Removal]:
        """Cut a polyline, points (n + 1, 3) mm of the tip, as n blocks with numbers from `first`; see `answer`.

        One kernel call a direction for tall ball, flat and bull nose cutters in a stock without undercuts, on level lines or,
        of a ball, on any.
        """
        tips = rows(points, -1, 3, name="points")
        profile = tool.profile if isinstance(tool, Cutter) else tool
        if len(tips) < 2:
            return []
        start, end = tips[:-1].copy(), tips[1:].copy()
        ramps = (start[:, 2] != end[:, 2]) & (start[:, :2] != end[:, :2]).any(axis=1)
        across = (start[:, :2] != end[:, :2]).any(axis=1)
        level = bool(((start[:, 2] == end[:, 2]) & across).all())
        shape, probe = round_end(profile), Sweep(profile, start[0], end[0])
        upright = shape is not None and float(tips[:, 2].min()) + shape.top >= self._box[1, 2]
        upright = upright and not (shape is not None and shape.r1 > 0.0 < shape.rc and ramps.any())
        sides = len(self.grids) == 1 or level or ball_block(probe) is not None
        blocks = first + np.arange(len(start))
        if shape is not None and upright and sides:
            sums = cut_lines(self.grids[0], shape, start, end, blocks)
            if sums is not None:
                looks = [looks_of(self.grids[0], shape, start, end, sums)]
                looks += [cut_sides(grid, probe, start, end, blocks) for grid in self.grids[1:]]
                out = [agreed(each) for each in zip(*looks, strict=True)]
                self._removed = self._removed.plus(*out)
                return out
        return self.answer(
            [Request(Sweep(profile, a, b), first + k) for k, (a, b) in enumerate(pairwise(tips))]
        )

    @property
    def volume(self) -> Interval:
        """mm^3: the estimate is the sum over all blocks, the interval that of all of them as one block."""
        whole, gone = self.stock_volume, self._removed
        once = agreed([grid.gone() for grid in self.grids])
        lo = max(0.0, whole.lo - min(gone.hi, max(once.hi, gone.estimate)))
        hi = whole.hi - max(gone.lo, min(once.lo, gone.estimate))
        return Interval(lo, whole.estimate - gone.estimate, hi, whole.proven and gone.proven)

    def ends(self) -> tuple[Floats, Ints, Ints]:
        """Points (n, 3) mm of the workpiece's surface where rays end, block (n,) that made each (-1 raw stock), axis (n,)."""
        parts = [grid.ends() for grid in self.grids]
        points, blocks = (np.concatenate(column) for column in zip(*parts, strict=True))
        axes = np.repeat([grid.lattice.axis for grid in self.grids], [len(part[1]) for part in parts])
        return points, blocks, axes

    def surface(self) -> StockSurface:
        """See `Engine`: closed triangles through the ends of rays."""
        return triangles(self.grids, self._box)

    def save(self, path: Path) -> None:
        """See `Engine`."""
        state = {
            "spacing": self.spacing, "chord": self.chord, "removed": list(self._removed[:4]),
            "stock_volume": packed_bracket(self.stock_volume),
            "lattices": [list(grid.lattice[:7]) for grid in self.grids],
        }  # fmt: skip
        arrays: dict[str, Any] = {"box": self._box}
        for k, grid in enumerate(self.grids):
            used = int(grid.lists.used[0])
            for name, values in grid.lists._asdict().items():
                arrays[f"{name}{k}"] = values[:used] if name in ("low", "high", "below", "above") else values
            arrays |= {f"sa{k}": grid.lattice.sa, f"sb{k}": grid.lattice.sb, f"raw{k}": grid.raw}
        Saved(self.name, state, arrays).write(path)

    @classmethod
    def load(cls, path: Path) -> Self:
        """See `Engine`.

        Raises EngineError: The file cannot be read or is damaged.
        """
        engine = object.__new__(cls)
        with opened(path, cls.name) as saved:
            state, found = saved.state, saved.arrays
            engine.spacing, engine.chord = float(state["spacing"]), float(state["chord"])
            engine._box, engine.stock_volume = found["box"], bracket_of(state["stock_volume"])
            engine._removed = Removal(*state["removed"])
            engine.grids = []
            for k, row in enumerate(state["lattices"]):
                axis, a0, b0, ha, hb, na, nb = row
                lat = Lattice(axis, a0, b0, ha, hb, na, nb, found[f"sa{k}"], found[f"sb{k}"])
                lists = Lists(*(found[f"{name}{k}"] for name in Lists._fields))
                engine.grids.append(RayGrid(lat, lists, engine._box, found[f"raw{k}"]))
        return engine


def agreed(looks: Sequence[Look]) -> Removal:
    """One interval of those of all directions: what they share, and where they share nothing all that they say.

    Rays of each direction stand at their own places, so errors of directions are independent and none of them leans to a
    side: the mean with weights 1 / half^2 is known to (sum of 1 / half^2)^(-1/2), and what is shared is cut to that.
    The estimate is their mean by their weights, or the end of the interval that it lies beyond.
    """
    lo = max(0.0, max(each.volume - each.half for each in looks))
    hi = min(each.volume + each.half for each in looks)
    if lo > hi:
        lo = max(0.0, min(each.volume - each.half for each in looks))
        hi = max(each.volume + each.half for each in looks)
    elif all(each.half > 0.0 for each in looks):
        known = sum(each.half**-2 for each in looks)
        middle, half = sum(each.volume * each.half**-2 for each in looks) / known, known**-0.5
        if max(lo, middle - half) <= min(hi, middle + half):
            lo, hi = max(lo, middle - half), min(hi, middle + half)
    whole = sum(each.weight for each in looks)
    mean = sum(each.weight * each.volume for each in looks) / whole if whole > 0.0 else 0.0
    return Removal(lo, min(max(mean, lo), hi), hi, proven=False)
