"""Who cuts a job where nobody says it, and `--engine columns`: the columns engine, and the mesh engine for the rest.

The rule (`best_engine`): columns, where they take the stock and at least half of the feed motions; else mesh.
Of what is proven, columns are the narrowest for the time. Grids of rays (`dexel`) are 10 to 50 times as fast as mesh where
tools turn (docs/measured/dexel_grid.md), but their intervals are stated: they are requested by name.

1. A block that columns take is cut by columns alone; its sweep is noted for the mesh engine, as long as it is lowest
   somewhere: the union of all sweeps is that of those which the tiles still know, up to rounding, which is added.
2. A block that turns, leans, or whose top dips below the top of the stock is cut by columns in any direction
   (`columns/turning`), after those noted sweeps whose boxes meet it. From then on upright columns do not know the workpiece
   below and above that sweep: blocks whose box overlaps it in plan are cut by columns in any direction, too.
3. What neither takes (a tool that undercuts or has a conical bottom, a stock with curved faces), and what meets the box of
   such a sweep, goes to the mesh engine, after those noted sweeps that it has not cut yet: others change nothing
   there, and the order of cuts is of no matter. The column `engine` says block by block who answered.
4. Where columns in any direction leave a short block wider than `WIDE`, the mesh engine is asked as well: the bracket is
   what both allow where both are proven, and else that of the columns, with the mesh engine's estimate. Brackets
   that do not meet are a dispute, and no proof.
5. A check of shank or holder is asked in the same order.

The mesh engine is not asked at all where columns take everything. What a program does not need is not loaded, kernels
of turning tools among it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from functools import cache, cached_property
from itertools import compress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from vmachining.arrays import Bools, Ints
from vmachining.checkpoint import Saved, opened
from vmachining.engines import dexel, mesh
from vmachining.engines.boxes import Boxes
from vmachining.engines.columns import ColumnsEngine
from vmachining.engines.columns.goal import judged
from vmachining.engines.dexel.budget import default_spacing
from vmachining.engines.noted import Noted
from vmachining.engines.packed import bracket_of, packed_bracket, packed_stock, stock_of
from vmachining.engines.protocol import NOTHING, WHOLE, Options, Removal, Request, Share, StockSurface
from vmachining.engines.summed import Summed
from vmachining.errors import EngineError, StockError
from vmachining.geometry import Line
from vmachining.interval import Interval
from vmachining.stock import Stock
from vmachining.sweep import Sweep

if TYPE_CHECKING:
    from vmachining.engines.columns.turning import Air, AnyDirection, Rows
    from vmachining.engines.mesh import MeshEngine

THIN_MM = 1e-6
"""How far a surface may move when faces are joined: coordinates of its files are coarser."""

SHOWN = 3.0
"""Rays of a surface that is shown stand so much wider than those that measure volumes: 55,000 in all."""

CHECKPOINT = "columns and mesh"
"""Kind of its checkpoints."""

TIDY = 4096
"""Noted sweeps above which it is asked, whenever they are twice as many as before, which are still of use."""

ENOUGH = 0.5
"""Share of the feed motions that columns take above which they pay."""


WIDE, WIDE_MM3 = 0.1, 0.01
"""Width, relative and in mm^3, above which a block of columns in any direction is shown to the mesh engine."""

SHORT = 5
"""Rows of columns (a degree of turn each) up to which it is: facets of wide turns take minutes (docs/measured/gate.md)."""

ROWS_KEPT = 20_000
"""Sweeps whose rows are not computed again."""


def handed_on(stock: Stock) -> Callable[[Sweep], bool]:
    """Whether columns would hand a sweep on to the mesh engine; every one where they do not take the stock."""
    upright = upright_taker(stock, Options())

    @cache
    def anyway() -> AnyDirection | None:
        return other_taker(stock, Options())

    def handed(sweep: Sweep) -> bool:
        if upright is not None and upright.accepts(sweep):
            return False
        other = anyway()
        return other is None or not other.takes(sweep)

    return handed


def upright_taker(stock: Stock, options: Options) -> ColumnsEngine | None:
    """Upright columns for a stock; None where they do not take it."""
    with suppress(StockError):
        return ColumnsEngine.of(stock, options)
    return None


def other_taker(stock: Stock, options: Options) -> AnyDirection | None:
    """Columns in any direction for a stock; None where they do not take it."""
    from vmachining.engines.columns.turning import AnyDirection

    with suppress(StockError):
        return AnyDirection.of(stock, options)
    return None


def best_engine(handed: Sequence[bool]) -> str:
    """Name of the engine for a job that asks for none, from what `handed_on` says of its sweeps."""
    taken = len(handed) - sum(handed)
    return ColumnsFirst.name if handed and taken >= ENOUGH * len(handed) else mesh.MeshEngine.name


class ColumnsFirst(Summed):
    """Workpiece of one job, known to columns and, where they do not suffice, to the mesh engine: both take all."""

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
        self._begin()
        self._tidy_from, self._forgot = TIDY, False
        self._removed = NOTHING
        self._share = WHOLE
        self.stock_volume = (self._columns or self._meshed()).stock_volume

    def _begin(self) -> None:
        """What no checkpoint holds, and what is empty at first."""
        self._noted, self._foreign, self._unknown = Noted(), Boxes(), Boxes()
        self._rows: dict[int, Rows] = {}
        self._last: tuple[Sweep, Rows] | None = None
        self._turns = 0

    @cached_property
    def _anyway(self) -> AnyDirection | None:
        """Columns in any direction."""
        return other_taker(self._stock, self._options)

    @cached_property
    def _air(self) -> Air:
        """What turning blocks find cut."""
        from vmachining.engines.columns.turning import Air

        assert self._anyway is not None
        return Air(self._anyway.solid)

    def cut(self, sweep: Sweep, block: int | None = None) -> Removal:
        """See `Engine`; the removal names who answered."""
        (removed,) = self.answer([Request(sweep, block)])
        return removed

    def answer(self, requests: Sequence[Request]) -> Iterator[Removal]:
        """`cut` and `touch` of one after the other; lines that upright columns take are cut together."""
        lines: list[Request] = []
        for request in requests:
            sweep, block, cuts, within = request
            upright = cuts and self._upright(sweep)
            if line := upright and isinstance(sweep.path, Line):
                lines.append(request)
                if self._share.parts > 1 or len(self._noted) + len(lines) < self._tidy_from:
                    continue  # else what is forgotten would depend on how many come at once
            yield from self._by_columns(lines)
            lines = []
            if line:
                continue
            if upright:
                yield from self._by_columns([request])
            else:
                yield self._otherwise(sweep, block) if cuts else self.touch(sweep, within)
        yield from self._by_columns(lines)

    def _upright(self, sweep: Sweep) -> bool:
        """Whether upright columns cut it."""
        columns = self._columns
        if columns is None or not (self._knows(sweep) and columns.takes(sweep)):
            return False
        return columns.accepts(sweep) or not columns.meets(sweep)

    def _by_columns(self, orders: Sequence[Request]) -> list[Removal]:
        """Cut by upright columns, what they refuse by others."""
        columns = self._columns
        if columns is None or not orders:
            return []
        met = [columns.meets(order.sweep) for order in orders]
        try:
            found = columns.cut_all(orders, met) if len(orders) > 1 else [columns.cut(*orders[0][:2])]
        except EngineError:
            if len(orders) == 1:
                return [self._otherwise(*orders[0][:2])]
            return [removed for order in orders for removed in self._by_columns([order])]
        name = ColumnsEngine.name
        found = [Removal(lo, middle, hi, sure, name, note) for lo, middle, hi, sure, _, note in found]
        self._noted.extend([order[:2] for order in compress(orders, met)])
        if len(self._noted) >= self._tidy_from and self._share.parts == 1:
            self.forget_others(self.in_use())
        self._removed = self._removed.plus(*found)
        return found

    def _otherwise(self, sweep: Sweep, block: int | None) -> Removal:
        """Cut by others than upright columns."""
        removed, by_mesh = self._in_any_direction(sweep), False
        if removed is None:
            removed, by_mesh = self._by_mesh(sweep, block), True
        elif removed.width > max(WIDE * removed.estimate, WIDE_MM3) and self._short(sweep):
            with suppress(EngineError):  # columns have answered
                removed, by_mesh = _both(removed, self._by_mesh(sweep, block)), True
        elif removed.engine is None:  # not in the stock
            return removed._replace(engine=ColumnsEngine.name)
        self._foreign.add(sweep.bounds)
        if self._anyway is not None and self._anyway.takes(sweep):
            number = self._noted.add(sweep, block, lasts=True, cut=by_mesh)
            self._rows[number] = self._own(sweep)
        else:
            self._unknown.add(sweep.bounds)
        self._removed = self._removed.plus(removed)
        return removed

    def _by_mesh(self, sweep: Sweep, block: int | None) -> Removal:
        return self._rounded(self._meshed(sweep).cut(sweep, block), sweep)._replace(
            engine=mesh.MeshEngine.name
        )

    def _short(self, sweep: Sweep) -> bool:
        """Whether the mesh engine surely has an answer in good time."""
        return self._share.parts == 1 and len(self._own(sweep)) <= SHORT

    def _own(self, sweep: Sweep) -> Rows:
        """Its rows, made once while it is asked about."""
        from vmachining.engines.columns.turning import rows_of

        if self._last is None or self._last[0] is not sweep:
            self._last = sweep, rows_of(sweep)
        return self._last[1]

    def _in_any_direction(self, sweep: Sweep, floor: float = 0.0) -> Removal | None:
        """What columns in any direction say, one part of a divided workpiece after the other by turns; None: nothing."""
        from vmachining.engines.columns.turning import Rows

        anyway = self._anyway
        if anyway is None or not anyway.takes(sweep) or self._unknown.meeting(sweep.bounds, 3).any():
            return None
        if not anyway.meets(sweep):
            return NOTHING
        self._turns += 1
        if self._turns % self._share.parts != self._share.part:
            return NOTHING._replace(engine=ColumnsEngine.name)
        own, near = self._own(sweep), self._noted.boxes.meeting(sweep.bounds, 3)
        left = None
        if near.any():
            self._carve(near)
            left = self._air.left(own)
            if not any(len(part.cubes) for part in left):
                return NOTHING._replace(engine=ColumnsEngine.name)
            some, holders = self._air.around(left, sweep.bounds)
            numbers = self._noted.serials
            if np.isin(holders, numbers).all():  # none that holds a cube is forgotten
                near = np.isin(numbers, some)
        before = self._known(near)
        found = anyway.cut(own, Rows.join(before) if before else None, floor, left)
        found = self._rounded(found, sweep)._replace(engine=ColumnsEngine.name)
        return found if self._share.parts > 1 or floor else judged(found, anyway.width, anyway.width_mm3)

    def _known(self, which: Bools) -> list[Rows]:
        """Rows of noted sweeps."""
        from vmachining.engines.columns.turning import rows_of

        numbers = self._noted.serials[which].tolist()
        if any(number not in self._rows for number in numbers):
            for number, (earlier, _) in zip(numbers, self._noted.sweeps(which), strict=True):
                if number not in self._rows:
                    self._rows[number] = rows_of(earlier)
        found = [self._rows[number] for number in numbers]
        while len(self._rows) > ROWS_KEPT:
            del self._rows[next(iter(self._rows))]
        return found

    def _carve(self, near: Bools) -> None:
        """Cubes of noted sweeps; of those near a block, as most upright ones are near none that turns."""
        if self._air.full:
            del self._air
        fresh = near.copy()
        fresh[near] = [number not in self._air for number in self._noted.serials[near].tolist()]
        for number, rows in zip(self._noted.serials[fresh].tolist(), self._known(fresh), strict=True):
            self._air.add(number, rows)

    def in_use(self) -> Ints:
        """See `Divisible`: numbers of the blocks that columns still know in some tile."""
        return np.zeros(0, dtype=np.int64) if self._columns is None else self._columns.in_use()

    def forget_others(self, blocks: Ints) -> None:
        """See `Divisible`: what is lowest nowhere takes nothing that others do not take, so mesh need not cut it."""
        needed = np.isin(self._noted.blocks, blocks) | self._noted.lasting
        self._forgot = self._forgot or not needed.all()
        self._noted.keep(needed)
        self._tidy_from = max(TIDY, 2 * len(self._noted))

    def _rounded(self, removed: Removal, sweep: Sweep) -> Removal:
        """What others than upright columns say, wider by what forgotten sweeps may reach beyond those that hide them."""
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
        """Whether no sweep that upright columns have not cut overlaps this one in plan."""
        return len(self._foreign) == 0 or not self._foreign.meeting(sweep.bounds, 2).any()

    def touch(self, sweep: Sweep, within: float | None = None) -> Removal:
        """See `Engine`; upright columns know a body that is not convex as the union of its convex pieces."""
        if self._columns is not None and self._knows(sweep):
            try:
                pieces = sweep.profile.convex_pieces()
                found = [
                    self._columns.touch(sweep if len(pieces) == 1 else Sweep.along(p, sweep.path), within)
                    for p in pieces
                ]
            except EngineError:
                found = []
            if found:
                lo, hi = max(r.lo for r in found), sum(r.hi for r in found)
                estimate = max(lo, min(sum(r.estimate for r in found), hi))
                return Removal(lo, estimate, hi, all(r.proven for r in found))
        said = self._in_any_direction(
            sweep, (within or self.chord) * 2.0 * np.pi * sweep.profile.max_radius**2
        )
        return self._rounded(self._meshed(sweep).touch(sweep, within), sweep) if said is None else said

    def _meshed(self, near: Sweep | None = None) -> MeshEngine:
        """The mesh engine after all sweeps so far, or after those that meet the box of one."""
        if self._mesh is None:
            self._mesh = mesh.MeshEngine.of(self._stock, self._options)
            self._mesh.take(self._share)
        wanted = self._noted.uncut
        if near is not None:
            wanted &= self._noted.boxes.meeting(near.bounds, 3)
        if wanted.any():
            for sweep, block in self._noted.sweeps(wanted):
                self._mesh.cut(sweep, block)
            self._noted.mark(wanted)
            if self._anyway is None:
                self._noted.keep(self._noted.uncut)
        return self._mesh

    @property
    def kept(self) -> int:
        """Sweeps that are kept, by columns and for the mesh engine."""
        return len(self._noted) + (self._columns.kept if self._columns is not None else 0)

    @property
    def proof(self) -> str:
        """Who proves."""
        said = [] if self._columns is None else [self._columns.proof]
        if self._turns:
            said.append("columns in any direction where the axis leans or turns")
        if self._mesh is not None and (len(self._unknown) or not said):
            why = f" (mesh engine: {self.why})" if self.why else ""
            said.append(f"{len(self._unknown)} blocks: {self._mesh.proof}{why}")
        return "; ".join(said)

    @property
    def volume(self) -> Interval:
        """Of the workpiece, mm^3."""
        if self._columns is not None and not len(self._foreign):
            return self._columns.volume
        return super().volume

    def surface(self) -> StockSurface:
        """Heights of the columns over a grid, with upright walls, what lies in one plane as one face; after other than upright
        cuts the ends of rays in three directions; after sweeps that columns do not know the facets of the mesh engine."""
        columns = self._columns
        if columns is not None and columns.is_cut and not len(self._foreign):
            surface = columns.over_box()
            if columns.stock.mesh is None:
                return surface
            from vmachining.engines.mesh.thinned import thinned

            thin = thinned(surface, THIN_MM, columns.stock.shape, self.chord)
            if thin is not None:
                return thin
        if self._anyway is not None and not len(self._unknown):  # a few per cent of the time of two meshes
            from vmachining.engines.mesh.thinned import thinned

            box = np.array(self._stock.bounds)
            grid = dexel.DexelEngine(self._stock, Options(spacing=SHOWN * default_spacing(box, (0, 1, 2))))
            everything = np.ones(len(self._noted), dtype=bool)
            grid.answer([Request(sweep, block) for sweep, block in self._noted.sweeps(everything)])
            thin = thinned(grid.surface(), THIN_MM)
            if thin is not None:
                return thin
        return self._meshed().surface()

    # -- checkpoints ---------------------------------------------------------------------------------------

    def save(self, path: Path) -> None:
        """Both workpieces, the stock, and the sweeps that are noted."""
        parts = {e.name: e.packed() for e in (self._columns, self._mesh) if e is not None}
        state: dict[str, Any] = {name: part.state for name, part in parts.items()}
        state |= {
            "gone": list(self._removed[:4]), "why": self.why, "stock": packed_bracket(self.stock_volume),
            "options": [self.chord, self._options.width, self._options.width_mm3], "forgot": self._forgot,
            "share": list(self._share),
        }  # fmt: skip
        state["raw"], stock = packed_stock(self._stock)
        state["turns"] = self._turns
        arrays = {"foreign": self._foreign.rows, "unknown": self._unknown.rows, **self._noted.packed()}
        arrays |= Saved("stock", {}, stock).nested("raw")
        for name, part in parts.items():
            arrays |= part.nested(name)
        Saved(CHECKPOINT, state, arrays, deflated=self._mesh is not None).write(path)

    @classmethod
    def load(cls, path: Path, *, share: Share = WHOLE) -> Self:
        """See `Divisible`. Columns and the mesh engine have their own division each: a block is the sum over either."""
        with opened(path, CHECKPOINT) as saved:
            return cls._unpacked(saved, share)

    @classmethod
    def _unpacked(cls, saved: Saved, share: Share) -> Self:
        self, state, found = cls.__new__(cls), saved.state, saved.arrays
        if "turns" not in state:
            raise ValueError(
                "an earlier version of vmachining wrote it, without columns in any direction: run the job again"
            )
        noted, forgot = Noted.unpacked(found), bool(state["forgot"])
        chord, width, width_mm3 = state["options"]
        self._options, self.why = Options(chord=chord, width=width, width_mm3=width_mm3), state["why"]
        self.chord, self.stock_volume = self._options.chord, bracket_of(state["stock"])
        mine = share.part == 0 or state.get("share") == list(share)  # of a whole, the first share has it
        self._removed = Removal(*state["gone"]) if mine else NOTHING
        self._stock, self._share = stock_of(state["raw"], saved.part("raw", "stock").arrays), share
        self._begin()
        self._noted, self._foreign, self._unknown = noted, Boxes(found["foreign"]), Boxes(found["unknown"])
        self._turns = int(state["turns"])
        self._tidy_from, self._forgot = max(TIDY, 2 * len(noted)), forgot
        self._columns = self._mesh = None
        if "columns" in state:
            self._columns = ColumnsEngine.unpacked(saved.part("columns", ColumnsEngine.name), share)
        if "mesh" in state:
            self._mesh = mesh.MeshEngine.unpacked(saved.part("mesh", mesh.MeshEngine.name), share)
        return self

    @classmethod
    def join(cls, engines: Iterable[Self]) -> Self:
        """See `Divisible`. All parts had all orders, so that they know the same sweeps by the same engines."""
        shares = iter(engines)
        whole = next(shares)
        columns, meshes = [whole._columns], [whole._mesh]
        for share in shares:  # one at a time: what it has noted is noted already
            whole._removed = whole._removed.plus(share._removed)
            columns.append(share._columns)
            meshes.append(share._mesh)
        whole._share = WHOLE
        if whole._columns is not None:
            whole._columns = ColumnsEngine.join(filter(None, columns))
        if whole._mesh is not None:
            whole._mesh = mesh.MeshEngine.join(filter(None, meshes))
        return whole

    def summed(self, parts: Sequence[Removal]) -> Removal:
        """See `Divisible`."""
        found = parts[0].plus(*parts[1:])
        if found.engine == ColumnsEngine.name and found.note is not None:
            return judged(found, self._options.width, self._options.width_mm3)
        return found


def _both(columns: Removal, meshed: Removal) -> Removal:
    """What a proven bracket of columns and the interval of the mesh engine say together; see rule 4."""
    name = f"{ColumnsEngine.name}+{mesh.MeshEngine.name}"
    lo, hi = columns.lo, columns.hi
    if meshed.lo > hi or meshed.hi < lo:
        note = f"columns say {lo:.6g} to {hi:.6g} mm3, mesh {meshed.lo:.6g} to {meshed.hi:.6g}: they dispute each other"
        if meshed.proven:
            return Removal(min(lo, meshed.lo), columns.estimate, max(hi, meshed.hi), False, name, note)
        return columns._replace(engine=name, note=note)
    if meshed.proven:
        lo, hi = max(lo, meshed.lo), min(hi, meshed.hi)
    return Removal(lo, min(max(meshed.estimate, lo), hi), hi, columns.proven, name, columns.note)
