"""New feeds into programs that are not G-code, every other byte as it was; and the lines of G-code that run once.

Heidenhain and Sinumerik programs get F words in the blocks that move:

1. A block takes a feed if it runs once, in the order of the file, moves at one feed, and is a plain motion: no cycle, no call,
   no function, and no neighbour of a rounding or chamfer. Its F becomes a number, or is added where the language has it.
2. F is modal. A plain motion after it that has no F of its own gets the feed that it had; where the block after it is not plain
   (a loop, a cycle, a chamfer), the feed stays as it was, for that block would inherit it.
3. What an F counts (mm/min, tenths of inches per minute, mm per revolution, one over minutes) is found for each block from
   the program itself: its feed over the number of the F in force. That must be one number in the whole program, but for
   the speed of the spindle in feeds per revolution, the length under inverse time, and arcs under cutter compensation,
   whose feed may be that of the contour. Where it is not, or where another unit begins after a motion, nothing is written.

Blocks are not divided.

In G-code `find_regions` tells which lines run once and in the order of the file.
Bodies of subprograms, loops and branches run often, later, or not at all: a modal F written there reaches lines
nobody can tell, so they are left alone; if they change units, G90, G93 or G41, the whole program is. A feed
changed outside must be taken back before such a body starts. Lines from a computed G code, or from modes saved by
M70 or M73, on are left alone too.

A table of poses has cells of `feed_mm_min`.
An empty cell keeps what the row before had, so a row after a changed one gets the feed it had, where that was left out. Rows
are not divided. A table without the column, and lines with quotes, are left alone.

A cutter location file gets FEDRAT records before the motions that need them.
A motion that keeps its feed after one that got another is preceded by a copy of the FEDRAT record that held for it. Feeds
are written in the unit of the file, rounded down, and with a unit word where the file's own records have one or no UNITS
record says it. Before an arc the record stands before its CIRCLE, MOVARC or INDIRV. Motions are not divided; holes of a
cycle with a feed of its own keep that feed, which holds after the cycle too.
"""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate, groupby
from operator import attrgetter
from typing import TYPE_CHECKING, Final, NamedTuple

from vmachining.nc.apt import unit_of_feeds
from vmachining.nc.apt_motions import records
from vmachining.nc.flow import find_structure
from vmachining.nc.lexer import LexedLine
from vmachining.nc.rewrite_pieces import MODE_CHANGES, Written, number_text

if TYPE_CHECKING:
    from vmachining.nc.model import Move

HEAD: Final = re.compile(r"\s*([A-Za-z][A-Za-z0-9-]*)\s*(?:,\s*\w+\s*)*(?:/(.*))?$", re.DOTALL)
MOTIONS: Final = ("GOTO", "GODLTA", "TLON")
ARCS: Final = ("CIRCLE", "MOVARC", "INDIRV")
_NUMBER: Final = r"\s*((?:\d+\.?\d*|\.\d+)(?:[ED][-+]?\d+)?)"
OWN_FEED: Final = re.compile(rf"\b(MMPM|IPM|MMPR|IPR|PERMIN|PERREV)\s*,{_NUMBER}")
FEDRAT: Final = re.compile(rf"{_NUMBER}\s*(?:,\s*(PERMIN|PERREV)\s*)?")


def rewrite_apt_feeds(lines: Sequence[tuple[str, str]], feeds: Mapping[int, float]) -> Written:
    """Write feeds into a cutter location file.

    lines : text and end of every line, from the first.
    feeds : mm/min by the 1-based line on which a feed motion starts; motions that are not named keep their feed.
    """
    out: list[str] = []
    source: list[int] = []
    inch = unit_of_feeds("\n".join(text for text, _ in lines)) == "inch"  # until a record says it
    known, continued = False, False
    record: list[tuple[str, str]] = []  # the original's FEDRAT that is in force, with its continuation lines
    now: str | None = None  # the record that was inserted last, None while the original's is in force
    rapid, fedrat, arc = False, False, -1
    own: str | None = None  # the FEDRAT of the cycle in force, where it has a feed
    untouched: list[int] = []
    whole = dict(records([text for text, _ in lines]))

    def insert(texts: Sequence[tuple[str, str]], line: int) -> None:
        at = len(out) if arc < 0 else arc
        out[at:at] = [text + (end or "\n") for text, end in texts]
        source[at:at] = [line] * len(texts)

    for k, (text, end) in enumerate(lines, 1):
        bare = text.split("$$", 1)[0].rstrip()
        goes_on, continued = continued, bare.endswith("$")
        word, tail = "", ""
        if not goes_on and (found := HEAD.match(whole.get(k, ""))):
            word, tail = found[1].upper(), (found[2] or "").strip().upper()
        if goes_on and fedrat:
            record.append((text, end))
        elif not goes_on:
            fedrat = word == "FEDRAT"
        if word in ("UNITS", "UNIT"):
            was, inch, known = inch, tail.startswith("IN"), True
            if inch != was:
                record = _in_unit(record, was)
        elif word == "FEDRAT":
            record, now, rapid = [(text, end)], None, False
        elif word == "RAPID":
            rapid = True
        elif word in ARCS:
            arc = len(out)
        elif word == "CYCLE" and not tail.startswith(("ON", "INIT")):
            named = OWN_FEED.search(tail)
            own = f"FEDRAT/{named[2]},{named[1]}" if named is not None else None
        elif word == "GOTO" and own is not None:
            untouched += [k] if k in feeds else []
            record, now, rapid, arc = [(own, end)], None, False, -1
        elif word == "GOHOME":
            rapid, arc = False, -1
        elif word in MOTIONS:
            if not rapid:
                want = None if k not in feeds else _fedrat(feeds[k], inch, record, known)
                if want is not None and want != now:
                    insert([(want, end)], k)
                elif want is None and now is not None:
                    insert(record, k)
                now = want
            rapid, arc = False, -1
        out.append(text + end)
        source.append(k)
    return Written(out, tuple(untouched), tuple(source))


def _in_unit(record: Sequence[tuple[str, str]], inch: bool) -> list[tuple[str, str]]:
    """A FEDRAT record that counts in the unit of the file, with that unit."""
    text = "".join(bare for _, bare in records([text for text, _ in record])).upper().partition("/")[2]
    if (found := FEDRAT.fullmatch(text)) is None:
        return list(record)
    unit = {(False, False): "MMPM", (True, False): "IPM", (False, True): "MMPR", (True, True): "IPR"}
    return [(f"FEDRAT/{found[1]},{unit[inch, found[2] == 'PERREV']}", record[-1][1])]


def _fedrat(feed: float, inch: bool, record: Sequence[tuple[str, str]], known: bool) -> str:
    """The record of a feed in mm/min, in the unit of the file and never above it; with its unit where the file has none."""
    step = 1e4 if inch else 10.0
    value = math.floor(feed / (25.4 if inch else 1.0) * step * (1 + 1e-12)) / step
    named = not known or "," in "".join(text for text, _ in record)
    return f"FEDRAT/{number_text(value, 4)}" + ((",IPM" if inch else ",MMPM") if named else "")


COLUMN = "feed_mm_min"


def rewrite_pose_feeds(lines: Sequence[tuple[str, str]], feeds: Mapping[int, float]) -> Written:
    """Write feeds into a table.

    lines : text and end of every line, from the first.
    feeds : mm/min by 1-based line, as they are to be written.
    """
    out: list[str] = []
    untouched: list[int] = []
    column, width = -1, 0
    was: str | None = None
    now: float | None = None
    header = True
    for k, (text, end) in enumerate(lines, 1):
        cells = text.split(",")
        if text.strip()[:1] in ("", "#"):
            pass
        elif header:
            names = [cell.strip().lower() for cell in cells]
            column, width, header = (names.index(COLUMN) if COLUMN in names else -1), len(names), False
        elif column < 0 or '"' in text or len(cells) != width:
            untouched += [k] if k in feeds else []
        else:
            cell = cells[column].strip()
            was = cell or was
            old = float(was) if was else None
            want = feeds.get(k, old)
            have = float(cell) if cell else (now if now is not None else old)
            if want is not None and want != have:
                number = number_text(want, 1) if k in feeds and want != old else (was or "")
                cells[column] = cells[column].replace(cell, number, 1) if cell else cells[column] + number
                text = ",".join(cells)
            now = want
        out.append(text + end)
    return Written(out, tuple(untouched))


SAME: Final = 1e-9
"""Relative: feeds that differ by less are one."""


@dataclass(frozen=True, slots=True)
class _Language:
    """plain : a motion that may take an F. never : words that make it something else. word : its F. before : where an F goes.
    modes : words that say what an F counts, those of a feed per revolution, that of inverse time. units : of lengths, and
    those that mean the same as none of them.

    `word` has the number as group 1, where it is one.
    """

    plain: re.Pattern[str]
    never: re.Pattern[str]
    word: re.Pattern[str]
    before: re.Pattern[str]
    modes: tuple[re.Pattern[str], frozenset[str], str]
    units: tuple[re.Pattern[str], frozenset[str]] | None = None


_I: Final = re.IGNORECASE
_NC: Final = r"(?<![A-Z_])F\s*(\d+\.?\d*|\.\d+)(?![\d.])"
CORNER: Final = re.compile(r"(?<![A-Z_])(RND|RNDM|CHF|CHR|FRC|FRCM)(?![A-Z])", _I)
ASIDE: Final = re.compile(
    r"\bTOOL\s+CALL\b|\bCYCL\b|\b(RND|CHF)\b|M0*(103|128)\s*F|G0*4(?!\d)|G2[45](?!\d)|(?<![A-Z_])T\d|^\s*\*",
    _I,
)
"""Lines whose F is not that of the motions after them."""

PER_TURN: Final = re.compile(r"(?<![A-Z_])M\s*0*(13[67])(?!\d)", _I), frozenset({"136"}), ""
SIDES: Final = re.compile(r"(?<![A-Z_])(?:G\s*0*4[12](?!\d)|R[LR](?![A-Z\d]))", _I)
ROUNDED: Final = re.compile(r"(?<![A-Z_])RNDM\s*=\s*([^\s;]+)", _I)
LANGUAGES: Final = {
    "heidenhain": _Language(
        re.compile(r"\s*\d*\s*(L|LN|LP|C|CR|CT|CP|CTP)\s", _I),
        re.compile(r"\bM(89|99|140)\b|\bF[UZ]\b|\bFMAX\b|\bF\s+MAX\b|\bLBL\b|\bM0*(103|128)\s*F", _I),
        re.compile(_NC + r"|(?<![A-Z_])F\s*(?:AUTO|[-+]?Q[LRS]?\d+)", _I),
        re.compile(r"\s+M\d|\s*;|\s*$", _I),
        PER_TURN,
    ),
    "heidenhain-iso": _Language(
        re.compile(r"\s*N?\d*\s*(?=[GXYZIJKABC])", _I),
        re.compile(r"\bM(89|99|140)\b|G(79|98|8\d|2\d\d|3[016])(?!\d)|\bL\s*\d|\bFMAX\b|M0*(103|128)\s*F", _I),
        re.compile(_NC, _I),
        re.compile(r"\s*\*|\s*;|\s*$"),
        PER_TURN,
    ),
    "sinumerik": _Language(
        re.compile(r"\s*(N\d+)?\s*(?=[GXYZIJKABCF])", _I),
        re.compile(r"\b(?!I?AC\b|DC\b|AC[NP]\b)[A-Z_]{2,}\w*\s*\(|\bM?CALL\b|\b(IF|GOTO\w*|REPEAT\w*|L\d+)\b|:\s|\bFB\s*=", _I),
        re.compile(r"(?<![A-Z_])F\s*=?\s*(\d+\.?\d*|\.\d+)(?![\d.*/+-])|(?<![A-Z_])F\s*=\s*\S+", _I),
        re.compile(r"\s*;|\s*$"),
        (re.compile(r"(?<![A-Z_])G\s*0*(9[3-7]\d*)(?!\d)", _I), frozenset({"95", "96", "97"}), "93"),
        (re.compile(r"(?<![A-Z_])G\s*0*(7[01]0?)(?!\d)", _I), frozenset({"71", "710"})),
    ),
}  # fmt: skip


class _Block(NamedTuple):
    """Motions of one line that follow each other. plain : may take an F. explicit : sets the modal feed itself.

    rpm : speed of the spindle. arc : it may have the feed of a contour. even : all its motions have one feed.
    """

    line: int
    feed: float
    plain: bool
    explicit: bool
    rpm: float
    arc: bool
    even: bool


def rewrite_word_feeds(
    dialect: str, lines: Sequence[tuple[str, str]], moves: Sequence[Move], feeds: Mapping[int, float]
) -> Written:
    """Write feeds into a program.

    dialect : of `LANGUAGES`. lines : text and end of every line, from the first. moves : in the order in which they run.
    feeds : mm/min by the 1-based line of a block.
    """
    language = LANGUAGES[dialect]
    texts = [text for text, _ in lines]
    blocks = _blocks(language, texts, moves)
    scales = _scales(language, texts, blocks)
    todo, was_changed = dict(feeds), False
    if scales is None:
        return Written([text + end for text, end in lines], tuple(sorted(todo)))
    for k, (block, scale) in enumerate(zip(blocks, scales, strict=True)):
        after = blocks[k + 1] if k + 1 < len(blocks) else None
        may = block.plain and (after is None or after.plain or after.explicit)
        want = _rounded(todo.pop(block.line), scale) if may and block.line in todo else block.feed
        differs = abs(want - block.feed) > SAME * block.feed
        if differs or (was_changed and block.plain and not block.explicit):
            texts[block.line - 1] = _with(language, texts[block.line - 1], number_text(want / scale, 6))
            was_changed = differs
        elif block.explicit:
            was_changed = False
    return Written([text + end for text, (_, end) in zip(texts, lines, strict=True)], tuple(sorted(todo)))


def _blocks(language: _Language, texts: Sequence[str], moves: Sequence[Move]) -> list[_Block]:
    """Feed motions by line, in the order in which they run."""
    groups: list[tuple[int, set[float]]] = []
    kinds: list[tuple[float, bool]] = []
    for line, same in groupby(moves, key=attrgetter("line")):
        first, *_ = own = list(same)
        feeding = [move for move in own if move.feed_mm_min is not None]
        groups.append((line, {move.feed_mm_min or 0.0 for move in feeding}))
        arc = any(move.center is not None or move.circle is not None for move in feeding)
        kinds.append((abs(first.spindle_rpm), arc))
    order = [line for line, _ in groups]
    highest = list(accumulate(order, max, initial=0))
    lowest = list(accumulate(order[::-1], min, initial=len(texts) + 1))[::-1]
    # lines with a rounding or chamfer up to each line: its arc has the feed of one of its neighbours
    corners, modal = [0], False
    for text in texts:
        bare = _bare(text)
        if always := ROUNDED.search(bare):
            modal = always[1] not in ("0", "0.", "0.0")
        corners.append(corners[-1] + (modal or CORNER.search(bare) is not None))
    out = []
    for k, (line, of) in enumerate(groups):
        if not of:
            continue
        text = _bare(texts[line - 1])
        plain = language.plain.match(text) is not None and language.never.search(text) is None
        before, after = (groups[n][0] if 0 <= n < len(groups) else line for n in (k - 1, k + 1))
        if corners[max(line, after)] > corners[min(line, before) - 1]:
            plain = False
        once = highest[k] < line < lowest[k + 1]
        explicit, even = plain and language.word.search(text) is not None, len(of) == 1
        out.append(_Block(line, max(of), plain and once and even, explicit, *kinds[k], even))
    return out


def _scales(language: _Language, texts: Sequence[str], blocks: Sequence[_Block]) -> list[float] | None:
    """mm/min of an F of 1 in each block, None where the program does not say it of all."""
    word, turns, inverse = language.modes
    named = [(line, hit[1]) for line, text in enumerate(texts, 1) for hit in word.finditer(_bare(text))]
    lines = [line for line, _ in named]
    sides = any(SIDES.search(_bare(text)) for text in texts)
    first = min((block.line for block in blocks), default=0)
    if language.units is not None and _changes(texts, first, *language.units):
        return None
    out = list[float]()
    found: float | None = None
    force: float | None = None
    last: _Block | None = None
    for block in blocks:
        hit = language.word.search(_bare(texts[block.line - 1])) if block.explicit else None
        given = [hit[1]] if hit is not None else []
        if block.plain and hit is None and last is not None:
            between = [_bare(text) for text in texts[last.line : block.line]]
            lone = [language.word.search(text) for text in between if not ASIDE.search(text)]
            given = [item[1] for item in lone if item is not None]
        if given:  # a parameter has its value elsewhere
            force = float(given[-1]) if given[-1] is not None and float(given[-1]) else None
        elif last is None or not block.plain:
            out.append(1.0)
            if block.plain or block.explicit:
                last = block
            continue
        if block.plain or block.explicit:
            last = block
        if force is None:
            out.append(1.0)
            continue
        ratio = block.feed / force
        out.append(ratio)
        place = bisect_right(lines, block.line)
        mode = named[place - 1][1] if place else ""
        if not block.even or (mode == inverse and mode) or (block.arc and sides):
            continue
        if mode in turns:
            ratio /= block.rpm or 1.0
        if found is not None and abs(ratio - found) > SAME * found:
            return None
        found = ratio
    return None if found is None and not any(mode == inverse for _, mode in named) else out


def _changes(texts: Sequence[str], first: int, word: re.Pattern[str], default: frozenset[str]) -> bool:
    """Whether an F counts two things in a program whose first motion with a feed has line `first`."""
    named = [(line, hit[1]) for line, text in enumerate(texts, 1) for hit in word.finditer(_bare(text))]
    kinds = {"" if name in default else name for _, name in named}
    return len(kinds | {""} if named and named[0][0] > first else kinds) > 1


def _rounded(feed: float, scale: float) -> float:
    """Never above the feed asked for, in tenths of mm/min, of other units in ten thousandths."""
    step = 10.0 if scale == 1.0 else 1e4
    return math.floor(feed / scale * step * (1 + 1e-12)) / step * scale


def _bare(text: str) -> str:
    return text.split(";", 1)[0]


def _with(language: _Language, text: str, number: str) -> str:
    bare = _bare(text)
    if word := language.word.search(bare):
        return f"{bare[: word.start()]}F{number}{bare[word.end() :]}{text[len(bare) :]}"
    place = language.before.search(text)
    assert place is not None
    return text[: place.start()] + f" F{number}" + text[place.start() :]


SAVING = frozenset({70.0, 72.0, 73.0})
PAIRED = frozenset({"sub", "if", "while", "do", "repeat"})


class Regions(NamedTuple):
    """1-based lines. closed : they do not run once in the order of the file. gates : before them the feed in
    force must be the one of the original program."""

    closed: frozenset[int]
    gates: frozenset[int]


def find_regions(lexed: Sequence[LexedLine], first: int, last: int) -> Regions:
    """Regions of lines first..last (1-based)."""
    closed: set[int] = set()
    gates: set[int] = set()
    for number, line in enumerate(lexed[first - 1 : last], first):
        computed = any(word.letter == "G" and word.value is None for word in line.words)
        if computed or any(word.letter == "M" and word.value in SAVING for word in line.words):
            gates.add(number)  # inches or G93 may be in force behind it: nobody knows what F says
            closed.update(range(number, last + 1))
            break
    structure = find_structure([line.text for line in lexed], first - 1, last)
    if structure is None:
        return Regions(frozenset(closed), frozenset(gates))
    for item in structure.items.values():
        if item.kind in PAIRED and item.end >= 0:
            closed.update(range(item.index + 1, item.end + 2))
        if item.kind in PAIRED or item.kind == "call":
            gates.add(item.index + 1)
        if item.kind == "call" and item.label not in structure.subs:
            closed.update(range(item.index + 1, last + 1))  # a file: what it changes is not seen here
    for number, line in enumerate(lexed[first - 1 : last], first):
        codes = {word.value for word in line.words if word.letter == "M"}
        if None in codes:
            closed.update(range(first, last + 1))  # a computed M98
        if 98.0 not in codes:
            continue
        gates.add(number)
        closed.add(number)
        for word in line.words:
            start = structure.numbers.get(f"{word.value:.0f}") if word.letter == "P" and word.value else None
            if start is None and word.letter == "P":
                closed.update(range(number, last + 1))
            if start is not None:
                closed.update(range(start + 1, _end(lexed, start, last) + 1))
                gates.add(start + 1)
        if any(word.letter == "P" and word.value is None for word in line.words):
            closed.update(range(first, last + 1))  # a computed call may go anywhere
    codes = {word.value for number in closed for word in lexed[number - 1].words if word.letter == "G"}
    if None in codes or not codes.isdisjoint(MODE_CHANGES):
        closed.update(range(first, last + 1))  # what the lines behind mean depends on what ran
    return Regions(frozenset(closed), frozenset(gates))


def _end(lexed: Sequence[LexedLine], start: int, last: int) -> int:
    """1-based line of the M99 that ends a subprogram."""
    for number in range(start + 1, last + 1):
        if any(word.letter == "M" and word.value == 99.0 for word in lexed[number - 1].words):
            return number
    return last
