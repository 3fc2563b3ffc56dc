"""Text of Sinumerik programs: blocks with N and label, and the words of one; which are known, accepted with a note, refused.

X10  X=R1+5  X=AC(10)  CR=5  R1=R2*2  CYCLE81(10,0,2,-5)  TRANS X10  T="MILL"  MSG("text")  ; comment
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final, NamedTuple

from vmachining.nc.execution import Block
from vmachining.nc.placing import EdgeFeed


class Word(NamedTuple):
    """kind : "word" (X10), "set" (X=..., R1=...), "call" (NAME(...)) or "key" (NAME alone)."""

    kind: str
    name: str
    value: str
    text: str


class Unit(NamedTuple):
    """A program of an archive, or the file itself. name : in capitals, without _N_ and kind."""

    name: str
    blocks: list[Block]


_HEADER: Final = re.compile(r"[ \t]*%[ \t]*(?:_N_)?([A-Z0-9_]+?)(?:_(MPF|SPF))?[ \t]*$", re.IGNORECASE)
_FRONT: Final = re.compile(
    r"[ \t]*(/\d?)?[ \t]*(?:N[ \t]*(\d{1,9}))?[ \t]*(?:([A-Z_][A-Z0-9_]+)[ \t]*:(?![=]))?[ \t]*",
    re.IGNORECASE,
)
_QUOTED: Final = re.compile(r'"[^"]*"')


def units(lines: Sequence[str]) -> list[Unit]:
    """The programs of a text, each with its blocks."""
    out = [Unit("", [])]
    for number, raw in enumerate(lines, 1):
        if raw.lstrip().startswith("%"):
            found = _HEADER.match(raw)
            out.append(Unit(found[1].upper() if found else "", []))
            continue
        quoted: list[str] = []

        def hold(hit: re.Match[str], kept: list[str] = quoted) -> str:
            kept.append(hit[0])
            return "\0"

        bare = _QUOTED.sub(hold, raw)
        bare = bare.split(";", 1)[0].upper().replace("\t", " ").rstrip()
        front = _FRONT.match(bare)
        assert front is not None  # every part may be missing
        text = bare[front.end() :]
        for item in quoted[: text.count("\0")]:
            text = text.replace("\0", item, 1)
        if text or front[3]:
            n = int(front[2]) if front[2] else None
            out[-1].blocks.append(Block(number, n, text, raw, front[3] or "", front[1] is not None))
    return [unit for unit in out if unit.blocks] or [Unit("", [])]


_LETTER: Final = re.compile(r"([A-Z])[ ]*([+-]?[ ]*(?>\d+\.?\d*|\.\d+)(?:EX[+-]?\d+)?)(?![ ]*[=\[(]|\w)")
_PACKED: Final = re.compile(r"([A-Z])([+-]?(?>\d+\.?\d*|\.\d+))(?=[A-Z][+-]?[.\d=])")
_NAME: Final = re.compile(r"([A-Z_$][A-Z0-9_$]*)[ ]*")
_OPERAND: Final = re.compile(
    r'[ ]*(?:[+-][ ]*|NOT[ ]+)*(?:(?:\d+\.?\d*|\.\d+)(?:EX[+-]?\d+)?|"[^"]*"|[A-Z_$][A-Z0-9_$.]*|(?=[(\[]))'
)
_OPERATOR: Final = re.compile(r"[ ]*(?:==|<>|>=|<=|<<|[-+*/<>]|\b(?:DIV|MOD|AND|OR|XOR)\b)")


def _close(text: str, at: int) -> int:
    """Place after the bracket that closes the one at `at`; -1 where none does."""
    depth, quoted = 0, False
    for k in range(at, len(text)):
        c = text[k]
        if c == '"':
            quoted = not quoted
        elif not quoted and c in "([":
            depth += 1
        elif not quoted and c in ")]":
            depth -= 1
            if depth == 0:
                return k + 1
    return -1


def _expression(text: str, at: int) -> int:
    """Place after the expression that begins at `at`; -1 where none exists."""
    while True:
        found = _OPERAND.match(text, at)
        if found is None:
            return -1
        at = found.end()
        while at < len(text) and text[at] in "([":
            at = _close(text, at)
            if at < 0:
                return -1
        found = _OPERATOR.match(text, at)
        if found is None:
            return at
        at = found.end()


def words(text: str) -> tuple[list[Word], str]:
    """Words of a block, and the rest of the text."""
    out: list[Word] = []
    at = 0
    while True:
        at += len(text[at:]) - len(text[at:].lstrip(" ,"))
        if at >= len(text):
            return out, ""
        found = _LETTER.match(text, at) or _PACKED.match(text, at)
        if found is not None:
            out.append(Word("word", found[1], found[2].replace(" ", ""), found[0]))
            at = found.end()
            continue
        found = _NAME.match(text, at)
        if found is None:
            return out, text[at:]
        name, index, end, stop = found[1], "", found.end(), found.end(1)
        if text[end : end + 1] == "[":
            stop = _close(text, end)
            if stop < 0:
                return out, text[at:]
            index, end = text[end:stop], stop + len(text[stop:]) - len(text[stop:].lstrip(" "))
        if text[end : end + 1] == "=" and text[end : end + 2] != "==":
            stop = _expression(text, end + 1)
            word = Word("set", name + index, text[end + 1 : stop].strip(), text[at:stop])
        elif text[end : end + 1] == "(" and not index:
            stop = _close(text, end)
            word = Word("call", name, text[end + 1 : stop - 1], text[at:stop])
        else:
            stop, word = found.end(1), Word("key", name, "", name)
        if stop < 0:
            return out, text[at:]
        out.append(word)
        at = stop


def arguments(text: str) -> list[str]:
    """Arguments of a call, split at its commas; an omitted one is empty."""
    out, depth, quoted, start = [], 0, False, 0
    for k, c in enumerate(text):
        if c == '"':
            quoted = not quoted
        elif not quoted and c in "([":
            depth += 1
        elif not quoted and c in ")]":
            depth -= 1
        elif not quoted and c == "," and depth == 0:
            out.append(text[start:k].strip())
            start = k + 1
    out.append(text[start:].strip())
    return [] if out == [""] else out


AXES: Final = {"X": 0, "Y": 1, "Z": 2}
ROTARY: Final = "ABC"
_NOTED = """
    SOFT BRISK DRIVE FFWON FFWOF COMPCAD COMPON COMPCURV COMPSURF COMPOF KONT KONTC KONTT NORM
    STOPRE FNORM FLIN DIAMOF CUT2D CUT2DF CUT3DC FIFOCTRL STARTFIFO STOPFIFO PREPRO BLSYNC DYNNORM DYNPOS
    DYNROUGH DYNSEMIFIN DYNFINISH SUPD SBLOF SBLON ASPLINEOF DISPLOF DISPLON ADISPOSA CPRECON CPRECOF PTP CP UPATH
    SPATH WALIMON WALIMOF BRISKA SOFTA SAVE ACTBLOCNO DELAYFSTON DELAYFSTOF ORISON ORISOF ORICONTO PAROTOF TOROTOF
    TOFRAMEOF PRECON LEADOF RTLION RTLIOF EXTERNAL
"""
NOTED: Final = frozenset(_NOTED.split())
_NOTED_CALLS = """
    MSG WORKPIECE CYCLE832 SETMS SETAL GROUP_BEGIN GROUP_END GROUP_ADDEND TRAORI TRAFOOF CLEARM WAITM INIT START
    DELT CYCLE_HSC STOPRE GETT SPOS FXS CTRANS PRIO WAITP M SETM WAITMC WAITE WAITS RELEASE GET GETD CHANDATA
"""
NOTED_CALLS: Final = frozenset(_NOTED_CALLS.split())
NOTED_SET: Final = frozenset({"SPOS", "SPOSA", "ACC", "ADIS", "ADISPOS",
                              "FGREF", "DISC", "SF", "OTOL", "CTOL", "ORISON", "STOLF", "ATOL",
                              "SCC", "G", "H"})  # fmt: skip
EDGE_FEEDS: Final[dict[str, EdgeFeed]] = {"CFC": "all", "CFIN": "inner", "CFTCP": ""}
"""Feed on arcs under compensation: of the contour (as the control starts), of inner arcs only, of the tool centre."""
ORIENTED: Final = frozenset("ORIWKS ORIAXES ORIVECT ORIROTA ORIEULER ORIRPY ORIRPY2 ORIVIRT1 ORIMKS".split())  # noqa: SIM905
FEED_SET: Final = frozenset({"FL", "FA", "OVR", "OVRA", "VELOLIM"})
_KINDS: Final = {
    "splines": "ASPLINE BSPLINE CSPLINE SPLINEPATH",
    "polynomials": "POLY POLYPATH",
    "involutes": "INVCW INVCCW",
    "PAROT": "PAROTS",
    "compensation in space": "CUT3DF CUT3DFS CUT3DFF CUT3DCC CUT3DCCD",
    "probing": "MEAS MEAW MEAC MEAWA MEASA",
    "OEM interpolation": "OEMIPO1",
    "files": "WRITE",
    "contour tables": "CONTPRON",
    "diameters (a lathe)": "DIAMON DIAM90",
    "TANG": "TANGON",
    "coupled axes": "COUPON TRAILON LEADON",
    "curve tables": "CTABDEF",
    "REPOS": "REPOSL REPOSA",
    "PRESETON": "PRESETONS",
    "synchronized actions": "WHEN WHENEVER EVERY",
}
_ALONE = """
    TRANSMIT TRACYL ROTS AROTS CRPL TOFRAME TOROT TOROTX TOROTY PAROT TRAANG GEOAX TANG OFFN TRACON PRESETON
    TCARR TCOABS TCOFR ORICURVE ORIPLANE
"""
REFUSED: Final = {word: kind for kind, words in _KINDS.items() for word in words.split()} | {
    word: word for word in _ALONE.split()
}
"""What is refused by name, and what it is."""
GNOTED: Final = frozenset({9.0, 25.0, 26.0, 60.0, 62.0, 64.0, 290.0, 450.0, 460.0, 461.0, 462.0, 601.0, 602.0, 603.0,
                           621.0, 641.0, 642.0, 643.0, 644.0, 645.0, 810.0,})  # fmt: skip
KNOWN: Final = frozenset(map(float, (
    *range(5), 17, 18, 19, 33, 40, 41, 42, 53, 54, 55, 56, 57, 70, 71, 74, 75, 90, 91, 93, 94, 95, 96, 97, 110, 111, 112, 153,
    331, 332, 451, 700, 710, 961, 962, 971, 973,
)))  # fmt: skip
USED: Final = frozenset({
    *AXES, *ROTARY, "I", "J", "K", "I1", "J1", "K1", "X1", "Y1", "Z1", "CR", "AR", "TURN", "CHF", "CHR", "RND", "RNDM", "FP",
    "FB", "FRC", "FRCM", "A3", "B3", "C3", "AP", "RP", "ANG", "F", "FZ", "S", "T", "D",
})  # fmt: skip
NOT_A_VARIABLE: Final = frozenset({
    "OFFN", "POS", "POSA", "POSP", "THETA", "PHI", "PSI", "NUT", "LEAD", "TILT", "ISD", "DILF", "POLF", "ANG1", "ANG2", "DISR",
    "DISCL", "DISRP", "FAD", "FPR", "FPRAON", "CRPL", "RPL", "OSCILL", "OSP1", "OSP2", "OSCTRL", "TCARR", "TOFFL", "TOFFR",
    "TOFF", "MEAS", "MEAW", "MEASA", "FENDNORM", "GEOAX", "PUTFTOC", "TANG", "CUTMOD", "CUTMODK", "OFFNX", "SPOS", "ROTS",
    "AROTS", "DITS", "DITE", "OVRRAP", "VELOLIMA", "ACCLIMA", "JERKLIMA", "MOV", "SPATH", "UPATH", "XE", "ZE",
})  # fmt: skip
"""Addresses that act on the path and are not supported: no variables of the machine."""
