"""What comments of a program say of its tools, as post-processors print them.

    (T1 D=10. CR=0. - ZMIN=-5. - flat end mill)   ; #1 D=10 CR=0 - flat end mill     Fusion, HSM; TAPER=118deg
    (TOOL/MILL,3.175,0,0,0) CutViewer, MeshCAM, Carbide Create     ;tool_radius = 0.5  PyCAM     ( T0 : 1.0 ) CamBam
    ( T1 | 10. FLAT ENDMILL | H1 | D1 | TOOL DIA. - 10. )          Mastercam
    (TOOL - 3 DIA. OFF. - 3 LEN. - 3 TOOL DIA. - .5)               Mastercam, older
    (T2 : BALL NOSE D6 R3)   (TOOL 4: 1/4 INCH END MILL)   ; T5 = Drill {6 mm}   (T1 = 10.0 dia. ENDMILL)

A comment belongs to the tool that it names, else to the T word of its line, else to the next tool change within
three lines. Nothing is invented: what no comment says is None. Numbers are in the unit of the program unless a unit
follows them; fractions are inches (1/4 DRILL).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

INCH: Final = 25.4
HEADER: Final = 60
NEAR: Final = 3
"""Lines between a comment and the tool change that it introduces, or follows."""

_COMMENT: Final = re.compile(r"\(([^()]*)\)|;(.*)")
_NAMED: Final = re.compile(
    r"(?:\bTOOL\s*(?:NUMBER|NO\.?|NR\.?|#)?\s*[-:=#]?\s*T?|\bT|^#(?=\d+\s+D\s*=))\s*0*(\d{1,5})(?![\d./])",
    re.IGNORECASE,
)
_CALL: Final = re.compile(r"(?<![A-Za-z])[Tt][ \t]*0*(\d{1,5})(?![\d.])")
_CHANGE: Final = re.compile(
    r"(?<![A-Za-z])T[ \t]*\d+.*?M[ \t]*0*6(?![\d.])|M[ \t]*0*6(?![\d.]).*?(?<![A-Za-z])T[ \t]*\d",
    re.IGNORECASE,
)
"""T and M6 in one line: in such a program a T word alone only gets the next tool ready."""
NUMBER: Final = r"(\d+[\s-]\d+/\d+|\d+/\d+|\d*\.\d+|\d+\.?)"
_UNIT: Final = r"\s*(mm\b|inch\b|in\b|\")?"
_DIAMETER: Final = (
    re.compile(rf"\bTOOL\s+DIA(?:METER)?\.?\s*[-:=]?\s*{NUMBER}{_UNIT}", re.IGNORECASE),
    re.compile(
        rf"(?<![A-Za-z0-9.=-])(?<!LEN\. - )(?<!OFF\. - )(?<!LEN - ){NUMBER}{_UNIT}[\s_]*DIA\b(?!\.?\s*OFF)",
        re.IGNORECASE,
    ),
    re.compile(
        rf"\bDIA(?:METER|M)?(?:\.?(?:\s+OUTIL)?(?!\s*OFF)\s*[-:=]|\.|(?<=[MR])\s)\s*{NUMBER}{_UNIT}",
        re.IGNORECASE,
    ),
    re.compile(rf"(?:\bD\s*=\s*|\bFI\s*|[Øø⌀]\s*){NUMBER}{_UNIT}", re.IGNORECASE),
    re.compile(rf"(?<![A-Za-z0-9])D{NUMBER}{_UNIT}(?=[\s,;_|R)-]|$)", re.IGNORECASE),
    re.compile(rf"(?<![\w.=-]){NUMBER}\s*(mm\b|inch\b|in\b|\")", re.IGNORECASE),
    re.compile(rf"^T\d+\s*:\s*{NUMBER}(\s*)$", re.IGNORECASE),
)
_NAMING: Final = (
    re.compile(rf"\|\s*{NUMBER}(\s)(?=[A-Z ]*(?:MILL|DRILL|NOSE|CUTTER|TAP|REAM))", re.IGNORECASE),
    re.compile(
        r"(?<![\w./=#-])((?:\d+[\s-])?\d+/\d+|\d*\.\d+)(\s+)"
        r"(?=(?:(?!C?R(?:AD\w*)?\b|CORNER)[A-Z0-9]+[ -]+){0,3}?(?:BALL|BULL|FLAT|END *MILL|"
        r"FACE *MILL|(?:SPOT *)?DRILL|REAM|CHAMFER|CENTER|E\.?M\b|ROUGH|RGH|RUFF|UP-?CUT|INDEX|INSERT|SHELL|\d+ *-?FL))",
        re.IGNORECASE,
    ),
)
"""A number before the name of a cutter: its diameter, but for the angles of tips (90 SPOT DRILL)."""
_END: Final = r"(?=\s*(?:$|[,;|)_]|C?R\s*=?\s*\d|HM\b|HSS|VHM|CARB|\d+\s*-?FL))"
_BESIDE: Final = re.compile(
    rf"\w*(?:MILL|CUTTER|DRILL|NOSE|\bE\.?M\.?|FR(?:AE|Ä)S(?:ER)?|FRAISE|FRES[AE]?|FREES|FREZA?|ФРЕЗА|BOHRER|BROCA|PUNTA|FORET|"
    rf"WIERTLO|WIERTŁO|СВЕРЛО|REAMER)[\s_:=-]*{NUMBER}{_UNIT}(?![\d./]){_END}",
    re.IGNORECASE,
)
"""A number after the name of a cutter: most likely its diameter, so a guess that is said."""
_DOTTED: Final = re.compile(r"(?<![A-Za-z0-9])D\.(\d{1,2})(?![\d.])", re.IGNORECASE)
"""In mm an abbreviation (FRESA D.10) or a tenth: a guess, where it is large enough for the first."""
_THREAD: Final = re.compile(
    r"\bM(\d+(?:\.\d+)?)(?=$|[\sX_,;|)-])|(?<![\d./])((?:\d-)?\d+/\d+)-\d+\b", re.IGNORECASE
)
_COMMA: Final = re.compile(r"(?<=\d),(?=\d{1,3}(?!\d|,|\s*-?FL))", re.IGNORECASE)
"""Of a decimal number; lists of numbers have more of them."""
_GAUGE: Final = re.compile(
    r"(?:(?:#|\bNO\.?[ ]*|\bNUMBER[ ]+)0*([1-9]\d?)|\b(?:LETTER|LTR)[ ]+([A-Z]))[ -]+(?:[A-Z]+[ -]+){0,2}DRILL",
    re.IGNORECASE,
)
_NUMBERS: Final = (
    2280, 2210, 2130, 2090, 2055, 2040, 2010, 1990, 1960, 1935, 1910, 1890, 1850, 1820, 1800, 1770, 1730, 1695, 1660, 1610,
    1590, 1570, 1540, 1520, 1495, 1470, 1440, 1405, 1360, 1285, 1200, 1160, 1130, 1110, 1100, 1065, 1040, 1015, 995, 980, 960,
    935, 890, 860, 820, 810, 785, 760, 730, 700, 670, 635, 595, 550, 520, 465, 430, 420, 410, 400,
)  # fmt: skip
_LETTERS: Final = (
    2340, 2380, 2420, 2460, 2500, 2570, 2610, 2660, 2720, 2770, 2810, 2900, 2950, 3020, 3160, 3230, 3320, 3390, 3480, 3580,
    3680, 3770, 3860, 3970, 4040, 4130,
)  # fmt: skip
"""Drills by numbers 1 to 60 and letters, 0.0001 inch (ANSI B94.11M)."""
LEAST_MM, MOST_MM = 3.0, 130.0
"""A whole number below the first may count operations or flutes, one above the second may be a name."""
ANGLES: Final = frozenset({45.0, 60.0, 82.0, 90.0, 100.0, 118.0, 120.0, 135.0, 140.0, 145.0})
"""Of the tips of drills and chamfer mills: beside their names no diameters."""

_BEFORE: Final = r"(?:STICK[ -]?OUT|OVERHANG|PROJECTION|REACH|LENGTH|DEPTH|STEP[ -]?(?:OVER|DOWN))"
_LENGTHS: Final = rf"(?:{_BEFORE}|DEEP|LEAVE|STOCK)"
_OTHER: Final = re.compile(
    rf"\b{_LENGTHS}[ :=-]*{NUMBER}{_UNIT}"
    rf"|(?<![\w.=-]){NUMBER}{_UNIT}\s*(?:{_BEFORE}(?![ :=-]*\.?\d)|DEEP|LEAVE|STOCK|"
    r"LONG(?![ -]*(?:REACH|SERIES|END|BALL|DRILL)))\b"
    rf"|\b(?:CLEARANCE|ALLOWANCE|LEAVE|FEED|HOLDER|SHANK|ARBOR)(?:[ ]*DIA\w*\.?)?[ :=-]*[DØø⌀]?[ =]*{NUMBER}{_UNIT}"
    r"|\bOFF(?:SET)?\.?[ :=#-]*[HD][ =]*\d+|\b[HD][ =]*\d+[ ]*OFF(?:SET)?\b",
    re.IGNORECASE,
)
"""Lengths that are not diameters of a cutter, and registers."""

_REGISTER: Final = re.compile(r"\b([HD])0*(\d+)(?![\d.])", re.IGNORECASE)
LONGEST: Final = 400
"""Characters of a comment that are looked at: the cost of some patterns is the square of a length."""

_MILL: Final = re.compile(
    r"FR(?:AE|Ä)SER|FRAISE\b|FRES[AE]?\b|FREES\b|FREZA?\b|ФРЕЗА\b|铣刀|CUTTER|ROUGHER|\bRGH\b|UP-?CUT|CARBIDE|"
    r"\bVHM\b|\bHSS|\d *-?FL(?:UTES?|T)?\b",
    re.IGNORECASE,
)
"""Words that tell a cutter, and nothing of its shape."""
_WHOLE: Final = re.compile(r"V-?BIT|ENGRAV", re.IGNORECASE)
"""Of these the angle is that of the whole tip."""

_CUTVIEWER: Final = re.compile(r"TOOL/(MILL|DRILL|CHAMFER)((?:[ ]*,[ ]*-?[\d.]+)+)", re.IGNORECASE)
_CUTTER: Final = re.compile(r"\b(?:TOOL|BIT|CUTTER|MILL)\b.*\bDIA|TOOL_RADIUS", re.IGNORECASE)
_ROW: Final = re.compile(r"TOOL (DIAMETER|CORNER RADIUS)\b", re.IGNORECASE)
"""A sheet of one tool, a line for each size, as NX writes it before the call."""
_RADIUS: Final = re.compile(rf"\bTOOL_RADIUS\s*=\s*{NUMBER}{_UNIT}", re.IGNORECASE)
_CORNER: Final = (
    re.compile(rf"\b(?:CR|CORNER\s+(?:RADIUS|RAD\.?)|RAYON)\s*[-:=]?\s*{NUMBER}{_UNIT}", re.IGNORECASE),
    re.compile(rf"(?<![A-Za-z])R\s*=?\s*{NUMBER}{_UNIT}(?=[\s,;_|)-]|$)", re.IGNORECASE),
)
_TAPER: Final = re.compile(r"\b(?:TAPER|ANGLE|TIP)\s*[-:=]\s*(\d+\.?\d*)", re.IGNORECASE)
_FLUTES: Final = re.compile(r"(?<![\w./])(\d{1,2})[ -]*FL(?:UTES?|T)?\b", re.IGNORECASE)
_DEGREES: Final = re.compile(r"(?<![A-Za-z0-9.])(\d+\.?\d*)\s*(?:DEG|GRAD|°)", re.IGNORECASE)
WHOLE: Final = 80.0
"""Degrees from which the angle of a chamfer mill is that of its whole tip."""
_KINDS: Final = (  # the first that fits
    ("tap", re.compile(r"GEWINDE|TARAUD|MASCHIO|\bMACHO\b|МЕТЧИК|GWINT|丝锥|丝攻", re.IGNORECASE)),  # a Gewindebohrer is no drill
    ("flat", re.compile(r"BOHRNUT|SLOT\s*-?DRILL", re.IGNORECASE)),
    ("drill", re.compile(r"DRILL|SPOT|CENTER\b|BOHR|\bFORET|\bBROCA|\bPUNTA\b|СВЕРЛО|WIERT[LŁ]O|钻", re.IGNORECASE)),
    ("chamfer", re.compile(r"CHAMFER|COUNTERSINK|V-?BIT|ENGRAV|FASE|SENKER|ENT(?:GRAT|FR(?:AE|Ä)S)|CHANFREIN|AVELLAN|倒角",
                           re.IGNORECASE)),
    ("tap", re.compile(r"\bTAP\b|\bTHREAD", re.IGNORECASE)),
    ("bore", re.compile(r"REAM|\bBOR(?:E|ING)\b|REIBAHLE|AUS(?:DREH|SPINDEL)|AL[EÉ]SOIR", re.IGNORECASE)),
    ("ball", re.compile(r"BALL|SPHER|KUGEL|H[EÉ]MISPH|SF[EÉ]RIC|СФЕР|球", re.IGNORECASE)),
    ("bull", re.compile(r"BULL|TORUS|TORI(?:QUE|SCH)|TOROID|CORNER\s+RAD|RADIUS\s+(?:END|MILL)", re.IGNORECASE)),
    ("taper", re.compile(r"TAPER(?:ED)?\s+MILL|CONICAL|KEGELFR", re.IGNORECASE)),
    ("flat", re.compile(r"FLAT|END\s*-?MILL|SLOT|FACE\s*-?MILL|SHELL|CYLINDRICAL|\bE\.?M(?![A-Z])|平刀|立铣|"
                        r"SCHAFT|WALZEN|MESSERKOPF|PLANFR",
                        re.IGNORECASE)),
)  # fmt: skip


class ToolNote(NamedTuple):
    """What is said of a tool. line : 1-based, of the first comment; text : that comment.

    kind : "flat", "ball", "bull", "taper", "drill", "chamfer", "tap", "bore" or None. diameter_mm, corner_mm : or None.
    angle_deg : of the tip of a drill (whole), of a chamfer or taper (half). flutes : number of teeth.
    guess : where the diameter is a guess, the words that it was taken from. place : of a library that nobody named,
        its file. guess_kind : why the kind is one that no comment gives.
    """

    line: int
    text: str
    kind: str | None = None
    diameter_mm: float | None = None
    corner_mm: float | None = None
    angle_deg: float | None = None
    flutes: int | None = None
    length_mm: float | None = None
    guess: str | None = None
    place: str | None = None
    guess_kind: str | None = None


def tool_notes(lines: Sequence[str], numbers: Sequence[int], scale: float) -> dict[int, ToolNote]:
    """What comments say of the tools `numbers`. scale : mm per unit of the program."""
    named, nearby, after = dict[int, ToolNote](), dict[int, ToolNote](), list[tuple[int, int, str]]()
    waiting: list[tuple[int, str]] = []
    sheet: dict[str, tuple[int, str]] = {}
    last, change = 0, 0
    changing = any("T" in raw.upper() and _CHANGE.search(_COMMENT.sub(" ", raw)) for raw in lines)
    for line, raw in enumerate(lines, start=1):
        if "(" not in raw and ";" not in raw and "T" not in raw.upper():
            sheet.clear()
            continue
        bare = _COMMENT.sub(" ", raw)
        call = _CALL.search(bare)
        if call and changing and not _CHANGE.search(bare) and bare.strip() == call[0].strip():
            continue  # the next tool gets ready
        called = int(call[1]) if call else None
        for text in comments(raw):
            own = _NAMED.search(text, 0, LONGEST)
            if own and (int(own[1]) or 1) in numbers:
                _add(named, int(own[1]) or 1, _note(line, text, scale))
            elif called is None:
                waiting.append((line, text))
                if row := _ROW.match(text):
                    key = row[1].upper()
                    # a list of several tools does not say which one is meant
                    sheet[key] = (line, "" if key in sheet else text)
                if line - change <= NEAR and last in numbers:
                    after.append((last, line, text))
            elif called in numbers:
                _add(nearby, called, _loose(line, text, scale))
        if called is not None:
            for at, text in sheet.values():
                note = _note(at, text, scale) if called in numbers and text else None
                _add(nearby, called, note and note._replace(kind=None))
            sheet.clear()
            for at, text in waiting:
                if line - at <= NEAR and called in numbers:
                    _add(nearby, called, _loose(at, text, scale))
                    after = [item for item in after if item[1] != at]
            waiting.clear()
            last, change = called, line
    for number, note in nearby.items():
        _add(named, number, note)
    if len(numbers) == 1:  # a header can mean this one only
        head = (
            (numbers[0], line, text) for line, raw in enumerate(lines[:HEADER], 1) for text in comments(raw)
        )
        after += [item for item in head if _CUTTER.search(item[2]) or (
            (said := _loose(*item[1:], scale)) is not None and said.kind is not None and
            (said.diameter_mm is not None or "CUTTER" in item[2].upper()))]  # fmt: skip
    for number, line, text in after:
        if number not in named or named[number].diameter_mm is None:
            _add(named, number, _loose(line, text, scale))
    return named


def cutter_notes(lines: Sequence[str], scale: float) -> dict[int, ToolNote]:
    """Cutters of a cutter location file: CUTTER/d,r,e,f,alpha,beta,h or TLDATA of the tool that is loaded next to it.

    scale : mm per unit of the file.
    """
    found: dict[int, ToolNote] = {}
    names: dict[str, int] = {}
    number, name = 1, ""
    waiting: ToolNote | None = None  # a cutter that no LOAD has claimed since the last motion
    bare = False  # a LOAD since the last motion that has no cutter yet
    for line, raw in enumerate(lines, start=1):
        word, _, values = raw.strip().removeprefix("$$->").partition("/")
        word = word.strip().upper()
        own = re.match(r"\s*(?:TOOL\s*,)?\s*(\d+)", values, re.IGNORECASE)
        if word == "TOOL PATH":
            name = values.partition(",TOOL,")[2].strip() or values
            number = names.setdefault(name, len(names) + 1)
            waiting, bare = None, False
        elif word in ("LOADTL", "TOOLNO", "LOAD") and own:
            number = int(own[1])
            if name:
                names[name] = number
            if waiting is not None:
                found[number] = waiting
            waiting, bare = None, waiting is None
        elif word in ("CUTTER", "TLDATA") and (note := _cutter(line, word, raw.strip(), values, scale)):
            if bare:
                if word == "CUTTER" or number not in found:
                    found[number] = note
            elif waiting is None or word == "CUTTER":  # CUTTER has all sizes, TLDATA some of them
                waiting = note
        elif word in ("GOTO", "GODLTA", "FROM"):
            if waiting is not None:
                found.setdefault(number, waiting)
            waiting, bare = None, False
    if waiting is not None:
        found.setdefault(number, waiting)
    return found


def _cutter(line: int, word: str, text: str, values: str, scale: float) -> ToolNote | None:
    """CUTTER/d,r,e,f,alpha..., TLDATA/MILL,d,r,length,taper,tip or TLDATA/DRILL,MILL,d,r,length,tip,flute."""
    sizes = [float(v) for v in re.findall(r"(?<![A-Za-z_\d.])-?(?:\d+\.?\d*|\.\d+)", values)]
    if not sizes or sizes[0] <= 0.0:
        return None
    given = [*sizes, *[0.0] * 7]
    diameter, corner, kind, angle = scale * given[0], scale * given[1], None, None
    if word == "CUTTER" and len(sizes) >= 5 and given[1] == 0.0 and 0.0 < given[4] < 90.0:
        if abs(given[2] - given[0] / 2.0) < 1e-6 * given[0]:
            kind, angle = "drill", 180.0 - 2.0 * given[4]
    elif word == "TLDATA" and values.upper().lstrip().startswith("DRILL"):
        kind, angle = "drill", given[3] or None
    elif word == "TLDATA" and (not values.upper().lstrip().startswith("MILL") or given[3] or given[4]):
        name = values.partition(",")[0].strip().upper()
        kind = "taper" if name == "MILL" and given[3] and not given[4] else None
        angle = given[3] if kind else None
    long = scale * (given[6] if word == "CUTTER" else given[2])
    held = max(corner, diameter / 2.0 if kind == "drill" else 0.0)  # no length is shorter than the tip
    return ToolNote(line, text, kind, diameter, None if kind == "drill" else corner, angle,
                    length_mm=long if long > held else None)  # fmt: skip


def comments(raw: str) -> list[str]:
    """Texts in brackets, and after a semicolon."""
    return [(hit[1] if hit[1] is not None else hit[2]).strip() for hit in _COMMENT.finditer(raw)]


def _add(found: dict[int, ToolNote], number: int, note: ToolNote | None) -> None:
    """Take what a comment says; what was said before stands."""
    if note is None:
        return
    old = found.get(number)
    if old is not None and old.guess is not None and note.diameter_mm is not None and note.guess is None:
        old = old._replace(diameter_mm=None, guess=None)
    if old is not None and old.diameter_mm is not None:
        note = note._replace(guess=None)
    if old is not None:
        kept: dict[str, Any] = {name: v for name, v in old._asdict().items() if v is not None}
        note = note._replace(**kept)
    found[number] = note


def _loose(line: int, text: str, scale: float) -> ToolNote | None:
    """What a comment without a tool number says: only where it names a cutter, or a diameter by its letter."""
    note = _note(line, text, scale)
    if note is None or note.kind is not None or note.guess is not None or _MILL.search(text):
        return note
    return note if _first((*_DIAMETER[:5], _RADIUS), _COMMA.sub(".", text), scale) is not None else None


def _note(line: int, text: str, scale: float) -> ToolNote | None:
    """What a comment says, None where it says nothing of a tool."""
    text = text[:LONGEST]
    if (hit := _CUTVIEWER.search(text)) is not None:
        sizes = [float(part) for part in hit[2].split(",")[1:]] + [0.0] * 4
        name, width = hit[1].lower(), round(scale * sizes[0], 9)
        if name == "mill":
            shape = "taper" if sizes[3] else "flat"
            return ToolNote(line, text, shape, width, scale * sizes[1], sizes[3] or None)
        return ToolNote(line, text, name, width, None, sizes[1] / (1.0 if name == "drill" else 2.0) or None)
    said, text = text, _COMMA.sub(".", text)
    kind = next((name for name, words in _KINDS if words.search(text)), None)
    heights = {hit[2] for hit in _REGISTER.finditer(text) if hit[1] in "Hh"}
    # H3 and D3: registers, where both numbers are the same
    sized = _REGISTER.sub(lambda hit: " " if hit[2] in heights else hit[0], _OTHER.sub(" ", text))
    sized = _NAMED.sub("T0", sized, 1)  # the number of the tool is no whole part of a fraction after it
    dotted = _DOTTED.search(sized) if scale == 1.0 else None
    sized = sized if dotted is None else sized.replace(dotted[0], " ")
    # the angle that stands before the name of a drill or chamfer mill, as in `| 90 SPOT DRILL |`
    found_tip = _NAMING[0].search(sized) if kind in ("drill", "chamfer") else None
    tip = value_of(found_tip[1]) if found_tip and "/" not in found_tip[1] else None
    tip = tip if tip in ANGLES else None
    diameter = _first(_DIAMETER if tip else (*_DIAMETER, *_NAMING), sized, scale)
    flutes = _FLUTES.search(text)
    corner = _first(_CORNER[: 2 if kind or diameter else 1], text, scale)
    angle = _TAPER.search(text) or (_DEGREES.search(text) if kind in ("drill", "chamfer", "taper") else None)
    if diameter is None and (radius := _first((_RADIUS,), text, scale)) is not None:
        diameter = 2.0 * radius
    if kind == "ball" and diameter is None and corner is not None:
        diameter = 2.0 * corner
    guess = None
    if diameter is None and dotted is not None:
        diameter, guess = (float(dotted[1]), dotted[0]) if float(dotted[1]) >= LEAST_MM else (None, None)
    elif diameter is None and (found := _beside(kind, sized, scale)) is not None:
        diameter, guess = found
    if kind is None and diameter is None and corner is None:
        return None
    size = float(angle[1]) if angle else tip
    whole = size is not None and (WHOLE <= size < 180.0 or _WHOLE.search(text) is not None)
    size = size / 2.0 if size is not None and kind == "chamfer" and whole else size
    teeth = int(flutes[1]) or None if flutes else None
    return ToolNote(line, said, kind, diameter, corner, size, teeth, guess=guess)


def _beside(kind: str | None, text: str, scale: float) -> tuple[float, str] | None:
    """A diameter in mm that a name suggests, and the words: ENDMILL 10, FACEMILL 63, TAP M8."""
    if kind == "tap":
        thread = _THREAD.search(text)
        if thread is None:
            return None
        return (float(thread[1]) if thread[1] else INCH * value_of(thread[2]), thread[0])
    if kind == "drill" and (gauge := _GAUGE.search(text)):
        row, place = (
            (_NUMBERS, int(gauge[1]) - 1) if gauge[1] else (_LETTERS, ord(gauge[2].upper()) - ord("A"))
        )
        return (round(INCH * row[place] / 1e4, 9), gauge[0]) if place < len(row) else None
    found = _BESIDE.search(text)
    size = _first((_BESIDE,), text, scale) if found else None
    if found is None or size is None:
        return None
    angle = kind in ("drill", "chamfer") and value_of(found[1]) in ANGLES
    # in inches sizes are fractions or decimals
    counts = found[1].isdigit() and (scale != 1.0 or size < LEAST_MM)
    if (angle or counts) and not found[2]:
        return None
    return (size, found[0].strip()) if 0.0 < size <= MOST_MM else None


def _first(patterns: Sequence[re.Pattern[str]], text: str, scale: float) -> float | None:
    """The first number that a pattern finds, mm."""
    for pattern in patterns:
        if found := pattern.search(text):
            unit = (found[2] or "").strip().lower()
            inch = unit or "/" in found[1]
            return round(value_of(found[1]) * (1.0 if unit == "mm" else INCH if inch else scale), 9)
    return None


def value_of(text: str) -> float:
    """`1.5`, `3/4`, `1 1/2`, `1-1/2`."""
    parts = [part.partition("/") for part in text.replace("-", " ").split()]
    return sum(float(top) / (float(bottom or 1.0) or 1.0) for top, _, bottom in parts)
