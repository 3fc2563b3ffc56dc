"""People read stderr, programs read stdout."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

FIRST_BLOCKS, FIRST_SHARE = 5, 0.05
"""Blocks, and part of all of them, before which nothing is said of the time left."""

FIRST_LINE_SECONDS, LINE_SECONDS = 10.0, 30.0
"""Off a terminal: when a stage is first told, and how often after that."""

STAGES = {
    "program": "cutting",
    "scheduled": "verifying the schedule",
    "brep": "checking by B-rep",
    "engagement": "contact and chips",
    "engagement, sample": "contact and chips, sample",
    "engagement, scheduled": "contact and chips, scheduled",
    "engagement, lowered": "contact and chips, lowered feeds",
    "engagement, pieces": "contact and chips, pieces",
    "pieces": "cutting in pieces",
    "second judge": "asking a second engine",
    "saving": "saving the workpiece",
}


def emit(value: Any) -> None:
    """One JSON value on one line of stdout."""
    sys.stdout.write(json.dumps(value, ensure_ascii=False, allow_nan=False) + "\n")


def note(text: str, *, quiet: bool = False) -> None:
    """A message for people."""
    if not quiet:
        print(text, file=sys.stderr)


@contextmanager
def bars(*columns: Any) -> Iterator[Any]:
    """Bars on stderr that go when they are through: a `rich.progress.Progress`."""
    from rich.console import Console
    from rich.progress import Progress

    with Progress(*columns, console=Console(stderr=True), transient=True, refresh_per_second=5) as shown:
        yield shown


def told(warnings: Iterable[str], files: Iterable[Path] = (), *, quiet: bool = False) -> None:
    """Warnings, and files that were written."""
    for text in warnings:
        note(f"warning: {text}", quiet=quiet)
    for file in files:
        note(f"wrote {file}", quiet=quiet)


@contextmanager
def status_line() -> Iterator[Callable[[str], None]]:
    """A callback that says on stderr what is done now, with the time since; silent when nobody watches."""
    if not sys.stderr.isatty():
        yield lambda _: None
        return
    from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

    with bars(SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn()) as line:
        task = line.add_task("starting", total=None)

        def update(text: str) -> None:
            # drawn at once: a kernel may hold the interpreter from here on
            line.update(task, description=text, refresh=True)

        yield update


def _foretold(done: float, total: float) -> bool:
    """Whether so much is done that the time left can be stated."""
    return done >= max(FIRST_BLOCKS, FIRST_SHARE * total)


def _lines() -> Callable[[str, int, int], None]:
    """Progress for a log: a line after ten seconds of a stage, then every half minute, with the time left."""
    begun: dict[str, tuple[float, int]] = {}
    warm: dict[str, bool] = {}
    due = 0.0

    def update(stage: str, done: int, total: int) -> None:
        nonlocal due
        now = time.monotonic()
        if stage not in begun:
            begun[stage] = now, done
            due = now + FIRST_LINE_SECONDS
        elif begun[stage][1] < done and not warm.get(stage):  # the first block waited for kernels
            begun[stage], warm[stage] = (now, done), True
        start, first = begun[stage]
        if now < due or done >= total:
            return
        due = now + LINE_SECONDS
        left = ""
        if _foretold(done - first, total):
            left = f", about {(now - start) / (done - first) * (total - done):,.0f} s left"
        note(f"{STAGES.get(stage, stage)}: {done} of {total}{left}")

    return update


@contextmanager
def progress_bar(*, quiet: bool) -> Iterator[Callable[[str, int, int], None] | None]:
    """A callback that draws a bar on stderr, or off a terminal writes a line now and then; None if `quiet`."""
    if quiet:
        yield None
        return
    if not sys.stderr.isatty():
        yield _lines()
        return
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        ProgressColumn,
        Task,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )
    from rich.text import Text

    class _TimeLeft(TimeRemainingColumn):
        """Nothing before the first blocks are through: they may wait for kernels that are compiled."""

        def render(self, task: Task) -> Text:
            return super().render(task) if _foretold(task.completed, task.total or 0.0) else Text("")

    class _Rate(ProgressColumn):
        """Blocks per second, of those that this process has done."""

        def render(self, task: Task) -> Text:
            speed = task.finished_speed or task.speed
            return Text("" if speed is None else f"{speed:,.0f}/s" if speed >= 10.0 else f"{speed:.2g}/s")

    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), _Rate(), TimeElapsedColumn(),
        _TimeLeft(elapsed_when_finished=False),
    )  # fmt: skip
    with bars(*columns) as bar:
        tasks: dict[str, Any] = {}

        def update(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                # what an earlier process has done counts for no rate
                tasks[stage] = bar.add_task(STAGES.get(stage, stage), total=total, completed=done)
            bar.update(tasks[stage], completed=done)

        yield update
