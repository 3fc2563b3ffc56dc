"""Solids of sweeps on disk, for the processes of one run.

A sweep that folds is covered by up to hundreds of solids, which take a minute. A process that is lost, because one
boolean hung in it, would build all it knew again, and two processes side by side would both build what they share.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from vmachining.checkpoint import Saved, opened
from vmachining.engines.brep.occt.parts import from_bytes, to_bytes
from vmachining.errors import EngineError, SweepError

KIND = "solids"

SLOW_S = 0.5
"""s of a processor: what is built faster is not kept. Reading takes a millisecond per solid, writing 100 kB."""


class Store:
    """What took long to build, by name.

    folder : Path or None
        Where; None keeps nothing. Whoever makes it removes it.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder

    def solids(self, number: int, build: Callable[[], list[Any]]) -> list[Any]:
        """TopoDS_Shapes of a sweep that `build` gives, or gave to another process.

        Raises SweepError, EngineError: Those of `build`, here or there.
        """
        if self._folder is None:
            return build()
        path = self._folder / f"{number}"
        kept = _kept(path) if path.exists() else None
        if isinstance(kept, Exception):
            raise kept
        if kept is not None:
            return kept
        begin = process_time()
        try:
            made = build()
        except (SweepError, EngineError) as error:
            if process_time() - begin > SLOW_S:
                self._write(path, _refused(error))
            raise
        if process_time() - begin > SLOW_S:
            shapes = {f"{k}": np.frombuffer(to_bytes(shape), dtype=np.uint8) for k, shape in enumerate(made)}
            self._write(path, Saved(KIND, {}, shapes))
        return made

    def _write(self, path: Path, saved: Saved) -> None:
        """All of the file or none; a disk that is full costs time only."""
        temporary = path.with_name(f"{path.name} {os.getpid()} part")
        with suppress(OSError):
            saved.write(temporary)
            temporary.replace(path)


def _refused(error: SweepError | EngineError) -> Saved:
    """What `_kept` makes a refusal of."""
    if isinstance(error, EngineError):
        return Saved(KIND, {"reason": error.reason, "engine": error.engine, "block": error.block})
    return Saved(KIND, {"reason": error.message, "remedy": error.remedy})


def _kept(path: Path) -> list[Any] | SweepError | EngineError | None:
    """The shapes or the refusal of a file; None where it does not come back as it was, and is built again."""
    with suppress(EngineError), opened(path, KIND) as saved:
        match saved.state:
            case {"reason": reason, "engine": engine, "block": block}:
                return EngineError(reason, engine=engine, block=block)
            case {"reason": reason, "remedy": remedy}:
                return SweepError(reason, remedy=remedy)
        return [from_bytes(content.tobytes()) for content in saved.arrays.values()]
    return None


NOTHING_KEPT = Store()
