"""What a Haas mill does otherwise than Fanuc; source: mill operator's manual of Haas.

G70 I J L, G71 I J K L, G72 I J L   holes of the cycle in force on a circle, an arc, a line
G12, G13 I K Q D L Z F              circular pocket from where the tool is, clockwise or not
G73, G83 I J K                      first peck, how much less each time, the least
G101 X, G100                        mirror at the zero of the part, and its end
G110 to G129                        work offsets G154 P1 to P20
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Final

from vmachining.nc.codes import CYCLES
from vmachining.nc.fanuc_line import Line
from vmachining.nc.fanuc_places import Given, extended
from vmachining.nc.lexer import Word
from vmachining.nc.state import State

if TYPE_CHECKING:
    from vmachining.nc.fanuc import Translator

PATTERNS: Final = (700, 710, 720)
MOST: Final = 10_000
"""Holes of a pattern, circles of a pocket: beyond it is a typing error."""


def code(translator: Translator, word: Word, number: int, line: Line, given: Given, drop: set[str]) -> bool:
    """A G code that these controls have for themselves; False for another. Patterns and pockets are left to `expand`."""
    places = translator.places
    if 1100 <= number <= 1290 and number % 10 == 0:
        line.before.append(lambda state: extended(state, number // 10 - 109))
    elif number == 1010:
        zero = {letter: (w, 0.0) for letter, (w, _) in given.items() if letter in "XYZ"}
        drop.update(places.mirror(zero, line))
    elif number == 1000:
        if not places.end("mirror", line, given):
            translator.say("G100", word, f"{word.text}: nothing is mirrored")
        drop.update("XYZ")
    elif (number in PATTERNS and "L" in given) or number in (120, 130):
        translator.repeated = word, number, {letter: value for letter, (_, value) in given.items()}
    else:
        return False
    return True


def pecks(translator: Translator, line: Line, active: int) -> None:
    """I J K of a peck cycle are not repetitions: they go to the core as a peck that shrinks."""
    if active not in (730, 830):
        for letter in "IJK":
            if letter in line.letters():
                like = line.word(letter)
                translator.say(
                    f"cycle {letter}",
                    like,
                    f"{like.text}: how this cycle retracts or shifts, which is ignored",
                )
        line.drop("IJK")
        return
    first, less, least = (line.value(letter) for letter in "IJK")
    line.drop("JK")
    if first:
        like = line.word("I")
        line.drop("IQ")
        line.add("Q", first, like)
        line.before.append(
            lambda state: setattr(
                state, "shrink", ((less or 0.0) * state.scale, (least or 0.0) * state.scale)
            )
        )
    elif {730, 830} & line.codes("G"):
        line.before.append(lambda state: setattr(state, "shrink", None))


def expand(translator: Translator, line: Line, state: State) -> None:
    """A pattern of holes or a pocket becomes blocks before its own, which keeps what is not a place."""
    assert translator.repeated is not None
    word, number, given = translator.repeated
    translator.repeated = None
    codes = line.codes("G")
    absolute = 900 in codes or (state.absolute and 910 not in codes)
    here = [v / state.scale for v in state.program]
    start = [
        here[k] if (v := line.value(c)) is None else v + (0.0 if absolute else here[k])
        for k, c in enumerate("XY")
    ]
    at = list(here[:2])

    def to(x: float, y: float) -> list[tuple[Word, float]]:
        """The words that lead to a place."""
        out = [
            (word._replace(letter="X"), x if absolute else x - at[0]),
            (word._replace(letter="Y"), y if absolute else y - at[1]),
        ]
        at[:] = x, y
        return out

    if number in PATTERNS:
        cycle = next(iter(codes & CYCLES), state.motion)
        if cycle not in CYCLES:
            line.refuse(
                word,
                f"{word.text} repeats a canned cycle, but none is active",
                "program the cycle before it, with L0",
            )
            return
        places, count = list(_holes(number, given, start)), given.get("L", 0.0)
        line.drop("XY")
        if not 0 < len(places) <= MOST or count != int(count):
            line.refuse(word, f"{word.text} needs L, the number of holes")
            return
        needs = {700: "I", 710: "IK", 720: "I"}[number]
        if state.plane.name != "xy" or not all(given.get(letter) for letter in needs):
            line.refuse(word, f"{word.text} needs {' and '.join(needs)}, in G17")
            return
        for x, y in places[:-1]:
            line.ahead.append([*zip(line.words, line.values, strict=True), *to(x, y)])
            line.drop("MST")
        for like, value in to(*places[-1]):
            line.keep(like, value)
        return
    _pocket(translator, word, number == 130, line, given, state, start, to)


def _holes(number: int, given: Mapping[str, float], start: list[float]) -> Iterator[tuple[float, float]]:
    """Their places, in program units."""
    size, angle, step, count = (given.get(letter, 0.0) for letter in "IJKL")
    for k in range(int(count) if 0.0 < count <= MOST else 0):
        if number == 720:
            turn, reach = angle, size * k
        else:
            turn, reach = angle + (360.0 / count if number == 700 else step) * k, size
        yield start[0] + reach * math.cos(math.radians(turn)), start[1] + reach * math.sin(math.radians(turn))


def _pocket(
    translator: Translator,
    word: Word,
    ccw: bool,
    line: Line,
    given: Mapping[str, float],
    state: State,
    start: list[float],
    to: object,
) -> None:
    """Down, out by a half circle to +X, full circles joined by half circles, and back to the middle by a half circle."""
    assert callable(to)
    entry, register = state.table.get(state.tool), given.get("D")
    radius = 0.0
    wear = translator.settings.control.compensation == "wear"
    own = translator.own_radius(int(register), entry) if register else None
    if register is None or (register and entry is None and not wear and own is None):
        line.refuse(
            word,
            f"{word.text}: the tool radius is not known",
            "give D and a tool table; D0: I and K are those of the tool centre",
        )
        return
    if register:
        own = 0.0 if own is None and wear else own
        radius = (
            own / state.scale
            if own is not None
            else (entry.diameter_mm if entry is not None else 0.0) / 2.0 / state.scale
        )
    first, last, step = given.get("I"), given.get("K"), given.get("Q")
    loops = given.get("L", 1.0)
    if first is None or state.plane.name != "xy":
        line.refuse(word, f"{word.text} needs I, a radius, in G17")
        return
    if (last is None) != (not step) or (step or 0.0) < 0.0 or (last is not None and last < first):
        line.refuse(
            word, f"{word.text} needs K, the last radius, and Q, the step from I to K, or none of them"
        )
        return
    if loops < 1.0 or loops != int(loops):
        line.refuse(word, f"{word.text} L{loops:g}: how often it runs is a whole number")
        return
    sizes, size = list[float](), first
    while last is not None and step and step > 0.0 and size < last - 1e-9 and len(sizes) < MOST:
        sizes.append(size - radius)
        size += step
    sizes.append((first if last is None else last) - radius)
    if not 0.0 < sizes[0] <= sizes[-1] or len(sizes) >= MOST:
        line.refuse(word, f"{word.text}: radii of {first:g} to {last or first:g} leave no room for the tool")
        return
    what = f"{word.text}: where the control leaves the middle is its own; here by a half circle towards +X"
    translator.say("pocket", word, what, "I213")
    arc = 3.0 if ccw else 2.0
    depth = [(w, v) for w, v in zip(line.words, line.values, strict=True) if w.letter in "ZF"]
    absolute = state.absolute and 910 not in line.codes("G")
    keep = [
        (w, v) for w, v in zip(line.words, line.values, strict=True) if w.letter == "G" or w.letter in "MS"
    ]
    x, y = start
    g = word._replace(letter="G")
    if keep or line.letters() & set("XY"):
        line.ahead.append([*keep, *([(g, 0.0), *to(x, y)] if line.letters() & set("XY") else [])])
    for k in range(min(int(loops), MOST)):
        if depth and not (k and absolute):
            line.ahead.append([(g, 1.0), *depth])
        side, reach = 1.0, 0.0
        for size in sizes:
            swing = (reach + size) / 2.0  # from the other side, or the middle, to this one
            line.ahead.append([(g, arc), *to(x + side * size, y), (word._replace(letter="I"), side * swing)])
            line.ahead.append([(g, arc), *to(x + side * size, y), (word._replace(letter="I"), -side * size)])
            side, reach = -side, size
        line.ahead.append([(g, arc), *to(x, y), (word._replace(letter="I"), side * reach / 2.0)])
    line.drop("GXYZFMSP")
