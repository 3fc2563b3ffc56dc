"""One job of a batch, wherever it runs: an order in, a row out; `Pool`, what does jobs, seen from `run_many`; and processes of
this machine that do jobs."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from multiprocessing import connection
from multiprocessing.connection import Connection
from pathlib import Path
from queue import SimpleQueue
from typing import Any, NamedTuple, Protocol, TypeAlias

from vmachining.errors import EngineError, InputError, VMachiningError
from vmachining.job.brep import blank
from vmachining.job.files import MANIFEST, sha256
from vmachining.job.folder import FolderLock, ResultFolder
from vmachining.job.jobfile import Job
from vmachining.job.parts import Part
from vmachining.job.run import run, run_part
from vmachining.job.simulate import Stopped
from vmachining.job.store import finished, same_inputs
from vmachining.processes import Child, dismiss, start
from vmachining.progress import Progress

NUMBERS = (
    "blocks", "removed_mm3", "removed_lo_mm3", "removed_hi_mm3", "proven", "stated_blocks", "stock_mm3", "final_mm3", "time_s",
    "scheduled_time_s", "warnings", "seconds", "peak_mb",
)  # fmt: skip
FEEDS = ("mean_feed_mm_min", "scheduled_mean_feed_mm_min")
BATCH_COLUMNS = ("job", "name", "out", "status", "exit_code", "message", *NUMBERS, *FEEDS)
"""status: done, skipped (complete before), failed, interrupted. out: empty where nothing was written."""

Row: TypeAlias = dict[str, Any]


class Order(NamedTuple):
    """What a process is asked to do.

    file : of the job. folder : where its results go. formats : of the finished workpiece.
    resume : continue with whatever an earlier batch left there.
    command : words of the command line, for the manifest.
    before : `mark` of the folder before this batch; another one is the trace of an earlier attempt of this batch, which
        is continued.
    patience : s to wait for the lock of the folder: the process of an earlier attempt may be about to end.
    part : of the run, alone. options : of the run, by name; with a part also what takes the place of the job's accuracy.
    """

    file: str
    folder: str
    formats: tuple[str, ...]
    resume: bool
    command: tuple[str, ...]
    before: str | None
    patience: float
    part: Part | None = None
    options: dict[str, Any] | None = None


ACCURACY = ("chord", "width", "spacing", "directions")


def with_accuracy(
    job: Job, *, chord: float | None, width: str | None, spacing: float | None, directions: int | None
) -> Job:
    """A job with what was given in place of its [accuracy]."""
    job = job if chord is None else job.with_chord(chord)
    job = job if width is None else job.with_width(width)
    return job.with_spacing(spacing, directions)


def mark(folder: Path) -> str | None:
    """Digest of the manifest in a folder, None where none exists: whether somebody wrote there is seen by it."""
    try:
        return sha256(folder / MANIFEST)
    except InputError:
        return None


def one_job(order: Order, *, stop: Callable[[], bool], progress: Progress | None = None) -> Row:
    """Do a job; never raises what the user can cause."""
    row: Row = dict.fromkeys(BATCH_COLUMNS)
    row |= {"job": order.file, "status": "failed", "exit_code": 3, "message": ""}
    out = Path(order.folder)
    begun = mark(out) not in (None, order.before)
    try:
        if stop():
            raise Stopped("batch", 0, 1)
        job = Job.load(order.file)
        row["name"] = job.name
        given = dict(order.options or {})
        if order.part is not None:
            job = with_accuracy(job, **{name: given.pop(name) for name in ACCURACY})
            given["chord"] = None
            with FolderLock(out) as lock:
                _acquire(lock, order.patience, stop)
                run_part(
                    job, order.part, out=out, resume=order.resume or begun, stop=stop, lock=lock, command=order.command,
                    progress=progress, **given,
                )  # fmt: skip
            return row | {"status": "done", "exit_code": 0, "out": order.folder}
        summary = finished(job, out, {"stock": order.formats} | given) if order.resume or begun else None
        row["status"] = "done" if begun else "skipped"
        if summary is None:
            row["status"] = "failed"
            if "step" in order.formats:
                blank(job)  # refuses before hours of cutting
            with FolderLock(out) as lock:
                _acquire(lock, order.patience, stop)
                # changed inputs start over: a batch that comes back needs today's answer
                go_on = (order.resume or begun) and same_inputs(job, ResultFolder(out).earlier())
                result = run(
                    job, out=out, resume=go_on, workers=1, stop=stop, lock=lock, command=order.command,
                    progress=progress, **given,
                )  # fmt: skip
                result.write(out, stock=order.formats)
            summary, row["status"] = result.summary, "done"
        row |= {name: summary.get(name) for name in NUMBERS} | _mean_feeds(out)
        disputed = summary.get("brep", {}).get("disputed", 0)
        row |= (
            {"exit_code": 1, "message": f"{disputed} blocks are disputed"} if disputed else {"exit_code": 0}
        )
    except Stopped as exc:
        row |= {"status": "interrupted", "exit_code": 130, "message": str(exc)}
    except EngineError as exc:
        row |= {"status": "failed", "message": str(exc)}
    except (VMachiningError, OSError) as exc:
        row |= {"status": "failed", "exit_code": 2, "message": str(exc)}
    except Exception as exc:
        row |= {"status": "failed", "message": f"internal failure: {type(exc).__name__}: {exc}"}
    if row["status"] == "skipped" or mark(out) not in (None, order.before):
        row["out"] = order.folder
    return row


def _acquire(lock: FolderLock, patience: float, stop: Callable[[], bool]) -> None:
    """Take the lock of a folder, waiting for a holder that may be about to end.

    Where nobody has patience, the run takes the lock itself, once it knows that it will write.
    """
    if patience <= 0.0 or not lock.path.is_dir():
        return
    deadline = time.monotonic() + patience
    while not lock.is_held:
        try:
            lock.acquire()
        except InputError:
            if stop() or time.monotonic() > deadline:
                raise
            time.sleep(0.2)


def _mean_feeds(out: Path) -> dict[str, float | None]:
    """mm/min over all blocks except rapids, dwells included; of the program and of the rewritten one."""
    import polars as pl

    def mean(table: Path) -> float | None:
        if not table.is_file():
            return None
        cut = pl.scan_parquet(table).filter(pl.col("motion") != "rapid")
        length, seconds = cut.select(pl.col("length_mm").sum(), pl.col("time_s").sum()).collect().row(0)
        return 60.0 * length / seconds if seconds > 0.0 else None

    tables = (out / "blocks.parquet", out / "scheduled_blocks.parquet")
    return {name: mean(table) for name, table in zip(FEEDS, tables, strict=True)}


def sparing(tell: Progress) -> Progress:
    """A progress that speaks three times a second at most, and at the end of a stage."""
    last = float("-inf")

    def update(stage: str, done: int, total: int) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= 0.3 or done == total:
            last = now
            tell(stage, done, total)

    return update


JobProgress: TypeAlias = Callable[[int, str, int, int], None]
"""Called with the number of the job, the name of its stage, blocks done and blocks in all."""


class Ended(NamedTuple):
    """A job that is through.

    job : its number. row : None where nobody is left who could have sent one; `status` and `message` say why.
    """

    job: int
    row: Row | None
    message: str = ""
    status: str = "failed"


class Pool(Protocol):
    """Processes, somewhere, that do a job each."""

    @property
    def room(self) -> int:
        """How many more jobs can be given now; 0 for ever once the pool is lost."""

    @property
    def busy(self) -> bool:
        """Whether a job is on its way."""

    @property
    def lost(self) -> str:
        """Why no job will ever be done any more; empty while that is not so."""

    def give(self, index: int, order: Order) -> None:
        """Have a job done."""

    def stop(self) -> None:
        """Let every job stop after the block that it is at."""

    def wait(self, seconds: float) -> Iterator[Ended]:
        """Jobs that are through, as soon as there are any, after some time at the latest."""

    def close(self) -> None:
        """Send everybody home."""


STOP = ("stop",)
"""What a process receives when the user asks to stop."""

ROW, PROGRESS = "row", "progress"
"""What it tells: ("row", row) once per order, ("progress", stage, done, total) before."""


def start_child() -> Child:
    return start("vmachining.job.batch.one", "serve")


def serve(descriptor: int) -> None:
    """Life of such a process: orders in, rows out. It ends with its parent: a killed batch must not leave somebody
    behind who writes into directories that a resumed batch writes into."""
    line = Connection(descriptor)
    orders: SimpleQueue[Order] = SimpleQueue()
    stop = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: stop.set())

    def listen() -> None:
        try:
            while True:
                message = line.recv()
                if message == STOP:
                    stop.set()
                else:
                    orders.put(message)
        except (EOFError, OSError):
            os._exit(1)

    threading.Thread(target=listen, daemon=True).start()
    progress = sparing(lambda *place: line.send((PROGRESS, *place)))
    try:
        while True:
            line.send((ROW, one_job(orders.get(), stop=stop.is_set, progress=progress)))
    except ConnectionError:  # nobody listens any more, and this was noticed before `listen` noticed it
        os._exit(1)


class LocalPool:
    """Up to so many processes of this machine; each does one job after the other.

    They start at once, for so many jobs, and import what they need while the job files are read.
    """

    lost = ""

    def __init__(self, workers: int, progress: JobProgress, jobs: int) -> None:
        self._workers, self._progress = workers, progress
        self._idle = [start_child() for _ in range(min(workers, jobs))]
        self._running: dict[Connection, tuple[int, subprocess.Popen[bytes]]] = {}

    @property
    def room(self) -> int:
        return self._workers - len(self._running)

    @property
    def busy(self) -> bool:
        return bool(self._running)

    def give(self, index: int, order: Order) -> None:
        process, line = self._idle.pop() if self._idle else start_child()
        self._running[line] = index, process
        with suppress(OSError):  # one that is dead is found out below
            line.send(order)

    def stop(self) -> None:
        for line in self._running:
            with suppress(OSError):
                line.send(STOP)

    def wait(self, seconds: float) -> Iterator[Ended]:
        for line in connection.wait(list(self._running), timeout=seconds):
            assert isinstance(line, Connection)
            index, process = self._running[line]
            try:
                kind, *told = line.recv()
            except (EOFError, OSError):
                del self._running[line]
                dismiss([(process, line)])
                yield Ended(index, None, "its process died")
                continue
            if kind == PROGRESS:
                self._progress(index, *told)
            else:
                del self._running[line]
                self._idle.append((process, line))
                yield Ended(index, told[0])

    def close(self) -> None:
        children = [*self._idle, *((process, line) for line, (_, process) in self._running.items())]
        dismiss(children)
