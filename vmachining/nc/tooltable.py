"""Tool tables: LinuxCNC `.tbl` files, and the `[[tools]]` part of a job file."""

from __future__ import annotations

import math
import re
import tomllib
from pathlib import Path
from typing import Any, Final, NamedTuple

from vmachining.errors import ToolError
from vmachining.textfile import parse_toml, read_bytes

UNITS: Final = {"mm": 1.0, "inch": 25.4}
_WORD: Final = re.compile(r"([A-Za-z])[ \t]*([+-]?(?:\d+\.?\d*|\.\d+))")


class ToolEntry(NamedTuple):
    """One line of a tool table: number, diameter and length in mm (0 where the table is silent).

    x_mm, y_mm : offsets of the tip beside the spindle. turning : the line gives an orientation (Q), which only
    tools of a lathe have. flutes : teeth, 0 where nothing tells them.
    """

    number: int
    diameter_mm: float
    length_mm: float
    x_mm: float = 0.0
    y_mm: float = 0.0
    turning: bool = False
    flutes: int = 0


def read_tool_table(path: Path | str, units: str = "mm") -> dict[int, ToolEntry]:
    """Read a tool table.

    path : a `.toml` job file, else a `.tbl` table (`T3 P3 X0 Y0 Z0.5 D0.25 ;comment`, D diameter, Z length).
    units : "mm" or "inch", of the `.tbl` numbers; a job file says mm in its keys.
    Returns dict: Tool number to entry.
    Raises ToolError: Unreadable file, a line that is not a tool, a number given twice.
    """
    if units not in UNITS:
        raise ToolError(f"tool table units '{units}'", remedy="mm or inch")
    path = Path(path)
    text = read_bytes(path, "tool table", ToolError).decode("utf-8", errors="replace")
    if "\0" in text:
        raise ToolError("the tool table is a binary file", file=str(path))
    toml = path.suffix.lower() == ".toml"
    entries = _from_toml(text, str(path)) if toml else _from_tbl(text, str(path), units)
    table: dict[int, ToolEntry] = {}
    for line, entry in entries:
        if entry.number in table:
            raise ToolError(f"tool {entry.number} is given twice", file=str(path), line=line)
        table[entry.number] = entry
    return table


def _from_tbl(text: str, name: str, units: str) -> list[tuple[int | None, ToolEntry]]:
    scale, out = UNITS[units], list[tuple[int | None, ToolEntry]]()
    for line, raw in enumerate(text.splitlines(), 1):
        content = raw.partition(";")[0].strip()
        if not content:
            continue
        if _WORD.sub("", content).strip():
            what = "not a tool: words like T3 P3 Z0.5 D0.25 are expected"
            raise ToolError(what, file=name, line=line, word=content[:40])
        words = {letter.upper(): float(value) for letter, value in _WORD.findall(content)}
        number = words.get("T")
        if number is None or number < 0 or number != math.floor(number):
            raise ToolError("a tool needs a whole number T", file=name, line=line, word=content[:40])
        diameter, length, x, y = (scale * words.get(letter, 0.0) for letter in "DZXY")
        turning = words.get("Q", 0.0) != 0.0
        out.append((line, ToolEntry(int(number), abs(diameter), length, x, y, turning)))
    return out


def _from_toml(text: str, name: str) -> list[tuple[int | None, ToolEntry]]:
    try:
        rows: Any = parse_toml(text).get("tools", [])
    except tomllib.TOMLDecodeError as exc:
        raise ToolError(f"not a TOML file: {exc}", file=name) from exc
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise ToolError("tools must be written as [[tools]] tables", file=name)
    out = list[tuple[int | None, ToolEntry]]()
    for row in rows:
        number = row.get("number")
        if not isinstance(number, int) or isinstance(number, bool) or number < 0:
            raise ToolError("every tool needs a whole 'number'", file=name, word=str(number))
        sizes = []
        for key in ("diameter_mm", "length_mm"):
            value = row.get(key, 0.0)
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                raise ToolError(f"tool {number}: {key} must be a number", file=name, word=str(value))
            sizes.append(float(value))
        teeth = row.get("flutes", 0)
        teeth = teeth if isinstance(teeth, int) else 0
        out.append((None, ToolEntry(number, sizes[0], sizes[1], flutes=teeth)))
    return out
