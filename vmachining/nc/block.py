"""One line as a block: its codes and words by name, and everything that can be judged without running it.

Checks here need the modal motion only, so that words without an owner can be told (E201 to E210).
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from vmachining.nc.codes import (
    AXIS_CLAIMING,
    CYCLES,
    FANUC_G_GROUP,
    G_GROUP,
    M_GROUP,
    group_name,
    refuse_g,
    refuse_m,
    spell,
)
from vmachining.nc.lexer import LexedLine, Word

_BLOCK_NUMBER: Final = re.compile(r"[Nn]([0-9]{1,9})(?:\.[0-9]*)?")
_PROBE: Final = re.compile(r"[Gg]0*38\.[2-5]")
_ALWAYS: Final = frozenset("GMNFST")
_FOREIGN_AXES: Final = frozenset("ABCUVW")
_MTS_WORDS: Final = {
    770: "XYRADS", 780: "XYDAS", 790: "XY", 800: "", 810: "ZW", 820: "ZWBDK", 830: "ZWBDK",
}  # fmt: skip
"""Words of the stored cycles and patterns of dialect `mts`."""

_CYCLE_WORDS: Final = {
    730: "Q", 740: "P", 810: "", 820: "P", 830: "Q", 840: "P", 850: "", 860: "P", 890: "P",
    760: "P", 870: "PQ", 880: "P",
}  # fmt: skip
"""What canned cycles take besides their axis words, R and L."""


SIGNAL_WORDS: Final = {**dict.fromkeys((62, 63, 64, 65), "P"), 66: "PELQ", 67: "EQ", 68: "EQ"}
"""Words of the M codes that set outputs and read inputs."""


class Problem(NamedTuple):
    """A finding about one word (None: the whole block)."""

    code: str
    word: Word | None
    message: str
    hint: str = ""


class Block:
    """Codes by group and words by letter. Values are numbers now.

    g, m : group -> (code, word). words : letter -> (value, word), G M N excluded. motion : explicit code of
    group 1 (ten times) or None. axes, rotary, polar, centre : letters present. stored : code of a stored
    cycle or pattern (dialect mts) or None.
    """

    __slots__ = ("axes", "centre", "g", "m", "motion", "polar", "problems", "rotary", "stored", "words")

    def __init__(self) -> None:
        self.g: dict[int, tuple[int, Word]] = {}
        self.m: dict[int, tuple[int, Word]] = {}
        self.words: dict[str, tuple[float, Word]] = {}
        self.problems: list[Problem] = []
        self.motion: int | None = None
        self.stored: int | None = None
        self.axes = ""
        self.rotary = ""
        self.polar = ""
        self.centre = ""

    def value(self, letter: str) -> float | None:
        """Number of a word, None when the block does not have it."""
        found = self.words.get(letter)
        return found[0] if found else None

    def has_g(self, code: int) -> bool:
        """Whether the block names this G code (ten times its number)."""
        found = self.g.get(FANUC_G_GROUP[code])
        return found is not None and found[0] == code

    def word(self, letter: str) -> Word | None:
        """A word by its letter."""
        found = self.words.get(letter)
        return found[1] if found else None

    def culprit(self) -> Word | None:
        """The word to point at when a motion fails: its G code, else the first axis or centre word."""
        if 1 in self.g:
            return self.g[1][1]
        places = [self.words[letter][1] for letter in self.axes + self.rotary + self.polar + self.centre]
        return min(places, key=lambda word: word.col) if places else None


def block_number(line: LexedLine) -> int | None:
    """The N word that opens the line, None when none exists or it is malformed; digits after a point are left."""
    if not line.words or line.words[0].letter != "N":
        return None
    found = _BLOCK_NUMBER.fullmatch(re.sub(r"[ \t]", "", line.words[0].text))
    return int(found[1]) if found else None


def build_block(
    line: LexedLine,
    values: list[float],
    modal_motion: int | None,
    *,
    rotary: str = "",
    mts: bool = False,
    groups: dict[int, int] = G_GROUP,
) -> Block:
    """Sort the words of a line and check them against each other.

    line : the lexed line, without errors.
    values : the number of each word, expressions evaluated.
    modal_motion : ten times the G code of group 1 in force, None after G80.
    rotary : letters of the rotary axes that the machine has.
    mts : read the codes of that dialect. groups : modal group of every G code that is known.
    """
    block, known = Block(), True
    for index, (word, value) in enumerate(zip(line.words, values, strict=True)):
        letter = word.letter
        if letter == "N":
            if index > 0:
                block.problems.append(Problem("E201", word, "N does not open the block"))
            elif block_number(line) is None:
                what = f"{word.text} is not a block number of one to nine digits"
                block.problems.append(Problem("E201", word, what))
        elif letter == "G":
            known &= _g_code(block, word, value, groups)
        elif letter == "M":
            known &= _m_code(block, word, value)
        elif letter in block.words:
            first = block.words[letter][1]
            block.problems.append(Problem("E202", word, f"{letter} is already given in column {first.col}"))
        else:
            block.words[letter] = value, word
    corner = next((block.words[letter][1] for letter in (",R", ",C", ",A") if letter in block.words), None)
    if corner is not None and (groups is G_GROUP or corner.letter == ",A"):
        known = False
        what = "chamfers, rounded corners and angles (,C ,R ,A) are not supported"
        block.problems.append(Problem("E208", corner, what, "let the post write them out"))
    block.axes = "".join(letter for letter in "XYZ" if letter in block.words)
    block.polar = "".join(letter for letter in "@^" if letter in block.words)
    block.centre = "".join(letter for letter in "IJK" if letter in block.words)
    block.motion = block.g[1][0] if 1 in block.g else None
    block.stored = block.g[9][0] if 9 in block.g else None
    block.rotary = "".join(letter for letter in rotary if letter in block.words)
    owned = "" if block.stored is None else _MTS_WORDS[block.stored]
    for letter in block.words:
        if letter in _FOREIGN_AXES and letter not in rotary and letter not in owned:
            if not (mts or letter in "AUVC") and (block.motion or modal_motion) in CYCLES:
                continue  # told below: a word of another dialect
            known = False
            what = f"this machine has no axis {letter}"
            block.problems.append(Problem("E209", block.words[letter][1], what))
    if known:
        _owners(block, modal_motion)
    elif not (block.axes or block.rotary or block.polar):
        block.problems = [_aimless(problem) for problem in block.problems]
    return block


def _aimless(problem: Problem) -> Problem:
    """Probing without axis words is wrong on every control: say that, too."""
    if problem.word is None or not _PROBE.fullmatch(problem.word.text.replace(" ", "")):
        return problem
    return problem._replace(message=f"{problem.word.text} without axis words; {problem.message}")


def _g_code(block: Block, word: Word, value: float, groups: dict[int, int]) -> bool:
    code = round(value * 10.0) if 0.0 <= value < 1000.0 else None
    if code is not None and abs(code - value * 10.0) > 1e-6:
        code = None
    group = None if code is None else groups.get(code)
    if code is None or group is None:
        refusal = refuse_g(code, word.text)
        block.problems.append(Problem(refusal.code, word, refusal.message, refusal.hint))
        return False
    if group in block.g and group == 1 and (code == 800) != (block.g[group][0] == 800):
        if code != 800:  # G80 beside another motion code says what that code says anyway
            block.g[group] = code, word
    elif group in block.g:
        first = block.g[group][0]
        what = f"{spell('G', code)} and {spell('G', first)} are both of the {group_name('G', group)} group"
        block.problems.append(Problem("E203", word, what))
    else:
        block.g[group] = code, word
    return True


def _m_code(block: Block, word: Word, value: float) -> bool:
    code = int(value) if 0.0 <= value < 1000.0 and value == int(value) else None
    group = None if code is None else M_GROUP.get(code)
    if code is None or group is None:
        refusal = refuse_m(code, word.text)
        block.problems.append(Problem(refusal.code, word, refusal.message, refusal.hint))
        return False
    if group in block.m:
        first = block.m[group][0]
        what = f"{spell('M', code)} and {spell('M', first)} are both of the {group_name('M', group)} group"
        block.problems.append(Problem("E204", word, what))
    else:
        block.m[group] = code, word
    return True


def _owners(block: Block, modal_motion: int | None) -> None:
    """E206 and E207: every word must have exactly one code that takes it."""
    claimed = next((code for code, _ in block.g.values() if code in AXIS_CLAIMING), None)
    motion, stored = block.motion, block.stored
    places = block.axes + block.rotary + block.polar
    if claimed is not None and motion is not None and motion != 800:
        what = f"{spell('G', claimed)} and {spell('G', motion)} both claim the axis words"
        block.problems.append(Problem("E206", block.g[1][1], what))
        return
    if stored is not None and stored != 800 and (claimed is not None or motion is not None):
        other = claimed if claimed is not None else motion or 0
        what = f"{spell('G', stored)} and {spell('G', other)} both claim the axis words"
        block.problems.append(Problem("E206", block.g[9][1], what))
        return
    effective = motion if motion is not None else modal_motion
    if places and claimed is None and stored in (None, 800) and effective in (None, 800):
        first = block.culprit() if motion is None else block.g[1][1]
        block.problems.append(Problem("E206", first, "axis words, but no motion code is in force"))
        return
    moves = claimed is None and stored in (None, 800)
    tap = moves and effective == 331 and (motion is not None or bool(places))
    cycle = moves and effective in CYCLES and (motion is not None or bool(places))
    arc = moves and effective in (20, 30) and (motion is not None or bool(places) or bool(block.centre))
    takers = _takers(block, effective, arc, cycle)
    if moves and effective in (10, 20, 30):
        takers |= {",R": ["corner"], ",C": ["corner"]}
    if tap:
        takers.setdefault("K", []).append("tap")
    for letter in "PQR":
        who = takers.get(letter, ())
        if letter in block.words and len(who) > 1 and (letter == "P" or "M19" in who):
            what = f"{' and '.join(who)} of this block both claim {letter}"
            block.problems.append(Problem("E206", block.word(letter), what))
    for letter, (_, word) in block.words.items():
        if letter in _ALWAYS or letter in takers:
            continue
        message, hint = f"no code of this block uses {word.text}", ""
        if cycle and letter in block.rotary:
            message = f"a rotary axis cannot move in a canned cycle: {word.text}"
        elif cycle and letter in "WBDK":
            hint = "is this an mts program? choose the mts dialect"
        elif block.stored in (810, 820, 830) and letter in "RQPL":
            hint = "is this an iso program? choose the iso dialect"
        elif letter in block.polar and block.axes:
            message = f"polar words and {block.axes[0]} exclude each other: {word.text}"
        block.problems.append(Problem("E207", word, message, hint))


def _takers(block: Block, effective: int | None, arc: bool, cycle: bool) -> dict[str, list[str]]:
    """For each letter that is used, who uses it."""
    takers: dict[str, list[str]] = {}

    def take(letters: str, who: str) -> None:
        for letter in letters:
            takers.setdefault(letter, []).append(who)

    if block.stored in (None, 800):
        take("XYZ", "axes")
        if not set(block.axes) & set("XY") and not any(block.has_g(code) for code in AXIS_CLAIMING):
            take("@^", "axes")
        if not cycle and not any(block.has_g(code) for code in (431, 520)):
            take(block.rotary, "axes")
    if arc:
        take("IJKRP", "arc")
    if cycle:
        take("RL" + _CYCLE_WORDS[effective or 0], "cycle")
    if block.has_g(40):
        take("P", "dwell")
    if block.has_g(640):
        take("PQR", "path control")
    if block.m.get(9, (48,))[0] in (50, 51, 52, 53):
        take("P", "override")
    if block.has_g(430) or block.has_g(432) or block.has_g(434):
        take("H", "length")
    if block.has_g(410) or block.has_g(420):
        take("D", "compensation")
    if block.has_g(411) or block.has_g(421):
        take("DL", "compensation")
    if block.has_g(100):
        take("PLR", "G10")
    if block.m.get(10, (0,))[0] == 98:
        take("PL", "M98")
    if block.m.get(6, (0,))[0] == 61:
        take("Q", "M61")
    if block.m.get(7, (0,))[0] == 19:
        take("PQR", "M19")
    if 5 in block.m:
        take(SIGNAL_WORDS[block.m[5][0]], "signal")
    if block.stored is not None:
        take(_MTS_WORDS[block.stored], "cycle")
    return takers
