"""The process that runs OCCT: `python -m vmachining.engines.brep.removal.worker`, driven by `workers.py`.

Pickled messages over stdin and stdout. First (stock, blocks, folder for solids or None, witness or None), answered by "ready" or
why not, then questions:

| question | answers |
|---|---|
| ("check", block, judges, attempts) | what is under way, all judges once they have spoken, at last a `Verdict` |
| ("write", path, brackets, labels) | the volume of the STEP file, or the text of a refusal |
| ("call", function, arguments) | ("value", what it returns), or (kind, text) of what it raised |
| ("steps", function, arguments) | the same for each value of an iterator, then ("end", None) unless it raised |

OCCT talks on stdout, so the answers go through a copy of it and stdout itself becomes stderr.
"""

from __future__ import annotations

import os
import pickle
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from vmachining.engines.brep.process import obey_driver
from vmachining.errors import EngineError, VMachiningError

__all__ = ["main"]


END = object()
"""Behind the last value of an iterator."""


def main() -> None:
    """Answer until stdin ends."""
    obey_driver()
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    questions = sys.stdin.buffer
    from vmachining.engines.brep.occt.booleans import quiet
    from vmachining.engines.brep.removal.check import BlockChecker
    from vmachining.engines.brep.removal.store import Store

    quiet()
    stock, blocks, folder, witness = pickle.load(questions)

    def say(answer: object) -> None:
        pickle.dump(answer, answers)
        answers.flush()

    checker: BlockChecker | None = None
    try:
        if blocks:
            checker = BlockChecker(stock, blocks, Store(folder), witness)
            checker.warm()
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
        elif kind == "steps":
            for answer in _stepped(*question):
                say(answer)
        else:
            assert checker is not None
            block, judges, attempts = question
            say(checker.check(block, judges, attempts, say))


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


def _stepped(function: Callable[..., object], arguments: tuple[object, ...]) -> Iterator[tuple[str, object]]:
    """What an iterator yields, then that it ended, or what it says."""
    kind, values = _called(function, arguments)
    while kind == "value":
        kind, value = _called(next, (values, END))
        if value is END:
            kind, value = "end", None
        yield kind, value
    if kind != "end" and isinstance(values, str):  # not even begun
        yield kind, values


def _written(stock: Any, blocks: Any, path: Path, brackets: Any, labels: Any) -> float | str:
    """Volume of the STEP file, or why there is none."""
    from vmachining.engines.brep.workpiece.cut import write_step

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
