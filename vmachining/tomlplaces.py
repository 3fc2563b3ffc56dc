"""Where a key stands in a TOML file: tomllib forgets lines, people need them.

A small scanner, not a second parser: it follows table headers, arrays of tables, strings and brackets just
far enough to say on which line the key of a known path starts. It never decides what a file means.
"""

from __future__ import annotations

import difflib
import re
import shlex
import tomllib
from collections.abc import Iterable, Iterator, Sequence

from vmachining.errors import JobError

KeyPath = tuple[str | int, ...]
"""E.g. ("tools", 0, "diameter_mm")."""

_PROGRAM = re.compile(r"\s*(?:N\d+\s*)?[GMT]\d{1,3}(?:\s|$|[XYZFSGM])|\s*\d*\s*BEGIN PGM", re.IGNORECASE)
_HEADER = re.compile(r"^\s*(\[\[?)\s*([^\]#]+?)\s*\]\]?")
_KEY = re.compile(
    r"""^\s*((?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*'))*)\s*="""
)
_INLINE = re.compile(r"""(?:[{,]\s*)([A-Za-z0-9_-]+|"[^"]*"|'[^']*')\s*=""")
_STRING = re.compile(r'"(?:\\.|[^"\\])*"|\'[^\']*\'')


def _parts(dotted: str) -> list[str]:
    return [part.strip().strip("\"'") for part in dotted.split(".")]


def key_positions(text: str) -> dict[KeyPath, tuple[int, int]]:
    """(line, column), both from 1, of every key and table header of a TOML text."""
    found: dict[KeyPath, tuple[int, int]] = {}
    for path, place in _occurrences(text):
        found.setdefault(path, place)
    return found


def said_by_toml(exc: tomllib.TOMLDecodeError) -> tuple[str, int | None, int | None]:
    """What tomllib refused, without the place; line and column."""
    place = re.search(r"\(at line (\d+), column (\d+)\)", str(exc))
    line, col = (int(place[1]), int(place[2])) if place else (None, None)
    return f"not valid TOML: {re.sub(r' [(]at .*[)]$', '', str(exc))}", line, col


def toml_refusal(text: str, exc: tomllib.TOMLDecodeError, file: str) -> JobError:
    """What tomllib refused, in the words of a job file: a key given twice, a decimal comma, a text without quotes."""
    (what, line, col), remedy = said_by_toml(exc), None
    seen: dict[KeyPath, int] = {}
    for path, (at, column) in _occurrences(text):
        if path in seen and at == line and not isinstance(path[-1], int):
            name = dotted(path)
            what = f"{name} is given twice, first in line {seen[path]}"
            col, remedy = column, "keep one of them"
            break
        seen.setdefault(path, at)
    if any(_PROGRAM.match(line) for line in text.splitlines()[:30]):
        remedy = f"vmachining init {shlex.quote(file)} writes a job file for it"
        return JobError("this is an NC program, not a job file", file=file, line=line, col=col, remedy=remedy)
    raw = text.splitlines()[line - 1] if line is not None and line <= len(text.splitlines()) else ""
    if remedy is None and (comma := re.search(r"=\s*([+-]?\d+),(\d+)\s*(#.*)?$", raw)):
        what, remedy = f"{what}: a decimal comma", f"write {comma[1]}.{comma[2]}"
    elif remedy is None and (word := re.match(r"\s*([\w-]+)\s*=\s*([A-Za-z][^\"'#=]*)(#.*)?$", raw)):
        remedy = f'a text stands in quotes: {word[1]} = "{word[2].strip()}"'
    return JobError(what, file=file, line=line, col=col, remedy=remedy)


def dotted(path: KeyPath) -> str:
    """`stock.box.min[0]`."""
    out = ""
    for part in path:
        out += f"[{part}]" if isinstance(part, int) else f".{part}" if out else part
    return out


def _occurrences(text: str) -> Iterator[tuple[KeyPath, tuple[int, int]]]:
    """Every key and table header with its (line, column), as often as it stands there; an array of tables once."""
    counts: dict[KeyPath, int] = {}
    table: KeyPath = ()
    key: KeyPath = ()
    depth, fence = 0, ""
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw
        if fence:  # inside a multi-line string
            if fence not in line:
                continue
            line, fence = line.split(fence, 1)[1], ""
        for quote in ('"""', "'''"):
            if line.count(quote) % 2:
                fence = quote
        bare = _STRING.sub(lambda hit: "_" * len(hit.group()), line).split("#", 1)[0]
        if depth == 0:
            header = _HEADER.match(bare) if "=" not in bare.split("]")[0] else None
            if header and not _KEY.match(line):
                path: KeyPath = tuple(_parts(header.group(2)))
                if header.group(1) == "[[":
                    counts[path] = counts.get(path, -1) + 1
                    path = (*path, counts[path])
                    if counts[path[:-1]] == 0:
                        yield path[:-1], (number, line.index("[") + 1)
                table, key = path, path
                yield path, (number, line.index("[") + 1)
                continue
            match = _KEY.match(line)
            if match:
                key = (*table, *_parts(match.group(1)))
                yield key, (number, match.start(1) + 1)
        for inline in _INLINE.finditer(bare):
            name = line[inline.start(1) : inline.end(1)].strip("\"'")
            yield (*key, name), (number, inline.start(1) + 1)
        depth = max(0, depth + sum(bare.count(c) for c in "[{") - sum(bare.count(c) for c in "]}"))


def position_of(
    path: Sequence[str | int], positions: dict[KeyPath, tuple[int, int]]
) -> tuple[int, int] | None:
    """Position of the key, or of the nearest enclosing one that has a position."""
    for end in range(len(path), 0, -1):
        if (place := positions.get(tuple(path[:end]))) is not None:
            return place
    return None


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known word that a misspelt one most resembles, or None."""
    close = difflib.get_close_matches(word, sorted(known), n=1, cutoff=0.6)
    return close[0] if close else None
