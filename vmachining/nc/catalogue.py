"""Every finding by its code: what it means, why it matters, what to do; the texts stand in `findings.txt`.

A block with an E is skipped; W and I are executed.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final, NamedTuple


class Entry(NamedTuple):
    """Title (a few words), explanation (sentences), hint (what to do; used where no better one is known)."""

    title: str
    explanation: str
    hint: str = ""


def _entries(text: str) -> dict[str, Entry]:
    """Of a text: a code and its title, indented the explanation and, after a `>`, the hint; # opens a comment."""
    out: dict[str, Entry] = {}
    for item in re.split(
        r"^(?=[A-Z])", re.sub(r"^#.*\n|^\n", "", text, flags=re.MULTILINE), flags=re.MULTILINE
    )[1:]:
        head, _, rest = item.partition("\n")
        explanation, _, hint = rest.partition("  > ")
        out[head[:4]] = Entry(head[5:], " ".join(explanation.split()), " ".join(hint.split()))
    return out


CATALOGUE: Final = _entries(Path(__file__).with_name("findings.txt").read_text(encoding="utf-8"))


def explain(code: str) -> Entry:
    """The catalogue entry of a code.

    Raises KeyError: No such code.
    """
    return CATALOGUE[code]
