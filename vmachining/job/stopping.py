"""`stop_flag`: signals of the user as a question that a run asks between blocks."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def stop_flag(given: Callable[[], bool] | None = None) -> Iterator[Callable[[], bool]]:
    """Turns the first SIGINT or SIGTERM into a flag; the second one acts as usual. Main thread only.

    given : a flag of somebody who decides about signals himself.
    """
    if given is not None:
        yield given
        return
    asked = threading.Event()
    if threading.current_thread() is not threading.main_thread():
        yield asked.is_set
        return
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def handler(number: int, frame: FrameType | None) -> None:
        asked.set()
        for known, old in before.items():
            signal.signal(known, old)

    for number in before:
        signal.signal(number, handler)
    try:
        yield asked.is_set
    finally:
        for number, old in before.items():
            signal.signal(number, old)
