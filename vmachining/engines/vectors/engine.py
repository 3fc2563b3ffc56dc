"""`VectorEngine`: what every engine answers, and the deviation from the part that is wanted."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from math import cos, degrees, radians
from pathlib import Path
from typing import Self

import numpy as np

from vmachining.arrays import Bools
from vmachining.engines.pickled import load_values, save_values
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
from vmachining.errors import EngineError, StockError
from vmachining.geometry import Bracket
from vmachining.stock import MeshStock, Stock
from vmachining.sweep import Sweep
from vmachining.sweep.ball import ball_block

__all__ = ["VectorEngine"]

WALL_RAD = radians(75.0)
"""theta_V where neither it nor gamma is given: gamma is then about a quarter of delta."""

ACROSS = 400
"""Spacings along the longer side of the part where no length is given."""

OVERLAP, UNIT_SHARE = 0.5, 0.1
"""Part of the design's box that must lie in that of the stock, and size of a design, relative to its stock, below which
one of them is taken for a file in another unit."""

OWN = (
    "vmachining.engines.settings", "vmachining.engines.protocol", "vmachining.engines.vectors",
    "array._array_reconstructor", "array.array",
)  # fmt: skip
"""What a checkpoint holds beside geometry."""


class VectorEngine(Summed):
    """Discrete vectors between a part and its workpiece.

    Parameters
    ----------
    stock : Stock
    options : `design` is the part; `vectors` how dense. Without a design nothing can be measured: StockError.
    """

    name = "vectors"
    proof = "upright vectors: neighbouring cells bound what lies between them, not proven"

    def __init__(self, stock: Stock, options: Options) -> None:
        if options.design is None:
            raise StockError(
                "the vectors engine measures against a design, and the job has none",
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
        facets = None if settings.envelope == "exact" else self.chord
        self.upright = UprightVectors(self.part, stock, self.pitch, casting=settings.casting, facets=facets)
        self.along = NormalVectors(patches, self.spacing, facets=facets)
        self.along.lay(
            self.part, stock, allowance=settings.allowance or settings.depth, depth=settings.depth,
            chord=self.chord, casting=settings.casting,
        )  # fmt: skip
        self._cuts = Cuts()
        self._removed = NOTHING
        if settings.casting is not None:
            whole = self.upright.material
            self.stock_volume = Bracket(whole, whole, whole)
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
        closed = [None if self.settings.envelope == "facets" else ball_block(r.sweep) for r in requests]
        for is_ball, run in groupby(zip(requests, closed, strict=True), key=lambda pair: pair[1] is not None):
            pairs = list(run)
            if is_ball:
                balls = np.array([ball.row for _, ball in pairs if ball is not None])
                writes = np.array([r.cuts for r, _ in pairs])
                found += self.upright.cut_balls(balls, writes)
                self.along.cut_balls(balls[writes], [r.sweep for r, _ in pairs if r.cuts])
                continue
            for r, _ in pairs:
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
        """Slope from which on a facet is a wall, degrees."""
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

    def save(self, path: Path) -> None:
        """See `Engine`."""
        save_values(path, self.__dict__)

    @classmethod
    def load(cls, path: Path) -> Self:
        """See `Engine`.

        Raises
        ------
        EngineError
            The file cannot be read, is damaged, or holds anything but geometry.
        """
        engine = object.__new__(cls)
        try:
            engine.__dict__.update(load_values(path, cls.name, OWN))
        except EngineError:
            raise
        except Exception as exc:  # bytes that are no checkpoint can raise anything
            raise EngineError(f"cannot read the checkpoint {path} ({exc})", engine=cls.name) from exc
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

    Raises
    ------
    StockError
        Less than half of the design's box is in that of the stock, or their sizes tell of two units.
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
