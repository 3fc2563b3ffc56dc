"""One job of a batch, wherever it runs: an order in, a row out."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

from vmachining.errors import EngineError, InputError, VMachiningError
from vmachining.job.brep import blank
from vmachining.job.files import MANIFEST, read_manifest, sha256
from vmachining.job.folder import FolderLock, ResultFolder
from vmachining.job.jobfile import Job
from vmachining.job.run import run
from vmachining.job.simulate import Progress, Stopped

__all__ = ["BATCH_COLUMNS", "Order", "Row", "already_complete", "mark", "one_job", "sparing"]

NUMBERS = (
    "blocks", "removed_mm3", "removed_lo_mm3", "removed_hi_mm3", "stock_mm3", "final_mm3", "time_s",
    "scheduled_time_s", "warnings", "seconds", "peak_mb",
)  # fmt: skip
FEEDS = ("mean_feed_mm_min", "scheduled_mean_feed_mm_min")
BATCH_COLUMNS = ("job", "name", "out", "status", "exit_code", "message", *NUMBERS, *FEEDS)
"""status: done, skipped (complete before), failed, interrupted. out: empty where nothing was written."""

Row: TypeAlias = dict[str, Any]


class Order(NamedTuple):
    """What a process is asked to do.

    file : of the job. folder : where its results go. formats : of the finished workpiece.
    resume : go on with whatever an earlier batch left there.
    command : words of the command line, for the manifest.
    before : `mark` of the folder before this batch; another one is the trace of an earlier attempt of this batch, which
        is gone on with.
    patience : s to wait for the lock of the folder: the process of an earlier attempt may be about to end.
    """

    file: str
    folder: str
    formats: tuple[str, ...]
    resume: bool
    command: tuple[str, ...]
    before: str | None
    patience: float


def mark(folder: Path) -> str | None:
    """Digest of the manifest in a folder, None where there is none: whether somebody wrote there is seen by it."""
    try:
        return sha256(folder / MANIFEST)
    except InputError:
        return None


def _same_inputs(job: Job, manifest: dict[str, Any] | None) -> bool:
    """Whether a manifest is about exactly the files of a job."""
    if manifest is None:
        return False
    inputs = manifest.get("inputs", {})
    for role, entry in inputs.items():  # a program may call others, in files that only its last run knows
        if role.startswith("subprogram"):
            file = Path(entry["file"])
            if not file.is_file() or sha256(file) != entry["sha256"]:
                return False
    known = {role: entry["sha256"] for role, entry in inputs.items() if not role.startswith("subprogram")}
    return known == {role: sha256(path) for role, path in job.inputs.items()}


def already_complete(job: Job, folder: Path) -> dict[str, Any] | None:
    """The summary of a run of exactly these inputs that ended in `folder`, or None."""
    manifest = read_manifest(folder)
    if manifest is None or not manifest.get("complete") or not _same_inputs(job, manifest):
        return None
    options, accuracy = manifest.get("options", {}), job.keys.accuracy
    if options.get("chord_mm") != accuracy.chord_mm:
        return None
    if options.get("engine") == "columns" and (
        (options.get("width"), options.get("width_mm3")) != (accuracy.width, accuracy.width_mm3)
    ):
        return None
    if not all((folder / name).is_file() for name in manifest.get("outputs", ())):
        return None
    try:
        summary: dict[str, Any] = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return summary


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
        summary = already_complete(job, out) if order.resume or begun else None
        row["status"] = "done" if begun else "skipped"
        if summary is None:
            row["status"] = "failed"
            if "step" in order.formats:
                blank(job)  # refuses before hours of cutting
            with FolderLock(out) as lock:
                _acquire(lock, order.patience, stop)
                # changed inputs start over: a batch that comes back wants today's answer
                go_on = (order.resume or begun) and _same_inputs(job, ResultFolder(out).earlier())
                result = run(
                    job, out=out, resume=go_on, workers=1, stop=stop, lock=lock, command=order.command,
                    progress=progress,
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
    """mm/min over all blocks that are no rapids, dwells included; of the program and of the rewritten one."""
    import polars as pl

    def mean(table: Path) -> float | None:
        if not table.is_file():
            return None
        cut = pl.scan_parquet(table).filter(pl.col("motion") != "rapid")
        length, seconds = cut.select(pl.col("length_mm").sum(), pl.col("time_s").sum()).collect().row(0)
        return 60.0 * length / seconds if seconds > 0.0 else None

    tables = (out / "blocks.parquet", out / "scheduled_blocks.parquet")
    return {name: mean(table) for name, table in zip(FEEDS, tables, strict=True)}


def sparing(tell: Progress, every: float = 0.3) -> Progress:
    """A progress that speaks at most so often (s), and at the end of a stage."""
    last = float("-inf")

    def update(stage: str, done: int, total: int) -> None:
        nonlocal last
        now = time.monotonic()
        if now - last >= every or done == total:
            last = now
            tell(stage, done, total)

    return update
