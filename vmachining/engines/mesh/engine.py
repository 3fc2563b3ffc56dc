"""The mesh engine: removed volume of every block with a bracket that contains the truth.

Per block with sweep W and workpiece S, and per tile, with A the workpiece cut by inner sweeps so far and B the
one cut by outer sweeps:

    hi = vol(A and W_outer)      the most that can be left, cut by the most that can cut
    lo = vol(B and W_inner)      the least by the least
    estimate = (vol(A and W_inner) + 2 vol(B and W_outer)) / 3

W_inner < W < W_outer for every block, so B < S < A by induction, hence lo <= truth <= hi. Both volumes of the
estimate lie between lo and hi too. Their weights cancel the error of a facet: on an arc of radius R an inner
facet of angle D lacks R^2 D^3/12, an outer one has R^2 D^3/24 too much, and the weighted error vanishes for
every whole facet, to fourth order in D. A and B change by exactly what the estimate counts, so estimates add
up to the change of (A + 2 B) / 3, whatever the order of the blocks.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from manifold3d import Manifold, OpType

from vmachining.arrays import Floats
from vmachining.engines.mesh.checkpoint import read_tiles, write_tiles
from vmachining.engines.mesh.facets import Side
from vmachining.engines.mesh.solids import Facets, checked, cutters, facets, shape_key
from vmachining.engines.mesh.stock import StockMesh, StockSurface
from vmachining.engines.mesh.tiles import SIDES, Tile, reached
from vmachining.errors import EngineError
from vmachining.geometry import Bracket
from vmachining.sweep import Sweep
from vmachining.tolerance import CHORD_MM, VOLUME_REL

__all__ = ["MeshEngine"]

AIR = Bracket(0.0, 0.0, 0.0)


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
    """

    name = "mesh"

    def __init__(self, stock: StockMesh, chord: float = CHORD_MM, *, tile_mm: float | None = None) -> None:
        if not (np.isfinite(chord) and chord > 0.0):
            raise EngineError(f"chord {chord} mm is not positive", engine=self.name)
        self.chord = float(chord)
        self.tile_mm = tile_mm
        self._blocks: dict[int, int] = {}
        self._removed: tuple[str, list[float]] | None = None
        solids = {side: stock.solids[side] for side in SIDES}
        root = Tile.of(solids)
        if root is None:
            raise EngineError("the stock is empty", engine=self.name)
        self._root = root
        self.stock_volume = _bracket(root.volumes[Side.INNER], root.volumes[Side.OUTER])

    # -- cutting -------------------------------------------------------------------------------------------

    def cut(self, sweep: Sweep, block: int | None = None) -> Bracket:
        """Remove the sweep from the workpiece; mm^3 removed, exactly 0 in air.

        Raises
        ------
        EngineError
            A solid came back broken; names the block.
        """
        run = self._run_id(block)
        chained = self._chained(sweep)
        tools = {side: facets(sweep.profile, self.chord, side) for side in SIDES}
        total = AIR
        for tile in reached(self._root, self._box(sweep), self._tile_size(sweep)):
            try:
                total = total.plus(self._cut_tile(tile, sweep, tools, chained, run))
            except EngineError as error:
                raise EngineError(str(error), engine=self.name, block=block) from error
        self._removed = shape_key(sweep.profile), sweep.path.position(1.0).tolist()
        return total

    def _chained(self, sweep: Sweep) -> bool:
        """Whether the last sweep ended with this cutter at this start: then it is already cut free there."""
        if self._removed is None or self._removed[0] != shape_key(sweep.profile):
            return False
        start = sweep.path.start
        gap = np.abs(np.array(self._removed[1]) - start).max()
        return bool(gap <= 1e-12 * (1.0 + np.abs(start).max()))

    def touch(self, sweep: Sweep) -> float:
        """Volume (mm^3, estimate) that the sweep would remove; the workpiece stays as it is."""
        tool = facets(sweep.profile, self.chord, Side.FAIR)
        total = 0.0
        for tile in reached(self._root, self._box(sweep), self._tile_size(sweep)):
            before = tile.volumes[Side.INNER]
            rest = self._minus(tile.solids[Side.INNER], cutters(sweep, tool, tile.window))
            if rest is not None and before - rest.volume() > VOLUME_REL * (1.0 + before):
                total += before - float(rest.volume())
        return total

    def _cut_tile(
        self, tile: Tile, sweep: Sweep, tools: dict[Side, Facets], chained: bool, run: int | None
    ) -> Bracket:
        def solids(side: Side) -> list[Manifold]:
            return cutters(sweep, tools[side], tile.window, chained=chained, block_id=run)

        outer = solids(Side.OUTER)
        if not outer:
            return AIR
        largest = tile.volumes[Side.INNER]
        noise = VOLUME_REL * (1.0 + largest)
        hi_rest = self._minus(tile.solids[Side.INNER], outer)
        hi = largest - float(hi_rest.volume()) if hi_rest is not None else 0.0
        if hi <= noise:  # rounding, not metal: leave the tile as it is, exactly
            return AIR
        inner = solids(Side.INNER)
        least = tile.volumes[Side.OUTER]
        lo_rest = self._minus(tile.solids[Side.OUTER], inner)
        lo = least - float(lo_rest.volume()) if lo_rest is not None else 0.0
        removed = dict.fromkeys(SIDES, 0.0)
        fresh = tile.solids[Side.OUTER] is tile.solids[Side.INNER]
        for side, other, cutter in ((Side.OUTER, hi_rest, outer), (Side.INNER, lo_rest, inner)):
            rest = other if fresh else self._minus(tile.solids[side], cutter)
            if rest is None:
                continue
            before = tile.volumes[side]
            loss = before - float(rest.volume())
            if loss > noise:
                removed[side] = loss
                tile.put(side, rest)
        estimate = (removed[Side.INNER] + 2.0 * removed[Side.OUTER]) / 3.0
        return Bracket(max(0.0, min(lo - noise, estimate)), estimate, max(hi + noise, estimate))

    def _minus(self, solid: Manifold, cutters: list[Manifold]) -> Manifold | None:
        """The solid without the cutters; None if there is nothing to do."""
        if not cutters or solid.is_empty():
            return None
        for cutter in cutters:
            solid = solid - cutter
        return checked(solid)

    def _box(self, sweep: Sweep) -> Floats:
        """Box of the sweep, wide enough for its outer facets."""
        box = np.array(sweep.bounds)
        return box + [[-self.chord], [self.chord]]

    def _tile_size(self, sweep: Sweep) -> float:
        return self.tile_mm or max(2.0, 1.2 * sweep.profile.max_radius)

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
            outer += tile.volumes[Side.OUTER]
        return _bracket(inner, outer)

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
            "stock": list(self.stock_volume),
            "removed": list(self._removed) if self._removed is not None else None,
        }
        write_tiles(path, self._root, self._blocks, state)

    @classmethod
    def load(cls, path: Path) -> MeshEngine:
        """The engine that `save` wrote.

        Raises
        ------
        EngineError
            The file cannot be read or is damaged.
        """
        engine = cls.__new__(cls)
        engine._root, engine._blocks, state = read_tiles(path)
        engine.chord, engine.tile_mm = state["chord"], state["tile_mm"]
        engine.stock_volume = Bracket(*state["stock"])
        removed = state["removed"]
        engine._removed = (removed[0], removed[1]) if removed is not None else None
        return engine


def _bracket(inner_cut: float, outer_cut: float) -> Bracket:
    """Volume of a workpiece between its two meshes."""
    return Bracket(outer_cut, (inner_cut + 2.0 * outer_cut) / 3.0, inner_cut)
