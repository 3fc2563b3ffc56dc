"""A second judge in every run: heights over random places, and exact rays where tools turn or dip, on some blocks; and on the
total where all tools are upright."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import polars as pl

from vmachining.engines.dexel import UprightJudge, Way
from vmachining.engines.judges import Judge, in_words, intersection
from vmachining.job.brep import JUDGED, OPINION_SCHEMA, RayWitness, judges_of
from vmachining.job.contact import ToolParts
from vmachining.job.simulate import Stopped
from vmachining.job.toolpath import Toolpath
from vmachining.progress import Progress
from vmachining.stock import Stock

EVERY, FEWEST, MOST = 150, 8, 100
"""One block of so many that remove something, at least and at most so many: a look by heights takes about as long as cutting five
blocks, one by exact rays as five blocks of a tool that turns, so looks are a twentieth of the cut from 1,200 blocks on. How many,
and which ones, is settled by their numbers and not by a clock, so that a run can be repeated to the last digit."""

WANT_REL, MOST_RAYS = 0.01, 2000
"""Half width of intervals by exact rays, and rays of a set in a first look, which takes 15 to 700 ms for a block: one in `EVERY`
at most is asked of them. Blocks of some tenths of a mm^3 reach this width; thin chips would need ten times as many rays, and
are known to a tenth of their volume. A second look may take forty times as many."""


def audited(
    toolpath: Toolpath,
    tools: Mapping[int, ToolParts],
    rows: pl.DataFrame,
    stock: Stock,
    *,
    most: int = MOST,
    total: bool = True,
    stop: Callable[[], bool] = lambda: False,
    progress: Progress = lambda *_: None,
) -> tuple[pl.DataFrame, dict[str, Any], dict[str, Any]]:
    """(block, columns of `OPINION`, brep_note) of the blocks that were asked about, the counts of the summary, and `second_judge`
    of the summary.

    rows : block, engine, proven, removed_mm3, removed_lo_mm3, removed_hi_mm3 of the run. most : blocks that are asked about.
    total : whether all blocks together are judged, too.

    Raises Stopped: The user asked to stop.
    """
    removing = rows.filter(pl.col("removed_hi_mm3") > 0.0)
    quick = UprightJudge(stock, (
        Way(block.number, tools[move.tool].cutter, path)
        for block in toolpath.blocks for move, path in toolpath.cuts(block) if move.tool in tools
    ))  # fmt: skip
    chosen = _chosen(removing, most, quick.takes)
    said = judges_of(removing.filter(pl.col("block").is_in(chosen)))
    exact: list[RayWitness] = []

    def looked_closer(block: int, again: bool) -> Judge:
        if not exact:
            sweeps = toolpath.sweeps_until(max(chosen), tools)
            exact.append(RayWitness(stock, sweeps, want_rel=WANT_REL, most=MOST_RAYS))
        return exact[0](block, again=again)

    found = list[tuple[Any, ...]]()
    for done, block in enumerate(chosen):
        progress("second judge", done, len(chosen))
        if stop():
            raise Stopped("second judge", done, len(chosen))
        first = Judge("dexel", quick.removed(block)) if quick.takes(block) else looked_closer(block, False)
        judges = [*said[block], first]
        if intersection(judges) is None:  # nobody is accused by a first look
            judges[-1] = looked_closer(block, True)
        ends, status, note = judges[-1].removal.bracket, None, ""
        if intersection(judges) is None:
            status, note = "disputed", f"DISPUTED: {in_words(judges)}: at least one of them is wrong"
        found.append((block, None, None, None, status, ends[1], ends[0], ends[2], note))
    disputed = sum(row[4] is not None for row in found)
    told: dict[str, Any] = {"blocks": len(found), "disputed_blocks": disputed}
    told |= dict.fromkeys(("total_lo_mm3", "total_mm3", "total_hi_mm3", "total_agrees"))
    if total and quick.is_whole and not rows.is_empty():  # see `UprightJudge.total`
        lo, estimate, hi = quick.total().bracket
        agrees = float(rows["removed_lo_mm3"].sum()) <= hi and lo <= float(rows["removed_hi_mm3"].sum())
        told |= {"total_lo_mm3": lo, "total_mm3": estimate, "total_hi_mm3": hi, "total_agrees": agrees}
    disputes = max(disputed, told["total_agrees"] is False)
    counts = {"asked": 0, **dict.fromkeys(JUDGED, 0), "disputed": disputes}
    return pl.DataFrame(found, schema=OPINION_SCHEMA, orient="row"), counts, told


def _chosen(removing: pl.DataFrame, most: int, is_quick: Callable[[int], bool]) -> list[int]:
    """Numbers of the blocks that are asked about, rising: half evenly, the last one among them, and half by chance, those that
    remove much with a wide bracket first; of exact rays only one in `EVERY`."""
    numbers = removing["block"].to_list()
    few = -(-len(numbers) // EVERY)
    share = min(most, few)
    even = [numbers[((k + 1) * len(numbers)) // share - 1] for k in range(share)]  # the last one among them
    count = min(most, max(FEWEST, few), len(numbers))
    rare = [block for block in even if not is_quick(block)]
    width = (removing["removed_hi_mm3"] - removing["removed_lo_mm3"]).to_numpy()
    weight = removing["removed_mm3"].to_numpy() + width
    # in the order of exponential times with these rates: a draw without replacement
    times = np.random.default_rng(len(numbers)).exponential(size=len(numbers)) / np.maximum(weight, 1e-300)
    order = [numbers[k] for k in np.argsort(times, kind="stable").tolist()]
    chosen = {*even[: len(even) if count <= FEWEST else -(-count // 2)], *rare}
    chosen.add(numbers[-1]) if numbers else None
    for block in order:
        if len(chosen) >= count:
            break
        if block not in chosen and is_quick(block):
            chosen.add(block)
    return sorted(chosen)
