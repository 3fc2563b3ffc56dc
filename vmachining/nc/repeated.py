"""Blocks that say again what an earlier one said: holes of canned cycles at other places, the calls and ends of cycles.

    [N] [G73 G74 G80 to G89 G90 G98 G99 ...] [X] [Y] [Z R Q P F L ...]

The long way of the first one is kept as a pattern of motions with the modal state before it; a later block with the same
words but X and Y, from an equal state and level, makes the same motions over its own place. Every number is computed as on the
long way, so that nothing changes but the time it takes. A pattern is not kept where the block said something, turned an
axis or moved to a third place.
"""

from __future__ import annotations

import re
from dataclasses import fields
from operator import attrgetter
from typing import Any, Final, NamedTuple

from vmachining.nc.arcs import PLANES
from vmachining.nc.model import Motion, Move
from vmachining.nc.state import State

_N = r"([+-]?(?:[0-9]{1,9}(?:\.[0-9]*)?|\.[0-9]+))[ \t]*"
_ANY = r"[+-]?(?:[0-9]{1,9}(?:\.[0-9]*)?|\.[0-9]+)[ \t]*"
AGAIN: Final = re.compile(
    r"(?:[Nn]([0-9]{1,9})[ \t]*)?((?:[Gg](?:7[34]|8[0-689]|9[089])(?![0-9.])[ \t]*)*)"
    rf"(?:[Xx][ \t]*{_N})?(?:[Yy][ \t]*{_N})?((?:[ZzRrQqPpFfLl][ \t]*{_ANY})*)"
)

MOST: Final = 256
"""Patterns that are kept."""

_FIELDS: Final = tuple(item.name for item in fields(State) if item.name not in ("sim", "machine"))
_MODES: Final = attrgetter(*_FIELDS)
_PLAIN: Final = frozenset({Motion.RAPID, Motion.LINEAR, Motion.DWELL})
_make = tuple.__new__


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
                or begin not in (old, new)
                or end not in (old, new)
                or move.rotary_start != move.rotary_deg
            ):
                return
            heights = move.start[2], move.end[2], move.end_machine[2], move.end_program[2]
            steps.append(_Step(begin == new, end == new, heights, move.motion, move[6:12], move[14:]))
        modes, later = _MODES(before), _MODES(after)
        changes = tuple((name, b) for name, a, b in zip(_FIELDS, modes, later, strict=True) if a != b)
        if len(self.patterns) >= MOST:
            self.patterns.clear()
        self.patterns[lead, tail, x is None, y is None] = _Pattern(
            modes, (before.sim[2], before.machine[2]), tuple(steps), changes, (after.sim[2], after.machine[2])
        )
