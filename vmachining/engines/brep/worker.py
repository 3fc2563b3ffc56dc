"""The process that runs OCCT: `python -m vmachining.engines.brep.worker`, driven by `process.py`.

Pickled messages over stdin and stdout. First (make, arguments): what `make(*arguments)` returns is called with every question
after that, and gives an iterator. Each thing it yields is an answer ("value", thing); then follows ("end", None), or the kind
of an error, its reason and block. ("end", None) greets, too, or why there is nothing to ask.

OCCT talks on stdout, so the answers go through a copy of it and stdout itself becomes stderr.
"""

from __future__ import annotations

import os
import pickle
import sys
from collections.abc import Callable
from typing import Any

from vmachining.engines.brep.process import obey_driver
from vmachining.errors import EngineError, VMachiningError


def main() -> None:
    """Answer until stdin ends."""
    obey_driver()
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    from vmachining.engines.brep.occt.booleans import quiet

    quiet()

    def say(*answer: object) -> bool:
        pickle.dump(answer, answers)
        answers.flush()
        return answer[0] == "end"

    def work(done: Callable[[], Any]) -> bool:
        """Do something and say that it ended, or what it says; whether it did."""
        try:
            done()
        except EngineError as exc:  # who drives this process names the engine
            return say("EngineError", exc.reason, exc.block)
        except VMachiningError as exc:
            return say(type(exc).__name__, exc.message, None)
        except Exception as exc:  # OCCT raises whatever it meets
            return say("EngineError", f"OCCT failed: {type(exc).__name__} {exc}", None)
        return say("end", None)

    asked: Callable[..., Any]

    def begin() -> None:
        nonlocal asked
        make, arguments = pickle.load(sys.stdin.buffer)
        asked = make(*arguments)

    def answer() -> None:
        for thing in asked(*question):
            say("value", thing)

    if not work(begin):
        return
    while True:
        try:
            question = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        work(answer)


if __name__ == "__main__":
    main()
