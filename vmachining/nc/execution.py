"""Runs the blocks of a program: which one comes next, calls and their ends, files that are called, findings.

What a block does is for the dialect (`execute`). A block that cannot be executed is left out with one finding; where
nobody knows which block comes next (`lost`), reading ends, because nothing after it is known.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

from vmachining.errors import NCError
from vmachining.nc.files import decode_program, find_file
from vmachining.nc.lexer import split_lines
from vmachining.nc.model import Declared, PenError, Reading
from vmachining.nc.pen import Pen
from vmachining.nc.settings import Settings

MAX_FINDINGS: Final = 1000
ONCE: Final = frozenset({"E368"})
"""Causes that lie in the job: one finding for all words."""

FREE: Final = "free contours (FK: FPOL, FL, FLT, FC, FCT) are not supported"
MILLS: Final = (
    "a cycle that mills by itself (pocket, slot, stud, face, contour): its way is the control's own"
)
DEEPEST: Final = 50
"""Calls in calls."""


class Block(NamedTuple):
    """line : 1-based, of its first line. text : capitals, without number, label and comments; raw : as it stands there.

    skip : it begins with the mark of optional blocks.
    """

    line: int
    n: int | None
    text: str
    raw: str
    label: str = ""
    skip: bool = False


class _Frame(NamedTuple):
    """Where a call comes back to. stop : block before which a repeated part ends. whole : of a program, not of a part."""

    blocks: Sequence[Block]
    at: int
    line: int | None
    stop: int | None
    whole: bool
    kept: Any


class Execution:
    """A program that is being executed.

    outer : line of the main program while a called file runs. ended : nothing more is read; broken : for a fault.
    """

    suffixes: tuple[str, ...] = ()
    """Of files that hold called programs."""

    def __init__(self, settings: Settings) -> None:
        self.settings = settings
        self.pen = Pen(settings)
        self.blocks: Sequence[Block] = ()
        self.at = self.steps = 0
        self.stack: list[_Frame] = []
        self.outer: int | None = None
        self.ended = self.broken = False
        self.names: dict[str, int] = {}
        """Numbers of tools that are called by name."""
        self.paths: list[Path] = []

    def run(self) -> None:
        """Everything, until the end."""
        pen = self.pen
        while not self.ended and not self.broken:
            part = bool(self.stack) and self.stack[-1].stop == self.at
            if part or self.at >= len(self.blocks):
                if not self.leave(whole=not part):
                    break
                continue
            block = self.blocks[self.at]
            self.at += 1
            self.steps += 1
            pen.line, pen.n, pen.text = self.outer or block.line, block.n, block.raw
            if self.steps > self.settings.max_steps + 2 * len(self.blocks):
                self._break("E413", f"over {self.settings.max_steps} blocks were repeated")
                return
            try:
                if not (block.skip and self.settings.block_delete):
                    self.execute(block)
            except PenError as exc:
                self._tell(exc)
            except RecursionError:
                pen.note("E102", "the block is nested too deep")
            if len(pen.findings) >= MAX_FINDINGS:
                self._break("E408", f"{len(pen.findings)} findings so far: the rest is not examined")
                return
        try:
            pen.end()
        except PenError as exc:
            self._tell(exc)

    def reading(self, declared: Declared) -> Reading:
        """What the program became, without the moves before the line where it is to restart."""
        pen = self.pen
        begin = self.settings.start_line
        first = next((k for k, move in enumerate(pen.moves) if move.line >= begin), len(pen.moves))
        names = {number: name for name, number in self.names.items()}
        declared = declared._replace(tools=tuple(sorted(pen.called)), names=names)
        return Reading(pen.moves[first:], pen.findings, self.ended, tuple(map(str, self.paths)), declared)

    def _break(self, code: str, message: str) -> None:
        self.pen.note(code, message)
        self.broken = True

    def _tell(self, exc: PenError) -> None:
        """One finding; the same cause again says nothing new, of some not even for another word."""
        pen = self.pen
        alone = exc.code in ONCE or str(exc) in (FREE, MILLS)
        pen.note(exc.code, str(exc), exc.word, once=str(exc) if alone else f"{exc} {exc.word}")
        if exc.hint and pen.findings and pen.findings[-1].message == str(exc):
            pen.findings[-1] = pen.findings[-1]._replace(hint=exc.hint)

    def execute(self, block: Block) -> None:
        """One block."""
        raise NotImplementedError

    def lost(self, exc: PenError) -> PenError:
        """The way on is not known: reading ends."""
        self.ended = True
        return exc

    def tool_of_name(self, label: str, word: str) -> int:
        """Number of a tool that is called by name."""
        if label.upper() not in self.names:
            self.names[label.upper()] = len(self.names) + 1
            self.pen.note("W367", f'tool "{label}" is taken as number {self.names[label.upper()]}', word)
        return self.names[label.upper()]

    # ---- calls ----

    def keep(self) -> Any:
        """What a dialect keeps for each program: put aside by a call."""
        return None

    def restore(self, kept: Any) -> None:
        """Back after a call."""

    def enter(
        self, blocks: Sequence[Block], at: int, *, stop: int | None = None, back: int | None = None,
        whole: bool = True,
    ) -> None:  # fmt: skip
        """Go to a block; `leave` comes back to the one that follows now, or to `back`."""
        if len(self.stack) >= DEEPEST:
            raise self.lost(PenError("E414", "calls are nested too deep"))
        here = self.at if back is None else back
        self.stack.append(_Frame(self.blocks, here, self.outer, stop, whole, self.keep()))
        self.blocks, self.at = blocks, at

    def leave(self, *, whole: bool = True) -> bool:
        """Back from a call (whole : of a program, with the parts open in it); False in the main program."""
        while self.stack:
            frame = self.stack.pop()
            self.blocks, self.at, self.outer = frame.blocks, frame.at, frame.line
            self.restore(frame.kept)
            if frame.whole or not whole:
                return True
        return False

    def absent(self, name: str, stem: str) -> bool:
        """Whether the file of a called program is missing: that is said, and the rest is read."""
        if self._find(stem) is not None:
            return False
        self.pen.note("W383", f"the program {name[:60]} that is called here is missing: its moves are not read", name[:40],
                      once=stem)  # fmt: skip
        return True

    def lines_of(self, name: str, stem: str) -> list[str]:
        """Lines of the file that holds a called program.

        Raises PenError: E412, and reading ends.
        """
        path = self._find(stem)
        if path is None:
            raise self.lost(PenError(
                "E412", f"the called program {name[:60]} is missing", name[:40],
                f"put {stem[:40]}{self.suffixes[0]} next to the program, or name its folder under subroutines; an empty file "
                "is enough if it does not move the tool",
            ))  # fmt: skip
        self.pen.flush()
        try:
            text = decode_program(path.read_bytes(), str(path))
        except (OSError, NCError) as exc:
            raise self.lost(PenError("E412", f"{path.name}: {exc}", name[:40])) from None
        if path not in self.paths:
            self.paths.append(path)
        return split_lines(text)

    def _find(self, stem: str) -> Path | None:
        if not re.fullmatch(r"[\w.+ -]+", stem):
            return None
        wanted = [stem.lower() + suffix for suffix in self.suffixes]
        return find_file(self.settings.subroutines, lambda entry: entry.name.lower() in wanted)
