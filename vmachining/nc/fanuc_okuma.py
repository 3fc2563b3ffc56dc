"""What Okuma's OSP does otherwise than Fanuc: words of work offsets, tool lengths and return levels, and its own macro language.

    G15 Hn, G16 Hn   work offset n, G16 for its block only      G53, G56 H   no tool length, length along Z
    G169 H, G170     tool centre point control, and its end
    CALL OO88        work offset PP is PH turned with the rotary axes, as the zero is here
    G11 X Y Z P, G10 a shift and a turn by P, and their end     G71 Z        level that M53 returns to
    M52 M53 M54      return of cycles: upper end of Z, the level of G71, the clearance plane      G116 T   tool change

User task: `VC1 = ..`, the program's own names, `X=..`, `IF [..] N10`, `GOTO N10`, `CALL O1 Q2`, `RTS` become the macros of Fanuc.
Source: OSP-P programming manual and user task manual.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from vmachining.nc.fanuc_line import Line
from vmachining.nc.lexer import Word
from vmachining.nc.state import WORK_OFFSETS

if TYPE_CHECKING:
    from vmachining.nc.fanuc import Translator

RETURN: Final = {52: "the upper end of Z", 53: "the level of G71", 54: "the clearance plane"}
LENGTHS: Final = {530: 49.0, 1690: 43.4, 1700: 49.0, 560: 43.0}
"""Codes of tool lengths, and those of the core."""
OFFSETS: Final = 400
TURNED_ZERO: Final = 88.0
"""L of the G10 that stands for `CALL OO88 PH=1 PP=2`: work offset 2 is the turned 1."""
LIKE_FANUC: Final = 6
"""Work offsets 1 to 6 are those that the job knows as G54 to G59."""


def code(translator: Translator, word: Word, number: int, line: Line) -> bool:
    """A G code that means something else here; False where it does not."""
    if number in LENGTHS:
        line.keep(word._replace(value=LENGTHS[number]), LENGTHS[number])
    elif number in (150, 160):
        _work(translator, word, number, line)
    elif number in (540, 550):
        line.refuse(word, "G54 and G55, a tool length along X or Y, are not supported")
    elif number == 110:
        translator.places.shift(line)
        line.taken |= set("XYZP")
    elif number == 100 and line.get("L") == TURNED_ZERO:
        place, of = int(line.get("P")), int(line.get("H"))
        if not (place and of) or any(map(line.get, "XYZ")):
            what = "CALL OO88 needs PH and PP, work offsets, and PX PY PZ of zero"
            line.refuse(word, what, "post a tilted plane or tool centre point control")
        else:
            translator.alias[place] = translator.alias.get(of, of)
            what = f"CALL OO88: work offset {place} is {of} turned with the rotary axes, as its zero is here"
            translator.say(f"OO88 {place}", word, what, "I213")
        line.taken |= set("LPHXYZ")
    elif number == 100 and "L" not in line.given:
        translator.places.end("shift", line)
    elif number == 710 and "Z" in line.given:
        translator.level = line.get("Z") * line.state.scale
        line.taken.add("Z")
    elif number == 1160 and "T" in line.given:
        line.add("M", 6.0, word)
    else:
        return False
    return True


def _work(translator: Translator, word: Word, number: int, line: Line) -> None:
    place = line.get("H")
    if not 1.0 <= place <= OFFSETS or place != int(place):
        what = f"{word.text} names a work offset by H from 1 to {OFFSETS}"
        line.refuse(word, what, "H0, the machine itself, is not read")
        return
    line.taken.add("H")
    chosen = translator.alias.get(int(place), int(place))
    work = WORK_OFFSETS[chosen - 1] if chosen <= LIKE_FANUC else 100000 + chosen
    which = f", G5{3 + chosen} of the job" if chosen <= LIKE_FANUC else ""
    translator.say(f"G15 H{chosen}", word, f"{word.text} H{chosen}: work offset {chosen}{which}", "I213")
    line.choose(line.before, work)
    if number == 160:
        line.choose(line.after, line.state.work)


def back(translator: Translator, word: Word, number: int, line: Line) -> None:
    """M52 to M54."""
    line.add("G", 99.0 if number == 54 else 98.0, word)
    level = translator.level if number == 53 else translator.settings.home[2] if number == 52 else None
    translator.say(f"M{number}", word, f"{word.text}: cycles return to {RETURN[number]}", "I213")
    if number == 53 and level is None:
        line.refuse(word, "M53 returns to the level of G71, which was not given", "write G71 Z first")
    line.become(line.before, return_level=level)


_TASK: Final = re.compile(
    r"\bHP[ \t]*=|\bVC[0-9]|\bCALL[ \t]*O|^[ \t]*RTS\b|(?<![A-Z#0-9])[XYZABCIJKLRFSTHDQP][ \t]*=|\]GOTO"
    r"|\bGOTO[ \t]*N|\][ \t]*N[A-Z0-9]"
    r"|^[ \t]*O[A-Z]|^[ \t]*N[A-Z]|^[ \t]*[A-Z]{2,}[A-Z0-9]*[ \t]*=",
    re.IGNORECASE,
)
_WORD: Final = re.compile(r"(?<![A-Z0-9#])[A-Z]{2}[A-Z0-9]*(?![A-Z0-9])", re.IGNORECASE)
_OWN: Final = re.compile(
    "IF|GOTO|CALL|RTS|NOEX|MODIN|MODOUT|EQ|NE|GT|GE|LT|LE|AND|OR|XOR|NOT|MOD|SIN|COS|TAN|ATAN|ABS|SQRT|FIX|FUP|ROUND|EXP|LN|V.*"
)
_GIVEN: Final = re.compile(r"(?<![A-Z0-9#\]])([XYZABCIJKLRFSTHDQP])[ \t]*=[ \t]*([^ \t()]+)", re.IGNORECASE)
_BRANCH: Final = re.compile(r"(\][ \t]*)(?:GOTO[ \t]*)?N(?=[A-Z0-9])", re.IGNORECASE)
_NOEX: Final = re.compile(r"\bNOEX\b", re.IGNORECASE)
_RETURN: Final = re.compile(r"^([ \t]*)RTS\b", re.IGNORECASE)
_NAMED: Final = re.compile(r"((?:\]|GOTO)[ \t]*(?:GOTO[ \t]*)?N)([A-Z0-9]+)", re.IGNORECASE)
_JUMP: Final = re.compile(r"(?<![A-Z])GOTO[ \t]*N(?=[A-Z0-9])", re.IGNORECASE)
_LABEL: Final = re.compile(r"^([ \t]*)([NO])([A-Z0-9]*[A-Z][A-Z0-9]*)(?![A-Z0-9=])", re.IGNORECASE)
_CALL: Final = re.compile(r"(?<![A-Z])CALL[ \t]*O([A-Z0-9]+)(?:[ \t]+Q([0-9]+))?", re.IGNORECASE)
_VARIABLE: Final = re.compile(r"(?<![A-Z0-9])VC([0-9]{1,3})(?![0-9])", re.IGNORECASE)
_TURNED: Final = re.compile(
    r"^[ \t]*(?:N[0-9]+[ \t]*)?CALL[ \t]+OO88((?:[ \t]+P[XYZABCHP][ \t]*=[ \t]*-?[0-9]*\.?[0-9]+\.?)+)[ \t]*$",
    re.IGNORECASE,
)
_PAIR: Final = re.compile(r"P([XYZHP])[ \t]*=[ \t]*(-?[0-9.]+)", re.IGNORECASE)
_HOME: Final = re.compile(r"(?<![A-Z0-9])G2[01][ \t]*HP[ \t]*=[ \t]*([0-9]+)", re.IGNORECASE)
_FIRST: Final = re.compile(r"(?<![A-Z0-9])[HD]A(?![A-Z0-9=.\[-])(?![^(]*\))", re.IGNORECASE)
_SET: Final = re.compile(r"(#[0-9]+)[ \t]*=[ \t]*([^ \t()=]+)")

FIRST_NAME, FIRST_LABEL = 700, 90000
"""Where names of variables, of lines and of programs begin as numbers of Fanuc; VC1 is #501."""


def user_task(lines: list[str]) -> list[str]:
    """Lines of user task as those of custom macro B; others stay. System variables (VTLCN, ...) stay, and are refused.

    HA and DA, the first registers of the tool in the spindle, are left out: its length and radius are taken anyway.
    """
    lines = [_FIRST.sub("  ", line) if "A" in line.upper() else line for line in lines]
    if not any(_TASK.search(line) for line in lines):
        return lines
    variables, labels = dict[str, int](), dict[str, int]()

    def label(name: str) -> str:
        key = name.upper()
        return name if key.isdigit() else str(labels.setdefault(key, FIRST_LABEL + len(labels)))

    def variable(hit: re.Match[str]) -> str:
        name = hit[0].upper()
        if _OWN.fullmatch(name):
            return hit[0]
        return f"#{variables.setdefault(name, FIRST_NAME + len(variables))}"

    out = []
    for line in lines:
        code, mark, rest = line.partition("(")
        if (turned := _TURNED.match(code)) is not None:
            words = " ".join(f"{letter}{number}" for letter, number in _PAIR.findall(turned[1]))
            out.append(f"G10 L{TURNED_ZERO:g} {words} {mark}{rest}")
            continue
        code = _HOME.sub(r"G30 P\1", code)
        if not _TASK.search(code):
            out.append(code + mark + rest)
            continue
        code = _RETURN.sub(r"\1M99", _NOEX.sub("", code))
        code = _LABEL.sub(lambda hit: f"{hit[1]}{hit[2]}{label(hit[3])} ", code)
        code = _CALL.sub(lambda hit: f"M98 P{label(hit[1])}" + (f" L{hit[2]}" if hit[2] else ""), code)
        code = _NAMED.sub(lambda hit: hit[1] + label(hit[2]), code)
        code = _BRANCH.sub(r"\1GOTO ", code)
        code = _JUMP.sub("GOTO ", code)
        code = _VARIABLE.sub(lambda hit: f"#{500 + int(hit[1])}", code)
        code = _WORD.sub(variable, code)
        code = _SET.sub(lambda hit: f"{hit[1]}=[{hit[2]}]", code)
        code = _GIVEN.sub(lambda hit: f"{hit[1]}[{hit[2]}]", code)
        out.append(code + mark + rest)
    return out
