"""Which processes cut the workpiece of a job: this one, or several that each have all sweeps and cut their own part.

Nobody waits: orders are sent ahead, answers are collected when they are requested, and the volumes of a block
are the sums over the shares of the workpiece, in their order. Numbers depend on how many shares there are (those of the mesh
engine by rounding, brackets of columns within the width that is requested) and on nothing else: with a fixed number of them
one process and many give the same to the last digit. Any engine can be cut in this process; more than one share needs an
engine that is `Divisible`.

Workers are fresh interpreters (threads would queue for one interpreter lock, forks would copy kernels that
run their own threads). They ignore Ctrl-C, which is for this process to decide about, and end with it.
"""

from __future__ import annotations

import subprocess
import time
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.reduction import ForkingPickler
from pathlib import Path
from types import TracebackType
from typing import Any, NoReturn, Protocol, TypeAlias, cast

from vmachining.disk import Scratch, scribbling
from vmachining.engines import entry_of
from vmachining.engines.protocol import Divisible, Engine, Removal, Request
from vmachining.engines.serving import joined, shares_of, told_by
from vmachining.errors import EngineError, VMachiningError
from vmachining.geometry import Arc, Line
from vmachining.processes import Child, dismiss, start
from vmachining.sweep import Sweep, Turn
from vmachining.tool import Profile

BATCH = 64
"""Orders in one message: a message costs about as much as an order in air."""

AHEAD_APART = 1
"""Long blocks keep a process busy, and with more of them on their way no checkpoint could be written for long."""

AT_ONCE = (8, 1024)
"""Orders of an engine that is faster with many at once: fewest and most that wait for each other."""

AT_ONCE_SHARE = 32
"""Other engines that take several orders keep at most one in 32 waiting, so short programs can be stopped after any block."""

AT_ONCE_SECONDS = 0.5

ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""What a worker inherits: threads of a linear algebra that it hardly uses would wait busily for work."""

CutterPath: TypeAlias = Line | Arc | Turn

Later: TypeAlias = Callable[[], Removal]
"""An answer that may still be on its way; calling it waits for it."""


class Executor(Protocol):
    """Who cuts. Orders are carried out in the order they are given in.

    engine : name of the engine. chord : mm, of the engine.
    ahead : blocks to order before the first of them is requested, so that nobody is idle.
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


def executor(
    engine: Engine,
    workers: int,
    *,
    shares: int | None = None,
    apart: bool = False,
    staff: Staff | None = None,
) -> Executor:
    """As many processes as asked for to continue with an engine; one where it cannot be divided.

    shares : of the workpiece; None: one for each process. apart : long blocks, so that even one process is another one
    than this: kernels hold the interpreter, and no signal would be heard before the end of a block.
    staff : processes that wait for work already.
    """
    if not entry_of(engine.name).divisible:
        return InProcess(engine)
    if workers <= 1 and not apart:
        return InProcess(engine, shares or 1)
    pool = WorkerPool(cast("Divisible", engine), max(1, workers), shares, staff)
    if apart:
        pool.ahead = AHEAD_APART
    return pool


class InProcess:
    """This process alone, share by share.

    Orders wait until there are enough of them, or until somebody asks for an answer. How many are enough follows from how long
    the last ones took, so that Ctrl-C and checkpoints wait for about `AT_ONCE_SECONDS` at most; numbers do not depend on it.

    Parameters
    ----------
    shares : of the workpiece; more than one of an engine that is `Divisible`. own : those that are cut; None: all.
    """

    def __init__(self, engine: Engine, shares: int = 1, own: Sequence[int] | None = None) -> None:
        self.engine, self.chord = engine.name, engine.chord
        self._whole, self._engines = engine, [engine]
        self._known_whole: Engine | None = None  # as it was joined, while nothing is cut after that
        self.ahead = self._fewest = AT_ONCE[0] if shares > 1 or entry_of(engine.name).batched else 0
        self._waiting: list[Request] = []
        self._given = 0
        self._answers: dict[int, Removal] = {}
        if shares > 1:
            with Scratch() as folder, scribbling(folder):
                engine.save(start := folder / "start.npz")
                self._engines = shares_of(engine.name, start, own or range(shares), shares)

    def cut(self, profile: Profile, path: CutterPath, block: int) -> Later:
        """See `Executor`."""
        self._known_whole = None
        return self._order(Request(Sweep.along(profile, path), block))

    def touch(self, profile: Profile, path: CutterPath, within: float | None = None) -> Later:
        """See `Executor`."""
        return self._order(Request(Sweep.along(profile, path), cuts=False, within=within))

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
        for parts in told_by(self._engines, waiting):
            self._answers[self._given] = self._summed(parts)
            self._given += 1
        seconds = (time.perf_counter() - begin) / len(waiting)
        most = AT_ONCE[1]
        if not self._fewest:
            most = min(self._given // AT_ONCE_SHARE, most) if hasattr(self._whole, "answer") else 0
        soon = max(AT_ONCE_SECONDS / max(seconds, 1e-9), self._fewest)
        self.ahead = int(min(soon, most, 2 * self.ahead + 1))

    def _summed(self, parts: list[Removal]) -> Removal:
        return parts[0] if len(parts) == 1 else cast("Divisible", self._whole).summed(parts)

    def save(self, path: Path) -> None:
        """See `Executor`."""
        self._joined().save(path)

    def finish(self) -> Engine:
        """See `Executor`."""
        return self._joined()

    def _joined(self) -> Engine:
        """The whole workpiece; shares stay as they are."""
        self._flush()
        if len(self._engines) == 1:
            return self._engines[0]
        if self._known_whole is not None:
            return self._known_whole
        with Scratch() as folder, scribbling(folder):
            files = [folder / f"{share}.npz" for share in range(len(self._engines))]
            for engine, file in zip(self._engines, files, strict=True):
                engine.save(file)
            whole = self._known_whole = joined(self.engine, files)
        if (blocks := whole.in_use()) is not None:
            for one in (whole, *self._engines):
                cast("Divisible", one).forget_others(blocks)
        return whole

    def peak_mb(self) -> float:
        """See `Executor`."""
        return 0.0

    def close(self) -> None:
        """See `Executor`."""


class WorkerPool:
    """`workers` processes that continue with an engine.

    Raises
    ------
    EngineError
        A worker reports a failure of its kernel, or has died; names the block where one is known.
    FullError
        A worker finds no room for its shares.
    """

    ahead = 256

    def __init__(
        self, engine: Divisible, workers: int, shares: int | None = None, staff: Staff | None = None
    ) -> None:
        self.engine, self.chord = engine.name, engine.chord
        self._whole, self._shares = engine.summed, shares or workers
        self._profiles: dict[int, tuple[int, Profile]] = {}
        self._waiting: list[tuple[Any, ...]] = []
        self._sent, self._told, self._first = 0, 0, 0
        self._answers: list[deque[list[Removal]]] = []
        self._sums: dict[int, Removal] = {}
        self._known_whole: Divisible | None = None  # as it was saved, while nothing is cut after that
        self._scratch = Scratch()
        self._workers: list[Child] = []
        start = self._scratch.path / "start.npz"
        with scribbling(self._scratch.path):
            engine.save(start)
        try:
            for part in range(min(workers, self._shares)):
                self._workers.append(_hire() if staff is None else staff.one())
                self._answers.append(deque())
                own = range(part, self._shares, workers)
                self._workers[part][1].send((engine.name, str(start), own, self._shares))
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
        self._known_whole = None
        return self._order("ask", self._known(profile), path, block)

    def touch(self, profile: Profile, path: CutterPath, within: float | None = None) -> Later:
        """See `Executor`."""
        return self._order("ask", self._known(profile), path, None, False, within)

    def save(self, path: Path) -> None:
        """See `Executor`."""
        self._known_whole = engine = self._collected()
        blocks = engine.in_use()
        if blocks is not None:  # a part knows its own tiles, and not what is of use to the others
            engine.forget_others(blocks)
            self._all("forget others", blocks)
        engine.save(path)

    def finish(self) -> Engine:
        """See `Executor`."""
        engine = self._known_whole or self._collected()
        self.close()
        return engine

    def close(self) -> None:
        """See `Executor`."""
        dismiss(self._workers)
        self._workers.clear()
        self._scratch.cleanup()

    def peak_mb(self) -> float:
        """See `Executor`."""
        return sum(answer.hi for answer in self._all("peak"))

    # -- messages ------------------------------------------------------------------------------------------

    def _known(self, profile: Profile) -> int:
        """Number of a profile, given to the workers once; kept, so that its id stays its own."""
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
            told = [answers.popleft() for answers in self._answers]
            parts = [told[share % len(told)][share // len(told)] for share in range(self._shares)]
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
            if isinstance(answer, VMachiningError):
                raise answer
            self._answers[part].append(answer)

    def _lost(self, part: int) -> NoReturn:
        process, _ = self._workers[part]
        with suppress(subprocess.TimeoutExpired):
            process.wait(5.0)
        raise EngineError(
            f"worker process {part + 1} of {len(self._workers)} ended with exit code {process.returncode}; "
            "-9 usually means out of memory: use fewer workers",
            engine=self.engine,
        )

    def _all(self, *order: Any) -> list[Removal]:
        """What each worker answers to an order, once all earlier ones are done."""
        later = self._order(*order)
        self._flush()
        self._sum(self._sent - 1)
        self._gather()
        found = [answers[0][0] for answers in self._answers]
        later()
        return found

    def _collected(self) -> Divisible:
        """The joined workpiece after all orders so far."""
        folder = self._scratch.path
        self._all("save", str(folder))
        return joined(self.engine, [folder / f"{share}.npz" for share in range(self._shares)])


class Staff:
    """Processes that are started ahead: they load what they need while the program is still being read."""

    def __init__(self) -> None:
        self._waiting: list[Child] = []

    def hire(self, count: int) -> None:
        """Start so many; where that fails, whoever needs one says so."""
        with suppress(OSError):
            while len(self._waiting) < count:
                self._waiting.append(_hire())

    def one(self) -> Child:
        """One of them, or a new one.

        Raises OSError: It cannot be started.
        """
        return self._waiting.pop() if self._waiting else _hire()

    def close(self) -> None:
        """Send those home that nobody needed."""
        dismiss(self._waiting)
        self._waiting.clear()


def _hire() -> Child:
    """A process that serves; signals to a group, as of a terminal or `timeout`, are for this process to decide about."""
    return start("vmachining.engines.serving", "serve", ONE_THREAD, group=0)
