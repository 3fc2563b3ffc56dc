"""A second judge in every run: exact rays on some blocks, where they cost less than a tenth of what cutting does."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import polars as pl

from vmachining.engines.judges import Judge, in_words, intersection
from vmachining.job.brep import JUDGED, judges_of
from vmachining.job.contact import ToolParts
from vmachining.job.judges import RayWitness
from vmachining.job.simulate import Progress, Stopped
from vmachining.job.table import COLUMNS, OPINION
from vmachining.job.toolpath import Toolpath
from vmachining.stock import Stock

__all__ = ["MOST", "audited"]

EVERY = 40
"""One block of so many that remove something: rays take 15 to 60 ms for a block, the mesh engine 15 ms and more, so this is
less than a tenth of the run. Which ones is settled by their number, so that a run can be repeated to the last digit."""

WANT_REL = 0.01
"""Half width of their intervals: what 15 to 60 ms give."""

MOST = 100
"""Blocks of one run."""


def audited(
    toolpath: Toolpath,
    tools: Mapping[int, ToolParts],
    rows: pl.DataFrame,
    stock: Stock,
    *,
    most: int = MOST,
    stop: Callable[[], bool] = lambda: False,
    progress: Progress = lambda *_: None,
) -> tuple[pl.DataFrame, dict[str, Any]]:
    """(block, columns of `OPINION`, brep_note) of the blocks that were asked about, and the counts of the summary.

    rows : block, engine, removed_mm3, removed_lo_mm3, removed_hi_mm3 of the run. most : blocks that are asked about.

    Raises
    ------
    Stopped
        The user asked to stop.
    """
    removing = rows.filter(pl.col("removed_hi_mm3") > 0.0)
    chosen = _spread(removing["block"].to_list(), most)
    said = judges_of(removing.filter(pl.col("block").is_in(chosen)))
    sweeps = toolpath.sweeps_until(max(chosen, default=-1), tools)
    witness, found = RayWitness(stock, sweeps, want_rel=WANT_REL), list[tuple[Any, ...]]()
    for done, block in enumerate(chosen):
        progress("second judge", done, len(chosen))
        if stop():
            raise Stopped("second judge", done, len(chosen))
        judges = [*said[block], witness(block)]
        if intersection(judges) is None:
            judges[-1] = witness(block, again=True)
        found.append(_row(block, judges))
    schema: dict[str, Any] = {
        "block": pl.Int64,
        **{name: COLUMNS[name] for name in OPINION},
        "brep_note": pl.String,
    }
    disputed = sum(row[4] is not None for row in found)
    counts = {"asked": 0, **dict.fromkeys(JUDGED, 0), "disputed": disputed}
    return pl.DataFrame(found, schema=schema, orient="row"), counts


def _spread(numbers: Sequence[int], most: int) -> list[int]:
    """Some of them, evenly, the last one among them."""
    count = min(most, -(-len(numbers) // EVERY))
    return [numbers[((k + 1) * len(numbers)) // count - 1] for k in range(count)]


def _row(block: int, judges: Sequence[Judge]) -> tuple[Any, ...]:
    lo, estimate, hi = judges[-1].removal.bracket
    if intersection(judges) is not None:
        return (block, None, None, None, None, estimate, lo, hi, "")
    note = f"DISPUTED: {in_words(judges)}: one of both is wrong"
    return (block, None, None, None, "disputed", estimate, lo, hi, note)
