"""Second judges of a run: exact rays and certified columns beside the engine that cuts."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field

from vmachining.engines.columns import ColumnsEngine
from vmachining.engines.dexel import RayEngine
from vmachining.engines.judges import Judge
from vmachining.engines.protocol import NOTHING, Options, Removal
from vmachining.errors import EngineError, StockError
from vmachining.stock import Stock
from vmachining.sweep import Sweep
from vmachining.tolerance import WIDTH_MM3

WANT_REL, MOST = 1.5e-3, 20_000
"""Half the requested width, and rays of a set at most; four times as many rays where a block is disputed."""

JUDGED_WIDTH, PASSED_WIDTH = 1e-3, 0.5
"""Width that columns are asked for of a block that is judged, and of those before it, which only have to be known."""

JUDGED_MM3 = 1e-6
"""mm^3; a judged block is finished below this width, too: what a boolean itself may be off, see `gate.py`."""


def columns_say(
    stock: Stock, blocks: Sequence[Sequence[Sweep]], numbers: Collection[int], slacks: Sequence[float]
) -> dict[int, Judge]:
    """Brackets of 0.1 % by the columns engine, of the blocks up to the first sweep that it does not take.

    blocks : what every block sweeps. numbers : of the blocks that are judged. slacks : mm^3 per block, see `widened`.
    """
    found: dict[int, Judge] = {}
    try:
        engine = ColumnsEngine.of(stock, Options())
        for number, sweeps in enumerate(blocks):
            is_judged = number in numbers
            engine.width = JUDGED_WIDTH if is_judged else PASSED_WIDTH
            engine.width_mm3 = JUDGED_MM3 if is_judged else WIDTH_MM3
            total = NOTHING
            for sweep in sweeps:
                total = total.plus(engine.cut(sweep, number))
            if is_judged:
                found[number] = Judge(engine.name, widened(total, slacks[number]))
    except (StockError, EngineError):  # from here on the workpiece is not what columns know
        pass
    return found


def widened(removal: Removal, slack: float) -> Removal:
    """By what the triangles of a curved STEP stock can change of any volume, mm^3."""
    return Removal(max(0.0, removal.lo - slack), removal.estimate, removal.hi + slack, removal.proven)


@dataclass(slots=True, eq=False)
class RayWitness:
    """What exact rays say of any block; it travels to worker processes.

    stock : of the job. blocks : what every block sweeps. slacks : mm^3 per block, see `widened`.
    want_rel : half width of intervals asked for, relative. most : rays of a set at most, in a first look.
    """

    stock: Stock
    blocks: Sequence[Sequence[Sweep]]
    slacks: Sequence[float] = ()
    want_rel: float = WANT_REL
    most: int = MOST
    name: str = "dexel"
    _engine: RayEngine | None = field(default=None, repr=False)
    _members: list[list[int]] = field(default_factory=list, repr=False)

    def __call__(self, block: int, again: bool = False) -> Judge:
        """See `vmachining.engines.brep.removal.check.Witness`."""
        if self._engine is None:
            self._engine = RayEngine(self.stock, want_rel=self.want_rel, most=self.most)
            self._members = [
                [self._engine.add(sweep, k) for sweep in each] for k, each in enumerate(self.blocks)
            ]
        members = self._members[block]
        if not again:
            found = self._engine.removed(members, seed=block)
        else:
            found = self._engine.removed(
                members, seed=len(self.blocks) + block, want_rel=0.5 * self.want_rel, most=4 * MOST
            )
        return Judge(self.name, widened(found, self.slacks[block] if self.slacks else 0.0))
