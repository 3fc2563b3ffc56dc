"""`--brep none|sample|all|BLOCKS`: the second opinion on removed volumes, gated by the brackets of the run.

The B-rep engine gets the stock, what every block sweeps and the bracket of every block asked for; it answers
with a value inside the bracket, or refuses and says why. No number of the mesh engine changes.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from vmachining.engines import dexel
from vmachining.engines.columns import ColumnsEngine
from vmachining.engines.judges import Judge
from vmachining.engines.protocol import NOTHING, Options, Removal
from vmachining.errors import EngineError, InputError, StockError
from vmachining.interval import Interval
from vmachining.job.contact import ToolParts
from vmachining.job.jobfile import Job
from vmachining.job.simulate import Stopped
from vmachining.job.stock import raw_stock
from vmachining.job.table import COLUMNS, OPINION
from vmachining.job.toolpath import Toolpath
from vmachining.progress import Progress
from vmachining.stock import Blank, MeshStock, Stock
from vmachining.sweep import Sweep
from vmachining.tolerance import WIDTH_MM3

if TYPE_CHECKING:
    from pathlib import Path

    from vmachining.engines.brep import Verdict
    from vmachining.job.result import RunResult

TRIANGLES = 5000
"""Most triangles of an STL that become faces: booleans of more take too long."""

SAMPLE = 20
"""Blocks of `--brep sample`, spread evenly over those that remove something."""

JUDGED = ("agreed", "retried", "refused", "disputed")
"""What may become of a block that was asked about."""

OPINION_SCHEMA: dict[str, Any] = {
    "block": pl.Int64,
    **{name: COLUMNS[name] for name in OPINION},
    "brep_note": pl.String,
}
"""What judges say of blocks."""

BREP_HELP = "none | sample | all | blocks such as 3,7-12"

Asked = str | tuple[range, ...]
"""none, sample, all, or ranges of block numbers."""


def parse_brep(text: str) -> Asked:
    """Which blocks `--brep` asks for.

    Raises InputError: Neither a known word nor block numbers.
    """
    word = text.strip().lower()
    return word if word in ("none", "sample", "all") else parse_blocks(text, "--brep", BREP_HELP)


def parse_blocks(text: str, option: str, form: str = "blocks such as 3,7-12") -> tuple[range, ...]:
    """Ranges of block numbers; `option` and `form` are named in what is refused.

    Raises InputError: No block numbers.
    """
    found = []
    for part in text.split(","):
        ends = [end.strip() for end in part.split("-")]
        if len(ends) > 2 or not all(end.isascii() and end.isdecimal() and len(end) < 10 for end in ends):
            raise InputError(f"{option} {text!r} is not understood", remedy=f"give {form}")
        first, last = int(ends[0]), int(ends[-1])
        if last < first:
            raise InputError(
                f"{option}: block {last} comes before block {first}", remedy="give 7-12, not 12-7"
            )
        found.append(range(first, last + 1))
    return tuple(found)


def refuse_beyond(asked: Asked, last: int, option: str = "--brep") -> None:
    """Refuse numbers of blocks that a program does not have.

    Raises InputError: Names the first range that ends after block `last`.
    """
    for part in asked if isinstance(asked, tuple) else ():
        if part[-1] > last:
            raise InputError(f"{option}: there is no block {part[-1]}", remedy=f"the last block is {last}")


def blank(job: Job, stock: Stock | None = None) -> Blank:
    """The stock as the B-rep engine takes it; read again unless it is given.

    Raises InputError: An STL stock of more than `TRIANGLES` triangles.
    """
    stock = raw_stock(job) if stock is None else stock
    if job.keys.stock.stl is not None and isinstance(stock, MeshStock) and len(stock.triangles) > TRIANGLES:
        raise InputError(
            f"the B-rep engine makes a solid of at most {TRIANGLES} triangles, this stock has {len(stock.triangles)}",
            **job.where("stock"),
            remedy="give the stock as box, cylinder or step, or do without (--brep none, --stock stl, --method dexel)",
        )
    return stock.solid()


def chosen(asked: Asked, rows: pl.DataFrame) -> list[int]:
    """Block numbers to check, from the rows of the run.

    Raises InputError: A block that the program does not have.
    """
    cuts = rows.filter(pl.col("motion") != "rapid")["block"].to_list()
    if asked == "none":
        return []
    if asked == "all":
        return cuts
    if asked == "sample":
        removing = rows.filter(pl.col("removed_hi_mm3") > 0.0)["block"].to_list()
        n = len(removing)
        count = min(SAMPLE, n)
        return [removing[(k * (n - 1)) // max(count - 1, 1)] for k in range(count)]
    refuse_beyond(asked, int(rows["block"].max()))  # type: ignore[arg-type]
    return [k for k in cuts if any(k in part for part in asked if isinstance(part, range))]


def asked_numbers(text: str, rows: pl.DataFrame) -> list[int]:
    """Blocks of everything that was requested one after the other, such as "sample+3,7-12", from the rows of the run."""
    return sorted({k for part in text.split("+") for k in chosen(parse_brep(part), rows)})


def brep_columns(
    job: Job,
    toolpath: Toolpath,
    tools: Mapping[int, ToolParts],
    rows: pl.DataFrame,
    numbers: Sequence[int],
    *,
    stock: Stock,
    file: Path,
    workers: int | None,
    seconds: float,
    stop: Callable[[], bool],
    progress: Progress,
) -> tuple[pl.DataFrame, dict[str, Any]]:
    """(block, columns of `OPINION`, brep_note) of every block, and the counts of the summary.

    numbers : of the blocks to ask about. rows : block, motion, removed_mm3, removed_lo_mm3, removed_hi_mm3 of the run.
    seconds : limit of a block, see `check_blocks`.
    file : verdicts as they come; those that are there, and still hold, are not asked for again, but refusals are if
        they had less time.

    Raises Stopped: The user asked to stop; no verdict is lost.
    Raises EngineError: The kernel cannot be started.
    """
    from vmachining.engines.brep import check_blocks
    from vmachining.job.verdicts import VerdictFile

    sweeps = toolpath.sweeps_until(max(numbers, default=-1), tools)
    slacks = [_slack(stock, each) for each in sweeps]
    asked_rows = rows.filter(pl.col("block").is_in(numbers))
    want = {
        k: [Judge(name, widened(removal, slacks[k])) for name, removal in each]
        for k, each in judges_of(asked_rows).items()
    }
    for k, judge in columns_say(stock, sweeps, want.keys(), slacks).items():
        want[k] = [*(other for other in want[k] if other.name != judge.name), judge]
    count = workers if workers is not None else os.cpu_count() or 1
    with VerdictFile(file, want, seconds) as kept:
        verdicts = kept.known
        left = {k: judges for k, judges in want.items() if k not in verdicts}
        witness = RayWitness(stock, sweeps, slacks)
        progress("brep", len(verdicts), len(want))
        for number, verdict in check_blocks(
            blank(job, stock), sweeps, left, witness=witness, workers=count, seconds=seconds, stop=stop
        ):
            kept.add(number, verdict)
            progress("brep", len(verdicts), len(want))
    if len(verdicts) < len(want):
        raise Stopped("brep", len(verdicts), len(want))
    rows_said = [_row(block.number, verdicts.get(block.number)) for block in toolpath.blocks]
    counts = {word: sum(v.status == word for v in verdicts.values()) for word in JUDGED}
    won = Counter(v.attempt for v in verdicts.values() if v.attempt)
    table = pl.DataFrame(rows_said, schema=OPINION_SCHEMA, orient="row")
    return table, {"asked": len(want), **counts, "attempts": dict(won)}


def disputes(rows: pl.DataFrame) -> list[tuple[int, int, str, str, str]]:
    """(block, line, text, one interval, the other) of every block over which the judges exclude each other."""
    found = rows.filter(pl.col("brep_status") == "disputed")
    names = ("engine", "removed_lo_mm3", "removed_hi_mm3", "removed_dexel_lo_mm3", "removed_dexel_hi_mm3")
    return [
        (*head, f"{engine} {lo:.6g} to {hi:.6g} mm3", f"dexel {low:.6g} to {high:.6g} mm3")
        for *head, engine, lo, hi, low, high in found.select("block", "line", "text", *names).iter_rows()
    ]


def write_step(result: RunResult, path: Path, after: int | None = None) -> None:
    """Write the workpiece of a run as STEP, each face named by its block, line and tool.

    The cut of every block is gated by its bracket, as in `brep_columns`.

    after : the last block that has cut it; None: it is finished.
    Raises InputError: The stock is an STL of too many triangles; or the program has no such block.
    Raises EngineError: Refused; no file is left.
    """
    from vmachining.engines.brep import step_file

    job, toolpath = result.job, result.toolpath
    tools = {number: ToolParts.of(tool) for number, tool in job.tools.items()}
    if after is not None:
        refuse_beyond((range(after, after + 1),), len(toolpath.blocks) - 1, "STEP of the workpiece")
    blocks = toolpath.blocks[: None if after is None else after + 1]
    slack = float(result.summary.get("stock_slack_mm3", 0.0))  # of the triangles that were cut
    rows = (
        result.blocks.select("removed_lo_mm3", "removed_mm3", "removed_hi_mm3").head(len(blocks)).iter_rows()
    )
    step_file(
        path, blank(job), [toolpath.sweeps(block, tools) for block in blocks],
        [Interval(max(0.0, lo - slack), mid, hi + slack) for lo, mid, hi in rows],
        [f"block {block.number} line {block.line} tool {block.tool}" for block in blocks],
    )  # fmt: skip


def judges_of(rows: pl.DataFrame) -> dict[int, list[Judge]]:
    """Block -> what the engine that cut says of it, of the stock that it cut."""
    names = ("block", "engine", "removed_lo_mm3", "removed_mm3", "removed_hi_mm3", "proven")
    return {
        block: [Judge(engine, Removal(lo, mid, hi, proven))]
        for block, engine, lo, mid, hi, proven in rows.select(names).iter_rows()
    }


def _slack(stock: Stock, sweeps: Sequence[Sweep]) -> float:
    """mm^3 that the triangles of a curved STEP stock can change of what some sweeps remove."""
    if not sweeps:
        return 0.0
    bounds = np.array([sweep.bounds for sweep in sweeps])
    return stock.slack_near(np.stack([bounds[:, 0].min(axis=0), bounds[:, 1].max(axis=0)]))


def _row(block: int, verdict: Verdict | None) -> tuple[Any, ...]:
    """block, the columns of `OPINION`, brep_note."""
    if verdict is None:
        return (block, None, None, None, "skipped", None, None, None, "")
    rays = next((judge.removal for judge in verdict.judges if judge.name == "dexel"), None)
    return (
        block, verdict.removed_mm3, verdict.error_mm3, f"{verdict.number} {verdict.attempt}" if verdict.attempt else None,
        str(verdict.status), *((None, None, None) if rays is None else (rays.estimate, rays.lo, rays.hi)),
        note_of(verdict),
    )  # fmt: skip


def note_of(verdict: Verdict | None) -> str:
    """What a user has to know of a verdict beside its status: the attempt that worked, or why none did."""
    if verdict is None:
        return ""
    if verdict.status == "disputed":
        return f"DISPUTED: {verdict.reason}"
    if verdict.removed_mm3 is None:
        return f"B-rep refused: {verdict.reason}" if verdict.reason else ""
    return f"B-rep retried ({verdict.attempt})" if verdict.status == "retried" else ""


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
    _engine: dexel.RayEngine | None = field(default=None, repr=False)
    _members: list[list[int]] = field(default_factory=list, repr=False)

    def __call__(self, block: int, again: bool = False) -> Judge:
        """See `vmachining.engines.brep.removal.check.Witness`."""
        if self._engine is None:
            self._engine = engine = dexel.RayEngine(self.stock, want_rel=self.want_rel, most=self.most)
            self._members = [[engine.add(sweep, k) for sweep in each] for k, each in enumerate(self.blocks)]
        closer: dict[str, Any] = {"want_rel": 0.5 * self.want_rel, "most": 4 * MOST} if again else {}
        found = self._engine.removed(self._members[block], seed=block + again * len(self.blocks), **closer)
        return Judge(self.name, widened(found, self.slacks[block] if self.slacks else 0.0))
