"""One line as a block: its codes and words by name, and everything that can be judged without running it.

Codes of dialect `iso`, ten times their number: modal groups, what is refused and why. Checks here need the modal motion only,
so that words without an owner can be told (E201 to E210).
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from vmachining.nc.lexer import LexedLine, Word

_CYCLES: Final = frozenset({730, 740, 810, 820, 830, 840, 850, 860, 890})
"""Canned cycles of dialect `iso`."""

CYCLES: Final = _CYCLES | {760, 870, 880}
"""Those of every dialect."""

G_GROUP: Final = {
    **dict.fromkeys((40, 100, 280, 281, 300, 301, 520, 530, 920, 921, 922, 923), 0),
    **dict.fromkeys((0, 10, 20, 30, 331, 800), 1),
    **dict.fromkeys(_CYCLES, 1),
    **dict.fromkeys((170, 180, 190), 2),
    **dict.fromkeys((900, 910), 3),
    **dict.fromkeys((901, 911), 4),
    **dict.fromkeys((930, 940, 950), 5),
    **dict.fromkeys((200, 210), 6),
    **dict.fromkeys((400, 410, 411, 420, 421), 7),
    **dict.fromkeys((430, 431, 432, 434, 490), 8),
    **dict.fromkeys((980, 990), 10),
    **dict.fromkeys((540, 550, 560, 570, 580, 590, 591, 592, 593), 12),
    **dict.fromkeys((610, 611, 640), 13),
    970: 14,
    90: 15,
}
"""Modal group of every G code that is executed (or, like G61, accepted because it changes no path)."""

FANUC_G_GROUP: Final = {**G_GROUP, **dict.fromkeys(CYCLES, 1), 290: 0}
"""The same for the Fanuc family, whose other codes `fanuc.py` brings into this form."""

MTS_G_GROUP: Final = {
    **{code: group for code, group in G_GROUP.items() if code not in CYCLES},
    **dict.fromkeys((770, 780, 790, 800, 810, 820, 830), 9),
}
"""The same for dialect `mts`: cycles are stored, and called by G79."""

M_GROUP: Final = {
    **dict.fromkeys((0, 1, 2, 30, 60), 4),
    **dict.fromkeys((6, 61), 6),
    **dict.fromkeys((62, 63, 64, 65, 66, 67, 68), 5),
    **dict.fromkeys((3, 4, 5, 19), 7),
    **dict.fromkeys((7, 8, 9), 8),
    **dict.fromkeys((48, 49, 50, 51, 52, 53), 9),
    **dict.fromkeys((98, 99), 10),
    **dict.fromkeys((128, 129, 428, 429), 11),
    **dict.fromkeys((70, 71, 72, 73), 12),
}
"""Modal group of every M code that is executed (or, like switches and signals, changes no path)."""

AXIS_CLAIMING: Final = frozenset({100, 280, 290, 300, 431, 520, 920})
"""G codes that take the axis words for themselves, so that no motion code may stand next to them."""

_GROUPS: Final = {
    0: "non-modal", 1: "motion", 2: "plane", 3: "distance", 4: "arc centre", 5: "feed mode", 6: "units",
    7: "cutter compensation", 8: "tool length", 9: "cycle", 10: "cycle return", 12: "work offset", 13: "path control",
    14: "spindle mode", 15: "exact stop",
}  # fmt: skip
_M_GROUPS: Final = {
    4: "stop", 6: "tool change", 7: "spindle", 8: "coolant", 9: "override", 10: "subprogram", 11: "tool centre point",
    5: "signal", 12: "saved modes",
}  # fmt: skip


def _said(table: str) -> dict[int, str]:
    """`1 2: text`, a line each, by the numbers."""
    rows = (line.partition(": ") for line in table.strip().splitlines())
    return {int(code): text for codes, _, text in rows for code in codes.split()}


_REFUSED: Final = _said("""
680 690: rotation of coordinates by G68, G69 is not supported
500 510: scaling (G50, G51) is not supported
150 160: polar coordinates (G15, G16) are not supported
290: G29 (return from reference) is known to Fanuc controls only
435: tool centre point control with I J K axis words (G43.5) is not supported
650 660: macro calls (G65, G66) are not supported
50 51 52 53: splines (G5) are not supported
382 383 384 385: probing (G38) is not supported
120 130: circular pockets (G12, G13) are known to the haas dialect only
310 370: probing (G31, G37), where a signal ends the motion, is not supported
870: back boring (G87) is not supported
880: boring with manual retract (G88) is not supported
760: G76 (threading, or fine boring) is not supported
682: a tilted working plane (G68.2) is known to Fanuc controls only
683: a tilted working plane by the tool axis (G68.3) is not supported
684: a tilted working plane in a tilted plane (G68.4) is not supported
2680 2690: feature coordinates (G268), whose order of turns Q chooses, are not supported
61 62: NURBS (G6.2) are not supported
22 23 32 33 24 34: involutes, spirals and circles in space (G2.2 to G2.4) are not supported
121 1120: polar coordinate interpolation (G12.1, G112) is not supported
412 413 414 415 416 422 423 424 425 426 1410: cutter compensation in space (G41.2, G141) is not supported
542 544: work offsets that turn with the table or contain a set-up error (G54.2, G54.4) are not supported
450 460 480: steps longer or shorter by a tool offset (G45 to G48) are not supported
536: a tool that turns about its tip (G53.6) is not supported
925: a turn of the part's coordinates (G92.5) is not supported
1530 1550 1560 1610 1640 1650 1690 1740 1840: cycles along the axis of a tool that leans (G153 to G184) are not supported
470: engraving (G47), whose letters the control knows, is not supported
1500: pocket milling by the control (G150) is not supported
350 360 1360: probing (G35, G36, G136), where a signal ends the motion, is not supported
""")
_TURNING: Final = _said("""
70: diameter mode
80: radius mode
240: radius programming
320 330: thread cutting
700: a finishing cycle
710 711 712 720 721 722: a roughing cycle
960: constant surface speed
""")
_MTS: Final = {770: "arc pattern", 780: "line pattern", 790: "cycle call"}


def spell(kind: str, code: int) -> str:
    """`G1`, `G92.1`, `M30` from the code (ten times the number for G)."""
    if kind == "M":
        return f"M{code}"
    whole, tenth = divmod(code, 10)
    return f"G{whole}.{tenth}" if tenth else f"G{whole}"


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

_TAKERS: Final = (
    (("G40",), "P", "dwell"), (("G640",), "PQR", "path control"), (("M50", "M51", "M52", "M53"), "P", "override"),
    (("G430", "G432", "G434"), "H", "length"), (("G410", "G420"), "D", "compensation"),
    (("G411", "G421"), "DL", "compensation"), (("G100",), "PLR", "G10"), (("M98",), "PL", "M98"), (("M61",), "Q", "M61"),
    (("M19",), "PQR", "M19"), (("M62", "M63", "M64", "M65"), "P", "signal"), (("M66",), "PELQ", "signal"),
    (("M67", "M68"), "EQ", "signal"),
)  # fmt: skip
"""Codes, ten times the number for G; the letters they take; what they are."""


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

    def wrong(self, code: str, word: Word | None, message: str, hint: str = "") -> None:
        self.problems.append(Problem(code, word, message, hint))

    def value(self, letter: str) -> float | None:
        """Number of a word, None when the block does not have it."""
        found = self.words.get(letter)
        return found[0] if found else None

    def has_g(self, code: int) -> bool:
        """Whether the block names this G code (ten times its number)."""
        found = self.g.get(FANUC_G_GROUP[code])
        return found is not None and found[0] == code

    def word(self, letter: str) -> Word | None:
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
                block.wrong("E201", word, "N does not open the block")
            elif block_number(line) is None:
                block.wrong("E201", word, f"{word.text} is not a block number of one to nine digits")
        elif letter == "G":
            known &= _g_code(block, word, value, groups)
        elif letter == "M":
            known &= _m_code(block, word, value)
        elif letter in block.words:
            first = block.words[letter][1]
            block.wrong("E202", word, f"{letter} is already given in column {first.col}")
        else:
            block.words[letter] = value, word
    corner = next((block.words[letter][1] for letter in (",R", ",C", ",A") if letter in block.words), None)
    if corner is not None and (groups is G_GROUP or corner.letter == ",A"):
        known = False
        what = "chamfers, rounded corners and angles (,C ,R ,A) are not supported"
        block.wrong("E208", corner, what, "let the post write them out")
    block.axes, block.polar, block.centre, block.rotary = (
        "".join(letter for letter in letters if letter in block.words) for letters in ("XYZ", "@^", "IJK", rotary)
    )  # fmt: skip
    block.motion, block.stored = (block.g[group][0] if group in block.g else None for group in (1, 9))
    owned = "" if block.stored is None else _MTS_WORDS[block.stored]
    for letter in block.words:
        if letter in _FOREIGN_AXES and letter not in rotary and letter not in owned:
            if not (mts or letter in "AUVC") and (block.motion or modal_motion) in CYCLES:
                continue  # told below: a word of another dialect
            known = False
            block.wrong("E209", block.words[letter][1], f"this machine has no axis {letter}")
    if known:
        _owners(block, modal_motion)
    elif not (
        block.axes or block.rotary or block.polar
    ):  # probing without them is wrong on every control: say that, too
        for k, (_, at, message, _) in enumerate(block.problems):
            if at is not None and _PROBE.fullmatch(at.text.replace(" ", "")):
                block.problems[k] = block.problems[k]._replace(
                    message=f"{at.text} without axis words; {message}"
                )
    return block


def _g_code(block: Block, word: Word, value: float, groups: dict[int, int]) -> bool:
    code = round(value * 10.0) if 0.0 <= value < 1000.0 else -1
    if abs(code - value * 10.0) > 1e-6:  # a number with more than one decimal or a sign
        code = -1
    group, text = groups.get(code), word.text
    if group is None:
        if code in _TURNING:
            block.wrong("E209", word, f"{spell('G', code)} ({_TURNING[code]}) belongs to a lathe")
        elif code in _MTS:
            what = f"{spell('G', code)} ({_MTS[code]}) exists in the mts dialect only"
            block.wrong("E210", word, what, "is this an mts program? choose the mts dialect")
        elif len(text) == 5 and text[1] == "1" and text[1:].isdigit() and code not in _REFUSED:
            block.wrong("E208", word, f"{text} is a cycle of Manual Guide i, whose path the control makes")
        else:
            block.wrong("E208", word, _REFUSED.get(code, f"unknown G code {text}"))
        return False
    if group in block.g and group == 1 and (code == 800) != (block.g[group][0] == 800):
        if code != 800:  # G80 beside another motion code says what that code says anyway
            block.g[group] = code, word
    elif group in block.g:
        first = block.g[group][0]
        what = f"{spell('G', code)} and {spell('G', first)} are both of the {_GROUPS[group]} group"
        block.wrong("E203", word, what)
    else:
        block.g[group] = code, word
    return True


def _m_code(block: Block, word: Word, value: float) -> bool:
    code = int(value) if 0.0 <= value < 1000.0 and value == int(value) else -1
    group = M_GROUP.get(code)
    if group is None:
        own = 100 <= code <= 199
        what = (
            f"M{code} is a user-defined code, its effect is unknown" if own else f"unknown M code {word.text}"
        )
        block.wrong("E208", word, what)
        return False
    if group in block.m:
        what = f"M{code} and M{block.m[group][0]} are both of the {_M_GROUPS[group]} group"
        block.wrong("E204", word, what)
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
        block.wrong("E206", block.g[1][1], what)
        return
    if stored is not None and stored != 800 and (claimed is not None or motion is not None):
        other = claimed if claimed is not None else motion or 0
        what = f"{spell('G', stored)} and {spell('G', other)} both claim the axis words"
        block.wrong("E206", block.g[9][1], what)
        return
    effective = motion if motion is not None else modal_motion
    if places and claimed is None and stored in (None, 800) and effective in (None, 800):
        first = block.culprit() if motion is None else block.g[1][1]
        block.wrong("E206", first, "axis words, but no motion code is in force")
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
            block.wrong("E206", block.word(letter), f"{' and '.join(who)} of this block both claim {letter}")
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
        block.wrong("E207", word, message, hint)


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
    codes = {f"G{code}" for code, _ in block.g.values()} | {f"M{code}" for code, _ in block.m.values()}
    for names, letters, who in _TAKERS:
        if not codes.isdisjoint(names):
            take(letters, who)
    if block.stored is not None:
        take(_MTS_WORDS[block.stored], "cycle")
    return takers
