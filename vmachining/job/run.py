"""One job from file to result: the only place that wires the rooms together."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from vmachining.engines import RAYS, engine_class
from vmachining.engines.protocol import Engine
from vmachining.errors import InputError, NCError, StockError
from vmachining.job.audit import MOST, audited
from vmachining.job.brep import Asked, asked_numbers, blank, brep_columns, parse_brep, refuse_beyond
from vmachining.job.choice import affordable
from vmachining.job.contact import ToolParts
from vmachining.job.cost import refuse_fine
from vmachining.job.cutting import ROWS, Cutting
from vmachining.job.deviation import deviation_tables
from vmachining.job.engagement_columns import coefficients_of, engagement_pass
from vmachining.job.files import Scratch, atomic_path, make_folder
from vmachining.job.folder import FolderLock, ResultFolder, program_words
from vmachining.job.given import Given, Opinion, Planning, RunOptions
from vmachining.job.jobfile import Job
from vmachining.job.kept import finer, judged
from vmachining.job.model import Feed
from vmachining.job.notes import quiet_findings, slack_of
from vmachining.job.parts import Part, Parts
from vmachining.job.reading import read_job_program, refuse_unknown_tools
from vmachining.job.record import Record
from vmachining.job.result import RunResult
from vmachining.job.schedule import compare, sample_count
from vmachining.job.spent import Spent
from vmachining.job.stations import Stations, no_stations
from vmachining.job.stock import raw_stock
from vmachining.job.stopping import stop_flag
from vmachining.job.store import PARTS
from vmachining.job.strategies import Planned, plan
from vmachining.job.summary import run_summary
from vmachining.job.table import finish, read_partial, refeed
from vmachining.job.timing import block_feeds, machine_limits, move_times
from vmachining.job.toolpath import Toolpath
from vmachining.job.total import ENDS, Total, settled, total_of
from vmachining.job.verified import (
    Written,
    divided_edits,
    refuse_other_motions,
    scheduled_name,
    verified,
    write_again,
)
from vmachining.nc import Motion
from vmachining.progress import Progress, shown
from vmachining.stock import Stock
from vmachining.tolerance import BREP_SECONDS

if TYPE_CHECKING:
    import polars as pl

CONTACT_SAMPLE = 200
"""Blocks of `--contact sample`, spread evenly over those that remove something."""

FAST_AUDIT = 4
"""Blocks that exact rays look at after the vectors engine, which cuts a hundred blocks in the time of one such block."""

LEFT_OUT = "contact columns are empty: they were left out (`vmachining contact` computes them)"

NO_CONTACT = "contact columns are empty: --engine vectors measures the deviation; [force] or [feed] in the job asks for both"


def run(
    job: Job | Path | str,
    *,
    engine: str | None = None,
    width: float | str | None = None,
    chord: float | None = None,
    out: Path | str | None = None,
    resume: bool = False,
    workers: int | None = None,
    brep: str = "none",
    brep_seconds: float = BREP_SECONDS,
    every_strategy: bool = False,
    contact: Literal["none", "sample", "all"] = "all",
    stages: Sequence[str] = PARTS,
    progress: Progress | bool | None = None,
    stop: Callable[[], bool] | None = None,
    lock: FolderLock | None = None,
    command: Sequence[str] | None = None,
    force: bool = False,
    parts: Parts | None = None,
) -> RunResult:
    """Simulate a job: removed volume with its bracket per block, contacts, times, and the schedule if asked.

    Parameters
    ----------
    job : or the file of one.
    engine : a name of `vmachining.engines.ENGINES`; None: `columns` where they take the stock and at least half of the feed
        motions (what they do not take goes to `mesh`, block by block), else `mesh`.
    width : of a block's interval relative to its volume, instead of width of the job: 0.003 or "0.3%".
    chord : mm, instead of chord_mm of the job; a note of the summary says so where it changed nothing.
    out : directory for tables while they grow; None: a temporary one, until `RunResult.write`.
    resume : continue after an interruption, from the checkpoint in `out`.
    workers : processes that cut; None: one per core where the program is long enough. Where columns take every motion
        no number depends on it; else `mesh` changes by rounding, and columns within the width that is requested.
    brep : blocks whose volume the B-rep engine checks: "none", "sample", "all" or numbers such as "3,7-12".
    brep_seconds : of a processor, limit of one such block, and of the solids and every mesh of each sweep that it needs.
    every_strategy : judge all feed strategies by simulation, also where [feed] inserts blocks: one simulation more. Without
        inserted blocks they always are.
    contact : blocks whose contact, chips and forces are computed: "none", "sample" (some hundred, evenly) or "all".
    stages : what to do of `PARTS`, such as "cut,judge"; cutting is always done. Schedules need the contact of all blocks.
    progress : True: a bar, in a notebook or on stderr; or a function called with stage name, blocks done, blocks in all.
    stop : asked between blocks whether to stop; None: SIGINT and SIGTERM do.
    lock : of `out`, when the caller continues to write there; None: `out` is locked until this returns.
    command : the words of the command line, for the manifest; None: those that this process was started with.
    force : the result of another job in `out` is replaced.
    parts : complete ones of this run, see `run_part`; what they know is not done again.

    Raises
    ------
    InputError
        Program, tools or stock cannot be used; a path that never reaches the stock; `out` holds a file that is not
        ours under a name that results have, or another run is writing there; the disk is full.
    Stopped
        SIGINT or SIGTERM: rows, checkpoint and manifest are on disk, `resume` continues.
    EngineError
        A kernel failed; names the block.
    """
    if resume and out is None:
        raise InputError("resume needs the directory of the interrupted run")
    keep = Scratch() if out is None else None
    job = Job.of(job) if width is None else Job.of(job).with_width(width)
    asked = RunOptions(
        engine=engine, chord=chord, resume=resume, workers=workers, brep=brep, brep_seconds=brep_seconds,
        every_strategy=every_strategy, contact=contact, stages=stages, command=command, force=force, parts=parts,
    )  # fmt: skip
    with (
        shown(progress) as seen,
        _working(job, Path(keep.name if keep else str(out)), asked, seen, stop, lock) as work,
    ):
        result = work.go()
    result.account()
    result._keep = keep
    return result


def run_part(
    job: Job | Path | str,
    part: Part,
    *,
    out: Path | str,
    progress: Progress | None = None,
    stop: Callable[[], bool] | None = None,
    lock: FolderLock | None = None,
    **options: Any,
) -> None:
    """One of several parts of a run: its shares of the workpiece, its chunks of contact. options : as those of `run`.

    Raises
    ------
    InputError, Stopped, EngineError
        See `run`.
    """
    asked = RunOptions(**{"workers": 1} | options, part=part)
    with _working(Job.of(job), Path(out), asked, progress, stop, lock) as work:
        work.go_part(part)


@contextmanager
def _working(
    job: Job,
    folder: Path,
    asked: RunOptions,
    progress: Progress | None,
    stop: Callable[[], bool] | None,
    lock: FolderLock | None,
) -> Iterator[_Run]:
    """A run about to begin, whose record is saved however it ends."""
    if asked.engine is not None:
        engine_class(asked.engine)
    if asked.chord is not None:
        job = job.with_chord(asked.chord)
    brep, options = parse_brep(asked.brep), asked.of(job)
    with stop_flag(stop) as stopped, FolderLock(folder) as own:
        work = _Run(job, folder, asked, options, brep, progress or (lambda *_: None), stopped, lock or own)
        try:
            yield work
        except BaseException:
            with suppress(InputError):  # where nothing can be written, what was written last still holds
                work.record.save()
            raise
        finally:
            work.cutting.staff.close()
        work.record.save()


@dataclass(slots=True, eq=False)
class _Run:
    """State of one run: what is where on disk, and how far it is."""

    job: Job
    folder: Path
    asked: RunOptions
    options: dict[str, Any]
    brep: Asked
    progress: Progress
    stop: Callable[[], bool]
    lock: FolderLock
    record: Record = field(init=False)
    cutting: Cutting = field(init=False)
    spent: Spent = field(default_factory=Spent)

    def __post_init__(self) -> None:
        self.record = Record(self.folder, self.spent, self.progress)
        self.cutting = Cutting(
            self.job, self.record, self.options, self.asked.workers, self.progress, self.stop
        )

    @property
    def place(self) -> ResultFolder:
        """Where the files are."""
        return self.record.place

    @property
    def manifest(self) -> dict[str, Any]:
        """What will be known of this run; empty until it begins to write."""
        return self.place.manifest

    def go(self) -> RunResult:
        """One stage after the other, see `spent.STAGES`."""
        with self.spent.on("read"):
            given = self._read()
        engine = self._stage("program", given, self._counts())
        with self.spent.on("cut"):
            total = self._total(given, engine)
        stations = self._contact(given.toolpath, "engagement", divided=self._stations_along())
        planned = Planning()
        if self.job.keys.feed is not None and "plan" in self.options["stages"]:
            with self.spent.on("plan"):
                planned = self._plan(self.job.keys.feed, given, stations, total)
        table = read_partial(self.rows, ["block", "motion", "engine", "time_s", "proven", *ENDS])
        opinion = self._opinion(given, table)
        with self.spent.on("files"):
            with self.place.making("blocks.csv", "blocks.parquet"):
                estimates = settled(table, total)
                finish(
                    self.rows,
                    self.folder,
                    "blocks",
                    planned.scheduled,
                    opinion.rows,
                    stations.columns,
                    estimates,
                )
            return self._result(given, engine, total, planned, opinion, stations)

    def go_part(self, part: Part) -> None:
        """What this part owes the merge; the rows on the way are of its shares alone."""
        with self.spent.on("read"):
            given = self._read()
        if self._apart and part.shares(self.cutting.shares(len(given.toolpath.blocks), 1)):
            self._stage("program", given, None)
        if self.options["contact"] == "all":
            self._contact(given.toolpath, "engagement", divided=self._stations_along())
        self.manifest["part_complete"] = True

    @property
    def _apart(self) -> bool:
        """Whether parts cut: shares have fixed borders, and no order depends on answers of all of them."""
        return self.cutting.by_columns and self._counts() is None

    @property
    def rows(self) -> Path:
        """Where the rows of the program grow."""
        return self.folder / ROWS["program"]

    def _read(self) -> Given:
        """What is refused here is refused before the first byte: an earlier result stays as it is."""
        job = self.job
        tools = {number: ToolParts.of(tool) for number, tool in job.tools.items()}
        toolpath = Toolpath.of(read_job_program(job), job.machine)
        program, blocks = toolpath.program, toolpath.blocks
        if not blocks:
            raise NCError(
                "the program moves nothing", file=str(job.program_path), remedy="is it the right file?"
            )
        if not (self.asked.resume or self.asked.part or self.asked.parts):
            self.cutting.hire(len(blocks))
        limits, skips = machine_limits(job), job.keys.program.block_delete
        times = move_times(toolpath, limits, block_delete=skips)
        chord, asked = self.options["chord_mm"], self.options["engine"]
        if asked == "mesh":
            refuse_fine(job, tools, chord)
        stock = raw_stock(job)
        if self.brep != "none":
            blank(job, stock)
        self._refuse_early(toolpath, tools, stock)
        if asked in (None, "columns", "mesh"):
            choice = affordable(job, toolpath, tools, stock, asked, chord)
            self.options["engine"], self.cutting.by_columns = choice.engine, choice.alone
            self.cutting.longest_s = choice.longest_s if choice.engine == "mesh" else 0.0
        if not self.asked.resume:  # what an engine refuses is refused before the first byte
            self.cutting.raw = self.cutting.of(stock)
        refuse_beyond(self.brep, blocks[-1].number)
        if isinstance(self.brep, tuple) and all(
            blocks[k].motion == "rapid" for part in self.brep for k in part
        ):
            raise InputError("--brep: these blocks are rapids, which cut nothing", remedy="ask for others")
        coefficients_of(job)  # a missing file is said now
        make_folder(self.folder)
        self.lock.acquire()
        words = [*(program_words() if self.asked.command is None else self.asked.command)]
        self.record.open(
            job, self.options, words, program.files, resume=self.asked.resume, force=self.asked.force
        )
        return Given(tools, toolpath, times, stock)

    @property
    def _every_one(self) -> bool:
        return self.asked.every_strategy

    def _counts(self) -> Callable[[float], int] | None:
        """In how many equal parts a path of a length (mm) is measured; None: whole blocks."""
        feed = self.job.keys.feed
        if feed is None or not (feed.insert_blocks and (self._every_one or feed.strategy == "volume")):
            return None
        return lambda length: sample_count(feed, length)

    def _stations_along(self) -> bool:
        """Whether stations of contact stand where blocks may be divided."""
        feed = self.job.keys.feed
        return feed is not None and feed.insert_blocks and (self._every_one or feed.strategy != "volume")

    def _total(self, given: Given, engine: Engine) -> Total:
        """Of all blocks, which must have removed something."""
        summed = read_partial(self.rows, [*ENDS, "proven"])
        if not float(summed["removed_hi_mm3"].sum()) > 0.0:
            raise self._never_reached(given.toolpath, given.tools, given.stock)
        return total_of(summed, engine.stock_volume, engine.volume, slack_of(given.stock))

    def _plan(self, feed: Feed, given: Given, stations: Stations, total: Total) -> Planning:
        """Feeds, the program with them, and the same stages once more on it."""
        job, blocks, program = self.job, given.toolpath.blocks, given.toolpath.program
        table = read_partial(self.rows, ["length_mm", "feed_mm_min", "removed_mm3", "removed_hi_mm3"])
        limits, skips = machine_limits(job), job.keys.program.block_delete
        reach = move_times(given.toolpath, limits, block_delete=skips, at_least_mm_min=feed.max_mm_min)
        caps = np.minimum(given.times.cap_mm_min, np.maximum(reach.reached_mm_min, feed.min_mm_min))
        planned = plan(feed, given.toolpath, table, self.rows, caps, stations, every=self._every_one)
        written = scheduled_name(program)
        mine = write_again(job, self.place, program, planned.schedule.edits(), written)
        parts = (
            (lambda length: finer(feed, length))
            if feed.insert_blocks and self._counts() is not None
            else None
        )
        self._stage("scheduled", given.written(mine), parts)
        new_rows = self.folder / ROWS["scheduled"]
        if self.asked.resume:  # they may have the feeds of the lowered schedule already
            refeed(new_rows, *block_feeds(mine.toolpath, mine.times))
        contact = self._contact(mine.toolpath, "engagement, scheduled")
        verdict = judged(feed, planned, mine, new_rows, contact, blocks)
        if verdict.lowered is not None:  # other feeds of the same motions: what was cut stays
            planned = planned.with_schedule(feed.strategy, verdict.lowered)
            before = mine
            mine = write_again(job, self.place, program, planned.schedule.edits(), written)
            refuse_other_motions(before.toolpath, mine.toolpath)
            refeed(new_rows, *block_feeds(mine.toolpath, mine.times))
            contact = self._contact(mine.toolpath, "engagement, lowered")
            verdict = judged(feed, planned, mine, new_rows, contact, blocks)
        after = mine.times
        cut = read_partial(new_rows)
        estimates = settled(cut, total)
        if estimates is not None:
            cut = cut.update(estimates, on="block")
        with self.place.making("scheduled_blocks.csv", "scheduled_blocks.parquet"):
            finish(new_rows, self.folder, "scheduled_blocks", contact=contact.columns, estimates=estimates)
        if self._every_one or not feed.insert_blocks:
            table = self._every(planned, mine, given, stations)
            planned = replace(planned, comparison=table)
        for name, told in (("strategies.csv", planned.comparison), ("references.csv", planned.references)):
            if told is not None:
                with self.place.making(name), atomic_path(self.folder / name) as temporary:
                    told.write_csv(temporary)
        scheduled, report = compare(feed, planned, mine.text, blocks, cut, verdict.passed)
        return Planning(scheduled, report, after)

    def _opinion(self, given: Given, table: pl.DataFrame) -> Opinion:
        """What other engines say of the volumes. table : rows of the run."""
        toolpath, tools, stock = given.toolpath, given.tools, given.stock
        if self.options["brep"] != "none":
            with self.spent.on("check"):
                return Opinion(*brep_columns(
                    self.job, toolpath, tools, table, asked_numbers(self.options["brep"], table),
                    stock=stock, file=self.folder / "brep.partial.csv", workers=self.asked.workers,
                    seconds=self.asked.brep_seconds, stop=self.stop, progress=self.progress,
                ))  # fmt: skip
        if "judge" not in self.options["stages"] or self.options["engine"] in RAYS:
            return Opinion()
        measures = self.options["engine"] == "vectors"
        with self.spent.on("judge"):
            return Opinion(*audited(
                toolpath, tools, table, stock, most=FAST_AUDIT if measures else MOST, total=not measures,
                stop=self.stop, progress=self.progress,
            ))  # fmt: skip

    def _result(
        self,
        given: Given,
        engine: Engine,
        total: Total,
        planned: Planning,
        opinion: Opinion,
        stations: Stations,
    ) -> RunResult:
        """What is known, without its files."""
        job = self.job
        result = RunResult(
            job=job,
            toolpath=given.toolpath,
            summary={},
            inputs=self.manifest["inputs"],
            stock=engine,
            schedule=planned.report,
            folder=self.folder,
            place=self.place,
            lock=self.lock,
            findings=quiet_findings(given.toolpath),
            spent=self.spent,
            earlier=dict(self.options) if "stages" in self.manifest else None,
            sweeps=stations.sweeps,
        )
        result.summary = run_summary(
            result,
            given.stock,
            total,
            given.times,
            planned.times,
            self.options,
            chord_given=self.asked.chord is not None,
        )
        if (deviation := deviation_tables(job, engine, self.place)) is not None:
            result.summary |= deviation
        elif job.keys.design is not None:
            result.summary["design_note"] = (
                "The design was not looked at: --engine vectors and --engine dexel measure against it"
            )
        result.summary["brep"] = dict(opinion.brep)
        if opinion.second is not None:
            result.summary["second_judge"] = opinion.second
        result.summary["contact_notes"] = list(stations.notes)
        return result

    def _every(self, planned: Planned, mine: Written, given: Given, stations: Stations) -> pl.DataFrame:
        """The comparison of all strategies, of written programs."""
        feed, program = self.job.keys.feed, given.toolpath.program
        assert feed is not None
        programs = {
            name: mine
            if name == feed.strategy
            else write_again(
                self.job, self.place, program, schedule.edits(), scheduled_name(program, f"scheduled_{name}")
            )
            for name, schedule in planned.plans.items()
        }

        def simulate() -> tuple[Written, pl.DataFrame, Stations]:
            divided = write_again(
                self.job, self.place, program, divided_edits(planned.plans), scheduled_name(program, "pieces")
            )
            self._stage("pieces", given.written(divided), None)
            rows = read_partial(self.folder / ROWS["pieces"], ["length_mm", "removed_mm3", "removed_hi_mm3"])
            return divided, rows, self._contact(divided.toolpath, "engagement, pieces", divided=True)

        return verified(feed, planned, programs, given.toolpath, given.times, stations, simulate)

    def _contact(self, toolpath: Toolpath, name: str, *, divided: bool | None = None) -> Stations:
        """Contact, chips and forces along the blocks."""
        keys = self.job.keys
        if self.options["engine"] == "vectors" and keys.feed is None and keys.force is None:
            return no_stations(len(toolpath.blocks), NO_CONTACT)
        level = self.options["contact"] if name == "engagement" else "all"
        if level == "none" or "contact" not in self.options["stages"]:
            return no_stations(len(toolpath.blocks), LEFT_OUT)
        with self.spent.on("contact"):
            return self._stations(toolpath, name, level, divided=divided)

    def _stations(self, toolpath: Toolpath, name: str, level: str, *, divided: bool | None) -> Stations:
        keys, only = self.job.keys, None
        if level == "sample":
            name, only = "engagement, sample", self._sampled()
        point, total = name.replace(", ", "_"), len(toolpath.blocks)
        known = self.record.known(point)
        files = [] if known is None else [self.folder / known["file"]]
        if self.asked.parts is not None and point == "engagement":
            files = self.asked.parts.contact
        stations = engagement_pass(
            self.job, toolpath, stop=self.stop, progress=self.progress, name=name, feed=keys.feed, divided=divided,
            only=only, workers=self.asked.workers,
            known=files, part=None if self.asked.part is None else (self.asked.part.number - 1, self.asked.part.of),
            checkpoint=lambda state, done: self.record.checkpoint(point, state, done, total),
        )  # fmt: skip
        if only is not None:
            stations.notes += (
                f"contact columns are of {len(only)} blocks (sample); `vmachining contact` computes all",
            )
        return stations

    def _sampled(self) -> set[int]:
        """Some of the blocks that remove something, the last one among them."""
        rows = read_partial(self.rows, ["block", "removed_hi_mm3"])
        numbers = rows.filter(rows["removed_hi_mm3"] > 0.0)["block"].to_list()
        count = min(CONTACT_SAMPLE, len(numbers))
        return {numbers[((k + 1) * len(numbers)) // count - 1] for k in range(count)}

    # -- program and stock ---------------------------------------------------------------------------------

    def _refuse_early(self, toolpath: Toolpath, tools: Mapping[int, ToolParts], stock: Stock) -> None:
        """No simulation for a cut without a tool, or for a path that by its box alone misses the stock."""
        refuse_unknown_tools(toolpath.program, tools, ", ".join(map(str, sorted(tools))))
        idle = (Motion.RAPID, Motion.DWELL)
        if not any(m.motion not in idle for m in toolpath.near(tools, stock.bounds)):
            raise self._never_reached(toolpath, tools, stock)

    def _never_reached(self, toolpath: Toolpath, tools: Mapping[int, ToolParts], stock: Stock) -> StockError:
        lo, hi = stock.bounds.round(3).tolist()
        what = f"no feed move of {Path(toolpath.program.name).name} reaches the stock, which lies from {lo} to {hi} mm"
        remedy = "compare work offset, units and home of the program with the stock"
        rapid = next((m for m in toolpath.near(tools, stock.bounds) if m.motion is Motion.RAPID), None)
        if rapid is not None:
            what += f"; the rapid in line {rapid.line} goes into its box, but rapids cut nothing"
            remedy = f"program cuts with G1, G2 or G3, or {remedy}"
        return StockError(what, **self.job.where("stock"), remedy=remedy)

    def _stage(self, name: str, given: Given, counts: Callable[[float], int] | None) -> Engine:
        """A pass of the run, see `Cutting.run`; only the program itself is divided in parts."""
        own = name == "program"
        with self.spent.on("cut"):
            engine = self.cutting.run(name, given, counts, self.asked.part, self.asked.parts if own else None)
        self.spent.workers_mb = self.cutting.peak_mb
        return engine
