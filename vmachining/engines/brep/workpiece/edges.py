"""Which parts of cutting edges lie in a workpiece of B-rep solids, asked of OCCT in a separate process.

The workpiece is not built: an edge at one rotation angle is a line, a circle or a spline, every member of the
workpiece (stock, earlier sweeps) is a valid solid by itself, and the parts of the curve inside each are sets of
intervals whose difference is the answer. No boolean of solids is asked, so none can lie.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from vmachining.arrays import Floats
from vmachining.engines.brep.process import WorkerLost, WorkerProcess
from vmachining.errors import EngineError, SweepError
from vmachining.stock import Blank
from vmachining.sweep import Stance, Sweep
from vmachining.tool import Edge, EdgeParts


@dataclass(slots=True, eq=False)
class BrepWorkpiece:
    """Stock minus earlier sweeps, as solids in another process; to be used in a `with` statement.

    stock : Blank. past : (code, sweep) in program order; the code goes to the ends that the sweep makes.
    stock_code : the code of the stock. seconds : limit of one question, and of building the solids.

    Raises SweepError: An earlier sweep has no B-rep solid; names its code.
    Raises EngineError: OCCT failed, crashed or took too long.
    """

    stock: Blank
    past: Sequence[tuple[int, Sweep]]
    stock_code: int = -1
    seconds: float = 120.0
    _worker: WorkerProcess | None = field(default=None, repr=False)

    def __enter__(self) -> BrepWorkpiece:
        past = list(self.past)
        try:
            self._worker = WorkerProcess(members, self.stock, past, self.stock_code, seconds=self.seconds)
        except SweepError as exc:
            raise SweepError(exc.message, remedy="take method dexel") from exc
        except (WorkerLost, OSError) as exc:
            raise EngineError(f"no worker process: {exc}", engine="brep") from exc
        return self

    def __exit__(self, *_: object) -> None:
        if self._worker is not None:
            self._worker.close()
            self._worker = None

    def holds(self, edge: Edge, stance: Stance, phi: Floats, parts: EdgeParts) -> EdgeParts:
        """The parts inside the workpiece; row r of `parts` stands at phi[r]."""
        if not len(parts.row):
            return parts
        if self._worker is None:
            raise EngineError("the process of the solids is not running", engine="brep")
        try:
            (answer,) = self._worker.ask(edge, stance, phi, parts, seconds=self.seconds)
        except WorkerLost as exc:
            raise EngineError(str(exc), engine="brep") from exc
        assert isinstance(answer, EdgeParts)
        return answer


def members(stock: Blank, past: Sequence[tuple[int, Sweep]], stock_code: int) -> Callable[..., Any]:
    """What answers there."""
    from vmachining.engines.brep.workpiece.members import Members  # OCCT takes seconds to load

    known = Members(stock, past, stock_code)
    return lambda *question: [known.holds(*question)]
