"""Many jobs over the processes of one machine: each in a directory of its own, a table at the end."""

from __future__ import annotations

import csv
import json
import os
import re
import signal
import subprocess
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from multiprocessing import connection
from multiprocessing.connection import Connection
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from vmachining.errors import EngineError, VMachiningError
from vmachining.job.brep import blank
from vmachining.job.files import atomic_path, make_folder, read_manifest, sha256, versions
from vmachining.job.folder import FolderLock, ResultFolder, now, program_words
from vmachining.job.jobfile import Job
from vmachining.job.run import run, stop_flag
from vmachining.job.simulate import Stopped
from vmachining.processes import start

__all__ = ["BATCH_COLUMNS", "already_complete", "folders_of", "run_many", "safe_name"]

LEDGER = "batch.json"
"""Manifest of a batch: what made batch.csv."""

NUMBERS = (
    "blocks", "removed_mm3", "removed_lo_mm3", "removed_hi_mm3", "stock_mm3", "final_mm3", "time_s",
    "scheduled_time_s", "warnings", "seconds", "peak_mb",
)  # fmt: skip
BATCH_COLUMNS = ("job", "name", "out", "status", "exit_code", "message", *NUMBERS)
"""status: done, skipped (complete before), failed, interrupted. out: empty where nothing was written."""


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
    if manifest.get("options", {}).get("chord_mm") != job.keys.accuracy.chord_mm:
        return None
    if not all((folder / name).is_file() for name in manifest.get("outputs", ())):
        return None
    try:
        summary: dict[str, Any] = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return summary


def serve(descriptor: int) -> None:
    """Life of a worker: jobs in, rows out. It ends with its parent: a killed batch must not leave somebody behind
    who writes into directories that a resumed batch writes into."""
    line = Connection(descriptor)
    jobs: SimpleQueue[tuple[Any, ...]] = SimpleQueue()
    stop = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: stop.set())

    def listen() -> None:
        try:
            while True:
                message = line.recv()
                if message == STOP:
                    stop.set()
                else:
                    jobs.put(message)
        except (EOFError, OSError):
            os._exit(1)

    threading.Thread(target=listen, daemon=True).start()
    while True:
        line.send(_one(*jobs.get(), stop=stop.is_set))


STOP = ("stop",)
"""What a worker is told when the user wants to stop."""


def _one(
    file: str,
    folder: str,
    formats: tuple[str, ...],
    resume: bool,
    command: Sequence[str],
    *,
    stop: Callable[[], bool],
) -> dict[str, Any]:
    """One job in a worker process; never raises what the user can cause."""
    row: dict[str, Any] = dict.fromkeys(BATCH_COLUMNS)
    row |= {"job": file, "status": "failed", "exit_code": 3, "message": ""}
    out, begin = Path(folder), now()
    try:
        if stop():
            raise Stopped("batch", 0, 1)
        job = Job.load(file)
        row["name"] = job.name
        summary = already_complete(job, out) if resume else None
        row["status"] = "skipped"
        if summary is None:
            row["status"] = "failed"
            if "step" in formats:
                blank(job)  # refuses before hours of cutting
            # changed inputs start over: a batch that comes back wants today's answer
            go_on = resume and _same_inputs(job, ResultFolder(out).earlier())
            with FolderLock(out) as lock:
                result = run(
                    job, out=out, resume=go_on, workers=1, stop=stop, lock=lock, command=command
                )  # fmt: skip
                result.write(out, stock=formats)
            summary, row["status"] = result.summary, "done"
        row |= {name: summary.get(name) for name in NUMBERS}
        disputed = summary["brep"]["disputed"] if "disputed" in summary.get("brep", {}) else 0
        row |= (
            {"exit_code": 1, "message": f"{disputed} blocks are disputed"} if disputed else {"exit_code": 0}
        )
    except Stopped as exc:
        row |= {"status": "interrupted", "exit_code": 130, "message": str(exc)}
    except EngineError as exc:
        row["message"] = str(exc)
    except (VMachiningError, OSError) as exc:
        row |= {"exit_code": 2, "message": str(exc)}
    except Exception as exc:
        row["message"] = f"internal failure: {type(exc).__name__}: {exc}"
    if row["status"] == "skipped" or _wrote(out, os.getpid(), begin):
        row["out"] = folder
    return row


def _wrote(out: Path, process: int, begin: str) -> bool:
    """Whether a process has begun to write a result there since a time; an older one is not of this job."""
    manifest = ResultFolder(out).earlier() or {}
    return manifest.get("process") == process and str(manifest.get("ended")) >= begin


def folders_of(files: Sequence[Path], out: Path) -> list[Path]:
    """out/NAME per job; jobs of one name get a number, in the order given."""
    folders: list[Path] = []
    for file in files:
        try:
            name = safe_name(Job.load(file).name)
        except VMachiningError:
            name = safe_name(file.stem)
        names = (out / name, *(out / f"{name}-{k}" for k in range(2, len(files) + 1)))
        folders.append(next(folder for folder in names if folder not in folders))
    return folders


class _Workers:
    """Processes with a job each; `running` says which."""

    def __init__(self) -> None:
        self._idle: list[tuple[subprocess.Popen[bytes], Connection]] = []
        self.running: dict[Connection, tuple[int, subprocess.Popen[bytes]]] = {}

    def give(self, index: int, *order: Any) -> None:
        """Have a job done."""
        process, line = self._idle.pop() if self._idle else start("vmachining.job.batch", "serve")
        self.running[line] = index, process
        with suppress(OSError):  # one that is dead is found out below
            line.send(order)

    def stop(self) -> None:
        """Let every job stop behind the block that it is at."""
        for line in self.running:
            with suppress(OSError):
                line.send(STOP)

    def answers(self, seconds: float) -> Iterator[tuple[int, dict[str, Any] | None, int]]:
        """(job, row, process) of those that are through; a row of None where the process has died."""
        for line in connection.wait(list(self.running), timeout=seconds):
            assert isinstance(line, Connection)
            index, process = self.running.pop(line)
            try:
                row = line.recv()
                self._idle.append((process, line))
            except (EOFError, OSError):
                row = None
                line.close()
                process.wait()
            yield index, row, process.pid

    def close(self) -> None:
        """Send all of them home."""
        hired = [*self._idle, *((process, line) for line, (_, process) in self.running.items())]
        for _, line in hired:
            line.close()
        for process, _ in hired:
            with suppress(subprocess.TimeoutExpired):
                process.wait(5.0)
            process.kill()
            process.wait()


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

    A job that fails, or whose process dies, has its row and does not stop the others. SIGINT and SIGTERM, to this
    process alone or to all of its group, stop the jobs in hand between two blocks.

    Raises
    ------
    InputError
        `out` holds a batch.csv of somebody else, or another batch is going on there.
    """
    make_folder(out)
    folders = folders_of(files, out)
    rows: list[dict[str, Any]] = [
        {
            **dict.fromkeys(BATCH_COLUMNS), "job": str(file), "status": "interrupted", "exit_code": 130,
            "message": "not started",
        }
        for file in files
    ]  # fmt: skip
    waiting = list(range(len(files)))
    done, asked, begin = 0, False, now()
    order = tuple(formats), resume, tuple(program_words())
    place = ResultFolder(
        out, kind="vmachining batch", names=("batch.csv", LEDGER), pattern=None, manifest=LEDGER
    )
    with FolderLock(out) as lock, stop_flag() as stop:
        lock.acquire()
        place.refuse_foreign({f"job {k}": file for k, file in enumerate(files, 1)})
        place.tidy()
        place.manifest = {
            "kind": "vmachining batch", "complete": False, "command": program_words(), "process": os.getpid(),
            "started": now(), "ended": None, "versions": versions(),
            "options": {"workers": workers, "stock": list(formats), "resume": resume},
            "files": {"batch.csv": None},
        }  # fmt: skip
        place.save()
        _write_table(out / "batch.csv", rows)
        hands = _Workers()
        try:
            while hands.running or (waiting and not stop()):
                while waiting and len(hands.running) < workers and not stop():
                    index = waiting.pop(0)
                    hands.give(index, str(files[index]), str(folders[index]), *order)
                if stop() and not asked:
                    hands.stop()
                    asked = True
                for index, row, process in hands.answers(0.5):
                    if row is not None:
                        rows[index] = row
                    else:
                        rows[index] |= {
                            "status": "interrupted" if asked else "failed", "exit_code": 130 if asked else 3,
                            "message": "its process died",
                            "out": str(folders[index]) if _wrote(folders[index], process, begin) else None,
                        }  # fmt: skip
                    done += 1
                    _write_table(out / "batch.csv", rows)
                    if progress is not None:
                        progress("jobs", done, len(files))
        finally:
            hands.close()
        with place.making("batch.csv"):
            _write_table(out / "batch.csv", rows)
        place.manifest |= {"complete": not waiting and not asked, "ended": now()}
        place.save()
    return rows


def _write_table(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, BATCH_COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
