"""Checkpoints: what a process needs to continue, as arrays and JSON in one `.npz` file.

Every engine and the contact pass use this format. Reading a file makes numbers, texts and arrays of numbers, so it runs
no code whoever wrote the file: a pickle is refused, and so are arrays of objects, which would hold one.

Layout: a zip archive with `state.json` ({"format", "kind", "state"}) and one `NAME.npy` for each array.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile

import numpy as np

from vmachining.errors import EngineError, VMachiningError

FORMAT = 1
STATE = "state.json"
ARRAY = ".npy"
ZIP = b"PK"
PICKLE = b"\x80"
"""First byte of a pickle of protocol 2 or later."""

DAMAGE = (
    OSError, EOFError, ValueError, LookupError, TypeError, AttributeError, ArithmeticError, NotImplementedError,
    RuntimeError, MemoryError, BadZipFile, zlib.error, VMachiningError,
)  # fmt: skip
"""What bytes that are not a checkpoint, or numbers that fit no workpiece, can raise."""


@dataclass(frozen=True, slots=True, eq=False)
class Saved:
    """A state that can be written and read.

    kind : who can read it, an engine or a pass. state : plain JSON. arrays : of numbers, by name.
    deflated : whether writing packs the arrays, which takes longer and pays where they repeat themselves.
    """

    kind: str
    state: dict[str, Any]
    arrays: dict[str, Any] = field(default_factory=dict)
    deflated: bool = False

    def write(self, path: Path) -> None:
        """Write the file.

        Raises OSError: It cannot be written.
        Raises ValueError: An array holds objects: a fault of the caller.
        """
        text = json.dumps({"format": FORMAT, "kind": self.kind, "state": self.state})
        method, level = (ZIP_DEFLATED, 1) if self.deflated else (ZIP_STORED, None)
        with ZipFile(path, "w", method, compresslevel=level) as package:
            package.writestr(STATE, text)
            for name, values in self.arrays.items():
                with package.open(name + ARRAY, "w", force_zip64=True) as file:
                    np.lib.format.write_array(file, np.asarray(values), allow_pickle=False)

    def nested(self, name: str) -> dict[str, Any]:
        """Arrays under names that `part` finds again in the file of another state."""
        return {f"{name}/{key}": values for key, values in self.arrays.items()}

    def part(self, name: str, kind: str) -> Saved:
        """The state in `state[name]` with the arrays that `nested` named."""
        own = {
            key.removeprefix(f"{name}/"): v for key, v in self.arrays.items() if key.startswith(f"{name}/")
        }
        return Saved(kind, self.state[name], own)


@contextmanager
def opened(path: Path, kind: str) -> Iterator[Saved]:
    """What `Saved.write` wrote, for a block that builds something from it.

    Raises EngineError: The file cannot be read, is damaged, is of another kind, or the block cannot use what it holds.
    """
    try:
        yield _read(path, kind)
    except EngineError:
        raise
    except DAMAGE as exc:
        raise EngineError(f"checkpoint {path.name} cannot be read: {_words(exc)}", engine=kind) from exc


def _words(exc: BaseException) -> str:
    if isinstance(exc, KeyError):
        return f"{exc} is missing"
    return str(exc) or type(exc).__name__


def _read(path: Path, kind: str) -> Saved:
    with path.open("rb") as file:
        mark = file.read(2)
    if mark[:1] == PICKLE:
        raise ValueError("it is a pickle, which could run code: this version reads arrays and JSON only")
    if mark != ZIP:
        raise ValueError("it is not a checkpoint")
    with ZipFile(path) as package:
        if STATE not in package.namelist():
            raise ValueError(f"it has no {STATE}: not a checkpoint, or one of an earlier version")
        head: Mapping[str, Any] = json.loads(package.read(STATE))
        if head["format"] != FORMAT:
            raise ValueError(f"it has format {head['format']!r}, this version reads {FORMAT}")
        if head["kind"] != kind:
            raise ValueError(f"it belongs to {head['kind']!r}")
        arrays: dict[str, Any] = {}
        for name in package.namelist():
            if name.endswith(ARRAY):
                with package.open(name) as file:
                    arrays[name.removesuffix(ARRAY)] = np.lib.format.read_array(file, allow_pickle=False)
    return Saved(kind, dict(head["state"]), arrays)
