"""An interruption ends a run in about two seconds, even in the middle of a long kernel call.

The first SIGINT or SIGTERM makes `job.run` stop after the block in hand and leave a checkpoint. Where that takes too
long, for a block may take minutes, the process ends here: what is on disk then is the last checkpoint, as after a
kill, and its processes end with it. A signal is seen at once by the wake-up descriptor of the interpreter, whatever
the main thread does; a thread waits for it. (A kernel that holds the interpreter would hold the thread, too:
programs with long blocks are therefore cut by another process, see `job/cost.py`.)
"""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NoReturn

import typer

from vmachining.cli.main import Code
from vmachining.cli.screen import note, progress_bar
from vmachining.disk import Scratch
from vmachining.job import Stopped
from vmachining.progress import Progress

IDLE_SECONDS = 1.5
"""Without a block done after a signal: the block in hand is a long one."""

LONGEST_SECONDS = 10.0
"""After a signal, for blocks on their way; a checkpoint that is being written is waited for however long it takes."""

SHOW_CURSOR = "\x1b[?25h"


class Watch:
    """What the run has told last. Called as its progress; those of `inner` are called, too."""

    def __init__(self, *inner: Progress | None) -> None:
        self._inner = [one for one in inner if one is not None]
        self.last = time.monotonic()
        self.saving = False
        self.place: tuple[str, int, int] | None = None

    def __call__(self, stage: str, done: int, total: int) -> None:
        self.last = time.monotonic()
        if stage == "saving":
            self.saving = done < total
        else:
            self.place = stage, done, total
        for one in self._inner:
            one(stage, done, total)


@contextmanager
def stoppable(
    ended: Callable[[Watch], str], then: Callable[[], str], *inner: Progress | None, quiet: bool
) -> Iterator[Watch]:
    """A progress callback with a bar, see `watched`. then : what is said of a run that has stopped, before the command ends."""
    try:
        with progress_bar(quiet=quiet) as bar, watched(ended, bar, *inner) as progress:
            yield progress
    except Stopped as exc:
        note(f"vmachining: {exc}; {then()}")
        raise typer.Exit(Code.INTERRUPTED) from exc


@contextmanager
def watched(told: Callable[[Watch], str], *inner: Progress | None) -> Iterator[Watch]:
    """A progress callback whose run ends soon after a signal. Main thread only.

    told : the message of a run that had to be ended; called in the thread that ends it. inner : who hears of it, too.
    """
    watch = Watch(*inner)
    if threading.current_thread() is not threading.main_thread():
        yield watch
        return
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    before = signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    over = threading.Event()
    thread = threading.Thread(target=_wait, args=(reading, over, watch, told), daemon=True)
    thread.start()
    try:
        yield watch
    finally:
        over.set()
        signal.set_wakeup_fd(before)
        os.close(writing)
        thread.join()
        os.close(reading)


def _wait(reading: int, over: threading.Event, watch: Watch, told: Callable[[Watch], str]) -> None:
    while number := os.read(reading, 1):
        if number[0] in (signal.SIGINT, signal.SIGTERM):
            break
    else:  # closed: nobody asked
        return
    asked = time.monotonic()
    while not over.wait(0.05):
        now = time.monotonic()
        idle = now - max(asked, watch.last) > IDLE_SECONDS
        if (idle or now - asked > LONGEST_SECONDS) and not watch.saving:
            _end(told(watch))


def _end(message: str) -> NoReturn:
    """Say so, end what this process has started, and the process."""
    with suppress(OSError, ValueError):
        cursor = SHOW_CURSOR + "\n" if sys.stderr.isatty() else ""
        os.write(2, f"{cursor}vmachining: {message}\n".encode(errors="replace"))
    for process in descendants(os.getpid()):
        with suppress(OSError):
            os.kill(process, signal.SIGKILL)
    for thing in gc.get_objects():
        if type(thing) is Scratch:
            with suppress(Exception):
                thing.cleanup()
    os._exit(Code.INTERRUPTED)


def descendants(process: int) -> list[int]:
    """Processes that a process has started, and those that they have started."""
    parents, found = _parents(), [process]
    for one in found:  # grows
        found += [child for child, parent in parents.items() if parent == one]
    return found[1:]


def _parents() -> dict[int, int]:
    """{process: parent} of all that run."""
    parents: dict[int, int] = {}
    if Path("/proc/self/stat").exists():
        for entry in Path("/proc").iterdir():
            if entry.name.isdecimal():
                with suppress(OSError, IndexError, ValueError):
                    parents[int(entry.name)] = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
        return parents
    with suppress(OSError, subprocess.SubprocessError, ValueError):
        listed = subprocess.run(
            ["ps", "-A", "-o", "pid=,ppid="], capture_output=True, text=True, timeout=1.0, check=True
        )
        parents = {int(pid): int(parent) for pid, parent in map(str.split, listed.stdout.splitlines())}
    return parents
