"""Solids of sweeps on disk, for the processes of one run.

A sweep that folds is covered by up to hundreds of solids, which take a minute. A process that is lost, because one
boolean hung in it, would build all it knew again, and two processes side by side would both build what they share.
"""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from time import process_time
from typing import Any, TypeVar

from vmachining.engines.brep.occt.parts import from_bytes, to_bytes
from vmachining.errors import EngineError, SweepError

__all__ = ["NOTHING_KEPT", "Store"]

T = TypeVar("T")

SLOW_S = 0.5
"""s of a processor: what is built faster is not kept. Reading takes a millisecond per solid, writing 100 kB."""


class Store:
    """What took long to build, by name.

    Parameters
    ----------
    folder : Path or None
        Where; None keeps nothing. Whoever makes it removes it. Only files of one's own run belong there: they are pickles.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder

    def solids(self, number: int, build: Callable[[], list[Any]]) -> list[Any]:
        """TopoDS_Shapes of a sweep that `build` gives, or gave to another process.

        Raises
        ------
        SweepError, EngineError
            Those of `build`, here or there.
        """
        return self._kept(f"{number}", build, _packed, _unpacked)

    def _kept(
        self, name: str, build: Callable[[], T], pack: Callable[[T], object], unpack: Callable[[Any], T]
    ) -> T:
        if self._folder is None:
            return build()
        with suppress(FileNotFoundError):
            content = pickle.loads((self._folder / name).read_bytes())
            if isinstance(content, (SweepError, EngineError)):
                raise content
            with suppress(EngineError):  # what does not come back as it was is built again
                return unpack(content)
        begin = process_time()
        try:
            made = build()
        except (SweepError, EngineError) as error:
            if process_time() - begin > SLOW_S:
                self._write(name, error)
            raise
        if process_time() - begin > SLOW_S:
            self._write(name, pack(made))
        return made

    def _write(self, name: str, content: object) -> None:
        """All of the file or none; a disk that is full costs time only."""
        assert self._folder is not None
        temporary = self._folder / f"{name} {os.getpid()} part"
        with suppress(OSError):
            temporary.write_bytes(pickle.dumps(content))
            temporary.replace(self._folder / name)


def _packed(shapes: list[Any]) -> list[bytes]:
    return [to_bytes(shape) for shape in shapes]


def _unpacked(content: list[bytes]) -> list[Any]:
    return [from_bytes(data) for data in content]


NOTHING_KEPT = Store()
