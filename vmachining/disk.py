"""Errors of the file system as one clear message, and temporary directories that are removed even after a kill."""

from __future__ import annotations

import errno
import fcntl
import os
import platform
import shutil
import tempfile
import weakref
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

from vmachining.errors import FullError, InputError

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""No room: on the disk, in a quota, below the limit of the size of files."""

LEAST = 2**20
"""Bytes: with less free space than this, a write error of polars counts as a full disk."""


@contextmanager
def writing(target: Path, elsewhere: str = "") -> Iterator[None]:
    """Failures of the operating system as refusals that name the file: `FullError`, or else InputError.

    elsewhere : how another place is chosen, if not by --out.
    """
    try:
        yield
    except Exception as exc:
        number, why = getattr(exc, "errno", None), getattr(exc, "strerror", None) or exc
        if type(exc).__module__ == "polars.exceptions" and shutil.disk_usage(target.parent).free <= LEAST:
            number, why = errno.ENOSPC, os.strerror(errno.ENOSPC)
        elif not isinstance(exc, OSError):
            raise
        what, remedy = f"cannot write: {why}", elsewhere or "choose another --out"
        if number not in FULL:
            raise InputError(what, file=target, remedy=remedy) from exc
        room = "free some disk space" + (f" or {elsewhere}" if elsewhere else "")
        raise FullError(what, file=target, remedy=room) from exc


@contextmanager
def scribbling(folder: Path) -> Iterator[None]:
    """The same for files of a temporary directory, in whatever process."""
    with writing(folder, "set TMPDIR to another directory"):
        yield


LOCK = ".lock"


class Scratch:
    """A temporary directory: it goes at the end of a `with`, with whoever keeps it last, or with the process.

    A directory is locked while its process lives; the next process that makes one in the same place removes those without a lock.

    path : Path. where : what to make it in; None: what the system has for that.

    Raises InputError: It cannot be made.
    """

    def __init__(self, where: Path | None = None) -> None:
        where = where or Path(tempfile.gettempdir())
        _tidy(where)
        with scribbling(where):
            self.path, lock = _made(where)
        self.cleanup = weakref.finalize(self, _remove, self.path, lock)

    def __enter__(self) -> Path:
        return self.path

    def __exit__(self, *_: object) -> None:
        self.cleanup()


def _prefix() -> str:
    """Of this machine: what the lock of another one means is not known here."""
    return f".vmachining-{platform.node()}-"


def _made(where: Path) -> tuple[Path, int]:
    while True:
        path = Path(tempfile.mkdtemp(prefix=_prefix(), dir=where))
        lock = os.open(path / LOCK, os.O_RDWR | os.O_CREAT)
        with suppress(OSError):  # no locks on this file system: leftovers stay
            fcntl.flock(lock, fcntl.LOCK_EX)
        if path.exists():
            return path, lock
        os.close(lock)  # tidied up by another process before it was locked


def _remove(path: Path, lock: int) -> None:
    shutil.rmtree(path, ignore_errors=True)
    with suppress(OSError):
        os.close(lock)


@cache
def _tidy(where: Path) -> None:
    """Remove directories of killed processes."""
    for path in where.glob(f"{_prefix()}*"):
        with suppress(OSError):
            lock = os.open(path / LOCK, os.O_RDWR)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(path, ignore_errors=True)
            finally:
                os.close(lock)
