"""One job on the workers of a Dask cluster: they do its parts, as a batch does jobs, and who asked merges them."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

from vmachining.errors import EngineError, InputError
from vmachining.job.batch.cluster import ClusterPool
from vmachining.job.batch.many import PATIENCE_S
from vmachining.job.batch.one import Ended, Order, mark
from vmachining.job.files import fingerprints, make_folder
from vmachining.job.folder import FolderLock, ResultFolder, program_words
from vmachining.job.jobfile import Job
from vmachining.job.parts import Part, Parts, read_parts
from vmachining.job.record import refuse_other_job
from vmachining.job.simulate import Stopped
from vmachining.progress import Progress, stop_flag

PARTS = "parts"
"""Directory of the parts in that of the result, until they are merged."""

NAME = re.compile(r"(\d+)-of-(\d+)")


def on_cluster(
    job: Job,
    folder: Path,
    address: str,
    options: dict[str, Any],
    *,
    lock: FolderLock,
    resume: bool,
    force: bool,
    progress: Progress,
    note: Callable[[str], None],
) -> Parts:
    """All parts of a run, one for each thread of the workers; of an interrupted run as many as it has had.

    A worker that is lost costs what its part has done since the last checkpoint: another worker continues from there.

    options : of `run_part`, and what takes the place of the job's accuracy.

    Raises InputError: No scheduler, no worker, one of another code; a job that cannot be run.
    Raises EngineError: A part failed, or no worker is left.
    Raises Stopped: The user asked to stop; `resume` continues.
    """
    if job.source is None:
        raise InputError("a job without a file cannot go to a cluster", remedy="save it: job.save(FILE)")
    make_folder(folder)
    lock.acquire()
    place = ResultFolder(folder)
    place.refuse_foreign(job.inputs)
    if (old := place.earlier()) is not None and not force:
        new = {"job": job.name, "job_file": str(job.source.resolve()), "inputs": fingerprints(job.inputs)}
        refuse_other_job(old, new, folder)
    if not resume:
        forget_parts(folder)
    places: dict[int, tuple[str, int, int]] = {}

    def at(index: int, stage: str, done: int, total: int) -> None:
        if stage == "saving":
            return
        places[index] = stage, done, total
        cuts = any(name == "program" and d < t for name, d, t in places.values())
        shown = "program" if cuts else stage
        counts = [(d, t) for name, d, t in places.values() if name == shown]
        progress(shown, sum(d for d, _ in counts), sum(t for _, t in counts))

    with stop_flag() as stop:
        pool = ClusterPool(address, folder, at, note)
        try:
            done, failed, folders = _all_parts(pool, stop, job.source, folder, options, resume)
        finally:
            pool.close()
    if failed is not None and not stop():
        row = failed.row or {}
        text = f"part {failed.job + 1} of {len(folders)}: {row.get('message') or failed.message}"
        if row.get("exit_code") == 2:
            raise InputError(text)
        raise EngineError(text, engine=str(options["engine"] or "columns"))
    if done < len(folders):
        raise Stopped("parts", done, len(folders), "part")
    return read_parts(folders)


def _all_parts(
    pool: ClusterPool,
    stop: Callable[[], bool],
    job: Path,
    folder: Path,
    options: dict[str, Any],
    resume: bool,
) -> tuple[int, Ended | None, list[Path]]:
    """How many are done, the first that failed, and where they are."""
    make_folder(folder / PARTS)
    known = [int(found[2]) for path in (folder / PARTS).iterdir() if (found := NAME.fullmatch(path.name))]
    count = known[0] if known else max(1, pool.room)
    folders = [(folder / PARTS / f"{k}-of-{count}").absolute() for k in range(1, count + 1)]
    waiting, done, asked = list(range(count)), 0, False
    failed: Ended | None = None
    while pool.busy or (waiting and not asked and not pool.lost):
        while waiting and pool.room > 0 and not asked:
            index = waiting.pop(0)
            pool.give(index, Order(
                str(job.absolute()), str(folders[index]), (), resume, tuple(program_words()), mark(folders[index]), PATIENCE_S,
                Part(index + 1, count), options,
            ))  # fmt: skip
        if (stop() or failed is not None) and not asked:
            pool.stop()
            asked = True
        for ended in pool.wait(0.5):
            if ended.row is not None and ended.row["status"] == "done":
                done += 1
            elif failed is None and not asked and (ended.row or {}).get("status") != "interrupted":
                failed = ended
    if pool.lost and failed is None:
        failed = Ended(0, None, pool.lost)
    return done, failed, folders


def forget_parts(folder: Path) -> None:
    """Remove what parts have left; other files stay."""
    home = folder / PARTS
    if not home.is_dir():
        return
    for path in home.iterdir():
        if NAME.fullmatch(path.name) and "part" in (ResultFolder(path).earlier() or {}).get("options", {}):
            shutil.rmtree(path, ignore_errors=True)
    if not any(home.iterdir()):
        home.rmdir()
