"""Whether a program cuts the stock at all, by the boxes of its sweeps."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from vmachining.errors import StockError
from vmachining.job.contact import ToolParts
from vmachining.job.jobfile import Job
from vmachining.job.reading import refuse_unknown_tools
from vmachining.job.toolpath import Toolpath
from vmachining.nc import Motion
from vmachining.stock import Stock


def refuse_no_cut(job: Job, toolpath: Toolpath, tools: Mapping[int, ToolParts], stock: Stock) -> None:
    """No simulation for a cut without a tool, or for a path that by its box alone misses the stock.

    Raises NCError, StockError: It is one of these.
    """
    refuse_unknown_tools(toolpath.program, tools, ", ".join(map(str, sorted(tools))))
    idle = (Motion.RAPID, Motion.DWELL)
    if not any(m.motion not in idle for m in toolpath.near(tools, stock.bounds)):
        raise never_reached(job, toolpath, tools, stock)


def never_reached(job: Job, toolpath: Toolpath, tools: Mapping[int, ToolParts], stock: Stock) -> StockError:
    """What to tell of a program that takes nothing."""
    lo, hi = stock.bounds.round(3).tolist()
    what = f"no feed move of {Path(toolpath.program.name).name} reaches the stock, which lies from {lo} to {hi} mm"
    remedy = "compare work offset, units and home of the program with the stock"
    rapid = next((m for m in toolpath.near(tools, stock.bounds) if m.motion is Motion.RAPID), None)
    if rapid is not None:
        what += f"; the rapid in line {rapid.line} goes into its box, but rapids cut nothing"
        remedy = f"program cuts with G1, G2 or G3, or {remedy}"
    return StockError(what, **job.where("stock"), remedy=remedy)
