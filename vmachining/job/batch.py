"""Many jobs over the processes of one machine: each in a directory of its own, a table at the end."""

from __future__ import annotations

import csv
import json
import multiprocessing
import os
import re
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Any

from vmachining.errors import EngineError, VMachiningError
from vmachining.job.brep import blank
from vmachining.job.files import atomic_path, make_folder, read_manifest, sha256
from vmachining.job.jobfile import Job
from vmachining.job.run import run
from vmachining.job.simulate import Stopped

__all__ = ["BATCH_COLUMNS", "already_complete", "run_many", "safe_name"]

SPAWN = multiprocessing.get_context("spawn")

NUMBERS = (
    "blocks", "removed_mm3", "removed_lo_mm3", "removed_hi_mm3", "stock_mm3", "final_mm3", "time_s",
    "scheduled_time_s", "warnings", "seconds", "peak_mb",
)  # fmt: skip
BATCH_COLUMNS = ("job", "name", "out", "status", "exit_code", "message", *NUMBERS)
"""status: done, skipped (complete before), failed, interrupted."""


def safe_name(name: str) -> str:
    """A directory name made of a job's name."""
    return re.sub(r"[^\w.-]+", "_", name).strip("._") or "job"


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
    if not all((folder / name).is_file() for name in manifest.get("outputs", ())):
        return None
    try:
        summary: dict[str, Any] = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return summary


STOP: list[Any] = []
"""In a worker: the event that is set once the user wants to stop."""


def _begin(stop: Any) -> None:
    """Start of a worker. It ends with its parent: a killed batch must not leave somebody behind who writes
    into directories that a resumed batch writes into."""
    STOP.append(stop)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _one(file: str, folder: str, formats: tuple[str, ...], resume: bool) -> dict[str, Any]:
    """One job in a worker process; never raises what the user can cause."""
    row: dict[str, Any] = dict.fromkeys(BATCH_COLUMNS)
    row |= {"job": file, "out": folder, "status": "failed", "exit_code": 3, "message": ""}
    try:
        if STOP and STOP[0].is_set():
            raise Stopped("batch", 0, 1)
        job = Job.load(file)
        row["name"] = job.name
        summary = already_complete(job, Path(folder)) if resume else None
        row["status"] = "skipped"
        if summary is None:
            row["status"] = "failed"
            if "step" in formats:
                blank(job)  # refuses before hours of cutting
            # changed inputs start over: a batch that comes back wants today's answer
            go_on = resume and _same_inputs(job, read_manifest(Path(folder)))
            result = run(job, out=folder, resume=go_on, workers=1)
            result.write(folder, stock=formats)
            summary, row["status"] = result.summary, "done"
        row |= {name: summary.get(name) for name in NUMBERS}
        row["exit_code"] = 0
    except Stopped as exc:
        row |= {"status": "interrupted", "exit_code": 130, "message": str(exc)}
    except EngineError as exc:
        row["message"] = str(exc)
    except (VMachiningError, OSError) as exc:
        row |= {"exit_code": 2, "message": str(exc)}
    except Exception as exc:
        row["message"] = f"internal failure: {type(exc).__name__}: {exc}"
    return row


def _pool(stop: Any) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(1, mp_context=SPAWN, initializer=_begin, initargs=(stop,))


@contextmanager
def _deaf() -> Iterator[None]:
    """Processes started in here ignore Ctrl-C until a simulation listens: loading modules cannot be stopped."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def _folders(files: Sequence[Path], out: Path) -> list[Path]:
    """out/NAME per job; jobs of one name get a number, in the order given."""
    seen: dict[str, int] = {}
    folders = []
    for file in files:
        try:
            name = safe_name(Job.load(file).name)
        except VMachiningError:
            name = safe_name(file.stem)
        seen[name] = seen.get(name, 0) + 1
        folders.append(out / (name if seen[name] == 1 else f"{name}-{seen[name]}"))
    return folders


@contextmanager
def _pass_on_signals(told: Any) -> Iterator[threading.Event]:
    """Ctrl-C reaches the workers by itself (one process group); SIGTERM is passed on to them.

    told : set for workers that do not listen yet.
    """
    stop = threading.Event()
    before: dict[int, Any] = {}

    def handler(number: int, frame: FrameType | None) -> None:
        stop.set()
        told.set()
        if number == signal.SIGTERM:
            for child in multiprocessing.active_children():
                child.terminate()

    if threading.current_thread() is threading.main_thread():
        before = {number: signal.signal(number, handler) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield stop
    finally:
        for number, old in before.items():
            signal.signal(number, old)


def run_many(
    files: Sequence[Path],
    out: Path,
    *,
    workers: int = 1,
    formats: Sequence[str] = ("stl",),
    resume: bool = False,
    progress: Callable[[str, int, int], None] | None = None,
) -> list[dict[str, Any]]:
    """Run jobs side by side; rows in the order of `files`, also written to out/batch.csv after every job.

    Processes are spawned, not forked: kernels with threads do not survive a fork. A job that fails, or whose
    process dies, has its row and does not stop the others.
    """
    make_folder(out)
    folders = _folders(files, out)
    rows: list[dict[str, Any]] = [
        {
            **dict.fromkeys(BATCH_COLUMNS), "job": str(file), "out": str(folder), "status": "interrupted",
            "exit_code": 130, "message": "not started",
        }
        for file, folder in zip(files, folders, strict=True)
    ]  # fmt: skip
    waiting = list(range(len(files)))
    running: dict[Future[dict[str, Any]], tuple[int, ProcessPoolExecutor]] = {}
    idle: list[ProcessPoolExecutor] = []
    done = 0
    told = SPAWN.Event()
    with _pass_on_signals(told) as stop:
        try:
            while running or (waiting and not stop.is_set()):
                while waiting and len(running) < workers and not stop.is_set():
                    index = waiting.pop(0)
                    # one process per pool: a process that dies takes no other job with it
                    pool = idle.pop() if idle else _pool(told)
                    with _deaf():
                        future = pool.submit(
                            _one, str(files[index]), str(folders[index]), tuple(formats), resume
                        )
                    running[future] = index, pool
                finished, _ = wait(running, timeout=0.5, return_when=FIRST_COMPLETED)
                for future in finished:
                    index, pool = running.pop(future)
                    try:
                        rows[index] = future.result()
                        idle.append(pool)
                    except BrokenProcessPool:
                        asked = stop.is_set()
                        rows[index] |= {
                            "status": "interrupted" if asked else "failed",
                            "exit_code": 130 if asked else 3,
                        }
                        rows[index]["message"] = "its process died"
                        pool.shutdown()
                    done += 1
                    _write_table(out / "batch.csv", rows)
                    if progress is not None:
                        progress("jobs", done, len(files))
        finally:
            for pool in [*idle, *(pool for _, pool in running.values())]:
                pool.shutdown(wait=True, cancel_futures=True)
    _write_table(out / "batch.csv", rows)
    return rows


def _write_table(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, BATCH_COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
