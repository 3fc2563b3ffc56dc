"""Subprograms in separate files.

    o<name> call and O100 call     the file name.ngc, 100.ngc, which holds that sub
    M98 P100                       the file 100.ngc, which holds the program O100
    the same, G65, G66, M198 of the Fanuc family     O0100.nc, 100.txt, O100: a number, whatever stands about it

Folders are searched in order, capitals mean nothing. The lines of a file are hung behind those of the program,
so that everything that runs has one index; findings and motions of such lines belong to the line of the program
that called.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from vmachining.nc.files import MAX_BYTES, decode_program, find_file, find_tape
from vmachining.nc.flow import Structure, find_structure
from vmachining.nc.lexer import split_lines

SUFFIXES: Final = (".ngc", ".nc")
SUFFIXES_OF_FAMILY: Final = "nc|ngc|txt|tap|cnc|eia|min|ssb|sub|prg|ptp|mac"
_NAME: Final = re.compile(r"[a-z0-9_+\-][a-z0-9_+.\-]*")
"""Labels that name a file: no folders, nothing hidden."""


class SubFile(NamedTuple):
    """A file that was read. first, stop : its place in the lines of the reader, 0-based."""

    name: str
    first: int
    stop: int


class SubFiles:
    """Finds and reads them, each once.

    folders : searched in this order.
    lines : of the program; those of the files are added behind an empty one each.
    plain : makes lines plain for the lexer.
    """

    def __init__(
        self, folders: Sequence[Path], lines: list[str], plain: Callable[[list[str]], list[str]] = list
    ) -> None:
        self.folders, self.lines, self.plain = folders, lines, plain
        self.own = len(lines)
        self.files: list[SubFile] = []
        self.paths: list[Path] = []
        self.tried: set[str] = set()

    def load(self, label: str, structure: Structure) -> bool:
        """Read the file of a label and add what steers in it; False where none exists, or it was read before.

        Raises NCError: The file is binary, too large, or cannot be read.
        """
        name = label.strip("<>")
        if label in self.tried or not _NAME.fullmatch(name):
            return False
        self.tried.add(label)
        path = self._find((name + SUFFIXES[0]).__eq__) or self._find((name + SUFFIXES[1]).__eq__)
        if path is None:
            return False
        file = self._hang(path)
        found = find_structure(self.lines, file.first, file.stop)
        if found is not None:
            structure.add(found)
        return True

    def load_program(self, number: int) -> SubFile | None:
        """The file of a program of the Fanuc family; None where none exists.

        Raises NCError: As `load`.
        """

        named = re.compile(rf"[o:]?0*{number}(?:\.(?:{SUFFIXES_OF_FAMILY}))?")
        path = self._find(named.fullmatch)
        return self._hang(path) if path is not None else None

    def _hang(self, path: Path) -> SubFile:
        """The lines of a file behind those that are known."""
        with path.open("rb") as file:
            text = self.plain(split_lines(decode_program(file.read(MAX_BYTES + 1), str(path))))
        self.lines += ["", *text]
        start = len(self.lines) - len(text)
        first, stop, _ = find_tape(text)
        self.files.append(SubFile(path.name, start + first, start + stop))
        self.paths.append(path)
        return self.files[-1]

    def _find(self, fits: Callable[[str], object]) -> Path | None:
        """The first file whose name, in small letters, fits."""
        return find_file(self.folders, lambda entry: fits(entry.name.lower()))

    def holding(self, index: int) -> SubFile | None:
        """The file of a line; None for lines of the program."""
        return next((file for file in self.files if file.first <= index < file.stop), None)

    def stop(self, index: int, stop: int) -> int:
        """The line after the last of the file that holds this one; `stop` for the program."""
        if index < self.own:
            return stop
        file = self.holding(index)
        return index if file is None else file.stop
