"""Findings by their code, what can only be told from the moves, and both as plain dictionaries for JSON.

What a code means, why it matters and what to do stands in `findings.txt`. A block with an E is skipped; W and I are executed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple

from vmachining.nc.frames import PLANES
from vmachining.nc.model import Finding, Motion, Move, Point, add, subtract


class Entry(NamedTuple):
    """Title (a few words), explanation (sentences), hint (what to do; used where no better one is known)."""

    title: str
    explanation: str
    hint: str = ""


def _entries(text: str) -> dict[str, Entry]:
    """Of a text: a code and its title, indented the explanation and, after a `>`, the hint; # opens a comment."""
    out: dict[str, Entry] = {}
    text = re.sub(r"^#.*\n|^\n", "", text, flags=re.MULTILINE)
    for item in re.split(r"^(?=[A-Z])", text, flags=re.MULTILINE)[1:]:
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


NEAR: float = 1e-6
"""mm: a coordinate this near to a multiple of the increment, or to the end of travel, is one."""


def finding(
    code: str, line: int, n: int | None, message: str, word: str = "", col: int = 1, hint: str = ""
) -> Finding:
    """A finding; hint : in place of that of its catalogue entry."""
    return Finding(line, col, len(word), n, word, code, code[0], message, hint or CATALOGUE[code].hint)


NO_TOOL: Final = "tool {} is not in the tool table"
_NO_TOOL: Final = re.compile(NO_TOOL.format("([0-9]+)"))


def spared(found: Sequence[Finding], moves: Sequence[Move]) -> list[Finding]:
    """A tool that the table lacks is an error where it cuts: probes, and tools that only wait for their change, need no entry."""
    if not any(item.code == "E321" for item in found):
        return list(found)
    cut = {str(move.tool) for move in moves if move.motion not in (Motion.RAPID, Motion.DWELL)}
    idle = [(hit := _NO_TOOL.match(item.message)) is not None and hit[1] not in cut for item in found]
    return [
        item._replace(code="W321", severity="W", message=f"{item.message}, and cuts nothing", hint=CATALOGUE["W321"].hint)
        if item.code == "E321" and spare else item for item, spare in zip(found, idle, strict=True)
    ]  # fmt: skip


def check_moves(
    moves: Sequence[Move],
    stock_top_mm: float | None,
    travel_mm: tuple[Point, Point] | None,
    blu_mm: float | None,
) -> list[Finding]:
    """E373, I374 and W520; each line says it once, I374 the whole program once."""
    out: list[Finding] = []
    if travel_mm is not None:
        out += beyond_travel(moves, *travel_mm)
    if blu_mm is not None and blu_mm > 0.0:
        off = [
            m
            for m in moves
            if any(abs(v / blu_mm - round(v / blu_mm)) * blu_mm > NEAR for v in m.end_machine)
        ]
        what = f"{len(off)} targets are not multiples of {blu_mm:g} mm"
        out += [finding("I374", first.line, first.n, what) for first in off[:1]]
    if stock_top_mm is not None:
        feeds = [move for move in moves if move.motion not in (Motion.RAPID, Motion.DWELL)]
        if feeds and min(min(move.start[2], move.end[2]) for move in feeds) >= stock_top_mm:
            what = f"no feed motion goes below the top of the stock, z = {stock_top_mm:g} mm"
            out.append(finding("W520", feeds[0].line, feeds[0].n, what))
    return out


def beyond_travel(moves: Iterable[Move], low: Point, high: Point) -> Iterable[Finding]:
    """E373 of the lines whose motions leave a box of machine coordinates, arcs on their way too."""
    seen: set[int] = set()
    for move in moves:
        reach = (move.end_machine, move.end_machine) if move.center is None else _arc_box(move)
        for axis, a, b, least, most in zip("XYZ", low, high, *reach, strict=True):
            value = most if most - b > a - least else least
            if not a - NEAR <= value <= b + NEAR and move.line not in seen:
                seen.add(move.line)
                what = f"{axis} would go to {value:.6g} mm, its travel is {a:g} to {b:g} mm"
                yield finding("E373", move.line, move.n, what)


def _arc_box(move: Move) -> tuple[Point, Point]:
    """Machine coordinates of the corners of the box of an arc."""
    from vmachining.nc.rewrite_pieces import move_path  # with arrays, which most checks do without

    path = move_path(move)
    assert path is not None
    shift = subtract(move.end_machine, move.end)
    low, high = ((float(x), float(y), float(z)) for x, y, z in path.bounds)
    return add(low, shift), add(high, shift)


_AXES = {plane.name: (plane.first, plane.second) for plane in PLANES.values()}


def move_record(move: Move, coordinates: str = "machine") -> dict[str, Any]:
    """One canonical motion.

    coordinates : "machine" (all offsets and tool length applied) or "program" (what the active work offset
        sees). The arc centre is shifted like the end point.
    Raises ValueError: Other coordinates.
    """
    if coordinates not in ("machine", "program"):
        raise ValueError(f"coordinates '{coordinates}': machine or program is expected")
    end = move.end_machine if coordinates == "machine" else move.end_program
    rotary = move.rotary_deg if coordinates == "machine" else move.rotary_program
    center = None
    if move.center is not None:
        a, b = _AXES[move.plane]
        aside = (move.center[0] - move.end[a], move.center[1] - move.end[b])
        if coordinates == "program" and move.rotation_deg != 0.0:  # arcs lie in XY then
            c, s = math.cos(math.radians(move.rotation_deg)), math.sin(math.radians(move.rotation_deg))
            aside = (c * aside[0] + s * aside[1], c * aside[1] - s * aside[0])
        center = [end[a] + aside[0], end[b] + aside[1]]
    arc = move.motion in (Motion.ARC_CW, Motion.ARC_CCW)
    more: dict[str, Any] = {}
    if move.circle is not None:
        more["circle"] = {"center_mm": list(move.circle[0]), "normal": list(move.circle[1])}
    if move.axis_end is not None:
        more["axis"] = list(move.axis_end)
    if move.tcp and move.rotary_deg is not None:
        more["tcp"] = True
    return {
        "line": move.line,
        "n": move.n,
        "motion": move.motion.value,
        "end_mm": list(end),
        "rotary_deg": dict(rotary or {}),
        "plane": move.plane,
        "center_mm": center,
        "turns": move.turns if arc else None,
        "feed_mm_min": move.feed_mm_min,
        "tool": move.tool,
        "spindle_rpm": move.spindle_rpm,
        "coolant": move.coolant,
        "dwell_s": move.dwell_s if move.motion is Motion.DWELL else None,
        **more,
    }


def finding_record(finding: Finding) -> dict[str, Any]:
    """One finding of the tester."""
    return {"len" if name == "length" else name: value for name, value in finding._asdict().items()}
