"""The jobs of a batch, given out as there is room for them, and what is written down of them: table, page, ledger, data set."""

from __future__ import annotations

import csv
import os
import pkgutil
import re
import shutil
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from vmachining.disk import writing
from vmachining.errors import InputError, VMachiningError
from vmachining.job.batch.one import BATCH_COLUMNS, Ended, LocalPool, Order, Pool, Row, mark
from vmachining.job.files import atomic_path, make_folder, sha256, temporary_name, versions
from vmachining.job.folder import FolderLock, ResultFolder, now, program_words
from vmachining.job.jobfile import Job
from vmachining.progress import stop_flag

DATASET = "dataset"
BLOCKS = "blocks.parquet"

LEDGER = "batch.json"
"""Manifest of a batch: what made its table, page and data set."""

TABLE, PAGE = "batch.csv", "index.html"

WRITER = "vmachining.report.batch:write_index"
"""Who writes index.html. The report room sits above this one, so it is named here and not imported."""

RESERVED = (DATASET, TABLE, PAGE, LEDGER)
"""Names that no job's directory can have."""

PATIENCE_S = 30.0
"""For the process of a killed batch, or of a lost worker: it stops after the block that it is at."""

TABLE_SHARE, PAGE_SECONDS = 0.05, 30.0
"""Of the time at most that goes into rewriting the table as jobs end; s between two pages on the way."""


class Dataset:
    """dataset/job=NAME/blocks.parquet: hive partitions of the finished jobs of a batch, with the schema of `blocks`.

    Every file below dataset/ is read by a query over it, so none may lie there that the ledger of the batch does not name. A
    file comes whole: it is written in the directory above, where no query looks, and moved to its place.

    out : directory of the batch.
    earlier : ledger of the batch that was there before, None if there was none.
    """

    def __init__(self, out: Path, earlier: Mapping[str, Any] | None) -> None:
        self.path = out / DATASET
        self.digests: dict[str, str] = {}
        """{name of the job's directory: SHA-256} of what lies there now, written by this object."""
        named = (earlier or {}).get(DATASET, {}).items()
        self._earlier: dict[str, str | None] = {k: v for k, v in named if Path(k).name == k}
        self._maker = (earlier or {}).get("process")

    def table(self, name: str) -> Path:
        return self.path / f"job={name}" / BLOCKS

    def refuse_foreign(self) -> None:
        """Refuse a data set with files that no batch made, or that were changed since.

        Raises InputError: Names the first such file.
        """
        if not os.path.lexists(self.path):
            return
        ours = {self.table(name): digest for name, digest in self._earlier.items()}
        foreign = self.path if self.path.is_symlink() or not self.path.is_dir() else None
        for path in () if foreign else sorted(self.path.rglob("*")):
            if path.is_dir() and not path.is_symlink():
                continue
            known = path in ours and path.is_file() and not path.is_symlink()
            if not known or ours[path] not in (None, sha256(path)):
                foreign = path
                break
        if foreign is not None:
            raise InputError(
                f"was not made by this command, and queries read all of {DATASET}/", file=foreign,
                remedy="move it away, or choose another --out",
            )  # fmt: skip

    def clear(self) -> None:
        """Remove what the earlier batch made, after `refuse_foreign`: no job of it passes for one of this batch."""
        for name in self._earlier:
            torn = [] if self._maker is None else [self._temporary(name, int(self._maker))]
            for path in (self.table(name), *torn):
                with writing(path):
                    path.unlink(missing_ok=True)
            with suppress(OSError):  # not there, or not empty
                self.table(name).parent.rmdir()

    def put(self, folder: Path) -> None:
        """Lay down the blocks of a finished job, whole or not at all.

        Raises InputError: The disk is full, ...; names the file.
        """
        target = self.table(folder.name)
        make_folder(target.parent)
        temporary = self._temporary(folder.name, os.getpid())
        try:
            with writing(target):
                shutil.copyfile(folder / BLOCKS, temporary)
                digest = sha256(temporary)
                temporary.replace(target)
        except BaseException:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)
            raise
        self.digests[folder.name] = digest

    def _temporary(self, name: str, process: int) -> Path:
        return temporary_name(self.path.parent / f"{name}.parquet", process)


class Watcher:
    """Who learns how a batch continues; this one watches nothing."""

    def at(self, index: int, stage: str, done: int, total: int) -> None:
        """Job `index` is at block `done` of `total` of a stage."""

    def ended(self, index: int, row: Row, done: int, total: int) -> None:
        """Job `index` is through, with `row`; it is number `done` of `total` to be so."""

    def note(self, text: str) -> None:
        """Something happened that people need to know."""


def safe_name(name: str) -> str:
    return re.sub(r"[^\w.-]+", "_", name).strip("._") or "job"


def folders_of(files: Sequence[Path], out: Path) -> list[Path]:
    """out/NAME per job; jobs of one name get a number, in the order given, and so does one with a name of ours."""
    folders: list[Path] = []
    taken = {out / name for name in RESERVED}
    for file in files:
        try:
            name = safe_name(Job.load(file).name)
        except VMachiningError:
            name = safe_name(file.stem)
        names = (out / name, *(out / f"{name}-{k}" for k in range(2, len(files) + 2)))
        folders.append(next(folder for folder in names if folder not in taken))
        taken.add(folders[-1])
    return folders


def run_many(
    files: Sequence[Path],
    out: Path,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    formats: Sequence[str] = ("stl",),
    resume: bool = False,
    watcher: Watcher | None = None,
    **options: Any,
) -> list[Row]:
    """Run jobs side by side; rows in the order of `files`, also in out/batch.csv as jobs end.

    A job that fails, or whose process dies, has its row and does not stop the others. SIGINT and SIGTERM, to this
    process alone or to all of its group, stop the jobs in hand between two blocks.

    files : of the jobs. out : directory for all of their results.
    workers : processes of this machine. scheduler : address of a Dask scheduler whose workers are used instead; they
        have to see `files` and `out` under the same paths.
    formats : of the finished workpieces. resume : leave jobs that are complete, continue with those that were begun.
    options : of `run`, for every job: csv.
    Raises InputError: `out` holds files of somebody else under names of ours, or another batch is running there; no
        scheduler answers, it has no workers, or they have other versions or another file system.
    """
    make_folder(out)
    names = (TABLE, PAGE, LEDGER)
    place = ResultFolder(out, kind="vmachining batch", names=names, pattern=None, manifest=LEDGER)
    dataset = Dataset(out, place.earlier())
    with FolderLock(out) as lock, stop_flag() as stop:
        lock.acquire()
        place.refuse_foreign({f"job {k}": file for k, file in enumerate(files, 1)})
        dataset.refuse_foreign()
        watching = watcher or Watcher()
        with _pool(out, watching, workers, scheduler, len(files)) as pool:
            batch = _Batch(files, out, place, dataset, watching)
            if pool.room > 1:
                batch.waiting = _longest_first(files)
            dataset.clear()
            place.forget()
            place.manifest = {
                "kind": "vmachining batch", "complete": False, "command": program_words(),
                "process": os.getpid(), "started": now(), "ended": None, "versions": versions(),
                "options": {
                    "workers": workers, "scheduler": scheduler, "stock": list(formats), "resume": resume, **options,
                },
                "files": {TABLE: None, PAGE: None},
                DATASET: dict.fromkeys(folder.name for folder in batch.folders),
            }  # fmt: skip
            place.save()
            batch.write_table()
            batch.go(pool, stop, tuple(formats), resume, options)
        batch.finish()
    return batch.rows


def _longest_first(files: Sequence[Path]) -> list[int]:
    """Numbers of the jobs, the largest program first: a long job that begins last ends when all others are through.

    No more than 4/3 of the shortest possible time (Graham 1969) where time goes with the size of the program.
    """

    def size(index: int) -> int:
        with suppress(VMachiningError, OSError):
            return Job.load(files[index]).inputs["program"].stat().st_size
        return 0

    return sorted(range(len(files)), key=size, reverse=True)


@contextmanager
def _pool(out: Path, watcher: Watcher, workers: int, scheduler: str | None, jobs: int) -> Iterator[Pool]:
    pool: Pool
    if scheduler is None:
        pool = LocalPool(workers, watcher.at, jobs)
    else:
        from vmachining.job.batch.cluster import ClusterPool

        pool = ClusterPool(scheduler, out, watcher.at, watcher.note)
    try:
        yield pool
    finally:
        pool.close()


class _Batch:
    """State of a batch: rows so far, and what of them is on disk."""

    def __init__(
        self, files: Sequence[Path], out: Path, place: ResultFolder, dataset: Dataset, watcher: Watcher
    ) -> None:
        self.files, self.out, self.place, self.dataset, self.watcher = files, out, place, dataset, watcher
        self.folders = folders_of(files, out)
        none: Row = {
            **dict.fromkeys(BATCH_COLUMNS),
            "status": "interrupted",
            "exit_code": 130,
            "message": "not started",
        }
        self.rows: list[Row] = [none | {"job": str(file)} for file in files]
        self.waiting = list(range(len(files)))
        self.through = 0
        self.before: dict[int, str | None] = {}
        self.asked = False
        self._refused: set[str] = set()
        self._table_due = 0.0
        self._page_due = time.monotonic() + PAGE_SECONDS

    def go(
        self,
        pool: Pool,
        stop: Callable[[], bool],
        formats: tuple[str, ...],
        resume: bool,
        options: dict[str, Any],
    ) -> None:
        """Until every job is through, or nobody continues."""
        command, local = tuple(program_words()), isinstance(pool, LocalPool)
        patience = 0.0 if local and not resume else PATIENCE_S
        fresh = False
        while pool.busy or (self.waiting and not stop() and not pool.lost):
            while self.waiting and pool.room > 0 and not stop():
                index = self.waiting.pop(0)
                folder = self.folders[index]
                self.before[index] = mark(folder)
                paths = str(self.files[index]), str(folder)
                if not local:  # the directory of another process is another one
                    paths = str(self.files[index].absolute()), str(folder.absolute())
                before = self.before[index]
                pool.give(index, Order(*paths, formats, resume, command, before, patience, None, options))
            if stop() and not self.asked:
                pool.stop()
                self.asked = True
            for ended in pool.wait(0.5):
                self._take(ended)
                fresh = True
            if fresh and time.monotonic() >= self._table_due:
                fresh = not self._written(self.write_table)
            if time.monotonic() >= self._page_due:
                self._written(self._write_page)
        if pool.lost:
            for index in self.waiting:
                self.rows[index]["message"] = f"not started: {pool.lost}"

    def _take(self, ended: Ended) -> None:
        row, index, folder = self.rows[ended.job], ended.job, self.folders[ended.job]
        if ended.row is not None:
            wrote = ended.row["out"] is not None
            row |= ended.row
        else:
            status = "interrupted" if self.asked else ended.status
            wrote = mark(folder) not in (None, self.before[index])
            code = 130 if status == "interrupted" else 3
            row |= {"status": status, "exit_code": code, "message": ended.message}
        # as it was requested, whatever a worker calls it
        row |= {"job": str(self.files[index]), "out": str(folder) if wrote else None}
        if row["status"] in ("done", "skipped"):
            try:
                self.dataset.put(folder)
            except InputError as exc:
                row |= {"exit_code": 2, "message": f"not in the data set: {exc}"}
        self.through += 1
        self.watcher.ended(index, row, self.through, len(self.rows))

    def _written(self, write: Callable[[], None]) -> bool:
        """Whether a file could be written on the way. A full disk stops no job for that: at the end it is tried again."""
        try:
            write()
        except InputError as exc:
            self._table_due = self._page_due = time.monotonic() + PAGE_SECONDS
            if str(exc) not in self._refused:
                self.watcher.note(f"{exc}; it will be retried while jobs continue")
            self._refused.add(str(exc))
            return False
        return True

    def write_table(self) -> None:
        begin = time.monotonic()
        with (
            atomic_path(self.out / TABLE) as temporary,
            temporary.open("w", encoding="utf-8", newline="") as file,
        ):
            writer = csv.DictWriter(file, BATCH_COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(self.rows)
        end = time.monotonic()
        self._table_due = end + (end - begin) / TABLE_SHARE

    def _write_page(self) -> None:
        pkgutil.resolve_name(WRITER)(self.rows, self.out / PAGE, self.place.manifest)
        self._page_due = time.monotonic() + PAGE_SECONDS

    def finish(self) -> None:
        """Table, page and ledger at the end."""
        unfinished = self.asked or any(row["status"] == "interrupted" for row in self.rows)
        with self.place.making(TABLE, PAGE):
            self.place.manifest["ended"] = now()
            self.write_table()
            self._write_page()
        self.place.manifest |= {"complete": not unfinished, "ended": now(), DATASET: self.dataset.digests}
        self.place.save()
