"""What comments of a program say of its stock, as CAM systems print them.

    (STOCK/BLOCK,100,50,10,0,0,10)                        CutViewer, MeshCAM: sizes, then the zero seen from the lowest corner
    (stockMin:0mm, 0mm, -10mm) (stockMax:100mm, ...)      Carbide Create
    ( Material Size) ( X= 300, Y= 200, Z= 12)             Vectric, with Z Origin for Material, XY Origin for Material
    INSERT/Stock Size X85. Y38. Z48.   (STOCK SIZE - X85. Y38. Z48.)
    (Material Thickness: 3/4") (Material length: 7" X width: 5")

A size without a place is laid where the zero of a part usually is (`placed`). Numbers without a unit are in that of the program.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from operator import lt
from typing import Final, NamedTuple

from vmachining.nc.model import Point
from vmachining.nc.toolcomments import INCH, NUMBER, comments, value_of

HEAD: Final = 400
"""Lines that are searched."""

_SIGNED: Final = r"(-?(?:\d+\.?\d*|\.\d+)(?![\d.]))"
_TRIPLE: Final = rf"[ =:]*{_SIGNED}(MM|IN|INCH)?"
_BLOCK: Final = re.compile(r"STOCK/BLOCK((?:[ ]*,[ ]*-?(?:\d+\.?\d*|\.\d+)(?![\d.])){3,6})")
_BOUND: Final = re.compile(
    rf"STOCK[ _]?(MIN|MAX)\b[ :=]*{_SIGNED}(MM|IN)?[, ]+{_SIGNED}(?:MM|IN)?[, ]+{_SIGNED}"
)
_AXES: Final = re.compile(rf"\bX{_TRIPLE}[ ,;]*\bY{_TRIPLE}[ ,;]*\bZ{_TRIPLE}")
_SIZE: Final = re.compile(r"(?:STOCK|MATERIAL|BLANK|WORKPIECE|ROHTEIL)[ _-]*(?:SIZE|DIMENSIONS?)")
_SIDES: Final = {
    side: re.compile(rf"\b(?:MATERIAL|STOCK)?[ ]*{side}[ :=]+{NUMBER}[ ]*(MM\b|INCH\b|IN\b|\")?")
    for side in ("LENGTH", "WIDTH", "THICKNESS")
}
_DATUM: Final = re.compile(r"\b(XY|Z)[ ]+ORIGIN\b(?![ ]*POSITION)[^=:]*[=:](.*)")

_ENDS: Final = (
    (("LEFT",), ("RIGHT",)),
    (("BOTTOM", "LOWER", "FRONT"), ("TOP", "UPPER", "BACK", "REAR")),
    (("BED", "BOTTOM", "TABLE", "BASE", "SPOIL"), ("SURFACE", "TOP")),
)
"""Words for a zero at the low and at the high end of X, Y and Z."""

_NUMBERED: Final = re.compile(r"\d")
OVERCUT: Final = 4.0
"""What a mm below the stock weighs against one within: cutters come from above it, and leave it below by little."""


class StockNote(NamedTuple):
    """line : 1-based, of the first comment; text : that comment. low, high : corners, mm. size : mm, without a place.

    datum : where the zero lies, in the words of the comments, for X and Y, and for Z.
    """

    line: int
    text: str
    low: Point | None = None
    high: Point | None = None
    size: Point | None = None
    datum: tuple[str, str] = ("", "")


def stock_note(lines: Sequence[str], scale: float) -> StockNote | None:
    """What the comments say, None where that is nothing. scale : mm per unit of the program."""
    found = [
        (line, text.upper())
        for line, raw in enumerate(lines[:HEAD], 1)
        for text in ([raw[7:]] if raw.upper().startswith("INSERT/") else comments(raw))
    ]
    bounds: dict[str, tuple[int, str, Point]] = {}
    sides: dict[str, float] = {}
    size: StockNote | None = None
    datum = {"XY": "", "Z": ""}
    for (_, before), (line, text) in pairwise([(0, ""), *found]):
        if (hit := _BLOCK.search(text)) is not None:
            v = [scale * float(part) for part in hit[1].split(",")[1:]]
            if len(v) == 6 and min(v[:3]) > 0.0:
                low = -v[3], -v[4], -v[5]
                return StockNote(line, text, low, (low[0] + v[0], low[1] + v[1], low[2] + v[2]))
            size = StockNote(line, text, size=(v[0], v[1], v[2]))
        elif (hit := _BOUND.search(text)) is not None:
            bounds[hit[1]] = line, text, _point((hit[2], hit[4], hit[5]), hit[3], scale)
        elif (hit := _DATUM.search(text)) is not None:
            datum[hit[1]] = datum[hit[1]] or hit[2].strip()
        elif (hit := _AXES.search(text)) is not None and (_SIZE.search(text) or _SIZE.search(before)):
            size = size or StockNote(line, text, size=_point((hit[1], hit[3], hit[5]), hit[2], scale))
        elif "MATERIAL" in text or "STOCK" in text:
            for side, pattern in _SIDES.items():
                if (hit := pattern.search(text)) is not None:
                    sides[side] = value_of(hit[1]) * _unit(hit[2], scale)
            if len(sides) == 3 and size is None:
                size = StockNote(line, text, size=(sides["LENGTH"], sides["WIDTH"], sides["THICKNESS"]))
    if len(bounds) == 2:
        (line, text, low), (_, _, high) = bounds["MIN"], bounds["MAX"]
        return StockNote(line, text, low, high) if all(map(lt, low, high)) else None
    if size is None or size.size is None or min(size.size) <= 0.0:
        return None
    return size._replace(datum=(datum["XY"], datum["Z"]))


def placed(note: StockNote, low: Sequence[float], high: Sequence[float]) -> tuple[Point, Point, bool]:
    """Corners of a stock, mm, and whether the comments place it; else it lies at the zero where it holds most of the motion.

    low, high : extent of the feed motions, mm.
    """
    if note.low is not None and note.high is not None:
        return note.low, note.high, True
    assert note.size is not None
    plane, level = note.datum
    corners: list[float] = []
    sure = True
    for axis, side in enumerate(note.size):
        words = level if axis == 2 else plane
        low_words, high_words = _ENDS[axis]
        places = ((0.0, low_words), (-side / 2.0, ("CENT", "MIDDLE")), (-side, high_words))
        ways = [at for at, names in places if any(name in words for name in names)]
        if len(ways) != 1 or _NUMBERED.search(words):
            sure = False
            ways = [-side, 0.0] if axis == 2 else [0.0, -side / 2.0, -side]
        deep = OVERCUT if axis == 2 else 0.0
        corners.append(max(
            ways, key=lambda at: min(at + side, high[axis]) - max(at, low[axis]) - deep * max(0.0, at - low[axis])
        ))  # fmt: skip
    x, y, z = corners
    return (x, y, z), (x + note.size[0], y + note.size[1], z + note.size[2]), sure


def _unit(named: str | None, scale: float) -> float:
    return scale if not named else 1.0 if named.startswith("MM") else INCH


def _point(texts: Sequence[str], unit: str | None, scale: float) -> Point:
    x, y, z = (_unit(unit, scale) * float(text) for text in texts)
    return x, y, z
