"""One block of a word address program: its numbers, by lexer, block checks and interpreter; what is wrong with it."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from vmachining.nc.block import (
    AXIS_CLAIMING,
    CYCLES,
    FANUC_G_GROUP,
    G_GROUP,
    MTS_G_GROUP,
    Block,
    Problem,
    block_number,
    build_block,
)
from vmachining.nc.expressions import NoValueError, evaluate, to_least
from vmachining.nc.fanuc import Translator
from vmachining.nc.fanuc_lathe import Lathe
from vmachining.nc.fanuc_lathe_cycles import Contour
from vmachining.nc.fanuc_line import Words
from vmachining.nc.fanuc_lines import heads, numbered, plain_lathe, prepare, tool_changer
from vmachining.nc.fanuc_okuma import user_task
from vmachining.nc.fanuc_variables import FAMILY_FREE
from vmachining.nc.files import MAX_BYTES, decode_program, find_file, find_tape
from vmachining.nc.findings import CATALOGUE
from vmachining.nc.flow import Flow, Structure, find_structure, unread
from vmachining.nc.frames import PLANES, UP
from vmachining.nc.interpreter import INCH, execute
from vmachining.nc.lexer import MAX_VALUE, LexedLine, Word, lex_line, split_lines
from vmachining.nc.model import Finding, Motion, Move, add
from vmachining.nc.placing import carried, pivoted
from vmachining.nc.quick import Repeated, Templates
from vmachining.nc.run import BlockError, Run
from vmachining.nc.settings import Settings
from vmachining.nc.state import ORIGIN, Memory, State

MAX_ERRORS: Final = 1000
"""Records of severity E after which a file is given up."""

MAX_MOVES: Final = 2_000_000
"""Motions of a program that multiplies its lines by cycles and loops; more where more steps are allowed."""

MAX_WARNINGS: Final = 200
"""Records of one warning code that are listed."""

_ABORT: Final = re.compile(r"\([ \t]*abort[ \t]*,", re.IGNORECASE)


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
    """Subprograms in separate files, each read once.

        o<name> call and O100 call     the file name.ngc, 100.ngc, which holds that sub
        M98 P100                       the file 100.ngc, which holds the program O100
        the same, G65, G66, M198 of the Fanuc family     O0100.nc, 100.txt, O100: a number, whatever stands about it

    Folders are searched in order, capitals mean nothing. The lines of a file are hung behind those of the program, so that
    everything that runs has one index; findings and motions of such lines belong to the line of the program that called.

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

    def load(self, label: str, structure: Structure) -> None:
        """Read the file of a label and add what steers in it, where one exists and was not read before.

        Raises NCError: The file is binary, too large, or cannot be read.
        """
        name = label.strip("<>")
        if label in self.tried or not _NAME.fullmatch(name):
            return
        self.tried.add(label)
        path = self._find((name + SUFFIXES[0]).__eq__) or self._find((name + SUFFIXES[1]).__eq__)
        if path is not None:
            file = self._hang(path)
            if (found := find_structure(self.lines, file.first, file.stop)) is not None:
                structure.add(found)

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


class GiveUpError(Exception):
    """The rest of the program is not examined: code, 0-based line after the last one, why."""


class OneBlock:
    """State of a program that is read, and what one block does to it."""

    def __init__(self, lines: list[str], settings: Settings) -> None:
        kind = Lathe if settings.turning else Translator
        self.translator = kind(settings, self._note) if settings.family else None
        self.settings = settings
        self.lines = lines = self._plain(lines)
        self.files = SubFiles(settings.subroutines, lines, self._plain)
        self.own = len(lines)
        home = settings.home
        start = settings.work_offsets.get(540, ORIGIN)
        self.state = State(
            sim=home,
            scale=INCH if settings.units == "inch" else 1.0,
            machine=add(home, start),
            offsets=settings.work_offsets,
            start_offset=start,
            references=(home, home),
            table=settings.tools or {},
        )
        self.state.place_offsets()
        self.memory = Memory(self.state, settings.family)
        self.roughed: dict[tuple[int, int], Contour] = {}
        if isinstance(self.translator, Lathe):
            self.translator.start(lines, self.state, self._contour)
        elif self.translator is not None:
            self.translator.changes_by = tool_changer(lines)
        self.templates = Templates(self.memory)
        self.repeated, self.most = Repeated(), max(MAX_MOVES, 2 * settings.max_steps)
        self.moves: list[Move] = []
        self.findings: list[Finding] = []
        self.ended = False
        self.errors = 0
        self.warnings: dict[str, int] = {}
        self.zeros: set[int] = set()
        self.placed: set[int] = set()
        """Work offsets that were cut in; those that were told."""
        self.since = 0
        self.numbers: set[int] = set()
        self.highest = -1
        self.last = -1
        self.flow: Flow | None = None
        self.next: int | None = None
        self.lexed: dict[int, LexedLine] = {}
        self.reported: set[tuple[int, int, str]] = set()

    def _plain(self, lines: list[str]) -> list[str]:
        """Lines as the lexer knows them."""
        if self.translator is None:
            return lines
        lines = [prepare(line) for line in lines]
        if self.settings.turning:
            lines = plain_lathe(lines)
        return user_task(lines) if self.translator.variant == "okuma" else lines

    def _contour(self, first: int, last: int | None, at: int, again: bool) -> Contour | None:
        """Blocks from N first to N last, or to G80, of the same program: from this line on, else from its beginning."""
        lines = self.lines
        begin = next((k for k in range(at, -1, -1) if heads(lines[k])), 0)
        if again and (begin, first) in self.roughed:
            return self.roughed[begin, first]
        stop = next((k for k in range(at + 1, len(lines)) if heads(lines[k])), len(lines))
        skips = self.settings.block_delete
        read = [k for k in range(begin, stop) if not (skips and lines[k].lstrip()[:1] == "/")]
        named = [k for k in read if numbered(lines[k]) == first]
        start = next((k for k in named if k > at), named[0] if named else stop)
        for k in read:
            words = self._lexed(k + 1, lines[k]).words if last is None and k >= start else ()
            ends = any(w.letter == "G" and w.value == 80.0 for w in words)
            if k >= start and (ends if last is None else numbered(lines[k]) == last):
                self.roughed[begin, first] = start, k
                return start, k
        return None

    def _finish(self, lathe: Lathe, number: int, n: int | None, called: int | None) -> None:
        """The contour of a finishing cycle, block by block; then a rapid to where it began."""
        assert lathe.runs is not None
        (first, last), (x, _, z), scale = lathe.runs, self.state.program, self.state.scale
        lathe.runs, lathe.inside = None, True
        for k in range(first, last + 1):
            if not self.state.ended:
                self._block(k + 1, self.lines[k], called or number)
        lathe.inside = False
        words = [(Word(c, None, 1, 0, ""), v) for c, v in (("G", 0.0), ("X", x / scale), ("Z", z / scale))]
        for problem in self._ahead(words, self.state, called or number, n, self.moves, []):
            self.report(problem, number, n)

    def _note(self, problem: Problem) -> None:
        self.report(problem, self.memory.line)

    def report(self, problem: Problem, line: int, n: int | None = None) -> None:
        """Record a problem; warnings of one kind only up to a limit."""
        code, at, message, hint = problem
        col, length, word = (1, 0, "") if at is None else (at.col, at.length, at.text)
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
        hint = hint or CATALOGUE[code].hint
        self.findings.append(Finding(line, col, length, n, word, code, code[0], message, hint))

    def _flow_problem(self, problem: Problem, index: int) -> None:
        self.report(problem, index + 1)
        if self.errors >= MAX_ERRORS:
            raise self._too_many(index + 1)

    def _too_long(self, behind: int) -> GiveUpError:
        return GiveUpError("E413", behind, f"over {len(self.moves) - 1} motions: is there an end?")

    def _too_many(self, behind: int) -> GiveUpError:
        what = (
            f"{self.errors} errors so far: the {len(self.lines) - behind} lines from here on are not examined"
        )
        return GiveUpError("E408", behind, what)

    def _block(self, number: int, text: str, called: int | None, *, fresh: bool = False) -> None:
        """Any line, by lexer, block checks and interpreter; called : line of the program that its moves belong to.

        fresh : the text is not the line itself.
        """
        lexed = lex_line(text) if fresh else self._lexed(number, text)
        if self.translator is not None and "#" in text:
            lexed = lexed._replace(words=tuple(word for word in lexed.words if not self._unset(word)))
        if lexed.percent or (lexed.block_delete and self.settings.block_delete):
            return
        n = block_number(lexed)
        lathe = self.translator if isinstance(self.translator, Lathe) else None
        counted = self.flow is None and not (lathe and lathe.inside)
        if counted and n is not None and "." not in lexed.words[0].text:
            self._check_number(number, n, lexed.words[0])
        problems: list[Problem] = []
        if lexed.errors:
            for error in lexed.errors:
                self.report(unread(error), number, n)
            return
        self.memory.line = number
        try_state = self.state.clone()
        values, writes = line_values(lexed, self.memory, problems)
        moves, warnings = list[Move](), list[Problem]()
        after: list[Callable[[State], None]] = []
        block: Block | None = None
        vector = None
        if self.translator is not None and not problems:
            self.translator.at = number - 1
            translated = self.translator.translate(list(zip(lexed.words, values, strict=True)), try_state)
            lexed = lexed._replace(words=tuple(w for w, _ in translated.pairs))
            values = [v for _, v in translated.pairs]
            problems, after, vector = translated.problems, translated.after, translated.vector
            for change in translated.before:
                change(try_state)
            if translated.pivot is not None and not problems:
                moves += self._pivot(number, n, try_state, called, translated.pivot)
            for ahead in translated.ahead:
                if not problems:
                    problems += self._ahead(ahead, try_state, called or number, n, moves, warnings)
        if not problems:
            mts, rotary = self.settings.dialect == "mts", self.settings.rotary
            groups = MTS_G_GROUP if mts else G_GROUP if self.translator is None else FANUC_G_GROUP
            block = build_block(lexed, values, try_state.motion, rotary=rotary, mts=mts, groups=groups)
            problems = block.problems
            if problems and self.translator is not None:
                problems = self.translator.forgive(block)
            if not problems and 10 in block.m:
                what = "M98 and M99 are plain numbers, nothing computed"
                problem: Problem | None = Problem("E412", block.m[10][1], what)
                if self.flow is not None:
                    problem = self.flow.check(block, number - 1)
                problems = [problem] if problem is not None else []
            if not problems:
                frame = try_state.carried
                try:
                    done, more = execute(block, try_state, called or number, n, self.settings)
                    if frame is not None or vector is not None or try_state.axis != UP:
                        done = carried(done, try_state, self.settings, vector)
                    moves += done
                    warnings += more
                except BlockError as exc:
                    problems = [exc.problem]
        if problems and self.translator is not None:
            self._go_on(block, problems)
        if any(problem.code == "E413" for problem in problems):  # it may stand in a loop
            raise GiveUpError("E413", number - 1, problems[0].message)
        if problems:
            for problem in problems:
                if problem.message.startswith("#3000 ="):
                    raise GiveUpError("E108", number - 1, problem.message)
            for problem in problems:
                self.report(problem, number, n)
            return
        for warning in warnings:
            if warning.code not in ("W333", "W366", "W381") or not self.warnings.get(warning.code):
                self.report(warning, number, n)
        for change in after:
            change(try_state)
        if try_state.work != self.state.work:
            self._other_zero(try_state, number, n, block)
        self.state = self.memory.state = try_state
        for key, value in writes:
            self.memory.store(key, value)
            if self.translator is not None and isinstance(key, int):
                self.translator.register(key, value * try_state.scale)
        self.moves.extend(moves)
        if len(moves) > 1 and len(self.moves) > self.most:
            raise self._too_long(number)
        if any(_ABORT.match(text, comment.col - 1) for comment in lexed.comments):
            raise GiveUpError("E418", number - 1, "the program aborts here, with (ABORT, ...)")
        if lathe is not None and lathe.runs is not None:
            self._finish(lathe, number, n, called)
        if block is not None and 10 in block.m and self.flow is not None:
            self.next = self.flow.jump(block, number - 1)
            if self.next is None:
                what = "M99 starts the main program again, without end: it is read once"
                self.report(Problem("W415", block.m[10][1], what), number, n)
                self.state.ended = True

    def _other_zero(self, state: State, line: int, n: int | None, block: Block | None) -> None:
        """Another work offset: where it lies from the one that was cut in is known only if both are given."""
        if any(move.feed_mm_min is not None for move in self.moves[self.since :]):
            self.zeros.add(self.state.work)
        self.since, new = len(self.moves), state.work
        known = all(code in state.offsets for code in (*self.zeros, new))
        if known or not self.zeros or new in self.zeros | self.placed:
            return
        self.placed.add(new)
        word = block.g[12][1] if block is not None and 12 in block.g else None
        taken = "what is not given counts as zero" if state.offsets else "both are assumed to be the same"
        what = f"a second work offset: its distance from the first is not given; {taken}"
        self.report(Problem("W368", word, what), line, n)

    def _pivot(
        self, line: int, n: int | None, state: State, called: int | None, axis: tuple[float, float, float]
    ) -> list[Move]:
        """G53.1: the tool axis turns to the plane."""
        cause = Move(
            called or line, n, Motion.RAPID, state.sim, state.sim, state.plane.name, None, 0, None, state.tool, state.rpm,
            0.0, state.machine, state.program,
        )  # fmt: skip
        moves, findings = pivoted(cause, state, self.settings, axis)
        for item in findings:
            self.report(Problem(item.code, None, item.message), line, n)
        return moves

    def _ahead(
        self, words: Words, state: State, line: int, n: int | None, moves: list[Move], warnings: list[Problem]
    ) -> list[Problem]:
        """A block that the control executes before the one that is written: its moves are added; what is wrong."""
        motion, cycle = state.motion, state.cycle
        lexed = LexedLine("", tuple(w for w, _ in words))
        values, rotary = [v for _, v in words], self.settings.rotary
        block = build_block(lexed, values, motion, rotary=rotary, groups=FANUC_G_GROUP)
        if not block.problems:
            try:
                done, more = execute(block, state, line, n, self.settings)
                moves += done
                warnings += more
            except BlockError as exc:
                return [exc.problem]
            state.motion, state.cycle = motion, cycle
        return block.problems

    def _go_on(self, block: Block | None, problems: list[Problem]) -> None:
        """What a refused block changes anyway, so that one cause is not reported as many."""
        if block is None or not block.words:
            return
        kept = self.state.clone()
        cycle = block.motion in CYCLES or (block.motion is None and kept.motion in CYCLES)
        if self.translator is not None and cycle and problems:
            self.translator.dead = problems[0]
        kept.motion = block.motion if block.motion not in (None, 800) else kept.motion
        kept.absolute = block.g[3][0] == 900 if 3 in block.g else kept.absolute
        kept.plane = PLANES[block.g[2][0]] if 2 in block.g else kept.plane
        feed, speed = block.value("F"), block.value("S")
        kept.feed = feed * kept.scale if feed and feed > 0.0 and kept.feed_mode != 930 else kept.feed
        kept.speed = speed if speed and speed > 0.0 else kept.speed
        claimed = block.polar or any(map(block.has_g, AXIS_CLAIMING))
        if kept.motion not in CYCLES and not claimed:
            kept.sim, kept.machine = Run(block, kept, 0, None, self.settings).target()
        self.state = self.memory.state = kept

    def _unset(self, word: Word) -> bool:
        """Whether the value of a word is a variable that was never set: these controls leave such a word out."""
        node = word.expression
        while node is not None and node.op == "negative":
            node = node.args[0]
        if node is None or node.op != "parameter" or node.name is None or node.name.number is None:
            return False
        try:
            number = evaluate(node.name.number, self.memory)
        except NoValueError:
            return False
        return number < FAMILY_FREE and int(number) not in self.memory

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


def line_values(
    lexed: LexedLine, memory: Memory, problems: list[Problem]
) -> tuple[list[float], list[tuple[str | int, float]]]:
    """Numbers of the words, and the assignments to make when the block is done; E108 is added to `problems`."""
    values, writes = list[float](), list[tuple[str | int, float]]()
    for word in lexed.words:
        value = word.value
        try:
            if word.expression is not None:
                node, rounds = word.expression, memory.family and word.letter in "XYZABCUVWIJKRQ"
                # in an address to 0.001 mm or degrees, 0.0001 inch
                if rounds and "ROUND" in word.text.upper():
                    node = to_least(node, 1e3 if memory.state.scale == 1.0 or word.letter in "ABC" else 1e4)
                value = evaluate(node, memory)
                if abs(value) > MAX_VALUE:
                    raise NoValueError(f"{value:g} is out of range")
        except NoValueError as exc:
            problems.append(Problem("E108", word, str(exc)))
        values.append(0.0 if value is None else value)
    for item in lexed.assignments:
        try:
            writes.append(memory.resolve(item.target, item.value))
        except NoValueError as exc:
            place = Word("#", None, item.col, item.length, item.text)
            problems.append(Problem("E108", place, str(exc)))
    return values, writes
