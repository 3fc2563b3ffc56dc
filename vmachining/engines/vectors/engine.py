"""`VectorEngine`: what every engine answers, and the deviation from the part that is wanted."""

from __future__ import annotations

import io
import pickle
from math import cos, degrees, radians
from pathlib import Path
from typing import Any, Self

import numpy as np

from vmachining.arrays import Bools, Ints
from vmachining.engines.protocol import NOTHING, Options, Removal, StockSurface
from vmachining.engines.settings import VectorSettings
from vmachining.engines.vectors.accuracy import wall_angle
from vmachining.engines.vectors.along import NormalVectors, normal_lengths
from vmachining.engines.vectors.budget import refuse_too_many
from vmachining.engines.vectors.deviation import MOST_ROWS, Deviation, measured
from vmachining.engines.vectors.part import DesignPart, Points, features, points_along, points_on
from vmachining.engines.vectors.surface import prisms
from vmachining.engines.vectors.upright import UprightVectors
from vmachining.errors import EngineError, StockError
from vmachining.geometry import Bracket
from vmachining.stock import MeshStock, Stock
from vmachining.sweep import Sweep

__all__ = ["VectorEngine"]

WALL_RAD = radians(75.0)
"""theta_V where neither it nor gamma is given: gamma is then about a quarter of delta."""

ACROSS = 400
"""Spacings along the longer side of the part where no length is given."""

OVERLAP, UNIT_SHARE = 0.5, 0.1
"""Part of the design's box that must lie in that of the stock, and size of a design, relative to its stock, below which
one of them is taken for a file in another unit."""

GEOMETRY = (
    "vmachining.stock",
    "vmachining.sweep",
    "vmachining.geometry",
    "vmachining.tool",
    "vmachining.numerics",
)
OWN = ("vmachining.engines.settings", "vmachining.engines.protocol", "vmachining.engines.vectors")
NUMPY = ("_reconstruct", "ndarray", "dtype", "scalar", "_frombuffer")


class VectorEngine:
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
        edges = settings.mode != "dvv"
        refuse_too_many(self, found)
        facets = None if settings.envelope == "exact" else self.chord
        self.upright = UprightVectors(self.part, stock, self.pitch, casting=settings.casting, facets=facets)
        on = points_on(self.part, self.covered, self.spacing)
        kind = np.where(found.wall[on.facet], 1, np.where(found.overhang[on.facet], 2, 4))
        if edges:
            line = points_along(found.edge, found.edge_normal, self.spacing)
            on = Points(*(np.concatenate(pair) for pair in zip(on, line, strict=True)))
            kind = np.concatenate([kind, np.full(len(line.point), 3)])
        if settings.casting is not None:
            low = -np.minimum(
                self.part.leave(on.point, np.ascontiguousarray(-on.normal), settings.depth), settings.depth
            )
            length = np.full(len(low), settings.casting)
        else:
            low, length = normal_lengths(
                self.part,
                stock,
                on,
                allowance=settings.allowance or settings.depth,
                depth=settings.depth,
                chord=self.chord,
            )
        self.along = NormalVectors(on, low, length, facets=facets)
        self.kinds: Ints = kind[self.along.order]
        self._sweeps, self._blocks = list[Sweep](), list[int]()
        self._removed = NOTHING
        if settings.casting is not None:
            whole = self._material()
            self.stock_volume = Bracket(whole, whole, whole)
        else:
            outer, inner = (mesh.volume for mesh in stock.mesh(self.chord))
            # twice the inscribed and once the circumscribed polygon: Huygens' rule for circles
            self.stock_volume = Bracket(inner, (outer + 2.0 * inner) / 3.0, outer)

    def _material(self) -> float:
        """mm^3 under the upright vectors."""
        total = 0.0
        for base, lengths, _, _, has in self.upright.tiles():
            total += float((base.start[has] + lengths[has] - base.bottom[has]).sum())
        return total * self.pitch**2

    @classmethod
    def of(cls, stock: Stock, options: Options) -> Self:
        """See `Engine`."""
        return cls(stock, options)

    @classmethod
    def takes(cls, sweep: Sweep) -> bool:
        """See `Engine`: all of them."""
        return True

    def cut(self, sweep: Sweep, block: int | None = None) -> Removal:
        """See `Engine`."""
        found = self.upright.cut(sweep)
        self.along.cut(sweep)
        self._sweeps.append(sweep)
        self._blocks.append(-1 if block is None else block)
        self._removed = self._removed.plus(found)
        return found

    def touch(self, sweep: Sweep, within: float | None = None) -> Removal:
        """See `Engine`."""
        return self.upright.touch(sweep)

    @property
    def volume(self) -> Bracket:
        """mm^3; the sum of intervals of all blocks."""
        whole, gone = self.stock_volume, self._removed
        return Bracket(max(0.0, whole.lo - gone.hi), whole.estimate - gone.estimate, whole.hi - gone.lo)

    @property
    def theta_v_deg(self) -> float:
        """Slope from which on a facet is a wall, degrees."""
        return degrees(self.theta_v)

    def deviation(self, tolerance: float, *, outside_only: bool = True, most: int = MOST_ROWS) -> Deviation:
        """What is left and what is taken too much, see `measured`. tolerance: mm."""
        return measured(
            self.part, None if self.settings.mode == "dnv" else self.upright, self.along, self.kinds, self.covered,
            self._sweeps, self._blocks, tolerance, outside_only=outside_only, most=most,
        )  # fmt: skip

    def surface(self) -> StockSurface:
        """See `Engine`: upright prisms, for pictures."""
        return prisms(self.upright, self._sweeps, self._blocks)

    def save(self, path: Path) -> None:
        """See `Engine`."""
        path.write_bytes(pickle.dumps(self.__dict__))

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
            engine.__dict__.update(_Geometry(io.BytesIO(path.read_bytes())).load())
        except EngineError:
            raise
        except Exception as exc:  # bytes that are no checkpoint can raise anything
            raise EngineError(f"cannot read the checkpoint {path} ({exc})", engine=cls.name) from exc
        return engine


class _Geometry(pickle.Unpickler):
    """Reads pickles of our own values and of arrays, and nothing that could run."""

    def find_class(self, module: str, name: str) -> Any:
        ours = module.startswith(GEOMETRY) or module.startswith(OWN)
        if not ours and not (module.split(".")[0] == "numpy" and name in NUMPY):
            raise EngineError(f"the checkpoint holds {module}.{name}", engine="vectors")
        return super().find_class(module, name)


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
    told = [f"from {p.round(3).tolist()} to {q.round(3).tolist()} mm" for p, q in ((a, b), (lo, hi))]
    shown = f"the design lies {told[0]}, the stock {told[1]}"
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
