"""`check_blocks`: a ladder over many blocks in worker processes that may crash or hang without harm.

Every worker is an interpreter of its own, driven by one thread here over pipes. A rung that takes longer than
its limit costs the worker (killed by its handle); so does a crash. The block goes on with the next rung, at
worst it loses its own B-rep value. A worker is replaced after a number of blocks, because OCCT does not give
all memory back.
"""

from __future__ import annotations

import os
import pickle
import queue
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from pathlib import Path
from time import monotonic
from typing import Any, NamedTuple, TypeVar, cast

from vmachining.engines.brep.blank import Blank
from vmachining.engines.brep.rungs import (
    MESHES,
    NEXT,
    RAYS,
    RUNGS,
    SOLIDS,
    STEADY,
    Status,
    Verdict,
    steady_first,
)
from vmachining.errors import EngineError, SweepError
from vmachining.geometry import Bracket
from vmachining.sweep import Sweep
from vmachining.tolerance import BREP_SECONDS

__all__ = ["check_blocks", "isolated", "step_file"]

T = TypeVar("T")

LONGEST, EARLY, MOST = 0.25, 0.35, 0.8
"""Parts of the limit of a block: for one boolean rung, until steady rungs come next, and until which another rung is
worth a new process."""

PATIENCE = 8.0
"""Seconds by the clock that count as one of the processor."""

SHARED = (SOLIDS, MESHES)
"""What is built for other blocks, too, with a limit of its own for every sweep."""

RUN = 16
"""Blocks in a row for one worker."""

START_SECONDS = 300.0
"""An interpreter that loads OCCT and compiles kernels on a busy machine."""


class _Gone(Exception):  # noqa: N818 - not an error of ours
    """The worker does not answer any more; says why."""


class _Late(_Gone):
    """The worker takes too long."""


class _Watch:
    """Seconds that a process has taken since now: of a processor, so that a busy machine makes nobody late.

    Where the system does not tell, and for who waits without working, a share of the clock.
    """

    def __init__(self, pid: int) -> None:
        self._pid, self._clock, self._cpu = pid, monotonic(), _processor_seconds(pid)
        self._last = self._cpu

    def used(self) -> float:
        clock, cpu = monotonic() - self._clock, _processor_seconds(self._pid)
        if cpu is not None:  # else it is gone, or never told
            self._last = cpu
        if self._last is None or self._cpu is None:
            return clock
        return max(self._last - self._cpu, clock / PATIENCE)


def _processor_seconds(pid: int) -> float | None:
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    except (OSError, IndexError, ValueError, AttributeError):  # another system, or a process that is gone
        return None


class Spent(NamedTuple):
    """s of a processor: of rungs, and with what is built for other blocks, too."""

    own: float = 0.0
    all: float = 0.0

    def plus(self, seconds: float, doing: str) -> Spent:
        return Spent(self.own + (0.0 if doing in SHARED else seconds), self.all + seconds)


class _Worker:
    """One process with its pipes."""

    def __init__(self, hello: bytes, module: str = "vmachining.engines.brep.worker") -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", module],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        self.done, self.rung, self.used, self.late = 0, "", Spent(), False
        self.tried: list[str] = []
        self._answers: queue.SimpleQueue[tuple[bool, Any]] = queue.SimpleQueue()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        # a pipe is short: what does not read its greeting would keep us writing for ever
        late = threading.Timer(START_SECONDS, self._process.kill)
        late.start()
        try:
            self._send(hello)
            greeting = self._receive(START_SECONDS)
            if greeting != "ready":
                raise EngineError(str(greeting), engine="brep")
        except (_Gone, EngineError):
            self.close()
            raise
        finally:
            late.cancel()

    def write(self, path: Path, brackets: Sequence[Bracket], labels: Sequence[str], seconds: float) -> Any:
        self._send(pickle.dumps(("write", path, list(brackets), list(labels))))
        return self._receive(seconds)

    def ask(
        self,
        block: int,
        bracket: Bracket,
        rungs: Sequence[str],
        seconds: float,
        longest: float,
        early: float,
        build: float,
        barred: Collection[str],
    ) -> Verdict:
        """seconds : of the block. longest : of one rung. early : until steady rungs come next. build : of the solids of one
        sweep, and of every mesh of one. barred : see `Ladder.removed`.

        If this ends badly, `rung` is what was under way, `tried` all until then, `late` whether it was slow, and `used`
        what it had taken.
        """
        watch = _Watch(self._process.pid)
        self.rung, self.tried, self.late, self.used = SOLIDS, [], False, Spent()
        try:
            question = ("check", block, bracket, tuple(rungs), early, longest, seconds, tuple(barred))
            self._send(pickle.dumps(question))
            while True:
                left = build if self.rung in SHARED else seconds - self.used.own
                answer = self._receive(left if self.rung in (*SHARED, *STEADY) else min(longest, left))
                if isinstance(answer, Verdict):
                    self.done += 1
                    return answer
                self.used = self.used.plus(watch.used(), self.rung)
                watch = _Watch(self._process.pid)
                self.rung = answer
                self.tried.append(answer)
        except _Late:
            self.late = True
            raise
        finally:
            self.used = self.used.plus(watch.used(), self.rung)

    def call(self, question: object, seconds: float) -> Any:
        """Any question, and its answer."""
        self._send(pickle.dumps(question))
        return self._receive(seconds)

    def kill(self) -> None:
        """End the process from any thread; whoever waits for it hears that it is gone."""
        self._process.kill()

    def close(self) -> None:
        self._process.kill()
        self._process.wait()
        self._reader.join(timeout=10.0)
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                try:
                    pipe.close()
                except OSError:  # what was not sent yet has nobody to go to
                    continue

    def _send(self, message: bytes) -> None:
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(message)
            self._process.stdin.flush()
        except OSError as exc:
            raise _Gone(self._end()) from exc

    def _read(self) -> None:
        """Carry answers from the pipe, where a buffer would hide them from whoever waits with a limit."""
        pipe = self._process.stdout
        assert pipe is not None
        while True:
            try:
                self._answers.put((True, pickle.load(pipe)))
            except Exception:  # the end of the pipe, or bytes that are no answer
                self._answers.put((False, None))
                return

    def _receive(self, seconds: float) -> Any:
        watch = _Watch(self._process.pid)
        while True:
            left = seconds - watch.used()
            try:
                good, answer = self._answers.get(timeout=min(max(left, 0.0), 1.0))
            except queue.Empty:
                if left <= 0.0:
                    raise _Late(f"no answer within {seconds:.3g} s") from None
                continue
            if not good:
                raise _Gone(self._end())
            return answer

    def _end(self) -> str:
        try:
            code = self._process.wait(timeout=10.0)
        except subprocess.TimeoutExpired:
            return "its process closed its pipe and goes on"
        return (
            f"OCCT ended its process (signal {-code})" if code < 0 else f"its process ended with code {code}"
        )


def _over(worker: _Worker) -> list[str]:
    """Rungs that a worker, which is gone, need not be asked for again: all it tried, but not the one whose value was just
    being confirmed, and not what rays were asked of."""
    if worker.rung not in (MESHES, RAYS, *STEADY):
        return worker.tried
    last = len(worker.tried) - worker.tried[::-1].index(NEXT) if NEXT in worker.tried else 0
    found = [rung for rung in worker.tried[last:] if rung not in (*SHARED, RAYS)]
    kept = [rung for rung in found if rung not in STEADY][-1:] + (found[-1:] if worker.rung == RAYS else [])
    return [rung for rung in worker.tried if rung not in kept]


def check_blocks(
    stock: Blank,
    blocks: Sequence[Sequence[Sweep]],
    asked: Mapping[int, Bracket],
    *,
    workers: int = 1,
    seconds: float = BREP_SECONDS,
    recycle: int = 200,
    rungs: Sequence[str] = RUNGS,
    stop: Callable[[], bool] = lambda: False,
) -> Iterator[tuple[int, Verdict]]:
    """Verdicts of some blocks, as they come.

    Parameters
    ----------
    stock : raw stock.
    blocks : what every block of the program sweeps, in program order.
    asked : block number -> bracket of its removed volume.
    workers : processes.
    seconds : limit of one block, of processor time where the system tells it. The solids of every sweep that it is the first
        to need, and every mesh of them, have the same limit each. A rung that crashes or takes longer than 0.25 of it
        (facets and sections: what is left of it) costs the process; the block goes on with the next rung in a new one,
        after a hang with facets and sections, and is refused if no rung and no time is left.
    recycle : blocks after which a process is replaced.
    stop : asked between blocks; what is under way is dropped.

    Raises
    ------
    EngineError
        No worker can be started (the kernel does not load), or the thread that drives one failed.
    """
    # a block needs what came before it, no worker needs what comes after the last one asked for
    last = max(asked, default=-1)
    folder = tempfile.TemporaryDirectory(prefix="vmachining-", ignore_cleanup_errors=True)
    hello = pickle.dumps((stock, [list(block) for block in blocks[: last + 1]], Path(folder.name)))
    # neighbours need the same earlier solids, so a worker gets several in a row
    items = sorted(asked.items())
    run = max(1, min(RUN, len(items) // (8 * max(1, workers))))
    waiting: queue.SimpleQueue[list[tuple[int, Bracket]]] = queue.SimpleQueue()
    for first in range(0, len(items), run):
        waiting.put(items[first : first + run])
    answers: queue.SimpleQueue[tuple[int, Verdict] | EngineError] = queue.SimpleQueue()
    ended = threading.Event()
    running: set[_Worker] = set()

    def drive() -> None:
        try:
            ask_all()
        except Exception as exc:  # else whoever waits for the answers would wait for ever
            answers.put(EngineError(f"no verdicts: {type(exc).__name__} {exc}", engine="brep"))

    def ask_all() -> None:
        worker: _Worker | None = None
        mine: list[tuple[int, Bracket]] = []
        try:
            while not ended.is_set():
                try:
                    mine = mine or waiting.get_nowait()
                except queue.Empty:
                    return
                block, bracket = mine.pop(0)
                if worker is not None and worker.done >= recycle:
                    drop(worker)
                    worker = None
                used, left, lost, was_lost = Spent(), list(rungs), "", False
                barred: set[str] = set()
                while True:
                    if worker is None:
                        try:
                            worker = _Worker(hello)
                        except (_Gone, OSError) as exc:
                            answers.put(EngineError(f"no worker process: {exc}", engine="brep"))
                            return
                        except EngineError as exc:
                            answers.put(exc)
                            return
                        running.add(worker)
                    if ended.is_set():
                        return
                    try:
                        early, rest = EARLY * seconds - used.own, seconds - used.own
                        verdict = worker.ask(
                            block, bracket, left, rest, LONGEST * seconds, early, seconds, barred
                        )
                    except _Gone as exc:
                        lost = f"{worker.rung}: {exc}"
                        used = Spent(used.own + worker.used.own, used.all + worker.used.all)
                        over = _over(worker)
                        left = [rung for rung in left if rung not in over]
                        barred |= {*over} & {*STEADY} | {worker.rung} & {RAYS}
                        if worker.rung == SOLIDS:  # a process may die of other things, once
                            left, was_lost = ([] if worker.late or was_lost else left), True
                        elif worker.late and worker.rung not in (MESHES, RAYS, *STEADY):
                            left = steady_first(left)  # one way hangs as most do
                        drop(worker)
                        worker = None
                        if left and used.own < MOST * seconds:
                            continue  # what crashes one way of doing it may work another way
                        verdict = Verdict(Status.REFUSED, None, "", "", 0.0, 0)
                    if verdict.status is Status.REFUSED and lost:
                        told = f"{verdict.reason}; " if verdict.reason else ""
                        verdict = verdict._replace(reason=told + lost)
                    answers.put((block, verdict._replace(seconds=used.all + verdict.seconds)))
                    break
        finally:
            if worker is not None:
                drop(worker)

    def drop(worker: _Worker) -> None:
        running.discard(worker)
        worker.close()

    threads = [threading.Thread(target=drive, daemon=True) for _ in range(max(1, min(workers, len(asked))))]
    for thread in threads:
        thread.start()
    try:
        left = len(asked)
        while left:
            try:
                answer = answers.get(timeout=0.2)
            except queue.Empty:
                if stop():
                    return
                continue
            if isinstance(answer, EngineError):
                raise answer
            left -= 1
            yield answer
            if stop():
                return
    finally:
        ended.set()
        for worker in list(running):
            worker.kill()
        for thread in threads:
            thread.join(timeout=START_SECONDS)
        folder.cleanup()


def step_file(
    path: Path,
    stock: Blank,
    blocks: Sequence[Sequence[Sweep]],
    brackets: Sequence[Bracket],
    labels: Sequence[str],
    *,
    seconds: float = 3600.0,
) -> float:
    """Write the workpiece after all blocks as STEP, in a worker process; returns its volume, mm^3.

    Faces carry the label of their block as name, and a colour per block.

    Raises
    ------
    EngineError
        Refused: the text says which block and why; no file is left. Or the worker died or took too long.
    """
    hello = pickle.dumps((stock, [list(block) for block in blocks], None))
    worker: _Worker | None = None
    try:
        worker = _Worker(hello)
        answer = worker.write(path, brackets, labels, seconds)
    except (_Gone, OSError) as exc:
        answer = str(exc)
    finally:
        if worker is not None:
            worker.close()
    if isinstance(answer, float):
        return answer
    path.unlink(missing_ok=True)
    raise EngineError(f"no {path.name}: {answer}", engine="brep")


def isolated(function: Callable[..., T], *arguments: Any, seconds: float) -> T:
    """`function(*arguments)` in a process of its own; both the function and its answer travel as pickles.

    Raises
    ------
    SweepError, EngineError
        What the function raised.
    EngineError
        It crashed, or took longer than `seconds`.
    """
    worker: _Worker | None = None
    try:
        worker = _Worker(pickle.dumps((None, [], None)))
        kind, answer = worker.call(("call", function, arguments), seconds)
    except (_Gone, OSError) as exc:
        raise EngineError(str(exc), engine="brep") from exc
    finally:
        if worker is not None:
            worker.close()
    if kind == "value":
        return cast(T, answer)
    raise SweepError(answer) if kind == "SweepError" else EngineError(answer, engine="brep")
