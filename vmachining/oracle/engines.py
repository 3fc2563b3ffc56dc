"""Our engines against each other on one job: volume, interval and time of every block by each of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path
from time import process_time
from typing import Any, cast

import numpy as np
import polars as pl

from vmachining.arrays import Bools, Floats
from vmachining.disk import Scratch
from vmachining.engines import ENGINES, entry_of
from vmachining.engines.protocol import NOTHING, Batched, Engine, Removal, Request
from vmachining.errors import InputError, VMachiningError
from vmachining.htmltable import facts_html
from vmachining.job import Job, Stopped, run
from vmachining.job.contact import ToolParts
from vmachining.job.reading import read_job_program
from vmachining.job.stock import raw_engine, raw_stock
from vmachining.job.toolpath import Toolpath
from vmachining.sweep import Sweep
from vmachining.tolerance import BREP_SECONDS

BREP = "brep"
"""Judges blocks and cuts none: its intervals are its values with their errors, where they are agreed."""

TOGETHER = 64
"""Blocks that an engine which is faster with many gets at once; their time is shared evenly."""

AIR = 50
"""Sweeps that remove nothing, of one tool and kind of path, after which nobody waits for one that does before the clock runs."""

NEAR = 1e-9
"""mm^3 and relative: intervals that miss each other by less are rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Answers:
    """What one engine says. lo, estimate, hi : (n,) mm^3, NaN where it gives no answer. seconds : (n,) of a processor.

    proven : (n,) whether the interval is a bound. refused : why it does not take the job, or ended early; None.
    """

    engine: str
    lo: Floats
    estimate: Floats
    hi: Floats
    seconds: Floats
    proven: Bools
    refused: str | None = None

    @property
    def has(self) -> Bools:
        return np.asarray(~np.isnan(self.estimate))


@dataclass(frozen=True, slots=True, eq=False)
class EngineComparison:
    """Blocks that cut, and what every engine says of them.

    block, line, text : (n,) of the program. Intervals exclude each other where the greatest lower end lies above the least
    upper one: of two bounds one is wrong; of stated intervals one in a hundred may miss.
    """

    job: str
    block: Sequence[int]
    line: Sequence[int]
    text: Sequence[str]
    answers: Sequence[Answers]

    @property
    def disagreements(self) -> list[dict[str, Any]]:
        """Pairs of engines that exclude each other somewhere: engines, blocks, and whether both are proven there."""
        out = []
        for one, other in combinations(self.answers, 2):
            lo, hi = np.maximum(one.lo, other.lo), np.minimum(one.hi, other.hi)
            with np.errstate(invalid="ignore"):
                at = np.flatnonzero(lo - hi > NEAR * (1.0 + np.abs(hi)))
            if len(at):
                blocks, proven = (
                    [self.block[k] for k in at.tolist()],
                    int((one.proven & other.proven)[at].sum()),
                )
                out.append({"engines": [one.engine, other.engine], "blocks": blocks, "proven": proven})
        return out

    @property
    def agrees(self) -> bool:
        """No two bounds exclude each other, and no more stated intervals than one in a hundred miss another one."""
        allowed = max(1, len(self.block) // 100)
        return all(not each["proven"] and len(each["blocks"]) <= allowed for each in self.disagreements)

    def summary(self) -> list[dict[str, Any]]:
        """A row per engine: blocks answered, total, time, width, distance to the narrowest proven answer."""
        truth = self.narrowest()
        out, disagreements = [], self.disagreements
        for each in self.answers:
            has = each.has
            width, size = (each.hi - each.lo)[has], each.estimate[has]
            real, known = size > 0.0, has & ~np.isnan(truth) & (truth > 0.0)
            off = np.abs(each.estimate[known] / truth[known] - 1.0)
            apart = {b for d in disagreements if each.engine in d["engines"] for b in d["blocks"]}
            out.append({
                "engine": each.engine, "blocks": int(has.sum()), "removed_mm3": float(size.sum()),
                "seconds": float(each.seconds.sum()),
                "ms_per_block": 1e3 * float(each.seconds[has].sum()) / max(int(has.sum()), 1),
                "width": float(np.median(width[real] / size[real])) if real.any() else None,
                "off": float(np.median(off)) if len(off) else None,
                "proven": int(each.proven[has].sum()), "disagrees": len(apart), "refused": each.refused,
            })  # fmt: skip
        return out

    def narrowest(self) -> Floats:
        """(n,) mm^3: middle of the intersection of all proven intervals, NaN where none exists."""
        lo, hi = np.full(len(self.block), -np.inf), np.full(len(self.block), np.inf)
        for each in self.answers:
            bound = each.proven & each.has
            lo[bound], hi[bound] = np.maximum(lo, each.lo)[bound], np.minimum(hi, each.hi)[bound]
        fine = np.isfinite(lo) & np.isfinite(hi) & (lo <= hi)
        return np.where(fine, 0.5 * (np.where(fine, lo, 0.0) + np.where(fine, hi, 0.0)), np.nan)

    def table(self) -> pl.DataFrame:
        """A row per block: block, line, text, and estimate, lo, hi and time of every engine."""
        columns: dict[str, Any] = {
            "block": list(self.block),
            "line": list(self.line),
            "text": list(self.text),
        }
        for each in self.answers:
            values = {"mm3": each.estimate, "lo_mm3": each.lo, "hi_mm3": each.hi, "s": each.seconds}
            columns |= {f"{each.engine}_{name}": pl.Series(v).fill_nan(None) for name, v in values.items()}
        return pl.DataFrame(columns)

    def to_dict(self) -> dict[str, Any]:
        return {
            "job": self.job, "agrees": self.agrees, "engines": self.summary(),
            "disagreements": self.disagreements, "blocks": self.table().to_dicts(),
        }  # fmt: skip

    def _repr_html_(self) -> str:
        facts = [
            (r["engine"], r["refused"] or f"{r['ms_per_block']:.3g} ms a block, {r['width'] or 0.0:.2g} wide")
            for r in self.summary()
        ]
        return facts_html(f"{self.job}: {len(self.block)} blocks", facts)


def engine_names(text: str) -> tuple[str, ...]:
    """Names of `--engines columns,mesh,...`.

    Raises InputError: An engine that there is not, one that is named twice, or fewer than two.
    """
    names = tuple(part.strip().lower() for part in text.split(",") if part.strip())
    for name in names:
        if name not in (*ENGINES, BREP):
            raise InputError(f"unknown engine {name!r}", remedy=f"take {', '.join((*ENGINES, BREP))}")
    if len(set(names)) != len(names) or len(names) < 2:
        raise InputError(f"--engines {text!r}: two or more different ones are expected")
    return names


def compare_engines(
    job: Job | Path | str,
    engines: Sequence[str],
    *,
    blocks: int | None = None,
    brep_seconds: float = BREP_SECONDS,
    progress: Callable[[str, int, int], None] | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> EngineComparison:
    """Cut one job with several engines, one after the other in this process.

    blocks : only so many of the blocks that cut, from the first one on; None: all.

    Kernels are compiled before the clock runs. An engine that refuses the job, or fails at a block, is named with its reason and
    keeps the answers it has given; the others continue.

    Raises InputError: The job cannot be used by any of them.
    Raises Stopped: `stop` returned true.
    """
    job = Job.of(job)
    names = engine_names(",".join(engines))
    told = progress or (lambda *_: None)
    tools = {number: ToolParts.of(tool) for number, tool in job.tools.items()}
    toolpath = Toolpath.of(read_job_program(job), job.machine)
    work = [(block, sweeps) for block in toolpath.blocks if (sweeps := toolpath.sweeps(block, tools))]
    if not work:
        raise InputError("no block of the program cuts", remedy="is it the right file?")
    if blocks is not None:
        if blocks < 1:
            raise InputError(f"{blocks} blocks: expected one or more", remedy="1 or more")
        work = work[:blocks]
    stock = raw_stock(job)
    said = []
    for name in names:
        if name == BREP:
            numbers = [block.number for block, _ in work]
            said.append(_by_brep(job, numbers, blocks is None, brep_seconds, told, stop))
            continue
        out = _nothing(name, len(work))
        try:
            _warmed(raw_engine(job, name, stock), [sweeps for _, sweeps in work])
            engine = raw_engine(job, name, stock)
            for k, removal, seconds in _cut(engine, work):
                out.lo[k], out.estimate[k], out.hi[k] = removal[:3]
                out.seconds[k], out.proven[k] = seconds, removal.proven
                told(name, k + 1, len(work))
                if stop():
                    raise Stopped(name, k + 1, len(work))
        except VMachiningError as error:
            out = replace(out, refused=str(error))
        said.append(out)
    lines = job.program_path.read_text(encoding="utf-8", errors="replace").splitlines()
    return EngineComparison(
        job.name, [block.number for block, _ in work], [block.line for block, _ in work],
        [lines[block.line - 1].strip() if block.line <= len(lines) else "" for block, _ in work], said,
    )  # fmt: skip


def _nothing(name: str, n: int) -> Answers:
    lo, estimate, hi = np.full((3, n), np.nan)
    return Answers(name, lo, estimate, hi, np.zeros(n), np.zeros(n, dtype=np.bool_))


def _cut(engine: Engine, work: Sequence[tuple[Any, Sequence[Sweep]]]) -> Iterator[tuple[int, Removal, float]]:
    """(row, removal, seconds) of every block."""
    batched = entry_of(engine.name).batched
    for first in range(0, len(work), TOGETHER if batched else 1):
        part = work[first : first + (TOGETHER if batched else 1)]
        orders = [Request(sweep, block.number) for block, sweeps in part for sweep in sweeps]
        begin = process_time()
        if batched:
            answers = cast("Batched", engine).answer(orders)
        else:
            answers = [engine.cut(order.sweep, order.block) for order in orders]
        seconds = (process_time() - begin) / len(part)
        for k, (block, _) in enumerate(part, first):
            own = (
                answer for order, answer in zip(orders, answers, strict=True) if order.block == block.number
            )
            yield k, NOTHING.plus(*own), seconds


def _warmed(engine: Engine, blocks: Sequence[Sequence[Sweep]]) -> None:
    """Compile what the job needs, on a workpiece that nobody asks again.

    Of every tool and kind of path the sweeps up to the first one that removes something, or `AIR` of them.
    """
    many = entry_of(engine.name).batched
    known: dict[tuple[int, str], int] = {}
    for sweep in (sweep for sweeps in blocks for sweep in sweeps):
        kind = id(sweep.profile), type(sweep.path).__name__
        if known.setdefault(kind, 0) >= AIR:
            continue
        found = cast("Batched", engine).answer([Request(sweep, 0)])[0] if many else engine.cut(sweep, 0)
        known[kind] = AIR if found.hi > 0.0 else known[kind] + 1


def _by_brep(
    job: Job,
    numbers: Sequence[int],
    whole: bool,
    seconds: float,
    progress: Callable[[str, int, int], None],
    stop: Callable[[], bool],
) -> Answers:
    """Values of the B-rep engine where they are agreed, with their errors; its time is that of its own processes.

    whole : whether `numbers` are all blocks of the job that cut.
    """
    out = _nothing(BREP, len(numbers))
    try:
        with Scratch() as folder:
            result = run(
                job, engine="columns", out=folder, brep="all" if whole else ",".join(map(str, numbers)), brep_seconds=seconds,
                progress=progress, stop=stop,
            )  # fmt: skip
            rows = result.blocks.select("block", "removed_brep_mm3", "removed_brep_error_mm3")
            times = pl.read_csv(folder / "brep.partial.csv").select("block", "seconds")
    except VMachiningError as error:
        return replace(out, refused=str(error))
    row = {number: k for k, number in enumerate(numbers)}
    for block, value, miss in rows.iter_rows():
        if value is not None and (k := row.get(block)) is not None:
            off = miss or 0.0
            out.lo[k], out.estimate[k], out.hi[k] = max(0.0, value - off), value, value + off
    for block, spent in times.iter_rows():
        out.seconds[row[block]] = spent
    return out
