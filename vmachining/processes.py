"""Fresh interpreters that answer over a socket: no fork (kernels run threads), no semaphores to leak."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import TypeAlias

Child: TypeAlias = tuple[subprocess.Popen[bytes], Connection]
"""A process, and the line to it."""

QUIET = "import signal; signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})"
"""Ctrl-C reaches every process of a terminal; what it means is decided by the one that was started first. Blocked, not
ignored: polars, once it is loaded, raises KeyboardInterrupt in its queries where the signal is merely ignored."""


def start(
    module: str, function: str, environment: Mapping[str, str] | None = None, *, apart: bool = False, group: int | None = None
) -> Child:  # fmt: skip
    """A process that calls a function with the descriptor of its end of a connection, and the other end.

    The function is found by name, so that nothing of this process is copied. SIGINT is blocked there.
    apart : in a session by itself, which signals to our group do not reach; what it prints is dropped. group : of processes,
    0 for its own.

    Raises OSError: It cannot be started.
    """
    here, there = socket.socketpair()
    try:
        with there:
            process = subprocess.Popen(
                [
                    sys.executable,
                    "-c",
                    f"{QUIET}; from {module} import {function}; {function}({there.fileno()})",
                ],
                pass_fds=[there.fileno()],
                start_new_session=apart,
                process_group=group,
                stdout=subprocess.DEVNULL if apart else None,
                stderr=subprocess.DEVNULL if apart else None,
                env={
                    **os.environ, **(environment or {}), "PYTHONPATH": os.pathsep.join(filter(None, sys.path)),
                },
            )  # fmt: skip
    except OSError:
        here.close()
        raise
    return process, Connection(here.detach())


def dismiss(children: Sequence[Child], seconds: float = 5.0) -> None:
    """End processes: they stop when their line is closed, and are killed after `seconds`."""
    for _, line in children:
        line.close()
    for process, _ in children:
        with suppress(subprocess.TimeoutExpired):
            process.wait(seconds)
        process.kill()
        process.wait()
