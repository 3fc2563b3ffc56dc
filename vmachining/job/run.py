"""One job from file to result: the only place that wires the rooms together."""

from __future__ import annotations

import os
import resource
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vmachining.engines import RAYS, engine_class, entry_of
from vmachining.engines.protocol import Engine
from vmachining.errors import InputError, NCError, StockError
from vmachining.job.audit import MOST, audited
from vmachining.job.brep import Asked, blank, brep_columns, parse_brep, refuse_beyond
from vmachining.job.choice import affordable
from vmachining.job.contact import Contacts, ToolParts
from vmachining.job.cost import APART_SAVES, APART_SECONDS, refuse_fine
from vmachining.job.deviation import deviation_tables
from vmachining.job.engagement_columns import Saves, Stations, coefficients_of, engagement_pass, no_stations
from vmachining.job.executor import executor
from vmachining.job.files import (
    MANIFEST,
    Scratch,
    atomic_path,
    fingerprints,
    is_full,
    make_folder,
    versions,
)
from vmachining.job.folder import RUN, WORKING, FolderLock, ResultFolder, now, program_words, refuse_other_run
from vmachining.job.jobfile import Job
from vmachining.job.notes import notes_of, quiet_findings
from vmachining.job.reading import read_job_program, refuse_unknown_tools
from vmachining.job.result import RunResult
from vmachining.job.schedule import compare, sample_count
from vmachining.job.simulate import CHECKPOINT_SECONDS, Progress, Stage
from vmachining.job.stock import raw_stock
from vmachining.job.stopping import stop_flag
from vmachining.job.strategies import Planned, plan
from vmachining.job.summary import NO_BREP, run_summary
from vmachining.job.table import RowFile, drop_torn_row, finish, read_partial
from vmachining.job.timing import MoveTimes, machine_limits, move_times
from vmachining.job.toolpath import Toolpath
from vmachining.job.verified import Written, divided_edits, verified, write_again
from vmachining.job.workpiece import raw_engine
from vmachining.machine import described
from vmachining.nc import Motion, Program
from vmachining.stock import Stock
from vmachining.sweep import Sweep
from vmachining.tolerance import BREP_SECONDS

if TYPE_CHECKING:
    import polars as pl

__all__ = ["run"]

MAX_WORKERS = 8
"""Neighbouring tiles have few colours, so more processes would wait for each other."""

FAST_AUDIT = 4
"""Blocks that exact rays look at after the vectors engine, which cuts a hundred blocks in the time of one such block."""

ROWS = dict(zip(("program", "scheduled", "pieces"), WORKING, strict=False))
"""Where the rows of a pass grow."""

NO_CONTACT = "contact columns are empty: --engine vectors measures the deviation; [force] or [feed] in the job asks for both"


def run(
    job: Job | Path | str,
    *,
    engine: str | None = None,
    chord: float | None = None,
    certify: bool = False,
    out: Path | str | None = None,
    resume: bool = False,
    workers: int | None = None,
    brep: str = "none",
    brep_seconds: float = BREP_SECONDS,
    every_strategy: bool = False,
    progress: Progress | None = None,
    stop: Callable[[], bool] | None = None,
    lock: FolderLock | None = None,
    command: Sequence[str] | None = None,
) -> RunResult:
    """Simulate a job: removed volume with its bracket per block, contacts, times, and the schedule if asked.

    Parameters
    ----------
    job : or the file of one.
    engine : a name of `vmachining.engines.ENGINES`; None: `columns` where they take the stock and at least half of the feed
        motions (what they do not take goes to `mesh`, block by block), else `mesh`. chord : mm, instead of chord_mm of the job;
        a note of the summary says so where it changed nothing.
    certify : accepted from earlier versions; `mesh` always proves its brackets by two workpieces.
    out : directory for tables while they grow; None: a temporary one, until `RunResult.write`.
    resume : go on after an interruption, from the checkpoint in `out`.
    workers : processes that cut; None: one per core where the program is long enough. Of `mesh` it changes no
        number beyond rounding, of `columns` none beyond the width that is asked for.
    brep : blocks whose volume the B-rep engine checks: "none", "sample", "all" or numbers such as "3,7-12".
    brep_seconds : of a processor, limit of one such block, and of the solids and every mesh of each sweep that it needs.
    every_strategy : judge all feed strategies by simulation, also where [feed] inserts blocks: one simulation more. Without
        inserted blocks they always are.
    progress : called with stage name, blocks done, blocks in all.
    stop : asked between blocks whether to stop; None: SIGINT and SIGTERM do.
    lock : of `out`, when the caller goes on to write there; None: `out` is locked until this returns.
    command : the words of the command line, for the manifest; None: those that this process was started with.

    Raises
    ------
    InputError
        Program, tools or stock cannot be used; a path that never reaches the stock; `out` holds a file that is not
        ours under a name that results have, or another run is writing there; the disk is full.
    Stopped
        SIGINT or SIGTERM: rows, checkpoint and manifest are on disk, `resume` goes on.
    EngineError
        A kernel failed; names the block.
    """
    if engine is not None:
        engine_class(engine)
    job = Job.of(job)
    if chord is not None:
        job = job.with_chord(chord)
    asked = parse_brep(brep)
    if not brep_seconds > 0.0:
        raise InputError(f"brep_seconds {brep_seconds:g} is no limit", remedy="give seconds above 0")
    begin = time.perf_counter()
    if resume and out is None:
        raise InputError("resume wants the directory of the interrupted run")
    keep = Scratch() if out is None else None
    folder = Path(keep.name if keep else str(out))
    options = {
        "engine": engine, "chord_mm": job.keys.accuracy.chord_mm, "brep": brep,
        "width": job.keys.accuracy.width, "width_mm3": job.keys.accuracy.width_mm3,
        "spacing_mm": job.keys.accuracy.spacing_mm, "directions": job.keys.accuracy.directions,
        "brep_seconds": brep_seconds,
    }  # fmt: skip
    if every_strategy:
        options["every_strategy"] = True
    with stop_flag(stop) as stopped, FolderLock(folder) as own:
        work = _Run(
            job, folder, options, resume, workers, asked, brep_seconds, progress or (lambda *_: None),
            stopped, lock or own,
            [*(program_words() if command is None else command)], chord_given=chord is not None,
        )  # fmt: skip
        try:
            result = work.go()
        except BaseException:
            with suppress(InputError):  # where nothing can be written, what was written last still holds
                work.save_manifest()
            raise
        work.save_manifest()
    result.summary["seconds"] = work.earlier_seconds + time.perf_counter() - begin
    result.summary["peak_mb"] = _peak_mb() + work.workers_mb
    result._keep = keep
    return result


def _peak_mb() -> float:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1024.0 * 1024.0 if sys.platform == "darwin" else 1024.0)


@dataclass(slots=True, eq=False)
class _Run:
    """State of one run: what is where on disk, and how far it is."""

    job: Job
    folder: Path
    options: dict[str, Any]
    resume: bool
    workers: int | None
    brep: Asked
    brep_seconds: float
    progress: Progress
    stop: Callable[[], bool]
    lock: FolderLock
    command: list[str]
    chord_given: bool = False
    place: ResultFolder = field(init=False)
    raw: Engine | None = None
    earlier_seconds: float = 0.0
    workers_mb: float = 0.0
    longest_s: float = 0.0
    started: float = field(default_factory=time.perf_counter)

    def __post_init__(self) -> None:
        self.place = ResultFolder(self.folder)

    @property
    def manifest(self) -> dict[str, Any]:
        """What will be known of this run; empty until it begins to write."""
        return self.place.manifest

    def go(self) -> RunResult:
        """What is refused here is refused before the first byte: an earlier result stays as it is."""
        job = self.job
        tools = {number: ToolParts.of(tool) for number, tool in job.tools.items()}
        toolpath = Toolpath.of(read_job_program(job), job.machine)
        program, blocks = toolpath.program, toolpath.blocks
        if not blocks:
            raise NCError(
                "the program moves nothing", file=str(job.program_path), remedy="is it the right file?"
            )
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
            engine_name, longest = affordable(job, toolpath, tools, stock, asked, chord)
            self.options["engine"], self.longest_s = engine_name, longest if engine_name == "mesh" else 0.0
        if not self.resume:  # what an engine refuses is refused before the first byte
            self.raw = self._raw(stock)
        refuse_beyond(self.brep, blocks[-1].number)
        if isinstance(self.brep, tuple) and all(
            blocks[k].motion == "rapid" for part in self.brep for k in part
        ):
            raise InputError("--brep: these blocks are rapids, which cut nothing", remedy="ask for others")
        coefficients_of(job)  # a missing file is said now
        make_folder(self.folder)
        self.lock.acquire()
        self._open_manifest(program.files)
        feed = job.keys.feed
        every = bool(self.options.get("every_strategy"))
        divided = feed is not None and feed.insert_blocks and (every or feed.strategy == "volume")
        counts = (lambda length: sample_count(feed, length)) if feed and divided else None
        engine = self._stage("program", toolpath, times, tools, stock, counts, check=True)
        partial = self.folder / "blocks.partial.csv"
        if not float(read_partial(partial, ["removed_hi_mm3"])["removed_hi_mm3"].sum()) > 0.0:
            raise self._never_reached(program, stock)
        along = feed is not None and feed.insert_blocks and (every or feed.strategy != "volume")
        stations = self._contact(toolpath, "engagement", divided=along)
        scheduled, report, after = None, None, None
        if feed is not None:
            table = read_partial(partial, ["length_mm", "feed_mm_min", "removed_mm3", "removed_hi_mm3"])
            planned = plan(feed, program, blocks, table, partial, times.cap_mm_min, stations, every=every)
            mine = write_again(job, self.place, program, planned.schedule.edits(), "scheduled.nc")
            self._stage("scheduled", mine.toolpath, mine.times, tools, stock, None, check=False)
            after = mine.times
            new_rows = self.folder / "scheduled_blocks.partial.csv"
            contact = self._contact(mine.toolpath, "engagement, scheduled").columns
            with self.place.making("scheduled_blocks.csv", "scheduled_blocks.parquet"):
                finish(new_rows, self.folder, "scheduled_blocks", contact=contact)
            if every or not feed.insert_blocks:
                table = self._every(planned, mine, toolpath, times, stations, tools, stock)
                planned = replace(planned, comparison=table)
            with (
                self.place.making("strategies.csv"),
                atomic_path(self.folder / "strategies.csv") as temporary,
            ):
                planned.comparison.write_csv(temporary)
            scheduled, report = compare(feed, planned, mine.text, blocks, read_partial(new_rows))
        names = ["block", "motion", "engine", "removed_mm3", "removed_lo_mm3", "removed_hi_mm3"]
        table = read_partial(partial, names)
        opinion, counts_brep = None, NO_BREP
        if self.brep == "none" and self.options["engine"] not in RAYS:
            most = FAST_AUDIT if self.options["engine"] == "vectors" else MOST
            opinion, counts_brep = audited(
                toolpath, tools, table, stock, most=most, stop=self.stop, progress=self.progress
            )
        elif self.brep != "none":
            opinion, counts_brep = brep_columns(
                job, toolpath, tools, table, self.brep,
                stock=stock, file=self.folder / "brep.partial.csv", workers=self.workers,
                seconds=self.brep_seconds, stop=self.stop, progress=self.progress,
            )  # fmt: skip
        with self.place.making("blocks.csv", "blocks.parquet"):
            finish(partial, self.folder, "blocks", scheduled, opinion, stations.columns)
        result = RunResult(
            job=job,
            toolpath=toolpath,
            summary={},
            inputs=self.manifest["inputs"],
            stock=engine,
            schedule=report,
            folder=self.folder,
            place=self.place,
            lock=self.lock,
            findings=quiet_findings(toolpath),
        )
        result.summary = run_summary(result, stock, times, after, self.options, chord_given=self.chord_given)
        if (deviation := deviation_tables(job, engine, self.place)) is not None:
            result.summary |= deviation
        elif job.keys.design is not None:
            result.summary["design_note"] = (
                "The design was not looked at: --engine vectors and --engine dexel measure against it"
            )
        result.summary["brep"] = dict(counts_brep)
        result.summary["contact_notes"] = list(stations.notes)
        return result

    def _raw(self, stock: Stock) -> Engine:
        """The raw workpiece."""
        return raw_engine(self.job, self.options["engine"], stock)

    def _every(
        self,
        planned: Planned,
        mine: Written,
        toolpath: Toolpath,
        times: MoveTimes,
        stations: Stations,
        tools: Mapping[int, ToolParts],
        stock: Stock,
    ) -> pl.DataFrame:
        """The comparison of all strategies, of written programs."""
        feed, program = self.job.keys.feed, toolpath.program
        assert feed is not None
        programs = {
            name: mine
            if name == feed.strategy
            else write_again(self.job, self.place, program, schedule.edits(), f"scheduled_{name}.nc")
            for name, schedule in planned.plans.items()
        }

        def simulate() -> tuple[Written, pl.DataFrame, Stations]:
            divided = write_again(self.job, self.place, program, divided_edits(planned.plans), "pieces.nc")
            self._stage("pieces", divided.toolpath, divided.times, tools, stock, None, check=False)
            rows = read_partial(self.folder / ROWS["pieces"], ["length_mm", "removed_mm3", "removed_hi_mm3"])
            return divided, rows, self._contact(divided.toolpath, "engagement, pieces", divided=True)

        return verified(feed, planned, programs, toolpath, times, stations, simulate)

    def _contact(self, toolpath: Toolpath, name: str, *, divided: bool | None = None) -> Stations:
        """Contact, chips and forces along the blocks."""
        keys = self.job.keys
        if self.options["engine"] == "vectors" and keys.feed is None and keys.force is None:
            return no_stations(len(toolpath.blocks), NO_CONTACT)
        point, total = name.replace(", ", "_"), len(toolpath.blocks)
        known = self.manifest["checkpoints"].get(point)
        return engagement_pass(
            self.job, toolpath, stop=self.stop, progress=self.progress, name=name, feed=keys.feed, divided=divided,
            known=None if known is None else self.folder / known["file"],
            checkpoint=lambda state, done: self._checkpoint(point, state, done, total),
        )  # fmt: skip

    # -- program and stock ---------------------------------------------------------------------------------

    def _refuse_early(self, toolpath: Toolpath, tools: Mapping[int, ToolParts], stock: Stock) -> None:
        """No simulation for a cut without a tool, or for a path that by its box alone misses the stock."""
        lo, hi = stock.bounds
        refuse_unknown_tools(toolpath.program, tools, ", ".join(map(str, sorted(tools))))
        for move, path in zip(toolpath.moves, toolpath.paths, strict=True):
            if move.motion in (Motion.RAPID, Motion.DWELL):
                continue
            a, b = Sweep.along(tools[move.tool].cutter, path).bounds
            if (a < hi).all() and (b > lo).all():
                return
        raise self._never_reached(toolpath.program, stock)

    def _never_reached(self, program: Program, stock: Stock) -> StockError:
        lo, hi = stock.bounds.round(3).tolist()
        return StockError(
            f"no feed move of {Path(program.name).name} reaches the stock, which lies from {lo} to {hi} mm",
            **self.job.where("stock"),
            remedy="compare work offset, units and home of the program with the stock",
        )

    # -- stages, checkpoints, manifest ---------------------------------------------------------------------

    def _stage(
        self,
        name: str,
        toolpath: Toolpath,
        times: MoveTimes,
        tools: Mapping[int, ToolParts],
        stock: Stock,
        counts: Callable[[float], int] | None,
        *,
        check: bool,
    ) -> Engine:
        """Run or finish one pass; its rows are on disk and its last state is a checkpoint."""
        known = self.manifest["checkpoints"].get(name)
        kind, first = engine_class(self.options["engine"]), 0
        if known is not None:
            engine, first = kind.load(self.folder / known["file"]), int(known["done"])
        else:
            engine = self.raw or self._raw(stock)
            self.raw = None
        rows_path = self.folder / ROWS[name]
        workers = self._workers(len(toolpath.blocks) - first)
        self.options["workers"] = max(workers, self.options.get("workers", 1))
        apart = self.longest_s > APART_SECONDS
        hands = executor(engine, workers, apart=apart)
        stage = Stage(
            name=name, toolpath=toolpath, move_time_s=times.seconds.tolist(), tools=tools,
            notes=notes_of(toolpath.program) if check else {}, executor=hands,
            contacts=Contacts(hands, stock.bounds) if check else None, sample_counts=counts,
            save_every=APART_SAVES if apart else CHECKPOINT_SECONDS,
        )  # fmt: skip

        def checkpoint(done: int) -> None:
            self._checkpoint(name, hands, done, len(toolpath.blocks))

        try:
            with RowFile(rows_path, keep=first) as rows:
                stage.run(rows, first=first, stop=self.stop, progress=self.progress, checkpoint=checkpoint)
            last = "pieces" if self.options.get("every_strategy") else "scheduled"
            later = self.brep != "none" or (self.job.keys.feed is not None and name != last)
            if later and first < len(toolpath.blocks):
                checkpoint(len(toolpath.blocks))  # what comes may be interrupted, this pass is done
            self.workers_mb = max(self.workers_mb, hands.peak_mb())
            return hands.finish()
        except InputError as exc:
            if is_full(exc):
                raise self._disk_full(name, rows_path, len(toolpath.blocks), exc) from exc
            raise
        finally:
            hands.close()

    def _disk_full(self, name: str, rows: Path, total: int, cause: InputError) -> InputError:
        """What is there of a pass that could not go on."""
        kept, point = drop_torn_row(rows), self.manifest["checkpoints"].get(name)
        goes_on = "starts again" if point is None else f"goes on behind block {point['done']}"
        return InputError(
            f"{cause.message}; {kept} of {total} blocks are in {rows.name}", file=cause.file,
            remedy=f"make room, then --resume {goes_on}",
        )  # fmt: skip

    def _workers(self, blocks: int) -> int:
        """Processes that cut: as asked for; else all cores, where starting them is worth it."""
        if self.workers is not None:
            return self.workers
        entry = entry_of(self.options["engine"])
        return min(os.cpu_count() or 1, MAX_WORKERS) if blocks >= entry.divided_from else 1

    def _checkpoint(self, name: str, state: Saves, done: int, total: int) -> None:
        """Save the workpiece or what is known of contact, then point the manifest to it, then forget the one before."""
        target = self.folder / f"checkpoint.{name}.{done}.npz"
        self.progress("saving", 0, 1)
        with self.place.making(target.name), atomic_path(target) as temporary:
            state.save(temporary)
        self.progress("saving", 1, 1)
        old = self.manifest["checkpoints"].get(name)
        self.manifest["checkpoints"][name] = {"file": target.name, "done": done, "total": total}
        self.save_manifest()
        if old is not None and old["file"] != target.name:
            with suppress(OSError):
                (self.folder / old["file"]).unlink()
            self.manifest["files"].pop(old["file"], None)

    def _open_manifest(self, subprograms: tuple[str, ...]) -> None:
        roles = self.job.inputs | {f"subprogram {k}": Path(name) for k, name in enumerate(subprograms, 1)}
        inputs = fingerprints(roles)
        self.place.refuse_foreign(roles)
        old = self.place.earlier()
        fresh: dict[str, Any] = {
            "kind": RUN, "job": self.job.name, "complete": False, "command": self.command, "process": os.getpid(),
            "started": now(), "ended": None, "seconds": 0.0, "options": self.options, "inputs": inputs,
            "machine": described(self.job.machine) if self.job.machine else None,
            "versions": versions(), "checkpoints": {}, "files": dict.fromkeys(WORKING),
        }  # fmt: skip
        if not self.resume or old is None or not old.get("checkpoints"):  # nothing to go on with
            self.place.forget()
            self.place.manifest = fresh
            self.save_manifest()  # from here on the directory says that it is not complete
            return
        refuse_other_run(old, fresh, str(self.folder / MANIFEST))
        self.place.tidy()
        self.earlier_seconds = float(old.get("seconds", 0.0))
        fresh["started"] = old.get("started", fresh["started"])
        fresh["files"] |= self.place.made()
        fresh["checkpoints"] = {
            name: entry
            for name, entry in old.get("checkpoints", {}).items()
            if (self.folder / entry["file"]).is_file()
        }
        self.place.manifest = fresh

    def save_manifest(self) -> None:
        """Write the manifest with the time spent so far."""
        if self.manifest:
            self.manifest["seconds"] = self.earlier_seconds + time.perf_counter() - self.started
            self.manifest["ended"] = now()
            self.place.save()
