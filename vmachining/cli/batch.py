"""batch."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from vmachining.cli.job_commands import Batch
from vmachining.cli.main import Code
from vmachining.cli.screen import STAGES, bars, emit, note
from vmachining.errors import InputError
from vmachining.job import check_formats
from vmachining.job.batch import BATCH_COLUMNS, Watcher, run_many

GOOD = ("done", "skipped")


def batch(o: Batch) -> int:
    if o.scheduler is not None and o.workers is not None:
        what = "--workers counts processes of this machine, --scheduler names a cluster"
        raise InputError(what, remedy="give one of them")
    silent = o.quiet or o.as_json
    with _watching(o.files, silent=silent) as watcher:
        rows = run_many(
            o.files, o.out, workers=o.workers or 1, scheduler=o.scheduler, formats=check_formats(o.stock), resume=o.resume,
            watcher=watcher, csv=o.csv,
        )  # fmt: skip
    for row in rows:
        if o.as_json:
            emit({name: row[name] for name in BATCH_COLUMNS})
        elif row["message"] and (o.quiet or row["message"].startswith("not started")):
            note(f"vmachining: {row['job']}: {row['status']}: {row['message']}")
    done = sum(row["status"] in GOOD for row in rows)
    note(f"{done} of {len(rows)} jobs complete; {o.out / 'index.html'}, {o.out / 'batch.csv'}", quiet=silent)
    return max((int(row["exit_code"]) for row in rows), default=int(Code.DONE))


class _Lines(Watcher):
    """A line per job that is through. Lines cannot be taken back: where nobody watches, blocks are not told."""

    def __init__(self, *, silent: bool) -> None:
        self._silent = silent

    def ended(self, index: int, row: dict[str, Any], done: int, total: int) -> None:
        self.note(f"[{done}/{total}] {_line_of(row)}")

    def note(self, text: str) -> None:
        note(text, quiet=self._silent)


class _Bars(_Lines):
    """The same over bars: one for the batch, one for each job on its way."""

    def __init__(self, jobs: Sequence[Path], bars: Any) -> None:
        super().__init__(silent=False)
        self._bars = bars
        stems = [job.stem for job in jobs]  # parts/a/job.toml and parts/b/job.toml are a/job and b/job
        unique = len(set(stems)) == len(stems)
        self._labels = stems if unique else [f"{job.absolute().parent.name}/{job.stem}" for job in jobs]
        self._all = bars.add_task("jobs", total=len(jobs))
        self._tasks: dict[int, Any] = {}

    def at(self, index: int, stage: str, done: int, total: int) -> None:
        text = f"{self._labels[index]}: {STAGES.get(stage, stage)}"
        if index not in self._tasks:
            self._tasks[index] = self._bars.add_task(text, total=total)
        self._bars.update(self._tasks[index], description=text, completed=done, total=total)

    def ended(self, index: int, row: dict[str, Any], done: int, total: int) -> None:
        if index in self._tasks:
            self._bars.remove_task(self._tasks.pop(index))
        self._bars.update(self._all, completed=done)
        super().ended(index, row, done, total)

    def note(self, text: str) -> None:
        self._bars.console.print(text, markup=False, highlight=False, soft_wrap=True)


@contextmanager
def _watching(jobs: Sequence[Path], *, silent: bool) -> Iterator[Watcher]:
    """Bars on a terminal, lines elsewhere."""
    if silent or not sys.stderr.isatty():
        yield _Lines(silent=silent)
        return
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with bars(*columns) as shown:
        yield _Bars(jobs, shown)


def _line_of(row: dict[str, Any]) -> str:
    """A job that is through, in a line: its volume with its bracket and its time, or what is wrong."""
    if row["status"] not in GOOD:
        return f"{row['job']}: {row['status']}: {row['message']}"
    after = f" -> {row['scheduled_time_s']:.2f} s" if row["scheduled_time_s"] is not None else ""
    warned = f", {row['warnings']} warnings" if row["warnings"] else ""
    wrong = f", {row['message']}" if row["message"] else ""
    before = " (complete before)" if row["status"] == "skipped" else ""
    between = f"between {row['removed_lo_mm3']:.7g} and {row['removed_hi_mm3']:.7g}"
    removed = f"{row['name']}: removed {row['removed_mm3']:.7g} mm3, {between}"
    return f"{removed}; time {row['time_s']:.2f} s{after}{warned}{wrong}{before}"
