"""Dialect `poses`: a table of tool poses, one row each, as CSV with a header.

    x_mm, y_mm, z_mm            tool tip, work coordinates
    i, j, k                     tool axis: great circle between rows; or
    a_deg, b_deg, c_deg         rotary angles, linear between rows: two of them, by the chain of the machine
    feed_mm_min, rapid, tool    optional; an empty cell keeps what the row before had, rapid is 0 or 1

The block between two rows carries the line of the second. Blank lines and lines that open with # are skipped.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Final, NamedTuple

from vmachining.nc.findings import NO_TOOL, finding
from vmachining.nc.frames import dot
from vmachining.nc.lexer import MAX_VALUE, split_lines
from vmachining.nc.model import Finding, Motion, Move, Point, Reading
from vmachining.nc.settings import Settings

AXIS_TOLERANCE: Final = 1e-6
"""Length of an axis may differ from 1 by this much: vectors are printed with six digits."""

MAX_ERRORS: Final = 1000

TIP: Final = ("x_mm", "y_mm", "z_mm")
AXIS: Final = ("i", "j", "k")
ANGLES: Final = ("a_deg", "b_deg", "c_deg")
OTHERS: Final = ("feed_mm_min", "rapid", "tool")


class Row(NamedTuple):
    """One pose. axis : unit, or None; rotary : degrees, or None."""

    line: int
    tip: Point
    axis: Point | None
    rotary: dict[str, float] | None
    feed: float | None
    rapid: bool
    tool: int


class _RowError(Exception):
    def __init__(self, code: str, message: str, word: str = "", col: int = 1) -> None:
        super().__init__(message)
        self.code, self.word, self.col = code, word, col


def unit_axis(axis: Point) -> tuple[Point, float]:
    """The unit vector, and how far the length was from 1; (0, 0, 0) for a vector of no length."""
    length = math.hypot(*axis)
    if length < 1e-12:
        return (0.0, 0.0, 0.0), 1.0
    if abs(length - 1.0) <= 1e-15:
        return axis, 0.0
    return (axis[0] / length, axis[1] / length, axis[2] / length), abs(length - 1.0)


def read_poses(text: str, settings: Settings) -> Reading:
    """Read a table.

    A wrong row is left out: the tool goes from the row before to the row behind it.
    """
    found: list[Finding] = []
    lines = [(k, line) for k, line in enumerate(split_lines(text), 1) if line.strip()[:1] not in ("", "#")]
    if not lines:
        return Reading([], [finding("E109", 1, None, "the table is empty")], False)
    try:
        columns = _columns(_cells(lines[0][1]))
    except _RowError as exc:
        return Reading([], [finding(exc.code, lines[0][0], None, str(exc))], False)
    tool = min(settings.tools) if settings.tools else 0
    rows: list[Row] = []
    last = Row(0, (0.0, 0.0, 0.0), None, None, None, False, tool)
    for count, (line, raw) in enumerate(lines[1:]):
        try:
            last = _row(line, raw, columns, last, settings, found)
        except _RowError as exc:
            found.append(finding(exc.code, line, None, str(exc), exc.word, exc.col))
            if len(found) >= MAX_ERRORS:
                what = f"{len(found)} findings so far: the {len(lines) - 2 - count} rows after it are not examined"
                found.append(finding("E408", line, None, what))
                break
            continue
        rows.append(last)
    moves = _moves(rows, found)
    if not moves and not found:
        found.append(finding("W406", lines[0][0], None, "the table has fewer than two poses"))
    return Reading(moves, found, True)


def _cells(raw: str) -> list[str]:
    try:
        return [cell.strip() for cell in next(csv.reader([raw]))]
    except csv.Error as exc:
        raise _RowError("E109", str(exc)) from None


def _columns(header: Sequence[str]) -> list[str]:
    names = [name.lower() for name in header]
    if len(names) == 1 and (mark := next((mark for mark in ";\t" if mark in names[0]), None)):
        parted = "semicolons" if mark == ";" else "tabs"
        what = f"the columns are separated by {parted}: commas are expected, and decimal points"
        raise _RowError("E109", what)
    for name in names:
        if name not in (*TIP, *AXIS, *ANGLES, *OTHERS):
            what = f"column '{name}' is not known: the header names x_mm, y_mm, z_mm, i, j, k, ..."
            raise _RowError("E109", what)
        if names.count(name) > 1:
            raise _RowError("E109", f"column '{name}' is given twice")
    missing = [name for name in TIP if name not in names]
    axis = [name for name in AXIS if name in names]
    angles = [name for name in ANGLES if name in names]
    if missing:
        raise _RowError("E109", f"column '{missing[0]}' is missing")
    if axis and angles:
        raise _RowError("E109", "a tool axis and rotary angles exclude each other")
    if axis and len(axis) < 3:
        raise _RowError("E109", "a tool axis has three columns: i, j, k")
    return names


def _row(
    line: int, raw: str, columns: Sequence[str], last: Row, settings: Settings, found: list[Finding]
) -> Row:
    cells = _cells(raw)
    if len(cells) != len(columns):
        raise _RowError("E109", f"{len(cells)} cells, the header has {len(columns)}")
    values: dict[str, float] = {}
    for name, cell in zip(columns, cells, strict=True):
        if not cell and name in OTHERS:
            continue
        try:
            values[name] = float(cell)
        except ValueError:
            values[name] = math.nan
        if not math.isfinite(values[name]) or "_" in cell or not cell.isascii():
            raise _RowError("E102", f"{name} is not a number: '{cell[:40]}'", cell[:40], raw.find(cell) + 1)
        if abs(values[name]) > MAX_VALUE:
            raise _RowError("E102", f"{name} is out of range: {cell[:40]}", cell[:40], raw.find(cell) + 1)
    feed, rapid, tool = values.get("feed_mm_min", last.feed), values.get("rapid", 0.0), values.get("tool")
    if feed is not None and feed < 0.0:
        raise _RowError("E301", f"the feed {feed:g} mm/min is negative")
    if rapid not in (0.0, 1.0):
        raise _RowError("E109", f"rapid is 0 or 1, not {rapid:g}")
    number = last.tool if tool is None else int(tool)
    if number < 0 or (tool is not None and tool != number):
        raise _RowError("E322", f"tool {tool:g} is not a whole number from zero up")
    if number > 0 and settings.tools is not None and number not in settings.tools:
        found.append(finding("E321", line, None, NO_TOOL.format(number)))
    axis, rotary = None, None
    if "i" in values:
        axis, off = unit_axis((values["i"], values["j"], values["k"]))
        if axis == (0.0, 0.0, 0.0):
            raise _RowError("E363", "the tool axis has no length")
        if off > AXIS_TOLERANCE:
            what = f"the tool axis has length {off + 1.0:.6g}, it is normalised"
            found.append(finding("W363", line, None, what))
    names = [name for name in ANGLES if name in values]
    if names:
        rotary = {name[0]: values[name] for name in names}
    tip = values["x_mm"], values["y_mm"], values["z_mm"]
    return Row(line, tip, axis, rotary, feed, rapid == 1.0, number)


def _moves(rows: Sequence[Row], found: list[Finding]) -> list[Move]:
    moves = []
    for before, row in pairwise(rows):
        if before.axis and row.axis and dot(before.axis, row.axis) < -1 + 1e-12:
            what = "the tool axis is reversed: no great circle is the shortest"
            found.append(finding("E364", row.line, None, what))
            continue
        if not row.rapid and not row.feed:
            found.append(finding("E301", row.line, None, "a feed move without feed_mm_min"))
            continue
        motion, feed = (Motion.RAPID, None) if row.rapid else (Motion.LINEAR, row.feed)
        more = before.axis, row.axis, before.rotary, row.rotary, row.rotary, row.rotary is not None
        goal = row.tip, "xy", None, 0, feed, row.tool, 0.0, 0.0, row.tip, row.tip
        moves.append(Move(row.line, None, motion, before.tip, *goal, *more))
    return moves
