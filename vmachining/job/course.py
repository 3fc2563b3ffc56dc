"""A run on its way from its job to the result: the only place that wires the rooms together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vmachining.engines import RAYS
from vmachining.engines.protocol import Engine
from vmachining.errors import InputError, NCError
from vmachining.job.audit import MOST, audited
from vmachining.job.brep import Asked, asked_numbers, blank, brep_columns, refuse_beyond
from vmachining.job.chunks import Beside
from vmachining.job.contact import ToolParts
from vmachining.job.cost import affordable, never_reached, refuse_fine, refuse_no_cut
from vmachining.job.cutting import ROWS, Cutting
from vmachining.job.deviation import deviation_tables
from vmachining.job.engagement_columns import coefficients_of, engagement_pass
from vmachining.job.files import atomic_path, make_folder
from vmachining.job.folder import FolderLock, ResultFolder, program_words
from vmachining.job.given import Given, Opinion, Planning, RunOptions
from vmachining.job.jobfile import Job
from vmachining.job.kept import finer, judged
from vmachining.job.model import Feed
from vmachining.job.parts import Part
from vmachining.job.reading import read_job_program
from vmachining.job.record import Record, Spent
from vmachining.job.result import RunResult
from vmachining.job.schedule import compare, sample_count
from vmachining.job.stations import LEFT_OUT, MOST_MAPPED, NO_CONTACT, Stations, no_stations, sampled
from vmachining.job.stock import raw_stock
from vmachining.job.strategies import Planned, plan
from vmachining.job.summary import quiet_findings, run_summary, slack_of
from vmachining.job.table import MOST_CSV, NO_CSV, finish, read_partial, refed
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
from vmachining.memory import give_back
from vmachining.progress import Progress

if TYPE_CHECKING:
    import polars as pl

FAST_AUDIT = 4
"""Blocks that exact rays look at after the vectors engine, which cuts a hundred blocks in the time of one such block."""


@dataclass(slots=True, eq=False)
class Course:
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
    lacks_csv: bool = False
    """Whether a table has been written as Parquet alone."""

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
        give_back()  # as much as what stays, of a long program
        engine = self._stage("program", given, self._counts())
        table = read_partial(self.rows, ["block", "motion", "engine", "time_s", "proven", *ENDS])
        if not float(table["removed_hi_mm3"].sum()) > 0.0:
            raise never_reached(self.job, given.toolpath, given.tools, given.stock)
        planned = Planning()
        threads = self.cutting.workers_for(len(given.toolpath.blocks)) if self.cutting.by_columns else 1
        with Beside(threads) as beside:  # contact is laid out by one thread
            slack = slack_of(given.stock)
            summed = beside.later(lambda: total_of(table, engine.stock_volume, engine.volume, slack))
            seen = self.progress if threads == 1 else lambda *_: None
            audit = beside.later(partial(self._audit, given, table, seen)) if self._audits else None
            stations = self._contact(given.toolpath, "engagement", divided=self._stations_along())
            with self.spent.on("cut"):
                total = summed()
            if self.job.keys.feed is not None and "plan" in self.options["stages"]:
                with self.spent.on("plan"):
                    planned = self._plan(self.job.keys.feed, given, stations, total)
            opinion = self._opinion(given, table, audit)
        give_back()
        with self.spent.on("files"):
            estimates = settled(table, total)
            self._finish(self.rows, "blocks", stations.columns, estimates, planned.scheduled, opinion.rows)
            return self._result(given, engine, total, planned, opinion, stations)

    def _finish(
        self, rows: Path, stem: str, contact: pl.DataFrame, estimates: pl.DataFrame | None,
        scheduled: pl.DataFrame | None = None, opinion: pl.DataFrame | None = None,
    ) -> None:  # fmt: skip
        """A table of the result, see `table.finish`."""
        csv = len(contact) <= MOST_CSV or bool(self.options.get("csv"))
        self.lacks_csv |= not csv
        with self.place.making(f"{stem}.parquet", *([f"{stem}.csv"] * csv)):
            finish(rows, self.folder, stem, scheduled, opinion, contact, estimates, csv=csv)

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
        job, fresh = self.job, not (self.asked.resume or self.asked.part or self.asked.parts)
        tools = {number: ToolParts.of(tool) for number, tool in job.tools.items()}
        if fresh and job.program_path.is_file():  # as if every line moved: they load while it is read
            self.cutting.hire(job.program_path.read_bytes().count(b"\n"))
        toolpath = Toolpath.of(read_job_program(job), job.machine)
        program, blocks = toolpath.program, toolpath.blocks
        if not blocks:
            raise NCError(
                "the program moves nothing", file=str(job.program_path), remedy="is it the right file?"
            )
        if fresh:
            self.cutting.hire(len(blocks))
        limits, skips = machine_limits(job), job.keys.program.block_delete
        times = move_times(toolpath, limits, block_delete=skips)
        chord, asked = self.options["chord_mm"], self.options["engine"]
        if asked == "mesh":
            refuse_fine(job, tools, chord)
        stock = raw_stock(job)
        if self.brep != "none":
            blank(job, stock)
        refuse_no_cut(job, toolpath, tools, stock)
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
        parts = [] if self.asked.parts is None else [*self.asked.parts.cut, *self.asked.parts.contact]
        self.record.open(
            job, self.options, words, program.files, parts, resume=self.asked.resume, force=self.asked.force
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
        contact = self._contact(mine.toolpath, "engagement, scheduled")
        verdict = judged(feed, planned, mine, new_rows, contact, blocks)
        if verdict.lowered is not None:  # other feeds of the same motions: what was cut stays
            planned = planned.with_schedule(feed.strategy, verdict.lowered)
            before = mine
            mine = write_again(job, self.place, program, planned.schedule.edits(), written)
            refuse_other_motions(before.toolpath, mine.toolpath)
            contact = self._contact(mine.toolpath, "engagement, lowered")
            verdict = judged(feed, planned, mine, new_rows, contact, blocks)
        after = mine.times
        cut = refed(new_rows, *block_feeds(mine.toolpath, after))
        estimates = settled(cut, total)
        if estimates is not None:
            cut = cut.update(estimates, on="block")
        changed = cut.select("block", "feed_mm_min", "time_s", "removed_mm3", "mrr_mm3_min")
        self._finish(new_rows, "scheduled_blocks", contact.columns, changed)
        if self._every_one or not feed.insert_blocks:
            table = self._every(planned, mine, given, stations)
            planned = replace(planned, comparison=table)
        for name, told in (("strategies.csv", planned.comparison), ("references.csv", planned.references)):
            if told is not None:
                with self.place.making(name), atomic_path(self.folder / name) as temporary:
                    told.write_csv(temporary)
        scheduled, report = compare(feed, planned, mine.text, blocks, cut, verdict.passed)
        return Planning(scheduled, report, after)

    def _opinion(self, given: Given, table: pl.DataFrame, audit: Callable[[], Opinion] | None) -> Opinion:
        """What other engines say of the volumes. table : rows of the run. audit : see `_audit`."""
        toolpath, tools, stock = given.toolpath, given.tools, given.stock
        if self.options["brep"] != "none":
            with self.spent.on("check"):
                return Opinion(*brep_columns(
                    self.job, toolpath, tools, table, asked_numbers(self.options["brep"], table),
                    stock=stock, file=self.folder / "brep.partial.csv", workers=self.asked.workers,
                    seconds=self.asked.brep_seconds, stop=self.stop, progress=self.progress,
                ))  # fmt: skip
        if audit is None:
            return Opinion()
        with self.spent.on("judge"):
            return audit()

    @property
    def _audits(self) -> bool:
        """Whether exact rays are asked."""
        return (
            self.options["brep"] == "none"
            and "judge" in self.options["stages"]
            and self.options["engine"] not in RAYS
        )

    def _audit(self, given: Given, table: pl.DataFrame, progress: Progress) -> Opinion:
        """What exact rays say of the volumes."""
        measures = self.options["engine"] == "vectors"
        return Opinion(*audited(
            given.toolpath, given.tools, table, given.stock, most=FAST_AUDIT if measures else MOST, total=not measures,
            stop=self.stop, progress=progress,
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
            sweeps=stations.sweeps if len(given.toolpath.blocks) <= MOST_MAPPED else None,
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
        if self.lacks_csv:
            result.summary["table_note"] = NO_CSV
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
            name, only = "engagement, sample", sampled(self.rows)
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

    def _stage(self, name: str, given: Given, counts: Callable[[float], int] | None) -> Engine:
        """A pass of the run, see `Cutting.run`; only the program itself is divided in parts."""
        own = name == "program"
        with self.spent.on("cut"):
            engine = self.cutting.run(name, given, counts, self.asked.part, self.asked.parts if own else None)
        return engine
