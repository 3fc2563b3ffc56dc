"""One pass of a run: the blocks of a program cut in order, here or in several processes, with rows and checkpoints on disk."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from vmachining.engines import engine_class, entry_of
from vmachining.engines.protocol import Engine
from vmachining.errors import FullError
from vmachining.job.contact import Contacts
from vmachining.job.cost import APART_SAVES, APART_SECONDS, SHARES
from vmachining.job.executor import Executor, InProcess, Staff, executor
from vmachining.job.folder import WORKING, usable
from vmachining.job.given import Given
from vmachining.job.jobfile import Job
from vmachining.job.parts import Noted, Part, Parts, Replayed
from vmachining.job.record import Record
from vmachining.job.simulate import CHECKPOINT_SECONDS, Stage
from vmachining.job.stock import raw_engine
from vmachining.job.summary import notes_of
from vmachining.job.table import RowFile, drop_torn_row
from vmachining.job.timing import block_feeds
from vmachining.memory import peak_mb
from vmachining.progress import Progress
from vmachining.stock import Stock

MAX_WORKERS = 8
"""Neighbouring tiles have few colours, so more processes would wait for each other."""

ROWS = dict(zip(("program", "scheduled", "pieces"), WORKING, strict=False))
"""Where the rows of a pass grow."""


@dataclass(slots=True, eq=False)
class Cutting:
    """Who cuts.

    options : of the run, with the engine; the processes that were used join them. workers : processes, None: as it pays.
    by_columns : whether columns take every motion. longest_s : s of the longest block of the mesh engine. raw : the raw
    workpiece, if it is already made. staff : those that are started ahead.
    """

    job: Job
    record: Record
    options: dict[str, Any]
    workers: int | None
    progress: Progress
    stop: Callable[[], bool]
    by_columns: bool = False
    longest_s: float = 0.0
    raw: Engine | None = None
    staff: Staff = field(default_factory=Staff)

    @property
    def engine(self) -> str:
        """Its name."""
        return str(self.options["engine"])

    def of(self, stock: Stock) -> Engine:
        """The raw workpiece."""
        return raw_engine(self.job, self.engine, stock)

    def run(
        self,
        name: str,
        given: Given,
        counts: Callable[[float], int] | None,
        part: Part | None,
        parts: Parts | None,
    ) -> Engine:
        """Run or finish one pass; its rows are on disk and its last state is a checkpoint.

        name : "program", which is also checked for rapids, shank and holder, or a key of `ROWS`. counts : see `Stage`.
        part : whose shares are cut alone. parts : that answer instead.
        """
        tools, toolpath, times, stock = given
        known = self.record.known(name)
        replays = parts is not None and self.by_columns and counts is None
        if replays and known is not None and known["done"] < len(toolpath.blocks):
            known = None  # of a run without parts: they answer from the first order on
        first = 0 if known is None else int(known["done"])
        point = None if known is None else self.record.place.path / known["file"]
        own = None if part is None else part.shares(self.shares(len(toolpath.blocks), 1))
        if point is not None and own is None:
            with usable(point) as file:
                engine = engine_class(self.engine).load(file)
        else:
            engine, self.raw = self.raw or self.of(stock), None
        rows_path = self.record.place.path / ROWS[name]
        left = len(toolpath.blocks) - first
        workers = self.workers_for(left)
        self.options["workers"] = max(workers, self.options.get("workers", 1))
        apart = self.longest_s > APART_SECONDS
        shares = self.shares(len(toolpath.blocks), workers) if known is None else int(known["shares"])
        hands: Executor
        if own is not None:
            hands = Noted(engine, shares, own, point)
        elif replays and parts is not None:
            hands = Replayed(engine, parts.cut)
        elif left:
            hands = executor(engine, workers, shares=shares, apart=apart, staff=self.staff)
            self.staff.close()
        else:
            hands = InProcess(engine)
        feed, seconds = block_feeds(toolpath, times)
        stage = Stage(
            name=name, toolpath=toolpath, feed=feed, seconds=seconds, tools=tools,
            notes=notes_of(toolpath.program) if name == "program" else {}, executor=hands,
            contacts=Contacts(hands, stock.bounds) if name == "program" else None, sample_counts=counts,
            save_every=APART_SAVES if apart else CHECKPOINT_SECONDS, stock=stock,
        )  # fmt: skip

        def checkpoint(done: int) -> None:
            if isinstance(hands, Replayed) and done < len(toolpath.blocks):
                return  # parts have the workpiece at the end only
            self.record.checkpoint(name, hands, done, len(toolpath.blocks), shares=shares, rows=rows.digest)

        try:
            with RowFile(rows_path, keep=first, digest=None if known is None else known["rows"]) as rows:
                stage.run(rows, first=first, stop=self.stop, progress=self.progress, checkpoint=checkpoint)
            if left:
                checkpoint(len(toolpath.blocks))  # what comes may be interrupted, this pass is done
            self.record.spent.most_mb = max(self.record.spent.most_mb, peak_mb() + hands.peak_mb())
            return hands.finish()
        except FullError as exc:
            kept, known = drop_torn_row(rows_path), self.record.known(name)
            goes_on = "starts again" if known is None else f"continues after block {known['done']}"
            what = f"{exc.message}; {kept} of {len(toolpath.blocks)} blocks are in {rows_path.name}"
            raise FullError(what, file=exc.file, remedy=f"{exc.remedy}, then --resume {goes_on}") from exc
        finally:
            hands.close()

    def shares(self, blocks: int, workers: int) -> int:
        """Shares of the workpiece: where columns take every motion a matter of the program alone, so that numbers are, too."""
        if not self.by_columns:
            return workers
        return SHARES if blocks >= entry_of(self.engine).divided_from else 1

    def hire(self, blocks: int) -> None:
        """Start the processes that will cut a program of so many blocks, as far as one can know before it is looked at."""
        engine = self.options["engine"] or "columns"
        entry, workers = entry_of(engine), self.workers_for(blocks, engine)
        if workers > 1 and entry.divisible and blocks >= entry.divided_from:
            self.staff.hire(min(workers, SHARES))

    def workers_for(self, blocks: int, engine: str | None = None) -> int:
        """Processes that cut: as asked for; else all cores, where starting them is worth it."""
        if self.workers is not None:
            return self.workers
        entry = entry_of(engine or self.engine)
        return min(os.cpu_count() or 1, MAX_WORKERS) if blocks >= entry.divided_from else 1
