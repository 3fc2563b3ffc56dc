"""The mesh engine: removed volume of every block with a bracket that contains the truth.

One workpiece whose errors are bounded in advance, or (`certify`) two that hold the truth between them; both are
in `removal.py`, tile by tile. The estimate of the workpiece is the stock without the estimates of all blocks.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import suppress
from math import hypot
from pathlib import Path
from typing import NamedTuple

import numpy as np
from manifold3d import Manifold, OpType

from vmachining.arrays import Floats
from vmachining.engines.mesh.ahead import ahead
from vmachining.engines.mesh.checkpoint import read_tiles, write_tiles
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.removal import AIR, Cut, Start, cut_once, cut_twice, shared
from vmachining.engines.mesh.solids import checked, cutters, facets, is_ring, shape_key
from vmachining.engines.mesh.stock import StockMesh
from vmachining.engines.mesh.tiles import SIDES, Tile, joined, reached
from vmachining.engines.protocol import WHOLE, Options, Removal, Share, StockSurface
from vmachining.errors import EngineError
from vmachining.geometry import Arc, Bracket, Line
from vmachining.stock import Stock
from vmachining.sweep import Sweep, Turn
from vmachining.tolerance import CHORD_MM, VOLUME_REL
from vmachining.tool import Profile

__all__ = ["MeshEngine"]

MARGIN_CHORDS = 2.0
"""The stock may be a chord too large and the part 2/3 chord (facets of circle and meridian); 2 > 5/3."""

SAME_HEADING = 1e-12
"""Largest difference of unit vectors that are the same heading."""


class MeshEngine:
    """Workpiece of one job, cut block by block.

    Parameters
    ----------
    stock : StockMesh
        Closed solid, see `box_stock`, `cylinder_stock`, `stl_stock`, `mesh_stock`.
    chord : float
        mm, about the largest distance between inner and outer sweep.
    tile_mm : float or None
        Largest tile that a sweep works on; None chooses from the cutter.
    certify : bool
        Two workpieces instead of bounds in advance: more than twice as slow. Needed where the tool turns.
    """

    name = "mesh"

    def __init__(
        self,
        stock: StockMesh,
        chord: float = CHORD_MM,
        *,
        tile_mm: float | None = None,
        certify: bool = False,
    ) -> None:
        if not (np.isfinite(chord) and chord > 0.0):
            raise EngineError(f"chord {chord} mm is not positive", engine=self.name)
        self.chord = float(chord)
        self.tile_mm = tile_mm
        self.certify = certify
        self._share = WHOLE
        self._blocks: dict[int, int] = {}
        self._stand: Stand | None = None
        self._cuts = 0
        solids = {side: stock.solids[side] for side in SIDES}
        root = Tile.of(solids, self.chord)
        if root is None:
            raise EngineError("the stock is empty", engine=self.name)
        root.has_means = solids[Side.INNER] is solids[Side.OUTER]
        self._root = root
        self._gone = 0.0
        self.stock_volume = _bracket(root.volumes[Side.INNER], root.volumes[Side.OUTER])

    @classmethod
    def of(cls, stock: Stock, options: Options) -> MeshEngine:
        """See `Engine`."""
        return cls(StockMesh.of(stock, options.chord), options.chord, certify=options.certify)

    @classmethod
    def takes(cls, sweep: Sweep) -> bool:
        """See `Engine`: every sweep."""
        return True

    @property
    def proof(self) -> str:
        """See `Engine`."""
        return "two workpieces" if self.certify else "bounds in advance"

    # -- cutting -------------------------------------------------------------------------------------------

    def cut(self, sweep: Sweep, block: int | None = None) -> Removal:
        """Remove the sweep from the workpiece; mm^3 removed, exactly 0 in air.

        Raises
        ------
        EngineError
            A solid came back broken, or the tool leans or turns and the engine keeps one workpiece only; names
            the block.
        """
        if isinstance(sweep.path, Turn) and not self.certify:
            raise EngineError(
                "a tool that leans or turns has no bound in advance: make the engine with certify=True",
                engine=self.name,
                block=block,
            )
        start, stand = self._started(sweep)
        bounds = np.array(sweep.bounds)
        inner = facets(sweep.profile, self.chord, Side.INNER)
        tiles = reached(self._root, self._box(sweep), self._tile_size(sweep), self._share)
        free = start is not Start.FRESH and not self.certify and len(tiles) > 0
        front = ahead(sweep, inner) if free else None
        cut = Cut(sweep, self.chord, self._cuts, start, self._run_id(block), bounds, front)
        self._cuts += 1
        total = AIR
        for tile in tiles:
            try:
                total = total.plus(cut_twice(tile, cut) if self.certify else cut_once(tile, cut))
            except EngineError as error:
                raise EngineError(error.reason, engine=self.name, block=block) from error
        lo, estimate, hi = total
        removed = Removal(lo, min(max(estimate, lo), hi), hi)
        self._stand = stand
        self._gone += removed.estimate
        return removed

    def _started(self, sweep: Sweep) -> tuple[Start, Stand]:
        """What was removed where the sweep starts, and how things are where it ends."""
        path, shape, last = sweep.path, shape_key(sweep.profile), self._stand
        begin = _pose(sweep, at_end=False)
        stand = Stand(shape, _pose(sweep, at_end=True), _heading(sweep), True)
        if last is None or last.shape != shape:
            return Start.FRESH, stand
        far = 1e-12 * (1.0 + max(map(abs, begin)))
        if any(abs(a - b) > far for a, b in zip(last.pose, begin, strict=True)):
            return Start.FRESH, stand
        if not isinstance(path, Line) or last.heading is None:
            return Start.CHAINED, stand
        if _are_equal(
            last.heading, stand.heading
        ):  # the second block after a turn is not shed, and cleans up
            return Start.CLEAN if last.whole else Start.CHAINED, stand
        if path.start[2] == path.end[2]:
            return Start.SHED, stand._replace(whole=False)
        return Start.CHAINED, stand

    def touch(self, sweep: Sweep, within: float | None = None) -> Removal:
        """See `Engine`. lo is 0 where nothing deeper than two chords is touched, and the estimate elsewhere."""
        chord = max(self.chord, within or 0.0)
        volume = self._touched(sweep, chord)
        deep = volume > 0.0 and any(
            self._touched(Sweep.along(core, sweep.path), chord) > 0.0
            for core in smaller(sweep.profile, MARGIN_CHORDS * chord)
        )
        return Removal(volume if deep else 0.0, volume, volume, proven=False)

    def _touched(self, sweep: Sweep, chord: float) -> float:
        """mm^3 of the workpiece that lie in the sweep, by facets of `chord`."""
        tool = facets(sweep.profile, chord, Side.FAIR)
        total = 0.0
        for tile in reached(self._root, self._box(sweep), None, self._share):
            solid, noise = tile.solids[Side.INNER], VOLUME_REL * (1.0 + tile.volumes[Side.INNER])
            volume = shared(solid, cutters(sweep, tool, tile.window))
            if volume > noise:
                total += volume
        return total

    def _box(self, sweep: Sweep) -> Floats:
        """Box of the sweep, wide enough for its outer facets."""
        box = np.array(sweep.bounds)
        return box + [[-self.chord], [self.chord]]

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

    # -- workpiece -----------------------------------------------------------------------------------------

    @property
    def volume(self) -> Bracket:
        """Volume of the workpiece, mm^3."""
        inner = outer = 0.0
        for tile in self._root.leaves():
            inner += tile.volumes[Side.INNER]
            outer += tile.volumes[Side.OUTER] - tile.hidden
        left = self.stock_volume.estimate - self._gone
        return Bracket(outer, min(max(left, outer), inner), inner)

    def surface(self) -> StockSurface:
        """Triangles of the workpiece, tiles joined, with the block that cut each (-1: raw stock).

        Not simplified: collapsing short edges was seen to move a wall by more than its tolerance.
        """
        mesh = self.whole().to_mesh64()
        ends = np.array(mesh.run_index, dtype=np.uint64).astype(np.int64) // 3
        owner = [self._blocks.get(int(run), -1) for run in mesh.run_original_id]
        # a vertex stands once for every run that meets there: one each for the file formats
        to = np.arange(len(mesh.vert_properties))
        to[np.array(mesh.merge_from_vert, dtype=np.int64)] = np.array(mesh.merge_to_vert, dtype=np.int64)
        kept, triangles = np.unique(to[np.array(mesh.tri_verts, dtype=np.int64)], return_inverse=True)
        return StockSurface(
            np.array(mesh.vert_properties)[kept, :3],
            triangles.reshape(-1, 3).astype(np.int64),
            np.repeat(np.array(owner, dtype=np.int64), ends[1:] - ends[:-1]),
        )

    def whole(self) -> Manifold:
        """The workpiece (inner-cut) as one solid, tiles joined."""
        return checked(
            Manifold.batch_boolean([t.solids[Side.INNER] for t in self._root.leaves()], OpType.Add)
        )

    def save(self, path: Path) -> None:
        """Write the workpiece and what is needed to go on with the next block (`.npz`)."""
        state = {
            "chord": self.chord,
            "tile_mm": self.tile_mm,
            "certify": self.certify,
            "stock": list(self.stock_volume),
            "gone": self._gone,
            "stand": list(self._stand) if self._stand is not None else None,
            "cuts": self._cuts,
        }
        write_tiles(path, self._root, self._blocks, state)

    @classmethod
    def load(cls, path: Path, *, share: Share = WHOLE) -> MeshEngine:
        """The engine that `save` wrote; with a `share` it cuts that part of the tiles only.

        Raises
        ------
        EngineError
            The file cannot be read or is damaged.
        """
        engine = cls.__new__(cls)
        engine._share = share
        if share.parts > 1:
            use_one_thread()
        try:
            engine._root, engine._blocks, state = read_tiles(path)
            engine.chord, engine.tile_mm, engine.certify = state["chord"], state["tile_mm"], state["certify"]
            engine.stock_volume = Bracket(*state["stock"])
            engine._gone = state["gone"] if engine._share.part == 0 else 0.0
            engine._cuts = state["cuts"]
            engine._stand = Stand(*state["stand"]) if state["stand"] is not None else None
        except KeyError as error:
            raise EngineError(f"checkpoint {path} lacks {error}", engine=cls.name) from error
        return engine

    @classmethod
    def join(cls, engines: Sequence[MeshEngine]) -> MeshEngine:
        """One engine of those that cut all shares of one workpiece, in the order of their shares."""
        engine = engines[0]
        engine._root, engine._share = joined([each._root for each in engines]), WHOLE
        for each in engines[1:]:
            engine._blocks |= each._blocks
            engine._gone += each._gone
        return engine


def smaller(profile: Profile, margin: float) -> tuple[Profile, ...]:
    """Convex pieces of a body, each shrunk so that its surface lies at least `margin` (mm) inside.

    Each is scaled about a point of its axis, which keeps arcs circular; a convex body holds its scaled self.
    A piece thinner than the margin disappears.
    """
    out = []
    for piece in profile.convex_pieces():
        height = piece.z_max - piece.z_min
        anchor = piece.z_min + min(piece.max_radius, height / 2)
        reach = min(piece.max_radius, anchor - piece.z_min)
        if reach <= margin:
            continue
        out.append(piece.shifted(-anchor).scaled(1.0 - margin / reach).shifted(anchor))
    return tuple(out)


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
    """How the last cut left the place where it ended.

    shape : of the cutter. pose : six numbers, tip and axis. heading : of the facets of its mesh there, [] of one
    that has none, None of one that is narrowed. whole : all of that mesh is removed; else what lies deep in it.
    """

    shape: str
    pose: list[float]
    heading: list[float] | None
    whole: bool


def _heading(sweep: Sweep) -> list[float] | None:
    """See `Stand`; of straight and of level paths."""
    path = sweep.path
    if isinstance(path, Turn) or (isinstance(path, Arc) and not is_ring(path)):
        return None
    x, y, _ = (path.end - path.start if isinstance(path, Line) else path.velocity(1.0)).tolist()
    level = hypot(x, y)
    return [x / level, y / level] if level > 0.0 else []


def _are_equal(one: list[float], other: list[float] | None) -> bool:
    """Headings that differ by so little that two meshes of a cutter differ by less than rounding hides."""
    return (
        other is not None
        and len(one) == len(other)
        and all(abs(a - b) <= SAME_HEADING for a, b in zip(one, other, strict=True))
    )


def _pose(sweep: Sweep, *, at_end: bool) -> list[float]:
    """Six numbers, tip and tool axis."""
    path = sweep.path
    axis = path.axis(float(at_end)).tolist() if isinstance(path, Turn) else [0.0, 0.0, 1.0]
    return [*(path.end if at_end else path.start).tolist(), *axis]


def _bracket(inner_cut: float, outer_cut: float) -> Bracket:
    """Volume of a raw workpiece between its two meshes."""
    return Bracket(outer_cut, (inner_cut + 2.0 * outer_cut) / 3.0, inner_cut)
