"""Canned cycles of the Fanuc family brought into the words of the core: repetitions, words of the cycle before.

A Haas mill has its own (source: its operator's manual):

G70 I J L, G71 I J K L, G72 I J L   holes of the cycle in force on a circle, an arc, a line
G12, G13 I K Q D L Z F              circular pocket from where the tool is, clockwise or not
G73, G83 I J K                      first peck, how much less each time, the least
G101 X, G100                        mirror at the zero of the part, and its end
G110 to G129                        work offsets G154 P1 to P20
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from vmachining.nc.block import CYCLES
from vmachining.nc.fanuc_line import Line, Words
from vmachining.nc.lexer import Word
from vmachining.nc.state import State

if TYPE_CHECKING:
    from vmachining.nc.fanuc import Translator

PATTERNS: Final = (700, 710, 720)
MOST: Final = 10_000
"""Holes of a pattern, circles of a pocket: beyond it is a typing error."""


def haas_code(translator: Translator, word: Word, number: int, line: Line) -> bool:
    """A G code that these controls have for themselves; False for another. Patterns and pockets are left to `expand`."""
    places = translator.places
    if 1100 <= number <= 1290 and number % 10 == 0:
        line.choose(line.before, 100000 + number // 10 - 109)
    elif number == 1010:
        places.mirror(dict.fromkeys(line.given.keys() & set("XYZ"), 0.0), line)
        line.taken |= set("XYZ")
    elif number == 1000:
        if not places.end("mirror", line):
            translator.say("G100", word, f"{word.text}: nothing is mirrored")
        line.taken |= set("XYZ")
    elif (number in PATTERNS and "L" in line.given) or number in (120, 130):
        translator.repeated = word, number
    else:
        return False
    return True


def pecks(translator: Translator, line: Line, active: int) -> None:
    """I J K of a peck cycle are not repetitions: they go to the core as a peck that shrinks."""
    if active not in (730, 830):
        for like, _ in line.only("IJK"):
            what = f"{like.text}: how this cycle retracts or shifts, which is ignored"
            translator.say(f"cycle {like.letter}", like, what)
        line.drop("IJK")
        return
    first, less, least = (line.value(letter) for letter in "IJK")
    line.drop("JK")
    if first:
        like, scale = line.word("I"), line.state.scale
        line.drop("IQ")
        line.add("Q", first, like)
        line.become(line.before, shrink=((less or 0.0) * scale, (least or 0.0) * scale))
    elif {730, 830} & line.now():
        line.become(line.before, shrink=None)


class _Way:
    """Blocks that lead to one place after another, in the coordinates or steps of a line."""

    def __init__(self, word: Word, line: Line) -> None:
        self.word, self.line = word, line
        codes, state = line.now(), line.state
        self.absolute = 900 in codes or (state.absolute and 910 not in codes)
        self.at = x, y = state.program[0] / state.scale, state.program[1] / state.scale
        back = (0.0, 0.0) if self.absolute else (x, y)
        u, v = line.value("X"), line.value("Y")
        self.start = x if u is None else u + back[0], y if v is None else v + back[1]

    def to(self, x: float, y: float) -> Words:
        u, v = (x, y) if self.absolute else (x - self.at[0], y - self.at[1])
        self.at = x, y
        return [(self.word._replace(letter="X"), u), (self.word._replace(letter="Y"), v)]


def expand(translator: Translator, line: Line) -> None:
    """A pattern of holes or a pocket becomes blocks before its own, which keeps what is not a place."""
    assert translator.repeated is not None
    word, number = translator.repeated
    translator.repeated = None
    way = _Way(word, line)
    if number not in PATTERNS:
        _pocket(translator, way, ccw=number == 130)
        return
    if next(iter(line.now() & CYCLES), line.state.motion) not in CYCLES:
        what = f"{word.text} repeats a canned cycle, but none is active"
        line.refuse(word, what, "program the cycle before it, with L0")
        return
    places, count = list(_holes(number, line, way.start)), line.get("L")
    line.drop("XY")
    needs = {700: "I", 710: "IK", 720: "I"}[number]
    if not 0 < len(places) <= MOST or count != int(count):
        line.refuse(word, f"{word.text} needs L, the number of holes")
    elif line.state.plane.name != "xy" or not all(map(line.get, needs)):
        line.refuse(word, f"{word.text} needs {' and '.join(needs)}, in G17")
    else:
        for x, y in places[:-1]:
            line.ahead.append([*line.pairs, *way.to(x, y)])
            line.drop("MST")
        line.pairs += way.to(*places[-1])


def _holes(number: int, line: Line, start: tuple[float, float]) -> Iterator[tuple[float, float]]:
    """Their places, in program units."""
    size, angle, step, count = map(line.get, "IJKL")
    for k in range(int(count) if 0.0 < count <= MOST else 0):
        if number == 720:
            turn, reach = angle, size * k
        else:
            turn, reach = angle + (360.0 / count if number == 700 else step) * k, size
        yield start[0] + reach * math.cos(math.radians(turn)), start[1] + reach * math.sin(math.radians(turn))


def _pocket(translator: Translator, way: _Way, *, ccw: bool) -> None:
    """Down, out by a half circle to +X, full circles joined by half circles, and back to the middle by a half circle."""
    word, line, (x, y) = way.word, way.line, way.start
    state, register, last, step = line.state, line.get("D"), line.get("K"), line.get("Q")
    entry, first, loops = state.table.get(state.tool), line.get("I"), line.get("L", 1.0)
    wear = translator.settings.control.compensation == "wear"
    own = translator.own_radius(int(register), entry) if register else 0.0
    if "D" not in line.given or (entry is None and own is None and not wear):
        what = f"{word.text}: the tool radius is not known"
        line.refuse(word, what, "give D and a tool table; D0: I and K are those of the tool centre")
        return
    if own is None:
        own = 0.0 if wear or entry is None else entry.diameter_mm / 2.0
    radius, what = own / state.scale, ""
    if "I" not in line.given or state.plane.name != "xy":
        what = f"{word.text} needs I, a radius, in G17"
    elif ("K" in line.given) != bool(step) or step < 0.0 or (step and last < first):
        what = f"{word.text} needs K, the last radius, and Q, the step from I to K, or none of them"
    elif loops < 1.0 or loops != int(loops):
        what = f"{word.text} L{loops:g}: how often it runs is a whole number"
    if what:
        line.refuse(word, what)
        return
    sizes, size = list[float](), first
    while step and size < last - 1e-9 and len(sizes) < MOST:
        sizes.append(size - radius)
        size += step
    sizes.append((last if step else first) - radius)
    if not 0.0 < sizes[0] <= sizes[-1] or len(sizes) >= MOST:
        line.refuse(word, f"{word.text}: radii of {first:g} to {last or first:g} leave no room for the tool")
        return
    what = f"{word.text}: the control chooses how to leave the centre; here on a half circle towards +X"
    translator.say("pocket", word, what, "I213")
    depth, keep, placed = line.only("ZF"), line.only("GMS"), line.letters() & set("XY")
    g = word._replace(letter="G")

    def bend(to: float, centre: float) -> None:
        """An arc to x + `to`, with its centre so far from where it begins."""
        arc = (g, 3.0 if ccw else 2.0), *way.to(x + to, y), (word._replace(letter="I"), centre)
        line.ahead.append(list(arc))

    if keep or placed:
        line.ahead.append([*keep, *([(g, 0.0), *way.to(x, y)] if placed else [])])
    for k in range(min(int(loops), MOST)):
        if depth and not (k and state.absolute and 910 not in line.now()):
            line.ahead.append([(g, 1.0), *depth])
        side, reach = 1.0, 0.0
        for size in sizes:
            bend(side * size, side * (reach + size) / 2.0)  # from the other side, or the middle, to this one
            bend(side * size, -side * size)
            side, reach = -side, size
        bend(0.0, side * reach / 2.0)
    line.drop("GXYZFMSP")


CYCLE_WORDS: Final = {
    810: "", 820: "P", 730: "Q", 830: "Q", 740: "P", 840: "P", 850: "", 860: "P", 890: "P", 760: "P", 870: "PQ", 880: "P",
}  # fmt: skip

INCH: Final = 25.4
TAPS: Final = {84.2: 84.0, 84.3: 74.0, 77.0: 84.0, 78.0: 74.0, 284.0: 84.0, 274.0: 74.0}
"""Rigid tapping of Fanuc 15 format, of Brother, of Okuma."""

BORING: Final = {
    760: "G76: fine boring; the shift at the bottom, away from the wall, is left out",
    870: "G87: back boring; the shift goes along +X, as the control is delivered",
    880: "G88: the retract by hand is taken as a rapid",
}


def taps(block: Words, state: State, variant: str) -> tuple[Words, float]:
    """Rigid taps by other names as G84 and G74, and the pitch of Brother's G77 and G78 in mm: J, or I threads to the inch."""
    if not any(w.letter == "G" and v in TAPS for w, v in block):
        return block, 0.0
    given = {w.letter: v for w, v in block if w.letter != "G"}
    brother = {"Z", "R"} <= set(given) and bool(given.get("I") or given.get("J"))
    out, pitch = Words(), 0.0
    for word, value in block:
        own = value in (77.0, 78.0)
        foreign = (value > 100.0 and variant != "okuma") or (own and not brother)
        if word.letter != "G" or value not in TAPS or foreign:
            out.append((word, value))
            continue
        out.append((word._replace(value=TAPS[value]), TAPS[value]))
        if own:
            pitch = given["J"] * state.scale if given.get("J") else INCH / given["I"]
    return [(w, v) for w, v in out if not pitch or w.letter not in "IJ"], pitch


def holes(translator: Translator, line: Line, claimed: bool) -> None:
    """K as L, words of the cycle before, Q0 and missing P; claimed : another code of the block takes the axis words."""
    state, now = line.state, line.now()
    code = next(iter(now & CYCLE_WORDS.keys()), None)
    active = code if code is not None else state.motion if state.motion in CYCLES else None
    if active is None or claimed:
        return
    has = line.letters()
    if translator.variant == "haas":
        pecks(translator, line, active)
    elif "K" in has and "L" not in has:
        _repeats(translator, line, active)
    elif {"I"} == has & set("IJQ") and now & {730, 830} and (line.value("I") or 0.0) > 0.0:
        like, peck = line.word("I"), line.value("I") or 0.0
        translator.say("cycle I", like, f"{like.text} in a peck cycle without Q: how deep it pecks", "I213")
        line.drop("I")
        line.add("Q", peck, like)
    has = line.letters()
    turning = line.only("ABC")
    if turning and line.value("L") != 0.0:  # to its hole the control moves all axes together
        line.ahead.append([(turning[0][0]._replace(letter="G", value=0.0), 0.0), *turning])
        if state.absolute and 910 not in now:
            line.ahead[-1].extend(line.only("XY"))
        line.drop("ABC")
    held = translator.cycle
    for letter in "ZRQP":
        value = line.value(letter)
        if value is not None:
            held[letter] = value
    if not line.pairs:
        return
    like = line.pairs[-1][0]
    if code is not None:
        _complete(translator, line, code, has)
    allowed = CYCLE_WORDS[next(iter(line.now() & CYCLE_WORDS.keys()), active)]
    for letter in "PQIJ":
        if letter not in allowed and (letter in "PQ" or not line.value(letter)):
            line.drop(letter)
    depth, clear = held.get("Z"), held.get("R")
    if active == 870 and depth is not None and clear is not None and state.absolute and depth <= clear:
        what = "G87 whose Z lies below R: it bores downwards, from R to Z"
        translator.say("G87 down", like, what, "I213")


def _repeats(translator: Translator, line: Line, active: int) -> None:
    """K is a number of holes; where the program has parts of one, its control takes K as the peck, or as a dwell."""
    value, word = line.value("K") or 0.0, line.word("K")
    letter = {730: "Q", 830: "Q"}.get(active, "P" if "P" in CYCLE_WORDS[active] else "")
    line.drop("K")
    if value != int(value) and letter and value > 0.0:
        translator.k_sizes = True
    if translator.k_sizes and letter:
        what = "how deep it pecks" if letter == "Q" else "how long it dwells"
        translator.say(f"K {letter}", word, f"{word.text} does not count holes: K is {what}", "I213")
        line.add(letter, value, word._replace(text=f"{word.text}."))
    elif value != 1.0:
        line.add("L", value, word)


def _complete(translator: Translator, line: Line, code: int, has: set[str]) -> None:
    """What a cycle that is called anew takes from the one before, or does without."""
    held, like, state = translator.cycle, line.pairs[-1][0], line.state
    for letter in "ZR":
        if letter not in has and letter in held:
            line.add(letter, held[letter], like)
    if "R" not in has and "R" not in held and state.absolute:
        level = state.program[state.plane.normal] / state.scale
        what = f"a cycle without R: its clearance plane is where the tool is, {level:g}"
        translator.say("R", like, what, "I213")
        line.add("R", level, like)
    if code in (730, 830) and not line.value("Q") and not held.get("Q"):
        translator.say("Q", like, "a peck cycle without Q, or with Q0, drills in one step", "I213")
        line.replace(code, 810 if "P" not in has else 820)
        line.drop("Q")
    elif code in (730, 830) and "Q" not in has:
        line.add("Q", held["Q"], like)
    if code in (820, 860, 890, 760, 870, 880) and line.value("P") is None:
        line.add("P", held.get("P", 0.0), like._replace(text="P0"))


def dwell(translator: Translator, line: Line) -> None:
    """P counts milliseconds, with a decimal point seconds; G4 X, G4 U and on Okuma G4 F are seconds, as P is there."""
    okuma = translator.variant == "okuma"
    if 40 in line.codes:
        for letter in "XUF" if okuma else "XU":
            value = line.value(letter)
            if value is not None and line.value("P") is None:
                like = line.word(letter)
                line.drop(letter)
                seconds = "." in like.text or okuma or "#" in like.text
                line.add("P", value if seconds else value / 1000.0, like)
                return
    elif not line.now() & CYCLE_WORDS.keys():
        return
    for k, (word, value) in enumerate(line.pairs):
        if word.letter == "P" and "." not in word.text and not okuma:
            line.pairs[k] = word, value / 1000.0
