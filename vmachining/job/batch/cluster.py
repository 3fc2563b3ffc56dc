"""Jobs on the workers of a Dask cluster.

A worker of Dask lends a thread, which starts a process like those of `one.py` on its machine, hands it the order and
passes on what it tells. So a job that brings down its process brings down no worker, and the process ends with the
worker, however that ends.

Who has which job is decided here and not by Dask: every job is bound to one worker. So it is known which jobs went
down with a worker, what is said of them names both, and the next attempt continues after the checkpoint of the one
before. Only admitted workers get jobs: they have the versions of this process, of the package to the byte, and see
the result directory.

A thread gives up its job when the scheduler has taken the task back, as it does when the batch is gone, or when the
worker closes: it lets the process stop after its block and leave a checkpoint.
"""

from __future__ import annotations

import logging
import os
import secrets
import socket
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any
from urllib.parse import urlsplit

from vmachining.disk import writing
from vmachining.errors import InputError
from vmachining.job.batch.one import (
    PROGRESS,
    STOP,
    Ended,
    JobProgress,
    Order,
    Row,
    start_child,
)
from vmachining.job.files import signature, write_atomic
from vmachining.processes import Child, dismiss

CONNECT_SECONDS = 10.0
"""For a scheduler to answer, and for its first worker to come."""

ALONE_SECONDS = 60.0
"""Without any worker, before a batch ends: as long as it takes somebody to start one again."""

ATTEMPTS = 3
"""Workers that a job may take down, before it is held for the cause."""

LOOK_SECONDS = 1.0
"""Between two looks at which workers there are."""

FAREWELL_SECONDS = 10.0
"""For the block in hand and a checkpoint, when nobody waits for the job any more."""

IDLE_SECONDS = 30.0
"""That a process without a job is kept for the next one."""

GUIDE = "see docs/batch.md"


# -- on the workers --------------------------------------------------------------------------------------------


def inspect(probe: str, content: str) -> tuple[dict[str, str], str]:
    """(signature, what is wrong with the directory of a file that this batch has just written)."""
    path = Path(probe)
    try:
        if path.read_text(encoding="utf-8") != content:
            return signature(), f"{path} has another content there"
        beside = path.with_name(f"{path.name}.{socket.gethostname()}.{os.getpid()}")
        beside.write_text(content, encoding="utf-8")
        beside.unlink()
    except OSError as exc:
        return signature(), f"{exc.filename or path}: {exc.strerror or exc}"
    return signature(), ""


_stopped: set[str] = set()
"""Batches whose user asks to stop, in the process of a worker."""


def stop_batch(token: str) -> None:
    """Let the jobs of a batch stop after the block that each is at."""
    _stopped.add(token)


class _Idle:
    """Processes of a worker that have no job now; each ends when it had none for a while."""

    def __init__(self) -> None:
        self._children: list[Child] = []
        self._lock = threading.Lock()

    def take(self) -> Child:
        with self._lock:
            while self._children:
                child = self._children.pop()
                if child[0].poll() is None:
                    return child
        return start_child()

    def put(self, child: Child) -> None:
        with self._lock:
            self._children.append(child)
        timer = threading.Timer(IDLE_SECONDS, self._expire, [child])
        timer.daemon = True
        timer.start()

    def _expire(self, child: Child) -> None:
        # one that had a job since then has a timer of that time, too, and may go a little early: it is idle again
        with self._lock:
            if child not in self._children:
                return
            self._children.remove(child)
        dismiss([child])


_idle = _Idle()


def host(order: Order, token: str, index: int) -> Row | None:
    """Task of a worker: have a job done by a process next to it. None: that process died."""
    from distributed import Status, get_worker

    worker = get_worker()
    key = worker.get_current_task()
    child = _idle.take()
    line = child[1]
    told, deadline, whole = False, float("inf"), False
    try:
        with suppress(OSError):  # one that is dead is found out below
            line.send(order)
        while time.monotonic() < deadline:
            if line.poll(0.25):
                try:
                    kind, *said = line.recv()
                except (EOFError, OSError):
                    return None
                if kind != PROGRESS:
                    whole = not told
                    row: Row = said[0]
                    return row
                worker.log_event(token, [index, *said])
            task = worker.state.tasks.get(key)
            wanted = task is not None and task.state == "executing" and worker.status == Status.running
            if not told and (not wanted or token in _stopped):
                told = True
                with suppress(OSError):
                    line.send(STOP)
            if not wanted and deadline == float("inf"):
                deadline = time.monotonic() + FAREWELL_SECONDS
        return None
    finally:
        if whole:
            _idle.put(child)
        else:
            dismiss([child], 1.0)


# -- in the process of the batch -------------------------------------------------------------------------------


@dataclass(slots=True, eq=False)
class _Given:
    """A job on its way. worker : its address. attempt : from 0."""

    order: Order
    worker: str
    attempt: int
    future: Any


class ClusterPool:
    """The workers of a Dask scheduler.

    address : of the scheduler, such as tcp://127.0.0.1:8786.
    out : directory of the batch, which exists.
    progress, note : who learns of blocks, and of workers that come and go.

    Raises InputError: Dask is not installed, no scheduler answers, it has no workers, or one that cannot be used: other
        versions, another file system.
    """

    def __init__(self, address: str, out: Path, progress: JobProgress, note: Any) -> None:
        self.lost = ""
        self._address = address if "://" in address else f"tcp://{address}"
        self._out, self._progress, self._note = out.absolute(), progress, note
        self._token = f"vmachining-{secrets.token_hex(8)}"
        self._slots: dict[str, int] = {}
        self._refused: set[str] = set()
        self._running: dict[int, _Given] = {}
        self._again: list[tuple[int, Order, int]] = []
        self._news: SimpleQueue[tuple[Any, ...]] = SimpleQueue()
        self._stopping = False
        self._looked = self._seen = time.monotonic()
        self._client = _connect(self._address)
        try:
            # called in a thread of the client
            self._client.subscribe_topic(self._token, lambda event: self._news.put(("progress", *event[1])))
            self._slots = self._first_workers()
        except BaseException:
            self.close()
            raise

    # -- workers -------------------------------------------------------------------------------------------

    def _first_workers(self) -> dict[str, int]:
        """{address: threads} of all that are there; any one that cannot be used is a refusal."""
        deadline = time.monotonic() + CONNECT_SECONDS
        while not (there := self._threads()):
            if time.monotonic() > deadline:
                remedy = f"start some: dask worker {self._address} --nthreads 1; {GUIDE}"
                raise InputError(f"the Dask scheduler at {self._address} has no workers", remedy=remedy)
            time.sleep(0.2)
        if unfit := self._unfit(list(there)):
            worker, why = next(iter(unfit.items()))
            more = f" (and {len(unfit) - 1} more)" if len(unfit) > 1 else ""
            raise InputError(f"worker {worker}{more}: {why}", remedy=GUIDE)
        return there

    def _threads(self) -> dict[str, int]:
        found: dict[str, int] = dict(self._client.nthreads())
        return found

    def _unfit(self, workers: list[str]) -> dict[str, str]:
        """{address: why it must not have jobs}."""
        probe, content = self._out / f".{self._token}", secrets.token_hex(16)
        write_atomic(probe, content)
        try:
            seen = self._client.run(inspect, str(probe), content, workers=workers, on_error="return")
        finally:
            with writing(probe):
                probe.unlink(missing_ok=True)
        mine = signature()
        return {worker: why for worker in workers if (why := _objection(mine, seen.get(worker), self._out))}

    def _look(self) -> Iterator[Ended]:
        """Workers that went and came since the last time."""
        self._looked = time.monotonic()
        there = self._threads()
        for worker in self._slots.keys() - there.keys():
            yield from self._bury(worker)
        new = [worker for worker in there if worker not in self._slots and worker not in self._refused]
        if new and not self._stopping:
            unfit = self._unfit(new)
            for worker in new:
                if why := unfit.get(worker):
                    self._refused.add(worker)
                    self._note(f"worker {worker} gets no jobs: {why}")
                else:
                    self._slots[worker] = there[worker]
                    self._note(f"worker {worker} has come")
        if self._slots:
            self._seen = self._looked
        elif self._looked - self._seen > ALONE_SECONDS:
            self.lost = f"the scheduler at {self._address} has no worker left"

    def _bury(self, worker: str) -> Iterator[Ended]:
        """A worker is gone: its jobs are somebody else's now."""
        del self._slots[worker]
        jobs = [index for index, given in self._running.items() if given.worker == worker]
        mine = "its job" if len(jobs) == 1 else f"its {len(jobs)} jobs"
        self._note(f"worker {worker} is gone" + (f", {mine} go to others" if jobs else ""))
        for index in jobs:
            given = self._running.pop(index)
            given.future.cancel()
            if self._stopping:
                yield Ended(index, None, f"its worker {worker} is gone", "interrupted")
            elif given.attempt + 1 >= ATTEMPTS:
                yield Ended(index, None, f"{ATTEMPTS} workers died with this job, {worker} last")
            else:
                self._again.append((index, given.order, given.attempt + 1))

    # -- jobs ----------------------------------------------------------------------------------------------

    @property
    def room(self) -> int:
        return 0 if self._again or self.lost else sum(self._slots.values()) - len(self._running)

    @property
    def busy(self) -> bool:
        return bool(self._running or self._again)

    def give(self, index: int, order: Order, attempt: int = 0) -> None:
        load = {worker: threads for worker, threads in self._slots.items() if threads > 0}
        for given in self._running.values():
            load[given.worker] = load.get(given.worker, 0) - 1
        worker = max(load, key=lambda name: (load[name], name))
        future = self._client.submit(
            host, order, self._token, index, key=f"{self._token}-{index}-{attempt}", workers=[worker],
            allow_other_workers=False, pure=False, retries=0,
        )  # fmt: skip
        self._running[index] = _Given(order, worker, attempt, future)
        future.add_done_callback(lambda done: self._news.put(("through", index, attempt, done)))

    def stop(self) -> None:
        self._stopping = True
        with suppress(Exception):
            self._client.run(stop_batch, self._token, workers=list(self._slots), on_error="ignore")

    def wait(self, seconds: float) -> Iterator[Ended]:
        if not self.lost:
            if self._client.status != "running":
                self.lost = f"the scheduler at {self._address} is gone"
            elif time.monotonic() - self._looked > LOOK_SECONDS:
                with suppress(OSError, TimeoutError):  # its status says so the next time
                    yield from self._look()
        while self._again and (self._stopping or sum(self._slots.values()) > len(self._running)):
            index, order, attempt = self._again.pop(0)
            if self._stopping:
                yield Ended(index, None, "its worker is gone", "interrupted")
            else:
                self.give(index, order, attempt)
        if self.lost:
            for index in [*self._running, *(index for index, _, _ in self._again)]:
                yield Ended(index, None, self.lost, "interrupted")
            self._running.clear()
            self._again.clear()
            return
        with suppress(Empty):
            yield from self._heard(self._news.get(timeout=seconds))
            while True:
                yield from self._heard(self._news.get_nowait())

    def _heard(self, news: tuple[Any, ...]) -> Iterator[Ended]:
        kind, index, *told = news
        given = self._running.get(index)
        if given is None:
            return
        if kind == "progress":
            self._progress(index, *told)
            return
        attempt, future = told
        if attempt != given.attempt or future.status == "cancelled":
            return  # the worker is gone: `_look` will find out
        del self._running[index]
        if future.status == "error":
            yield Ended(index, None, f"worker {given.worker}: {future.exception()}")
        else:
            row = future.result()
            yield Ended(index, row, "" if row else f"its process on worker {given.worker} died")

    def close(self) -> None:
        with suppress(Exception):
            for given in self._running.values():
                given.future.cancel()
            self._client.close(timeout=5)


def _objection(mine: Mapping[str, str], seen: Any, out: Path) -> str:
    """Why a worker must not have jobs, of what it answered; empty if it may."""
    if isinstance(seen, BaseException):
        return f"cannot load this vmachining: {type(seen).__name__}: {seen}"
    if seen is None:
        return "does not answer"
    theirs, wrong = seen
    others = [
        f"{name} is {theirs.get(name, 'not there')}, here {mine.get(name, 'not there')}"
        for name in (*mine, *(theirs.keys() - mine.keys()))
        if theirs.get(name) != mine.get(name)
    ]
    if others:
        return f"has other versions: {'; '.join(others)}"
    return f"does not see {out} as this machine does ({wrong})" if wrong else ""


def _connect(address: str) -> Any:
    try:
        import distributed
    except ImportError as exc:
        raise InputError(
            "--scheduler needs dask.distributed", remedy="pip install 'vmachining[cluster]'"
        ) from exc
    for name in ("distributed", "tornado", *logging.root.manager.loggerDict):
        if name.split(".")[0] in ("distributed", "tornado"):  # what matters of theirs is said in our words
            logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        parts = urlsplit(address)
        host_name, port = parts.hostname, parts.port
    except ValueError:
        host_name = port = None
    if not host_name or not port:
        raise InputError(
            f"--scheduler {address} is not an address", remedy="give one such as tcp://127.0.0.1:8786"
        )
    try:
        with suppress(ValueError):
            socket.create_connection((host_name, port), timeout=CONNECT_SECONDS).close()
        make: Any = distributed.Client
        return make(address, timeout=CONNECT_SECONDS, set_as_default=False, name="vmachining")
    except (OSError, ValueError, TimeoutError) as exc:
        what = f"no Dask scheduler answers at {address}: {getattr(exc, 'strerror', None) or exc}"
        raise InputError(what, remedy=f"start one: dask scheduler; {GUIDE}") from exc
