"""Several processes that cut one workpiece: each has all sweeps and cuts its own share of the tiles.

Nobody waits: orders are sent ahead, answers are collected when they are asked for, and the volumes of a block
are the sums over the shares. The numbers do not depend on how many processes there are, up to the rounding of
these sums. `Solo` is the same with one process, this one.

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
from collections import deque
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from tempfile import TemporaryDirectory
from types import TracebackType
from typing import Any, NoReturn, Protocol, TypeAlias

from manifold3d import Manifold

from vmachining.engines.mesh.engine import MeshEngine
from vmachining.engines.mesh.tiles import Share
from vmachining.errors import EngineError
from vmachining.geometry import Arc, Bracket, Line
from vmachining.sweep import Sweep, Turn
from vmachining.tool import Profile

__all__ = ["Crew", "MeshCrew", "Solo", "crew"]

BATCH = 16
"""Orders in one message: a message costs about as much as an order in air."""

ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""What a worker inherits: threads of a linear algebra that it hardly uses would wait busily for work."""

CutterPath: TypeAlias = Line | Arc | Turn

Later: TypeAlias = Callable[[], Bracket]
"""An answer that may still be on its way; calling it waits for it."""


class Crew(Protocol):
    """Who cuts. Orders are carried out in the order they are given in.

    ahead : blocks to order before the first of them is asked for, so that nobody is idle.
    """

    chord: float
    ahead: int

    def cut(self, profile: Profile, path: CutterPath, block: int) -> Later:
        """Remove a sweep, see `MeshEngine.cut`."""
        ...

    def touch(
        self,
        profile: Profile,
        path: CutterPath,
        deep: Sequence[Profile] | None = None,
        chord: float | None = None,
    ) -> Later:
        """What a sweep would remove (its estimate counts), see `MeshEngine.touch`."""
        ...

    def save(self, path: Path) -> None:
        """Write the workpiece as it is after all orders so far."""
        ...

    def finish(self) -> MeshEngine:
        """The workpiece after all orders; no further ones."""
        ...

    def peak_mb(self) -> float:
        """Memory of the other processes at their largest, MB."""
        ...

    def close(self) -> None:
        """Send the workers home."""
        ...


def crew(engine: MeshEngine, workers: int) -> Crew:
    """As many processes as asked for to go on with an engine."""
    return Solo(engine) if workers <= 1 else MeshCrew(engine, workers)


class Solo:
    """This process alone: every order is carried out at once."""

    ahead = 0

    def __init__(self, engine: MeshEngine) -> None:
        self.chord = engine.chord
        self._engine = engine

    def cut(self, profile: Profile, path: CutterPath, block: int) -> Later:
        """See `Crew`."""
        removed = self._engine.cut(Sweep.along(profile, path), block)
        return lambda: removed

    def touch(
        self,
        profile: Profile,
        path: CutterPath,
        deep: Sequence[Profile] | None = None,
        chord: float | None = None,
    ) -> Later:
        """See `Crew`."""
        found = _touched(self._engine, profile, path, deep, chord)
        return lambda: found

    def save(self, path: Path) -> None:
        """See `Crew`."""
        self._engine.save(path)

    def finish(self) -> MeshEngine:
        """See `Crew`."""
        return self._engine

    def peak_mb(self) -> float:
        """See `Crew`."""
        return 0.0

    def close(self) -> None:
        """See `Crew`."""


class MeshCrew:
    """`workers` processes that go on with an engine.

    Raises
    ------
    EngineError
        A worker reports a failure of its kernel, or has died; names the block where one is known.
    """

    ahead = 256

    def __init__(self, engine: MeshEngine, workers: int) -> None:
        self.chord = engine.chord
        self._profiles: dict[int, tuple[int, Profile]] = {}
        self._waiting: list[tuple[Any, ...]] = []
        self._sent, self._told, self._first = 0, 0, 0
        self._answers: list[deque[tuple[float, float, float]]] = []
        self._sums: dict[int, Bracket] = {}
        self._folder = TemporaryDirectory(prefix="vmachining-crew-")
        self._workers: list[tuple[subprocess.Popen[bytes], Connection]] = []
        start = Path(self._folder.name) / "start.npz"
        engine.save(start)
        try:
            for part in range(workers):
                self._workers.append(_hire())
                self._answers.append(deque())
                self._workers[part][1].send((str(start), part, workers))
        except OSError as error:
            self.close()
            raise EngineError(f"a worker process cannot be started ({error})", engine="mesh") from error

    def __enter__(self) -> MeshCrew:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    # -- orders --------------------------------------------------------------------------------------------

    def cut(self, profile: Profile, path: CutterPath, block: int) -> Later:
        """See `Crew`."""
        return self._order("cut", self._known(profile), path, block)

    def touch(
        self,
        profile: Profile,
        path: CutterPath,
        deep: Sequence[Profile] | None = None,
        chord: float | None = None,
    ) -> Later:
        """See `Crew`."""
        cores = None if deep is None else tuple(self._known(core) for core in deep)
        return self._order("touch", self._known(profile), path, cores, chord)

    def save(self, path: Path) -> None:
        """See `Crew`."""
        self._collected().save(path)

    def finish(self) -> MeshEngine:
        """See `Crew`."""
        engine = self._collected()
        self.close()
        return engine

    def close(self) -> None:
        """See `Crew`."""
        for process, line in self._workers:
            line.close()
            with suppress(subprocess.TimeoutExpired):
                process.wait(5.0)
            process.kill()
            process.wait()
        self._workers.clear()
        self._folder.cleanup()

    def peak_mb(self) -> float:
        """See `Crew`."""
        return sum(answer[0] for answer in self._all("peak"))

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

    def _answer(self, number: int) -> Bracket:
        self._sum(number + 1)
        return self._sums.pop(number)

    def _sum(self, stop: int) -> None:
        """Add up the answers to all orders before `stop`, waiting for them."""
        if self._told < stop:
            self._flush()
        while self._first < stop:
            self._gather()
            parts = [answers.popleft() for answers in self._answers]
            lo, estimate, hi = (sum(column) for column in zip(*parts, strict=True))
            self._sums[self._first] = Bracket(lo, estimate, hi)
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
            engine="mesh",
        )

    def _all(self, *order: Any) -> list[tuple[float, float, float]]:
        """What each worker answers to an order, once all earlier ones are done."""
        later = self._order(*order)
        self._flush()
        self._sum(self._sent - 1)
        self._gather()
        found = [answers[0] for answers in self._answers]
        later()
        return found

    def _collected(self) -> MeshEngine:
        """The joined workpiece after all orders so far."""
        self._all("save", self._folder.name)
        files = [Path(self._folder.name) / f"{part}.npz" for part in range(len(self._workers))]
        return MeshEngine.join([MeshEngine.load(file) for file in files])


def _hire() -> tuple[subprocess.Popen[bytes], Connection]:
    """A fresh interpreter that serves at the other end of the line."""
    here, there = socket.socketpair()
    with there:
        process = subprocess.Popen(
            [
                sys.executable,
                "-c",
                f"from vmachining.engines.mesh.crew import serve; serve({there.fileno()})",
            ],
            pass_fds=[there.fileno()],
            env=os.environ | ONE_THREAD | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        )
    return process, Connection(here.detach())


def _use_one_thread() -> None:
    """Keep manifold3d from starting threads in this process: the other cores belong to the other workers.

    It asks once, at its first boolean, on how many cores it may run; two workers with two threads each were
    measured to spend half as much again on waiting for each other.
    """
    if not hasattr(os, "sched_setaffinity"):
        return
    cores = os.sched_getaffinity(0)
    try:
        os.sched_setaffinity(0, {min(cores)})
        (Manifold.cube() - Manifold.cube((0.5, 0.5, 0.5))).num_tri()
    except OSError:  # a system that does not let its processes choose
        return
    finally:
        with suppress(OSError):
            os.sched_setaffinity(0, cores)


def serve(descriptor: int) -> None:
    """Life of a worker: orders in, answers out, until the line is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    _use_one_thread()
    line = Connection(descriptor)
    profiles: dict[int, Profile] = {}
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):
        start, part, parts = line.recv()
        engine: MeshEngine | None = None
        failed: EngineError | None = None
        try:
            engine = MeshEngine.load(Path(start), share=Share(part, parts))
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
                        raise failed or EngineError("no workpiece", engine="mesh")
                    answers.append(tuple(_done(engine, profiles, order, part)))
                except EngineError as error:
                    failed = error
                    answers.append(error)
                except Exception as error:  # whatever it is, it must reach the one who asked
                    failed = EngineError(f"{type(error).__name__}: {error}", engine="mesh")
                    answers.append(failed)
            line.send(answers)


def _done(engine: MeshEngine, profiles: dict[int, Profile], order: tuple[Any, ...], part: int) -> Bracket:
    """Carry out one order."""
    match order:
        case ("cut", profile, path, block):
            return engine.cut(Sweep.along(profiles[profile], path), block)
        case ("touch", profile, path, deep, chord):
            cores = None if deep is None else [profiles[core] for core in deep]
            return _touched(engine, profiles[profile], path, cores, chord)
        case ("save", folder):
            engine.save(Path(folder) / f"{part}.npz")
            return Bracket(0.0, 0.0, 0.0)
        case ("peak",):
            peak = _peak_mb()
            return Bracket(peak, peak, peak)
    raise EngineError(f"unknown order {order[0]!r}", engine="mesh")


def _peak_mb() -> float:
    """Largest memory of this process. `getrusage` would count what its parent had when it was started."""
    try:
        status = Path("/proc/self/status").read_text()
        return float(status.split("VmHWM:")[1].split()[0]) / 1024.0
    except (OSError, IndexError, ValueError):
        return getrusage(RUSAGE_SELF).ru_maxrss / 1024.0


def _touched(
    engine: MeshEngine,
    profile: Profile,
    path: CutterPath,
    deep: Sequence[Profile] | None,
    chord: float | None,
) -> Bracket:
    cores = None if deep is None else [Sweep.along(core, path) for core in deep]
    volume = engine.touch(Sweep.along(profile, path), deep=cores, chord=chord)
    return Bracket(volume, volume, volume)
