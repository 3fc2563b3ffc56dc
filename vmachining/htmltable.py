"""Small tables for notebooks: what `_repr_html_` of results is made of."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape


def box_words(low: Iterable[float], high: Iterable[float]) -> str:
    """Ranges of x, y and z."""
    return ", ".join(f"{axis} {a:.6g} to {b:.6g}" for axis, a, b in zip("xyz", low, high, strict=True))


def facts_html(title: str, facts: Iterable[tuple[str, str]]) -> str:
    """A title, and a table of names and what is said of them."""
    return f"<b>{escape(title)}</b>" + table_html((), facts)


def table_html(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table; numbers with six digits, None empty, everything escaped."""
    top = "<tr>" + "".join(f"<th>{escape(name)}</th>" for name in head) + "</tr>" if head else ""
    body = "".join("<tr>" + "".join(f"<td>{_cell(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<table>{top}{body}</table>"


def _cell(value: object) -> str:
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else escape(str(value))
