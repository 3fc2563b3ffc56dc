"""The process that runs OCCT: `python -m vmachining.engines.brep.worker`, driven by `workers.py`.

Pickled messages over stdin and stdout. First (stock, blocks, folder for solids or None), answered by "ready" or why
not, then questions:

| question | answers |
|---|---|
| ("check", block, bracket, rungs, early, longest, seconds, barred) | every rung before it is tried, then a `Verdict` |
| ("write", path, brackets, labels) | the volume of the STEP file, or the text of a refusal |
| ("call", function, arguments) | ("value", what it returns), or (kind, text) of what it raised |

OCCT talks on stdout, so the answers go through a copy of it and stdout itself becomes stderr.
"""

from __future__ import annotations

import ctypes
import os
import pickle
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vmachining.errors import EngineError, VMachiningError

if TYPE_CHECKING:
    from vmachining.engines.brep.blank import Blank

__all__ = ["end_with_driver", "main"]


PR_SET_PDEATHSIG = 1
"""Of <sys/prctl.h>: the signal that a process gets when the thread that made it ends."""


def main() -> None:
    """Answer until stdin ends."""
    end_with_driver()
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    questions = sys.stdin.buffer
    from vmachining.engines.brep.ladder import Ladder, quiet
    from vmachining.engines.brep.store import Store

    quiet()
    stock, blocks, folder = pickle.load(questions)

    def say(answer: object) -> None:
        pickle.dump(answer, answers)
        answers.flush()

    ladder: Ladder | None = None
    try:
        if blocks:
            ladder = Ladder(stock, blocks, Store(folder))
            ladder.warm()
    except VMachiningError as exc:  # the stock is no solid
        say(_reason(exc))
        return
    say("ready")
    while True:
        try:
            kind, *question = pickle.load(questions)
        except EOFError:
            return
        if kind == "write":
            say(_written(stock, blocks, *question))
        elif kind == "call":
            say(_called(*question))
        else:
            block, bracket, rungs, early, longest, seconds, barred = question
            assert ladder is not None
            limits = {"early": early, "longest": longest, "seconds": seconds}
            say(ladder.removed(block, bracket, rungs=rungs, **limits, barred=barred, told=say))


def end_with_driver() -> None:
    """Be killed with the process that drives this one (Linux): a boolean that hangs would never see stdin end."""
    with suppress(AttributeError, OSError, TypeError):
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)


def _reason(exc: VMachiningError) -> str:
    """What an error says; who drives this process names the engine."""
    return exc.reason if isinstance(exc, EngineError) else exc.message


def _called(function: Callable[..., object], arguments: tuple[object, ...]) -> tuple[str, object]:
    """What a function returns, or what it says."""
    try:
        return "value", function(*arguments)
    except VMachiningError as exc:
        return type(exc).__name__, _reason(exc)
    except Exception as exc:  # OCCT raises whatever it meets
        return "EngineError", f"OCCT failed: {type(exc).__name__} {exc}"


def _written(stock: Blank, blocks: Any, path: Path, brackets: Any, labels: Any) -> float | str:
    """Volume of the STEP file, or why there is none."""
    from vmachining.engines.brep.workpiece import write_step

    try:
        return write_step(path, stock, blocks, brackets, labels)
    except EngineError as exc:  # the caller names the engine
        return exc.reason if exc.block is None else f"block {exc.block}: {exc.reason}"
    except VMachiningError as exc:
        return str(exc)
    except Exception as exc:  # OCCT raises whatever it meets
        return f"OCCT failed: {type(exc).__name__} {exc}"


if __name__ == "__main__":
    main()
