"""Goes through the lines of a word address program: tape marks, block numbers, one block after the other.

Blocks that are plain straight moves take a short cut. Lines that steer are left to `flow.py`.
"""

from __future__ import annotations

import gc
import re
from bisect import bisect_left
from typing import Final

from vmachining.errors import NCError
from vmachining.nc.block import Problem
from vmachining.nc.fanuc_lathe import Lathe
from vmachining.nc.fanuc_lines import folded
from vmachining.nc.fanuc_macro import NEVER, NEXT_PROGRAM, MacroFlow, next_program, steers
from vmachining.nc.files import find_tape
from vmachining.nc.flow import Flow, FlowStop, Structure, find_structure
from vmachining.nc.lexer import MAX_LINE, Word
from vmachining.nc.model import Motion
from vmachining.nc.one_block import MAX_ERRORS, MAX_WARNINGS, GiveUpError, OneBlock
from vmachining.nc.placing import carried
from vmachining.nc.quick import AGAIN, BLOCK, CHANGED, offset, quick_move

_PROGRAM_NUMBER: Final = re.compile(r"(?:[oO][ \t]*[0-9]+|:[0-9]+)[ \t]*(?:\(|;|$)|[oO].*\b[sS][uU][bB]\b")
_LOCAL: Final = re.compile(r"M0*97[ \t]*P", re.IGNORECASE)
_NUMBERED: Final = re.compile(r"[ \t]*/?[ \t]*[Nn][ \t]*([0-9]{1,9})(?![0-9.])")


class Reader(OneBlock):
    """Goes through the lines once, or as often as loops and calls say."""

    # ---- the program ----

    def run(self) -> None:
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
            mark = Word("%", None, 1, 1, "%")
            self.report(Problem("I405", mark, "the only tape mark stands after the program"), stop + 1)
        at = first
        try:
            at = self._drive(first, stop)
        except GiveUpError as exc:
            code, at, what = exc.args
            self.report(Problem(code, None, what), min(at + 1, self.own))
        else:
            self.ended = self.state.ended or closed
            self._epilogue(at if self.state.ended else stop)
        if self.state.held is not None:
            what = "the program ends on a corner (,R or ,C), which needs a motion after it"
            self.report(Problem("E109", None, what), max(1, self.state.held.line))
        if self.state.compensation is not None:
            left = self.state.compensation.finish()[0]
            if self.state.carried is not None:
                left = carried(left, self.state, self.settings, None)
            self.moves.extend(left)
        if not any(move.motion is not Motion.DWELL for move in self.moves) and not self.errors:
            self.report(Problem("W406", None, "the program contains no motion"), 1)
        if self.translator is not None:
            self.findings = folded(self.findings)
        for code, count in self.warnings.items():
            if count > MAX_WARNINGS:
                what = f"{code} was found {count} times, {count - MAX_WARNINGS} of them are not listed"
                self.report(Problem("I407", None, what), self.own)

    def _epilogue(self, at: int) -> None:
        """W401, or W404 for what stands after the end."""
        lines = self.lines
        if not self.ended:
            self.report(Problem("W401", None, "the program has no M2, M30 or closing %"), max(1, self.own))
            return
        for index in range(at, self.own):
            content = lines[index].strip(" \t")
            local = self.translator is not None and any(map(_LOCAL.search, lines))
            if local or _PROGRAM_NUMBER.match(content):
                return  # a subprogram
            if content and content != "%":
                text = content[:40]
                word = Word("", None, lines[index].index(content) + 1, len(text), text)
                self.report(Problem("W404", word, "text after the end of the program"), index + 1)
                return

    def _drive(self, first: int, stop: int) -> int:
        """Run lines first..stop-1 in the order that they say; returns the 0-based line after the last one."""
        if self.translator is not None and steers(self.lines[first:stop]):
            return self._macro(first, stop)
        if self.translator is not None and (last := next_program(self.lines, first, stop)) < stop:
            at = self._drive(first, last)
            if not self.state.ended:
                word = Word("O", None, 1, 0, self.lines[last].strip()[:20])
                self.report(Problem("W401", word, NEXT_PROGRAM), last + 1)
                self.state.ended = True
            return at
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
        try:
            return self._steered(flow, first, stop, restart if first < restart < stop else -1)
        except FlowStop as exc:
            raise GiveUpError(exc.problem.code, exc.index, exc.problem.message) from None

    def _macro(self, first: int, stop: int) -> int:
        """The same for a program with macros or subprograms of the Fanuc family."""
        flow = self.flow = Flow(Structure(), self.memory, self._flow_problem, self._load)

        def one(index: int, text: str) -> None:
            called = flow.origin(self.own, index) + 1 if index >= self.own else None
            self._block(index + 1, text, called, fresh=True)

        steps = MacroFlow(
            self.lines, self.memory, self._blocks, one, self._flow_problem, lambda: self.state.ended, self.files,
            flow.frames, skips=self.settings.block_delete,
        )  # fmt: skip
        if isinstance(self.translator, Lathe):
            steps.left_out = self.translator.leaves_out
        try:
            at, endless = steps.drive(first, stop, self.settings.max_steps)
        except (OSError, NCError) as exc:
            raise GiveUpError("E412", stop, f"the file of a subprogram: {exc}") from None
        if endless:
            raise GiveUpError("E413", at, endless)
        if not self.state.ended and at < stop:
            self.state.ended = True
        return at

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
                    at = flow.step(item)
                steps += 1
            else:
                place = bisect_left(flow.stops, at)
                end = min(flow.stops[place], last) if place < len(flow.stops) else last
                if at < restart < end:
                    end = restart
                self.next = None
                begin, at = at, self._blocks(at, end)
                steps += at - begin
                if self.state.ended:
                    if restart >= 0:
                        self._never_reached(restart)
                    return at
                if self.next is not None:
                    at = self.next
            if steps > limit:
                what = f"loops and calls repeated over {self.settings.max_steps} lines: is there an end?"
                raise GiveUpError("E413", at, what)
        if flow.frames:
            self.report(Problem("E415", None, NEVER), flow.frames[-1].start + 1)
        if restart >= 0:
            self._never_reached(restart)
        return stop

    def _load(self, label: str, index: int) -> None:
        """Read the file of a subprogram called in a line, and say what is wrong with it."""
        assert self.flow is not None
        structure = self.flow.structure
        known = len(structure.problems)
        try:
            self.files.load(label, structure)
        except (OSError, NCError) as exc:
            at = self.flow.origin(self.own, index)
            raise GiveUpError("E412", at, f"the file of subprogram {label}: {exc}") from None
        self.flow.stops = sorted(structure.items)
        for index, problem in structure.problems[known:]:
            self._flow_problem(problem, index)

    def _restart(self, index: int) -> None:
        """Forget the moves so far; the state stays."""
        self.moves.clear()
        if self.state.compensation is not None:
            what = "the program cannot restart here: cutter compensation is on"
            self.report(Problem("E417", None, what), index + 1)

    def _never_reached(self, index: int) -> None:
        self.moves.clear()
        what = f"line {index + 1}, where the program was to restart, is never reached"
        self.report(Problem("E417", None, what), index + 1)

    def _check_numbers(self, first: int, stop: int) -> None:
        """W402 and W403 of a program whose lines run in another order, or often."""
        for index in range(first, stop):
            if found := _NUMBERED.match(text := self.lines[index]):
                at, end = text.upper().index("N"), found.end()
                word = Word("N", float(found[1]), at + 1, end - at, text[at:end])
                self._check_number(index + 1, int(found[1]), word)

    def _count(self, index: int, line: str, n: int, number: str) -> None:
        """The block number of a line that took a short cut."""
        if n <= self.highest:
            at = line.upper().index("N")
            end = line.index(number, at) + len(number)
            self._check_number(index + 1, n, Word("N", float(n), at + 1, end - at, line[at:end]))
        else:
            self.numbers.add(n)
            self.highest = self.last = n

    def _blocks(self, first: int, stop: int) -> int:
        """Run lines first..stop-1; returns the 0-based line after the last one run."""
        lines, match, moves = self.lines, BLOCK.fullmatch, self.moves
        state, steered, quick = self.state, self.flow is not None, self.translator
        control = self.settings.control
        arcs = control.arc_centres in ("", "start") and not control.modal_centres
        called = None if self.flow is None or first < self.own else self.flow.origin(self.own, first) + 1
        fast = (state.plain or state.offset) and (quick is None or quick.quick)
        for index in range(first, stop):
            line = lines[index]
            if not line:
                continue
            again = None
            if fast and len(line) <= MAX_LINE:
                found = match(line)
                words, writes = found.groups() if found is not None else None, None
                if found is None and ("[" in line or "#" in line):
                    words, writes = self.templates.words(line) or (None, None)
                if words is not None:
                    n = None if (number := words[0]) is None else int(number)
                    before = None if state.compensation is None else CHANGED(state)
                    move = quick_move(state, words, called or index + 1, n if called is None else None, arcs)
                    done = [] if move is None or before is None else offset(state, move, before)
                    if done is None:
                        move = None
                    if move is not None or (writes and not any(word is not None for word in words[1:])):
                        if move is not None and before is None:
                            moves.append(move)
                        elif done:
                            moves.extend(done)
                        if writes:
                            for key, value in writes:
                                self.memory.store(key, value)
                                if quick is not None and isinstance(key, int):
                                    quick.register(key, value * state.scale)
                        if n is not None and not steered:
                            self._count(index, line, n, number)
                        continue
                if (again := AGAIN.fullmatch(line)) is not None and (
                    quick is None or not (again[2] or again[5])
                ):
                    n = None if (number := again[1]) is None else int(number)
                    place = called or index + 1, n if called is None else None
                    made = self.repeated.moves(state, again.groups(), *place)
                    if made is not None:
                        moves.extend(made)
                        if n is not None and not steered:
                            self._count(index, line, n, number)
                        if len(made) > 1 and len(moves) > self.most:
                            raise self._too_long(index + 1)
                        continue
            told, made_before = sum(self.warnings.values()) + len(self.findings), len(moves)
            self._block(index + 1, line, called)
            silent = told == sum(self.warnings.values()) + len(self.findings)
            if again is not None and moves is self.moves and silent:
                self.repeated.keep(again.groups(), state, self.state, moves[made_before:])
            state, moves = self.state, self.moves
            fast = (state.plain or state.offset) and (quick is None or quick.quick)
            if state.ended or self.next is not None:
                return index + 1
            if self.errors >= MAX_ERRORS and index + 1 < stop:
                raise self._too_many(index + 1)
        return stop
