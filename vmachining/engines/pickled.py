"""Checkpoints of engines that are values and arrays: pickles that can hold nothing else, so that none can run."""

from __future__ import annotations

import io
import pickle
from pathlib import Path
from typing import Any

from vmachining.errors import EngineError

__all__ = ["load_values", "save_values"]

GEOMETRY = (
    "vmachining.stock",
    "vmachining.sweep",
    "vmachining.geometry",
    "vmachining.tool",
    "vmachining.numerics",
)
NUMPY = ("_reconstruct", "ndarray", "dtype", "scalar", "_frombuffer")
"""What a checkpoint may hold: our own values, and arrays."""


def save_values(path: Path, state: object) -> None:
    """Write what `load_values` reads."""
    path.write_bytes(pickle.dumps(state))


def load_values(path: Path, engine: str, own: tuple[str, ...] = ()) -> Any:
    """What `save_values` wrote.

    own : further modules, and single names as "module.name", that it may hold.

    Raises
    ------
    EngineError
        Anything else in it. Damaged files raise whatever pickle meets.
    """
    return _Values(io.BytesIO(path.read_bytes()), engine, own).load()


class _Values(pickle.Unpickler):
    def __init__(self, file: io.BytesIO, engine: str, own: tuple[str, ...]) -> None:
        super().__init__(file)
        self._engine, self._own = engine, own

    def find_class(self, module: str, name: str) -> Any:
        ours = module.startswith(GEOMETRY) or f"{module}.{name}".startswith(self._own or (" ",))
        if not ours and not (module.split(".")[0] == "numpy" and name in NUMPY):
            raise EngineError(f"the checkpoint holds {module}.{name}", engine=self._engine)
        return super().find_class(module, name)
