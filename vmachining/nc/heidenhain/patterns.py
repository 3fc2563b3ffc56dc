"""Points where a cycle is called: cycles 220 and 221, and PATTERN DEF with CYCL CALL PAT.

    POS1 (X Y Z)                                     one point
    ROW1 (X Y D NUM ROT Z)                           NUM points D apart
    PAT1, FRAME1 (X Y DX DY NUMX NUMY ROT ROTX ROTY Z)  rows, or only the points along their border
    CIRC1 (X Y D START NUM Z)                        a full circle
    PITCHCIRC1 (X Y D START STEP NUM Z)              a part of one

ROT turns the whole figure about X Y, ROTX and ROTY turn only its rows or only its columns; Z adds to the surface of the
cycle. Rows are taken to and fro, as cycle 221 does; the manual draws no order.
Source: HEIDENHAIN TNC 640, user's manual cycle programming, "Pattern definition PATTERN DEF" (public).
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from vmachining.nc.refusal import PenError

MOST: Final = 20_000
"""Holes of a pattern, or steps in a hole: more is a slip of the pen."""

_ITEM: Final = re.compile(r"(POS|ROW|PAT|FRAME|CIRC|PITCHCIRC)[ ]*\d*[ ]*\(([^()]*)\)")
_VALUE: Final = re.compile(
    r"(NUMX|NUMY|NUM|ROTX|ROTY|ROT|START|STEP|DX|DY|D|X|Y|Z)[ ]*([+-]?[ ]*(?:Q[LR]?\d+|\d+\.?\d*|\.\d+))"
)

Values = Mapping[str, float]


class Spot(NamedTuple):
    """Program units; z adds to the surface."""

    x: float
    y: float
    z: float = 0.0


def need(what: str, values: Values, *names: str) -> list[float]:
    """Values that a cycle cannot do without.

    Raises PenError: E331
    """
    missing = next((name for name in names if name not in values), None)
    if missing is not None:
        raise PenError("E331", f"{what} needs {missing}", missing)
    return [values[name] for name in names]


def _count(value: float, name: str) -> int:
    if not 1.0 <= value <= MOST or value != int(value):
        raise PenError("E342", f"{name} is not a whole number of points", name)
    return int(value)


def _on_circle(x: float, y: float, diameter: float, start: float, step: float, n: int) -> list[Spot]:
    angles = [math.radians(start + k * step) for k in range(n)]
    return [Spot(x + diameter / 2.0 * math.cos(a), y + diameter / 2.0 * math.sin(a)) for a in angles]


def _rows(x: float, y: float, steps: tuple[float, float], counts: tuple[int, int], turns: tuple[float, float],
          *, border: bool = False) -> list[Spot]:  # fmt: skip
    """Columns along the direction turns[0], rows along turns[1] + 90 degrees, to and fro."""
    (dx, dy), (m, n), (a, b) = steps, counts, (math.radians(v) for v in turns)
    if m * n > MOST:
        raise PenError("E342", f"over {MOST} points")
    grid = [(i if j % 2 == 0 else m - 1 - i, j) for j in range(n) for i in range(m)]
    if border:
        ring = [(i, 0) for i in range(m)] + [(m - 1, j) for j in range(1, n)]
        if n > 1:
            ring += [(i, n - 1) for i in range(m - 2, -1, -1)]
        if m > 1:
            ring += [(0, j) for j in range(n - 2, 0, -1)]
        grid = ring
    return [
        Spot(x + i * dx * math.cos(a) - j * dy * math.sin(b), y + i * dx * math.sin(a) + j * dy * math.cos(b))
        for i, j in grid
    ]


def points(number: int, values: Values) -> list[Spot]:
    """Points of cycle 220 (circle) or 221 (rows)."""
    if number == 220:
        x, y, diameter, start, stop, step, count = need(
            "cycle 220", values, "Q216", "Q217", "Q244", "Q245", "Q246", "Q247", "Q241"
        )
        n = _count(count, "Q241")
        if step == 0.0:
            whole = abs(abs(stop - start) - 360.0) < 1e-9
            step = (stop - start) / (n if whole else max(1, n - 1))
        return _on_circle(x, y, diameter, start, step, n)
    x, y, dx, dy, columns, rows = need("cycle 221", values, "Q225", "Q226", "Q237", "Q238", "Q242", "Q243")
    turn = values.get("Q224", 0.0)
    return _rows(x, y, (dx, dy), (_count(columns, "Q242"), _count(rows, "Q243")), (turn, turn))


def defined(text: str, number: Callable[[str], float]) -> list[Spot]:
    """Points of a PATTERN DEF; number : value of a numeral or parameter.

    Raises PenError: E109, E331, E342
    """
    out: list[Spot] = []
    if _ITEM.sub("", text).strip():
        raise PenError(
            "E109", f"'{_ITEM.sub('', text).strip()[:40]}' of PATTERN DEF is not understood", "PATTERN DEF"
        )
    for kind, body in _ITEM.findall(text):
        left = _VALUE.sub("", body).strip()
        if left:
            raise PenError("E109", f"'{left[:30]}' of {kind} is not understood", left[:30])
        v = {key: number(value) for key, value in _VALUE.findall(body)}
        x, y = need(kind, v, "X", "Y")
        turn = v.get("ROT", 0.0)
        if kind == "POS":
            found = [Spot(x, y)]
        elif kind == "ROW":
            step, count = need(kind, v, "D", "NUM")
            found = _rows(x, y, (step, 0.0), (_count(count, "NUM"), 1), (turn, turn))
        elif kind in ("PAT", "FRAME"):
            dx, dy, m, n = need(kind, v, "DX", "DY", "NUMX", "NUMY")
            turns = turn + v.get("ROTX", 0.0), turn + v.get("ROTY", 0.0)
            counts = _count(m, "NUMX"), _count(n, "NUMY")
            found = _rows(x, y, (dx, dy), counts, turns, border=kind == "FRAME")
        else:
            size, start, count = need(kind, v, "D", "START", "NUM")
            n = _count(count, "NUM")
            step = need(kind, v, "STEP")[0] if kind == "PITCHCIRC" else 360.0 / n
            found = _on_circle(x, y, size, start, step, n)
        out += [spot._replace(z=v.get("Z", 0.0)) for spot in found]
    return out
