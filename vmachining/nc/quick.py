"""The short cut: blocks that only move, in the order of words that posts write, with the result of the long way.

    [N] [G0 G1 G2 G3] [X] [Y] [Z] [A] [B] [C] [I] [J] [K] [F] [comment]

Under cutter compensation the move goes through it (`offset`). What needs more than the modal state (turned coordinates,
centres by R, the first word of a rotary axis, an error, a warning about the arc) is left to the long way.

Blocks that say again what an earlier one said: holes of canned cycles at other places, the calls and ends of cycles.

    [N] [G73 G74 G80 to G89 G90 G98 G99 ...] [X] [Y] [Z R Q P F L ...]

The long way of the first one is kept as a pattern of motions with the modal state before it; a later block with the same
words but X and Y, from an equal state and level, makes the same motions over its own place. Every number is computed as on the
long way, so that nothing changes but the time it takes. A pattern is not kept where the block said something, turned an
axis or moved to a third place.

Lines with parameters and expressions: those that differ in their numbers only share one compiled function.

A line is lexed and parsed the long way once; what its numbers become is written as a Python function of them. Where a value
does not exist, or a line holds more than `BLOCK`, the long way is taken, which says why.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import fields
from operator import attrgetter
from typing import Any, Final, NamedTuple

from vmachining.nc.expressions import BINARY, FANUC, FUNCTIONS, Expression, Name, NoValueError
from vmachining.nc.fanuc_variables import FAMILY_FREE
from vmachining.nc.frames import PLANES, check_center, is_rounded
from vmachining.nc.lexer import MAX_VALUE, Assignment, Word, lex_line
from vmachining.nc.model import ArcError, CompensationError, Motion, Move, add
from vmachining.nc.run import SLOWEST_MM_MIN
from vmachining.nc.state import LAST_FREE, ORIGIN, Memory, State

_N = r"([+-]?(?:[0-9]{1,9}(?:\.[0-9]*)?|\.[0-9]+))[ \t]*"
BLOCK: Final = re.compile(
    r"(?:[Nn]([0-9]{1,9})[ \t]*)?(?:[Gg]0?([0-3])[ \t]*)?"
    rf"(?:[Xx][ \t]*{_N})?(?:[Yy][ \t]*{_N})?(?:[Zz][ \t]*{_N})?(?:(?=[AaBbCcIiJjKk])(?:[Aa][ \t]*{_N})?(?:[Bb][ \t]*{_N})?"
    rf"(?:[Cc][ \t]*{_N})?(?:[Ii][ \t]*{_N})?(?:[Jj][ \t]*{_N})?(?:[Kk][ \t]*{_N})?)?(?:[Ff][ \t]*{_N})?"
    r"(?:\((?![ \t]*[Aa][Bb][Oo][Rr][Tt])[^()]*\)[ \t]*)?"
)

Groups = tuple[str | float | None, ...]

_CODES: Final = {"0": 0, "1": 10, "2": 20, "3": 30, "00": 0, "01": 10, "02": 20, "03": 30}
_MOTIONS: Final = {0: Motion.RAPID, 10: Motion.LINEAR, 20: Motion.ARC_CW, 30: Motion.ARC_CCW}
_THREE_AXES: Final = tuple(Move._field_defaults.values())
"""The fields of a move that three axes do not use."""

CHANGED: Final = attrgetter("motion", "feed", "sim", "machine", "rotary")
"""What a move changes of a state."""

_make = tuple.__new__  # Move(...) itself takes twice as long


def quick_move(state: State, words: Groups, line: int, n: int | None, arcs: bool) -> Move | None:
    """The move of a block; the state after it. None, and nothing changed, where it is for the long way.

    state : `plain`. words : of `BLOCK`, the code as text. arcs : I J K count from the start.
    """
    _, code, x, y, z, a, b, c, i, j, k, f, = words  # fmt: skip
    motion = state.motion if code is None else _CODES.get(code)  # type: ignore[arg-type]
    if state.cycle is not None:  # G0 to G3 end it
        return None
    turning = a is not None or b is not None or c is not None
    if motion not in _MOTIONS or not (x is not None or y is not None or z is not None or turning):
        return None
    feed, scale, mode, start = state.feed, state.scale, state.feed_mode, state.sim
    if mode == 940:
        if f is not None:
            feed = float(f) * scale
        if not (feed and feed > 0.0) and (motion or f is not None):
            return None
    elif mode == 930 and motion in (0, 10) and (f is not None) == (motion == 10):
        feed = float(f) if f is not None else None
        if feed is not None and not feed > 0.0:
            return None
    else:
        return None
    if motion and state.direction == 0 and not state.warned_stopped:
        return None
    back = state.to_sim
    ox, oy, oz = back if state.absolute else start
    end = (
        start[0] if x is None else float(x) * scale + ox,
        start[1] if y is None else float(y) * scale + oy,
        start[2] if z is None else float(z) * scale + oz,
    )
    program = end if back == ORIGIN else (end[0] - back[0], end[1] - back[1], end[2] - back[2])
    center = None
    if motion >= 20:
        plane = state.plane
        centre = {"I": i, "J": j, "K": k}
        first, second = (centre[letter] for letter in plane.words)
        if turning or not arcs or state.absolute_center:
            return None
        if centre[plane.wrong] is not None or first is second is None:
            return None
        u, v = plane.first, plane.second
        begin = start[u] - back[u], start[v] - back[v]
        middle = begin[0] + float(first or 0.0) * scale, begin[1] + float(second or 0.0) * scale
        try:
            if is_rounded(check_center(begin, (program[u], program[v]), middle, scale != 1.0)):
                return None
        except ArcError:
            return None
        center = middle[0] + back[u], middle[1] + back[v]
    elif i is not None or j is not None or k is not None:
        return None
    along = feed
    if mode == 930 and feed is not None:
        along = max(feed * math.dist(start, end), SLOWEST_MM_MIN)
    rest = _THREE_AXES if not state.coolant else (*_THREE_AXES[:-1], state.coolant)
    if turning or state.rotary or state.centred:
        before = after = state.rotary
        if state.rotary_work or state.rotary_g92:
            return None
        duration, turned = None, 0.0
        if turning:
            after = dict(before)
            for axis, value in (("a", a), ("b", b), ("c", c)):
                if value is not None:
                    old = before.get(axis)
                    if old is None:
                        return None
                    new = after[axis] = float(value) + (0.0 if state.absolute else old)
                    turned = max(turned, abs(new - old))
        if turned > 0.0 and motion and feed and along:
            if mode == 930:
                duration = 60.0 / feed
            elif start == end:
                duration = 60.0 * turned / (along / scale)
        rest = (None, None, before, after, after, state.centred, duration, *rest[7:])
        state.rotary = after
    state.motion, state.feed, state.sim = motion, feed, end
    lag = state.lag
    state.machine = machine = end if lag == ORIGIN else add(end, lag)
    move: Move = _make(
        Move,
        (
            line, n, _MOTIONS[motion], start, end, state.plane.name, center, 1 if center is not None else 0,
            along if motion else None, state.tool, state.speed * state.direction, 0.0, machine, program, *rest,
        ),
    )  # fmt: skip
    return move


def offset(state: State, move: Move, before: tuple[Any, ...]) -> list[Move] | None:
    """What cutter compensation makes of a move. None, and the state as `before`, where it has to say something."""
    assert state.compensation is not None
    try:
        step = state.compensation.accept(move)
    except CompensationError:
        step = None
    if step is None or step.warnings:
        state.motion, state.feed, state.sim, state.machine, state.rotary = before
        return None
    state.compensation = step.after
    return step.moves


_ANY = r"[+-]?(?:[0-9]{1,9}(?:\.[0-9]*)?|\.[0-9]+)[ \t]*"
AGAIN: Final = re.compile(
    r"(?:[Nn]([0-9]{1,9})[ \t]*)?((?:[Gg](?:7[34]|8[0-689]|9[089])(?![0-9.])[ \t]*)*)"
    rf"(?:[Xx][ \t]*{_N})?(?:[Yy][ \t]*{_N})?((?:[ZzRrQqPpFfLl][ \t]*{_ANY})*)"
)

MOST_PATTERNS: Final = 256
"""Patterns that are kept."""

_FIELDS: Final = tuple(item.name for item in fields(State) if item.name not in ("sim", "machine"))
_MODES: Final = attrgetter(*_FIELDS)
_PLAIN: Final = frozenset({Motion.RAPID, Motion.LINEAR, Motion.DWELL})


class _Step(NamedTuple):
    """One motion: whether it starts and ends over the new place, its heights, and the fields that stay."""

    starts: bool
    ends: bool
    heights: tuple[float, float, float, float]
    motion: Motion
    middle: tuple[Any, ...]
    rest: tuple[Any, ...]


class _Pattern(NamedTuple):
    """modes : of the state before. level : simulation and machine. changes : of the modal state, by name."""

    modes: tuple[Any, ...]
    level: tuple[float, float]
    steps: tuple[_Step, ...]
    changes: tuple[tuple[str, Any], ...]
    height: tuple[float, float]


class Repeated:
    """Patterns by the words of a block without its place."""

    def __init__(self) -> None:
        self.patterns: dict[tuple[str, str, bool, bool], _Pattern] = {}

    def moves(
        self, state: State, words: tuple[str | None, ...], line: int, n: int | None
    ) -> list[Move] | None:
        """The motions of a block, with the state after it; None, and nothing changed, where no pattern fits."""
        _, lead, x, y, tail = words
        assert lead is not None and tail is not None
        pattern = self.patterns.get((lead, tail, x is None, y is None))
        if pattern is None or _MODES(state) != pattern.modes:
            return None
        sim, machine = state.sim, state.machine
        if (sim[2], machine[2]) != pattern.level:
            return None
        made: list[Move] = []
        if x is not None or y is not None:
            tx, ty, _ = state.to_sim
            mx, my, _ = state.to_machine
            scale = state.scale
            u = machine[0] - mx if x is None else float(x) * scale
            v = machine[1] - my if y is None else float(y) * scale
            new, there = (u + tx, v + ty), (u + mx, v + my)
            seen = there[0] - mx, there[1] - my
            old, was = (sim[0], sim[1]), (machine[0] - mx, machine[1] - my)
            plane = state.plane.name
            over, aside = (new, there, seen), (old, (machine[0], machine[1]), was)
            for starts, ends, (low, high, deep, shown), motion, middle, rest in pattern.steps:
                end, place, view = over if ends else aside
                begin = new if starts else old
                made.append(_make(Move, (
                    line, n, motion, (*begin, low), (*end, high), plane, *middle, (*place, deep), (*view, shown), *rest,
                )))  # fmt: skip
            state.sim, state.machine = (*new, pattern.height[0]), (*there, pattern.height[1])
        for name, value in pattern.changes:
            setattr(state, name, value)
        return made

    def keep(self, words: tuple[str | None, ...], before: State, after: State, moves: list[Move]) -> None:
        """Keep what a block did, if it is a pattern. The block said nothing, and `before` is not changed any more."""
        _, lead, x, y, tail = words
        assert lead is not None and tail is not None
        old, new = before.sim[:2], after.sim[:2]
        placed = x is not None or y is not None
        if (
            not (before.plain and after.plain and before.absolute and after.absolute)
            or before.plane is not PLANES[170] or placed != bool(moves)
            or not (lead or placed) or (old == new) == placed or (not placed and (lead == "" or before.sim != after.sim))
        ):  # fmt: skip
            return
        steps = []
        for move in moves:
            begin, end = move.start[:2], move.end[:2]
            if (
                move.motion not in _PLAIN
                or move.rotary_start != move.rotary_deg
                or not {begin, end} <= {old, new}
            ):
                return
            heights = move.start[2], move.end[2], move.end_machine[2], move.end_program[2]
            steps.append(_Step(begin == new, end == new, heights, move.motion, move[6:12], move[14:]))
        modes, later = _MODES(before), _MODES(after)
        changes = tuple((name, b) for name, a, b in zip(_FIELDS, modes, later, strict=True) if a != b)
        if len(self.patterns) >= MOST_PATTERNS:
            self.patterns.clear()
        self.patterns[lead, tail, x is None, y is None] = _Pattern(
            modes, (before.sim[2], before.machine[2]), tuple(steps), changes, (after.sim[2], after.machine[2])
        )


_NUMBER: Final = re.compile(r"([0-9]+\.?[0-9]*|\.[0-9]+)")
_LETTERS: Final = "NGXYZABCIJKF"
_NATIVE: Final = ("+", "-", "*")
MOST: Final = 5000
"""Templates that are kept; a program has some dozen, a damaged one may have as many as lines."""

Compiled = Callable[
    [list[float], Callable[[float], float], dict[str, float]],
    tuple[tuple[float | None, ...], tuple[Any, ...]],
]


def _whole(value: float) -> int:
    number = int(value)
    if number != value:
        raise _LongWayError
    return number


_NAMES: Final[tuple[dict[str, Any], ...]] = tuple(
    {
        "__builtins__": {},
        "binary": {op: function for op, (_, function) in BINARY.items()},
        "call": {**functions, "ATAN": lambda y, x: math.degrees(math.atan2(y, x))},
        "whole": _whole,
    }
    for functions in (FUNCTIONS, FANUC)
)
"""All that the source of a line can name; it is made of parsed nodes, never of text of the program."""


class _LongWayError(Exception):
    """The line is for the long way."""


class Templates:
    """The functions of the lines seen so far, for one memory."""

    def __init__(self, memory: Memory) -> None:
        self.memory = memory
        self.known: dict[tuple[str, ...], tuple[Compiled, int] | None] = {}
        self.limit = limit = FAMILY_FREE if memory.family else LAST_FREE + 1
        numbers = memory.values

        def read(value: float) -> float:
            number = int(value)
            if number != value or not 0 < number < limit:
                raise _LongWayError
            return numbers[number] if memory.family else numbers.get(number, 0.0)

        self.read = read

    def words(self, line: str) -> tuple[tuple[Any, ...], tuple[tuple[str | int, float], ...]] | None:
        """Values of a line in the order of `quick.BLOCK`, its assignments; None for the long way."""
        parts = _NUMBER.split(line)
        key = tuple(parts[::2])
        try:
            known = self.known[key]
        except KeyError:
            known = None
            if len(self.known) < MOST:
                known = self.known[key] = _compiled(line, parts[1::2], self.memory.family)
        if known is None:
            return None
        function, code = known
        try:
            values, writes = function(list(map(float, parts[1::2])), self.read, self.memory.names)
            for value in values:
                if value is not None and not -MAX_VALUE <= value <= MAX_VALUE:
                    return None
            for target, value in writes:
                if not (
                    -math.inf < value < math.inf and (isinstance(target, str) or 0 < target < self.limit)
                ):
                    return None
        except (_LongWayError, NoValueError, OverflowError, KeyError, ValueError):
            return None
        number = None
        if values[0] is not None:
            number = parts[1]
            if len(number) > 9 or "." in number:
                return None
        return (number, None if code < 0 else parts[2 * code + 1], *values[2:]), writes


def _compiled(line: str, numbers: list[str], family: bool) -> tuple[Compiled, int] | None:
    """The function of a line, and which of its numbers is the G code (-1: none)."""
    if family and "ROUND" in line.upper():  # in a word it goes to least increments
        return None
    lexed = lex_line(line)
    letters = [word.letter for word in lexed.words]
    if (
        lexed.errors or lexed.comments or lexed.label or lexed.block_delete or lexed.percent
        or len(set(letters)) < len(letters) or not set(letters) <= set(_LETTERS)
    ):  # fmt: skip
        return None
    written, code = iter(range(len(numbers))), -1
    words, writes = dict[str, str](), list[str]()
    try:
        items: list[Word | Assignment] = [*lexed.words, *lexed.assignments]
        for item in sorted(items, key=lambda item: item.col):
            if isinstance(item, Assignment):
                target = repr(item.target.name)
                if item.target.name is None:
                    assert item.target.number is not None
                    target = f"whole({_source(item.target.number, written, numbers)})"
                elif item.target.name.startswith("_"):
                    return None
                writes.append(f"({target}, {_source(item.value, written, numbers)}),")
                continue
            if item.letter == "N" and not item.text[1:].lstrip(" \t")[:1].isdigit():
                return None  # N[1], N-1: no number of a block
            if item.letter == "G":
                code = next(written)
                if item.expression is not None or "-" in item.text or numbers[code] not in _CODES:
                    return None
                words["G"] = "None"
            else:
                node = item.expression or Expression("number", abs(item.value or 0.0))
                sign = "-" if item.expression is None and "-" in item.text else ""
                words[item.letter] = sign + _source(node, written, numbers)
    except (_LongWayError, StopIteration):
        return None
    if next(written, None) is not None or ("N" in words and line.lstrip(" \t")[:1] not in ("N", "n")):
        return None
    values = ", ".join(words.get(letter, "None") for letter in _LETTERS)
    made: Compiled = eval(f"lambda n, read, names: (({values}), ({''.join(writes)}))", _NAMES[family])
    return made, code


def _source(node: Expression, written: Iterator[int], numbers: list[str]) -> str:
    """Source of an expression, whose numbers stand in the line in the order in which they are met here."""
    if node.op == "number":
        place = next(written)
        if float(numbers[place]) != node.number:
            raise _LongWayError
        return f"n[{place}]"
    if node.op == "parameter":
        name: Name | None = node.name
        assert name is not None
        if name.number is not None:
            return f"read({_source(name.number, written, numbers)})"
        if name.name is None or name.name.startswith("_"):
            raise _LongWayError
        return f"names[{name.name!r}]"
    if node.op == "exists":
        raise _LongWayError
    args = [_source(arg, written, numbers) for arg in node.args]
    if node.op == "negative":
        return f"(-{args[0]})"
    if node.op in _NATIVE:
        return f"({args[0]} {node.op} {args[1]})"
    if node.op in BINARY:
        return f"binary[{node.op!r}]({args[0]}, {args[1]})"
    if node.op == "ATAN":
        return f"call['ATAN']({args[0]}, {args[1]})"
    return f"call[{node.op!r}]({args[0]})"
