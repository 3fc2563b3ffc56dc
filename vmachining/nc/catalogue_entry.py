"""What the catalogue says about one finding."""

from __future__ import annotations

from typing import NamedTuple


class Entry(NamedTuple):
    """Title (a few words), explanation (sentences), hint (what to do; used where no better one is known)."""

    title: str
    explanation: str
    hint: str = ""
