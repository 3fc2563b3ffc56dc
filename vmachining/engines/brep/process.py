"""A separate process that runs OCCT: it may crash or hang without harm.

Every worker is its own interpreter, asked over a connection. It ignores Ctrl-C and a polite end, which are for the
process that drives it to decide about, and ends with it.
"""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import threading
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import Any, TypeVar

from vmachining.errors import EngineError, SweepError
from vmachining.processes import start

T = TypeVar("T")

PATIENCE = 8.0
"""Seconds by the clock that count as one of the processor."""

START_SECONDS = 300.0
"""An interpreter that loads OCCT and compiles kernels on a busy machine."""

PR_SET_PDEATHSIG = 1
"""Of <sys/prctl.h>: the signal that a process gets when the thread that made it ends."""


class WorkerLost(Exception):  # noqa: N818 - not an error of ours
    """The process does not answer any more; says why."""


class Late(WorkerLost):
    """It takes too long."""


def obey_driver() -> None:
    """Called first in a worker: only the driver ends it, and its end (Linux) is the worker's, for a boolean that hangs would
    never see its line end."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)


class Watch:
    """Seconds that a process has taken since now: of a processor, so that a busy machine makes nobody late.

    Where the system does not tell, and for who waits without working, a share of the clock.
    """

    def __init__(self, pid: int) -> None:
        self._pid, self._clock, self._cpu = pid, monotonic(), _processor_seconds(pid)
        self._last = self._cpu

    def used(self) -> float:
        """Until now; the last known value of a process that is gone."""
        clock, cpu = monotonic() - self._clock, _processor_seconds(self._pid)
        if cpu is not None:
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


END = object()
"""There is no further answer to a question."""


class WorkerProcess:
    """One process with its connection.

    make, arguments : what `make(*arguments)` returns there is called with every question, and gives an iterator of answers.
    seconds : of a processor for that, beside those of a start.

    Raises WorkerLost: It ended before it was ready, or was late.
    Raises SweepError, EngineError: What `make` raised.
    """

    def __init__(self, make: Callable[..., Any], *arguments: Any, seconds: float = 0.0) -> None:
        self._process, self._line = start("vmachining.engines.brep.worker", "serve", apart=True)
        self.begun = self.watch()
        # a line is short: what does not read its greeting would keep us writing for ever
        late = threading.Timer(START_SECONDS, self._process.kill)
        late.start()
        try:
            self.send(make, arguments)
            late.cancel()
            self.receive(START_SECONDS + seconds)
        except BaseException:  # Ctrl-C, too, and what no pickle holds
            self.close()
            raise
        finally:
            late.cancel()

    def watch(self) -> Watch:
        """What it takes from now on."""
        return Watch(self._process.pid)

    def __enter__(self) -> WorkerProcess:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def ask(self, *question: Any, seconds: float) -> Iterator[Any]:
        """Answers to a question as they come, each within so many seconds; raises what `receive` does."""
        self.send(*question)
        while (answer := self.receive(seconds)) is not END:
            yield answer

    def send(self, *question: Any) -> None:
        """Ask; answers are to be received. Raises `WorkerLost` if nobody reads."""
        try:
            self._line.send(question)
        except OSError as exc:
            raise WorkerLost(self._end()) from exc

    def receive(self, seconds: float) -> Any:
        """The next answer, or `END`.

        Raises Late, WorkerLost: None within so many seconds of its processor; or it ended.
        Raises SweepError, EngineError: What was raised there instead of an answer.
        """
        watch = self.watch()
        try:
            while not self._line.poll(min(max(left := seconds - watch.used(), 0.0), 1.0)):
                if left <= 0.0:
                    raise Late(f"no answer within {max(seconds, 0.0):.3g} s of a processor")
            kind, what, *block = self._line.recv()
        except WorkerLost:
            raise
        except Exception as exc:  # the end of the line, or bytes that are not an answer
            raise WorkerLost(self._end()) from exc
        if kind in ("value", "end"):
            return what if kind == "value" else END
        raise SweepError(what) if kind == "SweepError" else EngineError(what, engine="brep", block=block[0])

    def kill(self) -> None:
        """End the process from any thread; whoever waits for it hears that it is gone."""
        self._process.kill()

    def close(self) -> None:
        """End it and the connection."""
        self._process.kill()
        self._process.wait()
        self._line.close()

    def _end(self) -> str:
        try:
            code = self._process.wait(timeout=10.0)
        except subprocess.TimeoutExpired:
            return "its process closed its line and continues"
        return (
            f"OCCT ended its process (signal {-code})" if code < 0 else f"its process ended with code {code}"
        )


def isolated(function: Callable[..., T], *arguments: Any, seconds: float) -> T:
    """`function(*arguments)` in a separate process; both the function and its answer travel as pickles.

    Raises SweepError, EngineError: What the function raised.
    Raises EngineError: It crashed, or took longer than `seconds`.
    """
    answer: T = next(isolated_steps(_once, function, *arguments, seconds=seconds))
    return answer


def isolated_steps(
    function: Callable[..., Iterator[T]], *arguments: Any, seconds: float
) -> Generator[T, None, None]:
    """What the iterator `function(*arguments)` yields, from a separate process; `isolated` for answers that come one by one.

    Raises SweepError, EngineError: What it raised, after what it yielded before.
    Raises EngineError: It crashed, or took longer than `seconds` for one of its values.
    """
    try:
        with WorkerProcess(_caller) as worker:
            yield from worker.ask(function, *arguments, seconds=seconds)
    except (WorkerLost, OSError) as exc:
        raise EngineError(str(exc), engine="brep") from exc


def _caller() -> Callable[..., Any]:
    return lambda function, *arguments: function(*arguments)


def _once(function: Callable[..., T], *arguments: Any) -> Iterator[T]:
    yield function(*arguments)
