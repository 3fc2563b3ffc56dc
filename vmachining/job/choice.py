"""Which engine cuts a job, and which of its motions the mesh engine has to cut: these cost the most."""

from __future__ import annotations

from collections.abc import Mapping

from vmachining.engines.relay import best_engine, handed_on
from vmachining.job.contact import ToolParts
from vmachining.job.cost import feed_motions, refuse_costly, refuse_fine
from vmachining.job.jobfile import Job
from vmachining.job.toolpath import Toolpath
from vmachining.stock import Stock
from vmachining.sweep import Sweep

__all__ = ["affordable"]


def affordable(
    job: Job,
    toolpath: Toolpath,
    tools: Mapping[int, ToolParts],
    stock: Stock,
    asked: str | None,
    chord: float,
) -> tuple[str, float]:
    """(name of the engine, s of the longest block of the mesh engine).

    asked : "columns" or "mesh"; None: what `engines.relay.best_engine` says.

    Raises
    ------
    JobError
        What the mesh engine would have to cut cannot be done with this chord, see `refuse_costly`.
    """
    if asked == "mesh":
        return asked, refuse_costly(job, toolpath, tools, stock.bounds, chord).longest_s
    hands_on = handed_on(stock)
    looked, _ = feed_motions(toolpath, tools)
    handed = [hands_on(Sweep.along(tools[tool].cutter, path)) for tool, path in looked]
    engine = best_engine(handed) if asked is None else asked
    if engine == "mesh" or any(handed):
        by_mesh = tools if engine == "mesh" else {
            tool: tools[tool] for (tool, _), hand in zip(looked, handed, strict=True) if hand
        }  # fmt: skip
        refuse_fine(job, by_mesh, chord)
        only = None if engine == "mesh" else hands_on
        return engine, refuse_costly(job, toolpath, tools, stock.bounds, chord, only=only).longest_s
    return engine, 0.0
