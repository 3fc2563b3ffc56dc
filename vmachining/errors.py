"""Everything the package refuses, and how it says so.

VMachiningError                 base: message, and where known file, line, column, word, remedy
├── InputError                  what the user gave cannot be used: exit code 2; also a ValueError
│   ├── FullError               a disk, a quota or a limit of the size of files
│   ├── NCError                 the program
│   ├── JobError                the job file
│   ├── ToolError               a tool
│   ├── StockError              a stock solid
│   └── KinematicsError         machine, axis values
├── SweepError                  a motion and tool that sweep nothing meaningful; also a ValueError
├── EngineError                 a kernel failed or lied; names engine and block
└── FeedError                   a schedule that cannot exist

`AccuracyWarning` comes with an answer that missed its promised bound.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path


class VMachiningError(Exception):
    """A refusal. `str()` is one clear message: `file:line:col: what; remedy`."""

    def __init__(
        self,
        message: str,
        *,
        file: str | Path | None = None,
        line: int | None = None,
        col: int | None = None,
        word: str | None = None,
        remedy: str | None = None,
    ) -> None:
        super().__init__(message)
        self.message = message
        self.file = None if file is None else str(file)
        self.line = line
        self.col = col
        self.word = word
        self.remedy = remedy

    def __str__(self) -> str:
        place = ":".join(str(part) for part in (self.file, self.line, self.col) if part is not None)
        word = f" [{self.word}]" if self.word else ""
        remedy = f"; {self.remedy}" if self.remedy else ""
        return f"{place + ': ' if place else ''}{self.message}{word}{remedy}"


class InputError(VMachiningError, ValueError):
    """What the user gave cannot be used."""


class FullError(InputError):
    """A disk, a quota or a limit of the size of files leaves no room for a file."""


class NCError(InputError):
    """The program cannot be read, or a block of it cannot be executed."""


class JobError(InputError):
    """The job file is missing, unreadable or contradicts itself."""


class ToolError(InputError):
    """A cutter that cannot exist."""


class StockError(InputError):
    """A stock that is not a closed solid."""


class KinematicsError(InputError):
    """Axis values or a chain that no machine can have."""


class SweepError(VMachiningError, ValueError):
    """A motion that sweeps nothing meaningful."""


class FeedError(VMachiningError):
    """A schedule that cannot exist."""


class EngineError(VMachiningError):
    """A kernel failed, or its answer failed a check.

    engine : str, name of the engine, e.g. "mesh".
    block : int or None
        Block it worked on.
    """

    def __init__(self, message: str, *, engine: str, block: int | None = None) -> None:
        where = f"{engine} engine" + (f", block {block}" if block is not None else "")
        super().__init__(f"{where}: {message}")
        self.reason = message
        self.engine = engine
        self.block = block

    def __reduce__(self) -> tuple[partial[EngineError], tuple[str]]:
        """Errors of worker processes come back whole."""
        return partial(EngineError, engine=self.engine, block=self.block), (self.reason,)


class AccuracyWarning(UserWarning):
    """An answer is outside its promised bound; the text names the bound reached."""
