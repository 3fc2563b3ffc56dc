"""Who cuts a job where nobody says it, and `--engine columns`: the columns engine, and the mesh engine for the rest.

The rule (`best_engine`): columns, where they take the stock and at least half of the feed motions; else mesh.
Of what is proven, columns are the narrowest for the time. Grids of rays (`dexel`) are 10 to 50 times as fast as mesh where
tools turn (docs/measured/dexel_grid.md), but their intervals are stated: they are asked for by name.

1. A block that columns take is cut by columns alone; its sweep is noted for the mesh engine, as long as it is lowest
   somewhere: the union of all sweeps is that of those which the tiles still know, up to rounding, which is added.
2. A block that they do not take (a tool that turns, leans or is not convex, a sweep whose top dips below the top of the
   stock) goes to the mesh engine, after those noted sweeps whose boxes meet it: others change nothing there, and the order
   of cuts is of no matter.
3. From then on columns do not know the workpiece below and above that sweep: blocks whose box overlaps it in plan go to
   the mesh engine, too; all others stay with columns. The column `engine` says block by block who answered.
4. A check of shank or holder that columns cannot answer is asked of the mesh engine in the same way.

The mesh engine is not asked at all where columns take everything, for the surface neither.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import reduce
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Self

import numpy as np

from vmachining.arrays import Ints
from vmachining.engines.columns import ColumnsEngine
from vmachining.engines.mesh import MeshEngine
from vmachining.engines.mesh.thinned import thinned
from vmachining.engines.noted import Boxes, Noted
from vmachining.engines.protocol import NOTHING, WHOLE, Options, Removal, Share, StockSurface
from vmachining.errors import EngineError, StockError
from vmachining.geometry import Bracket
from vmachining.stock import Stock
from vmachining.sweep import Sweep

__all__ = ["ColumnsFirst", "best_engine", "handed_on"]

THIN_MM = 1e-6
"""How far a surface may move when faces are joined: coordinates of its files are coarser."""

TIDY = 4096
"""Noted sweeps from which on it is asked, whenever they are twice as many as before, which are still of use."""

ENOUGH = 0.5
"""Share of the feed motions that columns take from which on they pay."""


def handed_on(stock: Stock) -> Callable[[Sweep], bool]:
    """Whether columns would hand a sweep on to the mesh engine; every one where they do not take the stock."""
    try:
        columns = ColumnsEngine.of(stock, Options())
    except StockError:
        return lambda sweep: True
    return lambda sweep: not columns.accepts(sweep)


def best_engine(handed: Sequence[bool]) -> str:
    """Name of the engine for a job that asks for none, from what `handed_on` says of its sweeps."""
    taken = len(handed) - sum(handed)
    return ColumnsFirst.name if handed and taken >= ENOUGH * len(handed) else MeshEngine.name


class ColumnsFirst:
    """Workpiece of one job, known to columns and, where they do not suffice, to the mesh engine."""

    name = "columns"

    def __init__(self, stock: Stock, options: Options) -> None:
        self.chord = options.chord
        self._stock, self._options = stock, options
        self._columns: ColumnsEngine | None = None
        self._mesh: MeshEngine | None = None
        self.why: str | None = None
        """Why the mesh engine cuts from the first block on; None where columns do."""
        try:
            self._columns = ColumnsEngine.of(stock, options)
        except StockError as error:
            self.why = error.message
        self._noted, self._foreign = Noted(), Boxes()
        self._tidy_from, self._forgot = TIDY, False
        self._gone = NOTHING
        self._share = WHOLE
        self.stock_volume = (self._columns or self._meshed()).stock_volume

    @classmethod
    def of(cls, stock: Stock, options: Options) -> Self:
        """See `Engine`."""
        return cls(stock, options)

    @classmethod
    def takes(cls, sweep: Sweep) -> bool:
        """Everything: what columns do not take is handed on."""
        return True

    def cut(self, sweep: Sweep, block: int | None = None) -> Removal:
        """See `Engine`; the removal names who answered."""
        removed = self._by_columns(sweep, block)
        if removed is None:
            removed = self._rounded(self._meshed(sweep).cut(sweep, block), sweep)._replace(
                engine=MeshEngine.name
            )
            self._foreign.add(sweep.bounds)
        elif self._columns is not None and self._columns.meets(sweep):
            self._noted.add(sweep, block)
            if len(self._noted) >= self._tidy_from and self._share.parts == 1:
                self.forget_others(self.in_use())
        self._gone = self._gone.plus(removed)
        return removed

    def _by_columns(self, sweep: Sweep, block: int | None) -> Removal | None:
        if self._columns is None or not (self._knows(sweep) and self._columns.takes(sweep)):
            return None
        try:
            return self._columns.cut(sweep, block)._replace(engine=ColumnsEngine.name)
        except EngineError:
            return None

    def in_use(self) -> Ints:
        """See `Divisible`: numbers of the blocks that columns still know in some tile."""
        return np.zeros(0, dtype=np.int64) if self._columns is None else self._columns.in_use()

    def forget_others(self, blocks: Ints) -> None:
        """See `Divisible`: what is lowest nowhere takes nothing that others do not take, so mesh need not cut it."""
        needed = np.isin(self._noted.blocks, blocks)
        self._forgot = self._forgot or not needed.all()
        self._noted.keep(needed)
        self._tidy_from = max(TIDY, 2 * len(self._noted))

    def _rounded(self, removed: Removal, sweep: Sweep) -> Removal:
        """What mesh says of a sweep, wider by what forgotten sweeps may reach beyond those that hide them."""
        if not self._forgot or self._columns is None:
            return removed
        a, b = (
            np.maximum(sweep.bounds[0], self._columns.stock.low),
            np.minimum(sweep.bounds[1], self._columns.stock.high),
        )
        x, y, z = np.maximum(b - a, 0.0).tolist()
        error = self._columns.rounding(sweep) * 2.0 * (x * y + y * z + z * x)
        return removed._replace(lo=max(removed.lo - error, 0.0), hi=removed.hi + error)

    def _knows(self, sweep: Sweep) -> bool:
        """Whether no sweep of the mesh engine overlaps this one in plan."""
        return len(self._foreign) == 0 or not self._foreign.meeting(sweep.bounds, 2).any()

    def touch(self, sweep: Sweep, within: float | None = None) -> Removal:
        """See `Engine`; a body that is not convex as the union of its convex pieces."""
        if self._columns is not None and self._knows(sweep):
            try:
                pieces = sweep.profile.convex_pieces()
                found = [
                    self._columns.touch(sweep if len(pieces) == 1 else Sweep.along(p, sweep.path), within)
                    for p in pieces
                ]
            except EngineError:
                return self._rounded(self._meshed(sweep).touch(sweep, within), sweep)
            lo, hi = max(r.lo for r in found), sum(r.hi for r in found)
            return Removal(lo, max(lo, min(sum(r.estimate for r in found), hi)), hi)
        return self._rounded(self._meshed(sweep).touch(sweep, within), sweep)

    def _meshed(self, near: Sweep | None = None) -> MeshEngine:
        """The mesh engine after all sweeps so far, or after those that meet the box of one."""
        if self._mesh is None:
            self._mesh = MeshEngine.of(self._stock, self._options)
            self._mesh.take(self._share)
        wanted = np.ones(len(self._noted), dtype=np.bool_)
        if near is not None:
            wanted = self._noted.boxes.meeting(near.bounds, 3)
        if wanted.any():
            for sweep, block in self._noted.sweeps(wanted):
                self._mesh.cut(sweep, block)
            self._noted.keep(~wanted)
        return self._mesh

    @property
    def kept(self) -> int:
        """Sweeps that are kept, by columns and for the mesh engine."""
        return len(self._noted) + (self._columns.kept if self._columns is not None else 0)

    @property
    def proof(self) -> str:
        """Who proves."""
        if self._columns is None:
            return f"{self._meshed().proof} (mesh engine: {self.why})"
        if len(self._foreign):
            assert self._mesh is not None
            return f"{self._columns.proof}; {len(self._foreign)} blocks: {self._mesh.proof}"
        return self._columns.proof

    @property
    def volume(self) -> Bracket:
        """Of the workpiece, mm^3."""
        if self._columns is not None and not len(self._foreign):
            return self._columns.volume
        lo, estimate, hi = self.stock_volume
        gone = self._gone
        return Bracket(max(lo - gone.hi, 0.0), max(estimate - gone.estimate, 0.0), hi - gone.lo)

    def surface(self) -> StockSurface:
        """Heights of the columns over a grid, with upright walls, what lies in one plane as one face; where the mesh engine
        has cut, its facets, after it has cut all other blocks, too."""
        columns = self._columns
        if columns is not None and columns.is_cut and not len(self._foreign):
            surface, is_box = columns.over_box(), columns.stock.is_box
            thin = thinned(surface, THIN_MM, None if is_box else columns.stock.shape, self.chord)
            if thin is not None or is_box:
                return thin or surface
        return self._meshed().surface()

    # -- checkpoints ---------------------------------------------------------------------------------------

    def save(self, path: Path) -> None:
        """Both workpieces and the sweeps that only columns know yet: the mesh engine cuts them first."""
        engines: dict[str, Any] = {}
        with TemporaryDirectory() as folder:
            if self._columns is None:
                self._meshed()
            for name, engine in (("columns", self._columns), ("mesh", self._mesh)):
                if engine is not None:
                    engine.save(Path(folder) / "part.npz")
                    engines[name] = np.frombuffer((Path(folder) / "part.npz").read_bytes(), dtype=np.uint8)
        state = {
            "gone": list(self._gone[:4]), "why": self.why, "stock": list(self.stock_volume),
            "options": [self.chord, self._options.width, self._options.width_mm3], "forgot": self._forgot,
        }  # fmt: skip
        with path.open("wb") as file:
            np.savez(
                file,
                state=np.array(json.dumps(state)),
                foreign=self._foreign.rows,
                **engines,
                **self._noted.packed(),
            )

    @classmethod
    def load(cls, path: Path, *, share: Share = WHOLE) -> Self:
        """See `Divisible`. Columns and the mesh engine have a division of their own each: a block is the sum over either."""
        try:
            with np.load(path) as data:
                found = {name: data[name] for name in data.files}
            state = json.loads(str(found["state"]))
            noted, forgot = Noted.unpacked(found), bool(state["forgot"])
        except (OSError, KeyError, ValueError) as error:
            raise EngineError(f"checkpoint {path} cannot be read ({error})", engine=cls.name) from error
        self = cls.__new__(cls)
        chord, width, width_mm3 = state["options"]
        self._options, self.why = Options(chord=chord, width=width, width_mm3=width_mm3), state["why"]
        self.chord, self.stock_volume = self._options.chord, Bracket(*state["stock"])
        self._gone = Removal(*state["gone"]) if share.part == 0 else NOTHING
        self._share, self._noted, self._foreign = share, noted, Boxes(found["foreign"])
        self._tidy_from, self._forgot = max(TIDY, 2 * len(noted)), forgot
        with TemporaryDirectory() as folder:
            part = Path(folder) / "part.npz"
            self._columns = self._mesh = None
            if "columns" in found:
                part.write_bytes(found["columns"].tobytes())
                self._columns = ColumnsEngine.load(part, share=share)
                self._stock = self._columns.stock.shape
            if "mesh" in found:
                part.write_bytes(found["mesh"].tobytes())
                self._mesh = MeshEngine.load(part, share=share)
        return self

    @classmethod
    def join(cls, engines: Sequence[Self]) -> Self:
        """See `Divisible`. All parts had all orders, so that they know the same sweeps by the same engines."""
        whole = engines[0]
        whole._share, whole._gone = WHOLE, reduce(Removal.plus, (e._gone for e in engines))
        if whole._columns is not None:
            whole._columns = ColumnsEngine.join([e._columns for e in engines if e._columns is not None])
        if whole._mesh is not None:
            whole._mesh = MeshEngine.join([e._mesh for e in engines if e._mesh is not None])
        return whole

    def summed(self, parts: Sequence[Removal]) -> Removal:
        """See `Divisible`."""
        if self._columns is not None and parts[0].engine == ColumnsEngine.name:
            return self._columns.summed(parts)
        return reduce(Removal.plus, parts)
