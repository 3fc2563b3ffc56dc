"""New feeds into a table of poses and into a cutter location file; every other byte stays as it was.

A table has cells of `feed_mm_min`.
An empty cell keeps what the row before had, so a row after a changed one gets the feed it had, where that was left out. Rows
are not divided. A table without the column, and lines with quotes, are left alone.

A file gets FEDRAT records before the motions that need them.
A motion that keeps its feed after one that got another is preceded by a copy of the FEDRAT record that held for it. Feeds
are written in the unit of the file, rounded down, and with a unit word where the file's own records have one or no UNITS
record says it. Before an arc the record stands before its CIRCLE, MOVARC or INDIRV. Motions are not divided; holes of a
cycle with a feed of its own keep that feed, which holds after the cycle too.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Final

from vmachining.nc.apt import unit_of_feeds
from vmachining.nc.apt_motions import records
from vmachining.nc.rewrite_pieces import Written, number_text

HEAD: Final = re.compile(r"\s*([A-Za-z][A-Za-z0-9-]*)\s*(?:,\s*\w+\s*)*(?:/(.*))?$", re.DOTALL)
MOTIONS: Final = ("GOTO", "GODLTA", "TLON")
ARCS: Final = ("CIRCLE", "MOVARC", "INDIRV")
_NUMBER: Final = r"\s*((?:\d+\.?\d*|\.\d+)(?:[ED][-+]?\d+)?)"
OWN_FEED: Final = re.compile(rf"\b(MMPM|IPM|MMPR|IPR|PERMIN|PERREV)\s*,{_NUMBER}")
FEED: Final = re.compile(rf"{_NUMBER}\s*(?:,\s*(PERMIN|PERREV)\s*)?")


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
    if (found := FEED.fullmatch(text)) is None:
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
        row = text.strip()
        if not row or row.startswith("#"):
            out.append(text + end)
            continue
        cells = text.split(",")
        if header:
            names = [cell.strip().lower() for cell in cells]
            column, width, header = (names.index(COLUMN) if COLUMN in names else -1), len(names), False
            out.append(text + end)
            continue
        if column < 0 or '"' in text or len(cells) != width:
            if k in feeds:
                untouched.append(k)
            out.append(text + end)
            continue
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
