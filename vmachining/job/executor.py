"""Which processes cut the workpiece of a job: this one, or several that each have all sweeps and cut their own part.

Nobody waits: orders are sent ahead, answers are collected when they are asked for, and the volumes of a block
are the sums over the parts. The numbers of the mesh engine do not depend on how many processes there are, up to the
rounding of these sums; brackets of columns are proven and as narrow as asked with any number, and not the same.
Any engine can be cut in this process; `WorkerPool` wants one that is `Divisible`.

Workers are fresh interpreters (threads would queue for one interpreter lock, forks would copy kernels that
run threads of their own). They ignore Ctrl-C, which is for this process to decide about, and end with it.
"""

from __future__ import annotations

import gc
import os
import signal
import socket
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from tempfile import TemporaryDirectory
from types import TracebackType
from typing import Any, NoReturn, Protocol, TypeAlias, cast

from vmachining.engines import engine_class, entry_of
from vmachining.engines.protocol import NOTHING, Batched, Divisible, Engine, Removal, Request, Share
from vmachining.errors import EngineError
from vmachining.geometry import Arc, Line
from vmachining.sweep import Sweep, Turn
from vmachining.tool import Profile

__all__ = ["Executor", "InProcess", "Later", "Together", "WorkerPool", "executor"]

BATCH = 16
"""Orders in one message: a message costs about as much as an order in air."""

AHEAD_APART = 1
"""Long blocks keep a process busy, and with more of them on their way no checkpoint could be written for long."""

AT_ONCE = (8, 1024)
"""Orders of an engine that is faster with many at once: fewest and most that wait for each other."""

AT_ONCE_SECONDS = 0.5

ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""What a worker inherits: threads of a linear algebra that it hardly uses would wait busily for work."""

CutterPath: TypeAlias = Line | Arc | Turn

Later: TypeAlias = Callable[[], Removal]
"""An answer that may still be on its way; calling it waits for it."""


class Executor(Protocol):
    """Who cuts. Orders are carried out in the order they are given in.

    engine : name of the engine. chord : mm, of the engine.
    ahead : blocks to order before the first of them is asked for, so that nobody is idle.
    """

    engine: str
    chord: float
    ahead: int

    def cut(self, profile: Profile, path: CutterPath, block: int) -> Later:
        """Remove a sweep, see `Engine.cut`."""
        ...

    def touch(self, profile: Profile, path: CutterPath, within: float | None = None) -> Later:
        """What a sweep would remove, see `Engine.touch`."""
        ...

    def save(self, path: Path) -> None:
        """Write the workpiece as it is after all orders so far."""
        ...

    def finish(self) -> Engine:
        """The workpiece after all orders; no further ones."""
        ...

    def peak_mb(self) -> float:
        """Memory of the other processes at their largest, MB."""
        ...

    def close(self) -> None:
        """Send the workers home."""
        ...


def executor(engine: Engine, workers: int, *, apart: bool = False) -> Executor:
    """As many processes as asked for to go on with an engine; one where it cannot be divided.

    apart : long blocks, so that even one process is another one than this: kernels hold the interpreter, and no
    signal would be heard before the end of a block.
    """
    if entry_of(engine.name).batched:
        return Together(cast("Batched", engine))
    if (workers <= 1 and not apart) or not entry_of(engine.name).divisible:
        return InProcess(engine)
    pool = WorkerPool(cast("Divisible", engine), max(1, workers))
    if apart:
        pool.ahead = AHEAD_APART
    return pool


class InProcess:
    """This process alone: every order is carried out at once."""

    ahead = 0

    def __init__(self, engine: Engine) -> None:
        self.engine, self.chord = engine.name, engine.chord
        self._engine = engine

    def cut(self, profile: Profile, path: CutterPath, block: int) -> Later:
        """See `Executor`."""
        removed = self._engine.cut(Sweep.along(profile, path), block)
        return lambda: removed

    def touch(self, profile: Profile, path: CutterPath, within: float | None = None) -> Later:
        """See `Executor`."""
        found = self._engine.touch(Sweep.along(profile, path), within)
        return lambda: found

    def save(self, path: Path) -> None:
        """See `Executor`."""
        self._engine.save(path)

    def finish(self) -> Engine:
        """See `Executor`."""
        return self._engine

    def peak_mb(self) -> float:
        """See `Executor`."""
        return 0.0

    def close(self) -> None:
        """See `Executor`."""


class Together:
    """This process alone, for an engine that is faster with many orders at once.

    They wait until there are enough of them, or until somebody asks for an answer. How many are enough follows from how long
    the last ones took, so that Ctrl-C and checkpoints wait for about `AT_ONCE_SECONDS` at most; numbers do not depend on it.
    """

    def __init__(self, engine: Batched) -> None:
        self.engine, self.chord = engine.name, engine.chord
        self.ahead = AT_ONCE[0]
        self._engine = engine
        self._waiting: list[Request] = []
        self._given = 0
        self._answers: dict[int, Removal] = {}

    def cut(self, profile: Profile, path: CutterPath, block: int) -> Later:
        """See `Executor`."""
        return self._order(Request(Sweep.along(profile, path), block))

    def touch(self, profile: Profile, path: CutterPath, within: float | None = None) -> Later:
        """See `Executor`."""
        return self._order(Request(Sweep.along(profile, path), cuts=False))

    def _order(self, request: Request) -> Later:
        self._waiting.append(request)
        number = self._given + len(self._waiting) - 1
        if len(self._waiting) >= self.ahead:
            self._flush()
        return lambda: self._answer(number)

    def _answer(self, number: int) -> Removal:
        if number not in self._answers:
            self._flush()
        return self._answers.pop(number)

    def _flush(self) -> None:
        waiting, self._waiting = self._waiting, []
        if not waiting:
            return
        begin = time.perf_counter()
        for number, removed in enumerate(self._engine.answer(waiting), self._given):
            self._answers[number] = removed
        self._given += len(waiting)
        seconds = (time.perf_counter() - begin) / len(waiting)
        fewest, most = AT_ONCE
        self.ahead = int(min(max(AT_ONCE_SECONDS / max(seconds, 1e-9), fewest), most, 2 * self.ahead))

    def save(self, path: Path) -> None:
        """See `Executor`."""
        self._flush()
        self._engine.save(path)

    def finish(self) -> Engine:
        """See `Executor`."""
        self._flush()
        return self._engine

    def peak_mb(self) -> float:
        """See `Executor`."""
        return 0.0

    def close(self) -> None:
        """See `Executor`."""


class WorkerPool:
    """`workers` processes that go on with an engine.

    Raises
    ------
    EngineError
        A worker reports a failure of its kernel, or has died; names the block where one is known.
    """

    ahead = 256

    def __init__(self, engine: Divisible, workers: int) -> None:
        self.engine, self.chord = engine.name, engine.chord
        self._class, self._whole = type(engine), engine.summed
        self._profiles: dict[int, tuple[int, Profile]] = {}
        self._waiting: list[tuple[Any, ...]] = []
        self._sent, self._told, self._first = 0, 0, 0
        self._answers: list[deque[Removal]] = []
        self._sums: dict[int, Removal] = {}
        self._folder = TemporaryDirectory(prefix="vmachining-workers-")
        self._workers: list[tuple[subprocess.Popen[bytes], Connection]] = []
        start = Path(self._folder.name) / "start.npz"
        engine.save(start)
        try:
            for part in range(workers):
                self._workers.append(_hire())
                self._answers.append(deque())
                self._workers[part][1].send((engine.name, str(start), part, workers))
        except OSError as error:
            self.close()
            raise EngineError(f"a worker process cannot be started ({error})", engine=self.engine) from error

    def __enter__(self) -> WorkerPool:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # -- orders --------------------------------------------------------------------------------------------

    def cut(self, profile: Profile, path: CutterPath, block: int) -> Later:
        """See `Executor`."""
        return self._order("cut", self._known(profile), path, block)

    def touch(self, profile: Profile, path: CutterPath, within: float | None = None) -> Later:
        """See `Executor`."""
        return self._order("touch", self._known(profile), path, within)

    def save(self, path: Path) -> None:
        """See `Executor`."""
        engine = self._collected()
        blocks = engine.in_use()
        if blocks is not None:  # a part knows its own tiles, and not what is of use to the others
            engine.forget_others(blocks)
            self._all("forget others", blocks)
        engine.save(path)

    def finish(self) -> Engine:
        """See `Executor`."""
        engine = self._collected()
        self.close()
        return engine

    def close(self) -> None:
        """See `Executor`."""
        for process, line in self._workers:
            line.close()
            with suppress(subprocess.TimeoutExpired):
                process.wait(5.0)
            process.kill()
            process.wait()
        self._workers.clear()
        self._folder.cleanup()

    def peak_mb(self) -> float:
        """See `Executor`."""
        return sum(answer.hi for answer in self._all("peak"))

    # -- messages ------------------------------------------------------------------------------------------

    def _known(self, profile: Profile) -> int:
        """Number of a profile, told to the workers once; kept, so that its id stays its own."""
        known = self._profiles.get(id(profile))
        if known is None:
            known = self._profiles[id(profile)] = (len(self._profiles), profile)
            self._waiting.append(("profile", *known))
        return known[0]

    def _order(self, *order: Any) -> Later:
        self._waiting.append(order)
        number, self._sent = self._sent, self._sent + 1
        if len(self._waiting) >= BATCH:
            self._flush()
        return lambda: self._answer(number)

    def _flush(self) -> None:
        orders, self._waiting, self._told = ForkingPickler.dumps(self._waiting), [], self._sent
        for part, (_, line) in enumerate(self._workers):
            try:
                line.send_bytes(orders)
            except OSError:
                self._lost(part)

    def _answer(self, number: int) -> Removal:
        self._sum(number + 1)
        return self._sums.pop(number)

    def _sum(self, stop: int) -> None:
        """Add up the answers to all orders before `stop`, waiting for them."""
        if self._told < stop:
            self._flush()
        while self._first < stop:
            self._gather()
            parts = [answers.popleft() for answers in self._answers]
            self._sums[self._first] = self._whole(parts)
            self._first += 1

    def _gather(self) -> None:
        """Wait until every worker has given its next answer."""
        for part, answers in enumerate(self._answers):
            while not answers:
                self._receive(part)

    def _receive(self, part: int) -> None:
        try:
            answers: list[Any] = self._workers[part][1].recv()
        except (EOFError, OSError):
            self._lost(part)
        for answer in answers:
            if isinstance(answer, EngineError):
                raise answer
            self._answers[part].append(answer)

    def _lost(self, part: int) -> NoReturn:
        process, _ = self._workers[part]
        with suppress(subprocess.TimeoutExpired):
            process.wait(5.0)
        raise EngineError(
            f"worker process {part + 1} of {len(self._workers)} ended with exit code {process.returncode}; "
            "one that is out of memory is killed (-9): take fewer workers",
            engine=self.engine,
        )

    def _all(self, *order: Any) -> list[Removal]:
        """What each worker answers to an order, once all earlier ones are done."""
        later = self._order(*order)
        self._flush()
        self._sum(self._sent - 1)
        self._gather()
        found = [answers[0] for answers in self._answers]
        later()
        return found

    def _collected(self) -> Divisible:
        """The joined workpiece after all orders so far."""
        self._all("save", self._folder.name)
        files = [Path(self._folder.name) / f"{part}.npz" for part in range(len(self._workers))]
        return self._class.join([self._class.load(file) for file in files])


def _hire() -> tuple[subprocess.Popen[bytes], Connection]:
    """A fresh interpreter that serves at the other end of the line."""
    here, there = socket.socketpair()
    with there:
        process = subprocess.Popen(
            [
                sys.executable,
                "-c",
                f"from vmachining.job.executor import serve; serve({there.fileno()})",
            ],
            pass_fds=[there.fileno()],
            env=os.environ | ONE_THREAD | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            process_group=0,  # signals to a group, as of a terminal or `timeout`, are for this process to decide about
        )
    return process, Connection(here.detach())


def serve(descriptor: int) -> None:
    """Life of a worker: orders in, answers out, until the line is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    line = Connection(descriptor)
    profiles: dict[int, Profile] = {}
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        name, start, part, parts = line.recv()
        engine: Engine | None = None
        failed: EngineError | None = None
        try:
            divisible = cast("type[Divisible]", engine_class(name))
            engine = divisible.load(Path(start), share=Share(part, parts))
        except EngineError as error:
            failed = error
        gc.collect()
        gc.freeze()  # what is there stays: no need to look through it again and again
        while True:
            answers: list[Any] = []
            for order in line.recv():
                if order[0] == "profile":
                    profiles[order[1]] = order[2]
                    continue
                try:
                    if failed is not None or engine is None:  # the first failure is the one to report
                        raise failed or EngineError("no workpiece", engine=name)
                    answers.append(_done(engine, profiles, order, part))
                except EngineError as error:
                    failed = error
                    answers.append(error)
                except Exception as error:  # whatever it is, it must reach the one who asked
                    failed = EngineError(f"{type(error).__name__}: {error}", engine=name)
                    answers.append(failed)
            line.send(answers)


def _done(engine: Engine, profiles: dict[int, Profile], order: tuple[Any, ...], part: int) -> Removal:
    """Carry out one order."""
    match order:
        case ("cut", profile, path, block):
            return engine.cut(Sweep.along(profiles[profile], path), block)
        case ("touch", profile, path, within):
            return engine.touch(Sweep.along(profiles[profile], path), within)
        case ("save", folder):
            engine.save(Path(folder) / f"{part}.npz")
            return NOTHING
        case ("forget others", blocks):
            cast("Divisible", engine).forget_others(blocks)
            return NOTHING
        case ("peak",):
            peak = _peak_mb()
            return Removal(peak, peak, peak)
    raise EngineError(f"unknown order {order[0]!r}", engine=engine.name)


def _peak_mb() -> float:
    """Largest memory of this process. `getrusage` would count what its parent had when it was started."""
    try:
        status = Path("/proc/self/status").read_text()
        return float(status.split("VmHWM:")[1].split()[0]) / 1024.0
    except (OSError, IndexError, ValueError):
        return getrusage(RUSAGE_SELF).ru_maxrss / 1024.0
