"""Which engine cuts a job, in how many shares, and which of its motions the mesh engine has to cut: these cost the most."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from vmachining.engines.relay import best_engine, handed_on
from vmachining.job.contact import ToolParts
from vmachining.job.cost import feed_motions, refuse_costly, refuse_fine
from vmachining.job.jobfile import Job
from vmachining.job.toolpath import Toolpath
from vmachining.stock import Stock
from vmachining.sweep import Sweep

SHARES = 4
"""Shares of the workpiece that columns cut where processes pay (`Entry.divided_from`), however many processes
there are, so that numbers do not depend on how many: one needs 8 to 15 % more time for them than for an undivided workpiece."""


class Choice(NamedTuple):
    """engine : its name. longest_s : s of the longest block of the mesh engine. alone : columns take every motion."""

    engine: str
    longest_s: float
    alone: bool


def affordable(
    job: Job,
    toolpath: Toolpath,
    tools: Mapping[int, ToolParts],
    stock: Stock,
    asked: str | None,
    chord: float,
) -> Choice:
    """The engine.

    asked : "columns" or "mesh"; None: what `engines.relay.best_engine` says.

    Raises JobError: What the mesh engine would have to cut cannot be done with this chord, see `refuse_costly`.
    """
    if asked == "mesh":
        return Choice(asked, refuse_costly(job, toolpath, tools, stock.bounds, chord).longest_s, False)
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
        cost = refuse_costly(job, toolpath, tools, stock.bounds, chord, only=only)
        return Choice(engine, cost.longest_s, False)
    return Choice(engine, 0.0, True)
