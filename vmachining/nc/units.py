"""The unit of a program that names none: what its comments, decimals, feeds and extent speak for."""

from __future__ import annotations

import re
from collections.abc import Sequence
from statistics import median
from typing import Final, NamedTuple

from vmachining.nc.settings import UnitName

_NAMED: Final = re.compile(r"(?<![A-Z#\[])G[ \t]*0*(?:20|21|70|71)(?![0-9.])|\bG7[01]0\b", re.IGNORECASE)
_COMMENT: Final = re.compile(r"\(([^()]*)\)|;(.*)")
_INCH: Final = re.compile(r"\b(?:INCH|INCHES|IPM|IN/MIN)\b|\bUNITS?[ :=]+IN\b|[0-9]\"", re.IGNORECASE)
_MM: Final = re.compile(r"\b(?:MM|MILLIMET(?:ER|RE)S?|METRIC|MM/MIN)\b|[0-9]MM\b", re.IGNORECASE)
_PLACE: Final = re.compile(r"[XYZ][ \t]*(-?[0-9]*\.[0-9]*|-?[0-9]+)", re.IGNORECASE)
_FEED: Final = re.compile(r"F[ \t]*([0-9]*\.?[0-9]+)", re.IGNORECASE)

SAMPLE: Final = 5000
FEW: Final = 5
"""Numbers with a fraction from which their decimals say something."""

SLOW, FAST = 60.0, 120.0
"""Feeds per minute that are usual in inches and unusual in mm, and the reverse."""

SMALL, LARGE = 30.0, 60.0
"""Extents that are usual in inches and unusual in mm, and the reverse."""


class Unit(NamedTuple):
    """name : "mm", "inch", or "" where nothing decides. why : the evidence. sure : a comment, or all there is."""

    name: UnitName
    why: str
    sure: bool = False


def names_unit(lines: Sequence[str]) -> bool:
    """Whether some line holds G20, G21, G70, G71, G700 or G710."""
    return any(_NAMED.search(_COMMENT.sub(" ", line)) for line in lines if "G" in line or "g" in line)


def unit_of(lines: Sequence[str]) -> Unit:
    """What the program speaks for: comments first, else two of decimals, feeds and extent without one against."""
    said: list[str] = []
    places, feeds, decimals = list[float](), list[float](), list[int]()
    for line in lines[:SAMPLE]:
        said += [hit[1] or hit[2] or "" for hit in _COMMENT.finditer(line)]
        code = _COMMENT.sub(" ", line)
        for number in _PLACE.findall(code):
            places.append(abs(float(number)) if number.strip("-.") else 0.0)
            if "." in number and number.rstrip(".")[-1:].isdigit() and not number.endswith("."):
                decimals.append(len(number.partition(".")[2]))
        feeds += [float(number) for number in _FEED.findall(code)]
    comment = " ".join(said)
    inch, metric = bool(_INCH.search(comment)), bool(_MM.search(comment))
    if inch != metric:
        return Unit("inch" if inch else "mm", "a comment that names them", True)
    votes = list[tuple[UnitName, str]]()
    if len(decimals) >= FEW:
        deepest = max(decimals)
        if deepest in (3, 4):
            votes.append(("inch" if deepest == 4 else "mm", f"{deepest} decimals"))
    if feeds and (middle := median(feeds)) > 0.0 and not SLOW <= middle <= FAST:
        votes.append(("inch" if middle < SLOW else "mm", f"feeds of {middle:g}"))
    if places and (far := max(places)) > 0.0 and (far < SMALL or far > LARGE):
        votes.append(("inch" if far < SMALL else "mm", f"coordinates up to {far:g}"))
    names = {name for name, _ in votes}
    if len(names) == 1 and len(votes) >= 2:
        return Unit(votes[0][0], " and ".join(why for _, why in votes), len(votes) == 3)
    return Unit("", "nothing in it decides")
