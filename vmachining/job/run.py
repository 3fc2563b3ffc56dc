"""One job from file to result, or a part of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Literal

from vmachining.disk import Scratch
from vmachining.engines import engine_class
from vmachining.errors import InputError
from vmachining.job.brep import parse_brep
from vmachining.job.course import Course
from vmachining.job.folder import FolderLock
from vmachining.job.given import RunOptions
from vmachining.job.jobfile import Job
from vmachining.job.parts import Part, Parts
from vmachining.job.result import RunResult
from vmachining.job.store import PARTS
from vmachining.progress import Progress, shown, stop_flag
from vmachining.tolerance import BREP_SECONDS


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
    csv: bool = False,
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
    csv : blocks.csv, which is written up to 100,000 blocks, is written above as well.

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
        every_strategy=every_strategy, contact=contact, stages=stages, command=command, force=force, parts=parts, csv=csv,
    )  # fmt: skip
    with (
        shown(progress) as seen,
        _working(job, keep.path if keep else Path(str(out)), asked, seen, stop, lock) as work,
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

    Raises InputError, Stopped, EngineError: See `run`.
    """
    asked = RunOptions(**{"workers": 1} | options, part=part)
    with _working(Job.of(job), Path(out), asked, progress, stop, lock) as work:
        work.go_part(part)


@contextmanager
def _working(
    job: Job, folder: Path, asked: RunOptions, progress: Progress | None, stop: Callable[[], bool] | None, lock: FolderLock | None
) -> Iterator[Course]:  # fmt: skip
    """A run about to begin, whose record is saved however it ends."""
    if asked.engine is not None:
        engine_class(asked.engine)
    if asked.chord is not None:
        job = job.with_chord(asked.chord)
    brep, options = parse_brep(asked.brep), asked.of(job)
    with stop_flag(stop) as stopped, FolderLock(folder) as own:
        work = Course(job, folder, asked, options, brep, progress or (lambda *_: None), stopped, lock or own)
        try:
            yield work
        except BaseException:
            with suppress(InputError):  # where nothing can be written, what was written last still holds
                work.record.save()
            raise
        finally:
            work.cutting.staff.close()
        work.record.save()
