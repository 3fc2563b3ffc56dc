"""`ColumnsEngine`: proven removed volumes of three-axis blocks, looking along the tool axis."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import compress
from math import hypot
from pathlib import Path
from threading import local
from typing import Self

import numpy as np

from vmachining.arrays import Floats, Ints
from vmachining.checkpoint import Saved, opened
from vmachining.engines.columns import _kernels
from vmachining.engines.columns.cutters import underside
from vmachining.engines.columns.flat_stock import FlatStock
from vmachining.engines.columns.goal import goal_of, judged
from vmachining.engines.columns.paths import arc_row, lowest, pieces, straight_row
from vmachining.engines.columns.rounding import CELLS, DIGITS, removals, slacks
from vmachining.engines.columns.shape import lattice_of, solid_of
from vmachining.engines.columns.sides import ALL
from vmachining.engines.columns.table import ANYWHERE, ASIDE, CutterTable
from vmachining.engines.columns.tiles import Tiling
from vmachining.engines.packed import mesh_of
from vmachining.engines.protocol import NOTHING, WHOLE, Options, Removal, Request, Share, StockSurface
from vmachining.errors import EngineError
from vmachining.geometry import Arc, Line
from vmachining.interval import Interval
from vmachining.stock import Stock
from vmachining.sweep import Sweep, Turn
from vmachining.tolerance import CHORD_MM
from vmachining.tool import Profile

UPRIGHT = 2
"""Axis of arcs whose plane is level."""

TILE_SHARE = 0.2
"""Edge of a tile by the radius of the first cutter. Measured best between 1/6 and 1/4."""

PER_TILE, MOST_PLACES = 4, 4_000_000
"""Places of a surface along an edge of a tile that was cut, and all in all."""

LEFT_WIDTH, MOST_LOOKED = 1e-4, 400_000
"""Width, relative to the volume that is gone, asked of what is left in the end, and tiles up to which it is looked at."""

ADDED = 1e-3
"""Share of the requested width that kernels leave to the rounding that is added to what they find."""

COARSE = 0.25
"""Relative width of the first look at the pieces of a block."""

TIDY = 4096
"""Rows above which it is asked, whenever they are twice as many as before, which of them are still of use."""

NO_DIGITS = "coordinates so large have no more digits"

NUMBER = 12
"""Column of rows: their order."""

TOGETHER, MOST_THREADS = 16_384, 8
"""Places whose heights one thread finds at a time, and threads at most."""

ROOM = local()
"""`work` of a thread, 35 MB for all of its workpieces: nothing in it is kept between two questions."""


class ColumnsEngine:
    """Workpiece of one job, cut block by block.

    Parameters
    ----------
    stock : FlatStock
    width : float
        Width of a bracket relative to its middle at which a block is done.
    width_mm3 : float
        mm^3; a block is finished when its bracket is narrower than this, or than `width`.
    tile_mm : float or None
        Edge of a tile; None: a fifth of the radius of the first cutter.
    """

    name = "columns"
    chord = CHORD_MM
    proof = "bounds of convex surfaces over columns"
    rules = int(ALL)
    """Bits of the rules in force, see sides.py: with one switched off brackets are wider and hold the truth."""

    def __init__(
        self, stock: FlatStock, width: float = 0.01, width_mm3: float = 1e-3, *, tile_mm: float | None = None
    ) -> None:
        if not width > 0.0 or not width_mm3 >= 0.0:
            raise EngineError(f"width {width:g} and {width_mm3:g} mm3 cannot be reached", engine=self.name)
        self.stock, self.width, self.width_mm3, self.tile_mm = stock, width, width_mm3, tile_mm
        self.stock_volume = Interval(stock.volume, stock.volume, stock.volume)
        self.cells = self._looked_at = 0
        self._gone = NOTHING
        self._cutters = CutterTable()
        self._rows, self._count, self._made, self._tidy_from = np.zeros((64, 13)), 0, 0, TIDY
        self._blocks: list[int] = []
        self._tiles: Tiling | None = None
        self._left: Removal | None = None
        self._share = WHOLE
        self._rim = self._round_stock()

    @classmethod
    def of(cls, stock: Stock, options: Options) -> Self:
        """See `Engine`."""
        return cls(FlatStock.of(stock), options.width, options.width_mm3)

    @classmethod
    def takes(cls, sweep: Sweep) -> bool:
        """Whether the cutter is convex and stands upright; where its top dips below the stock is asked by `cut`."""
        return not isinstance(sweep.path, Turn) and underside(sweep.profile) is not None

    def accepts(self, sweep: Sweep) -> bool:
        """Whether `cut` answers: `takes`, and nowhere the top of the sweep dips below that of the stock."""
        if not self.takes(sweep) or isinstance(sweep.path, Turn):
            return False
        found = underside(sweep.profile)
        return found is not None and lowest(sweep.path) + found.top >= self.stock.high[2]

    # -- cutting -------------------------------------------------------------------------------------------

    def cut(self, sweep: Sweep, block: int | None = None) -> Removal:
        """Take the sweep out of the workpiece; exactly 0 in air.

        Raises
        ------
        EngineError
            The sweep turns, its cutter is not convex, or its top dips below the top of the stock.
        """
        found = self._removal(sweep, block, keep=True)
        self._gone, self._left = self._gone.plus(found), None
        if self._count >= self._tidy_from:
            self.tidy()
        return found

    def rounding(self, sweep: Sweep) -> float:
        """mm by which a surface that was computed may lie beside the true one (R10)."""
        box = sweep.bounds
        scale = np.abs([*box, self.stock.low, self.stock.high]).max() + np.ptp(box, axis=0).max()
        return float(DIGITS * scale)

    def meets(self, sweep: Sweep) -> bool:
        """Whether the box of a sweep meets that of the stock."""
        (x0, y0, z0), (x1, y1, z1) = sweep.bounds.tolist()  # plain numbers: ten times as fast as arrays
        (a0, b0, c0), (a1, b1, c1) = self.stock[:2]
        return bool(x0 < a1 and y0 < b1 and z0 < c1 and x1 > a0 and y1 > b0 and z1 > c0)

    def tidy(self) -> None:
        """Forget the rows of sweeps that no tile knows any more: they are lowest nowhere (R8 of docs/columns.md)."""
        if self._tiles is None:
            return
        tile, sweep = self._tiles.entries()
        needed = np.union1d(sweep, np.arange(self._rim + 1))
        self._tiles.fill(tile, np.searchsorted(needed, sweep))
        self._blocks = [self._blocks[k] for k in needed.tolist()]
        self._take_rows(self._rows[needed])

    def _take_rows(self, rows: Floats) -> None:
        self._count = len(rows)
        self._rows = np.zeros((max(64, 2 * len(rows)), rows.shape[1]))
        self._rows[: len(rows)] = rows
        self._tidy_from = max(TIDY, 2 * len(rows))

    @property
    def kept(self) -> int:
        """Rows of sweeps that are kept."""
        return self._count

    def in_use(self) -> Ints:
        """Numbers of the blocks that some tile knows."""
        self.tidy()
        return np.unique(np.array(self._blocks[: self._count], dtype=np.int64))

    def look_at(self, box: Floats, radius: float) -> None:
        """Forget all that was cut; from now on sweeps are entered and cut only in tiles that a box (2, 3), mm, reaches.

        radius : mm, of the cutter by which tiles are made, if none exist yet.
        """
        self._count = self._rim + 1
        self._gone, self._left = NOTHING, None
        if self._tiles is None:
            self._tiles = Tiling.over(self.stock, self.tile_mm or TILE_SHARE * radius)
        self._tiles.look_at(box)

    def enter(self, sweep: Sweep, block: int | None = None) -> None:
        """Take a sweep out without finding out what it removes: `cut` with a width that every bracket has."""
        asked, self.width_mm3 = self.width_mm3, float("inf")
        try:
            self.cut(sweep, block)
        finally:
            self.width_mm3 = asked

    def touch(self, sweep: Sweep, within: float | None = None) -> Removal:
        """What the sweep would take, as narrow as `cut` or as a layer of `within` mm on half a ball of the cutter."""
        floor = 0.0 if within is None else within * 2.0 * np.pi * sweep.profile.max_radius**2
        return self._removal(sweep, None, keep=False, floor=floor)

    def _removal(self, sweep: Sweep, block: int | None, *, keep: bool, floor: float = 0.0) -> Removal:
        if isinstance(sweep.path, Turn) or not self.takes(sweep):
            raise EngineError("the tool turns or is not convex", engine=self.name, block=block)
        if not self.meets(sweep):
            return NOTHING
        wanted = max(self.width_mm3, floor)
        first = self._count
        self._add(sweep.profile, sweep.path, block)
        if self._count - first == 1:
            (found,) = self._rows_removed(first, self._goal(wanted), keep, divided=self._share.parts > 1)
        else:
            before = self._ready(first).lists(self._shapes, first, self._count)
            found = self._pieces(first, before, wanted)
            if not keep:
                self._ready(first).restore(before)
        if not keep:
            self._made -= self._count - first
            self._count = first
            return found._replace(note=None)
        return self._told(found)

    def cut_all(self, orders: Sequence[Request], met: Sequence[bool]) -> list[Removal]:
        """`cut` of lines one after the other, in one call of a kernel. met : whether `meets` is true of them.

        Raises EngineError: One of them cannot be cut; the workpiece is as before.
        """
        first, made = self._count, self._made
        try:
            for order in compress(orders, met):
                assert isinstance(order.sweep.path, Line)
                self._add(order.sweep.profile, order.sweep.path, order.block)
        except EngineError:
            self._count, self._made = first, made
            raise
        rows = self._rows_removed(first, self._goal(self.width_mm3), True, divided=self._share.parts > 1)
        told = map(self._told, rows)
        found = [next(told) if meets else NOTHING for meets in met]
        self._gone, self._left = self._gone.plus(*found), None
        if self._count >= self._tidy_from:
            self.tidy()
        return found

    def _told(self, found: Removal) -> Removal:
        """As one of several parts says it, or the whole."""
        if found.hi > 0.0 and found.note is None:
            found = found._replace(note=NO_DIGITS)
        return found if self._share.parts > 1 else self._judged(found)

    def summed(self, parts: Sequence[Removal]) -> Removal:
        """See `Divisible`: whether a block is wider than requested is seen by the sum; parts say why it would be."""
        found = parts[0].plus(*parts[1:])
        return found if found.note is None else self._judged(found)

    def _judged(self, found: Removal) -> Removal:
        return judged(found, self.width, self.width_mm3)

    def _goal(self, wanted: float) -> _kernels.Goal:
        """Of a block as it was requested, without what rounding adds."""
        return goal_of((1.0 - ADDED) * self.width, (1.0 - ADDED) * wanted)

    def _pieces(self, first: int, before: dict[int, Ints], wanted: float) -> Removal:
        """Of all rows from `first` on, which see each other by the tiles: a coarse look says how narrow each need be."""
        pieces = self._count - first
        found = NOTHING.plus(*self._rows_removed(first, goal_of(COARSE, wanted / pieces), True))
        goal = self._goal(wanted)
        if self._share.parts > 1:
            share = self._ready(first).share_of(self._shapes, first, self._count)
            if share == 0.0:
                return NOTHING
            goal = _kernels.part_of(goal, share)
        asked = _kernels.wanted(goal, found.lo)
        if found.width <= asked:
            return found
        self._ready(first).restore(before)
        return NOTHING.plus(*self._rows_removed(first, goal_of(0.0, asked / pieces), True))

    def _rows_removed(
        self, first: int, goal: _kernels.Goal, keep: bool, *, divided: bool = False
    ) -> list[Removal]:
        """Of each row from `first` on; divided : the goal is that of all parts together."""
        rows = self._rows[first : self._count]
        if not len(rows):
            return []
        tiles, shapes, k, out = self._ready(first), self._shapes, first, np.zeros((len(rows), 5))
        bottom, top = self.stock.low[2], self.stock.high[2]
        slack = slacks(rows, np.abs([*self.stock.low, *self.stock.high]).max())
        while True:
            at = k - first
            k = _kernels.remove_all(
                shapes, tiles.arrays, tiles.roof, self._work, k, self._count, self._rim, top, bottom, goal, divided,
                slack[at:], CELLS, keep, out[at:],
            )  # fmt: skip
            if k == self._count:
                break
            if out[k - first, 4] == _kernels.LONG:
                ROOM.work = _kernels.work(2 * len(self._work.cell), 2 * len(self._work.E))
            else:
                tiles.make_room(shapes, k)
        self.cells, self._looked_at = self.cells + int(out[:, 2].sum()), int(out[-1, 2])
        seams = None
        if tiles.seams is not None:
            seams = np.array([tiles.seam_length(tiles.reached(shapes, first + i)) for i in range(len(rows))])
        R = self._cutters.head[rows[:, 8].astype(np.int64), 1]
        return removals(rows, out, slack, R, top - np.maximum(bottom, rows[:, 9]), seams)

    def _add(self, profile: Profile, path: Line | Arc, block: int | None) -> None:
        """Rows of a line, or of the pieces of an arc, whose chords the kernels choose cell by cell."""
        c = self._cutters.number(profile, 0.0)
        arc = None if isinstance(path, Line) or path.angle == 0.0 or path.radius == 0.0 else path
        a, b = path.start.tolist(), path.end.tolist()
        if lowest(path) + self._cutters.tops[c] < self.stock.high[2]:
            raise EngineError("the top of the tool dips below the stock", engine=self.name, block=block)
        if arc is None:
            self._row(straight_row(a, b, c, lambda wider: self._cutters.number(profile, wider)), block)
            return
        self._cutters.climb(profile, c, ASIDE if arc.axis == UPRIGHT else ANYWHERE)
        for piece in pieces(arc, float(self._cutters.head[c, 1])):
            self._row(arc_row(piece, c), block)

    def _row(self, values: list[float], block: int | None) -> None:
        if self._count == len(self._rows):
            self._rows = np.concatenate([self._rows, np.zeros_like(self._rows)])
        self._rows[self._count] = [*values, *[0.0] * (NUMBER - len(values)), self._made]
        self._made += 1
        self._blocks[self._count :] = [-1 if block is None else block]
        self._count += 1

    @property
    def _shapes(self) -> _kernels.Shapes:
        c = self._cutters
        return _kernels.Shapes(c.head, c.part, c.lift, c.ladder, self._rows, self.rules)

    def _round_stock(self) -> int:
        """Row of a plunge whose footprint is that of a round stock; -1 for a box."""
        low, high, radius, _ = self.stock
        if not radius:
            return -1
        disc = Profile([(radius, 0.0), (radius, 1.0)])
        c = self._cutters.number(disc, 0.0)
        x, y = (0.5 * (a + b) for a, b in zip(low[:2], high[:2], strict=True))
        self._rows[0, :10] = [x, y, low[2], 1.0, 0.0, 0.0, 0.0, c, c, low[2]]
        self._blocks, self._count, self._made = [-1], 1, 1
        return 0

    def _ready(self, k: int) -> Tiling:
        """The tiles, made by the cutter of sweep k if there were none."""
        if self._tiles is None:
            size = self.tile_mm or TILE_SHARE * float(self._cutters.head[int(self._rows[k, 7]), 1])
            self._tiles = Tiling.over(self.stock, size)
            if self._share.parts > 1:
                self._tiles.divide(self._share)
        return self._tiles

    # -- workpiece -----------------------------------------------------------------------------------------

    @property
    def volume(self) -> Interval:
        """Of the workpiece, mm^3: what the sum over the blocks and one look at all that is left allow together."""
        summed = (self.stock_volume - self._gone.bracket).at_least(0.0)
        if (
            self._tiles is None
            or len(self._tiles) > MOST_LOOKED
            or self._gone.width <= LEFT_WIDTH * self._gone.hi
        ):
            return summed
        if self._left is None:
            self._left = self._looked()
        return summed.within(self._left.lo, self._left.hi)

    def _looked(self) -> Removal:
        """All that is left: what a plunge wider than the stock would take."""
        (x0, y0, z0), (x1, y1, z1) = self.stock[:2]
        r = hypot(x1 - x0, y1 - y0)
        everything = Profile([(r, 0.0), (r, 2.0 * (z1 - z0))])
        x, y = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
        sweep = Sweep.along(everything, Line((x, y, z1), (x, y, z0)))
        gone = self._gone.estimate
        width, self.width = self.width, LEFT_WIDTH * gone / max(self.stock.volume - gone, gone)
        try:
            return self.touch(sweep)
        finally:
            self.width = width

    @property
    def _work(self) -> _kernels.Work:
        if not hasattr(ROOM, "work"):
            ROOM.work = _kernels.work()
        found: _kernels.Work = ROOM.work
        return found

    @property
    def last_cells(self) -> Floats:
        """(n, 6) centre and half sizes (mm), lower and upper bound (mm^3) of the cells that the last straight piece was
        divided into, before another workpiece is asked; those that became exact on the way are not among them."""
        return self._work.cell[: self._looked_at].copy()

    @property
    def is_cut(self) -> bool:
        """Whether any block has met the stock."""
        return self._tiles is not None

    def surface(self) -> StockSurface:
        """See `over_box`.

        Raises
        ------
        EngineError
            The top of the stock is not level.
        """
        if self.stock.mesh is not None:
            raise EngineError("only the surface of a box or a round bar", engine=self.name)
        return self.over_box()

    def over_box(self) -> StockSurface:
        """Heights over the box of the stock, or over a round bar, `PER_TILE` places along each edge of a tile that was cut;
        exact at these, straight between them, and upright walls where heights jump. See `shape`.

        Raises
        ------
        EngineError
            Nothing was cut.
        """
        if self._tiles is None:
            raise EngineError("only the surface of what was cut", engine=self.name)
        tiles, shapes = self._tiles.arrays, self._shapes
        bottom, top = self.stock.low[2], self.stock.high[2]
        busy = np.flatnonzero(tiles.first >= 0)
        if self._rim >= 0:
            busy = np.union1d(busy, self._tiles.on_circle(self.stock.radius))
        per = max(1, min(PER_TILE, int(np.sqrt(MOST_PLACES / max(len(busy), 1)))))

        def at(places: Floats) -> tuple[Floats, Ints]:
            z, owner = np.zeros(len(places)), np.zeros(len(places), dtype=np.int64)
            where, room = np.ascontiguousarray(places), self._work.lines.shape

            def some(first: int) -> None:
                part, lines = slice(first, first + TOGETHER), np.zeros(room)
                _kernels.heights(
                    shapes, tiles, lines, self._rim, bottom, top, where[part], z[part], owner[part]
                )

            list(threads.map(some, range(0, len(places), TOGETHER)))
            return z, owner

        lattice = lattice_of(tiles.grid, tiles.size, self.stock.high[:2], busy, per)
        with ThreadPoolExecutor(min(os.cpu_count() or 1, MOST_THREADS)) as threads:
            return solid_of(at, lattice, bottom, top, np.array([*self._blocks[: self._count], -1]))

    def save(self, path: Path) -> None:
        """See `Engine`."""
        self.packed().write(path)

    def packed(self) -> Saved:
        """Tiles and sweeps."""
        state = {
            "stock": list(self.stock[:3]), "width": self.width, "width_mm3": self.width_mm3, "tile_mm": self.tile_mm,
            "blocks": self._blocks[: self._count], "gone": list(self._gone[:4]), "made": self._made,
            "share": list(self._share),
        }  # fmt: skip
        arrays = self._cutters.packed()
        if self.stock.mesh is not None:
            arrays |= {"vertices": self.stock.mesh.vertices, "triangles": self.stock.mesh.triangles}
        tiles = {} if self._tiles is None else self._tiles.packed()
        return Saved(self.name, state, {"rows": self._rows[: self._count], **arrays, **tiles})

    @classmethod
    def load(cls, path: Path, *, share: Share = WHOLE) -> Self:
        """The workpiece that `save` wrote; with a `share` it cuts that part of the tiles only."""
        with opened(path, cls.name) as saved:
            return cls.unpacked(saved, share)

    @classmethod
    def unpacked(cls, saved: Saved, share: Share = WHOLE) -> Self:
        """What `packed` gave."""
        state, found = saved.state, saved.arrays
        low, high, radius = state["stock"]
        mesh = mesh_of(found["vertices"], found["triangles"]) if "vertices" in found else None
        engine = cls(
            FlatStock(tuple(low), tuple(high), radius, mesh), state["width"], state["width_mm3"],
            tile_mm=state["tile_mm"],
        )  # fmt: skip
        engine._cutters = CutterTable.unpacked(found)
        engine._take_rows(found["rows"])
        engine._blocks = state["blocks"]
        mine = share.part == 0 or state.get("share") == list(share)  # of a whole, the first has what is gone
        engine._gone = Removal(*state["gone"]) if mine else NOTHING
        engine._made, engine._share = int(state["made"]), share
        if "tiles_grid" in found:
            engine._tiles = Tiling.unpacked(engine.stock, found, len(found["rows"]))
            if share.parts > 1:
                engine._tiles.divide(share)
        return engine

    @classmethod
    def join(cls, shares: Iterable[Self]) -> Self:
        """One engine of those that cut all shares of one workpiece, in the order of their shares."""
        engines = list(shares)
        whole, tilings = engines[0], [e._tiles for e in engines if e._tiles is not None]
        whole._share = WHOLE
        whole._gone = whole._gone.plus(*(e._gone for e in engines[1:]))
        rows = np.concatenate([e._rows[: e._count] for e in engines])
        begins = np.cumsum([0, *(e._count for e in engines[:-1])]).tolist()
        blocks = np.concatenate([np.array(e._blocks[: e._count], dtype=np.int64) for e in engines])
        _, at, of = np.unique(rows[:, NUMBER], return_index=True, return_inverse=True)
        whole._take_rows(rows[at])
        whole._blocks = blocks[at].tolist()
        if tilings:
            numbers = [of[begin:] for begin in begins]
            whole._tiles = Tiling.join(whole.stock, tilings, numbers)
        return whole
