"""The mesh engine: removed volume of every block with a bracket that contains the truth.

Two workpieces hold the true one between them, see `removal.py`. The estimate of the workpiece is the stock without
the estimates of all blocks.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np
from manifold3d import Manifold, OpType

from vmachining.arrays import Floats, Ints
from vmachining.checkpoint import Saved, opened
from vmachining.engines.boxes import Boxes
from vmachining.engines.mesh.checkpoint import packed_tiles, tiles_of
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.removal import Cut, cut, touch
from vmachining.engines.mesh.solids import checked
from vmachining.engines.mesh.stock import StockMesh, surface_of
from vmachining.engines.mesh.straight import shape_key
from vmachining.engines.mesh.tiles import SIDES, Tile, joined, reached
from vmachining.engines.packed import bracket_of, packed_bracket
from vmachining.engines.protocol import NOTHING, WHOLE, Options, Removal, Share, StockSurface
from vmachining.errors import EngineError
from vmachining.interval import Interval
from vmachining.stock import Stock
from vmachining.sweep import Sweep, Turn
from vmachining.tolerance import CHORD_MM


class MeshEngine:
    """Workpiece of one job, cut block by block.

    stock : StockMesh, closed solid, see `StockMesh.of`, `box_stock`.
    chord : float, mm, about the largest distance between inner and outer sweep.
    tile_mm : float or None
        Largest tile that a sweep works on; None chooses from the cutter.
    """

    name = "mesh"

    def __init__(self, stock: StockMesh, chord: float = CHORD_MM, *, tile_mm: float | None = None) -> None:
        if not (np.isfinite(chord) and chord > 0.0):
            raise EngineError(f"chord {chord} mm is not positive", engine=self.name)
        self.chord = float(chord)
        self.tile_mm = tile_mm
        self._share = WHOLE
        self._blocks: dict[int, int] = {}
        self._doubted = Boxes()
        self._stand: Stand | None = None
        solids = {side: stock.solids[side] for side in SIDES}
        root = Tile.of(solids)
        if root is None:
            raise EngineError("the stock is empty", engine=self.name)
        self._root, self._gone = root, 0.0
        self.stock_volume = _bracket(root.volumes[Side.INNER], root.volumes[Side.OUTER])

    @classmethod
    def of(cls, stock: Stock, options: Options) -> MeshEngine:
        """See `Engine`."""
        engine = cls(StockMesh.of(stock, options.chord), options.chord)
        if stock.slack_near(np.array(stock.bounds)) > 0.0:  # triangles on both sides of curved faces
            engine.stock_volume = engine.stock_volume.stated()
        return engine

    @classmethod
    def takes(cls, sweep: Sweep) -> bool:
        """See `Engine`: every sweep."""
        return True

    # -- cutting -------------------------------------------------------------------------------------------

    def cut(self, sweep: Sweep, block: int | None = None) -> Removal:
        """See `Engine`."""
        stand = Stand(shape_key(sweep.profile), _pose(sweep, at_end=True))
        work = Cut(sweep, self.chord, self._is_chained(sweep), self._run_id(block))
        try:
            removed = self._each(sweep, self._tile_size(sweep), lambda tile: cut(tile, work))
        except EngineError as error:
            raise EngineError(error.reason, engine=self.name, block=block) from error
        self._stand = stand
        self._gone += removed.estimate
        doubted = not removed.proven
        removed = self._judged(removed, sweep)
        if doubted:
            self._doubted.add(self._box(sweep))
        return removed

    def touch(self, sweep: Sweep, within: float | None = None) -> Removal:
        """See `Engine`."""
        work = Cut(sweep, max(self.chord, within or 0.0))
        return self._judged(self._each(sweep, None, lambda tile: touch(tile, work)), sweep)

    def _judged(self, removed: Removal, sweep: Sweep) -> Removal:
        """Not proven either where a sweep that is not has been: both workpieces may lack what they should hold there."""
        if removed.proven and self._doubted.meeting(self._box(sweep), 3).any():
            return removed._replace(proven=False)
        return removed

    def _each(self, sweep: Sweep, size: float | None, done: Callable[[Tile], Removal]) -> Removal:
        """The sum over the tiles of our share that a sweep can reach, see `reached`."""
        total = NOTHING
        for tile in reached(self._root, self._box(sweep), size, self._share):
            total = total.plus(done(tile))
        return total

    def _is_chained(self, sweep: Sweep) -> bool:
        """Whether the cutter where the sweep starts is where the last cut has left it."""
        last, begin = self._stand, _pose(sweep, at_end=False)
        if last is None or last.shape != shape_key(sweep.profile):
            return False
        far = 1e-12 * (1.0 + max(map(abs, begin)))
        return all(abs(a - b) <= far for a, b in zip(last.pose, begin, strict=True))

    def _box(self, sweep: Sweep) -> Floats:
        """Box of the sweep, wide enough for its outer facets."""
        return np.array(sweep.bounds) + [[-self.chord], [self.chord]]

    def _tile_size(self, sweep: Sweep) -> float:
        if self.tile_mm is not None:
            return self.tile_mm
        profile = sweep.profile
        if isinstance(sweep.path, Turn):  # a leaning cutter meets many columns, each with a mesh of its slice
            return max(8.0, 0.5 * (profile.z_max - profile.z_min))
        return max(2.0, 1.6 * profile.max_radius)

    def _run_id(self, block: int | None) -> int | None:
        if block is None:
            return None
        run = int(Manifold.reserve_ids(1))
        self._blocks[run] = block
        return run

    @property
    def proof(self) -> str:
        """See `Engine`."""
        if not len(self._doubted):
            return "two workpieces"
        return (
            f"two workpieces; not proven for {len(self._doubted)} cuts that turn too far for hulls of their poses, "
            "and for what meets them"
        )

    # -- workpiece -----------------------------------------------------------------------------------------

    @property
    def volume(self) -> Interval:
        """Volume of the workpiece, mm^3."""
        inner = outer = 0.0
        for tile in self._root.leaves():
            inner += tile.volumes[Side.INNER]
            outer += tile.volumes[Side.OUTER]
        left = self.stock_volume.estimate - self._gone
        proven = self.stock_volume.proven and not len(self._doubted)
        return Interval(outer, min(max(left, outer), inner), inner, proven)

    def surface(self) -> StockSurface:
        """Triangles of the workpiece, tiles joined, with the block that cut each (-1: raw stock).

        Not simplified: collapsing short edges was seen to move a wall by more than its tolerance.
        """
        return surface_of(self.whole(), self._blocks)

    def whole(self) -> Manifold:
        """The workpiece (inner-cut) as one solid, tiles joined."""
        leaves = [tile.solids[Side.INNER] for tile in self._root.leaves()]
        return checked(Manifold.batch_boolean(leaves, OpType.Add))

    def save(self, path: Path) -> None:
        """See `Engine`."""
        self.packed().write(path)

    def packed(self) -> Saved:
        """The workpiece and what is needed to continue with the next block."""
        nodes, arrays = packed_tiles(self._root, self._blocks)
        state = {
            "chord": self.chord, "tile_mm": self.tile_mm, "stock": packed_bracket(self.stock_volume), "gone": self._gone,
            "stand": list(self._stand) if self._stand is not None else None, "doubted": self._doubted.rows.tolist(),
            "nodes": nodes,
        }  # fmt: skip
        return Saved(self.name, state, arrays, deflated=True)

    @classmethod
    def load(cls, path: Path, *, share: Share = WHOLE) -> MeshEngine:
        """The engine that `save` wrote; with a `share` it cuts that part of the tiles only.

        Raises EngineError: The file cannot be read or is damaged.
        """
        with opened(path, cls.name) as saved:
            return cls.unpacked(saved, share)

    @classmethod
    def unpacked(cls, saved: Saved, share: Share = WHOLE) -> MeshEngine:
        """What `packed` gave."""
        engine, state = cls.__new__(cls), saved.state
        engine._root, engine._blocks = tiles_of(state["nodes"], saved.arrays)
        engine.chord, engine.tile_mm = state["chord"], state["tile_mm"]
        engine.stock_volume = bracket_of(state["stock"])
        engine._gone = state["gone"]
        engine._doubted = Boxes(np.array(state["doubted"]).reshape(-1, 2, 3))
        engine._stand = Stand(*state["stand"]) if state["stand"] is not None else None
        engine.take(share)
        return engine

    def take(self, share: Share) -> None:
        """From now on cut that part of the tiles only."""
        self._share = share
        if share.parts > 1:
            use_one_thread()
        if share.part > 0:
            self._gone = 0.0

    def in_use(self) -> None:
        """See `Divisible`: sweeps are not kept."""

    def forget_others(self, blocks: Ints) -> None:
        """See `Divisible`."""

    def summed(self, parts: Sequence[Removal]) -> Removal:
        """See `Divisible`."""
        return parts[0].plus(*parts[1:])

    @classmethod
    def join(cls, engines: Iterable[MeshEngine]) -> MeshEngine:
        """One engine of those that cut all shares of one workpiece, in the order of their shares."""
        engine, *others = engines
        engine._root, engine._share = joined([each._root for each in (engine, *others)]), WHOLE
        for each in others:
            engine._blocks |= each._blocks
            engine._gone += each._gone
        return engine


def use_one_thread() -> None:
    """Keep manifold3d from starting threads in this process: the other cores belong to those who cut other parts.

    It asks once, at its first boolean, on how many cores it may run; two processes with two threads each were
    measured to spend half as much again on waiting for each other.
    """
    if not hasattr(os, "sched_setaffinity"):
        return
    cores = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(cores)})
        (Manifold.cube() - Manifold.cube((0.5, 0.5, 0.5))).num_tri()
    except OSError:  # a system that does not let its processes choose
        return
    finally:
        with suppress(OSError):
            os.sched_setaffinity(0, cores)


class Stand(NamedTuple):
    """Where the last cut ended. shape : of the cutter. pose : six numbers, tip and axis."""

    shape: str
    pose: list[float]


def _pose(sweep: Sweep, *, at_end: bool) -> list[float]:
    """Six numbers, tip and tool axis."""
    path = sweep.path
    axis = path.axis(float(at_end)).tolist() if isinstance(path, Turn) else [0.0, 0.0, 1.0]
    return [*(path.end if at_end else path.start).tolist(), *axis]


def _bracket(inner_cut: float, outer_cut: float) -> Interval:
    """Volume of a raw workpiece between its two meshes."""
    return Interval(outer_cut, (inner_cut + 2.0 * outer_cut) / 3.0, inner_cut)
