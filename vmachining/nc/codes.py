"""The codes of dialect `iso`: modal groups, what is refused and why. G codes are ten times their number."""

from __future__ import annotations

from typing import Final, NamedTuple

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


class Refusal(NamedTuple):
    """Why a code is refused."""

    code: str
    message: str
    hint: str = ""


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


def group_name(kind: str, group: int) -> str:
    """What the codes of a group have in common."""
    return (_GROUPS if kind == "G" else _M_GROUPS)[group]


def refuse_g(code: int | None, text: str) -> Refusal:
    """Why this G code is not executed; code is None for a number with more than one decimal or a sign."""
    if code in _REFUSED:
        return Refusal("E208", _REFUSED[code])
    if code in _TURNING:
        return Refusal("E209", f"{spell('G', code)} ({_TURNING[code]}) belongs to a lathe")
    if code in _MTS:
        what = f"{spell('G', code)} ({_MTS[code]}) exists in the mts dialect only"
        return Refusal("E210", what, "is this an mts program? choose the mts dialect")
    if len(text) == 5 and text[1] == "1" and text[1:].isdigit():
        return Refusal("E208", f"{text} is a cycle of Manual Guide i, whose path the control makes")
    return Refusal("E208", f"unknown G code {text}")


def refuse_m(code: int | None, text: str) -> Refusal:
    """Why this M code is not executed."""
    if code is not None and 100 <= code <= 199:
        return Refusal("E208", f"M{code} is a user-defined code, its effect is unknown")
    return Refusal("E208", f"unknown M code {text}")
