"""The languages that are read: each a name, a reader, and a judgement of how much a text looks like it.

A dialect that is no kin of G-code (`apt`, `poses`, conversational ones) brings its own reader: text and `Settings`
in, a `Reading` out; it is loaded when a program needs it. Dialects of G-code share `blocks.Reader` and differ by data. Another
package adds a language by the entry-point group `vmachining.dialects`, see `docs/add_a_dialect.md`.

`read_program` and `parse_program` read in any of them, and conclude what the program does not say.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any, Final

from vmachining.errors import NCError
from vmachining.installed import Installed
from vmachining.nc.blocks import Reader
from vmachining.nc.conventions import arcs_open, closing, lengths, names_unit, quill, times, unit_of, worn
from vmachining.nc.fanuc_lines import as_lathe, folded, is_lathe, swapped, without_header
from vmachining.nc.files import MAX_BYTES, Foreign, decode_program, never_a_program, recognised
from vmachining.nc.findings import check_moves, finding, spared
from vmachining.nc.lexer import split_lines
from vmachining.nc.model import Finding, Program
from vmachining.nc.model import Reading as Reading
from vmachining.nc.settings import Settings, UnitName
from vmachining.nc.state import work_offset_codes

AUTO: Final = "auto"
"""In place of a name: the dialect is recognised."""

SAMPLE: Final = 2000
"""Lines from the head of a program that its dialect is judged by."""

LONGEST: Final = 400
"""Characters of such a line: patterns with a bracket and a word after it cost the square of a line's length."""


@dataclass(frozen=True, slots=True)
class Dialect:
    """One language.

    title : what it is, for messages. read : its reader. score : lines of the head -> 0 (nothing speaks for it) to 1
    (certain); the highest wins, `iso` where all are zero. g_code : made of words, so that lexer and rewriting of
    feeds of G-code hold.
    """

    name: str
    title: str
    read: Callable[[str, Settings], Reading]
    score: Callable[[Sequence[str]], float]
    g_code: bool = False


def share(lines: Sequence[str], mark: re.Pattern[str]) -> float:
    """Share of the lines that are not empty in which a mark is found."""
    full = [line for line in lines if line.strip()]
    return sum(mark.search(line) is not None for line in full) / len(full) if full else 0.0


def _words(text: str, settings: Settings) -> Reading:
    return _of_lines(split_lines(text), settings)


def _of_lines(lines: list[str], settings: Settings) -> Reading:
    reader = Reader(lines, settings)
    reader.run()
    files = tuple(str(file) for file in reader.files.paths)
    return Reading(reader.moves, reader.findings, reader.ended, files)


def _later(room: str, **options: bool) -> Callable[[str, Settings], Reading]:
    """The reader of a language that is loaded when a program needs it: `read_x` of `nc/x`."""

    def read(text: str, settings: Settings) -> Reading:
        found: Reading = getattr(import_module(f"vmachining.nc.{room}"), f"read_{room}")(
            text, settings, **options
        )
        return found

    return read


_TNC_ISO: Final = re.compile(r"^[ \t]*%[ \t]*\S+?[ \t]*G7[01][ \t]*\*?[ \t]*$", re.IGNORECASE)


_TNC_BLANK: Final = re.compile(r"[ \t]*N?\d*[ \t]*G30[ \t]+G17[ \t]+X", re.IGNORECASE)


def _heidenhain_iso_score(lines: Sequence[str]) -> float:
    """The frame %NAME G71; or G30 G17 with a corner of the blank, which is not a retract on any other control."""
    if any(_TNC_ISO.match(line) for line in lines[:20]):
        return 0.97
    return 0.9 if any(map(_TNC_BLANK.match, lines[:30])) else 0.0


_SINUMERIK: Final = re.compile(
    r"^[ \t]*%_N_|\b(?:CYCLE(?:8\d|8\d\d)|POCKET\d|HOLES\d|WORKPIECE|SLOT\d)[ \t]*\(|\bMCALL\b|\bSUPA\b|\bMSG[ \t]*\("
    r"|\b(?:TRAORI|TRAFOOF|COMPCAD|COMPOF|FFWON|FFWOF|ORIWKS|ORIAXES|ORIVECT|CYCLE832|SOFT|BRISK)\b"
    r"|\bDEF[ \t]+(?:REAL|INT|STRING|BOOL)\b"
    r"|\b(?:GOTO[FB]|A?TRANS|A?ROT|A?SCALE|A?MIRROR|EXTCALL|ENDWHILE|ENDIF|ENDFOR)\b|\b(?:CR|TURN|RND|CHF|CHR|AR|SPOS)[ \t]*="
    r"|\b[XYZIJKABC][ \t]*=[ \t]*(?:I?AC|DC|IC|ACP|ACN)[ \t]*\(|\bR\d+[ \t]*=|\bG(?:290|500|505|601|602|641|642|710|700)\b"
    r"|\bT[ \t]*=[ \t]*\"|\$(?:P|AA|TC|MN|MC|A)_|^[ \t]*(?:N\d+[ \t]+)?[A-Z_]\w+:[ \t]*(?:$|[A-Z])|^[ \t]*(?:N\d+[ \t]+)?PROC\b"
    r"|^[ \t]*(?:N\d+[ \t]+)?(?:[A-Z][A-Z0-9]*)?_\w*[ \t]*\([-+.,\d \t]*\)",
    re.IGNORECASE,
)


def _sinumerik_score(lines: Sequence[str]) -> float:
    """Words that only this control has; what is distinguished from comments of other dialects by their brackets."""
    bare = [line.split(";", 1)[0] for line in lines if not line.lstrip().startswith(("(", "$$"))]
    hits = sum(_SINUMERIK.search(line) is not None for line in bare)
    foreign = sum(_OTHERS.search(line) is not None for line in bare[:400])
    if any(line.lstrip().upper().startswith("%_N_") or _DECLARED.match(line) for line in lines):
        return 0.95
    return 0.0 if hits < 1 or foreign > hits else min(0.85, 0.5 + 0.02 * hits)


_DECLARED: Final = re.compile(
    r"[ \t]*(?:N\d+[ \t]+)?DEF[ \t]+(?:REAL|INT|BOOL|CHAR|STRING|AXIS|FRAME)\b|[ \t]*(?:N\d+[ \t]+)?MCALL\b"
    r"|[ \t]*(?:N\d+[ \t]+)?(?:[A-Z][A-Z0-9]*)?_\w*[ \t]*\([-+.,\d \t]*\)",
    re.IGNORECASE,
)
"""What no other control has: declared variables, cycles that are called at every point."""
_OTHERS: Final = re.compile(
    r"#\d+|\bG65\b|\b(?:VC\d+|CALL O)|\[|^[ \t]*O\d{4}|^\s*\([^()]*\)\s*$|\bG43\b|\bG54\.1|\bG15[ \t]*H|\bM98\b",
    re.IGNORECASE,
)

_TNC: Final = re.compile(
    r"^[ \t]*\d*[ \t]*(?:TOOL (?:CALL|DEF)|BLK FORM|CYCL (?:DEF|CALL)|CALL (?:LBL|PGM)|LBL |FN ?\d+ ?:|L .*F ?MAX|"
    r"(?:L|C|CR|CT|CC|LP|CP)[ \t]+I?[XYZABCPD][+-])",
    re.IGNORECASE,
)
_BEGIN_PGM: Final = re.compile(r"^[ \t]*\d*[ \t]*(?:BEGIN|END)[ \t]+PGM\b", re.IGNORECASE)


def _heidenhain_score(lines: Sequence[str]) -> float:
    if any(_BEGIN_PGM.match(line) for line in lines):
        return 1.0
    found = share(lines, _TNC)
    return 0.9 * found if found > 0.3 else 0.0


_APT: Final = re.compile(
    r"^[ \t]*(?:(?:GOTO|FROM|LOADTL|LOAD|FEDRAT|PARTNO|CUTTER|SPINDL|TLDATA|CYCLE|MSYS|UNITS?|PAINT)[ \t]*/"
    r"|TOOL PATH/|END-OF-PATH|RAPID[ \t]*$|PPRINT\b)",
    re.IGNORECASE,
)
_POSES: Final = re.compile(r"^[ \t]*x_mm[ \t]*,", re.IGNORECASE)

_RECORD: Final = re.compile(r"[ \t]*(?:GOTO|FEDRAT|TLDATA|LOADTL|TOOL PATH|CUTTER)[ \t]*/", re.IGNORECASE)


def _apt_score(lines: Sequence[str]) -> float:
    found = share(lines, _APT)
    if found > 0.1 and sum(_RECORD.match(line) is not None for line in lines) > 1:
        return 0.95  # no block of G-code has a major word and a slash
    return 0.9 * found if found > 0.1 else 0.0


_FANUC: Final = re.compile(
    r"^[ \t]*(?:%[ \t]*|N[0-9]+[ \t]*)?(?:O[0-9]{1,8}[ \t]*(?:\(.*)?|O[A-Z][^<]*|:[0-9]{1,8}[ \t]*(?:\(.*)?)$"
    r"|\bG0?5\.1[ \t]*[QPR]|\bG0?8[ \t]*P[01]|\bG54\.1[ \t]*P|\bG43\.4[ \t]*H|^[ \t]*IF[ \t]*\[.*\][ \t]*(?:GOTO|THEN)"
    r"|^[ \t]*(?:N[0-9]+[ \t]*)?(?:G91[ \t]*G28|G28[ \t]*G91)|^[ \t]*GOTO[ \t]*[0-9]+"
    r"|\bM29[ \t]*S|\bG65[ \t]*P|\bG10[ \t]*L2[ \t]*P",
    re.IGNORECASE,
)
_HAAS: Final = re.compile(
    r"\bG187\b|\bG154[ \t]*P|\bG234\b|\bG254\b|\bM97[ \t]*P|\(.*\bHAAS\b|\bG150\b"
    r"|^[^(]*\bG(?:7[0-2](?=[^(]*I)(?=[^(]*L)|1[23](?![0-9.])(?=[^(]*I))",
    re.IGNORECASE,
)
_MAZAK: Final = re.compile(r"\(.*\bMAZAK|\(.*\bMAZATROL", re.IGNORECASE)
_OKUMA: Final = re.compile(
    r"^[ \t]*\$[^%]*%|\bG15[ \t]*H[0-9]|\bG116[ \t]*T|\bVC[0-9]+[ \t]*=|^[ \t]*CALL[ \t]*O|\bG56[ \t]*HA|\(.*\bOKUMA\b|\bVZOF"
    r"|^[ \t]*N(?:AT|LAP|STRT|END)[A-Z]*[0-9]*(?:[ \t]|$)|\bVT[A-Z]{2,4}\[|\bCALL[ \t]+OO[0-9]"
    r"|^(?!.*G43)[^(]*\bG56(?![0-9.])[^(]*\bH[0-9]",
    re.IGNORECASE,
)
_LINUXCNC: Final = re.compile(
    r"^[ \t]*O[ \t]*(?:<[^>]*>|[0-9]+)[ \t]*"
    r"(?:sub|endsub|call|if|else|endif|while|endwhile|do|repeat)\b|#<[^>]+>|\(.*\bLINUXCNC\b",
    re.IGNORECASE,
)


def _marks(pattern: re.Pattern[str], weight: float) -> Callable[[Sequence[str]], float]:
    return lambda lines: weight if any(pattern.search(line) for line in lines) else 0.0


_OWN: Final[dict[str, Dialect]] = {
    item.name: item
    for item in (
        Dialect("iso", "G-code as LinuxCNC reads it", _words, _marks(_LINUXCNC, 0.75), g_code=True),
        Dialect("haas", "a program of a Haas mill", _words, _marks(_HAAS, 0.7), g_code=True),
        Dialect("mazak", "a program of a Mazak mill", _words, _marks(_MAZAK, 0.7), g_code=True),
        Dialect("okuma", "a program of an Okuma mill", _words, _marks(_OKUMA, 0.72), g_code=True),
        Dialect("fanuc", "a program of a Fanuc control", _words, _marks(_FANUC, 0.6), g_code=True),
        Dialect("mts", "G-code of a training control", _words, lambda _: 0.0, g_code=True),
        Dialect("apt", "a cutter location file", _later("apt"), _apt_score),
        Dialect(
            "poses", "a table of poses", _later("poses"),
            lambda lines: float(any(_POSES.search(line) for line in lines[:50])),
        ),
        Dialect("sinumerik", "a program of a Sinumerik control", _later("sinumerik"), _sinumerik_score),
        Dialect(
            "heidenhain-iso", "a DIN/ISO program of a Heidenhain control", _later("heidenhain", din_iso=True),
            _heidenhain_iso_score,
        ),
        Dialect("heidenhain", "a conversational program of a Heidenhain control", _later("heidenhain"), _heidenhain_score),
    )
}  # fmt: skip

TABLE: Final = Installed("vmachining.dialects", Dialect, _OWN)
"""Ours, and those of installed packages."""

DIALECTS: Final = tuple(_OWN)
"""Names of ours."""


def read_lines(lines: Sequence[str], settings: Settings) -> Reading:
    """A program in one dialect; where it is not a program of it, one finding says what it is."""
    if (never := never_a_program("\n".join(_head(lines)))) is not None:
        return Reading([], [_stranger(never)], False)
    dialect = TABLE[settings.dialect]
    # a million lines take 80 MB: those of G-code are not split again
    reading = _of_lines(list(lines), settings) if dialect.g_code else dialect.read("\n".join(lines), settings)
    wrong = [item.line for item in reading.findings if item.code.startswith(("E1", "E2"))]
    cause = None
    if dialect.name in ("heidenhain", "heidenhain-iso", "sinumerik") and recognise(lines) == dialect.name:
        wrong = []  # it is what it says it is, however wrong
    if wrong and (other := recognised(lines, wrong, dialect.name, dialect.g_code)) is not None:
        cause = _stranger(other)
    elif wrong and (line := _prose(reading.findings, lines)):
        what = "this is a text, or a program in a language that is not read"
        cause = finding("E211", line, None, what, lines[line - 1].strip()[:40])
    if cause is None:
        return reading
    return reading._replace(moves=[], findings=[cause])


def _stranger(found: Foreign) -> Finding:
    """What a text is that is not a program of its dialect."""
    return finding("E211", found.line, None, f"this is {found.what}", found.word, found.col, found.remedy)


def _prose(findings: Sequence[Finding], lines: Sequence[str]) -> int:
    """The first of the lines that hold words instead of codes, where they are the most; else 0."""
    marked = {item.line for item in findings if item.code in ("E103", "E107", "E110")}
    full = sum(1 for line in lines if line.strip())
    return min(marked) if len(marked) >= 2 and 2 * len(marked) > full else 0


KINDS, CODES = 8, 5
"""Different findings about words, and their codes, above which a program is that of another control."""

FEW, SHARE = 3, 0.2
"""The same for a short program: their codes, and the share of its lines."""


def strange(findings: Sequence[Finding], lines: Sequence[str]) -> Finding | None:
    """One finding in place of many different ones about words that are not understood."""
    about = [item for item in findings if item.code.startswith(("E1", "E2"))]
    kinds = {(item.code, item.message[:24]) for item in about}
    codes = len({code for code, _ in kinds})
    often = sum(map(times, about)) >= SHARE * sum(1 for line in lines if line.strip())
    if (len(kinds) < KINDS or codes < CODES) and not (codes >= FEW and often):
        return None
    what = f"this is a program of a control that is not read: {len(kinds)} kinds of words mean nothing here"
    return finding("E211", about[0].line, None, what, about[0].word, about[0].col)


def is_g_code(name: str) -> bool:
    """Whether programs of this dialect are made of words."""
    return TABLE[name].g_code


def _head(lines: Sequence[str]) -> list[str]:
    return [line[:LONGEST] for line in lines[:SAMPLE]]


def is_marked(name: str, lines: Sequence[str]) -> bool:
    """Whether anything in the head of a program speaks for a dialect."""
    return TABLE[name].score(_head(lines)) > 0.0


def recognise(lines: Sequence[str]) -> str:
    """Name of the dialect whose score is highest; "iso" where nothing speaks for another."""
    head = _head(lines)
    best, most = "iso", 0.0
    for name, dialect in TABLE.items():
        score = dialect.score(head)
        if score > most:
            best, most = name, score
    return best


MANY = 3
"""Errors of the default dialect for each of another one, from which that one gives the better account."""


def _unit(lines: Sequence[str], guessed: bool) -> tuple[UnitName, list[Finding]]:
    """The unit of a program that names none; taken if the dialect is detected as well, otherwise only reported."""
    unit = unit_of(lines)
    if not guessed:
        if unit.name != "inch" or not unit.sure:
            return "", []
        what = f"no word names the unit: lengths are read as mm, but {unit.why} speak for inches"
        return "", [finding("W213", 1, None, what)]
    if unit.name:
        full = "inches" if unit.name == "inch" else "mm"
        what = f"no word names the unit: lengths are read as {full}, because of {unit.why}"
        hint = 'if it is otherwise: units = "mm" or "inch" under [program], or --units'
        return unit.name, [finding("I213", 1, None, what, hint=hint)]
    return "", [finding("W213", 1, None, f"no word names the unit and {unit.why}: lengths are read as mm")]


def _reading(lines: Sequence[str], settings: Settings) -> tuple[Reading, list[Finding]]:
    """A program as its control counts, and what was concluded about that."""
    settings, said = lengths(lines, settings)
    for judge in (worn, quill):
        settings, more = judge(lines, settings)
        said += more
    reading = read_lines(lines, settings)
    if any(item.code == "E211" for item in reading.findings):
        return reading, []
    turns = settings.family and not settings.control.lathe and is_lathe(lines, reading.findings)
    if turns or settings.turning:
        return _turning(lines, settings, said)
    other, more = closing(settings, reading.findings, lambda s: read_lines(lines, s).findings)
    return (reading, said) if other is settings else (read_lines(lines, other), said + more)


def _turning(lines: Sequence[str], settings: Settings, said: list[Finding]) -> tuple[Reading, list[Finding]]:
    """A program for a lathe: X words are diameters, unless all arcs fit as radii; its centres as `closing` finds them."""
    best: tuple[Reading, list[Finding]] | None = None
    given = settings.control.lathe
    for diameters in (True, False) if not given else (given == "diameter",):
        taken, more = as_lathe(lines, settings, diameters)
        first = read_lines(lines, taken)
        ours, centres = closing(taken, first.findings, lambda s: read_lines(lines, s).findings)
        reading = first if ours is taken else read_lines(lines, ours)
        if swapped(reading.moves):
            ours = replace(ours, control=replace(ours.control, swapped=True))
            what = "G2 and G3 are counted from below: so no arc of the program goes the long way round"
            hint = "confirm it: swapped = true under [program.control], or --control"
            centres = [*centres, finding("I213", 1, None, what, hint=hint)]
            reading = read_lines(lines, ours)
        if best is None or arcs_open(reading.findings) < arcs_open(best[0].findings):
            best = reading, [*said, *more, *centres]
        if not arcs_open(reading.findings) and not centres:
            break
    assert best is not None
    return best


def read_program(path: Path | str, **options: Any) -> Program:
    """Read a program from a file; options as of `parse_program`.

    Raises NCError: The file cannot be read, is binary, UTF-16 or larger than `MAX_BYTES`, or the dialect is unknown.
    """
    try:
        with Path(path).open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as exc:
        reason = getattr(exc, "strerror", None) or str(exc)
        raise NCError(f"cannot read the program: {reason}", file=str(path)) from exc
    beside = (Path(path).parent, *options.pop("subroutines", ()))
    return parse_program(data, str(path), subroutines=beside, **options)


def parse_program(data: bytes, name: str, **options: Any) -> Program:
    """Read a program, however wrong its blocks are: see `Program.findings`.

    data : the bytes of the file; UTF-8 or a one-byte encoding. name : used in messages.
    options : fields of `Settings`.
    Raises NCError: Binary or UTF-16 data, a program too large, unknown dialect, option or work offset.
    """
    settings = Settings.of(name, work_offset_codes(), options)
    if settings.dialect != AUTO and settings.dialect not in TABLE:
        wanted = f"one of {', '.join((AUTO, *TABLE))}"
        raise NCError(f"dialect '{settings.dialect}' is not supported", file=name, remedy=wanted)
    lines = without_header(split_lines(decode_program(data, name)))
    if settings.start_line > max(len(lines), 1):
        what = f"start line {settings.start_line}: there are {len(lines)} lines"
        raise NCError(what, file=name, remedy="name one of them")
    found: list[Finding] = []
    guessed = settings.dialect == AUTO
    dialect = recognise(lines) if guessed else settings.dialect
    units = settings.units
    if not units and (TABLE[dialect].g_code or dialect == "sinumerik") and not names_unit(lines):
        units, more_found = _unit(lines, guessed)
        found += more_found
    settings = replace(settings, dialect=dialect, units=units)
    (moves, more, ended, files, declared), said = _reading(lines, settings)
    unmarked = guessed and dialect == "iso" and not is_marked("iso", lines)
    if unmarked and any(item.severity == "E" for item in more):
        other, further = _reading(lines, replace(settings, dialect="fanuc"))
        wrong, left = (sum(item.severity == "E" for item in items) for items in (more, other.findings))
        # a path that is read only because the tool's radius is assumed to be in it already is not better than a question
        assumed = any(item.code == "W351" for item in other.findings)
        assumed = assumed and not any(item.code == "W380" for item in further)
        if (left == 0 and not assumed) or (left > 0 and wrong >= MANY and MANY * left <= wrong):
            dialect = "fanuc"  # nothing speaks for either, and only this one reads it
            (moves, more, ended, files, declared), said = other, further
    found += said
    if guessed and is_g_code(dialect):
        more = folded(more)
        if (cause := strange(more, lines)) is not None:
            moves, more, found = [], [cause], [item for item in found if item.code != "W380"]
    if guessed and dialect != "iso" and not any(item.code == "E211" for item in more):
        what = f"the program looks like {TABLE[dialect].title}, and is read as that: dialect {dialect}"
        found.append(finding("I212", 1, None, what))
    if units and not declared.unit:
        declared = declared._replace(unit=units, inferred=True)
    found += spared(more, moves)
    found += check_moves(moves, settings.stock_top_mm, settings.travel_mm, settings.blu_mm)
    findings: tuple[Finding, ...] = tuple(sorted(found, key=lambda f: (f.line, f.col, f.code)))
    return Program(name, data, dialect, tuple(moves), findings, ended, files, declared)
