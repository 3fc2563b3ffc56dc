"""Goes through the lines of a word address program: tape marks, block numbers, one block after the other.

Blocks that are plain straight moves take a short cut. Lines that steer are left to `flow.py`.
"""

from __future__ import annotations

import gc
import re
from bisect import bisect_left
from collections.abc import Callable
from typing import Final

from vmachining.errors import NCError
from vmachining.nc.block import Problem, block_number, build_block
from vmachining.nc.catalogue import CATALOGUE
from vmachining.nc.control import find_structure
from vmachining.nc.flow import Flow, FlowStop
from vmachining.nc.interpreter import BlockError, execute
from vmachining.nc.lexer import MAX_LINE, LexedLine, Word, lex_line
from vmachining.nc.model import Finding, Motion, Move
from vmachining.nc.settings import Settings
from vmachining.nc.state import ORIGIN, Memory, State
from vmachining.nc.subfiles import SubFiles
from vmachining.nc.tape import find_tape
from vmachining.nc.values import line_values
from vmachining.nc.vectors import add

__all__ = ["Reader"]

MAX_ERRORS: Final = 1000
"""Records of severity E after which a file is given up."""

MAX_MOVES: Final = 2_000_000
"""Motions of a program that multiplies its lines by cycles and loops; more where more steps are allowed."""

MAX_WARNINGS: Final = 200
"""Records of one warning code that are listed."""

_N = r"([+-]?(?:[0-9]{1,9}(?:\.[0-9]*)?|\.[0-9]+))[ \t]*"
_PLAIN: Final = re.compile(
    r"(?:[Nn]([0-9]{1,9})[ \t]*)?(?:[Gg]0?([01])[ \t]*)?"
    rf"(?:[Xx][ \t]*{_N})?(?:[Yy][ \t]*{_N})?(?:[Zz][ \t]*{_N})?(?:[Ff][ \t]*{_N})?"
)
"""The block that fills most programs: at most N, G0 or G1, X, Y, Z, F, in this order."""

_ABORT: Final = re.compile(r"\([ \t]*abort[ \t]*,", re.IGNORECASE)
_NUMBERED: Final = re.compile(r"[ \t]*/?[ \t]*[Nn][ \t]*([0-9]{1,9})(?![0-9.])")

THREE_AXES: Final = tuple(Move._field_defaults.values())
"""The fields of a move that three axes do not use."""


class _GiveUpError(Exception):
    """The rest of the program is not examined: code, 0-based line behind the last one, why."""


class Reader:
    """Goes through the lines once, or as often as loops and calls say."""

    def __init__(
        self, lines: list[str], settings: Settings, decode: Callable[[bytes, str], str] | None = None
    ) -> None:
        self.lines, self.settings = lines, settings
        self.files = SubFiles(settings.subroutines, lines, decode)
        self.own = len(lines)
        home = settings.home
        start = settings.work_offsets.get(540, ORIGIN)
        self.state = State(
            sim=home,
            machine=add(home, start),
            offsets=settings.work_offsets,
            start_offset=start,
            references=(home, home),
            table=settings.tools or {},
        )
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
        self.flow: Flow | None = None
        self.next: int | None = None
        self.lexed: dict[int, LexedLine] = {}
        self.reported: set[tuple[int, int, str]] = set()

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
        if self.flow is not None:  # a line that runs often says it once
            if (line, col, code) in self.reported:
                return
            self.reported.add((line, col, code))
            if line > self.own and (file := self.files.holding(line - 1)) is not None:
                message = f"in {file.name}, line {line - file.first}: {word} {message}".replace(":  ", ": ")
                line, col, length, word, n = self.flow.origin(self.own, line - 1) + 1, 1, 0, "", None
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
        collecting = gc.isenabled()
        gc.disable()  # a million tuples without cycles, which the collector would walk through again and again
        try:
            self._run()
        finally:
            if collecting:
                gc.enable()

    def _run(self) -> None:
        first, stop, closed = find_tape(self.lines)
        if closed and stop < len(self.lines) and first == 0:
            what = "the only tape mark stands behind the program"
            self._record("I405", stop + 1, 1, 1, None, "%", what)
        at = first
        try:
            at = self._drive(first, stop)
        except _GiveUpError as exc:
            code, at, what = exc.args
            self._record(code, min(at + 1, self.own), 1, 0, None, "", what)
        else:
            self.ended = self.state.ended or closed
            self._epilogue(at if self.state.ended else stop)
        if self.state.compensation is not None:
            self.moves.extend(self.state.compensation.finish()[0])
        if not any(move.motion is not Motion.DWELL for move in self.moves) and not self.errors:
            self._record("W406", 1, 1, 0, None, "", "the program contains no motion")
        for code, count in self.warnings.items():
            if count > MAX_WARNINGS:
                what = f"{code} was found {count} times, {count - MAX_WARNINGS} of them are not listed"
                self._record("I407", self.own, 1, 0, None, "", what)

    def _epilogue(self, at: int) -> None:
        """E401, or W404 for what stands behind the end."""
        lines = self.lines
        if not self.ended:
            self._record("E401", max(1, self.own), 1, 0, None, "", "the program has no M2, M30 or closing %")
            return
        for index in range(at, self.own):
            content = lines[index].strip(" \t")
            if content and content != "%":
                text = content[:40]
                col = lines[index].index(content) + 1
                self._record(
                    "W404", index + 1, col, len(text), None, text, "text behind the end of the program"
                )
                return

    def _drive(self, first: int, stop: int) -> int:
        """Run lines first..stop-1 in the order that they say; returns the 0-based line behind the last one."""
        structure = find_structure(self.lines, first, stop)
        restart = self.settings.start_line - 1
        if structure is None:
            if not first < restart < stop:
                return self._blocks(first, stop)
            at = self._blocks(first, restart)
            if self.state.ended:
                self._never_reached(restart)
                return at
            self._restart(restart)
            return self._blocks(restart, stop)
        flow = self.flow = Flow(structure, self.memory, self._flow_problem, self._load)
        for index, problem in structure.problems:
            self._flow_problem(problem, index)
        self._check_numbers(first, stop)
        return self._steered(flow, first, stop, restart if first < restart < stop else -1)

    def _steered(self, flow: Flow, first: int, stop: int, restart: int) -> int:
        """The same for a program with lines that steer."""
        items, at, steps = flow.structure.items, first, 0
        limit = self.settings.max_steps + stop - first
        while at < (last := self.files.stop(at, stop)):
            if at == restart:
                self._restart(restart)
                restart = -1
            item = items.get(at)
            if item is not None:
                if item.lexed.block_delete and self.settings.block_delete:
                    at += 1
                else:
                    try:
                        at = flow.step(item)
                    except FlowStop as exc:
                        raise self._give_up(exc) from None
                steps += 1
            else:
                place = bisect_left(flow.stops, at)
                end = min(flow.stops[place], last) if place < len(flow.stops) else last
                if at < restart < end:
                    end = restart
                self.next = None
                try:
                    begin, at = at, self._blocks(at, end)
                except FlowStop as exc:
                    raise self._give_up(exc) from None
                steps += at - begin
                if self.state.ended:
                    if restart >= 0:
                        self._never_reached(restart)
                    return at
                if self.next is not None:
                    at = self.next
            if steps > limit:
                what = f"loops and calls repeated over {self.settings.max_steps} lines: is there an end?"
                raise _GiveUpError("E413", at, what)
        if flow.frames:
            start = flow.frames[-1].start
            self._record("E415", start + 1, 1, 0, None, "", "the subprogram called is never left (M99)")
        if restart >= 0:
            self._never_reached(restart)
        return stop

    def _load(self, label: str, index: int) -> bool:
        """Read the file of a subprogram called in a line, and say what is wrong with it."""
        assert self.flow is not None
        structure = self.flow.structure
        known = len(structure.problems)
        try:
            if not self.files.load(label, structure):
                return False
        except (OSError, NCError) as exc:
            at = self.flow.origin(self.own, index)
            raise _GiveUpError("E412", at, f"the file of subprogram {label}: {exc}") from None
        self.flow.stops = sorted(structure.items)
        for index, problem in structure.problems[known:]:
            self._flow_problem(problem, index)
        return True

    def _give_up(self, exc: FlowStop) -> _GiveUpError:
        return _GiveUpError(exc.problem.code, exc.index, exc.problem.message)

    def _restart(self, index: int) -> None:
        """Forget the moves so far; the state stays."""
        self.moves.clear()
        if self.state.compensation is not None:
            what = "the program cannot restart here: cutter compensation is on"
            self._record("E417", index + 1, 1, 0, None, "", what)

    def _never_reached(self, index: int) -> None:
        self.moves.clear()
        what = f"line {index + 1}, where the program was to restart, is never reached"
        self._record("E417", index + 1, 1, 0, None, "", what)

    def _flow_problem(self, problem: Problem, index: int) -> None:
        self.report(problem, index + 1, None)
        if self.errors >= MAX_ERRORS:
            raise self._too_many(index + 1)

    def _too_many(self, behind: int) -> _GiveUpError:
        what = (
            f"{self.errors} errors so far: the {len(self.lines) - behind} lines from here on are not examined"
        )
        return _GiveUpError("E408", behind, what)

    def _check_numbers(self, first: int, stop: int) -> None:
        """W402 and W403 of a program whose lines run in another order, or often."""
        for index in range(first, stop):
            found = _NUMBERED.match(self.lines[index])
            if found:
                text = self.lines[index]
                col = text.upper().index("N") + 1
                written = text[col - 1 : found.end()]
                word = Word("N", float(found[1]), col, len(written), written)
                self._check_number(index + 1, int(found[1]), word)

    def _blocks(self, first: int, stop: int) -> int:
        """Run lines first..stop-1; returns the 0-based line behind the last one run."""
        lines, match = self.lines, _PLAIN.fullmatch
        rapid, linear, append = Motion.RAPID, Motion.LINEAR, self.moves.append
        make = tuple.__new__  # Move(...) itself takes twice as long
        state, steered = self.state, self.flow is not None
        called = None if self.flow is None or first < self.own else self.flow.origin(self.own, first) + 1
        for index in range(first, stop):
            line = lines[index]
            if not line:
                continue
            plain = match(line)
            if plain is not None and state.plain and len(line) <= MAX_LINE:
                number, code, x, y, z, f = plain.groups()
                motion = state.motion if code is None else 10 if code == "1" else 0
                if (
                    (x is not None or y is not None or z is not None)
                    and (motion == 0 or (motion == 10 and (state.direction != 0 or state.warned_stopped)))
                    and state.feed_mode == 940
                    and (number is None or steered or int(number) > self.highest)
                ):
                    feed = state.feed
                    if f is not None:
                        feed = float(f) * state.scale
                    if (feed and feed > 0.0) or (motion == 0 and f is None):
                        n = None
                        if number is not None:
                            n = int(number)
                            if not steered:
                                self.highest = self.last = n
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
                            make(
                                Move,
                                (
                                    called or index + 1,
                                    n if called is None else None,
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
                                    *THREE_AXES,
                                ),
                            )
                        )
                        state.sim, state.machine = end, machine
                        continue
            self._block(index + 1, line, called)
            state = self.state
            if state.ended:
                return index + 1
            if self.next is not None:
                return index + 1
            if self.errors >= MAX_ERRORS and index + 1 < stop:
                raise self._too_many(index + 1)
        return stop

    def _block(self, number: int, text: str, called: int | None) -> None:
        """Any line, by lexer, block checks and interpreter; called : line of the program that its moves belong to."""
        lexed = self._lexed(number, text)
        if lexed.percent or (lexed.block_delete and self.settings.block_delete):
            return
        n = block_number(lexed)
        if n is not None and self.flow is None and "." not in lexed.words[0].text:
            self._check_number(number, n, lexed.words[0])
        problems: list[Problem] = []
        if lexed.errors:
            for error in lexed.errors:
                self._record(
                    error.code, number, error.col, error.length, n, error.text[:60], error.message, error.hint
                )
            return
        self.memory.line = number
        try_state = self.state.clone()
        values, writes = line_values(lexed, self.memory, problems)
        moves, warnings = list[Move](), list[Problem]()
        if not problems:
            block = build_block(
                lexed,
                values,
                self.state.motion,
                rotary=self.settings.rotary,
                mts=self.settings.dialect == "mts",
            )
            problems = block.problems
            if not problems and 10 in block.m:
                problem = (
                    self.flow.check(block, number - 1)
                    if self.flow is not None
                    else Problem("E412", block.m[10][1], "M98 and M99 are plain numbers, nothing computed")
                )
                problems = [problem] if problem is not None else []
            if not problems:
                try:
                    moves, warnings = execute(block, try_state, called or number, n, self.settings)
                except BlockError as exc:
                    problems = [exc.problem]
        if any(problem.code == "E413" for problem in problems):  # it may stand in a loop
            raise _GiveUpError("E413", number - 1, problems[0].message)
        if problems:
            for problem in problems:
                self.report(problem, number, n)
            return
        for warning in warnings:
            self.report(warning, number, n)
        for key, value in writes:
            self.memory.store(key, value)
        self.moves.extend(moves)
        if len(moves) > 1 and len(self.moves) > max(MAX_MOVES, 2 * self.settings.max_steps):
            raise _GiveUpError("E413", number, f"over {len(self.moves) - 1} motions: is there an end?")
        self.state = self.memory.state = try_state
        if any(_ABORT.match(text, comment.col - 1) for comment in lexed.comments):
            raise _GiveUpError("E418", number - 1, "the program stops itself here, by (ABORT, ...)")
        if 10 in block.m and self.flow is not None:
            self.next = self.flow.jump(block, number - 1)
            if self.next is None:
                what = "M99 starts the main program again, without end: it is read once"
                self.report(Problem("W415", block.m[10][1], what), number, n)
                self.state.ended = True

    def _lexed(self, number: int, text: str) -> LexedLine:
        """The words of a line; kept where lines run often."""
        if self.flow is None:
            return lex_line(text)
        lexed = self.lexed.get(number)
        if lexed is None:
            lexed = self.lexed[number] = lex_line(text)
        return lexed

    def _check_number(self, line: int, n: int, word: Word) -> None:
        if n in self.numbers:
            self.report(Problem("W402", word, f"N{n} was used before"), line, n)
        if n < self.last:
            self.report(Problem("W403", word, f"N{n} follows N{self.last}"), line, n)
        self.numbers.add(n)
        self.last = n
        self.highest = max(self.highest, n)
