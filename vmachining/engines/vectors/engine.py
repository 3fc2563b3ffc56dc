"""`VectorEngine`: what every engine answers, and the deviation from the part as designed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from math import cos, degrees, radians
from pathlib import Path
from typing import Any, Self

import numpy as np

from vmachining.arrays import Bools
from vmachining.checkpoint import Saved, opened
from vmachining.engines.packed import packed_stock, stock_of
from vmachining.engines.protocol import NOTHING, Options, Removal, Request, StockSurface
from vmachining.engines.settings import VectorSettings
from vmachining.engines.summed import Summed, meshed_volume
from vmachining.engines.vectors.accuracy import wall_angle
from vmachining.engines.vectors.along import NormalVectors, Patches
from vmachining.engines.vectors.budget import refuse_too_many
from vmachining.engines.vectors.cuts import Cuts
from vmachining.engines.vectors.deviation import MOST_ROWS, Deviation, measured
from vmachining.engines.vectors.part import DesignPart, features
from vmachining.engines.vectors.surface import prisms
from vmachining.engines.vectors.upright import UprightVectors
from vmachining.errors import StockError
from vmachining.interval import Interval
from vmachining.stock import MeshStock, Stock
from vmachining.sweep import Sweep
from vmachining.sweep.ball import ball_block

WALL_RAD = radians(75.0)
"""theta_V where neither it nor gamma is given: gamma is then about a quarter of delta."""

ACROSS = 400
"""Spacings along the longer side of the part where no length is given."""

OVERLAP, UNIT_SHARE = 0.5, 0.1
"""Part of the design's box that must lie in that of the stock, and size of a design, relative to its stock, below which
one of them is taken for a file in another unit."""


class VectorEngine(Summed):
    """Discrete vectors between a part and its workpiece.

    stock : Stock
    options : `design` is the part; `vectors` how dense. Without a design nothing can be measured: StockError.
    """

    name = "vectors"
    proof = "upright vectors: neighbouring cells bound what lies between them, not proven"

    def __init__(self, stock: Stock, options: Options) -> None:
        if options.design is None:
            raise StockError(
                "the vectors engine measures against a design, but the job has no design",
                remedy='add [design] with step = "..." or stl = "..."',
            )
        _refuse_elsewhere(options.design, stock)
        self.chord = options.chord
        self.settings = settings = options.vectors or VectorSettings()
        self.part, self._stock = DesignPart(options.design), stock
        self.pitch, self.spacing, self.theta_v = _densities(settings, self.part)
        found = features(self.part, self.theta_v, settings.theta_sharp)
        every = settings.mode == "dnv"
        self.covered: Bools = np.zeros(len(self.part.corners), dtype=np.bool_)
        if settings.mode != "dvv":
            self.covered = found.wall | found.overhang
        if every:
            self.covered = self.covered | (self.part.slopes <= self.theta_v)
        patches = Patches.of(self.part, self.covered, found, edges=settings.mode != "dvv")
        refuse_too_many(self, patches)
        self.upright = UprightVectors(self.part, stock, self.pitch, casting=settings.casting)
        self.along = NormalVectors(patches, self.spacing)
        self.along.lay(
            self.part, stock, allowance=settings.allowance or settings.depth, depth=settings.depth,
            chord=self.chord, casting=settings.casting,
        )  # fmt: skip
        self._cuts = Cuts()
        self._removed = NOTHING
        if settings.casting is not None:
            whole = self.upright.material
            self.stock_volume = Interval(whole, whole, whole)
        else:
            self.stock_volume = meshed_volume(stock, self.chord)

    def cut(self, sweep: Sweep, block: int | None = None) -> Removal:
        """See `Engine`."""
        return self.answer([Request(sweep, block)])[0]

    def touch(self, sweep: Sweep, within: float | None = None) -> Removal:
        """See `Engine`."""
        return self.answer([Request(sweep, cuts=False)])[0]

    def answer(self, requests: Sequence[Request]) -> list[Removal]:
        """See `Batched`: blocks of ball cutters on lines that follow each other are one call of a kernel."""
        found: list[Removal] = []
        closed = [ball_block(r.sweep) for r in requests]
        while len(found) < len(requests):
            first = stop = len(found)
            while stop < len(requests) and closed[stop] and not self.upright.is_blind(requests[stop].sweep):
                stop += 1
            if run := requests[first:stop]:
                balls = np.array([ball.row for ball in closed[first:stop] if ball is not None])
                writes = np.array([r.cuts for r in run])
                found += self.upright.cut_balls(balls, writes)
                self.along.cut_balls(balls[writes], [r.sweep for r in run if r.cuts])
                continue
            r = requests[first]
            found.append(self.upright.cut(r.sweep) if r.cuts else self.upright.touch(r.sweep))
            if r.cuts:
                self.along.cut(r.sweep)
        for r, ball, removed in zip(requests, closed, found, strict=True):
            if r.cuts:
                self._cuts.add(r.sweep, ball, r.block)
                self._removed = self._removed.plus(removed)
        return found

    @property
    def theta_v_deg(self) -> float:
        """Slope above which a facet is a wall, degrees."""
        return degrees(self.theta_v)

    def deviation(self, tolerance: float, *, outside_only: bool = True, most: int = MOST_ROWS) -> Deviation:
        """What is left and what is taken too much, see `measured`. tolerance: mm."""
        return measured(
            self.part, None if self.settings.mode == "dnv" else self.upright, self.along, self.covered, self._cuts, tolerance,
            outside_only=outside_only, most=most,
        )  # fmt: skip

    def surface(self) -> StockSurface:
        """See `Engine`: upright prisms, for pictures."""
        return prisms(self.upright, self._cuts)

    @property
    def _lengths(self) -> dict[str, Any]:
        """What cuts change, by its name in a file."""
        lattice, upright = self.along.lattice, self.upright.lengths
        along = {"along": lattice.length, "along_behind": lattice.behind, "along_reach": lattice.reach}
        return {"upright": upright} | along

    def save(self, path: Path) -> None:
        """See `Engine`: part, stock and settings, of which all vectors follow, and their lengths now."""
        stock, stock_arrays = packed_stock(self._stock)
        design, design_arrays = packed_stock(self.part.mesh)
        state = {
            "stock": stock, "design": design, "settings": asdict(self.settings), "chord": self.chord,
            "behind": self.upright.behind, "removed": list(self._removed), "cuts": {"others": self._cuts.others},
        }  # fmt: skip
        arrays = self._lengths | {"roofed": self.upright.roofed}
        parts = {"stock": stock_arrays, "design": design_arrays, "cuts": self._cuts.packed()}
        for name, part in parts.items():
            arrays |= Saved(name, {}, part).nested(name)
        Saved(self.name, state, arrays).write(path)

    @classmethod
    def load(cls, path: Path) -> Self:
        """See `Engine`.

        Raises EngineError: The file cannot be read or is damaged.
        """
        with opened(path, cls.name) as saved:
            state, arrays = saved.state, saved.arrays
            design = stock_of(state["design"], saved.part("design", cls.name).arrays)
            if not isinstance(design, MeshStock):
                raise ValueError("its design is not a mesh")
            settings = VectorSettings(**state["settings"])
            stock = stock_of(state["stock"], saved.part("stock", cls.name).arrays)
            engine = cls(stock, Options(chord=state["chord"], design=design, vectors=settings))
            for name, own in engine._lengths.items():
                if arrays[name].shape != own.shape:
                    raise ValueError(f"it has {arrays[name].shape} {name} vectors, the part has {own.shape}")
                own[:] = arrays[name]
            engine._cuts = Cuts.unpacked(saved.part("cuts", cls.name).arrays, state["cuts"]["others"])
            engine.upright.roofed = arrays["roofed"].reshape(-1, 2, 2)
            engine.upright.behind, engine._removed = int(state["behind"]), Removal(*state["removed"])
        return engine


def _densities(settings: VectorSettings, part: DesignPart) -> tuple[float, float, float]:
    """gamma, delta (mm) and theta_V (rad); what is not given follows by (4-4) and (4-5)."""
    pitch, spacing, theta = settings.pitch, settings.spacing, settings.theta_v
    if pitch is not None and spacing is not None:
        return pitch, spacing, wall_angle(pitch, spacing) if theta is None else theta
    theta = WALL_RAD if theta is None else theta
    if spacing is None:
        wide = float(np.ptp(part.bounds, axis=0).max())
        spacing = wide / ACROSS if pitch is None else pitch / cos(theta)
    return spacing * cos(theta) if pitch is None else pitch, spacing, theta


def _refuse_elsewhere(design: MeshStock, stock: Stock) -> None:
    """A design and a stock that cannot belong together.

    Raises StockError: Less than half of the design's box is in that of the stock, or their sizes tell of two units.
    """
    (a, b), (lo, hi) = design.bounds, stock.bounds
    size, room = b - a, hi - lo
    places = [f"from {p.round(3).tolist()} to {q.round(3).tolist()} mm" for p, q in ((a, b), (lo, hi))]
    shown = f"the design lies {places[0]}, the stock {places[1]}"
    ratio = float(size.max() / room.max())
    if not UNIT_SHARE <= ratio <= 1.0 / UNIT_SHARE:
        raise StockError(
            f"design and stock differ in size by a factor of {max(ratio, 1.0 / ratio):.3g}: {shown}",
            remedy="is one of them in inches? a STEP file carries its unit, an STL file is read in the units of the job",
        )
    shared = np.clip(np.minimum(b, hi) - np.maximum(a, lo), 0.0, None) / size
    if float(shared.prod()) < OVERLAP:
        raise StockError(
            f"only {100.0 * float(shared.prod()):.0f} % of the design's box is in the stock: {shown}",
            remedy="compare their origins",
        )
