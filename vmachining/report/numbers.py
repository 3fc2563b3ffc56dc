"""Numbers as people read them."""

from __future__ import annotations

__all__ = ["number"]


def number(value: float | None, digits: int = 6) -> str:
    """A number for reading: thousands apart, no more digits than mean something."""
    if value is None:
        return "–"
    text = f"{value:,.{digits}g}" if abs(value) < 10**digits else f"{value:,.0f}"
    if "e" in text and abs(value) >= 1e-6:
        text = f"{value:,.8f}".rstrip("0").rstrip(".")
    return text.replace(",", "\u202f")
