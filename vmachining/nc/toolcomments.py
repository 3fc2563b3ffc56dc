"""What comments of a program say of its tools, as post-processors print them.

    (T1 D=10. CR=0. - ZMIN=-5. - flat end mill)                    Fusion, HSM; TAPER=118deg of drills and chamfers
    ( T1 | 10. FLAT ENDMILL | H1 | D1 | TOOL DIA. - 10. )          Mastercam
    (TOOL - 3 DIA. OFF. - 3 LEN. - 3 TOOL DIA. - .5)               Mastercam, older
    (T2 : BALL NOSE D6 R3)   (TOOL 4: 1/4 INCH END MILL)   ; T5 = Drill {6 mm}   (T1 = 10.0 dia. ENDMILL)

A comment belongs to the tool that it names, else to the T word of its line, else to the next tool change within
three lines. Nothing is invented: what no comment says is None. Numbers are in the unit of the program unless a unit
stands behind them.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

__all__ = ["ToolNote", "cutter_notes", "tool_notes"]

INCH: Final = 25.4
HEADER: Final = 20
NEAR: Final = 3
"""Lines between a comment and the tool change that it introduces."""

_COMMENT: Final = re.compile(r"\(([^()]*)\)|;(.*)")
_NAMED: Final = re.compile(
    r"(?:\bTOOL\s*(?:NUMBER|NO\.?|NR\.?|#)?\s*[-:=#]?\s*T?|\bT)\s*0*(\d{1,5})(?![\d.])", re.IGNORECASE
)
_CALL: Final = re.compile(r"(?<![A-Za-z])[Tt][ \t]*0*(\d{1,5})(?![\d.])")
_NUMBER: Final = r"(\d+\s+\d+/\d+|\d+/\d+|\d*\.\d+|\d+\.?)"
_UNIT: Final = r"\s*(mm\b|inch\b|in\b|\")?"
_DIAMETER: Final = (
    re.compile(rf"\bTOOL\s+DIA(?:METER)?\.?\s*[-:=]?\s*{_NUMBER}{_UNIT}", re.IGNORECASE),
    re.compile(rf"\bDIA(?:METER|M)?\.?(?!\s*OFF)\s*[-:=]\s*{_NUMBER}{_UNIT}", re.IGNORECASE),
    re.compile(rf"(?:\bD\s*=\s*|[Øø⌀]\s*){_NUMBER}{_UNIT}", re.IGNORECASE),
    re.compile(rf"(?:\b|_)D{_NUMBER}{_UNIT}(?=[\s,;_|R)-]|$)", re.IGNORECASE),
    re.compile(rf"(?<![\w.=-]){_NUMBER}{_UNIT}\s*DIA\b", re.IGNORECASE),
    re.compile(rf"(?<![\w.=-]){_NUMBER}\s*(mm\b|inch\b|in\b|\")", re.IGNORECASE),
    re.compile(rf"\|\s*{_NUMBER}(\s)(?=[A-Z ]*(?:MILL|DRILL|NOSE|CUTTER|TAP|REAM))", re.IGNORECASE),
)
_CORNER: Final = (
    re.compile(rf"\b(?:CR|CORNER\s+(?:RADIUS|RAD\.?))\s*[-:=]?\s*{_NUMBER}{_UNIT}", re.IGNORECASE),
    re.compile(rf"(?:\b|_|(?<=[\d.]))R\s*=?\s*{_NUMBER}{_UNIT}(?=[\s,;_|)-]|$)", re.IGNORECASE),
)
_TAPER: Final = re.compile(r"\b(?:TAPER|ANGLE|TIP)\s*[-:=]\s*(\d+\.?\d*)", re.IGNORECASE)
_DEGREES: Final = re.compile(r"(?<![\w.])(\d+\.?\d*)\s*(?:DEG|°)", re.IGNORECASE)
_KINDS: Final = (  # the first that fits
    ("drill", re.compile(r"DRILL|SPOT|CENTER\b", re.IGNORECASE)),
    ("chamfer", re.compile(r"CHAMFER|COUNTERSINK|V-?BIT|ENGRAV", re.IGNORECASE)),
    ("tap", re.compile(r"\bTAP\b|\bTHREAD", re.IGNORECASE)),
    ("bore", re.compile(r"REAM|\bBOR(?:E|ING)\b", re.IGNORECASE)),
    ("ball", re.compile(r"BALL|SPHER|KUGEL", re.IGNORECASE)),
    ("bull", re.compile(r"BULL|TORUS|TOROID|CORNER\s+RAD|RADIUS\s+(?:END|MILL)", re.IGNORECASE)),
    ("taper", re.compile(r"TAPER(?:ED)?\s+MILL|CONICAL", re.IGNORECASE)),
    ("flat", re.compile(r"FLAT|END\s*-?MILL|SLOT|FACE\s*-?MILL|SHELL|CYLINDRICAL|\bEM\b", re.IGNORECASE)),
)  # fmt: skip


class ToolNote(NamedTuple):
    """What is said of a tool. line : 1-based, of the first comment; text : that comment.

    kind : "flat", "ball", "bull", "taper", "drill", "chamfer", "tap", "bore" or None. diameter_mm, corner_mm : or None.
    angle_deg : of the tip of a drill (whole), of a chamfer or taper (half).
    """

    line: int
    text: str
    kind: str | None = None
    diameter_mm: float | None = None
    corner_mm: float | None = None
    angle_deg: float | None = None


def tool_notes(lines: Sequence[str], numbers: Sequence[int], scale: float) -> dict[int, ToolNote]:
    """What comments say of the tools `numbers`.

    Parameters
    ----------
    scale : mm per unit of the program.
    """
    named, nearby = dict[int, ToolNote](), dict[int, ToolNote]()
    waiting: list[tuple[int, str]] = []
    for line, raw in enumerate(lines, start=1):
        if "(" not in raw and ";" not in raw and "T" not in raw.upper():
            continue
        call = _CALL.search(_COMMENT.sub(" ", raw))
        called = int(call[1]) if call else None
        for text in _comments(raw):
            own = _NAMED.search(text)
            if own and int(own[1]) in numbers:
                _add(named, int(own[1]), _note(line, text, scale))
            elif called is None:
                waiting.append((line, text))
            elif called in numbers:
                _add(nearby, called, _loose(line, text, scale))
        if called is not None:
            for at, text in waiting:
                if line - at <= NEAR and called in numbers:
                    _add(nearby, called, _loose(at, text, scale))
            waiting.clear()
    for number, note in nearby.items():
        _add(named, number, note)
    if len(numbers) == 1 and (numbers[0] not in named or named[numbers[0]].diameter_mm is None):
        for line, raw in enumerate(lines[:HEADER], start=1):  # a header can mean this one only
            for text in _comments(raw):
                said = _loose(line, text, scale)
                if said is not None and said.kind is not None and said.diameter_mm is not None:
                    _add(named, numbers[0], said)
    return named


def cutter_notes(lines: Sequence[str], scale: float) -> dict[int, ToolNote]:
    """Cutters of a cutter location file: CUTTER/d[,r] belongs to the LOADTL or TOOLNO before it, or behind it.

    Parameters
    ----------
    scale : mm per unit of the file.
    """
    found: dict[int, ToolNote] = {}
    number, last = 1, None
    for line, raw in enumerate(lines, start=1):
        word, _, values = raw.partition("/")
        if word.strip().upper() in ("LOADTL", "TOOLNO") and (own := re.match(r"\s*(\d+)", values)):
            number = int(own[1])
            if last is not None and number not in found:
                found[number] = last
        if word.strip().upper() == "CUTTER" and (sizes := re.findall(r"[\d.]+", values)):
            diameter, corner = (scale * float(v) for v in (*sizes, "0")[:2])
            last = ToolNote(line, raw.strip(), None, diameter, corner)
            found[number] = last
    return found


def _comments(raw: str) -> list[str]:
    return [(hit[1] if hit[1] is not None else hit[2]).strip() for hit in _COMMENT.finditer(raw)]


def _add(found: dict[int, ToolNote], number: int, note: ToolNote | None) -> None:
    """Take what a comment says; what was said before stands."""
    if note is None:
        return
    old = found.get(number)
    if old is not None:
        kept: dict[str, Any] = {name: v for name, v in old._asdict().items() if v is not None}
        note = note._replace(**kept)
    found[number] = note


def _loose(line: int, text: str, scale: float) -> ToolNote | None:
    """What a comment without a tool number says: only where it names a cutter, or a diameter by its letter."""
    note = _note(line, text, scale)
    if note is None or (note.kind is None and _first(_DIAMETER[:4], text, scale) is None):
        return None
    return note


def _note(line: int, text: str, scale: float) -> ToolNote | None:
    """What a comment says, None where it says nothing of a tool."""
    kind = next((name for name, words in _KINDS if words.search(text)), None)
    diameter = _first(_DIAMETER, text, scale)
    corner = _first(_CORNER[: 2 if kind or diameter else 1], text, scale)
    angle = _TAPER.search(text) or (_DEGREES.search(text) if kind in ("drill", "chamfer", "taper") else None)
    if kind == "ball" and diameter is None and corner is not None:
        diameter = 2.0 * corner
    if kind is None and diameter is None and corner is None:
        return None
    return ToolNote(line, text, kind, diameter, corner, float(angle[1]) if angle else None)


def _first(patterns: Sequence[re.Pattern[str]], text: str, scale: float) -> float | None:
    """The first number that a pattern finds, mm."""
    for pattern in patterns:
        if found := pattern.search(text):
            unit = (found[2] or "").strip().lower()
            value = sum(_value(part) for part in found[1].split())
            return round(value * (1.0 if unit == "mm" else INCH if unit else scale), 9)
    return None


def _value(text: str) -> float:
    top, _, bottom = text.partition("/")
    return float(top) / float(bottom) if bottom and float(bottom) else float(top)
