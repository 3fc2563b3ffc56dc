"""Custom macro B and subprograms of the Fanuc family: the lines that steer.

    IF [..] GOTO n    IF [..] THEN #i = ..    GOTO n    WHILE [..] DO m ... END m    DO m ... END m
    M98 P1234 L5  M98 P0051234  M198 P1234  M97 Pn (a line, Haas)  M99  M99 Pn     G65 P1234 L2 A1. B2. ...
    G66 P1234 A1. ...   calls the macro after every block that moves an axis, until G67; G66.1 after every block
    /M98 ...            is skipped where block delete is on, as every line with a slash

A program is what stands between two O numbers, or a separate file; GOTO and M97 look for N in it, forwards first. G65
gives its words to #1 to #33 of a new level, M98 keeps the level. A word whose parameter was never set is left out, as the
controls do. Source: Fanuc 0i/30i operator's manual, custom macro. Not read: variables of the state of a machine.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from collections.abc import Callable
from itertools import chain, islice, pairwise
from typing import TYPE_CHECKING, Final

from vmachining.nc.block import Problem
from vmachining.nc.expressions import ExpressionError, NoValueError, evaluate, parse_value
from vmachining.nc.fanuc_lines import bracketed
from vmachining.nc.fanuc_variables import FAMILY_FREE
from vmachining.nc.flow import Frame
from vmachining.nc.lexer import Word, lex_line

if TYPE_CHECKING:
    from vmachining.nc.one_block import SubFiles
    from vmachining.nc.state import Memory

_STEERS: Final = re.compile(
    r"(?<![A-Z])(?:IF[ \t]*\[|WHILE[ \t]*\[|GOTO|DO[ \t]*[0-9]|END[ \t]*[0-9])"
    r"|M[ \t]*0*1?9[789](?![0-9.])|G[ \t]*0*6(?:[57](?![0-9.])|6(?:\.1)?(?![0-9]))",
    re.IGNORECASE,
)
_COMMENT: Final = re.compile(r"\([^()]*\)|;.*")
_HEAD: Final = re.compile(r"^[ \t]*/?[ \t]*(?:N[0-9]+[ \t]*)?", re.IGNORECASE)
_PROGRAM: Final = re.compile(r"^[ \t]*[O:][ \t]*([0-9]+)", re.IGNORECASE)
_NUMBER: Final = re.compile(r"^[ \t]*/?[ \t]*N[ \t]*0*([0-9]+)", re.IGNORECASE)
_BRANCH: Final = re.compile(r"(IF|WHILE)[ \t]*(?=\[)", re.IGNORECASE)
_THEN: Final = re.compile(r"[ \t]*(?:THEN(?![A-Z])[ \t]*)?(GOTO)?[ \t]*", re.IGNORECASE)
_DO: Final = re.compile(r"[ \t]*DO[ \t]*([0-9]+)", re.IGNORECASE)
_END: Final = re.compile(r"END[ \t]*([0-9]+)", re.IGNORECASE)
_GOTO: Final = re.compile(r"GOTO[ \t]*", re.IGNORECASE)
_LOOP: Final = re.compile(r"(?<![A-Z])DO[ \t]*([0-9]+)", re.IGNORECASE)
_NULL: Final = re.compile(r"#([0-9]+)[ \t]*(EQ|NE)[ \t]*(#?)0(?:\.0*)?(?![0-9.])", re.IGNORECASE)
_ALARM: Final = re.compile(r"[ \t]*#[ \t]*3000[ \t]*=")

ARGUMENTS: Final = {
    **dict(zip("ABCIJKDEFHM", (1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 13), strict=True)),
    **{letter: 17 + k for k, letter in enumerate("QRSTUVWXYZ")},
}
"""Local variables of the words of G65, type I of the manual; of type II, I J K again and again, are #4 to #33."""

MACROS: Final = ("G65", "G66", "G66.1")
NEVER: Final = "the called subprogram never returns (M99)"
BUILDER: Final = range(9000, 10000)
"""O numbers of the builder's macros for tools, probes and pallets, which G65 and G66 call."""
MAX_DEPTH: Final = 64
MISSING: Final = "put O{}.nc next to the program or name its folder with --subroutines; M99 alone will do if it moves nothing"
_PLACES: Final = re.compile(r"(?<![A-Z])[XYZABC][ \t]*[-+.0-9#\[]", re.IGNORECASE)
_STOPS: Final = re.compile(r"(?<![A-Z#])M[ \t]*0*(?:2|30)(?![0-9.])", re.IGNORECASE)
_RETURNS: Final = re.compile(r"(?<![A-Z#])M[ \t]*99(?![0-9.])", re.IGNORECASE)
_EMPTY: Final = re.compile(r"\s*(?:N[ \t]*[0-9]+)?[\s;%]*", re.IGNORECASE)
_ASKS: Final = re.compile(r"\s*(?:N[ \t]*[0-9]+\s*)?(?:IF(?!.*THEN)|GOTO|WHILE|END)", re.IGNORECASE)
_STAYS: Final = re.compile(r"(?<![A-Z])G[ \t]*0*(?:4|10|5[0-2]|6[89]|92)(?![0-9])", re.IGNORECASE)
"""Codes whose axis words move nothing."""


def _after_head(text: str) -> int:
    found = _HEAD.match(text)
    return found.end() if found else 0


def steers(lines: list[str]) -> bool:
    """Whether some line steers."""
    return any(_STEERS.search(_COMMENT.sub(" ", line)) for line in lines)


NEXT_PROGRAM: Final = "the program before this one has no M2 or M30: reading ends at the next O number"


def next_program(lines: list[str], first: int, stop: int) -> int:
    """The line of the second O number, where another program begins; else `stop`."""
    heads = (k for k in range(first, stop) if _PROGRAM.match(lines[k]))
    return next(islice(heads, 1, None), stop)


def arguments(words: list[tuple[str, float]]) -> dict[int, float]:
    """Local variables of the words of a call; I J K that come again, or in another order, are of type II."""
    out, group, last = dict[int, float](), 0, ""
    for letter, value in words:
        if letter in "IJK":
            group += bool(last) and letter <= last
            last = letter
            out[4 + 3 * group + "IJK".index(letter)] = value
        elif letter in ARGUMENTS:
            out[ARGUMENTS[letter]] = value
    return {number: value for number, value in out.items() if number <= 33}


class MacroFlow:
    """Where the program goes next.

    run : executes lines first..stop-1, returns the line after the last one that ran. one : executes a text as that line.
    report : takes a problem and its 0-based line. over : whether the program has ended. files : of other programs.
    calls : those in progress. skips : whether lines with a slash are skipped.
    """

    def __init__(
        self,
        lines: list[str],
        memory: Memory,
        run: Callable[[int, int], int],
        one: Callable[[int, str], None],
        report: Callable[[Problem, int], None],
        over: Callable[[], bool],
        files: SubFiles,
        calls: list[Frame],
        *,
        skips: bool,
    ) -> None:
        self.lines, self.memory, self.files, self.calls = lines, memory, files, calls
        self.run, self.one, self.report, self.over, self.skips = run, one, report, over, skips
        self.bare, self.stops, self.starts = list[str](), list[int](), list[int]()
        self.programs: dict[int, int] = {}
        self.modal: tuple[Frame, int, bool] | None = None
        self.left_out: Callable[[int], bool] = lambda index: False
        """Whether a line belongs to the contour of a cycle whose passes are left out."""
        self._look()

    def _look(self) -> None:
        """Take in the lines that are new."""
        for k in range(len(self.bare), len(self.lines)):
            bare = _COMMENT.sub(lambda hit: " " * len(hit[0]), self.lines[k])
            self.bare.append(bare)
            found = _PROGRAM.match(bare)
            if found or _STEERS.search(bare):
                self.stops.append(k)
            if found:
                self.programs.setdefault(int(found[1]), k)
                self.starts.append(k)

    def _program(self, number: int) -> int | None:
        """The line before the first one of a program, here or in a separate file."""
        if number not in self.programs:
            file = self.files.load_program(number)
            if file is None:
                return None
            self._look()
            if number not in self.programs:
                self.programs[number] = file.first - 1
                self.starts = sorted([*self.starts, file.first - 1])
        return self.programs[number]

    def main(self, first: int, stop: int) -> int:
        """Where reading begins: in a file that opens with subprograms, after the O number of the only program that ends."""
        heads = [k for k in self.starts if first <= k < stop]
        parts = [(a, self.bare[a:b]) for a, b in pairwise([*heads, stop])]
        ends = [a for a, lines in parts if any(map(_STOPS.search, lines))]
        calls = all(any(map(_RETURNS.search, lines)) for a, lines in parts if a < ends[0]) if ends else False
        if len(ends) != 1 or ends[0] == heads[0] or not calls:
            return first
        what = "the file opens with subprograms: this program is run, the only one with M2 or M30"
        self.report(Problem("I213", self._word(ends[0]), what), ends[0])
        return ends[0] + 1

    def drive(self, first: int, stop: int, limit: int) -> tuple[int, str]:
        """Run from a line to the end; the line after the last, and why it does not end, "" where it does."""
        at, steps = self.main(first, stop), 0
        asked = set[int]()  # branches since anything else ran: the same one again goes the same way
        while at < (last := self.files.stop(at, stop)):
            place = bisect_left(self.stops, at)
            until = min(self.stops[place], last) if place < len(self.stops) else last
            if at < until and self.modal is not None and self.modal[1] == len(self.calls):
                at, steps = self._each(at), steps + 1
                asked.clear()
            elif at < until:
                begin, at = at, self.run(at, until)
                steps += at - begin
                if at - begin > 2 or not all(map(_EMPTY.fullmatch, self.bare[begin:at])):
                    asked.clear()
            else:
                steps += 1
                if not _ASKS.match(self.bare[at]):
                    asked.clear()
                elif at in asked:
                    return at, "a loop in which nothing changes: it waits for what is not in the program"
                else:
                    asked.add(at)
                try:
                    at = self._step(at, last)
                except NoValueError as exc:
                    self.report(Problem("E108", self._word(at), str(exc)), at)
                    at += 1
                except ExpressionError as exc:
                    self.report(Problem("E107", self._word(at), str(exc)), at)
                    at += 1
            if self.over() or at < 0:
                return abs(at), ""
            if steps > limit + stop - first:
                return at, f"loops and calls repeated over {limit} lines: is there an end?"
        if self.calls:
            self.report(Problem("E415", None, NEVER), self.calls[-1].start)
        return stop, ""

    def _each(self, index: int) -> int:
        """A line under G66: its macro comes after it, where it moves an axis; under G66.1 always."""
        assert self.modal is not None
        frame, _, always = self.modal
        after = self.run(index, index + 1)
        bare = self.bare[index]
        moves = _PLACES.search(bare) and not _STAYS.search(bare)
        if self.over() or self._skipped(index) or not (always or moves):
            return after
        return self._enter(Frame(True, frame.start, after, frame.left, words=frame.words), None)

    def _enter(self, call: Frame, word: Word | None) -> int:
        if len(self.calls) >= MAX_DEPTH:
            self.report(Problem("E414", word, f"calls nested deeper than {MAX_DEPTH}"), call.back - 1)
            return -call.back
        self.calls.append(call)
        if call.words is not None:
            self.memory.enter_words(call.words)
        return call.start + 1

    def _skipped(self, index: int) -> bool:
        return self.skips and self.lines[index].lstrip(" \t").startswith("/")

    def _word(self, index: int) -> Word | None:
        text = self.bare[index].strip()
        return Word("#", None, self.lines[index].find(text[:1]) + 1, len(text), text[:40]) if text else None

    # ---- one line ----

    def _step(self, index: int, stop: int) -> int:
        text = self.bare[index]
        at = _after_head(text)
        if _PROGRAM.match(text):
            return self._next_program(index)
        if self._skipped(index) or self.left_out(index):
            return index + 1
        if found := _BRANCH.match(text, at):
            try:
                holds, end = self._value(text, found.end())
            except NoValueError:
                if found[1].upper() != "IF" or not self._is_alarm(index, text, found.end()):
                    raise
                return index + 1
            if found[1].upper() == "WHILE":
                loop = _DO.match(text, end)
                if loop is None:
                    raise ExpressionError("WHILE [..] needs DO and a number", end)
                lines = range(index + 1, self._section(index, stop)[1])
                missing = f"DO {int(loop[1])} has no END {int(loop[1])}"
                return index + 1 if holds else self._partner(lines, int(loop[1]), 1, missing) + 1
            then = _THEN.match(text, end)
            end = then.end() if then else end
            if not holds:
                return index + 1
            if then is not None and then[1]:
                return self._goto(index, self._value(text, end)[0], stop)
            self.one(index, bracketed(" " * end + text[end:]))
            return index + 1
        if found := _GOTO.match(text, at):
            return self._goto(index, self._value(text, found.end())[0], stop)
        if _DO.match(text, at):
            return index + 1
        if found := _END.match(text, at):
            lines = range(index - 1, self._section(index, len(self.bare))[0] - 1, -1)
            return self._partner(lines, int(found[1]), -1, f"END {int(found[1])} has no DO {int(found[1])}")
        return self._called(index, stop)

    def _is_alarm(self, index: int, text: str, at: int) -> bool:
        """IF [what only the machine knows] THEN #3000 = ...: a program that cuts continues after it."""
        _, end = parse_value(text, at)
        then = _THEN.match(text, end)
        if then is None or then[1] or not _ALARM.match(text, then.end()):
            return False
        what = "an alarm on what only the machine knows: it is taken not to be raised"
        self.report(Problem("I213", self._word(index), what), index)
        return True

    def _next_program(self, index: int) -> int:
        """A line with an O number: a subprogram that runs into it has no M99."""
        if self.calls and any(text.strip(" \t%") for text in self.bare[self.calls[-1].start + 1 : index]):
            self.report(Problem("E415", None, NEVER), self.calls[-1].start)
            return -index
        if not self.calls and self.starts.index(index) > 0:
            self.report(Problem("W401", self._word(index), NEXT_PROGRAM), index)
            return -index
        return self.run(index, index + 1)

    def _value(self, text: str, at: int) -> tuple[float, int]:
        """Value of an expression; a comparison with #0 asks whether the variable was ever set, and null is not 0."""
        node, end = parse_value(_NULL.sub(self._known, text), at)
        return evaluate(node, self.memory), end

    def _known(self, hit: re.Match[str]) -> str:
        known = int(hit[1]) in self.memory
        if not hit[3] and (known or int(hit[1]) >= FAMILY_FREE):
            return hit[0]
        equal = hit[2].upper() == "EQ"
        holds = known != equal if hit[3] else not equal
        return ("1 EQ 1" if holds else "1 EQ 0").ljust(len(hit[0]))

    def _section(self, index: int, stop: int) -> tuple[int, int]:
        place = bisect_left(self.starts, index + 1)
        begin = self.starts[place - 1] if place else 0
        return begin, self.starts[place] if place < len(self.starts) else stop

    def _line_of(self, index: int, number: int, stop: int) -> int:
        begin, end = self._section(index, stop)
        for k in chain(range(index + 1, end), range(begin, index + 1)):
            found = _NUMBER.match(self.bare[k])
            if found and int(found[1]) == number:
                return k
        raise NoValueError(f"there is no line N{number} in this program")

    def _goto(self, index: int, value: float, stop: int) -> int:
        if value != int(value) or value <= 0.0:
            raise NoValueError(f"GOTO {value:g}: the number of a line is expected")
        return self._line_of(index, int(value), stop)

    def _partner(self, lines: range, label: int, way: int, missing: str) -> int:
        """The other end of a loop with this label, past those inside; way : 1 to its END, -1 to its DO."""
        depth = 0
        for k in lines:
            text = self.bare[k]
            hits = _END.match(text, _after_head(text)), _LOOP.search(text)
            ends, opens = (hit is not None and int(hit[1]) == label for hit in hits)
            depth += opens - ends if way > 0 else 1 if ends else -opens
            if depth < 0:
                return k
        raise NoValueError(missing)

    # ---- calls ----

    def _called(self, index: int, stop: int) -> int:
        """M97, M98, M99, G65 beside other words: those run first."""
        lexed = lex_line(self.lines[index])
        values: dict[str, float] = {}
        given: list[tuple[str, float]] = []
        code, word, taken = "", None, list[Word]()
        for item in lexed.words:
            value = item.value or 0.0
            if item.expression is not None:
                value = evaluate(item.expression, self.memory)
            name = f"{item.letter}{value:g}"
            if name in ("M97", "M98", "M99", "M198", "G65", "G66", "G66.1", "G67"):
                code, word = name, item
                taken.append(item)
            elif item.letter not in "NGM" or code in MACROS:
                values.setdefault(item.letter, value)
                given.append((item.letter, value))
                if code in MACROS or item.letter in "PL":
                    taken.append(item)
        if code in ("", "G67") or lexed.errors:
            self.modal = None if code == "G67" else self.modal
            self.one(index, self.lines[index])
            return index + 1
        if code not in MACROS and len(taken) < len(lexed.words):
            text = self.lines[index]
            for item in taken:
                text = text[: item.col - 1] + " " * item.length + text[item.col - 1 + item.length :]
            self.one(index, text)
            if self.over():
                return index + 1
        if code == "M99":
            return self._return(index, values.get("P"), word, stop)
        number, repeats = values.get("P"), int(values.get("L", 1.0))
        what = ""
        if number is None or number != int(number):
            what = f"{code} without P"
        elif repeats != values.get("L", 1.0) or repeats < 0:
            what = f"{code} L{values['L']:g}: how often it runs is a whole number"
        elif code in ("M98", "M198") and ("Q" in values or "H" in values):
            what = f"{code} with Q or H, a line of the subprogram to begin at, is not supported"
        elif code in MACROS[1:] and self.modal is not None:
            what = f"{code} while another modal macro is in force is not supported: end that one by G67"
        if number is None or what:
            self.report(Problem("E412", word, what), index)
            return index + 1
        target = int(number)
        start = self._line_of(index, target, stop) - 1 if code == "M97" else self._program(target)
        if start is None and code == "M98" and "L" not in values and target > 9999:
            repeats, target = divmod(target, 10000)
            start = self._program(target)
        if start is None:
            kind, what = (
                "W383",
                f"no program O{target} in this file or next to it: its motions are not read",
            )
            if code in MACROS and target in BUILDER:
                what = (
                    f"O{target}, a macro of the machine builder, is not here: it is assumed to move nothing"
                )
                kind = "W382"
            self.report(Problem(kind, word, what, MISSING.format(target)), index)
            return index + 1
        if repeats <= 0:
            return index + 1
        call = Frame(True, start, index + 1, repeats, words=arguments(given) if code in MACROS else None)
        if code in ("G66", "G66.1"):
            self.modal = call, len(self.calls), code == "G66.1"
            return index + 1
        return self._enter(call, word)

    def _return(self, index: int, line: float | None, word: Word | None, stop: int) -> int:
        if not self.calls and line is not None and (at := self._line_of(index, int(line), stop)) > index:
            return at
        if not self.calls:
            what = "M99 starts the main program again, without end: it is read once"
            self.report(Problem("W415", word, what), index)
            return -index - 1
        call = self.calls[-1]
        call.left -= 1
        if self.modal is not None and self.modal[1] == len(self.calls):
            self.modal = None  # of the program that is left
        if call.words is not None:
            self.memory.leave()
        if call.left > 0:
            if call.words is not None:
                self.memory.enter_words(call.words)
            return call.start + 1
        self.calls.pop()
        if line is None:
            return call.back
        return self._line_of(call.back - 1, int(line), self.files.stop(call.back - 1, len(self.lines)))
