"""Canned cycles of the Fanuc family brought into the words of the core: repetitions, words of the cycle before."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from vmachining.nc.codes import CYCLES
from vmachining.nc.fanuc_haas import pecks
from vmachining.nc.fanuc_line import Line, Words
from vmachining.nc.state import State

if TYPE_CHECKING:
    from vmachining.nc.fanuc import Translator

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
        if (
            word.letter != "G"
            or value not in TAPS
            or (value > 100.0 and variant != "okuma")
            or (own and not brother)
        ):
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
