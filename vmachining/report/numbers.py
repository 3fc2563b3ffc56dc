"""Numbers, times and counts as the pages write them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vmachining.arrays import Floats

if TYPE_CHECKING:
    import polars as pl

ROUNDING_REL = 1e-9
"""Two sums over meshes differ by less than this part of the stock for no other reason than rounding."""


def difference(value: float, of: float) -> str:
    """A difference of two computed volumes, mm^3; rounding of the larger of them is called so."""
    is_rounding = abs(value) <= ROUNDING_REL * abs(of)
    return "0\u00a0mm³ within rounding" if is_rounding else f"{value:+.2g}\u00a0mm³"


def floats(rows: pl.DataFrame, name: str) -> Floats:
    """(n,) values of a column, NaN where it is empty."""
    return np.asarray(rows[name].cast(float).fill_null(float("nan")).to_numpy(), dtype=np.float64)


def card(title: str, value: str, unit: str, note: str, **more: str) -> dict[str, str]:
    """A key figure of a page."""
    return {"title": title, "value": value, "unit": unit, "note": note, **more}


def chip(kind: str, text: str) -> dict[str, str]:
    """A word in a coloured frame. kind : ok, warn, bad, or "" for grey."""
    return {"kind": kind, "text": text}


def number(value: float | None, digits: int = 6) -> str:
    """A number for reading: thousands apart, no more digits than mean something."""
    if value is None:
        return "–"
    text = f"{value:,.{digits}g}" if abs(value) < 10**digits else f"{value:,.0f}"
    if "e" in text and abs(value) >= 1e-6:
        text = f"{value:,.8f}".rstrip("0").rstrip(".")
    return text.replace(",", "\u202f")


def duration(seconds: float | None, beside: float | None = None) -> tuple[str, str]:
    """Value and unit; times that are read side by side have the unit of the larger one."""
    if seconds is None:
        return "–", ""
    longest = max(seconds, beside or 0.0)
    if longest < 120:
        return f"{seconds:.2f}", "s"
    tenths = round(10 * seconds)
    if longest < 7200:
        return f"{tenths // 600}:{tenths % 600 / 10:04.1f}", "min"
    whole = round(seconds)
    return f"{whole // 3600}:{whole % 3600 // 60:02d}:{whole % 60:02d}", "h"


def percent(before: float, after: float) -> str:
    """A change in percent of what was before."""
    return f"{100 * (after - before) / before:+.1f} %" if before > 0 else "–"


def share(part: float | None) -> str:
    """A part of a whole in percent; what is below a thousandth of one is called so."""
    if part is None:
        return "–"
    return "< 0.001 %" if 0.0 < part < 1e-5 else f"{100.0 * part:.3g} %"


def plural(count: int, word: str) -> str:
    """A count with its noun."""
    return f"{count:,} {word}{'' if count == 1 else 's'}".replace(",", "\u202f")
