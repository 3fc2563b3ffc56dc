"""Which lines of a program run once and in the order of the file, so that a feed can be changed there.

Bodies of subprograms, loops and branches run often, later, or not at all: a modal F written there reaches lines
nobody can tell, so they are left alone; if they change units, G90, G93 or G41, the whole program is. A feed
changed outside must be taken back before such a body starts. Lines from a computed G code, or from modes saved by
M70 or M73, on are left alone too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from vmachining.nc.control import find_structure
from vmachining.nc.lexer import LexedLine
from vmachining.nc.rewrite_pieces import MODE_CHANGES

SAVING = frozenset({70.0, 72.0, 73.0})
PAIRED = frozenset({"sub", "if", "while", "do", "repeat"})


class Regions(NamedTuple):
    """1-based lines. closed : they do not run once in the order of the file. gates : before them the feed in
    force must be the one of the original program."""

    closed: frozenset[int]
    gates: frozenset[int]


def find_regions(lexed: Sequence[LexedLine], first: int, last: int) -> Regions:
    """Regions of lines first..last (1-based)."""
    closed: set[int] = set()
    gates: set[int] = set()
    for number, line in enumerate(lexed[first - 1 : last], first):
        computed = any(word.letter == "G" and word.value is None for word in line.words)
        if computed or any(word.letter == "M" and word.value in SAVING for word in line.words):
            gates.add(number)  # inches or G93 may be in force behind it: nobody knows what F says
            closed.update(range(number, last + 1))
            break
    structure = find_structure([line.text for line in lexed], first - 1, last)
    if structure is None:
        return Regions(frozenset(closed), frozenset(gates))
    for item in structure.items.values():
        if item.kind in PAIRED and item.end >= 0:
            closed.update(range(item.index + 1, item.end + 2))
        if item.kind in PAIRED or item.kind == "call":
            gates.add(item.index + 1)
        if item.kind == "call" and item.label not in structure.subs:
            closed.update(
                range(item.index + 1, last + 1)
            )  # a separate file: what it changes is not seen here
    for number, line in enumerate(lexed[first - 1 : last], first):
        codes = {word.value for word in line.words if word.letter == "M"}
        if None in codes:
            closed.update(range(first, last + 1))  # a computed M98
        if 98.0 not in codes:
            continue
        gates.add(number)
        closed.add(number)
        for word in line.words:
            start = structure.numbers.get(f"{word.value:.0f}") if word.letter == "P" and word.value else None
            if start is None and word.letter == "P":
                closed.update(range(number, last + 1))
            if start is not None:
                closed.update(range(start + 1, _end(lexed, start, last) + 1))
                gates.add(start + 1)
        if any(word.letter == "P" and word.value is None for word in line.words):
            closed.update(range(first, last + 1))  # a computed call may go anywhere
    if any(_changes_modes(lexed[number - 1]) for number in closed):
        closed.update(range(first, last + 1))  # what the lines behind mean depends on what ran
    return Regions(frozenset(closed), frozenset(gates))


def _changes_modes(line: LexedLine) -> bool:
    codes = {word.value for word in line.words if word.letter == "G"}
    return None in codes or not codes.isdisjoint(MODE_CHANGES)


def _end(lexed: Sequence[LexedLine], start: int, last: int) -> int:
    """1-based line of the M99 that ends a subprogram."""
    for number in range(start + 1, last + 1):
        if any(word.letter == "M" and word.value == 99.0 for word in lexed[number - 1].words):
            return number
    return last
