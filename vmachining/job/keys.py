"""Where a key stands in a TOML file: tomllib forgets lines, people need them.

A small scanner, not a second parser: it follows table headers, arrays of tables, strings and brackets just
far enough to say on which line the key of a known path starts. It never decides what a file means.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Sequence

__all__ = ["KeyPath", "key_positions", "nearest", "position_of"]

KeyPath = tuple[str | int, ...]
"""E.g. ("tools", 0, "diameter_mm")."""

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
                    found.setdefault(path[:-1], (number, line.index("[") + 1))
                table, key = path, path
                found.setdefault(path, (number, line.index("[") + 1))
                continue
            match = _KEY.match(line)
            if match:
                key = (*table, *_parts(match.group(1)))
                found.setdefault(key, (number, match.start(1) + 1))
        for inline in _INLINE.finditer(bare):
            name = line[inline.start(1) : inline.end(1)].strip("\"'")
            found.setdefault((*key, name), (number, inline.start(1) + 1))
        depth = max(0, depth + sum(bare.count(c) for c in "[{") - sum(bare.count(c) for c in "]}"))
    return found


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
