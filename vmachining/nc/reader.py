"""Reads a whole program: bytes, lines, tape marks, block numbers.

Blocks that are plain straight moves take a short cut.
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Final

from vmachining.errors import NCError
from vmachining.nc.block import Problem, block_number, build_block
from vmachining.nc.catalogue import CATALOGUE
from vmachining.nc.expressions import NoValueError, evaluate
from vmachining.nc.interpreter import BlockError, execute
from vmachining.nc.lexer import MAX_LINE, MAX_VALUE, LexedLine, Word, lex_line, split_lines
from vmachining.nc.model import Finding, Motion, Move, Point, Program
from vmachining.nc.state import ORIGIN, Memory, State, add, work_offset_codes
from vmachining.nc.tooltable import ToolEntry

__all__ = ["decode_program", "parse_program", "read_program"]

MAX_ERRORS: Final = 1000
"""Records of severity E after which a file is given up."""

MAX_WARNINGS: Final = 200
"""Records of one warning code that are listed."""

_PLAIN_TEXT: Final = "save it as plain ASCII or UTF-8"

_N = r"([+-]?(?:[0-9]{1,9}(?:\.[0-9]*)?|\.[0-9]+))[ \t]*"
_PLAIN: Final = re.compile(
    r"(?:[Nn]([0-9]{1,5})[ \t]*)?(?:[Gg]0?([01])[ \t]*)?"
    rf"(?:[Xx][ \t]*{_N})?(?:[Yy][ \t]*{_N})?(?:[Zz][ \t]*{_N})?(?:[Ff][ \t]*{_N})?"
)
"""The block that fills most programs: at most N, G0 or G1, X, Y, Z, F, in this order."""


def read_program(
    path: Path | str,
    *,
    dialect: str = "iso",
    tools: Mapping[int, ToolEntry] | None = None,
    home: Point = (0.0, 0.0, 100.0),
    block_delete: bool = False,
    work_offsets: Mapping[str, Point] | None = None,
) -> Program:
    """Read a program from a file; parameters as `parse_program`.

    Raises
    ------
    NCError
        The file cannot be read, is binary or UTF-16, or the dialect is unknown.
    """
    try:
        data = Path(path).read_bytes()
    except (OSError, ValueError) as exc:
        reason = getattr(exc, "strerror", None) or str(exc)
        raise NCError(f"cannot read the program: {reason}", file=str(path)) from exc
    return parse_program(
        data,
        str(path),
        dialect=dialect,
        tools=tools,
        home=home,
        block_delete=block_delete,
        work_offsets=work_offsets,
    )


def parse_program(
    data: bytes,
    name: str,
    *,
    dialect: str = "iso",
    tools: Mapping[int, ToolEntry] | None = None,
    home: Point = (0.0, 0.0, 100.0),
    block_delete: bool = False,
    work_offsets: Mapping[str, Point] | None = None,
) -> Program:
    """Read a program.

    Parameters
    ----------
    data : the bytes of the file; UTF-8 or a one-byte encoding.
    name : used in messages.
    dialect : "iso".
    tools : tool table; None: unknown, tool numbers are not checked and lengths are zero.
    home : mm, simulation frame: where the tool tip starts, and where G28 and G30 go.
    block_delete : skip lines that open with a slash.
    work_offsets : mm, "G54" to "G59.3"; those not named are zero.

    Returns
    -------
    Program
        Always, however wrong its blocks are: see `findings`.

    Raises
    ------
    NCError
        Binary or UTF-16 data, unknown dialect or work offset.
    """
    if dialect != "iso":
        raise NCError(f"dialect '{dialect}' is not supported", file=name, remedy="iso")
    codes = work_offset_codes()
    for key in work_offsets or {}:
        if key not in codes:
            raise NCError(f"no work offset is called '{key}'", file=name, remedy="G54 to G59, G59.1 to G59.3")
    offsets = {codes[key]: value for key, value in (work_offsets or {}).items()}
    lines = split_lines(decode_program(data, name))
    reader = _Reader(lines, tools, (float(home[0]), float(home[1]), float(home[2])), block_delete, offsets)
    reader.run()
    findings = tuple(sorted(reader.findings, key=lambda f: (f.line, f.col, f.code)))
    return Program(name, data, dialect, tuple(reader.moves), findings, reader.ended)


def decode_program(data: bytes, name: str) -> str:
    """Text of a program: UTF-8 (with or without mark), else one character per byte.

    Raises
    ------
    NCError
        UTF-16, UTF-32 or binary.
    """
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise NCError("the program is UTF-16 text", file=name, line=1, remedy=_PLAIN_TEXT)
    if (zero := data.find(b"\0")) >= 0:
        head = data[:200]
        if head[::2].count(0) * 3 > len(head) or head[1::2].count(0) * 3 > len(head):
            raise NCError("the program is UTF-16 text", file=name, line=1, remedy=_PLAIN_TEXT)
        line = data.count(b"\n", 0, zero) + 1
        raise NCError("the file is binary, not a program", file=name, line=line, remedy=_PLAIN_TEXT)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


class _GiveUpError(Exception):
    """Too many wrong blocks."""


class _Reader:
    """Goes through the lines once."""

    def __init__(
        self,
        lines: list[str],
        tools: Mapping[int, ToolEntry] | None,
        home: Point,
        block_delete: bool,
        offsets: Mapping[int, Point],
    ) -> None:
        self.lines, self.tools, self.home, self.block_delete = lines, tools, home, block_delete
        start = offsets.get(540, ORIGIN)
        self.state = State(sim=home, machine=add(home, start), offsets=offsets, start_offset=start)
        self.state.place_offsets()
        self.memory = Memory(self.state)
        self.moves: list[Move] = []
        self.findings: list[Finding] = []
        self.ended = False
        self.errors = 0
        self.warnings: dict[str, int] = {}
        self.numbers: set[int] = set()
        self.highest = -1
        self.last = -1

    # ---- findings ----

    def report(self, problem: Problem, line: int, n: int | None) -> None:
        """Record a problem; warnings of one kind only up to a limit."""
        word = problem.word
        if word is None:
            self._record(problem.code, line, 1, 0, n, "", problem.message, problem.hint)
        else:
            place = word.col, word.length
            self._record(problem.code, line, *place, n, word.text, problem.message, problem.hint)

    def _record(
        self,
        code: str,
        line: int,
        col: int,
        length: int,
        n: int | None,
        word: str,
        message: str,
        hint: str = "",
    ) -> None:
        if code[0] == "W":
            count = self.warnings[code] = self.warnings.get(code, 0) + 1
            if count > MAX_WARNINGS:
                return
        elif code[0] == "E":
            self.errors += 1
        entry = CATALOGUE[code]
        self.findings.append(Finding(line, col, length, n, word, code, code[0], message, hint or entry.hint))

    # ---- the program ----

    def run(self) -> None:
        """Everything from the first line to the last."""
        first, stop, closed = self._tape()
        at = first
        try:
            at = self._blocks(first, stop)
        except _GiveUpError as exc:
            at = int(exc.args[0])
            what = f"{self.errors} errors so far: the {stop - at} lines from here on are not examined"
            self._record("E408", at + 1, 1, 0, None, "", what)
        else:
            self.ended = self.state.ended or closed
            self._epilogue(at if self.state.ended else stop)
        if not any(move.motion is not Motion.DWELL for move in self.moves) and not self.errors:
            self._record("W406", 1, 1, 0, None, "", "the program contains no motion")
        for code, count in self.warnings.items():
            if count > MAX_WARNINGS:
                what = f"{code} was found {count} times, {count - MAX_WARNINGS} of them are not listed"
                self._record("I407", len(self.lines), 1, 0, None, "", what)

    def _tape(self) -> tuple[int, int, bool]:
        """First line, line behind the last, and whether a closing mark ends the program (0-based lines)."""
        lines = self.lines
        marks = [index for index, line in enumerate(lines) if "%" in line and line.strip(" \t") == "%"]
        if not marks:
            return 0, len(lines), False
        if len(marks) > 1:
            return marks[0] + 1, marks[1], True
        before = any(line.strip() for line in lines[: marks[0]])
        if before and not any(line.strip() for line in lines[marks[0] + 1 :]):
            self._record(
                "I405", marks[0] + 1, 1, 1, None, "%", "the only tape mark stands behind the program"
            )
            return 0, marks[0], True
        return marks[0] + 1, len(lines), False

    def _epilogue(self, at: int) -> None:
        """E401, or W404 for what stands behind the end."""
        lines = self.lines
        if not self.ended:
            self._record(
                "E401", max(1, len(lines)), 1, 0, None, "", "the program has no M2, M30 or closing %"
            )
            return
        for index in range(at, len(lines)):
            content = lines[index].strip(" \t")
            if content and content != "%":
                text = content[:40]
                col = lines[index].index(content) + 1
                self._record(
                    "W404", index + 1, col, len(text), None, text, "text behind the end of the program"
                )
                return

    def _blocks(self, first: int, stop: int) -> int:
        """Run lines first..stop-1; returns the 0-based line behind the last one run."""
        lines, match = self.lines, _PLAIN.fullmatch
        rapid, linear, append = Motion.RAPID, Motion.LINEAR, self.moves.append
        state = self.state
        for index in range(first, stop):
            line = lines[index]
            if not line:
                continue
            plain = match(line)
            if plain is not None and state.synced and len(line) <= MAX_LINE:
                number, code, x, y, z, f = plain.groups()
                motion = state.motion if code is None else 10 if code == "1" else 0
                if (
                    (x is not None or y is not None or z is not None)
                    and (motion == 0 or (motion == 10 and (state.direction != 0 or state.warned_stopped)))
                    and state.feed_mode == 940
                    and (number is None or int(number) > self.highest)
                ):
                    feed = state.feed
                    if f is not None:
                        feed = float(f) * state.scale
                    if (feed and feed > 0.0) or (motion == 0 and f is None):
                        n = None
                        if number is not None:
                            n = self.highest = self.last = int(number)
                            self.numbers.add(n)
                        state.motion, state.feed = motion, feed
                        start, scale = state.sim, state.scale
                        ox, oy, oz = state.to_sim if state.absolute else start
                        end = (
                            start[0] if x is None else float(x) * scale + ox,
                            start[1] if y is None else float(y) * scale + oy,
                            start[2] if z is None else float(z) * scale + oz,
                        )
                        lag, back = state.lag, state.to_sim
                        machine = end if lag == ORIGIN else add(end, lag)
                        program = (
                            end if back == ORIGIN else (end[0] - back[0], end[1] - back[1], end[2] - back[2])
                        )
                        append(
                            Move(
                                index + 1,
                                n,
                                linear if motion else rapid,
                                start,
                                end,
                                state.plane.name,
                                None,
                                0,
                                feed if motion else None,
                                state.tool,
                                state.speed * state.direction,
                                0.0,
                                machine,
                                program,
                            )
                        )
                        state.sim, state.machine = end, machine
                        continue
            self._block(index + 1, line)
            state = self.state
            if state.ended:
                return index + 1
            if self.errors >= MAX_ERRORS and index + 1 < stop:
                raise _GiveUpError(index + 1)
        return stop

    def _block(self, number: int, text: str) -> None:
        """Any line, by lexer, block checks and interpreter."""
        lexed = lex_line(text)
        if lexed.percent or (lexed.block_delete and self.block_delete):
            return
        n = block_number(lexed)
        if n is not None:
            self._check_number(number, n, lexed.words[0])
        problems: list[Problem] = []
        if lexed.errors:
            for error in lexed.errors:
                self._record(error.code, number, error.col, error.length, n, error.text[:60], error.message)
            return
        try_state = self.state.clone()
        values, writes = self._evaluate(lexed, problems)
        moves, warnings = list[Move](), list[Problem]()
        if not problems:
            block = build_block(lexed, values, self.state.motion)
            problems = block.problems
            if not problems:
                try:
                    moves, warnings = execute(block, try_state, number, n, self.tools, self.home)
                except BlockError as exc:
                    problems = [exc.problem]
        if problems:
            for problem in problems:
                self.report(problem, number, n)
            return
        for warning in warnings:
            self.report(warning, number, n)
        for key, value in writes:
            self.memory.store(key, value)
        self.moves.extend(moves)
        self.state = self.memory.state = try_state

    def _evaluate(
        self, lexed: LexedLine, problems: list[Problem]
    ) -> tuple[list[float], list[tuple[str | int, float]]]:
        """Numbers of the words, and the assignments to make when the block is done."""
        values, writes = list[float](), list[tuple[str | int, float]]()
        for word in lexed.words:
            value = word.value
            try:
                if word.expression is not None:
                    value = evaluate(word.expression, self.memory)
                    if abs(value) >= MAX_VALUE:
                        raise NoValueError(f"{value:g} is out of range")
            except NoValueError as exc:
                problems.append(Problem("E108", word, str(exc)))
            values.append(0.0 if value is None else value)
        for item in lexed.assignments:
            try:
                writes.append(self.memory.resolve(item.target, item.value))
            except NoValueError as exc:
                place = Word("#", None, item.col, item.length, item.text)
                problems.append(Problem("E108", place, str(exc)))
        return values, writes

    def _check_number(self, line: int, n: int, word: Word) -> None:
        if n in self.numbers:
            self.report(Problem("W402", word, f"N{n} was used before"), line, n)
        elif n < self.last:
            self.report(Problem("W403", word, f"N{n} follows N{self.last}"), line, n)
        self.numbers.add(n)
        self.last = n
        self.highest = max(self.highest, n)
