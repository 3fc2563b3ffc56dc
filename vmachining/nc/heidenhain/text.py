"""Text of conversational programs: blocks, and the words of a motion block.

A block may run over several lines: `~` at the end continues it, and so do the `Q200=...` lines of a cycle that carry
no block number. Comments open with `;`, structure lines with `*`. Decimal commas are points.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final, NamedTuple

from vmachining.nc.execution import Block

LONGEST: Final = 4096
TERM: Final = r"([+-]?\s*(?:Q[LR]?\d+|\d+\.?\d*|\.\d+))"
"""A number or a parameter, as a group of a pattern."""


class Word(NamedTuple):
    """key : "X", "PA", "LEN", "RL", "M", "FMAX", ...; value : text of the number or parameter, "" without one."""

    key: str
    value: str
    incremental: bool
    text: str


_NUMBERED: Final = re.compile(r"[ \t]*(/?)[ \t]*(\d+)(?:[ \t]+|$)")
"""A control writes the slash of a skipped block before its number, `/ 13 STOP`; `13 /STOP` is the older form."""
_PARAMETER: Final = re.compile(r"[ \t]*Q\d{3,4}[ \t]*=", re.IGNORECASE)
_CYCLE: Final = re.compile(r"[ \t]*/?[ \t]*\d*[ \t]*/?[ \t]*CYCL[ \t]+DEF[ \t]+\d{3}\b", re.IGNORECASE)
_ASIDE: Final = re.compile(r"\(.*\)")
"""A line in round brackets, which no block is: a remark that editors and simulators write."""
_COMMA: Final = re.compile(r"(?<=\d),(?=\d)")
_QUOTED: Final = re.compile(r'"[^"]*"')


def spans(text: str) -> frozenset[int]:
    """`3-6 14`: the numbers 3 to 6 and 14."""
    ends = ([int(number) for number in part.split("-")] for part in text.split())
    return frozenset(number for pair in ends for number in range(pair[0], pair[-1] + 1))


def blocks(lines: Sequence[str]) -> list[Block]:
    """Every block; empty lines and comments are left out."""
    out: list[Block] = []
    at = 0
    while at < len(lines):
        first, raw = at, lines[at]
        parts = [raw]
        cycle = _CYCLE.match(raw) is not None
        size = len(raw)
        while at + 1 < len(lines) and size < LONGEST:
            more = lines[at + 1]
            if not (parts[-1].rstrip().endswith("~") or (cycle and _PARAMETER.match(more))):
                break
            parts.append(more)
            size += len(more)
            at += 1
        at += 1
        number = _NUMBERED.match(raw)
        n = int(number[2][:9]) if number else None
        parts[0] = raw[number.end() :] if number else raw
        text = " ".join(_bare(part) for part in parts).strip()
        skip = text.startswith("/")
        text = text[1:].lstrip() if skip else text
        skip = skip or bool(number and number[1])
        if _ASIDE.fullmatch(text):
            continue
        if text and not text.startswith("*") and not parts[0].lstrip().startswith(";"):
            out.append(Block(first + 1, n, text, raw, skip=skip))
    return out


def _bare(part: str) -> str:
    """Without comment and continuation mark, in capitals but for what is quoted."""
    cut = _QUOTED.sub(lambda hit: "\0" * len(hit[0]), part)
    end = cut.find(";")
    part = part if end < 0 else part[:end]
    part = part.rstrip().rstrip("~")
    kept: list[str] = []

    def hold(hit: re.Match[str]) -> str:
        kept.append(hit[0])
        return "\0"

    part = _COMMA.sub(".", _QUOTED.sub(hold, part).upper())
    for text in kept:
        part = part.replace("\0", text, 1)
    return part.replace("\t", " ").strip()


_VALUE: Final = r"[ ]*([+-]?[ ]*(?:\d+\.?\d*|\.\d+|Q[LR]?\d+))"
_WORD: Final = re.compile(
    r"[ ]*(?:(?P<dir>DR)[ ]*(?P<sign>[+-])(?![ ]*[\dQ.])"
    r"|(?P<fmax>F[ ]*(?:MAX|AUTO))"
    rf"|(?P<mb>MB)(?:[ ]*(?P<mbmax>MAX)|{_VALUE})"
    r"|(?P<comp>R[LR0](?![\d.Q])|R(?![ ]*[+-]?[ ]*[\dQ.+-]))"
    r"|(?P<par>R[+-])(?![ ]*[\dQ.])"
    rf"|(?P<inc>I?)(?P<key>P[AR]|LEN|CCA|N[XYZ]|T[XYZ]|[XYZABCUVWHE]|F[UZT]?|R|DR|M|LA|S|T){_VALUE}"
    r"|(?P<bare>F|M)(?![A-Z0-9+.-]))"
)


def words(text: str) -> tuple[list[Word], str]:
    """Words of a motion block behind its keyword, and the rest of the text."""
    out: list[Word] = []
    at = 0
    while at < len(text):
        found = _WORD.match(text, at)
        if found is None or found.end() == at:
            break
        at = found.end()
        body = found[0].strip()
        if found["dir"]:
            out.append(Word("DR", found["sign"], False, body))
        elif found["fmax"]:
            out.append(Word("FMAX" if "MAX" in body else "FAUTO", "", False, body))
        elif found["mb"]:
            out.append(Word("MB", found["mbmax"] or found[6], False, body))
        elif found["comp"]:
            out.append(Word("COMP", found["comp"], False, body))
        elif found["par"]:
            out.append(Word("PAR", found["par"], False, body))
        elif found["key"]:
            value = re.sub(r"[ ]", "", found[11])
            out.append(Word(found["key"], value, bool(found["inc"]), body))
        elif found["bare"] == "F":
            out.append(Word("F", "", False, body))
    return out, text[at:].strip()
