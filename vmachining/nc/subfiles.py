"""Subprograms in files of their own.

    o<name> call and O100 call     the file name.ngc, 100.ngc, which holds that sub
    M98 P100                       the file 100.ngc, which holds the program O100

Folders are searched in order, capitals mean nothing. The lines of a file are hung behind those of the program,
so that everything that runs has one index; findings and motions of such lines belong to the line of the program
that called.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from vmachining.nc.control import Structure, find_structure
from vmachining.nc.lexer import split_lines
from vmachining.nc.tape import find_tape

__all__ = ["SubFile", "SubFiles"]

SUFFIXES: Final = (".ngc", ".nc")
_NAME: Final = re.compile(r"[a-z0-9_+\-][a-z0-9_+.\-]*")
"""Labels that name a file: no folders, nothing hidden."""


class SubFile(NamedTuple):
    """A file that was read. first, stop : its place in the lines of the reader, 0-based."""

    name: str
    first: int
    stop: int


class SubFiles:
    """Finds and reads them, each once.

    Parameters
    ----------
    folders : searched in this order.
    lines : of the program; those of the files are added behind an empty one each.
    decode : bytes and name to text, raises NCError.
    """

    def __init__(
        self, folders: Sequence[Path], lines: list[str], decode: Callable[[bytes, str], str] | None
    ) -> None:
        self.folders, self.lines, self.decode = folders, lines, decode
        self.own = len(lines)
        self.files: list[SubFile] = []
        self.paths: list[Path] = []
        self.tried: set[str] = set()

    def load(self, label: str, structure: Structure) -> bool:
        """Read the file of a label and add what steers in it; False where there is none, or it was read before.

        Raises
        ------
        NCError
            The file is binary, too large, or cannot be read.
        """
        name = label.strip("<>")
        if label in self.tried or self.decode is None or not _NAME.fullmatch(name):
            return False
        self.tried.add(label)
        path = self._find(name)
        if path is None:
            return False
        text = split_lines(self.decode(path.read_bytes(), str(path)))
        self.lines += ["", *text]
        start = len(self.lines) - len(text)
        first, stop, _ = find_tape(text)
        self.files.append(SubFile(path.name, start + first, start + stop))
        self.paths.append(path)
        found = find_structure(self.lines, start + first, start + stop)
        if found is not None:
            structure.add(found)
        return True

    def _find(self, name: str) -> Path | None:
        for folder in self.folders:
            try:
                entries = sorted(folder.iterdir())
            except OSError:
                continue
            for suffix in SUFFIXES:
                for entry in entries:
                    if entry.name.lower() == name + suffix and entry.is_file():
                        return entry
        return None

    def holding(self, index: int) -> SubFile | None:
        """The file of a line; None for lines of the program."""
        return next((file for file in self.files if file.first <= index < file.stop), None)

    def stop(self, index: int, stop: int) -> int:
        """The line behind the last of the file that holds this one; `stop` for the program."""
        if index < self.own:
            return stop
        file = self.holding(index)
        return index if file is None else file.stop
