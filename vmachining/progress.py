"""How far a long call is, shown where its caller looks: in a notebook below the cell, else on stderr; and `stop_flag`, signals of
the user as a question that it asks now and then."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape
from types import FrameType
from typing import Any

Progress = Callable[[str, int, int], None]
"""Called with the name of the stage, what is done and how much there is, mostly blocks."""

PAUSE_S = 0.1
"""Between two updates of one stage."""


@contextmanager
def shown(progress: Progress | bool | None) -> Iterator[Progress]:
    """The function to call. True: a bar, which goes away at the end; None or False: nothing is shown."""
    if callable(progress):
        yield progress
    elif not progress:
        yield lambda *_: None
    else:
        write, close = _notebook() if _in_notebook() else _terminal()
        last = ("", 0.0)

        def update(stage: str, done: int, total: int) -> None:
            nonlocal last
            now = time.monotonic()
            if done >= total or stage != last[0] or now - last[1] >= PAUSE_S:
                last = stage, now
                write(stage, done, total)

        try:
            yield update
        finally:
            close()


def _in_notebook() -> bool:
    """Whether a kernel of Jupyter runs this; IPython in a terminal has another shell."""
    ipython = sys.modules.get("IPython")
    shell: Any = ipython.get_ipython() if ipython is not None else None
    return shell is not None and hasattr(shell, "kernel")


def _notebook() -> tuple[Progress, Callable[[], None]]:
    from IPython.display import HTML, display

    handle: Any = display(HTML(""), display_id=True)  # type: ignore[no-untyped-call]

    def write(stage: str, done: int, total: int) -> None:
        bar = f'<progress value="{done}" max="{max(total, 1)}"></progress>'
        handle.update(HTML(f"{bar} {escape(stage)}: {done} of {total}"))  # type: ignore[no-untyped-call]

    return write, lambda: handle.update(HTML(""))  # type: ignore[no-untyped-call]


def _terminal() -> tuple[Progress, Callable[[], None]]:
    def write(stage: str, done: int, total: int) -> None:
        sys.stderr.write(f"\r\x1b[K{stage}: {done} of {total}")
        sys.stderr.flush()

    def close() -> None:
        sys.stderr.write("\r\x1b[K")
        sys.stderr.flush()

    return write, close


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
