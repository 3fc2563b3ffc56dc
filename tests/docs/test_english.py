"""Pages, strings, comments and docstrings keep to plain English: phrases that a native reader stumbles over are refused.

A phrase comes with what to write instead.
"""

from __future__ import annotations

import io
import re
import tokenize
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
REWRITTEN = ("README.md", "docs", "vmachining", "models", "notebooks")
REFUSED = {
    r"(is|are) none\b": "does not exist; is not one",
    r"\b(goes|go|went|going) on\b": "continues",
    r"behind (block|the checkpoint|their last|each other|what)": "after",
    r"(?<![\w{.\"`])wants?\b(?![\]}!\[\"`])|\b(is|are) wanted\b": "needs; give; expected",
    r"\bfrom which on\b": "above which",
    r"\bthe same of\b": "the same for",
    r"(?<!there )\b(is|are) no (number|STL|program|file)\b": "is not a",
    r"\b(is|are) told\b|, and told\b|\btold to\b": "is reported",
    r"\ball the same\b": "anyway",
    r"\b(process|column|key|type|file|page)s? of (its|their) own\b": "its own process; a separate column",
    r"\bstands? there twice\b": "duplicate",
    r"\bhold \w+ engines against\b": "compare",
    r"\bone of both\b": "at least one of them",
    r"\bbeside (a|the) pole\b": "near a pole",
    r"\brecogni[sz]ed, and said\b": "detected and reported",
    r"\bif that is sooner\b": "whichever is reached first",
    r"\brows without one go out\b": "remove rows that have none",
    r"\bis no (length|cutter|limit|range|circle|rotation|label|log|address|(finite|whole) number)\b": "is not a",
    r"\bstands? turned\b": "is turned",
    r"\b(run|made|cut|computed)( \w+)? anew\b": "again",
    r"\bat its word\b": "taken as exact",
    r"\bsay it:": "name the setting",
    r"\b(is|are) believed\b": "is accepted",
    r"\bstands behind the\b|\btext behind the end\b": "after",
    r"\bof (one's own|our own)\b(?! making)": "our own; separate",
    r"\bbeside the (program|job file)\b": "next to",
    r"\bput right\b": "corrected",
    r"\b(T|Z|M6) beside|beside (T|Z|M6)\b": "with; in addition to",
}


def files(name: str) -> list[Path]:
    path = ROOT / name
    found = (
        {*path.rglob("*.py"), *path.rglob("*.md"), *path.rglob("findings.txt")} if path.is_dir() else {path}
    )
    return sorted(file for file in found if "node_modules" not in file.parts)


def prose(path: Path) -> list[tuple[int, str]]:
    """(line, text): all of a page without its code; strings and comments of a module."""
    text = path.read_text(encoding="utf-8")
    if path.suffix in (".md", ".txt"):
        plain = re.sub(r"```.*?```", lambda m: "\n" * m.group().count("\n"), text, flags=re.DOTALL)
        return list(enumerate(plain.splitlines(), 1))
    kinds = {tokenize.STRING, tokenize.COMMENT, getattr(tokenize, "FSTRING_MIDDLE", tokenize.STRING)}
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return [
        (token.start[0] + k, line)
        for token in tokens
        if token.type in kinds
        for k, line in enumerate(token.string.splitlines())
    ]


def stumbles(lines):
    return [
        f"{number}: {found.group()!r}, better: {better}"
        for number, line in lines
        for phrase, better in REFUSED.items()
        if (found := re.search(phrase, line)) is not None
    ]


@pytest.mark.parametrize("name", REWRITTEN)
def test_plain_english(name):
    found = {str(path.relative_to(ROOT)): stumbles(prose(path)) for path in files(name)}
    assert {path: lines for path, lines in found.items() if lines} == {}


def test_what_is_found():
    """Strings and comments of a module, prose of a page; neither names of a module nor code of a page."""
    samples = [
        "the job goes on behind block 120", "chord: want a positive number", "'x' is no number", "such blocks are told",
        "every job in a process of its own", "there are none", "spacing 0 mm is no length", "recognised, and said",
    ]  # fmt: skip
    assert all(stumbles([(1, text)]) for text in samples)
    assert not stumbles([(1, "free some disk space, then --resume continues after block 120")])
