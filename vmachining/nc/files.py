"""Bytes of a file -> text of a program, its tape marks, and what a text is that is not a program of its dialect.

Nobody is helped by a thousand findings about letters without numbers where the file is a Heidenhain program. A text is looked
at only where reading it found something wrong, and judged by marks that cannot stand in a correct program; comments do not
count. Sources of the marks: Heidenhain TNC 640 conversational (`BEGIN PGM`, `L X+10 FMAX`, `CYCL DEF`), Siemens SINUMERIK 840D
(`CYCLE81(...)`, `DEF REAL`, `X=IC(5)`, `MCALL`), Fanuc custom macro B (`IF [..] GOTO 10`).
"""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from vmachining.errors import NCError


class Foreign(NamedTuple):
    """line : 1-based, of the first mark. word : the mark, as it stands there, in column `col`."""

    line: int
    col: int
    word: str
    what: str
    remedy: str


_POST: Final = "post it for a control that reads ISO G-code, such as LinuxCNC or Fanuc"
_READ_HEIDENHAIN: Final = "read it as that: dialect heidenhain"
_HEIDENHAIN: Final = "a program in the conversational language of Heidenhain controls"
_SIEMENS: Final = "a program of a Siemens control, with commands beyond ISO G-code"
_GCODE: Final = "G-code"
_MACRO: Final = "a program with Fanuc custom macros"

_N: Final = r"(?:^[ \t]*/?[ \t]*(?:[Nn]?[0-9]+[ \t]+)?)"
_MARKS: Final[tuple[tuple[str, str, str], ...]] = (
    # what, remedy, expression of one line
    ("a template, whose directives in braces are not G-code", "let its program write the moves out", r"^[ \t]*\{.*"),
    (_HEIDENHAIN, _READ_HEIDENHAIN, r"^[ \t]*[0-9]*[ \t]*(?:BEGIN|END)[ \t]+PGM\b.*"),
    (_HEIDENHAIN, _READ_HEIDENHAIN, rf"{_N}(?:TOOL CALL|BLK FORM|CYCL (?:DEF|CALL)|CALL LBL|LBL [0-9]+|FN ?[0-9]+:)[^;]*"),
    (_HEIDENHAIN, _READ_HEIDENHAIN, rf"{_N}(?:L|C|CC|CR|CT|CP|LN|LP)[ \t]+I?[XYZABCPD][+-][^;]*"),
    (_HEIDENHAIN, _READ_HEIDENHAIN, r"\bFMAX\b"),
    (_SIEMENS, _POST, r"\b(?:CYCLE|POCKET|HOLES|SLOT|LONGHOLE|WORKPIECE|PROC)[0-9]*[ \t]*\([^;]*"),
    (_SIEMENS, _POST, rf"{_N}(?:DEF[ \t]+(?:REAL|INT|BOOL|STRING|CHAR|AXIS|FRAME)|MCALL|EXTERN|PROC[ \t]+[A-Z])\b[^;]*"),
    (_SIEMENS, _POST, r"\b(?:[A-Z][0-9]*[ \t]*=[ \t]*(?:I|A|D)CP?[ \t]*\(|(?:CR|TURN|AR|RND|CHF)[ \t]*=[ \t]*[0-9.])"),
    (_SIEMENS, _POST, r"\b(?:GOTO[FBC]?[ \t]+[A-Z_]|A?(?:TRANS|ROT|SCALE|MIRROR)[ \t]+[XYZ]|MSG[ \t]*\()"),
    (_SIEMENS, _POST, r"\bSUPA\b|\$[APMST][A-Z]*_"),
    (_SIEMENS, _POST, r"\bR[0-9]+[ \t]*=|\b[XYZIJKF][ \t]*=[ \t]*(?:R[0-9]+|[+-]?[0-9.])"),
    (_MACRO, "let the post write the moves out", r"\b(?:IF|WHILE)[ \t]*\[[^;(]*\][ \t]*(?:GOTO|THEN|DO)[ \t]*[0-9#]*"),
    (_MACRO, "let the post write the moves out", rf"{_N}GOTO[ \t]*[0-9#]+"),
    ("a program of a control whose O words are tool offsets (Acramatic, Devlieg)", _POST, r"\bO[0-9]+\.[0-9]+|\bT[0-9]+O[0-9]+"),
    ("a cutter location file", "read it as that: dialect apt", r"^[ \t]*(?:GOTO|FROM|LOADTL|FEDRAT|PARTNO|CUTTER)[ \t]*/.*"),
    ("a table of poses", "read it as that: dialect poses", r"^[ \t]*x_mm[ \t]*,.*"),
    ("a job file", "give it to vmachining run", r"^\[\[?(?:program|tools|stock)\]\]?[ \t]*$"),
    ("a STEP file, a solid", "it may be the stock or the design of a job", r"^ISO-10303-21\b.*"),
    ("an STL file, a mesh", "it may be the stock of a job", r"^(?:solid\b.*|[ \t]*facet normal .*)"),
    ("a web page", "download the program itself", r"^[ \t]*<(?:!DOCTYPE|html)\b.*"),
    (_GCODE, "read it as that: dialect iso", r"^[ \t]*(?:N[0-9]+[ \t]*)?[GM][0-9]{1,3}(?![0-9A-Z/]*/).*"),
    ("an XML file", "", r"^[ \t]*<\?xml\b.*"),
)  # fmt: skip
_NEVER: Final = (
    ("a file of subroutines of a simulator (VERICUT), not a program", "give the program that a post wrote",
     re.compile(r"CGTECH_(?:MACRO|VAR)\b|;[^\n]*VERICUT[^\n]*\bSUBROUTINE", re.IGNORECASE)),
    ("a program of an older control (SINUMERIK 8xx), with commands @", "post it for SINUMERIK 840D",
     re.compile(r"^[ \t]*(?:N[0-9]+[ \t]*)?@[0-9]{2,3}[ \t]+[RK][0-9]", re.MULTILINE)),
    ("a library of subprograms of an Okuma control, not a program", "give the program that calls them",
     re.compile(r"\A\s*\$[\w-]+\.(?:SSB|SUB|LIB)%", re.IGNORECASE)),
    ("a program for wire erosion", "it cuts with a wire, which is not read",
     re.compile(r"^[ \t]*(?:E[0-9]{3}[ \t]*=(?:[ \t]*[0-9.]+){6}|//[^\n]*\bWEDM\b)", re.IGNORECASE | re.MULTILINE)),
    ("a program of a General Electric control, whose G86 and G87 only move Z", "post it for a control that is read",
     re.compile(r"^[ \t]*(?:N[0-9]+[ \t]*)?G8[67][ \t]*R([-+]?[0-9]+)[ \t]*Z\1(?![0-9.])", re.IGNORECASE | re.MULTILINE)),
    ("a file of event definitions of a post-processor (CDL), not a program", "give the program that the post wrote",
     re.compile(r"^[ \t]*EVENT[ \t]+\w+[^}]*?\bUI_LABEL\b", re.MULTILINE)),
)  # fmt: skip
"""What is read in no dialect: by one mark anywhere in the head."""

_COMPILED: Final = tuple((what, remedy, re.compile(mark, re.IGNORECASE)) for what, remedy, mark in _MARKS)
_COMMENT: Final = re.compile(r"(?<![A-Za-z0-9_])\([^()]*\)|;.*")
"""Not the values after the name of a Siemens cycle."""

_KEYWORDS: Final = {
    "Heidenhain": "BEGIN END PGM BLK FORM TOOL CALL DEF FMAX CYCL LBL APPR DEP",
    "Siemens": "CYCLE MCALL PROC EXTERN REAL INT BOOL STRING GOTOF GOTOB TRANS ATRANS ROT AROT MSG SUPA SOFT BRISK "
    "FFWON FFWOF COMPCAD COMPOF ORIWKS ORIMKS ORIAXES TRAORI WORKPIECE POCKET HOLES RET DIAMOF DIAMON",
    "Fanuc": "GOTO THEN POPEN PCLOS DPRNT",
}  # fmt: skip
_CONTROLS: Final = {word: control for control, words in _KEYWORDS.items() for word in words.split()}

_MAGIC: Final = (
    (b"PK\3\4", "a ZIP archive, or a document"), (b"%PDF", "a PDF document"), (b"\x89PNG", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"), (b"GIF8", "a GIF picture"), (b"\x1f\x8b", "a gzip archive"),
    (b"7z\xbc\xaf", "a 7z archive"), (b"\x7fELF", "an executable"), (b"MZ", "an executable"),
    (b"glTF", "a glTF model"),
)  # fmt: skip
_CONTROL_CHARACTERS: Final = bytes(k for k in range(32) if k not in b"\t\n\r\f\x0e\x0f\x11\x12\x13\x14\x1a")
"""Not those of punched tape and of editors: tab, line and form feeds, shifts, DC1 to DC4, end of file."""

LONGEST: Final = 512
"""Characters of a line that marks are looked for in: their expressions take the square of a run of blanks."""

SAMPLE: Final = 4096
MOST_CONTROL: Final = 0.02
"""Share of control characters above which bytes are not text; random bytes have 8 %, texts in any code page none."""


def binary_kind(data: bytes) -> str | None:
    """What a binary file is ("a ZIP archive"), "" if that is not known, None for a text."""
    head = data[:SAMPLE]
    control = len(head) - len(head.translate(None, _CONTROL_CHARACTERS))
    kind = next((name for magic, name in _MAGIC if head.startswith(magic)), "")
    if len(data) >= 84 and len(data) == 84 + 50 * int.from_bytes(data[80:84], "little"):
        kind = "a binary STL mesh"
    if b"\0" in data or control > max(2, MOST_CONTROL * len(head)) or (kind and control):
        return kind
    return "a PDF document" if head.startswith(b"%PDF") else None


def find_file(folders: Iterable[Path], fits: Callable[[Path], object]) -> Path | None:
    """The first file that fits; folders in their order, in each by name."""
    for folder in folders:
        try:
            entries = sorted(folder.iterdir())
        except OSError:
            continue
        for entry in entries:
            if fits(entry) and entry.is_file():
                return entry
    return None


def keyword_control(word: str) -> str:
    """Control whose language has this keyword, "" for a word of nobody."""
    return _CONTROLS.get(word.upper().rstrip("0123456789"), "")


def never_a_program(head: str) -> Foreign | None:
    """What a text is where no dialect reads it, by a mark in its head; None where it may be a program."""
    for what, remedy, mark in _NEVER:
        if found := mark.search(head):
            line, begin = head.count("\n", 0, found.start()) + 1, head.rfind("\n", 0, found.start()) + 1
            word = found[0].split("\n")[0].strip()[:40]
            return Foreign(line, found.start() - begin + 1, word, what, remedy)
    return None


def recognised(
    lines: Sequence[str], wrong: Iterable[int], dialect: str, g_code: bool = False
) -> Foreign | None:
    """What the text is, by the first mark in lines that were found wrong (1-based); None where none exists."""
    for number in sorted(set(wrong)):
        raw = lines[number - 1][:LONGEST] if number <= len(lines) else ""
        bare = _COMMENT.sub(lambda hit: " " * len(hit[0]), raw.removeprefix("\ufeff"))
        for what, remedy, mark in _COMPILED:
            if what == _SIEMENS and dialect in ("okuma", "sinumerik"):
                continue
            if what == _MACRO and dialect in ("fanuc", "haas", "mazak", "okuma"):
                continue
            if remedy.endswith(f"dialect {dialect}") or (
                what == _GCODE and (g_code or dialect == "sinumerik")
            ):
                continue
            if found := mark.search(bare):
                word = found[0].strip()
                return Foreign(number, max(bare.find(word), 0) + 1, word[:40], what, remedy)
    return None


MAX_BYTES: Final = 128 * 1024 * 1024
"""Largest program: some four million lines. Its moves take about ten times the memory of its text."""

_PLAIN_TEXT: Final = "save it as plain ASCII or UTF-8"


def decode_program(data: bytes, name: str) -> str:
    """Text of a program: UTF-8 (with or without mark), else one character per byte.

    Raises NCError: UTF-16, UTF-32 or binary, or larger than `MAX_BYTES`.
    """
    if len(data) > MAX_BYTES:
        what = f"the program is larger than {MAX_BYTES // 2**20} MB"
        raise NCError(what, file=name, remedy="split it at a tool change")
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        raise NCError("the program is UTF-16 text", file=name, line=1, remedy=_PLAIN_TEXT)
    kind, zero = binary_kind(data), data.find(b"\0")
    if zero >= 0 and not kind:
        head = data[:200]
        if (head[::2].count(0) * 3 > len(head)) != (head[1::2].count(0) * 3 > len(head)):
            raise NCError("the program is UTF-16 text", file=name, line=1, remedy=_PLAIN_TEXT)
    if kind is not None:
        what = f"the file is binary ({kind}), not a program" if kind else "the file is binary, not a program"
        line = data.count(b"\n", 0, zero) + 1 if zero >= 0 else 1
        remedy = "give the program itself" if kind else _PLAIN_TEXT
        raise NCError(what, file=name, line=line, remedy=remedy)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def find_tape(lines: Sequence[str]) -> tuple[int, int, bool]:
    """First line, line after the last, and whether a closing mark ends the program (0-based lines).

    A single mark opens the program, unless nothing stands after it: then it closes it, and the first line is 0.
    """
    marks = [index for index, line in enumerate(lines) if "%" in line and line.strip(" \t") == "%"]
    if not marks:
        return 0, len(lines), False
    if len(marks) > 1:
        return marks[0] + 1, marks[1], True
    before = any(line.strip() for line in lines[: marks[0]])
    if before and not any(line.strip() for line in lines[marks[0] + 1 :]):
        return 0, marks[0], True
    return marks[0] + 1, len(lines), False
