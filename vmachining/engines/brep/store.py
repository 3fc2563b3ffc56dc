"""Solids of sweeps on disk, for the processes of one run.

A sweep that folds is covered by up to hundreds of solids, which take a minute. A process that is lost, because one
boolean hung in it, would build all it knew again, and two processes side by side would both build what they share.
"""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from time import process_time
from typing import Any

from vmachining.errors import EngineError, SweepError

__all__ = ["NOTHING_KEPT", "Store"]

SLOW_S = 0.5
"""s of a processor: what is built faster is not kept. Reading takes a millisecond per solid, writing 100 kB."""


class Store:
    """What took long to build, by number.

    Parameters
    ----------
    folder : Path or None
        Where; None keeps nothing. Whoever makes it removes it. Only files of one's own run belong there: they are pickles.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self._folder = folder

    def solids(self, number: int, build: Callable[[], list[Any]]) -> list[Any]:
        """TopoDS_Shapes that `build` gives, or gave to another process; the refusal that it raises, or raised there.

        Raises
        ------
        SweepError, EngineError
            Those of `build`.
        """
        known = self._read(number)
        if known is None:
            begin = process_time()
            try:
                known = build()
            except (SweepError, EngineError) as error:
                known = error
            if process_time() - begin > SLOW_S:
                self._write(number, known)
        if isinstance(known, (SweepError, EngineError)):
            raise known
        return known

    def _read(self, number: int) -> list[Any] | SweepError | EngineError | None:
        from OCP.BinTools import BinTools
        from OCP.TopoDS import TopoDS_Shape

        if self._folder is None:
            return None
        try:
            content = pickle.loads((self._folder / str(number)).read_bytes())
        except FileNotFoundError:
            return None
        if isinstance(content, (SweepError, EngineError)):
            return content
        shapes = []
        for data in content:
            shape = TopoDS_Shape()
            BinTools.Read_s(shape, BytesIO(data))
            shapes.append(shape)
        return shapes

    def _write(self, number: int, known: list[Any] | SweepError | EngineError) -> None:
        """All of the file or none; a disk that is full costs time only."""
        from OCP.BinTools import BinTools

        if self._folder is None:
            return
        content: Any = known
        if isinstance(known, list):
            content = []
            for shape in known:
                data = BytesIO()
                BinTools.Write_s(shape, data)
                content.append(data.getvalue())
        temporary = self._folder / f"{number}.{os.getpid()}"
        with suppress(OSError):
            temporary.write_bytes(pickle.dumps(content))
            temporary.replace(self._folder / str(number))


NOTHING_KEPT = Store()
