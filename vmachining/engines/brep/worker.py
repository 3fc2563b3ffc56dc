"""The process that runs OCCT, driven by `process.py`.

First comes (make, arguments): what `make(*arguments)` returns is called with every question after that, and gives an iterator.
Each thing it yields is an answer ("value", thing); then follows ("end", None), or the kind of an error, its reason and block.
("end", None) greets, too, or why there is nothing to ask.
"""

from __future__ import annotations

from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

from vmachining.engines.brep.process import obey_driver
from vmachining.errors import EngineError, VMachiningError


def serve(descriptor: int) -> None:
    """Answer until nobody listens."""
    obey_driver()
    line = Connection(descriptor)
    from vmachining.engines.brep.occt.booleans import quiet

    quiet()

    def say(*answer: object) -> bool:
        line.send(answer)
        return answer[0] == "end"

    def work(done: Callable[[], Any]) -> bool:
        """Do something and say that it ended, or what it says; whether it did."""
        try:
            done()
        except VMachiningError as exc:  # who drives this process names the engine
            what = exc.reason if isinstance(exc, EngineError) else exc.message
            remedy = f"; {exc.remedy}" if exc.remedy else ""
            return say(type(exc).__name__, what + remedy, getattr(exc, "block", None))
        except Exception as exc:  # OCCT raises whatever it meets
            return say("EngineError", f"OCCT failed: {type(exc).__name__} {exc}", None)
        return say("end", None)

    asked: Callable[..., Any]

    def begin() -> None:
        nonlocal asked
        make, arguments = line.recv()
        asked = make(*arguments)

    def answer() -> None:
        for thing in asked(*question):
            say("value", thing)

    if not work(begin):
        return
    while True:
        try:
            question = line.recv()
        except (EOFError, OSError):
            return
        except Exception as exc:  # names that exist only in the process that asks
            say("EngineError", f"the question cannot be read: {exc}", None)
            continue
        work(answer)
