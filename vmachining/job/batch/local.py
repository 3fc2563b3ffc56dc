"""Processes of this machine that do jobs."""

from __future__ import annotations

import os
import signal
import subprocess
import threading
from collections.abc import Iterator
from contextlib import suppress
from multiprocessing import connection
from multiprocessing.connection import Connection
from queue import SimpleQueue

from vmachining.job.batch.one import Ended, JobProgress, Order, one_job, sparing
from vmachining.processes import start

STOP = ("stop",)
"""What a process receives when the user asks to stop."""

ROW, PROGRESS = "row", "progress"
"""What it tells: ("row", row) once per order, ("progress", stage, done, total) before."""

Child = tuple[subprocess.Popen[bytes], Connection]


def start_child() -> Child:
    return start("vmachining.job.batch.local", "serve")


def dismiss(child: Child, seconds: float = 5.0) -> None:
    """Send a process home: it ends when nobody listens, at the latest after so many seconds."""
    process, line = child
    line.close()
    with suppress(subprocess.TimeoutExpired):
        process.wait(seconds)
    process.kill()
    process.wait()


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
                dismiss((process, line))
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
        for _, line in children:
            line.close()
        for child in children:
            dismiss(child)
