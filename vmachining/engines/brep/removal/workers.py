"""`check_blocks`: verdicts on many blocks in worker processes that may crash or hang without harm.

One thread here drives every worker. An attempt that takes longer than its share of the block's time costs the worker, and so
does a crash; the block continues with the next attempt in a new one, until its time is used up. The time of a block is all
told: judges, solids of its own and of what it needs, attempts, and the processes that it costs. A worker is replaced after a
number of blocks, because OCCT does not give all memory back.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path

from vmachining.disk import Scratch
from vmachining.engines.brep.process import START_SECONDS, Late, WorkerLost, WorkerProcess, isolated
from vmachining.engines.brep.removal.attempts import ATTEMPTS
from vmachining.engines.brep.removal.check import JUDGES, SOLIDS, Witness, checker
from vmachining.engines.brep.removal.gate import ATTEMPT_SHARE, Status, Verdict
from vmachining.engines.judges import Judge
from vmachining.errors import EngineError, SweepError
from vmachining.interval import Interval
from vmachining.stock import Blank
from vmachining.sweep import Sweep
from vmachining.tolerance import BREP_SECONDS

RUN = 16
"""Blocks in a row for one worker: neighbours need the same earlier solids."""

RECYCLE = 200
"""Blocks after which a process is replaced."""

STEP_S = 3600.0
"""s of a processor, a workpiece as STEP."""

GRACE_S = 0.5
"""After which a signal that ended a worker has reached us, too."""


class _Block:
    """One block on its way to a verdict, through one worker or several."""

    def __init__(self, number: int, judges: Sequence[Judge], seconds: float) -> None:
        self.number, self.judges, self.attempts = number, tuple(judges), list(ATTEMPTS)
        self._seconds, self._used = seconds, 0.0
        self._reasons, self._tried = list[str](), list[tuple[str, float | None]]()
        self.is_lost = False

    def ask(self, worker: WorkerProcess, is_new: bool) -> Verdict | None:
        """Ask a worker that is at hand, or that this block has cost; None: it is gone, and another one may continue."""
        watch = worker.begun if is_new else worker.watch()
        doing, self.is_lost = JUDGES, False
        try:
            worker.send(self.number, self.judges, tuple(self.attempts))
            while True:
                left = self._seconds - self._used - watch.used()
                shared = doing in (JUDGES, SOLIDS)
                answer = worker.receive(left if shared else min(ATTEMPT_SHARE * self._seconds, left))
                if isinstance(answer, Verdict):
                    worker.receive(left)  # the end
                    return self._ended(answer, watch.used())
                if isinstance(answer, tuple):
                    self.judges = answer
                    continue
                doing = answer
                if doing in self.attempts:
                    self.attempts = self.attempts[self.attempts.index(doing) + 1 :]
        except (SweepError, EngineError) as exc:  # of a judge
            return self._ended(Verdict(Status.REFUSED, reason=str(exc), judges=self.judges), watch.used())
        except WorkerLost as exc:
            self.is_lost = True
            self._used += watch.used()
            self._reasons.append(f"{doing}: {exc}")
            if doing in ATTEMPTS:
                self._tried.append((doing, None))
            is_over = isinstance(exc, Late) and self._used >= (1.0 - ATTEMPT_SHARE) * self._seconds
            if doing in (JUDGES, SOLIDS) or is_over or not self.attempts:
                if is_over:
                    self._reasons.append(f"the {self._seconds:.3g} s of the block are used up")
                return self._ended(Verdict(Status.REFUSED, judges=self.judges), 0.0)
            return None

    def _ended(self, verdict: Verdict, used: float) -> Verdict:
        reasons = [*self._reasons, verdict.reason] if verdict.status is Status.REFUSED else [verdict.reason]
        return verdict._replace(
            reason="; ".join(filter(None, reasons)),
            seconds=self._used + used,
            tried=(*self._tried, *verdict.tried),
        )


def check_blocks(
    stock: Blank,
    blocks: Sequence[Sequence[Sweep]],
    asked: Mapping[int, Sequence[Judge] | Interval],
    *,
    witness: Witness | None = None,
    workers: int = 1,
    seconds: float = BREP_SECONDS,
    stop: Callable[[], bool] = lambda: False,
) -> Iterator[tuple[int, Verdict]]:
    """Verdicts on some blocks, as they come.

    stock : raw stock.
    blocks : what every block of the program sweeps, in program order.
    asked : block number -> what others say of its removed volume; an Interval alone is one judge.
    witness : a judge that is asked in the worker.
    workers : processes.
    seconds : limit of one block, of processor time where the system tells it.
    stop : asked between blocks; what is under way is dropped.
    Raises EngineError: No worker can be started (the kernel does not load), or the thread that drives one failed.
    """
    # a block needs what came before it, no worker needs what comes after the last one asked for
    last = max(asked, default=-1)
    folder = Scratch()
    setup = (stock, [list(block) for block in blocks[: last + 1]], folder.path, witness)
    items = [(number, _judges(said)) for number, said in sorted(asked.items())]
    run = max(1, min(RUN, len(items) // (8 * max(1, workers))))
    waiting: queue.SimpleQueue[list[tuple[int, Sequence[Judge]]]] = queue.SimpleQueue()
    for first in range(0, len(items), run):
        waiting.put(items[first : first + run])
    answers: queue.SimpleQueue[tuple[int, Verdict] | EngineError] = queue.SimpleQueue()
    ended = threading.Event()
    running: set[WorkerProcess] = set()

    def started_worker() -> WorkerProcess:
        worker = WorkerProcess(checker, *setup)
        running.add(worker)
        return worker

    def drop(worker: WorkerProcess) -> None:
        running.discard(worker)
        worker.close()

    def drive() -> None:
        """Carry blocks to verdicts until none is left."""
        worker: WorkerProcess | None = None
        done = 0
        mine: list[tuple[int, Sequence[Judge]]] = []
        try:
            while not ended.is_set():
                try:
                    mine = mine or waiting.get_nowait()
                except queue.Empty:
                    return
                number, judges = mine.pop(0)
                if worker is not None and done >= RECYCLE:
                    drop(worker)
                    worker = None
                work, verdict, cost = _Block(number, judges, seconds), None, False
                while verdict is None:
                    if worker is None:
                        worker, done = started_worker(), 0
                    if ended.is_set():
                        return
                    verdict = work.ask(worker, cost)
                    if work.is_lost:
                        drop(worker)
                        worker, cost = None, True
                done += 1
                answers.put((number, verdict))
        except (WorkerLost, OSError) as exc:
            answers.put(EngineError(f"no worker process: {exc}", engine="brep"))
        except EngineError as exc:
            answers.put(exc)
        except Exception as exc:  # else whoever waits for the answers would wait for ever
            answers.put(EngineError(f"no verdicts: {type(exc).__name__} {exc}", engine="brep"))
        finally:
            if worker is not None:
                drop(worker)

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
                time.sleep(GRACE_S)
                if stop():
                    return
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


def _judges(said: Sequence[Judge] | Interval) -> Sequence[Judge]:
    from vmachining.engines.protocol import Removal

    return (Judge("bracket", Removal(*said)),) if isinstance(said, Interval) else said


def step_file(
    path: Path,
    stock: Blank,
    blocks: Sequence[Sequence[Sweep]],
    brackets: Sequence[Interval],
    labels: Sequence[str],
) -> float:
    """Write the workpiece after all blocks as STEP, in a worker process; returns its volume, mm^3.

    Faces carry the label of their block as name, and a colour per block.

    Raises EngineError: Refused: the text says which block and why; no file is left. Or the worker died or took too
        long.
    """
    from vmachining.engines.brep.workpiece.cut import write_step

    setup = (path, stock, [list(block) for block in blocks], list(brackets), list(labels))
    try:
        return isolated(write_step, *setup, seconds=STEP_S)
    except SweepError as exc:
        why = str(exc)
    except EngineError as exc:
        why = exc.reason if exc.block is None else f"block {exc.block}: {exc.reason}"
    path.unlink(missing_ok=True)
    raise EngineError(f"no {path.name}: {why}", engine="brep")
