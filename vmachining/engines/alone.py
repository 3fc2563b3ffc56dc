"""Blocks of one program asked by themselves, in any order: nothing before them is cut.

What block N removes is its sweep without those before it, so only those whose boxes meet its own are of interest, and
only where it goes: columns enter them into the tiles that N reaches, without looking how much each takes, and then
cut N there. Where N or one of these leans or turns, columns in any direction answer, which need no more than the list of them.
Where N or one of these is nothing for columns, the mesh engine cuts them all, which takes as long as that takes.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vmachining.arrays import Bools
from vmachining.engines.columns import ColumnsEngine
from vmachining.engines.columns.goal import judged
from vmachining.engines.columns.turning import Rows, rows_of
from vmachining.engines.mesh import MeshEngine
from vmachining.engines.protocol import NOTHING, Options, Removal
from vmachining.engines.relay import other_taker, upright_taker
from vmachining.stock import Stock
from vmachining.sweep import Sweep


class Alone:
    """The blocks of one program.

    stock : Stock, raw.
    blocks : what each sweeps, in the order that they run.
    options : Options, requested width; chord of the mesh engine.
    """

    def __init__(self, stock: Stock, blocks: Sequence[Sequence[Sweep]], options: Options) -> None:
        self.stock, self.blocks, self.options = stock, blocks, options
        self._block = np.repeat(np.arange(len(blocks)), [len(sweeps) for sweeps in blocks])
        self._sweeps = [sweep for sweeps in blocks for sweep in sweeps]
        boxes = np.array([sweep.bounds for sweep in self._sweeps]).reshape(-1, 2, 3)
        self._low, self._high = boxes[:, 0], boxes[:, 1]
        self._upright, self._anyway = upright_taker(stock, options), other_taker(stock, options)
        self._columns: dict[float, ColumnsEngine] = {}

    def meeting(self, block: int) -> list[int]:
        """Positions of the earlier sweeps whose boxes meet one of the block's own within the stock."""
        low, high = self.stock.bounds
        found: Bools = np.zeros(len(self._sweeps), dtype=np.bool_)
        for a, b in (sweep.bounds for sweep in self.blocks[block]):
            a, b = np.maximum(a, low), np.minimum(b, high)
            if (a < b).all():
                found |= ((self._low < b) & (self._high > a)).all(axis=1)
        return np.flatnonzero(found & (self._block < block)).tolist()

    def removed(self, block: int) -> Removal:
        """Bracket of what one block removes; its engine is named, and the note says why it is mesh or why it is wide.

        Raises EngineError: The kernel of the mesh engine failed.
        """
        own, before = self.blocks[block], self.meeting(block)
        earlier = [(self._sweeps[k], int(self._block[k])) for k in before]
        upright = self._upright
        if upright is None or not all(
            upright.accepts(sweep) for sweep in (*own, *(sweep for sweep, _ in earlier))
        ):
            anyway = self._anyway
            if anyway is None or not all(map(anyway.takes, own)):
                return self._by_mesh(earlier, block, "columns cannot compute this block")
            foreign = [number for sweep, number in earlier if not anyway.takes(sweep)]
            if foreign:
                return self._by_mesh(
                    earlier, block, f"columns cannot compute block {foreign[0]}, which it meets"
                )
            parts = [rows_of(sweep) for sweep in own]
            rows = [rows_of(sweep) for sweep, _ in earlier]
            found = anyway.cut(Rows.join(parts), Rows.join(rows) if rows else None) if parts else NOTHING
            return judged(found, anyway.width, anyway.width_mm3)._replace(engine=ColumnsEngine.name)
        found = NOTHING
        edge = min((sweep.profile.max_radius for sweep in own), default=1.0)
        engine = self._columns.get(edge)
        if engine is None:
            engine = self._columns[edge] = ColumnsEngine.of(self.stock, self.options)
        if own:
            boxes = np.array([sweep.bounds for sweep in own])
            engine.look_at(np.array([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)]), edge)
        for sweep, number in earlier:
            engine.enter(sweep, number)
        for sweep in own:
            found = found.plus(engine.cut(sweep, block))
        return found._replace(engine=ColumnsEngine.name)

    def _by_mesh(self, earlier: Sequence[tuple[Sweep, int]], block: int, why: str) -> Removal:
        engine = MeshEngine.of(self.stock, self.options)
        for sweep, number in earlier:
            engine.cut(sweep, number)
        found = NOTHING.plus(*(engine.cut(sweep, block) for sweep in self.blocks[block]))
        return found._replace(engine=MeshEngine.name, note=f"by the mesh engine: {why}")
